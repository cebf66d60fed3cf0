//! The energy ledger: its entries account for every change of the energy, to round-off.

use crate::common;
use common::*;
use seixo::backend::Processor;
use seixo::case::{Absorber, Case, Face, MovingWall};
use seixo::checkpoint::Archive;
use seixo::ledger::{Entry, Ledger};
use seixo::plan::Stage;
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use std::sync::Arc;

/// Energy of water and free bodies [J].
fn energy(sim: &mut Simulation) -> f64 {
    let water = sim.backend.monitor().expect("measured");
    water.kinetic + water.potential + sim.solids.energy().total()
}

/// Of a run, step by step: its ledger, the energy less that at the start less the ledger, and the energy at the start; and what the sums of a device
/// have rounded off at the end.
struct Booked {
    ledger: Vec<Ledger>,
    open: Vec<f64>,
    start: f64,
    rounded_off: Vec<f32>,
}

/// Runs `case` for `steps` steps. The last `shot` particles are shot up, so fast that their displacements are shortened,
/// and out of the domain.
fn booked(case: &Case, processor: &Processor, steps: usize, shot: usize) -> Booked {
    let mut case = case.clone();
    case.output.ledger = true;
    let scene = Arc::new(Scene::build(&case).expect("a valid scene"));
    let mut sim = Simulation::on(&case, scene, processor).expect("it starts");
    let mut fields = sim.backend.read().expect("readable");
    let fluid = sim.groups.fluid;
    fields.velocity[fluid - shot..fluid].fill(12.0 * glam::DVec3::Z);
    sim.backend.write(&fields).expect("writable");
    let start = energy(&mut sim);
    let mut out = Booked { ledger: Vec::new(), open: Vec::new(), start, rounded_off: Vec::new() };
    for _ in 0..steps {
        sim.step().expect("a step");
        let ledger = sim.ledger().expect("kept").expect("asked for");
        out.open.push(energy(&mut sim) - start - ledger.total());
        out.ledger.push(ledger);
    }
    let ledger = out.ledger.last().expect("a step");
    for entry in Entry::ALL {
        println!("{:10} {:+.3e}", entry.name(), ledger.get(entry) / start);
    }
    if *processor != Processor::Cpu {
        let (mut state, mut sums) = (Archive::in_memory(), Vec::<[f32; 2]>::new());
        sim.exchange(&mut state).expect("a state");
        state.into_restore().array("ledger_sum", &mut sums, false).expect("in the state");
        out.rounded_off.extend(sums.iter().map(|&[_, rest]| rest));
    }
    out
}

/// The ledger of a run on the CPU closes to 1e-10 of the energy at the start all the way.
fn closes(case: &Case, steps: usize, shot: usize) -> (Ledger, f64) {
    let Booked { ledger, open, start, .. } = booked(case, &Processor::Cpu, steps, shot);
    for (step, open) in open.iter().enumerate() {
        assert!(open.abs() < 1e-10 * start, "step {step}: {open:e} of {start} J, {:?}", ledger[step]);
    }
    (ledger[steps - 1], start)
}

#[test]
fn the_ledger_of_a_collapse_closes_with_either_scheme() {
    for preset in ["accurate", "paper"] {
        let mut case = dam_break(0.04, 2e-3, &format!("preset = \"{preset}\"\nviscosity = 1e-4"));
        case.absorber = vec![Absorber { min: [0.0; 3], max: [2.0; 3], towards: Face::XMax, rate: Some(2.0) }];
        let (ledger, start) = closes(&case, 150, 5);
        let of_water =
            [Entry::Gravity, Entry::Viscosity, Entry::Collision, Entry::Pressure, Entry::Clip, Entry::Clamps];
        for entry in of_water {
            assert!(ledger.get(entry).abs() > 1e-6 * start, "{preset}: {}", entry.name());
        }
        assert!(ledger.get(Entry::Viscosity) < 0.0 && ledger.get(Entry::Collision) < 0.0);
        assert!(ledger.get(Entry::Absorber) < -1e-4 * start, "{preset}");
        assert!(ledger.get(Entry::Lost) != 0.0, "{preset}: nothing is lost");
        assert_eq!(ledger.get(Entry::Contact), 0.0);
    }
}

#[test]
fn the_ledger_closes_with_a_gate_and_a_body_and_shows_what_they_put_in() {
    let mut case: Case = toml::from_str(include_str!("../cases/floating_cube.toml")).expect("a valid case");
    case.run.spacing = 0.018;
    // A plate that is pushed into the water beside the cube, which starts below its draft and bobs.
    case.moving_wall = vec![MovingWall {
        name: "plate".into(),
        min: Some([0.018, 0.018, 0.135]),
        max: Some([0.036, 0.252, 0.225]),
        motion: vec![[0.0; 4], [0.1, 0.0, 0.0, -0.05]],
        ..MovingWall::default()
    }];
    let (ledger, start) = closes(&case, 250, 0);
    for entry in [Entry::Walls, Entry::Exchange, Entry::Contact] {
        assert!(ledger.get(entry).abs() > 1e-9 * start, "{}", entry.name());
    }
    assert!(ledger.get(Entry::Walls) > 0.0, "the plate lifts the water");
}

#[test]
fn a_device_books_the_same_in_single_precision() {
    if !crate::common::there_is_a_device("the ledger of the device is not compared") {
        return;
    }
    // Enough for the particles that are shot up to have left a domain that is not high.
    const STEPS: usize = 60;
    for preset in ["accurate", "paper"] {
        let mut case = dam_break(0.045, 2e-3, &format!("preset = \"{preset}\"\nviscosity = 1e-4"));
        case.tank.as_mut().expect("a tank").max[0] = 1.5;
        case.obstacle.clear();
        case.run.domain = Some([[-0.25; 3], [1.75, 0.75, 0.6]]);
        case.absorber = vec![Absorber { min: [0.0; 3], max: [2.0; 3], towards: Face::XMax, rate: Some(2.0) }];
        let device = booked(&case, &Processor::Gpu { adapter: None }, STEPS, 5);
        let cpu = booked(&case, &Processor::Cpu, 20, 5);
        // Before the two drift apart.
        let (a, b) = (&device.ledger[19], &cpu.ledger[19]);
        let most = Entry::ALL.map(|e| b.get(e).abs()).into_iter().fold(0.0, f64::max);
        for entry in Entry::ALL {
            let (a, b) = (a.get(entry), b.get(entry));
            println!("{:10} {a:+.6e} {b:+.6e}", entry.name());
            assert!((a - b).abs() < 1e-4 * most, "{preset}, {}: {a} for {b} J", entry.name());
        }
        let open = device.open.iter().fold(0.0_f64, |m, o| m.max(o.abs())) / device.start;
        println!("{preset}: open by {open:e}");
        assert!(open < 1e-5, "{open:e}");
        // Compilers that take a sum for exact would have it that nothing is.
        assert!(device.rounded_off.iter().any(|&rest| rest != 0.0), "{preset}: the sums round nothing off");
        let last = &device.ledger[STEPS - 1];
        assert!(last.get(Entry::Absorber) < 0.0);
        assert!(last.get(Entry::Lost) != 0.0 && last.get(Entry::Clamps) != 0.0);
    }
}

#[test]
fn without_being_asked_for_nothing_is_kept() {
    let mut sim = simulation(&dam_break(0.05, 2e-3, ""));
    sim.step().expect("a step");
    assert_eq!(sim.ledger().expect("no device"), None);
    assert!(sim.backend.ledger().expect("no device").is_none());
    assert!(!sim.plan.ledger && !sim.plan.has(Stage::BodyForce));
}

#[test]
fn gravity_along_a_seam_is_work_on_bodies_and_no_height() {
    // A block that slides over the seam, of half of all the mass.
    let at = |x: f64| {
        case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ndimensions = 2\ngravity = [1.5, 0, -9.8]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.3]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.1]\n[contact]\nspring = 1e5\n\
             [[body]]\nname = \"block\"\nsize = [0.08, 0.1, 0.08]\ncenter = [{x}, 0, 0.04]\ndensity = 5000\n\
             displaces_fluid = true\nstanding = true\n"
        ))
    };
    let start = |x: f64| simulation(&at(x)).solids.energy().gravity;
    assert!((start(0.1) / start(0.3) - 1.0).abs() < 1e-12, "{} {}", start(0.1), start(0.3));
    let (ledger, _) = closes(&at(0.34), 300, 0);
    let mut sim = simulation(&at(0.34));
    let mut driven = [0.0; 2];
    for _ in 0..300 {
        sim.step().expect("a step");
        let of_water = sim.backend.monitor().expect("measured").momentum[0];
        let of_block = sim.solids.momentum().0.x;
        driven = [driven[0] + 1.5e-3 * of_water, driven[1] + 1.5e-3 * of_block];
    }
    assert!(sim.solids.path(0).x > 0.4 && sim.solids.poses()[0].position.x < 0.2, "it is over the seam");
    let (all, booked) = (driven[0] + driven[1], ledger.get(Entry::Gravity));
    println!("driven {driven:.5?} J, booked {booked:.5}");
    assert!(driven[1] > 0.3 * all && (booked / all - 1.0).abs() < 0.1, "{booked} J of {driven:?}");
}
