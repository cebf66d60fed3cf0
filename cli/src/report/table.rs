//! Tables of a run, read back.

use super::damaged;
use seixo::error::{Error, Result};
use std::path::Path;

/// A table: columns of numbers, what is none is not a number.
#[derive(Clone, Debug, Default)]
pub struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Table {
    /// The table at `path`; an empty one if the run wrote none.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn read(path: &Path) -> Result<Self> {
        Ok(Self::read_by(path, "")?.into_iter().next().map_or_else(Self::default, |(_, table)| table))
    }

    /// The rows of the table at `path` for each text in the column `by`, in the order in which they come.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn read_by(path: &Path, by: &str) -> Result<Vec<(String, Self)>> {
        let file = match std::fs::File::open(path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            file => file.map_err(Error::io(path))?,
        };
        let mut reader = csv::Reader::from_reader(std::io::BufReader::new(file));
        let columns: Vec<String> =
            reader.headers().map_err(|e| damaged(path, e))?.iter().map(str::to_owned).collect();
        let key = columns.iter().position(|c| c == by);
        let mut tables: Vec<(String, Self)> = Vec::new();
        for row in reader.records() {
            // A run in progress may be in the middle of its last row.
            let Ok(row) = row else { break };
            let name = key.and_then(|k| row.get(k)).unwrap_or_default();
            let numbers = row.iter().map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
            match tables.iter_mut().find(|(n, _)| n == name) {
                Some((_, table)) => table.rows.push(numbers),
                None => {
                    tables.push((name.to_owned(), Self { columns: columns.clone(), rows: vec![numbers] }))
                }
            }
        }
        Ok(tables)
    }

    /// Names of the columns, each with its unit.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// A column against the time [s].
    pub fn curve(&self, column: &str) -> Option<Vec<[f64; 2]>> {
        let place = |name: &str| self.columns.iter().position(|c| c == name);
        let (t, y) = (place("time [s]")?, place(column)?);
        Some(self.rows.iter().filter_map(|row| Some([*row.get(t)?, *row.get(y)?])).collect())
    }
}
