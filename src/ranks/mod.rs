//! Ranks: processes that share the particles of a run.
//!
//! The tank is cut across x into slabs of whole columns of cells ([`crate::share`]). As x runs slowest in the order of the cells, the water
//! of a slab is one range of slots, and what its neighbours need of it are two: its first and its last column, one effective radius
//! wide. Each rank runs the stages, on its threads or a device of its own, over its own particles and over copies of these columns of the ranks beside
//! it, which are made new after every stage that changes what the next one reads there.
//!
//! The first rank leads ([`crate::backend::lead`], [`crate::on_ranks`]): it alone moves solids and has clock, tables and files, and tells the others
//! what to do, stage by stage. Sums are made in the order of the ranks, so that a run repeats to the last bit on the same number of ranks.
//!
//! What ranks say to each other goes through [`Team`]: threads of one process ([`threads`]), or MPI, which the program has (`cli/src/ranks/mpi.rs`).

pub mod threads;

use crate::machine;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// `value` in bytes.
pub(crate) fn encode<T: Serialize>(value: &T) -> Vec<u8> {
    // Into memory, of plain numbers: nothing that can fail.
    postcard::to_stdvec(value).unwrap_or_else(|e| panic!("ranks cannot say this: {e}"))
}

/// The value of `bytes` that another rank encoded.
pub(crate) fn decode<T: DeserializeOwned>(bytes: &[u8]) -> T {
    postcard::from_bytes(bytes).unwrap_or_else(|e| panic!("ranks of different programs: {e}"))
}

/// The ranks before and after `rank` of `ranks`, in a `ring` or in a row.
pub fn beside(rank: usize, ranks: usize, ring: bool) -> [Option<usize>; 2] {
    let around = |other: usize| Some(other).filter(|_| ring && ranks > 1);
    [
        rank.checked_sub(1).or_else(|| around(ranks - 1)),
        Some(rank + 1).filter(|&r| r < ranks).or_else(|| around(0)),
    ]
}

/// The ranks of a run, as one of them sees them. Every call is made by all of them, in the same order.
pub trait Team: Send + Sync {
    /// Number of this one, from 0.
    fn rank(&self) -> usize;
    /// How many there are.
    fn ranks(&self) -> usize;
    /// Hand `left` to the rank before this one and `right` to the one after it; returns what these hand over, nothing at the ends. In a
    /// `ring` the first and the last one are neighbours as well, of two each is the other's on both sides.
    fn swap(&self, left: Vec<u8>, right: Vec<u8>, ring: bool) -> [Vec<u8>; 2];
    /// What each has to say, in the order of the ranks.
    fn gather(&self, own: Vec<u8>) -> Vec<Vec<u8>>;
    /// The same, for the first rank alone; the others get nothing.
    fn collect(&self, own: Vec<u8>) -> Vec<Vec<u8>> {
        let all = self.gather(own);
        if self.rank() == 0 { all } else { Vec::new() }
    }
    /// As many numbers of each rank, one after the other.
    fn gather_numbers(&self, own: &[f64]) -> Vec<f64> {
        let all = self.gather(bytemuck::cast_slice(own).to_vec());
        all.iter().flat_map(|bytes| bytemuck::pod_collect_to_vec::<u8, f64>(bytes)).collect()
    }
    /// Number of this one among those on its machine, from 0.
    fn on_machine(&self) -> usize {
        let own = machine::name().into_bytes();
        let all = self.gather(own.clone());
        all[..self.rank()].iter().filter(|other| **other == own).count()
    }
    /// What the first one has for this one: it makes a `part` for each of the others, by their numbers and one after the other, and gets none.
    fn deal(&self, part: &mut dyn FnMut(usize) -> Vec<u8>) -> Vec<u8>;
    /// What the first one says.
    fn hear(&self, said: Vec<u8>) -> Vec<u8>;
}

/// What a rank holds, and what it said to the others since the start.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// Its number.
    pub rank: usize,
    /// Its columns of cells along x: the first, and that after the last.
    pub columns: [u32; 2],
    /// Particles of water that it computes.
    pub water: usize,
    /// Copies of other ranks' particles of water.
    pub copies: usize,
    /// Particles of wall layers that it computes, dry ones included.
    pub walls: usize,
    /// Particles of walls that never move, dummies included, which it holds.
    pub still: usize,
    /// Bytes held for particles, as of the last step.
    pub bytes: u64,
    /// Most memory that the process has held [bytes], where the system tells it (Linux).
    pub memory_peak_bytes: Option<u64>,
    /// Messages to the ranks beside it.
    pub messages: u64,
    /// Bytes of these, and of what it had all ranks gather.
    pub message_bytes: u64,
    /// Times that all ranks gathered something.
    pub rounds: u64,
    /// Wall-clock time in messages and rounds: on their way, and waiting for slower ranks [s].
    pub waited_s: f64,
}
