//! Boxes of fewer than three particles an edge: their faces, which have no particle off their borders, meet like those
//! of larger ones.

use crate::common::dry::{Dry, G};
use glam::DVec3;

/// Spacing of the scenes [m].
const L0: f64 = 0.01;

/// A scene of `dimensions` without gravity, of particles `L0` apart, with `solids`.
fn scene(dimensions: u32, gravity: f64, solids: &str) -> Dry {
    Dry::new(&format!(
        "[run]\nspacing = {L0}\ntime_step = 5e-4\nend = 1\ndimensions = {dimensions}\ngravity = [0, 0, {gravity}]\n\
         [contact]\nspring = 1e4\nrestitution = 0.5\nfriction = 0.3\n{solids}"
    ))
}

fn body(name: &str, size: [f64; 3], center: [f64; 3], more: &str) -> String {
    format!("[[body]]\nname = \"{name}\"\nsize = {size:?}\ncenter = {center:?}\ndensity = 1000\n{more}\n")
}

#[test]
fn boxes_of_two_particles_an_edge_strike_each_other() {
    for dimensions in [2, 3] {
        let depth = |wide: f64| if dimensions == 2 { L0 } else { wide };
        for edge in [1.0, 1.5, 2.0, 2.2, 2.5].map(|n| n * L0) {
            for length in [edge, 0.06] {
                // aside, turned, driven, of another size by a thousandth
                for (off, other, more) in [
                    (0.0, edge, ""),
                    (1e-4, edge, ""),
                    (0.0, 1.001 * edge, ""),
                    (0.0, edge, "orientation = { axis = [1, 0, 0], angle_deg = 1 }"),
                ] {
                    if dimensions == 2 && !more.is_empty() {
                        continue;
                    }
                    let x = length + 1e-3;
                    let dry = &mut scene(
                        dimensions,
                        0.0,
                        &(body("a", [length, depth(edge), edge], [0.0, 0.0, 0.0], "velocity = [1, 0, 0]")
                            + &body("b", [length, depth(other), other], [x, 0.0, off], more)),
                    );
                    let masses = [edge, other].map(|e| e * depth(e));
                    let poses = dry.run(0.01);
                    let [a, b] = [poses[0].velocity.x, poses[1].velocity.x];
                    let at = format!("{dimensions}D, {length} x {edge}, {off} {other} {more}: {a} {b}");
                    assert!(((b - a) / 0.5 - 1.0).abs() < 0.03, "{at}");
                    assert!(((masses[0] * a + masses[1] * b) / masses[0] - 1.0).abs() < 1e-9, "{at}");
                }
                let driven = "motion = [[0, 0, 0, 0], [1, 1, 0, 0]]";
                let dry = &mut scene(
                    dimensions,
                    0.0,
                    &(body("a", [length, depth(edge), edge], [0.0, 0.0, 0.0], driven)
                        + &body("b", [length, depth(edge), edge], [length + 1e-3, 0.0, 0.0], "")),
                );
                let speed = dry.run(0.01)[1].velocity.x;
                assert!((speed / 1.5 - 1.0).abs() < 0.03, "{dimensions}D, {length} x {edge}: {speed}");
            }
        }
    }
}

#[test]
fn stacks_of_boxes_of_two_particles_an_edge_stand() {
    let tank = "[tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.4]\n";
    for size in [[0.01; 3], [0.02; 3], [0.022; 3], [0.1, 0.02, 0.02], [0.1, 0.1, 0.02]] {
        let height = size[2];
        let bodies: String = (0..3)
            .map(|k| body(&k.to_string(), size, [0.2, 0.2, (f64::from(k) + 0.5) * height], ""))
            .collect();
        let dry = &mut scene(3, -G, &(tank.to_owned() + &bodies));
        dry.run(0.8);
        let mass = 1000.0 * DVec3::from(size).element_product();
        let poses = dry.solids.poses();
        let mut below = 0.0;
        for (k, pose) in poses.iter().enumerate() {
            // what statics say of one spring a contact, whose share of a slab's face is not quite one
            let sag = (3.0 - k as f64) * mass * G / 1e4;
            let sunk = below + height - (pose.position.z + 0.5 * height);
            below = pose.position.z + 0.5 * height;
            assert!(sunk > 0.7 * sag && sunk < 1.4 * sag, "{size:?} {k}: {sunk:e} for {sag:e}");
            assert!(pose.velocity.length() < 1e-3, "{size:?} {k}: {}", pose.velocity);
        }
    }
}

#[test]
fn bodies_in_one_place_are_told_although_no_point_of_theirs_tells() {
    let size = [0.05; 3];
    let dry =
        &mut scene(3, 0.0, &(body("a", size, [0.0, 0.0, 0.0], "") + &body("b", size, [0.06, 0.0, 0.0], "")));
    dry.step();
    let mut states = dry.solids.states();
    states[0].pose = states[1].pose;
    dry.solids.restore(&states).unwrap();
    let told = dry.try_step().expect_err("they are one").to_string();
    assert!(told.contains("\"a\"") && told.contains("with its middle"), "{told}");
}
