//! The inertia of the water between a body and what it comes off or down to, and rooms there without water.

use crate::common::{case, gauges, mean_over, processors, simulation};
use seixo::case::Case;
use seixo::scene::Scene;
use seixo::simulation::Simulation;

/// A block of 0.2 x 0.1 m, see [`slab`].
fn block(density: f64, gap: f64) -> Case {
    slab(density, gap, 0.1)
}

/// A slab of 0.2 m, `thick` [m] and of `density` [kg/m3], `gap` [m] above the floor of a tank with 0.4 m of water, in the plane; it goes up and down alone.
fn slab(density: f64, gap: f64, thick: f64) -> Case {
    case(&described(density, gap, thick))
}

fn described(density: f64, gap: f64, thick: f64) -> String {
    format!(
        "[run]\nspacing = 0.01\ntime_step = 2e-4\nend = 1.0\ngravity = [0, 0, -9.81]\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1.2, 0, 0.5]\nopen = [\"z_max\"]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1.2, 0, 0.4]\n\
         [[body]]\nname = \"block\"\nsize = [0.2, 0.01, {thick}]\ncenter = [0.6, 0, {}]\ndensity = {density}\n\
         locked = [\"x\", \"rotation_y\"]\ndisplaces_fluid = true\n\
         [contact]\nspring = 1e5\nrestitution = 0.2\n\
         [[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n",
        0.5 * thick + gap
    )
}

/// Height [m] and velocity [m/s] of the block.
fn motion(simulation: &Simulation) -> (f64, f64) {
    let pose = simulation.solids.poses()[0];
    (pose.position.z, pose.velocity.z)
}

#[test]
fn a_block_starts_as_fast_as_the_water_below_lets_it() {
    // The added mass of potential flow by finite volumes of 1.25 mm, half of the tank: 345, 203, 151, 128 kg/m.
    for (gap, density, exact) in [
        (0.0025, 500.0, 0.277),
        (0.0025, 2000.0, -0.510),
        (0.005, 500.0, 0.461),
        (0.005, 2000.0, -0.808),
        (0.0075, 500.0, 0.609),
        (0.0075, 2000.0, -1.027),
        (0.01, 500.0, 0.710),
        (0.01, 2000.0, -1.167),
    ] {
        let case = block(density, gap);
        for processor in processors("a block above a floor") {
            let mut simulation =
                Simulation::on(&case, Scene::build(&case).unwrap(), &processor).expect("it starts");
            // Water that a block displaces off its lattice is not even at first.
            (0..6).for_each(|_| drop(simulation.step().unwrap()));
            let (start, from) = (simulation.time, motion(&simulation).1);
            while simulation.time < 0.015 {
                simulation.step().unwrap();
            }
            let found = (motion(&simulation).1 - from) / (simulation.time - start);
            println!("{gap} m, {density} kg/m3: {found:.3} for {exact} m/s2");
            assert!((found / exact - 1.15).abs() < 0.2, "{gap} m, {density} kg/m3: {found} for {exact}");
        }
    }
}

#[test]
fn a_light_block_comes_off_the_floor_as_potential_flow_has_it() {
    // d/dt (M + m(h)) V = F + V^2 m'(h) / 2, with the added mass of the test above from 1 mm on, the least gap.
    let mut simulation = simulation(&block(300.0, 0.0));
    for (time, exact) in [(0.1, 0.0509), (0.15, 0.0523), (0.2, 0.0552), (0.25, 0.0609)] {
        while simulation.time < time {
            simulation.step().unwrap();
        }
        let z = motion(&simulation).0;
        println!("{time} s: {z:.4} for {exact}");
        assert!((z - exact).abs() < 0.07 * (exact - 0.05) + 2e-4, "{time} s: {z} for {exact}");
    }
    let (mut highest, mut back) = (0.0_f64, 0.0_f64);
    while simulation.time < 0.4 {
        simulation.step().unwrap();
        let z = motion(&simulation).0;
        highest = highest.max(z);
        back = back.max(highest - z);
    }
    // As the gap becomes one for particles, and has none yet, it keeps its lift: it fell back by 4 mm.
    println!("{highest:.4} m, back by {:.2} mm", 1e3 * back);
    assert!(highest > 0.085 && back < 5e-4, "{highest} m, back by {back} m");
}

#[test]
fn a_heavy_block_lands_on_the_water_below_it() {
    let mut simulation = simulation(&block(2000.0, 0.03));
    let step = |simulation: &mut Simulation| {
        simulation.step().unwrap();
        simulation.solids.contact_wrenches()[0].force.z
    };
    let mut fastest = 0.0_f64;
    while step(&mut simulation) == 0.0 {
        fastest = fastest.min(motion(&simulation).1);
        assert!(simulation.time < 1.0, "it lands");
    }
    let landed = motion(&simulation).1;
    println!("{:.3} s: {landed:.3} m/s, {fastest:.3} at most", simulation.time);
    assert!(fastest < -0.15 && landed.abs() < 0.15 * fastest.abs(), "{landed} of {fastest}");
    // All of it rests on the floor: the water by its pressure, and the block by what it weighs more.
    while simulation.time < 0.8 {
        step(&mut simulation);
    }
    let [floor] = mean_over(&mut simulation, [0.8, 1.0], |now| gauges(now, ["floor_force_z"]));
    let weight = -9.81 * 1000.0 * 0.01 * (1.2 * 0.4);
    println!("{floor:.2} N for {weight:.2}");
    assert!((floor / weight - 1.0).abs() < 0.01, "{floor} for {weight}");
}

#[test]
fn a_slab_of_two_rows_has_the_water_below_it_as_a_block_has() {
    // 185 kg/m of added mass by potential flow, 133 of them in the gap, and 2 kg/m of its own.
    let mut simulation = simulation(&slab(500.0, 0.005, 0.02));
    while simulation.time < 0.015 {
        simulation.step().unwrap();
    }
    let (start, from) = (simulation.time, motion(&simulation).1);
    while simulation.time < 0.04 {
        simulation.step().unwrap();
    }
    let found = (motion(&simulation).1 - from) / (simulation.time - start);
    println!("{found:.4} for 0.105 m/s2");
    assert!((found / 0.105 - 1.25).abs() < 0.3, "{found} for 0.105");
}

#[test]
fn a_block_rests_on_one_that_is_held() {
    // Two blocks of 6 x 4 spacings, the lower one locked in all that it could do, with friction.
    let mut simulation = simulation(&case(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -9.81]\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.5]\nopen = [\"z_max\"]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.3]\n\
         [[body]]\nname = \"lower\"\nsize = [0.12, 0.02, 0.08]\ncenter = [0.3, 0, 0.04]\ndensity = 2000\n\
         locked = [\"x\", \"z\", \"rotation_y\"]\ndisplaces_fluid = true\n\
         [[body]]\nname = \"upper\"\nsize = [0.12, 0.02, 0.08]\ncenter = [0.31, 0, 0.12]\ndensity = 2000\n\
         velocity = [0.05, 0, 0]\ndisplaces_fluid = true\n\
         [contact]\nspring = 1e5\nfriction = 0.3\nrestitution = 0.2",
    ));
    while simulation.time < 0.3 {
        simulation.step().expect("a step");
    }
    let pose = simulation.solids.poses()[1];
    println!("{} {}", pose.position, pose.velocity);
    assert!((pose.position.z - 0.12).abs() < 1e-3 && pose.velocity.length() < 0.01, "{pose:?}");
}

#[test]
fn the_floor_feels_what_the_water_in_the_gap_does() {
    let mut simulation = simulation(&block(2000.0, 0.008));
    // While it comes down, the floor bears all but what speeds up.
    let momentum = |simulation: &mut Simulation| {
        let fields = simulation.backend.read().expect("the fields");
        let mass = simulation.params.particle_mass();
        let water: f64 = fields.velocity[..simulation.groups.fluid].iter().map(|v| v.z).sum();
        mass * water + 0.4 * motion(simulation).1
    };
    while simulation.time < 0.02 {
        simulation.step().unwrap();
    }
    let (start, before) = (simulation.time, momentum(&mut simulation));
    let [floor] = mean_over(&mut simulation, [0.02, 0.06], |now| gauges(now, ["floor_force_z"]));
    let gained = (momentum(&mut simulation) - before) / (simulation.time - start);
    let weight = 9.81 * (1000.0 * 0.01 * (1.2 * 0.4 - 0.02) + 0.4);
    println!("{floor:.3} N for {:.3}", -weight - gained);
    assert!((floor + weight + gained).abs() < 0.01 * weight, "{floor} for {}", -weight - gained);
}

#[test]
fn a_floor_of_any_kind_feels_the_blow_of_what_lands_on_it() {
    let of_tank = described(2500.0, 0.02, 0.1);
    let deeper = of_tank.replace("[tank]\nmin = [0, 0, 0]", "[tank]\nmin = [0, 0, -0.04]");
    let deeper = deeper.replace("tank.z_min", "ground");
    let ground = "name = \"ground\"\nmin = [0, 0, -0.04]\nmax = [1.2, 0.01, 0]\n";
    let prism =
        "name = \"ground\"\nshape = \"prism\"\nsection = [[0, -0.04], [1.2, -0.04], [1.2, 0], [0, 0]]\n";
    let moving = format!("{deeper}[[moving_wall]]\n{ground}motion = [[0, 0, 0, 0], [1, 0, 0, 0]]\n");
    let floors = [of_tank, format!("{deeper}[[obstacle]]\n{prism}"), moving];
    let blow = |text: String| {
        let mut simulation = simulation(&case(&text));
        let [force] = mean_over(&mut simulation, [0.05, 0.2], |now| gauges(now, ["floor_force_z"]));
        let (height, _) = motion(&simulation);
        (force, height)
    };
    let [tank, prism, moving] = floors.map(blow);
    println!("{tank:?} {prism:?} {moving:?}");
    // The water below has stopped it, after a fall of 20 mm.
    assert!((tank.1 - 0.05).abs() < 2e-3, "{tank:?}");
    for found in [prism, moving] {
        assert!((found.0 / tank.0 - 1.0).abs() < 5e-3, "{found:?} for {tank:?}");
    }
}
