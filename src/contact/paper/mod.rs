//! The paper's law, Eqs. (10) to (14), over pairs of wall-layer particles.
//!
//! On particle i of the first solid, from particle j of the second, with r = r_j - r_i, d = |r| < d_c,
//! e = r / d and v = v_j - v_i:
//!
//! F_R = -K (d_c - d) e, F_D = C v, F_A = eta (v - (v . e) e),
//! f = [(F_R + F_D) . N] N + F_A, F = sum f / n_c, T = sum (r_i - X) x f / n_c.
//!
//! What the paper leaves open is read so: N is the normal of the wall that particle j belongs to (with
//! the body's own normals, or without the projection, a block sticks on the lattice of its slope); n_c
//! counts the pairs of this pair of solids, all fixed walls being one solid; F_D may pull (without
//! tension a critically damped body hops instead of staying). Two solids that move exchange the same
//! force at the point r_i. The average is not conservative once a body turns: use the law `smooth` for
//! anything but reproducing the paper.

pub mod device;
mod facing;
mod lists;
mod near;
mod pair;
mod words;

pub(crate) use lists::Lists;
pub(crate) use pair::{Constants, Layer, Pair, Walls};

use super::candidates::MANY_PAIRS;
use super::device::Link;
use super::fixed::FixedWalls;
use super::law::{Kind, Law, Now, Summary};
use super::probe::Probe;
use super::stiffness::{Damping, Lambda};
use super::substeps::{Limits, OMEGA_STEP, Worst};
use crate::body::{Body, Wrench};
use crate::case;
use crate::error::{Error, Result};
use crate::scene::{CONTACT_DISTANCE, Scene};
use glam::DVec3;
use rayon::prelude::*;

/// The paper's law.
pub(super) const KIND: Kind = Kind {
    make: |contact, scene, bodies, limits| Ok(Box::new(Paper::new(contact, scene, bodies, limits)?)),
    gap: |spacing| (CONTACT_DISTANCE - 1.0) * spacing,
    program: |_| Ok(&device::PROGRAM),
    device_tells_walls_apart: false,
};

/// K over Eq. (16) at which the law returns a falling body from every entry phase: measured 5.6 to 5.8, theory
/// [d_c / (d_c - l0 / sqrt 2)]^2 = 5.60.
const SPRING_FACTOR: f64 = 6.5;

/// The law: lists, constants, and the pairs on a device.
pub(crate) struct Paper {
    lists: Lists,
    constants: Constants,
    device: Option<Box<device::Pairs>>,
    /// The last evaluation was the device's.
    on_device: bool,
}

impl Paper {
    /// The law of `contact` between the solids of `scene`.
    ///
    /// # Errors
    /// [`Error::Case`] if the case gives a restitution.
    pub fn new(contact: &case::Contact, scene: &Scene, bodies: &[Body], limits: &mut Limits) -> Result<Self> {
        let Damping::Coefficient(damping) = limits.between.usual.damping else {
            let message = "contact.restitution: needs law = \"smooth\"";
            return Err(Error::key("contact.restitution", message, "give damping or damping_ratio"));
        };
        let lists = Lists::new(scene);
        let layers = bodies.iter().zip(&lists.layers);
        limits.lambda = layers.map(|(b, l)| lambda(b, &l.offsets, contact.torque)).collect();
        let constants = Constants {
            spring: limits.spring,
            damping,
            viscous_friction: contact.viscous_friction,
            distance: CONTACT_DISTANCE * scene.spacing,
            torque: contact.torque,
        };
        Ok(Self { lists, constants, device: None, on_device: false })
    }

    fn evaluated(&self) -> &[Pair] {
        match &self.device {
            Some(device) if self.on_device => &device.pairs,
            _ => &self.lists.pairs,
        }
    }

    fn press_on_host(&mut self, now: Now) {
        if !self.lists.is_current(now.candidates) {
            self.lists.collect(now.candidates, now.bodies, self.constants.distance);
        }
        let Lists { layers, walls, pairs, .. } = &mut self.lists;
        let press = |p: &mut Pair| p.evaluate(&self.constants, now.bodies, layers, walls);
        if pairs.len() >= MANY_PAIRS {
            pairs.par_iter_mut().for_each(press);
        } else {
            pairs.iter_mut().for_each(press);
        }
    }
}

impl Law for Paper {
    fn evaluate(&mut self, now: Now, device: Option<Link>) -> Result<()> {
        let Some(mut link) = device else {
            (self.device, self.on_device) = (None, false);
            self.press_on_host(now);
            return Ok(());
        };
        let mut pairs = match self.device.take() {
            Some(pairs) => pairs,
            None => device::Pairs::new(&self.lists.layers, now.bodies, &self.constants, &mut link)?.into(),
        };
        if !pairs.is_current(now.candidates) {
            pairs.search(&self.lists, now.candidates, now.bodies, &self.constants, &mut link)?;
        }
        pairs.evaluate(&self.constants, now.bodies, &mut link)?;
        (self.device, self.on_device) = (Some(pairs), true);
        Ok(())
    }

    fn add_loads(&self, _: &[Body], load: &mut [Wrench]) {
        for pair in self.evaluated() {
            load[pair.a] += pair.wrench[0];
            if let Some(b) = pair.b {
                load[b] += pair.wrench[1];
            }
        }
    }

    fn press_walls(&self, bodies: &[Body], span: f64, fixed: &mut FixedWalls) {
        for pair in self.evaluated() {
            let at = bodies[pair.a].pose.position;
            for &(wall, on_body) in &pair.from_walls {
                fixed.touch(wall as usize, -span * on_body.force, at, -span * on_body.torque);
            }
        }
    }

    fn tells_walls_apart(&self) -> bool {
        !self.on_device
    }

    fn act(&mut self, _: &mut [Body], _: &mut FixedWalls, _: &Limits, _: f64) -> Summary {
        Summary::default()
    }

    fn summary(&self) -> Summary {
        let mut summary = Summary::default();
        let distance = self.constants.distance;
        self.evaluated().iter().for_each(|p| summary.add(p.count, p.energy, distance - p.closest));
        summary
    }

    fn energy(&mut self, now: Now) -> f64 {
        self.press_on_host(now);
        self.lists.pairs.iter().map(|p| p.energy).sum()
    }

    fn worst(&self, limits: &Limits, bodies: &[Body], dt: f64) -> Worst {
        let mut worst = Worst { softest: limits.spring, ..Worst::default() };
        for pair in limits.extremes(bodies) {
            limits.ask(&mut worst, bodies, pair, limits.between.usual.damping, dt, limits.viscous_friction);
        }
        worst.wanted = (worst.omega_dt / OMEGA_STEP).max(worst.damping_dt);
        worst
    }

    fn spring(&self, energy: f64) -> Option<(f64, &'static str)> {
        let spring = SPRING_FACTOR * energy / self.constants.distance.powi(2);
        Some((spring, "it does not stop the heaviest body at its fastest, which may pass through a wall"))
    }

    fn probe(&mut self, _: &[Body], device: Option<Link>, probe: &mut Probe) -> Result<()> {
        for p in self.evaluated() {
            probe.energy += p.energy;
            probe.touching += p.count;
        }
        probe.candidates = match (&self.device, device) {
            (Some(pairs), Some(mut link)) if self.on_device => pairs.listed(&mut link)?,
            _ => {
                let of = |p: &Pair| {
                    let (a, b) = (p.a as u64, p.b.map_or(u64::MAX, |b| b as u64));
                    p.candidates.iter().map(move |&(i, j)| [a, b, i.into(), j.into()]).collect::<Vec<_>>()
                };
                self.lists.pairs.iter().flat_map(of).collect()
            }
        };
        Ok(())
    }
}

/// Eigenvalue of the paper's law: the worst particle of the wall layer pushed along an axis.
fn lambda(body: &Body, offsets: &[DVec3], torque: bool) -> Lambda {
    if !body.is_free() {
        return Lambda::default();
    }
    let turns = torque && body.locked_rotation != [true; 3];
    let worst = offsets.iter().flat_map(|r| DVec3::AXES.map(|n| r.cross(n)));
    let turning = worst.map(|t| t.dot(t / body.principal)).fold(0.0, f64::max);
    let lambda = 1.0 / body.mass + if turns { turning } else { 0.0 };
    Lambda { spring: lambda, damping: lambda }
}
