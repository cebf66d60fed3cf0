//! How a solid lies and moves, and what pushes it.

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Position and velocity of a solid, world axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// What it moves and turns about [m]: the centre of mass, or a place on its hinge.
    pub position: DVec3,
    /// Orientation: turns the solid's frame into the world's.
    pub orientation: DQuat,
    /// Velocity of `position` [m/s].
    pub velocity: DVec3,
    /// Angular velocity [rad/s].
    pub angular_velocity: DVec3,
}

impl Pose {
    /// World position [m] of a point given in the solid's frame [m].
    pub fn point(&self, offset: DVec3) -> DVec3 {
        self.position + self.orientation * offset
    }

    /// Velocity [m/s] of the solid at the world point `at` [m].
    pub fn velocity_at(&self, at: DVec3) -> DVec3 {
        self.velocity + self.angular_velocity.cross(at - self.position)
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.position.is_finite()
            && self.orientation.is_finite()
            && self.velocity.is_finite()
            && self.angular_velocity.is_finite()
    }
}

/// Force [N] and torque about the position of the solid [N m], world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wrench {
    /// Force [N].
    pub force: DVec3,
    /// Torque about the position of the solid [N m].
    pub torque: DVec3,
}

impl Wrench {
    /// Adds `factor` times `other`.
    pub fn add(&mut self, factor: f64, other: &Self) {
        self.force += factor * other.force;
        self.torque += factor * other.torque;
    }
}

impl std::ops::Div<f64> for Wrench {
    type Output = Self;

    fn div(self, by: f64) -> Self {
        Self { force: self.force / by, torque: self.torque / by }
    }
}

impl std::ops::Sub for Wrench {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { force: self.force - other.force, torque: self.torque - other.torque }
    }
}

impl std::ops::AddAssign for Wrench {
    fn add_assign(&mut self, other: Self) {
        self.force += other.force;
        self.torque += other.torque;
    }
}
