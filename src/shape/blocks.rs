//! Blocks of a lattice's cells: what is far from a surface need not be looked at cell by cell.

use glam::{DVec3, IVec3};

/// Longest edge of the blocks that are not halved any more, in cells.
const SMALL: i32 = 2;

/// A box of cells, `lo` included, `hi` not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cells {
    pub lo: IVec3,
    pub hi: IVec3,
}

impl Cells {
    pub fn iter(self) -> impl Iterator<Item = IVec3> {
        let Self { lo, hi } = self;
        (lo.x..hi.x)
            .flat_map(move |i| (lo.y..hi.y).flat_map(move |j| (lo.z..hi.z).map(move |k| IVec3::new(i, j, k))))
    }
    pub fn grown(self, by: IVec3) -> Self {
        Self { lo: self.lo - by, hi: self.hi + by }
    }
    pub fn union(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }
    pub fn contains(self, c: IVec3) -> bool {
        c.cmpge(self.lo).all() && c.cmplt(self.hi).all()
    }
    /// Half of the way between the farthest two centres of the cells, each of the size `step` [m].
    pub fn half(self, step: DVec3) -> f64 {
        0.5 * ((self.hi - self.lo - 1).as_dvec3() * step).length()
    }
}

/// The small blocks of `all` in which the cells must be told apart: halves, and halves of these, of none of which `is_one` says that it is done with.
pub(crate) fn small(all: Cells, mut is_one: impl FnMut(Cells) -> bool) -> Vec<Cells> {
    let (mut open, mut out) = (vec![all], vec![]);
    while let Some(block) = open.pop() {
        let edges = block.hi - block.lo;
        if edges.min_element() <= 0 || is_one(block) {
            continue;
        }
        let axis = (0..3).max_by_key(|&k| edges[k]).unwrap_or_default();
        if edges[axis] <= SMALL {
            out.push(block);
            continue;
        }
        let (mut below, mut above) = (block, block);
        let cut = block.lo[axis] + edges[axis] / 2;
        (below.hi[axis], above.lo[axis]) = (cut, cut);
        open.extend([below, above]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_is_in_one_block_and_only_those_at_the_surface_are_left() {
        let all = Cells { lo: IVec3::new(-20, -7, 0), hi: IVec3::new(21, 9, 30) };
        // A ball.
        let distance = |x: DVec3| x.distance(DVec3::new(0.0, 1.0, 14.0)) - 6.3;
        let mut count = vec![0; 41 * 16 * 30];
        let place = |c: IVec3| {
            let at = c - all.lo;
            ((at.x * 16 + at.y) * 30 + at.z) as usize
        };
        let left = small(all, |block| {
            let middle = 0.5 * (block.lo + block.hi - 1).as_dvec3();
            let is_far = distance(middle).abs() > block.half(DVec3::ONE);
            if is_far {
                let side = distance(middle) > 0.0;
                assert!(block.iter().all(|c| (distance(c.as_dvec3()) > 0.0) == side));
                block.iter().for_each(|c| count[place(c)] += 1);
            }
            is_far
        });
        assert!(left.iter().all(|block| (block.hi - block.lo).max_element() <= SMALL));
        let found: Vec<IVec3> = left.into_iter().flat_map(Cells::iter).collect();
        assert!(found.len() < 4000, "{}", found.len());
        found.into_iter().for_each(|c| count[place(c)] += 1);
        assert!(count.iter().all(|&n| n == 1));
    }
}
