//! Absorber: v = v / (1 + dt sigma(r)), the implicit step of dv/dt = -sigma v, with sigma = rate s^2 in each zone that holds
//! the particle, or an image of it; s runs from 0 where waves come in to 1 at the far end.
//! GPU twin: shaders/absorber.wgsl

use crate::params::{Params, Zone};
use glam::DVec3;

/// sigma at `x` [1/s].
#[inline(always)]
pub fn rate(x: DVec3, params: &Params) -> f64 {
    let of = |zone: &Zone| {
        let x = params.periodic.image_from(zone.low, x);
        let inside = x.cmpge(zone.low).all() && x.cmple(zone.high).all();
        let s = (zone.ramp.dot(x - zone.start)).clamp(0.0, 1.0);
        if inside { zone.rate * s * s } else { 0.0 }
    };
    params.absorbers.iter().map(of).sum()
}

/// Velocity after a step of `dt` [s].
#[inline(always)]
pub fn absorber(x: DVec3, v: DVec3, params: &Params, dt: f64) -> DVec3 {
    v / (1.0 + dt * rate(x, params))
}
