//! Values that run but are hardly meant: each is warned of or refused, and what is told leads on.

use crate::cli::{json, ran, small_case};
use seixo::case::file::parse;
use std::path::Path;

/// A case with one of everything, of which nothing is said.
const SOUND: &str = r#"
[run]
spacing = 0.05
time_step = 1e-3
end = 1.0
[tank]
min = [0, 0, 0]
max = [2, 0.5, 1]
open = ["z_max"]
[fluid]
[[fluid.block]]
min = [0.2, 0, 0]
max = [1, 0.5, 0.5]
[[absorber]]
min = [1.5, 0, 0]
max = [2, 0.5, 1]
towards = "x_max"
[[plane]]
name = "slope"
center = [1.5, 0.25, 0.2]
normal = [-1, 0, 1]
along = [1, 0, 1]
size = [0.5, 0.5]
[[moving_wall]]
name = "paddle"
min = [0, 0, 0]
max = [0.1, 0.5, 0.8]
sine = { axis = [1, 0, 0], amplitude = 0.02, period = 1, ramp = 0.5 }
[[body]]
name = "box"
size = [0.2, 0.2, 0.2]
center = [1.3, 0.25, 0.8]
density = 500
[contact]
law = "smooth"
spring = 1e4
damping_ratio = 0.2
[[gauge.level]]
name = "h"
at = [0.5, 0.25]
"#;

/// Overrides of it, and what is told of each.
const SLIPS: &[(&[&str], &str)] = &[
    (&["run.gravity=[0,0,9.81]"], "run.gravity: the water falls upwards"),
    (&["run.gravity=[9.81,0,0]", "absorber=[]"], "gauge.level.0: levels are read along z"),
    (&["run.gravity=[0,0,-9810]", "body=[]"], "run.gravity: 9.810e3 m/s2 is 1000 times that of the Earth"),
    (&["fluid.density=1", "body=[]"], "fluid.density: 1 kg/m3 is the density of no liquid"),
    (&["fluid.density=1e6", "body=[]"], "is the density of no liquid"),
    (&["fluid.block.0.velocity=[500,0,0]"], "fluid.block.0.velocity: 500.0000 m/s, more than"),
    (
        &["fluid.block.0.velocity_gradient=[[2000,0,0],[0,0,0],[0,0,-2000]]"],
        "fluid.block.0.velocity_gradient: 943",
    ),
    (&["body.0.velocity=[0,0,-1000]"], "body.0.velocity: 1000.0000 m/s"),
    (&["body.0.density=0.5"], "body.0.density: 5.000e-1 kg/m3 is 5.0e-4 of the water's"),
    (
        &["fluid.free_surface_threshold=0.01"],
        "fluid.free_surface_threshold: with 0.01 particles of the surface",
    ),
    (
        &["body.0.hinge={at=[9,0.25,0.8],axis=\"y\"}"],
        "body.0.hinge.at: it turns about a place 7.7000 m away, 44 times its size",
    ),
    (
        &["run.adaptive=true", "inflow=[{name=\"in\",face=\"x_max\",velocity=800}]"],
        "inflow.0.velocity: 800.0000 m/s, more than",
    ),
    (
        &["obstacle=[{name=\"far\",min=[5,0,0],max=[6,0.5,0.2]}]"],
        "obstacle.0: obstacle `far` lies outside of the tank along x",
    ),
    (&["contact.friction=30"], "contact.friction: a coefficient of friction of 30"),
    (&["moving_wall.0.sine.ramp=20"], "moving_wall.0.sine.ramp: 20 s is longer than the run of 1 s"),
    (
        &[
            "body=[{name=\"box\",size=[0.2,0.2,0.2],center=[1.3,0.25,0.8],swing={axis=[0,1,0],amplitude_deg=400,period=100}}]",
        ],
        "body.0.swing.amplitude_deg: 400 degrees is more than a turn",
    ),
    (
        &["run.effective_radius=3.1"],
        "run.effective_radius: with 3.1 the pressure below a free surface is too small",
    ),
    (&["absorber.0.towards=z_max"], "absorber.0.towards: waves come in along x or y"),
    (&["run.gravity=[9.81,0,0]", "gauge.level=[]"], "absorber.0.towards: waves come in along y or z"),
    (
        &["run.gravity=[-9.81,0,0]", "absorber.0.towards=z_max", "gauge.level=[]"],
        "absorber.0.min: it begins 0.5000 m above the water",
    ),
    (&["absorber.0.min=[1.5,0,0.7]"], "absorber.0.min: it begins 0.2000 m above the water"),
    (&["plane.0.center=[9,0.25,0.2]"], "plane `slope` lies outside of the tank along x"),
    (&["gauge.every=5"], "gauge.every: 5 s is longer than the run of 1 s"),
    (&["output.every=5"], "output.every: 5 s is longer"),
    (&["output.series=[{name=\"near\",every=5}]"], "output.series.0.every: 5 s is longer"),
    (
        &["output.kinds=[\"body\"]", "body=[]", "moving_wall=[]", "contact.friction=0.1"],
        "no body or moving wall to write",
    ),
];

fn read(sets: &[&str]) -> Result<Vec<String>, String> {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    parse("slips.toml", SOUND.into(), &sets).map(|read| read.2).map_err(|e| e.to_string())
}

#[test]
fn slips_of_unit_sign_and_place_are_warned_of() {
    assert_eq!(read(&[]), Ok(vec![]));
    let nothing = "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\n".to_owned();
    let told = parse("nothing.toml", nothing, &[]).expect("it reads").2;
    assert!(told.len() == 1 && told[0].contains("no water, no body and no moving wall"), "{told:?}");
    for (sets, words) in SLIPS {
        let told = read(sets).unwrap_or_else(|e| panic!("{sets:?}: {e}"));
        assert!(told.len() == 1 && told[0].contains(words), "{sets:?}: `{words}` is not all of {told:?}");
    }
    for sets in [
        &["body.0.inertia=[0.1,0.1,0.1]"][..],
        &["body.0.density=50"],
        &["output.kinds=[\"fluid\",\"body\",\"wall\"]", "body=[]", "moving_wall=[]"],
        &["run.gravity=[9.81,0,0]", "absorber.0.towards=z_max", "gauge.level=[]"],
        &["fluid.block.0.velocity=[20,0,0]"],
    ] {
        assert_eq!(read(sets), Ok(vec![]), "{sets:?}");
    }
}

#[test]
fn what_cannot_be_is_refused() {
    for (set, words) in [
        (
            "body.0.inertia=[1,1,1]",
            "body.0.inertia: a moment of 1 kg m2 is more than any mass of 4.0000e0 kg",
        ),
        (
            "fluid.block.0.velocity_gradient=[[1e300,0,0],[0,0,0],[0,0,-1e300]]",
            "fluid.block.0.velocity_gradient: more than 1e6 m/s: nothing is so fast",
        ),
        ("output.kinds=[\"fluid\",\"fluid\"]", "output.kinds.1: a kind is named twice"),
        ("run.from=", "run.from: it names nothing"),
        ("run.time_step=1e300", "a step of 1e300 s is longer"),
        ("moving_wall.0.sine={axis=[1,0,0],amplitude=abc,period=1}", "words in it stand in quotes"),
        (
            "moving_wall.0.sine={axis=[1,0,0],amplitude=\"abc\",period=1}",
            "the words `abc`, expected a number",
        ),
        (
            "outflow.0.velocity=1",
            "the case has no `outflow`; a whole list is given as outflow=[{...}, {...}]",
        ),
    ] {
        let said = read(&[set]).expect_err(set);
        assert!(said.contains(words), "{set}: `{words}` is not in {said}");
        assert!(!said.contains("0000000000"), "{said}");
    }
    // A step that the flow may shorten is no longer than the run either.
    let said = read(&["run.adaptive=true", "run.time_step=2.0"]).expect_err("refused");
    assert!(said.contains("run.time_step: a step of 2 s is longer than the whole run of 1 s"), "{said}");
    let long = format!("fluid.preset={}", "a".repeat(5000));
    assert!(read(&[&long]).expect_err("refused").matches('a').count() < 2000);
}

#[test]
fn plan_tells_of_steps_sound_states_and_room() {
    let folder = tempfile::tempdir().unwrap();
    let case = folder.path().join("slips.toml");
    std::fs::write(&case, SOUND).unwrap();
    let case = case.display().to_string();
    let plan = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().flat_map(|s| ["--set".to_owned(), (*s).to_owned()]).collect();
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        ran(&[&["plan", &case], &sets[..]].concat())
    };
    let told = plan(&[]);
    assert!(told.code == 0 && told.err.lines().all(|l| l.starts_with("note: ")), "{}", told.err);
    for (sets, words) in [
        (&["run.adaptive=true", "fluid.viscosity=1e5"][..], " steps of "),
        (&["fluid.sound_speed=1e-3"], "pressed together by its own weight"),
        (&["run.adaptive=true", "fluid.sound_speed=90"], "noise of the pressure adds energy"),
        // No step has two frames.
        (&["output.every=1e-9"], "results: 1002 frames"),
    ] {
        let told = plan(sets);
        assert!(told.code == 0 && told.out.contains(words), "{sets:?}: {}{}", told.out, told.err);
    }
    let told = plan(&["moving_wall.0.sine.amplitude=-5", "moving_wall.0.sine.period=40"]);
    assert!(told.code == 0 && told.err.contains("out of the tank through `tank.x_min`"), "{}", told.err);
    let told = plan(&["run.from=nowhere"]);
    assert!(
        told.code == 2 && told.err.contains("nowhere` is not there") && told.err.contains("name the folder"),
        "{}",
        told.err
    );
    let twice = plan(&["run.end=1", "run.end=2"]);
    assert!(twice.code == 2 && twice.err.contains("--set run.end=1"), "{}", twice.err);
    let lost = plan(&["body.0.density=400", "body=[]"]);
    assert!(
        lost.code == 2 && lost.err.contains("takes the place of what --set body.0.density=400 says"),
        "{}",
        lost.err
    );
    assert_eq!(
        plan(&["body=[{name=\"b\",size=[0.2,0.2,0.2],center=[1.3,0.25,0.8]}]", "body.0.density=400"]).code,
        0
    );

    // Room for water that may come is no more than the domain holds, and counted.
    let inflow = "inflow=[{name=\"up\",face=\"x_max\",min=[2,0,0.6],max=[2,0.5,0.8],velocity=[[0,0.1]]}]";
    let bytes = |more: &[&str]| {
        let sets: Vec<&str> = [&[inflow, "absorber=[]", "plane=[]"], more].concat();
        let told = plan(&sets);
        assert_eq!(told.code, 0, "{}", told.err);
        let line = told.out.lines().find(|l| l.contains("memory on the host")).unwrap().to_owned();
        (line, told.err)
    };
    let (little, _) = bytes(&["fluid.max_volume=0.3"]);
    let (much, note) = bytes(&["fluid.max_volume=1e6"]);
    assert!(little != much && note.contains("more than the domain holds"), "{little} {much} {note}");
    assert!(much.contains(" MB "), "{much}");
}

fn small_run(folder: &Path) -> (String, String) {
    let (case, out) = (small_case(folder), folder.join("out").display().to_string());
    let done = ran(&["run", &case, "-o", &out, "--backend", "cpu", "-q", "--set", "output.every=0.01"]);
    assert_eq!(done.code, 0, "{}", done.err);
    (case, out)
}

#[test]
fn a_report_without_pictures_or_verdict_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let (_, out) = small_run(folder.path());
    let told = |word: &str| {
        let told = ran(&["report", &out, "--pictures", "2", "--size", "160x90"]);
        assert!(told.code == 0 && told.err.contains(word), "`{word}`: {}", told.err);
    };
    std::fs::write(folder.path().join("out/result.json"), "{\"case\"").unwrap();
    told("result.json is damaged: the page tells no verdict");
    let list = folder.path().join("out/small.pvd");
    let whole = std::fs::read_to_string(&list).unwrap();
    std::fs::write(&list, &whole[..whole.len() / 2]).unwrap();
    told("small.pvd is cut off: frames that it does not name are left out");
    std::fs::write(&list, &whole).unwrap();
    std::fs::rename(folder.path().join("out/vtu"), folder.path().join("moved")).unwrap();
    told("no pictures: ");
    told("small.pvd names cannot be read any more");
    std::fs::remove_file(&list).unwrap();
    told("small.pvd, is gone or names none");
}

#[test]
fn what_is_told_of_folders_and_files_leads_on() {
    let folder = tempfile::tempdir().unwrap();
    let (case, out) = small_run(folder.path());
    let over = ran(&["run", &case, "-o", &case]);
    assert!(over.code == 2 && over.err.contains("would be overwritten"), "{}", over.err);
    let (file, inside) = (case.clone(), format!("{case}/results"));
    let other = folder.path().join("other.toml").display().to_string();
    std::fs::copy(&case, &other).unwrap();
    for args in [
        &["run", &other, "-q", "--backend", "cpu", "-o", &inside][..],
        &["render", &out, "-o", &file],
        &["study", "free-fall", "-q", "-o", &file],
    ] {
        let told = ran(args);
        let words = "small.toml: a file stands where a folder should";
        let words = if args[0] == "run" { &words[10..] } else { words };
        assert!(told.code == 5 && told.err.contains(words), "{args:?}: {}", told.err);
    }
    // A frame that is cut off, empty or gone is left out, whoever reads it.
    let frame = folder.path().join("out/vtu/fluid_0002.vtu");
    let whole = std::fs::read(&frame).unwrap();
    for (kept, why) in [(Some(whole.len() / 2), "is cut off"), (Some(0), "is empty"), (None, "is gone")] {
        match kept {
            Some(n) => std::fs::write(&frame, &whole[..n]).unwrap(),
            None => std::fs::remove_file(&frame).unwrap(),
        }
        for args in [
            &["render", &out, "--size", "160x90"][..],
            &["report", &out, "--pictures", "3", "--size", "160x90"],
            &["measure", &out, "--point", "0.2,0,0.2"],
        ] {
            let told = ran(args);
            let words = ["warning: frame 2 is left out", why];
            assert!(told.code == 0 && words.iter().all(|w| told.err.contains(w)), "{args:?}: {}", told.err);
        }
    }
    assert!(!folder.path().join("out/pictures/frame_0002.png").exists());
    assert!(folder.path().join("out/pictures/frame_0003.png").exists());
    let points = folder.path().join("none.csv").display().to_string();
    std::fs::write(&points, "x,y,z\n").unwrap();
    let none = ran(&["measure", &out, "--file", &points]);
    assert!(none.code == 2 && none.err.contains("none.csv: it holds no points"), "{}", none.err);
    std::fs::remove_file(folder.path().join("out/.seixo")).unwrap();
    for args in [&["run", "--resume", &out][..], &["render", &out], &["report", &out]] {
        let told = ran(args);
        assert!(told.code == 2 && told.err.contains("there is no `.seixo` in it"), "{args:?}: {}", told.err);
    }
    let told = ran(&["run", &case, "-o", &out, "--resume"]);
    assert!(told.code == 2 && told.err.contains("no `.seixo`"), "{}", told.err);
}

#[test]
fn faces_that_are_not_there_are_not_offered() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    for (on, words) in [
        ("tank.y_min", "`tank.y_min` has no wall to measure on"),
        ("tank.y_min", "in two dimensions the tank has walls along x and z alone"),
        ("nothing", "allowed: gate, tank.x_min, tank.x_max, tank.z_min\n"),
    ] {
        let set = format!("gauge.force=[{{name=\"f\",on=\"{on}\"}}]");
        let told = ran(&["plan", &case, "--set", &set]);
        assert!(told.code == 2 && told.err.contains(words), "{on}: {}", told.err);
    }
}

#[test]
fn a_disc_needs_no_length_unless_its_mass_does() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let disc =
        |more: &str| format!("body=[{{name=\"d\",shape=\"cylinder\",radius=0.1,center=[1.2,0,0.6]{more}}}]");
    let told = |more: &str| {
        let sets = ["--set", &disc(more), "--set", "contact={spring=1e5}"];
        ran(&[&["plan", &case, "--json"], &sets[..]].concat())
    };
    let mass = |more: &str| json(&told(more).out)["bodies"][0]["mass_kg"].as_f64().unwrap();
    let [with, without] = ["density=500,height=0.4", "density=500"].map(|more| mass(&format!(",{more}")));
    assert!((with - without).abs() < 1e-12 * with, "{with} {without}");
    // An eighth of 0.4 m is the slice.
    assert!((mass(",mass=4,height=0.4") - 0.5).abs() < 1e-12);
    for more in [",mass=4", ",density=500,inertia=[0.1,0.1,0.1]"] {
        let told = told(more);
        assert!(told.code == 2 && told.err.contains("add `height` [m]"), "{more}: {}", told.err);
    }
}

#[test]
fn a_shape_that_was_forgotten_is_all_that_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    for (set, key, shape) in [
        ("obstacle=[{name=\"o\",file=\"o.stl\",position=[1,0,0]}]", "obstacle.0.file", "mesh"),
        ("body=[{name=\"b\",section=[[0,0],[1,0],[1,1]],center=[1,0,0]}]", "body.0.section", "prism"),
        ("body=[{name=\"b\",radius=0.1,center=[1,0,0],density=500}]", "body.0.radius", "cylinder"),
        ("moving_wall=[{name=\"w\",radius=0.1,center=[1,0,0]}]", "moving_wall.0.radius", "cylinder"),
        ("fluid.shape=[{radius=0.1,center=[1,0,0.5]}]", "fluid.shape.0.radius", "cylinder"),
    ] {
        let told = ran(&["plan", &case, "--set", set, "--set", "contact={spring=1e5}"]);
        let about = told.err.lines().filter(|l| l.starts_with("error") && l.contains(key)).count();
        let words = format!("add shape = \"{shape}\"");
        assert!(told.code == 2 && about == 1 && told.err.contains(&words), "{set}: {}", told.err);
        assert!(!told.err.contains("does not belong"), "{set}: {}", told.err);
    }
}

#[test]
fn a_plan_tells_solids_that_move_from_those_that_do_not() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let pier = "obstacle=[{name=\"pier\",shape=\"cylinder\",radius=0.1,center=[1.2,0,0.1]}]";
    let told = ran(&["plan", &case, "--set", pier]);
    let lines = ["  moving solids: gate\n", "  fixed solids of any shape: pier\n"];
    assert!(told.code == 0 && lines.iter().all(|l| told.out.contains(l)), "{}{}", told.out, told.err);
    let disc = |k: usize| {
        format!(
            "{{name=\"b{k}\",shape=\"cylinder\",radius=0.05,density=500,center=[{},0,0.9]}}",
            0.2 + 0.11 * k as f64
        )
    };
    let bodies = format!("body=[{}]", (0..16).map(disc).collect::<Vec<_>>().join(","));
    let told = ran(&["plan", &case, "--set", &bodies, "--set", "contact={spring=1e5}"]);
    assert!(told.code == 0 && told.out.contains("b11 and 5 more\n"), "{}{}", told.out, told.err);
}
