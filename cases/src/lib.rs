//! The case, study, validation and reference files that come with seixo, as they stood when it was built. A package of their
//! own, because what a package is published with lies in its folder.

use include_dir::{Dir, include_dir};

static CASES: Dir = include_dir!("$CARGO_MANIFEST_DIR");

/// `hydrostatic.toml`: water at rest.
pub const HYDROSTATIC: &str = include_str!("../hydrostatic.toml");
/// `dam_break.toml`: a column of water collapses.
pub const DAM_BREAK: &str = include_str!("../dam_break.toml");
/// `dam_break_transport.toml`: it picks up a cube.
pub const DAM_BREAK_TRANSPORT: &str = include_str!("../dam_break_transport.toml");
/// `resting_cube.toml`: a cube on a floor, without water.
pub const RESTING_CUBE: &str = include_str!("../resting_cube.toml");
/// `floating_cube.toml`: a cube afloat.
pub const FLOATING_CUBE: &str = include_str!("../floating_cube.toml");

/// The text of the file `path`, e.g. `study/dam_break.toml`; `.` and `..` are followed. Nothing if there is none.
pub fn text(path: &str) -> Option<&'static str> {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    CASES.get_file(parts.join("/"))?.contents_utf8()
}

/// Names, without `.toml`, of the files of `folder`, sorted; "" is where the cases are.
pub fn names(folder: &str) -> Vec<&'static str> {
    let dir = if folder.is_empty() { Some(&CASES) } else { CASES.get_dir(folder) };
    let files = dir.into_iter().flat_map(Dir::files);
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
        let hydrostatic = text("hydrostatic.toml").unwrap();
        assert_eq!(text("study/../hydrostatic.toml").unwrap(), hydrostatic);
        assert!(text("study/hydrostatic.toml").unwrap() != hydrostatic);
        assert!(text("study/none.toml").is_none());
        assert!(names("study").contains(&"hydrostatic"));
        assert!(names("").contains(&"dam_break"));
    }
}
