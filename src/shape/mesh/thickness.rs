//! How thin a mesh is.

use super::super::nearest::Nearest;
use super::super::thickness::{Surface, Way, thinnest};
use super::Thickness;
use glam::DVec3;
use parry3d_f64::query::{PointQueryWithLocation, Ray, RayCast};
use parry3d_f64::shape::TriMesh;

/// Triangles, and the middle of each.
struct Sides<'a> {
    mesh: &'a TriMesh,
    middles: Nearest<3>,
}

impl Surface for Sides<'_> {
    fn comes_within(&self, q: DVec3, distance: f64) -> bool {
        // A middle that is near is found at once, and that no triangle is takes no more than to look past them all:
        // which of very many that are about as far is the nearest takes long.
        let near = || self.mesh.project_local_point_and_get_location_with_max_dist(q, false, distance);
        self.middles.has_within(q.to_array(), distance)
            || near().is_some_and(|(p, _)| p.point.distance(q) < distance)
    }

    fn parts(&self, a: DVec3, b: DVec3) -> bool {
        self.mesh.cast_local_ray(&Ray::new(a, b - a), 1.0, false).is_some()
    }
}

/// Where it is thinnest between the triangles of `mesh`.
pub(super) fn of_mesh(mesh: &TriMesh) -> Thickness {
    let size = mesh.local_aabb().extents().length();
    let middle = |t: &parry3d_f64::shape::Triangle| (t.a + t.b + t.c) / 3.0;
    let ways = mesh.triangles().filter_map(|triangle| {
        let start = middle(&triangle);
        let twice = (triangle.b - triangle.a).cross(triangle.c - triangle.a);
        let (inwards, area) = (-twice.normalize_or_zero(), 0.5 * twice.length());
        let ray = Ray::new(start + 1e-7 * size * inwards, inwards);
        let end = mesh.cast_local_ray_and_get_normal(&ray, size, false)?;
        // It leaves the solid there, whichever side parry looks from.
        let outward = if end.normal.dot(inwards) < 0.0 { -end.normal } else { end.normal };
        Some(Way { start, inwards, length: end.time_of_impact, area, outward })
    });
    let middles = Nearest::new(mesh.triangles().map(|t| middle(&t).to_array()).collect());
    let (least, place) = thinnest(ways, &Sides { mesh, middles });
    Thickness { least, place }
}
