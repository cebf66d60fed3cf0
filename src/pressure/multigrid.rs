//! Aggregation multigrid as preconditioner of the PPE, rebuilt every step: levels as
//! [`crate::kernels::multigrid_levels`] says, the cycle as [`crate::kernels::multigrid`] does, here in
//! compressed rows. It is computed in f32: it need only be an approximation, and half the bytes move.
//! Here is what it has of the particles and their cells; `hierarchy` has the cycle, `shared` what ranks do together.

mod hierarchy;
mod level;
mod shared;
#[cfg(test)]
mod tests;

use self::hierarchy::Hierarchy;
use self::level::{Level, NONE, Scratch, compress, gather};
use self::shared::meet;
use super::cg::{Among, Precondition, System};
use crate::cells::Grid;
use crate::fields::State;
use crate::kernels::multigrid::{OVER_CORRECTION, first_sweep, sweep};
use crate::kernels::multigrid_levels::{LevelSums, place_of, step};
use crate::neighbours::{CHUNK, Chunk};
use crate::share::Side;
use glam::DVec3;
use rayon::prelude::*;

/// The hierarchy; buffers are kept between steps.
#[derive(Default, Debug)]
pub struct Multigrid {
    /// Row of the first coarse level that each slot belongs to, [`NONE`] where there is no unknown.
    aggregate: Vec<u32>,
    /// Cell of each slot as 9 x + 3 y + z, [`NOWHERE`] where there is no unknown: the difference of two of them
    /// is the entry in the stencil.
    code: Vec<i32>,
    members: Vec<u32>,
    member_start: Vec<u32>,
    /// Row of each cell; on one of many ranks, of those from the first to the last that it has.
    cell_aggregate: Vec<u32>,
    touched: Vec<u32>,
    weight: Vec<Vec<f32>>,
    diagonal: Vec<f32>,
    x: Vec<f32>,
    b: Vec<f32>,
    t: Vec<f32>,
    coarse: Hierarchy,
    /// Norm of the residual that comes next, where it is known.
    expected: Option<f64>,
}

/// Marks a slot without an unknown.
const NOWHERE: i32 = i32::MIN;

impl Multigrid {
    /// Rebuild for `system` with particles at `position`.
    pub fn build(&mut self, system: &System, grid: &Grid, position: &[DVec3]) {
        let share = system.among.map(|among| among.share);
        self.coarse.begin(grid, share);
        self.aggregate_cells(system, grid, position);
        self.first_level(system);
        self.coarse.coarsen(share);
    }

    /// Unknowns of each level that are here, finest first.
    pub fn sizes(&self) -> Vec<usize> {
        std::iter::once(self.members.len()).chain(self.coarse.used().iter().map(|l| l.own)).collect()
    }

    /// Rows and entries beside the diagonal of each coarse level that are here, finest first.
    pub fn stored(&self) -> Vec<[u64; 2]> {
        self.coarse.used().iter().map(|l| [l.own as u64, l.value.len() as u64]).collect()
    }

    /// Sums over the operators of the levels, finest first.
    pub fn sums(&self) -> Vec<LevelSums> {
        let sums = |level: &Level| {
            let mut out = LevelSums { rows: level.own, ..Default::default() };
            level.diagonal.iter().for_each(|&v| out.add(f64::from(v), true));
            level.value.iter().for_each(|&v| out.add(f64::from(v), false));
            out
        };
        self.coarse.used().iter().map(sums).collect()
    }

    fn aggregate_cells(&mut self, system: &System, grid: &Grid, position: &[DVec3]) {
        let n = system.state.len();
        self.aggregate.resize(n, NONE);
        self.code.resize(n, NOWHERE);
        for v in [&mut self.diagonal, &mut self.x, &mut self.b, &mut self.t] {
            v.resize(n, 0.0);
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
        let (first, cells) = match system.among {
            Some(_) => self.cells_here(),
            None => (0, grid.total()),
        };
        self.cell_aggregate.resize(cells, NONE);
        let level = &mut self.coarse.levels[0];
        level.coordinates.clear();
        self.touched.clear();
        self.member_start.clear();
        for (aggregate, code) in self.aggregate.iter_mut().zip(&self.code) {
            if *code == NOWHERE {
                *aggregate = NONE;
                continue;
            }
            let joined = &mut self.cell_aggregate[(*aggregate - first) as usize];
            if *joined == NONE {
                *joined = self.touched.len() as u32;
                self.touched.push(*aggregate - first);
                level.coordinates.push(grid.coordinates_of(*aggregate as usize).map(|k| k as i32));
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
        let cursor = &mut self.coarse.scratch.cursor;
        cursor.clone_from(&self.member_start);
        for (i, &a) in self.aggregate.iter().enumerate() {
            if a != NONE {
                self.members[cursor[a as usize] as usize] = i as u32;
                cursor[a as usize] += 1;
            }
        }
        level.own = self.touched.len();
        for &c in &self.touched {
            self.cell_aggregate[c as usize] = NONE;
        }
        if let Some(among) = system.among {
            self.meet_ranks(among, grid, position);
        }
    }

    /// The first cell with an unknown that this rank has, and how many there are up to the last one: dry columns at the
    /// ends of a slab take no room.
    fn cells_here(&self) -> (u32, usize) {
        let unknown = self.aggregate.iter().zip(&self.code).filter(|(_, code)| **code != NOWHERE);
        let range = unknown.map(|(&cell, _)| (cell, cell)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        range.map_or((0, 0), |(first, last)| (first, (last - first) as usize + 1))
    }

    /// Finds the rows of the copies, which are other ranks'.
    fn meet_ranks(&mut self, among: Among, grid: &Grid, position: &[DVec3]) {
        let share = among.share;
        let Some(columns) = self.coarse.columns().cloned() else { return };
        let Hierarchy { levels, scratch: Scratch { numbers, .. }, .. } = &mut self.coarse;
        meet(&mut levels[0], share, &columns);
        share.swap(&mut [&mut &mut self.diagonal[..]]);
        let beyond = [columns.mine().start - 1, columns.mine().end];
        for (side, x) in share.sides().iter().zip(beyond) {
            numbers.fit([[x, 0, 0], [x, grid.count[1] as i32 - 1, grid.count[2] as i32 - 1]]);
            let rows = levels[0].coordinates.iter().enumerate().skip(levels[0].own);
            rows.filter(|(_, c)| c[0] == x).for_each(|(row, &c)| *numbers.of(c) = row as u32);
            for i in side.iter().flat_map(Side::taken) {
                if among.state[i] != State::Inner {
                    // Its owner may have it among dry walls, where diagonals are not kept; here sweeps may pass it.
                    self.diagonal[i] = 1.0;
                    continue;
                }
                let [_, y, z] = grid.coordinates(position[i]).map(|k| k as i32);
                self.code[i] = place_of([x, y, z]);
                self.aggregate[i] = *numbers.of([x, y, z]);
            }
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
        let Hierarchy { levels, scratch, .. } = &mut self.coarse;
        let level = &mut levels[0];
        let (rows, cells, around) = (level.own, &level.coordinates, level.around);
        let seams = around != [0; 3];
        scratch.stencils(rows).par_iter_mut().enumerate().with_min_len(64).for_each(|(a, s)| {
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
                            place_of(step(cells[a], cells[aggregate[j] as usize], around)) + 13
                        } else {
                            codes[j] - own
                        };
                        turns[k % 2][entry as usize] -= c * w;
                    }
                }
            }
            *s = std::array::from_fn(|k| turns[0][k] + turns[1][k]);
        });
        compress(level, scratch);
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
    fn expect(&mut self, norm: f64) {
        self.expected = Some(norm);
    }

    fn apply(&mut self, system: &System, r: &[f64], z: &mut [f64]) {
        let chunks = &system.neighbours.chunks;
        // Scaled to unit size: late residuals must not leave the range of f32.
        let largest = |(r, chunk): (&[f64], &Chunk)| {
            if chunk.is_dry() { 0.0 } else { r.iter().fold(0.0_f64, |m, r| m.max(r.abs())) }
        };
        let scale = (r.par_chunks(CHUNK), chunks).into_par_iter().map(largest).reduce(|| 0.0, f64::max);
        let scale = self.expected.take().unwrap_or(scale).max(f64::MIN_POSITIVE);
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
            let level = &mut self.coarse.levels[0];
            level.b[..level.own].par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(a, b)| {
                *b = members[start[a] as usize..start[a + 1] as usize].iter().map(|&i| t[i as usize]).sum();
            });
        }
        self.coarse.cycle(0, system.among.map(|among| among.share));
        let coarse = &self.coarse.levels[0].x;
        (self.x.par_chunks_mut(CHUNK), self.aggregate.par_chunks(CHUNK), chunks)
            .into_par_iter()
            .filter(|(.., chunk)| !chunk.is_dry())
            .for_each(|(x, aggregate, _)| {
                for (x, &a) in x.iter_mut().zip(aggregate) {
                    if a != NONE {
                        *x += OVER_CORRECTION * coarse[a as usize];
                    }
                }
            });
        if let Some(among) = system.among {
            // As their owners do it; their chunks may be dry here.
            for i in among.share.copies() {
                let a = self.aggregate[i];
                let correction = if a == NONE { 0.0 } else { OVER_CORRECTION * coarse[a as usize] };
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
