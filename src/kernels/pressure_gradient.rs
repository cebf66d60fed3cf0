//! Pressure gradient against the smallest pressure in the neighbourhood, Eq. (9), as an acceleration.
//! GPU twin: shaders/pressure_gradient.wgsl

use crate::case::Gradient;
use crate::fields::State;
use crate::neighbours::Row;
use crate::params::Params;
use glam::{DMat3, DVec3};

/// Smallest determinant of the moment matrix at which its inverse is used; below, the neighbourhood is
/// too one-sided for a linear fit.
const DETERMINANT_MIN: f64 = 0.05;

/// -grad P / rho at fluid slot `i` [m/s2]. `all` holds every neighbour, `row` those that carry pressure.
#[inline(always)]
pub fn pressure_gradient(
    i: usize,
    (all, row): (Row, Row),
    state: State,
    params: &Params,
    position: &[DVec3],
    pressure: &[f64],
) -> DVec3 {
    let x = position[i];
    let minimum = row.neighbour.iter().fold(pressure[i], |m, &j| m.min(pressure[j as usize]));
    let mut sum = DVec3::ZERO;
    for (j, w) in row.iter() {
        let r = position[j] - x;
        let r2 = r.length_squared();
        if r2 > 0.0 {
            sum += (pressure[j] - minimum) * w / r2 * r;
        }
    }
    let scale = f64::from(params.dimensions) / params.number_density;
    let mut gradient = scale * sum;
    if params.gradient == Gradient::MinimumCorrected && state == State::Inner {
        gradient = corrected(gradient, all, x, scale, params, position);
    }
    -gradient / params.density
}

/// `gradient` times the inverse of M = (d / n0) sum w r r^T / r^2 over all neighbours, which makes the
/// gradient of a linear field exact.
#[inline(always)]
fn corrected(gradient: DVec3, all: Row, x: DVec3, scale: f64, params: &Params, position: &[DVec3]) -> DVec3 {
    let (mut xx, mut xy, mut xz, mut yy, mut yz, mut zz) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (j, w) in all.iter() {
        let r = position[j] - x;
        let r2 = r.length_squared();
        if r2 > 0.0 {
            let s = scale * w / r2;
            xx += s * r.x * r.x;
            xy += s * r.x * r.y;
            xz += s * r.x * r.z;
            yy += s * r.y * r.y;
            yz += s * r.y * r.z;
            zz += s * r.z * r.z;
        }
    }
    if params.dimensions == 2 {
        yy = 1.0;
    }
    let m = DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz));
    if m.determinant() > DETERMINANT_MIN { m.inverse() * gradient } else { gradient }
}
