//! The state of the solids, and of the lists of what may touch.

use super::Solids;
use super::candidates::Candidates;
use super::substeps::{Cut, Limits};
use crate::body::{Pose, Wrench};
use crate::checkpoint::Archive;
use crate::compute::Compute;
use crate::error::Result;
use glam::{DQuat, DVec3};

/// A pose as numbers.
const POSE: usize = 13;
/// Names of what another run takes over, too.
const POSES: &str = "solids.pose";
const MOMENTA: &str = "solids.momentum";
const TURNS: &str = "solids.turns";
const CONTACT: &str = "solids.contact";

fn numbers(pose: &Pose) -> [f64; POSE] {
    let Pose { position, orientation, velocity, angular_velocity } = *pose;
    let vectors = [position, velocity, angular_velocity];
    let mut n = [0.0; POSE];
    n[..4].copy_from_slice(&orientation.to_array());
    n[4..].copy_from_slice(vectors.map(|v| v.to_array()).as_flattened());
    n
}

fn pose(n: &[f64]) -> Pose {
    let vector = |k: usize| DVec3::from_slice(&n[4 + 3 * k..]);
    Pose {
        position: vector(0),
        orientation: DQuat::from_slice(n),
        velocity: vector(1),
        angular_velocity: vector(2),
    }
}

fn vectors(wrenches: &[Wrench]) -> Vec<[DVec3; 2]> {
    wrenches.iter().map(|w| [w.force, w.torque]).collect()
}

fn wrench([force, torque]: [DVec3; 2]) -> Wrench {
    Wrench { force, torque }
}

impl Solids {
    /// Save the solids, or take them over. The lists of points that may touch are made anew, in the poses that they
    /// were made in: sums over them run in the same order.
    pub(crate) fn exchange(
        &mut self,
        archive: &mut Archive,
        compute: Option<&mut dyn Compute>,
    ) -> Result<()> {
        let Self {
            // Follows from the case.
            names: _,
            gravity: _,
            spacing,
            law,
            limits,
            // Made anew in every step, or from the state, or counters.
            poses: _,
            predicted: _,
            traffic: _,
            load: _,
            bodies,
            contact,
            fixed,
            turns,
            periodic,
            candidates,
            planned,
            substep,
            whole,
        } = self;
        let Limits {
            spring: _,
            given: _,
            between: _,
            viscous_friction: _,
            forced: _,
            lambda: _,
            lightest: _,
            gravity: _,
            fastest: _,
            falling: _,
            longest_step,
        } = limits;
        if archive.is_of_another() {
            return self.take_over(archive);
        }
        archive.number("solids.longest_step", longest_step)?;
        let (mut dt, mut cut) = planned.unwrap_or((-1.0, Cut::new(1, 1, 0.0)));
        // of what is planned nothing is cut through as yet
        let Cut { substeps, parts, all: _, hardest, omega_dt } = &mut cut;
        archive.number("solids.planned_step", &mut dt)?;
        archive.number("solids.planned_omega_dt", omega_dt)?;
        archive.small("solids.planned_substeps", substeps)?;
        archive.small("solids.planned_parts", parts)?;
        archive.small("solids.planned_hardest", hardest)?;
        let substeps = *substeps;
        *planned = Some((dt, cut)).filter(|p| p.0 > 0.0);
        archive.number("solids.substep", substep)?;
        archive.number("solids.whole_substep", whole)?;
        let mut now: Vec<[f64; POSE]> = bodies.iter().map(|b| numbers(&b.pose)).collect();
        let mut momenta: Vec<DVec3> = bodies.iter().map(|b| b.momentum).collect();
        let mut wrenches = vectors(contact);
        archive.array(POSES, &mut now, true)?;
        archive.array(MOMENTA, &mut momenta, true)?;
        archive.array(CONTACT, &mut wrenches, true)?;
        fixed.exchange(archive)?;
        if let Some(law) = law {
            law.exchange(archive)?;
        }
        if periodic.is_any() {
            archive.array(TURNS, turns, true)?;
        }
        let Candidates { travel, skin: _, valid, generation: _, close: _, made, made_dt, periodic: _ } =
            candidates;
        let mut made_numbers: Vec<[f64; POSE]> = made.iter().map(numbers).collect();
        archive.array("solids.listed_pose", &mut made_numbers, true)?;
        archive.array("solids.travel", travel, true)?;
        archive.switch("solids.listed", valid)?;
        archive.number("solids.listed_step", made_dt)?;
        if archive.is_saving() {
            return Ok(());
        }
        let (listed, dt_listed, travelled, spacing) = (*valid, *made_dt, travel.clone(), *spacing);
        candidates.forget();
        if listed {
            bodies.iter_mut().zip(&made_numbers).for_each(|(b, n)| b.restore(pose(n), DVec3::ZERO));
            candidates.refresh(bodies, spacing, dt_listed);
            let step = dt.max(f64::MIN_POSITIVE);
            self.evaluate(compute, step / f64::from(substeps.max(1)), step)?;
            self.candidates.travel = travelled;
        }
        if let Some(law) = &mut self.law {
            law.moved();
        }
        for (k, body) in self.bodies.iter_mut().enumerate() {
            body.restore(pose(&now[k]), momenta[k]);
            self.poses[k] = body.pose;
            self.contact[k] = wrench(wrenches[k]);
        }
        Ok(())
    }

    /// Takes poses and the forces of contact over from another run, in which the solids may have had other masses, freedoms, motions and laws.
    fn take_over(&mut self, archive: &mut Archive) -> Result<()> {
        let mut now: Vec<[f64; POSE]> = self.bodies.iter().map(|b| numbers(&b.pose)).collect();
        let mut momenta: Vec<DVec3> = self.bodies.iter().map(|b| b.momentum).collect();
        archive.array(POSES, &mut now, true)?;
        archive.array(MOMENTA, &mut momenta, true)?;
        // What bodies lie on holds them: without it the water of the first step would.
        let mut wrenches = vectors(&self.contact);
        archive.array(CONTACT, &mut wrenches, true)?;
        // Momenta are those in the middle of the last sub-step, so that the next kick spans half of it, too.
        archive.number("solids.substep", &mut self.substep)?;
        archive.number("solids.whole_substep", &mut self.whole)?;
        if self.periodic.is_any() {
            archive.array(TURNS, &mut self.turns, true)?;
        }
        self.candidates.forget();
        // whoever has looked at the energy has made lists in the poses that the case starts from
        if let Some(law) = &mut self.law {
            law.forget();
        }
        for (k, body) in self.bodies.iter_mut().enumerate() {
            body.take_over(pose(&now[k]), momenta[k]);
            self.poses[k] = body.pose;
            if self.law.is_some() {
                self.contact[k] = wrench(wrenches[k]);
            }
        }
        Ok(())
    }
}
