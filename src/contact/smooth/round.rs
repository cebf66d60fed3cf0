//! Round parts of a surface pressed into another shape: balls, rings and sides of cylinders.
//!
//! They have no points that turn with the body, or it would roll over its own lattice. A ball touches with its
//! deepest point alone; the side of a cylinder with the deepest line along it; of a ring the arc inside is
//! integrated. At a deepest point the depth does not change with the place on the body, so the force, the
//! gradient of the depth at that point, is still minus the derivative of the energy; where the gradient jumps there, at an edge
//! of the other, it is the mean of both sides that the depth does not change along.

use super::frame::Frame;
use crate::shape::{Inside, Ring, Side, Surface, along, around, root};
use glam::{DMat3, DVec3};

/// A point of a round part inside another shape.
pub(super) struct Pressed {
    /// Where, world [m].
    pub at: DVec3,
    /// Direction of the force on the round part.
    pub normal: DVec3,
    /// Depth [m].
    pub depth: f64,
    /// Weight [-].
    pub weight: f64,
    /// The other's face.
    pub face: u8,
}

/// Slope of the depth along a circle that counts as none [-].
const LEVEL: f64 = 1e-12;
/// Angle beside the deepest point at which the depth is looked at: on the other side of an edge's plane.
const BESIDE: f64 = 1e-7;
/// First angle at which the other side of the deepest point of a circle is looked for; then twice that, and so on.
const BRACKET: f64 = 0.02;

/// The ball about the centre of `own` inside `other`.
pub(super) fn ball(own: &Frame, radius: f64, other: &Frame, add: &mut dyn FnMut(Pressed)) {
    let q = other.local(own.center);
    // a centre under a face that is covered is pushed through one that is not
    let (distance, outward, face) = match other.shape.depth(q, other.faces) {
        Some(Inside { depth, outward, face }) => (-depth, outward, face),
        None => {
            let (distance, outward) = other.shape.distance(q);
            (distance, outward, 0)
        }
    };
    if distance >= radius {
        return;
    }
    let normal = other.axes * outward;
    add(Pressed { at: own.center - radius * normal, normal, depth: radius - distance, weight: 1.0, face });
}

/// The rings and the side of `own` inside `other`; weights times `share`.
pub(super) fn press(own: &Frame, surface: &Surface, other: &Frame, share: f64, add: &mut dyn FnMut(Pressed)) {
    let view = View { own, other, turn: other.axes.transpose() * own.axes, shift: other.local(own.center) };
    for ring in &surface.rings {
        view.ring(ring, share, add);
    }
    if let Some(side) = &surface.side {
        view.side(side, share, add);
    }
}

/// The deepest point of a circle.
struct Deepest {
    at: DVec3,
    /// Points right before and after it on the circle.
    beside: [DVec3; 2],
    /// Share of the first of these in the mean along which the depth does not change.
    share: f64,
}

impl Deepest {
    /// One with nothing particular beside it.
    fn alone(at: DVec3) -> Self {
        Self { at, beside: [at; 2], share: 0.5 }
    }

    /// The mean of a gradient that is `of` a point.
    fn mean(&self, of: impl Fn(DVec3) -> DVec3) -> DVec3 {
        let [before, after] = self.beside;
        if before == after { of(self.at) } else { self.share * of(before) + (1.0 - self.share) * of(after) }
    }
}

/// `other` as points of `own` see it.
struct View<'a> {
    own: &'a Frame,
    other: &'a Frame,
    turn: DMat3,
    shift: DVec3,
}

impl View<'_> {
    /// Distance of the point `p` of `own` from `other` [m], and its gradient in the frame of `own`.
    fn distance(&self, p: DVec3) -> (f64, DVec3) {
        let (distance, gradient) = self.other.shape.distance(self.turn * p + self.shift);
        (distance, self.turn.transpose() * gradient)
    }

    fn add(&self, p: DVec3, weight: f64, add: &mut dyn FnMut(Pressed)) {
        if let Some(Inside { depth, outward, face }) =
            self.other.shape.depth(self.turn * p + self.shift, self.other.faces)
        {
            let at = self.own.center + self.own.axes * p;
            add(Pressed { at, normal: self.other.axes * outward, depth, weight, face });
        }
    }

    fn ring(&self, ring: &Ring, share: f64, add: &mut dyn FnMut(Pressed)) {
        if self.distance(ring.z * DVec3::Z).0 >= ring.radius {
            return;
        }
        let distance = |angle: f64| {
            let (p, slope) = ring.point(angle);
            let (distance, gradient) = self.distance(p);
            (distance, gradient.dot(slope))
        };
        around(distance, |angle, part| self.add(ring.point(angle).0, share * ring.weight * part, add));
    }

    fn side(&self, side: &Side, share: f64, add: &mut dyn FnMut(Pressed)) {
        let middle = self.distance(DVec3::ZERO).0;
        if middle >= side.radius.hypot(side.half_height) {
            return;
        }
        let length = 2.0 * side.half_height;
        let at = |s: f64| self.deepest(side, s - side.half_height);
        let distance = |s: f64| {
            let deepest = at(s);
            (self.distance(deepest.at).0, deepest.mean(|p| self.distance(p).1).z)
        };
        along(length, distance, |s, width| {
            let deepest = at(s);
            let inside = |p: DVec3| self.other.shape.depth(self.turn * p + self.shift, self.other.faces);
            if let Some(Inside { depth, outward, face }) = inside(deepest.at) {
                let outward = deepest.mean(|p| inside(p).map_or(outward, |found| found.outward));
                let at = self.own.center + self.own.axes * deepest.at;
                let weight = share * width / length * self.bears(deepest.at, depth);
                add(Pressed { at, normal: self.other.axes * outward, depth, weight, face });
            }
        });
    }

    /// Part of its weight with which the line of a side counts at `p`, `depth` [m] inside.
    ///
    /// Where a circle of an upright side is inside all round, the body stands on the end beside it, and the line is on no side of the
    /// axis more than on another: it counts by how much deeper it is than the line opposite, so that it turns nothing that stands upright.
    fn bears(&self, p: DVec3, depth: f64) -> f64 {
        let opposite = self.turn * DVec3::new(-p.x, -p.y, p.z) + self.shift;
        let other = self.other.shape.depth(opposite, self.other.faces).map_or(0.0, |found| found.depth);
        1.0 - (other / depth).min(1.0).powi(4)
    }

    /// The deepest point of the circle of a side at the height `z` [m]: where the depth does not change with the angle.
    ///
    /// Under a face the gradient at the axis leads there at once. Near an edge it turns within a depth, which is much
    /// less than the circle, so that the zero is bracketed from there. Where it turns at once, from one face of an edge to the
    /// other, neither face is what the deepest point recedes from, but the mean of both along which the depth does not change.
    fn deepest(&self, side: &Side, z: f64) -> Deepest {
        let axis = z * DVec3::Z;
        let at = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            (axis + side.radius * DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0))
        };
        let slope = |angle: f64| {
            let (p, tangent) = at(angle);
            self.distance(p).1.dot(tangent)
        };
        let toward = self.distance(axis).1;
        // beside an upright one any will do: see `bears`
        let across = DVec3::new(toward.x, toward.y, 0.0).try_normalize().unwrap_or(DVec3::X);
        let straight = axis - side.radius * across;
        let tilt = self.distance(straight).1.dot(DVec3::new(across.y, -across.x, 0.0));
        if tilt.abs() < LEVEL {
            return Deepest::alone(straight);
        }
        let first = (f64::atan2(-across.y, -across.x), tilt);
        let mut step = -BRACKET * tilt.signum();
        while step.abs() < std::f64::consts::PI {
            let next = (first.0 + step, slope(first.0 + step));
            if next.1 * tilt <= 0.0 {
                let angle = root(first, next, slope);
                let beside = [angle - BESIDE, angle + BESIDE];
                let [before, after] = beside.map(slope);
                let share = if before < 0.0 && after > 0.0 { after / (after - before) } else { 0.5 };
                return Deepest { at: at(angle).0, beside: beside.map(|angle| at(angle).0), share };
            }
            step *= 2.0;
        }
        Deepest::alone(straight)
    }
}
