//! The study command: resumed after a kill, split into shards, failures as rows, mistakes told.

use seixo::Error;
use seixo::checkpoint::Found;
use seixo::checkpoint::file::{newest, write};
use seixo::output::lock::Beside;
use seixo::stop::Stop;
use seixo_study::engine::{Context, cpu_only};
use seixo_study::row::{Measured, Timing};
use seixo_study::run_point::{Point, run as run_point};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Four small tanks, one of which is refused.
const STUDY: &str = r#"
name = "small"
title = "Small tanks"
method = "{preset}"
repetitions = 1
text = """
[run]
spacing = 0.02
time_step = 1e-3
end = 0.3
dimensions = 2
[tank]
min = [0, 0, 0]
max = [0.2, 1, 0.4]
open = ["z_max"]
[fluid]
sound_speed = 4.0
[[fluid.block]]
min = [0, 0, 0]
max = [0.2, 1, 0.2]
"""
[measure]
of = ["hydrostatic_pressure", "volume", "front"]
from = 0.1
every = 0.01
[[axis]]
name = "preset"
key = "fluid.preset"
values = ["paper", "accurate"]
[[axis]]
name = "spacing"
key = "run.spacing"
values = [0.02, 0.01, 0.005]
[[axis]]
name = "tolerance"
key = "fluid.solver.tolerance"
values = [1e-3, 7.0]
[[error]]
value = "pressure error [-]"
[[error]]
curve = "front"
against = "finest"
"#;

fn seixo(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = crate::common::program();
    command.current_dir(folder).args(["study"]).args(arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn run(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let out = seixo(folder, arguments).output().expect("the program starts");
    let text = String::from_utf8_lossy(&out.stdout).into_owned() + &String::from_utf8_lossy(&out.stderr);
    (out.status.code().unwrap_or(-1), text)
}

/// results.csv without the columns that tell times.
fn table(folder: &Path) -> Vec<Vec<String>> {
    let mut reader = csv::Reader::from_path(folder.join("results.csv")).expect("a table");
    let head = reader.headers().expect("a header").clone();
    let kept: Vec<usize> = (0..head.len()).filter(|&k| !head[k].starts_with("wall")).collect();
    let pick = |row: &csv::StringRecord| kept.iter().map(|&k| row[k].to_string()).collect();
    std::iter::once(pick(&head)).chain(reader.records().map(|r| pick(&r.expect("a row")))).collect()
}

#[test]
fn a_killed_sweep_goes_on_and_shards_join_to_the_same_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("small.toml"), STUDY).expect("a file");
    assert_eq!(run(folder, &["small.toml", "-o", "whole"]).0, 0);
    let whole = table(&folder.join("whole"));
    assert_eq!(whole.len(), 1 + 12);
    let classes = |class: &str| whole.iter().filter(|row| row.iter().any(|c| c == class)).count();
    assert_eq!((classes("ok"), classes("failed")), (6, 6), "{whole:?}");

    // Killed, with no chance to tidy up, as soon as some points are there.
    let mut child = seixo(folder, &["small.toml", "-o", "killed"]).spawn().expect("the program starts");
    let points = || std::fs::read_dir(folder.join("killed/points")).map_or(0, Iterator::count);
    let start = Instant::now();
    while points() < 3 && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().expect("a kill");
    child.wait().expect("an end");
    assert!(!folder.join("killed/results.csv").exists(), "it was killed too late to show anything");
    let (code, text) = run(folder, &["small.toml", "-o", "killed"]);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("are finished already"), "{text}");
    assert_eq!(table(&folder.join("killed")), whole);

    assert_eq!(run(folder, &["small.toml", "-o", "one", "--shard", "1/2"]).0, 0);
    assert_eq!(run(folder, &["small.toml", "-o", "two", "--shard", "2/2"]).0, 0);
    assert!(table(&folder.join("one")).len() < whole.len());
    assert_eq!(run(folder, &["collect", "one", "two", "-o", "joined"]).0, 0);
    assert_eq!(table(&folder.join("joined")), whole);
    // What does not belong together is not joined, and neither is half of it.
    std::fs::write(folder.join("other.toml"), STUDY.replace("end = 0.3", "end = 0.2")).expect("a file");
    assert_eq!(run(folder, &["other.toml", "-o", "three", "--shard", "2/2"]).0, 0);
    for (second, words) in [("three", "parts of different studies"), ("nowhere", "`nowhere` holds no study")]
    {
        let (code, text) = run(folder, &["collect", "one", second, "-o", "mixed"]);
        assert!(code == 2 && text.contains(words), "{second}: {text}");
    }
    for file in ["report.md", "results.json", "small-pressure_error-time.svg"] {
        assert!(folder.join("joined").join(file).exists(), "{file}");
    }
}

#[test]
fn a_wanted_error_is_answered_in_words() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("small.toml"), STUDY).expect("a file");
    let (code, text) = run(folder.path(), &["small.toml", "--error", "0.5", "-q"]);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("For a pressure error [-] of at most 0.5 take"), "{text}");
}

/// Points whose result means nothing, as `seixo run` says of them, are recommended to nobody.
#[test]
fn a_point_whose_result_means_nothing_fails_and_a_study_of_such_points_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let study = |iterations: &str| {
        let text = STUDY
            .replace("key = \"fluid.solver.tolerance\"\nvalues = [1e-3, 7.0]", iterations)
            .replace("[\"paper\", \"accurate\"]", "[\"accurate\"]")
            .replace("[0.02, 0.01, 0.005]", "[0.02]")
            .replace("[[error]]\ncurve = \"front\"\nagainst = \"finest\"\n", "");
        std::fs::write(folder.join("small.toml"), text).expect("a file");
        let (code, text) = run(folder, &["small.toml", "-o", "out", "--error", "9", "-q"]);
        (code, text, table(&folder.join("out")))
    };
    let key = "key = \"fluid.solver.max_iterations\"\nvalues = ";
    let (code, text, rows) = study(&format!("{key}[1, 1000]"));
    let class = rows[0].iter().position(|name| name == "class").expect("a column");
    assert_eq!((code, rows[1][class].as_str(), rows[2][class].as_str()), (0, "failed", "ok"), "{text}");
    assert_eq!(text.matches("missed fluid.solver.tolerance").count(), 1, "{text}");
    assert!(text.contains("of at most 9 take accurate, spacing = 0.02, tolerance = 1000"), "{text}");
    let (code, text, _) = study(&format!("{key}[1]"));
    assert!(code == 4 && text.contains("the only point has no result"), "{code}: {text}");
}

#[test]
fn mistakes_are_told_before_anything_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("bad.toml"), STUDY.replace("finest", "nowhere.csv")).expect("a file");
    let mistake = |name: &str, old: &str, new: &str| {
        assert!(STUDY.contains(old));
        std::fs::write(folder.path().join(name), STUDY.replace(old, new)).expect("a file");
    };
    mistake("key.toml", "run.spacing", "run.spacings");
    mistake("method.toml", "{preset}", "{nope}");
    let results = "[[result]]\nname = \"r\"\ncurve = \"c\"\ntake = \"first_below\"\n";
    mistake("level.toml", "[[error]]", &format!("{results}\n[[error]]"));
    let check = "[[check]]\nname = \"c\"\nvalue = \"v\"\nreference = 1\ntolerance = 0.1\nwindow = [2, 1]\n";
    mistake("window.toml", "[[error]]", &format!("{check}\n[[error]]"));
    mistake("from.toml", "end = 0.3", "end = 0.3\nfrom = \"out/earlier\"");
    for (arguments, expected) in [
        (&["hydrostatik"][..], "did you mean `hydrostatic`"),
        (&["none.toml"][..], "no study file"),
        (&["bad.toml"][..], "nowhere.csv"),
        (&["collect"][..], "name the folders"),
        (&["collect", "."][..], "holds no study"),
        (&["key.toml"][..], "the case of every point is refused"),
        (&["from.toml"][..], "run.from: a point of a study begins at t = 0"),
        (&["level.toml"][..], "result.0.level: `take` asks for a `level`"),
        (&["window.toml"][..], "window.toml:43:1"),
        (&["method.toml"][..], "method: there is no axis `nope`"),
        (&["gallery", "--set", "run.end=1"][..], "--set does not apply"),
        (&["hydrostatic", "--error", "-1"][..], "write a number of more than 0"),
    ] {
        let (code, text) = run(folder.path(), arguments);
        assert_eq!(code, 2, "{arguments:?}: {text}");
        assert!(text.contains(expected), "{arguments:?}: {text}");
    }
}

#[test]
fn a_validation_is_a_file_with_checks_and_gives_a_page_with_mean_and_spread() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let head = STUDY.split("[measure]").next().expect("the case");
    let checks = r#"
source = "analytic"
full = false
"#;
    let rest = r#"
[measure]
of = ["gauges", "fluid"]
every = 0.01
[[axis]]
name = "preset"
key = "fluid.preset"
values = ["paper", "accurate"]
[[check]]
name = "pressure at the floor [Pa]"
curve = "floor [Pa]"
take = "mean"
window = [0.1, 0.3]
against = "floor.csv"
columns = ["t_s", "p_Pa"]
tolerance = 0.1
peers = [{ name = "a peer", value = 4000.0 }]
[[check]]
name = "twice the depth of the centroid, paper alone [m]"
only = { preset = "paper" }
curve = "fluid z [m]"
take = "at"
level = 0.2
reference = 9.9
tolerance = 0.1
"#;
    let gauge = "[[gauge.pressure]]\nname = \"floor\"\npoint = [0.1, 0, 0]\n[output]\nevery = 0\n\"\"\"";
    let head = head.replace("title =", &format!("{checks}title =")).replacen("\"\"\"\n", "@", 1);
    let text = head.replace("\"\"\"", gauge).replace('@', "\"\"\"\n") + rest;
    std::fs::write(folder.join("tank.toml"), &text).expect("a file");
    std::fs::write(folder.join("slip.toml"), text.replace("fluid z [m]", "fluid h [m]")).expect("a file");
    std::fs::write(folder.join("floor.csv"), "# source: analytic\nt_s,p_Pa\n0.1,1961\n0.3,1961\n")
        .expect("a file");
    let validate = |arguments: &[&str]| {
        let out = crate::common::program().current_dir(folder).arg("validate").args(arguments).output();
        let out = out.expect("the program starts");
        let text = String::from_utf8_lossy(&out.stdout).into_owned() + &String::from_utf8_lossy(&out.stderr);
        (out.status.code().unwrap_or(-1), text)
    };
    std::fs::create_dir(folder.join("busy")).expect("a folder");
    let held = seixo::output::lock::hold(&folder.join("busy"), ".seixo-points", Beside::Nobody);
    let (code, text) = validate(&["tank.toml", "-o", "busy", "--shard", "1/2"]);
    assert!(held.is_ok() && code == 2 && text.contains("busy is in use"), "{code}: {text}");
    let (code, text) = validate(&["slip.toml", "-o", "none"]);
    assert!(code == 2 && text.contains("there is no curve `fluid h [m]`; there are: "), "{code}: {text}");
    assert!(!folder.join("none/points").exists(), "nothing ran");
    let (code, text) = validate(&["tank.toml", "--runs", "2", "-o", "one", "--shard", "1/2"]);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("2 of 4 points are still to be computed"), "{text}");
    assert_eq!(validate(&["tank.toml", "--runs", "2", "-o", "two", "--shard", "2/2", "-q"]).0, 0);
    let joined = [
        "tank.toml",
        "--runs",
        "2",
        "-o",
        "both",
        "--join",
        "one",
        "--join",
        "two",
        "--page",
        "docs/page.md",
    ];
    let (code, text) = validate(&joined);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("ok     small: pressure at the floor [Pa], accurate"), "{text}");
    assert!(text.contains("BEYOND small: twice the depth of the centroid, paper alone [m], paper"), "{text}");
    let page = std::fs::read_to_string(folder.join("docs/page.md")).expect("the page");
    for word in
        ["Reference: analytic", "| a peer |", "± ", "(2) | 1961 |", "img/validation-small-floor-curve.svg"]
    {
        assert!(page.contains(word), "{word} is not in\n{page}");
    }
    assert!(!page.contains("paper alone [m] | accurate"), "{page}");
    assert!(folder.join("docs/img/validation-small-floor-curve.svg").exists());
    let (code, text) = validate(&["hydrostatics"]);
    assert_eq!((code, text.contains("did you mean `hydrostatic`")), (2, true), "{text}");
}

/// Everything that a point can measure, of water, bodies, gauges and profiles.
const RICH: &str = r#"
[run]
spacing = 0.02
time_step = 1e-3
end = 0.06
dimensions = 2
[tank]
min = [0, 0, 0]
max = [0.4, 1, 0.4]
open = ["z_max"]
[fluid]
viscosity = 1e-4
[[fluid.block]]
min = [0, 0, 0]
max = [0.4, 1, 0.2]
[[body]]
name = "falls"
size = [0.1, 1, 0.06]
center = [0.2, 0, 0.26]
density = 500
velocity = [0, 0, -0.3]
[contact]
spring = 1e4
[[gauge.pressure]]
name = "floor"
point = [0.1, 0, 0]
"#;
const ALL_MEASURES: &str = r#"
of = ["hydrostatic_pressure", "sensor", "kinetic_energy", "volume", "front", "energy", "draft", "body_height",
      "gauges", "bodies", "fluid"]
from = 0.01
every = 0.004
profile = [{ name = "p", of = "pressure", along = "z", within = [[0, -1, 0], [0.4, 1, 0.2]], bins = 5 }]
"#;

/// Stopped again and again a point ends as the undisturbed one, because it goes on from the state that it kept.
#[test]
fn a_point_that_is_stopped_goes_on_from_its_state() {
    let spec = toml::from_str(ALL_MEASURES).expect("measures");
    let point = Point { text: RICH.into(), spec, processor: Default::default(), repetitions: 2 };
    let folder = tempfile::tempdir().expect("a folder");
    let attempt = |name: &str, time: Duration| {
        let stop = Stop::default().at(Some(Instant::now() + time));
        let states = Some(folder.path().join(name));
        run_point(&point, &Context { states, stop, ..Context::new(&cpu_only) })
    };
    let without_times = |m: Measured| {
        let repetitions = m.timing.map(|t: Timing| t.repetitions);
        (repetitions, Measured { timing: None, ..m })
    };
    let whole = run_point(&point, &Context::new(&cpu_only)).expect("it runs");
    assert!(whole.values.len() > 20 && whole.curves.len() > 15, "{:?}", whole.curves.keys());
    let mut parts = 0;
    let ended = loop {
        // Longer and longer, so that a slow machine comes to the end too.
        match attempt("parts", Duration::from_millis(2 + parts)) {
            Err(Error::Interrupted) => parts += 1,
            ended => break ended.expect("it runs"),
        }
        assert!(parts < 1000, "no end");
    };
    assert!(parts >= 3, "{parts} parts");
    assert_eq!(without_times(ended), without_times(whole), "{parts} parts");

    // What is in the state is what the rest is added to.
    // Soon, so that it is stopped in its first run, the one that measures, on any machine.
    assert!(matches!(attempt("other", Duration::from_millis(2)), Err(Error::Interrupted)));
    let states = folder.path().join("other");
    let Found { origin, mut archive, .. } = newest(&states).expect("it is whole").expect("a state");
    archive.numbers.insert("measure.rise".into(), 123_f64.to_bits());
    write(&states, &origin, &archive).expect("it is written");
    let doctored = attempt("other", Duration::from_secs(600)).expect("it runs");
    assert_eq!(doctored.value("energy rise [-]"), Some(123.0));
}

/// What an inflow or a wall brings is no error of the scheme.
#[test]
fn energy_that_is_put_in_is_no_rise() {
    let short = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.05\ndimensions = 2\n\
                 [tank]\nmin = [0, 0, 0]\nmax = [0.2, 1, 0.4]\n\
                 open = [\"z_max\"]\n[fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 1, 0.2]\n";
    let inflow =
        "[[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0.2]\nmax = [0, 1, 0.3]\nvelocity = 1\n";
    let wall = "[[moving_wall]]\nname = \"it\"\nmin = [0.06, 0, 0.2]\nmax = [0.14, 1, 0.3]\n\
                motion = [[0, 0, 0, 0], [1, 0, 0, -0.5]]\n";
    for (more, told) in [("", true), (inflow, false), (wall, false)] {
        let spec = toml::from_str("of = [\"energy\"]\nfrom = 0.01\nevery = 0.01\n").expect("measures");
        let point =
            Point { text: format!("{short}{more}"), spec, processor: Default::default(), repetitions: 1 };
        let measured = run_point(&point, &Context::new(&cpu_only)).expect("it runs");
        assert_eq!(measured.value("energy rise [-]").is_some(), told, "{more}: {:?}", measured.values);
    }
}

/// Slots for what an inflow will bring are no particles: those of a point and of `bench` are those of `run` and `plan`.
#[test]
fn slots_for_what_comes_in_are_no_particles() {
    let text = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.02\ndimensions = 2\n\
                [tank]\nmin = [0, 0, 0]\nmax = [0.4, 1, 0.4]\nopen = [\"z_max\"]\n\
                [fluid]\nmax_volume = 0.2\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 1, 0.2]\n\
                [[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 1, 0.1]\nvelocity = 1\n";
    let case: seixo::case::Case = text.parse().expect("a case");
    let scene = seixo::scene::Scene::build(&case).expect("a scene");
    let there = scene.groups.total() - scene.reserve;
    assert!(scene.reserve > 50, "{} slots in reserve", scene.reserve);
    let spec = toml::from_str("of = [\"kinetic_energy\"]\nevery = 0.001\n").expect("measures");
    let point = Point { text: text.into(), spec, processor: Default::default(), repetitions: 1 };
    let measured = run_point(&point, &Context::new(&cpu_only)).expect("it runs");
    assert_eq!(measured.work.particles, there as u64);
    assert_eq!(measured.work.particle_steps, there as u64 * measured.work.steps);
    // K = N m v^2 / 2 with the water that there was.
    let of = |name: &str| measured.value(name).expect("measured");
    let square = of("spurious speed [-]").powi(2) * 9.80665 * 0.2;
    let particles = 2.0 * of("kinetic energy [J/m]") / (1000.0 * 0.02_f64.powi(2) * square);
    let water = scene.water() as f64;
    assert!(particles > 0.99 * water && particles < 1.05 * water, "{particles} of {water}");
    let make = |s: &_, p: &_, plan: &_, settings| cpu_only(Default::default(), s, p, plan, settings);
    let row = seixo_study::bench::measure(&case, 0.0, 2, 1e10, &make).expect("it runs");
    // No more than what five steps have brought.
    assert!((scene.water()..scene.water() + 10).contains(&row.fluid), "{} of {water}", row.fluid);
    assert_eq!(row.particles - row.fluid, there - scene.water());
}

/// Killed in the middle of a point, the sweep goes on with the point's own state.
#[test]
fn a_sweep_that_is_killed_within_a_point_goes_on_within_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let long = STUDY
        .replace("[\"paper\", \"accurate\"]", "[\"accurate\"]")
        .replace("[0.02, 0.01, 0.005]", "[0.005]")
        .replace("[1e-3, 7.0]", "[1e-3]")
        .replace("[[error]]\ncurve = \"front\"\nagainst = \"finest\"\n", "");
    std::fs::write(folder.join("long.toml"), long).expect("a file");
    assert_eq!(run(folder, &["long.toml", "-o", "whole", "-q"]).0, 0);
    let states = |folder: &Path| -> Vec<std::path::PathBuf> {
        let points = std::fs::read_dir(folder.join("killed/states")).into_iter().flatten().flatten();
        let files = points.flat_map(|p| std::fs::read_dir(p.path()).into_iter().flatten().flatten());
        files.map(|f| f.path()).filter(|p| p.extension().is_some_and(|e| e == "seixo")).collect()
    };
    let again = ["long.toml", "-o", "killed", "--save-every", "0.02", "-q"];
    let mut last = None;
    for _ in 0..3 {
        let mut child = seixo(folder, &again).spawn().expect("the program starts");
        let start = Instant::now();
        // Until it has come further than the last time.
        while states(folder).into_iter().max() <= last && start.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(2));
        }
        child.kill().expect("a kill");
        child.wait().expect("an end");
        let newest = states(folder).into_iter().max();
        assert!(newest > last, "{newest:?} after {last:?}");
        last = newest;
    }
    assert_eq!(
        std::fs::read_dir(folder.join("killed/points")).expect("points").count(),
        0,
        "killed too late"
    );
    let (code, text) = run(folder, &again);
    assert_eq!(code, 0, "{text}");
    assert_eq!(table(&folder.join("killed")), table(&folder.join("whole")));
    assert!(!folder.join("killed/states").exists(), "states of a finished point are of no use");
}

/// A signal ends a sweep with the state of its point saved and the signal's exit code.
#[cfg(unix)]
#[test]
fn a_sweep_that_is_interrupted_says_so_and_goes_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("small.toml"), STUDY.replace("end = 0.3", "end = 30.0")).expect("a file");
    for (signal, code) in [("-INT", 130), ("-USR1", 75)] {
        let child = seixo(folder, &["small.toml", "-o", "out"]).spawn().expect("the program starts");
        // After set-up, where there is nothing to save yet and it would end at once.
        std::thread::sleep(Duration::from_millis(1500));
        // Two sweeps in one folder would write each other's states.
        let (second, text) = run(folder, &["small.toml", "-o", "out"]);
        assert!(second == 2 && text.contains("out is in use"), "{second}: {text}");
        // Twice in a moment, as `timeout` does.
        for _ in 0..2 {
            let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
            assert!(sent.success());
        }
        let clock = Instant::now();
        let out = child.wait_with_output().expect("an end");
        let err = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{err}");
        assert!(clock.elapsed() < Duration::from_secs(5), "{:?}", clock.elapsed());
        assert!(err.contains("the same command goes on there"), "{err}");
    }
}

/// What a study of the force on a wall tells, with nothing to compare it with.
#[test]
fn a_study_without_a_reference_tells_results() {
    let folder = tempfile::tempdir().unwrap();
    let (head, _) = STUDY.split_once("[measure]").unwrap();
    let head = head.replace("end = 0.3", "end = 0.1");
    let rest = |curve: &str, take: &str| {
        format!(
            "[[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n\"\"\"\n[measure]\nof = [\"gauges\"]\nevery = 0.01\n\
             [[axis]]\nname = \"preset\"\nkey = \"fluid.preset\"\nvalues = [\"accurate\"]\n\
             [[axis]]\nname = \"spacing\"\nkey = \"run.spacing\"\nvalues = [0.02, 0.01]\n\
             [[result]]\nname = \"mean force on the floor [N/m]\"\ncurve = \"{curve}\"\ntake = \"{take}\"\nwindow = [0.02, 0.1]\n"
        )
    };
    // The text of the case ends where the gauge goes.
    let head = head.trim_end().trim_end_matches("\"\"\"").to_owned();
    let path = folder.path().join("floor.toml");
    std::fs::write(&path, head.clone() + &rest("floor_force_z [N/m]", "mean")).unwrap();
    let (code, said) = run(folder.path(), &["floor.toml", "-o", "out", "--quiet"]);
    assert_eq!(code, 0, "{said}");
    let table = std::fs::read_to_string(folder.path().join("out/results.csv")).unwrap();
    let mut lines = table.lines();
    let place = lines.next().unwrap().split(',').position(|c| c == "mean force on the floor [N/m]").unwrap();
    let forces: Vec<f64> = lines.map(|l| l.split(',').nth(place).unwrap().parse().unwrap()).collect();
    println!("{forces:?}");
    // Of slices of two widths for each metre across: the weight of the water.
    let weight = 1000.0 * 9.80665 * 0.2 * 0.2;
    for force in forces {
        assert!((-force / weight - 1.0).abs() < 0.05, "{force} for {weight}");
    }
    std::fs::write(&path, head.clone() + &rest("flor_force_z [N]", "mean")).unwrap();
    let (code, said) = run(folder.path(), &["floor.toml", "-o", "wrong", "--quiet"]);
    assert!(code == 2 && said.contains("there is no curve `flor_force_z [N]`"), "{code}: {said}");
    assert_eq!(std::fs::read_dir(folder.path().join("wrong/points")).unwrap().count(), 0, "before any point");
    std::fs::write(&path, head + &rest("floor_force_z [N/m]", "lag")).unwrap();
    let (code, said) = run(folder.path(), &["floor.toml", "-o", "lag", "--quiet"]);
    assert!(code != 0 && said.contains("asks for a second curve"), "{code}: {said}");
}
