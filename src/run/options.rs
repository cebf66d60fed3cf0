//! What a run is asked for beside its case.

use crate::checkpoint::Found;
use std::path::PathBuf;
use std::time::Instant;

/// Where a run begins.
#[derive(Debug, Default)]
pub enum Start {
    /// At t = 0, or at `run.from`, in a folder of its own.
    #[default]
    New,
    /// The same, in the place of earlier results.
    Replace,
    /// Where the run in the folder was when it saved its state.
    Resume(Box<Found>),
}

/// What the command line adds to a case.
#[derive(Debug, Default)]
pub struct Options {
    /// Name of the case, for file names and the summary.
    pub name: String,
    /// Folder of the results.
    pub out: PathBuf,
    /// Where to begin.
    pub start: Start,
    /// Stop after this many steps, counted from t = 0 or from `run.from`.
    pub steps: Option<u64>,
    /// Stop at this moment, with the state saved.
    pub deadline: Option<Instant>,
    /// Draw a picture of every frame.
    pub pictures: bool,
    /// Files that the run was made from; results never take their place.
    pub inputs: Vec<PathBuf>,
}
