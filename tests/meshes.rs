//! Bodies from STL and OBJ files: against the analytic shapes, apart from each other, afloat; what a file must be.

use crate::cli::ran;
use crate::common::case;
use crate::common::dry::{Dry, G};
use glam::{DQuat, DVec3, EulerRot};
use seixo::scene::{Drive, Scene, Solid};
use seixo::{Error, Options, Processor, Simulation};
use std::fmt::Write;
use tempfile::TempDir;

pub type Triangles = Vec<[DVec3; 3]>;

/// A box with its lower corner in the origin, triangles turned outwards.
pub fn cuboid(size: DVec3) -> Triangles {
    let corner = |k: usize| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2 & 1) as f64) * size;
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        .map(|q| q.map(corner));
    quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}

/// A ball about the origin: an octahedron, each triangle of which is cut in four `times`.
pub fn ball(radius: f64, times: u32) -> Triangles {
    let mut out: Triangles = vec![];
    for signs in
        [[1, 1, 1], [-1, 1, 1], [1, -1, 1], [-1, -1, 1], [1, 1, -1], [-1, 1, -1], [1, -1, -1], [-1, -1, -1]]
    {
        let [a, b, c] = [0, 1, 2].map(|k| DVec3::AXES[k] * f64::from(signs[k]));
        out.push(if signs.iter().product::<i32>() > 0 { [a, b, c] } else { [a, c, b] });
    }
    for _ in 0..times {
        let cut = |[a, b, c]: [DVec3; 3]| {
            let [ab, bc, ca] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        out = out.into_iter().flat_map(cut).collect();
    }
    out.into_iter().map(|t| t.map(|v| radius * v)).collect()
}

pub fn stl(triangles: &Triangles) -> String {
    let mut out = String::from("solid it\n");
    for t in triangles {
        out += "facet normal 0 0 0\nouter loop\n";
        t.iter().for_each(|v| writeln!(out, "vertex {} {} {}", v.x, v.y, v.z).expect("written"));
        out += "endloop\nendfacet\n";
    }
    out + "endsolid it\n"
}

fn obj(triangles: &Triangles) -> String {
    let mut out = String::new();
    triangles.iter().flatten().for_each(|v| writeln!(out, "v {} {} {}", v.x, v.y, v.z).expect("written"));
    (0..triangles.len())
        .for_each(|k| writeln!(out, "f {} {} {}", 3 * k + 1, 3 * k + 2, 3 * k + 3).expect("written"));
    out
}

fn binary(header: &[u8], triangles: &Triangles) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        bytes.extend(triangle.iter().flat_map(|v| v.as_vec3().to_array()).flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

/// A file in a folder that goes with the test.
pub fn file(folder: &TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("written");
    path.display().to_string()
}

fn body(scene: &Scene) -> (&Solid, f64, DVec3) {
    let solid = &scene.solids[0];
    let Drive::Free(free) = &solid.drive else { panic!("it moves freely") };
    (solid, free.mass, free.inertia)
}

#[test]
fn a_box_from_a_file_is_the_box() {
    let folder = tempfile::tempdir().expect("a folder");
    let size = DVec3::new(0.2, 0.3, 0.4);
    let inside_out = cuboid(1e3 * size).into_iter().map(|[a, b, c]| [a, c, b]).collect();
    let files =
        [file(&folder, "box.stl", &stl(&cuboid(1e3 * size))), file(&folder, "box.obj", &obj(&inside_out))];
    let scene = |keys: &str| {
        let text = format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1\n[[body]]\nname = \"it\"\n{keys}\ncenter = [1, 2, 3]\n\
             density = 500\n[contact]\nspring = 1e5\n"
        );
        Scene::build(&case(&text)).expect("builds")
    };
    let analytic = scene("size = [0.2, 0.3, 0.4]");
    let (own, mass, inertia) = body(&analytic);
    for path in files {
        let from_file = scene(&format!("shape = \"mesh\"\nfile = \"{path}\"\nscale = 0.001"));
        let (solid, m, i) = body(&from_file);
        assert!((m / mass - 1.0).abs() < 1e-6, "{path}: {m} kg for {mass} kg");
        assert!((i / inertia - 1.0).abs().max_element() < 1e-6, "{path}: {i} for {inertia}");
        assert_eq!(solid.position, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(solid.wall_offset.len(), own.wall_offset.len());
        assert_eq!(solid.dummy_offset.len(), own.dummy_offset.len());
        for at in &solid.wall_offset {
            let nearest = own.wall_offset.iter().map(|o| o.distance(*at)).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-6, "{path}: no particle of the box at {at}");
        }
        for k in 0..200 {
            let q = 0.3
                * DVec3::from_array(
                    [0.618_034, 0.754_877, 0.569_84].map(|n| 2.0 * (f64::from(k) * n).fract() - 1.0),
                );
            let (have, want) = (solid.shape.distance(q).0, own.shape.distance(q).0);
            assert_eq!(have < 0.0, want < 0.0, "{q}");
            assert!(want < 0.0 || (have - want).abs() < 1e-6, "{q}: {have} {want}");
        }
        let sum: DVec3 = solid.wall_area.iter().sum();
        assert!(sum.length() < 1e-12, "{sum}");
    }
}

#[test]
fn volume_inertia_and_particles_of_a_ball_from_a_file_are_those_of_the_ball() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = file(&folder, "ball.stl", &stl(&ball(0.1, 4)));
    let text = format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n[[body]]\nname = \"it\"\nshape = \"mesh\"\nfile = \"{path}\"\n\
         center = [0, 0, 0]\ndensity = 1000\n[contact]\nspring = 1e5\n"
    );
    let scene = Scene::build(&case(&text)).expect("builds");
    let (solid, mass, inertia) = body(&scene);
    let exact = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
    assert!((mass / exact - 1.0).abs() < 0.01, "{mass} {exact}");
    assert!((inertia / (0.4 * exact * 0.01) - 1.0).abs().max_element() < 0.015, "{inertia}");
    for (at, to) in solid.wall_offset.iter().zip(&solid.wall_to_surface) {
        assert!((at.length() - 0.09).abs() < 2e-3, "{at}");
        assert!(((*at + *to).length() - 0.1).abs() < 1e-3);
    }
    // as many as the layer's volume holds, within a tenth
    let layer = 4.0 / 3.0 * std::f64::consts::PI * (0.1_f64.powi(3) - 0.08_f64.powi(3)) / 0.02_f64.powi(3);
    let count = solid.wall_offset.len() as f64;
    assert!((count / layer - 1.0).abs() < 0.15, "{count} {layer}");
    let moment: DVec3 = (solid.wall_offset.iter().zip(&solid.wall_to_surface).zip(&solid.wall_area))
        .map(|((x, s), a)| (*x + *s) * *a)
        .sum();
    assert!((moment / solid.shape.volume() - 1.0).abs().max_element() < 1e-9, "{moment}");
}

#[test]
fn layers_below_a_round_surface_lie_even() {
    let folder = TempDir::new().unwrap();
    let path = file(&folder, "ball.stl", &stl(&ball(0.15, 5)));
    let l0 = 0.0125;
    let scene = Scene::build(&case(&format!(
        "[run]\nspacing = {l0}\ntime_step = 1e-4\nend = 1.0\n[contact]\nspring = 1e4\n\
         [[body]]\nname = \"ball\"\nshape = \"mesh\"\nfile = \"{path}\"\ncenter = [0, 0, 0]\ndensity = 500\n"
    )))
    .expect("the scene builds");
    let (solid, ..) = body(&scene);
    let nearest = |x: DVec3| {
        solid.wall_offset.iter().map(|w| w.distance(x)).filter(|d| *d > 1e-9).fold(f64::INFINITY, f64::min)
            / l0
    };
    let apart: Vec<f64> = solid.wall_offset.iter().map(|x| nearest(*x)).collect();
    let least = apart.iter().copied().fold(f64::INFINITY, f64::min);
    // Places that are nobody's: how far the nearest particle is from anywhere on the sphere of the layer.
    let golden = std::f64::consts::PI * (3.0 - 5_f64.sqrt());
    let farthest = (0..4000)
        .map(|k| {
            let (z, turn) = (1.0 - (2.0 * f64::from(k) + 1.0) / 4000.0, golden * f64::from(k));
            let r = (1.0 - z * z).sqrt();
            nearest((0.15 - 0.5 * l0) * DVec3::new(r * turn.cos(), r * turn.sin(), z))
        })
        .fold(0.0, f64::max);
    println!("{least:.3} to the nearest, {farthest:.3} from anywhere, {} particles", apart.len());
    // Lattices have 1 and 0.71, hexagons of as many particles 1.07 and 0.62; what a lattice leaves below a ball 0.62 and 0.85.
    assert!(least > 0.75 && farthest < 0.82, "{least}, {farthest}");
    for x in &solid.dummy_offset {
        let depth = (0.15 - x.length()) / l0;
        assert!((depth.fract() - 0.5).abs() < 0.1 && depth < 3.0, "a dummy {depth} spacings deep");
    }
    // (The lattice itself has 4 % fewer places so close to this surface.)
    let share = apart.len() as f64 / (4.0 * std::f64::consts::PI * ((0.15 - 0.5 * l0) / l0).powi(2));
    assert!((share - 1.0).abs() < 0.06, "{share} of the particles of a lattice");
}

/// Momentum along x of water that slides down a slope (of its rise over its run) until `end` [s], over that which its weight gives it.
fn slid(simulation: &mut Simulation, end: f64, slope: f64) -> f64 {
    while simulation.time < end {
        simulation.step().expect("it slides");
    }
    let momentum = simulation.backend.monitor().expect("a monitor").momentum[0];
    let mass = simulation.groups.fluid as f64 * simulation.params.particle_mass();
    momentum / (mass * 9.81 * slope / (1.0 + slope * slope) * simulation.time)
}

#[test]
fn water_slides_down_a_terrain_as_fast_as_its_weight_says() {
    let folder = TempDir::new().unwrap();
    let slope = |x: f64, y: f64| DVec3::new(x, y, 0.7 - 0.2 * x);
    let [a, b, c, d] = [slope(-0.2, -0.2), slope(3.0, -0.2), slope(3.0, 0.4), slope(-0.2, 0.4)];
    let path = file(&folder, "slope.stl", &stl(&vec![[a, b, c], [a, c, d]]));
    let mut simulation = crate::common::simulation(&case(&format!(
        "[run]\nspacing = 0.025\ntime_step = 3e-3\nadaptive = true\nend = 0.5\ngravity = [0, 0, -9.81]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [2.4, 0.175, 1.0]\nopen = [\"z_max\"]\nperiodic = [\"y\"]\n\
         [[obstacle]]\nname = \"slope\"\nshape = \"terrain\"\nfile = \"{path}\"\nposition = [0, 0, 0]\n\
         [fluid]\nwall_friction = 0\njitter = 0.02\n[[fluid.shape]]\nshape = \"box\"\nsize = [0.6, 0.175, 0.1]\n\
         center = [0.5098, 0.0875, 0.65]\norientation = {{ axis = [0, 1, 0], angle_deg = 11.3099 }}\n"
    )));
    let along = slid(&mut simulation, 0.5, 0.2);
    println!("{along:.4} of the momentum without friction");
    // 0.79 if layers below a slope stood as steps.
    assert!((along - 1.0).abs() < 0.06, "{along}");
}

#[test]
fn a_mesh_is_cut_at_a_seam_that_it_reaches_over_and_has_its_end_at_one_where_it_ends() {
    let folder = TempDir::new().unwrap();
    // A box of 0.08 m, `wide` across, from y = `from` on, on the floor or in the middle of 0.16 m of water.
    let force = |wide: f64, from: f64, z: f64| {
        let triangles = cuboid(DVec3::new(0.08, wide, 0.08));
        let path = file(&folder, &format!("{wide}.stl"), &stl(&triangles));
        let mut simulation = crate::common::simulation(&case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\n[fluid]\n\
             [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 0.2, 0.16]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.2, 0.2, 0.2]\nopen = [\"z_max\"]\nperiodic = [\"y\"]\n\
             [[obstacle]]\nname = \"o\"\nshape = \"mesh\"\nfile = \"{path}\"\nposition = [0.06, {from}, {z}]\n\
             [[gauge.force]]\nname = \"f\"\non = \"o\"\n"
        )));
        for _ in 0..3 {
            simulation.step().expect("a step");
        }
        let read = simulation.gauges().expect("a force");
        DVec3::new(read[0].1, read[1].1, read[2].1)
    };
    let load = 1000.0 * 9.81 * 0.08 * 0.08 * 0.2;
    let fits = force(0.2, 0.0, 0.0);
    println!("from side to side: {fits} N for {load} N");
    assert!((fits.z / -load - 1.0).abs() < 0.04 && fits.y.abs() < 1e-6 * load, "{fits} for {load} N");
    for over in [0.02, 0.1] {
        let f = force(0.2 + 2.0 * over, -over, 0.0);
        println!("{over} m over the seam: {f} N");
        assert!((f - fits).length() < 0.01 * load, "{over} m: {f} for {fits} N");
    }
    let middle = force(0.08, 0.06, 0.04);
    for from in [0.0, 0.12] {
        let end = force(0.08, from, 0.04);
        println!("from {from} m: {end} N, {middle} N in the middle");
        assert!(middle.z > 2.0 && (end - middle).length() < 2e-3 * middle.z, "{from} m: {end} {middle}");
    }
}

/// A vessel with this inside, open at the top, with walls and a floor of `thick` [m], turned by `turn` about the lower corner of its inside.
fn vessel(inside: DVec3, thick: f64, turn: DQuat) -> Triangles {
    let (low, high) = (DVec3::new(-thick, -thick, -thick), inside + DVec3::new(thick, thick, 0.0));
    let mut out: Triangles = cuboid(high - low).into_iter().map(|t| t.map(|v| v + low)).collect();
    let is_top = |t: &[DVec3; 3]| t.iter().all(|v| v.z > inside.z - 1e-9);
    out.retain(|t| !is_top(t));
    let mut hollow = cuboid(inside);
    hollow.retain(|t| !is_top(t));
    out.extend(hollow.into_iter().map(|[a, b, c]| [a, c, b]));
    let rim = |v: DVec3| {
        [v, DVec3::new(if v.x > 0.0 { high.x } else { low.x }, if v.y > 0.0 { high.y } else { low.y }, v.z)]
    };
    let corners =
        [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y].map(|c| rim(DVec3::Z * inside.z + c * inside));
    for k in 0..4 {
        let ([a, b], [c, d]) = (corners[k], corners[(k + 1) % 4]);
        out.extend([[a, b, d], [a, d, c]]);
    }
    out.into_iter().map(|t| t.map(|v| turn * v)).collect()
}

#[test]
fn layers_around_a_turned_vessel_close_at_its_edges_and_corners() {
    let folder = TempDir::new().unwrap();
    let (l0, inside) = (0.025, DVec3::new(0.33, 0.27, 0.24));
    let turn = DQuat::from_euler(EulerRot::ZYX, 0.6, 0.4, 0.25);
    let path = file(&folder, "vessel.stl", &stl(&vessel(inside, 0.2, turn)));
    let scene = Scene::build(&case(&format!(
        "[run]\nspacing = {l0}\ntime_step = 1e-4\nend = 1.0\n[contact]\nspring = 1e4\n\
         [[body]]\nname = \"vessel\"\nshape = \"mesh\"\nfile = \"{path}\"\ncenter = [0, 0, 0]\ndensity = 500\n"
    )))
    .expect("the scene builds");
    let (solid, ..) = body(&scene);
    let outside = inside + DVec3::new(0.4, 0.4, 0.2);
    let [whole, hollow] = [outside, inside].map(|v| v.element_product());
    let middle = (whole * (0.5 * outside - 0.2) - hollow * 0.5 * inside) / (whole - hollow);
    let at = |slots: std::ops::Range<usize>| {
        scene.position[slots].iter().map(move |x| turn.inverse() * *x + middle)
    };
    let all: Vec<DVec3> = at(solid.wall_slots.clone()).chain(at(solid.dummy_slots.clone())).collect();
    // Where the nearest place of the inside is, and how far.
    let nearest = |x: DVec3| x.clamp(DVec3::ZERO, inside);
    let mut seed = 0.0;
    let mut random = || {
        seed = (seed + 0.618_033_988_749_895_f64).fract();
        seed
    };
    for layer in 0..3 {
        let d = (f64::from(layer) + 0.5) * l0;
        let here = |x: &&DVec3| (x.distance(nearest(**x)) - d).abs() < 0.2 * l0 && x.z < 0.15;
        let (a, b, h) = (inside.x, inside.y, 0.15);
        let round = std::f64::consts::PI * d * ((a + b) + 2.0 * h) + 2.0 * std::f64::consts::PI * d * d;
        let share = all.iter().filter(here).count() as f64 * l0 * l0 / (a * b + 2.0 * (a + b) * h + round);
        let mut farthest: f64 = 0.0;
        for _ in 0..20_000 {
            let x = DVec3::new(random() * 0.5 - 0.1, random() * 0.45 - 0.1, random() * 0.25 - 0.1);
            let from = nearest(x);
            if x == from {
                continue;
            }
            let place = from + d * (x - from).normalize();
            farthest = all.iter().map(|p| p.distance(place)).fold(f64::INFINITY, f64::min).max(farthest);
        }
        println!("layer {layer}: {share:.3} of the particles, none within {:.3}", farthest / l0);
        assert!(
            (share - 1.0).abs() < 0.05 && farthest < 0.95 * l0,
            "layer {layer}: {share}, {}",
            farthest / l0
        );
    }
}

#[test]
fn water_slides_down_a_steep_ramp_as_fast_as_its_weight_says() {
    let folder = TempDir::new().unwrap();
    // Of 45 degrees, where a lattice has 0.7 of the places of a layer: a solid with sharp edges, and ground of small triangles.
    let [toe, top] = [DVec3::X, DVec3::Z];
    let beside = |v: DVec3| (v - 0.2 * DVec3::Y, v + 0.4 * DVec3::Y);
    let [(a, d), (b, e), (c, f)] = [DVec3::ZERO, toe, top].map(beside);
    let prism = vec![[a, b, c], [d, f, e], [a, e, b], [a, d, e], [b, f, c], [b, e, f], [c, d, a], [c, f, d]];
    let at = |k: u32, j: u32| {
        DVec3::new(0.05 * f64::from(k) - 0.2, 0.05 * f64::from(j) - 0.2, 1.2 - 0.05 * f64::from(k))
    };
    let squares = (0..24).flat_map(|k| (0..12).map(move |j| (k, j)));
    let ground = squares.flat_map(|(k, j)| {
        let [a, b, c, d] = [at(k, j), at(k + 1, j), at(k + 1, j + 1), at(k, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    for (shape, triangles) in [("mesh", prism), ("terrain", ground.collect())] {
        let path = file(&folder, &format!("{shape}.stl"), &stl(&triangles));
        let mut simulation = crate::common::simulation(&case(&format!(
            "[run]\nspacing = 0.025\ntime_step = 3e-3\nadaptive = true\nend = 0.3\ngravity = [0, 0, -9.81]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [1, 0.175, 1.4]\nopen = [\"z_max\"]\nperiodic = [\"y\"]\n\
             [[obstacle]]\nname = \"slope\"\nshape = \"{shape}\"\nfile = \"{path}\"\nposition = [0, 0, 0]\n\
             [fluid]\nwall_friction = 0\njitter = 0.02\n[[fluid.shape]]\nshape = \"box\"\nsize = [0.4, 0.175, 0.1]\n\
             center = [0.33536, 0.0875, 0.73536]\norientation = {{ axis = [0, 1, 0], angle_deg = 45 }}\n"
        )));
        let along = slid(&mut simulation, 0.3, 1.0);
        println!("{shape}: {along:.4} of the momentum without friction");
        // 0.75 on the lattice of the file's axes. (0.013 s of weight are lost at the start.)
        assert!((along - 1.0).abs() < 0.06, "{shape}: {along}");
    }
}

#[test]
fn a_ball_from_a_file_rolls_down_a_slope_with_five_sevenths_of_gravity() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = file(&folder, "ball.stl", &stl(&ball(0.1, 4)));
    let slope = 0.3_f64;
    let (along, down) = (G * slope.sin(), G * slope.cos());
    let mut dry = Dry::new(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ngravity = [{along}, 0, -{down}]\n\
         [[plane]]\nname = \"slope\"\ncenter = [1, 0, 0]\nnormal = [0, 0, 1]\nalong = [1, 0, 0]\nsize = [4, 1]\n\
         [[body]]\nname = \"it\"\nshape = \"mesh\"\nfile = \"{path}\"\ncenter = [0, 0, 0.1]\ndensity = 800\n\
         [contact]\nspring = 1e6\nrestitution = 0.5\nfriction = 0.6\n"
    ));
    let pose = dry.run(0.5)[0];
    let share = pose.velocity.x / 0.5 / along;
    assert!((share / (5.0 / 7.0) - 1.0).abs() < 0.05, "{share} of g sin a: {pose:?}");
    let slip = pose.velocity.x - 0.1 * pose.angular_velocity.y;
    assert!(slip.abs() < 0.05 * pose.velocity.x, "slips at {slip}");
    assert!((pose.position.z - 0.1).abs() < 2e-3, "{pose:?}");
}

#[test]
fn two_bodies_from_files_stay_apart_and_come_to_rest_on_each_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = file(&folder, "box.stl", &stl(&cuboid(DVec3::new(0.2, 0.2, 0.1))));
    for law in ["smooth\"\nfriction = 0.4\ndamping_ratio = 1", "paper\"\ndamping_ratio = 1"] {
        let mut dry = Dry::new(&format!(
            "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -9.8]\n\
             [tank]\nmin = [-0.5, -0.5, 0]\nmax = [0.5, 0.5, 1]\nopen = [\"z_max\"]\n\
             [[body]]\nname = \"low\"\nshape = \"mesh\"\nfile = \"{path}\"\ncenter = [0, 0, 0.06]\ndensity = 900\n\
             [[body]]\nname = \"high\"\nshape = \"mesh\"\nfile = \"{path}\"\ncenter = [0.02, 0.01, 0.19]\ndensity = 500\n\
             [contact]\nspring = 1e6\nlaw = \"{law}\n"
        ));
        let poses = dry.run(1.5);
        let (low, high) = (poses[0], poses[1]);
        let gap = high.position.z - low.position.z - 0.1;
        let (least, most) = if law.starts_with("smooth") { (-1e-3, 1e-3) } else { (-0.02, 0.02) };
        assert!(gap > least && gap < most, "{law}: {gap} m apart");
        let floor = low.position.z - 0.05;
        assert!(floor > least && floor < most, "{law}: {floor} m above the floor");
        let speed = low.velocity.length() + high.velocity.length();
        assert!(speed < 0.02, "{law}: {low:?} {high:?}");
    }
}

#[test]
fn a_hull_from_a_file_floats_at_its_draft() {
    let folder = tempfile::tempdir().expect("a folder");
    // A barge: its section is a trapezium, 0.24 m wide on deck and 0.16 m at the bottom, 0.08 m high.
    let hull: Triangles = cuboid(DVec3::new(0.24, 0.16, 0.08))
        .into_iter()
        .map(|t| {
            t.map(|v| if v.z == 0.0 { DVec3::new(0.12 + (v.x - 0.12) * 2.0 / 3.0, v.y, 0.0) } else { v })
        })
        .collect();
    let path = file(&folder, "hull.stl", &stl(&hull));
    let case = case(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 2\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.28, 0.16]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.28, 0.36]\nopen = [\"z_max\"]\n\
         [[body]]\nname = \"hull\"\nshape = \"mesh\"\nfile = \"{path}\"\ncenter = [0.2, 0.14, 0.17]\ndensity = 500\n\
         displaces_fluid = true\nlocked = [\"x\", \"y\", \"rotation_z\"]\n[contact]\nspring = 1e5\nrestitution = 0.3\n"
    ));
    let options = Options { processor: Processor::Cpu, ..Options::default() };
    let mut sim = Simulation::open(&case, &options).expect("opens");
    let (mut height, mut tilt, mut count) = (0.0, 0.0_f64, 0.0);
    sim.run_until(0.65, |sim, _| {
        if sim.time > 0.35 {
            let pose = sim.solids().next().expect("the hull").pose;
            height += pose.position.z;
            tilt = tilt.max((pose.orientation * DVec3::Z).angle_between(DVec3::Z));
            count += 1.0;
        }
        std::ops::ControlFlow::Continue(())
    })
    .expect("floats");
    let Drive::Free(free) = &sim.scene.solids[0].drive else { panic!("free") };
    assert!((free.mass - 500.0 * 0.016 * 0.16).abs() < 1e-6, "{} kg", free.mass);
    // Half of the section is wetted, 0.16 d + d^2 / 2 = 0.008; the metacentre lies 0.07 m above the centre of mass.
    let draft = -0.16 + (0.0256_f64 + 0.016).sqrt();
    let water = (sim.groups.fluid as f64) * 0.02_f64.powi(3);
    let level = (water + free.mass / 1000.0) / (0.4 * 0.28);
    // The centroid of the trapezium above its bottom.
    let centroid = 0.08 / 3.0 * (2.0 * 0.24 + 0.16) / 0.4;
    let have = level - (height / count - centroid);
    println!("draft {have:.4} m for {draft:.4} m, tilted by {tilt:.3} at most");
    assert!((have - draft).abs() < 0.3 * 0.02, "{have} m for {draft} m");
    assert!(tilt < 0.15, "tilted by {tilt}");
}

#[test]
fn what_is_wrong_with_a_file_is_said_with_the_key_and_the_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let solid = cuboid(DVec3::splat(0.2));
    let open: Triangles = solid[..11].to_vec();
    let mut turned = solid.clone();
    turned[3].swap(1, 2);
    let thin = cuboid(DVec3::new(0.2, 0.2, 0.01));
    let huge = cuboid(DVec3::splat(100.0));
    let beside = |off: f64, size: f64| {
        cuboid(DVec3::splat(size)).into_iter().map(move |t| t.map(|v| v + DVec3::splat(off)))
    };
    let overlapping: Triangles = solid.iter().copied().chain(beside(0.1, 0.2)).collect();
    let nested: Triangles = solid.iter().copied().chain(beside(0.05, 0.1)).collect();
    let mut inside_out = overlapping[..12].to_vec();
    inside_out.extend(beside(0.3, 0.1).map(|[a, b, c]| [a, c, b]));
    let twice: Triangles = solid.iter().copied().chain([solid[4]]).collect();
    // With a face in common, and with an edge.
    let next = |off: DVec3| solid.iter().map(move |t| t.map(|v| v + off));
    let face: Triangles = solid.iter().copied().chain(next(0.2 * DVec3::X)).collect();
    let edge: Triangles = solid.iter().copied().chain(next(DVec3::new(0.2, 0.2, 0.0))).collect();
    for (name, text, key, parts) in [
        ("open.stl", stl(&open), "body.0.file", &["open", "3 edges", "triangle", "watertight"][..]),
        ("turned.stl", stl(&turned), "body.0.file", &["triangles", "and 4", "opposite ways"]),
        ("twice.stl", stl(&twice), "body.0.file", &["5 and 13", "same corners", "remove the duplicate"]),
        ("face.stl", stl(&face), "body.0.file", &["triangles", "unite the parts"]),
        ("edge.stl", stl(&edge), "body.0.file", &["of 4 that meet in one edge", "unite the parts"]),
        ("thin.stl", stl(&thin), "body.0.file", &["1.00e-2 m thin", "run.spacing"]),
        ("huge.stl", stl(&huge), "body.0.scale", &["100 m long", "millimetres", "scale = 0.001"]),
        ("overlapping.stl", stl(&overlapping), "body.0.file", &["lie in each other", "m3 count twice"]),
        ("nested.stl", stl(&nested), "body.0.file", &["encloses 8.00e-3 m3", "count twice"]),
        ("inside_out.stl", stl(&inside_out), "body.0.file", &["m3 are turned inside out"]),
        ("none.stl", "solid it\nendsolid it\n".into(), "body.0.file", &["no triangle"]),
        (
            "not.stl",
            "solid it\nfacet normal 0 0 0\nouter loop\nvertex a b c\n".into(),
            "body.0.file",
            &["STL"],
        ),
        ("line.obj", "v 0 0 0\nv 1 0 0\nv 0 x 0\nf 1 2 3\n".into(), "body.0.file", &["line 3", "OBJ"]),
        ("far.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n".into(), "body.0.file", &["OBJ"]),
        ("it.ply", "ply\n".into(), "body.0.file", &[".ply", "STL or OBJ"]),
    ] {
        let path = file(&folder, name, &text);
        let text = format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n[[body]]\nname = \"it\"\nshape = \"mesh\"\nfile = \"{path}\"\n\
             center = [0, 0, 0]\ndensity = 500\n[contact]\nspring = 1e5\n"
        );
        match Scene::build(&case(&text)) {
            Err(Error::Case(why)) => {
                let problem = &why.problems[0];
                assert_eq!(problem.key, key, "{name}: {why}");
                let said = why.to_string();
                assert!(parts.iter().all(|p| said.contains(p)), "{name}: {said}");
                assert!(!problem.remedy.is_empty(), "{name}: {said}");
            }
            other => panic!("{name}: expected a refusal, got {:?}", other.map(|_| ())),
        }
    }
    // A hollow one is whole, and so are two that touch.
    let hollow = solid.iter().copied().chain(beside(0.05, 0.1).map(|[a, b, c]| [a, c, b])).collect();
    let touching = solid
        .iter()
        .copied()
        .chain(cuboid(DVec3::new(-0.2, -0.2, -0.2)).into_iter().map(|[a, b, c]| [a, c, b]));
    for (name, solid, volume) in [("hollow.stl", hollow, 0.007), ("touching.stl", touching.collect(), 0.016)]
    {
        let path = file(&folder, name, &stl(&solid));
        let mesh = seixo::shape::Mesh::open(&path, 1.0).unwrap_or_else(|e| panic!("{name}: {}", e.message));
        assert!((seixo::shape::Geometry::volume(mesh) / volume - 1.0).abs() < 1e-6, "{name}");
    }
    let missing = case(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n[[body]]\nname = \"it\"\nshape = \"mesh\"\n\
         file = \"/no/such/hull.stl\"\ncenter = [0, 0, 0]\ndensity = 500\n[contact]\nspring = 1e5\n",
    );
    let why = Scene::build(&missing).expect_err("refused").to_string();
    assert!(why.contains("/no/such/hull.stl"), "{why}");
}

/// The scene of a body from the file `path`.
fn alone(path: &str) -> Scene {
    let text = format!(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1\n[[body]]\nname = \"it\"\nshape = \"mesh\"\nfile = \"{path}\"\n\
         center = [0, 0, 0]\ndensity = 500\n[contact]\nspring = 1e5\n"
    );
    Scene::build(&case(&text)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// An L, its ends faces of seven corners, of which one lies on a straight side.
#[test]
fn a_face_that_is_not_convex_is_cut_whichever_corner_it_begins_with() {
    let folder = tempfile::tempdir().expect("a folder");
    let corners = [[0.0, 0.0], [0.1, 0.0], [0.4, 0.0], [0.4, 0.2], [0.2, 0.2], [0.2, 0.4], [0.0, 0.4]];
    for first in 0..7 {
        let mut text = String::new();
        for y in [0.0, 0.2] {
            corners.iter().for_each(|[x, z]| writeln!(text, "v {x} {y} {z}").expect("written"));
        }
        let ring: Vec<usize> = (0..7).map(|k| (first + k) % 7 + 1).collect();
        let list = |ring: &mut dyn Iterator<Item = usize>| ring.map(|k| format!(" {k}")).collect::<String>();
        let (near, far) = (list(&mut ring.iter().copied()), list(&mut ring.iter().rev().map(|k| k + 7)));
        writeln!(text, "f{near}\nf{far}").expect("written");
        for k in 1..=7 {
            let next = k % 7 + 1;
            writeln!(text, "f {next} {k} {} {}", k + 7, next + 7).expect("written");
        }
        let scene = alone(&file(&folder, &format!("l{first}.obj"), &text));
        let (_, mass, _) = body(&scene);
        assert!((mass / (500.0 * 0.12 * 0.2) - 1.0).abs() < 1e-9, "from {first}: {mass} kg");
    }
}

#[test]
fn coordinates_of_a_site_are_read_to_their_last_digit() {
    let folder = tempfile::tempdir().expect("a folder");
    let away = DVec3::new(453_123.127, 5_412_345.303, 12.5);
    let there: Triangles = cuboid(DVec3::splat(0.2)).into_iter().map(|t| t.map(|v| v + away)).collect();
    for path in [file(&folder, "site.obj", &obj(&there)), file(&folder, "site.stl", &stl(&there))] {
        let scene = alone(&path);
        assert!((body(&scene).1 / 4.0 - 1.0).abs() < 1e-6, "{path}: {} kg", body(&scene).1);
        assert!(!scene.notes.iter().any(|n| n.contains("single precision")), "{:?}", scene.notes);
    }
    // A binary file has no more than single precision, half a metre there: places that it can tell are told of.
    for (edge, noted) in [(1.0, true), (0.0, false)] {
        let there: Triangles =
            cuboid(DVec3::ONE).into_iter().map(|t| t.map(|v| v + edge * away.trunc())).collect();
        let path = file(&folder, "binary.stl", "");
        std::fs::write(&path, binary(b"made by hand", &there)).expect("written");
        let notes = alone(&path).notes;
        let told = notes.iter().any(|n| n.contains("binary.stl") && n.contains("steps of 6.5e-1 m"));
        assert_eq!(told, noted, "{notes:?}");
    }
}

#[test]
fn a_file_that_its_steps_spoil_is_refused_with_them_and_gauges_on_it_with_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let away = DVec3::new(453_123.0, 5_412_345.0, 12.0);
    let there: Triangles = cuboid(DVec3::splat(0.2)).into_iter().map(|t| t.map(|v| v + away)).collect();
    let path = file(&folder, "binary.stl", "");
    std::fs::write(&path, binary(b"made by hand", &there)).expect("written");
    let text = format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n\
         [tank]\nmin = [453123, 5412345, 12]\nmax = [453124, 5412346, 13]\n\
         [fluid]\n[[fluid.block]]\nmin = [453123, 5412345, 12]\nmax = [453124, 5412346, 12.5]\n\
         [[obstacle]]\nname = \"it\"\nshape = \"mesh\"\nfile = \"{path}\"\n\
         [gauge]\nevery = 0.1\n[[gauge.pressure]]\nname = \"p\"\npoint = [453123.1, 5412345.1, 12.2]\n"
    );
    let Err(Error::Case(why)) = Scene::build(&case(&text)) else { panic!("expected a refusal") };
    assert_eq!(why.problems.len(), 1, "{why}");
    let problem = &why.problems[0];
    assert_eq!(problem.key, "obstacle.0.file");
    let starts =
        "a binary STL file has single precision, steps of 6.5e-1 m at its coordinates of up to 5412345 m";
    assert!(problem.remedy.starts_with(starts) && problem.remedy.contains("even so"), "{}", problem.remedy);
}

#[test]
fn an_stl_file_may_be_written_in_any_of_the_usual_ways() {
    let folder = tempfile::tempdir().expect("a folder");
    let solid = cuboid(DVec3::splat(0.2));
    let whole = stl(&solid);
    // Each face a solid of its own, as CAD programs write named faces.
    let faces: String = solid.chunks(2).map(|face| stl(&face.to_vec())).collect();
    let nameless: String = whole
        .lines()
        .map(|l| if l.contains("solid") { l.split_whitespace().next().unwrap_or(l) } else { l })
        .flat_map(|l| [l, "\n"])
        .collect();
    for (name, bytes) in [
        ("whole.stl", whole.clone().into_bytes()),
        ("faces.stl", faces.into_bytes()),
        ("nameless.stl", nameless.into_bytes()),
        ("marked.stl", format!("\u{feff}{whole}").into_bytes()),
        ("shouted.stl", whole.to_uppercase().into_bytes()),
        ("windows.stl", whole.replace('\n', "\r\n").into_bytes()),
        ("binary.stl", binary(b"made by hand", &solid)),
        ("binary-solid.stl", binary(b"solid made by a program that does not know better", &solid)),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("a file");
        let text = format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1\n[[body]]\nname = \"it\"\nshape = \"mesh\"\nfile = \"{}\"\n\
             center = [0, 0, 0]\ndensity = 500\n[contact]\nspring = 1e5\n",
            path.display()
        );
        let scene = Scene::build(&case(&text)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let mass = body(&scene).1;
        assert!((mass / (500.0 * 0.008) - 1.0).abs() < 1e-6, "{name}: {mass} kg");
    }
}

#[test]
fn results_keep_the_meshes_that_they_are_of() {
    let folder = tempfile::tempdir().expect("a folder");
    file(&folder, "box.stl", &stl(&cuboid(DVec3::splat(0.2))));
    let path = file(
        &folder,
        "my.toml",
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 0.02\n[[body]]\nname = \"it\"\nshape = \"mesh\"\nfile = \"box.stl\"\n\
         center = [0, 0, 0]\ndensity = 500\n[contact]\nspring = 1e5\n[output]\nevery = 0.01\n",
    );
    let root = folder.path().join("results");
    let shown = root.display().to_string();
    let run = ["run", &path, "-o", &shown, "--backend", "cpu", "-q"];
    let first = ran(&[&run[..], &["--steps", "10"]].concat());
    assert_eq!((first.code, first.err.as_str()), (0, ""));
    let copies = || {
        let found = std::fs::read_dir(root.join("meshes")).into_iter().flatten();
        let mut names: Vec<String> =
            found.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    };
    let copy = copies();
    assert_eq!(copy.len(), 1);
    assert!(copy[0].starts_with("box-") && copy[0].ends_with(".stl"), "{copy:?}");
    // The results are all there is: elsewhere, and with the mesh gone.
    let moved = folder.path().join("elsewhere/results");
    std::fs::create_dir(folder.path().join("elsewhere")).expect("a folder");
    std::fs::rename(folder.path().join("box.stl"), folder.path().join("gone.stl")).expect("moved");
    std::fs::rename(&root, &moved).expect("moved");
    let at = moved.display().to_string();
    // The case itself has no mesh any more; its results have.
    let gone = ran(&["run", &path, "-o", &at, "--resume", "--backend", "cpu"]);
    assert!(gone.code == 2 && gone.err.contains("the results have a copy: go on with"), "{}", gone.err);
    for args in [
        vec!["run", "--resume", &at, "--backend", "cpu", "-q"],
        vec!["render", &at, "--size", "64x48"],
        vec!["report", &at],
    ] {
        let done = ran(&args);
        assert_eq!(done.code, 0, "{args:?}: {}", done.err);
    }
    std::fs::rename(&moved, &root).expect("moved");
    std::fs::rename(folder.path().join("gone.stl"), folder.path().join("box.stl")).expect("moved");
    assert_eq!(copies(), copy);
    // The same case goes on with it; one whose mesh has changed is another case.
    let again = ran(&[&run[..], &["--resume"]].concat());
    assert_eq!((again.code, again.err.as_str()), (0, ""));
    file(&folder, "box.stl", &stl(&cuboid(DVec3::splat(0.25))));
    let other = ran(&[&run[..], &["--resume"]].concat());
    assert!(other.code == 2 && other.err.contains("body.0.file"), "{}", other.err);
    assert_eq!(ran(&[&run[..], &["--force"]].concat()).code, 0);
    assert!(copies().len() == 1 && copies() != copy, "{:?} after {copy:?}", copies());
}

#[test]
fn a_file_is_found_beside_its_case() {
    let folder = tempfile::tempdir().expect("a folder");
    file(&folder, "box.stl", &stl(&cuboid(DVec3::splat(0.2))));
    let path = file(
        &folder,
        "my.toml",
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1\n[[body]]\nname = \"it\"\nshape = \"mesh\"\nfile = \"box.stl\"\n\
         center = [0, 0, 0]\ndensity = 500\n[contact]\nspring = 1e5\n",
    );
    let loaded = seixo::case::file::load(path.as_ref(), None, &[]).expect("loads");
    assert!(std::path::Path::new(loaded.case.body[0].file.as_deref().expect("a file")).is_absolute());
    Scene::build(&loaded.case).expect("builds");
    assert!(loaded.text.contains("box.stl"), "{}", loaded.text);
}
