//! Coulomb friction as an impulse on the predicted velocity.
//!
//! A patch (all points pressed by one face) slips with two tangential velocities and one spin about
//! its normal. The impulse that would stop all three is applied if it lies inside the limit surface
//! |J_t|^2 + (T / r)^2 <= (mu N h)^2, r the mean arm of the pressure (exact for pure sliding and for
//! pure spinning, an ellipsoid between). Otherwise the impulse lies on the surface, opposite to the
//! slip that *remains*: (A + s 1) j = -u with |j| = mu N h, s > 0, A the response of the slip to the
//! impulse. No history, no elastic pre-slip and no parameter beside mu: a body at rest on a slope
//! stays where it is. Bodies with several patches are swept in a fixed order.
//!
//! The viscous friction of the paper's Eq. (12) is at hand as well: -eta times the slip, shared among the
//! patches of two solids by their normal forces.

use super::pair::{Pair, Patch};
use crate::body::Body;
use glam::{DMat3, DVec3};

/// Most sweeps over the patches of a sub-step. What one sub-step leaves, the next one stops.
const SWEEPS: usize = 8;

/// Change of an impulse over its limit at which the sweeps stop.
const TOLERANCE: f64 = 1e-3;

/// A patch as the sweeps see it.
#[derive(Clone, Debug)]
struct Slip {
    a: usize,
    b: Option<usize>,
    arm_a: DVec3,
    arm_b: DVec3,
    tangent: [DVec3; 2],
    /// Normal times the mean arm [m].
    spin: DVec3,
    /// Largest impulse [N s].
    cap: f64,
    /// Response of the slip to the impulse [1/kg].
    response: DMat3,
    /// Impulse so far [N s].
    impulse: DVec3,
    /// s of the last visit [1/kg]: 0 while the patch sticks.
    remaining: f64,
}

/// Working memory of the friction solve.
#[derive(Clone, Debug, Default)]
pub(crate) struct Friction {
    slips: Vec<Slip>,
}

impl Friction {
    /// Applies the friction `mu` [-] and `eta` [kg/s] to the bodies for the sub-step `h` [s] with the
    /// pairs' normal forces.
    pub fn apply(&mut self, pairs: &[Pair], bodies: &mut [Body], mu: f64, eta: f64, h: f64) {
        if eta > 0.0 {
            for pair in pairs {
                let all: f64 = pair.patches.iter().map(|p| p.force).sum();
                for patch in &pair.patches {
                    let slip = Slip::new(pair.a, pair.b.solid(), patch, bodies, 0.0);
                    slip.drag(bodies, eta * h * patch.force / all);
                }
            }
        }
        self.slips.clear();
        if mu <= 0.0 {
            return;
        }
        for pair in pairs {
            for patch in &pair.patches {
                self.slips.push(Slip::new(pair.a, pair.b.solid(), patch, bodies, mu * patch.force * h));
            }
        }
        let sweeps = if self.slips.len() == 1 { 1 } else { SWEEPS };
        for _ in 0..sweeps {
            let mut open = false;
            for slip in &mut self.slips {
                open |= slip.solve(bodies);
            }
            if !open {
                break;
            }
        }
    }
}

impl Slip {
    fn new(a: usize, b: Option<usize>, patch: &Patch, bodies: &[Body], cap: f64) -> Self {
        let first = patch.normal.any_orthonormal_vector();
        let tangent = [first, patch.normal.cross(first)];
        let spin = patch.normal * patch.radius;
        let arm_a = patch.at - bodies[a].pose.position;
        let arm_b = b.map_or(DVec3::ZERO, |b| patch.at - bodies[b].pose.position);
        let mut response = DMat3::ZERO;
        for (k, arm) in [(Some(a), arm_a), (b, arm_b)] {
            let Some(body) = k.map(|k| &bodies[k]) else { continue };
            let turning = [arm.cross(tangent[0]), arm.cross(tangent[1]), spin];
            for column in 0..3 {
                let turned = body.inverse_inertia * turning[column];
                let moved = if column < 2 { body.inverse_mass * tangent[column] } else { DVec3::ZERO };
                let slip = DVec3::new(moved.dot(tangent[0]), moved.dot(tangent[1]), 0.0);
                let spun = DVec3::new(turned.dot(turning[0]), turned.dot(turning[1]), turned.dot(turning[2]));
                *response.col_mut(column) += slip + spun;
            }
        }
        // a point has no arm and a locked axis no response: keep the system regular
        let trace = response.x_axis.x + response.y_axis.y + response.z_axis.z;
        response += DMat3::IDENTITY * (1e-12 * trace);
        Self { a, b, arm_a, arm_b, tangent, spin, cap, response, impulse: DVec3::ZERO, remaining: 0.0 }
    }

    /// Slip of `a` against `b`: two velocities and the spin times the mean arm [m/s].
    fn velocity(&self, bodies: &[Body]) -> DVec3 {
        let of = |body: &Body, arm: DVec3| {
            let v = body.pose.velocity + body.pose.angular_velocity.cross(arm);
            let spin = body.pose.angular_velocity.dot(self.spin);
            DVec3::new(v.dot(self.tangent[0]), v.dot(self.tangent[1]), spin)
        };
        of(&bodies[self.a], self.arm_a) - self.b.map_or(DVec3::ZERO, |b| of(&bodies[b], self.arm_b))
    }

    /// One visit: the patch's impulse for the velocities as they are. Whether it changed.
    fn solve(&mut self, bodies: &mut [Body]) -> bool {
        let wanted = self.response * self.impulse - self.velocity(bodies);
        let impulse = within(self.response, wanted, self.cap, &mut self.remaining);
        if !impulse.is_finite() {
            return false;
        }
        let change = impulse - self.impulse;
        self.impulse = impulse;
        self.kick(bodies, change);
        change.length() > TOLERANCE * self.cap
    }

    /// Drag `eta_h` [kg] times the slip in the middle of the sub-step: stable for any eta.
    fn drag(&self, bodies: &mut [Body], eta_h: f64) {
        let middle = DMat3::IDENTITY + 0.5 * eta_h * self.response;
        let impulse = -eta_h * (middle.inverse() * self.velocity(bodies));
        self.kick(bodies, impulse);
    }

    /// Gives both bodies the impulse `change` along the tangents and the spin [N s].
    fn kick(&self, bodies: &mut [Body], change: DVec3) {
        let push = change.x * self.tangent[0] + change.y * self.tangent[1];
        let twist = change.z * self.spin;
        bodies[self.a].kick(push, self.arm_a.cross(push) + twist);
        if let Some(b) = self.b {
            bodies[b].kick(-push, -self.arm_b.cross(push) - twist);
        }
    }
}

/// The j with (A + s 1) j = `wanted` and either s = 0, |j| <= cap or s > 0, |j| = cap: the same
/// system as a trust-region step, solved by its Newton iteration from the last `s`.
fn within(response: DMat3, wanted: DVec3, cap: f64, s: &mut f64) -> DVec3 {
    let mut j = DVec3::ZERO;
    for _ in 0..30 {
        let inverse = (response + DMat3::from_diagonal(DVec3::splat(*s))).inverse();
        j = inverse * wanted;
        let length = j.length();
        let excess = length / cap - 1.0;
        if excess.abs() < 1e-12 || excess < 0.0 && *s == 0.0 {
            return j;
        }
        *s = (*s + length * length / j.dot(inverse * j) * excess).max(0.0);
    }
    j * (cap / j.length()).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impulse_inside_the_limit_stops_the_slip_and_one_outside_opposes_what_remains() {
        let response =
            DMat3::from_cols(DVec3::new(2.0, 0.3, 0.1), DVec3::new(0.3, 1.0, 0.2), DVec3::new(0.1, 0.2, 4.0));
        let wanted = DVec3::new(-1.0, 0.5, 0.25);
        let free = within(response, wanted, 10.0, &mut 0.0);
        assert!((response * free - wanted).length() < 1e-12);
        let capped = within(response, wanted, 0.2, &mut 0.0);
        assert!((capped.length() - 0.2).abs() < 1e-10);
        assert!((within(response, wanted, 0.2, &mut 50.0) - capped).length() < 1e-10);
        let remains = response * capped - wanted;
        assert!(remains.length() > 0.1);
        assert!((remains.normalize() + capped.normalize()).length() < 1e-9);
    }
}
