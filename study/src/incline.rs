//! Section 4.2: a block slides down a plane. eta(mu) of the paper's law (Fig. 12), and the travel time of
//! Coulomb friction against Eq. (21).

use super::dry::{DryScene, FreeBox, GRAVITY};
use glam::DVec3;
use seixo::body::Wrench;
use seixo::case::{Contact, Law};
use seixo::contact::{Solids, standing_gap};
use seixo::error::Result;
use seixo::scene::Scene;
use serde::Serialize;

/// Length of the slide [m].
pub const LENGTH: f64 = 2.0;
/// K of the paper [N/m].
pub const SPRING: f64 = 9e5;
/// C of the paper [kg/s].
pub const DAMPING: f64 = 3.35e3;
/// The paper's eta [kg/s] at mu = 0.3.
pub const PAPER_ETA: (f64, f64) = (0.3, 9.1);
/// Time step of the paper [s].
pub const TIME_STEP: f64 = 1e-3;

/// Travel time of Eq. (21) [s]; infinite where the block sticks.
pub fn travel_time(slope: f64, friction: f64, length: f64) -> f64 {
    let acceleration = GRAVITY * (slope.sin() - friction * slope.cos());
    if acceleration > 0.0 { (2.0 * length / acceleration).sqrt() } else { f64::INFINITY }
}

/// What slides on what.
#[derive(Clone, Copy, Debug)]
pub struct Slide {
    /// Contact law.
    pub law: Law,
    /// Slope [rad].
    pub slope: f64,
    /// mu of the smooth law [-].
    pub friction: f64,
    /// eta of the paper's law [kg/s].
    pub viscous_friction: f64,
    /// Spacing [m].
    pub spacing: f64,
    /// Density [kg/m3].
    pub density: f64,
    /// Time step [s].
    pub time_step: f64,
    /// K [N/m].
    pub spring: f64,
    /// C [kg/s].
    pub damping: f64,
    /// Whether contact turns the block (law "paper").
    pub torque: bool,
    /// Lateral offset of the block's particles over the plane's, in spacings.
    pub offset: f64,
    /// Forced sub-steps.
    pub substeps: Option<u32>,
}

impl Slide {
    /// The paper's block, l0 = 0.025 m, 780 kg/m3, 45 degrees.
    pub fn new(law: Law) -> Self {
        Self {
            law,
            slope: 45_f64.to_radians(),
            friction: 0.0,
            viscous_friction: 0.0,
            spacing: 0.025,
            density: 780.0,
            time_step: TIME_STEP,
            spring: SPRING,
            damping: DAMPING,
            torque: false,
            offset: 0.0,
            substeps: (law == Law::Paper).then_some(1),
        }
    }

    /// The same block of another density, K and C scaled with its mass so that the contact is alike.
    pub fn with_density(self, density: f64) -> Self {
        let scale = density / self.density;
        Self { density, spring: self.spring * scale, damping: self.damping * scale, ..self }
    }

    /// The scene, in the plane's frame: z along the normal, x down the slope.
    pub fn scene(&self) -> Scene {
        let l0 = self.spacing;
        let size = DVec3::new(0.2, 0.2, 0.1);
        let center = DVec3::new(0.5 * l0, (0.5 + self.offset) * l0, 0.05 + standing_gap(self.law, l0));
        let dry = DryScene::new(l0, DVec3::new(-0.3, -0.3, -0.1), DVec3::new(3.0, 0.3, 0.5));
        let dry = dry.slope(self.slope).floor();
        let dry = match self.law {
            Law::Smooth => dry,
            _ => dry.particle_floor((-0.2, -0.2), (LENGTH + 0.3, 0.2)),
        };
        dry.body(&FreeBox::new(size, self.density, center)).build()
    }

    fn contact(&self) -> Contact {
        Contact {
            law: self.law,
            spring: Some(self.spring),
            damping: Some(self.damping),
            damping_ratio: None,
            restitution: None,
            viscous_friction: self.viscous_friction,
            friction: self.friction,
            torque: self.torque,
            substeps: self.substeps,
            device: Default::default(),
            pair: vec![],
        }
    }

    /// Slides until the length is passed, `limit` [s] at most.
    ///
    /// # Errors
    /// Those of [`Solids::new`] and [`Solids::advance`].
    pub fn run(&self, limit: f64) -> Result<SlideRow> {
        let mut solids = Solids::new(&self.scene(), Some(&self.contact()))?;
        let start = solids.poses()[0].position;
        let (mut time, mut touching, mut steps, mut substeps) = (f64::NAN, 0_u64, 0_u64, 0);
        let mut before = 0.0;
        while (steps as f64) < limit / self.time_step {
            let t = steps as f64 * self.time_step;
            let report = solids.advance(t, self.time_step, &[Wrench::default()])?;
            steps += 1;
            touching += u64::from(report.pairs > 0);
            substeps = report.substeps;
            let x = solids.poses()[0].position.x - start.x;
            if x >= LENGTH {
                time = t + self.time_step * (LENGTH - before) / (x - before);
                break;
            }
            before = x;
        }
        let exact = travel_time(self.slope, self.friction, LENGTH);
        let pose = solids.poses()[0];
        Ok(SlideRow {
            slope_deg: self.slope.to_degrees(),
            friction: self.friction,
            viscous_friction: self.viscous_friction,
            spacing: self.spacing,
            density: self.density,
            time_step: self.time_step,
            substeps,
            time,
            analytic: exact,
            error: time / exact - 1.0,
            duty: touching as f64 / steps as f64,
            distance: pose.position.x - start.x,
            tilt_deg: (pose.orientation * DVec3::Z).angle_between(DVec3::Z).to_degrees(),
        })
    }
}

/// One slide.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SlideRow {
    /// Slope [degrees].
    pub slope_deg: f64,
    /// mu [-].
    pub friction: f64,
    /// eta [kg/s].
    pub viscous_friction: f64,
    /// Spacing [m].
    pub spacing: f64,
    /// Density [kg/m3].
    pub density: f64,
    /// Time step [s].
    pub time_step: f64,
    /// Contact sub-steps a step.
    pub substeps: u32,
    /// Travel time [s]; NaN if the block did not arrive.
    pub time: f64,
    /// Eq. (21) [s].
    pub analytic: f64,
    /// time / analytic - 1 [-].
    pub error: f64,
    /// Fraction of steps in contact [-].
    pub duty: f64,
    /// Distance travelled [m].
    pub distance: f64,
    /// Angle between the block and the plane at the end [degrees].
    pub tilt_deg: f64,
}

/// eta [kg/s] with which the paper's law takes the travel time of Eq. (21) for `friction`, by bisection.
///
/// # Errors
/// Those of [`Slide::run`].
pub fn calibrate(slide: Slide, friction: f64) -> Result<SlideRow> {
    let goal = travel_time(slide.slope, friction, LENGTH);
    let run = |eta: f64| Slide { viscous_friction: eta, ..slide }.run(1.5 * goal);
    let (mut low, mut high) = (0.0, 100.0);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if run(middle)?.time < goal { low = middle } else { high = middle }
    }
    let row = run(0.5 * (low + high))?;
    Ok(SlideRow { friction, analytic: goal, error: row.time / goal - 1.0, ..row })
}

/// Travel times of the smooth law for mu = 0 ... 0.9 on the slope.
///
/// # Errors
/// Those of [`Slide::run`].
pub fn coulomb_curve(slide: Slide) -> Result<Vec<SlideRow>> {
    let friction = (0..10).map(|k| f64::from(k) * 0.1);
    friction
        .filter(|mu| *mu < 0.99 * slide.slope.tan())
        .map(|friction| Slide { friction, ..slide }.run(1.5 * travel_time(slide.slope, friction, LENGTH)))
        .collect()
}
