//! Map of contact: dt sqrt(K / m) x damping ratio, of the contact law itself and of the bare integrator.

use super::engine::Job;
use super::row::Measured;
use super::spring_static::{SPACING, contact, mass, scene};
use super::stability::{Map, bisect};
use seixo::body::Wrench;
use seixo::case::Law;
use seixo::contact::Solids;
use seixo::error::Result;

const SPRING: f64 = 1e5;
/// Steps of a point.
const STEPS: usize = 2000;
const GRAVITY: f64 = 9.80665;

/// dt sqrt(K / m) at the limit of symplectic Euler with damping ratio `zeta`: (omega dt)^2 = 4 - 2 C dt / m with
/// C dt / m = 2 zeta omega dt.
pub fn theory(zeta: f64) -> f64 {
    2.0 * ((1.0 + zeta * zeta).sqrt() - zeta)
}

/// The resting cube of section 4.1 with the paper's law and one sub-step forced.
fn law(omega_dt: f64, zeta: f64) -> Result<Measured> {
    let dt = omega_dt * (mass() / SPRING).sqrt();
    let mut out = Measured { machine: "CPU, 1 thread, f64".into(), ..Measured::default() };
    let mut solids = Solids::new(&scene(Law::Paper), Some(&contact(Law::Paper, SPRING, zeta, true)))?;
    let sag = mass() * GRAVITY / SPRING;
    let rest = solids.poses()[0].position.z - sag;
    let mut largest = 0.0_f64;
    for step in 0..STEPS {
        solids.advance(step as f64 * dt, dt, &[Wrench::default()])?;
        largest = largest.max((solids.poses()[0].position.z - rest).abs() / sag);
        if largest > 100.0 {
            break;
        }
    }
    out.put("largest swing over sag [-]", largest);
    out.put("largest swing over l0 [-]", largest * sag / SPACING);
    // From rest at the touching distance the exact one never exceeds 1.
    out.limit("largest swing over sag [-]", 1.2);
    Ok(out)
}

/// Whether an oscillator of unit mass and stiffness swings without growing, with the order of operations of a
/// contact sub-step: force at the old state, then velocity, then position.
fn bare(omega_dt: f64, zeta: f64) -> bool {
    let (mut x, mut v, mut largest) = (1.0_f64, 0.0_f64, 1.0_f64);
    for step in 0..20_000 {
        v -= omega_dt * (x + 2.0 * zeta * v);
        x += omega_dt * v;
        if step == 10_000 {
            largest = 0.0;
        }
        largest = largest.max(x.abs());
        if largest > 1e6 {
            return false;
        }
    }
    // Two halves of the run are compared: growth of any rate shows.
    largest <= 1e3
}

/// The map.
pub fn maps() -> Vec<Map> {
    let zetas = [0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 0.5, 1.0, 2.0, 3.0];
    let guard = |z: f64| theory(z).min(1.0);
    let x = ("omega_dt", "dt sqrt(K / m) [-]");
    vec![Map {
        method: "contact",
        file: "contact",
        title: "Contact spring, one sub-step",
        x,
        y: ("zeta", "damping ratio C / (2 sqrt(K m)) [-]"),
        limits: vec![
            ("theory: (w dt)^2 = 4 - 2 C dt / m", zetas.map(|z| [theory(z), z]).to_vec()),
            ("guard of a forced single step", zetas.map(|z| [guard(z), z]).to_vec()),
            ("sub-steps begin: w dt = 0.5", vec![[0.5, 0.001], [0.5, 3.0]]),
        ],
    }]
}

/// The points.
pub fn jobs(full: bool) -> Vec<Job> {
    let mut jobs = Vec::new();
    let zetas: &[f64] = if full {
        &[0.001, 0.003, 0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0]
    } else {
        &[0.001, 0.01, 0.1, 0.3, 0.5, 1.0, 2.0]
    };
    for &zeta in zetas {
        for omega_dt in [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.6, 1.9, 2.1] {
            let parameters = [("omega_dt", f64::to_string(&omega_dt)), ("zeta", zeta.to_string())];
            jobs.push(Job::new("contact", &parameters, 0.3, move |_| law(omega_dt, zeta)));
        }
        jobs.push(Job::new("bare contact step", &[("zeta", zeta.to_string())], 0.1, move |_| {
            let mut out = Measured { machine: "CPU, 1 thread, f64".into(), ..Measured::default() };
            out.put("limit [-]", bisect(0.05, 4.0, |omega_dt| Ok(bare(omega_dt, zeta)))?);
            out.put("theory [-]", theory(zeta));
            Ok(out)
        }));
    }
    jobs
}
