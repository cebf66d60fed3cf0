//! How much of its mass a pair answers a contact with.
//!
//! The effective depth D grows by J . q' as the two solids move, J = sum_i w_i (d_i / D)^7 (n_i, r_i x n_i), and its
//! spring K swings a mass 1 / (J M^-1 J^T). With S the sum of the shares the contact as a whole has the stiffness K S and the
//! effective mass
//!
//! m_e = S / (J M^-1 J^T) = (sum_i w_i d_i^6) (sum_i w_i d_i^8) / (j M^-1 j^T),  j = sum_i w_i d_i^7 (n_i, r_i x n_i):
//!
//! the reduced mass m where the contact lies on the line of the centres, a quarter of it at the end of a rod, which turns
//! away. A dashpot for m would damp such an end twice as much as it should, so a restitution takes C sqrt(m_e / m). The water in a body's slots
//! is a part of its M.

use super::patch::Contact;
use crate::body::{Body, Pose};
use glam::DVec3;

/// Sums over the contacts of a pair, of their depths over the deepest.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Mode {
    /// Of w_i d_i^6 and of w_i d_i^8.
    pub sixth: f64,
    pub eighth: f64,
    /// Of w_i d_i^7 n_i, and its moment about the first solid's centre [m].
    pub push: DVec3,
    pub moment: DVec3,
}

impl Mode {
    /// Those over `contacts`, of depths over `deepest` [m], with moments about `center` [m]; nothing of none.
    pub fn of(contacts: &[Contact], deepest: f64, center: DVec3) -> Self {
        let (mut mode, per_deepest) = (Self::default(), if deepest > 0.0 { deepest.recip() } else { 0.0 });
        for c in contacts {
            let x = c.depth * per_deepest;
            let sixth = c.weight * (x * x) * (x * x) * (x * x);
            let push = sixth * x * c.normal;
            mode.sixth += sixth;
            mode.eighth += sixth * (x * x);
            mode.push += push;
            mode.moment += (c.at - center).cross(push);
        }
        mode
    }

    /// m_e / `mass`, at most 1 but for what the water in slots makes heavier: 1 for a `mass` [kg] of 0, which is that of a case that gives C itself. `second` is how
    /// the second solid lies beside the first, if it can move.
    pub fn share(&self, mass: f64, first: &Body, second: Option<(&Body, Pose)>) -> f64 {
        if mass == 0.0 {
            return 1.0;
        }
        let gives = |body: &Body, moment: DVec3| {
            [Body::give_alone, Body::give].map(|give| give(body, self.push, moment))
        };
        let [mut alone, mut both] = gives(first, self.moment);
        if let Some((body, pose)) = second {
            let between = first.pose.position - pose.position;
            let [its_own, its_all] = gives(body, self.moment + between.cross(self.push));
            (alone, both) = (alone + its_own, both + its_all);
        }
        // what nothing moves gives way to nothing
        if both > 0.0 { (self.sixth * self.eighth / (alone * mass)).min(1.0) * (alone / both) } else { 1.0 }
    }
}
