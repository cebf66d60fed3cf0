//! Friction and restitution of pairs of solids: `[[contact.pair]]`.

use crate::common::case;
use crate::common::dry::{Dry, G};
use seixo::case::Case;
use seixo::contact::Solids;
use seixo::scene::Scene;

/// Blocks side by side on a slope of 20 degrees; `pairs` say what is between them and it.
fn on_a_slope(pairs: &str) -> Dry {
    let (sin, cos) = 20_f64.to_radians().sin_cos();
    let blocks = ["dry block", "wet block", "wet brick", "sledge"].iter().enumerate().map(|(k, name)| {
        let up = 0.05 + 1e-6;
        format!(
            "[[body]]\nname = \"{name}\"\nsize = [0.2, 0.1, 0.1]\ncenter = [{}, {}, {}]\nmass = 1\n\
             orientation = {{ axis = [0, 1, 0], angle_deg = 20 }}\n",
            up * sin,
            0.3 * k as f64,
            up * cos
        )
    });
    Dry::new(&format!(
        "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -{G}]\n\
         [[plane]]\nname = \"slope\"\ncenter = [0, 0, 0]\nnormal = [{sin}, 0, {cos}]\nalong = [{cos}, 0, {}]\nsize = [9, 3]\n{}\
         [contact]\nspring = 1e5\nrestitution = 0.2\nfriction = 0.5\n{pairs}",
        -sin,
        blocks.collect::<String>()
    ))
}

#[test]
fn each_pair_has_its_own_friction() {
    let mut dry = on_a_slope(
        "[[contact.pair]]\nbetween = [\"wet*\", \"slope\"]\nfriction = 0.3\n\
         [[contact.pair]]\nbetween = [\"slope\", \"wet brick\"]\nfriction = 0.1\n\
         [[contact.pair]]\nbetween = [\"*\", \"sledge\"]\nfriction = 0\n",
    );
    let (sin, cos) = 20_f64.to_radians().sin_cos();
    let poses = dry.run(1.0);
    for (pose, mu) in poses.iter().zip([f64::INFINITY, 0.3, 0.1, 0.0]) {
        let exact = (G * (sin - mu * cos)).max(0.0);
        let speed = pose.velocity.length();
        println!("mu {mu}: {speed:.5} for {exact:.5}");
        assert!((speed - exact).abs() < 2e-3 * G * sin, "mu {mu}: {speed} for {exact}");
    }
}

#[test]
fn each_pair_has_its_own_restitution() {
    let mut dry = Dry::new(&format!(
        "[run]\nspacing = 0.02\ntime_step = 5e-4\nend = 1\ngravity = [0, 0, -{G}]\n\
         [[obstacle]]\nname = \"rubber\"\nmin = [0, 0, -0.1]\nmax = [0.4, 0.4, 0]\n\
         [[obstacle]]\nname = \"lead\"\nmin = [1, 0, -0.1]\nmax = [1.4, 0.4, 0]\n\
         [[moving_wall]]\nname = \"belt\"\nmin = [2, 0, -0.1]\nmax = [2.4, 0.4, 0]\nmotion = [[0, 0, 0, 0], [1, 0.1, 0, 0]]\n\
         [[body]]\nname = \"a\"\nshape = \"sphere\"\nradius = 0.05\ncenter = [0.2, 0.2, 0.25]\nmass = 1\n\
         [[body]]\nname = \"b\"\nshape = \"sphere\"\nradius = 0.05\ncenter = [1.2, 0.2, 0.25]\nmass = 1\n\
         [[body]]\nname = \"c\"\nshape = \"sphere\"\nradius = 0.05\ncenter = [2.2, 0.2, 0.25]\nmass = 1\n\
         [contact]\nspring = 1e5\nrestitution = 0.5\n\
         [[contact.pair]]\nbetween = [\"*\", \"rubber\"]\nrestitution = 0.9\n\
         [[contact.pair]]\nbetween = [\"lead\", \"b\"]\nrestitution = 0.1\n"
    ));
    let fall = (2.0 * G * 0.2_f64).sqrt();
    let mut highest = [0.0_f64; 3];
    while dry.time() < 0.4 {
        for (most, pose) in highest.iter_mut().zip(dry.step()) {
            *most = most.max(pose.velocity.z);
        }
    }
    for (speed, e) in highest.iter().zip([0.9, 0.1, 0.5]) {
        println!("{} for {e}", speed / fall);
        assert!((speed / fall - e).abs() < 0.01, "{} for {e}", speed / fall);
    }
}

#[test]
fn a_body_against_another_and_against_all_of_the_tank() {
    // A board is drawn away under a box by its weight's share alone: the box has friction with the board, the board none with the tank.
    let mut dry = Dry::new(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -{G}]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [3, 1, 1]\n\
         [[body]]\nname = \"board\"\nsize = [0.8, 0.4, 0.04]\ncenter = [1.0, 0.5, 0.02]\nmass = 2\nvelocity = [1, 0, 0]\n\
         [[body]]\nname = \"box\"\nsize = [0.2, 0.2, 0.2]\ncenter = [1.0, 0.5, 0.14]\nmass = 1\n\
         [contact]\nspring = 1e5\nrestitution = 0.2\nfriction = 0.7\n\
         [[contact.pair]]\nbetween = [\"board\", \"tank\"]\nfriction = 0\n\
         [[contact.pair]]\nbetween = [\"box\", \"board\"]\nfriction = 0.2\n"
    ));
    // They have one velocity after 2/3 / (0.2 g) = 0.34 s.
    let poses = dry.run(0.2);
    let (board, cube) = (poses[0].velocity.x, poses[1].velocity.x);
    println!("{board} {cube}");
    assert!((cube - 0.2 * G * 0.2).abs() < 4e-3 && (2.0 * board + cube - 2.0).abs() < 1e-6, "{board} {cube}");
    let poses = dry.run(0.6);
    assert!(poses.iter().all(|p| (p.velocity.x - 2.0 / 3.0).abs() < 2e-3), "{poses:?}");
}

#[test]
fn a_heavy_body_beside_a_light_one_is_spoken_of() {
    for (mass, told) in [(11.0, true), (5.0, false)] {
        let dry = Dry::new(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n[tank]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\n\
             [[body]]\nname = \"light\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.5, 0.5, 0.05]\nmass = 1\nstanding = true\n\
             [[body]]\nname = \"heavy\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.5, 0.5, 0.17]\nmass = {mass}\n\
             [contact]\nspring = 1e7\nrestitution = 0.3\n"
        ));
        let words = dry.solids.advice(1e-3).words.join("\n");
        assert_eq!(words.contains("11 times the lightest"), told, "{words}");
    }
}

#[test]
fn pairs_that_mean_nothing_are_refused_with_what_there_is() {
    let text = |pairs: &str| {
        format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n[tank]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\n\
             [[obstacle]]\nname = \"post\"\nmin = [0.8, 0, 0]\nmax = [1, 1, 0.4]\n\
             [[body]]\nname = \"box\"\nsize = [0.2, 0.2, 0.2]\ncenter = [0.3, 0.5, 0.1]\nmass = 1\n\
             [contact]\nspring = 1e5\n{pairs}"
        )
    };
    let built = |pairs: &str| {
        let case = case(&text(pairs));
        let scene = Scene::build(&case).unwrap();
        Solids::new(&scene, case.contact.as_ref()).map(drop).map_err(|e| e.to_string())
    };
    let pair = |a: &str, b: &str| format!("[[contact.pair]]\nbetween = [\"{a}\", \"{b}\"]\nfriction = 0.1\n");
    assert_eq!(built(&pair("box", "post")), Ok(()));
    let unknown = built(&pair("box", "pots")).unwrap_err();
    for part in ["contact.pair.0.between", "nothing is called `pots`", "post", "tank.z_min"] {
        assert!(unknown.contains(part), "{part} in {unknown}");
    }
    for (a, b) in [("post", "tank"), ("box", "box"), ("tank*", "post")] {
        let apart = built(&pair(a, b)).unwrap_err();
        assert!(apart.contains("cannot touch"), "{a} {b}: {apart}");
        assert_eq!(apart.contains("they are one solid"), a == b, "{apart}");
    }
    for (pairs, said) in [
        ("[[contact.pair]]\nbetween = [\"box\", \"post\"]\n", "without numbers"),
        ("[[contact.pair]]\nbetween = [\"box\", \"post\"]\nfriction = -1\n", "out of range"),
        (
            "damping_ratio = 0.1\n[[contact.pair]]\nbetween = [\"box\", \"post\"]\nrestitution = 0.3\n",
            "exclude each other",
        ),
        (
            "law = \"paper\"\n[[contact.pair]]\nbetween = [\"box\", \"post\"]\nfriction = 0.3\n",
            "belongs to law",
        ),
    ] {
        let wrong = text(pairs).parse::<Case>().unwrap_err().to_string();
        assert!(wrong.contains(said), "{said} in {wrong}");
    }
}

/// Two solids that fall onto a floor, one on the other, with the tables of `solids` in that order.
fn one_on_the_other(solids: [&str; 2]) -> Dry {
    Dry::new(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -{G}]\n\
         [[obstacle]]\nname = \"floor\"\nmin = [-0.3, -0.3, -0.1]\nmax = [0.3, 0.3, 0]\n\
         [[body]]\n{}[[body]]\n{}\
         [contact]\nspring = 2e4\nfriction = 0.3\nrestitution = 0.4\n\
         [[contact.pair]]\nbetween = [\"upper\", \"lower\"]\nrestitution = 0.8\n",
        solids[0], solids[1]
    ))
}

#[test]
fn the_order_of_the_tables_changes_no_contact() {
    let ball = "shape = \"sphere\"\nradius = 0.04\n";
    let roll = "shape = \"cylinder\"\nradius = 0.04\nheight = 0.12\naxis = [0, 1, 0.2]\n";
    let brick = "size = [0.12, 0.1, 0.08]\norientation = { axis = [1, 0.3, 0.2], angle_deg = 8 }\n";
    for (upper, lower) in
        [(ball, ball), (ball, roll), (ball, brick), (brick, roll), (roll, roll), (brick, brick)]
    {
        let upper = format!(
            "name = \"upper\"\n{upper}center = [0.01, -0.01, 0.2]\ndensity = 900\nvelocity = [0, 0, -2]\nangular_velocity = [4, 0, 0]\n"
        );
        let lower = format!(
            "name = \"lower\"\n{lower}center = [0, 0, 0.08]\ndensity = 700\nangular_velocity = [1, 3, 2]\n"
        );
        let mut there = one_on_the_other([&upper, &lower]);
        let mut back = one_on_the_other([&lower, &upper]);
        let (there, back) = (there.run(0.15), back.run(0.15));
        for (p, q) in [(there[0], back[1]), (there[1], back[0])] {
            let turned = (p.angular_velocity - q.angular_velocity).length();
            let apart = (p.velocity - q.velocity).length();
            println!("{:.4} {:.4}: {apart:.1e} m/s, {turned:.1e} rad/s", p.velocity, q.velocity);
            assert!(apart < 1e-10 && turned < 1e-8, "{p:?} {q:?}\n{upper}{lower}");
        }
    }
}
