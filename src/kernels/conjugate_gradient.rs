//! Operator of the PPE, matrix-free over the neighbour list.
//! GPU twin: shaders/conjugate_gradient.wgsl

use crate::neighbours::Row;

/// Row `i` of A p: diagonal p_i - c sum w_ij p_j over the neighbours that carry pressure. `p` is zero
/// wherever the pressure is no unknown, which makes surface particles Dirichlet points.
#[inline(always)]
pub fn apply(i: usize, row: Row, c: f64, diagonal: f64, p: &[f64]) -> f64 {
    let sum: f64 = row.neighbour.iter().zip(row.weight).map(|(&j, &w)| w * p[j as usize]).sum();
    diagonal * p[i] - c * sum
}
