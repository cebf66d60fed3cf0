//! Contact between solids: the bodies of a scene, their motion over a step, sub-stepped on the host.
//!
//! Everything here is f64 on the host, the same for every backend: a contact is thousands of points at
//! most, forces from positions in f32 carry 1 to 10 % of noise, and a round trip to a device for every
//! sub-step would cost more than the work.

mod advice;
mod broad;
mod candidates;
mod collision;
mod edges;
mod friction;
mod geometry;
mod paper;
mod report;
mod smooth;
mod state;
mod stiffness;

pub use advice::ContactAdvice;
pub use report::{ContactReport, Energy, SolidState};
pub use stiffness::{damping_ratio, restitution};

use crate::body::{Body, Pose, Wrench};
use crate::case;
use crate::error::{Error, Result};
use crate::scene::Scene;
use candidates::Candidates;
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
    limits: Limits,
    load: Vec<Wrench>,
    /// Time step, its dt sqrt(K / m_e) and its sub-steps, as last planned.
    planned: Option<(f64, f64, u32)>,
}

/// What the case asks of contact, and the stiffness of each body.
#[derive(Clone)]
struct Limits {
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
                    let Damping::Coefficient(damping) = limits.damping else { unreachable!() };
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
            poses,
            contact: vec![Wrench::default(); bodies.len()],
            load: vec![Wrench::default(); bodies.len()],
            gravity: scene.gravity,
            spacing: scene.spacing,
            candidates: Candidates::new(bodies.len()),
            bodies,
            model,
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
    /// over the step) and contact in sub-steps.
    ///
    /// # Errors
    /// [`Error::Case`] if a forced number of sub-steps is unstable; [`Error::Diverged`] (step left at 0)
    /// if a body's state is no longer finite.
    pub fn advance(&mut self, t: f64, dt: f64, fluid: &[Wrench]) -> Result<ContactReport> {
        let mut report = self.prepare(dt)?;
        let h = dt / f64::from(report.substeps);
        let before: Vec<(DVec3, DVec3)> = self.bodies.iter().map(|b| (b.pose.velocity, b.momentum)).collect();
        for body in &mut self.bodies {
            if let Some(velocity) = body.prescribed_velocity(t, dt) {
                body.pose.velocity = velocity;
            }
        }
        for step in 0..report.substeps {
            self.substep(h, dt, fluid, &mut report);
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

    /// Forces, impulses and friction of one sub-step; positions stay.
    fn substep(&mut self, h: f64, dt: f64, fluid: &[Wrench], report: &mut ContactReport) {
        let bodies = &mut self.bodies;
        self.load.copy_from_slice(fluid);
        (report.pairs, report.solid_pairs, report.potential_energy) = (0, 0, 0.0);
        let deepest = &mut report.penetration_max_over_l0;
        match &mut self.model {
            Model::None => {}
            Model::Smooth(model) => {
                if self.candidates.refresh(bodies, self.spacing, dt) {
                    model.collect(&self.candidates, bodies);
                    model.set_constants(&self.limits, bodies, self.spacing, h);
                }
                model.evaluate(bodies);
                for pair in &model.pairs {
                    self.load[pair.a] += pair.wrench[0];
                    if let smooth::Other::Solid(b) = pair.b {
                        self.load[b] += pair.wrench[1];
                    }
                    report.pairs += pair.contact_count();
                    report.solid_pairs += usize::from(pair.contact_count() > 0);
                    report.potential_energy += pair.energy;
                    *deepest = deepest.max(pair.depth);
                }
            }
            Model::Paper(model, law) => {
                if self.candidates.refresh(bodies, self.spacing, dt) {
                    model.collect(&self.candidates, bodies, law.distance);
                }
                model.evaluate(law, bodies);
                for pair in &model.pairs {
                    self.load[pair.a] += pair.wrench[0];
                    if let Some(b) = pair.b {
                        self.load[b] += pair.wrench[1];
                    }
                    report.pairs += pair.count;
                    report.solid_pairs += usize::from(pair.count > 0);
                    report.potential_energy += pair.energy;
                    *deepest = deepest.max(law.distance - pair.closest);
                }
            }
            Model::Collision(model) => {
                if self.candidates.refresh(bodies, self.spacing, dt) {
                    model.collect(&self.candidates, bodies, self.spacing);
                }
            }
        }
        for (body, load) in bodies.iter_mut().zip(&self.load) {
            if body.is_free() {
                body.kick(h * (body.mass * self.gravity + load.force), h * load.torque);
            }
        }
        match &mut self.model {
            Model::Smooth(model) => {
                let (mu, eta) = (self.limits.friction, self.limits.viscous_friction);
                model.friction.apply(&model.pairs, bodies, mu, eta, h);
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
    }
}
