//! What a step asks of a device: submissions, waits, dispatches, its clock.

use crate::common;

use glam::DVec3;
use seixo::backend::gpu::{self, Gpu};
use seixo::backend::{Backend, Processor, Timing};
use seixo::case::{Case, ContactDevice};
use seixo::checkpoint::Archive;
use seixo::params::{Params, Step};
use seixo::plan::{ParticleStage, Plan, Stage};
use seixo::pressure::Settings;
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use std::time::Instant;

/// A simulation on a device; loud if there is none, and a failure where one is expected.
fn on_device(case: &Case) -> Option<Simulation> {
    if !crate::common::there_is_a_device("what a step asks of a device is not tested") {
        return None;
    }
    let scene = Scene::build(case).expect("the scene builds");
    Some(Simulation::on(case, scene, &Processor::Gpu { adapter: None }).expect("the simulation starts"))
}

/// Still water with a gate beside it and, if `free`, a cube above it, both out of its reach.
fn still(free: bool, preconditioner: &str) -> Case {
    let body = "[[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.125, 0.125, 5.6]\ndensity = 500\n\
                [contact]\nlaw = \"smooth\"\nspring = 1e4\n";
    common::case(&format!(
        "[run]\nspacing = 0.025\ntime_step = 5e-4\nend = 1.0\nadaptive = false\n\
         [fluid]\nsound_speed = 3\nsolver = {{ preconditioner = \"{preconditioner}\" }}\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.25, 0.25, 0.2]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.25, 0.25, 6.0]\nopen = [\"z_max\"]\n\
         [[moving_wall]]\nname = \"gate\"\nmin = [0.1, 0.1, 5.0]\nmax = [0.15, 0.15, 5.2]\n\
         motion = [[0, 0, 0, 0], [3, 0, 0, 0.3]]\n{}",
        if free { body } else { "" }
    ))
}

#[test]
fn a_step_is_one_submission_and_the_host_waits_for_answers_only() {
    const STEPS: u64 = 10;
    for (preconditioner, free) in [("jacobi", false), ("multigrid", true)] {
        let Some(mut sim) = on_device(&still(free, preconditioner)) else { return };
        assert_eq!(sim.plan.has(Stage::BodyForce), free);
        for _ in 0..11 {
            sim.step().expect("still water is no trouble");
        }
        let before = sim.backend.commands();
        for _ in 0..STEPS {
            sim.step().expect("still water is no trouble");
        }
        let now = sim.backend.commands();
        let (submits, waits) = (now.submits - before.submits, now.waits - before.waits);
        println!("{preconditioner}, body {free}: {submits} submissions, {waits} waits in {STEPS} steps");
        // The solver's verdict and, with a free body, the force on it; every ten steps a look at the fluid.
        let answers = if free { 2 * STEPS } else { STEPS } + 1;
        // A solve that took many more iterations than those of late would be looked at a second time.
        assert_eq!((submits, waits), (answers, answers), "{preconditioner}, body {free}");
        let count = |stage| now.by_stage[&stage] - before.by_stage[&stage];
        assert_eq!(count(Stage::CellList), 6 * STEPS);
        assert_eq!(count(Stage::MoveSolids), 2 * STEPS);
        // Nothing in the solver goes uncounted: once a solve the residuals, the levels and the last verdict, the
        // rest are whole iterations.
        let solve = sim.backend.traffic().expect("it can be counted").solve;
        let once = solve.ends + solve.build;
        let verdict = u64::from(preconditioner == "multigrid");
        let iterations = count(Stage::ConjugateGradient) - STEPS * (once.dispatches + verdict);
        let each = solve.iteration + solve.cycle;
        println!("{solve:?}");
        assert!(iterations >= STEPS * each.dispatches && iterations.is_multiple_of(each.dispatches));
        assert!(solve.build.bytes < 2 * each.bytes && solve.build.dispatches < 2 * each.dispatches);
    }
}

/// [`still`] water, the cube on the gate and its contact on the device.
fn pressed() -> Case {
    let mut case = still(true, "jacobi");
    case.body[0].center[2] = 5.25;
    let contact = case.contact.as_mut().expect("the case has contact");
    contact.device = ContactDevice::Gpu;
    case
}

#[test]
fn contact_on_the_device_adds_its_round_trips_and_no_other_wait() {
    let Some(mut sim) = on_device(&pressed()) else { return };
    for _ in 0..21 {
        sim.step().expect("still water is no trouble");
    }
    let (before, asked) = (sim.backend.commands(), sim.solids.traffic());
    for _ in 0..20 {
        sim.step().expect("still water is no trouble");
    }
    let (now, asks) = (sim.backend.commands(), sim.solids.traffic());
    let trips = asks.round_trips - asked.round_trips;
    let (submits, waits) = (now.submits - before.submits, now.waits - before.waits);
    println!("{trips} round trips of contact, {submits} submissions, {waits} waits in 20 steps");
    assert!(trips >= 20, "the gate carries the cube");
    let answers = 2 * 20 + 2 + trips;
    assert_eq!((submits, waits), (answers, answers));
    let count = |stage| now.by_stage[&stage] - before.by_stage[&stage];
    assert_eq!(count(Stage::Contact), asks.dispatches - asked.dispatches);
    assert_eq!((count(Stage::MoveSolids), count(Stage::BodyForce)), (2 * 20, 20));
}

#[test]
fn the_device_clock_tells_every_stage_and_no_more_than_the_wall_clock() {
    for case in [still(true, "jacobi"), pressed()] {
        the_clock_tells(&case);
    }
}

fn the_clock_tells(case: &Case) {
    let Some(mut sim) = on_device(case) else { return };
    if sim.backend.timing() != Timing::Timestamps {
        eprintln!("SKIPPED: the adapter has no timestamps");
        return;
    }
    let start = Instant::now();
    for _ in 0..15 {
        sim.step().expect("still water is no trouble");
    }
    sim.observe().expect("the device is there");
    let wall = start.elapsed().as_secs_f64();
    let total: f64 = sim.stages.values().sum();
    println!("{:?} of {wall} s", sim.stages);
    for stage in Stage::ALL.into_iter().filter(|&s| sim.plan.has(s)) {
        assert!(sim.stages.get(&stage).is_some_and(|&t| t > 0.0), "{stage:?}");
    }
    assert!(total <= wall, "{total} s of {wall} s");
    // A solve takes many times as long as a sweep over the particles.
    assert!(sim.stages[&Stage::ConjugateGradient] > 3.0 * sim.stages[&Stage::Correct]);
}

/// Every buffer that the plan counts is allocated, and nothing else that grows with the scene.
#[test]
fn planned_bytes_are_allocated_bytes() {
    if !crate::common::there_is_a_device("memory is not tested") {
        return;
    }
    for case in [still(false, "jacobi"), still(true, "multigrid"), pressed()] {
        let scene = Scene::build(&case).expect("the scene builds");
        let params = Params::new(&case, &scene).expect("valid");
        let plan = Plan::new(&case, &scene, &params);
        let settings = Settings { tolerance: 1e-3, max_iterations: 10, warm_start: true };
        let planned = gpu::memory(&scene, &params, &plan).expect("it can be planned");
        let mut gpu = Gpu::new(&scene, &params, &plan, settings, None).expect("the device can");
        // What the uploads travel in is given back.
        gpu.read().expect("the device is there");
        gpu.wait().expect("the device is there");
        let Some(allocated) = gpu.allocated() else {
            eprintln!("SKIPPED: the driver's allocator does not tell");
            return;
        };
        println!("planned {}, held {}, allocated {allocated}", planned.total(), gpu.bytes());
        // What the program keeps to talk to the device, and what wgpu does; the driver rounds each buffer up.
        let rest = allocated.checked_sub(gpu.bytes()).expect("not all that is planned is allocated");
        assert!(rest < 1 << 20, "{rest} bytes are allocated that are not planned");
        assert!(planned.total() > 2 << 20 && gpu.bytes() - planned.total() <= 17 << 20);
    }
}

/// With more blocks of cells than workgroups each takes several: a huge empty domain changes nothing.
#[test]
fn water_in_a_huge_domain_is_the_same_water() {
    let column = |domain: &str| {
        common::case(&format!(
            "[run]\nspacing = 0.025\ntime_step = 5e-4\nend = 1.0\nadaptive = false\n{domain}\n\
             [fluid]\nsound_speed = 3\nsolver = {{ preconditioner = \"multigrid\" }}\n\
             [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.25, 0.25, 0.2]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.25, 0.25, 0.4]\nopen = [\"z_max\"]\n"
        ))
    };
    // The same corner, 0.21 m or four cells apart: cells of one lie on cells of the other, on every level.
    let mut ends = Vec::new();
    for far in [1.0, 6.0] {
        let to = [far, far, far];
        let domain = format!("domain = [[-0.21, -0.21, -0.21], {to:?}]");
        let Some(mut sim) = on_device(&column(&domain)) else { return };
        let mut iterations = 0;
        for _ in 0..2 {
            iterations += sim.step().expect("still water is no trouble").pressure.iterations;
        }
        let fields = sim.backend.read().expect("the device is there");
        let mut by_number: Vec<(u32, f64)> =
            fields.id.iter().copied().zip(fields.pressure.iter().copied()).collect();
        by_number.sort_by_key(|p| p.0);
        assert!(fields.pressure.iter().any(|&p| p > 100.0));
        let cells = seixo::cells::Grid::new(&sim.params).expect("a grid").total();
        println!("{cells} cells, {iterations} iterations");
        ends.push((iterations, by_number, cells));
    }
    assert!(ends[1].2 > 1024 * 1024, "{} cells fit the workgroups", ends[1].2);
    assert_eq!(ends[0].0, ends[1].0);
    // Positions are rounded relative to another middle.
    let most = ends[0].1.iter().map(|p| p.1).fold(0.0, f64::max);
    for (a, b) in ends[0].1.iter().zip(&ends[1].1) {
        assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-2 * most, "{a:?} {b:?}");
    }
}

/// 200 m from the middle of a domain numbers in f32 are 15 um apart, and this water goes half a micrometre in each half of a step.
#[test]
fn slow_water_in_a_long_domain_is_not_held() {
    let case = common::case(
        "[run]\nspacing = 0.025\ntime_step = 5e-4\nend = 1.0\nadaptive = false\n\
         domain = [[0.3, 0, 0], [400.4, 0.3, 0.3]]\ngravity = [0, 0, 0]\n\
         [fluid]\n[[fluid.block]]\nmin = [0.5, 0.1, 0.1]\nmax = [0.7, 0.2, 0.2]\nvelocity = [2e-3, -1e-3, 0]\n",
    );
    let Some(mut sim) = on_device(&case) else { return };
    let mean = |sim: &mut Simulation| {
        let fields = sim.backend.read().expect("the device is there");
        fields.position.iter().sum::<DVec3>() / fields.position.len() as f64
    };
    let start = mean(&mut sim);
    for _ in 0..20 {
        sim.step().expect("nothing acts");
    }
    let gone = mean(&mut sim) - start;
    let off = (gone - DVec3::new(2e-5, -1e-5, 0.0)).abs().max_element();
    assert!(off < 1e-7, "{gone:?}");
}

/// A step that is given up has counted some, and is done again.
#[test]
fn what_was_counted_after_a_state_is_forgotten_with_it() {
    let case = common::hydrostatic(0.05, 1e-3, "sound_speed = 3");
    let Some(mut sim) = on_device(&case) else { return };
    (0..3).for_each(|_| drop(sim.step().expect("still water is no trouble")));
    let mut kept = Archive::in_memory();
    sim.exchange(&mut kept).expect("kept");
    let counted = sim.backend.counters().expect("the device is there");
    let far = Step { dt: 1e3, ahead: 1e3, ..sim.next_step() };
    sim.backend.run(ParticleStage::Predict, &far).expect("it moves");
    sim.exchange(&mut kept.into_restore()).expect("taken over");
    assert_eq!(sim.backend.counters().expect("the device is there"), counted);
    sim.backend.run(ParticleStage::Predict, &far).expect("it moves");
    let more = sim.backend.counters().expect("the device is there").displacement_clamps;
    assert!(more > counted.displacement_clamps, "nothing was counted");
}
