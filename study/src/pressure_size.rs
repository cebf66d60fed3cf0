//! The pressure equation against the number of its unknowns: iterations and time of both preconditioners, and the
//! residual that single precision can reach, on systems that a run met after its first steps.

use super::Study;
use super::definition::Setup;
use super::engine::{Context, Job, Processor};
use super::pressure_solve::{TIGHT, true_residual};
use super::report::{Report, short};
use super::row::{Measured, Row, Timing, Work};
use super::run_point::products;
use super::work_precision::machines;
use crate::plot::{Axis, COLORS, Chart, Mark, Series, Stroke};
use seixo::backend::Backend;
use seixo::backend::cpu::Cpu;
use seixo::body::Pose;
use seixo::case::file::parse;
use seixo::cells::Grid;
use seixo::error::{Error, Result};
use seixo::fields::{Fields, State};
use seixo::kernels::pressure_source::laplacian_coefficient;
use seixo::params::{Params, Step};
use seixo::plan::{ParticleStage, Plan};
use seixo::pressure::Settings;
use seixo::pressure::cg::{Jacobi, Precondition, System, Workspace, solve};
use seixo::pressure::multigrid::Multigrid;
use seixo::scene::Scene;
use seixo::scheme::Preconditioner;
use seixo::simulation::Simulation;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

const DAM: &str = seixo_cases::DAM_BREAK_TRANSPORT;
const COLUMN: &str = seixo_cases::HYDROSTATIC;

/// Steps that a run has behind it when it meets the system.
const STEPS: u64 = 20;
/// Recursive residual to which a solve in f32 goes on while its true residual has long stopped falling.
const STAGNANT: f64 = 1e-8;
/// Slots of the solver up to which a solve is timed four times instead of twice.
const LARGE: usize = 1_000_000;

/// A scene: name, text, spacing [m].
type Size = (&'static str, &'static str, f64);

/// What a run holds at the start of a step.
struct Moment {
    scene: Arc<Scene>,
    params: Params,
    plan: Plan,
    step: Step,
    poses: Vec<Pose>,
    fields: Fields,
}

impl Moment {
    fn new((name, text, spacing): Size) -> Result<Self> {
        let sets = [format!("run.spacing={spacing:?}"), "run.adaptive=true".into()];
        let (case, _, _) = parse(name, text.to_owned(), &sets)?;
        let mut simulation = Simulation::on(&case, Scene::build(&case)?, &seixo::Processor::Cpu)?;
        for _ in 0..STEPS {
            simulation.step()?;
        }
        let step = simulation.next_step();
        let gravity = simulation.params.explicit_gravity();
        let contact = !simulation.plan.coupled;
        let poses = simulation.solids.predict(step.time, step.dt, step.ahead, gravity, contact).to_vec();
        let fields = simulation.backend.read()?;
        let Simulation { params, plan, scene, .. } = simulation;
        Ok(Self { params, plan, step, poses, fields, scene })
    }

    /// `backend`, stopped before the solve. Collisions are left out: the lists stay those of the positions.
    fn prepare(&self, backend: &mut dyn Backend) -> Result<()> {
        backend.write(&self.fields)?;
        backend.run(ParticleStage::Predict, &self.step)?;
        backend.move_solids(&self.poses)?;
        for stage in ParticleStage::TO_SOURCE {
            backend.run(stage, &self.step)?;
        }
        Ok(())
    }

    fn cpu(&self) -> Result<Cpu> {
        Cpu::new(&self.scene, &self.params, &self.plan, TIGHT)
    }
}

type Kept = Option<(Size, Arc<Moment>)>;

/// The moment of the size asked for last: jobs come in the order of their sizes.
#[derive(Clone, Default)]
struct Last(Arc<Mutex<Kept>>);

impl Last {
    fn of(&self, size: Size) -> Result<Arc<Moment>> {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, moment)) = last.as_ref().filter(|(s, _)| *s == size) {
            return Ok(moment.clone());
        }
        *last = None;
        let moment = Arc::new(Moment::new(size)?);
        *last = Some((size, moment.clone()));
        Ok(moment)
    }
}

fn kind_name(kind: Preconditioner) -> &'static str {
    if kind == Preconditioner::Multigrid { "multigrid" } else { "Jacobi" }
}

fn on_cpu(moment: &Moment, kind: Preconditioner, tolerance: f64) -> Result<Measured> {
    let mut cpu = moment.cpu()?;
    moment.prepare(&mut cpu)?;
    let fields = cpu.fields();
    let system = System {
        neighbours: cpu.neighbours(),
        state: &fields.state,
        diagonal: &fields.diagonal,
        coefficient: laplacian_coefficient(&moment.params),
        bodies: &[],
        among: None,
    };
    let (b, settings) = (&fields.source, Settings { tolerance, ..TIGHT });
    let (grid, mut multigrid) = (Grid::new(&moment.params)?, Multigrid::default());
    let (mut x, mut workspace) = (vec![0.0; b.len()], Workspace::default());
    let (mut times, mut builds, mut solves) = (Vec::new(), Vec::new(), Vec::new());
    let mut report = Default::default();
    // The first one allocates.
    let repetitions = if fields.state.len() > LARGE { 2 } else { 4 };
    for _ in 0..repetitions {
        let clock = Instant::now();
        let preconditioner: &mut dyn Precondition = if kind == Preconditioner::Multigrid {
            multigrid.build(&system, &grid, &fields.position);
            &mut multigrid
        } else {
            &mut Jacobi
        };
        builds.push(clock.elapsed().as_secs_f64());
        report = solve(&system, b, &mut x, preconditioner, &settings, &mut workspace);
        times.push(clock.elapsed().as_secs_f64());
        solves.push(times[times.len() - 1] - builds[builds.len() - 1]);
    }
    let mut out = Measured { machine: format!("{}, f64", cpu.description()), ..Measured::default() };
    out.timing = Timing::of(times);
    let iterations = f64::from(report.iterations);
    let shortest = |v: &[f64]| v.iter().copied().fold(f64::INFINITY, f64::min);
    describe(&mut out, moment, report.unknowns, kind, report.iterations);
    out.put("residual of the recursion [-]", report.residual);
    out.put("true residual [-]", true_residual(&system, b, &x));
    out.put("iteration [s]", shortest(&solves) / iterations.max(1.0));
    if kind == Preconditioner::Multigrid {
        out.put("levels [s]", shortest(&builds));
        out.put("levels over iteration [-]", shortest(&builds) / shortest(&solves) * iterations);
    }
    Ok(out)
}

fn describe(out: &mut Measured, moment: &Moment, unknowns: usize, kind: Preconditioner, iterations: u32) {
    let particles = moment.scene.groups.total() as u64;
    let products = products(kind, iterations);
    out.work =
        Work { particles, steps: 1, particle_steps: particles, iterations: u64::from(iterations), products };
    out.put("unknowns [-]", unknowns as f64);
    out.put("iterations [-]", f64::from(iterations));
    out.put("compressibility [1/Pa]", moment.step.compressibility);
}

fn on_device(moment: &Moment, kind: Preconditioner, tolerance: f64, context: &Context) -> Result<Measured> {
    let settings = Settings { tolerance, max_iterations: 1000, warm_start: false };
    let plan = Plan { preconditioner: kind, ..moment.plan.clone() };
    let mut gpu = (context.make)(Processor::Gpu, &moment.scene, &moment.params, &plan, settings)?;
    let mut out =
        Measured { machine: format!("{}, {}", gpu.description(), gpu.precision()), ..Measured::default() };
    moment.prepare(gpu.as_mut())?;
    let system = gpu.read()?;
    let clock = Instant::now();
    let report = gpu.solve_pressure(&moment.step)?;
    out.timing = Timing::of(vec![clock.elapsed().as_secs_f64()]);
    let x = gpu.solution()?;
    let x = x.ok_or_else(|| Error::gpu("the device keeps no solution before the bounds"))?;
    describe(&mut out, moment, report.unknowns, kind, report.iterations);
    out.put("true residual in f32 [-]", report.residual);
    out.put("true residual [-]", residual_in_double(moment, &system, &x)?);
    Ok(out)
}

/// ||b - A x|| / ||b|| with the device's positions, b and diagonal, in f64.
fn residual_in_double(moment: &Moment, device: &Fields, x: &[f64]) -> Result<f64> {
    let mut cpu = moment.cpu()?;
    cpu.write(device)?;
    for stage in [ParticleStage::CellList, ParticleStage::NeighbourList, ParticleStage::NumberDensity] {
        cpu.run(stage, &moment.step)?;
    }
    // Particles on a border of cells may have been sorted to the other side.
    let slot: HashMap<u32, usize> = device.id.iter().enumerate().map(|(i, &id)| (id, i)).collect();
    let fluid = device.id.len();
    let from = |i: usize| if i < fluid { slot[&cpu.fields().id[i]] } else { i };
    let from: Vec<usize> = (0..x.len()).map(from).collect();
    let pick = |v: &[f64]| from.iter().map(|&i| v[i]).collect::<Vec<f64>>();
    let (b, x, diagonal) = (pick(&device.source), pick(x), pick(&device.diagonal));
    let state: Vec<State> = from.iter().map(|&i| device.state[i]).collect();
    let system = System {
        neighbours: cpu.neighbours(),
        state: &state,
        diagonal: &diagonal,
        coefficient: laplacian_coefficient(&moment.params),
        bodies: &[],
        among: None,
    };
    Ok(true_residual(&system, &b, &x))
}

fn finish(rows: &mut [Row], _: Option<f64>) -> Result<Report> {
    let mut report = Report::default();
    let mut methods: Vec<&str> = Vec::new();
    for row in rows.iter() {
        if !methods.contains(&row.method.as_str()) {
            methods.push(&row.method);
        }
    }
    let line = |method: &str, value: &dyn Fn(&Row) -> Option<f64>| {
        let own = rows.iter().filter(|r| r.method == method);
        let mut points: Vec<[f64; 2]> =
            own.filter_map(|r| Some([r.measured.value("unknowns [-]")?, value(r)?])).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        points
    };
    let chart = |title: &str, label: &str, cpu: bool, value: &dyn Fn(&Row) -> Option<f64>| {
        let own = methods.iter().filter(|m| m.contains("f64") == cpu).enumerate();
        let series = own.map(|(k, method)| {
            let mut series =
                Series::line(method, COLORS[k % COLORS.len()], Stroke::Solid, line(method, value));
            series.mark = Some((Mark::Circle, 4.5));
            series
        });
        let series: Vec<Series> = series.filter(|s| !s.points.is_empty()).collect();
        let of: Vec<Row> = rows.iter().filter(|r| r.method.contains("f64") == cpu).cloned().collect();
        let chart = Chart {
            title: title.into(),
            subtitle: machines(&of),
            x: Axis::log("unknowns [-]"),
            y: Axis::log(label),
            series,
        };
        (!chart.series.is_empty()).then_some(chart)
    };
    let charts = [
        (
            "iterations",
            chart("Iterations from zero", "iterations [-]", true, &|r| r.measured.value("iterations [-]")),
        ),
        (
            "time",
            chart("Time of a solve", "wall time [s]", true, &|r| r.measured.timing.map(|t| t.shortest_s)),
        ),
        (
            "single",
            chart("What f32 reaches", "true residual [-]", false, &|r| r.measured.value("true residual [-]")),
        ),
    ];
    report.charts = charts
        .into_iter()
        .filter_map(|(name, chart)| Some((format!("pressure-size-{name}"), chart?)))
        .collect();
    report.findings = rows.iter().filter_map(words).collect();
    Ok(report)
}

/// A row in words.
fn words(row: &Row) -> Option<String> {
    let m = &row.measured;
    let (unknowns, iterations) = (m.value("unknowns [-]")?, m.value("iterations [-]")?);
    let time = m.timing.map_or_else(String::new, |t| format!(", {} s", short(t.shortest_s)));
    let levels = m.value("levels over iteration [-]");
    let levels = levels.map_or_else(String::new, |l| format!("; the levels cost {} iterations", short(l)));
    Some(format!(
        "{} unknowns, {}: {iterations} iterations{time}, true residual {}{levels}",
        unknowns,
        row.method,
        short(m.value("true residual [-]")?)
    ))
}

/// The study.
pub fn study(setup: &Setup) -> Study {
    let dam = |l0| ("dam break", DAM, l0);
    let mut sizes: Vec<Size> = vec![dam(0.03), dam(0.02), dam(0.015), dam(0.0075)];
    if setup.full {
        // Two million unknowns.
        sizes.push(("water column", COLUMN, 0.0025));
    }
    let last = Last::default();
    let mut jobs = Vec::new();
    for size in sizes {
        let (scene, _, spacing) = size;
        let parameters = [("scene", scene.to_string()), ("spacing", format!("{spacing}"))];
        for kind in [Preconditioner::Jacobi, Preconditioner::Multigrid] {
            for tolerance in [1e-3, 1e-6] {
                let (last, name) = (last.clone(), format!("{}, f64, to {tolerance:e}", kind_name(kind)));
                jobs.push(Job::new(&name, &parameters, spacing.powi(-4), move |_| {
                    on_cpu(&*last.of(size)?, kind, tolerance)
                }));
            }
            let last = last.clone();
            let name = format!("{} on the GPU, f32, until it stagnates", kind_name(kind));
            jobs.push(Job::new(&name, &parameters, 4.0 * spacing.powi(-4), move |context| {
                on_device(&*last.of(size)?, kind, STAGNANT, context)
            }));
        }
    }
    Study {
        name: "pressure-size".into(),
        title: "The pressure equation against its size".into(),
        question: format!(
            "Iterations and time from zero on the system that section 4.3's dam break meets after {STEPS} steps, with its \
             own compressibility, over the spacing; the multigrid's levels are in its time. On a GPU: the true residual, \
             computed in f64, of a solve whose recursion was followed to {STAGNANT:e}."
        ),
        jobs,
        finish: Box::new(finish),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::cpu_only;
    use seixo::backend::gpu::{Gpu, adapters};

    const SMALL: Size = ("water column", COLUMN, 0.025);

    #[test]
    fn both_preconditioners_meet_the_tolerance_and_one_is_quicker() {
        let moment = Moment::new(SMALL).unwrap();
        let of = |kind| {
            let measured = on_cpu(&moment, kind, 1e-6).unwrap();
            assert!(measured.value("true residual [-]").unwrap() < 2e-6, "{measured:?}");
            measured.value("iterations [-]").unwrap()
        };
        assert!(of(Preconditioner::Jacobi) > 3.0 * of(Preconditioner::Multigrid));
    }

    #[test]
    fn single_precision_stagnates_above_what_it_claims_and_a_wrong_order_would_show() {
        let moment = Moment::new(SMALL).unwrap();
        let make: &crate::engine::Make = &|_, s, p, plan, settings| {
            Ok(Box::new(Gpu::new(s, p, plan, settings, None)?) as Box<dyn Backend>)
        };
        let none = Context::new(&cpu_only);
        assert!(matches!(on_device(&moment, Preconditioner::Jacobi, STAGNANT, &none), Err(Error::Gpu(_))));
        if adapters().is_empty() {
            assert!(std::env::var_os("CI").is_none(), "NO GPU ADAPTER: single precision is not tested");
            return;
        }
        let context = Context::new(make);
        for kind in [Preconditioner::Jacobi, Preconditioner::Multigrid] {
            let measured = on_device(&moment, kind, STAGNANT, &context).unwrap();
            let (double, single) = ("true residual [-]", "true residual in f32 [-]");
            let [double, single] = [double, single].map(|name| measured.value(name).unwrap());
            println!("{kind:?}: true residual {double:e} in f64, {single:e} in f32");
            assert!(double > 10.0 * STAGNANT && double < 1e-4, "{double:e}");
            assert!(single / double < 10.0 && double / single < 10.0);
        }
    }
}
