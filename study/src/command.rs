//! `seixo study`: what can be typed, and what happens then.

use super::builtin::ENTRIES;
use super::computers::ComputerArgs;
use super::definition::Setup;
use super::engine::{Context, Make, Options, Shard, ended};
use super::kept::gather;
use super::manifest::{Listed, Manifest};
use seixo::console::say;
use seixo::error::{Error, Result};
use seixo::output::spare::spare_run;
use seixo::stop::Stop;
use std::path::PathBuf;

/// Run a study: error against run time, limits of stability, what a scene does not need.
#[derive(Clone, Debug, clap::Args)]
pub struct StudyArgs {
    /// A study file (TOML), the name of a built-in study, `list`, or `collect` to join the results of shards.
    pub what: String,
    /// With `collect`: the folders to join; the first one gets the result, unless --out names another.
    pub folders: Vec<PathBuf>,
    /// Folder of the results; `study-NAME` if absent. Finished points in it are kept.
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// All points, also the costly ones.
    #[arg(long)]
    pub full: bool,
    /// The error that you want to stay below, for the recommendation, e.g. 0.01.
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = bound)]
    pub error: Option<f64>,
    /// Compute one part of the points, e.g. 2/8; `collect` joins them.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Change a value of the case at every point; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Runs of each point, for the median time.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    pub repetitions: u32,
    /// On what.
    #[command(flatten)]
    pub computers: ComputerArgs,
    /// List the points and compute nothing.
    #[arg(long)]
    pub dry_run: bool,
    /// No progress on stderr.
    #[arg(short, long)]
    pub quiet: bool,
}

/// An error to stay below.
fn bound(text: &str) -> std::result::Result<f64, String> {
    let number = text.trim().parse().ok().filter(|x: &f64| *x > 0.0 && x.is_finite());
    number.ok_or_else(|| "write a number of more than 0".into())
}

/// Run `args` until `stop` asks to end. Findings go to stdout, progress to stderr.
///
/// # Errors
/// [`Error::Case`] for a study that cannot be set up, [`Error::Folder`] for a folder in use, [`Error::Io`], [`Error::Interrupted`], and
/// those of [`ended`]: points that fail beside others are results.
pub fn command(args: &StudyArgs, stop: &Stop) -> Result<()> {
    let computers = args.computers.start()?;
    let make: &Make = &|processor, scene, params, plan, settings| {
        computers.backend(processor, scene, params, plan, settings)
    };
    if args.what == "list" {
        for entry in ENTRIES {
            say(&format!("{:16} {}", entry.name, entry.about));
        }
        return Ok(());
    }
    let collect = args.what == "collect";
    if let Some(extra) = args.folders.first().filter(|_| !collect) {
        return Err(Error::usage("study", format!("`{}`: only `collect` takes folders", extra.display())));
    }
    let (manifest, study) = if collect {
        Manifest::joined(&args.folders)?
    } else {
        let (full, sets, processor) = (args.full, args.sets.clone(), args.computers.backend);
        Manifest::new(&args.what, &Setup { full, sets, processor, runs: 0 })?
    };
    let points = manifest.points();
    if args.dry_run {
        for (k, Listed { hash, point }) in points.iter().enumerate() {
            say(&format!("{k:4}  {hash}  {point}"));
        }
        return Ok(());
    }
    let out = args.out.clone().or_else(|| args.folders.first().cloned());
    let out = out.unwrap_or_else(|| PathBuf::from(format!("study-{}", study.name)));
    spare_run(&out)?;
    let (rows, text) = if collect {
        let hashes: Vec<String> = points.iter().map(|p| p.hash.clone()).collect();
        let rows = gather(&hashes, &out, &args.folders)?;
        manifest.write(&out)?;
        study.conclude(&out, rows, args.error)?
    } else {
        let options = Options { out: out.clone(), shard: args.shard, quiet: args.quiet, collect: None };
        let _alone = options.hold()?;
        manifest.write(&out)?;
        let context = Context {
            repetitions: args.repetitions,
            stop: stop.clone(),
            save_every: args.computers.save_every,
            ..Context::new(make)
        };
        study.run(&options, &context, args.error)?
    };
    say(text.trim_end_matches('\n'));
    let missing = points.len() - rows.len();
    if missing > 0 {
        say(&format!("{missing} of {} points are still to be computed.", points.len()));
    }
    say(&format!("Results: {}", out.join("report.md").display()));
    // A part says nothing of the whole, which is that of `collect` once all of them are there.
    if args.shard.is_none() && missing == 0 { ended(&rows) } else { Ok(()) }
}
