//! Shapes that a body may have: the keys that each needs and what it makes of them. With the shape's own file and its
//! arm in `src/shape` all that a new one takes.

use super::{Body, Vector};
use crate::error::Problem;
#[cfg(feature = "mesh")]
use crate::shape::Mesh;
use crate::shape::{Cylinder, Disc, Shape, Sphere};
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Length of a mesh without a `scale` from which it is asked about [m].
#[cfg(feature = "mesh")]
const LARGE: f64 = 50.0;

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
    /// The watertight surface in the STL or OBJ `file` (three dimensions). `center` is where its centre of mass goes.
    Mesh,
}

impl BodyShape {
    /// Its name, and the keys of a body that it needs; others of them do not belong to it.
    pub(super) fn keys(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Box => ("box", &["size"]),
            Self::Sphere => ("sphere", &["radius"]),
            Self::Cylinder => ("cylinder", &["radius", "height"]),
            Self::Mesh => ("mesh", &["file"]),
        }
    }

    /// Whether a body of it has an `axis`.
    pub(super) fn has_axis(self) -> bool {
        matches!(self, Self::Cylinder)
    }

    /// Whether there is none of it in two dimensions.
    pub(super) fn needs_space(self) -> bool {
        matches!(self, Self::Sphere | Self::Mesh)
    }
}

impl Body {
    /// Whether it follows a table instead of forces.
    pub(crate) fn is_driven(&self) -> bool {
        self.motion.is_some() || !self.rotation.is_empty()
    }

    /// Its shape, and the share of a given mass that it stands for: in two dimensions (`plane`) a body is a slice as
    /// wide as the `spacing` [m].
    ///
    /// # Errors
    /// A mesh that cannot be read; the key is that of the body's table.
    pub(crate) fn shape(&self, spacing: f64, plane: bool) -> Result<(Shape, f64), Box<Problem>> {
        let (radius, height) = (self.radius.unwrap_or_default(), self.height.unwrap_or_default());
        let slice = |width: f64| if plane { spacing / width } else { 1.0 };
        Ok(match self.shape {
            BodyShape::Mesh => (self.mesh()?, 1.0),
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
        })
    }

    #[cfg(feature = "mesh")]
    fn mesh(&self) -> Result<Shape, Box<Problem>> {
        let path = self.file.as_deref().unwrap_or_default();
        let mesh = Mesh::open(path, self.scale.unwrap_or(1.0));
        let mesh = mesh.map_err(|unfit| Box::new(Problem::new("file", unfit.message, unfit.remedy)))?;
        let size = mesh.size().max_element();
        if self.scale.is_none() && size > LARGE {
            let message = format!("{path}: it would be {size} m long: are its lengths millimetres?");
            return Err(Box::new(Problem::new(
                "scale",
                message,
                "add `scale = 0.001`, or `scale = 1` if they are metres",
            )));
        }
        Ok(Shape::Mesh(mesh))
    }

    #[cfg(not(feature = "mesh"))]
    fn mesh(&self) -> Result<Shape, Box<Problem>> {
        let message = "this seixo was built without meshes";
        Err(Box::new(Problem::new("shape", message, "build it with its feature `mesh`")))
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
            // Known when the file is read.
            BodyShape::Mesh => ("file", [f64::NAN; 3]),
        }
    }
}
