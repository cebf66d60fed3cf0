//! One time step: the algorithm of the paper's section 2, with the solids of section 3.

use crate::error::{Error, Result};
use crate::plan::{ParticleStage, Stage};
use crate::simulation::{Simulation, StepReport};

impl Simulation {
    /// Advance by one time step.
    ///
    /// # Errors
    /// [`Error::Diverged`], or a device that is lost.
    pub fn step(&mut self) -> Result<StepReport> {
        let Some(threads) = self.threads.take() else { return self.advance() };
        let report = threads.install(|| self.advance());
        self.threads = Some(threads);
        report
    }

    fn advance(&mut self) -> Result<StepReport> {
        let step = self.next_step();
        self.check_length(&step)?;
        let (t, dt) = (step.time, step.dt);
        let mut report = StepReport { step: self.steps, time: t, dt, ..Default::default() };

        if self.plan.wet() {
            // Explicit part of Eq. (2): viscosity and gravity move particles to r*; solids go where they would
            // go without the fluid.
            self.run(ParticleStage::Viscosity, &step)?;
            self.run(ParticleStage::Predict, &step)?;
            self.move_solids(t, dt)?;
            // Neighbours at r*; particles that come too close rebound, Eq. (18).
            self.run(ParticleStage::CellList, &step)?;
            self.run(ParticleStage::NeighbourList, &step)?;
            self.run(ParticleStage::Collision, &step)?;
            // Number density, Eq. (4); free surface; pressure Poisson equation, Eq. (8).
            self.run(ParticleStage::NumberDensity, &step)?;
            self.run(ParticleStage::PressureSource, &step)?;
            report.pressure = self.solve_pressure(&step)?;
            // Pressure gradient, Eq. (9), corrects velocity and position.
            self.run(ParticleStage::PressureGradient, &step)?;
            self.run(ParticleStage::Correct, &step)?;
            self.run(ParticleStage::Shift, &step)?;
        }
        // Solids: fluid force, gravity and contact, Eqs. (10) to (14).
        report.contact = self.advance_solids(&step)?;

        report.look = self.look(&step)?;
        self.time = t + dt;
        self.steps += 1;
        Ok(report)
    }

    pub(crate) fn diverged(&self, step: &crate::params::Step, stage: Stage, what: String) -> Error {
        Error::Diverged { step: self.steps, time: step.time, stage: stage.name(), what }
    }
}
