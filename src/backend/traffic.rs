//! The bytes that each stage must move at the least: the memory floor that a measured time is held against.
//!
//! Counted are the arrays that a stage streams, each once; gathers through the neighbour lists are taken as
//! served by the caches, which the order of the particles makes nearly true.

use crate::plan::Stage;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::{Add, Mul};

/// Work of a part of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Work {
    /// Bytes that must move.
    pub bytes: u64,
    /// Kernels started on a device; 0 without one.
    pub dispatches: u64,
}

impl Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { bytes: self.bytes + other.bytes, dispatches: self.dispatches + other.dispatches }
    }
}

impl Mul<u64> for Work {
    type Output = Self;

    fn mul(self, times: u64) -> Self {
        Self { bytes: self.bytes * times, dispatches: self.dispatches * times }
    }
}

/// Work of the PPE's solver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Solve {
    /// Once a solve: first and last residual.
    pub ends: Work,
    /// Once a solve: the levels of multigrid, all of them.
    pub build: Work,
    /// Every iteration: the conjugate gradients.
    pub iteration: Work,
    /// Every iteration: the preconditioner, coarse levels included.
    pub cycle: Work,
}

/// What a step moves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Traffic {
    /// Neighbours listed.
    pub pairs: u64,
    /// Rows of the neighbour lists that are in use.
    pub rows: u64,
    /// Slots that carry pressure: the length of the solver's vectors.
    pub slots: u64,
    /// Bytes of each stage but the solver.
    pub stages: BTreeMap<Stage, u64>,
    /// The solver.
    pub solve: Solve,
}

impl Traffic {
    /// Bytes that `stage` must move in one step, with `iterations` of the solver.
    pub fn bytes(&self, stage: Stage, iterations: f64) -> u64 {
        if stage != Stage::ConjugateGradient {
            return self.stages.get(&stage).copied().unwrap_or(0);
        }
        let Solve { ends, build, iteration, cycle } = self.solve;
        ends.bytes + build.bytes + (iterations * (iteration.bytes + cycle.bytes) as f64) as u64
    }
}

/// Sizes of a problem on the CPU.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sizes {
    /// Fluid particles.
    pub fluid: u64,
    /// Rows of the neighbour lists that are in use.
    pub rows: u64,
    /// Cells of the search grid.
    pub cells: u64,
    /// Neighbours listed.
    pub pairs: u64,
    /// Those of them that carry pressure.
    pub pressure_pairs: u64,
    /// Pairs that viscosity goes through.
    pub viscous_pairs: u64,
    /// Slots that carry pressure: the length of the solver's vectors.
    pub pressure: u64,
    /// Bytes of a number.
    pub number: u64,
    /// Bytes of a vector.
    pub vector: u64,
    /// Bytes of a stored weight.
    pub weight: u64,
    /// Bytes of a weight in the multigrid preconditioner, if that runs, and rows and entries beside the diagonal of
    /// its levels, finest first.
    pub multigrid: Option<(u64, Vec<[u64; 2]>)>,
}

impl Sizes {
    /// What a step moves.
    pub fn traffic(&self) -> Traffic {
        let Self { fluid, rows, cells, pairs, number, vector, weight, pressure, viscous_pairs, .. } = *self;
        let update = fluid * 5 * vector; // position and velocity in and out, acceleration in
        let bytes = |stage| match stage {
            Stage::Viscosity => viscous_pairs * 4 + rows * 2 * vector + fluid * vector,
            Stage::Absorber => fluid * 3 * vector,
            Stage::Openings => fluid * vector,
            Stage::Predict => update,
            Stage::CellList => fluid * 2 * (2 * vector + number + 5) + cells * 8,
            Stage::NeighbourList => rows * vector + pairs * 4,
            Stage::WallFriction => fluid * (4 + vector) + update,
            Stage::Collision => rows + update,
            Stage::NumberDensity => pairs * (4 + weight) + rows * (vector + number + 1),
            Stage::SurfacePressure => rows * (number + 1),
            Stage::PressureSource => pairs * (4 + weight) + rows * (2 * vector + 3 * number),
            Stage::PressureGradient => pairs * (4 + weight) + rows * (vector + number) + fluid * vector,
            Stage::Correct => update,
            Stage::Shift => fluid * 4 * vector,
            Stage::MoveSolids | Stage::BodyForce | Stage::ConjugateGradient | Stage::Contact => 0,
        };
        let stages = Stage::ALL.into_iter().map(|stage| (stage, bytes(stage))).collect();
        Traffic { pairs, rows, slots: pressure, stages, solve: self.solve() }
    }

    fn solve(&self) -> Solve {
        let Self { number, weight, pressure, pressure_pairs, .. } = *self;
        let work = |bytes| Work { bytes, dispatches: 0 };
        let operator = pressure_pairs * (4 + weight) + pressure * 3 * number;
        let (mut build, mut cycle) = (0, pressure * 3 * number);
        if let Some((weight, levels)) = &self.multigrid {
            // Two passes over the finest rows; down to and up from the first level.
            cycle = 2 * (pressure_pairs * (4 + weight) + pressure * 16) + pressure * 12;
            // Weights in f32; a pass over the rows, which adds to the stencils of the first level.
            build =
                pressure_pairs * (self.weight + weight) + pressure_pairs * (4 + self.weight) + pressure * 20;
            for (l, &[rows, entries]) in levels.iter().enumerate() {
                let level = entries * 8 + rows * 20;
                cycle += passes(l, levels.len()) * level;
                // Stencils of 27 numbers are summed up, then compressed; the next level reads them.
                build += 2 * 216 * rows + 2 * level;
            }
        }
        Solve {
            ends: work(operator),
            build: work(build),
            iteration: work(operator + pressure * 9 * number),
            cycle: work(cycle),
        }
    }
}

/// Passes of a cycle over the operator of level `l` of `levels`; see [`crate::kernels::multigrid`].
pub fn passes(l: usize, levels: usize) -> u64 {
    use crate::kernels::multigrid::{SWEEPS, visits};
    let times: usize = (0..l).map(visits).product();
    // Each visit to the next level has a pass before and after; between two visits lies a sweep.
    let own = if l + 1 == levels { SWEEPS - 1 } else { 3 * visits(l) - 1 };
    (times * own) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_of_a_cycle() {
        // Level 0: down, up, back, down, up; below it everything twice; 7 sweeps on the coarsest after that from zero.
        assert_eq!([0, 1, 2].map(|l| passes(l, 3)), [5, 4, 14]);
        assert_eq!(passes(0, 1), 7);
    }
}
