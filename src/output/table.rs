//! CSV tables: one header with units, then rows that reach the file whole.

use super::kept::{Kept, reopen};
use crate::checkpoint::Archive;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A table on disk.
#[derive(Debug)]
pub struct Table {
    path: PathBuf,
    file: File,
    /// The first line.
    head: Vec<u8>,
    /// Whole rows in the file.
    whole: Kept,
    columns: usize,
    pending: Vec<u8>,
}

/// A value of a row.
#[derive(Clone, Debug)]
pub enum Cell {
    /// A number; what is not finite becomes an empty cell.
    Number(f64),
    /// A count.
    Count(u64),
    /// Text.
    Text(String),
}

/// `time` [s] to eleven digits: what steps add up to is 0.7000000000000005 where 0.7 is meant.
pub(crate) fn even(time: f64) -> f64 {
    format!("{time:.10e}").parse().unwrap_or(time)
}

impl Cell {
    /// The moment `time` [s] of a row.
    pub(crate) fn time(time: f64) -> Self {
        Self::Number(even(time))
    }
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}
impl From<u64> for Cell {
    fn from(value: u64) -> Self {
        Self::Count(value)
    }
}
impl From<&str> for Cell {
    fn from(value: &str) -> Self {
        Self::Text(value.to_string())
    }
}

impl std::fmt::Display for Cell {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(x) if !x.is_finite() => Ok(()),
            // Shortest text that gives the number back; exponents only where digits would pile up.
            Self::Number(x) if *x != 0.0 && !(1e-4..1e7).contains(&x.abs()) => write!(f, "{x:e}"),
            Self::Number(x) => write!(f, "{x}"),
            Self::Count(n) => write!(f, "{n}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}

impl Table {
    /// A new table with the columns of `header`, each `name [unit]`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(path: &Path, header: &[String]) -> Result<Self> {
        // A run that gives up a step reads what it keeps.
        let opened = File::options().read(true).write(true).create(true).truncate(true).open(path);
        let mut table = Self::of(path, opened.map_err(Error::io(path))?, header)?;
        table.pending.clone_from(&table.head);
        table.flush()?;
        Ok(table)
    }

    /// The table of a run that goes on; its state says where.
    ///
    /// # Errors
    /// [`Error::Folder`] if there is none, [`Error::Io`].
    pub(crate) fn reopen(path: &Path, header: &[String]) -> Result<Self> {
        Self::of(path, reopen(path)?, header)
    }

    fn of(path: &Path, file: File, header: &[String]) -> Result<Self> {
        let (path, columns) = (path.to_path_buf(), header.len());
        let mut table =
            Self { path, file, head: Vec::new(), whole: Kept::default(), columns, pending: Vec::new() };
        table.push(header)?;
        table.head = std::mem::take(&mut table.pending);
        Ok(table)
    }

    /// Save how long the table is and what it holds, once it has reached the disk, or cut it back to what it was.
    ///
    /// # Errors
    /// [`Error::Folder`] if it is shorter than that or holds something else, [`Error::Io`].
    pub(crate) fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        let Self { path, file, head, whole, columns: _, pending: _ } = self;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let due = whole.exchange(&name, archive)?;
        let io = |e| Error::io(&*path)(e);
        if archive.is_saving() {
            return if archive.is_lasting() { file.sync_data().map_err(io) } else { Ok(()) };
        }
        whole.found(file, path, head, due)?;
        file.set_len(whole.bytes())
            .and_then(|()| file.seek(SeekFrom::Start(whole.bytes())).map(|_| ()))
            .map_err(io)
    }

    /// Add a row; it reaches the file with the next [`Table::flush`].
    ///
    /// # Errors
    /// [`Error::Io`] if a value cannot be written as CSV.
    pub fn row(&mut self, cells: &[Cell]) -> Result<()> {
        debug_assert_eq!(cells.len(), self.columns, "{}", self.path.display());
        let text: Vec<String> = cells.iter().map(Cell::to_string).collect();
        self.push(&text)
    }

    fn push(&mut self, text: &[String]) -> Result<()> {
        let mut writer = csv::Writer::from_writer(&mut self.pending);
        let written = writer.write_record(text).and_then(|()| writer.flush().map_err(Into::into));
        written.map_err(|e| Error::io(&self.path)(std::io::Error::other(e)))
    }

    /// Hand all rows to the system in one go. A row that does not fit any more leaves no part behind.
    ///
    /// # Errors
    /// [`Error::Io`], e.g. when the disk is full.
    pub fn flush(&mut self) -> Result<()> {
        let written = self.file.write_all(&self.pending);
        if written.is_ok() {
            self.whole.add(&self.pending);
        } else {
            // What went wrong is told below; a file that cannot even be cut was none to begin with.
            let _ = self.file.set_len(self.whole.bytes());
        }
        self.pending.clear();
        written.map_err(Error::io(&self.path))
    }
}

/// Three columns of a vector: `name_x [unit]`, `name_y [unit]`, `name_z [unit]`.
pub(crate) fn vector_columns(name: &str, unit: &str) -> [String; 3] {
    ["x", "y", "z"].map(|axis| format!("{name}_{axis} [{unit}]"))
}

/// Three cells of a vector.
pub(crate) fn vector_cells(v: glam::DVec3) -> [Cell; 3] {
    v.to_array().map(Cell::Number)
}

#[cfg(test)]
mod tests {
    use super::even;

    #[test]
    fn times_of_steps_are_those_that_are_meant() {
        let sum = |dt: f64, steps: u32| (0..steps).fold(0.0, |t, _| t + dt);
        for (dt, steps, meant) in [(1e-3, 700, 0.7), (9e-4, 5000, 4.5), (2e-5, 200_000, 4.0)] {
            assert_ne!(sum(dt, steps), meant);
            assert_eq!(even(sum(dt, steps)), meant);
        }
        // and no two steps have one time
        assert!(even(100.0 + 1e-7) > even(100.0));
    }
}
