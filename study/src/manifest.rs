//! What `collect` needs to know of a study: `study.json` in its folder. It holds all of it, so that parts may be copied from the
//! machines that computed them, without the files that the study named there.

use super::Study;
use super::builtin;
use super::definition::{Definition, Setup, files_of};
use super::engine::Processor;
use super::row::told;
use seixo::error::{Error, Result};
use seixo::output::write_whole;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A study as it was asked for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// A study file, or the name of a built-in study.
    what: String,
    /// The text of a study file.
    text: Option<String>,
    /// The texts of the files that it is held against, by name.
    #[serde(default)]
    references: BTreeMap<String, String>,
    full: bool,
    sets: Vec<String>,
    gpu: bool,
    /// Its points, in the order of the sweep.
    #[serde(default)]
    points: Vec<Listed>,
}

/// A point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Listed {
    /// Hash of everything that its result depends on.
    pub hash: String,
    /// What it is, in words.
    pub point: String,
}

impl Manifest {
    /// Of the study file or built-in study `what` with `setup`, and the study.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is no such study, [`Error::Case`] for what is wrong with it.
    pub fn new(what: &str, setup: &Setup) -> Result<(Self, Study)> {
        let path = Path::new(what);
        let (mut text, mut references) = (None, BTreeMap::new());
        let study = if path.extension().is_some_and(|e| e == "toml") {
            let read = std::fs::read_to_string(path).map_err(|e| match e.kind() {
                std::io::ErrorKind::NotFound => {
                    Error::usage("study", format!("no study file at `{}`", path.display()))
                }
                _ => Error::io(path)(e),
            })?;
            let folder = path.parent().unwrap_or(Path::new(""));
            let files = files_of(folder);
            let study = builtin::from_file(what, &read, &files, folder, setup)?;
            references = builtin::references(&Definition::parse(what, &read)?, &files)?;
            text = Some(read);
            study
        } else {
            builtin::find(what, setup)?
        };
        let listed = study.jobs.iter().map(|job| {
            let parts: Vec<String> = job.parameters.iter().map(|(k, v)| format!("{k} = {v}")).collect();
            Listed { hash: job.hash(&study.name), point: told(&job.method, &parts.join(", ")) }
        });
        let manifest = Self {
            what: what.into(),
            text,
            references,
            full: setup.full,
            sets: setup.sets.clone(),
            gpu: setup.processor == Processor::Gpu,
            points: listed.collect(),
        };
        Ok((manifest, study))
    }

    /// That of all parts in `folders`, and the study, with no points to compute.
    ///
    /// # Errors
    /// [`Error::Usage`] if they are not parts of one study, in words that name both.
    pub fn joined(folders: &[PathBuf]) -> Result<(Self, Study)> {
        let first = folders.first().ok_or_else(|| {
            let text = "collect: name the folders to join, e.g. seixo study collect part-1 part-2";
            Error::usage("collect", text)
        })?;
        let mut whole = Self::read(first)?;
        for folder in &folders[1..] {
            let part = Self::read(folder)?;
            if let Some(why) = whole.apart(&part) {
                let (first, folder) = (first.display(), folder.display());
                let text = format!("collect: {first} and {folder} hold parts of different studies: {why}");
                return Err(Error::usage("collect", text));
            }
            let full = whole.full || part.full;
            let more = if part.points.len() > whole.points.len() { part } else { whole };
            whole = Self { full, ..more };
        }
        let study = match &whole.text {
            Some(text) => {
                let definition = Definition::parse(&whole.what, text)?;
                builtin::of_points(definition, whole.references.clone())
            }
            None => {
                let processor = if whole.gpu { Processor::Gpu } else { Processor::Cpu };
                let setup = Setup { full: whole.full, sets: whole.sets.clone(), processor, runs: 0 };
                Study { jobs: Vec::new(), ..builtin::find(&whole.what, &setup)? }
            }
        };
        Ok((whole, study))
    }

    /// Why `other` is no part of the same study, if it is none: of a file with the same text, wherever it lay, or of the same
    /// built-in one, with the same points but for those of `--full`.
    fn apart(&self, other: &Self) -> Option<String> {
        let named = |m: &Self| if m.text.is_some() { String::new() } else { m.what.clone() };
        let sets = |m: &Self| match m.sets.join(" --set ") {
            none if none.is_empty() => "no --set".to_owned(),
            sets => format!("--set {sets}"),
        };
        let place = |m: &Self| if m.gpu { "--backend gpu" } else { "the CPU" };
        let (less, more) = if self.points.len() < other.points.len() { (self, other) } else { (other, self) };
        if self.text != other.text || named(self) != named(other) {
            Some("the study file, or the name of the study, is not the same".into())
        } else if self.sets != other.sets {
            Some(format!("the one was computed with {}, the other with {}", sets(self), sets(other)))
        } else if self.gpu != other.gpu {
            Some(format!("the one was computed with {}, the other with {}", place(self), place(other)))
        } else if self.references != other.references {
            Some("a file that it is held against was another one".into())
        } else {
            let point = less.points.iter().find(|p| !more.points.contains(p))?;
            Some(format!("the case, or a file that it names, was another one, e.g. of {}", point.point))
        }
    }

    fn read(folder: &Path) -> Result<Self> {
        let path = folder.join("study.json");
        let text = std::fs::read_to_string(&path).map_err(|_| {
            Error::usage("collect", format!("`{}` holds no study (no study.json)", folder.display()))
        })?;
        let read: Self = serde_json::from_str(&text)
            .map_err(|e| Error::file(path.display().to_string(), "", format!("{}: {e}", path.display())))?;
        if read.points.is_empty() {
            let text = format!(
                "collect: {} lists no points, it is of an earlier version of seixo: start the study in `{}` once more, as \
                 before",
                path.display(),
                folder.display()
            );
            return Err(Error::usage("collect", text));
        }
        Ok(read)
    }

    /// Writes it into `folder`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
        let text = serde_json::to_string_pretty(self).unwrap_or_default() + "\n";
        write_whole(&folder.join("study.json"), text.as_bytes())
    }

    /// The points.
    pub fn points(&self) -> &[Listed] {
        &self.points
    }
}
