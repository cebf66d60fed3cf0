//! Rules that integrate along lines.

use super::{Faces, Geometry, Inside, along};
use glam::DVec3;

/// A node of a rule along a stretch of a line.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Place along the line [m].
    pub place: f64,
    /// Length that it stands for [m].
    pub length: f64,
    /// Deviation along the line of the force that it stands for, from its place [m]; 0 for a point.
    pub deviation: f64,
}

impl Node {
    /// A point at `place` that stands for `length` [m].
    pub fn point(place: f64, length: f64) -> Self {
        Self { place, length, deviation: 0.0 }
    }
}

/// The nodes of a shape that need not be convex along a line that goes through its surface at `crossings`, in order: every stretch inside has its own.
pub(super) fn nodes_between(
    shape: &impl Geometry,
    (start, way, length): (DVec3, DVec3, f64),
    crossings: Vec<f64>,
    faces: Faces,
    visit: &mut dyn FnMut(Node, Inside),
) {
    let mut ends = vec![0.0];
    ends.extend(crossings);
    ends.push(length);
    for stretch in ends.windows(2) {
        let (from, width) = (stretch[0], stretch[1] - stretch[0]);
        let middle = start + (from + 0.5 * width) * way;
        if width <= 0.0 || shape.depth(middle, faces).is_none() {
            continue;
        }
        let distance = |s: f64| {
            let (d, gradient) = shape.distance(start + (from + s) * way);
            (d.min(-f64::MIN_POSITIVE), gradient.dot(way))
        };
        along(width, distance, |s, share| {
            if let Some(inside) = shape.depth(start + (from + s) * way, faces) {
                visit(Node::point(from + s, share), inside);
            }
        });
    }
}
