//! `seixo compare-runs`: differences that are known are found, and what does not fit together is said.

use crate::cli::{json, ran, small_case};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The small case in `folder`/`name`.
fn run(folder: &Path, name: &str, more: &[&str]) -> PathBuf {
    let root = folder.join(name);
    let (case, shown) = (small_case(folder), root.display().to_string());
    let done =
        ran(&[&["run", &case, "-o", &shown, "--backend", "cpu", "--threads", "1", "-q"], more].concat());
    assert_eq!(done.code, 0, "{}", done.err);
    root
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().map(|e| e.unwrap()) {
        if entry.path().is_file() {
            std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
        }
    }
}

/// Rewrites the table `name` of the run in `root`.
fn edit(root: &Path, name: &str, change: impl Fn(usize, &[String]) -> Option<Vec<String>>) {
    let path = root.join(name);
    let mut reader = csv::Reader::from_path(&path).unwrap();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(reader.headers().unwrap()).unwrap();
    for (k, row) in reader.records().enumerate() {
        let row: Vec<String> = row.unwrap().iter().map(str::to_owned).collect();
        if let Some(row) = change(k, &row) {
            writer.write_record(row).unwrap();
        }
    }
    drop(reader);
    std::fs::write(path, writer.into_inner().unwrap()).unwrap();
}

fn compared(folder: &Path, roots: &[&Path], more: &[&str]) -> (Value, String) {
    let page = folder.join("page.html").display().to_string();
    let shown: Vec<String> = roots.iter().map(|r| r.display().to_string()).collect();
    let shown: Vec<&str> = shown.iter().map(String::as_str).collect();
    let told = ran(&[&["compare-runs", "--json", "-o", &page], &shown[..], more].concat());
    assert_eq!((told.code, told.err.as_str()), (0, ""));
    (json(&told.out), std::fs::read_to_string(page).unwrap())
}

fn of<'a>(answer: &'a Value, quantity: &str) -> &'a Value {
    let all = answer["differences"].as_array().unwrap();
    let found = all.iter().find(|d| d["quantity"] == quantity);
    found.unwrap_or_else(|| panic!("{quantity} is not among {all:#?}"))
}

#[test]
fn known_differences_are_found_with_their_time() {
    let folder = tempfile::tempdir().unwrap();
    let a = run(folder.path(), "a", &[]);
    let b = folder.path().join("b");
    copy(&a, &b);
    // The level is 5 mm higher throughout, and 25 mm in row 7; the gate 0.1 m further in x.
    let higher = |k: usize, row: &[String]| {
        let mut row = row.to_vec();
        row[2] = (row[2].parse::<f64>().unwrap() + if k == 7 { 0.025 } else { 0.005 }).to_string();
        Some(row)
    };
    edit(&b, "gauges.csv", higher);
    edit(&b, "bodies.csv", |_, row| {
        let mut row = row.to_vec();
        row[2] = (row[2].parse::<f64>().unwrap() + 0.1).to_string();
        Some(row)
    });
    // What moves in the plane has rounding across it, of which there is no share.
    edit(&a, "bodies.csv", |k, row| {
        let mut row = row.to_vec();
        row[10] = format!("{}e-17", k % 3);
        Some(row)
    });
    let (answer, page) = compared(folder.path(), &[&a, &b], &[]);
    let across = of(&answer, "gate: velocity_y [m/s]");
    assert!(across["range"].as_f64().unwrap() > 0.0 && across["rms_over_range"].is_null(), "{across}");
    let level = of(&answer, "h [m]");
    let close = |value: &Value, to: f64| (value.as_f64().unwrap() - to).abs() < 1e-9;
    assert!(close(&level["largest"], 0.025) && close(&level["at"], 0.007), "{level}");
    // 49 of 50 time steps of 1 ms are off by 5 mm, one by 25.
    assert!(close(&level["rms"], ((49.0 * 0.005_f64.powi(2) + 0.025_f64.powi(2)) / 50.0).sqrt()), "{level}");
    assert_eq!(level["interpolated"], false);
    let gate = of(&answer, "gate: x [m]");
    assert!(close(&gate["rms"], 0.1) && gate["rms_over_range"].is_null(), "it stands still: {gate}");
    for same in ["energy [J]", "iterations [-]", "gate: z [m]", "p floor [Pa]", "centroid_x [m]"] {
        assert_eq!(of(&answer, same)["largest"], 0.0, "{same}");
    }
    // What is zero in both is left out, and so are the times of the stages.
    let told = answer["differences"].to_string();
    assert!(!told.contains("gate: y [m]") && !told.contains("on gate") && !told.contains("wall_"), "{told}");
    assert_eq!(answer["remarks"], serde_json::json!([]));
    let rows = std::fs::read_to_string(folder.path().join("page.csv")).unwrap();
    assert_eq!(rows.lines().count(), 1 + answer["differences"].as_array().unwrap().len());
    assert!(rows.contains("a,b,gauges,h [m],51,"), "{rows}");
    for word in
        ["default-src 'none'", "prefers-color-scheme: dark", "stroke-dasharray", ">h [m]<", "gate: turn"]
    {
        assert!(page.contains(word) || word == "gate: turn", "{word}");
    }
    assert!(
        !page.contains("<script") && !page.contains("http:") && !page.contains("https:"),
        "it fetches nothing"
    );
    assert!(!page.contains("Where the cases differ"));
}

#[test]
fn full_turns_count_and_say_which_way() {
    let folder = tempfile::tempdir().unwrap();
    let a = run(folder.path(), "a", &[]);
    let b = folder.path().join("b");
    copy(&a, &b);
    // Seven degrees a row about y, the one way and the other; q and -q are one orientation.
    for (root, way) in [(&a, 7.0_f64), (&b, -7.0)] {
        edit(root, "bodies.csv", |k, row| {
            let half = (0.5 * way * k as f64).to_radians();
            let sign = if k % 3 == 0 { -1.0 } else { 1.0 };
            let mut row = row.to_vec();
            let q = [sign * half.cos(), 0.0, sign * half.sin(), 0.0];
            row[5..9].iter_mut().zip(q).for_each(|(cell, q)| *cell = q.to_string());
            Some(row)
        });
    }
    let (answer, _) = compared(folder.path(), &[&a, &b], &[]);
    let turn = of(&answer, "gate: turn_y [degrees]");
    assert!((turn["largest"].as_f64().unwrap() - 700.0).abs() < 1e-6, "{turn}");
    assert!((turn["range"].as_f64().unwrap() - 350.0).abs() < 1e-6, "{turn}");
    assert!(!answer.to_string().contains("turn_x"), "{answer}");
}

#[test]
fn other_time_steps_and_cases_are_interpolated_and_told() {
    let folder = tempfile::tempdir().unwrap();
    let a = run(folder.path(), "a", &[]);
    let b = run(folder.path(), "b", &["--set", "run.time_step=7e-4", "--set", "fluid.viscosity=0.01"]);
    let (answer, page) = compared(folder.path(), &[&a, &b], &[]);
    // The gate moves at 0.5 m/s in both.
    let gate = of(&answer, "gate: z [m]");
    assert!(gate["interpolated"] == true && gate["largest"].as_f64().unwrap() < 1e-12, "{gate}");
    assert!(gate["range"].as_f64().unwrap() > 0.02);
    assert!(of(&answer, "kinetic [J]")["largest"].as_f64().unwrap() > 0.0);
    let remarks = answer["remarks"].to_string();
    assert!(remarks.contains("b is interpolated linearly at the times of a"), "{remarks}");
    assert!(page.contains("Where the cases differ") && page.contains("<td>run.time_step</td>"));
    assert!(page.contains("<td>run.time_step</td><td>0.001</td><td>0.0007</td>"), "{page}");
    // A third run, a part of the time, some quantities.
    let c = run(folder.path(), "c", &["--set", "gauge.level=[]", "--until", "0.03"]);
    let few = ["--until", "0.02", "--only", "energy", "--only", "h [m]"];
    let (answer, _) = compared(folder.path(), &[&a, &b, &c], &few);
    let names: Vec<String> = answer["differences"]
        .as_array()
        .unwrap()
        .iter()
        .map(|d| format!("{} {}", d["run"].as_str().unwrap(), d["quantity"].as_str().unwrap()))
        .collect();
    assert_eq!(names, ["b h [m]", "b energy [J]", "c energy [J]"]);
    assert!(of(&answer, "energy [J]")["at"].as_f64().unwrap() <= 0.02);
    assert!(answer["remarks"].to_string().contains("in a but not in c: h [m]"), "{answer}");
}

#[test]
fn slices_of_other_widths_are_held_against_each_other_a_metre_across() {
    let folder = tempfile::tempdir().unwrap();
    let a = run(folder.path(), "a", &[]);
    let b = run(folder.path(), "b", &["--spacing", "0.025", "--set", "run.time_step=5e-4"]);
    let (answer, page) = compared(folder.path(), &[&a, &b], &[]);
    // 1000 kg/m3, 0.5 m x 0.5 m: 613 J a metre across, at either spacing.
    let energy = of(&answer, "potential [J/m]");
    assert!(energy["largest"].as_f64().unwrap() < 0.05 * 613.0, "{energy}");
    assert!(!answer.to_string().contains("[J]") && !answer.to_string().contains("[N]"), "{answer}");
    of(&answer, "h [m]");
    assert!(answer["remarks"].to_string().contains("given for each metre across"), "{answer}");
    assert!(page.contains("b against a (spacing 0.025 m against 0.05 m)") && page.contains("Spacing [m]"));
    // The key shows the dashes of its curve.
    assert!(
        page.contains("class=\"key\"><svg")
            && page.contains("class=\"key\"><i")
            && page.matches("stroke-dasharray").count() > 2
    );
    let plain = run(folder.path(), "c", &["--set", "fluid.viscosity=1e-4"]);
    let (answer, _) = compared(folder.path(), &[&a, &plain], &[]);
    of(&answer, "potential [J]");
}

#[test]
fn what_does_not_fit_together_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let a = run(folder.path(), "a", &[]);
    let b = folder.path().join("b");
    copy(&a, &b);
    let out = folder.path().join("page.html").display().to_string();
    let wrong = |dirs: &[&Path], more: &[&str]| {
        let shown: Vec<String> = dirs.iter().map(|r| r.display().to_string()).collect();
        let shown: Vec<&str> = shown.iter().map(String::as_str).collect();
        let told = ran(&[&["compare-runs", "-o", &out], &shown[..], more].concat());
        assert_eq!(told.code, 2, "{}", told.out);
        assert!(!Path::new(&out).exists(), "nothing is written");
        told.err
    };
    assert!(wrong(&[&a], &[]).contains("2 values required"));
    // A table of that name that is not of differences stays.
    let table = folder.path().join("page.csv");
    std::fs::write(&table, "time,level\n0,1\n").unwrap();
    assert!(wrong(&[&a, &b], &[]).contains("page.csv is there already"));
    assert_eq!(std::fs::read_to_string(&table).unwrap(), "time,level\n0,1\n");
    std::fs::remove_file(&table).unwrap();
    let own = ran(&[
        "compare-runs",
        "-o",
        &a.join("gauges.html").display().to_string(),
        &a.display().to_string(),
        &b.display().to_string(),
    ]);
    assert!(own.code == 2 && own.err.contains("gauges.csv"), "{}", own.err);
    assert!(wrong(&[&a, &a], &[]).contains("named twice"));
    assert!(wrong(&[&a, folder.path()], &[]).contains("holds no run"));
    let err = wrong(&[&a, &b], &["--only", "enrgy"]);
    assert!(err.contains("--only enrgy") && err.contains("p floor [Pa], h [m]"), "{err}");
    assert!(wrong(&[&a, &b], &["--from", "2", "--until", "1"]).contains("--from is after --until"));
    let err = wrong(&[&a, &b], &["--from", "2"]);
    assert!(err.contains("no time in common within --from and --until: a from 0 to 0.05 s"), "{err}");
    for name in ["gauges.csv", "bodies.csv", "monitors.csv"] {
        let time = usize::from(name == "monitors.csv");
        edit(&b, name, |_, row| {
            let mut row = row.to_vec();
            row[time] = (row[time].parse::<f64>().unwrap() + 5.0).to_string();
            Some(row)
        });
    }
    assert!(wrong(&[&a, &b], &[]).contains("no time in common: a from 0 to 0.05 s, b from 5 to 5.05 s"));
    for name in ["gauges.csv", "bodies.csv", "monitors.csv"] {
        std::fs::remove_file(b.join(name)).unwrap();
    }
    assert!(wrong(&[&a, &b], &[]).contains("the runs have no column in common: a has p floor [Pa]"));
}

#[test]
fn one_body_of_many_is_compared() {
    let folder = tempfile::tempdir().unwrap();
    let one = run(folder.path(), "one", &[]);
    let two = folder.path().join("two");
    copy(&one, &two);
    for (root, shift) in [(&one, 0.0), (&two, 0.25)] {
        let old = std::fs::read_to_string(root.join("bodies.csv")).unwrap();
        let head = old.lines().next().unwrap();
        let (body, count) = (head.split(',').position(|c| c == "body").unwrap(), head.split(',').count());
        let row = |time: usize, name: String| {
            let cell =
                |k: usize| if k == body { name.clone() } else { (time as f64 * (1.0 + shift)).to_string() };
            // The time is that of both.
            (0..count).map(|k| if k == 0 { time.to_string() } else { cell(k) }).collect::<Vec<_>>().join(",")
        };
        let rows = (0..2).flat_map(|time| (0..300).map(move |k| (time, format!("rock_{k}"))));
        let rows: Vec<String> = rows.map(|(time, name)| row(time, name)).collect();
        std::fs::write(root.join("bodies.csv"), format!("{head}\n{}\n", rows.join("\n"))).unwrap();
    }
    let (answer, _) = compared(folder.path(), &[&one, &two], &["--only", "rock_7:"]);
    assert_eq!(of(&answer, "rock_7: velocity_x [m/s]")["largest"], 0.25);
}
