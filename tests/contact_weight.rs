//! What a weight at rest presses in: as much where nothing bounces, and told where it is more than a body can bear.

use crate::common::dry::{Dry, G};

/// A cube of 0.1 m and 1 kg, on it one of `heavy` [kg], on a floor.
fn pile(heavy: f64, spring: f64, restitution: f64) -> Dry {
    Dry::new(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -{G}]\n\
         [tank]\nmin = [0, -0.5, 0]\nmax = [3, 0.5, 1.5]\nopen = [\"z_max\"]\n\
         [[body]]\nname = \"low\"\nsize = [0.1, 0.1, 0.1]\ncenter = [1, 0, 0.05]\nmass = 1\n\
         [[body]]\nname = \"high\"\nsize = [0.1, 0.1, 0.1]\ncenter = [1, 0, 0.15]\nmass = {heavy}\n\
         [contact]\nspring = {spring:e}\nfriction = 0.3\nrestitution = {restitution}\n"
    ))
}

#[test]
fn what_does_not_bounce_rests_on_about_the_spring_of_the_case() {
    let plan = |restitution| pile(1.0, 1e7, restitution).solids.advice(1e-3);
    assert!(plan(0.0).substeps.unwrap() <= plan(0.1).substeps.unwrap() + 32);
    assert!(plan(0.0).spring_softest > 0.9e7, "{:?}", plan(0.0).words);
    let mut dry = pile(1.0, 1e7, 0.0);
    let sunk = 0.05 - dry.run(1.0)[0].position.z;
    let asked = 2.0 * G / 1e7;
    assert!(sunk > 0.9 * asked && sunk < 1.7 * asked, "{sunk:e} for {asked:e}");
}

#[test]
fn a_weight_that_squeezes_a_body_out_is_told_with_the_spring_that_carries_it() {
    let squeezed = pile(1e4, 1e7, 0.3);
    let words = squeezed.solids.advice(1e-3).words.join("\n");
    assert!(words.contains("the weight of the heaviest body alone"), "{words}");
    let mut squeezed = squeezed;
    let told = (0..400).find_map(|_| squeezed.try_step().err()).expect("it is squeezed out").to_string();
    let spring = told.split("contact.spring = ").nth(1).and_then(|t| t.split(' ').next()).expect(&told);
    let mut stands = pile(1e4, spring.parse().expect(&told), 0.3);
    assert!(!stands.solids.advice(1e-3).words.join("\n").contains("the weight of the heaviest body alone"));
    let poses = stands.run(0.6);
    // it swings by twice what it sinks by at rest, on each of two contacts
    assert!((poses[1].position.z - 0.15).abs() < 0.012, "{poses:?}");
}
