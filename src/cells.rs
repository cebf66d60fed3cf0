//! The background grid that neighbour searches walk: cells one effective radius wide.

use crate::error::{Error, Result};
use crate::params::Params;
use glam::DVec3;

/// Geometry of the grid. Cells are numbered with z running fastest and x slowest, so that the three
/// cells above each other are neighbours in memory, and slabs along a long tank lie apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Lower corner [m].
    pub origin: DVec3,
    /// Width of a cell [m].
    pub width: f64,
    /// Cells along x, y, z.
    pub count: [u32; 3],
}

impl Grid {
    /// Grid over the domain of `params`.
    pub fn new(params: &Params) -> Result<Self> {
        let width = params.effective_radius;
        let extent = params.domain_max - params.domain_min;
        let cells = |length: f64| (length / width).floor() + 1.0;
        let along_y = if params.dimensions == 2 { 1.0 } else { cells(extent.y) };
        let total = cells(extent.x) * along_y * cells(extent.z);
        if total.is_nan() || total >= 2e9 {
            let message = format!(
                "the domain of {:.3} x {:.3} x {:.3} m holds {total:.2e} cells of the neighbour search, more than \
                 can be numbered",
                extent.x, extent.y, extent.z
            );
            return Err(Error::key("run.domain", message, "give run.domain or enlarge run.spacing"));
        }
        Ok(Self {
            origin: params.domain_min,
            width,
            count: [cells(extent.x) as u32, along_y as u32, cells(extent.z) as u32],
        })
    }

    /// Number of cells.
    pub fn total(&self) -> usize {
        self.count.iter().map(|&c| c as usize).product()
    }

    /// Cell coordinates of a position inside the domain.
    #[inline(always)]
    pub(crate) fn coordinates(&self, x: DVec3) -> [u32; 3] {
        let c = (x - self.origin) / self.width;
        [
            (c.x.max(0.0) as u32).min(self.count[0] - 1),
            (c.y.max(0.0) as u32).min(self.count[1] - 1),
            (c.z.max(0.0) as u32).min(self.count[2] - 1),
        ]
    }

    /// Number of the cell at these coordinates.
    #[inline(always)]
    pub fn index(&self, c: [u32; 3]) -> usize {
        (c[0] as usize * self.count[1] as usize + c[1] as usize) * self.count[2] as usize + c[2] as usize
    }

    /// Coordinates of the cell with this number.
    #[inline(always)]
    pub(crate) fn coordinates_of(&self, cell: usize) -> [u32; 3] {
        let (y, z) = (self.count[1] as usize, self.count[2] as usize);
        [(cell / (y * z)) as u32, (cell / z % y) as u32, (cell % z) as u32]
    }

    /// First and last cell (inclusive) of each of the up to nine columns of cells around `c`.
    #[inline(always)]
    pub fn columns(&self, c: [u32; 3]) -> impl Iterator<Item = (usize, usize)> + use<> {
        let grid = *self;
        let z = (c[2].saturating_sub(1), (c[2] + 1).min(grid.count[2] - 1));
        let y = (c[1].saturating_sub(1), (c[1] + 1).min(grid.count[1] - 1));
        (c[0].saturating_sub(1)..=(c[0] + 1).min(grid.count[0] - 1))
            .flat_map(move |x| (y.0..=y.1).map(move |y| (grid.index([x, y, z.0]), grid.index([x, y, z.1]))))
    }
}
