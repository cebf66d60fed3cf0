//! `seixo bench`.

use super::setup::Setup;
use super::{BackendName, CaseArgs, Changes, DeviceArgs, Exit, device};
use seixo::backend::gpu::{AdapterInfo, adapters, bandwidth};
use seixo::backend::traffic::Solve;
use seixo::console::{remark, say, say_json};
use seixo::error::{Error, Result};
use seixo::output::spare::spare;
use seixo::output::write_whole;
use seixo_study::bench::{Growth, Row, host_bandwidth, measure};
use serde::Serialize;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct BenchArgs {
    /// The case; in seixo's repository cases/dam_break_transport.toml if absent.
    case: Option<PathBuf>,
    /// Spacings l0 [m] to time; if absent, that of the case, and without a case 0.03,0.02,0.015,0.01,0.0075,0.006.
    #[arg(long, value_delimiter = ',')]
    spacings: Vec<f64>,
    /// Change a value of the case; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    #[command(flatten)]
    device: DeviceArgs,
    /// Steps to time at each spacing.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..))]
    steps: u64,
    /// Simulated time from which to time [s], e.g. after the collapse.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    from: f64,
    /// Spacings with more particles than this are left out on a software GPU [thousands].
    #[arg(long, value_name = "K", default_value_t = 150)]
    software_limit: usize,
    /// Also write the results as JSON to this file.
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print JSON instead of the table.
    #[arg(long)]
    json: bool,
}

/// The case that is timed where none is named, of a checkout.
const OWN: &str = "cases/dam_break_transport.toml";
/// Spacings at which that one is timed [m].
const OWN_SPACINGS: [Option<f64>; 6] =
    [Some(0.03), Some(0.02), Some(0.015), Some(0.01), Some(0.0075), Some(0.006)];

impl BenchArgs {
    fn case(&self) -> Result<PathBuf> {
        let own = || Some(PathBuf::from(OWN)).filter(|path| path.is_file());
        self.case.clone().or_else(own).ok_or_else(|| {
            let text = format!(
                "name the case to time, `seixo bench CASE --spacings L,L,..`, e.g. one that `seixo init` writes: {OWN}, \
                 which is timed without a name, is a file of seixo's repository and not here"
            );
            Error::usage("CASE", text)
        })
    }

    /// Those to time, `None` where it is the case's own.
    fn spacings(&self) -> Vec<Option<f64>> {
        match (&self.spacings[..], &self.case) {
            ([], None) => OWN_SPACINGS.to_vec(),
            ([], Some(_)) => vec![None],
            (typed, _) => typed.iter().copied().map(Some).collect(),
        }
    }
}

/// How a file of results begins, and nobody else's.
const MARK: &str = "{\n  \"made_by\": \"seixo bench\",\n";

#[derive(Serialize)]
struct Report {
    made_by: &'static str,
    version: &'static str,
    commit: Option<String>,
    cores: usize,
    adapters: Vec<AdapterInfo>,
    case: String,
    sets: Vec<String>,
    rows: Vec<Row>,
    /// How time grows with size, by backend.
    growth: Vec<(String, Option<Growth>)>,
}

/// The commit of the checkout that the program runs in, if it is one.
fn commit() -> Option<String> {
    let out = std::process::Command::new("git").args(["rev-parse", "--short", "HEAD"]).output().ok()?;
    out.status.success().then(|| String::from_utf8_lossy(&out.stdout).trim().to_owned())
}

/// Backends to time: both unless one was asked for.
fn choices(args: &DeviceArgs) -> Vec<BackendName> {
    match (args.backend, args.adapter.is_some()) {
        (BackendName::Cpu, _) => vec![BackendName::Cpu],
        (BackendName::Gpu, _) | (_, true) => vec![BackendName::Gpu],
        (BackendName::Auto, false) if adapters().is_empty() => vec![BackendName::Cpu],
        (BackendName::Auto, false) => vec![BackendName::Cpu, BackendName::Gpu],
    }
}

fn timed(
    args: &BenchArgs,
    backend: BackendName,
    spacing: Option<f64>,
    bandwidth: f64,
) -> Result<Option<Row>> {
    let changes = Changes { spacing, sets: args.sets.clone(), until: None };
    let case = CaseArgs { case: args.case()?, changes };
    let setup = Setup::new(&case, true)?;
    let (end, spacing) = (setup.loaded.case.run.end, setup.scene.spacing);
    if !(0.0..=end).contains(&args.from) {
        let from = args.from;
        let text = format!("--from {from} lies outside of the run; allowed: 0 to {end} (run.end)");
        return Err(Error::usage("--from", text));
    }
    let particles = setup.scene.groups.total() - setup.scene.reserve;
    let device = DeviceArgs { backend, ..args.device.clone() };
    let software = backend == BackendName::Gpu && !adapters().iter().any(|a| a.is_hardware());
    if software && particles > 1000 * args.software_limit {
        remark(&format!(
            "l0 = {spacing}: {particles} particles left out on a software GPU (--software-limit)"
        ));
        return Ok(None);
    }
    remark(&format!("l0 = {spacing}: {particles} particles, {backend:?} ..."));
    // Software acts as a GPU for correctness, not speed: a tenth of the steps will do.
    let steps = if software { (args.steps / 10).max(3) } else { args.steps };
    let processor = device::processor(&device)?;
    let make = |s: &_, p: &_, plan: &_, settings| processor.open(s, p, plan, settings);
    measure(&setup.loaded.case, args.from, steps, bandwidth, &make).map(Some)
}

pub fn bench(args: &BenchArgs) -> Exit {
    seixo::threads::start(args.device.threads)?;
    let case = args.case()?;
    args.out.iter().try_for_each(|path| spare(path, MARK))?;
    let host = host_bandwidth();
    let (mut rows, mut growth) = (Vec::new(), Vec::new());
    for backend in choices(&args.device) {
        let bandwidth = match backend {
            BackendName::Gpu => bandwidth(args.device.adapter.as_deref())?,
            _ => host,
        };
        let mut own = Vec::new();
        for spacing in args.spacings() {
            own.extend(timed(args, backend, spacing, bandwidth)?);
        }
        let name = own.first().map_or_else(|| format!("{backend:?}"), |r: &Row| r.adapter.clone());
        growth.push((name, Growth::of(&own)));
        rows.append(&mut own);
    }
    let report = Report {
        made_by: "seixo bench",
        version: env!("CARGO_PKG_VERSION"),
        commit: commit(),
        cores: std::thread::available_parallelism().map_or(1, usize::from),
        adapters: adapters(),
        case: case.display().to_string(),
        sets: args.sets.clone(),
        rows,
        growth,
    };
    if let Some(path) = &args.out {
        let text = serde_json::to_string_pretty(&report).unwrap_or_default() + "\n";
        write_whole(path, text.as_bytes())?;
    }
    if args.json {
        say_json(&report);
    } else {
        table(&report);
    }
    Ok(0)
}

/// The counted work of the solver, and what all counts amount to.
fn solver(r: &Row) {
    let Solve { ends, build, iteration, cycle } = r.solve;
    say("  counted in the solver     MB  dispatches");
    let parts = [
        ("once: residuals", ends),
        ("once: levels", build),
        ("iteration: vectors", iteration),
        ("iteration: cycle", cycle),
    ];
    for (name, work) in parts.iter().filter(|(_, work)| work.bytes > 0) {
        say(&format!("    {name:<18} {:>8.2} {:>11}", work.bytes as f64 / 1e6, work.dispatches));
    }
    if build.bytes > 0 {
        let each = iteration + cycle;
        say(&format!(
            "    the levels are worth {:.2} iterations in bytes{}",
            build.bytes as f64 / each.bytes as f64,
            if each.dispatches > 0 {
                format!(", {:.2} in dispatches", build.dispatches as f64 / each.dispatches as f64)
            } else {
                String::new()
            }
        ));
    }
    let [slots, rows] = r.slots;
    say(&format!("  {} of {slots} slots of the solver are dry walls", slots - rows));
    if let Some(i) = &r.implied {
        say(&format!(
            "  counted {:.1} MB and {:.1} dispatches a step; on a device with {:.1} TB/s and {:.0} us a dispatch that \
             would be {:.2} ms, {:.2} ms of it in the solver",
            i.bytes as f64 / 1e6,
            r.dispatches,
            i.assumed_bandwidth / 1e12,
            1e6 * i.assumed_seconds_per_dispatch,
            1e3 * i.seconds_per_step,
            1e3 * i.pressure_seconds
        ));
    }
}

fn table(report: &Report) {
    say(&format!("{} cores", report.cores));
    for r in &report.rows {
        say(&format!(
            "\n{} ({}), l0 = {} m: {} particles, {} of them fluid, {} unknowns\n\
             {:.4} s a step (middle half {:.4} to {:.4}), {:.2e} particles a second, {} {:.1} iterations to {:.0e}, \
             {:.0} MB held, density error at most {:.3}; copy bandwidth of its memory {:.1} GB/s",
            r.adapter,
            r.precision,
            r.spacing,
            r.particles,
            r.fluid,
            r.unknowns,
            r.seconds_per_step,
            r.quartiles[0],
            r.quartiles[1],
            r.particles_per_second,
            r.preconditioner,
            r.iterations,
            r.tolerance,
            r.bytes_held as f64 / 1e6,
            r.density_error_max,
            r.bandwidth / 1e9
        ));
        if r.dispatches > 0.0 {
            say(&format!(
                "a step: {:.1} dispatches, {:.2} submissions, {:.2} waits of the host",
                r.dispatches, r.submits, r.waits
            ));
        }
        say(&format!("stages by {}", r.timing.name()));
        say(&format!(
            "  {:<20} {:>10} {:>10} {:>14} {:>11}",
            "stage", "ms", "MB", "of the floor", "dispatches"
        ));
        for s in &r.stages {
            say(&format!(
                "  {:<20} {:>10.3} {:>10.2} {:>13.0} % {:>10.1}",
                s.stage,
                1e3 * s.seconds,
                s.bytes as f64 / 1e6,
                100.0 * s.floor_fraction,
                s.dispatches
            ));
        }
        solver(r);
    }
    for (name, growth) in &report.growth {
        if let Some(g) = growth {
            say(&format!(
                "\n{name}: time a step ~ particles^{:.3} ~ unknowns^{:.3}",
                g.with_particles, g.with_unknowns
            ));
        }
    }
}
