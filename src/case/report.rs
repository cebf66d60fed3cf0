//! Messages about a case file: file, line and column, the line itself, what is allowed, a remedy.

use super::brackets::homes;
use crate::error::{Problem, tidy};
use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A message about a stretch of the text.
pub(super) struct Message {
    pub span: Range<usize>,
    /// Dotted path, empty where no key is known.
    pub key: String,
    pub title: String,
    pub label: String,
    pub remedy: Option<String>,
    pub warning: bool,
}

impl Message {
    /// The same for a program: where it is in `text` of the file `path`.
    pub(crate) fn problem(&self, path: &str, text: &str) -> Problem {
        let before = text.get(..self.span.start.min(text.len())).unwrap_or_default();
        let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
        let message = self.title.strip_prefix(&format!("{}: ", self.key)).unwrap_or(&self.title);
        Problem {
            file: Some(path.to_owned()),
            line: Some(before.matches('\n').count() + 1),
            column: Some(column),
            warning: self.warning,
            ..Problem::new(&self.key, message, self.remedy.as_deref().unwrap_or_default())
        }
    }
}

/// All messages as one text.
pub(super) fn render(path: &str, text: &str, messages: &[Message]) -> String {
    let groups: Vec<_> = messages
        .iter()
        .map(|m| {
            let level = if m.warning { Level::WARNING } else { Level::ERROR };
            // The renderer wants character boundaries inside of the text.
            let end = m.span.end.min(text.len()).max(m.span.start.min(text.len()));
            let span = m.span.start.min(end)..end;
            let mark = AnnotationKind::Primary.span(span).label(m.label.as_str());
            let group = level
                .primary_title(m.title.as_str())
                .element(Snippet::source(text).path(path).annotation(mark));
            match &m.remedy {
                Some(remedy) => group.element(Level::HELP.message(remedy.as_str())),
                None => group,
            }
        })
        .collect();
    // Rendered one by one: several reports, not one report with several parts.
    let texts = groups.into_iter().map(|group| Renderer::plain().render(&[group]));
    texts.collect::<Vec<_>>().join("\n\n")
}

/// Turns what a reader has `said` of `span` into a message: adds the key's path and a remedy.
pub(super) fn explain(said: &str, span: Option<Range<usize>>, table: Option<&DeTable<'_>>) -> Message {
    let span = span.unwrap_or(0..0);
    let key = table.and_then(|t| path_at(t, &span));
    let said = tidy(&plain(said.trim()));
    // What is allowed is told once, as the remedy.
    let brief = short(&said);
    let title = match &key {
        Some(key) => format!("{key}: {brief}"),
        None => brief.clone(),
    };
    let quoted: Vec<&str> = said.split('`').skip(1).step_by(2).collect();
    let remedy = match quoted.as_slice() {
        [wrong, allowed @ ..] if said.starts_with("unknown") => Some(match closest(wrong, allowed) {
            Some(name) => format!("did you mean `{name}`? allowed: {}", allowed.join(", ")),
            None => match homes(wrong) {
                Some(tables) => {
                    format!("`{wrong}` is a key of {tables}; allowed here: {}", allowed.join(", "))
                }
                None => format!("allowed: {}", allowed.join(", ")),
            },
        }),
        [name, ..] if said.starts_with("missing field") => Some(match &key {
            Some(key) => {
                format!("add `{name} = ...` here; `seixo keys {}.{name}` tells what it takes", named(key))
            }
            None => format!("add a table [{name}]; `seixo init` writes a case to begin with"),
        }),
        _ if said.starts_with("invalid mantissa") || said.starts_with("invalid fraction") => {
            Some("a number has a digit on both sides of its point: 0.5, 2.0".to_owned())
        }
        _ if said.contains("expected ") => key
            .as_ref()
            .map(|key| format!("`seixo keys {}` tells what it takes, with an example", named(key))),
        _ => None,
    };
    Message { span, key: key.unwrap_or_default(), title, label: brief, remedy, warning: false }
}

/// What the reader of types says, in the words of a case: `invalid type: map, expected f64` as `a table, expected a number`.
fn plain(said: &str) -> String {
    let found = ["invalid type: ", "invalid value: ", "invalid length "].into_iter().find_map(|how| {
        let (found, wanted) = said.strip_prefix(how)?.rsplit_once(", expected ")?;
        Some((how, found, wanted))
    });
    let Some((how, found, wanted)) = found else {
        return said.to_owned();
    };
    let wanted = match wanted {
        "f64" | "f32" | "a float" => "a number".to_owned(),
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or more".to_owned(),
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a sequence" => "a list".to_owned(),
        "a string" => "words in quotes".to_owned(),
        w if w.starts_with("enum ") => "one of its names in quotes".to_owned(),
        w if w.starts_with("struct ") || w == "a map" => "a table".to_owned(),
        w => match w.strip_prefix("an array of length ") {
            Some(count) => format!("a list of {count}"),
            None => w.to_owned(),
        },
    };
    let value = |text: &str| text.split('`').nth(1).unwrap_or(text).to_owned();
    let found = match found {
        f if how == "invalid length " => format!("a list of {f}"),
        "map" => "a table".to_owned(),
        "sequence" => "a list".to_owned(),
        f if f.starts_with("string ") => format!("the words `{}`", f["string ".len()..].trim_matches('"')),
        f if f.starts_with("integer ") || f.starts_with("floating point ") => {
            format!("the number {}", value(f))
        }
        f if f.starts_with("boolean ") => value(f),
        f => f.to_owned(),
    };
    format!("{found}, expected {wanted}")
}

/// The message up to the list of what is allowed, which stands in the remedy.
fn short(said: &str) -> String {
    let list = if said.starts_with("unknown") { ", expected " } else { ", expected one of" };
    said.lines().next().unwrap_or("").split(list).next().unwrap_or("").to_owned()
}

/// A key as `seixo keys` knows it, without the numbers of list entries.
pub(super) fn named(key: &str) -> String {
    key.split('.').filter(|part| part.parse::<usize>().is_err()).collect::<Vec<_>>().join(".")
}

/// What keys and tables are called elsewhere: words that newcomers bring, and the names here, of which those that
/// a place has are meant.
const ELSEWHERE: &[(&[&str], &[&str])] = &[
    (&["mesh", "stl", "obj", "path", "filename"], &["file"]),
    (&["dp", "dx", "l0", "h", "resolution", "particle_spacing"], &["spacing"]),
    (&["dt", "timestep"], &["time_step"]),
    (&["duration", "t_end", "tmax", "t_max", "until", "end_time", "time"], &["end"]),
    (&["g"], &["gravity"]),
    (&["rho", "rhop"], &["density"]),
    (&["nu", "kinematic_viscosity"], &["viscosity"]),
    (&["mu", "friction_coefficient"], &["friction"]),
    (&["stiffness", "k", "kn"], &["spring"]),
    (&["position", "origin", "pos", "centre"], &["center", "at", "position"]),
    (&["length", "dimensions", "extent", "edge"], &["size"]),
    (&["rotation", "angle", "rotate"], &["orientation"]),
    (&["omega"], &["angular_velocity"]),
    (&["point"], &["at"]),
    (&["solid", "solids", "rigid", "rigid_body", "floating", "object"], &["body"]),
    (&["wall", "box", "column", "pile"], &["obstacle"]),
    (&["gate", "piston", "wavemaker"], &["moving_wall"]),
    (&["domain", "walls"], &["tank"]),
    (&["water", "liquid"], &["fluid"]),
    (&["inlet", "source"], &["inflow"]),
    (&["outlet", "sink"], &["outflow"]),
    (&["probe", "probes", "sensor"], &["gauge"]),
    (&["damping_zone", "sponge", "beach"], &["absorber"]),
    (&["left"], &["x_min"]),
    (&["right"], &["x_max"]),
    (&["front"], &["y_min"]),
    (&["back"], &["y_max"]),
    (&["bottom", "floor"], &["z_min"]),
    (&["top", "lid"], &["z_max"]),
    (&["rx", "roll"], &["rotation_x"]),
    (&["ry", "pitch"], &["rotation_y"]),
    (&["rz", "yaw"], &["rotation_z"]),
];

/// The name most like a mistyped one, few slips of the finger or the same beginning; or what is meant by a word from
/// elsewhere.
pub(super) fn closest<'a>(wrong: &str, names: &[&'a str]) -> Option<&'a str> {
    let wrong = wrong.to_lowercase();
    let translated = ELSEWHERE.iter().filter(|(words, _)| words.contains(&wrong.as_str()));
    let meant = translated.flat_map(|(_, here)| *here).find_map(|n| names.iter().find(|name| *name == n));
    if meant.is_some() {
        return meant.copied();
    }
    let slips = |name: &str| strsim::damerau_levenshtein(&wrong, &name.to_lowercase());
    let alike = |name: &&&str| {
        slips(name) <= (wrong.chars().count() / 3).max(1)
            || strsim::jaro_winkler(&wrong, &name.to_lowercase()) > 0.85
    };
    names.iter().filter(alike).min_by_key(|name| slips(name)).copied()
}

/// Where a dotted path stands in the text: the key, or the element of an array; the deepest part that is
/// written there when the rest is not.
pub(super) fn span_of(table: &Spanned<DeTable<'_>>, path: &str) -> Range<usize> {
    let mut found = None;
    let mut value: Option<&Spanned<DeValue<'_>>> = None;
    for part in path.split('.') {
        let table = match value {
            None => Some(table.get_ref()),
            Some(v) => v.get_ref().as_table(),
        };
        let next = if let Some(table) = table {
            table.iter().find(|(k, _)| k.get_ref() == part).map(|(k, v)| (k.span(), v))
        } else {
            let item = value.and_then(|v| v.get_ref().as_array()).zip(part.parse::<usize>().ok());
            item.and_then(|(array, k)| array.get(k)).map(|v| (v.span(), v))
        };
        let Some((span, v)) = next else { break };
        (found, value) = (Some(span), Some(v));
    }
    found.unwrap_or(0..0)
}

/// Dotted path of the key or value that a span lies in.
fn path_at(table: &DeTable<'_>, span: &Range<usize>) -> Option<String> {
    let mut best: Option<(usize, String)> = None;
    visit_table(table, "", span, &mut best);
    best.map(|(_, path)| path)
}

fn offer(at: Range<usize>, path: &str, span: &Range<usize>, best: &mut Option<(usize, String)>) {
    let fits = at.start <= span.start && span.end <= at.end && !at.is_empty();
    if fits && best.as_ref().is_none_or(|(size, _)| at.len() <= *size) {
        *best = Some((at.len(), path.to_owned()));
    }
}

fn visit_table(table: &DeTable<'_>, prefix: &str, span: &Range<usize>, best: &mut Option<(usize, String)>) {
    for (key, value) in table {
        let path =
            if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
        offer(key.span(), &path, span, best);
        visit(value, &path, span, best);
    }
}

fn visit(value: &Spanned<DeValue<'_>>, path: &str, span: &Range<usize>, best: &mut Option<(usize, String)>) {
    offer(value.span(), path, span, best);
    match value.get_ref() {
        DeValue::Table(table) => visit_table(table, path, span, best),
        DeValue::Array(array) => {
            for (k, item) in array.iter().enumerate() {
                visit(item, &format!("{path}.{k}"), span, best);
            }
        }
        _ => {}
    }
}
