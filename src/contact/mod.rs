//! Contact between solids: the bodies of a scene, their motion over a step, sub-stepped on the host.
//!
//! Everything is f64 on the host, but for the pairs of points of scenes with many bodies: a backend with a
//! device searches and presses those in f32, from numbers that do not hold positions ([`device`]). For few
//! bodies a round trip to a device at every sub-step would cost more than the work; [`crate::plan`] judges.

mod advice;
mod archive;
mod broad;
mod candidates;
mod collision;
pub mod device;
mod friction;
mod geometry;
mod paper;
mod probe;
mod report;
mod round;
mod smooth;
mod state;
mod stiffness;

pub use advice::ContactAdvice;
pub use probe::{Probe, ProbePatch};
pub use report::{ContactReport, Energy, SolidState};
pub use stiffness::{damping_ratio, restitution};

use crate::body::{Body, Pose, Wrench};
use crate::case;
use crate::compute::Compute;
use crate::error::{Error, Result};
use crate::scene::Scene;
use candidates::Candidates;
use device::{Link, OnDevice, Traffic};
use glam::DVec3;
use stiffness::Damping;

/// Restitution b of the collision model of the law `pressure`, Eq. (18) [-].
const COLLISION_RESTITUTION: f64 = 0.2;
/// Distance of the collision model over the spacing, a [-].
const COLLISION_DISTANCE: f64 = 0.8;

/// Gap between two facing surfaces at which a law's contact begins [m]: d_c - l0 for the paper's,
/// 0 for the smooth one. A body stands free of forces, and so starts without a jump, at this gap.
pub fn standing_gap(law: case::Law, spacing: f64) -> f64 {
    match law {
        case::Law::Paper => (1.5_f64.sqrt() - 1.0) * spacing,
        case::Law::Smooth | case::Law::Pressure => 0.0,
    }
}

/// The contact law with its working memory.
enum Model {
    /// No solid moves freely, or nothing to touch.
    None,
    Smooth(candidates::Smooth),
    Paper(candidates::Paper, paper::Law),
    /// Baseline: impulses, no forces.
    Collision(candidates::Paper),
}

/// The moving solids of a scene and the contact between them and with the walls.
pub struct Solids {
    names: Vec<String>,
    bodies: Vec<Body>,
    poses: Vec<Pose>,
    predicted: Vec<Pose>,
    contact: Vec<Wrench>,
    gravity: DVec3,
    spacing: f64,
    candidates: Candidates,
    model: Model,
    on_device: OnDevice,
    traffic: Traffic,
    limits: Limits,
    load: Vec<Wrench>,
    /// Time step, its dt sqrt(K / m_e) and its sub-steps, as last planned.
    planned: Option<(f64, f64, u32)>,
}

/// What the case asks of contact, and the stiffness of each body.
#[derive(Clone)]
pub(crate) struct Limits {
    spring: f64,
    damping: Damping,
    viscous_friction: f64,
    friction: f64,
    forced: Option<u32>,
    lambda: Vec<stiffness::Lambda>,
    /// Mass of the lightest free body [kg].
    lightest: f64,
    /// Fastest speed that the case's heights and starting velocities allow [m/s].
    fastest: f64,
    /// Largest time step so far [s]: softened contacts are never stiffened again, which would add energy.
    longest_step: f64,
}

impl Solids {
    /// The solids of `scene` at t = 0. `contact` may be absent only if no solid moves freely.
    ///
    /// # Errors
    /// [`Error::Case`] if a free body has no contact law, or if the law's numbers contradict each other.
    pub fn new(scene: &Scene, contact: Option<&case::Contact>) -> Result<Self> {
        let bodies: Vec<Body> = scene.solids.iter().map(|s| Body::new(s, scene.dimensions)).collect();
        let free = || bodies.iter().filter(|b| b.is_free());
        if let (None, Some(k)) = (contact, bodies.iter().position(Body::is_free)) {
            let name = &scene.solids[k].name;
            return Err(Error::Case(format!(
                "body \"{name}\" moves freely, so the case needs [contact] with law and spring"
            )));
        }
        let lightest = free().map(|b| b.mass).fold(f64::INFINITY, f64::min);
        let fastest = advice::fastest_speed(scene);
        let mut limits = Limits {
            spring: contact.map_or(0.0, |c| c.spring),
            damping: contact.map_or(Ok(Damping::Coefficient(0.0)), |c| Damping::new(c, lightest))?,
            viscous_friction: contact.map_or(0.0, |c| c.viscous_friction),
            friction: contact.map_or(0.0, |c| c.friction),
            forced: contact.and_then(|c| c.substeps).map(|n| n.max(1)),
            lambda: vec![stiffness::Lambda::default(); bodies.len()],
            lightest,
            fastest,
            longest_step: 0.0,
        };
        let model = match contact {
            Some(c) if free().next().is_some() => match c.law {
                case::Law::Smooth => {
                    let model = candidates::Smooth::new(scene);
                    limits.lambda =
                        bodies.iter().zip(&model.surfaces).map(|(b, s)| stiffness::smooth(b, s)).collect();
                    Model::Smooth(model)
                }
                case::Law::Paper => {
                    let model = candidates::Paper::new(scene);
                    let layers = bodies.iter().zip(&model.layers);
                    limits.lambda = layers.map(|(b, l)| stiffness::paper(b, &l.offsets, c.torque)).collect();
                    let Damping::Coefficient(damping) = limits.damping else {
                        unreachable!("Damping::new gives a Ratio to the smooth law alone")
                    };
                    let law = paper::Law {
                        spring: c.spring,
                        damping,
                        viscous_friction: c.viscous_friction,
                        distance: 1.5_f64.sqrt() * scene.spacing,
                        torque: c.torque,
                    };
                    Model::Paper(model, law)
                }
                case::Law::Pressure => Model::Collision(candidates::Paper::new(scene)),
            },
            _ => Model::None,
        };
        let poses: Vec<Pose> = bodies.iter().map(|b| b.pose).collect();
        Ok(Self {
            names: scene.solids.iter().map(|s| s.name.clone()).collect(),
            predicted: poses.clone(),
            candidates: Candidates::new(&poses),
            poses,
            contact: vec![Wrench::default(); bodies.len()],
            load: vec![Wrench::default(); bodies.len()],
            gravity: scene.gravity,
            spacing: scene.spacing,
            bodies,
            model,
            on_device: OnDevice::None,
            traffic: Traffic::default(),
            limits,
            planned: None,
        })
    }

    /// Poses now, one per `scene.solids`.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Name of solid `k`, as in the case.
    pub fn name(&self, k: usize) -> &str {
        &self.names[k]
    }

    /// Speed of the fastest point of any solid [m/s] within the step from `t` to `t + dt`.
    pub fn fastest(&self, t: f64, dt: f64) -> f64 {
        self.bodies.iter().map(|b| b.fastest(t, dt)).fold(0.0, f64::max)
    }

    /// Mean contact wrench over the last step, one per solid (friction included).
    pub fn contact_wrenches(&self) -> &[Wrench] {
        &self.contact
    }

    /// Poses at `t + dt` for the explicit stage of the fluid: V* = V + dt (g + contact acceleration of
    /// the last step), X* = X + dt V*, the same for the angular momentum; prescribed solids by their table.
    pub fn predict(&mut self, t: f64, dt: f64) -> &[Pose] {
        for (k, body) in self.bodies.iter().enumerate() {
            self.predicted[k] = match (body.prescribed_velocity(t, dt), body.prescribed_position(t + dt)) {
                (Some(velocity), Some(position)) => Pose { position, velocity, ..body.pose },
                _ => {
                    let mut body = body.clone();
                    let contact = self.contact[k];
                    body.kick(dt * (body.mass * self.gravity + contact.force), dt * contact.torque);
                    body.drift(dt);
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
        let mut report = self.prepare(dt)?;
        let h = dt / f64::from(report.substeps);
        let before: Vec<(DVec3, DVec3)> = self.bodies.iter().map(|b| (b.pose.velocity, b.momentum)).collect();
        for body in &mut self.bodies {
            if let Some(velocity) = body.prescribed_velocity(t, dt) {
                body.pose.velocity = velocity;
            }
        }
        for step in 0..report.substeps {
            // a plain as_deref_mut would keep the borrow for the whole loop
            let compute = compute.as_mut().map(|c| &mut **c as &mut dyn Compute);
            self.substep(compute, h, dt, fluid, &mut report)?;
            let now = t + dt * f64::from(step + 1) / f64::from(report.substeps);
            for (k, body) in self.bodies.iter_mut().enumerate() {
                if body.is_free() {
                    body.drift(h);
                } else if step + 1 == report.substeps {
                    body.pose.position = body.prescribed_position(now).unwrap_or(body.pose.position);
                } else {
                    body.pose.position += h * body.pose.velocity;
                }
                self.candidates.travelled(k, body, h);
            }
        }
        report.penetration_max_over_l0 /= self.spacing;
        for (k, body) in self.bodies.iter().enumerate() {
            self.poses[k] = body.pose;
            if !body.is_free() {
                continue;
            }
            if !body.pose.is_finite() {
                let what = format!("body \"{}\" has a position or velocity that is no number", self.names[k]);
                return Err(Error::Diverged { step: 0, time: t, stage: "contact", what });
            }
            let (velocity, momentum) = before[k];
            self.contact[k] = Wrench {
                force: body.mass * ((body.pose.velocity - velocity) / dt - self.gravity) - fluid[k].force,
                torque: (body.momentum - momentum) / dt - fluid[k].torque,
            };
        }
        Ok(report)
    }

    /// What contact has asked of a device so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// Forces of contact at the bodies' poses and velocities, on `compute` if there is one, for sub-steps of
    /// `h` [s] of steps of `dt` [s]. Lists are made anew if they no longer hold.
    fn evaluate(&mut self, compute: Option<&mut dyn Compute>, h: f64, dt: f64) -> Result<()> {
        let (bodies, spacing) = (&self.bodies, self.spacing);
        self.candidates.refresh(bodies, spacing, dt);
        let candidates = &self.candidates;
        // the device's kernel presses points of boxes into boxes
        let compute = compute.filter(|_| !matches!(&self.model, Model::Smooth(model) if model.is_round()));
        let mut link = compute.map(|compute| Link { compute, traffic: &mut self.traffic });
        match (&mut self.model, &mut link) {
            (Model::None, _) => {}
            (Model::Smooth(model), None) => {
                self.on_device = OnDevice::None;
                if !model.is_current(candidates) {
                    model.collect(candidates, bodies);
                    model.set_constants(&self.limits, bodies, spacing, h);
                }
                model.evaluate(bodies);
            }
            (Model::Smooth(model), Some(link)) => {
                let pairs = match &mut self.on_device {
                    OnDevice::Smooth(pairs) => pairs,
                    other => {
                        *other = OnDevice::Smooth(device::smooth::Smooth::new(&model.surfaces, link)?.into());
                        let OnDevice::Smooth(pairs) = other else { unreachable!("just set") };
                        pairs
                    }
                };
                if !pairs.is_current(candidates) {
                    pairs.search(model, candidates, bodies, link)?;
                }
                pairs.set_constants(model, &self.limits, bodies, spacing, h);
                pairs.evaluate(model, bodies, link)?;
            }
            (Model::Paper(model, law), None) => {
                self.on_device = OnDevice::None;
                if !model.is_current(candidates) {
                    model.collect(candidates, bodies, law.distance);
                }
                model.evaluate(law, bodies);
            }
            (Model::Paper(model, law), Some(link)) => {
                let pairs = match &mut self.on_device {
                    OnDevice::Paper(pairs) => pairs,
                    other => {
                        *other = OnDevice::Paper(
                            device::paper::Paper::new(&model.layers, bodies, law, link)?.into(),
                        );
                        let OnDevice::Paper(pairs) = other else { unreachable!("just set") };
                        pairs
                    }
                };
                if !pairs.is_current(candidates) {
                    pairs.search(model, candidates, bodies, law, link)?;
                }
                pairs.evaluate(law, bodies, link)?;
            }
            (Model::Collision(model), _) => {
                if !model.is_current(candidates) {
                    model.collect(candidates, bodies, spacing);
                }
            }
        }
        Ok(())
    }

    /// The smooth law's pairs of the last evaluation.
    fn smooth_pairs(&self) -> &[smooth::Pair] {
        match (&self.on_device, &self.model) {
            (OnDevice::Smooth(pairs), _) => &pairs.pairs,
            (_, Model::Smooth(model)) => &model.pairs,
            _ => &[],
        }
    }

    /// The paper's law's pairs of the last evaluation.
    fn paper_pairs(&self) -> &[paper::Pair] {
        match (&self.on_device, &self.model) {
            (OnDevice::Paper(pairs), _) => &pairs.pairs,
            (_, Model::Paper(model, _)) => &model.pairs,
            _ => &[],
        }
    }

    /// Adds the wrenches of the last evaluation to `load`, one per solid.
    fn add_wrenches(&self, load: &mut [Wrench]) {
        for pair in self.smooth_pairs() {
            load[pair.a] += pair.wrench[0];
            if let smooth::Other::Solid(b) = pair.b {
                load[b] += pair.wrench[1];
            }
        }
        for pair in self.paper_pairs() {
            load[pair.a] += pair.wrench[0];
            if let Some(b) = pair.b {
                load[b] += pair.wrench[1];
            }
        }
    }

    /// Forces, impulses and friction of one sub-step; positions stay.
    fn substep(
        &mut self,
        compute: Option<&mut dyn Compute>,
        h: f64,
        dt: f64,
        fluid: &[Wrench],
        report: &mut ContactReport,
    ) -> Result<()> {
        self.evaluate(compute, h, dt)?;
        let mut load = std::mem::take(&mut self.load);
        load.copy_from_slice(fluid);
        self.add_wrenches(&mut load);
        self.load = load;
        (report.pairs, report.solid_pairs, report.potential_energy) = (0, 0, 0.0);
        let mut count = |pairs: usize, energy: f64, depth: f64| {
            report.pairs += pairs;
            report.solid_pairs += usize::from(pairs > 0);
            report.potential_energy += energy;
            report.penetration_max_over_l0 = report.penetration_max_over_l0.max(depth);
        };
        self.smooth_pairs().iter().for_each(|p| count(p.contact_count(), p.energy, p.depth));
        if let Model::Paper(_, law) = &self.model {
            self.paper_pairs().iter().for_each(|p| count(p.count, p.energy, law.distance - p.closest));
        }
        let bodies = &mut self.bodies;
        for (body, load) in bodies.iter_mut().zip(&self.load) {
            if body.is_free() {
                body.kick(h * (body.mass * self.gravity + load.force), h * load.torque);
            }
        }
        match &mut self.model {
            Model::Smooth(model) => {
                let pairs = match &self.on_device {
                    OnDevice::Smooth(pairs) => &pairs.pairs,
                    _ => &model.pairs,
                };
                let (mu, eta) = (self.limits.friction, self.limits.viscous_friction);
                model.friction.apply(pairs, bodies, mu, eta, h);
            }
            Model::Collision(model) => {
                for pair in &model.pairs {
                    let distance = COLLISION_DISTANCE * self.spacing;
                    let hits = collision::collide(
                        pair,
                        bodies,
                        &model.layers,
                        &model.walls,
                        distance,
                        COLLISION_RESTITUTION,
                    );
                    report.pairs += hits;
                    report.solid_pairs += usize::from(hits > 0);
                }
            }
            Model::None | Model::Paper(..) => {}
        }
        Ok(())
    }
}
