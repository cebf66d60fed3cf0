//! Levels of the multigrid that ranks share. A rank has the cells in its own columns and those in the columns
//! beside them, which their owners show; a coarse column belongs to the rank that has the first of its two fine
//! ones, and what the second one brings that is the next rank's is handed back. Behind the last level that is
//! shared all ranks have the same ones.

use super::level::{Level, Scratch, bounds, compress, galerkin};
use crate::share::{Columns, Share, Side};
use bytemuck::{Pod, Zeroable};

/// Where a rank's part of a level meets those of the ranks beside it.
#[derive(Default, Debug)]
pub(super) struct Border {
    /// Rows that are shown to each, and by it.
    sides: [Option<Side>; 2],
    /// Rows of the rank before to which rows of the finer level here belong, and own ones to which such of the rank
    /// after belong. None where nowhere a pair of columns is cut.
    split: Option<[Vec<u32>; 2]>,
}

/// Entries of a row.
#[derive(Clone, Copy, Zeroable, Pod)]
#[repr(transparent)]
pub(super) struct Stencil([f64; 27]);

/// A number that parts of several ranks add up to.
pub(super) trait Summed: Pod {
    /// Add that of another rank.
    fn add(&mut self, other: Self);
}

impl Summed for f32 {
    fn add(&mut self, other: Self) {
        *self += other;
    }
}

impl Summed for Stencil {
    fn add(&mut self, other: Self) {
        self.0.iter_mut().zip(other.0).for_each(|(sum, v)| *sum += v);
    }
}

impl Border {
    /// Shows the ranks beside this one the border of `x`.
    pub fn show(&self, share: &Share, x: &mut [f32]) {
        share.swap_at(&self.sides, &mut [&mut &mut *x]);
    }

    /// Hands what `values` of the rank before have got here back to it, and adds what the rank after has for own ones.
    pub fn hand_back<T: Summed>(&self, share: &Share, values: &mut [T]) {
        let Some([theirs, own]) = &self.split else { return };
        let parts: Vec<T> = theirs.iter().map(|&i| values[i as usize]).collect();
        let [_, come] = share.pass(bytemuck::cast_slice(&parts).to_vec(), Vec::new());
        let parts = bytemuck::pod_collect_to_vec::<u8, T>(&come);
        own.iter().zip(parts).for_each(|(&i, part)| values[i as usize].add(part));
    }
}

/// Cells of a column as they are told to the rank that has it.
fn told<'a>(cells: impl Iterator<Item = &'a [i32; 3]>) -> Vec<u8> {
    let across: Vec<[i32; 2]> = cells.map(|&[_, y, z]| [y, z]).collect();
    bytemuck::cast_slice(&across).to_vec()
}

/// Cells in column `x` that another rank told.
fn heard(bytes: &[u8], x: i32) -> impl Iterator<Item = [i32; 3]> {
    bytemuck::pod_collect_to_vec::<u8, [i32; 2]>(bytes).into_iter().map(move |[y, z]| [x, y, z])
}

/// Adds the cells that the ranks beside have next to this one's `columns` behind its own, and finds the border of
/// `level`.
pub(super) fn meet(level: &mut Level, share: &Share, columns: &Columns) {
    let mine = columns.mine();
    let cells = &mut level.coordinates;
    let own = cells.len();
    let ends = [mine.start, mine.end - 1];
    let is_there = share.beyond().map(|column| column.is_some());
    let given: [Vec<u32>; 2] = [0, 1].map(|k| {
        let at_end = |i: &u32| is_there[k] && cells[*i as usize][0] == ends[k];
        (0..own as u32).filter(at_end).collect()
    });
    let [left, right] = given.each_ref().map(|rows| told(rows.iter().map(|&i| &cells[i as usize])));
    let come = share.pass(left, right);
    let beyond = [mine.start - 1, mine.end];
    let taken = [0, 1].map(|k| {
        let from = cells.len() as u32;
        cells.extend(heard(&come[k], beyond[k]));
        (from..cells.len() as u32).collect()
    });
    let [a, b] = given;
    let [c, d]: [Vec<u32>; 2] = taken;
    level.own = own;
    level.border.sides = [Some(Side::of(a, c)), Some(Side::of(b, d))];
}

/// Next coarser level of `fine`, both of them shared, with the `columns` of both.
pub(super) fn coarsen(
    [fine, coarse]: [&mut Level; 2],
    scratch: &mut Scratch,
    share: &Share,
    columns: &[Columns],
) {
    let (mine, of_fine) = (columns[1].mine(), &columns[0]);
    let Level { coordinates, parent, own, .. } = &mut *fine;
    let parents = || coordinates.iter().map(|c| [of_fine.parent(c[0]), c[1] >> 1, c[2] >> 1]);
    let is_mine = |p: &[i32; 3]| mine.contains(&p[0]);
    // Cells of this rank, also those that only cells of the rank after bring.
    let numbers = &mut scratch.numbers;
    numbers.fit(bounds(parents()));
    coarse.coordinates.clear();
    numbers.extend(&mut coarse.coordinates, parents().filter(is_mine));
    meet(coarse, share, &columns[1]);
    numbers.fit(bounds(coarse.coordinates.iter().copied()));
    coarse.coordinates.iter().enumerate().for_each(|(i, &c)| *numbers.of(c) = i as u32);
    // What is handed back are the parents of the first fine column. Both ranks have its cells, and so the same list.
    let mut rows = |mut cells: Vec<[i32; 3]>| -> Vec<u32> {
        cells.sort_unstable();
        cells.dedup();
        cells.into_iter().map(|p| *numbers.of(p)).collect()
    };
    coarse.border.split = of_fine.is_split().then(|| {
        let theirs = parents().take(*own).filter(|p| !is_mine(p)).collect();
        [rows(theirs), rows(parents().skip(*own).filter(is_mine).collect())]
    });
    parent.clear();
    parent.extend(parents().map(|p| *numbers.of(p)));
    galerkin(fine, coarse, scratch);
    coarse.border.hand_back::<Stencil>(share, bytemuck::cast_slice_mut(&mut scratch.stencil));
    compress(coarse, scratch);
}

/// The first level that all ranks have.
#[derive(Default, Debug)]
pub(super) struct Joined {
    /// Its rows to which each rank's rows of the finer level belong.
    parents: Vec<Vec<u32>>,
}

impl Joined {
    /// Makes it from `fine`, which is shared, with these `columns`; so many cells it has along each axis.
    pub fn coarsen(
        &mut self,
        [fine, coarse]: [&mut Level; 2],
        scratch: &mut Scratch,
        share: &Share,
        columns: &Columns,
        count: [u32; 3],
    ) {
        // In a ring the columns beyond the seam are the last and the first.
        let x = |c: i32| columns.parent(c).rem_euclid(count[0] as i32);
        let Level { coordinates, parent, own, .. } = &mut *fine;
        let parents = || coordinates.iter().map(|c| [x(c[0]), c[1] >> 1, c[2] >> 1]);
        let (numbers, mut here) = (&mut scratch.numbers, Vec::new());
        numbers.fit(bounds(parents()));
        numbers.extend(&mut here, parents().take(*own));
        let all = share.gather(bytemuck::cast_slice(&here).to_vec());
        let all: Vec<Vec<[i32; 3]>> = all.iter().map(|bytes| bytemuck::pod_collect_to_vec(bytes)).collect();
        numbers.fit(bounds(all.iter().flatten().copied()));
        coarse.coordinates.clear();
        numbers.extend(&mut coarse.coordinates, all.iter().flatten().copied());
        coarse.own = coarse.coordinates.len();
        let mut rows = |cells: &Vec<[i32; 3]>| cells.iter().map(|&p| *numbers.of(p)).collect();
        self.parents = all.iter().map(&mut rows).collect();
        parent.clear();
        parent.extend(parents().map(|p| *numbers.of(p)));
        galerkin(fine, coarse, scratch);
        self.sum::<Stencil>(share, bytemuck::cast_slice_mut(&mut scratch.stencil));
        compress(coarse, scratch);
    }

    /// Sums `values` of its rows over the ranks, in their order; each has added what its own rows bring.
    pub fn sum<T: Summed>(&self, share: &Share, values: &mut [T]) {
        let own: Vec<T> = self.parents[share.rank()].iter().map(|&p| values[p as usize]).collect();
        values.fill(T::zeroed());
        let all = share.gather(bytemuck::cast_slice(&own).to_vec());
        for (parents, bytes) in self.parents.iter().zip(&all) {
            let part = bytemuck::pod_collect_to_vec::<u8, T>(bytes);
            parents.iter().zip(part).for_each(|(&p, part)| values[p as usize].add(part));
        }
    }
}
