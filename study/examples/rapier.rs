//! Five dry scenes by seixo's contact and by Rapier, side by side in one run: error against the analytic answer and time.
//!
//! `cargo run --release -p seixo-study --features rapier --example rapier`

use rapier3d_f64::prelude::{
    ColliderBuilder, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle, SharedShape, Vector,
};
use seixo::body::Wrench;
use seixo::case::Case;
use seixo::contact::Solids;
use seixo::error::Result;
use seixo::scene::Scene;
use seixo_study::contact_hard::coulomb_stop;
use seixo_study::dry::GRAVITY;
use std::time::Instant;

/// Time step [s].
const DT: f64 = 1e-3;
/// Coulomb coefficient [-].
const MU: f64 = 0.3;

/// Place, velocity and spin of a body at a time.
struct State {
    time: f64,
    at: [f64; 3],
    velocity: [f64; 3],
}

/// Boxes on a floor whose surface is z = 0.
#[derive(Default)]
struct Boxes {
    name: &'static str,
    /// Edges and centre of each [m].
    bodies: Vec<([f64; 3], [f64; 3])>,
    /// Velocity of the first [m/s], and its spin about z [rad/s].
    velocity: [f64; 3],
    spin: f64,
    gravity: [f64; 3],
    restitution: f64,
    /// Whether it turns about z alone.
    upright: bool,
    end: f64,
}

impl Boxes {
    fn seixo(&self, watch: &mut dyn FnMut(usize, &State)) -> Result<f64> {
        let mut text = format!(
            "[run]\nspacing = 0.02\ntime_step = {DT}\nend = 1\ngravity = {:?}\n[[obstacle]]\nname = \"floor\"\nmin = [-1, -1, -0.2]\n\
             max = [4, 1, 0]\n[contact]\nspring = 1e7\nfriction = {MU}\nrestitution = {:?}\n",
            self.gravity, self.restitution
        );
        for (k, (size, center)) in self.bodies.iter().enumerate() {
            let first = if k == 0 { 1.0 } else { 0.0 };
            let locked = if self.upright { "locked = [\"rotation_x\", \"rotation_y\"]\n" } else { "" };
            text += &format!(
                "[[body]]\nname = \"body {k}\"\nsize = {size:?}\ncenter = {center:?}\ndensity = 1000\nvelocity = {:?}\n\
                 angular_velocity = [0, 0, {:?}]\n{locked}",
                self.velocity.map(|v| first * v),
                first * self.spin
            );
        }
        let case: Case = text.parse()?;
        let scene = Scene::build(&case)?;
        let mut solids = Solids::new(&scene, case.contact.as_ref())?;
        let still = vec![Wrench::default(); self.bodies.len()];
        let clock = Instant::now();
        for step in 0..(self.end / DT) as usize {
            solids.advance(step as f64 * DT, DT, &still)?;
            for (k, pose) in solids.poses().iter().enumerate() {
                let time = (step + 1) as f64 * DT;
                watch(k, &State { time, at: pose.position.to_array(), velocity: pose.velocity.to_array() });
            }
        }
        Ok(clock.elapsed().as_secs_f64())
    }

    fn rapier(&self, watch: &mut dyn FnMut(usize, &State)) -> f64 {
        let vector = |x: [f64; 3]| Vector::new(x[0], x[1], x[2]);
        let mut world = PhysicsWorld::new();
        world.gravity = vector(self.gravity);
        world.integration_parameters.dt = DT;
        let surface = |shape: ColliderBuilder| shape.friction(MU).restitution(self.restitution);
        let floor = ColliderBuilder::new(SharedShape::cuboid(2.5, 1.0, 0.1));
        world.insert_collider(surface(floor).translation(Vector::new(1.5, 0.0, -0.1)), None);
        let mut insert = |k: usize| -> RigidBodyHandle {
            let (size, center) = self.bodies[k];
            let first = if k == 0 { 1.0 } else { 0.0 };
            let body = RigidBodyBuilder::dynamic()
                .translation(vector(center))
                .linvel(vector(self.velocity.map(|v| first * v)))
                .angvel(Vector::new(0.0, 0.0, first * self.spin))
                .enabled_rotations(!self.upright, !self.upright, true)
                .can_sleep(false);
            let half = size.map(|s| 0.5 * s);
            let shape = ColliderBuilder::new(SharedShape::cuboid(half[0], half[1], half[2]));
            world.insert(body, surface(shape).density(1000.0)).0
        };
        let handles: Vec<RigidBodyHandle> = (0..self.bodies.len()).map(&mut insert).collect();
        let clock = Instant::now();
        for step in 0..(self.end / DT) as usize {
            world.step();
            for (k, handle) in handles.iter().enumerate() {
                let (x, v) = (world.bodies[*handle].translation(), world.bodies[*handle].linvel());
                let time = (step + 1) as f64 * DT;
                watch(k, &State { time, at: [x.x, x.y, x.z], velocity: [v.x, v.y, v.z] });
            }
        }
        clock.elapsed().as_secs_f64()
    }
}

/// What a scene's states are reduced to, one state after the other; the last value counts.
type Measure = dyn FnMut(usize, &State) -> f64;

fn compare(scene: &Boxes, exact: f64, scale: f64, make: &dyn Fn() -> Box<Measure>) -> Result<()> {
    let run = |rapier: bool| -> Result<(f64, f64)> {
        let (mut measure, mut value) = (make(), f64::NAN);
        let mut watch = |k: usize, state: &State| value = measure(k, state);
        let seconds = if rapier { scene.rapier(&mut watch) } else { scene.seixo(&mut watch)? };
        Ok((value, seconds))
    };
    // by turns, the shorter time of both
    let ([a, b], [c, d]) = ([run(false)?, run(true)?], [run(false)?, run(true)?]);
    println!(
        "| {} | {exact:.5} | {:.5} | {:.1e} | {:.1} | {:.5} | {:.1e} | {:.1} |",
        scene.name,
        a.0,
        ((a.0 - exact) / scale).abs(),
        1e3 * a.1.min(c.1),
        b.0,
        ((b.0 - exact) / scale).abs(),
        1e3 * b.1.min(d.1)
    );
    Ok(())
}

fn main() -> Result<()> {
    println!(
        "| scene | exact | seixo | error | ms | Rapier | error | ms |\n|---|---|---|---|---|---|---|---|"
    );
    let down = [0.0, 0.0, -GRAVITY];
    let block = ([0.2, 0.2, 0.1], [0.0, 0.0, 0.05]);
    let slope = std::f64::consts::FRAC_PI_4;
    let slide = Boxes {
        name: "slope of 45 degrees, mu 0.3: time for 2 m [s]",
        bodies: vec![block],
        gravity: [GRAVITY * slope.sin(), 0.0, -GRAVITY * slope.cos()],
        end: 1.1,
        ..Boxes::default()
    };
    let time = (4.0 / (GRAVITY * (slope.sin() - MU * slope.cos()))).sqrt();
    compare(&slide, time, time, &|| {
        let (mut before, mut crossed) = ([0.0; 2], f64::NAN);
        Box::new(move |_, s| {
            if before[1] < 2.0 && s.at[0] >= 2.0 {
                crossed = s.time - DT * (s.at[0] - 2.0) / (s.at[0] - before[1]);
            }
            before = [s.time, s.at[0]];
            crossed
        })
    })?;
    let stop = Boxes {
        name: "block at 2 m/s: way until it stops [m]",
        bodies: vec![block],
        velocity: [2.0, 0.0, 0.0],
        gravity: down,
        end: 1.0,
        ..Boxes::default()
    };
    let way = 4.0 / (2.0 * MU * GRAVITY);
    compare(&stop, way, way, &|| Box::new(|_, s| s.at[0]))?;
    let plate = Boxes {
        name: "plate at 1 m/s and 20 rad/s: way until it stops [m]",
        velocity: [1.0, 0.0, 0.0],
        spin: 20.0,
        upright: true,
        ..Boxes { bodies: vec![block], gravity: down, end: 1.0, ..Boxes::default() }
    };
    let (way, _) = coulomb_stop((0.2, 0.2), MU, 1.0, 20.0);
    compare(&plate, way, way, &|| Box::new(|_, s| s.at[0].hypot(s.at[1])))?;
    let fall = Boxes {
        name: "cube falls 0.2 m, e 0.5: height of return [m]",
        bodies: vec![([0.1; 3], [0.0, 0.0, 0.25])],
        gravity: down,
        restitution: 0.5,
        end: 0.45,
        ..Boxes::default()
    };
    compare(&fall, 0.05, 0.05, &|| {
        let (mut up, mut highest) = (false, 0.0_f64);
        Box::new(move |_, s| {
            up |= s.velocity[2] > 0.0;
            highest = if up { highest.max(s.at[2] - 0.05) } else { 0.0 };
            highest
        })
    })?;
    let stack = Boxes {
        name: "stack of ten cubes of 0.1 m, 5 s: largest way of any [m]",
        bodies: (0..10).map(|k| ([0.1; 3], [0.0, 0.0, 0.05 + 0.1 * f64::from(k)])).collect(),
        gravity: down,
        end: 5.0,
        ..Boxes::default()
    };
    compare(&stack, 0.0, 1.0, &|| {
        let mut most = 0.0_f64;
        Box::new(move |k, s| {
            let start = 0.05 + 0.1 * k as f64;
            most = most.max(s.at[0].hypot(s.at[1]).hypot(s.at[2] - start));
            most
        })
    })
}
