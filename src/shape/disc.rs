//! A round slice in the plane y = 0: the cylinder of two dimensions. It has no ends.

use super::rings::{Ring, rings};
use super::surface::Surface;
use super::{Faces, Geometry, Inside, Particles, WallLayer};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A round slice about the y axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Radius [m].
    pub radius: f64,
    /// Width of the slice along y [m].
    pub width: f64,
}

const IN_PLANE: DVec3 = DVec3::new(1.0, 0.0, 1.0);

impl Geometry for Disc {
    fn name(&self) -> &'static str {
        "cylinder"
    }

    fn volume(&self) -> f64 {
        PI * self.radius * self.radius * self.width
    }

    fn inertia(&self, mass: f64) -> DVec3 {
        let square = self.radius * self.radius;
        let across = mass * (0.25 * square + self.width * self.width / 12.0);
        DVec3::new(across, 0.5 * mass * square, across)
    }

    fn radius(&self) -> f64 {
        self.radius
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn reach(&self, n: DVec3) -> f64 {
        self.radius * (n * IN_PLANE).length() + 0.5 * self.width * n.y.abs()
    }

    fn distance(&self, q: DVec3) -> (f64, DVec3) {
        let q = q * IN_PLANE;
        let r = q.length();
        (r - self.radius, if r > 0.0 { q / r } else { DVec3::Z })
    }

    fn depth(&self, q: DVec3, _: Faces) -> Option<Inside> {
        let (distance, outward) = self.distance(q);
        (distance < 0.0).then_some(Inside { depth: -distance, outward, face: 0 })
    }

    fn axes(&self) -> Vec<DVec3> {
        vec![DVec3::Y]
    }

    fn line_is_near(&self, start: DVec3, along: DVec3, length: f64, margin: f64) -> bool {
        let nearest = start + (-start.dot(along)).clamp(0.0, length) * along;
        self.distance(nearest).0 < margin
    }

    /// Rings about a spacing apart, the outermost half of one below the rim.
    fn particles(&self, spacing: f64, _: u32, layers: i32) -> Particles {
        let mut out = Particles::default();
        let (step, rings) = rings(self.radius, spacing);
        let count = rings.len() as i32;
        let kept = if count > layers { layers.max(1) } else { count };
        for (depth, Ring { radius: r, count: n, .. }) in (0..kept).zip(rings) {
            // the chords of a regular polygon and its apothem
            let area = TAU * self.radius * self.width / n as f64;
            for k in 0..n {
                let (sin, cos) = (TAU * (k as f64 + 0.5 * f64::from(depth % 2)) / n as f64).sin_cos();
                let outward = DVec3::new(cos, 0.0, sin);
                out.add(depth, r * outward, area * outward, 0.5 * step * outward);
            }
        }
        out
    }

    fn surface(&self, _: &WallLayer, _: f64, _: u32) -> Surface {
        Surface::ball(self.radius)
    }
}
