//! Viscous acceleration, Eqs. (2) and (6), with the positions and neighbours of the last step.
//! GPU twin: shaders/viscosity.wgsl
//!
//! The paper's scheme weighs pairs by Eq. (3) and takes lambda n0 of the lattice. The accurate one has a
//! weight whose second moments keep to the lattice's on other arrangements (`crate::lattice::viscous_weight`).
//!
//! The Laplacian of a linear velocity A x is, by the sum, A Q with Q = 2 d / (sum w r^2) sum w r: nothing inside, and at a free surface
//! the force of a stress nu grad v. The whole stress is nu (grad v + grad v^T): with A^T Q the two are 2 E Q, E the strain rate, which
//! is nothing where water turns as a whole (`surface_stress`). It is left out where water is too thin to feel it ([`Params::surface_stress`]).
//!
//! Walls act through their wall layer alone, so that the force on a solid is exactly the reaction. A pair of
//! fluid and wall weighs `params.shear.wall`: the wall's velocity holds on its surface, half a spacing before its layer.

use super::Particles;
use crate::lattice::{viscous_weight, weight};
use crate::neighbourhood::inverse_above;
use crate::neighbours::Row;
use crate::params::Params;
use crate::scheme::Source;
use glam::{DMat3, DVec3};

/// Bound of the smallest eigenvalue of the moments of a particle's water ([`inverse_above`]), over the lattice's, from which on its
/// velocities are fitted: on the lattice 0.50 inside, 0.31 on a flat surface and 0.20 on an edge in the plane (0.44, 0.30 and 0.20 in
/// space). With fewer neighbours a fit says little of how the water moves.
pub const FIT_MIN: f64 = 0.17;

/// 2 d nu / sum w r^2 over the lattice [1/s], Eq. (6).
pub fn coefficient(params: &Params) -> f64 {
    params.viscosity * 2.0 * f64::from(params.dimensions) / (params.shear.moment * params.spacing.powi(2))
}

/// d / sum w r^2 over the lattice [1/m2]: of the moments of which the lattice's are one.
pub fn scale(params: &Params) -> f64 {
    f64::from(params.dimensions) / (params.shear.moment * params.spacing.powi(2))
}

/// Weight of a pair whose distance has the square `r2` [m2] in the viscous sum [-].
#[inline(always)]
pub fn pair_weight(r2: f64, params: &Params) -> f64 {
    let re = params.effective_radius;
    if r2 <= 0.0 || r2 >= re * re {
        return 0.0;
    }
    match params.source {
        Source::NumberDensity => weight(r2.sqrt(), re),
        Source::Mixed => viscous_weight(r2.sqrt() / re),
    }
}

/// nu lap v at slot `i` [m/s2], Eq. (6); `carriers` are its neighbours that carry pressure.
/// The particles have moved since the list was made: weights are made afresh.
pub fn viscosity(i: usize, carriers: &[u32], on: Particles) -> DVec3 {
    coefficient(on.params) * carriers.iter().map(|&j| exchange(i, j as usize, on)).sum::<DVec3>()
}

/// nu A^T Q at slot `i` [m/s2]: Q of `all` its neighbours, solids among them, A of the water's alone.
pub fn surface_stress(i: usize, all: Row, on: Particles) -> DVec3 {
    let (params, dimensions) = (on.params, on.params.dimensions);
    let pairs = || {
        all.neighbour
            .iter()
            .map(|&j| (j as usize, on.offset(i, j as usize)))
            .map(|(j, r)| (j, r, pair_weight(r.length_squared(), params)))
    };
    let lopsided: DVec3 = pairs().map(|(_, r, w)| w * r).sum();
    let (mut moment, mut turned) = (DMat3::ZERO, DVec3::ZERO);
    for (j, r, w) in pairs().filter(|&(j, ..)| j < on.fluid) {
        moment += DMat3::from_cols(w * r.x * r, w * r.y * r, w * r.z * r);
        turned += w * lopsided.dot(on.velocity[j] - on.velocity[i]) * r;
    }
    moment *= scale(params);
    if dimensions == 2 {
        // The plane y = 0 has no moment across it.
        moment.y_axis.y = 1.0;
    }
    let inverse = inverse_above(FIT_MIN, moment, dimensions).unwrap_or(DMat3::ZERO);
    coefficient(params) * scale(params) * (inverse * turned)
}

/// Force of the fluid's viscosity on wall-layer particle `i` [N].
pub fn reaction(i: usize, carriers: &[u32], on: Particles) -> DVec3 {
    let wet = carriers.iter().filter(|&&j| (j as usize) < on.fluid);
    let sum: DVec3 = wet.map(|&j| exchange(i, j as usize, on)).sum();
    on.params.particle_mass() * coefficient(on.params) * sum
}

/// Share of the pair of slots `i` and `j` in the sum [-].
#[inline(always)]
pub fn share(i: usize, j: usize, on: Particles) -> f64 {
    if (i < on.fluid) == (j < on.fluid) { 1.0 } else { on.params.shear.wall }
}

/// w_ij (v_j - v_i), with its share [m/s].
fn exchange(i: usize, j: usize, on: Particles) -> DVec3 {
    let w = pair_weight(on.offset(i, j).length_squared(), on.params);
    share(i, j, on) * w * (on.velocity[j] - on.velocity[i])
}
