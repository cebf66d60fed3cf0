//! Files to write: which particles, how often, how.

use super::Vector;
use serde::{Deserialize, Serialize};

/// Which particles an output holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum OutputKind {
    /// Fluid particles, every frame.
    Fluid,
    /// Particles of bodies and moving walls, every frame.
    Body,
    /// Fixed walls, once.
    Wall,
    /// Dummies of fixed walls, once.
    Dummy,
}

/// A field of particles in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum OutputField {
    /// `Velocity` [m/s].
    Velocity,
    /// `Pressure` [Pa].
    Pressure,
    /// `ParticleNumberDensity` [-].
    NumberDensity,
    /// `Kind`: 0 fluid, 1 wall, 2 dummy, 3 body wall, 4 body dummy.
    Kind,
    /// `Body`: 0 none, then the solids in the order of bodies.csv.
    Body,
    /// `Id`, which stays with a particle.
    Id,
}

impl OutputField {
    /// All fields, in the order of a file.
    pub const ALL: [Self; 6] =
        [Self::Velocity, Self::Pressure, Self::NumberDensity, Self::Kind, Self::Body, Self::Id];

    /// Bytes of a particle.
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::Velocity => 12,
            Self::Kind => 1,
            Self::Pressure | Self::NumberDensity | Self::Body | Self::Id => 4,
        }
    }
}

/// A box of which frames are written.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct OutputRegion {
    /// Its lower corner [m].
    pub min: Vector,
    /// Its upper corner [m].
    pub max: Vector,
}

/// Encoding of VTU arrays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// Appended base64, zlib: read by ParaView, meshio and splashsurf.
    #[default]
    Base64,
    /// Appended raw: smallest and fastest, read by ParaView.
    Raw,
}

/// Files to write.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Interval between frames [s]; 0 writes no frames.
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub every: f64,
    /// Which particles to write.
    #[cfg_attr(test, schemars(transform = super::bounds::each_once))]
    pub kinds: Vec<OutputKind>,
    /// Fields of the particles to write beside their positions; all of them if absent. Files of bodies and moving walls hold `body` and
    /// `id` in any case: their places are read from them.
    #[cfg_attr(test, schemars(transform = super::bounds::each_once))]
    pub fields: Vec<OutputField>,
    /// Write only the water and the fixed walls within this box; everywhere if absent. Bodies and moving walls are written whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region: Option<OutputRegion>,
    /// Encoding of the VTU files.
    pub encoding: Encoding,
    /// Interval between rows of bodies.csv and monitors.csv [s]; every step if absent. On a GPU the largest speeds of the run and its
    /// verdict then know these steps and each tenth alone.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub table_every: Option<f64>,
    /// Keep the energy ledger: the work of every stage in monitors.csv and result.json.
    pub ledger: bool,
    /// More frames, each of its own choice and interval, beside those of `[output]`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub series: Vec<Series>,
}

/// Frames of another choice and interval: the folder `series/NAME` of the results holds them as the results hold those of `[output]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Series {
    /// Name of the folder and of the list of frames: letters, digits, `-` and `_`.
    #[cfg_attr(test, schemars(length(min = 1, max = 80)))]
    pub name: String,
    /// Interval between frames [s].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub every: f64,
    /// Which particles to write.
    #[serde(default = "kinds")]
    #[cfg_attr(test, schemars(transform = super::bounds::each_once))]
    pub kinds: Vec<OutputKind>,
    /// Fields of the particles to write beside their positions; all of them if absent. Files of bodies and moving walls hold `body` and
    /// `id` in any case.
    #[serde(default = "fields")]
    #[cfg_attr(test, schemars(transform = super::bounds::each_once))]
    pub fields: Vec<OutputField>,
    /// Write only the water and the fixed walls within this box; everywhere if absent. Bodies and moving walls are written whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region: Option<OutputRegion>,
}

/// What a series of frames holds, that of `[output]` or a named one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Choice<'a> {
    /// Interval [s]; 0 for none.
    pub every: f64,
    pub kinds: &'a [OutputKind],
    pub fields: &'a [OutputField],
    pub region: Option<OutputRegion>,
}

impl Output {
    /// What the frames of `[output]` hold.
    pub(crate) fn choice(&self) -> Choice<'_> {
        Choice { every: self.every, kinds: &self.kinds, fields: &self.fields, region: self.region }
    }
}

impl Series {
    /// What its frames hold.
    pub(crate) fn choice(&self) -> Choice<'_> {
        Choice { every: self.every, kinds: &self.kinds, fields: &self.fields, region: self.region }
    }
}

impl Choice<'_> {
    pub fn has(&self, kind: OutputKind) -> bool {
        self.kinds.contains(&kind)
    }
}

pub(super) fn kinds() -> Vec<OutputKind> {
    vec![OutputKind::Fluid, OutputKind::Body, OutputKind::Wall]
}

fn fields() -> Vec<OutputField> {
    OutputField::ALL.to_vec()
}

impl Default for Output {
    fn default() -> Self {
        Self {
            every: 0.05,
            kinds: kinds(),
            fields: fields(),
            region: None,
            encoding: Encoding::Base64,
            table_every: None,
            ledger: false,
            series: Vec::new(),
        }
    }
}
