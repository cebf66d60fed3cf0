//! Neighbour list: all particles within the effective radius, first those that carry pressure, then the dummies. With the
//! balanced source ([`crate::scheme::Source::Mixed`]) no wall carries pressure to a wall: its layer holds no water that
//! could flow along it.
//! GPU twin: shaders/neighbour_list.wgsl

use super::cell_list::CellList;
use crate::cells::{Column, Grid};
use glam::DVec3;

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
    let mut carriers = Vec::new();
    for column in columns() {
        carriers.extend(range(from.fluid_start, column).filter(near));
    }
    let mut dummies = Vec::new();
    for column in columns() {
        for list in [from.moving, from.fixed].into_iter().flatten() {
            let slots = range(&list.start, column).map(|k| list.slot[k as usize]).filter(near);
            let (carrying, rest): (Vec<u32>, Vec<u32>) = slots.partition(|&j| j < carry);
            carriers.extend(carrying);
            dummies.extend(rest);
        }
    }
    let count = carriers.len();
    carriers.extend(dummies);
    (carriers, count)
}
