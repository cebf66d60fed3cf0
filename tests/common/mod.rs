//! Scenes for the tests, written as a user would write them.

pub mod dry;
pub mod moving;

use glam::DVec3;
use seixo::backend::{Processor, gpu};
use seixo::case::Case;
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use std::sync::Arc;

/// The repository.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// What has the program compute on one thread where it is not told `--threads`, as [`alone`] does a test.
pub const ONE_THREAD: (&str, &str) = ("RAYON_NUM_THREADS", "1");

/// The program, which heeds every signal: whoever runs the tests may ignore some (`nohup` does), and a child inherits
/// that.
pub fn program() -> std::process::Command {
    let program = env!("CARGO_BIN_EXE_seixo");
    let mut command = if cfg!(target_os = "linux") {
        let mut command = std::process::Command::new("env");
        command.args(["--default-signal=HUP,INT,TERM,USR1,XCPU", program]);
        command
    } else {
        std::process::Command::new(program)
    };
    command.env(ONE_THREAD.0, ONE_THREAD.1);
    command
}

thread_local! {
    static ALONE: () = {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
        // on a thread of a pool that a test has made, it stays with that
        drop(pool);
    };
}

/// From here on the test computes on its own thread: tests stand side by side on all cores, and small scenes spend as much on handing
/// work to others as on the work. That threads change no bit has tests of its own.
pub fn alone() {
    ALONE.with(|()| ());
}

/// Whether there is a device to test; loud if not, and a failure where one is expected: `untested` is what is left out.
pub fn there_is_a_device(untested: &str) -> bool {
    let there = !gpu::adapters().is_empty();
    if !there {
        assert!(std::env::var_os("CI").is_none(), "NO GPU ADAPTER: {untested}");
        eprintln!("SKIPPED, NO GPU ADAPTER: {untested}");
    }
    there
}

/// Mean of `values`, and their standard deviation.
pub fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt())
}

/// The CPU, and a device if there is one; loud if not, as [`there_is_a_device`].
pub fn processors(untested: &str) -> Vec<Processor> {
    let device = there_is_a_device(untested).then_some(Processor::Gpu { adapter: None });
    [Processor::Cpu].into_iter().chain(device).collect()
}

/// The same by the names that the program has for them.
pub fn backends(untested: &str) -> impl Iterator<Item = &'static str> {
    ["cpu"].into_iter().chain(there_is_a_device(untested).then_some("gpu"))
}

pub fn case(text: &str) -> Case {
    alone();
    toml::from_str(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

pub fn simulation(case: &Case) -> Simulation {
    cpu_simulation(case, Scene::build(case).expect("the scene builds"))
}

/// Means over the steps after `from` until `to` [s] of what `of` tells after each.
pub fn mean_over<const N: usize>(
    simulation: &mut Simulation,
    [from, to]: [f64; 2],
    mut of: impl FnMut(&mut Simulation) -> [f64; N],
) -> [f64; N] {
    let (mut sums, mut count) = ([0.0; N], 0.0);
    while simulation.time < to {
        simulation.step().unwrap_or_else(|e| panic!("{e}"));
        if simulation.time > from {
            sums.iter_mut().zip(of(simulation)).for_each(|(sum, now)| *sum += now);
            count += 1.0;
        }
    }
    sums.map(|sum| sum / count)
}

/// The sum of what the gauges tell now whose columns begin with one of `names` each, see [`mean_over`].
pub fn gauges<const N: usize>(simulation: &mut Simulation, names: [&str; N]) -> [f64; N] {
    let read = simulation.gauges().expect("gauges");
    names.map(|name| {
        let of: Vec<f64> =
            read.iter().filter(|gauge| gauge.0.starts_with(name)).map(|gauge| gauge.1).collect();
        assert!(!of.is_empty(), "no gauge `{name}`");
        of.iter().sum()
    })
}

pub fn cpu_simulation(case: &Case, scene: impl Into<Arc<Scene>>) -> Simulation {
    alone();
    Simulation::on(case, scene, &Processor::Cpu).expect("the simulation starts")
}

/// Water in a square of L = 1 m with `cells` spacings a side and no side that is not periodic, of kinematic viscosity 0.01 m2/s, that begins
/// with a velocity of its place, run to t = 0.5 s; with the rate at which its kinetic energy decayed from the third step on [1/s].
pub fn stirred_square(
    cells: usize,
    processor: &Processor,
    velocity: impl Fn(DVec3) -> DVec3,
) -> (Simulation, f64) {
    let l0 = 1.0 / cells as f64;
    let case = case(&format!(
        "[run]\nspacing = {l0}\ntime_step = {}\nend = 1.0\ngravity = [0, 0, 0]\ndimensions = 2\n\
         [fluid]\nviscosity = 0.01\nsound_speed = 5\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0, 1]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1, 0, 1]\nperiodic = [\"x\", \"z\"]\n",
        0.1 * l0
    ));
    let scene = Scene::build(&case).expect("it builds");
    let mut sim = Simulation::on(&case, scene, processor).expect("it starts");
    let mut fields = sim.backend.read().expect("the fields");
    for (v, x) in fields.velocity.iter_mut().zip(&fields.position) {
        *v = velocity(*x);
    }
    sim.backend.write(&fields).expect("written");
    let mut energy = Vec::new();
    while sim.time < 0.5 {
        sim.step().expect("a step");
        energy.push((sim.time, sim.backend.monitor().expect("measured").kinetic));
    }
    let (first, last) = (energy[2], energy[energy.len() - 1]);
    let rate = (first.1 / last.1).ln() / (last.0 - first.0);
    (sim, rate)
}

/// Still water 0.25 x 0.25 x `depth` m in a tank 0.2 m higher.
pub fn hydrostatic(spacing: f64, dt: f64, fluid: &str) -> Case {
    hydrostatic_of_depth(0.5, spacing, dt, fluid)
}

pub fn hydrostatic_of_depth(depth: f64, spacing: f64, dt: f64, fluid: &str) -> Case {
    let top = depth + 0.2;
    case(&format!(
        "[run]\nspacing = {spacing}\ntime_step = {dt}\nend = 3.0\ngravity = [0, 0, -9.81]\n\
         [fluid]\n{fluid}\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.25, 0.25, {depth}]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.25, 0.25, {top}]\nopen = [\"z_max\"]\n"
    ))
}

/// The tank of the paper's section 4.3 without gate and solid.
pub fn dam_break(spacing: f64, dt: f64, fluid: &str) -> Case {
    case(&format!(
        "[run]\nspacing = {spacing}\ntime_step = {dt}\nend = 1.0\ngravity = [0, 0, -9.81]\n\
         [fluid]\n{fluid}\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.5, 0.5, 0.35]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [3.5, 0.5, 0.5]\nopen = [\"z_max\"]\n\
         [[obstacle]]\nname = \"first\"\nmin = [2.5, 0.06, 0]\nmax = [2.65, 0.21, 0.5]\nopen = [\"z_max\"]\n\
         [[obstacle]]\nname = \"second\"\nmin = [2.95, 0.29, 0]\nmax = [3.1, 0.44, 0.5]\nopen = [\"z_max\"]\n"
    ))
}
