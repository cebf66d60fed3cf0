//! Rigid bodies: shape, mass properties, freedom.

use super::oriented::Placed;
use super::walls::motion;
use super::{Drive, FreeBody, Motion, Shape, Solid};
use crate::case::{self, Axis, Freedom};
use crate::error::Problem;
use glam::{DMat3, DQuat, DVec3};

/// A body without slots, at the position that the case asks for.
///
/// # Errors
/// A shape that cannot be had; the key is that of the body's table.
pub(super) fn body(
    body: &case::Body,
    spacing: f64,
    dimensions: u32,
    layers: i32,
) -> Result<Solid, Box<Problem>> {
    let plane = dimensions == 2;
    let form = body.form();
    let (shape, share) = form.shape(spacing, plane)?;
    let in_plane =
        |x: case::Vector| if plane { DVec3::from(x) * DVec3::new(1.0, 0.0, 1.0) } else { x.into() };
    let center = in_plane(body.center);
    let frame = form.upended(plane) * shape.frame();
    let orientation = form.orientation() * frame;
    // `orientation` turns it, an `axis` does not.
    let mass = orientation.inverse() * (form.orientation() * body.mass_offset.map_or(DVec3::ZERO, in_plane));
    // What it moves and turns about, and where that is.
    let about = body.hinge.as_ref().map_or(mass, |h| orientation.inverse() * (in_plane(h.at) - center));
    let drive = if body.is_driven() {
        Drive::Prescribed(motion(&body.guide(), None, center, plane))
    } else {
        Drive::Free(free(body, &shape, (mass - about, orientation), share, plane))
    };
    let particles = shape.particles(spacing, dimensions, layers);
    let from_there = |places: Vec<DVec3>| places.into_iter().map(|x| x - about).collect();
    Ok(Solid {
        name: body.name.clone(),
        is_body: true,
        shape,
        position: center + orientation * about,
        shape_offset: -about,
        orientation,
        frame,
        drive,
        wall_slots: 0..0,
        dummy_slots: 0..0,
        wall_offset: from_there(particles.wall),
        dummy_offset: from_there(particles.dummy),
        wall_area: particles.area,
        wall_to_surface: particles.to_surface,
        wall_edges: particles.edges,
    })
}

/// `weight_arm` leads from what it moves about to the centre of mass [m], in its frame, which `orientation` turns to the world's.
fn free(
    body: &case::Body,
    shape: &Shape,
    (weight_arm, orientation): (DVec3, DQuat),
    share: f64,
    plane: bool,
) -> FreeBody {
    let mass = match (body.mass, body.density) {
        (Some(mass), _) => mass * share,
        (None, density) => density.unwrap_or_default() * shape.volume(),
    };
    let uniform = shape.inertia(mass);
    let locked = |axes: [Freedom; 3]| axes.map(|f| body.locked.contains(&f));
    let mut freedom = FreeBody {
        mass,
        inertia: body.moments(plane).map_or(uniform, |i| i * share),
        weight_arm,
        velocity: body.velocity.into(),
        angular_velocity: body.angular_velocity.into(),
        locked_translation: locked([Freedom::X, Freedom::Y, Freedom::Z]),
        locked_rotation: locked([Freedom::RotationX, Freedom::RotationY, Freedom::RotationZ]),
    };
    if plane {
        freedom.locked_translation[1] = true;
        freedom.locked_rotation[0] = true;
        freedom.locked_rotation[2] = true;
    }
    if let Some(hinge) = &body.hinge {
        freedom.locked_translation = [true; 3];
        freedom.locked_rotation = [Axis::X, Axis::Y, Axis::Z].map(|axis| axis != hinge.axis);
        let axis: DVec3 = orientation.inverse() * DVec3::AXES[hinge.axis as usize];
        let about: f64 = (axis * axis).dot(freedom.inertia) + mass * weight_arm.cross(axis).length_squared();
        freedom.inertia = DVec3::splat(about);
    }
    // What is locked does not move at the start either.
    for axis in 0..3 {
        if freedom.locked_translation[axis] {
            freedom.velocity[axis] = 0.0;
        }
        if freedom.locked_rotation[axis] {
            freedom.angular_velocity[axis] = 0.0;
        }
    }
    freedom
}

impl Solid {
    /// The solid's shape in the world.
    pub(super) fn placed(&self) -> Placed {
        Placed { center: self.shape_center(), shape: self.shape, axes: DMat3::from_quat(self.orientation) }
    }

    /// The same at time `t` [s] of the `motion` that drives it.
    pub(super) fn placed_at(&self, motion: &Motion, t: f64) -> Placed {
        let orientation = motion.turn(t) * self.orientation;
        let center = self.position + motion.displacement(t) + orientation * self.shape_offset;
        Placed { center, shape: self.shape, axes: DMat3::from_quat(orientation) }
    }

    /// Positions of the wall layer in the world [m].
    pub(super) fn wall_positions(&self) -> impl Iterator<Item = DVec3> {
        self.wall_offset.iter().map(|&o| self.position + self.orientation * o)
    }
}
