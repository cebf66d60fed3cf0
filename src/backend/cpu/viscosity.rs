//! [`crate::kernels::viscosity`], several neighbours at a time.

use super::row_arrays::RowArrays;
use super::wide::wide;
use crate::kernels::Particles;
use crate::kernels::viscosity::coefficient;
use crate::lattice::weight;
use crate::neighbours::Chunk;
use glam::DVec3;

wide! {
    /// Viscous acceleration of the fluid slots from `first` on.
    pub fn viscosity_rows(first: usize, chunk: &Chunk, acceleration: &mut [DVec3], on: Particles) {
        let (mut arrays, nu) = (RowArrays::default(), coefficient(on.params));
        for (k, a) in acceleration.iter_mut().enumerate() {
            let neighbour = chunk.pressure(k).neighbour;
            *a = nu * laplacian_sum(first + k, neighbour, |_| true, on, &mut arrays);
        }
    }
}

/// Force of the fluid's viscosity on wall-layer particle `i` of a moving solid [N].
#[inline(always)]
pub fn reaction(i: usize, carriers: &[u32], on: Particles, arrays: &mut RowArrays) -> DVec3 {
    let wet = |j: u32| (j as usize) < on.fluid;
    on.params.particle_mass() * coefficient(on.params) * laplacian_sum(i, carriers, wet, on, arrays)
}

/// sum w (v_j - v_i) over the neighbours that `counts` admits.
#[inline(always)]
fn laplacian_sum(
    i: usize,
    neighbour: &[u32],
    counts: impl Fn(u32) -> bool,
    on: Particles,
    arrays: &mut RowArrays,
) -> DVec3 {
    let re = on.params.effective_radius;
    let RowArrays { r, w, .. } = arrays;
    r.differences(i, neighbour, on.position);
    let w = &mut w[..neighbour.len()];
    r.map_squares(w, |r2| {
        let r = r2.sqrt();
        if r > 0.0 && r < re { weight(r, re) } else { 0.0 }
    });
    let mut sum = DVec3::ZERO;
    for (&w, &j) in w.iter().zip(neighbour) {
        let w = if counts(j) { w } else { 0.0 };
        sum += w * (on.velocity[j as usize] - on.velocity[i]);
    }
    sum
}
