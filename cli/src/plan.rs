//! `seixo plan`: what a run would compute.

mod afloat;
mod words;

use super::setup::{self, Setup};
use super::{CaseArgs, Exit};
use afloat::Buoyancy;
use glam::{DMat3, DVec3};
use seixo::backend::Backend;
use seixo::backend::cpu::Cpu;
use seixo::backend::gpu::forecast::{Forecast, Group, groups};
use seixo::backend::gpu::memory::{Memory, Sizes};
use seixo::backend::gpu::shader::switches;
use seixo::backend::gpu::sizes;
use seixo::case::Case;
use seixo::case::file::load_text;
use seixo::cells::Grid;
use seixo::console::{say_json, tell};
use seixo::contact::Solids;
use seixo::error::Result;
use seixo::estimate::Estimate;
use seixo::gauges::Gauges;
use seixo::machine;
use seixo::output::digits::of_moment;
use seixo::params::{Params, RELAXATION_MAX, Relaxation};
use seixo::plan::{ParticleStage, Plan, Stage};
use seixo::pressure::Settings;
use seixo::run::from::{holds, named};
use seixo::run::summary::particles;
use seixo::scene::{Drive, Scene, Solid};
use seixo::scheme::Source;
use seixo::share::Outlook;
use seixo::time_step::{Bounds, expected_speed, time_step};
use seixo::waves::WaveKind;
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub struct PlanArgs {
    #[command(flatten)]
    case: CaseArgs,
    /// Tell what each of so many ranks would have and say (mpirun -n N seixo run).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    ranks: Option<u16>,
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

/// A wave that a piston makes, by theory.
#[derive(Serialize)]
struct WaveLine {
    piston: String,
    kind: WaveKind,
    height_m: f64,
    /// Nothing for a solitary wave.
    period_s: Option<f64>,
    depth_m: f64,
    length_m: f64,
    celerity_m_s: f64,
    stroke_m: f64,
    /// Height and length over the spacing.
    height_over_spacing: f64,
    length_over_spacing: f64,
}

impl WaveLine {
    fn new(solid: &Solid, spacing: f64) -> Option<Self> {
        let Drive::Prescribed(motion) = &solid.drive else { return None };
        let wave = motion.wave()?;
        let wanted = &wave.wanted;
        Some(Self {
            piston: solid.name.clone(),
            kind: wanted.kind,
            height_m: wanted.height,
            period_s: (wanted.kind != WaveKind::Solitary).then_some(wanted.period),
            depth_m: wanted.depth,
            length_m: wave.length,
            celerity_m_s: wave.celerity,
            stroke_m: wave.stroke,
            height_over_spacing: wanted.height / spacing,
            length_over_spacing: wave.length / spacing,
        })
    }
}

/// A free body as it is built: what a drawing or a balance says of it, to be held against the case.
#[derive(Serialize)]
struct BodyLine {
    name: String,
    /// In two dimensions of the slice one spacing wide; 0 of one that is held and has none.
    mass_kg: f64,
    /// Principal moments of inertia about the centre of mass, or three times the one about a hinge, in the frame of the shape; of the slice, too.
    inertia_kg_m2: [f64; 3],
    volume_m3: f64,
    /// Lower and upper corner of the box around it at t = 0.
    min_m: [f64; 3],
    max_m: [f64; 3],
    /// Of the first [`MOST_BODIES`], if there is water.
    buoyancy: Option<Buoyancy>,
}

impl BodyLine {
    fn new(solid: &Solid) -> Option<Self> {
        let Drive::Free(free) = &solid.drive else { return None };
        let (lo, hi) = solid.shape.bounds(DMat3::from_quat(solid.orientation));
        Some(Self {
            name: solid.name.clone(),
            mass_kg: free.mass,
            inertia_kg_m2: free.inertia.to_array(),
            volume_m3: solid.shape.volume(),
            min_m: (solid.shape_center() + lo).to_array(),
            max_m: (solid.shape_center() + hi).to_array(),
            buoyancy: None,
        })
    }
}

/// The free bodies of `scene`, in the water of `params` unless the scene is a coarser one.
fn bodies(scene: &Scene, params: &Params, built: bool) -> Vec<BodyLine> {
    let mut lines: Vec<BodyLine> = scene.solids.iter().filter_map(BodyLine::new).collect();
    let free = scene.solids.iter().filter(|solid| solid.is_free());
    // The level of a coarser scene is off by its spacing.
    for (line, solid) in lines.iter_mut().zip(free).take(if built { MOST_BODIES } else { 0 }) {
        line.buoyancy = Buoyancy::new(scene, solid, params);
    }
    lines
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
    /// Nothing for a scene that was not built whole.
    neighbours_max: Option<u32>,
    cpu_bytes: u64,
    gpu_bytes: u64,
    gpu_bytes_per_particle: f64,
    gpu_groups: Vec<Group>,
    /// As asked for, and refined to 10 and 100 million particles.
    gpu_forecasts: Vec<Forecast>,
}

/// What `plan` tells.
#[derive(Serialize)]
struct Report {
    case: String,
    dimensions: u32,
    spacing_m: f64,
    /// Spacing of the coarser scene that the numbers of particles were scaled up from, if any [m].
    estimated_from_spacing_m: Option<f64>,
    time_step_s: f64,
    adaptive: bool,
    end_s: f64,
    particles: seixo::output::result::Particles,
    /// Those that move.
    solids: Vec<String>,
    /// Those that do not, and stand on no lattice of the water.
    fixed_solids: Vec<String>,
    waves: Vec<WaveLine>,
    bodies: Vec<BodyLine>,
    stages: Vec<StageLine>,
    contact: ContactLine,
    scheme: Option<Scheme>,
    /// As many ranks as were asked about.
    #[serde(skip_serializing_if = "Option::is_none")]
    ranks: Option<Outlook>,
    /// Memory of the first of them and of each other one, on CPUs.
    #[serde(skip_serializing_if = "Option::is_none")]
    memory_of_ranks_bytes: Option<[f64; 2]>,
    /// As `run` judges it: from the case alone, but for states, which hold what the scene has.
    estimate: Estimate,
    advice: Vec<String>,
}

/// Free bodies that are told of; more would be no list.
const MOST_BODIES: usize = 12;
/// Fluid particles up to which the scene is built whole; more are estimated from a coarser one.
const WHOLE: f64 = 1.6e7;
/// Fluid particles of that coarser scene.
const COARSER: f64 = 5e5;
/// Numbers of particles to look ahead to.
const FORECASTS: [u64; 2] = [10_000_000, 100_000_000];
/// A scene, or a coarser one that stands for it.
struct Seen {
    setup: Setup,
    /// The case as asked for.
    case: Case,
    /// Spacing of the scene over that asked for, 1 or more.
    coarser: f64,
}

impl Seen {
    fn new(args: &CaseArgs, quiet: bool) -> Result<Self> {
        let loaded = setup::read(args)?;
        let case = loaded.case.clone();
        // A coarser scene would hide it, or end in another error.
        seixo::far::refuse(&case).map_err(|e| loaded.placed(e))?;
        let (l0, d) = (case.run.spacing, f64::from(case.run.dimensions));
        let estimate = Estimate::new(&case);
        let fluid = estimate.water;
        let coarser = if fluid > WHOLE { (fluid / COARSER).powf(1.0 / d) } else { 1.0 };
        // What this machine has no room for is not built either.
        let room = machine::memory().map_or(f64::INFINITY, |n| n as f64 / 2.0);
        let coarser = (estimate.memory_beside_device / room).powf(1.0 / d).max(coarser);
        let name = setup::name(&args.case);
        if coarser > 1.0 {
            // From its text: standard input is read once. What the coarser lattice rounds is no news.
            let other = load_text(&loaded.path, loaded.text.clone(), Some(coarser * l0), &[]);
            match other.and_then(|other| Setup::build(other, name.clone(), true)) {
                Ok(setup) => return Ok(Self { setup, case, coarser }),
                // What is wrong with the coarser scene alone is no fault of the case.
                Err(why) if estimate.memory_beside_device > room => {
                    let wrong = words::too_large(&case, &estimate, room, (coarser * l0, &why));
                    return Err(loaded.placed(wrong.into()));
                }
                Err(_) => {}
            }
        }
        let setup = Setup::build(loaded, name, quiet)?;
        Ok(Self { setup, case, coarser: 1.0 })
    }
}

pub fn plan(args: &PlanArgs) -> Exit {
    seixo::threads::start(None)?;
    let seen = Seen::new(&args.case, args.json)?;
    let report = report(&seen, args.ranks).map_err(|e| seen.setup.loaded.placed(e))?;
    if args.json {
        say_json(&report);
    } else {
        tell(&report.words());
    }
    Ok(0)
}

fn report(seen: &Seen, ranks: Option<u16>) -> Result<Report> {
    let (case, scene, built) = (&seen.case, &seen.setup.scene, seen.coarser == 1.0);
    let params = seixo::drag::params(case, scene)?;
    let plan = Plan::new(case, scene, &params);
    let speed = fastest(case, scene, &params);
    let dt = shortest(case, scene, &params);
    let mut advice = if plan.wet() { step_advice(&params, case, speed).0 } else { vec![] };
    advice.extend(many_steps(case, dt));
    advice.extend(pressed_down(scene, &params));
    let called = |still: bool| -> Vec<String> {
        let of_opening = |k: usize| scene.openings.iter().any(|opening| opening.solid == Some(k));
        let solids =
            scene.solids.iter().enumerate().filter(|&(k, s)| s.is_still() == still && !of_opening(k));
        solids.map(|(_, s)| s.name.clone()).collect()
    };
    let free = scene.solids.iter().any(|s| matches!(s.drive, Drive::Free(_)));
    if built {
        // What `run` refuses.
        let solids = Solids::new(scene, case.contact.as_ref())?;
        seixo::sense::refuse(case, scene, &params, &solids)?;
        plan.contact.refuse(case, scene)?;
        Gauges::new(case, scene)?;
        advice.extend(if free { solids.advice(dt).words } else { Vec::new() });
    } else if plan.has(Stage::Contact) {
        advice.push("contact: not judged, the particles of the solids were not built".into());
    }
    let ranks = ranks.map(|n| Outlook::new(usize::from(n), scene, &params, &plan)).transpose()?;
    if let Some(found) = named(case)? {
        if built {
            holds(&found, scene)?;
        }
        let (step, time) = (found.origin.step, found.origin.time);
        let decimals = of_moment(case);
        advice.push(format!("run.from: it begins with the state of step {step}, t = {time:.decimals$} s"));
        advice.extend(found.damaged.iter().map(|why| format!("run.from: {why}; an older state is taken")));
    }
    let estimate = if built { seen.setup.estimate(dt) } else { Estimate::new(case).at_step(case, dt) };
    let free = |n: Option<u64>| n.map_or(f64::INFINITY, |n| n as f64);
    if estimate.memory_beside_device > free(machine::memory()) {
        advice.push("memory: this machine has less free than the run takes; `seixo run` refuses it".into());
    }
    if estimate.disk() > free(machine::disk(std::path::Path::new("."))) {
        advice.push(
            "disk: the results take more room than is free here; raise output.every or output.table_every"
                .into(),
        );
    }
    let stages = plan.reasons.iter().map(|(stage, reason)| StageLine {
        stage: stage.name(),
        planned: reason.is_ok(),
        reason: reason.unwrap_or_else(|why| why),
    });
    let mut count = particles(scene);
    if !built {
        let (cube, square) =
            (seen.coarser.powi(params.dimensions as i32), seen.coarser.powi(params.dimensions as i32 - 1));
        let scaled = |n: usize, by: f64| (n as f64 * by).round() as usize;
        count.fluid = scaled(count.fluid, cube);
        for surface in [&mut count.wall, &mut count.dummy, &mut count.body] {
            *surface = scaled(*surface, square);
        }
        count.total = count.fluid + count.wall + count.dummy + count.body;
    }
    Ok(Report {
        case: seen.setup.name.clone(),
        dimensions: params.dimensions,
        spacing_m: params.spacing,
        estimated_from_spacing_m: (!built).then_some(scene.spacing),
        time_step_s: dt,
        adaptive: case.run.adaptive,
        end_s: case.run.end,
        particles: count,
        solids: called(false),
        fixed_solids: called(true),
        bodies: bodies(scene, &params, built),
        waves: scene.solids.iter().filter_map(|s| WaveLine::new(s, params.spacing)).collect(),
        stages: stages.collect(),
        contact: ContactLine { device: plan.contact.program.is_some(), reason: plan.contact.reason.clone() },
        memory_of_ranks_bytes: ranks.as_ref().map(|r| estimate.memory_of_ranks(r.parts.len())),
        ranks,
        estimate,
        scheme: if plan.wet() { Some(scheme(seen, &params, &plan, dt)?) } else { None },
        advice,
    })
}

fn scheme(seen: &Seen, params: &Params, plan: &Plan, dt: f64) -> Result<Scheme> {
    let step = params.step(0.0, dt, expected_speed(params));
    let (scene, built) = (&seen.setup.scene, seen.coarser == 1.0);
    // The lists at t = 0 tell the memory and, of the scene itself, whether the lattice is sound.
    let settings = Settings { tolerance: 1e-3, max_iterations: 1, warm_start: false };
    let own = Params::new(&seen.setup.loaded.case, scene)?;
    let mut cpu = Cpu::new(scene, &own, plan, settings)?;
    for stage in [ParticleStage::CellList, ParticleStage::NeighbourList] {
        cpu.run(stage, &step)?;
    }
    let sizes: Sizes = sizes(scene, &own, plan)?;
    let coarse = sizes.pressure as f64;
    let sizes = if built { sizes } else { sizes.refined(seen.coarser) };
    let memory = Memory::new(&sizes, plan);
    let switches = switches(&own, plan);
    let mut forecasts = vec![Forecast::at(&sizes, plan, &switches, 1.0)?];
    for &particles in FORECASTS.iter().filter(|&&n| n > sizes.total) {
        forecasts.push(Forecast::new(&sizes, plan, &switches, particles)?);
    }
    Ok(Scheme {
        number_density: params.number_density,
        laplacian_over_l0_squared: params.laplacian / params.spacing.powi(2),
        neighbours: params.neighbours,
        preconditioner: plan.preconditioner.name().into(),
        sound_speed_m_s: params.sound_speed(dt),
        relaxation: step.relaxation,
        compressibility_1_pa: step.compressibility,
        cells: if built { Grid::new(params)?.total() } else { Estimate::new(&seen.case).cells as usize },
        neighbours_max: if built { Some(cpu.counters()?.neighbours_max) } else { None },
        cpu_bytes: (cpu.bytes() as f64 * sizes.pressure as f64 / coarse) as u64,
        gpu_bytes: memory.total(),
        gpu_bytes_per_particle: memory.total() as f64 / sizes.total as f64,
        gpu_groups: groups(&memory),
        gpu_forecasts: forecasts,
    })
}

/// What `run` says of the time step and of the scheme: nothing, unless there is something to change.
pub fn step_warnings(case: &Case, scene: &Scene, params: &Params) -> Vec<String> {
    let wet = scene.groups.fluid > 0;
    let (words, matters) = step_advice(params, case, fastest(case, scene, params));
    let words = if wet && matters { words } else { Vec::new() };
    let words = words.into_iter().chain(many_steps(case, shortest(case, scene, params)));
    words.chain(pressed_down(scene, params)).collect()
}

/// Says so of bodies that stand on fixed walls where no water presses under them: with the paper's source.
fn pressed_down(scene: &Scene, params: &Params) -> Option<String> {
    let down = scene.gravity.normalize_or_zero();
    if params.source != Source::NumberDensity || scene.groups.fluid == 0 || down == DVec3::ZERO {
        return None;
    }
    let walls = &scene.position[scene.groups.static_wall_range()];
    let stands = |solid: &&Solid| {
        let (low, high) = solid.shape.bounds(DMat3::from_quat(solid.orientation));
        let (center, half) = (solid.shape_center() + 0.5 * (low + high), 0.5 * (high - low));
        let reach = half.dot(down.abs());
        let under = |x: &DVec3| {
            let way = *x - center;
            let (depth, aside) = (way.dot(down) - reach, way - way.dot(down) * down);
            (-0.1..1.1).contains(&(depth / scene.spacing)) && aside.abs().cmple(half).all()
        };
        solid.is_free() && walls.iter().any(under)
    };
    let solid = scene.solids.iter().find(stands)?;
    Some(format!(
        "body `{}` stands on a wall: with the source `number_density`, as the preset `paper` has it, no water presses under it, and it is held \
         down by the water above; the source `mixed` has water in the slot",
        solid.name
    ))
}

/// The step that is to be reckoned with at any time of the run [s].
pub fn shortest(case: &Case, scene: &Scene, params: &Params) -> f64 {
    let adaptive = case.run.adaptive && scene.groups.fluid > 0;
    time_step(params, case.run.time_step, adaptive, fastest(case, scene, params))
}

/// Steps from which on a run is hardly meant: days of a small scene.
const MANY_STEPS: f64 = 1e7;

/// Says so if steps of `dt` [s] are too many.
fn many_steps(case: &Case, dt: f64) -> Option<String> {
    let steps = case.run.end / dt;
    (steps > MANY_STEPS).then(|| {
        format!("time step: {steps:.1e} steps of {dt:.1e} s until run.end: check what makes them so short, or the run so long")
    })
}

/// Largest speed to be ready for [m/s]: of the water's collapse or start, or of what drives it at any time of the run.
fn fastest(case: &Case, scene: &Scene, params: &Params) -> f64 {
    expected_speed(params).max(scene.driven(0.0, case.run.end))
}

/// What there is to say of the time step, and whether there is something to change.
fn step_advice(params: &Params, case: &Case, speed: f64) -> (Vec<String>, bool) {
    let (typed, adaptive) = (case.run.time_step, case.run.adaptive);
    let bounds = Bounds::new(params, speed);
    let body = format!("the drag on the body `{}`", params.drag.body(speed));
    // Of next to no body: it is told where it says something.
    let drag = Some(bounds.drag).filter(|dt| *dt < typed).unwrap_or(f64::INFINITY);
    let flow = format!("the flow (up to {speed:.2} m/s)");
    let allows = [
        (&*flow, bounds.flow),
        ("calm water", bounds.weight),
        ("the sound speed", bounds.sound),
        ("viscosity", bounds.viscous),
        (&body, drag),
    ];
    let allows = allows.iter().filter(|(_, dt)| *dt < case.run.end.max(typed));
    let allows: Vec<String> = allows.map(|(what, dt)| format!("{what} allows {dt:.3e} s")).collect();
    let most = if adaptive { "at most " } else { "" };
    let allows = if allows.is_empty() { "nothing bounds it".to_owned() } else { allows.join(", ") };
    let mut advice = vec![format!("time step: {most}{typed:.3e} s; {allows}")];
    let bound = bounds.shortest();
    let mut matters = typed > bound && !adaptive;
    if typed > bound {
        advice.push(if adaptive {
            format!("the adaptive time step goes down to {bound:.3e} s")
        } else {
            format!(
                "the fixed time step is above that; set run.time_step = {bound:.1e} or run.adaptive = true"
            )
        });
    }
    let dt = time_step(params, typed, adaptive, speed);
    let wanted = match params.relaxation {
        Relaxation::Fixed(gamma) => gamma,
        // It is held back by itself.
        Relaxation::Speed(_) if params.follows_flow => 0.0,
        Relaxation::Speed(c) => (c * dt / params.spacing).powi(2),
    };
    if wanted > RELAXATION_MAX {
        matters = true;
        advice.push(format!(
            "gamma = {wanted:.2} is above {RELAXATION_MAX}, where noise grows; lower the time step or the sound speed"
        ));
    }
    let over = params.sound_over_derived();
    if !(SOFTEST..=HARDEST).contains(&over) {
        matters = true;
        let what = if over < 1.0 {
            "water is pressed together by its own weight"
        } else {
            "noise of the pressure adds energy"
        };
        advice.push(format!(
            "fluid.sound_speed is {over:.1e} times the {:.3e} m/s that are derived without it: {what}; leave it out, or use {SOFTEST} to {HARDEST} times that",
            params.sound_speed(dt) / over
        ));
    }
    (advice, matters)
}

/// Typed sound speeds over the derived one that make sense: far below, the weight of the water presses it together; from five
/// times on a dam break gained 0.38 of its energy.
const SOFTEST: f64 = 0.2;
const HARDEST: f64 = 4.0;
