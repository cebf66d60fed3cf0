//! Checks of the smooth law against what mechanics demands: energy, momentum, restitution, rest.

use super::dry::{DryScene, FreeBox, GRAVITY};
use glam::{DQuat, DVec3};
use seixo::body::Wrench;
use seixo::case::{Contact, Law};
use seixo::contact::Solids;
use seixo::error::Result;
use serde::Serialize;

/// A contact section of the smooth law.
pub fn smooth(spring: f64, damping: f64, friction: f64) -> Contact {
    Contact {
        law: Law::Smooth,
        spring: Some(spring),
        damping: Some(damping),
        damping_ratio: None,
        restitution: None,
        viscous_friction: 0.0,
        friction,
        torque: true,
        substeps: None,
        device: Default::default(),
        pair: vec![],
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
    pub fn draw(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// An orientation, uniform over all.
    pub fn orientation(&mut self) -> DQuat {
        loop {
            let mut draw = || 2.0 * self.draw() - 1.0;
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

pub(crate) fn none(n: usize) -> Vec<Wrench> {
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

/// An elastic impact of a cube edge on edge.
#[derive(Clone, Debug, Serialize)]
pub struct EdgeRow {
    /// Spacing [m].
    pub spacing: f64,
    /// Angle between both edges seen from above, and slope of the cube's [degrees].
    pub turn_deg: (f64, f64),
    /// Whether on a fixed edge or on that of another cube.
    pub on_wall: bool,
    /// Change of energy over that of the impact [-].
    pub energy_error: f64,
    /// Largest depth of one edge below the other, over the spacing [-].
    pub sinks: f64,
    /// Angle between the change of momentum and the cross product of the edges [degrees].
    pub off_normal_deg: f64,
}

/// An edge of a cube of 0.2 m meets an edge at `speed` [m/s], K = 1.6e6 N/m, without gravity, damping and
/// friction, until they part.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn edge_drop(spacing: f64, turn_deg: (f64, f64), on_wall: bool, speed: f64, dt: f64) -> Result<EdgeRow> {
    use std::f64::consts::FRAC_PI_4;
    let size = DVec3::splat(0.2);
    let (turn, slope) = (turn_deg.0.to_radians(), turn_deg.1.to_radians());
    let up = 0.1 * 2_f64.sqrt();
    // the lower edge of the cube is along x before the slope and the turn
    let q = DQuat::from_rotation_z(FRAC_PI_4 * 2.0 - turn)
        * DQuat::from_rotation_y(slope)
        * DQuat::from_rotation_x(FRAC_PI_4);
    let along = DQuat::from_rotation_z(FRAC_PI_4 * 2.0 - turn) * DQuat::from_rotation_y(slope) * DVec3::X;
    // edges cross off the middle of both, between the points of any spacing
    let below = q * DVec3::new(0.023_7, -0.1, -0.1);
    // a steep one meets the other's face with its corner first
    let lift = ((0.1 - 0.023_7) * (slope.sin() - turn.sin() * slope.cos())).max(0.0);
    let mut cube = FreeBox::new(size, 2660.0, DVec3::new(0.0, 0.031_3, 1e-4 + lift) - below);
    cube.orientation = q;
    cube.velocity = -speed * DVec3::Z;
    let tilt = DQuat::from_rotation_y(FRAC_PI_4);
    let dry = DryScene::new(spacing, DVec3::splat(-0.2), DVec3::splat(0.2)).gravity(DVec3::ZERO);
    let dry = if on_wall {
        dry.wall(DVec3::new(0.0, 0.0, -up), 0.5 * size, glam::DMat3::from_quat(tilt)).body(&cube)
    } else {
        let mut other = FreeBox::new(size, 2660.0, DVec3::new(0.0, 0.0, -up));
        other.orientation = tilt;
        dry.body(&cube).body(&other)
    };
    let mut solids = Solids::new(&dry.build(), Some(&smooth(1.6e6, 0.0, 0.0)))?;
    let bodies = solids.poses().len();
    let (before, start) = (solids.poses()[0].velocity, solids.energy().total());
    let (mut touched, mut sinks) = (false, 0.0_f64);
    let normal = along.cross(DVec3::Y).normalize();
    let normal = normal * normal.z.signum();
    for step in 0..(0.3 / dt) as usize {
        let report = solids.advance(step as f64 * dt, dt, &none(bodies))?;
        touched |= report.pairs > 0;
        if touched && report.pairs == 0 {
            break;
        }
        let tip = solids.poses()[0].point(DVec3::new(0.023_7, -0.1, -0.1));
        let edge = if on_wall { DVec3::ZERO } else { solids.poses()[1].point(DVec3::new(-0.1, 0.0, 0.1)) };
        sinks = sinks.max((edge - tip).dot(normal) / spacing);
    }
    let change = solids.poses()[0].velocity - before;
    Ok(EdgeRow {
        spacing,
        turn_deg,
        on_wall,
        energy_error: solids.energy().total() / start - 1.0,
        sinks,
        off_normal_deg: change.angle_between(normal).to_degrees(),
    })
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

/// Collides two cubes of 0.2 m at 2 m/s with K = `spring` [N/m], one tilted, off-centre, elastically, without gravity.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn collide(mass_ratio: f64, friction: f64, spring: f64, dt: f64, seed: u64) -> Result<CollisionRow> {
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
    let mut solids = Solids::new(&scene, Some(&smooth(spring, 0.0, friction)))?;
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
    /// Whether on a wall or of a cube 1.5 times as long.
    pub on_wall: bool,
    /// Sub-steps a step.
    pub substeps: u32,
}

/// A flat impact at 1 m/s after `gap` [m], without gravity, on a wall or on another cube.
///
/// # Errors
/// Those of [`Solids::advance`].
pub fn restitution(asked: f64, on_wall: bool, spring: f64, gap: f64, dt: f64) -> Result<RestitutionRow> {
    let size = DVec3::splat(0.2);
    let mut first = FreeBox::new(size, 2660.0, DVec3::new(0.0, 0.0, 0.1 + gap));
    let speed = 1.0;
    first.velocity = -speed * DVec3::Z;
    let dry = DryScene::new(0.025, DVec3::splat(-1.0), DVec3::splat(1.0)).gravity(DVec3::ZERO).body(&first);
    let dry = if on_wall {
        dry.floor()
    } else {
        dry.body(&FreeBox::new(1.5 * size, 2660.0, DVec3::new(0.0, 0.0, -0.15)))
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
