//! What moves: walls by a table or a formula, rigid bodies by forces.

use super::{Array, Axis, BodyShape, Face, Scatter, Sine, Swing, Vector, WaveMaker};
use serde::{Deserialize, Serialize};

/// A solid that follows a table or a formula of motion, e.g. a gate or a piston: a box, or any other shape.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MovingWall {
    /// Name, for messages and gauges.
    #[cfg_attr(test, schemars(length(min = 1, max = 80)))]
    pub name: String,
    /// Shape. A box from `min` to `max` stands on the lattice of the water; every other one stands where `center` or
    /// `position` puts it.
    #[serde(default)]
    pub shape: BodyShape,
    /// Lower corner of a box at t = 0 [m].
    pub min: Option<Vector>,
    /// Upper corner of a box at t = 0 [m].
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
    /// Centroid at t = 0 [m], of what is not from a file.
    pub center: Option<Vector>,
    /// Where the origin of the file's or section's coordinates goes [m]; [0, 0, 0] if absent.
    pub position: Option<Vector>,
    /// Turn about `center` or `position`.
    pub orientation: Option<Turn>,
    /// Rows of time [s] and displacement x, y, z [m]. Two rows: a constant velocity; more: a smooth curve through them
    /// with a continuous velocity. At rest before the first and after the last: two rows of one place there let it begin and end so.
    /// May be left out if something else moves it.
    #[serde(default)]
    pub motion: Vec<[f64; 4]>,
    /// A sine along an axis, instead of `motion`.
    pub sine: Option<Sine>,
    /// A wave that the wall makes as a piston, instead of `motion`.
    pub wave: Option<WaveMaker>,
    /// Rows of time [s] and angles [degrees] about the axes x, y and z of the world, turned in this order; smooth as
    /// `motion` is, with rows of its own. In two dimensions only the angle about y.
    #[serde(default)]
    pub rotation: Vec<[f64; 4]>,
    /// A turn by a sine, instead of `rotation`.
    pub swing: Option<Swing>,
    /// What `rotation` or `swing` turns about, at t = 0 [m]; it moves with `motion`, `sine` or `wave`. The centroid of the
    /// wall if absent.
    pub pivot: Option<Vector>,
}

/// Orientation as a turn about an axis.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Turn {
    /// Axis (any length).
    pub axis: Vector,
    /// Angle [degrees].
    pub angle_deg: f64,
}

/// A degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Freedom {
    /// Translation along x.
    X,
    /// Translation along y.
    Y,
    /// Translation along z.
    Z,
    /// Rotation about x.
    RotationX,
    /// Rotation about y.
    RotationY,
    /// Rotation about z.
    RotationZ,
}

impl Freedom {
    /// Those that a body has, in the `plane` or in space.
    pub(crate) fn all(plane: bool) -> &'static [Self] {
        match plane {
            true => &[Self::X, Self::Z, Self::RotationY],
            false => &[Self::X, Self::Y, Self::Z, Self::RotationX, Self::RotationY, Self::RotationZ],
        }
    }
}

/// A hinge without friction. Contact acts on the body as on any other: leave room between it and what it would rub against.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Hinge {
    /// A place on its axis at t = 0 [m].
    pub at: Vector,
    /// Its axis: y in two dimensions.
    pub axis: Axis,
}

/// A rigid body.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Name, for messages and tables.
    #[cfg_attr(test, schemars(length(min = 1, max = 80)))]
    pub name: String,
    /// Shape.
    #[serde(default)]
    pub shape: BodyShape,
    /// Edge lengths of a box or wedge [m].
    #[cfg_attr(test, schemars(transform = super::bounds::each_positive))]
    pub size: Option<Vector>,
    /// Radius of a sphere, cylinder or cone [m].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub radius: Option<f64>,
    /// Length of a cylinder or cone along its axis, of a prism along y [m]; in two dimensions it may be left out
    /// beside a `density`.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub height: Option<f64>,
    /// Corners x and z of a prism's section [m], in order; the last leads back to the first.
    pub section: Option<Vec<[f64; 2]>>,
    /// STL or OBJ file of a mesh, a watertight solid; relative to the case.
    pub file: Option<String>,
    /// Metres that the file's unit of length is worth: 0.001 for millimetres; 1 if absent.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub scale: Option<f64>,
    /// Direction of a cylinder's or cone's axis (any length), before `orientation` turns it; [0, 0, 1] if absent. In
    /// two dimensions it is [0, 1, 0].
    pub axis: Option<Vector>,
    /// Centre at t = 0 [m]: of mass, but for `mass_offset`.
    pub center: Vector,
    /// Mass [kg]. Give this or `density`. In two dimensions the slice l0 wide has its share of it: l0 over size y
    /// or over the cylinder's height.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub mass: Option<f64>,
    /// Density [kg/m3].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub density: Option<f64>,
    /// From `center` to the centre of mass of a body that is not uniform, one with ballast say [m], before
    /// `orientation` turns it.
    pub mass_offset: Option<Vector>,
    /// Principal moments of inertia about the centre of mass [kg m2], of the same whole body as `mass`; those of a
    /// uniform body about its own if absent. A cylinder's third axis is its own, those of a mesh are in the order of the file's
    /// axes that they lie nearest.
    #[cfg_attr(test, schemars(transform = super::bounds::each_positive))]
    pub inertia: Option<Vector>,
    /// Orientation at t = 0.
    pub orientation: Option<Turn>,
    /// Velocity at t = 0 [m/s].
    #[serde(default)]
    pub velocity: Vector,
    /// Angular velocity at t = 0 [rad/s].
    #[serde(default)]
    pub angular_velocity: Vector,
    /// Degrees of freedom that are locked.
    #[serde(default)]
    #[cfg_attr(test, schemars(transform = super::bounds::each_once))]
    pub locked: Vec<Freedom>,
    /// What holds it so that it turns about one axis and does nothing else: a flap, a gate, a pendulum.
    pub hinge: Option<Hinge>,
    /// Rows of time [s] and displacement x, y, z [m]: the body then follows the table, as a moving wall does,
    /// instead of forces.
    pub motion: Option<Vec<[f64; 4]>>,
    /// A sine along an axis, instead of `motion`: the body then follows it, as a moving wall does.
    pub sine: Option<Sine>,
    /// Rows of time [s] and angles [degrees] about the axes x, y and z of the world, from the orientation at t = 0: the
    /// body then follows the table, as a moving wall does.
    #[serde(default)]
    pub rotation: Vec<[f64; 4]>,
    /// A turn by a sine, instead of `rotation`.
    pub swing: Option<Swing>,
    /// What `rotation` or `swing` turns about, at t = 0 [m]; it moves with `motion` or `sine`. `center` if absent.
    pub pivot: Option<Vector>,
    /// Remove the water that the body displaces at t = 0 (otherwise an overlap is an error).
    #[serde(default)]
    pub displaces_fluid: bool,
    /// Lift the body against gravity until it stands free of contact forces on what it overlaps at t = 0.
    #[serde(default)]
    pub standing: bool,
    /// Where further ones like it go [m], each by its `center`. All of a table are called by its name and a number:
    /// `rock_1`, which is where the table says, `rock_2` and so on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub copies: Vec<Vector>,
    /// Several like it in rows from `center` on, named as those of `copies`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub array: Option<Array>,
    /// Several like it at places by chance in a box about `center`, named as those of `copies`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scatter: Option<Scatter>,
}
