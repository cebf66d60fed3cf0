//! What devices of ranks show each other: packed by a kernel, read by the host, handed over, written to the other device and unpacked by a kernel.
//!
//! This is the seam for messages from device to device. What `give` leaves in the buffer `halo` is the message to the rank before and then that
//! to the rank after, each without a gap; what they hand over lies there in the same order when `take` runs. An MPI that reads device memory would take
//! [`GpuRank::swap`] over, and nothing else would change.

use super::{GpuRank, groups};
use crate::compute::Kernel;
use crate::error::{Error, Result};
use crate::kernels::device::halo as kernel;
use crate::kernels::device::of_halo::buffer;
use crate::share::Side;

/// Words in front of the lists of slots: first place and length of each, and what [`ROWS`] begins.
const HEAD: usize = 10;
/// First of the words with the rows of the finest level of multigrid: those of ranks before, and own ones.
const ROWS: u64 = 8;

/// An array of which ranks show each other the border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    /// Where the water is and how it moves.
    Motion,
    /// Its part in the pressure equation.
    State,
    SurfacePressure,
    Pressure,
    /// The vector beside the positions.
    Search,
    /// Of free bodies' wall layers.
    Head,
    /// Whether its pressure is an unknown.
    Unknown,
}

impl Shown {
    /// What packs and unpacks it.
    fn kernels(self) -> [Kernel; 2] {
        match self {
            Self::Motion => [kernel::give_motion, kernel::take_motion],
            Self::State => [kernel::give_state, kernel::take_state],
            Self::SurfacePressure => [kernel::give_surface_pressure, kernel::take_surface_pressure],
            Self::Pressure => [kernel::give_pressure, kernel::take_pressure],
            Self::Search => [kernel::give_search, kernel::take_search],
            Self::Head => [kernel::give_head, kernel::take_head],
            Self::Unknown => [kernel::give_unknown, kernel::take_unknown],
        }
    }

    /// Numbers of a slot.
    fn numbers(self) -> usize {
        if self == Self::Motion { 6 } else { 1 }
    }

    /// Whether walls, of which every rank knows it, have none to show.
    fn is_of_water(self) -> bool {
        matches!(self, Self::Motion | Self::State)
    }
}

/// How many slots each side is shown, and shows: of all that carry pressure, and of the water alone.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lists {
    carriers: Border,
    water: Border,
}

/// Slots given to the ranks before and after, and taken from them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Border {
    pub given: [usize; 2],
    pub taken: [usize; 2],
}

impl Border {
    pub fn all_given(&self) -> usize {
        self.given.iter().sum()
    }

    pub fn all_taken(&self) -> usize {
        self.taken.iter().sum()
    }
}

impl Lists {
    pub fn of(&self, what: Shown) -> Border {
        if what.is_of_water() { self.water } else { self.carriers }
    }
}

impl GpuRank {
    /// Tells the device which slots are at the borders.
    pub(super) fn set_lists(&mut self) -> Result<()> {
        let sides = self.share.sides();
        let of = |slots: &dyn Fn(&Side) -> Vec<u32>| {
            [0, 1].map(|k| sides[k].as_ref().map(slots).unwrap_or_default())
        };
        let number = |slots: &mut dyn Iterator<Item = usize>| slots.map(|s| s as u32).collect::<Vec<u32>>();
        let lists = [
            of(&|side| number(&mut side.given())),
            of(&|side| number(&mut side.taken())),
            of(&|side| number(&mut side.water()[0].clone())),
            of(&|side| number(&mut side.water()[1].clone())),
        ];
        let mut words = vec![0_u32; HEAD];
        for (k, list) in lists.iter().enumerate() {
            words[2 * k] = words.len() as u32;
            words[2 * k + 1] = list.iter().map(Vec::len).sum::<usize>() as u32;
            list.iter().for_each(|side| words.extend_from_slice(side));
        }
        let [given, taken, water_given, water_taken] = lists.map(|list| list.map(|side| side.len()));
        self.lists = Lists {
            carriers: Border { given, taken },
            water: Border { given: water_given, taken: water_taken },
        };
        let context = &mut self.gpu.context;
        let most = self.lists.carriers.all_given().max(self.lists.carriers.all_taken());
        context.reserve(buffer::halo_slot.id(), 4 * words.len() as u64)?;
        context.reserve(buffer::halo.id(), 4 * (Shown::Motion.numbers() * most) as u64)?;
        context.upload(buffer::halo_slot, &words)
    }

    /// Records that the border of `what` is packed; returns the bytes of it in `halo`.
    pub(super) fn pack(&mut self, what: Shown) -> Result<u64> {
        let given = self.lists.of(what).all_given();
        if given > 0 {
            self.gpu.context.pass([(what.kernels()[0], groups(given))])?;
        }
        Ok(4 * (what.numbers() * given) as u64)
    }

    /// Hands over what was packed, `bytes`, and writes what the others show to the device, where it is unpacked.
    pub(super) fn swap(&mut self, what: Shown, mut bytes: Vec<u8>) -> Result<()> {
        let border = self.lists.of(what);
        let size = 4 * what.numbers();
        let right = bytes.split_off(size * border.given[0]);
        let shown = self.share.pass(bytes, right);
        if border.taken.map(|slots| size * slots) != [shown[0].len(), shown[1].len()] {
            return Err(Error::gpu(format!("ranks that are neighbours have other borders: {what:?}")));
        }
        if border.all_taken() > 0 {
            self.gpu.context.upload_bytes(buffer::halo.id(), &shown.concat())?;
            self.gpu.context.pass([(what.kernels()[1], groups(border.all_taken()))])?;
        }
        Ok(())
    }

    /// Shows the ranks beside this one the border of `what`, and takes theirs over.
    pub(super) fn show(&mut self, what: Shown) -> Result<()> {
        let bytes = self.pack(what)?;
        let packed = self.gpu.context.download_bytes(&[(buffer::halo.id(), 0, bytes)], false)?;
        self.swap(what, packed)
    }

    /// Tells the device how many rows of the finest level of multigrid are those of ranks before this one, and how many its own.
    pub(super) fn set_rows(&mut self, rows: [u32; 2]) -> Result<()> {
        let slot = buffer::halo_slot;
        self.gpu.context.upload_to(slot.id(), slot.size() * ROWS, bytemuck::cast_slice(&rows))
    }
}
