//! Operator of the PPE, matrix-free over the neighbour list.
//! GPU twin: shaders/conjugate_gradient.wgsl

use crate::neighbours::Row;

/// Row `i` of A p: diagonal p_i - c sum w_ij p_j over the neighbours that carry pressure. `p` is zero
/// wherever the pressure is no unknown, which makes surface particles Dirichlet points.
#[inline(always)]
pub fn apply(i: usize, row: Row, c: f64, diagonal: f64, p: &[f64]) -> f64 {
    // Four sums side by side: one alone would wait for each addition to finish.
    let mut sums = [0.0; 4];
    let (indices, weights) = (row.neighbour.chunks_exact(4), row.weight.chunks_exact(4));
    let rest: f64 =
        indices.remainder().iter().zip(weights.remainder()).map(|(&j, w)| w * p[j as usize]).sum();
    for (j, w) in indices.zip(weights) {
        for k in 0..4 {
            sums[k] += w[k] * p[j[k] as usize];
        }
    }
    diagonal * p[i] - c * ((sums[0] + sums[1]) + (sums[2] + sums[3]) + rest)
}
