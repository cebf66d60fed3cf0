//! Every shader against its twin: the same state on the device (f32) and on the CPU (f64), one stage run on
//! both, everything it writes compared particle by particle.
//!
//! Each test asks that its stage did something and bounds the error. States come from the device, so both
//! sides start from the same numbers.

use crate::common::moving as common;

use glam::{DMat3, DVec3};
use seixo::backend::cpu::Cpu;
use seixo::backend::gpu::{self, Caps, Gpu, layout};
use seixo::backend::{Backend, Processor};
use seixo::body::slots::{Seep, SlotRow};
use seixo::body::{FreeBody, Mobility, Pose, Wrench};
use seixo::fields::{Fields, State};
use seixo::kernels::Particles;
use seixo::kernels::body_force::{self, RowPressure};
use seixo::kernels::pressure_source::laplacian_coefficient;
use seixo::kernels::wall_excess as kernels;
use seixo::params::{Params, Step};
use seixo::plan::{ParticleStage, Plan, Stage, Told};
use seixo::pressure::cg::System;
use seixo::pressure::multigrid::Multigrid;
use seixo::pressure::{Outcome, Settings};
use seixo::scene::{Drive, Kind, Scene};
use seixo::scheme::{Gradient, Preconditioner, Source};
use seixo::simulation::Simulation;
use seixo_study::device_compare::{self as compare, StageError};
use std::sync::Arc;

/// Largest error of a particle stage, relative to the largest value (to l0 for positions).
const PARTICLE: f64 = 1e-5;
/// Error of one solve at tolerance 1e-4, in the mean square.
const SOLVE: f64 = 5e-3;

/// The two backends with the same particles.
struct Pair {
    scene: Scene,
    params: Params,
    plan: Plan,
    settings: Settings,
    step: Step,
    poses: Vec<Pose>,
    cpu: Cpu,
    gpu: Gpu,
}

/// Whether there is a device to test; loud if not, and a failure where one is expected.
fn device() -> bool {
    crate::common::there_is_a_device(
        "the shaders are not compared with their twins (libvulkan1 and mesa-vulkan-drivers \
                give a software one)",
    )
}

impl Pair {
    /// A state in motion: some steps on the CPU, then a push that makes particles collide.
    fn new(dimensions: u32, fluid: &str) -> Option<Self> {
        Self::of_size(dimensions, fluid, if dimensions == 2 { 3 } else { 1 }, Preconditioner::Jacobi)
    }

    fn of_size(dimensions: u32, fluid: &str, scale: i32, preconditioner: Preconditioner) -> Option<Self> {
        Self::of_scene(dimensions, fluid, common::scene(dimensions, scale), preconditioner)
    }

    fn of_scene(
        dimensions: u32,
        fluid: &str,
        mut scene: Scene,
        preconditioner: Preconditioner,
    ) -> Option<Self> {
        if !device() {
            return None;
        }
        let case = common::case(dimensions, fluid);
        // No lattice plane on a border of cells: f32 and f64 would disagree about the side.
        scene.domain.0 -= 0.003 * DVec3::new(1.0, if dimensions == 2 { 0.0 } else { 1.0 }, 1.0);
        let params = Params::new(&case, &scene).expect("valid");
        let excess = if params.source == Source::Mixed { Told::All } else { Told::None };
        // As where gauges are on a body and a fixed wall.
        let reaction = Told::All;
        let plan = Plan { preconditioner, excess, reaction, ..Plan::new(&case, &scene, &params) };
        let settings = Settings { tolerance: 1e-4, max_iterations: 1000, warm_start: true };
        let mut cpu = Cpu::new(&scene, &params, &plan, settings).expect("the CPU can");
        let gpu = Gpu::new(&scene, &params, &plan, settings, None).expect("the device can");
        let (dt, steps) = (1e-3, 12);
        for k in 0..steps {
            let t = f64::from(k) * dt;
            let step = params.step(t, dt, 2.0);
            for stage in Stage::ALL {
                let done = match (stage, stage.over_particles()) {
                    _ if !plan.has(stage) => Ok(()),
                    (_, Some(stage)) => cpu.run(stage, &step),
                    (Stage::MoveSolids, _) => cpu.move_solids(&common::poses(&scene, t + dt)),
                    (Stage::ConjugateGradient, _) => cpu.solve_pressure(&step).map(|_| ()),
                    _ => Ok(()),
                };
                done.expect("the warm-up runs");
            }
        }
        let t = f64::from(steps) * dt;
        let mut fields = cpu.read().expect("the CPU can be read");
        for i in 0..scene.groups.fluid {
            fields.position[i] += 0.2 * params.spacing * common::noise_vector(i, dimensions);
            fields.velocity[i] += 0.4 * common::noise_vector(i + 100_000, dimensions);
        }
        // One that flies out, one that is broken.
        fields.position[3].z = params.domain_max.z + 0.1;
        fields.velocity[7].x = f64::NAN;
        // One that hits the body.
        let body = &scene.solids[1];
        let (wall, out) = (body.wall_slots.start, body.wall_area[0].normalize());
        fields.position[20] = fields.position[wall] + 0.6 * params.spacing * out;
        fields.velocity[20] = fields.velocity[wall] - out;
        let poses = common::poses(&scene, t);
        let step = params.step(t, dt, 2.0);
        let mut pair = Self { scene, params, plan, settings, step, poses, cpu, gpu };
        pair.gpu.write(&fields).expect("the device can be written");
        pair.sync();
        pair.move_solids();
        pair.sync();
        Some(pair)
    }

    /// Give the CPU the device's state, with places as its kernels see them: what is beside them in f32 is for the next move.
    fn sync(&mut self) {
        let mut fields = self.gpu.read().expect("the device can be read");
        let middle = layout::middle(&self.params);
        for x in &mut fields.position {
            *x = (*x - middle).as_vec3().as_dvec3() + middle;
        }
        self.cpu.write(&fields).expect("the CPU can be written");
    }

    fn run(&mut self, stage: Stage) {
        let stage = stage.over_particles().expect("a stage over the particles");
        self.cpu.run(stage, &self.step).expect("the CPU runs");
        self.gpu.run(stage, &self.step).expect("the device runs");
    }

    fn run_all(&mut self, stages: &[Stage]) {
        stages.iter().for_each(|&s| self.run(s));
    }

    /// What follows the lists, up to the right side of the PPE.
    fn run_to_source(&mut self) {
        for stage in [Stage::NumberDensity, Stage::SurfacePressure, Stage::PressureSource] {
            if self.plan.has(stage) {
                self.run(stage);
            }
        }
    }

    fn move_solids(&mut self) {
        self.cpu.move_solids(&self.poses).expect("the CPU moves solids");
        self.gpu.move_solids(&self.poses).expect("the device moves solids");
    }

    /// Fields of device and CPU, the fluid ordered by number.
    fn fields(&mut self) -> (Fields, Fields) {
        let (gpu, cpu) = (self.gpu.read().expect("readable"), self.cpu.read().expect("readable"));
        (compare::by_number(&gpu), compare::by_number(&cpu))
    }

    /// Errors of what `stage` has written.
    fn errors(&mut self, stage: Stage) -> Vec<StageError> {
        let (gpu, cpu) = self.fields();
        let errors = compare::differences(stage, &gpu, &cpu, &self.params);
        for e in &errors {
            println!("{:20} {:16} max {:.1e}  l2 {:.1e}", e.stage, e.field, e.max_relative, e.l2_relative);
        }
        errors
    }

    /// Every field that `stage` has written is within [`PARTICLE`].
    fn check(&mut self, stage: Stage) {
        for e in self.errors(stage) {
            assert!(e.max_relative < PARTICLE, "{} {}: {:e}", e.stage, e.field, e.max_relative);
        }
    }
}

/// Largest change of `f` of the fields between two states.
fn moved(before: &Fields, after: &Fields, f: impl Fn(&Fields) -> Vec<f64>) -> f64 {
    f(before).iter().zip(f(after)).map(|(a, b)| (a - b).abs()).filter(|d| d.is_finite()).fold(0.0, f64::max)
}

fn flat(v: &[DVec3]) -> Vec<f64> {
    v.iter().flat_map(|v| v.to_array()).collect()
}

/// The kinds of scheme and dimension that shape the shaders.
const SCHEMES: [(u32, &str); 3] =
    [(3, "preset = \"accurate\""), (3, "preset = \"paper\""), (2, "preset = \"accurate\"")];

fn each(test: impl Fn(&mut Pair)) {
    each_of(|_| {}, test);
}

/// In a scene that `change` has changed.
fn each_of(change: impl Fn(&mut Scene), test: impl Fn(&mut Pair)) {
    for (dimensions, fluid) in SCHEMES {
        let mut scene = common::scene(dimensions, if dimensions == 2 { 3 } else { 1 });
        change(&mut scene);
        if let Some(mut pair) = Pair::of_scene(dimensions, fluid, scene, Preconditioner::Jacobi) {
            println!("{dimensions}D, {fluid}");
            test(&mut pair);
        }
    }
}

const LISTS: [Stage; 2] = [Stage::CellList, Stage::NeighbourList];

#[test]
fn viscosity() {
    each(|pair| {
        pair.run_all(&LISTS);
        let (before, _) = pair.fields();
        pair.run(Stage::Viscosity);
        let (after, _) = pair.fields();
        assert!(moved(&before, &after, |f| flat(&f.acceleration)) > 1e-2);
        assert!(moved(&before, &after, |f| flat(&f.reaction)) > 1e-6);
        pair.check(Stage::Viscosity);
    });
}

#[test]
fn predict() {
    each(|pair| {
        // One that is too fast.
        let mut fields = pair.gpu.read().expect("readable");
        fields.velocity[11] = DVec3::new(60.0, 0.0, 5.0);
        pair.gpu.write(&fields).expect("writable");
        pair.sync();
        pair.run_all(&LISTS);
        pair.run(Stage::Viscosity);
        let (before, _) = pair.fields();
        let clamps = pair.gpu.counters().expect("readable").displacement_clamps;
        pair.run(Stage::Predict);
        let (after, _) = pair.fields();
        assert!(moved(&before, &after, |f| flat(&f.position)) > 1e-3 * pair.params.spacing);
        assert!(moved(&before, &after, |f| flat(&f.velocity)) > 1e-3);
        pair.check(Stage::Predict);
        let after = pair.gpu.counters().expect("readable").displacement_clamps;
        assert_eq!(after, pair.cpu.counters().expect("readable").displacement_clamps);
        assert!(after > clamps, "no displacement was clamped");
    });
}

#[test]
fn move_solids() {
    each(|pair| {
        let (before, _) = pair.fields();
        pair.poses = common::poses(&pair.scene, 0.1);
        pair.move_solids();
        let (after, _) = pair.fields();
        assert!(moved(&before, &after, |f| flat(&f.position)) > 1e-2);
        assert!(moved(&before, &after, |f| flat(&f.velocity)) > 1e-3);
        pair.check(Stage::MoveSolids);
    });
}

#[test]
fn cell_list() {
    each(|pair| {
        let before = pair.gpu.read().expect("readable");
        pair.run(Stage::CellList);
        let (gpu, cpu) = (pair.gpu.read().expect("readable"), pair.cpu.read().expect("readable"));
        assert_ne!(gpu.id, before.id, "nothing was reordered");
        let n = gpu.id.len();
        assert_eq!(gpu.id, cpu.id, "the orders differ");
        assert_eq!(gpu.kind, cpu.kind);
        assert_eq!(gpu.kind[n - 2..n], [Kind::Ghost; 2]);
        pair.check(Stage::CellList);
        assert_eq!(gpu.pressure, cpu.pressure, "pressures follow their particles");
        let (g, c) = (pair.gpu.counters().expect("readable"), pair.cpu.counters().expect("readable"));
        assert_eq!((g.lost, c.lost), (2, 2));
        // Ghosts stay ghosts and are counted once.
        pair.run(Stage::CellList);
        assert_eq!(pair.gpu.counters().expect("readable").lost, 2);
    });
}

/// Particles of one key are compared with each other: a spill must not put all of itself under one.
#[test]
fn many_ghosts_are_sorted_in_linear_time() {
    let Some(mut pair) = Pair::new(3, "preset = \"accurate\"") else { return };
    let mut fields = pair.gpu.read().expect("readable");
    let n = fields.id.len();
    for i in (0..n).filter(|i| i % 5 != 0) {
        fields.position[i].z = pair.params.domain_max.z + 0.1;
    }
    pair.gpu.write(&fields).expect("writable");
    pair.sync();
    pair.run(Stage::CellList);
    let (gpu, cpu) = (pair.gpu.read().expect("readable"), pair.cpu.read().expect("readable"));
    let ghosts = gpu.kind.iter().filter(|&&k| k == Kind::Ghost).count();
    assert!(ghosts > n / 2 && ghosts > 300, "{ghosts} ghosts of {n}");
    assert_eq!(gpu.id, cpu.id, "ghosts keep their order");
    let most = pair.gpu.key_starts().expect("readable").windows(2).map(|w| w[1] - w[0]).max();
    assert!(most.is_some_and(|most| most <= 64), "{most:?} particles share a key");
}

#[test]
fn neighbour_list() {
    each(|pair| {
        pair.run_all(&LISTS);
        let (gpu, cpu) =
            (pair.gpu.neighbours().expect("readable"), compare::neighbourhoods(pair.cpu.neighbours()));
        let g = pair.scene.groups;
        let errors = compare::neighbour_differences(&gpu, &cpu, g.fluid);
        println!("{} of {} pairs differ", errors.differing, errors.pairs);
        assert!(errors.pairs > 2000 && errors.differing == 0);
        let walls = g.static_wall_range();
        let dry = walls.clone().filter(|&i| gpu[i].0.is_empty()).count();
        assert!(dry > 0 && dry < walls.len(), "{dry} of {} walls are dry", walls.len());
        let (g, c) = (pair.gpu.counters().expect("readable"), pair.cpu.counters().expect("readable"));
        assert!(g.neighbours_max > 10 && g.overflow.is_none());
        // The CPU has more behind it, the warm-up.
        assert!(g.neighbours_max <= c.neighbours_max);
    });
}

#[test]
fn wall_friction() {
    // The paper's preset has none.
    for (dimensions, fluid) in [(3, "preset = \"accurate\""), (2, "preset = \"paper\"\nwall_friction = 0.01")]
    {
        let Some(mut pair) = Pair::new(dimensions, fluid) else { continue };
        pair.run_all(&LISTS);
        let (before, _) = pair.fields();
        pair.run(Stage::WallFriction);
        let (after, _) = pair.fields();
        assert!(moved(&before, &after, |f| flat(&f.velocity)) > 1e-5);
        assert!(moved(&before, &after, |f| flat(&f.reaction)) > 1e-5);
        pair.check(Stage::WallFriction);
    }
}

#[test]
fn collision() {
    each(|pair| {
        pair.run_all(&LISTS);
        let (before, _) = pair.fields();
        pair.run(Stage::Collision);
        let (after, _) = pair.fields();
        assert!(moved(&before, &after, |f| flat(&f.velocity)) > 0.1);
        assert!(moved(&before, &after, |f| flat(&f.reaction)) > 1e-3);
        pair.check(Stage::Collision);
    });
}

/// As behind a thin body, where lists have it among the dummies.
#[test]
fn collision_behind_a_moving_wall() {
    each(|pair| {
        let mut fields = pair.gpu.read().expect("readable");
        let body = &pair.scene.solids[1];
        let (k, out) = (body.wall_slots.start - pair.scene.groups.fluid, body.wall_area[0].normalize());
        let wall = body.wall_slots.start;
        fields.position[20] = fields.position[wall] - 0.4 * pair.params.spacing * out;
        fields.velocity[20] = fields.velocity[wall] + out;
        pair.gpu.write(&fields).expect("writable");
        pair.sync();
        pair.run_all(&LISTS);
        pair.run(Stage::Collision);
        let (gpu, cpu) = pair.fields();
        for fields in [&gpu, &cpu] {
            assert!(fields.reaction[k].dot(out) > 1e-3, "the wall does not feel it: {}", fields.reaction[k]);
        }
        pair.check(Stage::Collision);
    });
}

#[test]
fn the_first_stage_that_acts_on_walls_forgets_the_step_before() {
    for (first, left_out) in [
        (Stage::Viscosity, ""),
        (Stage::WallFriction, "viscosity = 0"),
        (Stage::Collision, "viscosity = 0\nwall_friction = 0"),
    ] {
        let Some(mut pair) = Pair::new(3, &format!("preset = \"accurate\"\n{left_out}")) else { continue };
        pair.run_all(&LISTS);
        let mut fields = pair.gpu.read().expect("readable");
        let walls = pair.scene.groups.pressure() - pair.scene.groups.fluid;
        assert_eq!(fields.reaction.len(), walls, "of those that never move as well");
        let before = DVec3::splat(1e6);
        fields.reaction.fill(before);
        pair.gpu.write(&fields).expect("writable");
        pair.cpu.write(&fields).expect("writable");
        // What is written has no lists.
        pair.run_all(&LISTS);
        assert_eq!(pair.plan.first_reacting(), Some(first));
        for stage in [Stage::Viscosity, Stage::WallFriction, Stage::Collision] {
            if pair.plan.has(stage) {
                pair.run(stage);
                pair.check(stage);
                let (gpu, _) = pair.fields();
                let most = gpu.reaction.iter().map(|f| f.length()).fold(0.0, f64::max);
                println!("{first:?}: after {stage:?} at most {most:.1e} N");
                assert!(most > 1e-6 && most < 1e3, "{stage:?}: {most} N");
            }
        }
        // Where the water has gone nothing acts on any more.
        fields.kind[..pair.scene.groups.fluid].fill(Kind::Ghost);
        pair.gpu.write(&fields).expect("writable");
        pair.cpu.write(&fields).expect("writable");
        pair.run_all(&LISTS);
        pair.run(first);
        let (gpu, cpu) = pair.fields();
        assert!(gpu.reaction.iter().chain(&cpu.reaction).all(|&f| f == DVec3::ZERO), "{first:?}");
    }
}

#[test]
fn number_density() {
    each(|pair| {
        pair.run_all(&LISTS);
        let (before, _) = pair.fields();
        pair.run(Stage::NumberDensity);
        let (after, _) = pair.fields();
        assert!(moved(&before, &after, |f| f.number_density.clone()) > 0.1);
        for state in [State::Inactive, State::Surface, State::Inner] {
            assert!(after.state.iter().filter(|&&s| s == state).count() > 20, "{state:?}");
        }
        pair.check(Stage::NumberDensity);
    });
}

#[test]
fn surface_pressure() {
    each(|pair| {
        pair.run_all(&LISTS);
        pair.run(Stage::NumberDensity);
        if !pair.plan.has(Stage::SurfacePressure) {
            return;
        }
        pair.run(Stage::SurfacePressure);
        let (gpu, _) = pair.fields();
        let fluid = pair.scene.groups.fluid;
        let (water, walls) = gpu.surface_pressure.split_at(fluid);
        for part in [water, walls] {
            assert!(part.iter().filter(|&&p| p > 10.0).count() > 2, "{part:?}");
        }
        let off = gpu.state.iter().zip(&gpu.surface_pressure).filter(|(s, _)| **s != State::Surface);
        assert!(off.into_iter().all(|(_, p)| *p == 0.0));
        pair.check(Stage::SurfacePressure);
        // Where water pulls its surface has no pressure.
        let mut fields = pair.gpu.read().expect("readable");
        fields.pressure.iter_mut().for_each(|p| *p = -*p);
        pair.gpu.write(&fields).expect("writable");
        pair.sync();
        pair.run_all(&LISTS);
        pair.run(Stage::NumberDensity);
        pair.run(Stage::SurfacePressure);
        let (gpu, _) = pair.fields();
        assert!(gpu.surface_pressure[..fluid].iter().all(|&p| p == 0.0));
        pair.check(Stage::SurfacePressure);
    });
}

#[test]
fn pressure_source() {
    each(|pair| {
        pair.run_all(&LISTS);
        pair.run_to_source();
        let (gpu, _) = pair.fields();
        assert!(gpu.source.iter().any(|&b| b > 0.0) && gpu.source.iter().any(|&b| b < 0.0));
        pair.check(Stage::PressureSource);
        // A body that has caught water on the floor.
        let mut fields = pair.gpu.read().expect("readable");
        pair.poses = common::on_the_floor(&pair.scene, &mut fields.position);
        pair.gpu.write(&fields).expect("writable");
        pair.sync();
        pair.move_solids();
        pair.run_all(&LISTS);
        pair.run_to_source();
        let (cpu, rows) = (pair.cpu.fields(), pair.cpu.neighbours());
        let c = 1.01 * laplacian_coefficient(&pair.params);
        let links = |i: usize| rows.pressure(i).weight.iter().sum::<f64>();
        let caught = |&i: &usize| cpu.state[i] == State::Inner && cpu.diagonal[i] > c * links(i);
        let caught = (0..pair.scene.groups.fluid).filter(caught).count();
        assert!(pair.params.source != Source::Mixed || caught > 1, "{caught} caught");
        pair.check(Stage::PressureSource);
    });
}

#[test]
fn conjugate_gradient() {
    each(|pair| {
        pair.run_all(&LISTS);
        pair.run_to_source();
        let (before, _) = pair.fields();
        let negative = pair.cpu.counters().expect("readable").negative_pressures;
        let g = pair.gpu.solve_pressure(&pair.step).expect("the device solves");
        let c = pair.cpu.solve_pressure(&pair.step).expect("the CPU solves");
        println!("device {g:?}\nCPU    {c:?}");
        let (after, _) = pair.fields();
        assert!(moved(&before, &after, |f| f.pressure.clone()) > 10.0);
        assert_eq!((g.outcome, g.unknowns), (Outcome::Converged, c.unknowns));
        assert!(g.iterations > 5 && g.iterations.abs_diff(c.iterations) <= 2);
        assert!(g.residual > 0.0 && g.residual < 2e-4, "true residual {:e}", g.residual);
        for e in pair.errors(Stage::ConjugateGradient) {
            assert!(e.l2_relative < SOLVE, "{:e}", e.l2_relative);
        }
        // Pressures below zero are cut and counted; those near zero may lie on either side.
        let (g, c) = (pair.gpu.counters().expect("readable"), pair.cpu.counters().expect("readable"));
        let (g, c) = (g.negative_pressures, c.negative_pressures - negative);
        println!("{g} of the device, {c} of the CPU are negative");
        assert!(c > 2 && g.abs_diff(c) <= 2 + c / 50);
    });
}

#[test]
fn conjugate_gradient_from_zero_and_from_a_bad_start() {
    let Some(mut pair) = Pair::new(3, "preset = \"accurate\"") else { return };
    pair.run_all(&LISTS);
    pair.run_to_source();
    pair.gpu.solve_pressure(&pair.step).expect("solves");
    let (good, _) = pair.fields();
    // A start whose residual exceeds the right side is thrown away.
    let mut bad = pair.gpu.read().expect("readable");
    bad.pressure.iter_mut().enumerate().for_each(|(i, p)| *p = 1e7 * common::noise(i));
    pair.gpu.write(&bad).expect("writable");
    pair.sync();
    pair.run_all(&LISTS);
    // What is known of the surface stays as it was.
    pair.run_all(&[Stage::NumberDensity, Stage::PressureSource]);
    let g = pair.gpu.solve_pressure(&pair.step).expect("solves");
    let c = pair.cpu.solve_pressure(&pair.step).expect("solves");
    assert_eq!(g.outcome, Outcome::Converged);
    assert!(g.iterations.abs_diff(c.iterations) <= 2, "{g:?} {c:?}");
    let (again, _) = pair.fields();
    let errors = compare::differences(Stage::ConjugateGradient, &again, &good, &pair.params);
    assert!(errors.iter().all(|e| e.l2_relative < SOLVE));
    // Too few iterations allowed: the last iterate is kept and said to be no solution.
    let few = Settings { max_iterations: 3, ..pair.settings };
    let mut gpu = Gpu::new(&pair.scene, &pair.params, &pair.plan, few, None).expect("the device can");
    gpu.write(&bad).expect("writable");
    for stage in ParticleStage::TO_SOURCE {
        gpu.run(stage, &pair.step).expect("runs");
    }
    let report = gpu.solve_pressure(&pair.step).expect("solves");
    assert_eq!((report.outcome, report.iterations), (Outcome::MaxIterations, 3));
    assert!(report.residual > 1e-3);
    // No source: no pressure, no iteration.
    let mut nothing = gpu.read().expect("readable");
    nothing.source.fill(0.0);
    nothing.surface_pressure.fill(0.0);
    gpu.write(&nothing).expect("writable");
    let report = gpu.solve_pressure(&pair.step).expect("solves");
    assert_eq!((report.outcome, report.iterations), (Outcome::ZeroSource, 0));
    assert!(gpu.read().expect("readable").pressure.iter().all(|&p| p == 0.0));
    // A right side that is not a number.
    nothing.source.fill(f64::NAN);
    gpu.write(&nothing).expect("writable");
    assert_eq!(gpu.solve_pressure(&pair.step).expect("solves").outcome, Outcome::NonFinite);
}

/// The schemes with multigrid, ready to solve.
fn each_multigrid(test: impl Fn(&mut Pair)) {
    for (dimensions, fluid) in SCHEMES {
        let scale = if dimensions == 2 { 6 } else { 2 };
        if let Some(mut pair) = Pair::of_size(dimensions, fluid, scale, Preconditioner::Multigrid) {
            println!("{dimensions}D, {fluid}");
            pair.run_all(&LISTS);
            pair.run_to_source();
            test(&mut pair);
        }
    }
}

/// The CPU's system of the state at hand.
fn system<'a>(cpu: &'a Cpu, params: &Params) -> System<'a> {
    let f = cpu.fields();
    System {
        neighbours: cpu.neighbours(),
        state: &f.state,
        diagonal: &f.diagonal,
        coefficient: laplacian_coefficient(params),
        bodies: &[],
        among: None,
    }
}

#[test]
fn multigrid_levels() {
    each_multigrid(|pair| {
        let grid = seixo::cells::Grid::new(&pair.params).expect("valid");
        let mut twin = Multigrid::default();
        twin.build(&system(&pair.cpu, &pair.params), &grid, &pair.cpu.fields().position);
        let (gpu, cpu) = (pair.gpu.level_sums().expect("readable"), twin.sums());
        let c = laplacian_coefficient(&pair.params);
        println!("{gpu:?}");
        assert!(gpu.len() >= 3 && gpu.len() == cpu.len());
        assert!(gpu[0].rows > 50 && gpu[0].entries > 0.1);
        for (g, p) in gpu.iter().zip(&cpu) {
            assert_eq!(g.rows, p.rows);
            let near = |a: f64, b: f64, scale: f64| assert!((a - b).abs() < PARTICLE * scale, "{a} {b}");
            near(g.diagonal, p.diagonal / c, g.diagonal);
            near(g.squares, p.squares / c / c, g.squares);
            near(g.entries, p.entries / c, g.diagonal);
        }
    });
}

#[test]
fn multigrid() {
    each_multigrid(|pair| {
        // One iteration from zero is the preconditioned right side times a number.
        let one = Settings { max_iterations: 1, warm_start: false, ..pair.settings };
        let before = pair.gpu.read().expect("readable");
        let start = |sign: f64| {
            let mut fields = before.clone();
            // Small enough for no bound; both signs, as negative pressures are cut.
            fields.source.iter_mut().for_each(|b| *b *= 1e-4 * sign);
            fields
        };
        let device = |pair: &Pair, large: usize| {
            let caps = Caps { large_levels: Some(large), ..Caps::default() };
            Gpu::capped(&pair.scene, &pair.params, &pair.plan, one, None, caps).expect("the device can")
        };
        let on_device = |pair: &Pair, gpu: &mut Gpu, sign: f64| -> Vec<f64> {
            gpu.write(&start(sign)).expect("writable");
            gpu.run(ParticleStage::CellList, &pair.step).expect("runs");
            gpu.run(ParticleStage::NeighbourList, &pair.step).expect("runs");
            let report = gpu.solve_pressure(&pair.step).expect("solves");
            assert_eq!((report.outcome, report.iterations), (Outcome::MaxIterations, 1));
            gpu.read().expect("readable").pressure
        };
        let on_cpu = |pair: &Pair, sign: f64| -> Vec<f64> {
            let mut cpu = Cpu::new(&pair.scene, &pair.params, &pair.plan, one).expect("the CPU can");
            cpu.write(&start(sign)).expect("writable");
            cpu.run(ParticleStage::CellList, &pair.step).expect("runs");
            cpu.run(ParticleStage::NeighbourList, &pair.step).expect("runs");
            cpu.run(ParticleStage::NumberDensity, &pair.step).expect("runs"); // makes the weights
            cpu.solve_pressure(&pair.step).expect("solves");
            cpu.fields().pressure.clone()
        };
        let mut small = device(pair, 0);
        let [plus, minus] = [1.0, -1.0].map(|sign| (on_device(pair, &mut small, sign), on_cpu(pair, sign)));
        let scale = plus.1.iter().chain(&minus.1).fold(0.0_f64, |s, p| s.max(*p));
        for ((gpu, cpu), least) in [(&plus, 200), (&minus, 0)] {
            let positive = cpu.iter().filter(|&&p| p > 1e-3 * scale).count();
            let worst = gpu.iter().zip(cpu).fold(0.0_f64, |s, (a, b)| s.max((a - b).abs()));
            println!("{positive} positive of {}, worst {:.1e}", cpu.len(), worst / scale);
            assert!(positive >= least && worst < PARTICLE * scale);
        }
        // Who works a level does not matter, to the bit.
        let large = if pair.params.dimensions == 2 { 3 } else { 1 };
        assert!(on_device(pair, &mut device(pair, large), 1.0) == plus.0, "{large} large levels differ");
        // The whole solve, against the diagonal.
        let g = pair.gpu.solve_pressure(&pair.step).expect("the device solves");
        let c = pair.cpu.solve_pressure(&pair.step).expect("the CPU solves");
        println!("device {g:?}\nCPU    {c:?}");
        assert_eq!((g.outcome, g.unknowns), (Outcome::Converged, c.unknowns));
        assert!(g.iterations.abs_diff(c.iterations) <= 1 && g.residual > 0.0 && g.residual < 2e-4);
        let jacobi = Plan { preconditioner: Preconditioner::Jacobi, ..pair.plan.clone() };
        let mut diagonal = Gpu::new(&pair.scene, &pair.params, &jacobi, pair.settings, None).expect("can");
        diagonal.write(&before).expect("writable");
        diagonal.run(ParticleStage::CellList, &pair.step).expect("runs");
        diagonal.run(ParticleStage::NeighbourList, &pair.step).expect("runs");
        let d = diagonal.solve_pressure(&pair.step).expect("solves");
        assert!(g.iterations < 12 && d.iterations > 2 * g.iterations, "{} {}", d.iterations, g.iterations);
        let (got, want) = (pair.gpu.read().expect("readable"), diagonal.read().expect("readable"));
        let errors = compare::differences(Stage::ConjugateGradient, &got, &want, &pair.params);
        assert!(errors.iter().all(|e| e.l2_relative < SOLVE), "{errors:?}");
    });
}

/// Sums over the cells leave the range of f32 where the particles' own rows do not: the diagonal goes on alone.
#[test]
fn where_multigrid_breaks_down_the_diagonal_takes_over() {
    each_multigrid(|pair| {
        let mut fields = pair.gpu.read().expect("readable");
        let c = laplacian_coefficient(&pair.params);
        let unknown = |i: &usize| fields.state[*i] == State::Inner;
        let unknowns: Vec<usize> = (0..fields.source.len()).filter(unknown).collect();
        for i in unknowns {
            (fields.diagonal[i], fields.source[i]) = (1.5e38 * c, 1e12 * c);
        }
        pair.gpu.write(&fields).expect("writable");
        pair.sync();
        // The order is that of the cells already; writing has emptied the lists.
        pair.run_all(&LISTS);
        pair.run(Stage::NumberDensity);
        let g = pair.gpu.solve_pressure(&pair.step).expect("the device solves");
        let c = pair.cpu.solve_pressure(&pair.step).expect("the CPU solves");
        println!("device {g:?}\nCPU    {c:?}");
        assert_eq!((g.outcome, c.outcome), (Outcome::Converged, Outcome::Converged));
        let pressure = pair.gpu.read().expect("readable").pressure;
        let expected = 1e12 / 1.5e38;
        assert!(pressure.iter().any(|p| (p / expected - 1.0).abs() < 1e-3));
    });
}

#[test]
fn multigrid_needs_few_iterations_at_any_spacing() {
    if !device() {
        return;
    }
    let mut case: seixo::case::Case =
        toml::from_str(include_str!("../cases/dam_break.toml")).expect("a valid case");
    for spacing in [0.03, 0.02] {
        case.run.spacing = spacing;
        let scene = Arc::new(Scene::build(&case).expect("a valid scene"));
        let mut iterations = |preconditioner, on_device: bool, steps: usize| {
            case.fluid.as_mut().expect("it has fluid").solver.preconditioner = preconditioner;
            let processor = if on_device { Processor::Gpu { adapter: None } } else { Processor::Cpu };
            let mut simulation =
                Simulation::on(&case, scene.clone(), &processor).expect("the simulation starts");
            (0..steps).map(|_| simulation.step().expect("a step").pressure.iterations).max().unwrap_or(0)
        };
        let gpu = iterations(seixo::case::Preconditioner::Multigrid, true, 4);
        let cpu = iterations(seixo::case::Preconditioner::Multigrid, false, 4);
        let diagonal = iterations(seixo::case::Preconditioner::Jacobi, true, 1);
        println!(
            "l0 = {spacing}: at most {gpu} on the device, {cpu} on the CPU, {diagonal} with the diagonal"
        );
        assert!(gpu > 1 && gpu <= 8 && gpu.abs_diff(cpu) <= 1 && diagonal > 2 * gpu);
    }
}

/// Rows of the body as if half of each third one lay in a slot and the next ones were its rim, before a pocket.
fn rows_at_slots(pair: &Pair) -> Vec<SlotRow> {
    let l0 = pair.params.spacing;
    let push = |k: f64| Wrench {
        force: l0 * l0 * DVec3::new(0.3, 0.1, 0.5 + 0.05 * k),
        torque: l0.powi(3) * DVec3::new(0.2, -0.4, 0.1),
    };
    let rows = 0..pair.scene.solids[1].wall_slots.len();
    let of = |k: usize| match k % 3 {
        0 => Some(SlotRow { solid: 1, row: k as u32, taken: 0.5, ..SlotRow::default() }),
        1 => {
            let mut head = Wrench::default();
            head.add(200.0, &push(1.0));
            let seep = Seep { link: 0.5, known: 0.5 * 400.0 };
            Some(SlotRow { solid: 1, row: k as u32, taken: 0.0, per_pascal: push(k as f64), head, seep })
        }
        _ => None,
    };
    rows.filter_map(of).collect()
}

#[test]
fn coupling() {
    for (dimensions, preconditioner) in
        [(3, Preconditioner::Jacobi), (2, Preconditioner::Jacobi), (3, Preconditioner::Multigrid)]
    {
        let scale =
            if preconditioner == Preconditioner::Multigrid { 2 } else { [0, 0, 3, 1][dimensions as usize] };
        let made = Pair::of_size(dimensions, "preset = \"accurate\"", scale, preconditioner);
        let Some(mut pair) = made else { return };
        pair.run_all(&LISTS);
        pair.run_all(&[Stage::Viscosity, Stage::Collision]);
        pair.run_to_source();
        pair.gpu.solve_pressure(&pair.step).expect("the device solves");
        pair.cpu.solve_pressure(&pair.step).expect("the CPU solves");
        let alone = pair.cpu.fields().clone();
        let volume = f64::from(if dimensions == 3 { 27 } else { 9 }) * pair.params.spacing.powi(3);
        let turns = DMat3::from_diagonal(DVec3::new(3.0, 2.0, 4.0));
        // As of one with water in its slots.
        let crosses = DMat3::from_cols(
            DVec3::new(0.0, 0.1, 0.3),
            DVec3::new(-0.2, 0.0, 0.5),
            DVec3::new(0.0, 0.3, 0.1),
        );
        // A body brings outliers into the spectrum, the lighter the farther out; conjugate gradients in f32 find those
        // again and again, one iteration each time.
        for (ratio, apart, least, standing) in
            [(1.0, 2, 0.01, false), (0.05, 5, 0.04, false), (0.05, 5, 0.04, true), (1.0, 2, 0.01, false)]
        {
            // Pressed and turned by something else as well.
            let mass = ratio * pair.params.density * volume;
            let load = Wrench { force: DVec3::new(0.2, 0.0, -3.0), torque: DVec3::new(0.0, 0.01, 0.0) };
            let body = FreeBody {
                mobility: Mobility {
                    crosses: crosses / (mass * pair.params.spacing),
                    ..Mobility::of_body(
                        DVec3::splat(1.0 / mass),
                        turns / (mass * pair.params.spacing.powi(2)),
                    )
                },
                load,
            };
            let bodies = [FreeBody::default(), body];
            let slots = if standing { rows_at_slots(&pair) } else { Vec::new() };
            pair.run(Stage::PressureSource);
            pair.gpu.free_bodies(&bodies, &slots).expect("the device takes them");
            pair.cpu.free_bodies(&bodies, &slots).expect("the CPU takes them");
            let g = pair.gpu.solve_pressure(&pair.step).expect("the device solves");
            let c = pair.cpu.solve_pressure(&pair.step).expect("the CPU solves");
            println!("{dimensions}D, {preconditioner:?}, density ratio {ratio}\ndevice {g:?}\nCPU    {c:?}");
            assert_eq!(
                (g.outcome, c.outcome, g.unknowns),
                (Outcome::Converged, Outcome::Converged, c.unknowns)
            );
            assert!(g.iterations.abs_diff(c.iterations) <= apart && g.residual < 2e-4, "{g:?} {c:?}");
            for e in pair.errors(Stage::ConjugateGradient) {
                assert!(e.l2_relative < SOLVE, "{:e}", e.l2_relative);
            }
            let (g, c) = (pair.gpu.body_force(&[]), pair.cpu.body_force(&[]));
            let [(g, c), (others_g, others_c)] =
                [1, 0].map(|k| (g.as_ref().expect("sums").0[k], c.as_ref().expect("sums").0[k]));
            println!("force {:.4} {:.4}, torque {:.6} {:.6}", g.force, c.force, g.torque, c.torque);
            assert!((g.force - c.force).length() < 10.0 * SOLVE * c.force.length().max(1.0));
            assert!((g.torque - c.torque).length() < SOLVE * c.force.length().max(1.0));
            assert!(
                (others_g.force - others_c.force).length() < 10.0 * SOLVE * others_c.force.length().max(1.0)
            );
            // It takes up what presses on it: the pressure of a body that gives way is another one.
            let slots = pair.scene.solids[1].wall_slots.clone();
            let (held, free) = (&alone.pressure[slots.clone()], &pair.cpu.fields().pressure[slots]);
            let (sum, difference) =
                held.iter().zip(free).fold((0.0, 0.0), |(s, d), (a, b)| (s + a, d + (a - b).abs()));
            println!("{sum:.1} Pa held, changed by {difference:.1}");
            assert!(difference > least * sum && sum > 0.0);
        }
    }
}

/// Through slots of a held wall that comes before the free body water seeps in one solve, and in the next ones there are none.
#[test]
fn rows_of_a_solid_that_no_longer_answers_are_gone() {
    let Some(mut pair) = Pair::new(2, "preset = \"accurate\"") else { return };
    pair.run_all(&LISTS);
    pair.run_all(&[Stage::Viscosity, Stage::Collision]);
    pair.run_to_source();
    let mass = 0.5 * pair.params.density * 9.0 * pair.params.spacing.powi(3);
    let body = FreeBody {
        mobility: Mobility::of_body(
            DVec3::splat(1.0 / mass),
            DMat3::from_diagonal(DVec3::splat(1.0 / (mass * pair.params.spacing.powi(2)))),
        ),
        load: Wrench::default(),
    };
    let bodies = [FreeBody::default(), body];
    let l0 = pair.params.spacing;
    let push = Wrench { force: l0 * l0 * DVec3::new(0.3, 0.0, 0.2), torque: DVec3::ZERO };
    let seep = Seep { link: 0.5, known: 0.0 };
    let rows = 0..pair.scene.solids[0].wall_slots.len() as u32;
    let slots: Vec<_> = rows
        .map(|row| SlotRow { solid: 0, row, taken: 0.0, per_pascal: push, seep, ..SlotRow::default() })
        .collect();
    for slots in [&slots[..], &[], &[]] {
        pair.run(Stage::PressureSource);
        pair.gpu.free_bodies(&bodies, slots).expect("the device takes them");
        pair.cpu.free_bodies(&bodies, slots).expect("the CPU takes them");
        let g = pair.gpu.solve_pressure(&pair.step).expect("the device solves");
        let c = pair.cpu.solve_pressure(&pair.step).expect("the CPU solves");
        println!("{} slots\ndevice {g:?}\nCPU    {c:?}", slots.len());
        assert_eq!((g.outcome, c.outcome), (Outcome::Converged, Outcome::Converged));
        assert!(g.iterations.abs_diff(c.iterations) <= 3 && g.residual < 2e-4, "{g:?} {c:?}");
        for e in pair.errors(Stage::ConjugateGradient) {
            assert!(e.l2_relative < SOLVE, "{:e}", e.l2_relative);
        }
    }
}

/// A cube of 0.8 microns that floats and turns: what its inertia turns per pascal is beyond f32 in metres.
#[test]
fn a_body_of_less_than_a_micron_moves_on_the_device_as_on_the_cpu() {
    if !device() {
        return;
    }
    let text = "[run]\nspacing = 2e-7\ntime_step = 3.1623e-6\nend = 1e-3\ndimensions = 3\n\
                [tank]\nmin = [0, 0, 0]\nmax = [2e-6, 2e-6, 2e-6]\nopen = [\"z_max\"]\n\
                [fluid]\nviscosity = 3e-12\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [2e-6, 2e-6, 1.6e-6]\n\
                [[body]]\nname = \"a\"\nsize = [8e-7, 8e-7, 8e-7]\ncenter = [1e-6, 1e-6, 1.4e-6]\ndensity = 600\n\
                angular_velocity = [0, 600, 0]\ndisplaces_fluid = true\n[contact]\nspring = 2e-6\n";
    let case = toml::from_str(text).expect("a valid case");
    let scene = Arc::new(Scene::build(&case).expect("a valid scene"));
    let [gpu, cpu] = [Processor::Gpu { adapter: None }, Processor::Cpu].map(|processor| {
        let mut simulation = Simulation::on(&case, scene.clone(), &processor).expect("the simulation starts");
        let last = (0..3).map(|_| simulation.step().expect("a step").pressure).last().expect("three steps");
        assert_eq!(last.outcome, Outcome::Converged, "{last:?}");
        let pose = simulation.solids().next().expect("a body").pose;
        println!("{:?} {:?}", pose.velocity, pose.angular_velocity);
        (pose.velocity, pose.angular_velocity)
    });
    assert!((gpu.0 - cpu.0).length() < 1e-2 * cpu.0.length(), "{gpu:?} {cpu:?}");
    assert!((gpu.1 - cpu.1).length() < 1e-2 * cpu.1.length(), "{gpu:?} {cpu:?}");
}

#[test]
fn pressure_gradient() {
    each(|pair| {
        pair.run_all(&LISTS);
        // With the pressure of the warm-up, so that the solver's tolerance does not enter.
        pair.run(Stage::NumberDensity);
        let (before, _) = pair.fields();
        assert!(before.pressure.iter().any(|&p| p > 100.0));
        pair.run(Stage::PressureGradient);
        let (after, _) = pair.fields();
        assert!(moved(&before, &after, |f| flat(&f.acceleration)) > 1.0);
        pair.check(Stage::PressureGradient);
    });
}

#[test]
fn correct() {
    each(|pair| {
        pair.run_all(&LISTS);
        pair.run(Stage::NumberDensity);
        pair.run(Stage::PressureGradient);
        let (before, _) = pair.fields();
        pair.run(Stage::Correct);
        let (after, _) = pair.fields();
        assert!(moved(&before, &after, |f| flat(&f.velocity)) > 1e-2);
        assert!(moved(&before, &after, |f| flat(&f.position)) > 1e-5);
        pair.check(Stage::Correct);
        // A particle whose velocity is not a number is named.
        let mut broken = pair.gpu.read().expect("readable");
        broken.velocity[5].y = f64::NAN;
        pair.gpu.write(&broken).expect("writable");
        pair.sync();
        pair.run(Stage::Correct);
        let named = pair.gpu.counters().expect("readable").non_finite;
        assert_eq!(named, Some(broken.id[5]));
        assert_eq!(pair.cpu.counters().expect("readable").non_finite, named);
    });
}

#[test]
fn absorber() {
    let zones = "\n[[absorber]]\nmin = [0.05, -1, 0.0]\nmax = [0.15, 1, 0.1]\ntowards = \"x_max\"\nrate = 300\n\
                 [[absorber]]\nmin = [0.0, -1, 0.03]\nmax = [0.12, 1, 0.2]\ntowards = \"z_min\"\n";
    for (dimensions, fluid) in SCHEMES {
        let Some(mut pair) = Pair::new(dimensions, &format!("{fluid}{zones}")) else { return };
        let (before, _) = pair.fields();
        pair.run(Stage::Absorber);
        let (after, _) = pair.fields();
        let slower = |(a, b): (&DVec3, &DVec3)| b.length() < 0.95 * a.length();
        let count = before.velocity.iter().zip(&after.velocity).filter(|&pair| slower(pair)).count();
        let same = before.velocity.iter().zip(&after.velocity).filter(|(a, b)| a == b).count();
        assert!(count > 20 && same > 20, "{count} slower, {same} as they were");
        pair.check(Stage::Absorber);
    }
    // What has none plans none.
    let Some(pair) = Pair::new(2, "preset = \"accurate\"") else { return };
    assert!(!pair.plan.has(Stage::Absorber));
}

#[test]
fn openings() {
    use seixo::case::Case;
    use seixo::kernels::openings::{Emission, Outlet};
    if !device() {
        return;
    }
    let text = "[run]\nspacing = 0.01\ntime_step = 1e-3\nend = 1.0\n[tank]\nmin = [0, 0, 0]\nmax = [0.2, 0.1, 0.2]\n\
                [fluid]\nmax_volume = 0.0021\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 0.1, 0.1]\n\
                [[inflow]]\nname = \"in\"\nface = \"x_min\"\nmin = [0, 0.02, 0]\nmax = [0, 0.1, 0.1]\nvelocity = 1\n\
                [[inflow]]\nname = \"above\"\nface = \"x_min\"\nmin = [0, 0, 0.1]\nmax = [0, 0.1, 0.14]\nvelocity = 1\n\
                [[outflow]]\nname = \"out\"\nface = \"x_max\"\nvelocity = 1\n[[outflow]]\nname = \"hole\"\nface = \"z_min\"\n\
                min = [0.1, 0, 0]\nmax = [0.14, 0.1, 0]\n";
    let case: Case = text.parse().expect("valid");
    let scene = Scene::build(&case).expect("valid");
    let params = Params::new(&case, &scene).expect("valid");
    let plan = Plan::new(&case, &scene, &params);
    let settings = Settings { tolerance: 1e-4, max_iterations: 1000, warm_start: true };
    let mut cpu = Cpu::new(&scene, &params, &plan, settings).expect("the CPU can");
    let mut gpu = Gpu::new(&scene, &params, &plan, settings, None).expect("the device can");
    let mut fields = cpu.read().expect("readable");
    fields.pressure.iter_mut().enumerate().for_each(|(i, p)| *p = i as f64);
    for backend in [&mut cpu as &mut dyn Backend, &mut gpu] {
        backend.write(&fields).expect("writable");
        let mut to = scene.groups.fluid;
        let layers = [0, 1].map(|k| {
            let wall = scene.solids[scene.openings[k].solid.expect("a wall")].wall_slots.clone();
            to -= wall.len();
            let shift = DVec3::new(0.0103, 1e-3 * k as f64, 0.0);
            Emission { wall, to, shift, velocity: DVec3::new(1.0, 0.5, -0.25 * k as f64) }
        });
        let outlets = [
            Outlet::all((DVec3::new(0.153, -1.0, -1.0), DVec3::new(1.0, 1.0, 0.052))),
            // The room of the second one reaches into the first.
            Outlet {
                room_low: DVec3::new(0.12, 0.018, -0.01),
                room_high: DVec3::new(0.181, 0.082, 0.012),
                ..Outlet::all((DVec3::new(0.1, 0.0, -0.1), DVec3::new(0.14, 0.1, 0.031)))
            },
        ];
        backend.pass_openings(&layers, &outlets).expect("it runs");
        backend.pass_openings(&[], &[Outlet::CLOSED; 2]).expect("it runs");
    }
    let (a, b) = (cpu.read().expect("readable"), gpu.read().expect("readable"));
    assert!(a.kind == b.kind && a.id == b.id);
    let n = scene.groups.fluid;
    for i in 0..n {
        assert!(a.position[i].distance(b.position[i]) < 1e-7, "slot {i}");
        assert!(a.velocity[i].distance(b.velocity[i]) < 1e-7 && (a.pressure[i] - b.pressure[i]).abs() < 1e-3);
    }
    // Layers of 8 x 10 and 10 x 4, at the end of the parked slots; 5 and 4 columns of water are swallowed, 5 and 3 deep,
    // but for the lowest of 3 and 2 columns on 6 rows.
    let count = |kind: Kind| a.kind[..n].iter().filter(|&&k| k == kind).count();
    let swallowed = [5 * 10 * 5 - 3 * 6, 4 * 10 * 3 - 2 * 6];
    assert_eq!(count(Kind::Fluid), scene.water() + 120 - swallowed.iter().sum::<usize>());
    assert!(a.kind[n - 120..n].iter().all(|&k| k == Kind::Fluid) && a.kind[n - 121] == Kind::Ghost);
    assert!((a.velocity[n - 1].x - 1.0).abs() < 1e-12 && a.pressure[n - 1] >= n as f64);
    for backend in [&mut cpu as &mut dyn Backend, &mut gpu] {
        let counters = backend.counters().expect("readable");
        assert_eq!((counters.swallowed.clone(), counters.lost), (swallowed.map(|n| n as u64).to_vec(), 0));
    }
}

#[test]
fn shift() {
    each(|pair| {
        if pair.params.gradient == Gradient::Minimum {
            return assert!(!pair.plan.has(Stage::Shift));
        }
        pair.run_all(&LISTS);
        pair.run(Stage::NumberDensity);
        pair.run(Stage::PressureGradient);
        let (before, _) = pair.fields();
        pair.run(Stage::Shift);
        let (after, _) = pair.fields();
        assert!(moved(&before, &after, |f| flat(&f.position)) > 1e-6);
        pair.check(Stage::Shift);
    });
}

#[test]
fn pressure_level() {
    if !device() {
        return;
    }
    let case = crate::common::case(
        "[run]\nspacing = 0.1\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -9.81]\n\
         [fluid]\nsound_speed = 3\njitter = 0.1\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1.6, 1.5, 1.4]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1.6, 1.5, 1.4]\nopen = []\nperiodic = [\"x\"]\n",
    );
    let scene = Scene::build(&case).expect("it builds");
    let params = Params::new(&case, &scene).expect("valid");
    let plan = Plan::new(&case, &scene, &params);
    assert!(plan.filled);
    let settings = Settings { tolerance: 1e-5, max_iterations: 1000, warm_start: true };
    let cpu = Cpu::new(&scene, &params, &plan, settings).expect("the CPU can");
    let gpu = Gpu::new(&scene, &params, &plan, settings, None).expect("the device can");
    let step = params.step(0.0, 1e-3, 2.0);
    let mut pair = Pair { scene, params, plan, settings, step, poses: vec![], cpu, gpu };
    let mut fields = pair.gpu.read().expect("readable");
    for (i, v) in fields.velocity.iter_mut().take(pair.scene.groups.fluid).enumerate() {
        *v = 0.2 * common::noise_vector(i, 3);
    }
    pair.gpu.write(&fields).expect("writable");
    pair.sync();
    pair.run_all(&LISTS);
    pair.run_to_source();
    pair.gpu.solve_pressure(&step).expect("the device solves");
    pair.cpu.solve_pressure(&step).expect("the CPU solves");
    let (gpu, cpu) = pair.fields();
    let unknown = |f: &Fields| -> Vec<f64> {
        f.state.iter().zip(&f.pressure).filter(|(s, _)| **s == State::Inner).map(|(_, &p)| p).collect()
    };
    let (there, here) = (unknown(&gpu), unknown(&cpu));
    assert!(there.len() == here.len() && there.len() > 3000, "{} {}", there.len(), here.len());
    let largest = here.iter().fold(0.0_f64, |a, &p| a.max(p));
    let least = |of: &[f64]| of.iter().fold(f64::INFINITY, |a, &p| a.min(p));
    assert_eq!((least(&there), least(&here)), (0.0, 0.0));
    let square: f64 = there.iter().zip(&here).map(|(a, b)| (a - b).powi(2)).sum();
    let rms = (square / here.len() as f64).sqrt() / largest;
    println!("rms {rms:.1e} of {largest:.0} Pa");
    assert!(largest > 5e3 && rms < SOLVE, "{rms}");
    assert_eq!(pair.gpu.counters().expect("counted").negative_pressures, 0);
}

/// What the rows of solid `k` that are unknowns tell, with `fields` and what is `told` of each: their force and torque, and the sizes that add up to them.
fn of_unknowns(pair: &Pair, k: usize, fields: &Fields, told: &[RowPressure]) -> (Wrench, f64, f64) {
    let (solid, pose) = (&pair.scene.solids[k], &pair.poses[k]);
    let (mut sum, mut size, mut torques) = (Wrench::default(), 0.0, 0.0);
    for ((n, i), row) in solid.wall_slots.clone().enumerate().zip(told) {
        let arm = pose.orientation * (solid.wall_offset[n] + solid.wall_to_surface[n]);
        let pressure = |way| body_force::surface_pressure(row.pressure, row.excess, way, &pair.params);
        let area = pose.orientation * solid.wall_area[n];
        let reaction = fields.reaction[i - pair.scene.groups.fluid];
        let (pressed, turning) = if fields.state[i] == State::Inner {
            let turning = body_force::turning(pose.angular_velocity, area, &pair.params);
            (body_force::on_faces(solid, n, pose, 1.0, pressure), turning)
        } else {
            (Wrench::default(), DVec3::ZERO)
        };
        let force = reaction + turning;
        sum += pressed;
        sum += Wrench { force, torque: arm.cross(force) };
        size += (pressed.force + force).length();
        torques += arm.length() * (pressed.force + force).length();
    }
    (sum, size, torques)
}

#[test]
fn body_force() {
    each(|pair| {
        pair.run_all(&LISTS);
        pair.run_all(&[Stage::Viscosity, Stage::Collision]);
        pair.run_to_source();
        pair.gpu.solve_pressure(&pair.step).expect("the device solves");
        pair.cpu.solve_pressure(&pair.step).expect("the CPU solves");
        let fields = pair.gpu.read().expect("readable");
        let slots: Vec<usize> = pair.scene.solids.iter().flat_map(|s| s.wall_slots.clone()).collect();
        let pressures = pair.gpu.wall_pressures(&slots).expect("readable");
        let (gpu, told) = pair.gpu.body_force(&slots).expect("the device sums");
        assert_eq!(told, pressures);
        let (cpu, on_cpu) = pair.cpu.body_force(&slots).expect("the CPU sums");
        assert_eq!(gpu.len(), 2);
        // The sum, of what each has. What is left over is of the particles beside the surface, whose pressure no solve has changed.
        let mut first = 0;
        for k in 0..2 {
            let rows = first..first + pair.scene.solids[k].wall_slots.len();
            first = rows.end;
            let (sum, size, torques) = of_unknowns(pair, k, &fields, &told[rows.clone()]);
            let (of_cpu, ..) = of_unknowns(pair, k, pair.cpu.fields(), &on_cpu[rows]);
            let (g, c) = (gpu[k], cpu[k]);
            let [beside, beside_cpu] = [g.force - sum.force, c.force - of_cpu.force];
            let [turned, turned_cpu] = [g.torque - sum.torque, c.torque - of_cpu.torque];
            println!("forces of {size:.3} in all, {beside} beside the surface");
            assert!(size > 0.1);
            assert!((beside - beside_cpu).length() < PARTICLE * size, "{beside} {beside_cpu}");
            assert!((turned - turned_cpu).length() < PARTICLE * torques, "{turned} {turned_cpu}");
            let has_any = pair.params.source == Source::Mixed && pair.params.dimensions == 3 && k == 0;
            assert_eq!(beside_cpu.length() > 1e-3 * size, has_any, "{beside_cpu}");
        }
        for (g, c) in gpu.iter().zip(&cpu) {
            println!("force {:.4} torque {:.6}", c.force, c.torque);
            let arm = 0.1;
            assert!(c.force.length() > 0.1 && c.torque.length() > 1e-4);
            // Each with the pressures of its own solve.
            assert!((g.force - c.force).length() < SOLVE * c.force.length().max(1.0));
            assert!((g.torque - c.torque).length() < SOLVE * arm * c.force.length().max(1.0));
        }
    });
}

#[test]
fn monitor() {
    each(|pair| {
        pair.run_all(&LISTS);
        pair.run(Stage::NumberDensity);
        let (g, c) = (pair.gpu.monitor().expect("sums"), pair.cpu.monitor().expect("sums"));
        println!("{g:?}\n{c:?}");
        let near = |a: f64, b: f64, scale: f64| assert!((a - b).abs() < PARTICLE * scale, "{a} {b}");
        assert_eq!((g.particles, g.inner), (c.particles, c.inner));
        assert!(g.kinetic > 1e-3 && g.inner > 20);
        near(g.kinetic, c.kinetic, c.kinetic);
        near(g.potential, c.potential, c.potential);
        let mass = pair.params.particle_mass() * c.particles as f64;
        for k in 0..3 {
            near(g.momentum[k], c.momentum[k], mass * c.speed_max);
            near(g.centroid[k], c.centroid[k], 0.1);
            near(g.extent_max[k], c.extent_max[k], 0.1);
        }
        near(g.speed_max, c.speed_max, c.speed_max);
        assert!(g.speed_max > 0.4);
        near(g.density_error_mean, c.density_error_mean, 1.0);
        near(g.density_error_max, c.density_error_max, 1.0);
        assert_eq!(g.speed_most, c.speed_most);
    });
}

#[test]
fn wall_excess() {
    excess_of_body(0.1, |felt| felt == 1.0);
}

/// It feels of the cut what does not throw it about.
#[test]
fn wall_excess_of_a_light_body() {
    excess_of_body(0.005, |felt| felt > 0.05 && felt < 0.25);
}

fn excess_of_body(mass: f64, feels: impl Fn(f64) -> bool) {
    let lighter = |scene: &mut Scene| {
        let Drive::Free(body) = &mut scene.solids[1].drive else { panic!("the body is free") };
        body.mass = mass;
    };
    each_of(lighter, |pair| {
        let mixed = pair.params.source == Source::Mixed;
        pair.run_all(&LISTS);
        let groups = pair.scene.groups;
        // What a step before has left, as large as pressures are.
        let mut fields = pair.gpu.read().expect("readable");
        let most = fields.pressure.iter().fold(0.0_f64, |most, p| most.max(*p));
        fields
            .inertia_head
            .iter_mut()
            .enumerate()
            .for_each(|(k, head)| *head = 0.1 * most * (k as f64).sin());
        assert_eq!(fields.inertia_head.len(), if mixed { groups.moving_wall } else { 0 });
        pair.gpu.write(&fields).expect("the device can be written");
        pair.sync();
        pair.run_all(&LISTS);
        pair.run_to_source();
        let before = pair.cpu.fields().clone();
        let slots: Vec<usize> = (groups.fluid..groups.pressure()).collect();
        let c = laplacian_coefficient(&pair.params);
        let known = |i: usize, pair: &Pair| {
            let carriers = pair.cpu.neighbours().pressure(i).neighbour;
            let Fields { position, velocity, source, surface_pressure, .. } = &before;
            let on = Particles { params: &pair.params, position, velocity, fluid: groups.fluid };
            kernels::known_excess(i, carriers, on, source[i] / c, surface_pressure)
        };
        pair.gpu.solve_pressure(&pair.step).expect("the device solves");
        pair.cpu.solve_pressure(&pair.step).expect("the CPU solves");
        let [gpu, cpu] = [pair.gpu.wall_pressures(&slots), pair.cpu.wall_pressures(&slots)];
        let (gpu, cpu) = (gpu.expect("readable"), cpu.expect("readable"));
        // Before the cut: beside pressures that were no unknowns stands no solution.
        let mut solution = pair.gpu.solution().expect("readable").expect("kept");
        let left = pair.gpu.read().expect("readable").pressure;
        solution.iter_mut().zip(&left).filter(|(p, _)| **p == 0.0).for_each(|(p, left)| *p = *left);
        let (heads, fields) = (pair.gpu.read().expect("readable").inertia_head, pair.cpu.fields());
        let (position, velocity) = (&fields.position, &fields.velocity);
        let on = Particles { params: &pair.params, position, velocity, fluid: groups.fluid };
        let felt = kernels::cut_share(&pair.scene.solids[1], &pair.params);
        let most = fields.pressure.iter().fold(0.0_f64, |most, p| most.max(*p));
        let (mut largest, mut dry, mut pressed, mut cuts) = (0.0_f64, 0, 0, 0);
        for (k, (&i, (g, c))) in slots.iter().zip(gpu.iter().zip(&cpu)).enumerate() {
            let carriers = pair.cpu.neighbours().pressure(i).neighbour;
            let free = pair.scene.solids.iter().any(|s| s.is_free() && s.wall_slots.contains(&i));
            let wet = fields.state[i] == State::Inner && mixed;
            let found = if wet { kernels::wall_excess(i, carriers, on, &fields.pressure) } else { 0.0 };
            // A free body is pressed with what it answered and a part of the cut, and keeps what the former was wrong by for the next step.
            let (excess, head) = if wet && free {
                let solved = kernels::wall_excess(i, carriers, on, &solution);
                let answered = known(i, pair) + before.inertia_head[k];
                let cut = fields.pressure[i] - solution[i];
                pressed += 1;
                cuts += usize::from((cut - (found - solved)).abs() > 0.01 * most);
                (answered + cut - felt * (cut - (found - solved)), solved - known(i, pair))
            } else {
                assert!((c.excess - found).abs() <= 1e-12 * most, "{i}: {c:?} for {found}");
                (found, 0.0)
            };
            largest = largest.max(excess.abs());
            dry += usize::from(!wet);
            // Each has what its own solve has left.
            assert!((c.excess - excess).abs() <= 2.0 * SOLVE * most, "{i}: {c:?} for {excess}");
            assert!((g.excess - excess).abs() <= 2.0 * SOLVE * most, "{i}: {g:?} for {excess}");
            if let (Some(g), Some(c)) = (heads.get(k), fields.inertia_head.get(k)) {
                assert!((c - head).abs() <= SOLVE * most, "{i}: {c} for {head}");
                assert!((g - head).abs() <= SOLVE * most, "{i}: {g} for {head}");
            }
        }
        assert!(feels(felt), "{felt}");
        println!("{pressed} rows of a body that feels {felt:.3} of a cut, {cuts} with one");
        assert!(
            !mixed || largest > 0.01 * most && dry > 0 && pressed > 0,
            "{largest} {most} {dry} {pressed}"
        );
    });
}

#[test]
fn pressures_of_single_slots() {
    let Some(mut pair) = Pair::new(3, "preset = \"accurate\"") else { return };
    let groups = pair.scene.groups;
    let slots: Vec<usize> = (groups.fluid..groups.pressure()).step_by(7).collect();
    let all = pair.gpu.read().expect("readable").pressure;
    let some = pair.gpu.wall_pressures(&slots).expect("readable");
    assert!(some.iter().any(|p| p.pressure > 0.0));
    assert!(some.iter().zip(&slots).all(|(p, &s)| p.pressure == all[s]));
}

#[test]
fn a_collapsed_neighbourhood_is_reported() {
    let Some(mut pair) = Pair::new(3, "preset = \"accurate\"") else { return };
    let mut fields = pair.gpu.read().expect("readable");
    // More than a row of this lattice holds, by half.
    let (at, n) = (fields.position[40], 96);
    for i in 40..40 + n {
        fields.position[i] = at + 0.2 * pair.params.spacing * common::noise_vector(i, 3);
    }
    pair.gpu.write(&fields).expect("writable");
    pair.sync();
    pair.run_all(&LISTS);
    let seen = pair.gpu.counters().expect("readable");
    let (slot, neighbours) = seen.overflow.expect("an overflow is seen");
    // The CPU has the same limit and says the same.
    assert_eq!(pair.cpu.counters().expect("readable").overflow, seen.overflow);
    assert!(
        (slot as usize) < pair.scene.groups.pressure() && neighbours as usize >= n - 1,
        "{slot} {neighbours}"
    );
}

/// Some whole steps on a new device; the bytes of what they leave.
fn bytes(scheme: &str, preconditioner: Preconditioner) -> Vec<u64> {
    let mut pair = Pair::of_size(3, scheme, 1, preconditioner).expect("asked for only with a device");
    for _ in 0..4 {
        for stage in Stage::ALL {
            let (gpu, step) = (&mut pair.gpu, &pair.step);
            let done = match (stage, stage.over_particles()) {
                _ if !pair.plan.has(stage) => Ok(()),
                (_, Some(stage)) => gpu.run(stage, step),
                (Stage::MoveSolids, _) => gpu.move_solids(&pair.poses),
                (Stage::ConjugateGradient, _) => gpu.solve_pressure(step).map(|_| ()),
                (Stage::BodyForce, _) => gpu.body_force(&[]).map(|_| ()),
                _ => Ok(()),
            };
            done.expect("the step runs");
        }
    }
    let f = pair.gpu.read().expect("readable");
    let numbers = [flat(&f.position), flat(&f.velocity), f.pressure, f.number_density].concat();
    numbers.iter().map(|x| x.to_bits()).chain(f.id.iter().map(|&i| u64::from(i))).collect()
}

#[test]
fn two_runs_give_the_same_bytes() {
    if device() {
        let scheme = "preset = \"accurate\"";
        for preconditioner in [Preconditioner::Jacobi, Preconditioner::Multigrid] {
            let first = bytes(scheme, preconditioner);
            assert!(first == bytes(scheme, preconditioner), "two runs differ ({preconditioner:?})");
        }
    }
}

#[test]
fn every_stage_has_a_test() {
    let text = [include_str!("twins.rs"), include_str!("contact_device.rs")].concat();
    // The ledger's is in ledger.rs, that of borders in ranks_gpu.rs.
    let elsewhere = |name: &&str| ["ledger", "halo"].contains(name);
    for name in gpu::kernels::programs().map(|p| p.name).filter(|n| !elsewhere(n)) {
        assert!(text.contains(&format!("#[test]\nfn {name}()")), "no test is called {name}");
    }
}
