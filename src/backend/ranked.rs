//! A backend as one of many ranks.

use super::{Backend, Counters};
use crate::checkpoint::Archive;
use crate::error::Result;
use crate::fields::Fields;
use crate::ledger::Ledger;
use crate::output::pieces::Pieces;
use crate::share::Share;

/// A backend that computes the part of a rank. Every call, those of [`Backend`] as well, is made by all ranks in the same order; what a rank reads
/// of all is for the first one.
pub trait Ranked: Backend {
    /// What this rank computes.
    fn share(&self) -> Option<&Share>;
    /// What all ranks together are, of which this one is described by [`Backend::description`].
    fn team_description(&self) -> String;
    /// Write the water of this rank as `pieces` says; returns the bytes of each rank's file.
    ///
    /// # Errors
    /// [`crate::Error::Io`] of the first rank that could not, on all of them.
    fn write_piece(&mut self, pieces: &Pieces) -> Result<Vec<u64>>;
    /// Pressures and number densities of the wall layers of all ranks; the first one gets them.
    ///
    /// # Errors
    /// A device that is lost.
    fn read_walls(&mut self) -> Result<[Vec<f64>; 2]>;
    /// Keep the particles of this rank as they are now, in memory.
    ///
    /// # Errors
    /// A device that is lost.
    fn keep(&mut self) -> Result<()>;
    /// The particles of all ranks as they were when they were kept; the first one gets them.
    ///
    /// # Errors
    /// A device that is lost.
    fn recall(&mut self) -> Result<Option<Fields>>;
    /// The last time step [s].
    fn dt(&self) -> f64;
    /// Save the state of all ranks, gathered before, as that of one.
    ///
    /// # Errors
    /// What the archive says.
    fn save_all(
        &self,
        archive: &mut Archive,
        fields: Fields,
        counters: Counters,
        work: Option<Ledger>,
        dt: f64,
    ) -> Result<()>;
    /// The particles of all ranks in `archive`, for [`Self::restore`]; the rest of the state is taken over by the first rank, this one.
    ///
    /// # Errors
    /// What the archive says.
    fn read_all(&mut self, archive: &mut Archive) -> Result<Fields>;
    /// Take over the state that the first rank gives: all particles, of which each rank keeps its own.
    ///
    /// # Errors
    /// A device that is lost.
    fn restore(&mut self, fields: Option<Fields>) -> Result<()>;
}
