//! The engines: each builds a scene its own way and tells the state of every body after every step.

use crate::scenes::Scene;
use glam::{DQuat, DVec3};
use rapier3d_f64::dynamics::FrictionModel;
use rapier3d_f64::prelude::{
    ColliderBuilder, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle, SharedShape, Vector,
};
use rustix::time::{ClockId, clock_gettime};
use seixo::body::Wrench;
use seixo::case::Case;
use seixo::contact::Solids;
use std::error::Error;
use std::fmt::Write;

/// A body at a time.
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// Time [s].
    pub time: f64,
    /// Centre [m].
    pub at: DVec3,
    /// Velocity of the centre [m/s].
    pub velocity: DVec3,
    /// Turns the body's frame into the world's.
    pub orientation: DQuat,
    /// Angular velocity [rad/s].
    pub spin: DVec3,
}

/// Who computes.
#[derive(Clone, Copy, Debug)]
pub enum Engine {
    /// seixo's law `smooth`.
    Seixo,
    /// Rapier with its default parameters.
    Rapier,
    /// Rapier with the twelve iterations that its documentation names for demanding scenes, instead of four.
    RapierCareful,
    /// Rapier with a constraint of friction for every point of contact, which its documentation calls the more accurate.
    RapierCoulomb,
}

/// CPU time of this process so far [s].
fn clock() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

fn vector(x: DVec3) -> Vector {
    Vector::new(x.x, x.y, x.z)
}

impl Engine {
    /// All of them, in the order of the table.
    pub const ALL: [Self; 4] = [Self::Seixo, Self::Rapier, Self::RapierCareful, Self::RapierCoulomb];

    /// Its name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Seixo => "seixo",
            Self::Rapier => "Rapier",
            Self::RapierCareful => "Rapier, 12 iterations",
            Self::RapierCoulomb => "Rapier, `Coulomb`",
        }
    }

    /// Steps of `dt` [s] to the end of `scene`; `watch` is told the body and its state after each. The CPU time of the
    /// steps [s].
    pub fn run(
        self,
        scene: &Scene,
        dt: f64,
        watch: &mut dyn FnMut(usize, &State),
    ) -> Result<f64, Box<dyn Error>> {
        let steps = (scene.end / dt).round() as u32;
        match self {
            Self::Seixo => seixo(scene, dt, steps, watch),
            _ => Ok(self.rapier(scene, dt, steps, watch)),
        }
    }

    fn rapier(self, scene: &Scene, dt: f64, steps: u32, watch: &mut dyn FnMut(usize, &State)) -> f64 {
        let mut world = PhysicsWorld::new();
        world.gravity = vector(scene.gravity);
        world.integration_parameters.dt = dt;
        match self {
            Self::RapierCareful => world.integration_parameters.num_solver_iterations = 12,
            Self::RapierCoulomb => world.integration_parameters.friction_model = FrictionModel::Coulomb,
            _ => {}
        }
        let surface = |half: DVec3| {
            let shape = ColliderBuilder::new(SharedShape::cuboid(half.x, half.y, half.z));
            shape.friction(scene.friction).restitution(scene.restitution.unwrap_or(0.0))
        };
        if scene.floor {
            let floor = surface(DVec3::new(2.5, 1.0, 0.1));
            world.insert_collider(floor.translation(Vector::new(1.5, 0.0, -0.1)), None);
        }
        let handles: Vec<RigidBodyHandle> = scene
            .blocks
            .iter()
            .map(|block| {
                let body = RigidBodyBuilder::dynamic()
                    .translation(vector(block.center))
                    .linvel(vector(block.velocity))
                    .angvel(vector(block.spin))
                    .enabled_rotations(!scene.upright, !scene.upright, true)
                    .can_sleep(false);
                world.insert(body, surface(0.5 * block.size).density(1000.0)).0
            })
            .collect();
        let start = clock();
        for step in 0..steps {
            world.step();
            let time = f64::from(step + 1) * dt;
            for (k, handle) in handles.iter().enumerate() {
                let body = &world.bodies[*handle];
                let of = |x: Vector| DVec3::new(x.x, x.y, x.z);
                let turn = body.rotation();
                let state = State {
                    time,
                    at: of(body.translation()),
                    velocity: of(body.linvel()),
                    orientation: DQuat::from_xyzw(turn.x, turn.y, turn.z, turn.w),
                    spin: of(body.angvel()),
                };
                watch(k, &state);
            }
        }
        clock() - start
    }
}

fn seixo(
    scene: &Scene,
    dt: f64,
    steps: u32,
    watch: &mut dyn FnMut(usize, &State),
) -> Result<f64, Box<dyn Error>> {
    let list = |x: DVec3| format!("{:?}", x.to_array());
    let damping = match scene.restitution {
        Some(e) => format!("restitution = {e:?}"),
        None => "damping_ratio = 1.0".into(),
    };
    let mut text = format!(
        "[run]\nspacing = {:?}\ntime_step = {dt:?}\nend = {:?}\ngravity = {}\n[contact]\nspring = {:?}\nfriction = {:?}\n\
         {damping}\n",
        scene.spacing,
        scene.end,
        list(scene.gravity),
        scene.spring,
        scene.friction
    );
    if scene.floor {
        text += "[[obstacle]]\nname = \"floor\"\nmin = [-1, -1, -0.2]\nmax = [4, 1, 0]\n";
    }
    for (k, block) in scene.blocks.iter().enumerate() {
        write!(
            text,
            "[[body]]\nname = \"block {k}\"\nsize = {}\ncenter = {}\ndensity = 1000\nvelocity = {}\nangular_velocity = {}\n",
            list(block.size),
            list(block.center),
            list(block.velocity),
            list(block.spin)
        )?;
        if scene.upright {
            text += "locked = [\"rotation_x\", \"rotation_y\"]\n";
        }
    }
    let case: Case = text.parse()?;
    let built = seixo::scene::Scene::build(&case)?;
    let mut solids = Solids::new(&built, case.contact.as_ref())?;
    let still = vec![Wrench::default(); scene.blocks.len()];
    let start = clock();
    for step in 0..steps {
        solids.advance(f64::from(step) * dt, dt, &still)?;
        let time = f64::from(step + 1) * dt;
        for (k, pose) in solids.poses().iter().enumerate() {
            let state = State {
                time,
                at: pose.position,
                velocity: pose.velocity,
                orientation: pose.orientation,
                spin: pose.angular_velocity,
            };
            watch(k, &state);
        }
    }
    Ok(clock() - start)
}
