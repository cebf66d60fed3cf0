//! What the lattice makes of lengths and places of a case, and what may not reach over periodic sides.

use super::build::{AXES, Builder};
use super::oriented::Placed;
use crate::case;
use crate::error::Problem;
use glam::DVec3;

impl Builder<'_> {
    /// Whether a box of the lattice ends at the periodic sides; a problem if not.
    pub(super) fn on_lattice(
        &mut self,
        key: &str,
        label: &str,
        (min, max): (case::Vector, case::Vector),
    ) -> bool {
        let cells = self.lattice.cells(min.into(), max.into());
        let Some(tank) = self.tank else { return true };
        let over =
            |k: usize| self.periodic.is_along(k) && (cells.lo[k] < tank.lo[k] || cells.hi[k] > tank.hi[k]);
        let Some((k, (low, high))) =
            (0..3).filter(|&k| over(k)).find_map(|k| Some((k, self.periodic.sides(k)?)))
        else {
            return true;
        };
        let (axis, from, to) = (AXES[k], min[k], max[k]);
        let message =
            format!("{label} spans {axis} = {from} to {to} m, over the periodic sides at {low} and {high} m");
        let remedy = "end it at the side, and put the rest, if there is any, at the opposite one";
        self.problems.push(Problem::new(
            format!("{key}.{}", if from < low { "min" } else { "max" }),
            message,
            remedy,
        ));
        false
    }

    /// Complains of a solid of any shape that reaches over a periodic side: half of it would be missing at the other
    /// one. A fixed one that spans the whole axis goes on there.
    pub(super) fn seams(&mut self, key: &str, what: &str, name: &str, shape: &Placed, fixed: bool) {
        self.crosses(key, &format!("{what} `{name}`"), shape.ends(), fixed);
    }

    /// The same of what reaches from one corner to another [m] and is called by its `label`; `true` if it does.
    pub(super) fn crosses(&mut self, key: &str, label: &str, ends: (DVec3, DVec3), fixed: bool) -> bool {
        let ((start, end), slack) = (ends, 1e-6 * self.lattice.spacing);
        for k in 0..3 {
            let Some((low, high)) = self.periodic.sides(k) else { continue };
            let (from, to) = (start[k], end[k]);
            let over = from < low - slack || to > high + slack;
            if over && !(fixed && from <= low + slack && to >= high - slack) {
                let axis = AXES[k];
                let message = format!(
                    "{label} reaches from {axis} = {from:.4} to {to:.4} m, over a periodic side \
                     at {low} or {high} m"
                );
                let remedy = format!("keep it between them, or take \"{axis}\" out of tank.periodic");
                self.problems.push(Problem::new(key, message, remedy));
                return true;
            }
        }
        false
    }

    /// Axes along which a length changed by more than 1 % of the spacing.
    pub(super) fn changed(&self, off: DVec3) -> impl Iterator<Item = usize> + use<> {
        let (limit, plane) = (0.01 * self.lattice.spacing, self.lattice.plane);
        (0..3).filter(move |&k| !(plane && k == 1) && off[k] > limit)
    }

    /// Notes that a box's faces moved to the lattice.
    pub(super) fn rounded(&mut self, label: &str, min: DVec3, max: DVec3) {
        let cells = self.lattice.cells(min, max);
        let (lo, hi) = (self.lattice.corner(cells.lo), self.lattice.corner(cells.hi));
        let off = (lo - min).abs().max((hi - max).abs());
        let lines = self.changed(off).map(|k| {
            format!("{} {:.4}..{:.4} m becomes {:.4}..{:.4} m", AXES[k], min[k], max[k], lo[k], hi[k])
        });
        let line = lines.collect::<Vec<_>>().join(", ");
        if !line.is_empty() {
            self.notes.push(format!("{label}: {line} at spacing {}", self.lattice.spacing));
        }
    }

    /// Notes that a box has no particles in `cells` in which walls stand; one that `moves` takes the holes along.
    pub(super) fn taken(&mut self, label: &str, cells: usize, moves: bool) {
        let holes = ": it has holes there, which go along as it moves; let it begin clear of them";
        if cells > 0 {
            let holes = if moves { holes } else { "" };
            self.notes
                .push(format!("{label}: {cells} cells left to the walls that already stand there{holes}"));
        }
    }

    /// What of whole cells becomes of the `level` [m] of a fill, the water from particle `from` on, for its note.
    pub(super) fn rounded_level(&self, level: f64, from: usize) -> String {
        let l0 = self.lattice.spacing;
        let top = self.water.cell[from..].iter().map(|&c| self.lattice.center(c).z + 0.5 * l0);
        let top = top.fold(f64::NEG_INFINITY, f64::max);
        // What stops further below stops at a lid.
        if !(0.01..0.51).contains(&((level - top).abs() / l0)) {
            return String::new();
        }
        format!(", level {level:.4} m becomes {top:.4} m at spacing {l0}")
    }

    /// Where the water from particle `from` on lies, for a note: a fill that stops at a wall, or runs round it, is seen by that.
    pub(super) fn reach_of_water(&self, from: usize) -> String {
        let Self { water, lattice, .. } = self;
        let cells = &water.cell[from..];
        let Some(ends) = cells.iter().map(|&c| (c, c)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else {
            return String::new();
        };
        let half = DVec3::splat(0.5 * lattice.spacing);
        let (low, high) = (lattice.center(ends.0) - half, lattice.center(ends.1) + half);
        let axes = (0..3).filter(|&k| !(lattice.plane && k == 1));
        let reach = axes.map(|k| format!("{} {:.4}..{:.4}", AXES[k], low[k], high[k]));
        format!(", {} m", reach.collect::<Vec<_>>().join(", "))
    }
}
