//! When and where the state of a run is saved.

use super::due::Due;
use crate::checkpoint::{Archive, Origin, file};
use crate::error::Result;
use crate::simulation::Simulation;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// When and where the state is saved.
pub(super) struct Saving {
    pub folder: PathBuf,
    pub origin: Origin,
    pub every: Due,
    pub wall: Option<Duration>,
    /// At all, but for signals.
    pub planned: bool,
    pub last: Instant,
    /// Step of the file written last.
    pub step: Option<u64>,
    /// A state that was good, in case the run diverges.
    pub good: Option<(u64, f64, Archive)>,
    /// A state of late, in case a long step is given up.
    pub kept: Option<Kept>,
}

/// A state in memory.
pub(super) struct Kept {
    pub archive: Archive,
    pub at: Instant,
    /// How long it took to make.
    pub cost: Duration,
}

/// Times of its making that a state in memory lasts, so that it costs no more than one part in so many; and the shortest
/// time that it lasts.
const COST: u32 = 100;
const SHORTEST: Duration = Duration::from_secs(1);

impl Saving {
    pub fn new(simulation: &Simulation, name: &str, text: &str, folder: PathBuf) -> Self {
        let checkpoint = simulation.case.run.checkpoint;
        let origin = Origin {
            version: env!("CARGO_PKG_VERSION").into(),
            name: name.into(),
            case: text.into(),
            precision: simulation.backend.precision().into(),
            step: 0,
            time: 0.0,
        };
        let wall =
            (checkpoint.wall > 0.0).then(|| Duration::try_from_secs_f64(checkpoint.wall).ok()).flatten();
        Self {
            folder,
            origin,
            every: Due::new(Some(checkpoint.every.unwrap_or(0.0))),
            wall,
            planned: checkpoint.wall > 0.0 || checkpoint.every.is_some(),
            last: Instant::now(),
            step: None,
            good: None,
            kept: None,
        }
    }

    /// Whether a state should be kept in memory before the next step.
    pub fn keeps(&self) -> bool {
        self.kept.as_ref().is_none_or(|k| k.at.elapsed() > SHORTEST.max(COST * k.cost))
    }

    pub fn write(&mut self, step: u64, time: f64, archive: &Archive) -> Result<()> {
        file::write(&self.folder, &Origin { step, time, ..self.origin.clone() }, archive)?;
        (self.last, self.step, self.good) = (Instant::now(), Some(step), None);
        Ok(())
    }
}
