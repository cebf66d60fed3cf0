//! Force of the fluid on a moving solid: pressure times area over its wall layer, plus the reaction of
//! viscosity and collisions.
//! GPU twin: shaders/body_force.wgsl

use crate::params::Params;
use crate::scheme::Source;
use glam::DVec3;

/// Pressure on the true surface of the solid [Pa], `head` above that of a wall-layer particle, whose centre lies half a
/// spacing inside. Particles that are no unknown feel no pressure.
#[inline(always)]
pub fn surface_pressure(pressure: f64, unknown: bool, head: f64) -> f64 {
    if unknown { (pressure + head).max(0.0) } else { 0.0 }
}

/// Pressure on the true surface over `pressure` [Pa], that of a wall-layer particle, which lies `to_surface` inside
/// (world axes [m]): rho (g - a) . to_surface. The weight of the water that would lie between presses too, and so does its
/// inertia where the surface accelerates with a = `acceleration` [m/s2]; the scheme that solves for the number density leaves that out.
/// Inertia takes or gives no more than there is: water does not pull.
#[inline(always)]
pub fn head(pressure: f64, to_surface: DVec3, acceleration: DVec3, params: &Params) -> f64 {
    let inertia = match params.source {
        Source::NumberDensity => 0.0,
        Source::Mixed => params.density * acceleration.dot(to_surface),
    };
    let most = pressure.max(0.0);
    params.density * params.gravity.dot(to_surface) + missing_head(params) - inertia.clamp(-most, most)
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
