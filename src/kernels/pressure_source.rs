//! Right side and diagonal of the pressure Poisson equation, Eq. (8), times -1:
//!
//! A P = b,  A_ij = -c w_ij,  A_ii = c sum w_ij + alpha rho / dt^2,  c = 2 d / (lambda n0),
//!
//! over neighbours that carry pressure (dummies: no flux; surface particles: P = 0).
//! GPU twin: shaders/pressure_source.wgsl

use crate::neighbours::Row;
use crate::params::{Params, Step};
use crate::scheme::Source;
use glam::DVec3;

/// Coefficient c of the Laplacian, Eq. (6) [1/m2].
#[inline(always)]
pub fn laplacian_coefficient(params: &Params) -> f64 {
    2.0 * f64::from(params.dimensions) / (params.laplacian * params.number_density)
}

/// Right side b [Pa/m2] and diagonal [1/m2] of slot `i` with number density `n`. `all` holds every
/// neighbour, `pressure` those that carry pressure.
#[inline(always)]
pub fn pressure_source(
    i: usize,
    n: f64,
    (all, pressure): (Row, Row),
    params: &Params,
    step: &Step,
    position: &[DVec3],
    velocity: &[DVec3],
) -> (f64, f64) {
    let c = laplacian_coefficient(params);
    let links: f64 = pressure.weight.iter().sum();
    if links <= 0.0 {
        return (0.0, c);
    }
    let per_time = params.density / step.dt;
    let deviation = (n - params.number_density) / params.number_density;
    let mut b = step.relaxation * per_time / step.dt * deviation;
    if params.source == Source::Mixed {
        let (x, v) = (position[i], velocity[i]);
        let mut divergence = 0.0;
        for (j, w) in all.iter() {
            let r = position[j] - x;
            let r2 = r.length_squared();
            if r2 > 0.0 {
                divergence += (velocity[j] - v).dot(r) * w / r2;
            }
        }
        divergence *= f64::from(params.dimensions) / params.number_density;
        b -= (1.0 - step.relaxation) * per_time * divergence;
    }
    (b, c * links + step.compressibility * per_time / step.dt)
}
