//! Studies whose cases name files, and parts of studies that are joined where those files are not.

use crate::meshes::{cuboid, stl};
use glam::DVec3;
use std::path::Path;

/// A box from a file falls onto a table that goes down as a file says.
const CASE: &str = r#"
[run]
spacing = 0.05
time_step = 1e-3
end = 0.05
[tank]
min = [0, 0, 0]
max = [0.6, 0.4, 0.6]
[[body]]
name = "hull"
shape = "mesh"
file = "hull.stl"
center = [0.3, 0.2, 0.45]
density = 500
[[moving_wall]]
name = "table"
min = [0.1, 0.1, 0.1]
max = [0.5, 0.3, 0.15]
motion = "table.csv"
[contact]
spring = 1e5
"#;
const STUDY: &str = r#"
name = "hulls"
title = "Hulls"
case = "cases/hull.toml"
method = "{density}"
repetitions = 1
[measure]
of = ["bodies"]
[[axis]]
name = "density"
key = "body.0.density"
values = [400, 500]
full_values = [600]
[[result]]
name = "table [m]"
curve = "table z [m]"
take = "smallest"
"#;

fn write(folder: &Path, name: &str, text: &str) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, text).unwrap();
}

fn hull(folder: &Path, height: f64) {
    write(folder, "s/cases/hull.stl", &stl(&cuboid(DVec3::new(0.1, 0.1, height))));
}

/// The study in `folder`/s.
fn study(folder: &Path) {
    write(folder, "s/hulls.toml", STUDY);
    write(folder, "s/cases/hull.toml", CASE);
    write(folder, "s/cases/table.csv", "t,x,y,z\n0,0,0,0\n0.05,0,0,-0.01\n1,0,0,-0.01\n");
    hull(folder, 0.1);
}

fn run(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let out = crate::common::program().current_dir(folder).arg("study").args(arguments).output().unwrap();
    let text = String::from_utf8_lossy(&out.stdout).into_owned() + &String::from_utf8_lossy(&out.stderr);
    (out.status.code().unwrap_or(-1), text)
}

/// The column `name` of results.csv.
fn column(folder: &Path, name: &str) -> Vec<String> {
    let mut reader = csv::Reader::from_path(folder.join("results.csv")).unwrap();
    let place = reader.headers().unwrap().iter().position(|h| h == name);
    let place = place.unwrap_or_else(|| panic!("no column {name}"));
    reader.records().map(|row| row.unwrap()[place].to_owned()).collect()
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().map(|e| e.unwrap()) {
        let there = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &there);
        } else {
            std::fs::copy(entry.path(), there).unwrap();
        }
    }
}

#[test]
fn files_are_found_beside_the_case_and_one_that_changes_is_another_point() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    study(folder);
    let (code, text) = run(folder, &["s/hulls.toml", "-o", "out"]);
    assert_eq!(code, 0, "{text}");
    let out = folder.join("out");
    assert_eq!(column(&out, "class"), ["ok", "ok"], "{text}");
    // The table has gone down as the file says.
    assert!(column(&out, "table [m]").iter().all(|z| (z.parse::<f64>().unwrap() - 0.115).abs() < 1e-9));
    let first = column(&out, "hash");
    let (_, text) = run(folder, &["s/hulls.toml", "-o", "out"]);
    assert!(text.contains("2 of 2 points are finished already"), "{text}");
    // The same files elsewhere are the same points.
    copy(&folder.join("s"), &folder.join("moved"));
    assert_eq!(run(&folder.join("moved"), &["hulls.toml", "-o", "../out", "-q"]).0, 0);
    assert_eq!(column(&out, "hash"), first);
    hull(folder, 0.15);
    let (_, text) = run(folder, &["s/hulls.toml", "-o", "out"]);
    assert!(!text.contains("finished already"), "{text}");
    let second = column(&out, "hash");
    assert!(first.iter().all(|hash| !second.contains(hash)));
    write(folder, "s/cases/table.csv", "t,x,y,z\n0,0,0,0\n1,0,0,0\n");
    run(folder, &["s/hulls.toml", "-o", "out", "-q"]);
    assert!(column(&out, "hash").iter().all(|hash| !second.contains(hash)));
    // A case within the study names files beside that.
    let inside = STUDY.replace("case = \"cases/hull.toml\"", &format!("text = '''{CASE}'''"));
    write(folder, "s/cases/inside.toml", &inside);
    let (code, text) = run(folder, &["s/cases/inside.toml", "-o", "inside"]);
    assert_eq!(code, 0, "{text}");
    assert_eq!(column(&folder.join("inside"), "class"), ["ok", "ok"]);
}

#[test]
fn a_point_that_lacked_a_file_is_tried_again() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    study(folder);
    let other =
        STUDY.replace("body.0.density", "body.0.file").replace("[400, 500]", "[\"hull.stl\", \"late.stl\"]");
    write(folder, "s/hulls.toml", &other);
    let (code, text) = run(folder, &["s/hulls.toml", "-o", "out"]);
    assert_eq!(code, 0, "{text}");
    assert_eq!(column(&folder.join("out"), "class"), ["ok", "failed"]);
    assert!(column(&folder.join("out"), "reason")[1].contains("late.stl"));
    std::fs::copy(folder.join("s/cases/hull.stl"), folder.join("s/cases/late.stl")).unwrap();
    run(folder, &["s/hulls.toml", "-o", "out"]);
    assert_eq!(column(&folder.join("out"), "class"), ["ok", "ok"]);
}

#[test]
fn parts_are_joined_where_the_files_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    study(folder);
    let part = |more: &[&str], out: &str| {
        let (code, text) = run(folder, &[&["s/hulls.toml", "-o", out, "-q"], more].concat());
        assert_eq!(code, 0, "{text}");
    };
    part(&["--shard", "1/2"], "a");
    part(&["--shard", "2/2", "--full"], "b");
    part(&["--shard", "2/2", "--set", "contact.spring=2e5"], "set");
    // Another case with the same study file.
    hull(folder, 0.2);
    part(&["--shard", "2/2"], "changed");
    // On another machine there are the parts alone.
    let there = folder.join("there");
    ["a", "b", "set", "changed"].iter().for_each(|name| copy(&folder.join(name), &there.join(name)));
    std::fs::remove_dir_all(folder.join("s")).unwrap();
    // Point 1 of a, 2 of b; of the third, which is there with --full alone, neither has computed it.
    for order in [["a", "b"], ["b", "a"]] {
        let out = format!("of-{}", order[0]);
        let (code, text) = run(&there, &[&["collect"][..], &order, &["-o", &out]].concat());
        assert!(code == 0 && text.contains("1 of 3 points are still to be computed"), "{text}");
        assert_eq!(column(&there.join(out), "density"), ["400", "500"]);
    }
    for (other, words) in [
        ("set", "the one was computed with no --set, the other with --set contact.spring=2e5"),
        ("changed", "the case, or a file that it names, was another one"),
    ] {
        let (code, text) = run(&there, &["collect", "a", other, "-o", "mixed"]);
        assert!(code == 2 && text.contains("a and ") && text.contains(words), "{other}: {text}");
        assert!(!there.join("mixed").exists());
    }
    // Without a point there is nothing to join, and what is there stays.
    let before = std::fs::read(there.join("of-a/results.csv")).unwrap();
    for name in ["a", "of-a"] {
        std::fs::remove_dir_all(there.join(name).join("points")).unwrap();
    }
    let (code, text) = run(&there, &["collect", "a", "-o", "of-a"]);
    assert!(code == 2 && text.contains("none of the 2 points of this study is finished in a"), "{text}");
    assert_eq!(std::fs::read(there.join("of-a/results.csv")).unwrap(), before);
}

#[test]
fn what_is_kept_of_fewer_runs_and_of_another_version_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    study(folder);
    assert_eq!(run(folder, &["s/hulls.toml", "-o", "out", "-q"]).0, 0);
    let points = std::fs::read_dir(folder.join("out/points")).unwrap().map(|e| e.unwrap().path());
    let first = points.min().unwrap();
    let text = std::fs::read_to_string(&first).unwrap();
    let now = format!("\"version\": \"{}\"", env!("CARGO_PKG_VERSION"));
    assert!(text.contains(&now), "{text}");
    std::fs::write(&first, text.replace(&now, "\"version\": \"0.0.1\"")).unwrap();
    let (_, text) = run(folder, &["s/hulls.toml", "-o", "out", "--repetitions", "2"]);
    assert!(text.contains("1 of them are of another version of seixo"), "{text}");
    assert!(text.contains("2 of them were timed over fewer runs than --repetitions 2"), "{text}");
    let report = std::fs::read_to_string(folder.join("out/report.md")).unwrap();
    assert!(report.contains("seixo 0.0.1 (1 of 2 points), seixo"), "{report}");
}
