//! Words for the user: results on standard output, remarks on standard error.
//!
//! Names and texts of case files are shown with control characters made visible, so that no file can steer the
//! terminal. A reader that goes away ends no run.

use crate::error::{Error, Result};
use std::borrow::Cow;
use std::io::Write;
use std::sync::Mutex;

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
    lost.map_or(Ok(()), |e| Err(Error::io("standard output")(e)))
}

/// A remark, on standard error. Where nobody listens it is lost.
pub fn remark(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{}", visible(text));
}

#[cfg(test)]
mod tests {
    use super::visible;

    #[test]
    fn nothing_steers_the_terminal() {
        assert_eq!(visible("a\tb\nc"), "a\tb\nc");
        assert_eq!(visible("\u{1b}[2J\u{7f}\u{9b}31m"), "\u{241b}[2J\u{2421}\u{fffd}31m");
    }
}
