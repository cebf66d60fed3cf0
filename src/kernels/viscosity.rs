//! Viscous acceleration, Eqs. (2) and (6), with the positions and neighbours of the last step.
//! GPU twin: shaders/viscosity.wgsl
//!
//! Walls act through their wall layer alone, so that the force on a moving solid is exactly the reaction.

use crate::neighbours::Row;
use crate::params::{Params, weight};
use glam::DVec3;

/// nu times the Laplacian of the velocity at slot `i` [m/s2]; `row` holds its pressure-carrying neighbours.
/// The particles have moved since the list was made: weights are made afresh.
#[inline(always)]
pub fn viscosity(i: usize, row: Row, params: &Params, position: &[DVec3], velocity: &[DVec3]) -> DVec3 {
    let re = params.effective_radius;
    let mut sum = DVec3::ZERO;
    for &j in row.neighbour {
        let j = j as usize;
        let r = position[j].distance(position[i]);
        if r < re && r > 0.0 {
            sum += (velocity[j] - velocity[i]) * weight(r, re);
        }
    }
    params.viscosity * 2.0 * f64::from(params.dimensions) / (params.laplacian * params.number_density) * sum
}

/// Force of the fluid's viscosity on wall-layer particle `i` of a moving solid [N].
#[inline(always)]
pub fn reaction(
    i: usize,
    row: Row,
    params: &Params,
    fluid: usize,
    position: &[DVec3],
    velocity: &[DVec3],
) -> DVec3 {
    let re = params.effective_radius;
    let mut sum = DVec3::ZERO;
    for &j in row.neighbour {
        let j = j as usize;
        let r = position[j].distance(position[i]);
        if j < fluid && r < re && r > 0.0 {
            sum += (velocity[j] - velocity[i]) * weight(r, re);
        }
    }
    let coefficient =
        params.viscosity * 2.0 * f64::from(params.dimensions) / (params.laplacian * params.number_density);
    params.particle_mass() * coefficient * sum
}
