//! Cells of a lattice by blocks, so that what is far from a surface need not be looked at cell by cell.

use glam::{DVec3, IVec3};

/// Longest edge of the blocks that are not halved any more, in cells.
const SMALL: i32 = 2;

/// Cells from the first corner up to the other one, which is not among them.
pub(crate) type Block = [IVec3; 2];

/// Half of the way between the farthest two centres of a block's cells, each of the size `step` [m].
pub(crate) fn half([low, high]: Block, step: DVec3) -> f64 {
    0.5 * ((high - low - 1).as_dvec3() * step).length()
}

/// The small blocks of `all` in which the cells must be told apart: halves, and halves of these, of none of which `is_one` says that it is done with.
pub(crate) fn small(all: Block, mut is_one: impl FnMut(Block) -> bool) -> Vec<Block> {
    let (mut open, mut out) = (vec![all], vec![]);
    while let Some([low, high]) = open.pop() {
        let edges = high - low;
        if edges.min_element() <= 0 || is_one([low, high]) {
            continue;
        }
        let axis = (0..3).max_by_key(|&k| edges[k]).unwrap_or_default();
        if edges[axis] <= SMALL {
            out.push([low, high]);
            continue;
        }
        let (mut to, mut from) = (high, low);
        (to[axis], from[axis]) = (low[axis] + edges[axis] / 2, low[axis] + edges[axis] / 2);
        open.extend([[low, to], [from, high]]);
    }
    out
}

/// The cells of a block.
pub(crate) fn cells([low, high]: Block) -> impl Iterator<Item = IVec3> {
    let columns = (low.x..high.x).flat_map(move |x| (low.y..high.y).map(move |y| (x, y)));
    columns.flat_map(move |(x, y)| (low.z..high.z).map(move |z| IVec3::new(x, y, z)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_is_in_one_block_and_only_those_at_the_surface_are_left() {
        let all = [IVec3::new(-20, -7, 0), IVec3::new(21, 9, 30)];
        // A ball.
        let distance = |x: DVec3| x.distance(DVec3::new(0.0, 1.0, 14.0)) - 6.3;
        let mut count = vec![0; 41 * 16 * 30];
        let place = |c: IVec3| {
            let at = c - all[0];
            ((at.x * 16 + at.y) * 30 + at.z) as usize
        };
        let left = small(all, |block| {
            let middle = 0.5 * (block[0] + block[1] - 1).as_dvec3();
            let is_far = distance(middle).abs() > half(block, DVec3::ONE);
            if is_far {
                let side = distance(middle) > 0.0;
                assert!(cells(block).all(|c| (distance(c.as_dvec3()) > 0.0) == side));
                cells(block).for_each(|c| count[place(c)] += 1);
            }
            is_far
        });
        assert!(left.iter().all(|block| (block[1] - block[0]).max_element() <= SMALL));
        let found: Vec<IVec3> = left.into_iter().flat_map(cells).collect();
        assert!(found.len() < 4000, "{}", found.len());
        found.into_iter().for_each(|c| count[place(c)] += 1);
        assert!(count.iter().all(|&n| n == 1));
    }
}
