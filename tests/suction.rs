//! Water that pulls (`fluid.suction`): pressures below that of the air, on both backends.

use crate::common::{case, gauges, mean_over, processors, simulation};
use seixo::case::Case;
use seixo::scene::Scene;
use seixo::simulation::Simulation;

/// A square of water of 1 m that spins with 3 rad/s in weightlessness (Le Touze et al. 2013).
fn spinning_square(cells: u32, suction: bool) -> Case {
    let (l0, dt) = (1.0 / f64::from(cells), 0.08 / f64::from(cells));
    case(&format!(
        "[run]\nspacing = {l0}\ntime_step = {dt}\nend = 1.0\ngravity = [0, 0, 0]\ndimensions = 2\n\
         domain = [[-2, -0.1, -2], [2, 0.1, 2]]\n[fluid]\nviscosity = 0\nsuction = {suction}\n\
         [[fluid.block]]\nmin = [-0.5, 0, -0.5]\nmax = [0.5, 0.1, 0.5]\n\
         velocity_gradient = [[0, 0, 3], [0, 0, 0], [-3, 0, 0]]"
    ))
}

/// Particles within a quarter of a metre of the middle, and the kinetic energy over that at the start.
fn held(simulation: &mut Simulation) -> (usize, f64) {
    let fields = simulation.backend.read().expect("the fields");
    let water = simulation.groups.fluid;
    let near = fields.position[..water].iter().filter(|x| x.length() < 0.25).count();
    let energy: f64 = fields.velocity[..water].iter().map(|v| v.length_squared()).sum();
    (near, energy)
}

#[test]
fn a_square_that_spins_holds_together() {
    for processor in processors("a spinning square") {
        let spun = |suction: bool| {
            let case = spinning_square(40, suction);
            let mut simulation =
                Simulation::on(&case, Scene::build(&case).unwrap(), &processor).expect("it starts");
            let start = held(&mut simulation);
            // The first step has turned by half of its time alone.
            (0..20).for_each(|_| drop(simulation.step().unwrap()));
            let fields = simulation.backend.read().unwrap();
            let lowest = fields.pressure[..simulation.groups.fluid].iter().copied().fold(0.0, f64::min);
            while simulation.time < 0.5 {
                simulation.step().unwrap();
            }
            let end = held(&mut simulation);
            (lowest, end.0 as f64 / start.0 as f64, end.1 / start.1)
        };
        let (lowest, left, energy) = spun(true);
        // Poisson's equation on a square: -0.0737 * 2 rho w^2 L^2 in the middle.
        let exact = -0.07367 * 2.0 * 1000.0 * 9.0;
        println!("{lowest:.1} Pa for {exact:.1}, {left:.3} of the middle's water, {energy:.4} of the energy");
        assert!((lowest / exact - 1.0).abs() < 0.05, "{lowest} for {exact}");
        assert!((left - 1.0).abs() < 0.05 && (energy - 1.0).abs() < 0.03, "{left} {energy}");
        let (lowest, left, _) = spun(false);
        assert!(lowest == 0.0 && left < 0.4, "{lowest} {left}");
    }
}

#[test]
fn a_floating_box_that_is_lifted_pulls_its_water_along() {
    // 0.2 x 0.1 m, half immersed, lifted by 5 and 20 m/s2: buoyancy of 98 N/m, what it displaces moving up, and linear theory's added mass.
    for (acceleration, exact) in [(5.0, -15.0), (20.0, -356.0)] {
        let rows: Vec<String> = (0..=60)
            .map(|k| f64::from(k) * 1e-3)
            .map(|t| format!("[{t}, 0, 0, {}]", 0.5 * acceleration * t * t))
            .collect();
        let text = format!(
            "[run]\nspacing = 0.01\ntime_step = 5e-4\nend = 0.06\ngravity = [0, 0, -9.81]\ndimensions = 2\n\
             [tank]\nmin = [0, 0, 0]\nmax = [1, 0.1, 1]\nopen = [\"z_max\"]\n\
             [fluid]\nwall_friction = 0\njitter = 0.02\nsuction = true\n\
             [[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0.1, 0.4]\n\
             [[body]]\nname = \"box\"\nsize = [0.2, 0.1, 0.1]\ncenter = [0.5, 0, 0.4]\ndisplaces_fluid = true\nmotion = [{}]\n\
             [[gauge.force]]\nname = \"box\"\non = \"box\"",
            rows.join(", ")
        );
        let case = case(&text);
        for processor in processors("a box that is lifted") {
            let mut lifted =
                Simulation::on(&case, Scene::build(&case).unwrap(), &processor).expect("it starts");
            let [force] = mean_over(&mut lifted, [0.006, 0.03], |now| gauges(now, ["box_force_z"]));
            let force = force / 0.01;
            println!("{acceleration} m/s2: {force:.1} N/m for {exact}");
            assert!((force - exact).abs() < 5.0 + 0.06 * f64::abs(exact), "{force} for {exact}");
        }
    }
}

#[test]
fn what_stands_beside_a_wall_above_the_waters_level_is_not_thrown_off_it() {
    // A cup turned over, full 0.5 m above the water around it: 4 kPa below the air at the box of 0.12 m, whose lift is 2.83 N.
    let cup = |at: &str| {
        let text = format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.1\ngravity = [0, 0, -9.81]\ndimensions = 2\n\
             [tank]\nmin = [0, 0, 0]\nmax = [1, 0.1, 1]\nopen = [\"z_max\"]\n[fluid]\nwall_friction = 0\nsuction = true\n\
             [[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0.1, 0.3]\n[[fluid.block]]\nmin = [0.36, 0, 0.3]\nmax = [0.64, 0.1, 0.8]\n\
             [[obstacle]]\nname = \"l\"\nmin = [0.28, 0, 0.2]\nmax = [0.36, 0.1, 0.88]\n\
             [[obstacle]]\nname = \"r\"\nmin = [0.64, 0, 0.2]\nmax = [0.72, 0.1, 0.88]\n\
             [[obstacle]]\nname = \"top\"\nmin = [0.36, 0, 0.8]\nmax = [0.64, 0.1, 0.88]\n\
             [[body]]\nname = \"box\"\nsize = [0.12, 0.1, 0.12]\ncenter = {at}\ndisplaces_fluid = true\n\
             motion = [[0, 0, 0, 0]]\n[[gauge.force]]\nname = \"box\"\non = \"box\""
        );
        let mut held = simulation(&case(&text));
        mean_over(&mut held, [0.05, 0.1], |now| gauges(now, ["box_force_x", "box_force_z"]))
    };
    for at in ["[0.5, 0, 0.6]", "[0.43, 0, 0.6]", "[0.5, 0, 0.73]"] {
        let [across, up] = cup(at);
        println!("{at}: {across:.2} N across, {up:.2} N up");
        assert!(across.abs() < 0.5 && (up - 2.83).abs() < 0.7, "{at}: {across} {up}");
    }
}
