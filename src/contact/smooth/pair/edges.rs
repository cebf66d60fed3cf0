//! Edges and round parts of both solids inside the other one.

use super::super::frame::{Frame, View};
use super::super::patch::{ALONG_NORMAL, Contact, edge_key};
use super::super::round;
use super::super::walls::WallBox;
use super::{Other, Pair};
use crate::body::Body;
use crate::shape::{Line, Surface};
use glam::{DMat3, DVec3};
use std::sync::Arc;

impl Pair {
    /// Nodes of the edges inside the other solid, after the points.
    pub(super) fn find_edges(
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
    pub(super) fn find_round(&mut self, bodies: &[Body], surfaces: &[Arc<Surface>], walls: &[WallBox]) {
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
            // halfway between both surfaces, so that neither has the longer arm
            (Some(radius), Some(_)) => round::ball(&own, radius, &other, &mut |p| {
                add(1.0, round::Pressed { at: p.at + 0.5 * p.depth * p.normal, ..p });
            }),
            (Some(radius), None) => round::ball(&own, radius, &other, &mut |p| add(1.0, p)),
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
}
