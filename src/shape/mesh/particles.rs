//! Particles that fill a mesh.

use super::super::{Geometry, Particles, close};
use super::Mesh;
use glam::{DVec3, IVec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// Particles of the wall layer stand at least so far apart, over the spacing.
const APART: f64 = 0.6;

/// Points in cells.
pub(super) struct Cells {
    edge: f64,
    points: Vec<DVec3>,
    cells: HashMap<IVec3, Vec<usize>>,
}

impl Cells {
    pub fn new(edge: f64) -> Self {
        Self { edge, points: vec![], cells: HashMap::new() }
    }

    fn cell(&self, x: DVec3) -> IVec3 {
        (x / self.edge).floor().as_ivec3()
    }

    pub fn add(&mut self, x: DVec3) {
        self.cells.entry(self.cell(x)).or_default().push(self.points.len());
        self.points.push(x);
    }

    /// The nearest point within `reach` [m] of `x`.
    pub fn nearest(&self, x: DVec3, reach: f64) -> Option<usize> {
        let (low, high) = (self.cell(x - reach), self.cell(x + reach));
        let mut found: Option<(f64, usize)> = None;
        for cx in low.x..=high.x {
            for cy in low.y..=high.y {
                for cz in low.z..=high.z {
                    for &k in self.cells.get(&IVec3::new(cx, cy, cz)).into_iter().flatten() {
                        let d = self.points[k].distance(x);
                        if d <= reach && found.is_none_or(|(least, _)| d < least) {
                            found = Some((d, k));
                        }
                    }
                }
            }
        }
        found.map(|(_, k)| k)
    }
}

/// A lattice of about `spacing` [m] along the axes of the file in the box around `mesh`: what is less than a spacing deep goes into the wall layer,
/// moved along the normal to half of one; the rest lies below, hollow beyond `layers`.
pub(super) fn fill(mesh: &Mesh, spacing: f64, layers: i32) -> Particles {
    let (low, high) = mesh.along_file;
    let to_own = mesh.frame.inverse();
    let count = ((high - low) / spacing).round().max(DVec3::ONE);
    let step = (high - low) / count;
    let [nx, ny, nz] = count.to_array().map(|n| n as usize);
    let place = |k: usize| {
        let cell = DVec3::new((k % nx) as f64, (k / nx % ny) as f64, (k / nx / ny) as f64);
        to_own * (low + (cell + 0.5) * step)
    };
    let found: Vec<(DVec3, f64, DVec3)> = (0..nx * ny * nz)
        .into_par_iter()
        .filter_map(|k| {
            let inside = mesh.depth(place(k), super::super::ALL_FACES)?;
            Some((place(k), inside.depth, inside.outward))
        })
        .collect();
    // A lattice that fits has its layers at odd halves of its step.
    let border = step.max_element().max(spacing) * (1.0 + 1e-6);
    let deepest = (f64::from(layers) + 0.5) * spacing;
    let mut out = Particles::default();
    let mut shallow: Vec<_> = found.iter().filter(|f| f.1 <= border).collect();
    shallow.sort_by(|a, b| (a.1 - 0.5 * spacing).abs().total_cmp(&(b.1 - 0.5 * spacing).abs()));
    let mut wall = Cells::new(spacing);
    for &&(at, depth, outward) in &shallow {
        let moved = at + (depth - 0.5 * spacing) * outward;
        // Near an edge or in a thin place the way may lead nearer to another side.
        let sound = mesh.depth(moved, super::super::ALL_FACES);
        let (at, inside) = match sound {
            Some(inside) if (inside.depth - 0.5 * spacing).abs() < 0.1 * spacing => (moved, inside),
            _ => match mesh.depth(at, super::super::ALL_FACES) {
                Some(inside) => (at, inside),
                None => continue,
            },
        };
        if wall.nearest(at, APART * spacing).is_none() {
            wall.add(at);
            out.add(0, at, DVec3::ZERO, inside.depth * inside.outward);
        }
    }
    for &(at, depth, _) in found.iter().filter(|f| f.1 > border && f.1 < deepest) {
        if wall.nearest(at, APART * spacing).is_none() {
            out.add(1, at, DVec3::ZERO, depth * DVec3::Z);
        }
    }
    share(mesh, spacing, &wall, &mut out);
    out
}

/// Gives each small piece of the surface to the nearest particle of the wall layer.
fn share(mesh: &Mesh, spacing: f64, wall: &Cells, out: &mut Particles) {
    if wall.points.is_empty() {
        return;
    }
    for triangle in mesh.triangles.triangles() {
        let [a, b, c] = [triangle.a, triangle.b, triangle.c];
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let n = (longest / (0.3 * spacing)).ceil().max(1.0);
        let area = 0.5 * (b - a).cross(c - a) / (n * n);
        let point = |i: f64, j: f64| a + (b - a) * (i / n) + (c - a) * (j / n);
        for i in 0..n as i32 {
            for j in 0..n as i32 - i {
                let (i, j) = (f64::from(i), f64::from(j));
                let mut give = |at: DVec3| {
                    let mut reach = spacing;
                    let nearest = loop {
                        match wall.nearest(at, reach) {
                            Some(k) => break k,
                            None => reach *= 2.0,
                        }
                    };
                    out.area[nearest] += area;
                };
                give(point(i + 1.0 / 3.0, j + 1.0 / 3.0));
                if i + j + 1.0 < n {
                    give(point(i + 2.0 / 3.0, j + 2.0 / 3.0));
                }
            }
        }
    }
    close(out, mesh.volume());
}
