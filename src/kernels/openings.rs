//! Openings: a layer of wall particles becomes water where it has gone a spacing into the tank, and water behind an outflow is
//! swallowed.
//! GPU twin: shaders/openings.wgsl

use crate::fields::Fields;
use crate::scene::Kind;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A wall layer, or a part of one, that becomes water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Emission {
    /// Its slots.
    pub wall: Range<usize>,
    /// First of the fluid slots that the water takes; parked ones.
    pub to: usize,
    /// From where the layer stands to where the water begins [m].
    pub shift: DVec3,
    /// Velocity of the water [m/s].
    pub velocity: DVec3,
}

/// A box in which water is swallowed, but for the room in it; one that is empty swallows none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outlet {
    /// Lower corner [m].
    pub low: DVec3,
    /// Upper corner [m].
    pub high: DVec3,
    /// Lower corner of the room behind a hole, in which its jet contracts: no outlet swallows there [m].
    pub room_low: DVec3,
    /// Upper corner of the room [m]; of none below the lower one.
    pub room_high: DVec3,
}

impl Outlet {
    /// One that swallows nothing.
    pub const CLOSED: Self = Self::all((DVec3::ONE, DVec3::NEG_ONE));

    /// One that swallows in all of a box from its lower corner to its upper one [m].
    pub const fn all((low, high): (DVec3, DVec3)) -> Self {
        Self { low, high, room_low: DVec3::ONE, room_high: DVec3::NEG_ONE }
    }

    /// Whether it swallows nothing.
    pub fn is_closed(&self) -> bool {
        self.low.cmpgt(self.high).any()
    }
}

/// The k-th particle of the water of `emission`: it has the pressure of the wall particle that it was.
pub fn emit(emission: &Emission, k: usize, fields: &mut Fields) {
    let (wall, i) = (emission.wall.start + k, emission.to + k);
    fields.position[i] = fields.position[wall] + emission.shift;
    fields.velocity[i] = emission.velocity;
    fields.kind[i] = Kind::Fluid;
    fields.pressure[i] = fields.pressure[wall];
}

/// The first of `outlets` that holds `x`, if it lies in no room.
#[inline(always)]
pub fn swallow(x: DVec3, outlets: &[Outlet]) -> Option<usize> {
    let within = |low: DVec3, high: DVec3| x.cmpge(low).all() && x.cmple(high).all();
    let first = outlets.iter().position(|o| within(o.low, o.high))?;
    (!outlets.iter().any(|o| within(o.room_low, o.room_high))).then_some(first)
}
