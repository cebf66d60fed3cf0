//! The folder of a run: where each file goes, who writes there, and that nobody else's files are touched.
//!
//! A file `.seixo` marks a folder as one of seixo's own and is locked as long as a run writes there. Only in a
//! marked folder does `--force` remove anything, and only files with the names that a run gives.

use super::lock::{Beside, hold};
use crate::checkpoint::file::is_checkpoint;
use crate::error::{Error, FolderError, Result};
use crate::whole::{UNFINISHED, write_whole};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Marks a folder of results, and holds the lock of the run that writes there.
pub(super) const MARKER: &str = ".seixo";
/// Room that is given free for `result.json` when the disk is full.
const RESERVE: &str = ".reserve";
/// Bytes of it.
const RESERVED: usize = 32 << 10;
/// The page of `seixo report`.
pub(super) const REPORT: &str = "report.html";
/// Files of a run in the folder itself, beside `NAME.pvd`.
pub(super) const FILES: [&str; 8] =
    ["case.toml", "result.json", "monitors.csv", "bodies.csv", "gauges.csv", "final.png", REPORT, RESERVE];

/// The folder of the checkpoints of a run in `root`.
pub fn checkpoints(root: &Path) -> PathBuf {
    root.join("checkpoint")
}

/// The folder of the frames of the series `name` (`[[output.series]]`) of a run in `root`: the list `name.pvd`, and `vtu/`.
pub fn series_in(root: &Path, name: &str) -> PathBuf {
    root.join("series").join(name)
}

/// The folder, within that of a run, of copies of the meshes of its case.
pub(crate) const MESHES: &str = "meshes";

/// Whether such a copy may be called so: as its file, with the CRC-32 of what it holds, `hull-1f3a9c02.stl`.
pub(crate) fn is_mesh(name: &str) -> bool {
    let sum = name.rsplit_once('.').and_then(|(stem, _)| stem.rsplit_once('-')).map(|(_, sum)| sum);
    sum.is_some_and(|s| s.len() == 8 && s.bytes().all(|b| b.is_ascii_hexdigit()))
}

/// Name of the case whose run `root` holds; nothing if it is no folder of seixo's.
///
/// # Errors
/// [`Error::Io`].
pub fn case_name(root: &Path) -> Result<Option<String>> {
    let folder = Folder { root: root.to_path_buf(), name: String::new(), lock: Arc::new(None) };
    Ok(folder.marker()?.map(|m| m.name))
}

/// What the marker says.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Marker {
    /// Version of the program.
    seixo: String,
    /// Name of the case: its list of frames is `NAME.pvd`.
    name: String,
}

/// What to do with what a folder holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Refuse a folder with anything in it.
    New,
    /// Remove the files of an earlier run first.
    Replace,
    /// Keep them and go on.
    Continue,
}

/// The folder of a run.
#[derive(Clone, Debug)]
pub struct Folder {
    root: PathBuf,
    name: String,
    /// Held until the last clone is gone.
    lock: Arc<Option<File>>,
}

impl Folder {
    /// Make or take over `root` for a run of the case `name`, as `mode` says, and lock it. `inputs` are files that
    /// the run is made from, and folders of runs whose states it is: none of them is ever overwritten or removed.
    ///
    /// # Errors
    /// [`Error::Folder`] if the folder is not empty, is no folder of seixo's, is in use by another run, or if a
    /// result would take the place of an input; [`Error::Io`] if it cannot be made.
    pub fn open(root: &Path, name: &str, mode: Mode, inputs: &[PathBuf]) -> Result<Self> {
        let mut folder = Self { root: root.to_path_buf(), name: name.to_string(), lock: Arc::new(None) };
        folder.spare(inputs)?;
        let filled = match std::fs::read_dir(root) {
            Ok(mut entries) => entries.next().is_some(),
            Err(e) if e.kind() == ErrorKind::NotFound => false,
            Err(e) => return Err(Error::io(root)(e)),
        };
        let earlier = folder.marker()?;
        if filled && earlier.is_none() {
            return Err(FolderError::Foreign { folder: root.to_path_buf(), marker: MARKER }.into());
        }
        if filled && mode == Mode::New {
            return Err(FolderError::NotEmpty(root.to_path_buf()).into());
        }
        std::fs::create_dir_all(root).map_err(Error::io(root))?;
        folder.lock = Arc::new(Some(folder.take()?));
        if let (Mode::Replace, Some(earlier)) = (mode, earlier) {
            folder.clear(&earlier.name)?;
        }
        folder.clear_unfinished()?;
        std::fs::create_dir_all(folder.vtu()).map_err(Error::io(folder.vtu()))?;
        folder.reserve()?;
        Ok(folder)
    }

    /// Refuses inputs that stand where a result goes.
    fn spare(&self, inputs: &[PathBuf]) -> Result<()> {
        let Ok(root) = self.root.canonicalize() else { return Ok(()) };
        for input in inputs.iter().filter_map(|p| p.canonicalize().ok()) {
            if input == root {
                let of = if root.is_dir() { FolderError::State } else { FolderError::Input };
                return Err(of(input).into());
            }
            let name = input.file_name().and_then(|n| n.to_str()).unwrap_or_default();
            if input.parent() == Some(&root) && self.is_ours(name, &self.name) {
                return Err(FolderError::Input(input).into());
            }
        }
        Ok(())
    }

    fn marker(&self) -> Result<Option<Marker>> {
        let path = self.file(MARKER);
        match std::fs::read(&path) {
            // A run that was killed while it wrote the marker has marked the folder all the same.
            Ok(bytes) => Ok(Some(serde_json::from_slice(&bytes).unwrap_or_default())),
            Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(None),
            Err(e) => Err(Error::io(&path)(e)),
        }
    }

    /// Locks the marker and writes it; returns the lock.
    fn take(&self) -> Result<File> {
        let file = hold(&self.root, MARKER, Beside::Nobody)?;
        self.mark(&self.file(MARKER), &file)?;
        Ok(file)
    }

    /// Writes the marker into its `file`: in place, for a rename would leave the lock on a file that is gone; and not
    /// at all if it says that already.
    fn mark(&self, path: &Path, mut file: &File) -> Result<()> {
        let marker = Marker { seixo: env!("CARGO_PKG_VERSION").into(), name: self.name.clone() };
        let text = serde_json::to_string(&marker).unwrap_or_default() + "\n";
        if std::fs::read(path).map_err(Error::io(path))? != text.as_bytes() {
            let put = std::io::Write::write_all(&mut file, text.as_bytes());
            put.and_then(|()| file.set_len(text.len() as u64)).map_err(Error::io(path))?;
        }
        Ok(())
    }

    fn reserve(&self) -> Result<()> {
        write_whole(&self.file(RESERVE), &[b'\n'; RESERVED])
    }

    /// Gives the reserved room free, for the last file of a run.
    pub fn release(&self) {
        // If it is gone already there is nothing to give.
        let _ = std::fs::remove_file(self.file(RESERVE));
    }

    /// Whether a run of the case `name` gives files of the folder itself this name.
    fn is_ours(&self, file: &str, name: &str) -> bool {
        FILES.contains(&file) || file == format!("{name}.pvd") || file.starts_with(UNFINISHED)
    }

    /// Removes the files of an earlier run of the case `name`; folders go if nothing else was in them.
    fn clear(&self, name: &str) -> Result<()> {
        self.remove(&self.root, |file| self.is_ours(file, name) || self.is_ours(file, &self.name))?;
        let numbered = |file: &str, before: &str, after: &str| {
            let number = file.strip_prefix(before).and_then(|f| f.strip_suffix(after));
            number.is_some_and(|n| n.len() >= 4 && n.bytes().all(|b| b.is_ascii_digit()))
        };
        // Of many ranks: `fluid_0007.pvtu` names `fluid_0007_0.vtu` and so on.
        let piece = |file: &str| {
            let parts = file.strip_suffix(".vtu").and_then(|stem| stem.rsplit_once('_'));
            parts.is_some_and(|(stem, rank)| {
                let of_frame = stem == "last_fluid" || numbered(stem, "fluid_", "");
                of_frame && !rank.is_empty() && rank.bytes().all(|b| b.is_ascii_digit())
            })
        };
        let frame = |file: &str| {
            ["walls.vtu", "last_fluid.vtu", "last_fluid.pvtu", "last_solids.vtu"].contains(&file)
                || numbered(file, "fluid_", ".vtu")
                || numbered(file, "fluid_", ".pvtu")
                || numbered(file, "solids_", ".vtu")
                || piece(file)
                || file.starts_with(UNFINISHED)
        };
        self.remove(&self.vtu(), frame)?;
        for (series, list) in self.series()? {
            let vtu = series.join("vtu");
            self.remove(&vtu, frame)?;
            self.remove(&series, |file| file == list || file.starts_with(UNFINISHED))?;
            for folder in [&vtu, &series] {
                let _ = std::fs::remove_dir(folder);
            }
        }
        self.remove(&self.pictures(), |file| {
            numbered(file, "frame_", ".png")
                || ["sheet.png", "animation.png"].contains(&file)
                || file.starts_with(UNFINISHED)
        })?;
        self.remove(&self.checkpoints(), |file| is_checkpoint(file) || file.starts_with(UNFINISHED))?;
        self.remove(&self.file(MESHES), |file| is_mesh(file) || file.starts_with(UNFINISHED))?;
        let folders =
            [self.vtu(), self.pictures(), self.checkpoints(), self.file(MESHES), self.file("series")];
        for folder in folders {
            // Somebody else's files keep their folder.
            let _ = std::fs::remove_dir(folder);
        }
        Ok(())
    }

    /// Removes what a run that was killed had not written to the end. The lock says that nobody writes there; pictures
    /// may be drawn beside a run and are left alone.
    fn clear_unfinished(&self) -> Result<()> {
        let mut folders = vec![self.root.clone(), self.vtu(), self.checkpoints(), self.file(MESHES)];
        folders.extend(self.series()?.into_iter().flat_map(|(series, _)| [series.join("vtu"), series]));
        folders.iter().try_for_each(|folder| self.remove(folder, |file| file.starts_with(UNFINISHED)))
    }

    /// Folders of series, and the list of frames of each.
    fn series(&self) -> Result<Vec<(PathBuf, String)>> {
        let parent = self.root.join("series");
        if parent.is_symlink() {
            return Ok(Vec::new());
        }
        let entries = match std::fs::read_dir(&parent) {
            Ok(entries) => entries,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            Err(e) => return Err(Error::io(&parent)(e)),
        };
        let mut found = Vec::new();
        for entry in entries {
            let entry = entry.map_err(Error::io(&parent))?;
            if let (true, Ok(name)) =
                (entry.file_type().is_ok_and(|t| t.is_dir()), entry.file_name().into_string())
            {
                found.push((entry.path(), format!("{name}.pvd")));
            }
        }
        Ok(found)
    }

    /// Removes the plain files of `folder` that are `ours`; links and folders are left alone.
    fn remove(&self, folder: &Path, ours: impl Fn(&str) -> bool) -> Result<()> {
        if folder != self.root && folder.is_symlink() {
            return Ok(());
        }
        let entries = match std::fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
            Err(e) => return Err(Error::io(folder)(e)),
        };
        for entry in entries {
            let entry = entry.map_err(Error::io(folder))?;
            let plain = entry.file_type().is_ok_and(|t| t.is_file());
            if plain && entry.file_name().to_str().is_some_and(&ours) {
                let path = entry.path();
                std::fs::remove_file(&path).map_err(Error::io(&path))?;
            }
        }
        Ok(())
    }

    /// The folder itself.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// A file directly in the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    /// The folder of the VTU files.
    pub fn vtu(&self) -> PathBuf {
        self.root.join("vtu")
    }

    /// The folder of the pictures.
    pub fn pictures(&self) -> PathBuf {
        self.root.join("pictures")
    }

    /// The folder of the checkpoints.
    pub fn checkpoints(&self) -> PathBuf {
        checkpoints(&self.root)
    }

    /// The list of frames.
    pub fn pvd(&self) -> PathBuf {
        self.root.join(format!("{}.pvd", self.name))
    }
}
