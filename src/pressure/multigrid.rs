//! Aggregation multigrid as preconditioner of the PPE, rebuilt every step: levels as
//! [`crate::kernels::multigrid_levels`] says, the cycle as [`crate::kernels::multigrid`] does, here in
//! compressed rows. It is computed in f32: it need only be an approximation, and half the bytes move.

mod level;

use self::level::{Joined, Level, Scratch, coarsen, compress, gather};
use super::cg::{Among, Precondition, System};
use crate::cells::Grid;
use crate::fields::State;
use crate::kernels::multigrid::{OVER_CORRECTION, SWEEPS, first_sweep, over_correction, sweep, visits};
use crate::kernels::multigrid_levels::{LevelSums, level_cells, place_of, step};
use crate::neighbours::{CHUNK, Chunk};
use glam::DVec3;
use rayon::prelude::*;

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
    joined: Joined,
    scratch: Scratch,
}

/// Marks a slot without an unknown.
const NOWHERE: i32 = i32::MIN;

impl Multigrid {
    /// Rebuild for `system` with particles at `position`.
    pub fn build(&mut self, system: &System, grid: &Grid, position: &[DVec3]) {
        let counts = level_cells(grid.count);
        self.used = counts.len();
        self.levels.resize_with(self.used.max(self.levels.len()), Level::default);
        for (level, count) in self.levels.iter_mut().zip(&counts) {
            let along = |k| if grid.periodic.is_along(k) { count[k] as i32 } else { 0 };
            level.around = [0, 1, 2].map(along);
        }
        self.aggregate_cells(system, grid, position);
        self.first_level(system);
        for l in 1..self.used {
            let (fine, coarse) = self.levels.split_at_mut(l);
            let join = system.among.filter(|_| l == 1).map(|among| (among, &mut self.joined));
            coarsen(&mut fine[l - 1], &mut coarse[0], &mut self.scratch, join);
        }
    }

    /// Unknowns of each level, finest first.
    pub fn sizes(&self) -> Vec<usize> {
        std::iter::once(self.members.len()).chain(self.levels[..self.used].iter().map(Level::rows)).collect()
    }

    /// Rows and entries beside the diagonal of each coarse level, finest first.
    pub fn stored(&self) -> Vec<[u64; 2]> {
        self.levels[..self.used].iter().map(|l| [l.rows() as u64, l.value.len() as u64]).collect()
    }

    /// Sums over the operators of the levels, finest first.
    pub fn sums(&self) -> Vec<LevelSums> {
        let sums = |level: &Level| {
            let mut out = LevelSums { rows: level.rows(), ..Default::default() };
            level.diagonal.iter().for_each(|&v| out.add(f64::from(v), true));
            level.value.iter().for_each(|&v| out.add(f64::from(v), false));
            out
        };
        self.levels[..self.used].iter().map(sums).collect()
    }

    fn aggregate_cells(&mut self, system: &System, grid: &Grid, position: &[DVec3]) {
        let n = system.state.len();
        self.aggregate.resize(n, u32::MAX);
        self.code.resize(n, NOWHERE);
        for v in [&mut self.diagonal, &mut self.x, &mut self.b, &mut self.t] {
            v.resize(n, 0.0);
        }
        if self.cell_aggregate.len() != grid.total() {
            self.cell_aggregate = vec![u32::MAX; grid.total()];
        }
        // For now `aggregate` holds the cells.
        (
            self.code.par_chunks_mut(CHUNK),
            self.aggregate.par_chunks_mut(CHUNK),
            self.diagonal.par_chunks_mut(CHUNK),
            self.x.par_chunks_mut(CHUNK),
            system.state.par_chunks(CHUNK),
            system.diagonal.par_chunks(CHUNK),
            position[..n].par_chunks(CHUNK),
            &system.neighbours.chunks,
        )
            .into_par_iter()
            .for_each(|(code, cell, d32, x32, state, d, position, chunk)| {
                if chunk.is_dry() {
                    code.fill(NOWHERE);
                    x32.fill(0.0);
                    return;
                }
                for k in 0..code.len() {
                    code[k] = NOWHERE;
                    d32[k] = d[k] as f32;
                    if state[k] == State::Inner {
                        let c = grid.coordinates(position[k]);
                        code[k] = place_of(c.map(|k| k as i32));
                        cell[k] = grid.index(c) as u32;
                    }
                }
            });
        let coarse = &mut self.levels[0].coordinates;
        coarse.clear();
        self.touched.clear();
        self.member_start.clear();
        for (aggregate, code) in self.aggregate.iter_mut().zip(&self.code) {
            if *code == NOWHERE {
                *aggregate = u32::MAX;
                continue;
            }
            let joined = &mut self.cell_aggregate[*aggregate as usize];
            if *joined == u32::MAX {
                *joined = coarse.len() as u32;
                self.touched.push(*aggregate);
                coarse.push(grid.coordinates_of(*aggregate as usize).map(|k| k as i32));
                self.member_start.push(0);
            }
            *aggregate = *joined;
            self.member_start[*joined as usize] += 1;
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
        self.levels[0].own = 0..self.touched.len();
        if let Some(among) = system.among {
            self.join_cells(among, grid, position);
        }
        for &c in &self.touched {
            self.cell_aggregate[c as usize] = u32::MAX;
        }
    }

    /// Numbers the cells of all ranks, rank by rank: the levels are the same on each.
    fn join_cells(&mut self, among: Among, grid: &Grid, position: &[DVec3]) {
        let share = among.share;
        let all = share.gather(bytemuck::cast_slice(&self.touched).to_vec());
        let before: usize = all[..share.rank()].iter().map(Vec::len).sum();
        let first = before / size_of::<u32>();
        self.levels[0].own = first..first + self.touched.len();
        self.touched = bytemuck::pod_collect_to_vec(&all.concat());
        let coarse = &mut self.levels[0].coordinates;
        coarse.clear();
        for (k, &cell) in self.touched.iter().enumerate() {
            coarse.push(grid.coordinates_of(cell as usize).map(|k| k as i32));
            self.cell_aggregate[cell as usize] = k as u32;
        }
        self.aggregate.iter_mut().filter(|a| **a != u32::MAX).for_each(|a| *a += first as u32);
        let cells = &self.levels[0].coordinates;
        let of = |c: u32| (0..cells.len() as u32).filter(|&k| cells[k as usize][0] == c as i32).collect();
        self.joined.sides = share.borders(of);
        share.swap(&mut [&mut &mut self.diagonal[..]]);
        for i in share.copies().filter(|&i| among.state[i] == State::Inner) {
            let c = grid.coordinates(position[i]);
            self.code[i] = place_of(c.map(|k| k as i32));
            self.aggregate[i] = self.cell_aggregate[grid.index(c)];
        }
    }

    /// Galerkin operator of the first level, and the finest level's weights in f32.
    fn first_level(&mut self, system: &System) {
        let chunks = &system.neighbours.chunks;
        let c = system.coefficient;
        self.weight.resize_with(chunks.len(), Vec::new);
        self.weight.par_iter_mut().zip(chunks).for_each(|(w32, chunk)| {
            w32.resize(chunk.weight.len(), 0.0);
            w32.iter_mut().zip(&chunk.weight).for_each(|(w32, &w)| *w32 = (c * w) as f32);
        });
        let (codes, aggregate) = (&self.code, &self.aggregate);
        let (members, start) = (&self.members, &self.member_start);
        let level = &mut self.levels[0];
        let (rows, cells, around) = (start.len() - 1, &level.coordinates[level.own.clone()], level.around);
        let everywhere = &level.coordinates;
        let seams = around != [0; 3];
        self.scratch.stencils(rows).par_iter_mut().enumerate().with_min_len(64).for_each(|(a, s)| {
            // Two stencils in turn: neighbours that follow each other mostly fall into the same entry, and would wait
            // for each other's sum.
            let mut turns = [[0.0; 27]; 2];
            for &i in &members[start[a] as usize..start[a + 1] as usize] {
                let i = i as usize;
                turns[0][13] += system.diagonal[i];
                let own = codes[i] - 13;
                for (k, (j, w)) in chunks[i / CHUNK].pressure(i % CHUNK).iter().enumerate() {
                    // A pair without weight may lie further apart than neighbouring cells.
                    if codes[j] != NOWHERE && w > 0.0 {
                        let entry = if seams {
                            place_of(step(cells[a], everywhere[aggregate[j] as usize], around)) + 13
                        } else {
                            codes[j] - own
                        };
                        turns[k % 2][entry as usize] -= c * w;
                    }
                }
            }
            *s = std::array::from_fn(|k| turns[0][k] + turns[1][k]);
        });
        compress(level, &mut self.scratch);
    }

    /// x <- B b on level `l` (0 is the first coarse one, of which ranks have parts).
    fn cycle(&mut self, l: usize, among: Option<Among>) {
        let among = among.filter(|_| l == 0);
        self.levels[l].first_smooth();
        if l + 1 == self.used {
            for _ in 1..SWEEPS {
                self.joined.show(among, &mut self.levels[l]);
                self.levels[l].smooth();
            }
            self.joined.show(among, &mut self.levels[l]);
            return;
        }
        for visit in 0..visits(l) {
            if visit > 0 {
                self.joined.show(among, &mut self.levels[l]);
                self.levels[l].smooth();
            }
            self.joined.show(among, &mut self.levels[l]);
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            let (level, next) = (&mut fine[l], &mut coarse[0]);
            level.residual(|_, r| r);
            next.b.fill(0.0);
            let own = level.own.clone();
            level.r[own.clone()].iter().zip(&level.parent[own]).for_each(|(r, &p)| next.b[p as usize] += r);
            if let Some(among) = among {
                self.joined.sum(among, &mut next.b, |sum, b| *sum += b);
            }
            self.cycle(l + 1, None);
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            let (level, next, factor) = (&mut fine[l], &coarse[0], over_correction(l));
            // Those of other ranks, shown before, as well: they stay as their owners have them.
            level.x.iter_mut().zip(&level.parent).for_each(|(x, &p)| *x += factor * next.x[p as usize]);
            level.smooth();
        }
        self.joined.show(among, &mut self.levels[l]);
    }

    /// t <- b - A x on the finest level, in f32.
    fn residual(&mut self, system: &System) {
        let (x, b, d, weight) = (&self.x, &self.b, &self.diagonal, &self.weight);
        (self.t.par_chunks_mut(CHUNK), system.state.par_chunks(CHUNK), &system.neighbours.chunks, weight)
            .into_par_iter()
            .enumerate()
            .filter(|(_, (.., chunk, _))| !chunk.is_dry())
            .for_each(|(c, (t, state, chunk, w))| {
                for (k, (t, &state)) in t.iter_mut().zip(state).enumerate() {
                    let i = c * CHUNK + k;
                    let (a, e) = (chunk.start[k] as usize, chunk.dummies[k] as usize);
                    let row = b[i] - d[i] * x[i] + gather(&chunk.neighbour[a..e], &w[a..e], x);
                    // Chosen afterwards, as in the operator.
                    *t = if state == State::Inner { row } else { 0.0 };
                }
            });
    }
}

impl Precondition for Multigrid {
    fn apply(&mut self, system: &System, r: &[f64], z: &mut [f64]) {
        let chunks = &system.neighbours.chunks;
        // Scaled to unit size: late residuals must not leave the range of f32.
        let largest = |(r, chunk): (&[f64], &Chunk)| {
            if chunk.is_dry() { 0.0 } else { r.iter().fold(0.0_f64, |m, r| m.max(r.abs())) }
        };
        let scale = (r.par_chunks(CHUNK), chunks).into_par_iter().map(largest).reduce(|| 0.0, f64::max);
        let scale = system.among.map_or(scale, |among| among.share.most(scale)).max(f64::MIN_POSITIVE);
        let (b, x, d) = (&mut self.b, &mut self.x, &self.diagonal);
        (b.par_chunks_mut(CHUNK), x.par_chunks_mut(CHUNK), d.par_chunks(CHUNK), r.par_chunks(CHUNK), chunks)
            .into_par_iter()
            .filter(|(.., chunk)| !chunk.is_dry())
            .for_each(|(b, x, d, r, _)| {
                for k in 0..b.len() {
                    b[k] = (r[k] / scale) as f32;
                    x[k] = first_sweep(b[k], d[k]);
                }
            });
        if let Some(among) = system.among {
            among.share.swap(&mut [&mut &mut self.b[..]]);
            for i in among.share.copies() {
                let unknown = among.state[i] == State::Inner;
                self.x[i] = if unknown { first_sweep(self.b[i], self.diagonal[i]) } else { 0.0 };
            }
        }
        self.residual(system);
        {
            let (t, members, start) = (&self.t, &self.members, &self.member_start);
            let level = &mut self.levels[0];
            let b = &mut level.b[level.own.clone()];
            b.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(a, b)| {
                *b = members[start[a] as usize..start[a + 1] as usize].iter().map(|&i| t[i as usize]).sum();
            });
        }
        self.cycle(0, system.among);
        let coarse = &self.levels[0].x;
        (self.x.par_chunks_mut(CHUNK), self.aggregate.par_chunks(CHUNK), chunks)
            .into_par_iter()
            .filter(|(.., chunk)| !chunk.is_dry())
            .for_each(|(x, aggregate, _)| {
                for (x, &a) in x.iter_mut().zip(aggregate) {
                    if a != u32::MAX {
                        *x += OVER_CORRECTION * coarse[a as usize];
                    }
                }
            });
        if let Some(among) = system.among {
            // As their owners do it; their chunks may be dry here.
            for i in among.share.copies() {
                let a = self.aggregate[i];
                let correction = if a == u32::MAX { 0.0 } else { OVER_CORRECTION * coarse[a as usize] };
                let unknown = among.state[i] == State::Inner;
                self.x[i] = if unknown { first_sweep(self.b[i], self.diagonal[i]) + correction } else { 0.0 };
            }
        }
        self.residual(system);
        let (x, t, d) = (&self.x, &self.t, &self.diagonal);
        (z.par_chunks_mut(CHUNK), x.par_chunks(CHUNK), t.par_chunks(CHUNK), d.par_chunks(CHUNK), chunks)
            .into_par_iter()
            .filter(|(.., chunk)| !chunk.is_dry())
            .for_each(|(z, x, t, d, _)| {
                for k in 0..z.len() {
                    z[k] = scale * f64::from(sweep(x[k], t[k], d[k]));
                }
            });
    }
}
