//! How a time step is cut into contact sub-steps, and what a user should know about the numbers.

use super::candidates::reduced_mass;
use super::stiffness::{ABSURD_SUBSTEPS, DAMPING_STEP, EXPONENT, OMEGA_STEP};
use super::{ContactReport, Limits, Model, Solids};
use crate::error::{Error, Result};
use crate::scene::{Drive, Scene};

/// K over Eq. (16) at which the paper's law returns a falling body from every entry phase: measured
/// 5.6 to 5.8, theory [d_c / (d_c - l0 / sqrt 2)]^2 = 5.60.
const PAPER_FACTOR: f64 = 6.5;

/// What contact will do at a time step, for `seixo plan`.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactAdvice {
    /// dt sqrt(K / m_e) of the whole step with the K of the case [-]; stable below 2, accurate below 0.5.
    pub omega_dt: f64,
    /// C dt / m_e of the whole step [-].
    pub damping_dt: f64,
    /// Sub-steps planned; `None` if the case's own number is refused.
    pub substeps: Option<u32>,
    /// K that the case's heights and masses ask for [N/m].
    pub spring_recommended: f64,
    /// Stiffness that the softest contact gets [N/m]: below K where the sub-steps cannot carry K.
    pub spring_softest: f64,
    /// The same in words, one remark each.
    pub words: Vec<String>,
}

/// Speed [m/s] of the fastest solid: the starting speed and the height of the domain.
pub(crate) fn fastest_speed(scene: &Scene) -> f64 {
    let (low, high) = scene.domain;
    let height = (high - low).abs().dot(scene.gravity.normalize_or_zero().abs());
    let height = if height.is_finite() { height } else { 0.0 };
    let start = scene.solids.iter().map(|s| match &s.drive {
        Drive::Free(body) => body.velocity.length(),
        Drive::Prescribed(motion) => {
            let rows = motion.time.windows(2).zip(motion.displacement.windows(2));
            rows.map(|(t, x)| (x[1] - x[0]).length() / (t[1] - t[0])).fold(0.0, f64::max)
        }
    });
    let start = start.fold(0.0, f64::max);
    (start * start + 2.0 * scene.gravity.length() * height).sqrt()
}

/// Numbers of the worst contact of a case.
#[derive(Clone, Copy, Debug, Default)]
struct Worst {
    omega_dt: f64,
    damping_dt: f64,
    /// Sub-steps that the contact as it will be treated asks for.
    wanted: f64,
    softest: f64,
}

impl Solids {
    /// Every kind of contact that can be the worst: each body on a wall, and the two most agile ones
    /// with each other.
    fn worst(&self, dt: f64) -> Worst {
        let longest_step = self.limits.longest_step.max(dt);
        let limits = &Limits { longest_step, ..self.limits.clone() };
        let free: Vec<usize> = (0..self.bodies.len()).filter(|&k| self.bodies[k].is_free()).collect();
        let mut agile = free.clone();
        agile.sort_by(|&i, &j| limits.lambda[j].spring.total_cmp(&limits.lambda[i].spring));
        let mut cases: Vec<(usize, Option<usize>)> = free.iter().map(|&k| (k, None)).collect();
        if let [first, second, ..] = agile[..] {
            cases.push((first, Some(second)));
        }
        let mut worst = Worst { softest: limits.spring, ..Worst::default() };
        for (a, b) in cases {
            let sum = |of: fn(&super::stiffness::Lambda) -> f64| {
                of(&limits.lambda[a]) + b.map_or(0.0, |b| of(&limits.lambda[b]))
            };
            let (spring, damping) = (sum(|l| l.spring), sum(|l| l.damping));
            let mass = reduced_mass(&self.bodies, a, b);
            let asked = limits.damping.coefficient(limits.spring, limits.spring, mass);
            worst.omega_dt = worst.omega_dt.max(dt * (limits.spring * spring).sqrt());
            let viscous = if matches!(self.model, Model::Paper(..)) { limits.viscous_friction } else { 0.0 };
            worst.damping_dt = worst.damping_dt.max(dt * (asked + viscous) * damping);
            if let Model::Smooth(model) = &self.model {
                let weight = model.surfaces[a].smallest_weight;
                let c = limits.constants(&self.bodies, a, b, weight, self.spacing);
                let stopping = c.damping * (c.stop / c.spring).sqrt();
                let for_spring = dt * (c.stop * spring).sqrt() / limits.omega_step();
                worst.wanted = worst.wanted.max(for_spring).max(dt * stopping * damping / DAMPING_STEP);
                worst.softest = worst.softest.min(c.spring);
            }
        }
        if matches!(self.model, Model::Paper(..)) {
            worst.wanted = (worst.omega_dt / OMEGA_STEP).max(worst.damping_dt);
        }
        worst
    }

    /// Sub-steps for the step `dt`; sets the pairs' constants.
    pub(super) fn prepare(&mut self, dt: f64) -> Result<ContactReport> {
        self.limits.longest_step = self.limits.longest_step.max(dt);
        let (omega_dt, substeps) = match self.planned {
            Some((step, omega_dt, substeps)) if step == dt => (omega_dt, substeps),
            _ => {
                let worst = self.worst(dt);
                let substeps = self.substeps(&worst)?;
                self.planned = Some((dt, worst.omega_dt, substeps));
                (worst.omega_dt, substeps)
            }
        };
        if let Model::Smooth(model) = &mut self.model {
            model.set_constants(&self.limits, &self.bodies, self.spacing, dt / f64::from(substeps));
        }
        Ok(ContactReport { substeps, omega_dt, ..ContactReport::default() })
    }

    /// Why contact cannot be computed with steps of `dt` [s], if so.
    pub(crate) fn refuses(&self, dt: f64) -> Option<String> {
        self.substeps(&self.worst(dt)).err().map(|e| e.to_string())
    }

    fn substeps(&self, worst: &Worst) -> Result<u32> {
        if matches!(self.model, Model::None | Model::Collision(_)) {
            return Ok(1);
        }
        if let Some(n) = self.limits.forced {
            let (omega, damping) = (worst.omega_dt / f64::from(n), worst.damping_dt / f64::from(n));
            if omega > 1.0 || omega * omega + 2.0 * damping > 4.0 {
                return Err(Error::Case(format!(
                    "contact.substeps = {n} is unstable: dt sqrt(K / m_e) = {omega:.2} a sub-step (at most 1), \
                     C dt / m_e = {damping:.2}; leave substeps out, or set it to at least {}, or lower \
                     contact.spring or run.time_step",
                    (worst.omega_dt / OMEGA_STEP).max(worst.damping_dt).ceil()
                )));
            }
            return Ok(n);
        }
        let wanted = (worst.wanted - 1e-9).ceil().max(1.0);
        if wanted > f64::from(ABSURD_SUBSTEPS) {
            return Err(Error::Case(format!(
                "contact.spring = {:.3e} N/m asks for {wanted} contact sub-steps a step (at most \
                 {ABSURD_SUBSTEPS} for law = \"paper\"); lower it or run.time_step",
                self.limits.spring
            )));
        }
        Ok(wanted as u32)
    }

    /// What contact will do at the time step `dt` [s].
    pub fn advice(&self, dt: f64) -> ContactAdvice {
        let mut words = vec![];
        let heaviest = self.bodies.iter().filter(|b| b.is_free()).map(|b| b.mass).fold(0.0, f64::max);
        let smooth = match &self.model {
            Model::Smooth(model) => Some(model),
            _ => None,
        };
        let worst = self.worst(dt);
        let energy = heaviest * self.limits.fastest.powi(2);
        let spring_recommended = match smooth {
            Some(model) => {
                let weight = model.surfaces.iter().map(|s| s.smallest_weight).fold(1.0, f64::min);
                energy / (0.25 * self.spacing).powi(2) / weight.powf(2.0 / EXPONENT)
            }
            None => PAPER_FACTOR * energy / (1.5 * self.spacing.powi(2)),
        };
        let substeps = self.substeps(&worst);
        let spring = self.limits.spring;
        let numbers = format!(
            "contact: dt sqrt(K / m_e) = {:.2}, C dt / m_e = {:.2}",
            worst.omega_dt, worst.damping_dt
        );
        match &substeps {
            Ok(n) => words.push(format!("{numbers}: {n} sub-steps a step")),
            Err(e) => words.extend([e.to_string(), format!("{numbers}: refused, see above")]),
        }
        words.push(format!(
            "contact: the heaviest body ({heaviest:.3e} kg) at {:.1} m/s asks for a spring of about {:.1e} N/m; \
             the case has {spring:.1e}",
            self.limits.fastest, spring_recommended
        ));
        if spring < 0.1 * spring_recommended {
            words.push(match smooth {
                Some(_) => {
                    "contact: the spring is soft: hard impacts reach a quarter of the spacing, where a \
                            stiffer stop takes over"
                        .to_string()
                }
                None => {
                    "contact: the spring is too soft to stop the heaviest body at its fastest; it may pass \
                         through a wall"
                        .to_string()
                }
            });
        }
        if let (Ok(substeps), true) = (&substeps, worst.softest < 0.999 * spring) {
            words.push(format!(
                "contact: {substeps} sub-steps carry {:.1e} N/m on the lightest body, so its contact is softened \
                 to that; a smaller run.time_step raises it",
                worst.softest
            ));
        }
        let sinks = self.limits.fastest * (heaviest / worst.softest).sqrt() / self.spacing;
        if smooth.is_some() && sinks > 0.1 {
            words.push(format!(
                "contact: at that speed the heaviest body may press what lies between it and a wall {sinks:.2} \
                 spacings deep; a spring four times as stiff halves that, where the sub-steps carry it"
            ));
        }
        ContactAdvice {
            omega_dt: worst.omega_dt,
            damping_dt: worst.damping_dt,
            substeps: substeps.ok(),
            spring_recommended,
            spring_softest: worst.softest,
            words,
        }
    }
}
