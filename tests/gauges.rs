//! Gauges against statics and against the momentum that walls take from the water.

use crate::common;
use common::*;
use glam::DVec3;
use seixo::backend::Processor;
use seixo::case::Case;
use seixo::gauges::Gauges;
use seixo::gauges::wall_force::FixedWall;
use seixo::kernels::body_force::RowPressure;
use seixo::output::table::Cell;
use seixo::params::Params;
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use seixo::slots::{Opposite, Push};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The last row by column.
fn row(gauges: &Gauges, sim: &mut Simulation) -> BTreeMap<String, f64> {
    let cells = gauges.row(sim).expect("the gauges can be read");
    let numbers = cells.into_iter().map(|c| if let Cell::Number(x) = c { x } else { f64::NAN });
    gauges.header().into_iter().zip(numbers).collect()
}

/// Still water 0.24 x 0.24 x 0.2 m; `more` adds to it.
fn still(more: &str) -> Case {
    case(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -9.81]\n\
         [fluid]\nsound_speed = 4\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.24, 0.24, 0.2]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.24, 0.24, 0.4]\nopen = [\"z_max\"]\n\
         [[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n\
         [[gauge.force]]\nname = \"side\"\non = \"tank.x_min\"\n\
         [[gauge.pressure]]\nname = \"half\"\npoint = [0, 0.12, 0.1]\n\
         [[gauge.pressure]]\nname = \"foot\"\npoint = [0.04, 0.04, 0]\n\
         [[gauge.pressure]]\nname = \"dry\"\npoint = [0, 0.12, 0.35]\n{more}"
    ))
}

/// Means of the gauges and of twice the height of the centroid, from `from` to `to` [s].
fn means(case: &Case, processor: &Processor, from: f64, to: f64) -> BTreeMap<String, f64> {
    let scene = Arc::new(Scene::build(case).expect("the scene builds"));
    let gauges = Gauges::new(case, &scene).expect("the gauges find their walls");
    let mut sim = Simulation::on(case, scene, processor).expect("the simulation starts");
    let (mut sum, mut rows) = (BTreeMap::<String, f64>::new(), 0.0);
    while sim.time < to {
        sim.step().expect("still water stands");
        if sim.time >= from {
            rows += 1.0;
            let depth = 2.0 * sim.backend.monitor().expect("the monitor").centroid[2];
            let now = row(&gauges, &mut sim).into_iter().chain([("depth".to_string(), depth)]);
            now.for_each(|(k, v)| *sum.entry(k).or_default() += v);
        }
    }
    sum.into_iter().map(|(k, v)| (k, v / rows)).collect()
}

#[test]
fn walls_of_still_water_carry_what_statics_say() {
    // Once the lattice of the start has melted; one gauge swings by some percent, its mean over 0.8 s does not.
    let mean = means(&still(""), &Processor::Cpu, 0.7, 1.5);
    let (weight, depth) = (1000.0 * 9.81, mean["depth"]);
    let side = 0.5 * weight * depth * depth * 0.24;
    let mut wrong = Vec::new();
    for (name, expected, within) in [
        ("floor_force_z [N]", -weight * depth * 0.24 * 0.24, 0.02 * weight * depth * 0.24 * 0.24),
        ("side_force_x [N]", -side, 0.03 * side),
        ("side_force_z [N]", 0.0, 0.02 * side),
        // Without the half spacing between P = 0 and the water's surface this would be 10 % lower.
        ("half [Pa]", weight * (depth - 0.1), 0.04 * weight * 0.1),
        ("foot [Pa]", weight * depth, 0.03 * weight * depth),
        ("dry [Pa]", 0.0, 1e-9),
    ] {
        let found = mean[name];
        println!("{name}: {found:.3} for {expected:.3}");
        if (found - expected).abs() > within {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?} in {mean:?}");
}

/// A box that floats, a plate that is pushed 50 mm into the water and a caisson between two levels, each with pressures on it.
fn on_solids() -> Case {
    case(
        "[run]\nspacing = 0.02\ntime_step = 5e-4\nend = 3\ndimensions = 2\ngravity = [0, 0, -9.81]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1.6, 0.1, 0.9]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0.1, 0.5]\n\
         [[fluid.block]]\nmin = [1.2, 0, 0]\nmax = [1.6, 0.1, 0.3]\n\
         [[body]]\nname = \"box\"\nsize = [0.3, 0.1, 0.2]\ncenter = [0.4, 0.05, 0.5]\ndensity = 500\ndisplaces_fluid = true\n\
         [[body]]\nname = \"caisson\"\nsize = [0.2, 0.1, 0.8]\ncenter = [1.1, 0.05, 0.4]\ndensity = 3500\nstanding = true\n\
         [[moving_wall]]\nname = \"plate\"\nmin = [0, 0, 0]\nmax = [0.04, 0.1, 0.8]\n\
         motion = [[0, 0, 0, 0], [1, 0.05, 0, 0]]\n\
         [contact]\nfriction = 1\n\
         [[gauge.pressure]]\nname = \"bottom\"\npoint = [0.4, 0.05, 0.4]\n\
         [[gauge.pressure]]\nname = \"plate\"\npoint = [0.04, 0.05, 0.2]\n\
         [[gauge.pressure]]\nname = \"lee\"\npoint = [1.2, 0.05, 0.1]\n\
         [[gauge.pressure]]\nname = \"heel\"\npoint = [1.03, 0.05, 0]\n\
         [[gauge.pressure]]\nname = \"under\"\npoint = [1.1, 0.05, 0]\n\
         [[gauge.pressure]]\nname = \"base\"\npoint = [1.1, 0.05, 0.002]\n\
         [[gauge.level]]\nname = \"level\"\nat = [0.8, 0.05]\n",
    )
}

#[test]
fn pressures_on_solids_go_with_them_and_tell_of_the_water_below() {
    let mean = means(&on_solids(), &Processor::Cpu, 2.0, 3.0);
    let (weight, depth) = (1000.0 * 9.81, mean["level [m]"]);
    let below = |part: f64| weight * (depth + part * (0.3 - depth));
    let mut wrong = Vec::new();
    for (name, expected) in [
        // what a box presses is what it weighs
        ("bottom [Pa]", 500.0 * 9.81 * 0.2),
        ("plate [Pa]", weight * (depth - 0.2)),
        ("lee [Pa]", weight * 0.2),
        // from heel to toe the pressure falls evenly
        ("heel [Pa]", below(0.15)),
        ("under [Pa]", below(0.5)),
        ("base [Pa]", below(0.5)),
    ] {
        let found = mean[name];
        println!("{name}: {found:.1} for {expected:.1}");
        if (found / expected - 1.0).abs() > 0.03 {
            wrong.push(name);
        }
    }
    assert!(depth > 0.51 && wrong.is_empty(), "{wrong:?} in {mean:?}");
}

#[test]
fn a_gauge_of_several_is_their_sum() {
    let more = "[[gauge.force]]\nname = \"all\"\non = \"tank\"\n[[gauge.force]]\nname = \"sides\"\non = \"tank.x_*\"\n\
                [[gauge.force]]\nname = \"other\"\non = \"tank.x_max\"\n";
    let case = still(more);
    let scene = Scene::build(&case).unwrap();
    let mut sim = Simulation::on(&case, scene, &Processor::Cpu).unwrap();
    for _ in 0..5 {
        sim.step().unwrap();
    }
    let gauges = Gauges::new(&case, &sim.scene).unwrap();
    let row = row(&gauges, &mut sim);
    let get = |name: &str| row[name];
    let sides = get("side_force_x [N]") + get("other_force_x [N]");
    assert!((get("sides_force_x [N]") - sides).abs() < 1e-9 && get("side_force_x [N]") < -1.0, "{row:?}");
    // All of the tank carries the water's weight, where it is: about the origin.
    let (fluid, _) = sim.observe().unwrap();
    let weight = get("all_force_z [N]");
    assert!(
        weight < -1.0 && (get("all_torque_y [N m]") / (-fluid.centroid[0] * weight) - 1.0).abs() < 0.05,
        "{row:?}"
    );
    assert!((get("all_torque_x [N m]") / (fluid.centroid[1] * weight) - 1.0).abs() < 0.05, "{row:?}");
}

#[test]
fn a_device_reads_the_same_gauges() {
    if !crate::common::there_is_a_device("gauges on a device are not tested") {
        return;
    }
    let mut thrown = still("");
    // Walls' rows undo much of it.
    thrown.fluid.as_mut().expect("water").block[0].velocity = [-0.5, 0.0, 0.0];
    for case in [still(""), thrown] {
        let cpu = means(&case, &Processor::Cpu, 0.01, 0.02);
        let gpu = means(&case, &Processor::Gpu { adapter: None }, 0.01, 0.02);
        for (name, size) in [("floor_force_z [N]", 100.0), ("side_force_x [N]", 50.0), ("half [Pa]", 1000.0)]
        {
            println!("{name}: {} and {}", cpu[name], gpu[name]);
            assert!((cpu[name] - gpu[name]).abs() < 5e-3 * size, "{name}: {} and {}", cpu[name], gpu[name]);
        }
    }
}

#[test]
fn means_are_those_of_every_step_and_begin_anew_after_a_row() {
    let mut case = still(
        "[[moving_wall]]\nname = \"lid\"\nmin = [0.08, 0.08, 0.1]\nmax = [0.16, 0.16, 0.3]\n\
                          motion = [[0, 0, 0, 0], [1, 0, 0, 0.05]]\n[[gauge.force]]\nname = \"lid\"\non = \"lid\"\n",
    );
    case.fluid.as_mut().expect("water").block[0].velocity = [-0.5, 0.0, 0.0];
    case.run.adaptive = true;
    let mut mean = case.clone();
    mean.gauge.mean = true;
    let processors = processors("means on a device are not tested");
    for processor in processors {
        let scene = Arc::new(Scene::build(&case).expect("the scene builds"));
        let each = Gauges::new(&case, &scene).expect("the gauges find their walls");
        let mut over = Gauges::new(&mean, &scene).expect("the gauges find their walls");
        let mut sim = Simulation::on(&case, scene, &processor).expect("the simulation starts");
        for steps in [7, 1, 4] {
            let (mut sum, mut seconds) = (BTreeMap::<String, f64>::new(), 0.0);
            for _ in 0..steps {
                let dt = sim.step().expect("a step").dt;
                over.follow(&mut sim, dt).expect("the gauges can be read");
                row(&each, &mut sim).into_iter().for_each(|(k, v)| *sum.entry(k).or_default() += dt * v);
                seconds += dt;
            }
            let (told, last) = (row(&over, &mut sim), row(&each, &mut sim));
            over.begin();
            let mut differ = 0;
            for (name, sum) in sum.iter().filter(|(name, _)| *name != "time [s]") {
                let wanted = sum / seconds;
                let apart = (told[name] - wanted).abs();
                assert!(apart < 1e-9 * (1.0 + wanted.abs()), "{name}: {} for {wanted}", told[name]);
                differ += usize::from((last[name] - wanted).abs() > 1e-3 * wanted.abs());
            }
            assert!(steps == 1 && differ == 0 || steps > 1 && differ > 5, "{differ} in {steps} steps");
        }
    }
}

#[test]
fn a_wall_under_pressure_feels_it_where_water_can_be() {
    let pillar = "[[obstacle]]\nname = \"pillar\"\nmin = [0.08, 0.08, 0]\nmax = [0.16, 0.16, 0.3]\nopen = [\"z_min\"]\n";
    let mut case = still(pillar);
    case.run.gravity = [0.0; 3];
    let scene = Scene::build(&case).expect("the scene builds");
    let params = seixo::params::Params::new(&case, &scene).expect("parameters");
    for (name, expected) in [
        // The floor without the pillar's foot, a side, the pillar's top: 1 Pa makes as many newtons as it has m2.
        ("tank.z_min", [0.0, 0.0, -(0.24 * 0.24 - 0.08 * 0.08)]),
        ("tank.x_min", [-0.24 * 0.4, 0.0, 0.0]),
        ("tank.y_max", [0.0, 0.24 * 0.4, 0.0]),
        ("pillar", [0.0, 0.0, -0.08 * 0.08]),
    ] {
        let wall = FixedWall::find(&scene, name).expect("the wall is there");
        let one = RowPressure { pressure: 1.0, ..RowPressure::default() };
        let force = wall.force(&vec![one; wall.slots.len()], &wall.areas(&scene, &[]), &params).force;
        assert!(force.distance(expected.into()) < 1e-12, "{name}: {force} for {expected:?}");
    }
    assert!(FixedWall::find(&scene, "tank.z_max").is_none());
}

/// A tank in the plane, 0.6 x 0.4 m, without water, with `more` in it; its faces and what one pascal on them makes [m], [m2], where its solids have
/// moved by `way` [m].
fn faces(more: &str, way: DVec3) -> impl Fn(&str) -> (DVec3, DVec3) {
    let case = case(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ndimensions = 2\ngravity = [0, 0, 0]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0.2]\nmax = [0.1, 0, 0.3]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.4]\nopen = [\"z_max\"]\n{more}"
    ));
    let scene = Scene::build(&case).expect("the scene builds");
    let params = seixo::params::Params::new(&case, &scene).expect("parameters");
    let solids = seixo::contact::Solids::new(&scene, case.contact.as_ref()).expect("solids");
    let mut poses = solids.poses().to_vec();
    poses.iter_mut().for_each(|pose| pose.position += way);
    move |name| {
        let wall = FixedWall::find(&scene, name).expect("the wall is there");
        let one = vec![RowPressure { pressure: 1.0, ..RowPressure::default() }; wall.slots.len()];
        let sum = wall.force(&one, &wall.areas(&scene, &poses), &params);
        (sum.force / scene.spacing, sum.torque / scene.spacing)
    }
}

#[test]
fn faces_behind_solids_of_any_shape_see_no_water() {
    // Force on the floor and on a side for one pascal, where something stands before a part of them: a row or two too much before.
    let bed = "[[obstacle]]\nname = \"bed\"\nshape = \"prism\"\nheight = 0.1\n\
               section = [[-0.1, -0.1], [0.7, -0.1], [0.7, 0.1], [-0.1, 0.1]]\n";
    let slope = "[[obstacle]]\nname = \"slope\"\nshape = \"prism\"\nheight = 0.1\nsection = [[0.407, 0], [0.6, 0], [0.6, 0.3]]\n";
    let boxed =
        "[[obstacle]]\nname = \"gate\"\nshape = \"box\"\nsize = [0.05, 0.1, 0.4]\ncenter = [0.307, 0, 0.2]\n";
    let gate = "[[moving_wall]]\nname = \"gate\"\nmin = [0.3, 0, 0]\nmax = [0.34, 0, 0.4]\nmotion = [[0, 0, 0, 0], [1, 0, 0, 0.1]]\n";
    let block = "[contact]\nspring = 1e6\n[[body]]\nname = \"b\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.35, 0, 0.05]\ndensity = 2000\n";
    let up = |over: f64| 0.02 * over * DVec3::Z;
    for (name, more, way, floor, side) in [
        ("bed", bed, up(0.0), 0.0, 0.3),
        ("slope", slope, up(0.0), 0.407, 0.1),
        ("box", boxed, up(0.0), 0.55, 0.4),
        ("gate", gate, up(0.0), 0.56, 0.4),
        ("gate a little off the floor", gate, up(0.4), 0.56, 0.4),
        ("gate that has gone up", gate, up(1.0), 0.6, 0.4),
        ("block", block, up(0.0), 0.5, 0.4),
        ("block that its slot tells of", block, up(0.8), 0.6, 0.4),
        ("block that has come up", block, up(2.0), 0.6, 0.4),
    ] {
        let on = faces(more, way);
        let (down, right) = (on("tank.z_min").0, on("tank.x_max").0);
        println!("{name}: floor {:.4} m for {floor}, side {:.4} m for {side}", -down.z, right.x);
        // A quarter of a spacing.
        assert!((down.z + floor).abs() < 0.005 && down.x.abs() < 1e-12, "{name}: {down}");
        assert!((right.x - side).abs() < 0.005, "{name}: {right}");
    }
}

#[test]
fn where_a_scene_lies_changes_no_force_on_its_walls() {
    // The edges of the box run through the middle of faces of the tank: round-off told on which side of the points.
    let area = |[x, y, z]: [f64; 3]| {
        let scene = Scene::build(&case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\n\
             [tank]\nmin = [{x}, {y}, {z}]\nmax = [{}, {}, {}]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.fill]]\nseed = [{}, {}, {}]\nlevel = {}\n\
             [[obstacle]]\nname = \"box\"\nshape = \"box\"\nsize = [0.06, 0.06, 0.08]\ncenter = [{}, {}, {}]\n",
            x + 0.4, y + 0.16, z + 0.2, x + 0.05, y + 0.02, z + 0.05, z + 0.1, x + 0.2, y + 0.08, z + 0.04
        )))
        .expect("it builds");
        let floor = FixedWall::find(&scene, "tank.z_min").expect("a floor");
        floor.areas(&scene, &[]).into_iter().sum::<DVec3>().z
    };
    // Of the points at the corners of the box half is covered, of their surroundings a quarter.
    let corners = 4.0 * 0.25 * 0.004 * 0.004;
    for at in [[0.2, 0.0, 0.0], [0.4, 0.4, 0.6], [1000.2, 2000.0, -300.0], [-0.3, 0.1, 0.7]] {
        let area = area(at);
        assert!((area - (0.4 * 0.16 - 0.06 * 0.06 - corners)).abs() < 1e-9, "{at:?}: {area} m2");
    }
}

#[test]
fn each_face_of_a_tank_has_what_looks_along_it_however_the_scene_is_turned() {
    // The rim of a hole in a corner of the end; that of a hole across z went to the end.
    let on = |k: usize| {
        let turned = |v: [f64; 3]| [0, 1, 2].map(|axis| v[(axis + k) % 3]);
        let axis = |of: usize| ["x", "y", "z"][(of + 3 - k) % 3];
        let scene = Scene::build(&case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ngravity = {:?}\n\
             [tank]\nmin = [0, 0, 0]\nmax = {:?}\nopen = [\"{}_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = {:?}\n\
             [[outflow]]\nname = \"hole\"\nface = \"{}_max\"\nmin = {:?}\nmax = {:?}\n",
            turned([0.0, 0.0, -9.81]),
            turned([0.3, 0.16, 0.3]),
            axis(2),
            turned([0.2, 0.16, 0.1]),
            axis(0),
            turned([0.3, 0.0, 0.0]),
            turned([0.3, 0.12, 0.2])
        )))
        .expect("it builds");
        ["x_min", "x_max", "y_min", "y_max", "z_min"].map(|face| {
            let name = format!("tank.{}{}", axis("xyz".find(&face[..1]).expect("an axis")), &face[1..]);
            let wall = FixedWall::find(&scene, &name).expect("a wall");
            let area: DVec3 = wall.areas(&scene, &[]).into_iter().sum();
            let own = "xyz".find(&name[5..6]).expect("an axis");
            assert!((area.length() - area[own].abs()).abs() < 1e-12, "{name}, turned {k}: {area}");
            area[own]
        })
    };
    let first = on(0);
    for k in [1, 2] {
        let turned = on(k);
        assert!(first.iter().zip(turned).all(|(a, b)| (a - b).abs() < 1e-12), "{first:?} {turned:?}");
    }
}

#[test]
fn a_pressure_gauge_reads_a_body_that_is_held_or_floats() {
    let with = |more: &str| {
        case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ndimensions = 2\ngravity = [0, 0, -9.81]\n\
             [fluid]\nsound_speed = 4\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.32, 0, 0.2]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.32, 0, 0.3]\nopen = [\"z_max\"]\n[contact]\nspring = 1e5\n\
             [[gauge.pressure]]\nname = \"p\"\npoint = [0.16, 0, 0.1]\n{more}"
        ))
    };
    let body = "[[body]]\nname = \"b\"\nsize = [0.12, 0.02, 0.1]\ncenter = [0.16, 0, 0.15]\ndensity = 500\ndisplaces_fluid = true\n";
    let held = format!("{body}locked = [\"x\", \"z\", \"rotation_y\"]\n");
    let afloat = body.replace("500", "1000");
    for more in [&held, &afloat] {
        let statics = 1000.0 * 9.81 * 0.1;
        let pressure = means(&with(more), &Processor::Cpu, 0.05, 0.15)["p [Pa]"];
        assert!((pressure / statics - 1.0).abs() < 0.03, "{pressure} Pa for {statics}");
    }
}

#[test]
fn pressures_in_the_gap_below_a_held_block_are_those_of_its_rim() {
    // Of a gap a tenth of a spacing high the floor was told nothing, of half of one a quarter: there rows face rows.
    for gap in [0.1, 0.5] {
        let bottom = 0.02 * gap;
        let case = case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 5e-4\nend = 1.0\ndimensions = 2\ngravity = [0, 0, -9.81]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.3]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.5]\nopen = [\"z_max\"]\n[contact]\n\
             [[body]]\nname = \"b\"\nsize = [0.24, 0.1, 0.16]\ncenter = [0.3, 0, {}]\ndensity = 2000\n\
             displaces_fluid = true\nlocked = [\"x\", \"z\", \"rotation_y\"]\n\
             [[gauge.level]]\nname = \"level\"\nat = [0.1, 0]\n\
             [[gauge.pressure]]\nname = \"floor\"\npoint = [0.3, 0, 0]\n\
             [[gauge.pressure]]\nname = \"body\"\npoint = [0.353, 0, {bottom}]\n\
             [[gauge.pressure]]\nname = \"edge\"\npoint = [0.4, 0, 0]\n",
            0.08 + bottom
        ));
        let mean = means(&case, &Processor::Cpu, 0.05, 0.15);
        for (name, z) in [("floor [Pa]", 0.0), ("body [Pa]", bottom), ("edge [Pa]", 0.0)] {
            let part = mean[name] / (1000.0 * 9.81 * (mean["level [m]"] - z));
            assert!((part - 1.0).abs() < 0.02, "{gap} l0: {name} {part} of the depth's");
        }
    }
}

#[test]
fn torques_on_a_face_of_the_tank_count_about_the_middle_of_its_surface() {
    let on = faces("", DVec3::ZERO);
    for name in ["tank.x_min", "tank.x_max", "tank.z_min"] {
        // Even pressure has none about it; the layers below the floor moved the point by a row and a half.
        let (force, torque) = on(name);
        assert!(force.length() > 0.3 && torque.length() < 1e-12, "{name}: {torque}");
    }
}

#[test]
fn a_floor_carries_the_water_under_a_block_too() {
    // What the slot presses on the block it presses on the floor: else that lacks the water's force under the block, 0.98 N of 2.94.
    let case = case(
        "[run]\nspacing = 0.0125\ntime_step = 5e-4\nend = 1.0\ndimensions = 2\ngravity = [0, 0, -9.81]\n\
         [fluid]\nsound_speed = 10\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.3, 0, 0.1]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.3, 0, 0.2]\nopen = [\"z_max\"]\n[contact]\nspring = 1e6\n\
         [[body]]\nname = \"b\"\nsize = [0.1, 0.1, 0.05]\ncenter = [0.15, 0, 0.025]\ndensity = 2500\n\
         displaces_fluid = true\nstanding = true\n\
         [[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n[[gauge.force]]\nname = \"b\"\non = \"b\"\n",
    );
    let mean = means(&case, &Processor::Cpu, 0.1, 0.2);
    let slice = 1000.0 * 9.81 * 0.0125;
    let (floor, lift) = (mean["floor_force_z [N]"] / slice, mean["b_force_z [N]"] / slice);
    println!("floor {floor:.5} m2 for -0.03, block {lift:.5} m2 for 0.005");
    assert!((floor / -0.03 - 1.0).abs() < 0.01 && (lift / 0.005 - 1.0).abs() < 0.015, "{floor} {lift}");
    assert!(mean["floor_torque_y [N m]"].abs() < 0.01 * slice * 0.03 * 0.15, "{mean:?}");
}

#[test]
fn what_a_slot_presses_on_a_floor_beyond_a_seam_acts_where_its_image_is() {
    let mut case = still("");
    case.tank.as_mut().expect("a tank").periodic = vec![seixo::case::Axis::X];
    case.gauge.force.truncate(1);
    case.gauge.pressure.clear();
    let scene = Scene::build(&case).expect("it builds");
    let floor = FixedWall::find(&scene, "tank.z_min").expect("a floor");
    let own = |&k: &usize| scene.static_wall_shape[k] as usize == floor.shape();
    let on = (0..scene.static_wall_shape.len()).find(own).map(Opposite::Wall).expect("its particles");
    let params = Params::new(&case, &scene).expect("valid");
    let (told, areas) =
        (vec![RowPressure::default(); floor.slots.len()], vec![DVec3::ZERO; floor.slots.len()]);
    // The face of one particle.
    let area = scene.spacing * scene.spacing;
    let torque = |x: f64| {
        let push = Push {
            by: 0,
            row: 0,
            on,
            at: DVec3::new(x, 0.12, 0.0),
            pressure: 2.0 / area,
            area: -area * DVec3::Z,
        };
        floor.slot_force(&[push], (&told, &areas), (&scene, &[]), &params).torque
    };
    // By a body that lies over the side; the arm was longer by the tank.
    for (beyond, image) in [(0.27, 0.03), (-0.05, 0.19)] {
        let (found, expected) = (torque(beyond), torque(image));
        assert!((found - expected).length() < 1e-12 && expected.y.abs() > 0.1, "{found} for {expected}");
    }
}

#[test]
fn driven_solids_feel_water_where_it_stands() {
    // A gate, closed on a floor, the joint of two walls one on the other that move as one, and a step with a block on it.
    let slow = "motion = [[0, 0, 0, 0], [1, 0, 0, 0], [2, 0.001, 0, 0]]\n";
    let wall = |name: &str, low: f64, high: f64| {
        format!(
            "[[moving_wall]]\nname = \"{name}\"\nmin = [0.4, 0, {low}]\nmax = [0.45, 0, {high}]\n{slow}\
             [[gauge.force]]\nname = \"{name}\"\non = \"{name}\"\n"
        )
    };
    let text = format!(
        "[run]\nspacing = 0.0125\ntime_step = 5e-4\nend = 2.0\ndimensions = 2\ngravity = [0, 0, -9.81]\n\
         [fluid]\nsound_speed = 10\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.2]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.3]\nopen = [\"z_max\"]\n[contact]\nspring = 1e6\n{}{}\
         [[moving_wall]]\nname = \"step\"\nmin = [0.15, 0, 0]\nmax = [0.25, 0, 0.025]\n{slow}\
         [[gauge.force]]\nname = \"step\"\non = \"step\"\n\
         [[body]]\nname = \"b\"\nsize = [0.05, 0.1, 0.05]\ncenter = [0.2, 0, 0.05]\ndensity = 2500\n\
         displaces_fluid = true\nstanding = true\n",
        wall("low", 0.0, 0.1),
        wall("high", 0.1, 0.3)
    );
    let mean = means(&case(&text), &Processor::Cpu, 0.1, 0.2);
    let slice = 1000.0 * 9.81 * 0.0125;
    let of = |name: &str, axis: char| mean[&format!("{name}_force_{axis} [N]")] / slice;
    for (name, push) in [("low", 0.015), ("high", 0.005)] {
        let (x, z) = (of(name, 'x'), of(name, 'z'));
        println!("{name}: {x:.5} m2 for {push}, {z:.1e} for 0");
        assert!((x / push - 1.0).abs() < 0.02 && z.abs() < 1e-4, "{name}: {x} {z}");
    }
    let z = of("step", 'z');
    println!("step: {z:.5} m2 for {:.5}", -0.1 * 0.175);
    assert!((z / (-0.1 * 0.175) - 1.0).abs() < 0.02, "{z}");
}

#[test]
fn the_viscous_force_on_a_floor_is_the_momentum_that_the_water_loses() {
    // So soft a water (alpha) that its pressure, whose gradient does not keep momentum, has no reach in such short steps.
    let case = case(
        "[run]\nspacing = 0.02\ntime_step = 1e-5\nend = 1.0\ngravity = [0, 0, 0]\n\
         [fluid]\nviscosity = 0.05\nsound_speed = 2\ncompressibility = 1e-9\n\
         [[fluid.block]]\nmin = [0.2, 0.2, 0]\nmax = [0.4, 0.4, 0.1]\nvelocity = [0.5, 0, 0]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0.6, 0.3]\nopen = [\"z_max\"]\n\
         [[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n",
    );
    let scene = Arc::new(Scene::build(&case).expect("the scene builds"));
    let gauges = Gauges::new(&case, &scene).expect("the gauge finds its wall");
    let mut sim = cpu_simulation(&case, scene.clone());
    // Viscosity acts on the neighbours of the last step: there are none in the first.
    sim.step().expect("a step");
    let start = sim.backend.monitor().expect("the monitor").momentum[0];
    sim.step().expect("a step");
    let lost = (start - sim.backend.monitor().expect("the monitor").momentum[0]) / 1e-5;
    let force = row(&gauges, &mut sim)["floor_force_x [N]"];
    println!("{force:.4} N on the floor, {lost:.4} N lost by the water");
    assert!(lost > 0.0 && (force / lost - 1.0).abs() < 0.03, "{force} for {lost}");
}

#[test]
fn a_gauge_finds_its_wall_at_every_spacing() {
    let shipped =
        std::fs::read_to_string(format!("{ROOT}/cases/dam_break_transport.toml")).expect("the case");
    let shipped = case(&shipped);
    for k in 0..30 {
        let mut case = shipped.clone();
        case.run.spacing = 0.021 + 0.001 * f64::from(k);
        // The gauges and the walls that they are on; bodies and gates need spacings that fit them.
        (case.body, case.moving_wall) = (Vec::new(), Vec::new());
        (case.gauge.force, case.contact) = (Vec::new(), None);
        case.fluid.as_mut().expect("water").block[0].max[0] = 3.5;
        let scene = Scene::build(&case).unwrap_or_else(|e| panic!("{}: {e}", case.run.spacing));
        Gauges::new(&case, &scene).unwrap_or_else(|e| panic!("{}: {e}", case.run.spacing));
    }
    let mut case = shipped;
    case.gauge.pressure[0].point = [1.5, 0.25, 0.2];
    case.run.spacing = 0.03;
    let error = Scene::build(&case).expect_err("a gauge in mid-air").to_string();
    assert!(error.contains("no wall or body there"), "{error}");
}

/// An opening's solid has no pressure of its own: a gauge there is refused before anything starts, with its key.
#[test]
fn a_gauge_in_an_opening_is_refused_with_its_key() {
    let text = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.02\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0.1, 0.6]\nopen = [\"z_max\"]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.6, 0.1, 0.3]\n\
         [[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0.1, 0.2]\nvelocity = 0.1\n\
         [[gauge.pressure]]\nname = \"p\"\npoint = [0, 0.05, 0.1]\n";
    match Scene::build(&case(text)) {
        Err(seixo::Error::Case(why)) => assert_eq!(why.problems[0].key, "gauge.pressure.0.point", "{why}"),
        other => panic!("expected a refusal, got {:?}", other.map(|_| ())),
    }
}

#[test]
fn a_jet_presses_on_a_wall_with_the_momentum_that_it_loses() {
    // A jet of 0.1 m and 2 m/s meets, without gravity, a face of the tank, an obstacle of the lattice or a box that stands off it.
    // Rows of walls press with 25 % more: they undo a divergence, and water feels the mean of their pressure and its own.
    let plate = "[[obstacle]]\nname = \"plate\"\n";
    for (on, more) in [
        ("tank.z_min", String::new()),
        ("plate", format!("{plate}min = [0.2, 0, 0]\nmax = [2.2, 0, 0.1]\n")),
        ("plate", format!("{plate}size = [2.0, 0.1, 0.1]\ncenter = [1.2033, 0, 0.0533]\n")),
    ] {
        let floor = if on == "plate" { 0.1 } else { 0.0 };
        let case = case(&format!(
            "[run]\nspacing = 0.0125\ntime_step = 3.125e-4\nend = 1.0\ndimensions = 2\ngravity = [0, 0, 0]\n\
             [fluid]\nsound_speed = 20\n[[fluid.block]]\nmin = [1.15, 0, {}]\nmax = [1.25, 0, {}]\nvelocity = [0, 0, -2]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [2.4, 0, 1.0]\nopen = [\"z_max\"]\n{more}\
             [[gauge.force]]\nname = \"f\"\non = \"{on}\"\n",
            floor + 0.025,
            floor + 0.825
        ));
        let scene = Arc::new(Scene::build(&case).expect("it builds"));
        let gauges = Gauges::new(&case, &scene).expect("a gauge");
        let mut sim = cpu_simulation(&case, scene);
        let (mut pressed, mut lost, mut last) = (0.0, 0.0, f64::NAN);
        while sim.time < 0.3 {
            let dt = sim.step().expect("a step").dt;
            let momentum = sim.backend.monitor().expect("measured").momentum[2];
            // From when the jet has begun to flow sideways until it ends.
            if sim.time > 0.06 {
                pressed -= dt * row(&gauges, &mut sim)["f_force_z [N]"];
                lost += momentum - last;
            }
            last = momentum;
        }
        let steady = 1000.0 * 0.1 * 0.0125 * 4.0 * (sim.time - 0.06);
        println!(
            "{on} {more:?}: {:.3} of what the water loses, that {:.3} of rho b v^2",
            pressed / lost,
            lost / steady
        );
        assert!((pressed / lost - 1.0).abs() < 0.08, "{pressed} N s for {lost}");
    }
}

#[test]
fn a_wall_that_moves_is_found_by_letters_as_by_its_name() {
    // Nothing else asks for what the water does to it.
    let on = |on: &str| {
        let case = case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ndimensions = 2\n[fluid]\n\
             [[fluid.block]]\nmin = [0.1, 0, 0]\nmax = [0.6, 0, 0.2]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.4]\nopen = [\"z_max\"]\n\
             [[moving_wall]]\nname = \"piston\"\nmin = [0, 0, 0]\nmax = [0.1, 0, 0.4]\n\
             motion = [[0, 0, 0, 0], [1, 0.1, 0, 0]]\n[[gauge.force]]\nname = \"f\"\non = \"{on}\"\n"
        ));
        let scene = Arc::new(Scene::build(&case).expect("it builds"));
        let gauges = Gauges::new(&case, &scene).expect("a gauge");
        let mut sim = cpu_simulation(&case, scene);
        (0..5).for_each(|_| drop(sim.step().expect("a step")));
        row(&gauges, &mut sim)["f_force_x [N]"]
    };
    let (name, letters) = (on("piston"), on("pist*"));
    assert!(name < -1.0 && name == letters, "{name} N, {letters} N");
}

#[test]
fn a_block_of_water_that_falls_on_a_floor_presses_with_the_momentum_that_it_loses() {
    // Its layers hit the floor one after the other: a tenth of the impulse is that of collisions.
    let case = case(
        "[run]\nspacing = 0.02\ntime_step = 2e-3\nadaptive = true\nend = 1.0\ndimensions = 2\ngravity = [0, 0, -9.81]\n\
         [fluid]\nwall_friction = 0\n[[fluid.block]]\nmin = [-0.1, 0, 0.1]\nmax = [0.1, 0, 0.3]\nvelocity = [0, 0, -4]\n\
         [tank]\nmin = [-1, 0, 0]\nmax = [1, 0, 0.8]\nopen = [\"z_max\"]\n\
         [[gauge.force]]\nname = \"f\"\non = \"tank.z_min\"\n",
    );
    let scene = Arc::new(Scene::build(&case).expect("it builds"));
    let gauges = Gauges::new(&case, &scene).expect("a gauge");
    let processors = processors("the force of what falls on a floor");
    for processor in processors {
        let mut sim = Simulation::on(&case, scene.clone(), &processor).expect("it starts");
        let momentum = |sim: &mut Simulation| sim.backend.monitor().expect("measured").momentum[2];
        let (first, mut pressed) = (momentum(&mut sim), 0.0);
        while sim.time < 0.11 {
            let dt = sim.step().expect("a step").dt;
            pressed -= dt * row(&gauges, &mut sim)["f_force_z [N]"];
        }
        let weight = 1000.0 * 0.2 * 0.2 * 0.02 * 9.81 * sim.time;
        let left = momentum(&mut sim);
        let lost = left - first + weight;
        println!("{pressed:.3} N s for {lost:.3}, {:.3} of what fell is left", left / first);
        assert!(left.abs() < 0.1 * first.abs(), "most of it has come down");
        // A bound of five times rho v^2 cut the blow, and the layers went into each other.
        assert_eq!(sim.backend.counters().expect("counted").pressure_clamps, 0);
        assert!((pressed / lost - 1.0).abs() < 0.05, "{pressed} N s for {lost}");
    }
}

#[test]
fn a_wedge_that_plunges_into_weightless_water_feels_the_force_of_theory() {
    // Zhao and Faltinsen 1993, J. Fluid Mech. 246, for a deadrise of 30 degrees: F = 14.139 rho V^3 t for a unit of length. Water at rest
    // does not tell how fast it is about to be: c_s has to follow what plunges, or the water collapses onto itself.
    let (l0, speed) = (0.03, 2.0);
    let (half, rise) = (0.45, 0.45 / 3.0_f64.sqrt());
    let section = [[0.0, 0.0], [half, rise], [half, rise + 0.1], [-half, rise + 0.1], [-half, rise]];
    let at = |k: usize, y: f64| DVec3::new(section[k % 5][0], y, section[k % 5][1]);
    let length = 7.0 * l0;
    let mut triangles = vec![];
    for k in 0..5 {
        let [a, b, c, d] = [at(k, 0.0), at(k + 1, 0.0), at(k + 1, length), at(k, length)];
        triangles.extend([[a, c, b], [a, d, c]]);
        if (1..4).contains(&k) {
            triangles.push([at(0, 0.0), at(k, 0.0), at(k + 1, 0.0)]);
            triangles.push([at(0, length), at(k + 1, length), at(k, length)]);
        }
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = crate::meshes::file(&folder, "wedge.stl", &crate::meshes::stl(&triangles));
    let case = case(&format!(
        "[run]\nspacing = {l0}\ntime_step = 1.5e-3\nadaptive = true\nend = 0.1\ngravity = [0, 0, 0]\n\
         [fluid]\n[[fluid.block]]\nmin = [-1.2, 0, 0]\nmax = [1.2, {length}, 0.99]\n\
         [tank]\nmin = [-1.2, 0, 0]\nmax = [1.2, {length}, 2.01]\nopen = [\"z_max\"]\nperiodic = [\"y\"]\n\
         [[moving_wall]]\nname = \"wedge\"\nshape = \"mesh\"\nfile = \"{path}\"\nposition = [0, 0, 1.01]\n\
         motion = [[0, 0, 0, 0], [1, 0, 0, -2]]\n[[gauge.force]]\nname = \"f\"\non = \"wedge\"\n"
    ));
    let scene = Arc::new(Scene::build(&case).expect("it builds"));
    let gauges = Gauges::new(&case, &scene).expect("a gauge");
    let mut sim = cpu_simulation(&case, scene);
    let (mut impulse, mut expected) = (0.0, 0.0);
    while sim.time < 0.07 {
        let dt = sim.step().expect("a step").dt;
        if sim.time > 0.025 {
            impulse += dt * row(&gauges, &mut sim)["f_force_z [N]"] / length;
            expected += dt * 14.139 * 1000.0 * speed * speed * speed * (sim.time - 0.01);
        }
    }
    println!("{:.3} of the impulse of the similarity solution", impulse / expected);
    // The tank is 4 to 6 times as wide as what is wet of the wedge, and as deep as it is wide: some per cent more.
    assert!((0.9..1.2).contains(&(impulse / expected)), "{impulse} for {expected}");
}

#[test]
fn a_force_gauge_tells_what_bodies_press_beside_the_water() {
    // A block on the floor of still water, and a cube that slides into a post.
    let case = case(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -9.81]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 0.2, 0.1]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.2, 0.2, 0.3]\nopen = [\"z_max\"]\n\
         [[obstacle]]\nname = \"shelf\"\nmin = [0.8, 0, 0]\nmax = [1.6, 0.2, 0.1]\n\
         [[obstacle]]\nname = \"post\"\nmin = [1.4, 0, 0.1]\nmax = [1.6, 0.2, 0.3]\n\
         [[body]]\nname = \"block\"\nsize = [0.08, 0.08, 0.06]\ncenter = [0.1, 0.1, 0.03]\ndensity = 2500\ndisplaces_fluid = true\n\
         [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [1.2, 0.1, 0.15]\nmass = 2\nvelocity = [1, 0, 0]\n\
         [contact]\nspring = 1e5\nrestitution = 0.5\n\
         [gauge]\nmean = true\n\
         [[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n\
         [[gauge.force]]\nname = \"post\"\non = \"post\"\n\
         [[gauge.force]]\nname = \"block\"\non = \"block\"\n",
    );
    let scene = Arc::new(Scene::build(&case).expect("the scene builds"));
    let mut gauges = Gauges::new(&case, &scene).expect("the gauges find their walls");
    let mut sim = Simulation::on(&case, scene, &Processor::Cpu).expect("the simulation starts");
    let mut between = |from: f64, to: f64| {
        let began = sim.time;
        assert!((began - from).abs() < 1e-9);
        gauges.begin();
        while sim.time < to - 1e-9 {
            let before = sim.time;
            sim.step().expect("nothing happens to the water");
            let dt = sim.time - before;
            gauges.follow(&mut sim, dt).expect("the gauges can be read");
        }
        row(&gauges, &mut sim)
    };
    let hit = between(0.0, 0.3);
    let impulse = 0.3 * hit["post_contact_force_x [N]"];
    println!("impulse {impulse} of {}", 2.0 * 1.5);
    assert!((impulse - 3.0).abs() < 0.03 * 3.0, "{impulse}");
    let rest = between(0.3, 1.0);
    // The block's weight less what the water carries of it.
    let carried = rest["block_force_z [N]"];
    let pressed = -rest["floor_contact_force_z [N]"];
    let weight = 2500.0 * 0.08 * 0.08 * 0.06 * 9.81;
    println!("{pressed} + {carried} of {weight}");
    assert!((pressed + carried - weight).abs() < 0.01 * weight);
    assert!((rest["block_contact_force_z [N]"] - pressed).abs() < 1e-3 * weight);
    assert_eq!(rest["post_contact_force_x [N]"], 0.0);
}

#[test]
fn gauges_in_the_water_read_its_velocity_and_volume() {
    for (dimensions, width) in [(2, 0.02), (3, 0.16)] {
        // Water that goes round a periodic channel, 0.2 m high.
        let case = case(&format!(
            "[run]\ndimensions = {dimensions}\nspacing = 0.02\ntime_step = 2e-3\nend = 1.0\ngravity = [0, 0, -9.81]\n\
             [fluid]\nviscosity = 0\nwall_friction = 0\nsound_speed = 4\n\
             [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.16, 0.2]\nvelocity = [0.5, 0, 0]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.16, 0.4]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n\
             [[gauge.velocity]]\nname = \"middle\"\npoint = [0.2, 0.08, 0.1]\n\
             [[gauge.velocity]]\nname = \"seam\"\npoint = [0.0, 0.08, 0.19]\n\
             [[gauge.velocity]]\nname = \"air\"\npoint = [0.2, 0.08, 0.3]\n\
             [[gauge.volume]]\nname = \"all\"\nmin = [-1, -1, -1]\nmax = [1, 1, 1]\n\
             [[gauge.volume]]\nname = \"over\"\nmin = [0.3, -1, 0]\nmax = [0.5, 1, 0.1]\n\
             [[gauge.volume]]\nname = \"part\"\nmin = [0.1, -1, 0]\nmax = [0.3, 1, 0.1]\n"
        ));
        let scene = Arc::new(Scene::build(&case).expect("the scene builds"));
        let gauges = Gauges::new(&case, &scene).expect("nothing has to be found");
        let mut sim = Simulation::on(&case, scene, &Processor::Cpu).expect("the simulation starts");
        for _ in 0..50 {
            sim.step().expect("the water goes on");
        }
        let row = row(&gauges, &mut sim);
        println!("{row:?}");
        for name in ["middle", "seam"] {
            let of = |axis: &str| row[&format!("{name}_velocity_{axis} [m/s]")];
            // The lattice of the start melts.
            assert!((of("x") - 0.5).abs() < 1e-3 && of("y").abs() + of("z").abs() < 0.02, "{name}: {row:?}");
        }
        assert!(row["air_velocity_x [m/s]"].is_nan());
        let all = 0.4 * width * 0.2;
        assert!((row["all [m3]"] / all - 1.0).abs() < 1e-9, "{row:?}");
        // A column of particles more or less at either side.
        for name in ["part [m3]", "over [m3]"] {
            assert!((row[name] / all - 0.25).abs() < 0.026, "{row:?}");
        }
    }
}

#[test]
fn a_dry_scene_has_the_blow_of_a_body_on_a_post_and_nothing_of_water() {
    let text = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.3\ngravity = [0, 0, 0]\n\
         [[obstacle]]\nname = \"post\"\nmin = [0.4, 0, 0]\nmax = [0.6, 0.2, 0.3]\n\
         [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.2, 0.1, 0.15]\nmass = 2\nvelocity = [1, 0, 0]\n\
         [contact]\nspring = 1e5\nrestitution = 0.5\n\
         [[gauge.force]]\nname = \"post\"\non = \"post\"\n";
    let case: Case = text.parse().expect("a dry scene may have force gauges");
    let scene = Arc::new(Scene::build(&case).expect("the scene builds"));
    let gauges = Gauges::new(&case, &scene).expect("the post is there");
    assert_eq!(gauges.header().len(), 7, "{:?}", gauges.header());
    let mut sim = Simulation::on(&case, scene, &Processor::Cpu).expect("the simulation starts");
    let mut impulse = 0.0;
    while sim.time < 0.3 - 1e-9 {
        let before = sim.time;
        sim.step().expect("the cube comes back");
        impulse += (sim.time - before) * row(&gauges, &mut sim)["post_contact_force_x [N]"];
    }
    println!("{impulse}");
    assert!((impulse - 3.0).abs() < 0.03, "{impulse}");
    let still = text.replace("velocity = [1, 0, 0]", "motion = [[0, 0, 0, 0], [1, 0.1, 0, 0]]");
    let wrong = still.parse::<Case>().unwrap_err().to_string();
    assert!(wrong.contains("no [fluid] to measure"), "{wrong}");
}

/// A slice of still water 0.8 m long and 0.3 m deep with `solid` in it, called `pipe`.
fn with_pipe(solid: &str) -> Case {
    case(&format!(
        "[run]\nspacing = 0.0125\ntime_step = 1e-3\nadaptive = true\nend = 1.0\ndimensions = 2\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.8, 0, 0.3]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.8, 0, 0.4]\nopen = [\"z_max\"]\n{solid}\
         [[gauge.force]]\nname = \"pipe\"\non = \"pipe\"\n[[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n"
    ))
}

#[test]
fn a_pipe_on_the_bed_has_its_lift_and_the_bed_its_load_whatever_the_gap() {
    let processors = processors("gauges before slots on a device are not tested");
    let slice = 1000.0 * 9.81 * 0.0125;
    let disc = |kind: &str, gap: f64, more: &str| {
        let z = 0.1 + 0.0125 * gap;
        with_pipe(&format!(
            "[[{kind}]]\nname = \"pipe\"\nshape = \"cylinder\"\nradius = 0.1\ncenter = [0.4, 0, {z}]\n{more}"
        ))
    };
    let drive = "motion = [[0, 0, 0, 0], [10, 0, 0, 0]]\n";
    let held = "density = 1000\ndisplaces_fluid = true\n\
                locked = [\"x\", \"y\", \"z\", \"rotation_x\", \"rotation_y\", \"rotation_z\"]\n[contact]\nspring = 1e5\n";
    let mut cases = vec![("driven", 0.0, disc("moving_wall", 0.0, drive))];
    cases.extend([0.0, 0.3, 0.7, 1.0].map(|gap| ("obstacle", gap, disc("obstacle", gap, ""))));
    cases.extend([0.0, 0.5, 0.9].map(|gap| ("held", gap, disc("body", gap, held))));
    for processor in processors {
        for (kind, gap, case) in &cases {
            let on_device = !matches!(processor, Processor::Cpu);
            if on_device && *gap > 0.0 {
                continue;
            }
            let mean = means(case, &processor, 0.04, 0.08);
            let lift = mean["pipe_force_z [N]"] / slice / (0.01 * std::f64::consts::PI);
            let load = mean["floor_force_z [N]"] / slice / (-0.8 * 0.3);
            println!("{kind}, gap {gap}: lift {lift:.4}, load {load:.4} of statics");
            // The obstacle on the bed had 0.1 of its lift; the bed under a held body bore it up to 1.03 times.
            assert!((lift - 1.0).abs() < 0.035, "{kind} {gap}: {lift}");
            assert!((load - 1.0).abs() < 0.01, "{kind} {gap}: {load}");
        }
    }
}

#[test]
fn what_stands_on_the_bed_with_a_face_has_no_lift_and_what_hovers_above_it_has() {
    let slice = 1000.0 * 9.81 * 0.0125;
    for (gap, lift, load) in
        [(0.0, -0.2 * 0.1, 0.6 * 0.3), (0.7, 0.2 * 0.2, 0.8 * 0.3), (0.9, 0.2 * 0.2, 0.8 * 0.3)]
    {
        // Off the lattice, or it would be a box of it.
        let z = 0.1 + 0.0125 * gap;
        let case = with_pipe(&format!(
            "[[obstacle]]\nname = \"pipe\"\nshape = \"box\"\nsize = [0.2, 0.1, 0.2]\ncenter = [0.404, 0, {z}]\n"
        ));
        let mean = means(&case, &Processor::Cpu, 0.15, 0.25);
        let (own, floor) = (mean["pipe_force_z [N]"] / slice, -mean["floor_force_z [N]"] / slice);
        println!("gap {gap}: {own:.5} m2 for {lift:.5}, floor {floor:.5} m2 for {load:.5}");
        assert!(
            (own - lift).abs() < 0.02 * 0.04 && (floor / load - 1.0).abs() < 0.015,
            "{gap}: {own} {floor}"
        );
    }
}

/// A floor bears the water and what it lifts bodies by, wherever their edges lie on the lattice and whatever they touch.
#[test]
fn the_floor_under_rocks_bears_what_lifts_them() {
    let rock = |x: f64, y: f64, turn: f64| {
        format!(
            "[[body]]\nname = \"rock {y}\"\nsize = [0.08, 0.06, 0.06]\ncenter = [{x}, {y}, 0.03]\ndensity = 2500\n\
             displaces_fluid = true\norientation = {{ axis = [0, 0, 1], angle_deg = {turn} }}\n\
             [[gauge.force]]\nname = \"rock {y}\"\non = \"rock {y}\"\n"
        )
    };
    // 0.13 and 0.22, 0.56 and 0.46 of what lies under them were missing: rows at edges pressed on one thing alone, those at corners on none, and
    // what a floor's particle told of its bare half was taken away for the other half. 0.08 and 0.12 with edges a quarter of a spacing off, when what
    // was pressed went to halves of particles.
    for (rocks, bound) in [
        (vec![rock(0.15, 0.15, 0.0)], 0.03),
        (vec![rock(0.155, 0.15, 0.0)], 0.03),
        (vec![rock(0.155, 0.155, 0.0)], 0.03),
        (vec![rock(0.15, 0.15, 20.0)], 0.05),
        (vec![rock(0.15, 0.12, 0.0), rock(0.15, 0.18, 0.0)], 0.05),
        (vec![rock(0.15, 0.11, 0.0), rock(0.15, 0.19, 0.0)], 0.05),
    ] {
        let case = case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 2e-3\nadaptive = true\nend = 1.0\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.3, 0.3, 0.5]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.3, 0.3, 0.3]\n\
             [contact]\nspring = 2e4\nrestitution = 0.3\nfriction = 0.4\n{}\
             [[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n",
            rocks.concat()
        ));
        let mean = means(&case, &Processor::Cpu, 0.15, 0.25);
        let water =
            9810.0 * Scene::build(&case).expect("the scene builds").groups.fluid as f64 * 0.02_f64.powi(3);
        let of_rocks = |name: &str| {
            name.starts_with("rock") && name.ends_with("_force_z [N]") && !name.contains("contact")
        };
        let lift: f64 = mean.iter().filter(|(name, _)| of_rocks(name)).map(|(_, force)| force).sum();
        let under = 9810.0 * 0.3 * 0.08 * 0.06 * rocks.len() as f64;
        let missing = (water + lift + mean["floor_force_z [N]"]) / under;
        println!("{} rocks: {missing:.4} of what lies under them is missing", rocks.len());
        assert!(lift > 2.0 && missing.abs() < bound, "{missing}");
    }
}
