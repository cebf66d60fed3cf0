//! The time step of a case that gives none.

use super::Case;
use crate::error::Problem;
use glam::DVec3;
use std::f64::consts::TAU;

/// dt sqrt(g / l0) at most [-]: of water that begins to fall, and of waves as short as the spacing shows them. The flow may hold it back
/// further.
pub(crate) const FALL_MAX: f64 = 0.15;
/// The step of a dry scene over sqrt(l0 / g) [-]: nothing but contact holds it back, which cuts it so often and no more.
const DRY: f64 = 0.02;
/// How far a solid may go in the step of a dry scene, in spacings.
const WAY: f64 = 0.35;

impl Case {
    /// Takes the time step of a case that gives none, and what goes with it; a problem if nothing tells one or if the case, which says
    /// `adaptive` or not, wants it fixed.
    pub(super) fn take_time_step(&mut self, adaptive: Option<bool>) -> Option<Problem> {
        let (wet, fastest) = (self.fluid.is_some(), self.fastest_solid());
        let run = &mut self.run;
        let (l0, gravity) = (run.spacing, DVec3::from(run.gravity).length());
        // Where these are wrong, which is told elsewhere, any will do.
        run.time_step = 1e-3;
        if !(l0 > 0.0 && l0.is_finite() && gravity.is_finite()) {
            return None;
        }
        if gravity == 0.0 {
            let message = "there is none, and without gravity nothing tells one";
            return Some(Problem::new("run.time_step", message, "add it [s], e.g. `time_step = 1e-3`"));
        }
        if wet && adaptive == Some(false) {
            let message = "without a time step it is the flow that sets it";
            return Some(Problem::new("run.adaptive", message, "remove `adaptive`, or add `time_step`"));
        }
        let weight = (l0 / gravity).sqrt();
        let step = if wet { FALL_MAX * weight } else { (DRY * weight).min(WAY * l0 / fastest.max(1e-9)) };
        // Two digits, as one would type it; a shorter run is one step.
        run.time_step = format!("{step:.1e}").parse().unwrap_or(step);
        if run.end > 0.0 {
            run.time_step = run.time_step.min(run.end);
        }
        run.adaptive |= wet;
        None
    }

    /// The fastest that a solid starts or is driven along [m/s], turns and waves left out.
    fn fastest_solid(&self) -> f64 {
        let along = |rows: &[[f64; 4]]| {
            let speed = |w: &[[f64; 4]]| {
                let way = DVec3::new(w[1][1] - w[0][1], w[1][2] - w[0][2], w[1][3] - w[0][3]);
                way.length() / (w[1][0] - w[0][0]).max(1e-9)
            };
            rows.windows(2).map(speed).fold(0.0, f64::max)
        };
        let to_and_fro =
            |sine: Option<&super::Sine>| sine.map_or(0.0, |s| TAU * s.amplitude.abs() / s.period);
        let walls = self.moving_wall.iter().map(|w| along(&w.motion).max(to_and_fro(w.sine.as_ref())));
        let bodies = self.body.iter().map(|b| {
            let driven = along(b.motion.as_deref().unwrap_or_default()).max(to_and_fro(b.sine.as_ref()));
            driven.max(DVec3::from(b.velocity).length())
        });
        walls.chain(bodies).filter(|v| v.is_finite()).fold(0.0, f64::max)
    }
}
