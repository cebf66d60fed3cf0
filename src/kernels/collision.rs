//! Collision of particles that come too close (Lee et al. 2011), Eq. (18).
//! GPU twin: shaders/collision.wgsl
//!
//! Pairs closer than a l0 that still approach each other rebound with restitution b. All pairs of a
//! particle act at once on the velocities from before; fluid pairs exchange equal momentum.
//!
//! Where impulses are shared ([`Collision::Shared`]) a particle that collides with n others takes part in each of its
//! pairs with the n-th part of its mass. The parts of a particle leave their pairs with different velocities, and it
//! goes on with their mean: no pair adds energy, and the mean only takes some away, whatever the chain or heap
//! (mass splitting; Tonge, Benevolenski, Voroshilov 2012). Where every pair acts as if it were alone, as in Eq. (18), the
//! velocities of a long chain change by a factor of up to 1 - 2 (1 + b) = -1.4.

use super::Particles;
use crate::neighbours::Neighbours;
use crate::scheme::Collision;
use glam::DVec3;

/// Velocity change of fluid slot `i` [m/s].
pub fn collision(i: usize, rows: &Neighbours, on: Particles) -> DVec3 {
    let own = parts(i, rows, on);
    let pair = |&j: &u32| {
        let j = j as usize;
        let change = rebound(i, j, on);
        let other = if change == DVec3::ZERO || j >= on.fluid { 0.0 } else { parts(j, rows, on) };
        change / (own + other)
    };
    rows.all(i).neighbour.iter().map(pair).sum()
}

/// Force of colliding fluid on wall-layer particle `i` of a moving solid [N]: the reaction.
pub fn reaction(i: usize, rows: &Neighbours, on: Particles, dt: f64) -> DVec3 {
    let pair = |&j: &u32| {
        let change = rebound(i, j as usize, on);
        if change == DVec3::ZERO { change } else { change / parts(j as usize, rows, on) }
    };
    let hits = rows.all(i).neighbour.iter().filter(|&&j| (j as usize) < on.fluid);
    on.params.particle_mass() / dt * hits.map(pair).sum::<DVec3>()
}

/// Parts into which fluid particle `i` is split: the number of its colliding pairs, at least one.
fn parts(i: usize, rows: &Neighbours, on: Particles) -> f64 {
    match on.params.collision {
        Collision::Single => 1.0,
        Collision::Shared => {
            let collides = |&&j: &&u32| rebound(i, j as usize, on) != DVec3::ZERO;
            rows.all(i).neighbour.iter().filter(collides).count().max(1) as f64
        }
    }
}

/// Velocity that i gains against j if j were immovable: -(1 + b) times the approach along the line.
#[inline(always)]
fn rebound(i: usize, j: usize, on: Particles) -> DVec3 {
    let r = on.position[j] - on.position[i];
    let r2 = r.length_squared();
    let closest = on.params.collision_distance;
    if r2 >= closest * closest || r2 == 0.0 {
        return DVec3::ZERO;
    }
    let approach = (on.velocity[i] - on.velocity[j]).dot(r);
    if approach <= 0.0 { DVec3::ZERO } else { -(1.0 + on.params.collision_restitution) * approach / r2 * r }
}
