//! What a stage does to the energy v^2 / 2 - g . x of a particle, per mass [m2/s2], from the state before the stage.
//! GPU twin: shaders/ledger.wgsl

use crate::kernels::correct::{correct, kick};
use crate::kernels::predict::predict;
use crate::params::{Params, Step};
use glam::DVec3;

/// Energy gained from position and velocity `before` to `after`.
fn gain(before: (DVec3, DVec3), after: (DVec3, DVec3), gravity: DVec3) -> f64 {
    let (way, change) = (after.0 - before.0, after.1 - before.1);
    change.dot(before.1 + 0.5 * change) - gravity.dot(way)
}

/// Work of gravity, of viscosity with its acceleration `viscous`, and of the clamp, in `predict`.
pub(crate) fn predict_work(x: DVec3, v: DVec3, viscous: DVec3, params: &Params, step: &Step) -> [f64; 3] {
    let total = params.explicit_gravity() + viscous;
    let (to, new, _) = predict(x, v, total, step, params.spacing);
    let viscosity = step.dt * viscous.dot(v + 0.5 * step.dt * total);
    let free = gain((x, v), (x + step.ahead * new, new), params.gravity);
    let clamp = gain((x, v), (to, new), params.gravity) - free;
    [free - viscosity, viscosity, clamp]
}

/// Work of the acceleration `part` where `total` acts, in `kick` without its clamp: the velocity is changed, and
/// the position by what the change would have moved it.
pub(crate) fn kick_work(v: DVec3, part: DVec3, total: DVec3, gravity: DVec3, step: &Step) -> f64 {
    step.dt * part.dot(v + 0.5 * step.dt * total) - step.carried() * step.dt * gravity.dot(part)
}

/// Work of gravity on what is left of the way after `total` has acted in `correct`.
pub(crate) fn rest_work(v: DVec3, total: DVec3, gravity: DVec3, step: &Step) -> f64 {
    -step.rest() * gravity.dot(v + step.dt * total)
}

/// Work of the clamps of a particle that went from `before` to `after` where it would have gained `free`.
fn clamp_work(
    before: (DVec3, DVec3),
    after: (DVec3, DVec3, bool),
    gravity: DVec3,
    free: impl Fn() -> f64,
) -> f64 {
    let (to, new, clamped) = after;
    if clamped { gain(before, (to, new), gravity) - free() } else { 0.0 }
}

/// Work of the clamp in `kick`.
pub(crate) fn kick_clamp(x: DVec3, v: DVec3, total: DVec3, params: &Params, step: &Step) -> f64 {
    let after = kick(x, v, total, step, params.spacing);
    clamp_work((x, v), after, params.gravity, || kick_work(v, total, total, params.gravity, step))
}

/// Work of the clamps in `correct`.
pub(crate) fn correct_clamp(x: DVec3, v: DVec3, total: DVec3, params: &Params, step: &Step) -> f64 {
    let (after, g) = (correct(x, v, total, step, params.spacing), params.gravity);
    clamp_work((x, v), after, g, || kick_work(v, total, total, g, step) + rest_work(v, total, g, step))
}
