//! Viscous acceleration, Eqs. (2) and (6), with the positions and neighbours of the last step.
//! GPU twin: shaders/viscosity.wgsl
//!
//! Walls act through their wall layer alone, so that the force on a moving solid is exactly the reaction. A pair of
//! fluid and wall weighs `params.wall_shear`: the wall's velocity holds on its surface, half a spacing before its layer.

use super::Particles;
use crate::lattice::weight;
use crate::params::Params;
use glam::DVec3;

/// 2 d nu / (lambda n0) [1/s], Eq. (6).
pub fn coefficient(params: &Params) -> f64 {
    params.viscosity * 2.0 * f64::from(params.dimensions) / (params.laplacian * params.number_density)
}

/// nu lap v at slot `i` [m/s2], Eq. (6); `carriers` are its neighbours that carry pressure.
/// The particles have moved since the list was made: weights are made afresh.
pub fn viscosity(i: usize, carriers: &[u32], on: Particles) -> DVec3 {
    coefficient(on.params) * carriers.iter().map(|&j| exchange(i, j as usize, on)).sum::<DVec3>()
}

/// Force of the fluid's viscosity on wall-layer particle `i` of a moving solid [N].
pub fn reaction(i: usize, carriers: &[u32], on: Particles) -> DVec3 {
    let wet = carriers.iter().filter(|&&j| (j as usize) < on.fluid);
    let sum: DVec3 = wet.map(|&j| exchange(i, j as usize, on)).sum();
    on.params.particle_mass() * coefficient(on.params) * sum
}

/// Share of the pair of slots `i` and `j` in the sum [-].
#[inline(always)]
pub fn share(i: usize, j: usize, on: Particles) -> f64 {
    if (i < on.fluid) == (j < on.fluid) { 1.0 } else { on.params.wall_shear }
}

/// w_ij (v_j - v_i), with its share [m/s].
fn exchange(i: usize, j: usize, on: Particles) -> DVec3 {
    let (r, re) = (on.offset(i, j).length(), on.params.effective_radius);
    let w = if r > 0.0 && r < re { weight(r, re) } else { 0.0 };
    share(i, j, on) * w * (on.velocity[j] - on.velocity[i])
}
