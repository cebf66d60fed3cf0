//! What sticks to a solid that turns, or rolls on it.

use crate::common::dry::{Dry, G};
use glam::DVec3;

/// Turn of the table [rad/s].
const TURN: f64 = 10.0;

/// A box 0.1 m from the axis of a disc that turns, which is `disc`, and turns along.
fn turned_along(disc: &str, pairs: &str) -> Dry {
    Dry::new(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 4\ngravity = [0, 0, -{G}]\n{disc}\
         name = \"table\"\nshape = \"cylinder\"\nradius = 0.4\nheight = 0.1\ncenter = [0, 0, -0.05]\n\
         [[body]]\nname = \"box\"\nsize = [0.06, 0.06, 0.04]\ncenter = [0.1, 0, 0.02]\nmass = 0.1\nstanding = true\n\
         velocity = [0, {}, 0]\nangular_velocity = [0, 0, {TURN}]\n\
         [contact]\nspring = 1e4\nfriction = 2\nrestitution = 0.3\n{pairs}",
        0.1 * TURN
    ))
}

#[test]
fn what_sticks_to_a_solid_that_turns_does_not_creep_outwards() {
    let driven =
        format!("[[moving_wall]]\nrotation = [[0, 0, 0, 0], [10, 0, 0, {}]]\n", (10.0 * TURN).to_degrees());
    let free = format!(
        "[[obstacle]]\nname = \"floor\"\nmin = [-1, -1, -0.2]\nmax = [1, 1, -0.1]\n\
         [[body]]\nmass = 100\nangular_velocity = [0, 0, {TURN}]\n"
    );
    let slippery = "[[contact.pair]]\nbetween = [\"table\", \"floor\"]\nfriction = 0\n";
    for (disc, pairs) in [(driven, ""), (free, slippery)] {
        let mut dry = turned_along(&disc, pairs);
        let mut apart = |time: f64| {
            let poses = dry.run(time);
            let way = poses[1].position - poses[0].position;
            way.x.hypot(way.y)
        };
        // first it is pressed to its outer side, and the free disc onto the floor
        let (first, last) = (apart(0.4), apart(1.0));
        println!("{first:.7} m from the axis, {:.3e} m more 0.6 s later", last - first);
        assert!((last - first).abs() < 1e-6, "{first} {last}");
    }
}

#[test]
fn a_ball_that_rolls_on_a_turntable_keeps_to_its_circle() {
    // two sevenths of the table's turn, whatever the ball
    let (turn, radius, speed) = (6.0, 0.05, 0.4);
    let start = DVec3::new(0.1, 0.0, radius);
    let velocity = speed * DVec3::Y;
    let spin = DVec3::Z.cross(velocity - turn * DVec3::Z.cross(start)) / radius;
    let mut dry = Dry::new(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 10\ngravity = [0, 0, -{G}]\n\
         [[moving_wall]]\nname = \"table\"\nshape = \"cylinder\"\nradius = 1\nheight = 0.1\ncenter = [0, 0, -0.05]\n\
         rotation = [[0, 0, 0, 0], [10, 0, 0, {}]]\n\
         [[body]]\nname = \"ball\"\nshape = \"sphere\"\nradius = {radius}\ncenter = {:?}\nmass = 1\nstanding = true\n\
         velocity = {:?}\nangular_velocity = {:?}\n\
         [contact]\nspring = 1e5\nfriction = 1\nrestitution = 0.3\n",
        (10.0 * turn).to_degrees(),
        start.to_array(),
        velocity.to_array(),
        spin.to_array()
    ));
    let period = 3.5 * std::f64::consts::TAU / turn;
    let pose = dry.run(2.0 * period)[0];
    println!(
        "{:.3e} m off after two rounds, at {:.7} m/s",
        (pose.position - start).length(),
        pose.velocity.length()
    );
    assert!((pose.velocity.length() / speed - 1.0).abs() < 1e-4);
}
