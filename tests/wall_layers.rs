//! Wall layers of prisms, wedges, cones and meshes: how evenly they lie, and what still water does to what they stand for.

use crate::common::{case, cpu_simulation};
use glam::{DVec2, DVec3};
use seixo::scene::Scene;
use seixo::shape::{Face, Geometry, Mesh, Particles, Polygon, Shape};
use std::f64::consts::{PI, TAU};
use std::time::{Duration, Instant};

/// A prism's section: `sides` corners on a circle.
fn round(sides: u32, radius: f64) -> Vec<[f64; 2]> {
    let corner = |k: u32| (TAU * f64::from(k) / f64::from(sides)).sin_cos();
    (0..sides).map(|k| (radius * corner(k).1, radius * corner(k).0)).map(|(x, z)| [x, z]).collect()
}

#[test]
fn layers_of_many_sided_sections_lie_as_even_as_those_of_a_disc() {
    for sides in [24, 37, 64, 200, 1000] {
        // Sides of 0.3 to 1.9 spacings, and far below one.
        for ratio in [0.3, 0.6, 0.99, 1.2, 1.4, 1.49, 1.51, 1.9] {
            let radius = 0.1;
            let ratio = if sides == 1000 { 0.03 * ratio } else { ratio };
            let l0 = 2.0 * radius * (PI / f64::from(sides)).sin() / ratio;
            if radius < 4.0 * l0 {
                continue;
            }
            let all = Polygon::new(&round(sides, radius), l0).particles(l0, 2, 3);
            let inner = radius * (PI / f64::from(sides)).cos() - 0.5 * l0;
            let due = TAU * inner / l0;
            assert!(
                (all.wall.len() as f64 - due).abs() < 1.1,
                "{sides}, {ratio}: {} for {due}",
                all.wall.len()
            );
            let mut around: Vec<DVec3> = all.wall;
            around.sort_by(|a, b| a.z.atan2(a.x).total_cmp(&b.z.atan2(b.x)));
            let next = around.iter().cycle().skip(1);
            let gaps: Vec<f64> = around.iter().zip(next).map(|(a, b)| a.distance(*b) / l0).collect();
            let [least, most] = [f64::min, f64::max].map(|of| gaps.iter().copied().reduce(of).unwrap_or(0.0));
            println!(
                "{sides} sides of {ratio} spacings: {} particles, {least:.3} to {most:.3} apart",
                gaps.len()
            );
            assert!(least > 0.95 && most < 1.05, "{sides} sides of {ratio}: {least} to {most}");
        }
    }
}

/// The faces of all particles, with the numbers of these.
fn faces(particles: &Particles) -> impl Iterator<Item = (usize, Face)> + '_ {
    (0..particles.wall.len()).flat_map(|k| particles.faces(k).map(move |face| (k, face)))
}

/// Sum A, sum x A^T and sum x_k (x cross A) against what they are of the surface, over its area and size.
fn off(particles: &Particles, volume: f64, plane: bool) -> f64 {
    let faces: Vec<(DVec3, DVec3)> =
        faces(particles).map(|(k, face)| (particles.wall[k] + face.way, face.area)).collect();
    let area: f64 = faces.iter().map(|face| face.1.length()).sum();
    let size = faces.iter().map(|face| face.0.length()).fold(0.0, f64::max);
    let mut most = faces.iter().map(|face| face.1).sum::<DVec3>().length() / area;
    for (k, e) in DVec3::AXES.into_iter().enumerate().filter(|(k, _)| !(plane && *k == 1)) {
        let push: DVec3 = faces.iter().map(|(x, a)| x[k] * *a).sum();
        let turn: DVec3 = faces.iter().map(|(x, a)| x[k] * x.cross(*a)).sum();
        most =
            most.max((push - volume * e).length() / (area * size)).max(turn.length() / (area * size * size));
    }
    most
}

#[test]
fn the_pressure_of_still_water_lifts_a_solid_and_does_not_turn_it() {
    let wedge = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.12]];
    let notched = [[0.0, 0.0], [0.3, 0.0], [0.3, 0.2], [0.2, 0.05], [0.0, 0.1]];
    for l0 in [0.02, 0.0137] {
        let flat =
            [&wedge[..], &notched, &round(30, 0.1)].map(|section| Shape::Polygon(Polygon::new(section, l0)));
        let solid =
            [Mesh::wedge(DVec3::new(0.2, 0.15, 0.12)), Mesh::cone(0.08, 0.16), Mesh::prism(&notched, 0.1)];
        let solid = solid.map(|mesh| Shape::Mesh(mesh.expect("a mesh")));
        let shapes =
            flat.into_iter().map(|shape| (shape, 2)).chain(solid.into_iter().map(|shape| (shape, 3)));
        for (shape, dimensions) in shapes {
            let particles = shape.particles(l0, dimensions, 3);
            let off = off(&particles, shape.volume(), dimensions == 2);
            assert!(off < 1e-12, "{}, {dimensions}D, {l0}: {off:.1e}", shape.name());
            // Where the pressure acts is on the surface; before the bisector of a corner it is on that: a hair aside another face is the nearest.
            for (k, face) in faces(&particles) {
                let x = particles.wall[k];
                let (name, at) = (shape.name(), x + face.way);
                let (distance, outward) = shape.distance(at);
                let aside = || shape.distance(at - 1e-4 * l0 * outward).1.dot(outward) < 1.0 - 1e-6;
                assert!(
                    distance.abs() < 1e-9 || distance < 0.0 && aside(),
                    "{name}, {dimensions}D, {l0}: {distance} m at {x}"
                );
            }
        }
    }
}

/// Mean torque about y of the water on the body of a case after some time [N m].
fn torque(text: &str, from: u32, to: u32) -> f64 {
    let case = case(text);
    let mut sim = cpu_simulation(&case, Scene::build(&case).unwrap_or_else(|e| panic!("{e}")));
    let mut sum = 0.0;
    for step in 0..to {
        sim.step().expect("still water is no trouble");
        if step >= from {
            sum += sim.fluid_force[0].torque.y;
        }
    }
    sum / f64::from(to - from)
}

const HELD: &str = "locked = [\"x\", \"y\", \"z\", \"rotation_x\", \"rotation_y\", \"rotation_z\"]";

#[test]
fn still_water_does_not_turn_a_wedge_under_it() {
    let wedge = |more: &str| {
        format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ndimensions = 2\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.6]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.5]\n\
             [[body]]\nname = \"b\"\nshape = \"wedge\"\nsize = [0.2, 1, 0.12]\ncenter = [0.3, 0, 0.25]\ndensity = 1000\ndisplaces_fluid = true\n{more}\n[contact]\nspring = 1e5\nrestitution = 0.3\n"
        )
    };
    let lift = 1000.0 * 9.81 * 0.012 * 0.02;
    for angle in [0, 45, 90] {
        let turned = format!("orientation = {{ axis = [0, 1, 0], angle_deg = {angle} }}\n{HELD}");
        let arm = torque(&wedge(&turned), 200, 500) / lift / 0.02;
        println!("at {angle} degrees: an arm of {arm:.4} spacings");
        assert!(arm.abs() < 0.1, "{angle} degrees: an arm of {arm} spacings");
    }
    // Free and of the water's density it stays nearly as it is, but for what the water does to it before it has come to rest.
    let case = case(&wedge(""));
    let mut sim = cpu_simulation(&case, Scene::build(&case).expect("builds"));
    while sim.time < 1.0 {
        sim.step().expect("still water is no trouble");
    }
    let q = sim.solids.poses()[0].orientation;
    let angle = 2.0 * q.y.atan2(q.w).to_degrees();
    println!("a wedge of the water's density turned by {angle:.1} degrees in 1 s");
    assert!(angle.abs() < 50.0, "{angle} degrees");
}

#[test]
fn a_prism_half_under_water_is_righted_alike_to_either_side() {
    // What of a box of 0.16 m x 0.1 m x 0.18 m that is half under water heels by 12 degrees is righted by [N m].
    let exact = 0.0547;
    for angle in [-12.0, 12.0] {
        let text = format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n[tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.32, 0.34]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.32, 0.2]\n\
             [[body]]\nname = \"b\"\nshape = \"prism\"\nsection = [[0, 0], [0.16, 0], [0.16, 0.1], [0, 0.1]]\nheight = 0.18\n\
             center = [0.2, 0.16, 0.2]\ndensity = 500\ndisplaces_fluid = true\norientation = {{ axis = [0, 1, 0], angle_deg = {angle} }}\n{HELD}\n\
             [contact]\nspring = 1e5\nrestitution = 0.3\n"
        );
        let torque = torque(&text, 200, 350);
        println!("at {angle} degrees: {torque:.4} N m for {:.4}", -exact * angle / 12.0);
        assert!((-torque * 12.0 / angle / exact - 1.0).abs() < 0.3, "{angle} degrees: {torque} N m");
    }
}

#[test]
fn a_gentle_beach_is_made_at_once() {
    // Where it is thinner than a spacing, a metre long, it has no particles of its own.
    let started = Instant::now();
    for section in ["[[3, 0], [18, 0], [18, 0.15]]", "[[2, 0], [4.8, 0], [2.1, 24]]"] {
        let text = format!(
            "[run]\nspacing = 0.01\ntime_step = 1e-3\nend = 1\ndimensions = 2\n[tank]\nmin = [0, 0, 0]\nmax = [19, 0, 0.5]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0, 0.1]\n\
             [[obstacle]]\nname = \"beach\"\nshape = \"prism\"\nsection = {section}\nheight = 1\nposition = [0, 0, 0]\n"
        );
        let scene = Scene::build(&case(&text)).unwrap_or_else(|e| panic!("{e}"));
        assert!(!scene.solids[0].wall_offset.is_empty());
    }
    let beach = Mesh::wedge(DVec3::new(15.0, 0.3, 0.15)).expect("a wedge");
    let particles = beach.particles(0.02, 3, 3);
    assert!(off(&particles, beach.volume(), false) < 1e-12);
    // It took minutes; now a second.
    assert!(started.elapsed() < Duration::from_secs(20), "{:?}", started.elapsed());
}

#[test]
fn plates_of_any_thickness_are_full() {
    let (l0, mut most) = (0.02, DVec2::ZERO);
    // Less than 2.35 spacings are the two wall layers alone.
    for thick in [2.4, 2.5, 2.75, 3.0, 3.25, 3.5, 3.75, 4.0, 4.5, 5.5] {
        let (x, z) = (0.6 * 20f64.to_radians().cos(), 0.6 * 20f64.to_radians().sin());
        let up = thick * l0 / 20f64.to_radians().cos();
        let section = [[0.0, 0.0], [x, z], [x, z + up], [0.0, up]];
        let flat = Shape::Polygon(Polygon::new(&section, l0));
        let solid = Shape::Mesh(Mesh::prism(&section, 0.2).expect("a mesh"));
        let full = [(flat, 2), (solid, 3)].map(|(shape, dimensions)| {
            let particles = shape.particles(l0, dimensions, 3);
            let count = (particles.wall.len() + particles.dummy.len()) as f64;
            count * l0.powi(3) / shape.volume()
        });
        println!("{thick} spacings: {full:.3?}");
        most = most.max(DVec2::new(full[0] - 1.0, full[1] - 1.0).abs());
    }
    assert!(most.x < 0.09 && most.y < 0.15, "{most}");
}

/// A dam that reaches beyond the tank or into the bed below, and what of the water is behind it after a second. Half of the rows of one that ends a row of particles
/// behind a wall's surface were left out, and the next stood one and a half spacings from those of that wall.
#[test]
fn a_dam_is_tight_wherever_it_ends_in_a_wall() {
    let text = |dimensions: u32, more: &str| {
        format!(
            "[run]\nspacing = 0.02\ntime_step = 2e-3\nend = 1.0\ndimensions = {dimensions}\n\
             [tank]\nmin = [0, 0, -0.1]\nmax = [0.5, 0.14, 0.3]\nopen = [\"z_max\"]\n[fluid]\n\
             [[fluid.block]]\nmin = [0, 0, -0.1]\nmax = [0.2, 0.14, 0.14]\n{more}"
        )
    };
    let wide = |y: f64, z: f64| {
        format!("[[obstacle]]\nname = \"dam\"\nsize = [0.1, 0.6, 0.5]\ncenter = [0.27, {y}, {z}]\n")
    };
    let bed = "[[obstacle]]\nname = \"bed\"\nshape = \"prism\"\n\
               section = [[0, -0.1], [0.5, -0.1], [0.5, -0.02], [0, -0.02]]\n";
    let on_bed = |foot: f64| {
        format!(
            "{bed}[[obstacle]]\nname = \"dam\"\nshape = \"prism\"\n\
             section = [[0.22, {foot}], [0.32, {foot}], [0.32, 0.3], [0.22, 0.3]]\n"
        )
    };
    let mut cases: Vec<(u32, String)> = vec![(3, wide(0.15, -0.05)), (3, wide(0.1485, -0.05))];
    cases.extend([-0.042, -0.0435, -0.0445].map(|z| (2, wide(0.15, z))));
    cases.extend([-0.07, -0.0685, -0.067].map(|foot| (2, on_bed(foot))));
    for (dimensions, more) in cases {
        let mut simulation = crate::common::simulation(&case(&text(dimensions, &more)));
        while simulation.time < 1.0 {
            simulation.step().expect("a step");
        }
        let fields = simulation.backend.read().expect("the fields");
        let water = &fields.position[..simulation.groups.fluid];
        let through = water.iter().filter(|x| x.x > 0.23).count();
        println!("{dimensions}D, {through} of {}: {more}", water.len());
        assert_eq!(through, 0, "{more}");
    }
}
