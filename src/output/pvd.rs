//! The PVD file: which VTU files make up which moment.

use super::write_whole;
use crate::error::Result;
use std::fmt::Write;
use std::path::PathBuf;

/// A list of frames that is on disk after every change.
#[derive(Clone, Debug)]
pub struct Pvd {
    path: PathBuf,
    entries: String,
}

impl Pvd {
    /// A list without frames; nothing is written yet.
    pub fn new(path: PathBuf) -> Self {
        Self { path, entries: String::new() }
    }

    /// Add the frame at `time` [s]: names of its parts and their files, relative to the PVD. A part that does
    /// not change may name the same file in every frame.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`].
    pub fn push(&mut self, time: f64, parts: &[(&str, String)]) -> Result<()> {
        for (part, (name, file)) in parts.iter().enumerate() {
            let line = format!(
                r#"    <DataSet timestep="{time}" group="" part="{part}" name="{name}" file="{file}"/>"#
            );
            writeln!(self.entries, "{line}").expect("a String takes everything");
        }
        let text = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n  \
             <Collection>\n{}  </Collection>\n</VTKFile>\n",
            self.entries
        );
        write_whole(&self.path, text.as_bytes())
    }
}
