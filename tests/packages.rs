//! What is published builds from what is published: no package takes in a file from outside of its folder.

use crate::common::ROOT;
use std::path::{Component, Path, PathBuf};

/// Packages and the folders of their sources.
const PACKAGES: [&str; 4] = ["", "cases", "study", "cli"];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for path in std::fs::read_dir(folder).expect("readable").map(|e| e.expect("an entry").path()) {
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Relative paths that the macros of `text` take in.
fn included(text: &str) -> impl Iterator<Item = &str> {
    ["include_str!(", "include_bytes!(", "include_dir!(", "include!("].into_iter().flat_map(move |mark| {
        text.split(mark).skip(1).filter_map(|rest| rest.trim_start().strip_prefix('"')?.split('"').next())
    })
}

/// Folders that `path` goes down from `start`, which lies `depth` folders below that of the package; negative: out of it.
fn lowest(depth: i32, path: &str) -> i32 {
    let mut at = depth;
    let depths = Path::new(path).components().map(|part| {
        at += match part {
            Component::ParentDir => -1,
            Component::Normal(_) => 1,
            _ => 0,
        };
        at
    });
    depths.min().unwrap_or(depth)
}

#[test]
fn packages_take_in_their_own_files_alone() {
    let (mut seen, mut wrong) = (0, Vec::new());
    for package in PACKAGES {
        let root = Path::new(ROOT).join(package);
        let mut files = Vec::new();
        sources(&root.join("src"), &mut files);
        for file in files {
            let text = std::fs::read_to_string(&file).expect("readable");
            let depth = file.strip_prefix(&root).expect("inside").components().count() as i32 - 1;
            for path in included(&text) {
                seen += 1;
                let path = path.strip_prefix("$CARGO_MANIFEST_DIR").map_or((depth, path), |rest| (0, rest));
                if lowest(path.0, path.1.trim_start_matches('/')) < 0 {
                    wrong.push(format!("{} takes in {}", file.display(), path.1));
                }
            }
        }
    }
    assert!(seen >= 10, "the macros were found: {seen}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn ways_out_are_found() {
    let found: Vec<&str> = included(
        "include_str!(\"../a\"); include_str!(concat!(x)); include_dir!( \"$CARGO_MANIFEST_DIR/../b\")",
    )
    .collect();
    assert_eq!(found, ["../a", "$CARGO_MANIFEST_DIR/../b"]);
    assert_eq!(
        [lowest(1, "../a"), lowest(1, "../../cases/a"), lowest(0, "../b"), lowest(2, "x/a")],
        [0, -1, -1, 3]
    );
}
