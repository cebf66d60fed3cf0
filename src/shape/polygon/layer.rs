//! The outline of a section moved inwards.

use super::{Polygon, sides_of};
use glam::DVec2;

/// A layer goes on smoothly where it turns by less [rad].
const SMOOTH: f64 = 0.35;
/// Two stretches of it meet where their ends are so near, over the spacing: what they overshoot by [`TOUCHING`] is less.
const MEETING: f64 = 0.02;
/// A line that comes nearer to the outline than its depth by no more than this part of it still lies in the layer.
const TOUCHING: f64 = 1e-8;
/// Round a notch a layer is looked for in steps of so much, over the spacing.
const STEP: f64 = 0.05;

/// A stretch of a layer: a line through points, and its directions at both ends.
pub(super) struct Stretch {
    points: Vec<DVec2>,
    ways: [DVec2; 2],
}

impl Polygon {
    /// The layer at `depth` [m]: stretches between its corners.
    pub(super) fn layer(&self, depth: f64, spacing: f64) -> Vec<Stretch> {
        let mut out = vec![];
        let n = self.corners.len();
        for k in 0..n {
            let [a, b, next] = [0, 1, 2].map(|j| self.corners[(k + j) % n]);
            let way = (b - a).normalize();
            self.straight(k, depth, &mut out);
            let turn = way.angle_to(next - b);
            if turn < 0.0 {
                // Round a notch.
                let arc = |s: f64| {
                    let way = DVec2::from_angle(-s / depth).rotate(way);
                    (b + depth * way.perp(), way)
                };
                self.round(depth, STEP * spacing, -turn * depth, &arc, &mut out);
            }
        }
        joined(out, spacing)
    }

    /// What of side `k`, moved inwards by `depth` [m], is nowhere nearer to the outline. Of a straight line each other side takes one stretch away,
    /// however short the sides are.
    fn straight(&self, k: usize, depth: f64, out: &mut Vec<Stretch>) {
        let [a, b] = [0, 1].map(|j| self.corners[(k + j) % self.corners.len()]);
        let (way, length) = ((b - a).normalize(), a.distance(b));
        let start = a + depth * way.perp();
        let others = sides_of(&self.corners).enumerate().filter(|(j, _)| *j != k).map(|(_, side)| side);
        let mut taken: Vec<[f64; 2]> =
            others.filter_map(|side| near_side(start, way, side, depth * (1.0 - TOUCHING))).collect();
        taken.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut from = 0.0;
        for [first, last] in taken.into_iter().chain([[length; 2]]) {
            let to = first.min(length);
            if to > from {
                out.push(Stretch { points: vec![start + from * way, start + to * way], ways: [way; 2] });
            }
            from = last.max(from);
        }
    }

    /// What of an arc, which `at` describes by place and direction over its `length` [m], is nowhere nearer to the outline than `depth` [m].
    fn round(
        &self,
        depth: f64,
        step: f64,
        length: f64,
        at: &dyn Fn(f64) -> (DVec2, DVec2),
        out: &mut Vec<Stretch>,
    ) {
        let held = |s: f64| self.depth_at(at(s).0) > depth * (1.0 - TOUCHING);
        let steps = (length / step).ceil().max(1.0) as usize;
        let place = |k: usize| length * k as f64 / steps as f64;
        // Where between a place that is held and one that is not it ends.
        let end = |mut inside: f64, mut beyond: f64| {
            for _ in 0..40 {
                let middle = 0.5 * (inside + beyond);
                *(if held(middle) { &mut inside } else { &mut beyond }) = middle;
            }
            inside
        };
        let on: Vec<bool> = (0..=steps).map(|k| held(place(k))).collect();
        let mut k = 0;
        while k <= steps {
            if !on[k] {
                k += 1;
                continue;
            }
            let first = k;
            while k < steps && on[k + 1] {
                k += 1;
            }
            let from = if first == 0 { 0.0 } else { end(place(first), place(first - 1)) };
            let to = if k == steps { length } else { end(place(k), place(k + 1)) };
            let inner = (first..=k).map(place).filter(|&s| s > from && s < to);
            let places: Vec<f64> = [from].into_iter().chain(inner).chain([to]).collect();
            let points = places.iter().map(|&s| at(s).0).collect();
            out.push(Stretch { points, ways: [at(from).1, at(to).1] });
            k += 1;
        }
    }
}

/// Where along the line from `start` the side from `c` to `d` is nearer than `reach` [m]: one stretch, for what is so near to a side is convex.
fn near_side(start: DVec2, way: DVec2, [c, d]: [DVec2; 2], reach: f64) -> Option<[f64; 2]> {
    let near_end = |end: DVec2| {
        let off = end - start;
        let middle = off.dot(way);
        let half = (reach * reach - off.perp_dot(way).powi(2)).max(0.0).sqrt();
        (half > 0.0).then_some([middle - half, middle + half])
    };
    let side = (d - c).normalize();
    let (along, across) = ((start - c).dot(side), side.perp_dot(start - c));
    // Between the lines across the side at its ends, and between those along it.
    let bounds = [(along, way.dot(side), 0.0, c.distance(d)), (across, side.perp_dot(way), -reach, reach)];
    let between = bounds.into_iter().try_fold(
        [f64::NEG_INFINITY, f64::INFINITY],
        |[low, high], (at, slope, from, to)| {
            let ends = [(from - at) / slope, (to - at) / slope];
            if slope == 0.0 {
                return (at > from && at < to).then_some([low, high]);
            }
            let [low, high] = [low.max(ends[0].min(ends[1])), high.min(ends[0].max(ends[1]))];
            (low < high).then_some([low, high])
        },
    );
    let all = [near_end(c), near_end(d), between].into_iter().flatten();
    all.reduce(|one, other| [one[0].min(other[0]), one[1].max(other[1])])
}

/// Joins stretches that go on smoothly, the last with the first as well.
fn joined(stretches: Vec<Stretch>, spacing: f64) -> Vec<Stretch> {
    let goes_on = |one: &Stretch, next: &Stretch| {
        let gap = one.points.last().zip(next.points.first()).map_or(f64::INFINITY, |(a, b)| a.distance(*b));
        gap < MEETING * spacing && one.ways[1].angle_to(next.ways[0]).abs() < SMOOTH
    };
    let mut out: Vec<Stretch> = vec![];
    for next in stretches {
        match out.last_mut() {
            Some(last) if goes_on(last, &next) => {
                last.points.extend_from_slice(&next.points);
                last.ways[1] = next.ways[1];
            }
            _ => out.push(next),
        }
    }
    if out.len() > 1
        && goes_on(&out[out.len() - 1], &out[0])
        && let Some(last) = out.pop()
    {
        out[0].points.splice(0..0, last.points);
        out[0].ways[0] = last.ways[0];
    }
    out
}

impl Stretch {
    /// Length [m].
    pub(super) fn length(&self) -> f64 {
        self.points.windows(2).map(|p| p[0].distance(p[1])).sum()
    }

    /// Places about `spacing` [m] apart along it, its ends among them.
    pub(super) fn divided(&self, spacing: f64) -> Vec<DVec2> {
        let length = self.length();
        let count = (length / spacing).round().max(1.0);
        let mut out = vec![self.points[0]];
        let mut gone = 0.0;
        for p in self.points.windows(2) {
            let step = p[0].distance(p[1]);
            while out.len() as f64 * length / count <= gone + step && (out.len() as f64) < count {
                let share = (out.len() as f64 * length / count - gone) / step;
                out.push(p[0].lerp(p[1], share));
            }
            gone += step;
        }
        out.extend(self.points.last());
        out
    }
}
