//! Rigid bodies.
use glam::{DQuat, DVec3};

/// Pose and velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Centre of mass [m].
    pub position: DVec3,
    /// Orientation.
    pub orientation: DQuat,
    /// Velocity [m/s].
    pub velocity: DVec3,
    /// Angular velocity, world axes [rad/s].
    pub angular_velocity: DVec3,
}

/// Force and torque about the centre of mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Force [N].
    pub force: DVec3,
    /// Torque [N m].
    pub torque: DVec3,
}
