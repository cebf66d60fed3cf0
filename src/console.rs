//! Words for the user: results on standard output, remarks on standard error.
//!
//! Names and texts of case files are shown with control characters made visible, so that no file can steer the
//! terminal. A reader that goes away ends no run. On a terminal lines are broken between words.

use crate::error::{Error, Result};
use std::borrow::Cow;
use std::io::Write;
use std::sync::{Mutex, OnceLock};

/// `text` with control characters, but for line ends and tabs, replaced by their pictures.
pub(crate) fn visible(text: &str) -> Cow<'_, str> {
    let hidden = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !text.contains(hidden) {
        return Cow::Borrowed(text);
    }
    let shown = |c: char| match u32::from(c) {
        _ if !hidden(c) => c,
        n @ 0..0x20 => char::from_u32(0x2400 + n).unwrap_or(char::REPLACEMENT_CHARACTER),
        0x7f => '\u{2421}',
        _ => char::REPLACEMENT_CHARACTER,
    };
    Cow::Owned(text.chars().map(shown).collect())
}

/// Columns of the terminals that standard output and standard error are, if they are.
static COLUMNS: OnceLock<[Option<usize>; 2]> = OnceLock::new();

/// Breaks the lines of [`tell`] and [`remark`] for terminals of so many columns: those that standard output and standard
/// error are, if they are.
pub fn fit(columns: [Option<usize>; 2]) {
    let _ = COLUMNS.set(columns);
}

/// `text` as stream `k` of [`COLUMNS`] shows it.
fn fitted(text: &str, k: usize) -> Cow<'_, str> {
    let columns = COLUMNS.get().and_then(|columns| columns[k]);
    columns.map_or(Cow::Borrowed(text), |columns| Cow::Owned(wrapped(text, columns)))
}

/// Narrowest terminal that lines are broken for.
const NARROWEST: usize = 40;

/// The lines of `text`, those of more than `width` letters broken between words; what goes on is set in by four.
fn wrapped(text: &str, width: usize) -> String {
    let lines = text.lines().map(|line| broken(line, width.max(NARROWEST)));
    lines.collect::<Vec<_>>().join("\n")
}

fn broken(line: &str, width: usize) -> String {
    let indent = line.chars().take_while(|&c| c == ' ').count();
    let (mut done, mut rest, mut before) = (String::new(), line.to_owned(), indent);
    while rest.chars().count() > width {
        // A break within the indent would make no way; a word that is longer than a line stays whole.
        let blanks = || rest.char_indices().enumerate().filter(|&(_, (at, c))| c == ' ' && at > before);
        let within = blanks().take_while(|&(k, _)| k <= width).last();
        let Some((_, (at, _))) = within.or_else(|| blanks().next()) else { break };
        done.push_str(rest[..at].trim_end());
        done.push('\n');
        before = indent + 4;
        rest = format!("{}{}", " ".repeat(before), rest[at..].trim_start());
    }
    done + &rest
}

/// Why a result did not reach standard output, if one did not.
static LOST: Mutex<Option<std::io::Error>> = Mutex::new(None);

/// A result, on standard output. If it cannot be written the program goes on, and [`lost`] tells at its end.
pub fn say(text: &str) {
    let mut out = std::io::stdout().lock();
    let written = out.write_all(visible(text).as_bytes()).and_then(|()| out.write_all(b"\n"));
    if let (Err(e), Ok(mut lost)) = (written.and_then(|()| out.flush()), LOST.lock()) {
        lost.get_or_insert(e);
    }
}

/// Words for a person, on standard output, as [`say`], but broken for its terminal.
pub fn tell(text: &str) {
    say(&fitted(text, 0));
}

/// A value as JSON, on standard output, as [`say`].
pub fn say_json(value: &impl serde::Serialize) {
    match serde_json::to_string_pretty(value) {
        Ok(text) => say(&text),
        Err(error) => remark(&format!("error: {error}")),
    }
}

/// The error of a result that could not be written: whoever waits for it did not get it.
///
/// # Errors
/// [`Error::Io`] if there is one.
pub fn lost() -> Result<()> {
    let lost = LOST.lock().ok().and_then(|mut lost| lost.take());
    // Whoever reads on no further, as `head` does, has what it wanted.
    let lost = lost.filter(|e| e.kind() != std::io::ErrorKind::BrokenPipe);
    lost.map_or(Ok(()), |e| Err(Error::io("standard output")(e)))
}

/// A remark, on standard error. Where nobody listens it is lost.
pub fn remark(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{}", fitted(&visible(text), 1));
}

#[cfg(test)]
mod tests {
    use super::{visible, wrapped};

    #[test]
    fn lines_break_between_words() {
        let text = "advice\n  time step: typed 1.000e-3 s; the flow allows 8.8e-4 s, the sound 1.4e-3 s";
        let told = wrapped(text, 50);
        assert!(told.lines().all(|l| l.chars().count() <= 50), "{told}");
        assert_eq!(told.split_whitespace().collect::<String>(), text.split_whitespace().collect::<String>());
        assert!(told.lines().nth(2).is_some_and(|l| l.starts_with("      ")), "{told}");
        // Letters of several bytes are letters, and words that are too long break nothing.
        let wide = format!("note: body `{}` lies {} in the water", "\u{fc}".repeat(60), "x".repeat(90));
        let told = wrapped(&wide, 50);
        assert_eq!(told.split_whitespace().collect::<String>(), wide.split_whitespace().collect::<String>());
        assert_eq!(told.lines().last(), Some("    in the water"), "{told}");
        let long = "x".repeat(90);
        assert_eq!(wrapped(&long, 50), long);
    }

    #[test]
    fn nothing_steers_the_terminal() {
        assert_eq!(visible("a\tb\nc"), "a\tb\nc");
        assert_eq!(visible("\u{1b}[2J\u{7f}\u{9b}31m"), "\u{241b}[2J\u{2421}\u{fffd}31m");
    }
}
