//! What can be typed, and what the program answers with: results on stdout, progress and remarks on stderr,
//! and an exit code. The program `seixo` is [`main`] and nothing else; the Python package starts it, too.

mod bench;
mod compare;
mod compare_runs;
mod device;
mod frames;
mod init;
mod keys;
mod measure;
mod plan;
mod progress;
mod ranks;
mod render;
mod report;
mod run;
mod setup;
mod shell;
mod signals;
mod surface;
mod typed;
mod width;

use clap::{Parser, Subcommand, ValueEnum};
use seixo::console::{lost, remark, say};
use seixo::error::Error;
use seixo::stop::Stop;
use std::ffi::OsString;
use std::path::PathBuf;

const EXIT_CODES: &str = "Exit codes:
  0    done
  1    compare: GPU and CPU differ by more than single precision explains
  2    the case or the command line is wrong
  3    no suitable GPU, or the device was lost
  4    the computation diverged (its last state is kept), or its result means nothing;
       of a study: no point has a result
  5    a file could not be read or written, or a result not be printed
  75   stopped by --max-wall, SIGUSR1 or SIGXCPU with the state saved: go on with --resume
  129, 130, 143  interrupted by SIGHUP, SIGINT (Ctrl-C), SIGTERM; the state is saved";

/// Water that carries solids: incompressible particle flow (MPS) with rigid bodies that float, collide and
/// slide, on any GPU or on the CPU.
#[derive(Debug, Parser)]
#[command(name = "seixo", version, after_help = EXIT_CODES, max_term_width = 110)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a commented case to begin with: dam-break, floating-body, sliding-block or flume.
    Init(init::InitArgs),
    /// Run a case and write its results.
    Run(run::RunArgs),
    /// Draw the frames of a run as PNG.
    Render(render::RenderArgs),
    /// Tell of a run on one page (HTML) that holds everything: verdict, pictures, curves, times.
    Report(report::ReportArgs),
    /// Velocity and pressure at points or along lines, from the frames of a run, as CSV.
    Measure(measure::MeasureArgs),
    /// The surface of the water as a mesh (PLY, OBJ) of each frame of a run.
    Surface(surface::SurfaceArgs),
    /// Show what a run would compute, and what it would leave out and why; compute nothing.
    Plan(plan::PlanArgs),
    /// Compare the GPU with the CPU: every stage of one step, then the drift over many.
    Compare(compare::CompareArgs),
    /// Lay two or more runs over each other: curves on one page (HTML), differences as a table and as CSV.
    CompareRuns(compare_runs::CompareRunsArgs),
    /// Run a study: error against run time, limits of stability, what a scene does not need.
    Study(seixo_study::command::StudyArgs),
    /// Hold runs against experiments and analytic solutions: one page with tables and charts.
    Validate(seixo_study::validation::command::ValidateArgs),
    /// Time a step by stage, against the bytes that must move.
    Bench(bench::BenchArgs),
    /// List the adapters that can be used.
    Adapters {
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// List the keys of a case file: what each is, what is allowed, what it is if left out, an example.
    Keys(keys::KeysArgs),
    /// Print the JSON schema of case files, or of study files.
    Schema {
        /// Of which files.
        #[arg(value_enum, default_value_t = SchemaOf::Case)]
        of: SchemaOf,
    },
    /// Print the completions for a shell, e.g. `seixo completions bash > ~/.local/share/bash-completion/completions/seixo`.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Print the manual page, or write those of all commands.
    Man(shell::ManArgs),
}

/// Which case, and what to change in it.
#[derive(Debug, clap::Args)]
struct CaseArgs {
    /// The case file (TOML); - reads it from standard input.
    case: PathBuf,
    #[command(flatten)]
    changes: Changes,
}

/// What to change in a case.
#[derive(Clone, Debug, Default, clap::Args)]
struct Changes {
    /// Particle spacing l0 [m], instead of run.spacing.
    #[arg(long, value_name = "L", allow_negative_numbers = true, value_parser = finite)]
    spacing: Option<f64>,
    /// Change a value of the case, e.g. --set fluid.preset=paper --set body.0.density=800; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// End of the run [s], instead of run.end.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
    until: Option<f64>,
}

impl Changes {
    /// All changes of values, those with an option of their own as well.
    ///
    /// # Errors
    /// [`Error::Usage`] for two values of one key: nobody knows which one is meant.
    fn all_sets(&self) -> seixo::error::Result<Vec<String>> {
        for (option, key, given) in
            [("--spacing", "run.spacing", self.spacing), ("--until", "run.end", self.until)]
        {
            let other = |(k, value): (&str, &str)| k.trim() == key && value.trim().parse().ok() != given;
            let set = |s: &&String| given.is_some() && s.split_once('=').is_some_and(other);
            if let Some(set) = self.sets.iter().find(set) {
                let text = format!("{option} and --set {set} both say what {key} is: leave one of them out");
                return Err(Error::usage(option, text));
            }
        }
        let keys: Vec<(&str, &String)> =
            self.sets.iter().filter_map(|s| Some((s.split_once('=')?.0.trim(), s))).collect();
        for (k, (key, set)) in keys.iter().enumerate() {
            // A list may be given and a value of it changed then, but not the other way round.
            let lost = |(before, other): &&(&str, &String)| {
                let within =
                    before.strip_prefix(key).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
                within && other != set
            };
            if let Some((_, other)) = keys[..k].iter().find(lost) {
                let text =
                    format!("--set {set} takes the place of what --set {other} says: leave one of them out");
                return Err(Error::usage("--set", text));
            }
        }
        let end = self.until.map(|end| format!("run.end={end:?}"));
        Ok(self.sets.iter().cloned().chain(end).collect())
    }
}

/// So many of a thing that takes an s where they are many.
fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// A number that is one.
fn finite(text: &str) -> Result<f64, String> {
    let number: f64 = text.trim().parse().map_err(|_| "not a number".to_owned())?;
    if number.is_finite() { Ok(number) } else { Err("write a finite number".into()) }
}

/// Where to compute.
#[derive(Clone, Debug, clap::Args)]
struct DeviceArgs {
    /// Processor: auto takes a hardware GPU if there is one that takes the scene, else the CPU; on many ranks the CPU.
    #[arg(long, value_enum, default_value_t = BackendName::Auto)]
    backend: BackendName,
    /// Number of the adapter as `seixo adapters` lists it, or a part of its name; implies --backend gpu. Ranks of a machine take those of that
    /// name in turn.
    #[arg(long, value_name = "N", value_parser = clap::builder::NonEmptyStringValueParser::new())]
    adapter: Option<String>,
    /// Threads of the CPU path; all cores if absent.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=seixo::threads::MOST))]
    threads: Option<u16>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum BackendName {
    Auto,
    Gpu,
    Cpu,
}

/// Files that have a schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum SchemaOf {
    /// Case files.
    Case,
    /// Study and validation files.
    Study,
}

/// How a command ended, if it did not fail: its exit code.
type Exit = Result<u8, Error>;

/// A sweep, with its exit code where a signal ended it.
fn sweep(quiet: bool, command: impl FnOnce(&Stop) -> Result<(), Error>) -> Exit {
    let stop = signals::watch(quiet)?;
    match (command(&stop), stop.signal()) {
        (Err(Error::Interrupted), Some(signal)) => {
            remark("the state of the point in progress is saved: the same command goes on there");
            Ok(signals::exit_code(signal))
        }
        (ended, _) => ended.map(|()| 0),
    }
}

/// Mesa's layer that picks a default device looks for a desktop session, and where there is none, a library of that session
/// prints an error. Nothing here depends on that pick: adapters are chosen by rank or by name.
#[cfg(target_os = "linux")]
fn hush_device_select() {
    let unset = |name| std::env::var_os(name).is_none();
    if unset("XDG_RUNTIME_DIR") && unset("MESA_VK_DEVICE_SELECT") {
        // SAFETY: no other thread has been started.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

/// The program, with `words` as its command line, its own name first; returns the exit code. Call it once, before other threads are
/// started.
pub fn main(words: impl IntoIterator<Item = OsString>) -> u8 {
    #[cfg(target_os = "linux")]
    hush_device_select();
    signals::survive_limits();
    seixo::console::fit([width::of_stdout(), width::of_stderr()]);
    let args = match Args::try_parse_from(words) {
        Ok(args) => args,
        Err(told) => {
            // Nobody listens, then.
            let _ = told.print();
            return told.exit_code() as u8;
        }
    };
    let exit = match args.command {
        Command::Init(args) => init::init(&args),
        Command::Run(args) => run::run(&args),
        Command::Render(args) => render::render(&args),
        Command::Report(args) => report::report(&args),
        Command::Measure(args) => measure::measure(&args),
        Command::Surface(args) => surface::write(&args),
        Command::Plan(args) => plan::plan(&args),
        Command::Bench(args) => bench::bench(&args),
        Command::Compare(args) => compare::compare(&args),
        Command::CompareRuns(args) => compare_runs::compare_runs(&args),
        Command::Study(args) => sweep(args.quiet, |stop| seixo_study::command::command(&args, stop)),
        Command::Validate(args) => {
            sweep(args.quiet, |stop| seixo_study::validation::command::command(&args, stop))
        }
        Command::Adapters { json } => device::list(json),
        Command::Keys(args) => keys::keys(&args),
        Command::Schema { of } => {
            let text = match of {
                SchemaOf::Case => seixo::case::Case::schema(),
                SchemaOf::Study => seixo_study::definition::Definition::schema(),
            };
            say(text.trim_end());
            Ok(0)
        }
        Command::Completions { shell } => shell::completions(shell),
        Command::Man(args) => shell::man(&args),
    };
    // Only a command that did what it was asked for can fail at being heard.
    match exit.and_then(|code| if code == 0 { lost().map(|()| 0) } else { Ok(code) }) {
        Ok(code) => code,
        Err(error) => {
            let text = error.to_string();
            // Reports on case files come with their own heading.
            remark(&format!("{}{text}", if text.starts_with("error") { "" } else { "error: " }));
            error.exit_code()
        }
    }
}
