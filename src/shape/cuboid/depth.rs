//! How deep a point lies in a box.

use super::super::{Faces, Inside};
use glam::DVec3;

/// All six faces.
pub(crate) const ALL_FACES: Faces = 0b11_1111;

/// Depth of a point `q` in the frame of a box [m] below the nearest of `faces`; `None` outside. A point
/// under a face that is not in `faces` is still inside: it is pushed out through the faces that bodies
/// can reach.
///
/// Where two faces are nearly as near (b < 2 a) the depth is 0.2 a + 0.8 b - 0.2 b^2 / a instead of
/// their minimum a: the same up to the first derivative at b = 2 a, symmetric at b = a, so that the
/// force turns steadily where a body slides round an edge. With the bare minimum it jumps by 90
/// degrees there, and each jump costs or gives energy of first order in the time step.
#[inline]
pub(crate) fn depth(q: DVec3, half: DVec3, faces: Faces) -> Option<Inside> {
    let over = half - q.abs();
    let smallest = over.min_element();
    if smallest <= 0.0 {
        return None;
    }
    if faces == ALL_FACES {
        let near = over.cmplt(DVec3::splat(2.0 * smallest)).bitmask();
        if near.is_power_of_two() {
            let axis = near.trailing_zeros() as u8;
            let face = 2 * axis + u8::from(q[usize::from(axis)] > 0.0);
            return Some(Inside { depth: smallest, outward: face_normal(face), face });
        }
    } else if faces.is_power_of_two() {
        // a floor or the side of a tank
        let face = faces.trailing_zeros() as u8;
        let outward = face_normal(face);
        let depth = half[usize::from(face / 2)] - q.dot(outward);
        return Some(Inside { depth, outward, face });
    }
    blended(q, half, faces)
}

/// [`depth`] of a point inside, where more than one face may count.
fn blended(q: DVec3, half: DVec3, faces: Faces) -> Option<Inside> {
    let over = half - q.abs();
    let mut sign = [false; 3];
    let mut near = over;
    for k in 0..3 {
        let (low, high) = (1 << (2 * k), 1 << (2 * k + 1));
        sign[k] = q[k] > 0.0;
        if faces & (low | high) != low | high {
            sign[k] = faces & high != 0;
            let d = if sign[k] { half[k] - q[k] } else { half[k] + q[k] };
            near[k] = if faces & (low | high) == 0 { f64::INFINITY } else { d };
        }
    }
    let first = if near.x <= near.y && near.x <= near.z { 0 } else { 1 + usize::from(near.z < near.y) };
    let (mut second, mut third) = ((first + 1) % 3, (first + 2) % 3);
    if near[third] < near[second] {
        std::mem::swap(&mut second, &mut third);
    }
    let a = near[first];
    if a == f64::INFINITY {
        return None;
    }
    let toward = |k: usize| face_normal(2 * k as u8 + u8::from(sign[k]));
    let mut found =
        Inside { depth: a, outward: toward(first), face: 2 * first as u8 + u8::from(sign[first]) };
    for k in [second, third] {
        let (a, b) = (found.depth, near[k]);
        if b < 2.0 * a {
            found.depth = 0.2 * a + 0.8 * b - 0.2 * b * b / a;
            found.outward = (0.2 + 0.2 * b * b / (a * a)) * found.outward + (0.8 - 0.4 * b / a) * toward(k);
        }
    }
    Some(found)
}

/// Outward normal of a face in the box's frame.
#[inline]
pub(crate) fn face_normal(face: u8) -> DVec3 {
    const NORMALS: [DVec3; 6] = [DVec3::NEG_X, DVec3::X, DVec3::NEG_Y, DVec3::Y, DVec3::NEG_Z, DVec3::Z];
    NORMALS[usize::from(face)]
}

/// Largest distance of `q` beyond a face plane of the box [m]: a lower bound of its distance.
#[inline]
pub(crate) fn outside(q: DVec3, half: DVec3) -> f64 {
    (q.abs() - half).max_element()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_depth_is_continuous_and_its_gradient_is_the_normal() {
        let half = DVec3::new(1.0, 0.7, 0.5);
        let at = |q: DVec3| depth(q, half, ALL_FACES).unwrap();
        let (h, mut blended) = (1e-6, 0);
        for k in 0..2000 {
            let f = |n: f64| (f64::from(k) * n).fract();
            let q =
                DVec3::new(0.99 - 0.3 * f(0.618_034), 0.69 - 0.3 * f(0.754_877), -0.49 + 0.2 * f(0.569_84));
            let here = at(q);
            blended += usize::from(here.outward.abs().max_element() < 0.99);
            let slope = DVec3::AXES.map(|e| (at(q - h * e).depth - at(q + h * e).depth) / (2.0 * h));
            // three faces within a factor of two of each other keep a kink where the outer two swap
            if (DVec3::from_array(slope) - here.outward).length() > 1e-3 {
                let over = half - q.abs();
                assert!(over.max_element() < 2.5 * over.min_element(), "{q} {slope:?} {here:?}");
            }
        }
        assert!(blended > 200);
    }

    #[test]
    fn a_point_under_a_hidden_face_is_pushed_through_a_reachable_one() {
        let half = DVec3::ONE;
        let found = depth(DVec3::new(0.0, 0.0, -0.9), half, 0b10_0000).unwrap();
        assert_eq!((found.outward, found.face), (DVec3::Z, 5));
        assert!((found.depth - 1.9).abs() < 1e-15);
        assert_eq!(depth(DVec3::ZERO, half, 0), None);
    }
}
