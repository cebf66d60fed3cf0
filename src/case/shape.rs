//! Shapes that a body may have: the keys that each needs and what it makes of them. With the shape's own file and its
//! arm in `src/shape` all that a new one takes.

use super::{Body, Vector};
use crate::shape::{Cylinder, Disc, Shape, Sphere};
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Shape of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BodyShape {
    /// A box of `size`.
    #[default]
    Box,
    /// A sphere of `radius` (three dimensions).
    Sphere,
    /// A cylinder of `radius` and `height` with flat ends, along `axis`; in two dimensions a disc.
    Cylinder,
}

impl BodyShape {
    /// Its name, and the keys of a body that it needs; others of them do not belong to it.
    pub(super) fn keys(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Box => ("box", &["size"]),
            Self::Sphere => ("sphere", &["radius"]),
            Self::Cylinder => ("cylinder", &["radius", "height"]),
        }
    }

    /// Whether a body of it has an `axis`.
    pub(super) fn has_axis(self) -> bool {
        matches!(self, Self::Cylinder)
    }

    /// Whether there is none of it in two dimensions.
    pub(super) fn needs_space(self) -> bool {
        matches!(self, Self::Sphere)
    }
}

impl Body {
    /// Its shape, and the share of a given mass that it stands for: in two dimensions (`plane`) a body is a slice as
    /// wide as the `spacing` [m].
    pub(crate) fn shape(&self, spacing: f64, plane: bool) -> (Shape, f64) {
        let (radius, height) = (self.radius.unwrap_or_default(), self.height.unwrap_or_default());
        let slice = |width: f64| if plane { spacing / width } else { 1.0 };
        match self.shape {
            BodyShape::Box => {
                let mut size: DVec3 = self.size.unwrap_or_default().into();
                let share = slice(size.y);
                if plane {
                    size.y = spacing;
                }
                (Shape::cuboid(size), share)
            }
            BodyShape::Sphere => (Shape::Sphere(Sphere { radius }), 1.0),
            BodyShape::Cylinder if plane => (Shape::Disc(Disc { radius, width: spacing }), slice(height)),
            BodyShape::Cylinder => (Shape::Cylinder(Cylinder { radius, half_height: 0.5 * height }), 1.0),
        }
    }

    /// The key that its smallest length comes from, and the edges of the box around it [m].
    pub(super) fn across(&self, plane: bool) -> (&'static str, Vector) {
        let (radius, height) = (self.radius.unwrap_or_default(), self.height.unwrap_or_default());
        match self.shape {
            BodyShape::Box => ("size", self.size.unwrap_or_default()),
            BodyShape::Cylinder if !plane => {
                let key = if height < 2.0 * radius { "height" } else { "radius" };
                (key, [2.0 * radius, 2.0 * radius, height])
            }
            BodyShape::Sphere | BodyShape::Cylinder => ("radius", [2.0 * radius; 3]),
        }
    }
}
