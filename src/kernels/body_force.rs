//! Force of the fluid on a moving solid: pressure times area over its wall layer, plus the reaction of
//! viscosity and collisions.
//! GPU twin: shaders/body_force.wgsl

use crate::params::Params;
use glam::DVec3;

/// Pressure on the true surface of the solid [Pa]. A wall-layer particle's centre lies half a spacing inside the surface
/// (`to_surface`, world axes [m]). Particles that are no unknown feel no pressure.
#[inline(always)]
pub fn surface_pressure(pressure: f64, unknown: bool, to_surface: DVec3, params: &Params) -> f64 {
    if unknown { (pressure + head(to_surface, params)).max(0.0) } else { 0.0 }
}

/// Pressure on the true surface over that of a wall-layer particle [Pa].
#[inline(always)]
pub fn head(to_surface: DVec3, params: &Params) -> f64 {
    params.density * params.gravity.dot(to_surface) + missing_head(params)
}

/// What the pressure lacks at the water's surface [Pa].
pub fn missing_head(params: &Params) -> f64 {
    params.density * params.gravity.length() * params.zero_pressure_depth()
}

/// Force of one wall-layer particle [N]: -P A + reaction, with `area` in world axes [m2].
#[inline(always)]
pub fn body_force(surface_pressure: f64, area: DVec3, reaction: DVec3) -> DVec3 {
    reaction - surface_pressure * area
}
