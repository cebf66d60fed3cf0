//! What slots between solids bring the rows of a body's wall layer; found by [`crate::slots`].

use super::Wrench;
use serde::{Deserialize, Serialize};

/// A row of a free body's wall layer at a slot or in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SlotRow {
    /// Index of the solid.
    pub solid: u32,
    /// Index of the row in the solid's wall layer.
    pub row: u32,
    /// Part of the row's own area that lies in a slot [-]; what presses there comes from the rim.
    pub taken: f64,
    /// What one pascal on this row does to the body through slots: force [m2] and torque [m3], world axes.
    pub per_pascal: Wrench,
    /// The weight of the water between this row and the slots, as long as the row is under water [N], [N m].
    pub head: Wrench,
    /// What seeps through a slot from this row to the rest of its rim: its link to a pressure that is known.
    pub seep: Seep,
}

impl SlotRow {
    /// What it does to the body where its row has a `pressure` [Pa].
    pub fn pressed(&self, pressure: f64) -> Wrench {
        let mut sum = self.head;
        sum.add(pressure, &self.per_pascal);
        sum
    }
}

/// A link of a row to a pressure that is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seep {
    /// Weight of the link over n0 [-].
    pub link: f64,
    /// That weight times the pressure [Pa].
    pub known: f64,
}

/// Of `rows`, those of `solid`: in turn what each row of its wall layer has, nothing for one that is at no slot.
pub fn of(rows: &[SlotRow], solid: usize) -> impl FnMut(usize) -> SlotRow {
    let first = rows.partition_point(|row| (row.solid as usize) < solid);
    let mut at = rows[first..].iter().take_while(move |row| row.solid as usize == solid).peekable();
    move |k| at.next_if(|slot| slot.row as usize == k).copied().unwrap_or_default()
}
