//! The library's own comparison of device and CPU, as `seixo compare` runs it.

use seixo::case::file::load;
use seixo::case::{Absorber, Case, Face};
use seixo::plan::Stage;
use seixo::scene::Scene;
use seixo_study::device_compare as compare;
use std::path::Path;

/// The paper's main experiment, coarse: a gate, a cube, two columns.
fn transport(more: &[&str]) -> (Case, std::sync::Arc<Scene>) {
    let path = Path::new(crate::common::ROOT).join("cases/dam_break_transport.toml");
    let sets =
        ["fluid.solver.tolerance=1e-4"].iter().chain(more).map(|s| (*s).to_owned()).collect::<Vec<_>>();
    let case = load(&path, Some(0.03), &sets).expect("the case is valid").case;
    let scene = std::sync::Arc::new(Scene::build(&case).expect("the scene builds"));
    (case, scene)
}

fn device() -> bool {
    crate::common::there_is_a_device("device and CPU are not compared")
}

#[test]
fn one_step_agrees_stage_by_stage() {
    if !device() {
        return;
    }
    // The experiment has none; every stage is to be there.
    let openings = [
        "inflow=[{name=\"in\",face=\"x_min\",min=[0,0,0],max=[0,0.5,0.2],velocity=1}]",
        "outflow=[{name=\"out\",face=\"x_max\"}]",
    ];
    let (mut case, scene) = transport(&openings);
    case.absorber = vec![Absorber { min: [0.0; 3], max: [8.0; 3], towards: Face::XMax, rate: Some(5.0) }];
    let errors = compare::compare_stages(&case, &scene, None, 5).expect("both run");
    for e in &errors {
        println!("{:20} {:16} max {:.1e}  l2 {:.1e}", e.stage, e.field, e.max_relative, e.l2_relative);
    }
    for stage in Stage::ALL {
        assert!(errors.iter().any(|e| e.stage == stage.name()), "{} is missing", stage.name());
    }
    assert!(errors.iter().any(|e| e.max_relative > 0.0), "f32 cannot agree with f64 to the last bit");
    for e in &errors {
        let bound = match e.stage {
            // From the solve on, its tolerance is in the error.
            "conjugate_gradient" | "pressure_gradient" | "correct" | "shift" | "body_force" => 5e-3,
            // Hardly compressed water: the deviation of n from n0 is some hundred times smaller than n, and rows of walls
            // that meet little water, whose sources would be the largest, count little.
            "pressure_source" => 2e-4,
            _ => 1e-5,
        };
        assert!(e.l2_relative < bound && e.is_explained(), "{e:?}");
    }
}

/// Water behind a thin plate stands among the dummies; calm water hardly collides; slanted surfaces tell by their directions which rows look at each other; a
/// site's coordinates are no reason to see less.
#[test]
fn solids_in_calm_water_agree_stage_by_stage() {
    if !device() {
        return;
    }
    let tank = |far: f64, body: &str| {
        crate::common::case(&format!(
            "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 0.3\n\
             [tank]\nmin = [{far}, 0, 0]\nmax = [{:.1}, 0.4, 0.4]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [{far}, 0, 0]\nmax = [{:.1}, 0.4, 0.2]\n\
             [[body]]\nname = \"a\"\ndensity = 900\ndisplaces_fluid = true\n{body}\n[contact]\nspring = 2e4\n",
            far + 0.4,
            far + 0.4
        ))
    };
    let prism = "shape = \"prism\"\nheight = 0.2\nsection = [[0.1, 0], [0.2, 0.05], [0.1, 0.1], [0, 0.05]]\n\
                 orientation = { axis = [0, 1, 0], angle_deg = 12 }\ncenter = [0.2, 0.2, 0.12]";
    let plate = "size = [0.2, 0.2, 0.05]\ncenter = [0.2, 0.2, 0.125]";
    let heavy = "size = [0.15, 0.15, 0.1]\ncenter = [0.2, 0.2, 0.0501]\nvelocity = [0, 0, 0]";
    let far = "size = [0.2, 0.2, 0.1]\ncenter = [1000.2, 0.2, 0.125]";
    for (name, case, warmup) in [
        ("plate", tank(0.0, plate), 0),
        ("on the floor", tank(0.0, heavy), 10),
        ("prism", tank(0.0, prism), 10),
        ("far", tank(1000.0, far), 10),
    ] {
        let scene = std::sync::Arc::new(Scene::build(&case).expect("the scene builds"));
        let errors = compare::compare_stages(&case, &scene, None, warmup).expect("both run");
        assert!(errors.iter().any(|e| e.max_relative > 0.0), "{name}");
        for e in &errors {
            println!("{name:14} {:20} {:16} l2 {:.1e} of {:.1e}", e.stage, e.field, e.l2_relative, e.bound);
            assert!(e.is_explained(), "{name}: {e:?}");
        }
        // A bound that nothing fails is none.
        let bound = |field: &str| errors.iter().find(|e| e.field == field).map(|e| e.bound);
        assert!(bound("number_density").is_some_and(|bound| bound < 1e-4), "{name}");
        assert!(bound("diagonal").is_some_and(|bound| bound < 1e-4), "{name}");
    }
}

#[test]
fn runs_stay_together() {
    if !device() {
        return;
    }
    let (case, scene) = transport(&[]);
    let drift = compare::drift(&case, &scene, None, 12).expect("both run");
    println!("{:?} {:?} s", drift.backends, drift.seconds);
    for q in &drift.quantities {
        println!("{:24} {:12.6} {:12.6} {:.1e}", q.name, q.cpu, q.gpu, q.relative);
    }
    assert!((drift.time[0] - drift.time[1]).abs() < 1e-3 * drift.time[0] && drift.time[0] > 0.0);
    let kinetic = drift.quantities.iter().find(|q| q.name == "kinetic_J").expect("listed");
    assert!(kinetic.cpu > 1e-4);
    for q in drift.quantities.iter().filter(|q| q.name.starts_with("centroid") || q.name.ends_with("_J")) {
        assert!(q.relative < 1e-3, "{q:?}");
    }
}

/// A tilted box on its edge, another one on top of it.
const DRY: &str = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\n[tank]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\n\
                   [contact]\nlaw = \"smooth\"\ndevice = \"gpu\"\nspring = 1e5\ndamping_ratio = 0.1\nfriction = 0.3\n\
                   [[body]]\nname = \"low\"\nsize = [0.2, 0.2, 0.2]\ncenter = [0.5, 0.5, 0.147]\ndensity = 800\n\
                   orientation = { axis = [0, 1, 0], angle_deg = 45 }\nvelocity = [0, 0, -1]\n\
                   [[body]]\nname = \"high\"\nsize = [0.2, 0.2, 0.2]\ncenter = [0.5, 0.5, 0.395]\ndensity = 800\n\
                   velocity = [0, 0, -2]\n";

#[test]
fn contact_of_a_dry_scene_is_compared_too() {
    if !device() {
        return;
    }
    for law in ["smooth", "paper"] {
        let text = DRY.replace("\"smooth\"", &format!("\"{law}\""));
        let text = if law == "paper" { text.replace("friction = 0.3\n", "") } else { text };
        let case: Case = toml::from_str(&text).expect("valid");
        let scene = std::sync::Arc::new(Scene::build(&case).expect("the scene builds"));
        let errors = compare::compare_stages(&case, &scene, None, 12).expect("both run");
        let value = |field: &str| errors.iter().find(|e| e.field == field).map(|e| e.max_relative);
        println!("{errors:?}");
        assert_eq!((errors.len(), value("pairs")), (3, Some(0.0)));
        assert!(errors.iter().all(|e| e.stage == "contact" && e.is_explained()));
        // f32 cannot agree with f64 to the last bit: the bodies do touch.
        assert!(value("force").is_some_and(|e| e > 0.0 && e < 1e-4), "{errors:?}");
        assert!(value("torque").is_some_and(|e| e < 1e-4), "{errors:?}");
        let drift = compare::drift(&case, &scene, None, 20).expect("both run");
        for q in &drift.quantities {
            assert!(q.relative < 1e-6, "{law}: {q:?}");
        }
    }
}

/// Of what stands out of the water beside a surface with a pressure of its own, under a source that knows no divergence.
#[test]
fn a_scheme_put_together_presses_alike_on_what_stands_out_of_the_water() {
    let pressed = |processor: &seixo::Processor| {
        let case = crate::common::case(
            "[run]\nspacing = 0.025\ntime_step = 1.25e-3\nend = 2.0\ndimensions = 2\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.3]\nopen = [\"z_max\"]\n\
             [fluid]\nsource = \"number_density\"\nsolver = { tolerance = 1e-5 }\n\
             [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.175]\n\
             [[moving_wall]]\nname = \"w\"\nmin = [0, 0, 0]\nmax = [0.075, 0, 0.25]\n\
             motion = [[0, 0, 0, 0], [0.1, 0.0125, 0, 0]]\n\
             [[gauge.force]]\nname = \"f\"\non = \"w\"\n",
        );
        let options = seixo::Options { processor: processor.clone(), ..seixo::Options::default() };
        let mut simulation = seixo::Simulation::open(&case, &options).expect("it opens");
        (0..12)
            .map(|_| {
                simulation.step().expect("a step");
                simulation.gauges().expect("a force")[0].1
            })
            .collect::<Vec<f64>>()
    };
    if device() {
        let (cpu, gpu) = (pressed(&seixo::Processor::Cpu), pressed(&seixo::Processor::Gpu { adapter: None }));
        println!("{cpu:.4?} N on the CPU\n{gpu:.4?} N on the device");
        let most = cpu.iter().map(|f| f.abs()).fold(0.0, f64::max);
        assert!(
            most > 5.0 && cpu.iter().zip(&gpu).all(|(c, g)| (c - g).abs() < 2e-3 * most),
            "{cpu:?} {gpu:?}"
        );
    }
}
