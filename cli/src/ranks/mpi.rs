//! Ranks that are processes under MPI.

use mpi::Count;
use mpi::datatype::PartitionMut;
use mpi::environment::Universe;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};
use seixo::ranks::{Team, beside};

/// This process among those that `mpirun` or `srun` started; MPI ends when it is dropped.
pub struct Processes {
    world: SimpleCommunicator,
    _universe: Universe,
}

// SAFETY: MPI was asked to be called by one thread at a time, whichever it is, and said that it can; stages run one after the other, and
// each calls it from the one thread that runs the stage.
unsafe impl Send for Processes {}
// SAFETY: as above.
unsafe impl Sync for Processes {}

impl Processes {
    /// Start MPI; nothing if it is started already, or bears no thread but the first one.
    pub fn start() -> Option<Self> {
        let (universe, threading) = mpi::initialize_with_threading(mpi::Threading::Serialized)?;
        (threading >= mpi::Threading::Serialized)
            .then(|| Self { world: universe.world(), _universe: universe })
    }
}

/// End all ranks with the exit code `code`, whatever they do.
pub fn abort(code: u8) -> ! {
    SimpleCommunicator::world().abort(i32::from(code))
}

/// Bytes that are sent at once; MPI counts them in 31 bits.
const PIECE: usize = 1 << 30;

fn count(n: usize) -> Count {
    // A part of a run that is as large as this has met other limits before.
    Count::try_from(n).unwrap_or_else(|_| panic!("{n} bytes are more than MPI sends at once"))
}

impl Processes {
    /// Sends what is of any length.
    fn send(&self, rank: i32, what: &[u8]) {
        let to = self.world.process_at_rank(rank);
        to.send(&(what.len() as u64));
        what.chunks(PIECE).for_each(|piece| to.send(piece));
    }

    /// Receives what [`Self::send`] sends.
    fn receive(&self, rank: i32) -> Vec<u8> {
        let from = self.world.process_at_rank(rank);
        let mut what = vec![0; from.receive::<u64>().0 as usize];
        what.chunks_mut(PIECE).for_each(|piece| {
            from.receive_into(piece);
        });
        what
    }
}

impl Team for Processes {
    fn rank(&self) -> usize {
        self.world.rank() as usize
    }

    fn ranks(&self) -> usize {
        self.world.size() as usize
    }

    fn swap(&self, left: Vec<u8>, right: Vec<u8>, ring: bool) -> [Vec<u8>; 2] {
        let beside = beside(self.rank(), self.ranks(), ring).map(|rank| rank.map(|r| r as i32));
        let [mut before, mut after] = [Vec::new(), Vec::new()];
        mpi::request::scope(|scope| {
            let a = beside[0].map(|r| self.world.process_at_rank(r).immediate_send(scope, &left[..]));
            let b = beside[1].map(|r| self.world.process_at_rank(r).immediate_send(scope, &right[..]));
            // In a ring of two the other's first message is what it hands to its left: to the right of this one. MPI keeps their order.
            if let Some(r) = beside[1] {
                after = self.world.process_at_rank(r).receive_vec::<u8>().0;
            }
            if let Some(r) = beside[0] {
                before = self.world.process_at_rank(r).receive_vec::<u8>().0;
            }
            [a, b].into_iter().flatten().for_each(|request| {
                request.wait();
            });
        });
        [before, after]
    }

    fn gather(&self, mut own: Vec<u8>) -> Vec<Vec<u8>> {
        // A byte more than there is to say: an empty buffer's address may be that of MPI_IN_PLACE (Open MPI: 1), which is refused, or taken at its word.
        own.push(0);
        let mut counts = vec![0 as Count; self.ranks()];
        self.world.all_gather_into(&count(own.len()), &mut counts[..]);
        let starts: Vec<Count> = counts
            .iter()
            .scan(0, |sum: &mut usize, &n| {
                let start = *sum;
                *sum += n as usize;
                Some(count(start))
            })
            .collect();
        let mut all = vec![0_u8; counts.iter().map(|&n| n as usize).sum()];
        let mut parts = PartitionMut::new(&mut all[..], &counts[..], &starts[..]);
        self.world.all_gather_varcount_into(&own[..], &mut parts);
        let part =
            |(&start, &n): (&Count, &Count)| all[start as usize..start as usize + n as usize - 1].to_vec();
        starts.iter().zip(&counts).map(part).collect()
    }

    fn collect(&self, own: Vec<u8>) -> Vec<Vec<u8>> {
        if self.world.rank() > 0 {
            self.send(0, &own);
            return Vec::new();
        }
        std::iter::once(own).chain((1..self.world.size()).map(|rank| self.receive(rank))).collect()
    }

    fn gather_numbers(&self, own: &[f64]) -> Vec<f64> {
        if own.is_empty() {
            return Vec::new();
        }
        let mut all = vec![0.0; own.len() * self.ranks()];
        self.world.all_gather_into(own, &mut all[..]);
        all
    }

    fn deal(&self, part: &mut dyn FnMut(usize) -> Vec<u8>) -> Vec<u8> {
        if self.world.rank() > 0 {
            return self.receive(0);
        }
        (1..self.world.size()).for_each(|rank| self.send(rank, &part(rank as usize)));
        Vec::new()
    }

    fn hear(&self, said: Vec<u8>) -> Vec<u8> {
        let root = self.world.process_at_rank(0);
        let mut length = said.len() as u64;
        root.broadcast_into(&mut length);
        let mut said = said;
        said.resize(length as usize, 0);
        // MPI takes no empty buffer, and none of more than 2 GiB.
        said.chunks_mut(PIECE).for_each(|piece| root.broadcast_into(piece));
        said
    }
}
