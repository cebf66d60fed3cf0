//! Particle number density, Eq. (4), and the free surface.
//! GPU twin: shaders/number_density.wgsl

use super::Particles;
use crate::fields::State;
use crate::lattice::weight;
use crate::params::Params;
use crate::scheme::FreeSurface;
use glam::DVec3;

/// Distance of the neighbours' centroid, over l0, from which a thin particle counts as surface; 0.49 for one of a flat surface in the plane, 0.38 in space, and as
/// Tsukamoto, Cheng and Motezuki (2016) have it. Already 0.1 takes water beside a thin edge of a solid for surface, now and then.
const OFFSET: f64 = 0.2;

/// Smallest distance used in weights, over l0: coincident particles must not give infinities.
pub const CLOSEST: f64 = 0.1;

/// Weight of a pair at a distance of sqrt(`r2`), Eq. (3) [-]; 0 beyond the effective radius: the collision may have
/// moved the pair since the search.
#[inline(always)]
pub fn pair_weight(r2: f64, params: &Params) -> f64 {
    weight(r2.sqrt().max(CLOSEST * params.spacing), params.effective_radius).max(0.0)
}

/// Number density of slot `i`, Eq. (4) [-], and its part in the PPE; the first `carry` of its neighbours carry pressure.
pub fn number_density(i: usize, neighbour: &[u32], carry: usize, on: Particles) -> (f64, State) {
    let offset = |j: u32| on.offset(i, j as usize);
    let w = |j: u32| pair_weight(offset(j).length_squared(), on.params);
    let n: f64 = neighbour.iter().map(|&j| w(j)).sum();
    // A wall particle without fluid before it is dry.
    let mut carriers = neighbour[..carry].iter();
    let wet = i < on.fluid || carriers.any(|&j| (j as usize) < on.fluid && w(j) > 0.0);
    let centroid = || neighbour.iter().map(|&j| w(j) * offset(j)).sum();
    (n, if wet { free_surface(n, centroid, on.params) } else { State::Inactive })
}

/// Whether a particle of number density `n` lies on the free surface; `first_moment` is sum w r.
#[inline(always)]
pub fn free_surface(n: f64, first_moment: impl FnOnce() -> DVec3, params: &Params) -> State {
    let threshold = params.free_surface_threshold * params.number_density;
    let surface = match params.free_surface {
        FreeSurface::Threshold => n < threshold,
        FreeSurface::ThresholdOffset => {
            n < 0.8 * threshold || (n < threshold && first_moment().length() > OFFSET * params.spacing * n)
        }
    };
    if surface { State::Surface } else { State::Inner }
}
