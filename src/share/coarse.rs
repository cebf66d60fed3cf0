//! Levels of the multigrid that ranks share, and the columns of each of them that a rank has.

use super::Share;
use super::cut::least;
use crate::cells::Grid;
use crate::kernels::multigrid::{SWEEPS, visits};
use crate::params::Params;
use crate::scene::Groups;
use std::ops::Range;

/// Time of a message to a rank beside [s].
const MESSAGE: f64 = 2e-6;
/// Bytes of rows that a rank goes through in a second.
const BANDWIDTH: f64 = 1e10;

/// Columns of a level along x and whose they are: column p belongs to the rank that has column 2 p of the finer level.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Columns {
    rank: usize,
    ring: bool,
    /// First column of each rank, and the end of the last one's.
    cuts: Vec<u32>,
}

impl Columns {
    pub(super) fn new(rank: usize, ring: bool, cuts: Vec<u32>) -> Self {
        Self { rank, ring, cuts }
    }

    /// Those of the next coarser level, unless that leaves a rank without one.
    fn coarser(&self) -> Option<Self> {
        let cuts: Vec<u32> = self.cuts.iter().map(|c| c.div_ceil(2)).collect();
        let least = least(cuts.len() - 1, self.ring) as u32;
        cuts.windows(2).all(|c| c[1] - c[0] >= least).then_some(Self { cuts, ..*self })
    }

    /// Whether the first and the last one are neighbours, and of different ranks.
    pub fn is_ring(&self) -> bool {
        self.ring
    }

    /// Columns of all ranks.
    fn all(&self) -> i32 {
        self.cuts.last().map_or(0, |&c| c as i32)
    }

    /// Columns of this rank. The one before them is the number less, the one after them their end; in a ring these
    /// may be -1 and as many as there are, for the last and the first.
    pub fn mine(&self) -> Range<i32> {
        self.cuts[self.rank] as i32..self.cuts[self.rank + 1] as i32
    }

    /// The column of the next coarser level that column `c` is a part of, the same way beyond the seam of a ring.
    pub fn parent(&self, c: i32) -> i32 {
        // Behind the last of an odd number, which is its parent's only child, comes the parent of the first.
        if c == self.all() { (c + 1) >> 1 } else { c >> 1 }
    }

    /// Whether the parent of a rank's first column is another rank's anywhere.
    pub fn is_split(&self) -> bool {
        self.cuts.split_last().is_some_and(|(_, first)| first.iter().any(|c| c % 2 == 1))
    }
}

/// The levels that ranks share, the finest always: where each rank has a column of a coarser one (two, where two
/// meet at both ends), as long as it pays. What a rank is spared are the rows of the others in each pass, 20 bytes
/// a row and 8 for each cell beside it; what it costs are messages to both sides: x as [`shows`] counts it, and the
/// residuals of the finer level. The level's rows are reckoned from `wet`, so many cells of the finest as the water
/// fills, which become fewer as all cells do, `count` of each level: no rank has to be asked, and the choice
/// changes with the cuts alone.
pub(super) fn shared(finest: Columns, count: &[[u32; 3]], wet: f64) -> Vec<Columns> {
    let ranks = (finest.cuts.len() - 1) as f64;
    let cells = |count: [u32; 3]| count.map(f64::from).iter().product::<f64>();
    let beside = if count[0][1] == 1 { 8.0 } else { 26.0 };
    let mut levels = vec![finest];
    for l in 1..count.len() {
        let rows = wet * cells(count[l]) / cells(count[0]);
        let spared = rows * (1.0 - 1.0 / ranks) * (20.0 + 8.0 * beside) / BANDWIDTH;
        // A pass before and one after the visit to the next level.
        let passes = 2 * times(l);
        let messages = 2 * (shows(l, count.len()) + times(l));
        match levels[l - 1].coarser() {
            Some(coarser) if passes as f64 * spared >= messages as f64 * MESSAGE => levels.push(coarser),
            _ => break,
        }
    }
    levels
}

/// Visits to level `l` in a cycle.
pub(super) fn times(l: usize) -> u64 {
    (0..l).map(visits).product::<usize>() as u64
}

/// How often x of level `l` of `levels` is shown across the cuts in a cycle.
pub(super) fn shows(l: usize, levels: usize) -> u64 {
    times(l) * if l + 1 == levels { SWEEPS } else { 2 * visits(l) } as u64
}

/// What ranks say for levels when these are made, and in a cycle.
pub(super) struct Said {
    /// Messages to each rank beside.
    pub messages: [u64; 2],
    /// Bytes of these, if the border of each level has so many cells.
    pub message_bytes: [u64; 2],
    /// Rounds of all ranks.
    pub rounds: [u64; 2],
    /// Bytes that all ranks together say in them, if they have so many rows of the first level that is not shared.
    pub round_bytes: [u64; 2],
}

impl Said {
    /// With so many cells at the `border` of each shared level, and so many `rows` of the next one on all ranks.
    pub(super) fn new(shared: &[Columns], levels: usize, border: &[u64], rows: u64) -> Self {
        let (mut messages, mut message_bytes) = ([0; 2], [0; 2]);
        for (l, border) in border.iter().enumerate().take(shared.len()) {
            // What is handed back: stencils once, residuals in a cycle.
            let back = u64::from(l > 0 && shared[l - 1].is_split());
            let shown = shows(l, levels) + back * times(l);
            messages = [messages[0] + 1 + back, messages[1] + shown];
            message_bytes =
                [message_bytes[0] + (CELL + back * STENCIL) * border, message_bytes[1] + 4 * shown * border];
        }
        let joined = if shared.len() < levels { times(shared.len()) } else { 0 };
        let is_joined = joined.min(1);
        Self {
            messages,
            message_bytes,
            rounds: [2 * is_joined, joined],
            round_bytes: [is_joined * (CELL + 4 + STENCIL) * rows, 4 * joined * rows],
        }
    }
}

/// Bytes of a cell's place in its column.
const CELL: u64 = 8;
/// Bytes of a row while it is made.
const STENCIL: u64 = 27 * 8;

/// Cells of the finest level that the water of `all` these particles fills.
pub(super) fn wet_cells(all: &Groups, params: &Params, grid: &Grid) -> f64 {
    let axes = (0..3).filter(|&k| k != 1 || params.dimensions == 3);
    axes.fold(all.fluid as f64, |sum, k| sum * params.spacing / grid.width[k])
}

impl Share {
    /// The columns of the levels that ranks share, of `count` cells each; finest first.
    pub(crate) fn levels(&self, count: &[[u32; 3]]) -> Vec<Columns> {
        let finest = Columns { rank: self.rank(), ring: self.ring, cuts: self.cuts.clone() };
        shared(finest, count, self.wet_cells)
    }

    /// A rank that has nothing but columns, as these `cuts` have it; every level is worth sharing.
    #[cfg(test)]
    pub(crate) fn of_columns(
        team: std::sync::Arc<dyn crate::ranks::Team>,
        ring: bool,
        cuts: Vec<u32>,
    ) -> Self {
        Self {
            team,
            all: Groups::default(),
            groups: Groups::default(),
            corner: glam::DVec3::ZERO,
            per_column: 0,
            ring,
            cuts,
            wet_cells: f64::INFINITY,
            own: 0..0,
            come_in: Vec::new(),
            sides: [None, None],
            walls: Vec::new(),
            searched: Vec::new(),
            steps: 0,
            kept: None,
            said: Default::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::multigrid_levels::level_cells;

    fn of(rank: usize, ring: bool, cuts: &[u32]) -> Columns {
        Columns { rank, ring, cuts: cuts.to_vec() }
    }

    #[test]
    fn a_column_belongs_to_the_rank_that_has_the_first_of_its_two() {
        let fine = of(1, false, &[0, 3, 7, 9]);
        let coarse = fine.coarser().expect("columns for all");
        assert_eq!((coarse.cuts.as_slice(), fine.mine(), coarse.mine()), (&[0, 2, 4, 5][..], 3..7, 2..4));
        assert!(fine.is_split() && !of(0, false, &[0, 4, 6, 9]).is_split());
        // The first column's is the rank before's.
        assert_eq!([2, 3, 4, 6, 7].map(|c| fine.parent(c)), [1, 1, 2, 3, 3]);
        // A rank with a single odd column has none.
        assert_eq!(of(1, false, &[0, 3, 4, 9]).coarser(), None);
        // Beyond the seam: column 8, the only child of 4, and column 0, that of 0.
        let around = of(2, true, &[0, 3, 7, 9]);
        assert_eq!([-1, 8, 9].map(|c| around.parent(c)), [-1, 4, 5]);
        // Two ranks round a tank keep two each.
        assert!(of(0, true, &[0, 3, 8]).coarser().is_some() && of(0, true, &[0, 3, 5]).coarser().is_none());
    }

    #[test]
    fn levels_are_shared_while_it_pays() {
        let shares =
            |wet, cuts: &[u32], cells: [u32; 3]| shared(of(0, false, cuts), &level_cells(cells), wet).len();
        let two = [0, 100, 200];
        // 228 bytes a row at 10 GB/s, four passes and six exchanges of two messages: 526 rows for two ranks, an
        // eighth of those of the level before.
        for (wet, levels) in [(4.1e3, 1), (4.3e3, 2), (3.2e4, 2), (3.5e4, 3), (1e9, 7)] {
            assert_eq!(shares(wet, &two, [200; 3]), levels, "{wet}");
        }
        // A row in two dimensions has a third of that, and the next level a quarter of its rows.
        assert_eq!([5.5e3, 6e3].map(|wet| shares(wet, &two, [200, 1, 200])), [1, 2]);
        // Four ranks spare three quarters of the rows. Columns set an end to it.
        assert_eq!(shares(3.0e3, &[0, 50, 100, 150, 200], [200; 3]), 2);
        assert_eq!(shares(1e9, &[0, 50, 100, 101, 200], [200; 3]), 3);
        assert_eq!(shares(1e9, &[0, 50, 101, 102, 200], [200; 3]), 1);
        // One alone has nothing to share.
        assert_eq!(shares(1e9, &[0, 200], [200; 3]), 1);
    }
}
