//! `seixo plan`: what a run would compute.

use super::setup::Setup;
use super::{CaseArgs, Exit, say, say_json};
use seixo::backend::Backend;
use seixo::backend::cpu::Cpu;
use seixo::backend::gpu::bytes_needed;
use seixo::cells::Grid;
use seixo::contact::Solids;
use seixo::error::Result;
use seixo::params::{Params, RELAXATION_MAX, Relaxation};
use seixo::plan::{Plan, Stage};
use seixo::pressure::Settings;
use seixo::run::summary::particles;
use seixo::simulation::{COURANT_MAX, SOUND_MAX};
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub struct PlanArgs {
    #[command(flatten)]
    case: CaseArgs,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// A stage, and why it runs or does not.
#[derive(Serialize)]
struct StageLine {
    stage: &'static str,
    planned: bool,
    reason: &'static str,
}

/// Where the pairs of contact are computed, on a backend that has a device.
#[derive(Serialize)]
struct ContactLine {
    device: bool,
    reason: String,
}

/// Constants of the fluid's scheme.
#[derive(Serialize)]
struct Scheme {
    number_density: f64,
    laplacian_over_l0_squared: f64,
    neighbours: u32,
    preconditioner: String,
    sound_speed_m_s: f64,
    relaxation: f64,
    compressibility_1_pa: f64,
    cells: usize,
    neighbours_max: u32,
    cpu_bytes: u64,
    gpu_bytes: u64,
}

/// What `plan` tells.
#[derive(Serialize)]
struct Report {
    case: String,
    dimensions: u32,
    spacing_m: f64,
    time_step_s: f64,
    adaptive: bool,
    end_s: f64,
    particles: seixo::output::result::Particles,
    solids: Vec<String>,
    stages: Vec<StageLine>,
    contact: ContactLine,
    scheme: Option<Scheme>,
    advice: Vec<String>,
}

pub fn plan(args: &PlanArgs) -> Exit {
    let setup = Setup::new(&args.case, args.json)?;
    let report = report(&setup)?;
    if args.json {
        say_json(&report);
    } else {
        say(&words(&report));
    }
    Ok(0)
}

fn report(setup: &Setup) -> Result<Report> {
    let (case, scene) = (&setup.loaded.case, &setup.scene);
    let params = Params::new(case, scene)?;
    let plan = Plan::new(case, scene, &params);
    let dt = longest_step(&params, case.run.time_step, case.run.adaptive && plan.wet());
    let solids = Solids::new(scene, case.contact.as_ref())?;
    let mut advice =
        if plan.wet() { step_advice(&params, case.run.time_step, case.run.adaptive) } else { vec![] };
    advice.extend(solids.advice(dt).words);
    let stages = plan.reasons.iter().map(|(stage, reason)| StageLine {
        stage: stage.name(),
        planned: reason.is_ok(),
        reason: reason.unwrap_or_else(|why| why),
    });
    Ok(Report {
        case: setup.name.clone(),
        dimensions: params.dimensions,
        spacing_m: params.spacing,
        time_step_s: dt,
        adaptive: case.run.adaptive,
        end_s: case.run.end,
        particles: particles(scene),
        solids: scene.solids.iter().map(|s| s.name.clone()).collect(),
        stages: stages.collect(),
        contact: ContactLine { device: plan.contact.kernel.is_some(), reason: plan.contact.reason.clone() },
        scheme: if plan.wet() { Some(scheme(setup, &params, &plan, dt)?) } else { None },
        advice,
    })
}

fn scheme(setup: &Setup, params: &Params, plan: &Plan, dt: f64) -> Result<Scheme> {
    let step = params.step(0.0, dt, expected_speed(params));
    // The lists at t = 0 tell the memory and whether the lattice is sound.
    let settings = Settings { tolerance: 1e-3, max_iterations: 1, warm_start: false };
    let mut cpu = Cpu::new(&setup.scene, params, plan, settings)?;
    for stage in [Stage::CellList, Stage::NeighbourList] {
        cpu.run(stage, &step)?;
    }
    Ok(Scheme {
        number_density: params.number_density,
        laplacian_over_l0_squared: params.laplacian / params.spacing.powi(2),
        neighbours: params.neighbours,
        preconditioner: format!("{:?}", plan.preconditioner).to_lowercase(),
        sound_speed_m_s: params.sound_speed(dt),
        relaxation: step.relaxation,
        compressibility_1_pa: step.compressibility,
        cells: Grid::new(params)?.total(),
        neighbours_max: cpu.counters()?.neighbours_max,
        cpu_bytes: cpu.bytes(),
        gpu_bytes: bytes_needed(&setup.scene, params, plan)?,
    })
}

/// Speed of the collapse from rest [m/s], as the adaptive time step expects it.
fn expected_speed(params: &Params) -> f64 {
    2.0 * (params.gravity.length() * params.depth).sqrt()
}

/// Bounds of the time step [s] by flow and by sound.
fn bounds(params: &Params) -> (f64, f64) {
    let flow = COURANT_MAX * params.spacing / expected_speed(params).max(1e-9);
    let sound = match params.relaxation {
        Relaxation::Speed(c) => SOUND_MAX * params.spacing / c,
        Relaxation::Fixed(_) => f64::INFINITY,
    };
    (flow, sound)
}

fn longest_step(params: &Params, typed: f64, adaptive: bool) -> f64 {
    let (flow, sound) = bounds(params);
    if adaptive { typed.min(flow).min(sound) } else { typed }
}

fn step_advice(params: &Params, typed: f64, adaptive: bool) -> Vec<String> {
    let (flow, sound) = bounds(params);
    let speed = expected_speed(params);
    let mut advice = vec![format!(
        "time step: typed {typed:.3e} s; the flow (up to {speed:.2} m/s) allows {flow:.3e} s{}",
        if sound.is_finite() { format!(", the sound speed {sound:.3e} s") } else { String::new() }
    )];
    let bound = flow.min(sound);
    if typed > bound {
        advice.push(if adaptive {
            format!("the adaptive time step starts at {bound:.3e} s")
        } else {
            format!(
                "the fixed time step is above that; set run.time_step = {bound:.1e} or run.adaptive = true"
            )
        });
    }
    let dt = longest_step(params, typed, adaptive);
    let wanted = match params.relaxation {
        Relaxation::Fixed(gamma) => gamma,
        Relaxation::Speed(c) => (c * dt / params.spacing).powi(2),
    };
    if wanted > RELAXATION_MAX {
        advice.push(format!(
            "gamma = {wanted:.2} is above {RELAXATION_MAX}, where noise grows; lower the time step or the sound speed"
        ));
    }
    advice
}

fn words(report: &Report) -> String {
    let p = &report.particles;
    let step = if report.adaptive { "at most" } else { "fixed" };
    let mut lines = vec![
        format!(
            "{}: {}D, l0 = {} m, dt {step} {:.3e} s, to t = {} s",
            report.case, report.dimensions, report.spacing_m, report.time_step_s, report.end_s
        ),
        String::new(),
        "particles".to_string(),
    ];
    for (name, count) in
        [("fluid", p.fluid), ("wall", p.wall), ("dummy", p.dummy), ("body", p.body), ("total", p.total)]
    {
        lines.push(format!("  {name:<7}{count:>10}"));
    }
    if !report.solids.is_empty() {
        lines.push(format!("  moving solids: {}", report.solids.join(", ")));
    }
    for (title, planned) in [("stages", true), ("left out", false)] {
        let of = |s: &&StageLine| s.planned == planned;
        if report.stages.iter().any(|s| of(&s)) {
            lines.extend([String::new(), title.to_string()]);
        }
        lines.extend(report.stages.iter().filter(of).map(|s| format!("  {:<20}{}", s.stage, s.reason)));
    }
    if report.stages.iter().any(|s| s.planned && s.stage == Stage::Contact.name()) {
        let place = if report.contact.device { "on the GPU, if that is the backend" } else { "on the host" };
        lines.extend([String::new(), "contact".to_string()]);
        lines.push(format!("  pairs {place}: {}", report.contact.reason));
    }
    if let Some(s) = &report.scheme {
        lines.extend([
            String::new(),
            "scheme".to_string(),
            format!(
                "  n0 {:.5}, lambda {:.5} l0^2, {} neighbours",
                s.number_density, s.laplacian_over_l0_squared, s.neighbours
            ),
            format!(
                "  c_s {:.3} m/s, gamma {:.4}, alpha {:.3e} 1/Pa",
                s.sound_speed_m_s, s.relaxation, s.compressibility_1_pa
            ),
            format!(
                "  preconditioner {}; {} cells; at most {} neighbours at t = 0",
                s.preconditioner, s.cells, s.neighbours_max
            ),
            format!(
                "  memory: CPU {:.1} MB at t = 0, GPU {:.1} MB",
                s.cpu_bytes as f64 / 1e6,
                s.gpu_bytes as f64 / 1e6
            ),
        ]);
    }
    if !report.advice.is_empty() {
        lines.extend([String::new(), "advice".to_string()]);
        lines.extend(report.advice.iter().map(|a| format!("  {a}")));
    }
    lines.join("\n")
}
