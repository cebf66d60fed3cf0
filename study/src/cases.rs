//! The case, study, validation and reference files that come with the program, as they stood when it was built.

use include_dir::{Dir, include_dir};
use seixo::error::{Error, Result};

static CASES: Dir = include_dir!("$CARGO_MANIFEST_DIR/../cases");

/// The text of `name`, relative to `folder` of the cases (`study`, `validation`, or nothing).
///
/// # Errors
/// [`Error::Usage`] if there is no such file.
pub fn text(folder: &str, name: &str) -> Result<String> {
    let (mut parts, whole): (Vec<&str>, _) = (Vec::new(), format!("{folder}/{name}"));
    for part in whole.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    let text = CASES.get_file(parts.join("/")).and_then(|f| f.contents_utf8());
    text.map(str::to_owned).ok_or_else(|| Error::usage("name", format!("`{name}` is not built in")))
}

/// Names, without `.toml`, of the files of `folder`, sorted.
pub fn names(folder: &str) -> Vec<&'static str> {
    let files = CASES.get_dir(folder).into_iter().flat_map(Dir::files);
    let mut names: Vec<&str> = files
        .filter(|f| f.path().extension().is_some_and(|e| e == "toml"))
        .filter_map(|f| f.path().file_stem()?.to_str())
        .collect();
    names.sort_unstable();
    names
}

#[cfg(test)]
mod tests {
    use super::{names, text};

    #[test]
    fn files_are_found_from_the_folder_of_who_asks() {
        let hydrostatic = text("", "hydrostatic.toml").unwrap();
        assert_eq!(text("study", "../hydrostatic.toml").unwrap(), hydrostatic);
        assert!(text("study", "hydrostatic.toml").unwrap() != hydrostatic);
        assert!(text("study", "none.toml").is_err());
        assert!(names("study").contains(&"hydrostatic"));
    }
}
