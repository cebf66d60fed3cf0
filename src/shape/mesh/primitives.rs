//! Cones, wedges and prisms, as triangles.

use super::cut;
use super::read::Soup;
use super::{Mesh, Unfit};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Sides of a cone: its surface is off by 0.1 % of its radius at most.
const SIDES: u32 = 64;

impl Mesh {
    /// A cone with a base of `radius` [m], `height` [m] high along z; of as much volume as the round one.
    ///
    /// # Errors
    /// A cone without a volume.
    pub fn cone(radius: f64, height: f64) -> Result<&'static Self, Unfit> {
        let key = ("cone".to_owned(), 0, [radius, height, 0.0, 0.0].map(f64::to_bits));
        Self::made(key, || Ok(cone(radius, height)))
    }

    /// What of a box of `size` [m] lies below the plane from its lower edge at x min to its upper edge at x max.
    ///
    /// # Errors
    /// A wedge without a volume.
    pub fn wedge(size: DVec3) -> Result<&'static Self, Unfit> {
        let key = ("wedge".to_owned(), 0, size.extend(0.0).to_array().map(f64::to_bits));
        Self::made(key, || Ok(wedge(size)))
    }

    /// What the closed line through the corners `section`, x and z [m], encloses, from 0 to `height` [m] along y.
    ///
    /// # Errors
    /// A prism without a volume.
    pub fn prism(section: &[[f64; 2]], height: f64) -> Result<&'static Self, Unfit> {
        let key = (format!("prism {section:?}"), 0, [height, 0.0, 0.0, 0.0].map(f64::to_bits));
        Self::made(key, || Ok(prism(section, height)))
    }
}

fn cone(radius: f64, height: f64) -> Soup {
    let turn = TAU / f64::from(SIDES);
    // a polygon as large as the circle
    let corner = radius * (turn / turn.sin()).sqrt();
    let mut vertices = vec![DVec3::ZERO, height * DVec3::Z];
    vertices.extend((0..SIDES).map(|k| {
        let (sin, cos) = (turn * f64::from(k)).sin_cos();
        corner * DVec3::new(cos, sin, 0.0)
    }));
    let sides = (0..SIDES).flat_map(|k| {
        let (a, b) = (2 + k, 2 + (k + 1) % SIDES);
        [[0, b, a], [1, a, b]]
    });
    (vertices, sides.collect())
}

fn wedge(size: DVec3) -> Soup {
    // toe, heel, top, at y = 0; the same at the other end
    let section = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Z];
    let vertices = section.into_iter().chain(section.map(|v| v + DVec3::Y)).map(|v| v * size).collect();
    let triangles =
        vec![[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [0, 2, 5], [0, 5, 3]];
    (vertices, triangles)
}

fn prism(section: &[[f64; 2]], height: f64) -> Soup {
    let n = section.len() as u32;
    let corners: Vec<DVec2> = section.iter().map(|&corner| corner.into()).collect();
    let end = |y: f64| section.iter().map(move |&[x, z]| DVec3::new(x, y, z));
    let vertices: Vec<DVec3> = end(0.0).chain(end(height)).collect();
    // Sides turn with the section, and the ends with them; what is inside out is turned when the mesh is made.
    let mut triangles: Vec<[u32; 3]> = (0..n)
        .flat_map(|a| {
            let b = (a + 1) % n;
            [[a, n + a, n + b], [a, n + b, b]]
        })
        .collect();
    // A section is checked before: it does not cross itself.
    for [a, b, c] in cut::section(&corners).unwrap_or_default() {
        triangles.extend([[a, b, c], [n + a, n + c, n + b]]);
    }
    (vertices, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Geometry;
    use std::f64::consts::PI;

    #[test]
    fn volume_and_moments_are_those_of_the_round_cone_and_of_the_wedge() {
        let (r, h) = (0.3, 0.8);
        let cone = Mesh::cone(r, h).expect("a cone");
        assert!((cone.volume() / (PI * r * r * h / 3.0) - 1.0).abs() < 1e-12, "{}", cone.volume());
        assert!((cone.origin() - 0.25 * h * DVec3::Z).length() < 1e-12, "{}", cone.origin());
        let across = 0.6 * (0.25 * r * r + h * h / 16.0);
        let exact = DVec3::new(across, across, 0.3 * r * r);
        let mut moments = cone.inertia(1.0).to_array();
        moments.sort_by(f64::total_cmp);
        let mut wanted = exact.to_array();
        wanted.sort_by(f64::total_cmp);
        for (have, want) in moments.iter().zip(wanted) {
            assert!((have / want - 1.0).abs() < 2e-3, "{moments:?} {exact}");
        }
        let size = DVec3::new(0.6, 0.4, 0.3);
        let wedge = Mesh::wedge(size).expect("a wedge");
        assert!((wedge.volume() - 0.036).abs() < 1e-12, "{}", wedge.volume());
        assert!((wedge.origin() - DVec3::new(0.4, 0.2, 0.1)).length() < 1e-12, "{}", wedge.origin());
    }

    #[test]
    fn small_ones_close() {
        for tenths in 13..=30 {
            let r = 0.1 * f64::from(tenths);
            for mesh in [Mesh::cone(r, 2.0 * r), Mesh::wedge(DVec3::new(2.0 * r, 1.7 * r, 2.0 * r))] {
                let mesh = mesh.expect("a solid");
                let out = mesh.particles(1.0, 3, 2);
                // Fewer are refused.
                if out.wall.len() < 4 {
                    continue;
                }
                let sum: DVec3 = out.area.iter().sum();
                let all: f64 = out.area.iter().map(|a| a.length()).sum();
                let most = out.area.iter().map(|a| a.length()).fold(0.0, f64::max);
                let mean = all / out.area.len().max(1) as f64;
                println!(
                    "{r:.1}: {} particles, {all:.2} m2, largest over the mean {:.2}",
                    out.wall.len(),
                    most / mean
                );
                assert!(sum.length() < 1e-9 * all, "{r}: {sum}");
                assert!(most < 3.0 * mean, "{r}: {most} of {mean}");
            }
        }
    }
}
