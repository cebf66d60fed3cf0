//! A cylinder with flat ends about the z axis of its frame: rings and a side, particles on rings.

use super::rings::{Ring, rings};
use super::surface::{Ring as Circle, Side, Surface};
use super::{ALL_FACES, Face, Faces, Geometry, Inside, Particles, WallLayer};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A cylinder with flat ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Radius [m].
    pub radius: f64,
    /// Half of the height [m].
    pub half_height: f64,
}

/// Face of the side; 4 and 5 are the lower and the upper end.
const SIDE: u8 = 0;

impl Cylinder {
    /// Distance from the axis, and the direction away from it.
    fn away(q: DVec3) -> (f64, DVec3) {
        let flat = DVec3::new(q.x, q.y, 0.0);
        let r = flat.length();
        (r, if r > 0.0 { flat / r } else { DVec3::X })
    }
}

impl Geometry for Cylinder {
    fn name(&self) -> &'static str {
        "cylinder"
    }

    fn volume(&self) -> f64 {
        PI * self.radius * self.radius * 2.0 * self.half_height
    }

    fn inertia(&self, mass: f64) -> DVec3 {
        let square = self.radius * self.radius;
        let across = mass * (0.25 * square + self.half_height * self.half_height / 3.0);
        DVec3::new(across, across, 0.5 * mass * square)
    }

    fn radius(&self) -> f64 {
        self.radius.hypot(self.half_height)
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn reach(&self, n: DVec3) -> f64 {
        self.radius * n.x.hypot(n.y) + self.half_height * n.z.abs()
    }

    fn distance(&self, q: DVec3) -> (f64, DVec3) {
        if let Some(inside) = self.depth(q, ALL_FACES) {
            return (-inside.depth, inside.outward);
        }
        let (r, away) = Self::away(q);
        let (side, end) = ((r - self.radius).max(0.0), (q.z.abs() - self.half_height).max(0.0));
        let d = side.hypot(end);
        let up = DVec3::Z * q.z.signum();
        // on the surface itself
        if d == 0.0 {
            return (0.0, if r < self.radius { up } else { away });
        }
        (d, (side * away + end * up) / d)
    }

    /// Blended near the rims as a box is near its edges.
    fn depth(&self, q: DVec3, _: Faces) -> Option<Inside> {
        let (r, away) = Self::away(q);
        let (side, end) = (self.radius - r, self.half_height - q.z.abs());
        if side <= 0.0 || end <= 0.0 {
            return None;
        }
        let up = DVec3::Z * q.z.signum();
        let end_face = if q.z > 0.0 { 5 } else { 4 };
        let (first, second) =
            if side < end { ((side, away, SIDE), (end, up)) } else { ((end, up, end_face), (side, away)) };
        let (a, b) = (first.0, second.0);
        let mut found = Inside { depth: a, outward: first.1, face: first.2 };
        if b < 2.0 * a {
            found.depth = 0.2 * a + 0.8 * b - 0.2 * b * b / a;
            found.outward = (0.2 + 0.2 * b * b / (a * a)) * first.1 + (0.8 - 0.4 * b / a) * second.1;
        }
        Some(found)
    }

    fn axes(&self) -> Vec<DVec3> {
        vec![DVec3::Z]
    }

    fn line_is_near(&self, start: DVec3, along: DVec3, length: f64, margin: f64) -> bool {
        let nearest = start + (-start.dot(along)).clamp(0.0, length) * along;
        if nearest.length() > self.radius() + margin {
            return false;
        }
        let end = start + length * along;
        start.z.min(end.z) < self.half_height + margin && start.z.max(end.z) > -self.half_height - margin
    }

    /// Rings about the axis, about a spacing apart in every direction.
    fn particles(&self, spacing: f64, _: u32, layers: i32) -> Particles {
        let mut out = Particles::default();
        let (step_r, rings) = rings(self.radius, spacing);
        let across = rings.len() as i32;
        let along = (2.0 * self.half_height / spacing + 0.5 + 1e-6).floor().max(2.0) as i32;
        let step_z = 2.0 * self.half_height / f64::from(along);
        let hollow = across > layers && along - 2 * layers >= 2;
        for (i, Ring { radius: r, area: annulus, count: n }) in (0..).zip(rings) {
            for j in 0..along {
                let z = (f64::from(j) + 0.5) * step_z - self.half_height;
                let end = if j == 0 {
                    -1.0
                } else if j == along - 1 {
                    1.0
                } else {
                    0.0
                };
                let rim = if i == 0 { 1.0 } else { 0.0 };
                let depth = i.min(j).min(along - 1 - j);
                if hollow && depth >= layers {
                    continue;
                }
                for k in 0..n {
                    let (sin, cos) = (TAU * (k as f64 + 0.5 * f64::from((i + j) % 2)) / n as f64).sin_cos();
                    let away = DVec3::new(cos, sin, 0.0);
                    let side = Face {
                        area: rim * TAU * self.radius * step_z / n as f64 * away,
                        way: 0.5 * rim * step_r * away,
                    };
                    let end = Face {
                        area: end * annulus / n as f64 * DVec3::Z,
                        way: 0.5 * end * step_z * DVec3::Z,
                    };
                    if rim != 0.0 && end.area != DVec3::ZERO {
                        out.edges.add(out.wall.len(), vec![side, end]);
                    }
                    out.add(depth, r * away + z * DVec3::Z, side.area + end.area, side.way + end.way);
                }
            }
        }
        out
    }

    /// Two rings an end that share its pressure so that it rocks and resists a spin like an even one: the mean
    /// distance from the centre is 2/3 of the radius and that of its square 1/2, whence 1/3 on the rim and 2/3
    /// halfway to it. The side carries its weight along the line of it that is deepest.
    fn surface(&self, _: &WallLayer, spacing: f64, _: u32) -> Surface {
        let mut rings = vec![];
        for (z, face) in [(-self.half_height, 4), (self.half_height, 5)] {
            for (radius, weight) in [(self.radius, 1.0 / 3.0), (0.5 * self.radius, 2.0 / 3.0)] {
                rings.push(Circle { z, radius, weight, faces: 1 << face });
            }
        }
        let side = Side { half_height: self.half_height, radius: self.radius };
        let largest = (PI * self.radius * self.radius).max(4.0 * self.radius * self.half_height);
        Surface {
            rings,
            side: Some(side),
            all_faces: ALL_FACES,
            smallest_weight: (spacing * spacing / largest).min(1.0),
            ..Surface::default()
        }
    }
}
