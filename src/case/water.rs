//! Water at t = 0 that is no block: other shapes, and what a seed fills up to a level.

use super::check::Checker;
use super::check_geometry::WallKeys;
use super::shape::{form, large, place};
use super::{BodyShape, Face, Form, Matrix, Place, Tank, Turn, Vector};
use serde::{Deserialize, Serialize};

/// Water of any shape at t = 0: where the shape and no wall is.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct WaterShape {
    /// Shape; a box has `size`.
    #[serde(default)]
    pub shape: BodyShape,
    /// Edge lengths of a box or wedge [m].
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
    /// STL or OBJ file of a mesh, a watertight solid; relative to the case.
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
    /// Velocity at t = 0 [m/s].
    #[serde(default)]
    pub velocity: Vector,
    /// What is added to `velocity` a metre away from the shape's centroid [1/s]: rows of x, y, z for the velocity along x, y and z.
    pub velocity_gradient: Option<Matrix>,
}

/// Water that fills what can be reached from a place below a level, through what is free of walls.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Fill {
    /// A place in the water [m].
    pub seed: Vector,
    /// Height of its surface along z [m].
    pub level: f64,
    /// Velocity at t = 0 [m/s].
    #[serde(default)]
    pub velocity: Vector,
}

impl WaterShape {
    /// The keys that make its shape; `tank` tells what is large.
    pub(crate) fn form(&self, tank: Option<&Tank>) -> Form<'_> {
        form!(self, large(tank))
    }

    /// Where it stands.
    pub(crate) fn place(&self) -> Place {
        place(self.shape, self.center, self.position)
    }
}

impl Checker<'_> {
    /// A flow that keeps its volume; the pressure would take the rest away in the first step.
    pub(super) fn gradient(&mut self, path: &str, gradient: Option<&Matrix>) {
        let Some(gradient) = gradient else { return };
        if self.flat() && (gradient[1] != [0.0; 3] || gradient.iter().any(|row| row[1] != 0.0)) {
            self.add(
                format!("{path}.velocity_gradient"),
                "in two dimensions there are x and z alone",
                "set the second row and the second number of each row to 0, or run.dimensions = 3",
            );
        }
        let divergence: f64 = self.axes().map(|k| gradient[k][k]).sum();
        let largest = gradient.as_flattened().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        if divergence.abs() > 1e-6 * largest {
            self.add(
                format!("{path}.velocity_gradient"),
                format!("a divergence of {divergence} 1/s: water keeps its volume"),
                "let the numbers of the diagonal add up to 0",
            );
        }
    }

    /// Shapes of water and fills.
    pub(super) fn water(&mut self, shapes: &[WaterShape], fills: &[Fill]) {
        let case = self.case;
        for (k, water) in shapes.iter().enumerate() {
            let path = format!("fluid.shape.{k}");
            self.gradient(&path, water.velocity_gradient.as_ref());
            self.in_plane(&format!("{path}.velocity"), &water.velocity);
            if water.shape == BodyShape::Terrain {
                let message = "a terrain is ground and has no end";
                self.add(format!("{path}.shape"), message, "use a [[fluid.fill]], or set shape = \"mesh\"");
                continue;
            }
            let (label, form) = (format!("water {path}"), water.form(case.tank.as_ref()));
            if self.forgotten(&path, &label, &form) {
                continue;
            }
            if water.shape == BodyShape::Box && water.size.is_none() {
                let message = "a box of water without `size`";
                self.add(
                    path,
                    message,
                    "add `size` and `center`, or use a [[fluid.block]] from `min` to `max`",
                );
                continue;
            }
            let places = [water.center, water.position];
            let keys = WallKeys { corners: [None, None], open: &[] as &[Face], places };
            self.wall(&path, &label, &keys, &form);
        }
        for (k, fill) in fills.iter().enumerate() {
            let path = format!("fluid.fill.{k}");
            self.in_plane(&format!("{path}.velocity"), &fill.velocity);
            self.place(&format!("{path}.seed"), &fill.seed);
            self.place(&format!("{path}.level"), &[fill.level]);
            if fill.seed[2] >= fill.level {
                let message =
                    format!("the seed at z = {} lies above the level of {}", fill.seed[2], fill.level);
                self.add(format!("{path}.seed"), message, "put it into the water, below `level`");
            }
            if case.tank.is_none() && case.obstacle.is_empty() && case.moving_wall.is_empty() {
                let message = "there is nothing that holds the water";
                self.add(
                    path,
                    message,
                    "give a [tank], an [[obstacle]] or a [[moving_wall]], or use a [[fluid.block]]",
                );
            }
        }
    }
}
