//! Convex meshes by the planes of their faces: most distances need no search among the triangles.

use glam::DVec3;
use parry3d_f64::shape::TriMesh;

/// More planes than this take longer than a search.
const MOST: usize = 128;
/// Triangles that are flat, and surfaces that are convex, up to this of the mesh's radius: files are written in single precision.
const FLAT: f64 = 1e-7;

/// The planes of a convex mesh, those of the smallest faces first.
#[derive(Clone, Debug)]
pub(super) struct Planes {
    all: Vec<Plane>,
    /// The plane of each triangle.
    of: Vec<usize>,
    /// Rounding of places [m].
    slack: f64,
}

/// A plane of faces, all of the solid behind it.
#[derive(Clone, Copy, Debug)]
struct Plane {
    outward: DVec3,
    /// Its distance from the origin along `outward` [m].
    place: f64,
    open: Open,
}

/// How much of a plane's faces depths count to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Open {
    Whole,
    Part,
    None,
}

impl Plane {
    fn above(&self, q: DVec3) -> f64 {
        self.outward.dot(q) - self.place
    }
}

impl Planes {
    /// Those of `mesh`, of the given radius [m], if it is convex and there are few.
    pub fn of(mesh: &TriMesh, radius: f64) -> Option<Self> {
        let flat = FLAT * radius;
        let (mut all, mut areas): (Vec<Plane>, Vec<f64>) = (vec![], vec![]);
        let mut of = vec![];
        for triangle in mesh.triangles() {
            let corners = [triangle.a, triangle.b, triangle.c];
            let twice = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let (outward, area) = (twice.normalize_or_zero(), 0.5 * twice.length());
            let lies = |plane: &Plane| {
                plane.outward.dot(outward) > 0.5 && corners.iter().all(|&v| plane.above(v).abs() < flat)
            };
            let known = all.iter().position(lies);
            if known.is_none() && (all.len() == MOST || outward == DVec3::ZERO) {
                return None;
            }
            let own = known.unwrap_or(all.len());
            if known.is_none() {
                all.push(Plane { outward, place: outward.dot(corners[0]), open: Open::Whole });
                areas.push(0.0);
            }
            areas[own] += area;
            of.push(own);
        }
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_by(|&a, &b| areas[a].total_cmp(&areas[b]));
        of.iter_mut().for_each(|of| *of = order.iter().position(|k| k == of).unwrap_or_default());
        let all: Vec<Plane> = order.into_iter().map(|k| all[k]).collect();
        let is_behind = |plane: &Plane| mesh.vertices().iter().all(|&v| plane.above(v) < flat);
        all.iter().all(is_behind).then_some(Self { all, of, slack: 1e-12 * radius })
    }

    /// The same where depths count to the triangles alone that are `open`.
    pub fn with(mut self, open: &[bool]) -> Self {
        for (k, plane) in self.all.iter_mut().enumerate() {
            let mut own = self.of.iter().zip(open).filter(|(of, _)| **of == k).map(|(_, open)| *open);
            let first = own.next();
            plane.open = match first {
                _ if own.any(|open| Some(open) != first) => Open::Part,
                Some(true) => Open::Whole,
                _ => Open::None,
            };
        }
        self
    }

    /// That of the planes which a place is highest above, and how high [m]. Of two that are as near it is that of the smaller face, whatever
    /// rounding says: what is even stays so, and the particles along an edge are for the face that has fewer.
    fn highest(&self, q: DVec3, counts: impl Fn(&Plane) -> bool) -> Option<(f64, &Plane)> {
        let above = self.all.iter().filter(|plane| counts(plane)).map(|plane| (plane.above(q), plane));
        above.reduce(|a, b| if b.0 > a.0 + self.slack { b } else { a })
    }

    /// Distance from the surface [m], negative inside, and the way out there; `None` where an edge or a corner may be nearest, and on the
    /// surface itself.
    pub fn distance(&self, q: DVec3) -> Option<(f64, DVec3)> {
        let (mut least, mut plane) = self.highest(q, |_| true)?;
        if least < -self.slack {
            // The nearest plane is that of the nearest face.
            if plane.open == Open::Whole {
                return Some((least, plane.outward));
            }
            (least, plane) = self.highest(q, |plane| plane.open != Open::None)?;
            if plane.open == Open::Part {
                return None;
            }
        }
        if least.abs() <= self.slack {
            return None;
        }
        let foot = q - least * plane.outward;
        let is_on_face = self.all.iter().all(|plane| plane.above(foot) <= 2.0 * self.slack);
        is_on_face.then_some((least, plane.outward))
    }

    /// From where to where along the line [m] it runs inside, if anywhere.
    pub fn inside(&self, start: DVec3, along: DVec3, length: f64) -> Option<(f64, f64)> {
        let (mut from, mut to) = (0.0_f64, length);
        for plane in &self.all {
            let (above, slope) = (plane.above(start), plane.outward.dot(along));
            let at = -above / slope;
            if slope < 0.0 {
                from = from.max(at);
            } else if slope > 0.0 {
                to = to.min(at);
            } else if above >= 0.0 {
                return None;
            }
        }
        (from < to).then_some((from, to))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Mesh;
    use super::Planes;
    use crate::shape::Geometry;
    use glam::DVec3;
    use parry3d_f64::shape::TriMesh;
    use std::sync::Arc;

    /// Places in and around a box twice as large as `mesh`.
    fn places(mesh: &Mesh) -> Vec<DVec3> {
        let place = |k: u32| {
            let golden = DVec3::new(0.754_877_666, 0.569_840_290, 0.819_172_513);
            2.0 * mesh.radius * (2.0 * (f64::from(k) * golden).fract_gl() - 1.0)
        };
        (0..4000).map(place).collect()
    }

    /// The mesh where depths count to the triangles that are `open`.
    fn without(mesh: &Mesh, open: Vec<bool>) -> Mesh {
        let left = mesh.triangles.indices().iter().zip(&open).filter(|(_, open)| **open).map(|(t, _)| *t);
        let left = TriMesh::new(mesh.vertices().to_vec(), left.collect()).unwrap();
        let planes = Planes::clone(mesh.planes.as_ref().unwrap()).with(&open);
        Mesh { open: Some(Arc::new(left)), planes: Some(Arc::new(planes)), ..mesh.clone() }
    }

    #[test]
    fn distances_and_crossings_by_planes_are_those_by_triangles() {
        let l = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.4], [0.4, 0.4], [0.4, 1.0], [0.0, 1.0]];
        let pentagon = [[0.0, 0.0], [1.0, 0.0], [1.3, 0.7], [0.5, 1.2], [-0.2, 0.6]];
        let wedge = Mesh::wedge(DVec3::new(0.4, 0.3, 0.2)).unwrap();
        let cone = Mesh::cone(0.2, 0.5).unwrap();
        let prism = Mesh::prism(&pentagon, 0.7).unwrap();
        assert!(Mesh::prism(&l, 0.3).unwrap().planes.is_none());
        assert_eq!(wedge.planes.as_ref().unwrap().all.len(), 5);
        assert_eq!(cone.planes.as_ref().unwrap().all.len(), 65);
        // A face that others cover, and a half of one.
        let bottom = wedge.planes.as_ref().unwrap().of.iter().map(|&plane| plane != 0).collect();
        let covered = [without(wedge, bottom), without(wedge, (0..8).map(|k| k != 3).collect())];
        for mesh in [wedge, cone, prism].into_iter().chain(&covered) {
            let plain = Mesh { planes: None, ..mesh.clone() };
            let places = places(mesh);
            let mut known = 0;
            for &q in &places {
                let (ours, theirs) = (mesh.distance(q), plain.distance(q));
                assert!((ours.0 - theirs.0).abs() < 1e-12, "{mesh:?} at {q}: {ours:?} {theirs:?}");
                known += u32::from(mesh.planes.as_ref().unwrap().distance(q).is_some());
                // The way out is that to the nearest place, of which there are two on a ridge.
                let foot = q - ours.0 * ours.1;
                assert!(plain.nearest(foot).0.distance(foot) < 1e-9);
            }
            assert!(known > 300, "{known}");
            for ends in places.windows(2) {
                let (way, length) = ((ends[1] - ends[0]).normalize(), ends[0].distance(ends[1]));
                let [ours, theirs] = [mesh, &plain].map(|m| m.crossings(ends[0], way, length));
                assert_eq!(ours.len(), theirs.len());
                assert!(ours.iter().zip(&theirs).all(|(a, b)| (a - b).abs() < 1e-8));
            }
        }
    }
}
