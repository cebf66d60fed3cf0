//! Pressure gradient against the smallest pressure in the neighbourhood, Eq. (9), as an acceleration.
//! GPU twin: shaders/pressure_gradient.wgsl
//!
//! Where the source of the PPE is balanced ([`crate::scheme::Source::Mixed`]), gravity acts together with the pressure
//! that carries it, in this stage, and not in `predict`.

use super::Particles;
use crate::fields::State;
use crate::neighbourhood::{inverse, moment, pair_vector};
use crate::neighbours::Row;
use crate::params::Params;
use crate::scheme::{Gradient, Source};
use glam::DVec3;

/// Whether the gradient of a particle is multiplied by the inverse of its moment matrix.
#[inline(always)]
pub fn is_corrected(state: State, params: &Params) -> bool {
    params.gradient == Gradient::MinimumCorrected && state == State::Inner
}

/// Acceleration by a gradient of the pressure [m/s2], and by gravity where that acts in this stage.
#[inline(always)]
pub fn acceleration(gradient: DVec3, params: &Params) -> DVec3 {
    let by_pressure = -gradient / params.density;
    match params.source {
        Source::NumberDensity => by_pressure,
        Source::Mixed => by_pressure + params.gravity,
    }
}

/// -grad P / rho at fluid slot `i`, and gravity if it acts here [m/s2]. `all` holds every neighbour, of which the
/// first `carry` carry pressure.
pub fn pressure_gradient(
    i: usize,
    (all, carry): (Row, usize),
    state: State,
    on: Particles,
    pressure: &[f64],
) -> DVec3 {
    let carriers = || all.iter().take(carry);
    let minimum = carriers().fold(pressure[i], |m, (j, _)| m.min(pressure[j]));
    let mut gradient: DVec3 =
        carriers().map(|(j, w)| (pressure[j] - minimum) * pair_vector(i, j, w, on)).sum();
    if is_corrected(state, on.params)
        && let Some(inverse) = inverse(moment(i, all, on), on.params.dimensions)
    {
        gradient = inverse * gradient;
    }
    acceleration(gradient, on.params)
}
