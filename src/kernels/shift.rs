//! Shift: a particle whose neighbours lie more to one side moves a little to the other, without a change of velocity.
//! GPU twin: shaders/shift.wgsl
//!
//! The consistent gradient carries water exactly and does not care how the particles lie; Eq. (9)'s repulsion, which
//! spaced them, was noise of a tenth of gravity. Displacement (0.3 dt (sqrt(g l0) + |v|) l0) times the imbalance, after
//! the particle shifting of Lind et al. (2012); particles on the free surface stay. Where there is no free surface, or water pulls, the
//! fastest speed of the flow is added: particles are drawn out into lines where water parts, and v is zero there.

use super::Particles;
use super::predict::clamp_length;
use crate::neighbourhood::pair_vector;
use crate::neighbours::Row;
use crate::params::{Params, Step};
use glam::DVec3;

/// Displacement over dt times speed, l0 and imbalance [-].
pub const SHIFT: f64 = 0.3;
/// Longest displacement over the spacing [-].
pub const SHIFT_MAX: f64 = 0.05;

/// (d / n0) sum w r / r^2 over `all` neighbours of slot `i` [1/m]: zero where they lie evenly.
pub fn imbalance(i: usize, all: Row, on: Particles) -> DVec3 {
    all.iter().map(|(j, w)| pair_vector(i, j, w, on)).sum()
}

/// Displacement of a particle of velocity `v` in `step` [m].
#[inline(always)]
pub fn shift(imbalance: DVec3, v: DVec3, step: &Step, params: &Params) -> DVec3 {
    let l0 = params.spacing;
    let speed = step.shift_speed + v.length();
    clamp_length(-SHIFT * step.dt * speed * l0 * imbalance, SHIFT_MAX * l0).0
}
