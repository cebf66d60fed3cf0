//! A pair of solids under the smooth law: what of each lies in the other, forces, friction patches.

mod beside_device;
mod edges;
mod lists;

use super::answer::Mode;
use super::constants::{Constants, felt};
use super::frame::Frame;
use super::patch::{Contact, Patch, part_by_direction, place, square};
use super::walls::WallBox;
use crate::body::{Body, Pose, Wrench};
use crate::contact::candidates::image;
use crate::shape::{Inside, Surface};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// What a free solid touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Other {
    /// A moving solid.
    Solid(usize),
    /// A fixed wall.
    Wall(usize),
}

impl Other {
    /// Index of the moving solid; `None` for a wall.
    pub fn solid(self) -> Option<usize> {
        match self {
            Self::Solid(b) => Some(b),
            Self::Wall(_) => None,
        }
    }
}

/// Share of the sum of w d^8 below which an edge is left out: the end of an upright one adds nothing to a face.
pub(super) const LEAST: f64 = 1e-6;

/// A pair of solids close to each other.
#[derive(Clone, Debug)]
pub(crate) struct Pair {
    /// A free solid.
    pub a: usize,
    /// The other one.
    pub b: Other,
    /// The way from it to its image beside `a`, over a periodic side [m].
    pub image: DVec3,
    /// Points of `a` near `b`.
    pub points_a: Vec<u32>,
    /// Points of solid `b` near `a`.
    pub points_b: Vec<u32>,
    /// Corners of wall `b` near `a`, world [m].
    pub samples: Vec<DVec3>,
    /// Edges of `a` near `b`.
    pub edges_a: Vec<u32>,
    /// Edges of `b`, a solid or a wall, near `a`.
    pub edges_b: Vec<u32>,
    /// Whether round parts of one of both are near the other.
    pub round: bool,
    pub constants: Constants,
    contacts: Vec<Contact>,
    /// Contacts for the device to take in.
    pub given: Vec<Contact>,
    /// Patches of the last evaluation.
    pub patches: Vec<Patch>,
    /// Wrench on `a` and on `b`, of the last evaluation.
    pub wrench: [Wrench; 2],
    /// Energy stored [J].
    pub energy: f64,
    /// Deepest point [m]; infinite before the first evaluation.
    pub depth: f64,
    /// The same at the evaluation before; infinite if there was none.
    pub before: f64,
    /// Way of both solids since the lists were made [m] up to which they stay apart.
    apart: f64,
    /// Points in contact at the last evaluation, and those with the nodes of edges.
    points: usize,
    count: usize,
}

impl Pair {
    /// The solids of it that move.
    pub fn bodies(&self) -> impl Iterator<Item = usize> {
        std::iter::once(self.a).chain(self.b.solid())
    }

    pub fn new(a: usize, b: Other, image: DVec3) -> Self {
        Self {
            a,
            b,
            image,
            points_a: vec![],
            points_b: vec![],
            samples: vec![],
            edges_a: vec![],
            edges_b: vec![],
            round: false,
            constants: Constants::default(),
            contacts: vec![],
            given: vec![],
            patches: vec![],
            wrench: Default::default(),
            energy: 0.0,
            depth: f64::INFINITY,
            before: f64::INFINITY,
            apart: f64::NEG_INFINITY,
            points: 0,
            count: 0,
        }
    }

    /// The solids have been put elsewhere: what was before says nothing.
    pub fn moved(&mut self) {
        (self.depth, self.apart) = (f64::INFINITY, f64::NEG_INFINITY);
    }

    /// The last evaluation was none of a sub-step: the next one's depth is held against the one before.
    pub fn looked_at(&mut self) {
        self.depth = self.before;
    }

    /// Whether the two solids, which did not touch at the last evaluation, still do not, when they have gone `way` [m] since the
    /// lists were made. Most pairs of a heap are such neighbours.
    pub fn stays_apart(
        &mut self,
        way: f64,
        bodies: &[Body],
        surfaces: &[Arc<Surface>],
        walls: &[WallBox],
    ) -> bool {
        if self.depth > 0.0 && self.depth.is_finite() {
            return false;
        }
        if way > self.apart {
            let own = Frame::body(&bodies[self.a], surfaces[self.a].all_faces);
            let gap = own.gap(&self.other(bodies, surfaces, walls));
            if gap <= 0.0 {
                return false;
            }
            // a turn goes a little further than the speed at its start says
            self.apart = way + 0.9 * gap;
        }
        self.clear();
        true
    }

    /// Nothing touches.
    fn clear(&mut self) {
        self.contacts.clear();
        self.patches.clear();
        self.wrench = Default::default();
        self.before = self.depth;
        (self.energy, self.depth) = (0.0, 0.0);
        (self.points, self.count) = (0, 0);
    }

    /// Deepest points [m] inside the first and inside the second solid. Of what a device has found only one is
    /// known, which may be either.
    pub fn deepest(&self) -> (f64, f64) {
        let in_first = |c: &Contact| if c.patch < 32 { c.patch >= 8 } else { c.patch % 2 == 1 };
        self.contacts.iter().fold((0.0, 0.0), |(a, b): (f64, f64), c| {
            if in_first(c) { (a.max(c.depth), b) } else { (a, b.max(c.depth)) }
        })
    }

    /// Largest speed at which a depth grows [m/s].
    pub fn approach(&self) -> f64 {
        self.contacts.iter().map(|c| -c.speed).fold(0.0, f64::max)
    }

    /// Points and nodes of edges in contact at the last evaluation.
    pub fn contact_count(&self) -> usize {
        self.count
    }

    /// Points in contact at the last evaluation.
    pub fn point_count(&self) -> usize {
        self.points
    }

    /// The second solid.
    pub(super) fn other(&self, bodies: &[Body], surfaces: &[Arc<Surface>], walls: &[WallBox]) -> Frame {
        match self.b {
            Other::Solid(b) => {
                let own = Frame::body(&bodies[b], surfaces[b].all_faces);
                let shape = surfaces[b].open.unwrap_or(own.shape);
                Frame { center: own.center + self.image, shape, ..own }
            }
            Other::Wall(w) => Frame::wall(&walls[w]),
        }
    }

    /// How the second solid lies and moves, if it can, at its image beside the first.
    pub(super) fn pose_b(&self, bodies: &[Body]) -> Option<Pose> {
        self.b.solid().map(|b| image(&bodies[b], self.image))
    }

    /// Forces, energy and friction patches at the bodies' poses and velocities; edges that would add less than the share
    /// `least` to the sum of w d^8 of the points are left out.
    pub fn evaluate(
        &mut self,
        bodies: &[Body],
        surfaces: &[Arc<Surface>],
        walls: &[WallBox],
        spacing: f64,
        least: f64,
    ) {
        self.clear();
        self.find(bodies, surfaces, walls);
        self.points = self.contacts.len();
        self.find_edges(bodies, surfaces, walls, spacing, least);
        if self.round {
            self.find_round(bodies, surfaces, walls);
        }
        self.count = self.contacts.len();
        if !self.contacts.is_empty() {
            let other = self.other(bodies, surfaces, walls).shape;
            part_by_direction(
                &mut self.contacts,
                [bodies[self.a].shape, other].map(|shape| shape.is_faceted()),
            );
            self.press(bodies);
            self.sum(bodies);
        }
    }

    /// The points inside the other solid, with depth, normal and separating speed.
    fn find(&mut self, bodies: &[Body], surfaces: &[Arc<Surface>], walls: &[WallBox]) {
        let a = &bodies[self.a];
        let own = Frame::body(a, surfaces[self.a].all_faces);
        let other = self.other(bodies, surfaces, walls);
        let share = if self.b.solid().is_some() { 0.5 } else { 1.0 };
        let still = a.rotation.transpose();
        let turn = other.axes.transpose() * a.rotation;
        let shift = other.axes.transpose() * (own.center - other.center);
        let b = self.pose_b(bodies);
        let velocity_b = |at: DVec3| b.map_or(DVec3::ZERO, |b| b.velocity_at(at));
        for &k in &self.points_a {
            let p = surfaces[self.a].points[k as usize];
            if let Some(Inside { depth, outward, face }) = other.shape.depth(turn * p + shift, other.faces) {
                let at = own.center + a.rotation * p;
                let normal = other.axes * outward;
                let speed = (a.pose.velocity_at(at) - velocity_b(at)).dot(normal);
                let weight = share * surfaces[self.a].weights[k as usize];
                let part = surfaces[self.a].part(k as usize);
                self.contacts.push(Contact { part, ..Contact::new(at, normal, depth, weight, speed, face) });
            }
        }
        let mut pushed = |at: DVec3, weight: f64, part: f64| {
            let q = still * (at - own.center);
            if let Some(Inside { depth, outward, face }) = own.shape.depth(q, own.faces) {
                let normal = -(a.rotation * outward);
                let speed = (a.pose.velocity_at(at) - velocity_b(at)).dot(normal);
                self.contacts
                    .push(Contact { part, ..Contact::new(at, normal, depth, weight, speed, 8 + face) });
            }
        };
        if let Other::Solid(b) = self.b {
            for &k in &self.points_b {
                let at = other.center + other.axes * surfaces[b].points[k as usize];
                pushed(at, share * surfaces[b].weights[k as usize], surfaces[b].part(k as usize));
            }
        }
        let weight = surfaces[self.a].smallest_weight;
        for &at in &self.samples {
            pushed(at, weight, 1.0);
        }
    }

    /// Normal forces of the points: the pair's spring and dashpot, no tension.
    ///
    /// The dashpot shares like the spring and is scaled so that the damping *ratio* does not depend on
    /// how much of a face is in contact: C sqrt(K_contact / K), K_contact = K sum s_i, nor on where that is: see
    /// [`Mode`]. With the second spring it grows: see [`Constants::grown`].
    fn press(&mut self, bodies: &[Body]) {
        let deepest = self.contacts.iter().fold(0.0_f64, |m, c| m.max(c.depth));
        let eighth = |x: f64| ((x * x) * (x * x)) * ((x * x) * (x * x));
        let per_deepest = deepest.recip();
        let sum: f64 = self.contacts.iter().map(|c| c.weight * eighth(c.depth * per_deepest)).sum();
        let mean = sum.sqrt().sqrt().sqrt();
        let depth = deepest * mean;
        self.depth = deepest;
        let shares: f64 = self.contacts.iter().map(|c| c.share(depth)).sum();
        let answers = if self.constants.mass > 0.0 {
            let second = self.b.solid().map(|b| (&bodies[b], image(&bodies[b], self.image)));
            let mode = Mode::of(&self.contacts, deepest, bodies[self.a].pose.position);
            mode.share(self.constants.mass, &bodies[self.a], second)
        } else {
            1.0
        };
        self.push(depth, shares / answers);
    }

    /// Normal forces of the points and the energy, at the effective depth `depth` [m] and the sum of all
    /// shares over the share of the mass that answers.
    fn push(&mut self, depth: f64, shares: f64) {
        let k = self.constants;
        let (secant, energy) = k.stored(depth);
        self.energy = energy;
        let damping = k.damping * k.grown(depth) / shares.sqrt();
        for c in &mut self.contacts {
            let share = c.share(depth);
            let part = if c.speed < 0.0 { felt(c.depth / -c.speed / k.step) } else { 1.0 };
            c.force = (share * (secant * c.depth - part * damping * c.speed)).max(0.0);
        }
    }

    /// Wrenches and patches. Both solids get the same force at the same point, so momentum and angular
    /// momentum are exchanged to round-off.
    fn sum(&mut self, bodies: &[Body]) {
        let center_a = bodies[self.a].pose.position;
        let center_b = self.pose_b(bodies).map_or(DVec3::ZERO, |b| b.position);
        let mut all = Wrench::default();
        let mut known = 0;
        for c in self.contacts.iter().filter(|c| c.force > 0.0) {
            let force = c.force * c.normal;
            all += Wrench { force, torque: (c.at - center_a).cross(force) };
            let key = c.patch;
            known = place(&self.patches, key, known).unwrap_or_else(|| {
                self.patches.push(Patch::new(key, DVec3::ZERO, 0.0, DVec3::ZERO, DMat3::ZERO));
                self.patches.len() - 1
            });
            let patch = &mut self.patches[known];
            patch.normal += force;
            patch.pressing += c.force;
            patch.weighed += c.force * c.part;
            patch.at += c.force * c.at;
        }
        let about_b = all.torque + (center_a - center_b).cross(all.force);
        self.wrench[0] += all;
        self.wrench[1] += Wrench { force: -all.force, torque: -about_b };
        self.patches.retain_mut(|p| {
            p.force = p.normal.length();
            p.normal = p.normal.normalize_or_zero();
            p.at /= p.pressing.max(f64::MIN_POSITIVE);
            p.force > 0.0
        });
        known = 0;
        for c in self.contacts.iter().filter(|c| c.force > 0.0) {
            let Some(found) = place(&self.patches, c.patch, known) else { continue };
            known = found;
            let patch = &mut self.patches[known];
            // friction goes by where an even pressure would be, which is not where most points are
            let share = c.force * c.part / patch.weighed.max(f64::MIN_POSITIVE);
            patch.spread += square(c.at - patch.at, share);
            if c.stretch != DVec3::ZERO {
                patch.spread += square(c.stretch, share);
            }
        }
    }
}
