//! Tables of motion from files: `motion = "file.csv"` is the rows of that file.

use super::file::read_text;
use crate::error::{Error, Result};
use std::path::Path;
use toml_edit::{Array, DocumentMut, Item, Value};

/// Tables of a case whose solids may follow a file.
const TABLES: [&str; 2] = ["moving_wall", "body"];

/// The text of the case at `path` with the rows of each file that a `motion` names in the file's place. Text that cannot be
/// read is left as it is, to be explained by whoever reads it.
///
/// # Errors
/// [`Error::Case`] with file and line of what is wrong with the rows, [`Error::Io`].
pub(super) fn inline(path: &Path, text: String) -> Result<String> {
    let Ok(mut document) = text.parse::<DocumentMut>() else { return Ok(text) };
    let mut found = false;
    for table in TABLES {
        let solids = match document.get_mut(table) {
            Some(Item::ArrayOfTables(solids)) => solids,
            _ => continue,
        };
        for solid in solids.iter_mut() {
            let named = solid.get("motion").and_then(Item::as_str).map(str::to_owned);
            if let Some(file) = named {
                let mut rows = Value::Array(rows(path, &file)?);
                // What stands around the name, a comment say, stays around the rows.
                if let Some(old) = solid.get("motion").and_then(Item::as_value) {
                    *rows.decor_mut() = old.decor().clone();
                }
                solid["motion"] = Item::Value(rows);
                found = true;
            }
        }
    }
    Ok(if found { document.to_string() } else { text })
}

/// `set` as it is, or with the rows of the file that it names for a motion.
///
/// # Errors
/// As [`inline`].
pub(super) fn inline_set(path: &Path, set: &str) -> Result<String> {
    let Some((key, value)) = set.split_once('=').filter(|(key, _)| key.trim().ends_with(".motion")) else {
        return Ok(set.to_owned());
    };
    let file = value.trim().trim_matches(|c| c == '"' || c == '\'');
    if file.starts_with('[') {
        return Ok(set.to_owned());
    }
    Ok(format!("{key}={}", rows(path, file)?))
}

/// Lets a schema of cases have the name of a file where the rows of a motion stand.
pub(super) fn allow_files(schema: &mut serde_json::Value) {
    use serde_json::Value::{Array, String};
    for solid in ["Body", "MovingWall"] {
        let Some(motion) = schema.pointer_mut(&format!("/$defs/{solid}/properties/motion")) else { continue };
        let mut types = match motion["type"].take() {
            Array(types) => types,
            one => vec![one],
        };
        types.push("string".into());
        motion["type"] = Array(types);
        if let String(words) = &mut motion["description"] {
            words.push_str(" Or the name of a CSV file with these rows, relative to the case.");
        }
    }
}

/// The rows of `file`, a name relative to the case at `path`.
fn rows(path: &Path, file: &str) -> Result<Array> {
    let place = path.with_file_name("").join(file);
    let name = place.display().to_string();
    let wrong = |line: usize, why: String| {
        let at = if line > 0 { format!("{name}:{line}") } else { name.clone() };
        Error::file(name.clone(), "motion", format!("{at}: {why}"))
    };
    let text = std::fs::File::open(&place).and_then(read_text).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => {
            wrong(0, "no such file; a table of motion is named relative to its case".into())
        }
        std::io::ErrorKind::InvalidData => wrong(0, "not a text file in UTF-8".into()),
        _ => Error::io(&place)(e),
    })?;
    let (mut rows, mut last, mut headed) = (Array::new(), f64::NEG_INFINITY, false);
    for (n, line) in text.lines().enumerate().map(|(k, line)| (k + 1, line.trim())) {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let cells: Vec<Option<f64>> = line.split(',').map(|c| c.trim().parse().ok()).collect();
        // One line of names before the first row.
        if rows.is_empty() && !headed && cells.iter().all(Option::is_none) {
            headed = true;
            continue;
        }
        let numbers: Option<Vec<f64>> = cells.iter().copied().collect();
        let numbers = numbers.filter(|row| row.iter().all(|x| x.is_finite()));
        let Some(row) = numbers.filter(|row| row.len() == 4) else {
            let why = "expected time [s] and displacement x, y, z [m], four numbers with commas between";
            return Err(wrong(n, format!("{why}: `{}`", line.chars().take(60).collect::<String>())));
        };
        if row[0] <= last {
            return Err(wrong(n, format!("time {} does not come after {last}", row[0])));
        }
        last = row[0];
        rows.push(row.into_iter().collect::<Array>());
    }
    if rows.is_empty() {
        return Err(wrong(0, "it holds no rows of time, x, y, z".into()));
    }
    Ok(rows)
}
