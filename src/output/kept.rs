//! What a run that goes on keeps of a file that it lengthens: so many bytes, which are to be those that it wrote.

use crate::checkpoint::Archive;
use crate::error::{Edit, Error, FolderError, Result};
use crc32fast::Hasher;
use std::fs::File;
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

/// The bytes of a file that a run counts on, and their sum.
#[derive(Debug, Default)]
pub(super) struct Kept {
    bytes: u64,
    sum: Hasher,
}

/// The sum that a state holds; one of before there were sums has none.
#[derive(Clone, Copy)]
pub(super) struct Due(Option<u32>);

impl Kept {
    /// What a run keeps that has written `text`.
    pub(super) fn of(text: &[u8]) -> Self {
        let mut kept = Self::default();
        kept.add(text);
        kept
    }

    /// How many bytes.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The run has written `text` behind what it keeps.
    pub(super) fn add(&mut self, text: &[u8]) {
        self.bytes += text.len() as u64;
        self.sum.update(text);
    }

    /// Save how much is kept of the file `name`, or read it. What the file should add up to is to be [`Kept::found`] then.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] if the state does not hold it.
    pub(super) fn exchange(&mut self, name: &str, archive: &mut Archive) -> Result<Due> {
        const UNKNOWN: u64 = u64::MAX;
        archive.count(&format!("{name}.bytes"), &mut self.bytes)?;
        let mut sum = if archive.is_saving() { u64::from(self.sum.clone().finalize()) } else { UNKNOWN };
        archive.count_of_late(&format!("{name}.crc32"), &mut sum)?;
        Ok(Due(u32::try_from(sum).ok()))
    }

    /// Look whether `file` at `path` still holds what is kept of it, which begins with `head` and ends a line.
    ///
    /// # Errors
    /// [`Error::Folder`] that says what somebody has done to it, [`Error::Io`].
    pub(super) fn found(&mut self, file: &mut File, path: &Path, head: &[u8], due: Due) -> Result<()> {
        let edited = |what| FolderError::Edited { file: path.to_path_buf(), what, bytes: self.bytes };
        let (start, ends, sum) = self.read(file, head.len()).map_err(Error::io(path))?;
        if file.metadata().map_err(Error::io(path))?.len() < self.bytes {
            return Err(edited(Edit::Shorter).into());
        }
        if start != head {
            return Err(edited(Edit::Start).into());
        }
        if !ends {
            return Err(edited(Edit::Line).into());
        }
        if due.0.is_some_and(|due| due != sum.clone().finalize()) {
            return Err(edited(Edit::Rows).into());
        }
        self.sum = sum;
        Ok(())
    }

    /// Of what is kept of `file`: the first `head` bytes, whether the last one ends a line, and the sum.
    fn read(&self, file: &mut File, head: usize) -> std::io::Result<(Vec<u8>, bool, Hasher)> {
        file.seek(SeekFrom::Start(0))?;
        let (mut rest, mut part) = (file.take(self.bytes), vec![0; 1 << 16]);
        let (mut start, mut ends, mut sum) = (Vec::new(), false, Hasher::new());
        loop {
            let read = match rest.read(&mut part)? {
                0 => return Ok((start, ends, sum)),
                read => &part[..read],
            };
            start.extend(read.iter().take(head - start.len()));
            ends = read.ends_with(b"\n");
            sum.update(read);
        }
    }
}

/// The file at `path` that a run goes on with.
///
/// # Errors
/// [`Error::Folder`] if it is gone, [`Error::Io`].
pub(super) fn reopen(path: &Path) -> Result<File> {
    File::options().read(true).write(true).open(path).map_err(|e| match e.kind() {
        ErrorKind::NotFound => FolderError::Gone(path.to_path_buf()).into(),
        _ => Error::io(path)(e),
    })
}
