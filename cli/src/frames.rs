//! The frames of a run: which there are, which are asked for, and which can be read.

use seixo::case::file::load;
use seixo::case::{Case, OutputKind};
use seixo::console::remark;
use seixo::error::{Error, FolderError, Result};
use seixo::output::folder::{case_name, series_in};
use seixo::output::particles::Particles;
use seixo::output::replay::{Frame, flaw, frames, particles};
use std::path::{Path, PathBuf};

/// Part of the interval of frames from which on a time is far from one: more than the step by which it comes late.
const FAR: f64 = 0.1;

/// The frames of the run in `root`.
///
/// # Errors
/// [`FolderError::NoRun`], [`Error::Io`].
pub fn frames_of(root: &Path) -> Result<Vec<Frame>> {
    let none = || FolderError::NoRun(root.to_path_buf());
    let name = case_name(root)?.filter(|n| !n.is_empty()).ok_or_else(none)?;
    listed(root, &name)
}

/// The frames that the list `name` in `root` names; says so if it is cut off.
fn listed(root: &Path, name: &str) -> Result<Vec<Frame>> {
    let list = root.join(format!("{name}.pvd"));
    if let Some(why) = flaw(&list).filter(|_| list.exists()) {
        remark(&format!("warning: {why}: frames that it does not name are left out"));
    }
    frames(root, name)
}

/// Where the frames of `[output]`, or of a series, of the run in `root` lie.
pub fn place(root: &Path, series: Option<&str>) -> PathBuf {
    series.map_or_else(|| root.to_path_buf(), |name| series_in(root, name))
}

/// The case of the run in `root`, and the frames of its `[output]`; with `series` those of that one, and what it
/// chose stands in the case as the choice of `[output]`.
///
/// # Errors
/// As [`frames_of`]; [`Error::Usage`] if the case has no such series.
pub fn series_of(root: &Path, series: Option<&str>) -> Result<(Case, Vec<Frame>)> {
    let Some(name) = series else {
        let frames = frames_of(root)?;
        return Ok((load(&root.join("case.toml"), None, &[])?.case, frames));
    };
    if case_name(root)?.is_none() {
        return Err(FolderError::NoRun(root.to_path_buf()).into());
    }
    let mut case = load(&root.join("case.toml"), None, &[])?.case;
    let Some(named) = case.output.series.iter().find(|s| s.name == name).cloned() else {
        let names: Vec<&str> = case.output.series.iter().map(|s| s.name.as_str()).collect();
        let there = if names.is_empty() { "none".into() } else { names.join(", ") };
        let text = format!(
            "the case of {} has no output.series called `{name}`; there are: {there}",
            root.display()
        );
        return Err(Error::usage("--series", text));
    };
    let output = &mut case.output;
    (output.every, output.kinds, output.fields, output.region) =
        (named.every, named.kinds, named.fields, named.region);
    let frames = listed(&series_in(root, name), name)?;
    Ok((case, frames))
}

/// The error of a run in `root` without `frames` ("frames", "frames with water"), and why there are none.
pub fn without(frames: &str, root: &Path, case: &Case, series: Option<&str>) -> Error {
    let others = case.output.series.first().filter(|_| series.is_none());
    let others = others.map_or(String::new(), |s| format!("; its series has its own: --series {}", s.name));
    let output = &case.output;
    let wet = frames.contains("water");
    let list = list_of(root, series);
    let why = if output.every == 0.0 {
        "the case has output.every = 0".to_owned()
    } else if wet && case.fluid.is_none() {
        "the case has no water".to_owned()
    } else if wet && !output.kinds.contains(&OutputKind::Fluid) {
        "output.kinds leaves it out".to_owned()
    } else if std::fs::read_to_string(&list).is_ok_and(|text| text.contains("<DataSet ")) {
        format!("the files that {} names cannot be read any more", list.display())
    } else {
        format!("the list of them, {}, is gone or names none", list.display())
    };
    Error::usage("DIR", format!("{} holds no {frames}: {why}{others}", root.display()))
}

/// The list of the frames of the run in `root`, or of a series of it.
fn list_of(root: &Path, series: Option<&str>) -> PathBuf {
    let name = series.map(str::to_owned).or_else(|| case_name(root).ok().flatten()).unwrap_or_default();
    place(root, series).join(format!("{name}.pvd"))
}

/// The frames of `all` nearest to each of `times`, each once, or every `every`th, with their numbers; says so where a
/// time is far from all of them.
pub fn chosen(case: &Case, all: &[Frame], times: &[f64], every: u32) -> Vec<(usize, Frame)> {
    let nearest = |t: &f64| {
        let distance = |k: &usize| (all[*k].time - t).abs();
        (0..all.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    let picked: Vec<usize> = if times.is_empty() {
        (0..all.len()).step_by(every as usize).collect()
    } else {
        times.iter().filter_map(nearest).collect()
    };
    let far = |(t, k): &(&f64, &usize)| (*t - all[**k].time).abs() > FAR * case.output.every;
    let far: Vec<(&f64, &usize)> = times.iter().zip(&picked).filter(far).collect();
    if !far.is_empty() {
        let listed = |all: Vec<f64>| all.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
        let rounded = |k: &usize| (1e4 * all[*k].time).round() / 1e4;
        let (asked, there) = (far.iter().map(|f| *f.0).collect(), far.iter().map(|f| rounded(f.1)).collect());
        let (asked, there) = (listed(asked), listed(there));
        remark(&format!("note: no frame is at {asked} s (--times): the nearest is taken, at {there} s"));
    }
    let mut taken = std::collections::HashSet::new();
    let once = picked.into_iter().filter(|&k| taken.insert(k));
    let there = once.filter(|&k| is_there(k, &all[k]));
    there.map(|k| (k, all[k].clone())).collect()
}

/// Whether the files of frame number `k` are there and end as they should; says so if one does not.
pub fn is_there(k: usize, frame: &Frame) -> bool {
    let why = [&frame.fluid, &frame.solids].into_iter().flatten().find_map(|path| flaw(path));
    if let Some(why) = &why {
        left_out(k, why);
    }
    why.is_none()
}

/// What a file of frame number `k` holds; says so if it cannot be read: what is damaged inside shows only then.
pub fn held(k: usize, file: &Path) -> Option<Particles> {
    particles(file).map_err(|why| left_out(k, &why.to_string())).ok()
}

fn left_out(k: usize, why: &str) {
    remark(&format!("warning: frame {k} is left out: {why}"));
}
