//! Energy, momentum and checkpoints of the solids.

use super::{Energy, Model, SolidState, Solids};
use crate::error::{Error, Result};
use glam::DVec3;

impl Solids {
    /// Energy of the free bodies now.
    pub fn energy(&mut self) -> Energy {
        let mut energy = Energy::default();
        for body in self.bodies.iter().filter(|b| b.is_free()) {
            energy.kinetic += body.kinetic_energy();
            energy.gravity -= body.mass * self.gravity.dot(body.pose.position);
        }
        self.candidates.refresh(&self.bodies, self.spacing, 0.0);
        match &mut self.model {
            Model::Smooth(model) => {
                if !model.is_current(&self.candidates) {
                    model.collect(&self.candidates, &self.bodies);
                    let h = self.limits.longest_step;
                    model.set_constants(&self.limits, &self.bodies, self.spacing, h.max(f64::MIN_POSITIVE));
                }
                model.evaluate(&self.bodies);
                energy.contact = model.pairs.iter().map(|p| p.energy).sum();
            }
            Model::Paper(model, law) => {
                if !model.is_current(&self.candidates) {
                    model.collect(&self.candidates, &self.bodies, law.distance);
                }
                model.evaluate(law, &self.bodies);
                energy.contact = model.pairs.iter().map(|p| p.energy).sum();
            }
            Model::None | Model::Collision(_) => {}
        }
        energy
    }

    /// Momentum [kg m/s] of the free bodies, and angular momentum about the origin [kg m2/s].
    pub fn momentum(&self) -> (DVec3, DVec3) {
        self.bodies.iter().filter(|b| b.is_free()).fold((DVec3::ZERO, DVec3::ZERO), |(p, l), b| {
            let own = b.mass * b.pose.velocity;
            (p + own, l + b.pose.position.cross(own) + b.momentum)
        })
    }

    /// State for a checkpoint, one per solid.
    pub fn states(&self) -> Vec<SolidState> {
        let both = self.bodies.iter().zip(&self.contact);
        both.map(|(b, c)| SolidState { pose: b.pose, angular_momentum: b.momentum, contact: *c }).collect()
    }

    /// Continues from the states of a checkpoint.
    ///
    /// # Errors
    /// [`Error::Case`] if the number of solids differs.
    pub fn restore(&mut self, states: &[SolidState]) -> Result<()> {
        if states.len() != self.bodies.len() {
            let (have, want) = (states.len(), self.bodies.len());
            return Err(Error::Case(format!("the checkpoint holds {have} solids, the case {want}")));
        }
        for (k, state) in states.iter().enumerate() {
            self.bodies[k].restore(state.pose, state.angular_momentum);
            self.poses[k] = self.bodies[k].pose;
            self.contact[k] = state.contact;
        }
        self.candidates.forget();
        Ok(())
    }
}
