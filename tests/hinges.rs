//! Bodies whose mass is not in the middle, and bodies on hinges.

use crate::common::dry::{Dry, G};
use crate::common::{case, cpu_simulation, there_is_a_device};
use glam::DVec3;
use seixo::backend::Processor;
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use std::f64::consts::PI;
use std::sync::Arc;

/// Angle about y [rad].
fn turned(pose: &seixo::body::Pose) -> f64 {
    2.0 * pose.orientation.y.atan2(pose.orientation.w)
}

/// Period [s] of a swing about y, from where it passes through 0.
fn period(dry: &mut Dry, end: f64) -> f64 {
    let (mut before, mut crossings) = (turned(&dry.solids.poses()[0]), vec![]);
    while dry.time() < end {
        let now = turned(&dry.step()[0]);
        if before * now < 0.0 {
            crossings.push(dry.time() - dry.dt * now / (now - before));
        }
        before = now;
    }
    let halves = crossings.len() - 1;
    2.0 * (crossings[halves] - crossings[0]) / halves as f64
}

/// A bar 0.4 m long that hangs from its upper end.
const BAR: &str = "[[body]]\nname = \"bar\"\nsize = [0.04, 0.1, 0.4]\ncenter = [0.5, 0.5, 0.5]\ndensity = 1000\n\
                   hinge = { at = [0.5, 0.5, 0.7], axis = \"y\" }\n";

fn dry(gravity: f64, more: &str) -> Dry {
    Dry::new(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 10\ngravity = [0, 0, -{gravity}]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\n[contact]\nspring = 1e6\n{more}"
    ))
}

#[test]
fn a_pendulum_swings_as_it_should() {
    let mut dry = dry(G, &format!("{BAR}angular_velocity = [0, 0.3, 0]\n"));
    let start = dry.solids.energy().total();
    let (inertia, lever) = ((0.04_f64.powi(2) + 0.4 * 0.4) / 12.0 + 0.2 * 0.2, 0.2);
    let frequency = (G * lever / inertia).sqrt();
    let amplitude = 0.3 / frequency;
    let exact = 2.0 * PI / frequency * (1.0 + amplitude * amplitude / 16.0);
    let found = period(&mut dry, 4.2);
    println!("period {found} s for {exact} s");
    assert!((found / exact - 1.0).abs() < 1e-5);
    assert!((dry.solids.poses()[0].position - DVec3::new(0.5, 0.5, 0.7)).length() < 1e-12);
    let swing = 1.6 * G * lever * 0.5 * amplitude * amplitude;
    assert!((dry.solids.centred_energy().total() - start).abs() < 1e-4 * swing);
}

#[test]
fn what_a_pendulum_hits_takes_its_angular_momentum() {
    let block =
        "[[body]]\nname = \"block\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.6, 0.5, 0.4]\ndensity = 1000\n";
    let mut dry = dry(0.0, &format!("restitution = 1\n{BAR}angular_velocity = [0, -3, 0]\n{block}"));
    let about_hinge = |dry: &Dry| {
        let (p, l) = dry.solids.momentum();
        // The hinge takes up the momentum of the bar, but none about itself.
        let bar = dry.solids.poses()[0];
        let its = 1.6 * bar.velocity_at(bar.point(DVec3::new(0.0, 0.0, -0.2)));
        let origin = DVec3::new(0.5, 0.5, 0.7);
        (l - origin.cross(p - its) - origin.cross(its)).y
    };
    let (energy, momentum) = (dry.solids.energy().total(), about_hinge(&dry));
    let block = dry.run(0.4)[1];
    println!("block {block:?}, {momentum} and {} kg m2/s", about_hinge(&dry));
    assert!(block.velocity.x > 0.5);
    assert!((about_hinge(&dry) / momentum - 1.0).abs() < 1e-9);
    assert!((dry.solids.energy().total() / energy - 1.0).abs() < 2e-3);
}

#[test]
fn a_ball_with_ballast_rocks_about_the_point_that_it_rolls_over() {
    let ball = "friction = 0.8\nrestitution = 0.2\n[[body]]\nname = \"ball\"\nshape = \"sphere\"\nradius = 0.1\n\
                center = [0.5, 0.5, 0.1]\nmass = 4\ninertia = [0.01, 0.01, 0.01]\nmass_offset = [0, 0, -0.04]\n\
                orientation = { axis = [0, 1, 0], angle_deg = 4 }\n";
    let mut dry = dry(G, ball);
    let exact = 2.0 * PI * ((0.01 + 4.0 * 0.06 * 0.06) / (4.0 * G * 0.04)).sqrt();
    let found = period(&mut dry, 4.0);
    println!("period {found} s for {exact} s");
    assert!((found / exact - 1.0).abs() < 2e-3);
}

#[test]
fn a_cube_that_is_heavy_on_one_side_topples_over_it() {
    // Its mass lies 10 mm beyond the edge of what it stands on, or as much within.
    let cube = |offset: f64| {
        format!(
            "friction = 0.5\nrestitution = 0.2\n[[obstacle]]\nname = \"table\"\nmin = [0, 0, 0]\nmax = [0.5, 1, 0.2]\n\
             [[body]]\nname = \"cube\"\nsize = [0.2, 0.2, 0.2]\ncenter = [0.48, 0.5, 0.3]\ndensity = 1000\n\
             mass_offset = [{offset}, 0, 0]\n"
        )
    };
    let tilt = |offset: f64| turned(&dry(G, &cube(offset)).run(0.6)[0]);
    let (stands, topples) = (tilt(0.01), tilt(0.03));
    println!("{stands} and {topples} rad");
    assert!(stands.abs() < 2e-3 && topples > 0.3);
}

#[test]
fn what_touches_far_from_the_mass_asks_for_shorter_sub_steps() {
    let substeps = |shape: &str, offset: f64| {
        let body = format!(
            "restitution = 0.5\n[[body]]\nname = \"b\"\n{shape}\ncenter = [0.5, 0.5, 0.1]\nmass = 4\ninertia = [4e-3, 4e-3, 4e-3]\n\
             mass_offset = [0, 0, {offset}]\n"
        );
        dry(G, &body).try_step().expect("it stands").substeps
    };
    for shape in ["shape = \"sphere\"\nradius = 0.1", "shape = \"cylinder\"\nradius = 0.1\nheight = 0.2"] {
        let (middle, off) = (substeps(shape, 0.0), substeps(shape, 0.08));
        println!("{shape}: {middle} and {off}");
        assert!(off > middle, "{shape}");
    }
}

/// Two dimensions, water 0.4 m deep in a tank of 1.6 m.
fn wet(more: &str) -> seixo::case::Case {
    case(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 3\ngravity = [0, 0, -{G}]\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1.6, 0.1, 0.6]\nopen = [\"z_max\"]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1.6, 0.1, 0.4]\n[contact]\nspring = 1e5\n{more}"
    ))
}

#[test]
fn ballast_rights_a_box_by_its_metacentric_height() {
    // KB + BM - KG = 0.05 + 0.2^2 / (12 x 0.1) - 0.05 m; without ballast it is -0.017 m.
    let metacentric = |low: f64| 0.05 + 0.04 / 1.2 - (0.1 - low);
    for low in [0.05, 0.0] {
        let case = wet(&format!(
            "[[body]]\nname = \"box\"\nsize = [0.2, 0.1, 0.2]\ncenter = [0.8, 0, 0.4]\ndensity = 500\ndisplaces_fluid = true\n\
             mass_offset = [0, 0, {}]\nlocked = [\"x\", \"rotation_y\"]\norientation = {{ axis = [0, 1, 0], angle_deg = 8 }}\n",
            -low
        ));
        let mut sim = cpu_simulation(&case, Scene::build(&case).expect("builds"));
        let mut torque = 0.0;
        for step in 0..1000 {
            sim.step().expect("it floats");
            if step >= 500 {
                torque += sim.fluid_force[0].torque.y / 500.0;
            }
        }
        let (heel, weight) = (8_f64.to_radians(), 0.2 * 0.2 * 0.02 * 500.0 * G);
        // Wall-sided: GZ = (GM + BM tan^2 / 2) sin.
        let lever = (metacentric(low) + 0.5 * 0.04 / 1.2 * heel.tan().powi(2)) * heel.sin();
        let exact = -weight * lever;
        println!("ballast {low} m lower: torque {torque} for {exact} N m");
        assert!((torque - exact).abs() < 0.05 * weight * 0.04 / 1.2 * heel.sin(), "{low}");
    }
}

const SQUARE: &str = "[[body]]\nname = \"square\"\nsize = [0.1, 0.1, 0.1]\ncenter = [1.0, 0, 0.21]\ndensity = 200\n\
                      displaces_fluid = true\n";

/// Acceleration upwards of the square's centre over the steps 5 to 25 [m/s2].
fn rise(hold: &str) -> f64 {
    let case = wet(&format!("{SQUARE}{hold}"));
    let mut sim = cpu_simulation(&case, Scene::build(&case).expect("builds"));
    let center = DVec3::new(1.0, 0.0, 0.21);
    let mut speed = vec![];
    for _ in 0..25 {
        sim.step().expect("it rises");
        speed.push(sim.solids.poses()[0].velocity_at(center).z);
    }
    (speed[24] - speed[4]) / 0.02
}

#[test]
fn water_that_a_hinged_body_drags_along_is_that_of_its_motion() {
    let heave = rise("locked = [\"x\", \"rotation_y\"]\n");
    for at in [0.5, 0.3] {
        // The square's own turn adds a s^2 / 6 to the a lever^2 of its mass, and next to nothing to the water's.
        let lever = 1.0 - at;
        let swing = rise(&format!("hinge = {{ at = [{at}, 0, 0.21], axis = \"y\" }}\n"));
        let own = 0.2 * 0.01 / 6.0 / (lever * lever * (0.2 + 1.25));
        println!("lever {lever}: {swing} m/s2 for {}", heave / (1.0 + own));
        assert!(heave > 4.0 && (swing * (1.0 + own) / heave - 1.0).abs() < 0.02);
    }
}

#[test]
fn a_hinge_through_the_middle_locks_all_but_its_turn() {
    let end = |hold: &str| {
        let case = wet(&format!("{SQUARE}angular_velocity = [0, 2, 0]\n{hold}"));
        let mut sim = cpu_simulation(&case, Scene::build(&case).expect("builds"));
        (0..30).for_each(|_| drop(sim.step().expect("it turns")));
        sim.solids.poses()[0]
    };
    let (hinged, locked) =
        (end("hinge = { at = [1.0, 0, 0.21], axis = \"y\" }\n"), end("locked = [\"x\", \"z\"]\n"));
    println!("{hinged:?}\n{locked:?}");
    assert!(hinged.angular_velocity.y > 0.5);
    // The hinge has one moment of inertia, of which the sub-steps are reckoned, and not the least of three.
    assert!((hinged.angular_velocity - locked.angular_velocity).length() < 1e-4);
    assert!((hinged.position - locked.position).length() < 1e-12);
}

#[test]
fn the_domain_holds_what_a_pendulum_reaches_and_no_more() {
    let domain = |body: &str| {
        let scene = Scene::build(&wet(body)).expect("builds");
        (scene.domain.0, scene.domain.1)
    };
    let body = |center: [f64; 2], at: [f64; 2]| {
        format!(
            "[[body]]\nname = \"bob\"\nsize = [0.1, 0.1, 0.1]\ncenter = [{}, 0, {}]\ndensity = 900\n\
             displaces_fluid = true\nhinge = {{ at = [{}, 0, {}], axis = \"y\" }}\n",
            center[0], center[1], at[0], at[1]
        )
    };
    // High above the walls it swings beyond them.
    let (low, high) = domain(&body([1.6, 3.0], [1.0, 3.0]));
    assert!(low.x < 0.35 && high.x > 1.6 + 0.05 && high.z > 3.6, "{low} {high}");
    let (low, high) = domain(&body([0.2, 3.0], [1.2, 3.0]));
    assert!(low.x < 0.15 && high.x > 2.2, "{low} {high}");
    // On the floor the floor stops it.
    let (flap, none) = (domain(&body([0.8, 0.2], [0.8, 0.05])), domain(""));
    assert_eq!(flap, none);
}

#[test]
fn a_device_holds_hinges_as_the_cpu_does() {
    if !there_is_a_device("hinges are not compared") {
        return;
    }
    let case = wet(&format!(
        "{SQUARE}hinge = {{ at = [0.6, 0, 0.21], axis = \"y\" }}\n\
         [[body]]\nname = \"float\"\nsize = [0.2, 0.1, 0.2]\ncenter = [0.4, 0, 0.4]\ndensity = 500\ndisplaces_fluid = true\n\
         mass_offset = [0.03, 0, -0.05]\n"
    ));
    let scene = Arc::new(Scene::build(&case).expect("builds"));
    let poses = |processor: &Processor| {
        let mut sim = Simulation::on(&case, scene.clone(), processor).expect("it opens");
        (0..20).for_each(|_| drop(sim.step().expect("it runs")));
        sim.solids.poses().to_vec()
    };
    let (cpu, gpu) = (poses(&Processor::Cpu), poses(&Processor::Gpu { adapter: None }));
    for (a, b) in cpu.iter().zip(&gpu) {
        println!("{a:?}\n{b:?}");
        assert!(a.angular_velocity.y.abs() > 0.05, "it hardly turns");
        assert!((a.position - b.position).length() < 1e-6);
        assert!((a.angular_velocity - b.angular_velocity).length() < 1e-3 * a.angular_velocity.length());
    }
}
