//! Free motion of a body: its way, and its turn by Euler's equations.

use super::Body;
use glam::{DMat3, DQuat, DVec3};

/// Most Newton steps of a free turn; three to five do below a tenth of a turn.
const TURN_ITERATIONS: usize = 20;

/// The matrix of v x.
fn cross(v: DVec3) -> DMat3 {
    DMat3::from_cols(v.cross(DVec3::X), v.cross(DVec3::Y), v.cross(DVec3::Z))
}

impl Body {
    /// Moves the free body for `h` [s] with the velocity it has. A free turn keeps momentum and energy to
    /// round-off; one about an axis or two that are not locked keeps the momentum.
    pub fn drift(&mut self, h: f64) {
        self.pose.position += h * self.pose.velocity;
        if self.pose.angular_velocity == DVec3::ZERO {
            return;
        }
        if !self.isotropic && self.locked_rotation == [false; 3] {
            self.turn(h);
            return;
        }
        let turn = |w: DVec3, t: f64, q: DQuat| (DQuat::from_scaled_axis(w * t) * q).normalize();
        let mut spin = self.pose.angular_velocity;
        if !self.isotropic {
            let middle = turn(spin, 0.5 * h, self.pose.orientation);
            spin = self.inverse_inertia_at(DMat3::from_quat(middle)) * self.momentum;
        }
        self.pose.orientation = turn(spin, h, self.pose.orientation);
        self.rotation = DMat3::from_quat(self.pose.orientation);
        if !self.isotropic {
            self.inverse_inertia = self.inverse_inertia_at(self.rotation);
            self.pose.angular_velocity = self.inverse_inertia * self.momentum;
        }
    }

    /// Free turn for `h` [s]: Euler's equations by the midpoint rule in the body's frame,
    ///
    /// p' - p = h m x I^-1 m,  m = (p + p') / 2,
    ///
    /// keep p . I^-1 p and |p| exactly, and p' is p turned back by the Cayley turn of h I^-1 m. The body is turned
    /// by the same, so that its momentum in the world stays as it is (Austin, Krishnaprasad & Wang 1993).
    fn turn(&mut self, h: f64) {
        let inverse = self.principal.recip();
        let start = self.rotation.transpose() * self.momentum;
        let mut end = start;
        for _ in 0..TURN_ITERATIONS {
            let middle = 0.5 * (start + end);
            let spin = inverse * middle;
            let residual = end - start - h * middle.cross(spin);
            // derivative of the residual
            let slope = cross(middle) * DMat3::from_diagonal(inverse) - cross(spin);
            let change = (DMat3::IDENTITY - 0.5 * h * slope).inverse() * residual;
            end -= change;
            if change.length_squared() <= 1e-32 * start.length_squared() {
                break;
            }
        }
        let half = 0.5 * h * inverse * (0.5 * (start + end));
        let cayley = DQuat::from_xyzw(half.x, half.y, half.z, 1.0).normalize();
        self.pose.orientation = (self.pose.orientation * cayley).normalize();
        self.rotation = DMat3::from_quat(self.pose.orientation);
        self.inverse_inertia = self.inverse_inertia_at(self.rotation);
        self.pose.angular_velocity = self.inverse_inertia * self.momentum;
    }
}
