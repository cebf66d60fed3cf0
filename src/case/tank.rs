//! What never moves: the tank, obstacles, planes.

use super::{Array, BodyShape, Scatter, Turn, Vector};
use serde::{Deserialize, Serialize};

/// A face of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Face {
    /// Smallest x.
    XMin,
    /// Largest x.
    XMax,
    /// Smallest y.
    YMin,
    /// Largest y.
    YMax,
    /// Smallest z.
    ZMin,
    /// Largest z.
    ZMax,
}

/// An axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
}

/// A rectangular container; walls outside of `min`..`max`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Tank {
    /// Lower inner corner [m].
    pub min: Vector,
    /// Upper inner corner [m].
    pub max: Vector,
    /// Faces without a wall.
    #[serde(default)]
    #[cfg_attr(test, schemars(length(max = 5), transform = super::bounds::each_once))]
    pub open: Vec<Face>,
    /// Axes across whose two faces the water goes on: what leaves through one comes in through the other. There are no walls
    /// there; the length is a whole number of spacings and three effective radii or more.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(test, schemars(length(max = 3), transform = super::bounds::each_once))]
    pub periodic: Vec<Axis>,
}

impl Tank {
    /// Whether it is periodic along x, y, z.
    pub fn periodic(&self) -> [bool; 3] {
        [Axis::X, Axis::Y, Axis::Z].map(|axis| self.periodic.contains(&axis))
    }

    /// Faces without a wall: those that are open, and those across which the water goes on.
    pub(crate) fn without_wall(&self) -> Vec<Face> {
        let seam = TANK_FACES.iter().enumerate().filter(|(k, _)| self.periodic()[k / 2]);
        self.open.iter().copied().chain(seam.map(|(_, (face, _))| *face)).collect()
    }
}

/// A fixed solid: a box, or any other shape.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// Name, for messages and gauges.
    #[cfg_attr(test, schemars(length(min = 1, max = 80)))]
    pub name: String,
    /// Shape. A box from `min` to `max` stands on the lattice of the water; every other one stands where `center` or
    /// `position` puts it.
    #[serde(default)]
    pub shape: BodyShape,
    /// Lower corner of a box [m].
    pub min: Option<Vector>,
    /// Upper corner of a box [m].
    pub max: Option<Vector>,
    /// Faces of such a box that need no particles because nothing reaches them.
    #[serde(default)]
    #[cfg_attr(test, schemars(length(max = 5), transform = super::bounds::each_once))]
    pub open: Vec<Face>,
    /// Edge lengths of a wedge, or of a box about `center` [m].
    #[cfg_attr(test, schemars(transform = super::bounds::each_positive))]
    pub size: Option<Vector>,
    /// Radius of a sphere, cylinder or cone [m].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub radius: Option<f64>,
    /// Length of a cylinder or cone along its axis, of a prism along y, from y = 0 upwards, moved by `position` [m]; in two
    /// dimensions it may be left out.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub height: Option<f64>,
    /// Corners x and z of a prism's section [m], in order; the last leads back to the first.
    pub section: Option<Vec<[f64; 2]>>,
    /// STL or OBJ file of a mesh or terrain; relative to the case.
    pub file: Option<String>,
    /// Metres that the file's unit of length is worth: 0.001 for millimetres; 1 if absent.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub scale: Option<f64>,
    /// Direction of a cylinder's or cone's axis (any length), before `orientation` turns it; [0, 0, 1] if absent.
    pub axis: Option<Vector>,
    /// Centroid [m], of what is not from a file.
    pub center: Option<Vector>,
    /// Where the origin of the file's or section's coordinates goes [m]; [0, 0, 0] if absent.
    pub position: Option<Vector>,
    /// Turn about `center` or `position`.
    pub orientation: Option<Turn>,
    /// Where further ones like it go [m], each by its `center`, its `position` or, of a box of the lattice, its
    /// `min`. All of a table are called by its name and a number: `pile_1`, which is where the table says, `pile_2`
    /// and so on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub copies: Vec<Vector>,
    /// Several like it in rows from its own place on, named as those of `copies`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub array: Option<Array>,
    /// Several like it at places by chance in a box about `center` (not of what has none: a file, a section, a box of
    /// the lattice), named as those of `copies`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scatter: Option<Scatter>,
}

/// A fixed rectangular wall at any angle; its layers lie behind the surface.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// Name, for messages and gauges.
    #[cfg_attr(test, schemars(length(min = 1, max = 80)))]
    pub name: String,
    /// Centre of the surface [m].
    pub center: Vector,
    /// Normal, into the free space (any length); gauges tell nothing of water behind it.
    pub normal: Vector,
    /// Edge lengths [m]: along `along`, and across it.
    #[cfg_attr(test, schemars(transform = super::bounds::each_positive))]
    pub size: [f64; 2],
    /// Direction of the first edge; made orthogonal to the normal.
    pub along: Vector,
}

/// Faces of the tank and the names of their walls, in the order of [`Face`].
pub(crate) const TANK_FACES: [(Face, &str); 6] = [
    (Face::XMin, "tank.x_min"),
    (Face::XMax, "tank.x_max"),
    (Face::YMin, "tank.y_min"),
    (Face::YMax, "tank.y_max"),
    (Face::ZMin, "tank.z_min"),
    (Face::ZMax, "tank.z_max"),
];
