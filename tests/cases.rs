//! Every case under cases/ runs: a few coarse steps without a lost particle, a failed solve or a gain of energy.

use crate::common;

use seixo::case::file::load;
use seixo::pressure::Outcome;
use seixo::scene::Scene;
use std::path::Path;

fn steps_of(name: &str, spacing: Option<f64>, steps: u64) {
    let path = format!("{}/cases/{name}.toml", common::ROOT);
    let loaded = load(Path::new(&path), spacing, &[]).unwrap_or_else(|e| panic!("{e}"));
    let scene = Scene::build(&loaded.case).unwrap_or_else(|e| panic!("{e}"));
    let mut sim = common::cpu_simulation(&loaded.case, scene);
    let wet = sim.plan.wet();
    let energy = |sim: &mut seixo::simulation::Simulation| {
        let water = sim.backend.monitor().expect("readable");
        water.kinetic + water.potential + sim.solids.energy().total()
    };
    let start = energy(&mut sim);
    let before = sim.solids.poses().to_vec();
    for _ in 0..steps {
        let report = sim.step().unwrap_or_else(|e| panic!("{name}: {e}"));
        if wet {
            assert_eq!(report.pressure.outcome, Outcome::Converged, "{name}, step {}", report.step);
        }
    }
    let counters = sim.backend.counters().expect("readable");
    assert_eq!((counters.lost, counters.non_finite, counters.overflow), (0, None, None), "{name}");
    // A gate does work on the water, little in a few steps.
    let end = energy(&mut sim);
    // Water that comes in brings its own.
    let closed = sim.openings.is_empty();
    assert!(!closed || end < start + 1e-3 * start.abs() + 1e-9, "{name}: {start} J became {end} J");
    let moved = wet || sim.solids.poses().iter().zip(&before).any(|(a, b)| a.position != b.position);
    assert!(moved && sim.time > 0.0, "{name}: nothing moved");
}

macro_rules! cases {
    ($($name:ident $spacing:expr, $steps:expr;)*) => {
        $(#[test] fn $name() { steps_of(stringify!($name), $spacing, $steps); })*

        #[test]
        fn every_case_is_run() {
            let listed = [$(stringify!($name)),*];
            for entry in std::fs::read_dir(format!("{}/cases", common::ROOT)).expect("the folder is there") {
                let path = entry.expect("readable").path();
                if path.extension().is_some_and(|e| e == "toml") && !path.ends_with("Cargo.toml") {
                    let name = path.file_stem().expect("a file").to_string_lossy().into_owned();
                    assert!(listed.contains(&name.as_str()), "{name} is not run by this test");
                }
            }
        }
    };
}

cases! {
    channel Some(0.04), 60;
    dam_break Some(0.04), 60;
    dam_break_2d None, 60;
    dam_break_transport Some(0.03), 100;
    falling_cube None, 200;
    floating_cube None, 40;
    hydrostatic None, 60;
    pebble None, 30;
    resting_cube None, 200;
    sliding_block None, 200;
}
