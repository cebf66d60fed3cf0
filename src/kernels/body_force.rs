//! Force and torque of the fluid on a moving solid: pressure times area over its wall layer, plus the
//! reaction of viscosity and collisions.
//! GPU twin: shaders/body_force.wgsl

use glam::DVec3;

/// Force of one wall-layer particle [N]: -P A + reaction, with `area` in world axes [m2].
#[inline(always)]
pub fn body_force(pressure: f64, area: DVec3, reaction: DVec3) -> DVec3 {
    reaction - pressure * area
}
