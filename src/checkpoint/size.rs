//! What a state takes on the disk, before there is one.

use super::file::KEPT;

/// Most files at once: those that are kept, and the one that is being written.
pub const AT_ONCE: f64 = KEPT as f64 + 1.0;

/// Bytes of a number in double precision: that of its sign and of most of its exponent is packed, the mantissa does not
/// get smaller. (With it 1,317 states of all kinds, of 100 to 41,000 particles, take no more than is told.)
const NUMBER: f64 = 7.5;
/// Bytes of its number and of its kind, for each particle that moves.
const NAME: f64 = 3.0;
/// Bytes for each neighbour on a full lattice, and for each list. (A neighbour takes 0.7 to 1.05; crowded particles of
/// the paper's scheme have 1.12 times as many as on a lattice.)
const NEIGHBOUR: f64 = 1.4;
const LIST: f64 = 3.0;
/// Bytes of the header without the text of the case, with what gauges keep, and for each solid.
const HEAD: f64 = 10e3;
const SOLID: f64 = 700.0;

/// What a state holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Held {
    /// Slots of water; without any a state has no particles at all.
    pub water: f64,
    /// Particles of solids that move.
    pub moving: f64,
    /// Slots that carry pressure, the water among them.
    pub pressure: f64,
    /// All slots.
    pub slots: f64,
    /// Neighbours of a particle on a full lattice, where lists of them are kept: with viscosity.
    pub neighbours: f64,
    /// Solids.
    pub solids: f64,
    /// Bytes of the text of the case.
    pub text: f64,
}

impl Held {
    /// Bytes of so many files of it.
    pub fn all(&self, states: f64) -> f64 {
        // Of none there is nothing, however large one would be.
        if states > 0.0 { states * self.bytes() } else { 0.0 }
    }

    /// Bytes of its file.
    pub fn bytes(&self) -> f64 {
        let head = HEAD + self.text + self.solids * SOLID;
        if self.water == 0.0 {
            return head;
        }
        let lists = if self.neighbours > 0.0 { LIST + self.neighbours * NEIGHBOUR } else { 0.0 };
        // Places of all, pressure and number density, velocities.
        head + self.slots * 3.0 * NUMBER
            + self.pressure * (2.0 * NUMBER + lists)
            + (self.water + self.moving) * (3.0 * NUMBER + NAME)
    }
}
