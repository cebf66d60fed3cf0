//! Neighbour list: all particles within the effective radius.
//! GPU twin: shaders/neighbour_list.wgsl

use super::cell_list::CellList;
use crate::cells::Grid;
use crate::neighbours::{CAPACITY, Chunk};
use crate::params::Params;
use glam::DVec3;

/// What a search walks.
pub struct Candidates<'a> {
    /// The grid.
    pub grid: &'a Grid,
    /// Start of each cell in the fluid slots.
    pub fluid_start: &'a [u32],
    /// Positions of all slots [m].
    pub position: &'a [DVec3],
    /// Moving solids, if the scene has any.
    pub moving: Option<&'a CellList>,
    /// Fixed walls, if the scene has any.
    pub fixed: Option<&'a CellList>,
    /// Slots below this carry pressure.
    pub pressure_slots: u32,
}

/// One row under construction.
pub struct Search {
    near: [u32; CAPACITY],
    dummy: [u32; CAPACITY],
    near_count: usize,
    dummy_count: usize,
    smallest: f64,
}

impl Default for Search {
    fn default() -> Self {
        Self { near: [0; CAPACITY], dummy: [0; CAPACITY], near_count: 0, dummy_count: 0, smallest: 0.0 }
    }
}

impl Search {
    #[inline(always)]
    fn see(&mut self, j: u32, r2: f64, re2: f64, pressure: bool) {
        // Written always, counted on a hit: no branch to mispredict. The last place takes the overflow.
        let hit = r2 < re2;
        if pressure {
            self.near[self.near_count.min(CAPACITY - 1)] = j;
            self.near_count += usize::from(hit);
        } else {
            self.dummy[self.dummy_count.min(CAPACITY - 1)] = j;
            self.dummy_count += usize::from(hit);
        }
        self.smallest = self.smallest.min(r2);
    }

    /// Find the neighbours of slot `i`; they are then read by [`Search::append`]. Returns their number.
    pub fn row(&mut self, i: usize, params: &Params, from: &Candidates) -> usize {
        let x = from.position[i];
        let re2 = params.effective_radius * params.effective_radius;
        (self.near_count, self.dummy_count, self.smallest) = (0, 0, f64::MAX);
        for (first, last) in from.grid.columns(from.grid.coordinates(x)) {
            let (a, b) = (from.fluid_start[first] as usize, from.fluid_start[last + 1] as usize);
            for (j, &xj) in (a..b).zip(&from.position[a..b]) {
                let r2 = if j == i { f64::MAX } else { (xj - x).length_squared() };
                self.see(j as u32, r2, re2, true);
            }
            for list in [from.moving, from.fixed].into_iter().flatten() {
                let (a, b) = (list.start[first] as usize, list.start[last + 1] as usize);
                for (&j, &xj) in list.slot[a..b].iter().zip(&list.position[a..b]) {
                    let r2 = if j as usize == i { f64::MAX } else { (xj - x).length_squared() };
                    self.see(j, r2, re2, j < from.pressure_slots);
                }
            }
        }
        self.near_count + self.dummy_count
    }

    /// Append the row found last to `chunk` as row `k`.
    pub fn append(&self, chunk: &mut Chunk, k: usize, params: &Params) {
        let (near, dummy) = (self.near_count.min(CAPACITY), self.dummy_count.min(CAPACITY));
        chunk.neighbour.extend_from_slice(&self.near[..near]);
        chunk.dummies[k] = chunk.neighbour.len() as u32;
        chunk.neighbour.extend_from_slice(&self.dummy[..dummy]);
        chunk.start[k + 1] = chunk.neighbour.len() as u32;
        chunk.close[k] = self.smallest < params.collision_distance * params.collision_distance;
    }
}
