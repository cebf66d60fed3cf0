//! How far one curve is from another.

use seixo_study::time_mean::mean_of;
use serde::Serialize;

/// What the difference of two curves comes to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Moments that were compared.
    pub points: usize,
    /// Root of the mean square over the time compared, without gaps of one of the two, in the curve's unit.
    pub rms: f64,
    /// The largest, in the curve's unit.
    pub largest: f64,
    /// When that is [s].
    pub at: f64,
    /// Largest less smallest value of the reference over the time compared; 0 if it is constant.
    pub range: f64,
    /// Whether a value between two rows was asked for.
    pub interpolated: bool,
}

/// Times that differ by so much of the time compared are one: rows print fifteen digits or so.
const SAME_TIME: f64 = 1e-12;

impl Difference {
    /// Of `other` from `reference`, each time [s] and value in the order of time: at the times of the reference within `window` [s] and
    /// within those of the other, which is interpolated linearly between its rows. `None` where no two values meet.
    pub fn of(reference: &[[f64; 2]], other: &[[f64; 2]], window: [f64; 2]) -> Option<Self> {
        let mut interpolated = false;
        let mut met: Vec<[f64; 3]> = Vec::new();
        // As rows of the reference, also where there is none: a gap.
        let mut apart: Vec<[f64; 2]> = Vec::new();
        for &[t, value] in reference.iter().filter(|p| p[0] >= window[0] && p[0] <= window[1]) {
            let Some((there, exact)) = at(other, t) else { continue };
            let difference = there - value;
            // A gap of the other between two rows of the reference.
            let from = apart.last().map_or(t, |p| p[0]);
            let mut between =
                other[other.partition_point(|p| p[0] <= from)..].iter().take_while(|p| p[0] < t);
            if between.any(|p| !p[1].is_finite()) {
                apart.push([t, f64::NAN]);
            }
            apart.push([t, difference]);
            if difference.is_finite() {
                interpolated |= !exact;
                met.push([t, value, difference]);
            }
        }
        let largest = met.iter().max_by(|a, b| a[2].abs().total_cmp(&b[2].abs()))?;
        let fold = |f: fn(f64, f64) -> f64, start| met.iter().map(|m| m[1]).fold(start, f);
        Some(Self {
            points: met.len(),
            rms: mean_of(&apart, |difference| difference * difference).sqrt(),
            largest: largest[2].abs(),
            at: largest[0],
            range: fold(f64::max, f64::NEG_INFINITY) - fold(f64::min, f64::INFINITY),
            interpolated,
        })
    }

    /// `value` over the range of the reference; nothing if that is constant.
    pub fn relative(&self, value: f64) -> Option<f64> {
        (self.range > 0.0).then(|| value / self.range)
    }
}

/// The value of a curve at `t` [s], and whether that is a row of it; nothing before its first and after its last.
fn at(curve: &[[f64; 2]], t: f64) -> Option<(f64, bool)> {
    let near = SAME_TIME * t.abs();
    let next = curve.partition_point(|p| p[0] < t - near);
    let after = curve.get(next)?;
    if after[0] <= t + near {
        return Some((after[1], true));
    }
    let before = curve.get(next.checked_sub(1)?)?;
    let part = (t - before[0]) / (after[0] - before[0]);
    Some((before[1] + part * (after[1] - before[1]), false))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    fn sampled(step: f64, count: u32, f: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
        (0..count).map(|k| f64::from(k) * step).map(|t| [t, f(t)]).collect()
    }

    #[test]
    fn a_constant_offset_is_its_own_rms_and_a_peak_has_its_time() {
        let a = sampled(0.1, 11, |t| 3.0 * t);
        let mut b = sampled(0.1, 11, |t| 3.0 * t + 0.5);
        let d = Difference::of(&a, &b, ALL).unwrap();
        assert!((d.rms - 0.5).abs() < 1e-12 && (d.largest - 0.5).abs() < 1e-12 && !d.interpolated, "{d:?}");
        assert!((d.range - 3.0).abs() < 1e-12 && d.points == 11);
        b[7][1] -= 2.0;
        let d = Difference::of(&a, &b, ALL).unwrap();
        assert!((d.largest - 1.5).abs() < 1e-12 && (d.at - 0.7).abs() < 1e-12, "{d:?}");
        let d = Difference::of(&a, &b, [0.0, 0.65]).unwrap();
        assert!((d.largest - 0.5).abs() < 1e-12 && d.points == 7, "{d:?}");
    }

    #[test]
    fn other_times_are_interpolated_and_what_lies_beyond_is_left_out() {
        let a = sampled(0.1, 11, |t| 1.0 - 2.0 * t);
        let b = sampled(0.07, 10, |t| 1.0 - 2.0 * t);
        let d = Difference::of(&a, &b, ALL).unwrap();
        assert!(d.interpolated && d.largest < 1e-12 && d.points == 7, "{d:?}");
        assert!(Difference::of(&a, &sampled(0.1, 3, |t| t).map_times(5.0), ALL).is_none());
        assert!(Difference::of(&a, &[], ALL).is_none() && Difference::of(&[], &a, ALL).is_none());
    }

    #[test]
    fn gaps_are_not_bridged_and_short_steps_weigh_no_more() {
        let a = sampled(0.1, 11, |t| t);
        let mut b = sampled(0.2, 6, |t| t + 1.0);
        b[2][1] = f64::NAN;
        // 0.3 and 0.5 lie beside the row without a value, 0.4 on it.
        assert_eq!(Difference::of(&a, &b, ALL).unwrap().points, 8);
        // Half of the time is off by one; most rows are not.
        let mut fine = sampled(0.01, 100, |_| 0.0);
        fine.extend([[1.0, 0.0], [1.5, 0.0], [2.0, 0.0]]);
        let off: Vec<[f64; 2]> = fine.iter().map(|&[t, _]| [t, f64::from(u8::from(t > 0.995))]).collect();
        let d = Difference::of(&fine, &off, ALL).unwrap();
        assert!((d.rms * d.rms - 0.5).abs() < 0.01, "{d:?}");
        // A gauge that is dry from 0.2 to 0.8: the rows beside the gap count for a step each, and not for half of the gap.
        let a = sampled(0.1, 11, |_| 0.0);
        let b: Vec<[f64; 2]> = a.iter().map(|&[t, _]| [t, if t < 0.25 { 1.0 } else { 2.0 }]).collect();
        let dry = |mut c: Vec<[f64; 2]>| {
            c.iter_mut().filter(|p| p[0] > 0.25 && p[0] < 0.75).for_each(|p| p[1] = f64::NAN);
            c
        };
        for [one, two] in [[dry(a.clone()), b.clone()], [a.clone(), dry(b.clone())]] {
            let d = Difference::of(&one, &two, ALL).unwrap();
            assert!((d.rms - 2.5_f64.sqrt()).abs() < 1e-9, "{d:?}");
        }
        // A gap that lies between two rows of the reference.
        let mut b = vec![[0.0, 0.0], [1.0, 1.0], [1.5, 2.0], [2.0, 2.0], [3.0, 2.0]];
        let rms = |b: &[[f64; 2]]| Difference::of(&sampled(1.0, 4, |_| 0.0), b, ALL).unwrap().rms;
        assert!((rms(&b) - (7.0_f64 / 3.0).sqrt()).abs() < 1e-9);
        b[2][1] = f64::NAN;
        assert!((rms(&b) - 1.5).abs() < 1e-9);
    }

    trait Later {
        fn map_times(self, by: f64) -> Self;
    }
    impl Later for Vec<[f64; 2]> {
        fn map_times(mut self, by: f64) -> Self {
            self.iter_mut().for_each(|p| p[0] += by);
            self
        }
    }
}
