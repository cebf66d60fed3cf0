//! Errors of the library, each with what a user can do about it.

/// What can go wrong. `main` maps each to an exit code.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The case file, or what was given on the command line, is wrong (exit code 2).
    #[error("{0}")]
    Case(String),
    /// No adapter that the run can use, or the device was lost (exit code 3).
    #[error("{0}")]
    Gpu(String),
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
    /// The end was reached, but what was computed means nothing (exit code 4).
    #[error("{0}")]
    Senseless(String),
    /// A file could not be read or written (exit code 5).
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// The cause.
        source: std::io::Error,
    },
}

/// Result with [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Exit code of the command line.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Case(_) => 2,
            Self::Gpu(_) => 3,
            Self::Diverged { .. } | Self::Senseless(_) => 4,
            Self::Io { .. } => 5,
        }
    }

    /// An [`Error::Io`] for `path`.
    pub fn io(path: impl AsRef<std::path::Path>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.as_ref().display().to_string();
        move |source| Self::Io { path, source }
    }
}
