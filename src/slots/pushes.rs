//! What slots press on what stands opposite to a body: the reaction of what they press on bodies.

use super::{Field, Found, Slots};
use crate::body::Pose;
use crate::contact::broad::meeting_images;
use crate::error::Result;
use glam::DVec3;

/// What a body's slot lies before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Opposite {
    /// One of the fixed walls' particles.
    Wall(usize),
    /// A solid, by its index.
    Solid(usize),
}

/// Force of the water in a slot on what stands opposite to the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// What it acts on.
    pub on: Opposite,
    /// Where [m].
    pub at: DVec3,
    /// Force [N].
    pub force: DVec3,
}

impl Slots {
    /// Whether a free body is so near a driven solid that they may have a slot between them, with the solids at `poses`.
    pub fn any_at_driven(&self, poses: &[Pose]) -> bool {
        let boxes = self.boxes(poses);
        let meet = meeting_images(&boxes, &self.periodic);
        meet.into_iter().any(|(a, b, _)| self.layers[a].free != self.layers[b].free)
    }

    /// Forces of the water in slots on walls and solids with the solids at `poses`: equal and opposite to what it presses on the bodies
    /// there. `read` tells pressures of slots of particles [Pa]; a slot with a dry rim presses nothing.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn pushes(
        &self,
        poses: &[Pose],
        read: impl FnOnce(&[usize]) -> Result<Vec<f64>>,
    ) -> Result<Vec<Push>> {
        let found = self.find(poses);
        let pressure = self.at_rims(&found, read)?;
        let of = |(f, told): (&Found, &Vec<(usize, f64)>)| {
            let (slot, pose) = (&f.slot, &poses[f.slot.solid]);
            let row_place = |n: usize| pose.orientation * self.layers[slot.solid].offset[n];
            let field = match slot.rim.is_empty() {
                true => self.lent(&found, &pressure, f, poses),
                false => {
                    let passing = self.passing(told.clone(), row_place);
                    Some(self.field(pose, &passing, self.places(slot, pose, told)))
                        .filter(|field| field.any_wet)
                }
            };
            field.map_or_else(Vec::new, |field| self.pushes_of(f, &field, pose))
        };
        Ok(found.iter().zip(&pressure).flat_map(of).collect())
    }

    fn pushes_of(&self, found: &Found, field: &Field, pose: &Pose) -> Vec<Push> {
        let Found { slot, faced, .. } = found;
        let push = |n: usize, area: DVec3| {
            let (p, on_surface) = self.on_row(field, slot.solid, pose, n);
            let on = faced[n].opposite?;
            Some(Push { on, at: pose.position + on_surface, force: faced[n].share * p * area })
        };
        let areas = self.layers[slot.solid].areas(slot, pose);
        slot.inside.iter().zip(areas).filter_map(|(row, area)| push(row.0, area)).collect()
    }
}
