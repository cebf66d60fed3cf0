//! What the kernels move, read off their bindings: every array that a kernel streams counts once, whole records
//! where it takes a part of each; gathers through the neighbour lists are taken as served by the caches.

use super::hierarchy::Levels;
use super::{Gpu, buffers};
use crate::backend::traffic::{Solve, Traffic, Work, passes};
use crate::error::Result;
use crate::plan::{Arrays, Stage};

/// Sums over the neighbour lists as they are.
#[derive(Clone, Copy, Debug, Default)]
struct Rows {
    used: u64,
    near: u64,
    dummies: u64,
    /// Of the fluid alone.
    fluid_near: u64,
}

impl Gpu {
    fn rows(&mut self) -> Result<Rows> {
        let count = self.context.download(buffers::neighbour_count, self.groups.pressure())?;
        let mut rows = Rows::default();
        for (i, c) in count.into_iter().enumerate() {
            let near = u64::from(c & 0xfff);
            rows.used += u64::from(near > 0);
            rows.near += near;
            rows.dummies += u64::from(c >> 12 & 0xfff);
            rows.fluid_near += if i < self.groups.fluid { near } else { 0 };
        }
        Ok(rows)
    }

    pub(super) fn count_traffic(&mut self) -> Result<Traffic> {
        let rows = self.rows()?;
        let s = self.sizes;
        let (pairs, p, f) = (rows.near + rows.dummies, s.pressure, s.fluid);
        let (followed, keys) = (s.reacting, s.keys());
        // A vector, a number, an index into a list.
        let (v, n, k) = (buffers::position.size(), buffers::pressure.size(), buffers::neighbour_list.size());
        // Position and velocity in and out, acceleration in and out.
        let update = f * 6 * v;
        // Position in, acceleration and perhaps the imbalance out.
        let gradient = if self.plan.has(Stage::Shift) { 3 * v } else { 2 * v };
        let (viscous, stress) = (self.plan.has(Stage::Viscosity), self.params.surface_stress());
        // The walls of which the fluid is near, and as many layers of dummies behind them.
        let walls = 3 * v * rows.used.saturating_sub(f);
        let lists = k * pairs;
        let equation = buffers::source_diagonal.size();
        // What slots between solids bring a wall-layer particle.
        let slots = if self.plan.needs(Arrays::Coupling) { 4 * buffers::coupling.size() } else { 0 };
        let bytes = |stage| match stage {
            Stage::Viscosity => {
                let stress = if stress { lists * f / rows.used.max(1) } else { 0 };
                f * (3 * v + k) + followed * (4 * v + k) + k * rows.fluid_near + stress
            }
            Stage::Absorber => f * 3 * v,
            Stage::Openings => f * v,
            Stage::Predict => {
                if viscous {
                    update
                } else {
                    f * 4 * v
                }
            }
            Stage::MoveSolids => 2 * s.moving * 4 * v,
            // Keys: counted, scanned in three kernels, searched. Particles: key, arrival and order; then moved and
            // copied back.
            Stage::CellList => {
                keys * k * 6 + s.sorted() * (2 * v + 9 * k) + f * 4 * (2 * v + n) + k * s.moving
            }
            Stage::NeighbourList => p * (v + k) + lists + k * (keys + s.cells) + walls,
            Stage::WallFriction => (f + followed) * k + f * v + update,
            Stage::Collision => p.min(f + followed) * k + f * 4 * v,
            Stage::NumberDensity => p * (v + n + 2 * k) + lists + walls,
            Stage::SurfacePressure => p * (k + n),
            Stage::PressureSource => p * (k + equation) + rows.used * (2 * v + n + k) + lists + 2 * walls,
            Stage::PressureGradient => f * (gradient + n + 2 * k) + lists * f / rows.used.max(1) + walls,
            Stage::Correct => update,
            Stage::Shift => f * 4 * v,
            Stage::BodyForce => s.moving_wall * (buffers::wall_layer.size() + v + n + k + slots),
            Stage::ConjugateGradient | Stage::Contact => 0,
        };
        let unknowns = self.unknowns()?;
        let planned = Stage::ALL.into_iter().filter(|&stage| self.plan.has(stage));
        let stages = planned.map(|stage| (stage, bytes(stage))).collect();
        Ok(Traffic { pairs, rows: rows.used, slots: p, stages, solve: self.solve_traffic(&rows, unknowns)? })
    }

    fn unknowns(&mut self) -> Result<u64> {
        let equations = self.context.download(buffers::source_diagonal, self.groups.pressure())?;
        Ok(equations.iter().filter(|e| e[1] > 0.0).count() as u64)
    }

    fn solve_traffic(&mut self, rows: &Rows, unknowns: u64) -> Result<Solve> {
        let (slots, u) = (self.sizes.pressure, unknowns);
        let work = |bytes, dispatches| Work { bytes, dispatches };
        let respond = u64::from(!self.coupled.is_empty());
        let prepare = respond;
        // What presses on walls, before the solve and after it.
        let before = u64::from(self.plan.needs(Arrays::Coupling));
        let after = u64::from(self.plan.needs(Arrays::Excess));
        // z lies next to the positions, in one record.
        let (z, r, p) = (buffers::preconditioned.size(), buffers::residual.size(), buffers::pressure.size());
        let search = buffers::search.size();
        // Rows of the unknowns.
        let k = buffers::neighbour_list.size();
        let lists = k * rows.near * u / rows.used.max(1) + k * u;
        let equation = buffers::source_diagonal.size() * slots;
        let residual = equation + lists + z * u + r * slots;
        let pack = equation + 2 * p * slots + 2 * z * slots;
        let start = equation + u * (r + 2 * z);
        let ends = work(
            pack + 2 * residual + start + slots * (p + 2 * z) + 2 * p * slots,
            6 + prepare + 2 * respond + before + after,
        );
        // Rows of the bodies: read by `respond` beside the z there, and by `multiply`.
        let coupled = respond * self.sizes.moving_wall * (4 * buffers::coupling.size() + z);
        let multiply = equation + lists + u * (z + 2 * search);
        let advance = equation + u * (search + 2 * p + 2 * r + 2 * z);
        let mut ends = ends;
        let walls = (self.groups.pressure() - self.groups.fluid) as u64;
        let excess = before * self.sizes.moving_wall
            + after * {
                let moving = self.sizes.moving_wall as usize;
                self.plan.excess.rows(walls as usize, moving) as u64
            };
        let row = buffers::position.size() + buffers::source_diagonal.size() + k + p + buffers::excess.size();
        ends.bytes += excess * row + k * rows.near * excess / rows.used.max(1);
        if self.params.filled {
            // The right side is read and read and written, so is the pressure, each time beside the state.
            ends.bytes += slots * (4 * buffers::state.size() + 3 * buffers::source_diagonal.size() + 3 * p);
            ends.dispatches += 4;
        }
        let mut out =
            Solve { ends, iteration: work(multiply + advance + coupled, 2 + respond), ..Solve::default() };
        if let Some(levels) = self.levels.clone() {
            out.build = work(self.build_bytes(&levels, rows, u)?, levels.build().len() as u64);
            let cycle = levels.cycle(1).len() as u64 + 2;
            let descend = equation + lists + u * (z + r + buffers::smoothed.size());
            let ascend = equation + lists + u * (buffers::corrected.size() + r + 2 * z);
            let spread = slots * (z + buffers::aggregate.size() + buffers::corrected.size());
            out.cycle = work(descend + ascend + spread + self.levels_bytes(&levels, u)?, cycle);
        }
        Ok(out)
    }

    /// Rows of each level, finest first.
    fn level_rows(&mut self, levels: &Levels) -> Result<Vec<u64>> {
        let (capacity, count) = (levels.capacity as usize, levels.count.len());
        let first = self.context.download_parts(buffers::row_cell, &[(capacity, count + 1)])?;
        Ok(first.windows(2).map(|w| u64::from(w[0][0].saturating_sub(w[1][0]))).collect())
    }

    /// Between the sweeps over the particles.
    fn levels_bytes(&mut self, levels: &Levels, unknowns: u64) -> Result<u64> {
        let rows = self.level_rows(levels)?;
        // Residuals of the members onto the finest level.
        let (x, entry) = (buffers::coarse.size(), buffers::entry.size());
        let (cell, member) = (buffers::row_cell.size(), buffers::member.size());
        let starts = buffers::cell_row.size();
        let gather = rows[0] * (cell + starts + 2 * x) + unknowns * (member + buffers::smoothed.size());
        // A pass reads a stencil of columns and values, x, b and the cell of a row, and writes x or y.
        let pass = 27 * entry + cell + 3 * x;
        let pass = |(l, &rows): (usize, &u64)| passes(l, levels.count.len()) * rows * pass;
        Ok(gather + rows.iter().enumerate().map(pass).sum::<u64>())
    }

    fn build_bytes(&mut self, levels: &Levels, list: &Rows, unknowns: u64) -> Result<u64> {
        let rows = self.level_rows(levels)?;
        let (slots, all) = (self.sizes.pressure, levels.cells);
        let (v, k) = (buffers::position.size(), buffers::neighbour_list.size());
        let (cell, entry, member) = (buffers::row_cell.size(), buffers::entry.size(), buffers::member.size());
        let (row, equation) = (buffers::cell_row.size(), buffers::source_diagonal.size());
        let aggregate = buffers::aggregate.size();
        // Starts of the cells. Numbers of what never moves lie in records of 16; those near fluid are read.
        let walls = 3 * v * list.used.saturating_sub(self.sizes.fluid) + k * self.sizes.moving;
        let starts = k * (self.sizes.keys() + self.sizes.cells);
        let clear = k * all + aggregate * slots;
        let mark = starts + walls + equation * unknowns + k * all;
        let scan = all * (k + row) + all * (k + 2 * row) + cell * rows.iter().sum::<u64>();
        let members = row * self.sizes.cells + walls + unknowns * (equation + member + aggregate);
        let lists = k * list.near * unknowns / list.used.max(1) + k * unknowns;
        let galerkin = lists + unknowns * (member + v + aggregate) + rows[0] * (cell + 27 * entry);
        // The finer level's stencils and the parents of its columns are read, own ones are written.
        let coarsen = rows
            .windows(2)
            .map(|w| w[0] * (27 * entry + row + cell) + w[1] * (cell + 27 * entry))
            .sum::<u64>();
        Ok(clear + mark + scan + members + galerkin + coarsen)
    }
}
