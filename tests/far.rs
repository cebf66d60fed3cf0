//! One length that is far too large, and scenes that are too large as a whole: known from the numbers of the case,
//! before anything is built.

use crate::cli::ran;
use crate::common::ROOT;
use seixo::case::file::{load, parse};
use seixo::cells::Grid;
use seixo::estimate::Estimate;
use seixo::far::refuse;
use seixo::params::Params;
use seixo::scene::Scene;
use std::path::Path;

/// A tank with one of everything, of which nothing is said.
const SCENE: &str = r#"
[run]
spacing = 0.02
time_step = 1e-3
end = 0.5
dimensions = 2
[tank]
min = [0, 0, 0]
max = [1, 0.1, 0.4]
open = ["z_max"]
[fluid]
[[fluid.block]]
min = [0, 0, 0]
max = [0.4, 0.1, 0.2]
[[obstacle]]
name = "step"
min = [0.5, 0, 0]
max = [0.54, 0.1, 0.04]
[[moving_wall]]
name = "gate"
min = [0.8, 0, 0]
max = [0.9, 0.1, 0.3]
motion = [[0, 0, 0, 0], [1, 0, 0, 0.1]]
[[body]]
name = "box"
center = [0.7, 0.05, 0.1]
size = [0.1, 0.1, 0.1]
density = 500
[contact]
spring = 1e4
"#;

/// What is told of the scene with overrides, from its numbers alone.
fn told(sets: &[&str]) -> Result<Vec<String>, String> {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    let case = parse("far.toml", SCENE.into(), &sets).unwrap_or_else(|e| panic!("{sets:?}: {e}")).0;
    refuse(&case).map_err(|e| e.to_string())
}

#[test]
fn what_is_far_is_refused_by_its_numbers_with_its_key() {
    assert_eq!(told(&[]), Ok(vec![]));
    for (set, key) in [
        ("body.0.center=[0.7,0.05,50000]", "body.0.center: it reaches to z = 50000.1 m"),
        ("body.0.center=[-50000,0.05,0.1]", "body.0.center: it reaches to x = -50000.1 m"),
        ("tank.max=[1,0.1,1e5]", "tank.max: it reaches to z = 100000.0 m"),
        ("tank.max=[1e5,0.1,0.4]", "tank.max: it reaches to x = 100000.0 m"),
        ("tank.min=[-1e5,0,0]", "tank.min: it reaches to x = -100000.0 m"),
        ("obstacle.0.max=[0.54,0.1,1e5]", "obstacle.0.max: it reaches to z"),
        ("obstacle=[{name=\"o\",min=[1e5,0,0],max=[100000.1,0.1,0.1]}]", "obstacle.0.max: it reaches to x"),
        ("fluid.block.0.max=[0.4,0.1,1e5]", "fluid.block.0.max: it reaches to z"),
        (
            "moving_wall.0.motion=[[0,0,0,0],[1e7,0,0,-1e5]]",
            "moving_wall.0.motion: it reaches to z = -100000.0 m",
        ),
        ("run.domain=[[-1,-1,-1],[2,1,1e5]]", "run.domain: it reaches to z = 100000.0 m"),
        (
            "plane=[{name=\"p\",center=[1e5,0,0.2],normal=[0,0,1],along=[1,0,0],size=[0.2,0.1]}]",
            "plane.0.center: it reaches to x",
        ),
        (
            "plane=[{name=\"p\",center=[0.5,0,0.2],normal=[0,0,1],along=[1,0,0],size=[1e6,0.1]}]",
            "plane.0.size: it reaches to x",
        ),
        (
            "body=[{name=\"b\",center=[0.7,0.05,0.1],size=[0.1,0.1,0.1],density=500,pivot=[0,0,1e5],\
             rotation=[[0,0,0,0],[1e7,0,1,0]]}]",
            "body.0.pivot: it reaches to",
        ),
    ] {
        let told = told(&[set]).expect_err(set);
        assert!(told.contains(key) && told.contains("lengths are metres"), "{set}: `{key}` is not in {told}");
    }
    // All of several that are equally far out.
    let more =
        |x: f64, z: f64| format!("{{name=\"b{z}\",center=[{x},0.05,{z}],size=[0.1,0.1,0.1],density=500}}");
    for bodies in [
        [more(0.2, 50000.0), more(0.7, 50000.5), more(0.5, 0.2)],
        [more(0.2, 40000.0), more(0.7, 60000.0), more(0.5, 0.2)],
        [more(0.2, 50000.0), more(0.7, -50000.0), more(0.5, 0.2)],
    ] {
        let set = format!("body=[{}]", bodies.join(","));
        let told = told(&[&set]).expect_err(&set);
        let keys = ["body.0.center: it reaches to z", "body.1.center: it reaches to z"];
        assert!(keys.iter().all(|key| told.contains(key)) && !told.contains("body.2"), "{set}: {told}");
    }
    // The same from a program, at once and with a line of the file.
    let told = ran_on(SCENE, &["--set", "body.0.center=[0.7,0.05,50000]"]);
    assert!(told.code == 2 && told.err.contains("| center = [0.7,0.05,50000]"), "{}", told.err);
}

#[test]
fn what_is_long_for_a_reason_is_no_slip() {
    for sets in [
        // A dry channel behind a dam, a body that falls far, a gate on a long arm: rooms of a few megabytes.
        &["tank.max=[3000,0.1,0.4]"][..],
        &["body.0.center=[0.7,0.05,100]"],
        &[
            "moving_wall.0.motion=[]",
            "moving_wall.0.pivot=[0.8,0,50]",
            "moving_wall.0.rotation=[[0,0,0,0],[1,0,0.05,0]]",
        ],
        // Plates much longer than the rest.
        &["plane=[{name=\"p\",center=[0.5,0,-0.2],normal=[0,0,1],along=[1,0,0],size=[300,0.1]},\
             {name=\"q\",center=[0.5,0,-0.5],normal=[0,0,1],along=[1,0,0],size=[300,0.1]}]"],
        // A flood of the whole length.
        &["tank.max=[10000,0.1,0.4]", "fluid.block=[]", "fluid.fill=[{seed=[0.2,0,0.1],level=0.2}]"],
    ] {
        assert_eq!(told(sets), Ok(vec![]), "{sets:?}");
    }
    // Beyond a hundred times all else it is told what the room costs, where that is no trifle.
    let told = told(&["body.0.center=[0.7,0.05,300]", "run.spacing=2e-3", "run.time_step=1e-4"]).unwrap();
    assert!(told.len() == 1 && told[0].contains("body.0.center: it reaches to z = 300"), "{told:?}");
}

/// Cells of the search over those that the estimate tells of, of a case.
fn told_too_many(case: &seixo::Case) -> f64 {
    let scene = Scene::build(case).unwrap_or_else(|e| panic!("{e}"));
    let params = Params::new(case, &scene).expect("a case");
    Estimate::new(case).cells / Grid::new(&params).expect("few").total() as f64
}

#[test]
fn the_room_that_is_estimated_is_that_of_the_scene() {
    for name in
        ["channel", "dam_break", "dam_break_2d", "dam_break_transport", "floating_cube", "hydrostatic"]
    {
        let path = format!("{ROOT}/cases/{name}.toml");
        let ratio =
            told_too_many(&load(Path::new(&path), Some(0.03), &[]).unwrap_or_else(|e| panic!("{e}")).case);
        assert!((0.9..1.4).contains(&ratio), "{name}: {ratio}");
    }
    for sets in [
        &[][..],
        &["tank.max=[300,0.1,0.4]"],
        &["body.0.center=[0.7,0.05,40]"],
        &["fluid.block.0.max=[0.2,0.1,0.4]", "run.gravity=[1,0,-9.8]"],
        &[
            "moving_wall.0.motion=[]",
            "moving_wall.0.pivot=[0.8,0,20]",
            "moving_wall.0.rotation=[[0,0,0,0],[1,0,0.2,0]]",
        ],
        &["plane=[{name=\"p\",center=[0.5,0.05,0.3],normal=[-1,0,2],along=[2,0,1],size=[20,0.1]}]"],
    ] {
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
        let case = parse("far.toml", SCENE.into(), &sets).unwrap_or_else(|e| panic!("{sets:?}: {e}")).0;
        let ratio = told_too_many(&case);
        assert!((0.9..1.4).contains(&ratio), "{sets:?}: {ratio}");
    }
}

fn ran_on(text: &str, more: &[&str]) -> crate::cli::Ran {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("far.toml");
    std::fs::write(&path, text).unwrap();
    ran(&[&["plan", &path.display().to_string()], more].concat())
}

/// Refined to a hundred million particles such a room has thousands of parts: no shader is written that binds them all.
#[test]
fn a_room_of_cells_is_foreseen_without_its_shaders() {
    let told = ran_on(SCENE, &["--set", "body.0.center=[0.7,0.05,3000]"]);
    assert_eq!(told.code, 0, "{}", told.err);
    assert!(told.out.contains("a kernel would bind more buffers than a device has"), "{}", told.out);
}

/// A scene that no machine holds and no coarser one stands for: told so, with a spacing that would do, and not that a
/// body is thinner than some other spacing.
#[test]
fn what_is_too_large_to_look_at_is_told_with_its_price() {
    let told =
        ran_on(SCENE, &["--set", "tank.max=[2000,0.1,2000]", "--set", "fluid.block.0.max=[2000,0.1,1500]"]);
    assert_eq!(told.code, 2, "{}", told.err);
    for words in ["error: run.spacing: ", " TB of memory", "far.toml:3:", "use run.spacing = ", "or more"] {
        assert!(told.err.contains(words), "`{words}` is not in {}", told.err);
    }
}
