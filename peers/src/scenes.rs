//! The scenes, their analytic answers and what is measured.

use crate::engines::State;
use glam::DVec3;

/// Standard gravity [m/s2].
const GRAVITY: f64 = 9.80665;
/// Coulomb coefficient [-].
const MU: f64 = 0.3;

/// A box of 1000 kg/m3 that moves freely.
#[derive(Clone, Copy, Debug, Default)]
pub struct Block {
    /// Edges [m].
    pub size: DVec3,
    /// Centre [m].
    pub center: DVec3,
    /// Velocity [m/s].
    pub velocity: DVec3,
    /// Angular velocity [rad/s].
    pub spin: DVec3,
}

/// What the states of all bodies are reduced to, one after the other; the last value counts.
pub type Measure = Box<dyn FnMut(usize, &State) -> f64>;

/// Boxes, on a floor whose surface is z = 0 if there is one.
pub struct Scene {
    /// What happens, and what is measured.
    pub name: &'static str,
    /// The bodies.
    pub blocks: Vec<Block>,
    /// Whether there is a floor.
    pub floor: bool,
    /// Gravity [m/s2]; a slope is a level floor with gravity turned.
    pub gravity: DVec3,
    /// Coulomb coefficient [-].
    pub friction: f64,
    /// Coefficient of restitution [-]; where there is none, nothing shall bounce: Rapier has 0 then, and seixo the critical damping
    /// that its documentation advises (a restitution of 0 would soften its springs).
    pub restitution: Option<f64>,
    /// Whether bodies turn about z alone.
    pub upright: bool,
    /// When it ends [s].
    pub end: f64,
    /// seixo's K [N/m] and spacing [m]; Rapier has no such numbers.
    pub spring: f64,
    /// See `spring`.
    pub spacing: f64,
    /// The analytic answer.
    pub exact: f64,
    /// What an error is taken over.
    pub scale: f64,
    /// What is measured.
    pub measure: fn() -> Measure,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            name: "",
            blocks: vec![Block {
                size: DVec3::new(0.2, 0.2, 0.1),
                center: DVec3::new(0.0, 0.0, 0.05),
                ..Block::default()
            }],
            floor: true,
            gravity: DVec3::new(0.0, 0.0, -GRAVITY),
            friction: MU,
            restitution: None,
            upright: false,
            end: 1.0,
            spring: 1e7,
            spacing: 0.02,
            exact: 0.0,
            scale: 1.0,
            measure: || Box::new(|_, s| s.at.x),
        }
    }
}

/// Gravity along a slope of `slope` (its tangent) and into it [m/s2].
fn on_slope(slope: f64) -> DVec3 {
    let angle = slope.atan();
    GRAVITY * DVec3::new(angle.sin(), 0.0, -angle.cos())
}

/// Way [m] until a square plate of edge 0.2 m that starts with 1 m/s and 20 rad/s stops, by the Coulomb field of an even
/// pressure, which a square's turn does not change much: its integral over 100 x 100 places, by steps of 0.1 ms.
fn spinning_stop() -> f64 {
    let (edge, dt, n) = (0.2, 1e-4, 100);
    let (mut v, mut w, mut way, mut angle) = (1.0_f64, 20.0_f64, 0.0, 0.0_f64);
    while v > 1e-3 || w > 1e-2 {
        let (mut force, mut torque) = (0.0, 0.0);
        let (sin, cos) = angle.sin_cos();
        for i in 0..n {
            for j in 0..n {
                let at = |k: i32| 0.5 * edge * ((2.0 * f64::from(k) + 1.0) / f64::from(n) - 1.0);
                let (p, q) = (at(i), at(j));
                let (x, y) = (p * cos - q * sin, p * sin + q * cos);
                let (sx, sy) = (v - w * y, w * x);
                let speed = sx.hypot(sy).max(1e-12);
                force += sx / speed;
                torque += (x * sy - y * sx) / speed;
            }
        }
        let each = MU * GRAVITY / f64::from(n * n);
        v = (v - dt * each * force).max(0.0);
        w = (w - dt * each * torque * 6.0 / (edge * edge)).max(0.0);
        way += dt * v;
        angle += dt * w;
    }
    way
}

/// Brick that turns about its middle axis: edges [m], spin [rad/s].
const BRICK: DVec3 = DVec3::new(0.3, 0.2, 0.1);
const TURNS: f64 = 10.0 * std::f64::consts::TAU;

/// Energy of the brick's turning over its mass [J/kg].
fn turning(state: &State) -> f64 {
    let own = state.orientation.inverse() * state.spin;
    let square = BRICK * BRICK;
    let inertia = DVec3::new(square.y + square.z, square.x + square.z, square.x + square.y) / 12.0;
    0.5 * inertia.dot(own * own)
}

/// All scenes.
pub fn scenes() -> Vec<Scene> {
    let standing = Scene::default().blocks[0];
    let threshold = on_slope(0.999 * MU);
    let angle = std::f64::consts::FRAC_PI_4;
    let slide = (4.0 / (GRAVITY * (angle.sin() - MU * angle.cos()))).sqrt();
    let stop = 4.0 / (2.0 * MU * GRAVITY);
    let spinning = spinning_stop();
    vec![
        Scene {
            name: "block at 2 m/s on a floor: way until it stops [m]",
            blocks: vec![Block { velocity: DVec3::new(2.0, 0.0, 0.0), ..standing }],
            exact: stop,
            scale: stop,
            ..Scene::default()
        },
        Scene {
            name: "block on a slope of 45 degrees: time for 2 m [s]",
            gravity: on_slope(1.0),
            end: 1.2,
            exact: slide,
            scale: slide,
            measure: || {
                let (mut before, mut crossed) = ((0.0, 0.0), f64::NAN);
                Box::new(move |_, s| {
                    if before.1 < 2.0 && s.at.x >= 2.0 {
                        crossed = before.0 + (s.time - before.0) * (2.0 - before.1) / (s.at.x - before.1);
                    }
                    before = (s.time, s.at.x);
                    crossed
                })
            },
            ..Scene::default()
        },
        Scene {
            name: "block on a slope 0.1 % below the threshold: creep in 5 s [m]",
            gravity: threshold,
            end: 5.0,
            ..Scene::default()
        },
        Scene {
            name: "plate at 1 m/s and 20 rad/s: way until it stops [m]",
            blocks: vec![Block {
                velocity: DVec3::new(1.0, 0.0, 0.0),
                spin: DVec3::new(0.0, 0.0, 20.0),
                ..standing
            }],
            upright: true,
            exact: spinning,
            scale: spinning,
            measure: || Box::new(|_, s| s.at.truncate().length()),
            ..Scene::default()
        },
        Scene {
            name: "bar of 1 x 0.02 x 0.02 m falls flat at 2 m/s, e = 0.3: restitution [-]",
            blocks: vec![Block {
                size: DVec3::new(1.0, 0.02, 0.02),
                center: DVec3::new(0.0, 0.0, 0.014),
                velocity: DVec3::new(0.0, 0.0, -2.0),
                ..Block::default()
            }],
            gravity: DVec3::ZERO,
            restitution: Some(0.3),
            end: 0.1,
            spacing: 0.01,
            exact: 0.3,
            measure: || Box::new(|_, s| s.velocity.z / 2.0),
            ..Scene::default()
        },
        Scene {
            name: "brick, 100 turns about its middle axis: largest change of energy over it [-]",
            blocks: vec![Block {
                size: BRICK,
                spin: DVec3::new(1e-3 * TURNS, TURNS, 0.0),
                ..Block::default()
            }],
            floor: false,
            gravity: DVec3::ZERO,
            end: 10.0,
            measure: || {
                let (mut most, spin) = (0.0_f64, DVec3::new(1e-3 * TURNS, TURNS, 0.0));
                let start = State {
                    time: 0.0,
                    at: DVec3::ZERO,
                    velocity: DVec3::ZERO,
                    orientation: glam::DQuat::IDENTITY,
                    spin,
                };
                let energy = turning(&start);
                Box::new(move |_, s| {
                    most = most.max((turning(s) / energy - 1.0).abs());
                    most
                })
            },
            ..Scene::default()
        },
        Scene {
            name: "stack of ten cubes of 0.1 m, 5 s: largest way of any [m]",
            blocks: (0..10)
                .map(|k| Block {
                    size: DVec3::splat(0.1),
                    center: DVec3::new(0.0, 0.0, 0.05 + 0.1 * f64::from(k)),
                    ..Block::default()
                })
                .collect(),
            end: 5.0,
            measure: || {
                let mut most = 0.0_f64;
                Box::new(move |k, s| {
                    let start = DVec3::new(0.0, 0.0, 0.05 + 0.1 * k as f64);
                    most = most.max((s.at - start).length());
                    most
                })
            },
            ..Scene::default()
        },
    ]
}
