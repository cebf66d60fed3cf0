//! Runs that differ in their start alone, taken together: mean and spread of what each check found.

use super::check::Check;
use super::{Validation, error_name};
use crate::row::{Class, Row};

/// Runs of one setting.
pub struct Group<'a> {
    /// Line of the charts that it belongs to.
    pub method: &'a str,
    /// What is varied, without case and start, in words.
    pub setting: String,
    /// The runs.
    pub rows: Vec<&'a Row>,
}

/// A number with its spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Standard deviation of a single run; 0 of a single one.
    pub deviation: f64,
    /// How many runs have it.
    pub count: usize,
    /// Out of how many.
    pub runs: usize,
}

impl Spread {
    /// Of `values`, one a run, where there are any; `None` without a single one.
    pub fn of(values: impl Iterator<Item = Option<f64>>) -> Option<Self> {
        let runs: Vec<Option<f64>> = values.collect();
        let values: Vec<f64> = runs.iter().flatten().copied().collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        let deviation = (squares / (n - 1.0).max(1.0)).sqrt();
        (n > 0.0).then_some(Self { mean, deviation, count: values.len(), runs: runs.len() })
    }

    /// Whether every run has it.
    pub fn whole(&self) -> bool {
        self.count == self.runs
    }

    /// How many runs have it, in words: `3`, or `1 of 3`.
    pub fn told(&self) -> String {
        if self.whole() { self.count.to_string() } else { format!("{} of {}", self.count, self.runs) }
    }
}

impl<'a> Group<'a> {
    /// The groups of `validation` among `rows`, in the order of its points.
    pub fn of(validation: &Validation, rows: &'a [Row]) -> Vec<Self> {
        let mut groups: Vec<Self> = Vec::new();
        for row in rows.iter().filter(|r| validation.points.contains(&r.index)) {
            let varied = row.parameters.iter().filter(|(k, _)| *k != "case" && *k != "run");
            // The method stands in a column of its own.
            let varied = varied.filter(|(_, v)| row.method != **v);
            let setting = varied.map(|(k, v)| format!("{k} {v}")).collect::<Vec<_>>().join(", ");
            match groups.iter_mut().find(|g| g.method == row.method && g.setting == setting) {
                Some(group) => group.rows.push(row),
                None => groups.push(Self { method: &row.method, setting, rows: vec![row] }),
            }
        }
        groups
    }

    /// A value of its runs; one that failed has none.
    fn value(&self, name: &str) -> Option<Spread> {
        Spread::of(self.rows.iter().map(|r| r.measured.value(name)))
    }

    /// Whether `check` is for its runs.
    pub fn takes(&self, check: &Check) -> bool {
        self.rows.iter().all(|r| check.applies(&r.parameters))
    }

    /// The number that `check` took.
    pub fn result(&self, check: &str) -> Option<Spread> {
        self.value(check)
    }

    /// The error that `check` found, of each run by itself.
    pub fn error(&self, check: &str) -> Option<Spread> {
        self.value(&error_name(check))
    }

    /// Wall-clock time of a run [s].
    pub fn seconds(&self) -> Option<f64> {
        Spread::of(self.rows.iter().map(|r| r.measured.timing.map(|t| t.median_s))).map(|s| s.mean)
    }

    /// Particles of all kinds.
    pub fn particles(&self) -> u64 {
        self.rows.iter().map(|r| r.measured.work.particles).max().unwrap_or(0)
    }

    /// Steps of a run.
    pub fn steps(&self) -> u64 {
        self.rows.iter().map(|r| r.measured.work.steps).sum::<u64>() / self.rows.len().max(1) as u64
    }

    /// Why runs have nothing to show, or are to be taken with care.
    pub fn remarks(&self) -> Vec<&'a str> {
        let wrong = self.rows.iter().filter(|r| r.measured.class != Class::Ok);
        let mut remarks: Vec<&str> = wrong.map(|r| r.measured.reason.as_str()).collect();
        remarks.dedup();
        remarks
    }
}

#[cfg(test)]
mod tests {
    use super::Spread;

    #[test]
    fn mean_and_deviation() {
        let spread = Spread::of([Some(1.0), None, Some(2.0), Some(3.0)].into_iter()).unwrap();
        assert_eq!(spread, Spread { mean: 2.0, deviation: 1.0, count: 3, runs: 4 });
        assert!(!spread.whole() && Spread::of([Some(5.0)].into_iter()).unwrap().whole());
        assert_eq!(Spread::of([Some(5.0)].into_iter()).unwrap().deviation, 0.0);
        assert!(Spread::of([None, None].into_iter()).is_none());
    }
}
