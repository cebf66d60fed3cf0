//! Particles of moving solids follow the pose of their solid.
//! GPU twin: shaders/move_solids.wgsl

use crate::body::Pose;
use glam::DVec3;

/// Position and velocity of the particle at `offset` (solid's frame) from the centre of mass.
#[inline(always)]
pub fn move_solids(pose: &Pose, offset: DVec3) -> (DVec3, DVec3) {
    let arm = pose.orientation * offset;
    (pose.position + arm, pose.velocity + pose.angular_velocity.cross(arm))
}
