//! The state of the GPU path: the buffers as they are, to the last bit.

use super::{Gpu, buffers};
use crate::checkpoint::Archive;
use crate::compute::{Buffer, Element};
use crate::error::{Error, Result};
use crate::plan::Arrays;
use bytemuck::Pod;

/// Buffers that hold the state between two steps.
#[cfg(test)]
const SAVED: [&str; 11] = [
    "ledger_sum",
    "position",
    "velocity",
    "pressure",
    "number_density",
    "state",
    "acceleration",
    "reaction",
    "inertia_head",
    "neighbour_list",
    "neighbour_count",
];
/// Buffers that are filled anew before they are read: in every step, or once from the case; and the counters, which
/// are taken in on the host.
#[cfg(test)]
const MADE_ANEW: [&str; 46] = [
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
    "poses",
    "wall_layer",
    "force_chunk",
    "wrench",
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
            self.buffer(archive, buffers::position, g.total())?;
            self.buffer(archive, buffers::velocity, g.total())?;
            self.buffer(archive, buffers::pressure, g.pressure())?;
            self.buffer(archive, buffers::number_density, g.pressure())?;
            self.buffer(archive, buffers::state, g.pressure())?;
            self.buffer(archive, buffers::acceleration, g.fluid)?;
            if self.plan.needs(Arrays::Reaction) {
                self.buffer(archive, buffers::reaction, g.moving_wall)?;
            }
            if self.plan.needs(Arrays::Coupling) {
                self.buffer(archive, buffers::inertia_head, g.moving_wall)?;
            }
            // The lists of the last step serve viscosity, at the start of the next one.
            if self.params.viscosity > 0.0 {
                self.lists(archive)?;
            }
            if self.plan.needs(Arrays::Ledger) {
                self.buffer(archive, buffers::ledger_sum, self.ledger_length())?;
            }
            if archive.is_saving() {
                let seen = self.context.download(buffers::counters, super::layout::counter::WORDS)?;
                self.take_counters(&seen)?;
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
        let mut values: Vec<T> = Vec::new();
        archive.array(name, &mut values, false)?;
        if values.len() != count {
            let have = values.len();
            return Err(Error::misfit(format!("the checkpoint holds {have} of `{name}`, the case {count}")));
        }
        self.context.upload(buffer, &values)
    }

    /// The neighbours that carry pressure, row by row without gaps. The dummies, at the other end of the rows, are
    /// listed anew before they are read.
    fn lists(&mut self, archive: &mut Archive) -> Result<()> {
        let (rows, capacity) = (self.groups.pressure(), self.sizes.capacity as usize);
        self.buffer(archive, buffers::neighbour_count, rows)?;
        let count = self.context.download(buffers::neighbour_count, rows)?;
        let near = |i: usize| (count[i] & 0xfff) as usize;
        let total: usize = (0..rows).map(near).sum();
        let mut packed: Vec<u32> = Vec::with_capacity(total);
        if archive.is_saving() {
            let list = self.context.download(buffers::neighbour_list, capacity * rows)?;
            (0..rows).for_each(|i| packed.extend((0..near(i).min(capacity)).map(|k| list[k * rows + i])));
        }
        archive.array("neighbour_list", &mut packed, false)?;
        if archive.is_saving() {
            return Ok(());
        }
        let fits = packed.len() == total && (0..rows).all(|i| near(i) <= capacity);
        if !fits || packed.iter().any(|&j| j as usize >= self.groups.total()) {
            return Err(Error::damaged("the checkpoint's neighbour lists are damaged"));
        }
        let mut list = vec![0_u32; capacity * rows];
        let mut next = packed.into_iter();
        for i in 0..rows {
            for (k, j) in next.by_ref().take(near(i)).enumerate() {
                list[k * rows + i] = j;
            }
        }
        self.context.upload(buffers::neighbour_list, &list)
    }
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
