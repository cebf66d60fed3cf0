//! The PPE on the device: the host queues iterations and looks at the verdict now and then.

use super::Gpu;
use super::layout::Solve;
use crate::error::Result;
use crate::pressure::{Outcome, PressureReport};

/// Iterations between looks once the last solve's number is used up.
const CHUNK: u32 = 8;

impl Gpu {
    /// Conjugate gradients with the diagonal. The residual reported is the true one, ||b - A x|| / ||b||.
    pub(super) fn conjugate_gradient(&mut self) -> Result<PressureReport> {
        let groups = self.sizes.reduction_groups();
        let context = &mut self.context;
        context.clear("solve")?;
        if !self.settings.warm_start {
            context.clear("pressure")?;
        }
        let name = |entry| (entry, groups);
        context.pass(
            ["conjugate_gradient.pack", "conjugate_gradient.start_residual", "conjugate_gradient.start"]
                .map(name),
        )?;
        // An iteration too many costs an empty dispatch, one too few a round trip to the device.
        let mut chunk = self.last_iterations + self.last_iterations / 8 + 2;
        loop {
            let iteration = ["conjugate_gradient.multiply", "conjugate_gradient.advance"].map(name);
            let end =
                ["conjugate_gradient.end_pack", "conjugate_gradient.end_residual", "conjugate_gradient.end"]
                    .map(name);
            context.pass((0..chunk).flat_map(|_| iteration).chain(end))?;
            let solve = context.download::<Solve>("solve", 1)?[0];
            if solve.done != 0 {
                self.last_iterations = solve.iterations;
                return Ok(report(&solve));
            }
            chunk = CHUNK;
        }
    }
}

fn report(solve: &Solve) -> PressureReport {
    let outcome = match solve.outcome {
        0 => Outcome::Converged,
        1 => Outcome::ZeroSource,
        2 => Outcome::MaxIterations,
        3 => Outcome::Breakdown,
        _ => Outcome::NonFinite,
    };
    let source = f64::from(solve.source_squared);
    let residual = if source > 0.0 { (f64::from(solve.true_residual_squared) / source).sqrt() } else { 0.0 };
    PressureReport { unknowns: solve.unknowns as usize, iterations: solve.iterations, residual, outcome }
}
