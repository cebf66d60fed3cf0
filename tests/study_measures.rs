//! What a point of a study measures, and what it refuses to.

use seixo::Error;
use seixo::error::Result;
use seixo_study::engine::{Context, cpu_only};
use seixo_study::row::Measured;
use seixo_study::run_point::{Point, run};

fn measured(case: &str, measure: &str) -> Result<Measured> {
    let spec = toml::from_str(measure).expect("measures");
    let point = Point { text: case.into(), spec, processor: Default::default(), repetitions: 1 };
    run(&point, &Context::new(&cpu_only))
}

/// A tank in two dimensions whose floor is at `floor`, with more in it.
fn tank(floor: f64, end: f64, more: &str) -> String {
    let top = floor + 0.6;
    format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = {end}\ndimensions = 2\n\
         [tank]\nmin = [0, 0, {floor}]\nmax = [0.4, 1, {top}]\nopen = [\"z_max\"]\n{more}"
    )
}

#[test]
fn energy_and_volume_count_from_where_the_water_ends_below() {
    let layer = "[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 1, 0.2]\n";
    let drop = "[[fluid.block]]\nmin = [0.1, 0, 0.4]\nmax = [0.2, 1, 0.5]\n";
    let boxes = |floor: f64| {
        let [a, b] = [0.1, 0.45].map(|z| z + floor);
        format!(
            "[[fluid.shape]]\nshape = \"box\"\ncenter = [0.15, 0, {b}]\nsize = [0.1, 1, 0.1]\n\
             [[fluid.shape]]\nshape = \"box\"\ncenter = [0.2, 0, {a}]\nsize = [0.4, 1, 0.2]\n"
        )
    };
    let cases = [
        (0.0, format!("{layer}{drop}")),
        (0.0, format!("{drop}{layer}")),
        (0.0, boxes(0.0)),
        (-1.0, boxes(-1.0)),
    ];
    let all = cases.map(|(floor, water)| {
        measured(&tank(floor, 0.03, &water), "of = [\"energy\", \"volume\", \"front\"]").expect("it runs")
    });
    for name in ["energy left [-]", "energy rise [-]", "volume [-]"] {
        let values = all.each_ref().map(|m| m.value(name).expect("it is measured"));
        assert!(values.iter().all(|v| (v - values[0]).abs() < 1e-5), "{name}: {values:?}");
    }
    let starts = all.each_ref().map(|m| m.curves["front scaled"][0][1]);
    assert!(starts.iter().all(|z| (z - 1.0).abs() < 1e-9), "{starts:?}");
}

#[test]
fn a_draft_is_that_of_a_box_on_any_of_its_faces_and_of_nothing_else() {
    let afloat = |form: &str| {
        let text = format!(
            "[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 1, 0.2]\n[[body]]\nname = \"raft\"\n{form}\n\
             center = [0.2, 0, 0.22]\ndensity = 300\ndisplaces_fluid = true\nlocked = [\"x\", \"rotation_y\"]\n\
             [contact]\nspring = 1e4\n"
        );
        measured(&tank(0.0, 0.01, &text), "of = [\"draft\"]")
    };
    let turned = |degrees: f64| {
        format!("size = [0.1, 1, 0.2]\norientation = {{ axis = [0, 1, 0], angle_deg = {degrees} }}")
    };
    let flat = afloat("size = [0.2, 1, 0.1]").expect("it runs");
    let on_its_side = afloat(&turned(90.0)).expect("it runs");
    for (name, value) in [("draft of Archimedes [m]", 0.03), ("draft [m]", 0.03), ("tilt [deg]", 0.0)] {
        let told = [&flat, &on_its_side].map(|m| m.value(name).expect("it is measured"));
        assert!(told.iter().all(|v| (v - value).abs() < 0.012), "{name}: {told:?}");
        assert!((told[0] - told[1]).abs() < 1e-6, "{name}: {told:?}");
    }
    for (form, why) in [
        (turned(20.0), "is turned"),
        ("shape = \"cylinder\"\nradius = 0.08".into(), "`raft`, is a "),
        ("shape = \"wedge\"\nsize = [0.2, 1, 0.1]".into(), "`raft`, is a "),
    ] {
        let Err(Error::Case(refused)) = afloat(&form) else { panic!("{form}: it is measured") };
        assert!(refused.problems[0].key == "measure.of" && refused.to_string().contains(why), "{refused}");
    }
}

#[test]
fn two_curves_of_one_name_are_refused() {
    let text = "[[body]]\nname = \"fluid\"\nsize = [0.1, 1, 0.1]\ncenter = [0.2, 0, 0.4]\ndensity = 500\n\
                [contact]\nspring = 1e4\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 1, 0.1]\n";
    let case = tank(0.0, 0.003, text);
    let refused = measured(&case, "of = [\"bodies\", \"fluid\"]").expect_err("one is taken for the other");
    assert!(
        refused.to_string().contains("`fluid x [m]`: that of the solid `fluid` and that of the water"),
        "{refused}"
    );
    let alone = measured(&case, "of = [\"bodies\"]").expect("it runs");
    assert!((alone.curves["fluid x [m]"][0][1] - 0.2).abs() < 1e-9, "{:?}", alone.curves["fluid x [m]"]);
    let profile = "of = [\"front\"]\nprofile = [{ name = \"front\", of = \"vx\", along = \"x\", \
                   within = [[0, 0, 0], [1, 1, 1]], bins = 2 }]";
    let refused = measured(&case, profile).expect_err("one is taken for the other");
    assert!(refused.to_string().contains("`front"), "{refused}");
}
