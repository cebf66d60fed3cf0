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

/// Velocity of the surface that lies `to_surface` from the particle at `offset` (solid's frame) [m/s]: what viscosity and friction of the
/// water act on. Below the surface of a solid that turns its particles are slower, or faster in a vessel, by omega l0 / 2.
#[inline(always)]
pub fn on_surface(pose: &Pose, offset: DVec3, to_surface: DVec3) -> DVec3 {
    move_solids(pose, offset + to_surface).1
}
