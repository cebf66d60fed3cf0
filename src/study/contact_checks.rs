//! Checks of the smooth law against what mechanics demands: energy, momentum, restitution, rest.

use super::dry::{DryScene, FreeBox, GRAVITY};
use crate::body::Wrench;
use crate::case::{Contact, Law};
use crate::contact::Solids;
use crate::error::Result;
use glam::{DQuat, DVec3};
use serde::Serialize;
use std::time::Instant;

/// A contact section of the smooth law.
pub fn smooth(spring: f64, damping: f64, friction: f64) -> Contact {
    Contact {
        law: Law::Smooth,
        spring,
        damping: Some(damping),
        damping_ratio: None,
        restitution: None,
        viscous_friction: 0.0,
        friction,
        torque: true,
        substeps: None,
    }
}

/// A contact section of the smooth law with a restitution instead of a damping.
pub fn restituting(spring: f64, restitution: f64, friction: f64) -> Contact {
    Contact { damping: None, restitution: Some(restitution), ..smooth(spring, 0.0, friction) }
}

/// The dam-break cube of section 4.3: edge [m], mass [kg], spacing [m], K [N/m], C [kg/s], mu, dt [s].
pub const DAM_BREAK_CUBE: (f64, f64, f64, f64, f64, f64, f64) =
    (0.054, 0.073, 0.0075, 5.6e5, 40.0, 0.3, 9e-4);

/// Numbers in 0..1, the same on every machine.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// A sequence.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def1)
    }

    /// The next number.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// An orientation, uniform over all.
    pub fn orientation(&mut self) -> DQuat {
        loop {
            let mut draw = || 2.0 * self.next() - 1.0;
            let q = DQuat::from_xyzw(draw(), draw(), draw(), draw());
            if (0.1..1.0).contains(&q.length()) {
                return q.normalize();
            }
        }
    }
}

/// Lowest point of a box of half edges `half` [m] turned by `q`, below its centre [m].
pub fn lowest(half: DVec3, q: DQuat) -> f64 {
    (glam::DMat3::from_quat(q).abs() * half).z
}

/// Largest deviation of a body's axes from being parallel to the world's z: 0 flat, 1 worst.
fn tilt(q: DQuat) -> f64 {
    let up = q.inverse() * DVec3::Z;
    1.0 - up.abs().max_element()
}

fn none(n: usize) -> Vec<Wrench> {
    vec![Wrench::default(); n]
}

/// An elastic fall of a tilted cube.
#[derive(Clone, Debug, Serialize)]
pub struct ElasticRow {
    /// Tilt about y and x [degrees].
    pub tilt_deg: (f64, f64),
    /// Time step [s].
    pub time_step: f64,
    /// K over K_min of the fall [-].
    pub factor: f64,
    /// Largest |change of energy| in free flight over m g h during 1 s [-].
    pub energy_error: f64,
    /// Deepest contact over l0 [-].
    pub penetration: f64,
    /// Sub-steps a step.
    pub substeps: u32,
}

/// Drops a cube of 0.2 m by 0.3 m without damping and friction, K = `factor` x 2 m g h / d_c^2.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn elastic_drop(tilt_deg: (f64, f64), factor: f64, dt: f64) -> Result<ElasticRow> {
    let (l0, height, size) = (0.025, 0.3, DVec3::splat(0.2));
    let q = DQuat::from_rotation_y(tilt_deg.0.to_radians()) * DQuat::from_rotation_x(tilt_deg.1.to_radians());
    let mut cube = FreeBox::new(size, 2660.0, DVec3::new(0.0, 0.0, lowest(0.5 * size, q) + height));
    cube.orientation = q;
    let mass = cube.mass();
    let scale = mass * GRAVITY * height;
    let spring = factor * 2.0 * scale / (1.5 * l0 * l0);
    let scene = DryScene::new(l0, DVec3::new(-2.0, -2.0, 0.0), DVec3::new(2.0, 2.0, 0.6)).floor().body(&cube);
    let mut solids = Solids::new(&scene.build(), Some(&smooth(spring, 0.0, 0.0)))?;
    let start = solids.energy().total();
    let mut row =
        ElasticRow { tilt_deg, time_step: dt, factor, energy_error: 0.0, penetration: 0.0, substeps: 0 };
    let mut touched = false;
    for step in 0..(1.0 / dt) as usize {
        let report = solids.advance(step as f64 * dt, dt, &none(1))?;
        row.penetration = row.penetration.max(report.penetration_max_over_l0);
        row.substeps = report.substeps;
        touched |= report.pairs > 0;
        if touched && report.pairs == 0 {
            row.energy_error = row.energy_error.max(((solids.energy().total() - start) / scale).abs());
        }
    }
    Ok(row)
}

/// Two cubes that collide off-centre in free space.
#[derive(Clone, Debug, Serialize)]
pub struct CollisionRow {
    /// Mass ratio [-].
    pub mass_ratio: f64,
    /// mu [-].
    pub friction: f64,
    /// Change of momentum over m v [-].
    pub momentum_error: f64,
    /// Change of angular momentum over m v L [-].
    pub angular_momentum_error: f64,
    /// Change of kinetic energy over the starting one [-].
    pub energy_change: f64,
    /// Largest spin after the collision [rad/s]: they did meet off-centre.
    pub spin: f64,
}

/// Collides two cubes of 0.2 m at 2 m/s, one tilted, off-centre, elastically, without gravity.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn collide(mass_ratio: f64, friction: f64, dt: f64, seed: u64) -> Result<CollisionRow> {
    let mut random = Random::new(seed);
    let size = DVec3::splat(0.2);
    let density = 800.0;
    let mut first = FreeBox::new(size, density, DVec3::new(-0.25, 0.03, -0.02));
    first.velocity = DVec3::X;
    let mut second = FreeBox::new(size, density * mass_ratio, DVec3::new(0.15, -0.04, 0.05));
    second.velocity = -DVec3::X;
    second.orientation = random.orientation();
    first.angular_velocity = DVec3::new(0.3, -0.5, 0.2);
    let mass = first.mass();
    let scene = DryScene::new(0.025, DVec3::splat(-1.0), DVec3::splat(1.0)).gravity(DVec3::ZERO);
    let scene = scene.body(&first).body(&second).build();
    let mut solids = Solids::new(&scene, Some(&smooth(2e5, 0.0, friction)))?;
    let (momentum, angular) = solids.momentum();
    let energy = solids.energy().total();
    let (mut done, mut touched) = (0, false);
    for step in 0..(1.0 / dt) as usize {
        let pairs = solids.advance(step as f64 * dt, dt, &none(2))?.pairs;
        touched |= pairs > 0;
        done += usize::from(touched && pairs == 0);
    }
    assert!(done > 0, "the cubes must meet and part");
    let (momentum_after, angular_after) = solids.momentum();
    let scale = mass * 2.0;
    Ok(CollisionRow {
        mass_ratio,
        friction,
        momentum_error: (momentum_after - momentum).length() / scale,
        angular_momentum_error: (angular_after - angular).length() / (scale * 0.2),
        energy_change: solids.energy().total() / energy - 1.0,
        spin: solids.poses().iter().map(|p| p.angular_velocity.length()).fold(0.0, f64::max),
    })
}

/// Restitution of a free impact.
#[derive(Clone, Debug, Serialize)]
pub struct RestitutionRow {
    /// e asked for [-].
    pub asked: f64,
    /// e measured [-].
    pub measured: f64,
    /// Whether on a wall or between two cubes of mass ratio 3.
    pub on_wall: bool,
    /// Sub-steps a step.
    pub substeps: u32,
}

/// A flat impact at `speed` [m/s] without gravity, on a wall or on another cube.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn restitution(asked: f64, on_wall: bool, spring: f64, speed: f64, dt: f64) -> Result<RestitutionRow> {
    let size = DVec3::splat(0.2);
    let mut first = FreeBox::new(size, 2660.0, DVec3::new(0.0, 0.0, 0.1 + 3.7e-3));
    first.velocity = -speed * DVec3::Z;
    let dry = DryScene::new(0.025, DVec3::splat(-1.0), DVec3::splat(1.0)).gravity(DVec3::ZERO).body(&first);
    let dry = if on_wall {
        dry.floor()
    } else {
        dry.body(&FreeBox::new(size, 3.0 * 2660.0, DVec3::new(0.011, 0.007, -0.1)))
    };
    let mut solids = Solids::new(&dry.build(), Some(&restituting(spring, asked, 0.0)))?;
    let bodies = solids.poses().len();
    let mut substeps = 0;
    for step in 0..(0.2 / dt) as usize {
        substeps = solids.advance(step as f64 * dt, dt, &none(bodies))?.substeps;
    }
    let apart = solids.poses()[0].velocity.z - solids.poses().get(1).map_or(0.0, |p| p.velocity.z);
    Ok(RestitutionRow { asked, measured: apart / speed, on_wall, substeps })
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
    let (edge, mass, l0, spring, damping, friction, dt) = DAM_BREAK_CUBE;
    let size = DVec3::splat(edge);
    let mut dry = DryScene::new(l0, DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, 0.5, 1.0)).floor();
    for k in 0..count {
        let center = DVec3::new(0.0, 0.0, (k as f64 + 0.5) * edge);
        dry = dry.body(&FreeBox::new(size, mass / edge.powi(3), center));
    }
    let mut solids = Solids::new(&dry.build(), Some(&smooth(spring, damping, friction)))?;
    rest(&mut solids, seconds, dt, l0)
}

/// A wall of `columns` x 10 cubes of 54 mm hit by a cube of 20 kg at 3 m/s, after `seconds`.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn demolish(columns: usize, seconds: f64) -> Result<RestRow> {
    let (edge, mass, l0, spring, damping, friction, dt) = DAM_BREAK_CUBE;
    let mut dry = DryScene::new(l0, DVec3::new(-5.0, -5.0, 0.0), DVec3::new(9.0, 5.0, 1.0)).floor();
    for row in 0..10 {
        for column in 0..columns {
            let y = (column as f64 - 0.5 * columns as f64) * edge * 1.001;
            let center = DVec3::new(0.0, y, (row as f64 + 0.5) * edge);
            dry = dry.body(&FreeBox::new(DVec3::splat(edge), mass / edge.powi(3), center));
        }
    }
    let size = DVec3::splat(0.15);
    let mut ram = FreeBox::new(size, 20.0 / size.element_product(), DVec3::new(-0.3, 0.01, 0.2));
    ram.velocity = DVec3::new(3.0, 0.0, 0.0);
    let mut solids = Solids::new(&dry.body(&ram).build(), Some(&smooth(spring, damping, friction)))?;
    rest(&mut solids, seconds, dt, l0)
}

fn rest(solids: &mut Solids, seconds: f64, dt: f64, l0: f64) -> Result<RestRow> {
    let start: Vec<DVec3> = solids.poses().iter().map(|p| p.position).collect();
    let fluid = none(start.len());
    let clock = Instant::now();
    let steps = (seconds / dt) as usize;
    let (mut penetration, mut penetration_end, mut substeps) = (0.0_f64, 0.0_f64, 0);
    for step in 0..steps {
        let report = solids.advance(step as f64 * dt, dt, &fluid)?;
        penetration = penetration.max(report.penetration_max_over_l0);
        if (steps - step) as f64 * dt < 1.0 {
            penetration_end = penetration_end.max(report.penetration_max_over_l0);
        }
        substeps = report.substeps;
    }
    let moved = solids.poses().iter().zip(&start).map(|(p, s)| (p.position - *s).length());
    let _ = l0;
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

/// Drops the dam-break cube `drops` times from 0.05 m with 0.5 m/s sideways, with the cube's mass and K
/// replaced by `mass` [kg] and `spring` [N/m], at the same damping ratio, for `seconds`.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn random_drops(spring: f64, mass: f64, drops: usize, seconds: f64) -> Result<RandomDropRow> {
    let (edge, cube, l0, k, c, friction, dt) = DAM_BREAK_CUBE;
    let damping = c * (spring * mass / (k * cube)).sqrt();
    let (height, size) = (0.05, DVec3::splat(edge));
    let scale = mass * GRAVITY * height;
    let mut row = RandomDropRow {
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
    };
    let clock = Instant::now();
    let mut steps = 0;
    for drop in 0..drops {
        let mut random = Random::new(drop as u64);
        let q = random.orientation();
        let z = lowest(0.5 * size, q) + height;
        let mut body = FreeBox::new(size, mass / edge.powi(3), DVec3::new(random.next() * l0, 0.0, z));
        body.orientation = q;
        body.velocity = DVec3::new(0.5, 0.0, 0.0);
        let dry = DryScene::new(l0, DVec3::new(-2.0, -2.0, 0.0), DVec3::new(3.0, 2.0, 0.75));
        let scene = dry.floor().body(&body).build();
        let mut solids = Solids::new(&scene, Some(&smooth(spring, damping, friction)))?;
        let start = solids.energy().total();
        let mut touched = false;
        for step in 0..(seconds / dt) as usize {
            let report = solids.advance(step as f64 * dt, dt, &none(1))?;
            steps += 1;
            row.substeps = report.substeps;
            row.penetration = row.penetration.max(report.penetration_max_over_l0);
            touched |= report.pairs > 0;
            if touched {
                row.rise = row.rise.max(solids.poses()[0].position.z - z);
                let gain = (solids.energy().total() - start) / scale;
                row.energy_gain = row.energy_gain.max(gain);
            }
        }
        let pose = solids.poses()[0];
        row.flat += usize::from(tilt(pose.orientation) < 1e-3);
        let still = pose.velocity.length() < 1e-3 && pose.angular_velocity.length() < 1e-2;
        row.at_rest += usize::from(still);
        row.kept += usize::from(pose.position.z > 0.4 * edge && pose.position.z < edge);
    }
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

/// Cost of contact.
#[derive(Clone, Debug, Serialize)]
pub struct CostRow {
    /// Bodies.
    pub bodies: usize,
    /// Surface points of a body.
    pub points: usize,
    /// `true`: a heap in motion; `false`: at rest on the floor.
    pub moving: bool,
    /// Sub-steps a step.
    pub substeps: u32,
    /// Pairs of solids in contact at the end.
    pub solid_pairs: usize,
    /// Wall time a step [us].
    pub step_us: f64,
}

/// Wall time of contact for `count` dam-break cubes at rest, or falling into a heap.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn cost(count: usize, moving: bool, steps: usize) -> Result<CostRow> {
    let (edge, mass, l0, spring, damping, friction, dt) = DAM_BREAK_CUBE;
    let mut random = Random::new(5);
    let mut dry = DryScene::new(l0, DVec3::new(-9.0, -9.0, 0.0), DVec3::new(9.0, 9.0, 1.0)).floor();
    let side = (count as f64).cbrt().ceil() as usize;
    let wide = (count as f64).sqrt().ceil() as usize;
    for k in 0..count {
        let mut cube = FreeBox::new(DVec3::splat(edge), mass / edge.powi(3), DVec3::ZERO);
        if moving {
            let at = DVec3::new((k % side) as f64, (k / side % side) as f64, (k / side / side) as f64);
            cube.center = 1.02 * edge * (at + 0.5) + DVec3::Z * 0.01;
            cube.velocity = DVec3::new(random.next() - 0.5, random.next() - 0.5, -0.5);
        } else {
            let at = DVec3::new((k % wide) as f64, (k / wide) as f64, 0.0);
            cube.center = 1.3 * edge * at + DVec3::Z * 0.5 * edge;
        }
        dry = dry.body(&cube);
    }
    let scene = dry.build();
    let points = scene.solids[0].wall_offset.len();
    let mut solids = Solids::new(&scene, Some(&smooth(spring, damping, friction)))?;
    let fluid = none(count);
    let warm = 20;
    let mut report = crate::contact::ContactReport::default();
    for step in 0..warm {
        report = solids.advance(step as f64 * dt, dt, &fluid)?;
    }
    let clock = Instant::now();
    for step in warm..warm + steps {
        report = solids.advance(step as f64 * dt, dt, &fluid)?;
    }
    Ok(CostRow {
        bodies: count,
        points,
        moving,
        substeps: report.substeps,
        solid_pairs: report.solid_pairs,
        step_us: clock.elapsed().as_secs_f64() * 1e6 / steps as f64,
    })
}
