//! Force of the fluid on a moving solid: pressure times area over its wall layer, plus the reaction of
//! viscosity and collisions.
//! GPU twin: shaders/body_force.wgsl

use crate::body::{Pose, Wrench};
use crate::params::Params;
use crate::scene::Solid;
use crate::scheme::Source;
use glam::DVec3;

/// What a particle of a wall tells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowPressure {
    /// Pressure of its row [Pa].
    pub pressure: f64,
    /// What that is above the pressure on the surface, but for the weight of the water between [Pa].
    pub excess: f64,
    /// What viscosity, friction and collisions of the last step did to it [N], of a fixed wall where a gauge asks.
    pub reaction: DVec3,
}

impl RowPressure {
    /// Pressure on the surface [Pa], which lies `to_surface` [m] from the particle. A particle without pressure before water without any is
    /// dry and has none.
    pub fn on_surface(&self, to_surface: DVec3, params: &Params) -> f64 {
        let pressure = self.in_force(to_surface, params);
        if params.suction { pressure } else { pressure.max(0.0) }
    }

    /// The same as it is in the force on solids: in the accurate scheme nothing is cut.
    pub fn in_force(&self, to_surface: DVec3, params: &Params) -> f64 {
        if self.is_dry() { 0.0 } else { surface_pressure(self.pressure, self.excess, to_surface, params) }
    }

    /// Whether there is no water before it.
    pub fn is_dry(&self) -> bool {
        self.pressure == 0.0 && self.excess >= 0.0
    }
}

/// Pressure on the true surface of the solid [Pa], `to_surface` from a wall-layer particle of `pressure` inside (world axes [m]): without the
/// `excess` of its row ([`super::wall_excess`], none in the paper's scheme), with the weight of the water between.
/// In the paper's scheme water does not pull; in the other one nothing is cut, or a body would not get what the water loses.
#[inline(always)]
pub fn surface_pressure(pressure: f64, excess: f64, to_surface: DVec3, params: &Params) -> f64 {
    let p = pressure - excess + head(to_surface, params);
    match params.source {
        Source::NumberDensity => p.max(0.0),
        Source::Mixed => p,
    }
}

/// The same for a particle beside the water's surface, whose `pressure` is no unknown ([`super::surface_pressure::beside_surface`]): where the
/// face lies above the water there is none.
#[inline(always)]
pub fn beside_surface(pressure: f64, to_surface: DVec3, params: &Params) -> f64 {
    (pressure + head(to_surface, params)).max(0.0)
}

/// Force on what of the faces of row `k` of `solid`, of which `part` counts, and torque about its place [N, N m]. `pressure` tells that on the
/// surface [Pa] by the way there from the particle [m], world axes.
pub fn on_faces(solid: &Solid, k: usize, pose: &Pose, part: f64, pressure: impl Fn(DVec3) -> f64) -> Wrench {
    let turn = pose.orientation;
    let mut sum = Wrench::default();
    for face in solid.faces(k) {
        let way = turn * face.way;
        let force = -part * pressure(way) * (turn * face.area);
        sum += Wrench { force, torque: (turn * solid.wall_offset[k] + way).cross(force) };
    }
    sum
}

/// Pressure on the true surface of water at rest over that of a particle, from which it lies `to_surface` [m]: rho g . to_surface [Pa].
#[inline(always)]
pub fn head(to_surface: DVec3, params: &Params) -> f64 {
    params.density * params.gravity.dot(to_surface) + missing_head(params)
}

/// What the pressure lacks at the water's surface [Pa].
pub fn missing_head(params: &Params) -> f64 {
    params.density * params.gravity.length() * params.zero_pressure_depth()
}

/// What the stress of viscosity holds beside the shear that [`super::viscosity::reaction`] sums, rho nu du/dn: rho nu (grad u)^T n, on the surface of
/// a solid that turns -rho nu omega x A [N]. Over a body that is wholly under water it is no force, but a torque of -2 rho nu V omega in the plane
/// and in space.
#[inline(always)]
pub fn turning(angular_velocity: DVec3, area: DVec3, params: &Params) -> DVec3 {
    -params.density * params.viscosity * angular_velocity.cross(area)
}
