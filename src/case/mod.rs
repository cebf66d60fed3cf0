//! The case file as a user types it: TOML, SI units, unknown keys refused.
//!
//! The structs here are the schema (`seixo schema` prints it). `file` reads and overrides, `check` judges what serde cannot.

mod absorber;
#[cfg(test)]
mod bounds;
mod brackets;
pub mod check;
mod check_gauges;
mod check_geometry;
mod check_motion;
mod check_slips;
mod check_solids;
mod coarse;
mod contact;
mod copies;
pub mod file;
mod fluid;
mod gauge;
mod motion_file;
mod names;
mod opening;
mod output;
mod overrides;
mod pace;
mod report;
mod scatter;
mod section;
mod shape;
mod solid;
mod surplus;
mod tank;
mod values;
mod water;
mod wave;

pub use absorber::Absorber;
pub(crate) use check::face;
pub(crate) use coarse::coarse;
pub use contact::{Contact, ContactDevice, ContactPair, Law};
pub use copies::{Array, Written};
pub use fluid::{Block, Fluid, Preconditioner, Preset, Solver};
pub use gauge::{ForceGauge, Gauges, LevelGauge, PressureGauge, VelocityGauge};
pub(crate) use names::{is_pattern, stands_for};
pub(crate) use opening::{HURRY, OpeningKeys, room_behind};
pub use opening::{Inflow, OUTFLOWS_MAX, Outflow, Rate};
pub(crate) use output::Choice;
pub use output::{Encoding, Output, OutputField, OutputKind, OutputRegion, Series};
pub(crate) use pace::FALL_MAX;
pub use scatter::{Scatter, Turned};
pub use shape::BodyShape;
pub(crate) use shape::{Form, Place, Wall};
pub use solid::{Body, Freedom, Hinge, MovingWall, Turn};
pub(crate) use tank::TANK_FACES;
pub use tank::{Axis, Face, Obstacle, Plane, Tank};
pub use water::{Fill, WaterShape};
pub(crate) use wave::Guide;
pub use wave::{Sine, Swing, WaveMaker};

use serde::{Deserialize, Serialize};

/// Names of the axes.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// A three-component vector as written in a case file.
pub type Vector = [f64; 3];

/// Three rows of x, y, z.
pub type Matrix = [Vector; 3];

/// A case: one experiment. All quantities in SI units.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Resolution, time and gravity.
    pub run: Run,
    /// The fluid and the scheme that moves it. Leave out for a dry scene.
    pub fluid: Option<Fluid>,
    /// A rectangular container.
    pub tank: Option<Tank>,
    /// Fixed solids.
    #[serde(default)]
    pub obstacle: Vec<Obstacle>,
    /// Fixed flat walls at any angle.
    #[serde(default)]
    pub plane: Vec<Plane>,
    /// Walls that follow a table or a formula of motion.
    #[serde(default)]
    pub moving_wall: Vec<MovingWall>,
    /// Boxes in which the water comes to rest, for waves that must not come back.
    #[serde(default)]
    pub absorber: Vec<Absorber>,
    /// Walls of the tank that emit water.
    #[serde(default)]
    pub inflow: Vec<Inflow>,
    /// Walls of the tank that swallow water, and holes that it falls through.
    #[serde(default)]
    pub outflow: Vec<Outflow>,
    /// Rigid bodies.
    #[serde(default)]
    pub body: Vec<Body>,
    /// Contact between solids. Needed as soon as a body can move.
    pub contact: Option<Contact>,
    /// Measurements over time.
    #[serde(default)]
    pub gauge: Gauges,
    /// Files to write.
    #[serde(default)]
    pub output: Output,
    /// Where solids were written that stand in tables for several.
    #[serde(skip)]
    pub written: Written,
}

/// Resolution, time and gravity.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Initial distance between particles l0 [m].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub spacing: f64,
    /// Time step [s]; the largest one when `adaptive = true`. If absent 0.15 sqrt(l0 / g) where there is a fluid, and `adaptive` holds; in a dry scene
    /// 0.02 sqrt(l0 / g), less where solids start or are driven along faster than a third of a spacing in it (turns left out). Without gravity it must be given.
    #[serde(default = "Run::no_time_step", skip_serializing_if = "Run::is_absent")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub time_step: f64,
    /// Shrink the time step below `time_step` where the flow asks for it: dt <= 0.35 l0 / v, but for the fastest thousandth of the
    /// water, which is taken to become 1.4 times as fast, up to a collapse's 2 sqrt(g H); dt <= 0.6 l0 / sqrt(g H), 0.15 sqrt(l0 / g)
    /// and, with a typed `sound_speed`, 0.7 l0 / c_s.
    #[serde(default)]
    pub adaptive: bool,
    /// End of the run [s].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub end: f64,
    /// Gravity [m/s2].
    #[serde(default = "Run::default_gravity")]
    pub gravity: Vector,
    /// 3, or 2 for the plane y = 0 (a slice one spacing wide).
    #[serde(default = "Run::default_dimensions")]
    #[cfg_attr(test, schemars(extend("enum" = [2, 3])))]
    pub dimensions: u32,
    /// Lower and upper corner of the box that no particle may leave [m]. Derived from the walls if absent.
    pub domain: Option<[Vector; 2]>,
    /// Effective radius over the spacing, re / l0 [-].
    #[serde(default = "Run::default_effective_radius")]
    #[cfg_attr(test, schemars(range(min = 1.5, max = 4.1)))]
    pub effective_radius: f64,
    /// When the state is saved, so that a run that was stopped goes on where it was.
    #[serde(default)]
    pub checkpoint: Checkpoint,
    /// Folder of an earlier run whose last state is the start of this one, instead of t = 0; a relative one counts
    /// from the case file. Scene and processor must be the same; a later end, gauges, output, constants, and
    /// from then on motions may differ.
    pub from: Option<String>,
}

/// Intervals between checkpoints; there is one at the end, too, and when a signal stops a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Checkpoint {
    /// Simulated time between checkpoints [s]; none by simulated time if absent.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub every: Option<f64>,
    /// Wall-clock time between checkpoints [s]; 0 for none, nor at the end, unless `every` is given.
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub wall: f64,
}

impl Default for Checkpoint {
    fn default() -> Self {
        Self { every: None, wall: 600.0 }
    }
}

impl Run {
    fn no_time_step() -> f64 {
        f64::NAN
    }
    fn is_absent(time_step: &f64) -> bool {
        time_step.is_nan()
    }
    fn default_gravity() -> Vector {
        [0.0, 0.0, -9.80665]
    }
    fn default_dimensions() -> u32 {
        3
    }
    fn default_effective_radius() -> f64 {
        2.1
    }
}
