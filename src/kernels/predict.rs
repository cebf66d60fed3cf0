//! Explicit part of the step: v* = v + dt (g + nu lap v), r* = r + dt v*; Eq. (2) without pressure.
//! GPU twin: shaders/predict.wgsl

use glam::DVec3;

/// Longest way of a particle in one step, over l0. A particle that is faster keeps its velocity but moves
/// only so far (and is counted): it would jump through the walls' layers otherwise.
pub const DISPLACEMENT_MAX: f64 = 0.5;

/// Velocity, position and whether the displacement was clamped.
#[inline(always)]
pub fn predict(x: DVec3, v: DVec3, acceleration: DVec3, dt: f64, spacing: f64) -> (DVec3, DVec3, bool) {
    let v = v + dt * acceleration;
    let (way, clamped) = clamp_length(dt * v, DISPLACEMENT_MAX * spacing);
    (x + way, v, clamped)
}

/// `a`, shortened to `longest` if need be.
#[inline(always)]
pub fn clamp_length(a: DVec3, longest: f64) -> (DVec3, bool) {
    let l2 = a.length_squared();
    if l2 > longest * longest { (a * (longest / l2.sqrt()), true) } else { (a, false) }
}
