//! Contact between solids: the bodies of a scene, their motion over a step, sub-stepped on the host.
//!
//! Everything is f64 on the host, but for the pairs of points of scenes with many bodies: a backend with a
//! device searches and presses those in f32, from numbers that do not hold positions ([`device`]). For few
//! bodies a round trip to a device at every sub-step would cost more than the work; [`crate::plan`] judges.

mod advice;
mod archive;
mod between;
pub(crate) mod broad;
mod candidates;
pub mod device;
mod fixed;
mod law;
mod paper;
mod pressure;
mod probe;
mod report;
mod smooth;
mod state;
mod stiffness;
mod substeps;

pub use advice::ContactAdvice;
pub use probe::{Probe, ProbePatch};
pub use report::{ContactReport, Energy, SolidState};
pub use stiffness::{damping_ratio, restitution};

use crate::body::{Body, FreeBody, Mobility, Pose, Wrench};
use crate::case;
use crate::compute::Compute;
use crate::error::{Error, Result};
use crate::periodic::Periodic;
use crate::scene::Scene;
use between::Against;
use candidates::Candidates;
use device::{Link, Traffic};
use fixed::FixedWalls;
use glam::{DVec3, IVec3};
use law::{Fault, Kind, Law, Now};
use substeps::{Cut, Limits};

/// Gap between two facing surfaces at which a law's contact begins [m]: d_c - l0 for the paper's,
/// 0 for the smooth one. A body stands free of forces, and so starts without a jump, at this gap.
pub fn standing_gap(law: case::Law, spacing: f64) -> f64 {
    (kind(law).gap)(spacing)
}

/// The laws: a folder, and an arm here.
pub(crate) fn kind(law: case::Law) -> &'static Kind {
    match law {
        case::Law::Smooth => &smooth::KIND,
        case::Law::Paper => &paper::KIND,
        case::Law::Pressure => &pressure::KIND,
    }
}

/// The moving solids of a scene and the contact between them and with the walls.
pub struct Solids {
    names: Vec<String>,
    bodies: Vec<Body>,
    poses: Vec<Pose>,
    predicted: Vec<Pose>,
    contact: Vec<Wrench>,
    fixed: FixedWalls,
    /// Whole lengths that each has gone over periodic sides.
    turns: Vec<IVec3>,
    periodic: Periodic,
    gravity: DVec3,
    spacing: f64,
    candidates: Candidates,
    /// `None` if no solid moves freely.
    law: Option<Box<dyn Law>>,
    traffic: Traffic,
    limits: Limits,
    load: Vec<Wrench>,
    /// Time step [s] and how it is cut, as last planned.
    planned: Option<(f64, Cut)>,
    /// Sub-step [s] of the last step; 0 before the first.
    substep: f64,
    /// The one that the constants of its contacts are for [s]: that itself, or what it is a part of.
    whole: f64,
}

impl Solids {
    /// The solids of `scene` at t = 0. `contact` may be absent only if no solid moves freely.
    ///
    /// # Errors
    /// [`Error::Case`] if a free body has no contact law, if its numbers contradict each other, or if it has no spring and nothing tells one.
    pub fn new(scene: &Scene, contact: Option<&case::Contact>) -> Result<Self> {
        let bodies: Vec<Body> = scene.solids.iter().map(|s| Body::new(s, scene.dimensions)).collect();
        let free = bodies.iter().position(Body::is_free);
        if let (None, Some(k)) = (contact, free) {
            let name = &scene.solids[k].name;
            let message = format!("body \"{name}\" moves freely, so the case needs a table [contact]");
            return Err(Error::key("contact", message, ""));
        }
        let sprung = match contact {
            Some(contact) if contact.spring.is_none() && free.is_some() => {
                Some(case::Contact { spring: advice::spring(contact, scene, &bodies)?, ..contact.clone() })
            }
            _ => None,
        };
        let contact = sprung.as_ref().or(contact);
        let mut limits = Limits { given: sprung.is_none(), ..Limits::new(contact, scene, &bodies)? };
        let law = match (contact, free) {
            (Some(contact), Some(_)) => Some((kind(contact.law).make)(contact, scene, &bodies, &mut limits)?),
            _ => None,
        };
        let poses: Vec<Pose> = bodies.iter().map(|b| b.pose).collect();
        Ok(Self {
            names: scene.solids.iter().map(|s| s.name.clone()).collect(),
            predicted: poses.clone(),
            candidates: Candidates::new(&poses, scene.periodic),
            turns: vec![IVec3::ZERO; bodies.len()],
            periodic: scene.periodic,
            poses,
            contact: vec![Wrench::default(); bodies.len()],
            fixed: FixedWalls::new(scene),
            load: vec![Wrench::default(); bodies.len()],
            gravity: scene.gravity,
            spacing: scene.spacing,
            bodies,
            law,
            traffic: Traffic::default(),
            limits,
            planned: None,
            substep: 0.0,
            whole: 0.0,
        })
    }

    /// Poses now, one per `scene.solids`. What forces move lies between periodic sides.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Where solid `k` has come to [m], on beyond the periodic sides that it has crossed.
    pub fn path(&self, k: usize) -> DVec3 {
        self.bodies[k].pose.position + self.periodic.way(self.turns[k])
    }

    /// Poses that [`Solids::predict`] gave last.
    pub fn predicted(&self) -> &[Pose] {
        &self.predicted
    }

    /// How far [m] solid `k` is from where its motion has it at time `t` [s]; nothing of a free one.
    pub(crate) fn off_motion(&self, k: usize, t: f64) -> Option<f64> {
        self.bodies[k].off_motion(t)
    }

    /// Whether forces move solid `k`.
    pub fn is_free(&self, k: usize) -> bool {
        self.bodies[k].is_free()
    }

    /// The solids as the pressure equation sees them, with the contact of the last step. `gravity` is what of it the
    /// explicit stage has not had [m/s2].
    pub fn free_bodies(&self, gravity: DVec3) -> Vec<FreeBody> {
        let of = |(body, contact): (&Body, &Wrench)| {
            if !body.is_free() {
                return FreeBody::default();
            }
            let mut load = body.weight(gravity);
            load += *contact;
            FreeBody { mobility: Mobility::of_body(body.inverse_mass, body.inverse_inertia), load }
        };
        self.bodies.iter().zip(&self.contact).map(of).collect()
    }

    /// How bodies move in the next step with the water in their slots, by their index.
    pub fn stand_in_slots(&mut self, mobilities: Vec<(usize, Mobility)>) {
        mobilities.into_iter().for_each(|(k, mobility)| self.bodies[k].in_slots = Some(Box::new(mobility)));
    }

    /// Name of solid `k`, as in the case.
    pub fn name(&self, k: usize) -> &str {
        &self.names[k]
    }

    /// Speed of the fastest point of any solid [m/s] within the step from `t` to `t + dt`.
    pub fn fastest(&self, t: f64, dt: f64) -> f64 {
        self.bodies.iter().map(|b| b.fastest(t, dt)).fold(0.0, f64::max)
    }

    /// Mean wrench of contact over the last step, friction included, one per solid: of what is held or driven, too,
    /// and nothing of what holds it.
    pub fn contact_wrenches(&self) -> &[Wrench] {
        &self.contact
    }

    /// Power that driven solids gave to bodies by contact over the last step [J/s].
    pub fn driven_contact_power(&self) -> f64 {
        let driven = self.bodies.iter().zip(&self.contact).filter(|(body, _)| !body.is_free());
        let power = |(body, felt): (&Body, &Wrench)| {
            -felt.force.dot(body.pose.velocity) - felt.torque.dot(body.pose.angular_velocity)
        };
        driven.map(power).sum()
    }

    /// Mean wrench of contact over the last step on each of [`Scene::walls`], about its `middle`; `None` if no solid moves
    /// freely, or if a device has pressed them that does not tell walls apart.
    pub fn wall_contact_wrenches(&self) -> Option<&[Wrench]> {
        self.law.as_ref().filter(|law| law.tells_walls_apart()).map(|_| self.fixed.mean())
    }

    /// Poses at `t + ahead`, where the fluid finds its forces in the step of `dt` [s]: V* = V + dt (`gravity` + contact acceleration of
    /// the last step), X* = X + ahead V*, the same for the angular momentum; prescribed solids by their table.
    /// `gravity` is that of the fluid's explicit stage ([`crate::params::Params::explicit_gravity`]), so that body
    /// and water fall together there. Without `contact` where that acts with the pressure, see [`Solids::free_bodies`].
    pub fn predict(&mut self, t: f64, dt: f64, ahead: f64, gravity: DVec3, contact: bool) -> &[Pose] {
        // A step that was given up leaves what it had.
        self.bodies.iter_mut().for_each(|body| body.in_slots = None);
        for (k, body) in self.bodies.iter().enumerate() {
            self.predicted[k] = match body.prescribed(t, dt, ahead) {
                Some(pose) => pose,
                None => {
                    let mut body = body.clone();
                    let contact = if contact { self.contact[k] } else { Wrench::default() };
                    let weight = body.weight(gravity);
                    body.kick(dt * (weight.force + contact.force), dt * (weight.torque + contact.torque));
                    body.drift(ahead);
                    body.pose
                }
            };
        }
        &self.predicted
    }

    /// Moves the solids from `t` to `t + dt` under gravity, the fluid's wrenches (one per solid, held
    /// over the step) and contact in sub-steps, all on the host.
    ///
    /// # Errors
    /// [`Error::Case`] if a forced number of sub-steps is unstable; [`Error::Diverged`] (step left at 0)
    /// if a body's state is no longer finite.
    pub fn advance(&mut self, t: f64, dt: f64, fluid: &[Wrench]) -> Result<ContactReport> {
        self.advance_on(None, t, dt, fluid)
    }

    /// As [`Solids::advance`], with the pairs of points on `compute` if there is one: always the same one.
    ///
    /// # Errors
    /// Those of [`Solids::advance`], and [`Error::Gpu`].
    pub fn advance_on(
        &mut self,
        mut compute: Option<&mut dyn Compute>,
        t: f64,
        dt: f64,
        fluid: &[Wrench],
    ) -> Result<ContactReport> {
        let cut = self.prepare(dt)?;
        self.bodies.iter_mut().for_each(|b| b.follow(t, dt));
        let cut = self.hurry(cut, t, dt)?;
        let mut report = ContactReport { omega_dt: cut.omega_dt, ..ContactReport::default() };
        self.bodies.iter_mut().for_each(|b| b.touched = Wrench::default());
        self.fixed.begin();
        for step in 0..cut.substeps {
            let (mut part, mut parts) = (0, if cut.all { cut.parts } else { 1 });
            while part < parts {
                // a plain as_deref_mut would keep the borrow for the whole loop
                let compute = compute.as_mut().map(|c| &mut **c as &mut dyn Compute);
                let at = |part: u32, parts: u32| f64::from(step) + f64::from(part) / f64::from(parts);
                let whole = dt / f64::from(cut.substeps);
                let start = t + whole * at(part, parts);
                let follow = |bodies: &mut [Body], h: f64| {
                    bodies.iter_mut().filter(|b| b.bends(t, dt)).for_each(|b| b.follow(start, h));
                };
                follow(&mut self.bodies, whole / f64::from(parts));
                self.evaluate(compute, whole, dt)?;
                if parts < cut.parts && self.nears_stop(whole) {
                    parts = cut.parts;
                    follow(&mut self.bodies, whole / f64::from(parts));
                }
                let h = whole / f64::from(parts);
                // since the evaluation before, the solids have moved for the sub-step before
                self.check(start, h.max(self.substep))?;
                self.act(h, fluid, &mut report);
                part += 1;
                let last = step + 1 == cut.substeps && part == parts;
                let now = t + dt * at(part, parts) / f64::from(cut.substeps);
                for (k, body) in self.bodies.iter_mut().enumerate() {
                    if body.is_free() {
                        body.drift(h);
                    } else {
                        body.carry(now, h, last);
                    }
                    self.candidates.travelled(k, body, h);
                }
                report.substeps += 1;
                (self.substep, self.whole) = (h, whole);
            }
        }
        report.penetration_max_over_l0 /= self.spacing;
        self.bring_back();
        self.fixed.end(dt);
        for (k, body) in self.bodies.iter_mut().enumerate() {
            self.poses[k] = body.pose;
            self.contact[k] = body.touched / dt;
            body.in_slots = None;
            if body.is_free() && !body.pose.is_finite() {
                let what = format!("body \"{}\" has a position or velocity that is no number", self.names[k]);
                return Err(Error::Diverged { step: 0, time: t, stage: "contact", what });
            }
        }
        Ok(report)
    }

    /// Brings bodies that have left through a periodic side in through the opposite one.
    fn bring_back(&mut self) {
        for (body, turns) in self.bodies.iter_mut().zip(&mut self.turns).filter(|(b, _)| b.is_free()) {
            let gone = self.periodic.whole(body.pose.position);
            if gone != IVec3::ZERO {
                body.pose.position = self.periodic.wrap(body.pose.position);
                *turns += gone;
                self.candidates.forget();
                if let Some(law) = &mut self.law {
                    law.brought_back();
                }
            }
        }
    }

    /// What contact has asked of a device so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// How the step `dt` [s] is cut.
    fn prepare(&mut self, dt: f64) -> Result<Cut> {
        if let Some((step, cut)) = self.planned
            && step == dt
        {
            return Ok(cut);
        }
        let cut = self.limits.cut(self.law.as_deref(), &self.bodies, dt)?;
        self.planned = Some((dt, cut));
        Ok(cut)
    }

    /// How the step is cut: into more than planned while a fast solid is close to another.
    fn hurry(&mut self, cut: Cut, t: f64, dt: f64) -> Result<Cut> {
        self.candidates.reach_ahead(&self.bodies, dt);
        self.candidates.refresh(&self.bodies, self.spacing, dt);
        let Self { law: Some(law), bodies, candidates, limits, .. } = self else { return Ok(cut) };
        law.hurry(Now { bodies, candidates, limits, substep: dt }, dt, cut)
            .map_err(|fault| self.fault(&fault, t))
    }

    /// Whether a contact of the last evaluation may reach its stop within a sub-step of `h` [s].
    fn nears_stop(&self, h: f64) -> bool {
        let Self { law, bodies, candidates, limits, .. } = self;
        law.as_ref().is_some_and(|law| law.nears_stop(Now { bodies, candidates, limits, substep: h }))
    }

    /// An error if the last evaluation has left what the law can be trusted with.
    fn check(&self, t: f64, h: f64) -> Result<()> {
        let Self { law: Some(law), bodies, candidates, limits, .. } = self else { return Ok(()) };
        match law.fault(Now { bodies, candidates, limits, substep: h }) {
            Some(fault) => Err(self.fault(&fault, t)),
            None => Ok(()),
        }
    }

    fn fault(&self, fault: &Fault, time: f64) -> Error {
        let other = match fault.b {
            Against::Solid(b) => format!("\"{}\"", self.names[b]),
            Against::Wall(w) => format!("wall \"{}\"", self.fixed.name(w)),
        };
        let what = format!("body \"{}\" against {other}: it {}", self.names[fault.a], fault.what);
        Error::Diverged { step: 0, time, stage: "contact", what }
    }

    /// Forces of contact at the bodies' poses and velocities, on `compute` if there is one, for sub-steps of
    /// `h` [s] of steps of `dt` [s]. Lists are made anew if they no longer hold.
    fn evaluate(&mut self, compute: Option<&mut dyn Compute>, h: f64, dt: f64) -> Result<()> {
        self.candidates.refresh(&self.bodies, self.spacing, dt);
        let Some(law) = &mut self.law else { return Ok(()) };
        let Self { bodies, candidates, limits, traffic, .. } = self;
        let link = compute.map(|compute| Link { compute, traffic });
        law.evaluate(Now { bodies, candidates, limits, substep: h }, link)
    }

    /// Takes the forces of the last evaluation, impulses and friction of `h` [s] into the velocities; positions stay.
    fn act(&mut self, h: f64, fluid: &[Wrench], report: &mut ContactReport) {
        // Velocities lie half a sub-step behind the positions: where its length changes, the kick spans from the middle of
        // the one before to that of the next. With h alone an impact gains (h_before - h) F . v.
        let span = if self.substep > 0.0 { 0.5 * (self.substep + h) } else { h };
        self.load.fill(Wrench::default());
        if let Some(law) = &self.law {
            law.add_loads(&self.bodies, &mut self.load);
        }
        for ((body, load), fluid) in self.bodies.iter_mut().zip(&self.load).zip(fluid) {
            body.touched.add(span, load);
            if body.is_free() {
                let mut steady = body.weight(self.gravity);
                steady += *fluid;
                let before = body.pose;
                body.kick(h * steady.force + span * load.force, h * steady.torque + span * load.torque);
                let Pose { velocity, angular_velocity, .. } = body.pose;
                body.forced = (velocity - before.velocity, angular_velocity - before.angular_velocity);
            }
        }
        if let Some(law) = &mut self.law {
            law.press_walls(&self.bodies, span, &mut self.fixed);
            let pressed = law.summary();
            let acted = law.act(&mut self.bodies, &mut self.fixed, &self.limits, h);
            report.pairs = pressed.points + acted.points;
            report.solid_pairs = pressed.solids + acted.solids;
            report.potential_energy = pressed.energy;
            report.penetration_max_over_l0 = report.penetration_max_over_l0.max(pressed.depth);
        }
    }
}
