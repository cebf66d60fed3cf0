//! What the pressure of a wall's row is above that on the wall's surface, but for the weight of the water between: the *excess*.
//!
//! A wall's row undoes divergence and deviation by a pressure above that of the water before it. Water is driven by its own pressure and the
//! wall's together: what it gains is the pressure half way between the two, on the surface. That is what gauges tell and what moves bodies,
//! P_i - E_i and the weight's head, with
//!
//! E_i = (sum w (P_i - P_j) + rho g . sum w r) / (2 sum w),
//!
//! nothing in still water on any arrangement. The equation of the row says what that will be before it is solved, but for what the body's own
//! acceleration adds, the inertia of the water between: [`known_excess`]. Free bodies answer the pressure within the solve and need the whole, and
//! what is missing is taken from the last step: they answer A^n = known^n + (E - known)^(n-1), of which the last is `inertia_head`, with E of the solution. Summed
//! over steps that is what the water feels but for the inertia of one step. The cut of negative pressures (water does not pull) changes P - E in a way that no
//! equation knew; light bodies feel a part of that alone ([`cut_share`]), or they were thrown about.
//! GPU twin: shaders/wall_excess.wgsl

use super::Particles;
use super::number_density::pair_weight;
use super::pressure_gradient::hydrostatic;
use crate::params::Params;
use crate::scene::{Drive, FreeBody, Solid};

/// Part of the way from a wall's particle to the water before it at which the surface lies: 0.494 of the mean distance under a lattice.
pub const SURFACE: f64 = 0.5;

/// Part that `solid` feels in the same step of what the cut changes, which no equation knew: 1, but M / m of a body lighter than m, and 0 of a solid that is not
/// free, or held. M is its mass, m that of the water between its wall layer and its surface, rho / d . sum A . way over its faces.
pub fn cut_share(solid: &Solid, params: &Params) -> f64 {
    let Drive::Free(FreeBody { mass, .. }) = &solid.drive else { return 0.0 };
    if !solid.gives_way() {
        return 0.0;
    }
    let faces = (0..solid.wall_area.len()).flat_map(|k| solid.faces(k));
    let layer: f64 = faces.map(|face| face.area.dot(face.way)).sum();
    (mass * f64::from(params.dimensions) / (params.density * layer)).min(1.0)
}

/// Excess of the wall's row `i` [Pa]; `carriers` are its neighbours that carry pressure.
pub fn wall_excess(i: usize, carriers: &[u32], on: Particles, pressure: &[f64]) -> f64 {
    half(i, carriers, on, |links| links * pressure[i], |j| pressure[j])
}

/// What the equation of the row `i`, whose right side is `source` times the Laplacian's coefficient, says of its excess [Pa].
/// `surface_pressure` is empty where it is 0.
pub fn known_excess(i: usize, carriers: &[u32], on: Particles, source: f64, surface_pressure: &[f64]) -> f64 {
    let known = |j: usize| if surface_pressure.is_empty() { 0.0 } else { surface_pressure[j] };
    half(i, carriers, on, |_| source, known)
}

/// (own - sum w (P_j - rho g . r)) / (2 sum w), with own of sum w.
fn half(
    i: usize,
    carriers: &[u32],
    on: Particles,
    own: impl Fn(f64) -> f64,
    pressure: impl Fn(usize) -> f64,
) -> f64 {
    let (mut links, mut sum) = (0.0, 0.0);
    for j in carriers.iter().map(|&j| j as usize) {
        let r = on.offset(i, j);
        let w = pair_weight(r.length_squared(), on.params);
        links += w;
        sum += w * (hydrostatic(r, on.params) - pressure(j));
    }
    if links > 0.0 { SURFACE * (own(links) + sum) / links } else { 0.0 }
}
