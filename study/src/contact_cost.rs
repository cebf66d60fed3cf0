//! What contact costs a step: bodies at rest on a floor, their pairs on the host and on a device.

use super::Study;
use super::contact_checks::{DAM_BREAK_CUBE, none, smooth};
use super::definition::Setup;
use super::dry::{DryScene, FreeBox};
use super::engine::{Context, Job, Processor};
use super::report::{Report, short};
use super::row::{Measured, Row, Timing, Work};
use crate::plot::{Axis, COLORS, Chart, Mark, Series, Stroke};
use glam::DVec3;
use seixo::case::file::parse;
use seixo::case::{Contact, ContactDevice, Law};
use seixo::compute::Compute;
use seixo::contact::{ContactReport, Solids, standing_gap};
use seixo::error::{Error, Result};
use seixo::params::Params;
use seixo::plan::Plan;
use seixo::pressure::Settings;
use seixo::scene::Scene;
use std::time::Instant;

/// Density of the cubes [kg/m3].
const DENSITY: f64 = 464.0;
/// Steps before the clock starts: the bodies have settled.
const WARM: usize = 20;
/// Turns of host and device, one after the other, so that both meet the same load of the machine.
const TURNS: usize = 5;

/// A backend for the contact of a dry scene built by hand; `make` is given what [`seixo::simulation::Simulation`]
/// gives it. On a device the pairs run there, however few they are.
///
/// # Errors
/// What `make` says.
pub fn backend<B>(
    scene: &Scene,
    contact: &Contact,
    make: impl FnOnce(&Scene, &Params, &Plan, Settings) -> Result<B>,
) -> Result<B> {
    let (l0, dimensions) = (scene.spacing, scene.dimensions);
    let text = format!("[run]\nspacing = {l0:?}\ntime_step = 1e-3\nend = 1.0\ndimensions = {dimensions}\n");
    // The library's reader: `toml::from_str` here would make another of half a megabyte.
    let (mut case, ..) = parse("case", text, &[])?;
    case.contact = Some(Contact { device: ContactDevice::Gpu, ..contact.clone() });
    let params = Params::new(&case, scene)?;
    let plan = Plan::new(&case, scene, &params);
    let settings = Settings { tolerance: 1e-3, max_iterations: 1, warm_start: false };
    make(scene, &params, &plan, settings)
}

/// `count` cubes like the dam-break one, but seven spacings wide, in a square on a floor, two
/// spacings apart, and their contact.
fn field(count: usize, law: Law) -> (Scene, Contact) {
    let (.., l0, spring, damping, friction, _) = DAM_BREAK_CUBE;
    let edge = 7.0 * l0;
    let wide = (count as f64).sqrt().ceil() as usize;
    // Whole spacings apart, so that all stand alike on the particles of the floor.
    let pitch = 9.0 * l0;
    let reach = wide as f64 * pitch;
    let mut dry = DryScene::new(l0, DVec3::new(-1.0, -1.0, 0.0), DVec3::new(reach + 1.0, reach + 1.0, 1.0));
    dry = dry.floor();
    if law == Law::Paper {
        dry = dry.particle_floor((-pitch, -pitch), (reach, reach));
    }
    let height = 0.5 * edge + standing_gap(law, l0);
    for k in 0..count {
        let center = DVec3::new((k % wide) as f64 * pitch, (k / wide) as f64 * pitch, height);
        dry = dry.body(&FreeBox::new(DVec3::splat(edge), DENSITY, center));
    }
    let friction = if law == Law::Smooth { friction } else { 0.0 };
    (dry.build(), Contact { law, ..smooth(spring, damping, friction) })
}

/// Bodies in motion, on one of the two.
struct Runner {
    solids: Solids,
    steps: usize,
    done: usize,
    seconds: Vec<f64>,
    report: ContactReport,
}

impl Runner {
    fn new(scene: &Scene, contact: &Contact, steps: usize) -> Result<Self> {
        let solids = Solids::new(scene, Some(contact))?;
        Ok(Self { solids, steps, done: 0, seconds: vec![], report: ContactReport::default() })
    }

    fn run(&mut self, mut compute: Option<&mut dyn Compute>, steps: usize) -> Result<f64> {
        let (dt, fluid) = (DAM_BREAK_CUBE.6, none(self.solids.poses().len()));
        let clock = Instant::now();
        for _ in 0..steps {
            let compute = compute.as_mut().map(|c| &mut **c as &mut dyn Compute);
            self.report = self.solids.advance_on(compute, self.done as f64 * dt, dt, &fluid)?;
            self.done += 1;
        }
        Ok(clock.elapsed().as_secs_f64() / steps as f64)
    }

    fn turn(&mut self, compute: Option<&mut dyn Compute>) -> Result<()> {
        let seconds = self.run(compute, self.steps)?;
        self.seconds.push(seconds);
        Ok(())
    }
}

fn measure(law: Law, bodies: usize, context: &Context) -> Result<Measured> {
    let (scene, contact) = field(bodies, law);
    let made = backend(&scene, &contact, |s, p, plan, settings| {
        (context.make)(Processor::Gpu, s, p, plan, settings)
    });
    // Without a device the host alone is measured.
    let (mut gpu, missing) = match made {
        Ok(gpu) => (Some(gpu), None),
        Err(Error::Gpu(why)) => (None, Some(why.to_string())),
        Err(e) => return Err(e),
    };
    let threads = rayon::current_num_threads();
    let name = gpu.as_ref().map_or("no device".into(), |g| g.description());
    let mut out = Measured {
        machine: format!("CPU, {threads} threads, f64; {name}"),
        reason: missing.unwrap_or_default(),
        ..Measured::default()
    };
    let mut host = Runner::new(&scene, &contact, (4000 / bodies).clamp(5, 400))?;
    let mut device = Runner::new(&scene, &contact, (100 / bodies).clamp(2, 50))?;
    host.run(None, WARM)?;
    let first = gpu.as_mut().map(|g| device.run(g.compute(), WARM)).transpose()?;
    let before = device.solids.traffic();
    for _ in 0..TURNS {
        host.turn(None)?;
        if let Some(gpu) = &mut gpu {
            device.turn(gpu.compute())?;
        }
    }
    let least = |s: &[f64]| 1e6 * s.iter().copied().fold(f64::INFINITY, f64::min);
    let points = scene.solids[0].wall_offset.len();
    out.put("surface points [-]", (points * bodies) as f64);
    out.put("sub-steps [-]", f64::from(host.report.substeps));
    out.put("points or pairs in contact [-]", host.report.pairs as f64);
    out.put("host a step [us]", least(&host.seconds));
    if first.is_some() {
        let (steps, now) = ((TURNS * device.steps) as f64, device.solids.traffic());
        out.put("device a step [us]", least(&device.seconds));
        out.put("dispatches a step [-]", (now.dispatches - before.dispatches) as f64 / steps);
        out.put("round trips a step [-]", (now.round_trips - before.round_trips) as f64 / steps);
        out.put("sent a step [kB]", 1e-3 * (now.sent - before.sent) as f64 / steps);
        out.put("read back a step [kB]", 1e-3 * (now.read - before.read) as f64 / steps);
        let apart = host.solids.poses().iter().zip(device.solids.poses());
        let apart = apart.map(|(a, b)| (a.position - b.position).length()).fold(0.0, f64::max);
        out.put("host and device apart [m]", apart);
    }
    out.work = Work { steps: (TURNS * host.steps) as u64, ..Work::default() };
    out.timing = Timing::of(host.seconds);
    Ok(out)
}

/// Exponent of the growth of `value` with the bodies, by least squares over the points from 10 bodies on.
fn exponent(rows: &[&Row], value: &str) -> Option<f64> {
    let points: Vec<(f64, f64)> =
        curve(rows, value).into_iter().filter(|p| p[0] >= 10.0).map(|p| (p[0].ln(), p[1].ln())).collect();
    let n = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
        / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>();
    (points.len() > 1).then_some(slope)
}

fn curve(rows: &[&Row], value: &str) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = rows
        .iter()
        .filter_map(|r| Some([r.parameters.get("bodies")?.parse().ok()?, r.measured.value(value)?]))
        .collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    points
}

fn finish(rows: &mut [Row], _: Option<f64>) -> Result<Report> {
    let mut report = Report::default();
    for law in LAWS {
        let own: Vec<&Row> = rows.iter().filter(|r| r.method == name(law)).collect();
        let mut series = vec![];
        for (k, (place, value)) in
            [("host", "host a step [us]"), ("device", "device a step [us]")].into_iter().enumerate()
        {
            let points = curve(&own, value);
            let (Some(first), Some(last)) = (points.first(), points.last()) else { continue };
            let growth =
                exponent(&own, value).map_or(String::new(), |e| format!(", growing as bodies^{e:.2}"));
            report.findings.push(format!(
                "{}, {place}: {} us a step for {} body, {} us for {}{growth}.",
                name(law),
                short(first[1]),
                first[0],
                short(last[1]),
                last[0]
            ));
            let mut line = Series::line(place, COLORS[k], Stroke::Solid, points);
            line.mark = Some((Mark::Circle, 4.5));
            series.push(line);
        }
        let machines: Vec<&str> = own.iter().map(|r| r.measured.machine.as_str()).collect();
        let chart = Chart {
            title: format!("Contact of cubes at rest, {}", name(law)),
            subtitle: machines.first().copied().unwrap_or_default().into(),
            x: Axis::log("bodies of 218 surface points [-]"),
            y: Axis::log("time a step [us]"),
            series,
        };
        report.charts.push((format!("contact-cost-{}", name(law).replace([' ', '\''], "-")), chart));
    }
    Ok(report)
}

const LAWS: [Law; 2] = [Law::Smooth, Law::Paper];

fn name(law: Law) -> &'static str {
    if law == Law::Paper { "paper's law" } else { "smooth law" }
}

/// The study.
pub fn study(setup: &Setup) -> Study {
    let counts: &[usize] = if setup.full { &[1, 3, 10, 30, 100, 300, 1000] } else { &[1, 10, 100, 1000] };
    let mut jobs = Vec::new();
    for law in LAWS {
        for &bodies in counts {
            let parameters = [("bodies", bodies.to_string())];
            let task = move |context: &Context| measure(law, bodies, context);
            jobs.push(Job::new(name(law), &parameters, (bodies as f64).max(5.0), task));
        }
    }
    Study {
        name: "contact-cost".into(),
        title: "What contact costs a step".into(),
        question: "Time of contact for a step of 9e-4 s, cubes of 218 surface points standing on a floor; pairs of points on the host, and on a device. The shortest of five turns, host \
                   and device by turns."
            .into(),
        jobs,
        finish: Box::new(finish),
    }
}
