//! `seixo study`: what can be typed, and what happens then.

use super::Study;
use super::builtin::{self, ENTRIES};
use super::computers::ComputerArgs;
use super::definition::{Setup, files_of};
use super::engine::{Context, Make, Options, Processor, Shard};
use seixo::console::say;
use seixo::error::{Error, Result};
use seixo::output::spare::spare_run;
use seixo::output::write_whole;
use seixo::stop::Stop;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

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
    #[arg(long, value_name = "X")]
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

/// What `collect` needs to know of a study: `study.json` in its folder.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
struct Manifest {
    what: String,
    /// Text and folder of a study file; nothing for a built-in study.
    file: Option<(String, PathBuf)>,
    full: bool,
    sets: Vec<String>,
    gpu: bool,
}

impl Manifest {
    fn new(args: &StudyArgs) -> Result<Self> {
        let path = Path::new(&args.what);
        let is_file = path.extension().is_some_and(|e| e == "toml");
        let file = if is_file {
            let text = std::fs::read_to_string(path).map_err(|e| match e.kind() {
                std::io::ErrorKind::NotFound => {
                    Error::usage("study", format!("no study file at `{}`", path.display()))
                }
                _ => Error::io(path)(e),
            })?;
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            Some((text, folder.canonicalize().map_err(Error::io(folder))?))
        } else {
            None
        };
        Ok(Self {
            what: args.what.clone(),
            file,
            full: args.full,
            sets: args.sets.clone(),
            gpu: args.computers.backend == Processor::Gpu,
        })
    }

    /// Whether both are parts of one study: of a file with the same text, wherever it lay, or of the same built-in one.
    fn is_of(&self, other: &Self) -> bool {
        match (&self.file, &other.file) {
            (Some((a, _)), Some((b, _))) => a == b,
            (None, None) => self.what == other.what,
            _ => false,
        }
    }

    fn read(folder: &Path) -> Result<Self> {
        let path = folder.join("study.json");
        let text = std::fs::read_to_string(&path).map_err(|_| {
            Error::usage("collect", format!("`{}` holds no study (no study.json)", folder.display()))
        })?;
        serde_json::from_str(&text)
            .map_err(|e| Error::file(path.display().to_string(), "", format!("{}: {e}", path.display())))
    }

    fn write(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
        let text = serde_json::to_string_pretty(self).unwrap_or_default() + "\n";
        write_whole(&folder.join("study.json"), text.as_bytes())
    }

    fn study(&self) -> Result<Study> {
        let processor = if self.gpu { Processor::Gpu } else { Processor::Cpu };
        let setup = Setup { full: self.full, sets: self.sets.clone(), processor, runs: 0 };
        match &self.file {
            Some((text, folder)) => builtin::from_file(&self.what, text, &files_of(folder), &setup),
            None => builtin::find(&self.what, &setup),
        }
    }
}

/// Run `args` until `stop` asks to end. Findings go to stdout, progress to stderr.
///
/// # Errors
/// [`Error::Case`] for a study that cannot be set up, [`Error::Io`], [`Error::Interrupted`]. Points that fail are results.
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
    let (manifest, folders) = if collect {
        let first = args.folders.first().ok_or_else(|| {
            Error::usage(
                "collect",
                "collect: name the folders to join, e.g. seixo study collect part-1 part-2",
            )
        })?;
        let manifest = Manifest::read(first)?;
        for other in &args.folders[1..] {
            if !Manifest::read(other)?.is_of(&manifest) {
                let text = format!(
                    "collect: {} and {} hold parts of different studies",
                    first.display(),
                    other.display()
                );
                return Err(Error::usage("collect", text));
            }
        }
        (manifest, args.folders.clone())
    } else if let Some(extra) = args.folders.first() {
        return Err(Error::usage("study", format!("`{}`: only `collect` takes folders", extra.display())));
    } else {
        (Manifest::new(args)?, Vec::new())
    };
    let study = manifest.study()?;
    if args.dry_run {
        for (k, job) in study.jobs.iter().enumerate() {
            let parts: Vec<String> = job.parameters.iter().map(|(k, v)| format!("{k} = {v}")).collect();
            say(&format!("{k:4}  {}  {} ({})", job.hash(&study.name), job.method, parts.join(", ")));
        }
        return Ok(());
    }
    let out = args.out.clone().or_else(|| folders.first().cloned());
    let out = out.unwrap_or_else(|| PathBuf::from(format!("study-{}", study.name)));
    spare_run(&out)?;
    manifest.write(&out)?;
    let options = Options {
        out: out.clone(),
        shard: args.shard,
        quiet: args.quiet,
        collect: collect.then_some(folders),
    };
    let context = Context {
        repetitions: args.repetitions,
        stop: stop.clone(),
        save_every: args.computers.save_every,
        ..Context::new(make)
    };
    let (rows, text) = study.run(&options, &context, args.error)?;
    say(text.trim_end_matches('\n'));
    let missing = study.jobs.len() - rows.len();
    if missing > 0 {
        say(&format!("{missing} of {} points are still to be computed.", study.jobs.len()));
    }
    say(&format!("Results: {}", out.join("report.md").display()));
    Ok(())
}
