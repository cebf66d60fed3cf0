//! `seixo run`.

use super::progress::{Display, clock};
use super::setup::Setup;
use super::{CaseArgs, DeviceArgs, Exit};
use seixo::console::{remark, say};
use seixo::error::{Error, Result};
use seixo::output::result::{Grade, Status, Summary};
use seixo::run::{Options, run as run_simulation};
use signal_hook::consts::{SIGINT, SIGTERM};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize};
use std::time::Duration;

#[derive(Debug, clap::Args)]
pub struct RunArgs {
    #[command(flatten)]
    case: CaseArgs,
    #[command(flatten)]
    device: DeviceArgs,
    /// Folder of the results [default: out/NAME-OF-THE-CASE].
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace earlier results in the folder.
    #[arg(long)]
    force: bool,
    /// Stop after this many steps.
    #[arg(long, value_name = "N")]
    steps: Option<u64>,
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

pub fn run(args: &RunArgs) -> Exit {
    seixo::threads::start(args.device.threads)?;
    let setup = Setup::new(&args.case, args.quiet)?;
    let mut simulation = setup.simulation(&args.device)?;
    let options = Options {
        out: args.out.clone().unwrap_or_else(|| Path::new("out").join(&setup.name)),
        name: setup.name.clone(),
        force: args.force,
        steps: args.steps,
        pictures: args.picture,
        inputs: vec![args.case.case.clone()],
    };
    if !args.quiet {
        let groups = simulation.groups;
        let device = simulation.backend.description();
        remark(&format!(
            "{}: {} particles, {} of water, on {device}",
            setup.name,
            groups.total(),
            groups.fluid
        ));
        let advice = simulation.solids.advice(simulation.case.run.time_step);
        advice.words.iter().for_each(|line| remark(line));
    }
    // Until here there is nothing to save, and a signal ends the program at once.
    let stop = watch_signals()?;
    let mut display = Display::new(args.quiet, simulation.plan.wet());
    let mut observe = |progress: &seixo::run::Progress| display.step(progress);
    let finished =
        run_simulation(&mut simulation, &setup.scene, &setup.loaded.text, &options, &stop, &mut observe)?;
    display.finish();
    let verdict = &finished.summary.verdict;
    if finished.error.is_none() && verdict.grade != Grade::Fine {
        remark(&format!("verdict: {verdict}"));
    }
    if args.json {
        say(&finished.summary.json());
    } else if !args.quiet {
        say(&words(&finished.summary, &options.out));
    }
    match (finished.error, finished.signal) {
        (Some(error), _) => Err(error),
        (None, Some(signal)) => Ok(128 + signal as u8),
        (None, None) => Ok(0),
    }
}

/// A number that turns from 0 to that of the signal that asked the run to end. A second signal ends the
/// program on the spot.
fn watch_signals() -> Result<Arc<AtomicUsize>> {
    let stop = Arc::new(AtomicUsize::new(0));
    let armed = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // The order matters: at the first signal the shutdown is not armed yet.
        signal_hook::flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&armed))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&armed)))
            .and_then(|_| signal_hook::flag::register_usize(signal, Arc::clone(&stop), signal as usize))
            .map_err(Error::io("signal handler"))?;
    }
    Ok(stop)
}

fn words(summary: &Summary, out: &Path) -> String {
    let m = &summary.monitors;
    // Why a run failed is an error, and said as one.
    let ended = match summary.status {
        Status::Done | Status::Interrupted => &summary.exit_reason,
        Status::Diverged => "diverged",
        Status::Failed => "failed",
    };
    let mut lines = vec![format!(
        "{}: {} steps to t = {:.4} s in {} ({:.3e} s a step) on {}",
        ended,
        summary.steps,
        summary.time_s,
        clock(Duration::from_secs_f64(summary.wall_s)),
        summary.wall_s / summary.steps.max(1) as f64,
        summary.adapter,
    )];
    if summary.particles.fluid > 0 {
        let p = &summary.pressure;
        lines.push(format!(
            "pressure: {:.1} iterations a solve (at most {}) with {}, {} failures; density error {:.2e} mean, {:.2e} max",
            p.iterations_mean, p.iterations_max, p.preconditioner.unwrap_or("nothing"), p.failures, m.density_error_mean, m.density_error_max
        ));
        let (lost, fluid) = (m.lost_particles, summary.particles.fluid);
        lines.push(format!(
            "water: Courant number at most {:.2}; {lost} of {fluid} particles lost",
            m.courant_max
        ));
    }
    lines.push(format!("energy: {:.6e} J at the start, {:.6e} J at the end", m.energy_start, m.energy_end));
    for body in &summary.bodies {
        let [x, y, z] = body.position_m;
        lines.push(format!("{}: at ({x:.4}, {y:.4}, {z:.4}) m", body.name));
    }
    if summary.verdict.grade == Grade::Fine {
        lines.push("verdict: fine".into());
    }
    lines.push(format!("results in {}", out.display()));
    lines.join("\n")
}
