//! How far single precision may part a device from the CPU in one step.

use super::StageError;
use seixo::params::{Params, Step};

/// Part of states and pairs that may differ: of what lies on a border of rounding.
const FLIPS: f64 = 1e-4;
/// Of contact, which knows no lattice.
const CONTACT: f64 = 1e-4;
/// Of arithmetic alone.
const ARITHMETIC: f64 = 1e-5;
/// Over the rounding of a place: what sums over neighbours make of it.
const SUMS: f64 = 4.0;
/// From the pressure solve on: what is not its tolerance's, and over that tolerance, as both may stop anywhere below it.
const SOLVE: f64 = 4e-3;
const STOPS: f64 = 10.0;

/// Sizes of a scene and a step that bounds hang on.
pub(super) struct Bounds {
    /// Rounding of a number of the largest coordinate, over l0 [-]: devices count from the middle of the domain.
    place: f64,
    /// Of the pressure and what follows from it [-].
    solve: f64,
    /// Of the source [Pa/m2]: the deviation of number densities that [`Bounds::place`] makes.
    source: f64,
    gravity: f64,
    /// Weight of a particle of water [N].
    weight: f64,
    dt: f64,
    spacing: f64,
}

impl Bounds {
    /// In a scene of `params` at `step`, pressures solved to `tolerance`.
    pub fn new(params: &Params, step: &Step, tolerance: f64) -> Self {
        let farthest = 0.5 * (params.domain_max - params.domain_min).max_element();
        let place = 0.5 * f64::from(f32::EPSILON) * farthest / params.spacing;
        Self {
            place,
            solve: SOLVE + STOPS * tolerance,
            source: SUMS * place * step.relaxation * params.density / step.dt.powi(2),
            gravity: params.gravity.length(),
            weight: params.particle_mass() * params.gravity.length(),
            dt: step.dt,
            spacing: params.spacing,
        }
    }

    /// The largest [`StageError::l2_relative`] of a device that computes what the CPU does. Water at rest has small
    /// accelerations and speeds, as differences of large ones, and so has what it does to walls: theirs is over gravity, what it gives in a step, and a
    /// particle's weight.
    pub fn of(&self, error: &StageError) -> f64 {
        let before = ARITHMETIC + SUMS * self.place;
        let over = |natural: f64| (natural / error.size.max(f64::MIN_POSITIVE)).max(1.0);
        match (error.stage, error.field) {
            (_, "pairs" | "state" | "kind") => FLIPS,
            ("contact", _) => CONTACT,
            ("pressure_source", "source") => before + self.source / error.size.max(f64::MIN_POSITIVE),
            ("conjugate_gradient" | "body_force", _) => self.solve,
            (_, "acceleration") if error.stage == "pressure_gradient" => self.solve * over(self.gravity),
            ("correct" | "shift", "position") => {
                before + self.solve * self.gravity * self.dt.powi(2) / self.spacing
            }
            ("correct" | "shift", _) => self.solve * over(self.gravity * self.dt),
            (_, "reaction") => before * over(self.weight),
            _ => before,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(stage: &'static str, field: &'static str, l2_relative: f64, size: f64) -> StageError {
        StageError { stage, field, max_relative: l2_relative, l2_relative, size, bound: f64::INFINITY }
    }

    #[test]
    fn water_at_rest_is_held_against_gravity() {
        let bounds = Bounds {
            place: 6e-6,
            solve: 5e-3,
            source: 1.0,
            gravity: 10.0,
            weight: 0.01,
            dt: 1e-3,
            spacing: 0.01,
        };
        let beyond = |stage, field, l2, size| {
            let error = error(stage, field, l2, size);
            let error = StageError { bound: bounds.of(&error), ..error };
            !error.is_explained()
        };
        assert!(beyond("predict", "velocity", 1e-4, 1.0) && !beyond("predict", "velocity", 2e-5, 1.0));
        // 0.04 m/s2 are less than the solve's part of gravity, 0.06 m/s2 are more, whatever is left of it.
        for size in [1e-3, 0.1, 1.0, 10.0] {
            assert!(!beyond("pressure_gradient", "acceleration", 0.04 / size, size), "{size} m/s2");
            assert!(beyond("pressure_gradient", "acceleration", 0.06 / size, size), "{size} m/s2");
        }
        assert!(beyond("pressure_gradient", "acceleration", 6e-3, 100.0));
        assert!(!beyond("collision", "reaction", 1e-4, 1e-3) && beyond("collision", "reaction", 1e-4, 0.1));
        assert!(beyond("neighbour_list", "pairs", 1e-3, 1.0) && beyond("contact", "force", 1e-3, 1.0));
    }
}
