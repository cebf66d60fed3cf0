//! Random scenes of solids: energy never rises, nothing goes through a wall, the same bits twice.

use super::Study;
use super::definition::Setup;
use super::engine::Job;
use super::random_scenes::{Outcome, Remedy, run, text};
use super::report::{Report, short};
use super::row::{Class, Measured, Row, Work};
use rayon::prelude::*;
use seixo::error::{Error, Result};

/// Scenes of a point.
const BATCH: u64 = 25;
/// Length of a scene [s].
const TIME: f64 = 0.4;
/// Largest rise of the energy over that of the scene [-].
pub const RISE: f64 = 1e-3;
/// Times that what a refusal names is tried: what meets at 100 m/s is estimated anew from each deeper look.
const TRIES: usize = 6;

const WORST: &str = "largest rise of the energy [-]";
const SEED: &str = "seed of that [-]";
const SCENES: &str = "scenes [-]";
const BODIES: &str = "bodies [-]";
const LOST: &str = "scenes that lose a body [-]";
const OTHER_BITS: &str = "scenes with other bits the second time [-]";
const REFUSED: &str = "scenes that end with an error [-]";
const CURED: &str = "of these, run with what it names [-]";
const DEEPEST: &str = "deepest contact over l0 [-]";

/// A scene, and what its errors said: it is run with what they name.
pub struct Scene {
    /// Its seed.
    pub seed: u64,
    /// The last run.
    pub outcome: Outcome,
    /// Errors of the runs before it.
    pub refusals: Vec<String>,
    /// Whether the first run gave the same bits on one thread.
    pub same_bits: bool,
}

/// Runs the scene of `seed` for `time` [s] twice, and where that is refused with the steps and springs that the refusals name.
///
/// # Errors
/// If the scene cannot be built, or a pool of threads cannot start.
pub fn examine(seed: u64, time: f64) -> Result<Scene> {
    let text = text(seed);
    let mut outcome = run(&text, time, Remedy::default())?;
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let alone = alone.map_err(|e| Error::usage("--threads", e.to_string()))?;
    let again = alone.install(|| run(&text, time, Remedy::default()))?;
    let same_bits = again == outcome;
    let mut refusals = vec![];
    let mut remedy = Remedy::default();
    while let (Some(error), true) = (&outcome.refused, refusals.len() < TRIES) {
        let named = Remedy::of(error);
        if named == Remedy::default() {
            break;
        }
        remedy = named.or(remedy);
        refusals.push(error.clone());
        outcome = run(&text, time, remedy)?;
    }
    Ok(Scene { seed, outcome, refusals, same_bits })
}

fn batch(first: u64) -> Result<Measured> {
    let scenes: Result<Vec<Scene>> =
        (first..first + BATCH).into_par_iter().map(|seed| examine(seed, TIME)).collect();
    let scenes = scenes?;
    let mut out = Measured {
        machine: format!("CPU, {} threads, f64", rayon::current_num_threads()),
        ..Measured::default()
    };
    let count = |of: &dyn Fn(&&Scene) -> bool| scenes.iter().filter(of).count() as f64;
    let worst = scenes.iter().max_by(|a, b| a.outcome.rise.total_cmp(&b.outcome.rise));
    if let Some(worst) = worst {
        out.put(WORST, worst.outcome.rise);
        out.put(SEED, worst.seed as f64);
    }
    out.put(SCENES, scenes.len() as f64);
    out.put(BODIES, scenes.iter().map(|s| s.outcome.bodies as f64).sum());
    out.put(DEEPEST, scenes.iter().map(|s| s.outcome.depth).fold(0.0, f64::max));
    out.put(LOST, count(&|s| s.outcome.lost.is_some()));
    out.put(OTHER_BITS, count(&|s| !s.same_bits));
    let ended = |s: &&Scene| s.outcome.refused.is_some();
    out.put(REFUSED, count(&|s| !s.refusals.is_empty() || ended(s)));
    out.put(CURED, count(&|s| !s.refusals.is_empty() && !ended(s)));
    out.limit(WORST, RISE);
    out.limit(OTHER_BITS, 0.0);
    for scene in &scenes {
        if let Some(what) = &scene.outcome.lost {
            out.degrade(&format!("scene {}: {what}", scene.seed));
            out.class = Class::Failed;
        }
        if let Some(what) = &scene.outcome.refused {
            out.degrade(&format!("scene {} ends: {what}", scene.seed));
        }
    }
    out.work = Work { steps: scenes.iter().map(|s| s.outcome.steps).sum(), ..Work::default() };
    Ok(out)
}

fn finish(rows: &mut [Row], _: Option<f64>) -> Result<Report> {
    let sum = |name: &str| rows.iter().filter_map(|r| r.measured.value(name)).sum::<f64>();
    let worst = rows.iter().filter_map(|r| Some((r.measured.value(WORST)?, r.measured.value(SEED)?)));
    let worst = worst.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
    let deepest = rows.iter().filter_map(|r| r.measured.value(DEEPEST)).fold(0.0, f64::max);
    let findings = vec![
        format!(
            "{} scenes with {} bodies: the energy rises by {} of the scene's at most (scene {}); {} lose a body; \
             {} give other bits the second time, on one thread.",
            sum(SCENES),
            sum(BODIES),
            short(worst.0),
            worst.1,
            sum(LOST),
            sum(OTHER_BITS)
        ),
        format!(
            "{} end with an error about a pair that is too fast or too thin for the step; {} of them run to their end \
             with the step, and the spring, that the error names. The deepest contact of all is {} l0.",
            sum(REFUSED),
            sum(CURED),
            short(deepest)
        ),
    ];
    Ok(Report { findings, ..Report::default() })
}

/// The study: 100 scenes, or 1,000.
pub fn study(setup: &Setup) -> Study {
    let scenes: u64 = if setup.full { 1000 } else { 100 };
    let jobs = (0..scenes / BATCH).map(|k| {
        let parameters = [("seeds from", (k * BATCH).to_string())];
        Job::new("random scenes", &parameters, 1.0, move |_| batch(k * BATCH))
    });
    Study {
        name: "contact-random".into(),
        title: "Energy and walls in random scenes".into(),
        question: "2 to 20 boxes, spheres and cylinders of aspects to 1 : 100, masses to 1 : 1e4 and speeds to 50 m/s, in tanks, \
                   open tanks and over tilted planes, with obstacles; restitution 0 to 1, K 1e6 to 1e9 N/m, steps 0.1 to 1 ms, \
                   0.4 s: the largest rise of the total energy above any earlier value over that of the scene (kinetic at the start \
                   and of a fall through the room), and what goes through a wall or a body. Degraded is a rise above 1e-3, \
                   or an end before the time for which no step is named."
            .into(),
        jobs: jobs.collect(),
        finish: Box::new(finish),
    }
}
