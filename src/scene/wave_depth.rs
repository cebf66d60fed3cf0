//! Whether a piston's wave is made for the water that stands before it.

use super::build::Builder;
use glam::IVec3;
use std::collections::HashMap;

/// How far before the face its water is looked at, in spacings.
const BEFORE: f64 = 4.0;
/// Depths that differ by more spacings do, whatever was rounded.
const DIFFERS: f64 = 1.5;

impl Builder<'_> {
    /// Notes waves that are made for another depth than that of the water as it was laid.
    pub(super) fn depth_of_waves(&mut self) {
        let (case, l0) = (self.case, self.lattice.spacing);
        for wall in &case.moving_wall {
            let (Some(wave), Some((axis, sign, face)), Some((lo, hi))) =
                (wall.wave(case), wall.face(), wall.straight_box())
            else {
                continue;
            };
            let across = 1 - axis;
            // Lowest and highest cell of each column of water.
            let mut columns: HashMap<[i32; 2], (i32, i32)> = HashMap::new();
            for &c in &self.water.cell {
                let x = self.lattice.center(c);
                let ahead = sign * (x[axis] - face);
                let beside = self.lattice.plane || (lo[across]..hi[across]).contains(&x[across]);
                if beside && (0.0..BEFORE * l0).contains(&ahead) {
                    let column = columns.entry([c.x, c.y]).or_insert((c.z, c.z));
                    *column = (column.0.min(c.z), column.1.max(c.z));
                }
            }
            let ends = |(low, high): (i32, i32)| {
                let corner = |z| self.lattice.corner(IVec3::new(0, 0, z)).z;
                corner(high + 1) - corner(low)
            };
            let there = columns.into_values().map(ends).fold(0.0, f64::max);
            let depth = wave.wanted.depth;
            if (there - depth).abs() > DIFFERS * l0 {
                let there = if there > 0.0 { format!("{there:.4} m deep") } else { "not there".into() };
                self.notes.push(format!(
                    "moving wall `{}`: the wave is made for water {depth} m deep, and that at the piston is {there}: `depth` in its `wave` says \
                     what it is made for",
                    wall.name
                ));
            }
        }
    }
}
