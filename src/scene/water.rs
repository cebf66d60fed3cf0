//! Water at t = 0: filling the free cells, making room for bodies, and looking for leaks.

use super::displaced::{Cut, deepest_on_each_side};
use super::lattice::{BLOCKED, Cells, FACE, FLUID, FREE, Grid, Lattice, REACHED};
use super::oriented::Placed;
use super::placement::point;
use super::walls::face_name;
use crate::case;
use crate::error::Problem;
use glam::{DMat3, DVec3, IVec3};
use rayon::prelude::*;

/// Velocity of water at t = 0: `velocity` at `center`, and linear about it.
pub(super) struct Flow {
    velocity: DVec3,
    gradient: DMat3,
    center: DVec3,
}

impl Flow {
    /// In two dimensions there is no velocity along y, and none changes along it.
    pub fn new(
        velocity: case::Vector,
        gradient: Option<case::Matrix>,
        center: DVec3,
        lattice: &Lattice,
    ) -> Self {
        let there = if lattice.plane { DVec3::new(1.0, 0.0, 1.0) } else { DVec3::ONE };
        let plane = DMat3::from_diagonal(there);
        let gradient = DMat3::from_cols_array_2d(&gradient.unwrap_or_default()).transpose();
        Self { velocity: there * DVec3::from(velocity), gradient: plane * gradient * plane, center }
    }

    fn at(&self, x: DVec3) -> DVec3 {
        self.velocity + self.gradient * (x - self.center)
    }
}

/// The cells that hold water, with the velocity at t = 0.
#[derive(Default, Debug)]
pub(super) struct Water {
    pub cell: Vec<IVec3>,
    pub velocity: Vec<DVec3>,
    /// How many of them are known to stand clear of the walls.
    pub clear: usize,
    /// The first particle of each block, shape and fill.
    pub laid: Vec<usize>,
}

impl Water {
    /// Fills the free cells of a block.
    pub fn fill(&mut self, block: &case::Block, lattice: &Lattice, grid: &mut Grid) {
        let center = 0.5 * (DVec3::from(block.min) + DVec3::from(block.max));
        let flow = Flow::new(block.velocity, block.velocity_gradient, center, lattice);
        for c in lattice.cells(block.min.into(), block.max.into()).iter() {
            if matches!(grid.get(c), FREE | FACE) {
                grid.set(c, FLUID);
                self.cell.push(c);
                self.velocity.push(flow.at(lattice.center(c)));
            }
        }
    }

    /// Fills the free cells whose centres lie in a shape.
    pub fn shape(&mut self, shape: &Placed, flow: &Flow, lattice: &Lattice, grid: &mut Grid) {
        let reach = shape.bounds();
        let range = lattice.cells(shape.center - reach, shape.center + reach);
        let free: Vec<IVec3> = range.iter().filter(|&c| matches!(grid.get(c), FREE | FACE)).collect();
        let slack = -1e-6 * lattice.spacing;
        let held: Vec<IVec3> =
            free.into_par_iter().filter(|&c| shape.holds(lattice.center(c), slack)).collect();
        for c in held {
            grid.set(c, FLUID);
            self.cell.push(c);
            self.velocity.push(flow.at(lattice.center(c)));
        }
    }

    /// Fills the free cells below a level that can be reached from a seed.
    ///
    /// # Errors
    /// A seed that is not free, or a way out of everything there is; the key is that of the fill's table.
    pub fn flood(
        &mut self,
        fill: &case::Fill,
        lattice: &Lattice,
        grid: &mut Grid,
        tank: Option<Cells>,
    ) -> Result<(), Box<Problem>> {
        let (seed, l0) = (DVec3::from(fill.seed), lattice.spacing);
        let velocity = Flow::new(fill.velocity, None, seed, lattice).velocity;
        let mut start = lattice.cell(seed);
        if lattice.plane {
            start.y = 0;
        }
        let wrong = |message: String, remedy: &str| Err(Box::new(Problem::new("seed", message, remedy)));
        if !grid.cells.contains(start) {
            let message = format!("the seed at {} lies outside of tank and obstacles", point(seed));
            return wrong(message, "put it where the water is to be");
        }
        match grid.get(start) {
            FREE => {}
            FLUID => {
                let message = format!("there is water at the seed, {}, already", point(seed));
                return wrong(message, "put it into a basin that is still empty, or remove the other water");
            }
            _ => {
                let message = format!("the seed at {} lies in a wall", point(seed));
                return wrong(message, "put it where the water is to be");
            }
        }
        let within = |c: IVec3| lattice.center(c).z <= fill.level + 1e-6 * l0;
        if !within(start) {
            let message = format!("the level lies less than half a particle of {l0} m above the seed");
            return wrong(message, "put the seed deeper, or use a smaller run.spacing");
        }
        // Where each cell was reached from, to tell the way of a leak.
        let mut queue: Vec<(IVec3, usize)> = vec![(start, usize::MAX)];
        let mut next = 0;
        grid.set(start, REACHED);
        // Cells of faces, from which it does not go on.
        let mut faces = Vec::new();
        while next < queue.len() {
            let (c, _) = queue[next];
            for way in 0..6 {
                if lattice.plane && way / 2 == 1 {
                    continue;
                }
                let mut to = c;
                to[way / 2] += 2 * (way as i32 % 2) - 1;
                to = grid.wrap(to);
                if !within(to) {
                    continue;
                }
                if !grid.cells.contains(to) {
                    queue.iter().for_each(|&(c, _)| grid.set(c, FREE));
                    faces.iter().for_each(|&c| grid.set(c, FACE));
                    let out = leaves(&queue, next, tank);
                    let message = format!(
                        "water filled from {} up to z = {} leaks out at {}",
                        point(seed),
                        fill.level,
                        point(lattice.center(out))
                    );
                    let key = "level";
                    let remedy =
                        "lower the level, or close the gap there with a wall of two particles or more";
                    return Err(Box::new(Problem::new(key, message, remedy)));
                }
                match grid.get(to) {
                    FREE => queue.push((to, next)),
                    FACE => faces.push(to),
                    _ => continue,
                }
                grid.set(to, REACHED);
            }
            next += 1;
        }
        for c in queue.into_iter().map(|(c, _)| c).chain(faces) {
            grid.set(c, FLUID);
            self.cell.push(c);
            self.velocity.push(velocity);
        }
        Ok(())
    }

    /// Number of particles whose centres lie inside a shape or on its faces.
    pub fn inside(body: &Placed, lattice: &Lattice, grid: &Grid) -> usize {
        let margin = margin(body, lattice.spacing);
        let near = around(body, lattice, grid).iter().filter(|&c| grid.get(c) == FLUID);
        near.filter(|&c| body.holds(lattice.center(c), margin)).count()
    }

    /// Takes as much water out of the grid as a body displaces, what lies deepest inside of it first. Returns how many
    /// particles. [`Self::keep_what_is_left`] follows when all bodies have had theirs: each looks at the cells around
    /// it alone.
    pub fn displace(body: &Placed, lattice: &Lattice, grid: &mut Grid) -> usize {
        let near: Vec<IVec3> = around(body, lattice, grid).iter().filter(|&c| grid.get(c) == FLUID).collect();
        let cut = near.into_par_iter().filter_map(|c| Cut::of(body, None, c, lattice).map(|cut| (cut, c)));
        let cut = deepest_on_each_side(body, cut, |&c| lattice.center(c));
        cut.iter().for_each(|&c| grid.set(c, FREE));
        cut.len()
    }

    /// Leaves out the particles whose cells no longer hold water.
    pub fn keep_what_is_left(&mut self, grid: &Grid) {
        self.keep(|_, c| grid.get(c) == FLUID);
    }

    /// Keeps the particles of which `left` says so, by number and cell.
    fn keep(&mut self, left: impl Fn(usize, IVec3) -> bool) {
        let keep: Vec<bool> = self.cell.iter().enumerate().map(|(k, &c)| left(k, c)).collect();
        let mut kept = keep.iter();
        self.cell.retain(|_| kept.next().copied().unwrap_or(true));
        let mut kept = keep.iter();
        self.velocity.retain(|_| kept.next().copied().unwrap_or(true));
    }

    /// Removes as much water as a wall displaces, what lies deepest inside of it first: of the particles from the
    /// `from`-th on, which lie `within` a shape if it is told. Nothing enters their cells.
    pub fn remove(
        &mut self,
        wall: &Placed,
        (from, within): (usize, Option<&Placed>),
        lattice: &Lattice,
        grid: &mut Grid,
    ) {
        let near = around(wall, lattice, grid);
        let depth = |(k, &c): (usize, &IVec3)| {
            let cut = near.contains(c).then(|| Cut::of(wall, within, c, lattice))?;
            cut.map(|cut| (cut, k))
        };
        let found = self.cell.par_iter().enumerate().skip(from).filter_map(depth);
        let cut = deepest_on_each_side(wall, found, |&k| lattice.center(self.cell[k]));
        let mut gone = vec![false; self.cell.len()];
        for k in cut {
            gone[k] = true;
            grid.set(self.cell[k], BLOCKED);
        }
        self.keep(|k, _| !gone[k]);
    }

    /// Largest depth along gravity [m]: the highest column of cells where gravity follows an axis of the
    /// lattice (air in between not counted), else the extent of all water.
    pub fn depth(&self, gravity: DVec3, lattice: &Lattice) -> f64 {
        if self.cell.is_empty() {
            return 0.0;
        }
        let axis = (0..3).find(|&k| gravity[k].abs() >= (1.0 - 1e-9) * gravity.length());
        if let Some(axis) = axis {
            let mut columns = std::collections::HashMap::new();
            for c in &self.cell {
                let mut foot = *c;
                foot[axis] = 0;
                *columns.entry(foot).or_insert(0u32) += 1;
            }
            return f64::from(columns.into_values().max().unwrap_or(0)) * lattice.spacing;
        }
        let down = gravity.normalize();
        let (low, high) = self.cell.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &c| {
            let s = lattice.center(c).dot(down);
            (a.min(s), b.max(s))
        });
        high - low + lattice.spacing
    }

    /// Whether there is water and no cell beside it is free.
    pub fn fills(&self, lattice: &Lattice, grid: &Grid) -> bool {
        let enclosed = |&c: &IVec3| lattice.ways().all(|way| grid.get(grid.wrap(c + way)) != FREE);
        !self.cell.is_empty() && self.cell.iter().all(enclosed)
    }

    /// Whether water at rest would run away: spreads it sideways and down through free cells (gates and
    /// moving walls are closed) and complains when it gets out of everything there is.
    ///
    /// Without gravity water has no reason to run, so a free drop is no leak.
    pub(crate) fn leak(
        &self,
        gravity: DVec3,
        lattice: &Lattice,
        grid: &mut Grid,
        tank: Option<Cells>,
    ) -> Option<Problem> {
        let g = gravity.length();
        if g == 0.0 || self.cell.is_empty() {
            return None;
        }
        // Half a turn's worth of directions: what rises by more than 30 degrees does not count.
        let ways: Vec<IVec3> = (0..6)
            .filter(|way| !(lattice.plane && way / 2 == 1))
            .map(|way| {
                IVec3::from_array(std::array::from_fn(|k| {
                    if k == way / 2 { 2 * (way as i32 % 2) - 1 } else { 0 }
                }))
            })
            .filter(|way| way.as_dvec3().dot(gravity) >= -0.5 * g)
            .collect();
        let mut queue: Vec<(IVec3, usize)> = self.cell.iter().map(|&c| (c, usize::MAX)).collect();
        let mut next = 0;
        while next < queue.len() {
            let (c, _) = queue[next];
            for &way in &ways {
                let to = grid.wrap(c + way);
                if !grid.cells.contains(to) {
                    return Some(describe(&queue, next, lattice, tank));
                }
                if grid.get(to) == FREE {
                    grid.set(to, REACHED);
                    queue.push((to, next));
                }
            }
            next += 1;
        }
        None
    }
}

/// The way to the end of a leak, from that end back to the water.
fn way_back(queue: &[(IVec3, usize)], end: usize) -> Vec<IVec3> {
    let mut path = vec![queue[end].0];
    let mut at = end;
    while queue[at].1 != usize::MAX {
        at = queue[at].1;
        path.push(queue[at].0);
    }
    path
}

/// Where the way to the end of a leak first leaves the tank, or where it ends.
fn leaves(queue: &[(IVec3, usize)], end: usize, tank: Option<Cells>) -> IVec3 {
    let outside = |c: &&IVec3| tank.is_some_and(|tank| !tank.contains(**c));
    way_back(queue, end).iter().rev().find(outside).copied().unwrap_or(queue[end].0)
}

/// Cells of the grid around a shape, a spacing beyond its box.
pub(super) fn around(shape: &Placed, lattice: &Lattice, grid: &Grid) -> Cells {
    let reach = shape.bounds() + lattice.spacing;
    let Cells { lo, hi } = lattice.cells(shape.center - reach, shape.center + reach);
    Cells { lo: lo.max(grid.cells.lo), hi: hi.min(grid.cells.hi) }
}

/// How far inside a shape water may stand [m]. The lattice of a round body's layers is never the water's: as
/// with planes, water keeps 3/4 of a spacing from their centres.
pub(super) fn margin(body: &Placed, spacing: f64) -> f64 {
    if body.shape.as_cuboid().is_some() { -1e-6 * spacing } else { -0.25 * spacing }
}

/// The message of a leak: where the path crosses the tank's interior, if there is one.
fn describe(queue: &[(IVec3, usize)], end: usize, lattice: &Lattice, tank: Option<Cells>) -> Problem {
    let start = way_back(queue, end).last().copied().unwrap_or(queue[end].0);
    let Some(tank) = tank else {
        let message = format!("water at {} has nothing that holds it", point(lattice.center(start)));
        return Problem::new("tank", message, "give a [tank], or set run.gravity to zero for a free drop");
    };
    if !tank.contains(start) {
        let message = format!("water at {} lies outside of the tank", point(lattice.center(start)));
        return Problem::new("fluid.block", message, "make the block smaller or the tank larger");
    }
    let out = leaves(queue, end, Some(tank));
    let face = (0..6).find(|&f| {
        let axis = f / 2;
        if f % 2 == 0 { out[axis] < tank.lo[axis] } else { out[axis] >= tank.hi[axis] }
    });
    let message = format!(
        "water can leave through {} at {}",
        face.map_or("the tank's side", face_name),
        point(lattice.center(out))
    );
    let remedy = "take that face out of tank.open, or put a wall in front of it; an [[outflow]] in a closed face lets \
                  water out";
    Problem::new("tank.open", message, remedy)
}
