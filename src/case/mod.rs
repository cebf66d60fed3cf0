//! The case file as a user types it: TOML, SI units, unknown keys refused.
//!
//! The structs here are the schema (`seixo schema` prints it). `file` reads and overrides, `check` judges what serde cannot.

mod absorber;
mod bounds;
pub mod check;
mod check_geometry;
mod check_motion;
mod check_solids;
pub mod file;
mod motion_file;
mod opening;
mod output;
mod overrides;
mod report;
mod section;
mod shape;
mod surplus;
mod water;
mod wave;

pub use absorber::Absorber;
pub(crate) use opening::{HURRY, OpeningKeys};
pub use opening::{Inflow, OUTFLOWS_MAX, Outflow, Rate};
pub(crate) use output::Choice;
pub use output::{Encoding, Output, OutputField, OutputKind, OutputRegion, Series};
pub use shape::BodyShape;
pub(crate) use shape::{Form, Place, Wall};
pub use water::{Fill, WaterShape};
pub(crate) use wave::Guide;
pub use wave::{Sine, Swing, WaveMaker};

use crate::scheme::{FreeSurface, Gradient, Source};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A three-component vector as written in a case file.
pub type Vector = [f64; 3];

/// Three rows of x, y, z.
pub type Matrix = [Vector; 3];

/// A case: one experiment. All quantities in SI units.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
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
}

/// Resolution, time and gravity.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Initial distance between particles l0 [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub spacing: f64,
    /// Time step [s]; the largest one when `adaptive = true`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub time_step: f64,
    /// Shrink the time step below `time_step` where the flow asks for it: dt <= 0.35 l0 / v and
    /// dt <= 0.7 l0 / c_s.
    #[serde(default)]
    pub adaptive: bool,
    /// End of the run [s].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub end: f64,
    /// Gravity [m/s2].
    #[serde(default = "Run::default_gravity")]
    pub gravity: Vector,
    /// 3, or 2 for the plane y = 0 (a slice one spacing wide).
    #[serde(default = "Run::default_dimensions")]
    #[schemars(extend("enum" = [2, 3]))]
    pub dimensions: u32,
    /// Lower and upper corner of the box that no particle may leave [m]. Derived from the walls if absent.
    pub domain: Option<[Vector; 2]>,
    /// Effective radius over the spacing, re / l0 [-].
    #[serde(default = "Run::default_effective_radius")]
    #[schemars(range(min = 1.5, max = 4.1))]
    pub effective_radius: f64,
    /// When the state is saved, so that a run that was stopped goes on where it was.
    #[serde(default)]
    pub checkpoint: Checkpoint,
    /// Folder of an earlier run whose last state is the start of this one, instead of t = 0; a relative one counts
    /// from the case file. Scene and processor must be the same; time, gauges, output and constants may differ.
    pub from: Option<String>,
}

/// Intervals between checkpoints; there is one at the end, too, and when a signal stops a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Checkpoint {
    /// Simulated time between checkpoints [s]; none by simulated time if absent.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every: Option<f64>,
    /// Wall-clock time between checkpoints [s]; 0 for none, nor at the end, unless `every` is given.
    #[schemars(range(min = 0))]
    pub wall: f64,
}

impl Default for Checkpoint {
    fn default() -> Self {
        Self { every: None, wall: 600.0 }
    }
}

impl Run {
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

/// Sets of scheme switches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// The paper's scheme: number_density, minimum, threshold.
    Paper,
    /// The more accurate one: mixed, consistent, threshold_offset.
    #[default]
    Accurate,
}

/// Preconditioner of the conjugate gradients.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Preconditioner {
    /// Chosen by the plan from the number of unknowns.
    #[default]
    Auto,
    /// The diagonal.
    Jacobi,
    /// Aggregation multigrid on background buckets.
    Multigrid,
}

/// The fluid and its scheme.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fluid {
    /// Density [kg/m3].
    #[serde(default = "Fluid::default_density")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub density: f64,
    /// Kinematic viscosity [m2/s]; 0 leaves the viscous stage out.
    #[serde(default = "Fluid::default_viscosity")]
    #[schemars(range(min = 0))]
    pub viscosity: f64,
    /// Friction C_f of walls whose boundary layer is thinner than a spacing, tau = rho C_f |u_t| u_t [-]: half the skin
    /// friction coefficient. 0 leaves the stage out. If absent 0.0025, smooth walls; none with the paper's preset.
    #[schemars(range(min = 0, max = 1))]
    pub wall_friction: Option<f64>,
    /// Set of scheme switches; the keys below override single ones.
    #[serde(default)]
    pub preset: Preset,
    /// Source term of the pressure Poisson equation.
    pub source: Option<Source>,
    /// Pressure gradient.
    pub gradient: Option<Gradient>,
    /// Test for the free surface.
    pub free_surface: Option<FreeSurface>,
    /// Relaxation gamma of Eq. (8) [-]. Give this or `sound_speed`.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 4))]
    pub relaxation: Option<f64>,
    /// Reference speed c_s [m/s], gamma = (c_s dt / l0)^2: how fast errors of the density are undone. If neither is given, 2.5 times the fastest water's speed, at most the larger of 10 sqrt(g l0) and 2.5 sqrt(g H), H the depth at the start, and at least half of that (the paper's source: always the most); in any case 2.5 times the speed of the fastest solid or opening.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub sound_speed: Option<f64>,
    /// Artificial compressibility alpha of Eq. (8) [1/Pa]. Derived if absent.
    #[schemars(range(min = 1e-14))]
    pub compressibility: Option<f64>,
    /// Free-surface threshold beta [-].
    #[serde(default = "Fluid::default_beta")]
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub free_surface_threshold: f64,
    /// Distance of the collision model over l0, a [-]; Eq. (18).
    #[serde(default = "Fluid::default_collision_distance")]
    #[schemars(range(min = 0, max = 1))]
    pub collision_distance: f64,
    /// Restitution of the collision model, b [-]; Eq. (18).
    #[serde(default = "Fluid::default_collision_restitution")]
    #[schemars(range(min = 0, max = 1))]
    pub collision_restitution: f64,
    /// Blocks of water at t = 0.
    #[serde(default)]
    pub block: Vec<Block>,
    /// Water of other shapes at t = 0.
    #[serde(default)]
    pub shape: Vec<WaterShape>,
    /// Water that fills what a seed can reach, up to a level, at t = 0.
    #[serde(default)]
    pub fill: Vec<Fill>,
    /// Largest displacement of a water particle from its lattice at t = 0, along each axis, over the spacing [-];
    /// 0 for none. For ensembles: starts with different `seed` differ in nothing else.
    #[serde(default)]
    #[schemars(range(min = 0, max = 0.3))]
    pub jitter: f64,
    /// Which of the jittered starts.
    #[serde(default)]
    pub seed: u32,
    /// Most water at any time where an inflow brings more [m3]; in two dimensions for each metre across [m2]. If absent, all that
    /// comes in by `run.end`, or what the domain holds if that is less.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_volume: Option<f64>,
    /// The pressure Poisson equation's solver.
    #[serde(default)]
    pub solver: Solver,
}

impl Fluid {
    fn default_density() -> f64 {
        1000.0
    }
    fn default_viscosity() -> f64 {
        1e-6
    }
    fn default_beta() -> f64 {
        0.97
    }
    fn default_collision_distance() -> f64 {
        0.8
    }
    fn default_collision_restitution() -> f64 {
        0.2
    }
}

/// Solver of the pressure Poisson equation.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// Residual over right side at which the iteration stops, ||r|| / ||b|| [-].
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub tolerance: f64,
    /// Most iterations a step.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub max_iterations: u32,
    /// Preconditioner.
    pub preconditioner: Preconditioner,
    /// Start from the last pressure instead of zero.
    pub warm_start: bool,
}

impl Default for Solver {
    fn default() -> Self {
        Self { tolerance: 1e-3, max_iterations: 1000, preconditioner: Preconditioner::Auto, warm_start: true }
    }
}

/// A block of water.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// Lower corner [m].
    pub min: Vector,
    /// Upper corner [m].
    pub max: Vector,
    /// Velocity at t = 0 [m/s].
    #[serde(default)]
    pub velocity: Vector,
    /// What is added to `velocity` a metre away from the block's centre [1/s]: rows of x, y, z for the velocity along x, y and z.
    pub velocity_gradient: Option<Matrix>,
}

/// A face of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
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

/// A rectangular container; walls outside of `min`..`max`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tank {
    /// Lower inner corner [m].
    pub min: Vector,
    /// Upper inner corner [m].
    pub max: Vector,
    /// Faces without a wall.
    #[serde(default)]
    #[schemars(length(max = 5), transform = bounds::each_once)]
    pub open: Vec<Face>,
    /// Axes across whose two faces the water goes on: what leaves through one comes in through the other. There are no walls
    /// there; the length is a whole number of spacings and three effective radii or more.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 3), transform = bounds::each_once)]
    pub periodic: Vec<Axis>,
}

impl Tank {
    /// Whether it is periodic along x, y, z.
    pub(crate) fn periodic(&self) -> [bool; 3] {
        [Axis::X, Axis::Y, Axis::Z].map(|axis| self.periodic.contains(&axis))
    }

    /// Faces without a wall: those that are open, and those across which the water goes on.
    pub(crate) fn without_wall(&self) -> Vec<Face> {
        let seam = TANK_FACES.iter().enumerate().filter(|(k, _)| self.periodic()[k / 2]);
        self.open.iter().copied().chain(seam.map(|(_, (face, _))| *face)).collect()
    }
}

/// A fixed solid: a box, or any other shape.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// Name, for messages and gauges.
    #[schemars(length(min = 1, max = 80))]
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
    #[schemars(length(max = 5), transform = bounds::each_once)]
    pub open: Vec<Face>,
    /// Edge lengths of a wedge, or of a box about `center` [m].
    #[schemars(transform = bounds::each_positive)]
    pub size: Option<Vector>,
    /// Radius of a sphere, cylinder or cone [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: Option<f64>,
    /// Length of a cylinder or cone along its axis [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub height: Option<f64>,
    /// Corners x and z of a prism's section [m], in order; the last leads back to the first.
    pub section: Option<Vec<[f64; 2]>>,
    /// STL or OBJ file of a mesh or terrain; relative to the case.
    pub file: Option<String>,
    /// Metres that the file's unit of length is worth: 0.001 for millimetres; 1 if absent.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
    /// Direction of a cylinder's or cone's axis (any length), before `orientation` turns it; [0, 0, 1] if absent.
    pub axis: Option<Vector>,
    /// Centroid [m], of what is not from a file.
    pub center: Option<Vector>,
    /// Where the origin of the file's or section's coordinates goes [m]; [0, 0, 0] if absent.
    pub position: Option<Vector>,
    /// Turn about `center` or `position`.
    pub orientation: Option<Turn>,
}

/// A fixed rectangular wall at any angle; its layers lie behind the surface.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// Name, for messages and gauges.
    #[schemars(length(min = 1, max = 80))]
    pub name: String,
    /// Centre of the surface [m].
    pub center: Vector,
    /// Normal, into the free space (any length).
    pub normal: Vector,
    /// Edge lengths [m]: along `along`, and across it.
    #[schemars(transform = bounds::each_positive)]
    pub size: [f64; 2],
    /// Direction of the first edge; made orthogonal to the normal.
    pub along: Vector,
}

/// A solid that follows a table or a formula of motion, e.g. a gate or a piston: a box, or any other shape.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MovingWall {
    /// Name, for messages and gauges.
    #[schemars(length(min = 1, max = 80))]
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
    #[schemars(length(max = 5), transform = bounds::each_once)]
    pub open: Vec<Face>,
    /// Edge lengths of a wedge, or of a box about `center` [m].
    #[schemars(transform = bounds::each_positive)]
    pub size: Option<Vector>,
    /// Radius of a sphere, cylinder or cone [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: Option<f64>,
    /// Length of a cylinder or cone along its axis [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub height: Option<f64>,
    /// Corners x and z of a prism's section [m], in order; the last leads back to the first.
    pub section: Option<Vec<[f64; 2]>>,
    /// STL or OBJ file of a mesh or terrain; relative to the case.
    pub file: Option<String>,
    /// Metres that the file's unit of length is worth: 0.001 for millimetres; 1 if absent.
    #[schemars(extend("exclusiveMinimum" = 0))]
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
    /// with a continuous velocity. At rest before the first and after the last. May be left out if something else moves it.
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
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Turn {
    /// Axis (any length).
    pub axis: Vector,
    /// Angle [degrees].
    pub angle_deg: f64,
}

/// A degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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

/// A rigid body.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Name, for messages and tables.
    #[schemars(length(min = 1, max = 80))]
    pub name: String,
    /// Shape.
    #[serde(default)]
    pub shape: BodyShape,
    /// Edge lengths of a box or wedge [m].
    #[schemars(transform = bounds::each_positive)]
    pub size: Option<Vector>,
    /// Radius of a sphere, cylinder or cone [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: Option<f64>,
    /// Length of a cylinder or cone along its axis [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub height: Option<f64>,
    /// Corners x and z of a prism's section [m], in order; the last leads back to the first.
    pub section: Option<Vec<[f64; 2]>>,
    /// STL or OBJ file of a mesh, a watertight solid; relative to the case.
    pub file: Option<String>,
    /// Metres that the file's unit of length is worth: 0.001 for millimetres; 1 if absent.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
    /// Direction of a cylinder's or cone's axis (any length), before `orientation` turns it; [0, 0, 1] if absent. In
    /// two dimensions it is [0, 1, 0].
    pub axis: Option<Vector>,
    /// Centre of mass at t = 0 [m].
    pub center: Vector,
    /// Mass [kg]. Give this or `density`. In two dimensions the slice l0 wide has its share of it: l0 over size y
    /// or over the cylinder's height.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub mass: Option<f64>,
    /// Density [kg/m3].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub density: Option<f64>,
    /// Principal moments of inertia [kg m2], of the same whole body as `mass`; those of a uniform body if absent.
    /// A cylinder's third axis is its own.
    #[schemars(transform = bounds::each_positive)]
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
    #[schemars(transform = bounds::each_once)]
    pub locked: Vec<Freedom>,
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
}

/// Contact law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// Eqs. (10) to (14) over particle pairs, averaged over the pairs.
    Paper,
    /// True surfaces, constant weights, Coulomb friction with a static branch; conservative.
    Smooth,
    /// The paper's baseline: no contact law, solids are kept apart by the collision model, Eq. (18).
    Pressure,
}

/// Where contact searches and presses its pairs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactDevice {
    /// On the GPU backend by the number of surface points: few on the host, many on the GPU.
    #[default]
    Auto,
    /// On the host, in f64.
    Host,
    /// On the GPU (laws "smooth" and "paper"); needs the GPU backend.
    Gpu,
}

/// Contact between solids.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Contact law.
    #[serde(default = "Contact::default_law")]
    pub law: Law,
    /// Spring coefficient K [N/m], Eq. (10); law "pressure" has none.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e18))]
    pub spring: f64,
    /// Damping coefficient C [kg/s], Eq. (11). Give this, `damping_ratio` or `restitution`.
    #[schemars(range(min = 0))]
    pub damping: Option<f64>,
    /// Damping over the critical one of the lightest body, C / (2 sqrt(K m)) [-], Eq. (15).
    #[schemars(range(min = 0))]
    pub damping_ratio: Option<f64>,
    /// Normal restitution e of a free impact [-] (law "smooth"): 1 elastic, 0 plastic. 0.5 if none of the three is
    /// given with law "smooth"; law "paper" is then undamped.
    #[schemars(range(min = 0, max = 1))]
    pub restitution: Option<f64>,
    /// Numerical friction eta of Eq. (12) [kg/s]: over particle pairs (law "paper") or over the true
    /// surfaces, where it adds to `friction` (law "smooth").
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub viscous_friction: f64,
    /// Coulomb coefficient mu [-], static and kinetic (law "smooth").
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub friction: f64,
    /// Let contact forces turn bodies (law "paper"; Eq. (14) says nothing of torque).
    #[serde(default = "Contact::default_torque")]
    pub torque: bool,
    /// Force this many contact sub-steps a step instead of as many as stability asks for.
    #[schemars(range(min = 1, max = 100_000))]
    pub substeps: Option<u32>,
    /// Where pairs are searched and pressed. Sums, friction and motion are the host's, in f64, either way.
    #[serde(default)]
    pub device: ContactDevice,
}

impl Contact {
    fn default_law() -> Law {
        Law::Smooth
    }
    fn default_torque() -> bool {
        true
    }
}

/// Measurements over time; all go to gauges.csv.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Gauges {
    /// Interval between rows [s]; every step if absent.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every: Option<f64>,
    /// Pressures and forces of a row are means over the steps since the row before, each with its length, and not those of the last step.
    /// Levels are of the moment.
    pub mean: bool,
    /// Pressure on a fixed wall: mean over the wall particles within half an effective radius of the point.
    pub pressure: Vec<PressureGauge>,
    /// Height of the water surface along a vertical line.
    pub level: Vec<LevelGauge>,
    /// Force and torque of the fluid on a body or wall.
    pub force: Vec<ForceGauge>,
}

/// Pressure at a point on a wall.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressureGauge {
    /// Name, used in the header.
    #[schemars(length(min = 1, max = 80))]
    pub name: String,
    /// Point on a wall [m].
    pub point: Vector,
}

/// Water level on a line along z.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LevelGauge {
    /// Name, used in the header.
    #[schemars(length(min = 1, max = 80))]
    pub name: String,
    /// x, y of the line [m].
    pub at: [f64; 2],
}

/// Force on a solid.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ForceGauge {
    /// Name, used in the header.
    #[schemars(length(min = 1, max = 80))]
    pub name: String,
    /// Name of a body, moving wall, obstacle or plane, or of a face of the tank such as `tank.z_min`. Torque is about
    /// the centre of mass, or the middle of a fixed wall.
    pub on: String,
}
