//! Bodies from files as they are used: a hull rights itself as its metacentric height has it, armour units come to rest.

use crate::cli::{json, ran};
use crate::common::dry::{Dry, G};
use crate::common::{case, cpu_simulation};
use crate::meshes::{Triangles, ball, cuboid, file, stl};
use glam::{DVec2, DVec3};
use seixo::scene::Scene;

const LENGTH: f64 = 0.2;
/// Keel and the two edges of the deck of a hull with a V for its section, y and z [m].
const SECTION: [DVec2; 3] = [DVec2::new(0.0, 0.0), DVec2::new(0.2, 0.2), DVec2::new(-0.2, 0.2)];

fn hull() -> Triangles {
    let [[a, c, b], [d, f, e]] = [0.0, LENGTH].map(|x| SECTION.map(|p| DVec3::new(x, p.x, p.y)));
    vec![[a, b, c], [d, f, e], [b, e, f], [b, f, c], [a, d, e], [a, e, b], [a, f, d], [a, c, f]]
}

/// Area below `level` of the section heeled by `angle` [rad] with its keel at height `keel`, and the lever of its centroid
/// from the whole section's, along y.
fn wetted(angle: f64, keel: f64, level: f64) -> (f64, f64) {
    let corners = SECTION.map(|p| DVec2::from_angle(angle).rotate(p) + DVec2::new(0.0, keel));
    let mut wet: Vec<DVec2> = vec![];
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        if a.y <= level {
            wet.push(a);
        }
        if (a.y <= level) != (b.y <= level) {
            wet.push(a.lerp(b, (level - a.y) / (b.y - a.y)));
        }
    }
    let (mut area, mut moment) = (0.0, 0.0);
    for k in 0..wet.len() {
        let (a, b) = (wet[k], wet[(k + 1) % wet.len()]);
        let twice = a.perp_dot(b);
        area += 0.5 * twice;
        moment += twice * (a.x + b.x) / 6.0;
    }
    (area, moment / area - corners.iter().sum::<DVec2>().x / 3.0)
}

/// Held at a heel of 12 degrees: lift and torque against what the level of the water around it makes them.
#[test]
#[ignore = "a minute: cargo test --release --test seixo -- --ignored hulls"]
fn a_heeled_hull_is_righted_by_its_metacentric_height() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = file(&folder, "hull.stl", &stl(&hull()));
    // Half as heavy as water it would draw this much.
    let draft = 0.2 * 0.5_f64.sqrt();
    let (l0, keel, angle) = (0.02, 0.24 - draft, 12_f64.to_radians());
    let text = format!(
        "[run]\nspacing = {l0}\ntime_step = 2e-3\nadaptive = true\nend = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.28, 0.8, 0.4]\nopen = [\"z_max\"]\n\
         [fluid]\nsound_speed = 5\n[[fluid.fill]]\nseed = [0.02, 0.02, 0.1]\nlevel = 0.24\n\
         [[obstacle]]\nname = \"hull\"\nshape = \"mesh\"\nfile = \"{path}\"\nposition = [0.04, 0.4, {keel}]\n\
         orientation = {{ axis = [1, 0, 0], angle_deg = 12 }}\n[gauge]\nevery = 0.02\n[[gauge.force]]\nname = \"f\"\non = \"hull\"\n\
         [[gauge.level]]\nname = \"l\"\nat = [0.14, 0.06]\n"
    );
    let case = case(&text);
    let mut sim = cpu_simulation(&case, Scene::build(&case).expect("builds"));
    let (mut mean, mut count) = ([0.0; 3], 0.0);
    // The water takes a second to settle where the hull has kept it away.
    sim.run_until(2.0, |sim, _| {
        if sim.time > 1.2 && sim.steps % 8 == 0 {
            let gauges = sim.gauges().expect("they read");
            let value = |name: &str| gauges.iter().find(|g| g.0.starts_with(name)).expect(name).1;
            let now = [value("l "), value("f_force_z"), value("f_torque_x")];
            mean.iter_mut().zip(now).for_each(|(m, x)| *m += x);
            count += 1.0;
        }
        std::ops::ControlFlow::Continue(())
    })
    .expect("still water is no trouble");
    let [level, lift, torque] = mean.map(|m| m / count);
    let (area, lever) = wetted(angle, keel, level);
    let exact = 1000.0 * G * LENGTH * area;
    let (height, expected) = (-torque / (lift * angle.sin()), -lever / angle.sin());
    println!(
        "level {level:.4} m, lift {lift:.2} N for {exact:.2}, torque {torque:.3} N m for {:.3}; metacentric height {height:.4} m \
         for {expected:.4}",
        exact * lever
    );
    assert!((lift / exact - 1.0).abs() < 0.06, "{lift} N for {exact} N");
    assert!((height / expected - 1.0).abs() < 0.12, "{height} m for {expected} m");
}

/// A lattice along the axes of its file has places half a spacing below its faces too, but 1.4 spacings apart.
#[test]
fn sides_at_45_degrees_have_a_particle_for_each_square_of_the_spacing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = file(&folder, "hull.stl", &stl(&hull()));
    for l0 in [0.014, 0.02] {
        let scene = Scene::build(&case(&format!(
            "[run]\nspacing = {l0}\ntime_step = 1e-3\nend = 1\n[tank]\nmin = [0, 0, 0]\nmax = [0.28, 0.56, 0.42]\n\
             [[obstacle]]\nname = \"hull\"\nshape = \"mesh\"\nfile = \"{path}\"\nposition = [0.04, 0.28, 0.1]\n"
        )));
        let mut areas: Vec<f64> =
            scene.expect("builds").solids[0].wall_area.iter().map(|a| a.length() / (l0 * l0)).collect();
        areas.sort_by(f64::total_cmp);
        let median = areas[areas.len() / 2];
        assert!((0.85..1.15).contains(&median), "{median} at {l0} m");
    }
}

/// Where the layers of two faces meet inside an edge either face may be taken for the nearest one. Particles between the rows there are
/// too many: the wall's pressure beside them was three times that of still water.
/// Most of 1 - d / l0 that the neighbours of a particle of a wall layer sum up to: at the edge of two faces, whose rows stand a spacing from
/// it, or on a lattice 0, of one between two rows 1 and more.
fn crowding(shape: &str, l0: f64) -> f64 {
    let scene = Scene::build(&case(&format!(
        "[run]\nspacing = {l0}\ntime_step = 1e-3\nend = 1\n[tank]\nmin = [0, 0, 0]\nmax = [0.5, 0.6, 0.5]\n\
         [[obstacle]]\nname = \"body\"\n{shape}\n"
    )));
    let layer = &scene.expect("builds").solids[0].wall_offset;
    let crowd =
        |x: &DVec3| -> f64 { layer.iter().map(|y| (1.0 - x.distance(*y) / l0).max(0.0)).sum::<f64>() - 1.0 };
    layer.iter().map(crowd).fold(0.0, f64::max)
}

#[test]
fn no_particle_stands_between_the_rows_along_an_edge() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = file(&folder, "hull.stl", &stl(&hull()));
    let hull = format!("shape = \"mesh\"\nfile = \"{path}\"\nposition = [0.04, 0.28, 0.1]");
    for l0 in [0.01, 0.0125, 0.014, 0.02] {
        let most = crowding(&hull, l0);
        assert!(most < 0.6, "{most} at {l0} m");
    }
}

/// What the lattices of two faces leave between them where they meet at an angle is no whole number of particles.
#[test]
fn a_particle_has_more_than_half_of_its_room_where_lattices_meet() {
    let at = "center = [0.25, 0.3, 0.25]\nsize = [0.2, 0.16, 0.12]";
    for shape in [
        format!("shape = \"wedge\"\n{at}"),
        "shape = \"cone\"\ncenter = [0.25, 0.3, 0.25]\nradius = 0.1\nheight = 0.2".into(),
        "shape = \"prism\"\nposition = [0.15, 0.4, 0.15]\nheight = 0.2\n\
         section = [[0, 0], [0.2, 0], [0.25, 0.1], [0.1, 0.2], [-0.05, 0.1]]"
            .into(),
    ] {
        for l0 in [0.01, 0.0125, 0.02] {
            let most = crowding(&shape, l0);
            println!("{most}");
            assert!(most < 0.6, "{most} at {l0} m of {shape}");
        }
    }
}

#[test]
fn the_section_of_the_hull_has_its_metacentre_where_theory_has_it() {
    // GM = KB + BM - KG = 2 T / 3 + b^2 / (6 T) - 2 D / 3 with b = 2 T
    let draft = 0.2 * 0.5_f64.sqrt();
    let metacentric = 2.0 / 3.0 * draft + 4.0 * draft / 6.0 - 2.0 / 3.0 * 0.2;
    let (area, lever) = wetted(1e-4, 0.0, draft);
    assert!((area / (draft * draft) - 1.0).abs() < 1e-3);
    assert!((-lever / 1e-4 / metacentric - 1.0).abs() < 1e-3, "{} {metacentric}", -lever / 1e-4);
}

/// A body with four round legs.
fn tetrapod() -> Triangles {
    let legs =
        [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]].map(|d| DVec3::from(d.map(f64::from)).normalize());
    let reach = |n: DVec3| 0.035 + 0.065 * legs.iter().map(|d| (12.0 * (n.dot(*d) - 1.0)).exp()).sum::<f64>();
    ball(1.0, 4).into_iter().map(|t| t.map(|n| reach(n) * n)).collect()
}

/// A box of 0.2 m with a sealed cavity of 0.12 m, turned, in a tank of still water: as a body, an obstacle and a moving wall.
#[test]
fn a_sealed_cavity_is_empty_unless_water_is_put_into_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let [hull, cavity] = [0.2, 0.12].map(|edge| -> Triangles {
        cuboid(DVec3::splat(edge)).into_iter().map(|t| t.map(|v| v - 0.5 * edge)).collect()
    });
    let inside_out = cavity.iter().map(|&[a, b, c]| [a, c, b]);
    let path = file(&folder, "hull.stl", &stl(&hull.iter().copied().chain(inside_out).collect()));
    let open = file(&folder, "solid.stl", &stl(&hull));
    let tank = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n[contact]\nspring = 1e4\n\
                [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.5]\nopen = [\"z_max\"]\n[fluid]\n";
    let [around, all] = [
        "[[fluid.fill]]\nseed = [0.01, 0.01, 0.01]\nlevel = 0.4\n",
        "[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.4]\n",
    ];
    // Ballast up to the middle, meant for the cavity alone though it is as wide as the walls are thick on top of it.
    let ballast = "[[fluid.block]]\nmin = [0.12, 0.12, 0.12]\nmax = [0.28, 0.28, 0.2]\n";
    let solid = |table: &str, file: &str, more: &str| {
        // Its middle is the file's origin.
        let at = if table == "body" { "center" } else { "position" };
        format!(
            "[[{table}]]\nname = \"b\"\nshape = \"mesh\"\nfile = \"{file}\"\n{at} = [0.2, 0.2, 0.2]\n\
             orientation = {{ axis = [1, 2, 0], angle_deg = 10 }}\n{more}\n"
        )
    };
    let (in_all, block) = (0.064, 0.008);
    let body = "density = 600\ndisplaces_fluid = true";
    let moves = "motion = [[0, 0, 0, 0], [1, 0, 0, 0.05]]";
    for (table, more) in [("body", body), ("obstacle", ""), ("moving_wall", moves)] {
        let volume = |water: &[&str], file: &str| {
            let text = [tank, &water.concat(), &solid(table, file, more)].concat();
            let scene = Scene::build(&case(&text)).unwrap_or_else(|e| panic!("{table}: {e}"));
            let told = scene.notes.iter().any(|note| note.contains("sealed cavity"));
            (scene.groups.fluid as f64 * 0.02_f64.powi(3), told)
        };
        for (water, told) in [(around, table == "body"), (all, true)] {
            let (left, note) = volume(&[water], &path);
            println!("{table}: {left:.6} m3 of {:.6}", in_all - block);
            // Up to the last of those that stand half in a wall; a flooded one has 0.0017 more.
            assert!((left - (in_all - block)).abs() < 1e-4 && note == told, "{table}: {left}, {note}");
            assert!(!volume(&[water], &open).1, "{table}");
            // What lies in the cavity alone stays, whichever comes first.
            for both in [[ballast, water], [water, ballast]] {
                // A fill takes no body for a wall, and a block takes free cells alone.
                if table == "body" && both[1] == ballast {
                    continue;
                }
                let (more, _) = volume(&both, &path);
                println!("{table}: {:.6} m3 of ballast", more - left);
                assert!((more - left - 0.5 * 0.12_f64.powi(3)).abs() < 1e-4, "{table}: {more} {left}");
            }
        }
    }
    // Of 1200 kg/m3 it weighs 7.5 kg, and displaces 8 with its cavity.
    let case_file = folder.path().join("hull.toml");
    let body = "density = 1200\ndisplaces_fluid = true";
    std::fs::write(&case_file, [tank, around, &solid("body", &path, body)].concat()).expect("a case");
    let plan = ran(&["plan", &case_file.to_string_lossy(), "--json"]);
    let buoyancy = &json(&plan.out)["bodies"][0]["buoyancy"];
    let kilograms = buoyancy["all_under_kg"].as_f64().expect(&plan.err);
    assert!(buoyancy["floats"] == true && (kilograms - 8.0).abs() < 0.1, "{buoyancy}");
    // Along the lattice all cells on one side of a wall are as deep in it: neither side counts for the other.
    for off in [0.004, 0.006] {
        let upright = format!(
            "[[body]]\nname = \"b\"\nshape = \"mesh\"\nfile = \"{path}\"\ncenter = [{0}, {0}, {0}]\n{body}\n",
            0.2 + off
        );
        let scene = Scene::build(&case(&[tank, all, &upright].concat())).expect("it builds");
        let left = scene.groups.fluid as f64 * 0.02_f64.powi(3);
        assert!((left - (in_all - block)).abs() < 1.5e-4, "{off}: {left}");
    }
}

/// Eight of them fall into a pit.
#[test]
fn a_heap_of_tetrapods_comes_to_rest() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = file(&folder, "tetrapod.stl", &stl(&tetrapod()));
    let mut text = String::from(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 4\ngravity = [0, 0, -9.80665]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 1.2]\nopen = [\"z_max\"]\n\
         [contact]\nspring = 2e5\nfriction = 0.5\nrestitution = 0.2\n",
    );
    for k in 0..8 {
        let (x, y) = (0.12 + 0.16 * f64::from(k % 2), 0.12 + 0.16 * f64::from(k / 2 % 2));
        let z = 0.13 + 0.25 * f64::from(k / 4);
        text += &format!(
            "[[body]]\nname = \"unit {k}\"\nshape = \"mesh\"\nfile = \"{path}\"\ncenter = [{x}, {y}, {z}]\ndensity = 2300\n\
             orientation = {{ axis = [1, {k}, 2], angle_deg = {} }}\n",
            37 * k
        );
    }
    let mut dry = Dry::new(&text);
    let start: Vec<DVec3> = dry.solids.poses().iter().map(|p| p.position).collect();
    dry.run(2.0);
    let before: Vec<DVec3> = dry.solids.poses().iter().map(|p| p.position).collect();
    let poses = dry.run(2.5);
    let fastest =
        poses.iter().map(|p| p.velocity.length() + 0.1 * p.angular_velocity.length()).fold(0.0, f64::max);
    let crept = poses.iter().zip(&before).map(|(p, b)| p.position.distance(*b)).fold(0.0, f64::max);
    let highest = poses.iter().map(|p| p.position.z).fold(0.0, f64::max);
    let lowest = poses.iter().map(|p| p.position.z).fold(1.0, f64::min);
    println!("fastest {fastest:.2e} m/s, crept {crept:.2e} m in 0.5 s, {lowest:.3} to {highest:.3} m high");
    assert!(fastest < 0.02 && crept < 2e-3, "{fastest} m/s, {crept} m");
    // They fell, the upper ones lie on the lower ones, and none went through a wall.
    assert!(poses.iter().zip(&start).all(|(p, s)| p.position.z < s.z));
    assert!(lowest > 0.03 && highest > lowest + 0.05);
    assert!(poses.iter().all(|p| (p.position.x - 0.2).abs() < 0.18 && (p.position.y - 0.2).abs() < 0.18));
}
