//! Ranks that are threads of one process: for tests, and for looking at what ranks say to each other without MPI.

use super::{Team, beside};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};

/// A rank that is a thread.
pub struct Thread {
    rank: usize,
    /// To every rank.
    to: Vec<Sender<Vec<u8>>>,
    /// From every rank.
    from: Mutex<Vec<Receiver<Vec<u8>>>>,
}

/// `ranks` threads' ends.
pub fn team(ranks: usize) -> Vec<Arc<dyn Team>> {
    let mut to: Vec<Vec<_>> = (0..ranks).map(|_| Vec::new()).collect();
    let mut from: Vec<Vec<_>> = (0..ranks).map(|_| Vec::new()).collect();
    for to in &mut to {
        for from in &mut from {
            let (sender, receiver) = channel();
            to.push(sender);
            from.push(receiver);
        }
    }
    let ends = to.into_iter().zip(from).enumerate();
    ends.map(|(rank, (to, from))| Arc::new(Thread { rank, to, from: Mutex::new(from) }) as Arc<dyn Team>)
        .collect()
}

impl Thread {
    fn give(&self, rank: usize, what: Vec<u8>) {
        // A rank that is gone has failed, and its thread tells why.
        self.to[rank].send(what).unwrap_or_else(|_| panic!("rank {rank} has ended"));
    }

    fn take(&self, rank: usize) -> Vec<u8> {
        let from = self.from.lock().unwrap_or_else(|e| e.into_inner());
        from[rank].recv().unwrap_or_else(|_| panic!("rank {rank} has ended"))
    }
}

impl Team for Thread {
    fn rank(&self) -> usize {
        self.rank
    }

    fn ranks(&self) -> usize {
        self.to.len()
    }

    fn swap(&self, left: Vec<u8>, right: Vec<u8>, ring: bool) -> [Vec<u8>; 2] {
        let [before, after] = beside(self.rank, self.ranks(), ring);
        before.into_iter().for_each(|rank| self.give(rank, left.clone()));
        after.into_iter().for_each(|rank| self.give(rank, right.clone()));
        // In a ring of two the other's first message is what it hands to its left: to the right of this one.
        let [from_after, from_before] =
            [after, before].map(|rank| rank.map_or_else(Vec::new, |rank| self.take(rank)));
        [from_before, from_after]
    }

    fn gather(&self, own: Vec<u8>) -> Vec<Vec<u8>> {
        (0..self.ranks()).for_each(|rank| self.give(rank, own.clone()));
        (0..self.ranks()).map(|rank| self.take(rank)).collect()
    }

    fn deal(&self, part: &mut dyn FnMut(usize) -> Vec<u8>) -> Vec<u8> {
        if self.rank == 0 {
            (1..self.ranks()).for_each(|rank| self.give(rank, part(rank)));
            return Vec::new();
        }
        self.take(0)
    }

    fn hear(&self, said: Vec<u8>) -> Vec<u8> {
        if self.rank == 0 {
            (1..self.ranks()).for_each(|rank| self.give(rank, said.clone()));
            return said;
        }
        self.take(0)
    }
}
