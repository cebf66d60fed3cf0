//! How stiff contact is for a body, and what follows: sub-steps, the stiffness a step can carry, the
//! stiffness a case needs, damping from restitution.
//!
//! lambda [1/kg] is the largest eigenvalue of M^-1 H for a unit spring over the ways a body's surface
//! can touch (a corner, an edge, a face that bounces or rocks): omega^2 = lambda K, so 1 / lambda is the
//! effective mass m_e.

use crate::case;
use crate::error::{Error, Result};

/// Restitution of the smooth law if the case says nothing of damping: undamped bodies never come to rest.
const DEFAULT_RESTITUTION: f64 = 0.5;
/// Least restitution, whose rebound is 1e-4 of the height. The damping ratio of less grows without bound, to 16 at 1e-3,
/// and with it the sub-steps that the dashpot asks for.
const LEAST_RESTITUTION: f64 = 0.01;

/// Largest eigenvalues of a body's contact, unit spring and unit dashpot [1/kg].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lambda {
    pub spring: f64,
    pub damping: f64,
}

/// How the case gives the damping.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Damping {
    /// C [kg/s].
    Coefficient(f64),
    /// Damping ratio of every single contact [-].
    Ratio(f64),
}

impl Damping {
    /// Reads the case; `lightest` is the mass of the lightest free body [kg].
    pub fn new(contact: &case::Contact, lightest: f64) -> Result<Self> {
        match (contact.damping, contact.damping_ratio, contact.restitution) {
            (None, None, None) if contact.law == case::Law::Smooth => {
                Ok(Self::Ratio(damping_ratio(DEFAULT_RESTITUTION)))
            }
            (None, None, None) => Ok(Self::Coefficient(0.0)),
            (Some(c), None, None) => Ok(Self::Coefficient(c)),
            (None, Some(ratio), None) => {
                Ok(Self::Coefficient(ratio * 2.0 * (contact.spring.unwrap_or(0.0) * lightest).sqrt()))
            }
            (None, None, Some(e)) if contact.law == case::Law::Smooth => Ok(Self::Ratio(damping_ratio(e))),
            (None, None, Some(_)) => {
                let message = "contact.restitution: needs law = \"smooth\"";
                Err(Error::key("contact.restitution", message, "give damping or damping_ratio"))
            }
            _ => Err(Error::key(
                "contact",
                "contact: give one of damping, damping_ratio and restitution, not several",
                "",
            )),
        }
    }

    /// Whether the case gives a damping ratio (a restitution).
    pub fn is_ratio(self) -> bool {
        matches!(self, Self::Ratio(_))
    }

    /// C [kg/s] of a contact of stiffness `spring` [N/m], instead of `asked` [N/m], and reduced mass
    /// `mass` [kg]. A softened contact keeps its damping ratio.
    pub fn coefficient(self, spring: f64, asked: f64, mass: f64) -> f64 {
        match self {
            Self::Coefficient(c) => c * (spring / asked).sqrt(),
            Self::Ratio(ratio) => 2.0 * ratio * (spring * mass).sqrt(),
        }
    }
}

/// Restitution of a linear spring and dashpot that part when the force, not the depth, reaches zero:
/// e = exp(-tan(phi) (pi - 2 phi)), sin(phi) the damping ratio; beyond 1 its continuation
/// exp(-2 u / tanh(u)), cosh(u) the damping ratio.
pub fn restitution(damping_ratio: f64) -> f64 {
    let z = damping_ratio;
    if (z - 1.0).abs() < 1e-9 {
        (-2.0_f64).exp()
    } else if z < 1.0 {
        let phi = z.asin();
        (-phi.tan() * (std::f64::consts::PI - 2.0 * phi)).exp()
    } else {
        let u = z.acosh();
        (-2.0 * u / u.tanh()).exp()
    }
}

/// Damping ratio [-] that gives the restitution `e`; e below 0.01 counts as 0.01.
pub fn damping_ratio(e: f64) -> f64 {
    let e = e.clamp(LEAST_RESTITUTION, 1.0);
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if restitution(middle) > e { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Restitution by integrating the impact of a unit mass on a unit spring.
    fn integrated(z: f64) -> f64 {
        let (mut x, mut v, h) = (0.0_f64, -1.0_f64, 1e-5);
        loop {
            let force = |x: f64, v: f64| -x - 2.0 * z * v;
            let (xm, vm) = (x + 0.5 * h * v, v + 0.5 * h * force(x, v));
            if x < 0.0 && force(x, v) <= 0.0 {
                return v;
            }
            (x, v) = (x + h * vm, v + h * force(xm, vm));
        }
    }

    #[test]
    fn restitution_follows_from_the_damping_ratio() {
        for z in [0.05, 0.3, 0.7, 0.99, 1.5, 2.5] {
            assert!(
                (restitution(z) - integrated(z)).abs() < 1e-3,
                "{z}: {} {}",
                restitution(z),
                integrated(z)
            );
        }
        for e in [0.1, 0.2, 0.5, 0.8, 1.0] {
            assert!((restitution(damping_ratio(e)) - e).abs() < 1e-6);
        }
    }
}
