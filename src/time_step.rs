//! How long a time step may be: one rule for a run and for what is said of it before.

use crate::case::FALL_MAX;
use crate::params::{Params, Relaxation};

/// Displacement of the fastest particles in a step over l0, v dt / l0, at most [-].
pub(crate) const COURANT_MAX: f64 = 0.35;
/// The same of the fastest one alone, spray that flies freely included, as long as that makes a step no shorter than
/// a part of [`SPRAY`] of it.
const COURANT_FASTEST: f64 = 0.6;
/// See [`COURANT_FASTEST`].
const SPRAY: f64 = 0.25;
/// dt sqrt(g H) / l0 at most [-]: of long waves, and of calm water that a gate lets go at the depth H. It has gone a third of a
/// spacing after two steps, and the flow is looked at then ([`looks_every`]).
const LONG_WAVE_MAX: f64 = 0.6;
/// Speed that water is taken to come to, over the one that it has, up to that of a collapse [-]. At v dt / l0 = 0.35 of what it has a
/// collapse in space gains 0.2 % of energy on its way down, at 0.25 nothing.
const HURRY: f64 = 1.4;
/// Steps between looks at the flow at most.
const LOOK_EVERY: u64 = 10;
/// c_s dt / l0 at most where c_s is typed, or that of the number density source [-].
pub(crate) const SOUND_MAX: f64 = 0.7;
/// The rate at which water takes free bodies along, times a fixed dt, from which on it is unstable whatever the water does [-].
pub(crate) const DRAG_LIMIT: f64 = 2.0;
/// nu dt / l0^2 at most, as a part of the limit of explicit viscosity [-].
pub(crate) const VISCOUS_MAX: f64 = 0.5;

/// Longest time steps that each part of the scheme allows [s]; infinite where it sets no bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Of the displacement in a step.
    pub flow: f64,
    /// Of what the weight of the water may begin at any time.
    pub weight: f64,
    /// Of the density error's oscillation.
    pub sound: f64,
    /// Of explicit viscosity.
    pub viscous: f64,
    /// Of light bodies, which viscosity and the friction of walls take along.
    pub drag: f64,
}

impl Bounds {
    /// Bounds of a flow whose fastest particles reach `speed` [m/s].
    pub fn new(params: &Params, speed: f64) -> Self {
        let l0 = params.spacing;
        let sound = match params.relaxation {
            // Gamma is held back instead of the step.
            Relaxation::Speed(_) if params.follows_flow => f64::INFINITY,
            Relaxation::Speed(c) => SOUND_MAX * l0 / c,
            Relaxation::Fixed(_) => f64::INFINITY,
        };
        let viscous = if params.viscosity > 0.0 {
            VISCOUS_MAX * params.shear.limit * l0 * l0 / params.viscosity
        } else {
            f64::INFINITY
        };
        let drag = params.drag.rate(speed).recip();
        let falls = FALL_MAX * (l0 / params.gravity.length()).sqrt();
        let weight = falls.min(LONG_WAVE_MAX * l0 / (0.5 * collapse_speed(params)));
        Self { flow: COURANT_MAX * l0 / speed.max(1e-9), weight, sound, viscous, drag }
    }

    /// The shortest of them [s].
    pub fn shortest(&self) -> f64 {
        self.flow.min(self.weight).min(self.sound).min(self.viscous).min(self.drag)
    }
}

/// Speed of a collapse of the water from rest, 2 sqrt(g H) [m/s]; 0 where it fills all its room.
pub fn collapse_speed(params: &Params) -> f64 {
    if params.filled { 0.0 } else { 2.0 * (params.gravity.length() * params.depth).sqrt() }
}

/// Steps of `dt` [s] between looks at the flow: the fewer the longer they are beside those of a collapse.
pub(crate) fn looks_every(params: &Params, dt: f64) -> u64 {
    ((LOOK_EVERY as f64 * collapse_step(params) / dt) as u64).clamp(1, LOOK_EVERY)
}

/// Step of a collapse [s], infinite where there is none: a longer adaptive one undoes errors of the density at the same rate.
pub(crate) fn collapse_step(params: &Params) -> f64 {
    COURANT_MAX * params.spacing / collapse_speed(params)
}

/// Speed to be ready for where the water has `speed` [m/s].
pub(crate) fn ready_speed(params: &Params, speed: f64) -> f64 {
    speed.max((HURRY * speed).min(collapse_speed(params)))
}

/// Largest speed to reckon with before any is measured [m/s]: of the water at t = 0, or of its collapse.
pub fn expected_speed(params: &Params) -> f64 {
    collapse_speed(params).max(params.speed_at_start)
}

/// The time step [s] of a case whose largest is `typed` [s].
pub fn time_step(params: &Params, typed: f64, adaptive: bool, speed: f64) -> f64 {
    if adaptive { typed.min(Bounds::new(params, speed).shortest()) } else { typed }
}

/// An adaptive step of `dt` [s], shortened for the single fastest particle of water [m/s].
pub fn shortened(params: &Params, dt: f64, fastest: f64) -> f64 {
    dt.min((COURANT_FASTEST * params.spacing / fastest).max(SPRAY * dt))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::scene::Scene;

    #[test]
    fn spray_shortens_a_step_to_a_quarter_at_most_and_what_plunges_sets_c_s() {
        let text = "[run]\nspacing = 0.1\ntime_step = 1e-2\nend = 1.0\ngravity = [0, 0, 0]\n[fluid]\n[[fluid.block]]\n\
                    min = [0, 0, 0]\nmax = [1, 1, 1]\n";
        let case: Case = toml::from_str(text).expect("a case");
        let params = Params::new(&case, &Scene::build(&case).expect("a scene")).expect("parameters");
        let of = |fastest: f64| shortened(&params, 1e-2, fastest);
        assert_eq!([of(0.0), of(6.0)], [1e-2; 2]);
        assert!((of(12.0) - 5e-3).abs() < 1e-12);
        assert_eq!(of(100.0), 2.5e-3);
        // Without weight there is no other speed.
        let c_s = |flow: f64, driven: f64| params.relaxation(1e-2, flow, driven).sqrt() * 0.1 / 1e-2;
        assert!((c_s(1.0, 0.0) - 2.5).abs() < 1e-12 && (c_s(1.0, 2.0) - 5.0).abs() < 1e-12);
    }
}
