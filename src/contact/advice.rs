//! What a user should know about the numbers of contact.

use super::Solids;
use crate::error::CaseError;

/// Mass of the heaviest body over that of the lightest from which a restitution between them is spoken of.
const HEAVIER: f64 = 10.0;
/// Depth over the spacing to which a weight alone may press, beyond which it is spoken of.
pub(super) const SIZABLE: f64 = 0.25;
/// Depth over the spacing, or over half of the thinner solid, for which a spring is named that carries a weight.
pub(super) const CARRIED: f64 = 0.1;

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

impl Solids {
    /// Why contact cannot be computed with steps of `dt` [s], if so.
    pub(crate) fn refuses(&self, dt: f64) -> Option<CaseError> {
        let law = self.law.as_deref()?;
        self.limits.substeps(&self.limits.worst(law, &self.bodies, dt)).err()
    }

    /// What contact will do at the time step `dt` [s].
    pub fn advice(&self, dt: f64) -> ContactAdvice {
        let mut words = vec![];
        let heaviest = self.bodies.iter().filter(|b| b.is_free()).map(|b| b.mass).fold(0.0, f64::max);
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
        if let Some((wanted, soft)) = &recommended {
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
        let weight = heaviest * self.limits.gravity;
        let resting = weight / worst.softest / self.spacing;
        if law.softens() && resting > SIZABLE {
            words.push(format!(
                "contact: the weight of the heaviest body alone presses {resting:.2} spacings deep, and may squeeze a small one out; \
                 a spring of {:.1e} N/m makes it a tenth of one, where the sub-steps carry it",
                weight / (CARRIED * self.spacing)
            ));
        }
        let sinks = self.limits.falling * (heaviest / worst.softest).sqrt() / self.spacing;
        if law.softens() && sinks > 0.1 {
            words.push(format!(
                "contact: at that speed the heaviest body may press what lies between it and a wall {sinks:.2} \
                 spacings deep; a spring four times as stiff halves that, where the sub-steps carry it"
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
