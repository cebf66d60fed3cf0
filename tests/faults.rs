//! Misuse and bad luck as a user meets them: what is refused, what is said, what is left behind.

use crate::cli::{assert_whole, json, ran, seixo, small_case};
use std::path::Path;
use std::process::{Command, Stdio};

/// Runs the small case with `sets` and returns exit code, stderr and whether a folder was left.
fn run(sets: &[&str]) -> (i32, String, bool) {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let out = folder.path().join("results");
    let mut args = vec!["run", &case, "--backend", "cpu", "-q", "-o"];
    let shown = out.display().to_string();
    args.push(&shown);
    args.extend(sets.iter().flat_map(|s| ["--set", s]));
    let ran = ran(&args);
    (ran.code, ran.err, out.exists())
}

/// What is refused by `run` is refused by `plan` in the same words, and leaves no folder.
#[test]
fn run_and_plan_refuse_the_same_and_leave_no_folder() {
    let body = "body=[{name=\"b\",size=[0.2,0.05,0.2],center=[X,0,Z],density=500}]";
    let at = |x: &str, z: &str| body.replace('X', x).replace('Z', z);
    let contact = "contact={spring=1e5}";
    let light = at("1.3", "1.5").replace("500", "5");
    let (beside, below, over) = (at("3.0", "0.3"), at("1.0", "-1.0"), at("1.3", "1.5"));
    for (sets, words) in [
        (vec!["run.gravity=[0,0,0,-9.81]"], "4 elements"),
        (vec!["run.time_step=0.05"], "particles far in a step"),
        (vec!["fluid.compressibility=1"], "fluid.compressibility: 1e0 1/Pa"),
        (vec!["fluid.density=-1e300"], "fluid.density: -1e300 is out of range"),
        (vec!["fluid.viscosity=1e300"], "nu dt / l0^2 = 4.000e299 is unstable"),
        (vec![&light, contact, "fluid.viscosity=0.3"], "too long for the body `b`, which viscosity"),
        (vec![&beside, contact], "body `b` at (3.0000, 0.0000, 0.3000) lies outside of the tank"),
        (vec![&below, contact], "which spans 0 to 1 m along z, with nothing beneath it"),
        (vec![&over, "contact={spring=1e9,substeps=1}"], "contact.substeps = 1 is unstable"),
        (vec!["gauge.pressure.0.point=[1.5,0,0.9]"], "gauge.pressure `p floor`"),
    ] {
        let (code, err, left) = run(&sets);
        assert!(code == 2 && err.contains(words), "{sets:?}: {code} {err}");
        assert!(!left, "{sets:?} left a folder");
        assert!(err.contains("small.toml:"), "{sets:?} has no line: {err}");
        let folder = tempfile::tempdir().unwrap();
        let case = small_case(folder.path());
        let plan = ran(&[vec!["plan", &case], sets.iter().flat_map(|s| ["--set", s]).collect()].concat());
        assert!(plan.code == 2 && plan.err.contains(words), "plan {sets:?}: {} {}", plan.code, plan.err);
        assert!(plan.err.contains("small.toml:"), "plan {sets:?} has no line: {}", plan.err);
    }
    let (code, err, _) = run(&[&over, contact]);
    assert_eq!(code, 0, "a body above the open tank falls into it: {err}");
}

#[test]
fn numbers_and_names_that_are_none_are_refused_on_the_command_line() {
    for args in [
        vec!["run", "cases/hydrostatic.toml", "--until", "nan"],
        vec!["run", "cases/hydrostatic.toml", "--until", "inf"],
        vec!["run", "cases/hydrostatic.toml", "--spacing", "NaN"],
        vec!["run", "cases/hydrostatic.toml", "--adapter", ""],
        vec!["validate", "--dry-run", "--adapter", ""],
        vec!["run", "cases/hydrostatic.toml", "--threads", "60000"],
        vec!["study", "hydrostatic", "--threads", "60000"],
    ] {
        let ran = ran(&args);
        assert!(
            ran.code == 2 && ran.err.contains(args[args.len() - 2]),
            "{args:?}: {} {}",
            ran.code,
            ran.err
        );
    }
}

#[test]
fn a_result_that_means_nothing_is_no_success() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let out = folder.path().join("results").display().to_string();
    let base = ["run", &case, "-o", &out, "--backend", "cpu", "--force", "-q", "--json"];
    let with = |sets: &[&str]| {
        let sets: Vec<&str> = sets.iter().flat_map(|s| ["--set", s]).collect();
        ran(&[&base[..], &sets].concat())
    };
    let fine = with(&[]);
    assert_eq!((fine.code, fine.err.as_str()), (0, ""));
    assert_eq!(json(&fine.out)["verdict"], serde_json::json!({ "grade": "fine", "reasons": [] }));
    let none = with(&["fluid.solver.max_iterations=1", "fluid.solver.tolerance=1e-9"]);
    assert_eq!(none.code, 4);
    assert!(
        none.err.contains("means nothing: 50 of 50 pressure solves missed fluid.solver.tolerance"),
        "{}",
        none.err
    );
    let result = json(&none.out);
    assert_eq!(
        (result["status"].as_str(), result["verdict"]["grade"].as_str()),
        (Some("failed"), Some("failed"))
    );
    // A body that turns a thousand times in a step is none that the water could feel.
    let body =
        "body=[{name=\"b\",size=[0.2,0.05,0.2],center=[1.3,0,0.7],density=500,angular_velocity=[0,5e6,0]}]";
    let spins = with(&[body, "contact={spring=1e5}"]);
    assert!(spins.code == 4 && spins.err.contains("particles far in a step"), "{} {}", spins.code, spins.err);
    let fast =
        with(&[&body.replace("angular_velocity=[0,5e6,0]", "velocity=[100,0,0]"), "contact={spring=1e5}"]);
    assert_eq!(json(&fast.out)["verdict"]["grade"], "degraded", "{}", fast.err);
    let some = with(&["fluid.solver.max_iterations=12"]);
    assert_eq!(some.code, 0, "{}", some.err);
    assert!(some.err.starts_with("verdict: degraded because "), "{}", some.err);
    assert_eq!(json(&some.out)["verdict"]["grade"], "degraded");
}

#[test]
fn water_that_a_piston_presses_out_of_a_full_tank_is_told_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("piston.toml");
    let text = "[run]\nspacing = 0.02\ntime_step = 0.001\nadaptive = true\nend = 0.5\ndimensions = 2\n\
                [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.02, 0.6]\n\
                [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.02, 0.4]\n\
                [[moving_wall]]\nname = \"lid\"\nmin = [0, 0, 0.4]\nmax = [0.4, 0.02, 0.46]\n\
                motion = [[0, 0, 0, 0], [0.5, 0, 0, -0.1]]\n";
    std::fs::write(&path, text).unwrap();
    let out = folder.path().join("out").display().to_string();
    let ran = ran(&["run", path.to_str().unwrap(), "--backend", "cpu", "-q", "-o", &out]);
    assert_eq!(ran.code, 4, "{}", ran.err);
    assert!(
        ran.err.contains("have left the domain") && ran.err.contains("water that `lid` leaves no room"),
        "{}",
        ran.err
    );
}

#[test]
fn a_typed_step_that_no_flow_takes_is_told_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("step.toml");
    let text = "[run]\nspacing = 0.02\ntime_step = 1e4\nadaptive = true\nend = 2e4\ndimensions = 2\n\
                [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0.1, 0.6]\n\
                [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 0.1, 0.3]\n";
    std::fs::write(&path, text).unwrap();
    let out = folder.path().join("out").display().to_string();
    let ran = ran(&["run", path.to_str().unwrap(), "--backend", "cpu", "-q", "-o", &out]);
    let words = ["where run.time_step is 1e4 s", "falls through a spacing in 6.4e-2 s"];
    assert!(ran.code == 4 && words.iter().all(|w| ran.err.contains(w)), "{}: {}", ran.code, ran.err);
    assert!(!ran.err.contains("no room left"), "{}", ran.err);
}

/// Walls that move give the water energy; a typed speed of sound, or an inflow without water yet, excuses nothing.
#[test]
fn a_verdict_knows_what_energy_a_scene_has_at_hand() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("case.toml").display().to_string();
    let out = folder.path().join("results").display().to_string();
    let run = |spacing: f64, end: f64, more: &str| {
        let run = format!(
            "[run]\nspacing = {spacing}\ntime_step = 0.002\nadaptive = true\nend = {end}\ndimensions = 2\n{more}"
        );
        std::fs::write(&file, run).unwrap();
        json(&ran(&["run", &file, "-o", &out, "--backend", "cpu", "--force", "-q", "--json"]).out)
    };
    let couette = "gravity = [0, 0, 0]\n[tank]\nmin = [0, 0, 0]\nmax = [0.2, 0.1, 0.14]\nperiodic = [\"x\"]\nopen = [\"z_max\"]\n\
                   [fluid]\nviscosity = 0.01\nwall_friction = 0\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 0.1, 0.1]\n\
                   [[moving_wall]]\nname = \"plate\"\nmin = [0, 0, 0.1]\nmax = [0.2, 0.1, 0.14]\nopen = [\"z_max\"]\n\
                   motion = [[0, 0, 0, 0], [10, 1.0, 0, 0]]\n";
    let collapse = "[tank]\nmin = [0, 0, 0]\nmax = [0.6, 0.1, 0.4]\n[fluid]\nsound_speed = 50\n\
                    [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 0.1, 0.3]\n";
    let empty = "[tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.1, 0.4]\nopen = [\"z_max\"]\n[fluid]\n[[inflow]]\nname = \"in\"\nface = \"x_min\"\n\
                 min = [0, 0, 0]\nmax = [0, 0.1, 0.1]\nvelocity = 0.01\n";
    // A tank that is shaken at its own period, until its energy is half as much again.
    let to_and_fro = |name: &str, [x0, x1]: [f64; 2], [z0, z1]: [f64; 2]| {
        format!(
            "[[moving_wall]]\nname = \"{name}\"\nmin = [{x0}, 0, {z0}]\nmax = [{x1}, 0.1, {z1}]\n\
             sine = {{ axis = [1, 0, 0], amplitude = 0.03, period = 1.12 }}\n"
        )
    };
    let shaken = "[fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.6, 0.1, 0.15]\n".to_owned()
        + &to_and_fro("left", [-0.09, 0.0], [-0.09, 0.5])
        + &to_and_fro("right", [0.6, 0.69], [-0.09, 0.5])
        + &to_and_fro("floor", [0.0, 0.6], [-0.09, 0.0]);
    for (more, left_out) in [("", true), ("[output]\nledger = true\n", false)] {
        let result = run(0.015, 3.0, &format!("{shaken}{more}"));
        let (verdict, monitors) = (&result["verdict"], &result["monitors"]);
        let of = |key: &str| monitors[key].as_f64().unwrap();
        assert!(of("energy_end_J") > 1.2 * of("energy_start_J"), "{monitors}");
        assert_eq!(verdict["grade"], "fine", "{verdict}");
        assert_eq!(verdict["left_out"].to_string().contains("output.ledger"), left_out, "{verdict}");
    }
    for (name, end, more, grade, why) in [
        ("couette", 2.0, couette, "fine", ""),
        ("collapse", 0.5, collapse, "degraded", "the energy rose by"),
        ("empty", 0.02, empty, "fine", ""),
    ] {
        let result = run(0.01, end, more);
        let verdict = &result["verdict"];
        println!("{name}: {verdict}");
        assert_eq!(verdict["grade"], grade, "{name}: {verdict}");
        assert!(verdict["reasons"].to_string().contains(why), "{name}: {verdict}");
    }
}

#[test]
fn pressures_that_are_cut_are_judged() {
    use seixo::output::result::{Grade, Summary};
    use seixo::run::scale::Scale;
    use seixo::run::verdict::judge;
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(small_case(folder.path())).unwrap();
    let case: seixo::Case = text.parse().unwrap();
    let options = seixo::Options { processor: seixo::Processor::Cpu, ..seixo::Options::default() };
    let simulation = seixo::Simulation::open(&case, &options).unwrap();
    let scale = Scale::new(&simulation, &simulation.scene);
    let mut summary = Summary { steps: 100, ..Summary::default() };
    summary.particles.fluid = 1000;
    summary.pressure.solves = 100;
    summary.pressure.unknowns_mean = 2000.0;
    for (clamps, grade) in [(0, Grade::Fine), (10, Grade::Fine), (400, Grade::Degraded)] {
        summary.pressure.clamps = clamps;
        let verdict = judge(&summary, scale, false);
        assert_eq!(verdict.grade, grade, "{clamps}: {verdict}");
        assert_eq!(clamps == 400, verdict.to_string().contains("were cut at their upper bound"), "{verdict}");
    }
    summary.pressure.clamps = 0;
    for (negative, grade) in [(140_000, Grade::Fine), (190_000, Grade::Degraded)] {
        summary.pressure.negative = negative;
        let verdict = judge(&summary, scale, false);
        assert_eq!(verdict.grade, grade, "{negative}: {verdict}");
        assert_eq!(negative == 190_000, verdict.to_string().contains("water does not pull"), "{verdict}");
    }
    summary.pressure.negative = 0;
    // What a run does already is no remedy.
    summary.monitors.solid_courant_max = 1.5;
    for adaptive in [false, true] {
        let verdict = judge(&summary, scale, adaptive).to_string();
        assert!(verdict.contains("a shorter run.time_step"), "{verdict}");
        assert_eq!(verdict.contains("run.adaptive = true"), !adaptive, "{verdict}");
    }
}

/// Walls that close in on a ball give it speed, a piston that drives a bore does so to water: both are as they should be.
#[test]
fn what_driven_walls_do_is_no_gain() {
    let folder = tempfile::tempdir().unwrap();
    let dry = "[run]\nspacing = 0.02\ntime_step = 2e-4\nend = 1.4\ngravity = [0, 0, 0]\n\
               [[moving_wall]]\nname = \"A\"\nmin = [-0.1, -0.1, -0.2]\nmax = [0, 0.1, 0.2]\nmotion = [[0, 0, 0, 0], [10, 2, 0, 0]]\n\
               [[moving_wall]]\nname = \"B\"\nmin = [1, -0.1, -0.2]\nmax = [1.1, 0.1, 0.2]\nmotion = [[0, 0, 0, 0], [10, -2, 0, 0]]\n\
               [[body]]\nname = \"ball\"\nshape = \"sphere\"\nradius = 0.05\ncenter = [0.5, 0, 0]\nvelocity = [1, 0, 0]\ndensity = 1000\n\
               [contact]\nspring = 1e6\nrestitution = 1\n[output]\nevery = 0\n";
    let wet = "[run]\nspacing = 0.02\ntime_step = 2e-3\nadaptive = true\nend = 1.5\ndimensions = 2\n\
               [tank]\nmin = [0, 0, 0]\nmax = [4, 0.1, 0.5]\nopen = [\"z_max\"]\n\
               [fluid]\n[[fluid.block]]\nmin = [0.1, 0, 0]\nmax = [4, 0.1, 0.1]\n\
               [[moving_wall]]\nname = \"piston\"\nmin = [0.04, 0, 0]\nmax = [0.1, 0.1, 0.5]\n\
               motion = [[0, 0, 0, 0], [5, 4, 0, 0]]\n[output]\nevery = 0\n";
    for (name, text, grown) in [("walls", dry, 2.5), ("piston", wet, 1.5)] {
        let path = folder.path().join(format!("{name}.toml"));
        std::fs::write(&path, text).unwrap();
        let (path, out) = (path.display().to_string(), folder.path().join(name).display().to_string());
        let run = ran(&["run", &path, "--backend", "cpu", "-q", "--json", "-o", &out]);
        assert_eq!(run.code, 0, "{name}: {}", run.err);
        let result = json(&run.out);
        assert_eq!(result["verdict"]["grade"], "fine", "{name}: {}", result["verdict"]);
        let energy = |key: &str| result["monitors"][key].as_f64().unwrap();
        assert!(energy("energy_end_J") > grown * energy("energy_start_J"), "{name}: {result}");
        let work = energy("driven_contact_work_J");
        let gain = energy("energy_end_J") - energy("energy_start_J");
        assert!(name == "piston" || (work / gain - 1.0).abs() < 0.02, "{work} J for {gain} J");
    }
}

/// A channel that gravity drives along its periodic axis gains energy without end.
#[test]
fn a_driven_channel_is_fine() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(
        path("channel.toml"),
        "[run]\nspacing = 0.02\ntime_step = 2e-3\nadaptive = true\nend = 1.0\ngravity = [2, 0, -9.6]\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.3]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n[fluid]\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.1]\n[output]\nevery = 0\n",
    )
    .unwrap();
    let run = ran(&["run", &path("channel.toml"), "-o", &path("out"), "--backend", "cpu", "-q", "--json"]);
    assert_eq!((run.code, run.err.as_str()), (0, ""));
    let result = json(&run.out);
    let gain = |at: &str| result["monitors"][at].as_f64().unwrap();
    assert_eq!(result["verdict"]["grade"], "fine");
    assert!(gain("energy_max_J") > 1.5 * gain("energy_start_J"), "it flows: {result}");
}

/// A bucket of walls that is lifted takes its water along.
#[test]
fn a_bucket_that_is_lifted_is_fine() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let wall = |name: &str, [x0, x1]: [f64; 2], [z0, z1]: [f64; 2]| {
        format!(
            "[[moving_wall]]\nname = \"{name}\"\nmin = [{x0}, 0, {z0}]\nmax = [{x1}, 0, {z1}]\n\
             motion = [[0, 0, 0, 0], [0.1, 0, 0, 0], [0.9, 0, 0, 0.8], [1, 0, 0, 0.8]]\n"
        )
    };
    let text = format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -9.81]\ndimensions = 2\n[fluid]\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.2]\n[output]\nevery = 0\n{}{}{}",
        wall("floor", [-0.08, 0.48], [-0.08, 0.0]),
        wall("left", [-0.08, 0.0], [0.0, 0.4]),
        wall("right", [0.4, 0.48], [0.0, 0.4])
    );
    std::fs::write(path("bucket.toml"), text).unwrap();
    let run = ran(&["run", &path("bucket.toml"), "-o", &path("out"), "--backend", "cpu", "-q", "--json"]);
    assert_eq!((run.code, run.err.as_str()), (0, ""));
    let result = json(&run.out);
    let at = |at: &str| result["monitors"][at].as_f64().unwrap();
    assert_eq!(result["verdict"]["grade"], "fine");
    assert!(at("energy_max_J") > 3.0 * at("energy_start_J"), "it is lifted: {result}");
    // Of walls without a gauge nobody knows the force: no zeros are told.
    assert!(result["bodies"][0].get("fluid_force_n").is_none());
    let table = std::fs::read_to_string(folder.path().join("out/bodies.csv")).unwrap();
    assert!(table.lines().nth(1).unwrap().contains(",,,,,,"), "{table:.600}");
}

/// A gate of 50 m/s would cross 2.5 spacings in a typed step.
#[test]
fn adaptive_steps_see_solids() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let out = folder.path().join("results").display().to_string();
    let gate = "moving_wall.0.motion=[[0,0,0,0],[0.01,0,0,0],[0.02,0,0,0.5]]";
    let run = ran(&[
        "run",
        &case,
        "-o",
        &out,
        "--backend",
        "cpu",
        "--json",
        "-q",
        "--until",
        "0.02",
        "--set",
        gate,
        "--set",
        "run.adaptive=true",
    ]);
    assert_eq!(run.code, 0, "{}", run.err);
    let monitors = std::fs::read_to_string(Path::new(&out).join("monitors.csv")).unwrap();
    let mut fast = 0;
    for line in monitors.lines().skip(2) {
        let cells: Vec<f64> = line.split(',').take(3).map(|c| c.parse().unwrap()).collect();
        let (start, dt) = (cells[1] - cells[2], cells[2]);
        if start > 0.01 - 1e-9 {
            assert!(50.0 * dt <= 0.35 * 0.05 * (1.0 + 1e-9), "a step of {dt} s at {start} s");
            fast += 1;
        }
    }
    assert!(fast >= 28, "{fast} steps while the gate moves: {monitors}");
}

/// What never ends is no case, and takes no memory.
#[cfg(unix)]
#[test]
fn a_case_that_does_not_end_is_refused() {
    let refused = ran(&["plan", "/dev/zero"]);
    assert!(
        refused.code == 5 && refused.err.contains("longer than 64 MB"),
        "{} {}",
        refused.code,
        refused.err
    );
}

#[test]
fn a_second_run_into_a_live_folder_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let out = folder.path().join("results");
    let mut first = Command::new(seixo().get_program())
        .args(["run", &case, "--backend", "cpu", "-q", "--until", "1e6", "--force-disk", "-o"])
        .arg(&out)
        .spawn()
        .unwrap();
    while !out.join("vtu/fluid_0001.vtu").exists() {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let second = ran(&["run", &case, "--backend", "cpu", "-q", "--force", "-o", &out.display().to_string()]);
    first.kill().unwrap();
    first.wait().unwrap();
    assert!(second.code == 2 && second.err.contains("is in use"), "{} {}", second.code, second.err);
    assert_whole(&out);
}

#[test]
fn closed_streams_kill_no_run() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let run = |name: &str, redirect: &str| {
        let out = folder.path().join(name);
        let program = seixo().get_program().to_owned();
        let line = format!("\"$0\" run \"$1\" -o \"$2\" --backend cpu {redirect}; exit ${{PIPESTATUS[0]}}");
        let status =
            Command::new("bash").arg("-c").arg(line).arg(program).arg(&case).arg(&out).status().unwrap();
        (status.code().unwrap(), json(&std::fs::read_to_string(out.join("result.json")).unwrap()))
    };
    // Nobody reads the remarks: the results are all there.
    let (code, result) = run("remarks", "2> >(true) > /dev/null");
    assert_eq!((code, result["status"].as_str()), (0, Some("done")));
    let (_, result) = run("both", "2>&1 | true");
    assert_eq!(result["status"], "done");
    if cfg!(target_os = "linux") {
        let (code, result) = run("full", "--json -q > /dev/full 2> /dev/null");
        assert_eq!((code, result["status"].as_str()), (5, Some("done")), "a result that nobody could read");
    }
}

/// The disk fills up in the middle: tables end with a whole row, and the summary says why.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_fills_up_leaves_whole_files_and_a_summary() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let out = folder.path().join("results");
    // Files larger than 40 kB fail as they do on a full disk; SIGXFSZ is what bash would die of.
    let line = "trap '' XFSZ; ulimit -f 40; exec \"$0\" run \"$1\" -o \"$2\" --backend cpu -q --until 5";
    let program = seixo().get_program().to_owned();
    let output = Command::new("bash")
        .args(["-c", line])
        .arg(program)
        .arg(&case)
        .arg(&out)
        .stdout(Stdio::null())
        .output()
        .unwrap();
    let err = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(5), "{err}");
    assert!(err.contains(".csv: File too large"), "{err}");
    assert_whole(&out);
    let result = json(&std::fs::read_to_string(out.join("result.json")).unwrap());
    assert_eq!(result["status"], "failed");
    assert!(result["exit_reason"].as_str().unwrap().contains("File too large"), "{result}");
}

/// Runs `line` where `$DISK` is a file system of its own, of a megabyte and a half. As root it is mounted, else in a
/// namespace of one's own; where the system allows neither, this cannot be tested and says so by failing.
#[cfg(target_os = "linux")]
fn on_a_small_disk(folder: &Path, line: &str, args: &[&str]) -> std::process::Output {
    let disk = folder.join("disk");
    std::fs::create_dir(&disk).unwrap();
    let script = format!("mount -t tmpfs -o size=1536k tmpfs \"$DISK\" || exit 99; {line}");
    let run = |own: &[&str]| {
        let all: Vec<&str> = [own, &["bash", "-c", &script, "bash"], args].concat();
        Command::new(all[0]).args(&all[1..]).env("DISK", &disk).output()
    };
    // A mount in a namespace is gone with its last process, whatever happens to this one.
    for own in [&["unshare", "--mount"][..], &["unshare", "--user", "--map-root-user", "--mount"]] {
        if let Ok(output) = run(own)
            && output.status.code() != Some(99)
            && !String::from_utf8_lossy(&output.stderr).starts_with("unshare: ")
        {
            return output;
        }
    }
    panic!("no small disk can be mounted here, neither as root nor in a user namespace: allow one of them");
}

/// The whole disk is full: tables are cut to whole rows, the summary says why, and the last state is there to go on with.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_whole_files_a_state_and_a_summary() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let kept = folder.path().join("kept");
    let sets = "--set run.end=5 --set output.every=0.004 --set run.checkpoint={every=0.02} --backend cpu --threads 1 -q";
    // What is there is copied away before the disk is gone; then room is made, and the run goes on on it.
    let line = format!(
        "\"$1\" run \"$2\" -o \"$DISK/out\" {sets} --force-disk; code=$?; cp -r \"$DISK/out\" \"$3\" || exit 98; \
         rm -r \"$DISK/out/vtu\"; mount -o remount,size=64m \"$DISK\" || exit 97; cp -r \"$3/vtu\" \"$DISK/out/vtu\"; \
         \"$1\" run \"$2\" -o \"$DISK/out\" {sets} --resume --until 5 --max-wall 0.2s; echo \"resumed $?\"; exit $code"
    );
    let program = seixo().get_program().to_string_lossy().into_owned();
    let output = on_a_small_disk(folder.path(), &line, &[&program, &case, &kept.display().to_string()]);
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(5), "{out}{err}");
    assert!(err.contains("No space left on device"), "{err}");
    assert_whole(&kept);
    let result = json(&std::fs::read_to_string(kept.join("result.json")).unwrap());
    assert_eq!(result["status"], "failed");
    assert!(result["exit_reason"].as_str().unwrap().contains("No space left on device"), "{result}");
    let states = std::fs::read_dir(kept.join("checkpoint")).unwrap();
    assert!(states.count() >= 1, "a state is kept");
    assert!(out.contains("resumed 75"), "with room again it goes on: {out}{err}");
}

#[cfg(target_os = "linux")]
#[test]
fn threads_that_cannot_start_are_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let out = folder.path().join("results");
    // Address space for the program but not for the stacks of a thousand threads.
    let line = "ulimit -v 1500000; exec \"$0\" run \"$1\" -o \"$2\" --backend cpu -q --threads 1024";
    let program = seixo().get_program().to_owned();
    let output = Command::new("bash").args(["-c", line]).arg(program).arg(&case).arg(&out).output().unwrap();
    let err = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(5) && err.contains("1024 threads: "), "{:?}: {err}", output.status);
    assert!(!out.exists());
}

#[test]
fn a_study_cannot_write_beside_its_folder() {
    let folder = tempfile::tempdir().unwrap();
    let study =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../cases/study/hydrostatic.toml"));
    let study = study.unwrap();
    let named = |name: &str| {
        let mut lines: Vec<String> = study.lines().map(str::to_owned).collect();
        let line = lines.iter_mut().find(|l| l.starts_with("name = ")).unwrap();
        *line = format!("name = {name}");
        let path = folder.path().join("study.toml");
        std::fs::write(&path, lines.join("\n")).unwrap();
        ran(&["study", &path.display().to_string(), "--dry-run"])
    };
    for name in ["\"../../x\"", "\"/tmp/x\"", "\"\"", "\"a\\u001bb\"", "\".hidden\""] {
        let refused = named(name);
        assert!(
            refused.code == 2 && refused.err.contains("becomes the name of files"),
            "{name}: {}",
            refused.err
        );
        assert!(!refused.err.contains('\u{1b}'));
    }
}

/// Sizes are judged from the case alone: nothing is built, nothing overflows, and `plan` answers all the same.
#[test]
fn memory_and_disk_are_known_before_they_are_taken() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let out = folder.path().join("out");
    let shown = out.display().to_string();
    let run = |more: &[&str]| ran(&[&["run", &case, "--backend", "cpu", "-q", "-o", &shown], more].concat());
    for (more, words) in [
        (vec!["--memory-limit", "1M"], "of memory, 1.0 MB are allowed"),
        (
            vec!["--spacing", "2e-5", "--set", "run.time_step=1e-6", "--set", "fluid.viscosity=0"],
            "GB are free",
        ),
        (vec!["--set", "run.domain=[[-1e6,0,-1e6],[1e6,0,1e6]]"], "cells of search would take"),
        (
            vec!["--set", "run.domain=[[-400,0,-400],[400,0,400]]", "--memory-limit", "100M"],
            "cells of search take about",
        ),
        (vec!["--set", "output.every=1e-12", "--set", "run.end=1e5"], "are free on the disk of"),
    ] {
        let clock = std::time::Instant::now();
        let refused = run(&more);
        assert!(
            refused.code == 2 && refused.err.contains(words),
            "{more:?}: {} {}",
            refused.code,
            refused.err
        );
        assert!(clock.elapsed() < std::time::Duration::from_secs(10), "{more:?} took {:?}", clock.elapsed());
        assert!(!out.exists());
    }
    let forced = run(&["--set", "output.every=1e-12", "--force-disk", "--steps", "2"]);
    assert_eq!(forced.code, 0, "{}", forced.err);
    let fine = ["--spacing", "1e-5", "--set", "run.time_step=1e-6", "--set", "fluid.viscosity=0"];
    let plan = ran(&[&["plan", &case, "--json"], &fine[..]].concat());
    assert_eq!(plan.code, 0, "{}", plan.err);
    let estimate = &json(&plan.out)["estimate"];
    let number = |key: &str| estimate[key].as_f64().unwrap();
    assert!((number("water") / 2.5e9 - 1.0).abs() < 0.01 && number("memory_cpu") > 1e12, "{estimate}");
}

#[test]
fn a_thousand_errors_are_twenty_and_a_count() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.toml");
    let rows: String = (0..10_000).map(|k| format!("[{k}, nan, 0, 0],\n")).collect();
    let mut text = std::fs::read_to_string(small_case(folder.path())).unwrap();
    text = text.replace("motion = [[0, 0, 0, 0], [1, 0, 0, 0.5]]", &format!("motion = [{rows}]"));
    std::fs::write(&path, text).unwrap();
    let clock = std::time::Instant::now();
    let refused = ran(&["plan", &path.display().to_string()]);
    assert_eq!(refused.code, 2);
    assert_eq!(refused.err.matches("is not a finite number\n").count(), 20 * 2, "{}", refused.err);
    assert!(refused.err.contains("and 9980 more"));
    assert!(clock.elapsed() < std::time::Duration::from_secs(20), "{:?}", clock.elapsed());
}

#[test]
fn the_end_of_a_run_counts_the_water_that_has_come_in() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("case.toml").display().to_string();
    let out = folder.path().join("results");
    std::fs::write(
        &file,
        "[run]\nspacing = 0.02\ntime_step = 2e-3\nadaptive = true\nend = 0.2\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.1, 0.4]\nopen = [\"z_max\"]\n[fluid]\n\
         [[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0.1, 0.1]\nvelocity = 0.5\n[output]\nevery = 0\n",
    )
    .unwrap();
    let run = ran(&["run", &file, "--backend", "cpu", "-o", &out.display().to_string()]);
    assert_eq!(run.code, 0, "{}", run.err);
    let result = json(&std::fs::read_to_string(out.join("result.json")).unwrap());
    let came = result["water"]["inflow"][0]["particles"].as_u64().unwrap();
    assert!(came > 10 && result["particles"]["fluid"] == 0, "{result}");
    assert!(
        run.out.contains("pressure: ") && run.out.contains(&format!("0 of {came} particles lost")),
        "{}",
        run.out
    );
}
