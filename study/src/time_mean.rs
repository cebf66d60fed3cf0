//! Means over time of what is sampled at uneven moments, as where time steps adapt: the trapezoidal rule over each unbroken
//! stretch, so that many short steps weigh no more than one long one.

use seixo::checkpoint::Archive;
use seixo::error::Result;

/// Weight of each row in a mean over time [s]: half of the time to its neighbours in the same unbroken stretch. A row whose value
/// is no number is a gap, which is not bridged, and has no weight itself. Rows that all stand alone weigh the same.
pub fn weights(curve: &[[f64; 2]]) -> Vec<f64> {
    let told = |k: usize| curve[k][1].is_finite();
    let half = |k: usize| if told(k) && told(k + 1) { 0.5 * (curve[k + 1][0] - curve[k][0]) } else { 0.0 };
    let last = curve.len().saturating_sub(1);
    let of = |k: usize| {
        let (before, after) = ((k > 0).then(|| half(k - 1)), (k < last).then(|| half(k)));
        before.unwrap_or(0.0) + after.unwrap_or(0.0)
    };
    let weights: Vec<f64> = (0..curve.len()).map(of).collect();
    if weights.iter().any(|w| *w > 0.0) {
        return weights;
    }
    (0..curve.len()).map(|k| f64::from(u8::from(told(k)))).collect()
}

/// Mean over time of `of` the values of a curve; not a number without any.
pub fn mean_of(curve: &[[f64; 2]], of: impl Fn(f64) -> f64) -> f64 {
    let weights = weights(curve);
    let weighted = weights.iter().zip(curve).filter(|(w, _)| **w > 0.0);
    weighted.map(|(w, p)| w * of(p[1])).sum::<f64>() / weights.iter().sum::<f64>()
}

/// Mean over time of a curve; not a number without any value.
pub fn mean(curve: &[[f64; 2]]) -> f64 {
    mean_of(curve, |value| value)
}

/// Standard deviation over time of a curve.
pub fn deviation(curve: &[[f64; 2]]) -> f64 {
    let middle = mean(curve);
    mean_of(curve, |value| (value - middle).powi(2)).sqrt()
}

/// Means over time of several quantities, of which no more than the last sample is kept.
#[derive(Clone, Debug, Default)]
pub struct TimeMean {
    /// Moment of the last sample [s].
    at: f64,
    /// Time from the first to the last [s].
    span: f64,
    last: Vec<f64>,
    sums: Vec<f64>,
}

impl TimeMean {
    /// Adds a sample at the time `t` [s], as many values as in all others.
    pub fn add(&mut self, t: f64, values: Vec<f64>) {
        if self.last.is_empty() {
            self.sums = vec![0.0; values.len()];
        } else {
            let step = t - self.at;
            let both = self.last.iter().zip(&values).map(|(a, b)| 0.5 * step * (a + b));
            self.sums.iter_mut().zip(both).for_each(|(sum, part)| *sum += part);
            self.span += step;
        }
        (self.at, self.last) = (t, values);
    }

    /// The mean of value `k`; not a number without a sample.
    pub fn mean(&self, k: usize) -> f64 {
        let values = if self.span > 0.0 { &self.sums } else { &self.last };
        let value = values.get(k).copied().unwrap_or(f64::NAN);
        if self.span > 0.0 { value / self.span } else { value }
    }

    /// Save it as `name`, or take it over.
    ///
    /// # Errors
    /// [`seixo::error::Error::Checkpoint`] if the state has none.
    pub fn exchange(&mut self, name: &str, archive: &mut Archive) -> Result<()> {
        let Self { at, span, last, sums } = self;
        archive.number(&format!("{name}.at"), at)?;
        archive.number(&format!("{name}.span"), span)?;
        archive.array(&format!("{name}.last"), last, false)?;
        archive.array(&format!("{name}.sums"), sums, false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One second at 0, in a single step, and one at 1, in a hundred.
    fn uneven() -> Vec<[f64; 2]> {
        let fine = (0..=100).map(|k| [1.0 + 1e-9 + 0.01 * f64::from(k), 1.0]);
        [[0.0, 0.0], [1.0, 0.0]].into_iter().chain(fine).collect()
    }

    #[test]
    fn short_steps_weigh_no_more_than_long_ones() {
        let curve = uneven();
        assert!((mean(&curve) - 0.5).abs() < 1e-6 && (deviation(&curve) - 0.5).abs() < 1e-6);
        let mut online = TimeMean::default();
        assert!(online.mean(0).is_nan());
        for &[t, value] in &curve {
            online.add(t, vec![7.0, value]);
        }
        assert!((online.mean(1) - 0.5).abs() < 1e-6 && (online.mean(0) - 7.0).abs() < 1e-12);
    }

    #[test]
    fn gaps_are_not_bridged() {
        let gap = [[0.0, 1.0], [1.0, 1.0], [2.0, f64::NAN], [9.0, 5.0], [10.0, 5.0]];
        assert_eq!(weights(&gap), [0.5, 0.5, 0.0, 0.5, 0.5]);
        assert_eq!(mean(&gap), 3.0);
        assert_eq!(mean(&[[0.0, 1.0], [1.0, f64::NAN], [2.0, 3.0]]), 2.0);
        assert_eq!(mean(&[[4.0, 3.0]]), 3.0);
        assert!(mean(&[]).is_nan());
    }
}
