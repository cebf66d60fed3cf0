//! The coarse levels of the multigrid and the cycle over them. Many ranks share the finest of them.

use super::level::{Level, Scratch, coarsen};
use super::shared::{self, Joined};
use crate::cells::Grid;
use crate::kernels::multigrid::{SWEEPS, over_correction, visits};
use crate::kernels::multigrid_levels::level_cells;
use crate::share::{Columns, Share};

/// The coarse levels, finest first; buffers are kept between steps.
#[derive(Default, Debug)]
pub(super) struct Hierarchy {
    /// So many of them as were ever made.
    pub levels: Vec<Level>,
    /// Cells of those in use.
    count: Vec<[u32; 3]>,
    /// Columns of those that ranks share.
    columns: Vec<Columns>,
    joined: Joined,
    pub scratch: Scratch,
}

impl Hierarchy {
    /// Levels over `grid`, of which ranks have what is in their columns; the cells of the first one are to be found
    /// next.
    pub fn begin(&mut self, grid: &Grid, share: Option<&Share>) {
        self.count = level_cells(grid.count);
        self.columns = share.map_or_else(Vec::new, |share| share.levels(&self.count));
        self.levels.resize_with(self.count.len().max(self.levels.len()), Level::default);
        for (l, (level, count)) in self.levels.iter_mut().zip(&self.count).enumerate() {
            // Along a ring of ranks a level that is shared ends with the columns of those beside.
            let ends = |k| k == 0 && self.columns.get(l).is_some_and(Columns::is_ring);
            let along = |k| if grid.periodic.is_along(k) && !ends(k) { count[k] as i32 } else { 0 };
            level.around = [0, 1, 2].map(along);
        }
    }

    /// The levels in use.
    pub fn used(&self) -> &[Level] {
        &self.levels[..self.count.len()]
    }

    /// The columns of the first level, if ranks share it.
    pub fn columns(&self) -> Option<&Columns> {
        self.columns.first()
    }

    /// The columns of the levels that ranks share.
    #[cfg(test)]
    pub fn shared(&self) -> &[Columns] {
        &self.columns
    }

    /// Makes the levels behind the first one.
    pub fn coarsen(&mut self, share: Option<&Share>) {
        for l in 1..self.count.len() {
            let Self { levels, count, columns, joined, scratch } = self;
            let (fine, coarse) = levels.split_at_mut(l);
            let (fine, coarse, count) = (&mut fine[l - 1], &mut coarse[0], count[l]);
            match share {
                Some(share) if l < columns.len() => {
                    shared::coarsen([fine, coarse], scratch, share, &columns[l - 1..=l]);
                }
                Some(share) if l == columns.len() => {
                    joined.coarsen([fine, coarse], scratch, share, &columns[l - 1], count);
                }
                _ => coarsen(fine, coarse, scratch),
            }
        }
    }

    /// Shows the ranks beside this one the border of level `l`'s x, if it is shared.
    fn show(&mut self, l: usize, share: Option<&Share>) {
        if let Some(share) = share.filter(|_| l < self.columns.len()) {
            let Level { border, x, .. } = &mut self.levels[l];
            border.show(share, x);
        }
    }

    /// x <- B b on level `l`.
    pub fn cycle(&mut self, l: usize, share: Option<&Share>) {
        self.levels[l].first_smooth();
        if l + 1 == self.count.len() {
            for _ in 1..SWEEPS {
                self.show(l, share);
                self.levels[l].smooth();
            }
            return self.show(l, share);
        }
        for visit in 0..visits(l) {
            if visit > 0 {
                self.show(l, share);
                self.levels[l].smooth();
            }
            self.show(l, share);
            self.descend(l, share);
            self.cycle(l + 1, share);
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            let (level, next, factor) = (&mut fine[l], &coarse[0], over_correction(l));
            // Those of other ranks, shown before, as well: they stay as their owners have them.
            level.x.iter_mut().zip(&level.parent).for_each(|(x, &p)| *x += factor * next.x[p as usize]);
            level.smooth();
        }
        self.show(l, share);
    }

    /// What is left of the right side of level `l`, to the next one.
    fn descend(&mut self, l: usize, share: Option<&Share>) {
        let (fine, coarse) = self.levels.split_at_mut(l + 1);
        let (level, next) = (&mut fine[l], &mut coarse[0]);
        level.residual(|_, r| r);
        next.b.fill(0.0);
        level.r[..level.own].iter().zip(&level.parent).for_each(|(r, &p)| next.b[p as usize] += r);
        match share {
            Some(share) if l + 1 < self.columns.len() => next.border.hand_back(share, &mut next.b),
            Some(share) if l + 1 == self.columns.len() => self.joined.sum(share, &mut next.b),
            _ => {}
        }
    }
}
