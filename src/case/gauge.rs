//! What is measured over time.

use super::Vector;
use serde::{Deserialize, Serialize};

/// Measurements over time; all go to gauges.csv.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Gauges {
    /// Interval between rows [s]; every step if absent.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub every: Option<f64>,
    /// Pressures and forces of a row are means over the steps since the row before, each with its length, and not those of the last step.
    /// What is read of the water itself (levels, velocities, volumes) is of the moment.
    pub mean: bool,
    /// Pressure on what stays where it is, a wall of the tank, an obstacle, a body that is held: mean over the wall particles within half an
    /// effective radius of the point.
    pub pressure: Vec<PressureGauge>,
    /// Height of the water surface along a vertical line.
    pub level: Vec<LevelGauge>,
    /// Force and torque of the fluid on a body or wall; where bodies move, those of other solids as well.
    pub force: Vec<ForceGauge>,
    /// Velocity of the water at a point.
    pub velocity: Vec<VelocityGauge>,
    /// Volume of the water in a box: behind a crest, that of overtopping.
    pub volume: Vec<VolumeGauge>,
}

impl Gauges {
    /// The kinds of gauges, each with the names of its own.
    pub(super) fn names(&self) -> [(&'static str, Vec<&str>); 5] {
        let Self { every: _, mean: _, pressure, level, force, velocity, volume } = self;
        [
            ("pressure", pressure.iter().map(|g| g.name.as_str()).collect()),
            ("level", level.iter().map(|g| g.name.as_str()).collect()),
            ("force", force.iter().map(|g| g.name.as_str()).collect()),
            ("velocity", velocity.iter().map(|g| g.name.as_str()).collect()),
            ("volume", volume.iter().map(|g| g.name.as_str()).collect()),
        ]
    }
}

/// Pressure at a point on a wall, or on a solid, with which it moves.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PressureGauge {
    /// Name, used in the header.
    #[cfg_attr(test, schemars(length(min = 1, max = 80)))]
    pub name: String,
    /// Point on a wall, a body or a moving wall as it lies at the start [m]; it goes and turns with what it is on.
    pub point: Vector,
}

/// Water level on a line along z.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct LevelGauge {
    /// Name, used in the header.
    #[cfg_attr(test, schemars(length(min = 1, max = 80)))]
    pub name: String,
    /// x, y of the line [m].
    pub at: [f64; 2],
}

/// Force on a solid.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ForceGauge {
    /// Name, used in the header.
    #[cfg_attr(test, schemars(length(min = 1, max = 80)))]
    pub name: String,
    /// Name of a body, moving wall, obstacle or plane, or of a face of the tank such as `tank.z_min`. `*` stands for any letters
    /// (`"pile_*"`), `tank` for all of its faces: the gauge then is the sum over all of them. Torque is about
    /// the centre of mass, or the place on its hinge, or the middle of a fixed wall; of a face of the tank that of its surface, of a plane its `center`, of a sum the origin. Where another solid stands before a
    /// part of it no water presses; under a free body that stands on it the water of the slot does.
    pub on: String,
}

/// Velocity at a point in the water.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct VelocityGauge {
    /// Name, used in the header.
    #[cfg_attr(test, schemars(length(min = 1, max = 80)))]
    pub name: String,
    /// Point [m]; while there is no water, the cells are empty.
    pub point: Vector,
}

/// Water in a box, such as what has come over a crest.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct VolumeGauge {
    /// Name, used in the header.
    #[cfg_attr(test, schemars(length(min = 1, max = 80)))]
    pub name: String,
    /// Lower corner of the box [m].
    pub min: Vector,
    /// Upper corner of the box [m].
    pub max: Vector,
}
