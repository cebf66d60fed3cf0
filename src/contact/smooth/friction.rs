//! Coulomb friction as an impulse on the predicted velocity.
//!
//! A patch (all points pressed by one face) slips with two tangential velocities and one spin about
//! its normal. Its friction is the Coulomb field of its pressure: mu p against the slip at every place, so that the
//! impulse is minus the gradient of the dissipation
//!
//! D(v, w) = mu N h sum_k q_k |v + w n x y_k|,
//!
//! with y_k and q_k nodes of the pressure ([`super::coulomb`]), which keep its second moments and, for a square, its mean distance from
//! the centre and that distance's reciprocal. A patch sticks while its impulse lies inside the limit surface of D, which holds
//! |J_t| + |T| / r <= mu N h; beyond, the slip u that *remains* solves u = u_0 - A grad D(u), A the response of the slip to the
//! impulse: the minimum of a convex function, by Newton's iteration. No elastic pre-slip and no parameter beside mu:
//! a body at rest on a slope stays where it is. Bodies with several patches are swept in a fixed order, from what the patches [held]
//! in the sub-step before; where that would add energy, as after a blow, from as much of it as takes the most.
//!
//! [held]: super::held
//!
//! The viscous friction of the paper's Eq. (12) is at hand as well: -eta times the slip, shared among the
//! patches of two solids by their normal forces. With X = eta h A and D = 1 + X + X^2 / 2 the slip v that the forces of the sub-step
//! change by d goes to
//!
//! D^-1 (v + (1 + X / 2) d),
//!
//! which is of second order in h, never turns a slip round, stops it as eta grows, and has the slip X^-1 d of a steady slide for any h. A Coulomb
//! impulse j of the patch is A j more of d: the patch then answers with D^-1 (1 + X / 2) A instead of A, and
//! sticks below the same limit as without drag, which is nothing on what stands. Patches of one body follow one another, each with its share of d.

use super::coulomb::{ARM, System, root_of, sticks};
use super::held::{Held, Hold, Touch};
use super::pair::{Other, Pair};
use super::patch::Patch;
use super::walls::WallBox;
use crate::body::{Body, Wrench};
use crate::checkpoint::Archive;
use crate::contact::between::Against;
use crate::contact::fixed::FixedWalls;
use crate::error::Result;
use glam::{DMat2, DMat3, DVec3};

/// Most sweeps over the patches of a sub-step. What one sub-step leaves, the next one stops.
const SWEEPS: usize = 8;

/// Change of an impulse over its limit at which the sweeps stop.
const TOLERANCE: f64 = 1e-6;

/// The same for a single patch that slips: what others have done to it since its last visit is left as it is. One that
/// sticks costs little, and a stack must come to rest.
const UNCHANGED: f64 = 1e-7;

/// Share of a slip that is left by rounding where it was stopped.
const STUCK: f64 = 1e-9;

/// Share of the response that a spin may have for a patch to count as small: the ellipsoid does for it.
const SMALL: f64 = 2.5e-3;

/// Arm of a small patch over the root of the trace of its second moments: the mean distance of a line is 0.87, of a
/// square 0.94.
const SMALL_ARM: f64 = 0.9;

/// A patch as the sweeps see it.
#[derive(Clone, Debug)]
struct Slip {
    touch: Touch,
    arm_a: DVec3,
    arm_b: DVec3,
    tangent: [DVec3; 2],
    /// What of the slip the sub-step's turns add, see [`turned`] [m/s].
    turned: DVec3,
    /// Normal times the arm [m].
    spin: DVec3,
    /// Root of the second moments over the arm, in the tangents; `None` for a point.
    spread: Option<DMat2>,
    /// Largest impulse [N s].
    cap: f64,
    /// Response of the slip to the impulse [1/kg], with what the drag takes of it, and its inverse.
    response: DMat3,
    inverse: DMat3,
    /// What the drag leaves of an impulse, if there is one.
    dragged: Option<DMat3>,
    /// Impulse of the drag on what slips without Coulomb friction [N s].
    drag: DVec3,
    /// Coulomb friction's impulse so far, before the drag has taken of it [N s].
    impulse: DVec3,
    /// s of the last visit [1/kg], for a point: 0 while it sticks.
    remaining: f64,
    /// Slip that the last visit left [m/s]; `None` before the first, and where it sticks.
    left: Option<DVec3>,
}

/// Working memory of the friction solve.
#[derive(Clone, Debug, Default)]
pub(crate) struct Friction {
    /// Patches with friction, of the last sub-step.
    slips: Vec<Slip>,
    /// Normal force of all patches of each body, and of those that are dragged already [N].
    pressed: Vec<[f64; 2]>,
    held: Held,
}

impl Friction {
    /// Applies the pairs' Coulomb friction and the viscous one, `eta` [kg/s], to the bodies for the sub-step `h` [s], with the
    /// pairs' normal forces.
    pub fn apply(&mut self, pairs: &[Pair], bodies: &mut [Body], eta: f64, h: f64) {
        self.slips.clear();
        if eta > 0.0 {
            self.pressed.clear();
            self.pressed.resize(bodies.len(), [0.0; 2]);
            for pair in pairs {
                let all: f64 = pair.patches.iter().map(|p| p.force).sum();
                pair.bodies().for_each(|k| self.pressed[k][0] += all);
            }
        }
        for pair in pairs {
            let mu = pair.constants.friction;
            if mu == 0.0 && eta == 0.0 {
                continue;
            }
            let all: f64 = pair.patches.iter().map(|p| p.force).sum();
            for patch in &pair.patches {
                let mut slip = Slip::new(pair, patch, bodies, mu * patch.force * h, h);
                if eta > 0.0 && all > 0.0 {
                    pair.bodies().for_each(|k| self.pressed[k][1] += patch.force);
                    slip.drag(bodies, eta * h * patch.force / all, patch.force, &self.pressed);
                }
                self.slips.push(slip);
            }
        }
        let rubbing = self.slips.iter().filter(|slip| slip.cap > 0.0).count();
        let sweeps = if rubbing == 1 { 1 } else { SWEEPS };
        if rubbing > 1 {
            self.start(bodies, h);
        }
        for _ in 0..sweeps {
            let mut open = false;
            for slip in self.slips.iter_mut().filter(|slip| slip.cap > 0.0) {
                open |= slip.solve(bodies);
            }
            if !open {
                break;
            }
        }
        let rubbing = self.slips.iter().filter(|slip| slip.cap > 0.0);
        self.held.keep(rubbing.map(|slip| (slip.touch, slip.hold(h))));
    }

    /// Gives the bodies what the patches held in the sub-step before.
    fn start(&mut self, bodies: &mut [Body], h: f64) {
        // of the change of the kinetic energy, what goes with the slips that there are and what with those that come of it
        let mut first = 0.0;
        for slip in self.slips.iter_mut().filter(|slip| slip.cap > 0.0) {
            let Some(hold) = self.held.of(&slip.touch) else { continue };
            slip.impulse = slip.impulse_of(hold, h);
            first += slip.impulse.dot(slip.velocity(bodies));
        }
        self.slips.iter().for_each(|slip| slip.kick(bodies, slip.impulse));
        let now = self.slips.iter().map(|slip| slip.impulse.dot(slip.velocity(bodies)));
        let second = now.sum::<f64>() - first;
        if first + 0.5 * second > 0.0 {
            let share = (-first / second).clamp(0.0, 1.0);
            for slip in &mut self.slips {
                slip.kick(bodies, (share - 1.0) * slip.impulse);
                slip.impulse *= share;
            }
        }
    }

    /// The solids have been put elsewhere.
    pub fn forget(&mut self) {
        self.held.forget();
    }

    /// Saves what the next sub-step starts from, or takes it over.
    ///
    /// # Errors
    /// As [`Archive::array`].
    pub fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        self.held.exchange(archive)
    }

    /// Gives fixed walls and still boxes what the last [`Self::apply`] has taken from them.
    pub fn press_walls(&self, bodies: &mut [Body], walls: &[WallBox], fixed: &mut FixedWalls) {
        for slip in &self.slips {
            let Other::Wall(w) = slip.touch.b else { continue };
            let (push, twist) = slip.parts(slip.drag + slip.passed(slip.impulse));
            let at = bodies[slip.touch.a].pose.position + slip.arm_a;
            match walls[w].of {
                Against::Wall(k) => fixed.touch(k, -push, at, -twist),
                Against::Solid(k) => bodies[k].touch(-push, -(at - walls[w].middle).cross(push) - twist),
            }
        }
    }
}

/// What the slip of `a` against `b` in the middle of a sub-step of `h` [s] has beyond that at its start, as the arms change [m/s].
///
/// A solid's centre goes straight on for the sub-step, while the places of one that turns go along chords: what sticks to it
/// would be left outside by r w^2 h / 2. The place of the touch goes with the free solid's centre, which is right of what rolls
/// as well as of what turns along; between two free ones with the mean of both.
fn turned(bodies: &[Body], a: usize, b: Option<usize>, h: f64) -> Option<DVec3> {
    let (first, second) = (&bodies[a], &bodies[b?]);
    let way = 0.5 * h * (first.pose.velocity - second.pose.velocity);
    let share = if second.is_free() { 0.5 } else { 1.0 };
    let (turn_a, turn_b) = (first.pose.angular_velocity, second.pose.angular_velocity);
    Some(((share - 1.0) * turn_a - share * turn_b).cross(way))
}

impl Slip {
    fn new(pair: &Pair, patch: &Patch, bodies: &[Body], cap: f64, h: f64) -> Self {
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
            let moved = |t: DVec3| body.give(t, arm.cross(t));
            let spun = body.give(DVec3::ZERO, patch.normal);
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
            let mobility = body.mobility();
            for column in 0..3 {
                let push = if column < 2 { tangent[column] } else { DVec3::ZERO };
                let (moved, turned) = mobility.answer(&Wrench { force: push, torque: turning[column] });
                let slip = DVec3::new(moved.dot(tangent[0]), moved.dot(tangent[1]), 0.0);
                let spun = DVec3::new(turned.dot(turning[0]), turned.dot(turning[1]), turned.dot(turning[2]));
                *response.col_mut(column) += slip + spun;
            }
        }
        // a point has no arm and a locked axis no response: keep the system regular
        let trace = response.x_axis.x + response.y_axis.y + response.z_axis.z;
        response += DMat3::IDENTITY * (1e-12 * trace);
        let image = pair.image.to_array().map(f64::to_bits);
        Self {
            touch: Touch { a, b: pair.b, image, patch: patch.key },
            arm_a,
            arm_b,
            tangent,
            turned: turned(bodies, a, b, h)
                .map_or(DVec3::ZERO, |v| DVec3::new(v.dot(tangent[0]), v.dot(tangent[1]), 0.0)),
            spin,
            spread,
            cap,
            response,
            inverse: response.inverse(),
            dragged: None,
            drag: DVec3::ZERO,
            impulse: DVec3::ZERO,
            remaining: 0.0,
            left: None,
        }
    }

    /// Slip of `a` against `b`, each with the velocity and the angular velocity that `of` tells: two velocities and the spin times the arm [m/s].
    fn slip(&self, of: impl Fn(usize) -> (DVec3, DVec3)) -> DVec3 {
        let parts = |body: usize, arm: DVec3| {
            let (velocity, turning) = of(body);
            let v = velocity + turning.cross(arm);
            DVec3::new(v.dot(self.tangent[0]), v.dot(self.tangent[1]), turning.dot(self.spin))
        };
        let b = self.touch.b.solid().map_or(DVec3::ZERO, |b| parts(b, self.arm_b));
        parts(self.touch.a, self.arm_a) - b
    }

    /// The slip as it is, in the mean over the sub-step [m/s].
    fn velocity(&self, bodies: &[Body]) -> DVec3 {
        self.slip(|k| (bodies[k].pose.velocity, bodies[k].pose.angular_velocity)) + self.turned
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

    /// Drag `eta_h` [kg] times the slip, and its part in what Coulomb friction is yet to do. Of what the forces of the sub-step have changed it
    /// takes the share of its normal `force` [N] in all that is `pressed` on a body, and leaves that of later patches to them.
    fn drag(&mut self, bodies: &mut [Body], eta_h: f64, force: f64, pressed: &[[f64; 2]]) {
        let of = |k: usize, share: f64| {
            let (velocity, turning) = bodies[k].forced;
            (share * velocity, share * turning)
        };
        let forced = self.slip(|k| of(k, force / pressed[k][0]));
        let later = self.slip(|k| of(k, 1.0 - pressed[k][1] / pressed[k][0]));
        let x = eta_h * self.response;
        let half = DMat3::IDENTITY + 0.5 * x;
        let damped = (half + 0.5 * x + 0.5 * x * x).inverse();
        self.drag = -eta_h * (damped * (half * (self.velocity(bodies) - later) - 0.5 * forced));
        self.dragged = Some(damped * half);
        self.response = damped * half * self.response;
        self.inverse = self.response.inverse();
        self.give(bodies, self.drag);
    }

    /// What the drag leaves of an `impulse` [N s].
    fn passed(&self, impulse: DVec3) -> DVec3 {
        self.dragged.map_or(impulse, |dragged| dragged * impulse)
    }

    /// Push [N s] and twist [N m s] of an `impulse` along the tangents and the spin [N s].
    fn parts(&self, impulse: DVec3) -> (DVec3, DVec3) {
        (impulse.x * self.tangent[0] + impulse.y * self.tangent[1], impulse.z * self.spin)
    }

    /// The impulse that `hold` is over `h` [s], within the limit.
    fn impulse_of(&self, hold: Hold, h: f64) -> DVec3 {
        let along = self.tangent.map(|t| h * hold.force.dot(t));
        let arm = self.spin.length();
        let turn = if arm > 0.0 { h * hold.torque / arm } else { 0.0 };
        DVec3::new(along[0], along[1], turn).clamp_length_max(self.cap)
    }

    /// The force that the impulse is over `h` [s].
    fn hold(&self, h: f64) -> Hold {
        let (push, _) = self.parts(self.impulse / h);
        Hold { force: push, torque: self.impulse.z * self.spin.length() / h }
    }

    /// Gives both bodies the Coulomb impulse `change` along the tangents and the spin [N s].
    fn kick(&self, bodies: &mut [Body], change: DVec3) {
        self.give(bodies, self.passed(change));
    }

    /// Gives both bodies the `impulse` along the tangents and the spin [N s].
    fn give(&self, bodies: &mut [Body], impulse: DVec3) {
        let (push, twist) = self.parts(impulse);
        bodies[self.touch.a].touch(push, self.arm_a.cross(push) + twist);
        if let Some(b) = self.touch.b.solid() {
            bodies[b].touch(-push, -self.arm_b.cross(push) - twist);
        }
    }
}
