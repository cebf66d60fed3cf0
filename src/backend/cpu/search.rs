//! [`crate::kernels::neighbour_list`], several candidates at a time.

use crate::cells::{Column, Grid};
use crate::kernels::cell_list::CellList;
use crate::kernels::neighbour_list::{Outward, in_front};
use crate::neighbours::{CAPACITY, CHUNK, Chunk};
use crate::params::Params;
use glam::DVec3;
use rayon::prelude::*;

/// Candidates examined together.
const BLOCK: usize = 4;

/// Coordinates in cell order, each component by itself, so that distances are computed several at a time.
#[derive(Clone, Default, Debug)]
pub struct Coordinates {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
}

impl Coordinates {
    /// Take over `position`, one for each place of the order, between the sides where these are periodic.
    pub fn set(&mut self, position: impl IndexedParallelIterator<Item = DVec3>) {
        let (n, Self { x, y, z }) = (position.len(), self);
        // A block of padding, so that blocks may be read past the end.
        for v in [&mut *x, &mut *y, &mut *z] {
            v.resize(n + BLOCK, 0.0);
        }
        (&mut x[..n], &mut y[..n], &mut z[..n], position)
            .into_par_iter()
            .with_min_len(CHUNK)
            .for_each(|(x, y, z, p)| (*x, *y, *z) = (p.x, p.y, p.z));
    }

    /// The particle in place `k`.
    #[inline(always)]
    fn at(&self, k: u32) -> DVec3 {
        let k = k as usize;
        DVec3::new(self.x[k], self.y[k], self.z[k])
    }

    /// Squared distances to `c` from `k` on.
    #[inline(always)]
    fn squares(&self, k: usize, c: DVec3) -> [f64; BLOCK] {
        let (x, y, z) = (&self.x[k..k + BLOCK], &self.y[k..k + BLOCK], &self.z[k..k + BLOCK]);
        std::array::from_fn(|l| {
            let (dx, dy, dz) = (x[l] - c.x, y[l] - c.y, z[l] - c.z);
            dx * dx + dy * dy + dz * dz
        })
    }

    /// Append those of `run` that are closer than `reach` to `found`, in rising order.
    #[inline(always)]
    fn within(&self, run: Run, c: DVec3, reach: Reach, below: impl Below, found: &mut Found) {
        let c = c - run.shift;
        for first in (run.first..run.end).step_by(BLOCK) {
            let square = self.squares(first as usize, c);
            let inside = u32::MAX >> (32 - (run.end - first).min(BLOCK as u32));
            let hits = below(square, reach.radius2) & inside;
            found.close += (below(square, reach.close2) & inside).count_ones();
            // The last places take the overflow, which the count reveals.
            let at = found.count.min(CAPACITY);
            found.index[at..at + BLOCK].copy_from_slice(&PLACES[hits as usize].map(|k| first + k));
            found.count += hits.count_ones() as usize;
        }
    }
}

/// Bit k of the result tells whether the k-th number lies below the limit.
trait Below: Fn([f64; BLOCK], f64) -> u32 + Copy {}
impl<F: Fn([f64; BLOCK], f64) -> u32 + Copy> Below for F {}

/// Where the set bits of each mask are, from the first on.
const PLACES: [[u32; BLOCK]; 1 << BLOCK] = {
    let mut places = [[0; BLOCK]; 1 << BLOCK];
    let mut mask = 0;
    while mask < 1 << BLOCK {
        let (mut bit, mut n) = (0, 0);
        while bit < BLOCK {
            if mask >> bit & 1 == 1 {
                places[mask][n] = bit as u32;
                n += 1;
            }
            bit += 1;
        }
        mask += 1;
    }
    places
};

/// Squared distances that matter [m2].
#[derive(Clone, Copy)]
struct Reach {
    /// Of the effective radius.
    radius2: f64,
    /// Of the collision distance.
    close2: f64,
}

/// Candidates that lie next to each other in a cell list: a column of cells.
#[derive(Clone, Copy, Default)]
struct Run {
    first: u32,
    end: u32,
    /// From its particles to their images [m].
    shift: DVec3,
}

/// The particle itself is found as well, before it is taken out.
const PLACES_KEPT: usize = CAPACITY + 1;

/// Candidates found within reach.
struct Found {
    index: [u32; PLACES_KEPT + BLOCK],
    /// All of them, also those that had no place.
    count: usize,
    /// Those closer than the collision distance.
    close: u32,
}

impl Default for Found {
    fn default() -> Self {
        Self { index: [0; PLACES_KEPT + BLOCK], count: 0, close: 0 }
    }
}

impl Found {
    fn clear(&mut self) {
        (self.count, self.close) = (0, 0);
    }

    fn kept(&self) -> &[u32] {
        &self.index[..self.count.min(PLACES_KEPT)]
    }

    #[inline(always)]
    fn push(&mut self, j: u32) {
        self.index[self.count.min(PLACES_KEPT)] = j;
        self.count += 1;
    }

    /// Hand those that `go` over to `other`.
    fn move_to(&mut self, other: &mut Self, go: impl Fn(u32) -> bool) {
        let (kept, mut to) = (self.kept().len(), 0);
        for at in 0..kept {
            let j = self.index[at];
            if go(j) {
                other.push(j);
                self.count -= 1;
            } else {
                self.index[to] = j;
                to += 1;
            }
        }
    }

    /// Take `j` out, if it is there.
    #[inline(always)]
    fn remove(&mut self, j: u32) {
        let kept = self.kept().len();
        if let Some(at) = self.kept().iter().position(|&k| k == j) {
            self.index.copy_within(at + 1..kept, at);
            self.count -= 1;
        }
    }
}

/// Particles of a cell list with their coordinates in its order.
pub type Indexed<'a> = Option<(&'a CellList, &'a Coordinates)>;

/// What a search walks: [`crate::kernels::neighbour_list::Candidates`] and their coordinates.
pub struct Candidates<'a> {
    /// The grid.
    pub grid: &'a Grid,
    /// Start of each cell in the fluid slots.
    pub fluid_start: &'a [u32],
    /// Coordinates of the fluid slots.
    pub fluid: &'a Coordinates,
    /// Moving solids, if the scene has any.
    pub moving: Indexed<'a>,
    /// Fixed walls, if the scene has any.
    pub fixed: Indexed<'a>,
    /// Slots below this carry pressure to water.
    pub pressure_slots: u32,
    /// Slots below this carry pressure to walls.
    pub wall_carriers: u32,
    /// Where moving solids face.
    pub outward: Outward<'a>,
}

/// One row under construction.
#[derive(Default)]
pub struct Search {
    /// Cell that the runs lie around: rows that follow each other often share it.
    cell: Option<[u32; 3]>,
    fluid: Vec<Run>,
    solid: Vec<(Run, bool)>,
    near: Found,
    dummy: Found,
    hits: Found,
}

impl Search {
    /// Look up the columns of cells around `cell`.
    fn approach(&mut self, cell: [u32; 3], from: &Candidates) {
        self.cell = Some(cell);
        self.fluid.clear();
        self.solid.clear();
        for Column { first, last, shift } in from.grid.columns(cell) {
            let run = |start: &[u32]| Run { first: start[first], end: start[last + 1], shift };
            let fluid = run(from.fluid_start);
            if fluid.first < fluid.end {
                self.fluid.push(fluid);
            }
            for (list, moves) in [(from.moving, true), (from.fixed, false)] {
                let run = list.map_or(Run::default(), |(list, _)| run(&list.start));
                if run.first < run.end {
                    self.solid.push((run, moves));
                }
            }
        }
    }

    /// Find the neighbours of slot `i` at `x`; they are then read by [`Search::append`]. Returns their number.
    #[inline(always)]
    fn row(&mut self, i: usize, x: DVec3, reach: Reach, from: &Candidates, below: impl Below) -> usize {
        let cell = from.grid.coordinates(x);
        if self.cell != Some(cell) {
            self.approach(cell, from);
        }
        let Self { fluid, solid, near, dummy, hits, .. } = self;
        let is_water = from.fluid_start.last().is_some_and(|&end| i < end as usize);
        let carriers = if is_water { from.pressure_slots } else { from.wall_carriers };
        near.clear();
        dummy.clear();
        for &run in &*fluid {
            from.fluid.within(run, x, reach, below, near);
        }
        if let Some(outward) = from.outward.get(i) {
            let r = |j: u32| from.grid.periodic.nearest(from.fluid.at(j) - x);
            near.move_to(dummy, |j| !in_front(r(j), outward));
        }
        for &(run, moves) in &*solid {
            let Some((list, coordinates)) = (if moves { from.moving } else { from.fixed }) else { continue };
            hits.clear();
            coordinates.within(run, x, reach, below, hits);
            for &k in hits.kept() {
                let j = list.slot[k as usize];
                let before = |outward| in_front(x - run.shift - coordinates.at(k), outward);
                let carries =
                    j < carriers && (!moves || !is_water || from.outward.get(j as usize).is_none_or(before));
                if carries { near.push(j) } else { dummy.push(j) }
            }
            // What had no place counts, so that the guard sees it.
            near.count += hits.count - hits.kept().len();
            near.close += hits.close;
        }
        if i < carriers as usize {
            near.remove(i as u32)
        } else {
            dummy.remove(i as u32)
        }
        near.count + dummy.count
    }

    /// Append the row found last to `chunk` as row `k`.
    #[inline(always)]
    fn append(&self, chunk: &mut Chunk, k: usize, from: &Candidates) {
        chunk.neighbour.extend_from_slice(self.near.kept());
        chunk.dummies[k] = chunk.neighbour.len() as u32;
        chunk.neighbour.extend_from_slice(self.dummy.kept());
        chunk.start[k + 1] = chunk.neighbour.len() as u32;
        // The particle itself is always close.
        chunk.close[k] = self.near.close > 1;
        // Water comes first in a row, and its slots below those of solids.
        let water = from.fluid_start.last();
        chunk.walls[k] = self.near.kept().last().zip(water).is_some_and(|(last, water)| last >= water);
    }
}

/// Lists of all rows of a chunk: `active(k)` gives slot and position of row k, or nothing for a row to be left
/// empty. Returns the largest number of neighbours and its slot.
#[inline(always)]
fn chunk_rows(
    chunk: &mut Chunk,
    active: impl Fn(usize) -> Option<(usize, DVec3)>,
    params: &Params,
    from: &Candidates,
    search: &mut Search,
    below: impl Below,
) -> (usize, usize) {
    let reach = Reach { radius2: params.effective_radius.powi(2), close2: params.collision_distance.powi(2) };
    let mut largest = (0, 0);
    search.cell = None;
    chunk.neighbour.clear();
    for k in 0..chunk.rows() {
        if let Some((i, x)) = active(k) {
            let found = search.row(i, x, reach, from, below);
            largest = largest.max((found, i));
            search.append(chunk, k, from);
        } else {
            chunk.dummies[k] = chunk.neighbour.len() as u32;
            chunk.start[k + 1] = chunk.dummies[k];
            (chunk.close[k], chunk.walls[k]) = (false, false);
        }
    }
    chunk.weight.resize(chunk.neighbour.len(), 0.0);
    largest
}

/// [`Below`] for any machine.
#[inline(always)]
fn below(value: [f64; BLOCK], limit: f64) -> u32 {
    (0..BLOCK).map(|k| u32::from(value[k] < limit) << k).sum()
}

/// [`Below`] in two instructions, which compilers do not find by themselves.
#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "avx2")]
fn below_avx2(value: [f64; BLOCK], limit: f64) -> u32 {
    use std::arch::x86_64::{_CMP_LT_OQ, _mm256_cmp_pd, _mm256_loadu_pd, _mm256_movemask_pd, _mm256_set1_pd};
    // SAFETY: four numbers are read from an array of four.
    let value = unsafe { _mm256_loadu_pd(value.as_ptr()) };
    _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(value, _mm256_set1_pd(limit))) as u32
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,popcnt,bmi1,bmi2")]
fn chunk_rows_avx2(
    chunk: &mut Chunk,
    active: impl Fn(usize) -> Option<(usize, DVec3)>,
    params: &Params,
    from: &Candidates,
    search: &mut Search,
) -> (usize, usize) {
    let below = |value, limit| below_avx2(value, limit);
    chunk_rows(chunk, active, params, from, search, below)
}

/// [`chunk_rows`], with AVX2 where the machine has it. The arithmetic is the same, bit for bit.
pub fn neighbour_list(
    chunk: &mut Chunk,
    active: impl Fn(usize) -> Option<(usize, DVec3)>,
    params: &Params,
    from: &Candidates,
    search: &mut Search,
) -> (usize, usize) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("popcnt")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
    {
        // SAFETY: the machine has these features, checked just above.
        return unsafe { chunk_rows_avx2(chunk, active, params, from, search) };
    }
    chunk_rows(chunk, active, params, from, search, below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_the_set_bits() {
        for (mask, places) in PLACES.iter().enumerate() {
            let set: Vec<u32> = (0..BLOCK as u32).filter(|k| mask >> k & 1 == 1).collect();
            assert_eq!(places[..set.len()], set);
        }
    }

    #[test]
    fn a_full_row_keeps_all_its_neighbours_beside_the_particle_itself() {
        let mut found = Found::default();
        (0..=CAPACITY as u32).for_each(|j| found.push(j));
        found.remove(100);
        let expected: Vec<u32> = (0..=CAPACITY as u32).filter(|&j| j != 100).collect();
        assert_eq!((found.count, found.kept()), (CAPACITY, &expected[..]));
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn the_comparison_in_vectors_is_the_plain_one() {
        if !is_x86_feature_detected!("avx2") {
            eprintln!("SKIPPED: no AVX2");
            return;
        }
        let numbers = [-1.0, 0.0, 1.0, 1.0 + f64::EPSILON, f64::NAN, f64::INFINITY];
        for k in 0..numbers.len().pow(BLOCK as u32) {
            let value = std::array::from_fn(|l| numbers[k / numbers.len().pow(l as u32) % numbers.len()]);
            for limit in numbers {
                // SAFETY: the machine has AVX2, checked just above.
                assert_eq!(unsafe { below_avx2(value, limit) }, below(value, limit), "{value:?} {limit}");
            }
        }
    }
}
