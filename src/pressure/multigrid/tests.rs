//! Levels that ranks share are those of one, and so is what a cycle makes of them: on water that is anywhere,
//! whatever the cuts.

use super::hierarchy::Hierarchy;
use super::level::compress;
use super::shared::meet;
use crate::cells::Grid;
use crate::chance::mixed;
use crate::kernels::multigrid_levels::offset_of;
use crate::periodic::Periodic;
use crate::ranks::threads::team;
use crate::share::Share;
use glam::DVec3;
use std::collections::BTreeMap;

/// Cells with unknowns, and a definite operator over them.
struct Water {
    grid: Grid,
    /// Columns without any.
    dry: std::ops::Range<i32>,
}

impl Water {
    fn new(count: [u32; 3], around: [bool; 3], dry: std::ops::Range<i32>) -> Self {
        let high = DVec3::from_array(count.map(f64::from));
        let periodic = Periodic::new(around, DVec3::ZERO, high);
        Self {
            grid: Grid { origin: DVec3::ZERO, width: DVec3::ONE, count, periodic, held: [0, count[0]] },
            dry,
        }
    }

    /// A number by chance of two cells, from 0 to 1, the same for both.
    fn chance(&self, a: [i32; 3], b: [i32; 3]) -> f64 {
        let [a, b] = [a, b].map(|c| self.grid.index(c.map(|k| k as u32)) as u64);
        mixed(a.min(b) << 32 | a.max(b)) as f64 / u64::MAX as f64
    }

    /// The cell at `c`, between the sides and if it has an unknown.
    fn at(&self, mut c: [i32; 3]) -> Option<[i32; 3]> {
        for (k, c) in c.iter_mut().enumerate() {
            let n = self.grid.count[k] as i32;
            if self.grid.periodic.is_along(k) {
                *c = c.rem_euclid(n);
            }
            if !(0..n).contains(c) {
                return None;
            }
        }
        // Three of four, in columns that are not dry.
        (!self.dry.contains(&c[0]) && self.chance(c, c) < 0.75).then_some(c)
    }

    fn cells(&self) -> Vec<[i32; 3]> {
        let all = 0..self.grid.total();
        all.filter_map(|cell| self.at(self.grid.coordinates_of(cell).map(|k| k as i32))).collect()
    }

    fn stencil(&self, c: [i32; 3]) -> [f64; 27] {
        let mut out = [0.0; 27];
        for k in (0..27).filter(|&k| k != 13) {
            let d = offset_of(k);
            if let Some(other) = self.at([0, 1, 2].map(|k| c[k] + d[k])) {
                out[k] = -0.5 - self.chance(c, other);
            }
        }
        out[13] = 0.05 - out.iter().sum::<f64>();
        out
    }

    /// What a cycle makes of a right side by chance, of the cells that this rank has; then how many levels are
    /// shared, and the rows of all levels here.
    fn cycle(&self, share: Option<&Share>) -> (BTreeMap<[i32; 3], f32>, usize, Vec<usize>) {
        let mut coarse = Hierarchy::default();
        // The second time in the buffers of the first.
        for _ in 0..2 {
            coarse.begin(&self.grid, share);
            let columns = coarse.columns().cloned();
            let is_mine =
                |c: &[i32; 3]| columns.as_ref().is_none_or(|columns| columns.mine().contains(&c[0]));
            let level = &mut coarse.levels[0];
            level.coordinates = self.cells().into_iter().filter(is_mine).collect();
            level.own = level.coordinates.len();
            let own = level.coordinates.clone();
            if let Some((share, columns)) = share.zip(columns.as_ref()) {
                meet(level, share, columns);
            }
            coarse.scratch.stencil = own.iter().map(|&c| self.stencil(c)).collect();
            compress(level, &mut coarse.scratch);
            coarse.coarsen(share);
            let level = &mut coarse.levels[0];
            for (b, &c) in level.b.iter_mut().zip(&own) {
                *b = self.chance(c, [0, 0, 0]) as f32 - 0.3;
            }
            coarse.cycle(0, share);
        }
        for (level, columns) in coarse.used().iter().zip(coarse.shared()) {
            let (own, beside) = level.coordinates.split_at(level.own);
            let mine = columns.mine();
            assert!(own.iter().all(|c| mine.contains(&c[0])), "own columns");
            assert!(beside.iter().all(|c| c[0] == mine.start - 1 || c[0] == mine.end), "and those beside");
        }
        let level = &coarse.levels[0];
        let out = level.coordinates[..level.own].iter().copied().zip(level.x.iter().copied()).collect();
        (out, coarse.shared().len(), coarse.used().iter().map(|level| level.own).collect())
    }

    /// The same of ranks that are cut like this.
    fn on_ranks(&self, cuts: &[u32]) -> (BTreeMap<[i32; 3], f32>, usize, Vec<Vec<usize>>) {
        let ring = self.grid.periodic.is_along(0) && cuts.len() > 2;
        let (mut out, mut shared, mut rows) = (BTreeMap::new(), 0, Vec::new());
        std::thread::scope(|scope| {
            let of = |team| move || self.cycle(Some(&Share::of_columns(team, ring, cuts.to_vec())));
            let ranks: Vec<_> = team(cuts.len() - 1).into_iter().map(|team| scope.spawn(of(team))).collect();
            for rank in ranks {
                let (part, levels, own) = rank.join().expect("a rank ends well");
                let parts = part.len();
                let before = out.len();
                out.extend(part);
                assert_eq!(out.len(), before + parts, "a cell is one rank's");
                shared = levels;
                rows.push(own);
            }
        });
        (out, shared, rows)
    }

    fn compare(&self, cuts: &[u32], least_shared: usize) {
        let (one, _, levels) = self.cycle(None);
        let (many, shared, rows) = self.on_ranks(cuts);
        assert!(shared >= least_shared, "{cuts:?}: {shared} levels shared");
        for (l, &all) in levels.iter().enumerate() {
            let sum: usize = rows.iter().map(|own| own[l]).sum();
            // Each row of a shared level is one rank's; the others are everyone's.
            let there = if l < shared { sum } else { sum / rows.len() };
            assert_eq!(there, all, "{cuts:?}: level {l}, {rows:?}");
        }
        let scale = one.values().fold(0.0_f32, |m, x| m.max(x.abs()));
        assert!(scale > 0.1, "{scale}");
        assert_eq!(one.len(), many.len());
        for (c, x) in &one {
            assert!((x - many[c]).abs() < 2e-6 * scale, "{cuts:?} at {c:?}: {x} {} of {scale}", many[c]);
        }
        // The same bits another time.
        assert!(many == self.on_ranks(cuts).0);
    }
}

/// Cuts of `columns` by chance.
fn cuts(columns: u32, ranks: u32, seed: u64) -> Vec<u32> {
    let mut at: Vec<u64> = (1..u64::from(columns)).collect();
    at.sort_by_key(|&c| mixed(seed << 20 | c));
    let mut cuts: Vec<u32> = at[..ranks as usize - 1].iter().map(|&c| c as u32).collect();
    cuts.extend([0, columns]);
    cuts.sort_unstable();
    cuts
}

#[test]
fn a_cycle_of_many_ranks_is_that_of_one() {
    for (count, around) in [
        ([41, 1, 17], [false; 3]),
        ([40, 1, 12], [true, false, false]),
        ([37, 1, 12], [true, false, false]),
        ([24, 6, 7], [false, true, false]),
        ([19, 5, 6], [true, true, false]),
        ([33, 5, 9], [false; 3]),
    ] {
        let water = Water::new(count, around, 0..0);
        for (ranks, shared) in [(2, 3), (3, 3), (5, 2), (8, 2)] {
            let even: Vec<u32> = (0..=ranks).map(|r| r * count[0] / ranks).collect();
            water.compare(&even, shared);
            for seed in 0..4 {
                let cuts = cuts(count[0], ranks, seed);
                let ends = ranks == 2 && around[0] && cuts.windows(2).any(|c| c[1] - c[0] < 2);
                if !ends {
                    water.compare(&cuts, 1);
                }
            }
        }
        water.compare(&[0, count[0]], 1);
    }
}

#[test]
fn ranks_without_unknowns_have_their_part_in_a_cycle() {
    for around in [[false; 3], [true, false, false]] {
        // The first rank, one in the middle with and without a bit of its neighbours', the last one; in both halves
        // of a coarse column.
        for dry in [0..11, 11..23, 10..24, 9..24, 23..48, 12..22] {
            let water = Water::new([48, 1, 14], around, dry);
            water.compare(&[0, 11, 23, 48], 3);
            water.compare(&[0, 4, 11, 17, 23, 35, 48], 2);
        }
    }
}
