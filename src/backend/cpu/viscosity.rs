//! [`crate::kernels::viscosity`], several neighbours at a time.

use super::row_arrays::RowArrays;
use super::wide::wide;
use crate::kernels::Particles;
use crate::kernels::viscosity::{coefficient, share};
use crate::lattice::{viscous_weight, weight};
use crate::neighbours::Chunk;
use crate::scheme::Source;
use glam::DVec3;

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
        for (k, a) in acceleration.iter_mut().enumerate() {
            let neighbour = chunk.pressure(k).neighbour;
            let share = |j| share(first + k, j, on);
            *a = nu * laplacian_sum(first + k, neighbour, share, on, arrays);
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
    let RowArrays { r, w, .. } = arrays;
    r.offsets(i, neighbour, on);
    let w = &mut w[..neighbour.len()];
    let re = on.params.effective_radius;
    // As `pair_weight`, one loop for each weight and no jump in it.
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
    let mut sum = DVec3::ZERO;
    for (&w, &j) in w.iter().zip(neighbour) {
        let j = j as usize;
        sum += share(j) * w * (on.velocity[j] - on.velocity[i]);
    }
    sum
}
