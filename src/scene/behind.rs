//! Layers of fixed walls right behind the surface of another wall: they make room for that wall's own.

use super::walls::Fixed;
use crate::shape::PointCells;
use glam::DVec3;

/// Depths behind a row of another wall, over the spacing, at which one particle too many stands for the next layer, which is 1 behind.
const CLOSE: std::ops::Range<f64> = 0.4..0.95;
/// What lies further aside than this, over the spacing, is behind the next row.
const IN_LINE: f64 = 0.55;
/// How deep layers are felt by a row or by the water before it, over the spacing.
const FELT: f64 = 2.2;

/// A row of a wall: its place, and the direction outwards.
#[derive(Clone, Copy)]
pub(super) struct Row(pub DVec3, pub DVec3);

impl Row {
    /// How deep behind it `p` is, over the spacing, if it lies in line with it.
    fn depth_of(self, p: DVec3, l0: f64) -> Option<f64> {
        let depth = (self.0 - p).dot(self.1) / l0;
        ((self.0 - p - depth * l0 * self.1).length() < IN_LINE * l0).then_some(depth)
    }
}

/// A particle of a wall layer that stands too close behind a row, and how deep.
struct Hidden {
    wall: usize,
    row: Row,
    depth: f64,
}

impl Hidden {
    /// Where what stands at `p` belongs: as far down as brings the hidden layer a spacing behind the row.
    fn down(&self, p: DVec3, l0: f64) -> DVec3 {
        p - (1.0 - self.depth) * l0 * self.row.1
    }
}

impl Fixed {
    /// Moves what of wall layers stands right behind `rows` of another wall, nearer than that wall's next layer would, to where that layer belongs, as
    /// dummies, and what lies behind it by as much: water and rows that have both layers in their density are pushed off. Returns how many
    /// particles of wall layers.
    pub fn make_room(&mut self, rows: &[Row], l0: f64) -> usize {
        let hidden = self.behind(rows, l0);
        if hidden.is_empty() {
            return 0;
        }
        let mut near = PointCells::new(FELT * l0);
        hidden.iter().for_each(|of| near.add(of.row.0));
        let reach = (FELT + IN_LINE) * l0;
        for q in &mut self.dummy {
            let layer = |of: &&Hidden| {
                of.row.depth_of(*q, l0).is_some_and(|depth| depth > of.depth + 0.5 && depth < FELT)
            };
            if let Some(of) = near.within(*q, reach).map(|(n, _)| &hidden[n]).find(layer) {
                *q = of.down(*q, l0);
            }
        }
        self.dummy.extend(hidden.iter().map(|of| of.down(self.wall[of.wall], l0)));
        leave_out(&mut self.wall, &hidden);
        leave_out(&mut self.normal, &hidden);
        leave_out(&mut self.shape_of, &hidden);
        hidden.len()
    }

    /// Particles of wall layers that face as one of the `rows` right before them does, in their order.
    fn behind(&self, rows: &[Row], l0: f64) -> Vec<Hidden> {
        let margin = 1.2 * l0;
        let ends = |(low, high): (DVec3, DVec3), row: &Row| (low.min(row.0), high.max(row.0));
        let (low, high) = rows.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), ends);
        let mut near = PointCells::new(l0);
        rows.iter().for_each(|row| near.add(row.0));
        let hidden = |wall: usize| {
            let p = self.wall[wall];
            if p.cmplt(low - margin).any() || p.cmpgt(high + margin).any() {
                return None;
            }
            let before = |row: Row| {
                let depth = row.depth_of(p, l0).filter(|depth| CLOSE.contains(depth))?;
                (self.normal[wall].dot(row.1) > 0.7).then_some(Hidden { wall, row, depth })
            };
            near.within(p, margin).find_map(|(n, _)| before(rows[n]))
        };
        (0..self.wall.len()).filter_map(hidden).collect()
    }
}

/// Leaves out of what there is one of for each particle of wall layers that of the `hidden`.
fn leave_out<T>(of: &mut Vec<T>, hidden: &[Hidden]) {
    let (mut next, mut k) = (hidden.iter().map(|of| of.wall).peekable(), 0..);
    of.retain(|_| k.next().is_none_or(|k| next.next_if_eq(&k).is_none()));
}
