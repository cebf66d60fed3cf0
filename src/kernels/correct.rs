//! Correction: v = v* + dt a with a of wall friction, of collisions or of the pressure gradient. Where r* is the end of the step it
//! moves the particle as well, r = r* + dt^2 a; where it is the middle, the second half is gone with the new velocity, r = r* + dt v / 2.
//! GPU twin: shaders/correct.wgsl

use super::predict::{DISPLACEMENT_MAX, clamp_length, drift};
use crate::params::Step;
use glam::DVec3;

/// Position, velocity and whether the change was clamped so that it moves the particle by no more than
/// [`DISPLACEMENT_MAX`] spacings.
#[inline(always)]
pub fn kick(x: DVec3, v: DVec3, acceleration: DVec3, step: &Step, spacing: f64) -> (DVec3, DVec3, bool) {
    let (change, clamped) = clamp_length(step.dt * acceleration, DISPLACEMENT_MAX * spacing / step.dt);
    (x + step.carried() * change, v + change, clamped)
}

/// The last [`kick`] of a step, and the rest of the way.
#[inline(always)]
pub fn correct(x: DVec3, v: DVec3, acceleration: DVec3, step: &Step, spacing: f64) -> (DVec3, DVec3, bool) {
    let (x, v, kicked) = kick(x, v, acceleration, step, spacing);
    let (way, clamped) = drift(v, step.rest(), step.dt, spacing);
    (x + way, v, kicked || clamped)
}
