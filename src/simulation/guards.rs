//! What ends a run before its end: steps that become too short, water that is lost or collapses, bodies that leave,
//! and what is no number.

use super::Simulation;
use crate::backend::Counters;
use crate::error::Result;
use crate::monitor::FluidMonitor;
use crate::params::Step;
use crate::plan::Stage;
use crate::scene::{Solid, point};
use crate::time_step::{Bounds, expected_speed};

/// Part of the fluid that may get lost before the run is stopped.
const LOST_MAX: f64 = 0.02;
/// An adaptive step this much shorter than the typed one is that of a run that will not end.
const SHORTEST_STEP: f64 = 1e-6;
/// A typed step of so many times the fall through a spacing is far beyond what any flow leaves of it.
const LONGEST_STEP: f64 = 1e3;

/// Water this many times as fast as anything makes it has come apart [-].
const FLYING: f64 = 20.0;
/// Part of the time in which a tank fills from which on it may have no room left: solids that move may take some of it [-].
const FULL_FROM: f64 = 0.5;

impl Simulation {
    /// An error if a step has become so short that the run would not end.
    pub(crate) fn check_length(&self, step: &Step) -> Result<()> {
        let typed = self.case.run.time_step;
        if step.dt >= SHORTEST_STEP * typed {
            return Ok(());
        }
        let fall = self.fall_of_a_spacing();
        let why = if typed > LONGEST_STEP * fall {
            format!(
                "no flow takes a step like that, water falls through a spacing in {fall:.1e} s: write no more than this"
            )
        } else {
            format!("the run would not end; {}", self.haste())
        };
        let what = format!(
            "the flow or a solid asks for steps of {:.1e} s where run.time_step is {typed:e} s; {why}",
            step.dt
        );
        Err(self.diverged(step, Stage::Predict, what))
    }

    /// Why steps may have become so short, and what would help.
    fn haste(&self) -> String {
        let expected = expected_speed(&self.params).max(self.driven());
        let bounds = Bounds::new(&self.params, self.speed.max(expected));
        if bounds.drag <= bounds.shortest() {
            let body = self.params.drag.body(self.speed.max(expected));
            return format!(
                "water takes the body `{body}` along at once: check its density, mass and inertia, and fluid.wall_friction"
            );
        }
        let is_squeezed = self.params.filled || self.scene.solids.iter().any(Solid::is_driven);
        if !is_squeezed && self.fastest > FLYING * expected {
            return format!(
                "water flies at {:.1e} m/s where nothing makes it faster than {expected:.1e}: leave out what fluid.* changes \
                 of the scheme (collision_distance, relaxation, sound_speed), or use a finer run.spacing",
                self.fastest
            );
        }
        "water that has no room left (more of it in a closed tank than that holds, a piston into a part that is full) is \
         pressed like this: leave it a way out"
            .to_owned()
    }

    /// Time in which what is let go falls through a spacing [s]; without gravity no time is long.
    fn fall_of_a_spacing(&self) -> f64 {
        (2.0 * self.params.spacing / self.params.gravity.length()).sqrt()
    }

    /// A remedy for water that has been pressed through walls, if a solid is driven that may do so.
    fn may_be_pressed(&self) -> String {
        let Some(solid) = self.scene.solids.iter().find(|solid| solid.is_driven()) else {
            return String::new();
        };
        format!(
            "; water that `{}` leaves no room (a piston into a part that is full) is pressed through the walls: leave it \
             a way out",
            solid.name
        )
    }

    /// Why water may have collapsed, and what would help.
    fn collapse(&self, step: &Step) -> String {
        match self.scene.full.filter(|full| step.time > FULL_FROM * full) {
            Some(full) => format!(
                "the tank lets nothing out and is full at t = {full:.3} s at the latest: add an [[outflow]], open a face \
                 (tank.open), or end the inflow or the run before"
            ),
            None => {
                "the fluid has collapsed onto itself; use a smaller time step or a larger fluid.sound_speed"
                    .to_owned()
            }
        }
    }

    pub(super) fn check_bodies(&self, step: &Step) -> Result<()> {
        let (min, max) = (self.params.domain_min, self.params.domain_max);
        for (k, pose) in self.solids.poses().iter().enumerate() {
            let x = pose.point(self.scene.solids[k].shape_offset);
            let name = self.solids.name(k);
            if !(x.is_finite() && pose.velocity.is_finite() && pose.angular_velocity.is_finite()) {
                return Err(self.diverged(
                    step,
                    Stage::Contact,
                    format!("{name}: the motion is not a number"),
                ));
            }
            let bounded =
                |k: &usize| !(self.params.periodic.is_along(*k) || self.params.dimensions == 2 && *k == 1);
            // Ground may be larger than the room that it is the ground of.
            let stays = self.scene.solids[k].is_still();
            if !stays && (0..3).filter(bounded).any(|k| x[k] < min[k] || x[k] > max[k]) {
                let what = format!(
                    "{name} left the domain at {} m; a wall is missing there, contact.spring is too soft for this \
                     fall, or run.domain is to be larger, if it is to fly on",
                    point(x)
                );
                return Err(self.diverged(step, Stage::Contact, what));
            }
        }
        Ok(())
    }

    /// Look at the guards and at the speed of the flow, every few steps.
    pub(crate) fn look(&mut self, step: &Step, every: u64) -> Result<Option<(FluidMonitor, Counters)>> {
        if !self.plan.wet() || !self.steps.is_multiple_of(every) {
            return Ok(None);
        }
        let (monitor, counters) = self.observe()?;
        self.check(&counters, step)?;
        (self.speed, self.fastest) = (monitor.speed_most, monitor.speed_max);
        if !monitor.kinetic.is_finite() {
            return Err(self.diverged(step, Stage::Correct, "the kinetic energy is not a number".into()));
        }
        Ok(Some((monitor, counters)))
    }

    /// An error if the guards have seen something that ends a run.
    pub fn check(&self, counters: &Counters, step: &Step) -> Result<()> {
        if let Some((slot, neighbours)) = counters.overflow {
            let lists = format!("more than the lists hold (a full lattice has {})", self.params.neighbours);
            // Slots of many ranks are their own; a backend of theirs gives no step up.
            let is_wall = slot as usize >= self.groups.fluid && self.backend.gives_up();
            // Walls alone can make it so many.
            let what = match self.scene.solid.get(slot as usize).filter(|_| is_wall) {
                Some(&of) => {
                    let name = match of.checked_sub(1) {
                        Some(k) => format!("`{}`", self.scene.solids[k as usize].name),
                        None => "a fixed wall".to_owned(),
                    };
                    format!(
                        "a particle of {name} has {neighbours} neighbours, {lists}: solids reach into each other there, or \
                         water is pressed into it; let driven solids end where others begin"
                    )
                }
                None => format!(
                    "particle slot {slot} has {neighbours} neighbours, {lists}: {}",
                    self.collapse(step)
                ),
            };
            return Err(self.diverged(step, Stage::NeighbourList, what));
        }
        if let Some(particle) = counters.non_finite {
            let what = format!("the velocity of particle {particle} is not a number");
            return Err(self.diverged(step, Stage::Correct, what));
        }
        let fluid = self.scene.water() as u64 + self.openings.total_emitted();
        if counters.lost as f64 > (LOST_MAX * fluid as f64).max(10.0) {
            let overflows = if self.openings.total_emitted() > 0 {
                "; a tank that overflows needs an [[outflow]], or an earlier run.end"
            } else {
                ""
            };
            let what = format!(
                "{} of {} fluid particles have left the domain; see fluid_lost in monitors.csv for when it began, and \
                 enlarge run.domain if they may go there{overflows}{}",
                counters.lost,
                fluid,
                self.may_be_pressed()
            );
            return Err(self.diverged(step, Stage::CellList, what));
        }
        Ok(())
    }
}
