//! How long a run will still take.

use std::time::Duration;

/// Part of the time so far that counts as of late.
const LATE: f64 = 0.4;
/// Growth of the time between two marks.
const GROWTH: f64 = 1.05;
/// Part that the pace of the whole way has in the estimate.
const WHOLE: f64 = 0.25;

/// The pace of a run since its process began: a quarter that of the whole way, three quarters that of late. Steps get
/// dearer and shorter as water spreads, but not for good; they get dearer with the water that comes in, for as long
/// as more comes in than goes out.
#[derive(Debug, Default)]
pub(super) struct Pace {
    /// From the start of the process on.
    marks: Vec<Mark>,
    last: Mark,
}

/// A moment of a run.
#[derive(Clone, Copy, Debug, Default)]
struct Mark {
    /// Time by the process's clock [s].
    clock: f64,
    /// Part of the run that is done.
    done: f64,
    /// Particles of water that there are.
    water: f64,
    /// Sum of these over the part that is done.
    work: f64,
}

impl Pace {
    /// The part `done` of the run was reached after `wall` by the process's clock, with so many particles of `water`;
    /// the time to the end.
    pub fn remaining(&mut self, wall: Duration, done: f64, water: u64) -> Duration {
        // Scenes without water go by their own measure.
        let water = (water as f64).max(1.0);
        let work = self.last.work + water * (done - self.last.done);
        let now = Mark { clock: wall.as_secs_f64(), done, water, work };
        self.last = now;
        let Some(&first) = self.marks.first() else {
            self.marks.push(now);
            return Duration::MAX;
        };
        if self.marks.last().is_some_and(|mark| now.clock > GROWTH * mark.clock) {
            self.marks.push(now);
        }
        let late = self.marks.partition_point(|mark| mark.clock <= (1.0 - LATE) * now.clock);
        let then = self.marks[late.saturating_sub(1)];
        let growth = ((water - then.water) / (done - then.done)).max(0.0);
        let growth = if growth.is_finite() { growth } else { 0.0 };
        let left = water * (1.0 - done) + 0.5 * growth * (1.0 - done).powi(2);
        let rates = [(work - first.work) / now.clock, (work - then.work) / (now.clock - then.clock)];
        let known = rates.into_iter().zip([WHOLE, 1.0 - WHOLE]).filter(|(r, _)| r.is_finite() && *r > 0.0);
        let (sum, parts) = known.fold((0.0, 0.0), |(s, n), (r, part)| (s + part * r, n + part));
        Duration::try_from_secs_f64(left * parts / sum).unwrap_or(Duration::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::Pace;
    use std::time::Duration;

    /// The end told on the way over what it really was; the run takes `cost(done)` for each part of it.
    fn told(start: f64, cost: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        told_with(start, cost, |_| 1000.0)
    }

    /// The same with so much `water` that there is.
    fn told_with(start: f64, cost: impl Fn(f64) -> f64, water: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let (mut pace, mut clock, mut told) = (Pace::default(), 0.0, Vec::new());
        let steps = 10_000;
        for k in 1..=steps {
            let done = start + (1.0 - start) * f64::from(k) / f64::from(steps);
            clock += cost(done);
            told.push((
                done,
                clock,
                pace.remaining(Duration::from_secs_f64(clock), done, water(done) as u64).as_secs_f64(),
            ));
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
        // A tank that is filled to five times its water, and one that overflows from the middle of the run on; dry.
        let filled = |d: f64| 1000.0 * (1.0 + 4.0 * d);
        assert!(late(0.25, told_with(0.0, |d| 1e-6 * filled(d), filled)) < 0.05);
        let full = |d: f64| filled(d.min(0.5));
        assert!(late(0.6, told_with(0.0, |d| 1e-6 * full(d), full)) < 0.15);
        assert!(late(0.25, told_with(0.0, |_| 1e-3, |_| 0.0)) < 0.01);
    }
}
