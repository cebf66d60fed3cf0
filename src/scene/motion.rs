//! Prescribed motion: tables or formulas of displacement and of angles.

use super::Curve;
use crate::waves::{Formula, Wave};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// A motion over time: the displacement of the place that a solid turns about, and how it is turned about that. Tables
/// are smooth, see [`Curve`]; formulas are what they are, see [`Formula`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    displacement: Way,
    rotation: Option<Rotation>,
    /// The wave that it makes, if it was asked for one.
    wave: Option<Box<Wave>>,
}

/// A displacement [m] over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Way {
    Table(Curve),
    /// Along a direction of length 1.
    Formula(DVec3, Formula),
}

/// The turning part of a motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Rotation {
    turning: Turning,
    /// From the place that it turns about to the solid's centre at the start [m].
    arm: DVec3,
}

/// How a solid is turned [rad] over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Turning {
    /// By angles about the axes x, y and z of the world, in this order.
    Table(Curve),
    /// About an axis of length 1.
    Formula(DVec3, Formula),
}

/// Largest turn between two of [`Motion::samples`] [rad].
const SAMPLE: f64 = 0.05;
/// Fewest of them an interval.
const SAMPLES: f64 = 8.0;
/// Share of a table's largest speed that a jump at its ends may have without a word.
const JUMP: f64 = 0.1;

impl Motion {
    /// A motion without a turn: displacement from the start [m] over time.
    pub fn shift(displacement: Curve) -> Self {
        Self { displacement: Way::Table(displacement), rotation: None, wave: None }
    }

    /// No motion.
    pub fn still() -> Self {
        Self::shift(Curve::new(vec![0.0], vec![DVec3::ZERO]))
    }

    /// A motion without a turn along `direction` (of any length) by a formula [m].
    pub fn along(direction: DVec3, formula: Formula) -> Self {
        let displacement = Way::Formula(direction.normalize_or_zero(), formula);
        Self { displacement, rotation: None, wave: None }
    }

    /// The motion of a piston that pushes a wave along `direction` (of any length).
    pub fn making(wave: Wave, direction: DVec3) -> Self {
        Self { wave: Some(Box::new(wave.clone())), ..Self::along(direction, wave.formula) }
    }

    /// The same, turned by `angles` [rad] about a place from which the solid's centre is `arm` [m] away at the start.
    pub fn turned(self, angles: Curve, arm: DVec3) -> Self {
        Self { rotation: Some(Rotation { turning: Turning::Table(angles), arm }), ..self }
    }

    /// The same, turned about an `axis` (of any length) by a formula [rad], with an `arm` as of [`Self::turned`].
    pub fn swinging(self, axis: DVec3, angle: Formula, arm: DVec3) -> Self {
        let turning = Turning::Formula(axis.normalize_or_zero(), angle);
        Self { rotation: Some(Rotation { turning, arm }), ..self }
    }

    /// The wave that it makes, if it was asked for one.
    pub fn wave(&self) -> Option<&Wave> {
        self.wave.as_deref()
    }

    /// Whether nothing ever moves.
    pub fn is_still(&self) -> bool {
        self.displacement.is_still() && !self.turns()
    }

    /// Whether it turns.
    pub fn turns(&self) -> bool {
        self.rotation.as_ref().is_some_and(|r| !r.turning.is_still())
    }

    /// Displacement of the solid's centre [m] at time `t` [s].
    pub fn displacement(&self, t: f64) -> DVec3 {
        let place = self.displacement.value(t);
        self.rotation.as_ref().map_or(place, |r| place + r.turning.turn(t) * r.arm - r.arm)
    }

    /// Turn from the start's orientation, world axes, at time `t` [s].
    pub fn turn(&self, t: f64) -> DQuat {
        self.rotation.as_ref().map_or(DQuat::IDENTITY, |r| r.turning.turn(t))
    }

    /// Velocity of the solid's centre [m/s] and its angular velocity [rad/s] just after time `t` [s].
    pub fn velocity(&self, t: f64) -> (DVec3, DVec3) {
        let velocity = self.displacement.rate(t);
        let Some(r) = &self.rotation else { return (velocity, DVec3::ZERO) };
        let spin = r.turning.spin(t);
        (velocity + spin.cross(r.turning.turn(t) * r.arm), spin)
    }

    /// Largest speed [m/s] of any point within `radius` [m] of the solid's centre between the times `from` and `to`
    /// [s], or a little more.
    pub fn fastest(&self, from: f64, to: f64, radius: f64) -> f64 {
        let turning = |r: &Rotation| r.turning.fastest(from, to) * (r.arm.length() + radius);
        self.displacement.fastest(from, to) + self.rotation.as_ref().map_or(0.0, turning)
    }

    /// What a reader of the tables' rows may not expect before `end` [s]: jumps of the velocity at the first and the last row.
    pub(super) fn abrupt(&self, end: f64) -> Vec<String> {
        let way = if let Way::Table(curve) = &self.displacement { Some((curve, 1.0, "m/s")) } else { None };
        let turn = match self.rotation.as_ref().map(|r| &r.turning) {
            Some(Turning::Table(curve)) => Some((curve, 1_f64.to_degrees(), "degrees/s")),
            _ => None,
        };
        way.into_iter()
            .chain(turn)
            .filter_map(|(curve, scale, unit)| abrupt(curve, end, scale, unit))
            .collect()
    }

    /// Whether the velocity changes between `t` and `t + dt` [s].
    pub(crate) fn bends(&self, t: f64, dt: f64) -> bool {
        self.turns() || self.displacement.bends(t, dt)
    }

    /// Displacements [m] of the solid's centre and turns that between them show all of where the solid comes to.
    pub fn poses(&self) -> Vec<(DVec3, DQuat)> {
        let (ways, turns) = match (&self.displacement, self.rotation.as_ref().map(|r| &r.turning)) {
            (Way::Table(way), None | Some(Turning::Table(_))) => {
                let at = |t: f64| (self.displacement(t), self.turn(t));
                return self.times(way).into_iter().map(at).collect();
            }
            (Way::Formula(direction, way), None) => {
                return way.samples().into_iter().map(|x| (x * *direction, DQuat::IDENTITY)).collect();
            }
            (Way::Table(way), Some(Turning::Formula(axis, angle))) => (way.corners(), swings(*axis, angle)),
            (Way::Formula(direction, way), Some(Turning::Formula(axis, angle))) => {
                (way.reach().map(|x| x * *direction).to_vec(), swings(*axis, angle))
            }
            (Way::Formula(direction, way), Some(turning @ Turning::Table(angles))) => {
                let turns = self.times(angles).into_iter().map(|t| turning.turn(t));
                (way.reach().map(|x| x * *direction).to_vec(), turns.collect())
            }
        };
        // The two do not keep step: any place may meet any turn.
        let arm = self.rotation.as_ref().map_or(DVec3::ZERO, |r| r.arm);
        let pose = |way: DVec3, turn: DQuat| (way + turn * arm - arm, turn);
        ways.iter().flat_map(|&way| turns.iter().map(move |&turn| pose(way, turn))).collect()
    }

    /// Times [s] that between them show all of where tables lead.
    fn times(&self, of: &Curve) -> Vec<f64> {
        let angles = match self.rotation.as_ref().map(|r| &r.turning) {
            Some(Turning::Table(angles)) => Some(angles),
            _ => None,
        };
        let mut times = of.times().to_vec();
        times.extend(angles.iter().flat_map(|angles| angles.times()));
        times.sort_by(f64::total_cmp);
        times.dedup();
        let turned = |from: f64, to: f64| angles.map_or(0.0, |angles| angles.fastest(from, to) * (to - from));
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

/// Turns about an axis that show all of where a formula leads.
fn swings(axis: DVec3, angle: &Formula) -> Vec<DQuat> {
    let [low, high] = angle.reach();
    let count = ((high - low) / SAMPLE).ceil().clamp(1.0, 1e4);
    let at = |k: u32| DQuat::from_axis_angle(axis, low + (high - low) * f64::from(k) / count);
    (0..=count as u32).map(at).collect()
}

/// What [`Motion::abrupt`] says of a table, whose values are told times `scale` in `unit`.
fn abrupt(curve: &Curve, end: f64, scale: f64, unit: &str) -> Option<String> {
    let slopes = curve.ends()?;
    let (times, fastest) = (curve.times(), curve.fastest(f64::MIN, f64::MAX));
    let (first, last) = (times.first()?, times.last()?);
    let mut told = Vec::new();
    let jumps = |slope: DVec3| slope.length() > JUMP * fastest;
    if jumps(slopes[0]) && *first < end {
        told.push(format!("begins with {:.3} {unit} at t = {first} s", scale * slopes[0].length()));
    }
    if jumps(slopes[1]) && *last < end {
        told.push(format!(
            "stops from {:.3} {unit} at t = {last} s within a step",
            scale * slopes[1].length()
        ));
    }
    (!told.is_empty()).then(|| {
        format!(
            "its table {} (it goes at up to {:.3} {unit}); two rows of one place at an end are rest",
            told.join(", "),
            scale * fastest
        )
    })
}

impl Way {
    fn is_still(&self) -> bool {
        match self {
            Self::Table(curve) => curve.is_constant(),
            Self::Formula(_, formula) => formula.is_still(),
        }
    }

    fn value(&self, t: f64) -> DVec3 {
        match self {
            Self::Table(curve) => curve.value(t),
            Self::Formula(direction, formula) => formula.value(t) * *direction,
        }
    }

    fn rate(&self, t: f64) -> DVec3 {
        match self {
            Self::Table(curve) => curve.rate(t),
            Self::Formula(direction, formula) => formula.rate(t) * *direction,
        }
    }

    fn fastest(&self, from: f64, to: f64) -> f64 {
        match self {
            Self::Table(curve) => curve.fastest(from, to),
            Self::Formula(_, formula) => formula.fastest(from, to),
        }
    }

    fn bends(&self, t: f64, dt: f64) -> bool {
        match self {
            Self::Table(curve) => curve.bends(t, dt),
            Self::Formula(_, formula) => !formula.is_still(),
        }
    }
}

impl Turning {
    fn is_still(&self) -> bool {
        match self {
            Self::Table(curve) => curve.is_constant(),
            Self::Formula(_, formula) => formula.is_still(),
        }
    }

    fn turn(&self, t: f64) -> DQuat {
        match self {
            Self::Table(curve) => {
                let angles = curve.value(t);
                DQuat::from_rotation_z(angles.z)
                    * DQuat::from_rotation_y(angles.y)
                    * DQuat::from_rotation_x(angles.x)
            }
            Self::Formula(axis, formula) => DQuat::from_axis_angle(*axis, formula.value(t)),
        }
    }

    fn spin(&self, t: f64) -> DVec3 {
        match self {
            Self::Table(curve) => {
                let (angles, rate) = (curve.value(t), curve.rate(t));
                let about_z = DQuat::from_rotation_z(angles.z);
                let about_y = about_z * DQuat::from_rotation_y(angles.y);
                rate.z * DVec3::Z + about_z * (rate.y * DVec3::Y) + about_y * (rate.x * DVec3::X)
            }
            Self::Formula(axis, formula) => formula.rate(t) * *axis,
        }
    }

    /// Largest angular speed [rad/s], or a little more.
    fn fastest(&self, from: f64, to: f64) -> f64 {
        match self {
            // about three axes that need not be at right angles
            Self::Table(curve) => 3.0_f64.sqrt() * curve.fastest(from, to),
            Self::Formula(_, formula) => formula.fastest(from, to),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waves::Component;

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

    #[test]
    fn formulas_swing_about_any_axis_and_their_poses_hold_all_places() {
        let of = |amplitude: f64, period: f64, phase: f64| {
            let frequency = std::f64::consts::TAU / period;
            Formula::sines(vec![Component { amplitude, frequency, phase }], 1.0, period)
        };
        let rows = Curve::new(vec![0.0, 1.0, 2.5], vec![DVec3::ZERO, DVec3::new(0.2, 0.0, 0.3), DVec3::X]);
        let arm = DVec3::new(0.1, 0.4, -0.2);
        let axis = DVec3::new(1.0, 2.0, -0.5);
        let swing = of(0.7, 1.1, 0.3);
        for motion in [
            Motion::along(DVec3::new(3.0, 0.0, 4.0), of(0.1, 0.9, 1.0)).swinging(axis, swing.clone(), arm),
            Motion::shift(rows.clone()).swinging(axis, swing, arm),
            Motion::along(DVec3::X, of(0.1, 0.9, 1.0)).turned(rows, arm),
        ] {
            let (h, point) = (1e-6, DVec3::new(0.1, 0.2, -0.3));
            let poses = motion.poses();
            let bounds = |of: &mut dyn Iterator<Item = DVec3>| {
                of.fold((DVec3::MAX, DVec3::MIN), |(a, b), x| (a.min(x), b.max(x)))
            };
            let held = bounds(&mut poses.iter().map(|(way, turn)| *way + *turn * point));
            for k in 0..700 {
                let t = 0.01 * f64::from(k) + 3e-3;
                let at = |t: f64| motion.displacement(t) + motion.turn(t) * point;
                let slope = (at(t + h) - at(t - h)) / (2.0 * h);
                let (velocity, spin) = motion.velocity(t);
                let speed = velocity + spin.cross(motion.turn(t) * point);
                assert!((slope - speed).length() < 1e-5, "{t}: {slope} {speed}");
                assert!(speed.length() <= motion.fastest(t, t + 1e-3, point.length()) + 1e-9);
                let slack = DVec3::splat(2e-3);
                assert!(at(t).cmpge(held.0 - slack).all() && at(t).cmple(held.1 + slack).all(), "{t}");
            }
        }
    }
}
