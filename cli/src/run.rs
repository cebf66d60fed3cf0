//! `seixo run`.

use super::device;
use super::plan::{shortest, step_warnings};
use super::progress::{Display, clock};
use super::ranks::{self, Call, Place};
use super::setup::{self, Setup};
use super::signals::{self, RESUME};
use super::typed::{count, duration, size};
use super::{BackendName, CaseArgs, Changes, DeviceArgs, Exit};
use seixo::Processor;
use seixo::backend::gpu::Gpu;
use seixo::case::Case;
use seixo::console::{remark, say, tell};
use seixo::error::{Error, FolderError, Result};
use seixo::estimate::{Estimate, bytes};
use seixo::machine;
use seixo::output::digits::{of_moment, of_place, of_time};
use seixo::output::folder::case_name;
use seixo::output::result::{Grade, Status, Summary};
use seixo::pressure::SINGLE;
use seixo::ranks::Team;
use seixo::run::resume::{Standing, standing};
use seixo::run::{Options, Start, run as run_simulation};
use seixo::simulation::Simulation;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

#[derive(Clone, Debug, clap::Args)]
pub struct RunArgs {
    /// The case file (TOML), - for standard input; with --resume DIR the case is that of DIR.
    #[arg(required_unless_present = "resume")]
    case: Option<PathBuf>,
    #[command(flatten)]
    changes: Changes,
    #[command(flatten)]
    device: DeviceArgs,
    /// Folder of the results [default: out/NAME-OF-THE-CASE].
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Go on with the run in the folder of the results: start it if there is none, return at once if it is done.
    /// The same command can be given again until the run has reached its end.
    #[arg(long, value_name = "DIR", num_args = 0..=1, default_missing_value = "", conflicts_with = "force")]
    resume: Option<String>,
    /// Stop after this time by the clock with the state saved (exit code 75): seconds, or 1h30m, 90m, 2d, or as Slurm
    /// writes it, 1:30:00 (hours:minutes:seconds), 90:00 (minutes:seconds), 1-12:00:00 (days-hours:minutes:seconds).
    #[arg(long, value_name = "TIME", value_parser = duration)]
    max_wall: Option<Duration>,
    /// Replace earlier results in the folder.
    #[arg(long)]
    force: bool,
    /// Stop after this many steps, counted from t = 0 or from run.from.
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    steps: Option<u64>,
    /// Memory that the run may take, e.g. 8G, instead of what the machine has free.
    #[arg(long, value_name = "SIZE", value_parser = size)]
    memory_limit: Option<u64>,
    /// Run even if the disk seems too small for the results.
    #[arg(long)]
    force_disk: bool,
    /// Draw a picture of every frame, and of the end.
    #[arg(long)]
    picture: bool,
    /// Show no progress and no remarks.
    #[arg(short, long)]
    quiet: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Refuses a case that the machine cannot hold, before anything is built.
fn fits(args: &RunArgs, asked: &Asked, case: &Case, place: Option<Place>) -> Result<()> {
    let estimate = Estimate::new(case).at_most(args.steps);
    let on_cpu = match args.device.backend {
        BackendName::Cpu => true,
        BackendName::Gpu => false,
        BackendName::Auto => args.device.adapter.is_none(),
    };
    let of = |estimate: &Estimate, cpu: bool| match place {
        Some(Place { here, all, .. }) => estimate.memory_on_ranks(here, all),
        None if cpu => estimate.memory_cpu,
        None => estimate.memory_beside_device,
    };
    let needs = |cpu: bool| of(&estimate, cpu);
    let limit = args.memory_limit.or_else(machine::memory).map_or(f64::INFINITY, |n| n as f64);
    // Drivers are asked only if it matters whether there is one.
    let on_cpu = on_cpu
        && (args.device.backend == BackendName::Cpu || needs(true) <= limit || !Gpu::hardware_available());
    if needs(on_cpu) > limit {
        let coarser = Estimate::spacing_within(case, limit, |estimate| of(estimate, on_cpu));
        let coarser =
            coarser.map_or("a larger run.spacing".into(), |l0| format!("run.spacing = {l0} or more"));
        let text = format!(
            "{}: {:.1e} particles{} and {:.1e} cells of search take about {} of memory{}, {} are {}: use {coarser}, \
             or a smaller domain, or say with --memory-limit what the run may take",
            asked.name,
            estimate.particles,
            estimate.of_whom(),
            estimate.cells,
            bytes(needs(on_cpu)),
            place.map_or(String::new(), |p| format!(" for {} of {} ranks here", p.here, p.all)),
            bytes(limit),
            if args.memory_limit.is_some() { "allowed" } else { "free" }
        );
        return Err(Error::usage("--memory-limit", text));
    }
    Ok(())
}

/// Refuses results for which there is no room, with steps of `dt` [s].
fn fits_disk(args: &RunArgs, asked: &Asked, setup: &Setup, dt: f64) -> Result<()> {
    let estimate = setup.estimate(dt).at_most(args.steps);
    let free = machine::disk(&asked.out).map_or(f64::INFINITY, |n| n as f64);
    if estimate.disk() > free && !args.force_disk {
        let text = format!(
            "{}: the results take about {}, {} are free on the disk of {}: raise output.every{}, output.table_every or \
             run.spacing, or run all the same with --force-disk",
            asked.name,
            bytes(estimate.disk()),
            bytes(free),
            asked.out.display(),
            if estimate.series.is_empty() { "" } else { " (or that of a series)" }
        );
        return Err(Error::usage("--force-disk", text));
    }
    Ok(())
}

/// Which case to run, where its results go, and whether to go on with what is there.
struct Asked {
    case: PathBuf,
    name: String,
    out: PathBuf,
    resume: bool,
    inputs: Vec<PathBuf>,
}

impl Asked {
    fn new(args: &RunArgs) -> Result<Self> {
        let given = args.resume.as_deref().map(PathBuf::from);
        // `--resume CASE` takes the case for its folder.
        let (case, folder) = match (&args.case, &given) {
            (None, Some(path)) if path.is_file() => (Some(path.clone()), None),
            (case, folder) => (case.clone(), folder.clone().filter(|f| !f.as_os_str().is_empty())),
        };
        if let (Some(out), Some(folder)) = (&args.out, &folder)
            && out != folder
        {
            let (out, folder) = (out.display(), folder.display());
            let text = format!("--out {out} and --resume {folder} name two folders: leave one out");
            return Err(Error::usage("--resume", text));
        }
        let resume = given.is_some();
        let out = args.out.clone().or(folder);
        match (case, out) {
            (Some(case), out) => {
                let name = setup::name(&case);
                let out = out.unwrap_or_else(|| Path::new("out").join(&name));
                let inputs = if setup::is_stdin(&case) { Vec::new() } else { vec![case.clone()] };
                Ok(Self { inputs, case, name, out, resume })
            }
            (None, Some(out)) => {
                let none = || FolderError::NoRun(out.clone());
                let name = case_name(&out)?.filter(|n| !n.is_empty()).ok_or_else(none)?;
                Ok(Self { case: out.join("case.toml"), name, out, resume, inputs: Vec::new() })
            }
            (None, None) => {
                Err(Error::usage("--resume", "--resume: name the folder of the run, or its case"))
            }
        }
    }
}

pub fn run(args: &RunArgs) -> Exit {
    let Some(team) = ranks::team()? else { return lead(args, None, None) };
    let processor = device::of_ranks(&args.device)?;
    let place = ranks::place(&team, args.device.threads);
    if team.rank() > 0 {
        return ranks::serve(&team, place.threads, &processor);
    }
    let mut args = args.clone();
    let backend = if processor == Processor::Cpu { BackendName::Cpu } else { BackendName::Gpu };
    args.device = DeviceArgs { backend, threads: Some(place.threads), ..args.device };
    let ended = lead(&args, Some((&team, &processor)), Some(place));
    if let Err(error @ Error::Gpu(_)) = &ended {
        // The others may wait for this one wherever they are.
        ranks::end_all(error);
    }
    ended
}

/// The run, by the first rank of a team, on its processor and at its `place`, where there are many.
fn lead(args: &RunArgs, team: Option<(&Arc<dyn Team>, &Processor)>, place: Option<Place>) -> Exit {
    let call = Call::new(team.map(|(team, _)| team));
    // A time that no clock counts to is none.
    let deadline = args.max_wall.and_then(|wall| Instant::now().checked_add(wall));
    let stop = signals::watch(args.quiet)?;
    seixo::threads::start(args.device.threads)?;
    let asked = Asked::new(args)?;
    let loaded = setup::read(&CaseArgs { case: asked.case.clone(), changes: args.changes.clone() })?;
    let Some(start) = begin(args, &asked, &loaded.case)? else { return Ok(0) };
    seixo::far::refuse(&loaded.case).map_err(|e| loaded.placed(e))?;
    fits(args, &asked, &loaded.case, place)?;
    let setup = Setup::build(loaded, asked.name.clone(), args.quiet)?;
    if !matches!(start, Start::Resume(_)) {
        let case = &setup.loaded.case;
        let params = seixo::drag::params(case, &setup.scene).map_err(|e| setup.loaded.placed(e))?;
        fits_disk(args, &asked, &setup, shortest(case, &setup.scene, &params))?;
    }
    call.tell(&setup.loaded.text);
    let mut simulation = match team {
        Some((team, processor)) => {
            Simulation::on_ranks_of(&setup.loaded.case, setup.scene.clone(), team, processor)
                .map_err(|e| setup.loaded.placed(e))?
        }
        None => setup.simulation(&args.device)?,
    };
    let options = Options {
        out: asked.out.clone(),
        name: setup.name.clone(),
        start,
        steps: args.steps,
        deadline,
        pictures: args.picture,
        inputs: asked.inputs,
    };
    if !args.quiet {
        announce(&setup, &simulation);
    }
    let mut display = Display::new(args.quiet, simulation.plan.wet(), of_time(&simulation.case));
    let mut observe = |progress: &seixo::run::Progress| display.step(progress);
    let finished =
        run_simulation(&mut simulation, &setup.scene, &setup.loaded.text, options, &stop, &mut observe)?;
    display.finish();
    let verdict = &finished.summary.verdict;
    if finished.error.is_none() && verdict.grade != Grade::Fine {
        remark(&format!("verdict: {verdict}"));
    }
    if args.json {
        say(&finished.summary.json());
    } else if !args.quiet {
        tell(&words(&finished.summary, &simulation.case, &asked.out));
    }
    match (finished.error, finished.signal) {
        (Some(error), _) => Err(error),
        (None, Some(signal)) => Ok(signals::exit_code(signal)),
        (None, None) if finished.resumable => Ok(RESUME),
        (None, None) => Ok(0),
    }
}

/// How the run begins; `None` if it is done, which is told.
fn begin(args: &RunArgs, asked: &Asked, case: &Case) -> Result<Option<Start>> {
    Ok(Some(match (asked.resume, args.force) {
        (false, true) => Start::Replace,
        (false, false) => Start::New,
        (true, _) => match standing(&asked.out, case)? {
            Standing::Nothing => Start::New,
            Standing::Lost => {
                if !args.quiet {
                    remark(&format!(
                        "no state was saved in {}: the run begins again at t = 0",
                        asked.out.display()
                    ));
                }
                Start::Replace
            }
            Standing::Done(result) => {
                if args.json {
                    say(result.trim_end());
                } else if !args.quiet {
                    tell(&format!("the run in {} is done", asked.out.display()));
                }
                return Ok(None);
            }
            Standing::Stopped(found) => {
                found
                    .damaged
                    .iter()
                    .for_each(|why| remark(&format!("warning: {why}; an older state is taken")));
                if !args.quiet {
                    let (step, time) = (found.origin.step, found.origin.time);
                    let decimals = of_moment(case);
                    remark(&format!("going on from step {step}, t = {time:.decimals$} s"));
                    if found.origin.name != asked.name {
                        remark(&format!("its files keep their name, {}", found.origin.name));
                    }
                }
                Start::Resume(found)
            }
        },
    }))
}

/// What is computed, and on what.
fn announce(setup: &Setup, simulation: &Simulation) {
    // Those of the scene were shown when it was built.
    let more = &simulation.scene.notes[setup.scene.notes.len()..];
    more.iter().for_each(|note| remark(&format!("note: {note}")));
    let groups = simulation.groups;
    let device = simulation.backend.description();
    remark(&format!(
        "{}: {} particles, {} of water, on {device}",
        setup.name,
        groups.total() - setup.scene.reserve,
        setup.scene.water()
    ));
    let tolerance = simulation.settings().tolerance;
    if simulation.plan.wet() && tolerance < SINGLE && simulation.backend.precision() == "f32" {
        remark(&format!(
            "note: fluid.solver.tolerance = {tolerance:e} is finer than what a device holds in single precision, 3e-6 to {SINGLE:e} by the number of unknowns: \
             residuals may stay above it; --backend cpu meets it"
        ));
    }
    let words = step_warnings(&simulation.case, &setup.scene, &simulation.params);
    words.iter().for_each(|line| remark(line));
    let step = shortest(&simulation.case, &setup.scene, &simulation.params);
    let advice = simulation.solids.advice(step);
    advice.words.iter().for_each(|line| remark(line));
}

/// So many bodies are named at the end.
const BODIES: usize = 20;

fn words(summary: &Summary, case: &Case, out: &Path) -> String {
    let m = &summary.monitors;
    // Why a run failed is an error, and said as one.
    let ended = match summary.status {
        Status::Done | Status::Interrupted => &summary.exit_reason,
        Status::Diverged => "diverged",
        Status::Failed => "failed",
    };
    let own = summary.steps - summary.steps_before;
    let before = match summary.steps_before {
        0 => String::new(),
        n => format!(", after {n} of run.from,"),
    };
    let mut lines = vec![format!(
        "{}: {own} steps{before} to t = {:.*} s in {} ({:.3e} s a step) on {}",
        ended,
        of_moment(case),
        summary.time_s,
        clock(Duration::from_secs_f64(summary.wall_s)),
        summary.wall_s / own.max(1) as f64,
        summary.adapter,
    )];
    if let Some(fluid) = summary.water_in_all() {
        let p = &summary.pressure;
        lines.push(format!(
            "pressure: {:.1} iterations a solve (at most {}) with {}, {} failures; density error {:.2e} mean, {:.2e} max",
            p.iterations_mean, p.iterations_max, p.preconditioner.unwrap_or("nothing"), p.failures, m.density_error_mean, m.density_error_max
        ));
        let seen =
            if m.steps_seen < own { format!("in {} steps of {own}", m.steps_seen) } else { "at most".into() };
        lines.push(format!(
            "water: Courant number {seen} {:.2}; {} of {fluid} particles lost",
            m.courant_max, m.lost_particles
        ));
    }
    lines.push(format!("energy: {:.6e} J at the start, {:.6e} J at the end", m.energy_start, m.energy_end));
    // Where obstacles are the case says.
    let stands = |name: &str| case.obstacle.iter().any(|o| o.name == name);
    let bodies: Vec<_> = summary.bodies.iter().filter(|body| !stands(&body.name)).collect();
    let places = of_place(case.run.spacing);
    for body in bodies.iter().take(BODIES) {
        let [x, y, z] = body.position_m;
        lines.push(format!("{}: at ({x:.places$}, {y:.places$}, {z:.places$}) m", body.name));
    }
    if bodies.len() > BODIES {
        lines.push(format!("{} more bodies: in result.json", bodies.len() - BODIES));
    }
    if summary.verdict.grade == Grade::Fine {
        lines.push("verdict: fine".into());
    }
    lines.extend(summary.verdict.left_out.iter().map(|left_out| format!("not judged: {left_out}")));
    lines.extend(summary.verdict.notes.iter().map(|note| format!("note: {note}")));
    lines.push(format!("results in {}", out.display()));
    lines.join("\n")
}
