//! [`crate::kernels::viscosity`], several neighbours at a time.

use super::moment::moment;
use super::row_arrays::{RowArrays, dot};
use super::wide::wide;
use crate::kernels::Particles;
use crate::kernels::viscosity::{FIT_MIN, coefficient, scale, share};
use crate::lattice::{viscous_weight, weight};
use crate::neighbourhood::inverse_above;
use crate::neighbours::Chunk;
use crate::scheme::Source;
use glam::{DMat3, DVec3};

wide! {
    /// Viscous acceleration of the fluid slots from `first` on.
    pub(crate) fn viscosity_rows(
        first: usize,
        chunk: &Chunk,
        acceleration: &mut [DVec3],
        on: Particles,
        arrays: &mut RowArrays,
    ) {
        let nu = coefficient(on.params);
        let stress = on.params.surface_stress();
        for (k, a) in acceleration.iter_mut().enumerate() {
            let neighbour = chunk.pressure(k).neighbour;
            let share = |j| share(first + k, j, on);
            *a = nu * laplacian_sum(first + k, neighbour, share, on, arrays);
            if stress {
                *a += nu * turned_sum(first + k, chunk.all(k).neighbour, on, arrays);
            }
        }
    }
}

/// Force of the fluid's viscosity on wall-layer particle `i` [N].
#[inline(always)]
pub fn reaction(i: usize, carriers: &[u32], on: Particles, arrays: &mut RowArrays) -> DVec3 {
    let wet = |j| if j < on.fluid { share(i, j, on) } else { 0.0 };
    on.params.particle_mass() * coefficient(on.params) * laplacian_sum(i, carriers, wet, on, arrays)
}

/// sum w (v_j - v_i) over the neighbours, each with its `share`.
#[inline(always)]
fn laplacian_sum(
    i: usize,
    neighbour: &[u32],
    share: impl Fn(usize) -> f64,
    on: Particles,
    arrays: &mut RowArrays,
) -> DVec3 {
    weights(i, neighbour, on, arrays);
    let w = &arrays.w[..neighbour.len()];
    let mut sum = DVec3::ZERO;
    for (&w, &j) in w.iter().zip(neighbour) {
        let j = j as usize;
        sum += share(j) * w * (on.velocity[j] - on.velocity[i]);
    }
    sum
}

/// A^T Q of `crate::kernels::viscosity::surface_stress` over nu 2 d / sum w r^2 [m/s].
#[inline(always)]
fn turned_sum(i: usize, all: &[u32], on: Particles, arrays: &mut RowArrays) -> DVec3 {
    let filled = weights(i, all, on, arrays);
    let RowArrays { r, v, e, w, s, .. } = arrays;
    v.differences(i, all, on.velocity);
    let lopsided = r.weighted_sum(&w[..filled]);
    for (w, &j) in w.iter_mut().zip(all) {
        *w = if (j as usize) < on.fluid { *w } else { 0.0 };
    }
    for k in 0..filled {
        (e.x[k], e.y[k], e.z[k]) = (w[k] * r.x[k], w[k] * r.y[k], w[k] * r.z[k]);
        s[k] = lopsided.x * v.x[k] + lopsided.y * v.y[k] + lopsided.z * v.z[k];
    }
    let scale = scale(on.params);
    let moment = moment(r, e, filled, scale, on.params.dimensions);
    let s = &s[..filled];
    let turned = DVec3::new(dot(s, &e.x), dot(s, &e.y), dot(s, &e.z));
    scale * (inverse_above(FIT_MIN, moment, on.params.dimensions).unwrap_or(DMat3::ZERO) * turned)
}

/// Offsets and weights of the neighbours, as `pair_weight`; returns the length with the filling.
#[inline(always)]
fn weights(i: usize, neighbour: &[u32], on: Particles, arrays: &mut RowArrays) -> usize {
    let RowArrays { r, w, .. } = arrays;
    let filled = r.offsets(i, neighbour, on);
    let w = &mut w[..filled];
    let re = on.params.effective_radius;
    // One loop for each weight and no jump in it.
    match on.params.source {
        Source::NumberDensity => r.map_squares(w, |r2| {
            let r = r2.sqrt();
            if r > 0.0 && r < re { weight(r, re) } else { 0.0 }
        }),
        Source::Mixed => r.map_squares(w, |r2| {
            let (r, w) = (r2.sqrt(), viscous_weight(r2.sqrt() / re));
            if r > 0.0 && r < re { w } else { 0.0 }
        }),
    }
    filled
}
