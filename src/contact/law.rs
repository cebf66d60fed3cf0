//! What a contact law is: its search, its forces, what follows from them. A law is one folder here and one arm
//! of [`super::kind`].

use super::between::Against;
use super::candidates::Candidates;
use super::device::Link;
use super::fixed::FixedWalls;
use super::probe::Probe;
use super::substeps::{Cut, Limits, Worst};
use crate::body::{Body, Wrench};
use crate::case;
use crate::checkpoint::Archive;
use crate::compute::Program;
use crate::error::Result;
use crate::scene::Scene;

/// What a law sees of the solids.
#[derive(Clone, Copy)]
pub(crate) struct Now<'a> {
    pub bodies: &'a [Body],
    /// Which solids are close.
    pub candidates: &'a Candidates,
    pub limits: &'a Limits,
    /// Length of a sub-step [s].
    pub substep: f64,
}

/// What the last evaluation found.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Summary {
    /// Particle pairs or surface points in contact.
    pub points: usize,
    /// Pairs of solids in contact.
    pub solids: usize,
    /// Energy stored [J].
    pub energy: f64,
    /// Deepest contact [m].
    pub depth: f64,
}

impl Summary {
    /// Takes in a pair of solids.
    pub fn add(&mut self, points: usize, energy: f64, depth: f64) {
        self.points += points;
        self.solids += usize::from(points > 0);
        self.energy += energy;
        self.depth = self.depth.max(depth);
    }
}

/// Why a law cannot go on.
#[derive(Clone, Debug)]
pub(crate) struct Fault {
    /// The solid that it is about.
    pub a: usize,
    /// The other one.
    pub b: Against,
    /// What the first one does, said of it.
    pub what: String,
}

/// A contact law.
pub(crate) trait Law: Send {
    /// Searches what may touch where the lists no longer hold, and evaluates the forces, on a device if there is
    /// one and the law has a kernel for these solids.
    fn evaluate(&mut self, now: Now, device: Option<Link>) -> Result<()>;

    /// Adds the wrenches of the last evaluation, made with `bodies`, to `load`, one per solid.
    fn add_loads(&self, bodies: &[Body], load: &mut [Wrench]);

    /// Gives the fixed walls what the last evaluation presses on them over `span` [s].
    fn press_walls(&self, bodies: &[Body], span: f64, fixed: &mut FixedWalls);

    /// Whether it is known of the last evaluation which fixed wall each force is on.
    fn tells_walls_apart(&self) -> bool {
        true
    }

    /// What acts on velocities, after the forces of a sub-step of `h` [s]: friction, or impulses. Returns how many
    /// points and how many pairs of solids it acted on if that is all there is to the law.
    fn act(&mut self, bodies: &mut [Body], fixed: &mut FixedWalls, limits: &Limits, h: f64) -> Summary;

    /// What the last evaluation found.
    fn summary(&self) -> Summary;

    /// Whether the last evaluation has left what the law can be trusted with.
    fn fault(&self, _: Now) -> Option<Fault> {
        None
    }

    /// How a step of `dt` [s], planned as `cut`, is cut so that no solid can go through another, or far into it, between
    /// two sub-steps.
    fn hurry(&self, _: Now, _: f64, cut: Cut) -> std::result::Result<Cut, Fault> {
        Ok(cut)
    }

    /// Whether a contact of the last evaluation may reach its stop within the sub-step.
    fn nears_stop(&self, _: Now) -> bool {
        false
    }

    /// Saves what the law keeps from one sub-step to the next, or takes it over.
    ///
    /// # Errors
    /// As [`Archive::array`].
    fn exchange(&mut self, _: &mut Archive) -> Result<()> {
        Ok(())
    }

    /// The solids have been put elsewhere, and the lists are no longer theirs.
    fn forget(&mut self) {}

    /// The solids have been put elsewhere, where the lists still hold: what was deep before says nothing.
    fn moved(&mut self) {}

    /// Bodies have been brought back over periodic sides: the pairs are made anew, and what was deep before says nothing.
    fn brought_back(&mut self) {}

    /// Energy stored at the poses of `now` [J], by the host alone.
    fn energy(&mut self, now: Now) -> f64;

    /// What the worst contact asks of the step `dt` [s].
    fn worst(&self, limits: &Limits, bodies: &[Body], dt: f64) -> Worst;

    /// K [N/m] that stops a body of kinetic energy `energy` / 2 [J], and what happens with a softer one; `None` if
    /// there is no spring.
    fn spring(&self, energy: f64) -> Option<(f64, &'static str)>;

    /// Whether contacts that the sub-steps cannot carry are softened.
    fn softens(&self) -> bool {
        false
    }

    /// Candidates and patches of the last evaluation, for comparisons.
    fn probe(&mut self, bodies: &[Body], device: Option<Link>, probe: &mut Probe) -> Result<()>;
}

type Make = fn(&case::Contact, &Scene, &[Body], &mut Limits) -> Result<Box<dyn Law>>;

/// What is asked of a law before there is one: the `KIND` of its folder.
pub(crate) struct Kind {
    /// The law between the solids of a scene, and the stiffness of contact for each body.
    pub make: Make,
    /// Gap between two facing surfaces at which contact begins [m], at a spacing [m].
    pub gap: fn(f64) -> f64,
    /// What a device runs for the solids of a scene, or why it runs nothing.
    pub program: fn(&Scene) -> std::result::Result<&'static Program, &'static str>,
    /// Whether it is known of what a device evaluates which fixed wall each force is on ([`Law::tells_walls_apart`]).
    pub device_tells_walls_apart: bool,
}
