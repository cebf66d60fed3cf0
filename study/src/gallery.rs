//! Extreme scenes: for each, what must happen, and what did.
//!
//! Whatever the scene, a run may end right or in a typed error; it may not hang, panic, keep a number that is
//! none, or lose a particle without counting it.

use super::Study;
use super::definition::Setup;
use super::engine::{Context, Job, Processor, first_line};
use super::gallery_scenes::{Expect, Scene as Extreme, scenes};
use super::report::Report;
use super::row::{Class, Measured, Row};
use seixo::case::file::parse;
use seixo::error::{Error, Result};
use seixo::scene::{Kind, Scene};
use seixo::simulation::Simulation;

/// How a scene ended.
enum End {
    /// All steps done.
    Done,
    /// The case or its scene was refused.
    Refused(String),
    /// A guard stopped it.
    Stopped(String),
}

/// What is wrong with the state of `simulation`: numbers that are none, particles that nobody counted.
///
/// # Errors
/// What the backend says when it is read.
pub fn faults(simulation: &mut Simulation) -> Result<Vec<String>> {
    let mut faults = Vec::new();
    for (k, pose) in simulation.solids.poses().iter().enumerate() {
        if !(pose.position.is_finite() && pose.velocity.is_finite() && pose.orientation.is_finite()) {
            faults.push(format!("the pose of {} is not a number", simulation.solids.name(k)));
        }
    }
    if !simulation.plan.wet() {
        return Ok(faults);
    }
    let (fields, counters) = (simulation.backend.read()?, simulation.backend.counters()?);
    let fluid = simulation.groups.fluid;
    let live: Vec<usize> = (0..fluid).filter(|&i| fields.kind[i] == Kind::Fluid).collect();
    let bad =
        live.iter().filter(|&&i| !(fields.position[i].is_finite() && fields.velocity[i].is_finite())).count();
    if bad > 0 {
        faults.push(format!("{bad} live particles have a position or velocity that is not a number"));
    }
    let bad = fields.pressure.iter().filter(|p| !p.is_finite()).count();
    if bad > 0 {
        faults.push(format!("{bad} pressures are not numbers"));
    }
    // Ghosts are counted when they are sorted out, at the start of a step: right after a step none is open.
    let gone = (fluid - live.len()) as u64;
    if gone != counters.lost {
        faults.push(format!("{gone} particles are gone, {} are counted as lost", counters.lost));
    }
    let mut ids: Vec<u32> = fields.id[..fluid].to_vec();
    ids.sort_unstable();
    ids.dedup();
    if ids.len() != fluid {
        faults.push(format!("{} of {fluid} particle numbers are left", ids.len()));
    }
    Ok(faults)
}

fn play(extreme: &Extreme, processor: Processor, context: &Context) -> Result<(End, Measured)> {
    let mut out = Measured::default();
    let refused = |error: Error, out| match error {
        refusal if refusal.exit_code() == 2 => Ok((End::Refused(refusal.to_string()), out)),
        other => Err(other),
    };
    let scene = parse(extreme.name, extreme.text.clone(), &extreme.sets)
        .and_then(|(case, _, _)| Scene::build(&case).map(|scene| (case, scene)));
    let (case, scene) = match scene {
        Ok(found) => found,
        Err(error) => return refused(error, out),
    };
    let make = |s: &_, p: &_, plan: &_, settings| (context.make)(processor, s, p, plan, settings);
    let mut simulation = match Simulation::with_backend(&case, scene, make) {
        Ok(simulation) => simulation,
        Err(error) => return refused(error, out),
    };
    out.machine = format!("{}, {}", simulation.backend.description(), simulation.backend.precision());
    if let Some(change) = extreme.change {
        let mut fields = simulation.backend.read()?;
        change(&mut fields, &simulation.groups);
        simulation.backend.write(&fields)?;
    }
    let mut end = End::Done;
    while simulation.steps < extreme.steps {
        if let Err(error) = simulation.step() {
            end = End::Stopped(error.to_string());
            break;
        }
    }
    out.work.steps = simulation.steps;
    out.work.particles = simulation.groups.total() as u64;
    out.work.particle_steps = out.work.particles * out.work.steps;
    out.put("time reached [s]", simulation.time);
    // A run that a guard stopped is not written out as a result; one that goes on is.
    if matches!(end, End::Done) {
        for fault in faults(&mut simulation)? {
            out.class = Class::Failed;
            out.reason = format!("{}; {fault}", out.reason).trim_start_matches("; ").into();
        }
    }
    if simulation.plan.wet() {
        let (monitor, counters) = (simulation.backend.monitor()?, simulation.backend.counters()?);
        out.put("lost particles [-]", counters.lost as f64);
        if monitor.speed_max.is_finite() {
            out.put("largest speed [m/s]", monitor.speed_max);
        }
        out.put("most neighbours [-]", f64::from(counters.neighbours_max));
        out.put("displacements clamped [-]", counters.displacement_clamps as f64);
    }
    Ok((end, out))
}

/// Whether `end` is what `expect` asks for, and both in words.
fn judge(expect: Expect, end: &End, out: &mut Measured) {
    let lost = out.value("lost particles [-]").unwrap_or(0.0);
    let speed = out.value("largest speed [m/s]").unwrap_or(0.0);
    let (right, happened) = match end {
        End::Done => {
            let right = match expect {
                Expect::Finish { lost: most, speed: fastest } => lost <= most as f64 && speed <= fastest,
                Expect::FinishOrGuard => true,
                Expect::Guard | Expect::Refuse => false,
            };
            (right, format!("finished, {lost} particles lost, largest speed {speed:.3} m/s"))
        }
        End::Stopped(why) => {
            (matches!(expect, Expect::Guard | Expect::FinishOrGuard), format!("stopped: {}", first_line(why)))
        }
        End::Refused(why) => {
            let lines: Vec<&str> = why.lines().map(str::trim).filter(|l| !l.is_empty()).take(1).collect();
            (expect == Expect::Refuse, format!("refused: {}", lines.concat()))
        }
    };
    if !right {
        out.class = Class::Failed;
    }
    let fault = if out.reason.is_empty() { String::new() } else { format!("; {}", out.reason) };
    out.reason = format!("must {}; {happened}{fault}", expect.words());
}

fn finish(rows: &mut [Row], _: Option<f64>) -> Result<Report> {
    let mut report = Report::default();
    let right = rows.iter().filter(|r| r.measured.class == Class::Ok).count();
    report.findings.push(format!("{right} of {} scenes end as they must.", rows.len()));
    for row in rows.iter() {
        let verdict = if row.measured.class == Class::Ok { "as it must" } else { "NOT as it must" };
        report.findings.push(format!(
            "{}: {} ({verdict})",
            row.method,
            row.measured.reason.replace('\n', " ")
        ));
    }
    Ok(report)
}

/// The study.
pub fn study(setup: &Setup) -> Study {
    let processor = setup.processor;
    let jobs = scenes(setup.full).into_iter().map(|extreme| {
        let backend = if processor == Processor::Gpu { "gpu" } else { "cpu" };
        let weight = extreme.steps as f64;
        let mut job =
            Job::new(extreme.name, &[("backend", backend.into())], weight, |_| Ok(Measured::default()));
        job.identity = format!("{:?} {processor:?}", extreme);
        job.task = Box::new(move |context| {
            let (end, mut out) = play(&extreme, processor, context)?;
            judge(extreme.expect, &end, &mut out);
            Ok(out)
        });
        job
    });
    Study {
        name: "gallery".into(),
        title: "Extreme scenes".into(),
        question: "Does any scene hang, panic, keep a number that is none, or lose particles uncounted?"
            .into(),
        jobs: jobs.collect(),
        finish: Box::new(finish),
    }
}
