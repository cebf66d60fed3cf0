//! The borders of a rank: what it shows those beside it, and what it is shown.

use crate::fields::State;
use bytemuck::Pod;
use glam::DVec3;
use std::ops::Range;

/// A border: what this rank gives and what it takes, ranges of water and single places, of wall layers (or rows of
/// a level).
#[derive(Clone, Debug, Default)]
pub struct Side {
    pub(super) give: Range<usize>,
    pub(super) take: Range<usize>,
    pub(super) give_walls: Vec<u32>,
    pub(super) take_walls: Vec<u32>,
}

/// An array of which ranks show each other the border.
pub trait Bordered {
    /// Append what the other rank is to see.
    fn give(&self, side: &Side, out: &mut Vec<u8>);
    /// Take in what it has shown; `from` moves on.
    fn take(&mut self, side: &Side, from: &mut &[u8]);
}

fn give<T: Copy, U: Pod>(
    values: &[T],
    slots: impl Iterator<Item = usize>,
    code: impl Fn(T) -> U,
    out: &mut Vec<u8>,
) {
    slots.for_each(|i| out.extend_from_slice(bytemuck::bytes_of(&code(values[i]))));
}

fn take<T, U: Pod>(
    values: &mut [T],
    slots: impl Iterator<Item = usize>,
    value: impl Fn(U) -> T,
    from: &mut &[u8],
) {
    for i in slots {
        let (own, rest) = from.split_at(size_of::<U>());
        values[i] = value(bytemuck::pod_read_unaligned(own));
        *from = rest;
    }
}

impl Side {
    /// Slots of water that are shown to the other rank, and those that it shows.
    pub(crate) fn water(&self) -> [Range<usize>; 2] {
        [self.give.clone(), self.take.clone()]
    }

    /// Of the places `give` and `take` of an array.
    pub(crate) fn of(give: Vec<u32>, take: Vec<u32>) -> Self {
        Self { give: 0..0, take: 0..0, give_walls: give, take_walls: take }
    }

    /// Places that are shown to the other rank: water, then single ones.
    pub(crate) fn given(&self) -> impl Iterator<Item = usize> + '_ {
        self.give.clone().chain(self.give_walls.iter().map(|&s| s as usize))
    }

    /// Places that it shows.
    pub(crate) fn taken(&self) -> impl Iterator<Item = usize> + '_ {
        self.take.clone().chain(self.take_walls.iter().map(|&s| s as usize))
    }
}

/// Positions and velocities: of the water alone, as every rank knows those of solids.
impl Bordered for &mut [DVec3] {
    fn give(&self, side: &Side, out: &mut Vec<u8>) {
        give(self, side.give.clone(), |v| v, out);
    }

    fn take(&mut self, side: &Side, from: &mut &[u8]) {
        take(self, side.take.clone(), |v| v, from);
    }
}

macro_rules! of_carriers {
    ($($number:ty)*) => {$(
        impl Bordered for &mut [$number] {
            fn give(&self, side: &Side, out: &mut Vec<u8>) {
                give(self, side.given(), |v| v, out);
            }

            fn take(&mut self, side: &Side, from: &mut &[u8]) {
                take(self, side.taken(), |v| v, from);
            }
        }
    )*};
}
of_carriers!(f32 f64);

/// Numbers of the first walls that carry pressure, behind `fluid` slots of water; other slots of the border have none.
pub struct OfWalls<'a> {
    /// Slots of the water.
    pub fluid: usize,
    /// One a wall.
    pub values: &'a mut [f64],
}

/// Numbers of those of `slots` that are of the first `count` walls behind `fluid` slots of water.
fn walls(slots: impl Iterator<Item = usize>, fluid: usize, count: usize) -> impl Iterator<Item = usize> {
    slots.filter_map(move |i| i.checked_sub(fluid)).filter(move |&k| k < count)
}

impl Bordered for OfWalls<'_> {
    fn give(&self, side: &Side, out: &mut Vec<u8>) {
        give(self.values, walls(side.given(), self.fluid, self.values.len()), |v| v, out);
    }

    fn take(&mut self, side: &Side, from: &mut &[u8]) {
        let walls = walls(side.taken(), self.fluid, self.values.len());
        take(self.values, walls, |v: f64| v, from);
    }
}

impl Bordered for &mut [State] {
    fn give(&self, side: &Side, out: &mut Vec<u8>) {
        give(self, side.given(), |s| s as u8, out);
    }

    fn take(&mut self, side: &Side, from: &mut &[u8]) {
        take(self, side.taken(), |code| State::from_code(code).unwrap_or_default(), from);
    }
}
