//! A level of the multigrid preconditioner, and how the next coarser one is made from it.

use super::super::cg::Among;
use crate::kernels::multigrid::{first_sweep, sweep};
use crate::kernels::multigrid_levels::{offset_of, place_of, step};
use crate::neighbours::CHUNK;
use crate::share::Side;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::ops::Range;

/// Rows below which a level is not worth threads.
const PARALLEL: usize = 4096;

/// A coarse operator in compressed rows.
#[derive(Default, Debug)]
pub(super) struct Level {
    pub coordinates: Vec<[i32; 3]>,
    /// Cells along periodic axes, 0 along the others.
    pub around: [i32; 3],
    /// Its rows that are computed here: all of them, or of the first level those of this rank.
    pub own: Range<usize>,
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
}

impl Level {
    pub fn rows(&self) -> usize {
        self.coordinates.len()
    }

    /// out_i <- f(i, b_i - (A x)_i).
    pub fn residual(&mut self, update: impl Fn(usize, f32) -> f32 + Sync) {
        let Self { own, start, column, value, diagonal, x, b, r, .. } = self;
        let (r, b, own_x) = (&mut r[own.clone()], &b[own.clone()], &x[own.clone()]);
        let row = |(i, r): (usize, &mut f32)| {
            let (a, e) = (start[i] as usize, start[i + 1] as usize);
            let sum = gather(&column[a..e], &value[a..e], x);
            *r = update(i, b[i] - diagonal[i] * own_x[i] - sum);
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
        let (x, r, d) = (&mut self.x[self.own.clone()], &self.r[self.own.clone()], &self.diagonal);
        x.iter_mut().zip(r).zip(d).for_each(|((x, r), d)| *x = sweep(*x, *r, *d));
    }

    /// The first sweep, from zero.
    pub fn first_smooth(&mut self) {
        let (x, b, d) = (&mut self.x[self.own.clone()], &self.b[self.own.clone()], &self.diagonal);
        x.iter_mut().zip(b).zip(d).for_each(|((x, b), d)| *x = first_sweep(*b, *d));
    }
}

/// Where the first coarse level, of which each rank has a part, meets those of the others, and the next, which all compute.
#[derive(Default, Debug)]
pub(super) struct Joined {
    /// Its borders.
    pub sides: [Option<Side>; 2],
    /// Rows of the next level to which each rank's cells belong.
    pub parents: Vec<Vec<u32>>,
}

impl Joined {
    /// Shows the ranks beside this one the border of `level`'s x.
    pub fn show(&self, among: Option<Among>, level: &mut Level) {
        if let Some(among) = among {
            among.share.swap_at(&self.sides, &mut [&mut &mut level.x[..]]);
        }
    }

    /// Sums `values` of the next level's rows over the ranks, each of which has added what its own cells bring.
    pub fn sum<T: Pod + Default>(&self, among: Among, values: &mut [T], add: impl Fn(&mut T, T)) {
        let own = self.parents[among.share.rank()].iter();
        let own: Vec<T> = own.map(|&p| std::mem::take(&mut values[p as usize])).collect();
        let all = among.share.gather(bytemuck::cast_slice(&own).to_vec());
        for (parents, bytes) in self.parents.iter().zip(&all) {
            let part = bytemuck::pod_collect_to_vec::<u8, T>(bytes);
            parents.iter().zip(part).for_each(|(&p, v)| add(&mut values[p as usize], v));
        }
    }
}

/// Buffers of the construction.
#[derive(Default, Debug)]
pub(super) struct Scratch {
    pub stencil: Vec<[f64; 27]>,
    pub map: Vec<u32>,
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

/// Entries of a row.
#[derive(Clone, Copy, Default, Pod, Zeroable)]
#[repr(transparent)]
struct Stencil([f64; 27]);

/// Next coarser level of `fine`.
pub(super) fn coarsen(
    fine: &mut Level,
    coarse: &mut Level,
    scratch: &mut Scratch,
    join: Option<(Among, &mut Joined)>,
) {
    let mut low = [i32::MAX; 3];
    let mut high = [i32::MIN; 3];
    for c in &fine.coordinates {
        for k in 0..3 {
            low[k] = low[k].min(c[k] >> 1);
            high[k] = high[k].max(c[k] >> 1);
        }
    }
    let size = [0, 1, 2].map(|k| (high[k] - low[k] + 1) as usize);
    let map = &mut scratch.map;
    map.clear();
    map.resize(size.iter().product(), u32::MAX);
    coarse.coordinates.clear();
    fine.parent.clear();
    for c in &fine.coordinates {
        let p = c.map(|k| k >> 1);
        let at = [0, 1, 2].map(|k| (p[k] - low[k]) as usize);
        let slot = &mut map[(at[0] * size[1] + at[1]) * size[2] + at[2]];
        if *slot == u32::MAX {
            *slot = coarse.coordinates.len() as u32;
            coarse.coordinates.push(p);
        }
        fine.parent.push(*slot);
    }
    let stencil = scratch.stencils(coarse.coordinates.len());
    for (row, i) in fine.own.clone().enumerate() {
        let p = fine.parent[i] as usize;
        let s = &mut stencil[p];
        s[13] += f64::from(fine.diagonal[row]);
        for k in fine.start[row] as usize..fine.start[row + 1] as usize {
            let q = fine.parent[fine.column[k] as usize] as usize;
            let way = step(coarse.coordinates[p], coarse.coordinates[q], coarse.around);
            s[(place_of(way) + 13) as usize] += f64::from(fine.value[k]);
        }
    }
    if let Some((among, joined)) = join {
        let mut own: Vec<u32> = fine.parent[fine.own.clone()].to_vec();
        own.sort_unstable();
        own.dedup();
        let all = among.share.gather(bytemuck::cast_slice(&own).to_vec());
        joined.parents = all.iter().map(|bytes| bytemuck::pod_collect_to_vec(bytes)).collect();
        let add = |sum: &mut Stencil, part: Stencil| sum.0.iter_mut().zip(part.0).for_each(|(a, b)| *a += b);
        joined.sum(among, bytemuck::cast_slice_mut(stencil), add);
    }
    coarse.own = 0..coarse.coordinates.len();
    compress(coarse, scratch);
}

/// Rows of `level` from the stencils of its cells.
pub(super) fn compress(level: &mut Level, scratch: &mut Scratch) {
    let Scratch { stencil, map, .. } = scratch;
    let n = level.coordinates.len();
    let mut low = [i32::MAX; 3];
    let mut high = [i32::MIN; 3];
    for c in &level.coordinates {
        for k in 0..3 {
            low[k] = low[k].min(c[k] - 1);
            high[k] = high[k].max(c[k] + 1);
        }
    }
    let size = [0, 1, 2].map(|k| (high[k] - low[k] + 1) as usize);
    let place = |c: [i32; 3]| {
        let at = [0, 1, 2].map(|k| (c[k] - low[k]) as usize);
        (at[0] * size[1] + at[1]) * size[2] + at[2]
    };
    map.clear();
    map.resize(size.iter().product(), u32::MAX);
    for (i, &c) in level.coordinates.iter().enumerate() {
        map[place(c)] = i as u32;
    }
    level.start.clear();
    level.column.clear();
    level.value.clear();
    level.diagonal.clear();
    level.start.push(0);
    let way: [isize; 27] = std::array::from_fn(|k| {
        let d = offset_of(k).map(|d| d as isize);
        (d[0] * size[1] as isize + d[1]) * size[2] as isize + d[2]
    });
    for (&c, s) in level.coordinates[level.own.clone()].iter().zip(&*stencil) {
        let own = place(c);
        for (k, &v) in s.iter().enumerate() {
            if k != 13 && v != 0.0 {
                let mut at = own.wrapping_add_signed(way[k]);
                if level.around != [0; 3] {
                    let (d, around) = (offset_of(k), level.around);
                    let beyond = |k: usize| {
                        if around[k] > 0 { (c[k] + d[k]).rem_euclid(around[k]) } else { c[k] + d[k] }
                    };
                    at = place([0, 1, 2].map(beyond));
                }
                level.column.push(map[at]);
                level.value.push(v as f32);
            }
        }
        level.start.push(level.column.len() as u32);
        level.diagonal.push(s[13] as f32);
    }
    for v in [&mut level.x, &mut level.b, &mut level.r] {
        v.clear();
        v.resize(n, 0.0);
    }
}
