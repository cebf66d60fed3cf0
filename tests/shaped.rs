//! Obstacles and moving walls of any shape, from files too: water around them, forces, gauges, contact; ground.

use crate::common::dry::{Dry, G};
use crate::common::{case, cpu_simulation, processors};
use crate::meshes::{Triangles, ball, cuboid, file, stl};
use glam::DVec3;
use seixo::error::Error;
use seixo::scene::{Kind, Scene};
use seixo::simulation::Simulation;

const L0: f64 = 0.02;

/// Still water 0.4 x 0.3 x 0.24 m in a tank, with `solids` in it.
fn still(solids: &str) -> String {
    format!(
        "[run]\nspacing = {L0}\ntime_step = 1e-3\nend = 1\n[fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.3, 0.24]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.3, 0.34]\nopen = [\"z_max\"]\n{solids}"
    )
}

/// Ground from x = 0 to `length`, -0.1 to 0.4 along y, `height` high, in strips.
fn ground(length: f64, height: impl Fn(f64) -> f64) -> Triangles {
    let n = 24;
    let at = |k: u32, y: f64| {
        let x = length * f64::from(k) / f64::from(n);
        DVec3::new(x, y, height(x))
    };
    let strip = |k: u32| {
        let [a, b, c, d] = [at(k, -0.1), at(k + 1, -0.1), at(k + 1, 0.4), at(k, 0.4)];
        [[a, b, c], [a, c, d]]
    };
    (0..n).flat_map(strip).collect()
}

#[test]
fn water_fills_what_solids_of_any_shape_leave_and_no_more() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = file(&folder, "ball.stl", &stl(&ball(80.0, 4)));
    let land = file(&folder, "land.stl", &stl(&ground(0.5, |x| 0.05 + 0.3 * x)));
    let sphere = 4.0 / 3.0 * std::f64::consts::PI * 0.08_f64.powi(3);
    let middle = "center = [0.2, 0.15, 0.12]";
    for (keys, volume) in [
        (format!("shape = \"sphere\"\nradius = 0.08\n{middle}"), sphere),
        (format!("shape = \"mesh\"\nfile = \"{mesh}\"\nscale = 1e-3\nposition = [0.2, 0.15, 0.12]"), sphere),
        (
            format!("shape = \"cylinder\"\nradius = 0.07\nheight = 0.15\naxis = [1, 0, 1]\n{middle}"),
            std::f64::consts::PI * 0.0049 * 0.15,
        ),
        (
            format!("shape = \"cone\"\nradius = 0.1\nheight = 0.2\n{middle}"),
            std::f64::consts::PI * 0.01 * 0.2 / 3.0,
        ),
        ("shape = \"wedge\"\nsize = [0.2, 0.3, 0.12]\ncenter = [0.2, 0.15, 0.04]".into(), 0.1 * 0.3 * 0.12),
        (
            format!(
                "shape = \"box\"\nsize = [0.16, 0.12, 0.1]\n{middle}\norientation = {{ axis = [0, 1, 0], angle_deg = 30 }}"
            ),
            0.16 * 0.12 * 0.1,
        ),
        (format!("shape = \"terrain\"\nfile = \"{land}\""), 0.3 * (0.05 * 0.4 + 0.15 * 0.16)),
    ] {
        let text = still(&format!("[[obstacle]]\nname = \"it\"\n{keys}\n"));
        let case = case(&text);
        let scene = Scene::build(&case).unwrap_or_else(|e| panic!("{keys}: {e}"));
        // Where it stands as the run begins.
        let scene = cpu_simulation(&case, scene).scene;
        let solid = &scene.solids[0];
        assert!(solid.is_still() && !solid.is_body);
        let local = |x: DVec3| solid.orientation.inverse() * (x - solid.position);
        let (mut nearest, mut least) = (f64::INFINITY, f64::INFINITY);
        for (x, kind) in scene.position.iter().zip(&scene.kind) {
            if *kind == Kind::Fluid {
                let off = solid.shape.distance(local(*x)).0;
                least = least.min(off);
                // Beside a sharp ridge, where the nearest particle of the solid is a spacing behind it, by 0.08 spacings.
                assert!(off > -0.1 * L0, "{keys}: water {off} m from the surface at {x}");
            }
        }
        let fluid = &scene.position[..scene.groups.fluid];
        for slot in solid.wall_slots.clone().chain(solid.dummy_slots.clone()) {
            let x = scene.position[slot];
            assert!(solid.shape.distance(local(x)).0 < 0.0, "{keys}: a particle outside at {x}");
            assert!(x.cmpgt(DVec3::ZERO).all(), "{keys}: a particle beyond the tank's walls at {x}");
            nearest = fluid.iter().map(|f| f.distance(x)).fold(nearest, f64::min);
        }
        let filled = fluid.len() as f64 * L0.powi(3) + volume;
        println!(
            "{keys}: water and solid {filled:.5} m3 for 0.0288, nearest {:.2} l0, least off {:.3}",
            nearest / L0,
            least / L0
        );
        assert!((0.995..1.002).contains(&(filled / 0.0288)), "{keys}: {filled} m3 of water and solid");
        // Least at the tip of the cone.
        assert!(nearest > 0.49 * L0, "{keys}: {nearest} m between water and solid");
    }
}

#[test]
fn a_box_from_a_file_has_the_water_and_the_forces_of_the_box() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = file(&folder, "box.stl", &stl(&cuboid(DVec3::new(0.12, 0.3, 0.16))));
    let gauges = "[[gauge.force]]\nname = \"f\"\non = \"it\"\n[[gauge.pressure]]\nname = \"p\"\npoint = [0.08, 0.15, 0.06]\n";
    let of = |keys: &str| {
        // water on one side, 0.24 m deep
        let text = format!("{}{gauges}", still(&format!("[[obstacle]]\nname = \"it\"\n{keys}\n")))
            .replace("max = [0.4, 0.3, 0.24]", "max = [0.08, 0.3, 0.16]");
        let case = case(&text);
        let scene = Scene::build(&case).expect("builds");
        let groups = scene.groups;
        let mut sim = cpu_simulation(&case, scene);
        let (mut mean, mut count) = ([0.0; 3], 0.0);
        sim.run_until(0.3, |sim, _| {
            if sim.time > 0.15 {
                let gauges = sim.gauges().expect("they read");
                let value = |name: &str| gauges.iter().find(|g| g.0.starts_with(name)).expect(name).1;
                let now = [value("p"), value("f_force_x"), value("f_force_z")];
                mean.iter_mut().zip(now).for_each(|(m, x)| *m += x);
                count += 1.0;
            }
            std::ops::ControlFlow::Continue(())
        })
        .expect("still water is no trouble");
        (groups, mean.map(|m| m / count))
    };
    let (own, [p, fx, fz]) = of("min = [0.08, 0, 0]\nmax = [0.2, 0.3, 0.16]");
    let (groups, [mesh_p, mesh_fx, mesh_fz]) =
        of(&format!("shape = \"mesh\"\nfile = \"{path}\"\nposition = [0.08, 0, 0]"));
    assert_eq!(own.fluid, groups.fluid);
    assert_eq!(own.static_wall + own.moving_wall, groups.static_wall + groups.moving_wall);
    let exact = 0.5 * 1000.0 * G * 0.3 * 0.16 * 0.16;
    println!("p {p:.1} {mesh_p:.1} Pa, fx {fx:.3} {mesh_fx:.3} N for {exact:.3}, fz {fz:.3} {mesh_fz:.3} N");
    // Eight particles deep and not yet at rest; what counts is that file and lattice agree.
    assert!((mesh_p / p - 1.0).abs() < 1e-3 && (p / (1000.0 * G * 0.1) - 1.0).abs() < 0.1, "{mesh_p} {p} Pa");
    assert!((mesh_fx / exact - 1.0).abs() < 0.1, "{mesh_fx} N for {exact}");
    assert!((mesh_fx / fx - 1.0).abs() < 0.07, "{mesh_fx} N for {fx} of the box");
    assert!(mesh_fz.abs() < 0.06 * exact, "{mesh_fz} N upwards, with nothing below it");
}

#[test]
fn a_ball_from_a_file_that_is_held_under_water_is_lifted_by_the_water_it_displaces_on_both_processors() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = file(&folder, "ball.stl", &stl(&ball(0.07, 4)));
    let text = still(&format!(
        "[[obstacle]]\nname = \"it\"\nshape = \"mesh\"\nfile = \"{path}\"\nposition = [0.2, 0.15, 0.11]\n\
         [[gauge.force]]\nname = \"f\"\non = \"it\"\n"
    ));
    let case = case(&text);
    let processors = processors("the lift of a still ball from a mesh");
    let exact = 1000.0 * G * 4.0 / 3.0 * std::f64::consts::PI * 0.07_f64.powi(3);
    let mut lifts = vec![];
    for processor in processors {
        let scene = Scene::build(&case).expect("builds");
        let mut sim = Simulation::on(&case, scene, &processor).expect("starts");
        let (mut lift, mut count) = (0.0, 0.0);
        for step in 0..30 {
            sim.step().expect("still water is no trouble");
            if step >= 15 {
                lift += sim.fluid_force[0].force.z;
                count += 1.0;
            }
        }
        lifts.push(lift / count);
    }
    println!("lift {lifts:.3?} N for {exact:.3} N");
    assert!(lifts.iter().all(|l| (l / exact - 1.0).abs() < 0.08), "{lifts:?} N for {exact} N");
    assert!(lifts.iter().all(|l| (l / lifts[0] - 1.0).abs() < 1e-2), "{lifts:?}");
}

#[test]
fn a_wedge_that_follows_a_table_is_where_it_says_and_keeps_the_water_out() {
    let text = still(
        "[[moving_wall]]\nname = \"paddle\"\nshape = \"wedge\"\nsize = [0.12, 0.2, 0.12]\ncenter = [0.28, 0.15, 0.14]\n\
         orientation = { axis = [0, 0, 1], angle_deg = 180 }\n\
         motion = [[0, 0, 0, 0], [0.1, -0.02, 0, 0], [0.2, -0.06, 0, 0], [0.3, -0.08, 0, 0], [0.4, -0.08, 0, 0]]\n",
    );
    let case = case(&text);
    let mut sim = cpu_simulation(&case, Scene::build(&case).expect("builds"));
    sim.run_until(0.35, |_, _| std::ops::ControlFlow::Continue(())).expect("runs");
    let fields = sim.fields().expect("read");
    let pose = *sim.solids().next().expect("the paddle").pose;
    assert!((pose.position - DVec3::new(0.2, 0.15, 0.14)).length() < 1e-9, "{pose:?}");
    let shape = sim.scene.solids[0].shape;
    let deep = (0..sim.groups.fluid)
        .map(|i| shape.distance(pose.orientation.inverse() * (fields.position[i] - pose.position)).0)
        .fold(f64::INFINITY, f64::min);
    println!("water at {:.2} l0 of the surface", deep / L0);
    // The toe is thinner than a particle and has none.
    assert!(deep > -0.5 * L0, "water {deep} m inside");
}

#[test]
fn balls_roll_down_ground_from_a_file_and_come_to_rest_in_its_valley() {
    let folder = tempfile::tempdir().expect("a folder");
    let land = file(&folder, "land.stl", &stl(&ground(1.0, |x| 0.02 + 0.5 * (x - 0.5).abs())));
    for law in
        ["smooth\"\nfriction = 0.3\nrestitution = 0.2", "paper\"\ndamping_ratio = 0.5\nviscous_friction = 5"]
    {
        let mut dry = Dry::new(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n\
             [tank]\nmin = [0, 0, 0]\nmax = [1, 0.3, 1]\nopen = [\"z_max\"]\n\
             [[obstacle]]\nname = \"land\"\nshape = \"terrain\"\nfile = \"{land}\"\n\
             [[body]]\nname = \"ball\"\nshape = \"sphere\"\nradius = 0.06\ncenter = [0.25, 0.15, 0.26]\ndensity = 900\n\
             [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.75, 0.15, 0.32]\ndensity = 900\nstanding = true\n\
             [contact]\nspring = 1e5\nlaw = \"{law}\n"
        ));
        // neither falls through, and the ball has left its slope
        let poses = dry.run(1.5);
        let over = |x: DVec3| x.z - (0.02 + 0.5 * (x.x - 0.5).abs());
        println!("{law}: {:.4} {:.4}", poses[0].position, poses[1].position);
        let reach = 0.06 * 1.25_f64.sqrt();
        assert!(over(poses[0].position) > reach - 0.02, "{law}: the ball sank to {}", poses[0].position);
        assert!(over(poses[1].position) > 0.03, "{law}: the cube sank to {}", poses[1].position);
        assert!((poses[0].position.x - 0.5).abs() < 0.2, "{law}: the ball is at {}", poses[0].position);
    }
}

/// A square ring about the z axis: outer edge `a`, inner edge `b`, `h` high.
fn ring(a: f64, b: f64, h: f64) -> Triangles {
    let corner = |half: f64, k: usize, z: f64| {
        let (x, y) = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)][k % 4];
        DVec3::new(half * x, half * y, z)
    };
    let mut out = vec![];
    let mut quad = |p: [DVec3; 4]| out.extend([[p[0], p[1], p[2]], [p[0], p[2], p[3]]]);
    let (a, b, h) = (0.5 * a, 0.5 * b, 0.5 * h);
    for k in 0..4 {
        let [o, i] = [a, b].map(|half| move |k: usize, z: f64| corner(half, k, z));
        quad([o(k, h), o(k + 1, h), i(k + 1, h), i(k, h)]);
        quad([o(k, -h), i(k, -h), i(k + 1, -h), o(k + 1, -h)]);
        quad([o(k, -h), o(k + 1, -h), o(k + 1, h), o(k, h)]);
        quad([i(k, -h), i(k, h), i(k + 1, h), i(k + 1, -h)]);
    }
    out
}

#[test]
fn links_of_a_chain_hang_in_each_other_and_stay_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = file(&folder, "link.stl", &stl(&ring(0.3, 0.18, 0.06)));
    // One stands upright in the plane of x and z, the other in that of y and z, through it, and falls 0.03 m, until its
    // upper bar lies on the other's lower one.
    let mut dry = Dry::new(&format!(
        "[run]\nspacing = 0.02\ntime_step = 5e-4\nend = 1\n\
         [[obstacle]]\nname = \"hook\"\nshape = \"mesh\"\nfile = \"{link}\"\nposition = [0, 0, 0]\n\
         orientation = {{ axis = [1, 0, 0], angle_deg = 90 }}\n\
         [[body]]\nname = \"link\"\nshape = \"mesh\"\nfile = \"{link}\"\ncenter = [0, 0, -0.15]\ndensity = 2000\n\
         orientation = {{ axis = [0, 1, 0], angle_deg = 90 }}\n\
         [contact]\nspring = 1e6\nfriction = 0.3\nrestitution = 0.2\n"
    ));
    let pose = dry.run(0.8)[0];
    println!("{:.5} {:.5}", pose.position, pose.velocity);
    assert!((pose.position.z + 0.18).abs() < 3e-3, "it hangs at {}", pose.position);
    assert!(pose.velocity.length() < 0.05, "{pose:?}");
}

#[test]
fn what_is_wrong_with_a_wall_of_any_shape_is_said_with_its_key() {
    let folder = tempfile::tempdir().expect("a folder");
    let closed = file(&folder, "closed.stl", &stl(&cuboid(DVec3::splat(0.2))));
    let huge = file(&folder, "huge.stl", &stl(&cuboid(DVec3::splat(100.0))));
    let plate = file(&folder, "plate.stl", &stl(&cuboid(DVec3::new(0.2, 0.2, 0.01))));
    let open = file(&folder, "open.stl", &stl(&cuboid(DVec3::splat(0.2))[..11].to_vec()));
    let folded = file(
        &folder,
        "folded.stl",
        &stl(&ground(0.5, |x| if x > 0.3 { 0.9 - x } else { 0.1 })
            .into_iter()
            .map(|t| t.map(|v| DVec3::new(if v.x > 0.4 { 0.8 - v.x } else { v.x }, v.y, v.z)))
            .collect()),
    );
    for (keys, key, parts) in [
        (String::new(), "obstacle.0", &["neither corners nor a `size`", "add `min` and `max`"][..]),
        ("min = [0, 0, 0]".into(), "obstacle.0", &["`min` but no `max`"]),
        ("shape = \"sphere\"\nradius = 0.1".into(), "obstacle.0", &["without `center`"]),
        ("shape = \"sphere\"\ncenter = [0.2, 0.1, 0.1]".into(), "obstacle.0", &["without `radius`"]),
        ("min = [0, 0, 0]\nmax = [0.1, 0.1, 0.1]\nradius = 0.1".into(), "obstacle.0.radius", &["does not belong"]),
        ("min = [0, 0, 0]\nmax = [0.1, 0.1, 0.1]\nshape = \"cone\"\nradius = 0.1\nheight = 0.1\ncenter = [0.2, 0.1, 0.1]".into(),
         "obstacle.0.min", &["does not belong"]),
        ("shape = \"sphere\"\nradius = 0.005\ncenter = [0.2, 0.1, 0.1]".into(), "obstacle.0.radius", &["less than one particle"]),
        ("shape = \"mesh\"\nfile = \"/no/such.stl\"".into(), "obstacle.0.file", &["/no/such.stl"]),
        (format!("shape = \"mesh\"\nfile = \"{huge}\""), "obstacle.0.scale", &["100 m long", "millimetres", "scale = 0.001"]),
        (format!("shape = \"mesh\"\nfile = \"{plate}\""), "obstacle.0.file", &["1.00e-2 m thin at (0.", "run.spacing"]),
        (format!("shape = \"mesh\"\nfile = \"{open}\""), "obstacle.0.file", &["open", "terrain"]),
        (format!("shape = \"mesh\"\nfile = \"{closed}\"\nposition = [3, 0, 0]"), "obstacle.0", &["nothing of it stands free", "it lies beyond"]),
        (format!("shape = \"mesh\"\nfile = \"{closed}\"\ncenter = [0.2, 0.1, 0.1]"), "obstacle.0.center", &["use `position`"]),
        (format!("shape = \"terrain\"\nfile = \"{closed}\""), "obstacle.0.file", &["closed", "mesh"]),
        (format!("shape = \"terrain\"\nfile = \"{folded}\""), "obstacle.0.file", &["triangle", "overhangs"]),
    ] {
        let text = still(&format!("[[obstacle]]\nname = \"it\"\n{keys}\n"));
        match Scene::build(&case(&text)) {
            Err(Error::Case(why)) => {
                let problem = &why.problems[0];
                assert_eq!(problem.key, key, "{keys}: {why}");
                let said = format!("{why} {}", problem.remedy);
                assert!(parts.iter().all(|p| said.contains(p)), "{keys}: {said}");
                assert!(!problem.remedy.is_empty(), "{keys}: {said}");
            }
            other => panic!("{keys}: expected a refusal, got {:?}", other.map(|_| ())),
        }
    }
}

/// A bar from a file that lies askew in it hangs and swings as one of its size does, however small.
#[test]
fn bodies_from_files_turn_by_their_moments_however_small_they_are() {
    let folder = tempfile::tempdir().unwrap();
    for scale in [0.01, 0.1, 1.0] {
        // A box of 2 x 4 x 6, turned by 30 degrees about z in its file.
        let (sin, cos) = 30_f64.to_radians().sin_cos();
        let corner = |k: u32| {
            let side = |axis: u32, size: f64| if k >> axis & 1 == 1 { 0.5 * size } else { -0.5 * size };
            let (x, y, z) = (side(0, 2.0), side(1, 4.0), side(2, 6.0));
            format!("v {} {} {z}\n", x * cos - y * sin, x * sin + y * cos)
        };
        let mut text: String = (0..8).map(corner).collect();
        for f in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
            text += &format!("f {} {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1, f[3] + 1);
        }
        let path = folder.path().join("bar.obj");
        std::fs::write(&path, text).unwrap();
        for (axis, moment) in [([0.0, 0.0, 1.0], 20.0), ([cos, sin, 0.0], 52.0), ([-sin, cos, 0.0], 40.0)] {
            let mut dry = Dry::new(&format!(
                "[run]\nspacing = {}\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, 0]\n\
                 [[body]]\nname = \"bar\"\nshape = \"mesh\"\nfile = \"{}\"\nscale = {scale}\ncenter = [0, 0, 0]\nmass = 12\n\
                 angular_velocity = {axis:?}\n[contact]\nspring = 1e5\n",
                0.4 * scale,
                path.display()
            ));
            let exact = 0.5 * moment * scale * scale;
            let energy = dry.solids.energy().kinetic;
            // Corners are read in single precision.
            assert!((energy / exact - 1.0).abs() < 1e-6, "{scale} {axis:?}: {energy} for {exact}");
        }
    }
}

/// The ground goes down to the floor, also where it ends inside the tank.
#[test]
fn no_water_stands_in_ground_that_ends_inside_the_tank() {
    let folder = tempfile::tempdir().expect("a folder");
    for (length, height) in [(0.2, 0.2), (0.39, 0.14)] {
        let land = file(&folder, &format!("land{length}.stl"), &stl(&ground(length, |_| height)));
        let text = still(&format!("[[obstacle]]\nname = \"it\"\nshape = \"terrain\"\nfile = \"{land}\"\n"));
        let text = text.replace(
            "[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.3, 0.24]",
            "[[fluid.fill]]\nseed = [0.395, 0.15, 0.22]\nlevel = 0.24",
        );
        let scene = Scene::build(&case(&text)).unwrap_or_else(|e| panic!("{e}"));
        let water = &scene.position[..scene.water()];
        let within = water.iter().filter(|x| x.x < length - 0.5 * L0 && x.z < height - 0.5 * L0).count();
        let volume = water.len() as f64 * L0.powi(3) / (0.3 * (0.4 * 0.24 - length * height));
        println!("{length} x {height} m: {within} within, {volume:.3} of the volume");
        assert_eq!(within, 0, "{length} x {height}");
        assert!((volume - 1.0).abs() < 0.03, "{length} x {height}: {volume}");
    }
}
