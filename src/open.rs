//! The front door: open a case, advance it, read it.

use crate::backend::Processor;
use crate::body::{Pose, Wrench};
use crate::case::Case;
use crate::case::check::refuse;
use crate::error::{Error, Result};
use crate::fields::Fields;
use crate::gauges::Gauges;
use crate::output::table::Cell;
use crate::scene::Scene;
use crate::simulation::{Simulation, StepReport};
use glam::DQuat;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::sync::Arc;

/// How to compute.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// What computes the particle stages.
    pub processor: Processor,
    /// Threads of the CPU; all cores if `None`. Results do not depend on them.
    pub threads: Option<NonZeroUsize>,
}

/// A solid as it is now.
#[derive(Clone, Copy, Debug)]
pub struct SolidState<'a> {
    /// Name from the case.
    pub name: &'a str,
    /// `true` for a body, `false` for a moving wall.
    pub is_body: bool,
    /// Position, orientation of its own frame, and velocities.
    pub pose: &'a Pose,
    /// Turn from the shape as the keys of the case (file, section, axis) describe it: at t = 0 their `orientation`.
    pub turn: DQuat,
    /// Force [N] and torque [N m] of the fluid in the last step.
    pub fluid: Wrench,
}

/// Threads of the simulation's own.
fn pool(threads: NonZeroUsize) -> Result<ThreadPool> {
    let pool = ThreadPoolBuilder::new().num_threads(threads.get()).build();
    pool.map_err(|e| Error::usage("threads", format!("{threads} threads cannot be started: {e}")))
}

impl Simulation {
    /// Build the scene of `case` and set it up.
    ///
    /// # Errors
    /// [`Error::Case`] for what is wrong with the case, [`Error::Gpu`] for a GPU that is not there or too small.
    pub fn open(case: &Case, options: &Options) -> Result<Self> {
        refuse(case)?;
        let threads = options.threads.map(pool).transpose()?;
        let open = || Self::on(case, Scene::build(case)?, &options.processor);
        let simulation = if let Some(pool) = &threads { pool.install(open) } else { open() };
        let mut simulation = simulation?;
        simulation.threads = threads;
        Ok(simulation)
    }

    /// Set up a `scene` that was built from `case` on `processor`.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn on(case: &Case, scene: impl Into<Arc<Scene>>, processor: &Processor) -> Result<Self> {
        Self::with_backend(case, scene, |s, p, plan, settings| processor.open(s, p, plan, settings))
    }

    /// Advance to `time` [s] or just beyond it; `observe` is called after every step and may end the run early.
    ///
    /// # Errors
    /// [`Error::Diverged`], or a device that is lost.
    pub fn run_until(
        &mut self,
        time: f64,
        mut observe: impl FnMut(&mut Self, &StepReport) -> ControlFlow<()>,
    ) -> Result<()> {
        // A rounding error short of the end is the end.
        while self.time < time - 1e-6 * self.case.run.time_step {
            let report = self.step()?;
            if observe(self, &report).is_break() {
                break;
            }
        }
        Ok(())
    }

    /// The particles as they are now, read from the backend; none in a dry scene.
    ///
    /// # Errors
    /// A device that is lost.
    pub fn fields(&mut self) -> Result<Fields> {
        if self.plan.wet() { self.backend.read() } else { Ok(Fields::default()) }
    }

    /// Bodies and moving walls as they are now, in the order of [`Scene::solids`], without the walls in openings.
    pub fn solids(&self) -> impl Iterator<Item = SolidState<'_>> {
        let of_scene = self.scene.solids.iter().zip(self.solids.poses()).take(self.scene.followed());
        of_scene.zip(&self.fluid_force).map(|((solid, pose), &fluid)| SolidState {
            name: &solid.name,
            is_body: solid.is_body,
            pose,
            turn: solid.turn(pose.orientation),
            fluid,
        })
    }

    /// The solid that is called `name`.
    pub fn solid(&self, name: &str) -> Option<SolidState<'_>> {
        self.solids().find(|s| s.name == name)
    }

    /// What the gauges of the case read now, under the name and unit of their column in gauges.csv; not a number
    /// where there is nothing to read, as pressures before the first step.
    ///
    /// # Errors
    /// [`Error::Case`] for a gauge on nothing, or a device that is lost.
    pub fn gauges(&mut self) -> Result<Vec<(String, f64)>> {
        let gauges = Gauges::new(&self.case, &self.scene)?;
        self.read(&gauges)
    }

    /// [`Self::gauges`], of `gauges` that were found once for many readings: the walls that they are on take a while
    /// to find.
    ///
    /// # Errors
    /// A device that is lost.
    pub fn read(&mut self, gauges: &Gauges) -> Result<Vec<(String, f64)>> {
        let value = |cell| if let Cell::Number(value) = cell { value } else { f64::NAN };
        let row = gauges.row(self)?.into_iter().map(value);
        // The first column is the time.
        Ok(gauges.header().into_iter().zip(row).skip(1).collect())
    }
}
