//! Correction: v = v* + dt a, r = r* + dt^2 a with a of the collision or of the pressure gradient.
//! GPU twin: shaders/correct.wgsl

use super::predict::{DISPLACEMENT_MAX, clamp_length};
use glam::DVec3;

/// Position, velocity and whether the change was clamped so that it moves the particle by no more than
/// [`DISPLACEMENT_MAX`] spacings.
#[inline(always)]
pub fn correct(x: DVec3, v: DVec3, acceleration: DVec3, dt: f64, spacing: f64) -> (DVec3, DVec3, bool) {
    let (change, clamped) = clamp_length(dt * acceleration, DISPLACEMENT_MAX * spacing / dt);
    (x + dt * change, v + change, clamped)
}
