//! One time step: the algorithm of the paper's section 2, with the solids of section 3.

use crate::error::{Error, Result};
use crate::plan::{ParticleStage, Stage};
use crate::simulation::{Simulation, StepReport};

// Each of the stages with a call of its own has an arm below.
const _: () = assert!(Stage::ALL.len() - ParticleStage::ALL.len() == 5);

impl Simulation {
    /// Advance by one time step.
    ///
    /// # Errors
    /// [`Error::Diverged`], or a device that is lost.
    pub fn step(&mut self) -> Result<StepReport> {
        // On a thread of the pool, not beside it: each loop of a stage would be handed over and waited for, and loops are short in
        // small scenes.
        let Some(threads) = self.threads.take() else { return rayon::scope(|_| self.advance()) };
        let report = threads.install(|| self.advance());
        self.threads = Some(threads);
        report
    }

    fn advance(&mut self) -> Result<StepReport> {
        let step = self.next_step();
        let looks_every = self.looks_every(step.dt);
        self.check_length(&step)?;
        let (t, dt) = (step.time, step.dt);
        let mut report = StepReport { step: self.steps, time: t, dt, ..Default::default() };

        // The step reads in the list of the stages, src/plan.rs: they run in its order, those that the plan has.
        for stage in Stage::ALL {
            if self.stop.is_overdue() {
                return Err(Error::Interrupted);
            }
            match stage {
                // Part of the motion of the solids.
                Stage::BodyForce => {}
                Stage::Contact => report.contact = self.advance_solids(&step)?,
                _ if !self.plan.wet() => {}
                Stage::Openings => self.pass_openings(&step)?,
                Stage::MoveSolids => self.move_solids(&step)?,
                Stage::ConjugateGradient => report.pressure = self.solve_pressure(&step)?,
                particles => {
                    if let Some(stage) = particles.over_particles() {
                        self.run(stage, &step)?;
                    }
                }
            }
        }

        if self.stop.is_overdue() {
            return Err(Error::Interrupted);
        }
        report.look = self.look(&step, looks_every)?;
        self.time = t + dt;
        self.steps += 1;
        Ok(report)
    }

    pub(crate) fn diverged(&self, step: &crate::params::Step, stage: Stage, what: String) -> Error {
        Error::Diverged { step: self.steps, time: step.time, stage: stage.name(), what }
    }
}
