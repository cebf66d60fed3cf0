//! Whether a piston's wave is made for the water that stands before it.

use super::build::Builder;
use std::collections::HashMap;

/// How far before the face its water is looked at, in spacings.
const BEFORE: f64 = 4.0;
/// Depths that differ by more spacings do, whatever was rounded.
const DIFFERS: f64 = 1.05;

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
            let mut columns: HashMap<[i32; 2], Vec<i32>> = HashMap::new();
            for &c in &self.water.cell {
                let x = self.lattice.center(c);
                let ahead = sign * (x[axis] - face);
                let beside = self.lattice.plane || (lo[across]..hi[across]).contains(&x[across]);
                if beside && (0.0..BEFORE * l0).contains(&ahead) {
                    columns.entry([c.x, c.y]).or_default().push(c.z);
                }
            }
            // What hangs above the water with air between is not there yet.
            let height = |mut cells: Vec<i32>| {
                cells.sort_unstable();
                1 + cells.windows(2).take_while(|pair| pair[1] == pair[0] + 1).count()
            };
            let there = l0 * columns.into_values().map(height).max().unwrap_or(0) as f64;
            let depth = wave.wanted.depth;
            if (there - depth).abs() > DIFFERS * l0 {
                let there = if there > 0.0 { format!("{there:.4} m deep") } else { "not there".into() };
                self.notes.push(format!(
                    "moving wall `{}`: the wave is made for water {depth:.4} m deep, and that at the piston is {there}: `depth` in its `wave` \
                     says what it is made for",
                    wall.name
                ));
            }
        }
    }
}
