//! Lists where a table belongs, and tables where a list of them does. Serde takes the values of a table from a list,
//! too, in the order in which the keys happen to stand in the source: `orientation = [0, 0, 1]` would be told that
//! its first number should be a list.

use super::report::{Message, named};
use serde_json::Value as Json;
use std::sync::LazyLock;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

static SCHEMA: LazyLock<Json> =
    LazyLock::new(|| serde_json::from_str(crate::schemas::CASE).unwrap_or_default());

/// The first that is wrong in this way.
pub(super) fn mistaken(table: &DeTable<'_>) -> Option<Message> {
    of_table(table, &SCHEMA, "")
}

fn of_table(table: &DeTable<'_>, schema: &Json, path: &str) -> Option<Message> {
    table.iter().find_map(|(key, value)| {
        let name = key.get_ref();
        let path = if path.is_empty() { name.to_string() } else { format!("{path}.{name}") };
        of_value(value, bare(schema["properties"].get(name.as_ref())?), &path)
    })
}

fn of_value(value: &Spanned<DeValue<'_>>, schema: &Json, path: &str) -> Option<Message> {
    let items = bare(&schema["items"]);
    match value.get_ref() {
        DeValue::Table(table) if is(schema, "object") => of_table(table, schema, path),
        DeValue::Table(_) if is(schema, "array") && is(items, "object") && !is(schema, "object") => {
            let key = named(path);
            let remedy = format!("write [[{key}]], in two brackets, before the keys of each");
            Some(message(value, path, "a table, expected a list of tables", remedy))
        }
        DeValue::Array(list) if is(schema, "array") => {
            let mut entries = list.iter().enumerate();
            entries.find_map(|(k, entry)| of_value(entry, items, &format!("{path}.{k}")))
        }
        DeValue::Array(list) if is(schema, "object") => {
            let tables = !list.is_empty() && list.iter().all(|entry| entry.get_ref().as_table().is_some());
            let (title, remedy) = if tables {
                (
                    "a list of tables, expected one table",
                    format!("write [{}], in single brackets", named(path)),
                )
            } else {
                ("a list, expected a table", with_keys(schema, path))
            };
            Some(message(value, path, title, remedy))
        }
        _ => None,
    }
}

fn message(value: &Spanned<DeValue<'_>>, path: &str, title: &str, remedy: String) -> Message {
    Message {
        span: value.span(),
        key: path.to_owned(),
        title: format!("{path}: {title}"),
        label: title.to_owned(),
        remedy: Some(remedy),
        warning: false,
    }
}

/// How the table is written that `schema` describes.
fn with_keys(schema: &Json, path: &str) -> String {
    let all: Vec<&str> =
        schema["properties"].as_object().into_iter().flatten().map(|(k, _)| k.as_str()).collect();
    let needed: Vec<&str> =
        schema["required"].as_array().into_iter().flatten().filter_map(Json::as_str).collect();
    let shown = if needed.is_empty() { &all[..all.len().min(1)] } else { &needed[..] };
    let pairs: Vec<String> = shown
        .iter()
        .map(|key| {
            let of = bare(&schema["properties"][key]);
            let value = match (of["maxItems"].as_u64(), of["type"].as_str()) {
                (Some(3), _) if is(bare(&of["items"]), "number") => "[x, y, z]",
                (_, Some("string")) => "\"...\"",
                _ => "...",
            };
            format!("{key} = {value}")
        })
        .collect();
    let mut others = all.iter().filter(|key| !shown.contains(key)).copied().peekable();
    let more = if others.peek().is_some() {
        format!("; it can have {}, too", others.collect::<Vec<_>>().join(", "))
    } else {
        String::new()
    };
    let key = named(path);
    let last = key.rsplit('.').next().unwrap_or_default();
    // An entry of a list of tables stands for itself.
    let name = if path.ends_with(last) { format!("{last} = ") } else { String::new() };
    format!(
        "write its keys, `{name}{{ {} }}`{more}; `seixo keys {key}` tells what each is, with an example",
        pairs.join(", ")
    )
}

/// All tables of a case: path, whether there may be many, and schema.
fn tables<'a>(schema: &'a Json, path: &str, found: &mut Vec<(String, bool, &'a Json)>) {
    for (key, value) in schema["properties"].as_object().into_iter().flatten() {
        let (value, path) =
            (bare(value), if path.is_empty() { key.clone() } else { format!("{path}.{key}") });
        let items = bare(&value["items"]);
        for (of, many) in [(value, false), (items, true)] {
            if is(of, "object") {
                found.push((path.clone(), many, of));
                tables(of, &path, found);
            }
        }
    }
}

/// The tables with a key of this name, as they are written, where these are few: where it belongs that was written elsewhere.
pub(super) fn homes(key: &str) -> Option<String> {
    let mut all = vec![];
    tables(&SCHEMA, "", &mut all);
    all.retain(|(_, _, schema)| schema["properties"].get(key).is_some());
    let names =
        all.iter().map(|(path, many, _)| if *many { format!("[[{path}]]") } else { format!("[{path}]") });
    let names: Vec<String> = names.collect();
    match names.as_slice() {
        [] => None,
        [one] => Some(one.clone()),
        [first @ .., last] => (all.len() <= 4).then(|| format!("{} and {last}", first.join(", "))),
    }
}

/// A schema without what says that it may be left out, and where it is written down.
fn bare(schema: &Json) -> &Json {
    let parts = schema["anyOf"].as_array().into_iter().flatten();
    let schema = parts.into_iter().find(|part| part["type"] != "null").unwrap_or(schema);
    match schema["$ref"].as_str().and_then(|at| at.strip_prefix('#')) {
        Some(at) => SCHEMA.pointer(at).unwrap_or(&Json::Null),
        None => schema,
    }
}

/// Whether `schema` lets values be of the type `name`.
fn is(schema: &Json, name: &str) -> bool {
    let of = &schema["type"];
    of == name || of.as_array().is_some_and(|all| all.iter().any(|one| one == name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> Option<String> {
        let table = DeTable::parse(text).expect("TOML");
        mistaken(table.get_ref()).map(|m| format!("{} | {}", m.title, m.remedy.unwrap_or_default()))
    }

    #[test]
    fn lists_for_tables_are_told_in_every_table_of_a_case() {
        let mut all = Vec::new();
        tables(&SCHEMA, "", &mut all);
        assert!(all.len() > 30 && all.iter().any(|(path, many, _)| path == "body.orientation" && !many));
        for (path, many, _) in all {
            // Outer tables of which there may be many, written as one.
            let (mut text, mut way) = (String::new(), String::new());
            let parts: Vec<&str> = path.split('.').collect();
            let (last, outer) = parts.split_last().expect("a name");
            let mut schema = &*SCHEMA;
            for part in outer {
                way = if way.is_empty() { (*part).to_owned() } else { format!("{way}.{part}") };
                let value = bare(&schema["properties"][part]);
                let list = is(value, "array");
                text += &if list { format!("[[{way}]]\n") } else { format!("[{way}]\n") };
                schema = if list { bare(&value["items"]) } else { value };
            }
            let list = if many { "[[0, 0, 1], [1]]" } else { "[0, 0, 1]" };
            let list = told(&format!("{text}{last} = {list}\n")).unwrap_or_else(|| panic!("{path}: a list"));
            assert!(list.contains("a list, expected a table | write its keys"), "{list}");
            assert!(list.contains(&format!("`seixo keys {path}`")), "{list}");
            let open = if many { "{}" } else { "[{}, {}]" };
            let other = told(&format!("{text}{last} = {open}\n")).unwrap_or_else(|| panic!("{path}: {open}"));
            let words = if many { format!("[[{path}]]") } else { format!("[{path}], in single") };
            assert!(other.contains(&words), "{other}");
        }
    }

    #[test]
    fn keys_have_homes() {
        assert_eq!(homes("spring").as_deref(), Some("[contact]"));
        assert_eq!(homes("gravity").as_deref(), Some("[run]"));
        assert_eq!(homes("friction").as_deref(), Some("[contact] and [[contact.pair]]"));
        // Too many to be of help, and none.
        assert_eq!(homes("name"), None);
        assert_eq!(homes("colour"), None);
    }

    #[test]
    fn what_is_told_names_the_keys_that_are_needed() {
        let text = "[[body]]\nname = \"a\"\n[[body]]\norientation = [0, 0, 1]\n";
        assert_eq!(
            told(text).as_deref(),
            Some(
                "body.1.orientation: a list, expected a table | write its keys, `orientation = { axis = [x, y, z], angle_deg = ... }`; \
                 `seixo keys body.orientation` tells what each is, with an example"
            )
        );
        let sound = "[run]\ngravity = [0, 0, -9.81]\n[tank]\nopen = [\"z_max\"]\n[[fluid.block]]\nmin = [0, 0, 0]\n[[inflow]]\n\
                     discharge = [[0, 0], [1, 0.2]]\n";
        assert_eq!(told(sound), None);
    }
}
