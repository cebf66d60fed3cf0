//! Broad phase: which bounding boxes meet, and which fixed particles lie near a point.

use crate::periodic::Periodic;
use crate::scene::Scene;
use glam::{DVec3, IVec3};
use std::collections::HashMap;

/// An axis-aligned box, lower and upper corner [m].
pub(crate) type Bounds = (DVec3, DVec3);

/// A box that spans more cells than this is compared with all others instead of entered in the grid.
const MANY_CELLS: i32 = 64;
/// Up to this many boxes, comparing all of them is cheaper than a grid.
const FEW: usize = 24;

fn meet(a: &Bounds, b: &Bounds) -> bool {
    a.0.cmple(b.1).all() && b.0.cmple(a.1).all()
}

/// Pairs (i < j) of boxes that meet, sorted. Linear in the number of boxes as long as most of them are
/// of similar size: a uniform grid of twice the mean edge; the few that are much larger are compared
/// with all.
pub(crate) fn meeting(boxes: &[Bounds]) -> Vec<(usize, usize)> {
    let mut pairs = vec![];
    if boxes.len() <= FEW {
        for j in 1..boxes.len() {
            pairs.extend((0..j).filter(|&i| meet(&boxes[i], &boxes[j])).map(|i| (i, j)));
        }
        pairs.sort_unstable();
        return pairs;
    }
    let edge: f64 = boxes.iter().map(|b| (b.1 - b.0).max_element()).sum::<f64>() / boxes.len() as f64;
    let cell = |x: DVec3| (x / (2.0 * edge)).floor().as_ivec3();
    let mut entries: Vec<(IVec3, usize)> = vec![];
    let mut large = vec![];
    for (k, b) in boxes.iter().enumerate() {
        let (low, high) = (cell(b.0), cell(b.1));
        let span = high.saturating_sub(low).saturating_add(IVec3::ONE);
        if span.x.saturating_mul(span.y).saturating_mul(span.z) > MANY_CELLS {
            large.push(k);
            continue;
        }
        for x in low.x..=high.x {
            for y in low.y..=high.y {
                entries.extend((low.z..=high.z).map(|z| (IVec3::new(x, y, z), k)));
            }
        }
    }
    entries.sort_unstable_by_key(|(c, k)| (c.x, c.y, c.z, *k));
    for group in entries.chunk_by(|a, b| a.0 == b.0) {
        for (n, &(here, j)) in group.iter().enumerate() {
            for &(_, i) in &group[..n] {
                // two boxes may share several cells; the first one they share reports them
                if meet(&boxes[i], &boxes[j]) && cell(boxes[i].0.max(boxes[j].0)) == here {
                    pairs.push((i, j));
                }
            }
        }
    }
    let mut is_large = vec![false; boxes.len()];
    large.iter().for_each(|&l| is_large[l] = true);
    for &l in &large {
        for k in 0..boxes.len() {
            // of two that are both large the first one reports them
            if k != l && !(k < l && is_large[k]) && meet(&boxes[l], &boxes[k]) {
                pairs.push((l.min(k), l.max(k)));
            }
        }
    }
    pairs.sort_unstable();
    pairs
}

/// As [`meeting`], with the images of boxes over periodic sides: of each pair also the whole lengths by which the second box
/// is moved to the image that meets the first. Two boxes may meet at both ends.
pub(crate) fn meeting_images(boxes: &[Bounds], periodic: &Periodic) -> Vec<(usize, usize, IVec3)> {
    if !periodic.is_any() {
        return meeting(boxes).into_iter().map(|(i, j)| (i, j, IVec3::ZERO)).collect();
    }
    // Where two meet, one of the places at which they do lies between the sides.
    let images = |(k, b): (usize, &Bounds)| {
        let of = |turns| ((b.0 + periodic.way(turns), b.1 + periodic.way(turns)), k, turns);
        periodic.turns(b.0, b.1).map(of).collect::<Vec<_>>()
    };
    let all: Vec<(Bounds, usize, IVec3)> = boxes.iter().enumerate().flat_map(images).collect();
    let boxes: Vec<Bounds> = all.iter().map(|image| image.0).collect();
    let between = |(i, j): (usize, usize)| {
        let ((_, i, own), (_, j, their)) = (all[i], all[j]);
        if i < j { (i, j, their - own) } else { (j, i, own - their) }
    };
    let mut pairs: Vec<(usize, usize, IVec3)> = meeting(&boxes).into_iter().map(between).collect();
    pairs.retain(|(i, j, _)| i != j);
    pairs.sort_unstable_by_key(|(i, j, turns)| (*i, *j, turns.to_array()));
    pairs.dedup();
    pairs
}

/// Places of the particles of fixed walls [m], with their images up to half a length beyond periodic sides, and which of the walls' particles
/// each is.
pub(crate) fn fixed_walls(scene: &Scene) -> (Vec<DVec3>, Vec<usize>) {
    let own = scene.position[scene.groups.static_wall_range()].iter().enumerate();
    own.flat_map(|(k, &x)| images_of(scene, x).map(move |x| (x, k))).unzip()
}

/// The place `x` [m] and its images up to half a length beyond periodic sides.
pub(crate) fn images_of(scene: &Scene, x: DVec3) -> impl Iterator<Item = DVec3> {
    let periodic = &scene.periodic;
    periodic.images(periodic.wrap(x), 0.5 * periodic.length().max_element())
}

/// Fixed points in cells.
#[derive(Clone, Debug)]
pub(crate) struct PointGrid {
    cell: f64,
    points: Vec<DVec3>,
    cells: HashMap<IVec3, Vec<u32>>,
    bounds: Bounds,
}

impl Default for PointGrid {
    fn default() -> Self {
        Self::new(vec![], 1.0)
    }
}

impl PointGrid {
    /// The grid of `points` with cells of edge `cell` [m].
    pub fn new(points: Vec<DVec3>, cell: f64) -> Self {
        let mut cells: HashMap<IVec3, Vec<u32>> = HashMap::new();
        let mut bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (k, x) in points.iter().enumerate() {
            cells.entry((*x / cell).floor().as_ivec3()).or_default().push(k as u32);
            bounds = (bounds.0.min(*x), bounds.1.max(*x));
        }
        Self { cell, points, cells, bounds }
    }

    /// Position of point `k` [m].
    pub fn point(&self, k: u32) -> DVec3 {
        self.points[k as usize]
    }

    /// Whether any point may lie in `bounds`.
    pub fn meets(&self, bounds: &Bounds) -> bool {
        meet(&self.bounds, bounds)
    }

    /// Calls `visit` with every point within `radius` [m] of `x`, in a fixed order.
    pub fn near(&self, x: DVec3, radius: f64, visit: impl FnMut(u32)) {
        self.around(x, radius).for_each(visit);
    }

    /// Whether a point lies within `radius` [m] of `x`.
    pub fn is_near(&self, x: DVec3, radius: f64) -> bool {
        self.around(x, radius).next().is_some()
    }

    fn around(&self, x: DVec3, radius: f64) -> impl Iterator<Item = u32> {
        let cell = |x: DVec3| (x / self.cell).floor().as_ivec3();
        let low = cell((x - radius).max(self.bounds.0));
        let high = if self.meets(&(x - radius, x + radius)) {
            cell((x + radius).min(self.bounds.1))
        } else {
            low - 1
        };
        let cells = (low.x..=high.x).flat_map(move |i| {
            (low.y..=high.y).flat_map(move |j| (low.z..=high.z).map(move |k| IVec3::new(i, j, k)))
        });
        let points = cells.flat_map(|cell| self.cells.get(&cell).into_iter().flatten().copied());
        points.filter(move |&n| self.points[n as usize].distance_squared(x) < radius * radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_finds_the_pairs_that_comparing_all_finds() {
        let mut state = 7_u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut boxes: Vec<Bounds> = (0..400)
            .map(|_| {
                let x = DVec3::new(random(), random(), random()) * 3.0;
                (x, x + DVec3::new(random(), random(), random()) * 0.4)
            })
            .collect();
        boxes.push((DVec3::splat(-9.0), DVec3::splat(9.0)));
        boxes.push((DVec3::splat(0.5), DVec3::splat(9.0)));
        let mut all = vec![];
        for j in 0..boxes.len() {
            all.extend((0..j).filter(|&i| meet(&boxes[i], &boxes[j])).map(|i| (i, j)));
        }
        all.sort_unstable();
        assert!(all.len() > 500, "{}", all.len());
        assert_eq!(meeting(&boxes), all);
    }

    #[test]
    fn pairs_over_a_seam_are_those_of_all_images() {
        let periodic = Periodic::new([true, true, false], DVec3::ZERO, DVec3::new(2.0, 1.5, 1.0));
        let place = |k: usize, n: f64| (k as f64 * n).fract();
        let boxes: Vec<Bounds> = (0..150)
            .map(|k| {
                let x = DVec3::new(2.0 * place(k, 0.618), 1.5 * place(k, 0.755), place(k, 0.57));
                let half = 0.05 + 0.2 * DVec3::new(place(k, 0.31), place(k, 0.27), place(k, 0.43));
                (x - half, x + half)
            })
            .collect();
        let mut all = vec![];
        for j in 0..boxes.len() {
            for i in 0..j {
                for turns in (-1..=1).flat_map(|x| (-1..=1).map(move |y| IVec3::new(x, y, 0))) {
                    let way = periodic.way(turns);
                    if meet(&boxes[i], &(boxes[j].0 + way, boxes[j].1 + way)) {
                        all.push((i, j, turns));
                    }
                }
            }
        }
        all.sort_unstable_by_key(|(i, j, turns)| (*i, *j, turns.to_array()));
        let over = all.iter().filter(|p| p.2 != IVec3::ZERO).count();
        assert!(over > 50, "{over}");
        assert_eq!(meeting_images(&boxes, &periodic), all);
    }

    #[test]
    fn the_point_grid_finds_all_points_within_a_radius() {
        let points: Vec<DVec3> = (0..1000)
            .map(|k| DVec3::new((k % 10) as f64, (k / 10 % 10) as f64, (k / 100) as f64) * 0.1 - 0.45)
            .collect();
        let grid = PointGrid::new(points.clone(), 0.23);
        let x = DVec3::new(0.07, -0.11, 0.02);
        let mut found = vec![];
        grid.near(x, 0.31, |k| found.push(k));
        found.sort_unstable();
        let all: Vec<u32> = (0..1000).filter(|&k| points[k as usize].distance(x) < 0.31).collect();
        assert!(all.len() > 50);
        assert_eq!(found, all);
    }
}
