//! One simulation as a point of a study: run it, time its steps alone, measure on the way.

use super::engine::{Context, Processor};
use super::judged::Judged;
use super::measure::{Sampler, Spec};
use super::row::{Measured, Timing, Work};
use seixo::case::file::parse;
use seixo::checkpoint::file::{newest, write};
use seixo::checkpoint::{Archive, Origin};
use seixo::console::remark;
use seixo::error::{Error, Result};
use seixo::scene::Scene;
use seixo::scheme::Preconditioner;
use seixo::simulation::{Simulation, StepReport};
use std::time::Instant;

/// Products with the fine matrix that an iteration of the multigrid-preconditioned solver amounts to: one of the
/// conjugate gradients, two residuals of the V-cycle, and coarse levels worth about half of one.
pub const MULTIGRID_PRODUCTS: f64 = 3.5;

/// Products with the fine matrix of a solve of `iterations`.
pub fn products(preconditioner: Preconditioner, iterations: u32) -> f64 {
    let each = if preconditioner == Preconditioner::Multigrid { MULTIGRID_PRODUCTS } else { 1.0 };
    // One more for the residual of the start vector.
    1.0 + each * f64::from(iterations)
}

/// What a point computes.
#[derive(Clone, Debug)]
pub struct Point {
    /// Text of the case, overrides applied.
    pub text: String,
    /// Measures.
    pub spec: Spec,
    /// Processor.
    pub processor: Processor,
    /// Runs, the measured one included.
    pub repetitions: u32,
}

/// How far a point is: runs that are over, and the one in progress beside its own state.
#[derive(Debug, Default)]
struct Course {
    /// Seconds of the runs that are over.
    times: Vec<f64>,
    /// Seconds of the one in progress so far.
    seconds: f64,
    work: Work,
    /// What the first run measured, once it is over.
    measured: Option<Measured>,
}

impl Course {
    fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        let Self { times, seconds, work, measured } = self;
        archive.array("point.times", times, false)?;
        archive.number("point.seconds", seconds)?;
        let Work { particles, steps, particle_steps, iterations, products } = work;
        archive.count("point.particles", particles)?;
        archive.count("point.steps", steps)?;
        archive.count("point.particle_steps", particle_steps)?;
        archive.count("point.iterations", iterations)?;
        archive.number("point.products", products)?;
        let mut text = measured.as_ref().map_or_else(Vec::new, |m| serde_json::to_vec(m).unwrap_or_default());
        archive.array("point.measured", &mut text, false)?;
        *measured = serde_json::from_slice(&text).ok();
        Ok(())
    }

    /// Keep what the run of `simulation` measured, with its cost.
    fn keep(&mut self, measured: Measured, simulation: &Simulation) {
        self.work.steps = simulation.steps;
        self.work.particle_steps = self.work.particles * self.work.steps;
        let machine = format!("{}, {}", simulation.backend.description(), simulation.backend.precision());
        self.measured = Some(Measured { work: self.work, machine, ..measured });
    }

    /// Save all of it, if `context` has a place for it.
    fn save(
        &mut self,
        point: &Point,
        context: &Context,
        simulation: &mut Simulation,
        watch: &mut Option<Watch>,
    ) -> Result<()> {
        let Some(folder) = &context.states else { return Ok(()) };
        let mut archive = Archive::new();
        self.exchange(&mut archive)?;
        simulation.exchange(&mut archive)?;
        watch.iter_mut().try_for_each(|watch| watch.exchange(&mut archive))?;
        let origin = Origin {
            version: env!("CARGO_PKG_VERSION").into(),
            case: point.text.clone(),
            precision: simulation.backend.precision().into(),
            // Counted over all runs, so that the newest file is that of the last one.
            step: simulation.steps + self.work.steps * self.times.len() as u64,
            time: simulation.time,
            ..Origin::default()
        };
        write(folder, &origin, &archive).map(|_| ())
    }
}

/// What is made of the run that is measured: numbers and curves, and the verdict on it.
struct Watch {
    sampler: Sampler,
    judged: Judged,
}

impl Watch {
    fn new(spec: &Spec, simulation: &Simulation, scene: &Scene) -> Result<Self> {
        Ok(Self { sampler: Sampler::new(spec, simulation, scene)?, judged: Judged::new(simulation, scene) })
    }

    fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        self.sampler.exchange(archive)?;
        self.judged.exchange(archive)
    }

    fn step(&mut self, report: StepReport, simulation: &mut Simulation) -> Result<()> {
        self.sampler.sample(simulation, report.pressure.iterations, report.dt)?;
        self.judged.step(report, simulation)
    }

    fn finish(self, simulation: &mut Simulation, scene: &Scene) -> Result<Measured> {
        let mut measured = self.sampler.finish(simulation)?;
        measured.judge(&self.judged.verdict(simulation, scene)?);
        Ok(measured)
    }
}

/// The state that an earlier attempt at `point` left; none of another version or another processor.
fn saved(point: &Point, context: &Context) -> Result<Option<Archive>> {
    let Some(folder) = &context.states else { return Ok(None) };
    let precision = if point.processor == Processor::Gpu { "f32" } else { "f64" };
    let ours = |o: &Origin| {
        o.version == env!("CARGO_PKG_VERSION") && o.case == point.text && o.precision == precision
    };
    match newest(folder) {
        Ok(found) => Ok(found.filter(|f| ours(&f.origin)).map(|f| f.archive.into_restore())),
        // Damaged: the point starts again, which costs time and nothing else.
        Err(Error::Checkpoint(why)) => {
            remark(&format!("warning: the point starts again: {why}"));
            Ok(None)
        }
        Err(other) => Err(other),
    }
}

fn start(point: &Point, context: &Context) -> Result<Simulation> {
    let (case, _, _) = parse("case", point.text.clone(), &[])?;
    let scene = Scene::build(&case)?;
    let make = |s: &_, p: &_, plan: &_, settings| (context.make)(point.processor, s, p, plan, settings);
    Simulation::with_backend(&case, scene, make)
}

/// Steps of a throw-away run that warm up caches, threads and clocks.
const WARM_STEPS: u32 = 3;

/// Run `point`: once with measures, then again for its time alone. It goes on where an earlier attempt was stopped.
///
/// # Errors
/// What keeps the run from starting, [`Error::Interrupted`]. A run that diverges, or whose result means nothing, is a measured point of
/// class failed.
pub fn run(point: &Point, context: &Context) -> Result<Measured> {
    let mut warm = start(point, context)?;
    for _ in 0..WARM_STEPS {
        if warm.step().is_err() {
            break;
        }
    }
    drop(warm);
    let _attended = context.states.is_some().then(|| context.stop.attend());
    let (mut course, mut state) = (Course::default(), saved(point, context)?);
    if let Some(archive) = &mut state {
        course.exchange(archive)?;
    }
    let repetitions = if context.repetitions > 0 { context.repetitions } else { point.repetitions };
    // The clock runs over the steps alone, so the measured run counts like the others.
    while course.measured.is_none() || course.times.len() < repetitions as usize {
        if !play(point, context, &mut course, state.take())? {
            return Ok(course.measured.unwrap_or_default());
        }
    }
    let mut measured = course.measured.unwrap_or_default();
    measured.timing = Timing::of(course.times);
    Ok(measured)
}

/// One run, from `state` or from the start; the first one is measured. Whether it came to its end: else why not is what was
/// measured.
fn play(point: &Point, context: &Context, course: &mut Course, state: Option<Archive>) -> Result<bool> {
    let mut simulation = start(point, context)?;
    let scene = simulation.scene.clone();
    let mut watch = match course.measured {
        None => Some(Watch::new(&point.spec, &simulation, &scene)?),
        Some(_) => None,
    };
    if let Some(mut archive) = state {
        simulation.exchange(&mut archive)?;
        watch.iter_mut().try_for_each(|watch| watch.exchange(&mut archive))?;
    } else {
        course.seconds = 0.0;
        if let Some(watch) = &mut watch {
            // What was rounded to the lattice differs from spacing to spacing, and would pass for an error of the scheme.
            let rounded = scene.notes.iter().filter(|note| note.contains(" becomes "));
            rounded.for_each(|note| remark(&format!("note: {note}")));
            if let Some(note) = point.spec.overrules(&simulation.case) {
                remark(&format!("note: {note}"));
            }
            watch.sampler.sample(&mut simulation, 0, 0.0)?;
            watch.judged.start(&mut simulation)?;
            // Slots for what is to come in hold no particles yet.
            let particles = (scene.groups.total() - scene.reserve) as u64;
            course.work = Work { particles, ..Work::default() };
        }
    }
    simulation.stop_with(&context.stop);
    let end = simulation.case.run.end;
    let mut saved = Instant::now();
    while simulation.time < end - 1e-6 * simulation.case.run.time_step {
        if context.states.is_some() && context.stop.is_asked() {
            course.save(point, context, &mut simulation, &mut watch)?;
            return Err(Error::Interrupted);
        }
        let clock = Instant::now();
        let step = simulation.step();
        course.seconds += clock.elapsed().as_secs_f64();
        match step {
            Ok(report) => {
                if let Some(watch) = &mut watch {
                    let iterations = report.pressure.iterations;
                    course.work.iterations += u64::from(iterations);
                    if simulation.plan.wet() {
                        course.work.products += products(simulation.plan.preconditioner, iterations);
                    }
                    watch.step(report, &mut simulation)?;
                }
            }
            // The state kept last is gone back to by the next attempt.
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(error) if watch.is_some() => {
                let mut failed = Measured::failed(&error);
                failed.put("time reached [s]", simulation.time);
                course.keep(failed, &simulation);
                return Ok(false);
            }
            Err(error) => return Err(error),
        }
        if saved.elapsed() >= context.save_every {
            course.save(point, context, &mut simulation, &mut watch)?;
            saved = Instant::now();
        }
    }
    let clock = Instant::now();
    simulation.backend.wait()?;
    course.seconds += clock.elapsed().as_secs_f64();
    course.times.push(course.seconds);
    if let Some(watch) = watch {
        course.keep(watch.finish(&mut simulation, &scene)?, &simulation);
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::cpu_only;
    use crate::record::curves;
    use crate::row::Class;
    use seixo::output::result::Grade;
    use seixo::run::{Options, run as run_case};
    use seixo::stop::Stop;

    /// Still water with a raft, in the plane.
    fn raft(more: &str) -> String {
        format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.05\ndimensions = 2\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.4, 1, 0.4]\nopen = [\"z_max\"]\n\
             [fluid]\nviscosity = 1e-4\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 1, 0.2]\n\
             [[body]]\nname = \"raft\"\nsize = [0.1, 1, 0.06]\ncenter = [0.2, 0, 0.24]\ndensity = 500\n\
             [contact]\nspring = 1e4\n[output]\nevery = 0\n\
             [[gauge.pressure]]\nname = \"floor\"\npoint = [0.1, 0, 0]\n\
             [[gauge.force]]\nname = \"raft\"\non = \"raft\"\n{more}"
        )
    }

    fn point(text: &str, measure: &str) -> Measured {
        let spec = toml::from_str(measure).unwrap();
        let point = Point { text: text.into(), spec, processor: Processor::Cpu, repetitions: 1 };
        run(&point, &Context::new(&cpu_only)).unwrap()
    }

    /// What `seixo run` makes of the same case: its verdict, and a column of gauges.csv.
    fn whole(text: &str, column: &str) -> (Grade, Vec<String>, Vec<[f64; 2]>) {
        let folder = tempfile::tempdir().unwrap();
        let (case, text, _) = parse("case", text.into(), &[]).unwrap();
        let scene = Scene::build(&case).unwrap();
        let make = |s: &_, p: &_, plan: &_, settings| cpu_only(Processor::Cpu, s, p, plan, settings);
        let mut simulation = Simulation::with_backend(&case, scene, make).unwrap();
        let options = Options { out: folder.path().join("out"), ..Options::default() };
        let scene = simulation.scene.clone();
        let ended = run_case(&mut simulation, &scene, &text, options, &Stop::default(), &mut |_| ()).unwrap();
        let table = std::fs::read_to_string(folder.path().join("out/gauges.csv")).unwrap();
        let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let place = lines.next().unwrap().iter().position(|name| *name == column).unwrap();
        let rows = lines
            .filter_map(|cells| Some([cells[0].parse::<f64>().unwrap(), cells[place].parse::<f64>().ok()?]));
        (ended.summary.verdict.grade, ended.summary.verdict.reasons, rows.collect())
    }

    #[test]
    fn a_point_has_the_verdict_that_a_run_has() {
        for (solver, class) in [("1000", Class::Ok), ("1", Class::Failed)] {
            let text = raft(&format!("[fluid.solver]\nmax_iterations = {solver}\n"));
            let measured = point(&text, "of = []\nevery = 0.01\n");
            let (grade, reasons, _) = whole(&text, "floor [Pa]");
            assert_eq!(measured.class, class, "{}", measured.reason);
            assert_eq!(grade == Grade::Failed, class == Class::Failed);
            assert!(measured.reason.ends_with(&reasons.join("; ")), "{} for {reasons:?}", measured.reason);
        }
    }

    #[test]
    fn gauges_have_the_rows_of_a_run_unless_the_study_says_when() {
        for (more, count) in
            [("", 50), ("[gauge]\nevery = 0.007\n", 8), ("[gauge]\nevery = 0.007\nmean = true\n", 8)]
        {
            let text = raft("").replace("[[gauge.pressure]]", &format!("{more}[[gauge.pressure]]"));
            let (.., rows) = whole(&text, "floor [Pa]");
            let measured = point(&text, "of = [\"gauges\", \"bodies\"]\n");
            let curve = &measured.curves["floor [Pa]"];
            assert_eq!(curve.len(), count, "{more}");
            assert!(rows.len() == count && rows.iter().zip(curve).all(|(a, b)| a[1] == b[1]), "{more}");
            // The rest is of every step.
            assert_eq!(measured.curves["raft x [m]"].len(), 51, "{more}");
            assert_eq!(measured.curve("floor [Pa]").as_ref(), Some(curve), "there are no gaps");
            let other = point(&text, "of = [\"gauges\"]\nevery = 0.01\n");
            assert_eq!(other.curves["floor [Pa]"].len(), 5, "{more}");
        }
    }

    #[test]
    fn the_curves_of_a_point_are_known_before_it_runs() {
        let measure = "of = [\"gauges\", \"bodies\", \"fluid\", \"spread\", \"front\", \"energy\", \"body_height\"]\n\
                       profile = [{ name = \"p [N]\", of = \"vx\", along = \"x\", within = [[0, 0, 0], [1, 1, 1]], bins = 2 }]\n";
        let text = raft("");
        let (case, _, _) = parse("case", text.clone(), &[]).unwrap();
        let known = curves(&toml::from_str(measure).unwrap(), &case).unwrap();
        let measured = point(&text, measure);
        assert!(known.iter().eq(measured.curves.keys()), "{known:?} for {:?}", measured.curves.keys());
        assert!(known.contains("raft_force_z [N/m]") && known.contains("p [N]"));
    }
}
