//! The pressure Poisson equation, Eq. (8): a symmetric positive definite system over the neighbour lists.

pub mod cg;
mod cg_ranks;
pub mod coupling;
pub mod multigrid;

/// Why the conjugate gradients stopped.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The residual met the tolerance.
    #[default]
    Converged,
    /// The right side was zero, so the pressure is.
    ZeroSource,
    /// The iterations ran out; the last iterate was kept.
    MaxIterations,
    /// r.z or p.Ap was not positive, with the diagonal as preconditioner too: the matrix is singular or not definite;
    /// the last iterate was kept.
    Breakdown,
    /// A residual was not a number.
    NonFinite,
}

/// What a solve did.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct PressureReport {
    /// Unknowns.
    pub unknowns: usize,
    /// Iterations.
    pub iterations: u32,
    /// ||r|| / ||b|| at the end [-].
    pub residual: f64,
    /// Why it stopped.
    pub outcome: Outcome,
}

/// The finest tolerance that single precision keeps: the recursion of a device goes on below it, the true residual does not (study
/// `pressure-solve`: it stays at 3e-6 with 2,900 unknowns, at 2.4e-5 with 19,400).
pub const SINGLE: f64 = 3e-5;

/// When to stop, and how.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Settings {
    /// ||r|| / ||b|| at which to stop [-].
    pub tolerance: f64,
    /// Most iterations.
    pub max_iterations: u32,
    /// Start from the pressure of the last step.
    pub warm_start: bool,
}
