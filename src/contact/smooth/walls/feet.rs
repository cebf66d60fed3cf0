//! A wall that stands on another one goes on into it, as far as what lies on the other may be pressed in: else the
//! foot of a body that slides along a floor, a little below its surface, would not meet the post that stands there,
//! until it rises and is suddenly deep in it. Where two of these make a corner on a third one, that ends before them.

use super::{COVERED, WallBox, corners_are_covered, face_is_covered, is_covered, looks};
use crate::shape::{ALL_FACES, Faces, PLANE_FACES, face_normal};
use glam::DVec3;

/// How far a wall goes on into another one that it stands on, over the spacing.
const FOOT: f64 = 0.5;
/// How far outside of a face its corner with others is looked for, over the spacing: what lies flush with it makes
/// none.
const BESIDE: f64 = 2.0 * COVERED;

/// Gives all walls their feet.
pub(super) fn set(walls: &mut [WallBox], spacing: f64, flat: bool) {
    let length = FOOT * spacing;
    let feet: Vec<Vec<u8>> = (0..walls.len()).map(|k| wall_feet(walls, k, spacing, flat)).collect();
    for (wall, feet) in walls.iter_mut().zip(feet) {
        feet.into_iter().for_each(|face| wall.move_face(face, length));
    }
    let given: Vec<Vec<u8>> = (0..walls.len()).map(|k| given_up(walls, k, spacing, flat)).collect();
    for (wall, given) in walls.iter_mut().zip(given) {
        given.into_iter().for_each(|face| wall.move_face(face, -length));
    }
}

/// Faces of wall `k` that stand in full on other walls, with an open face that meets these at an inner corner.
fn wall_feet(walls: &[WallBox], k: usize, spacing: f64, flat: bool) -> Vec<u8> {
    let (wall, length) = (&walls[k], FOOT * spacing);
    let all: Faces = if flat { PLANE_FACES } else { ALL_FACES };
    // what has been found covered is so by more than a crust, up to its corners: on a slope these may stick out
    let stands = |face: u8| {
        let closed = (all & !wall.faces) >> face & 1 == 1;
        closed
            && face_is_covered(walls, k, face, length, spacing, flat)
            && corners_are_covered(walls, k, face, length, spacing, flat)
    };
    let meets = |foot: u8, side: u8| {
        let (across, beside) = (usize::from(foot / 2), usize::from(side / 2));
        let along = 3 - across - beside;
        let out = face_normal(foot) * (wall.half + 0.5 * length)
            + face_normal(side) * (wall.half + BESIDE * spacing);
        let places = looks(wall.half[along], spacing, flat && along == 1);
        places.into_iter().any(|x| is_covered(walls, k, out + x * DVec3::AXES[along], spacing))
    };
    let has_corner = |foot: u8| {
        (0..6).any(|side| side / 2 != foot / 2 && wall.faces >> side & 1 == 1 && meets(foot, side))
    };
    (0..6).filter(|&face| stands(face) && has_corner(face)).collect()
}

/// Covered faces of wall `k` that it gives up to those that go on into it there: two of its covered faces meet at an
/// inner corner of the others. What is pressed into that corner is held by these, and would be far from any open face
/// of `k`.
fn given_up(walls: &[WallBox], k: usize, spacing: f64, flat: bool) -> Vec<u8> {
    let (wall, length) = (&walls[k], FOOT * spacing);
    let all: Faces = if flat { PLANE_FACES } else { ALL_FACES };
    let closed = |face: u8| (all & !wall.faces) >> face & 1 == 1;
    let is_bare = |face: u8, side: u8| {
        let along = 3 - usize::from(face / 2) - usize::from(side / 2);
        let out = (face_normal(face) + face_normal(side)) * (wall.half + BESIDE * spacing);
        let places = looks(wall.half[along], spacing, flat && along == 1);
        places.into_iter().any(|x| !is_covered(walls, k, out + x * DVec3::AXES[along], spacing))
    };
    let meets_another =
        |face: u8| (0..6).any(|side| side / 2 != face / 2 && closed(side) && is_bare(face, side));
    let is_held = |face: u8| {
        wall.half[usize::from(face / 2)] > length
            && face_is_covered(walls, k, face, -length, spacing, flat)
            && corners_are_covered(walls, k, face, -length, spacing, flat)
    };
    (0..6).filter(|&face| closed(face) && meets_another(face) && is_held(face)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::wall;
    use super::super::{face_is_covered, fixed, of};
    use super::*;
    use crate::periodic::Periodic;
    use crate::scene::WallShape;
    use glam::DMat3;

    #[test]
    fn a_post_goes_on_into_the_floor_and_not_out_of_a_slope() {
        let mut walls = vec![
            wall([0.0, 0.0, -0.2], [2.0, 1.0, 0.0]),
            wall([0.5, 0.2, 0.0], [0.6, 0.4, 0.3]),
            // its back is hidden by a block and a slope, which lies a little lower further on
            wall([1.0, 0.2, 0.0], [1.2, 0.42, 0.08]),
            wall([1.2, 0.2, 0.0], [1.28, 0.3, 0.12]),
        ];
        let mut slope = wall([1.0, 0.0, 0.0], [2.0, 0.6, 0.08]);
        slope.axes = DMat3::from_rotation_y(-0.2829);
        slope.center = DVec3::new(1.2579, 0.3, 0.1395) - slope.axes * DVec3::new(0.0, 0.0, 0.04);
        walls.push(slope);
        let beside = 0.5 * COVERED * 0.02;
        for k in 0..walls.len() {
            let open = (0..6).filter(|&f| !face_is_covered(&walls, k, f, beside, 0.02, false));
            walls[k].faces = open.map(|f| 1 << f).sum();
        }
        assert_eq!(wall_feet(&walls, 1, 0.02, false), [4]);
        assert_eq!(walls[3].faces & 1, 0, "its back is not hidden");
        assert!(!wall_feet(&walls, 3, 0.02, false).contains(&0));
    }

    #[test]
    fn a_block_under_an_inner_corner_ends_before_it() {
        // one lies on all of it, another one is as high as it beside
        let at = |low: [f64; 3], high: [f64; 3]| {
            let (low, high) = (DVec3::from(low), DVec3::from(high));
            WallShape {
                name: String::new(),
                center: 0.5 * (low + high),
                half: 0.5 * (high - low),
                axes: DMat3::IDENTITY,
                middle: 0.5 * (low + high),
            }
        };
        let shapes = vec![
            at([0.0, 0.0, 0.0], [0.1, 0.2, 0.06]),
            at([0.0, 0.0, 0.06], [0.1, 0.2, 0.14]),
            at([0.1, 0.0, 0.0], [0.3, 0.2, 0.06]),
        ];
        let walls = of(fixed(&shapes), &[], &Periodic::default(), 0.02, false);
        let high = |k: usize| walls[k].center + walls[k].half;
        let low = |k: usize| walls[k].center - walls[k].half;
        assert!((high(0) - DVec3::new(0.09, 0.2, 0.05)).length() < 1e-12, "{}", high(0));
        assert!((low(1) - DVec3::new(0.0, 0.0, 0.05)).length() < 1e-12, "{}", low(1));
        assert!((low(2) - DVec3::new(0.09, 0.0, 0.0)).length() < 1e-12, "{}", low(2));
    }
}
