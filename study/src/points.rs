//! The points of a study: every combination of its axes' values, each as a job.

use super::definition::{Axis, Definition, Files, Grid};
use super::engine::{Job, Processor};
use super::measure::Spec;
use super::record::curves;
use super::result_number::ResultNumber;
use super::row::Measured;
use super::run_point::{Point, run};
use seixo::case::file::{load_text, parse};
use seixo::error::{Error, Result};
use seixo::run::{from, named_by_content};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What the command line adds to a study.
#[derive(Clone, Debug, Default)]
pub struct Setup {
    /// Also the costly points.
    pub full: bool,
    /// Overrides of the case, `key=value`.
    pub sets: Vec<String>,
    /// Where points compute that do not say.
    pub processor: Processor,
    /// Jittered starts of each point; 0 for the one on the lattice.
    pub runs: u32,
}

/// Displacement of the particles of jittered starts over the spacing [-]: enough for runs to part, too little to be
/// seen at t = 0.
const JITTER: f64 = 0.02;

/// One value of an axis.
#[derive(Clone, Debug)]
pub(super) struct Pick {
    axis: String,
    pub name: String,
    set: Vec<String>,
    processor: Option<Processor>,
}

impl Axis {
    /// Its values, with `full` the costly ones as well.
    pub(super) fn picks(&self, full: bool) -> Result<Vec<Pick>> {
        let pick = |name: String, set, processor| Pick { axis: self.name.clone(), name, set, processor };
        let mut picks = Vec::new();
        if let Some(key) = &self.key {
            let more: &[toml::Value] = if full { &self.full_values } else { &[] };
            for value in self.values.iter().chain(more) {
                let name = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
                picks.push(pick(name, vec![format!("{key}={value}")], None));
            }
        }
        for choice in self.choices.iter().filter(|c| full || !c.full) {
            picks.push(pick(choice.name.clone(), choice.set.clone(), choice.processor));
        }
        if picks.is_empty() {
            let name = &self.name;
            return Err(Error::key(
                "axis",
                format!("axis `{name}`: give `key` with `values`, or `choices`"),
                "",
            ));
        }
        Ok(picks)
    }
}

impl Definition {
    /// The case of a study that lies in `folder`: the file that it stands for, beside which are those that it names, and its text.
    ///
    /// # Errors
    /// Those of `files`.
    fn case_text(&self, files: &Files, folder: &Path) -> Result<(PathBuf, String)> {
        match (&self.text, &self.case) {
            (Some(text), _) => Ok((folder.join(&self.name), text.clone())),
            (None, Some(case)) => Ok((folder.join(case), files(case)?)),
            (None, None) => Err(Error::key("case", format!("study `{}` has no case", self.name), "")),
        }
    }

    /// The points of a study that lies in `folder`. Overrides of the command line come after those of the study and before those of the axes. A
    /// point whose case is refused is a point that fails.
    ///
    /// # Errors
    /// [`Error::Case`] for a case that cannot be read, an axis without values, a method that names what is no axis, a study without
    /// points, and if every point is refused: that is a mistake in the study, and not a finding.
    pub fn jobs(&self, files: &Files, folder: &Path, setup: &Setup) -> Result<Vec<Job>> {
        let full = setup.full;
        let (path, text) = self.case_text(files, folder)?;
        let case = (path.as_path(), text.as_str());
        // A dry scene has nothing to jitter.
        let wet = load_text(&path, text.clone(), None, &self.set).is_ok_and(|read| read.case.fluid.is_some());
        let runs = if wet { setup.runs } else { 0 };
        let mut jobs: Vec<(Job, Option<Error>)> = Vec::new();
        // A study that varies nothing is of one point.
        let main = (!self.axis.is_empty() || self.grid.is_empty()).then(|| Grid {
            method: None,
            full: false,
            axis: self.axis.clone(),
        });
        for grid in main.iter().chain(&self.grid).filter(|g| full || !g.full) {
            let method = grid.method.as_ref().unwrap_or(&self.method);
            self.names_axes(method, &grid.axis)?;
            let mut points: Vec<Vec<Pick>> = vec![Vec::new()];
            for axis in &grid.axis {
                let picks = axis.picks(full)?;
                let with = |point: &Vec<Pick>| {
                    let point = point.clone();
                    picks.clone().into_iter().map(move |p| [point.clone(), vec![p]].concat())
                };
                points = points.iter().flat_map(with).collect();
            }
            for picks in points {
                if runs == 0 {
                    jobs.push(self.job(case, method, &picks, setup));
                }
                for seed in 1..=runs {
                    let start = Pick {
                        axis: "run".into(),
                        name: seed.to_string(),
                        set: vec![format!("fluid.jitter={JITTER}"), format!("fluid.seed={seed}")],
                        processor: None,
                    };
                    jobs.push(self.job(case, method, &[picks.clone(), vec![start]].concat(), setup));
                }
            }
        }
        if jobs.is_empty() {
            let text = format!("study `{}`: all of its grids are for --full alone", self.name);
            return Err(Error::key("grid", text, "run it with --full, or give an [[axis]]"));
        }
        if let Some((_, Some(_))) = jobs.first()
            && jobs.iter().all(|(_, refused)| refused.is_some())
        {
            let first = jobs.swap_remove(0).1.map_or(String::new(), |e| e.to_string());
            let text = format!(
                "study `{}`: the case of every point is refused; that of the first:\n{first}",
                self.name
            );
            return Err(Error::key("axis", text, ""));
        }
        Ok(jobs.into_iter().map(|(job, _)| job).collect())
    }

    /// Refuses a `method` with a name in braces that is none of `axes`.
    fn names_axes(&self, method: &str, axes: &[Axis]) -> Result<()> {
        let named = method.split('{').skip(1).filter_map(|rest| rest.split_once('}')).map(|(name, _)| name);
        let names: Vec<&str> = axes.iter().map(|a| a.name.as_str()).collect();
        match named.into_iter().find(|name| !names.contains(name)) {
            None => Ok(()),
            Some(name) => {
                let text = format!("method: there is no axis `{name}`; there are {}", names.join(", "));
                Err(Error::key("method", text, ""))
            }
        }
    }

    /// A point of the case with this path and text, and why it is refused, if it is.
    fn job(
        &self,
        (path, text): (&Path, &str),
        method: &str,
        picks: &[Pick],
        setup: &Setup,
    ) -> (Job, Option<Error>) {
        let all = self.set.iter().chain(&setup.sets).chain(picks.iter().flat_map(|p| &p.set));
        let all: Vec<String> = all.cloned().collect();
        let mut method = method.to_owned();
        for pick in picks {
            method = method.replace(&format!("{{{}}}", pick.axis), &pick.name);
        }
        let processor = picks.iter().find_map(|p| p.processor).unwrap_or(setup.processor);
        // The text to run names meshes by their place, that which the result depends on by what they hold.
        let read = load_text(path, text.to_owned(), None, &all).and_then(|read| {
            from::refuse(&read, "a point of a study", "leave it out")?;
            Ok((named_by_content(&read.case, &read.text)?, read))
        });
        // Particles go with the spacing to the power of the dimensions; steps with the end over the time step.
        let weight = read.as_ref().map_or(0.0, |(_, read)| {
            let run = &read.case.run;
            let steps = run.end / run.time_step;
            steps * run.spacing.powi(-(run.dimensions as i32))
        });
        let (effective, refused) = match read {
            Ok((content, read)) => (Ok((content, read.text)), None),
            Err(e) => (Err(e.to_string()), Some(e)),
        };
        let parameters = picks.iter().map(|p| (p.axis.clone(), p.name.clone())).collect();
        let identity = match &effective {
            Ok((content, _)) => {
                let told = if self.result.is_empty() { String::new() } else { format!(" {:?}", self.result) };
                format!("{content}\n{:?} {processor:?} {:?}{told}", self.measure, self.limit)
            }
            Err(error) => format!("{error} {all:?}"),
        };
        let (spec, limits, repetitions) = (self.measure.clone(), self.limit.clone(), self.repetitions);
        let results = self.result.clone();
        let text = effective.as_ref().ok().map(|(_, text)| text.clone());
        let (measure, asked) = (self.measure.clone(), self.result.clone());
        let names = {
            let (text, measure) = (text.clone(), measure.clone());
            move || curves_of(text.as_deref()?, &measure)
        };
        let fault = move || lacks(text.as_deref()?, &measure, &asked);
        let job = Job {
            method,
            parameters,
            identity,
            weight,
            fault: Box::new(fault),
            curves: Box::new(names),
            task: Box::new(move |context| {
                let text = match &effective {
                    Ok((_, text)) => text.clone(),
                    Err(error) => return Err(Error::file("case", "", error)),
                };
                // A mistake of the study and not of the case: the point need not be tried again before the study is another.
                if let Some(error) = lacks(&text, &spec, &results) {
                    return Ok(Measured::failed(&error));
                }
                let mut out = run(&Point { text, spec: spec.clone(), processor, repetitions }, context)?;
                results.iter().for_each(|result| result.put(&mut out));
                limits.iter().for_each(|(name, most)| out.limit(name, *most));
                Ok(out)
            }),
        };
        (job, refused)
    }
}

/// What is wrong with the first of `results` that asks for a curve which the case in `text`, measured by `spec`, has not.
fn lacks(text: &str, spec: &Spec, results: &[ResultNumber]) -> Option<Error> {
    if results.is_empty() {
        return None;
    }
    let curves = curves_of(text, spec)?;
    results.iter().find_map(|result| result.lacks(&curves))
}

/// Names of the curves of the case in `text`, measured by `spec`; nothing of a case that is refused, which says more.
fn curves_of(text: &str, spec: &Spec) -> Option<BTreeSet<String>> {
    let (case, _, _) = parse("case", text.to_owned(), &[]).ok()?;
    curves(spec, &case).ok()
}

#[cfg(test)]
mod tests {
    use super::{Definition, Setup};
    use crate::definition::tests::STUDY;
    use std::path::Path;

    #[test]
    fn the_grid_is_the_product_of_the_axes_and_each_point_has_its_own_hash() {
        let study = Definition::parse("s.toml", STUDY).unwrap();
        let none = |_: &str| unreachable!();
        let quick = study.jobs(&none, Path::new(""), &Setup::default()).unwrap();
        let methods: Vec<&str> = quick.iter().map(|j| j.method.as_str()).collect();
        assert_eq!(methods, ["1.0 at x", "2.0 at x"]);
        let full = study.jobs(&none, Path::new(""), &Setup { full: true, ..Setup::default() }).unwrap();
        assert_eq!(full.len(), 6);
        let mut hashes: Vec<String> = full.iter().map(|j| j.hash("s")).collect();
        assert!(hashes.contains(&quick[0].hash("s")), "--full computes the quick points again");
        hashes.sort();
        hashes.dedup();
        assert_eq!(hashes.len(), 6);
        let other = study
            .jobs(
                &none,
                Path::new(""),
                &Setup { sets: vec!["run.gravity=[0,0,0]".into()], ..Setup::default() },
            )
            .unwrap();
        assert_ne!(other[0].hash("s"), quick[0].hash("s"));
    }

    #[test]
    fn a_study_that_varies_nothing_is_of_one_point_and_one_without_points_is_refused() {
        let none = |_: &str| unreachable!();
        let head = STUDY.split("[[axis]]").next().unwrap().replace("{a} at {b}", "m");
        let points = |more: &str, full: bool| {
            let study =
                Definition::parse("s.toml", &format!("{head}{more}[[error]]\nvalue = \"e [-]\"\n")).unwrap();
            study.jobs(&none, Path::new(""), &Setup { full, ..Setup::default() })
        };
        assert_eq!(points("", false).unwrap().len(), 1);
        let grid = "[[grid]]\nfull = true\naxis = [{ name = \"e\", key = \"run.end\", values = [1, 2] }]\n";
        assert_eq!(points(grid, true).unwrap().len(), 2);
        let refused = points(grid, false).err().expect("there is no point").to_string();
        assert!(refused.contains("--full"), "{refused}");
    }

    #[test]
    fn every_point_of_what_comes_with_the_program_is_a_valid_case() {
        for folder in ["study", "validation"] {
            for name in crate::cases::names(folder) {
                let text = crate::cases::text(folder, &format!("{name}.toml")).unwrap();
                let definition = Definition::parse(name, &text).unwrap();
                let file = |file: &str| crate::cases::text(folder, file);
                let setup = Setup { full: true, runs: 2, ..Setup::default() };
                for job in definition.jobs(&file, Path::new(""), &setup).unwrap() {
                    assert!(job.weight > 0.0, "{folder}/{name}, {:?}: its case is refused", job.parameters);
                }
            }
        }
    }
}
