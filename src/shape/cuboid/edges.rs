//! Edges of boxes in contact: weight along a line, integrated instead of sampled.
//!
//! Two edges that cross have no surface points near the crossing unless they are half a spacing deep, and
//! an edge that slides over points is bumpy. So an edge carries its weight along its whole length, and
//! its part of the pair's effective depth is the integral of weight times depth^8 over the stretch inside
//! the other box. It is a continuous function of the poses, whether the edge turns parallel to the other's
//! or leaves at its end, and does not change as an edge slides along itself: where two edges cross, the
//! force is along the cross product of their directions without being told.
//!
//! Between the points where another face becomes the nearest, or joins the blending near an edge, the
//! depth below one face is linear and its integrals are closed: each half of such a stretch is one point
//! with the depth, weight and place that give them exactly. Where faces are blended, five Gauss nodes are
//! good to 3e-4, of which depth^8 leaves a quarter for the energy.

use super::super::{Faces, Inside, Node};
use super::depth;
use crate::shape::convex::GAUSS_5;
use glam::DVec3;

/// Part of a line, `start` + s `along` with s in 0..`length`, inside the box: range of s.
#[inline]
pub(crate) fn clip(start: DVec3, along: DVec3, length: f64, half: DVec3) -> Option<(f64, f64)> {
    let end = start + length * along;
    if start.min(end).cmpgt(half).any() || start.max(end).cmplt(-half).any() {
        return None;
    }
    let (mut low, mut high) = (0.0_f64, length);
    for k in 0..3 {
        let (first, second) = ((-half[k] - start[k]) / along[k], (half[k] - start[k]) / along[k]);
        low = low.max(first.min(second));
        high = high.min(first.max(second));
    }
    (low < high).then_some((low, high))
}

/// Distance below a face at both ends of a stretch [m].
#[derive(Clone, Copy, Debug, Default)]
struct Below {
    ends: (f64, f64),
    face: u8,
}

impl Below {
    fn at(&self, t: f64) -> f64 {
        self.ends.0 + t * (self.ends.1 - self.ends.0)
    }
}

/// Calls `visit` with every node of a line inside a box, and its depth; arguments in the frame of the box. A line of which length times depth^8 stays below
/// `least` is left out.
pub(crate) fn nodes(
    start: DVec3,
    along: DVec3,
    length: f64,
    half: DVec3,
    faces: Faces,
    least: f64,
    mut visit: impl FnMut(Node, Inside),
) {
    let Some((low, high)) = clip(start, along, length, half) else { return };
    let mut below = [Below::default(); 6];
    let mut count = 0;
    let mut deepest = f64::INFINITY;
    for face in (0..6_u8).filter(|face| faces & (1 << face) != 0) {
        let (axis, sign) = (usize::from(face / 2), if face % 2 == 1 { 1.0 } else { -1.0 });
        let at = |s: f64| half[axis] - sign * (start[axis] + s * along[axis]);
        let ends = (at(low), at(high));
        below[count] = Below { ends, face };
        deepest = deepest.min(ends.0.max(ends.1));
        count += 1;
    }
    if count == 0 || deepest <= 0.0 || (high - low) * deepest.powi(8) < least {
        return;
    }
    // a face further than twice the depth has no part in it
    let mut near = [Below::default(); 6];
    let mut kept = 0;
    for b in below[..count].iter().filter(|b| b.ends.0.min(b.ends.1) < 2.0 * deepest) {
        near[kept] = *b;
        kept += 1;
    }
    let near = &near[..kept];
    let mut breaks = [0.0_f64; 47];
    let mut ends = 1;
    for (i, a) in near.iter().enumerate() {
        for b in &near[..i] {
            for ratio in [0.5, 1.0, 2.0] {
                let first = a.ends.0 - ratio * b.ends.0;
                let second = a.ends.1 - ratio * b.ends.1;
                if first * second < 0.0 {
                    breaks[ends] = first / (first - second);
                    ends += 1;
                }
            }
        }
    }
    breaks[1..ends].sort_unstable_by(f64::total_cmp);
    breaks[ends] = 1.0;
    for piece in breaks[..=ends].windows(2) {
        let (from, to) = (piece[0], piece[1]);
        let (mut first, mut second) = (f64::INFINITY, f64::INFINITY);
        let mut nearest = Below::default();
        for b in near {
            let d = b.at(0.5 * (from + to));
            if d < first {
                (second, first, nearest) = (first, d, *b);
            } else {
                second = second.min(d);
            }
        }
        let place = |t: f64| low + t * (high - low);
        if second >= 2.0 * first {
            let outward = depth::face_normal(nearest.face);
            let middle = 0.5 * (from + to);
            for (t0, t1) in [(from, middle), (middle, to)] {
                let (share, node, deviation, depth) = whole(nearest.at(t0).max(0.0), nearest.at(t1).max(0.0));
                if share > 0.0 {
                    let inside = Inside { depth, outward, face: nearest.face };
                    let stretch = (t1 - t0) * (high - low);
                    let (place, length) = (place(t0 + node * (t1 - t0)), share * stretch);
                    visit(Node { place, length, deviation: deviation * stretch }, inside);
                }
            }
            continue;
        }
        for (node, weight) in GAUSS_5 {
            let s = place(from + node * (to - from));
            if let Some(inside) = depth::depth(start + s * along, half, faces) {
                visit(Node::point(s, weight * (to - from) * (high - low)), inside);
            }
        }
    }
}

/// The point that stands for a stretch of unit length on which the depth goes from `a` to `b`: weight w,
/// place t in 0..1, deviation from it and depth d with w d^8, w d^7, w t d^7 and w (t^2 + deviation^2) d^7 equal to the
/// integrals.
fn whole(a: f64, b: f64) -> (f64, f64, f64, f64) {
    let (largest, smallest) = if a > b { (a, b) } else { (b, a) };
    if largest <= 0.0 {
        return (0.0, 0.5, 0.0, 0.0);
    }
    let r = smallest / largest;
    let (r2, r4, r8) = (r.powi(2), r.powi(4), r.powi(8));
    // sums of r^k, (k + 1) r^k and (k + 1) (k + 2) r^k for k from 0 to 7, taken from the deeper end
    let sum = (1.0 + r) * (1.0 + r2) * (1.0 + r4);
    let first = (1.0 + 2.0 * r) + r2 * (3.0 + 4.0 * r) + r4 * ((5.0 + 6.0 * r) + r2 * (7.0 + 8.0 * r));
    let second = (2.0 + 6.0 * r) + r2 * (12.0 + 20.0 * r) + r4 * ((30.0 + 42.0 * r) + r2 * (56.0 + 72.0 * r));
    let (eighth, per_seventh) = ((sum + r8) / 9.0, 8.0 / sum);
    let depth = eighth * per_seventh;
    let place = first * per_seventh / 72.0;
    let deviation = (second * per_seventh / 720.0 - place * place).max(0.0).sqrt();
    let place = if a > b { place } else { 1.0 - place };
    (eighth / depth.powi(8), place, deviation, largest * depth)
}

#[cfg(test)]
mod tests {
    use super::super::depth::ALL_FACES;
    use super::*;

    /// Integral of depth^8 over the line and of depth^7 times the outward vector.
    fn integrals(start: DVec3, along: DVec3, half: DVec3, faces: Faces) -> (f64, DVec3) {
        let mut sums = (0.0, DVec3::ZERO);
        nodes(start, along, 3.0, half, faces, 0.0, |node, inside| {
            let width = node.length;
            sums.0 += width * inside.depth.powi(8);
            sums.1 += width * inside.depth.powi(7) * inside.outward;
        });
        sums
    }

    #[test]
    fn the_nodes_integrate_like_many_points() {
        let half = DVec3::new(0.5, 0.7, 0.4);
        for k in 0..200 {
            let f = |n: f64| (f64::from(k) * n).fract() - 0.5;
            let along = DVec3::new(f(0.618_034), f(0.754_877), 0.7 * f(0.569_84)).normalize();
            let start = 0.9 * DVec3::new(f(0.819_17), f(0.671_04), f(0.549_7)) - 1.5 * along;
            for faces in [ALL_FACES, 0b10_0000, 0b10_0110] {
                let (energy, _) = integrals(start, along, half, faces);
                let n = 40_000;
                let points = (0..n).map(|i| start + (f64::from(i) + 0.5) * 3.0 / f64::from(n) * along);
                let depths = points.filter_map(|q| depth::depth(q, half, faces));
                let sum: f64 = depths.map(|d| d.depth.powi(8)).sum::<f64>() * 3.0 / f64::from(n);
                // a hidden face cuts the line where it is deep, so that the points are off by one there
                let bound = if faces == ALL_FACES { 3e-4 } else { 2e-3 };
                assert!((energy - sum).abs() <= bound * sum.abs(), "{k} {faces:b}: {energy:e} {sum:e}");
            }
        }
    }

    #[test]
    fn where_edges_cross_the_force_is_along_the_cross_product_of_the_edges() {
        let half = DVec3::ONE;
        for k in 0..50 {
            let f = |n: f64| (f64::from(k) * n).fract() - 0.5;
            // over the edge x = z = 1 of the box, along y, from one face to the other
            let along = DVec3::new(1.0 + 0.8 * f(0.618_034), 0.8 * f(0.754_877), -1.0).normalize();
            let middle = DVec3::new(0.999, 0.1 * f(0.569_84), 0.999);
            let (_, force) = integrals(middle - 1.5 * along, along, half, ALL_FACES);
            let normal = along.cross(DVec3::Y).normalize();
            let cosine = force.normalize().dot(normal).abs();
            assert!(cosine > 1.0 - 1e-9, "{k}: {force} against {normal}");
        }
    }

    #[test]
    fn a_stretch_is_one_point_with_its_integrals() {
        for (a, b) in [(0.0_f64, 1.0_f64), (1.0, 0.0), (2.0, 2.0), (0.3e-6, 1.1e-6)] {
            let (weight, place, deviation, depth) = whole(a, b);
            let n = 20_000;
            let sum = |f: fn(f64, f64) -> f64| {
                let t = (0..n).map(|k| (f64::from(k) + 0.5) / f64::from(n));
                t.map(|t| f(t, a + t * (b - a))).sum::<f64>() / f64::from(n)
            };
            let (eighth, seventh) = (sum(|_, d| d.powi(8)), sum(|_, d| d.powi(7)));
            let moment = sum(|t, d| t * d.powi(7));
            let second = sum(|t, d| t * t * d.powi(7)) / seventh;
            assert!(((place * place + deviation * deviation) / second - 1.0).abs() < 1e-6, "{a} {b}");
            assert!((weight * depth.powi(8) / eighth - 1.0).abs() < 1e-6, "{a} {b}");
            assert!((weight * depth.powi(7) / seventh - 1.0).abs() < 1e-6, "{a} {b}");
            assert!((weight * place * depth.powi(7) / moment - 1.0).abs() < 1e-6, "{a} {b}");
        }
    }

    #[test]
    fn a_line_beside_a_box_has_no_nodes() {
        let half = DVec3::ONE;
        for start in [DVec3::new(1.0, -2.0, 0.0), DVec3::new(0.0, -5.0, 0.0), DVec3::new(1.5, -2.0, 0.0)] {
            assert_eq!(integrals(start, DVec3::Y, half, ALL_FACES).0, 0.0, "{start}");
        }
        assert_eq!(clip(DVec3::new(0.5, -2.0, 0.0), DVec3::Y, 9.0, half), Some((1.0, 3.0)));
    }
}
