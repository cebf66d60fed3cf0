//! Periodic sides: that the seam is nowhere, against brute force over images, analytic flows and the device.

use crate::common;
use common::*;
use glam::DVec3;
use seixo::backend::cpu::Cpu;
use seixo::backend::{Backend, Processor, gpu};
use seixo::case::{Absorber, Case, Face};
use seixo::cells::Grid;
use seixo::fields::{Fields, State};
use seixo::gauges::Gauges;
use seixo::kernels::absorber;
use seixo::kernels::pressure_level::{subtract_mean, sum_source};
use seixo::kernels::pressure_source::laplacian_coefficient;
use seixo::output::particles::{Particles, Region};
use seixo::params::Params;
use seixo::plan::{ParticleStage, Plan};
use seixo::pressure::cg::{Jacobi, Precondition, System, Workspace, dot, solve};
use seixo::pressure::multigrid::Multigrid;
use seixo::pressure::{Outcome, Settings};
use seixo::scene::{Kind, Scene};
use seixo::simulation::Simulation;
use seixo::{Error, Options};
use seixo_study::device_compare as compare;
use std::f64::consts::PI;
use std::sync::Arc;

const TIGHT: Settings = Settings { tolerance: 1e-8, max_iterations: 2000, warm_start: false };

/// Water in a box of 0.7 x 0.8 x 0.9 m with no side that is not periodic.
fn box_of_water(fluid: &str) -> Case {
    case(&format!(
        "[run]\nspacing = 0.1\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, 0]\n\
         [fluid]\nsound_speed = 3\n{fluid}\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.7, 0.8, 0.9]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.7, 0.8, 0.9]\nperiodic = [\"x\", \"y\", \"z\"]\n"
    ))
}

/// A flume of 0.8 m with an edge on its floor, a piece of wall that hangs over the seam's middle and a plate that moves,
/// around periodic y.
fn flume(more: &str) -> Case {
    case(&format!(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0.5, -9.81]\n\
         [fluid]\nviscosity = 1e-3\nsound_speed = 5\njitter = 0.1\n{more}\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.3]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.8, 0.4, 0.5]\nopen = [\"z_max\"]\nperiodic = [\"y\"]\n\
         [[obstacle]]\nname = \"sill\"\nmin = [0.5, 0, 0]\nmax = [0.6, 0.4, 0.1]\n\
         [[obstacle]]\nname = \"pillar\"\nmin = [0.1, 0.3, 0]\nmax = [0.2, 0.4, 0.1]\n\
         [[moving_wall]]\nname = \"gate\"\nmin = [0.4, 0, 0.05]\nmax = [0.5, 0.4, 0.4]\n\
         motion = [[0, 0, 0, 0], [1, 0, 0, 0.5]]\n\
         [[obstacle]]\nname = \"ball\"\nshape = \"sphere\"\nradius = 0.1\ncenter = [0.25, 0.15, 0.1]\n"
    ))
}

/// A backend stopped after the right side of the PPE.
fn prepared(case: &Case) -> (Cpu, Params) {
    let scene = Scene::build(case).expect("it builds");
    let params = Params::new(case, &scene).expect("valid");
    let plan = Plan::new(case, &scene, &params);
    let mut cpu = Cpu::new(&scene, &params, &plan, TIGHT).expect("the CPU can");
    let step = params.step(0.0, case.run.time_step, 1.0);
    for stage in ParticleStage::TO_SOURCE {
        cpu.run(stage, &step).expect("the CPU runs");
    }
    (cpu, params)
}

#[test]
fn a_row_holds_what_brute_force_over_images_finds() {
    for (case, least) in [(box_of_water("jitter = 0.3"), 28.0), (flume(""), 20.0)] {
        let (cpu, params) = prepared(&case);
        let x = &cpu.fields().position;
        let (mut pairs, mut over) = (0, 0);
        for i in 0..cpu.groups().fluid {
            let mut found: Vec<u32> = cpu.neighbours().all(i).neighbour.to_vec();
            found.sort_unstable();
            let near = |&j: &usize| {
                let image = |image: DVec3| image.distance(x[i]) < params.effective_radius;
                j != i
                    && params.periodic.images(params.periodic.wrap(x[j]), params.effective_radius).any(image)
            };
            let expected: Vec<u32> = (0..x.len()).filter(near).map(|j| j as u32).collect();
            assert_eq!(found, expected, "particle {i}");
            pairs += found.len();
            over += found.iter().filter(|&&j| x[j as usize].distance(x[i]) > params.effective_radius).count();
        }
        println!("{pairs} pairs, {over} of them over a seam");
        assert!(pairs as f64 > least * cpu.groups().fluid as f64 && over > pairs / 12, "{pairs} {over}");
    }
}

#[test]
fn the_lattice_goes_on_over_the_seam() {
    let (cpu, params) = prepared(&box_of_water(""));
    for &n in &cpu.fields().number_density {
        assert!((n - params.number_density).abs() < 1e-9, "{n}");
    }
    assert_eq!(cpu.groups().total(), 7 * 8 * 9, "there are no walls");
}

fn system<'a>(cpu: &'a Cpu, params: &Params) -> System<'a> {
    let f = cpu.fields();
    let coefficient = laplacian_coefficient(params);
    System {
        neighbours: cpu.neighbours(),
        state: &f.state,
        diagonal: &f.diagonal,
        coefficient,
        bodies: &[],
        among: None,
    }
}

#[test]
fn multigrid_goes_round() {
    for size in [[0.7, 0.8, 0.9], [1.6, 1.5, 2.5], [3.2, 0.7, 0.7]] {
        let [x, y, z] = size;
        let case = case(&format!(
            "[run]\nspacing = 0.1\ntime_step = 1e-2\nend = 1.0\ngravity = [0, 0, 0]\n\
             [fluid]\nsound_speed = 3\njitter = 0.2\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [{x}, {y}, {z}]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [{x}, {y}, {z}]\nperiodic = [\"x\", \"y\", \"z\"]\n"
        ));
        let (cpu, params) = prepared(&case);
        let a = system(&cpu, &params);
        let mut multigrid = Multigrid::default();
        multigrid.build(&a, &Grid::new(&params).expect("small"), &cpu.fields().position);
        // A Galerkin operator keeps the sum of all entries, whatever goes over a seam: here what is left of the diagonal.
        let sums = multigrid.sums();
        let entries: Vec<f64> = sums.iter().map(|s| s.entries / sums[0].diagonal).collect();
        assert!(entries.iter().all(|e| (e - entries[0]).abs() < 1e-6), "{entries:?}");
        let (n, settings) = (a.state.len(), Settings { tolerance: 1e-6, ..TIGHT });
        let (mut p, mut q) = (vec![0.0; n], vec![0.0; n]);
        // The constant that a box without a surface does not know is no part of a solve.
        let mut b = cpu.fields().source.clone();
        let sums = sum_source(a.state, &b);
        subtract_mean(a.state, &mut b, sums);
        let b = &b;
        let jacobi = solve(&a, b, &mut p, &mut Jacobi, &settings, &mut Workspace::default());
        let bucket = solve(&a, b, &mut q, &mut multigrid, &settings, &mut Workspace::default());
        println!("{size:?}: Jacobi {} iterations, multigrid {}", jacobi.iterations, bucket.iterations);
        assert_eq!((jacobi.outcome, bucket.outcome), (Outcome::Converged, Outcome::Converged));
        // No particle of the surface is a fixed point here.
        assert!(
            bucket.iterations <= 15 && 2 * bucket.iterations < jacobi.iterations,
            "{bucket:?} {jacobi:?}"
        );
        let scale = p.iter().fold(0.0_f64, |s, p| s.max(p.abs()));
        let worst = p.iter().zip(&q).fold(0.0_f64, |s, (a, b)| s.max((a - b).abs()));
        assert!(worst < 1e-4 * scale, "{worst} of {scale}");
        let noise = |seed: usize| -> Vec<f64> {
            let of = |k: usize| if a.state[k] == State::Inner { ((k * k + seed) as f64).sin() } else { 0.0 };
            (0..n).map(of).collect()
        };
        let (r, s, mut sums) = (noise(1), noise(5), Vec::new());
        let (mut br, mut bs) = (vec![0.0; n], vec![0.0; n]);
        multigrid.apply(&a, &r, &mut br);
        multigrid.apply(&a, &s, &mut bs);
        let (rr, rs, sr) = (dot(&r, &br, &mut sums), dot(&r, &bs, &mut sums), dot(&s, &br, &mut sums));
        assert!(rr > 0.0 && (rs - sr).abs() < 1e-5 * rr, "{rr} {rs} {sr}");
    }
}

/// Kinetic energy [J] and momentum [kg m/s] after `steps` steps of a column that collapses around `at` along x.
fn collapse(at: f64, steps: usize, processor: &Processor, preconditioner: &str) -> (f64, [f64; 3]) {
    let (from, to) = (at - 0.2, at + 0.2);
    let mut blocks = vec![(from.max(0.0), to.min(1.0))];
    blocks.extend((from < 0.0).then_some((1.0 + from, 1.0)));
    let blocks = blocks.iter().map(|(a, b)| {
        format!("[[fluid.block]]\nmin = [{a}, 0, 0]\nmax = [{b}, 0, 0.4]\nvelocity = [0.3, 0, 0]\n")
    });
    let case = case(&format!(
        "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -9.81]\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1, 0, 0.6]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n\
         [fluid]\nviscosity = 1e-3\nsound_speed = 5\n\
         solver = {{ tolerance = 1e-5, preconditioner = \"{preconditioner}\" }}\n{}",
        blocks.collect::<String>()
    ));
    let scene = Scene::build(&case).expect("it builds");
    let mut sim = Simulation::on(&case, scene, processor).expect("it starts");
    for _ in 0..steps {
        sim.step().expect("a step");
    }
    let m = sim.backend.monitor().expect("measured");
    (m.kinetic, m.momentum)
}

#[test]
fn a_collapse_over_the_seam_is_the_one_in_the_middle() {
    for preconditioner in ["jacobi", "multigrid"] {
        // It began with 0.18 J.
        let (middle, p) = collapse(0.5, 70, &Processor::Cpu, preconditioner);
        let (seam, q) = collapse(0.0, 70, &Processor::Cpu, preconditioner);
        println!("{preconditioner}: {middle} J, over the seam {:+.1e}", seam / middle - 1.0);
        assert!(middle > 0.5 && (seam / middle - 1.0).abs() < 1e-4, "{middle} {seam}");
        assert!((p[0] - q[0]).abs() < 1e-4 * p[0].abs() && p[0].abs() > 0.1, "{p:?} {q:?}");
        if !gpu::adapters().is_empty() {
            let (device, _) = collapse(0.0, 70, &Processor::Gpu { adapter: None }, preconditioner);
            println!("on the device {:+.1e}", device / middle - 1.0);
            assert!((device / middle - 1.0).abs() < 1e-2, "{middle} {device}");
        }
    }
}

/// Mean pressure over rho g H of the floor under water 0.3 m deep, largest speed and mean velocity, over the second half
/// of `steps` steps.
fn floor(case: &Case, steps: usize) -> (f64, f64, DVec3) {
    let mut sim = simulation(case);
    let floor = |sim: &Simulation| -> Vec<usize> {
        let lowest = |&i: &usize| (sim.scene.position[i].z + 0.5 * sim.scene.spacing).abs() < 1e-9;
        let inner = |&i: &usize| (0.1..0.3).contains(&sim.scene.position[i].x);
        sim.groups.static_wall_range().filter(lowest).filter(inner).collect()
    };
    let slots = floor(&sim);
    let (mut mean, mut speed, mut count) = (0.0, 0.0_f64, 0.0);
    let mut v = DVec3::ZERO;
    for k in 0..steps {
        sim.step().expect("a step");
        if 2 * k >= steps {
            let p = sim.backend.wall_pressures(&slots).expect("read");
            mean += p.iter().map(|p| p.pressure).sum::<f64>() / slots.len() as f64;
            count += 1.0;
            let m = sim.backend.monitor().expect("measured");
            speed = speed.max(m.speed_max);
            v = DVec3::from(m.momentum) / (m.particles as f64 * sim.params.particle_mass());
        }
    }
    let depth = 0.3 + 0.5 * sim.params.spacing;
    (mean / count / (1000.0 * 9.81 * depth), speed, v)
}

#[test]
fn still_water_with_a_periodic_side_is_that_between_walls() {
    let of = |sides: &str| {
        case(&format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -9.81]\n\
             [fluid]\nsound_speed = 5\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.3]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.5]\nopen = [\"z_max\"]\n{sides}\n"
        ))
    };
    let (walls, speed, _) = floor(&of(""), 400);
    let (periodic, speed_periodic, v) = floor(&of("periodic = [\"y\"]"), 400);
    println!(
        "floor {walls:.4} between walls, {periodic:.4} periodic; speeds {speed:.1e} {speed_periodic:.1e} m/s"
    );
    assert!((walls - 1.0).abs() < 0.02 && (periodic - walls).abs() < 0.01, "{walls} {periodic}");
    assert!(speed_periodic < 2.0 * speed + 1e-3 && v.y.abs() < 1e-3, "{speed} {speed_periodic} {v}");
}

#[test]
fn water_that_flows_over_the_seam_presses_as_still_water_does() {
    let of = |u: f64| {
        case(&format!(
            "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -9.81]\ndimensions = 2\n\
             [fluid]\nsound_speed = 5\nviscosity = 0\nwall_friction = 0\n\
             [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.3]\nvelocity = [{u}, 0, 0]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.5]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n"
        ))
    };
    // Twice round.
    let (still, ..) = floor(&of(0.0), 800);
    let (flowing, _, v) = floor(&of(1.0), 800);
    println!("floor {still:.4} still, {flowing:.4} flowing; mean velocity {v}");
    assert!((still - 1.0).abs() < 0.02 && (flowing - still).abs() < 0.02, "{still} {flowing}");
    assert!((v.x - 1.0).abs() < 0.01 && v.z.abs() < 0.05, "{v}");
}

/// Root mean square of the error of the velocity along x over its largest value, against `exact(z)` [m/s].
fn profile_error(fields: &Fields, fluid: usize, exact: impl Fn(f64) -> f64) -> f64 {
    let (mut square, mut largest) = (0.0, 0.0_f64);
    for i in 0..fluid {
        let u = exact(fields.position[i].z);
        square += (fields.velocity[i].x - u).powi(2);
        largest = largest.max(u.abs());
    }
    (square / fluid as f64).sqrt() / largest
}

/// Flow along x that `gravity` drives through a channel of height 0.1 m for `time` viscous times.
fn channel(gravity: &str, tank: &str, time: f64, processor: &Processor) -> (Simulation, Gauges) {
    let nu = 0.01;
    let case = case(&format!(
        "[run]\nspacing = 0.00625\ntime_step = 4e-4\nend = 10.0\ngravity = [{gravity}]\ndimensions = 2\n\
         [fluid]\nviscosity = {nu}\nwall_friction = 0\nsound_speed = 5\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.05, 0, 0.1]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.05, 0, {tank}\nperiodic = [\"x\"]\n\
         [[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n"
    ));
    let scene = Arc::new(Scene::build(&case).expect("it builds"));
    let gauges = Gauges::new(&case, &scene).expect("it has a floor");
    let mut sim = Simulation::on(&case, scene, processor).expect("it starts");
    while sim.time < time * 0.01 / nu {
        sim.step().expect("a step");
    }
    (sim, gauges)
}

/// The viscous force along x on the floor [N].
fn drag(sim: &mut Simulation, gauges: &Gauges) -> f64 {
    let header = gauges.header();
    let at = header.iter().position(|h| h.starts_with("floor_force_x")).expect("there is such a column");
    let row = gauges.row(sim).expect("a row");
    format!("{}", row[at]).parse().expect("a number")
}

#[test]
fn plane_poiseuille_flow_is_a_parabola_and_the_walls_carry_what_drives_it() {
    let (g, h, nu) = (1.0, 0.1, 0.01);
    let (mut sim, gauges) = channel("1, 0, 0", "0.1]", 0.6, &Processor::Cpu);
    let fields = sim.backend.read().expect("the fields");
    let rms = profile_error(&fields, sim.groups.fluid, |z| g * z * (h - z) / (2.0 * nu));
    let force = drag(&mut sim, &gauges) / (0.5 * 1000.0 * g * h * 0.05 * sim.params.spacing);
    println!("rms {rms:.4} of the largest velocity; drag of a wall over half of what drives {force:.4}");
    assert!(rms < 0.02, "{rms}");
    assert!((force - 1.0).abs() < 0.02, "{force}");
}

#[test]
fn a_film_that_runs_down_a_slope_is_half_a_parabola_over_its_own_weight() {
    let (g, h, nu) = (1.0, 0.1, 0.01);
    let film = |time: f64, processor: &Processor| {
        channel("1, 0, -9.81", "0.2]\nopen = [\"z_max\"]", time, processor).0
    };
    let mut sim = film(2.0, &Processor::Cpu);
    let fields = sim.backend.read().expect("the fields");
    let rms = profile_error(&fields, sim.groups.fluid, |z| g / nu * (h * z - 0.5 * z * z));
    let l0 = sim.params.spacing;
    let deviation = |i: usize| fields.pressure[i] / (1000.0 * 9.81 * h) - (1.0 - fields.position[i].z / h);
    let inner: Vec<f64> =
        (0..sim.groups.fluid).filter(|&i| fields.position[i].z < h - 2.0 * l0).map(deviation).collect();
    let pressure = (inner.iter().map(|d| d * d).sum::<f64>() / inner.len() as f64).sqrt();
    println!("rms of u {rms:.4}, of P {pressure:.4}");
    assert!(rms < 0.03 && pressure < 0.01, "{rms} {pressure}");
    if !gpu::adapters().is_empty() {
        let kinetic = |processor| film(0.2, &processor).backend.monitor().expect("measured").kinetic;
        let (cpu, device) = (kinetic(Processor::Cpu), kinetic(Processor::Gpu { adapter: None }));
        println!("kinetic energy on its way, the device's over the CPU's {:.1e}", device / cpu - 1.0);
        assert!((device / cpu - 1.0).abs() < 1e-3, "{cpu} {device}");
    }
}

#[test]
fn couette_flow_without_ends_is_the_line_between_the_surfaces() {
    let (h, speed) = (0.1, 0.1);
    let case = case(&format!(
        "[run]\nspacing = 0.01\ntime_step = 2e-3\nend = 2.0\ngravity = [0, 0, 0]\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.1, 0, 0.2]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n\
         [[moving_wall]]\nname = \"plate\"\nmin = [0, 0, {h}]\nmax = [0.1, 0, 0.15]\n\
         motion = [[0, 0, 0, 0], [10, {}, 0, 0]]\n\
         [fluid]\nviscosity = 0.01\nwall_friction = 0\nsound_speed = 2\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.1, 0, {h}]\n",
        10.0 * speed
    ));
    let mut sim = simulation(&case);
    // The plate goes round twice.
    while sim.time < 2.0 {
        sim.step().expect("a step");
    }
    let fields = sim.backend.read().expect("the fields");
    let rms = profile_error(&fields, sim.groups.fluid, |z| speed * z / h);
    println!("rms {rms:.4} of the plate's speed");
    assert!(rms < 0.01, "{rms}");
}

/// A shear wave u = U sin(2 pi z / L) in a square of L = 1 m with `cells` spacings a side and no side that is not
/// periodic, Re = U L / nu = 100, to t = 0.5 s: kinematic viscosity by which its energy decays over nu, and the momentum
/// that it gained over m U.
fn shear_wave(cells: usize, processor: &Processor) -> (f64, f64) {
    let (nu, k) = (0.01, 2.0 * PI);
    let (mut sim, rate) = stirred_square(cells, processor, |x| DVec3::new((k * x.z).sin(), 0.0, 0.0));
    let last = sim.backend.monitor().expect("measured");
    let mass = last.particles as f64 * sim.params.particle_mass();
    assert_eq!(sim.backend.counters().expect("counted").lost, 0);
    (rate / (2.0 * nu * k * k), DVec3::from(last.momentum).length() / mass)
}

#[test]
fn a_shear_wave_decays_as_viscosity_says() {
    let (coarse, _) = shear_wave(20, &Processor::Cpu);
    let (fine, momentum) = shear_wave(40, &Processor::Cpu);
    println!(
        "viscosity over nu: {coarse:.4} with 20 spacings a side, {fine:.4} with 40; momentum {momentum:.1e} m U"
    );
    assert!((fine - 1.0).abs() < 0.1, "{fine}");
    assert!(momentum < 1e-2, "{momentum}");
    if !gpu::adapters().is_empty() {
        let (device, _) = shear_wave(20, &Processor::Gpu { adapter: None });
        println!("on the device {device:.4}");
        assert!((device - coarse).abs() < 0.02, "{device} {coarse}");
    }
}

#[test]
fn the_device_agrees_with_the_cpu_stage_by_stage() {
    if !there_is_a_device("periodic sides are not compared") {
        return;
    }
    for (what, case) in [
        ("flume", {
            let mut case = flume("solver = { tolerance = 1e-5 }");
            case.absorber = vec![Absorber {
                min: [0.0, 0.31, 0.0],
                max: [0.4, 0.52, 1.0],
                towards: Face::YMax,
                rate: Some(50.0),
            }];
            case
        }),
        ("multigrid", flume("solver = { tolerance = 1e-5, preconditioner = \"multigrid\" }")),
        ("paper", flume("preset = \"paper\"\nsolver = { tolerance = 1e-5 }")),
        ("box", box_of_water("jitter = 0.2\nsolver = { tolerance = 1e-5, preconditioner = \"multigrid\" }")),
    ] {
        let scene = Arc::new(Scene::build(&case).expect("it builds"));
        let errors = compare::compare_stages(&case, &scene, None, 5).expect("both run");
        assert!(errors.iter().any(|e| e.max_relative > 0.0), "f32 cannot agree with f64 to the last bit");
        for e in &errors {
            println!(
                "{what} {:20} {:16} max {:.1e}  l2 {:.1e}",
                e.stage, e.field, e.max_relative, e.l2_relative
            );
            let bound = match e.stage {
                "conjugate_gradient" | "pressure_gradient" | "correct" | "body_force" | "shift" => 5e-3,
                "pressure_source" => 3e-4,
                _ => 2e-5,
            };
            assert!(e.l2_relative < bound, "{what}: {e:?}");
        }
    }
}

#[test]
fn the_levels_of_the_device_go_round() {
    if !there_is_a_device("multigrid over seams is not compared") {
        return;
    }
    let fluid = "jitter = 0.2\nsolver = { preconditioner = \"multigrid\" }";
    let large = box_of_water(fluid);
    let text = toml::to_string(&large).expect("written").replace("0.7, 0.8, 0.9", "1.6, 1.5, 2.5");
    let larger: Case = toml::from_str(&text).expect("read");
    for case in [large, larger, flume("solver = { preconditioner = \"multigrid\" }")] {
        let scene = Scene::build(&case).expect("it builds");
        let params = Params::new(&case, &scene).expect("valid");
        let plan = Plan::new(&case, &scene, &params);
        let step = params.step(0.0, case.run.time_step, 1.0);
        let fields = prepared(&case).0.read().expect("readable");
        // One iteration from zero is the preconditioned right side times a number. Small enough for no bound; both signs, as
        // negative pressures are cut.
        let one = Settings { max_iterations: 1, ..TIGHT };
        let whole = Settings { tolerance: 1e-4, ..TIGHT };
        let made = |settings| {
            let device = gpu::Gpu::new(&scene, &params, &plan, settings, None).expect("the device can");
            (device, Cpu::new(&scene, &params, &plan, settings).expect("the CPU can"))
        };
        let [mut first, mut last] = [one, whole].map(made);
        for (sign, settings) in [(1.0, one), (-1.0, one), (1.0, whole)] {
            let mut fields = fields.clone();
            fields.source.iter_mut().for_each(|b| *b *= 1e-4 * sign);
            let (device, cpu) = if settings == one { &mut first } else { &mut last };
            let both: [&mut dyn Backend; 2] = [&mut *device, &mut *cpu];
            let mut iterations = Vec::new();
            for backend in both {
                backend.write(&fields).expect("writable");
                backend.run(ParticleStage::CellList, &step).expect("runs");
                backend.run(ParticleStage::NeighbourList, &step).expect("runs");
                // Makes the weights on the CPU.
                backend.run(ParticleStage::NumberDensity, &step).expect("runs");
                iterations.push(backend.solve_pressure(&step).expect("solves").iterations);
            }
            let (got, want) = (device.read().expect("readable").pressure, cpu.fields().pressure.clone());
            let scale = want.iter().fold(0.0_f64, |s, p| s.max(*p));
            if scale == 0.0 {
                // A box without a surface: the level of its pressure is most of it, and has one sign.
                assert!(sign < 0.0 && got.iter().all(|p| *p == 0.0), "{sign}");
                continue;
            }
            // The level of the pressure is a sum over all rows in f32, on both sides.
            let worst = got.iter().zip(&want).fold(0.0_f64, |s, (a, b)| s.max((a - b).abs()));
            println!("{} rows, iterations {iterations:?}, worst {:.1e}", want.len(), worst / scale);
            assert!(
                scale > 0.0 && worst < if settings == one { 5e-5 } else { 5e-3 } * scale,
                "{worst} {scale}"
            );
            assert!(iterations[0].abs_diff(iterations[1]) <= 1 && iterations[0] <= 12, "{iterations:?}");
            let (a, b) = (device.level_sums().expect("readable"), {
                let mut twin = Multigrid::default();
                twin.build(
                    &system(cpu, &params),
                    &Grid::new(&params).expect("valid"),
                    &cpu.fields().position,
                );
                twin.sums()
            });
            let c = laplacian_coefficient(&params);
            assert_eq!(a.len(), b.len());
            for (a, b) in a.iter().zip(&b) {
                assert_eq!(a.rows, b.rows);
                let near = |x: f64, y: f64, scale: f64| assert!((x - y).abs() < 1e-5 * scale, "{a:?} {b:?}");
                near(a.diagonal, b.diagonal / c, a.diagonal);
                near(a.squares, b.squares / c / c, a.squares);
                near(a.entries, b.entries / c, a.diagonal);
            }
        }
    }
}

#[test]
fn a_box_without_walls_keeps_its_momentum() {
    for (preset, bound) in [("accurate", 0.05), ("paper", 0.05)] {
        let case = box_of_water(&format!("preset = \"{preset}\"\njitter = 0.2\nviscosity = 1e-3"));
        let mut sim = simulation(&case);
        let mut fields = sim.backend.read().expect("the fields");
        let fluid = sim.groups.fluid;
        let random = |k: usize| (((k * k) as f64).sin() * 1e4).fract() - 0.5;
        for (k, v) in fields.velocity[..fluid].iter_mut().enumerate() {
            *v = DVec3::new(1.0, 0.0, 0.5) + DVec3::new(random(3 * k), random(3 * k + 1), random(3 * k + 2));
        }
        sim.backend.write(&fields).expect("written");
        let momentum = |sim: &mut Simulation| DVec3::from(sim.backend.monitor().expect("measured").momentum);
        let start = momentum(&mut sim);
        for _ in 0..200 {
            sim.step().expect("a step");
        }
        let drift = (momentum(&mut sim) - start).length() / start.length();
        println!("{preset}: momentum drifts by {drift:.1e} of itself in 200 steps");
        assert!(drift < bound, "{preset}: {drift}");
        assert_eq!(sim.backend.counters().expect("counted").lost, 0);
    }
}

#[test]
fn the_ledger_closes_round_the_seam_and_shows_what_drives() {
    let mut case = flume("");
    case.output.ledger = true;
    let device = (!gpu::adapters().is_empty()).then_some(Processor::Gpu { adapter: None });
    for (processor, bound) in [(Some(Processor::Cpu), 1e-10), (device, 2e-5)] {
        let Some(processor) = processor else { continue };
        let scene = Scene::build(&case).expect("it builds");
        let mut sim = Simulation::on(&case, scene, &processor).expect("it starts");
        // Along y it goes through the seam within the run.
        let mut fields = sim.backend.read().expect("the fields");
        fields.velocity[..sim.groups.fluid].fill(2.0 * DVec3::Y);
        sim.backend.write(&fields).expect("written");
        let energy = |sim: &mut Simulation| {
            let m = sim.backend.monitor().expect("measured");
            (m.kinetic + m.potential, m.particles)
        };
        let start = energy(&mut sim);
        let (mass, mut driven) = (start.1 as f64 * sim.params.particle_mass(), 0.0);
        for _ in 0..120 {
            sim.step().expect("a step");
            // 0.5 m/s2 over the way along y.
            driven += 0.5 * 1e-3 * sim.backend.monitor().expect("measured").momentum[1] / mass;
        }
        let (now, ledger) = (energy(&mut sim), sim.ledger().expect("kept").expect("asked for"));
        let open = (now.0 - start.0 - ledger.total()) / start.0;
        println!("{}: open {open:.1e} of the energy at the start", sim.backend.precision());
        assert!(open.abs() < bound, "{open} {ledger:?}");
        assert_eq!(start.1, now.1, "nothing is lost at the seam");
        let booked = ledger.get(seixo::ledger::Entry::Gravity) / mass;
        println!("driven {driven:.4} J/kg, booked {booked:.4}");
        assert!(driven > 0.05 && (booked - driven).abs() < 0.15 * driven, "{booked} {driven}");
    }
}

#[test]
fn a_line_on_the_seam_is_as_good_as_any() {
    let case = case(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.3]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.5]\nopen = [\"z_max\"]\nperiodic = [\"x\", \"y\"]\n\
         [[gauge.level]]\nname = \"middle\"\nat = [0.2, 0.2]\n[[gauge.level]]\nname = \"corner\"\nat = [0, 0.4]\n",
    );
    let scene = Arc::new(Scene::build(&case).expect("it builds"));
    let gauges = Gauges::new(&case, &scene).expect("they are in the water");
    let mut sim = Simulation::on(&case, scene, &Processor::Cpu).expect("it starts");
    let row = gauges.row(&mut sim).expect("a row");
    let level = |k: usize| format!("{}", row[k]).parse::<f64>().expect("a number");
    assert!((level(1) - level(2)).abs() < 1e-9 && (level(1) - 0.3).abs() < 5e-3, "{} {}", level(1), level(2));
}

/// Key and text of the only problem of a case.
fn refusal(text: &str) -> (String, String) {
    let case: Case = toml::from_str(text).expect("it can be read");
    match Simulation::open(&case, &Options::default()) {
        Err(Error::Case(why)) => {
            (why.problems[0].key.clone(), format!("{} {}", why.problems[0].message, why.problems[0].remedy))
        }
        Err(other) => panic!("another error: {other}"),
        Ok(_) => panic!("it is taken:\n{text}"),
    }
}

#[test]
fn what_cannot_go_round_is_refused_by_key_with_what_would_do() {
    let sound = "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\n\
                 [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.3]\n\
                 [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.5]\nopen = [\"z_max\"]\nperiodic = [\"y\"]\n";
    Simulation::open(&toml::from_str(sound).expect("valid"), &Options::default()).expect("it is sound");
    let (key, text) = refusal(&sound.replace("max = [0.4, 0.4, 0.5]", "max = [0.4, 0.43, 0.5]"));
    assert!(key == "tank.max.1" && text.contains("0.4 m or 0.45 m"), "{key}: {text}");
    let (key, text) = refusal(&sound.replace("0.4, 0.4", "0.4, 0.3"));
    assert!(key == "tank.max.1" && text.contains("0.35 m or more"), "{key}: {text}");
    let (key, _) = refusal(&sound.replace("[\"z_max\"]", "[\"z_max\", \"y_min\"]"));
    assert_eq!(key, "tank.open");
    let (key, _) = refusal(&sound.replace("[\"y\"]", "[\"y\", \"y\"]"));
    assert_eq!(key, "tank.periodic.1");
    let (key, _) = refusal(&sound.replace("[run]\n", "[run]\ndimensions = 2\n"));
    assert_eq!(key, "tank.periodic.0");
    let (key, _) = refusal(&sound.replace("max = [0.4, 0.4, 0.3]", "max = [0.4, 0.6, 0.3]"));
    assert_eq!(key, "fluid.block.0.max");
    let long = "[[absorber]]\nmin = [0, -0.1, 0]\nmax = [0.4, 0.4, 0.5]\ntowards = \"y_max\"\n";
    let (key, text) = refusal(&format!("{sound}{long}"));
    assert!(
        key == "absorber.0" && text.contains("0.5 m long in a tank that is periodic after 0.4 m"),
        "{key}: {text}"
    );
    let sill = "[[obstacle]]\nname = \"sill\"\nmin = [0.1, -0.1, 0]\nmax = [0.2, 0.2, 0.1]\n";
    let (key, _) = refusal(&format!("{sound}{sill}"));
    assert_eq!(key, "obstacle.0.min");
    let ball = "[[obstacle]]\nname = \"ball\"\nshape = \"sphere\"\nradius = 0.1\ncenter = [0.2, 0.35, 0.1]\n";
    let (key, text) = refusal(&format!("{sound}{ball}"));
    assert!(key == "obstacle.0" && text.contains("tank.periodic"), "{key}: {text}");
    let gauge = "[[gauge.force]]\nname = \"side\"\non = \"tank.y_min\"\n";
    assert_eq!(refusal(&format!("{sound}{gauge}")).0, "gauge.force.0.on");
    let (key, _) = refusal(&format!("{sound}{}", body("[0.2, 0.38, 0.45]")));
    assert_eq!(key, "body.0");
    let plane = |y: f64| {
        format!(
            "[[plane]]\nname = \"p\"\ncenter = [0.2, {y}, 0.1]\nnormal = [0, 0, 1]\nalong = [1, 0, 0]\nsize = [0.4, 0.2]\n"
        )
    };
    let (key, text) = refusal(&format!("{sound}{}", plane(0.35)));
    assert!(
        key == "plane.0" && text.contains("plane `p` reaches from y = 0.2500 to 0.4500 m"),
        "{key}: {text}"
    );
    let ends = format!("{sound}{}", plane(0.3));
    Scene::build(&ends.parse().expect("a case")).expect("it ends at the side");
    let hole = "[[outflow]]\nname = \"out\"\nface = \"x_max\"\nmin = [0.4, 0.3, 0]\nmax = [0.4, 0.5, 0.1]\n";
    let (key, text) = refusal(&format!("{sound}{hole}"));
    assert!(
        key == "outflow.0.min" && text.contains("outflow `out` reaches from y = 0.3000 to 0.5000 m"),
        "{key}: {text}"
    );
    // What reaches over both sides is all of the axis.
    let all = hole.replace("0.3, 0]", "-1, 0]").replace("0.5, 0.1]", "1, 0.1]");
    Scene::build(&format!("{sound}{all}").parse().expect("a case")).expect("it builds");
}

/// A small cube that drifts along y.
fn body(center: &str) -> String {
    format!(
        "[[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = {center}\ndensity = 500\nvelocity = [0, 2, 0]\n\
         [contact]\nlaw = \"smooth\"\nspring = 1e4\n"
    )
}

#[test]
fn walls_go_on_over_the_seam() {
    let scene = Scene::build(&flume("")).expect("it builds");
    let p = scene.periodic;
    let solid: Vec<DVec3> =
        (scene.groups.fluid..scene.groups.total()).map(|i| p.wrap(scene.position[i])).collect();
    // Nothing stands twice or too close, images included.
    for (i, a) in solid.iter().enumerate() {
        for b in &solid[..i] {
            assert!(p.nearest(*a - *b).length() > 0.49 * scene.spacing, "{a} {b}");
        }
    }
    // The sill spans the axis: it has no ends, so that below its surface there are dummies all along.
    let inside = |x: &DVec3| (0.5..0.6).contains(&x.x) && (0.0..0.05).contains(&x.z);
    let sides =
        (0..scene.groups.total()).filter(|&i| inside(&scene.position[i]) && scene.kind[i] == Kind::Wall);
    let faces: Vec<DVec3> = sides.map(|i| scene.position[i]).collect();
    let ends = faces.iter().filter(|x| x.y < 0.05).count();
    assert_eq!(faces.len(), 8 * ends, "every slice across y is like any other: {faces:?}");
}

#[test]
fn boxes_over_the_seam_hold_what_comes_in_at_the_other_side() {
    let case = case(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.3]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.5]\nopen = [\"z_max\"]\nperiodic = [\"x\", \"y\"]\n\
         [[absorber]]\nmin = [0.3, -1, 0]\nmax = [0.5, 1, 0.2]\ntowards = \"x_max\"\nrate = 8\n\
         [output]\nregion = { min = [0.7, 0, 0], max = [0.9, 0.4, 0.3] }\n",
    );
    let scene = Scene::build(&case).expect("it builds");
    let params = Params::new(&case, &scene).expect("valid");
    let rate = |x: f64| absorber::rate(DVec3::new(x, 0.3, 0.1), &params);
    for (x, s) in [(0.25, 0.0), (0.35, 0.25), (0.05, 0.75), (0.15, 0.0)] {
        assert!((rate(x) - 8.0 * s * s).abs() < 1e-9, "{x}: {}", rate(x));
    }
    let region = Region::new(&case.output.region.expect("a region"), &scene);
    let mut sim = simulation(&case);
    let fields = sim.backend.read().expect("the fields");
    let water = Particles::fluid(&scene, &fields);
    let over = water.position.iter().filter(|x| x[0] > 0.3 || x[0] < 0.1).count();
    assert_eq!((water.within(&region).len(), over), (over, 4 * 8 * 6));
}

#[test]
fn a_pressure_gauge_at_the_seam_looks_over_it() {
    let case = case(
        "[run]\nspacing = 0.02\ntime_step = 4e-3\nadaptive = true\nend = 1.0\ndimensions = 2\n[fluid]\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 0, 0.4]\n[[fluid.block]]\nmin = [0.2, 0, 0]\nmax = [0.8, 0, 0.2]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.8, 0, 0.6]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n[gauge]\nevery = 0.01\n\
         [[gauge.pressure]]\nname = \"low\"\npoint = [0, 0, 0]\n[[gauge.pressure]]\nname = \"high\"\npoint = [0.8, 0, 0]\n",
    );
    // One place, between the water that stands higher and the other.
    let mut simulation = simulation(&case);
    for _ in 0..20 {
        simulation.step().expect("a step");
        let read = simulation.gauges().expect("both");
        let [low, high] = [read[0].1, read[1].1];
        assert!(low > 500.0 && (low - high).abs() < 1e-9 * low, "{low} and {high} Pa");
    }
}

#[test]
fn an_obstacle_that_ends_at_the_seam_has_its_end() {
    let force = |shape: &str, y: f64| {
        let case = case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\n[fluid]\n\
             [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 0.2, 0.16]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.2, 0.2, 0.2]\nopen = [\"z_max\"]\nperiodic = [\"y\"]\n\
             [[obstacle]]\nname = \"o\"\ncenter = [0.1, {y}, 0.08]\n{shape}\n\
             [[gauge.force]]\nname = \"f\"\non = \"o\"\n"
        ));
        let mut simulation = simulation(&case);
        for _ in 0..3 {
            simulation.step().expect("a step");
        }
        DVec3::from_slice(&simulation.gauges().expect("a force").iter().map(|g| g.1).collect::<Vec<_>>())
    };
    let round = "radius = 0.04\nheight = 0.08\naxis = [0, 1, 0]";
    let shapes = [
        "size = [0.08, 0.08, 0.08]",
        "shape = \"sphere\"\nradius = 0.04",
        &format!("shape = \"cylinder\"\n{round}"),
    ];
    for shape in shapes {
        let middle = force(shape, 0.1);
        for y in [0.04, 0.16] {
            let end = force(shape, y);
            println!("{shape}: {middle} N in the middle, {end} N at {y} m");
            assert!(middle.z > 2.0 && (end - middle).length() < 2e-3 * middle.z, "{shape}: {middle} {end}");
        }
    }
    // One that spans the tank has no ends.
    let spans = force("size = [0.08, 0.2, 0.08]", 0.1);
    assert!(
        spans.y.abs() < 1e-9 && (spans.z / (1000.0 * 9.81 * 0.08 * 0.08 * 0.2) - 1.0).abs() < 0.02,
        "{spans}"
    );
}

/// One of an odd number of rows had one more between the sides than there is room for, in the place of its image: 1.06 to 1.11 of its load.
#[test]
fn a_plane_that_spans_a_periodic_axis_is_the_same_however_wide() {
    let rows = |width: f64, at: f64| {
        let case: Case = toml::from_str(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.12\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.24, 0.2, 0.32]\nopen = [\"z_max\"]\nperiodic = [\"y\"]\n\
             [fluid]\n[[fluid.fill]]\nseed = [0.12, 0.1, 0.186]\nlevel = 0.2\n\
             [[plane]]\nname = \"slope\"\ncenter = [0.12, {at}, 0.07]\nnormal = [-0.4, 0, 1]\nalong = [1, 0, 0.4]\nsize = [0.288, {width}]\n"
        ))
        .unwrap();
        let scene = Scene::build(&case).unwrap();
        let slope = scene.walls.iter().position(|wall| wall.name == "slope").unwrap() as u32;
        let slots = scene.groups.static_wall_range().zip(&scene.static_wall_shape);
        let own: Vec<DVec3> =
            slots.filter(|(_, of)| **of == slope).map(|(slot, _)| scene.position[slot]).collect();
        (own, scene.water())
    };
    let even = rows(0.2, 0.1);
    assert!(even.0.len() >= 100 && even.0.len() % 10 == 0, "{} particles", even.0.len());
    for (width, at) in [(0.22, 0.1), (0.24, 0.1), (0.26, 0.1), (0.23, 0.095), (0.21, 0.1)] {
        let found = rows(width, at);
        assert_eq!((found.0.len(), found.1), (even.0.len(), even.1), "{width} m about {at} m");
        assert!(found.0.iter().zip(&even.0).all(|(a, b)| a.distance(*b) < 1e-9), "{width} m about {at} m");
    }
}
