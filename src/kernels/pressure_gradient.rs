//! Pressure gradient against the smallest pressure in the neighbourhood, Eq. (9), as an acceleration.
//! GPU twin: shaders/pressure_gradient.wgsl
//!
//! Where the source of the PPE is balanced ([`crate::scheme::Source::Mixed`]), gravity acts together with the pressure
//! that carries it, in this stage, and not in `predict`.
//!
//! The consistent gradient is, below the surface,
//! M^-1 (d / n0) [sum (P_j - P_i + R) e + sum_dummies (rho g . r + R) e],  e = w r / r^2,
//! exact for a linear pressure but for the repulsion R, which is that of Eq. (9), P_i - P_min, or what is left of it when
//! the weight of the water is taken off, whichever is smaller: none in still water on any arrangement. On the surface it is
//! (d / n0) sum (P_j + P_i) e: with P = 0 half a spacing outside, half a neighbourhood then carries the whole weight.

use super::Particles;
use super::pressure_source::room_in_water;
use crate::fields::State;
use crate::neighbourhood::{inverse, moment, pair_vector};
use crate::neighbours::Row;
use crate::params::Params;
use crate::scheme::{Gradient, Source};
use glam::DVec3;

/// Whether the gradient of a particle is the consistent one.
#[inline(always)]
pub fn is_consistent(state: State, params: &Params) -> bool {
    params.gradient == Gradient::Consistent && state == State::Inner
}

/// What still water's pressure grows by along `r` [Pa].
#[inline(always)]
pub fn hydrostatic(r: DVec3, params: &Params) -> f64 {
    params.density * params.gravity.dot(r)
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

/// What is left of `acceleration` to a particle of water that solids catch between them, and what takes it with them [m/s2]:
/// it undoes no divergence, so that no pressure carries it, and without room it goes where they go, by their mean velocity.
/// Left to its weight it fell through the floor, past the middle between wall particles; held in its place it was left behind
/// in a body that moved on.
#[inline(always)]
pub fn held(acceleration: DVec3, i: usize, all: Row, on: Particles, dt: f64) -> DVec3 {
    if on.params.source != Source::Mixed {
        return acceleration;
    }
    let (room, with) = room_in_water(i, all, on);
    if room >= 1.0 { acceleration } else { room * acceleration + (1.0 - room) / dt * (with - on.velocity[i]) }
}

/// -grad P / rho at fluid slot `i`, and gravity if it acts here [m/s2], in a step of `dt` [s]. `all` holds every
/// neighbour, of which the first `carry` carry pressure.
pub fn pressure_gradient(
    i: usize,
    (all, carry): (Row, usize),
    state: State,
    on: Particles,
    pressure: &[f64],
    dt: f64,
) -> DVec3 {
    let carriers = || all.iter().take(carry);
    let head = |j: usize| hydrostatic(on.offset(i, j), on.params);
    let mut reference = carriers().fold(pressure[i], |m, (j, _)| m.min(pressure[j]));
    let consistent = is_consistent(state, on.params);
    if consistent {
        let level = carriers().fold(pressure[i], |m, (j, _)| m.min(pressure[j] - head(j)));
        reference = reference.max(level);
    } else if on.params.gradient == Gradient::Consistent {
        reference = -pressure[i];
    }
    let mut gradient: DVec3 =
        carriers().map(|(j, w)| (pressure[j] - reference) * pair_vector(i, j, w, on)).sum();
    if consistent {
        let dummies = all.iter().skip(carry);
        gradient += dummies
            .map(|(j, w)| (pressure[i] + head(j) - reference) * pair_vector(i, j, w, on))
            .sum::<DVec3>();
        if let Some(inverse) = inverse(moment(i, all, on), on.params.dimensions) {
            gradient = inverse * gradient;
        }
    }
    held(acceleration(gradient, on.params), i, all, on, dt)
}
