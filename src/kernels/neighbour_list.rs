//! Neighbour list: all particles within the effective radius.
//! GPU twin: shaders/neighbour_list.wgsl

use super::cell_list::CellList;
use crate::cells::Grid;
use crate::neighbours::{CAPACITY, Chunk};
use crate::params::Params;
use glam::DVec3;

/// Candidates examined together: enough to fill vector registers, few enough not to run far over the end
/// of a column of cells.
const BLOCK: usize = 16;

/// Coordinates in cell order, each component by itself, so that distances are computed several at a time.
#[derive(Clone, Default, Debug)]
pub struct Coordinates {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
}

impl Coordinates {
    /// Take over `position`; the arrays get a block of padding, so that blocks may be read past the end.
    pub fn set(&mut self, position: &[DVec3]) {
        for (out, k) in [(&mut self.x, 0), (&mut self.y, 1), (&mut self.z, 2)] {
            out.clear();
            out.extend(position.iter().map(|p| p[k]));
            out.resize(position.len() + BLOCK, 0.0);
        }
    }

    /// Call `hit(k, r2)` for each k in `a..b` closer than sqrt(`re2`) to `c`, in rising order.
    #[inline(always)]
    fn within(&self, (a, b): (usize, usize), c: DVec3, re2: f64, mut hit: impl FnMut(usize, f64)) {
        let mut first = a;
        while first < b {
            let range = first..first + BLOCK;
            let (x, y, z) = (&self.x[range.clone()], &self.y[range.clone()], &self.z[range]);
            let mut r2 = [0.0; BLOCK];
            let mut hits = 0_u32;
            for k in 0..BLOCK {
                let (dx, dy, dz) = (x[k] - c.x, y[k] - c.y, z[k] - c.z);
                r2[k] = dx * dx + dy * dy + dz * dz;
                hits |= u32::from(r2[k] < re2) << k;
            }
            if b - first < BLOCK {
                hits &= (1 << (b - first)) - 1;
            }
            while hits != 0 {
                let k = hits.trailing_zeros() as usize;
                hit(first + k, r2[k]);
                hits &= hits - 1;
            }
            first += BLOCK;
        }
    }
}

/// What a search walks.
pub struct Candidates<'a> {
    /// The grid.
    pub grid: &'a Grid,
    /// Start of each cell in the fluid slots.
    pub fluid_start: &'a [u32],
    /// Coordinates of the fluid slots.
    pub fluid: &'a Coordinates,
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
    fn take(&mut self, j: u32, r2: f64, carries_pressure: bool) {
        // The last place takes the overflow, which the counts reveal.
        if carries_pressure {
            self.near[self.near_count.min(CAPACITY - 1)] = j;
            self.near_count += 1;
        } else {
            self.dummy[self.dummy_count.min(CAPACITY - 1)] = j;
            self.dummy_count += 1;
        }
        self.smallest = self.smallest.min(r2);
    }

    /// Find the neighbours of slot `i` at `x`; they are then read by [`Search::append`]. Returns their number.
    #[inline(always)]
    pub fn row(&mut self, i: usize, x: DVec3, params: &Params, from: &Candidates) -> usize {
        let re2 = params.effective_radius * params.effective_radius;
        (self.near_count, self.dummy_count, self.smallest) = (0, 0, f64::MAX);
        for (first, last) in from.grid.columns(from.grid.coordinates(x)) {
            let fluid = (from.fluid_start[first] as usize, from.fluid_start[last + 1] as usize);
            from.fluid.within(fluid, x, re2, |j, r2| {
                if j != i {
                    self.take(j as u32, r2, true);
                }
            });
            for list in [from.moving, from.fixed].into_iter().flatten() {
                let solid = (list.start[first] as usize, list.start[last + 1] as usize);
                list.coordinates.within(solid, x, re2, |k, r2| {
                    let j = list.slot[k];
                    if j as usize != i {
                        self.take(j, r2, j < from.pressure_slots);
                    }
                });
            }
        }
        self.near_count + self.dummy_count
    }

    /// Append the row found last to `chunk` as row `k`.
    #[inline(always)]
    pub fn append(&self, chunk: &mut Chunk, k: usize, params: &Params) {
        let (near, dummy) = (self.near_count.min(CAPACITY), self.dummy_count.min(CAPACITY));
        chunk.neighbour.extend_from_slice(&self.near[..near]);
        chunk.dummies[k] = chunk.neighbour.len() as u32;
        chunk.neighbour.extend_from_slice(&self.dummy[..dummy]);
        chunk.start[k + 1] = chunk.neighbour.len() as u32;
        chunk.close[k] = self.smallest < params.collision_distance * params.collision_distance;
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
) -> (usize, usize) {
    let mut largest = (0, 0);
    chunk.neighbour.clear();
    for k in 0..chunk.rows() {
        if let Some((i, x)) = active(k) {
            let found = search.row(i, x, params, from);
            largest = largest.max((found, i));
            search.append(chunk, k, params);
        } else {
            chunk.dummies[k] = chunk.neighbour.len() as u32;
            chunk.start[k + 1] = chunk.dummies[k];
            chunk.close[k] = false;
        }
    }
    chunk.weight.resize(chunk.neighbour.len(), 0.0);
    largest
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn chunk_rows_avx2(
    chunk: &mut Chunk,
    active: impl Fn(usize) -> Option<(usize, DVec3)>,
    params: &Params,
    from: &Candidates,
    search: &mut Search,
) -> (usize, usize) {
    chunk_rows(chunk, active, params, from, search)
}

/// [`chunk_rows`], with the widest vectors that the machine has. The arithmetic is the same, bit for bit.
pub fn neighbour_list(
    chunk: &mut Chunk,
    active: impl Fn(usize) -> Option<(usize, DVec3)>,
    params: &Params,
    from: &Candidates,
    search: &mut Search,
) -> (usize, usize) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has AVX2, checked just above.
        return unsafe { chunk_rows_avx2(chunk, active, params, from, search) };
    }
    chunk_rows(chunk, active, params, from, search)
}
