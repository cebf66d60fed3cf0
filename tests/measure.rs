//! `seixo measure`: what is read from frames between the particles.

use crate::cli::seixo;
use std::path::Path;

/// Still water 0.5 m deep in two dimensions.
const STILL: &str = r#"
[run]
spacing = 0.025
time_step = 1e-3
end = 0.02
dimensions = 2
gravity = [0, 0, -10]
[tank]
min = [0, 0, 0]
max = [1, 0, 0.7]
open = ["z_max"]
[fluid]
[[fluid.block]]
min = [0, 0, 0]
max = [1, 0, 0.5]
[output]
every = 0.01
"#;

fn measured(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let output = seixo().current_dir(folder).args(["measure", "out"]).args(args).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

/// The rows of a table, numbers or nothing.
fn rows(table: &str) -> Vec<Vec<Option<f64>>> {
    table.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().ok()).collect()).collect()
}

#[test]
fn no_reader_writes_over_what_a_run_wrote() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("still.toml"), STILL).unwrap();
    let run = ["run", "still.toml", "-o", "out", "--backend", "cpu", "-q"];
    for more in [&[][..], &["--set", "gauge.level=[{name=\"h\",at=[0.5,0]}]", "--force"]] {
        seixo().current_dir(folder.path()).args(run).args(more).assert().success();
    }
    let again = ["run", "still.toml", "-o", "again", "--backend", "cpu", "-q"];
    seixo().current_dir(folder.path()).args(again).assert().success();
    std::fs::write(folder.path().join("mine.html"), "<html>mine</html>\n").unwrap();
    let line = ["measure", "out", "--line", "0.5,0,0,0.5,0,0.7", "--count", "2", "-o"];
    for (args, target) in [
        (&line[..], "out/monitors.csv"),
        (&line, "out/gauges.csv"),
        (&line, "out/case.toml"),
        (&line, "out/still.pvd"),
        (&["report", "out", "--pictures", "0", "-o"], "out/result.json"),
        // What is in the folders of a run, of another one, too.
        (&line, "out/vtu/fluid_0001.vtu"),
        (&["report", "out", "--pictures", "0", "-o"], "out/vtu/fluid_0000.vtu"),
        (&line, "out/checkpoint/new.csv"),
        // Files of somebody else: no case, mesh or page is a table.
        (&line, "still.toml"),
        (&["report", "out", "--pictures", "0", "-o"], "still.toml"),
        (&["report", "out", "--pictures", "0", "-o"], "mine.html"),
        (&["compare-runs", "out", "again", "-o"], "mine.html"),
        (&["bench", "still.toml", "-o"], "still.toml"),
        (&["bench", "still.toml", "-o"], "out/case.toml"),
    ] {
        let before = std::fs::read(folder.path().join(target)).ok();
        let output = seixo().current_dir(folder.path()).args(args).arg(target).output().unwrap();
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && err.contains(target), "{target}: {err}");
        assert_eq!(std::fs::read(folder.path().join(target)).ok(), before, "{target}");
    }
    // What the command itself has written it writes again, and an empty file is nobody's.
    std::fs::write(folder.path().join("empty.csv"), "").unwrap();
    for target in ["out/line.csv", "line.csv", "line.csv", "gauges.csv", "empty.csv"] {
        seixo().current_dir(folder.path()).args(line).arg(target).assert().success();
    }
    for _ in 0..2 {
        seixo()
            .current_dir(folder.path())
            .args(["compare-runs", "out", "again", "-o", "page.html"])
            .assert()
            .success();
        seixo().current_dir(folder.path()).args(["report", "out", "--pictures", "0"]).assert().success();
    }
    // Nor do pictures go where a run keeps its frames, or many runs where one is.
    for (args, why) in [
        (&["render", "out", "-o", "again/pictures"][..], "belongs to the run"),
        (&["validate", "front", "-o", "out"], "folder of a run"),
        (&["validate", "front", "-o", "v", "--join", "none"], "--join none: it holds no points"),
    ] {
        let output = seixo().current_dir(folder.path()).args(args).output().unwrap();
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && err.contains(why), "{args:?}: {err}");
    }
    assert!(!folder.path().join("out/points").exists() && !folder.path().join("v").exists());
}

#[test]
fn pressures_along_a_line_are_those_of_water_at_rest() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("still.toml"), STILL).unwrap();
    let run = ["run", "still.toml", "-o", "out", "--backend", "cpu", "-q"];
    seixo().current_dir(folder.path()).args(run).assert().success();

    let (code, table, err) =
        measured(folder.path(), &["--line", "0.5,0,0,0.5,0,0.7", "--count", "8", "--times", "0.02"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(table.starts_with("time [s],x [m],y [m],z [m],velocity_x [m/s],"), "{table}");
    let rows = rows(&table);
    assert_eq!(rows.len(), 8);
    let (_, parts, _) = measured(folder.path(), &["--line", "0,0,0.2,0.3,0,0.2", "--count", "7"]);
    assert!(parts.contains(",0.05,0,0.2,") && parts.contains(",0.15,0,0.2,"), "{parts}");
    for row in rows {
        let z = row[3].unwrap();
        assert!((row[0].unwrap() - 0.02).abs() < 1e-9);
        if z < 0.5 {
            let pressure = row[7].unwrap();
            assert!((pressure - 1e4 * (0.5 - z)).abs() < 0.05 * 5e3, "z = {z}: {pressure} Pa");
            assert!(row[4].unwrap().abs() < 0.05);
        } else if z > 0.55 {
            assert_eq!(row[4..], [None; 4], "z = {z}: there is no water");
        }
    }

    // All frames, points from a file, a table beside the results.
    std::fs::write(folder.path().join("points.csv"), "x,y,z\n0.2,0,0.1\n# the middle\n0.5,0,0.25\n").unwrap();
    let (code, said, _) =
        measured(folder.path(), &["--file", "points.csv", "--point", "0.9,0,0.3", "-o", "out/measure.csv"]);
    assert_eq!((code, said.trim()), (0, "9 rows in out/measure.csv"));
    assert_eq!(std::fs::read_to_string(folder.path().join("out/measure.csv")).unwrap().lines().count(), 10);

    let (code, _, err) = measured(folder.path(), &["--point", "0.5,0,0.69"]);
    assert!(code == 0 && err.contains("no point lies in the water"), "{err}");
    let (code, _, err) = measured(folder.path(), &[]);
    assert!(code == 2 && err.contains("--line"), "{err}");
    let (code, _, err) = measured(folder.path(), &["--point", "0.5,0"]);
    assert!(code == 2 && err.contains("write 3 numbers"), "{err}");
    std::fs::write(folder.path().join("points.csv"), "0.2,0,0.1\n0.5,0,x\n").unwrap();
    let (code, _, err) = measured(folder.path(), &["--file", "points.csv"]);
    assert!(code == 2 && err.contains("points.csv:2") && err.contains("`0.5,0,x`"), "{err}");
}

#[test]
fn with_either_preset_points_tell_the_pressure_that_gauges_do() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("still.toml"), STILL).unwrap();
    for preset in ["paper", "accurate"] {
        let (preset, gauge) =
            (format!("fluid.preset=\"{preset}\""), "gauge.pressure=[{name=\"p\",point=[0,0,0.25]}]");
        let run = [
            "run",
            "still.toml",
            "-o",
            "out",
            "--backend",
            "cpu",
            "-q",
            "--force",
            "--set",
            &preset,
            "--set",
            gauge,
        ];
        seixo().current_dir(folder.path()).args(run).assert().success();
        let gauges = std::fs::read_to_string(folder.path().join("out/gauges.csv")).unwrap();
        let gauge = rows(&gauges).pop().and_then(|row| row[1]).unwrap();
        let (code, out, err) = measured(folder.path(), &["--point", "0,0,0.25", "--times", "0.02"]);
        let point = rows(&out).pop().and_then(|row| row[7]).unwrap();
        // Of 2500 Pa half a spacing is 125.
        assert!(code == 0 && (point - gauge).abs() < 30.0, "{preset}: {point} for {gauge}\n{out}{err}");
    }
}

#[test]
fn points_whose_water_is_not_written_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let region = "region = { min = [0.3, 0, 0], max = [1, 0, 0.7] }\n";
    std::fs::write(folder.path().join("still.toml"), format!("{STILL}{region}")).unwrap();
    let run = ["run", "still.toml", "-o", "out", "--backend", "cpu", "-q"];
    seixo().current_dir(folder.path()).args(run).assert().success();
    // Outside, on its edge, within; the tank's own end is none of the region's.
    let points =
        ["--point", "0.1,0,0.2", "--point", "0.3,0,0.2", "--point", "0.6,0,0.2", "--point", "1,0,0.2"];
    let (code, _, told) = measured(folder.path(), &points);
    assert!(code == 0 && told.contains("2 of 4 points lie outside of the region that is written"), "{told}");
    let (code, _, told) = measured(folder.path(), &points[4..]);
    assert!(code == 0 && !told.contains("region"), "{told}");
}
