//! What the host learns of the water: counters, sums over it, pressures of single wall particles.

use super::exchange::Part;
use super::layout::{self, MonitorSum, counter};
use super::stretches::Stretches;
use super::{Gpu, buffers, kernels};
use crate::backend::Counters;
use crate::error::Result;
use crate::kernels::body_force::RowPressure;
use crate::kernels::monitor::{speed_most, speed_range};
use crate::monitor::{FluidMonitor, SPEED_BINS};
use crate::plan::{Arrays, Told};
use glam::{DVec3, Vec3};

impl Gpu {
    /// Take in the counters that were read; the device counts from zero again, so that 32 bits last for any run.
    pub(super) fn take_counters(&mut self, seen: &[u32]) -> Result<Counters> {
        let c = &mut self.counters;
        c.lost += u64::from(seen[counter::LOST]);
        c.displacement_clamps += u64::from(seen[counter::DISPLACEMENT_CLAMPS]);
        c.pressure_clamps += u64::from(seen[counter::PRESSURE_CLAMPS]);
        c.negative_pressures += u64::from(seen[counter::NEGATIVE_PRESSURES]);
        c.neighbours_max = c.neighbours_max.max(seen[counter::NEIGHBOURS_MAX]);
        let first = |k: usize| Some(seen[k]).filter(|&n| n != u32::MAX);
        for (total, &count) in c.swallowed.iter_mut().zip(&seen[counter::SWALLOWED..]) {
            *total += u64::from(count);
        }
        c.non_finite = c.non_finite.or(first(counter::NON_FINITE));
        c.overflow = c.overflow.or(first(counter::OVERFLOW).map(|slot| (slot, c.neighbours_max)));
        let out = c.clone();
        let sums = [0..counter::NEIGHBOURS_MAX, counter::SWALLOWED..counter::WORDS];
        if sums.iter().flat_map(|s| &seen[s.clone()]).any(|&n| n > 0) {
            let mut reset = seen.to_vec();
            sums.into_iter().for_each(|s| reset[s].fill(0));
            self.context.upload(buffers::counters, &reset)?;
        }
        Ok(out)
    }

    /// The workgroups' sums and the histogram, put together in f64.
    pub(super) fn finish_monitor(&self, sums: &[MonitorSum], bins: &[u32]) -> FluidMonitor {
        let vector = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
        let mass = self.params.particle_mass();
        let mut out = FluidMonitor::default();
        let (mut momentum, mut position, mut extent) = (DVec3::ZERO, DVec3::ZERO, DVec3::MIN);
        for s in sums {
            out.particles += u64::from(s.particles);
            out.kinetic += mass * f64::from(s.kinetic);
            momentum += mass * vector(s.momentum);
            position += vector(s.position);
            out.speed_max = out.speed_max.max(f64::from(s.speed_squared_max).sqrt());
            extent = extent.max(vector(s.extent_max));
            out.density_error_mean += f64::from(s.density_error);
            out.density_error_max = out.density_error_max.max(f64::from(s.density_error_max));
            out.inner += u64::from(s.inner);
        }
        let count = out.particles as f64;
        position += count * self.middle;
        out.potential = -mass * self.params.gravity.dot(position);
        out.momentum = momentum.to_array();
        out.centroid = (position / count.max(1.0)).to_array();
        out.extent_max = if out.particles > 0 { (extent + self.middle).to_array() } else { [0.0; 3] };
        out.density_error_mean /= out.inner.max(1) as f64;
        let per_bin = speed_range(&self.params, self.dt) / SPEED_BINS as f64;
        let mut histogram = [0_u64; SPEED_BINS];
        histogram.iter_mut().zip(bins).for_each(|(h, &b)| *h = u64::from(b));
        out.speed_most = speed_most(&histogram, out.particles, per_bin, out.speed_max);
        out
    }

    /// Sums over the water and the counters, in one wait.
    pub(super) fn observe(&mut self) -> Result<(FluidMonitor, Counters)> {
        if !self.plan.wet() {
            return Ok(Default::default());
        }
        let (sums, bins, counters) = self.look_at_water()?;
        Ok((self.finish_monitor(&sums, &bins), counters))
    }

    /// The workgroups' sums over the water, the histogram of speeds and the counters, in one wait.
    pub(super) fn look_at_water(&mut self) -> Result<(Vec<MonitorSum>, Vec<u32>, Counters)> {
        let groups = self.sizes.monitor_groups();
        self.context.begin(None);
        self.context.clear(buffers::speed_bin)?;
        self.context.pass([(kernels::monitor::monitor, groups)])?;
        let sums = groups * size_of::<MonitorSum>() as u64;
        let (bins, seen) = (4 * SPEED_BINS as u64, 4 * counter::WORDS as u64);
        let parts = [
            (buffers::monitor_sum.id(), 0, sums),
            (buffers::speed_bin.id(), 0, bins),
            (buffers::counters.id(), 0, seen),
        ];
        let bytes = self.context.download_bytes(&parts, true)?;
        let (sums, rest) = bytes.split_at(sums as usize);
        let (bins, seen) = rest.split_at(bins as usize);
        let counters = self.take_counters(&bytemuck::pod_collect_to_vec::<u8, u32>(seen))?;
        Ok((bytemuck::pod_collect_to_vec(sums), bytemuck::pod_collect_to_vec(bins), counters))
    }

    /// Pressures of wall particles, in one wait.
    pub(super) fn read_wall_pressures(&mut self, slots: &[usize]) -> Result<Vec<RowPressure>> {
        let stretches = Stretches::of(slots);
        let read = self.context.download_bytes(&self.wall_parts(&stretches), false)?;
        Ok(self.wall_told(slots, &stretches, &read))
    }

    /// Where the pressures of `stretches` of wall particles are, and what they are above those on the surface.
    pub(super) fn wall_parts(&self, stretches: &Stretches) -> Vec<Part> {
        let of = |id, size: u64, skip: usize| {
            stretches
                .iter()
                .map(move |(first, count)| (id, (first - skip) as u64 * size, count as u64 * size))
        };
        let mut parts: Vec<_> = of(buffers::pressure.id(), buffers::pressure.size(), 0).collect();
        if self.plan.needs(Arrays::Excess) {
            parts.extend(of(buffers::excess.id(), buffers::excess.size(), self.groups.fluid));
        }
        if self.plan.reaction == Told::All {
            parts.extend(of(buffers::reaction.id(), buffers::reaction.size(), self.groups.fluid));
        }
        parts
    }

    /// Pressures of the particles in `slots` from what was `read` of them.
    pub(super) fn wall_told(&self, slots: &[usize], stretches: &Stretches, read: &[u8]) -> Vec<RowPressure> {
        let values: Vec<f32> = bytemuck::pod_collect_to_vec(read);
        let (pressure, rest) = values.split_at(stretches.len());
        let over = self.plan.needs(Arrays::Excess);
        let (excess, reaction) = rest.split_at(if over { stretches.len() } else { 0 });
        let told = |&slot: &usize| {
            let at = stretches.place(slot);
            let excess = if over { layout::excess(excess[at]) } else { 0.0 };
            let reaction = reaction.get(4 * at..4 * at + 3).map_or(Vec3::ZERO, Vec3::from_slice).as_dvec3();
            RowPressure { pressure: pressure[at].into(), excess, reaction }
        };
        slots.iter().map(told).collect()
    }
}
