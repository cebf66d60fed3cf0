//! Coulomb friction as an impulse on the predicted velocity.
//!
//! A patch (all points pressed by one face) slips with two tangential velocities and one spin about
//! its normal. Its friction is the Coulomb field of its pressure: mu p against the slip at every place, so that the
//! impulse is minus the gradient of the dissipation
//!
//! D(v, w) = mu N h sum_k q_k |v + w n x y_k|,
//!
//! with y_k and q_k nodes of the pressure ([`NODES`]), which keep its second moments and, for a square, its mean distance from
//! the centre and that distance's reciprocal. A patch sticks while its impulse lies inside the limit surface of D, which holds
//! |J_t| + |T| / r <= mu N h; beyond, the slip u that *remains* solves u = u_0 - A grad D(u), A the response of the slip to the
//! impulse: the minimum of a convex function, by Newton's iteration. No history, no elastic pre-slip and no parameter beside mu:
//! a body at rest on a slope stays where it is. Bodies with several patches are swept in a fixed order.
//!
//! The viscous friction of the paper's Eq. (12) is at hand as well: -eta times the slip, shared among the
//! patches of two solids by their normal forces.

use super::pair::{Pair, Patch};
use crate::body::Body;
use glam::{DMat2, DMat3, DVec2, DVec3};
use std::sync::LazyLock;

/// Most sweeps over the patches of a sub-step. What one sub-step leaves, the next one stops.
const SWEEPS: usize = 8;

/// Change of an impulse over its limit at which the sweeps stop.
const TOLERANCE: f64 = 1e-3;

/// Rings of nodes of a pressure of unit second moments: radius, weight, nodes, first of them in nodes from the axis.
/// Mean square of the distance 2, mean 1.3254, mean reciprocal 1.0177, as an even square has.
const RINGS: [(f64, f64, usize, f64); 2] =
    [(0.436_250_78, 0.235_341_38, 8, 0.0), (1.599_053_63, 0.764_658_62, 12, 0.5)];

/// Nodes of [`RINGS`].
const COUNT: usize = 20;

/// Places and weights of the nodes.
static NODES: LazyLock<[(DVec2, f64); COUNT]> = LazyLock::new(|| {
    let of = |(radius, weight, count, first): (f64, f64, usize, f64)| {
        (0..count).map(move |k| {
            let turn = std::f64::consts::TAU * (k as f64 + first) / count as f64;
            (radius * DVec2::from_angle(turn), weight / count as f64)
        })
    };
    let mut nodes = RINGS.into_iter().flat_map(of);
    std::array::from_fn(|_| nodes.next().unwrap_or_default())
});

/// Arm of the spin over the root of the trace of the second moments: not above the mean distance of any pressure.
const ARM: f64 = 0.82;

/// Slip over the largest that a patch can stop below which a node counts as at rest.
const AT_REST: f64 = 1e-7;

/// A patch as the sweeps see it.
#[derive(Clone, Debug)]
struct Slip {
    a: usize,
    b: Option<usize>,
    arm_a: DVec3,
    arm_b: DVec3,
    tangent: [DVec3; 2],
    /// Normal times the arm [m].
    spin: DVec3,
    /// Root of the second moments over the arm, in the tangents; `None` for a point.
    spread: Option<DMat2>,
    /// Largest impulse [N s].
    cap: f64,
    /// Response of the slip to the impulse [1/kg].
    response: DMat3,
    /// Impulse so far [N s].
    impulse: DVec3,
    /// s of the last visit [1/kg], for a point: 0 while it sticks.
    remaining: f64,
    /// Slip that the last visit left [m/s], for an area.
    left: DVec3,
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
        let moved = tangent.map(|t| patch.spread * t);
        let [xx, xy, yy] = [moved[0].dot(tangent[0]), moved[0].dot(tangent[1]), moved[1].dot(tangent[1])];
        let arm = ARM * (xx + yy).sqrt();
        let spread = root_of(xx, xy, yy).map(|root| root * (1.0 / arm));
        let spin = patch.normal * arm;
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
        // what turns against next to nothing is a point
        let spread = spread.filter(|_| response.z_axis.z > 1e-9 * trace);
        let (impulse, left) = (DVec3::ZERO, DVec3::ZERO);
        Self { a, b, arm_a, arm_b, tangent, spin, spread, cap, response, impulse, remaining: 0.0, left }
    }

    /// Slip of `a` against `b`: two velocities and the spin times the arm [m/s].
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
        let impulse = match self.spread {
            Some(spread) => field(self.response, wanted, self.cap, spread, &mut self.left),
            None => within(self.response, wanted, self.cap, &mut self.remaining),
        };
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

/// Root of the symmetric matrix (xx, xy; xy, yy) of second moments [m2]; `None` if it is nothing.
fn root_of(xx: f64, xy: f64, yy: f64) -> Option<DMat2> {
    let root = (xx * yy - xy * xy).max(0.0).sqrt();
    let scale = (xx + yy + 2.0 * root).sqrt();
    let of = DMat2::from_cols(DVec2::new(xx + root, xy), DVec2::new(xy, yy + root));
    (scale > 1e-150).then(|| of * (1.0 / scale))
}

/// Gradient [N s] and second derivative of the dissipation at the slip `u` [m/s], of nodes that count as at rest
/// below `rest` [m/s].
fn dissipation(u: DVec3, cap: f64, spread: DMat2, rest: f64) -> (DVec3, DMat3) {
    let (mut gradient, mut second) = (DVec3::ZERO, DMat3::ZERO);
    for (node, weight) in NODES.iter() {
        let place = spread * *node;
        // the slip there and what of the spin goes into it
        let turned = DVec2::new(-place.y, place.x);
        let slip = DVec2::new(u.x, u.y) + u.z * turned;
        let speed = (slip.length_squared() + rest * rest).sqrt();
        let along = slip / speed;
        gradient += *weight * along.extend(along.dot(turned));
        let across = |of: DVec2| (of - along * along.dot(of)) * (*weight / speed);
        let column = |of: DVec2| {
            let moved = across(of);
            moved.extend(moved.dot(turned))
        };
        second += DMat3::from_cols(column(DVec2::X), column(DVec2::Y), column(turned));
    }
    (cap * gradient, cap * second)
}

/// The impulse j = -grad D(u) [N s] with u = A j - `wanted` of the Coulomb field on the nodes; `left` is the u of the
/// last visit and becomes this one's.
fn field(response: DMat3, wanted: DVec3, cap: f64, spread: DMat2, left: &mut DVec3) -> DVec3 {
    let inverse = response.inverse();
    let stops = inverse * wanted;
    if DVec2::new(stops.x, stops.y).length() + stops.z.abs() <= cap {
        *left = DVec3::ZERO;
        return stops;
    }
    let trace = response.x_axis.x + response.y_axis.y + response.z_axis.z;
    let rest = AT_REST * cap * trace;
    let function = |u: DVec3| {
        let off = u + wanted;
        let speeds = NODES.iter().map(|(node, weight)| {
            let place = spread * *node;
            let slip = DVec2::new(u.x - u.z * place.y, u.y + u.z * place.x);
            weight * (slip.length_squared() + rest * rest).sqrt()
        });
        0.5 * off.dot(inverse * off) + cap * speeds.sum::<f64>()
    };
    let mut u = *left;
    if u == DVec3::ZERO {
        u = response * within(response, wanted, cap, &mut 0.0) - wanted;
    }
    let (mut value, mut gradient) = (function(u), DVec3::ZERO);
    for _ in 0..30 {
        let (slope, second) = dissipation(u, cap, spread, rest);
        gradient = slope;
        let residual = inverse * (u + wanted) + gradient;
        if residual.length() < 1e-10 * cap {
            break;
        }
        let full = (inverse + second).inverse() * residual;
        let mut share = 1.0;
        loop {
            let next = u - share * full;
            let there = function(next);
            if there < value || share < 1e-3 {
                (u, value) = (next, there);
                break;
            }
            share *= 0.5;
        }
    }
    *left = u;
    -gradient
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

    /// Mean over an even rectangle of half edges `half` [m] of |v + w n x y|, and its gradient.
    fn even(half: DVec2, v: DVec2, w: f64) -> (f64, DVec3) {
        let n = 300;
        let (mut sum, mut gradient) = (0.0, DVec3::ZERO);
        for i in 0..n {
            for j in 0..n {
                let at = |k: i32| (2.0 * f64::from(k) + 1.0) / f64::from(n) - 1.0;
                let place = half * DVec2::new(at(i), at(j));
                let turned = DVec2::new(-place.y, place.x);
                let slip = v + w * turned;
                sum += slip.length();
                let along = slip.normalize_or_zero();
                gradient += along.extend(along.dot(turned));
            }
        }
        let each = f64::from(n).powi(-2);
        (each * sum, each * gradient)
    }

    #[test]
    fn the_nodes_dissipate_like_an_even_pressure() {
        for half in [DVec2::new(0.1, 0.1), DVec2::new(0.3, 0.1), DVec2::new(0.3, 0.03)] {
            let root = root_of(half.x * half.x / 3.0, 0.0, half.y * half.y / 3.0).unwrap();
            for k in 0..=8 {
                let turn = f64::from(k) / 8.0 * std::f64::consts::FRAC_PI_2;
                let (v, w) = (DVec2::from_angle(0.4) * turn.sin(), turn.cos() / half.x);
                let (exact, force) = even(half, v, w);
                let (gradient, _) = dissipation(v.extend(w), 1.0, root, 1e-9);
                let ours = gradient.dot(v.extend(w));
                assert!((ours / exact - 1.0).abs() < 0.02, "{half} {k}: {ours} {exact}");
                let off = (gradient - force).truncate().length();
                assert!(off < 0.09, "{half} {k}: {gradient} {force}");
            }
        }
    }

    #[test]
    fn an_area_sticks_below_its_limit_and_slips_against_its_impulse_beyond() {
        let response =
            DMat3::from_cols(DVec3::new(2.0, 0.3, 0.1), DVec3::new(0.3, 1.0, 0.2), DVec3::new(0.1, 0.2, 4.0));
        let spread = root_of(0.5, 0.1, 0.4).unwrap();
        let wanted = DVec3::new(-1.0, 0.5, 0.25);
        let mut left = DVec3::ZERO;
        let stops = field(response, wanted, 10.0, spread, &mut left);
        assert!((response * stops - wanted).length() < 1e-12 && left == DVec3::ZERO);
        let impulse = field(response, wanted, 0.2, spread, &mut left);
        assert!((response * impulse - wanted - left).length() < 1e-9 * left.length());
        let (gradient, _) = dissipation(left, 0.2, spread, 1e-9);
        assert!((gradient + impulse).length() < 1e-6 * 0.2, "{gradient} {impulse}");
        // from where the last visit ended, the same
        let again = field(response, wanted, 0.2, spread, &mut left);
        assert!((again - impulse).length() < 1e-9 * 0.2);
    }
}
