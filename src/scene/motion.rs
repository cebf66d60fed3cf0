//! Prescribed motion: tables of displacement and of angles.

use super::Curve;
use glam::{DQuat, DVec3};

/// A motion given by tables over time: the displacement of the place that a solid turns about, and the angles that it is
/// turned by about the axes x, y and z of the world, in this order. Both are smooth, see [`Curve`].
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    displacement: Curve,
    rotation: Option<Rotation>,
}

/// The turning part of a motion.
#[derive(Clone, Debug, PartialEq)]
struct Rotation {
    /// Angles about x, y and z [rad].
    angles: Curve,
    /// From the place that it turns about to the solid's centre at the start [m].
    arm: DVec3,
}

/// Largest turn between two of [`Motion::samples`] [rad].
const SAMPLE: f64 = 0.05;
/// Fewest of them an interval.
const SAMPLES: f64 = 8.0;

impl Motion {
    /// A motion without a turn: displacement from the start [m] over time.
    pub fn shift(displacement: Curve) -> Self {
        Self { displacement, rotation: None }
    }

    /// The same, turned by `angles` [rad] about a place from which the solid's centre is `arm` [m] away at the start.
    pub fn turned(self, angles: Curve, arm: DVec3) -> Self {
        Self { rotation: Some(Rotation { angles, arm }), ..self }
    }

    /// Whether nothing ever moves.
    pub fn is_still(&self) -> bool {
        self.displacement.is_constant() && !self.turns()
    }

    /// Whether it turns.
    pub fn turns(&self) -> bool {
        self.rotation.as_ref().is_some_and(|r| !r.angles.is_constant())
    }

    /// Displacement of the solid's centre [m] at time `t` [s].
    pub fn displacement(&self, t: f64) -> DVec3 {
        let place = self.displacement.value(t);
        self.rotation.as_ref().map_or(place, |r| place + r.turn(t) * r.arm - r.arm)
    }

    /// Turn from the start's orientation, world axes, at time `t` [s].
    pub fn turn(&self, t: f64) -> DQuat {
        self.rotation.as_ref().map_or(DQuat::IDENTITY, |r| r.turn(t))
    }

    /// Velocity of the solid's centre [m/s] and its angular velocity [rad/s] just after time `t` [s].
    pub fn velocity(&self, t: f64) -> (DVec3, DVec3) {
        let velocity = self.displacement.rate(t);
        let Some(r) = &self.rotation else { return (velocity, DVec3::ZERO) };
        let spin = r.spin(t);
        (velocity + spin.cross(r.turn(t) * r.arm), spin)
    }

    /// Largest speed [m/s] of any point within `radius` [m] of the solid's centre between the times `from` and `to`
    /// [s], or a little more.
    pub fn fastest(&self, from: f64, to: f64, radius: f64) -> f64 {
        let turning = |r: &Rotation| {
            // about three axes that need not be at right angles
            3.0_f64.sqrt() * r.angles.fastest(from, to) * (r.arm.length() + radius)
        };
        self.displacement.fastest(from, to) + self.rotation.as_ref().map_or(0.0, turning)
    }

    /// Whether the velocity changes between `t` and `t + dt` [s].
    pub(crate) fn bends(&self, t: f64, dt: f64) -> bool {
        self.turns() || self.displacement.bends(t, dt)
    }

    /// Times [s] that between them show all of where the solid comes to.
    pub fn samples(&self) -> Vec<f64> {
        let mut times = self.displacement.times().to_vec();
        times.extend(self.rotation.iter().flat_map(|r| r.angles.times()));
        times.sort_by(f64::total_cmp);
        times.dedup();
        let turned = |from: f64, to: f64| {
            self.rotation.as_ref().map_or(0.0, |r| r.angles.fastest(from, to) * (to - from))
        };
        let within = times.windows(2).flat_map(|w| {
            let count = (turned(w[0], w[1]) / SAMPLE).max(SAMPLES).ceil();
            let (from, step) = (w[0], (w[1] - w[0]) / count);
            (1..count as u32).map(move |k| from + f64::from(k) * step)
        });
        let within: Vec<f64> = within.collect();
        times.extend(within);
        times
    }
}

impl Rotation {
    fn turn(&self, t: f64) -> DQuat {
        let angles = self.angles.value(t);
        DQuat::from_rotation_z(angles.z) * DQuat::from_rotation_y(angles.y) * DQuat::from_rotation_x(angles.x)
    }

    fn spin(&self, t: f64) -> DVec3 {
        let (angles, rate) = (self.angles.value(t), self.angles.rate(t));
        let about_z = DQuat::from_rotation_z(angles.z);
        let about_y = about_z * DQuat::from_rotation_y(angles.y);
        rate.z * DVec3::Z + about_z * (rate.y * DVec3::Y) + about_y * (rate.x * DVec3::X)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_are_the_slopes_of_place_and_turn() {
        let time: Vec<f64> = (0..8).map(|k| 0.3 * f64::from(k)).collect();
        let of = |scale: f64| {
            let at = |t: &f64| scale * DVec3::new(t * t, (2.0 * t).sin(), (3.0 * t).sin() - t);
            Curve::new(time.clone(), time.iter().map(at).collect())
        };
        let motion = Motion::shift(of(0.2)).turned(of(1.5), DVec3::new(0.3, -0.2, 0.1));
        assert!(motion.turns() && motion.displacement(0.0).length() < 1e-15);
        let (h, point) = (1e-6, DVec3::new(0.1, 0.2, -0.3));
        for k in 0..200 {
            let t = 0.01 * f64::from(k) + 3e-3;
            let at = |t: f64| motion.displacement(t) + motion.turn(t) * point;
            let slope = (at(t + h) - at(t - h)) / (2.0 * h);
            let (velocity, spin) = motion.velocity(t);
            let speed = velocity + spin.cross(motion.turn(t) * point);
            assert!((slope - speed).length() < 1e-6, "{t}: {slope} {speed}");
            assert!(speed.length() <= motion.fastest(t, t + 1e-3, point.length()) + 1e-9);
            let after = motion.velocity(t + 1e-7);
            assert!((after.0 - velocity).length() + (after.1 - spin).length() < 1e-4, "it jumps at {t}");
        }
    }
}
