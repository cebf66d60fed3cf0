//! The CPU's fast stages against the plain kernels that say what they must do, row by row, in a state that uses
//! everything: water off its lattice that collides, an obstacle, a gate that moves, a body that moves and turns.

use crate::common::moving as common;

use glam::{DMat3, DVec3};
use seixo::backend::Backend;
use seixo::backend::cpu::Cpu;
use seixo::body::Pose;
use seixo::cells::Grid;
use seixo::fields::State;
use seixo::kernels::cell_list::{CellList, Scratch};
use seixo::kernels::neighbour_list::{Candidates, Outward, neighbour_list};
use seixo::kernels::{
    Particles, correct, move_solids, number_density, predict, pressure_gradient, pressure_source, shift,
    viscosity, wall_friction,
};
use seixo::params::{Params, Step};
use seixo::plan::{Arrays, ParticleStage, Plan};
use seixo::pressure::Settings;
use seixo::scene::{Groups, Scene};
use seixo::scheme::{Gradient, Source};

/// Sums in another order.
const ROUND_OFF: f64 = 1e-11;

struct Water {
    cpu: Cpu,
    params: Params,
    scene: Scene,
    step: Step,
    /// Velocities, of the walls that turn those of their surface where the plan has viscosity act on it.
    on_surface: Vec<DVec3>,
}

impl Water {
    fn new(dimensions: u32, fluid: &str, poses: impl Fn(&Scene, &mut [DVec3]) -> Vec<Pose>) -> Self {
        let case = common::case(dimensions, fluid);
        let mut scene = common::scene(dimensions, if dimensions == 2 { 3 } else { 1 });
        for i in 0..scene.groups.fluid {
            scene.position[i] += 0.2 * scene.spacing * common::noise_vector(i, dimensions);
            scene.velocity[i] = 0.4 * common::noise_vector(i + 100_000, dimensions);
        }
        let mut position = std::mem::take(&mut scene.position);
        let poses = poses(&scene, &mut position);
        scene.position = position;
        let params = Params::new(&case, &scene).expect("valid");
        let plan = Plan::new(&case, &scene, &params);
        let settings = Settings { tolerance: 1e-4, max_iterations: 1000, warm_start: true };
        let mut cpu = Cpu::new(&scene, &params, &plan, settings).expect("the CPU can");
        cpu.move_solids(&poses).expect("moves");
        let step = params.step(0.0, 1e-3, 2.0);
        cpu.run(ParticleStage::CellList, &step).expect("runs");
        cpu.run(ParticleStage::NeighbourList, &step).expect("runs");
        let mut on_surface = cpu.fields().velocity.clone();
        for (solid, pose) in scene.solids.iter().zip(&poses).filter(|_| plan.needs(Arrays::Turning)) {
            let rows = solid.wall_offset.iter().zip(&solid.wall_to_surface);
            for (i, (&offset, &way)) in solid.wall_slots.clone().zip(rows) {
                on_surface[i] = move_solids::on_surface(pose, offset, way);
            }
        }
        Self { cpu, params, scene, step, on_surface }
    }

    fn run(&mut self, stage: ParticleStage) {
        self.cpu.run(stage, &self.step).expect("the CPU runs");
    }

    fn particles(&self) -> Particles<'_> {
        let f = self.cpu.fields();
        let (position, velocity) = (&f.position, &f.velocity);
        Particles { params: &self.params, position, velocity, fluid: self.groups().fluid }
    }

    fn groups(&self) -> Groups {
        self.scene.groups
    }
}

fn each(test: impl Fn(&mut Water)) {
    each_at(|scene, _| common::poses(scene, 0.01), test);
}

/// With the solids at `poses`, which may move the water.
fn each_at(poses: impl Fn(&Scene, &mut [DVec3]) -> Vec<Pose>, test: impl Fn(&mut Water)) {
    for (dimensions, fluid) in
        [(3, "preset = \"accurate\""), (3, "preset = \"paper\""), (2, "preset = \"accurate\"")]
    {
        println!("{dimensions}D, {fluid}");
        test(&mut Water::new(dimensions, fluid, &poses));
    }
}

/// Both within round-off of the largest plain value; returns that.
fn close(fast: &[DVec3], plain: &[DVec3]) -> f64 {
    let scale = plain.iter().fold(0.0_f64, |s, v| s.max(v.length()));
    for (k, (f, p)) in fast.iter().zip(plain).enumerate() {
        assert!((*f - *p).length() <= ROUND_OFF * scale, "{k}: {f} for {p}");
    }
    scale
}

/// A particle that a spring holds, twenty periods in so many steps each: what is left of its swing, and how far from where it should be
/// it is then, over its swing at the start.
fn swung(fluid: &str, steps: u32) -> (f64, f64) {
    let case = common::case(2, fluid);
    let scene = common::scene(2, 1);
    let params = Params::new(&case, &scene).expect("valid");
    let (l0, period, omega) = (1.0, 1.0, 2.0 * std::f64::consts::PI);
    let step = params.step(0.0, period / f64::from(steps), 1.0);
    let start = 1e-3;
    let (mut x, mut v) = (DVec3::new(start, 0.0, 0.0), DVec3::ZERO);
    for _ in 0..20 * steps {
        (x, v, _) = predict::predict(x, v, DVec3::ZERO, &step, l0);
        (x, v, _) = correct::correct(x, v, -omega * omega * x, &step, l0);
    }
    (x.x.hypot(v.x / omega) / start, (x.x / start - 1.0).abs())
}

#[test]
fn a_step_is_of_second_order_and_damps_no_swing_but_the_paper_s() {
    let (coarse, fine) = (swung("", 50), swung("", 100));
    println!("left of a swing, error of its place: {coarse:.5?}, {fine:.5?}");
    assert!((coarse.0 - 1.0).abs() < 1e-4 && (fine.0 - 1.0).abs() < 1e-5, "{coarse:?}, {fine:?}");
    assert!(fine.1 < 0.005 && fine.1 < 0.1 * coarse.1, "{coarse:?}, {fine:?}");
    // exp(-omega^2 dt t / 2)
    let (left, _) = swung("preset = \"paper\"", 100);
    let omega = 2.0 * std::f64::consts::PI;
    assert!((left / (-0.5 * omega * omega * 0.01 * 20.0).exp() - 1.0).abs() < 0.05, "{left}");
}

#[test]
fn the_fast_search_finds_the_plain_rows() {
    each(|s| {
        let (grid, g) = (Grid::new(&s.params).expect("a grid"), s.groups());
        let x = &s.cpu.fields().position;
        let mut scratch = Scratch::default();
        let mut index = |slots: &mut dyn Iterator<Item = usize>| {
            let mut list = CellList::default();
            list.index(&grid, slots, x, &mut scratch);
            list
        };
        let fluid = index(&mut (0..g.fluid));
        assert!(fluid.slot.is_sorted(), "the fluid is in cell order");
        let moving = index(&mut g.moving_wall_range().chain(g.moving_dummy_range()));
        let fixed = index(&mut g.static_range());
        let turned = s.scene.solids.iter().zip(common::poses(&s.scene, 0.01));
        let turned = turned.flat_map(|(solid, pose)| solid.wall_slots.clone().map(move |_| pose.orientation));
        let outward: Vec<DVec3> = match s.params.source {
            Source::Mixed => s.scene.facing().into_iter().zip(turned).map(|(n, turn)| turn * n).collect(),
            Source::NumberDensity => vec![],
        };
        let from = Candidates {
            grid: &grid,
            fluid_start: &fluid.start,
            moving: Some(&moving),
            fixed: Some(&fixed),
            pressure_slots: g.pressure() as u32,
            wall_carriers: s.params.wall_carriers(g.fluid, g.pressure()) as u32,
            outward: Outward { first: g.fluid, of: &outward },
        };
        let mut pairs = 0;
        for i in 0..g.pressure() {
            let fast = s.cpu.neighbours().all(i).neighbour;
            let (plain, carry) = neighbour_list(i as u32, s.params.effective_radius, &from, x);
            // Dry walls have no row.
            if i < g.fluid || !fast.is_empty() {
                assert_eq!((fast, s.cpu.neighbours().pressure(i).neighbour.len()), (&plain[..], carry));
            } else {
                assert!(plain.iter().all(|&j| j as usize >= g.fluid), "slot {i} is wet");
            }
            pairs += fast.len();
        }
        assert!(pairs > 4000, "{pairs}");
    });
}

#[test]
fn the_fast_viscosity_is_the_plain_one() {
    each(|s| {
        // The search has sorted the water, not the walls.
        s.on_surface[..s.scene.groups.fluid]
            .copy_from_slice(&s.cpu.fields().velocity[..s.scene.groups.fluid]);
        s.run(ParticleStage::Viscosity);
        let on = Particles { velocity: &s.on_surface, ..s.particles() };
        let row = |i: usize| s.cpu.neighbours().pressure(i).neighbour;
        let g = s.groups();
        let stress = s.params.surface_stress();
        assert_eq!(stress, s.params.source == Source::Mixed);
        let of = |i: usize| {
            let laplacian = viscosity::viscosity(i, row(i), on);
            if stress {
                laplacian + viscosity::surface_stress(i, s.cpu.neighbours().all(i), on)
            } else {
                laplacian
            }
        };
        let plain: Vec<DVec3> = (0..g.fluid).map(of).collect();
        assert!(close(&s.cpu.fields().acceleration, &plain) > 1e-2);
        let walls = g.moving_wall_range();
        let plain: Vec<DVec3> = walls.map(|i| viscosity::reaction(i, row(i), on)).collect();
        assert!(close(&s.cpu.fields().reaction, &plain) > 1e-6);
    });
}

/// Places and viscous accelerations of a block of water, `across` spacings a side and its places shaken by `jitter` of one, with the
/// velocity gradient `gradient` and nothing around it.
fn viscous(dimensions: u32, across: i32, jitter: f64, gradient: DMat3) -> (Params, Vec<(DVec3, DVec3)>) {
    let side = 0.02 * f64::from(across);
    let case: seixo::case::Case = toml::from_str(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ndimensions = {dimensions}\ngravity = [0, 0, 0]\n\
         domain = [[-0.2, -0.2, -0.2], [0.6, 0.6, 0.6]]\n\
         [fluid]\nviscosity = 0.05\njitter = {jitter}\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [{side}, {side}, {side}]\n"
    ))
    .expect("a case");
    let mut scene = Scene::build(&case).expect("a scene");
    for i in 0..scene.groups.fluid {
        scene.velocity[i] = gradient * scene.position[i];
    }
    let params = Params::new(&case, &scene).expect("valid");
    let plan = Plan::new(&case, &scene, &params);
    let settings = Settings { tolerance: 1e-4, max_iterations: 1000, warm_start: true };
    let mut cpu = Cpu::new(&scene, &params, &plan, settings).expect("the CPU can");
    let step = params.step(0.0, 1e-3, 2.0);
    for stage in [ParticleStage::CellList, ParticleStage::NeighbourList, ParticleStage::Viscosity] {
        cpu.run(stage, &step).expect("runs");
    }
    let f = cpu.fields();
    (params.clone(), f.position.iter().copied().zip(f.acceleration.iter().copied()).collect())
}

/// The sum over neighbours alone holds back what turns beside a free surface, at 0.98 nu omega / l0.
#[test]
fn viscosity_does_nothing_to_water_that_turns_as_a_whole() {
    let turn = DMat3::from_cols(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::new(3.0, 0.0, 0.0));
    // In a corner there may be too few to tell how the water moves.
    for (dimensions, across, jitter, corners) in [(2, 12, 0.0, 0), (2, 12, 0.1, 4), (3, 7, 0.0, 8)] {
        let (params, water) = viscous(dimensions, across, jitter, turn);
        let scale = params.viscosity * 3.0 / params.spacing;
        let held = water.iter().filter(|(_, a)| a.length() > 1e-9 * scale).count();
        assert!(held <= corners, "{dimensions}D: {held} of {} are held back", water.len());
    }
}

/// On a face of normal n that nothing presses on the viscous stress 2 nu E n is missing: what holds there is its opposite.
#[test]
fn water_that_is_strained_feels_the_whole_stress_on_its_surface() {
    let strain = DMat3::from_diagonal(DVec3::new(2.0, 0.0, -2.0));
    for (dimensions, across) in [(2, 12), (3, 9)] {
        let (params, water) = viscous(dimensions, across, 0.0, strain);
        let l0 = params.spacing;
        let middle = l0 * (0.5 + f64::from(across / 2));
        let in_column = |x: &DVec3| {
            (x.x - middle).abs() < 0.1 * l0
                && (dimensions == 2 || (x.y - middle).abs() < 0.1 * l0)
                && x.z > middle
        };
        let sum: DVec3 = water.iter().filter(|(x, _)| in_column(x)).map(|(_, a)| l0 * *a).sum();
        let whole = DVec3::new(0.0, 0.0, 2.0 * params.viscosity * 2.0);
        assert!((sum - whole).length() < 1e-9 * whole.z, "{dimensions}D: {sum} for {whole}");
    }
}

/// Sum of the friction of water on its lattice that slides at `speed` over a floor, over rho C_f A speed^2, and the same with
/// the lattice moved by part of a spacing along the floor.
fn drag_of_a_floor(dimensions: u32, speed: f64) -> [f64; 2] {
    let case: seixo::case::Case = toml::from_str(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ndimensions = {dimensions}\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0.6, 0.3]\nopen = [\"z_max\"]\n\
         [fluid]\nwall_friction = 0.004\n[[fluid.block]]\nmin = [0.2, 0.2, 0]\nmax = [0.4, 0.4, 0.1]\n"
    ))
    .expect("a case");
    [0.0, 0.3].map(|moved| {
        let mut scene = Scene::build(&case).expect("a scene");
        for i in 0..scene.groups.fluid {
            scene.position[i].x += moved * scene.spacing;
            scene.velocity[i] = DVec3::new(speed, 0.0, 0.0);
        }
        let params = Params::new(&case, &scene).expect("valid");
        let plan = Plan::new(&case, &scene, &params);
        let settings = Settings { tolerance: 1e-4, max_iterations: 1000, warm_start: true };
        let mut cpu = Cpu::new(&scene, &params, &plan, settings).expect("the CPU can");
        let step = params.step(0.0, 1e-3, 2.0);
        for stage in [ParticleStage::CellList, ParticleStage::NeighbourList] {
            cpu.run(stage, &step).expect("runs");
        }
        let (f, fluid) = (cpu.fields(), scene.groups.fluid);
        let on = Particles { params: &params, position: &f.position, velocity: &f.velocity, fluid };
        let row = |i: usize| cpu.neighbours().pressure(i).neighbour;
        // In no time the implicit rate is the explicit one.
        let sum: f64 = (0..fluid).map(|i| wall_friction::wall_friction(i, row(i), on, 0.0).0.x).sum();
        let area = 0.2 * if dimensions == 3 { 0.2 } else { 0.02 };
        -sum * params.particle_mass() / (1000.0 * 0.004 * area * speed * speed)
    })
}

#[test]
fn friction_of_a_floor_is_its_stress_times_its_area() {
    for dimensions in [2, 3] {
        for speed in [0.01, 3.0] {
            let [on_lattice, between] = drag_of_a_floor(dimensions, speed);
            println!("{dimensions}D, {speed} m/s: {on_lattice:.4}, {between:.4}");
            assert!((on_lattice - 1.0).abs() < 1e-6, "{on_lattice}");
            assert!((between - 1.0).abs() < 0.05, "{between}");
        }
    }
}

#[test]
fn water_gives_solids_what_friction_takes_and_never_turns_round() {
    each(|s| {
        for dt in [1e-6, 1e3] {
            s.step.dt = dt;
            let (on, g) = (s.particles(), s.groups());
            let friction = 1e3 * s.params.spacing.recip();
            let params = Params { wall_friction: friction, ..s.params.clone() };
            let on = Particles { params: &params, ..on };
            let row = |i: usize| s.cpu.neighbours().pressure(i).neighbour;
            let walls = g.moving_wall_range();
            let mut seen = 0;
            let mut lost = DVec3::ZERO;
            for i in 0..g.fluid {
                let (a, sum) = wall_friction::wall_friction(i, row(i), on, dt);
                let others = row(i).iter().any(|&j| j as usize >= walls.end);
                let near = row(i).iter().any(|&j| walls.contains(&(j as usize)));
                assert_eq!(sum > 0.0, row(i).iter().any(|&j| j as usize >= g.fluid));
                if others && !near {
                    // Against walls at rest.
                    let (v, after) = (on.velocity[i], on.velocity[i] + dt * a);
                    assert!(after.dot(v) >= -1e-12 && after.length() <= v.length() + 1e-12, "{v} to {after}");
                }
                // Those that see solids that move alone: the solids get all of it.
                if near && !others {
                    lost -= params.particle_mass() * a;
                    seen += 1;
                }
            }
            let mut gained = DVec3::ZERO;
            for j in walls.clone() {
                let alone = |&&i: &&u32| {
                    (i as usize) < g.fluid && !row(i as usize).iter().any(|&k| k as usize >= walls.end)
                };
                let carriers: Vec<u32> = row(j).iter().filter(|i| alone(i)).copied().collect();
                let friction = |i| wall_friction::wall_friction(i, row(i), on, dt);
                gained += wall_friction::reaction(j, &carriers, friction, on);
            }
            println!("{seen} particles, {lost} N lost, {gained} N gained");
            assert!(seen > 10 && lost.length() > 0.0);
            assert!((lost - gained).length() < 1e-10 * lost.length(), "{lost} for {gained}");
        }
    });
}

#[test]
fn the_fast_number_density_is_the_plain_one() {
    each(|s| {
        s.run(ParticleStage::NumberDensity);
        let f = s.cpu.fields();
        for i in 0..s.groups().pressure() {
            let row = s.cpu.neighbours().all(i);
            let carry = s.cpu.neighbours().pressure(i).neighbour.len();
            let (n, state) = number_density::number_density(i, row.neighbour, carry, s.particles());
            assert!((f.number_density[i] - n).abs() < ROUND_OFF * s.params.number_density);
            assert_eq!(f.state[i], state, "slot {i}");
            for (j, w) in row.iter() {
                let plain =
                    number_density::pair_weight(f.position[i].distance_squared(f.position[j]), &s.params);
                assert!((w - plain).abs() < ROUND_OFF);
            }
        }
        for state in [State::Inactive, State::Surface, State::Inner] {
            assert!(f.state.iter().filter(|&&s| s == state).count() > 20, "{state:?}");
        }
    });
}

#[test]
fn the_fast_pressure_source_is_the_plain_one() {
    each(|s| _ = caught_in_source(s));
    each_at(common::on_the_floor, |s| {
        let caught = caught_in_source(s);
        assert!(s.params.source != Source::Mixed || caught > 1, "{caught} caught");
    });
}

/// Compares the sources; how many particles are caught between solids.
fn caught_in_source(s: &mut Water) -> usize {
    s.run(ParticleStage::NumberDensity);
    let known: &[ParticleStage] = match s.params.gradient {
        Gradient::Consistent => &[ParticleStage::SurfacePressure],
        Gradient::Minimum => &[],
    };
    for (i, p) in s.cpu.fields_mut().pressure.iter_mut().enumerate() {
        *p = 1000.0 * (1.0 + common::noise(i));
    }
    known.iter().for_each(|&stage| s.run(stage));
    s.run(ParticleStage::PressureSource);
    let f = s.cpu.fields();
    let scale = f.source.iter().fold(0.0_f64, |s, b| s.max(b.abs()));
    let (mut rows, mut walls, mut caught) = (0, 0, 0);
    for i in (0..s.groups().pressure()).filter(|&i| f.state[i] == State::Inner) {
        let row = s.cpu.neighbours().parts(i);
        let (b, d) = pressure_source::pressure_source(
            i,
            f.number_density[i],
            row,
            s.particles(),
            &f.surface_pressure,
            &s.step,
        );
        assert!((f.source[i] - b).abs() < ROUND_OFF * scale, "{i}: {} for {b}", f.source[i]);
        assert!((f.diagonal[i] - d).abs() < ROUND_OFF * d);
        rows += 1;
        walls += usize::from(i >= s.groups().fluid);
        let links: f64 = s.cpu.neighbours().pressure(i).weight.iter().sum();
        caught += usize::from(d > 1.01 * pressure_source::laplacian_coefficient(&s.params) * links);
    }
    assert!(rows > 300 && walls > 40 && scale > 1e4, "{rows} rows, {walls} walls, {scale}");
    caught
}

#[test]
fn the_fast_pressure_gradient_is_the_plain_one() {
    each(|s| {
        s.run(ParticleStage::NumberDensity);
        for (i, p) in s.cpu.fields_mut().pressure.iter_mut().enumerate() {
            *p = 1000.0 * (1.0 + common::noise(i));
        }
        s.run(ParticleStage::PressureGradient);
        let f = s.cpu.fields();
        let plain = |i: usize| {
            let row = s.cpu.neighbours().parts(i);
            pressure_gradient::pressure_gradient(i, row, f.state[i], s.particles(), &f.pressure, s.step.dt)
        };
        let plain: Vec<DVec3> = (0..s.groups().fluid).map(plain).collect();
        assert!(close(&f.acceleration, &plain) > 10.0);
        if s.params.gradient == Gradient::Minimum {
            return;
        }
        // Its sum of pair vectors, as the shift takes it.
        let before = f.position.clone();
        let plain = |i: usize| {
            let inner = f.state[i] == State::Inner;
            let one_side = shift::imbalance(i, s.cpu.neighbours().all(i), s.particles());
            if inner {
                shift::shift(one_side, f.velocity[i], &s.step, s.particles().params)
            } else {
                DVec3::ZERO
            }
        };
        let plain: Vec<DVec3> = (0..s.groups().fluid).map(plain).collect();
        s.run(ParticleStage::Shift);
        let way: Vec<DVec3> =
            s.cpu.fields().position.iter().zip(&before).take(plain.len()).map(|(a, b)| *a - *b).collect();
        // Differences of positions have the positions' round-off.
        for (k, (f, p)) in way.iter().zip(&plain).enumerate() {
            assert!((*f - *p).length() < 1e-14, "{k}: {f} for {p}");
        }
        assert!(plain.iter().any(|w| w.length() > 1e-5));
    });
}

/// Energy of the water before and after collisions of a heap in which nearly every particle has several, and how many
/// pairs collide.
fn collide(fluid: &str) -> (f64, f64, usize) {
    let case = common::case(3, fluid);
    let mut scene = common::scene(3, 1);
    let middle = scene.position[scene.groups.fluid / 2];
    for i in 0..scene.groups.fluid {
        // Into half of each way: no wall is near.
        scene.position[i] = middle + 0.45 * (scene.position[i] - middle);
        scene.velocity[i] = common::noise_vector(i, 3) - 3.0 * (scene.position[i] - middle);
    }
    let params = Params::new(&case, &scene).expect("valid");
    let plan = Plan::new(&case, &scene, &params);
    let settings = Settings { tolerance: 1e-4, max_iterations: 1000, warm_start: true };
    let mut cpu = Cpu::new(&scene, &params, &plan, settings).expect("the CPU can");
    let step = params.step(0.0, 1e-4, 2.0);
    cpu.run(ParticleStage::CellList, &step).expect("runs");
    cpu.run(ParticleStage::NeighbourList, &step).expect("runs");
    let sums = |cpu: &Cpu| {
        let v = &cpu.fields().velocity[..scene.groups.fluid];
        0.5 * v.iter().map(|v| v.length_squared()).sum::<f64>()
    };
    let before = sums(&cpu);
    let collides = |chunk: &seixo::neighbours::Chunk| chunk.close.iter().filter(|&&c| c).count();
    let colliding = cpu.neighbours().chunks.iter().map(collides).sum();
    cpu.run(ParticleStage::Collision, &step).expect("runs");
    let after = sums(&cpu);
    (before, after, colliding)
}

#[test]
fn collisions_that_share_impulses_add_no_energy_where_single_ones_do() {
    let (before, after, colliding) = collide("preset = \"accurate\"");
    println!("shared: {before:.2} J/kg to {after:.2}, {colliding} rows");
    assert!(colliding > 300 && after < before, "{before} {after}");
    let (before, after, ..) = collide("preset = \"paper\"");
    println!("single: {before:.2} J/kg to {after:.2}");
    assert!(after > 1.05 * before, "the heap does not amplify, so this shows nothing: {before} {after}");
}
