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
//!
//! Where impulses are shared, a particle of a free body's wall layer takes part with its part of the body's mass, so that
//! a light body is not thrown by what water of twenty times its mass does at once. Driven solids and fixed walls do not give way.

use super::Particles;
use crate::neighbours::Neighbours;
use crate::params::Params;
use crate::scene::{Drive, Solid};
use crate::scheme::Collision;
use glam::DVec3;

/// What collides: the particles, with `lightness` of each wall-layer slot of the moving solids, [`lightness`].
#[derive(Clone, Copy)]
pub struct Colliding<'a> {
    /// Particles.
    pub on: Particles<'a>,
    /// Their neighbours.
    pub rows: &'a Neighbours,
    /// [`lightness`] of each wall-layer slot of the moving solids.
    pub lightness: &'a [f64],
}

/// Mass of a particle of water over that part of the mass of `solid` for which one of its wall-layer particles stands; 0
/// if no force moves it, or if every pair acts alone.
pub fn lightness(solid: &Solid, params: &Params) -> f64 {
    match (&solid.drive, params.collision) {
        (Drive::Free(body), Collision::Shared) if body.gives_way() => {
            params.particle_mass() * solid.wall_slots.len() as f64 / body.mass
        }
        _ => 0.0,
    }
}

/// Velocity change of fluid slot `i` [m/s].
pub fn collision(i: usize, among: Colliding) -> DVec3 {
    let own = parts(i, among);
    let pair = |&j: &u32| {
        let change = rebound(i, j as usize, among.on);
        if change == DVec3::ZERO { change } else { change / (own + parts(j as usize, among)) }
    };
    among.rows.all(i).neighbour.iter().map(pair).sum()
}

/// Force of colliding fluid on wall-layer particle `i` [N]: the reaction.
pub fn reaction(i: usize, among: Colliding, dt: f64) -> DVec3 {
    let own = parts(i, among);
    let pair = |&j: &u32| {
        let change = rebound(i, j as usize, among.on);
        if change == DVec3::ZERO { change } else { change / (own + parts(j as usize, among)) }
    };
    let hits = among.rows.all(i).neighbour.iter().filter(|&&j| (j as usize) < among.on.fluid);
    among.on.params.particle_mass() / dt * hits.map(pair).sum::<DVec3>()
}

/// Inverse of the mass with which particle `i` takes part in each of its pairs, over that of a particle of water: the number
/// of its colliding pairs, at least one, times its lightness. 0 for what does not give way.
fn parts(i: usize, among: Colliding) -> f64 {
    let Colliding { on, rows, lightness } = among;
    let own = if i < on.fluid { 1.0 } else { lightness.get(i - on.fluid).copied().unwrap_or(0.0) };
    if own == 0.0 || on.params.collision == Collision::Single {
        return own;
    }
    let collides = |&&j: &&u32| (i.min(j as usize) < on.fluid) && rebound(i, j as usize, on) != DVec3::ZERO;
    own * rows.all(i).neighbour.iter().filter(collides).count().max(1) as f64
}

/// Velocity that i gains against j if j were immovable: -(1 + b) times the approach along the line.
#[inline(always)]
fn rebound(i: usize, j: usize, on: Particles) -> DVec3 {
    let r = on.offset(i, j);
    let r2 = r.length_squared();
    let closest = on.params.collision_distance;
    if r2 >= closest * closest || r2 == 0.0 {
        return DVec3::ZERO;
    }
    let approach = (on.velocity[i] - on.velocity[j]).dot(r);
    if approach <= 0.0 { DVec3::ZERO } else { -(1.0 + on.params.collision_restitution) * approach / r2 * r }
}
