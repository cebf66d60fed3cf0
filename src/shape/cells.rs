//! Points by the cells of a lattice that they lie in.

use glam::{DVec3, IVec3};
use std::collections::HashMap;

/// Points in cells.
pub struct PointCells {
    edge: f64,
    points: Vec<DVec3>,
    cells: HashMap<IVec3, Vec<usize>>,
}

impl PointCells {
    pub fn new(edge: f64) -> Self {
        Self { edge, points: vec![], cells: HashMap::new() }
    }

    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    fn cell(&self, x: DVec3) -> IVec3 {
        (x / self.edge).floor().as_ivec3()
    }

    pub fn add(&mut self, x: DVec3) {
        self.cells.entry(self.cell(x)).or_default().push(self.points.len());
        self.points.push(x);
    }

    /// Every point within `reach` [m] of `x`, and how far it is [m].
    pub fn within(&self, x: DVec3, reach: f64) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (low, high) = (self.cell(x - reach), self.cell(x + reach));
        let columns = (low.x..=high.x).flat_map(move |cx| (low.y..=high.y).map(move |cy| (cx, cy)));
        let around = columns.flat_map(move |(cx, cy)| (low.z..=high.z).map(move |cz| IVec3::new(cx, cy, cz)));
        around
            .flat_map(|cell| self.cells.get(&cell).into_iter().flatten())
            .map(move |&k| (k, self.points[k].distance(x)))
            .filter(move |&(_, d)| d <= reach)
    }

    /// Every point within the cells' edge of `x`.
    pub fn numbers(&self, x: DVec3) -> Vec<usize> {
        self.within(x, self.edge).map(|(k, _)| k).collect()
    }

    /// Whether a point lies within `reach` [m] of `x`.
    pub fn is_near(&self, x: DVec3, reach: f64) -> bool {
        self.within(x, reach).next().is_some()
    }

    /// The nearest point within `reach` [m] of `x`.
    pub fn nearest(&self, x: DVec3, reach: f64) -> Option<usize> {
        let near = self.within(x, reach);
        near.reduce(|found, here| if here.1 < found.1 { here } else { found }).map(|(k, _)| k)
    }
}
