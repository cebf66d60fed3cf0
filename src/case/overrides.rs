//! `--set key=value`: edits the text of a case, so that comments stay and messages point at lines.

use super::report::closest;
use crate::error::{Error, tidy};
use toml_edit::{DocumentMut, Item, Table, Value};

/// Applies `key=value` pairs in order.
///
/// # Errors
/// [`Error::Usage`] naming the pair and the part of its key that fits nothing.
pub(super) fn apply(text: &str, sets: &[String]) -> crate::error::Result<String> {
    let mut document: DocumentMut =
        text.parse().map_err(|e: toml_edit::TomlError| Error::file("case", "", e.to_string()))?;
    for set in sets {
        one(&mut document, set).map_err(|why| {
            let shown = match set.char_indices().nth(LONGEST_SHOWN) {
                Some((cut, _)) => format!("{} ...", &set[..cut]),
                None => set.clone(),
            };
            Error::usage("--set", tidy(&format!("--set {shown}: {why}")))
        })?;
    }
    Ok(document.to_string())
}

/// Letters of an override that are shown.
const LONGEST_SHOWN: usize = 200;

fn one(document: &mut DocumentMut, set: &str) -> Result<(), String> {
    let (key, value) = set.split_once('=').ok_or("expected key=value, e.g. run.end=2.5")?;
    let parts: Vec<&str> = key.trim().split('.').map(str::trim).collect();
    if parts.iter().any(|p| p.is_empty()) {
        return Err("the key has an empty part, e.g. run.end=2.5 is right".into());
    }
    // What is no TOML value is taken as a string, so that law=paper needs no quotes in quotes.
    let value = value.trim();
    let value = match value.parse::<Value>() {
        Ok(value) => value,
        // Nobody means such a string.
        Err(why) if value.starts_with(['{', '[']) => {
            let why = why.message().lines().last().unwrap_or_default();
            return Err(format!("this list or table cannot be read ({why}); words in it stand in quotes"));
        }
        Err(_) => Value::from(value),
    };
    let Some((&last, way)) = parts.split_last() else { return Err("the key is empty".into()) };
    let mut at = Place::Item(document.as_item_mut());
    let mut done = String::new();
    for part in way {
        at = at.enter(part, &done)?;
        done = if done.is_empty() { (*part).to_owned() } else { format!("{done}.{part}") };
    }
    at.put(last, value, &done)
}

/// A place in the document: a table or array in full or in line.
enum Place<'a> {
    Item(&'a mut Item),
    Table(&'a mut Table),
    Value(&'a mut Value),
}

/// `k`-th of `count` entries, or why not.
fn index(part: &str, count: usize, done: &str) -> Result<usize, String> {
    let k: usize = part
        .parse()
        .map_err(|_| format!("`{done}` is a list: `{part}` should be an index, e.g. {done}.0"))?;
    if k < count {
        return Ok(k);
    }
    Err(format!(
        "index {k} is out of range: `{done}` has {count} {}",
        if count == 1 { "entry" } else { "entries" }
    ))
}

fn scalar(kind: &str, done: &str, part: &str) -> String {
    format!("`{done}` is a {kind}: it has no `{part}`")
}

impl<'a> Place<'a> {
    fn enter(self, part: &str, done: &str) -> Result<Place<'a>, String> {
        match self {
            Self::Item(Item::Table(table)) => Self::Table(table).enter(part, done),
            Self::Item(Item::Value(value)) => Self::Value(value).enter(part, done),
            Self::Item(Item::ArrayOfTables(tables)) => {
                let k = index(part, tables.len(), done)?;
                tables.get_mut(k).map(Place::Table).ok_or_else(|| format!("no index {k} in `{done}`"))
            }
            Self::Item(Item::None) => Err(format!("`{done}` is not there")),
            Self::Table(table) => {
                if part.parse::<usize>().is_ok() {
                    if table.is_empty() {
                        return Err(format!(
                            "the case has no `{done}`; a whole list is given as {done}=[{{...}}, {{...}}]"
                        ));
                    }
                    let near = table.iter().map(|(k, _)| k.to_owned()).collect::<Vec<_>>().join(", ");
                    return Err(format!("`{done}` is a table, not a list; it holds {near}"));
                }
                Ok(Place::Item(table.entry(part).or_insert_with(toml_edit::table)))
            }
            Self::Value(value) => {
                let kind = value.type_name();
                match value {
                    Value::Array(array) => {
                        let k = index(part, array.len(), done)?;
                        array.get_mut(k).map(Place::Value).ok_or_else(|| format!("no index {k} in `{done}`"))
                    }
                    Value::InlineTable(table) => {
                        let names: Vec<String> = table.iter().map(|(k, _)| k.to_owned()).collect();
                        let names: Vec<&str> = names.iter().map(String::as_str).collect();
                        let hint = closest(part, &names).map(|n| format!("; did you mean `{n}`?"));
                        table
                            .get_mut(part)
                            .map(Place::Value)
                            .ok_or_else(|| format!("`{done}` has no `{part}`{}", hint.unwrap_or_default()))
                    }
                    _ => Err(scalar(kind, done, part)),
                }
            }
        }
    }

    fn put(self, last: &str, mut value: Value, done: &str) -> Result<(), String> {
        match self {
            Self::Item(Item::Table(table)) => Self::Table(table).put(last, value, done),
            Self::Item(Item::Value(at)) => Self::Value(at).put(last, value, done),
            Self::Item(Item::ArrayOfTables(tables)) => {
                index(last, tables.len(), done)?;
                Err(format!("`{done}.{last}` is a table: set one of its keys, e.g. {done}.{last}.name=..."))
            }
            Self::Item(Item::None) => Err(format!("`{done}` is not there")),
            Self::Table(table) => match table.get_mut(last) {
                Some(Item::Value(old)) => {
                    // Keeps the comment behind the value.
                    *value.decor_mut() = old.decor().clone();
                    *old = value;
                    Ok(())
                }
                Some(list @ Item::ArrayOfTables(_)) => {
                    // `[]` leaves none of them; a list of tables in line takes their place.
                    if !value.is_array() {
                        return Err(format!(
                            "`{last}` is a list: set one of its keys, e.g. {last}.0.name=..., or []"
                        ));
                    }
                    *list = Item::Value(value);
                    Ok(())
                }
                Some(_) => Err(format!("`{last}` is a table: set one of its keys")),
                None => {
                    table.insert(last, Item::Value(value));
                    Ok(())
                }
            },
            Self::Value(at) => {
                let kind = at.type_name();
                match at {
                    Value::Array(array) => {
                        let k = index(last, array.len(), done)?;
                        array.replace(k, value);
                        Ok(())
                    }
                    Value::InlineTable(table) => {
                        table.insert(last, value);
                        Ok(())
                    }
                    _ => Err(scalar(kind, done, last)),
                }
            }
        }
    }
}
