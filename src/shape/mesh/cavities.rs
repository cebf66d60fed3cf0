//! Sealed cavities: closed parts of a surface that are turned towards what they enclose.

use super::{Mesh, edges};
use glam::DVec3;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};
use std::sync::Arc;

/// Distance over the radius at which a point is on a surface.
const ON: f64 = 1e-9;

impl Mesh {
    pub(super) fn cavities(&self) -> &[TriMesh] {
        self.cavities.get_or_init(|| of(&self.triangles))
    }

    /// Whether `q` lies in a sealed cavity, or in the solid and nowhere nearer to the surface than to that of a cavity.
    pub(super) fn lies_in_cavity(&self, q: DVec3) -> bool {
        let ((nearest, in_solid), on) = (self.nearest(q), ON * self.radius);
        let off = q.distance(nearest);
        self.cavities().iter().any(|cavity| {
            let found = cavity.project_local_point(q, false);
            if in_solid || off <= on { q.distance(found.point) <= off + on } else { found.is_inside }
        })
    }
}

/// The cavities of a closed surface that turns outwards, each turned inside out to be a solid.
fn of(surface: &TriMesh) -> Arc<[TriMesh]> {
    let vertices = surface.vertices();
    let volume = |part: &[[u32; 3]]| -> f64 {
        let tip = vertices[part[0][0] as usize];
        let of = |t: &[u32; 3]| t.map(|k| vertices[k as usize] - tip);
        part.iter().map(of).map(|[a, b, c]| a.cross(b).dot(c)).sum()
    };
    let mut parts = parts(surface.indices());
    parts.retain(|part| volume(part) < 0.0);
    parts.iter_mut().flatten().for_each(|t| t.swap(1, 2));
    // Of triangles that a mesh was made of already.
    let solid = |part| TriMesh::with_flags(vertices.to_vec(), part, TriMeshFlags::ORIENTED).ok();
    parts.into_iter().filter_map(solid).collect()
}

/// The triangles, by parts that share edges.
fn parts(triangles: &[[u32; 3]]) -> Vec<Vec<[u32; 3]>> {
    let across = edges(triangles);
    let mut seen = vec![false; triangles.len()];
    let mut out = vec![];
    for first in 0..triangles.len() {
        let (mut part, mut open) = (vec![], vec![first]);
        while let Some(k) = open.pop() {
            if std::mem::replace(&mut seen[k], true) {
                continue;
            }
            let t = triangles[k];
            part.push(t);
            open.extend((0..3).filter_map(|e| across.get(&(t[(e + 1) % 3], t[e]))));
        }
        if !part.is_empty() {
            out.push(part);
        }
    }
    out
}
