//! Edges of boxes in contact: weight along a line, integrated instead of sampled.
//!
//! Two edges that cross have no surface points near the crossing unless they are half a spacing deep, and
//! an edge that slides over points is bumpy. So an edge carries its weight along its whole length, and
//! its part of the pair's effective depth is the integral of weight times depth^8 over the stretch inside
//! the other box. It is a continuous function of the poses, whether the edge turns parallel to the other's
//! or leaves at its end, and does not change as an edge slides along itself: where two edges cross, the
//! force is along the cross product of their directions without being told.
//!
//! The depth is linear between the points where another face becomes the nearest, or joins the
//! blending near an edge; five Gauss nodes on each such stretch are exact for depth^8 where one face is
//! nearest, and good to 1e-4 where several are blended.

use super::geometry::{self, Faces, Inside};
use glam::DVec3;

/// An edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// One end [m]; body's frame, world for walls.
    pub start: DVec3,
    /// Unit direction.
    pub along: DVec3,
    /// Length [m].
    pub length: f64,
    /// Weight per length [1/m]; 0 for walls, whose edges get that of the body they touch.
    pub density: f64,
}

/// Nodes and weights of Gauss's rule on 0..1.
const NODES: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_5, 0.239_314_335_249_683_2),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// Part of a line, `start` + s `along` with s in 0..`length`, inside the box: range of s.
pub(crate) fn clip(start: DVec3, along: DVec3, length: f64, half: DVec3) -> Option<(f64, f64)> {
    let (mut low, mut high) = (0.0_f64, length);
    for k in 0..3 {
        let (first, second) = ((-half[k] - start[k]) / along[k], (half[k] - start[k]) / along[k]);
        low = low.max(first.min(second));
        high = high.min(first.max(second));
    }
    (low < high).then_some((low, high))
}

/// Calls `visit` with s, the length that the node stands for [m] and its depth for every node of a line
/// inside a box; arguments in the frame of the box.
pub(crate) fn nodes(
    start: DVec3,
    along: DVec3,
    length: f64,
    half: DVec3,
    faces: Faces,
    mut visit: impl FnMut(f64, f64, Inside),
) {
    let Some((low, high)) = clip(start, along, length, half) else { return };
    // distance below each face at both ends
    let mut below = [(0.0_f64, 0.0_f64); 6];
    let mut count = 0;
    let mut deepest = f64::INFINITY;
    for face in (0..6_u8).filter(|face| faces & (1 << face) != 0) {
        let (axis, sign) = (usize::from(face / 2), if face % 2 == 1 { 1.0 } else { -1.0 });
        let at = |s: f64| half[axis] - sign * (start[axis] + s * along[axis]);
        below[count] = (at(low), at(high));
        deepest = deepest.min(below[count].0.max(below[count].1));
        count += 1;
    }
    let mut near = [(0.0_f64, 0.0_f64); 6];
    let mut kept = 0;
    for b in &below[..count] {
        // a face further than twice the depth has no part in it
        if b.0.min(b.1) < 2.0 * deepest {
            near[kept] = *b;
            kept += 1;
        }
    }
    let mut breaks = [0.0_f64; 47];
    let mut ends = 1;
    for i in 1..kept {
        for j in 0..i {
            for ratio in [0.5, 1.0, 2.0] {
                let first = near[i].0 - ratio * near[j].0;
                let second = near[i].1 - ratio * near[j].1;
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
        let width = (piece[1] - piece[0]) * (high - low);
        if width <= 0.0 {
            continue;
        }
        for (node, weight) in NODES {
            let s = low + (piece[0] + node * (piece[1] - piece[0])) * (high - low);
            if let Some(inside) = geometry::depth(start + s * along, half, faces) {
                visit(s, weight * width, inside);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::geometry::ALL_FACES;
    use super::*;

    /// Integral of depth^8 over the line and of depth^7 times the outward vector.
    fn integrals(start: DVec3, along: DVec3, half: DVec3, faces: Faces) -> (f64, DVec3) {
        let mut sums = (0.0, DVec3::ZERO);
        nodes(start, along, 3.0, half, faces, |_, width, inside| {
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
                let depths = points.filter_map(|q| geometry::depth(q, half, faces));
                let sum: f64 = depths.map(|d| d.depth.powi(8)).sum::<f64>() * 3.0 / f64::from(n);
                // a hidden face cuts the line where it is deep, so that the points are off by one there
                let bound = if faces == ALL_FACES { 1e-4 } else { 2e-3 };
                assert!((energy / sum - 1.0).abs() < bound, "{k} {faces:b}: {energy:e} {sum:e}");
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
    fn a_line_beside_a_box_has_no_nodes() {
        let half = DVec3::ONE;
        for start in [DVec3::new(1.0, -2.0, 0.0), DVec3::new(0.0, -5.0, 0.0), DVec3::new(1.5, -2.0, 0.0)] {
            assert_eq!(integrals(start, DVec3::Y, half, ALL_FACES).0, 0.0, "{start}");
        }
        assert_eq!(clip(DVec3::new(0.5, -2.0, 0.0), DVec3::Y, 9.0, half), Some((1.0, 3.0)));
    }
}
