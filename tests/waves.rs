//! Formulas of motion, pistons that make waves, and what takes waves up again.

use crate::cli::ran;
use glam::DVec3;
use seixo::case::Case;
use seixo::kernels::absorber;
use seixo::params::Params;
use seixo::plan::{Plan, Stage};
use seixo::scene::{Drive, Motion, Scene};
use std::path::Path;

/// A flume of 4 m with a piston at its left end; `piston` moves it, `more` follows.
fn flume(piston: &str, more: &str) -> String {
    format!(
        "[run]\nspacing = 0.02\ntime_step = 2e-3\nadaptive = true\nend = 5.2\ndimensions = 2\n\
         [tank]\nmin = [-0.5, 0, 0]\nmax = [4.0, 0.1, 0.5]\nopen = [\"z_max\"]\n\
         [fluid]\nsound_speed = 5\ncollision_distance = 0.5\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [4.0, 0.1, 0.2]\n\
         [[moving_wall]]\nname = \"piston\"\nmin = [-0.06, 0, 0]\nmax = [0, 0.1, 0.4]\n{piston}\n{more}"
    )
}

fn motion(text: &str) -> Motion {
    let case: Case = text.parse().expect("a valid case");
    let scene = Scene::build(&case).expect("a valid scene");
    match &scene.solids[0].drive {
        Drive::Prescribed(motion) => motion.clone(),
        Drive::Free(_) => panic!("it follows a formula"),
    }
}

#[test]
fn a_wall_follows_its_formulas() {
    let tau = std::f64::consts::TAU;
    let sine = motion(&flume(
        "sine = { axis = [2, 0, 0], amplitude = 0.05, period = 1.6, phase_deg = 90, ramp = 0.8 }",
        "",
    ));
    assert_eq!(sine.displacement(0.0), DVec3::ZERO);
    let x = 0.05 * (tau * 2.3 / 1.6 + 0.25 * tau).sin();
    assert!((sine.displacement(2.3) - x * DVec3::X).length() < 1e-12);
    // A flap about its foot: the centre is 0.2 m above it.
    let flap = motion(&flume(
        "swing = { axis = [0, 1, 0], amplitude_deg = 10, period = 1.6 }\npivot = [-0.03, 0, 0]",
        "",
    ));
    let angle = 10_f64.to_radians() * (tau * 0.3 / 1.6).sin();
    let centre = 0.2 * DVec3::new(angle.sin(), 0.0, angle.cos() - 1.0);
    assert!((flap.displacement(0.3) - centre).length() < 1e-12 && flap.turns());
    // Both at once, and the depth of the water from its block.
    let both = motion(&flume(
        "wave = { kind = \"regular\", height = 0.08, period = 1.5 }\nrotation = [[0, 0, 0, 0], [1, 0, 20, 0]]",
        "",
    ));
    let wave = both.wave().expect("it makes one");
    assert!((wave.wanted.depth - 0.2).abs() < 1e-12 && wave.wanted.ramp == 1.5 && both.turns());
    // Leftwards: towards smaller x.
    let left = "wave = { kind = \"solitary\", height = 0.05, depth = 0.2, direction = [-1, 0, 0] }";
    let left = motion(
        &flume(left, "").replace("min = [-0.5,", "min = [-2.5,").replace("[4.0, 0.1, 0.2]", "[2, 0.1, 0.2]"),
    );
    assert!(left.displacement(9.0).x < -0.1);
}

#[test]
fn plan_tells_the_wave_and_no_absorber_costs_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flume.toml");
    std::fs::write(&path, flume("wave = { kind = \"regular\", height = 0.08, period = 1.5 }", "")).unwrap();
    let path = path.display().to_string();
    let plan = ran(&["plan", &path]);
    assert_eq!(plan.code, 0, "{}", plan.err);
    // w^2 d / g = 0.3578 = kd tanh kd, kd = 0.6358
    for words in [
        "regular wave: height 0.08 m, period 1.5 s, in 0.2000 m",
        "length 1.97",
        "celerity 1.31",
        "no absorber",
    ] {
        assert!(plan.out.contains(words), "{words}: {}", plan.out);
    }
    let json = ran(&["plan", &path, "--json"]);
    assert!(json.out.contains("\"celerity_m_s\""));
}

#[test]
fn what_cannot_be_made_is_told_with_line_and_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flume.toml");
    let regular = |keys: &str| format!("wave = {{ kind = \"regular\", {keys} }}");
    for (piston, words) in [
        (regular("height = 0.2, period = 1.5"), "breaks at the piston"),
        (regular("height = 0.06, period = 0.3"), "breaks at the piston"),
        (regular("height = 0.005, period = 0.35"), "cannot be told from noise"),
        (regular("height = 0.08"), "without `period`"),
        (regular("height = 0.08, period = 1.5, seed = 3"), "has no `seed`"),
        (regular("height = 0.08, period = 1.5, direction = [0, 0, 1]"), "horizontal direction"),
        (
            regular("height = 0.08, period = 1.5, direction = [1, 0.1, 0]"),
            "its face looks along x | turn it by `orientation` (a box with `size` and `center`), or use [1.0, 0.0, 0.0]",
        ),
        (regular("height = -0.08, period = 1.5"), "out of range"),
        ("wave = { kind = \"solitary\", height = 0.17 }".into(), "0.78 d"),
        ("wave = { kind = \"solitary\", height = 0.05, ramp = 1 }".into(), "has no `ramp`"),
        ("wave = { kind = \"tsunami\", height = 0.05 }".into(), "jonswap"),
        ("wave = { kind = \"regular\", height = 0.1, period = 20, ramp = 1 }".into(), "beyond the tank"),
        ("sine = { axis = [0, 0, 0], amplitude = 0.1, period = 1, ramp = 1 }".into(), "has no length"),
        (
            "sine = { axis = [1, 0, 0], amplitude = 0.1, period = 1, phase_deg = 90 }".into(),
            "jump to its phase",
        ),
        ("sine = { axis = [1, 0, 0], amplitude = 900, period = 1 }".into(), "particles in a time step"),
        ("swing = { axis = [1, 0, 0], amplitude_deg = 5, period = 1 }".into(), "about y alone"),
        (
            "motion = [[0, 0, 0, 0], [1, 0, 0, 1]]\nsine = { axis = [1, 0, 0], amplitude = 0.1, period = 1 }"
                .into(),
            "exclude each other",
        ),
    ] {
        std::fs::write(&path, flume(&piston, "")).unwrap();
        let plan = ran(&["plan", &path.display().to_string()]);
        assert_eq!(plan.code, 2, "{piston}: {}", plan.out);
        assert!(plan.err.contains(words) && plan.err.contains("flume.toml:"), "{piston}: {}", plan.err);
    }
    // Another depth than that of the water there is odd, and may be meant.
    std::fs::write(&path, flume(&regular("height = 0.02, period = 1.5, depth = 0.1"), "")).unwrap();
    let plan = ran(&["plan", &path.display().to_string()]);
    let odd = "the wave is made for water 0.1000 m deep, and that at the piston is";
    assert!(plan.code == 0 && plan.err.contains(odd), "{}", plan.err);
    // A fill stands on what the piston stands on, and counts where it begins nearest to it.
    let filled = |more: &str, keys: &str| {
        let text = format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ndimensions = 2\n[tank]\nmin = [0, 0, 0]\nmax = [4, 0.1, 0.6]\n\
             open = [\"z_max\"]\n[fluid]\n[[moving_wall]]\nname = \"piston\"\nmin = [0.08, 0, 0.1]\nmax = [0.2, 0.1, 0.6]\n\
             wave = {{ kind = \"regular\", height = 0.08, period = 1.5{keys} }}\n\
             [[obstacle]]\nname = \"bed\"\nmin = [0, 0, 0]\nmax = [4, 0.1, 0.1]\n\
             [[fluid.fill]]\nseed = [1, 0.05, 0.2]\nlevel = 0.3\n{more}"
        );
        std::fs::write(&path, text).unwrap();
        ran(&["plan", &path.display().to_string()])
    };
    let behind = "[[obstacle]]\nname = \"dam\"\nmin = [3, 0, 0.1]\nmax = [3.2, 0.1, 0.6]\n\
                  [[fluid.fill]]\nseed = [3.6, 0.05, 0.2]\nlevel = 0.5\n";
    for (more, keys) in [("", ""), (behind, ""), (behind, ", depth = 0.2")] {
        let plan = filled(more, keys);
        assert!(plan.code == 0 && plan.out.contains("in 0.2000 m of water"), "{}{}", plan.out, plan.err);
        assert!(!plan.err.contains("the wave is made for"), "{}", plan.err);
    }
    let plan = filled("", ", depth = 0.3");
    let odd = "the wave is made for water 0.3000 m deep, and that at the piston is 0.2000 m deep";
    assert!(plan.code == 0 && plan.err.contains(odd), "{}", plan.err);
    // Water elsewhere: the depth has to be said.
    let text = flume(&regular("height = 0.08, period = 1.5"), "")
        .replace("[[fluid.block]]\nmin = [0,", "[[fluid.block]]\nmin = [1,");
    std::fs::write(&path, text).unwrap();
    let plan = ran(&["plan", &path.display().to_string()]);
    assert!(plan.code == 2 && plan.err.contains("add `depth`"), "{}", plan.err);
    for (absorber, words) in [
        ("min = [3, 0, 0]\nmax = [2, 1, 1]\ntowards = \"x_max\"", "is empty along x"),
        ("min = [3, 0, 0]\nmax = [4, 1, 1]\ntowards = \"x_max\"\nrate = 0", "out of range"),
        ("min = [3, 0, 0]\nmax = [4, 1, 1]\ntowards = \"y_max\"", "in two dimensions"),
        ("min = [3, 0, 0]\nmax = [4, 1, 1]\n", "missing field `towards`"),
    ] {
        std::fs::write(
            &path,
            flume(&regular("height = 0.08, period = 1.5"), &format!("[[absorber]]\n{absorber}")),
        )
        .unwrap();
        let plan = ran(&["plan", &path.display().to_string()]);
        assert!(plan.code == 2 && plan.err.contains(words), "{absorber}: {}", plan.err);
    }
}

#[test]
fn absorbers_that_spoil_the_waves_are_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flume.toml");
    for (absorber, words) in [
        ("min = [-0.5, 0, 0]\nmax = [0.6, 1, 1]\ntowards = \"x_min\"", "waves are damped where they are made"),
        ("min = [2, 0, 0]\nmax = [4, 1, 1]\ntowards = \"x_min\"", "they are thrown back"),
        ("min = [3.6, 0, 0]\nmax = [4, 1, 1]\ntowards = \"x_max\"", "a good part of it comes back"),
        // As long as the wave, and behind the piston.
        ("min = [1.9, 0, 0]\nmax = [4, 1, 1]\ntowards = \"x_max\"", ""),
        ("min = [-0.5, 0, 0]\nmax = [-0.1, 1, 1]\ntowards = \"x_min\"", ""),
    ] {
        let wave = "wave = { kind = \"regular\", height = 0.04, period = 1.5 }";
        std::fs::write(&path, flume(wave, &format!("[[absorber]]\n{absorber}"))).unwrap();
        let plan = ran(&["plan", &path.display().to_string()]);
        assert_eq!(plan.code, 0, "{absorber}: {}", plan.err);
        let said = ["waves are damped", "thrown back", "comes back"].iter().filter(|w| plan.err.contains(**w));
        assert_eq!(said.count(), usize::from(!words.is_empty()), "{absorber}: {}", plan.err);
        assert!(plan.err.contains(words), "{absorber}: {}", plan.err);
    }
}

#[test]
fn the_rate_of_an_absorber_grows_as_the_square_of_the_way_into_it() {
    let text = flume(
        "sine = { axis = [1, 0, 0], amplitude = 0.05, period = 1.6 }",
        "[[absorber]]\nmin = [3, 0, 0]\nmax = [4, 1, 1]\ntowards = \"x_max\"\nrate = 8\n\
         [[absorber]]\nmin = [-1, 0, 0]\nmax = [1, 1, 1]\ntowards = \"x_min\"\n",
    );
    let case: Case = text.parse().unwrap();
    let scene = Scene::build(&case).unwrap();
    let params = Params::new(&case, &scene).unwrap();
    assert!(Plan::new(&case, &scene, &params).has(Stage::Absorber));
    let rate = |x: f64| absorber::rate(DVec3::new(x, 0.0, 0.1), &params);
    assert!(rate(2.0) == 0.0 && rate(4.1) == 0.0 && rate(3.0) == 0.0);
    assert!((rate(3.5) - 2.0).abs() < 1e-12 && (rate(4.0) - 8.0).abs() < 1e-12);
    // By itself: 12 sqrt(g d) over the length.
    assert!((rate(-1.0) / (12.0 * (9.80665_f64 * 0.2).sqrt() / 2.0) - 1.0).abs() < 1e-12);
    let v = DVec3::new(1.0, 0.0, -2.0);
    let slowed = absorber::absorber(DVec3::new(4.0, 0.0, 0.1), v, &params, 0.125);
    assert!((slowed - 0.5 * v).length() < 1e-12);
}

/// Rows of a run's gauges: time, then one column a gauge.
fn gauges(folder: &Path, name: &str, text: &str) -> Vec<Vec<f64>> {
    let path = folder.join(format!("{name}.toml"));
    std::fs::write(&path, text).unwrap();
    let out = folder.join(name).display().to_string();
    let ran = ran(&[
        "run",
        &path.display().to_string(),
        "-o",
        &out,
        "--backend",
        "cpu",
        "-q",
        "--set",
        "output.every=0",
    ]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let rows = std::fs::read_to_string(Path::new(&out).join("gauges.csv")).unwrap();
    rows.lines().skip(1).map(|l| l.split(',').map(|x| x.trim().parse().unwrap()).collect()).collect()
}

const GAUGES: &str = "[gauge]\nevery = 0.02\n[[gauge.level]]\nname = \"a\"\nat = [1.0, 0]\n[[gauge.level]]\nname = \"b\"\nat = [2.0, 0]\n";

/// When a wave passes, the centroid of what stands more than 1 cm above still water, and its crest.
fn crest(rows: &[Vec<f64>], gauge: usize, [from, to]: [f64; 2]) -> (f64, f64) {
    let within = || rows.iter().filter(|r| r[0] >= from && r[0] <= to).map(|r| (r[0], r[gauge] - 0.2));
    let top = within().map(|(_, h)| h).fold(0.0, f64::max);
    let (area, first) =
        within().filter(|(_, h)| *h > 0.01).fold((0.0, 0.0), |(a, m), (t, h)| (a + h, m + t * h));
    (first / area, top)
}

/// A solitary wave runs past two gauges at sqrt(g (d + H)) and nearly as high as asked; a wall sends it back, an
/// absorber does not.
#[test]
fn a_solitary_wave_has_its_speed_and_does_not_come_back_from_an_absorber() {
    let folder = tempfile::tempdir().unwrap();
    let piston = "wave = { kind = \"solitary\", height = 0.06 }";
    let absorber = "[[absorber]]\nmin = [2.4, 0, 0]\nmax = [4.0, 0.1, 0.5]\ntowards = \"x_max\"\n";
    let bare = gauges(folder.path(), "wall", &flume(piston, GAUGES));
    let damped = gauges(folder.path(), "absorber", &flume(piston, &format!("{GAUGES}{absorber}")));
    let ((t_a, h_a), (t_b, h_b)) = (crest(&bare, 1, [0.0, 2.4]), crest(&bare, 2, [0.0, 3.0]));
    let (celerity, theory) = (1.0 / (t_b - t_a), (9.80665_f64 * 0.26).sqrt());
    println!("crests {h_a:.4} and {h_b:.4} m, celerity {celerity:.3} for {theory:.3} m/s");
    assert!((h_a / 0.06 - 1.0).abs() < 0.15 && (h_b / 0.06 - 1.0).abs() < 0.2, "{h_a} {h_b}");
    assert!((celerity / theory - 1.0).abs() < 0.05, "{celerity} {theory}");
    // The stroke has lifted the level of the whole flume.
    let stroke = (16.0 * 0.06 * 0.2 / 3.0_f64).sqrt();
    let lifted = 0.2 * stroke / (4.0 - stroke);
    let back = [&bare, &damped].map(|rows| crest(rows, 2, [3.6, 5.2]).1 - lifted);
    println!("come back: {:.4} m from the wall, {:.4} m from the absorber", back[0], back[1]);
    assert!(back[0] > 0.025 && back[1] < 0.009, "{back:?}");
}

/// The same keys, the same way: a body and a wall of one shape at one place. A body that follows a sine in a run is where it says.
#[test]
fn a_body_follows_formulas_as_a_wall_does() {
    let keys = "sine = { axis = [1, 0, 2], amplitude = 0.02, period = 0.3, phase_deg = 30, ramp = 0.2 }\n\
                swing = { axis = [0, 1, 0], amplitude_deg = 20, period = 0.25 }\npivot = [0.4, 0.0, 0.5]\n";
    let case = |table: &str, keys: &str| {
        format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.2\ndimensions = 2\n[tank]\nmin = [0, 0, 0]\nmax = [1, 0, 1]\n\
             open = [\"z_max\"]\n[{table}]\nname = \"vane\"\nsize = [0.2, 0.1, 0.06]\ncenter = [0.5, 0, 0.5]\n{keys}[output]\nevery = 0\n"
        )
    };
    let of = |table: &str, keys: &str| -> Motion {
        let scene = Scene::build(&toml::from_str(&case(table, keys)).expect("a case")).expect("a scene");
        match &scene.solids[0].drive {
            Drive::Prescribed(motion) => motion.clone(),
            Drive::Free(_) => panic!("{table} follows a formula"),
        }
    };
    let (wall, body) = (of("[moving_wall]", keys), of("[body]", keys));
    assert_eq!(wall, body);
    assert!(body.turns() && body.displacement(0.11).length() > 5e-3);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("vane.toml");
    std::fs::write(&path, case("[body]", keys)).unwrap();
    let (path, out) = (path.display().to_string(), folder.path().join("out").display().to_string());
    let done = ran(&["run", &path, "-o", &out, "--backend", "cpu", "--threads", "1", "-q"]);
    assert_eq!(done.code, 0, "{}", done.err);
    let table = std::fs::read_to_string(folder.path().join("out/bodies.csv")).unwrap();
    let mut way: f64 = 0.0;
    for line in table.lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|c| c.parse().unwrap_or(f64::NAN)).collect();
        let place = DVec3::new(cells[2], cells[3], cells[4]) - DVec3::new(0.5, 0.0, 0.5);
        let expected = body.displacement(cells[0]);
        assert!((place - expected).length() < 1e-9, "{line}: {expected}");
        assert!((body.turn(cells[0]).w - cells[5]).abs() < 1e-9, "{line}");
        way = way.max(place.length());
    }
    assert!(way > 0.02 && table.lines().count() > 190, "{way}");

    for (keys, what) in [
        (
            "sine = { axis = [0, 0, 0], amplitude = 0.1, period = 1 }",
            "body.0.sine.axis: the axis has no length",
        ),
        ("sine = { axis = [1, 0, 0], amplitude = 900, period = 1 }", "particles in a time step"),
        ("swing = { axis = [1, 0, 0], amplitude_deg = 5, period = 1 }", "about y alone"),
        (
            "motion = [[0, 0, 0, 0]]\nsine = { axis = [1, 0, 0], amplitude = 0.1, period = 1 }",
            "exclude each other",
        ),
        (
            "pivot = [0, 0, 0]\nsine = { axis = [1, 0, 0], amplitude = 0.1, period = 1 }",
            "nothing turns about it",
        ),
        (
            "sine = { axis = [1, 0, 0], amplitude = 0.1, period = 1 }\nvelocity = [1, 0, 0]",
            "follows a given motion",
        ),
        ("wave = { kind = \"regular\", height = 0.08, period = 1.5 }", "unknown field `wave`"),
    ] {
        std::fs::write(&path, case("[body]", &format!("{keys}\n"))).unwrap();
        let told = ran(&["plan", &path]);
        assert!(told.code == 2 && told.err.contains(what), "{keys}: {}{}", told.out, told.err);
        assert!(told.err.contains("vane.toml:"), "{}", told.err);
    }
}
