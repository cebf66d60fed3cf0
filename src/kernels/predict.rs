//! Explicit part of the step: v* = v + dt (g + nu lap v), Eq. (2) without pressure, and the way with it to r*, where the other forces
//! are found: r* = r + dt v* in the paper's scheme and where there is no free surface, else r + dt v* / 2.
//! GPU twin: shaders/predict.wgsl

use crate::params::Step;
use glam::DVec3;

/// Longest way of a particle in one step, over l0. A particle that is faster keeps its velocity but moves
/// only so far (and is counted): it would jump through the walls' layers otherwise.
pub const DISPLACEMENT_MAX: f64 = 0.5;

/// Velocity, position and whether the displacement was clamped.
#[inline(always)]
pub fn predict(x: DVec3, v: DVec3, acceleration: DVec3, step: &Step, spacing: f64) -> (DVec3, DVec3, bool) {
    let v = v + step.dt * acceleration;
    let (way, clamped) = drift(v, step.ahead, step.dt, spacing);
    (x + way, v, clamped)
}

/// Way of a particle of velocity `v` in the part `time` [s] of a step of `dt` [s], and whether it was clamped.
#[inline(always)]
pub fn drift(v: DVec3, time: f64, dt: f64, spacing: f64) -> (DVec3, bool) {
    clamp_length(time * v, DISPLACEMENT_MAX * spacing * (time / dt))
}

/// `a`, shortened to `longest` if need be.
#[inline(always)]
pub fn clamp_length(a: DVec3, longest: f64) -> (DVec3, bool) {
    let l2 = a.length_squared();
    if l2 > longest * longest { (a * (longest / l2.sqrt()), true) } else { (a, false) }
}
