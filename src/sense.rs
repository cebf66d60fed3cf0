//! Numbers of a case that only its scene shows to be beyond sense: refused before anything is computed.

use crate::case::Case;
use crate::contact::Solids;
use crate::error::{CaseError, Problem, Result};
use crate::params::Params;
use crate::scene::Scene;
use crate::time_step::{Bounds, DRAG_LIMIT, collapse_speed, expected_speed, ready_speed, time_step};

/// v dt / l0 of the collapse from rest beyond which a fixed step means nothing: particles pass through each other.
const COURANT_REFUSED: f64 = 4.0;
/// Compression of the water at the floor beyond which it is none, alpha rho g H / gamma [-].
const COMPRESSION_REFUSED: f64 = 1.0;

/// Refuses what no run can make sense of; `plan` and `run` ask the same.
///
/// # Errors
/// [`crate::error::Error::Case`] with everything that is wrong.
pub fn refuse(case: &Case, scene: &Scene, params: &Params, solids: &Solids) -> Result<()> {
    let mut problems = Vec::new();
    let wet = scene.groups.fluid > 0;
    // The longest step of a run: that of a flow before any speed is measured.
    let dt = time_step(
        params,
        case.run.time_step,
        case.run.adaptive && wet,
        ready_speed(params, params.speed_at_start),
    );
    if wet {
        problems.extend(too_long(case, params));
        problems.extend(too_light(case, params));
        problems.extend(too_soft(case, params, dt));
    }
    problems.extend(solids.refuses(dt));
    if problems.is_empty() { Ok(()) } else { Err(CaseError::all(problems).into()) }
}

/// A fixed time step against the speed of the collapse from rest.
fn too_long(case: &Case, params: &Params) -> Option<CaseError> {
    let (dt, l0) = (case.run.time_step, params.spacing);
    let speed = collapse_speed(params);
    let courant = speed * dt / l0;
    (!case.run.adaptive && courant > COURANT_REFUSED).then(|| {
        let message = format!(
            "{dt} s takes water that collapses at {speed:.2} m/s {courant:.1} particles far in a step"
        );
        let remedy = format!("use {:.1e} s or less, or run.adaptive = true", 0.35 * l0 / speed);
        Problem::new("run.time_step", message, remedy).into()
    })
}

/// A fixed time step against how fast the water takes a light body along.
fn too_light(case: &Case, params: &Params) -> Option<CaseError> {
    let (dt, speed) = (case.run.time_step, expected_speed(params));
    let bound = Bounds::new(params, speed).drag;
    let number = dt / bound;
    (!case.run.adaptive && number > DRAG_LIMIT).then(|| {
        let message = format!(
            "{dt} s is too long for the body `{}`, which viscosity and wall friction take along within {bound:.1e} s where it is under \
             water: from {DRAG_LIMIT} times that on it is unstable",
            params.drag.body(speed)
        );
        let remedy = format!("use {bound:.1e} s or less, or run.adaptive = true");
        Problem::new("run.time_step", message, remedy).into()
    })
}

/// Artificial compressibility against the weight of the water: the bulk modulus of Eq. (8) is gamma / alpha.
fn too_soft(case: &Case, params: &Params, dt: f64) -> Option<CaseError> {
    let alpha = case.fluid.as_ref()?.compressibility?;
    let head = params.density * params.gravity.length() * params.depth;
    let gamma = params.step(0.0, dt, expected_speed(params)).relaxation;
    let compression = alpha * head / gamma;
    (compression > COMPRESSION_REFUSED).then(|| {
        let message = format!(
            "{alpha:e} 1/Pa lets the weight of the water press it together {compression:.1e} times (alpha rho g H / gamma)"
        );
        let remedy = format!("leave it out, or use {:.1e} 1/Pa or less", 1e-3 * gamma / head);
        Problem::new("fluid.compressibility", message, remedy).into()
    })
}
