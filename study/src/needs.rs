//! What a scene does not need: each kind of scene as planned, against the same scene with every stage forced, dry
//! walls in, nothing left out. The results must be the same to the last bit.

use super::Study;
use super::definition::Setup;
use super::engine::{Context, Job};
use super::report::{Report, short};
use super::row::{Measured, Row, Timing};
use seixo::backend::Backend;
use seixo::backend::cpu::Cpu;
use seixo::case::file::parse;
use seixo::error::Result;
use seixo::fields::Fields;
use seixo::plan::{Plan, Stage};
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use std::sync::Arc;
use std::time::Instant;

/// A kind of scene.
#[derive(Clone, Copy, Debug)]
struct Sort {
    name: &'static str,
    text: &'static str,
    sets: &'static [&'static str],
    steps: u64,
}

const HYDROSTATIC: &str = seixo_cases::HYDROSTATIC;
const DAM_BREAK: &str = seixo_cases::DAM_BREAK;
const GATE: &str = "[run]\nspacing = 0.04\ntime_step = 2e-3\nend = 1\n\
    [tank]\nmin = [0, 0, 0]\nmax = [2.0, 0.48, 0.48]\nopen = [\"z_max\"]\n\
    [[moving_wall]]\nname = \"gate\"\nmin = [0.48, 0, 0]\nmax = [0.52, 0.48, 0.4]\nopen = [\"y_min\", \"y_max\"]\n\
    motion = [[0, 0, 0, 0], [3, 0, 0, 0.33]]\n\
    [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.48, 0.48, 0.36]\n";
const RESTING: &str = seixo_cases::RESTING_CUBE;
const FLOATING: &str = seixo_cases::FLOATING_CUBE;

const SORTS: [Sort; 7] = [
    Sort { name: "dry: a cube on a floor", text: RESTING, sets: &[], steps: 400 },
    Sort { name: "fixed walls only, still water", text: HYDROSTATIC, sets: &[], steps: 60 },
    Sort { name: "fixed walls only, inviscid", text: HYDROSTATIC, sets: &["fluid.viscosity=0"], steps: 60 },
    Sort {
        name: "a dam break before the water spreads",
        text: DAM_BREAK,
        sets: &["run.spacing=0.04"],
        steps: 40,
    },
    Sort {
        name: "no collisions of particles",
        text: HYDROSTATIC,
        sets: &["fluid.collision_distance=0"],
        steps: 60,
    },
    Sort { name: "a gate and no free body", text: GATE, sets: &[], steps: 40 },
    Sort { name: "a floating body", text: FLOATING, sets: &["run.spacing=0.0135"], steps: 40 },
];

/// `plan` with every stage that it leaves out put back.
fn everything(plan: &Plan) -> Plan {
    let mut plan = plan.clone();
    plan.reasons.iter_mut().for_each(|(_, why)| *why = Ok("forced"));
    plan
}

/// What a run leaves: time a step [s], bytes, and the state as bits.
struct Ran {
    seconds: f64,
    bytes: u64,
    bits: Vec<u64>,
}

fn bits(simulation: &mut Simulation) -> Result<Vec<u64>> {
    let mut bits: Vec<u64> = Vec::new();
    for pose in simulation.solids.poses() {
        let q = pose.orientation;
        bits.extend([pose.position, pose.velocity].iter().flat_map(|v| v.to_array()).map(f64::to_bits));
        bits.extend([q.x, q.y, q.z, q.w].map(f64::to_bits));
    }
    if simulation.groups.fluid > 0 {
        let Fields { position, velocity, pressure, .. } = simulation.backend.read()?;
        let n = simulation.groups.fluid;
        let vectors = position[..n].iter().chain(&velocity[..n]).flat_map(|v| v.to_array());
        bits.extend(vectors.chain(pressure).map(f64::to_bits));
    }
    Ok(bits)
}

fn play(sort: &Sort, all: bool) -> Result<(Ran, Plan, Arc<Scene>)> {
    let sets: Vec<String> = sort.sets.iter().map(|s| (*s).to_string()).collect();
    let (case, _, _) = parse(sort.name, sort.text.to_owned(), &sets)?;
    let scene = Arc::new(Scene::build(&case)?);
    let mut simulation = Simulation::with_backend(&case, scene.clone(), |scene, params, plan, settings| {
        let forced = if all { everything(plan) } else { plan.clone() };
        let mut cpu = Cpu::new(scene, params, &forced, settings)?;
        cpu.active_set = !all;
        Ok(Box::new(cpu) as Box<dyn Backend>)
    })?;
    let plan = simulation.plan.clone();
    if all {
        simulation.plan = everything(&plan);
    }
    // The first steps allocate.
    let warm = (sort.steps / 4).max(1);
    let mut clock = Instant::now();
    for k in 0..sort.steps {
        if k == warm {
            clock = Instant::now();
        }
        simulation.step()?;
    }
    let seconds = clock.elapsed().as_secs_f64() / (sort.steps - warm) as f64;
    let bytes = simulation.backend.bytes();
    Ok((Ran { seconds, bytes, bits: bits(&mut simulation)? }, plan, scene))
}

fn measure(sort: &Sort, repetitions: u32) -> Result<Measured> {
    let mut out = Measured {
        machine: format!("CPU, {} threads, f64", rayon::current_num_threads()),
        ..Measured::default()
    };
    let (mut planned, mut forced) = (Vec::new(), Vec::new());
    for k in 0..repetitions.max(1) {
        let (lean, plan, scene) = play(sort, false)?;
        let (whole, _, _) = play(sort, true)?;
        planned.push(lean.seconds);
        forced.push(whole.seconds);
        if k > 0 {
            continue;
        }
        if lean.bits != whole.bits {
            let different = lean.bits.iter().zip(&whole.bits).filter(|(a, b)| a != b).count();
            out.degrade(&format!(
                "{different} of {} numbers differ from those with everything run",
                lean.bits.len()
            ));
        }
        let left: Vec<&str> =
            plan.reasons.iter().filter(|(_, why)| why.is_err()).map(|(stage, _)| stage.name()).collect();
        out.put("stages run [-]", (Stage::ALL.len() - left.len()) as f64);
        out.put("stages left out [-]", left.len() as f64);
        out.put("megabytes as planned", lean.bytes as f64 / 1e6);
        out.put("megabytes with everything", whole.bytes as f64 / 1e6);
        out.put("numbers compared [-]", lean.bits.len() as f64);
        out.work.particles = scene.groups.total() as u64;
        out.work.steps = sort.steps;
        let why: Vec<String> = plan
            .reasons
            .iter()
            .filter_map(|(stage, why)| why.err().map(|why| format!("{} ({why})", stage.name())))
            .collect();
        if out.reason.is_empty() {
            out.reason = if why.is_empty() {
                "left out: dry walls only".into()
            } else {
                format!("left out: {}", why.join(", "))
            };
        }
    }
    out.timing = Timing::of(planned);
    if let (Some(lean), Some(whole)) = (out.timing, Timing::of(forced)) {
        out.put("ms a step as planned", 1e3 * lean.median_s);
        out.put("ms a step with everything", 1e3 * whole.median_s);
        out.put("time saved [%]", 100.0 * (1.0 - lean.median_s / whole.median_s));
    }
    Ok(out)
}

fn finish(rows: &mut [Row], _: Option<f64>) -> Result<Report> {
    let mut report = Report::default();
    for row in rows.iter() {
        let value = |name: &str| row.measured.value(name).map_or_else(|| "?".into(), short);
        let same =
            if row.measured.reason.contains("differ") { "NOT the same" } else { "the same to the last bit" };
        report.findings.push(format!(
            "{}: {} of {} stages, {} instead of {} MB, {} instead of {} ms a step ({} % saved), results {same}; {}.",
            row.method,
            value("stages run [-]"),
            Stage::ALL.len(),
            value("megabytes as planned"),
            value("megabytes with everything"),
            value("ms a step as planned"),
            value("ms a step with everything"),
            value("time saved [%]"),
            row.measured.reason
        ));
    }
    Ok(report)
}

/// The study.
pub fn study(_: &Setup) -> Study {
    let jobs = SORTS.into_iter().map(|sort| {
        let mut job = Job::new(sort.name, &[], sort.steps as f64, |_| Ok(Measured::default()));
        job.identity = format!("{sort:?}");
        job.task = Box::new(move |context: &Context| {
            measure(&sort, if context.repetitions > 0 { context.repetitions } else { 3 })
        });
        job
    });
    Study {
        name: "needs".into(),
        title: "What a scene does not need".into(),
        question: "Each kind of scene as planned against the same scene with every stage run, every array allocated \
                   and every dry wall computed: what is saved, and is anything different?"
            .into(),
        jobs: jobs.collect(),
        finish: Box::new(finish),
    }
}
