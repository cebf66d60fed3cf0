//! Rules for depth^8 over the parts of lines and rings that lie inside a shape.
//!
//! Along a line the distance from a convex shape has one minimum: the part inside is one stretch, halved there, and once more where
//! it is level and falls off at an end. A shape that is not convex gives its stretches one by one. A ring may enter a shape several
//! times.

/// Nodes and weights of Gauss's rule with five nodes on 0..1, exact to the ninth power.
pub(crate) const GAUSS_5: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_5, 0.239_314_335_249_683_2),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// The same with eight nodes, exact to the fifteenth power; the other half is their mirror image.
const GAUSS_8: [(f64, f64); 4] = [
    (0.019_855_071_751_231_884, 0.050_614_268_145_188_13),
    (0.101_666_761_293_186_63, 0.111_190_517_226_687_24),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_64),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
];

/// Points at which a ring is first looked at: 8th powers of what is linear along a diameter are integrated exactly.
const AROUND: usize = 24;

/// Steps of false position on one side of a place from which it is halved for: the slope of what is all but level, with a kink.
const ONE_SIDED: u32 = 4;

/// Where `f` changes its sign between `a` and `b`: false position with halved ends (Illinois), to round-off. An end at which it is
/// nothing is the place: the end of a line may lie in a face to the last bit.
pub(crate) fn root(mut a: (f64, f64), mut b: (f64, f64), mut f: impl FnMut(f64) -> f64) -> f64 {
    if let Some(end) = [a, b].into_iter().find(|end| end.1 == 0.0) {
        return end.0;
    }
    let (mut side, mut again) = (0, 0);
    for _ in 0..80 {
        let mut x = (a.0 * b.1 - b.0 * a.1) / (b.1 - a.1);
        if again >= ONE_SIDED || !(x > a.0.min(b.0) && x < a.0.max(b.0)) {
            x = 0.5 * (a.0 + b.0);
        }
        if x == a.0 || x == b.0 {
            break;
        }
        let y = f(x);
        if y == 0.0 || (b.0 - a.0).abs() < 1e-15 {
            return x;
        }
        let now = if (y > 0.0) == (b.1 > 0.0) { 1 } else { -1 };
        // once it is halved for, it is to the end
        if again < ONE_SIDED {
            again = if now == side { again + 1 } else { 0 };
        }
        if now == 1 {
            b = (x, y);
            if side == 1 {
                a.1 *= 0.5;
            }
        } else {
            a = (x, y);
            if side == -1 {
                b.1 *= 0.5;
            }
        }
        side = now;
    }
    if a.1.abs() < b.1.abs() { a.0 } else { b.0 }
}

/// Calls `visit` with place and length of the nodes on the stretch of 0..`length` where the convex `distance`
/// (with its slope) is negative.
///
/// Under a face that the line reaches the edges of it is level but for both ends, where that of the next face falls within its depth,
/// blended as far as twice that. These falls, which nodes over all of it would miss or meet by chance, are stretches of their own. What
/// is straight or evenly curved has no such end.
pub(crate) fn along(length: f64, distance: impl Fn(f64) -> (f64, f64), mut visit: impl FnMut(f64, f64)) {
    let (first, last) = (distance(0.0), distance(length));
    let lowest = if first.1 >= 0.0 {
        0.0
    } else if last.1 <= 0.0 {
        length
    } else {
        root((0.0, first.1), (length, last.1), |s| distance(s).1)
    };
    let least = distance(lowest).0;
    if least >= 0.0 {
        return;
    }
    // an end of the part inside, and where its fall begins; where nothing blends it has a kink halfway
    let end = |at: f64, there: (f64, f64)| {
        let (at, (value, slope)) = if there.0 < 0.0 {
            (at, there)
        } else {
            let at = root((lowest, least), (at, there.0), |s| distance(s).0);
            (at, distance(at))
        };
        // on what is level, but for rounding, it may be of any sign and size
        let fall = 2.0 * (value - least) / slope.abs();
        if (0.0..(lowest - at).abs()).contains(&fall) {
            let fall = fall.copysign(lowest - at);
            [at, at + 0.5 * fall, at + fall]
        } else {
            [at, lowest, lowest]
        }
    };
    let ([a, b, c], [f, e, d]) = (end(0.0, first), end(length, last));
    for (from, to) in [(a, b), (b, c), (c, lowest), (lowest, d), (d, e), (e, f)] {
        if to > from {
            for (node, weight) in GAUSS_5 {
                visit(from + node * (to - from), weight * (to - from));
            }
        }
    }
}

/// Calls `visit` with angle and share of the circle of the nodes where `distance` (with its slope over the
/// angle) is negative on a circle.
pub(crate) fn around(distance: impl Fn(f64) -> (f64, f64), mut visit: impl FnMut(f64, f64)) {
    let turn = std::f64::consts::TAU / AROUND as f64;
    let samples: [(f64, f64); AROUND] = std::array::from_fn(|k| distance(k as f64 * turn));
    if samples.iter().all(|s| s.0 < 0.0) {
        (0..AROUND).for_each(|k| visit(k as f64 * turn, 1.0 / AROUND as f64));
        return;
    }
    // stretches inside, in order; those that meet are one, but for where it is deepest: next to an edge the distance has a kink there
    let mut arcs: Vec<(f64, f64)> = vec![];
    let mut deepest: Vec<f64> = vec![];
    for k in 0..AROUND {
        let (here, next) = (samples[k], samples[(k + 1) % AROUND]);
        let (from, to) = (k as f64 * turn, (k + 1) as f64 * turn);
        let mut between = |a: (f64, f64), b: (f64, f64)| {
            let edge = || root(a, b, |t| distance(t).0);
            let arc = match (a.1 < 0.0, b.1 < 0.0) {
                (true, true) => (a.0, b.0),
                (true, false) => (a.0, edge()),
                (false, true) => (edge(), b.0),
                (false, false) => return,
            };
            match arcs.last_mut() {
                Some(last) if last.1 == arc.0 => last.1 = arc.1,
                _ => arcs.push(arc),
            }
        };
        // where it falls and rises again between two samples
        if here.1 < 0.0 && next.1 >= 0.0 {
            let lowest = root((from, here.1), (to, next.1), |t| distance(t).1);
            let low = (lowest, distance(lowest).0);
            deepest.push(lowest);
            between((from, here.0), low);
            between(low, (to, next.0));
        } else {
            between((from, here.0), (to, next.0));
        }
    }
    let halves = arcs.into_iter().flat_map(|(from, to)| {
        let inside = deepest.iter().copied().filter(move |&t| from < t && t < to);
        let ends: Vec<f64> = std::iter::once(from).chain(inside).chain([to]).collect();
        ends.windows(2).map(|w| (w[0], w[1])).collect::<Vec<_>>()
    });
    for (from, to) in halves {
        let pieces = ((to - from) / (4.0 * turn)).ceil().max(2.0);
        let width = (to - from) / pieces;
        for piece in 0..pieces as usize {
            let start = from + width * piece as f64;
            for (node, weight) in GAUSS_8.into_iter().flat_map(|(x, w)| [(x, w), (1.0 - x, w)]) {
                visit(start + node * width, weight * width / std::f64::consts::TAU);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_with_one_dip_is_integrated() {
        for (slope, offset) in [(0.0, -0.3), (1.0, -0.4), (-0.2, 0.1)] {
            let distance = |s: f64| (slope * (s - 1.0) + offset, slope);
            let mut sum = 0.0;
            along(2.0, distance, |s, w| sum += w * (-distance(s).0).powi(8));
            let n = 200_000;
            let plain = (0..n).map(|k| (f64::from(k) + 0.5) * 2.0 / f64::from(n));
            let plain = plain.map(|s| (-distance(s).0).max(0.0).powi(8)).sum::<f64>() * 2.0 / f64::from(n);
            assert!((sum / plain - 1.0).abs() < 1e-7, "{slope}: {sum:e} {plain:e}");
        }
    }

    #[test]
    fn a_line_that_ends_in_the_edges_of_a_face_is_integrated_evenly() {
        let (length, depth) = (0.1, 1e-3);
        // ends beyond the edges, in them to the last bit, and inside; the slope of what is level is that of rounding
        for beyond in [0.01, 0.0, -2e-4] {
            for noise in [0.0, 1e-17, -1e-17, 1e-8] {
                let distance = |s: f64| {
                    let (left, right) = (s - beyond, length - beyond - s);
                    if left.min(right) < depth {
                        (-left.min(right), if left < right { -1.0 } else { 1.0 })
                    } else {
                        (-depth, noise * if s < 0.3 * length { -1.0 } else { 1.0 })
                    }
                };
                let (mut sum, mut aside) = (0.0, 0.0);
                along(length, distance, |s, w| {
                    let (d, slope) = distance(s);
                    sum += w * (-d / depth).powi(8);
                    aside += w * (-d / depth).powi(7) * slope;
                });
                let end = depth / 9.0 * (1.0 - (-beyond.min(0.0) / depth).powi(9));
                let exact = length - 2.0 * beyond.max(0.0) - 2.0 * (depth + beyond.min(0.0)) + 2.0 * end;
                assert!((sum / exact - 1.0).abs() < 1e-3, "{beyond} {noise}: {sum} {exact}");
                assert!(aside.abs() <= 1e-9 * depth + noise.abs() * length, "{beyond} {noise}: {aside}");
            }
        }
    }

    #[test]
    fn the_nodes_of_a_line_that_is_level_but_for_rounding_lie_on_it() {
        let length = 0.1;
        for slope in [0.0, 1e-17, -1e-17, 3e-16] {
            for step in [0.0, 2e-18, -2e-18, 1e-16, -1e-16] {
                // both ends are a bit off what is between, and the slope, which turns once, knows nothing of that
                let distance = |s: f64| {
                    let value = if s == 0.0 || s == length { step } else { 0.0 };
                    (value - 1e-3, if s < 0.3 * length { -slope } else { slope })
                };
                let mut sum = 0.0;
                along(length, distance, |s, w| {
                    assert!((0.0..=length).contains(&s) && w > 0.0, "{slope} {step}: {w} at {s}");
                    sum += w;
                });
                assert!((sum / length - 1.0).abs() < 1e-12, "{slope} {step}: {sum}");
            }
        }
    }

    #[test]
    fn a_ring_is_integrated_however_little_of_it_is_inside_and_wherever_it_is() {
        for depth in [1e-6, 1e-3, 0.1, 0.9, 1.5, 2.5] {
            let mut least = (f64::INFINITY, 0.0_f64);
            for k in 0..50 {
                let place = 0.01 + 0.137 * f64::from(k);
                let distance = |t: f64| (1.0 - (t - place).cos() - depth, (t - place).sin());
                let mut sum = 0.0;
                around(distance, |t, w| sum += w * (-distance(t).0).powi(8));
                least = (least.0.min(sum), least.1.max(sum));
            }
            let half = if depth >= 2.0 { std::f64::consts::PI } else { (1.0_f64 - depth).acos() };
            let n = 200_000;
            let plain = (0..n).map(|k| (f64::from(k) + 0.5) * half / f64::from(n));
            let plain = plain.map(|t| (depth - 1.0 + t.cos()).powi(8)).sum::<f64>() * half
                / f64::from(n)
                / std::f64::consts::PI;
            assert!(least.1 / least.0 - 1.0 < 1e-6, "{depth}: {least:?}");
            assert!((least.0 / plain - 1.0).abs() < 1e-6, "{depth}: {least:?} {plain}");
        }
    }
}
