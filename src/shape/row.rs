//! The faces of a particle of a wall layer, of which one at an edge or a corner has two or three.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Most faces of a particle.
pub(crate) const MOST_FACES: usize = 3;
/// What of an area is none, over the area.
const NONE: f64 = 1e-6;

/// A part of the surface that a particle of a wall layer stands for, in the frame of its solid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Face {
    /// Outward area [m2].
    pub area: DVec3,
    /// Way from the particle to its middle [m].
    pub way: DVec3,
}

/// The particles of a wall layer that have several faces, each in another depth; any other has one, of its whole area.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Edges(Vec<(usize, Vec<Face>)>);

impl Edges {
    /// Those of a box, from the sums over its faces of area [m2] and way to the surface [m].
    pub fn of_box(area: &[DVec3], to_surface: &[DVec3]) -> Self {
        let mut out = Self::default();
        for (row, (&area, &way)) in area.iter().zip(to_surface).enumerate() {
            let faces = DVec3::AXES.map(|e| Face { area: area * e, way: way * e });
            out.add(row, faces.into_iter().filter(|face| face.area != DVec3::ZERO).collect());
        }
        out
    }

    /// Adds the `faces` of `row`, which lies behind those that it has, if they are several.
    pub(crate) fn add(&mut self, row: usize, faces: Vec<Face>) {
        debug_assert!(faces.len() <= MOST_FACES && self.0.last().is_none_or(|last| last.0 < row));
        if faces.len() > 1 {
            self.0.push((row, faces));
        }
    }

    /// Gives the faces of `row`, if they are several, other `areas` [m2].
    pub(crate) fn set(&mut self, row: usize, areas: &[DVec3]) {
        if let Ok(k) = self.0.binary_search_by_key(&row, |edge| edge.0) {
            self.0[k].1.iter_mut().zip(areas).for_each(|(face, &area)| face.area = area);
        }
    }

    /// Those of the rows that are `kept`, numbered anew.
    pub(crate) fn kept(&self, kept: &[bool]) -> Self {
        let count =
            |before: &mut usize, &kept: &bool| Some(std::mem::replace(before, *before + usize::from(kept)));
        let numbers: Vec<usize> = kept.iter().scan(0, count).collect();
        let left = self.0.iter().filter(|edge| kept[edge.0]);
        Self(left.map(|(row, faces)| (numbers[*row], faces.clone())).collect())
    }

    /// The several faces of `row`, or none.
    pub(crate) fn of(&self, row: usize) -> &[Face] {
        self.0.binary_search_by_key(&row, |edge| edge.0).map_or(&[], |k| &self.0[k].1)
    }

    /// What of the faces of `row` sums up to `area` [m2], a part of its area: one face `to_surface` [m] from the particle, unless it has several.
    pub fn faces(&self, row: usize, area: DVec3, to_surface: DVec3) -> impl Iterator<Item = Face> + use<> {
        let (faces, count) = match self.of(row) {
            [] => ([Face { area, way: to_surface }; MOST_FACES + 1], 1),
            faces => parts(faces, area, to_surface),
        };
        faces.into_iter().take(count)
    }
}

/// What of `faces` sums up to `area` [m2], and how many there are; what no face looks along acts `to_surface` [m] from the particle.
// Made once, and not wherever rows are looked at.
#[inline(never)]
fn parts(faces: &[Face], area: DVec3, to_surface: DVec3) -> ([Face; MOST_FACES + 1], usize) {
    let mut out = [Face::default(); MOST_FACES + 1];
    let all: DVec3 = faces.iter().map(|face| face.area).sum();
    let size: f64 = faces.iter().map(|face| face.area.length()).sum();
    if (area - all).length() <= NONE * size {
        out[..faces.len()].copy_from_slice(faces);
        return (out, faces.len());
    }
    // The same part of each, and what is still missing by as little of each as it takes.
    let even = area.dot(all) / all.length_squared().max(f64::MIN_POSITIVE);
    let parts = least_parts(faces, area - even * all);
    let (mut count, mut found) = (0, DVec3::ZERO);
    let mut add = |face: Face| {
        if face.area.length() > NONE * size {
            out[count] = face;
            found += face.area;
            count += 1;
        }
        found
    };
    for (face, part) in faces.iter().zip(parts) {
        add(Face { area: (even + part) * face.area, way: face.way });
    }
    let rest = area - add(Face::default());
    add(Face { area: rest, way: to_surface });
    (out, count)
}

/// How much of each of the `faces` sums up to `area`, as far as they can, by the smallest sum of squares.
fn least_parts(faces: &[Face], area: DVec3) -> [f64; MOST_FACES] {
    // A^T (A A^T)^-1 a over the directions that the areas span, found one after the other.
    let mut out = [0.0; MOST_FACES];
    let mut left: Vec<(DVec3, [f64; MOST_FACES])> = vec![];
    let size = faces.iter().map(|face| face.area.length_squared()).sum::<f64>();
    for (k, face) in faces.iter().enumerate() {
        let mut parts = [0.0; MOST_FACES];
        parts[k] = 1.0;
        left.push((face.area, parts));
    }
    // Gram-Schmidt, the largest first: each direction with the parts of faces that make it.
    while let Some(best) =
        (0..left.len()).max_by(|&a, &b| left[a].0.length_squared().total_cmp(&left[b].0.length_squared()))
    {
        let (way, parts) = left.swap_remove(best);
        let square = way.length_squared();
        if square <= NONE * size {
            break;
        }
        let along = area.dot(way) / square;
        (0..MOST_FACES).for_each(|k| out[k] += along * parts[k]);
        for (other, of) in &mut left {
            let shared = other.dot(way) / square;
            *other -= shared * way;
            (0..MOST_FACES).for_each(|k| of[k] -= shared * parts[k]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Faces of these areas, each a metre away.
    fn edges(areas: &[DVec3]) -> Edges {
        let mut out = Edges::default();
        out.add(4, areas.iter().map(|&area| Face { area, way: area.normalize() }).collect());
        out
    }

    #[test]
    fn parts_of_an_area_are_those_of_its_faces() {
        let sharp = [DVec3::new(0.5, 0.0, 2.0), DVec3::new(-0.5, 0.0, 2.0)];
        let corner = [DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, -0.7, 0.0), DVec3::new(0.0, 0.0, 0.2)];
        // Three in a plane: they can be summed up in more than one way.
        let fan = [DVec3::X, DVec3::Z, DVec3::new(1.0, 0.0, 1.0)];
        for areas in [&sharp[..], &corner, &fan] {
            let edges = edges(areas);
            let all: DVec3 = areas.iter().sum();
            let found: Vec<DVec3> = edges.faces(4, all, DVec3::Y).map(|face| face.area).collect();
            assert_eq!(found, areas);
            let half: Vec<Face> = edges.faces(4, 0.5 * all, DVec3::Y).collect();
            assert!(half.iter().zip(areas).all(|(face, area)| face.area.distance(0.5 * *area) < 1e-12));
            for area in areas {
                let parts: Vec<Face> = edges.faces(4, *area, DVec3::Y).collect();
                let sum: DVec3 = parts.iter().map(|face| face.area).sum();
                assert!(sum.distance(*area) < 1e-12, "{area}: {parts:?}");
                assert!(areas.len() == 3 && areas[0] == DVec3::X || parts.len() == 1, "{area}: {parts:?}");
            }
        }
        // What no face looks along is left to the particle as a whole, and so is all of one with a single face.
        let across = edges(&sharp).faces(4, DVec3::Y, DVec3::Z).collect::<Vec<_>>();
        assert_eq!(across, [Face { area: DVec3::Y, way: DVec3::Z }]);
        let single = edges(&sharp).faces(3, DVec3::X, DVec3::Z).collect::<Vec<_>>();
        assert_eq!(single, [Face { area: DVec3::X, way: DVec3::Z }]);
    }

    #[test]
    fn rows_that_are_left_keep_their_faces() {
        let areas = [DVec3::X, DVec3::new(1.0, 0.0, 1.0), DVec3::Z, DVec3::new(-1.0, 0.0, 1.0)];
        let all = Edges::of_box(&areas, &areas);
        assert_eq!((all.of(0).len(), all.of(1).len(), all.of(3).len()), (0, 2, 2));
        let left = all.kept(&[false, false, true, true]);
        assert_eq!((left.of(0), left.of(1)), (&[][..], all.of(3)));
    }
}
