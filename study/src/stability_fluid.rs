//! Maps of the fluid: gamma x Courant number, alpha x gamma, density ratio x scheme, tolerance x size.

use super::engine::{Context, Job, Processor};
use super::measure::hydrostatics;
use super::pressure_solve;
use super::row::Measured;
use super::stability::{Map, bisect, horizontal, vertical};
use glam::DVec3;
use seixo::case::file::parse;
use seixo::error::{Error, Result};
use seixo::lattice::Shear;
use seixo::params::{Params, Relaxation};
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use std::sync::Arc;

/// A dam break in a small tank: 100 particles of water that slosh.
const SLOSHING: &str = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.2\ndimensions = 2\n\
    [tank]\nmin = [0, 0, 0]\nmax = [0.4, 1, 0.6]\nopen = [\"z_max\"]\n\
    [fluid]\nrelaxation = 0.1\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 1, 0.2]\n[output]\nevery = 0\n";
/// Still water 5 particles wide and 20 deep.
const COLUMN: &str = "[run]\nspacing = 0.02\ntime_step = 8e-4\nend = 1.6\ndimensions = 2\n\
    [tank]\nmin = [0, 0, 0]\nmax = [0.1, 1, 0.6]\nopen = [\"z_max\"]\n\
    [fluid]\nrelaxation = 0.04\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.1, 1, 0.4]\n[output]\nevery = 0\n";
/// A square body in the middle of the water.
const BODY: &str = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.2\ndimensions = 2\n\
    [tank]\nmin = [0, 0, 0]\nmax = [0.4, 1, 0.6]\nopen = [\"z_max\"]\n\
    [fluid]\nsound_speed = 4.0\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 1, 0.32]\n\
    [[body]]\nname = \"box\"\nsize = [0.12, 0.02, 0.12]\ncenter = [0.2, 0.0, 0.16]\ndensity = 1000.0\n\
    displaces_fluid = true\nlocked = [\"x\", \"rotation_y\"]\n\
    [contact]\nlaw = \"smooth\"\nspring = 2e4\nrestitution = 0.5\n[output]\nevery = 0\n";

/// Largest gamma that keeps the linear oscillation of the density error from growing, number density source: the
/// source is taken at the predicted positions, which makes it 4/3 and not the 4 of the plain oscillator.
pub const GAMMA_NUMBER_DENSITY: f64 = 4.0 / 3.0;
/// The same for the mixed source, where the density error shrinks by 1 - gamma a step.
pub const GAMMA_MIXED: f64 = 2.0;

fn simulation(text: &str, sets: &[String], context: &Context) -> Result<Simulation> {
    let (case, _, _) = parse("map", text.to_owned(), sets)?;
    Simulation::with_backend(&case, Scene::build(&case)?, |s, p, plan, settings| {
        (context.make)(Processor::Cpu, s, p, plan, settings)
    })
}

/// Energy of the water from the floor [J].
fn energy(simulation: &mut Simulation) -> Result<f64> {
    let m = simulation.backend.monitor()?;
    Ok(m.kinetic + m.potential)
}

fn failed(simulation: &mut Simulation, error: &Error) -> Measured {
    let mut out = Measured::failed(error);
    out.put("time reached [s]", simulation.time);
    out
}

/// A sloshing tank at `gamma` and `courant` = 2 sqrt(g H) dt / l0.
fn sloshing(preset: &str, gamma: f64, courant: f64, context: &Context) -> Result<Measured> {
    let reference = 2.0 * (9.80665_f64 * 0.2).sqrt();
    let sets = [format!("run.time_step={:?}", courant * 0.02 / reference), format!("fluid.preset={preset}")];
    let mut simulation = simulation(SLOSHING, &sets, context)?;
    // A case with gamma of 4 and more is refused: the map looks behind the guard.
    simulation.params.relaxation = Relaxation::Fixed(gamma);
    let start = energy(&mut simulation)?;
    let (mut rise, mut density, mut samples) = (0.0_f64, 0.0, 0.0);
    let mut out = Measured { machine: machine(&simulation), ..Measured::default() };
    while simulation.time < 1.2 {
        match simulation.step() {
            Err(error) => return Ok(failed(&mut simulation, &error)),
            Ok(report) => {
                if let Some((m, _)) = report.look {
                    rise = rise.max((m.kinetic + m.potential) / start - 1.0);
                    density += m.density_error_mean.max(0.0);
                    samples += 1.0;
                }
            }
        }
    }
    let lost = simulation.backend.counters()?.lost as f64;
    out.put("energy rise [-]", rise);
    out.put("compression [-]", density / samples);
    out.put("lost part [-]", lost / simulation.groups.fluid as f64);
    // The mixed source with the corrected gradient gains 1 to 3 % in two dimensions wherever it is stable.
    out.limit("energy rise [-]", 0.05);
    out.limit("compression [-]", 0.05);
    out.limit("lost part [-]", 0.0);
    Ok(out)
}

fn machine(simulation: &Simulation) -> String {
    format!("{}, {}", simulation.backend.description(), simulation.backend.precision())
}

/// Mean error of the pressure of still water over rho g H, and 2 z_c / H, over the last half of the run.
fn still(sets: &[String], gamma: f64, context: &Context) -> Result<(f64, f64, Simulation)> {
    let mut simulation = simulation(COLUMN, sets, context)?;
    simulation.params.relaxation = Relaxation::Fixed(gamma);
    let (end, weight) = (simulation.case.run.end, 1000.0 * 9.80665);
    let (mut square, mut depth, mut samples) = (0.0, 0.0, 0.0);
    while simulation.time < end {
        simulation.step()?;
        if simulation.time > 0.5 * end && simulation.steps % 4 == 0 {
            let (fields, monitor) = (simulation.backend.read()?, simulation.backend.monitor()?);
            let z = monitor.centroid[2];
            let (rms, _) = hydrostatics(
                &fields,
                simulation.groups.fluid,
                DVec3::Z,
                2.0 * z - simulation.params.zero_pressure_depth(),
                weight,
            );
            square += (rms / (weight * 0.4)).powi(2);
            depth += 2.0 * z / 0.4;
            samples += 1.0;
        }
    }
    Ok(((square / samples).sqrt(), depth / samples, simulation))
}

/// Largest gamma with a pressure error below `most` x rho g H, by bisection.
fn gamma_limit(preset: &str, most: f64, theory: f64, context: &Context) -> Result<Measured> {
    let mut out = Measured::default();
    let sets = [format!("fluid.preset={preset}"), "run.end=0.8".into()];
    let limit = bisect(0.05, 8.0, |gamma| match still(&sets, gamma, context) {
        Ok((error, _, simulation)) => {
            out.machine = machine(&simulation);
            Ok(error < most)
        }
        Err(Error::Diverged { .. }) => Ok(false),
        Err(other) => Err(other),
    })?;
    out.put("limit [-]", limit);
    out.put("theory [-]", theory);
    Ok(out)
}

/// Largest nu dt / l0^2 with which a sloshing tank keeps its energy, by bisection.
fn viscous_limit(dimensions: u32, context: &Context) -> Result<Measured> {
    let mut out = Measured::default();
    let mut sets = vec!["run.time_step=5e-4".to_string(), format!("run.dimensions={dimensions}")];
    if dimensions == 3 {
        sets.extend(["tank.max=[0.4,0.1,0.6]", "fluid.block.0.max=[0.2,0.1,0.2]"].map(str::to_string));
    }
    let (case, _, _) = parse("map", SLOSHING.to_owned(), &sets)?;
    let scene = Arc::new(Scene::build(&case)?);
    let limit = bisect(0.1, 2.0, |number| {
        let viscosity = number * 0.02 * 0.02 / 5e-4;
        // The check refuses cases beyond the limit: the map looks behind it.
        let mut simulation = Simulation::with_backend(&case, scene.clone(), |s, p, plan, settings| {
            (context.make)(Processor::Cpu, s, &Params { viscosity, ..p.clone() }, plan, settings)
        })?;
        simulation.params.viscosity = viscosity;
        out.machine = machine(&simulation);
        let start = energy(&mut simulation)?;
        while simulation.steps < 400 {
            match simulation.step() {
                Err(Error::Diverged { .. }) => return Ok(false),
                Err(other) => return Err(other),
                Ok(report)
                    if report.look.as_ref().is_some_and(|(m, _)| m.kinetic + m.potential > 1.01 * start) =>
                {
                    return Ok(false);
                }
                Ok(_) => {}
            }
        }
        Ok(true)
    })?;
    out.put("limit [-]", limit);
    out.put("theory [-]", Shear::smooth(dimensions, 2.1).limit);
    Ok(out)
}

fn compressible(alpha: f64, gamma: f64, context: &Context) -> Result<Measured> {
    let sets = [format!("fluid.compressibility={alpha:e}")];
    let (error, depth, simulation) = match still(&sets, gamma, context) {
        Ok(found) => found,
        Err(error @ Error::Diverged { .. }) => return Ok(Measured::failed(&error)),
        Err(other) => return Err(other),
    };
    let mut out = Measured { machine: machine(&simulation), ..Measured::default() };
    // Bulk modulus gamma / alpha: at depth h the water is compressed by alpha rho g h / gamma, on average by half
    // of that at the floor; the centroid sinks by a third of it.
    out.put("compression at the floor, theory [-]", alpha * 1000.0 * 9.80665 * 0.4 / gamma);
    out.put("volume [-]", depth);
    out.put("volume loss [-]", (1.0 - depth).max(0.0));
    out.put("pressure error [-]", error);
    out.limit("volume loss [-]", 0.05);
    out.limit("pressure error [-]", 0.25);
    Ok(out)
}

/// Schemes of the body map.
const SCHEMES: [&str; 2] = ["paper", "accurate"];

fn body(ratio: f64, scheme: usize, context: &Context) -> Result<Measured> {
    let preset = SCHEMES[scheme];
    let sets = [format!("body.0.density={:?}", 1000.0 * ratio), format!("fluid.preset={preset}")];
    let mut simulation = simulation(BODY, &sets, context)?;
    let mut out = Measured { machine: machine(&simulation), ..Measured::default() };
    let (mut last_v, mut last_a) = (0.0, f64::NAN);
    let (mut flips, mut square, mut count) = (0.0, 0.0, 0.0);
    // Before the body has moved far: what is asked is the coupling, not the flight.
    while simulation.steps < 60 {
        let step = match simulation.step() {
            Ok(report) => report,
            Err(error) => return Ok(failed(&mut simulation, &error)),
        };
        let v = simulation.solids.poses()[0].velocity.z;
        let a = (v - last_v) / step.dt;
        if simulation.steps > 10 {
            flips += (a - last_a).powi(2);
            square += a * a;
            count += 1.0;
        }
        (last_v, last_a) = (v, a);
    }
    let (flip, size) = ((flips / count).sqrt() / 2.0, (square / count).sqrt());
    out.put("alternating acceleration over g [-]", flip / 9.80665);
    out.put("acceleration over g [-]", size / 9.80665);
    out.limit("alternating acceleration over g [-]", 0.5);
    Ok(out)
}

/// The maps.
pub fn maps() -> Vec<Map> {
    let guards = || {
        vec![
            ("cap of gamma = (c_s dt / l0)^2: 0.5", vertical(0.5, (0.05, 1.5))),
            ("adaptive step: v dt / l0 = 0.35", horizontal((1e-3, 6.0), 0.35)),
        ]
    };
    let gamma = |method, file, title, limit: (&'static str, f64)| {
        let mut limits = vec![(limit.0, vertical(limit.1, (0.05, 1.5)))];
        limits.extend(guards());
        limits.push(("oscillator: sqrt(gamma) = 2", vertical(4.0, (0.05, 1.5))));
        let x = ("gamma", "gamma = (c_s dt / l0)^2 [-]");
        Map { method, file, title, x, y: ("courant", "2 sqrt(g H) dt / l0 [-]"), limits }
    };
    let ratio = ("ratio", "density of the body over that of water [-]");
    let alpha = [0.01, 0.04, 0.16].map(|g| [1e-3 * g / (1000.0 * 9.80665 * 0.4), g]);
    vec![
        gamma(
            "gamma x CFL, paper",
            "gamma-paper",
            "Number density source",
            ("theory: gamma = 4/3", GAMMA_NUMBER_DENSITY),
        ),
        gamma("gamma x CFL, accurate", "gamma-accurate", "Mixed source", ("theory: gamma = 2", GAMMA_MIXED)),
        Map {
            method: "alpha",
            file: "alpha",
            title: "Artificial compressibility",
            x: ("alpha", "alpha [1/Pa]"),
            y: ("gamma", "gamma [-]"),
            limits: vec![
                ("rule: 0.1 % compression", alpha.to_vec()),
                ("theory: 10 % compression", alpha.map(|[a, g]| [100.0 * a, g]).to_vec()),
            ],
        },
        Map {
            method: "density ratio",
            file: "density-ratio",
            title: "Light and heavy bodies in water",
            x: ratio,
            y: ("scheme", "1 paper, number density   2 accurate, in the equation"),
            limits: vec![("added mass, 1.19 in an endless fluid", vertical(1.19, (1.0, 2.0)))],
        },
        tolerance_map("tolerance, f64", "tolerance-f64", "Jacobi, f64: is the tolerance met?"),
        tolerance_map("tolerance, f32", "tolerance-f32", "Jacobi, f32 emulated: is the tolerance met?"),
    ]
}

fn tolerance_map(method: &'static str, file: &'static str, title: &'static str) -> Map {
    let size = ("spacing", "spacing of a column 0.5 m deep [m]");
    let limits = vec![("default tolerance", horizontal((0.008, 0.1), 1e-3))];
    Map { method, file, title, x: size, y: ("tolerance", "tolerance ||r|| / ||b|| [-]"), limits }
}

/// The points.
pub fn jobs(full: bool) -> Vec<Job> {
    let mut jobs = Vec::new();
    let courants: &[f64] = if full {
        &[0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.5]
    } else {
        &[0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.5]
    };
    for (method, preset) in [("gamma x CFL, paper", "paper"), ("gamma x CFL, accurate", "accurate")] {
        for gamma in [1e-3, 4e-3, 0.016, 0.06, 0.13, 0.25, 0.5, 1.0, 1.25, 1.6, 2.2, 3.0, 4.5] {
            for &courant in courants {
                let parameters = [("gamma", format!("{gamma:e}")), ("courant", courant.to_string())];
                jobs.push(Job::new(method, &parameters, 0.4 / courant, move |context| {
                    sloshing(preset, gamma, courant, context)
                }));
            }
        }
    }
    for (preset, theory) in [("paper", GAMMA_NUMBER_DENSITY), ("accurate", GAMMA_MIXED)] {
        for most in [0.25, 1.0] {
            let parameters = [("preset", preset.to_string()), ("pressure error below", most.to_string())];
            jobs.push(Job::new("largest gamma", &parameters, 80.0, move |context| {
                gamma_limit(preset, most, theory, context)
            }));
        }
    }
    for dimensions in [2, 3] {
        jobs.push(Job::new(
            "largest nu dt / l0^2",
            &[("dimensions", dimensions.to_string())],
            20.0,
            move |context| viscous_limit(dimensions, context),
        ));
    }
    for gamma in [0.01, 0.04, 0.16] {
        for alpha in [2e-10, 1e-9, 1e-8, 3e-8, 1e-7, 3e-7, 1e-6, 1e-5] {
            let parameters = [("alpha", format!("{alpha:e}")), ("gamma", gamma.to_string())];
            jobs.push(Job::new("alpha", &parameters, 8.0, move |context| {
                compressible(alpha, gamma, context)
            }));
        }
    }
    for scheme in 0..SCHEMES.len() {
        for ratio in [0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0, 1.4, 2.0, 5.0, 10.0, 20.0] {
            let parameters = [("ratio", f64::to_string(&ratio)), ("scheme", (scheme + 1).to_string())];
            jobs.push(Job::new("density ratio", &parameters, 1.0, move |context| {
                body(ratio, scheme, context)
            }));
        }
    }
    let spacings: &[f64] =
        if full { &[0.1, 0.05, 0.025, 0.0125, 0.00833333333] } else { &[0.1, 0.05, 0.025, 0.0125] };
    for single in [false, true] {
        for &spacing in spacings {
            for tolerance in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12] {
                let method = if single { "tolerance, f32" } else { "tolerance, f64" };
                let parameters =
                    [("spacing", format!("{spacing:.6}")), ("tolerance", format!("{tolerance:e}"))];
                let weight = 1e-6 * spacing.powi(-4);
                jobs.push(Job::new(method, &parameters, weight, move |context| {
                    pressure_solve::point(spacing, single, tolerance, context)
                }));
            }
        }
    }
    jobs
}
