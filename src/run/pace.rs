//! How long a run will still take.

use std::time::Duration;

/// Part of the time so far that counts as of late.
const LATE: f64 = 0.4;
/// Growth of the time between two marks.
const GROWTH: f64 = 1.05;
/// Part that the pace of the whole way has in the estimate.
const WHOLE: f64 = 0.25;

/// The pace of a run since its process began: a quarter that of the whole way, three quarters that of late. Steps get
/// dearer and shorter as water spreads, but not for good.
#[derive(Debug, Default)]
pub(super) struct Pace {
    /// Time by the clock [s] and part of the run that was done, from the start of the process on.
    marks: Vec<[f64; 2]>,
}

impl Pace {
    /// The part `done` of the run was reached after `wall` by the process's clock; the time to the end.
    pub fn remaining(&mut self, wall: Duration, done: f64) -> Duration {
        let now = wall.as_secs_f64();
        let Some(&[_, first]) = self.marks.first() else {
            self.marks.push([now, done]);
            return Duration::MAX;
        };
        if self.marks.last().is_some_and(|&[t, _]| now > GROWTH * t) {
            self.marks.push([now, done]);
        }
        let late = self.marks.partition_point(|&[t, _]| t <= (1.0 - LATE) * now);
        let [then, had] = self.marks[late.saturating_sub(1)];
        let rates = [(done - first) / now, (done - had) / (now - then)];
        let known = rates.into_iter().zip([WHOLE, 1.0 - WHOLE]).filter(|(r, _)| r.is_finite() && *r > 0.0);
        let (sum, parts) = known.fold((0.0, 0.0), |(s, n), (r, part)| (s + part * r, n + part));
        Duration::try_from_secs_f64((1.0 - done) * parts / sum).unwrap_or(Duration::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::Pace;
    use std::time::Duration;

    /// The remaining time told on the way, over what it really was; the run takes `cost(done)` for each part of it.
    fn told(start: f64, cost: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let (mut pace, mut clock, mut told) = (Pace::default(), 0.0, Vec::new());
        let steps = 10_000;
        for k in 1..=steps {
            let done = start + (1.0 - start) * f64::from(k) / f64::from(steps);
            clock += cost(done);
            told.push((done, clock, pace.remaining(Duration::from_secs_f64(clock), done).as_secs_f64()));
        }
        let end = clock;
        told.into_iter().map(|(done, at, left)| (done, (at + left) / end)).collect()
    }

    #[test]
    fn the_end_is_told_within_15_percent_from_a_quarter_on() {
        // Even, resumed in the middle, steps that get dearer by a half in the first fifth, dear at the start.
        let late = |at: f64, told: Vec<(f64, f64)>| {
            let late = told.into_iter().filter(|(done, _)| *done > at && *done < 0.999);
            late.map(|(_, end)| (end - 1.0).abs()).fold(0.0, f64::max)
        };
        assert!(late(0.01, told(0.0, |_| 1e-3)) < 0.01);
        assert!(late(0.51, told(0.5, |_| 1e-3)) < 0.02);
        assert!(late(0.25, told(0.0, |d| if d < 0.2 { 1e-3 } else { 1.5e-3 })) < 0.15);
        assert!(late(0.25, told(0.0, |d| if d < 0.05 { 2e-3 } else { 1e-3 })) < 0.15);
    }
}
