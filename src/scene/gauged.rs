//! What gauges of the case have at their places.

use super::build::Builder;
use super::oriented::Placed;
use super::{Solid, point, wall_at};
use crate::case::{PressureGauge, Vector, VelocityGauge};
use crate::error::Problem;
use glam::DVec3;

/// Depth below the surface of a solid at which a place is inside it, over the spacing: in two dimensions solids are half a spacing deep at most.
const INSIDE: f64 = 0.4;

impl Builder<'_> {
    /// A pressure gauge averages over the wall particles near its point: there must be some.
    pub(super) fn gauges(&mut self) {
        let l0 = self.lattice.spacing;
        let near = (0.5 * self.case.run.effective_radius * l0, l0);
        // Of the solids in openings no gauge tells anything.
        let solids = self.solids_of_case().flat_map(Solid::wall_positions);
        let walls: Vec<DVec3> = self.fixed.wall.iter().copied().chain(solids).collect();
        let wrong = |(k, gauge): (usize, &PressureGauge)| {
            let at = self.place(gauge.point);
            let (key, name) = (format!("gauge.pressure.{k}.point"), &gauge.name);
            let nearest = wall_at(&walls, at, near, &self.periodic).err()?;
            let hint = nearest.map_or("there are no walls".to_string(), |nearest| {
                format!("the nearest stands at {}", point(nearest))
            });
            let message = format!("gauge.pressure `{name}` at {}: no wall or body there, {hint}", point(at));
            let remedy = "move the point onto one; where water comes in or goes out there is none";
            Some(Problem::new(key, message, remedy))
        };
        let gauges = self.case.gauge.pressure.iter().enumerate().filter(|_| !self.lacks_walls);
        let problems: Vec<Problem> = gauges.filter_map(wrong).collect();
        self.problems.extend(problems);
        let notes: Vec<String> =
            self.case.gauge.velocity.iter().filter_map(|gauge| self.covered(gauge)).collect();
        self.notes.extend(notes);
    }

    /// A point of the case [m], in the plane in two dimensions.
    fn place(&self, point: Vector) -> DVec3 {
        let at = DVec3::from(point);
        if self.lattice.plane { at.with_y(0.0) } else { at }
    }

    /// What there is to say of a velocity gauge inside a solid that stays: no water ever comes there.
    fn covered(&self, gauge: &VelocityGauge) -> Option<String> {
        let at = self.place(gauge.point);
        let inside = |shape: &Placed| shape.distance(at) < -INSIDE * self.lattice.spacing;
        let wall =
            self.fixed.shapes.iter().find(|wall| inside(&Placed::from(*wall))).map(|wall| wall.name.clone());
        let still =
            || self.solids_of_case().find(|s| s.stays() && inside(&s.placed())).map(|s| s.name.clone());
        let name = wall.or_else(still)?;
        Some(format!(
            "gauge.velocity `{}`: it lies inside `{name}`, where no water comes: its cells stay empty",
            gauge.name
        ))
    }
}
