//! [`crate::neighbourhood`], several neighbours at a time.

use super::row_arrays::{Columns, dot};
use crate::neighbourhood::weight_over_square;
use glam::{DMat3, DVec3};

/// e = w / r^2 r of each neighbour into `e`; `r` and `w` are filled up with zeros.
#[inline(always)]
pub(crate) fn pair_vectors(r: &Columns, w: &[f64], re: f64, e: &mut Columns) {
    let n = w.len();
    let (x, y, z) = (&r.x[..n], &r.y[..n], &r.z[..n]);
    let (ex, ey, ez) = (&mut e.x[..n], &mut e.y[..n], &mut e.z[..n]);
    for k in 0..n {
        let s = weight_over_square(w[k], re);
        (ex[k], ey[k], ez[k]) = (s * x[k], s * y[k], s * z[k]);
    }
}

/// M over the `filled` neighbours of `r` and `e` with `scale` = d / n0.
#[inline(always)]
pub fn moment(r: &Columns, e: &Columns, filled: usize, scale: f64, dimensions: u32) -> DMat3 {
    let along_x = r.weighted_sum(&e.x[..filled]);
    let yz = dot(&e.y[..filled], &r.z);
    // The plane y = 0 has no moment across it.
    let yy = if dimensions == 2 { 1.0 / scale } else { dot(&e.y[..filled], &r.y) };
    let zz = dot(&e.z[..filled], &r.z);
    DMat3::from_cols(along_x, DVec3::new(along_x.y, yy, yz), DVec3::new(along_x.z, yz, zz)) * scale
}
