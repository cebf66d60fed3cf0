//! Rigid bodies: pose, inertia, and the symplectic Euler step with angular momentum.
//!
//! A body's state is its position, orientation, velocity and *angular momentum*; the angular velocity
//! follows from the momentum and the orientation, so that a free body keeps its momentum to round-off
//! while it tumbles. A prescribed solid is a body of infinite mass that follows its table.

use crate::scene::{Drive, Motion, Solid};
use crate::shape::Shape;
use glam::{DMat3, DQuat, DVec3};

/// Position and velocity of a solid, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Centre of mass [m].
    pub position: DVec3,
    /// Orientation: turns the solid's frame into the world's.
    pub orientation: DQuat,
    /// Velocity of the centre of mass [m/s].
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

/// Force [N] and torque about the centre of mass [N m], world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Force [N].
    pub force: DVec3,
    /// Torque about the centre of mass [N m].
    pub torque: DVec3,
}

impl std::ops::AddAssign for Wrench {
    fn add_assign(&mut self, other: Self) {
        self.force += other.force;
        self.torque += other.torque;
    }
}

/// A solid that moves, with what its motion needs.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub pose: Pose,
    /// Orientation as a matrix, kept beside the quaternion.
    pub rotation: DMat3,
    /// Angular momentum about the centre of mass [kg m2/s]; zero about locked axes.
    pub momentum: DVec3,
    /// 1/mass along each world axis [1/kg]; 0 where locked or prescribed.
    pub inverse_mass: DVec3,
    /// Inverse of the inertia, world axes [1/(kg m2)]; zero rows where locked or prescribed.
    pub inverse_inertia: DMat3,
    /// Mass [kg]; infinite for a prescribed solid.
    pub mass: f64,
    /// Principal moments [kg m2].
    pub principal: DVec3,
    /// `true` for rotations about world axes that are locked.
    pub locked_rotation: [bool; 3],
    /// Shape, in the body's frame.
    pub shape: Shape,
    /// Table of motion, of a prescribed solid.
    motion: Option<(DVec3, Motion)>,
    /// The inertia does not depend on the orientation.
    isotropic: bool,
}

impl Body {
    /// The body of `solid` at t = 0. In two dimensions it stays in the plane y = 0.
    pub fn new(solid: &Solid, dimensions: u32) -> Self {
        let mut body = Self {
            pose: Pose {
                position: solid.position,
                orientation: solid.orientation.normalize(),
                velocity: DVec3::ZERO,
                angular_velocity: DVec3::ZERO,
            },
            rotation: DMat3::from_quat(solid.orientation.normalize()),
            momentum: DVec3::ZERO,
            inverse_mass: DVec3::ZERO,
            inverse_inertia: DMat3::ZERO,
            mass: f64::INFINITY,
            principal: DVec3::INFINITY,
            locked_rotation: [true; 3],
            shape: solid.shape,
            motion: None,
            isotropic: false,
        };
        match &solid.drive {
            Drive::Prescribed(motion) => body.motion = Some((solid.position, motion.clone())),
            Drive::Free(free) => {
                let flat = dimensions == 2;
                let translation = [0, 1, 2].map(|k| free.locked_translation[k] || flat && k == 1);
                body.locked_rotation = [0, 1, 2].map(|k| free.locked_rotation[k] || flat && k != 1);
                body.mass = free.mass;
                body.principal = free.inertia;
                body.inverse_mass =
                    DVec3::from_array(translation.map(|locked| if locked { 0.0 } else { 1.0 / free.mass }));
                body.isotropic =
                    free.inertia == DVec3::splat(free.inertia.x) && body.locked_rotation == [false; 3];
                body.pose.velocity = free.velocity * body.inverse_mass * free.mass;
                let spin = body.free_axes() * free.angular_velocity;
                body.momentum = body.free_axes() * (body.inertia(body.rotation) * spin);
                body.inverse_inertia = body.inverse_inertia_at(body.rotation);
                body.pose.angular_velocity = body.inverse_inertia * body.momentum;
            }
        }
        body
    }

    /// Whether forces move it.
    pub fn is_free(&self) -> bool {
        self.motion.is_none()
    }

    /// Radius of the sphere about the centre that holds the body [m].
    pub fn radius(&self) -> f64 {
        self.shape.radius()
    }

    /// World half extents of the bounding box [m].
    pub fn extent(&self) -> DVec3 {
        self.shape.extent(self.rotation)
    }

    /// Diagonal of ones, zeros about locked axes.
    fn free_axes(&self) -> DMat3 {
        DMat3::from_diagonal(DVec3::from_array(self.locked_rotation.map(|l| if l { 0.0 } else { 1.0 })))
    }

    fn inertia(&self, rotation: DMat3) -> DMat3 {
        rotation * DMat3::from_diagonal(self.principal) * rotation.transpose()
    }

    /// Inverse of the inertia restricted to the free axes: locked axes take any torque, so only the
    /// block of the free ones is inverted.
    fn inverse_inertia_at(&self, rotation: DMat3) -> DMat3 {
        if self.isotropic {
            return DMat3::from_diagonal(self.principal.recip());
        }
        match self.locked_rotation {
            [true, true, true] => DMat3::ZERO,
            [false, false, false] => {
                rotation * DMat3::from_diagonal(self.principal.recip()) * rotation.transpose()
            }
            _ => {
                let free = self.free_axes();
                let block = free * self.inertia(rotation) * free + (DMat3::IDENTITY - free);
                free * block.inverse() * free
            }
        }
    }

    /// Adds an impulse [N s] and an angular impulse about the centre [N m s].
    pub fn kick(&mut self, impulse: DVec3, angular: DVec3) {
        self.pose.velocity += self.inverse_mass * impulse;
        if !self.is_free() {
            return;
        }
        let locked = self.locked_rotation;
        self.momentum += DVec3::from_array([0, 1, 2].map(|k| if locked[k] { 0.0 } else { angular[k] }));
        self.pose.angular_velocity = self.inverse_inertia * self.momentum;
    }

    /// Moves the free body for `h` [s] with the velocity it has. The angular velocity is taken at the
    /// middle of the turn: the momentum is kept exactly and the energy to second order.
    pub fn drift(&mut self, h: f64) {
        self.pose.position += h * self.pose.velocity;
        if self.pose.angular_velocity == DVec3::ZERO {
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

    /// Velocity [m/s] of a prescribed solid over the step from `t` to `t + dt`: its displacement over dt,
    /// so that it arrives where the table says whatever kink lies inside the step.
    pub fn prescribed_velocity(&self, t: f64, dt: f64) -> Option<DVec3> {
        self.motion.as_ref().map(|(_, m)| (m.displacement(t + dt) - m.displacement(t)) / dt)
    }

    /// Position [m] of a prescribed solid at `t`.
    pub fn prescribed_position(&self, t: f64) -> Option<DVec3> {
        self.motion.as_ref().map(|(start, m)| *start + m.displacement(t))
    }

    /// Speed of its fastest point [m/s] within the step from `t` to `t + dt`, forces left aside.
    pub fn fastest(&self, t: f64, dt: f64) -> f64 {
        match &self.motion {
            Some((_, motion)) => motion.fastest(t, t + dt),
            None => self.pose.velocity.length() + self.pose.angular_velocity.length() * self.radius(),
        }
    }

    /// Continues from a pose and an angular momentum [kg m2/s].
    pub fn restore(&mut self, pose: Pose, momentum: DVec3) {
        self.pose = pose;
        self.rotation = DMat3::from_quat(pose.orientation);
        self.momentum = momentum;
        if self.is_free() {
            self.inverse_inertia = self.inverse_inertia_at(self.rotation);
        }
    }

    /// Kinetic energy [J]; 0 for a prescribed solid.
    pub fn kinetic_energy(&self) -> f64 {
        if !self.is_free() {
            return 0.0;
        }
        0.5 * self.mass * self.pose.velocity.length_squared()
            + 0.5 * self.momentum.dot(self.pose.angular_velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::FreeBody;

    fn brick(locked_rotation: [bool; 3], spin: DVec3) -> Body {
        let solid = Solid {
            name: "brick".into(),
            is_body: true,
            shape: Shape::cuboid(DVec3::new(0.6, 0.4, 0.2)),
            position: DVec3::ZERO,
            orientation: DQuat::from_rotation_x(0.4),
            drive: Drive::Free(FreeBody {
                mass: 12.0,
                inertia: DVec3::new(0.2, 0.4, 0.52),
                velocity: DVec3::X,
                angular_velocity: spin,
                locked_translation: [false; 3],
                locked_rotation,
            }),
            wall_slots: 0..0,
            dummy_slots: 0..0,
            wall_offset: vec![],
            dummy_offset: vec![],
            wall_area: vec![],
            wall_to_surface: vec![],
        };
        Body::new(&solid, 3)
    }

    #[test]
    fn a_tumbling_brick_keeps_momentum_exactly_and_energy_to_second_order() {
        let drift_of_energy = |h: f64| {
            let mut body = brick([false; 3], DVec3::new(0.1, 6.0, 0.2));
            let (momentum, energy) = (body.momentum, body.kinetic_energy());
            let mut worst = 0.0_f64;
            let mut turned = 0.0_f64;
            for _ in 0..(2.0 / h) as usize {
                body.drift(h);
                worst = worst.max((body.kinetic_energy() / energy - 1.0).abs());
                turned = turned.max(body.pose.angular_velocity.x.abs());
            }
            assert_eq!(body.momentum, momentum);
            assert!(turned > 1.0, "the intermediate axis is unstable, so the brick must have tumbled");
            worst
        };
        let (coarse, fine) = (drift_of_energy(2e-3), drift_of_energy(1e-3));
        assert!(coarse < 1e-4, "{coarse:e}");
        assert!(fine < 0.3 * coarse, "{fine:e} against {coarse:e}");
    }

    #[test]
    fn locked_axes_do_not_turn_and_do_not_couple() {
        let mut body = brick([true, false, true], DVec3::new(3.0, 2.0, 1.0));
        assert_eq!(body.pose.angular_velocity * DVec3::new(1.0, 0.0, 1.0), DVec3::ZERO);
        let about_y = body.inertia(body.rotation).y_axis.y;
        body.kick(DVec3::ZERO, DVec3::new(5.0, 7.0, 9.0));
        assert!((body.pose.angular_velocity.y - (2.0 + 7.0 / about_y)).abs() < 1e-12);
        assert_eq!(body.pose.angular_velocity.x, 0.0);
        body.drift(0.1);
        assert_eq!(body.pose.angular_velocity.z, 0.0);
    }
}
