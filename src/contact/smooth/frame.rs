//! Where shapes stand: that of a solid or wall in the world, and as the edges of another one see it.

use super::walls::WallBox;
use crate::body::Body;
use crate::shape::{Faces, Shape};
use glam::{DMat3, DVec3};

/// Where a shape stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub center: DVec3,
    pub axes: DMat3,
    pub shape: Shape,
    /// Faces that can be reached.
    pub faces: Faces,
}

impl Frame {
    pub fn body(body: &Body, faces: Faces) -> Self {
        Self { center: body.shape_center(), axes: body.rotation, shape: body.shape, faces }
    }

    pub fn wall(wall: &WallBox) -> Self {
        Self { center: wall.center, axes: wall.axes, shape: wall.shape(), faces: wall.faces }
    }

    /// Largest coordinate of its points along the unit vector `n` of the world [m], from its centre.
    fn reach(&self, n: DVec3) -> f64 {
        let own = self.axes.transpose() * n;
        match self.shape {
            Shape::Box(cuboid) => own.abs().dot(cuboid.half),
            shape => shape.reach(own),
        }
    }

    /// A lower bound of its distance from `other` [m]: the widest gap across an axis of either, or the line of centres.
    pub fn gap(&self, other: &Self) -> f64 {
        let between = other.center - self.center;
        let axes =
            [self.axes, other.axes].into_iter().flat_map(|axes| [axes.x_axis, axes.y_axis, axes.z_axis]);
        let gap = |n: DVec3| {
            let n = if n.dot(between) < 0.0 { -n } else { n };
            n.dot(between) - self.reach(n) - other.reach(-n)
        };
        axes.chain(between.try_normalize()).map(gap).fold(f64::NEG_INFINITY, f64::max)
    }

    /// `x` [m] of the world in its own frame.
    pub fn local(&self, x: DVec3) -> DVec3 {
        self.axes.transpose() * (x - self.center)
    }
}

/// A shape as the edges of another frame see it.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub other: Frame,
    /// Turns the edges' frame into the shape's.
    pub turn: DMat3,
    /// The edges' frame in the shape's.
    pub shift: DVec3,
    /// Weight times depth^8 below which an edge is left out [m8].
    pub least: f64,
}

impl View {
    /// `other` as seen from the frame of `axes` about `center`.
    pub fn new(center: DVec3, axes: DMat3, other: Frame, least: f64) -> Self {
        let still = other.axes.transpose();
        Self { other, turn: still * axes, shift: still * (center - other.center), least }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{ALL_FACES, Cylinder, Sphere};
    use glam::DQuat;

    #[test]
    fn the_gap_is_no_more_than_the_distance_and_finds_most_neighbours() {
        let shapes = [
            Shape::cuboid(DVec3::new(0.4, 0.2, 0.6)),
            Shape::Sphere(Sphere { radius: 0.3 }),
            Shape::Cylinder(Cylinder { radius: 0.2, half_height: 0.25 }),
        ];
        let (mut apart, mut found) = (0, 0);
        for k in 1..600_u32 {
            let f = |n: f64| (f64::from(k) * n).fract() - 0.5;
            let frame = |shape: Shape, at: f64, turn: [f64; 3]| Frame {
                center: at * DVec3::from(turn.map(f)),
                axes: DMat3::from_quat(
                    DQuat::from_xyzw(f(turn[0] * 3.1), f(turn[1] * 3.1), f(turn[2] * 3.1), 0.4).normalize(),
                ),
                shape,
                faces: ALL_FACES,
            };
            let a = frame(shapes[k as usize % 3], 1.6, [0.618_034, 0.754_877, 0.569_84]);
            let b = frame(shapes[k as usize / 3 % 3], 0.0, [0.819_17, 0.671_04, 0.549_7]);
            let gap = a.gap(&b);
            assert!((gap - b.gap(&a)).abs() < 1e-12);
            // from places on the one to the other
            let mut nearest = f64::INFINITY;
            for n in 0..2000_u32 {
                let z = 1.0 - (2.0 * f64::from(n) + 1.0) / 2e3;
                let (sin, cos) = (2.399_963_2 * f64::from(n)).sin_cos();
                let out = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
                // in its frame, from outside onto its surface
                let (distance, gradient) = a.shape.distance(2.0 * out);
                let on = a.center + a.axes * (2.0 * out - distance * gradient);
                nearest = nearest.min(b.shape.distance(b.local(on)).0);
            }
            assert!(gap < nearest + 1e-9, "{k}: {gap} {nearest}");
            apart += u32::from(nearest > 0.05);
            found += u32::from(gap > 0.0 && nearest > 0.05);
        }
        assert!(apart > 300 && f64::from(found) > 0.8 * f64::from(apart), "{found} of {apart}");
    }
}
