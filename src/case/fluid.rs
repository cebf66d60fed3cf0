//! The fluid, the scheme that moves it and the solver of its pressure; blocks of water at t = 0.

use super::{Fill, Matrix, Vector, WaterShape};
use crate::lattice::Shear;
use crate::scheme::{FreeSurface, Gradient, Source};
use serde::{Deserialize, Serialize};

/// Sets of scheme switches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// The paper's scheme: number_density, minimum, threshold.
    Paper,
    /// The more accurate one: mixed, consistent, threshold_offset.
    #[default]
    Accurate,
}

/// Preconditioner of the conjugate gradients.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
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
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Fluid {
    /// Density [kg/m3].
    #[serde(default = "Fluid::default_density")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub density: f64,
    /// Kinematic viscosity [m2/s]; 0 leaves the viscous stage out.
    #[serde(default = "Fluid::default_viscosity")]
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub viscosity: f64,
    /// Friction C_f of walls whose boundary layer is thinner than a spacing, tau = rho C_f |u_t| u_t [-]: half the skin
    /// friction coefficient. 0 leaves the stage out. If absent 0.0025, smooth walls; none with the paper's preset.
    #[cfg_attr(test, schemars(range(min = 0, max = 1)))]
    pub wall_friction: Option<f64>,
    /// Water pulls: pressures below that of the air are kept and not set to zero, as far as water meets no air there. For siphons, bodies that
    /// are lifted out, water that spins; where air would come in, as behind what leaves a splash, water clings for longer than it should.
    #[serde(default)]
    pub suction: bool,
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
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 4)))]
    pub relaxation: Option<f64>,
    /// Reference speed c_s [m/s], gamma = (c_s dt / l0)^2: how fast errors of the density are undone. If neither is given, 2.5 times the fastest water's speed, at most the larger of 10 sqrt(g l0) and 2.5 sqrt(g H), H the depth at the start, and at least half of that, less in a thick fluid (the paper's source: always the most); in any case 2.5 times the speed of the fastest solid or opening. In a viscous fluid its square is at least 3 nu v / l0, so that creeping flow keeps its density.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub sound_speed: Option<f64>,
    /// Artificial compressibility alpha of Eq. (8) [1/Pa]. Derived if absent.
    #[cfg_attr(test, schemars(range(min = 1e-14)))]
    pub compressibility: Option<f64>,
    /// Free-surface threshold beta [-].
    #[serde(default = "Fluid::default_beta")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1)))]
    pub free_surface_threshold: f64,
    /// Distance of the collision model over l0, a [-]; Eq. (18).
    #[serde(default = "Fluid::default_collision_distance")]
    #[cfg_attr(test, schemars(range(min = 0, max = 1)))]
    pub collision_distance: f64,
    /// Restitution of the collision model, b [-]; Eq. (18).
    #[serde(default = "Fluid::default_collision_restitution")]
    #[cfg_attr(test, schemars(range(min = 0, max = 1)))]
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
    #[cfg_attr(test, schemars(range(min = 0, max = 0.3)))]
    pub jitter: f64,
    /// Which of the jittered starts.
    #[serde(default)]
    pub seed: u32,
    /// Most water at any time where an inflow brings more [m3]; in two dimensions for each metre across [m2]. If absent, all that
    /// comes in by `run.end`, or what the domain holds if that is less.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub max_volume: Option<f64>,
    /// The pressure Poisson equation's solver.
    #[serde(default)]
    pub solver: Solver,
}

impl Fluid {
    /// Source term of the pressure equation, typed or the preset's.
    pub fn source(&self) -> Source {
        self.source.unwrap_or(match self.preset {
            Preset::Paper => Source::NumberDensity,
            Preset::Accurate => Source::Mixed,
        })
    }

    /// Pressure gradient, typed or the preset's.
    pub fn gradient(&self) -> Gradient {
        self.gradient.unwrap_or(match self.preset {
            Preset::Paper => Gradient::Minimum,
            Preset::Accurate => Gradient::Consistent,
        })
    }

    /// Which particles lie on the free surface, typed or the preset's.
    pub fn free_surface(&self) -> FreeSurface {
        self.free_surface.unwrap_or(match self.preset {
            Preset::Paper => FreeSurface::Threshold,
            Preset::Accurate => FreeSurface::ThresholdOffset,
        })
    }

    /// The weight of explicit viscosity that goes with the source, for an effective radius of `radius` spacings.
    pub(crate) fn shear(&self, dimensions: u32, radius: f64) -> Shear {
        match self.source() {
            Source::NumberDensity => Shear::paper(dimensions, radius),
            Source::Mixed => Shear::smooth(dimensions, radius),
        }
    }

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
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// Residual over right side at which the iteration stops, ||r|| / ||b|| [-].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1)))]
    pub tolerance: f64,
    /// Most iterations a step.
    #[cfg_attr(test, schemars(range(min = 1, max = 1_000_000)))]
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
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
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
