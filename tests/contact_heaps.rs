//! What lies still goes on lying still, however hard it is pressed and however many lie on each other.

use crate::common::dry::{Dry, G};

#[test]
fn what_is_held_by_friction_does_not_roll_down() {
    // A ball between a wall and a plate that has come to rest, without a floor: sixteen times its weight could be held, and from nothing
    // in each sub-step, up to a thousandth of what friction could do, it went down by 9.3 um/s, with ten times the friction by 51.
    for friction in [0.5, 5.0] {
        let mut dry = Dry::new(&format!(
            "[run]\nspacing = 0.01\ntime_step = 1e-3\nend = 3\ngravity = [0, 0, -{G}]\n\
             [[obstacle]]\nname = \"wall\"\nmin = [-0.1, -0.2, -0.3]\nmax = [0, 0.2, 0.3]\n\
             [[moving_wall]]\nname = \"plate\"\nsize = [0.1, 0.1, 0.4]\ncenter = [0.1501, 0, 0.05]\n\
             motion = [[0, 0, 0, 0], [0.4, -0.0021, 0, 0]]\n\
             [[moving_wall]]\nname = \"floor\"\nsize = [0.08, 0.1, 0.04]\ncenter = [0.05, 0, -0.0701]\n\
             motion = [[0, 0, 0, 0], [0.6, 0, 0, 0], [0.9, 0, 0, -0.1]]\n\
             [[body]]\nname = \"ball\"\nshape = \"sphere\"\nradius = 0.05\ncenter = [0.05, 0, 0]\ndensity = 1000\n\
             [contact]\nspring = 1e5\nfriction = {friction}\nrestitution = 0.2\n"
        ));
        let mut height = |time: f64| {
            let poses = dry.run(time);
            poses.iter().map(|p| p.position.z).find(|z| z.abs() < 0.02).expect("the ball where it was")
        };
        let sinks = height(1.5) - height(2.5);
        println!("mu = {friction}: {sinks:.1e} m in a second");
        assert!(sinks.abs() < 1e-9, "mu = {friction}: {sinks}");
    }
}

#[test]
fn a_heap_that_has_come_to_rest_does_not_creep() {
    // from nothing in each sub-step 2.5 um/s on average (30 of them)
    let mut dry = Dry::new(&format!(
        "[run]\nspacing = 0.02\ntime_step = 2e-3\nend = 9\ndimensions = 2\ngravity = [0, 0, -{G}]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0.1, 1]\n\
         [[body]]\nname = \"box\"\nsize = [0.1, 0.1, 0.06]\ncenter = [0.3, 0.05, 0.5]\ndensity = 2000\n\
         scatter = {{ count = 16, size = [0.5, 0.1, 0.9], seed = 1 }}\n\
         [contact]\nfriction = 0.5\nrestitution = 0.5\nspring = 1e5\n"
    ));
    let mut at = |time: f64| dry.run(time).iter().map(|p| p.position).collect::<Vec<_>>();
    let (before, after) = (at(7.0), at(8.0));
    let most = before.iter().zip(&after).map(|(p, q)| p.distance(*q)).fold(0.0, f64::max);
    let high = after.iter().map(|p| p.z).fold(0.0, f64::max);
    println!("{} boxes up to {high:.2} m, {most:.1e} m in a second", after.len());
    assert!(after.len() == 16 && high > 0.15 && most < 1e-8, "{high} m high, {most} m in a second");
}
