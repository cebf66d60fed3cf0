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

/// -grad P / rho at fluid slot `i` [m/s2]. `all` holds every neighbour, of which the first `carry` carry pressure.
#[inline(always)]
pub fn pressure_gradient(
    i: usize,
    (all, carry): (Row, usize),
    state: State,
    params: &Params,
    position: &[DVec3],
    pressure: &[f64],
) -> DVec3 {
    let x = position[i];
    let minimum = all.neighbour[..carry].iter().fold(pressure[i], |m, &j| m.min(pressure[j as usize]));
    let correct = match params.gradient {
        Gradient::Minimum => false,
        Gradient::MinimumCorrected => state == State::Inner,
        Gradient::CorrectedSurface => true,
    };
    let mut sum = DVec3::ZERO;
    let mut moment = Moment::default();
    for (k, (j, w)) in all.iter().enumerate().take(if correct { usize::MAX } else { carry }) {
        let r = position[j] - x;
        let r2 = r.length_squared();
        if r2 > 0.0 {
            let s = w / r2;
            if k < carry {
                sum += (pressure[j] - minimum) * s * r;
            }
            if correct {
                moment.add(s, r);
            }
        }
    }
    let scale = f64::from(params.dimensions) / params.number_density;
    let mut gradient = scale * sum;
    if correct {
        let m = moment.matrix(scale, params.dimensions);
        if m.determinant() > DETERMINANT_MIN {
            gradient = m.inverse() * gradient;
        }
    }
    -gradient / params.density
}

/// M = (d / n0) sum w r r^T / r^2 over all neighbours; its inverse makes the gradient of a linear field exact.
#[derive(Default)]
struct Moment {
    xx: f64,
    xy: f64,
    xz: f64,
    yy: f64,
    yz: f64,
    zz: f64,
}

impl Moment {
    #[inline(always)]
    fn add(&mut self, s: f64, r: DVec3) {
        self.xx += s * r.x * r.x;
        self.xy += s * r.x * r.y;
        self.xz += s * r.x * r.z;
        self.yy += s * r.y * r.y;
        self.yz += s * r.y * r.z;
        self.zz += s * r.z * r.z;
    }

    fn matrix(&self, scale: f64, dimensions: u32) -> DMat3 {
        // The plane y = 0 has no moment across it.
        let yy = if dimensions == 2 { 1.0 / scale } else { self.yy };
        let columns = [[self.xx, self.xy, self.xz], [self.xy, yy, self.yz], [self.xz, self.yz, self.zz]];
        DMat3::from_cols_array_2d(&columns) * scale
    }
}
