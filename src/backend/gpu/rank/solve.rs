//! The PPE over the devices of many ranks: the iteration of [`super::super::solve`], in which the host joins what each device has summed and shows the
//! vector that is multiplied across the cuts.
//!
//! A device sums in f32 over its workgroups and leaves the sums where its next kernel adds them up; the host puts the sum over all ranks in
//! their place, added in f64 in the order of the ranks. So every device comes to the same numbers and the same verdict, and the kernels are those of a
//! run on one. Multigrid is that of all rows, see [`super::levels`]: the first sweep is shown across the cuts, and what the cells make of
//! its residual is the same on every device, which so corrects its copies as their owners do.

use super::GpuRank;
use super::halo::Shown;
use crate::backend::gpu::buffers;
use crate::backend::gpu::kernels::{
    conjugate_gradient as kernel, coupling, pressure_level as level, wall_excess,
};
use crate::backend::gpu::layout::Solve;
use crate::backend::gpu::solve::{makes_progress, report};
use crate::compute::Kernel;
use crate::error::{Error, Result};
use crate::kernels::device::of_halo::buffer;
use crate::params::Step;
use crate::plan::{Arrays, Stage};
use crate::pressure::{Outcome, PressureReport};

/// Numbers of a workgroup's sum.
const WIDE: usize = 4;

/// Devices have come to different verdicts.
pub(super) fn differ() -> Error {
    Error::gpu(
        "the devices of the ranks have come to different verdicts of one solve: ranks need devices that compute alike, of \
         one make and with one driver",
    )
}

/// What devices meet for.
#[derive(Clone, Copy, Debug, Default)]
struct Meeting {
    /// Sums of the workgroups: the first or the second half of the buffer.
    sums: Option<usize>,
    /// What free bodies answer: to the rows of each rank so far.
    bodies: bool,
    /// The vector beside the positions is shown across the cuts.
    search: bool,
}

/// Of all ranks.
struct Met {
    sums: [f64; WIDE],
    /// Of this device.
    solve: Solve,
}

impl GpuRank {
    pub(super) fn solve(&mut self, step: &Step) -> Result<PressureReport> {
        self.gpu.context.begin(Some(Stage::ConjugateGradient));
        self.gpu.set_step(step)?;
        if self.gpu.plan.needs(Arrays::Coupling) {
            self.over_walls(wall_excess::before_solve, self.gpu.groups.moving_wall)?;
        }
        if !self.gpu.coupled.is_empty() {
            self.over_bodies(coupling::prepare)?;
            self.meet(Meeting { bodies: true, ..Meeting::default() })?;
            self.over_bodies(coupling::subtract)?;
        }
        if self.gpu.params.filled {
            self.over_rows([level::sum_source])?;
            self.meet(Meeting { sums: Some(0), ..Meeting::default() })?;
            self.over_rows([level::subtract_mean])?;
        }
        let report = self.preconditioned()?;
        if self.gpu.params.filled {
            self.over_rows([level::find_lowest])?;
            self.meet_lowest()?;
            self.over_rows([level::raise])?;
        }
        self.show(Shown::Pressure)?;
        if self.gpu.plan.needs(Arrays::Excess) {
            let walls = super::wall_slots(&self.gpu).len();
            let rows = self.gpu.plan.excess.rows(walls, self.gpu.groups.moving_wall);
            self.over_walls(wall_excess::after_solve, rows)?;
        }
        if self.gpu.plan.needs(Arrays::Coupling) {
            self.show(Shown::Head)?;
        }
        Ok(report)
    }

    fn over_walls(&mut self, kernel: Kernel, walls: usize) -> Result<()> {
        self.gpu.context.pass([(kernel, super::groups(walls))])
    }

    fn over_bodies(&mut self, kernel: Kernel) -> Result<()> {
        self.gpu.context.pass([(kernel, self.gpu.coupled.len() as u64)])
    }

    fn over_rows(&mut self, kernels: impl IntoIterator<Item = Kernel>) -> Result<()> {
        let groups = self.gpu.sizes.reduction_groups();
        self.gpu.context.pass(kernels.into_iter().map(|kernel| (kernel, groups)))
    }

    /// The iteration with the planned preconditioner; where multigrid breaks it down, again with the diagonal alone, from where it stopped.
    fn preconditioned(&mut self) -> Result<PressureReport> {
        self.build_levels()?;
        let multigrid = self.gpu.levels.is_some();
        let first = self.iterate(multigrid, self.gpu.settings.warm_start)?;
        if !(multigrid && first.outcome == Outcome::Breakdown) {
            return Ok(first);
        }
        let again = self.iterate(false, true)?;
        Ok(PressureReport { iterations: first.iterations + again.iterations, ..again })
    }

    /// Iterate until the devices' verdict, with a cycle of multigrid or the diagonal.
    fn iterate(&mut self, cycle: bool, warm_start: bool) -> Result<PressureReport> {
        let [of_rows, of_residual] = [Some(0), Some(1)];
        self.gpu.context.clear(buffers::solve)?;
        if !warm_start {
            self.gpu.context.clear(buffers::pressure)?;
        }
        self.over_rows([kernel::pack])?;
        self.multiplied(None)?;
        self.over_rows([kernel::start_residual])?;
        let started = self.meet(Meeting { sums: of_rows, ..Meeting::default() })?;
        self.over_rows([kernel::start])?;
        let mut queued = 0;
        let mut solve = loop {
            let mut met = None;
            if let Some(levels) = self.gpu.levels.clone() {
                // `descend` judges the residual; without a cycle it is there for that alone.
                if cycle {
                    self.meet(Meeting { sums: of_residual, search: true, ..Meeting::default() })?;
                } else {
                    met = Some(self.multiplied(of_residual)?);
                }
                self.over_rows([kernel::descend])?;
                if cycle {
                    self.gpu.context.pass(levels.gather())?;
                    let judged = self.tell_coarse()?;
                    if judged.done != 0 {
                        break judged;
                    }
                    self.gpu.context.pass(levels.correct(self.gpu.sizes.reduction_groups()))?;
                    self.over_rows([kernel::ascend])?;
                    met = Some(self.multiplied(of_residual)?);
                }
            } else {
                met = Some(self.multiplied(of_residual)?);
            }
            if let Some(done) = met.map(|met| met.solve).filter(|solve| solve.done != 0) {
                break done;
            }
            self.over_rows([kernel::multiply])?;
            let met = self.meet(Meeting { sums: of_rows, ..Meeting::default() })?;
            if met.solve.done != 0 {
                break met.solve;
            }
            self.over_rows([kernel::advance])?;
            queued += 1;
            makes_progress(queued, self.gpu.settings.max_iterations)?;
        };
        self.over_rows([kernel::end_pack])?;
        self.multiplied(None)?;
        self.over_rows([kernel::end_residual])?;
        let ended = self.meet(Meeting { sums: of_rows, ..Meeting::default() })?;
        self.over_rows([kernel::end])?;
        solve.true_residual_squared = ended.sums[1] as f32;
        let unknowns = started.sums[2] as usize;
        Ok(PressureReport { unknowns, ..report(&solve) })
    }

    /// Meet for the `sums`, and for what a product with the vector beside the positions takes: its copies, and how bodies answer it.
    fn multiplied(&mut self, sums: Option<usize>) -> Result<Met> {
        let bodies = !self.gpu.coupled.is_empty();
        if bodies {
            self.over_bodies(coupling::respond)?;
        }
        self.meet(Meeting { sums, bodies, search: true })
    }

    /// Puts sums over all ranks in the place of those of each: one wait, one round of all ranks, one message to those beside.
    fn meet(&mut self, meeting: Meeting) -> Result<Met> {
        let packed = if meeting.search { self.pack(Shown::Search)? } else { 0 };
        let groups = self.gpu.sizes.reduction_groups();
        let sum = buffers::partial_sum.size() * groups;
        let first = meeting.sums.map(|half| half as u64 * sum);
        let answer = buffers::coupling.size();
        let at = answer * 6 * self.gpu.groups.moving_wall as u64;
        let bodies = self.gpu.coupled.len() as u64 * 2 * answer;
        let parts = [
            (buffers::solve.id(), 0, buffers::solve.size()),
            (buffers::partial_sum.id(), first.unwrap_or(0), first.map_or(0, |_| sum)),
            if meeting.bodies { (buffers::coupling.id(), at, bodies) } else { (buffers::solve.id(), 0, 0) },
            (buffer::halo.id(), 0, packed),
        ];
        let lengths = parts.map(|(_, _, bytes)| bytes as usize);
        let parts: Vec<_> = parts.into_iter().filter(|(_, _, bytes)| *bytes > 0).collect();
        let bytes = self.gpu.context.download_bytes(&parts, false)?;
        let (solve, rest) = bytes.split_at(lengths[0]);
        let (sums, rest) = rest.split_at(lengths[1]);
        let (answers, halo) = rest.split_at(lengths[2]);
        let solve: Solve = bytemuck::pod_read_unaligned(solve);
        let sums: Vec<[f32; WIDE]> = bytemuck::pod_collect_to_vec(sums);
        let answers: Vec<f32> = bytemuck::pod_collect_to_vec(answers);

        let mut own = vec![f64::from(solve.done)];
        own.extend((0..WIDE).map(|k| sums.iter().map(|sum| f64::from(sum[k])).sum::<f64>()));
        own.extend(answers.iter().map(|&y| f64::from(y)));
        let all = self.share.numbers(&own);
        if all.chunks_exact(own.len()).any(|part| part[0] != own[0]) {
            return Err(differ());
        }
        let mut total = vec![0.0; own.len()];
        for part in all.chunks_exact(own.len()) {
            total.iter_mut().zip(part).for_each(|(sum, v)| *sum += v);
        }
        let total_sums: [f64; WIDE] = std::array::from_fn(|k| total[1 + k]);
        if let Some(first) = first {
            self.put_sums(first, total_sums.map(|v| v as f32), [0.0; WIDE])?;
        }
        if meeting.bodies {
            let answers: Vec<f32> = total[1 + WIDE..].iter().map(|&y| y as f32).collect();
            self.gpu.context.upload_to(buffers::coupling.id(), at, bytemuck::cast_slice(&answers))?;
        }
        if meeting.search {
            self.swap(Shown::Search, halo.to_vec())?;
        }
        Ok(Met { sums: total_sums, solve })
    }

    /// The smallest pressure of all ranks in the place of that of each.
    fn meet_lowest(&mut self) -> Result<()> {
        let groups = self.gpu.sizes.reduction_groups() as usize;
        let own = self.gpu.context.download(buffers::partial_sum, groups)?;
        let least = own.iter().map(|least| f64::from(least[0])).fold(f64::INFINITY, f64::min);
        let least = -self.share.most(-least) as f32;
        self.put_sums(0, [least, 0.0, 0.0, 0.0], [least, 0.0, 0.0, 0.0])
    }

    /// The `sum` of all in the place of that of the first workgroup, from byte `first` on, and `others` in that of the others.
    fn put_sums(&mut self, first: u64, sum: [f32; WIDE], others: [f32; WIDE]) -> Result<()> {
        let mut sums = vec![others; self.gpu.sizes.reduction_groups() as usize];
        sums[0] = sum;
        self.gpu.context.upload_to(buffers::partial_sum.id(), first, bytemuck::cast_slice(&sums))
    }
}
