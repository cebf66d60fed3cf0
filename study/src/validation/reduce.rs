//! A curve as one number: what a measured and a reference curve are compared by.

use crate::time_mean::{deviation, mean};
use seixo::error::Problem;
use serde::Deserialize;
use std::cmp::Ordering;

/// What is taken from a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Take {
    /// Rms distance from the reference curve, at the reference's points.
    #[default]
    Distance,
    /// Mean over the window, over time: short steps weigh no more than long ones. Where the curve has gaps they are left out, here
    /// and of integral and deviation.
    Mean,
    /// Largest value.
    Largest,
    /// Smallest value.
    Smallest,
    /// Largest less smallest.
    Range,
    /// Integral over the window, e.g. an impulse.
    Integral,
    /// Time at which the curve first rises above `level`: one that begins above it has to come back first. Where it does so over a gap,
    /// and with the next two, the end of the gap.
    FirstAbove,
    /// Time at which the curve first falls below `level`, likewise.
    FirstBelow,
    /// Time from when the curve first rises above `level` to when it first rises above `to`; where `to` is less than `level`, from
    /// when it first falls below the one to when it does below the other.
    Passage,
    /// Value at the time `level`; none in a gap.
    At,
    /// Standard deviation over the window.
    Deviation,
    /// Slope of the line through the window, by least squares.
    Slope,
    /// Constant acceleration a of x0 + v0 t + a t^2 / 2 through the window, by least squares.
    Acceleration,
    /// Mean period of the oscillation about the mean.
    Period,
    /// Time by which it lags `behind` another curve: the shift at which the two go together best.
    Lag,
    /// Last amplitude over the first, to the power of one over the periods between: what a period leaves of the
    /// amplitude. Each is half of the way from one turning point to the next, wherever the middle of the oscillation lies.
    Decay,
}

impl Take {
    /// What is wrong with the keys that say how a number is taken, if anything, with the key in their table.
    pub fn fault(
        self,
        [level, to]: [Option<f64>; 2],
        window: Option<[f64; 2]>,
        smooth: f64,
    ) -> Option<Problem> {
        let wrong = |key: &str, what: &str, remedy: &str| Some(Problem::new(key, what, remedy));
        let (levelled, passes) = match self {
            Self::FirstAbove | Self::FirstBelow | Self::At => (true, false),
            Self::Passage => (true, true),
            _ => (false, false),
        };
        if levelled && !level.is_some_and(f64::is_finite) {
            let remedy = "give `level`: the level that is crossed, or the time of `at`";
            return wrong("level", "`take` asks for a `level`", remedy);
        }
        if passes && !to.is_some_and(f64::is_finite) {
            return wrong("to", "`take = \"passage\"` asks for a second level", "give `to`");
        }
        if !(smooth.is_finite() && smooth >= 0.0) {
            return wrong("smooth", "it is a width of time", "use 0 or more, in seconds");
        }
        if window.is_some_and(|[from, to]| from.partial_cmp(&to) != Some(Ordering::Less)) {
            return wrong("window", "it ends before it begins", "give its first time, then its last");
        }
        None
    }
}

/// A curve: time or place against a value. A row whose value is no number is a gap.
pub type Curve = Vec<[f64; 2]>;

/// The part of `curve` in `window`, ends included.
pub fn cut(curve: &[[f64; 2]], window: Option<[f64; 2]>) -> Curve {
    let [from, to] = window.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
    // Sums of time steps miss the ends by rounding errors.
    let slack = 1e-9 * (1.0 + to.abs().min(1e9));
    curve.iter().copied().filter(|p| p[0] >= from - slack && p[0] <= to + slack).collect()
}

/// Rows that have numbers.
pub fn told(curve: &[[f64; 2]]) -> Curve {
    curve.iter().copied().filter(|p| p[1].is_finite()).collect()
}

/// Moving mean over `width`, centred, of the curve as straight lines between its points, within each unbroken stretch; as it is if
/// `width` is 0.
pub fn smooth(curve: &[[f64; 2]], width: f64) -> Curve {
    if width <= 0.0 {
        return curve.to_vec();
    }
    let mut smoothed = Curve::new();
    for stretch in curve.chunk_by(|a, b| a[1].is_finite() && b[1].is_finite()) {
        let integral = integral(stretch);
        let upto = |x: f64| {
            let k = stretch.partition_point(|p| p[0] <= x).saturating_sub(1);
            let end = at(stretch, x).unwrap_or(stretch[k][1]);
            integral[k] + 0.5 * (stretch[k][1] + end) * (x - stretch[k][0])
        };
        let (first, last) = (stretch[0][0], stretch[stretch.len() - 1][0]);
        smoothed.extend(stretch.iter().map(|&[x, y]| {
            let (from, to) = ((x - 0.5 * width).max(first), (x + 0.5 * width).min(last));
            [x, if to > from { (upto(to) - upto(from)) / (to - from) } else { y }]
        }));
    }
    smoothed
}

/// [`smooth`] as `take` looks at it: the largest and the smallest are of the values whose mean is over the whole `width`, which at the ends of
/// a stretch would be over as little as half of it.
pub fn smooth_for(take: Take, curve: &[[f64; 2]], width: f64) -> Curve {
    let mut smoothed = smooth(curve, width);
    if width > 0.0 && matches!(take, Take::Largest | Take::Smallest | Take::Range) {
        let stretches = curve.chunk_by(|a, b| a[1].is_finite() && b[1].is_finite());
        let mut whole = stretches.flat_map(|stretch| {
            let ends = [stretch[0][0], stretch[stretch.len() - 1][0]];
            let slack = 1e-9 * (1.0 + ends[1].abs());
            stretch
                .iter()
                .map(move |p| p[0] - ends[0] >= 0.5 * width - slack && ends[1] - p[0] >= 0.5 * width - slack)
        });
        smoothed.retain(|_| whole.next() == Some(true));
    }
    smoothed
}

/// Integral of a curve from its first point to each of them.
fn integral(curve: &[[f64; 2]]) -> Vec<f64> {
    let mut sum = 0.0;
    let parts = curve.windows(2).map(|w| 0.5 * (w[0][1] + w[1][1]) * (w[1][0] - w[0][0]));
    let sums = parts.map(|part| {
        sum += part;
        sum
    });
    std::iter::once(0.0).chain(sums).collect()
}

/// The curve as numbers are taken from it: its time counted from when it has moved by `since`, if that is asked for, and a moving mean
/// over `width` [`smooth_for`] `take`; with the moment from which time counts. `None` if it never moves so far.
pub fn prepared(take: Take, curve: Curve, since: Option<f64>, width: f64) -> Option<(Curve, f64)> {
    let (curve, origin) = match since {
        Some(by) => since_moved(&curve, by)?,
        None => (curve, 0.0),
    };
    Some((smooth_for(take, &curve, width), origin))
}

/// The curve with its time counted from when it has moved by `distance` from its start, and that moment; `None` if
/// it never does.
pub fn since_moved(curve: &[[f64; 2]], distance: f64) -> Option<(Curve, f64)> {
    let start = curve.iter().find(|p| p[1].is_finite())?[1];
    let moved = curve.iter().position(|p| (p[1] - start).abs() >= distance)?;
    let origin = if moved == 0 {
        curve[0][0]
    } else {
        let (a, b) = (curve[moved - 1], curve[moved]);
        if !a[1].is_finite() {
            return Some((later(curve, b[0]), b[0]));
        }
        let part = (distance - (a[1] - start).abs()) / ((b[1] - start).abs() - (a[1] - start).abs());
        a[0] + part * (b[0] - a[0])
    };
    Some((later(curve, origin), origin))
}

/// The curve with its time counted from `origin`.
fn later(curve: &[[f64; 2]], origin: f64) -> Curve {
    curve.iter().map(|p| [p[0] - origin, p[1]]).collect()
}

/// First x at which the curve crosses `level`, upwards or downwards; over a gap the far end of that, which alone is known. A curve
/// that begins beyond the level has to come back first; one that begins in a gap has not been there.
fn crossing(curve: &[[f64; 2]], level: f64, upwards: bool) -> Option<f64> {
    let beyond = |y: f64| if upwards { y > level } else { y < level };
    let near = (0..curve.len()).find(|&k| !beyond(curve[k][1]) && (k == 0 || curve[k][1].is_finite()))?;
    let far = (near + 1..curve.len()).find(|&k| beyond(curve[k][1]))?;
    let ([x0, y0], [x1, y1]) = (curve[far - 1], curve[far]);
    Some(if y0.is_finite() { x0 + (x1 - x0) * (level - y0) / (y1 - y0) } else { x1 })
}

/// How long the curve takes from where it first crosses `level` on the way `to` another one until it crosses that.
fn passage(curve: &[[f64; 2]], level: f64, to: f64) -> Option<f64> {
    let start = crossing(curve, level, to >= level)?;
    let rest: Curve =
        std::iter::once([start, level]).chain(curve.iter().copied().filter(|p| p[0] >= start)).collect();
    Some(crossing(&rest, to, to >= level)? - start)
}

/// The curve at `x`, linear between its points; `None` outside and in a gap.
pub fn at(curve: &[[f64; 2]], x: f64) -> Option<f64> {
    let k = curve.partition_point(|p| p[0] < x);
    let (before, after) = (k.checked_sub(1).map(|k| curve[k]), curve.get(k).copied());
    // Sums of time steps miss a point by rounding errors.
    let beside = |p: &[f64; 2]| (p[0] - x).abs() < 1e-9 * (1.0 + x.abs()) && p[1].is_finite();
    if let Some(point) = after.filter(beside).or(before.filter(beside)) {
        return Some(point[1]);
    }
    let ([x0, y0], [x1, y1]) = (before?, after?);
    Some(y0 + (y1 - y0) * (x - x0) / (x1 - x0)).filter(|y| y.is_finite())
}

/// Coefficients of the polynomial of `N` terms through `curve`, about its first x, by least squares.
fn fit<const N: usize>(curve: &[[f64; 2]]) -> Option<[f64; N]> {
    if curve.len() < N {
        return None;
    }
    // Scaled, so that the normal equations are well conditioned.
    let (origin, span) = (curve[0][0], curve[curve.len() - 1][0] - curve[0][0]);
    let mut rows = [[0.0; N]; N];
    let mut right = [0.0; N];
    for p in curve {
        let x = (p[0] - origin) / span;
        let powers: [f64; N] = std::array::from_fn(|k| x.powi(k as i32));
        for i in 0..N {
            right[i] += powers[i] * p[1];
            (0..N).for_each(|j| rows[i][j] += powers[i] * powers[j]);
        }
    }
    for k in 0..N {
        for i in k + 1..N {
            let factor = rows[i][k] / rows[k][k];
            (k..N).for_each(|j| rows[i][j] -= factor * rows[k][j]);
            right[i] -= factor * right[k];
        }
    }
    let mut out = [0.0; N];
    for k in (0..N).rev() {
        let known: f64 = (k + 1..N).map(|j| rows[k][j] * out[j]).sum();
        out[k] = (right[k] - known) / rows[k][k];
    }
    let out: [f64; N] = std::array::from_fn(|k| out[k] / span.powi(k as i32));
    out.iter().all(|c| c.is_finite()).then_some(out)
}

/// Part of the range that a curve has to move by before it counts as having done so [-]: less is noise.
const NOISE: f64 = 0.1;

/// Times at which the oscillation about the mean passes it upwards, and the values at which it turns, one of each half swing between passages of
/// either direction. Passages closer than [`NOISE`] are none.
fn oscillation(curve: &[[f64; 2]]) -> (Vec<f64>, Vec<f64>) {
    let middle = mean(curve);
    let noise = NOISE * range(curve);
    let (mut upward, mut turns) = (Vec::new(), Vec::new());
    let (mut side, mut start, mut crossing) = (0.0_f64, 0, None);
    let most = |half: &[[f64; 2]], side: f64| {
        half.iter().map(|p| p[1] * side).fold(f64::NEG_INFINITY, f64::max) * side
    };
    for k in 1..curve.len() {
        let (a, b) = (curve[k - 1][1] - middle, curve[k][1] - middle);
        if a * b <= 0.0 && a != b {
            crossing = Some(curve[k - 1][0] + (curve[k][0] - curve[k - 1][0]) * a / (a - b));
        }
        // A side counts once the curve is well on it.
        if b.abs() > noise && b.signum() != side {
            if side != 0.0 {
                turns.push(most(&curve[start..k], side));
            }
            if let Some(x) = crossing.filter(|_| side != 0.0 && b > 0.0) {
                upward.push(x);
            }
            (side, start) = (b.signum(), if side == 0.0 { 0 } else { k });
        }
    }
    // The window may cut the first and the last half swing before they turn.
    if let (Some(first), Some(turn)) = (curve.first(), turns.first())
        && (turn - first[1]).abs() <= noise
    {
        turns.remove(0);
    }
    if let Some(last) = curve.last().filter(|_| side != 0.0) {
        let turn = most(&curve[start..], side);
        if (turn - last[1]).abs() > noise {
            turns.push(turn);
        }
    }
    (upward, turns)
}

fn range(curve: &[[f64; 2]]) -> f64 {
    let (low, high) =
        curve.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p[1]), b.max(p[1])));
    high - low
}

/// `take` of a curve that is cut and smoothed already, with the levels `level` and `to`; `None` where the curve does
/// not have it.
pub fn reduce(take: Take, curve: &[[f64; 2]], levels: [f64; 2]) -> Option<f64> {
    let ([level, to], marked) = (levels, curve);
    let curve = &told(marked)[..];
    if curve.is_empty() {
        return None;
    }
    let values = || curve.iter().map(|p| p[1]);
    match take {
        Take::Distance | Take::Lag => None,
        Take::Mean => Some(mean(marked)),
        Take::Largest => values().reduce(f64::max),
        Take::Smallest => values().reduce(f64::min),
        Take::Range => Some(range(curve)),
        Take::Integral => {
            let stretches = marked.split(|p| !p[1].is_finite());
            Some(stretches.filter_map(|stretch| integral(stretch).pop()).sum())
        }
        Take::FirstAbove => crossing(marked, level, true),
        Take::FirstBelow => crossing(marked, level, false),
        Take::Passage => passage(marked, level, to),
        Take::At => at(marked, level),
        Take::Deviation => Some(deviation(marked)),
        Take::Slope => fit::<2>(curve).map(|c| c[1]),
        Take::Acceleration => fit::<3>(curve).map(|c| 2.0 * c[2]),
        Take::Period => {
            let (upward, _) = oscillation(curve);
            let periods = upward.len().checked_sub(1).filter(|n| *n > 0)?;
            Some((upward[periods] - upward[0]) / periods as f64)
        }
        Take::Decay => {
            let (_, turns) = oscillation(curve);
            let swings: Vec<f64> = turns.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
            let halves = swings.len().checked_sub(1).filter(|n| *n > 0)?;
            Some((swings[halves] / swings[0]).powf(2.0 / halves as f64))
        }
    }
}

/// [`reduce`] of a profile: mean and deviation are those of its bins, whose ends lie half a bin beyond the first and the last row.
pub fn reduce_bins(take: Take, profile: &[[f64; 2]], levels: [f64; 2]) -> Option<f64> {
    let bins: Curve =
        (0u32..).zip(profile).flat_map(|(k, p)| [0.0, 1.0].map(|end| [f64::from(k) + end, p[1]])).collect();
    match take {
        Take::Mean | Take::Deviation => reduce(take, &bins, levels),
        _ => reduce(take, profile, levels),
    }
}

/// Time by which `curve` lags `behind` another one of about the same samples: the shift from 0 to half of the window's
/// length at which they are best correlated over what they then share; `None` where they do not go together at all.
pub fn lag(curve: &[[f64; 2]], behind: &[[f64; 2]]) -> Option<f64> {
    let (first, last) = (curve.first()?[0], curve.last()?[0]);
    let step = (last - first) / (curve.len().checked_sub(1).filter(|n| *n > 7)?) as f64;
    let correlation = |shift: f64| {
        let pairs = curve.iter().filter_map(|p| at(behind, p[0] - shift).map(|y| [y, p[1]]));
        let pairs: Curve = pairs.filter(|p| p[0].is_finite() && p[1].is_finite()).collect();
        let n = pairs.len() as f64;
        let [a, b] = [0, 1].map(|k| pairs.iter().map(|p| p[k]).sum::<f64>() / n);
        let product = |i: usize, j: usize| -> f64 {
            pairs.iter().map(|p| (p[i] - [a, b][i]) * (p[j] - [a, b][j])).sum()
        };
        product(0, 1) / (product(0, 0) * product(1, 1)).sqrt()
    };
    let seen: Vec<f64> = (0..=curve.len() / 2).map(|k| correlation(step * k as f64)).collect();
    let best =
        (0..seen.len()).filter(|&k| seen[k].is_finite()).max_by(|&a, &b| seen[a].total_cmp(&seen[b]))?;
    // Waves go together again a period later: the first shift that is nearly as good.
    let best = (1..best)
        .find(|&k| seen[k] > 0.97 * seen[best] && seen[k] >= seen[k - 1] && seen[k] >= seen[k + 1])
        .unwrap_or(best);
    let top = match (best.checked_sub(1).map(|k| seen[k]), seen.get(best + 1)) {
        (Some(a), Some(b)) => 0.5 * (a - b) / (a - 2.0 * seen[best] + b),
        _ => 0.0,
    };
    (seen[best] > 0.5).then_some(step * (best as f64 + if top.is_finite() { top } else { 0.0 }))
}

/// Rms distance of `curve` from the points of `reference` that it covers, and how many these are; `None` for fewer
/// than two.
pub fn distance(curve: &[[f64; 2]], reference: &[[f64; 2]]) -> Option<(f64, usize)> {
    let there = reference.iter().filter_map(|r| at(curve, r[0]).map(|y| (y - r[1]).powi(2)));
    let squares: Vec<f64> = there.filter(|square| square.is_finite()).collect();
    let n = squares.len();
    (n > 1).then(|| ((squares.iter().sum::<f64>() / n as f64).sqrt(), n))
}

/// A damped wave, for tests: `periods` of 1 s that each leave `decay` of the amplitude.
#[cfg(test)]
fn wave(periods: f64, decay: f64) -> Curve {
    let n = (periods * 200.0) as usize;
    (0..n)
        .map(|k| k as f64 / 200.0)
        .map(|t| [t, 3.0 + decay.powf(t) * (std::f64::consts::TAU * t + 0.4).sin()])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_passage_is_a_way_from_one_level_to_the_other() {
        // From between the levels up, down again, and then the whole way.
        let curve = [[0.0, 1.5], [1.0, 2.5], [2.0, 0.5], [4.0, 2.5]];
        let passage = |level, to| reduce(Take::Passage, &curve, [level, to]);
        assert_eq!(passage(1.0, 2.0), Some(1.0));
        assert_eq!(passage(2.0, 1.0), Some(0.5));
        assert_eq!(passage(1.0, 3.0), None);
        assert_eq!(reduce(Take::Passage, &curve[..3], [1.0, 2.0]), None);
    }

    #[test]
    fn period_and_decay_of_a_damped_wave() {
        for decay in [1.0, 0.9, 0.7] {
            let curve = wave(6.3, decay);
            let period = reduce(Take::Period, &curve, [0.0; 2]).unwrap();
            assert!((period - 1.0).abs() < 0.01, "{decay}: {period}");
            let found = reduce(Take::Decay, &curve, [0.0; 2]).unwrap();
            assert!((found - decay).abs() < 0.03, "{decay}: {found}");
        }
        assert_eq!(reduce(Take::Period, &[[0.0, 1.0], [1.0, 2.0]], [0.0; 2]), None);
    }

    #[test]
    fn a_sine_keeps_its_amplitude_in_any_window() {
        for phase in [0.0, 0.7, 1.6, 3.0, 4.4] {
            let wave = |decay: f64, periods: f64| -> Curve {
                let t = (0..=(400.0 * periods) as u32).map(|k| f64::from(k) / 400.0);
                t.map(|t| [t, 3.0 + decay.powf(t) * (std::f64::consts::TAU * t + phase).sin()]).collect()
            };
            for periods in [2.1, 2.5, 2.75, 3.0, 3.3, 3.75, 6.1] {
                for decay in [1.0, 0.9, 0.7] {
                    let found = reduce(Take::Decay, &wave(decay, periods), [0.0; 2]).unwrap();
                    let near = if decay == 1.0 { 1e-4 } else { 1e-3 };
                    assert!((found - decay).abs() < near, "{phase} {periods} {decay}: {found}");
                }
            }
            // Two turning points are one way, with nothing to compare it with.
            assert_eq!(reduce(Take::Decay, &wave(1.0, 0.9), [0.0; 2]), None);
        }
    }

    #[test]
    fn a_curve_lags_behind_another_by_the_time_that_a_wave_takes() {
        let sine = |late: f64| -> Curve {
            (0..600).map(|k| f64::from(k) / 100.0).map(|t| [t, (4.0 * (t - late)).sin() + 0.3]).collect()
        };
        let crest = |late: f64| -> Curve {
            let t = (0..600).map(|k| f64::from(k) / 100.0);
            t.map(|t| [t, 0.2 / (3.0 * (t - 2.0 - late)).cosh().powi(2)]).collect()
        };
        for late in [0.123, 0.987, 1.4] {
            let found = lag(&sine(late), &sine(0.0)).unwrap();
            assert!((found - late).abs() < 1e-3, "{late}: {found}");
            let found = lag(&crest(late), &crest(0.0)).unwrap();
            assert!((found - late).abs() < 1e-3, "{late}: {found}");
        }
        assert_eq!(lag(&sine(0.0)[..5], &sine(0.0)), None);
    }

    #[test]
    fn numbers_of_a_parabola() {
        let curve: Curve = (0..=100).map(|k| f64::from(k) / 100.0).map(|t| [t, 1.0 + 2.0 * t * t]).collect();
        let take = |take, level| reduce(take, &curve, [level, 2.0]).unwrap();
        for (found, expected) in [
            (take(Take::Mean, 0.0), 1.0 + 2.0 / 3.0),
            (take(Take::Integral, 0.0), 1.0 + 2.0 / 3.0),
            (take(Take::Largest, 0.0), 3.0),
            (take(Take::Smallest, 0.0), 1.0),
            (take(Take::Range, 0.0), 2.0),
            (take(Take::FirstAbove, 1.5), 0.5),
            (take(Take::Passage, 1.5), 0.5_f64.sqrt() - 0.5),
            (take(Take::At, 0.5), 1.5),
            (take(Take::Slope, 0.0), 2.0),
            (take(Take::Acceleration, 0.0), 4.0),
        ] {
            assert!((found - expected).abs() < 0.01, "{found} for {expected}");
        }
        assert_eq!(reduce(Take::FirstAbove, &curve, [9.0; 2]), None);
        assert_eq!(reduce(Take::FirstBelow, &curve, [2.0; 2]), None, "it begins there and rises");
        assert_eq!(cut(&curve, Some([0.2, 0.4])).len(), 21);
        let (moved, origin) = since_moved(&curve, 0.5).unwrap();
        assert!((origin - 0.5).abs() < 1e-3 && (moved[0][0] + 0.5).abs() < 1e-3);
        assert!(since_moved(&curve, 5.0).is_none());
    }

    #[test]
    fn a_moving_mean_keeps_a_line_and_flattens_noise() {
        let line: Curve = (0..100).map(|k| [f64::from(k), 2.0 * f64::from(k)]).collect();
        let flat = smooth(&line, 6.0);
        assert!((10..90).all(|k| (flat[k][1] - line[k][1]).abs() < 1e-9));
        let noise: Curve = (0..100).map(|k| [f64::from(k), if k % 2 == 0 { 1.0 } else { -1.0 }]).collect();
        assert!(smooth(&noise, 9.0)[10..90].iter().all(|p| p[1].abs() < 0.2));
        assert_eq!(smooth(&noise, 0.0), noise);
    }

    #[test]
    fn the_largest_of_a_moving_mean_is_over_its_whole_width() {
        // A line that falls is largest where the mean would be over half of the width.
        let line: Curve = (0..=10).map(|k| [f64::from(k), -f64::from(k)]).collect();
        let take = |take, curve: &[[f64; 2]]| reduce(take, &smooth_for(take, curve, 4.0), [0.0; 2]);
        let of = |what| take(what, &line).unwrap();
        for (what, expected) in [(Take::Largest, -2.0), (Take::Smallest, -8.0), (Take::Range, 6.0)] {
            assert!((of(what) - expected).abs() < 1e-9, "{what:?}: {}", of(what));
        }
        assert!((of(Take::Mean) + 5.0).abs() < 1e-9, "the ends count in what is not of single values");
        assert_eq!(take(Take::Largest, &line[..4]), None);
        let gap: Curve = line.iter().map(|p| if p[0] == 5.0 { [5.0, f64::NAN] } else { *p }).collect();
        assert!((take(Take::Largest, &gap).unwrap() + 2.0).abs() < 1e-9);
    }

    #[test]
    fn all_bins_of_a_profile_weigh_alike() {
        let speed: Curve = (0..4).map(|k| 0.125 + 0.25 * f64::from(k)).map(|x| [x, x * (1.0 - x)]).collect();
        let take = |take| reduce_bins(take, &speed, [0.0; 2]).unwrap();
        // 0.125 . 0.875 and 0.375 . 0.625, twice each.
        assert!((take(Take::Mean) - 0.171875).abs() < 1e-12);
        assert!((take(Take::Deviation) - 0.0625).abs() < 1e-12);
        assert_eq!(take(Take::Largest), 0.234375);
    }

    #[test]
    fn means_are_over_time_and_leave_gaps_out() {
        // One second at 0, in ten steps, and one at 1, in a hundred.
        let slow = (0..10).map(|k| [0.1 * f64::from(k), 0.0]);
        let curve: Curve = slow.chain((0..=100).map(|k| [1.0 + 0.01 * f64::from(k), 1.0])).collect();
        let take = |curve: &[[f64; 2]], take| reduce(take, curve, [0.0; 2]).unwrap();
        // Half of the step between them is at 1.
        assert!((take(&curve, Take::Mean) - 1.05 / 2.0).abs() < 1e-9);
        assert!((take(&curve, Take::Deviation) - 0.5).abs() < 2e-3);
        assert!((at(&smooth(&curve, 1.0), 1.0).unwrap() - 0.55).abs() < 1e-9);
        let gap = [[0.0, 2.0], [1.0, 2.0], [1.5, f64::NAN], [5.0, 4.0], [6.0, 4.0]];
        let of = |what| take(&gap, what);
        assert_eq!([of(Take::Mean), of(Take::Integral), of(Take::Deviation)], [3.0, 6.0, 1.0]);
        assert_eq!([of(Take::Largest), of(Take::Smallest), of(Take::Range)], [4.0, 2.0, 2.0]);
        let smoothed = smooth(&gap, 9.0);
        assert_eq!(told(&smoothed), told(&gap));
        assert!(smoothed.len() == gap.len() && smoothed[2][1].is_nan());
        assert_eq!(since_moved(&gap, 1.0).unwrap().1, 5.0);
        assert_eq!(distance(&gap, &[[0.5, 2.0], [3.0, 0.0], [5.5, 4.0]]), Some((0.0, 2)));
    }

    #[test]
    fn what_comes_to_pass_over_a_gap_counts_at_its_end() {
        let gap = f64::NAN;
        let curve = [
            [0.0, 2.0],
            [1.0, 2.0],
            [2.0, gap],
            [8.0, gap],
            [9.0, 6.0],
            [10.0, 6.0],
            [11.0, gap],
            [12.0, 1.0],
        ];
        let take = |take, level| reduce(take, &curve, [level, 5.0]);
        assert_eq!([take(Take::FirstAbove, 4.0), take(Take::FirstAbove, 7.0)], [Some(9.0), None]);
        assert_eq!([take(Take::FirstBelow, 1.5), take(Take::Passage, 4.0)], [Some(12.0), Some(0.0)]);
        let back = [[0.0, 6.0], [1.0, gap], [2.0, 6.0]];
        assert_eq!(reduce(Take::FirstAbove, &back, [4.0; 2]), None, "it was there before the gap");
        assert_eq!(
            reduce(Take::FirstAbove, &curve[2..], [1.0; 2]),
            Some(9.0),
            "a window that begins in the gap"
        );
        let (inside, ends) =
            ([1.5, 3.0, 8.0, 8.5].map(|x| take(Take::At, x)), [1.0, 9.0].map(|x| take(Take::At, x)));
        assert_eq!((inside, ends), ([None; 4], [Some(2.0), Some(6.0)]));
    }

    #[test]
    fn a_curve_that_begins_beyond_a_level_crosses_it_once_it_has_come_back() {
        // A fall from 1.9 m, and a swing.
        let fall: Curve =
            (0..=300).map(|k| f64::from(k) / 1000.0).map(|t| [t, 1.9 - 0.5 * 9.81 * t * t]).collect();
        let when = |z: f64| (2.0 * (1.9 - z) / 9.81_f64).sqrt();
        for (take, level, expected) in [
            (Take::FirstAbove, 1.7, None),
            (Take::FirstBelow, 1.95, None),
            (Take::FirstBelow, 1.7, Some(when(1.7))),
            (Take::Passage, 1.7, Some(when(1.5) - when(1.7))),
            (Take::Passage, 1.9, Some(when(1.5))),
            (Take::Passage, 1.95, None),
        ] {
            let found = reduce(take, &fall, [level, 1.5]);
            let near = found.zip(expected).is_some_and(|(a, b)| (a - b).abs() < 1e-4);
            assert!(near || found == expected, "{take:?} {level}: {found:?} for {expected:?}");
        }
        let swing = [[0.0, 1.0], [1.0, -1.0], [2.0, 1.0]];
        assert_eq!(reduce(Take::FirstAbove, &swing, [0.0; 2]), Some(1.5));
    }

    #[test]
    fn distances_count_where_both_are_known() {
        let curve = [[0.0, 0.0], [2.0, 4.0]];
        assert_eq!(distance(&curve, &[[0.5, 1.0], [2.0, 4.0], [9.0, 100.0]]), Some((0.0, 2)));
        assert_eq!(distance(&curve, &[[0.0, 1.0], [1.0, 3.0]]), Some((1.0, 2)));
        assert_eq!(distance(&curve, &[[5.0, 1.0], [1.0, 3.0]]), None);
    }
}
