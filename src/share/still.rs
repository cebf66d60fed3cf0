//! Walls that never move: each rank has those near its slab, and gets others when the tank is cut anew.

use super::Share;
use super::cut::{REACH, within};
use crate::cells::Grid;
use crate::fields::Fields;
use crate::ranks::beside;
use crate::scene::Still;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use std::ops::Range;

/// A particle of a wall that never moves, on its way to another rank.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct StillParticle {
    /// [m]
    pub position: DVec3,
    /// [Pa], of a wall layer.
    pub pressure: f64,
    /// What this step has told so far of the force on a wall layer [N], where that is kept ([`Fields::reaction`]).
    pub reaction: DVec3,
    /// 0 of a wall layer, 1 of a dummy.
    group: u32,
    /// Among all of its group.
    number: u32,
}

impl Share {
    /// Number of the `k`-th of the wall layers here among those of all ranks.
    pub(super) fn wall_number(&self, k: usize) -> usize {
        let moving = self.all.moving_wall;
        match &self.still {
            Some([walls, _]) if k >= moving => moving + walls[k - moving] as usize,
            _ => k,
        }
    }

    /// The slot here of the slot `i` of a single rank, if it is that of a solid that this rank has.
    pub fn here(&self, i: usize) -> Option<usize> {
        let Some([walls, dummies]) = &self.still else {
            return i.checked_sub(self.all.fluid).map(|k| k + self.groups.fluid);
        };
        let (all, here) = (&self.all, &self.groups);
        let (still, inside) = (all.static_wall_range(), all.moving_dummy_range());
        let among = |numbers: &[u32], first: usize| numbers.binary_search(&((i - first) as u32)).ok();
        if i < all.fluid {
            None
        } else if i < still.start {
            Some(i - all.fluid + here.fluid)
        } else if i < still.end {
            among(walls, still.start).map(|k| here.static_wall_range().start + k)
        } else if i < inside.start {
            among(dummies, still.end).map(|k| here.pressure() + k)
        } else {
            Some(i - inside.start + here.moving_dummy_range().start)
        }
    }

    /// The walls that never move of `columns` here; nothing where every rank has all of them.
    pub(super) fn still_of(
        &self,
        columns: Range<u32>,
        fields: &Fields,
        grid: &Grid,
    ) -> Option<Vec<StillParticle>> {
        let numbers = self.still.as_ref()?;
        let firsts = [self.groups.static_wall_range().start, self.groups.pressure()];
        let of = |group: usize| {
            let (first, columns) = (firsts[group], columns.clone());
            let particle = move |(k, &number): (usize, &u32)| {
                let position = fields.position[first + k];
                let carrier = (group == 0).then_some(first + k);
                let pressure = carrier.map_or(0.0, |i| fields.pressure[i]);
                let reaction = carrier.and_then(|i| fields.reaction.get(i - self.groups.fluid).copied());
                let there = columns.contains(&grid.coordinates(position)[0]);
                there.then_some(StillParticle {
                    position,
                    pressure,
                    reaction: reaction.unwrap_or_default(),
                    group: group as u32,
                    number,
                })
            };
            numbers[group].iter().enumerate().filter_map(particle)
        };
        Some(of(0).chain(of(1)).collect())
    }

    /// Hands on `own`, those of the columns that this rank had before the tank was cut anew, until each has what is near its slab; returns these, wall
    /// layers first, in the order of their numbers, and takes over which they are.
    pub(super) fn hand_on_still(
        &mut self,
        mut own: Vec<StillParticle>,
        grid: &Grid,
    ) -> [Vec<StillParticle>; 2] {
        let column = |s: &StillParticle| grid.coordinates(s.position)[0];
        self.migrate_alone(&mut own, |s| Some(column(s)));
        let [before, after] = beside(self.rank(), self.ranks(), self.ring);
        let mut here = own;
        // Slabs may be narrower than what lies near them: what comes from one side is handed on to the other.
        for _ in 0..REACH {
            let give = |to: Option<usize>| {
                let Some(rank) = to else { return Vec::new() };
                let near: Vec<u32> = within(REACH, &self.cuts, rank, self.ring).collect();
                let needed: Vec<StillParticle> =
                    here.iter().filter(|s| near.contains(&column(s))).copied().collect();
                bytemuck::cast_slice(&needed).to_vec()
            };
            for bytes in self.pass(give(before), give(after)) {
                here.extend(bytemuck::pod_collect_to_vec::<u8, StillParticle>(&bytes));
            }
            here.sort_unstable_by_key(|s| (s.group, s.number));
            here.dedup_by_key(|s| (s.group, s.number));
        }
        let near: Vec<u32> = within(REACH, &self.cuts, self.rank(), self.ring).collect();
        here.retain(|s| near.contains(&column(s)));
        let dummies = here.split_off(here.partition_point(|s| s.group == 0));
        let numbers: Still = [&here, &dummies].map(|of| of.iter().map(|s| s.number).collect());
        self.still = Some(numbers);
        [here, dummies]
    }
}
