//! Pressure gradient against the smallest pressure in the neighbourhood, Eq. (9), as an acceleration.
//! GPU twin: shaders/pressure_gradient.wgsl

use crate::fields::State;
use crate::neighbours::Row;
use crate::params::Params;
use crate::row_arrays::{Columns, RowArrays, dot};
use crate::scheme::Gradient;
use glam::{DMat3, DVec3};

/// Smallest determinant of the moment matrix at which its inverse is used; below, the neighbourhood is
/// too one-sided for a linear fit.
const DETERMINANT_MIN: f64 = 0.05;

/// -grad P / rho at fluid slot `i` [m/s2]. `all` holds every neighbour, of which the first `carry` carry pressure.
#[inline(always)]
pub fn pressure_gradient(
    i: usize,
    (all, carry): (Row, usize),
    state: State,
    params: &Params,
    position: &[DVec3],
    pressure: &[f64],
    arrays: &mut RowArrays,
) -> DVec3 {
    let correct = match params.gradient {
        Gradient::Minimum => false,
        Gradient::MinimumCorrected => state == State::Inner,
        Gradient::CorrectedSurface => true,
    };
    let n = if correct { all.neighbour.len() } else { carry };
    let RowArrays { r, v: sr, w: p, s } = arrays;
    let filled = r.differences(i, &all.neighbour[..n], position);
    let (p, s, weight) = (&mut p[..filled], &mut s[..filled], &all.weight[..n]);
    let mut minimum = pressure[i];
    for (p, &j) in p.iter_mut().zip(&all.neighbour[..carry]) {
        *p = pressure[j as usize];
        minimum = minimum.min(*p);
    }
    p[..carry].iter_mut().for_each(|p| *p -= minimum);
    p[carry..].fill(0.0);
    s[..n].copy_from_slice(weight);
    s[n..].fill(0.0);
    // w / r^2 times the distances.
    let (x, y, z) = (&r.x[..filled], &r.y[..filled], &r.z[..filled]);
    let (sx, sy, sz) = (&mut sr.x[..filled], &mut sr.y[..filled], &mut sr.z[..filled]);
    for k in 0..filled {
        let r2 = x[k] * x[k] + y[k] * y[k] + z[k] * z[k];
        let s = if r2 > 0.0 { s[k] / r2 } else { 0.0 };
        (sx[k], sy[k], sz[k]) = (s * x[k], s * y[k], s * z[k]);
    }
    let scale = f64::from(params.dimensions) / params.number_density;
    let mut gradient = scale * sr.weighted_sum(p);
    if correct {
        let m = moment(r, sr, filled, scale, params.dimensions);
        if m.determinant() > DETERMINANT_MIN {
            gradient = m.inverse() * gradient;
        }
    }
    -gradient / params.density
}

/// M = (d / n0) sum w r r^T / r^2 over all neighbours, of `r` and `sr` = w r / r^2; its inverse makes the gradient of
/// a linear field exact.
#[inline(always)]
fn moment(r: &Columns, sr: &Columns, filled: usize, scale: f64, dimensions: u32) -> DMat3 {
    let along_x = r.weighted_sum(&sr.x[..filled]);
    let yz = dot(&sr.y[..filled], &r.z);
    // The plane y = 0 has no moment across it.
    let yy = if dimensions == 2 { 1.0 / scale } else { dot(&sr.y[..filled], &r.y) };
    let zz = dot(&sr.z[..filled], &r.z);
    DMat3::from_cols(along_x, DVec3::new(along_x.y, yy, yz), DVec3::new(along_x.z, yz, zz)) * scale
}
