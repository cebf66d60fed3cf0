//! One simulation as a point of a study: run it, time its steps alone, measure on the way.

use super::engine::{Context, Processor};
use super::measure::{Sampler, Spec};
use super::row::{Measured, Timing, Work};
use seixo::case::file::parse;
use seixo::error::Result;
use seixo::scene::Scene;
use seixo::scheme::Preconditioner;
use seixo::simulation::Simulation;
use std::time::Instant;

/// Products with the fine matrix that an iteration of the multigrid-preconditioned solver amounts to: one of the
/// conjugate gradients, two residuals of the V-cycle, and coarse levels worth about half of one.
pub const MULTIGRID_PRODUCTS: f64 = 3.5;

/// Products with the fine matrix of a solve of `iterations`.
pub fn products(preconditioner: Preconditioner, iterations: u32) -> f64 {
    let each = if preconditioner == Preconditioner::Multigrid { MULTIGRID_PRODUCTS } else { 1.0 };
    // One more for the residual of the start vector.
    1.0 + each * f64::from(iterations)
}

/// What a point computes.
#[derive(Clone, Debug)]
pub struct Point {
    /// Text of the case, overrides applied.
    pub text: String,
    /// Measures.
    pub spec: Spec,
    /// Processor.
    pub processor: Processor,
    /// Runs, the measured one included.
    pub repetitions: u32,
}

fn start(point: &Point, context: &Context) -> Result<Simulation> {
    let (case, _, _) = parse("case", point.text.clone(), &[])?;
    let scene = Scene::build(&case)?;
    let make = |s: &_, p: &_, plan: &_, settings| (context.make)(point.processor, s, p, plan, settings);
    Simulation::with_backend(&case, scene, make)
}

/// Steps of a throw-away run that warm up caches, threads and clocks.
const WARM_STEPS: u32 = 3;

/// Run `point`: once with measures, then again for its time alone.
///
/// # Errors
/// What keeps the run from starting. A run that diverges is a measured point of class failed.
pub fn run(point: &Point, context: &Context) -> Result<Measured> {
    let mut warm = start(point, context)?;
    for _ in 0..WARM_STEPS {
        if warm.step().is_err() {
            break;
        }
    }
    drop(warm);
    let mut simulation = start(point, context)?;
    let scene = simulation.scene.clone();
    let mut sampler = Sampler::new(&point.spec, &simulation, &scene)?;
    sampler.sample(&mut simulation, 0)?;
    let mut work = Work { particles: scene.groups.total() as u64, ..Work::default() };
    let (mut seconds, mut ended) = (0.0, Ok(()));
    let end = simulation.case.run.end;
    while simulation.time < end - 1e-6 * simulation.case.run.time_step {
        let clock = Instant::now();
        let step = simulation.step();
        seconds += clock.elapsed().as_secs_f64();
        match step {
            Ok(report) => {
                work.iterations += u64::from(report.pressure.iterations);
                if simulation.plan.wet() {
                    work.products += products(simulation.plan.preconditioner, report.pressure.iterations);
                }
                sampler.sample(&mut simulation, report.pressure.iterations)?;
            }
            Err(error) => {
                ended = Err(error);
                break;
            }
        }
    }
    work.steps = simulation.steps;
    work.particle_steps = work.particles * work.steps;
    let mut measured = match &ended {
        Ok(()) => sampler.finish(&mut simulation)?,
        Err(error) => Measured::failed(error),
    };
    measured.work = work;
    let precision = simulation.backend.precision();
    measured.machine = format!("{}, {precision}", simulation.backend.description());
    if ended.is_err() {
        measured.put("time reached [s]", simulation.time);
        return Ok(measured);
    }
    // The clock ran over the steps alone, so the measured run counts like the others.
    let repetitions = if context.repetitions > 0 { context.repetitions } else { point.repetitions };
    let mut times = vec![seconds];
    for _ in 1..repetitions {
        let mut simulation = start(point, context)?;
        let clock = Instant::now();
        while simulation.time < end - 1e-6 * simulation.case.run.time_step {
            simulation.step()?;
        }
        simulation.backend.wait()?;
        times.push(clock.elapsed().as_secs_f64());
    }
    measured.timing = Timing::of(times);
    Ok(measured)
}
