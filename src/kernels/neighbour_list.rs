//! Neighbour list: all particles within the effective radius, first those that carry pressure, then the dummies. With the
//! balanced source ([`crate::scheme::Source::Mixed`]) no wall carries pressure to a wall: its layer holds no water that
//! could flow along it, and none to water behind a moving solid ([`in_front`]).
//! GPU twin: shaders/neighbour_list.wgsl

use super::cell_list::CellList;
use crate::cells::{Column, Grid};
use glam::DVec3;

/// Cosine of the angle beyond which water lies behind a wall particle: rows on the corner of a box see it at -0.58 through the solid, and beside
/// the edge of one at -0.5.
pub const BEHIND: f64 = 0.54;

/// Whether water at `r` from a particle of a solid's wall layer lies before the solid, whose direction outwards is `outward` (of length 1, or 0
/// where there is none). Solids of less than 2.5 spacings are thinner than the effective radius reaches. Their rows would carry the pressure of water
/// behind them, and answer the body's motion with an area that no water of theirs stands at.
#[inline(always)]
pub fn in_front(r: DVec3, outward: DVec3) -> bool {
    r.dot(outward) >= -BEHIND * r.length()
}

/// Directions outwards of the wall layer of moving solids.
#[derive(Clone, Copy, Default)]
pub struct Outward<'a> {
    /// Slot of the first.
    pub first: usize,
    /// One a slot [-]; none where walls carry the pressure of all that is near.
    pub of: &'a [DVec3],
}

impl Outward<'_> {
    /// That of slot `i`, if it has one.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Option<DVec3> {
        self.of.get(i.wrapping_sub(self.first)).copied()
    }
}

/// The particles by cell, as a search walks them.
#[derive(Clone, Copy)]
pub struct Candidates<'a> {
    /// The grid.
    pub grid: &'a Grid,
    /// Start of each cell in the fluid slots.
    pub fluid_start: &'a [u32],
    /// Moving solids, if the scene has any.
    pub moving: Option<&'a CellList>,
    /// Fixed walls, if the scene has any.
    pub fixed: Option<&'a CellList>,
    /// Slots below this carry pressure to water.
    pub pressure_slots: u32,
    /// Slots below this carry pressure to walls.
    pub wall_carriers: u32,
    /// Where moving solids face.
    pub outward: Outward<'a>,
}

/// Neighbours of slot `i` within `radius` [m], and how many of them carry pressure.
pub fn neighbour_list(i: u32, radius: f64, from: &Candidates, position: &[DVec3]) -> (Vec<u32>, usize) {
    let x = position[i as usize];
    let offset = |j: u32| from.grid.periodic.nearest(position[j as usize] - x);
    let near = |&j: &u32| j != i && offset(j).length_squared() < radius * radius;
    let columns = || from.grid.columns(from.grid.coordinates(x));
    let range = |start: &[u32], column: Column| start[column.first]..start[column.last + 1];
    let is_water = from.fluid_start.last().is_some_and(|&end| i < end);
    let carry = if is_water { from.pressure_slots } else { from.wall_carriers };
    let (mut carriers, mut dummies) = (Vec::new(), Vec::new());
    let own = from.outward.get(i as usize);
    for column in columns() {
        let before = |&j: &u32| own.is_none_or(|outward| in_front(offset(j), outward));
        let (carrying, rest): (Vec<u32>, Vec<u32>) =
            range(from.fluid_start, column).filter(near).partition(before);
        carriers.extend(carrying);
        dummies.extend(rest);
    }
    for column in columns() {
        for list in [from.moving, from.fixed].into_iter().flatten() {
            let slots = range(&list.start, column).map(|k| list.slot[k as usize]).filter(near);
            let before = |j: u32| from.outward.get(j as usize).is_none_or(|out| in_front(-offset(j), out));
            let (carrying, rest): (Vec<u32>, Vec<u32>) =
                slots.partition(|&j| j < carry && (!is_water || before(j)));
            carriers.extend(carrying);
            dummies.extend(rest);
        }
    }
    let count = carriers.len();
    carriers.extend(dummies);
    (carriers, count)
}
