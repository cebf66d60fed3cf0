//! Multigrid of all ranks on the device of each: the levels are the same on all, as is what a cycle makes of them.
//!
//! A rank makes the rows of the finest level that its own cells have. Which cells have some, what is in these rows, and in each cycle the residuals
//! of the cells come from all ranks; the coarser levels and the cycle over them follow, computed by every device from the same numbers. So a
//! cycle is that of one device, and takes one round of all ranks; shared level by level it would take five and more, for bytes that are few as it is.

use super::GpuRank;
use super::halo::Shown;
use crate::backend::gpu::buffers;
use crate::backend::gpu::hierarchy::Levels;
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
/// Workgroups of the kernels over cells or rows at most; threads then take several.
const GROUPS_MAX: u64 = 1024;

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

/// Workgroups for `threads` that may stride.
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
