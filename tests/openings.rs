//! Inflow and outflow: what comes in and goes out is counted to the particle, levels are those of the volume, both backends do
//! the same, and a run that was stopped goes on as it would have.

use crate::cli::{json, ran};
use crate::common::{backends, there_is_a_device};
use crate::restart::assert_same;
use seixo::case::Case;
use seixo::plan::{Plan, Stage};
use seixo::scene::{Kind, Passes, Scene};
use seixo::{Options, Processor, Simulation};
use std::path::Path;

/// A tank 0.4 m wide with water `depth` deep, in two dimensions.
fn tank(depth: f64, more: &str) -> String {
    format!(
        "[run]\nspacing = 0.01\ntime_step = 2e-3\nadaptive = true\nend = 2.0\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.1, 0.4]\nopen = [\"z_max\"]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.1, {depth}]\n{more}"
    )
}

/// A channel 0.8 m long with water 0.1 m deep that flows at 0.25 m/s, in two dimensions.
pub(crate) fn channel(outflow: &str) -> String {
    format!(
        "[run]\nspacing = 0.01\ntime_step = 2e-3\nadaptive = true\nend = 6.0\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.8, 0.1, 0.2]\nopen = [\"z_max\"]\n\
         [fluid]\nsound_speed = 3\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.8, 0.1, 0.1]\nvelocity = [0.25, 0, 0]\n\
         [[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0.1, 0.1]\nvelocity = 0.25\n\
         [[outflow]]\nname = \"out\"\nface = \"x_max\"\n{outflow}\n"
    )
}

fn opened(text: &str, processor: &Processor) -> Simulation {
    crate::common::alone();
    let case: Case = text.parse().unwrap_or_else(|e| panic!("{e}"));
    let options = Options { processor: processor.clone(), ..Options::default() };
    Simulation::open(&case, &options).unwrap_or_else(|e| panic!("{e}"))
}

/// Particles in, out, lost and there; they close at any time.
fn counted(simulation: &mut Simulation) -> (u64, u64, u64, u64) {
    let (water, counters) = simulation.observe().expect("it can be looked at");
    let came = simulation.openings.total_emitted();
    let out = counters.swallowed.iter().sum::<u64>();
    let there = simulation.scene.water() as u64 + came - out - counters.lost;
    assert_eq!(water.particles, there, "at {} s", simulation.time);
    (came, out, counters.lost, there)
}

fn until(simulation: &mut Simulation, time: f64) {
    while simulation.time < time {
        simulation.step().unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn a_tank_fills_at_the_given_discharge() {
    // 0.02 m2/s for two seconds after a second of growing: 0.05 m2 by 3 s, 0.125 m of level.
    let inflow = "[[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0.1, 0.1]\n\
                  discharge = [[0, 0], [1, 0.02]]\n";
    let mut simulation = opened(&tank(0.1, inflow).replace("end = 2.0", "end = 3.5"), &Processor::Cpu);
    assert_eq!(simulation.scene.water(), 400);
    let layer = simulation.scene.openings[0].layer as u64;
    assert_eq!(layer, 10);
    let mut last = 0.0;
    for time in [0.5, 1.0, 2.0, 3.0] {
        until(&mut simulation, time);
        let t = simulation.time;
        let discharged = |t: f64| if t < 1.0 { 0.01 * t * t } else { 0.01 + 0.02 * (t - 1.0) };
        let volume = discharged(t);
        let (came, _, lost, there) = counted(&mut simulation);
        // Whole layers, each when its water has come in; the last step looked half of it before its end.
        let seen = discharged(t - 0.5 * simulation.next_step().dt);
        assert_eq!(came, layer * (seen / (layer as f64 * 1e-4) + 1e-9).floor() as u64, "at {t} s");
        assert_eq!(lost, 0);
        // Twice the height of the centroid is the level of water that is nearly at rest.
        let level = 2.0 * simulation.observe().expect("readable").0.centroid[2];
        let expected = there as f64 * 1e-4 / 0.4;
        println!(
            "at {t:.3} s: level {level:.4} m, by volume {expected:.4} m, by discharge {:.4} m",
            0.1 + volume / 0.4
        );
        if time == 3.0 {
            assert!((level / expected - 1.0).abs() < 0.01, "{level} m for {expected} m");
            assert!((expected - 0.1 - volume / 0.4).abs() < 0.0026, "less than a layer is under way");
        }
        assert!(level > last);
        last = level;
    }
}

/// Mean depth over the middle half of the channel [m], by count.
fn depth(simulation: &mut Simulation) -> f64 {
    let fields = simulation.fields().expect("readable");
    let middle = |i: &usize| fields.kind[*i] == Kind::Fluid && (0.2..0.6).contains(&fields.position[*i].x);
    (0..simulation.groups.fluid).filter(middle).count() as f64 * 1e-4 / 0.4
}

#[test]
fn a_channel_keeps_its_level() {
    for outflow in ["velocity = 0.25", "discharge = 0.025"] {
        let mut simulation = opened(&channel(outflow).replace("2e-3", "1.2e-3"), &Processor::Cpu);
        let (mut sum, mut count, mut worst) = (0.0, 0.0, 0.0_f64);
        for k in 1..=32 {
            until(&mut simulation, 0.125 * f64::from(k));
            let (came, out, lost, there) = counted(&mut simulation);
            assert_eq!(lost, 0);
            let depth = depth(&mut simulation);
            worst = worst.max((depth / 0.1 - 1.0).abs());
            if k > 16 {
                (sum, count) = (sum + depth, count + 1.0);
            }
            if k % 8 == 0 {
                println!(
                    "{outflow}, {:.2} s: {came} in, {out} out, {there} there, depth {depth:.4} m",
                    simulation.time
                );
            }
        }
        let (came, out, _, there) = counted(&mut simulation);
        let mean = sum / count;
        println!("{outflow}: mean depth {mean:.4} m, worst off by {:.1} %", 100.0 * worst);
        // 4 s at 0.25 m/s: 100 layers, more than the channel holds. The last is due at this very moment.
        assert!((990..=1000).contains(&came), "{outflow}: {came}");
        // Of 17 starts that differ by chance the mean depths were 0.0999 to 0.1016 m, 0.1003 on average.
        assert!(worst < 0.025 && (mean / 0.1 - 1.0).abs() < 0.018, "{outflow}: {mean} m");
        assert!((there as f64 / 800.0 - 1.0).abs() < 0.025, "{outflow}: {there} particles");
        assert!(out.abs_diff(came) < 40, "{outflow}: {came} in, {out} out");
    }
}

/// A hole `width` wide in a tank of `length`, the middle of which is `low` above the floor [m].
struct Hole {
    length: f64,
    width: f64,
    low: f64,
}

impl Hole {
    /// Coefficient of discharge from `from` to `to` [s], by the volume there: d sqrt(h) / dt = -C width sqrt(2 g) / (2 length)
    /// with h above the hole's middle.
    fn coefficient(&self, simulation: &mut Simulation, from: f64, to: f64) -> f64 {
        let mut root = |time: f64| {
            until(simulation, time);
            let level = counted(simulation).3 as f64 * simulation.scene.spacing.powi(2) / self.length;
            (simulation.time, (level - self.low).sqrt())
        };
        let ((from, start), (to, end)) = (root(from), root(to));
        let full = self.width * (2.0 * 9.80665_f64).sqrt() * (to - from) / (2.0 * self.length);
        (start - end) / full
    }
}

#[test]
fn a_jet_contracts_behind_a_hole() {
    // A slot in the middle of the floor, six spacings wide: 0.611 for a sharp edge in an endless floor, by conformal mapping.
    let hole = "[[outflow]]\nname = \"slot\"\nface = \"z_min\"\nmin = [0.47, 0, 0]\nmax = [0.53, 0.1, 0]\n";
    let text = tank(0.4, hole).replace("max = [0.4, 0.1, 0.4", "max = [1, 0.1, 0.4");
    let mut simulation = opened(&text, &Processor::Cpu);
    assert!(simulation.scene.openings[0].passes == Passes::Free && simulation.scene.solids.is_empty());
    let slot = Hole { length: 1.0, width: 0.06, low: 0.0 };
    let coefficient = slot.coefficient(&mut simulation, 0.3, 0.6);
    println!("coefficient of discharge {coefficient:.3}");
    assert!((0.6..0.66).contains(&coefficient), "{coefficient}");
}

#[test]
fn a_tank_runs_empty_through_a_hole() {
    // At the foot of a wall, where the contraction below is suppressed.
    let hole = "[[outflow]]\nname = \"slot\"\nface = \"x_max\"\nmin = [0.4, 0, 0]\nmax = [0.4, 0.1, 0.04]\n";
    let mut simulation = opened(&tank(0.2, hole), &Processor::Cpu);
    let coefficient = Hole { length: 0.4, width: 0.04, low: 0.02 }.coefficient(&mut simulation, 0.1, 0.4);
    println!("coefficient of discharge {coefficient:.3}");
    assert!((0.6..0.75).contains(&coefficient), "{coefficient}");
}

#[test]
fn an_empty_tank_may_be_filled_and_slots_are_used_again() {
    // Room for less than comes in over the run; what goes out makes room again.
    let more = "[[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0.1]\nmax = [0, 0.1, 0.2]\nvelocity = 1.0\n\
                [[outflow]]\nname = \"drain\"\nface = \"x_max\"\nmin = [0.4, 0, 0]\nmax = [0.4, 0.1, 0.2]\n";
    let text = tank(0.1, more)
        .replace("[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.1, 0.1]\n", "max_volume = 0.06\n");
    let mut simulation = opened(&text, &Processor::Cpu);
    assert_eq!((simulation.scene.water(), simulation.groups.fluid), (0, 610));
    until(&mut simulation, 1.0);
    let (came, out, _, there) = counted(&mut simulation);
    println!("{came} in, {out} out, {there} there");
    assert!(came > 900 && out > 300 && there > 50);
    // Without the drain there is no room for it all, and the run says so.
    let closed = text.split("[[outflow]]").next().expect("the text before").to_owned();
    let mut simulation = opened(&closed, &Processor::Cpu);
    let error = loop {
        if let Err(error) = simulation.step() {
            break error.to_string();
        }
    };
    assert!(error.contains("fluid.max_volume") && error.contains("room for 610"), "{error}");
    assert!((0.55..0.66).contains(&simulation.time), "{}", simulation.time);
}

/// Low enough for water to be swallowed soon.
const LOW_HOLE: &str = "min = [0.8, 0, 0]\nmax = [0.8, 0.1, 0.02]";

#[test]
fn a_hole_may_be_as_wide_as_a_tank_that_is_periodic_across_it() {
    let drained = |sides: &str, face: &str, axes: [usize; 3]| {
        // The same tank with other names for its axes.
        let turned = |x: [f64; 3]| {
            let mut out = [0.0; 3];
            (0..3).for_each(|k| out[axes[k]] = x[k]);
            format!("{out:?}")
        };
        let text = format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.2\ngravity = {}\n\
             [tank]\nmin = [0, 0, 0]\nmax = {}\n{sides}\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = {}\n\
             [[outflow]]\nname = \"out\"\nface = \"{face}\"\nmin = [0, 0, 0]\nmax = {}\n",
            turned([0.0, 0.0, -9.81]),
            turned([0.14, 0.2, 0.2]),
            turned([0.14, 0.2, 0.1]),
            turned([0.14, 0.2, 0.08]),
        );
        let mut simulation = opened(&text, &Processor::Cpu);
        until(&mut simulation, 0.15);
        let (_, out, lost, _) = counted(&mut simulation);
        assert_eq!(lost, 0, "{sides}, {face}");
        out
    };
    // Periodic across the hole, with each axis the one across.
    let across_x = drained("periodic = [\"x\"]\nopen = [\"z_max\"]", "y_max", [0, 1, 2]);
    let across_y = drained("periodic = [\"y\"]\nopen = [\"z_max\"]", "x_max", [1, 0, 2]);
    let across_z = drained("periodic = [\"z\"]\nopen = [\"x_max\"]", "y_max", [2, 1, 0]);
    println!("{across_x}, {across_y}, {across_z} particles out");
    assert!(
        across_x > 30 && across_x == across_y && across_x == across_z,
        "{across_x} {across_y} {across_z}"
    );
}

#[test]
fn both_backends_do_the_same() {
    if !there_is_a_device("water that comes and goes on a device") {
        return;
    }
    for (outflow, periodic) in [("velocity = 0.5", false), (LOW_HOLE, false), ("discharge = 0.05", true)] {
        // All of it twice as fast, so that a few layers come and go in few steps.
        let mut text = channel(outflow)
            .replace("velocity = 0.25\n[[outflow", "velocity = 1.0\n[[outflow")
            .replace("velocity = [0.25", "velocity = [0.5");
        if periodic {
            // Three dimensions, periodic across the channel.
            text = text
                .replace("dimensions = 2", "dimensions = 3")
                .replace("max = [0.8, 0.1, 0.2]", "max = [0.2, 0.1, 0.2]\nperiodic = [\"y\"]")
                .replace("max = [0.8, 0.1, 0.1]", "max = [0.2, 0.1, 0.1]")
                .replace("discharge = 0.05", "discharge = 0.005");
        } else {
            text = text.replace("0.8", "0.4");
        }
        let mut cpu = opened(&text, &Processor::Cpu);
        let mut gpu = opened(&text, &Processor::Gpu { adapter: None });
        for k in 0..26 {
            let (a, b) = (cpu.step().expect("the CPU steps"), gpu.step().expect("the device steps"));
            assert_eq!(a.dt, b.dt, "step {k}");
        }
        let (a, b) = (counted(&mut cpu), counted(&mut gpu));
        println!("{outflow}: CPU {a:?}, device {b:?}");
        assert!(a.0 == b.0 && a.0 >= 20, "{a:?} {b:?}");
        // One that is at the edge of an outflow's box may be swallowed a little later.
        assert!(a.1.abs_diff(b.1) <= 2 && a.1 > 0, "{a:?} {b:?}");
        let (x, y) = (cpu.fields().expect("readable"), gpu.fields().expect("readable"));
        let by_id = |f: &seixo::fields::Fields| {
            let mut of = vec![None; f.id.len()];
            (0..f.id.len())
                .filter(|&i| f.kind[i] == Kind::Fluid)
                .for_each(|i| of[f.id[i] as usize] = Some(f.position[i]));
            of
        };
        let (x, y) = (by_id(&x), by_id(&y));
        let both: Vec<f64> =
            x.iter().zip(&y).filter_map(|(a, b)| Some(a.as_ref()?.distance(*b.as_ref()?))).collect();
        let apart = both.iter().copied().fold(0.0, f64::max) / 0.01;
        let mean = both.iter().sum::<f64>() / both.len() as f64 / 0.01;
        println!("{} particles, {apart:.2e} spacings apart at most, {mean:.2e} in the mean", both.len());
        assert!(mean < 1e-4, "{mean}");
    }
}

#[test]
fn a_run_that_was_stopped_goes_on_to_the_bit() {
    for backend in backends("a channel that goes on on a device") {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("channel.toml");
        let text = channel("discharge = 0.025").replace("end = 6.0", "end = 0.11");
        std::fs::write(&path, text.replace("velocity = 0.25\n[[outflow", "velocity = 0.5\n[[outflow"))
            .unwrap();
        let path = path.display().to_string();
        let root = |name: &str| folder.path().join(name).display().to_string();
        let (whole, parts) = (root("whole"), root("parts"));
        let run = |more: &[&str]| {
            let base = [
                "run",
                &path,
                "--backend",
                backend,
                "--threads",
                "1",
                "--quiet",
                "--set",
                "output.every=0.05",
            ];
            let args: Vec<&str> = base.into_iter().chain(more.iter().copied()).collect();
            let ran = ran(&args);
            assert_eq!(ran.code, 0, "{}", ran.err);
        };
        run(&["-o", &whole]);
        run(&["-o", &parts, "--steps", "28"]);
        run(&["-o", &parts, "--resume"]);
        assert_same(Path::new(&whole), Path::new(&parts), backend);
        let result = || json(&std::fs::read_to_string(format!("{parts}/result.json")).unwrap());
        let mut done = result();
        // Killed before its last word, it says the same without a step more.
        std::fs::remove_file(format!("{parts}/result.json")).unwrap();
        run(&["-o", &parts, "--resume"]);
        let mut again = result();
        for times in ["wall_s", "parts", "stages", "memory_peak_bytes"] {
            (done[times], again[times]) = (serde_json::Value::Null, serde_json::Value::Null);
        }
        assert_eq!(done, again, "{backend}");
        let result = result();
        let water = &result["water"];
        let number = |v: &serde_json::Value| v.as_u64().unwrap_or_else(|| panic!("{water}"));
        let (came, out) =
            (number(&water["inflow"][0]["particles"]), number(&water["outflow"][0]["particles"]));
        assert_eq!(number(&water["particles_start"]), 800);
        assert_eq!(
            number(&water["particles_end"]),
            800 + came - out - number(&water["particles_lost"]),
            "{water}"
        );
        // The fifth layer at 0.1 s.
        assert_eq!(came, 50);
        // The table says the same, and knows no solid.
        let table = std::fs::read_to_string(format!("{parts}/monitors.csv")).unwrap();
        let head: Vec<&str> = table.lines().next().unwrap().split(',').collect();
        let last: Vec<&str> = table.lines().last().unwrap().split(',').collect();
        let of = |name: &str| last[head.iter().position(|h| *h == name).unwrap()].parse::<f64>().unwrap();
        assert!((of("inflow_in [m3]") / (came as f64 * 1e-6) - 1.0).abs() < 1e-6);
        assert!((of("outflow_out [m3]") / (out as f64 * 1e-6) - 1.0).abs() < 1e-6);
        let there = number(&water["particles_end"]) as f64;
        assert!((of("water_volume [m3]") / (there * 1e-6) - 1.0).abs() < 1e-6);
        assert!(!Path::new(&parts).join("bodies.csv").exists());
        // So does the page.
        assert_eq!(ran(&["report", &parts, "-q", "--size", "160x80", "--pictures", "1"]).code, 0);
        let page = std::fs::read_to_string(format!("{parts}/report.html")).unwrap();
        assert!(
            page.contains("<h2 id=\"water\">Water in and out</h2>") && page.contains("since the start [m3]")
        );
        for (name, n) in [("in through in", came), ("out through out", out), ("at the start", 800)] {
            assert!(page.contains(&format!(">{name}</td><td>{n}</td>")), "{name} {n}");
        }
    }
}

/// What the old discharge has asked for was met, or was not, by the old run, and a velocity asks for nothing: the new discharge is followed from
/// there on.
#[test]
fn a_run_that_goes_on_with_another_discharge_owes_nothing_for_the_time_before() {
    let folder = tempfile::tempdir().unwrap();
    let root = |name: &str| folder.path().join(name).display().to_string();
    // Particles that have gone out by the end of each run.
    let run = |name: &str, end: &str, flow: &str, from: Option<&str>| {
        let (path, out) = (root(&format!("{name}.toml")), root(name));
        let outflow = format!("[[outflow]]\nname = \"out\"\nface = \"x_max\"\n{flow}\n");
        std::fs::write(&path, tank(0.2, &outflow)).unwrap();
        let args = ["run", &path, "--backend", "cpu", "--threads", "1", "-q", "-o", &out, "--until", end];
        let from = from.map(|name| format!("run.from=\"{}\"", root(name)));
        let sets = from.iter().flat_map(|set| ["--set", set]);
        let ran = ran(&args.into_iter().chain(sets).collect::<Vec<_>>());
        assert_eq!(ran.code, 0, "{}", ran.err);
        let result = json(&std::fs::read_to_string(Path::new(&out).join("result.json")).unwrap());
        result["water"]["outflow"][0]["particles"].as_u64().unwrap()
    };
    run("short", "0.2", "discharge = 0.01", None);
    for (before, first, then) in [
        ("discharge", run("discharge", "0.4", "discharge = 0.01", None), &[0.002, 0.02][..]),
        ("velocity", run("velocity", "0.4", "velocity = 0.05", None), &[0.02]),
        ("one after the other", run("one after the other", "0.4", "velocity = 0.1", Some("short")), &[0.02]),
    ] {
        for discharge in then {
            let name = format!("{before}, then {discharge}");
            let out = run(&name, "0.8", &format!("discharge = {discharge}"), Some(before));
            let asked = discharge * 0.4 / 1e-4;
            println!("{name}: {first} out by 0.4 s, {} of {asked} from there on", out - first);
            // A layer goes at a time, of at most 20 particles.
            assert!(((out - first) as f64 - asked).abs() <= 20.0, "{name}: {first}, then {out}");
        }
    }
}

/// A later end brings more water, for which the state has no room: it is made. A state with room for more than the case has is refused, with the
/// key that gives as much.
#[test]
fn a_state_goes_on_with_room_for_more_water() {
    for backend in backends("room for water in a state of a device") {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("channel.toml");
        std::fs::write(&path, channel("velocity = 0.25")).unwrap();
        let path = path.display().to_string();
        let root = |name: &str| folder.path().join(name).display().to_string();
        // Lists of neighbours, which a viscous state has, name slots.
        let viscous = ["--set", "fluid.viscosity=1e-6", "--set", "inflow.0.velocity=0.5"];
        let base = ["run", &path, "--backend", backend, "--threads", "1", "-q"];
        let run = |name: &str, more: &[&str]| {
            let out = root(name);
            ran(&base.iter().chain(&viscous).chain(&["-o", &out]).chain(more).copied().collect::<Vec<_>>())
        };
        let done = |name: &str, more: &[&str]| {
            let ran = run(name, more);
            assert_eq!(ran.code, 0, "{name}: {}", ran.err);
            json(&std::fs::read_to_string(format!("{}/result.json", root(name))).unwrap())
        };
        let from = |name: &str| format!("run.from=\"{}\"", root(name));
        let long = done("long", &["--until", "0.15"]);
        done("first", &["--until", "0.05"]);
        if backend == "gpu" {
            let refused = run("second", &["--until", "0.15", "--set", &from("first")]);
            assert!(
                refused.code == 2 && refused.err.contains("the same fluid.max_volume"),
                "{}",
                refused.err
            );
            continue;
        }
        let second = done("second", &["--until", "0.15", "--set", &from("first")]);
        assert_eq!(second["water"], long["water"], "{backend}");
        let energy = |result: &serde_json::Value| result["monitors"]["energy_end_J"].as_f64().unwrap();
        // An earlier end is one at which the water stands lower, and constants follow from its depth.
        let apart = (energy(&second) / energy(&long) - 1.0).abs();
        assert!(apart < 1e-3, "{backend}: {apart:e}");
        // Its state knows the room that it has.
        done("third", &["--until", "0.16", "--set", &from("second"), "--set", "fluid.max_volume=0.1"]);
        let narrow = ["--until", "0.16", "--set", &from("second"), "--set", "fluid.max_volume=0.081"];
        let refused = run("none", &narrow);
        assert!(refused.code == 2 && refused.err.contains("fluid.max_volume: the state"), "{}", refused.err);
        let planned =
            ran(&["plan", &path].iter().chain(&viscous).chain(&narrow).copied().collect::<Vec<_>>());
        assert!(planned.code == 2 && planned.err.contains("fluid.max_volume: the state"), "{}", planned.err);
        let least = refused.err.split("give fluid.max_volume = ").nth(1).and_then(|t| t.split(' ').next());
        let least = format!("fluid.max_volume={}", least.unwrap_or_else(|| panic!("{}", refused.err)));
        done("fourth", &["--until", "0.16", "--set", &from("second"), "--set", &least]);
    }
}

/// A log that drifts down the channel stays there: to bodies an opening is a wall.
#[test]
fn a_body_does_not_leave_through_an_opening() {
    for outflow in ["velocity = 0.25", ""] {
        let log = "[contact]\nlaw = \"smooth\"\nspring = 1e4\n[[body]]\nname = \"log\"\nsize = [0.08, 0.1, 0.05]\n\
                   center = [0.7, 0, 0.1]\ndensity = 500\nvelocity = [0.25, 0, 0]\ndisplaces_fluid = true\n";
        let mut simulation = opened(&format!("{}{log}", channel(outflow)), &Processor::Cpu);
        until(&mut simulation, 1.0);
        let (_, out, lost, _) = counted(&mut simulation);
        let x = simulation.solid("log").expect("it is there").pose.position.x;
        println!("{outflow}: log at {x:.4} m, {out} out");
        assert!(lost == 0 && out > 150 && (0.74..0.77).contains(&x), "{x} {out} {lost}");
    }
}

/// A box that falls onto a hole comes to rest as on the floor beside it, whatever presses it: wall boxes or the particles of walls.
#[test]
fn a_body_does_not_fall_through_a_hole() {
    for law in ["smooth", "paper", "pressure"] {
        let spring = if law == "pressure" { "" } else { "spring = 2e3" };
        let mut simulation = opened(
            &format!(
                "[run]\nspacing = 0.01\ntime_step = 5e-4\nend = 1\ndimensions = 2\n\
                 [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.3]\nopen = [\"z_max\"]\n\
                 [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.05, 0, 0.05]\n[[obstacle]]\nname = \"dam\"\nmin = [0.05, 0, 0]\nmax = [0.09, 0, 0.1]\n\
                 [[outflow]]\nname = \"hole\"\nface = \"z_min\"\nmin = [0.4, 0, 0]\nmax = [0.56, 0, 0]\n\
                 [contact]\nlaw = \"{law}\"\n{spring}\n\
                 [[body]]\nname = \"on_floor\"\nsize = [0.06, 0.01, 0.06]\ncenter = [0.25, 0, 0.06]\ndensity = 500\n\
                 [[body]]\nname = \"on_hole\"\nsize = [0.06, 0.01, 0.06]\ncenter = [0.48, 0, 0.06]\ndensity = 500\n"
            ),
            &Processor::Cpu,
        );
        until(&mut simulation, 0.4);
        let [floor, hole] =
            ["on_floor", "on_hole"].map(|name| simulation.solid(name).expect(name).pose.position.z);
        println!("{law}: {floor:.6} {hole:.6} m");
        assert!((0.025..0.04).contains(&floor) && (floor - hole).abs() < 1e-9, "{law}: {floor} {hole}");
    }
}

/// The depth that is derived from, of a tank 1 m long and 0.4 m high with water up to 0.1 m, an inflow of 0.03 m2/s and what is added.
fn derived(end: f64, max_volume: &str, more: &str) -> f64 {
    let text = format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = {end}\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1, 0.1, 0.4]\nopen = [\"z_max\"]\n\
         [fluid]\n{max_volume}\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.5, 0.1, 0.1]\n\
         [[fluid.block]]\nmin = [0.6, 0, 0]\nmax = [1, 0.1, 0.1]\n\
         [[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0.1, 0.1]\nvelocity = 0.3\n{more}"
    );
    let case: Case = text.parse().unwrap_or_else(|e| panic!("{e}"));
    Scene::build(&case).unwrap_or_else(|e| panic!("{e}")).depth
}

#[test]
fn the_depth_that_is_derived_from_is_that_of_the_balance_of_what_comes_in_and_goes_out() {
    let out = |rate: &str, top: f64| {
        format!(
            "[[outflow]]\nname = \"out\"\nface = \"x_max\"\nmin = [1, 0, 0]\nmax = [1, 0.1, {top}]\n{rate}\n"
        )
    };
    let weir =
        |top: f64| format!("[[obstacle]]\nname = \"weir\"\nmin = [0.5, 0, 0]\nmax = [0.6, 0.1, {top}]\n");
    let near = |depth: f64, expected: f64| (depth - expected).abs() < 1e-6;
    // A weir 0.1 m high or lower changes nothing; the volume is less by what it takes of that.
    for (more, low, high) in [
        (out("velocity = 0.3", 0.1), 0.1, 0.1),
        (out("velocity = 0.3", 0.4), 0.1, 0.1),
        (out("discharge = 0.03", 0.4), 0.1, 0.1),
        // Deeper by what is missing, until the opening takes all.
        (out("velocity = 0.2", 0.4), 0.1, 0.15),
        // In the first second alone more comes in.
        (out("velocity = [[1, 0], [1.001, 0.3]]", 0.1), 0.102, 0.13),
        // Nothing goes out, what goes out is not known, or what comes in does not get there.
        (String::new(), 0.102, 0.4),
        (out("", 0.1), 0.102, 0.4),
        (out("velocity = 0.3", 0.1) + &weir(0.3), 0.102, 0.32),
        (out("velocity = 0.3", 0.1) + &weir(0.4), 0.102, 0.4),
    ] {
        let more = if more.contains("weir") { more } else { more + &weir(0.04) };
        let [start, soon, late] = [0.2, 50.0, 60.0].map(|end| derived(end, "", &more));
        assert!(
            start >= 0.1 - 1e-9 && start <= low + 4e-3 && near(soon, late),
            "{more}: {start} {soon} {late}"
        );
        assert!(late < high * 1.05 && late > high * 0.95, "{more}: {late} for {high}");
    }
    let filled = [0.2, 60.0].map(|end| derived(end, "max_volume = 0.2", &weir(0.04)));
    assert!(filled[0] < 0.11 && near(filled[1], 0.2), "{filled:?}");
}

#[test]
fn a_force_on_a_face_says_that_it_leaves_the_opening_out() {
    let noted = |on: &str| {
        let more = format!(
            "[[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0.1, 0.1]\nvelocity = 0.1\n\
             [[gauge.force]]\nname = \"F\"\non = \"{on}\"\n"
        );
        let scene = Scene::build(&tank(0.1, &more).parse().unwrap()).unwrap_or_else(|e| panic!("{e}"));
        scene.notes.iter().any(|n| n.starts_with("gauge.force `F` leaves out") && n.contains("inflow `in`"))
    };
    let told = ["tank.x_min", "tank", "tank.x_max", "*", "in"].map(noted);
    assert_eq!(told, [true, true, false, false, false]);
}

#[test]
fn plan_knows_how_fast_water_will_come_in() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("channel.toml");
    let inflow = "[[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0.1, 0.1]\n";
    let planned = |rate: &str| {
        std::fs::write(&path, tank(0.1, &format!("{inflow}{rate}\n"))).expect("a file");
        let told = ran(&["plan", &path.display().to_string(), "--json"]);
        assert_eq!(told.code, 0, "{}", told.err);
        json(&told.out)["time_step_s"].as_f64().expect("a number")
    };
    // 0.35 l0 over the speed; without it 2 sqrt(g H) is the fastest.
    let slow = planned("velocity = 0.01");
    assert!(slow > 1.7e-3, "{slow}");
    let fast = planned("velocity = [[0, 0], [1, 20]]");
    assert!(fast > 0.0 && fast <= 0.35 * 0.01 / 20.0, "{fast}");
}

#[test]
fn a_hydrograph_comes_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tank.toml");
    let inflow = "[[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0.1, 0.1]\n";
    std::fs::write(&path, tank(0.1, &format!("{inflow}discharge = \"flood.csv\"  # measured\n"))).unwrap();
    let flood = |text: &str| std::fs::write(folder.path().join("flood.csv"), text).unwrap();
    flood("# gauge 7\ntime [s], discharge [m2/s]\n0, 0\n1.5, 0.03\n");
    let rates = |sets: &[String]| {
        let loaded = seixo::case::file::load(&path, None, sets).unwrap_or_else(|e| panic!("{e}"));
        assert!(sets.len() == 1 || loaded.text.contains("# measured"), "{}", loaded.text);
        loaded.case.inflow[0].discharge.clone()
    };
    use seixo::case::Rate;
    assert_eq!(rates(&[]), Some(Rate::Table(vec![[0.0, 0.0], [1.5, 0.03]])));
    assert_eq!(rates(&["inflow.0.discharge=0.02".into()]), Some(Rate::Constant(0.02)));
    flood("0, 0\n1.5, 0.03, 0.1\n");
    let told = seixo::case::file::load(&path, None, &[]).expect_err("three numbers").to_string();
    assert!(told.contains("flood.csv:2: expected time [s] and value"), "{told}");
}

#[test]
fn a_scene_without_openings_has_no_such_stage() {
    let case: Case = tank(0.1, "").parse().expect("valid");
    let scene = Scene::build(&case).expect("valid");
    let params = seixo::params::Params::new(&case, &scene).expect("valid");
    let plan = Plan::new(&case, &scene, &params);
    assert!(!plan.has(Stage::Openings) && scene.reserve == 0 && scene.water() == scene.groups.fluid);
}

#[test]
fn what_is_wrong_with_an_opening_is_told() {
    let inflow = |keys: &str| format!("[[inflow]]\nname = \"in\"\n{keys}\n");
    let face = "face = \"x_min\"\n";
    let box_low = "min = [0, 0, 0]\nmax = [0, 0.1, 0.1]\n";
    for (text, words) in [
        (tank(0.1, &inflow(face)), "brings no water"),
        (tank(0.1, &inflow(&format!("{face}velocity = 1\ndischarge = 1"))), "exclude each other"),
        (tank(0.1, &inflow(&format!("{face}velocity = -1"))), "out of range"),
        (
            tank(0.1, &inflow(&format!("{face}velocity = \"fast\""))),
            "a number, or rows of time [s] and value",
        ),
        (tank(0.1, &inflow(&format!("{face}velocity = [[0, 1], [0, 2]]"))), "does not come after"),
        (tank(0.1, &inflow(&format!("{face}velocity = []"))), "no rows"),
        (tank(0.1, &inflow("face = \"z_max\"\nvelocity = 1")), "tank.open"),
        (tank(0.1, &inflow("face = \"y_min\"\nvelocity = 1")), "in two dimensions"),
        (tank(0.1, &inflow(&format!("{face}velocity = 1\nmin = [0, 0, 0]"))), "add `max`"),
        (
            tank(0.1, &inflow(&format!("{face}velocity = 1\nmin = [0.2, 0, 0]\nmax = [0.3, 0.1, 0.1]"))),
            "does not meet `x_min`",
        ),
        (
            tank(0.1, &inflow(&format!("{face}velocity = 1\nmin = [0, 0, 0.5]\nmax = [0, 0.1, 0.6]"))),
            "less than one particle",
        ),
        (
            tank(0.1, &inflow(&format!("{face}velocity = 9\n{box_low}")))
                .replace("adaptive = true", "adaptive = false"),
            "use run.time_step",
        ),
        (
            tank(0.1, "[output]\nledger = true\n[[outflow]]\nname = \"out\"\nface = \"x_min\"\n"),
            "output.ledger",
        ),
        (
            tank(
                0.1,
                &format!(
                    "{}{}",
                    inflow(&format!("{face}velocity = 1")),
                    "[[outflow]]\nname = \"in\"\nface = \"x_max\"\n"
                ),
            ),
            "is taken",
        ),
        (tank(0.1, "").replace("[fluid]\n", "[fluid]\nmax_volume = 1\n"), "without an inflow"),
    ] {
        let error = text.parse::<Case>().expect_err(words).to_string();
        assert!(error.contains(words), "{words}: {error}");
    }
    // What only the scene shows.
    let two =
        format!("{}[[outflow]]\nname = \"out\"\n{face}", inflow(&format!("{face}velocity = 1\n{box_low}")));
    let error =
        |text: String| Scene::build(&text.parse().expect("the check passes")).expect_err("wrong").to_string();
    assert!(error(tank(0.1, &two)).contains("overlaps `in`"));
    let little = tank(0.1, &inflow(&format!("{face}velocity = 1")))
        .replace("[fluid]\n", "[fluid]\nmax_volume = 0.01\n");
    assert!(error(little).contains("fluid.max_volume"));
}

#[test]
fn a_tank_that_lets_nothing_out_says_when_it_is_full() {
    let noted = |text: &str| {
        let scene = Scene::build(&text.parse().unwrap()).unwrap_or_else(|e| panic!("{e}"));
        scene.notes.into_iter().find(|n| n.starts_with("inflow: the tank is full"))
    };
    // 0.4 x 0.2 m are left at 0.05 m2/s.
    let inflow =
        "[[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0.1, 0.1]\nvelocity = 0.5\n";
    let open = tank(0.2, inflow);
    let shut = open.replace("open = [\"z_max\"]\n", "");
    let note = noted(&shut).expect("it overflows");
    assert!(note.contains("full at t = 1.6000 s") && note.contains("add an [[outflow]]"), "{note}");
    let outflow = "[[outflow]]\nname = \"out\"\nface = \"x_max\"\n";
    for fine in [
        open,
        format!("{shut}{outflow}"),
        shut.replace("end = 2.0", "end = 1.5"),
        shut.replace("[fluid]\n", "[fluid]\nmax_volume = 0.15\n"),
    ] {
        assert_eq!(noted(&fine), None, "{fine}");
    }
    // And so does the end of the run, also of one in which it is the water that has no room, not a wall.
    let body = "[[body]]\nname = \"float\"\nsize = [0.1, 0.1, 0.06]\ncenter = [0.2, 0, 0.2]\ndensity = 500\n\
                displaces_fluid = true\n[contact]\nspring = 2e4\n";
    let mut simulation = opened(&format!("{shut}{body}").replace("end = 2.0", "end = 3.0"), &Processor::Cpu);
    let why = loop {
        match simulation.step() {
            Ok(_) => assert!(simulation.time < 3.0, "it holds all of it"),
            Err(e) => break e.to_string(),
        }
    };
    println!("{why}");
    assert!(why.contains("lets nothing out and is full at t = 1.5"), "{why}");
    let hole = format!("{}[[gauge.force]]\nname = \"f\"\non = \"out\"\n", tank(0.2, outflow));
    let why = hole.parse::<Case>().expect_err("refused").to_string();
    assert!(why.contains("outflow `out` is a hole"), "{why}");
}
