//! Contact where it was wrong: the faults once found, each against its analytic answer, on the host and on a device.

use super::Study;
use super::contact_checks::none;
use super::contact_cost::backend;
use super::contact_statics::{STRUCTURES, Structure, measured, stands};
use super::definition::Setup;
use super::dry::GRAVITY;
use super::engine::{Context, Job, Processor};
use super::report::{Report, short};
use super::row::{Measured, Row};
use seixo::case::Case;
use seixo::compute::Compute;
use seixo::contact::{ContactReport, Solids};
use seixo::error::{Error, Result};
use seixo::scene::Scene;

const VALUE: &str = "measured";
const EXACT: &str = "exact";
const ERROR: &str = "error [-]";
const BEFORE: &str = "before";

/// A scene in motion, its pairs on a device if there is one.
pub struct Run<'a> {
    /// Its solids.
    pub solids: Solids,
    compute: Option<&'a mut dyn Compute>,
    dt: f64,
    step: u32,
}

impl Run<'_> {
    /// Time [s].
    pub fn time(&self) -> f64 {
        f64::from(self.step) * self.dt
    }

    /// A step.
    ///
    /// # Errors
    /// Those of [`Solids::advance_on`].
    pub fn step(&mut self) -> Result<ContactReport> {
        let (still, now) = (none(self.solids.poses().len()), self.time());
        let compute = self.compute.as_mut().map(|c| &mut **c as &mut dyn Compute);
        let report = self.solids.advance_on(compute, now, self.dt, &still)?;
        self.step += 1;
        Ok(report)
    }

    /// Steps until `time` [s]; what `watch` makes of each.
    fn until(&mut self, time: f64, mut watch: impl FnMut(&mut Solids)) -> Result<()> {
        while self.time() < time {
            self.step()?;
            watch(&mut self.solids);
        }
        Ok(())
    }
}

/// A fault: its scene and what is measured.
struct Fault {
    name: &'static str,
    /// What was measured before it was mended, from the note of the fault; over the exact value where `scale` is 0.
    before: Option<f64>,
    /// Spacings [m].
    spacings: [f64; 2],
    /// Whether the paper's law has an answer, too.
    paper: bool,
    /// What an error is taken over.
    scale: f64,
    /// Largest error.
    most: f64,
    /// The case without spacing and law.
    text: fn() -> String,
    /// Measured and exact value.
    measure: fn(&mut Run) -> Result<(f64, f64)>,
}

const PLANE: &str = "[[plane]]\nname = \"plane\"\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\nalong = [1, 0, 0]\nsize = [0.5, 0.6]\n";

/// Largest gain of energy over what there is to lose, and how far above the start a body came.
fn gain(run: &mut Run, time: f64, energy: f64) -> Result<(f64, f64)> {
    let start = run.solids.energy().total();
    let (mut most, mut touched) = (0.0_f64, false);
    run.until(time, |s| {
        most = most.max(s.centred_energy().total() - start);
        touched |= s.contact_wrenches().iter().any(|wrench| wrench.force.length_squared() > 0.0);
    })?;
    // What misses gains nothing, and shows nothing.
    if !touched {
        return Err(Error::key(
            "measure",
            "nothing was touched: the scene is no longer what it was made for",
            "",
        ));
    }
    Ok((most / energy, 0.0))
}

/// Way and turn until a plate of edges `a` and `b` [m] that starts with `v` [m/s] and `w` [rad/s] stops, by the Coulomb
/// field of an even pressure: its integral over 60 x 60 places, by steps of 0.1 ms.
pub fn coulomb_stop((a, b): (f64, f64), friction: f64, mut v: f64, mut w: f64) -> (f64, f64) {
    let (dt, n) = (1e-4, 60);
    let (mut way, mut turn, mut angle) = (0.0, 0.0, 0.0_f64);
    while v > 1e-3 || w > 1e-2 {
        let (mut force, mut torque) = (0.0, 0.0);
        let (sin, cos) = angle.sin_cos();
        for i in 0..n {
            for j in 0..n {
                let at = |k: i32| (2.0 * f64::from(k) + 1.0) / f64::from(n) - 1.0;
                let (p, q) = (0.5 * a * at(i), 0.5 * b * at(j));
                let (x, y) = (p * cos - q * sin, p * sin + q * cos);
                let (sx, sy) = (v - w * y, w * x);
                let speed = sx.hypot(sy).max(1e-12);
                force += sx / speed;
                torque += (x * sy - y * sx) / speed;
            }
        }
        let each = friction * GRAVITY / f64::from(n * n);
        let inertia = (a * a + b * b) / 12.0;
        v = (v - dt * each * force).max(0.0);
        w = (w - dt * each * torque / inertia).max(0.0);
        (way, turn, angle) = (way + dt * v, turn + dt * w, angle + dt * w);
    }
    (way, turn)
}

/// The case of a plate on a floor, without spacing, that starts with `v` [m/s] and the spin `w` [rad/s].
pub fn plate(size: [f64; 3], v: f64, w: f64) -> String {
    format!(
        "time_step = 5e-4\nend = 1\ngravity = [0, 0, -{GRAVITY}]\n[[obstacle]]\nname = \"floor\"\nmin = [-1, -1, -0.2]\n\
         max = [1, 1, 0]\n[[body]]\nname = \"plate\"\nsize = {size:?}\ncenter = [0, 0, {:?}]\ndensity = 1000\n\
         velocity = [{v}, 0, 0]\nangular_velocity = [0, 0, {w}]\nlocked = [\"rotation_x\", \"rotation_y\"]\n\
         [contact]\nspring = 1e6\ndamping_ratio = 0.5\nfriction = 0.3\n",
        0.5 * size[2]
    )
}

/// Turn until a plate has stopped, over that of the field, and its way over the field's.
fn stop(run: &mut Run, edges: (f64, f64), v: f64, w: f64) -> Result<(f64, f64)> {
    let (mut turn, dt) = (0.0, run.dt);
    run.until(1.0, |s| turn += dt * s.poses()[0].angular_velocity.z)?;
    let (way, turned) = coulomb_stop(edges, 0.3, v, w);
    let x = run.solids.poses()[0].position;
    if v > 0.0 { Ok((x.truncate().length(), way)) } else { Ok((turn, turned)) }
}

const FAULTS: &[Fault] = &[
    Fault {
        name: "plank over a plane's edge: gain of energy [-]",
        before: Some(10.0),
        spacings: [0.02, 0.01],
        paper: false,
        scale: 1.0,
        most: 1e-3,
        text: || {
            format!(
                "time_step = 1e-3\nend = 1\ngravity = [0, 0, -{GRAVITY}]\n{PLANE}[[body]]\nname = \"plank\"\n\
                 size = [0.4, 0.1, 0.04]\ncenter = [0.27, 0, 0.02]\ndensity = 700\nstanding = true\n\
                 [contact]\nspring = 1e7\nfriction = 0.5\ndamping_ratio = 1\n"
            )
        },
        measure: |run| gain(run, 0.6, 1.12 * GRAVITY * 0.2),
    },
    Fault {
        name: "cube from behind a plane at 3.5 m/s: gain of energy [-]",
        before: Some(1100.0),
        spacings: [0.02, 0.0125],
        paper: false,
        scale: 1.0,
        most: 1e-3,
        text: || {
            format!(
                "time_step = 5e-4\nend = 1\ngravity = [0, 0, 0]\n{PLANE}[[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\n\
                 center = [0.05, 0.02, -0.3]\nmass = 1.8\nvelocity = [0, 0, 3.5]\n[contact]\nspring = 1e6\nrestitution = 0.8\n"
            )
        },
        measure: |run| gain(run, 0.3, 11.0),
    },
    Fault {
        name: "cube on an open tank's rim: gain of energy [-]",
        before: Some(1680.0),
        spacings: [0.025, 0.0125],
        paper: false,
        scale: 1.0,
        most: 1e-3,
        text: || {
            format!(
                "time_step = 5e-4\nend = 1\ngravity = [0, 0, -{GRAVITY}]\n[tank]\nmin = [0, 0, 0]\nmax = [0.5, 0.5, 0.2]\n\
                 open = [\"z_max\"]\n[[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [-0.01, 0.26, 0.45]\n\
                 density = 900\nangular_velocity = [1, 2, 3]\n[contact]\nspring = 1e6\nfriction = 0.3\nrestitution = 0.6\n"
            )
        },
        measure: |run| gain(run, 0.5, 0.9 * GRAVITY * 0.25),
    },
    Fault {
        name: "bar 1 x .02 x .02 m falls flat: restitution [-]",
        before: Some(0.9),
        spacings: [0.01, 0.005],
        paper: false,
        scale: 1.0,
        most: 0.02,
        text: || {
            "time_step = 5e-4\nend = 1\ngravity = [0, 0, 0]\n[[plane]]\nname = \"plane\"\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\n\
             along = [1, 0, 0]\nsize = [1.2, 0.4]\n[[body]]\nname = \"bar\"\nsize = [1.0, 0.02, 0.02]\ncenter = [0, 0, 0.014]\n\
             density = 2700\nvelocity = [0, 0, -2]\n[contact]\nspring = 1e7\nrestitution = 0.3\n"
                .into()
        },
        measure: |run| {
            run.until(0.1, |_| ())?;
            Ok((run.solids.poses()[0].velocity.z / 2.0, 0.3))
        },
    },
    Fault {
        name: "cube on K = 1e9 N/m: restitution [-]",
        before: Some(0.12),
        spacings: [0.025, 0.0125],
        paper: false,
        scale: 1.0,
        most: 0.012,
        text: || {
            format!(
                "time_step = 1e-3\nend = 1\ngravity = [0, 0, 0]\n{PLANE}[[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\n\
                 center = [0, 0, 0.0533]\nmass = 1\nvelocity = [0, 0, -1]\n[contact]\nspring = 1e9\nrestitution = 0.01\n"
            )
        },
        measure: |run| {
            run.until(0.3, |_| ())?;
            Ok((run.solids.poses()[0].velocity.z, 0.01))
        },
    },
    Fault {
        name: "cube of 1 cm at 20 m/s on a pane of 2 cm, 1 ms: where it ends up [m]",
        before: Some(0.127),
        spacings: [0.005, 0.0025],
        paper: false,
        scale: 0.1,
        most: 0.05,
        text: || {
            "time_step = 1e-3\nend = 1\ngravity = [0, 0, 0]\n[[obstacle]]\nname = \"pane\"\nmin = [0, 0, 0]\nmax = [0.02, 0.1, 0.1]\n\
             [[body]]\nname = \"bullet\"\nsize = [0.01, 0.01, 0.01]\ncenter = [-0.0733, 0.05, 0.05]\ndensity = 1000\n\
             velocity = [20, 0, 0]\n[contact]\nspring = 1e6\nrestitution = 0.5\n"
                .into()
        },
        measure: |run| {
            run.until(0.01, |_| ())?;
            // a gap of 0.0683 m at 20 m/s, then back at half of that; it is in touch for about a tenth of a step
            Ok((run.solids.poses()[0].position.x, -0.005 - 10.0 * (0.01 - 0.0683 / 20.0)))
        },
    },
    Fault {
        name: "block on a tray that swings with 0.8 mu g, rows of 10 ms: slip [m]",
        before: Some(3e-3),
        spacings: [0.05, 0.025],
        paper: false,
        scale: 1.0,
        most: 2e-4,
        text: || {
            let (friction, turn): (f64, f64) = (0.3, std::f64::consts::TAU * 2.0);
            let amplitude = 0.8 * friction * GRAVITY / turn.powi(2);
            let ramp = |t: f64| if t < 0.5 { (t / 0.5).powi(2) * (3.0 - t / 0.25) } else { 1.0 };
            let rows = (0..=200).map(|k| 0.01 * f64::from(k));
            let rows: Vec<String> =
                rows.map(|t| format!("[{t}, {}, 0, 0]", amplitude * ramp(t) * (turn * t).sin())).collect();
            format!(
                "time_step = 1e-3\nend = 1\ngravity = [0, 0, -{GRAVITY}]\n[[moving_wall]]\nname = \"tray\"\nmin = [-0.5, -0.5, -0.1]\n\
                 max = [0.5, 0.5, 0]\nmotion = [{}]\n[[body]]\nname = \"block\"\nsize = [0.1, 0.1, 0.05]\ncenter = [0, 0, 0.025]\n\
                 density = 1000\n[contact]\nspring = 1e6\ndamping_ratio = 1\nfriction = {friction}\n",
                rows.join(", ")
            )
        },
        measure: |run| {
            let mut most = 0.0_f64;
            run.until(1.5, |s| most = most.max((s.poses()[0].position.x - s.poses()[1].position.x).abs()))?;
            Ok((most, 0.0))
        },
    },
    Fault {
        name: "plate that spins on its face: turn until it stops [rad]",
        before: Some(1.10),
        spacings: [0.04, 0.02],
        paper: false,
        scale: 0.0,
        most: 0.02,
        text: || plate([0.2, 0.2, 0.08], 0.0, 20.0),
        measure: |run| stop(run, (0.2, 0.2), 0.0, 20.0),
    },
    Fault {
        name: "plate that spins and slides: way until it stops [m]",
        before: Some(0.85),
        spacings: [0.04, 0.02],
        paper: false,
        scale: 0.0,
        most: 0.02,
        text: || plate([0.2, 0.2, 0.08], 1.0, 20.0),
        measure: |run| stop(run, (0.2, 0.2), 1.0, 20.0),
    },
    Fault {
        name: "oblong plate that spins and slides: way until it stops [m]",
        before: Some(0.85),
        spacings: [0.04, 0.02],
        paper: false,
        scale: 0.0,
        most: 0.02,
        text: || plate([0.4, 0.12, 0.08], 1.0, 10.0),
        measure: |run| stop(run, (0.4, 0.12), 1.0, 10.0),
    },
    Fault {
        name: "cube that falls 0.1 m on its face, undamped: height of return over it [-]",
        before: None,
        spacings: [0.025, 0.02],
        paper: true,
        scale: 1.0,
        most: 0.01,
        text: || {
            format!(
                "time_step = 1e-4\nend = 1\ngravity = [0, 0, -{GRAVITY}]\n[[obstacle]]\nname = \"floor\"\nmin = [-0.3, -0.3, -0.2]\n\
                 max = [0.3, 0.3, 0]\n[[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0, 0, 0.15]\ndensity = 1000\n\
                 [contact]\nspring = 1e5\ndamping = 0\n"
            )
        },
        measure: |run| {
            let (mut highest, mut down) = (0.0_f64, false);
            let start = run.solids.poses()[0].position.z;
            run.until(0.34, |s| {
                down |= s.poses()[0].velocity.z > 0.0;
                highest = if down { highest.max(s.poses()[0].position.z) } else { 0.0 };
            })?;
            Ok((1.0 + (highest - start) / 0.1, 1.0))
        },
    },
];

/// Does `use_it` with the case of `text`, whose pairs are on a device if that is wanted. `Err` of the inside: there is none.
fn with<T>(
    text: &str,
    device: bool,
    context: &Context,
    out: &mut Measured,
    use_it: impl FnOnce(&mut Run) -> Result<T>,
) -> Result<std::result::Result<T, Measured>> {
    let case: Case = text.parse()?;
    let scene = Scene::build(&case)?;
    let Some(contact) = &case.contact else { return Err(Error::key("contact", "is missing", "give it")) };
    out.machine = "CPU, f64".into();
    let mut gpu = None;
    if device {
        let made = backend(&scene, contact, |s, p, plan, settings| {
            (context.make)(Processor::Gpu, s, p, plan, settings)
        });
        match made {
            Ok(made) => gpu = Some(made),
            Err(error @ Error::Gpu(_)) => return Ok(Err(Measured::failed(&error))),
            Err(error) => return Err(error),
        }
        out.machine = gpu.as_ref().map_or(String::new(), |g| g.description());
    }
    let solids = Solids::new(&scene, Some(contact))?;
    let compute = gpu.as_mut().and_then(|g| g.compute());
    let mut run = Run { solids, compute, dt: case.run.time_step, step: 0 };
    let used = use_it(&mut run)?;
    out.work.steps += u64::from(run.step);
    Ok(Ok(used))
}

fn measure(fault: &Fault, spacing: f64, paper: bool, device: bool, context: &Context) -> Result<Measured> {
    let mut text = format!("[run]\nspacing = {spacing}\n{}", (fault.text)());
    if paper {
        text += "law = \"paper\"\n";
    }
    let mut out = Measured::default();
    let (value, exact) = match with(&text, device, context, &mut out, fault.measure)? {
        Ok(found) => found,
        Err(none) => return Ok(none),
    };
    let scale = if fault.scale > 0.0 { fault.scale } else { exact };
    out.put(VALUE, value);
    out.put(EXACT, exact);
    out.put(ERROR, ((value - exact) / scale).abs());
    if let Some(before) = fault.before {
        out.put(BEFORE, if fault.scale > 0.0 { before } else { before * exact });
    }
    out.limit(ERROR, fault.most);
    Ok(out)
}

/// The value from which on `structure` stands, against that of statics.
fn threshold(structure: &Structure, spacing: f64, device: bool, context: &Context) -> Result<Measured> {
    let (mut out, mut missing) = (Measured::default(), None);
    let value = measured(structure, |at| {
        let text = format!("[run]\nspacing = {spacing}\n{}", (structure.text)(at));
        match with(&text, device, context, &mut out, |run| stands(run, structure.time))? {
            Ok(stands) => Ok(stands),
            Err(none) => {
                missing = Some(none);
                Ok(false)
            }
        }
    })?;
    if let Some(none) = missing {
        return Ok(none);
    }
    let exact = (structure.threshold)();
    out.put(VALUE, value);
    out.put(EXACT, exact);
    out.put(ERROR, (value / exact - 1.0).abs());
    out.limit(ERROR, 0.03);
    Ok(out)
}

fn finish(rows: &mut [Row], _: Option<f64>) -> Result<Report> {
    let told = |r: &&Row| r.measured.value(ERROR).is_some();
    let findings = rows.iter().filter(told).map(|r| {
        let of = |name: &str| r.measured.value(name).map_or("-".into(), short);
        format!(
            "{}, {}: {} against {}, error {} (before: {}).",
            r.method,
            r.setting(),
            of(VALUE),
            of(EXACT),
            of(ERROR),
            of(BEFORE)
        )
    });
    Ok(Report { findings: findings.collect(), ..Report::default() })
}

/// The study.
pub fn study(_: &Setup) -> Study {
    let mut jobs = Vec::new();
    for fault in FAULTS {
        for (k, spacing) in fault.spacings.into_iter().enumerate() {
            for paper in [false, true].into_iter().filter(|p| !p || fault.paper) {
                // the device at the coarser one: software is slow
                for device in [false, true].into_iter().filter(|d| !d || k == 0) {
                    let law = if paper { "paper" } else { "smooth" };
                    let place = if device { "device" } else { "host" };
                    let parameters =
                        [("spacing", spacing.to_string()), ("law", law.into()), ("pairs", place.into())];
                    let weight = if device { 10.0 } else { 1.0 };
                    let task = move |context: &Context| measure(fault, spacing, paper, device, context);
                    jobs.push(Job::new(fault.name, &parameters, weight, task));
                }
            }
        }
    }
    for structure in STRUCTURES {
        for (k, spacing) in structure.spacings.into_iter().enumerate() {
            for device in [false, true].into_iter().filter(|d| !d || k == 0) {
                let place = if device { "device" } else { "host" };
                let parameters =
                    [("spacing", spacing.to_string()), ("law", "smooth".into()), ("pairs", place.into())];
                let task = move |context: &Context| threshold(structure, spacing, device, context);
                jobs.push(Job::new(structure.name, &parameters, if device { 60.0 } else { 6.0 }, task));
            }
        }
    }
    Study {
        name: "contact-hard".into(),
        title: "Contact where it was wrong".into(),
        question: "Faults once found in contact, each against its analytic answer, at two spacings, on the host and on a device; \
                   what was measured before each was mended stands beside it."
            .into(),
        jobs,
        finish: Box::new(finish),
    }
}
