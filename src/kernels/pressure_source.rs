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
use crate::lattice::{boundary_weight, reach, smooth_weight};
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

/// alpha rho / dt^2 [1/m2], by which the compressibility adds to the diagonal.
#[inline(always)]
pub fn compressible_diagonal(params: &Params, step: &Step) -> f64 {
    step.compressibility * (params.density / step.dt) / step.dt
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
            let boundary = Boundary::of(i, all, on);
            let wet = wet_share(i, links, 1.0 + density(on.fluid), boundary.bodies, on);
            leak = c * leak_of(i, wet, on);
            wet * step.relaxation * per_time / step.dt * ((1.0 + density(0)) / params.smooth_density - 1.0)
                - wet * (1.0 - step.relaxation) * per_time * divergence(i, all, &boundary, on)
                - c * params.density * params.gravity.dot(first_moment)
        }
    };
    let known: f64 = if surface_pressure.is_empty() {
        0.0
    } else {
        all.iter().take(carry).map(|(j, w)| w * surface_pressure[j]).sum()
    };
    (b + c * known, c * links + leak + compressible_diagonal(params, step))
}

/// Part of divergence and deviation that slot `i` undoes [-]: all of them in water and on a flat wall under it. Its
/// weights with neighbours that carry pressure sum to `links`, and solids, itself among them, to `solids` = 1 + sum W;
/// `bodies` are among them or not.
/// A row in a slot between solids meets hardly any water, of which a little that is left to be undone, as of solids
/// that touch, would ask a large pressure; and where a wall has moved into another one their rows stand in one place, whose
/// density would push all water off. At a body a row undoes nothing below half of a flat wall's water, as at the
/// edge that a body stands on: the rest would press a tenth too much into the slot under it. Solids that come to touch
/// catch particles of water between them, which have no room and no way out: to undo that would take pressures without
/// bound in a pocket of a few rows.
#[inline(always)]
pub fn wet_share(i: usize, links: f64, solids: f64, bodies: bool, on: Particles) -> f64 {
    let room = room(i, solids, on.fluid, on.params);
    if i < on.fluid {
        return room;
    }
    let share = (links / on.params.wall_contact).min(1.0);
    let share = if bodies || is_body(i, on) { (2.0 * share - 1.0).max(0.0) } else { share };
    share.min(room)
}

/// gamma rho / dt^2 (n - n0) / n0 [Pa/m2], Eq. (8).
#[inline(always)]
pub fn number_density_source(n: f64, params: &Params, step: &Step) -> f64 {
    let deviation = (n - params.number_density) / params.number_density;
    step.relaxation * (params.density / step.dt) / step.dt * deviation
}

/// Solids about a particle of water, over W0, from which on it is caught between them, and at which it wholly is, as in
/// a hole of one particle: gaps of 0.85 and 0.6 spacings in the plane, of 0.6 and 0.4 in space.
pub const CAUGHT: (f64, f64) = (0.85, 1.0);
/// Room before a row, over that of a flat wall, at which it undoes nothing, and from which on as much as it
/// meets water: gaps of some 0.14 and 0.31 spacings. A corner has 0.73 and more.
pub const SLOT: (f64, f64) = (0.35, 0.68);
/// Link of a caught particle to P = 0, over n0 [-]: small beside links to water that is not caught.
pub const LEAK: f64 = 0.1;

/// Room that solids leave a particle of water [-], and their mean velocity [m/s]: 1 where there are no bodies, which are all
/// that catch it.
#[inline(always)]
pub fn room_in_water(i: usize, all: Row, on: Particles) -> (f64, DVec3) {
    if on.params.body_wall == 0 {
        return (1.0, DVec3::ZERO);
    }
    let solids =
        all.iter().filter(|(j, _)| *j >= on.fluid).map(|(j, w)| (smooth_weight(reach(w)), on.velocity[j]));
    let (sum, moving) = solids.fold((0.0, DVec3::ZERO), |(sum, moving), (w, v)| (sum + w, moving + w * v));
    (room(i, 1.0 + sum, on.fluid, on.params), if sum > 0.0 { moving / sum } else { DVec3::ZERO })
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

/// Water against solids, as a row of either sees it.
#[derive(Default)]
pub struct Boundary {
    /// Sum of the solids' r_j - r_i [m], and of their weights [-], [`boundary_weight`].
    solids: DVec3,
    solid_weight: f64,
    /// Whether bodies are among them.
    pub bodies: bool,
    /// Sum of the weights of those across the boundary [-], and with them of v_j - v_i [m/s].
    weight: f64,
    velocity: DVec3,
    /// Sum of their [`pair_vector`].
    vector: DVec3,
}

/// Distance from the middle of the solids about a particle of water, over l0, from which on it is at one side of them:
/// not between two plates.
pub const ONE_SIDED: f64 = 0.02;
/// Depth of a wall below its row, over that of a flat and thick one, from which on water slides past it, and at which it
/// wholly does. Two layers with a hollow between them have no direction to slide along.
pub const THICK: (f64, f64) = (0.5, 0.9);

impl Boundary {
    /// Of row `i` with the neighbours `all`.
    fn of(i: usize, all: Row, on: Particles) -> Self {
        let mut boundary = Self::default();
        for (j, w) in all.iter() {
            let is_solid = j >= on.fluid;
            if is_solid {
                boundary.add_solid(j, w, on.offset(i, j), on);
            }
            if is_solid == (i < on.fluid) {
                boundary.add_across(w, pair_vector(i, j, w, on), on.velocity[j] - on.velocity[i]);
            }
        }
        boundary
    }

    /// The neighbour `j`, a solid, at `r` with weight `w`.
    #[inline(always)]
    pub fn add_solid(&mut self, j: usize, w: f64, r: DVec3, on: Particles) {
        let weight = boundary_weight(reach(w));
        self.solid_weight += weight;
        self.solids += weight * r;
        self.bodies |= is_body(j, on);
    }

    /// A neighbour across it of weight `w` and pair vector `e`, at the relative velocity `v`.
    #[inline(always)]
    pub fn add_across(&mut self, w: f64, e: DVec3, v: DVec3) {
        let weight = boundary_weight(reach(w));
        self.weight += weight;
        self.velocity += weight * v;
        self.vector += e;
    }

    /// Part of the corrected divergence of row `i` that the mean velocity along the boundary makes up.
    #[inline(always)]
    pub fn slide(&self, i: usize, inverse: DMat3, on: Particles) -> f64 {
        if self.weight <= 0.0 || self.solid_weight <= 0.0 || is_body(i, on) {
            return 0.0;
        }
        let (mut normal, mean) = (self.solids / self.solid_weight, self.velocity / self.weight);
        let (mut least, mut part) = (ONE_SIDED * on.params.spacing, 1.0);
        if i >= on.fluid {
            let depth = normal.length() / (on.params.wall_depth * on.params.spacing);
            part = ((depth - THICK.0) / (THICK.1 - THICK.0)).clamp(0.0, 1.0);
        } else if self.bodies {
            (normal, least) = (self.vector.normalize_or_zero(), 0.0);
        }
        let squared = normal.length_squared() + least * least;
        if squared <= 0.0 {
            return 0.0;
        }
        part / squared * normal.cross(mean.cross(normal)).dot(inverse * self.vector)
    }
}

/// Whether slot `i` is one of a body's wall layer.
#[inline(always)]
fn is_body(i: usize, on: Particles) -> bool {
    i >= on.fluid && i < on.fluid + on.params.body_wall
}

/// (d / n0) sum w (v_j - v_i) . M^-1 r / r^2 [1/s]; without M where it cannot be inverted. Water that slides past solids
/// counts without that velocity, in its own rows and in those of walls: it moves no volume, but on particles in rows it
/// would seem to, now inwards and now outwards.
fn divergence(i: usize, all: Row, boundary: &Boundary, on: Particles) -> f64 {
    let inverse = inverse(moment(i, all, on), on.params.dimensions).unwrap_or(DMat3::IDENTITY);
    let pair =
        |(j, w): (usize, f64)| (on.velocity[j] - on.velocity[i]).dot(inverse * pair_vector(i, j, w, on));
    all.iter().map(pair).sum::<f64>() - boundary.slide(i, inverse, on)
}
