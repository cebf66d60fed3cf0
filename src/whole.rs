//! Files that appear whole or not at all.

use crate::error::{Error, Result};
use std::io::Write;
use std::path::Path;

/// How the names of files begin that are not yet whole.
pub(crate) const UNFINISHED: &str = ".writing-";

/// Write `bytes` to `path` so that the file holds either what it held before or all of them.
///
/// # Errors
/// [`Error::Io`] with the path (folder missing, disk full ...).
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = beside(folder).map_err(|e| {
        // Not the name of the file beside it, which nobody asked for.
        let gone = e.kind() == std::io::ErrorKind::NotFound;
        let gone =
            gone.then(|| std::io::Error::new(e.kind(), format!("there is no folder {}", folder.display())));
        Error::io(path)(gone.unwrap_or(e))
    })?;
    file.write_all(bytes).map_err(Error::io(path))?;
    file.persist(path).map_err(|e| Error::io(path)(e.error))?;
    Ok(())
}

/// Remove a file; says whether there was one.
///
/// # Errors
/// [`Error::Io`] with the path.
pub(crate) fn remove(path: &Path) -> Result<bool> {
    match std::fs::remove_file(path) {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(false),
        Err(e) => Err(Error::io(path)(e)),
    }
}

/// A file in `folder` that takes its name when it is whole.
pub(crate) fn beside(folder: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED);
    // A file of the run is no secret: the usual permissions instead of the private ones of temporary files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o644));
    builder.tempfile_in(folder)
}
