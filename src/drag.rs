//! How fast water takes free bodies along by its viscosity and by its friction on their walls.
//!
//! What the water does to a body is found with the body's velocity at the start of the step, so that a step is at most the time in
//! which the body would take over the water's velocity, 1 / rate: short for one that is light for its surface.
//! The rate is the largest eigenvalue of M^-1 D, M the body's mass and inertia and D u the force and torque with which water at
//! rest resists the motion u, six numbers, of a body that is wholly under water:
//!
//! D = sum k J^T J over the wall layer, J u the velocity of the surface before it, k the force over it [kg/s]. In the paper's scheme it is the velocity
//! of the layer itself, half a spacing below: for turns D is a little too large there, of a free vessel for what it holds a little too small.
//!
//! In steps of 1 / rate, and no longer than what a particle of water allows, nothing grows: sum k (v - J u)^2 is at most twice
//! sum k v^2 + sum k (J u)^2, so that no eigenvalue of body and water together is more than twice the larger of theirs. The water
//! that moves along with the body (its added mass) is left out: turns of round bodies have none.

use crate::body::{Body, Wrench};
use crate::case::Case;
use crate::contact::broad::PointGrid;
use crate::error::Result;
use crate::kernels::number_density;
use crate::kernels::viscosity::{coefficient, pair_weight};
use crate::params::{Drag, Params};
use crate::scene::{Scene, Solid};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Iterations that find the largest eigenvalue; it is among six, and half of it would do for the order of a step.
const ITERATIONS: usize = 60;

/// The constants of a run of `case` in `scene`, with what bounds its steps.
///
/// # Errors
/// Those of [`Params::new`].
pub fn params(case: &Case, scene: &Scene) -> Result<Params> {
    let params = Params::new(case, scene)?;
    Ok(Params { drag: of_bodies(scene, &params), ..params })
}

/// Of the free bodies of `scene`; zero where none is, or nothing drags.
fn of_bodies(scene: &Scene, params: &Params) -> Drag {
    let dry = scene.groups.fluid == 0 || (params.viscosity == 0.0 && params.wall_friction == 0.0);
    let free: Vec<&Solid> = scene.solids.iter().filter(|solid| !dry && solid.gives_way()).collect();
    let each: Vec<Drag> = free.par_iter().map(|solid| of(solid, params)).collect();
    each.into_iter().fold(Drag::default(), |most, one| {
        let ([viscous, friction], [by_viscosity, by_friction]) = (most.bodies, one.bodies);
        Drag {
            viscous: most.viscous.max(one.viscous),
            friction: most.friction.max(one.friction),
            bodies: [
                if one.viscous > most.viscous { by_viscosity } else { viscous },
                if one.friction > most.friction { by_friction } else { friction },
            ],
        }
    })
}

fn of(solid: &Solid, params: &Params) -> Drag {
    let body = Body::new(solid, params.dimensions);
    let own = solid.wall_offset.iter().chain(&solid.dummy_offset).copied().collect();
    let own = PointGrid::new(own, params.effective_radius);
    let (mut viscous, mut friction) = (Resistance::default(), Resistance::default());
    let shear = coefficient(params) * params.shear.wall;
    for (k, &x) in solid.wall_offset.iter().enumerate() {
        // Water stands where the body's own particles do not.
        let (mut sheared, mut rubbed) = (params.shear.sum, params.number_density);
        own.near(x, params.effective_radius, |n| {
            let r2 = own.point(n).distance_squared(x);
            if r2 > 0.0 {
                sheared -= pair_weight(r2, params);
                rubbed -= number_density::pair_weight(r2, params);
            }
        });
        let arm = solid.orientation * (x + solid.wall_to_surface[k]);
        viscous.add(params.particle_mass() * shear * sheared.max(0.0), arm);
        friction.add(params.particle_mass() * params.wall_friction * rubbed.max(0.0), arm);
        let area = solid.orientation * solid.wall_area[k];
        viscous.turn(params.density * params.viscosity, arm, area);
    }
    let [viscous, friction] = [viscous, friction].map(|resistance| resistance.rate(&body));
    Drag { viscous, friction, bodies: [0, 1].map(|_| solid.name.clone()) }
}

/// D, by its sums.
#[derive(Clone, Copy, Debug)]
struct Resistance {
    /// sum k [kg/s].
    sum: f64,
    /// sum k r [kg m/s].
    first: DVec3,
    /// What resists turns [kg m2/s].
    turns: DMat3,
}

impl Default for Resistance {
    fn default() -> Self {
        // A matrix is by default the identity.
        Self { sum: 0.0, first: DVec3::ZERO, turns: DMat3::ZERO }
    }
}

impl Resistance {
    /// A particle of the wall layer with `k` [kg/s]: on the surface, at `arm` [m].
    fn add(&mut self, k: f64, arm: DVec3) {
        self.sum += k;
        self.first += k * arm;
        self.turn(k, arm, arm);
    }

    /// The torque -k arm x (omega x b), symmetric: of a force, or of [`crate::kernels::body_force::turning`].
    fn turn(&mut self, k: f64, arm: DVec3, b: DVec3) {
        let one = k * around(arm, b);
        self.turns += 0.5 * (one + one.transpose());
    }

    /// D u.
    fn of(&self, velocity: DVec3, turn: DVec3) -> Wrench {
        Wrench {
            force: self.sum * velocity + turn.cross(self.first),
            torque: self.first.cross(velocity) + self.turns * turn,
        }
    }

    /// Largest eigenvalue of M^-1 D [1/s].
    fn rate(&self, body: &Body) -> f64 {
        let answer = |w: Wrench| (body.inverse_mass * w.force, body.inverse_inertia * w.torque);
        // Something of every mode: no shape is symmetric to this.
        let mut u = answer(Wrench { force: DVec3::new(1.0, 1.3, 0.7), torque: DVec3::new(0.6, 0.9, 1.1) });
        let mut rate = 0.0;
        for _ in 0..ITERATIONS {
            let resisted = self.of(u.0, u.1);
            let power = resisted.force.dot(u.0) + resisted.torque.dot(u.1);
            if power <= 0.0 {
                break;
            }
            let next = answer(resisted);
            rate = (resisted.force.dot(next.0) + resisted.torque.dot(next.1)) / power;
            u = (next.0 / rate, next.1 / rate);
        }
        rate
    }
}

/// The matrix of omega -> a x (omega x b).
fn around(a: DVec3, b: DVec3) -> DMat3 {
    a.dot(b) * DMat3::IDENTITY - DMat3::from_cols(b * a.x, b * a.y, b * a.z)
}
