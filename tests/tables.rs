//! monitors.csv, bodies.csv and what `result.json` and the verdict make of them.

use crate::cli::{json, ran};
use crate::common::case;
use crate::meshes::{cuboid, stl};
use glam::{DQuat, DVec3};
use seixo::scene::Scene;
use std::collections::HashMap;
use std::path::Path;

/// Runs `text` on the CPU with more arguments; the folder of its results, and what it printed as JSON.
fn run(folder: &Path, name: &str, text: &str, more: &[&str]) -> (std::path::PathBuf, serde_json::Value) {
    let (path, out) = (folder.join(format!("{name}.toml")), folder.join(name));
    std::fs::write(&path, text).unwrap();
    let (path, shown) = (path.display().to_string(), out.display().to_string());
    let run = ran(&[&["run", &path, "-o", &shown, "--backend", "cpu", "-q", "--json"], more].concat());
    assert_eq!(run.code, 0, "{name}: {}", run.err);
    (out, json(&run.out))
}

/// The columns of a table, and its rows by their names.
fn read(path: &Path) -> (Vec<String>, Vec<HashMap<String, String>>) {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let rows = lines.map(|row| header.iter().cloned().zip(row).collect()).collect();
    (header, rows)
}

fn vector(row: &HashMap<String, String>, name: &str, unit: &str) -> DVec3 {
    let cell = |axis: &str| row[&format!("{name}_{axis} [{unit}]")].parse().unwrap();
    DVec3::new(cell("x"), cell("y"), cell("z"))
}

const COLUMN: &str = "[run]\nspacing = 0.02\ntime_step = 4e-3\nend = 0.3\ndimensions = 2\n\
     [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.6]\n[fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 0, 0.4]\n\
     [output]\nevery = 0\n";

/// Splashes of a falling column cross a particle a step between rows that are 0.1 s apart.
#[test]
fn rows_now_and_then_change_no_extreme_and_no_verdict() {
    let folder = tempfile::tempdir().unwrap();
    let all = run(folder.path(), "all", COLUMN, &[]).1;
    let few = run(folder.path(), "few", COLUMN, &["--set", "output.table_every=0.1"]).1;
    assert_eq!(all["monitors"]["steps_seen"], all["steps"]);
    assert_eq!(all["monitors"], few["monitors"]);
    assert_eq!(all["verdict"], few["verdict"]);
    assert!(all["verdict"].get("left_out").is_none(), "{all}");
    // The energy of a free body is summed for the rows, and what was not seen is said.
    let ball = "[[body]]\nname = \"ball\"\nshape = \"cylinder\"\nradius = 0.04\ncenter = [0.4, 0, 0.3]\ndensity = 800\n\
                [contact]\nspring = 1e5\n";
    let few = run(folder.path(), "ball", &format!("{COLUMN}table_every = 0.1\n{ball}"), &[]).1;
    assert_eq!(
        (&few["monitors"]["steps_seen"], &few["monitors"]["energy_steps_seen"]),
        (&few["steps"], &3.into())
    );
    let told = few["verdict"]["left_out"][0].as_str().unwrap();
    assert!(told.contains("the energies were seen in 3 of 75 steps"), "{told}");
}

/// What is known at t = 0 stands there, and what only a step can tell is left empty.
#[test]
fn the_first_rows_hold_what_is_known() {
    let folder = tempfile::tempdir().unwrap();
    let driven = "[[moving_wall]]\nname = \"gate\"\nmin = [0.3, 0, 0.2]\nmax = [0.34, 0, 0.4]\nmotion = [[0, 0, 0, 0], [1, 0.2, 0, 0.1]]\n\
                  [[moving_wall]]\nname = \"flap\"\nmin = [0.4, 0, 0.2]\nmax = [0.44, 0, 0.4]\n\
                  swing = { axis = [0, 1, 0], amplitude_deg = 10, period = 1 }\npivot = [0.42, 0, 0.2]\n";
    let (out, _) = run(folder.path(), "driven", &format!("{COLUMN}{driven}"), &["--steps", "2"]);
    let first = &read(&out.join("monitors.csv")).1[0];
    for column in [
        "dt [s]",
        "courant [-]",
        "density_error_max [-]",
        "iterations [-]",
        "residual [-]",
        "contact_substeps [-]",
        "neighbours_max [-]",
    ] {
        assert_eq!(first[column], "", "{column}");
    }
    assert_eq!((first["speed_max [m/s]"].as_str(), first["fluid_lost [-]"].as_str()), ("0", "0"));
    let rows = read(&out.join("bodies.csv")).1;
    let of = |name: &str, k: usize| rows.iter().filter(|row| row["body"] == name).nth(k).unwrap().clone();
    let (gate, flap) = (of("gate", 0), of("flap", 0));
    assert_eq!(vector(&gate, "velocity", "m/s"), DVec3::new(0.2, 0.0, 0.1));
    for name in ["fluid_force_x [N]", "contact_force_z [N]", "contact_torque_y [N m]"] {
        assert_eq!(gate[name], "", "{name}");
        assert!(name.starts_with("fluid") || !of("gate", 1)[name].is_empty(), "{name}");
    }
    let spin = 10_f64.to_radians() * std::f64::consts::TAU;
    assert!((vector(&flap, "angular_velocity", "rad/s").y / spin - 1.0).abs() < 1e-9, "{flap:?}");
    assert!((vector(&flap, "velocity", "m/s").x / (0.1 * spin) - 1.0).abs() < 1e-9, "{flap:?}");
}

/// Whatever frame a solid has inside, what is written is its turn from the shape that the case describes.
#[test]
fn what_is_not_turned_has_the_turn_of_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let brick = folder.path().join("brick.stl");
    std::fs::write(&brick, stl(&cuboid(DVec3::new(0.3, 0.4, 0.2)))).unwrap();
    let turned = "orientation = { axis = [0, 1, 0], angle_deg = 30 }";
    let prism = "shape = \"prism\"\nsection = [[0, 0], [0.3, 0], [0.3, 0.2]]\nheight = 0.2";
    let shapes = [
        "shape = \"wedge\"\nsize = [0.3, 0.2, 0.2]".to_owned(),
        prism.to_owned(),
        "shape = \"cylinder\"\nradius = 0.1\nheight = 0.3\naxis = [1, 0, 0]".to_owned(),
        "shape = \"cone\"\nradius = 0.1\nheight = 0.3\naxis = [0, 0, -1]".to_owned(),
        format!("shape = \"mesh\"\nfile = {:?}", brick.display().to_string()),
    ];
    let solids = |orientation: &str, dimensions: u32| {
        let all = shapes.iter().enumerate().filter(|(k, _)| dimensions == 3 || *k < 2);
        let of = |(k, shape): (usize, &String)| {
            format!(
                "[[body]]\nname = \"b{k}\"\n{shape}\ncenter = [{k}, 0, 0]\ndensity = 500\n{orientation}\n"
            )
        };
        let obstacle = format!("[[obstacle]]\nname = \"o\"\n{prism}\nposition = [0, 0, 2]\n{orientation}\n");
        format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 0.002\ngravity = [0, 0, 0]\ndimensions = {dimensions}\n\
             domain = [[-1, -1, -1], [6, 1, 3]]\n[output]\nevery = 0\n[contact]\nspring = 1e4\n{}{obstacle}",
            all.map(of).collect::<String>()
        )
    };
    for dimensions in [2, 3] {
        for (orientation, turn) in
            [("", DQuat::IDENTITY), (turned, DQuat::from_rotation_y(30_f64.to_radians()))]
        {
            let scene = Scene::build(&case(&solids(orientation, dimensions))).unwrap();
            for solid in &scene.solids {
                let told = solid.turn(solid.orientation);
                assert!(
                    told.w > 0.0 && told.angle_between(turn) < 1e-7,
                    "{dimensions}D, {}: {told}",
                    solid.name
                );
            }
        }
    }
    let (out, result) = run(folder.path(), "turned", &solids(turned, 3), &[]);
    let q = [15_f64.to_radians().cos(), 0.0, 15_f64.to_radians().sin(), 0.0];
    let near = |told: [f64; 4], name: &str| {
        assert!(told.iter().zip(q).all(|(a, b)| (a - b).abs() < 1e-12), "{name}: {told:?}");
    };
    for row in read(&out.join("bodies.csv")).1 {
        near(["w", "x", "y", "z"].map(|c| row[&format!("q{c} [-]")].parse().unwrap()), &row["body"]);
    }
    for body in result["bodies"].as_array().unwrap() {
        let told = [0, 1, 2, 3].map(|k| body["orientation_wxyz"][k].as_f64().unwrap());
        near(told, &body["name"].to_string());
    }
}

/// The columns that docs/howto-gauges.md describes are those that are written.
#[test]
fn the_guide_describes_every_column() {
    let page = include_str!("../docs/howto-gauges.md");
    let folder = tempfile::tempdir().unwrap();
    // The ledger does not follow water that comes in.
    let openings = "[[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0, 0.2]\nvelocity = 0.1\n\
                    [[outflow]]\nname = \"out\"\nface = \"x_max\"\nmin = [0.6, 0, 0]\nmax = [0.6, 0, 0.2]\n";
    let ball = "[[body]]\nname = \"ball\"\nshape = \"cylinder\"\nradius = 0.04\ncenter = [0.4, 0, 0.3]\ndensity = 800\n\
                [contact]\nspring = 1e5\n";
    let of = |name: &str, more: &str| {
        run(folder.path(), name, &format!("{COLUMN}{more}{ball}"), &["--steps", "1"]).0
    };
    let outs = [of("ledger", "ledger = true\n"), of("openings", openings)];
    for name in ["monitors.csv", "bodies.csv"] {
        let table = page.split(&format!("| column of `{name}` |")).nth(1).expect(name);
        let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
        let first = rows.map(|row| row.split('|').nth(1).unwrap());
        let told: Vec<&str> = first.flat_map(|cell| cell.split('`').skip(1).step_by(2)).collect();
        let mut header: Vec<String> = outs.iter().flat_map(|out| read(&out.join(name)).0).collect();
        header.sort();
        header.dedup();
        let is = |told: &str, column: &str| match told.split_once('*') {
            Some((before, after)) => column.starts_with(before) && column.ends_with(after),
            None => told == column,
        };
        for column in &header {
            let by = told.iter().filter(|told| is(told, column)).count();
            assert_eq!(by, 1, "`{column}` of {name} is described {by} times");
        }
        for told in told {
            assert!(header.iter().any(|column| is(told, column)), "{name} has no `{told}`");
        }
    }
}
