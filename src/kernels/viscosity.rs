//! Viscous acceleration, Eqs. (2) and (6), with the positions and neighbours of the last step.
//! GPU twin: shaders/viscosity.wgsl
//!
//! The paper's scheme weighs pairs by Eq. (3) and takes lambda n0 of the lattice. The accurate one has a
//! weight whose second moments keep to the lattice's on other arrangements (`crate::lattice::viscous_weight`).
//!
//! Walls act through their wall layer alone, so that the force on a solid is exactly the reaction. A pair of
//! fluid and wall weighs `params.shear.wall`: the wall's velocity holds on its surface, half a spacing before its layer.

use super::Particles;
use crate::lattice::{viscous_weight, weight};
use crate::params::Params;
use crate::scheme::Source;
use glam::DVec3;

/// 2 d nu / sum w r^2 over the lattice [1/s], Eq. (6).
pub fn coefficient(params: &Params) -> f64 {
    params.viscosity * 2.0 * f64::from(params.dimensions) / (params.shear.moment * params.spacing.powi(2))
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
