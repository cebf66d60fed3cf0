//! The bytes that each stage must move at the least: the memory floor that a measured time is held against.
//!
//! Counted are the arrays that a stage streams, each once; gathers through the neighbour lists are taken as
//! served by the caches, which the order of the particles makes nearly true.

use crate::plan::Stage;
use crate::pressure::PressureReport;

/// Sizes of a problem in a backend.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    /// Slots that carry pressure: the length of the solver's vectors.
    pub pressure: u64,
    /// Bytes of a number: 8 in f64, 4 in f32.
    pub number: u64,
    /// Bytes of a vector: 24 in f64, 16 in f32 (padded).
    pub vector: u64,
    /// Bytes of a stored weight: 8 where weights are kept, 0 where they are made afresh.
    pub weight: u64,
    /// Bytes of a weight in the multigrid preconditioner, if that runs.
    pub preconditioner_weight: Option<u64>,
}

impl Sizes {
    /// Bytes that `stage` must move in one step with a solve as in `solve`.
    pub fn bytes(&self, stage: Stage, solve: &PressureReport) -> u64 {
        let Self { fluid, rows, cells, pairs, pressure_pairs, pressure, number, vector, weight, .. } = *self;
        let update = fluid * 5 * vector; // position and velocity in and out, acceleration in
        match stage {
            Stage::Viscosity => pressure_pairs * 4 + rows * 2 * vector + fluid * vector,
            Stage::Predict | Stage::Correct => update,
            Stage::MoveSolids | Stage::BodyForce | Stage::Contact => 0,
            Stage::CellList => fluid * 2 * (2 * vector + number + 5) + cells * 8,
            Stage::NeighbourList => rows * vector + pairs * 4,
            Stage::Collision => rows + update,
            Stage::NumberDensity => pairs * (4 + weight) + rows * (vector + number + 1),
            Stage::PressureSource => pairs * (4 + weight) + rows * (2 * vector + 3 * number),
            Stage::ConjugateGradient => {
                let iterations = u64::from(solve.iterations);
                let operator = pressure_pairs * (4 + weight) + pressure * 3 * number;
                let vectors = pressure * 9 * number;
                let cycle = if let Some(weight) = self.preconditioner_weight {
                    // Two passes over the finest level's rows; coarse levels are a tenth of that.
                    2 * (pressure_pairs * (4 + weight) + pressure * 4 * 4)
                } else {
                    pressure * 3 * number
                };
                (iterations + 1) * operator + iterations * (vectors + cycle)
            }
            Stage::PressureGradient => pairs * (4 + weight) + rows * (vector + number) + fluid * vector,
        }
    }
}
