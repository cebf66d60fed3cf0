//! Motion of walls and bodies by formulas: sines, and the wave that a piston is to make.

use super::{Body, Case, Face, MovingWall, Vector};
use crate::waves::{Component, Formula, Profile, Wanted, Wave, WaveKind};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// A displacement by a sine, R(t) A sin(2 pi t / T + phase) along an axis.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Sine {
    /// Direction (any length).
    pub axis: Vector,
    /// Amplitude A, half of the stroke [m].
    pub amplitude: f64,
    /// Period T [s].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub period: f64,
    /// Phase [degrees].
    #[serde(default)]
    pub phase_deg: f64,
    /// Time over which R grows from 0 to 1, smoothly [s]; 0 for none.
    #[serde(default)]
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub ramp: f64,
}

/// A turn by a sine, R(t) A sin(2 pi t / T + phase) about an axis through `pivot`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Swing {
    /// Axis (any length); along y in two dimensions.
    pub axis: Vector,
    /// Amplitude A [degrees].
    pub amplitude_deg: f64,
    /// Period T [s].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub period: f64,
    /// Phase [degrees].
    #[serde(default)]
    pub phase_deg: f64,
    /// Time over which R grows from 0 to 1, smoothly [s]; 0 for none.
    #[serde(default)]
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub ramp: f64,
}

/// A wave that a wall makes as a piston.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct WaveMaker {
    /// What wave.
    pub kind: WaveKind,
    /// Height from trough to crest [m]: of a solitary wave above still water, of an irregular sea 4 sqrt(m_0).
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub height: f64,
    /// Period [s]; of an irregular sea that of the spectrum's peak. A solitary wave has none.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub period: Option<f64>,
    /// Depth of the still water [m]; that of the block of water at the piston's face if absent.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub depth: Option<f64>,
    /// Horizontal direction in which the piston pushes (any length), along which a face of it looks; [1, 0, 0] if absent.
    pub direction: Option<Vector>,
    /// Time over which the motion grows to its size, smoothly [s]; one `period` if absent.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub ramp: Option<f64>,
    /// Which of the irregular seas; 0 if absent. The same one is the same on every machine; it repeats after 128 periods.
    pub seed: Option<u32>,
    /// Peak enhancement gamma of the JONSWAP spectrum [-]; 3.3 if absent.
    #[cfg_attr(test, schemars(range(min = 1, max = 10)))]
    pub peak_enhancement: Option<f64>,
    /// Shape of a solitary wave; "boussinesq" if absent.
    pub profile: Option<Profile>,
}

/// What moves a solid on a given way, a wall or a body; a wall may make a wave besides.
#[derive(Clone, Copy)]
pub(crate) struct Guide<'a> {
    /// Rows of time [s] and displacement [m].
    pub motion: Option<&'a [[f64; 4]]>,
    pub sine: Option<&'a Sine>,
    /// Rows of time [s] and angles [degrees].
    pub rotation: &'a [[f64; 4]],
    pub swing: Option<&'a Swing>,
    pub pivot: Option<Vector>,
}

impl Guide<'_> {
    /// Whether it turns the solid.
    pub fn turns(&self) -> bool {
        !self.rotation.is_empty() || self.swing.is_some()
    }
}

impl MovingWall {
    /// What moves it, a wave left aside.
    pub(crate) fn guide(&self) -> Guide<'_> {
        Guide {
            motion: Some(&self.motion[..]).filter(|rows| !rows.is_empty()),
            sine: self.sine.as_ref(),
            rotation: &self.rotation,
            swing: self.swing.as_ref(),
            pivot: self.pivot,
        }
    }
}

impl Body {
    /// What moves it instead of forces.
    pub(crate) fn guide(&self) -> Guide<'_> {
        Guide {
            motion: self.motion.as_deref(),
            sine: self.sine.as_ref(),
            rotation: &self.rotation,
            swing: self.swing.as_ref(),
            pivot: self.pivot,
        }
    }
}

fn sine(amplitude: f64, period: f64, phase_deg: f64, ramp: f64) -> Formula {
    let component = Component { amplitude, frequency: TAU / period, phase: phase_deg.to_radians() };
    Formula::sines(vec![component], ramp, period)
}

impl Sine {
    /// The displacement along its axis [m].
    pub(crate) fn formula(&self) -> Formula {
        sine(self.amplitude, self.period, self.phase_deg, self.ramp)
    }
}

impl Swing {
    /// The angle about its axis [rad].
    pub(crate) fn formula(&self) -> Formula {
        sine(self.amplitude_deg.to_radians(), self.period, self.phase_deg, self.ramp)
    }
}

impl WaveMaker {
    /// Where it pushes.
    pub(crate) fn direction(&self) -> Vector {
        self.direction.unwrap_or([1.0, 0.0, 0.0])
    }
}

impl MovingWall {
    /// The wave that it is asked for and makes; `None` if there is none or its numbers do not make one, which the check
    /// says.
    pub(crate) fn wave(&self, case: &Case) -> Option<Wave> {
        let keys = self.wave.as_ref()?;
        let solitary = keys.kind == WaveKind::Solitary;
        let period = if solitary { 0.0 } else { keys.period? };
        let wanted = Wanted {
            kind: keys.kind,
            height: keys.height,
            period,
            depth: keys.depth.or_else(|| self.still_depth(case))?,
            gravity: -case.run.gravity[2],
            ramp: if solitary { 0.0 } else { keys.ramp.unwrap_or(period) },
            seed: keys.seed.unwrap_or(0),
            peak_enhancement: keys.peak_enhancement.unwrap_or(3.3),
            profile: keys.profile.unwrap_or_default(),
        };
        let fine = |x: f64| x.is_finite() && x > 0.0;
        let lengths = [wanted.height, wanted.depth, wanted.gravity, wanted.peak_enhancement];
        let times = [wanted.period, wanted.ramp];
        (lengths.into_iter().all(fine) && (solitary || times.into_iter().all(fine)))
            .then(|| Wave::new(wanted))
    }

    /// Lower and upper corner of it at the start [m], if it is a box that stands straight.
    pub(crate) fn straight_box(&self) -> Option<(Vector, Vector)> {
        let about = |center: Vector, size: Vector| {
            ([0, 1, 2].map(|k| center[k] - 0.5 * size[k]), [0, 1, 2].map(|k| center[k] + 0.5 * size[k]))
        };
        let placed = self
            .center
            .zip(self.size)
            .filter(|_| self.orientation.is_none() && self.shape == super::BodyShape::Box);
        self.corners().or_else(|| placed.map(|(center, size)| about(center, size)))
    }

    /// The normal that is nearest to the direction in which it pushes, of the faces of a box as it stands; of no other shape.
    pub(crate) fn facing(&self) -> Option<DVec3> {
        let direction = DVec3::from(self.wave.as_ref()?.direction());
        let turn = self.form(None).orientation();
        let box_like = self.corners().is_some() || self.shape == super::BodyShape::Box;
        let normals = DVec3::AXES.map(|axis| turn * axis);
        let nearest =
            normals.into_iter().max_by(|a, b| a.dot(direction).abs().total_cmp(&b.dot(direction).abs()));
        nearest.filter(|_| box_like).map(|n| n * n.dot(direction).signum())
    }

    /// Axis and sign of the direction in which it pushes, and where its face is along that axis [m].
    pub(crate) fn face(&self) -> Option<(usize, f64, f64)> {
        let direction = self.wave.as_ref()?.direction();
        let axis = if direction[1].abs() > direction[0].abs() { 1 } else { 0 };
        let (lo, hi) = self.straight_box()?;
        let sign = direction[axis].signum();
        Some((axis, sign, if sign > 0.0 { hi[axis] } else { lo[axis] }))
    }

    /// Whether ground is under it, a box from `lo` to `hi` [m]: an obstacle that reaches up to it, or one or a plane whose reach no box tells.
    fn stands_on(&self, case: &Case, lo: Vector, hi: Vector) -> bool {
        let l0 = case.run.spacing;
        let flat = case.run.dimensions == 2;
        let under = |o: &super::Obstacle| {
            o.corners().is_none_or(|(min, max)| {
                let over = |k: usize| min[k] < hi[k] + l0 && max[k] > lo[k] - l0;
                over(0) && (flat || over(1)) && (max[2] - lo[2]).abs() < 1.5 * l0
            })
        };
        !case.plane.is_empty() || case.obstacle.iter().any(under)
    }

    /// Depth of the water that stands before its face at the start [m], from the blocks there and the tank's floor, or from
    /// the fill that begins nearest to it and what it stands on.
    fn still_depth(&self, case: &Case) -> Option<f64> {
        let (axis, sign, face) = self.face()?;
        let (lo, hi) = self.straight_box()?;
        let (across, near) = (1 - axis, 1.5 * case.run.spacing);
        let flat = case.run.dimensions == 2;
        let beside = |b: &&super::Block| {
            let (back, front) =
                if sign > 0.0 { (b.min[axis], b.max[axis]) } else { (-b.max[axis], -b.min[axis]) };
            back <= sign * face + near
                && front > sign * face
                && (flat || b.min[across] < hi[across] && b.max[across] > lo[across])
        };
        let blocks = case.fluid.iter().flat_map(|f| &f.block).filter(beside);
        let (floor, level) =
            blocks.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x.min[2]), b.max(x.max[2])));
        let tank = case.tank.as_ref().filter(|t| !t.open.contains(&Face::ZMin)).map(|t| t.min[2]);
        // Of fills that of the nearest seed before the face, which may lie on a block. It begins at the ground under the piston.
        let ahead = |f: &&super::Fill| sign * (f.seed[axis] - face);
        let fills = case.fluid.iter().flat_map(|f| &f.fill).filter(|f| ahead(f) > 0.0);
        let off = |f: &&super::Fill| {
            let beside = if flat {
                0.0
            } else {
                (lo[across] - f.seed[across]).max(f.seed[across] - hi[across]).max(0.0)
            };
            ahead(f).hypot(beside)
        };
        let filled = fills.min_by(|a, b| off(a).total_cmp(&off(b))).map(|f| f.level);
        let bed =
            level.is_finite().then_some(floor).or_else(|| self.stands_on(case, lo, hi).then_some(lo[2]));
        let bed = bed.into_iter().chain(tank).reduce(f64::max).or(filled.map(|_| lo[2]))?;
        Some(filled.map_or(level, |filled| filled.max(level)) - bed).filter(|depth| *depth > 0.0)
    }
}
