//! Pressure of the particles on the free surface: water at rest has P = 0 half a spacing outside their centres.
//! GPU twin: shaders/surface_pressure.wgsl
//!
//! P_s = |grad P| l0 / 2 with the gradient that acts on them ([`super::pressure_gradient`]) and the pressures of the last step. It halves
//! the distance to its fixed point each step: rows below follow P_s, P = P_s + G l0, so that the next is P_s / 2 + G l0 / 4. In free
//! fall it is zero, and where the water below pulls: below zero the surface's particles would draw each other together, the nearer the more. Walls beside the surface have the mean pressure of the surface's particles around them, less what lies between.

use super::Particles;
use super::pressure_gradient::hydrostatic;
use crate::fields::State;
use crate::neighbourhood::pair_vector;
use crate::neighbours::Row;
use glam::DVec3;

/// P_s of slot `i` [Pa], 0 if it does not lie on the surface, from its neighbours that carry `pressure` [Pa].
pub fn surface_pressure(i: usize, carriers: Row, state: &[State], on: Particles, pressure: &[f64]) -> f64 {
    if state[i] != State::Surface {
        return 0.0;
    }
    if i < on.fluid {
        let (mut sum, mut level) = (DVec3::ZERO, 0.0);
        for (j, w) in carriers.iter() {
            sum += (pressure[j] + pressure[i]) * pair_vector(i, j, w, on);
            level += (pressure[j] + pressure[i]) * w;
        }
        return if level < 0.0 { 0.0 } else { 0.5 * on.params.spacing * sum.length() };
    }
    beside_surface(i, carriers, state, on, pressure).map_or(0.0, |p| p.max(0.0))
}

/// Pressure of a wall's slot `i` beside the surface, as that of the surface's particles around it has it [Pa]: less than 0 above the water; none
/// where no such particle is near.
pub fn beside_surface(
    i: usize,
    carriers: Row,
    state: &[State],
    on: Particles,
    pressure: &[f64],
) -> Option<f64> {
    let (mut weight, mut sum, mut height) = (0.0, 0.0, 0.0);
    for (j, w) in carriers.iter().filter(|&(j, _)| j < on.fluid && state[j] == State::Surface) {
        weight += w;
        sum += w * pressure[j];
        height += w * hydrostatic(on.offset(j, i), on.params);
    }
    (weight > 0.0).then(|| (sum + height.min(0.0)) / weight)
}
