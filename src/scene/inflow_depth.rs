//! How deep the water of a tank with inflows comes to be: what derives from the depth is fixed at the start.

use super::build::Builder;
use super::lattice::{BLOCKED, Cells, FLUID, FREE, SOLID};
use super::opening::Planned;
use super::water::around;
use super::{Passes, Solid};
use crate::case::HURRY;
use glam::{DVec3, IVec3};
use std::collections::HashSet;

/// Levels that are tried.
const LEVELS: u32 = 100;

/// An opening that water passes at a prescribed rate.
struct Passage<'a> {
    passes: &'a Passes,
    /// [m2].
    area: f64,
    /// Its lower and upper edge above the tank's deepest corner, along gravity [m].
    edges: [f64; 2],
    /// Of an outflow the level from which on water gets there from every inflow, over sills and weirs [m].
    sill: f64,
}

impl Passage<'_> {
    /// What comes in through it at the time `t` [s], or goes out of water that reaches to `level` [m] or higher, which counts less [m3/s].
    fn rate(&self, t: f64, level: f64) -> f64 {
        let [low, high] = self.edges;
        // One that lies has no height. Rounding makes none of it dry.
        let size = (high - low).max(1e-6 * self.area.sqrt());
        let reached = level >= self.sill - 1e-6 * self.area.sqrt();
        let wet = if reached { ((level - low) / size + 1e-6).clamp(0.0, 1.0) } else { 0.0 };
        match self.passes {
            Passes::In(speed) => speed.value(t) * self.area,
            Passes::Out(speed) => -speed.value(t) * self.area * wet,
            Passes::Drawn(discharge) => -discharge.value(t) * (HURRY * wet).min(1.0),
            // What falls out follows from the flow.
            Passes::Free => 0.0,
        }
    }
}

/// The most that a sum grows by between any two of the `times` [s], and between them, at a `rate` that is straight from one to the next.
fn largest_rise(times: &[f64], rate: impl Fn(f64) -> f64) -> f64 {
    let (mut rise, mut most) = (0.0_f64, 0.0_f64);
    for w in times.windows(2) {
        let (a, b, span) = (rate(w[0]), rate(w[1]), w[1] - w[0]);
        // Where it changes its sign the sum turns.
        let turn = if a * b < 0.0 { span * a / (a - b) } else { 0.0 };
        let at_turn = if turn > 0.0 { 0.0 } else { a };
        for part in [0.5 * a * turn, 0.5 * (at_turn + b) * (span - turn)] {
            rise = (rise + part).max(0.0);
            most = most.max(rise);
        }
    }
    most
}

impl Builder<'_> {
    /// Depth of the water that the scene comes to, along gravity [m]: at the start, up to the upper edge of an inflow above
    /// the tank's floor, or where what comes in fills the tank to beside what goes out at a prescribed rate, but no more than
    /// `fluid.max_volume`. What falls out of holes is not counted, for the flow tells how much that is.
    pub(super) fn depth_with_inflows(&self, gravity: DVec3) -> f64 {
        let (Some(tank), true) = (self.tank, gravity.length() > 0.0) else { return self.depth };
        let down = gravity.normalize();
        let (low, high) = (self.lattice.corner(tank.lo), self.lattice.corner(tank.hi));
        let size = high - low;
        let (height, holds) = (size.dot(down.abs()), size.x * size.y * size.z);
        // The corner of the tank that lies deepest.
        let falls = down.cmpgt(DVec3::ZERO);
        let deepest = DVec3::select(falls, high, low);
        let passages: Vec<Passage> = self
            .openings
            .iter()
            .map(|planned| {
                let (lo, hi) = (self.lattice.corner(planned.ends.lo), self.lattice.corner(planned.ends.hi));
                let (bottom, top) = (DVec3::select(falls, hi, lo), DVec3::select(falls, lo, hi));
                let edges = [bottom, top].map(|x| (deepest - x.clamp(low, high)).dot(down));
                let sill = self.sill(planned, tank, |c| (deepest - self.lattice.center(c)).dot(down));
                Passage { passes: &planned.opening.passes, area: planned.opening.area, edges, sill }
            })
            .collect();
        let inflows = || passages.iter().filter(|p| matches!(p.passes, Passes::In(_)));
        if inflows().next().is_none() {
            return self.depth;
        }
        let depth = inflows().map(|p| p.edges[1]).fold(self.depth, f64::max);
        let end = self.case.run.end;
        let rows = passages.iter().flat_map(|p| match p.passes {
            Passes::In(course) | Passes::Out(course) | Passes::Drawn(course) => course.times().collect(),
            Passes::Free => Vec::new(),
        });
        let mut times: Vec<f64> = rows.filter(|t| *t > 0.0 && *t < end).chain([0.0, end]).collect();
        times.sort_by(f64::total_cmp);
        let l0 = self.lattice.spacing;
        let there = self.water.cell.len() as f64 * l0.powi(3);
        // Above any level no less goes out than at that level: the water comes no higher than what it grows by from there.
        let up_to = |level: f64| {
            let rise = largest_rise(&times, |t| passages.iter().map(|p| p.rate(t, level)).sum());
            there.max(level / height * holds) + rise
        };
        let levels = (0..=LEVELS).map(|k| f64::from(k) / f64::from(LEVELS) * height);
        let levels = levels.chain(passages.iter().flat_map(|p| [p.sill, p.edges[1]]));
        let most = levels.map(up_to).fold(up_to(there / holds * height), f64::min);
        let slice = if self.lattice.plane { l0 } else { 1.0 };
        let allowed =
            self.case.fluid.as_ref().and_then(|f| f.max_volume).map_or(f64::INFINITY, |v| v * slice);
        depth.max((most.min(allowed) / holds * height).min(height))
    }
}

impl Builder<'_> {
    /// Notes when a tank that lets nothing out is full of what comes in: there is no room for more.
    pub(super) fn overfilled(&mut self) {
        let shut = self.case.outflow.is_empty() && self.case.tank.as_ref().is_some_and(|t| t.open.is_empty());
        let Some(tank) = self.tank.filter(|_| shut && !self.openings.is_empty()) else { return };
        let (l0, end) = (self.lattice.spacing, self.case.run.end);
        let taken = |body: &Solid| {
            let shape = body.placed();
            let near = around(&shape, &self.lattice, &self.grid).iter();
            near.filter(|&c| tank.contains(c) && shape.holds(self.lattice.center(c), 0.0)).count()
        };
        let bodies: usize = self.bodies.iter().map(taken).sum();
        let cells = tank.iter().filter(|&c| !matches!(self.grid.get(c), SOLID | BLOCKED)).count();
        let cells = cells.saturating_sub(bodies);
        let room = cells as f64 - self.water.cell.len() as f64;
        let slice = if self.lattice.plane { l0 } else { 1.0 };
        // Beyond `fluid.max_volume` nothing comes in: the run says so.
        let most = self.case.fluid.as_ref().and_then(|f| f.max_volume).map(|v| v * slice / l0.powi(3));
        let comes = |t: f64| {
            let of = |o: &Planned| match &o.opening.passes {
                Passes::In(speed) => speed.integral(0.0, t) * o.opening.area / l0.powi(3),
                _ => 0.0,
            };
            self.openings.iter().map(of).sum::<f64>()
        };
        if comes(end) <= room || most.is_some_and(|most| most <= cells as f64) {
            return;
        }
        let (mut before, mut full) = (0.0, end);
        for _ in 0..50 {
            let middle = 0.5 * (before + full);
            *if comes(middle) > room { &mut full } else { &mut before } = middle;
        }
        self.full = Some(full);
        self.notes.push(format!(
            "inflow: the tank is full at t = {full:.4} s, and nothing lets water out: add an [[outflow]], open a face (tank.open), or end \
             the inflow or the run before"
        ));
    }

    /// The lowest level at which the water of every inflow gets to the `outflow` within the `tank` [m], of cells with middles at `height`
    /// [m]; infinite if there is no way.
    fn sill(&self, outflow: &Planned, tank: Cells, height: impl Fn(IVec3) -> f64) -> f64 {
        let l0 = self.lattice.spacing;
        if !matches!(outflow.opening.passes, Passes::Out(_) | Passes::Drawn(_)) {
            return 0.0;
        }
        let rank = |c: IVec3| {
            let open = tank.contains(c) && matches!(self.grid.get(c), FREE | FLUID);
            open.then(|| (height(c) / l0 - 0.5).round() as i32)
        };
        let before = |planned: &Planned| {
            let out = planned.opening.outward.as_ivec3();
            planned.cells.iter().map(|c| c - out).collect::<Vec<_>>()
        };
        let there: HashSet<IVec3> = before(outflow).into_iter().collect();
        let sill = |inflow: &Planned| {
            let ways = self.lattice.ways();
            self.grid.lowest_way(before(inflow).into_iter(), ways, rank, |c| there.contains(&c))
        };
        let inflows = self.openings.iter().filter(|o| o.opening.is_inflow());
        // The upper side of the cell.
        let level = |rank: Option<i32>| rank.map_or(f64::INFINITY, |r| (f64::from(r) + 1.0) * l0);
        inflows.map(|inflow| level(sill(inflow))).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::largest_rise;

    #[test]
    fn a_sum_rises_most_between_its_turns() {
        // 1.25 up, 0.5 down, 1.375 up, and down from there.
        let rate = |t: f64| [1.0, 1.0, -1.0, 1.0, 1.0, -3.0][t as usize];
        assert_eq!(largest_rise(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], rate), 2.125);
        assert_eq!(largest_rise(&[0.0, 1.0], |_| -1.0), 0.0);
        assert_eq!(largest_rise(&[0.0, 2.0], |t| t), 2.0);
    }
}
