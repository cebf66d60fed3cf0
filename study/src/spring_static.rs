//! Section 4.1, first part: a cube at rest on a plane. Amplitude against K (Fig. 3) and damping curves
//! against the analytic oscillator (Fig. 4).

use super::dry::{DryScene, FreeBox, GRAVITY};
use glam::DVec3;
use seixo::body::Wrench;
use seixo::case::{Contact, Law};
use seixo::contact::{Solids, standing_gap};
use seixo::error::Result;
use seixo::scene::Scene;
use serde::Serialize;
use std::time::Instant;

/// Edge of the cube [m].
pub const EDGE: f64 = 0.2;
/// Density of the cube [kg/m3].
pub const DENSITY: f64 = 2660.0;
/// Spacing [m].
pub const SPACING: f64 = 0.025;
/// Spring coefficients of Fig. 3 [N/m].
pub const SPRINGS: [f64; 4] = [1e5, 1e6, 1e7, 5e7];
/// The only amplitude of Fig. 3 that the text prints: 17.4 % of l0 at K = 5e7 N/m.
pub const PAPER_LARGEST: f64 = 0.174;
/// The paper's criterion: amplitude below 20 % of l0.
pub const PAPER_LIMIT: f64 = 0.2;
/// Damping ratios of Fig. 4.
pub const DAMPING_RATIOS: [f64; 4] = [1.0, 0.5, 0.1, 0.01];

/// Amplitude of the resting cube.
#[derive(Clone, Debug, Serialize)]
pub struct AmplitudeRow {
    /// K [N/m].
    pub spring: f64,
    /// C / C_crit [-].
    pub damping_ratio: f64,
    /// Time step [s].
    pub time_step: f64,
    /// Largest minus smallest height of the centre over l0 [-].
    pub amplitude_over_l0: f64,
    /// The same of the analytic oscillator, 2 m g / (K l0) undamped, m g / (K l0) critically damped.
    pub analytic_over_l0: f64,
    /// Start minus end height over l0 [-].
    pub sag_over_l0: f64,
    /// dt sqrt(K / m_e) [-].
    pub omega_dt: f64,
    /// Wall time [s].
    pub wall_time: f64,
}

/// A point of a damping curve.
#[derive(Clone, Debug, Serialize)]
pub struct OscillationRow {
    /// Time [s].
    pub time: f64,
    /// Height above the position of rest over l0 [-].
    pub height_over_l0: f64,
    /// The analytic oscillator's [-].
    pub analytic_over_l0: f64,
}

/// Mass of the cube [kg].
pub fn mass() -> f64 {
    DENSITY * EDGE.powi(3)
}

/// A contact section with `law`, K [N/m] and C / C_crit of the section's body; forced to one sub-step
/// where `single` (the paper's time step stands for itself) and without torque, as the case is symmetric.
pub(crate) fn contact(law: Law, spring: f64, damping_ratio: f64, single: bool) -> Contact {
    Contact {
        law,
        spring: Some(spring),
        damping: None,
        damping_ratio: Some(damping_ratio),
        restitution: None,
        viscous_friction: 0.0,
        friction: 0.0,
        torque: false,
        substeps: single.then_some(1),
        device: Default::default(),
        pair: vec![],
    }
}

/// The cube at its standing distance above a lattice floor, particle over particle ("aligned").
pub fn scene(law: Law) -> Scene {
    let center = DVec3::new(0.5 * SPACING, 0.5 * SPACING, 0.5 * EDGE + standing_gap(law, SPACING));
    DryScene::new(SPACING, DVec3::new(-0.4, -0.4, -0.1), DVec3::new(0.4, 0.4, 2.5))
        .floor()
        .particle_floor((-0.15, -0.15), (0.175, 0.175))
        .body(&FreeBox::new(DVec3::splat(EDGE), DENSITY, center))
        .build()
}

/// Rests the cube for `seconds` and measures its amplitude.
///
/// # Errors
/// Those of [`Solids::new`] and [`Solids::advance`].
pub fn amplitude(law: Law, spring: f64, damping_ratio: f64, dt: f64, seconds: f64) -> Result<AmplitudeRow> {
    let clock = Instant::now();
    let scene = scene(law);
    let mut solids = Solids::new(&scene, Some(&contact(law, spring, damping_ratio, law == Law::Paper)))?;
    let start = solids.poses()[0].position.z;
    let (mut low, mut high, mut omega_dt) = (start, start, 0.0);
    for step in 0..(seconds / dt).round() as usize {
        omega_dt = solids.advance(step as f64 * dt, dt, &[Wrench::default()])?.omega_dt;
        let z = solids.poses()[0].position.z;
        (low, high) = (low.min(z), high.max(z));
    }
    let sag = mass() * GRAVITY / spring / SPACING;
    let overshoot = if damping_ratio < 1.0 {
        (-damping_ratio * std::f64::consts::PI / (1.0 - damping_ratio * damping_ratio).sqrt()).exp()
    } else {
        0.0
    };
    Ok(AmplitudeRow {
        spring,
        damping_ratio,
        time_step: dt,
        amplitude_over_l0: (high - low) / SPACING,
        analytic_over_l0: sag * (1.0 + overshoot),
        sag_over_l0: (start - solids.poses()[0].position.z) / SPACING,
        omega_dt,
        wall_time: clock.elapsed().as_secs_f64(),
    })
}

/// Fig. 4: the damped oscillation at K [N/m] beside the analytic one.
///
/// # Errors
/// Those of [`Solids::new`] and [`Solids::advance`].
pub fn oscillation(
    law: Law,
    spring: f64,
    damping_ratio: f64,
    dt: f64,
    seconds: f64,
) -> Result<Vec<OscillationRow>> {
    let scene = scene(law);
    let mut solids = Solids::new(&scene, Some(&contact(law, spring, damping_ratio, law == Law::Paper)))?;
    let sag = mass() * GRAVITY / spring;
    let rest = solids.poses()[0].position.z - sag;
    let omega = (spring / mass()).sqrt();
    let mut rows = vec![];
    for step in 0..(seconds / dt).round() as usize {
        solids.advance(step as f64 * dt, dt, &[Wrench::default()])?;
        let t = (step + 1) as f64 * dt;
        let z = damping_ratio;
        let analytic = if z < 1.0 {
            let damped = (1.0 - z * z).sqrt();
            let phase = damped * omega * t;
            (-z * omega * t).exp() * (phase.cos() + z / damped * phase.sin())
        } else {
            (-omega * t).exp() * (1.0 + omega * t)
        };
        rows.push(OscillationRow {
            time: t,
            height_over_l0: (solids.poses()[0].position.z - rest) / SPACING,
            analytic_over_l0: sag * analytic / SPACING,
        });
    }
    Ok(rows)
}

/// Largest difference between a damping curve and the analytic one, over the starting amplitude [-].
pub fn oscillation_error(rows: &[OscillationRow], spring: f64) -> f64 {
    let amplitude = mass() * GRAVITY / spring / SPACING;
    rows.iter().map(|r| (r.height_over_l0 - r.analytic_over_l0).abs()).fold(0.0, f64::max) / amplitude
}
