//! Open faces of boxes: they have no particles, "because nothing reaches them". Water that does runs into the box.

use super::build::Builder;
use super::lattice::{Cells, FLUID, FREE, REACHED};
use crate::case::{TANK_FACES, face};
use crate::error::Problem;

impl Builder<'_> {
    /// Refuses open faces beside which water stands at the start, and tells of those that nothing covers.
    pub(super) fn open_faces(&mut self) {
        let case = self.case;
        if case.fluid.is_none() {
            return;
        }
        let obstacles = case.obstacle.iter().enumerate();
        let obstacles = obstacles
            .map(|(k, o)| (format!("obstacle.{k}"), format!("obstacle `{}`", o.name), o.corners(), &o.open));
        let walls = case.moving_wall.iter().enumerate();
        let walls = walls.map(|(k, w)| {
            (format!("moving_wall.{k}"), format!("moving wall `{}`", w.name), w.corners(), &w.open)
        });
        for (key, label, corners, open) in obstacles.chain(walls) {
            let Some((min, max)) = corners else { continue };
            let cells = self.lattice.cells(min.into(), max.into());
            for (k, &(side, _)) in TANK_FACES.iter().enumerate() {
                if !open.contains(&side) || (self.lattice.plane && k / 2 == 1) {
                    continue;
                }
                let name = face(side);
                let (wet, bare) = self.before(cells, k);
                if wet > 0 {
                    let message = format!(
                        "{label}: water stands before {wet} cells of its open face {name}, and would run into it"
                    );
                    self.problems.push(Problem::new(
                        format!("{key}.open"),
                        message,
                        format!(
                            "take \"{name}\" out of its `open`: a face that water reaches needs its particles"
                        ),
                    ));
                } else if bare > 0 {
                    self.notes.push(format!(
                        "{label}: nothing covers its open face {name}: water that comes there runs into it; take \"{name}\" out of \
                         its `open` if any does"
                    ));
                }
            }
        }
    }

    /// Cells with water and without anything before the face `k` of a box of `cells`, within the tank.
    fn before(&self, cells: Cells, k: usize) -> (usize, usize) {
        let (axis, mut layer) = (k / 2, cells);
        if k.is_multiple_of(2) {
            (layer.lo[axis], layer.hi[axis]) = (cells.lo[axis] - 1, cells.lo[axis]);
        } else {
            (layer.lo[axis], layer.hi[axis]) = (cells.hi[axis], cells.hi[axis] + 1);
        }
        let (mut wet, mut bare) = (0, 0);
        for c in layer.iter().filter(|&c| self.tank.is_none_or(|tank| tank.contains(self.grid.wrap(c)))) {
            match self.grid.get(self.grid.wrap(c)) {
                FLUID => wet += 1,
                FREE | REACHED => bare += 1,
                _ => {}
            }
        }
        (wet, bare)
    }
}
