//! Where the tank is cut: columns of cells in shares of the water that are about even.

use crate::cells::Grid;
use crate::error::{Error, Result};
use crate::params::Params;

/// Cuts `load`, of each column, into shares that are about even: the first column of each rank, and the end of the last one's.
pub(super) fn cut(load: &[u64], ranks: usize) -> Vec<u32> {
    let total: u64 = load.iter().sum();
    let mut cuts = vec![0];
    let (mut column, mut sum) = (0, 0);
    for rank in 1..ranks {
        let wanted = total as f64 * rank as f64 / ranks as f64;
        // Each rank has a column at least, those after this one as well.
        let most = load.len() - (ranks - rank);
        while column < most
            && (column <= *cuts.last().unwrap_or(&0) || sum as f64 + 0.5 * load[column] as f64 <= wanted)
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
pub(super) fn check(ranks: usize, params: &Params, grid: &Grid) -> Result<()> {
    let columns = grid.count[0] as usize;
    if params.periodic.is_along(0) && ranks > 1 {
        let text = "ranks cut the tank across x, along which this one is periodic: run it on one rank";
        return Err(Error::usage("ranks", text));
    }
    if ranks > 1 && 2.0 * params.collision_distance > params.effective_radius {
        let text = "ranks: fluid.collision_distance is more than half of run.effective_radius, and who collides beyond a cut is not \
                    seen: take a larger run.effective_radius, or run it on one rank";
        return Err(Error::usage("ranks", text));
    }
    if ranks > columns {
        let text = format!(
            "{ranks} ranks, but only {columns} columns of cells along x, of which each rank takes one or more: use fewer"
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
    fn shares_are_even_and_no_rank_is_without_a_column() {
        assert_eq!(cut(&[5; 12], 4), [0, 3, 6, 9, 12]);
        assert_eq!(cut(&[9, 0, 0, 0], 4), [0, 1, 2, 3, 4]);
        assert_eq!(cut(&[0, 0, 0, 9], 4), [0, 1, 2, 3, 4]);
        assert_eq!(cut(&[0; 5], 2).len(), 3);
        assert_eq!(cut(&[4, 4, 4, 0, 0, 0, 0, 0], 2), [0, 2, 8]);
        let load: Vec<u64> = (0..50).map(|k| 1000 + 37 * k % 400).collect();
        for ranks in 1..20 {
            let cuts = cut(&load, ranks);
            assert!(cuts.windows(2).all(|c| c[0] < c[1]) && cuts[0] == 0 && cuts[ranks] == 50, "{cuts:?}");
            // To half a column.
            assert!(unevenness(&load, &cuts) < 1.0 + 0.6 * ranks as f64 / 50.0 * 1.4, "{ranks}: {cuts:?}");
        }
    }
}
