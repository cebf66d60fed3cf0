//! What the plan fixes of the multigrid levels: where the cells of each lie, how many rows are kept, and the
//! order of operations of the cycle.

use super::kernels::{multigrid, multigrid_levels};
use super::layout::WORKGROUP;
use super::memory::{SCAN_BLOCK, SCAN_GROUPS_MAX, Sizes};
use crate::compute::Kernel;
use crate::kernels::multigrid::{SWEEPS, visits};
use crate::kernels::multigrid_levels::{LEVELS_MAX, level_cells};
use bytemuck::{Pod, Zeroable};

/// Rows up to which a level is worked by one workgroup.
const SMALL: u64 = 4096;
/// Levels with dispatches of their own at most; see `down_first` to `down_fourth` in shaders/multigrid.wgsl. The fifth is small with as many
/// particles as a device holds.
const LARGE_MAX: usize = 4;
/// Their kernels.
const DOWN: [Kernel; LARGE_MAX] =
    [multigrid::down_first, multigrid::down_second, multigrid::down_third, multigrid::down_fourth];
const UP: [Kernel; LARGE_MAX] =
    [multigrid::up_first, multigrid::up_second, multigrid::up_third, multigrid::up_fourth];
/// Those that make the third and the fourth of them; the second has its own dispatch in any scene.
const COARSEN: [Kernel; 2] = [multigrid_levels::coarsen_third, multigrid_levels::coarsen_fourth];
/// Operations of the small levels at most.
const OPERATIONS_MAX: usize = 256;
/// Workgroups of a kernel over cells or rows at most; threads then take several.
pub(super) const GROUPS_MAX: u64 = 1024;

/// A step of the cycle over a level; as in shaders/multigrid.wgsl.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u32)]
pub enum Operation {
    /// Residual to the next coarser level.
    Down = 0,
    /// Take the next coarser level's answer, sweep; from x to y.
    Up = 1,
    /// Sweep from x to y.
    Forth = 2,
    /// Sweep from y to x.
    Back = 3,
}

/// Constants of the levels; see `Hierarchy` in shaders/common.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Hierarchy {
    pub level: [[u32; 4]; LEVELS_MAX],
    /// Kind and level; beside the first two, where ranks share the levels, which cells are whose: `set_own`.
    pub operation: [[u32; 4]; OPERATIONS_MAX],
    pub levels: u32,
    pub capacity: u32,
    pub cells: u32,
    pub operations: u32,
}

impl Hierarchy {
    /// Cells of the first level that are this rank's, and the first of each column of cells beside them, `u32::MAX` where there is none.
    pub(crate) fn set_own(&mut self, cells: [u32; 2], beside: [u32; 2]) {
        for (operation, pair) in self.operation.iter_mut().zip([cells, beside]) {
            operation[2..].copy_from_slice(&pair);
        }
    }
}

/// The levels of a scene.
#[derive(Clone, Debug)]
pub struct Levels {
    /// Cells along x, y, z of each level, finest first.
    pub count: Vec<[u32; 3]>,
    /// Cells of all levels.
    pub cells: u64,
    /// Rows of all levels that the buffers hold.
    pub capacity: u64,
    /// Levels with dispatches of their own; one workgroup does the rest.
    pub large: usize,
    /// Rows to expect on each level, for the number of workgroups.
    expected: Vec<u64>,
}

impl Levels {
    /// Of a scene of `sizes`.
    pub fn new(sizes: &Sizes) -> Self {
        let count = level_cells(sizes.grid);
        let product = |c: &[u32; 3]| c.iter().map(|&n| u64::from(n)).product::<u64>();
        let cells = count.iter().map(product).sum::<u64>();
        let flat = sizes.grid.contains(&1);
        // A cell holds 9 particles (4 in two dimensions) where it is full, and a third of the slots are dry
        // walls. More cells than that go without correction, which costs iterations and nothing else.
        let (per_row, expected_per_row, shrink) = if flat { (1, 3, 2) } else { (3, 6, 3) };
        let carriers = sizes.carriers();
        let expected: Vec<u64> = (count.iter().enumerate())
            .map(|(l, c)| product(c).min((carriers / expected_per_row) >> (shrink * l)).max(1))
            .collect();
        let mut out = Self { capacity: cells.min(carriers / per_row + 64), count, cells, large: 0, expected };
        out.large = out.expected.iter().take(out.large_max()).filter(|&&n| n > SMALL).count();
        out
    }

    /// These, with `large` of them large instead of those with many rows, if it is given. It is the time that depends on that, not the result.
    pub(super) fn split(mut self, large: Option<usize>) -> Self {
        self.large = large.map_or(self.large, |large| large.min(self.large_max()));
        self
    }

    /// Kernels of large levels that these have not.
    pub(super) fn idle(&self) -> Vec<Kernel> {
        let [down, up] = [DOWN, UP].map(|kernels| kernels[self.large..].to_vec());
        [down, up, COARSEN[self.large.saturating_sub(2)..].to_vec()].concat()
    }

    /// Levels that can have dispatches of their own.
    fn large_max(&self) -> usize {
        LARGE_MAX.min(self.count.len() - 1)
    }

    /// Blocks of the scan over the cells.
    pub fn blocks(&self) -> u64 {
        self.cells.div_ceil(SCAN_BLOCK)
    }

    /// For the shaders.
    pub fn hierarchy(&self) -> Hierarchy {
        let mut out = Hierarchy { levels: self.count.len() as u32, ..Zeroable::zeroed() };
        let mut first = self.cells as u32;
        for (level, &[x, y, z]) in out.level.iter_mut().zip(&self.count) {
            first -= x * y * z;
            *level = [x, y, z, first];
        }
        let operations = self.operations(self.large);
        for (to, &(operation, level)) in out.operation.iter_mut().zip(&operations) {
            *to = [operation as u32, level as u32, 0, 0];
        }
        (out.capacity, out.cells) = (self.capacity as u32, self.cells as u32);
        out.operations = operations.len() as u32;
        out
    }

    /// The operations of a cycle that begins on `level`, each with its level.
    fn operations(&self, level: usize) -> Vec<(Operation, usize)> {
        if level + 1 == self.count.len() {
            let sweeps = [Operation::Forth, Operation::Back].into_iter().cycle().take(SWEEPS - 1);
            return sweeps.map(|o| (o, level)).collect();
        }
        let below = self.operations(level + 1);
        let mut out = Vec::new();
        for visit in 0..visits(level) {
            if visit > 0 {
                out.push((Operation::Back, level));
            }
            out.push((Operation::Down, level));
            out.extend_from_slice(&below);
            out.push((Operation::Up, level));
        }
        out
    }

    /// Workgroups of a kernel with `threads` threads for each row of `level`.
    fn groups(&self, level: usize, threads: u64) -> u64 {
        (threads * self.expected[level]).div_ceil(WORKGROUP).min(GROUPS_MAX)
    }

    /// Workgroups of the largest of their dispatches, but for those over the particles.
    pub(crate) fn workgroups(&self) -> u64 {
        let of_levels = (0..self.count.len()).map(|level| self.groups(level, 8));
        self.build().iter().map(|(_, groups)| *groups).chain(of_levels).max().unwrap_or(1)
    }

    /// Cells of the first level.
    pub(crate) fn first_cells(&self) -> u64 {
        self.count[0].map(u64::from).iter().product()
    }

    /// Workgroups of a kernel over the cells of the first level.
    fn cell_groups(&self) -> u64 {
        self.first_cells().div_ceil(WORKGROUP).min(GROUPS_MAX)
    }

    /// Dispatches that build the levels.
    pub fn build(&self) -> Vec<(Kernel, u64)> {
        [self.mark(), self.number(), self.galerkin(), self.coarsen()].concat()
    }

    /// Those that mark the cells with unknowns.
    pub(crate) fn mark(&self) -> Vec<(Kernel, u64)> {
        vec![(multigrid_levels::mark, self.cell_groups())]
    }

    /// Those that number the marked cells, and tell the unknowns.
    pub(crate) fn number(&self) -> Vec<(Kernel, u64)> {
        let scan = self.blocks().min(SCAN_GROUPS_MAX);
        vec![
            (multigrid_levels::scan_blocks, scan),
            (multigrid_levels::scan_sums, 1),
            (multigrid_levels::number_rows, scan),
            (multigrid_levels::members, self.cell_groups()),
        ]
    }

    /// That which makes the operator of the first level.
    pub(crate) fn galerkin(&self) -> Vec<(Kernel, u64)> {
        vec![(multigrid_levels::galerkin, self.groups(0, 1))]
    }

    /// Those that make the others from it.
    pub(crate) fn coarsen(&self) -> Vec<(Kernel, u64)> {
        let mut out = Vec::new();
        if self.count.len() > 1 {
            out.push((multigrid_levels::coarsen_second, self.groups(1, 1)));
        }
        out.extend(
            COARSEN.into_iter().zip(2..self.large).map(|(kernel, level)| (kernel, self.groups(level, 1))),
        );
        if self.count.len() > self.large.max(2) {
            out.push((multigrid_levels::coarsen_rest, 1));
        }
        out
    }

    /// Dispatches between the sweeps over the particles, which takes `rows` workgroups to read.
    pub fn cycle(&self, rows: u64) -> Vec<(Kernel, u64)> {
        let mut out = self.gather();
        out.extend(self.correct(rows));
        out
    }

    /// The first of them, which brings the residuals to the cells.
    pub(crate) fn gather(&self) -> Vec<(Kernel, u64)> {
        vec![(multigrid::gather, self.groups(0, 1))]
    }

    /// The others.
    pub(crate) fn correct(&self, rows: u64) -> Vec<(Kernel, u64)> {
        let mut out = Vec::new();
        self.push_cycle(0, &mut out);
        out.push((multigrid::spread, rows));
        out
    }

    fn push_cycle(&self, level: usize, out: &mut Vec<(Kernel, u64)>) {
        if level == self.large {
            return out.push((multigrid::small, 1));
        }
        for visit in 0..visits(level) {
            if visit > 0 {
                // Level 0 alone is visited twice.
                out.push((multigrid::back_first, self.groups(level, 1)));
            }
            out.push((DOWN[level], self.groups(level + 1, 8)));
            self.push_cycle(level + 1, out);
            out.push((UP[level], self.groups(level, 1)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn levels(grid: [u32; 3], pressure: u64) -> Levels {
        Levels::new(&Sizes { grid, pressure, ..Sizes::default() })
    }

    #[test]
    fn levels_lie_one_after_the_other_coarsest_first() {
        let h = levels([30, 10, 12], 40_000).hierarchy();
        let n = h.levels as usize;
        assert_eq!(h.level[n - 1][3], 0);
        for l in 1..n {
            assert_eq!(h.level[l - 1][3], h.level[l][3] + h.level[l][..3].iter().product::<u32>());
        }
        assert_eq!(h.level[0][3] + 3600, h.cells);
    }

    #[test]
    fn a_cycle_is_a_palindrome_and_fits() {
        for (grid, large) in [([2000, 1000, 900], 2), ([222, 33, 60], 2), ([60, 20, 20], 0), ([3, 3, 3], 0)] {
            let l = levels(grid, if large > 0 { 340_000 } else { 10_000 });
            assert_eq!(l.large, large);
            let operations = l.operations(0);
            assert!(operations.len() <= OPERATIONS_MAX);
            // Symmetric: mirrored, Up and Down change places, as do the sweeps.
            let counts = |o| operations.iter().filter(|(x, _)| *x == o).count();
            assert_eq!(counts(Operation::Down), counts(Operation::Up));
            let kinds: Vec<_> = operations.iter().map(|&(o, l)| (o == Operation::Down, l)).collect();
            let mirrored: Vec<_> = (operations.iter().rev()).map(|&(o, l)| (o == Operation::Up, l)).collect();
            assert_eq!(kinds, mirrored);
            // Every answer is in y: a level is left by Up or Forth.
            assert!(matches!(operations.last(), Some((Operation::Up | Operation::Forth, 0))));
        }
    }

    #[test]
    fn dispatches_are_few() {
        let l = levels([222, 33, 60], 340_000);
        assert_eq!((l.build().len(), l.cycle(100).len()), (8, 13));
        assert_eq!(levels([60, 20, 20], 10_000).cycle(100).len(), 3);
        // A hundred million particles: four levels take all of a device, and what is left is small.
        let l = levels([2000, 300, 600], 60_000_000);
        assert_eq!((l.large, l.build().len(), l.cycle(100).len()), (4, 10, 21));
        assert!(l.expected[4] <= SMALL, "{:?}", l.expected);
    }
}
