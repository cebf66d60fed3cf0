//! Particle number density, Eq. (4), and the free surface.
//! GPU twin: shaders/number_density.wgsl

use crate::case::FreeSurface;
use crate::fields::State;
use crate::neighbours::Row;
use crate::params::{Params, weight};
use glam::DVec3;

/// Distance of the neighbours' centroid, over l0, from which a thin particle counts as surface.
const OFFSET: f64 = 0.1;

/// Smallest distance used in weights, over l0: coincident particles must not give infinities.
pub const CLOSEST: f64 = 0.1;

/// Weights of all neighbours of slot `i`, Eq. (3); pairs beyond the effective radius (the collision may
/// have moved them since the search) get 0.
#[inline(always)]
pub fn weights(i: usize, neighbour: &[u32], out: &mut [f64], params: &Params, position: &[DVec3]) {
    let re = params.effective_radius;
    let floor = CLOSEST * params.spacing;
    let x = position[i];
    for (w, &j) in out.iter_mut().zip(neighbour) {
        let r = position[j as usize].distance(x).max(floor);
        *w = weight(r, re).max(0.0);
    }
}

/// Number density of slot `i` and its part in the PPE. `fluid` is the number of fluid slots: a wall
/// particle without fluid in reach is dry and inactive.
#[inline(always)]
pub fn number_density(i: usize, row: Row, params: &Params, fluid: usize, position: &[DVec3]) -> (f64, State) {
    let x = position[i];
    let (mut n, mut centroid, mut wet) = (0.0, DVec3::ZERO, i < fluid);
    for (j, w) in row.iter() {
        n += w;
        centroid += w * (position[j] - x);
        wet |= j < fluid && w > 0.0;
    }
    if !wet {
        return (n, State::Inactive);
    }
    let threshold = params.free_surface_threshold * params.number_density;
    let surface = match params.free_surface {
        FreeSurface::Threshold => n < threshold,
        FreeSurface::ThresholdOffset => {
            n < 0.8 * threshold || (n < threshold && centroid.length() > OFFSET * params.spacing * n)
        }
    };
    (n, if surface { State::Surface } else { State::Inner })
}
