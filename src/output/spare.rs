//! What a command writes where a user says spares what is there: files of runs always, others unless they are of the
//! command's own kind.

use super::folder::{FILES, MARKER, MESHES, REPORT, case_name};
use crate::error::{Error, FolderError, Result};
use std::ffi::OsStr;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Folders of a run, within its own. Surfaces are nobody's but the user's.
const FOLDERS: [&str; 5] = ["vtu", "series", "checkpoint", MESHES, "pictures"];

/// Refuses to write a file to `path` if a run has one of its own there, or if there is one that does not begin as those of
/// its kind do, with `mark`: the columns of a table, the head of a page. An empty file is nobody's. Ask before the work.
///
/// # Errors
/// [`Error::Folder`] with the path, [`Error::Io`].
pub fn spare(path: &Path, mark: &str) -> Result<()> {
    if is_of_run(path) {
        return Err(FolderError::Result(path.to_path_buf()).into());
    }
    let held = match std::fs::metadata(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        held => held.map_err(Error::io(path))?,
    };
    let mut begin = Vec::new();
    if held.is_file() {
        let file = std::fs::File::open(path).map_err(Error::io(path))?;
        file.take(mark.len() as u64).read_to_end(&mut begin).map_err(Error::io(path))?;
    }
    // A folder or a device cannot be replaced, and should not.
    if held.is_file() && (begin.is_empty() || begin == mark.as_bytes()) {
        return Ok(());
    }
    Err(FolderError::Taken(path.to_path_buf()).into())
}

/// Refuses the folder `out` for files beside which a run keeps its own, unless it is `own`, where they go if
/// nothing is said.
///
/// # Errors
/// [`Error::Folder`] with the folder, [`Error::Io`].
pub fn spare_folder(out: &Path, own: &Path) -> Result<()> {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    if real(out) != real(own) && is_of_run(&out.join("any")) {
        return Err(FolderError::Result(out.to_path_buf()).into());
    }
    Ok(())
}

/// Refuses the folder `out` for the results of many runs if it is that of one.
///
/// # Errors
/// [`Error::Folder`] with the folder, [`Error::Io`].
pub fn spare_run(out: &Path) -> Result<()> {
    match case_name(out)? {
        Some(_) => Err(FolderError::Run(out.to_path_buf()).into()),
        None => Ok(()),
    }
}

/// Whether a run whose folder is above `path`, however far, has a file of this name. `report.html` is nobody else's.
fn is_of_run(path: &Path) -> bool {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // What is not there holds no file, and a link leads where it leads.
    let parent = parent.canonicalize().or_else(|_| std::path::absolute(parent)).unwrap_or_default();
    let file = path.file_name().unwrap_or_default();
    for root in parent.ancestors() {
        let Ok(Some(name)) = case_name(root) else { continue };
        let within = parent.strip_prefix(root).ok().and_then(|p| p.iter().next().map(OsStr::to_owned));
        let taken = match within {
            Some(folder) => FOLDERS.iter().any(|f| folder == *f),
            None => {
                let own = FILES.iter().chain([&MARKER]).any(|f| file == *f) && file != REPORT;
                own || *file == *format!("{name}.pvd")
            }
        };
        if taken {
            return true;
        }
    }
    false
}
