//! Validation: runs held against experiments and analytic solutions.
//!
//! A validation is a study file ([`crate::definition`]) with `[[check]]` tables ([`check::Check`]): a case, what is
//! varied, what is measured, what it should be and how far off it may be. Adding one takes a file in
//! `cases/validation` and its reference in `cases/reference`, nothing else. `seixo validate` runs the points of all of
//! them as one sweep (resumable, in shards) and writes one page ([`page`]) with tables and charts.

pub mod check;
pub mod command;
pub mod groups;
pub mod page;
pub mod reduce;

use crate::cases;
use crate::definition::{Definition, Files, Setup, files_of};
use crate::engine::{self, Context, Job, Options};
use crate::row::Row;
use check::{Check, Reference};
use seixo::error::{Error, Result};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

/// Name of the sweep, for hashes and messages.
const SWEEP: &str = "validation";

/// A validation, read.
pub struct Validation {
    /// Its file.
    pub definition: Definition,
    /// What its checks compare with, one a check.
    pub references: Vec<Reference>,
    /// Its points among those of the sweep.
    pub points: Range<usize>,
    /// Its checks that are for none of these points, in words.
    pub idle: Vec<String>,
}

/// Validations that run as one sweep.
#[derive(Default)]
pub struct Suite {
    /// The validations.
    pub validations: Vec<Validation>,
    jobs: Vec<Job>,
}

impl Suite {
    /// The validations `names`: those that come with the program, or files. Without names all that come with the
    /// program, the costly ones only if `setup.full`.
    ///
    /// # Errors
    /// [`Error::Case`] for a name that is not known, or what is wrong with a file.
    pub fn new(names: &[String], setup: &Setup) -> Result<Self> {
        let mut suite = Self::default();
        let all = cases::names("validation");
        let built_in = |name: &str| cases::text("validation", name);
        for name in names {
            if name.ends_with(".toml") {
                let path = Path::new(name);
                let text = std::fs::read_to_string(path)
                    .map_err(|e| Error::usage("validate", format!("validation file `{name}`: {e}")))?;
                let folder = path.parent().unwrap_or(Path::new(""));
                suite.add(name, &text, &files_of(folder), folder, setup)?;
            } else if all.contains(&name.as_str()) {
                suite.add(name, &built_in(&format!("{name}.toml"))?, &built_in, Path::new(""), setup)?;
            } else {
                let closest = all
                    .iter()
                    .max_by(|a, b| strsim::jaro_winkler(a, name).total_cmp(&strsim::jaro_winkler(b, name)));
                let hint = closest.filter(|n| strsim::jaro_winkler(n, name) > 0.8);
                let hint = hint.map_or(String::new(), |n| format!("; did you mean `{n}`?"));
                let text = format!("no validation is called `{name}`{hint}\nthere are: {}", all.join(", "));
                return Err(Error::usage("validate", text));
            }
        }
        if names.is_empty() {
            for name in all {
                let text = built_in(&format!("{name}.toml"))?;
                if setup.full || !Definition::parse(name, &text)?.full {
                    suite.add(name, &text, &built_in, Path::new(""), setup)?;
                }
            }
        }
        Ok(suite)
    }

    fn add(&mut self, name: &str, text: &str, files: &Files, folder: &Path, setup: &Setup) -> Result<()> {
        let definition = Definition::parse(name, text)?;
        if definition.check.is_empty() {
            return Err(Error::file(name, "check", format!("{name}: a validation needs a [[check]]")));
        }
        let references = definition.check.iter().map(|c| c.read(files)).collect::<Result<Vec<_>>>();
        let references = references.map_err(|e| Error::file(name, "check", format!("{name}: {e}")))?;
        let first = self.jobs.len();
        for mut job in definition.jobs(files, folder, setup)? {
            job.parameters.insert(0, ("case".into(), definition.name.clone()));
            job.identity = format!("{}\n{}", definition.name, job.identity);
            self.jobs.push(job);
        }
        let idle = definition.check.iter().filter(|check| {
            let mut points = self.jobs[first..].iter();
            !points.any(|job| is_for(check, job))
        });
        let told = |check: &Check| {
            let only: Vec<String> =
                check.only.iter().map(|(axis, value)| format!("{axis} {value}")).collect();
            let (name, only) = (&definition.name, only.join(", "));
            let remedy = if setup.full { "" } else { " (see --full)" };
            format!("{name}: {}: not checked, no point that runs is at {only}{remedy}.", check.name)
        };
        let idle = idle.map(told).collect();
        self.validations.push(Validation { definition, references, points: first..self.jobs.len(), idle });
        Ok(())
    }

    /// The points, each with its hash, in words.
    pub fn points(&self) -> impl Iterator<Item = String> {
        self.jobs.iter().map(|job| {
            let parts: Vec<String> = job.parameters.iter().map(|(k, v)| format!("{k} = {v}")).collect();
            format!("{}  {} ({})", job.hash(SWEEP), job.method, parts.join(", "))
        })
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.jobs.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.jobs.is_empty()
    }

    /// What is wrong with a check whose curve none of its points has; told before the first one runs.
    fn fault(&self) -> Option<Error> {
        let mut known = BTreeMap::new();
        self.validations.iter().find_map(|Validation { definition, points, .. }| {
            definition.check.iter().find_map(|check| {
                let own = points.clone().filter(|&k| is_for(check, &self.jobs[k]));
                let fault = engine::of_all(own.map(|k| {
                    let curves = known.entry(k).or_insert_with(|| (self.jobs[k].curves)());
                    curves.as_ref().and_then(|curves| check.lacks(curves))
                }))?;
                let name = &definition.name;
                Some(Error::file(name, "check", format!("{name}: {fault}")))
            })
        })
    }

    /// Runs what is open. Rows of the points that are there at the end, with result and error of every check among
    /// their values.
    ///
    /// # Errors
    /// [`Error::Io`]. A point that fails is a row.
    pub fn run(&self, options: &Options, context: &Context) -> Result<Vec<Row>> {
        if let Some(error) = self.fault().filter(|_| options.collect.is_none()) {
            return Err(error);
        }
        let mut rows = engine::sweep(SWEEP, &self.jobs, options, context)?;
        for validation in &self.validations {
            for row in rows.iter_mut().filter(|r| validation.points.contains(&r.index)) {
                validation.judge(row);
                validation.definition.hold(&mut row.measured);
            }
        }
        Ok(rows)
    }
}

/// Whether `check` is for the point of `job`.
fn is_for(check: &Check, job: &Job) -> bool {
    check.applies(&job.parameters.iter().cloned().collect())
}

/// Name of the value that holds the error of `check`.
pub fn error_name(check: &str) -> String {
    format!("error of {check}")
}

impl Validation {
    /// Checks and limits that none of its points among `rows` is held against, in words.
    pub fn notes(&self, rows: &[Row]) -> Vec<String> {
        let own = rows.iter().filter(|r| self.points.contains(&r.index));
        let limits = self.definition.idle_limits(own);
        let named = limits.into_iter().map(|limit| format!("{}: {limit}", self.definition.name));
        self.idle.iter().cloned().chain(named).collect()
    }

    /// Puts result and error of every check that is for `row` among its values.
    fn judge(&self, row: &mut Row) {
        for (check, reference) in self.definition.check.iter().zip(&self.references) {
            if !check.applies(&row.parameters) {
                continue;
            }
            let Some(verdict) = check.judge(&row.measured, reference) else { continue };
            row.measured.put(&check.name, verdict.result);
            row.measured.put(&error_name(&check.name), verdict.error);
            if check.since_moved.is_some() {
                row.measured.put(&format!("time origin of {}", check.name), verdict.origin);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_validation_that_comes_along_is_sound_quick_and_full() {
        let quick = Suite::new(&[], &Setup::default()).unwrap();
        let full = Suite::new(&[], &Setup { full: true, runs: 2, ..Setup::default() }).unwrap();
        assert!(!quick.is_empty() && full.len() > quick.len());
        assert!(full.fault().is_none(), "{:?}", full.fault());
        for validation in &full.validations {
            let d = &validation.definition;
            assert!(
                !validation.points.is_empty() && !d.source.is_empty(),
                "{}: no points or no source",
                d.name
            );
        }
        let mut points: Vec<String> = full.points().map(|p| p[..16].to_string()).collect();
        points.sort();
        points.dedup();
        assert_eq!(points.len(), full.len(), "points that are the same");
    }

    #[test]
    fn a_check_that_no_point_is_for_is_told() {
        let text = "name = 'v'\ntitle = 't'\nmethod = 'm'\ntext = \"[run]\\nspacing = 0.1\\ntime_step = 1e-3\\nend = 1\\n\"\n\
                    [measure]\nof = []\n[[axis]]\nname = 'e'\nkey = 'run.end'\nvalues = [1.0]\nfull_values = [2.0]\n\
                    [[check]]\nname = 'fine'\nonly = { e = '2.0' }\nvalue = 'v'\nreference = 1\ntolerance = 1\n";
        for (full, told) in [(false, 1), (true, 0)] {
            let mut suite = Suite::default();
            let setup = Setup { full, ..Setup::default() };
            suite.add("v", text, &|_: &str| unreachable!(), Path::new(""), &setup).unwrap();
            let notes = suite.validations[0].notes(&[]);
            assert_eq!(notes.len(), told, "{notes:?}");
            assert!(
                notes.iter().all(|n| n.starts_with("v: fine: not checked") && n.contains("e 2.0")),
                "{notes:?}"
            );
        }
    }

    #[test]
    fn an_unknown_name_is_told_with_the_closest() {
        let error = Suite::new(&["hydrostatics".into()], &Setup::default()).err().unwrap().to_string();
        assert!(error.contains("did you mean `hydrostatic`"), "{error}");
    }
}
