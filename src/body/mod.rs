//! Rigid bodies: pose, inertia, and the symplectic Euler step with angular momentum.
//!
//! A body's state is its position, orientation, velocity and *angular momentum*; the angular velocity
//! follows from the momentum and the orientation, so that a free body keeps its momentum to round-off
//! while it tumbles. A prescribed solid is a body of infinite mass that follows its table.

mod mobility;
mod pose;
pub mod slots;
mod turn;

pub use mobility::{Mobility, Six};
pub use pose::{Pose, Wrench};

use crate::scene::{Drive, Motion, Solid};
use crate::shape::Shape;
use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// A solid as the pressure equation sees it: how it answers forces, and those that act on it beside the fluid's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FreeBody {
    /// How it moves; not at all where it is locked or prescribed.
    pub mobility: Mobility,
    /// Weight, contact, and what is known of the water in its slots.
    pub load: Wrench,
}

/// A solid that moves, with what its motion needs.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub pose: Pose,
    /// Orientation as a matrix, kept beside the quaternion.
    pub rotation: DMat3,
    /// Angular momentum about its position [kg m2/s]; zero about locked axes.
    pub momentum: DVec3,
    /// 1/mass along each world axis [1/kg]; 0 where locked or prescribed.
    pub inverse_mass: DVec3,
    /// Inverse of the inertia, world axes [1/(kg m2)]; zero rows where locked or prescribed.
    pub inverse_inertia: DMat3,
    /// How it moves with the water in its slots, which moves with it; `None` where there is none.
    pub in_slots: Option<Box<Mobility>>,
    /// Mass [kg]; infinite for a prescribed solid.
    pub mass: f64,
    /// Principal moments [kg m2].
    pub principal: DVec3,
    /// `true` for rotations about world axes that are locked.
    pub locked_rotation: [bool; 3],
    /// Impulse [N s] and angular impulse [N m s] of contact since they were last taken, whether or not the solid gives
    /// way.
    pub touched: Wrench,
    /// Velocity [m/s] and angular velocity [rad/s] that forces, without friction, have given it in the sub-step; zero of driven solids, whose
    /// change of velocity counts as slip from before.
    pub forced: (DVec3, DVec3),
    /// Shape.
    pub shape: Shape,
    /// From the body's position to the centre of `shape`, body's frame [m].
    pub shape_offset: DVec3,
    /// From the body's position to the centre of mass, body's frame [m].
    weight_arm: DVec3,
    /// Place and orientation at the start, and tables of motion, of a prescribed solid.
    motion: Option<(DVec3, DQuat, Motion)>,
    /// It is locked in all that it could do, and stays where it is: at the start, or where a state had it.
    held: bool,
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
            in_slots: None,
            mass: f64::INFINITY,
            principal: DVec3::INFINITY,
            locked_rotation: [true; 3],
            touched: Wrench::default(),
            forced: (DVec3::ZERO, DVec3::ZERO),
            shape: solid.shape,
            shape_offset: solid.shape_offset,
            weight_arm: DVec3::ZERO,
            motion: None,
            held: false,
            isotropic: false,
        };
        match &solid.drive {
            Drive::Prescribed(motion) => {
                (body.pose.velocity, body.pose.angular_velocity) = motion.velocity(0.0);
                body.motion = Some((solid.position, body.pose.orientation, motion.clone()));
            }
            // What is held in all that it could do is a wall to others.
            Drive::Free(free) if !free.gives_way() => {
                body.held = true;
                body.motion = Some((solid.position, body.pose.orientation, Motion::still()));
            }
            Drive::Free(free) => {
                let flat = dimensions == 2;
                let translation = [0, 1, 2].map(|k| free.locked_translation[k] || flat && k == 1);
                body.locked_rotation = [0, 1, 2].map(|k| free.locked_rotation[k] || flat && k != 1);
                body.mass = free.mass;
                body.weight_arm = free.weight_arm;
                body.principal = free.inertia;
                body.inverse_mass =
                    DVec3::from_array(translation.map(|locked| if locked { 0.0 } else { 1.0 / free.mass }));
                body.isotropic =
                    free.inertia == DVec3::splat(free.inertia.x) && body.locked_rotation == [false; 3];
                let (velocity, angular_velocity) = (free.velocity, free.angular_velocity);
                body.take_over(Pose { velocity, angular_velocity, ..body.pose }, DVec3::ZERO);
            }
        }
        body
    }

    /// Whether forces move it.
    pub fn is_free(&self) -> bool {
        self.motion.is_none()
    }

    /// Whether a table or a formula moves it: what is held, or an obstacle, stands still.
    pub fn is_driven(&self) -> bool {
        self.motion.as_ref().is_some_and(|(.., motion)| !motion.is_still())
    }

    /// How far [m] a prescribed solid's pose is, at most and anywhere on it, from where its motion has it at time `t` [s].
    pub(crate) fn off_motion(&self, t: f64) -> Option<f64> {
        let (position, orientation, motion) = self.motion.as_ref()?;
        let turned = (motion.turn(t) * *orientation).angle_between(self.pose.orientation);
        Some((*position + motion.displacement(t) - self.pose.position).length() + turned * self.radius())
    }

    /// Radius of the sphere about its position that holds the body [m].
    pub fn radius(&self) -> f64 {
        self.shape.radius() + self.shape_offset.length()
    }

    /// Centre of the shape [m].
    pub fn shape_center(&self) -> DVec3 {
        self.pose.position + self.rotation * self.shape_offset
    }

    /// Force and torque of `gravity` [m/s2] on it.
    pub fn weight(&self, gravity: DVec3) -> Wrench {
        let force = self.mass * gravity;
        Wrench { force, torque: self.to_mass().cross(force) }
    }

    /// From its position to the centre of mass [m].
    pub fn to_mass(&self) -> DVec3 {
        self.rotation * self.weight_arm
    }

    /// The same in another `pose` [m].
    pub fn to_mass_at(&self, pose: &Pose) -> DVec3 {
        pose.orientation * self.weight_arm
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

    /// How it answers what pushes it.
    pub fn mobility(&self) -> Mobility {
        match &self.in_slots {
            Some(mobility) => **mobility,
            None => Mobility::of_body(self.inverse_mass, self.inverse_inertia),
        }
    }

    /// Velocity along `push` and turn about `moment`, in all, that an impulse of both gives the body alone: their product with what they give [1/kg].
    pub fn give_alone(&self, push: DVec3, moment: DVec3) -> f64 {
        (self.inverse_mass * push).dot(push) + (self.inverse_inertia * moment).dot(moment)
    }

    /// The same of the body with the water in its slots.
    pub fn give(&self, push: DVec3, moment: DVec3) -> f64 {
        match &self.in_slots {
            None => self.give_alone(push, moment),
            Some(mobility) => {
                let (velocity, turn) = mobility.answer(&Wrench { force: push, torque: moment });
                velocity.dot(push) + turn.dot(moment)
            }
        }
    }

    /// Adds an impulse [N s] and an angular impulse about the position [N m s].
    pub fn kick(&mut self, impulse: DVec3, angular: DVec3) {
        if let Some(mobility) = &self.in_slots {
            let (velocity, turn) = mobility.answer(&Wrench { force: impulse, torque: angular });
            self.pose.velocity += velocity;
            self.momentum += self.free_axes() * (self.inertia(self.rotation) * turn);
            self.pose.angular_velocity = self.inverse_inertia * self.momentum;
            return;
        }
        self.pose.velocity += self.inverse_mass * impulse;
        if !self.is_free() {
            return;
        }
        let locked = self.locked_rotation;
        self.momentum += DVec3::from_array([0, 1, 2].map(|k| if locked[k] { 0.0 } else { angular[k] }));
        self.pose.angular_velocity = self.inverse_inertia * self.momentum;
    }

    /// As [`Body::kick`], by another solid.
    pub fn touch(&mut self, impulse: DVec3, angular: DVec3) {
        self.touched += Wrench { force: impulse, torque: angular };
        self.kick(impulse, angular);
    }

    /// Pose of a prescribed solid at `t + ahead`, with its mean velocities from `t` to `t + dt`: its way and its turn over dt, so that
    /// it arrives where the table says whatever kink lies inside the step.
    pub fn prescribed(&self, t: f64, dt: f64, ahead: f64) -> Option<Pose> {
        let (position, orientation, motion) = self.motion.as_ref()?;
        let velocity = (motion.displacement(t + dt) - motion.displacement(t)) / dt;
        let position = *position + motion.displacement(t + ahead);
        let mut pose = Pose { position, velocity, ..self.pose };
        if motion.turns() {
            let turned = motion.turn(t + dt);
            let mut way = turned * motion.turn(t).inverse();
            if way.w < 0.0 {
                way = -way;
            }
            pose.orientation = (motion.turn(t + ahead) * *orientation).normalize();
            pose.angular_velocity = way.to_scaled_axis() / dt;
        }
        Some(pose)
    }

    /// Gives a prescribed solid its mean velocities from `t` to `t + h` [s].
    pub fn follow(&mut self, t: f64, h: f64) {
        if let Some(pose) = self.prescribed(t, h, h) {
            self.pose.velocity = pose.velocity;
            self.pose.angular_velocity = pose.angular_velocity;
        }
    }

    /// Moves a prescribed solid for a sub-step of `h` [s] that ends at `now` [s]; the `last` of a step puts it onto its table.
    pub fn carry(&mut self, now: f64, h: f64, last: bool) {
        let Some((position, orientation, motion)) = &self.motion else { return };
        let way = h * self.pose.velocity;
        self.pose.position =
            if last { *position + motion.displacement(now) } else { self.pose.position + way };
        if motion.turns() {
            self.pose.orientation = (motion.turn(now) * *orientation).normalize();
            self.rotation = DMat3::from_quat(self.pose.orientation);
        }
    }

    /// Whether a prescribed solid's velocity changes between `t` and `t + dt` [s].
    pub fn bends(&self, t: f64, dt: f64) -> bool {
        self.motion.as_ref().is_some_and(|(.., m)| m.bends(t, dt))
    }

    /// Speed of its fastest point [m/s] within the step from `t` to `t + dt`, forces left aside.
    pub fn fastest(&self, t: f64, dt: f64) -> f64 {
        match &self.motion {
            Some((.., motion)) => motion.fastest(t, t + dt, self.radius()),
            None => self.speed(),
        }
    }

    /// What no point of it is faster than now [m/s].
    pub fn speed(&self) -> f64 {
        self.pose.velocity.length() + self.pose.angular_velocity.length() * self.radius()
    }

    /// Continues from a pose and an angular momentum [kg m2/s].
    pub fn restore(&mut self, pose: Pose, momentum: DVec3) {
        self.pose = pose;
        self.rotation = DMat3::from_quat(pose.orientation);
        self.momentum = momentum;
        if self.is_free() {
            self.inverse_inertia = self.inverse_inertia_at(self.rotation);
        }
        if let (true, Some((position, orientation, _))) = (self.held, &mut self.motion) {
            (*position, *orientation) = (pose.position, pose.orientation);
        }
    }

    /// Moves on from `pose` as far as its freedom goes, with `momentum` [kg m2/s] if that is still what turns it so.
    pub fn take_over(&mut self, pose: Pose, momentum: DVec3) {
        self.restore(pose, momentum);
        if self.held {
            self.pose = Pose { velocity: DVec3::ZERO, angular_velocity: DVec3::ZERO, ..pose };
            self.momentum = DVec3::ZERO;
        }
        if !self.is_free() {
            return;
        }
        if self.inverse_inertia * momentum != pose.angular_velocity {
            let spin = self.free_axes() * pose.angular_velocity;
            self.momentum = self.free_axes() * (self.inertia(self.rotation) * spin);
            self.pose.angular_velocity = self.inverse_inertia * self.momentum;
        }
        let open = self.inverse_mass.to_array().map(|give| if give > 0.0 { 1.0 } else { 0.0 });
        self.pose.velocity *= DVec3::from_array(open);
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
            frame: DQuat::IDENTITY,
            drive: Drive::Free(FreeBody {
                mass: 12.0,
                inertia: DVec3::new(0.2, 0.4, 0.52),
                weight_arm: DVec3::ZERO,
                velocity: DVec3::X,
                angular_velocity: spin,
                locked_translation: [false; 3],
                locked_rotation,
            }),
            wall_slots: 0..0,
            dummy_slots: 0..0,
            shape_offset: DVec3::ZERO,
            wall_offset: vec![],
            dummy_offset: vec![],
            wall_area: vec![],
            wall_to_surface: vec![],
            wall_edges: Default::default(),
        };
        Body::new(&solid, 3)
    }

    #[test]
    fn a_tumbling_brick_keeps_momentum_and_energy_to_round_off_at_any_step() {
        // a Dzhanibekov turn of a revolution a second, up to a tenth of one a step
        for (per_turn, steps) in [(10.0, 100_000), (100.0, 100_000), (2000.0, 20_000)] {
            let spin = std::f64::consts::TAU;
            let mut body = brick([false; 3], DVec3::new(0.01, spin, 0.02));
            let (momentum, energy) = (body.momentum, body.kinetic_energy());
            let (mut worst, mut turned) = (0.0_f64, 0.0_f64);
            for _ in 0..steps {
                body.drift(1.0 / per_turn);
                worst = worst.max((body.kinetic_energy() / energy - 1.0).abs());
                turned = turned.max(body.pose.angular_velocity.x.abs());
            }
            assert_eq!(body.momentum, momentum);
            assert!(turned > 1.0, "the intermediate axis is unstable, so the brick must have tumbled");
            assert!(worst < 1e-11, "{per_turn} steps a turn: {worst:e}");
        }
    }

    #[test]
    fn a_tumbling_brick_turns_over_in_the_time_of_eulers_equations() {
        // the time between two turns of the intermediate axis, against steps a hundred times as fine
        let period = |h: f64| {
            let mut body = brick([false; 3], DVec3::new(0.1, 6.0, 0.2));
            let axis = |b: &Body| (b.rotation.transpose() * b.pose.angular_velocity).y;
            let (mut t, mut crossed) = (0.0, vec![]);
            while crossed.len() < 3 {
                let before = axis(&body);
                body.drift(h);
                t += h;
                let now = axis(&body);
                if before.signum() != now.signum() {
                    crossed.push(t - h * now / (now - before));
                }
            }
            crossed[2] - crossed[0]
        };
        let (exact, fine, coarse) = (period(2e-5), period(1e-3), period(2e-3));
        assert!((fine / exact - 1.0).abs() < 1e-4, "{fine} {exact}");
        assert!((fine - exact).abs() < 0.3 * (coarse - exact).abs(), "second order: {fine} {coarse} {exact}");
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
