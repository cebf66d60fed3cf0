//! Reading a case file: text, overrides, parsing, checking; errors that point at file, line and key.

use super::brackets::mistaken;
use super::check::check;
use super::copies::lay_out;
use super::motion_file::inline;
use super::report::{Message, closest, explain, render, span_of};
use super::surplus::surplus;
use super::values::from_table;
use super::{Case, overrides};
use crate::error::{CaseError, Error, Problem, Result};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::DeTable;

/// Problems that are shown; nobody reads a thousand, and each takes its time.
const MOST_SHOWN: usize = 20;

/// A case that was read, and the text that it came from.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The case.
    pub case: Case,
    /// The TOML text with overrides applied: what a run should keep beside its results.
    pub text: String,
    /// The file.
    pub path: PathBuf,
    /// Warnings, ready to print; the case runs all the same.
    pub warnings: Vec<String>,
    /// Whether overrides were applied, so that lines are those of the text and not of the file.
    overridden: bool,
}

impl Loaded {
    /// An error about the case that knows no place, as the scene's do, with file and line of its keys.
    pub fn placed(&self, error: Error) -> Error {
        let Error::Case(found) = &error else { return error };
        let Ok(table) = DeTable::parse(&self.text) else { return error };
        let of = |p: &Problem| {
            let key = &p.key;
            let span = span_of(&table, key);
            let known = p.file.is_none() && !span.is_empty();
            known.then(|| Message {
                span,
                key: key.clone(),
                title: if p.message.starts_with(key) {
                    p.message.clone()
                } else {
                    format!("{key}: {}", p.message)
                },
                label: key.clone(),
                remedy: Some(p.remedy.clone()).filter(|r| !r.is_empty()),
                warning: false,
            })
        };
        let problems = self.case.written.problems(found.problems.clone());
        let Some(messages) = problems.iter().map(of).collect::<Option<Vec<_>>>() else { return error };
        let name = self.path.display().to_string();
        let mut report = render(&name, &self.text, &messages[..messages.len().min(MOST_SHOWN)]);
        report.push_str(&and_more(messages.len()));
        if self.overridden {
            report.push_str(OVERRIDDEN);
        }
        let problems = messages.iter().map(|m| m.problem(&name, &self.text)).collect();
        CaseError::new(problems, report).into()
    }
}

/// Said where lines are not those of the file.
const OVERRIDDEN: &str = "\n\nnote: lines are counted with --spacing and --set applied";

/// Said of the rest of `problems` of which [`MOST_SHOWN`] are shown.
fn and_more(problems: usize) -> String {
    match problems.saturating_sub(MOST_SHOWN) {
        0 => String::new(),
        more => format!("\n\nerror: and {more} more"),
    }
}

/// Reads a case: `spacing` overrides `run.spacing` [m], `sets` are `key=value` pairs such as
/// `body.0.density=780`.
///
/// # Errors
/// [`Error::Case`] with everything that is wrong with the file or the overrides, [`Error::Io`] when the file
/// exists but cannot be read.
pub fn load(path: &Path, spacing: Option<f64>, sets: &[String]) -> Result<Loaded> {
    let read = std::fs::File::open(path).and_then(read_text);
    let text = read.map_err(|source| match source.kind() {
        std::io::ErrorKind::IsADirectory => Error::file(path.display().to_string(), "", folder(path)),
        std::io::ErrorKind::NotFound => Error::file(path.display().to_string(), "", missing(path)),
        std::io::ErrorKind::InvalidData => {
            let name = path.display().to_string();
            Error::file(name.clone(), "", format!("{name}: not a text file in UTF-8"))
        }
        _ => Error::io(path)(source),
    })?;
    load_text(path, text, spacing, sets)
}

/// Most bytes of a case or of a table beside it; what is longer is something else.
const LONGEST: u64 = 64 << 20;

/// The text of a case, or of a table, from `source`.
///
/// # Errors
/// What the source says, and [`std::io::ErrorKind::InvalidData`] if it is no text, [`std::io::ErrorKind::FileTooLarge`] if it
/// does not end within 64 MB.
pub fn read_text(source: impl std::io::Read) -> std::io::Result<String> {
    let mut text = String::new();
    let length = std::io::Read::read_to_string(&mut source.take(LONGEST + 1), &mut text)?;
    // Some editors and spreadsheets put a byte order mark in front.
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    if length as u64 > LONGEST {
        let why = "longer than 64 MB, which no case and no table is";
        return Err(std::io::Error::new(std::io::ErrorKind::FileTooLarge, why));
    }
    Ok(text)
}

/// [`load`], of a text that stands for the file `path`.
///
/// # Errors
/// As [`load`].
pub fn load_text(path: &Path, text: String, spacing: Option<f64>, sets: &[String]) -> Result<Loaded> {
    let mut all = Vec::new();
    if let Some(l0) = spacing {
        all.push(format!("run.spacing={}", toml_edit::Value::from(l0)));
    }
    all.extend_from_slice(sets);
    let name = path.display().to_string();
    let text = inline(path, with_sets(&name, text, &all)?)?;
    let (mut case, mut text, warnings) = read(&name, text, !all.is_empty())?;
    // What a case says of its place holds no more for its copy beside the results.
    let mut places = vec![("run.from".to_owned(), case.run.from.clone())];
    places.extend(case.files().into_iter().map(|(key, file)| (key, Some(file.clone()))));
    // Copies have one table.
    places.dedup();
    let mut absolute = Vec::new();
    for (key, place) in places {
        if let Some(place) = place.map(PathBuf::from).filter(|p| p.is_relative()) {
            let place = std::path::absolute(path.with_file_name("").join(place)).map_err(Error::io(path))?;
            absolute.push(format!("{key}={}", toml_edit::Value::from(place.display().to_string())));
        }
    }
    if !absolute.is_empty() {
        (case, text, _) = parse(&name, text, &absolute)?;
    }
    Ok(Loaded { case, text, path: path.to_owned(), warnings, overridden: !all.is_empty() })
}

/// Parses and checks the text of a case; `name` stands for the file in messages. Returns the case, the text
/// with overrides applied and warnings.
///
/// # Errors
/// [`Error::Case`] with everything that is wrong.
pub fn parse(name: &str, text: String, sets: &[String]) -> Result<(Case, String, Vec<String>)> {
    read(name, with_sets(name, text, sets)?, !sets.is_empty())
}

/// `text` with overrides applied.
fn with_sets(name: &str, text: String, sets: &[String]) -> Result<String> {
    let text = text.replace("\r\n", "\n");
    // Broken TOML is reported on the text as it stands in the file.
    if let Err(error) = DeTable::parse(&text) {
        let message = explain(error.message(), error.span(), None);
        let problem = message.problem(name, &text);
        return Err(CaseError::new(vec![problem], render(name, &text, &[message])).into());
    }
    if sets.is_empty() { Ok(text) } else { overrides::apply(&text, sets) }
}

/// What a file beside cases says in TOML, a study's, with messages as those of a case; `name` stands for the file in
/// them.
///
/// # Errors
/// [`Error::Case`] with line and column.
pub fn parse_as<T: serde::de::DeserializeOwned>(name: &str, text: &str) -> Result<T> {
    let wrong = |message: Message| {
        // `seixo keys` knows those of cases.
        let remedy = message.remedy.clone().filter(|r| !r.contains("`seixo "));
        let message = Message { remedy, ..message };
        let problem = message.problem(name, text);
        Error::from(CaseError::new(vec![problem], render(name, text, &[message])))
    };
    let table = DeTable::parse(text).map_err(|e| wrong(explain(e.message(), e.span(), None)))?;
    from_table(&table).map_err(|e| wrong(explain(e.message(), e.span(), Some(table.get_ref()))))
}

/// `problem` with a key of such a file, as an error that shows where it stands; `name` and `text` as of [`parse_as`].
pub fn located(name: &str, text: &str, problem: &Problem) -> Error {
    let span = DeTable::parse(text).map_or(0..0, |table| span_of(&table, &problem.key));
    let message = message_of(problem, span);
    CaseError::new(vec![message.problem(name, text)], render(name, text, &[message])).into()
}

/// A problem that stands at `span`.
fn message_of(p: &Problem, span: Range<usize>) -> Message {
    Message {
        span,
        key: p.key.clone(),
        title: format!("{}: {}", p.key, p.message),
        label: p.message.clone(),
        remedy: Some(p.remedy.clone()).filter(|r| !r.is_empty()),
        warning: p.warning,
    }
}

/// [`parse`], of a text that is `overridden` already, or not.
fn read(name: &str, text: String, overridden: bool) -> Result<(Case, String, Vec<String>)> {
    let wrong = |messages: &[Message]| {
        let mut report = render(name, &text, messages);
        if overridden {
            report.push_str(OVERRIDDEN);
        }
        report
    };
    let unread = |message: Message| {
        let problem = message.problem(name, &text);
        CaseError::new(vec![problem], wrong(&[message]))
    };
    let table = DeTable::parse(&text).map_err(|e| unread(explain(e.message(), e.span(), None)))?;
    if let Some(message) = mistaken(table.get_ref()) {
        return Err(unread(message).into());
    }
    let mut case: Case =
        from_table(&table).map_err(|e| unread(explain(e.message(), e.span(), Some(table.get_ref()))))?;
    let located = |p: &Problem| message_of(p, span_of(&table, &p.key));
    let too_long = surplus(table.get_ref(), &case).into_iter().map(|s| {
        let message = format!("{} elements, of which only the first {} would be read", s.written, s.read);
        Problem::new(s.path, message, format!("write {} elements", s.read))
    });
    let too_long: Vec<Problem> = too_long.collect();
    let mut wrong_copies = lay_out(&mut case);
    let run = table.get_ref().get("run").and_then(|run| run.get_ref().as_table());
    let in_run = |key: &str| run.and_then(|run| run.get(key));
    let adaptive = in_run("adaptive").and_then(|value| value.get_ref().as_bool());
    let no_step = if in_run("time_step").is_none() { case.take_time_step(adaptive) } else { None };
    if wrong_copies.is_empty() {
        wrong_copies = case.written.problems(check(&case));
    }
    let problems = too_long.into_iter().chain(no_step).chain(wrong_copies);
    let (warnings, errors): (Vec<_>, Vec<_>) = problems.partition(|p| p.warning);
    if !errors.is_empty() {
        let shown: Vec<Message> = errors.iter().take(MOST_SHOWN).map(located).collect();
        let mut report = wrong(&shown);
        report.push_str(&and_more(errors.len()));
        let problems = errors.iter().map(|p| located(p).problem(name, &text)).collect();
        return Err(CaseError::new(problems, report).into());
    }
    let warnings = warnings.iter().take(MOST_SHOWN).map(|p| wrong(&[located(p)])).collect();
    drop(table);
    Ok((case, text, warnings))
}

/// A folder instead of a file: says so, and what to do with one of results.
fn folder(path: &Path) -> String {
    let shown = path.display();
    let copy = path.join("case.toml");
    let more = if copy.exists() {
        format!(", and in results it is {}; `seixo run --resume {shown}` goes on with them", copy.display())
    } else {
        String::new()
    };
    format!("{shown} is a folder: a case is a file{more}")
}

/// No such file: says so, and which file of the folder has a name like it.
fn missing(path: &Path) -> String {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let files: Vec<String> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|file| file.ends_with(".toml"))
        .collect();
    let names: Vec<&str> = files.iter().map(String::as_str).collect();
    let wanted = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let whole = format!("{wanted}.toml");
    let like = names.iter().copied().find(|name| *name == whole).or_else(|| closest(&wanted, &names));
    let hint = like.map(|n| format!("; did you mean `{}`?", folder.join(n).display()));
    format!("no case file at `{}`{}", path.display(), hint.unwrap_or_default())
}

impl Case {
    /// The files of its meshes and the keys that name them, as they are written.
    pub(crate) fn files(&mut self) -> Vec<(String, &mut String)> {
        let obstacles = self.obstacle.iter_mut().map(|o| ("obstacle", &mut o.file));
        let walls = self.moving_wall.iter_mut().map(|w| ("moving_wall", &mut w.file));
        let water = self.fluid.iter_mut().flat_map(|f| &mut f.shape).map(|w| ("fluid.shape", &mut w.file));
        let bodies = self.body.iter_mut().map(|b| ("body", &mut b.file));
        let (mut numbered, written) = (Vec::new(), &self.written);
        for (k, (table, file)) in
            obstacles.enumerate().chain(walls.enumerate()).chain(water.enumerate()).chain(bodies.enumerate())
        {
            numbered.extend(file.as_mut().map(|file| (written.key(&format!("{table}.{k}.file")), file)));
        }
        numbered
    }

    /// The case in the file `path`.
    ///
    /// # Errors
    /// As [`load`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Ok(load(path.as_ref(), None, &[])?.case)
    }

    /// The JSON schema of a case file, for editors (`#:schema` in the first line) and for `seixo schema`.
    pub fn schema() -> &'static str {
        crate::schemas::CASE
    }
}

impl std::str::FromStr for Case {
    type Err = Error;

    /// A case from the text of a file.
    fn from_str(text: &str) -> Result<Self> {
        Ok(parse("case", text.to_owned(), &[])?.0)
    }
}
