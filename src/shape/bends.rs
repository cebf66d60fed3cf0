//! Where the surface of a solid bends.

use super::{Face, PointCells, Shape};
use glam::DVec3;
use rayon::prelude::*;

/// Rows of a layer this near each other, over l0, are neighbours in it.
pub(crate) const ADJACENT: f64 = 1.2;
/// Angles between the directions of rows beside each other at which a surface bends [rad]: below them it is flat, beyond them it has an edge.
const BENDING: (f64, f64) = (1e-3, 0.6);
/// Where it has one that is round by its shape, whose ends are at right angles to the side: rows of a small one turn by more.
const ROUND: f64 = 1.2;

/// Whether a surface that goes on from the direction `a` to `b` beside it bends there.
pub(crate) fn bends(a: DVec3, b: DVec3) -> bool {
    turns(a, b, BENDING.1)
}

fn turns(a: DVec3, b: DVec3, most: f64) -> bool {
    (BENDING.0..most).contains(&a.cross(b).length().atan2(a.dot(b)))
}

/// How far before the middle of a face its normal is looked up, over l0.
const LOOKED_UP: f64 = 0.02;

/// Of each row of a layer, which of its faces bend: the bit of their number is set.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bending(pub Vec<u8>);

impl Bending {
    /// Whether a face of a row does; none of what nothing is known of.
    pub fn at(&self, row: usize, face: usize) -> bool {
        self.0.get(row).is_some_and(|faces| faces & 1 << face != 0)
    }

    /// Whether any face of a row does.
    pub fn any(&self, row: usize) -> bool {
        self.0[row] != 0
    }
}

/// Of rows at `offset` on the surface of `shape`, whose centre is `shape_offset` from theirs, which of their `faces` lie where it bends on from one to the next, so
/// that it touches others along a line or in a point. The surface tells and not the areas, whose sums no flat face has quite to itself.
pub(crate) fn bending<F: Iterator<Item = Face>>(
    shape: &Shape,
    shape_offset: DVec3,
    offset: &[DVec3],
    faces: impl Fn(usize) -> F + Sync,
    spacing: f64,
) -> Bending {
    let normals = |(row, x): (usize, &DVec3)| -> Vec<DVec3> {
        let normal = |face: Face| {
            let out = face.area.try_normalize().unwrap_or_else(|| face.way.normalize_or_zero());
            shape.distance(*x + face.way + LOOKED_UP * spacing * out - shape_offset).1
        };
        faces(row).map(normal).collect()
    };
    let normals: Vec<Vec<DVec3>> = offset.par_iter().enumerate().map(normals).collect();
    let is_round = matches!(shape, Shape::Sphere(_) | Shape::Cylinder(_) | Shape::Disc(_));
    let most = if is_round { ROUND } else { BENDING.1 };
    let mut cells = PointCells::new(ADJACENT * spacing);
    offset.iter().for_each(|&x| cells.add(x));
    let is_bent = |(row, &x): (usize, &DVec3)| {
        let beside = cells.numbers(x);
        let bent = |way: &DVec3| {
            beside
                .iter()
                .filter(|n| **n != row)
                .flat_map(|&n| &normals[n])
                .any(|other| turns(*way, *other, most))
        };
        let bits = normals[row].iter().zip(0..).filter(|(way, _)| bent(way)).map(|(_, face)| 1 << face);
        bits.sum()
    };
    Bending(offset.iter().enumerate().map(is_bent).collect())
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
            let bends = bending(&shape, DVec3::ZERO, &layer.wall, |k| layer.faces(k), l0);
            ((0..layer.wall.len()).filter(|&row| bends.any(row)).count(), layer.wall.len())
        };
        let (bent, _) = of(Shape::cuboid(DVec3::new(0.1, 0.13, 0.08)));
        assert_eq!(bent, 0);
        for radius in [0.025, 0.05, 0.2] {
            let (bent, all) = of(Shape::Sphere(Sphere { radius }));
            assert_eq!(bent, all, "{radius}");
        }
        // The faces of the side do, of a cylinder and of a cone, those of the ends do not.
        let mut shapes = vec![Shape::Cylinder(Cylinder { radius: 0.05, half_height: 0.04 })];
        #[cfg(feature = "mesh")]
        shapes.push(Shape::Mesh(crate::shape::Mesh::cone(0.056, 0.1).expect("a cone")));
        for shape in shapes {
            let layer = shape.particles(l0, 3, 1);
            let bends = bending(&shape, DVec3::ZERO, &layer.wall, |k| layer.faces(k), l0);
            let mut ends = 0;
            for row in 0..layer.wall.len() {
                for (number, face) in layer.faces(row).enumerate() {
                    let is_end = face.area.truncate().length() < 0.1 * face.area.length();
                    ends += usize::from(is_end);
                    assert_eq!(!bends.at(row, number), is_end, "{} {row} {face:?}", shape.name());
                }
            }
            assert!(ends > 50, "{ends}");
        }
    }
}
