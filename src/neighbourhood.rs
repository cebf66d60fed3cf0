//! What sums over a particle's neighbourhood read, and its moment matrix, M = (d / n0) sum w r r^T / r^2: the inverse makes
//! the gradient of a linear pressure and the divergence of a linear velocity exact on any arrangement of particles.
//! The shaders pressure_source and pressure_gradient sum it as well; see shaders/common.wgsl.

use crate::neighbours::Row;
use crate::params::Params;
use glam::{DMat3, DVec3};

/// What sums over neighbours read.
#[derive(Clone, Copy)]
pub struct Particles<'a> {
    /// Constants.
    pub params: &'a Params,
    /// Positions [m].
    pub position: &'a [DVec3],
    /// Velocities [m/s].
    pub velocity: &'a [DVec3],
    /// Fluid slots: those below are fluid, the others solid.
    pub fluid: usize,
}

impl Particles<'_> {
    /// r_j - r_i of slots `i` and `j` [m], to the nearest image of j where sides are periodic.
    #[inline(always)]
    pub fn offset(&self, i: usize, j: usize) -> DVec3 {
        self.params.periodic.nearest(self.position[j] - self.position[i])
    }
}

/// Smallest eigenvalue, by a lower bound of it, at which the inverse is used: below, the neighbourhood is too
/// one-sided or too flat for a linear fit.
pub const EIGENVALUE_MIN: f64 = 0.1;

/// d / n0.
#[inline(always)]
pub fn scale(params: &Params) -> f64 {
    f64::from(params.dimensions) / params.number_density
}

/// w / r^2 of a pair of weight `w` = re / r - 1 [1/m2]: without a division, and finite where the weight is, at r = 0.
#[inline(always)]
pub(crate) fn weight_over_square(w: f64, re: f64) -> f64 {
    let inverse = (1.0 + w) / re;
    w * inverse * inverse
}

/// (d / n0) w r / r^2 of slot `i` and neighbour `j` of weight `w` [1/m].
pub(crate) fn pair_vector(i: usize, j: usize, w: f64, on: Particles) -> DVec3 {
    scale(on.params) * weight_over_square(w, on.params.effective_radius) * on.offset(i, j)
}

/// M of slot `i` over `all` its neighbours [-].
pub fn moment(i: usize, all: Row, on: Particles) -> DMat3 {
    let mut m = DMat3::ZERO;
    for (j, w) in all.iter() {
        let (e, r) = (pair_vector(i, j, w, on), on.offset(i, j));
        m += DMat3::from_cols(e * r.x, e * r.y, e * r.z);
    }
    if on.params.dimensions == 2 {
        // The plane y = 0 has no moment across it.
        m.y_axis.y = 1.0;
    }
    m
}

/// Inverse of the moment matrix `m`, if its smallest eigenvalue is known to exceed [`EIGENVALUE_MIN`].
#[inline(always)]
pub fn inverse(m: DMat3, dimensions: u32) -> Option<DMat3> {
    inverse_above(EIGENVALUE_MIN, m, dimensions)
}

/// Inverse of the moment matrix `m`, if its smallest eigenvalue is known to exceed `least`. With
/// eigenvalues a <= b <= c, det = a b c <= a ((b + c) / 2)^2 < a tr^2 / 4; in the plane det = a b < a tr.
#[inline(always)]
pub fn inverse_above(least: f64, m: DMat3, dimensions: u32) -> Option<DMat3> {
    let in_plane = m.x_axis.x + m.z_axis.z;
    let bound = if dimensions == 2 {
        m.determinant() / in_plane
    } else {
        4.0 * m.determinant() / (in_plane + m.y_axis.y).powi(2)
    };
    (bound > least).then(|| m.inverse())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_neighbourhoods_are_refused_whatever_their_determinant() {
        let diagonal = |x, y, z| DMat3::from_diagonal(DVec3::new(x, y, z));
        // A determinant of 0.3 with an eigenvalue of 0.05: its inverse would amplify twentyfold.
        assert_eq!(inverse(diagonal(0.05, 2.0, 3.0), 3), None);
        assert_eq!(inverse(diagonal(0.06, 1.0, 1.5), 2), None);
        assert_eq!(inverse(DMat3::ZERO, 3), None);
        let m = diagonal(0.5, 1.0, 1.2);
        assert_eq!(inverse(m, 3), Some(m.inverse()));
        assert_eq!(inverse(m, 2), Some(m.inverse()));
    }
}
