//! A level of the multigrid preconditioner, and how the next coarser one is made from it.

use super::shared::Border;
use crate::kernels::multigrid::{first_sweep, sweep};
use crate::kernels::multigrid_levels::{offset_of, place_of, step};
use crate::neighbours::CHUNK;
use rayon::prelude::*;

/// Rows below which a level is not worth threads.
const PARALLEL: usize = 4096;

/// A coarse operator in compressed rows.
#[derive(Default, Debug)]
pub(super) struct Level {
    /// Cells of the rows. Where ranks share the level those of the columns beside this rank's stand behind its own,
    /// with x as [`crate::share::Columns`] counts it: one less than the first of its own, or one more than the
    /// last.
    pub coordinates: Vec<[i32; 3]>,
    /// Cells along periodic axes, 0 along the others.
    pub around: [i32; 3],
    /// So many rows are computed here, the first ones.
    pub own: usize,
    /// Starts of these rows.
    pub start: Vec<u32>,
    pub column: Vec<u32>,
    pub value: Vec<f32>,
    pub diagonal: Vec<f32>,
    /// Unknown of the next level that each row belongs to.
    pub parent: Vec<u32>,
    pub x: Vec<f32>,
    pub b: Vec<f32>,
    pub r: Vec<f32>,
    /// Where it meets the parts of other ranks.
    pub border: Border,
}

impl Level {
    /// out_i <- f(i, b_i - (A x)_i).
    pub fn residual(&mut self, update: impl Fn(usize, f32) -> f32 + Sync) {
        let Self { own, start, column, value, diagonal, x, b, r, .. } = self;
        let r = &mut r[..*own];
        let row = |(i, r): (usize, &mut f32)| {
            let (a, e) = (start[i] as usize, start[i + 1] as usize);
            let sum = gather(&column[a..e], &value[a..e], x);
            *r = update(i, b[i] - diagonal[i] * x[i] - sum);
        };
        if diagonal.len() < PARALLEL {
            r.iter_mut().enumerate().for_each(row);
        } else {
            r.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(row);
        }
    }

    /// One damped Jacobi sweep.
    pub fn smooth(&mut self) {
        self.residual(|_, r| r);
        let (x, r, d) = (&mut self.x[..self.own], &self.r, &self.diagonal);
        x.iter_mut().zip(r).zip(d).for_each(|((x, r), d)| *x = sweep(*x, *r, *d));
    }

    /// The first sweep, from zero.
    pub fn first_smooth(&mut self) {
        let (x, b, d) = (&mut self.x[..self.own], &self.b, &self.diagonal);
        x.iter_mut().zip(b).zip(d).for_each(|((x, b), d)| *x = first_sweep(*b, *d));
    }
}

/// Numbers of cells in a box.
#[derive(Default, Debug)]
pub(super) struct Numbers {
    low: [i32; 3],
    size: [usize; 3],
    of: Vec<u32>,
}

/// Not numbered.
pub(super) const NONE: u32 = u32::MAX;

impl Numbers {
    /// No numbers, of cells from `low` to `high`.
    pub fn fit(&mut self, [low, high]: [[i32; 3]; 2]) {
        self.low = low;
        self.size = [0, 1, 2].map(|k| (high[k] - low[k] + 1) as usize);
        self.of.clear();
        self.of.resize(self.size.iter().product(), NONE);
    }

    #[inline(always)]
    fn place(&self, c: [i32; 3]) -> usize {
        let at = [0, 1, 2].map(|k| (c[k] - self.low[k]) as usize);
        (at[0] * self.size[1] + at[1]) * self.size[2] + at[2]
    }

    #[inline(always)]
    pub fn of(&mut self, c: [i32; 3]) -> &mut u32 {
        let place = self.place(c);
        &mut self.of[place]
    }

    /// Numbers those of `cells` that have no number yet behind those in `list`, and puts them there.
    pub fn extend(&mut self, list: &mut Vec<[i32; 3]>, cells: impl Iterator<Item = [i32; 3]>) {
        for c in cells {
            let number = self.of(c);
            if *number == NONE {
                *number = list.len() as u32;
                list.push(c);
            }
        }
    }
}

/// The lowest and the highest of `cells` along each axis.
pub(super) fn bounds(cells: impl Iterator<Item = [i32; 3]>) -> [[i32; 3]; 2] {
    cells
        .map(|c| [c, c])
        .reduce(|[low, high], [c, _]| {
            [[0, 1, 2].map(|k| low[k].min(c[k])), [0, 1, 2].map(|k| high[k].max(c[k]))]
        })
        .unwrap_or_default()
}

/// Buffers of the construction.
#[derive(Default, Debug)]
pub(super) struct Scratch {
    pub stencil: Vec<[f64; 27]>,
    pub numbers: Numbers,
    pub cursor: Vec<u32>,
}

impl Scratch {
    /// Zero stencils for `rows` cells.
    pub fn stencils(&mut self, rows: usize) -> &mut Vec<[f64; 27]> {
        self.stencil.clear();
        self.stencil.resize(rows, [0.0; 27]);
        &mut self.stencil
    }
}

/// sum w_k x_j(k), in four sums side by side.
#[inline(always)]
pub(super) fn gather(index: &[u32], weight: &[f32], x: &[f32]) -> f32 {
    let mut sums = [0.0; 4];
    let (indices, weights) = (index.chunks_exact(4), weight.chunks_exact(4));
    let rest: f32 =
        indices.remainder().iter().zip(weights.remainder()).map(|(&j, w)| w * x[j as usize]).sum();
    for (j, w) in indices.zip(weights) {
        for k in 0..4 {
            sums[k] += w[k] * x[j[k] as usize];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// Next coarser level of `fine`, both of which are here as a whole.
pub(super) fn coarsen(fine: &mut Level, coarse: &mut Level, scratch: &mut Scratch) {
    let numbers = &mut scratch.numbers;
    numbers.fit(bounds(fine.coordinates.iter().map(|c| c.map(|k| k >> 1))));
    coarse.coordinates.clear();
    fine.parent.clear();
    for c in &fine.coordinates {
        let p = c.map(|k| k >> 1);
        let number = numbers.of(p);
        if *number == NONE {
            *number = coarse.coordinates.len() as u32;
            coarse.coordinates.push(p);
        }
        fine.parent.push(*number);
    }
    coarse.own = coarse.coordinates.len();
    galerkin(fine, coarse, scratch);
    compress(coarse, scratch);
}

/// Stencils of `coarse`'s cells, as far as the rows of `fine` that are computed here make them.
pub(super) fn galerkin(fine: &Level, coarse: &Level, scratch: &mut Scratch) {
    let stencil = scratch.stencils(coarse.coordinates.len());
    for i in 0..fine.own {
        let p = fine.parent[i] as usize;
        let s = &mut stencil[p];
        s[13] += f64::from(fine.diagonal[i]);
        for k in fine.start[i] as usize..fine.start[i + 1] as usize {
            let q = fine.parent[fine.column[k] as usize] as usize;
            let way = step(coarse.coordinates[p], coarse.coordinates[q], coarse.around);
            s[(place_of(way) + 13) as usize] += f64::from(fine.value[k]);
        }
    }
}

/// Rows of `level` from the stencils of its cells.
pub(super) fn compress(level: &mut Level, scratch: &mut Scratch) {
    let Scratch { stencil, numbers, .. } = scratch;
    let [low, high] = bounds(level.coordinates.iter().copied());
    numbers.fit([low.map(|k| k - 1), high.map(|k| k + 1)]);
    for (i, &c) in level.coordinates.iter().enumerate() {
        *numbers.of(c) = i as u32;
    }
    level.start.clear();
    level.column.clear();
    level.value.clear();
    level.diagonal.clear();
    level.start.push(0);
    let size = numbers.size;
    let way: [isize; 27] = std::array::from_fn(|k| {
        let d = offset_of(k).map(|d| d as isize);
        (d[0] * size[1] as isize + d[1]) * size[2] as isize + d[2]
    });
    for (&c, s) in level.coordinates[..level.own].iter().zip(&*stencil) {
        let own = numbers.place(c);
        for (k, &v) in s.iter().enumerate() {
            if k != 13 && v != 0.0 {
                let mut at = own.wrapping_add_signed(way[k]);
                if level.around != [0; 3] {
                    let (d, around) = (offset_of(k), level.around);
                    let beyond = |k: usize| {
                        if around[k] > 0 { (c[k] + d[k]).rem_euclid(around[k]) } else { c[k] + d[k] }
                    };
                    at = numbers.place([0, 1, 2].map(beyond));
                }
                level.column.push(numbers.of[at]);
                level.value.push(v as f32);
            }
        }
        level.start.push(level.column.len() as u32);
        level.diagonal.push(s[13] as f32);
    }
    for v in [&mut level.x, &mut level.b, &mut level.r] {
        v.clear();
        v.resize(level.coordinates.len(), 0.0);
    }
}
