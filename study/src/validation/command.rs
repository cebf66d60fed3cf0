//! `seixo validate`: what can be typed, and what happens then.

use super::Suite;
use super::page;
use crate::cases;
use crate::computers::ComputerArgs;
use crate::definition::{Definition, Setup};
use crate::engine::{Context, Make, Options, Shard, ended};
use crate::report::write_table;
use seixo::console::say;
use seixo::error::{Error, Result};
use seixo::output::spare::{spare, spare_run};
use seixo::stop::Stop;
use std::path::PathBuf;

/// Hold runs against experiments and analytic solutions: one page with tables and charts.
#[derive(Clone, Debug, clap::Args)]
pub struct ValidateArgs {
    /// Validations, by name or as files (TOML); all that come with the program if absent. `list` shows them.
    pub names: Vec<String>,
    /// Folder of the results. Finished points in it are kept.
    #[arg(short, long, value_name = "DIR", default_value = "validation")]
    pub out: PathBuf,
    /// The page, with its charts in `img` beside it; DIR/validation.md if absent.
    #[arg(long, value_name = "FILE")]
    pub page: Option<PathBuf>,
    /// The costly points as well.
    #[arg(long)]
    pub full: bool,
    /// Run each point from this many starts that differ by chance (fluid.jitter, fluid.seed): mean and spread.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    pub runs: u32,
    /// Compute one part of the points, e.g. 2/8; `--join` puts them together.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Compute nothing; take finished points from this folder, too. May be repeated.
    #[arg(long, value_name = "DIR")]
    pub join: Vec<PathBuf>,
    /// Change a value of every case; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
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

/// Run `args` until `stop` asks to end. A line for each check goes to stdout, progress to stderr.
///
/// # Errors
/// [`seixo::error::Error::Case`] for a validation that cannot be set up, [`seixo::error::Error::Folder`] for a folder in
/// use, [`seixo::error::Error::Io`], and those of [`ended`]: points that fail beside others, and checks that do, are results.
pub fn command(args: &ValidateArgs, stop: &Stop) -> Result<()> {
    if args.names == ["list"] {
        for name in cases::names("validation") {
            let definition = Definition::parse(name, &cases::text("validation", &format!("{name}.toml"))?)?;
            let when = if definition.full { " (with --full)" } else { "" };
            say(&format!("{name:20} {}{when}", definition.title));
        }
        return Ok(());
    }
    let setup = Setup {
        full: args.full,
        sets: args.sets.clone(),
        processor: args.computers.backend,
        runs: args.runs,
    };
    let suite = Suite::new(&args.names, &setup)?;
    if args.dry_run {
        suite.points().for_each(|point| say(&point));
        return Ok(());
    }
    if let Some(folder) = args.join.iter().find(|folder| !folder.join("points").is_dir()) {
        let text = format!("--join {}: it holds no points of a validation (no points/)", folder.display());
        return Err(Error::usage("--join", text));
    }
    spare_run(&args.out)?;
    let path = args.page.clone().unwrap_or_else(|| args.out.join("validation.md"));
    spare(&path, page::MARK)?;
    let computers = args.computers.start()?;
    let options = Options {
        out: args.out.clone(),
        shard: args.shard,
        quiet: args.quiet,
        collect: (!args.join.is_empty()).then(|| args.join.clone()),
    };
    let _alone = options.hold()?;
    let make: &Make = &|processor, scene, params, plan, settings| {
        computers.backend(processor, scene, params, plan, settings)
    };
    let context = Context { stop: stop.clone(), save_every: args.computers.save_every, ..Context::new(make) };
    let rows = suite.run(&options, &context)?;
    write_table(&args.out.join("results.csv"), &rows)?;
    page::write(&path, &suite, &rows)?;
    for validation in &suite.validations {
        page::lines(validation, &rows).iter().for_each(|line| say(line));
        validation.notes(&rows).iter().for_each(|note| say(&format!("note: {note}")));
    }
    let missing = suite.len() - rows.len();
    if missing > 0 {
        say(&format!("{missing} of {} points are still to be computed.", suite.len()));
    }
    say(&format!("Page: {}", path.display()));
    if args.shard.is_none() && missing == 0 { ended(&rows) } else { Ok(()) }
}
