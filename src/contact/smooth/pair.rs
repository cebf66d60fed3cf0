//! A pair of solids under the smooth law: what of each lies in the other, forces, friction patches.

use super::answer::Mode;
use super::constants::{Constants, felt};
use super::frame::{Frame, View};
use super::patch::{Contact, DeviceSums, Patch, edge_key, place, square};
use super::round;
use super::walls::WallBox;
use crate::body::{Body, Pose, Wrench};
use crate::contact::candidates::image;
use crate::shape::{Inside, Line, Surface};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// What a free solid touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
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

/// Cosine between the force of an edge and a face's normal from which the edge counts to that face.
const ALONG_NORMAL: f64 = 0.95;

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

    /// Finds the contacts that a device does not look for, those of edges and of walls' corners. Those pressed
    /// by a face in `open` (bits 0 to 5: of `b`, 6 to 11: of `a`) are to be given to the device; of the
    /// others, their deepest depth d [m], and their sums over it.
    pub fn find_beside_device(
        &mut self,
        bodies: &[Body],
        surfaces: &[Arc<Surface>],
        walls: &[WallBox],
        spacing: f64,
        open: u32,
    ) -> (f64, Mode) {
        self.contacts.clear();
        self.given.clear();
        self.points = 0;
        if self.is_empty() {
            return (0.0, Mode::default());
        }
        // its lists of points are empty
        self.find(bodies, surfaces, walls);
        self.points = self.contacts.len();
        self.find_edges(bodies, surfaces, walls, spacing, LEAST);
        let given = &mut self.given;
        self.contacts.retain(|c| {
            let on_face = c.face().is_some_and(|face| open >> face & 1 == 1);
            if on_face {
                given.push(*c);
            }
            !on_face
        });
        let deepest = self.contacts.iter().fold(0.0_f64, |m, c| m.max(c.depth));
        (deepest, Mode::of(&self.contacts, deepest, bodies[self.a].pose.position))
    }

    /// Joins the contacts kept beside the device with what it sums over its own and those it was given.
    pub fn join(&mut self, sums: &DeviceSums, bodies: &[Body]) {
        self.patches.clear();
        self.wrench = sums.wrench;
        self.before = self.depth;
        (self.energy, self.depth) = (0.0, sums.deepest);
        self.points += sums.count - self.given.len();
        self.count = sums.count + self.contacts.len();
        if sums.count == 0 {
            if !self.contacts.is_empty() {
                self.press(bodies);
                self.sum(bodies);
            }
            return;
        }
        self.push(sums.depth, sums.shares);
        self.sum(bodies);
        self.patches.extend(&sums.patches);
        // the device takes those that it was given for points
        std::mem::swap(&mut self.contacts, &mut self.given);
        self.push(sums.depth, sums.shares);
        for c in &self.contacts {
            if let Some(patch) = self.patches.iter_mut().find(|p| p.key == c.patch) {
                patch.spread += square(c.stretch, c.force / patch.pressing);
            }
        }
        std::mem::swap(&mut self.contacts, &mut self.given);
    }

    /// The second solid.
    pub(super) fn other(&self, bodies: &[Body], surfaces: &[Arc<Surface>], walls: &[WallBox]) -> Frame {
        match self.b {
            Other::Solid(b) => {
                let own = Frame::body(&bodies[b], surfaces[b].all_faces);
                Frame { center: own.center + self.image, ..own }
            }
            Other::Wall(w) => Frame::wall(&walls[w]),
        }
    }

    /// How the second solid lies and moves, if it can, at its image beside the first.
    pub(super) fn pose_b(&self, bodies: &[Body]) -> Option<Pose> {
        self.b.solid().map(|b| image(&bodies[b], self.image))
    }

    /// Collects the points and edges of `a` and of `b` that come within `skin` [m] of the other's shape.
    pub fn collect(&mut self, bodies: &[Body], surfaces: &[Arc<Surface>], walls: &[WallBox], skin: f64) {
        let body = &bodies[self.a];
        let near = |surface: &Surface, own: Frame, to: Frame| {
            let turn = to.axes.transpose() * own.axes;
            let shift = to.local(own.center);
            let points = surface.points.iter().enumerate();
            let points = points.filter(|(_, p)| to.shape.outside(turn * **p + shift) < skin);
            points.map(|(k, _)| k as u32).collect::<Vec<u32>>()
        };
        let other = self.other(bodies, surfaces, walls);
        let own = Frame::body(body, surfaces[self.a].all_faces);
        let theirs = self.b.solid().map(|b| &surfaces[b]);
        self.round = surfaces[self.a].is_round() || theirs.is_some_and(|s| s.is_round());
        self.round &= other.shape.outside(other.local(own.center)) < own.shape.radius() + skin
            && own.shape.outside(own.local(other.center)) < other.shape.radius() + skin;
        if surfaces[self.a].ball.is_some() || theirs.is_some_and(|s| s.ball.is_some()) {
            return;
        }
        self.points_a = near(&surfaces[self.a], own, other);
        if let Other::Solid(b) = self.b {
            self.points_b = near(&surfaces[b], other, own);
        }
        self.collect_edges(bodies, surfaces, walls, skin);
    }

    /// Collects the edges of both, and a wall's corners, that come within `skin` [m] of the other's shape.
    pub fn collect_edges(
        &mut self,
        bodies: &[Body],
        surfaces: &[Arc<Surface>],
        walls: &[WallBox],
        skin: f64,
    ) {
        let body = &bodies[self.a];
        let own = Frame::body(body, surfaces[self.a].all_faces);
        let other = self.other(bodies, surfaces, walls);
        let near = |lines: &[Line], center: DVec3, axes: DMat3, to: Frame| {
            let turn = to.axes.transpose() * axes;
            let shift = to.axes.transpose() * (center - to.center);
            let lines = lines.iter().enumerate().filter(|(_, e)| {
                to.shape.line_is_near(turn * e.start + shift, turn * e.along, e.length, skin)
            });
            lines.map(|(k, _)| k as u32).collect::<Vec<u32>>()
        };
        self.samples.clear();
        self.edges_a = near(&surfaces[self.a].edges, own.center, own.axes, other);
        match self.b {
            Other::Solid(b) => self.edges_b = near(&surfaces[b].edges, other.center, other.axes, own),
            Other::Wall(w) => {
                self.edges_b = near(&walls[w].edges, DVec3::ZERO, DMat3::IDENTITY, own);
                let near = |x: &&DVec3| own.shape.outside(own.local(**x)) < skin;
                self.samples.extend(walls[w].corners.iter().filter(near));
            }
        }
    }

    /// Whether any candidate is left.
    pub fn is_empty(&self) -> bool {
        let points = self.points_a.len() + self.points_b.len() + self.samples.len();
        points + self.edges_a.len() + self.edges_b.len() == 0 && !self.round
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
        let shift = other.axes.transpose() * (a.pose.position - other.center);
        let b = self.pose_b(bodies);
        let velocity_b = |at: DVec3| b.map_or(DVec3::ZERO, |b| b.velocity_at(at));
        for &k in &self.points_a {
            let p = surfaces[self.a].points[k as usize];
            if let Some(Inside { depth, outward, face }) = other.shape.depth(turn * p + shift, other.faces) {
                let at = a.pose.position + a.rotation * p;
                let normal = other.axes * outward;
                let speed = (a.pose.velocity_at(at) - velocity_b(at)).dot(normal);
                let weight = share * surfaces[self.a].weights[k as usize];
                let part = surfaces[self.a].part(k as usize);
                self.contacts.push(Contact { part, ..Contact::new(at, normal, depth, weight, speed, face) });
            }
        }
        let mut pushed = |at: DVec3, weight: f64, part: f64| {
            let q = still * (at - a.pose.position);
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

    /// Nodes of the edges inside the other solid, after the points.
    fn find_edges(
        &mut self,
        bodies: &[Body],
        surfaces: &[Arc<Surface>],
        walls: &[WallBox],
        spacing: f64,
        least: f64,
    ) {
        let (edges_a, edges_b) = (std::mem::take(&mut self.edges_a), std::mem::take(&mut self.edges_b));
        let own = Frame::body(&bodies[self.a], surfaces[self.a].all_faces);
        let other = self.other(bodies, surfaces, walls);
        let share = if self.b.solid().is_some() { 0.5 } else { 1.0 };
        let eighths: f64 = self.contacts.iter().map(|c| c.weight * c.depth.powi(8)).sum();
        let least = least * eighths;
        let view = View::new(own.center, own.axes, other, least);
        for &k in &edges_a {
            let line = surfaces[self.a].edges[k as usize];
            self.press_edge(line, &view, share * line.density, 1.0, k, bodies);
        }
        match self.b {
            Other::Solid(b) => {
                let view = View::new(other.center, other.axes, own, least);
                for &k in &edges_b {
                    let line = surfaces[b].edges[k as usize];
                    self.press_edge(line, &view, share * line.density, -1.0, k, bodies);
                }
            }
            Other::Wall(w) => {
                let view = View::new(DVec3::ZERO, DMat3::IDENTITY, own, least);
                let density = surfaces[self.a].smallest_weight / spacing;
                for &k in &edges_b {
                    self.press_edge(walls[w].edges[k as usize], &view, density, -1.0, k, bodies);
                }
            }
        }
        (self.edges_a, self.edges_b) = (edges_a, edges_b);
    }

    /// Balls, rings and round sides of both inside the other one.
    fn find_round(&mut self, bodies: &[Body], surfaces: &[Arc<Surface>], walls: &[WallBox]) {
        let own = Frame::body(&bodies[self.a], surfaces[self.a].all_faces);
        let other = self.other(bodies, surfaces, walls);
        let theirs = self.b.solid().map(|b| &surfaces[b]);
        let mut contacts = std::mem::take(&mut self.contacts);
        let b = self.pose_b(bodies);
        let mut add = |sign: f64, p: round::Pressed| {
            let normal = sign * p.normal;
            let velocity_b = b.map_or(DVec3::ZERO, |b| b.velocity_at(p.at));
            let speed = (bodies[self.a].pose.velocity_at(p.at) - velocity_b).dot(normal);
            let patch = if sign > 0.0 { p.face } else { 8 + p.face };
            contacts.push(Contact::new(p.at, normal, p.depth, p.weight, speed, patch));
        };
        let share = if theirs.is_some() { 0.5 } else { 1.0 };
        match (surfaces[self.a].ball, theirs.and_then(|s| s.ball)) {
            (Some(radius), _) => round::ball(&own, radius, &other, &mut |p| add(1.0, p)),
            (None, Some(radius)) => round::ball(&other, radius, &own, &mut |p| add(-1.0, p)),
            (None, None) => {
                round::press(&own, &surfaces[self.a], &other, share, &mut |p| add(1.0, p));
                if let Some(theirs) = theirs {
                    round::press(&other, theirs, &own, share, &mut |p| add(-1.0, p));
                }
            }
        }
        self.contacts = contacts;
    }

    /// Nodes of one edge inside a shape. `sign` turns outward of that shape into the direction of the force
    /// on the pair's first solid.
    ///
    /// An edge that lies in a face belongs to the face's patch; one that crosses an edge makes its own,
    /// so that friction acts across the cross product of both.
    fn press_edge(&mut self, line: Line, view: &View, density: f64, sign: f64, edge: u32, bodies: &[Body]) {
        let other = &view.other;
        let start = view.turn * line.start + view.shift;
        let along = view.turn * line.along;
        let (first, key) = (self.contacts.len(), edge_key(edge, sign < 0.0));
        let mut push = DVec3::ZERO;
        let least = view.least / density;
        // places and velocities are linear along the edge: each node adds its share to those at the start
        let (origin, direction) = (other.center + other.axes * start, other.axes * along);
        let a = &bodies[self.a].pose;
        let (mut slip, mut spin) = (a.velocity_at(origin), a.angular_velocity);
        if let Some(b) = self.pose_b(bodies) {
            slip -= b.velocity_at(origin);
            spin -= b.angular_velocity;
        }
        let turning = spin.cross(direction);
        other.shape.each_node((start, along, line.length), other.faces, least, |node, inside| {
            let (s, width) = (node.place, node.length);
            let normal = sign * (other.axes * inside.outward);
            push += width * inside.depth.powi(7) * inside.outward;
            self.contacts.push(Contact {
                at: origin + s * direction,
                normal,
                depth: inside.depth,
                weight: density * width,
                speed: (slip + s * turning).dot(normal),
                stretch: node.deviation * direction,
                force: 0.0,
                part: 1.0,
                patch: key,
            });
        });
        let toward = push.abs();
        let axis = toward.max_position();
        if toward[axis] > ALONG_NORMAL * push.length() {
            let face = 2 * axis as u8 + u8::from(push[axis] > 0.0);
            let patch = u32::from(if sign > 0.0 { face } else { 8 + face });
            self.contacts[first..].iter_mut().for_each(|c| c.patch = patch);
        }
    }

    /// Normal forces of the points: the pair's spring and dashpot, no tension.
    ///
    /// The dashpot shares like the spring and is scaled so that the damping *ratio* does not depend on
    /// how much of a face is in contact: C sqrt(K_contact / K), K_contact = K sum s_i, nor on where that is: see
    /// [`Mode`]. The second spring brings a dashpot of the same ratio, or a heavy body on a soft spring would bounce
    /// on it for ever.
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
        let beyond = (depth - k.stop_depth).max(0.0);
        let stop = (k.stop / k.spring).sqrt() - 1.0;
        for c in &mut self.contacts {
            let share = c.share(depth);
            let since = |depth: f64| if c.speed < 0.0 { felt(depth / -c.speed / k.step) } else { 1.0 };
            let stopping = if beyond > 0.0 { stop * since(beyond) } else { 0.0 };
            let damping = k.damping / shares.sqrt() * (since(c.depth) + stopping);
            c.force = (share * (secant * c.depth - damping * c.speed)).max(0.0);
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
