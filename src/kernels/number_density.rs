//! Particle number density, Eq. (4), and the free surface.
//! GPU twin: shaders/number_density.wgsl

use crate::fields::State;
use crate::lattice::weight;
use crate::params::Params;
use crate::row_arrays::{LANES, RowArrays, sum};
use crate::scheme::FreeSurface;
use glam::DVec3;

/// Distance of the neighbours' centroid, over l0, from which a thin particle counts as surface.
const OFFSET: f64 = 0.1;

/// Smallest distance used in weights, over l0: coincident particles must not give infinities.
pub const CLOSEST: f64 = 0.1;

/// Weights of `n` neighbours at distances `r.r`, Eq. (3), into `r.w`; pairs beyond the effective radius (the
/// collision may have moved them since the search) get 0.
#[inline(always)]
pub fn weights(n: usize, r: &mut RowArrays, params: &Params) {
    let (re, floor) = (params.effective_radius, CLOSEST * params.spacing);
    let filled = n.next_multiple_of(LANES);
    let RowArrays { r, w, .. } = r;
    r.map_squares(&mut w[..filled], |r2| weight(r2.sqrt().max(floor), re).max(0.0));
    w[n..filled].fill(0.0);
}

/// Number density of slot `i` and its part in the PPE; `r` gets distances and weights of its neighbours. `fluid` is
/// the number of fluid slots: a wall particle without fluid in reach is dry and inactive.
#[inline(always)]
pub fn number_density(
    i: usize,
    neighbour: &[u32],
    params: &Params,
    fluid: usize,
    position: &[DVec3],
    r: &mut RowArrays,
) -> (f64, State) {
    let filled = r.r.differences(i, neighbour, position);
    weights(neighbour.len(), r, params);
    let w = &r.w[..filled];
    let n = sum(w);
    let wet = i < fluid || neighbour.iter().zip(w).any(|(&j, &w)| (j as usize) < fluid && w > 0.0);
    if !wet {
        return (n, State::Inactive);
    }
    let threshold = params.free_surface_threshold * params.number_density;
    let surface = match params.free_surface {
        FreeSurface::Threshold => n < threshold,
        FreeSurface::ThresholdOffset => {
            n < 0.8 * threshold
                || (n < threshold && r.r.weighted_sum(w).length() > OFFSET * params.spacing * n)
        }
    };
    (n, if surface { State::Surface } else { State::Inner })
}
