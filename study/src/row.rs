//! A point of a study: what was asked, how it ended, what was measured.

use seixo::error::Error;
use seixo::output::result::{Grade, Verdict};
use seixo::output::slice::per_metre;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

/// Version of the files of finished points. A change of meaning of any measure raises it, so that older points
/// are computed again.
pub const FORMAT: u32 = 5;

/// How a point ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// It reached its end, its verdict is fine and no measure is out of its limit.
    #[default]
    Ok,
    /// It reached its end, with a verdict of degraded or a measure beyond its limit: the reason names it.
    Degraded,
    /// A guard stopped it, or what it computed means nothing: the reason is that of the guard or of the verdict.
    Failed,
    /// It could not be tried here, e.g. without a GPU.
    Skipped,
}

impl Class {
    /// As in the tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Degraded => "degraded",
            Self::Failed => "failed",
            Self::Skipped => "skipped",
        }
    }
}

/// Wall-clock time of the solver alone: no set-up, no measuring, no output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Median over the repetitions [s].
    pub median_s: f64,
    /// Shortest [s].
    pub shortest_s: f64,
    /// Longest [s].
    pub longest_s: f64,
    /// Number of repetitions.
    pub repetitions: u32,
}

impl Timing {
    /// Of `seconds` [s]; `None` without any.
    pub fn of(mut seconds: Vec<f64>) -> Option<Self> {
        seconds.sort_by(f64::total_cmp);
        let (&shortest_s, &longest_s) = (seconds.first()?, seconds.last()?);
        let n = seconds.len();
        let median_s = 0.5 * (seconds[(n - 1) / 2] + seconds[n / 2]);
        Some(Self { median_s, shortest_s, longest_s, repetitions: n as u32 })
    }
}

/// What a point cost, in units that do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Work {
    /// Particles of all kinds at the start.
    pub particles: u64,
    /// Steps.
    pub steps: u64,
    /// Particles of the start times steps; what comes in later does not count.
    pub particle_steps: u64,
    /// Iterations of the pressure solver, all steps.
    pub iterations: u64,
    /// Products with the fine matrix that these amount to, preconditioner included.
    pub products: f64,
}

/// What a point measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// How it ended.
    pub class: Class,
    /// Why it is not `ok`.
    pub reason: String,
    /// Whether it failed because the case was refused, or a file could not be read or written: it is tried again.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub refused: bool,
    /// Numbers by name, `name [unit]`; only finite ones.
    pub values: BTreeMap<String, f64>,
    /// Curves by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub curves: BTreeMap<String, Vec<[f64; 2]>>,
    /// Names of the curves that are profiles: their rows are bins, of which each weighs alike in a mean.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub profiles: BTreeSet<String>,
    /// Times at which the curves over time were sampled that have gaps or begin late [s].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sampled: BTreeMap<String, Vec<f64>>,
    /// Wall-clock time.
    pub timing: Option<Timing>,
    /// Work.
    pub work: Work,
    /// Processor, e.g. `CPU, 2 threads, f64`.
    pub machine: String,
}

impl Measured {
    /// A point that `error` ended.
    pub fn failed(error: &Error) -> Self {
        let class = if matches!(error, Error::Gpu(_)) { Class::Skipped } else { Class::Failed };
        Self { class, reason: error.to_string(), ..Self::default() }
    }

    /// Whether it came to its end with something that can be looked at.
    pub fn has_result(&self) -> bool {
        self.class <= Class::Degraded
    }

    /// Keep `value` as `name`; what is not finite is not kept, and makes a point that was fine degraded.
    pub fn put(&mut self, name: &str, value: f64) {
        if value.is_finite() {
            self.values.insert(name.into(), value);
        } else {
            self.degrade(&format!("{name} is not a number"));
        }
    }

    /// Call the point degraded, unless it is worse already.
    pub fn degrade(&mut self, reason: &str) {
        if self.class <= Class::Degraded {
            self.class = Class::Degraded;
            if !self.reason.is_empty() {
                self.reason.push_str("; ");
            }
            self.reason.push_str(reason);
        }
    }

    /// Takes over the verdict on the run that it is of. What was measured of a failed one stays to be looked at, and counts for nothing.
    pub fn judge(&mut self, verdict: &Verdict) {
        let why = verdict.reasons.join("; ");
        match verdict.grade {
            Grade::Fine => {}
            Grade::Degraded => self.degrade(&why),
            Grade::Failed => {
                self.class = Class::Failed;
                self.reason = format!("what was computed means nothing: {why}");
            }
        }
    }

    /// Degraded if `name` was measured above `most`; told once, however often it is asked.
    pub fn limit(&mut self, name: &str, most: f64) {
        // What is no number is within no limit.
        if let Some(&value) =
            self.values.get(name).filter(|v| v.partial_cmp(&&most).is_none_or(Ordering::is_gt))
        {
            let reason = format!("{name} = {value:.3e} > {most:.3e}");
            if !self.reason.split("; ").any(|told| told == reason) {
                self.degrade(&reason);
            }
        }
    }

    /// What was measured of a slice in two dimensions, `spacing` [m] wide, for each metre across: points of other spacings share that.
    pub fn of_slice(&mut self, spacing: f64) {
        let Self { values, curves, profiles, sampled, .. } = self;
        let names: Vec<String> = values.keys().chain(curves.keys()).cloned().collect();
        // A profile is called as the study says and is of no slice.
        for name in names.into_iter().filter(|name| !profiles.contains(name)) {
            let Some(new) = per_metre(&name) else { continue };
            if let Some(value) = values.remove(&name) {
                values.insert(new.clone(), value / spacing);
            }
            if let Some(mut curve) = curves.remove(&name) {
                curve.iter_mut().for_each(|p| p[1] /= spacing);
                if let Some(times) = sampled.remove(&name) {
                    sampled.insert(new.clone(), times);
                }
                curves.insert(new, curve);
            }
        }
    }

    /// A curve, with a row that has no number wherever it was sampled up to its last point and had no value. The first sample counts
    /// only with a value: before the first step there is no pressure.
    pub fn curve(&self, name: &str) -> Option<Vec<[f64; 2]>> {
        let curve = self.curves.get(name)?;
        let Some(times) = self.sampled.get(name) else { return Some(curve.clone()) };
        let mut places = times.iter();
        let mut marked = Vec::with_capacity(curve.len());
        for point in curve {
            let missed = places.by_ref().take_while(|t| **t != point[0]);
            marked.extend(missed.filter(|t| **t != times[0]).map(|t| [*t, f64::NAN]));
            marked.push(*point);
        }
        Some(marked)
    }

    /// A value.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.values.get(name).copied()
    }
}

/// A point of a study, as in `points/HASH.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// [`FORMAT`].
    pub format: u32,
    /// Name of the study.
    pub study: String,
    /// Place in the sweep, from 0.
    pub index: usize,
    /// Hash of everything that the result depends on but for the program itself.
    pub hash: String,
    /// Version of the program that computed it.
    #[serde(default)]
    pub version: String,
    /// Line of the plot that it belongs to.
    pub method: String,
    /// What was varied.
    pub parameters: BTreeMap<String, String>,
    /// What was measured.
    #[serde(flatten)]
    pub measured: Measured,
}

impl Row {
    /// A parameter as a number.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.parameters.get(name)?.parse().ok()
    }

    /// The parameters in words.
    pub fn setting(&self) -> String {
        let parts: Vec<String> = self.parameters.iter().map(|(k, v)| format!("{k} = {v}")).collect();
        parts.join(", ")
    }

    /// Method and parameters in words, without what the method says already.
    pub fn label(&self) -> String {
        let more = self.parameters.iter().filter(|(_, v)| !self.method.contains(v.as_str()));
        let parts: Vec<String> = more.map(|(k, v)| format!("{k} = {v}")).collect();
        if parts.is_empty() { self.method.clone() } else { format!("{}, {}", self.method, parts.join(", ")) }
    }
}

/// A point in words: its method, and its setting where anything is varied.
pub fn told(method: &str, setting: &str) -> String {
    if setting.is_empty() { method.into() } else { format!("{method} ({setting})") }
}

/// 64-bit FNV-1a, as 16 hexadecimal digits: the same on every machine and in every version of the compiler.
pub fn hash(parts: &[&str]) -> String {
    let mut h = 0xcbf2_9ce4_8422_2325_u64;
    for part in parts {
        // The length keeps ("ab", "c") from ("a", "bc").
        for byte in part.len().to_le_bytes().iter().chain(part.as_bytes()) {
            h = (h ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    format!("{h:016x}")
}

#[cfg(test)]
mod tests {
    use super::{Class, Measured, Row, Timing, hash};
    use seixo::output::result::{Grade, Verdict};

    #[test]
    fn median_and_spread() {
        let t = Timing::of(vec![3.0, 1.0, 2.0, 10.0]).unwrap();
        assert_eq!((t.median_s, t.shortest_s, t.longest_s, t.repetitions), (2.5, 1.0, 10.0, 4));
        assert!(Timing::of(Vec::new()).is_none());
    }

    #[test]
    fn a_row_comes_back_from_its_file_to_the_last_bit() {
        let mut measured = Measured { timing: Timing::of(vec![0.1, 0.3]), ..Measured::default() };
        measured.put("error [-]", 0.1 + 0.2);
        measured.put("bad [-]", f64::NAN);
        measured.curves.insert("front".into(), vec![[0.0, 1.0 / 3.0]]);
        assert_eq!(measured.class, Class::Degraded);
        let row = Row { study: "s".into(), measured, ..Row::default() };
        let text = serde_json::to_string(&row).unwrap();
        assert_eq!(serde_json::from_str::<Row>(&text).unwrap(), row);
    }

    #[test]
    fn a_verdict_is_the_class_of_a_point_and_comes_on_top_of_its_limits() {
        let judged = |grade| {
            let mut measured = Measured::default();
            measured.put("a [-]", 2.0);
            let reasons = if grade == Grade::Fine { vec![] } else { vec!["b".into(), "c".into()] };
            measured.judge(&Verdict { grade, reasons, ..Verdict::default() });
            measured.limit("a [-]", 1.0);
            (measured.class, measured.reason)
        };
        let limit = "a [-] = 2.000e0 > 1.000e0";
        assert_eq!(judged(Grade::Fine), (Class::Degraded, limit.into()));
        assert_eq!(judged(Grade::Degraded), (Class::Degraded, format!("b; c; {limit}")));
        assert_eq!(judged(Grade::Failed), (Class::Failed, "what was computed means nothing: b; c".into()));
    }

    #[test]
    fn a_curve_has_gaps_where_it_was_sampled_without_a_value() {
        let mut measured = Measured::default();
        for name in ["level", "late"] {
            measured.sampled.insert(name.into(), vec![0.0, 0.1, 0.2, 0.3]);
        }
        measured.curves.insert("level".into(), vec![[0.1, 1.0], [0.3, 2.0]]);
        measured.curves.insert("profile".into(), vec![[0.1, 1.0], [0.25, 2.0]]);
        let level = measured.curve("level").unwrap();
        assert!(level.len() == 3 && level[1][0] == 0.2 && level[1][1].is_nan(), "{level:?}");
        measured.curves.insert("late".into(), vec![[0.2, 1.0], [0.3, 2.0]]);
        let late = measured.curve("late").unwrap();
        assert!(late.len() == 3 && late[0][0] == 0.1 && late[0][1].is_nan(), "{late:?}");
        assert_eq!(measured.curve("profile").unwrap(), measured.curves["profile"]);
    }

    #[test]
    fn what_a_slice_has_is_told_for_each_metre_across() {
        let mut measured = Measured::default();
        measured.put("kinetic energy [J]", 3.0);
        measured.put("volume [-]", 1.0);
        for name in ["wall_force_x [N]", "P [Pa]", "profile [N]"] {
            measured.curves.insert(name.into(), vec![[0.5, 2.0]]);
        }
        measured.profiles.insert("profile [N]".into());
        measured.of_slice(0.5);
        assert_eq!(
            [measured.value("kinetic energy [J/m]"), measured.value("volume [-]")],
            [Some(6.0), Some(1.0)]
        );
        let names: Vec<&str> = measured.curves.keys().map(String::as_str).collect();
        assert_eq!(names, ["P [Pa]", "profile [N]", "wall_force_x [N/m]"]);
        assert_eq!([measured.curves[names[0]][0], measured.curves[names[2]][0]], [[0.5, 2.0], [0.5, 4.0]]);
    }

    #[test]
    fn the_hash_is_fixed_and_keeps_parts_apart() {
        assert_eq!(hash(&["a"]), hash(&["a"]));
        assert_ne!(hash(&["ab", "c"]), hash(&["a", "bc"]));
        assert_eq!(hash(&[]), "cbf29ce484222325");
    }
}
