//! The pressure equation alone, on one state of a water column: residual and pressure error against iterations,
//! matrix products and time, for every solver and precision.

use super::Study;
use super::definition::Setup;
use super::engine::{Context, Job, Processor};
use super::report::{Report, short};
use super::row::{Measured, Row, Timing, Work};
use super::run_point::products;
use super::single::Matrix;
use super::work_precision::{Cost, chart, machines, words};
use crate::plot::{Axis, COLORS, Chart, Mark, Series, Stroke};
use glam::DVec3;
use seixo::backend::Backend;
use seixo::backend::cpu::Cpu;
use seixo::case::file::parse;
use seixo::error::Result;
use seixo::kernels::pressure_source::laplacian_coefficient;
use seixo::params::{Params, Step};
use seixo::plan::{ParticleStage, Plan};
use seixo::pressure::Settings;
use seixo::pressure::cg::{Jacobi, Precondition, System, Workspace, dot, solve};
use seixo::pressure::multigrid::Multigrid;
use seixo::scene::Scene;
use seixo::scheme::Preconditioner;
use std::time::Instant;

/// How the equation is solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Method {
    /// Jacobi, f64.
    Jacobi,
    /// Multigrid whose cycle computes in f32, inside conjugate gradients in f64.
    Multigrid,
    /// Jacobi, all vectors and the matrix in f32.
    Single,
    /// The GPU path.
    Device,
}

impl Method {
    const ALL: [Self; 4] = [Self::Jacobi, Self::Multigrid, Self::Single, Self::Device];

    fn name(self) -> &'static str {
        match self {
            Self::Jacobi => "Jacobi, f64",
            Self::Multigrid => "multigrid (f32 inside), f64",
            Self::Single => "Jacobi, f32 emulated",
            Self::Device => "GPU, f32",
        }
    }
}

/// Repetitions of a solve for its time.
const REPETITIONS: u32 = 5;

/// A column of water, its particles moved by up to `shake` spacings from the lattice: what the solver meets once
/// the lattice has melted.
pub(super) struct Column {
    pub(super) scene: Scene,
    pub(super) params: Params,
    pub(super) plan: Plan,
    pub(super) step: Step,
}

impl Column {
    /// Of the case `text` with overrides.
    pub(super) fn new(text: &str, sets: &[String], shake: f64) -> Result<Self> {
        let (case, _, _) = parse("column", text.to_owned(), sets)?;
        let mut scene = Scene::build(&case)?;
        let mut seed = 1_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 40) as f64 / f64::from(1_u32 << 23) - 1.0
        };
        for i in 0..scene.groups.fluid {
            let mut r =
                || DVec3::new(random(), if case.run.dimensions == 2 { 0.0 } else { random() }, random());
            scene.position[i] += shake * scene.spacing * r();
            scene.velocity[i] += 0.1 * r();
        }
        let params = Params::new(&case, &scene)?;
        let plan = Plan::new(&case, &scene, &params);
        let step = params.step(0.0, case.run.time_step, 1.0);
        Ok(Self { scene, params, plan, step })
    }

    /// `backend`, stopped before the solve.
    pub(super) fn prepare(&self, backend: &mut dyn Backend) -> Result<()> {
        for stage in ParticleStage::TO_SOURCE {
            backend.run(stage, &self.step)?;
        }
        Ok(())
    }

    /// The CPU, stopped before the solve.
    pub(super) fn cpu(&self) -> Result<Cpu> {
        let mut cpu = Cpu::new(&self.scene, &self.params, &self.plan, TIGHT)?;
        self.prepare(&mut cpu)?;
        Ok(cpu)
    }

    /// The system that `cpu` holds.
    pub(super) fn system<'a>(&self, cpu: &'a Cpu) -> System<'a> {
        System {
            neighbours: cpu.neighbours(),
            state: &cpu.fields().state,
            diagonal: &cpu.fields().diagonal,
            coefficient: laplacian_coefficient(&self.params),
            bodies: &[],
            among: None,
        }
    }
}

/// As good as f64 gets.
pub(super) const TIGHT: Settings = Settings { tolerance: 1e-13, max_iterations: 5000, warm_start: false };

/// ||b - A x|| / ||b||, computed anew.
pub(super) fn true_residual(system: &System, b: &[f64], x: &[f64]) -> f64 {
    let (mut q, mut sums) = (vec![0.0; b.len()], Vec::new());
    system.multiply(x, &mut q, &mut sums);
    q.iter_mut().zip(b).for_each(|(q, b)| *q = b - *q);
    (dot(&q, &q, &mut sums) / dot(b, b, &mut sums)).sqrt()
}

fn relative(a: &[f64], b: &[f64]) -> f64 {
    let difference: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (difference / b.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

const CASE: &str = seixo_cases::HYDROSTATIC;

fn sets(spacing: f64, method: Method, tolerance: f64) -> Vec<String> {
    let preconditioner = if method == Method::Multigrid { "multigrid" } else { "jacobi" };
    vec![
        format!("run.spacing={spacing:?}"),
        format!("run.time_step={:?}", 0.04 * spacing),
        format!("fluid.solver.tolerance={tolerance:?}"),
        "fluid.solver.warm_start=false".into(),
        // On the device the choice is its own.
        format!(
            "fluid.solver.preconditioner={}",
            if method == Method::Device { "auto" } else { preconditioner }
        ),
    ]
}

fn measure(spacing: f64, method: Method, tolerance: f64, context: &Context) -> Result<Measured> {
    let column = Column::new(CASE, &sets(spacing, method, tolerance), 0.1)?;
    let cpu = column.cpu()?;
    let (system, b) = (column.system(&cpu), &cpu.fields().source);
    let n = b.len();
    let mut exact = vec![0.0; n];
    solve(&system, b, &mut exact, &mut Jacobi, &TIGHT, &mut Workspace::default());
    let settings = Settings { tolerance, ..TIGHT };
    let mut out = Measured { machine: format!("{}, f64", cpu.description()), ..Measured::default() };
    let (mut x, mut times, mut iterations, mut claimed) = (vec![0.0; n], Vec::new(), 0, 0.0);
    let mut workspace = Workspace::default();
    let (grid, mut multigrid) = (seixo::cells::Grid::new(&column.params)?, Multigrid::default());
    if method == Method::Device {
        return device(&column, &cpu, &exact, tolerance, context);
    }
    let matrix = (method == Method::Single).then(|| Matrix::new(&system));
    for repetition in 0..=REPETITIONS {
        let clock = Instant::now();
        if let Some(matrix) = &matrix {
            (x, iterations, claimed) = matrix.solve(b, tolerance, TIGHT.max_iterations);
        } else {
            let preconditioner: &mut dyn Precondition = if method == Method::Multigrid {
                multigrid.build(&system, &grid, &cpu.fields().position);
                &mut multigrid
            } else {
                &mut Jacobi
            };
            let report = solve(&system, b, &mut x, preconditioner, &settings, &mut workspace);
            (iterations, claimed) = (report.iterations, report.residual);
        }
        // The first one warms up.
        if repetition > 0 {
            times.push(clock.elapsed().as_secs_f64());
        }
    }
    if method == Method::Single {
        out.machine = "CPU, 1 thread, f32".into();
    }
    let unknowns = system.state.iter().filter(|s| **s == seixo::fields::State::Inner).count();
    let kind = if method == Method::Multigrid { Preconditioner::Multigrid } else { Preconditioner::Jacobi };
    out.timing = Timing::of(times);
    out.work = Work {
        particles: column.scene.groups.total() as u64,
        steps: 1,
        particle_steps: column.scene.groups.total() as u64,
        iterations: u64::from(iterations),
        products: products(kind, iterations),
    };
    let residual = true_residual(&system, b, &x);
    out.put("unknowns [-]", unknowns as f64);
    out.put("iterations [-]", f64::from(iterations));
    out.put("residual of the recursion [-]", claimed);
    out.put("true residual [-]", residual);
    out.put("pressure error [-]", relative(&x, &exact));
    if residual > 2.0 * tolerance {
        out.degrade(&format!("the true residual stays at {}", short(residual)));
    }
    Ok(out)
}

/// A point of the tolerance maps.
pub(super) fn point(spacing: f64, single: bool, tolerance: f64, context: &Context) -> Result<Measured> {
    let method = if single { Method::Single } else { Method::Jacobi };
    let mut out = measure(spacing, method, tolerance, context)?;
    // What is asked here is whether the tolerance is met, not how fast.
    out.timing = None;
    Ok(out)
}

/// The same on the device. It keeps pressures of zero or more, so that the reference is cut there, too.
fn device(column: &Column, cpu: &Cpu, exact: &[f64], tolerance: f64, context: &Context) -> Result<Measured> {
    let (case, params) = (&column.scene, &column.params);
    let settings = Settings { tolerance, ..TIGHT };
    let mut gpu = (context.make)(Processor::Gpu, case, params, &column.plan, settings)?;
    let mut out =
        Measured { machine: format!("{}, {}", gpu.description(), gpu.precision()), ..Measured::default() };
    let (mut times, mut report) = (Vec::new(), Default::default());
    for repetition in 0..=REPETITIONS {
        column.prepare(gpu.as_mut())?;
        gpu.wait()?;
        let clock = Instant::now();
        report = gpu.solve_pressure(&column.step)?;
        gpu.wait()?;
        if repetition > 0 {
            times.push(clock.elapsed().as_secs_f64());
        }
    }
    let fields = gpu.read()?;
    let by_id = |ids: &[u32], p: &[f64]| {
        let mut out: Vec<(u32, f64)> = ids.iter().copied().zip(p.iter().copied()).collect();
        out.sort_by_key(|p| p.0);
        out.into_iter().map(|p| p.1.max(0.0)).collect::<Vec<f64>>()
    };
    let (mine, its) = (by_id(&fields.id, &fields.pressure), by_id(&cpu.fields().id, exact));
    out.timing = Timing::of(times);
    out.work = Work {
        particles: column.scene.groups.total() as u64,
        steps: 1,
        particle_steps: column.scene.groups.total() as u64,
        iterations: u64::from(report.iterations),
        products: products(column.plan.preconditioner, report.iterations),
    };
    out.put("unknowns [-]", report.unknowns as f64);
    out.put("iterations [-]", f64::from(report.iterations));
    out.put("residual of the recursion [-]", report.residual);
    out.put("pressure error [-]", relative(&mine, &its));
    Ok(out)
}

fn finish(rows: &mut [Row], wanted: Option<f64>) -> Result<Report> {
    let mut report = Report::default();
    let error = "pressure error [-]";
    let mut spacings: Vec<String> =
        rows.iter().filter_map(|r| r.parameters.get("spacing").cloned()).collect();
    spacings.dedup();
    spacings.sort();
    spacings.dedup();
    for spacing in spacings.iter().rev() {
        let own: Vec<Row> =
            rows.iter().filter(|r| r.parameters.get("spacing") == Some(spacing)).cloned().collect();
        let unknowns = own.iter().find_map(|r| r.measured.value("unknowns [-]")).unwrap_or(0.0);
        let title = format!("Pressure equation, {} unknowns", short(unknowns));
        for (cost, what) in [(Cost::WallTime, "time"), (Cost::Products, "products")] {
            report.charts.extend(
                chart(&title, &own, error, cost).map(|c| (format!("pressure-solve-{spacing}-{what}"), c)),
            );
        }
        report.charts.push((format!("pressure-solve-{spacing}-residual"), residuals(&title, &own)));
        report.findings.push(format!("{title}. {}", words(&own, error, wanted.unwrap_or(1e-3))));
        let floor = own.iter().filter(|r| r.method == Method::Single.name());
        if let Some(floor) = floor.filter_map(|r| r.measured.value("true residual [-]")).reduce(f64::min) {
            report.findings.push(format!(
                "{title}: with matrix and vectors in f32 the true residual gets no smaller than {}, whatever the \
                 recursion says.",
                short(floor)
            ));
        }
    }
    Ok(report)
}

/// True residual against iterations.
fn residuals(title: &str, rows: &[Row]) -> Chart {
    let mut series = Vec::new();
    for (k, method) in Method::ALL.iter().enumerate() {
        let own = rows.iter().filter(|r| r.method == method.name());
        let points = own.filter_map(|r| {
            Some([r.measured.value("iterations [-]")?, r.measured.value("true residual [-]")?])
        });
        let mut line = Series::line(method.name(), COLORS[k], Stroke::Solid, points.collect());
        line.mark = Some((Mark::Circle, 4.5));
        series.push(line);
    }
    Chart {
        title: format!("{title}: true residual"),
        subtitle: machines(rows),
        x: Axis::linear("iterations [-]"),
        y: Axis::log("||b - A P|| / ||b|| [-]"),
        series,
    }
}

/// The study.
pub fn study(setup: &Setup) -> Study {
    let spacings: &[f64] = if setup.full { &[0.025, 0.0125, 0.00833333333] } else { &[0.025, 0.0125] };
    let tolerances = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8];
    let mut jobs = Vec::new();
    for &spacing in spacings {
        for method in Method::ALL {
            for tolerance in tolerances {
                if method == Method::Device && tolerance < 1e-5 {
                    continue;
                }
                let parameters =
                    [("spacing", format!("{spacing:.6}")), ("tolerance", format!("{tolerance:e}"))];
                jobs.push(Job::new(method.name(), &parameters, spacing.powi(-4), move |context| {
                    measure(spacing, method, tolerance, context)
                }));
            }
        }
    }
    Study {
        name: "pressure-solve".into(),
        title: "The pressure equation alone".into(),
        question: "Residual and pressure error against iterations, matrix products and time, on a column of water \
                   0.25 x 0.25 x 0.5 m whose particles have left the lattice. Start from zero; the multigrid's \
                   set-up is in its time."
            .into(),
        jobs,
        finish: Box::new(finish),
    }
}
