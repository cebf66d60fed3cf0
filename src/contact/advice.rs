//! What a user should know about the numbers of contact.

use super::substeps::Limits;
use super::{Solids, kind};
use crate::body::Body;
use crate::case;
use crate::error::{CaseError, Error, Result};
use crate::scene::Scene;

/// Mass of the heaviest body over that of the lightest from which a restitution between them is spoken of.
const HEAVIER: f64 = 10.0;
/// Depth over the spacing to which a weight alone may press, beyond which it is spoken of.
pub(super) const SIZABLE: f64 = 0.25;
/// Depth over the spacing, or over half of the thinner solid, for which a spring is named that carries a weight.
pub(super) const CARRIED: f64 = 0.1;

/// Depth over the spacing to which the heaviest body may press another one into a wall, beyond which it is spoken of.
const SINKS: f64 = 0.1;

/// What contact will do at a time step, for `seixo plan`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactAdvice {
    /// dt sqrt(K / m_e) of the whole step with the K of the case [-]; stable below 2, accurate below 0.5.
    pub omega_dt: f64,
    /// C dt / m_e of the whole step [-].
    pub damping_dt: f64,
    /// Sub-steps planned, where no contact nears its stop; `None` if the case's own number is refused.
    pub substeps: Option<u32>,
    /// K that the case's heights and masses ask for [N/m]; `None` if the law has no spring.
    pub spring_recommended: Option<f64>,
    /// Stiffness that the softest contact gets [N/m]: below K where the sub-steps cannot carry K.
    pub spring_softest: f64,
    /// The same in words, one remark each.
    pub words: Vec<String>,
}

/// The spring [N/m] of a `contact` that gives none, of two digits: it stops the heaviest body that has fallen as far as it can, and
/// carries its weight. `None` if the law has none.
///
/// # Errors
/// [`Error::Case`] if nothing falls or moves at the start: nothing tells one then.
pub(super) fn spring(contact: &case::Contact, scene: &Scene, bodies: &[Body]) -> Result<Option<f64>> {
    // The law tells it and wants one to be made; what it tells does not depend on that.
    let any = case::Contact { spring: Some(1.0), ..contact.clone() };
    let mut limits = Limits::new(Some(&any), scene, bodies)?;
    let law = (kind(any.law).make)(&any, scene, bodies, &mut limits)?;
    let heaviest = heaviest(bodies);
    let falling = limits.impact();
    let Some((stopping, _)) = law.spring(heaviest * falling.powi(2)) else { return Ok(None) };
    let carrying = heaviest * limits.gravity / (CARRIED * scene.spacing);
    let sinking = if law.softens() { heaviest * (falling / (SINKS * scene.spacing)).powi(2) } else { 0.0 };
    let spring = format!("{:.1e}", stopping.max(carrying).max(sinking)).parse().unwrap_or(0.0);
    if spring > 0.0 {
        return Ok(Some(spring));
    }
    let message =
        "contact: nothing falls and nothing moves at the start, which would tell the stiffness of contact";
    Err(Error::key("contact", message, "add `spring` [N/m], e.g. 1e5, to [contact]"))
}

/// Mass of the heaviest free body [kg].
fn heaviest(bodies: &[Body]) -> f64 {
    bodies.iter().filter(|b| b.is_free()).map(|b| b.mass).fold(0.0, f64::max)
}

impl Solids {
    /// Why contact cannot be computed with steps of `dt` [s], if so.
    pub(crate) fn refuses(&self, dt: f64) -> Option<CaseError> {
        let law = self.law.as_deref()?;
        self.limits.substeps(&self.limits.worst(law, &self.bodies, dt)).err()
    }

    /// What contact will do at the time step `dt` [s].
    pub fn advice(&self, dt: f64) -> ContactAdvice {
        let mut words = vec![];
        let heaviest = heaviest(&self.bodies);
        let Some(law) = self.law.as_deref() else { return ContactAdvice::default() };
        let worst = self.limits.worst(law, &self.bodies, dt);
        let energy = heaviest * self.limits.falling.powi(2);
        let recommended = law.spring(energy);
        let substeps = self.limits.substeps(&worst);
        let spring = self.limits.spring;
        let numbers = format!(
            "contact: dt sqrt(K / m_e) = {:.2}, C dt / m_e = {:.2}",
            worst.omega_dt, worst.damping_dt
        );
        match &substeps {
            Ok(_) if recommended.is_none() => words.push(
                "contact: this law knows collisions alone; a spring, damping and sub-steps have no part in it".into(),
            ),
            Ok(n) => {
                let hardest = self.limits.hardest(&worst, *n);
                let more = if hardest > *n {
                    format!(", {hardest} where one nears its stop")
                } else {
                    String::new()
                };
                words.push(format!("{numbers}: {n} sub-step{} a step{more}", if *n == 1 { "" } else { "s" }));
            }
            Err(e) => words.extend([e.to_string(), format!("{numbers}: refused, see above")]),
        }
        // Where nothing can fall, nothing asks for one.
        let recommended = recommended.filter(|_| energy > 0.0);
        if !self.limits.given && law.spring(1.0).is_some() {
            words.push(format!(
                "contact: no spring is given: {spring:.1e} N/m is taken, which stops the heaviest body ({heaviest:.3e} kg) at {:.1} m/s and carries its \
                 weight",
                self.limits.impact()
            ));
        } else if let Some((wanted, soft)) = &recommended {
            words.push(format!(
                "contact: the heaviest body ({heaviest:.3e} kg) at {:.1} m/s asks for a spring of about {wanted:.1e} \
                 N/m; the case has {spring:.1e}",
                self.limits.falling
            ));
            if spring < 0.1 * wanted {
                words.push(format!("contact: the spring is soft: {soft}"));
            }
        }
        if let (Ok(substeps), true) = (&substeps, worst.softest < 0.999 * spring) {
            words.push(format!(
                "contact: {substeps} sub-steps carry {:.1e} N/m on the lightest body, so its contact is softened \
                 to that; a smaller run.time_step raises it",
                worst.softest
            ));
        }
        // Where the sub-steps carry no more, a stiffer spring is none.
        let stiffer = |spring: String| {
            if worst.softest < 0.999 * self.limits.spring {
                "a smaller run.time_step carries a stiffer contact".to_owned()
            } else {
                format!("{spring}, where the sub-steps carry it")
            }
        };
        let weight = heaviest * self.limits.gravity;
        let resting = weight / worst.softest / self.spacing;
        if law.softens() && resting > SIZABLE {
            words.push(format!(
                "contact: the weight of the heaviest body alone presses {resting:.2} spacings deep, and may squeeze a small one out; {}",
                stiffer(format!("a spring of {:.1e} N/m makes it a tenth of one", weight / (CARRIED * self.spacing)))
            ));
        }
        let sinks = self.limits.falling * (heaviest / worst.softest).sqrt() / self.spacing;
        if law.softens() && sinks > 1.05 * SINKS {
            words.push(format!(
                "contact: at that speed the heaviest body may press what lies between it and a wall {sinks:.2} \
                 spacings deep; {}",
                stiffer("a spring four times as stiff halves that".to_owned())
            ));
        }
        if self.limits.restores() && heaviest > HEAVIER * self.limits.lightest {
            words.push(format!(
                "contact: the heaviest body weighs {:.0} times the lightest: `restitution` is that of two bodies alone, and one that \
                 presses a much lighter one against a third comes back with more",
                heaviest / self.limits.lightest
            ));
        }
        ContactAdvice {
            omega_dt: worst.omega_dt,
            damping_dt: worst.damping_dt,
            substeps: substeps.ok(),
            spring_recommended: recommended.map(|(wanted, _)| wanted),
            spring_softest: worst.softest,
            words,
        }
    }
}
