//! A study as a TOML file: a case, what to vary, what to measure, what to compare with.
//!
//! ```toml
//! name = "hydrostatic"
//! title = "Water at rest"
//! case = "../hydrostatic.toml"          # or text = """..."""
//! set = ["output.every=0"]
//! repetitions = 3
//! method = "{preset}"                   # one line of the plot for each
//!
//! [measure]
//! of = ["hydrostatic_pressure", "volume"]
//! from = 1.0
//! every = 0.01
//!
//! [[axis]]                              # the sweep is the grid of all axes
//! name = "preset"
//! key = "fluid.preset"
//! values = ["paper", "accurate"]
//! [[axis]]
//! name = "spacing"
//! choices = [{ name = "0.05", set = ["run.spacing=0.05", "run.time_step=2e-3"] }]
//!
//! [[error]]
//! value = "pressure error [-]"
//! ```

use super::engine::Processor;
use super::measure::Spec;
pub use super::points::Setup;
use super::result_number::ResultNumber;
use super::row::{Class, Measured, Row};
use super::validation::check::Check;
use seixo::case::file::{located, parse_as};
use seixo::error::{Error, Problem, Result};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A study file.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Definition {
    /// Name, for files.
    #[cfg_attr(test, schemars(regex(pattern = r"^[A-Za-z0-9_-][A-Za-z0-9_.-]*$")))]
    pub name: String,
    /// First line of the plots.
    pub title: String,
    /// The question it answers, for the report.
    #[serde(default)]
    pub question: String,
    /// Where the reference comes from, for a validation.
    #[serde(default)]
    pub source: String,
    /// Only with `--full`, for a validation.
    #[serde(default)]
    pub full: bool,
    /// The case file, relative to the study file.
    pub case: Option<String>,
    /// The case itself, instead of `case`.
    pub text: Option<String>,
    /// Overrides of every point, `key=value`.
    #[serde(default)]
    pub set: Vec<String>,
    /// Runs of each point, for the time.
    #[serde(default = "three")]
    pub repetitions: u32,
    /// Method of a point, with `{axis}` for what it takes on that axis.
    pub method: String,
    /// What to measure.
    pub measure: Spec,
    /// What is varied: the sweep is the grid of all axes.
    #[serde(default)]
    pub axis: Vec<Axis>,
    /// More grids: each replaces the axes of the same name by its own.
    #[serde(default)]
    pub grid: Vec<Grid>,
    /// What counts as error.
    #[serde(default)]
    pub error: Vec<ErrorMeasure>,
    /// Numbers that are told of every point.
    #[serde(default)]
    pub result: Vec<ResultNumber>,
    /// What is compared with what, for a validation.
    #[serde(default)]
    pub check: Vec<Check>,
    /// Values beyond which a point counts as degraded: of what is measured, and errors of curves.
    #[serde(default)]
    pub limit: BTreeMap<String, f64>,
}

fn three() -> u32 {
    3
}

/// A grid of its own.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Method of its points, instead of the study's.
    pub method: Option<String>,
    /// Only with `--full`.
    #[serde(default)]
    pub full: bool,
    /// Its axes.
    pub axis: Vec<Axis>,
}

/// Something that is varied.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// Name, for tables and plots.
    pub name: String,
    /// The key that takes each of `values`.
    pub key: Option<String>,
    /// Values of `key`.
    #[serde(default)]
    #[cfg_attr(test, schemars(with = "Vec<serde_json::Value>"))]
    pub values: Vec<toml::Value>,
    /// Further values, only with `--full`.
    #[serde(default)]
    #[cfg_attr(test, schemars(with = "Vec<serde_json::Value>"))]
    pub full_values: Vec<toml::Value>,
    /// Settings of several keys, instead of `key` and `values`.
    #[serde(default)]
    pub choices: Vec<Choice>,
    /// Whether its values are other scenes, each of which asks for a setting of its own, and no settings to choose from. Absent: whether all of
    /// its keys are those of a scene, of water, walls, bodies and openings.
    pub scene: Option<bool>,
}

/// Keys of what a case is about; others say how it is computed.
const SCENE: [&str; 17] = [
    "run.gravity",
    "tank",
    "obstacle",
    "plane",
    "moving_wall",
    "absorber",
    "inflow",
    "outflow",
    "body",
    "fluid.density",
    "fluid.viscosity",
    "fluid.block",
    "fluid.shape",
    "fluid.fill",
    "contact.friction",
    "contact.restitution",
    "contact.viscous_friction",
];

impl Axis {
    /// Whether its values are other scenes.
    fn is_scene(&self) -> bool {
        let set = self.choices.iter().flat_map(|c| &c.set).filter_map(|set| set.split_once('='));
        let mut keys = set.map(|(key, _)| key.trim()).chain(self.key.as_deref()).peekable();
        let of_scene = |key: &str| {
            let mut rest = SCENE.iter().filter_map(|scene| key.strip_prefix(scene));
            rest.any(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        self.scene.unwrap_or_else(|| keys.peek().is_some() && keys.all(of_scene))
    }
}

/// A setting of several keys at once.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Choice {
    /// Name, for tables and plots.
    pub name: String,
    /// Overrides, `key=value`.
    #[serde(default)]
    pub set: Vec<String>,
    /// Where it computes.
    pub processor: Option<Processor>,
    /// Only with `--full`.
    #[serde(default)]
    pub full: bool,
}

/// What counts as error.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ErrorMeasure {
    /// A measured value that is an error by itself (against an analytic solution).
    pub value: Option<String>,
    /// A curve to compare, instead of `value`: the rms of the differences over the largest size that the reference has.
    pub curve: Option<String>,
    /// With what: `finest` (the row with the most particles, and of those the most steps), or a CSV file
    /// of two columns, relative to the study file.
    pub against: Option<String>,
    /// Name, for tables and plots.
    pub name: Option<String>,
}

impl ErrorMeasure {
    /// What is wrong with it, if anything, with the key in its table.
    fn fault(&self) -> Option<Problem> {
        match (&self.value, &self.curve, &self.against) {
            (Some(_), None, None) | (None, Some(_), Some(_)) => None,
            (None, None, _) => Some(Problem::new(
                "value",
                "an error is a value or of a curve",
                "give `value`, or `curve` and `against`",
            )),
            (None, Some(_), None) => Some(Problem::new(
                "against",
                "a curve is no error by itself",
                "give `against`: \"finest\", or a CSV file of two columns",
            )),
            (Some(_), ..) => Some(Problem::new(
                "value",
                "a value is an error by itself",
                "leave out `curve` and `against`, or `value`",
            )),
        }
    }
}

/// A file that a study refers to.
pub type Files<'a> = dyn Fn(&str) -> Result<String> + 'a;

/// Reads files relative to `folder`.
pub fn files_of(folder: &Path) -> impl Fn(&str) -> Result<String> {
    let folder = folder.to_path_buf();
    move |name| {
        let path = folder.join(name);
        std::fs::read_to_string(&path).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => {
                Error::file(path.display().to_string(), "", format!("no file at `{}`", path.display()))
            }
            _ => Error::io(&path)(e),
        })
    }
}

impl Definition {
    /// The JSON schema of a study or validation file, for editors (`#:schema` in the first line) and for
    /// `seixo schema study`.
    pub fn schema() -> &'static str {
        seixo::schemas::STUDY
    }

    /// Read a study; `name` stands for the file in messages.
    ///
    /// # Errors
    /// [`Error::Case`] with line and column.
    pub fn parse(name: &str, text: &str) -> Result<Self> {
        let wrong =
            |key: &str, what: &dyn std::fmt::Display| Error::file(name, key, format!("{name}: {what}"));
        let study: Self = parse_as(name, text)?;
        // What is wrong with the k-th table of its kind, where it stands.
        let placed = |kind: &str, k: usize, problem: Problem| {
            located(
                name,
                text,
                &Problem::new(format!("{kind}.{k}.{}", problem.key), problem.message, problem.remedy),
            )
        };
        for (k, e) in study.error.iter().enumerate() {
            e.fault().map_or(Ok(()), |p| Err(placed("error", k, p)))?;
        }
        for (k, check) in study.check.iter().enumerate() {
            let fault = check.fault().map_or_else(|| study.unreached(check), |p| Ok(Some(p)))?;
            fault.map_or(Ok(()), |p| Err(placed("check", k, p)))?;
        }
        for (k, result) in study.result.iter().enumerate() {
            result.fault().map_or(Ok(()), |p| Err(placed("result", k, p)))?;
        }
        if study.error.is_empty() && study.check.is_empty() && study.result.is_empty() {
            return Err(wrong("error", &"give [[error]], [[result]] or [[check]]: what is to be found out"));
        }
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
        if study.name.is_empty() || study.name.starts_with('.') || !study.name.chars().all(plain) {
            let what = format!(
                "name: `{}` becomes the name of files: use letters, digits, _, - and dots inside of it",
                study.name.escape_debug()
            );
            return Err(wrong("name", &what));
        }
        if study.case.is_some() == study.text.is_some() {
            return Err(wrong("case", &"give `case` or `text`, one of them"));
        }
        Ok(study)
    }

    /// Names of the axes whose values are other scenes.
    pub fn scene_axes(&self) -> BTreeSet<&str> {
        let axes = self.axis.iter().chain(self.grid.iter().flat_map(|g| &g.axis));
        axes.filter(|axis| axis.is_scene()).map(|axis| axis.name.as_str()).collect()
    }

    /// Holds what was `measured` against the limits.
    pub fn hold(&self, measured: &mut Measured) {
        self.limit.iter().for_each(|(name, most)| measured.limit(name, *most));
    }

    /// Limits of values that none of the finished points in `rows` has, in words with those that there are.
    pub fn idle_limits<'a>(&self, rows: impl Iterator<Item = &'a Row>) -> Vec<String> {
        let limits = self.limit.keys().map(String::as_str).collect();
        let told = |name: &str, there: &str| {
            format!(
                "[limit] `{name}` is held against nothing: no finished point has this value; there are {there}."
            )
        };
        idle(&limits, rows, |measured| measured.values.keys().map(String::as_str).collect(), told)
    }

    /// Curves of `[[error]]` that none of the finished points in `rows` has, likewise.
    pub fn idle_errors<'a>(&self, rows: impl Iterator<Item = &'a Row>) -> Vec<String> {
        let curves = self.error.iter().filter_map(|e| e.curve.as_deref()).collect();
        let told = |name: &str, there: &str| {
            format!("[[error]] `{name}`: no finished point has this curve; there are {there}.")
        };
        idle(&curves, rows, |measured| measured.curves.keys().map(String::as_str).collect(), told)
    }

    /// `[[result]]`s that come to nothing in all of the finished points in `rows`, likewise.
    pub fn idle_results<'a>(&self, rows: impl Iterator<Item = &'a Row>) -> Vec<String> {
        let names = self.result.iter().map(|r| r.name.as_str()).collect();
        let told = |name: &str, _: &str| {
            format!(
                "[[result]] `{name}`: in no finished point does its curve have such a number (`take`, `level`, `window`)."
            )
        };
        idle(&names, rows, |measured| measured.values.keys().map(String::as_str).collect(), told)
    }

    /// What is wrong with a `check` that is for points that no grid has.
    ///
    /// # Errors
    /// Axes that cannot be read.
    fn unreached(&self, check: &Check) -> Result<Option<Problem>> {
        let axes: Vec<&Axis> = self.axis.iter().chain(self.grid.iter().flat_map(|g| &g.axis)).collect();
        for (name, value) in &check.only {
            let picks = axes.iter().filter(|a| a.name == *name).map(|a| a.picks(true));
            let values: Vec<String> =
                picks.collect::<Result<Vec<_>>>()?.concat().into_iter().map(|p| p.name).collect();
            if values.contains(value) {
                continue;
            }
            let what = if values.is_empty() {
                let names: BTreeSet<&str> = axes.iter().map(|a| a.name.as_str()).collect();
                let names: Vec<&str> = names.into_iter().collect();
                let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
                format!("there is no axis `{name}`; there are: {names}")
            } else {
                format!("the axis `{name}` has no value \"{value}\"; it has: {}", values.join(", "))
            };
            return Ok(Some(Problem::new("only", what, "no point would be held against it")));
        }
        Ok(None)
    }
}

/// Which of `asked` none of the finished points in `rows` has among its `names`, each as it is `told` with those that there are; none while no point
/// has finished.
fn idle<'a>(
    asked: &BTreeSet<&str>,
    rows: impl Iterator<Item = &'a Row>,
    names: impl Fn(&'a Measured) -> Vec<&'a str>,
    told: impl Fn(&str, &str) -> String,
) -> Vec<String> {
    let ended = rows.map(|r| &r.measured).filter(|m| m.class <= Class::Degraded);
    let mut ended = ended.peekable();
    if ended.peek().is_none() {
        return Vec::new();
    }
    let known: BTreeSet<&str> = ended.flat_map(names).collect();
    let there = known.iter().copied().collect::<Vec<_>>().join(", ");
    asked.difference(&known).map(|name| told(name, &there)).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::{Definition, Setup};
    use std::path::Path;

    pub const STUDY: &str = r#"
name = "s"
title = "t"
method = "{a} at {b}"
text = "[run]\nspacing = 0.1\ntime_step = 1e-3\nend = 1\n"
[measure]
of = []
[[axis]]
name = "a"
key = "run.end"
values = [1.0, 2.0]
full_values = [3.0]
[[axis]]
name = "b"
choices = [{ name = "x", set = ["run.time_step=2e-3"] }, { name = "y", full = true }]
[[error]]
value = "e [-]"
"#;

    #[test]
    fn an_axis_is_of_the_scene_by_its_keys_or_by_word() {
        let axes = |more: &str| {
            let study = Definition::parse("s.toml", &format!("{STUDY}{more}")).unwrap();
            study.scene_axes().into_iter().map(str::to_owned).collect::<Vec<_>>()
        };
        let by_key = |key: &str| axes(&format!("[[axis]]\nname = \"c\"\nkey = \"{key}\"\nvalues = [1]\n"));
        for key in ["body.0.density", "fluid.block.0.max", "fluid.density", "tank.max"] {
            assert_eq!(by_key(key), ["c"], "{key}");
        }
        for key in ["run.spacing", "fluid.densit", "fluid.solver.tolerance", "contact.spring"] {
            assert_eq!(by_key(key), [""; 0], "{key}");
        }
        let by_choice = |set: &str, more: &str| {
            axes(&format!("[[axis]]\nname = \"c\"\n{more}choices = [{{ name = \"x\", set = [{set}] }}]\n"))
        };
        assert_eq!(by_choice("'body.0.mass=1', 'tank.max=[1,1,1]'", ""), ["c"]);
        // A spacing of its own with what fits it.
        assert_eq!(by_choice("'run.spacing=0.1', 'tank.max=[1,1,1]'", ""), [""; 0]);
        assert_eq!(by_choice("'tank.max=[1,1,1]'", "scene = false\n"), [""; 0]);
        assert_eq!(by_choice("", "scene = true\n"), ["c"]);
    }

    #[test]
    fn a_check_for_what_no_axis_has_is_refused() {
        let check = |only: &str| {
            let check = format!(
                "[[check]]\nname = \"c\"\nonly = {only}\nvalue = \"e [-]\"\nreference = 1\ntolerance = 1\n"
            );
            Definition::parse("s.toml", &format!("{STUDY}{check}")).map(|_| ()).map_err(|e| e.to_string())
        };
        assert_eq!(check("{ a = \"3.0\", b = \"y\" }"), Ok(()));
        let told = check("{ c = \"3.0\" }").unwrap_err();
        assert!(told.contains("there is no axis `c`; there are: a, b"), "{told}");
        let told = check("{ a = \"3\" }").unwrap_err();
        assert!(told.contains("has no value \"3\"; it has: 1.0, 2.0, 3.0"), "{told}");
    }

    #[test]
    fn the_committed_schema_is_current() {
        let text = serde_json::to_string_pretty(&schemars::schema_for!(Definition)).unwrap() + "\n";
        if std::env::var_os("SEIXO_WRITE_SCHEMA").is_some() {
            let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../schema/study.schema.json");
            return std::fs::write(file, text).unwrap();
        }
        assert!(text == Definition::schema(), "schema/study.schema.json is out of date: .ci/schema");
    }

    #[test]
    fn mistakes_are_told() {
        for (from, to) in
            [("value = \"e [-]\"", "curve = \"c\""), ("title", "tilte"), ("text", "case = 'c'\ntext")]
        {
            assert!(Definition::parse("s.toml", &STUDY.replacen(from, to, 1)).is_err(), "{to}");
        }
        let slip = Definition::parse("s.toml", &STUDY.replacen("title", "tilte", 1)).unwrap_err().to_string();
        assert!(slip.contains("s.toml:") && slip.contains("did you mean `title`?"), "{slip}");
        let text =
            Definition::parse("s.toml", &format!("repetitions = []\n{STUDY}")).unwrap_err().to_string();
        let told = "repetitions: a list, expected a whole number, 0 or more\n --> s.toml:1:15";
        assert!(text.contains(told) && !text.contains("seixo keys"), "{text}");
        let text = STUDY.replace("key = \"run.end\"\nvalues = [1.0, 2.0]\nfull_values = [3.0]\n", "");
        let study = Definition::parse("s.toml", &text).unwrap();
        assert!(study.jobs(&|_| unreachable!(), Path::new(""), &Setup::default()).is_err());
    }
}
