//! The folder of a run: where each file goes, and that nobody's files are overwritten unasked.

use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Files of an earlier run that a new one replaces; anything else in the folder is left alone.
const OURS: [&str; 8] =
    ["case.toml", "result.json", "monitors.csv", "bodies.csv", "gauges.csv", "final.png", "vtu", "pictures"];

/// The folder of a run.
#[derive(Clone, Debug)]
pub struct Folder {
    root: PathBuf,
    name: String,
}

impl Folder {
    /// Make `root` for a run of the case `name`. A folder with something in it is refused unless `force`;
    /// then the files of an earlier run are removed, so that none of its frames is taken for a new one.
    ///
    /// # Errors
    /// [`Error::Case`] if the folder is not empty, [`Error::Io`] if it cannot be made.
    pub fn create(root: &Path, name: &str, force: bool) -> Result<Self> {
        let folder = Self { root: root.to_path_buf(), name: name.to_string() };
        let mut entries = match std::fs::read_dir(root) {
            Ok(entries) => entries,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                std::fs::create_dir_all(folder.vtu()).map_err(Error::io(folder.vtu()))?;
                return Ok(folder);
            }
            Err(e) => return Err(Error::io(root)(e)),
        };
        if entries.next().is_some() {
            if !force {
                return Err(Error::Case(format!(
                    "{} is not empty; choose another folder with --out, or replace the results in it with --force",
                    root.display()
                )));
            }
            folder.clear()?;
        }
        std::fs::create_dir_all(folder.vtu()).map_err(Error::io(folder.vtu()))?;
        Ok(folder)
    }

    fn clear(&self) -> Result<()> {
        for path in OURS.map(|f| self.root.join(f)).into_iter().chain([self.pvd()]) {
            let gone =
                if path.is_dir() { std::fs::remove_dir_all(&path) } else { std::fs::remove_file(&path) };
            match gone {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(Error::io(&path)(e)),
                _ => {}
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

    /// The list of frames.
    pub fn pvd(&self) -> PathBuf {
        self.root.join(format!("{}.pvd", self.name))
    }
}
