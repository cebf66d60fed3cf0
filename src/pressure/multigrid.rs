//! Aggregation multigrid as preconditioner of the PPE, rebuilt every step.
//!
//! Level 1 joins the unknowns of a background cell (one effective radius wide), each further level 2 x 2 x 2
//! cells of the last; interpolation is piecewise constant and the coarse operators are Galerkin products, so
//! every one is a 27-point stencil. Plain aggregation is about twice too stiff a level, hence the
//! over-correction. One damped Jacobi sweep before and after; a V-cycle on the finest level, W below,
//! where work is a tenth. The cycle is symmetric: the preconditioner is positive definite for any positive
//! over-correction. It is computed in f32: it need only be an approximation, and half the bytes move.

use super::cg::{Precondition, System};
use crate::cells::Grid;
use crate::fields::State;
use crate::neighbours::CHUNK;
use glam::DVec3;
use rayon::prelude::*;

/// Damping of the Jacobi sweeps; the largest eigenvalue of D^-1 A is 1.30 to 1.33.
const DAMPING: f32 = 0.9;
/// Factor on coarse corrections.
const OVER_CORRECTION: f32 = 1.4;
/// Unknowns at which a level is solved directly.
const DIRECT: usize = 48;
/// Rows below which a level is not worth threads.
const PARALLEL: usize = 4096;

/// A coarse operator in compressed rows.
#[derive(Default, Debug)]
struct Level {
    coordinates: Vec<[i32; 3]>,
    start: Vec<u32>,
    column: Vec<u32>,
    value: Vec<f32>,
    diagonal: Vec<f32>,
    /// Unknown of the next level that each row belongs to.
    parent: Vec<u32>,
    x: Vec<f32>,
    b: Vec<f32>,
    r: Vec<f32>,
}

impl Level {
    fn rows(&self) -> usize {
        self.diagonal.len()
    }

    /// out_i <- f(i, b_i - (A x)_i).
    fn residual(&mut self, update: impl Fn(usize, f32) -> f32 + Sync) {
        let Self { start, column, value, diagonal, x, b, r, .. } = self;
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
    fn smooth(&mut self) {
        self.residual(|_, r| r);
        let (x, r, d) = (&mut self.x, &self.r, &self.diagonal);
        x.iter_mut().zip(r).zip(d).for_each(|((x, r), d)| *x += DAMPING * r / d);
    }
}

/// The hierarchy; buffers are kept between steps.
#[derive(Default, Debug)]
pub struct Multigrid {
    /// Aggregate of each slot, `u32::MAX` where there is no unknown.
    aggregate: Vec<u32>,
    /// Cell of each slot as 9 x + 3 y + z, [`NOWHERE`] where there is no unknown: the difference of two of them
    /// is the entry in the stencil.
    code: Vec<i32>,
    members: Vec<u32>,
    member_start: Vec<u32>,
    cell_aggregate: Vec<u32>,
    touched: Vec<u32>,
    weight: Vec<Vec<f32>>,
    diagonal: Vec<f32>,
    x: Vec<f32>,
    b: Vec<f32>,
    t: Vec<f32>,
    levels: Vec<Level>,
    used: usize,
    factor: Vec<f64>,
    solution: Vec<f64>,
    scratch: Scratch,
}

/// Buffers of the construction.
#[derive(Default, Debug)]
struct Scratch {
    stencil: Vec<[f64; 27]>,
    map: Vec<u32>,
    cursor: Vec<u32>,
}

impl Scratch {
    /// Zero stencils for `rows` cells.
    fn stencils(&mut self, rows: usize) -> &mut Vec<[f64; 27]> {
        self.stencil.clear();
        self.stencil.resize(rows, [0.0; 27]);
        &mut self.stencil
    }
}

/// Marks a slot without an unknown.
const NOWHERE: i32 = i32::MIN;

/// 9 x + 3 y + z.
#[inline(always)]
fn code([x, y, z]: [i32; 3]) -> i32 {
    9 * x + 3 * y + z
}

impl Multigrid {
    /// Rebuild for `system` with particles at `position`.
    pub fn build(&mut self, system: &System, grid: &Grid, position: &[DVec3]) {
        if self.levels.is_empty() {
            self.levels.push(Level::default());
        }
        self.aggregate_cells(system, grid, position);
        self.first_level(system);
        self.used = 1;
        while self.levels[self.used - 1].rows() > DIRECT {
            if self.levels.len() == self.used {
                self.levels.push(Level::default());
            }
            let (fine, coarse) = self.levels.split_at_mut(self.used);
            let shrunk = coarsen(&mut fine[self.used - 1], &mut coarse[0], &mut self.scratch);
            self.used += 1;
            if !shrunk {
                break;
            }
        }
        self.factorise();
    }

    /// Unknowns of each level, finest first.
    pub fn sizes(&self) -> Vec<usize> {
        std::iter::once(self.members.len()).chain(self.levels[..self.used].iter().map(Level::rows)).collect()
    }

    fn aggregate_cells(&mut self, system: &System, grid: &Grid, position: &[DVec3]) {
        let n = system.state.len();
        self.aggregate.clear();
        self.aggregate.resize(n, u32::MAX);
        self.code.resize(n, NOWHERE);
        self.diagonal.resize(n, 1.0);
        if self.cell_aggregate.len() != grid.total() {
            self.cell_aggregate = vec![u32::MAX; grid.total()];
        }
        (&mut self.code, &mut self.diagonal, system.state, system.diagonal, &position[..n])
            .into_par_iter()
            .with_min_len(CHUNK)
            .for_each(|(c, d, &state, &a, &x)| {
                *c =
                    if state == State::Inner { code(grid.coordinates(x).map(|k| k as i32)) } else { NOWHERE };
                *d = a as f32;
            });
        let coarse = &mut self.levels[0].coordinates;
        coarse.clear();
        self.touched.clear();
        self.member_start.clear();
        for (i, &x) in position.iter().enumerate().take(n) {
            if self.code[i] == NOWHERE {
                continue;
            }
            let c = grid.coordinates(x);
            let cell = grid.index(c);
            if self.cell_aggregate[cell] == u32::MAX {
                self.cell_aggregate[cell] = coarse.len() as u32;
                self.touched.push(cell as u32);
                coarse.push(c.map(|k| k as i32));
                self.member_start.push(0);
            }
            let a = self.cell_aggregate[cell];
            self.aggregate[i] = a;
            self.member_start[a as usize] += 1;
        }
        let mut sum = 0;
        for s in &mut self.member_start {
            (*s, sum) = (sum, sum + *s);
        }
        self.member_start.push(sum);
        self.members.resize(sum as usize, 0);
        let cursor = &mut self.scratch.cursor;
        cursor.clone_from(&self.member_start);
        for (i, &a) in self.aggregate.iter().enumerate() {
            if a != u32::MAX {
                self.members[cursor[a as usize] as usize] = i as u32;
                cursor[a as usize] += 1;
            }
        }
        for &c in &self.touched {
            self.cell_aggregate[c as usize] = u32::MAX;
        }
    }

    /// Galerkin operator of the first level, and the finest level's weights in f32.
    fn first_level(&mut self, system: &System) {
        let chunks = &system.neighbours.chunks;
        let c = system.coefficient;
        self.weight.resize_with(chunks.len(), Vec::new);
        self.weight.par_iter_mut().zip(chunks).for_each(|(w32, chunk)| {
            w32.clear();
            w32.extend(chunk.weight.iter().map(|&w| (c * w) as f32));
        });
        let codes = &self.code;
        let (members, start) = (&self.members, &self.member_start);
        let level = &mut self.levels[0];
        let rows = level.coordinates.len();
        self.scratch.stencils(rows).par_iter_mut().enumerate().with_min_len(64).for_each(|(a, s)| {
            for &i in &members[start[a] as usize..start[a + 1] as usize] {
                let i = i as usize;
                s[13] += system.diagonal[i];
                let own = codes[i] - 13;
                for (j, w) in chunks[i / CHUNK].pressure(i % CHUNK).iter() {
                    // A pair without weight may lie further apart than neighbouring cells.
                    if codes[j] != NOWHERE && w > 0.0 {
                        s[(codes[j] - own) as usize] -= c * w;
                    }
                }
            }
        });
        compress(level, &mut self.scratch);
    }

    fn factorise(&mut self) {
        let level = &self.levels[self.used - 1];
        let n = level.rows();
        let a = &mut self.factor;
        a.clear();
        if n > 4 * DIRECT {
            return;
        }
        a.resize(n * n, 0.0);
        for i in 0..n {
            // Lifted a little: a floating component must not make the factor singular.
            a[i * n + i] = f64::from(level.diagonal[i]) * (1.0 + 1e-6);
            for k in level.start[i] as usize..level.start[i + 1] as usize {
                a[i * n + level.column[k] as usize] += f64::from(level.value[k]);
            }
        }
        for j in 0..n {
            for k in 0..j {
                let l = a[j * n + k];
                a[j * n + j] -= l * l;
            }
            let d = a[j * n + j].max(1e-12 * f64::from(level.diagonal[j])).sqrt();
            a[j * n + j] = d;
            for i in j + 1..n {
                let s: f64 = (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum();
                a[i * n + j] = (a[i * n + j] - s) / d;
            }
        }
    }

    fn solve_directly(&mut self) {
        let level = &mut self.levels[self.used - 1];
        let n = level.rows();
        let a = &self.factor;
        if a.is_empty() {
            level
                .x
                .iter_mut()
                .zip(&level.b)
                .zip(&level.diagonal)
                .for_each(|((x, b), d)| *x = DAMPING * b / d);
            (0..8).for_each(|_| level.smooth());
            return;
        }
        let y = &mut self.solution;
        y.clear();
        y.extend(level.b.iter().map(|&b| f64::from(b)));
        for i in 0..n {
            let s: f64 = (0..i).map(|k| a[i * n + k] * y[k]).sum();
            y[i] = (y[i] - s) / a[i * n + i];
        }
        for i in (0..n).rev() {
            let s: f64 = (i + 1..n).map(|k| a[k * n + i] * y[k]).sum();
            y[i] = (y[i] - s) / a[i * n + i];
        }
        level.x.iter_mut().zip(y).for_each(|(x, y)| *x = *y as f32);
    }

    /// x <- B b on level `l` (0 is the first coarse one).
    fn cycle(&mut self, l: usize) {
        if l + 1 == self.used {
            return self.solve_directly();
        }
        let level = &mut self.levels[l];
        level.x.iter_mut().zip(&level.b).zip(&level.diagonal).for_each(|((x, b), d)| *x = DAMPING * b / d);
        for visit in 0..2 {
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            let (level, next) = (&mut fine[l], &mut coarse[0]);
            level.residual(|_, r| r);
            next.b.fill(0.0);
            level.r.iter().zip(&level.parent).for_each(|(r, &p)| next.b[p as usize] += r);
            self.cycle(l + 1);
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            let (level, next) = (&mut fine[l], &coarse[0]);
            level
                .x
                .iter_mut()
                .zip(&level.parent)
                .for_each(|(x, &p)| *x += OVER_CORRECTION * next.x[p as usize]);
            if visit == 0 {
                level.smooth();
                level.smooth();
            }
        }
        self.levels[l].smooth();
    }

    /// t <- b - A x on the finest level, in f32.
    fn residual(&mut self, system: &System) {
        let (x, b, d, weight) = (&self.x, &self.b, &self.diagonal, &self.weight);
        (self.t.par_chunks_mut(CHUNK), &system.neighbours.chunks, weight)
            .into_par_iter()
            .enumerate()
            .for_each(|(c, (t, chunk, w))| {
                for (k, t) in t.iter_mut().enumerate() {
                    let i = c * CHUNK + k;
                    *t = 0.0;
                    if system.state[i] == State::Inner {
                        let (a, e) = (chunk.start[k] as usize, chunk.dummies[k] as usize);
                        let sum = gather(&chunk.neighbour[a..e], &w[a..e], x);
                        *t = b[i] - d[i] * x[i] + sum;
                    }
                }
            });
    }
}

/// sum w_k x_j(k), in four sums side by side.
#[inline(always)]
fn gather(index: &[u32], weight: &[f32], x: &[f32]) -> f32 {
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

/// Next coarser level of `fine`; `false` if it did not get smaller.
fn coarsen(fine: &mut Level, coarse: &mut Level, scratch: &mut Scratch) -> bool {
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
    for i in 0..fine.rows() {
        let p = fine.parent[i] as usize;
        let s = &mut stencil[p];
        s[13] += f64::from(fine.diagonal[i]);
        for k in fine.start[i] as usize..fine.start[i + 1] as usize {
            let q = fine.parent[fine.column[k] as usize] as usize;
            s[(code(coarse.coordinates[q]) - code(coarse.coordinates[p]) + 13) as usize] +=
                f64::from(fine.value[k]);
        }
    }
    compress(coarse, scratch);
    coarse.rows() < fine.rows()
}

/// Rows of `level` from the stencils of its cells.
fn compress(level: &mut Level, scratch: &mut Scratch) {
    let Scratch { stencil, map, .. } = scratch;
    let n = stencil.len();
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
    for (c, s) in level.coordinates.iter().zip(&*stencil) {
        for (k, &v) in s.iter().enumerate() {
            if k != 13 && v != 0.0 {
                let d = [k as i32 / 9 - 1, k as i32 / 3 % 3 - 1, k as i32 % 3 - 1];
                level.column.push(map[place([c[0] + d[0], c[1] + d[1], c[2] + d[2]])]);
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

impl Precondition for Multigrid {
    fn apply(&mut self, system: &System, r: &[f64], z: &mut [f64]) {
        let n = r.len();
        for v in [&mut self.x, &mut self.b, &mut self.t] {
            v.resize(n, 0.0);
        }
        // Scaled to unit size: late residuals must not leave the range of f32.
        let scale = r.par_iter().map(|r| r.abs()).reduce(|| 0.0, f64::max).max(f64::MIN_POSITIVE);
        (&mut self.b, &mut self.x, &self.diagonal, r).into_par_iter().with_min_len(CHUNK).for_each(
            |(b, x, d, r)| {
                *b = (r / scale) as f32;
                *x = DAMPING * *b / d;
            },
        );
        self.residual(system);
        {
            let (t, members, start) = (&self.t, &self.members, &self.member_start);
            self.levels[0].b.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(a, b)| {
                *b = members[start[a] as usize..start[a + 1] as usize].iter().map(|&i| t[i as usize]).sum();
            });
        }
        self.cycle(0);
        let coarse = &self.levels[0].x;
        (&mut self.x, &self.aggregate).into_par_iter().with_min_len(CHUNK).for_each(|(x, &a)| {
            if a != u32::MAX {
                *x += OVER_CORRECTION * coarse[a as usize];
            }
        });
        self.residual(system);
        (z, &self.x, &self.t, &self.diagonal).into_par_iter().with_min_len(CHUNK).for_each(|(z, x, t, d)| {
            *z = scale * f64::from(x + DAMPING * t / d);
        });
    }
}
