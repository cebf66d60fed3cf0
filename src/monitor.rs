//! Integral quantities of the fluid: energy, momentum, density error, speeds.

use serde::Serialize;

/// Sums over the live fluid particles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FluidMonitor {
    /// Live fluid particles.
    pub particles: u64,
    /// Kinetic energy [J].
    pub kinetic: f64,
    /// Potential energy -m g.x [J], from the origin.
    pub potential: f64,
    /// Momentum [kg m/s].
    pub momentum: [f64; 3],
    /// Centre of mass [m].
    pub centroid: [f64; 3],
    /// Largest speed [m/s].
    pub speed_max: f64,
    /// Speed that 99.9 % of the particles do not exceed, to the resolution of [`SPEED_BINS`] bins [m/s].
    pub speed_most: f64,
    /// Largest coordinates of the fluid [m].
    pub extent_max: [f64; 3],
    /// Mean of n / n0 - 1 over inner fluid particles [-].
    pub density_error_mean: f64,
    /// Largest |n / n0 - 1| over inner fluid particles [-].
    pub density_error_max: f64,
    /// Inner fluid particles: those with a pressure unknown.
    pub inner: u64,
}

/// Bins of the histogram of speeds.
pub const SPEED_BINS: usize = 256;

/// Width of a bin, as a part of the displacement clamp's speed.
pub(crate) const SPEED_RANGE: f64 = 2.0;
