//! The switches of the fluid's scheme, as it is computed with.

use serde::{Deserialize, Serialize};

/// Source term of the pressure Poisson equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The paper's Eq. (8): deviation of the number density alone.
    NumberDensity,
    /// Divergence of the predicted velocity, corrected by the moment matrix, gamma times the deviation of a smooth
    /// density sum, and the weight of the water, which the pressure at rest balances on any arrangement.
    Mixed,
}

impl Source {
    /// Depth below the water's surface at which P = 0 holds [m], of particles `spacing` [m] apart. With the source of Eq. (8) that is at
    /// the centres of the surface particles. The balanced source carries the whole weight of the water, theirs too, which rests on a
    /// pressure half a spacing higher.
    pub fn zero_pressure_depth(self, spacing: f64) -> f64 {
        match self {
            Self::NumberDensity => 0.5 * spacing,
            Self::Mixed => 0.0,
        }
    }
}

/// Pressure gradient.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Gradient {
    /// The paper's Eq. (9): against the smallest pressure in the neighbourhood.
    Minimum,
    /// Below the surface exact for linear fields on any arrangement, by the inverse of the particle's moment matrix; against
    /// the smallest pressure only as far as that is not the weight's doing. A shift spaces the particles.
    Consistent,
}

/// Which particles lie on the free surface (P = 0).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum FreeSurface {
    /// The paper's: n < beta n0.
    Threshold,
    /// n < 0.8 beta n0, or n < beta n0 and the neighbours' centroid lies more than 0.2 l0 away.
    ThresholdOffset,
}

/// How pairs of particles that collide at once share their impulses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Collision {
    /// The paper's Eq. (18): each as if it were the only one.
    Single,
    /// A particle takes part in each of its pairs with a part of its mass.
    Shared,
}

/// Preconditioner of the conjugate gradients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preconditioner {
    /// The diagonal.
    Jacobi,
    /// Aggregation multigrid on background buckets.
    Multigrid,
}

impl Preconditioner {
    /// `jacobi` or `multigrid`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Jacobi => "jacobi",
            Self::Multigrid => "multigrid",
        }
    }
}
