//! Friction of the fluid on walls whose boundary layer is thinner than a spacing: tau = rho C_f |u_t| u_t, where u_t is
//! what lies along the wall of the water's velocity over it. It acts on the water next to walls and on the solids that it
//! slides along, after the search and before the pressure.
//! GPU twin: shaders/wall_friction.wgsl
//!
//! C_f is half the skin friction coefficient of a flat plate, c_f / 2, and g n^2 / h^(1/3) of Manning's n in water of
//! depth h: 0.0025 for smooth walls at the Reynolds numbers of a laboratory's dam break, 1e5 to 1e6. Where
//! particles resolve the boundary layer, viscosity (Eq. 2) makes the shear stress, and this term is C_f |u_t| l0 / (2 nu) of
//! it: little.
//!
//! A pair of water and wall layer has the share w_ij / sum w of the stress on the wall particle's l0^2, the sum over
//! the water above a flat wall ([`crate::lattice::Lattice::wall_contact`]). The step is implicit,
//! u_t <- u_t / (1 + dt k |u_t|): it slows the water at any time step and never turns it round. First order in dt.

use super::Particles;
use super::number_density::pair_weight;
use crate::neighbourhood::weight_over_square;
use glam::DVec3;

/// Acceleration of fluid slot `i` [m/s2], and the sum of its weights with wall layers [-]; `carriers` are its
/// neighbours that carry pressure.
pub fn wall_friction(i: usize, carriers: &[u32], on: Particles, dt: f64) -> (DVec3, f64) {
    let (mut sum, mut velocity, mut normal) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for j in carriers.iter().map(|&j| j as usize).filter(|&j| j >= on.fluid) {
        let r = on.offset(i, j);
        let w = pair_weight(r.length_squared(), on.params);
        sum += w;
        velocity += w * on.velocity[j];
        normal += weight_over_square(w, on.params.effective_radius) * r;
    }
    if sum == 0.0 {
        return (DVec3::ZERO, 0.0);
    }
    let normal = normal.normalize_or_zero();
    let over = on.velocity[i] - velocity / sum;
    let along = over - over.dot(normal) * normal;
    let rate = on.params.wall_friction * sum * along.length();
    (-rate / (1.0 + dt * rate) * along, sum)
}

/// Force on wall-layer particle `j` [N]: what its `carriers` of water lose to it, of each of which [`wall_friction`] is known.
pub fn reaction(
    j: usize,
    carriers: &[u32],
    friction: impl Fn(usize) -> (DVec3, f64),
    on: Particles,
) -> DVec3 {
    let wet = carriers.iter().map(|&i| i as usize).filter(|&i| i < on.fluid);
    let taken = wet.map(|i| {
        let (acceleration, sum) = friction(i);
        let w = pair_weight(on.offset(i, j).length_squared(), on.params);
        if sum > 0.0 { -w / sum * acceleration } else { DVec3::ZERO }
    });
    on.params.particle_mass() * taken.sum::<DVec3>()
}
