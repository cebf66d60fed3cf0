//! Viscous acceleration, Eqs. (2) and (6), with the positions and neighbours of the last step.
//! GPU twin: shaders/viscosity.wgsl
//!
//! Walls act through their wall layer alone, so that the force on a moving solid is exactly the reaction. A pair of
//! fluid and wall weighs `params.wall_shear`: the wall's velocity holds on its surface, half a spacing before its layer.

use crate::lattice::weight;
use crate::neighbours::Row;
use crate::params::Params;
use crate::row_arrays::RowArrays;
use glam::DVec3;

/// nu times the Laplacian of the velocity at slot `i` [m/s2]; `row` holds its pressure-carrying neighbours, of which
/// those below `fluid` are fluid.
/// The particles have moved since the list was made: weights are made afresh.
#[inline(always)]
pub fn viscosity(
    i: usize,
    row: Row,
    params: &Params,
    fluid: usize,
    position: &[DVec3],
    velocity: &[DVec3],
    arrays: &mut RowArrays,
) -> DVec3 {
    let share = |j: u32| if (j as usize) < fluid { 1.0 } else { params.wall_shear };
    coefficient(params) * laplacian_sum(i, row, share, params, position, velocity, arrays)
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
    arrays: &mut RowArrays,
) -> DVec3 {
    let share = |j: u32| if (j as usize) < fluid { params.wall_shear } else { 0.0 };
    params.particle_mass()
        * coefficient(params)
        * laplacian_sum(i, row, share, params, position, velocity, arrays)
}

/// 2 d nu / (lambda n0) [1/s].
fn coefficient(params: &Params) -> f64 {
    params.viscosity * 2.0 * f64::from(params.dimensions) / (params.laplacian * params.number_density)
}

/// sum w (v_j - v_i) over the neighbours, each with its `share`.
#[inline(always)]
fn laplacian_sum(
    i: usize,
    row: Row,
    share: impl Fn(u32) -> f64,
    params: &Params,
    position: &[DVec3],
    velocity: &[DVec3],
    arrays: &mut RowArrays,
) -> DVec3 {
    let re = params.effective_radius;
    let RowArrays { r, w, .. } = arrays;
    r.differences(i, row.neighbour, position);
    let w = &mut w[..row.neighbour.len()];
    r.map_squares(w, |r2| {
        let r = r2.sqrt();
        if r > 0.0 && r < re { weight(r, re) } else { 0.0 }
    });
    let mut sum = DVec3::ZERO;
    for (&w, &j) in w.iter().zip(row.neighbour) {
        sum += share(j) * w * (velocity[j as usize] - velocity[i]);
    }
    sum
}
