//! Gauges against statics and against the momentum that walls take from the water.

use crate::common;
use common::*;
use seixo::gauges::Gauges;
use seixo::output::table::Cell;
use seixo::scene::Scene;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The last row by column.
fn row(gauges: &Gauges, sim: &mut seixo::simulation::Simulation) -> BTreeMap<String, f64> {
    let cells = gauges.row(sim).expect("the gauges can be read");
    let numbers = cells.into_iter().map(|c| if let Cell::Number(x) = c { x } else { f64::NAN });
    gauges.header().into_iter().zip(numbers).collect()
}

/// Still water 0.24 x 0.24 x 0.2 m with a pillar that stands out of it.
const STILL: &str = r#"
[run]
spacing = 0.02
time_step = 1e-3
end = 1.0
gravity = [0, 0, -9.81]
[fluid]
sound_speed = 4
PRESET
[[fluid.block]]
min = [0, 0, 0]
max = [0.24, 0.24, 0.2]
[tank]
min = [0, 0, 0]
max = [0.24, 0.24, 0.4]
open = ["z_max"]
[[obstacle]]
name = "pillar"
min = [0.08, 0.08, 0]
max = [0.16, 0.16, 0.4]
open = ["z_min", "z_max"]
[[gauge.force]]
name = "floor"
on = "tank.z_min"
[[gauge.force]]
name = "side"
on = "tank.x_min"
[[gauge.force]]
name = "pillar"
on = "pillar"
[[gauge.pressure]]
name = "half"
point = [0, 0.12, 0.1]
[[gauge.pressure]]
name = "foot"
point = [0.04, 0.04, 0]
[[gauge.pressure]]
name = "dry"
point = [0, 0.12, 0.35]
"#;

#[test]
fn walls_of_still_water_carry_what_statics_say() {
    for preset in ["", "preset = \"paper\""] {
        let case = case(&STILL.replace("PRESET", preset));
        let scene = Arc::new(Scene::build(&case).expect("the scene builds"));
        let gauges = Gauges::new(&case, &scene).expect("the gauges find their walls");
        let mut sim = cpu_simulation(&case, scene.clone());
        let (mut sum, mut rows) = (BTreeMap::<String, f64>::new(), 0.0);
        for step in 0..60 {
            sim.step().expect("still water stands");
            // The lattice of the start melts later; before, statics is all there is.
            if step >= 20 {
                rows += 1.0;
                row(&gauges, &mut sim).into_iter().for_each(|(k, v)| *sum.entry(k).or_default() += v);
            }
        }
        let mean = |name: &str| sum[name] / rows;
        let weight = 1000.0 * 9.81;
        let floor = weight * 0.2 * (0.24 * 0.24 - 0.08 * 0.08);
        let side = weight * 0.5 * 0.2 * 0.2 * 0.24;
        for (name, expected, within) in [
            ("floor_force_z [N]", -floor, 0.03 * floor),
            ("side_force_x [N]", -side, 0.05 * side),
            ("side_force_z [N]", 0.0, 0.02 * side),
            ("pillar_force_x [N]", 0.0, 0.02 * side),
            ("pillar_force_z [N]", 0.0, 0.02 * side),
            // Without the half spacing between P = 0 and the water's surface this would be 10 % too low.
            ("half [Pa]", weight * 0.1, 0.04 * weight * 0.1),
            ("foot [Pa]", weight * 0.2, 0.03 * weight * 0.2),
            ("dry [Pa]", 0.0, 1e-9),
        ] {
            let found = mean(name);
            println!("{preset:20} {name}: {found:.3} for {expected:.3}");
            assert!((found - expected).abs() <= within, "{preset} {name}: {found} for {expected}");
        }
    }
}

#[test]
fn the_viscous_force_on_a_floor_is_the_momentum_that_the_water_loses() {
    let case = case(
        "[run]\nspacing = 0.02\ntime_step = 1e-4\nend = 1.0\ngravity = [0, 0, 0]\n\
         [fluid]\nviscosity = 0.05\nsound_speed = 2\n\
         [[fluid.block]]\nmin = [0.2, 0.2, 0]\nmax = [0.4, 0.4, 0.1]\nvelocity = [0.5, 0, 0]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0.6, 0.3]\nopen = [\"z_max\"]\n\
         [[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n",
    );
    let scene = Arc::new(Scene::build(&case).expect("the scene builds"));
    let gauges = Gauges::new(&case, &scene).expect("the gauge finds its wall");
    let mut sim = cpu_simulation(&case, scene.clone());
    let start = sim.backend.monitor().expect("the monitor").momentum[0];
    sim.step().expect("a step");
    let lost = (start - sim.backend.monitor().expect("the monitor").momentum[0]) / 1e-4;
    let force = row(&gauges, &mut sim)["floor_viscous_x [N]"];
    println!("{force:.4} N on the floor, {lost:.4} N lost by the water");
    assert!(lost > 0.0 && (force / lost - 1.0).abs() < 0.03, "{force} for {lost}");
}

#[test]
fn a_gauge_finds_its_wall_at_every_spacing() {
    let shipped =
        std::fs::read_to_string(format!("{ROOT}/cases/dam_break_transport.toml")).expect("the case");
    let shipped = case(&shipped);
    for k in 0..30 {
        let mut case = shipped.clone();
        case.run.spacing = 0.021 + 0.001 * f64::from(k);
        // The gauges and the walls that they are on; bodies and gates need spacings that fit them.
        (case.body, case.moving_wall) = (Vec::new(), Vec::new());
        (case.gauge.force, case.contact) = (Vec::new(), None);
        case.fluid.as_mut().expect("water").block[0].max[0] = 3.5;
        let scene = Scene::build(&case).unwrap_or_else(|e| panic!("{}: {e}", case.run.spacing));
        Gauges::new(&case, &scene).unwrap_or_else(|e| panic!("{}: {e}", case.run.spacing));
    }
    let mut case = shipped;
    case.gauge.pressure[0].point = [1.5, 0.25, 0.2];
    case.run.spacing = 0.03;
    let error = Scene::build(&case).expect_err("a gauge in mid-air").to_string();
    assert!(error.contains("no fixed wall there"), "{error}");
}
