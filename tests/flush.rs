//! Walls that move into other walls, and planes close above a floor: what still water presses on them.

use crate::common;
use common::*;
use seixo::backend::Processor;
use seixo::case::Case;
use seixo::error::Error;
use seixo::gauges::Gauges;
use seixo::output::table::Cell;
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use std::collections::BTreeMap;

const L0: f64 = 0.02;
/// Weight of a square metre of a slice of water [N/m2].
const WEIGHT: f64 = 9810.0 * L0;
const DEPTH: f64 = 0.28;

/// Means of the gauges 0.6 to 0.9 s after the start.
fn at_rest(case: &Case, on: &Processor) -> BTreeMap<String, f64> {
    let scene = Scene::build(case).unwrap_or_else(|e| panic!("{e}"));
    let gauges = Gauges::new(case, &scene).expect("the gauges find their walls");
    let mut sim = Simulation::on(case, scene, on).expect("the simulation starts");
    let (mut sums, mut count) = (vec![0.0; gauges.header().len()], 0.0);
    while sim.time < 0.9 {
        sim.step().expect("a wall that moves out of the way is no trouble");
        if sim.time >= 0.6 {
            let cells = gauges.row(&mut sim).expect("the gauges can be read");
            let numbers = cells.into_iter().map(|cell| if let Cell::Number(x) = cell { x } else { f64::NAN });
            sums.iter_mut().zip(numbers).for_each(|(sum, x)| *sum += x);
            count += 1.0;
        }
    }
    gauges.header().into_iter().zip(sums.into_iter().map(|sum| sum / count)).collect()
}

/// Water on both sides of a gate that goes by `up` [m] in a quarter of a second, by the keys of its table, with other walls and gauges.
fn gate(keys: &str, up: f64, others: &str) -> Case {
    case(&format!(
        "[run]\nspacing = {L0}\ntime_step = 2e-3\nadaptive = true\nend = 1.0\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.46, 0, 0.5]\nopen = [\"z_max\"]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 0, {DEPTH}]\n\
         [[fluid.block]]\nmin = [0.26, 0, 0]\nmax = [0.46, 0, {DEPTH}]\n{others}{keys}\n\
         motion = [[0, 0, 0, 0], [0.05, 0, 0, 0], [0.35, 0, 0, {up}], [0.4, 0, 0, {up}]]\n\
         [[gauge.force]]\nname = \"gate\"\non = \"gate\"\n"
    ))
}

#[test]
fn a_gate_raised_into_the_wall_above_leaves_it_the_load() {
    let sill = "[[obstacle]]\nname = \"sill\"\nmin = [0.2, 0, 0.1]\nmax = [0.26, 0, 0.5]\n\
                [[gauge.force]]\nname = \"sill\"\non = \"sill\"\n\
                [[gauge.pressure]]\nname = \"p\"\npoint = [0.23, 0, 0.1]\n";
    let walls = "[[moving_wall]]\nname = \"gate\"\nmin = [0.2, 0, 0]\nmax = [0.26, 0, 0.1]";
    let body = "[[body]]\nname = \"gate\"\nsize = [0.06, 0.1, 0.1]\ncenter = [0.23, 0, 0.05]";
    // The water that filled the gate's place has come from both sides.
    let depth = DEPTH - 0.06 * 0.1 / 0.4;
    let (pressure, lift) = (9810.0 * (depth - 0.1), 0.06 * (depth - 0.1) * WEIGHT);
    // Flush with the wall's underside, and half a spacing behind it.
    let all = [(walls, 0.1), (walls, 0.11), (body, 0.1), (body, 0.11)].map(|of| (of, Processor::Cpu));
    let device = processors("a gate on a device is not tested").into_iter().skip(1);
    for ((keys, up), on) in all.into_iter().chain(device.map(|on| ((walls, 0.1), on))) {
        let found = at_rest(&gate(keys, up, sill), &on);
        let p = found["p [Pa]"] / pressure;
        let (gate, sill) = (found["gate_force_z [N]"] / lift, found["sill_force_z [N]"] / lift);
        let name = &keys[2..7];
        println!("{name} up by {up}: pressure {p:.3}, lift of the gate {gate:.3}, of the wall {sill:.3}");
        assert!((p - 1.0).abs() < 0.1, "{name}, {up}: {p}");
        assert!(gate.abs() < 0.01 && (sill - 1.0).abs() < 0.1, "{name}, {up}: {gate}, {sill}");
    }
}

#[test]
fn a_gate_sunk_into_the_floor_leaves_it_the_load() {
    let walls = "[[moving_wall]]\nname = \"gate\"\nmin = [0.2, 0, 0]\nmax = [0.26, 0, 0.36]";
    let others = "[[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n\
                  [[gauge.pressure]]\nname = \"p\"\npoint = [0.23, 0, 0]\n";
    let depth = DEPTH * 0.4 / 0.46;
    let found = at_rest(&gate(walls, -0.36, others), &Processor::Cpu);
    let p = found["p [Pa]"] / (9810.0 * depth);
    let load = (found["floor_force_z [N]"] + found["gate_force_z [N]"]) / (-0.4 * DEPTH * WEIGHT);
    println!("pressure {p:.3}, load {load:.3}");
    assert!((p - 1.0).abs() < 0.1 && (load - 1.0).abs() < 0.03, "{p}, {load}");
}

/// Its rows are where the floor's cells begin, or its second layer where the floor's first is.
#[test]
fn a_plane_close_above_a_floor_bears_the_water() {
    for height in [1.3, 1.34, 1.4, 1.45, 1.5, 2.5] {
        let bed = height * L0;
        let case = case(&format!(
            "[run]\nspacing = {L0}\ntime_step = 2e-3\nadaptive = true\nend = 1.0\ndimensions = 2\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.4]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.fill]]\nseed = [0.2, 0, 0.1]\nlevel = 0.2\n\
             [[plane]]\nname = \"bed\"\ncenter = [0.2, 0, {bed}]\nnormal = [0, 0, 1]\nalong = [1, 0, 0]\nsize = [0.6, 0.4]\n\
             [[gauge.force]]\nname = \"bed\"\non = \"bed\"\n[[gauge.pressure]]\nname = \"p\"\npoint = [0.2, 0, {bed}]\n"
        ));
        let weight = Scene::build(&case).expect("the scene builds").water() as f64 * L0 * L0 * WEIGHT;
        let found = at_rest(&case, &Processor::Cpu);
        let (load, p) = (-found["bed_force_z [N]"] / weight, found["p [Pa]"] * 0.4 * L0 / weight);
        println!("{height} spacings above the floor: load {load:.3}, pressure {p:.3}");
        assert!((load - 1.0).abs() < 0.05 && (p - 1.0).abs() < 0.05, "{height}: {load}, {p}");
    }
}

#[test]
fn a_wall_that_begins_within_others_alone_is_refused() {
    let keys = "[[moving_wall]]\nname = \"gate\"\nmin = [-0.06, 0, 0]\nmax = [0, 0, 0.4]";
    match Scene::build(&gate(keys, 0.1, "")) {
        Err(Error::Case(why)) => {
            let problem = &why.problems[0];
            assert_eq!(problem.key, "moving_wall.0");
            assert!(problem.message.contains("nothing is left of it"), "{}", problem.message);
        }
        other => panic!("built: {other:?}"),
    }
}

/// Rows of two walls in one place have more neighbours than twice a lattice's.
#[test]
fn a_piston_goes_back_into_the_wall_behind_it() {
    let case = case(
        "[run]\nspacing = 0.02\ntime_step = 2e-3\nend = 1.0\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.36, 0, 0.4]\nopen = [\"z_max\"]\n\
         [fluid]\n[[fluid.block]]\nmin = [0.06, 0, 0]\nmax = [0.36, 0, 0.2]\n\
         [[moving_wall]]\nname = \"piston\"\nmin = [0, 0, 0]\nmax = [0.06, 0, 0.3]\n\
         motion = [[0, 0, 0, 0], [0.02, 0, 0, 0], [0.32, -0.06, 0, 0], [0.4, -0.06, 0, 0]]\n",
    );
    for on in processors("a piston on a device is not tested") {
        let scene = Scene::build(&case).expect("the scene builds");
        let mut sim = Simulation::on(&case, scene, &on).expect("the simulation starts");
        while sim.time < 0.35 {
            sim.step().unwrap_or_else(|e| panic!("at {} s: {e}", sim.time));
        }
        let most = sim.observe().expect("it can be looked at").1.neighbours_max;
        let lattice = sim.params.neighbours;
        println!("{most} neighbours at most, {lattice} of a lattice");
        assert!(most > 2 * lattice || !matches!(on, Processor::Cpu), "{most}");
    }
}
