//! Files of a run, one format per file; the solver knows none of them.
//!
//! | file | written | holds |
//! |---|---|---|
//! | `case.toml` | at the start | the case with all overrides applied |
//! | `NAME.pvd` | after every frame | the list of frames, for ParaView |
//! | `vtu/fluid_0000.vtu`, `vtu/solids_0000.vtu` | every frame | particles |
//! | `vtu/walls.vtu` | once | particles that never move, at t = 0 |
//! | `vtu/last_fluid.vtu`, `vtu/last_solids.vtu` | when a run diverges | the state in which it was found |
//! | `monitors.csv`, `bodies.csv`, `gauges.csv` | row by row | tables over time, units in the header |
//! | `pictures/frame_0000.png`, `final.png` | if asked for | pictures of the particles |
//! | `result.json` | at the end, also of a failed run | the summary |
//! | `checkpoint/step_0000000000.seixo` | now and then | the state, see [`crate::checkpoint::file`] |
//! | `.seixo`, `.reserve` | at the start | marker and lock; room for the last word |
//!
//! Whole files appear by rename and tables grow by whole rows, so a killed run leaves nothing that cannot
//! be read.

pub mod folder;
pub mod particles;
pub mod picture;
pub mod pvd;
pub mod render;
pub mod result;
pub mod table;
pub mod vtu;

use crate::error::{Error, Result};
use std::io::Write;
use std::path::Path;

/// Write `bytes` to `path` so that the file holds either what it held before or all of them.
///
/// # Errors
/// [`Error::Io`] with the path (folder missing, disk full ...).
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = beside(folder).map_err(Error::io(path))?;
    file.write_all(bytes).map_err(Error::io(path))?;
    file.persist(path).map_err(|e| Error::io(path)(e.error))?;
    Ok(())
}

/// A file in `folder` that takes its name when it is whole.
pub(crate) fn beside(folder: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".writing-");
    // A file of the run is no secret: the usual permissions instead of the private ones of temporary files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o644));
    builder.tempfile_in(folder)
}
