//! Sealed cavities: what encloses them keeps water out, so none is in there that was not put in there.

use super::Solid;
use super::build::Builder;
use super::lattice::{FLUID, FREE};
use super::water::around;
use glam::IVec3;
use rayon::prelude::*;

impl Builder<'_> {
    /// Takes out what of the water laid last stands in the sealed cavities of walls.
    pub(super) fn drain_walls(&mut self) {
        let last = self.water.laid.len().saturating_sub(1);
        let walls = std::mem::take(&mut self.moving_walls);
        if walls.iter().map(|wall| self.drain(wall, last)).sum::<usize>() > 0 {
            self.water.keep_what_is_left(&self.grid);
        }
        self.moving_walls = walls;
    }

    /// Takes out of the grid what stands in the sealed cavities of a solid, of the blocks, shapes and fills from the `first` on. One that lies
    /// in there alone is meant to. Returns how many particles; [`super::water::Water::keep_what_is_left`] follows.
    pub(super) fn drain(&mut self, solid: &Solid, first: usize) -> usize {
        let shape = solid.placed();
        if !shape.has_cavities() {
            return 0;
        }
        let Self { water, grid, lattice, .. } = self;
        let near = around(&shape, lattice, grid);
        let ends = water.laid.iter().skip(1).copied().chain([water.cell.len()]);
        let mut drained = 0;
        for (from, to) in water.laid.iter().copied().zip(ends).skip(first) {
            let left = water.cell[from..to].par_iter().copied().filter(|&c| grid.get(c) == FLUID);
            let (within, beyond): (Vec<IVec3>, Vec<IVec3>) =
                left.partition(|&c| near.contains(c) && shape.in_cavity(lattice.center(c)));
            if !beyond.is_empty() {
                within.iter().for_each(|&c| grid.set(c, FREE));
                drained += within.len();
            }
        }
        if drained > 0 {
            self.notes.push(format!(
                "{} `{}`: {drained} fluid particles taken out of its sealed cavity; a fluid.block that lies in there alone, before \
                 those around the solid, fills it",
                solid.what(),
                solid.name
            ));
        }
        drained
    }
}
