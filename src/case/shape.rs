//! Shapes that a solid may have: the keys that each needs and what it makes of them. With the shape's own file and its
//! arm in `src/shape` all that a new one takes.

#[cfg(feature = "mesh")]
use super::coarse::refused;
use super::section::flaw;
use super::{Body, Freedom, MovingWall, Obstacle, Tank, Turn, Vector};
use crate::error::Problem;
use crate::shape::{Cylinder, Disc, Polygon, Shape, Sphere};
#[cfg(feature = "mesh")]
use crate::shape::{Mesh, Unfit};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Length of a mesh without a `scale` from which it is asked about [m].
const LARGE: f64 = 50.0;
/// The same of a wall, over the tank's longest edge [-].
const LARGE_IN_TANK: f64 = 3.0;

/// Shape of a solid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum BodyShape {
    /// A box of `size`.
    #[default]
    Box,
    /// A sphere of `radius` (three dimensions).
    Sphere,
    /// A cylinder of `radius` and `height` with flat ends, along `axis`; in two dimensions a disc.
    Cylinder,
    /// A cone with a base of `radius` and its tip `height` above that along `axis` (three dimensions). Its centroid
    /// lies a quarter of the height above the base.
    Cone,
    /// A wedge: of the box of `size`, what lies below the plane that rises from its lower edge at x min to its upper
    /// edge at x max. Its centroid lies two thirds of the way along x and one third up.
    Wedge,
    /// What the closed line through the corners of `section` encloses, in x and z, over a `height` along y. A body's
    /// `center` is where its centre of mass goes; a wall's section has the coordinates of the case and its height begins at y = 0,
    /// both moved by `position`.
    Prism,
    /// The watertight surface in the STL or OBJ `file` (three dimensions). A body's `center` is where its centre of mass
    /// goes.
    Mesh,
    /// Ground below the open surface in the STL or OBJ `file`, z upwards (three dimensions; not for bodies).
    Terrain,
}

impl BodyShape {
    /// Its name, and the keys that it needs; others of them do not belong to it.
    pub(super) fn keys(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Box => ("box", &["size"]),
            Self::Sphere => ("sphere", &["radius"]),
            Self::Cylinder => ("cylinder", &["radius", "height"]),
            Self::Cone => ("cone", &["radius", "height"]),
            Self::Wedge => ("wedge", &["size"]),
            Self::Prism => ("prism", &["section", "height"]),
            Self::Mesh => ("mesh", &["file"]),
            Self::Terrain => ("terrain", &["file"]),
        }
    }

    /// Whether it has an `axis`.
    pub(super) fn has_axis(self) -> bool {
        matches!(self, Self::Cylinder | Self::Cone)
    }

    /// Whether it comes from a file.
    pub(super) fn is_file(self) -> bool {
        matches!(self, Self::Mesh | Self::Terrain)
    }

    /// Whether it has coordinates of its own, whose origin `position` places.
    pub(super) fn has_origin(self) -> bool {
        self.is_file() || self == Self::Prism
    }

    /// Whether there is none of it in two dimensions.
    pub(super) fn needs_space(self) -> bool {
        !matches!(self, Self::Box | Self::Cylinder | Self::Wedge | Self::Prism)
    }
}

/// The keys of a solid that make its shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Form<'a> {
    pub shape: BodyShape,
    pub size: Option<Vector>,
    pub radius: Option<f64>,
    pub height: Option<f64>,
    pub section: Option<&'a [[f64; 2]]>,
    pub file: Option<&'a str>,
    pub scale: Option<f64>,
    pub axis: Option<Vector>,
    pub orientation: Option<&'a Turn>,
    /// Length of what comes from a file without a `scale` from which it is asked about [m].
    pub(super) large: f64,
    /// Level below which the ground under a terrain ends, over the origin of its file [m].
    pub(super) floor: f64,
}

/// Where a wall of any shape stands.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Place {
    /// Its centroid [m].
    Center(Vector),
    /// The origin of its file or section [m].
    Position(Vector),
}

/// What is a box of the water's lattice, or has any shape.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Wall<'a> {
    /// From `min` to `max` [m].
    Lattice(Vector, Vector),
    /// Any shape, at its place.
    Shaped(Form<'a>, Place),
}

/// Length of what comes from a file without a `scale` from which it is asked about [m].
pub(super) fn large(tank: Option<&Tank>) -> f64 {
    let edge = |t: &Tank| (0..3).map(|k| t.max[k] - t.min[k]).fold(0.0, f64::max);
    LARGE.max(LARGE_IN_TANK * tank.map_or(0.0, edge))
}

/// The keys of a table that make a shape, with the length of a file's solid that is `large`.
macro_rules! form {
    ($keys:expr, $large:expr) => {
        Form {
            shape: $keys.shape,
            size: $keys.size,
            radius: $keys.radius,
            height: $keys.height,
            section: $keys.section.as_deref(),
            file: $keys.file.as_deref(),
            scale: $keys.scale,
            axis: $keys.axis,
            orientation: $keys.orientation.as_ref(),
            large: $large,
            floor: f64::INFINITY,
        }
    };
}
pub(super) use form;

/// Where a shape of these keys stands.
pub(super) fn place(shape: BodyShape, center: Option<Vector>, position: Option<Vector>) -> Place {
    if shape.has_origin() {
        Place::Position(position.unwrap_or_default())
    } else {
        Place::Center(center.unwrap_or_default())
    }
}

/// An obstacle or a moving wall by the keys that make its shape.
macro_rules! wall {
    ($kind:ty) => {
        impl $kind {
            /// The keys that make its shape; `tank` tells what is large, and how deep ground goes.
            pub(crate) fn form(&self, tank: Option<&Tank>) -> Form<'_> {
                let form = form!(self, large(tank));
                let at = DVec3::from(self.position.unwrap_or_default());
                let is_upright = (form.orientation() * DVec3::Z).z > 1.0 - 1e-9;
                let below = |t: &Tank| {
                    let (low, high) = (DVec3::from(t.min), DVec3::from(t.max));
                    // However it leans.
                    if is_upright { low.z - at.z } else { -at.distance(low) - low.distance(high) }
                };
                Form { floor: tank.map_or(f64::INFINITY, below), ..form }
            }

            /// What it is: a box of the lattice, if it has corners.
            pub(crate) fn wall(&self, tank: Option<&Tank>) -> Wall<'_> {
                match (self.min, self.max) {
                    (Some(min), Some(max)) => Wall::Lattice(min, max),
                    _ => Wall::Shaped(self.form(tank), place(self.shape, self.center, self.position)),
                }
            }

            /// Its corners, if it is a box of the lattice.
            pub(crate) fn corners(&self) -> Option<(Vector, Vector)> {
                self.min.zip(self.max)
            }
        }
    };
}

wall!(Obstacle);
wall!(MovingWall);

impl MovingWall {
    /// Radius of a sphere about its middle that holds it [m], and that middle, as far as its file can be read.
    pub(super) fn reach_and_middle(&self, spacing: f64, flat: bool) -> (f64, Vector) {
        if let Some((min, max)) = self.corners() {
            let half = DVec3::from(max) - DVec3::from(min);
            return (0.5 * half.length(), [0, 1, 2].map(|k| 0.5 * (min[k] + max[k])));
        }
        let form = self.form(None);
        let place = DVec3::from(self.position.unwrap_or_default());
        let known = |middle: DVec3| (place + form.orientation() * middle).to_array();
        match self.shape {
            BodyShape::Prism => {
                let (low, high) = form.ends(flat);
                (0.5 * (high - low).length(), known(0.5 * (low + high)))
            }
            BodyShape::Mesh | BodyShape::Terrain => match form.shape(spacing, flat) {
                Ok((shape, _)) => (shape.radius(), known(shape.origin())),
                Err(_) => (form.reach(), place.to_array()),
            },
            _ => (form.reach(), self.center.unwrap_or_default()),
        }
    }
}

impl Body {
    /// Whether it follows a table or a formula instead of forces.
    pub(crate) fn is_driven(&self) -> bool {
        let guide = self.guide();
        guide.motion.is_some() || guide.sine.is_some() || guide.turns()
    }

    /// Whether forces can move it, in the `plane` or in space.
    pub(crate) fn can_move(&self, plane: bool) -> bool {
        let held = || Freedom::all(plane).iter().all(|freedom| self.locked.contains(freedom));
        !self.is_driven() && (self.hinge.is_some() || !held())
    }

    /// The keys that make its shape.
    pub(crate) fn form(&self) -> Form<'_> {
        form!(self, LARGE)
    }

    /// Its `inertia` in the frame of its shape: in the `plane` a cylinder's own axis, the third of it, is y.
    pub(crate) fn moments(&self, plane: bool) -> Option<DVec3> {
        let lies = plane && self.shape == BodyShape::Cylinder;
        self.inertia.map(|i| if lies { DVec3::new(i[0], i[2], i[1]) } else { i.into() })
    }
}

/// A key of which shapes are made.
pub(super) struct ShapeKey {
    pub name: &'static str,
    /// Whether the solid has it.
    pub given: bool,
    /// A shape that has it.
    pub of: &'static str,
    pub example: &'static str,
    /// What it is.
    pub what: &'static str,
}

impl Form<'_> {
    /// The keys of which shapes are made, in the order in which they are told.
    pub(super) fn shape_keys(&self) -> [ShapeKey; 5] {
        let key = |name, given, of, example, what| ShapeKey { name, given, of, example, what };
        [
            key("size", self.size.is_some(), "box", "[0.2, 0.2, 0.2]", "the edge lengths [m]"),
            key("radius", self.radius.is_some(), "cylinder", "0.1", "[m]"),
            key("height", self.height.is_some(), "cylinder", "0.2", "the length along the axis [m]"),
            key(
                "section",
                self.section.is_some(),
                "prism",
                "[[0, 0], [1, 0], [1, 0.5]]",
                "its corners x and z [m]",
            ),
            key("file", self.file.is_some(), "mesh", "\"hull.stl\"", "an STL or OBJ file"),
        ]
    }

    /// A key of a box without `size` that another shape has, and that shape: `shape` was forgotten.
    pub(super) fn forgotten(&self, flat: bool) -> Option<(&'static str, &'static str)> {
        let round = if flat || self.height.is_some() { "cylinder" } else { "sphere" };
        let keys = [
            ("file", self.file.is_some(), "mesh"),
            ("section", self.section.is_some(), "prism"),
            ("radius", self.radius.is_some(), round),
        ];
        let bare = self.shape == BodyShape::Box && self.size.is_none();
        keys.into_iter().find(|key| bare && key.1).map(|(key, _, shape)| (key, shape))
    }

    /// Its shape, and the share of a given mass that it stands for: in two dimensions (`plane`) a solid is a slice as
    /// wide as the `spacing` [m].
    ///
    /// # Errors
    /// A file that cannot be read; the key is that of the solid's table.
    pub(crate) fn shape(&self, spacing: f64, plane: bool) -> Result<(Shape, f64), Box<Problem>> {
        let (radius, height) = (self.radius.unwrap_or_default(), self.height.unwrap_or_default());
        let size: DVec3 = self.size.unwrap_or_default().into();
        let slice = |width: f64| if plane && width > 0.0 { spacing / width } else { 1.0 };
        Ok(match self.shape {
            BodyShape::Box => {
                let share = slice(size.y);
                let y = if plane { spacing } else { size.y };
                (Shape::cuboid(DVec3 { y, ..size }), share)
            }
            BodyShape::Sphere => (Shape::Sphere(Sphere { radius }), 1.0),
            BodyShape::Cylinder if plane => (Shape::Disc(Disc { radius, width: spacing }), slice(height)),
            BodyShape::Cylinder => (Shape::Cylinder(Cylinder { radius, half_height: 0.5 * height }), 1.0),
            BodyShape::Wedge if plane => {
                let section = [[0.0, 0.0], [size.x, 0.0], [size.x, size.z]];
                (Shape::Polygon(Polygon::new(&section, spacing)), slice(size.y))
            }
            BodyShape::Prism if plane => {
                let section = self.sound_section()?;
                (Shape::Polygon(Polygon::new(section, spacing)), slice(height))
            }
            BodyShape::Cone | BodyShape::Wedge | BodyShape::Prism | BodyShape::Mesh | BodyShape::Terrain => {
                (self.mesh(spacing)?, 1.0)
            }
        })
    }

    /// Turn of the shape's frame, [`Shape::frame`] left aside; a cylinder stands along the z axis of its own.
    pub(crate) fn turn(&self, plane: bool) -> DQuat {
        self.orientation() * self.upended(plane)
    }

    /// What `axis` says, an `orientation` left aside.
    pub(crate) fn upended(&self, plane: bool) -> DQuat {
        match self.axis {
            Some(axis) if !plane => DQuat::from_rotation_arc(DVec3::Z, DVec3::from(axis).normalize()),
            _ => DQuat::IDENTITY,
        }
    }

    /// What `orientation` says, an `axis` left aside.
    pub(crate) fn orientation(&self) -> DQuat {
        self.orientation.map_or(DQuat::IDENTITY, |turn| {
            DQuat::from_axis_angle(DVec3::from(turn.axis).normalize(), turn.angle_deg.to_radians())
        })
    }

    /// The corners of a section that encloses something.
    fn sound_section(&self) -> Result<&[[f64; 2]], Box<Problem>> {
        let section = self.section.unwrap_or_default();
        match flaw(section) {
            Some(flaw) => Err(Box::new(Problem::new("section", flaw.message, flaw.remedy))),
            None => Ok(section),
        }
    }

    #[cfg(feature = "mesh")]
    fn mesh(&self, spacing: f64) -> Result<Shape, Box<Problem>> {
        let unfit = |key: &str| {
            let key = key.to_owned();
            move |unfit: Unfit| Box::new(Problem::new(key, unfit.message, unfit.remedy))
        };
        let path = self.file.unwrap_or_default();
        let scale = self.scale.unwrap_or(1.0);
        let mesh = match self.shape {
            BodyShape::Cone => {
                let (radius, height) = (self.radius.unwrap_or_default(), self.height.unwrap_or_default());
                return Ok(Shape::Mesh(Mesh::cone(radius, height).map_err(unfit("shape"))?));
            }
            BodyShape::Wedge => {
                let size = self.size.unwrap_or_default().into();
                return Ok(Shape::Mesh(Mesh::wedge(size).map_err(unfit("shape"))?));
            }
            BodyShape::Prism => {
                let section = self.sound_section()?;
                let height = self.height.unwrap_or_default();
                return Ok(Shape::Mesh(Mesh::prism(section, height).map_err(unfit("section"))?));
            }
            BodyShape::Terrain => Mesh::terrain(path, scale, spacing, self.floor),
            _ => Mesh::open(path, scale),
        };
        let mesh =
            mesh.map_err(|e| refused(e, Mesh::steps_of_file(path, scale), spacing)).map_err(unfit("file"))?;
        let size = mesh.size().max_element();
        if self.scale.is_none() && size > self.large {
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
    fn mesh(&self, _: f64) -> Result<Shape, Box<Problem>> {
        let message = "this seixo was built without meshes";
        Err(Box::new(Problem::new("shape", message, "build it with its feature `mesh`")))
    }

    /// Radius of a sphere about its centre that holds it, as far as it is known without its file [m].
    pub(super) fn reach(&self) -> f64 {
        let box_ = self.size.map_or(0.0, |s| 0.5 * DVec3::from(s).length());
        let round = self.radius.unwrap_or(0.0).hypot(0.5 * self.height.unwrap_or(0.0));
        // the centroid of a cone or wedge is not in the middle
        let off = if matches!(self.shape, BodyShape::Cone | BodyShape::Wedge) { 2.0 } else { 1.0 };
        let [x, height, z] = self.around();
        (off * box_.max(round)).max(x.hypot(height).hypot(z))
    }

    /// Edges of the box around a prism [m]; zero of other shapes.
    fn around(&self) -> Vector {
        let (low, high) = self.ends(false);
        (high - low).to_array()
    }

    /// Lower and upper corner of the box around a prism in the coordinates of its section [m], in the plane if it is `flat`; zero of other
    /// shapes.
    fn ends(&self, flat: bool) -> (DVec3, DVec3) {
        let Some(section) = self.section.filter(|s| !s.is_empty()) else { return Default::default() };
        let corners = section.iter().map(|&[x, z]| DVec3::new(x, 0.0, z));
        let (low, high) = corners.fold((DVec3::MAX, DVec3::MIN), |(lo, hi), x| (lo.min(x), hi.max(x)));
        let height = if flat { 0.0 } else { self.height.unwrap_or_default() };
        (low, high + height * DVec3::Y)
    }

    /// The key that its smallest length comes from, and the edges of the box around it [m].
    pub(super) fn across(&self, plane: bool) -> (&'static str, Vector) {
        let (radius, height) = (self.radius.unwrap_or_default(), self.height.unwrap_or_default());
        match self.shape {
            BodyShape::Box | BodyShape::Wedge => ("size", self.size.unwrap_or_default()),
            BodyShape::Cylinder | BodyShape::Cone if !plane => {
                let key = if height < 2.0 * radius { "height" } else { "radius" };
                (key, [2.0 * radius, 2.0 * radius, height])
            }
            BodyShape::Sphere | BodyShape::Cylinder | BodyShape::Cone => ("radius", [2.0 * radius; 3]),
            BodyShape::Prism => ("section", self.around()),
            // Known when the file is read.
            BodyShape::Mesh | BodyShape::Terrain => ("file", [f64::NAN; 3]),
        }
    }
}
