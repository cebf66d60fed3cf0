//! Tables over time from files: `motion = "file.csv"` is the rows of that file, `rotation`, `discharge` and `velocity` too.

use super::file::read_text;
use crate::error::{Error, Result};
use std::path::Path;
use toml_edit::{Array, DocumentMut, Item, TableLike, Value};

/// Tables of a case, those of their keys that may be the name of a file, and its rows.
const TABLES: [(&str, &[&str], &Form); 6] = [
    ("moving_wall", &["motion"], &MOTION),
    ("moving_wall", &["rotation"], &ROTATION),
    ("body", &["motion"], &MOTION),
    ("body", &["rotation"], &ROTATION),
    ("inflow", &["velocity", "discharge"], &RATE),
    ("outflow", &["velocity", "discharge"], &RATE),
];

/// What the rows of a file are.
struct Form {
    columns: usize,
    what: &'static str,
    short: &'static str,
}

const MOTION: Form =
    Form { columns: 4, what: "time [s] and displacement x, y, z [m], four numbers", short: "time, x, y, z" };
const ROTATION: Form = Form {
    columns: 4,
    what: "time [s] and angles about x, y, z [degrees], four numbers",
    short: "time, x, y, z",
};
const RATE: Form = Form { columns: 2, what: "time [s] and value, two numbers", short: "time, value" };

/// The text of the case at `path` with the rows of each file that a key names in the file's place. Text that cannot be
/// read is left as it is, to be explained by whoever reads it.
///
/// # Errors
/// [`Error::Case`] with file and line of what is wrong with the rows, [`Error::Io`].
pub(super) fn inline(path: &Path, text: String) -> Result<String> {
    let Ok(mut document) = text.parse::<DocumentMut>() else { return Ok(text) };
    let flat = document.get("run").and_then(|run| run.get("dimensions")?.as_integer()) == Some(2);
    let mut found = false;
    for (table, keys, form) in TABLES {
        let tables: Vec<&mut dyn TableLike> = match document.get_mut(table) {
            Some(Item::ArrayOfTables(tables)) => tables.iter_mut().map(|t| t as _).collect(),
            Some(Item::Value(Value::Array(tables))) => {
                tables.iter_mut().filter_map(Value::as_inline_table_mut).map(|t| t as _).collect()
            }
            _ => continue,
        };
        for (k, one) in tables.into_iter().enumerate() {
            for &key in keys {
                let Some(Item::Value(value)) = one.get_mut(key) else { continue };
                let Some(file) = value.as_str() else { continue };
                let mut rows =
                    Value::Array(rows(path, file, (&format!("{table}.{k}.{key}"), key), (form, flat))?);
                // What stands around the name, a comment say, stays around the rows.
                *rows.decor_mut() = value.decor().clone();
                *value = rows;
                found = true;
            }
        }
    }
    Ok(if found { document.to_string() } else { text })
}

/// Lets a schema of cases have the name of a file where such rows stand.
#[cfg(test)]
pub(super) fn allow_files(schema: &mut serde_json::Value) {
    use serde_json::Value::{Array, String};
    let of = [
        ("Body", "motion"),
        ("Body", "rotation"),
        ("MovingWall", "motion"),
        ("MovingWall", "rotation"),
        ("Inflow", "velocity"),
        ("Inflow", "discharge"),
        ("Outflow", "velocity"),
        ("Outflow", "discharge"),
    ];
    for (table, key) in of {
        let Some(rows) = schema.pointer_mut(&format!("/$defs/{table}/properties/{key}")) else { continue };
        let mut types = match rows["type"].take() {
            Array(types) => types,
            one => vec![one],
        };
        types.push("string".into());
        rows["type"] = Array(types);
        if let String(words) = &mut rows["description"] {
            words.push_str(" Or the name of a CSV file with these rows, relative to the case.");
        }
    }
}

/// The first column of a line of names that states a unit other than its own, with that unit.
fn other_unit<'a>(line: &'a str, key: &str, (form, flat): (&Form, bool)) -> Option<(&'a str, &'a str)> {
    let stated = |column: &'a str| {
        let (name, rest) = column.trim().split_once(['[', '('])?;
        Some((name.trim(), rest.split([']', ')']).next()?.trim()))
    };
    let own = match key {
        "motion" => &["m", "metres", "meters"][..],
        "rotation" => &["degrees", "degree", "deg", "\u{b0}"],
        "velocity" => &["m/s", "m s-1"],
        _ if flat => &["m2/s", "m\u{b2}/s", "m^2/s", "m2 s-1"],
        _ => &["m3/s", "m\u{b3}/s", "m^3/s", "m3 s-1"],
    };
    let columns = line.split(',').take(form.columns).enumerate();
    let mut found = columns.filter_map(|(k, column)| {
        let (name, unit) = stated(column)?;
        let known = if k == 0 { &["s", "sec", "seconds"][..] } else { own };
        (!unit.is_empty() && !known.contains(&unit.to_lowercase().as_str())).then_some((name, unit))
    });
    found.next()
}

/// The first of a line of names that stands in the place of another axis.
fn other_axis(line: &str) -> Option<&str> {
    let mut names = line.split(',').map(|column| column.split(['[', '(']).next().unwrap_or_default().trim());
    names.by_ref().next();
    let axis = |name: &str| ["x", "y", "z"].iter().position(|axis| name.eq_ignore_ascii_case(axis));
    names.enumerate().find(|&(k, name)| axis(name).is_some_and(|n| n != k)).map(|(_, name)| name)
}

/// The rows of `file`, a name relative to the case at `path`, where `key` of the table at `place` names it.
fn rows(path: &Path, file: &str, (place, key): (&str, &str), (form, flat): (&Form, bool)) -> Result<Array> {
    let file = path.with_file_name("").join(file);
    let name = file.display().to_string();
    let wrong = |line: usize, why: String| {
        let at = if line > 0 { format!("{name}:{line}") } else { name.clone() };
        Error::file(name.clone(), place, format!("{at}: {why}"))
    };
    let text = std::fs::File::open(&file).and_then(read_text).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => {
            wrong(0, format!("no such file; `{place}` of the case names it, relative to the case"))
        }
        std::io::ErrorKind::InvalidData => wrong(0, "not a text file in UTF-8".into()),
        _ => Error::io(&file)(e),
    })?;
    let (mut rows, mut last, mut headed) = (Array::new(), f64::NEG_INFINITY, false);
    for (n, line) in text.lines().enumerate().map(|(k, line)| (k + 1, line.trim())) {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let cells: Vec<Option<f64>> = line.split(',').map(|c| c.trim().parse().ok()).collect();
        // One line of names before the first row: names have letters, and what has none is a row that went wrong.
        let names = line.chars().any(char::is_alphabetic) && cells.iter().all(Option::is_none);
        if rows.is_empty() && !headed && names {
            if let Some((name, unit)) = other_unit(line, key, (form, flat)) {
                let own = match (key, flat) {
                    ("discharge", true) => ", a discharge of each metre across [m2/s] in two dimensions",
                    ("discharge", false) => ", a discharge [m3/s] in three dimensions",
                    _ => "",
                };
                let why = format!("`{name}` is in [{unit}]: write {}{own}, and its name so", form.what);
                return Err(wrong(n, why));
            }
            if let Some(name) = other_axis(line).filter(|_| form.columns == 4) {
                let why = format!("`{name}` stands where another axis is read: write {}", form.what);
                return Err(wrong(n, why));
            }
            headed = true;
            continue;
        }
        let numbers: Option<Vec<f64>> = cells.iter().copied().collect();
        let numbers = numbers.filter(|row| row.iter().all(|x| x.is_finite()));
        let Some(row) = numbers.filter(|row| row.len() == form.columns) else {
            let why = format!("expected {} with commas between", form.what);
            return Err(wrong(n, format!("{why}: `{}`", line.chars().take(60).collect::<String>())));
        };
        if row[0] <= last {
            return Err(wrong(n, format!("time {} does not come after {last}", row[0])));
        }
        last = row[0];
        rows.push(row.into_iter().collect::<Array>());
    }
    if rows.is_empty() {
        return Err(wrong(0, format!("it holds no rows of {}", form.short)));
    }
    Ok(rows)
}
