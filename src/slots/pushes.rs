//! What slots press on what stands opposite to a body: the reaction of what they press on bodies.

use super::{Field, Found, Slots, Voids};
use crate::body::Pose;
use crate::contact::broad::meeting_images;
use crate::error::Result;
use crate::params::Params;
use glam::DVec3;
use std::collections::HashMap;

/// What a body's slot lies before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Opposite {
    /// One of the fixed walls' particles.
    Wall(usize),
    /// A solid by its index, and the row of its layer.
    Solid(usize, usize),
}

/// What the water in a slot presses on what stands opposite to the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Index of the solid whose slot it is.
    pub by: usize,
    /// The row of its layer.
    pub row: usize,
    /// What it acts on.
    pub on: Opposite,
    /// Where [m].
    pub at: DVec3,
    /// Pressure [Pa].
    pub pressure: f64,
    /// Area, out of the body and into what it acts on [m2].
    pub area: DVec3,
}

impl Push {
    /// The pressure a `way` off [m], with the weight of the water between [Pa]; none where either is dry.
    pub fn pressure_at(&self, way: DVec3, params: &Params) -> f64 {
        let pressure = self.pressure + params.density * params.gravity.dot(way);
        match self.pressure {
            0.0 => 0.0,
            _ if params.suction => pressure,
            _ => pressure.max(0.0),
        }
    }

    /// Its area as a face that looks along `normal` counts it [m2].
    pub fn area_on(&self, normal: DVec3) -> DVec3 {
        self.area.dot(normal) * normal
    }
}

impl Slots {
    /// Whether a free body is so near a driven solid that they may have a slot between them, with the solids at `poses`.
    pub fn any_at_driven(&self, poses: &[Pose]) -> bool {
        let boxes = self.boxes(poses);
        let meet = meeting_images(&boxes, &self.periodic);
        let presses = |a: usize, b: usize| self.layers[a].free && self.layers[b].is_pressed();
        meet.into_iter().any(|(a, b, _)| presses(a, b) || presses(b, a))
    }

    /// Forces of the water in slots on walls and solids with the solids at `poses`: equal and opposite to what it presses on the bodies
    /// there, with `voids` as [`Self::press`] found them and what is `pressed` by solid and row [Pa] as these come nearer or go. `read` tells pressures of slots of particles [Pa]; a slot with
    /// a dry rim presses nothing.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn pushes(
        &self,
        poses: &[Pose],
        voids: &Voids,
        pressed: &HashMap<(usize, usize), f64>,
        read: impl FnOnce(&[usize]) -> Result<Vec<f64>>,
    ) -> Result<Vec<Push>> {
        let found = self.find(self.lying(poses), poses, voids);
        let pressure = self.at_rims(&found, read)?;
        let of = |(f, told): (&Found, &Vec<(usize, f64)>)| {
            let Some(field) = self.field_of(&found, &pressure, (f, told), poses) else { return vec![] };
            let (layer, pose) = (&self.layers[f.slot.solid], &poses[f.slot.solid]);
            let areas = layer.areas(&layer.area, f, pose);
            let beside = |n: usize| pressed.get(&(f.slot.solid, n)).copied().unwrap_or_default();
            self.pushes_of(f, &areas, Some(&field), pose, beside, |_| true)
        };
        Ok(found.iter().zip(&pressure).flat_map(of).collect())
    }

    /// The pressure in one of the slots `found`, whose rim has the pressures `told`, by its own rim or by those of others that lend it theirs; `None`
    /// where it is dry. `pressure` is that of all rims.
    pub(super) fn field_of(
        &self,
        found: &[Found],
        pressure: &[Vec<(usize, f64)>],
        (f, told): (&Found, &Vec<(usize, f64)>),
        poses: &[Pose],
    ) -> Option<Field> {
        let (slot, pose) = (&f.slot, &poses[f.slot.solid]);
        if slot.rim.is_empty() {
            return self.lent(found, pressure, f, poses);
        }
        let passing = self.passing(told.clone(), |n| pose.orientation * self.layers[slot.solid].offset[n]);
        let lowest = self.lowest(told.iter().map(|row| row.1));
        Some(self.field(pose, &passing, self.places(slot, pose, told), lowest)).filter(|field| field.any_wet)
    }

    /// What the water of the `field` in the slot `found` presses with the `areas` of its rows on that of what they look onto which `is_pressed`,
    /// with what presses `beside` that on each row [Pa].
    pub(super) fn pushes_of(
        &self,
        found: &Found,
        areas: &[DVec3],
        field: Option<&Field>,
        pose: &Pose,
        beside: impl Fn(usize) -> f64,
        is_pressed: impl Fn(Opposite) -> bool,
    ) -> Vec<Push> {
        let Found { slot, faced, .. } = found;
        let layer = &self.layers[slot.solid];
        let mut out = vec![];
        for (&(n, share), &area) in slot.inside.iter().zip(areas) {
            for (area, at) in layer.faces(n, area, pose) {
                let on = faced[n].before(pose.orientation.inverse() * area);
                if let Some(on) = on.filter(|&on| is_pressed(on)) {
                    let there = field.map_or(0.0, |field| self.before(field, slot.solid, pose, n, at));
                    let (at, area) = (pose.position + at, share * area);
                    out.push(Push { by: slot.solid, row: n, on, at, pressure: there + beside(n), area });
                }
            }
        }
        out
    }
}
