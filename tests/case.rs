//! Case files: every kind of error points at its key and says what to do; the cases that come with seixo build.

mod schema;

use seixo::case::file;
use seixo::scene::Scene;
use std::path::PathBuf;

fn root() -> PathBuf {
    PathBuf::from(crate::common::ROOT)
}

fn strings(sets: &[&str]) -> Vec<String> {
    sets.iter().map(|s| (*s).to_owned()).collect()
}

/// A small sound case: one key a line, so that a test can replace one.
const SOUND: &str = r#"[run]
spacing = 0.1
time_step = 1e-3
end = 1.0

[tank]
min = [0.0, 0.0, 0.0]
max = [1.0, 1.0, 1.0]
open = ["z_max"]

[fluid]
density = 1000.0
sound_speed = 5.0
[[fluid.block]]
min = [0.0, 0.0, 0.0]
max = [0.5, 1.0, 0.5]

[[moving_wall]]
name = "gate"
min = [0.5, 0.0, 0.0]
max = [0.6, 1.0, 1.0]
open = ["y_min", "y_max"]
motion = [[0, 0, 0, 0], [1, 0, 0, 1]]

[[body]]
name = "cube"
size = [0.2, 0.2, 0.2]
center = [0.8, 0.5, 0.1]
density = 500.0
locked = ["y"]

[contact]
law = "smooth"
spring = 1e4
damping = 10.0

[[gauge.force]]
name = "force"
on = "cube"
"#;

/// What to replace, by what, and what the message must hold.
const WRONG: &[(&str, &str, &[&str])] = &[
    // what serde and the TOML reader find
    (
        "end = 1.0",
        "edn = 1.0",
        &["test.toml:4:1", "run.edn: unknown field `edn`", "did you mean `end`?", "time_step"],
    ),
    (
        "end = 1.0",
        "end = \"soon\"",
        &["test.toml:4:7", "run.end: the words `soon`, expected a number", "`seixo keys run.end`"],
    ),
    (
        "end = 1.0\n",
        "",
        &[
            "test.toml:1:1",
            "run: missing field `end`",
            "add `end = ...` here; `seixo keys run.end` tells what it takes",
        ],
    ),
    ("end = 1.0", "end = 1.0\nend = 2.0", &["test.toml:5:1", "duplicate key"]),
    ("[tank]", "[tank", &["test.toml:6:6"]),
    ("\"smooth\"", "\"smoth\"", &["contact.law: unknown variant `smoth`", "did you mean `smooth`?", "paper"]),
    (
        "[\"z_max\"]",
        "[\"top\"]",
        &["tank.open.0: unknown variant `top`", "did you mean `z_max`?", "allowed: x_min"],
    ),
    ("[0.2, 0.2, 0.2]", "[0.2, 0.2]", &["body.0.size: a list of 2, expected a list of 3"]),
    ("end = 1.0", "end = {a = 1}", &["run.end: a table, expected a number"]),
    ("law = \"smooth\"", "law = 3", &["contact.law: expected one of its names in quotes"]),
    ("[contact]", "[contcat]", &["unknown field `contcat`", "did you mean `contact`?"]),
    // words of other programs
    ("spacing = 0.1", "dp = 0.1", &["run.dp: unknown field `dp`", "did you mean `spacing`?"]),
    ("[[body]]", "[[floating]]", &["unknown field `floating`", "did you mean `body`?"]),
    ("spacing = 0.1", "spacing = .1", &["test.toml:2:11", "a digit on both sides of its point"]),
    // numbers
    ("end = 1.0", "end = 1e-300", &["is longer than the whole run of 1e-300 s"]),
    ("spacing = 0.1", "spacing = nan", &["test.toml:2:1", "run.spacing: NaN is not a finite number"]),
    (
        "spacing = 0.1",
        "spacing = -0.1",
        &["test.toml:2:1", "run.spacing: -0.1 is out of range", "more than 0 m"],
    ),
    ("end = 1.0", "end = inf", &["run.end: inf is not a finite number"]),
    ("[0.8, 0.5, 0.1]", "[0.8, nan, 0.1]", &["test.toml:28:16", "body.0.center.1: NaN"]),
    ("time_step = 1e-3", "time_step = 0", &["run.time_step: 0 is out of range"]),
    ("end = 1.0", "end = 1.0\ndimensions = 4", &["run.dimensions: 4", "allowed: 2, 3"]),
    ("end = 1.0", "end = 1.0\neffective_radius = 0.9", &["run.effective_radius: 0.9"]),
    (
        "sound_speed = 5.0",
        "sound_speed = 250.0",
        &["fluid.sound_speed: relaxation gamma = 6.250 is unstable"],
    ),
    ("sound_speed = 5.0", "relaxation = 4.0", &["fluid.relaxation: relaxation gamma = 4.000 is unstable"]),
    ("sound_speed = 5.0", "relaxation = 0.0", &["fluid.relaxation: 0 is out of range"]),
    (
        "sound_speed = 5.0",
        "sound_speed = 5.0\nrelaxation = 0.1",
        &["`relaxation` and `sound_speed` exclude each other"],
    ),
    (
        "sound_speed = 5.0",
        "free_surface_threshold = 1.0",
        &["fluid.free_surface_threshold: 1 is out of range"],
    ),
    ("sound_speed = 5.0", "compressibility = 0.0", &["fluid.compressibility: 0 is out of range", "1e-14"]),
    ("sound_speed = 5.0", "solver.tolerance = 1.0", &["fluid.solver.tolerance: 1 is out of range"]),
    ("sound_speed = 5.0", "solver.max_iterations = 0", &["fluid.solver.max_iterations"]),
    // shapes
    (
        "max = [1.0, 1.0, 1.0]",
        "max = [1.0, 0.0, 1.0]",
        &["test.toml:8:1", "tank is empty along y", "set run.dimensions = 2"],
    ),
    (
        "max = [0.5, 1.0, 0.5]",
        "max = [0.05, 1.0, 0.5]",
        &["fluid.block.0: the block is 0.0500 m", "run.spacing = 0.05 or less"],
    ),
    (
        "max = [0.5, 1.0, 0.5]",
        "max = [0.5, 1.0, 0.5]\nvelocity_gradient = [[1, 0, 0], [0, 0, 0], [0, 0, 0]]",
        &["fluid.block.0.velocity_gradient: a divergence of 1 1/s", "add up to 0"],
    ),
    ("spacing = 0.1", "spacing = 0.11", &["moving wall `gate` is 0.1000 m across along x", "0.1 or less"]),
    (
        "[0.2, 0.2, 0.2]",
        "[0.2, 0.07, 0.2]",
        &["body.0.size: body `cube` is 0.0700 m across along y", "0.07 or less"],
    ),
    ("[1, 0, 0, 1]]", "[0, 0, 0, 1]]", &["moving_wall.0.motion.1.0: time 0 does not come after 0"]),
    (
        "[[0, 0, 0, 0], [1, 0, 0, 1]]",
        "[]",
        &["moving_wall.0.motion: the table of motion has no rows", "is an [[obstacle]]"],
    ),
    ("max = [1.0, 1.0, 1.0]", "max = [1e9, 1e9, 1e9]", &["tank: the tank takes up or lies beyond"]),
    ("[0.2, 0.2, 0.2]", "[2e5, 2e5, 2e5]", &["body.0.size: body `cube` takes up"]),
    ("open = [\"z_max\"]", "open = [\"z_max\", \"z_max\"]", &["tank.open.1: `z_max` is listed twice"]),
    // what would be passed over
    (
        "end = 1.0",
        "end = 1.0\ngravity = [0, 0, 0, -9.81]",
        &[
            "test.toml:5:1",
            "run.gravity: 4 elements, of which only the first 3 would be read",
            "write 3 elements",
        ],
    ),
    (
        "motion = [[0, 0, 0, 0], [1, 0, 0, 1]]",
        "rotation = [[0, 0, 5, 0], [1, 0, 90, 0]]",
        &["moving_wall.0.rotation.0: the table is at (0, 5, 0) degrees at t = 0", "begin with [0, 0, 0, 0]"],
    ),
    (
        "motion = [[0, 0, 0, 0], [1, 0, 0, 1]]",
        "motion = [[0, 0, 0, 0], [1, 0, 0, 1]]\npivot = [0, 0, 0]",
        &["moving_wall.0.pivot: nothing turns about it", "remove `pivot`"],
    ),
    (
        "motion = [[0, 0, 0, 0], [1, 0, 0, 1]]",
        "rotation = [[0, 0, 0, 0], [1e-5, 0, 90, 0]]",
        &["moving_wall.0.rotation.1:", "particles in a time step"],
    ),
    ("[1, 0, 0, 1]]", "[1, 0, 0, 1, 5]]", &["moving_wall.0.motion.1: 5 elements", "first 4"]),
    ("max = [0.5, 1.0, 0.5]", "max = [0.5, 1.0, 0.5, 1]", &["fluid.block.0.max: 4 elements"]),
    // motion
    (
        "[[0, 0, 0, 0], [1, 0, 0, 1]]",
        "[[0, 0, 0, 0.3], [1, 0, 0, 1]]",
        &["moving_wall.0.motion.0: the table is at (0, 0, 0.3) m at t = 0", "begin with [0, 0, 0, 0]"],
    ),
    ("[[0, 0, 0, 0], [1, 0, 0, 1]]", "[[-1, 0, 0, 0], [1, 0, 0, 1]]", &["(0, 0, 0.5) m at t = 0"]),
    ("[[0, 0, 0, 0], [1, 0, 0, 1]]", "[[0.5, 0, 0, 0.1], [1, 0, 0, 1]]", &["(0, 0, 0.1) m at t = 0"]),
    (
        "[1, 0, 0, 1]]",
        "[1, 0, 0, 0], [1.0001, 0, 0, 1]]",
        &["moving_wall.0.motion.2: 1 m in 1.000e-4 s", "100.0 particles in a time step", "run.adaptive"],
    ),
    ("locked = [\"y\"]", "motion = [[0, 1, 0, 0]]", &["body.0.motion.0: the table is at (1, 0, 0) m"]),
    // steps
    (
        "time_step = 1e-3",
        "time_step = 2.0",
        &["run.time_step: a step of 2 s is longer than the whole run of 1 s"],
    ),
    ("sound_speed = 5.0", "solver.max_iterations = 4000000000", &["fluid.solver.max_iterations: 4000000000"]),
    // bodies and contact
    ("density = 500.0\n", "density = 500.0\nmass = 4.0\n", &["body.0.density: `mass` and `density` exclude"]),
    ("density = 500.0\n", "", &["body.0: body `cube` has neither mass nor density"]),
    ("density = 500.0", "density = -500.0", &["body.0.density: -500 is out of range"]),
    ("locked = [\"y\"]", "locked = [\"y\", \"y\"]", &["body.0.locked.1: listed twice"]),
    ("locked = [\"y\"]", "inertia = [1, 1, 3]", &["body.0.inertia: one moment exceeds"]),
    (
        "locked = [\"y\"]",
        "mass_offset = [0, 0, 5]",
        &["body.0.mass_offset: the centre of mass", "not its place"],
    ),
    (
        "locked = [\"y\"]",
        "locked = [\"y\"]\nhinge = { at = [0.8, 0.5, 0.5], axis = \"y\" }",
        &["body.0.locked: a hinge holds body `cube` already", "remove `locked`"],
    ),
    (
        "locked = [\"y\"]",
        "motion = [[0, 0, 0, 0], [1, 0, 0, 1]]\nmass_offset = [0, 0, 0.1]",
        &["body.0.mass_offset: body `cube` follows a given motion"],
    ),
    (
        "locked = [\"y\"]",
        "locked = [\"y\"]\nvelocity = [1, 2, 0]",
        &["body.0.velocity: `locked` holds body `cube`: it cannot have `velocity` along y"],
    ),
    (
        "locked = [\"y\"]",
        "hinge = { at = [0.8, 0.5, 0.5], axis = \"y\" }\nangular_velocity = [0, 1, 2]",
        &["body.0.angular_velocity: its hinge holds body `cube`: it cannot have `angular_velocity` along z"],
    ),
    ("locked = [\"y\"]", "pivot = [0, 0, 0]", &["body.0.pivot: nothing turns about it", "`hinge`"]),
    ("locked = [\"y\"]", "orientation = { axis = [0, 0, 0], angle_deg = 10 }", &["body.0.orientation.axis"]),
    (
        "damping = 10.0",
        "damping = 10.0\nrestitution = 0.5",
        &["`damping` and `restitution` exclude each other", "keep one"],
    ),
    ("damping = 10.0", "torque = false", &["contact.torque", "belongs to law = \"paper\""]),
    (
        "law = \"smooth\"",
        "law = \"pressure\"\nviscous_friction = 1.0",
        &["contact.viscous_friction", "or set one of these laws"],
    ),
    (
        "law = \"smooth\"",
        "law = \"paper\"\nfriction = 0.3",
        &["contact.friction", "belongs to law = \"smooth\""],
    ),
    (
        "[contact]\nlaw = \"smooth\"\nspring = 1e4\ndamping = 10.0\n",
        "",
        &["body `cube` can move, but there is no [contact]"],
    ),
    ("damping = 10.0", "substeps = 0", &["contact.substeps: 0 sub-steps"]),
    ("damping = 10.0", "substeps = 4294967295", &["contact.substeps: 4294967295 sub-steps", "1 to 100000"]),
    ("spring = 1e4", "spring = 0", &["contact.spring: 0 is out of range", "more than 0 N/m"]),
    (
        "sound_speed = 5.0",
        "suction = true\npreset = \"paper\"",
        &["fluid.suction: the paper's source", "accurate"],
    ),
    ("time_step = 1e-3", "gravity = [0, 0, 0]", &["run.time_step: there is none", "without gravity"]),
    ("time_step = 1e-3", "adaptive = false", &["run.adaptive: without a time step", "remove `adaptive`"]),
    ("time_step = 1e-3", "time_step = nan", &["run.time_step: "]),
    (
        "law = \"smooth\"\nspring = 1e4",
        "law = \"paper\"",
        &["contact.spring: the paper's law", "add `spring`"],
    ),
    ("spring = 1e4", "spring = 5e-324", &["contact.spring: ", "1e-9 to 1e18 N/m"]),
    (
        "spring = 1e4",
        "spring = 1.0",
        &[
            "contact.spring: the weight of body `cube`, 3.923e1 N, presses a spring of 1e0 N/m 3.923e1 m deep",
            "2.0e4",
        ],
    ),
    // names and gauges
    ("name = \"cube\"", "name = \"tank\"", &["body.0.name: the name `tank` stands for the tank"]),
    ("name = \"cube\"", "name = \"a*\"", &["body.0.name: the name `a*` stands for the tank, or for several"]),
    ("name = \"cube\"", "name = \"gate\"", &["body.0.name: the name `gate` is taken by moving_wall.0"]),
    ("name = \"cube\"", "name = \"=cmd|x\"", &["body.0.name: the name `=cmd|x` begins like a formula"]),
    (
        "name = \"cube\"",
        "name = \"tank.x_min\"",
        &["body.0.name: the name `tank.x_min` stands for the tank, or for several solids"],
    ),
    ("name = \"force\"", "name = \"\\u001b[2J\"", &["the name `\\u{1b}[2J` holds control characters"]),
    ("name = \"force\"", "name = \"a\\nb\"", &["the name `a\\nb` holds control characters"]),
    (
        "law = \"smooth\"",
        "law = \"smooth\"\ndevice = \"cuda\"",
        &["contact.device: unknown variant `cuda`", "auto", "host", "gpu"],
    ),
    (
        "on = \"cube\"",
        "on = \"cub\"",
        &["gauge.force.0.on: nothing solid is called `cub`", "did you mean `cube`?"],
    ),
    (
        "on = \"cube\"",
        "on = \"tank.z_max\"",
        &["gauge.force.0.on: `tank.z_max` has no wall to measure on", "take it out of tank.open"],
    ),
];

#[test]
fn errors_point_at_the_key_and_say_what_to_do() {
    file::parse("test.toml", SOUND.into(), &[]).unwrap_or_else(|e| panic!("the sound case: {e}"));
    for (from, to, words) in WRONG {
        assert!(SOUND.contains(from), "`{from}` is not in the sound case");
        let message = match file::parse("test.toml", SOUND.replacen(from, to, 1), &[]) {
            Ok(_) => panic!("`{to}` was accepted"),
            Err(error) => {
                assert_eq!(error.exit_code(), 2);
                error.to_string()
            }
        };
        for word in *words {
            assert!(message.contains(word), "`{to}`: `{word}` is not in:\n{message}");
        }
        assert!(message.contains("test.toml:"), "`{to}`: no line in:\n{message}");
    }
}

#[test]
fn all_problems_are_listed_at_once() {
    let text = SOUND
        .replace("end = 1.0", "end = -1.0")
        .replace("spring = 1e4", "spring = 0")
        .replace("on = \"cube\"", "on = \"x\"");
    let message = file::parse("test.toml", text, &[]).unwrap_err().to_string();
    for word in ["run.end", "contact.spring", "gauge.force.0.on", "test.toml:4:1"] {
        assert!(message.contains(word), "{message}");
    }
}

#[test]
fn large_relaxation_warns() {
    let text = SOUND.replace("sound_speed = 5.0", "relaxation = 0.8");
    let (_, _, warnings) = file::parse("test.toml", text, &[]).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0].contains("makes the pressure noisy") && warnings[0].contains("test.toml:"),
        "{}",
        warnings[0]
    );
}

#[test]
fn in_two_dimensions_water_does_not_move_along_y() {
    let text = |gradient: &str| {
        SOUND.replace("end = 1.0", "end = 1.0\ndimensions = 2").replace(
            "max = [0.5, 1.0, 0.5]",
            &format!("max = [0.5, 1.0, 0.5]\nvelocity_gradient = {gradient}"),
        )
    };
    for wrong in ["[[1, 0, 0], [0, -1, 0], [0, 0, 0]]", "[[0, 1, 0], [0, 0, 0], [0, 0, 0]]"] {
        let said = file::parse("test.toml", text(wrong), &[]).unwrap_err().to_string();
        assert!(said.contains("velocity_gradient: in two dimensions there are x and z alone"), "{said}");
    }
    let sound = file::parse("test.toml", text("[[1, 0, 0.5], [0, 0, 0], [0, 0, -1]]"), &[]);
    sound.unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn what_lies_where_no_water_comes_is_warned_of() {
    let gauge = |x: f64| format!("{SOUND}[[gauge.level]]\nname = \"h\"\nat = [{x}, 0.5]\n");
    let absorber = |x: f64| {
        format!(
            "{SOUND}[[absorber]]\nmin = [{x}, 0, 0]\nmax = [{}, 1, 1]\ntowards = \"x_max\"\nrate = 1\n",
            x + 0.3
        )
    };
    for (text, words) in [
        (gauge(1.2), "gauge.level.0.at: the line lies behind the wall `tank.x_max`"),
        (gauge(-0.2), "the line lies behind the wall `tank.x_min`"),
        (absorber(1.5), "absorber.0: the absorber lies behind the wall `tank.x_max`"),
    ] {
        let (_, _, warnings) = file::parse("test.toml", text.clone(), &[]).unwrap_or_else(|e| panic!("{e}"));
        assert!(warnings.len() == 1 && warnings[0].contains(words), "{words}: {warnings:?}");
    }
    // Gravity along a periodic axis makes no waves whose speed would give a rate.
    let driven = absorber(0.5)
        .replace("\nrate = 1\n", "\n")
        .replace("open = [\"z_max\"]", "open = [\"z_max\"]\nperiodic = [\"x\"]");
    let still = driven.replace("[run]\n", "[run]\ngravity = [1, 0, 0]\n");
    let refused = file::parse("test.toml", still, &[]).map(|_| ()).expect_err("no rate");
    assert!(refused.to_string().contains("without gravity across walls"), "{refused}");
    for text in
        [gauge(0.7), absorber(0.8), gauge(1.2).replace("open = [\"z_max\"]", "open = [\"z_max\", \"x_max\"]")]
    {
        let (_, _, warnings) = file::parse("test.toml", text, &[]).unwrap_or_else(|e| panic!("{e}"));
        assert!(warnings.is_empty(), "{warnings:?}");
    }
}

#[test]
fn overrides_edit_the_text() {
    let sets = strings(&[
        "body.0.density=780 ",
        "body.0.center.2=0.3",
        "contact.law=paper",
        "run.adaptive=true",
        "fluid.solver.tolerance=1e-4",
        "output.every=0.5",
    ]);
    let text = SOUND.replace("density = 500.0", "density = 500.0 # pine");
    let (case, text, _) = file::parse("test.toml", text, &sets).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(case.body[0].density, Some(780.0));
    assert_eq!(case.body[0].center, [0.8, 0.5, 0.3]);
    assert!(case.run.adaptive);
    assert_eq!(case.fluid.map(|f| f.solver.tolerance), Some(1e-4));
    assert!((case.output.every - 0.5).abs() < 1e-12);
    assert!(text.contains("density = 780 # pine"), "{text}");
}

#[test]
fn a_spacing_that_is_no_number_is_refused_like_any_other() {
    let path = root().join("cases/hydrostatic.toml");
    let message = file::load(&path, Some(f64::NAN), &[]).unwrap_err().to_string();
    assert!(message.contains("run.spacing: NaN is not a finite number"), "{message}");
    assert!(message.contains("lines are counted with --spacing and --set applied"), "{message}");
    let loaded = file::load(&path, Some(0.05), &[]).unwrap_or_else(|e| panic!("{e}"));
    assert!((loaded.case.run.spacing - 0.05).abs() < 1e-15);
}

#[test]
fn overrides_that_fit_nothing() {
    for (set, words) in [
        ("body.3.density=1", "index 3 is out of range: `body` has 1 entry"),
        ("body.cube.density=1", "`cube` should be an index"),
        ("run.spacing.x=1", "`run.spacing` is a float"),
        ("run.spacing", "expected key=value"),
        ("body.0.center.7=1", "index 7 is out of range"),
        ("run.0=1", "unknown field `0`"),
        ("run.sapcing=1", "did you mean `spacing`?"),
        ("run..end=1", "empty part"),
        ("body=1", "`body` is a list: set one of its keys, e.g. body.0.name=..., or []"),
    ] {
        let message = file::parse("test.toml", SOUND.into(), &strings(&[set])).unwrap_err().to_string();
        assert!(message.contains(words), "`{set}`: {message}");
    }
}

#[test]
fn an_empty_list_leaves_none_of_its_tables() {
    let (case, _, _) =
        file::parse("test.toml", SOUND.into(), &strings(&["gauge.force=[]", "body=[]"])).unwrap();
    assert!(case.body.is_empty() && case.gauge.force.is_empty());
}

#[test]
fn a_missing_file_names_its_neighbour() {
    let message = file::load(&root().join("cases/dam_brake.toml"), None, &[]).unwrap_err().to_string();
    assert!(message.contains("no case file at") && message.contains("did you mean"), "{message}");
    assert!(message.contains("dam_break.toml"), "{message}");
}

/// Coarse spacings for the cases that come along; each divides what it must.
#[test]
fn all_cases_parse_and_build() {
    let coarse = [("dam_break_transport.toml", 0.03), ("dam_break.toml", 0.05), ("falling_cube.toml", 0.05)];
    let mut seen = 0;
    for entry in std::fs::read_dir(root().join("cases")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "toml") || path.ends_with("Cargo.toml") {
            continue;
        }
        seen += 1;
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let spacing = coarse.iter().find(|c| c.0 == name).map(|c| c.1);
        let loaded = file::load(&path, spacing, &[]).unwrap_or_else(|e| panic!("{e}"));
        assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
        assert!(
            loaded.text.starts_with("#:schema ../schema/case.schema.json\n#"),
            "{name} has no head comment"
        );
        let scene = Scene::build(&loaded.case).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(scene.groups.total() > 100, "{name}");
        for (p, v) in scene.position.iter().zip(&scene.velocity) {
            assert!(p.is_finite() && v.is_finite());
            assert!(p.cmpge(scene.domain.0).all() && p.cmple(scene.domain.1).all(), "{name}: {p} outside");
        }
    }
    assert!(seen >= 8, "{seen} cases");
}

/// The alternatives that the cases' comments name.
#[test]
fn alternatives_in_comments_are_right() {
    let mut tried = 0;
    for entry in std::fs::read_dir(root().join("cases")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "toml") || path.ends_with("Cargo.toml") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        for line in text.lines().filter(|l| l.starts_with('#')) {
            // Columns of a table of rows are separate alternatives.
            for part in line.split("   ").flat_map(|p| p.split(" CL")) {
                let words: Vec<&str> = part.split_whitespace().collect();
                let sets: Vec<&str> =
                    words.windows(2).filter(|w| w[0].ends_with("--set")).map(|w| w[1]).collect();
                if sets.is_empty() || (sets.len() == 1 && sets[0].starts_with("contact.viscous")) {
                    continue;
                }
                tried += 1;
                let sets: Vec<&str> = sets.iter().map(|s| s.trim_end_matches([')', ',', ';'])).collect();
                let loaded = file::load(&path, None, &strings(&sets));
                let built = loaded.and_then(|l| Scene::build(&l.case));
                built.map(drop).unwrap_or_else(|e| panic!("{}: {sets:?}: {e}", path.display()));
            }
        }
    }
    assert!(tried > 10, "{tried}");
}

/// The schemas themselves are held against the structs by tests of their packages; `.ci/schema` writes all three anew after a
/// change of the structs or of what is said of them.
#[test]
fn the_program_prints_the_committed_schemas_and_page_of_keys() {
    let made: [(&str, &[&str]); 3] = [
        ("schema/case.schema.json", &["schema"]),
        ("schema/study.schema.json", &["schema", "study"]),
        ("docs/reference.md", &["keys", "--markdown"]),
    ];
    for (file, command) in made {
        let text = crate::cli::ran(command).out;
        let committed = std::fs::read_to_string(root().join(file)).unwrap_or_default();
        assert!(text.len() > 1000 && committed == text, "{file} is out of date: .ci/schema");
    }
}

#[test]
fn a_case_may_leave_out_its_time_step_and_its_spring() {
    let read = |text: String| file::parse("test.toml", text, &[]).unwrap_or_else(|e| panic!("{e}")).0;
    let without = |key: &str, text: &str| text.replace(key, "");
    // 0.15 sqrt(l0 / g) = 15 ms, and the bounds of the water; in a dry scene 0.02 of it, and a third of a spacing at 60 m/s.
    let wet = read(without("time_step = 1e-3\n", SOUND));
    assert!(wet.run.time_step == 1.5e-2 && wet.run.adaptive, "{:?}", wet.run);
    let dry = SOUND.replace("gravity", "").split("[fluid]").next().unwrap().to_owned()
        + "[[body]]\nname = \"cube\"\nsize = [0.2, 0.2, 0.2]\ncenter = [0.8, 0.5, 0.35]\ndensity = 500.0\n[contact]\nfriction = 0.3\n";
    let typed = read(dry.clone());
    let dry = without("time_step = 1e-3\n", &dry);
    let thrown = read(dry.replace("density", "velocity = [60, 0, 0]\ndensity"));
    assert!(thrown.run.time_step == 5.8e-4, "{:?}", thrown.run);
    let dry = read(dry);
    assert!(dry.run.time_step == 2.0e-3 && !dry.run.adaptive, "{:?}", dry.run);
    // The spring stops the heaviest body, 4 kg from 0.45 m, within a tenth of the spacing: m v^2 / (0.1 l0)^2.
    let scene = std::sync::Arc::new(Scene::build(&typed).unwrap());
    let moved = |case: &seixo::case::Case, steps: u32| {
        let mut simulation = crate::common::cpu_simulation(case, scene.clone());
        (0..steps).for_each(|_| drop(simulation.step().unwrap()));
        let told = simulation.solids.advice(1e-3).words.join(" ");
        (simulation.solids.poses()[0].position, told)
    };
    let (derived, told) = moved(&typed, 1500);
    assert!(told.contains("no spring is given: "), "{told}");
    let spring = told.split("no spring is given: ").nth(1).unwrap();
    let number: f64 = spring.split_whitespace().next().unwrap().parse().unwrap();
    let asked = 4.0 * 2.0 * 9.80665 * (0.35 + 0.1 * 3.0_f64.sqrt()) / 1e-4;
    assert!((number / asked - 1.0).abs() < 0.05, "{number} {asked}");
    let mut given = typed.clone();
    given.contact.as_mut().unwrap().spring = Some(number);
    let (same, told) = moved(&given, 1500);
    assert!(told.contains("the case has") && same == derived, "{told}: {same} {derived}");
    assert!((derived.z - 0.1).abs() < 1e-2, "{derived}");
}

#[test]
fn a_fall_ends_on_the_face_that_looks_up_and_on_a_hinge_at_the_lower_balance() {
    let told = |solids: &str| {
        let text = format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -10]\n[contact]\nfriction = 0.3\n{solids}"
        );
        let (case, ..) = file::parse("test.toml", text, &[]).unwrap_or_else(|e| panic!("{e}"));
        let simulation = crate::common::simulation(&case);
        simulation.solids.advice(1e-3).words.join(" ")
    };
    // From a metre above the middle of a slope of 12 m at 30 degrees, a cube's half diagonal and all, to its lower end: 4.1 m and less.
    let slope = told(
        "[[plane]]\nname = \"slope\"\ncenter = [0, 0, 0]\nnormal = [0.5, 0, 0.8660254]\nalong = [0.8660254, 0, -0.5]\nsize = [12, 1]\n\
         [[body]]\nname = \"cube\"\nsize = [0.2, 0.2, 0.2]\ncenter = [0, 0, 1]\ndensity = 500",
    );
    assert!(slope.contains("at 9.1 m/s") || slope.contains("at 9.0 m/s"), "{slope}");
    // 0.25 m below its hinge: sqrt(2 g 2 r).
    let door = told(
        "[tank]\nmin = [0, 0, 0]\nmax = [2, 2, 2]\nopen = [\"z_max\"]\n\
         [[body]]\nname = \"door\"\nsize = [0.1, 0.5, 0.5]\ncenter = [1, 1, 1.7]\ndensity = 500\nhinge = { at = [1, 1, 1.95], axis = \"y\" }",
    );
    assert!(door.contains("at 3.2 m/s"), "{door}");
}
