//! Tables of a run, read back.

use csv::{ErrorKind, ReaderBuilder, StringRecord};
use seixo::error::{Error, Result};
use std::collections::HashMap;
use std::path::Path;

/// The column of times, which each table has.
const TIME: &str = "time [s]";

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
    /// [`Error::Io`], also for a table that no run wrote.
    pub fn read(path: &Path) -> Result<Self> {
        Ok(Self::read_by(path, "")?.into_iter().next().map_or_else(Self::default, |(_, table)| table))
    }

    /// The rows of the table at `path` for each text in the column `by`, in the order in which they come; all of them
    /// together if it is empty.
    ///
    /// # Errors
    /// As [`Table::read`].
    pub fn read_by(path: &Path, by: &str) -> Result<Vec<(String, Self)>> {
        let file = match std::fs::File::open(path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            file => file.map_err(Error::io(path))?,
        };
        let mut reader = ReaderBuilder::new().flexible(true).from_reader(std::io::BufReader::new(file));
        let header = reader.headers().map_err(|e| unread(path, e))?;
        if header.is_empty() {
            return Ok(Vec::new());
        }
        let columns: Vec<String> = header.iter().map(str::to_owned).collect();
        let place = |name: &str| {
            let at = columns.iter().position(|c| c == name);
            at.ok_or_else(|| damaged(path, 1, &format!("it has no column `{name}`")))
        };
        let time = place(TIME)?;
        let key = if by.is_empty() { None } else { Some(place(by)?) };
        let mut tables: Vec<(String, Self)> = Vec::new();
        let mut places: HashMap<String, usize> = HashMap::new();
        let mut rows = reader.records().peekable();
        while let Some(row) = rows.next() {
            let row = match row.map_err(|e| unread(path, e)).and_then(|row| whole(path, row, &columns, time))
            {
                // A run in progress may be in the middle of its last row.
                Err(_) if rows.peek().is_none() && !tables.is_empty() => break,
                row => row?,
            };
            let name = key.and_then(|k| row.get(k)).unwrap_or_default();
            let numbers = row.iter().map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
            match places.get(name) {
                Some(&k) => tables[k].1.rows.push(numbers),
                None => {
                    places.insert(name.to_owned(), tables.len());
                    tables.push((name.to_owned(), Self { columns: columns.clone(), rows: vec![numbers] }));
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
        let (t, y) = (place(TIME)?, place(column)?);
        Some(self.rows.iter().filter_map(|row| Some([*row.get(t)?, *row.get(y)?])).collect())
    }
}

/// A row that has a value for each of the `columns`, with a number as the time.
fn whole(path: &Path, row: StringRecord, columns: &[String], time: usize) -> Result<StringRecord> {
    let line = row.position().map_or(0, csv::Position::line);
    if row.len() != columns.len() {
        let why = format!("it has {} values, the line of names {}", row.len(), columns.len());
        return Err(damaged(path, line, &why));
    }
    match row.get(time).map(str::parse::<f64>) {
        Some(Ok(_)) => Ok(row),
        _ => Err(damaged(path, line, &format!("its `{TIME}` is no number"))),
    }
}

fn unread(path: &Path, error: csv::Error) -> Error {
    let line = error.position().map_or(1, csv::Position::line);
    match error.into_kind() {
        ErrorKind::Io(e) => Error::io(path)(e),
        ErrorKind::Utf8 { .. } => damaged(path, line, "it is no text in UTF-8"),
        _ => damaged(path, line, "it cannot be read as CSV"),
    }
}

/// The error of a table that no run wrote as it is.
fn damaged(path: &Path, line: u64, why: &str) -> Error {
    let text = format!(
        "line {line}: {why}; this is no table of seixo's, or somebody changed it: move it away to go on without it, or \
         run the case again"
    );
    Error::io(path)(std::io::Error::new(std::io::ErrorKind::InvalidData, text))
}
