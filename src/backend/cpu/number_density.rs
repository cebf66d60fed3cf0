//! [`crate::kernels::number_density`], several neighbours at a time.

use super::row_arrays::{RowArrays, sum};
use super::wide::wide;
use crate::fields::State;
use crate::kernels::Particles;
use crate::kernels::number_density::{free_surface, pair_weight};
use crate::neighbours::Chunk;
use glam::DVec3;

wide! {
    /// Weights, number densities and states of the slots from `first` on, of which those below `live` hold fluid.
    pub(crate) fn density_rows(
        first: usize,
        live: usize,
        chunk: &mut Chunk,
        density: &mut [f64],
        state: &mut [State],
        on: Particles,
        arrays: &mut RowArrays,
    ) {
        for k in 0..density.len() {
            let (i, range) = (first + k, chunk.range(k));
            if range.is_empty() {
                let alone = || free_surface(0.0, || DVec3::ZERO, on.params);
                (density[k], state[k]) = (0.0, if i < live { alone() } else { State::Inactive });
                continue;
            }
            let neighbour = &chunk.neighbour[range.clone()];
            let carry = chunk.dummies[k] as usize - range.start;
            (density[k], state[k]) = number_density(i, neighbour, carry, on, arrays);
            chunk.weight[range].copy_from_slice(&arrays.w[..neighbour.len()]);
        }
    }
}

/// Number density and state of slot `i`, the first `carry` of whose neighbours carry pressure; `arrays` gets distances and weights of its neighbours.
#[inline(always)]
fn number_density(
    i: usize,
    neighbour: &[u32],
    carry: usize,
    on: Particles,
    arrays: &mut RowArrays,
) -> (f64, State) {
    let RowArrays { r, w, .. } = arrays;
    let (n, filled) = (neighbour.len(), r.offsets(i, neighbour, on));
    let w = &mut w[..filled];
    r.map_squares(w, |r2| pair_weight(r2, on.params));
    w[n..].fill(0.0);
    let density = sum(w);
    let wet =
        i < on.fluid || neighbour[..carry].iter().zip(&*w).any(|(&j, &w)| (j as usize) < on.fluid && w > 0.0);
    let state = if wet { free_surface(density, || r.weighted_sum(w), on.params) } else { State::Inactive };
    (density, state)
}
