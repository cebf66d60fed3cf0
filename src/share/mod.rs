//! The particles that a rank computes: those in its slab of the tank, columns of cells `cuts[rank]..cuts[rank + 1]` along x. After
//! [`Share::settle`] the water's slots are, in the order of the cells,
//!
//! | copies of the last column of the rank before | own | copies of the first column of the rank after |
//!
//! and these copies are in the order of their owner, as both sort the same sequence by cell. Where the tank is periodic along x the ranks are a
//! ring: in one of few columns the first one's copies of the last column of all come behind the others, the last one's of the first column in front. Solids come behind the water as on a
//! single rank: every rank knows where those are that move, on CPUs it has of the others what is near its slab, and it computes the rows of those in its own
//! columns.

mod border;
mod coarse;
mod cut;
mod deal;
mod loads;
mod model;
mod moves;
mod outlook;
mod still;
mod whole;

use crate::body::Wrench;
use crate::cells::Grid;
use crate::fields::State;
use crate::kernels::body_force::RowPressure;
use crate::machine::memory_peak;
use crate::ranks::{Standing, Team, decode, encode};
use crate::scene::{Groups, Scene, Still};
pub use border::{Bordered, OfWalls, Side};
pub(crate) use coarse::Columns;
use coarse::wet_cells;
pub use cut::check;
use cut::{REACH, beyond, is_ring, near};
pub(crate) use deal::room;
pub use deal::{Division, Portion, Start};
use glam::DVec3;
pub use model::Model;
pub use moves::{Settled, Traveller};
pub use outlook::{Outlook, Taken};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Instant;
pub use still::StillParticle;
use whole::Kept;

/// What a rank computes, and what it hands to those beside it.
pub struct Share {
    team: Arc<dyn Team>,
    /// Of all ranks; slots are counted as on a single one.
    all: Groups,
    /// Of this one.
    groups: Groups,
    /// Where slots without a particle are [m].
    corner: DVec3,
    /// Whether the first and the last rank are neighbours: the tank is periodic along x.
    ring: bool,
    /// First column of each rank, and the end of the last one's.
    cuts: Vec<u32>,
    /// Cells that the water of all fills.
    wet_cells: f64,
    /// Which walls that never move are here; all of them if none are named.
    still: Option<Still>,
    /// The whole scene, on the first rank.
    whole: Option<Arc<Scene>>,
    /// Slots of the water that this rank computes.
    own: Range<usize>,
    /// Slots beside them with water that has just come in.
    come_in: Vec<usize>,
    /// Borders to the rank before and to that after this one.
    sides: [Option<Side>; 2],
    /// Whether it computes each slot of the wall layers.
    walls: Vec<bool>,
    /// Positions of the pressure-carrying slots at the search [m], by which they are this rank's.
    searched: Vec<DVec3>,
    steps: u64,
    /// A state of late, see [`Self::keep`].
    kept: Option<Kept>,
    /// Messages to the ranks beside this one, their bytes, rounds of all ranks, and nanoseconds in both so far.
    said: [AtomicU64; 4],
}

impl Share {
    /// That of a rank of `team` which begins with `start`; its water has no place in a backend yet, see [`Self::begin`].
    pub fn new(team: Arc<dyn Team>, start: &Start, grid: &Grid) -> Self {
        Self {
            sides: [None, None],
            walls: Vec::new(),
            ring: is_ring(team.ranks(), &start.params),
            cuts: start.cuts.clone(),
            still: start.still.clone(),
            whole: start.whole.clone(),
            wet_cells: wet_cells(&start.all, &start.params, grid),
            own: 0..0,
            come_in: Vec::new(),
            searched: Vec::new(),
            steps: 0,
            kept: None,
            said: Default::default(),
            team,
            corner: start.params.domain_min,
            groups: start.scene.groups,
            all: start.all,
        }
    }

    /// Positions of the pressure-carrying slots at the search [m]: what collisions have moved across a cut since is still whose it was.
    pub fn searched(&self) -> &[DVec3] {
        &self.searched
    }

    /// Keep these, the positions now.
    pub fn keep_searched(&mut self, position: &[DVec3]) {
        self.searched.clear();
        self.searched.extend_from_slice(position);
    }

    /// Sizes of the groups of all ranks.
    pub fn all(&self) -> Groups {
        self.all
    }

    /// Number of this rank.
    pub fn rank(&self) -> usize {
        self.team.rank()
    }

    /// How many there are.
    pub fn ranks(&self) -> usize {
        self.team.ranks()
    }

    /// Slots of the water that this rank computes.
    pub fn own(&self) -> Range<usize> {
        self.own.clone()
    }

    /// Whether it has the water of slot `i`, that which has just come in included.
    pub fn has(&self, i: usize) -> bool {
        self.own.contains(&i) || self.come_in.contains(&i)
    }

    /// Whether it computes the pressure-carrying slot `i`.
    pub fn owns(&self, i: usize) -> bool {
        self.own.contains(&i) || i >= self.groups.fluid && self.walls[i - self.groups.fluid]
    }

    /// The pressure-carrying slots that this rank computes: the water's, then walls'.
    fn owned(&self) -> impl Iterator<Item = usize> + '_ {
        let walls = self.walls.iter().enumerate().filter(|(_, owned)| **owned);
        self.own().chain(walls.map(|(k, _)| self.groups.fluid + k))
    }

    /// The pressure-carrying slots that are copies of those beside.
    pub fn copies(&self) -> impl Iterator<Item = usize> + '_ {
        self.sides.iter().flatten().flat_map(Side::taken)
    }

    /// `state` of the slots that this rank computes; [`State::Inactive`] elsewhere.
    pub fn masked(&self, state: &[State]) -> Vec<State> {
        let of = |(i, &s): (usize, &State)| if self.owns(i) { s } else { State::Inactive };
        state.iter().enumerate().map(of).collect()
    }

    /// Columns of cells along x with water that this rank computes or has copies of.
    pub fn columns_seen(&self) -> impl Iterator<Item = u32> {
        self.columns().chain(self.beyond().into_iter().flatten())
    }

    /// The columns before and after those of this rank, of which it has copies.
    pub(crate) fn beyond(&self) -> [Option<u32>; 2] {
        beyond(&self.cuts, self.rank(), self.ring)
    }

    /// `grid` with the cells that this rank numbers: of the columns within which it has the walls that never move, or all of them.
    pub(crate) fn slab(&self, grid: Grid) -> Grid {
        let (first, count) = near(REACH, &self.cuts, self.rank(), self.ring);
        match &self.still {
            Some(_) if count < grid.count[0] => grid.slab(first, count),
            _ => grid.slab(0, grid.count[0]),
        }
    }

    /// The columns of this rank.
    pub(crate) fn columns(&self) -> Range<u32> {
        self.columns_of(self.rank())
    }

    /// The columns of `rank`.
    pub(crate) fn columns_of(&self, rank: usize) -> Range<u32> {
        self.cuts[rank]..self.cuts[rank + 1]
    }

    /// Columns of all ranks.
    pub(crate) fn all_columns(&self) -> usize {
        self.cuts.last().copied().unwrap_or(0) as usize
    }

    /// Borders to the rank before and to that after this one.
    pub(crate) fn sides(&self) -> &[Option<Side>; 2] {
        &self.sides
    }

    /// Its first and its last column.
    pub(crate) fn ends(&self) -> [u32; 2] {
        let mine = self.columns();
        [mine.start, mine.end - 1]
    }

    /// What this rank holds, `bytes` of it in all, and said so far.
    pub fn standing(&self, live: usize, bytes: u64) -> Standing {
        let [messages, message_bytes, rounds, waited] = [0, 1, 2, 3].map(|k| self.said[k].load(Relaxed));
        let mine = self.columns();
        Standing {
            rank: self.rank(),
            columns: [mine.start, mine.end],
            water: self.own.len(),
            copies: live - self.own.len(),
            walls: self.walls.iter().filter(|owned| **owned).count(),
            still: self.groups.static_range().len(),
            bytes,
            memory_peak_bytes: memory_peak(),
            messages,
            message_bytes,
            rounds,
            waited_s: waited as f64 * 1e-9,
        }
    }

    fn timed<T>(&self, said: impl FnOnce(&dyn Team) -> T) -> T {
        let start = Instant::now();
        let heard = said(&*self.team);
        self.said[3].fetch_add(start.elapsed().as_nanos() as u64, Relaxed);
        heard
    }

    /// What the first rank orders; the wait for it counts.
    pub fn hear(&self) -> Vec<u8> {
        self.timed(|team| team.hear(Vec::new()))
    }

    /// Hand `left` to the rank before this one and `right` to the one after it; returns what these hand over.
    pub(crate) fn pass(&self, left: Vec<u8>, right: Vec<u8>) -> [Vec<u8>; 2] {
        let beside = self.beyond().into_iter().flatten().count();
        self.said[0].fetch_add(beside as u64, Relaxed);
        self.said[1].fetch_add((left.len() + right.len()) as u64, Relaxed);
        self.timed(|team| team.swap(left, right, self.ring))
    }

    /// What every rank has to say, in the order of the ranks.
    pub fn gather(&self, own: Vec<u8>) -> Vec<Vec<u8>> {
        self.said[1].fetch_add(own.len() as u64, Relaxed);
        self.said[2].fetch_add(1, Relaxed);
        self.timed(|team| team.gather(own))
    }

    /// The same, for the first rank alone.
    pub(super) fn collect(&self, own: Vec<u8>) -> Vec<Vec<u8>> {
        self.said[1].fetch_add(own.len() as u64, Relaxed);
        self.said[2].fetch_add(1, Relaxed);
        self.timed(|team| team.collect(own))
    }

    /// As many numbers of every rank.
    pub(crate) fn numbers(&self, own: &[f64]) -> Vec<f64> {
        self.said[1].fetch_add(size_of_val(own) as u64, Relaxed);
        self.said[2].fetch_add(1, Relaxed);
        self.timed(|team| team.gather_numbers(own))
    }

    /// Each of `values` summed over the ranks, in their order.
    pub fn sum(&self, values: &mut [f64]) {
        if values.is_empty() {
            return;
        }
        let all = self.numbers(values);
        values.fill(0.0);
        for part in all.chunks_exact(values.len()) {
            values.iter_mut().zip(part).for_each(|(sum, v)| *sum += v);
        }
    }

    /// The largest `value` of all ranks.
    pub fn most(&self, value: f64) -> f64 {
        self.numbers(&[value]).into_iter().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Each of `wrenches` summed over the ranks.
    pub fn sum_wrenches(&self, wrenches: &mut [Wrench]) {
        self.sum_forces(wrenches, &mut []);
    }

    /// Each of `forces` and of `rows`, which all but one rank know as zero, summed over the ranks at once.
    pub fn sum_forces(&self, forces: &mut [Wrench], rows: &mut [RowPressure]) {
        let told = rows.iter().flat_map(|row| {
            let [x, y, z] = row.reaction.to_array();
            [row.pressure, row.excess, x, y, z]
        });
        let parts = forces.iter().flat_map(|w| [w.force, w.torque]).flat_map(|v| v.to_array());
        let mut numbers: Vec<f64> = parts.chain(told).collect();
        self.sum(&mut numbers);
        let (parts, told) = numbers.split_at(6 * forces.len());
        for (wrench, n) in forces.iter_mut().zip(parts.chunks_exact(6)) {
            *wrench = Wrench { force: DVec3::from_slice(n), torque: DVec3::from_slice(&n[3..]) };
        }
        for (row, n) in rows.iter_mut().zip(told.chunks_exact(5)) {
            *row = RowPressure { pressure: n[0], excess: n[1], reaction: DVec3::from_slice(&n[2..]) };
        }
    }

    /// The lists of all ranks in one, in their order.
    pub fn gather_all<T: Serialize + DeserializeOwned>(&self, own: Vec<T>) -> Vec<T> {
        let all = self.gather(encode(&own));
        all.iter().flat_map(|bytes| decode::<Vec<T>>(bytes)).collect()
    }

    /// Shows the ranks beside this one the border of `arrays`, and takes theirs over.
    pub fn swap(&self, arrays: &mut [&mut dyn Bordered]) {
        self.swap_at(&self.sides, arrays);
    }

    /// The same at borders of their own, [`Self::borders`].
    pub fn swap_at(&self, sides: &[Option<Side>; 2], arrays: &mut [&mut dyn Bordered]) {
        let give = |side: &Option<Side>| {
            let mut out = Vec::new();
            if let Some(side) = side {
                arrays.iter().for_each(|array| array.give(side, &mut out));
            }
            out
        };
        let shown = self.pass(give(&sides[0]), give(&sides[1]));
        for (side, bytes) in sides.iter().zip(&shown) {
            if let Some(side) = side {
                let mut from = &bytes[..];
                arrays.iter_mut().for_each(|array| array.take(side, &mut from));
            }
        }
    }

    /// Borders of what else lies in columns of cells: `of` tells what is in one, in an order that the ranks beside know as well.
    pub fn borders(&self, of: impl Fn(u32) -> Vec<u32>) -> [Option<Side>; 2] {
        let side = |give: u32, take: u32| Side::of(of(give), of(take));
        let [before, after] = self.beyond();
        let [first, last] = self.ends();
        [before.map(|beyond| side(first, beyond)), after.map(|beyond| side(last, beyond))]
    }
}
