//! Meshes of which others cover some triangles.

use super::super::open;
use super::{Mesh, Planes};
use glam::DVec3;
use parry3d_f64::shape::TriMesh;
use std::sync::{Arc, Mutex};

static OPENED: open::Made<Mesh> = Mutex::new(Vec::new());

impl Mesh {
    /// The same with the triangles alone that are not `covered` in full.
    pub(super) fn with_open(
        &self,
        spacing: f64,
        covered: &dyn Fn(DVec3, DVec3) -> bool,
    ) -> Option<&'static Self> {
        let is_open = |[a, b, c]: [DVec3; 3]| {
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let count = open::looks(longest, spacing);
            let third = |k: u32| (f64::from(k) + 1.0 / 3.0) / f64::from(count);
            let place = |i: u32, j: u32| a + third(i) * (b - a) + third(j) * (c - a);
            (0..count).any(|i| (0..count - i).any(|j| !covered(place(i, j), normal)))
        };
        let is_open: Vec<bool> = self.faces().map(is_open).collect();
        let left = self.triangles.indices().iter().zip(&is_open).filter(|(_, open)| **open);
        let left: Vec<[u32; 3]> = left.map(|(t, _)| *t).collect();
        let left = TriMesh::new(self.vertices().to_vec(), left).ok()?;
        open::made(&OPENED, self, is_open, |is_open| Self {
            open: Some(Arc::new(left)),
            planes: self.planes.as_ref().map(|planes| Arc::new(Planes::clone(planes).with(is_open))),
            ..self.clone()
        })
    }
}
