//! Cell list: count, scan, stable scatter. Fluid particles are reordered by cell each step; moving solids
//! are indexed by cell each step; what never moves is indexed once. Fluid that has left through a periodic side is brought
//! back here.

use crate::cells::Grid;
use crate::fields::Fields;
use crate::scene::Kind;
use glam::DVec3;
use rayon::prelude::*;

/// Particles by cell: those of cell c are `start[c]..start[c + 1]`.
#[derive(Clone, Default, Debug)]
pub struct CellList {
    /// Start of each cell, and the end of the last one.
    pub start: Vec<u32>,
    /// Slots in cell order.
    pub slot: Vec<u32>,
}

/// Stable counting sort: `start[c]` gets the first place of cell c, `order[p]` the particle that goes to place p.
/// Particles with cell `cells` (ghosts) come last. Only the cells from the first to the last one with a particle are summed: few, of a rank of many.
pub fn counting_sort(cell: &[u32], cells: usize, start: &mut Vec<u32>, order: &mut Vec<u32>) {
    start.clear();
    start.resize(cells + 2, 0);
    let (mut first, mut end) = (cells, 0);
    for &c in cell {
        let c = c as usize;
        start[c + 1] += 1;
        if c < cells {
            (first, end) = (first.min(c), end.max(c + 1));
        }
    }
    let first = first.min(end);
    for c in first..end {
        start[c + 1] += start[c];
    }
    let live = start[end];
    start[end..=cells].fill(live);
    order.resize(cell.len(), 0);
    // `start[c]` serves as the cursor of cell c; afterwards every entry with particles has moved one cell on.
    for (k, &c) in cell.iter().enumerate() {
        order[start[c as usize] as usize] = k as u32;
        start[c as usize] += 1;
    }
    start.copy_within(first..end, first + 1);
    start[first] = 0;
    start[cells] = live;
    start.truncate(cells + 1);
}

impl CellList {
    /// Index the given slots.
    pub fn index(
        &mut self,
        grid: &Grid,
        slots: impl Iterator<Item = usize>,
        position: &[DVec3],
        scratch: &mut Scratch,
    ) {
        scratch.slots.clear();
        scratch.slots.extend(slots.map(|s| s as u32));
        scratch.cell.clear();
        // What moves is everywhere on each of many ranks: far from the slab it is in no cell.
        let cell = |&s: &u32| {
            let c = grid.coordinates(position[s as usize]);
            if grid.holds(c[0]) { grid.index(c) as u32 } else { grid.total() as u32 }
        };
        scratch.cell.extend(scratch.slots.iter().map(cell));
        counting_sort(&scratch.cell, grid.total(), &mut self.start, &mut scratch.order);
        self.slot.clear();
        self.slot.extend(scratch.order.iter().map(|&k| scratch.slots[k as usize]));
    }
}

/// Buffers kept between steps.
#[derive(Clone, Default, Debug)]
pub struct Scratch {
    slots: Vec<u32>,
    cell: Vec<u32>,
    order: Vec<u32>,
    vector: Vec<DVec3>,
    scalar: Vec<f64>,
    number: Vec<u32>,
    kind: Vec<Kind>,
}

/// `true` for a particle that may stay in the computation.
pub fn inside(x: DVec3, v: DVec3, min: DVec3, max: DVec3, dimensions: u32) -> bool {
    let y = dimensions == 2 || (x.y >= min.y && x.y < max.y);
    x.is_finite() && v.is_finite() && y && x.x >= min.x && x.x < max.x && x.z >= min.z && x.z < max.z
}

/// Reorder the fluid by cell, ghosts last; `start` gets the cells. Returns how many became ghosts.
pub fn reorder_fluid(
    fields: &mut Fields,
    grid: &Grid,
    domain: (DVec3, DVec3),
    dimensions: u32,
    start: &mut Vec<u32>,
    scratch: &mut Scratch,
) -> u64 {
    let n = fields.id.len();
    if grid.periodic.is_any() {
        fields.position[..n].par_iter_mut().for_each(|x| *x = grid.periodic.wrap(*x));
    }
    let ghosts_before = fields.kind[..n].iter().filter(|&&k| k == Kind::Ghost).count();
    let (position, velocity) = (&fields.position[..n], &fields.velocity[..n]);
    scratch.cell.resize(n, 0);
    let ghost = grid.total() as u32;
    (&mut scratch.cell, position, velocity, &fields.kind[..n]).into_par_iter().for_each(
        |(c, &x, &v, &kind)| {
            *c = if kind == Kind::Fluid && inside(x, v, domain.0, domain.1, dimensions) {
                grid.index(grid.coordinates(x)) as u32
            } else {
                ghost
            }
        },
    );
    counting_sort(&scratch.cell, grid.total(), start, &mut scratch.order);
    let live = start[grid.total()] as usize;
    let order = &scratch.order;
    permute(&mut fields.position[..n], order, &mut scratch.vector);
    permute(&mut fields.velocity[..n], order, &mut scratch.vector);
    permute(&mut fields.pressure[..n], order, &mut scratch.scalar);
    permute(&mut fields.id, order, &mut scratch.number);
    permute(&mut fields.kind[..n], order, &mut scratch.kind);
    for i in live..n {
        fields.kind[i] = Kind::Ghost;
        fields.position[i] = domain.0;
        fields.velocity[i] = DVec3::ZERO;
        fields.pressure[i] = 0.0;
    }
    (n - live - ghosts_before) as u64
}

/// Particles that a thread permutes at a time.
const PART: usize = 4096;

/// `values[order[p]]` moves to place p.
fn permute<T: Copy + Send + Sync>(values: &mut [T], order: &[u32], scratch: &mut Vec<T>) {
    order.par_iter().with_min_len(PART).map(|&k| values[k as usize]).collect_into_vec(scratch);
    values.par_chunks_mut(PART).zip(scratch.par_chunks(PART)).for_each(|(v, s)| v.copy_from_slice(s));
}

/// Mark every cell within one cell of a cell that holds fluid, which all lies in `columns` along x: only walls there can feel or be felt.
pub fn mark_near_fluid(grid: &Grid, start: &[u32], columns: impl Iterator<Item = u32>, near: &mut Vec<bool>) {
    near.clear();
    near.resize(grid.total(), false);
    let [_, ny, nz] = grid.count;
    for x in columns {
        for y in 0..ny {
            let column = grid.index([x, y, 0]);
            for z in 0..nz {
                let c = column + z as usize;
                if start[c] < start[c + 1] {
                    for column in grid.columns([x, y, z]) {
                        near[column.first..=column.last].fill(true);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sort_is_that_of_all_cells_wherever_the_particles_lie() {
        let random = |k: usize| k * 7919 % 104_729;
        for cells in [1_usize, 2, 9, 40] {
            for (low, high) in [(0, cells), (cells / 2, cells), (0, cells.div_ceil(2)), (cells - 1, cells)] {
                for ghosts in [0, 3] {
                    for count in [0, 1, 50] {
                        let live = (0..count).map(|k| (low + random(k) % (high - low)) as u32);
                        let mut cell: Vec<u32> =
                            live.chain(std::iter::repeat_n(cells as u32, ghosts)).collect();
                        cell.rotate_left(ghosts / 2);
                        let (mut start, mut order) = (vec![7; 3], vec![7; 3]);
                        counting_sort(&cell, cells, &mut start, &mut order);
                        let before = |c: usize| cell.iter().filter(|&&own| (own as usize) < c).count() as u32;
                        assert_eq!(start, (0..=cells).map(before).collect::<Vec<_>>());
                        let mut plain: Vec<u32> = (0..cell.len() as u32).collect();
                        plain.sort_by_key(|&k| cell[k as usize]);
                        assert_eq!(order, plain);
                    }
                }
            }
        }
    }
}
