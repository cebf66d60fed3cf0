//! Errors of the library, each with what a user can do about it. Programs match on variants and fields; people read
//! the text, which is that of [`std::fmt::Display`].

use std::path::{Path, PathBuf};

/// What can go wrong. `main` maps each to an exit code.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The case, or another file that was written by hand, is wrong (exit code 2).
    #[error(transparent)]
    Case(#[from] CaseError),
    /// What was asked beside the case is wrong: an argument of a command or of a call (exit code 2).
    #[error("{message}")]
    Usage {
        /// The argument, e.g. `--resume`.
        argument: String,
        /// What is wrong with it, and what to do.
        message: String,
    },
    /// A folder of results cannot be used (exit code 2).
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A saved state cannot be used (exit code 2).
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// No adapter that the run can use, or the device was lost (exit code 3).
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The computation left the range in which it means anything (exit code 4).
    #[error("diverged at step {step}, t = {time:.6} s, stage {stage}: {what}")]
    Diverged {
        /// Step number, from 0.
        step: u64,
        /// Time [s].
        time: f64,
        /// Name of the stage that noticed.
        stage: &'static str,
        /// What was seen, with the particle or body.
        what: String,
    },
    /// It was asked to end in the middle of a step, which was given up: the state is that of no moment (exit code 75).
    #[error("stopped in the middle of a step")]
    Interrupted,
    /// The end was reached, but what was computed means nothing (exit code 4).
    #[error("{0}")]
    Senseless(String),
    /// A file could not be read or written (exit code 5).
    #[error("{}", of_file(path, source))]
    Io {
        /// The file.
        path: String,
        /// The cause.
        source: std::io::Error,
    },
}

/// Result with [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// Something wrong, or worth a warning, about a key.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Problem {
    /// The file, where there is one.
    pub file: Option<String>,
    /// Its line, from 1: of the key, or of the deepest part of it that is written there.
    pub line: Option<usize>,
    /// Column, from 1.
    pub column: Option<usize>,
    /// Dotted path of the key, e.g. `body.0.density`; empty where the whole file is at fault.
    pub key: String,
    /// What is wrong.
    pub message: String,
    /// What to do about it; empty where the message says it all.
    pub remedy: String,
    /// A warning: the case runs.
    pub warning: bool,
}

impl Problem {
    /// A problem with `key` that no place in a file is known of.
    pub fn new(key: impl Into<String>, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        let tidy = |text: String| tidy(&text);
        Self {
            key: key.into(),
            message: tidy(message.into()),
            remedy: tidy(remedy.into()),
            ..Self::default()
        }
    }
}

impl std::fmt::Display for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}: {}", self.key, self.message, self.remedy)
    }
}

/// Digits of a number that somebody may want to read, and letters of a value that somebody has written.
const MOST_DIGITS: usize = 22;
const MOST_LETTERS: usize = 120;

/// `text` for people: numbers of hundreds of digits with an exponent, long words in backticks up to where one knows them.
pub(crate) fn tidy(text: &str) -> String {
    let of_number = |c: char| c.is_ascii_digit() || c == '.';
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = rest.find(of_number) {
        let (before, from) = rest.split_at(start);
        let (digits, after) = from.split_at(from.find(|c| !of_number(c)).unwrap_or(from.len()));
        out.push_str(before);
        match digits.parse::<f64>() {
            Ok(number) if digits.len() > MOST_DIGITS => out.push_str(&format!("{number:e}")),
            _ => out.push_str(digits),
        }
        rest = after;
    }
    out.push_str(rest);
    let part = |(k, part): (usize, &str)| match part.char_indices().nth(MOST_LETTERS) {
        Some((cut, _)) if k % 2 == 1 => format!("{} ...", &part[..cut]),
        _ => part.to_owned(),
    };
    out.split('`').enumerate().map(part).collect::<Vec<_>>().join("`")
}

/// What is wrong with a case, or with a file of a study.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{text}")]
pub struct CaseError {
    /// Everything that is wrong, never empty; nothing in it is a warning.
    pub problems: Vec<Problem>,
    /// All of it in words, with the lines of the file.
    text: String,
}

impl CaseError {
    /// `problems` as `text` tells them.
    pub fn new(problems: Vec<Problem>, text: String) -> Self {
        Self { problems, text }
    }

    /// One problem: `message; remedy`.
    pub fn of(key: impl Into<String>, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        let problem = Problem::new(key, message, remedy);
        let text = match problem.remedy.as_str() {
            "" => problem.message.clone(),
            remedy => format!("{}; {remedy}", problem.message),
        };
        Self::new(vec![problem], text)
    }

    /// One problem of a `file`, in words.
    pub fn file(file: impl Into<String>, key: impl Into<String>, text: impl Into<String>) -> Self {
        let text = text.into();
        Self::new(vec![Problem { file: Some(file.into()), ..Problem::new(key, text.clone(), "") }], text)
    }

    /// All problems of several, one after the other.
    pub(crate) fn all(errors: Vec<Self>) -> Self {
        let text: Vec<&str> = errors.iter().map(|e| e.text.as_str()).collect();
        let text = text.join("\n");
        Self::new(errors.into_iter().flat_map(|e| e.problems).collect(), text)
    }
}

impl From<Problem> for CaseError {
    fn from(problem: Problem) -> Self {
        let text = problem.to_string();
        Self::new(vec![problem], text)
    }
}

/// Why a folder of results cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// It holds the results of another run.
    #[error(
        "{} is not empty; choose another folder with --out, go on with the run in it with --resume, or replace the \
         results in it with --force", .0.display()
    )]
    NotEmpty(PathBuf),
    /// It holds something else.
    #[error(
        "{} holds files and no `{marker}`, so that it is no folder of results: nothing in it is touched; choose another \
         folder with --out", folder.display()
    )]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// The file that a folder of results holds.
        marker: &'static str,
    },
    /// Somebody else writes there.
    #[error(
        "{} is in use: another process writes there; wait for its end, or choose another folder with --out", .0.display()
    )]
    InUse(PathBuf),
    /// A result would take the place of this input.
    #[error("{} would be overwritten by the results: choose another folder with --out", .0.display())]
    Input(PathBuf),
    /// A run would begin with a state of the run in it, and take its place.
    #[error(
        "run.from: {} is where the results go, too, which would replace the state that the run begins with: choose \
         another folder with --out", .0.display()
    )]
    State(PathBuf),
    /// What is asked for would take the place of a file of a run.
    #[error("{} belongs to the run in that folder: choose another place with --out", .0.display())]
    Result(PathBuf),
    /// What is asked for would take the place of a file of another kind.
    #[error(
        "{} is there already, and nothing that this command has written: choose another name with --out, or move it away",
        .0.display()
    )]
    Taken(PathBuf),
    /// Results of many runs would lie among those of one.
    #[error("{} is the folder of a run: choose another one with --out", .0.display())]
    Run(PathBuf),
    /// The run in it is one of another case.
    #[error(
        "the case is another one than that of the run in {}: {}{}; run it as it was, or {}", folder.display(),
        first(changed), more(changed), another(from.as_deref())
    )]
    OtherCase {
        /// The folder.
        folder: PathBuf,
        /// Keys that differ, each with both values.
        changed: Vec<String>,
        /// Where `run.from` finds a state that the changed case can begin with, if there is one.
        from: Option<PathBuf>,
    },
    /// There is no run in it to go on with.
    #[error("{}", no_run(.0))]
    NoRun(PathBuf),
    /// A file of it that the run goes on with is not there.
    #[error("{} is gone, and the run was to go on with it: put it back, or start again with --force", .0.display())]
    Gone(PathBuf),
    /// A file of it was changed since the run stopped.
    #[error(
        "{}: since the run stopped somebody has changed it, {what}: put it back as it was (its first {bytes} bytes), or start \
         again with --force", file.display()
    )]
    Edited {
        /// The file.
        file: PathBuf,
        /// What is other than the run wrote it.
        what: Edit,
        /// Bytes that the run keeps of it.
        bytes: u64,
    },
}

/// What somebody has done to a file that a run goes on with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Edit {
    /// Something at its end is missing.
    #[error("it is shorter")]
    Shorter,
    /// Its start is another one.
    #[error("it does not begin as the run wrote it")]
    Start,
    /// A line is where it was, but longer.
    #[error("a line goes on where the run had written its last one")]
    Line,
    /// As long as before, with something else in it.
    #[error("its lines are not those that the run wrote")]
    Rows,
}

/// What the system says of the file or folder at `path`.
fn of_file(path: &str, source: &std::io::Error) -> String {
    let said = source.to_string();
    // Files are written beside their places first, under names that lead nowhere.
    let said = said.split(" at path ").next().unwrap_or_default();
    let in_the_way = source.kind() == std::io::ErrorKind::AlreadyExists && Path::new(path).is_file();
    if in_the_way || source.kind() == std::io::ErrorKind::NotADirectory {
        return format!("{path}: a file stands where a folder should ({said}): choose another place");
    }
    format!("{path}: {said}")
}

/// Why there is no run in `folder`, as it is now, and what to do.
fn no_run(folder: &Path) -> String {
    let shown = folder.display();
    let remedy = "name the folder that `seixo run` has told or was given with --out";
    match folder {
        _ if folder.is_dir() => {
            format!("{shown} holds no run of seixo: there is no `.seixo` in it that names one; {remedy}")
        }
        _ if folder.exists() => format!("{shown} is a file; {remedy}"),
        _ => format!("there is no folder {shown}; {remedy}"),
    }
}

/// Changes that are told; nobody reads a hundred.
const MOST_CHANGES: usize = 5;

fn first(changed: &[String]) -> String {
    changed[..changed.len().min(MOST_CHANGES)].join("; ")
}

/// What to do with a changed case.
fn another(from: Option<&Path>) -> String {
    let start = "start another run with --out";
    from.map_or_else(
        || start.into(),
        |from| format!("{start}, from that state with run.from = {:?}", from.display().to_string()),
    )
}

fn more(changed: &[String]) -> String {
    match changed.len().saturating_sub(MOST_CHANGES) {
        0 => String::new(),
        more => format!("; and {more} more"),
    }
}

/// Why a saved state cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// It is no file that was written whole, or what it holds contradicts itself.
    #[error("{0}")]
    Damaged(String),
    /// It is the state of another scene, another version or another kind of processor.
    #[error("{0}")]
    Misfit(String),
}

/// What is wrong with a device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// There is none, or none of the name or number that was asked for.
    #[error("{0}")]
    NoAdapter(String),
    /// The scene exceeds a limit of the adapter, or its free memory.
    #[error("{text}")]
    TooSmall {
        /// What is too small: a limit by its name in WebGPU, or `memory`.
        limit: &'static str,
        /// What the scene needs, in the limit's unit (bytes for buffers and memory).
        needs: u64,
        /// What there is; `None` where the driver does not say.
        has: Option<u64>,
        /// All of it in words.
        text: String,
    },
    /// The device was lost, or refuses what it should take.
    #[error("{0}")]
    Failed(String),
}

impl Error {
    /// Exit code of the command line.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Case(_) | Self::Usage { .. } | Self::Folder(_) | Self::Checkpoint(_) => 2,
            Self::Gpu(_) => 3,
            Self::Diverged { .. } | Self::Senseless(_) => 4,
            Self::Io { .. } => 5,
            Self::Interrupted => 75,
        }
    }

    /// An [`Error::Io`] for `path`.
    pub fn io(path: impl AsRef<std::path::Path>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.as_ref().display().to_string();
        move |source| Self::Io { path, source }
    }

    /// An [`Error::Usage`] of `argument`.
    pub fn usage(argument: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Usage { argument: argument.into(), message: message.into() }
    }

    /// [`CaseError::of`] a key.
    pub fn key(key: impl Into<String>, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        CaseError::of(key, message, remedy).into()
    }

    /// [`CaseError::file`].
    pub fn file(file: impl Into<String>, key: impl Into<String>, text: impl Into<String>) -> Self {
        CaseError::file(file, key, text).into()
    }

    /// A [`CheckpointError::Damaged`].
    pub(crate) fn damaged(text: impl Into<String>) -> Self {
        CheckpointError::Damaged(text.into()).into()
    }

    /// A [`CheckpointError::Misfit`].
    pub fn misfit(text: impl Into<String>) -> Self {
        CheckpointError::Misfit(text.into()).into()
    }

    /// A [`GpuError::Failed`].
    pub fn gpu(text: impl Into<String>) -> Self {
        GpuError::Failed(text.into()).into()
    }
}
