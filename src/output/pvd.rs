//! The PVD file: which VTU files make up which moment.

use super::kept::{Kept, reopen};
use super::table::even;
use super::write_whole;
use crate::checkpoint::Archive;
use crate::error::{Error, Result};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::PathBuf;

const HEAD: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" \
                    byte_order=\"LittleEndian\">\n  <Collection>\n";
const FOOT: &str = "  </Collection>\n</VTKFile>\n";

/// A list of frames that is on disk after every change, and grows at its end.
#[derive(Debug)]
pub struct Pvd {
    path: PathBuf,
    file: Option<File>,
    /// What stands before the end tags.
    entries: Kept,
}

impl Pvd {
    /// A list without frames; nothing is written yet.
    pub fn new(path: PathBuf) -> Self {
        Self { path, file: None, entries: Kept::of(HEAD.as_bytes()) }
    }

    /// Save how long the list is and what it holds, or cut the file back to what it was. `prefix` tells lists of one run
    /// apart.
    ///
    /// # Errors
    /// [`Error::Folder`] if the file is shorter than that or holds something else, [`Error::Io`].
    pub(crate) fn exchange(&mut self, prefix: &str, archive: &mut Archive) -> Result<()> {
        let Self { path, file, entries } = self;
        let due = entries.exchange(&format!("{prefix}pvd"), archive)?;
        if archive.is_saving() || entries.bytes() <= HEAD.len() as u64 {
            return Ok(());
        }
        let mut opened = reopen(path)?;
        entries.found(&mut opened, path, HEAD.as_bytes(), due)?;
        let io = |e| Error::io(&*path)(e);
        opened
            .seek(SeekFrom::Start(entries.bytes()))
            .and_then(|_| opened.write_all(FOOT.as_bytes()))
            .map_err(io)?;
        opened.set_len(entries.bytes() + FOOT.len() as u64).map_err(io)?;
        *file = Some(opened);
        Ok(())
    }

    /// Add the frame at `time` [s]: names of its parts and their files, relative to the PVD. A part that does
    /// not change may name the same file in every frame.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`]; the list is then as it was before.
    pub fn push(&mut self, time: f64, parts: &[(&str, String)]) -> Result<()> {
        let time = even(time);
        let mut text = String::new();
        for (part, (name, file)) in parts.iter().enumerate() {
            let line = format!(
                r#"    <DataSet timestep="{time}" group="" part="{part}" name="{name}" file="{file}"/>"#
            );
            writeln!(text, "{line}").expect("a String takes everything");
        }
        let added = text.len();
        text.push_str(FOOT);
        let at = self.entries.bytes();
        let file = match &mut self.file {
            Some(file) => file,
            none => {
                write_whole(&self.path, format!("{HEAD}{FOOT}").as_bytes())?;
                none.insert(File::options().write(true).open(&self.path).map_err(Error::io(&self.path))?)
            }
        };
        // One write from the end tags on; if the disk is full they go back to where they were.
        let put = |file: &mut File, text: &str| {
            file.seek(SeekFrom::Start(at)).and_then(|_| file.write_all(text.as_bytes()))
        };
        if let Err(e) = put(file, &text) {
            let _ = file.set_len(at).and_then(|()| put(file, FOOT));
            return Err(Error::io(&self.path)(e));
        }
        self.entries.add(&text.as_bytes()[..added]);
        Ok(())
    }
}
