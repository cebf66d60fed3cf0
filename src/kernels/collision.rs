//! Collision of particles that come too close (Lee et al. 2011), Eq. (18).
//! GPU twin: shaders/collision.wgsl
//!
//! Pairs closer than a l0 that still approach each other rebound with restitution b. All pairs of a
//! particle act at once on the velocities from before; fluid pairs exchange equal momentum.

use crate::neighbours::Row;
use crate::params::Params;
use glam::DVec3;

/// Velocity change of fluid slot `i` [m/s].
#[inline(always)]
pub fn collision(
    i: usize,
    row: Row,
    params: &Params,
    fluid: usize,
    position: &[DVec3],
    velocity: &[DVec3],
) -> DVec3 {
    let mut change = DVec3::ZERO;
    for &j in row.neighbour {
        let share = if (j as usize) < fluid { 0.5 } else { 1.0 };
        change += share * rebound(i, j as usize, params, position, velocity);
    }
    change
}

/// Force of colliding fluid on wall-layer particle `i` of a moving solid [N]: the reaction.
#[inline(always)]
pub fn reaction(
    i: usize,
    row: Row,
    params: &Params,
    fluid: usize,
    position: &[DVec3],
    velocity: &[DVec3],
    dt: f64,
) -> DVec3 {
    let hits = row.neighbour.iter().filter(|&&j| (j as usize) < fluid);
    let change: DVec3 = hits.map(|&j| rebound(i, j as usize, params, position, velocity)).sum();
    params.particle_mass() / dt * change
}

/// Velocity that i gains against j if j were immovable: -(1 + b) times the approach along the line.
#[inline(always)]
fn rebound(i: usize, j: usize, params: &Params, position: &[DVec3], velocity: &[DVec3]) -> DVec3 {
    let r = position[j] - position[i];
    let r2 = r.length_squared();
    let closest = params.collision_distance;
    if r2 >= closest * closest || r2 == 0.0 {
        return DVec3::ZERO;
    }
    let approach = (velocity[i] - velocity[j]).dot(r);
    if approach <= 0.0 { DVec3::ZERO } else { -(1.0 + params.collision_restitution) * approach / r2 * r }
}
