//! The pressure in a slot: through those at its rim.

use super::{Slot, Slots};
use crate::body::Pose;
use glam::{DMat3, DVec3};

/// Keeps the slope at bay along directions in which the rim has no extent.
const STIFFENING: f64 = 0.1;

/// The pressure in a slot, linear but for the weight of the water.
pub(super) struct Field {
    /// Middle of the rim, from the centre of mass, world axes [m].
    pub middle: DVec3,
    /// Inverse of C.
    pub inverse: DMat3,
    /// P + rho g . (middle - x) over the rim [Pa]: its mean, and its slope along xi.
    mean: f64,
    slope: DVec3,
    pub any_wet: bool,
    /// Pressure below which there is air [Pa].
    pub lowest: f64,
    /// Axes of the body's frame, and least and largest xi of the rim along each.
    axes: DMat3,
    ends: [DVec3; 2],
}

impl Field {
    /// xi of a row at `place`, with `spacing` for l0: no farther out than the rim.
    pub fn xi(&self, place: DVec3, spacing: f64) -> DVec3 {
        let xi = (place - self.middle) / spacing;
        let along = self.axes.transpose() * xi;
        let [low, high] = self.ends;
        let within = along.clamp(low, high);
        if within == along { xi } else { self.axes * within }
    }
}

impl Slots {
    /// Pressure below which there is air in a slot with these pressures at its rim [Pa]: where water pulls none comes into one that is all under
    /// water.
    pub(super) fn lowest(&self, mut told: impl Iterator<Item = f64>) -> f64 {
        if self.suction && told.all(|p| p != 0.0) { f64::NEG_INFINITY } else { 0.0 }
    }

    /// The pressure in a slot of a body at `pose` with `passing` rows of its rim, which lie at `place`; `lowest` as [`Self::lowest`] tells.
    pub(super) fn field(
        &self,
        pose: &Pose,
        passing: &[(usize, f64)],
        place: impl Fn(usize) -> DVec3,
        lowest: f64,
    ) -> Field {
        let count = passing.len() as f64;
        let middle = passing.iter().map(|&(n, _)| place(n)).sum::<DVec3>() / count;
        let xi = |n: usize| (place(n) - middle) / self.spacing;
        let outer = |v: DVec3| DMat3::from_cols(v.x * v, v.y * v, v.z * v);
        let spread = passing.iter().map(|&(n, _)| outer(xi(n))).fold(DMat3::ZERO, |sum, m| sum + m);
        let inverse = (spread + DMat3::from_diagonal(DVec3::splat(STIFFENING * count))).inverse();
        let level = |&(n, p): &(usize, f64)| p - self.weight.dot(place(n) - middle);
        let mean = passing.iter().map(level).sum::<f64>() / count;
        let slope = inverse * passing.iter().map(|row| level(row) * xi(row.0)).sum::<DVec3>();
        let axes = DMat3::from_quat(pose.orientation);
        let along = || passing.iter().map(|row| axes.transpose() * xi(row.0));
        let ends = [along().fold(DVec3::INFINITY, DVec3::min), along().fold(DVec3::NEG_INFINITY, DVec3::max)];
        Field {
            middle,
            inverse,
            mean,
            slope,
            any_wet: passing.iter().any(|&(_, p)| p != 0.0),
            lowest,
            axes,
            ends,
        }
    }

    /// Where the pressures are that a slot's field goes through, `told` as in [`Self::passed_on`]: at the rows, and P = 0 of a dry rim where the
    /// slot ends there.
    pub(super) fn places<'a>(
        &'a self,
        slot: &'a Slot,
        pose: &'a Pose,
        told: &'a [(usize, f64)],
    ) -> impl Fn(usize) -> DVec3 + 'a {
        let any_wet = told.iter().any(|&(_, p)| p != 0.0);
        let offset = &self.layers[slot.solid].offset;
        move |n| {
            let dry = slot.rim.binary_search(&n).ok().filter(|&at| any_wet && told[at].1 == 0.0);
            pose.orientation * dry.map_or(offset[n], |at| slot.edge[at])
        }
    }

    /// Pressure of the `field` of a slot on a body's surface, at `x` by a row at `place` [Pa].
    pub(super) fn in_slot(&self, field: &Field, place: DVec3, x: DVec3) -> f64 {
        let xi = field.xi(place, self.spacing);
        field.mean + field.slope.dot(xi) + self.weight.dot(x - field.middle)
    }

    /// Those of the `rows` of a rim that pass their pressure on, with it: all but those in the air above the water's
    /// level; all of them where none is under water.
    pub(super) fn passing(
        &self,
        rows: Vec<(usize, f64)>,
        place: impl Fn(usize) -> DVec3,
    ) -> Vec<(usize, f64)> {
        // Pressure that the row's height and the water above it make: P at the height of the centre of mass.
        let level = |&(n, p): &(usize, f64)| p - self.weight.dot(place(n));
        let wet = rows.iter().filter(|(_, p)| *p != 0.0);
        let highest = wet.map(level).fold(f64::NEG_INFINITY, f64::max);
        if highest == f64::NEG_INFINITY {
            return rows;
        }
        rows.into_iter().filter(|row| row.1 != 0.0 || level(row) <= highest).collect()
    }
}
