//! What of a solid's surface presses into other solids.

use super::{Faces, Shape};
use glam::DVec3;

/// An edge.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// One end [m]; body's frame, world for walls.
    pub start: DVec3,
    /// Unit direction.
    pub along: DVec3,
    /// Length [m].
    pub length: f64,
    /// Weight per length [1/m]; 0 for walls, whose edges get that of the body they touch.
    pub density: f64,
}

/// A circle about the z axis that carries its weight evenly.
#[derive(Clone, Copy, Debug)]
pub struct Ring {
    /// Its height [m].
    pub z: f64,
    /// Its radius [m].
    pub radius: f64,
    /// Its weight [-].
    pub weight: f64,
    /// The end that it lies on.
    pub faces: Faces,
}

impl Ring {
    /// The point at `angle` [rad], and its change with the angle.
    pub fn point(&self, angle: f64) -> (DVec3, DVec3) {
        let (sin, cos) = angle.sin_cos();
        (DVec3::new(self.radius * cos, self.radius * sin, self.z), self.radius * DVec3::new(-sin, cos, 0.0))
    }
}

/// The side of a cylinder about the z axis: a weight of 1 along the line of it that is deepest.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// Half of the height [m].
    pub half_height: f64,
    /// Radius [m].
    pub radius: f64,
}

/// The surface of a body as contact sees it: points, edges, rings ... with constant weights.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// Points inside the faces and at the corners, body's frame [m].
    pub points: Vec<DVec3>,
    /// Weight of each point [-]; those of a face and its edges sum to 1 (exactly for a cube).
    pub weights: Vec<f64>,
    /// Part of a face that each point stands for over that which its weight says [-], where they differ; else none.
    pub parts: Vec<f64>,
    /// For each point, the faces it lies on.
    pub faces: Vec<Faces>,
    /// Edges, body's frame; none in two dimensions.
    pub edges: Vec<Line>,
    /// For each edge, the faces it lies between.
    pub edge_faces: Vec<Faces>,
    /// Rings, body's frame.
    pub rings: Vec<Ring>,
    /// A round side.
    pub side: Option<Side>,
    /// Radius of a ball [m], of which the deepest point is all that touches.
    pub ball: Option<f64>,
    /// Faces of the body that others can touch.
    pub all_faces: Faces,
    /// The shape without the sides that others cover for ever, if there are such: that into which others are pressed.
    pub open: Option<Shape>,
    /// Smallest weight of a surface particle [-].
    pub smallest_weight: f64,
}

impl Surface {
    /// A ball of radius `radius` [m]: one point of weight 1, wherever it is.
    pub fn ball(radius: f64) -> Self {
        Self { ball: Some(radius), all_faces: 1, smallest_weight: 1.0, ..Self::default() }
    }

    /// Points alone, each on its `faces`, all of one weight, which sum to 1 over the face that has most of them.
    pub fn even(points: Vec<DVec3>, faces: Vec<Faces>, all_faces: Faces) -> Self {
        let on = |side: u8| faces.iter().filter(|f| *f & (1 << side) != 0).count();
        let most = (0..6).map(on).max().unwrap_or(1).max(1);
        let weight = 1.0 / most as f64;
        Self {
            weights: vec![weight; points.len()],
            points,
            faces,
            all_faces,
            smallest_weight: weight,
            ..Self::default()
        }
    }

    /// The same without the points that are `out`; those that stay keep their weights.
    pub(crate) fn without(&self, out: impl Fn(DVec3) -> bool) -> Self {
        let stay: Vec<usize> = (0..self.points.len()).filter(|&k| !out(self.points[k])).collect();
        let of = |all: &[f64]| stay.iter().filter_map(|&k| all.get(k).copied()).collect();
        Self {
            points: stay.iter().map(|&k| self.points[k]).collect(),
            weights: of(&self.weights),
            parts: of(&self.parts),
            faces: stay.iter().map(|&k| self.faces[k]).collect(),
            ..self.clone()
        }
    }

    /// [`Surface::parts`] of point `k`.
    pub fn part(&self, k: usize) -> f64 {
        self.parts.get(k).copied().unwrap_or(1.0)
    }

    /// Whether it has parts that a device has no kernel for.
    pub(crate) fn is_round(&self) -> bool {
        self.ball.is_some() || self.side.is_some() || !self.rings.is_empty()
    }

    /// Points with their weights and faces; for each edge two, and for each ring and side some, that have its
    /// weight, centre and second moment.
    pub fn samples(&self) -> Vec<(DVec3, f64, Faces)> {
        let points = self.points.iter().zip(&self.weights).zip(&self.faces).map(|((p, w), f)| (*p, *w, *f));
        let edges = self.edges.iter().zip(&self.edge_faces).flat_map(|(e, f)| {
            [-1.0, 1.0].map(|side: f64| {
                let s = e.length * (0.5 + side / 12.0_f64.sqrt());
                (e.start + s * e.along, 0.5 * e.density * e.length, *f)
            })
        });
        let rings = self.rings.iter().flat_map(|ring| {
            let angles = (0..4).map(|k| 0.5 * std::f64::consts::PI * f64::from(k));
            angles.map(|angle| (ring.point(angle).0, 0.25 * ring.weight, ring.faces))
        });
        // faces 0 to 3 stand for the four quarters of a round side
        let sides = self.side.iter().flat_map(|side| {
            (0..4_u8).flat_map(move |face| {
                let away = super::face_normal(face) * side.radius;
                [-1.0, 1.0]
                    .map(|end| (away + end * side.half_height / 3.0_f64.sqrt() * DVec3::Z, 0.5, 1 << face))
            })
        });
        points.chain(edges).chain(rings).chain(sides).collect()
    }
}
