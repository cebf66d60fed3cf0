//! A part of the water of a scene, with all its solids.

use super::{Groups, Kind, Scene, Solid};
use glam::DVec3;

impl Scene {
    /// The water of the slots `own` in `slots` slots, and that of `held` as dummies: it stands still and carries no pressure.
    pub(crate) fn part(&self, own: &[usize], slots: usize, held: &[usize]) -> Self {
        let (all, carriers, parked) = (self.groups.fluid, self.groups.pressure(), slots - own.len());
        let (walls, dummies) = (all..carriers, carriers..self.groups.total());
        let lay = |of: &[DVec3], rest: DVec3| -> Vec<DVec3> {
            let water = own.iter().map(|&i| of[i]).chain(std::iter::repeat_n(rest, parked));
            let still = held.iter().map(|&i| of[i]);
            let (walls, dummies) = (of[walls.clone()].iter(), of[dummies.clone()].iter());
            water.chain(walls.copied()).chain(still).chain(dummies.copied()).collect()
        };
        let water = own.iter().map(|_| Kind::Fluid).chain(std::iter::repeat_n(Kind::Ghost, parked));
        let walls_of = self.kind[walls.clone()].iter().copied();
        let dummies_of = held.iter().map(|_| Kind::Dummy).chain(self.kind[dummies.clone()].iter().copied());
        let none = |n: usize| std::iter::repeat_n(0, n);
        let (solid_walls, solid_dummies) =
            (self.solid[walls.clone()].iter(), self.solid[dummies.clone()].iter());
        let mut solids = self.solids.clone();
        let by = slots as isize - all as isize;
        solids.iter_mut().for_each(|solid| solid.move_slots(by, by + held.len() as isize));
        Self {
            position: lay(&self.position, self.domain.0),
            velocity: lay(&self.velocity, DVec3::ZERO),
            kind: water.chain(walls_of).chain(dummies_of).collect(),
            solid: none(slots)
                .chain(solid_walls.copied())
                .chain(none(held.len()))
                .chain(solid_dummies.copied())
                .collect(),
            groups: Groups {
                fluid: slots,
                static_dummy: self.groups.static_dummy + held.len(),
                ..self.groups
            },
            reserve: parked,
            openings: self.openings.clone(),
            solids,
            walls: Vec::new(),
            static_wall_normal: Vec::new(),
            static_wall_shape: Vec::new(),
            notes: Vec::new(),
            ..*self
        }
    }
}

impl Solid {
    /// Its slots come `walls` and `dummies` later, or earlier.
    pub(crate) fn move_slots(&mut self, walls: isize, dummies: isize) {
        for (range, by) in [(&mut self.wall_slots, walls), (&mut self.dummy_slots, dummies)] {
            *range = range.start.saturating_add_signed(by)..range.end.saturating_add_signed(by);
        }
    }
}
