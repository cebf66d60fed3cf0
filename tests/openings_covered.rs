//! Openings that are covered in part. By the ground or an obstacle: water comes in beside it, at the discharge asked for. By what moves: it is held back as long as that
//! stands there, and told.

use crate::cli::{json, ran};
use crate::common::backends;
use crate::restart::assert_same;
use seixo::case::Case;
use seixo::scene::{Kind, Scene};
use seixo::{Options, Processor, Simulation};
use std::path::Path;

/// Speed of the water in the channel [m/s].
const SPEED: f64 = 0.4;
const SPACING: f64 = 0.02;

/// A channel in two dimensions, the ground of which reaches up to 0.06 m, with water up to 0.2 m that flows at [`SPEED`].
fn channel(ground: &str, inflow: &str) -> String {
    format!(
        "[run]\nspacing = {SPACING}\ntime_step = 2e-3\nadaptive = true\nend = 1.0\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1.2, 0.3, 0.4]\nopen = [\"z_max\"]\n\
         [fluid]\n[[fluid.fill]]\nseed = [0.5, 0, 0.12]\nlevel = 0.2\nvelocity = [{SPEED}, 0, 0]\n\
         [[obstacle]]\nname = \"bed\"\n{ground}\n\
         [[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0.3, 0.2]\n{inflow}\n\
         [[outflow]]\nname = \"out\"\nface = \"x_max\"\nvelocity = {SPEED}\n"
    )
}

const BOX: &str = "min = [0, 0, 0]\nmax = [1.2, 0.3, 0.06]";
const PRISM: &str = "shape = \"prism\"\nsection = [[-0.1, -0.1], [1.3, -0.1], [1.3, 0.06], [-0.1, 0.06]]";

#[test]
fn water_comes_in_beside_the_ground_at_the_discharge_asked_for() {
    crate::common::alone();
    for ground in [BOX, PRISM] {
        // 0.14 m of the 0.2 m are free.
        let case: Case =
            channel(ground, "discharge = 0.056").parse().unwrap_or_else(|e| panic!("{ground}: {e}"));
        let options = Options { processor: Processor::Cpu, ..Options::default() };
        let mut simulation = Simulation::open(&case, &options).unwrap_or_else(|e| panic!("{ground}: {e}"));
        let opening = &simulation.scene.openings[0];
        assert_eq!((opening.layer, opening.wet), (7, 7), "{ground}");
        let told = |what: &str| {
            let note = format!("{what}: obstacle `bed` before it, 3 of its");
            simulation.scene.notes.iter().any(|n| n.starts_with(&note))
        };
        assert!(told("inflow `in`") && told("outflow `out`"), "{:?}", simulation.scene.notes);
        let start = simulation.scene.water();
        while simulation.time < 1.0 {
            simulation.step().unwrap_or_else(|e| panic!("{ground}, {:.3} s: {e}", simulation.time));
        }
        let came = simulation.openings.total_emitted();
        let lost = simulation.observe().expect("it can be looked at").1.lost;
        // 0.4 m at seven a layer; the last of them may be due at this very moment.
        println!("{ground}: {came} in for 140, {lost} lost, {start} at the start");
        assert!((133..=140).contains(&came) && lost == 0, "{ground}: {came} in, {lost} lost");
        let fields = simulation.fields().expect("readable");
        let water = (0..simulation.groups.fluid).filter(|&i| fields.kind[i] == Kind::Fluid);
        let (mut there, mut lowest, mut highest) = (0, f64::INFINITY, 0.0_f64);
        for z in water.map(|i| fields.position[i].z) {
            (there, lowest, highest) = (there + 1, lowest.min(z), highest.max(z));
        }
        println!("{ground}: {there} there, {lowest:.4} to {highest:.4} m");
        assert!(lowest > 0.06 && highest < 0.23, "{ground}: water from {lowest} to {highest} m");
    }
}

#[test]
fn an_opening_that_is_covered_is_refused_and_one_that_hurries_too() {
    let wrong = |text: &str| {
        let case: Case = text.parse().unwrap_or_else(|e| panic!("{e}"));
        Scene::build(&case).expect_err("refused").to_string()
    };
    let covered = channel(BOX, "velocity = 0.4").replace("0.3, 0.2]\n", "0.3, 0.06]\n");
    let said = wrong(&covered);
    let parts = ["inflow `in`: obstacle `bed` before it, all of its 3 cells are covered", "`min` and `max`"];
    assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    // 2.7 m/s over all of the opening, 3.9 m/s over what is left.
    let hurries = channel(BOX, "discharge = 0.54")
        .replace("time_step = 2e-3\nadaptive = true", "time_step = 3e-3\nadaptive = false");
    let said = wrong(&hurries);
    assert!(said.contains("3.857 m/s") && said.contains("use run.time_step = 1.8e-3 or less"), "{said}");
}

/// Two beams across an opening, from `x` to `x` before its face, which cover 4 of its 10 cells and leave 3 parts free; they go up from 0.4 s on.
pub(crate) fn lifted(x: [f64; 2]) -> String {
    let beam = |name: &str, z: [f64; 2]| {
        format!(
            "[[moving_wall]]\nname = \"{name}\"\nmin = [{}, 0, {}]\nmax = [{}, 0.3, {}]\n\
             motion = [[0, 0, 0, 0], [0.4, 0, 0, 0], [0.8, 0, 0, 0.4]]\n",
            x[0], z[0], x[1], z[1]
        )
    };
    beam("beam", [0.02, 0.06]) + &beam("other", [0.1, 0.14])
}

/// Water at rest between an inflow and an outflow of 0.2 m.
pub(crate) fn pond(outflow: &str, more: &str) -> String {
    channel("min = [0.5, 0, 0]\nmax = [0.6, 0.3, 0.02]", "velocity = 0.4")
        .replace("level = 0.2\nvelocity = [0.4, 0, 0]", "level = 0.2")
        .replace("face = \"x_max\"\nvelocity = 0.4", &format!("face = \"x_max\"\n{outflow}"))
        + more
}

#[test]
fn what_stands_before_an_inflow_holds_it_back_as_long_as_it_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("a path").to_owned();
    // On the face, and with less than the room of a particle between.
    for (k, x) in [[0.0, 0.06], [0.018, 0.08]].into_iter().enumerate() {
        let case = at(&format!("{k}.toml"));
        let text = pond("velocity = 0.4", &lifted(x)).replace("end = 1.0", "end = 0.7");
        std::fs::write(&case, text).expect("it can be written");
        let planned = ran(&["plan", &case]);
        let note = "inflow `in`: moving wall `other` stands before 2 of its 10 cells at t = 0";
        assert!((planned.out + &planned.err).contains(note), "{note}");
        for backend in backends("what solids hold back of an inflow on a device").take(2 - k) {
            let run = |more: &[&str]| {
                let base = ["run", &case, "--backend", backend, "--threads", "1", "--quiet"];
                let args: Vec<&str> = base.into_iter().chain(more.iter().copied()).collect();
                let ran = ran(&args);
                assert_eq!(ran.code, 0, "{backend}, {x:?}: {}", ran.err);
            };
            let (whole, parts) = (at(&format!("{k}{backend}")), at(&format!("{k}{backend}_parts")));
            run(&["-o", &whole, "--set", "output.every=0.2"]);
            run(&["-o", &parts, "--set", "output.every=0.2", "--steps", "150"]);
            run(&["-o", &parts, "--set", "output.every=0.2", "--resume"]);
            assert_same(Path::new(&whole), Path::new(&parts), backend);
            let result = json(&std::fs::read_to_string(format!("{parts}/result.json")).expect("a result"));
            let inflow = &result["water"]["inflow"][0];
            let particles = inflow["particles"].as_u64().expect("a number");
            let missed = inflow["missed_m3"].as_f64().expect("a number") / SPACING.powi(3);
            println!("{backend}, {x:?}: {particles} in, {missed} held back");
            // 0.28 m are 14 layers of 10, the last of which may not be through; of the first 8 four are held back, and of some more while the beams pass.
            let all = particles as f64 + missed;
            assert!((all - 130.0).abs() < 1e-6 || (all - 140.0).abs() < 1e-6, "{all}");
            assert!((34.0..=56.0).contains(&missed.round()), "{missed}");
            let told = result["verdict"]["notes"][0].as_str().unwrap_or_default();
            assert!(
                told.starts_with("inflow `in` let ") && told.contains("solids stood before it"),
                "{result}"
            );
            assert_eq!(result["verdict"]["grade"], "fine", "{result}");
        }
    }
}

#[test]
fn what_an_outflow_misses_of_its_discharge_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let notes = |name: &str, more: &str| {
        let at = |end: &str| folder.path().join(format!("{name}{end}")).to_str().expect("a path").to_owned();
        // As much as comes in.
        std::fs::write(at(".toml"), pond("discharge = 0.08", more)).expect("it can be written");
        let (case, out) = (at(".toml"), at(""));
        let ran = ran(&["run", &case, "--backend", "cpu", "-o", &out]);
        assert_eq!(ran.code, 0, "{name}: {}", ran.err);
        let result = json(&std::fs::read_to_string(format!("{out}/result.json")).expect("a result"));
        let (missed, notes) = (&result["water"]["outflow"][0]["missed_m3"], &result["verdict"]["notes"]);
        println!("{name}: {missed} m3 missed, {notes}");
        assert!(
            notes[0].as_str().is_none_or(|note| ran.err.contains(note) || ran.out.contains(note)),
            "{}",
            ran.err
        );
        (missed.as_f64().expect("a number"), notes[0].as_str().unwrap_or_default().to_owned())
    };
    let (missed, said) = notes("free", "");
    assert!(missed < 2e-5 && said.is_empty(), "{missed} m3: {said}");
    let wall = "[[moving_wall]]\nname = \"lid\"\nmin = [1.14, 0, 0]\nmax = [1.2, 0.3, 0.18]\n\
                motion = [[0, 0, 0, 0], [0.9, 0, 0, 0], [1.0, 0, 0, 0.01]]\n";
    // 0.08 m2/s for a second are 1.6e-3 m3 of a slice.
    let (missed, said) = notes("covered", wall);
    assert!(missed > 5e-4 && said.starts_with("outflow `out` let "), "{missed} m3: {said}");
}

#[test]
fn a_pump_that_ran_dry_makes_up_for_no_more_than_a_layer() {
    crate::common::alone();
    // Nothing comes in for a second, then four times what the pump takes.
    let case: Case = "[run]\nspacing = 0.02\ntime_step = 2e-3\nadaptive = true\nend = 3.0\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0, 0.6]\nopen = [\"z_max\"]\n[fluid]\n\
         [[inflow]]\nname = \"up\"\nface = \"x_min\"\nmin = [0, 0, 0]\nmax = [0, 0, 0.1]\n\
         discharge = [[0, 0], [1, 0], [1.2, 0.12]]\n\
         [[outflow]]\nname = \"pump\"\nface = \"x_max\"\nmin = [0.6, 0, 0]\nmax = [0.6, 0, 0.1]\ndischarge = 0.03\n"
        .parse()
        .unwrap_or_else(|e| panic!("{e}"));
    let options = Options { processor: Processor::Cpu, ..Options::default() };
    let mut simulation = Simulation::open(&case, &options).unwrap_or_else(|e| panic!("{e}"));
    let mut out_at = |time: f64| {
        while simulation.time < time {
            simulation.step().unwrap_or_else(|e| panic!("{:.3} s: {e}", simulation.time));
        }
        let out = simulation.observe().expect("it can be looked at").1.swallowed[0];
        (simulation.time, out as f64 * SPACING * SPACING)
    };
    let (from, before) = out_at(1.3);
    let (middle, between) = out_at(2.0);
    let (to, after) = out_at(3.0);
    let discharge = (after - between) / (to - middle);
    println!("{before} m2 out by {from:.2} s, {between} by {middle:.2} s, {discharge} m2/s from there on");
    // A layer of 0.1 m, and the one that it is at.
    assert!(between <= 0.03 * (middle - from) + 2.0 * 0.1 * SPACING, "{between} m2");
    assert!((discharge / 0.03 - 1.0).abs() < 0.07, "{discharge} m2/s");
}
