//! A part of the particles of a scene.

use super::{Groups, Kind, Scene, Solid};
use glam::DVec3;
use std::ops::Range;

/// What a part has of the particles that never move, by their numbers among those, rising: walls, and dummies.
pub(crate) type Still = [Vec<u32>; 2];

impl Groups {
    /// Slots of the solids of a part, of what never moves `still` alone, all of it if nothing is named: those that carry pressure, and those that do not.
    pub(crate) fn solids_of(&self, still: Option<&Still>) -> [Vec<usize>; 2] {
        let of = |group: usize, all: Range<usize>| -> Vec<usize> {
            still.map_or_else(
                || all.clone().collect(),
                |still| still[group].iter().map(|&k| all.start + k as usize).collect(),
            )
        };
        let walls = of(0, self.static_wall_range());
        let dummies = of(1, self.pressure()..self.static_range().end);
        [
            self.moving_wall_range().chain(walls).collect(),
            dummies.into_iter().chain(self.moving_dummy_range()).collect(),
        ]
    }

    /// Groups of a part with so many slots of water, and these of solids.
    pub(crate) fn of_part(&self, fluid: usize, [carriers, dummies]: &[Vec<usize>; 2]) -> Self {
        Self {
            fluid,
            static_wall: carriers.len() - self.moving_wall,
            static_dummy: dummies.len() - self.moving_dummy,
            ..*self
        }
    }
}

impl Scene {
    /// The water of the slots `own` in `slots` slots, and that of `held` as dummies: it stands still and carries no pressure. All solids, but of
    /// what never moves `still` alone.
    pub(crate) fn part(&self, own: &[usize], slots: usize, held: &[usize], still: Option<&Still>) -> Self {
        let (all, parked) = (self.groups, slots - own.len());
        let solids_of = all.solids_of(still);
        let mut groups = all.of_part(slots, &solids_of);
        groups.static_dummy += held.len();
        let [carriers, dummies] = solids_of;
        let lay = |of: &[DVec3], rest: DVec3| -> Vec<DVec3> {
            let water = own.iter().map(|&i| of[i]).chain(std::iter::repeat_n(rest, parked));
            water.chain(carriers.iter().chain(held).chain(&dummies).map(|&i| of[i])).collect()
        };
        let water = own.iter().map(|_| Kind::Fluid).chain(std::iter::repeat_n(Kind::Ghost, parked));
        let of = |i: &usize| self.kind[*i];
        let solids_kinds = carriers.iter().map(of).chain(held.iter().map(|_| Kind::Dummy));
        let none = |n: usize| std::iter::repeat_n(0, n);
        let solid_of = |i: &usize| self.solid[*i];
        let mut solids = self.solids.clone();
        let by = slots as isize - all.fluid as isize;
        let by_dummies = groups.moving_dummy_range().start as isize - all.moving_dummy_range().start as isize;
        solids.iter_mut().for_each(|solid| solid.move_slots(by, by_dummies));
        Self {
            position: lay(&self.position, self.domain.0),
            velocity: lay(&self.velocity, DVec3::ZERO),
            kind: water.chain(solids_kinds).chain(dummies.iter().map(of)).collect(),
            solid: none(slots)
                .chain(carriers.iter().map(solid_of))
                .chain(none(held.len()))
                .chain(dummies.iter().map(solid_of))
                .collect(),
            groups,
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
