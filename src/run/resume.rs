//! What an earlier run left in a folder, and whether another one may go on with it.

use super::from::is_of_scene;
use super::meshes::by_content;
use crate::case::Case;
use crate::case::file::parse;
use crate::checkpoint::Found;
use crate::checkpoint::file::newest;
use crate::error::{Error, FolderError, Result};
use crate::output::folder::{case_name, checkpoints};
use std::path::{Path, PathBuf};

/// What a folder holds.
#[derive(Debug)]
pub enum Standing {
    /// No run.
    Nothing,
    /// A run that reached its end: what it says of itself (`result.json`).
    Done(String),
    /// A run that was stopped before it saved anything: it starts again.
    Lost,
    /// A run that was stopped, in the state that it saved last.
    Stopped(Box<Found>),
}

/// What `root` holds of a run of `case`.
///
/// # Errors
/// [`Error::Folder`] if the run there is one of another case, naming the keys; [`Error::Senseless`] if it diverged, which
/// it would do again; [`Error::Checkpoint`] if all its states are damaged; [`Error::Io`].
pub fn standing(root: &Path, case: &Case) -> Result<Standing> {
    if case_name(root)?.is_none() {
        return Ok(Standing::Nothing);
    }
    let mut files = case.clone();
    if let Some((key, file)) = files.files().into_iter().find(|(_, file)| !Path::new(file).exists()) {
        let message = format!("{key}: {file} is gone");
        let remedy = format!("the results have a copy: go on with `seixo run --resume {}`", root.display());
        return Err(Error::key(key, message, remedy));
    }
    if let Ok(text) = std::fs::read_to_string(root.join("case.toml"))
        && let Ok((old, ..)) = parse("case.toml", text, &[])
    {
        same(root, &old, case)?;
    }
    if let Ok(text) = std::fs::read_to_string(root.join("result.json"))
        && let Ok(result) = serde_json::from_str::<serde_json::Value>(&text)
    {
        match (result["status"].as_str(), result["time_s"].as_f64()) {
            (Some("done"), Some(time)) if time >= case.run.end * (1.0 - 1e-6) - 1e-6 * case.run.time_step => {
                return Ok(Standing::Done(text));
            }
            (Some("diverged"), _) => {
                let why = result["exit_reason"].as_str().unwrap_or("diverged");
                let remedy = match state_in(root, case) {
                    Some(from) => {
                        format!("start another case from its last good state with run.from = {from:?}")
                    }
                    None => {
                        "no state of it goes before run.end, so change the case and start again with --force"
                            .into()
                    }
                };
                return Err(Error::Senseless(format!(
                    "the run in {} {why}; gone on with, it would do so again: {remedy}",
                    root.display(),
                )));
            }
            _ => {}
        }
    }
    let Some(found) = newest(&checkpoints(root))? else { return Ok(Standing::Lost) };
    let (old, ..) = parse("checkpoint", found.origin.case.clone(), &[])?;
    same(root, &old, case)?;
    Ok(Standing::Stopped(Box::new(found)))
}

/// Refuses a case that is another one than that of the run in `root`.
fn same(root: &Path, old: &Case, new: &Case) -> Result<()> {
    let changed = changed(old, new);
    if changed.is_empty() {
        return Ok(());
    }
    // The state of another scene is none that it could begin with.
    let from = if changed.iter().any(|c| is_of_scene(c)) { None } else { state_in(root, new) };
    Err(FolderError::OtherCase { folder: root.to_path_buf(), changed, from }.into())
}

/// The folder `root` as `run.from` names it wherever the case lies, if the run there has saved a state from before the end of `case`.
fn state_in(root: &Path, case: &Case) -> Option<PathBuf> {
    let found = newest(&checkpoints(root)).ok()??;
    std::path::absolute(root).ok().filter(|_| found.origin.time < case.run.end)
}

/// Keys with other values, each with both of them.
pub(super) fn changed(old: &Case, new: &Case) -> Vec<String> {
    let plain = |case: &Case| {
        // When states are saved changes nothing about them.
        let mut case = by_content(case.as_written());
        case.run.checkpoint = Default::default();
        case.run.from = None;
        toml::Value::try_from(case).ok()
    };
    let mut found = Vec::new();
    compare("", plain(old).as_ref(), plain(new).as_ref(), &mut found);
    found
}

fn compare(path: &str, old: Option<&toml::Value>, new: Option<&toml::Value>, found: &mut Vec<String>) {
    use toml::Value::{Array, Table};
    let join = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match (old, new) {
        (Some(Table(a)), Some(Table(b))) => {
            let keys: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
            keys.into_iter().for_each(|k| compare(&join(k), a.get(k), b.get(k), found));
        }
        (Some(Array(a)), Some(Array(b))) if a.len() == b.len() => {
            a.iter()
                .zip(b)
                .enumerate()
                .for_each(|(k, (a, b))| compare(&join(&k.to_string()), Some(a), Some(b), found));
        }
        (Some(a), Some(b)) if a == b => {}
        _ => found.push(counts(path, old, new).unwrap_or_else(|| {
            let shown = |value: Option<&toml::Value>| match value {
                None => "absent".to_owned(),
                Some(Table(_) | Array(_)) => "other".to_owned(),
                Some(value) => value.to_string(),
            };
            format!("{path} was {}, is {}", shown(old), shown(new))
        })),
    }
}

/// What is said of lists of tables of other lengths: these, and the names that one has and the other lacks.
fn counts(path: &str, old: Option<&toml::Value>, new: Option<&toml::Value>) -> Option<String> {
    let list = |value: Option<&toml::Value>| match value {
        None => Some(vec![]),
        Some(toml::Value::Array(all)) => all.iter().map(|v| v.as_table().cloned()).collect(),
        Some(_) => None,
    };
    let (old, new): (Vec<toml::Table>, Vec<toml::Table>) = (list(old)?, list(new)?);
    let names = |of: &[toml::Table]| -> Vec<String> {
        of.iter().filter_map(|table| Some(table.get("name")?.as_str()?.to_owned())).collect()
    };
    let (had, has) = (names(&old), names(&new));
    let gone = had.iter().filter(|name| !has.contains(name)).map(|name| format!("`{name}` is missing"));
    let more = has.iter().filter(|name| !had.contains(name)).map(|name| format!("`{name}` is new"));
    let told: Vec<String> = gone.chain(more).take(NAMED).collect();
    let told = if told.is_empty() { String::new() } else { format!(": {}", told.join(", ")) };
    Some(format!("{path} {HAD} {}, has {}{told}", old.len(), new.len()))
}

/// Names that are told of a list with others.
const NAMED: usize = 4;
/// The word after the key of a list that has become longer or shorter.
pub(super) const HAD: &str = "had";

#[cfg(test)]
mod tests {
    use super::compare;

    #[test]
    fn a_list_that_is_longer_or_shorter_is_told_with_the_names() {
        let told = |old: &str, new: &str| {
            let [old, new] = [old, new].map(|text| toml::Value::Table(toml::from_str(text).unwrap()));
            let mut found = vec![];
            compare("", Some(&old), Some(&new), &mut found);
            found
        };
        let [a, c, e] = ["a", "c", "e"].map(|name| format!("[[body]]\nname = \"{name}\"\n"));
        for (old, new, wanted) in [
            (a.clone() + &c, a.clone(), "body had 2, has 1: `c` is missing"),
            (a.clone() + &c, e.clone() + &a + &c, "body had 2, has 3: `e` is new"),
            (a.clone() + &c, e.clone(), "body had 2, has 1: `a` is missing, `c` is missing, `e` is new"),
            (String::new(), e, "body had 0, has 1: `e` is new"),
            ("block = [{ x = 1 }, { x = 2 }]".into(), "block = [{ x = 1 }]".into(), "block had 2, has 1"),
            ("motion = [[0, 1]]".into(), "motion = [[0, 1], [1, 2]]".into(), "motion was other, is other"),
            ("open = []".into(), "open = [\"z_max\"]".into(), "open was other, is other"),
        ] {
            assert_eq!(told(&old, &new), [wanted]);
        }
    }
}
