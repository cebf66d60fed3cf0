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
    step.dt * part.dot(v + 0.5 * step.dt * total) - step.carried * step.dt * gravity.dot(part)
}

/// Work of gravity on what is left of the way after `total` has acted in `correct`.
pub(crate) fn rest_work(v: DVec3, total: DVec3, gravity: DVec3, step: &Step) -> f64 {
    -(step.dt - step.ahead) * gravity.dot(v + step.dt * total)
}

/// Work of the clamp in `kick`.
pub(crate) fn kick_clamp(x: DVec3, v: DVec3, total: DVec3, params: &Params, step: &Step) -> f64 {
    let (to, new, clamped) = kick(x, v, total, step, params.spacing);
    if !clamped {
        return 0.0;
    }
    gain((x, v), (to, new), params.gravity) - kick_work(v, total, total, params.gravity, step)
}

/// Work of the clamps in `correct`.
pub(crate) fn correct_clamp(x: DVec3, v: DVec3, total: DVec3, params: &Params, step: &Step) -> f64 {
    let (to, new, clamped) = correct(x, v, total, step, params.spacing);
    if !clamped {
        return 0.0;
    }
    let free = kick_work(v, total, total, params.gravity, step) + rest_work(v, total, params.gravity, step);
    gain((x, v), (to, new), params.gravity) - free
}
