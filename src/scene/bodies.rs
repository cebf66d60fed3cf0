//! Rigid bodies: particles on a lattice fitted to the edges, mass properties, freedom.

use super::oriented::OrientedBox;
use super::walls::motion;
use super::{Drive, FreeBody, Shape, Solid};
use crate::case::{self, Freedom};
use glam::{DMat3, DQuat, DVec3, IVec3};

/// A body without slots, at the position that the case asks for.
pub(super) fn body(body: &case::Body, spacing: f64, dimensions: u32, layers: i32) -> Solid {
    let plane = dimensions == 2;
    let mut size: DVec3 = body.size.into();
    // In two dimensions the body is a slice l0 wide, so a given mass counts by the slice's share.
    let share = if plane { spacing / size.y } else { 1.0 };
    if plane {
        size.y = spacing;
    }
    let mut position: DVec3 = body.center.into();
    if plane {
        position.y = 0.0;
    }
    let orientation = body.orientation.as_ref().map_or(DQuat::IDENTITY, |turn| {
        DQuat::from_axis_angle(DVec3::from(turn.axis).normalize(), turn.angle_deg.to_radians())
    });
    let drive = match &body.motion {
        Some(rows) => Drive::Prescribed(motion(rows, plane)),
        None => Drive::Free(free(body, size, share, plane)),
    };
    let mut solid = Solid {
        name: body.name.clone(),
        is_body: true,
        shape: Shape::Box { half: 0.5 * size },
        position,
        orientation,
        drive,
        wall_slots: 0..0,
        dummy_slots: 0..0,
        wall_offset: Vec::new(),
        dummy_offset: Vec::new(),
        wall_area: Vec::new(),
        wall_to_surface: Vec::new(),
    };
    fill(&mut solid, size, spacing, plane, layers);
    solid
}

fn free(body: &case::Body, size: DVec3, share: f64, plane: bool) -> FreeBody {
    let mass = match (body.mass, body.density) {
        (Some(mass), _) => mass * share,
        (None, density) => density.unwrap_or_default() * size.element_product(),
    };
    let s2 = size * size;
    let uniform = mass / 12.0 * DVec3::new(s2.y + s2.z, s2.z + s2.x, s2.x + s2.y);
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

/// Particles: n = max(2, round(L / l0)) along an edge, L / n apart, so that the outermost stand half a
/// spacing inside the true faces.
fn fill(solid: &mut Solid, size: DVec3, spacing: f64, plane: bool, layers: i32) {
    let mut n = (size / spacing + 0.5 + 1e-6).floor().as_ivec3().max(IVec3::splat(2));
    if plane {
        n.y = 1;
    }
    let step = size / n.as_dvec3();
    let face = DVec3::new(step.y * step.z, step.z * step.x, step.x * step.y);
    // A hollow one particle across saves nothing worth having.
    let real = if plane { IVec3::new(n.x, i32::MAX, n.z) } else { n };
    let hollow = (real - 2 * layers).min_element() >= 2;
    for i in 0..n.x {
        for j in 0..n.y {
            for k in 0..n.z {
                let c = IVec3::new(i, j, k);
                let offset = (c.as_dvec3() + 0.5) * step - 0.5 * size;
                let (mut depth, mut outward) = (i32::MAX, DVec3::ZERO);
                for axis in (0..3).filter(|&axis| !(plane && axis == 1)) {
                    depth = depth.min(c[axis]).min(n[axis] - 1 - c[axis]);
                    if c[axis] == 0 {
                        outward[axis] = -1.0;
                    } else if c[axis] == n[axis] - 1 {
                        outward[axis] = 1.0;
                    }
                }
                if depth == 0 {
                    solid.wall_offset.push(offset);
                    solid.wall_area.push(outward * face);
                    solid.wall_to_surface.push(outward * 0.5 * step);
                } else if depth < layers || !hollow {
                    solid.dummy_offset.push(offset);
                }
            }
        }
    }
}

impl Solid {
    /// The solid's box in the world.
    pub(super) fn oriented_box(&self) -> OrientedBox {
        let Shape::Box { half } = self.shape;
        OrientedBox { center: self.position, half, axes: DMat3::from_quat(self.orientation) }
    }
    /// Positions of the wall layer in the world [m].
    pub(super) fn wall_positions(&self) -> impl Iterator<Item = DVec3> {
        self.wall_offset.iter().map(|&o| self.position + self.orientation * o)
    }
}
