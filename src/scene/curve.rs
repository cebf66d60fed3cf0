//! Smooth curves through the rows of a table.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A vector over time, constant before the first row and after the last. Two rows make a straight line. More make a
/// cubic an interval: the spline of continuous second derivative, its slopes limited so that the curve is monotone
/// wherever the rows are and stands between rows that are equal (Fritsch & Carlson 1980). An extremum lies beyond
/// the rows only where six of them curve alike, as samples of a smooth function do (after Huynh 1993), so that a
/// swing sampled 16 times a period keeps its acceleration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    time: Vec<f64>,
    value: Vec<DVec3>,
    /// Slopes at the rows, 1/s.
    slope: Vec<DVec3>,
}

impl Curve {
    /// The curve through `value`s at `time`s [s], which increase and are as many.
    pub fn new(time: Vec<f64>, value: Vec<DVec3>) -> Self {
        let of = |axis: usize| slopes(&time, &value.iter().map(|v| v[axis]).collect::<Vec<f64>>());
        let [x, y, z] = [of(0), of(1), of(2)];
        let slope = (0..time.len()).map(|k| DVec3::new(x[k], y[k], z[k])).collect();
        Self { time, value, slope }
    }

    /// Times of the rows [s].
    pub fn times(&self) -> &[f64] {
        &self.time
    }

    /// Corners of a box that holds all of it.
    pub fn corners(&self) -> Vec<DVec3> {
        let mut corners = (DVec3::MAX, DVec3::MIN);
        for (k, &value) in self.value.iter().enumerate() {
            // A cubic stays this close to the ends of its interval.
            let before = k.checked_sub(1).map_or(0.0, |j| self.time[k] - self.time[j]);
            let after = self.time.get(k + 1).map_or(0.0, |next| next - self.time[k]);
            let room =
                if self.time.len() > 2 { self.slope[k].abs() * before.max(after) / 3.0 } else { DVec3::ZERO };
            corners = (corners.0.min(value - room), corners.1.max(value + room));
        }
        let of = |k: u32| {
            DVec3::from_array(
                [0, 1, 2].map(|axis| if k & (1 << axis) == 0 { corners.0[axis] } else { corners.1[axis] }),
            )
        };
        (0..8).map(of).collect()
    }

    /// Whether it never changes.
    pub fn is_constant(&self) -> bool {
        self.value.windows(2).all(|w| w[0] == w[1])
    }

    /// The row that ends the interval of `t`; `None` outside of the table.
    fn interval(&self, t: f64) -> Option<usize> {
        let k = self.time.partition_point(|&ti| ti <= t);
        (k > 0 && k < self.time.len()).then_some(k)
    }

    /// Value at time `t` [s].
    pub fn value(&self, t: f64) -> DVec3 {
        let Some(k) = self.interval(t) else {
            let row =
                if self.time.first().is_some_and(|&first| t < first) { 0 } else { self.value.len() - 1 };
            return self.value[row];
        };
        let (from, to) = (self.value[k - 1], self.value[k]);
        let length = self.time[k] - self.time[k - 1];
        let s = (t - self.time[k - 1]) / length;
        if self.time.len() == 2 {
            return from.lerp(to, s);
        }
        let (first, last) = (length * self.slope[k - 1], length * self.slope[k]);
        let rest = 1.0 - s;
        rest * rest * ((1.0 + 2.0 * s) * from + s * first) + s * s * ((1.0 + 2.0 * rest) * to - rest * last)
    }

    /// Derivative just after time `t` [s].
    pub fn rate(&self, t: f64) -> DVec3 {
        let Some(k) = self.interval(t) else { return DVec3::ZERO };
        let length = self.time[k] - self.time[k - 1];
        let s = (t - self.time[k - 1]) / length;
        let rest = 1.0 - s;
        let secant = (self.value[k] - self.value[k - 1]) / length;
        6.0 * s * rest * secant
            + rest * (1.0 - 3.0 * s) * self.slope[k - 1]
            + s * (3.0 * s - 2.0) * self.slope[k]
    }

    /// Largest length of the derivative in the intervals that `from` to `to` [s] meets, or a little more.
    pub fn fastest(&self, from: f64, to: f64) -> f64 {
        let met = (1..self.time.len()).filter(|&k| self.time[k - 1] < to && self.time[k] > from);
        let most = |k: usize| {
            let secant = (self.value[k] - self.value[k - 1]) / (self.time[k] - self.time[k - 1]);
            DVec3::from_array([0, 1, 2].map(|axis| {
                let (first, last) = (self.slope[k - 1][axis], self.slope[k][axis]);
                // the derivative is a parabola with these ends and `middle` between them
                let middle = 3.0 * secant[axis] - first - last;
                let (rise, bend) = (middle - first, first - 2.0 * middle + last);
                let top = -rise / bend;
                let inside = if top > 0.0 && top < 1.0 { first + top * rise } else { 0.0 };
                first.abs().max(last.abs()).max(inside.abs())
            }))
            .length()
        };
        met.map(most).fold(0.0, f64::max)
    }

    /// Derivatives at the first and the last row, before and after which it is at rest; `None` of a straight line or a place.
    pub fn ends(&self) -> Option<[DVec3; 2]> {
        let [first, _, .., last] = &self.slope[..] else { return None };
        Some([*first, *last])
    }

    /// Whether the derivative changes between `t` and `t + dt` [s].
    pub fn bends(&self, t: f64, dt: f64) -> bool {
        let inside = |x: f64| x > t && x < t + dt;
        self.time.len() > 2 || self.time.iter().any(|&x| inside(x))
    }
}

/// Slopes of the curve through `y` at `x`.
fn slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let secant: Vec<f64> = (1..n).map(|k| (y[k] - y[k - 1]) / (x[k] - x[k - 1])).collect();
    if n < 3 {
        return vec![secant.first().copied().unwrap_or(0.0); n];
    }
    // halves of the second derivatives at the rows between
    let bend: Vec<f64> = (1..n - 1).map(|k| (secant[k] - secant[k - 1]) / (x[k + 1] - x[k - 1])).collect();
    // that of an interval: what four rows beside and in it agree on
    let smooth = |interval: usize| {
        let Some(last) = bend.len().checked_sub(4) else { return 0.0 };
        let first = interval.saturating_sub(2).min(last);
        bend[first..first + 4].iter().copied().reduce(least).unwrap_or(0.0)
    };
    let mut slope = spline(x, &secant, &bend);
    for (k, slope) in slope.iter_mut().enumerate() {
        let step = |k: usize| x[k + 1] - x[k];
        let before = k.checked_sub(1).map(|j| (secant[j], secant[j] + smooth(j) * step(j)));
        let after = (k + 1 < n).then(|| (secant[k], secant[k] - smooth(k) * step(k)));
        let both = |of: fn(&(f64, f64)) -> f64| match (&before, &after) {
            (Some(a), Some(b)) => least(of(a), of(b)),
            (one, other) => one.as_ref().or(other.as_ref()).map_or(0.0, of),
        };
        let (flat, bent) = (both(|s| s.0), both(|s| s.1));
        let most = bent.signum() * (3.0 * flat.abs()).max(2.0 * bent.abs());
        // near an extremum that the rows agree on the slope is as uncertain as their bend
        let bends = k.checked_sub(1).map_or(0.0, |j| smooth(j) * step(j));
        let room = if k + 1 < n { 0.5 * least(bends, smooth(k) * step(k)).abs() } else { 0.0 };
        *slope = slope.clamp(most.min(0.0) - room, most.max(0.0) + room);
    }
    slope
}

/// The smaller one; 0 if the signs differ.
fn least(a: f64, b: f64) -> f64 {
    if a * b <= 0.0 {
        0.0
    } else if a.abs() < b.abs() {
        a
    } else {
        b
    }
}

/// Slopes of the cubic spline of continuous second derivative; at its ends those of the cubic (of three rows: the
/// parabola) through the rows there.
fn spline(x: &[f64], secant: &[f64], bend: &[f64]) -> Vec<f64> {
    let n = x.len();
    let end = |[a, b, c, d]: [usize; 4], secant: f64, bends: [f64; 2]| {
        let third = if n > 3 { (bends[1] - bends[0]) / (x[d] - x[a]) } else { 0.0 };
        secant + (x[a] - x[b]) * (bends[0] + (x[a] - x[c]) * third)
    };
    let last = n - 1;
    let first = end([0, 1, 2, 3.min(last)], secant[0], [bend[0], bend[1.min(n - 3)]]);
    let at_end = end(
        [last, last - 1, last - 2, last.saturating_sub(3)],
        secant[last - 1],
        [bend[n - 3], bend[n.saturating_sub(4)]],
    );
    // rows of the tridiagonal system, eliminated from the first on
    let mut slope = vec![first; n];
    let mut upper = vec![0.0; n];
    for k in 1..last {
        let (before, after) = (1.0 / (x[k] - x[k - 1]), 1.0 / (x[k + 1] - x[k]));
        let diagonal = 2.0 * (before + after) - before * upper[k - 1];
        upper[k] = after / diagonal;
        let wanted = 3.0 * (secant[k - 1] * before + secant[k] * after);
        slope[k] = (wanted - before * slope[k - 1]) / diagonal;
    }
    slope[last] = at_end;
    for k in (1..last).rev() {
        slope[k] -= upper[k] * slope[k + 1];
    }
    slope
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(rows: &[(f64, f64)]) -> Curve {
        Curve::new(
            rows.iter().map(|r| r.0).collect(),
            rows.iter().map(|r| DVec3::new(r.1, 0.0, -2.0 * r.1)).collect(),
        )
    }

    #[test]
    fn the_rate_is_continuous_and_the_slope_of_the_value() {
        let curve = table(&[(0.0, 0.0), (0.5, 0.0), (0.7, 0.1), (1.5, 0.4), (1.6, 0.3), (2.0, 0.3)]);
        for k in 0..2000 {
            let t = 1e-3 * f64::from(k) + 3e-4;
            let slope = (curve.value(t + 1e-7) - curve.value(t - 1e-7)) / 2e-7;
            assert!((slope - curve.rate(t)).length() < 1e-6, "{t}: {slope}");
            let jump = (curve.rate(t + 1e-3) - curve.rate(t)).length();
            assert!(jump < 0.2, "{t}: {jump}");
            assert!(curve.rate(t).length() <= curve.fastest(0.0, 2.0) + 1e-12);
        }
        for (t, x) in curve.time.iter().zip(&curve.value) {
            assert!((curve.value(*t) - *x).length() < 1e-15);
        }
        assert_eq!(curve.value(0.3), DVec3::ZERO);
        assert!(curve.value(1.55).x <= 0.4 && curve.value(1.8).x == 0.3);
    }

    #[test]
    fn two_rows_and_rows_on_a_line_move_evenly() {
        let two = table(&[(0.0, 0.0), (3.0, 0.33)]);
        let many = table(&[(0.0, 0.0), (0.4, 0.044), (1.9, 0.209), (3.0, 0.33)]);
        for k in 0..30 {
            let t = 0.1 * f64::from(k);
            assert!((two.value(t) - many.value(t)).length() < 1e-15);
            assert!((many.rate(t) - two.rate(t)).length() < 1e-12);
        }
        assert!((many.fastest(0.0, 1.0) / two.fastest(0.0, 1.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn samples_of_a_swing_keep_its_acceleration() {
        for (samples, most) in [(16.0, 0.04), (20.0, 0.025), (40.0, 0.006)] {
            for phase in [0.0, 0.03, 0.21, 0.337, 0.5, 0.77, 0.95] {
                let turn = std::f64::consts::TAU;
                let rows: Vec<(f64, f64)> = (0..(3.0 * samples) as u32)
                    .map(|k| f64::from(k) / samples)
                    .map(|t| (t, (turn * (t + phase)).sin()))
                    .collect();
                let curve = table(&rows);
                let (mut worst, h) = (0.0_f64, 1e-4);
                for k in 0..10_000 {
                    let t = 0.5 + 2e-4 * f64::from(k);
                    let second = (curve.rate(t + h) - curve.rate(t - h)).x / (2.0 * h);
                    worst = worst.max((second / turn.powi(2)).abs());
                }
                assert!((worst - 1.0).abs() < most, "{samples} {phase}: {worst}");
            }
        }
    }

    #[test]
    fn a_gate_that_rises_stands_and_falls_stays_between_its_rows() {
        for rows in [
            &[(0.0, 0.0), (1.0, 1.0), (2.0, 1.0), (3.0, 0.0)][..],
            &[(0.0, 0.0), (1.0, 0.0), (1.1, 1.0), (2.0, 1.0), (2.3, 0.4), (3.0, 0.4), (4.0, 0.0)],
            &[(0.0, 0.0), (1.0, 1.0), (1.1, 0.0)],
        ] {
            let curve = table(rows);
            for k in 0..=400 {
                let (t, x) = (0.01 * f64::from(k), curve.value(0.01 * f64::from(k)).x);
                let beside = rows.windows(2).find(|w| w[0].0 <= t && t < w[1].0);
                let Some([a, b]) = beside else { continue };
                assert!(x >= a.1.min(b.1) - 1e-12 && x <= a.1.max(b.1) + 1e-12, "{rows:?} at {t}: {x}");
            }
        }
    }
}
