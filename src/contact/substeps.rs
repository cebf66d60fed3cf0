//! How a step is cut into contact sub-steps: what the case asks for, what the worst contact needs, what is refused.

use super::between::Betweens;
use super::candidates::reduced_mass;
use super::law::Law;
use super::stiffness::{Damping, Lambda, restitution};
use crate::body::Body;
use crate::case;
use crate::error::{CaseError, Problem, Result};
use crate::scene::{Drive, Scene, Solid, WallShape};
use glam::DMat3;

/// Largest dt sqrt(K / m_e) of a sub-step; 2 is the limit of stability, energy errors grow as its square.
pub(crate) const OMEGA_STEP: f64 = 0.5;
/// The same where energy must come back: the law `smooth` undamped, or with a restitution.
pub(crate) const ELASTIC_OMEGA_STEP: f64 = 0.2;
/// The same with a restitution e, times e; and the most. Where contact begins and ends within a sub-step costs or gives
/// 0.105 (dt sqrt(K / m))^2 of the energy that comes back, rms over both phases. Of an impact that is e^2: 0.18 % of it for any e.
pub(crate) const RETURNED_OMEGA_STEP: f64 = 0.13;
pub(crate) const DAMPED_OMEGA_STEP: f64 = 0.32;
/// The same of the second spring, the stop, which hardly any contact reaches.
pub(crate) const STOP_OMEGA_STEP: f64 = 0.3;
/// Largest C dt / m_e of a sub-step.
pub(crate) const DAMPING_STEP: f64 = 0.8;
/// Largest share of the speed that the dashpot of a restitution takes in a sub-step. It is that of the mass which answers, wherever
/// the points lie, so that what is left to bound are bodies that lean on two others (twice the share) and those that rock on their
/// ends (three times); 2 is the limit of stability.
pub(crate) const TAKEN_STEP: f64 = 0.6;
/// Most sub-steps of the smooth law. What would need more is softened: at 64 sub-steps a body still
/// stops within v dt / 32, so a larger K changes nothing that a fluid step could resolve.
pub(crate) const MOST_SUBSTEPS: u32 = 64;
/// Sub-steps at which the paper's law, which is never softened, is refused.
pub(crate) const ABSURD_SUBSTEPS: u32 = 10_000;

/// What the case asks of contact, and the stiffness of each body.
#[derive(Clone)]
pub(crate) struct Limits {
    pub spring: f64,
    /// Whether the case gives it.
    pub given: bool,
    /// Friction and damping of any two solids.
    pub between: Betweens,
    pub viscous_friction: f64,
    pub forced: Option<u32>,
    pub lambda: Vec<Lambda>,
    /// Mass of the lightest free body [kg].
    pub lightest: f64,
    /// Of gravity, its size [m/s2].
    pub gravity: f64,
    /// Fastest speed that the case's heights and starting velocities allow [m/s].
    pub fastest: f64,
    /// Speed [m/s] of a body that falls from where it starts to the lowest wall.
    pub falling: f64,
    /// Largest time step so far [s]: softened contacts are never stiffened again, which would add energy.
    pub longest_step: f64,
}

/// Numbers of the worst contact of a case for a whole step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Worst {
    /// dt sqrt(K / m_e) with the K of the case [-].
    pub omega_dt: f64,
    /// C dt / m_e with what the case asks for [-].
    pub damping_dt: f64,
    /// Sub-steps that the contact as it will be treated asks for; 0 if the law needs none.
    pub wanted: f64,
    /// The same where a contact reaches its stop.
    pub hardest: f64,
    /// Stiffness of the softest contact [N/m].
    pub softest: f64,
}

/// How a step is cut.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    /// Sub-steps, each at the laws' constants for its length.
    pub substeps: u32,
    /// Parts of a sub-step in which a contact may reach its stop.
    pub parts: u32,
    /// Whether every sub-step is cut into those.
    pub all: bool,
    /// Sub-steps where a contact reaches its stop.
    pub hardest: u32,
    /// dt sqrt(K / m_e) of the whole step [-].
    pub omega_dt: f64,
}

impl Cut {
    /// At least `substeps`, the first at which parts of them make `hardest`, within the most that there may be.
    pub fn new(substeps: u32, hardest: u32, omega_dt: f64) -> Self {
        let most = hardest.max(substeps).max(MOST_SUBSTEPS);
        let fit = |parts: &u32| substeps.max(hardest.div_ceil(*parts)) * parts <= most;
        let parts = (1..=hardest.div_ceil(substeps.max(1))).rev().find(fit).unwrap_or(1);
        Self { substeps: substeps.max(hardest.div_ceil(parts)), parts, all: false, hardest, omega_dt }
    }

    /// With `substeps` at least.
    pub fn at_least(self, substeps: u32) -> Self {
        if substeps <= self.substeps { self } else { Self::new(substeps, self.hardest, self.omega_dt) }
    }
}

impl Limits {
    /// What `contact` asks for; `None` asks for nothing.
    ///
    /// # Errors
    /// [`crate::error::Error::Case`] if its numbers contradict each other.
    pub fn new(contact: Option<&case::Contact>, scene: &Scene, bodies: &[Body]) -> Result<Self> {
        let free = bodies.iter().filter(|b| b.is_free());
        let lightest = free.map(|b| b.mass).fold(f64::INFINITY, f64::min);
        Ok(Self {
            spring: contact.and_then(|c| c.spring).unwrap_or(0.0),
            given: true,
            between: Betweens::new(contact, scene, lightest)?,
            viscous_friction: contact.map_or(0.0, |c| c.viscous_friction),
            forced: contact.and_then(|c| c.substeps).map(|n| n.max(1)),
            lambda: vec![Lambda::default(); bodies.len()],
            lightest,
            gravity: scene.gravity.length(),
            fastest: fastest_speed(scene),
            falling: falling_speed(scene),
            longest_step: 0.0,
        })
    }

    /// Speed [m/s] at which a body may hit something: where nothing is below, the room tells how far it falls.
    pub fn impact(&self) -> f64 {
        if self.falling > 0.0 { self.falling } else { self.fastest }
    }

    /// Every kind of contact that can be the worst: each body on a wall, and the two most agile ones with each
    /// other.
    pub fn extremes(&self, bodies: &[Body]) -> Vec<(usize, Option<usize>)> {
        let free: Vec<usize> = (0..bodies.len()).filter(|&k| bodies[k].is_free()).collect();
        let mut agile = free.clone();
        agile.sort_by(|&i, &j| self.lambda[j].spring.total_cmp(&self.lambda[i].spring));
        let mut cases: Vec<(usize, Option<usize>)> = free.iter().map(|&k| (k, None)).collect();
        if let [first, second, ..] = agile[..] {
            cases.push((first, Some(second)));
        }
        cases
    }

    /// Eigenvalues of the contact of `a` with `b`, unit spring and unit dashpot [1/kg].
    pub fn lambda_of(&self, a: usize, b: Option<usize>) -> (f64, f64) {
        let both = |of: fn(&Lambda) -> f64| of(&self.lambda[a]) + b.map_or(0.0, |b| of(&self.lambda[b]));
        (both(|l| l.spring), both(|l| l.damping))
    }

    /// Takes what the case asks of a pair with `damping` over `dt` [s] into `worst`; `viscous` [kg/s] adds to the dashpot.
    pub fn ask(
        &self,
        worst: &mut Worst,
        bodies: &[Body],
        (a, b): (usize, Option<usize>),
        damping: Damping,
        dt: f64,
        viscous: f64,
    ) {
        let (spring, damped) = self.lambda_of(a, b);
        let asked = damping.coefficient(self.spring, self.spring, reduced_mass(bodies, a, b));
        worst.omega_dt = worst.omega_dt.max(dt * (self.spring * spring).sqrt());
        worst.damping_dt = worst.damping_dt.max(dt * (asked + viscous) * damped);
    }

    /// What the worst contact asks of a step of `dt` [s].
    pub fn worst(&self, law: &dyn Law, bodies: &[Body], dt: f64) -> Worst {
        let longest_step = self.longest_step.max(dt);
        law.worst(&Self { longest_step, ..self.clone() }, bodies, dt)
    }

    /// Number of sub-steps for `worst`.
    ///
    /// # Errors
    /// [`crate::error::Error::Case`] if a forced number is unstable, or if the law would need an absurd one.
    pub fn substeps(&self, worst: &Worst) -> std::result::Result<u32, CaseError> {
        if worst.wanted == 0.0 {
            return Ok(1);
        }
        if let Some(n) = self.forced {
            let (omega, damping) = (worst.omega_dt / f64::from(n), worst.damping_dt / f64::from(n));
            if omega > 1.0 || omega * omega + 2.0 * damping > 4.0 {
                let message = format!(
                    "contact.substeps = {n} is unstable: dt sqrt(K / m_e) = {omega:.2} a sub-step (at most 1), \
                     C dt / m_e = {damping:.2}"
                );
                let remedy = format!(
                    "leave substeps out, or set it to at least {}, or lower contact.spring or run.time_step",
                    (worst.omega_dt / OMEGA_STEP).max(worst.damping_dt).ceil()
                );
                return Err(CaseError::of("contact.substeps", message, remedy));
            }
            return Ok(n);
        }
        let wanted = (worst.wanted - 1e-9).ceil().max(1.0);
        if wanted > f64::from(ABSURD_SUBSTEPS) {
            let (key, what) = if worst.omega_dt / OMEGA_STEP >= worst.damping_dt {
                ("contact.spring", format!("contact.spring = {:.3e} N/m", self.spring))
            } else {
                ("contact", "what damps contact (damping, damping_ratio, viscous_friction)".into())
            };
            let message = format!(
                "{what} asks for {wanted} contact sub-steps a step, more than {ABSURD_SUBSTEPS}, and law = \"paper\" \
                 does not soften"
            );
            let remedy = "lower it or run.time_step, or use law = \"smooth\"";
            let text = format!("{message}: {remedy}");
            return Err(CaseError::new(vec![Problem::new(key, message, remedy)], text));
        }
        Ok(wanted as u32)
    }

    /// Sub-steps where a contact reaches its stop, of a step of `substeps`.
    pub fn hardest(&self, worst: &Worst, substeps: u32) -> u32 {
        if self.forced.is_some() { substeps } else { substeps.max((worst.hardest - 1e-9).ceil() as u32) }
    }

    /// How the step `dt` [s] is cut.
    ///
    /// # Errors
    /// As [`Limits::substeps`].
    pub fn cut(&mut self, law: Option<&dyn Law>, bodies: &[Body], dt: f64) -> Result<Cut> {
        self.longest_step = self.longest_step.max(dt);
        let Some(law) = law else { return Ok(Cut::new(1, 1, 0.0)) };
        let worst = self.worst(law, bodies, dt);
        let substeps = self.substeps(&worst)?;
        Ok(Cut::new(substeps, self.hardest(&worst, substeps), worst.omega_dt))
    }

    /// dt sqrt(K / m_e) of a sub-step: smaller where the energy of an impact is what the case is about,
    /// because it gives a restitution or has next to no damping to take an error away.
    pub fn omega_step(&self) -> f64 {
        let of = |damping| match damping {
            Damping::Ratio(ratio) => {
                (RETURNED_OMEGA_STEP / restitution(ratio)).clamp(ELASTIC_OMEGA_STEP, DAMPED_OMEGA_STEP)
            }
            Damping::Coefficient(c) if c < 0.02 * (self.spring * self.lightest).sqrt() => ELASTIC_OMEGA_STEP,
            Damping::Coefficient(_) => OMEGA_STEP,
        };
        self.between.dampings().map(of).fold(f64::INFINITY, f64::min)
    }

    /// Whether contacts have a restitution; the case gives it for all or for none.
    pub fn restores(&self) -> bool {
        self.between.usual.damping.is_ratio()
    }

    /// dt sqrt(K / m_e) of the most sub-steps that a stop is softened to. With a restitution it is the least that there is, so that the
    /// parts of longer sub-steps make what the stop asks for.
    pub fn stop_carried_at(&self) -> f64 {
        if self.restores() { ELASTIC_OMEGA_STEP } else { self.omega_step() }
    }
}

/// Speed [m/s] of the fastest solid that there could be: the starting speed and the height of the domain.
fn fastest_speed(scene: &Scene) -> f64 {
    let (low, high) = scene.domain;
    let height = (high - low).abs().dot(scene.gravity.normalize_or_zero().abs());
    let height = if height.is_finite() { height } else { 0.0 };
    let start = scene.solids_start();
    (start * start + 2.0 * scene.gravity.length() * height).sqrt()
}

/// Speed [m/s] of a body that falls from where it starts to the lowest wall, or of water that falls its depth.
fn falling_speed(scene: &Scene) -> f64 {
    let up = -scene.gravity.normalize_or_zero();
    let falls = |s: &&Solid| matches!(&s.drive, Drive::Free(body) if body.falls(up));
    let free = scene.solids.iter().filter(falls);
    let highest = free.map(|s| s.position.dot(up) + s.radius()).fold(f64::NEG_INFINITY, f64::max);
    // of each wall the lowest corner of the face that looks up most
    let floor = |w: &WallShape| {
        let along = (w.axes.transpose() * up).abs();
        let rise = along * w.half;
        w.center.dot(up) + 2.0 * rise[along.max_position()] - rise.element_sum()
    };
    let table = |s: &Solid| match &s.drive {
        Drive::Prescribed(_) => {
            Some(s.shape_center().dot(up) + s.shape.extent(DMat3::from_quat(s.orientation)).dot(up.abs()))
        }
        Drive::Free(_) => None,
    };
    let tables = scene.solids.iter().filter_map(table);
    let lowest = scene.walls.iter().map(floor).chain(tables).fold(f64::INFINITY, f64::min);
    let fall = if lowest < highest && lowest.is_finite() { highest - lowest } else { 0.0 };
    // What hangs falls from its upper to its lower balance.
    let arm = |s: &Solid| if let Drive::Free(body) = &s.drive { 2.0 * body.weight_arm.length() } else { 0.0 };
    let fall = scene.solids.iter().map(arm).fold(fall, f64::max);
    let start = scene.solids_start();
    (start * start + 2.0 * scene.gravity.length() * fall.max(scene.depth)).sqrt()
}
