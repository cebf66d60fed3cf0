//! The background grid that neighbour searches walk: cells one effective radius wide.

use crate::error::{Error, Result};
use crate::params::Params;
use crate::periodic::Periodic;
use glam::DVec3;

/// Geometry of the grid. Cells are numbered with z running fastest and x slowest, so that the three
/// cells above each other are neighbours in memory, and slabs along a long tank lie apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Lower corner [m].
    pub origin: DVec3,
    /// Widths of a cell [m]: the effective radius, or as much more as a periodic axis takes to hold a whole number.
    pub width: DVec3,
    /// Cells along x, y, z.
    pub count: [u32; 3],
    /// Across which sides the search goes on.
    pub periodic: Periodic,
    /// The first of the columns along x whose cells are numbered, and how many these are, round a periodic side as well: all of them, or on one of many
    /// ranks those near its slab.
    pub held: [u32; 2],
}

/// Cells that lie above each other, and what is to be added to their particles' positions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Column {
    /// First cell.
    pub first: usize,
    /// Last cell, included.
    pub last: usize,
    /// From the particles to their images [m]; 0 within the sides.
    pub shift: DVec3,
}

impl Grid {
    /// A single cell, of a dry scene.
    pub(crate) fn nothing() -> Self {
        Self {
            origin: DVec3::ZERO,
            width: DVec3::ONE,
            count: [1; 3],
            periodic: Periodic::default(),
            held: [0, 1],
        }
    }

    /// Grid over the domain of `params`, all of whose cells are numbered.
    ///
    /// # Errors
    /// An error that names `run.domain` if they are too many.
    pub fn new(params: &Params) -> Result<Self> {
        Self::over(params).numbered(params)
    }

    /// Grid over the domain of `params`, however many cells it has.
    pub(crate) fn over(params: &Params) -> Self {
        let (radius, periodic) = (params.effective_radius, params.periodic);
        let extent = params.domain_max - params.domain_min;
        let cells = |k: usize| match periodic.is_along(k) {
            // No more than there is room for: none may be narrower than the radius.
            true => (extent[k] / radius * (1.0 + 1e-12)).floor().max(1.0),
            false => (extent[k] / radius).floor() + 1.0,
        };
        let along_y = if params.dimensions == 2 { 1.0 } else { cells(1) };
        let mut width = DVec3::splat(radius);
        for k in (0..3).filter(|&k| periodic.is_along(k)) {
            width[k] = extent[k] / cells(k);
        }
        let count = [cells(0) as u32, along_y as u32, cells(2) as u32];
        Self { origin: params.domain_min, width, count, periodic, held: [0, count[0]] }
    }

    /// This grid, unless its cells are more than can be numbered.
    pub(crate) fn numbered(self, params: &Params) -> Result<Self> {
        let columns = f64::from(self.held[1]) * f64::from(self.count[1]);
        let total = columns * f64::from(self.count[2]);
        if !(1.0..2e9).contains(&total) {
            let extent = params.domain_max - params.domain_min;
            let message = format!(
                "the domain of {:.3} x {:.3} x {:.3} m holds {total:.2e} cells of the neighbour search, more than \
                 can be numbered",
                extent.x, extent.y, extent.z
            );
            return Err(Error::key("run.domain", message, "give run.domain or enlarge run.spacing"));
        }
        Ok(self)
    }

    /// The same grid, of whose columns along x `count` are numbered, from the `first` on.
    pub(crate) fn slab(self, first: u32, count: u32) -> Self {
        Self { held: [first, count], ..self }
    }

    /// Number of cells that are numbered.
    pub fn total(&self) -> usize {
        self.held[1] as usize * self.per_column()
    }

    /// Cells of a column along x.
    pub(crate) fn per_column(&self) -> usize {
        self.count[1] as usize * self.count[2] as usize
    }

    /// Which of the columns that are numbered column `x` is; as many as there are, or more, if it is none of them.
    #[inline(always)]
    fn place(&self, x: u32) -> u32 {
        let place = x.wrapping_sub(self.held[0]);
        if x < self.held[0] { place.wrapping_add(self.count[0]) } else { place }
    }

    /// Whether the cells of column `x` are numbered.
    #[inline(always)]
    pub(crate) fn holds(&self, x: u32) -> bool {
        self.place(x) < self.held[1]
    }

    /// The cells of column `x`.
    pub(crate) fn cells_of(&self, x: u32) -> std::ops::Range<usize> {
        let first = self.index([x, 0, 0]);
        first..first + self.per_column()
    }

    /// Cell coordinates of a position inside the domain.
    #[inline(always)]
    pub(crate) fn coordinates(&self, x: DVec3) -> [u32; 3] {
        let c = (self.periodic.wrap(x) - self.origin) / self.width;
        [
            (c.x.max(0.0) as u32).min(self.count[0] - 1),
            (c.y.max(0.0) as u32).min(self.count[1] - 1),
            (c.z.max(0.0) as u32).min(self.count[2] - 1),
        ]
    }

    /// Number of the cell at these coordinates, in a column that has numbers.
    #[inline(always)]
    pub fn index(&self, c: [u32; 3]) -> usize {
        (self.place(c[0]) as usize * self.count[1] as usize + c[1] as usize) * self.count[2] as usize
            + c[2] as usize
    }

    /// Coordinates of the cell with this number.
    #[inline(always)]
    pub(crate) fn coordinates_of(&self, cell: usize) -> [u32; 3] {
        let (y, z) = (self.count[1] as usize, self.count[2] as usize);
        let x = (cell / (y * z)) as u32 + self.held[0];
        let x = if x < self.count[0] { x } else { x - self.count[0] };
        [x, (cell / z % y) as u32, (cell % z) as u32]
    }

    /// The columns of cells around `c`: up to nine, and as many more where z is periodic.
    #[inline(always)]
    pub fn columns(&self, c: [u32; 3]) -> impl Iterator<Item = Column> + use<> {
        let plain = (!self.periodic.is_any()).then(|| self.columns_within(c));
        let round = self.periodic.is_any().then(|| self.columns_round(c));
        plain.into_iter().flatten().chain(round.into_iter().flatten())
    }

    /// Those of a grid that ends at its sides.
    #[inline(always)]
    fn columns_within(&self, c: [u32; 3]) -> impl Iterator<Item = Column> + use<> {
        let grid = *self;
        let z = (c[2].saturating_sub(1), (c[2] + 1).min(grid.count[2] - 1));
        let y = (c[1].saturating_sub(1), (c[1] + 1).min(grid.count[1] - 1));
        let [first, held] = grid.held;
        let x = c[0].saturating_sub(1).max(first)..=(c[0] + 1).min(first + held - 1);
        let column = move |x, y| Column {
            first: grid.index([x, y, z.0]),
            last: grid.index([x, y, z.1]),
            shift: DVec3::ZERO,
        };
        x.flat_map(move |x| (y.0..=y.1).map(move |y| column(x, y)))
    }

    /// Those of a grid that goes on across its sides; a list, which only scenes with such sides make.
    #[cold]
    fn columns_round(&self, c: [u32; 3]) -> Vec<Column> {
        let [x, y, z] = [0, 1, 2].map(|axis| self.around(axis, c[axis]));
        let mut out = Vec::with_capacity(27);
        for x in x.into_iter().flatten().filter(|x| self.holds(x.0)) {
            for y in y.into_iter().flatten() {
                // Cells above each other are one run, but for those beyond a seam.
                let within = z.into_iter().flatten().filter(|z| z.1 == 0.0).map(|z| z.0);
                let (low, high) = within.fold((u32::MAX, 0), |(a, b), k| (a.min(k), b.max(k)));
                let beyond = z.into_iter().flatten().filter(|z| z.1 != 0.0).map(|(k, s)| (k, k, s));
                for (a, b, shift) in std::iter::once((low, high, 0.0)).chain(beyond) {
                    let (first, last) = (self.index([x.0, y.0, a]), self.index([x.0, y.0, b]));
                    out.push(Column { first, last, shift: DVec3::new(x.1, y.1, shift) });
                }
            }
        }
        out
    }

    /// Cell `c` of an axis and its neighbours there, each with what is to be added to its particles' positions [m].
    fn around(&self, axis: usize, c: u32) -> [Option<(u32, f64)>; 3] {
        let (n, length) = (self.count[axis], self.periodic.length()[axis]);
        let around = self.periodic.is_along(axis);
        [
            if c > 0 { Some((c - 1, 0.0)) } else { around.then_some((n - 1, -length)) },
            Some((c, 0.0)),
            if c + 1 < n { Some((c + 1, 0.0)) } else { around.then_some((0, length)) },
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slab_numbers_its_columns_and_sees_no_others() {
        let periodic = Periodic::new([true, false, false], DVec3::ZERO, DVec3::splat(9.0));
        for (ring, first, held) in [(false, 3, 4), (true, 7, 4)] {
            let periodic = if ring { periodic } else { Periodic::default() };
            let whole =
                Grid { origin: DVec3::ZERO, width: DVec3::ONE, count: [9, 2, 3], periodic, held: [0, 9] };
            let slab = whole.slab(first, held);
            assert_eq!((whole.total(), slab.total()), (54, 24));
            let numbered: Vec<u32> = (0..9).filter(|&x| slab.holds(x)).collect();
            assert_eq!(numbered, if ring { vec![0, 1, 7, 8] } else { vec![3, 4, 5, 6] });
            for cell in 0..slab.total() {
                let c = slab.coordinates_of(cell);
                assert_eq!(slab.index(c), cell);
                // Its neighbours are those of the whole grid that have numbers.
                let seen = |grid: &Grid| {
                    let cells = grid.columns(c).flat_map(|column| column.first..=column.last);
                    let mut all: Vec<[u32; 3]> = cells.map(|cell| grid.coordinates_of(cell)).collect();
                    all.retain(|c| slab.holds(c[0]));
                    all.sort_unstable();
                    all
                };
                assert_eq!(seen(&slab), seen(&whole), "{c:?}");
            }
            assert_eq!(slab.cells_of((first + 1) % 9), 6..12);
        }
    }
}
