//! Free bodies in the pressure equation. What the pressure does to a body in a step moves its wall, and the water that
//! the wall displaces is part of the divergence which the pressure must undo:
//!
//! (A + kappa S M^-1 S^T) P = b - kappa S M^-1 f,  kappa = rho l0^3,
//!
//! with M the body's mass and inertia, f what acts on it beside the pressure, over l0^3, and a row of S a wall-layer
//! particle: force and torque of one pascal on it, over l0^3. The pressure then finds the acceleration that it gives
//! the body together with that of the water, so that the water which a body drags along is no force of the last step.
//! GPU twin: shaders/coupling.wgsl

use crate::body::{FreeBody, Wrench};
use glam::DVec3;

/// Row of S, times l0^3: force [m2] and torque [m3] of one pascal on a wall-layer particle of outward `area` [m2] at
/// `arm` from the centre of mass [m], world axes.
#[inline(always)]
pub fn row(area: DVec3, arm: DVec3) -> Wrench {
    Wrench { force: -area, torque: -arm.cross(area) }
}

/// y = (rho / l0^3) M^-1 w of a wrench w; a row of kappa S M^-1 w is then [`product`] of the row and y.
#[inline(always)]
pub fn respond(body: &FreeBody, density_over_volume: f64, wrench: Wrench) -> Wrench {
    let (velocity, turn) = body.mobility.answer(&wrench);
    Wrench { force: density_over_volume * velocity, torque: density_over_volume * turn }
}

/// Row times y.
#[inline(always)]
pub fn product(row: &Wrench, y: &Wrench) -> f64 {
    row.force.dot(y.force) + row.torque.dot(y.torque)
}
