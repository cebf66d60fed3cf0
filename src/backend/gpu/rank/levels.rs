//! Multigrid of all ranks on the device of each: the levels are the same on all, as is what a cycle makes of them.
//!
//! A rank makes the rows of the finest level that its own cells have. Which cells have some, what is in these rows, and in each cycle the residuals
//! of the cells come from all ranks; the coarser levels and the cycle over them follow, computed by every device from the same numbers. So a
//! cycle is that of one device, and takes one round of all ranks; shared level by level it would take five and more, for bytes that are few as it is.

use super::GpuRank;
use super::halo::Shown;
use crate::backend::gpu::buffers;
use crate::backend::gpu::hierarchy::{GROUPS_MAX, Levels};
use crate::backend::gpu::layout::Solve;
use crate::error::Result;
use crate::kernels::device::halo as kernel;
use crate::kernels::device::multigrid_levels;
use crate::kernels::device::of_halo::buffer;
use std::ops::Range;

/// Entries of a row that are told, from the diagonal on; `HALF` in shaders/halo.wgsl.
const HALF: usize = 14;
/// Cells of which a word tells.
const WORD: usize = u32::BITS as usize;

/// Rows of the finest level.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    /// Of each rank.
    count: Vec<usize>,
}

impl Rows {
    fn all(&self) -> usize {
        self.count.iter().sum()
    }
}

/// Workgroups for as many threads, or for fewer that take several cells or rows each.
fn groups(threads: usize) -> u64 {
    super::groups(threads).min(GROUPS_MAX)
}

/// How many of the bits `range` of `words` are set.
fn bits_in(words: &[u32], range: Range<usize>) -> usize {
    range.filter(|k| words[k / WORD] >> (k % WORD) & 1 == 1).count()
}

impl GpuRank {
    /// Make the levels for the system at hand.
    pub(super) fn build_levels(&mut self) -> Result<()> {
        let Some(levels) = self.gpu.levels.clone() else { return Ok(()) };
        let column = levels.count[0][1] * levels.count[0][2];
        let mine = self.share.columns();
        let mut hierarchy = levels.hierarchy();
        let beside = self.share.beyond().map(|c| c.map_or(u32::MAX, |c| c * column));
        hierarchy.set_own([mine.start * column, mine.end * column], beside);
        let context = &mut self.gpu.context;
        context.upload(buffers::hierarchy, &[hierarchy])?;
        context.clear(buffers::cell_mark)?;
        context.clear(buffers::aggregate)?;
        context.pass(levels.mark())?;
        self.tell_cells(&levels)?;
        let context = &mut self.gpu.context;
        context.pass(levels.number())?;
        context.pass([(multigrid_levels::place_copies, groups(2 * column as usize))])?;
        context.pass(levels.galerkin())?;
        self.tell_entries()?;
        self.gpu.context.pass(levels.coarsen())
    }

    /// Tells which cells hold unknowns, and to the ranks beside which copies of theirs are some.
    fn tell_cells(&mut self, levels: &Levels) -> Result<()> {
        let cells = levels.first_cells() as usize;
        let (words, column) = (cells.div_ceil(WORD), cells / self.share.all_columns());
        let part = |columns: Range<u32>| columns.start as usize * column..columns.end as usize * column;
        let of = |cells: Range<usize>| cells.start / WORD..cells.end.div_ceil(WORD);
        let mine = of(part(self.share.columns()));
        self.gpu.context.reserve(buffer::wet_cell.id(), 4 * words as u64)?;
        self.gpu.context.pass([(kernel::give_wet_cells, groups(words))])?;
        let shown = self.pack(Shown::Unknown)?;
        let parts = [
            (buffer::wet_cell.id(), 4 * mine.start as u64, 4 * mine.len() as u64),
            (buffer::halo.id(), 0, shown),
        ];
        let mut bytes = self.gpu.context.download_bytes(&parts, false)?;
        let shown = bytes.split_off(4 * mine.len());
        let told = self.share.gather(bytes);
        let ranks = (0..told.len()).map(|rank| part(self.share.columns_of(rank)));
        // Ranks that meet within a word each have the bits of their own cells.
        let mut wet = vec![0_u32; words];
        for (cells, bytes) in ranks.clone().zip(&told) {
            let told = bytemuck::pod_collect_to_vec::<u8, u32>(bytes);
            wet[of(cells)].iter_mut().zip(told).for_each(|(word, bits)| *word |= bits);
        }
        self.rows = Rows { count: ranks.map(|cells| bits_in(&wet, cells)).collect() };
        let rank = self.share.rank();
        let before: usize = self.rows.count[..rank].iter().sum();
        self.set_rows([before as u32, self.rows.count[rank] as u32])?;
        self.gpu.context.upload(buffer::wet_cell, &wet)?;
        self.gpu.context.pass([(kernel::take_wet_cells, groups(cells))])?;
        self.swap(Shown::Unknown, shown)
    }

    /// Tells the rows of the finest level's operator.
    fn tell_entries(&mut self) -> Result<()> {
        let (own, all) = (self.rows.count[self.share.rank()], self.rows.all());
        self.gpu.context.reserve(buffer::halo.id(), 4 * (HALF * all) as u64)?;
        self.gpu.context.pass([(kernel::give_entries, groups(own))])?;
        let told = self.gpu.context.download(buffer::halo, HALF * own)?;
        let all_told = self.share.gather(bytemuck::cast_slice(&told).to_vec());
        self.gpu.context.upload_bytes(buffer::halo.id(), &all_told.concat())?;
        self.gpu.context.pass([(kernel::take_entries, groups(all))])
    }

    /// Tells the residuals of the finest level's cells, unless the solve is done; what the device says of it.
    pub(super) fn tell_coarse(&mut self) -> Result<Solve> {
        let (own, all) = (self.rows.count[self.share.rank()], self.rows.all());
        self.gpu.context.pass([(kernel::give_coarse, groups(own))])?;
        let solve = buffers::solve;
        let parts = [(solve.id(), 0, solve.size()), (buffer::halo.id(), 0, 4 * own as u64)];
        let mut bytes = self.gpu.context.download_bytes(&parts, false)?;
        let residuals = bytes.split_off(solve.size() as usize);
        let solve: Solve = bytemuck::pod_read_unaligned(&bytes);
        let told = self.share.gather(if solve.done == 0 { residuals } else { Vec::new() });
        if told
            .iter()
            .zip(&self.rows.count)
            .any(|(b, rows)| b.len() != if solve.done == 0 { 4 * rows } else { 0 })
        {
            return Err(super::solve::differ());
        }
        if solve.done == 0 {
            self.gpu.context.upload_bytes(buffer::halo.id(), &told.concat())?;
            self.gpu.context.pass([(kernel::take_coarse, groups(all))])?;
        }
        Ok(solve)
    }
}

#[cfg(test)]
mod tests {
    use super::super::rig::{Rig, there_is_a_device};
    use super::*;
    use crate::case::Case;
    use crate::plan::Stage;
    use crate::ranks::Team;
    use crate::ranks::threads::team;
    use glam::DVec3;
    use std::sync::Arc;

    /// Walls on borders of cells, a gate that moves along x, and a slab of water with a step in it.
    fn case(more: &str) -> Case {
        let text = format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\n\
             [fluid]\nsound_speed = 5\njitter = 0.1\nsolver = {{ preconditioner = \"multigrid\" }}\n\
             [[fluid.block]]\nmin = [0, 0, 0]\nmax = [1.0, 0.4, 0.5]\n[[fluid.block]]\nmin = [1.2, 0, 0]\nmax = [1.6, 0.4, 0.3]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [1.6, 0.4, 0.8]\nopen = [\"z_max\"]\n{more}\
             [[moving_wall]]\nname = \"gate\"\nmin = [1.05, 0, 0]\nmax = [1.15, 0.4, 0.6]\nmotion = [[0, 0, 0, 0], [1, 1, 0, 0]]\n"
        );
        toml::from_str(&text).expect("a valid case")
    }

    /// The levels as a device has them: rows, their cells and parents, columns and values.
    #[derive(PartialEq)]
    struct Seen {
        rows: Vec<usize>,
        cells: Vec<[u32; 2]>,
        entries: Vec<[u32; 2]>,
    }

    /// Those of the third step on this rank.
    fn of_third_step(one: Arc<dyn Team>, case: &Case) -> Seen {
        let mut rig = Rig::new(one, case, DVec3::X);
        for n in 0..3 {
            rig.step(|_, stage| n < 2 || stage != Stage::ConjugateGradient);
        }
        let rank = &mut rig.rank;
        rank.build_levels().expect("they are made");
        let levels = rank.gpu.levels.clone().expect("it is planned");
        let (capacity, count) = (levels.capacity as usize, levels.count.len());
        let context = &mut rank.gpu.context;
        let row_cell = context.download(buffers::row_cell, capacity + 1 + count).expect("read");
        let all = row_cell[capacity][0] as usize;
        let entry = context.download(buffers::entry, 27 * capacity).expect("read");
        let of_row = |row: usize| (0..27).map(move |k| k * capacity + row);
        Seen {
            rows: row_cell[capacity..].iter().map(|word| word[0] as usize).collect(),
            cells: row_cell[..all].iter().map(|row| [row[0], row[1]]).collect(),
            entries: (0..all).flat_map(of_row).map(|at| entry[at]).collect(),
        }
    }

    #[test]
    fn levels_of_many_devices_are_those_of_one() {
        if !there_is_a_device("the levels of ranks are") {
            return;
        }
        for (name, case) in [("tank", case("")), ("ring", case("periodic = [\"x\"]\n"))] {
            let of = |ranks: usize| -> Vec<Seen> {
                std::thread::scope(|scope| {
                    let ranks = team(ranks).into_iter().map(|one| scope.spawn(|| of_third_step(one, &case)));
                    let ranks: Vec<_> = ranks.collect();
                    ranks.into_iter().map(|rank| rank.join().expect("it ends")).collect()
                })
            };
            let one = of(1).remove(0);
            assert!(one.rows.len() > 4 && one.cells.len() > 200, "{name}: {:?}", one.rows);
            let value = |e: &[u32; 2]| f32::from_bits(e[1]);
            let largest = one.entries.iter().map(value).fold(0.0, f32::max);
            for ranks in [2, 3, 4] {
                let many = of(ranks);
                assert!(
                    many.iter().all(|seen| *seen == many[0]),
                    "{name}: devices have the same to the last bit"
                );
                let many = &many[0];
                assert_eq!((&many.rows, &many.cells), (&one.rows, &one.cells), "{name} on {ranks}");
                for (a, b) in one.entries.iter().zip(&many.entries) {
                    assert!((value(a) - value(b)).abs() < 1e-5 * largest, "{name} on {ranks}: {a:?} {b:?}");
                    assert!(
                        a[0] == b[0] || value(a).abs().max(value(b).abs()) < 1e-5 * largest,
                        "{name} on {ranks}"
                    );
                }
                // Of the finest level what is told makes both halves.
                let row = |row: usize| &many.entries[27 * row..27 * row + 27];
                for i in many.rows[1]..many.rows[0] {
                    for (k, e) in row(i).iter().enumerate().filter(|(k, e)| *k != 13 && value(e) != 0.0) {
                        let mirrored = &row(e[0] as usize)[26 - k];
                        assert_eq!((mirrored[0] as usize, mirrored[1]), (i, e[1]), "{name} on {ranks}");
                    }
                }
            }
        }
    }

    #[test]
    fn cells_are_counted_within_words() {
        let words = [0x8000_0001, 0b101];
        assert_eq!(
            [0..64, 0..31, 31..33, 33..64, 40..40].map(|range| bits_in(&words, range)),
            [4, 1, 2, 1, 0]
        );
    }
}
