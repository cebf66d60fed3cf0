//! Buffers that are larger than what a device binds are made as several: how each may be divided, and what lies where.
//!
//! Drivers give out no single buffer much beyond what a shader binds, so windows into one large buffer would not help:
//! every part is a buffer of its own with a binding of its own. The shaders reach the elements through functions that
//! `access` writes; where there is one part those are the plain indices.

use super::hierarchy::Levels;
use super::memory::{Allocation, Memory, Sizes};

/// How a buffer of the table may be divided.
#[derive(Clone, Copy)]
pub enum Split {
    /// Not at all.
    Whole,
    /// By planes: element `place` of plane `k` lies at `k * length + place`. The plane is the number of a round of a
    /// loop, hence that of all threads at once, and where its part is sought costs next to nothing.
    Planes {
        /// Elements of a plane.
        length: fn(&Sizes, &Levels) -> u64,
        /// The same as the shaders say it.
        pitch: &'static str,
    },
    /// By ranges of a power of two of elements.
    Ranges,
}

/// What of a buffer stays together where it is divided [bytes].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grain {
    /// All of it.
    Whole,
    /// A plane: a part is as many as fit.
    Plane(u64),
    /// An element: a part is a power of two of them.
    Element(u64),
}

impl Grain {
    /// Pieces that a part holds where a device binds `limit` bytes, one at least.
    fn fitting(self, limit: u64) -> u64 {
        match self {
            Self::Whole => 1,
            Self::Plane(bytes) => (limit / bytes).max(1),
            Self::Element(bytes) => 1 << (limit / bytes).max(1).ilog2(),
        }
    }
}

impl Allocation {
    /// Bytes of every part but the last where a device binds `limit` bytes. They are more than that where the buffer
    /// cannot be divided so far.
    pub fn part(&self, limit: u64) -> u64 {
        match self.grain {
            _ if self.bytes <= limit => self.bytes,
            Grain::Whole => self.bytes,
            Grain::Plane(bytes) | Grain::Element(bytes) => bytes * self.grain.fitting(limit),
        }
    }

    /// Number of parts where a device binds `limit` bytes.
    pub fn parts(&self, limit: u64) -> u64 {
        self.bytes.div_ceil(self.part(limit))
    }
}

/// A buffer that is made as several.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parts {
    /// Which one.
    pub buffer: &'static str,
    /// How many.
    pub count: u64,
    /// Planes or elements of every part but the last.
    pub each: u64,
}

/// What of a scene is divided on a device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Division {
    /// The buffers that are.
    pub parts: Vec<Parts>,
    /// Workgroups of a row, where there are dispatches that take more than one.
    pub fold: Option<u32>,
}

impl Division {
    /// That of `memory` on a device that binds `binding` bytes and starts `workgroups` along one dimension.
    pub fn new(memory: &Memory, binding: u64, workgroups: u32) -> Self {
        let divided = memory.buffers.iter().filter(|b| b.parts(binding) > 1);
        let parts = divided.map(|b| Parts {
            buffer: b.id.name(),
            count: b.parts(binding),
            each: b.grain.fitting(binding),
        });
        let fold = (memory.workgroups > u64::from(workgroups)).then_some(workgroups);
        Self { parts: parts.collect(), fold }
    }

    /// How `buffer` is divided, if it is.
    pub fn of(&self, buffer: &str) -> Option<&Parts> {
        self.parts.iter().find(|p| p.buffer == buffer)
    }
}

/// The buffers of one row of the table.
pub(super) struct Buffers {
    /// Bytes of every part but the last.
    part: u64,
    /// In their order; one, unless it is divided.
    pub parts: Vec<wgpu::Buffer>,
}

impl Buffers {
    /// Made of `parts`, all but the last of `part` bytes.
    pub fn new(part: u64, parts: Vec<wgpu::Buffer>) -> Self {
        Self { part, parts }
    }

    /// Where the `bytes` from byte `first` on lie: buffer, first byte in it, bytes.
    pub fn pieces(&self, first: u64, bytes: u64) -> impl Iterator<Item = (&wgpu::Buffer, u64, u64)> {
        let end = first + bytes;
        let piece = move |(k, buffer)| {
            let start = k as u64 * self.part;
            // The last part takes what is beyond: the device then says what is wrong with it.
            let stop = if k + 1 == self.parts.len() { end } else { start + self.part };
            let (from, to) = (first.max(start), end.min(stop));
            (from < to).then(|| (buffer, from - start, to - from))
        };
        self.parts.iter().enumerate().filter_map(piece)
    }

    /// All bytes.
    pub fn size(&self) -> u64 {
        self.parts.iter().map(wgpu::Buffer::size).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::gpu::buffers;
    use crate::compute::Host;

    fn allocation(bytes: u64, grain: Grain) -> Allocation {
        let id = buffers::entry.id();
        Allocation { id, bytes, host: Host::None, purpose: "multigrid", grain }
    }

    #[test]
    fn parts_hold_whole_pieces_and_no_more_than_a_device_binds() {
        let (planes, ranges) = (Grain::Plane(700), Grain::Element(8));
        for (grain, bytes, limit, part, parts) in [
            (planes, 27 * 700, 1 << 20, 27 * 700, 1),
            (planes, 27 * 700, 2000, 1400, 14),
            // A plane is not divided.
            (planes, 27 * 700, 500, 700, 27),
            (ranges, 8 * 1000, 8 * 1000, 8 * 1000, 1),
            (ranges, 8 * 1000, 8 * 999, 8 * 512, 2),
            (ranges, 8 * 1000, 8 * 511, 8 * 256, 4),
            (Grain::Whole, 8 * 1000, 8, 8 * 1000, 1),
        ] {
            let a = allocation(bytes, grain);
            assert_eq!((a.part(limit), a.parts(limit)), (part, parts), "{grain:?} {bytes} {limit}");
        }
        let memory = Memory { buffers: vec![allocation(8 * 1000, ranges)], workgroups: 100, strided: 1 };
        let both = Division::new(&memory, 8 * 300, 99);
        assert_eq!(both.of("entry"), Some(&Parts { buffer: "entry", count: 4, each: 256 }));
        assert_eq!(both.fold, Some(99));
        assert_eq!(Division::new(&memory, 8 * 1000, 100), Division::default());
    }
}
