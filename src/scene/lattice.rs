//! The background lattice: which cell belongs to which shape, as a dense grid.

use super::oriented::Placed;
use crate::error::{CaseError, Problem, Result};
use crate::shape::blocks;
pub(super) use crate::shape::blocks::Cells;
use glam::{DVec3, IVec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// What stands in a cell.
pub(super) const FREE: u8 = 0;
/// A wall or dummy particle.
pub(super) const SOLID: u8 = 1;
/// The inside of a hollow solid, or a cell that a plane covers: no particle, but nothing may enter.
pub(super) const BLOCKED: u8 = 2;
/// A fluid particle.
pub(super) const FLUID: u8 = 3;
/// A cell that the search for leaks has reached.
pub(super) const REACHED: u8 = 4;
/// The face of a shape runs through it: water may stand in it, and nothing goes on from there.
pub(super) const FACE: u8 = 5;

/// Rounding slack in cells: a face that lies on a cell's centre up to this much counts as on it.
const SLACK: f64 = 1e-6;
/// More cells than this do not fit into memory beside the particles.
const MOST_CELLS: f64 = 1.0e9;

/// Origin and spacing: cell i spans origin + i l0 .. origin + (i + 1) l0, its particle stands in the middle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    pub origin: DVec3,
    pub spacing: f64,
    pub plane: bool,
}

impl Lattice {
    /// Lattice with cell edges at `anchor`. In two dimensions the one plane of cells is centred on y = 0.
    pub fn new(anchor: DVec3, spacing: f64, dimensions: u32) -> Self {
        let plane = dimensions == 2;
        let origin = if plane { DVec3::new(anchor.x, -0.5 * spacing, anchor.z) } else { anchor };
        Self { origin, spacing, plane }
    }
    /// Centre of a cell [m]; exactly y = 0 in two dimensions.
    pub fn center(&self, c: IVec3) -> DVec3 {
        let mut p = self.origin + (c.as_dvec3() + 0.5) * self.spacing;
        if self.plane {
            p.y = 0.0;
        }
        p
    }
    /// Corner of a cell towards the origin [m].
    pub fn corner(&self, c: IVec3) -> DVec3 {
        self.origin + c.as_dvec3() * self.spacing
    }
    /// The cell that holds a point.
    pub fn cell(&self, p: DVec3) -> IVec3 {
        ((p - self.origin) / self.spacing).floor().as_ivec3()
    }
    /// Cells whose centres lie in the box or on its faces.
    pub fn cells(&self, min: DVec3, max: DVec3) -> Cells {
        let lo = ((min - self.origin) / self.spacing - 0.5 - SLACK).ceil().as_ivec3();
        let hi = ((max - self.origin) / self.spacing - 0.5 + SLACK).floor().as_ivec3() + 1;
        self.flat(Cells { lo, hi })
    }
    /// Cells of the tank: round(L / l0) an axis, halves up.
    pub(crate) fn tank_cells(&self, min: DVec3, max: DVec3) -> Cells {
        let n = ((max - min) / self.spacing + 0.5 + SLACK).floor().as_ivec3();
        self.flat(Cells { lo: IVec3::ZERO, hi: n })
    }
    /// One cell along an axis that exists, none along y in two dimensions.
    pub fn step(&self, by: i32) -> IVec3 {
        IVec3::new(by, if self.plane { 0 } else { by }, by)
    }
    /// Steps from a cell to those beside it.
    pub fn ways(&self) -> impl Iterator<Item = IVec3> + Clone + use<> {
        let along = [IVec3::X, IVec3::Y, IVec3::Z].into_iter();
        let plane = self.plane;
        along.filter(move |way| !(plane && way.y == 1)).flat_map(|way| [way, -way])
    }
    fn flat(&self, mut cells: Cells) -> Cells {
        if self.plane {
            (cells.lo.y, cells.hi.y) = (0, 1);
        }
        cells
    }
}

/// Dense occupancy of a box of cells.
#[derive(Debug)]
pub(super) struct Grid {
    pub cells: Cells,
    n: [usize; 3],
    state: Vec<u8>,
    /// Cells between the sides of the tank, and the axes along which these are periodic.
    seam: Option<(Cells, [bool; 3])>,
}

impl Grid {
    /// An empty grid.
    ///
    /// # Errors
    /// When it would have more cells than memory can be expected to hold.
    pub fn new(cells: Cells, spacing: f64) -> Result<Self> {
        let n = (cells.hi.as_dvec3() - cells.lo.as_dvec3()).max(DVec3::ZERO);
        if n.x * n.y * n.z > MOST_CELLS || n.max_element() > 2e9 {
            let message = format!(
                "the tank, obstacles and water span {:.0} x {:.0} x {:.0} cells of {spacing} m, more than {MOST_CELLS:.0e}",
                n.x, n.y, n.z
            );
            let remedy = "use a larger run.spacing, or check for a length that is far too large";
            let text = format!("{message}: {remedy}");
            return Err(CaseError::new(vec![Problem::new("run.spacing", message, remedy)], text).into());
        }
        let n = [n.x as usize, n.y as usize, n.z as usize];
        Ok(Self { cells, n, state: vec![FREE; n[0] * n[1] * n[2]], seam: None })
    }
    /// Makes the sides of the `tank` periodic along the given axes. Nothing may stand beyond them.
    pub fn close(&mut self, tank: Cells, along: [bool; 3]) {
        if along == [false; 3] {
            return;
        }
        self.seam = Some((tank, along));
        let beyond: Vec<IVec3> = self.cells.iter().filter(|&c| self.is_beyond(c)).collect();
        beyond.into_iter().for_each(|c| self.set(c, BLOCKED));
    }
    /// The cell itself, or its image between periodic sides.
    pub fn wrap(&self, mut c: IVec3) -> IVec3 {
        if let Some((tank, along)) = self.seam {
            for k in (0..3).filter(|&k| along[k]) {
                c[k] = tank.lo[k] + (c[k] - tank.lo[k]).rem_euclid(tank.hi[k] - tank.lo[k]);
            }
        }
        c
    }
    /// Puts a shape into free cells: nothing enters its inside, and the water in the cells of its faces is what is left of their room.
    pub fn put(&mut self, shape: &Placed, lattice: &Lattice) {
        // Water closer to a face than a quarter of a spacing goes no further.
        let (l0, near) = (lattice.spacing, 0.25);
        let reach = shape.bounds() + near * l0;
        let range = lattice.cells(shape.center - reach, shape.center + reach);
        let (lo, hi) = (range.lo.max(self.cells.lo), range.hi.min(self.cells.hi));
        let state = |off: f64| if off < SLACK - 0.5 { BLOCKED } else { FACE };
        // A dry shape may be as large as the grid: of most blocks of cells the middle tells that the surface is far from all of them.
        let mut inside = vec![];
        let left = blocks::small(Cells { lo, hi }, |block| {
            let middle = 0.5 * (lattice.center(block.lo) + lattice.center(block.hi - 1));
            let (off, half) = (shape.distance(middle) / l0, block.half(DVec3::ONE) + SLACK);
            if off + half < -0.5 {
                inside.push(block);
            }
            off + half < -0.5 || off - half >= near
        });
        let free = |c: &IVec3| self.get(*c) == FREE;
        let taken = left.into_par_iter().flat_map_iter(|block| {
            let off = move |c: IVec3| (c, shape.distance(lattice.center(c)) / l0);
            let offs = block.iter().filter(free).map(off);
            offs.filter(move |(_, off)| *off < near).map(move |(c, off)| (c, state(off)))
        });
        let taken: Vec<(IVec3, u8)> = taken.collect();
        for c in inside.into_iter().flat_map(Cells::iter) {
            if self.get(c) == FREE {
                self.set(c, BLOCKED);
            }
        }
        taken.into_iter().for_each(|(c, state)| self.set(c, state));
    }
    /// Whether a cell lies beyond a periodic side.
    pub fn is_beyond(&self, c: IVec3) -> bool {
        self.wrap(c) != c
    }
    /// `closed` without the faces of a box of `cells` that spans a periodic axis: it goes on there.
    pub(crate) fn closed(&self, cells: Cells, mut closed: [[bool; 2]; 3]) -> [[bool; 2]; 3] {
        if let Some((tank, along)) = self.seam {
            for k in (0..3).filter(|&k| along[k] && cells.lo[k] <= tank.lo[k] && cells.hi[k] >= tank.hi[k]) {
                closed[k] = [false; 2];
            }
        }
        closed
    }
    fn index(&self, c: IVec3) -> usize {
        let d = c - self.cells.lo;
        (d.x as usize * self.n[1] + d.y as usize) * self.n[2] + d.z as usize
    }
    /// The rank that no way by steps of `ways` from the `seeds` to a `target` stays below; cells without a rank are closed. `None` if there
    /// is no way.
    pub fn lowest_way(
        &self,
        seeds: impl Iterator<Item = IVec3>,
        ways: impl Iterator<Item = IVec3> + Clone,
        rank: impl Fn(IVec3) -> Option<i32>,
        target: impl Fn(IVec3) -> bool,
    ) -> Option<i32> {
        let mut seen = vec![false; self.state.len()];
        let mut waiting: BTreeMap<i32, Vec<IVec3>> = BTreeMap::new();
        let mut look = |c: IVec3, least: i32, waiting: &mut BTreeMap<i32, Vec<IVec3>>| {
            if self.cells.contains(c) && !std::mem::replace(&mut seen[self.index(c)], true) {
                rank(c).into_iter().for_each(|r| waiting.entry(r.max(least)).or_default().push(c));
            }
        };
        seeds.for_each(|c| look(c, i32::MIN, &mut waiting));
        while let Some(mut lowest) = waiting.first_entry() {
            let rank = *lowest.key();
            match lowest.get_mut().pop() {
                Some(c) if target(c) => return Some(rank),
                Some(c) => ways.clone().for_each(|way| look(self.wrap(c + way), rank, &mut waiting)),
                None => drop(lowest.remove()),
            }
        }
        None
    }
    /// How many open cells there are to which steps of `ways` lead from the open ones of some `seeds`.
    pub fn reach(
        &self,
        seeds: &[IVec3],
        ways: impl Iterator<Item = IVec3> + Clone,
        open: impl Fn(IVec3) -> bool,
    ) -> usize {
        let mut seen = vec![false; self.state.len()];
        let mut queue = Vec::with_capacity(seeds.len());
        let mut look = |c: IVec3, queue: &mut Vec<IVec3>| {
            if self.cells.contains(c) && !std::mem::replace(&mut seen[self.index(c)], true) && open(c) {
                queue.push(c);
            }
        };
        seeds.iter().for_each(|&c| look(c, &mut queue));
        let mut next = 0;
        while next < queue.len() {
            ways.clone().for_each(|way| look(self.wrap(queue[next] + way), &mut queue));
            next += 1;
        }
        queue.len()
    }
    /// State of a cell; free outside of the grid.
    pub fn get(&self, c: IVec3) -> u8 {
        if self.cells.contains(c) { self.state[self.index(c)] } else { FREE }
    }
    /// Sets a cell of the grid.
    pub fn set(&mut self, c: IVec3, state: u8) {
        let i = self.index(c);
        self.state[i] = state;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_centre_on_a_face_belongs_to_the_box() {
        let lattice = Lattice::new(DVec3::ZERO, 0.02, 3);
        // 0.35 / 0.02 = 17.5 and 2.95 / 0.02 = 147.5: both ends lie on centres.
        let cells = lattice.cells(DVec3::new(2.95, 0.0, 0.0), DVec3::new(3.10, 0.5, 0.35));
        assert_eq!(cells, Cells { lo: IVec3::new(147, 0, 0), hi: IVec3::new(155, 25, 18) });
    }

    #[test]
    fn two_dimensions_are_one_plane_at_zero() {
        let lattice = Lattice::new(DVec3::new(0.3, 7.0, -0.1), 0.1, 2);
        let cells = lattice.cells(DVec3::ZERO, DVec3::ONE);
        assert_eq!((cells.lo.y, cells.hi.y), (0, 1));
        assert_eq!(lattice.center(IVec3::new(3, 0, 2)).y, 0.0);
    }
}
