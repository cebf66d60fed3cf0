//! Water that goes from rank to rank, and where borders are then.
//!
//! Between two sorts a particle goes less than [`WAY`] spacings. So only what the last sort left in the outer columns of cells of a slab can leave it,
//! or come into a border column: that much crosses to the host, with the columns as the device finds them, and back. The rest stays where it
//! is; the sort that follows puts all of it in order.

use super::{GpuRank, groups, open, wall_slots};
use crate::backend::Backend;
use crate::backend::gpu::buffers;
use crate::backend::gpu::layout::word_of;
use crate::cells::Grid;
use crate::error::{Error, Result};
use crate::kernels::cell_list::counting_sort;
use crate::kernels::device::halo as kernel;
use crate::kernels::device::of_halo::buffer;
use crate::kernels::move_solids::move_solids;
use crate::kernels::predict::DISPLACEMENT_MAX;
use crate::kernels::shift::SHIFT_MAX;
use crate::plan::{Arrays, Told};
use crate::scene::{Kind, Scene};
use crate::share::room;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use std::ops::Range;

/// Longest way of a particle between two sorts, over the spacing: in `predict`, by two kicks, in `correct`, each no longer than that, and in `shift`.
const WAY: f64 = 4.0 * DISPLACEMENT_MAX + SHIFT_MAX;
/// A slot without a particle of this rank; NO_PARTICLE in shaders/halo.wgsl.
const NO_PARTICLE: u32 = u32::MAX;
/// Column of a particle that is about to be taken out, which happens where it is; TAKEN_OUT there.
const TAKEN_OUT: u32 = u32::MAX - 1;
/// Kind of a copy; FOREIGN in shaders/common.wgsl.
pub(super) const FOREIGN: f32 = 6.0;

/// A particle of water on its way between devices, as it is.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Carried {
    position: [f32; 4],
    velocity: [f32; 4],
    pressure: f32,
    /// Of cells, as the device that it comes from has found it.
    column: u32,
}

impl Carried {
    /// One of which the column is not known yet.
    pub fn new(position: [f32; 4], velocity: [f32; 4], pressure: f32) -> Self {
        Self { position, velocity, pressure, column: NO_PARTICLE }
    }
}

/// Copies that came from the ranks before and after this one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Came {
    copies: [usize; 2],
}

/// The wall layers: in which column of cells each of their particles is, and what the device knows of it. All hosts find the same.
pub(super) struct Walls {
    column: Vec<u32>,
    marks: Vec<f32>,
    grid: Grid,
    /// Of the domain [m].
    middle: DVec3,
}

impl Walls {
    /// Those of `stem`, the solids of a scene.
    pub fn new(stem: &Scene, grid: &Grid, middle: DVec3) -> Self {
        let mut walls = Self { column: Vec::new(), marks: Vec::new(), grid: *grid, middle };
        walls.are_at(&stem.position[..stem.groups.pressure()]);
        walls
    }

    /// They are at `position`; the device knows nothing of it yet.
    pub fn are_at(&mut self, position: &[DVec3]) {
        self.column = position.iter().map(|&x| self.column(x)).collect();
        self.marks.clear();
    }

    /// The column of cells at `x`, in f32 as devices find it: a layer may stand on a border of cells, all of it.
    fn column(&self, x: DVec3) -> u32 {
        let Grid { origin, width, count, periodic, .. } = &self.grid;
        let [x, lower] = [periodic.wrap(x), *origin].map(|at| (at - self.middle).x as f32);
        (((x - lower) / width.x as f32).max(0.0) as u32).min(count[0] - 1)
    }
}

impl GpuRank {
    /// Columns from the end of a slab on that what leaves it or comes into its border column can be in.
    fn outer(&self) -> u32 {
        1 + (WAY * self.gpu.params.spacing / self.gpu.grid.width.x).ceil() as u32
    }

    /// Slots of the water that neither leaves nor comes into a border column.
    fn inner(&self) -> Range<usize> {
        let (mine, own) = (self.share.columns(), self.share.own());
        let [before, after] = self.share.beyond().map(|there| there.map_or(0, |_| self.outer()));
        let (low, high) = (mine.start + before, mine.end.saturating_sub(after));
        if self.starts.is_empty() || low >= high {
            return own.end..own.end;
        }
        let slot = |c: u32| (self.starts[c as usize] as usize).clamp(own.start, own.end);
        slot(low)..slot(high).max(slot(low))
    }

    /// Water that has moved goes to the ranks whose it is now, and copies of that at borders come here.
    pub(super) fn settle(&mut self) -> Result<()> {
        if self.share.is_look_due() {
            self.cut_anew()?;
        }
        let (own, inner) = (self.share.own(), self.inner());
        let came_in = std::mem::take(&mut self.came_in);
        let mut water =
            self.outer_water([own.start..inner.start.max(own.start), inner.end..own.end, came_in])?;
        let at = |t: &Carried| (t.column != TAKEN_OUT).then_some(t.column);
        let [mut before, mut after] = self.share.migrate(&mut water, at);
        self.came = Came { copies: [before.len(), after.len()] };
        before.iter_mut().chain(&mut after).for_each(|copy| copy.position[3] = FOREIGN);
        let here = [before, water, after].concat();
        self.make_room(here.len() + inner.len())?;
        self.place(&here, inner)
    }

    /// The particles of this rank's water in `slots`.
    fn outer_water(&mut self, slots: [Range<usize>; 3]) -> Result<Vec<Carried>> {
        let fluid = self.gpu.groups.fluid;
        let context = &mut self.gpu.context;
        context.pass([(kernel::columns, groups(fluid))])?;
        let (vector, number) = (buffers::position.size(), buffers::pressure.size());
        let [(x, v), (p, c)] = [
            (buffers::position.id(), buffers::velocity.id()),
            (buffers::pressure.id(), buffers::unsorted.id()),
        ];
        let count: usize = slots.iter().map(Range::len).sum();
        let arrays = [(x, vector), (v, vector), (p, number), (c, number)];
        let part = |(id, size): (_, u64)| {
            slots.clone().map(|slots| (id, size * slots.start as u64, size * slots.len() as u64))
        };
        let bytes = context.download_bytes(&arrays.map(part).concat(), false)?;
        let (position, rest) = bytes.split_at(vector as usize * count);
        let (velocity, rest) = rest.split_at(vector as usize * count);
        let (pressure, column) = rest.split_at(number as usize * count);
        let [position, velocity] = [position, velocity].map(bytemuck::pod_collect_to_vec::<u8, [f32; 4]>);
        let pressure: Vec<f32> = bytemuck::pod_collect_to_vec(pressure);
        let column: Vec<u32> = bytemuck::pod_collect_to_vec(column);
        let of = |k: usize| Carried {
            position: position[k],
            velocity: velocity[k],
            pressure: pressure[k],
            column: column[k],
        };
        Ok((0..count).map(of).filter(|t| t.column != NO_PARTICLE).collect())
    }

    /// Puts what is `here` into the slots of the water but for those of the `inner` particles, in their order; what is left of those that were
    /// in use is parked.
    fn place(&mut self, here: &[Carried], inner: Range<usize>) -> Result<()> {
        let (front, behind) = here.split_at(here.len().min(inner.start));
        let end = (inner.end + behind.len()).max(self.live.max(inner.end));
        let lower = self.gpu.params.domain_min - self.gpu.middle;
        let corner = lower.as_vec3().extend(f32::from(Kind::Ghost as u8)).to_array();
        let parked = Carried::new(corner, [0.0, 0.0, 0.0, word_of(0)], 0.0);
        for (first, particles, count) in [(0, front, inner.start), (inner.end, behind, end - inner.end)] {
            let mut slots = particles.to_vec();
            slots.resize(count, parked);
            self.put(first, &slots)?;
        }
        self.live = end;
        Ok(())
    }

    /// Writes `particles` to the slots of the water from `first` on.
    pub(super) fn put(&mut self, first: usize, particles: &[Carried]) -> Result<()> {
        let [positions, velocities]: [Vec<[f32; 4]>; 2] =
            [particles.iter().map(|t| t.position).collect(), particles.iter().map(|t| t.velocity).collect()];
        let pressures: Vec<f32> = particles.iter().map(|t| t.pressure).collect();
        let (context, first) = (&mut self.gpu.context, first as u64);
        let of_vectors = buffers::position.size() * first;
        context.upload_to(buffers::position.id(), of_vectors, bytemuck::cast_slice(&positions))?;
        context.upload_to(buffers::velocity.id(), of_vectors, bytemuck::cast_slice(&velocities))?;
        let of_numbers = buffers::pressure.size() * first;
        context.upload_to(buffers::pressure.id(), of_numbers, bytemuck::cast_slice(&pressures))
    }

    /// Finds the borders in the water as it is sorted, and marks what is whose.
    pub(super) fn find_borders(&mut self) -> Result<()> {
        let (cells, fluid) = (self.gpu.grid.count, self.gpu.groups.fluid);
        let columns = cells[0] as usize;
        let context = &mut self.gpu.context;
        context.reserve(buffer::column_start.id(), 4 * (columns as u64 + 1))?;
        context.pass([(kernel::column_starts, groups(columns + 1))])?;
        self.starts = context.download(buffer::column_start, columns + 1)?;
        self.find_walls();
        // By column once: a rank asks for each of its own, and walls are many.
        let (mut first, mut order) = (Vec::new(), Vec::new());
        counting_sort(&self.walls.column, columns, &mut first, &mut order);
        let starts = &self.starts;
        let of = |c: u32| -> Vec<u32> {
            let (from, to) = (first[c as usize] as usize, first[c as usize + 1] as usize);
            order[from..to].iter().map(|&k| fluid as u32 + k).collect()
        };
        let water = |c: u32| starts[c as usize] as usize..starts[c as usize + 1] as usize;
        self.share.set_borders(water, of);
        self.live = starts[columns] as usize;
        let taken = [0, 1].map(|k| self.share.sides()[k].as_ref().map_or(0, |side| side.water()[1].len()));
        if taken != self.came.copies || self.share.own().len() + taken.iter().sum::<usize>() != self.live {
            let text = "a particle is in another column of cells than the rank has found that it comes from: ranks need devices that compute \
                        alike, of one make and with one driver";
            return Err(Error::gpu(text));
        }
        self.mark_walls()?;
        self.set_lists()
    }

    /// Columns of the wall layers that move.
    fn find_walls(&mut self) {
        for (solid, pose) in self.stem.solids.iter().zip(&self.poses) {
            for (k, &offset) in solid.wall_slots.clone().zip(&solid.wall_offset) {
                self.walls.column[k] = self.walls.column(move_solids(pose, offset).0);
            }
        }
    }

    /// Tells the device which wall layers are this rank's, if that has changed.
    fn mark_walls(&mut self) -> Result<()> {
        let marks: Vec<f32> =
            wall_slots(&self.gpu).map(|i| if self.share.owns(i) { 1.0 } else { 0.0 }).collect();
        if marks.is_empty() || marks == self.walls.marks {
            return Ok(());
        }
        let context = &mut self.gpu.context;
        context.reserve(buffer::halo.id(), 4 * marks.len() as u64)?;
        context.upload(buffer::halo, &marks)?;
        context.pass([(kernel::mark_walls, groups(marks.len()))])?;
        self.walls.marks = marks;
        Ok(())
    }

    /// Cuts the tank anew if the shares, as the last sort left them, have become uneven. Walls that change hands take along what they have.
    fn cut_anew(&mut self) -> Result<()> {
        let mine = self.share.columns();
        let count = |c: usize| match self.starts.get(c..c + 2) {
            Some(starts) if mine.contains(&(c as u32)) => f64::from(starts[1] - starts[0]),
            _ => 0.0,
        };
        let load = (0..self.share.all_columns()).map(count).collect();
        if !self.share.cut_anew(load, &self.gpu.params) {
            return Ok(());
        }
        let walls = wall_slots(&self.gpu);
        self.tell_walls(buffers::pressure, walls.start, walls.len())?;
        if self.gpu.plan.needs(Arrays::Coupling) {
            self.tell_walls(buffers::inertia_head, 0, self.gpu.groups.moving_wall)?;
        }
        if self.gpu.plan.reaction == Told::All { self.tell_reactions(walls.len()) } else { Ok(()) }
    }

    /// Tells all ranks what this step has told so far of the forces on the walls, of `count`, that never move: viscosity has acted. Of those that move
    /// each rank adds up what it has itself.
    fn tell_reactions(&mut self, count: usize) -> Result<()> {
        let mut rows = self.gpu.context.download(buffers::reaction, count)?;
        for axis in 0..3 {
            let mut told: Vec<f64> = rows.iter().map(|row| f64::from(row[axis])).collect();
            self.share.tell_walls(&mut told);
            let still = rows.iter_mut().zip(told).skip(self.gpu.groups.moving_wall);
            still.for_each(|(row, told)| row[axis] = told as f32);
        }
        self.gpu.context.upload(buffers::reaction, &rows)
    }

    /// Tells all ranks the `count` numbers of wall layers from `first` on that this one has.
    fn tell_walls(&mut self, of: crate::compute::Buffer<f32>, first: usize, count: usize) -> Result<()> {
        let own = self.gpu.context.download_parts(of, &[(first, count)])?;
        let mut values: Vec<f64> = own.into_iter().map(f64::from).collect();
        self.share.tell_walls(&mut values);
        let values: Vec<f32> = values.into_iter().map(|v| v as f32).collect();
        self.gpu.context.upload_to(of.id(), of.size() * first as u64, bytemuck::cast_slice(&values))
    }

    /// Slots for `water` particles and copies, more if there are fewer: a device with more room takes over what this one holds.
    pub(super) fn make_room(&mut self, water: usize) -> Result<()> {
        let slots = self.gpu.groups.fluid;
        if water <= slots {
            return Ok(());
        }
        let more = room(water, self.share.all().fluid);
        let seen = self.gpu.counters()?;
        let ledger = self.gpu.plan.needs(Arrays::Ledger);
        let kept = if ledger {
            self.gpu.context.download(buffers::ledger_sum, self.gpu.ledger_length())?
        } else {
            Vec::new()
        };
        let mut fields = self.gpu.read_fields()?;
        self.name_kinds(&mut fields);
        let part = self.stem.part(&[], more, &[], None);
        let mut wider = open(&part, &self.gpu.params, &self.gpu.plan, self.gpu.settings, &self.place)?;
        fields.widen(slots, more - slots, self.gpu.params.domain_min);
        wider.write_fields(&fields)?;
        if ledger {
            // Sums of more workgroups: those that there were, and zeros.
            let mut sums = vec![[0.0_f32; 2]; wider.ledger_length()];
            let of_old = kept.len();
            sums[..of_old].copy_from_slice(&kept);
            wider.context.upload(buffers::ledger_sum, &sums)?;
        }
        wider.context.upload(buffers::now, &[self.gpu.coefficients])?;
        wider.coefficients = self.gpu.coefficients;
        wider.counters = seen;
        wider.dt = self.gpu.dt;
        wider.expected_iterations = self.gpu.expected_iterations;
        wider.context.commands = self.gpu.context.commands.clone();
        if let (Some(to), Some(from)) = (&mut wider.context.clock, &self.gpu.context.clock) {
            to.seconds = from.seconds.clone();
        }
        self.gpu = wider;
        self.share.groups_are(self.gpu.groups);
        self.walls.marks.clear();
        self.lists = super::Lists::default();
        let poses = std::mem::take(&mut self.poses);
        if !poses.is_empty() {
            self.gpu.move_solids(&poses)?;
        }
        self.poses = poses;
        self.gpu.context.begin(Some(crate::plan::Stage::CellList));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::rig::{Rig, there_is_a_device};
    use super::*;
    use crate::case::Case;
    use crate::fields::Fields;
    use crate::ledger::Ledger;
    use crate::plan::Stage;
    use crate::ranks::threads::team;

    const CASE: &str = "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\n[fluid]\nviscosity = 1e-3\nsound_speed = 5\njitter = 0.1\n\
                        [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.5, 0.3, 0.3]\n\
                        [tank]\nmin = [0, 0, 0]\nmax = [1, 0.3, 0.5]\nopen = [\"z_max\"]\n\
                        [[moving_wall]]\nname = \"gate\"\nmin = [0.5, 0, 0]\nmax = [0.6, 0.3, 0.4]\nmotion = [[0, 0, 0, 0], [1, 0, 0, 1]]\n\
                        [output]\nledger = true\n";

    /// The state after six steps in which the gate rises, with more room from the fourth step on where it is `crowded`, and the slots then.
    fn six_steps(crowded: bool) -> (Fields, Option<Ledger>, usize) {
        let case: Case = toml::from_str(CASE).expect("a valid case");
        let mut rig = Rig::new(team(1).remove(0), &case, DVec3::Z);
        for n in 0..6 {
            rig.step(|rank, stage| {
                if n == 3 && crowded && stage == Stage::CellList {
                    // What only this device knows goes on on the next.
                    rank.make_room(rank.gpu.groups.fluid + 300).expect("there is room");
                }
                true
            });
        }
        let rank = &mut rig.rank;
        let ledger = rank.ledger().expect("it is read");
        assert_eq!(rank.counters().expect("they are read").lost, 0);
        (rank.read().expect("it is read"), ledger, rank.gpu.groups.fluid)
    }

    #[test]
    fn a_device_with_more_room_goes_on_where_the_other_was() {
        if !there_is_a_device("a device with more room is") {
            return;
        }
        let ((one, of_one, slots), (other, of_other, more)) = (six_steps(false), six_steps(true));
        assert!(more >= slots + 300, "{slots} {more}");
        let pairs = one.position.iter().zip(&other.position);
        let off = pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        // Sums are over more workgroups.
        assert!(off < 5e-7, "{off}");
        assert_eq!(one.id, other.id);
        let total = |ledger: Option<Ledger>| ledger.expect("it is kept").total();
        let (a, b) = (total(of_one), total(of_other));
        assert!(a.abs() > 1e-3 && (a - b).abs() < 1e-2 * a.abs(), "{a} {b}");
    }
}
