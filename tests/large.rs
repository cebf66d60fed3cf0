//! What a hundred million particles take, tried on a hundred thousand: with the limits of the device lowered every buffer that can
//! be divided is, dispatches are folded into rows, and not a bit changes.

use crate::common;

use seixo::backend::gpu::parts::{Division, Split};
use seixo::backend::gpu::{Caps, Gpu, buffers};
use seixo::case::Case;
use seixo::checkpoint::Archive;
use seixo::error::{Error, GpuError};
use seixo::params::Params;
use seixo::plan::{Arrays, Plan, Stage};
use seixo::pressure::Settings;
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use std::sync::Arc;
use std::time::Instant;

/// Water that breaks a dam beside a gate on its way and a cube that it carries, among walls, in a domain of many more
/// cells than particles.
fn dam() -> Case {
    common::case(
        "[run]\nspacing = 0.0125\ntime_step = 2.5e-4\nend = 1.0\nadaptive = false\n\
         domain = [[-0.06, -0.06, -0.06], [1.3, 0.7, 8.4]]\n\
         [fluid]\nsound_speed = 6\nviscosity = 1e-6\nsolver = { preconditioner = \"multigrid\" }\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.6, 0.5, 0.35]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1.0, 0.5, 0.5]\nopen = [\"z_max\"]\n\
         [[moving_wall]]\nname = \"gate\"\nmin = [0.65, 0, 0.05]\nmax = [0.7, 0.5, 0.45]\n\
         motion = [[0, 0, 0, 0], [1, 0, 0, 0.5]]\n\
         [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.3, 0.25, 0.41]\ndensity = 500\n\
         [contact]\nlaw = \"smooth\"\nspring = 1e5\ndevice = \"gpu\"\n",
    )
}

/// Cubes on a floor, each a pair of its own.
fn cubes(law: &str) -> Case {
    let mut text = format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\nadaptive = false\n\
         [tank]\nmin = [0, 0, 0]\nmax = [2.0, 2.0, 1.0]\nopen = [\"z_max\"]\n\
         [contact]\nlaw = \"{law}\"\nspring = 1e5\ndevice = \"gpu\"\n"
    );
    for k in 0..14 {
        let (x, y) = (0.3 + 0.3 * f64::from(k % 5), 0.3 + 0.3 * f64::from(k / 5));
        text += &format!(
            "[[body]]\nname = \"cube {k}\"\nsize = [0.1, 0.1, 0.1]\ncenter = [{x}, {y}, 0.06]\ndensity = 500\n"
        );
    }
    common::case(&text)
}

/// A simulation on a device with no more than `caps`, and how it is divided there.
fn capped(case: &Case, scene: &Arc<Scene>, caps: Caps) -> (Simulation, Division) {
    let mut division = None;
    let sim = Simulation::with_backend(case, scene.clone(), |scene, params, plan, settings| {
        let gpu = Gpu::capped(scene, params, plan, settings, None, caps)?;
        division = Some(gpu.division().clone());
        Ok(Box::new(gpu))
    });
    (sim.expect("the device can"), division.expect("it was made"))
}

/// Whether there is a device to test; loud if not, and a failure where one is expected.
fn device() -> bool {
    crate::common::there_is_a_device("divided buffers are not tested")
}

/// The state as it is saved: positions, velocities, pressures, lists, poses, all to the last bit.
fn saved(sim: &mut Simulation) -> Archive {
    let mut archive = Archive::in_memory();
    sim.exchange(&mut archive).expect("it can be saved");
    archive
}

fn steps(sim: &mut Simulation, count: usize) -> u32 {
    (0..count).map(|_| sim.step().expect("a step").pressure.iterations).sum()
}

/// Every part of two states is the same.
fn assert_same(one: &Archive, other: &Archive) {
    assert_eq!(one.numbers, other.numbers);
    assert!(one.sections.keys().eq(other.sections.keys()));
    for (name, section) in &one.sections {
        assert!(*section == other.sections[name], "{name} differs");
    }
}

/// Limits at which all that can be divided of [`dam`] is.
const CAPS: Caps = Caps { binding: Some(1_900_000), workgroups: Some(128), large_levels: None };

#[test]
fn divided_buffers_and_folded_dispatches_change_no_bit() {
    if !device() {
        return;
    }
    const STEPS: usize = 2;
    let start = Instant::now();
    let case = dam();
    let scene = Arc::new(Scene::build(&case).expect("the scene builds"));
    assert!(scene.groups.total().abs_diff(100_000) < 15_000, "{:?}", scene.groups);
    let (mut whole, none) = capped(&case, &scene, Caps::default());
    assert_eq!(none, Division::default());
    let plan = whole.plan.clone();
    assert!(plan.contact.program.is_some() && plan.has(Stage::BodyForce) && plan.needs(Arrays::FixedWalls));

    let (mut before, division) = capped(&case, &scene, CAPS);
    println!("{division:?}");
    for row in buffers::TABLE.iter().filter(|row| !matches!(row.split, Split::Whole)) {
        let name = row.spec.id.name();
        assert!(division.of(name).is_some_and(|p| p.count >= 2), "{name} is whole: {division:?}");
    }
    // Three rows of workgroups of 256 threads in what runs over the rows of the equation.
    assert!(
        division.fold == CAPS.workgroups && scene.groups.pressure() > 2 * 128 * 256,
        "{:?}",
        scene.groups
    );
    println!("{:?} to build", start.elapsed());

    // Half of the way, saved, and the other half on another device.
    let mut iterations = steps(&mut before, STEPS / 2);
    let half = saved(&mut before);
    drop(before);
    let (mut after, _) = capped(&case, &scene, CAPS);
    after.exchange(&mut half.to_restore()).expect("the state is its own");
    iterations += steps(&mut after, STEPS / 2);
    println!("{:?} divided", start.elapsed());
    assert_eq!(iterations, steps(&mut whole, STEPS));
    println!("{:?} whole", start.elapsed());
    let end = saved(&mut whole);
    assert_same(&end, &saved(&mut after));
    // What is not saved, as the host reads it.
    let (one, other) = (whole.backend.read().expect("readable"), after.backend.read().expect("readable"));
    assert!(one.position == other.position && one.velocity == other.velocity && one.id == other.id);
    assert!(one.pressure == other.pressure && one.number_density == other.number_density);
    assert!(one.source == other.source && one.diagonal == other.diagonal && one.state == other.state);
    assert!(iterations > 2 * STEPS as u32 && one.pressure.iter().any(|&p| p > 1000.0));
    // The state of the one is the other's as well.
    let (mut again, _) = capped(&case, &scene, CAPS);
    again.exchange(&mut end.to_restore()).expect("the state is of the same scene");
    assert_same(&end, &saved(&mut again));
}

#[test]
fn more_pairs_of_solids_than_workgroups_change_no_bit() {
    if !device() {
        return;
    }
    for law in ["smooth", "paper"] {
        let case = cubes(law);
        let scene = Arc::new(Scene::build(&case).expect("the scene builds"));
        let [(mut whole, _), (mut folded, _)] =
            [None, Some(4)].map(|workgroups| capped(&case, &scene, Caps { workgroups, ..Caps::default() }));
        assert!(whole.plan.contact.program.is_some());
        for sim in [&mut whole, &mut folded] {
            steps(sim, 60);
            assert!(sim.solids.traffic().dispatches > 60);
        }
        assert_same(&saved(&mut whole), &saved(&mut folded));
    }
}

#[test]
fn what_cannot_be_divided_so_far_is_refused_and_the_rest_is_built_with_no_driver() {
    let case = dam();
    let scene = Scene::build(&case).expect("the scene builds");
    let params = Params::new(&case, &scene).expect("valid");
    let plan = Plan::new(&case, &scene, &params);
    let settings = Settings { tolerance: 1e-3, max_iterations: 10, warm_start: true };
    let dry = |binding, workgroups| {
        let caps = Caps { binding: Some(binding), workgroups: Some(workgroups), large_levels: None };
        Gpu::dry_run_capped(&scene, &params, &plan, settings, caps)
    };
    let gpu = dry(1_900_000, 512).expect("it can be built");
    assert!(gpu.division().of("neighbour_list").is_some_and(|p| p.count > 5));
    for (binding, workgroups, lacks) in [
        (1_000_000, 512, "max_storage_buffer_binding_size"),
        (1_900_000, 64, "max_compute_workgroups_per_dimension"),
    ] {
        match dry(binding, workgroups).map(|_| ()) {
            Err(Error::Gpu(GpuError::TooSmall { limit, .. })) => assert_eq!(limit, lacks),
            other => panic!("{lacks}: {other:?}"),
        }
    }
}
