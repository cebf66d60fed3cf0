//! The wall layer of a solid: which of its rows hang together, and what of them looks into a slot.

use super::{CELL, Faced, Found, Slot};
use crate::body::Pose;
use crate::contact::broad::{Bounds, PointGrid};
use crate::scene::Solid;
use crate::shape::{ADJACENT, Bending, Edges, Face};
use glam::DVec3;
use std::sync::{Arc, OnceLock};

/// Rows of which no faces look alike more than this are of two sides of a plate, and do not go on from one to the other (cosine of the angle).
const TURNED: f64 = -0.5;

/// A solid's wall layer, in its frame.
pub(super) struct Layer {
    pub free: bool,
    /// Whether no force moves it and its slots are told.
    pub holds: bool,
    pub still: bool,
    /// Slot of its first row.
    pub first: usize,
    pub offset: Vec<DVec3>,
    pub area: Vec<DVec3>,
    pub to_surface: Vec<DVec3>,
    pub edges: Edges,
    pub radius: f64,
    pub grid: PointGrid,
    pub adjacent: Vec<Vec<u32>>,
    /// Of one that slots press on, which faces of its rows lie where its surface bends.
    pub bends: Bending,
    /// Of one that never moves, how its rows lie before what never moves either.
    pub faced: OnceLock<Arc<[Faced]>>,
}

impl Layer {
    pub fn new(solid: &Solid, l0: f64, holds: bool) -> Self {
        let free = solid.is_free();
        let offset = solid.wall_offset.clone();
        let grid = PointGrid::new(offset.clone(), CELL * l0);
        let near = |(k, &x): (usize, &DVec3)| {
            let mut found = vec![];
            grid.near(x, ADJACENT * l0, |n| found.push(n));
            found.retain(|&n| n as usize != k);
            found
        };
        let adjacent = if free || holds { offset.iter().enumerate().map(near).collect() } else { Vec::new() };
        Self {
            free,
            holds,
            still: solid.is_still(),
            bends: if free || solid.is_still() && !holds { Bending::default() } else { solid.bending(l0) },
            faced: OnceLock::new(),
            first: solid.wall_slots.start,
            radius: offset.iter().map(|x| x.length()).fold(0.0, f64::max),
            area: solid.wall_area.clone(),
            to_surface: solid.wall_to_surface.clone(),
            edges: solid.wall_edges.clone(),
            offset,
            grid,
            adjacent,
        }
    }

    /// Slots whose rows hang together, by how much of each row lies in one: what lies in them, and their rims, which may
    /// be empty. A row that is `shut`, in another's slot, is no rim where others are.
    pub fn slots(&self, solid: usize, shares: &[f64], shut: impl Fn(usize) -> bool) -> Vec<Slot> {
        let mut seen: Vec<bool> = shares.iter().map(|&share| share == 0.0).collect();
        let mut out = vec![];
        for first in 0..shares.len() {
            if std::mem::replace(&mut seen[first], true) {
                continue;
            }
            let (mut rows, mut at) = (vec![first], 0);
            while at < rows.len() {
                for &m in &self.adjacent[rows[at]] {
                    if !std::mem::replace(&mut seen[m as usize], true) {
                        rows.push(m as usize);
                    }
                }
                at += 1;
            }
            rows.sort_unstable();
            let beside = rows.iter().flat_map(|&n| &self.adjacent[n]).map(|&m| m as usize);
            let mut rim: Vec<usize> = beside.filter(|&m| shares[m] == 0.0).collect();
            rim.sort_unstable();
            rim.dedup();
            // Those on the other side of a plate, too, are none where others are.
            let goes_on = |&m: &usize| {
                let beside = self.adjacent[m].iter().map(|&n| n as usize);
                beside.filter(|n| rows.binary_search(n).is_ok()).any(|n| self.go_on(n, m))
            };
            let is_open = |&m: &usize| !shut(m);
            for is_rim in [&is_open as &dyn Fn(&usize) -> bool, &goes_on] {
                if rim.iter().any(is_rim) {
                    rim.retain(is_rim);
                }
            }
            let at_rim =
                |n: &usize| self.adjacent[*n].iter().any(|&m| rim.binary_search(&(m as usize)).is_ok());
            let mouth: Vec<usize> = rows.iter().copied().filter(at_rim).collect();
            let edge = rim.iter().map(|&m| self.edge(m, &mouth)).collect();
            let inside = rows.into_iter().map(|n| (n, shares[n])).collect();
            out.push(Slot { solid, rim, edge, mouth, inside });
        }
        out
    }

    /// The faces of row `n`, numbered as those of its solid are: without those that others have taken away.
    pub fn own_faces(&self, n: usize) -> impl Iterator<Item = Face> + use<> {
        self.edges.faces(n, self.area[n], self.to_surface[n])
    }

    /// Whether rows `a` and `b`, which are near each other, lie beside each other on the surface.
    pub fn go_on(&self, a: usize, b: usize) -> bool {
        let ways = |k: usize| self.own_faces(k).map(|face| face.area.normalize_or_zero());
        ways(a).any(|a| ways(b).any(|b| a.dot(b) > TURNED))
    }

    /// Where the slot ends before row `m` of its rim, on the surface of the rows at its `mouth`.
    fn edge(&self, m: usize, mouth: &[usize]) -> DVec3 {
        let beside = self.adjacent[m].iter().map(|&n| n as usize).filter(|n| mouth.binary_search(n).is_ok());
        let (sum, count) = beside.fold((DVec3::ZERO, 0.0), |(sum, count), n| {
            (sum + self.offset[n] + self.to_surface[n], count + 1.0)
        });
        sum / count
    }

    /// Of each row in the slot, the part of its `area` (solid's frame) that looks into it, world axes [m2]: all of it, or of a row with several faces those that something lies
    /// before.
    pub fn areas(&self, area: &[DVec3], Found { slot, faced, .. }: &Found, pose: &Pose) -> Vec<DVec3> {
        let inwards = |&(n, _): &(usize, f64)| {
            if self.edges.of(n).is_empty() {
                return area[n];
            }
            let faces = self.edges.faces(n, area[n], self.to_surface[n]).map(|face| face.area);
            faces.filter(|&face| faced[n].of_face(face).is_some()).sum()
        };
        slot.inside.iter().map(inwards).map(|area| pose.orientation * area).collect()
    }

    /// The faces of row `n` that its `area` sums up, and their middles from the place of the solid, which is at `pose`, world axes [m2], [m].
    pub fn faces(&self, n: usize, area: DVec3, pose: &Pose) -> impl Iterator<Item = (DVec3, DVec3)> + use<> {
        let (turn, offset) = (pose.orientation, self.offset[n]);
        let faces = self.edges.faces(n, turn.inverse() * area, self.to_surface[n]);
        faces.map(move |face| (turn * face.area, turn * (offset + face.way)))
    }

    /// How far a face of row `n` looks along `way` at least, of length 1 (cosine); both in the solid's frame.
    pub fn looks(&self, n: usize, way: DVec3) -> f64 {
        let faces = self.edges.of(n).iter().map(|face| face.area.normalize_or_zero().dot(way));
        faces.reduce(f64::min).unwrap_or_else(|| self.area[n].normalize_or_zero().dot(way))
    }

    /// Whether what slots press on it is asked for: not on a free body, which has slots of its own, nor on what stands still and is not told.
    pub fn is_pressed(&self) -> bool {
        !self.free && (self.holds || !self.still)
    }

    /// Whether of row `n` that face bends which looks back most at what looks along `way`, in the solid's frame.
    pub fn bends_before(&self, n: usize, way: DVec3) -> bool {
        let looks = |face: &Face| face.area.normalize_or_zero().dot(way);
        let back = self
            .own_faces(n)
            .enumerate()
            .min_by(|a, b| looks(&a.1).total_cmp(&looks(&b.1)))
            .map_or(0, |face| face.0);
        self.bends.at(n, back)
    }

    pub fn bounds(&self, pose: &Pose, margin: f64) -> Bounds {
        let reach = DVec3::splat(self.radius + margin);
        (pose.position - reach, pose.position + reach)
    }
}
