//! Pressure at a point of a wall, or of a solid, with which it goes and turns.

use crate::body::Pose;
use crate::case::PressureGauge;
use crate::kernels::body_force::RowPressure;
use crate::params::Params;
use crate::periodic::Periodic;
use crate::scene::{Scene, Solid, wall_at};
use crate::slots::Push;
use glam::{DQuat, DVec3};

/// Way from a gauge's point to a body's face over the spacing within which a gap between the two is told by that face.
const SLOT: f64 = 2.0;

/// Sum of the weights of a slot's rows from which a point is within it: 1 between two, 1/2 at its end.
const WITHIN: f64 = 0.75;

/// Cosine between what two particles look at below which they are on opposite sides of a plate.
const OPPOSITE: f64 = -0.5;

/// Wall particles that move as one.
pub(super) struct WallLayer {
    /// The solid; `None` for the fixed walls.
    solid: Option<usize>,
    slots: Vec<usize>,
    /// At t = 0 [m].
    at: Vec<DVec3>,
    /// Which way each looks; nothing of it need be known.
    normal: Vec<DVec3>,
}

impl WallLayer {
    /// What pressure gauges of `scene` may be on: first the fixed walls, then each solid.
    pub fn all(scene: &Scene) -> Vec<Self> {
        let of = |solid: Option<usize>, slots: Vec<usize>, normal: Vec<DVec3>| {
            let at = slots.iter().map(|&slot| scene.position[slot]).collect();
            Self { solid, slots, at, normal }
        };
        let fixed = of(None, scene.groups.static_wall_range().collect(), scene.static_wall_normal.clone());
        let solids = scene.solids[..scene.followed()].iter().enumerate();
        let looks = |s: &Solid| {
            s.wall_to_surface.iter().map(|&way| (s.orientation * way).normalize_or_zero()).collect()
        };
        let solids = solids.map(|(k, s)| of(Some(k), s.wall_slots.clone().collect(), looks(s)));
        std::iter::once(fixed).chain(solids).collect()
    }
}

/// A pressure gauge: the mean over the particles of the fixed walls, or of the solid that stands nearer, within half an effective radius of
/// its point, or of the particle nearest to it where the lattice has moved the wall away.
#[derive(Clone, Debug)]
pub(super) struct WallPressure {
    pub name: String,
    pub slots: Vec<usize>,
    /// Way from each of these to the point, in the frame of the solid that it rides on [m].
    to_point: Vec<DVec3>,
    /// The solid that it rides on; `None` on the fixed walls.
    rides: Option<usize>,
    /// The point, from the centre of the solid in the frame of that [m].
    point: DVec3,
}

impl WallPressure {
    /// The `gauge` on one of the `layers`, with particles within `reach` [m]; `None` if there is no wall at its point.
    pub fn find(gauge: &PressureGauge, scene: &Scene, layers: &[WallLayer], reach: f64) -> Option<Self> {
        let mut point = DVec3::from(gauge.point);
        if scene.dimensions == 2 {
            point.y = 0.0;
        }
        let near = (reach, scene.spacing);
        let found = layers.iter().filter_map(|layer| {
            let found = wall_at(&layer.at, point, near, &scene.periodic).ok()?;
            let nearest = found.iter().map(|(_, way)| way.length()).fold(f64::INFINITY, f64::min);
            // of those as near, to rounding, the first
            Some((layer, found, (nearest / (1e-6 * scene.spacing)).round()))
        });
        let (layer, mut found, _) = found.min_by(|a, b| a.2.total_cmp(&b.2))?;
        // of a plate not those of its other side
        let nearest = found.iter().min_by(|a, b| a.1.length().total_cmp(&b.1.length()))?.0;
        found.retain(|(k, _)| layer.normal[*k].dot(layer.normal[nearest]) > OPPOSITE);
        let solid = layer.solid.map(|k| &scene.solids[k]);
        let frame = solid.map_or(DQuat::IDENTITY, |s| s.orientation.inverse());
        Some(Self {
            name: gauge.name.clone(),
            slots: found.iter().map(|(k, _)| layer.slots[*k]).collect(),
            to_point: found.iter().map(|(_, way)| frame * *way).collect(),
            rides: layer.solid,
            point: frame * solid.map_or(point, |s| scene.periodic.nearest(point - s.position)),
        })
    }

    /// Pressure at the point [Pa] with the solids at `poses`: of what its particles have `told`, or in a gap that is too thin for particles of
    /// the `pushes` of slots; beside the end of one of these where its particles are dry.
    pub fn read(
        &self,
        told: &[RowPressure],
        poses: &[Pose],
        (params, periodic): (&Params, &Periodic),
        pushes: &[Push],
    ) -> f64 {
        let pose = self.rides.map(|k| &poses[k]);
        let turn = pose.map_or(DQuat::IDENTITY, |pose| pose.orientation);
        let at = pose.map_or(DVec3::ZERO, |pose| pose.position) + turn * self.point;
        let out = turn * self.to_point.iter().sum::<DVec3>();
        let (mut slot, mut weights) = (0.0, 0.0);
        for push in pushes {
            let (way, normal) = (periodic.nearest(at - push.at), push.area.normalize_or_zero());
            // from row to row linear
            let weight = 1.0 - way.reject_from(normal).length() / params.spacing;
            let is_before = (normal.dot(out) > 0.0) == (self.rides == Some(push.by));
            if is_before && weight > 0.0 && way.length() < SLOT * params.spacing {
                slot += weight * push.pressure_at(way, params);
                weights += weight;
            }
        }
        let slot = if weights > 0.0 { slot / weights } else { 0.0 };
        if weights > WITHIN {
            return slot;
        }
        let of = |(row, &way): (&RowPressure, &DVec3)| {
            if row.is_dry() { slot } else { row.on_surface(turn * way, params) }
        };
        told.iter().zip(&self.to_point).map(of).sum::<f64>() / told.len() as f64
    }
}
