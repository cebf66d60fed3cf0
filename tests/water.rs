//! Water at t = 0 by shapes and by seeds.

use crate::cli::ran;
use crate::meshes::{ball, file, stl};
use glam::DVec3;
use seixo::case::Case;
use seixo::scene::{Kind, Scene};

const L0: f64 = 0.02;

/// A tank of 0.8 x 0.4 x 0.4 m with `water` and `solids`.
fn tank(water: &str, solids: &str) -> String {
    format!(
        "[run]\nspacing = {L0}\ntime_step = 1e-3\nend = 0.02\n[tank]\nmin = [0, 0, 0]\nmax = [0.8, 0.4, 0.4]\n\
         open = [\"z_max\"]\n{solids}\n[fluid]\n{water}\n"
    )
}

fn scene(text: &str) -> Scene {
    Scene::build(&text.parse::<Case>().expect("a valid case")).expect("a valid scene")
}

fn volume(scene: &Scene) -> f64 {
    scene.groups.fluid as f64 * L0.powi(3)
}

#[test]
fn water_has_the_volume_of_its_shape() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = file(&folder, "ball.stl", &stl(&ball(150.0, 4)));
    let pi = std::f64::consts::PI;
    let middle = "center = [0.3, 0.2, 0.2]";
    for (keys, expected) in [
        (format!("shape = \"cylinder\"\nradius = 0.15\nheight = 0.32\n{middle}"), pi * 0.0225 * 0.32),
        (format!("shape = \"sphere\"\nradius = 0.15\n{middle}"), 4.0 / 3.0 * pi * 0.003375),
        (
            format!("shape = \"mesh\"\nfile = \"{mesh}\"\nscale = 1e-3\nposition = [0.3, 0.2, 0.2]"),
            4.0 / 3.0 * pi * 0.003375,
        ),
        (
            format!("size = [0.2, 0.3, 0.1]\n{middle}\norientation = {{ axis = [0, 1, 0], angle_deg = 30 }}"),
            0.2 * 0.3 * 0.1,
        ),
    ] {
        // A drop: nothing would hold it against gravity.
        let text = tank(&format!("[[fluid.shape]]\n{keys}\nvelocity = [0, 0, -1]"), "");
        let scene = scene(&text);
        assert!((volume(&scene) / expected - 1.0).abs() < 0.03, "{keys}: {} {expected}", volume(&scene));
        let fluid = 0..scene.groups.fluid;
        let centroid = fluid.clone().map(|i| scene.position[i]).sum::<DVec3>() / fluid.len() as f64;
        assert!(centroid.distance(DVec3::new(0.3, 0.2, 0.2)) < 0.005, "{keys}: {centroid}");
        assert!(fluid.clone().all(|i| scene.velocity[i] == -DVec3::Z && scene.kind[i] == Kind::Fluid));
    }
    // Two that overlap share what both hold.
    let ball = format!("[[fluid.shape]]\nshape = \"sphere\"\nradius = 0.15\n{middle}\n");
    assert_eq!(scene(&tank(&ball, "")).groups.fluid, {
        let block = "[[fluid.block]]\nmin = [0.28, 0.18, 0.18]\nmax = [0.32, 0.22, 0.22]\n";
        scene(&tank(&format!("{block}{ball}"), "")).groups.fluid
    });
}

const WEIR: &str = "[[obstacle]]\nname = \"weir\"\nmin = [0.4, 0, 0]\nmax = [0.44, 0.4, 0.2]\n";

#[test]
fn a_seed_fills_its_basin_up_to_the_level_and_no_other() {
    let fill = |level: f64| format!("[[fluid.fill]]\nseed = [0.1, 0.2, 0.05]\nlevel = {level}\n");
    let low = scene(&tank(&fill(0.14), WEIR));
    assert!((volume(&low) / (0.4 * 0.4 * 0.14) - 1.0).abs() < 1e-9, "{}", volume(&low));
    assert!((0..low.groups.fluid).all(|i| low.position[i].x < 0.4 && low.position[i].z < 0.14));
    assert!((low.depth - 0.14).abs() < 1e-9);
    // Over the weir both basins fill.
    let high = scene(&tank(&fill(0.3), WEIR));
    assert!((volume(&high) / (0.8 * 0.4 * 0.3 - 0.04 * 0.4 * 0.2) - 1.0).abs() < 1e-9, "{}", volume(&high));
    // A vessel without a tank: the inside of a box of five plates.
    let plate = |name: &str, min: &str, max: &str| {
        format!("[[obstacle]]\nname = \"{name}\"\nmin = {min}\nmax = {max}\n")
    };
    let vessel = [
        plate("floor", "[0, 0, 0]", "[0.4, 0.4, 0.06]"),
        plate("west", "[0, 0, 0.06]", "[0.06, 0.4, 0.3]"),
        plate("east", "[0.34, 0, 0.06]", "[0.4, 0.4, 0.3]"),
        plate("south", "[0.06, 0, 0.06]", "[0.34, 0.06, 0.3]"),
        plate("north", "[0.06, 0.34, 0.06]", "[0.34, 0.4, 0.3]"),
    ];
    let text = format!(
        "[run]\nspacing = {L0}\ntime_step = 1e-3\nend = 0.02\n{}[fluid]\n[[fluid.fill]]\nseed = [0.2, 0.2, 0.1]\nlevel = 0.2\n",
        vessel.concat()
    );
    let held = scene(&text);
    assert!((volume(&held) / (0.28 * 0.28 * 0.14) - 1.0).abs() < 1e-9, "{}", volume(&held));
}

#[test]
fn a_fill_that_leaks_says_where_and_a_run_of_one_that_does_not_goes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pool.toml");
    let shown = path.display().to_string();
    let told = |text: &str| {
        std::fs::write(&path, text).unwrap();
        let plan = ran(&["plan", &shown]);
        assert_eq!(plan.code, 2, "{}", plan.out);
        plan.err
    };
    let fill = |seed: &str, level: f64| format!("[[fluid.fill]]\nseed = {seed}\nlevel = {level}\n");
    let open = tank(&fill("[0.1, 0.2, 0.05]", 0.1), "").replace("[\"z_max\"]", "[\"z_max\", \"x_max\"]");
    for (text, words) in [
        (open, "leaks out at (0.81"),
        (tank(&fill("[0.1, 0.2, 0.05]", 0.5), ""), "fluid.fill.0: water filled from"),
        (tank(&fill("[0.42, 0.2, 0.05]", 0.3), WEIR), "lies in a wall"),
        (tank(&fill("[3, 0.2, 0.05]", 0.3), ""), "outside of tank and obstacles"),
        (tank(&fill("[0.1, 0.2, 0.25]", 0.2), ""), "lies above the level"),
        (tank(&fill("[0.1, 0.2, 0.05]", 0.3).repeat(2), ""), "there is water at the seed"),
        (tank("[[fluid.shape]]\nshape = \"sphere\"\ncenter = [0.3, 0.2, 0.2]\n", ""), "radius"),
        (tank("[[fluid.shape]]\nshape = \"sphere\"\nradius = 0.1\n", ""), "without `center`"),
        (tank("[[fluid.shape]]\nshape = \"mesh\"\nfile = \"none.stl\"\n", ""), "none.stl"),
        (tank("[[fluid.shape]]\nshape = \"terrain\"\nfile = \"none.stl\"\n", ""), "has no end"),
        (tank("", ""), "no water at t = 0"),
    ] {
        let err = told(&text);
        assert!(err.contains(words) && err.contains("pool.toml:"), "{words}: {err}");
    }
    std::fs::write(&path, tank(&fill("[0.1, 0.2, 0.05]", 0.14), WEIR)).unwrap();
    let out = folder.path().join("out").display().to_string();
    let ran = ran(&["run", &shown, "-o", &out, "--backend", "cpu", "-q", "--set", "output.every=0"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
}
