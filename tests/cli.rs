//! The command line as a user meets it: messages, exit codes, files.

use crate::common::ONE_THREAD;
use assert_cmd::Command;
use std::path::Path;
use std::time::{Duration, Instant};

pub(crate) fn seixo() -> Command {
    let mut command = Command::cargo_bin("seixo").unwrap();
    command.current_dir(crate::common::ROOT).env(ONE_THREAD.0, ONE_THREAD.1);
    command
}

pub(crate) struct Ran {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) err: String,
}

pub(crate) fn ran(args: &[&str]) -> Ran {
    let output = seixo().args(args).output().unwrap();
    Ran {
        code: output.status.code().unwrap(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

pub(crate) fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// A small case with water, a gate, a free body and gauges, in `folder`.
pub(crate) fn small_case(folder: &Path) -> String {
    let path = folder.join("small.toml");
    std::fs::write(
        &path,
        r#"
[run]
spacing = 0.05
time_step = 1e-3
end = 0.05
dimensions = 2

[tank]
min = [0, 0, 0]
max = [2, 0, 1]
open = ["z_max"]

[fluid]
[[fluid.block]]
min = [0, 0, 0]
max = [0.5, 0, 0.5]

[[moving_wall]]
name = "gate"
min = [0.6, 0, 0]
max = [0.8, 0, 0.8]
motion = [[0, 0, 0, 0], [1, 0, 0, 0.5]]

[[gauge.pressure]]
name = "p floor"
point = [0.2, 0, 0]

[[gauge.level]]
name = "h"
at = [0.25, 0]

[[gauge.force]]
name = "on gate"
on = "gate"

[output]
every = 0.02
"#,
    )
    .unwrap();
    path.display().to_string()
}

pub(crate) fn assert_whole(root: &Path) {
    for entry in std::fs::read_dir(root).unwrap().chain(std::fs::read_dir(root.join("vtu")).unwrap()) {
        let path = entry.unwrap().path();
        if path.is_dir() {
            continue;
        }
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let bytes = std::fs::read(&path).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        match path.extension().and_then(|e| e.to_str()) {
            Some("vtu" | "pvd") => assert!(text.ends_with("</VTKFile>\n"), "{name}"),
            Some("csv") => {
                let columns = text.lines().next().unwrap().split(',').count();
                assert!(text.ends_with('\n'), "{name}");
                assert!(text.lines().all(|l| l.split(',').count() == columns), "{name}");
            }
            Some("json") => drop(json(&text)),
            Some("toml" | "png") => assert!(!text.is_empty()),
            _ => assert!(name.starts_with('.'), "{name}"),
        }
    }
}

pub(crate) fn files_named_in_pvd_exist(root: &Path, name: &str) -> usize {
    let pvd = std::fs::read_to_string(root.join(format!("{name}.pvd"))).unwrap();
    let files: Vec<&str> = pvd.split("file=\"").skip(1).map(|f| f.split('"').next().unwrap()).collect();
    assert!(files.iter().all(|f| root.join(f).exists()), "{files:?}");
    files.len()
}

#[test]
fn a_run_writes_everything_it_promises() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let root = folder.path().join("results");
    let out = root.display().to_string();
    let run =
        ran(&["run", &case, "-o", &out, "--backend", "cpu", "--json", "--picture", "--set", "run.end=0.045"]);
    assert_eq!(run.code, 0, "{}", run.err);
    assert_eq!(json(&run.out), json(&std::fs::read_to_string(root.join("result.json")).unwrap()));
    assert_whole(&root);
    // Frames at 0, 0.02, 0.04 and the end, each with walls, fluid and the gate.
    assert_eq!(files_named_in_pvd_exist(&root, "small"), 4 * 3);
    for file in ["pictures/frame_0003.png", "final.png"] {
        assert!(std::fs::read(root.join(file)).unwrap().starts_with(b"\x89PNG"), "{file}");
    }
    let text = std::fs::read_to_string(root.join("case.toml")).unwrap();
    assert!(text.contains("end = 0.045"), "the case with overrides is kept: {text}");

    let result = json(&run.out);
    assert_eq!(result["status"], "done");
    assert_eq!(result["steps"], 45);
    assert_eq!(result["particles"]["fluid"], 100);
    assert!(result["stages"]["conjugate_gradient"].as_f64().unwrap() > 0.0);
    assert!(result["pressure"]["iterations_mean"].as_f64().unwrap() > 0.0);
    assert!(result["bodies"][0]["name"] == "gate", "{}", result["bodies"]);

    let gauges = std::fs::read_to_string(root.join("gauges.csv")).unwrap();
    let header = gauges.lines().next().unwrap();
    assert!(header.starts_with("time [s],p floor [Pa],h [m],on gate_force_x [N]"), "{header}");
    let row: Vec<f64> = gauges.lines().last().unwrap().split(',').map(|x| x.parse().unwrap()).collect();
    assert!((row[0] - 0.045).abs() < 1e-9 && row[1] > 100.0 && (row[2] - 0.5).abs() < 0.05, "{row:?}");
    let bodies = std::fs::read_to_string(root.join("bodies.csv")).unwrap();
    let last: Vec<&str> = bodies.lines().last().unwrap().split(',').collect();
    let z: f64 = last[4].parse().unwrap();
    assert!(last[1] == "gate" && (z - (0.4 + 0.5 * 0.045)).abs() < 1e-9, "{last:?}");
    assert_eq!(std::fs::read_to_string(root.join("monitors.csv")).unwrap().lines().count(), 1 + 46);
}

#[test]
fn result_json_has_the_agreed_keys_whatever_happened() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let out = folder.path().join("results").display().to_string();
    let run = ran(&["run", &case, "-o", &out, "--backend", "cpu", "--json", "--steps", "2"]);
    let result = json(&run.out);
    for key in
        "case backend adapter precision status exit_reason steps time_s wall_s particles stages pressure \
                monitors bodies"
            .split(' ')
    {
        assert!(result.get(key).is_some(), "{key}");
    }
    for (table, keys) in [
        ("particles", "total fluid wall dummy body"),
        (
            "pressure",
            "preconditioner solves unknowns_mean iterations_mean iterations_max relative_residual_max failures \
             clamps negative",
        ),
        (
            "monitors",
            "density_error_max density_error_mean courant_max energy_start_J energy_end_J lost_particles \
             neighbours_max penetration_max_over_l0 contact_omega_dt contact_substeps_max \
             driven_contact_work_J",
        ),
    ] {
        for key in keys.split_whitespace() {
            assert!(result[table].get(key).is_some_and(|v| !v.is_null()), "{table}.{key}");
        }
    }
    for key in ["name", "position_m", "velocity_m_s"] {
        assert!(result["bodies"][0].get(key).is_some(), "{key}");
    }
}

#[test]
fn wrong_input_is_named_with_exit_code_2() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let out = folder.path().join("results").display().to_string();
    for (args, expected) in [
        (vec!["run", "no/such.toml"], vec!["no/such.toml"]),
        (vec!["run", &case, "--set", "run.spacin=1"], vec!["spacin", "spacing"]),
        (vec!["run", &case, "--set", "run.time_step=\"x\""], vec!["time_step"]),
        (vec!["run", &case, "--spacing", "-0.01"], vec!["run.spacing"]),
        (vec!["run", &case, "--set", "gauge.force.0.on=\"door\""], vec!["door", "gate"]),
        (vec!["run", &case, "--backend", "cpu", "--adapter", "0"], vec!["--adapter"]),
        (vec!["run", &case, "--backend", "tpu"], vec!["tpu", "cpu"]),
        (vec!["plan", "no/such.toml"], vec!["no/such.toml"]),
        (
            vec!["run", &case, "--spacing", "0.1", "--set", "run.spacing=0.2"],
            vec!["--spacing and --set run.spacing=0.2"],
        ),
        (
            vec!["plan", &case, "--until", "0.1", "--set", "run.end = 2"],
            vec!["--until and --set run.end = 2"],
        ),
        (vec!["run", &folder.path().display().to_string()], vec!["is a folder: a case is a file"]),
    ] {
        let rest: &[&str] = if args[0] == "run" { &["--out", &out] } else { &[] };
        let run = ran(&[&args[..], rest].concat());
        assert_eq!(run.code, 2, "{args:?}: {}", run.err);
        assert!(run.out.is_empty(), "{args:?}: {}", run.out);
        assert_eq!(run.err.matches("error").count(), 1, "one error, said once: {}", run.err);
        assert!(expected.iter().all(|word| run.err.contains(word)), "{args:?}: {}", run.err);
    }
    assert!(!Path::new(&out).exists(), "nothing is written for a case that is refused");
}

#[test]
fn earlier_results_are_not_overwritten_without_force() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let out = folder.path().join("results").display().to_string();
    let args = ["run", &case, "-o", &out, "--backend", "cpu", "--steps", "1", "-q"];
    let first = ran(&args);
    assert_eq!((first.code, first.err.as_str(), first.out.as_str()), (0, "", ""));
    let second = ran(&args);
    assert_eq!(second.code, 2);
    assert!(second.err.contains("not empty") && second.err.contains("--force"), "{}", second.err);
    assert_eq!(ran(&[&args[..], &["--force"]].concat()).code, 0);
}

#[test]
fn a_folder_that_cannot_be_made_is_an_input_output_error() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let run = ran(&["run", &case, "-o", &format!("{case}/results"), "--backend", "cpu", "--steps", "1"]);
    assert_eq!(run.code, 5, "{}", run.err);
    assert!(run.err.contains("small.toml/results"), "{}", run.err);
}

#[test]
fn a_run_that_diverges_keeps_what_it_wrote_and_the_last_state() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let root = folder.path().join("results");
    let out = root.display().to_string();
    // The water shoots out of the open top.
    let jet = "fluid.block.0.velocity=[0,0,500]";
    let run = ran(&["run", &case, "-o", &out, "--backend", "cpu", "--json", "--until", "10", "--set", jet]);
    assert_eq!(run.code, 4, "{}", run.err);
    for word in ["step ", "t = 0.", "stage cell_list", "fluid particles have left"] {
        assert!(run.err.contains(word), "{word}: {}", run.err);
    }
    let result = json(&run.out);
    assert_eq!(result["status"], "diverged");
    assert!(result["exit_reason"].as_str().unwrap().contains("last_*.vtu"));
    assert!(root.join("vtu/last_fluid.vtu").exists() && root.join("vtu/last_solids.vtu").exists());
    assert!(files_named_in_pvd_exist(&root, "small") >= 2 * 3, "earlier frames are kept");
    assert_whole(&root);
}

#[test]
fn plan_tells_what_is_left_out_and_why() {
    let dry = ran(&["plan", "cases/resting_cube.toml", "--json"]);
    assert_eq!(dry.code, 0, "{}", dry.err);
    let plan = json(&dry.out);
    for stage in plan["stages"].as_array().unwrap() {
        let planned = stage["stage"] == "contact";
        assert_eq!(stage["planned"], planned, "{stage}");
        assert!(!stage["reason"].as_str().unwrap().is_empty());
    }
    let wet = ran(&["plan", "cases/dam_break_transport.toml", "--spacing", "0.03"]);
    assert_eq!(wet.code, 0, "{}", wet.err);
    for word in
        ["n0 14.41858", "lambda 1.70174", "32 neighbours", "conjugate_gradient", "memory", "time step"]
    {
        assert!(wet.out.contains(word), "{word}: {}", wet.out);
    }
}

/// The time step that `plan` advises is the one that `run` takes, whatever sets it; and where no body is free there is
/// nothing to say of contact.
#[test]
fn plan_and_run_know_the_same_bounds_of_the_time_step() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("honey.toml");
    let text = "[run]\nspacing = 0.02\ntime_step = 1.0\nadaptive = true\nend = 1.0\n[fluid]\nviscosity = 1.0\n\
                [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 0.2, 0.1]\n[tank]\nmin = [0, 0, 0]\n\
                max = [0.2, 0.2, 0.2]\n[contact]\nspring = 1e5\n";
    std::fs::write(&path, text).unwrap();
    let case = path.display().to_string();
    let plan = json(&ran(&["plan", &case, "--json"]).out);
    let out = folder.path().join("out").display().to_string();
    let run = ran(&["run", &case, "--steps", "1", "--backend", "cpu", "-o", &out, "--json"]);
    assert_eq!(run.code, 0, "{}", run.err);
    let (planned, taken) =
        (plan["time_step_s"].as_f64().unwrap(), json(&run.out)["time_s"].as_f64().unwrap());
    assert!((planned / taken - 1.0).abs() < 1e-12 && planned < 1e-3, "{planned} planned, {taken} taken");
    let advice = plan["advice"].to_string();
    assert!(advice.contains("viscosity") && !advice.contains("contact"), "{advice}");
    // A light body asks for shorter steps than the honey around it.
    let foam = "[[body]]\nname = \"foam\"\nsize = [0.06, 0.06, 0.06]\ncenter = [0.1, 0.1, 0.05]\ndensity = 30\n\
                displaces_fluid = true\n";
    std::fs::write(&path, format!("{text}{foam}")).unwrap();
    let plan = json(&ran(&["plan", &case, "--json"]).out);
    let run = ran(&["run", &case, "--steps", "1", "--backend", "cpu", "-o", &out, "--force", "--json"]);
    let (with, taken) = (plan["time_step_s"].as_f64().unwrap(), json(&run.out)["time_s"].as_f64().unwrap());
    // Planned with the friction of a collapse, taken at rest.
    assert!((with / taken - 1.0).abs() < 1e-4 && with < 0.2 * planned, "{with} with it, {taken} taken");
    assert!(plan["advice"].to_string().contains("the drag on the body `foam`"), "{plan}");
}

/// Too many particles to build are estimated from a coarser scene, with what is divided for them.
#[test]
fn plan_answers_for_scenes_that_nothing_holds() {
    let plan = |spacing: &str| {
        let set = format!("run.spacing={spacing}");
        let args = ["plan", "cases/dam_break_transport.toml", "--set", &set, "--until", "0.25", "--json"];
        let ran = ran(&args);
        assert_eq!(ran.code, 0, "{}", ran.err);
        json(&ran.out)
    };
    let number = |v: &serde_json::Value| v.as_f64().unwrap();
    let (built, huge) = (plan("0.01"), plan("0.001"));
    assert!(built["estimated_from_spacing_m"].is_null() && number(&huge["estimated_from_spacing_m"]) > 0.003);
    assert_eq!((number(&built["end_s"]), number(&huge["end_s"])), (0.25, 0.25));
    // 0.5 x 0.5 x 0.35 m of water.
    assert!((number(&huge["particles"]["fluid"]) / 8.75e7 - 1.0).abs() < 0.02, "{}", huge["particles"]);
    let walls = |plan: &serde_json::Value| number(&plan["particles"]["wall"]);
    assert!((walls(&huge) / walls(&built) / 100.0 - 1.0).abs() < 0.05);
    let scheme = &huge["scheme"];
    // A hundred million particles on a device with 80 GB: in parts, with no limit broken.
    let forecast = &scheme["gpu_forecasts"][0];
    assert!(forecast["particles"].as_f64().unwrap() > 1e8 && number(&forecast["bytes"]) < 80e9, "{forecast}");
    assert!(forecast["excesses"].as_array().unwrap().is_empty(), "{forecast}");
    let parts = forecast["parts"].as_array().unwrap();
    for (buffer, least) in
        [("neighbour_list", 10), ("entry", 3), ("cell_row", 2), ("cell_start", 2), ("sorted", 2)]
    {
        let part = parts.iter().find(|p| p[0] == buffer).unwrap_or_else(|| panic!("{buffer}: {forecast}"));
        assert!(part[1].as_u64().unwrap() >= least, "{forecast}");
    }
    assert!(forecast["rows"].as_u64().unwrap() > 1, "{forecast}");
    // What was built whole keeps all limits, and so does it with ten million particles.
    let forecasts = built["scheme"]["gpu_forecasts"].as_array().unwrap();
    assert_eq!(forecasts.len(), 3);
    assert!(forecasts[0]["excesses"].as_array().unwrap().is_empty());
    assert!(number(&forecasts[1]["bytes"]) < 24e9);
    let groups = built["scheme"]["gpu_groups"].as_array().unwrap();
    assert_eq!(
        groups.iter().map(|g| number(&g["bytes"])).sum::<f64>(),
        number(&built["scheme"]["gpu_bytes"])
    );
}

/// Without a driver a GPU that is asked for is refused, and `auto` takes the CPU and says so.
#[cfg(target_os = "linux")]
#[test]
fn a_missing_gpu_is_an_error_only_if_it_was_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let without_driver = |args: &[&str]| {
        let mut command = seixo();
        command.env("VK_DRIVER_FILES", "/dev/null").env("VK_ICD_FILENAMES", "/dev/null");
        command.args(args).output().unwrap()
    };
    let out = folder.path().join("results").display().to_string();
    let run = ["run", &case, "-o", &out, "--steps", "1"];
    for asked in [["--backend", "gpu"], ["--adapter", "0"]] {
        let output = without_driver(&[&run[..], &asked].concat());
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(3), "{err}");
        assert!(err.contains("no GPU adapter") && err.contains("--backend cpu"), "{err}");
    }
    assert_eq!(without_driver(&["compare", &case]).status.code(), Some(3));
    let output = without_driver(&run);
    let err = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{err}");
    assert!(err.contains("on CPU"), "{err}");
    assert_eq!(without_driver(&["adapters"]).status.code(), Some(0));
}

#[test]
fn the_gpu_path_runs_and_compares_with_the_cpu() {
    if !crate::common::there_is_a_device("the program on a device") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let root = folder.path().join("results");
    let run = ran(&["run", &case, "-o", &root.display().to_string(), "--backend", "gpu", "--json"]);
    assert_eq!(run.code, 0, "{}", run.err);
    let result = json(&run.out);
    assert_eq!((result["backend"].as_str(), result["precision"].as_str()), (Some("gpu"), Some("f32")));
    assert_eq!((result["status"].as_str(), result["steps"].as_u64()), (Some("done"), Some(50)));
    assert_whole(&root);
    files_named_in_pvd_exist(&root, "small");
    let compared = json(&ran(&["compare", &case, "--steps", "5", "--warmup", "10", "--json"]).out);
    let stages = compared["stages"].as_array().unwrap();
    assert!(stages.iter().any(|s| s["stage"] == "conjugate_gradient"));
    assert!(stages.iter().all(|s| s["l2_relative"].as_f64().unwrap() < 5e-3), "{compared:#}");
    assert_eq!(compared["drift"]["steps"], 5);
}

#[test]
fn schema_and_adapters_answer_on_stdout() {
    let schema = ran(&["schema"]);
    assert_eq!(schema.code, 0);
    assert!(json(&schema.out)["properties"]["run"].is_object());
    let adapters = ran(&["adapters", "--json"]);
    assert_eq!(adapters.code, 0, "{}", adapters.err);
    assert!(json(&adapters.out).is_array());
}

/// A key is found as messages and --set name it, and a case file without its ending is asked about.
#[test]
fn names_as_one_types_them_are_understood() {
    let keys = ran(&["keys", "body.0.density"]);
    assert!(keys.code == 0 && keys.out.contains("[[body]] density"), "{} {}", keys.out, keys.err);
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let missing = ran(&["plan", case.strip_suffix(".toml").unwrap()]);
    assert!(missing.code == 2 && missing.err.contains(&format!("did you mean `{case}`?")), "{}", missing.err);
}

/// Start a long run and wait until it has written a frame.
#[cfg(unix)]
fn long_run(case: &str, root: &Path) -> std::process::Child {
    let child = crate::common::program()
        .args(["run", case, "--backend", "cpu", "--json", "--until", "1e6", "--force-disk", "-o"])
        .arg(root)
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while !root.join("vtu/fluid_0002.vtu").exists() {
        assert!(start.elapsed() < Duration::from_secs(60), "no frame after a minute");
        std::thread::sleep(Duration::from_millis(20));
    }
    child
}

#[cfg(unix)]
fn send(child: &std::process::Child, signal: &str) {
    let sent = std::process::Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

#[cfg(unix)]
#[test]
fn signals_end_a_run_with_everything_written() {
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        let folder = tempfile::tempdir().unwrap();
        let case = small_case(folder.path());
        let root = folder.path().join("results");
        let child = long_run(&case, &root);
        send(&child, signal);
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(code));
        let result = json(&String::from_utf8(output.stdout).unwrap());
        assert_eq!(result["status"], "interrupted");
        assert_whole(&root);
        files_named_in_pvd_exist(&root, "small");
        let frames = result["frames"].as_u64().unwrap();
        assert!(root.join(format!("vtu/fluid_{:04}.vtu", frames - 1)).exists());
    }
}

#[cfg(unix)]
#[test]
fn a_killed_run_leaves_only_whole_files() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let root = folder.path().join("results");
    let mut child = long_run(&case, &root);
    send(&child, "-KILL");
    assert!(!child.wait().unwrap().success());
    assert_whole(&root);
    files_named_in_pvd_exist(&root, "small");
    assert!(!root.join("result.json").exists());
}

#[test]
fn plan_tells_where_free_bodies_stand_and_what_they_weigh() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let text = std::fs::read_to_string(&case).unwrap().replace("dimensions = 2", "dimensions = 3");
    let text = text.replace("max = [2, 0, 1]", "max = [2, 0.4, 1]").replace("0.5, 0, 0.5]", "0.5, 0.4, 0.5]");
    // Two thirds of a wedge's length lie behind its centroid, a third of its height below.
    let body = "[contact]\nspring = 1e4\n[[body]]\nname = \"ramp\"\nshape = \"wedge\"\nsize = [0.3, 0.2, 0.3]\n\
                center = [1.4, 0.2, 0.7]\ndensity = 500\n[[moving_wall]]";
    std::fs::write(
        &case,
        text.replace("[[moving_wall]]", body).replace("max = [0.8, 0, 0.8]", "max = [0.8, 0.4, 0.8]"),
    )
    .unwrap();
    let plan = ran(&["plan", &case, "--json"]);
    assert_eq!(plan.code, 0, "{}", plan.err);
    let bodies = &json(&plan.out)["bodies"];
    // What is driven is not weighed.
    assert_eq!((bodies.as_array().unwrap().len(), &bodies[0]["name"]), (1, &"ramp".into()));
    let near = |value: &serde_json::Value, wanted: f64| (value.as_f64().unwrap() - wanted).abs() < 1e-9;
    assert!(near(&bodies[0]["mass_kg"], 4.5) && near(&bodies[0]["volume_m3"], 0.009), "{bodies}");
    let corners = [("min_m", [1.2, 0.1, 0.6]), ("max_m", [1.5, 0.3, 0.9])];
    for (key, corner) in corners {
        assert!((0..3).all(|k| near(&bodies[0][key][k], corner[k])), "{bodies}");
    }
    // m (b^2 / 12 + h^2 / 18) about x and its like about z; about y m (l^2 + h^2) / 18.
    let mut moments = [0, 1, 2].map(|k| bodies[0]["inertia_kg_m2"][k].as_f64().unwrap());
    moments.sort_by(f64::total_cmp);
    assert!((moments.iter().sum::<f64>() - 4.5 * (0.04 / 6.0 + 0.18 / 9.0)).abs() < 1e-9, "{moments:?}");
    let words = ran(&["plan", &case]).out;
    assert!(
        words.contains("`ramp`: 4.5000e0 kg, ") && words.contains(" kg m2, 9.0000e-3 m3; x 1.2000 to 1.5000"),
        "{words}"
    );
    // No water is around it: nine kilograms are what it displaces in all.
    assert!(words.contains("displaces 9.000e0 kg of water when all under: it floats"), "{words}");
    let aloft = std::fs::read_to_string(&case).unwrap();
    std::fs::write(&case, aloft.replace("density = 500", "density = 1000")).unwrap();
    let words = ran(&["plan", &case]).out;
    assert!(words.contains("of water when all under\n"), "as heavy as its water it does neither: {words}");
    let afloat = aloft.replace("center = [1.4, 0.2, 0.7]", "center = [0.3, 0.2, 0.45]");
    std::fs::write(&case, afloat.replace("density = 500", "density = 500\ndisplaces_fluid = true")).unwrap();
    let plan = ran(&["plan", &case, "--json"]);
    assert_eq!(plan.code, 0, "{}", plan.err);
    let body = &json(&plan.out)["bodies"][0]["buoyancy"];
    // From z = 0.35 to 0.65, in water up to 0.5 m: of its side, a triangle that narrows upwards, three quarters are under.
    let close = |key: &str, wanted: f64, within: f64| (body[key].as_f64().unwrap() - wanted).abs() < within;
    let half = 0.35 + 0.3 * (1.0 - 0.5_f64.sqrt());
    assert!(close("as_it_stands_kg", 6.75, 0.06) && close("lower_m", half - 0.5, 1e-3), "{body}");
    std::fs::write(&case, aloft).unwrap();
    let held = "locked = [\"x\", \"y\", \"z\", \"rotation_x\", \"rotation_y\", \"rotation_z\"]";
    std::fs::write(&case, std::fs::read_to_string(&case).unwrap().replace("density = 500", held)).unwrap();
    let words = ran(&["plan", &case]);
    assert!(
        words.out.contains("`ramp`: held, 9.0000e-3 m3; x 1.2000 to 1.5000"),
        "{} {}",
        words.out,
        words.err
    );
}
