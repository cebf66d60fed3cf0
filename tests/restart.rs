//! Restart: a run that is stopped, killed or damaged goes on as if nothing had happened.

use crate::cli::{Ran, json, ran, small_case};
use crate::common::{backends, there_is_a_device};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A free body that falls into the water, and a lid that keeps a second one in contact from the start.
const BODIES: [&str; 4] = [
    "body=[{name=\"falls\",size=[0.15,0.05,0.15],center=[1.2,0,0.3],density=600,velocity=[-1,0,-2],angular_velocity=[0,3,0]},\
     {name=\"rests\",size=[0.2,0.05,0.1],center=[1.5,0,0.05],density=2000}]",
    "contact={law=\"smooth\",spring=1e5,damping=20,friction=0.3}",
    "run.time_step=2e-3",
    "run.adaptive=true",
];

/// Everything that a run wrote and that does not tell times by the clock.
pub(crate) fn results(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![root.to_path_buf(), root.join("vtu")];
    for series in std::fs::read_dir(root.join("series")).into_iter().flatten() {
        let series = series.unwrap().path();
        folders.extend([series.join("vtu"), series]);
    }
    for folder in folders {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if !path.is_file() || name.starts_with('.') || name == "result.json" {
                continue;
            }
            let mut bytes = std::fs::read(&path).unwrap();
            if name == "monitors.csv" {
                let text = String::from_utf8(bytes).unwrap();
                let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
                let kept = |line: &str| {
                    let cells = line.split(',').zip(&head).filter(|(_, h)| !h.starts_with("wall_"));
                    cells.map(|(c, _)| c).collect::<Vec<_>>().join(",")
                };
                bytes = text.lines().map(kept).collect::<Vec<_>>().join("\n").into_bytes();
            }
            found.insert(folder.strip_prefix(root).unwrap().join(name).display().to_string(), bytes);
        }
    }
    found
}

pub(crate) fn assert_same(a: &Path, b: &Path, what: &str) {
    let (a, b) = (results(a), results(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>(), "{what}");
    for (name, bytes) in &a {
        if bytes != &b[name] {
            let (x, y) = (String::from_utf8_lossy(bytes), String::from_utf8_lossy(&b[name]));
            let line = x.lines().zip(y.lines()).position(|(x, y)| x != y).unwrap_or(0);
            let show = |t: &str| t.lines().nth(line).unwrap_or("").chars().take(300).collect::<String>();
            panic!("{what}: {name} differs in line {line}:\n{}\n{}", show(&x), show(&y));
        }
    }
}

struct Case {
    folder: tempfile::TempDir,
    path: String,
    sets: Vec<String>,
    backend: &'static str,
}

impl Case {
    fn new(sets: &[&str], backend: &'static str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = small_case(folder.path());
        Self {
            folder,
            path,
            sets: sets.iter().flat_map(|s| ["--set".into(), (*s).into()]).collect(),
            backend,
        }
    }

    fn root(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }

    fn args<'a>(&'a self, root: &'a str, more: &[&'a str]) -> Vec<&'a str> {
        let mut args = vec!["run", &self.path, "--backend", self.backend, "-q", "--threads", "1", "-o", root];
        args.push("--force-disk");
        args.extend(self.sets.iter().map(String::as_str));
        args.extend(more);
        args
    }

    fn run(&self, name: &str, more: &[&str]) -> Ran {
        ran(&self.args(&self.root(name).display().to_string(), more))
    }

    /// Undisturbed, and in three parts.
    fn assert_goes_on(&self, what: &str) {
        let whole = self.run("whole", &[]);
        assert_eq!(whole.code, 0, "{what}: {}", whole.err);
        for steps in [Some("7"), Some("21"), None] {
            let more: Vec<&str> =
                ["--resume"].into_iter().chain(steps.iter().flat_map(|s| ["--steps", s])).collect();
            let part = self.run("parts", &more);
            assert_eq!(part.code, 0, "{what}, {steps:?}: {}", part.err);
        }
        assert_same(&self.root("whole"), &self.root("parts"), what);
        let result =
            |name: &str| json(&std::fs::read_to_string(self.root(name).join("result.json")).unwrap());
        let assert_same_result = |parts: u64| {
            let (mut a, mut b) = (result("whole"), result("parts"));
            assert_eq!((a["parts"].as_u64(), b["parts"].as_u64()), (Some(1), Some(parts)));
            for times in ["wall_s", "parts", "stages", "memory_peak_bytes"] {
                a[times] = serde_json::Value::Null;
                b[times] = serde_json::Value::Null;
            }
            assert_eq!(a, b, "{what}, {parts} parts");
        };
        assert_same_result(3);
        // Killed before its last word, it says the same without a step more.
        std::fs::remove_file(self.root("parts").join("result.json")).unwrap();
        let last = self.run("parts", &["--resume"]);
        assert_eq!(last.code, 0, "{what}: {}", last.err);
        assert_same_result(4);
    }
}

#[test]
fn a_run_in_parts_is_the_run_to_the_last_bit() {
    let more = |own: &[&'static str]| [own, &BODIES[..]].concat();
    for (what, sets) in [
        ("a gate", vec!["fluid.viscosity=1e-3"]),
        ("no viscosity, no warm start", vec!["fluid.viscosity=0", "fluid.solver.warm_start=false"]),
        ("bodies", more(&[])),
        (
            "the paper's law and scheme",
            more(&[
                "contact.law=paper",
                "contact.friction=0",
                "fluid.preset=paper",
                "body.1.center=[1.5,0,0.07]",
            ]),
        ),
        ("multigrid", more(&["fluid.solver.preconditioner=multigrid"])),
        ("periodic sides", vec!["tank.periodic=[\"x\"]", "run.gravity=[2, 0, -9.81]", "output.ledger=true"]),
        (
            "series of frames",
            more(&[
                "output.series=[{name=\"a\",every=0.003,fields=[]},{name=\"b\",every=1e-9,kinds=[\"body\"]}]",
            ]),
        ),
        ("tables now and then", more(&["output.table_every=0.007", "gauge.every=0.011", "gauge.mean=true"])),
    ] {
        let sets: Vec<&str> = match what {
            // The order matters: the table comes before its keys.
            "the paper's law and scheme" => [
                &BODIES[..],
                &[
                    "contact.law=paper",
                    "contact.friction=0",
                    "fluid.preset=paper",
                    "body.1.center=[1.5,0,0.07]",
                ],
            ]
            .concat(),
            _ => sets,
        };
        Case::new(&sets, "cpu").assert_goes_on(what);
    }
}

#[test]
fn a_dry_run_in_parts_is_the_run_to_the_last_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dry.toml");
    let mut text =
        "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 0.3\n[tank]\nmin = [0, 0, 0]\nmax = [0.8, 0.8, 2]\n\
                    [contact]\nspring = 1e5\nrestitution = 0.3\nfriction = 0.3\n[output]\nevery = 0.1\n"
            .to_owned();
    for k in 0..5 {
        text += &format!(
            "[[body]]\nname = \"b{k}\"\nsize = [0.1, 0.1, 0.1]\ndensity = 800.0\ncenter = [0.4, {:?}, {:?}]\n\
             orientation = {{ axis = [1, 1, 0], angle_deg = {} }}\n",
            0.4 + 0.02 * f64::from(k),
            0.12 + 0.15 * f64::from(k),
            10 * k
        );
    }
    std::fs::write(&path, text).unwrap();
    let case = Case { folder, path: path.display().to_string(), sets: Vec::new(), backend: "cpu" };
    case.assert_goes_on("a heap");
}

#[test]
fn a_run_on_the_device_in_parts_is_the_run_to_the_last_bit() {
    if !there_is_a_device("a run on a device in parts") {
        return;
    }
    let device = |own: &[&'static str]| [&BODIES[..], own].concat();
    Case::new(&["fluid.viscosity=1e-3", "output.ledger=true"], "gpu").assert_goes_on("a gate on the device");
    Case::new(&device(&["fluid.solver.preconditioner=multigrid", "contact.device=gpu"]), "gpu")
        .assert_goes_on("multigrid and contact on the device");
}

/// Killed at any moment, and started again by the same command, until it is done.
#[test]
fn a_run_that_is_killed_again_and_again_ends_as_if_it_had_not_been() {
    // A checkpoint every other millisecond of simulated time, and by the clock all the time.
    let sets = [&BODIES[..], &["run.checkpoint={every=2e-3,wall=0.02}", "run.end=0.2"]].concat();
    let case = Case::new(&sets, "cpu");
    assert_eq!(case.run("whole", &[]).code, 0);
    let root = case.root("killed").display().to_string();
    let start = |root: &str| -> Child {
        let mut command = crate::common::program();
        command.current_dir(crate::common::ROOT).args(case.args(root, &["--resume"]));
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let (mut kills, mut state) = (0, 0x2545_f491_4f6c_dd1d_u64);
    let half = ["", "vtu", "checkpoint"].map(|f| case.root("killed").join(f).join(".writing-half"));
    let begun = Instant::now();
    loop {
        let mut child = start(&root);
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        // Short at first, so that a quick machine is killed often enough; longer and longer, so that a slow one comes to the end too.
        let patience = Duration::from_millis(5 + (state >> 33) % (15 + 20 * kills));
        let clock = Instant::now();
        let ended = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break Some(status);
            }
            if clock.elapsed() > patience {
                break None;
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        if let Some(status) = ended {
            assert_eq!(status.code(), Some(0));
            break;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        kills += 1;
        // Nothing is half written after the result: whoever is killed later than that has nothing to clear.
        let done = case.root("killed").join("result.json").exists();
        for path in half.iter().filter(|path| !done && path.parent().is_some_and(Path::exists)) {
            std::fs::write(path, "half").unwrap();
        }
        assert!(begun.elapsed() < Duration::from_secs(240), "{kills} kills and no end");
    }
    assert!(kills >= 3, "only {kills} kills");
    assert_same(&case.root("whole"), &case.root("killed"), &format!("{kills} kills"));
    // What a kill cuts off while it is written is cleared by whoever goes on.
    assert!(half.iter().all(|path| !path.exists()), "left behind");
}

#[test]
fn a_done_run_is_left_alone_and_a_changed_case_is_refused_by_key() {
    let case = Case::new(&[], "cpu");
    assert_eq!(case.run("a", &["--resume"]).code, 0, "nothing is there: it starts");
    let before = std::fs::metadata(case.root("a").join("result.json")).unwrap().modified().unwrap();
    let again = case.run("a", &["--resume"]);
    assert_eq!((again.code, again.err.as_str()), (0, ""));
    assert_eq!(std::fs::metadata(case.root("a").join("result.json")).unwrap().modified().unwrap(), before);
    let root = case.root("a").display().to_string();
    let by_folder = ran(&["run", "--resume", &root, "--backend", "cpu"]);
    assert!(by_folder.code == 0 && by_folder.out.contains("is done"), "{} {}", by_folder.out, by_folder.err);
    let longer = case.run("a", &["--resume", "--until", "0.1", "--set", "fluid.density=900.0"]);
    assert_eq!(longer.code, 2);
    for word in ["fluid.density was 1000.0, is 900.0", "run.end was 0.05, is 0.1", "run.from"] {
        assert!(longer.err.contains(word), "{word}: {}", longer.err);
    }
    // Beside the case, wherever that is and whatever folder the command was typed in.
    let typed = || {
        let mut command = crate::cli::seixo();
        command.current_dir(case.folder.path()).args(case.args("a", &["--resume", "--until", "0.1"]));
        command
    };
    let told = String::from_utf8(typed().output().unwrap().stderr).unwrap();
    let from = told.split("run.from = \"").nth(1).and_then(|rest| rest.split('"').next()).unwrap_or_default();
    assert!(Path::new(from).is_absolute() && from.ends_with('a'), "{told}");
    // A state of another scene is none to begin with.
    let other = typed().args(["--set", "run.spacing=0.1"]).output().unwrap();
    let told = String::from_utf8(other.stderr).unwrap();
    assert!(told.contains("run.spacing was") && !told.contains("run.from"), "{told}");
    let none = ran(&["run", "--resume", &case.folder.path().display().to_string()]);
    assert!(none.code == 2 && none.err.contains("holds no run"), "{}", none.err);
}

#[test]
fn a_damaged_state_is_passed_over_for_the_older_one() {
    let case = Case::new(&["run.checkpoint={every=0.01}"], "cpu");
    assert_eq!(case.run("whole", &[]).code, 0);
    assert_eq!(case.run("a", &["--steps", "33"]).code, 0);
    let files = || {
        let entries = std::fs::read_dir(case.root("a").join("checkpoint")).unwrap();
        let mut files: Vec<_> = entries.map(|e| e.unwrap().path()).collect();
        files.sort();
        files
    };
    let two = files();
    assert_eq!(two.len(), 2, "{two:?}");
    let mut bytes = std::fs::read(&two[1]).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&two[1], &bytes).unwrap();
    let resumed = case.run("a", &["--resume"]);
    assert_eq!(resumed.code, 0, "{}", resumed.err);
    assert!(
        resumed.err.contains("an older state is taken") && resumed.err.contains("is damaged"),
        "{}",
        resumed.err
    );
    assert_same(&case.root("whole"), &case.root("a"), "from the older state");
    // Both of them: nothing is computed from what is left.
    assert_eq!(case.run("b", &["--steps", "33"]).code, 0);
    for entry in std::fs::read_dir(case.root("b").join("checkpoint")).unwrap() {
        std::fs::write(entry.unwrap().path(), b"seixo checkpoint").unwrap();
    }
    let lost = case.run("b", &["--resume"]);
    assert!(lost.code == 2 && lost.err.matches("cut off").count() == 2, "{}", lost.err);
}

/// What `plan` tells of the disk is no less than what the states take, and not many times it: places on a lattice pack well.
#[test]
fn states_take_no_more_room_than_was_told() {
    let sets = [
        "run.dimensions=3",
        "tank.max=[2,0.5,1]",
        "fluid.viscosity=1e-4",
        "fluid.block.0.max=[0.5,0.5,0.5]",
        "moving_wall.0.max=[0.8,0.5,0.8]",
        "run.checkpoint={every=1e-3,wall=0}",
        "output.every=1",
    ];
    let case = Case::new(&sets, "cpu");
    let sets = sets.map(|set| ["--set", set]).concat();
    let plan = json(&ran(&[&["plan", &case.path, "--json"], &sets[..]].concat()).out);
    // Two that are kept, and the one that is being written.
    let told = plan["estimate"]["checkpoint_bytes"].as_f64().unwrap() / 3.0;
    assert_eq!(case.run("a", &["--steps", "20"]).code, 0);
    for file in seixo::checkpoint::file::files(&case.root("a").join("checkpoint")).unwrap() {
        let real = std::fs::metadata(file).unwrap().len() as f64;
        assert!((1.0..4.0).contains(&(told / real)), "{real} bytes of {told}");
    }
}

/// Another interval holds from then on, whatever multiples of the old one have been reached.
#[test]
fn a_run_goes_on_with_states_at_other_times() {
    let case = Case::new(&["run.checkpoint={every=1e-3,wall=0}", "output.every=1"], "cpu");
    let steps = || {
        let files = seixo::checkpoint::file::files(&case.root("a").join("checkpoint")).unwrap();
        let step =
            |path: &std::path::PathBuf| path.file_stem().unwrap().to_str().unwrap()[5..].parse().unwrap();
        files.iter().map(step).collect::<Vec<u64>>()
    };
    assert_eq!(case.run("a", &["--steps", "20"]).code, 0);
    assert_eq!(steps(), [20, 19]);
    let on = case.run("a", &["--resume", "--set", "run.checkpoint.every=0.01", "--steps", "35"]);
    assert_eq!(on.code, 0, "{}", on.err);
    assert_eq!(steps(), [35, 30]);
}

/// A run keeps the names of its files when the case file gets another one, and when its folder tells it.
#[test]
fn a_run_goes_on_with_its_case_renamed() {
    let mut case = Case::new(&[], "cpu");
    assert_eq!(case.run("whole", &[]).code, 0);
    assert_eq!(case.run("a", &["--steps", "7"]).code, 0);
    let renamed = case.root("renamed.toml");
    std::fs::rename(&case.path, &renamed).unwrap();
    case.path = renamed.display().to_string();
    let on = case.run("a", &["--resume", "--steps", "30"]);
    assert_eq!(on.code, 0, "{}", on.err);
    let root = case.root("a").display().to_string();
    let told = ran(&["run", "--resume", &root, "--backend", "cpu", "--threads", "1", "-q"]);
    assert_eq!(told.code, 0, "{}", told.err);
    assert_same(&case.root("whole"), &case.root("a"), "renamed");
}

#[test]
fn a_state_starts_another_case() {
    let case = Case::new(&[], "cpu");
    assert_eq!(case.run("long", &["--until", "0.08"]).code, 0);
    assert_eq!(case.run("first", &[]).code, 0);
    let from = format!("run.from=\"{}\"", case.root("first").display());
    let more = ["--until", "0.08", "--set", &from, "--set", "output.every=0.04", "--set", "gauge.every=0.02"];
    let second = case.run("second", &more);
    assert_eq!(second.code, 0, "{}", second.err);
    let last = |name: &str, frame: &str| std::fs::read(case.root(name).join("vtu").join(frame)).unwrap();
    assert_eq!(last("long", "fluid_0004.vtu"), last("second", "fluid_0001.vtu"), "the same water at 0.08 s");
    let gauges = std::fs::read_to_string(case.root("second").join("gauges.csv")).unwrap();
    assert!(gauges.lines().nth(1).unwrap().starts_with("0.05"), "{gauges}");
    // The last row is of the end of a run, which need not be a multiple.
    let odd = case.run("odd", &["--until", "0.07", "--set", &from, "--set", "gauge.every=0.015"]);
    assert_eq!(odd.code, 0, "{}", odd.err);
    let gauges = std::fs::read_to_string(case.root("odd").join("gauges.csv")).unwrap();
    let times: Vec<f64> =
        gauges.lines().skip(1).map(|l| l.split(',').next().unwrap().parse().unwrap()).collect();
    assert!(times.len() >= 3 && (times[times.len() - 1] - 0.07).abs() < 1e-9, "{gauges}");
    let other = case.run("third", &["--until", "0.08", "--set", &from, "--spacing", "0.04"]);
    assert!(other.code == 2 && other.err.contains("run.spacing was 0.05, is 0.04"), "{}", other.err);
    for (sets, words) in [
        (&["--until", "0.05"][..], "run.end: the state of run.from is of t = 0.0500"),
        (&["--until", "0.08", "--set", "moving_wall.0.max=[0.8,0,0.7]"], "moving_wall.0.max"),
        (&["--until", "0.08", "--set", "fluid.block.0.max=[0.5,0,0.4]"], "fluid.block.0.max"),
        (
            &["--until", "0.08", "--set", "obstacle=[{name=\"step\",min=[1.5,0,0],max=[2,0,0.2]}]"],
            "obstacle had 0, has 1: `step` is new; nothing can be added to it or taken out",
        ),
        // The gate is 25 mm up; it would be 5 mm higher at once.
        (
            &["--until", "0.08", "--set", "moving_wall.0.motion=[[0,0,0,0],[1,0,0,0.6]]"],
            "`gate` stands 5.000e-3 m from where its motion has it at t = 0.0500",
        ),
    ] {
        let wrong = case.run("third", &[&["--set", &from][..], sets].concat());
        assert!(wrong.code == 2 && wrong.err.contains(words), "{words}: {}", wrong.err);
        assert!(!case.root("third").exists(), "{words}");
    }
    // Steps that are asked for are the run's own, when it goes on, too.
    let (short, root) = (case.root("short"), case.root("short").display().to_string());
    for (own, more) in [(5, &["--steps", "5"][..]), (9, &["--steps", "9", "--resume"])] {
        let args: Vec<&str> = case.args(&root, &["--until", "0.08", "--set", &from]);
        let few =
            ran(&args.into_iter().filter(|a| *a != "-q").chain(more.iter().copied()).collect::<Vec<_>>());
        let result = json(&std::fs::read_to_string(short.join("result.json")).unwrap());
        let (all, before) = (result["steps"].as_u64().unwrap(), result["steps_before"].as_u64().unwrap());
        assert!(few.code == 0 && before >= 50 && all == before + own, "{all} of {before}: {}", few.err);
        let told = format!("{own} steps, after {before} of run.from, to t = ");
        assert!(few.out.contains(&told), "{}", few.out);
    }
    // What happens from then on may change, where the wall goes included.
    let free = [
        "--set",
        "moving_wall.0.motion=[[0,0,0,0],[0.05,0,0,0.025],[1,0,0,0.9]]",
        "--set",
        "fluid.viscosity=1e-4",
        "--set",
        "gauge.level=[]",
        "--until",
        "0.06",
    ];
    let freed = case.run("free", &[&["--set", &from][..], &free].concat());
    assert_eq!(freed.code, 0, "{}", freed.err);
    // The state is not cleared away by the run that begins with it.
    let onto = case.run("first", &[&["--set", &from, "--force"][..], &["--until", "0.08"]].concat());
    assert!(onto.code == 2 && case.root("first").join("checkpoint").exists(), "{}", onto.err);
    let file = format!("run.from=\"{}\"", case.root("first").join("case.toml").display());
    let file = case.run("third", &["--set", &file]);
    assert!(
        file.code == 2 && file.err.contains("run.from: ") && file.err.contains("is a file"),
        "{}",
        file.err
    );
    let nowhere = case.run("third", &["--set", "run.from=\"nowhere\""]);
    assert!(
        nowhere.code == 2 && nowhere.err.contains("nowhere` is not there; name the folder"),
        "{}",
        nowhere.err
    );
}

/// What is lowered is let go: a state of a scene in which no body is free has no answer of theirs to the water.
#[test]
fn a_body_that_is_driven_in_a_state_is_free_from_then_on() {
    for backend in backends("a body let go on a device") {
        let body = |more: &str| {
            let rest = "size=[0.2,0.05,0.2],center=[0.25,0,0.62],density=500";
            format!("body=[{{name=\"caisson\",{rest}{more}}}]")
        };
        let lowered = [&body(",motion=[[0,0,0,0],[0.04,0,0,-0.06]]"), "contact.spring=1e5", "run.end=0.05"];
        let case = Case::new(&lowered, backend);
        let first = case.run("first", &[]);
        assert_eq!(first.code, 0, "{backend}: {}", first.err);
        let from = format!("run.from=\"{}\"", case.root("first").display());
        let freed = Case::new(&[&body(""), "contact.spring=1e5", &from, "run.end=0.15"], backend);
        let second = freed.run("second", &[]);
        assert_eq!(second.code, 0, "{backend}: {}", second.err);
        let table = std::fs::read_to_string(freed.root("second").join("bodies.csv")).unwrap();
        let rows = table.lines().skip(1).filter(|l| l.split(',').nth(1) == Some("caisson"));
        let heights: Vec<f64> = rows.map(|l| l.split(',').nth(4).unwrap().parse().unwrap()).collect();
        let (start, end) = (heights[0], heights[heights.len() - 1]);
        // Too high for its weight, it sinks.
        assert!((start - 0.56).abs() < 1e-6 && end < start - 0.005, "{backend}: {start} to {end}");
    }
}

/// On a device places count from the middle of the domain.
#[test]
fn a_state_is_gone_on_with_in_another_domain() {
    for backend in backends("a state of a device in another domain") {
        let case = Case::new(&["run.end=0.02"], backend);
        let first = case.run("first", &[]);
        assert_eq!(first.code, 0, "{backend}: {}", first.err);
        let from = format!("run.from=\"{}\"", case.root("first").display());
        let [here, wider] = ["[[-1,-1,-1],[3,2,2]]", "[[-1,-1,-1],[7,2,5]]"].map(|domain| {
            let next = Case::new(&[&from, "run.end=0.03", &format!("run.domain={domain}")], backend);
            let ran = next.run("next", &[]);
            assert_eq!(ran.code, 0, "{backend}: {}", ran.err);
            let result = json(&std::fs::read_to_string(next.root("next").join("result.json")).unwrap());
            result["monitors"]["energy_end_J"].as_f64().unwrap()
        });
        assert!((wider / here - 1.0).abs() < 1e-3, "{backend}: {here} and {wider} J");
    }
}

/// A state may be gone on with under other laws, masses and freedoms: what follows from those is made anew.
#[test]
fn another_run_takes_over_how_things_move_and_nothing_that_followed_from_laws() {
    let body = |more: &str| format!("body=[{{name=\"wheel\",size=[0.2,0.05,0.1],center=[1.5,0,0.7]{more}}}]");
    let (turned, free) = (
        body(",rotation=[[0,0,0,0],[1,0,90,0]]"),
        body(",density=500,velocity=[0.5,0,0],angular_velocity=[0,2,0]"),
    );
    let dry = ["run.gravity=[0,0,0]", "run.adaptive=false", "run.time_step=1e-3"];
    let soft = "contact.spring=1e5";
    let end = |sets: &[&str], name: &str, from: Option<&Case>| {
        let from = from.map(|case| format!("run.from=\"{}\"", case.root("run").display()));
        let end = if from.is_some() { "run.end=0.1" } else { "run.end=0.05" };
        let sets: Vec<&str> =
            dry.iter().chain(sets).chain(from.as_deref().iter()).chain([&end]).copied().collect();
        let case = Case::new(&sets, "cpu");
        let ran = case.run("run", &[]);
        assert_eq!(ran.code, 0, "{name}: {}", ran.err);
        let result = json(&std::fs::read_to_string(case.root("run").join("result.json")).unwrap());
        (case, result)
    };
    let of =
        |result: &serde_json::Value, key: &str, axis: usize| result["bodies"][0][key][axis].as_f64().unwrap();
    // Driven round and let go, it turns on; it is high above the water.
    let (driven, _) = end(&[&turned, soft], "driven", None);
    let (_, freed) = end(&[&body(",density=500"), soft], "freed", Some(&driven));
    let spin = of(&freed, "angular_velocity_rad_s", 1);
    assert!((spin / (std::f64::consts::FRAC_PI_2) - 1.0).abs() < 1e-6, "{spin}");
    // Locked from then on, it stands; heavier, it goes on as fast.
    let (moving, before) = end(&[&free, soft], "free", None);
    let more = |more: &str| body(&format!(",velocity=[0.5,0,0],angular_velocity=[0,2,0],{more}"));
    let (_, heavy) = end(&[&more("density=5000"), soft], "heavy", Some(&moving));
    assert!((of(&heavy, "angular_velocity_rad_s", 1) - 2.0).abs() < 1e-9, "{heavy}");
    assert!((of(&heavy, "velocity_m_s", 0) - 0.5).abs() < 1e-9, "{heavy}");
    let (_, held) = end(&[&more("density=500,locked=[\"x\"]"), soft], "held", Some(&moving));
    let way = |r: &serde_json::Value| of(r, "position_m", 0) - of(&before, "position_m", 0);
    assert!((way(&heavy) - 0.025).abs() < 1e-6 && way(&held) == 0.0, "{} {}", way(&heavy), way(&held));
    assert_eq!(of(&held, "velocity_m_s", 0), 0.0);
    // Locked in all that it could do, it stays where it has come to, when that run goes on, too.
    let whole = more("density=500,locked=[\"x\",\"z\",\"rotation_y\"]");
    let (fixed, stuck) = end(&[&whole, soft], "stuck", Some(&moving));
    assert_eq!(fixed.run("parts", &["--steps", "20"]).code, 0);
    assert_eq!(fixed.run("parts", &["--resume"]).code, 0);
    let parts = json(&std::fs::read_to_string(fixed.root("parts").join("result.json")).unwrap());
    for stuck in [stuck, parts] {
        for key in ["position_m", "orientation_wxyz"] {
            assert_eq!(stuck["bodies"][0][key], before["bodies"][0][key]);
        }
        assert_eq!((of(&stuck, "velocity_m_s", 0), of(&stuck, "angular_velocity_rad_s", 1)), (0.0, 0.0));
    }
    // A harder spring is cut into more sub-steps; a ledger begins with the run.
    let (_, hard) = end(&[&free, "contact.spring=1e7", "output.ledger=true"], "hard", Some(&moving));
    let substeps = |r: &serde_json::Value| r["monitors"]["contact_substeps_max"].as_u64().unwrap();
    assert!(substeps(&hard) > substeps(&before), "{} {}", substeps(&hard), substeps(&before));
    let left = hard["ledger_J"]["unaccounted"].as_f64().unwrap();
    assert!(left.abs() < 1e-9, "{left}");
    // Pressed into the wall it comes back out of it, whether or not somebody has looked at the energy before it was taken over.
    let struck = body(",density=500,velocity=[1,0,0]").replace("center=[1.5,", "center=[1.853,");
    let (striking, _) = end(&[&struck, soft], "striking", None);
    let [plain, watched] = ["output.ledger=false", "output.ledger=true"]
        .map(|ledger| end(&[&struck, soft, ledger], ledger, Some(&striking)).1);
    assert!(of(&watched, "velocity_m_s", 0) < -0.3, "{watched}");
    assert_eq!(watched["bodies"], plain["bodies"]);
    // Solves are those of the run.
    let steps = |r: &serde_json::Value| r["steps"].as_u64().unwrap();
    assert_eq!(hard["pressure"]["solves"].as_u64().unwrap(), steps(&hard) - steps(&before));
}

#[cfg(unix)]
#[test]
fn signals_and_the_clock_stop_a_run_with_its_state_saved() {
    let case = Case::new(&["run.end=1e6", "output.every=0.005"], "cpu");
    for (signal, code) in [("-USR1", 75), ("-HUP", 129), ("-XCPU", 75), ("-TERM", 143)] {
        let root = case.root(signal).display().to_string();
        let mut command = crate::common::program();
        command.args(case.args(&root, &[])).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let clock = Instant::now();
        while !case.root(signal).join("vtu/fluid_0001.vtu").exists() {
            assert!(clock.elapsed() < Duration::from_secs(60), "no frame after a minute");
            std::thread::sleep(Duration::from_millis(5));
        }
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        assert_eq!(child.wait().unwrap().code(), Some(code), "{signal}");
        let result = json(&std::fs::read_to_string(case.root(signal).join("result.json")).unwrap());
        assert!(result["exit_reason"].as_str().unwrap().contains("go on with --resume"), "{result}");
        assert_eq!(std::fs::read_dir(case.root(signal).join("checkpoint")).unwrap().count(), 1);
    }
    let stopped = case.run("wall", &["--max-wall", "0.3s"]);
    assert_eq!(stopped.code, 75, "{}", stopped.err);
    let steps = |name: &str| {
        json(&std::fs::read_to_string(case.root(name).join("result.json")).unwrap())["steps"]
            .as_u64()
            .unwrap()
    };
    let before = steps("wall");
    assert_eq!(case.run("wall", &["--max-wall", "0.3s", "--resume"]).code, 75);
    assert!(steps("wall") > before, "it went on");
    assert_eq!(case.run("clock", &["--max-wall", "0:00.3"]).code, 75);
    // Longer than any clock counts.
    assert_eq!(case.run("ages", &["--max-wall", "150000000000000d", "--steps", "2"]).code, 0);
    for wrong in ["", "soon", "-3h", "0", "3x", "1:2:3:4"] {
        let told = case.run("wrong", &[&format!("--max-wall={wrong}")]);
        assert!(
            told.code == 2 && told.err.contains("1:30:00 (hours:minutes:seconds)"),
            "{wrong}: {}",
            told.err
        );
    }
}

/// Spacings at one of which the steps of that case take seconds, however fast the machine is.
#[cfg(unix)]
const LONG: [&str; 3] = ["0.002", "0.0014", "0.001"];

/// Sends `signal` twice in a moment, as `timeout` does, to a run of `args` after `wait`; its exit code, its remarks and how long it took to end.
#[cfg(unix)]
fn interrupted(args: &[&str], signal: &str, wait: impl Fn() -> bool) -> (Option<i32>, String, Duration) {
    let mut command = crate::common::program();
    let child = command.args(args).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let clock = Instant::now();
    while !wait() {
        assert!(clock.elapsed() < Duration::from_secs(60), "it never came so far");
        std::thread::sleep(Duration::from_millis(5));
    }
    let clock = Instant::now();
    for _ in 0..2 {
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    }
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned(), clock.elapsed())
}

/// A solve of many seconds is given up when a signal comes; what is left goes on to the same end. The clock does so, too.
#[cfg(unix)]
#[test]
fn a_long_step_is_given_up_and_nothing_is_lost() {
    // Nothing damps the pressure, the diagonal alone preconditions, and only the last digits end a solve.
    let sets = [
        "run.time_step=1e-4",
        "run.end=2e-4",
        "fluid.relaxation=1e-9",
        "fluid.solver={tolerance=1e-13,max_iterations=1000000,preconditioner=\"jacobi\"}",
        "fluid.block.0.max=[0.6,0,0.6]",
    ];
    let case = Case::new(&sets, "cpu");
    let timed = |spacing: &'static str| {
        let clock = Instant::now();
        assert_eq!(case.run(spacing, &["--spacing", spacing]).code, 0);
        (spacing, clock.elapsed())
    };
    let long = LONG.into_iter().map(timed).find(|(_, took)| *took > Duration::from_secs(4));
    let (spacing, two_steps) = long.expect("its steps are long at one of the spacings");
    let fine = ["--spacing", spacing];
    for (signal, code) in [("-INT", 130), ("-USR1", 75)] {
        let root = case.root(signal).display().to_string();
        // The first step begins when the first frame is there.
        let begun = || case.root(signal).join("small.pvd").exists();
        let (ended, err, took) = interrupted(&case.args(&root, &fine), signal, begun);
        assert_eq!(ended, Some(code), "{err}");
        assert!(
            took < two_steps / 2 && took < Duration::from_secs(3),
            "{took:?} for a step of {two_steps:?} / 2"
        );
        let result = json(&std::fs::read_to_string(case.root(signal).join("result.json")).unwrap());
        assert_eq!((result["status"].as_str(), result["steps"].as_u64()), (Some("interrupted"), Some(0)));
    }
    let clock = Instant::now();
    let stopped = case.run("-INT", &[&fine[..], &["--resume", "--max-wall", "0.5s"]].concat());
    assert_eq!(stopped.code, 75, "{}", stopped.err);
    let result = std::fs::read_to_string(case.root("-INT").join("result.json")).unwrap();
    assert!(result.contains("before a step was done: make it longer"), "{result}");
    assert!(clock.elapsed() < Duration::from_secs(4), "{:?}", clock.elapsed());
    let ended = case.run("-INT", &[&fine[..], &["--resume"]].concat());
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert_same(&case.root(spacing), &case.root("-INT"), "a step that was given up");
}

/// The same on the device, where the solver is looked at now and then.
#[cfg(unix)]
#[test]
fn a_long_step_on_the_device_is_given_up_and_nothing_is_lost() {
    if !there_is_a_device("a long step on a device") {
        return;
    }
    let sets = [
        "run.time_step=1e-4",
        "run.end=2e-4",
        "output.every=1e-4",
        "fluid.relaxation=1e-9",
        "fluid.solver={tolerance=1e-6,max_iterations=100000,preconditioner=\"jacobi\"}",
        "fluid.block.0.max=[0.6,0,0.6]",
    ];
    let case = Case::new(&sets, "gpu");
    let fine = ["--spacing", "0.006"];
    let clock = Instant::now();
    assert_eq!(case.run("whole", &fine).code, 0);
    let two_steps = clock.elapsed();
    let root = case.root("parts").display().to_string();
    let begun = || case.root("parts").join("small.pvd").exists();
    let (ended, err, took) = interrupted(&case.args(&root, &fine), "-TERM", begun);
    assert_eq!(ended, Some(143), "{err}");
    assert!(took < Duration::from_secs(4), "{took:?} for steps of {two_steps:?} / 2");
    let ended = case.run("parts", &[&fine[..], &["--resume"]].concat());
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert_same(&case.root("whole"), &case.root("parts"), "a step that was given up on the device");
}

/// While millions of particles are built there is nothing to save: the run ends at once, with its exit code, and leaves
/// nothing.
#[cfg(unix)]
#[test]
fn a_long_build_is_ended_at_once() {
    let case = Case::new(&["run.time_step=1e-6", "run.end=1e-5"], "cpu");
    for (signal, code) in [("-INT", 130), ("-TERM", 143), ("-USR1", 75), ("-XCPU", 75)] {
        let root = case.root("none").display().to_string();
        let args = case.args(&root, &["--spacing", "2e-4", "--memory-limit", "100G"]);
        let clock = Instant::now();
        let (ended, err, took) = interrupted(&args, signal, || clock.elapsed() > Duration::from_millis(300));
        assert_eq!((ended, err.as_str()), (Some(code), ""), "{signal}");
        assert!(took < Duration::from_secs(1), "{took:?}");
        assert!(!case.root("none").exists(), "nothing was computed, nothing is left");
    }
}

#[test]
fn a_run_that_diverges_keeps_its_last_good_state() {
    let case = Case::new(&["fluid.block.0.velocity=[0,0,500]", "run.end=10", "output.every=2e-3"], "cpu");
    let diverged = case.run("a", &[]);
    assert!(diverged.code == 4 && diverged.err.contains("stage cell_list"), "{}", diverged.err);
    let result = json(&std::fs::read_to_string(case.root("a").join("result.json")).unwrap());
    assert!(result["exit_reason"].as_str().unwrap().contains("is in checkpoint/"), "{result}");
    let again = case.run("a", &["--resume"]);
    assert!(again.code == 4 && again.err.contains("would do so again"), "{} {}", again.code, again.err);
    assert!(
        again.err.contains(&format!("run.from = {:?}", case.root("a").display().to_string())),
        "{}",
        again.err
    );
    let from = format!("run.from=\"{}\"", case.root("a").display());
    // It begins there, and its one step is what such water does.
    let other = case.run("b", &["--set", &from, "--steps", "1"]);
    assert!(other.code == 4 && other.err.contains("diverged at step"), "{} {}", other.code, other.err);
    assert!(case.root("b").join("vtu/fluid_0000.vtu").exists());
    // Where none was saved, none is offered.
    std::fs::remove_dir_all(case.root("a").join("checkpoint")).unwrap();
    let again = case.run("a", &["--resume"]);
    assert!(again.err.contains("--force") && !again.err.contains("run.from"), "{}", again.err);
}

#[test]
fn a_table_that_was_edited_is_not_gone_on_with() {
    let case = Case::new(&[], "cpu");
    assert_eq!(case.run("whole", &[]).code, 0);
    // Another digit somewhere in the second line.
    let other = |text: &str| {
        let line = text.find('\n').unwrap() + 1;
        let at = line + text[line..].find(|c: char| c.is_ascii_digit()).unwrap();
        let digit = if &text[at..=at] == "1" { "2" } else { "1" };
        text[..at].to_owned() + digit + &text[at + 1..]
    };
    type Edit<'a> = &'a dyn Fn(&str) -> String;
    let edits: [(&str, &str, Edit<'_>, &str); 7] = [
        ("lines", "bodies.csv", &|text| text.replace('\n', "\r\n"), "it does not begin"),
        ("header", "bodies.csv", &|text| text.replacen("time [s]", "time (s)", 1), "it does not begin"),
        ("longer", "bodies.csv", &|text| text.replacen("\n", "\n ", 1), "a line goes on"),
        ("value", "bodies.csv", &other, "its lines are not those"),
        ("shorter", "bodies.csv", &|text| text[..text.len() - 1].to_owned(), "it is shorter"),
        ("frames", "small.pvd", &|text| text.replace("fluid_0000", "fluid_0001"), "its lines are not those"),
        ("gone", "monitors.csv", &|_| String::new(), "monitors.csv is gone"),
    ];
    for (name, file, edit, words) in edits {
        assert_eq!(case.run(name, &["--steps", "20"]).code, 0);
        let path = case.root(name).join(file);
        let written = std::fs::read_to_string(&path).unwrap();
        match edit(&written) {
            none if none.is_empty() => std::fs::remove_file(&path).unwrap(),
            edited => std::fs::write(&path, edited).unwrap(),
        }
        let told = case.run(name, &["--resume"]);
        assert!(
            told.code == 2 && told.err.contains(file) && told.err.contains(words),
            "{name}: {}",
            told.err
        );
        // What was told is done, and rows behind those that count do no harm.
        std::fs::write(&path, written + "0.7,a").unwrap();
        assert_eq!(case.run(name, &["--resume"]).code, 0, "{name}");
        assert_same(&case.root("whole"), &case.root(name), name);
    }
}

/// What lies on the floor under water is held by it in the first step, too: without, the water would hold its weight.
#[test]
fn a_body_that_touches_goes_on_touching_in_another_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rest.toml");
    let case = "[run]\nspacing = 0.02\ntime_step = 1e-3\nadaptive = true\nend = 0.15\ndimensions = 2\n\
                [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0.1, 0.4]\nopen = [\"z_max\"]\n\
                [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.6, 0.1, 0.2]\n\
                [[body]]\nname = \"box\"\ncenter = [0.3, 0.05, 0.05]\nsize = [0.1, 0.1, 0.1]\ndensity = 3000\n\
                displaces_fluid = true\n[contact]\nspring = 20000\n[output]\nevery = 0\n";
    std::fs::write(&file, case).unwrap();
    let file = file.display().to_string();
    let out = |name: &str| folder.path().join(name).display().to_string();
    let from = format!("run.from=\"{}\"", out("first"));
    for more in [
        vec!["-o", &out("whole")],
        vec!["-o", &out("first"), "--until", "0.1"],
        vec!["-o", &out("second"), "--set", &from],
    ] {
        let done = ran(&[&["run", &file, "--backend", "cpu", "--threads", "1", "-q"], &more[..]].concat());
        assert_eq!(done.code, 0, "{}", done.err);
    }
    let force = |name: &str| -> Vec<(f64, f64)> {
        let text = std::fs::read_to_string(folder.path().join(name).join("bodies.csv")).unwrap();
        let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let place = |column: &str| head.iter().position(|c| *c == column).expect(column);
        let [t, f] = ["time [s]", "fluid_force_z [N]"].map(place);
        let cells = text.lines().skip(1).map(|l| l.split(',').collect::<Vec<_>>());
        cells.filter_map(|c| Some((c[t].parse().ok()?, c[f].parse().ok()?))).collect()
    };
    let (whole, second) = (force("whole"), force("second"));
    assert!(second.len() > 20 && second[0].1 > 0.5, "{second:?}");
    for (t, f) in second {
        let (_, same) = whole.iter().find(|row| row.0 == t).expect("the same steps");
        assert!((f / same - 1.0).abs() < 1e-9, "{f} for {same} N at {t}");
    }
}
