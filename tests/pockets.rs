//! Water that solids and the slots between them enclose: it has the pressure of the water outside.

use crate::common::{case, gauges, mean_over, simulation, there_is_a_device};
use seixo::backend::Processor;
use seixo::case::Case;
use seixo::contact::Solids;
use seixo::params::Params;
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use seixo::slots::Slots;

/// A lid of 0.36 x 0.08 m over a pit full of water, under water, in the plane.
fn lid(spacing: f64, density: f64, spring: f64, above: f64, more: &str) -> Case {
    case(&format!(
        "[run]\nspacing = {spacing}\ntime_step = {}\nadaptive = true\nend = 2\ndimensions = 2\ngravity = [0, 0, -9.81]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.8, 0.1, 0.5]\nopen = [\"z_max\"]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0.2]\nmax = [0.8, 0.1, 0.4]\n\
         [[fluid.block]]\nmin = [0.3, 0, 0]\nmax = [0.5, 0.1, 0.2]\n\
         [[obstacle]]\nname = \"left\"\nmin = [0, 0, 0]\nmax = [0.3, 0.1, 0.2]\n\
         [[obstacle]]\nname = \"right\"\nmin = [0.5, 0, 0]\nmax = [0.8, 0.1, 0.2]\n\
         [contact]\nspring = {spring}\nrestitution = 0.3\nfriction = 0.3\n\
         [[body]]\nname = \"lid\"\nsize = [0.36, 0.1, 0.08]\ncenter = [0.4, 0, {}]\ndensity = {density}\n\
         displaces_fluid = true\n{more}",
        0.05 * spacing,
        0.24 + above
    ))
}

/// Lift on body `k` in the second half of the time until `end` [s] over the weight of the water of `area` [m2] that it displaces.
fn lift(simulation: &mut Simulation, k: usize, area: f64, end: f64) -> f64 {
    let (mut impulse, mut time) = (0.0, 0.0);
    while simulation.time < end {
        let dt = simulation.step().expect("it rests").dt;
        if simulation.time > 0.5 * end {
            (impulse, time) = (impulse + dt * simulation.fluid_force[k].force.z, time + dt);
        }
    }
    impulse / time / (9810.0 * area * simulation.scene.spacing)
}

#[test]
fn a_lid_on_a_full_pit_is_lifted_by_the_water_that_it_displaces() {
    // By the spring of contact it was 2.3, -0.6 and 2.8 of it: the least sag pressed the water in the pit.
    for (density, spring, above) in [(2500.0, 3e4, 0.0), (2500.0, 1e7, 0.0), (4000.0, 2e5, 0.004)] {
        let standing = if above == 0.0 { "standing = true\n" } else { "" };
        let mut simulation = simulation(&lid(0.02, density, spring, above, standing));
        let lift = lift(&mut simulation, 0, 0.36 * 0.08, 1.2);
        println!("{density} kg/m3, K = {spring:e}: {lift:.3}");
        assert!((lift - 1.0).abs() < 0.15, "{density} {spring:e}: {lift}");
    }
}

#[test]
fn the_device_links_pockets_as_the_cpu_does() {
    if !there_is_a_device("pockets are not seen on a device") {
        return;
    }
    let case = lid(0.02, 2500.0, 3e4, 0.0, "standing = true\n");
    let scene = Scene::build(&case).expect("the scene builds");
    let mut runs = [Processor::Cpu, Processor::Gpu { adapter: None }]
        .map(|processor| Simulation::on(&case, scene.clone(), &processor).expect("it starts"));
    let lifts = runs.each_mut().map(|simulation| lift(simulation, 0, 0.36 * 0.08, 0.3));
    println!("{lifts:?}");
    assert!((lifts[0] - lifts[1]).abs() < 0.05, "{lifts:?}");
}

#[test]
fn an_arch_of_blocks_is_not_driven_apart() {
    // The piers were pushed outwards by 2.7 of the water that each displaces.
    let block = |name: &str, size: [f64; 2], x: f64, z: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nsize = [{}, 0.1, {}]\ncenter = [{x}, 0, {z}]\ndensity = 2400\n\
             displaces_fluid = true\nstanding = true\n",
            size[0], size[1]
        )
    };
    let mut simulation = simulation(&case(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nadaptive = true\nend = 2\ndimensions = 2\ngravity = [0, 0, -9.81]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.8, 0.1, 0.5]\nopen = [\"z_max\"]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.8, 0.1, 0.4]\n\
         [contact]\nspring = 2e5\nrestitution = 0.3\nfriction = 0.6\n{}{}{}",
        block("left", [0.1, 0.12], 0.3, 0.06),
        block("right", [0.1, 0.12], 0.5, 0.06),
        block("lintel", [0.36, 0.08], 0.4, 0.16),
    )));
    let lintel = lift(&mut simulation, 2, 0.36 * 0.08, 1.2);
    let across = simulation.fluid_force[0].force.x / (9810.0 * 0.1 * 0.12 * 0.02);
    println!("lintel {lintel:.3}, a pier is pushed by {across:.3}");
    assert!((lintel - 1.0).abs() < 0.2 && across.abs() < 0.4, "{lintel} {across}");
}

/// Rows of rims that look into pockets, and the sum of what comes to them [Pa], with the first body moved along x by `moved` [m].
fn pockets(case: &Case, moved: f64) -> (usize, f64) {
    let scene = Scene::build(case).expect("it builds");
    let mut poses = Solids::new(&scene, case.contact.as_ref()).expect("bodies").poses().to_vec();
    poses[0].position.x += moved;
    let slots = Slots::new(&scene, &Params::new(case, &scene).expect("valid"), false);
    let rows = slots.rows(&poses, |rows| Ok(vec![1000.0; rows.len()])).expect("nothing is read");
    let linked = rows.iter().filter(|row| row.seep.link > 0.0);
    linked.fold((0, 0.0), |(count, sum), row| (count + 1, sum + row.seep.known))
}

#[test]
fn a_pocket_at_a_seam_is_one_as_in_the_middle() {
    // A lid over a pit of 0.2 m, moved there from where it may start.
    let pit = |at: f64, lid: f64, ledges: &[[f64; 2]]| {
        let ledges: String = ledges
            .iter()
            .enumerate()
            .map(|(k, [low, high])| {
                format!("[[obstacle]]\nname = \"{k}\"\nmin = [{low}, 0, 0]\nmax = [{high}, 0, 0.2]\n")
            })
            .collect();
        pockets(
            &case(&format!(
                "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ndimensions = 2\ngravity = [0, 0, -9.81]\n\
                 [tank]\nmin = [0, 0, 0]\nmax = [0.8, 0, 0.5]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n\
                 [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.8, 0, 0.4]\n[contact]\nspring = 1e5\n{ledges}\
                 [[body]]\nname = \"lid\"\nsize = [0.36, 0.1, 0.08]\ncenter = [{lid}, 0, 0.24]\ndensity = 2500\n\
                 displaces_fluid = true\nstanding = true\n"
            )),
            at - lid,
        )
    };
    let middle = pit(0.4, 0.4, &[[0.0, 0.3], [0.5, 0.8]]);
    assert_eq!(middle.0, 2, "the rims at both sides of the pit");
    // Right on the seam, from either side, and beside it: none of it was found there.
    for (at, ledges) in [(0.0, vec![[0.1, 0.7]]), (0.8, vec![[0.1, 0.7]]), (0.74, vec![[0.04, 0.64]])] {
        let seam = pit(at, 0.4, &ledges);
        println!("at {at} m: {seam:?}, in the middle {middle:?}");
        assert!(seam.0 == middle.0 && (seam.1 / middle.1 - 1.0).abs() < 1e-9, "{at}: {seam:?} {middle:?}");
    }
    // Lids end to end over a trench that goes round the tank: a room without an end, and yet closed.
    let lid = |name: &str, y: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nsize = [0.6, 0.4, 0.15]\ncenter = [0.5, {y}, 0.275]\ndensity = 2500\n\
             displaces_fluid = true\nstanding = true\n"
        )
    };
    let trench = case(&format!(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -9.81]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1, 0.8, 0.6]\nopen = [\"z_max\"]\nperiodic = [\"y\"]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0.8, 0.5]\n[contact]\nspring = 1e5\n\
         [[obstacle]]\nname = \"left\"\nmin = [0, 0, 0]\nmax = [0.4, 0.8, 0.2]\n\
         [[obstacle]]\nname = \"right\"\nmin = [0.6, 0, 0]\nmax = [1, 0.8, 0.2]\n{}{}",
        lid("a", 0.2),
        lid("b", 0.6)
    ));
    let found = pockets(&trench, 0.0);
    println!("a trench: {found:?}");
    assert!(found.0 > 16, "{found:?}");
}

#[test]
fn what_is_flat_beside_what_is_round_has_the_water_between() {
    // Less than half a spacing apart at the nearest, whichever stands first in the case.
    let aside = |gap: f64, flat_first: bool, flat: &str| {
        let disc = "[[obstacle]]\nname = \"disc\"\nshape = \"cylinder\"\nradius = 0.06\naxis = [0, 1, 0]\n\
                    center = [0.22, 0, 0.1]\n";
        let flat = format!(
            "{flat}\nname = \"flat\"\nsize = [0.12, 0.02, 0.12]\ncenter = [{}, 0, 0.1]\n",
            0.34 + gap
        );
        let solids = if flat_first { flat + disc } else { disc.to_owned() + &flat };
        let mut simulation = simulation(&case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.2\ndimensions = 2\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.4]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.28]\n{solids}\
             [[gauge.force]]\nname = \"f\"\non = \"flat\"\n"
        )));
        let force = |sim: &mut Simulation| [sim.gauges().expect("a force")[0].1];
        mean_over(&mut simulation, [0.03, 0.06], force)[0]
    };
    // 4.24 N press on each of its sides.
    let still = "[[moving_wall]]\nmotion = [[50, 0, 0, 0], [60, 0, 0, 0.1]]";
    for (gap, kinds) in [(0.0, 1), (0.004, 1), (0.008, 2)] {
        for flat in ["[[obstacle]]", still].into_iter().take(kinds) {
            let [one, other] = [false, true].map(|first| aside(gap, first, flat));
            println!("{gap} m, {flat}: {one} N aside, {other} N");
            assert!(one.abs() < 0.15 && (one - other).abs() < 1e-6, "{gap} m, {flat}: {one} {other}");
        }
    }
}

#[test]
fn a_slab_half_a_spacing_above_the_floor_and_the_floor_bear_the_water_between() {
    // 12 by 3 spacings in 24 by 12 of water.
    let forces = |gap: f64| {
        let mut simulation = simulation(&case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.3\ndimensions = 2\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.48, 0, 0.4]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.48, 0, 0.24]\n\
             [[obstacle]]\nname = \"slab\"\nsize = [0.24, 0.02, 0.06]\ncenter = [0.24, 0, {}]\n\
             [[gauge.force]]\nname = \"slab\"\non = \"slab\"\n\
             [[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n",
            0.03 + gap * 0.02
        )));
        let of = |sim: &mut Simulation| gauges(sim, ["slab_force_z", "floor_force_z"]);
        let found = mean_over(&mut simulation, [0.1, 0.3], of);
        (found, simulation.scene.water() as f64 * simulation.params.particle_mass() * 9.81)
    };
    let lift = 1000.0 * 9.81 * 0.24 * 0.06 * 0.02;
    for gap in [0.475, 0.479, 0.481, 0.485, 0.5, 0.505] {
        let ([slab, floor], weight) = forces(gap);
        println!("{gap}: {slab} N for {lift}, {floor} N on the floor, {weight} N of water");
        assert!(((slab + floor) / -weight - 1.0).abs() < 0.03, "{gap}: {slab} and {floor} N for {weight}");
        if gap > 0.49 {
            assert!((slab / lift - 1.0).abs() < 0.15, "{gap}: {slab} N for {lift}");
        }
    }
}

#[test]
fn an_obstacle_between_a_wall_and_a_body_has_the_water_around_it() {
    // 0.6 spacings from the wall, 0.8 above the floor, 0.6 from the body: 2.82 N of lift. It had none, and 0.4 of it aside.
    let mut simulation = simulation(&case(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.3\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.44]\nopen = [\"z_max\"]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.28]\n\
         [[obstacle]]\nname = \"still\"\nsize = [0.12, 0.02, 0.12]\ncenter = [0.072, 0, 0.076]\n\
         [[body]]\nname = \"held\"\nsize = [0.1, 0.02, 0.12]\ncenter = [0.194, 0, 0.072]\ndisplaces_fluid = true\n\
         locked = [\"x\", \"y\", \"z\", \"rotation_x\", \"rotation_y\", \"rotation_z\"]\n\
         [[gauge.force]]\nname = \"still\"\non = \"still\"\n",
    ));
    let force = |sim: &mut Simulation| [sim.fluid_force[1].force.x, sim.fluid_force[1].force.z];
    let [aside, lift] = mean_over(&mut simulation, [0.03, 0.06], force);
    println!("{lift} N up, {aside} N aside");
    assert!((lift / 2.824 - 1.0).abs() < 0.1 && aside.abs() < 0.5, "{lift} N up, {aside} N aside");
}

#[test]
fn a_body_beside_an_obstacle_presses_it_with_the_water_between() {
    // A disc beside a box and a box beside a disc, at the same height and half a spacing off: 4.2 N press on each side of the box.
    let held = "[[body]]\ndisplaces_fluid = true\nlocked = [\"x\", \"y\", \"z\", \"rotation_x\", \"rotation_y\", \"rotation_z\"]";
    let still = "[[obstacle]]";
    let disc = "shape = \"cylinder\"\nradius = 0.06\naxis = [0, 1, 0]";
    let square = "size = [0.12, 0.02, 0.12]";
    let pairs = [(held, disc, still, square), (still, disc, held, square), (still, square, held, square)];
    for (k, (one, first, other, second)) in pairs.into_iter().enumerate() {
        for gap in [0.0, 0.008, 0.016] {
            for above in [0.0, 0.01] {
                let mut simulation = simulation(&case(&format!(
                    "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.3\ndimensions = 2\n\
                     [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.44]\nopen = [\"z_max\"]\n\
                     [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.28]\n\
                     {one}\nname = \"a\"\n{first}\ncenter = [0.22, 0, 0.1]\n\
                     {other}\nname = \"b\"\n{second}\ncenter = [{}, 0, {}]\n\
                     [[gauge.force]]\nname = \"a\"\non = \"a\"\n[[gauge.force]]\nname = \"b\"\non = \"b\"\n",
                    0.34 + gap,
                    0.1 + above
                )));
                // Bodies come first.
                let force = |sim: &mut Simulation| [sim.fluid_force[1].force.x];
                let [aside] = mean_over(&mut simulation, [0.03, 0.06], force);
                println!("pair {k}, gap {gap} m, {above} m higher: {aside:.3} N aside");
                assert!(aside.abs() < 0.3, "pair {k}, {gap} m, {above} m: {aside} N");
            }
        }
    }
}
