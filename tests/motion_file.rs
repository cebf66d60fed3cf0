//! Tables of motion from files.

use crate::cli::{ran, small_case};
use std::path::Path;

const ROWS: &str = "# a gate\n time [s], x [m], y [m], z [m]\r\n0, 0, 0, 0\n\n0.02,0,0,0.004\n1e0,0,0,0.5\n";

fn case(folder: &Path, motion: &str) -> String {
    let path = small_case(folder);
    let text = std::fs::read_to_string(&path).unwrap();
    let rows = "motion = [[0, 0, 0, 0], [1, 0, 0, 0.5]]";
    assert!(text.contains(rows));
    std::fs::write(&path, text.replace(rows, motion)).unwrap();
    path
}

#[test]
fn a_wall_follows_its_file_as_it_follows_rows() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("curves")).unwrap();
    std::fs::write(folder.path().join("curves/gate.csv"), ROWS).unwrap();
    let run = |name: &str, motion: &str, more: &[&str]| {
        let path = case(folder.path(), motion);
        let out = folder.path().join(name);
        let shown = out.display().to_string();
        let ran = ran(&[&["run", &path, "-o", &shown, "--backend", "cpu", "-q"], more].concat());
        assert_eq!((ran.code, ran.err.as_str()), (0, ""), "{name}");
        let read = |file: &str| std::fs::read_to_string(out.join(file)).unwrap();
        (read("bodies.csv"), read("case.toml"))
    };
    let rows = run("rows", "motion = [[0, 0, 0, 0], [0.02, 0, 0, 0.004], [1, 0, 0, 0.5]]", &[]);
    let file = run("file", "motion = \"curves/gate.csv\"  # up", &[]);
    assert_eq!(file.0, rows.0);
    // The case beside the results is whole without the file.
    assert!(file.1.contains("[0.02, 0.0, 0.0, 0.004]") && file.1.contains("# up"), "{}", file.1);
    let set = ["--set", "moving_wall.0.motion=curves/gate.csv"];
    assert_eq!(run("set", "motion = [[0, 0, 0, 0], [1, 0, 0, 0.1]]", &set).0, rows.0);
    // What is overridden need not be there.
    assert_eq!(run("instead", "motion = \"curves/gone.csv\"", &set).0, rows.0);
    // Spreadsheets begin a file with a byte order mark; without names, too.
    std::fs::write(
        folder.path().join("curves/marked.csv"),
        format!("\u{feff}{}", &ROWS[ROWS.find("0, 0").unwrap()..]),
    )
    .unwrap();
    assert_eq!(run("marked", "motion = \"curves/marked.csv\"", &[]).0, rows.0);
    // A file that has changed since is another case.
    std::fs::write(folder.path().join("curves/gate.csv"), ROWS.replace("0.004", "0.003")).unwrap();
    let path = case(folder.path(), "motion = \"curves/gate.csv\"");
    let shown = folder.path().join("file").display().to_string();
    let changed = ran(&["run", &path, "-o", &shown, "--resume", "--backend", "cpu"]);
    assert!(changed.code == 2 && changed.err.contains("moving_wall.0.motion"), "{}", changed.err);
}

#[test]
fn a_file_is_named_in_a_table_on_one_line_and_by_an_override_of_it() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("gate.csv"), ROWS).unwrap();
    let path = folder.path().join("line.toml");
    let text = "run = {spacing = 0.1, time_step = 1e-3, end = 1, dimensions = 2}\n\
                tank = {min = [0, 0, 0], max = [1, 0, 1]}\n\
                moving_wall = [{name = \"gate\", min = [0.4, 0, 0], max = [0.6, 0, 0.5], motion = \"gate.csv\"}]\n";
    std::fs::write(&path, text).unwrap();
    let rows = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
        seixo::case::file::load(&path, None, &sets).unwrap().case.moving_wall[0].motion.clone()
    };
    assert_eq!(rows(&[])[1], [0.02, 0.0, 0.0, 0.004]);
    let wall = "moving_wall=[{name=\"gate\",min=[0.4,0,0],max=[0.6,0,0.5],motion=\"gate.csv\"}]";
    assert_eq!(rows(&[wall]), rows(&[]));
}

#[test]
fn a_wall_turns_as_its_file_says() {
    let folder = tempfile::tempdir().unwrap();
    let written = "t [s],x [degrees],y [degrees],z [degrees]\n0,0,0,0\n0.01,0,2,0\n0.02,0,2,0\n";
    std::fs::write(folder.path().join("turn.csv"), written).unwrap();
    let run = |name: &str, rotation: &str| {
        let path = case(folder.path(), &format!("rotation = {rotation}"));
        let out = folder.path().join(name);
        let run = ran(&["run", &path, "--backend", "cpu", "-q", "-o", out.to_str().unwrap()]);
        assert_eq!(run.code, 0, "{}", run.err);
        std::fs::read_to_string(out.join("bodies.csv")).unwrap()
    };
    assert_eq!(run("file", "\"turn.csv\""), run("rows", "[[0, 0, 0, 0], [0.01, 0, 2, 0], [0.02, 0, 2, 0]]"));
    std::fs::write(folder.path().join("turn.csv"), written.replace("y [degrees]", "y [rad]")).unwrap();
    let plan = ran(&["plan", &case(folder.path(), "rotation = \"turn.csv\"")]);
    assert!(
        plan.code == 2 && plan.err.contains("turn.csv:1: `y` is in [rad]: write time [s] and angles"),
        "{}",
        plan.err
    );
}

#[test]
fn what_is_wrong_with_a_file_is_told_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = case(folder.path(), "motion = \"gate.csv\"");
    let told = |text: &[u8]| {
        std::fs::write(folder.path().join("gate.csv"), text).unwrap();
        let plan = ran(&["plan", &path]);
        assert_eq!(plan.code, 2, "{}", plan.err);
        plan.err
    };
    for (text, words) in [
        (&b"0,0,0,0\n1,0,0\n"[..], "gate.csv:2: expected time [s] and displacement x, y, z [m]"),
        (b"t,x,y,z\n0,0,0,0\n1,0,0,a\n", "gate.csv:3: expected time"),
        // Only names have letters.
        (b"0;0;0;0\n0,0,0,0\n", "gate.csv:1: expected time"),
        (b"--,--,--,--\n0,0,0,0\n", "gate.csv:1: expected time"),
        (b"time[ms],x[m],y[m],z[m]\n0,0,0,0\n", "gate.csv:1: `time` is in [ms]: write time [s]"),
        (b"t,x [mm],y,z\n0,0,0,0\n", "gate.csv:1: `x` is in [mm]"),
        (b"t,z,y,x\n0,0,0,0\n", "gate.csv:1: `z` stands where another axis is read: write time [s]"),
        (b"0,0,0,0\n1,0,0,nan\n", "gate.csv:2: expected time"),
        (b"0,0,0,0\n1,0,0,1\n1,0,0,2\n", "gate.csv:3: time 1 does not come after 1"),
        (b"# nothing\n", "gate.csv: it holds no rows"),
        (b"\xff\xfe\n", "gate.csv: not a text file"),
        (b"0,0,0,0.3\n1,0,0,0.5\n", "so that the solid would jump there in the first step"),
    ] {
        let err = told(text);
        assert!(err.contains(words), "{words}: {err}");
        assert_eq!(err.matches("error").count(), 1, "{err}");
    }
    std::fs::remove_file(folder.path().join("gate.csv")).unwrap();
    let plan = ran(&["plan", &path]);
    assert!(
        plan.code == 2 && plan.err.contains("gate.csv: no such file; `moving_wall.0.motion` of the case"),
        "{}",
        plan.err
    );
    let number = case(folder.path(), "motion = 7");
    assert_eq!(ran(&["plan", &number]).code, 2);
}

/// A discharge of each metre across is none of the whole width.
#[test]
fn a_discharge_has_the_unit_of_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("channel.toml");
    for (dimensions, unit, fits) in
        [(2, "m2/s", true), (2, "m3/s", false), (3, "m^3/s", true), (3, "m2/s", false)]
    {
        std::fs::write(folder.path().join("q.csv"), format!("t [s], q [{unit}]\n0,0\n1,0.02\n")).unwrap();
        let text = format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 0.1\ndimensions = {dimensions}\n\
             [tank]\nmin = [0, 0, 0]\nmax = [1, 0.5, 0.5]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0.5, 0.3]\n\
             [[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0.5, 0.2]\ndischarge = \"q.csv\"\n"
        );
        let read = seixo::case::file::load_text(&path, text, None, &[]).map_err(|e| e.to_string());
        assert_eq!(read.is_ok(), fits, "{dimensions} {unit}: {read:?}");
        let own = if dimensions == 2 { "[m2/s] in two" } else { "[m3/s] in three" };
        assert!(read.is_ok() || read.is_err_and(|e| e.contains("`q` is in [") && e.contains(own)));
    }
}
