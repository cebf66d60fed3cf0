//! The PPE on the device: the host queues iterations and looks at the verdict now and then.

use super::kernels::{conjugate_gradient as kernel, coupling, pressure_level as level};
use super::layout::Solve;
use super::{Gpu, buffers};
use crate::compute::Kernel;
use crate::error::{Error, Result};
use crate::kernels::multigrid_levels::LevelSums;
use crate::pressure::{Outcome, PressureReport};

/// Iterations between looks once the last solve's number is used up, with the diagonal and with multigrid.
const CHUNK: [u32; 2] = [8, 2];
/// Most iterations between looks, with the diagonal and with multigrid: so long a signal waits at least.
const MOST: [u32; 2] = [64, 16];
/// The device's word for a solve whose iterations ran out.
const ITERATIONS_RAN_OUT: u32 = 2;
/// Iterations to expect of the diagonal where multigrid has failed.
const ALONE: u32 = 30;

impl Gpu {
    /// Conjugate gradients with the planned preconditioner; where multigrid breaks them down, again with the diagonal
    /// alone, from where they stopped. The residual reported is the true one, ||b - A x|| / ||b||.
    pub(super) fn conjugate_gradient(&mut self) -> Result<PressureReport> {
        if !self.coupled.is_empty() {
            self.context.pass([(coupling::prepare, self.coupled.len() as u64)])?;
        }
        let groups = self.sizes.reduction_groups();
        if self.params.filled {
            self.context.pass([level::sum_source, level::subtract_mean].map(|kernel| (kernel, groups)))?;
        }
        let report = self.preconditioned()?;
        if self.params.filled {
            self.context.pass([level::find_lowest, level::raise].map(|kernel| (kernel, groups)))?;
        }
        Ok(report)
    }

    /// The iteration with the planned preconditioner.
    fn preconditioned(&mut self) -> Result<PressureReport> {
        self.build_levels()?;
        let multigrid = self.levels.is_some();
        let expected = self.expected_iterations.ceil() as u32;
        let first = report(&self.iterate(multigrid, self.settings.warm_start, expected)?);
        if !(multigrid && first.outcome == Outcome::Breakdown) {
            // From step to step the number goes up and down, most of all in still water, where a good first guess saves
            // all but every fifth to tenth solve: the most of late is expected again, and forgotten by half in 35 steps.
            self.expected_iterations = f64::from(first.iterations).max(0.98 * self.expected_iterations);
            return Ok(first);
        }
        let again = report(&self.iterate(false, true, ALONE)?);
        Ok(PressureReport { iterations: first.iterations + again.iterations, ..again })
    }

    /// Iterate until the device's verdict, with a cycle of multigrid or the diagonal; `expected` iterations are queued
    /// before the first look.
    fn iterate(&mut self, cycle: bool, warm_start: bool, expected: u32) -> Result<Solve> {
        let groups = self.sizes.reduction_groups();
        let over_rows = |kernel| (kernel, groups);
        // How bodies answer the vector that is multiplied next.
        let bodies = self.coupled.len() as u64;
        let respond = (bodies > 0).then_some((coupling::respond, bodies));
        let mut iteration = Vec::new();
        // What judges the residual of the last iteration of a chunk; without levels the next chunk does.
        let mut judge = None;
        if let Some(levels) = &self.levels {
            let descend = over_rows(kernel::descend);
            iteration.push(descend);
            // Without the cycle z stays what `advance` made it: the residual over the diagonal.
            if cycle {
                iteration.extend(levels.cycle(groups));
                iteration.push(over_rows(kernel::ascend));
            }
            judge = Some(descend);
        }
        iteration.extend(respond);
        iteration.extend([kernel::multiply, kernel::advance].map(over_rows));
        let around = |pack, residual: [Kernel; 2]| {
            [over_rows(pack)].into_iter().chain(respond).chain(residual.map(over_rows))
        };
        let end = around(kernel::end_pack, [kernel::end_residual, kernel::end]);

        let context = &mut self.context;
        context.clear(buffers::solve)?;
        if !warm_start {
            context.clear(buffers::pressure)?;
        }
        context.pass(around(kernel::pack, [kernel::start_residual, kernel::start]))?;
        // An iteration too many costs empty dispatches, one too few a round trip to the device.
        let mut chunk = (expected + if cycle { 1 } else { expected / 8 + 2 }).min(MOST[usize::from(cycle)]);
        let mut queued = 0;
        loop {
            let iterations = (0..chunk).flat_map(|_| iteration.iter().copied());
            context.pass(iterations.chain(judge).chain(end.clone()))?;
            let solve = context.download(buffers::solve, 1)?[0];
            if solve.done != 0 {
                return Ok(solve);
            }
            queued += chunk;
            makes_progress(queued, self.settings.max_iterations)?;
            if self.stop.is_overdue() {
                return Ok(Solve { outcome: ITERATIONS_RAN_OUT, ..solve });
            }
            chunk = CHUNK[usize::from(cycle)];
        }
    }

    /// Make the levels of multigrid for the system at hand; sums over their operators, finest first. None with the
    /// diagonal as preconditioner.
    pub fn level_sums(&mut self) -> Result<Vec<LevelSums>> {
        self.build_levels()?;
        let Some(levels) = &self.levels else { return Ok(Vec::new()) };
        let (capacity, count) = (levels.capacity as usize, levels.count.len());
        let rows = self.context.download_parts(buffers::row_cell, &[(capacity, count + 1)])?;
        let entry = self.context.download(buffers::entry, 27 * capacity)?;
        let sums = |l: usize| {
            let range = rows[l + 1][0] as usize..rows[l][0] as usize;
            let mut out = LevelSums { rows: range.len(), ..Default::default() };
            for row in range {
                for k in 0..27 {
                    out.add(f64::from(f32::from_bits(entry[k * capacity + row][1])), k == 13);
                }
            }
            out
        };
        Ok((0..count).map(sums).collect())
    }

    /// Make the levels of the multigrid preconditioner for the system at hand.
    pub(super) fn build_levels(&mut self) -> Result<()> {
        let Some(levels) = &self.levels else { return Ok(()) };
        self.context.clear(buffers::cell_mark)?;
        self.context.clear(buffers::aggregate)?;
        self.context.pass(levels.build())
    }
}

/// The device ends a solve at `most` iterations; one that says nothing after so many `queued` has dropped what it was given, as some do when a
/// submission takes them too long.
pub(super) fn makes_progress(queued: u32, most: u32) -> Result<()> {
    if queued <= most.max(1) {
        return Ok(());
    }
    let text = format!(
        "the device makes no progress: its solve of the pressure should have ended at {most} iterations; see whether the \
                        system's log has it reset, and go on from the last checkpoint with --resume"
    );
    Err(Error::gpu(text))
}

pub(super) fn report(solve: &Solve) -> PressureReport {
    let outcome = match solve.outcome {
        0 => Outcome::Converged,
        1 => Outcome::ZeroSource,
        ITERATIONS_RAN_OUT => Outcome::MaxIterations,
        3 => Outcome::Breakdown,
        _ => Outcome::NonFinite,
    };
    let source = f64::from(solve.source_squared);
    let residual = if source > 0.0 { (f64::from(solve.true_residual_squared) / source).sqrt() } else { 0.0 };
    PressureReport { unknowns: solve.unknowns as usize, iterations: solve.iterations, residual, outcome }
}

#[cfg(test)]
mod tests {
    use super::makes_progress;

    #[test]
    fn a_device_that_says_nothing_ends_a_solve() {
        assert!(makes_progress(200, 200).is_ok());
        assert!(makes_progress(201, 200).is_err_and(|e| e.to_string().contains("no progress")));
    }
}
