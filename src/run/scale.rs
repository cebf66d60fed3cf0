//! Speeds and energies that a scene can come to by itself, or is given.

use crate::params::Params;
use crate::scene::{Drive, Motion, Scene, Solid};
use crate::simulation::Simulation;
use crate::time_step::collapse_speed;
use glam::{DMat3, DQuat, DVec3};

/// Speeds and energies that a scene can come to by itself, or is given.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Speed [m/s].
    pub(super) speed: f64,
    /// Energy [J].
    pub(super) energy: f64,
    /// Energy that gravity along periodic axes may give it, and what is moved [J].
    pub(super) given: [f64; 2],
    /// Whether anything is moved to and fro, or round and round: it may put in any energy.
    pub(super) stirred: bool,
    /// Energy that water may have that comes in, and lack that goes out, over its mass [J/kg].
    pub(super) through: (f64, f64),
    /// Mass of a particle of water [kg].
    pub(super) particle: f64,
}

/// What the motions of driven solids and openings come to.
#[derive(Clone, Copy, Debug, Default)]
struct Driven {
    /// Their largest speed [m/s].
    speed: f64,
    /// How far one goes up, and how far a turn takes a place on it [m].
    risen: f64,
    tilted: f64,
    /// What those that do not come back push out of their way [m3].
    swept: f64,
    /// Whether one goes to and fro, or round and round.
    stirred: bool,
}

impl Driven {
    /// Those of `scene` until `end` [s].
    fn of(scene: &Scene, params: &Params, openings: f64, end: f64) -> Self {
        let up = -params.gravity.normalize_or_zero();
        let mut out = Self { speed: openings, ..Self::default() };
        for solid in &scene.solids {
            let Drive::Prescribed(motion) = &solid.drive else { continue };
            out.speed = out.speed.max(motion.fastest(0.0, end, solid.radius()));
            for (way, turn) in motion.poses() {
                out.risen = out.risen.max(way.dot(up));
                let turned = 2.0 * solid.radius() * (0.5 * turn.angle_between(DQuat::IDENTITY)).sin();
                out.tilted = out.tilted.max(turned);
            }
            if goes_on(motion, end, solid.radius()) {
                out.stirred = true;
            } else {
                out.swept += swept(solid, motion, end, up, params.depth);
            }
        }
        out
    }
}

impl Scale {
    /// Those of `scene` at its start, as `simulation` holds it.
    pub fn new(simulation: &Simulation, scene: &Scene) -> Self {
        let params = &simulation.params;
        let g = params.gravity.length();
        let end = simulation.case.run.end;
        // Along a periodic axis nothing but friction ends a fall.
        let drawn = params.drive.length() * end;
        let (low, high) = scene.domain;
        let height = (high - low).abs().dot(params.gravity.normalize_or_zero().abs());
        let height = if height.is_finite() { height } else { 0.0 };
        let up = -params.gravity.normalize_or_zero();
        let floor = (low * up).min(high * up).element_sum();
        let start = scene.velocity.iter().map(|v| v.length()).fold(0.0, f64::max);
        let Driven { speed: driven, risen, tilted, swept, stirred } =
            Driven::of(scene, params, simulation.openings.fastest(0.0, end), end);
        let (mut bodies, mut own) = (0.0, 0.0);
        for solid in &scene.solids {
            if let Drive::Free(body) = &solid.drive {
                bodies += body.mass;
                own += body.mass * body.velocity.length_squared();
                own += (body.inertia * body.angular_velocity * body.angular_velocity).element_sum();
                // As far as it may fall, on a hinge from its upper to its lower balance.
                let above = if body.falls(up) {
                    solid.position.dot(up) - floor
                } else {
                    2.0 * body.weight_arm.length()
                };
                own += body.mass * g * if above.is_finite() { above.max(0.0) } else { 0.0 };
            }
        }
        let flows = scene.velocity[..scene.water()].iter().map(|v| v.length_squared()).sum::<f64>();
        let water = scene.water() as f64 * params.particle_mass();
        let moved = start.max(driven);
        let speed = moved + drawn;
        // A wedge of 30 degrees that plunges throws water up at five times its speed, a flatter one faster.
        let thrown = 3.0 * driven;
        // Water at rest without gravity is never quite at rest. Where it has a speed, that tells how fast is fast.
        let noise = match 0.1 * params.sound_speed(simulation.case.run.time_step) {
            noise if water > 0.0 && g == 0.0 => {
                if speed > 0.0 {
                    noise.min(speed)
                } else {
                    noise
                }
            }
            _ => 0.0,
        };
        // Water that comes in stands as high as all of it in the end, what goes out falls from the opening.
        let faces = scene.openings.iter().map(|o| o.face.dot(up) * g);
        let at_start = scene.position[..scene.water()].iter().map(|x| x.dot(up) * g);
        let lowest = faces.clone().chain(at_start).fold(f64::INFINITY, f64::min);
        let highest = faces.fold(lowest + g * params.depth, f64::max);
        // Pressed in, it may leave through a narrowing as fast as what is driven throws water up.
        let comes = highest + 0.5 * thrown * thrown;
        let through = (comes.max(0.0), (-lowest).max(0.0));
        // Pressure that water may push back with: its depth, and twice what stops it.
        let against =
            if water > 0.0 { params.density * (g * params.depth + 2.0 * driven * driven) } else { 0.0 };
        Self {
            speed: (speed * speed + 2.0 * g * height)
                .sqrt()
                .max(collapse_speed(params))
                .max(noise)
                .max(thrown),
            energy: g * (water * params.depth + (water + bodies) * (risen + tilted))
                + own
                + params.particle_mass() * flows
                + (water + bodies) * ((driven + drawn) * (driven + drawn) + 2.0 * start * drawn)
                + water * noise * noise,
            given: [
                0.5 * (water + bodies) * (speed * speed - moved * moved),
                // All the water and all the bodies at their speed, as high as they go; and what they push aside.
                (water + bodies) * (g * risen.max(0.0) + 0.5 * driven * driven) + against * swept,
            ],
            stirred,
            through: if scene.openings.is_empty() { (0.0, 0.0) } else { through },
            particle: params.particle_mass(),
        }
    }
}

/// Volume that `solid` sweeps by its `motion` until `end` [s] [m3], of a height of twice the `depth` [m] of the water at most: the box around
/// it, as it stands at the start.
fn swept(solid: &Solid, motion: &Motion, end: f64, up: DVec3, depth: f64) -> f64 {
    let size = 2.0 * solid.shape.extent(DMat3::from_quat(solid.orientation));
    let size = DVec3::select(up.abs().cmpgt(DVec3::splat(0.7)), size.min(DVec3::splat(2.0 * depth)), size);
    let faces = DVec3::new(size.y * size.z, size.z * size.x, size.x * size.y);
    let mut last = (motion.displacement(0.0), motion.turn(0.0));
    let mut out = 0.0;
    for (at, turned) in times(end).map(|t| (motion.displacement(t), motion.turn(t))) {
        let turn = solid.radius() * turned.angle_between(last.1);
        out += (at - last.0).abs().dot(faces) + turn * faces.max_element();
        last = (at, turned);
    }
    out
}

/// Whether a solid with this `radius` [m] comes back, or goes round, until `end` [s]: its way is longer than the room
/// that it takes.
fn goes_on(motion: &Motion, end: f64, radius: f64) -> bool {
    let (start, turn) = (motion.displacement(0.0), motion.turn(0.0));
    let (mut last, mut way, mut room) = ((start, turn), 0.0, (0.0_f64, start, start));
    for (at, turned) in times(end).map(|t| (motion.displacement(t), motion.turn(t))) {
        way += at.distance(last.0) + radius * turned.angle_between(last.1);
        room = (room.0.max(turned.angle_between(turn)), room.1.min(at), room.2.max(at));
        last = (at, turned);
    }
    way > 1.5 * (room.1.distance(room.2) + radius * room.0)
}

/// Times until `end` [s] at which a motion is looked at.
fn times(end: f64) -> impl Iterator<Item = f64> {
    const SAMPLES: u32 = 2000;
    (0..=SAMPLES).map(move |k| end * f64::from(k) / f64::from(SAMPLES))
}
