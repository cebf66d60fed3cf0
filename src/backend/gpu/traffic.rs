//! What the kernels move, read off their bindings: every array that a kernel streams counts once, whole records
//! where it takes a part of each; gathers through the neighbour lists are taken as served by the caches.

use super::Gpu;
use super::hierarchy::Levels;
use crate::backend::traffic::{Solve, Traffic, Work, passes};
use crate::error::Result;
use crate::plan::Stage;

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
        let count = self.context.download::<u32>("neighbour_count", self.groups.pressure())?;
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
        let (followed, keys) = (if self.context.has("reaction") { s.moving_wall } else { 0 }, s.keys());
        // Position and velocity in and out, acceleration in and out.
        let update = f * 6 * 16;
        let viscous = self.stages.contains(&Stage::Viscosity);
        // The walls of which the fluid is near, and as many layers of dummies behind them.
        let walls = 16 * 3 * rows.used.saturating_sub(f);
        let lists = 4 * pairs;
        let stages = [
            (Stage::Viscosity, f * (3 * 16 + 4) + followed * (4 * 16 + 4) + 4 * rows.fluid_near),
            (Stage::Predict, if viscous { update } else { f * 4 * 16 }),
            (Stage::MoveSolids, 2 * s.moving * (3 * 16 + 16)),
            // Keys: counted, scanned in three kernels, searched. Particles: key, arrival and order; then moved and
            // copied back.
            (Stage::CellList, keys * 4 * 6 + (f + s.moving) * (32 + 8 + 16 + 12) + f * 4 * 36 + 4 * s.moving),
            (Stage::NeighbourList, p * (16 + 4) + lists + 4 * (keys + s.cells) + walls),
            (Stage::Collision, p.min(f + followed) * 4 + f * 16 + f * 3 * 16),
            (Stage::NumberDensity, p * (16 + 3 * 4) + lists + walls),
            (Stage::PressureSource, p * (4 + 8) + rows.used * (2 * 16 + 2 * 4) + lists + 2 * walls),
            (Stage::PressureGradient, f * (2 * 16 + 3 * 4) + lists * f / rows.used.max(1) + walls),
            (Stage::Correct, update),
            (Stage::BodyForce, s.moving_wall * (48 + 2 * 16 + 8)),
        ];
        let unknowns = self.unknowns()?;
        Ok(Traffic {
            pairs,
            rows: rows.used,
            slots: p,
            stages: stages.into_iter().filter(|(stage, _)| self.stages.contains(stage)).collect(),
            solve: self.solve_traffic(&rows, unknowns)?,
        })
    }

    fn unknowns(&mut self) -> Result<u64> {
        let equations = self.context.download::<[f32; 2]>("source_diagonal", self.groups.pressure())?;
        Ok(equations.iter().filter(|e| e[1] > 0.0).count() as u64)
    }

    fn solve_traffic(&mut self, rows: &Rows, unknowns: u64) -> Result<Solve> {
        let (p, u) = (self.sizes.pressure, unknowns);
        let work = |bytes, dispatches| Work { bytes, dispatches };
        // Rows of the unknowns; z lies next to the positions, in one record.
        let lists = 4 * rows.near * u / rows.used.max(1) + 4 * u;
        let equation = 8 * p;
        let residual = equation + lists + 16 * u + 4 * p;
        let pack = 8 * p + 4 * 2 * p + 16 * 2 * p;
        let start = equation + u * (4 + 2 * 16);
        let ends = work(pack + 2 * residual + start + p * (4 + 2 * 16) + 2 * 4 * p, 6);
        let multiply = equation + lists + u * (16 + 2 * 8);
        let advance = equation + u * (8 + 2 * 4 + 2 * 4 + 2 * 16);
        let mut out = Solve { ends, iteration: work(multiply + advance, 2), ..Solve::default() };
        if let Some(levels) = self.levels.clone() {
            out.build = work(self.build_bytes(&levels, rows, u)?, levels.build().len() as u64);
            let cycle = levels.cycle(1).len() as u64 + 2;
            let descend = equation + lists + u * (16 + 2 * 4);
            let ascend = equation + lists + u * (16 + 4 + 2 * 16);
            let spread = p * (16 + 8 + 16);
            out.cycle = work(descend + ascend + spread + self.levels_bytes(&levels, u)?, cycle);
        }
        Ok(out)
    }

    /// Rows of each level, finest first.
    fn level_rows(&mut self, levels: &Levels) -> Result<Vec<u64>> {
        let (capacity, count) = (levels.capacity as usize, levels.count.len());
        let first = self.context.download_parts::<[u32; 4]>("row_cell", &[(capacity, count + 1)])?;
        Ok(first.windows(2).map(|w| u64::from(w[0][0].saturating_sub(w[1][0]))).collect())
    }

    /// Between the sweeps over the particles.
    fn levels_bytes(&mut self, levels: &Levels, unknowns: u64) -> Result<u64> {
        let rows = self.level_rows(levels)?;
        // Residuals of the members onto the finest level.
        let gather = rows[0] * (16 + 8 + 8) + unknowns * (8 + 4);
        // A pass reads a stencil of columns and values, x, b and the cell of a row, and writes x or y.
        let pass = 27 * 8 + 4 + 4 + 16 + 4;
        let pass = |(l, &rows): (usize, &u64)| passes(l, levels.count.len()) * rows * pass;
        Ok(gather + rows.iter().enumerate().map(pass).sum::<u64>())
    }

    fn build_bytes(&mut self, levels: &Levels, list: &Rows, unknowns: u64) -> Result<u64> {
        let rows = self.level_rows(levels)?;
        let (p, all) = (self.sizes.pressure, levels.cells);
        // Starts of the cells. Numbers of what never moves lie in records of 16; those near fluid are read.
        let walls = 16 * 3 * list.used.saturating_sub(self.sizes.fluid) + 4 * self.sizes.moving;
        let starts = 4 * (self.sizes.keys() + self.sizes.cells);
        let clear = 4 * all + 8 * p;
        let mark = starts + walls + 8 * unknowns + 4 * all;
        let scan = all * (4 + 8) + all * (4 + 8 + 8) + 16 * rows.iter().sum::<u64>();
        let members = 8 * self.sizes.cells + walls + unknowns * (8 + 8 + 8);
        let lists = 4 * list.near * unknowns / list.used.max(1) + 4 * unknowns;
        let galerkin = lists + unknowns * (8 + 16 + 8) + rows[0] * (16 + 27 * 8);
        // The finer level's stencils and the parents of its columns are read, own ones are written.
        let coarsen = rows.windows(2).map(|w| w[0] * (27 * 8 + 8 + 16) + w[1] * (16 + 27 * 8)).sum::<u64>();
        Ok(clear + mark + scan + members + galerkin + coarsen)
    }
}
