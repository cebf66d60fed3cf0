//! Dry scenes written as cases, stepped without a backend.

use super::case;
use seixo::body::{Pose, Wrench};
use seixo::contact::{ContactReport, Solids};
use seixo::error::Result;
use seixo::scene::{Scene, WallShape};

/// Standard gravity [m/s2].
pub const G: f64 = 9.80665;

/// A dry scene in motion.
pub struct Dry {
    pub solids: Solids,
    /// The fixed walls.
    pub walls: Vec<WallShape>,
    pub dt: f64,
    step: u32,
}

impl Dry {
    pub fn new(text: &str) -> Self {
        let case = case(text).laid_out().unwrap_or_else(|e| panic!("{e}\n{text}"));
        let scene = Scene::build(&case).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let solids = Solids::new(&scene, case.contact.as_ref()).unwrap();
        Self { solids, walls: scene.walls, dt: case.run.time_step, step: 0 }
    }

    pub fn time(&self) -> f64 {
        f64::from(self.step) * self.dt
    }

    pub fn try_step(&mut self) -> Result<ContactReport> {
        let still = vec![Wrench::default(); self.solids.poses().len()];
        let report = self.solids.advance(self.time(), self.dt, &still)?;
        self.step += 1;
        Ok(report)
    }

    pub fn step(&mut self) -> &[Pose] {
        self.try_step().unwrap_or_else(|e| panic!("{e}"));
        self.solids.poses()
    }

    /// Poses at `time` [s].
    pub fn run(&mut self, time: f64) -> &[Pose] {
        let end = (time / self.dt).round() as u32;
        while self.step < end {
            self.step();
        }
        self.solids.poses()
    }
}
