//! Right side and diagonal of the pressure Poisson equation, Eq. (8), times -1:
//!
//! A P = b,  A_ij = -c w_ij,  A_ii = c sum w_ij + alpha rho / dt^2,  c = 2 d / (lambda n0),
//!
//! over neighbours that carry pressure (dummies: no flux). The pressure of surface particles is known: 0, or
//! [`super::surface_pressure`], which b_i takes in as c sum w_ij P_s.
//! GPU twin: shaders/pressure_source.wgsl
//!
//! The paper's source is the deviation of the number density alone. The mixed one takes the divergence of the velocity,
//! corrected by the moment matrix so that a stretch at constant volume has none, the deviation of a smooth density sum,
//! and the weight of the water, which the pressure of water at rest balances on any arrangement of particles. The
//! smooth sum, (1 + sum W) / W0, keeps its value on stretched and on disordered arrangements, where n of Eq. (4) rises:
//! W ends smoothly and is finite at r = 0. Walls carry pressure to water alone: their layer holds none that could flow
//! along it.

use super::Particles;
use crate::lattice::{reach, smooth_weight};
use crate::neighbourhood::{inverse, moment, pair_vector};
use crate::neighbours::Row;
use crate::params::{Params, Step};
use crate::scheme::Source;
use glam::{DMat3, DVec3};

/// Coefficient c of the Laplacian, Eq. (6) [1/m2].
#[inline(always)]
pub fn laplacian_coefficient(params: &Params) -> f64 {
    2.0 * f64::from(params.dimensions) / (params.laplacian * params.number_density)
}

/// Right side b [Pa/m2] and diagonal [1/m2] of slot `i` with number density `n`. `all` holds every
/// neighbour, of which the first `carry` carry pressure; `surface_pressure` is empty where it is 0.
pub fn pressure_source(
    i: usize,
    n: f64,
    (all, carry): (Row, usize),
    on: Particles,
    surface_pressure: &[f64],
    step: &Step,
) -> (f64, f64) {
    let (params, c) = (on.params, laplacian_coefficient(on.params));
    let links: f64 = all.iter().take(carry).map(|(_, w)| w).sum();
    if links <= 0.0 {
        return (0.0, c);
    }
    let per_time = params.density / step.dt;
    let mut leak = 0.0;
    let b = match params.source {
        Source::NumberDensity => number_density_source(n, params, step),
        Source::Mixed => {
            let first_moment: DVec3 = all.iter().take(carry).map(|(j, w)| w * on.offset(i, j)).sum();
            let density = |from: usize| -> f64 {
                all.iter().filter(|&(j, _)| j >= from).map(|(_, w)| smooth_weight(reach(w))).sum()
            };
            let wet = wet_share(i, links, 1.0 + density(on.fluid), all.neighbour, on);
            leak = c * leak_of(i, wet, on);
            wet * step.relaxation * per_time / step.dt * ((1.0 + density(0)) / params.smooth_density - 1.0)
                - wet * (1.0 - step.relaxation) * per_time * divergence(i, all, on)
                - c * params.density * params.gravity.dot(first_moment)
        }
    };
    let known: f64 = if surface_pressure.is_empty() {
        0.0
    } else {
        all.iter().take(carry).map(|(j, w)| w * surface_pressure[j]).sum()
    };
    (b + c * known, c * links + leak + step.compressibility * per_time / step.dt)
}

/// Part of divergence and deviation that slot `i` undoes [-]: all of them in water and on a flat wall under it. Its
/// weights with neighbours that carry pressure sum to `links`, and solids, itself among them, to `solids` = 1 + sum W.
/// A row in a slot between solids meets hardly any water, of which a little that is left to be undone, as of solids
/// that touch, would ask a large pressure. At a body a row undoes nothing below half of a flat wall's water, as at the
/// edge that a body stands on: the rest would press a tenth too much into the slot under it. Solids that come to touch
/// catch particles of water between them, which have no room and no way out: to undo that would take pressures without
/// bound in a pocket of a few rows.
#[inline(always)]
pub fn wet_share(i: usize, links: f64, solids: f64, neighbour: &[u32], on: Particles) -> f64 {
    let room = room(i, solids, on.fluid, on.params);
    if i < on.fluid {
        return room;
    }
    let share = (links / on.params.wall_contact).min(1.0);
    if share.min(room) >= 1.0 {
        return 1.0;
    }
    let bodies = on.fluid..on.fluid + on.params.body_wall;
    let at_body = bodies.contains(&i) || neighbour.iter().any(|&j| bodies.contains(&(j as usize)));
    if at_body { (2.0 * share - 1.0).max(0.0).min(room) } else { share }
}

/// gamma rho / dt^2 (n - n0) / n0 [Pa/m2], Eq. (8).
#[inline(always)]
pub fn number_density_source(n: f64, params: &Params, step: &Step) -> f64 {
    let deviation = (n - params.number_density) / params.number_density;
    step.relaxation * (params.density / step.dt) / step.dt * deviation
}

/// Solids about a particle of water, over W0, from which on it is caught between them, and at which it wholly is, as in
/// a hole of one particle: gaps of 0.85 and 0.6 spacings in the plane, of 0.6 and 0.4 in space.
const CAUGHT: (f64, f64) = (0.85, 1.0);
/// Room before a row at a body, over that of a flat wall, at which it undoes nothing, and from which on as much as it
/// meets water: gaps of some 0.14 and 0.31 spacings. A corner has 0.73 and more.
const SLOT: (f64, f64) = (0.35, 0.68);
/// Link of a caught particle to P = 0, over n0 [-]: small beside links to water that is not caught.
const LEAK: f64 = 0.1;

/// Room that solids leave a particle of water [-]: 1 where there are no bodies, which are all that catch it.
#[inline(always)]
pub fn room_in_water(i: usize, all: Row, on: Particles) -> f64 {
    if on.params.body_wall == 0 {
        return 1.0;
    }
    let solids = all.iter().filter(|(j, _)| *j >= on.fluid).map(|(_, w)| smooth_weight(reach(w)));
    room(i, 1.0 + solids.sum::<f64>(), on.fluid, on.params)
}

/// Room that `solids` leave at slot `i` [-].
#[inline(always)]
fn room(i: usize, solids: f64, fluid: usize, params: &Params) -> f64 {
    let room = if i < fluid {
        (CAUGHT.1 - solids / params.smooth_density) / (CAUGHT.1 - CAUGHT.0)
    } else {
        ((params.smooth_density - solids) / params.wall_room - SLOT.0) / (SLOT.1 - SLOT.0)
    };
    room.clamp(0.0, 1.0)
}

/// What is added to the links of a particle of water that undoes the part `wet`: a pocket that no water joins to the
/// rest has pressures near 0, and not those of a closed vessel.
#[inline(always)]
pub fn leak_of(i: usize, wet: f64, on: Particles) -> f64 {
    if i < on.fluid { LEAK * (1.0 - wet) * on.params.number_density } else { 0.0 }
}

/// (d / n0) sum w (v_j - v_i) . M^-1 r / r^2 [1/s]; without M where it cannot be inverted. Solids count with their
/// velocity along their mean normal: that past them moves no volume.
fn divergence(i: usize, all: Row, on: Particles) -> f64 {
    let inverse = inverse(moment(i, all, on), on.params.dimensions).unwrap_or(DMat3::IDENTITY);
    let slips = |j: usize| i < on.fluid && j >= on.fluid;
    let solids = all.iter().filter(|&(j, _)| slips(j));
    let normal = solids.map(|(j, w)| pair_vector(i, j, w, on)).sum::<DVec3>().normalize_or_zero();
    let pair = |(j, w): (usize, f64)| {
        let mut v = on.velocity[j] - on.velocity[i];
        if slips(j) {
            v = v.dot(normal) * normal;
        }
        v.dot(inverse * pair_vector(i, j, w, on))
    };
    all.iter().map(pair).sum()
}
