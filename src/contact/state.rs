//! Energy, momentum and checkpoints of the solids.

use super::law::Now;
use super::{Energy, SolidState, Solids};
use crate::body::{Body, Pose, Wrench};
use crate::error::{Error, Result};
use glam::{DVec3, IVec3};

impl Solids {
    /// Energy of the free bodies now. Gravity along periodic axes drives them, and has no part in it.
    pub fn energy(&mut self) -> Energy {
        let (mut energy, gravity) = (Energy::default(), self.periodic.across(self.gravity));
        for (k, body) in self.bodies.iter().enumerate().filter(|(_, b)| b.is_free()) {
            energy.kinetic += body.kinetic_energy();
            energy.gravity -= body.mass * gravity.dot(self.path(k) + body.to_mass());
        }
        self.candidates.refresh(&self.bodies, self.spacing, 0.0);
        if let Some(law) = &mut self.law {
            let Self { bodies, candidates, limits, .. } = self;
            energy.contact = law.energy(Now { bodies, candidates, limits, substep: self.whole });
        }
        energy
    }

    /// Work of gravity along periodic axes on the free bodies on their way from the poses `before` [J].
    pub(crate) fn drawn(&self, before: &[Pose]) -> f64 {
        let along = self.gravity - self.periodic.across(self.gravity);
        let work = |(body, before): (&Body, &Pose)| {
            let way = self.periodic.nearest(body.pose.position - before.position);
            body.mass * along.dot(way + body.to_mass() - body.to_mass_at(before))
        };
        self.bodies.iter().zip(before).filter(|(body, _)| body.is_free()).map(work).sum()
    }

    /// As [`Solids::energy`], with the velocities at the time of the positions. A sub-step leaves them half of it behind,
    /// and during an impact the energies of both are then off by up to dt sqrt(K / m) / 2, to and fro.
    pub fn centred_energy(&mut self) -> Energy {
        let mut energy = self.energy();
        let half = 0.5 * self.substep;
        let mut load = vec![Wrench::default(); self.bodies.len()];
        if let Some(law) = &self.law {
            law.add_loads(&self.bodies, &mut load);
        }
        for (body, load) in self.bodies.iter().zip(&load).filter(|(b, _)| b.is_free()) {
            let mut body = body.clone();
            energy.kinetic -= body.kinetic_energy();
            let weight = body.weight(self.gravity);
            body.kick(half * (weight.force + load.force), half * (weight.torque + load.torque));
            energy.kinetic += body.kinetic_energy();
        }
        energy
    }

    /// Momentum [kg m/s] of the free bodies, and angular momentum about the origin [kg m2/s].
    pub fn momentum(&self) -> (DVec3, DVec3) {
        self.bodies.iter().filter(|b| b.is_free()).fold((DVec3::ZERO, DVec3::ZERO), |(p, l), b| {
            let own = b.mass * b.pose.velocity_at(b.pose.position + b.to_mass());
            (p + own, l + b.pose.position.cross(own) + b.momentum)
        })
    }

    /// State for a checkpoint, one per solid.
    pub fn states(&self) -> Vec<SolidState> {
        let all = self.bodies.iter().zip(&self.contact).zip(&self.turns);
        let of = |((b, c), turns): ((&Body, &Wrench), &IVec3)| SolidState {
            pose: b.pose,
            turns: *turns,
            angular_momentum: b.momentum,
            contact: *c,
        };
        all.map(of).collect()
    }

    /// Continues from the states of a checkpoint.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] if the number of solids differs.
    pub fn restore(&mut self, states: &[SolidState]) -> Result<()> {
        if states.len() != self.bodies.len() {
            let (have, want) = (states.len(), self.bodies.len());
            return Err(Error::misfit(format!("the checkpoint holds {have} solids, the case {want}")));
        }
        for (k, state) in states.iter().enumerate() {
            self.bodies[k].restore(state.pose, state.angular_momentum);
            self.poses[k] = self.bodies[k].pose;
            self.contact[k] = state.contact;
            self.turns[k] = state.turns;
        }
        self.candidates.forget();
        if let Some(law) = &mut self.law {
            law.forget();
        }
        Ok(())
    }
}
