//! Water that fills all its room: no free surface, and a pressure whose level is that its smallest is 0.

use crate::common::*;
use glam::DVec3;
use seixo::backend::{Processor, gpu};
use seixo::case::Case;
use seixo::fields::State;
use seixo::params::Params;
use seixo::plan::{Arrays, ParticleStage, Plan, Stage};
use seixo::scene::{Kind, Scene};
use seixo::simulation::Simulation;
use std::f64::consts::PI;

/// The first adapter, if there is one.
fn device() -> Option<Processor> {
    (!gpu::adapters().is_empty()).then_some(Processor::Gpu { adapter: None })
}

/// A Taylor-Green vortex in a square of L = 1 m with `cells` spacings a side, U = 1 m/s, Re = U L / nu = 100, at t = 0.5 s: rate at which its
/// energy decayed over the exact one, 16 pi^2 nu / L^2, and the rms of the velocity's error over its own.
fn taylor_green(cells: usize, processor: &Processor) -> (f64, f64) {
    let (nu, k) = (0.01, 2.0 * PI);
    let exact =
        |x: DVec3| DVec3::new((k * x.x).sin() * (k * x.z).cos(), 0.0, -(k * x.x).cos() * (k * x.z).sin());
    let (mut sim, decay) = stirred_square(cells, processor, exact);
    let rate = decay / (4.0 * nu * k * k);
    let fields = sim.backend.read().expect("the fields");
    let left = (-2.0 * nu * k * k * sim.time).exp();
    let (mut wrong, mut all) = (0.0, 0.0);
    for (v, x) in fields.velocity.iter().zip(&fields.position).take(sim.groups.fluid) {
        wrong += (*v - left * exact(*x)).length_squared();
        all += (left * exact(*x)).length_squared();
    }
    assert_eq!(sim.backend.counters().expect("counted").lost, 0);
    (rate, (wrong / all).sqrt())
}

#[test]
fn a_taylor_green_vortex_decays_as_viscosity_says() {
    let (coarse, fine) = (taylor_green(40, &Processor::Cpu), taylor_green(120, &Processor::Cpu));
    println!(
        "rate over the exact one, rms of the velocity: {coarse:.3?} at 40 spacings a side, {fine:.3?} at 120"
    );
    assert!((fine.0 - 1.0).abs() < 0.06 && fine.1 < 0.03, "{fine:?}");
    assert!(fine.1 < 0.5 * coarse.1, "{coarse:?}, {fine:?}");
    if let Some(processor) = device() {
        let found = taylor_green(40, &processor);
        println!("on the device {found:.3?} at 40");
        // The lattice melts on the way, and differently in f32.
        assert!((found.0 - coarse.0).abs() < 0.05 && (found.1 - coarse.1).abs() < 0.02, "{found:?}");
    }
}

/// A closed tank of 0.4 x 0.4 x 0.5 m, full but for what `more` adds.
fn full_tank(fluid: &str, more: &str) -> Case {
    case(&format!(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -10]\n\
         [fluid]\nsound_speed = 5\n{fluid}\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.5]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.5]\nopen = []\n{more}"
    ))
}

#[test]
fn water_that_fills_all_its_room_has_no_free_surface() {
    let filled = |case: &Case| Scene::build(case).expect("it builds").filled;
    let full = full_tank("", "");
    assert!(filled(&full));
    let params = Params::new(&full, &Scene::build(&full).expect("it builds")).expect("valid");
    let plan = Plan::new(&full, &Scene::build(&full).expect("it builds"), &params);
    assert!(!plan.has(Stage::SurfacePressure) && plan.needs(Arrays::Level));
    // A body that takes the water's place changes nothing; air, an opening or a wall that moves does.
    let cube = "[[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.2, 0.2, 0.25]\ndensity = 1000\n\
                displaces_fluid = true\n[contact]\nspring = 1e5\n";
    assert!(filled(&full_tank("", cube)));
    assert!(!filled(&hydrostatic_of_depth(0.3, 0.05, 1e-3, "")));
    let mut low = full.clone();
    low.tank.as_mut().expect("a tank").max[2] = 0.55;
    assert!(!filled(&low));
    let gate = "[[moving_wall]]\nname = \"gate\"\nmin = [0.2, 0, 0]\nmax = [0.25, 0.4, 0.5]\n\
                motion = [[0, 0, 0, 0], [1, 0, 0, 0.1]]\n";
    assert!(!filled(&full_tank("", gate)));
    // A bar that turns covers now more and now fewer centres of cells and takes the same room; a piston takes more and more.
    let bar = |motion: &str| {
        filled(&full_tank(
            "",
            &format!(
                "[[body]]\nname = \"bar\"\nsize = [0.24, 0.2, 0.06]\ncenter = [0.2, 0.2, 0.25]\ndisplaces_fluid = true\n{motion}\n"
            ),
        ))
    };
    assert!(bar("swing = { axis = [0, 1, 0], amplitude_deg = 25, period = 0.4 }"));
    assert!(bar("rotation = [[0, 0, 0, 0], [1, 40, 300, 0]]"));
    let piston = "[[moving_wall]]\nname = \"piston\"\nmin = [-0.2, 0, 0]\nmax = [0, 0.4, 0.5]\n\
                  motion = [[0, 0, 0, 0], [1, 0.05, 0, 0]]\n";
    assert!(!filled(&full_tank("", piston)));
    // To the letter the paper's: a surface wherever n is low.
    let paper = full_tank("preset = \"paper\"", "");
    let scene = Scene::build(&paper).expect("it builds");
    assert!(!Params::new(&paper, &scene).expect("valid").filled);
}

#[test]
fn a_particle_without_neighbours_is_no_surface_where_there_is_none() {
    let mut all = vec![Processor::Cpu];
    all.extend(device());
    for processor in all {
        let case = full_tank("", "");
        let scene = Scene::build(&case).expect("it builds");
        let mut sim = Simulation::on(&case, scene, &processor).expect("it starts");
        let mut fields = sim.backend.read().expect("the fields");
        let fluid = sim.groups.fluid;
        fields.kind[1..fluid].fill(Kind::Ghost);
        fields.position[0] = DVec3::new(0.2, 0.2, 0.25);
        sim.backend.write(&fields).expect("written");
        let step = sim.params.step(0.0, 1e-3, 1.0);
        for stage in [ParticleStage::CellList, ParticleStage::NeighbourList, ParticleStage::NumberDensity] {
            sim.backend.run(stage, &step).expect("it runs");
        }
        let fields = sim.backend.read().expect("the fields");
        assert_eq!((fields.kind[0], fields.number_density[0]), (Kind::Fluid, 0.0));
        assert_eq!(fields.state[0], State::Inner, "{}", sim.backend.description());
    }
}

/// Largest difference of the water's pressure from that at rest with 0 in the ceiling's layer, over rho g H, and the largest speed [m/s] after
/// `steps` steps from a shaken start.
fn at_rest(case: &Case, steps: usize, processor: &Processor) -> (f64, f64) {
    let scene = Scene::build(case).expect("it builds");
    let mut sim = Simulation::on(case, scene, processor).expect("it starts");
    for _ in 0..steps {
        sim.step().expect("a step");
    }
    let fields = sim.backend.read().expect("the fields");
    let wrong =
        |i: usize| (fields.pressure[i] - 1000.0 * 10.0 * (0.525 - fields.position[i].z)).abs() / 5000.0;
    let worst = (0..sim.groups.fluid).map(wrong).fold(0.0, f64::max);
    (worst, fields.velocity[..sim.groups.fluid].iter().map(|v| v.length()).fold(0.0, f64::max))
}

#[test]
fn a_closed_tank_that_is_full_rests_with_no_pressure_below_zero() {
    let mut all = vec![("cpu", Processor::Cpu)];
    all.extend(device().map(|processor| ("device", processor)));
    for (name, processor) in all {
        // On the lattice the solve's tolerance is what is left; a start shaken by a tenth of a spacing is still coming to rest.
        for (fluid, steps, most) in [("", 20, [3e-3, 1e-3]), ("jitter = 0.1", 200, [0.025, 0.04])] {
            let (pressure, speed) = at_rest(&full_tank(fluid, ""), steps, &processor);
            println!("{name}: pressure within {pressure:.1e} of rho g H, {speed:.1e} m/s");
            assert!(pressure < most[0] && speed < most[1], "{name}: {pressure}, {speed}");
        }
    }
}

/// Acceleration of a cube of density ratio `s` let go in a full closed tank over g (s - 1) / (s + C) with C = 0.67 of an endless fluid, from
/// its speed after 10 ms, and after 20 ms where it is asked `to_the_end`.
fn cube(s: f64, processor: &Processor, to_the_end: bool) -> Vec<f64> {
    let case = case(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -10]\n\
         [fluid]\nsound_speed = 5\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.5, 0.5, 0.5]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.5, 0.5, 0.5]\nopen = []\n\
         [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.25, 0.25, 0.25]\ndensity = {}\n\
         displaces_fluid = true\n[contact]\nspring = 1e5\n",
        1000.0 * s
    ));
    let scene = Scene::build(&case).expect("it builds");
    let mut sim = Simulation::on(&case, scene, processor).expect("it starts");
    assert!(sim.params.filled);
    let times = if to_the_end { vec![0.01, 0.02] } else { vec![0.01] };
    let mut over = |time: f64| {
        while sim.time < time - 1e-9 {
            sim.step().expect("a step");
        }
        sim.solids.poses()[0].velocity.z / sim.time / (10.0 * (1.0 - s) / (s + 0.67))
    };
    times.into_iter().map(&mut over).collect()
}

#[test]
fn a_light_and_a_heavy_cube_move_in_a_full_tank_as_added_mass_says() {
    let [lights, heavies] = [0.3, 3.0].map(|s| cube(s, &Processor::Cpu, true));
    println!("light {lights:.3?}, heavy {heavies:.3?} of the acceleration in an endless fluid");
    let (light, heavy) = (lights[1], heavies[1]);
    assert!((light - 1.0).abs() < 0.12 && (heavy - 1.0).abs() < 0.12, "{light} {heavy}");
    if let Some(processor) = device() {
        let there = cube(0.3, &processor, false)[0];
        println!("the light one on the device {there:.5}, on the CPU {:.5}", lights[0]);
        assert!((there - lights[0]).abs() < 1e-3, "{there}, {}", lights[0]);
    }
}

/// A full tank of 2 dimensions without weight, and a body in it.
fn weightless(size: [f64; 2], spacing: f64, dt: f64, fluid: &str, body: &str) -> Case {
    let [x, z] = size;
    case(&format!(
        "[run]\nspacing = {spacing}\ntime_step = {dt}\nadaptive = true\nend = 10.0\ngravity = [0, 0, 0]\ndimensions = 2\n\
         [fluid]\n{fluid}\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [{x}, 0, {z}]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [{x}, 0, {z}]\nopen = []\n\
         [contact]\nspring = 1e5\n[[body]]\nname = \"body\"\ndensity = 1000\ndisplaces_fluid = true\n{body}"
    ))
}

#[test]
fn a_disc_in_creeping_flow_between_walls_is_held_back_as_faxen_says() {
    // Radius over half the gap: .3. Nothing but viscosity says how stiff the water has to be, and how high pressures may be.
    let (gap, radius, speed, nu, l0) = (0.2, 0.03, 0.01, 0.006, 0.01);
    let body = format!(
        "shape = \"cylinder\"\nradius = {radius}\nheight = 0.1\naxis = [0, 1, 0]\ncenter = [0.3, 0, {}]\n\
         motion = [[0, 0, 0, 0], [20, {}, 0, 0]]",
        0.5 * gap,
        20.0 * speed
    );
    let case = weightless([0.8, gap], l0, 1e-2, &format!("viscosity = {nu}\nwall_friction = 0"), &body);
    let k = 2.0 * radius / gap;
    let series = [-0.9157, 1.7244, -1.7302, 2.4056, -4.5913];
    let series: f64 = series.iter().zip([0, 2, 4, 6, 8]).map(|(c, n)| c * k.powi(n)).sum();
    let exact = 4.0 * PI * 1000.0 * nu * speed / (series - k.ln()) * l0;
    let mut sim = simulation(&case);
    let (mut sum, mut time) = (0.0, 0.0);
    while sim.time < 2.5 {
        let before = sim.time;
        sim.step().expect("a step");
        if sim.time > 1.5 {
            let dt = sim.time - before;
            (sum, time) = (sum - dt * sim.fluid_force[0].force.x, time + dt);
        }
    }
    let ratio = sum / time / exact;
    println!("drag over Faxen's: {ratio:.3}");
    assert!((ratio - 1.0).abs() < 0.04, "{ratio}");
}

#[test]
fn the_friction_of_walls_holds_a_disc_that_turns_back_as_fast_as_its_surface_goes() {
    // tau = rho C_f v^2 with the velocity of the surface, half a spacing outside of the particles that it acts on.
    let (l0, rate, friction): (f64, f64, f64) = (0.01, 2.0, 0.01);
    for (radius, bound) in [(0.05_f64, 0.03), (0.1, 0.02)] {
        let body = format!(
            "shape = \"cylinder\"\nradius = {radius}\nheight = 0.1\naxis = [0, 1, 0]\ncenter = [0.2, 0, 0.2]\n\
             rotation = [[0, 0, 0, 0], [20, 0, {}, 0]]",
            (20.0 * rate).to_degrees()
        );
        let fluid = format!("viscosity = 0\nwall_friction = {friction}");
        let case = weightless([0.4, 0.4], l0, 5e-4, &fluid, &body);
        let mut sim = simulation(&case);
        (0..2).for_each(|_| drop(sim.step().expect("a step")));
        let exact = -2.0 * PI * 1000.0 * friction * rate.powi(2) * radius.powi(4) * l0;
        let ratio = sim.fluid_force[0].torque.y / exact;
        println!("{} spacings: torque over that of the surface's velocity {ratio:.3}", radius / l0);
        assert!((ratio - 1.0).abs() < bound, "{ratio}");
    }
}

#[test]
fn water_turns_with_its_drum_and_no_faster() {
    // Two halves of a ring that turns as the water within it does.
    let (radius, rate): (f64, f64) = (0.15, 6.0);
    let half = |from: f64| {
        let arc = (0..=48).map(|k| from + PI * f64::from(k) / 48.0);
        let at = |r: f64, a: f64| format!("[{:.9}, {:.9}]", r * a.cos(), r * a.sin());
        let outer = arc.clone().map(|a| at(radius + 0.05, a));
        let points: Vec<String> = outer.chain(arc.rev().map(|a| at(radius, a))).collect();
        format!(
            "[[moving_wall]]\nname = \"{from}\"\nshape = \"prism\"\nsection = [{}]\npivot = [0, 0, 0]\n\
             rotation = [[0, 0, 0, 0], [20, 0, {}, 0]]\n",
            points.join(", "),
            (20.0 * rate).to_degrees()
        )
    };
    let case = case(&format!(
        "[run]\nspacing = 0.01\ntime_step = 2e-3\nadaptive = true\nend = 1.0\ngravity = [0, 0, 0]\ndimensions = 2\n\
         domain = [[-0.25, -0.25, -0.25], [0.25, 0.25, 0.25]]\n\
         [fluid]\nviscosity = 0.01\n[[fluid.shape]]\nshape = \"cylinder\"\nradius = {radius}\naxis = [0, 1, 0]\n\
         center = [0, 0, 0]\nvelocity_gradient = [[0, 0, {rate}], [0, 0, 0], [{}, 0, 0]]\n{}{}",
        -rate,
        half(0.0),
        half(PI)
    ));
    let mut sim = simulation(&case);
    while sim.time < 0.3 {
        sim.step().expect("a step");
    }
    let fields = sim.backend.read().expect("the fields");
    let water = fields.position.iter().zip(&fields.velocity).take(sim.groups.fluid);
    let (mut momentum, mut inertia) = (0.0, 0.0);
    for (x, v) in water {
        (momentum, inertia) = (momentum + x.cross(*v).y, inertia + x.length_squared());
    }
    let turned = momentum / inertia / rate;
    println!("the water turns at {turned:.4} of its drum's rate");
    assert!((turned - 1.0).abs() < 0.006, "{turned}");
    // A shape of the very size of its vessel has all of the cells whose middles lie in it: the wall takes none.
    let place = |k: i32| 0.01 * (f64::from(k) + 0.5);
    let within = |i: i32| (-16..16).filter(|&k| place(i).hypot(place(k)) < radius).count();
    let cells: usize = (-16..16).map(within).sum();
    assert!(sim.groups.fluid.abs_diff(cells) <= 3, "{} of {cells}", sim.groups.fluid);
}

#[test]
fn a_body_that_is_set_off_in_weightless_water_takes_it_along() {
    // Momentum of body and dragged water is that of the body before: v = v0 / (1 + C), C some 1.25 for a square between walls so near.
    let body = "size = [0.2, 1, 0.2]\ncenter = [0.5, 0, 0.5]\nvelocity = [0.2, 0, 0]";
    for processor in [Some(Processor::Cpu), device()].into_iter().flatten() {
        let case = weightless([1.0, 1.0], 0.02, 1e-3, "viscosity = 0\nwall_friction = 0", body);
        let scene = Scene::build(&case).expect("it builds");
        let mut sim = Simulation::on(&case, scene, &processor).expect("it starts");
        let mut speeds = Vec::new();
        while sim.steps < 20 {
            sim.step().expect("a step");
            speeds.push(sim.solids.poses()[0].velocity.x);
        }
        println!("{processor:?}: {speeds:.4?}");
        assert!((speeds[4] - 0.089).abs() < 0.005 && (speeds[19] - 0.089).abs() < 0.005, "{speeds:?}");
        assert_eq!(sim.backend.counters().expect("counted").pressure_clamps, 0);
    }
}

/// A full closed cavity of 2 dimensions, 0.4 m wide and high, with a wall that moves in it.
fn cavity(wall: &str) -> Case {
    case(&format!(
        "[run]\nspacing = 0.01\ntime_step = 2e-3\nadaptive = true\nend = 1.0\ngravity = [0, 0, -9.81]\ndimensions = 2\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.4]\n[tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.1, 0.4]\nopen = []\n\
         [[moving_wall]]\nname = \"wall\"\n{wall}"
    ))
}

#[test]
fn a_cavity_in_which_a_paddle_turns_stays_full_and_one_that_a_piston_narrows_does_not() {
    let piston = "min = [0, 0, 0]\nmax = [0.05, 0.1, 0.4]\nmotion = [[0, 0, 0, 0], [1, 0.1, 0, 0]]";
    assert!(!Scene::build(&cavity(piston)).expect("it builds").filled);
    let paddle =
        cavity("min = [0.1, 0, 0.19]\nmax = [0.3, 0.1, 0.21]\nrotation = [[0, 0, 0, 0], [4, 0, 360, 0]]");
    let scene = Scene::build(&paddle).expect("it builds");
    assert!(scene.filled);
    let mut sim = simulation(&paddle);
    while sim.time < 1.0 {
        sim.step().expect("a step");
    }
    let monitor = sim.backend.monitor().expect("measured");
    println!(
        "density off by {:.4} on average, at most {:.3}",
        monitor.density_error_mean, monitor.density_error_max
    );
    assert!(monitor.density_error_mean.abs() < 0.02 && monitor.density_error_max < 0.15, "{monitor:?}");
    assert_eq!(sim.backend.counters().expect("counted").lost, 0);
}

#[test]
fn a_full_tank_stays_full_when_a_driven_disc_crosses_its_seam() {
    // What of it lay beyond the side was taken for room that the water had gained.
    let filled = |at: f64, way: f64| {
        let case = case(&format!(
            "[run]\nspacing = 0.01\ntime_step = 1e-3\nend = 1.0\ndimensions = 2\ngravity = [0, 0, 0]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.2]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.2]\nperiodic = [\"x\"]\n[contact]\nspring = 1e5\n\
             [[body]]\nname = \"disc\"\nshape = \"cylinder\"\nradius = 0.04\ndensity = 1000\ncenter = [{at}, 0, 0.1]\n\
             displaces_fluid = true\nmotion = [[0, 0, 0, 0], [1, {way}, 0, 0]]\n"
        ));
        Scene::build(&case).expect("it builds").filled
    };
    assert!(filled(0.1, 0.2));
    for (at, way) in [(0.35, 0.2), (0.05, -0.9), (0.35, 1.3)] {
        assert!(filled(at, way), "from {at} by {way}");
    }
}

#[test]
fn a_full_tank_that_is_shaken_pushes_back_with_the_mass_of_its_water() {
    // 49 kPa from end to end where g H is 1 kPa: the pressure was cut, and the water collapsed onto itself.
    let (length, l0, amplitude, period) = (1.0, 0.02, 0.05, 0.2);
    let wall = |name: &str, [x0, x1]: [f64; 2], [z0, z1]: [f64; 2]| {
        format!(
            "[[moving_wall]]\nname = \"{name}\"\nmin = [{x0}, 0, {z0}]\nmax = [{x1}, 0.1, {z1}]\n\
             sine = {{ axis = [1, 0, 0], amplitude = {amplitude}, period = {period}, ramp = 0.1 }}\n"
        )
    };
    let ends = [-0.06, length + 0.06];
    let text = format!(
        "[run]\nspacing = {l0}\ntime_step = 5e-4\nend = 0.3\ndimensions = 2\ngravity = [0, 0, -10]\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [{length}, 0.1, 0.1]\n"
    ) + &wall("floor", ends, [-0.06, 0.0])
        + &wall("left", [-0.06, 0.0], [0.0, 0.1])
        + &wall("right", [length, length + 0.06], [0.0, 0.1])
        + &wall("lid", ends, [0.1, 0.16])
        + "[[gauge.force]]\nname = \"push\"\non = \"left\"\n";
    let mut sim = simulation(&case(&text));
    assert!(sim.params.filled);
    let (mass, omega) = (1000.0 * length * 0.1 * l0, 2.0 * PI / period);
    let (mut with, mut own) = (0.0, 0.0);
    while sim.time < 0.3 - 1e-9 {
        let before = sim.time;
        sim.step().expect("a step");
        if before > 0.1 {
            let inertia = mass * amplitude * omega * omega * (omega * before).sin();
            let force: f64 = sim.fluid_force.iter().map(|f| f.force.x).sum();
            (with, own) = (with + force * inertia, own + inertia * inertia);
        }
    }
    println!("force over that of the mass {:.4}", with / own);
    assert!((with / own - 1.0).abs() < 0.03, "{}", with / own);
    assert_eq!(sim.backend.counters().expect("counted").pressure_clamps, 0);
}

#[test]
fn nothing_is_cut_of_the_noise_of_weightless_water_at_rest() {
    let mut all = vec![Processor::Cpu];
    all.extend(device());
    for processor in all {
        let mut case = full_tank("", "");
        case.run.gravity = [0.0; 3];
        case.fluid.as_mut().expect("water").sound_speed = None;
        let mut sim =
            Simulation::on(&case, Scene::build(&case).expect("it builds"), &processor).expect("it starts");
        for _ in 0..50 {
            sim.step().expect("a step");
        }
        let cut = sim.backend.counters().expect("counted").pressure_clamps;
        assert_eq!(cut, 0, "{}", sim.backend.description());
    }
}
