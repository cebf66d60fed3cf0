//! Solids in a step: where they go, the slots between them, the water's force, contact.

use super::Simulation;
use crate::backend::Backend;
use crate::body::slots::SlotRow;
use crate::body::{Mobility, Pose, Six, Wrench};
use crate::contact::ContactReport;
use crate::cover::driven::Covered;
use crate::error::{Error, Result};
use crate::ledger::Entry;
use crate::params::Step;
use crate::plan::{Arrays, Stage};
use crate::slots::{Pressed, Push};
use std::collections::HashMap;

/// Pressures of the last step in `slots` of wall layers [Pa].
fn row_pressures(backend: &mut dyn Backend, slots: &[usize]) -> Result<Vec<f64>> {
    Ok(backend.wall_pressures(slots)?.iter().map(|row| row.pressure).collect())
}

impl Simulation {
    /// Solids move as they would without the fluid's force in this step.
    pub(crate) fn move_solids(&mut self, step: &Step) -> Result<()> {
        if !self.plan.has(Stage::MoveSolids) {
            return Ok(());
        }
        self.timed(Stage::MoveSolids, |s| {
            let (gravity, contact) = (s.params.explicit_gravity(), !s.plan.needs(Arrays::Coupling));
            let poses = s.solids.predict(step.time, step.dt, step.ahead, gravity, contact);
            s.backend.move_solids(&s.openings.place(poses))
        })
    }

    /// Steps done, without those of the run that it goes on from with `run.from`.
    pub fn own_steps(&self) -> u64 {
        self.steps - self.began
    }

    /// Whether a step was done, so that pressures and forces are known.
    pub fn has_stepped(&self) -> bool {
        self.own_steps() > 0
    }

    /// Whether [`Self::fluid_force`] is what acts: it is left at zero before the first step, and where nothing asks for the force on
    /// walls that move.
    pub fn knows_fluid_force(&self) -> bool {
        self.has_stepped() && (!self.plan.wet() || self.plan.has(Stage::BodyForce))
    }

    /// Rows of free bodies at slots, in the poses that [`Solids::predict`](crate::contact::Solids::predict) gave last; none where no free body stands in the
    /// pressure equation.
    ///
    /// # Errors
    /// A device that is lost.
    pub fn slot_rows(&mut self) -> Result<Vec<SlotRow>> {
        Ok(self.pressed_by_slots()?.rows)
    }

    fn pressed_by_slots(&mut self) -> Result<Pressed> {
        let Some(found) = &self.slots else { return Ok(Pressed::default()) };
        let backend = &mut *self.backend;
        let start = (self.steps == 0).then(|| &self.scene.position[..self.scene.water()]);
        found.press(self.solids.predicted(), start, |slots| row_pressures(backend, slots))
    }

    /// Gives the pressure equation the free bodies, and what slots bring them.
    pub(crate) fn give_free_bodies(&mut self, dt: f64) -> Result<()> {
        let Pressed { rows, loads, mut pressings, voids } = self.pressed_by_slots()?;
        let mut bodies = self.solids.free_bodies(self.params.balanced_gravity());
        loads.iter().for_each(|&(k, load)| bodies[k].load += load);
        self.enclosed = loads;
        // Of one that is held in all that it could do nothing comes nearer.
        pressings.retain(|slot| bodies[slot.solid].mobility != Mobility::default());
        let mut in_slots = vec![];
        for slots in pressings.chunk_by_mut(|a, b| a.solid == b.solid) {
            let (k, mut added) = (slots[0].solid, Six::default());
            slots.iter().for_each(|slot| slot.add_inertia(&mut added));
            let (free, pose) = (bodies[k].mobility.with(&added), &self.solids.predicted()[k]);
            for slot in slots {
                slot.add_braking(&mut added, &free, pose, dt);
                bodies[k].load += slot.speed;
            }
            bodies[k].mobility = bodies[k].mobility.with(&added);
            in_slots.push((k, bodies[k].mobility));
        }
        self.solids.stand_in_slots(in_slots);
        self.pressings = pressings;
        self.voids = voids;
        self.backend.free_bodies(&bodies, &rows)
    }

    /// What the water in slots presses on walls and solids; nothing where no free body stands in the pressure equation.
    ///
    /// # Errors
    /// A device that is lost.
    pub fn slot_pushes(&mut self) -> Result<Vec<Push>> {
        let Some(found) = &self.slots else { return Ok(vec![]) };
        let (backend, poses) = (&mut *self.backend, self.solids.poses());
        let mut pushes =
            found.pushes(poses, &self.voids, &self.pressed, |slots| row_pressures(backend, slots))?;
        if self.plan.held {
            let held = found.held(poses, &self.driven_faces.covered(&self.scene, poses));
            let forces =
                found.held_forces(&held, poses, &self.params, |rows| backend.wall_pressures(rows))?;
            pushes.extend(forces.pushes);
        }
        Ok(pushes)
    }

    /// Fluid force, contact and motion of the solids; their particles follow.
    pub(crate) fn advance_solids(&mut self, step: &Step) -> Result<ContactReport> {
        if !self.plan.has(Stage::Contact) {
            return Ok(ContactReport::default());
        }
        let before = self.solids_ledger.is_some().then(|| self.solids.poses().to_vec());
        if self.plan.has(Stage::BodyForce) {
            self.fluid_force = self.timed(Stage::BodyForce, Self::force_of_water)?;
        }
        let mut force = std::mem::take(&mut self.fluid_force);
        self.pressings.iter().for_each(|slot| force[slot.solid] += slot.speed);
        let report = self
            .timed(Stage::Contact, |s| s.solids.advance_on(s.backend.compute(), step.time, step.dt, &force));
        self.fluid_force = force;
        self.book_pressings(step.dt);
        // the solids count no steps
        let report = report.map_err(|e| match e {
            Error::Diverged { time, stage, what, .. } => {
                Error::Diverged { step: self.steps, time, stage, what }
            }
            other => other,
        })?;
        self.check_bodies(step)?;
        if let Some(before) = before {
            self.book_solids(&before, step.dt);
        }
        if self.plan.has(Stage::MoveSolids) {
            self.timed(Stage::MoveSolids, |s| s.backend.move_solids(&s.openings.place(s.solids.poses())))?;
        }
        Ok(report)
    }

    /// Force of the water on each solid: the sum over its rows, and what that does not know of driven solids. No water presses where another solid
    /// stands, and under a free body that of its slot does. A body that is held has slots as a free one, and their part in its sum; slots of other solids are
    /// looked for where forces are told.
    fn force_of_water(&mut self) -> Result<Vec<Wrench>> {
        let (scene, poses, backend) = (&self.scene, self.solids.predicted(), &mut *self.backend);
        let mut covered = self.driven_faces.covered(scene, poses);
        let slots = self.slots.as_ref().filter(|_| self.plan.held);
        let held = slots.map(|slots| (slots, slots.held(poses, &covered)));
        held.iter().for_each(|(slots, held)| slots.uncover(held, &mut covered));
        let row = |c: &Covered| scene.solids[c.solid].wall_slots.start + c.row;
        let rows: Vec<usize> = covered.iter().map(row).collect();
        let (mut sums, mut pushes) = (None, vec![]);
        if let Some(slots) = self.slots.as_ref().filter(|slots| slots.any_at_driven(poses)) {
            pushes = slots.pushes(poses, &self.voids, &HashMap::new(), |rims| {
                let (force, told) = backend.body_force(&[&rows, rims].concat())?;
                let at_rims = told[rows.len()..].iter().map(|row| row.pressure).collect();
                sums = Some((force, told));
                Ok(at_rims)
            })?;
        }
        let (mut sum, pressures) = match sums {
            Some(sums) => sums,
            None => backend.body_force(&rows)?,
        };
        for (c, pressure) in covered.iter().zip(pressures) {
            let (solid, turn) = (&scene.solids[c.solid], poses[c.solid].orientation);
            let force = pressure.in_force(c.to_surface, &self.params) * c.area;
            let arm = turn * solid.wall_offset[c.row] + c.to_surface;
            sum[c.solid] += Wrench { force, torque: arm.cross(force) };
        }
        for &(k, load) in &self.enclosed {
            sum[k] += load;
        }
        if let Some((slots, held)) = &held {
            let forces = slots.held_forces(held, poses, &self.params, |rows| backend.wall_pressures(rows))?;
            forces.loads.into_iter().for_each(|(k, load)| sum[k] += load);
            pushes.extend(forces.pushes);
        }
        self.pushes = vec![];
        if let Some(slots) = &self.slots {
            let told = (&covered[..], held.as_ref().map(|held| &held.1));
            let of_driven =
                slots.on_driven(poses, told, &pushes, &self.params, |rows| backend.wall_pressures(rows))?;
            of_driven.into_iter().for_each(|(k, force)| sum[k] += force);
            self.pushes = pushes;
        }
        Ok(sum)
    }

    /// Takes what slots did as bodies came nearer or went to the forces of the water, on what they press, too.
    fn book_pressings(&mut self, dt: f64) {
        self.pressed.clear();
        for slot in self.pressings.drain(..) {
            let k = slot.solid;
            let (before, after) = (&self.solids.predicted()[k], &self.solids.poses()[k]);
            self.fluid_force[k] += slot.force(before, after, dt) - slot.speed;
            self.pressed.extend(slot.pressures(before, after, dt));
        }
        let pushes = std::mem::take(&mut self.pushes);
        if let Some(slots) = self.slots.as_ref().filter(|_| !self.pressed.is_empty()) {
            let on_driven = slots.pressed_on_driven(self.solids.predicted(), &pushes, &self.pressed);
            on_driven.into_iter().for_each(|(k, force)| self.fluid_force[k] += force);
        }
    }

    /// Books what the water gave the solids and what contact did, on the way from the poses `before`.
    fn book_solids(&mut self, before: &[Pose], dt: f64) {
        let Some((ledger, energy)) = &mut self.solids_ledger else { return };
        let solids = &self.solids;
        let poses = solids.predicted().iter().zip(before).zip(solids.poses());
        for (k, ((told, before), after)) in poses.enumerate() {
            ledger.solid(dt, solids.is_free(k), &self.fluid_force[k], [told, before, after]);
        }
        let (now, drawn) = (self.solids.energy().total(), self.solids.drawn(before));
        ledger.add(Entry::Gravity, drawn);
        ledger.add(Entry::Contact, now - *energy - drawn);
        *energy = now;
    }
}
