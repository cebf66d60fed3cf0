//! Openings that the ground or an obstacle covers in part: water comes in beside it, at the discharge asked for.

use seixo::case::Case;
use seixo::scene::{Kind, Scene};
use seixo::{Options, Processor, Simulation};

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
