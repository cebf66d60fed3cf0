//! Force of the fluid on a moving solid: pressure times area over its wall layer, plus the reaction of
//! viscosity and collisions.
//! GPU twin: shaders/body_force.wgsl

use glam::DVec3;

/// Pressure on the true surface of the solid [Pa], with `weight` = rho g [N/m3]. Two heads are known to be
/// missing: a wall-layer particle's centre lies half a spacing inside the surface (`to_surface`, world axes [m]),
/// and P = 0 holds at the centres of the water's surface particles, half a spacing below the surface. Without
/// them a floating body would sink a whole spacing too deep. Particles that are no unknown feel no pressure.
#[inline(always)]
pub fn surface_pressure(pressure: f64, unknown: bool, to_surface: DVec3, weight: DVec3, spacing: f64) -> f64 {
    let head = weight.dot(to_surface) + 0.5 * spacing * weight.length();
    if unknown { (pressure + head).max(0.0) } else { 0.0 }
}

/// Force of one wall-layer particle [N]: -P A + reaction, with `area` in world axes [m2].
#[inline(always)]
pub fn body_force(surface_pressure: f64, area: DVec3, reaction: DVec3) -> DVec3 {
    reaction - surface_pressure * area
}
