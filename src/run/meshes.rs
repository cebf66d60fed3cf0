//! Copies of a case's meshes beside its results, which then need no file that may move or change.
//!
//! A copy is called as its file, with the CRC-32 of what it holds: `meshes/hull-1f3a9c02.stl`. Where such names are the
//! same, so are the meshes.

use crate::case::Case;
use crate::case::file::parse;
use crate::error::{Error, Result};
use crate::output::folder::{Folder, MESHES, is_mesh};
use crate::output::write_whole;
use std::collections::BTreeMap;
use std::path::Path;

/// Meshes on their way to a folder of results.
pub(super) struct Meshes {
    /// Names of the copies and what goes there.
    files: BTreeMap<String, Vec<u8>>,
    /// The case as TOML that names the copies.
    pub text: String,
}

impl Meshes {
    /// Reads the meshes of `case`, whose TOML is `text`.
    ///
    /// # Errors
    /// [`Error::Io`] if one of them is gone.
    pub fn read(case: &Case, text: &str) -> Result<Self> {
        let (mut files, mut sets) = (BTreeMap::new(), Vec::new());
        let mut case = case.clone();
        let mut named = case.files();
        // Copies have one table.
        named.dedup_by(|a, b| a.0 == b.0);
        for (key, file) in named {
            let path = Path::new(file.as_str());
            let bytes = std::fs::read(path).map_err(Error::io(path))?;
            let name = copy(path, &bytes);
            sets.push(format!("{key}={MESHES}/{name}"));
            files.insert(name, bytes);
        }
        let text = if sets.is_empty() { text.to_owned() } else { parse("case", text.to_owned(), &sets)?.1 };
        Ok(Self { files, text })
    }

    /// Writes them to `folder`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, folder: &Folder) -> Result<()> {
        let place = folder.file(MESHES);
        if !self.files.is_empty() {
            std::fs::create_dir_all(&place).map_err(Error::io(&place))?;
        }
        let all = self.files.iter().map(|(name, bytes)| (place.join(name), bytes));
        // What is there already is the same.
        all.filter(|(path, _)| !path.exists()).try_for_each(|(path, bytes)| write_whole(&path, bytes))
    }
}

/// The name of the copy of the file at `path`, which holds `bytes`.
fn copy(path: &Path, bytes: &[u8]) -> String {
    let part =
        |part: Option<&std::ffi::OsStr>| part.map(|p| p.to_string_lossy().into_owned()).unwrap_or_default();
    let (stem, end) = (part(path.file_stem()), part(path.extension()));
    let sum = format!("{:08x}", crc32fast::hash(bytes));
    // A copy of a copy is called as the first one.
    let stem = stem.strip_suffix(&format!("-{sum}")).unwrap_or(&stem);
    format!("{stem}-{sum}.{end}")
}

/// The TOML `text` of `case` as it is kept beside results: each mesh is named by what it holds, wherever it lies.
///
/// # Errors
/// [`Error::Io`] if a mesh is gone.
pub fn named_by_content(case: &Case, text: &str) -> Result<String> {
    Ok(Meshes::read(case, text)?.text)
}

/// `case` with each mesh by what it holds instead of its place; one that is gone stays as it is.
pub(super) fn by_content(mut case: Case) -> Case {
    for (_, file) in case.files() {
        let path = Path::new(file.as_str());
        if let Some(name) =
            path.file_name().and_then(|n| n.to_str()).filter(|n| path.is_relative() && is_mesh(n))
        {
            *file = name.to_owned();
        } else if let Ok(bytes) = std::fs::read(path) {
            *file = copy(path, &bytes);
        }
    }
    case
}
