//! The paper's baseline: the collision model of Lee et al. (2011), Eq. (18), between particles of
//! solids.
//!
//! Two particles closer than a l0 that approach each other leave with -b times their approach speed.
//! Inside a rigid body a particle's velocity is the body's, so the change is an impulse on the body at
//! the particle, along the line of the pair; pairs follow one another in a fixed order and most find
//! that the first has already parted them. There is no force at rest and no normal: bodies sink to
//! a l0, roll on the lattice and turn at random. It need be no better than the paper says it is.

mod collision;

use super::device::Link;
use super::fixed::FixedWalls;
use super::law::{Kind, Law, Now, Summary};
use super::paper::Lists;
use super::probe::Probe;
use super::substeps::{Limits, Worst};
use crate::body::{Body, Wrench};
use crate::error::Result;
use crate::scene::Scene;

/// The collision model.
pub(super) const KIND: Kind = Kind {
    make: |_, scene, _, _| Ok(Box::new(Pressure::new(scene))),
    gap: |_| 0.0,
    program: |_| Err("the impulses of law \"pressure\" follow one another, on the host"),
    device_tells_walls_apart: true,
};

/// Restitution b of Eq. (18) [-].
const RESTITUTION: f64 = 0.2;
/// Distance of the collisions over the spacing, a [-].
const DISTANCE: f64 = 0.8;

/// The baseline: impulses, no forces, always on the host.
pub(crate) struct Pressure {
    lists: Lists,
    spacing: f64,
}

impl Pressure {
    /// The law between the solids of `scene`.
    pub fn new(scene: &Scene) -> Self {
        Self { lists: Lists::new(scene), spacing: scene.spacing }
    }
}

impl Law for Pressure {
    fn evaluate(&mut self, now: Now, _: Option<Link>) -> Result<()> {
        if !self.lists.is_current(now.candidates) {
            self.lists.collect(now.candidates, now.bodies, self.spacing);
        }
        Ok(())
    }

    fn add_loads(&self, _: &[Body], _: &mut [Wrench]) {}

    fn press_walls(&self, _: &[Body], _: f64, _: &mut FixedWalls) {}

    fn act(&mut self, bodies: &mut [Body], fixed: &mut FixedWalls, _: &Limits, _: f64) -> Summary {
        let mut summary = Summary::default();
        let Lists { pairs, layers, walls, .. } = &self.lists;
        for pair in pairs {
            let distance = DISTANCE * self.spacing;
            let hits = collision::collide(pair, bodies, (layers, walls), fixed, distance, RESTITUTION);
            summary.add(hits, 0.0, 0.0);
        }
        summary
    }

    fn summary(&self) -> Summary {
        Summary::default()
    }

    fn energy(&mut self, _: Now) -> f64 {
        0.0
    }

    fn worst(&self, limits: &Limits, _: &[Body], _: f64) -> Worst {
        Worst { softest: limits.spring, ..Worst::default() }
    }

    fn spring(&self, _: f64) -> Option<(f64, &'static str)> {
        None
    }

    fn probe(&mut self, _: &[Body], _: Option<Link>, _: &mut Probe) -> Result<()> {
        Ok(())
    }
}
