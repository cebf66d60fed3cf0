//! One simulation as a point of a study: run it, time its steps alone, measure on the way.

use super::engine::{Context, Processor};
use super::measure::{Sampler, Spec};
use super::row::{Measured, Timing, Work};
use seixo::case::file::parse;
use seixo::checkpoint::file::{newest, write};
use seixo::checkpoint::{Archive, Origin};
use seixo::console::remark;
use seixo::error::{Error, Result};
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

/// How far a point is: runs that are over, and the one in progress beside its own state.
#[derive(Debug, Default)]
struct Course {
    /// Seconds of the runs that are over.
    times: Vec<f64>,
    /// Seconds of the one in progress so far.
    seconds: f64,
    work: Work,
    /// What the first run measured, once it is over.
    measured: Option<Measured>,
}

impl Course {
    fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        let Self { times, seconds, work, measured } = self;
        archive.array("point.times", times, false)?;
        archive.number("point.seconds", seconds)?;
        let Work { particles, steps, particle_steps, iterations, products } = work;
        archive.count("point.particles", particles)?;
        archive.count("point.steps", steps)?;
        archive.count("point.particle_steps", particle_steps)?;
        archive.count("point.iterations", iterations)?;
        archive.number("point.products", products)?;
        let mut text = measured.as_ref().map_or_else(Vec::new, |m| serde_json::to_vec(m).unwrap_or_default());
        archive.array("point.measured", &mut text, false)?;
        *measured = serde_json::from_slice(&text).ok();
        Ok(())
    }

    /// Keep what the run of `simulation` measured, with its cost.
    fn keep(&mut self, measured: Measured, simulation: &Simulation) {
        self.work.steps = simulation.steps;
        self.work.particle_steps = self.work.particles * self.work.steps;
        let machine = format!("{}, {}", simulation.backend.description(), simulation.backend.precision());
        self.measured = Some(Measured { work: self.work, machine, ..measured });
    }

    /// Save all of it, if `context` has a place for it.
    fn save(
        &mut self,
        point: &Point,
        context: &Context,
        simulation: &mut Simulation,
        sampler: &mut Option<Sampler>,
    ) -> Result<()> {
        let Some(folder) = &context.states else { return Ok(()) };
        let mut archive = Archive::new();
        self.exchange(&mut archive)?;
        simulation.exchange(&mut archive)?;
        sampler.iter_mut().try_for_each(|s| s.exchange(&mut archive))?;
        let origin = Origin {
            version: env!("CARGO_PKG_VERSION").into(),
            case: point.text.clone(),
            precision: simulation.backend.precision().into(),
            // Counted over all runs, so that the newest file is that of the last one.
            step: simulation.steps + self.work.steps * self.times.len() as u64,
            time: simulation.time,
            ..Origin::default()
        };
        write(folder, &origin, &archive).map(|_| ())
    }
}

/// The state that an earlier attempt at `point` left; none of another version or another processor.
fn saved(point: &Point, context: &Context) -> Result<Option<Archive>> {
    let Some(folder) = &context.states else { return Ok(None) };
    let precision = if point.processor == Processor::Gpu { "f32" } else { "f64" };
    let ours = |o: &Origin| {
        o.version == env!("CARGO_PKG_VERSION") && o.case == point.text && o.precision == precision
    };
    match newest(folder) {
        Ok(found) => Ok(found.filter(|f| ours(&f.origin)).map(|f| f.archive.into_restore())),
        // Damaged: the point starts again, which costs time and nothing else.
        Err(Error::Checkpoint(why)) => {
            remark(&format!("warning: the point starts again: {why}"));
            Ok(None)
        }
        Err(other) => Err(other),
    }
}

fn start(point: &Point, context: &Context) -> Result<Simulation> {
    let (case, _, _) = parse("case", point.text.clone(), &[])?;
    let scene = Scene::build(&case)?;
    let make = |s: &_, p: &_, plan: &_, settings| (context.make)(point.processor, s, p, plan, settings);
    Simulation::with_backend(&case, scene, make)
}

/// Steps of a throw-away run that warm up caches, threads and clocks.
const WARM_STEPS: u32 = 3;

/// Run `point`: once with measures, then again for its time alone. It goes on where an earlier attempt was stopped.
///
/// # Errors
/// What keeps the run from starting, [`Error::Interrupted`]. A run that diverges is a measured point of class failed.
pub fn run(point: &Point, context: &Context) -> Result<Measured> {
    let mut warm = start(point, context)?;
    for _ in 0..WARM_STEPS {
        if warm.step().is_err() {
            break;
        }
    }
    drop(warm);
    let _attended = context.states.is_some().then(|| context.stop.attend());
    let (mut course, mut state) = (Course::default(), saved(point, context)?);
    if let Some(archive) = &mut state {
        course.exchange(archive)?;
    }
    let repetitions = if context.repetitions > 0 { context.repetitions } else { point.repetitions };
    // The clock runs over the steps alone, so the measured run counts like the others.
    while course.measured.is_none() || course.times.len() < repetitions as usize {
        if !play(point, context, &mut course, state.take())? {
            return Ok(course.measured.unwrap_or_default());
        }
    }
    let mut measured = course.measured.unwrap_or_default();
    measured.timing = Timing::of(course.times);
    Ok(measured)
}

/// One run, from `state` or from the start; the first one is measured. Whether it came to its end: else why not is what was
/// measured.
fn play(point: &Point, context: &Context, course: &mut Course, state: Option<Archive>) -> Result<bool> {
    let mut simulation = start(point, context)?;
    let scene = simulation.scene.clone();
    let mut sampler = match course.measured {
        None => Some(Sampler::new(&point.spec, &simulation, &scene)?),
        Some(_) => None,
    };
    if let Some(mut archive) = state {
        simulation.exchange(&mut archive)?;
        sampler.iter_mut().try_for_each(|s| s.exchange(&mut archive))?;
    } else {
        course.seconds = 0.0;
        // What was rounded to the lattice differs from spacing to spacing, and would pass for an error of the scheme.
        if sampler.is_some() {
            let rounded = scene.notes.iter().filter(|note| note.contains(" becomes "));
            rounded.for_each(|note| remark(&format!("note: {note}")));
        }
        sampler.iter_mut().try_for_each(|s| s.sample(&mut simulation, 0, 0.0))?;
        if sampler.is_some() {
            // Slots for what is to come in hold no particles yet.
            let particles = (scene.groups.total() - scene.reserve) as u64;
            course.work = Work { particles, ..Work::default() };
        }
    }
    simulation.stop_with(&context.stop);
    let end = simulation.case.run.end;
    let mut saved = Instant::now();
    while simulation.time < end - 1e-6 * simulation.case.run.time_step {
        if context.states.is_some() && context.stop.is_asked() {
            course.save(point, context, &mut simulation, &mut sampler)?;
            return Err(Error::Interrupted);
        }
        let clock = Instant::now();
        let step = simulation.step();
        course.seconds += clock.elapsed().as_secs_f64();
        match step {
            Ok(report) => {
                if let Some(sampler) = &mut sampler {
                    let iterations = report.pressure.iterations;
                    course.work.iterations += u64::from(iterations);
                    if simulation.plan.wet() {
                        course.work.products += products(simulation.plan.preconditioner, iterations);
                    }
                    sampler.sample(&mut simulation, iterations, report.dt)?;
                }
            }
            // The state kept last is gone back to by the next attempt.
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(error) if sampler.is_some() => {
                let mut failed = Measured::failed(&error);
                failed.put("time reached [s]", simulation.time);
                course.keep(failed, &simulation);
                return Ok(false);
            }
            Err(error) => return Err(error),
        }
        if saved.elapsed() >= context.save_every {
            course.save(point, context, &mut simulation, &mut sampler)?;
            saved = Instant::now();
        }
    }
    let clock = Instant::now();
    simulation.backend.wait()?;
    course.seconds += clock.elapsed().as_secs_f64();
    course.times.push(course.seconds);
    if let Some(sampler) = sampler {
        course.keep(sampler.finish(&mut simulation)?, &simulation);
    }
    Ok(true)
}
