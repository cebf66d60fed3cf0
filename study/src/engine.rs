//! Runs the points of a study: each once, each kept, in any order, on any number of machines.
//!
//! A finished point is the file `points/HASH.json`, written by rename; the hash is that of everything its result
//! depends on. A sweep that was killed goes on where it stopped, shards of one sweep share the folder or are
//! joined later, and a changed case computes only what changed.

use super::kept::{VERSION, gather, json, point, read, told_of_kept};
use super::row::{Class, FORMAT, Measured, Row, hash, told};
use seixo::backend::Backend;
use seixo::backend::cpu::Cpu;
use seixo::console::remark;
use seixo::error::{Error, GpuError, Result};
use seixo::output::lock::{Beside, hold};
use seixo::output::write_whole;
use seixo::params::Params;
use seixo::plan::Plan;
use seixo::pressure::Settings;
use seixo::scene::Scene;
use seixo::stop::Stop;
use std::collections::BTreeSet;
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Where a point computes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Processor {
    /// The CPU, in f64.
    #[default]
    Cpu,
    /// A GPU, in f32.
    Gpu,
}

/// Makes backends.
pub type Make<'a> =
    dyn Fn(Processor, &Scene, &Params, &Plan, Settings) -> Result<Box<dyn Backend>> + Sync + 'a;

/// Backends on the CPU; a GPU is an error.
///
/// # Errors
/// [`Error::Gpu`] for a GPU, or what the backend says.
pub fn cpu_only(
    processor: Processor,
    scene: &Scene,
    params: &Params,
    plan: &Plan,
    settings: Settings,
) -> Result<Box<dyn Backend>> {
    match processor {
        Processor::Cpu => Ok(Box::new(Cpu::new(scene, params, plan, settings)?)),
        Processor::Gpu => Err(GpuError::NoAdapter("no GPU adapter to compute on".into()).into()),
    }
}

/// What the points of a study are given.
pub struct Context<'a> {
    /// Makes backends.
    pub make: &'a Make<'a>,
    /// How often a run is repeated for its time; 0 for what the study asks for.
    pub repetitions: u32,
    /// Asks the sweep to end early.
    pub stop: Stop,
    /// Wall-clock time between the states that a point keeps of its run.
    pub save_every: Duration,
    /// Where the point at work keeps them; nowhere without a folder.
    pub states: Option<PathBuf>,
}

impl<'a> Context<'a> {
    /// A context whose points keep no states and are not asked to end.
    pub fn new(make: &'a Make<'a>) -> Self {
        Self { make, repetitions: 0, stop: Stop::default(), save_every: SAVE_EVERY, states: None }
    }
}

/// Wall-clock time between the states that a point keeps of its run, unless said otherwise.
pub const SAVE_EVERY: Duration = Duration::from_secs(60);

/// What a point does.
pub type Task = Box<dyn Fn(&Context) -> Result<Measured> + Send + Sync>;

/// What a study itself has wrong, as a point shows before it is computed; nothing where it is right, or the point's own case is wrong.
pub type Fault = Box<dyn Fn() -> Option<Error> + Send + Sync>;
/// Finds the names of a point's curves; dear, for it builds the scene.
pub type Curves = Box<dyn Fn() -> Option<BTreeSet<String>> + Send + Sync>;

/// A point that is to be computed.
pub struct Job {
    /// Line of the plot that it belongs to.
    pub method: String,
    /// What is varied.
    pub parameters: Vec<(String, String)>,
    /// Everything that the result depends on: the case's text with overrides, the measures.
    pub identity: String,
    /// Expected cost against that of other points, for the remaining time.
    pub weight: f64,
    /// What the study has wrong.
    pub fault: Fault,
    /// Names of the curves that it measures; nothing where that is not known.
    pub curves: Curves,
    /// The computation.
    pub task: Task,
}

impl Job {
    /// A point whose result depends on `study`, `method` and `parameters` alone.
    pub fn new(
        method: &str,
        parameters: &[(&str, String)],
        weight: f64,
        task: impl Fn(&Context) -> Result<Measured> + Send + Sync + 'static,
    ) -> Self {
        let parameters: Vec<(String, String)> =
            parameters.iter().map(|(k, v)| ((*k).to_string(), v.clone())).collect();
        let identity = format!("{parameters:?}");
        let (fault, curves) = (Box::new(|| None), Box::new(|| None));
        Self { method: method.into(), parameters, identity, weight, fault, curves, task: Box::new(task) }
    }

    /// Hash of everything that the result depends on.
    pub fn hash(&self, study: &str) -> String {
        hash(&[&FORMAT.to_string(), study, &self.method, &self.identity])
    }
}

/// Which part of the points to compute: number `index` (from 1) of `of`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    pub index: usize,
    /// Number of shards.
    pub of: usize,
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let wrong = || format!("`{text}`: expected i/n with i from 1 to n, e.g. 2/8");
        let (i, n) = text.split_once('/').ok_or_else(wrong)?;
        let (index, of) = (i.trim().parse().map_err(|_| wrong())?, n.trim().parse().map_err(|_| wrong())?);
        if index >= 1 && index <= of { Ok(Self { index, of }) } else { Err(wrong()) }
    }
}

impl Shard {
    fn has(self, k: usize) -> bool {
        k % self.of == self.index - 1
    }
}

/// How a sweep goes.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Folder of the results.
    pub out: PathBuf,
    /// Part of the points; all if absent.
    pub shard: Option<Shard>,
    /// No progress on stderr.
    pub quiet: bool,
    /// Read finished points only, also from these folders.
    pub collect: Option<Vec<PathBuf>>,
}

/// The file of a folder of results that is locked as long as points are computed into it.
const LOCK: &str = ".seixo-points";

impl Options {
    /// Makes the folder, and holds it until what is returned is dropped: alone, or as a shard with other shards.
    /// Nothing where nothing is computed.
    ///
    /// # Errors
    /// [`Error::Folder`] if points are computed into it already, [`Error::Io`].
    pub fn hold(&self) -> Result<Option<File>> {
        if self.collect.is_some() {
            return Ok(None);
        }
        std::fs::create_dir_all(&self.out).map_err(Error::io(&self.out))?;
        let beside = if self.shard.is_some() { Beside::Others } else { Beside::Nobody };
        hold(&self.out, LOCK, beside).map(Some)
    }
}

/// The first of the `faults` of points if each of them has one: what all of them would fail for is told before the first one runs.
pub fn of_all(mut faults: impl Iterator<Item = Option<Error>>) -> Option<Error> {
    let first = faults.next()??;
    faults.all(|fault| fault.is_some()).then_some(first)
}

/// Rows of the points that are there at the end, in the order of `jobs`.
///
/// # Errors
/// [`Error::Io`], and what every open point shows to be wrong with the study. A point that fails is a row. With `options.collect` nothing is computed, and [`Error::Usage`] if no point is there.
pub fn sweep(study: &str, jobs: &[Job], options: &Options, context: &Context) -> Result<Vec<Row>> {
    let hashes: Vec<String> = jobs.iter().map(|job| job.hash(study)).collect();
    if let Some(others) = &options.collect {
        return gather(&hashes, &options.out, others);
    }
    let folder = options.out.join("points");
    std::fs::create_dir_all(&folder).map_err(Error::io(&folder))?;
    let mine = |k: &usize| options.shard.is_none_or(|s| s.has(*k));
    // What was refused is tried again: a file may be there now.
    let kept = |(k, hash): (usize, &String)| {
        let row = read(&point(&folder, hash), hash).filter(|row| !row.measured.refused)?;
        Some(Row { index: k, ..row })
    };
    let mut rows: Vec<Option<Row>> = hashes.iter().enumerate().map(kept).collect();
    let open: Vec<usize> = (0..jobs.len()).filter(mine).filter(|&k| rows[k].is_none()).collect();
    if let Some(fault) = of_all(open.iter().map(|&k| (jobs[k].fault)())) {
        return Err(fault);
    }
    let total: f64 = open.iter().map(|&k| jobs[k].weight).sum();
    if !options.quiet {
        told_of_kept(study, jobs.len(), &rows.iter().flatten().collect::<Vec<_>>(), context.repetitions);
    }
    let (start, mut done) = (Instant::now(), 0.0);
    for (n, &k) in open.iter().enumerate() {
        let job = &jobs[k];
        if context.stop.is_asked() {
            return Err(Error::Interrupted);
        }
        let states = options.out.join("states").join(&hashes[k]);
        let here = Context {
            states: Some(states.clone()),
            stop: context.stop.clone(),
            repetitions: context.repetitions,
            save_every: context.save_every,
            make: context.make,
        };
        let row = Row {
            format: FORMAT,
            study: study.into(),
            index: k,
            hash: hashes[k].clone(),
            version: VERSION.into(),
            method: job.method.clone(),
            parameters: job.parameters.iter().cloned().collect(),
            measured: attempt(job, &here)?,
        };
        let text = json(&row);
        write_whole(&point(&folder, &row.hash), text.as_bytes())?;
        forget(&states)?;
        done += job.weight;
        if !options.quiet {
            let elapsed = start.elapsed().as_secs_f64();
            let left = elapsed * (total / done.max(1e-300) - 1.0).max(0.0);
            let why = if row.measured.reason.is_empty() { "" } else { ": " };
            let place = format!("{}/{}", n + 1, open.len());
            remark(&format!(
                "{study} [{place}] {}: {}{why}{}  elapsed {elapsed:.0} s, ETA {left:.0} s",
                told(&row.method, &row.setting()),
                row.measured.class.name(),
                first_line(&row.measured.reason),
            ));
        }
        // What is shown is what is in the file, to the last digit.
        rows[k] = serde_json::from_str(&text).ok().or(Some(row));
    }
    let rows: Vec<Row> = rows.into_iter().flatten().collect();
    // Where no point of a whole sweep came to anything, its error says why.
    if options.quiet && (options.shard.is_some() || ended(&rows).is_ok()) {
        told_of_failed(study, &rows).iter().for_each(|line| remark(line));
    }
    Ok(rows)
}

/// Reasons of failed points that are told where no progress is: more of them are findings of the report.
const REASONS: usize = 3;

/// Why those of `rows` failed that did, in words, each reason once.
fn told_of_failed(study: &str, rows: &[Row]) -> Vec<String> {
    let mut failed: Vec<&Row> = rows.iter().filter(|row| !row.measured.has_result()).collect();
    let (all, mut lines) = (rows.len(), Vec::new());
    while let Some(&first) = failed.first() {
        if lines.len() == REASONS {
            lines.push(format!(
                "{study}: {} of {all} points failed for other reasons, see report.md",
                failed.len()
            ));
            break;
        }
        let before = failed.len();
        failed.retain(|row| row.measured.reason != first.measured.reason);
        let (class, reason) = (first.measured.class.name(), first_line(&first.measured.reason));
        let which = told(&first.method, &first.setting());
        lines.push(match before - failed.len() {
            1 => format!("{study}: {which}: {class}: {reason}"),
            same => format!("{study}: {which} and {} more of {all} points: {class}: {reason}", same - 1),
        });
    }
    lines
}

/// Whether any of `rows`, the points of a whole sweep, has a result.
///
/// # Errors
/// If there are points and none has one, why the first has none: [`Error::Gpu`] if all were skipped, [`Error::Usage`] if all were refused, else
/// [`Error::Senseless`].
pub fn ended(rows: &[Row]) -> Result<()> {
    let Some(first) = rows.first().filter(|_| !rows.iter().any(|row| row.measured.has_result())) else {
        return Ok(());
    };
    let which = told(&first.method, &first.setting());
    let (class, reason) = (first.measured.class.name(), &first.measured.reason);
    let text = match rows.len() {
        1 => format!("the only point has no result, {which}: {class}: {reason}"),
        all => format!("none of {all} points has a result; the first, {which}: {class}: {reason}"),
    };
    Err(if rows.iter().all(|row| row.measured.class == Class::Skipped) {
        GpuError::NoAdapter(text).into()
    } else if rows.iter().all(|row| row.measured.refused) {
        Error::usage("study", text)
    } else {
        Error::Senseless(text)
    })
}

/// First line of `text`.
pub(crate) fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or_default()
}

/// The point, or the reason why there is none: a point never takes the sweep with it, unless the sweep was to end.
fn attempt(job: &Job, context: &Context) -> Result<Measured> {
    Ok(match catch_unwind(AssertUnwindSafe(|| (job.task)(context))) {
        Ok(Ok(measured)) => measured,
        Ok(Err(Error::Interrupted)) => return Err(Error::Interrupted),
        Ok(Err(error)) => {
            let refused = matches!(error, Error::Case(_) | Error::Io { .. });
            Measured { refused, ..Measured::failed(&error) }
        }
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
            Measured {
                class: Class::Failed,
                reason: format!("panic, which is a fault of this program: {text}"),
                ..Measured::default()
            }
        }
    })
}

/// Removes the states of a finished point, and the folder of all of them after the last.
fn forget(states: &Path) -> Result<()> {
    if !states.exists() {
        return Ok(());
    }
    seixo::checkpoint::file::remove(states)?;
    for folder in [Some(states), states.parent()].into_iter().flatten() {
        // Somebody else's files, or another point's states, keep their folder.
        let _ = std::fs::remove_dir(folder);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

    fn jobs(count: usize, calls: &Arc<AtomicU32>) -> Vec<Job> {
        let job = |k: usize| {
            let calls = calls.clone();
            Job::new("m", &[("k", k.to_string())], 1.0, move |_| {
                calls.fetch_add(1, Relaxed);
                match k {
                    1 => panic!("on purpose"),
                    2 => Err(Error::usage("k", "no such thing")),
                    _ => {
                        let mut m = Measured::default();
                        m.put("third [-]", k as f64 / 3.0);
                        Ok(m)
                    }
                }
            })
        };
        (0..count).map(job).collect()
    }

    fn run(
        out: &Path,
        shard: Option<&str>,
        collect: Option<Vec<PathBuf>>,
        calls: &Arc<AtomicU32>,
    ) -> Vec<Row> {
        let shard = shard.map(|s| s.parse().unwrap());
        let options = Options { out: out.into(), shard, quiet: true, collect };
        sweep("test", &jobs(5, calls), &options, &Context { repetitions: 1, ..Context::new(&cpu_only) })
            .unwrap()
    }

    #[test]
    fn failures_are_rows_and_finished_points_are_not_computed_again() {
        let (folder, calls) = (tempfile::tempdir().unwrap(), Arc::default());
        let first = run(folder.path(), None, None, &calls);
        assert_eq!(calls.load(Relaxed), 5);
        let classes: Vec<Class> = first.iter().map(|r| r.measured.class).collect();
        assert_eq!(classes, [Class::Ok, Class::Failed, Class::Failed, Class::Ok, Class::Ok]);
        assert!(first[1].measured.reason.contains("on purpose"));
        assert!(first[2].measured.reason.contains("no such thing"));
        let again = run(folder.path(), None, None, &calls);
        assert_eq!(calls.load(Relaxed), 5, "a finished point was computed again");
        assert_eq!(again, first);
        // A point cut off in the middle is computed again, and the table is the same.
        let file = folder.path().join("points").join(format!("{}.json", first[3].hash));
        std::fs::write(&file, "{\"format\": 1, \"stu").unwrap();
        assert_eq!(run(folder.path(), None, None, &calls), first);
        assert_eq!(calls.load(Relaxed), 6);
    }

    #[test]
    fn reasons_are_told_once_and_a_sweep_without_a_result_is_an_error() {
        let row = |class, reason: &str, refused| {
            let measured = Measured { class, reason: reason.into(), refused, ..Measured::default() };
            Row { method: "m".into(), measured, ..Row::default() }
        };
        let failed = |reason: &str| row(Class::Failed, reason, false);
        let some = [failed("a\nb"), row(Class::Degraded, "c", false), failed("a\nb"), failed("d")];
        assert_eq!(told_of_failed("s", &some), ["s: m and 1 more of 4 points: failed: a", "s: m: failed: d"]);
        let many: Vec<Row> = (0..9).map(|k| failed(&k.to_string())).collect();
        let told = told_of_failed("s", &many);
        assert!(told.len() == REASONS + 1 && told[REASONS].contains("6 of 9 points failed"), "{told:?}");
        assert!(ended(&some).is_ok() && ended(&[]).is_ok());
        let code = |rows: &[Row]| ended(rows).unwrap_err().exit_code();
        let (refused, skipped) = (row(Class::Failed, "no file", true), row(Class::Skipped, "no GPU", false));
        let alone = |row: &Row| code(std::slice::from_ref(row));
        assert_eq!([code(&many), alone(&refused), alone(&skipped)], [4, 2, 3]);
        assert_eq!(code(&[refused, skipped]), 4);
    }

    #[test]
    fn what_every_point_shows_to_be_wrong_is_told_before_any_is_computed() {
        let (folder, calls) = (tempfile::tempdir().unwrap(), Arc::default());
        let options = Options { out: folder.path().into(), quiet: true, ..Options::default() };
        let sweep = |wrong: [bool; 2]| {
            let mut jobs = jobs(2, &calls);
            for (job, wrong) in jobs.iter_mut().zip(wrong) {
                job.fault = Box::new(move || wrong.then(|| Error::key("result", "no such curve", "")));
            }
            super::sweep("test", &jobs, &options, &Context::new(&cpu_only))
        };
        assert!(sweep([true; 2]).unwrap_err().to_string().contains("no such curve"));
        assert_eq!(calls.load(Relaxed), 0);
        // One point may have what another has not.
        assert_eq!((sweep([true, false]).unwrap().len(), calls.load(Relaxed)), (2, 2));
    }

    #[test]
    fn what_was_refused_is_tried_again_and_the_version_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let sweep = |there: bool| {
            let gone = || Error::io("hull.stl")(std::io::ErrorKind::NotFound.into());
            let task = move |_: &Context| if there { Ok(Measured::default()) } else { Err(gone()) };
            let options = Options { out: folder.path().into(), quiet: true, ..Options::default() };
            let job = Job::new("m", &[], 1.0, task);
            super::sweep("test", &[job], &options, &Context::new(&cpu_only)).unwrap()
        };
        let row = &sweep(false)[0];
        assert!(row.measured.refused && row.measured.class == Class::Failed && row.version == VERSION);
        assert_eq!(sweep(true)[0].measured.class, Class::Ok);
        // Of another version it is kept, and says so.
        let file = folder.path().join("points").join(format!("{}.json", row.hash));
        let text = std::fs::read_to_string(&file).unwrap();
        std::fs::write(&file, text.replace(&format!("\"{VERSION}\""), "\"0.0.1\"")).unwrap();
        assert_eq!(sweep(false)[0].version, "0.0.1");
    }

    #[test]
    fn a_folder_has_one_sweep_or_many_shards() {
        let folder = tempfile::tempdir().unwrap();
        let hold = |shard: Option<&str>| {
            let shard = shard.map(|s| s.parse().unwrap());
            Options { out: folder.path().join("new"), shard, ..Options::default() }.hold()
        };
        let refused = |shard| hold(shard).unwrap_err().to_string().contains("is in use");
        let whole = hold(None).unwrap();
        assert!(refused(None) && refused(Some("1/2")));
        drop(whole);
        let shards = [hold(Some("1/2")).unwrap(), hold(Some("2/2")).unwrap()];
        assert!(refused(None));
        drop(shards);
        assert!(hold(None).is_ok());
    }

    #[test]
    fn shards_in_folders_of_their_own_are_collected_to_the_whole() {
        let (a, b, c) =
            (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let calls = Arc::default();
        assert_eq!(run(a.path(), Some("1/2"), None, &calls).len(), 3);
        assert_eq!(run(b.path(), Some("2/2"), None, &calls).len(), 2);
        let all = run(a.path(), None, Some(vec![b.path().into()]), &calls);
        assert_eq!(calls.load(Relaxed), 5);
        assert_eq!(all, run(c.path(), None, None, &calls));
        for wrong in ["0/2", "3/2", "1", "a/b", "1/0"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
