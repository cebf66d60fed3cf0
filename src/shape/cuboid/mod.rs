//! A box: its depth and its edges in closed form, particles on a lattice fitted to its edges.

mod depth;
mod edges;
mod surface;

pub(crate) use depth::{ALL_FACES, face_normal};

use super::surface::Surface;
use super::{Edges, Faces, Geometry, Inside, Node, Particles, WallLayer};
use glam::{DMat3, DVec3, IVec3};

/// A box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    /// Half of the edge lengths [m].
    pub half: DVec3,
}

impl Cuboid {
    #[inline]
    pub(super) fn each_node(
        &self,
        (start, along, length): (DVec3, DVec3, f64),
        faces: Faces,
        least: f64,
        visit: impl FnMut(Node, Inside),
    ) {
        edges::nodes(start, along, length, self.half, faces, least, visit);
    }

    /// Part of the stretch `start` + s `along`, s in 0..`length`, inside: range of s.
    pub(crate) fn clip(&self, start: DVec3, along: DVec3, length: f64) -> Option<(f64, f64)> {
        edges::clip(start, along, length, self.half)
    }
}

impl Geometry for Cuboid {
    fn name(&self) -> &'static str {
        "box"
    }

    fn volume(&self) -> f64 {
        (2.0 * self.half).element_product()
    }

    fn inertia(&self, mass: f64) -> DVec3 {
        let s2 = (2.0 * self.half) * (2.0 * self.half);
        mass / 12.0 * DVec3::new(s2.y + s2.z, s2.z + s2.x, s2.x + s2.y)
    }

    fn radius(&self) -> f64 {
        self.half.length()
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn reach(&self, n: DVec3) -> f64 {
        n.abs().dot(self.half)
    }

    fn extent(&self, rotation: DMat3) -> DVec3 {
        rotation.abs() * self.half
    }

    fn outside(&self, q: DVec3) -> f64 {
        depth::outside(q, self.half)
    }

    fn distance(&self, q: DVec3) -> (f64, DVec3) {
        if let Some(inside) = depth::depth(q, self.half, ALL_FACES) {
            return (-inside.depth, inside.outward);
        }
        let beyond = (q.abs() - self.half).max(DVec3::ZERO);
        let d = beyond.length();
        if d == 0.0 {
            let face = (q.abs() - self.half).max_position();
            return (0.0, DVec3::AXES[face] * q[face].signum());
        }
        (d, beyond * q.signum() / d)
    }

    #[inline]
    fn depth(&self, q: DVec3, faces: Faces) -> Option<Inside> {
        depth::depth(q, self.half, faces)
    }

    fn axes(&self) -> Vec<DVec3> {
        DVec3::AXES.to_vec()
    }

    fn line_is_near(&self, start: DVec3, along: DVec3, length: f64, margin: f64) -> bool {
        edges::clip(start, along, length, self.half + margin).is_some()
    }

    fn nodes(
        &self,
        line: (DVec3, DVec3, f64),
        faces: Faces,
        least: f64,
        visit: &mut dyn FnMut(Node, Inside),
    ) {
        self.each_node(line, faces, least, visit);
    }

    fn corners(&self) -> Vec<DVec3> {
        let way = |k: i32| DVec3::from_array([0, 1, 2].map(|b| f64::from(k >> b & 1) * 2.0 - 1.0));
        (0..8).map(|k| self.half * way(k)).collect()
    }

    /// n = max(2, round(L / l0)) along an edge, L / n apart, so that the outermost stand half a spacing inside
    /// the true faces.
    fn particles(&self, spacing: f64, dimensions: u32, layers: i32) -> Particles {
        let (size, plane) = (2.0 * self.half, dimensions == 2);
        let mut out = Particles::default();
        let mut n = (size / spacing + 0.5 + 1e-6).floor().as_ivec3().max(IVec3::splat(2));
        if plane {
            n.y = 1;
        }
        let step = size / n.as_dvec3();
        let face = DVec3::new(step.y * step.z, step.z * step.x, step.x * step.y);
        // A hollow one particle across saves nothing worth having.
        let real = if plane { IVec3::new(n.x, i32::MAX, n.z) } else { n };
        let hollow = (real - 2 * layers).min_element() >= 2;
        for i in 0..n.x {
            for j in 0..n.y {
                for k in 0..n.z {
                    let c = IVec3::new(i, j, k);
                    let offset = (c.as_dvec3() + 0.5) * step - 0.5 * size;
                    let (mut depth, mut outward) = (i32::MAX, DVec3::ZERO);
                    for axis in (0..3).filter(|&axis| !(plane && axis == 1)) {
                        depth = depth.min(c[axis]).min(n[axis] - 1 - c[axis]);
                        if c[axis] == 0 {
                            outward[axis] = -1.0;
                        } else if c[axis] == n[axis] - 1 {
                            outward[axis] = 1.0;
                        }
                    }
                    if depth < layers || !hollow {
                        out.add(depth, offset, outward * face, outward * 0.5 * step);
                    }
                }
            }
        }
        out.edges = Edges::of_box(&out.area, &out.to_surface);
        out
    }

    fn surface(&self, particles: &WallLayer, _: f64, dimensions: u32) -> Surface {
        Surface::cuboid(self.half, particles, dimensions)
    }
}
