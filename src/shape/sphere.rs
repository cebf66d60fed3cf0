//! A sphere: one ball of a surface, particles on concentric layers.

use super::surface::Surface;
use super::{Faces, Geometry, Inside, Particles, WallLayer, areas};
use glam::DVec3;
use std::f64::consts::PI;

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Radius [m].
    pub radius: f64,
}

impl Geometry for Sphere {
    fn name(&self) -> &'static str {
        "sphere"
    }

    fn volume(&self) -> f64 {
        4.0 / 3.0 * PI * self.radius.powi(3)
    }

    fn inertia(&self, mass: f64) -> DVec3 {
        DVec3::splat(0.4 * mass * self.radius * self.radius)
    }

    fn radius(&self) -> f64 {
        self.radius
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn reach(&self, _: DVec3) -> f64 {
        self.radius
    }

    fn distance(&self, q: DVec3) -> (f64, DVec3) {
        let r = q.length();
        // at the very centre every way out is as short
        (r - self.radius, if r > 0.0 { q / r } else { DVec3::Z })
    }

    fn depth(&self, q: DVec3, _: Faces) -> Option<Inside> {
        let (distance, outward) = self.distance(q);
        (distance < 0.0).then_some(Inside { depth: -distance, outward, face: 0 })
    }

    fn axes(&self) -> Vec<DVec3> {
        vec![]
    }

    fn line_is_near(&self, start: DVec3, along: DVec3, length: f64, margin: f64) -> bool {
        let nearest = start + (-start.dot(along)).clamp(0.0, length) * along;
        nearest.length() < self.radius + margin
    }

    /// Layers a spacing apart, the outermost half of one below the surface; on each a Fibonacci lattice.
    fn particles(&self, spacing: f64, _: u32, layers: i32) -> Particles {
        let mut out = Particles::default();
        let count = (self.radius / spacing + 0.5 + 1e-6).floor().max(1.0) as i32;
        let step = self.radius / f64::from(count);
        let kept = if count > layers { layers.max(1) } else { count };
        for depth in 0..kept {
            let r = self.radius - (f64::from(depth) + 0.5) * step;
            // as many as cells of the layer's volume
            let outer = r + 0.5 * step;
            let inner = r - 0.5 * step;
            let volume = 4.0 / 3.0 * PI * (outer.powi(3) - inner.powi(3));
            let n = (volume / (step * spacing * spacing)).round().max(4.0) as usize;
            let directions = directions(n);
            let area = 4.0 * PI * self.radius * self.radius / directions.len() as f64;
            for outward in directions {
                out.add(depth, r * outward, area * outward, 0.5 * step * outward);
            }
        }
        // No pressure turns a sphere.
        areas::close(&mut out, self.volume(), &|at, change| change.project_onto(at));
        out
    }

    fn surface(&self, _: &WallLayer, _: f64, _: u32) -> Surface {
        Surface::ball(self.radius)
    }
}

/// About `n` directions spread evenly: a golden spiral, of a handful the corners of a tetrahedron, an octahedron or a cube, which carry an even
/// pressure and one that grows by themselves.
fn directions(n: usize) -> Vec<DVec3> {
    match n {
        0..=4 => [
            DVec3::ONE,
            DVec3::new(1.0, -1.0, -1.0),
            DVec3::new(-1.0, 1.0, -1.0),
            DVec3::new(-1.0, -1.0, 1.0),
        ]
        .map(DVec3::normalize)
        .to_vec(),
        5 | 6 => DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).collect(),
        7..=9 => (0..8)
            .map(|k| {
                DVec3::from_array([1, 2, 4].map(|bit| if k & bit == 0 { -1.0 } else { 1.0 })).normalize()
            })
            .collect(),
        _ => fibonacci(n).collect(),
    }
}

/// `n` directions on a golden spiral.
fn fibonacci(n: usize) -> impl Iterator<Item = DVec3> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    (0..n).map(move |k| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / n as f64;
        let (sin, cos) = (golden * k as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_push_through_the_middle_and_carry_the_volume() {
        for tenths in (5..60).chain([100]) {
            let sphere = Sphere { radius: 0.1 * f64::from(tenths) };
            let particles = sphere.particles(1.0, 3, 2);
            let (mut sum, mut volume) = (DVec3::ZERO, 0.0);
            let mut moments = [DVec3::ZERO; 3];
            for ((x, way), area) in particles.wall.iter().zip(&particles.to_surface).zip(&particles.area) {
                let at = *x + *way;
                assert!((at.length() - sphere.radius).abs() < 1e-12 && area.dot(at) > 0.0, "{area} at {at}");
                assert!(at.cross(*area).length() < 1e-9, "{area} at {at}");
                (sum, volume) = (sum + *area, volume + at.dot(*area) / 3.0);
                (0..3).for_each(|k| moments[k] += at[k] * *area);
            }
            assert!(sum.length() < 1e-9, "{sum}");
            assert!((volume / sphere.volume() - 1.0).abs() < 1e-9, "{volume} for {}", sphere.volume());
            for (k, moment) in moments.into_iter().enumerate() {
                let off = moment / sphere.volume() - DVec3::AXES[k];
                assert!(off.length() < 1e-9, "{}: {off}", sphere.radius);
            }
        }
    }
}
