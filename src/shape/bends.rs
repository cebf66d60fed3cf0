//! Where the surface of a solid bends.

use super::{Edges, PointCells};
use glam::DVec3;

/// Rows of a layer this near each other, over l0, are neighbours in it.
pub(crate) const ADJACENT: f64 = 1.2;
/// Angles between the directions of rows beside each other at which a surface bends [rad]: below them it is flat, beyond them it has an edge.
const BENDING: (f64, f64) = (1e-3, 0.6);

/// Whether a surface that goes on from the direction `a` to `b` beside it bends there.
pub(crate) fn bends(a: DVec3, b: DVec3) -> bool {
    (BENDING.0..BENDING.1).contains(&a.cross(b).length().atan2(a.dot(b)))
}

/// Of rows at `offset` with outward `area`, which lie where the surface bends on from one to the next, so that it touches others along a line or
/// in a point. At its `edges` each face goes on by itself.
pub(crate) fn bending(offset: &[DVec3], area: &[DVec3], edges: &Edges, spacing: f64) -> Vec<bool> {
    let mut cells = PointCells::new(ADJACENT * spacing);
    offset.iter().for_each(|&x| cells.add(x));
    let ways = |k: usize| edges.faces(k, area[k], DVec3::ZERO).map(|face| face.area.normalize_or_zero());
    let is_bent = |(k, &x): (usize, &DVec3)| {
        let beside = cells.numbers(x);
        let next = || beside.iter().filter(|n| **n != k).flat_map(|&n| ways(n));
        ways(k).any(|way| next().any(|other| bends(way, other)))
    };
    offset.iter().enumerate().map(is_bent).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{Cylinder, Shape, Sphere};

    #[test]
    fn round_surfaces_bend_and_faces_do_not() {
        let l0 = 0.01;
        let of = |shape: Shape| {
            let layer = shape.particles(l0, 3, 1);
            let bends = bending(&layer.wall, &layer.area, &layer.edges, l0);
            (bends.iter().filter(|b| **b).count(), bends.len())
        };
        let (bent, _) = of(Shape::cuboid(DVec3::new(0.1, 0.13, 0.08)));
        assert_eq!(bent, 0);
        for radius in [0.025, 0.05, 0.2] {
            let (bent, all) = of(Shape::Sphere(Sphere { radius }));
            assert_eq!(bent, all, "{radius}");
        }
        // The rim of an end as the side does, the end does not.
        let layer = Shape::Cylinder(Cylinder { radius: 0.05, half_height: 0.04 }).particles(l0, 3, 1);
        let bends = bending(&layer.wall, &layer.area, &layer.edges, l0);
        assert!(bends.contains(&false));
        for (bends, area) in bends.into_iter().zip(layer.area) {
            assert_eq!(bends, area.truncate().length() > 1e-9 * area.length(), "{area}");
        }
    }
}
