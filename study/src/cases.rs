//! The case, study, validation and reference files that come with the program.

use seixo::error::{Error, Result};
pub use seixo_cases::names;

/// The text of `name`, relative to `folder` of the cases (`study`, `validation`, or nothing).
///
/// # Errors
/// [`Error::Usage`] if there is no such file.
pub fn text(folder: &str, name: &str) -> Result<String> {
    let text = seixo_cases::text(&format!("{folder}/{name}"));
    text.map(str::to_owned).ok_or_else(|| Error::usage("name", format!("`{name}` is not built in")))
}
