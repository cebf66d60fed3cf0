//! The state of the GPU path: the buffers as they are, to the last bit.

use super::layout::{self, Remainder, counter};
use super::{Gpu, buffers};
use crate::checkpoint::Archive;
use crate::compute::{Buffer, Element};
use crate::error::{Error, Result};
use crate::params::Params;
use crate::plan::Arrays;
use bytemuck::Pod;
use glam::DVec3;

/// What holds the neighbour lists of a state, and the dummies of them.
const LISTED: &str = "neighbour_count";
const DUMMIES: &str = "neighbour_dummies";
/// Bytes of neighbour lists that are on the host at a time, unless a plane takes more.
const PLANES_BYTES: usize = 64 << 20;

/// Buffers that hold the state between two steps.
#[cfg(test)]
const SAVED: [&str; 10] = [
    "ledger_sum",
    "position",
    "velocity",
    "pressure",
    "number_density",
    "state",
    "acceleration",
    "inertia_head",
    "neighbour_list",
    "neighbour_count",
];
/// Buffers that are filled anew before they are read: in every step, or once from the case; and the counters, which
/// are taken in on the host.
#[cfg(test)]
const MADE_ANEW: [&str; 49] = [
    "unclipped",
    "clipped",
    "surface_pressure",
    "absorber_zone",
    "emission",
    "outlet",
    "imbalance",
    "source_diagonal",
    "preconditioned",
    "residual",
    "search",
    "partial_sum",
    "solve",
    "hierarchy",
    "cell_mark",
    "cell_row",
    "row_block",
    "row_cell",
    "member",
    "aggregate",
    "entry",
    "coarse",
    "smoothed",
    "corrected",
    "cell_of",
    "cell_count",
    "cell_start",
    "block_sum",
    "unsorted",
    "sorted",
    "moving_slot",
    "static_start",
    "static_particle",
    "params",
    "now",
    "counters",
    "solid_offset",
    "facing",
    "to_surface",
    "poses",
    "wall_layer",
    "force_chunk",
    "wrench",
    "reaction",
    "free_body",
    "coupling",
    "excess",
    "monitor_sum",
    "speed_bin",
];

impl Gpu {
    /// Save the particles, or take them over.
    pub(super) fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        if self.plan.wet() {
            let g = self.groups;
            if archive.is_saving() {
                save_domain(archive, &self.params)?;
                self.buffer(archive, buffers::position, g.total())?;
            } else {
                let places = read_places(archive, &self.params, g.total())?;
                self.context.upload(buffers::position, &places)?;
            }
            self.buffer(archive, buffers::velocity, g.total())?;
            self.buffer(archive, buffers::pressure, g.pressure())?;
            self.buffer(archive, buffers::number_density, g.pressure())?;
            self.buffer(archive, buffers::state, g.pressure())?;
            self.buffer(archive, buffers::acceleration, g.fluid)?;
            // Another case of the scene may have had none: they are zeros then, as at t = 0.
            let held = archive.is_saving() || archive.holds(buffers::inertia_head.id().name());
            let heads = if self.plan.needs(Arrays::Coupling) && held { g.moving_wall } else { 0 };
            self.buffer(archive, buffers::inertia_head, heads)?;
            // The lists of the last step serve viscosity, at the start of the next one. A state of many ranks has none.
            let holds = |name: &str| archive.is_saving() || archive.sections.contains_key(name);
            let listed = holds(LISTED) && (!self.params.surface_stress() || holds(DUMMIES));
            if self.params.viscosity > 0.0 && listed {
                self.lists(archive)?;
            }
            if self.plan.needs(Arrays::Ledger) && !archive.is_of_another() {
                self.buffer(archive, buffers::ledger_sum, self.ledger_length())?;
            }
            if archive.is_saving() {
                let seen = self.context.download(buffers::counters, counter::WORDS)?;
                self.take_counters(&seen)?;
            } else {
                // What a step has counted that was given up since the last look is no more.
                self.context.upload(buffers::counters, &counter::START)?;
            }
            if self.params.viscosity > 0.0 && !listed {
                if self.plan.needs(Arrays::Solids) {
                    // Such a state does not say where solids face; the poses were shown before.
                    let moving = super::groups(self.sizes.moving);
                    self.context.pass([(super::kernels::move_solids::move_solids, moving)])?;
                }
                self.cell_list()?;
                let rows = super::groups(self.sizes.pressure);
                self.context.pass([(super::kernels::neighbour_list::neighbour_list_main, rows)])?;
            }
        }
        self.counters.exchange(archive)?;
        archive.number("dt", &mut self.dt)
    }

    fn buffer<T: Element + Pod>(
        &mut self,
        archive: &mut Archive,
        buffer: Buffer<T>,
        count: usize,
    ) -> Result<()> {
        if count == 0 {
            return Ok(());
        }
        let name = buffer.id().name();
        if archive.is_saving() {
            let mut values = self.context.download(buffer, count)?;
            return archive.array(name, &mut values, false);
        }
        self.context.upload(buffer, &read(archive, buffer, count)?)
    }

    /// The neighbours that carry pressure, and where viscosity reads them the dummies.
    fn lists(&mut self, archive: &mut Archive) -> Result<()> {
        let (rows, capacity) = (self.groups.pressure(), self.sizes.capacity as usize);
        self.buffer(archive, buffers::neighbour_count, rows)?;
        let count = self.context.download(buffers::neighbour_count, rows)?;
        let near: Vec<usize> = count.iter().map(|word| (word & 0xfff) as usize).collect();
        let dummies: Vec<usize> = count.iter().map(|word| (word >> 12 & 0xfff) as usize).collect();
        if !archive.is_saving() && near.iter().zip(&dummies).any(|(a, b)| a + b > capacity) {
            return Err(Error::damaged("the checkpoint's neighbour lists are damaged"));
        }
        self.planes(archive, "neighbour_list", &near, |k| k)?;
        if self.params.surface_stress() {
            // From the other end of the rows.
            self.planes(archive, DUMMIES, &dummies, |k| capacity - 1 - k)?;
        }
        Ok(())
    }

    /// As many neighbours of each row as it has `held`, row by row without gaps; number k of a row stands in plane `plane(k)`. They travel some
    /// planes at a time: together these are many times what the rows hold.
    fn planes(
        &mut self,
        archive: &mut Archive,
        name: &'static str,
        held: &[usize],
        plane: impl Fn(usize) -> usize,
    ) -> Result<()> {
        let (rows, capacity) = (held.len(), self.sizes.capacity as usize);
        // Of a state that ends a run by too many neighbours the rows hold no more than fits.
        let held: Vec<usize> = held.iter().map(|&n| n.min(capacity)).collect();
        let total: usize = held.iter().sum();
        let most = held.iter().copied().max().unwrap_or(0);
        let batch = (PLANES_BYTES / (size_of::<u32>() * rows.max(1))).max(1);
        let batches = || (0..most).step_by(batch).map(|first| (first, most.min(first + batch)));
        // The planes of a batch lie side by side, from the lowest on.
        let lowest = |first: usize, end: usize| plane(first).min(plane(end - 1));
        // Of each batch the row's neighbours in it, with their places in `packed`.
        let each = |first: usize, end: usize, take: &mut dyn FnMut(usize, usize)| {
            let mut start = 0;
            for (i, &n) in held.iter().enumerate() {
                let low = lowest(first, end);
                (first..n.min(end)).for_each(|k| take((plane(k) - low) * rows + i, start + k));
                start += n;
            }
        };
        let mut packed = vec![0_u32; if archive.is_saving() { total } else { 0 }];
        if archive.is_saving() {
            for (first, end) in batches() {
                let part = [(lowest(first, end) * rows, (end - first) * rows)];
                let list = self.context.download_parts(buffers::neighbour_list, &part)?;
                each(first, end, &mut |at, place| packed[place] = list[at]);
            }
        }
        archive.array(name, &mut packed, false)?;
        if archive.is_saving() {
            return Ok(());
        }
        if packed.len() != total || packed.iter().any(|&j| j as usize >= self.groups.total()) {
            return Err(Error::damaged("the checkpoint's neighbour lists are damaged"));
        }
        for (first, end) in batches() {
            // What else stands in these planes is kept: near ones and dummies of other rows may share them.
            let part = [(lowest(first, end) * rows, (end - first) * rows)];
            let mut list = self.context.download_parts(buffers::neighbour_list, &part)?;
            each(first, end, &mut |at, place| list[at] = packed[place]);
            let place = (size_of::<u32>() * part[0].0) as u64;
            self.context.upload_to(buffers::neighbour_list.id(), place, bytemuck::cast_slice(&list))?;
        }
        Ok(())
    }
}

/// The corners of the domain, from whose middle a state's places count [m].
const DOMAIN: &str = "domain";

/// Saves the domain of `params`.
pub(super) fn save_domain(archive: &mut Archive, params: &Params) -> Result<()> {
    archive.array(DOMAIN, &mut vec![params.domain_min.to_array(), params.domain_max.to_array()], false)
}

/// The `count` places that a state holds, from the middle of the domain of `params`: another case may have had another one.
pub(super) fn read_places(archive: &mut Archive, params: &Params, count: usize) -> Result<Vec<[f32; 4]>> {
    let mut places = read(archive, buffers::position, count)?;
    let mut domain = vec![params.domain_min.to_array(), params.domain_max.to_array()];
    // States of before it was saved have none.
    if archive.holds(DOMAIN) {
        archive.array(DOMAIN, &mut domain, false)?;
    }
    let [min, max] = domain[..] else { return Err(Error::damaged("the checkpoint's domain is damaged")) };
    let (domain_min, domain_max) = (DVec3::from(min), DVec3::from(max));
    if domain_min != params.domain_min || domain_max != params.domain_max {
        let theirs = Params { domain_min, domain_max, ..params.clone() };
        let shift = layout::middle(&theirs) - layout::middle(params);
        let (from, to) = (Remainder::new(&theirs), Remainder::new(params));
        for place in &mut places {
            let at = from.place(place) + shift;
            let packed = to.pack(at);
            // Of what is no water the fourth number is the kind.
            *place = if place[3] < 0.5 { packed } else { [packed[0], packed[1], packed[2], place[3]] };
        }
    }
    Ok(places)
}

/// The `count` elements of `buffer` that a state holds, unless it is none.
pub(super) fn read<T: Element + Pod>(
    archive: &mut Archive,
    buffer: Buffer<T>,
    count: usize,
) -> Result<Vec<T>> {
    let (name, mut values) = (buffer.id().name(), Vec::new());
    if count == 0 {
        return Ok(values);
    }
    archive.array(name, &mut values, false)?;
    if values.len() != count {
        let have = values.len();
        return Err(Error::misfit(format!("the checkpoint holds {have} of `{name}`, the case {count}")));
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_buffer_is_part_of_the_state_or_made_anew() {
        for row in buffers::TABLE {
            let name = row.spec.id.name();
            let (saved, anew) = (SAVED.contains(&name), MADE_ANEW.contains(&name));
            assert!(saved != anew, "`{name}` must be saved by a checkpoint, or be named as made anew");
        }
    }
}
