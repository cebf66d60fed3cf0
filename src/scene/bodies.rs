//! Rigid bodies: shape, mass properties, freedom.

use super::oriented::Placed;
use super::walls::motion;
use super::{Drive, FreeBody, Shape, Solid};
use crate::case::{self, Freedom};
use crate::error::Problem;
use glam::{DMat3, DVec3};

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
    let mut position: DVec3 = body.center.into();
    if plane {
        position.y = 0.0;
    }
    let drive = if body.is_driven() {
        Drive::Prescribed(motion(&body.guide(), None, position, plane))
    } else {
        Drive::Free(free(body, &shape, share, plane))
    };
    let particles = shape.particles(spacing, dimensions, layers);
    Ok(Solid {
        name: body.name.clone(),
        is_body: true,
        shape,
        position,
        orientation: form.turn(plane) * shape.frame(),
        drive,
        wall_slots: 0..0,
        dummy_slots: 0..0,
        wall_offset: particles.wall,
        dummy_offset: particles.dummy,
        wall_area: particles.area,
        wall_to_surface: particles.to_surface,
    })
}

fn free(body: &case::Body, shape: &Shape, share: f64, plane: bool) -> FreeBody {
    let mass = match (body.mass, body.density) {
        (Some(mass), _) => mass * share,
        (None, density) => density.unwrap_or_default() * shape.volume(),
    };
    let uniform = shape.inertia(mass);
    let locked = |axes: [Freedom; 3]| axes.map(|f| body.locked.contains(&f));
    let mut freedom = FreeBody {
        mass,
        inertia: body.inertia.map_or(uniform, |i| DVec3::from(i) * share),
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
        Placed { center: self.position, shape: self.shape, axes: DMat3::from_quat(self.orientation) }
    }
    /// Positions of the wall layer in the world [m].
    pub(super) fn wall_positions(&self) -> impl Iterator<Item = DVec3> {
        self.wall_offset.iter().map(|&o| self.position + self.orientation * o)
    }
}
