//! The viscous friction of the smooth law: it stops what slides and never turns it round.

use crate::common::dry::{Dry, G};

/// A block of 1.728 kg that touches a floor, or two `rails`, which leans by 25 degrees, x down the slope, pressed in as deep as it stands.
fn on_a_drag(dt: f64, friction: f64, eta: f64, rails: bool) -> Dry {
    let tilt = 25_f64.to_radians();
    let [along, down] = [tilt.sin() * G, tilt.cos() * G];
    let (rails, floor) = if rails {
        let rail = |name: &str, [from, to]: [f64; 2]| {
            format!("[[obstacle]]\nname = \"{name}\"\nmin = [-0.6, {from}, 0]\nmax = [0.6, {to}, 0.1]\n")
        };
        (rail("left", [-0.06, -0.02]) + &rail("right", [0.02, 0.06]), 0.1)
    } else {
        (String::new(), 0.0)
    };
    let mut dry = Dry::new(&format!(
        "[run]\nspacing = 0.02\ntime_step = {dt}\nend = 1\ngravity = [{along}, 0, -{down}]\n\
         [tank]\nmin = [-0.6, -0.2, 0]\nmax = [0.6, 0.2, 0.4]\nopen = [\"z_max\"]\n\
         [[body]]\nname = \"block\"\nsize = [0.12, 0.12, 0.08]\ncenter = [-0.3, 0, {}]\ndensity = 1500\n\
         locked = [\"rotation_x\", \"rotation_y\", \"rotation_z\"]\n\
         [contact]\nspring = 2e4\nrestitution = 0.3\nfriction = {friction}\nviscous_friction = {eta}\n{rails}",
        floor + 0.04
    ));
    let mut states = dry.solids.states();
    states[0].pose.position.z -= 1.728 * down / 2e4;
    states[0].pose.velocity.x = 1.0;
    dry.solids.restore(&states).unwrap();
    dry
}

#[test]
fn a_drag_of_any_strength_stops_a_block_and_lets_it_creep_on_a_slope() {
    let tilt = 25_f64.to_radians();
    for (eta, rails) in [1e3, 1e4, 1e6].into_iter().flat_map(|eta| [(eta, false), (eta, true)]) {
        // beyond a friction of tan 25 degrees = 0.466 it sticks
        for friction in if rails { vec![0.0] } else { vec![0.0, 0.2, 0.4, 0.5] } {
            let mut dry = on_a_drag(1e-3, friction, eta, rails);
            let mut slowest = f64::INFINITY;
            while dry.time() < 0.2 {
                slowest = dry.step()[0].velocity.x.min(slowest);
            }
            let (speed, force) = (dry.solids.poses()[0].velocity.x, dry.solids.contact_wrenches()[0].force);
            let pulls = G * (tilt.sin() - friction * tilt.cos());
            // Each of the two rails drags.
            let creeps = (1.728 * pulls / if rails { 2.0 * eta } else { eta }).max(0.0);
            println!(
                "mu {friction} eta {eta} rails {rails}: {speed:.4e} for {creeps:.4e} m/s, {:.5} N",
                force.x
            );
            assert!((speed - creeps).abs() < 1e-3 * creeps + 1e-12, "{friction} {eta}: {speed} for {creeps}");
            // Patches follow one another: a stop on two swings back by less than a hundredth of what a step's gravity gives.
            let back = if rails { 1e-2 * 1e-3 * G * tilt.sin() } else { 1e-12 };
            assert!(slowest > -back, "{friction} {eta}: {slowest}");
            let weight = 1.728 * G * tilt.sin();
            assert!((force.x + weight).abs() < 1e-3 * weight, "{friction} {eta}: {force} for {weight}");
        }
    }
}

#[test]
fn a_drag_that_the_steps_resolve_is_of_second_order() {
    let (eta, time) = (200.0, 0.02);
    let fades = |dt: f64| {
        let speed = on_a_drag(dt, 0.0, eta, false).run(time)[0].velocity.x;
        let rate = eta / 1.728;
        let creeps = G * 25_f64.to_radians().sin() / rate;
        speed - creeps - (1.0 - creeps) * (-rate * time).exp()
    };
    let (coarse, fine) = (fades(2e-3), fades(1e-3));
    println!("{coarse:.2e} {fine:.2e}");
    assert!((3.4..4.6).contains(&(coarse / fine)), "{coarse} {fine}");
}
