//! Which particles of two solids may be near each other, by boxes: what a device is given to compare.
//!
//! Two large bodies touch at a face, an edge or a corner. All of one against all of the other would be some hundred
//! times as many comparisons as those of the particles there.

use crate::contact::broad::Bounds;
use glam::DVec3;

/// A device may find in f32 what lies this much beyond the reach, over reach and size.
const ROUNDING: f64 = 1e-6;

/// Particles that may be near, by their numbers and in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Near {
    /// Of the first solid.
    pub own: Vec<u32>,
    /// Of the second one, or of the walls.
    pub theirs: Vec<u32>,
}

/// The box around points [m]; of none, one that holds nothing.
pub(super) fn bounds(points: impl Iterator<Item = DVec3>) -> Bounds {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

/// Those of the particles `own`, which lie in the box `around`, and of the numbered particles `theirs` that may be
/// within `reach` [m] of each other, all in the first solid's frame: theirs at this solid's box, its own at the box
/// around those, and of theirs again what is at the box around what is left of its own. `None` if there are none.
pub(super) fn near(
    own: &[DVec3],
    around: &Bounds,
    theirs: impl Iterator<Item = (u32, DVec3)>,
    reach: f64,
) -> Option<Near> {
    let size = around.0.abs().max(around.1.abs()).max_element();
    let reach = reach + ROUNDING * (reach + size);
    let at = |&(low, high): &Bounds, x: DVec3| (low - reach).cmple(x).all() && x.cmple(high + reach).all();
    let mut theirs: Vec<(u32, DVec3)> = theirs.filter(|(_, x)| at(around, *x)).collect();
    let left = bounds(theirs.iter().map(|(_, x)| *x));
    let own: Vec<(u32, DVec3)> =
        own.iter().enumerate().filter(|(_, x)| at(&left, **x)).map(|(k, x)| (k as u32, *x)).collect();
    let left = bounds(own.iter().map(|(_, x)| *x));
    theirs.retain(|(_, x)| at(&left, *x));
    let numbers = |of: &[(u32, DVec3)]| of.iter().map(|(k, _)| *k).collect();
    (!theirs.is_empty()).then(|| Near { own: numbers(&own), theirs: numbers(&theirs) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    /// Surface points of a cube of `n` spacings.
    fn cube(n: i32) -> Vec<DVec3> {
        let mut points = vec![];
        for x in 0..n {
            for y in 0..n {
                for z in 0..n {
                    if [x, y, z].iter().any(|k| *k == 0 || *k == n - 1) {
                        points.push(DVec3::new(x.into(), y.into(), z.into()) - f64::from(n - 1) / 2.0);
                    }
                }
            }
        }
        points
    }

    #[test]
    fn boxes_keep_all_that_is_near_in_its_order_and_leave_out_most_of_the_rest() {
        let (own, reach) = (cube(20), 1.6);
        let around = bounds(own.iter().copied());
        let mut pairs = 0;
        for (way, turn) in [
            (DVec3::new(0.3, -0.2, 20.2), DMat3::IDENTITY),
            (DVec3::new(11.0, 8.0, 20.0), DMat3::from_rotation_z(0.6)),
            (DVec3::new(0.0, 3.0, 26.5), DMat3::from_rotation_x(0.8) * DMat3::from_rotation_y(0.6)),
            (DVec3::new(-19.0, 4.0, 15.0), DMat3::from_rotation_y(0.3)),
        ] {
            let other: Vec<DVec3> = own.iter().map(|x| turn * *x + way).collect();
            let numbered = other.iter().enumerate().map(|(k, x)| (k as u32, *x));
            let found = near(&own, &around, numbered, reach).expect("they touch");
            for list in [&found.own, &found.theirs] {
                assert!(list.is_sorted_by(|a, b| a < b));
            }
            for (i, x) in own.iter().enumerate() {
                for (j, _) in other.iter().enumerate().filter(|(_, y)| y.distance(*x) < reach) {
                    pairs += 1;
                    assert!(found.own.binary_search(&(i as u32)).is_ok(), "{i} of its own");
                    assert!(found.theirs.binary_search(&(j as u32)).is_ok(), "{j} of theirs");
                }
            }
            let left = found.own.len() * found.theirs.len();
            assert!(8 * left < own.len() * other.len(), "{left} comparisons are left");
        }
        assert!(pairs > 1000, "{pairs}");
        let away = own.iter().enumerate().map(|(k, x)| (k as u32, *x + DVec3::new(0.0, 0.0, 20.7)));
        assert_eq!(near(&own, &around, away, reach), None);
        assert_eq!(near(&own, &around, std::iter::empty(), reach), None);
        assert_eq!(near(&[], &bounds([].into_iter()), [(0, DVec3::ZERO)].into_iter(), reach), None);
    }
}
