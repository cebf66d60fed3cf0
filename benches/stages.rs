//! Each stage of the CPU path by itself, on the paper's dam break at l0 = 0.02 m after 60 steps (63,000 particles), and
//! a contact step of a resting cube. `cargo bench` runs all, `cargo bench -- neighbour_list` one.
#![allow(missing_docs)]

use divan::Bencher;
use divan::counter::ItemsCount;
use seixo::backend::cpu::Cpu;
use seixo::backend::{Backend, Processor};
use seixo::body::Wrench;
use seixo::case::Case;
use seixo::case::file::load;
use seixo::contact::Solids;
use seixo::params::{Params, Step};
use seixo::plan::{ParticleStage, Plan, Stage};
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use std::cell::RefCell;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock};

const STEPS: u64 = 60;

fn case(name: &str, spacing: Option<f64>) -> (Case, Scene) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(name);
    let case = load(&path, spacing, &[]).expect("the case is valid").case;
    let scene = Scene::build(&case).expect("the scene builds");
    (case, scene)
}

/// The dam break in motion, stopped before the pressure is solved; the step that it is in.
fn dam_break() -> (Cpu, Step, usize) {
    let (case, scene) = case("dam_break_transport.toml", Some(0.02));
    let scene = Arc::new(scene);
    let mut sim = Simulation::on(&case, scene.clone(), &Processor::Cpu).expect("the simulation starts");
    for _ in 0..STEPS {
        sim.step().expect("the dam breaks");
    }
    let params = Params::new(&case, &scene).expect("valid");
    let plan = Plan::new(&case, &scene, &params);
    let mut cpu = Cpu::new(&scene, &params, &plan, sim.settings()).expect("the CPU can");
    cpu.write(&sim.backend.read().expect("readable")).expect("writable");
    let step = params.step(sim.time, case.run.time_step, 2.0);
    cpu.move_solids(sim.solids.predict(
        step.time,
        step.dt,
        step.ahead,
        sim.params.explicit_gravity(),
        !sim.plan.coupled,
    ))
    .expect("solids move");
    for stage in [
        ParticleStage::Predict,
        ParticleStage::CellList,
        ParticleStage::NeighbourList,
        ParticleStage::NumberDensity,
        ParticleStage::PressureSource,
    ] {
        cpu.run(stage, &step).expect("the stage runs");
    }
    (cpu, step, scene.groups.total())
}

/// Stages that are calls of [`Backend::run`], and the solve.
const STAGES: [Stage; 10] = [
    Stage::Viscosity,
    Stage::Predict,
    Stage::CellList,
    Stage::NeighbourList,
    Stage::Collision,
    Stage::NumberDensity,
    Stage::PressureSource,
    Stage::ConjugateGradient,
    Stage::PressureGradient,
    Stage::Correct,
];

fn main() {
    divan::main();
}

#[divan::bench(args = STAGES.map(Stage::name), sample_count = 40, sample_size = 1)]
fn dam_break_stage(bencher: Bencher, name: &str) {
    static STATE: OnceLock<Mutex<(Cpu, Step, usize)>> = OnceLock::new();
    let mut state = STATE.get_or_init(|| Mutex::new(dam_break())).lock().expect("no stage has failed");
    let (cpu, step, particles) = &mut *state;
    let stage = STAGES.into_iter().find(|s| s.name() == name).expect("one of them");
    let (fields, cpu) = (cpu.fields().clone(), RefCell::new(cpu));
    bencher
        .counter(ItemsCount::new(*particles))
        .with_inputs(|| cpu.borrow_mut().fields_mut().clone_from(&fields))
        .bench_local_values(|()| match stage.over_particles() {
            Some(stage) => cpu.borrow_mut().run(stage, step).expect("the stage runs"),
            None => drop(cpu.borrow_mut().solve_pressure(step).expect("the solver runs")),
        });
    cpu.borrow_mut().fields_mut().clone_from(&fields);
}

#[divan::bench]
fn resting_cube_contact(bencher: Bencher) {
    let (case, scene) = case("resting_cube.toml", None);
    let dt = case.run.time_step;
    let mut solids = Solids::new(&scene, case.contact.as_ref()).expect("the contact starts");
    let dry = vec![Wrench::default(); scene.solids.len()];
    let mut t = 0.0;
    bencher.bench_local(|| {
        let report = solids.advance(t, dt, &dry).expect("the cube rests");
        t += dt;
        report
    });
}
