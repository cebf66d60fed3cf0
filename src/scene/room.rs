//! Whether the room of water that fills it keeps its size while solids are driven through it.

use super::build::Builder;
use super::lattice::{FACE, FLUID, FREE};
use super::opening::Passes;
use super::oriented::Placed;
use super::{Drive, Solid};
use crate::periodic::Periodic;
use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// Part of a room by which it may grow or shrink and counts as of one size: the water's density bears it.
const SAME_ROOM: f64 = 0.01;
/// Instants of the run at which the room is looked at.
const LOOKS: u32 = 64;

/// A solid in the way of the flood, and the corners of the box around it [m].
struct Barrier {
    shape: Placed,
    low: DVec3,
    high: DVec3,
}

impl Barrier {
    /// Those of its images that reach between the periodic sides, itself included if it does.
    fn images(shape: Placed, periodic: &Periodic) -> impl Iterator<Item = Self> + use<> {
        let (reach, periodic) = (shape.bounds(), *periodic);
        periodic.turns(shape.center - reach, shape.center + reach).map(move |turns| {
            let center = shape.center + periodic.way(turns);
            Self { low: center - reach, high: center + reach, shape: Placed { center, ..shape } }
        })
    }

    fn holds(&self, p: DVec3) -> bool {
        p.cmpge(self.low).all() && p.cmple(self.high).all() && self.shape.holds(p, 0.0)
    }
}

impl Builder<'_> {
    /// Judges whether water that fills its room does so for all of the run, and notes it: nothing may let in or out, and driven
    /// solids may neither make room nor take it.
    pub(super) fn room(&mut self) {
        let shut = self.case.inflow.is_empty() && self.case.outflow.is_empty();
        let full = self.filled;
        self.filled = full && shut && self.keeps_room();
        if self.filled {
            self.notes.push("the water fills all its room: the smallest pressure is 0".into());
        } else if full && !shut && self.openings.iter().all(|o| !matches!(o.opening.passes, Passes::Free)) {
            self.notes.push(
                "the water fills all its room and every opening has a rate: nothing sets the level of its pressure, which may be a hundred times \
                 the flow's; make one [[outflow]] a hole (without `velocity` and `discharge`), or open a face (tank.open)"
                    .into(),
            );
        }
    }

    /// Whether the cells that water could reach stay as many, within [`SAME_ROOM`], wherever solids are driven until the end.
    fn keeps_room(&self) -> bool {
        let (still, solids): (Vec<&Solid>, Vec<&Solid>) =
            self.moving_walls.iter().chain(&self.bodies).partition(|s| s.is_still());
        let images = |shape: Placed| Barrier::images(shape, &self.periodic);
        let driven = |s: &&Solid, t: f64| match &s.drive {
            Drive::Prescribed(motion) => Some(s.placed_at(motion, t)),
            Drive::Free(_) => None,
        };
        let at = |t: f64| -> Vec<Barrier> {
            solids.iter().filter_map(|s| driven(s, t)).flat_map(images).collect()
        };
        let start = at(0.0);
        if start.is_empty() {
            return true;
        }
        let fixed = self.fixed.shapes.iter().map(Placed::from).chain(still.iter().map(|s| s.placed()));
        let fixed: Vec<Barrier> = fixed.flat_map(images).collect();
        let within = |all: &[Barrier], p: DVec3| all.iter().any(|b| b.holds(p));
        let left = |c: IVec3| {
            let p = self.lattice.center(c);
            match self.grid.get(c) {
                FREE | FLUID => true,
                FACE => !within(&fixed, p),
                _ => within(&start, p) && !within(&fixed, p),
            }
        };
        let room = |t: f64| {
            let now = at(t);
            let open = |c: IVec3| left(c) && !within(&now, self.lattice.center(c));
            let cells = self.grid.reach(&self.water.cell, self.lattice.ways(), open);
            // A solid that turns covers now more and now fewer centres of cells: what it takes of them counts.
            cells as f64 + self.rounded_up(&now, left)
        };
        let whole = room(0.0);
        let slack = SAME_ROOM * whole;
        // Instants that keep step with no period.
        let times = (1..=LOOKS).map(|k| self.case.run.end * (f64::from(k) * 0.618_033_988_75).fract());
        let times: Vec<f64> = times.chain([self.case.run.end]).collect();
        times.into_par_iter().all(|t| (whole - room(t)).abs() <= slack)
    }

    /// By how much the cells whose centres `barriers` cover are more than the volume that they take of the cells that are `left`.
    fn rounded_up(&self, barriers: &[Barrier], left: impl Fn(IVec3) -> bool) -> f64 {
        let l0 = self.lattice.spacing;
        let mut more = 0.0;
        for (k, barrier) in barriers.iter().enumerate() {
            for c in self.lattice.cells(barrier.low - l0, barrier.high + l0).iter() {
                let p = self.lattice.center(c);
                let off = barrier.shape.distance(p) / l0;
                // Of a cell that several reach it is the first one's.
                if off.abs() < 0.5 && !barriers[..k].iter().any(|b| b.shape.distance(p) < 0.5 * l0) && left(c)
                {
                    let taken = 0.5 - off;
                    more += if off < 0.0 { 1.0 - taken } else { -taken };
                }
            }
        }
        more
    }
}
