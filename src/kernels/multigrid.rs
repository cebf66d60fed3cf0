//! Cycle of the multigrid preconditioner.
//! GPU twin: shaders/multigrid.wgsl, and `descend` and `ascend` of shaders/conjugate_gradient.wgsl
//!
//! A V-cycle from the particles, one damped Jacobi sweep before and after; on level 0 a second visit to the
//! levels below (W), with two sweeps between. The coarsest level gets [`SWEEPS`] sweeps.
//!
//! Plain aggregation is too stiff, hence the over-correction. The preconditioner B stays symmetric and
//! positive definite: sweeps are the same before and after; an even number of them on the coarsest level, and
//! plain corrections above it, keep B <= A^-1 there; two visits to that with a factor below 2 do so too; and
//! a single visit, as from the particles, is positive with any factor.

/// Damping of the Jacobi sweeps; the largest eigenvalue of D^-1 A is 1.30 to 1.33 on particles and below 2
/// on every level.
pub const DAMPING: f32 = 0.9;
/// Factor on the corrections of the particles and of level 0.
pub const OVER_CORRECTION: f32 = 1.4;
/// Sweeps on the coarsest level, the one from zero included; even.
pub const SWEEPS: usize = 8;

/// Factor on the correction of level `level`.
pub fn over_correction(level: usize) -> f32 {
    if level == 0 { OVER_CORRECTION } else { 1.0 }
}

/// Visits of level `level` to the next coarser one.
pub fn visits(level: usize) -> usize {
    if level == 0 { 2 } else { 1 }
}

/// The first sweep, from zero.
#[inline(always)]
pub fn first_sweep(b: f32, diagonal: f32) -> f32 {
    DAMPING * b / diagonal
}

/// A further sweep, with the residual of `x`.
#[inline(always)]
pub fn sweep(x: f32, residual: f32, diagonal: f32) -> f32 {
    x + DAMPING * residual / diagonal
}
