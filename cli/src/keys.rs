//! `seixo keys`: the keys of a case file, from its schema: what each is, what it is if left out, what is allowed, an example
//! from the cases that come along.

use super::Exit;
use seixo::case::Case;
use seixo::console::{say, tell};
use seixo::error::Error;
use serde_json::Value;
use std::fmt::Write as _;

#[derive(Debug, clap::Args)]
pub struct KeysArgs {
    /// Only keys whose path or description holds this, e.g. contact, body.size, viscosity.
    word: Option<String>,
    /// Print the page of the guide (Markdown).
    #[arg(long, conflicts_with = "word")]
    markdown: bool,
}

/// A table of a case file.
struct Table {
    /// Where it stands, e.g. `fluid.block`; nothing for the file itself.
    path: String,
    /// Whether there may be many of it: `[[fluid.block]]`.
    many: bool,
    words: String,
    keys: Vec<Key>,
}

/// A key of a table.
struct Key {
    name: String,
    kind: String,
    /// What it is if left out; nothing if something is derived, or left out altogether.
    default: Option<String>,
    required: bool,
    allowed: String,
    unit: String,
    words: String,
    /// Names that it can take, each with what it means.
    choices: Vec<(String, String)>,
    example: Option<String>,
}

pub fn keys(args: &KeysArgs) -> Exit {
    let schema: Value = serde_json::from_str(Case::schema()).unwrap_or_default();
    let tables = Reader { schema: &schema, examples: examples() }.tables();
    if args.markdown {
        say(markdown(&tables).trim_end());
        return Ok(0);
    }
    // As messages and --set name it: `body.0.density` is the key `density` of [[body]].
    let asked = args.word.clone().unwrap_or_default();
    let names = asked.split('.').filter(|part| part.parse::<usize>().is_err());
    let word = Some(names.collect::<Vec<_>>().join(".")).filter(|word| !word.is_empty()).unwrap_or(asked);
    let text = text(&tables, &word);
    if text.is_empty() {
        let asked = word.to_lowercase();
        let instead = INSTEAD.iter().find(|(names, _)| names.iter().any(|name| asked.contains(name)));
        let instead = instead.map_or(String::new(), |(_, words)| format!("; {words}"));
        let words =
            format!("no key has `{word}` in its path or description: `seixo keys` lists all{instead}");
        return Err(Error::usage("WORD", words));
    }
    tell(text.trim_end());
    Ok(0)
}

/// What people look for that is not there, by parts of its names, and what there is instead.
const INSTEAD: [(&[&str], &str); 6] = [
    (
        &["mooring", "tether", "cable", "anchor", "chain"],
        "there are no lines and springs between solids: `body.locked` holds a body along axes, `body.hinge` about a line",
    ),
    (
        &["porous", "porosity", "permeab", "rubble", "darcy"],
        "solids are impermeable: a mound of many bodies or obstacles lets water through the gaps that run.spacing resolves",
    ),
    (
        &["turbulen", "eddy", "smagorinsky", "epsilon"],
        "there is no model of turbulence: `fluid.viscosity` may be that of a turbulent flow, `fluid.wall_friction` is that of its walls",
    ),
    (&["tension", "capillar", "wetting"], "there is no surface tension"),
    (&["air", "gas", "phase"], "there is water alone: air has no pressure, and is not caught by water"),
    (
        &["elastic", "flexib", "deform", "young"],
        "solids are rigid; `contact.spring` is the stiffness with which they touch",
    ),
];

/// Examples of keys that no case that comes along has.
const RARE: &str = include_str!("rare.toml");

/// Cases to take examples from.
fn examples() -> Vec<toml::Table> {
    use clap::ValueEnum;
    let starters = super::init::Starter::value_variants().iter().map(|s| s.text());
    let cases =
        seixo_cases::names("").into_iter().filter_map(|name| seixo_cases::text(&format!("{name}.toml")));
    starters.chain(cases).chain([RARE]).filter_map(|text| text.parse().ok()).collect()
}

/// The tables in the order in which one writes them; others follow.
const ORDER: [&str; 13] = [
    "run",
    "tank",
    "obstacle",
    "plane",
    "moving_wall",
    "fluid",
    "absorber",
    "inflow",
    "outflow",
    "body",
    "contact",
    "gauge",
    "output",
];

/// Longest example.
const LONGEST: usize = 60;

struct Reader<'a> {
    schema: &'a Value,
    examples: Vec<toml::Table>,
}

impl Reader<'_> {
    fn tables(&self) -> Vec<Table> {
        let mut tables = Vec::new();
        self.table(String::new(), false, self.schema, self.schema, &mut tables);
        let place = |t: &Table| {
            let first = t.path.split('.').next().unwrap_or_default();
            ORDER.iter().position(|&name| name == first).unwrap_or(ORDER.len())
        };
        tables.sort_by_key(place);
        tables
    }

    /// What a reference, or one beside nothing, leads to.
    fn resolved<'b>(&'b self, value: &'b Value) -> &'b Value {
        let options = value["anyOf"].as_array();
        let value = options.and_then(|o| o.iter().find(|v| v["type"] != "null")).unwrap_or(value);
        let name = value["$ref"].as_str().and_then(|r| r.strip_prefix('#'));
        name.and_then(|name| self.schema.pointer(name)).unwrap_or(value)
    }

    /// The table of `schema` and those in it; `at` is where it is mentioned, with what is said of it there.
    fn table(&self, path: String, many: bool, schema: &Value, at: &Value, tables: &mut Vec<Table>) {
        let required =
            |name: &str| schema["required"].as_array().is_some_and(|r| r.iter().any(|n| n == name));
        let mut own = Table { words: words(at, schema), path: path.clone(), many, keys: Vec::new() };
        let mut below = Vec::new();
        for (name, value) in schema["properties"].as_object().into_iter().flatten() {
            let full = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
            let (inside, items) = (self.resolved(value), self.resolved(&value["items"]));
            if inside["properties"].is_object() {
                below.push((full, false, inside, value));
            } else if items["properties"].is_object() {
                below.push((full, true, items, value));
            } else {
                own.keys.push(self.key(name, &full, required(name), value));
            }
        }
        // Required ones first, else as the schema has them.
        own.keys.sort_by_key(|k| !k.required);
        tables.push(own);
        for (full, many, schema, at) in below {
            self.table(full, many, schema, at, tables);
        }
    }

    fn key(&self, name: &str, full: &str, required: bool, value: &Value) -> Key {
        let inside = self.resolved(value);
        let words = words(value, inside);
        let of = |v: &Value| -> Vec<(String, String)> {
            let options = v["oneOf"].as_array().into_iter().flatten();
            let named =
                options.filter_map(|o| Some((o["const"].as_str()?.to_owned(), one_line(&o["description"]))));
            named.chain(names(v)).collect()
        };
        let items = self.resolved(&value["items"]);
        let choices = [inside, items].into_iter().map(of).find(|c| !c.is_empty()).unwrap_or_default();
        let default = value.get("default").filter(|d| !d.is_null()).map(as_toml);
        let example = self.example(full, default.as_deref());
        Key {
            kind: kind(inside, items),
            allowed: allowed(inside, items),
            unit: unit(&words),
            name: name.to_owned(),
            default,
            required,
            words,
            choices,
            example,
        }
    }

    /// The shortest value of the key in the cases that come along, other than what it is if left out.
    fn example(&self, full: &str, default: Option<&str>) -> Option<String> {
        fn values<'a>(value: &'a toml::Value, path: &[&str], found: &mut Vec<&'a toml::Value>) {
            match (value, path) {
                (value, []) => found.push(value),
                (toml::Value::Table(table), [name, rest @ ..]) => {
                    table.get(*name).into_iter().for_each(|v| values(v, rest, found));
                }
                (toml::Value::Array(items), path) => items.iter().for_each(|v| values(v, path, found)),
                _ => {}
            }
        }
        let path: Vec<&str> = full.split('.').collect();
        let mut texts: Vec<String> = Vec::new();
        for case in &self.examples {
            let mut found = Vec::new();
            case.get(path[0]).into_iter().for_each(|v| values(v, &path[1..], &mut found));
            texts.extend(found.into_iter().map(ToString::to_string));
        }
        texts.retain(|text| text.len() <= LONGEST && Some(text.as_str()) != default);
        // The first of the shortest: cases come in a fixed order.
        texts.into_iter().min_by_key(String::len)
    }
}

/// Names of an `enum`.
fn names(value: &Value) -> impl Iterator<Item = (String, String)> {
    let names = value["enum"].as_array().into_iter().flatten();
    names.filter_map(|n| Some((n.as_str()?.to_owned(), String::new())))
}

fn one_line(text: &Value) -> String {
    text.as_str().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// What is said where it is mentioned, else of the thing itself.
fn words(at: &Value, inside: &Value) -> String {
    let own = one_line(&at["description"]);
    if own.is_empty() { one_line(&inside["description"]) } else { own }
}

/// A default as it would be typed.
fn as_toml(value: &Value) -> String {
    match value {
        Value::Number(n) => n.to_string(),
        Value::Array(items) => format!("[{}]", items.iter().map(as_toml).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}

/// The types of `value`, without `null`.
fn types(value: &Value) -> Vec<&str> {
    let one = value["type"].as_str().into_iter();
    let many = value["type"].as_array().into_iter().flatten().filter_map(Value::as_str);
    one.chain(many).filter(|&t| t != "null").collect()
}

fn kind(value: &Value, items: &Value) -> String {
    if value["oneOf"].is_array() {
        return "name".into();
    }
    let words: Vec<String> = types(value)
        .into_iter()
        .map(|one| match one {
            "array" => {
                let count = value["minItems"].as_u64().filter(|n| value["maxItems"].as_u64() == Some(*n));
                let of = match types(items).first() {
                    _ if items["oneOf"].is_array() => "names".to_owned(),
                    Some(&"array") => {
                        format!("rows of {} numbers", items["maxItems"].as_u64().unwrap_or_default())
                    }
                    Some(&"string") => "texts".to_owned(),
                    _ => "numbers".to_owned(),
                };
                count.map_or_else(|| of.clone(), |n| format!("{n} {of}"))
            }
            "string" => "text".into(),
            "boolean" => "true or false".into(),
            "integer" => "whole number".into(),
            other => other.to_owned(),
        })
        .collect();
    words.join(" or ")
}

/// What a number, or each of several, may be.
fn allowed(value: &Value, items: &Value) -> String {
    if let Some(options) = value["enum"].as_array().filter(|o| o.iter().all(Value::is_number)) {
        return options.iter().map(ToString::to_string).collect::<Vec<_>>().join(" or ");
    }
    let bounds = |v: &Value| {
        let at = |key: &str| v[key].as_f64();
        let sides = [
            (">", at("exclusiveMinimum")),
            (">=", at("minimum")),
            ("<", at("exclusiveMaximum")),
            ("<=", at("maximum")),
        ];
        let sides = sides.into_iter().filter_map(|(sign, x)| Some(format!("{sign} {}", number(x?))));
        sides.collect::<Vec<_>>().join(", ")
    };
    let own = bounds(value);
    let each = bounds(items);
    if !own.is_empty() || each.is_empty() { own } else { format!("each {each}") }
}

/// A number in few digits.
fn number(x: f64) -> String {
    if x == 0.0 || (1e-6..1e6).contains(&x.abs()) { x.to_string() } else { format!("{x:e}") }
}

/// Units in brackets, each once: [m], [kg m2], [-]; not examples such as [0, 0, 1], nor what stands between backticks.
fn unit(words: &str) -> String {
    let mut units: Vec<&str> = Vec::new();
    let plain = words.split('`').step_by(2);
    for part in plain.flat_map(|words| words.split('[').skip(1)) {
        let inside = part.split(']').next().unwrap_or_default();
        let is_unit = !inside.is_empty()
            && !inside.contains(',')
            && inside.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '/' | ' ' | '-'))
            && !inside.starts_with(|c: char| c.is_ascii_digit() && !inside.starts_with("1/"));
        if is_unit && !units.contains(&inside) {
            units.push(inside);
        }
    }
    units.join(", ")
}

/// The keys that hold `word`, for a terminal.
fn text(tables: &[Table], word: &str) -> String {
    let word = word.to_lowercase();
    let mut out = String::new();
    for table in tables {
        for key in &table.keys {
            let path =
                if table.path.is_empty() { key.name.clone() } else { format!("{}.{}", table.path, key.name) };
            let all = format!("{path} {} {}", table.words, key.words).to_lowercase();
            if !all.contains(&word) {
                continue;
            }
            let state = match (&key.default, key.required) {
                (Some(default), _) => format!("{default} if left out"),
                (None, true) => "must be given".into(),
                (None, false) => "may be left out".into(),
            };
            let about: Vec<&str> =
                [&key.kind, &key.allowed, &state].into_iter().map(String::as_str).collect();
            let about: Vec<&str> = about.into_iter().filter(|part| !part.is_empty()).collect();
            let many = if table.many { format!("[[{}]] {}", table.path, key.name) } else { path };
            let _ = writeln!(out, "{many}\n    {}\n    {}", about.join("; "), key.words);
            for (name, words) in &key.choices {
                let _ = writeln!(out, "      \"{name}\"{}{words}", if words.is_empty() { "" } else { ": " });
            }
            if let Some(example) = &key.example {
                let _ = writeln!(out, "    e.g. {} = {example}", key.name);
            }
        }
    }
    out
}

/// The page of the guide.
fn markdown(tables: &[Table]) -> String {
    let mut out = "# Keys of a case file\n\n\
         *Made by `seixo keys --markdown` from the schema of case files; a test holds it against the program. `seixo keys WORD` \
         shows a part of it on a terminal.*\n\n\
         A key is changed from the command line by its path, `--set run.gravity=[0,0,-1.62]`; in tables of which there may be many \
         (`[[body]]`) with a number from 0: `--set body.0.density=800`. Units are those of the SI.\n"
        .to_owned();
    for table in tables.iter().filter(|t| !t.keys.is_empty()) {
        let heading = match (table.path.is_empty(), table.many) {
            (true, _) => "The file itself".to_owned(),
            (_, true) => format!("`[[{}]]`", table.path),
            (_, false) => format!("`[{}]`", table.path),
        };
        let _ = writeln!(out, "\n## {heading}\n\n{}\n", cell(&table.words));
        out.push_str("| key | what | unit | allowed | if left out | example |\n|---|---|---|---|---|---|\n");
        for key in &table.keys {
            let mut what = format!("{}. {}", key.kind, key.words);
            for (name, words) in &key.choices {
                let _ = write!(what, "<br>`\"{name}\"`{}{words}", if words.is_empty() { "" } else { ": " });
            }
            let code =
                |text: &Option<String>| text.as_ref().map_or(String::new(), |t| format!("`{}`", cell(t)));
            let missing = if key.required { "must be given".to_owned() } else { code(&key.default) };
            let _ = writeln!(
                out,
                "| `{}` | {} | {} | {} | {missing} | {} |",
                key.name,
                cell(&what),
                key.unit,
                cell(&key.allowed),
                code(&key.example)
            );
        }
    }
    out
}

/// Text that stands in a cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}
