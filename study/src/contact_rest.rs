//! Checks of the smooth law: bodies come to rest, stay there, slide as far as friction lets them.

use super::contact_checks::{DAM_BREAK_CUBE, Random, lowest, none, smooth};
use super::dry::{DryScene, FreeBox, GRAVITY};
use glam::{DQuat, DVec3};
use seixo::backend::Backend;
use seixo::body::Pose;
use seixo::case::Contact;
use seixo::compute::Compute;
use seixo::contact::{ContactReport, Solids};
use seixo::error::Result;
use seixo::scene::Scene;
use serde::Serialize;
use std::time::Instant;

/// Largest deviation of a body's axes from being parallel to the world's z: 0 flat, 1 worst.
fn tilt(q: DQuat) -> f64 {
    let up = q.inverse() * DVec3::Z;
    1.0 - up.abs().max_element()
}

/// Bodies that should come to rest or stay there.
#[derive(Clone, Debug, Serialize)]
pub struct RestRow {
    /// Bodies.
    pub bodies: usize,
    /// Largest displacement from the start, less the sag of the springs [m].
    pub drift: f64,
    /// Fastest body at the end [m/s].
    pub speed: f64,
    /// Deepest contact at any time over l0 [-].
    pub penetration: f64,
    /// Deepest contact in the last second over l0 [-].
    pub penetration_end: f64,
    /// Sub-steps a step.
    pub substeps: u32,
    /// Wall time a step [us].
    pub step_us: f64,
}

/// Cubes of 54 mm (0.073 kg), stacked `count` high, for `seconds`.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn stack(count: usize, seconds: f64) -> Result<RestRow> {
    let mut solids = Solids::new(&stack_scene(count), Some(&dam_break_contact()))?;
    rest(&mut solids, None, seconds, DAM_BREAK_CUBE.6)
}

/// The contact of the dam-break cube with the smooth law.
pub fn dam_break_contact() -> Contact {
    let (.., spring, damping, friction, _) = DAM_BREAK_CUBE;
    smooth(spring, damping, friction)
}

/// Cubes of 54 mm (0.073 kg), stacked `count` high.
pub fn stack_scene(count: usize) -> Scene {
    let (edge, mass, l0, ..) = DAM_BREAK_CUBE;
    let size = DVec3::splat(edge);
    let mut dry = DryScene::new(l0, DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, 0.5, 1.0)).floor();
    for k in 0..count {
        let center = DVec3::new(0.0, 0.0, (k as f64 + 0.5) * edge);
        dry = dry.body(&FreeBox::new(size, mass / edge.powi(3), center));
    }
    dry.build()
}

/// The cube that hits the wall: mass [kg], speed [m/s].
pub const RAM: (f64, f64) = (20.0, 3.0);

/// A wall of `columns` x 10 cubes of 54 mm hit by a cube of 20 kg at 3 m/s, K = `spring` [N/m] at the
/// dam-break cube's damping ratio, steps of `dt` [s], after `seconds`.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn demolish(columns: usize, spring: f64, dt: f64, seconds: f64) -> Result<RestRow> {
    let (edge, mass, l0, k, c, friction, _) = DAM_BREAK_CUBE;
    let damping = c * (spring / k).sqrt();
    let mut dry = DryScene::new(l0, DVec3::new(-5.0, -5.0, 0.0), DVec3::new(9.0, 5.0, 1.0)).floor();
    for row in 0..10 {
        for column in 0..columns {
            let y = (column as f64 - 0.5 * columns as f64) * edge * 1.001;
            let center = DVec3::new(0.0, y, (row as f64 + 0.5) * edge);
            dry = dry.body(&FreeBox::new(DVec3::splat(edge), mass / edge.powi(3), center));
        }
    }
    let size = DVec3::splat(0.15);
    let mut ram = FreeBox::new(size, RAM.0 / size.element_product(), DVec3::new(-0.3, 0.01, 0.2));
    ram.velocity = DVec3::new(RAM.1, 0.0, 0.0);
    let mut solids = Solids::new(&dry.body(&ram).build(), Some(&smooth(spring, damping, friction)))?;
    rest(&mut solids, None, seconds, dt)
}

/// Lets the solids move for `seconds` in steps of `dt` [s], their pairs on `compute` if there is one.
///
/// # Errors
/// Those of [`Solids::advance_on`].
pub fn rest(
    solids: &mut Solids,
    mut compute: Option<&mut dyn Compute>,
    seconds: f64,
    dt: f64,
) -> Result<RestRow> {
    let start: Vec<DVec3> = solids.poses().iter().map(|p| p.position).collect();
    let fluid = none(start.len());
    let clock = Instant::now();
    let steps = (seconds / dt) as usize;
    let (mut penetration, mut penetration_end, mut substeps) = (0.0_f64, 0.0_f64, 0);
    for step in 0..steps {
        let device = compute.as_mut().map(|c| &mut **c as &mut dyn Compute);
        let report = solids.advance_on(device, step as f64 * dt, dt, &fluid)?;
        penetration = penetration.max(report.penetration_max_over_l0);
        if (steps - step) as f64 * dt < 1.0 {
            penetration_end = penetration_end.max(report.penetration_max_over_l0);
        }
        substeps = report.substeps;
    }
    let moved = solids.poses().iter().zip(&start).map(|(p, s)| (p.position - *s).length());
    Ok(RestRow {
        bodies: start.len(),
        drift: moved.fold(0.0, f64::max),
        speed: solids.poses().iter().map(|p| p.velocity.length()).fold(0.0, f64::max),
        penetration,
        penetration_end,
        substeps,
        step_us: clock.elapsed().as_secs_f64() * 1e6 / steps as f64,
    })
}

/// The dam-break cube dropped in random orientations.
#[derive(Clone, Debug, Serialize)]
pub struct RandomDropRow {
    /// K [N/m].
    pub spring: f64,
    /// Mass [kg].
    pub mass: f64,
    /// Drops.
    pub drops: usize,
    /// Largest rise of the centre above its start [m].
    pub rise: f64,
    /// Largest energy above the start's over m g h [-]; below 0 is a loss.
    pub energy_gain: f64,
    /// Deepest contact over l0 [-].
    pub penetration: f64,
    /// How many lie flat.
    pub flat: usize,
    /// How many are at rest (below 1 mm/s and 0.01 rad/s).
    pub at_rest: usize,
    /// How many are above the floor.
    pub kept: usize,
    /// Sub-steps a step.
    pub substeps: u32,
    /// Wall time a step [us].
    pub step_us: f64,
}

/// Height from which the cube drops [m].
const DROP: f64 = 0.05;

/// The cube of drop `k`, of `mass` [kg], before it falls.
fn dropped(k: u64, mass: f64) -> FreeBox {
    let (edge, _, l0, ..) = DAM_BREAK_CUBE;
    let size = DVec3::splat(edge);
    let mut random = Random::new(k);
    let q = random.orientation();
    let z = lowest(0.5 * size, q) + DROP;
    let mut body = FreeBox::new(size, mass / edge.powi(3), DVec3::new(random.draw() * l0, 0.0, z));
    body.orientation = q;
    body.velocity = DVec3::new(0.5, 0.0, 0.0);
    body
}

impl RandomDropRow {
    fn empty(spring: f64, mass: f64, drops: usize) -> Self {
        Self {
            spring,
            mass,
            drops,
            rise: f64::NEG_INFINITY,
            energy_gain: f64::NEG_INFINITY,
            penetration: 0.0,
            flat: 0,
            at_rest: 0,
            kept: 0,
            substeps: 0,
            step_us: 0.0,
        }
    }

    /// What a step did.
    fn note(&mut self, report: &ContactReport) {
        self.substeps = report.substeps;
        self.penetration = self.penetration.max(report.penetration_max_over_l0);
    }

    /// Where a cube is after its first contact: how far above its start [m], and its energy gain [-].
    fn rebound(&mut self, rise: f64, gain: f64) {
        self.rise = self.rise.max(rise);
        self.energy_gain = self.energy_gain.max(gain);
    }

    /// How a cube lies at the end.
    fn judge(&mut self, pose: Pose) {
        let edge = DAM_BREAK_CUBE.0;
        self.flat += usize::from(tilt(pose.orientation) < 1e-3);
        let still = pose.velocity.length() < 1e-3 && pose.angular_velocity.length() < 1e-2;
        self.at_rest += usize::from(still);
        self.kept += usize::from(pose.position.z > 0.4 * edge && pose.position.z < edge);
    }
}

/// The drops of [`random_drops`] side by side in one scene, K and mass those of the dam-break cube, the pairs on
/// `compute` if there is one (made for the scene by `make`). Energies are those of motion and height.
///
/// # Errors
/// Those of [`Solids::advance_on`] and of `make`.
pub fn drops_together<B: Backend>(
    drops: usize,
    seconds: f64,
    make: impl FnOnce(&Scene, &Contact) -> Result<Option<B>>,
) -> Result<RandomDropRow> {
    let (edge, mass, l0, spring, .., dt) = DAM_BREAK_CUBE;
    let mut dry = DryScene::new(l0, DVec3::new(-2.0, -22.0, 0.0), DVec3::new(3.0, 22.0, 0.75)).floor();
    for k in 0..drops {
        let mut body = dropped(k as u64, mass);
        body.center.y = k as f64 - 0.5 * drops as f64;
        dry = dry.body(&body);
    }
    let (scene, contact) = (dry.build(), dam_break_contact());
    let mut backend = make(&scene, &contact)?;
    let mut solids = Solids::new(&scene, Some(&contact))?;
    // A cube has the same moment about every axis.
    let energy = |p: &Pose| {
        let turning = edge * edge / 12.0 * p.angular_velocity.length_squared();
        mass * (GRAVITY * p.position.z + 0.5 * p.velocity.length_squared() + turning)
    };
    let start: Vec<(f64, f64)> = solids.poses().iter().map(|p| (p.position.z, energy(p))).collect();
    let mut row = RandomDropRow::empty(spring, mass, drops);
    let mut touched = vec![false; drops];
    let clock = Instant::now();
    let steps = (seconds / dt) as usize;
    for step in 0..steps {
        let compute = backend.as_mut().and_then(Backend::compute);
        let report = solids.advance_on(compute, step as f64 * dt, dt, &none(drops))?;
        row.note(&report);
        for (k, pose) in solids.poses().iter().enumerate() {
            touched[k] |= solids.contact_wrenches()[k].force.length() > 1e-3 * mass * GRAVITY;
            if touched[k] {
                row.rebound(
                    pose.position.z - start[k].0,
                    (energy(pose) - start[k].1) / (mass * GRAVITY * DROP),
                );
            }
        }
    }
    solids.poses().iter().for_each(|p| row.judge(*p));
    row.step_us = clock.elapsed().as_secs_f64() * 1e6 / steps as f64;
    Ok(row)
}

/// Drops the dam-break cube `drops` times from 0.05 m with 0.5 m/s sideways, with the cube's mass and K
/// replaced by `mass` [kg] and `spring` [N/m], at the same damping ratio, for `seconds`.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn random_drops(spring: f64, mass: f64, drops: usize, seconds: f64) -> Result<RandomDropRow> {
    let (_, cube, l0, k, c, friction, dt) = DAM_BREAK_CUBE;
    let damping = c * (spring * mass / (k * cube)).sqrt();
    let scale = mass * GRAVITY * DROP;
    let mut row = RandomDropRow::empty(spring, mass, drops);
    let clock = Instant::now();
    let mut steps = 0;
    for drop in 0..drops {
        let body = dropped(drop as u64, mass);
        let z = body.center.z;
        let dry = DryScene::new(l0, DVec3::new(-2.0, -2.0, 0.0), DVec3::new(3.0, 2.0, 0.75));
        let scene = dry.floor().body(&body).build();
        let mut solids = Solids::new(&scene, Some(&smooth(spring, damping, friction)))?;
        let start = solids.energy().total();
        let mut touched = false;
        for step in 0..(seconds / dt) as usize {
            let report = solids.advance(step as f64 * dt, dt, &none(1))?;
            steps += 1;
            row.note(&report);
            touched |= report.pairs > 0;
            if touched {
                row.rebound(solids.poses()[0].position.z - z, (solids.energy().total() - start) / scale);
            }
        }
        row.judge(solids.poses()[0]);
    }
    row.step_us = clock.elapsed().as_secs_f64() * 1e6 / f64::from(steps);
    Ok(row)
}

/// Two dam-break cubes, of `mass` and `other` [kg], the second dropped on the first in a random
/// orientation, K = `spring` [N/m] at the damping ratio of the dam-break cube, for `seconds`.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn drop_on_body(spring: f64, mass: f64, other: f64, seed: u64, seconds: f64) -> Result<RandomDropRow> {
    let (edge, cube, l0, k, c, friction, dt) = DAM_BREAK_CUBE;
    let damping = c * (spring * mass.min(other) / (k * cube)).sqrt();
    let size = DVec3::splat(edge);
    let below = FreeBox::new(size, mass / edge.powi(3), DVec3::new(0.0, 0.0, 0.5 * edge));
    let mut body = dropped(seed, other);
    body.center.z += edge;
    body.velocity.x = 0.1;
    let z = body.center.z;
    let dry = DryScene::new(l0, DVec3::new(-2.0, -2.0, 0.0), DVec3::new(3.0, 2.0, 0.75));
    let scene = dry.floor().body(&below).body(&body).build();
    let mut solids = Solids::new(&scene, Some(&smooth(spring, damping, friction)))?;
    let scale = (mass + other) * GRAVITY * DROP;
    let start = solids.energy().total();
    let mut row = RandomDropRow::empty(spring, mass, 1);
    let clock = Instant::now();
    let mut steps = 0;
    let mut touched = false;
    for step in 0..(seconds / dt) as usize {
        let report = solids.advance(step as f64 * dt, dt, &none(2))?;
        steps += 1;
        row.note(&report);
        touched |= report.solid_pairs > 1;
        if touched {
            row.rebound(solids.poses()[1].position.z - z, (solids.energy().total() - start) / scale);
        }
    }
    let lowest = |n: usize| {
        let pose = solids.poses()[n];
        pose.position.z - lowest(0.5 * size, pose.orientation)
    };
    row.kept = [0, 1].iter().filter(|n| lowest(**n) > -0.8 * l0).count();
    row.step_us = clock.elapsed().as_secs_f64() * 1e6 / f64::from(steps);
    Ok(row)
}

/// Sliding stop on a flat floor: distance against v^2 / (2 mu g).
#[derive(Clone, Debug, Serialize)]
pub struct StopRow {
    /// mu [-].
    pub friction: f64,
    /// Distance [m].
    pub distance: f64,
    /// Analytic distance [m].
    pub analytic: f64,
    /// Speed at the end [m/s].
    pub speed: f64,
}

/// Slides the block of section 4.2 on a level floor from `speed` [m/s] until it stops.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn sliding_stop(friction: f64, speed: f64, dt: f64) -> Result<StopRow> {
    let mut block = FreeBox::new(DVec3::new(0.2, 0.2, 0.1), 780.0, DVec3::new(0.0, 0.0, 0.05));
    block.velocity = DVec3::new(speed, 0.0, 0.0);
    let dry = DryScene::new(0.025, DVec3::new(-2.0, -2.0, 0.0), DVec3::new(9.0, 2.0, 0.5)).floor();
    let scene = dry.body(&block).build();
    let mut solids = Solids::new(&scene, Some(&smooth(9e5, 3.35e3, friction)))?;
    let stop = speed / (friction * GRAVITY);
    for step in 0..((stop + 0.5) / dt) as usize {
        solids.advance(step as f64 * dt, dt, &none(1))?;
    }
    let pose = solids.poses()[0];
    Ok(StopRow {
        friction,
        distance: pose.position.x,
        analytic: speed * speed / (2.0 * friction * GRAVITY),
        speed: pose.velocity.length(),
    })
}
