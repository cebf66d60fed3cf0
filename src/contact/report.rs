//! What contact tells its callers.

use crate::body::{Pose, Wrench};
use glam::{DVec3, IVec3};

/// What a step of contact did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactReport {
    /// Contact sub-steps of the step.
    pub substeps: u32,
    /// dt sqrt(K / m_e) of the whole step [-], before sub-stepping.
    pub omega_dt: f64,
    /// Deepest contact over the spacing [-]: of true surfaces ("smooth"), d_c - d ("paper").
    pub penetration_max_over_l0: f64,
    /// Particle pairs ("paper") or surface points ("smooth") in contact in the last sub-step.
    pub pairs: usize,
    /// Pairs of solids in contact in the last sub-step.
    pub solid_pairs: usize,
    /// Energy in the contact springs at the last sub-step [J].
    pub potential_energy: f64,
}

/// Energy of all free bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Of motion [J].
    pub kinetic: f64,
    /// Of height [J], zero at the origin; nothing along periodic axes.
    pub gravity: f64,
    /// In contact springs [J].
    pub contact: f64,
}

impl Energy {
    /// Sum [J].
    pub fn total(&self) -> f64 {
        self.kinetic + self.gravity + self.contact
    }
}

/// State of a solid, for checkpoints: what `restore` needs to go on to the last bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidState {
    /// Pose and velocity.
    pub pose: Pose,
    /// Whole lengths that it has gone over periodic sides.
    pub turns: IVec3,
    /// Angular momentum about its position [kg m2/s].
    pub angular_momentum: DVec3,
    /// Mean contact wrench of the last step.
    pub contact: Wrench,
}
