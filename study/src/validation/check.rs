//! A check of a validation: a measured number or curve, what it should be, and how far off it may be.
//!
//! ```toml
//! [[check]]
//! name = "P1, peak over 10 ms [Pa]"
//! curve = "P1 [Pa]"                      # or value = "..."
//! take = "largest"                       # see [`Take`]; the rms distance from the reference if absent
//! window = [0.3, 0.7]
//! smooth = 0.01
//! against = "../reference/spheric2_kleefsman_10ms.csv"   # or reference = 11239
//! columns = ["t_s", "P1_Pa"]
//! tolerance = 0.15                       # of the reference, or of `per`
//! peers = [{ name = "MPS of the paper's group, l0 = 15 mm", value = 18505 }]
//! ```

use super::reduce::{Curve, Take, cut, distance, lag, prepared, reduce, reduce_bins, smooth, smooth_for};
use crate::compare::within;
use crate::definition::Files;
use crate::engine::first_line;
use crate::result_number::missing;
use crate::row::{Class, Measured};
use seixo::error::{Error, Problem, Result};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};

/// A check, as in a validation file.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Check {
    /// What is compared, with its unit.
    pub name: String,
    /// A measured value.
    pub value: Option<String>,
    /// A measured curve, instead of `value`.
    pub curve: Option<String>,
    /// What is taken from the curve.
    #[serde(default)]
    pub take: Take,
    /// The curve that comes first, of `lag`.
    pub behind: Option<String>,
    /// Only for points with these values on these axes.
    #[serde(default)]
    pub only: BTreeMap<String, String>,
    /// First and last time (or place) that counts.
    pub window: Option<[f64; 2]>,
    /// Width of the moving mean that the curve goes through [s]; 0 for none.
    #[serde(default)]
    pub smooth: f64,
    /// Level or time that `take` asks for.
    pub level: Option<f64>,
    /// Second level, of `passage`.
    pub to: Option<f64>,
    /// Added to the measured curve.
    #[serde(default)]
    pub plus: f64,
    /// The measured curve, after `plus`, is multiplied by this.
    #[serde(default = "one")]
    pub times: f64,
    /// Time counts from the moment at which the curve has moved by this much from its start.
    pub since_moved: Option<f64>,
    /// What the number should be.
    pub reference: Option<f64>,
    /// A CSV file with what the curve should be, relative to the validation file; the same is taken from it.
    pub against: Option<String>,
    /// Names of its two columns; the first two if absent.
    pub columns: Option<[String; 2]>,
    /// The difference is divided by this; by the reference's size if absent.
    pub per: Option<f64>,
    /// Largest error that is called right [-].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub tolerance: f64,
    /// What others reach.
    #[serde(default)]
    pub peers: Vec<Peer>,
    /// Label of the chart's horizontal axis.
    #[serde(default = "time")]
    pub axis: String,
}

fn one() -> f64 {
    1.0
}

fn time() -> String {
    "time [s]".into()
}

/// What somebody else reaches: a number, or a curve.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Peer {
    /// Who.
    pub name: String,
    /// The number.
    pub value: Option<f64>,
    /// A CSV file with the curve.
    pub against: Option<String>,
    /// Names of its two columns.
    pub columns: Option<[String; 2]>,
}

/// What a check compares with, read.
#[derive(Clone, Debug, Default)]
pub struct Reference {
    /// The curve, if there is one.
    pub curve: Option<Curve>,
    /// The curves of the peers that have one.
    pub peers: Vec<Option<Curve>>,
}

/// What a check found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// The measured number.
    pub result: f64,
    /// What it should be.
    pub reference: f64,
    /// Their distance over `per` or the reference's size [-].
    pub error: f64,
    /// The moment from which time counts, if that is not the start [s].
    pub origin: f64,
}

/// Two columns of a CSV text by their names, or the first two; lines that begin with `#` are passed over.
///
/// # Errors
/// [`Error::Case`] naming file and column, or if there are fewer than two rows of numbers.
pub fn columns(file: &str, text: &str, names: Option<&[String; 2]>) -> Result<Curve> {
    let mut lines = text.lines().filter(|l| !l.starts_with('#') && !l.trim().is_empty());
    let head: Vec<&str> = lines.next().unwrap_or_default().split(',').map(str::trim).collect();
    let place = |k: usize| match names {
        None => Ok(k),
        Some(names) => head.iter().position(|h| *h == names[k]).ok_or_else(|| {
            let text = format!("{file}: no column `{}`; there are: {}", names[k], head.join(", "));
            Error::file(file, names[k].as_str(), text)
        }),
    };
    let (x, y) = (place(0)?, place(1)?);
    let mut curve = Curve::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        // Other columns may have rows of their own.
        let [Some(a), Some(b)] = [x, y].map(|k| cells.get(k).copied().filter(|c| !c.is_empty())) else {
            continue;
        };
        let number = |cell: &str| cell.parse::<f64>().ok().filter(|v| v.is_finite());
        let (Some(a), Some(b)) = (number(a), number(b)) else {
            let text =
                format!("{file}: expected two numbers in columns `{}` and `{}`: `{line}`", head[x], head[y]);
            return Err(Error::file(file, "", text));
        };
        curve.push([a, b]);
    }
    if curve.len() < 2 {
        return Err(Error::file(file, "", format!("{file}: expected two rows of numbers or more")));
    }
    Ok(curve)
}

impl Check {
    /// Why a run has no number for it.
    pub fn missing(&self, measured: &Measured) -> String {
        if measured.class > Class::Degraded {
            return first_line(&measured.reason).to_owned();
        }
        let listed = |names: Vec<&String>| {
            let names: Vec<&str> = names.into_iter().map(String::as_str).collect();
            if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
        };
        if let Some(value) = &self.value {
            return format!(
                "there is no value `{value}`; measured are {}",
                listed(measured.values.keys().collect())
            );
        }
        let curves = self.curve.iter().chain(&self.behind);
        match curves.into_iter().find(|c| !measured.curves.contains_key(*c)) {
            Some(curve) => {
                format!("there is no curve `{curve}`; there are {}", listed(measured.curves.keys().collect()))
            }
            None => "the curve has no such point: see `take`, `window`, `level` and `since_moved`".into(),
        }
    }

    /// What is wrong with it, if anything, with the key in its table.
    pub fn fault(&self) -> Option<Problem> {
        let wrong = |key: &str, what: &str, remedy: &str| Some(Problem::new(key, what, remedy));
        if self.value.is_some() == self.curve.is_some() {
            return wrong(
                "value",
                "a check is of a value or of a curve",
                "give `value` or `curve`, one of them",
            );
        }
        if self.reference.is_some() == self.against.is_some() {
            let remedy = "give `reference` or `against`, one of them";
            return wrong("reference", "a check is against a number or a curve", remedy);
        }
        if (self.take == Take::Lag) != self.behind.is_some() {
            let remedy = "give both, or neither: `behind` is the curve that comes first";
            return wrong("behind", "`take = \"lag\"` and `behind` go together", remedy);
        }
        if self.take == Take::Lag && self.reference.is_none() {
            return wrong("reference", "a lag is held against a number", "give `reference` [s]");
        }
        if self.take == Take::Lag && self.since_moved.is_some() {
            return wrong(
                "since_moved",
                "it would shift one curve of a lag and not the other",
                "leave it out",
            );
        }
        if self.value.is_some() && self.against.is_some() {
            return wrong("against", "a value is no curve", "give `curve`, or `reference`");
        }
        if self.curve.is_some() && self.take == Take::Distance && self.against.is_none() {
            let remedy = "give `take`, or a curve to compare with as `against`";
            return wrong("take", "nothing says which number of the curve counts", remedy);
        }
        if self.reference == Some(0.0) && self.per.is_none() {
            return wrong("per", "the reference is 0", "give `per`, what the error is divided by");
        }
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return wrong("tolerance", "no error would be within it", "use a number of more than 0");
        }
        self.take.fault([self.level, self.to], self.window, self.smooth)
    }

    /// What is wrong where `curves` are all that a point has, if one of its own is none of them.
    pub fn lacks(&self, curves: &BTreeSet<String>) -> Option<Error> {
        self.curve.iter().chain(&self.behind).find_map(|curve| missing("check", &self.name, curve, curves))
    }

    /// Whether it is for a point with `parameters`.
    pub fn applies(&self, parameters: &BTreeMap<String, String>) -> bool {
        self.only.iter().all(|(axis, value)| parameters.get(axis) == Some(value))
    }

    /// Reads what it compares with.
    ///
    /// # Errors
    /// A file or a column that is not there.
    pub fn read(&self, files: &Files) -> Result<Reference> {
        let curve = |file: &Option<String>, names: &Option<[String; 2]>| match file {
            Some(file) => columns(file, &files(file)?, names.as_ref()).map(Some),
            None => Ok(None),
        };
        let peers = self.peers.iter().map(|p| curve(&p.against, &p.columns)).collect::<Result<_>>()?;
        Ok(Reference { curve: curve(&self.against, &self.columns)?, peers })
    }

    /// The measured curve as it is compared, and the moment from which its time counts.
    pub fn prepared(&self, measured: &Measured) -> Option<(Curve, f64)> {
        let curve = measured.curve(self.curve.as_ref()?)?;
        let curve: Curve = curve.iter().map(|p| [p[0], (p[1] + self.plus) * self.times]).collect();
        prepared(self.take, curve, self.since_moved, self.smooth)
    }

    fn levels(&self) -> [f64; 2] {
        [self.level, self.to].map(Option::unwrap_or_default)
    }

    /// The number of a curve that is prepared, against that of the reference.
    fn of_curve(&self, curve: &[[f64; 2]], is_profile: bool, reference: &Reference) -> Option<Verdict> {
        if self.take == Take::Distance {
            let expected = cut(reference.curve.as_ref()?, self.window);
            let reached = within(self.curve.as_deref().unwrap_or_default(), &expected, curve);
            let (rms, _) = distance(curve, &reached)?;
            let size = reached.iter().map(|p| p[1].abs()).fold(0.0, f64::max);
            return Some(Verdict {
                result: rms,
                reference: 0.0,
                error: rms / self.per.unwrap_or(size),
                origin: 0.0,
            });
        }
        let reduced = if is_profile { reduce_bins } else { reduce };
        let result = reduced(self.take, &cut(curve, self.window), self.levels())?;
        self.of_numbers(result, self.expected(reference)?)
    }

    /// What the number should be.
    fn expected(&self, reference: &Reference) -> Option<f64> {
        let Some(curve) = &reference.curve else { return self.reference };
        let smoothed = smooth_for(self.take, curve, self.smooth);
        reduce(self.take, &cut(&smoothed, self.window), self.levels())
    }

    fn of_numbers(&self, result: f64, reference: f64) -> Option<Verdict> {
        let error = (result - reference).abs() / self.per.unwrap_or(reference.abs());
        error.is_finite().then_some(Verdict { result, reference, error, origin: 0.0 })
    }

    /// Judges a run; `None` if it ended early or does not have what is asked for.
    pub fn judge(&self, measured: &Measured, reference: &Reference) -> Option<Verdict> {
        if measured.class > Class::Degraded {
            return None;
        }
        if let Some(value) = &self.value {
            return self.of_numbers(measured.value(value)?, self.reference?);
        }
        let (curve, origin) = self.prepared(measured)?;
        if let Some(first) = &self.behind {
            let first = smooth(&measured.curve(first)?, self.smooth);
            let late = lag(&cut(&curve, self.window), &cut(&first, self.window))?;
            return self.of_numbers(late, self.reference?);
        }
        let is_profile = self.curve.as_ref().is_some_and(|name| measured.profiles.contains(name));
        Some(Verdict { origin, ..self.of_curve(&curve, is_profile, reference)? })
    }

    /// Judges peer `k`.
    pub fn judge_peer(&self, k: usize, reference: &Reference) -> Option<Verdict> {
        if let Some(curve) = reference.peers.get(k)? {
            return self.of_curve(curve, false, reference);
        }
        self.of_numbers(self.peers[k].value?, self.expected(reference)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str) -> Check {
        toml::from_str(text).unwrap()
    }

    fn run(curve: &[[f64; 2]]) -> Measured {
        let mut measured = Measured::default();
        measured.curves.insert("c".into(), curve.to_vec());
        measured.put("v", 3.0);
        measured
    }

    #[test]
    fn the_same_number_is_taken_from_run_experiment_and_peer() {
        let check = check(
            "name = 'n'\ncurve = 'c'\ntake = 'largest'\nplus = 1\ntimes = 2\nagainst = 'f'\ncolumns = ['t', 'b']\n\
             tolerance = 0.1\npeers = [{ name = 'they', value = 8 }, { name = 'others', against = 'f', columns = ['t', 'a'] }]",
        );
        assert_eq!(check.fault(), None);
        let files = |_: &str| Ok("# source\nt,a,b\n0,1,2\n1,5,4\n2,0,0\n".to_string());
        let reference = check.read(&files).unwrap();
        let verdict = check.judge(&run(&[[0.0, 0.0], [1.0, 1.5], [2.0, 0.0]]), &reference).unwrap();
        assert_eq!((verdict.result, verdict.reference, verdict.error), (5.0, 4.0, 0.25));
        assert_eq!(check.judge_peer(0, &reference).unwrap().error, 1.0);
        assert_eq!(check.judge_peer(1, &reference).unwrap().result, 5.0);
        let failed = Measured { class: Class::Failed, ..run(&[[0.0, 0.0], [1.0, 1.0]]) };
        assert_eq!(check.judge(&failed, &reference), None);
        let missing = Check { columns: Some(["t".into(), "x".into()]), ..check };
        assert!(missing.read(&files).unwrap_err().to_string().contains("there are: t, a, b"));
    }

    #[test]
    fn distances_count_from_the_first_motion_and_over_the_range() {
        let check = check("name = 'n'\ncurve = 'c'\nsince_moved = 0.1\nagainst = 'f'\ntolerance = 0.1");
        let reference = check.read(&|_: &str| Ok("t,x\n0,1.1\n1,2\n".into())).unwrap();
        let verdict =
            check.judge(&run(&[[0.0, 1.0], [3.0, 1.0], [4.0, 2.0], [6.0, 2.0]]), &reference).unwrap();
        assert!((verdict.origin - 3.1).abs() < 1e-12 && verdict.error < 1e-12, "{verdict:?}");
        assert_eq!(check.judge(&run(&[[0.0, 1.0], [3.0, 1.0]]), &reference), None, "it never moved");
    }

    #[test]
    fn a_value_needs_a_number_and_zero_needs_a_size() {
        let whole = "name = 'n'\nvalue = 'v'\nreference = 0\nper = 2\ntolerance = 0.1";
        let verdict = check(whole).judge(&run(&[]), &Reference::default()).unwrap();
        assert_eq!((verdict.result, verdict.error), (3.0, 1.5));
        for wrong in [
            whole.replace("per = 2\n", ""),
            whole.replace("reference = 0\n", ""),
            whole.replace("value = 'v'\n", ""),
            whole.replace("value", "curve"),
            whole.replace("0.1", "0"),
        ] {
            assert!(check(&wrong).fault().is_some(), "{wrong}");
        }
        let lag = "name = 'n'\ncurve = 'c'\ntake = 'lag'\nbehind = 'd'\nreference = 1\ntolerance = 0.1\n";
        assert!(check(lag).fault().is_none());
        for (more, key) in
            [("since_moved = 0.1", "since_moved"), ("window = [1, 1]", "window"), ("smooth = nan", "smooth")]
        {
            assert_eq!(check(&format!("{lag}{more}")).fault().unwrap().key, key);
        }
        let at = "name = 'n'\ncurve = 'c'\ntake = 'at'\nreference = 1\ntolerance = 0.1\n";
        assert_eq!(check(at).fault().unwrap().key, "level");
    }
}
