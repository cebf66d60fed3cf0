//! Where the tank is cut: columns of cells in shares of the water that are about even.

use crate::cells::Grid;
use crate::error::{Error, Result};
use crate::params::Params;
use crate::plan::Plan;

/// Whether the first and the last of so many ranks are neighbours: in a tank that is periodic along x.
pub(super) fn is_ring(ranks: usize, params: &Params) -> bool {
    ranks > 1 && params.periodic.is_along(0)
}

/// Columns that a rank takes at least. Of two ranks round a tank that is periodic along x each shows the other its first and its last column:
/// these are to be two, or one and the same would be there twice.
pub(super) fn least(ranks: usize, ring: bool) -> usize {
    if ranks == 2 && ring { 2 } else { 1 }
}

/// Columns beyond a slab within which a rank has the walls that never move. Its rows have their neighbours in the first one; of the copies of water there
/// it asks which walls are their neighbours (friction on walls shares its force so).
pub(super) const REACH: u32 = 2;

/// The columns before and after those of `rank`.
pub(super) fn beyond(cuts: &[u32], rank: usize, ring: bool) -> [Option<u32>; 2] {
    let (from, to, end) = (cuts[rank], cuts[rank + 1], cuts.last().copied().unwrap_or(0));
    [
        from.checked_sub(1).or(ring.then_some(end.saturating_sub(1))),
        Some(to).filter(|&c| c < end).or(ring.then_some(0)),
    ]
}

/// The first of the columns of `rank` and `reach` more on either side, and how many these are: in a ring they go on round the seam.
pub(super) fn near(reach: u32, cuts: &[u32], rank: usize, ring: bool) -> (u32, u32) {
    let (from, to, end) = (cuts[rank], cuts[rank + 1], cuts.last().copied().unwrap_or(0));
    match ring {
        // Round a short tank all of them.
        true => ((from + end - reach % end) % end, (to - from + 2 * reach).min(end)),
        false => (from.saturating_sub(reach), (to + reach).min(end) - from.saturating_sub(reach)),
    }
}

/// These columns, each once.
pub(super) fn within(reach: u32, cuts: &[u32], rank: usize, ring: bool) -> impl Iterator<Item = u32> {
    let (end, (first, count)) = (cuts.last().copied().unwrap_or(0), near(reach, cuts, rank, ring));
    (first..first + count).map(move |c| c % end)
}

/// Cuts `load`, of each column, into shares that are about even: the first column of each rank, and the end of the last one's.
pub(super) fn cut(load: &[u64], ranks: usize, params: &Params) -> Vec<u32> {
    shares(load, ranks, least(ranks, is_ring(ranks, params)))
}

fn shares(load: &[u64], ranks: usize, least: usize) -> Vec<u32> {
    let total: u64 = load.iter().sum();
    let mut cuts = vec![0];
    let (mut column, mut sum) = (0, 0);
    for rank in 1..ranks {
        let wanted = total as f64 * rank as f64 / ranks as f64;
        // Each rank has so many columns, those after this one as well.
        let most = load.len() - (ranks - rank) * least;
        while column < most
            && (column < *cuts.last().unwrap_or(&0) + least
                || sum as f64 + 0.5 * load[column] as f64 <= wanted)
        {
            sum += load[column];
            column += 1;
        }
        cuts.push(column);
    }
    cuts.push(load.len());
    cuts.into_iter().map(|c| c as u32).collect()
}

/// Refuses ranks that cannot share a tank.
///
/// # Errors
/// [`Error::Usage`] if there is no water, or there are more of them than columns of cells.
pub fn check(ranks: usize, plan: &Plan, params: &Params, grid: &Grid) -> Result<()> {
    if !plan.wet() {
        return Err(Error::usage("ranks", "there is no water, which is what ranks share: run it on one"));
    }
    let columns = grid.count[0] as usize;
    if ranks > 1 && 2.0 * params.collision_distance > params.effective_radius {
        let text = "ranks: fluid.collision_distance is more than half of run.effective_radius, and who collides beyond a cut is not \
                    seen: take a larger run.effective_radius, or run it on one rank";
        return Err(Error::usage("ranks", text));
    }
    let least = least(ranks, is_ring(ranks, params));
    if ranks * least > columns {
        let takes = if least == 1 { "one or more" } else { "two or more where they meet at both ends" };
        let text = format!(
            "{ranks} ranks, but only {columns} columns of cells along x, of which each rank takes {takes}: use fewer"
        );
        return Err(Error::usage("ranks", text));
    }
    Ok(())
}

/// Largest share of `load` between `cuts` over the mean.
pub(super) fn unevenness(load: &[u64], cuts: &[u32]) -> f64 {
    let share = |c: &[u32]| load[c[0] as usize..c[1] as usize].iter().sum::<u64>();
    let most = cuts.windows(2).map(share).max().unwrap_or(0);
    let mean = load.iter().sum::<u64>() as f64 / (cuts.len() - 1) as f64;
    if mean > 0.0 { most as f64 / mean } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_near_a_slab_is_told_once() {
        let cuts = [0, 2, 3, 8];
        let near = |reach, rank, ring| within(reach, &cuts, rank, ring).collect::<Vec<_>>();
        assert_eq!(near(2, 0, false), [0, 1, 2, 3]);
        assert_eq!(near(2, 1, false), [0, 1, 2, 3, 4]);
        assert_eq!(near(2, 2, false), [1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(near(2, 0, true), [6, 7, 0, 1, 2, 3]);
        assert_eq!(near(2, 2, true), [1, 2, 3, 4, 5, 6, 7, 0]);
        assert_eq!(within(2, &[0, 2, 4], 1, true).collect::<Vec<_>>(), [0, 1, 2, 3]);
        let beside = |rank, ring| beyond(&cuts, rank, ring);
        assert_eq!([beside(0, false), beside(2, false)], [[None, Some(2)], [Some(2), None]]);
        assert_eq!([beside(0, true), beside(2, true)], [[Some(7), Some(2)], [Some(2), Some(0)]]);
    }

    #[test]
    fn shares_are_even_and_no_rank_is_without_a_column() {
        assert_eq!(shares(&[5; 12], 4, 1), [0, 3, 6, 9, 12]);
        assert_eq!(shares(&[9, 0, 0, 0], 4, 1), [0, 1, 2, 3, 4]);
        assert_eq!(shares(&[0, 0, 0, 9], 4, 1), [0, 1, 2, 3, 4]);
        assert_eq!(shares(&[0; 5], 2, 1).len(), 3);
        assert_eq!(shares(&[4, 4, 4, 0, 0, 0, 0, 0], 2, 1), [0, 2, 8]);
        for load in [[9, 0, 0, 0], [0, 0, 0, 9]] {
            assert_eq!(shares(&load, 2, 2), [0, 2, 4]);
        }
        let load: Vec<u64> = (0..50).map(|k| 1000 + 37 * k % 400).collect();
        for ranks in 1..20 {
            let cuts = shares(&load, ranks, 1);
            assert!(cuts.windows(2).all(|c| c[0] < c[1]) && cuts[0] == 0 && cuts[ranks] == 50, "{cuts:?}");
            // To half a column.
            assert!(unevenness(&load, &cuts) < 1.0 + 0.6 * ranks as f64 / 50.0 * 1.4, "{ranks}: {cuts:?}");
        }
    }
}
