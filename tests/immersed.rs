//! Bodies in water: buoyancy, added mass, light bodies, and water without a free surface.

use crate::common;
use common::*;
use seixo::case::Case;

/// A cube of 0.1 m and relative density `s` in a tank of 0.4 m, its centre at `z`.
fn tank_with_cube(s: f64, z: f64, fluid: &str) -> Case {
    let density = 1000.0 * s;
    case(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -9.81]\n\
         [fluid]\n{fluid}\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.42, 0.42, 0.4]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.42, 0.42, 0.6]\nopen = [\"z_max\"]\n\
         [contact]\nspring = 1e5\ndamping_ratio = 0.3\n\
         [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.21, 0.21, {z}]\ndensity = {density}\n\
         displaces_fluid = true\n"
    ))
}

/// Vertical acceleration of the cube in each of the first `steps` steps [m/s2].
fn accelerations(case: &Case, steps: usize) -> Vec<f64> {
    let mut sim = simulation(case);
    let mut last = 0.0;
    (0..steps)
        .map(|_| {
            sim.step().expect("the cube moves freely");
            let v = sim.solids.poses()[0].velocity.z;
            let a = (v - last) / case.run.time_step;
            last = v;
            a
        })
        .collect()
}

#[test]
fn a_heavy_cube_sinks_with_the_acceleration_of_its_added_mass() {
    // a = -g (s - 1) / (s + C_m) with C_m of about 0.65 for a cube.
    let expected = -9.81 * 9.0 / 10.65;
    for fluid in ["sound_speed = 4", "preset = \"paper\"\nsound_speed = 4"] {
        let a = accelerations(&tank_with_cube(10.0, 0.25, fluid), 100);
        let mean = a[20..].iter().sum::<f64>() / 80.0;
        println!("{fluid:?}: {mean:.3} m/s2 for {expected:.3}");
        assert!((mean / expected - 1.0).abs() < 0.1, "{fluid:?}: {mean} for {expected}");
    }
}

#[test]
fn a_light_cube_rises_without_being_thrown_to_and_fro() {
    // Explicit coupling makes the acceleration of a body lighter than its added mass alternate; the force is
    // therefore relaxed for such bodies.
    let case = tank_with_cube(0.1, 0.15, "sound_speed = 4");
    let a = accelerations(&case, 60);
    let expected = 9.81 * 0.9 / 0.75;
    let mean = a[20..].iter().sum::<f64>() / 40.0;
    let flips = a[20..].windows(2).filter(|w| w[0] * w[1] < 0.0).count();
    println!("{mean:.2} m/s2 for about {expected:.2}, {flips} changes of sign");
    assert!(flips <= 2, "{a:?}");
    assert!(mean > 0.6 * expected && mean < 1.5 * expected, "{mean}");
}

#[test]
fn a_floating_cube_is_carried_by_its_displacement() {
    // At rest the force is the weight and the draft s a.
    let s = 0.5;
    let case = tank_with_cube(s, 0.4, "sound_speed = 4");
    let mut sim = simulation(&case);
    let (mut force, mut height, mut level, mut count) = (0.0, 0.0, 0.0, 0.0);
    while sim.time < 1.6 {
        sim.step().expect("the cube floats");
        if sim.time > 0.6 {
            force += sim.fluid_force[0].force.z;
            height += sim.solids.poses()[0].position.z;
            let m = sim.backend.monitor().expect("water");
            // Depth of the water with the cube's share in it, from the water's centre of mass and volume.
            let submerged = s * 1e-3;
            level += (m.particles as f64 * 8e-6 + submerged) / (0.42 * 0.42);
            count += 1.0;
        }
    }
    let (force, height, level) = (force / count, height / count, level / count);
    let weight = s * 9.81;
    let draft = level - (height - 0.05);
    println!("force over weight {:.4}, draft {draft:.4} m for {:.4} m", force / weight, s * 0.1);
    assert!((force / weight - 1.0).abs() < 0.03, "{force} for {weight}");
    assert!((draft - s * 0.1).abs() < 0.003, "draft {draft}");
}

/// Shallow water, ten layers deep, with or without the cube of section 4.3 in it, four particles to the edge, which
/// can only heave. Its draft is two layers.
fn shallow(cube: bool, fluid: &str) -> Case {
    let cube = if cube {
        "[contact]\nlaw = \"smooth\"\nspring = 2e4\nrestitution = 0.5\n\
         [[body]]\nname = \"cube\"\nsize = [0.054, 0.054, 0.054]\ncenter = [0.135, 0.135, 0.135]\n\
         density = 463.6\ndisplaces_fluid = true\n\
         locked = ['x', 'y', 'rotation_x', 'rotation_y', 'rotation_z']\n"
    } else {
        ""
    };
    case(&format!(
        "[run]\nspacing = 0.0135\ntime_step = 7.5e-4\nend = 2.0\ngravity = [0, 0, -9.806]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.27, 0.27, 0.225]\nopen = [\"z_max\"]\n\
         [fluid]\nsound_speed = 3\n{fluid}\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.27, 0.27, 0.135]\n{cube}"
    ))
}

#[test]
fn still_water_does_not_rock_itself() {
    let mut sim = simulation(&shallow(false, ""));
    let (mut sum, mut count) = (0.0, 0.0);
    while sim.time < 1.5 {
        sim.step().expect("water at rest");
        if sim.time > 1.0 {
            sum += sim.backend.monitor().expect("water").kinetic;
            count += 1.0;
        }
    }
    println!("kinetic energy {:.4} J", sum / count);
    // 0.019 to 0.026 J when gravity kicked the particles before the pressure carried them.
    assert!(sum / count < 0.015, "{}", sum / count);
}

#[test]
fn a_small_cube_does_not_swing_itself_out_of_the_water() {
    let mut sim = simulation(&shallow(true, ""));
    let mut heights = Vec::new();
    while sim.time < 1.75 {
        sim.step().expect("the cube floats");
        if sim.time > 0.25 {
            heights.push(sim.solids.poses()[0].position.z);
        }
    }
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    let swing = (heights.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / heights.len() as f64).sqrt();
    let expected = 0.135 + 0.027 - 0.4636 * 0.054;
    println!("height {mean:.4} m for {expected:.4}, rms {:.2} mm", 1e3 * swing);
    assert!((mean - expected).abs() < 0.003 && swing < 3.5e-3, "{mean} {swing}");
}

#[test]
fn a_closed_box_full_of_water_keeps_a_finite_pressure() {
    let case = case(
        "[run]\nspacing = 0.025\ntime_step = 5e-4\nend = 1.0\ngravity = [0, 0, -9.81]\n\
         [fluid]\nrelaxation = 0.01\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.25, 0.25, 0.25]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.25, 0.25, 0.25]\n",
    );
    let mut sim = simulation(&case);
    for _ in 0..100 {
        sim.step().expect("a closed box is allowed");
    }
    let m = sim.backend.monitor().expect("water");
    assert_eq!((m.particles, sim.backend.counters().expect("counted").lost), (1000, 0));
    assert!(m.kinetic < 0.2, "{m:?}");
    let f = sim.backend.read().expect("readable");
    assert!(f.pressure.iter().all(|p| p.is_finite()));
}

#[test]
fn a_sphere_under_water_is_carried_by_its_volume_and_slowed_by_half_of_it() {
    // a = g (1 - s) / (s + 1/2): the added mass of a sphere is half of the water that it displaces
    let tank = |s: f64, z: f64| {
        case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -9.81]\n\
             [fluid]\nsound_speed = 4\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.42, 0.42, 0.4]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.42, 0.42, 0.6]\nopen = [\"z_max\"]\n\
             [contact]\nspring = 1e5\ndamping_ratio = 0.3\n\
             [[body]]\nname = \"ball\"\nshape = \"sphere\"\nradius = 0.07\ncenter = [0.21, 0.21, {z}]\n\
             density = {}\ndisplaces_fluid = true\n",
            1000.0 * s
        ))
    };
    let (s, z) = (5.0, 0.25);
    let a = accelerations(&tank(s, z), 80);
    let mean = a[30..].iter().sum::<f64>() / 50.0;
    let expected = 9.81 * (1.0 - s) / (s + 0.5);
    println!("ratio {s}: {mean:.3} m/s2 for {expected:.3}");
    assert!((mean / expected - 1.0).abs() < 0.15, "{s}: {mean} for {expected}");
}
