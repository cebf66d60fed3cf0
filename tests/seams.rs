//! Bodies over periodic sides: what happens at the seam is what happens in the middle.

use crate::cli::{json, ran};
use crate::common::*;
use glam::DVec3;
use seixo::backend::Processor;
use seixo::case::{Case, ContactDevice};
use seixo::scene::Scene;
use seixo::simulation::Simulation;

/// Length of the tank [m], periodic along x.
const LENGTH: f64 = 1.0;

/// A sliding cube that hits a ball, which rolls against a post and a step of the floor, all `moved` along x over the seam.
fn collisions(law: &str, dimensions: u8, moved: f64) -> Case {
    let x = |at: f64| (at + moved).rem_euclid(LENGTH);
    let (y, round, post) = match dimensions {
        2 => (0.0, "cylinder", ""),
        _ => (0.25, "sphere", "height = 0.3\n"),
    };
    let height = if dimensions == 2 { "axis = [0, 1, 0]\nheight = 0.5\n" } else { "" };
    let axis = if dimensions == 2 { height } else { post };
    case(&format!(
        "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 1.0\ndimensions = {dimensions}\n\
         [tank]\nmin = [0, 0, 0]\nmax = [{LENGTH}, 0.5, 0.5]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n\
         [contact]\nlaw = \"{law}\"\nspring = 2e4\n{}\n\
         [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [{}, {y}, 0.0501]\ndensity = 800\nvelocity = [2, 0, 0]\n\
         standing = true\n\
         [[body]]\nname = \"ball\"\nshape = \"{round}\"\nradius = 0.04\n{height}center = [{}, {y}, 0.0401]\ndensity = 800\n\
         standing = true\n\
         [[obstacle]]\nname = \"post\"\nshape = \"cylinder\"\nradius = 0.05\n{axis}center = [{}, {y}, 0.15]\n\
         [[obstacle]]\nname = \"step\"\nmin = [{}, 0, 0]\nmax = [{}, 0.5, 0.1]\n",
        if law == "smooth" { "friction = 0.3\nrestitution = 0.5" } else { "damping = 0" },
        x(0.15),
        x(0.35),
        x(0.75),
        x(0.65),
        x(0.65) + 0.05,
    ))
}

/// Ways of both bodies from where they started, turns and speeds, after each of `steps` steps.
fn ways(case: &Case, steps: usize, processor: &Processor) -> Vec<[DVec3; 4]> {
    let mut sim = Simulation::on(case, Scene::build(case).expect("it builds"), processor).expect("it starts");
    let start = [0, 1].map(|k| sim.solids.path(k));
    let mut all = vec![];
    for _ in 0..steps {
        sim.step().expect("a step");
        for pose in sim.solids.poses().iter().take(2) {
            assert!((0.0..LENGTH).contains(&pose.position.x), "{}", pose.position);
        }
        let way = |k: usize| sim.solids.path(k) - start[k];
        let spin = |k: usize| sim.solids.poses()[k].angular_velocity;
        all.push([way(0), way(1), spin(0), spin(1)]);
    }
    all
}

fn most_apart(a: &[[DVec3; 4]], b: &[[DVec3; 4]]) -> f64 {
    let apart = |(a, b): (&[DVec3; 4], &[DVec3; 4])| {
        a.iter().zip(b).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max)
    };
    a.iter().zip(b).map(apart).fold(0.0, f64::max)
}

#[test]
fn collisions_over_the_seam_are_those_in_the_middle() {
    for (law, dimensions) in [("smooth", 3), ("smooth", 2), ("paper", 3), ("pressure", 3)] {
        let middle = ways(&collisions(law, dimensions, 0.0), 300, &Processor::Cpu);
        // The ball at the seam, the post at it, the cube at it: each meets another one beyond.
        for moved in [0.55, 0.3, 0.2, 0.75] {
            let seam = ways(&collisions(law, dimensions, moved), 300, &Processor::Cpu);
            let apart = most_apart(&middle, &seam);
            println!("{law} {dimensions}D, {moved}: {apart:.1e}");
            assert!(apart < 1e-7, "{law} {dimensions}D, {moved}: {apart}");
        }
        let ball = middle.iter().map(|m| m[1].x).fold(0.0, f64::max);
        assert!(ball > 0.1, "the ball is pushed on: {ball}");
    }
}

/// A wedge reaches twice as far to its toe as to its heel.
#[test]
fn what_is_not_even_about_its_middle_ends_where_it_does() {
    let build = |x: f64| {
        let text = format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.02\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0.1, 0.4]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n\
             [[obstacle]]\nname = \"w\"\nshape = \"wedge\"\nsize = [0.3, 0.1, 0.1]\ncenter = [{x}, 0.05, 0.0334]\n\
             [[body]]\nname = \"b\"\nsize = [0.06, 0.06, 0.06]\ncenter = [0.3, 0.05, 0.25]\ndensity = 500\n\
             [contact]\nspring = 1e5\n"
        );
        Scene::build(&case(&text)).map_err(|e| e.to_string())
    };
    let (low, high) = (build(0.19), build(0.51));
    assert!(
        low.as_ref().is_err_and(|e| e.contains("x = -0.0100 to 0.2900 m, over a periodic side")),
        "{low:?}"
    );
    assert!(
        high.as_ref().is_err_and(|e| e.contains("x = 0.3100 to 0.6100 m, over a periodic side")),
        "{high:?}"
    );
    for x in [0.205, 0.495] {
        build(x).unwrap_or_else(|e| panic!("{x}: {e}"));
    }
}

#[test]
fn a_device_finds_what_touches_over_the_seam() {
    if !there_is_a_device("contact over seams is not compared") {
        return;
    }
    for law in ["smooth", "paper"] {
        // Boxes alone: the device has no kernel of the smooth law for what is round.
        let at = |moved: f64, device: ContactDevice| {
            let mut case = collisions(law, 3, moved);
            let mut second = case.body[0].clone();
            (second.name, second.center[0], second.velocity) =
                ("second".into(), case.body[1].center[0], [0.0; 3]);
            case.body[1] = second;
            case.obstacle.remove(0);
            if let Some(contact) = &mut case.contact {
                contact.device = device;
            }
            case
        };
        let middle = ways(&at(0.0, ContactDevice::Host), 400, &Processor::Cpu);
        let device =
            |moved: f64| ways(&at(moved, ContactDevice::Gpu), 400, &Processor::Gpu { adapter: None });
        let seam = device(0.3);
        let [apart, of_host] = [device(0.0), middle.clone()].map(|other| most_apart(&seam, &other));
        println!("{law} on the device: {apart:.1e} from the middle, {of_host:.1e} from the host");
        let pushed = middle.iter().map(|m| m[1].x).fold(0.0, f64::max);
        assert!(apart < 1e-9 && of_host < 1e-3 && pushed > 0.02, "{law}: {apart}, {of_host}, {pushed}");
    }
}

#[test]
fn a_block_slides_round_the_tank_as_coulomb_says() {
    let case = case(
        "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -10]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.5, 0.5, 0.5]\nopen = [\"z_max\"]\nperiodic = [\"x\", \"y\"]\n\
         [contact]\nlaw = \"smooth\"\nspring = 1e5\nfriction = 0.2\n\
         [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.2, 0.2, 0.05]\ndensity = 800\nvelocity = [2.4, -1.8, 0]\n\
         standing = true\n",
    );
    let mut sim = simulation(&case);
    let start = sim.solids.path(0);
    while sim.time < 2.2 {
        sim.step().expect("a step");
    }
    // v^2 / (2 mu g) = 2.25 m along a line: 1.8 m along x, 1.35 m against y.
    let way = sim.solids.path(0) - start;
    assert!((way - DVec3::new(1.8, -1.35, 0.0)).truncate().length() < 5e-3, "{way}");
    let rest = sim.solids.poses()[0];
    assert!(rest.velocity.length() < 1e-6 && sim.solids.energy().kinetic < 1e-9, "{rest:?}");
    assert!((0.0..0.5).contains(&rest.position.x) && (0.0..0.5).contains(&rest.position.y));
    // 0.2 + 1.8 and 0.2 - 1.35 m are three or four tanks of 0.5 m on, and three back.
    let turns = (sim.solids.path(0) - rest.position) / 0.5;
    assert!((turns - turns.round()).length() < 1e-9 && turns.x > 2.5 && turns.y < -2.5, "{turns}");
}

#[test]
fn a_run_stopped_beyond_the_seam_goes_on_to_the_last_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(
        folder.path().join("case.toml"),
        "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 0.4\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.5, 0.5, 0.5]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n\
         [contact]\nlaw = \"smooth\"\nspring = 1e5\nfriction = 0.1\n\
         [[body]]\nname = \"fast\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.35, 0.2, 0.05]\ndensity = 800\nvelocity = [1, 0, 0]\n\
         [[body]]\nname = \"waits\"\nshape = \"sphere\"\nradius = 0.05\ncenter = [0.1, 0.2, 0.05]\ndensity = 800\n\
         [output]\nevery = 0.05\n",
    )
    .unwrap();
    let (case, whole, first, second) = (path("case.toml"), path("whole"), path("first"), path("second"));
    let run = |args: &[&str]| {
        let ran = ran(&[&["run", &case, "--backend", "cpu", "-q", "--json"], args].concat());
        assert_eq!(ran.code, 0, "{}", ran.err);
        json(&ran.out)["bodies"].clone()
    };
    let bodies = run(&["-o", &whole]);
    run(&["-o", &first, "--until", "0.22"]);
    assert_eq!(bodies, run(&["-o", &second, "--set", &format!("run.from={first:?}")]));
    // The table tells the way of the first body on beyond the side, the result too; the second is struck over the seam.
    let at = |k: usize| bodies[k]["position_m"][0].as_f64().unwrap();
    assert!(at(0) > 0.5 && at(1) > 0.15, "{} {}", at(0), at(1));
    let table = std::fs::read_to_string(folder.path().join("whole/bodies.csv")).unwrap();
    let xs: Vec<f64> =
        table.lines().skip(1).step_by(2).map(|l| l.split(',').nth(2).unwrap().parse().unwrap()).collect();
    assert!(xs.windows(2).all(|x| (x[1] - x[0]).abs() < 2e-3), "{xs:?}");
}

/// A floating cube, a stone on the floor and water that flows along x, `moved` over the seam.
fn river(moved: f64) -> Case {
    let x = |at: f64| (at + moved).rem_euclid(LENGTH);
    case(&format!(
        "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 1.0\n\
         [tank]\nmin = [0, 0, 0]\nmax = [{LENGTH}, 0.25, 0.5]\nopen = [\"z_max\"]\nperiodic = [\"x\", \"y\"]\n\
         [fluid]\nsound_speed = 5\nsolver = {{ tolerance = 1e-6 }}\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [{LENGTH}, 0.25, 0.2]\nvelocity = [2.0, 0, 0]\n\
         [contact]\nlaw = \"smooth\"\nspring = 2e4\nfriction = 0.1\n\
         [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [{}, 0.125, 0.2]\ndensity = 500\nvelocity = [2.0, 0, 0]\n\
         displaces_fluid = true\n\
         [[body]]\nname = \"stone\"\nsize = [0.1, 0.1, 0.1]\ncenter = [{}, 0.125, 0.05]\ndensity = 1500\n\
         displaces_fluid = true\n",
        x(0.4),
        x(0.65),
    ))
}

#[test]
fn a_current_carries_bodies_over_the_seam_as_through_the_middle() {
    // Lattices at both places are the same, so that only rounding differs, which grows in the water.
    const STEPS: usize = 30;
    let middle = ways(&river(0.0), STEPS, &Processor::Cpu);
    for moved in [0.525, 0.275] {
        let seam = ways(&river(moved), STEPS, &Processor::Cpu);
        let apart = most_apart(&middle, &seam);
        println!("moved by {moved}: {apart:.1e}");
        assert!(apart < 1e-5, "{moved}: {apart}");
    }
    if there_is_a_device("bodies over the seam are not compared") {
        let device = ways(&river(0.525), STEPS / 2, &Processor::Gpu { adapter: None });
        let apart = most_apart(&middle[..STEPS / 2], &device);
        println!("on the device {apart:.1e}");
        assert!(apart < 1e-4, "{apart}");
    }
    let last = middle[middle.len() - 1];
    assert!(last[0].x > 0.05 && last[1].x > 1e-3, "both are carried: {last:?}");
}
