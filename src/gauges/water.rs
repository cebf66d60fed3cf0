//! What is read of the water's particles as they are.

use super::level;
use crate::case::{Case, Gauges};
use crate::fields::Fields;
use crate::kernels::body_force::missing_head;
use crate::output::table::{Cell, vector_cells, vector_columns};
use crate::params::Params;
use crate::probe::{Probe, Value};
use crate::scene::{Groups, Kind};
use glam::DVec3;

/// A gauge in the water.
#[derive(Clone, Debug)]
pub(super) enum InWater {
    /// Height of the surface on a vertical line through x and y [m].
    Level(String, [f64; 2]),
    /// Velocity at a point [m], and the corners of the tank.
    Velocity(String, DVec3, Option<[DVec3; 2]>),
    /// Volume in a box between two corners [m].
    Volume(String, [DVec3; 2]),
}

impl InWater {
    /// Those of `case`, in the order of their columns.
    pub fn all(case: &Case) -> Vec<Self> {
        let Gauges { every: _, mean: _, pressure: _, force: _, level, velocity, volume } = &case.gauge;
        let levels = level.iter().map(|g| Self::Level(g.name.clone(), g.at));
        let velocities =
            velocity.iter().map(|g| Self::Velocity(g.name.clone(), g.point.into(), Probe::room(case)));
        let volumes = volume.iter().map(|g| Self::Volume(g.name.clone(), [g.min.into(), g.max.into()]));
        levels.chain(velocities).chain(volumes).collect()
    }

    /// Names of its columns.
    pub fn columns(&self) -> Vec<String> {
        match self {
            Self::Level(name, _) => vec![format!("{name} [m]")],
            Self::Velocity(name, ..) => {
                vector_columns(&format!("{name}_velocity"), "m/s").into_iter().collect()
            }
            Self::Volume(name, _) => vec![format!("{name} [m3]")],
        }
    }

    /// What it reads of the water of `fields`; in two dimensions volumes are those of a slice one spacing wide.
    pub fn cells(&self, fields: &Fields, groups: &Groups, params: &Params) -> Vec<Cell> {
        let flat = params.dimensions == 2;
        let water = || (0..groups.fluid).filter(|&i| fields.kind[i] == Kind::Fluid);
        match *self {
            Self::Level(_, line) => {
                let (reach, l0) = (params.effective_radius, params.spacing);
                let level = level(fields, groups, line, params.dimensions, reach, l0, &params.periodic);
                vec![Cell::from(level.unwrap_or(f64::NAN))]
            }
            Self::Velocity(_, point, room) => {
                let probe = Probe {
                    spacing: params.spacing,
                    radius: params.effective_radius,
                    flat,
                    periodic: params.periodic,
                    room,
                    surface_head: missing_head(params),
                };
                let values = water().map(|i| {
                    let value = Value { velocity: fields.velocity[i], pressure: fields.pressure[i] };
                    (fields.position[i], value)
                });
                let found = probe.at(values, point).map_or(DVec3::NAN, |value| value.velocity);
                vector_cells(found).into_iter().collect()
            }
            Self::Volume(_, [low, high]) => {
                let within = |x: DVec3| {
                    let x = params.periodic.image_from(low, x);
                    let inside = x.cmpge(low) & x.cmplt(high);
                    inside.x && inside.z && (flat || inside.y)
                };
                let count = water().filter(|&i| within(fields.position[i])).count();
                vec![Cell::from(count as f64 * params.particle_volume())]
            }
        }
    }
}
