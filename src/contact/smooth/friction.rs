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

use super::pair::Pair;
use super::patch::Patch;
use crate::body::Body;
use glam::{DMat2, DMat3, DVec2, DVec3};
use std::sync::LazyLock;

/// Most sweeps over the patches of a sub-step. What one sub-step leaves, the next one stops.
const SWEEPS: usize = 8;

/// Change of an impulse over its limit at which the sweeps stop.
const TOLERANCE: f64 = 1e-3;

/// The same for a single patch that slips: what others have done to it since its last visit is left as it is. One that
/// sticks costs little, and a stack must come to rest.
const UNCHANGED: f64 = 1e-4;

/// Share of a slip that is left by rounding where it was stopped.
const STUCK: f64 = 1e-9;

/// Rings of nodes of a pressure of unit second moments: radius, weight, nodes, first of them in nodes from the axis.
/// Mean square of the distance 2, mean 1.3254, mean reciprocal 1.0177, as an even square has.
const RINGS: [(f64, f64, usize, f64); 2] =
    [(0.436_250_78, 0.235_341_38, 8, 0.0), (1.599_053_63, 0.764_658_62, 12, 0.5)];

/// Nodes of [`RINGS`], and how many of them are summed side by side.
const COUNT: usize = 20;
const LANES: usize = 4;

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

/// The least dissipation of the nodes over that of an ellipsoid through an impulse of `cap` along each of a patch's three
/// slips, of any second moments (0.884, of a line): what lies within sticks.
const STICKS: f64 = 0.88;

/// Share of the response that a spin may have for a patch to count as small: the ellipsoid does for it.
const SMALL: f64 = 2.5e-3;

/// Arm of a small patch over the root of the trace of its second moments: the mean distance of a line is 0.87, of a
/// square 0.94.
const SMALL_ARM: f64 = 0.9;

/// Slip over the largest that a patch can stop below which a node counts as at rest.
const AT_REST: f64 = 1e-6;

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
    /// Response of the slip to the impulse [1/kg], and its inverse.
    response: DMat3,
    inverse: DMat3,
    /// Impulse so far [N s].
    impulse: DVec3,
    /// s of the last visit [1/kg], for a point: 0 while it sticks.
    remaining: f64,
    /// Slip that the last visit left [m/s]; `None` before the first, and where it sticks.
    left: Option<DVec3>,
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
                    let slip = Slip::new(pair, patch, bodies, 0.0);
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
                self.slips.push(Slip::new(pair, patch, bodies, mu * patch.force * h));
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
    fn new(pair: &Pair, patch: &Patch, bodies: &[Body], cap: f64) -> Self {
        let (a, b) = (pair.a, pair.b.solid());
        let first = patch.normal.any_orthonormal_vector();
        let tangent = [first, patch.normal.cross(first)];
        let moved = tangent.map(|t| patch.spread * t);
        let [xx, xy, yy] = [moved[0].dot(tangent[0]), moved[0].dot(tangent[1]), moved[1].dot(tangent[1])];
        let size = (xx + yy).sqrt();
        let arm_a = patch.at - bodies[a].pose.position;
        let arm_b = pair.pose_b(bodies).map_or(DVec3::ZERO, |b| patch.at - b.position);
        // what turns against next to nothing is small
        let give = |k: Option<usize>, arm: DVec3| {
            let Some(body) = k.map(|k| &bodies[k]) else { return (0.0, 0.0) };
            let moved = |t: DVec3| {
                let turning = arm.cross(t);
                (body.inverse_mass * t).dot(t) + (body.inverse_inertia * turning).dot(turning)
            };
            let spun = (body.inverse_inertia * patch.normal).dot(patch.normal);
            (moved(tangent[0]) + moved(tangent[1]), spun)
        };
        let ((slip_a, spun_a), (slip_b, spun_b)) = (give(Some(a), arm_a), give(b, arm_b));
        let small = (spun_a + spun_b) * size * size <= SMALL * (slip_a + slip_b);
        let arm = if small { SMALL_ARM } else { ARM } * size;
        let spread = root_of(xx, xy, yy).filter(|_| !small).map(|root| root * (1.0 / arm));
        let spin = patch.normal * arm;
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
        Self {
            a,
            b,
            arm_a,
            arm_b,
            tangent,
            spin,
            spread,
            cap,
            response,
            inverse: response.inverse(),
            impulse: DVec3::ZERO,
            remaining: 0.0,
            left: None,
        }
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
        let velocity = self.velocity(bodies);
        if let Some(left) = self.left
            && (self.inverse * (velocity - left)).length() < UNCHANGED * self.cap
        {
            return false;
        }
        // most patches of a heap stick, and nothing else is worked out for them
        let stops = self.inverse * -velocity;
        if sticks(self.impulse + stops, self.cap, self.spread.is_some()) {
            self.impulse += stops;
            (self.left, self.remaining) = (None, 0.0);
            self.kick(bodies, stops);
            return stops.length() > TOLERANCE * self.cap;
        }
        let wanted = self.response * self.impulse - velocity;
        let system = System { response: self.response, inverse: self.inverse, wanted, cap: self.cap };
        let impulse = match self.spread {
            Some(spread) => system.field(spread, self.left.unwrap_or_default()),
            None => system.within(&mut self.remaining),
        };
        if !impulse.is_finite() {
            return false;
        }
        let change = impulse - self.impulse;
        self.impulse = impulse;
        let left = self.response * impulse - wanted;
        self.left = (left.length() > STUCK * wanted.length()).then_some(left);
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
        bodies[self.a].touch(push, self.arm_a.cross(push) + twist);
        if let Some(b) = self.b {
            bodies[b].touch(-push, -self.arm_b.cross(push) - twist);
        }
    }
}

/// Whether a patch, an area or a point, of at most `cap` [N s] takes the impulse that `stops` it [N s] without slipping.
fn sticks(stops: DVec3, cap: f64, area: bool) -> bool {
    match area {
        true => {
            let ellipsoid = stops.length_squared() <= (STICKS * cap).powi(2);
            ellipsoid || DVec2::new(stops.x, stops.y).length() + stops.z.abs() <= cap
        }
        false => stops.length_squared() <= cap * cap,
    }
}

/// Root of the symmetric matrix (xx, xy; xy, yy) of second moments [m2]; `None` if it is nothing.
fn root_of(xx: f64, xy: f64, yy: f64) -> Option<DMat2> {
    let root = (xx * yy - xy * xy).max(0.0).sqrt();
    let scale = (xx + yy + 2.0 * root).sqrt();
    let of = DMat2::from_cols(DVec2::new(xx + root, xy), DVec2::new(xy, yy + root));
    (scale > 1e-150).then(|| of * (1.0 / scale))
}

/// The nodes of a patch.
struct Nodes {
    x: [f64; COUNT],
    y: [f64; COUNT],
    weight: [f64; COUNT],
}

impl Nodes {
    fn new(spread: DMat2) -> Self {
        let places = NODES.map(|(node, _)| spread * node);
        Self { x: places.map(|p| p.x), y: places.map(|p| p.y), weight: NODES.map(|n| n.1) }
    }

    /// Gradient [N s] and second derivative of the dissipation at the slip `u` [m/s], of nodes that count as at rest
    /// below `rest` [m/s].
    #[allow(clippy::needless_range_loop)] // one lane of nine sums, not one sum
    fn dissipation(&self, u: DVec3, cap: f64, rest: f64) -> (DVec3, DMat3) {
        // lanes of their own: one sum after the other could not be taken side by side
        let mut sums = [[0.0; LANES]; 9];
        for first in (0..COUNT).step_by(LANES) {
            for lane in 0..LANES {
                let (x, y, weight) = (self.x[first + lane], self.y[first + lane], self.weight[first + lane]);
                // the slip there; of the spin (-y, x) goes into it
                let (sx, sy) = (u.x - u.z * y, u.y + u.z * x);
                let each = 1.0 / (sx * sx + sy * sy + rest * rest).sqrt();
                let (ax, ay) = (sx * each, sy * each);
                let turned = ay * x - ax * y;
                let each = weight * each;
                sums[0][lane] += weight * ax;
                sums[1][lane] += weight * ay;
                sums[2][lane] += weight * turned;
                sums[3][lane] += each * (1.0 - ax * ax);
                sums[4][lane] -= each * ax * ay;
                sums[5][lane] += each * (1.0 - ay * ay);
                sums[6][lane] -= each * (y + ax * turned);
                sums[7][lane] += each * (x - ay * turned);
                sums[8][lane] += each * (x * x + y * y - turned * turned);
            }
        }
        let [gx, gy, gz, xx, xy, yy, xz, yz, zz] = sums.map(|lanes| lanes.iter().sum::<f64>());
        let second = DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz));
        (cap * DVec3::new(gx, gy, gz), cap * second)
    }
}

/// A patch that is to slip with u = A j - `wanted`, A the `response`, by an impulse j of at most `cap`.
struct System {
    response: DMat3,
    inverse: DMat3,
    wanted: DVec3,
    cap: f64,
}

impl System {
    /// The impulse j = -grad D(u) [N s] of the Coulomb field on the nodes; `guess` is a slip near u [m/s], or 0.
    fn field(&self, spread: DMat2, guess: DVec3) -> DVec3 {
        let Self { response, inverse, wanted, cap } = *self;
        let stops = inverse * wanted;
        if sticks(stops, cap, true) {
            return stops;
        }
        let trace = response.x_axis.x + response.y_axis.y + response.z_axis.z;
        let (nodes, rest) = (Nodes::new(spread), AT_REST * cap * trace);
        let at = |u: DVec3| {
            let (gradient, second) = nodes.dissipation(u, cap, rest);
            (inverse * (u + wanted) + gradient, second, gradient)
        };
        let mut u = if guess.length() > rest { guess } else { response * self.within(&mut 0.0) - wanted };
        let (mut residual, mut second, mut gradient) = at(u);
        for _ in 0..NEWTON_STEPS {
            if residual.length() < 1e-8 * cap {
                break;
            }
            let full = (inverse + second).inverse() * residual;
            let downhill = residual.dot(full);
            let mut share = 1.0;
            loop {
                let next = u - share * full;
                let there = at(next);
                // the slope along the step may have turned, but not to as much as it was; what is no number ends it
                let slope = there.0.dot(full);
                let too_far = slope <= -0.5 * downhill && share >= 1e-3;
                if !too_far {
                    (u, residual, second, gradient) = (next, there.0, there.1, there.2);
                    break;
                }
                share *= (downhill / (downhill - slope)).clamp(0.1, 0.5);
            }
        }
        -gradient
    }

    /// The j with (A + s 1) j = `wanted` and either s = 0, |j| <= cap or s > 0, |j| = cap: the same
    /// system as a trust-region step, solved by its Newton iteration from the last `s`.
    fn within(&self, s: &mut f64) -> DVec3 {
        let mut j = DVec3::ZERO;
        for _ in 0..NEWTON_STEPS {
            let inverse = if *s == 0.0 {
                self.inverse
            } else {
                (self.response + DMat3::from_diagonal(DVec3::splat(*s))).inverse()
            };
            j = inverse * self.wanted;
            let length = j.length();
            let excess = length / self.cap - 1.0;
            if excess.abs() < 1e-12 || excess < 0.0 && *s == 0.0 {
                return j;
            }
            *s = (*s + length * length / j.dot(inverse * j) * excess).max(0.0);
        }
        j * (self.cap / j.length()).min(1.0)
    }
}

/// Most steps of a patch's Newton iterations.
const NEWTON_STEPS: usize = 30;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impulse_inside_the_limit_stops_the_slip_and_one_outside_opposes_what_remains() {
        let response =
            DMat3::from_cols(DVec3::new(2.0, 0.3, 0.1), DVec3::new(0.3, 1.0, 0.2), DVec3::new(0.1, 0.2, 4.0));
        let wanted = DVec3::new(-1.0, 0.5, 0.25);
        let of = |cap: f64| System { response, inverse: response.inverse(), wanted, cap };
        let free = of(10.0).within(&mut 0.0);
        assert!((response * free - wanted).length() < 1e-12);
        let capped = of(0.2).within(&mut 0.0);
        assert!((capped.length() - 0.2).abs() < 1e-10);
        assert!((of(0.2).within(&mut 50.0) - capped).length() < 1e-10);
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
                let (gradient, _) = Nodes::new(root).dissipation(v.extend(w), 1.0, 1e-9);
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
        let of = |cap: f64| System { response, inverse: response.inverse(), wanted, cap };
        let stops = of(10.0).field(spread, DVec3::ZERO);
        assert!((response * stops - wanted).length() < 1e-12);
        let impulse = of(0.2).field(spread, DVec3::ZERO);
        let left = response * impulse - wanted;
        let (gradient, _) = Nodes::new(spread).dissipation(left, 0.2, 1e-9);
        assert!(left.length() > 0.1 && (gradient + impulse).length() < 1e-5 * 0.2, "{gradient} {impulse}");
        // from where the last visit ended, the same
        let again = of(0.2).field(spread, left);
        assert!((again - impulse).length() < 1e-7 * 0.2);
    }

    #[test]
    fn the_second_derivative_is_the_slope_of_the_gradient_and_the_ellipsoid_lies_within() {
        for (yy, xy) in [(1.0, 0.0), (0.3, 0.2), (0.0, 0.0)] {
            let arm = ARM * (1.0_f64 + yy).sqrt();
            let nodes = Nodes::new(root_of(1.0, xy, yy).unwrap() * (1.0 / arm));
            for k in 0..500 {
                let part = |n: f64| (f64::from(k) * n).fract() - 0.5;
                let u = DVec3::new(part(0.618_034), part(0.754_877), part(0.569_84)).normalize();
                let (gradient, second) = nodes.dissipation(u, 1.0, 1e-6);
                assert!(gradient.dot(u) > STICKS, "{yy} {u}: {}", gradient.dot(u));
                for axis in 0..3 {
                    let step = 1e-6 * DVec3::AXES[axis];
                    let slope =
                        nodes.dissipation(u + step, 1.0, 1e-6).0 - nodes.dissipation(u - step, 1.0, 1e-6).0;
                    let off = slope / 2e-6 - second.col(axis);
                    assert!(off.length() < 1e-3 * (1.0 + second.col(axis).length()), "{yy} {u}: {off}");
                }
            }
        }
    }
}
