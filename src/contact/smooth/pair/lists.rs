//! What of two solids may touch: the points and edges of each that come near the other.

use super::super::frame::Frame;
use super::super::walls::WallBox;
use super::{Other, Pair};
use crate::body::Body;
use crate::shape::{Line, Surface};
use glam::{DMat3, DVec3};
use std::sync::Arc;

impl Pair {
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
}
