//! What the pressure of a wall's row is above that on the wall's surface, but for the weight of the water between: the *excess*.
//!
//! A wall's row undoes divergence and deviation by a pressure above that of the water before it. Water is driven by its own pressure and the
//! wall's together: what it gains is the pressure half way between the two, on the surface, and that is what gauges tell. Hence
//! P_i - P_s = (P_i - (sum w P_j - rho g . sum w r) / sum w) / 2, nothing in still water on any arrangement.
//! GPU twin: shaders/wall_excess.wgsl

use super::Particles;
use super::number_density::pair_weight;
use super::pressure_gradient::hydrostatic;

/// Part of the way from a wall's particle to the water before it at which the surface lies: 0.494 of the mean distance under a lattice.
pub const SURFACE: f64 = 0.5;

/// Excess of the wall's row `i` [Pa]; `carriers` are its neighbours that carry pressure.
pub fn wall_excess(i: usize, carriers: &[u32], on: Particles, pressure: &[f64]) -> f64 {
    let (mut links, mut sum) = (0.0, 0.0);
    for j in carriers.iter().map(|&j| j as usize) {
        let r = on.offset(i, j);
        let w = pair_weight(r.length_squared(), on.params);
        links += w;
        sum += w * (pressure[i] - pressure[j] + hydrostatic(r, on.params));
    }
    if links > 0.0 { SURFACE * sum / links } else { 0.0 }
}
