//! How fast: seconds per step by stage, against the bytes that each stage must move.
//!
//! Timings of different machines do not compare; what compares is the fraction of the memory floor, which is
//! measured in the same process, and the counts of bytes, dispatches and iterations.

use rayon::prelude::*;
use seixo::backend::traffic::Solve;
use seixo::backend::{Backend, Commands, Timing};
use seixo::case::Case;
use seixo::error::Result;
use seixo::machine::memory_peak;
use seixo::params::Params;
use seixo::plan::{Plan, Stage};
use seixo::pressure::{PressureReport, Settings};
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Instant;

/// Makes a backend for a scene.
pub type Make<'a> = dyn Fn(&Scene, &Params, &Plan, Settings) -> Result<Box<dyn Backend>> + 'a;

/// One stage of one run.
#[derive(Clone, Debug, Serialize)]
pub struct StageRow {
    /// Name.
    pub stage: &'static str,
    /// Mean time a step [s].
    pub seconds: f64,
    /// Bytes that it must move a step.
    pub bytes: u64,
    /// Time that the bytes take at the measured bandwidth over the time it took [-].
    pub floor_fraction: f64,
    /// Kernels started a step; 0 on the CPU.
    pub dispatches: f64,
}

/// What was asked of a device, a step.
struct Asked {
    dispatches: f64,
    submits: f64,
    waits: f64,
    by_stage: BTreeMap<Stage, f64>,
}

impl Asked {
    fn of(now: &Commands, before: &Commands, steps: u64) -> Self {
        let per_step = |now: u64, before: u64| (now - before) as f64 / steps.max(1) as f64;
        let stage = |(&stage, &count): (&Stage, &u64)| {
            (stage, per_step(count, before.by_stage.get(&stage).copied().unwrap_or(0)))
        };
        Self {
            dispatches: per_step(now.dispatches, before.dispatches),
            submits: per_step(now.submits, before.submits),
            waits: per_step(now.waits, before.waits),
            by_stage: now.by_stage.iter().map(stage).collect(),
        }
    }
}

/// Time of a step on an assumed device, from counts alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Implied {
    /// Assumed bandwidth of a data-centre GPU's memory in use [bytes/s].
    pub assumed_bandwidth: f64,
    /// Assumed time of a dispatch, start and barrier [s].
    pub assumed_seconds_per_dispatch: f64,
    /// Counted bytes a step.
    pub bytes: u64,
    /// Time of a step [s]: bytes over bandwidth and dispatches, one after the other.
    pub seconds_per_step: f64,
    /// Of it the pressure solver [s].
    pub pressure_seconds: f64,
}

impl Implied {
    /// What a data-centre GPU of the day reaches.
    const BANDWIDTH: f64 = 3.5e12;
    /// Generous: 2 to 3 microseconds are usual.
    const PER_DISPATCH: f64 = 5e-6;

    /// Of `stages`, and dispatches that belong to none.
    fn of(stages: &[StageRow], dispatches: f64) -> Self {
        let seconds =
            |bytes: u64, dispatches: f64| bytes as f64 / Self::BANDWIDTH + dispatches * Self::PER_DISPATCH;
        let bytes = stages.iter().map(|s| s.bytes).sum();
        let solver = stages.iter().filter(|s| s.stage == Stage::ConjugateGradient.name());
        Self {
            assumed_bandwidth: Self::BANDWIDTH,
            assumed_seconds_per_dispatch: Self::PER_DISPATCH,
            bytes,
            seconds_per_step: seconds(bytes, dispatches),
            pressure_seconds: solver.map(|s| seconds(s.bytes, s.dispatches)).sum(),
        }
    }
}

/// One spacing on one backend.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Processor.
    pub adapter: String,
    /// `f64` or `f32`.
    pub precision: &'static str,
    /// Spacing l0 [m].
    pub spacing: f64,
    /// All particles at the end, without slots for what is to come in.
    pub particles: usize,
    /// Fluid particles at the end.
    pub fluid: usize,
    /// Unknowns of the last solve.
    pub unknowns: usize,
    /// Neighbour pairs listed.
    pub pairs: u64,
    /// Simulated time at which the warm-up began [s].
    pub from: f64,
    /// Steps timed, after the warm-up.
    pub steps: u64,
    /// Mean time a step [s], with no wait between stages.
    pub seconds_per_step: f64,
    /// Middle half of the single steps [s]: 25th and 75th percentile.
    pub quartiles: [f64; 2],
    /// All particles over `seconds_per_step` [1/s].
    pub particles_per_second: f64,
    /// `jacobi` or `multigrid`.
    pub preconditioner: &'static str,
    /// Tolerance of the PPE [-].
    pub tolerance: f64,
    /// Mean iterations a solve.
    pub iterations: f64,
    /// Largest |n / n0 - 1| at the end [-].
    pub density_error_max: f64,
    /// Mean of n / n0 - 1 at the end [-].
    pub density_error_mean: f64,
    /// Copy bandwidth measured in this process, reads and writes counted [bytes/s].
    pub bandwidth: f64,
    /// Bytes that the particles take.
    pub bytes_held: u64,
    /// Most memory that the process has held so far [bytes], where the system tells.
    pub peak_memory: Option<u64>,
    /// How the times of the stages came about.
    pub timing: Timing,
    /// Kernels started a step; 0 on the CPU.
    pub dispatches: f64,
    /// Hand-overs of recorded work to the device a step.
    pub submits: f64,
    /// Times a step that the host waited for the device.
    pub waits: f64,
    /// Slots that carry pressure, and those of them that have neighbours: the rest are dry walls.
    pub slots: [u64; 2],
    /// Counted work of the solver.
    pub solve: Solve,
    /// What the counts amount to on an assumed device; nothing for the CPU.
    pub implied: Option<Implied>,
    /// By stage.
    pub stages: Vec<StageRow>,
}

/// Copy bandwidth of the host's memory, reads and writes counted [bytes/s]: best of five copies of 256 MB.
pub fn host_bandwidth() -> f64 {
    let a = vec![1.0_f64; 32 << 20];
    let mut b = vec![0.0_f64; a.len()];
    let copy = |_| {
        let start = Instant::now();
        b.par_chunks_mut(1 << 16).zip(a.par_chunks(1 << 16)).for_each(|(b, a)| b.copy_from_slice(a));
        16.0 * a.len() as f64 / start.elapsed().as_secs_f64()
    };
    (0..5).map(copy).fold(0.0, f64::max)
}

/// Steps before the clock runs.
const WARM_UP: u64 = 3;

/// Time `steps` steps of `case` once it has reached `from` [s] of simulated time.
///
/// # Errors
/// What keeps the case from starting or ends its run.
pub fn measure(case: &Case, from: f64, steps: u64, bandwidth: f64, make: &Make) -> Result<Row> {
    let scene = Scene::build(case)?;
    let mut sim = Simulation::with_backend(case, scene, make)?;
    let timing = sim.backend.timing();
    while sim.time < from {
        sim.step()?;
    }
    let started = sim.time;
    let mut times = Vec::new();
    let (mut iterations, mut last) = (0.0, PressureReport::default());
    let (mut commands, mut stages) = (Commands::default(), BTreeMap::new());
    for k in 0..WARM_UP + steps {
        if k == WARM_UP {
            sim.observe()?;
            (commands, stages) = (sim.backend.commands(), sim.stages.clone());
        }
        let start = Instant::now();
        last = sim.step()?.pressure;
        if k >= WARM_UP {
            times.push(start.elapsed().as_secs_f64());
            iterations += f64::from(last.iterations);
        }
    }
    // What the last step left to the device is waited for here.
    let start = Instant::now();
    sim.backend.wait()?;
    if let Some(time) = times.last_mut() {
        *time += start.elapsed().as_secs_f64();
    }
    let device = Asked::of(&sim.backend.commands(), &commands, steps);
    let (monitor, _) = sim.observe()?;
    let mut staged = steps;
    if timing == Timing::Waits {
        // The stages by themselves, each waited for.
        sim.wait_for_stages = true;
        stages = sim.stages.clone();
        staged = (steps / 4).max(2);
        for _ in 0..staged {
            last = sim.step()?.pressure;
        }
    }
    let per_step = |stage: Stage| {
        let seconds = sim.stages.get(&stage)? - stages.get(&stage).unwrap_or(&0.0);
        Some((stage, seconds / staged as f64))
    };
    let per_step: Vec<(Stage, f64)> = Stage::ALL.into_iter().filter_map(per_step).collect();
    let traffic = sim.backend.traffic()?;
    let iterations = iterations / steps.max(1) as f64;
    let stages: Vec<StageRow> = per_step
        .into_iter()
        .map(|(stage, seconds)| {
            let bytes = traffic.bytes(stage, iterations);
            let dispatches = device.by_stage.get(&stage).copied().unwrap_or(0.0);
            let floor_fraction = if seconds > 0.0 { bytes as f64 / bandwidth / seconds } else { 0.0 };
            StageRow { stage: stage.name(), seconds, bytes, floor_fraction, dispatches }
        })
        .collect();
    let implied = (timing != Timing::Host).then(|| Implied::of(&stages, device.dispatches));
    let mean = times.iter().sum::<f64>() / times.len().max(1) as f64;
    times.sort_by(f64::total_cmp);
    let quartile = |q: f64| times.get((q * times.len() as f64) as usize).copied().unwrap_or(mean);
    let fluid = monitor.particles as usize;
    let total = sim.groups.total() - sim.groups.fluid + fluid;
    Ok(Row {
        adapter: sim.backend.description(),
        precision: sim.backend.precision(),
        spacing: case.run.spacing,
        particles: total,
        fluid,
        unknowns: last.unknowns,
        pairs: traffic.pairs,
        from: started,
        steps,
        seconds_per_step: mean,
        quartiles: [quartile(0.25), quartile(0.75)],
        particles_per_second: total as f64 / mean,
        preconditioner: sim.plan.preconditioner.name(),
        tolerance: sim.settings().tolerance,
        iterations,
        density_error_max: monitor.density_error_max,
        density_error_mean: monitor.density_error_mean,
        bandwidth,
        bytes_held: sim.backend.bytes(),
        peak_memory: memory_peak(),
        timing,
        dispatches: device.dispatches,
        submits: device.submits,
        waits: device.waits,
        slots: [traffic.slots, traffic.rows],
        solve: traffic.solve,
        implied,
        stages,
    })
}

/// How the time of a step grows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Growth {
    /// Exponent e of time ~ particles^e, all kinds counted. Finer scenes have a larger share of water.
    pub with_particles: f64,
    /// Exponent e of time ~ unknowns^e.
    pub with_unknowns: f64,
}

impl Growth {
    /// By least squares over `rows`; nothing for fewer than two sizes.
    pub fn of(rows: &[Row]) -> Option<Self> {
        Some(Self {
            with_particles: exponent(rows, |r| r.particles)?,
            with_unknowns: exponent(rows, |r| r.unknowns)?,
        })
    }
}

fn exponent(rows: &[Row], size: fn(&Row) -> usize) -> Option<f64> {
    let points: Vec<(f64, f64)> =
        rows.iter().map(|r| ((size(r) as f64).ln(), r.seconds_per_step.ln())).collect();
    let n = points.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let variance: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    (variance > 0.0).then(|| points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / variance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponent_of_a_power_law_is_found() {
        let row = |particles: usize| Row {
            adapter: String::new(),
            precision: "f64",
            spacing: 1.0,
            particles,
            fluid: 0,
            // Particles to the power 1/2: twice the exponent.
            unknowns: particles.isqrt(),
            pairs: 0,
            from: 0.0,
            steps: 1,
            seconds_per_step: 3e-7 * (particles as f64).powf(1.25),
            quartiles: [0.0; 2],
            particles_per_second: 0.0,
            preconditioner: "jacobi",
            tolerance: 1e-3,
            iterations: 0.0,
            density_error_max: 0.0,
            density_error_mean: 0.0,
            bandwidth: 1.0,
            bytes_held: 0,
            peak_memory: None,
            timing: Timing::Host,
            dispatches: 0.0,
            submits: 0.0,
            waits: 0.0,
            slots: [0; 2],
            solve: Solve::default(),
            implied: None,
            stages: Vec::new(),
        };
        let rows = [row(900), row(40_000), row(810_000)];
        let growth = Growth::of(&rows).expect("three points");
        assert!((growth.with_particles - 1.25).abs() < 1e-12 && (growth.with_unknowns - 2.5).abs() < 1e-9);
        assert!(Growth::of(&rows[..1]).is_none());
    }
}
