//! Water that solids enclose: in a pit under a lid, in a bell, under an arch of blocks, in the V below a cylinder. To the pressure
//! equation it is a closed vessel, in which the pressure is what the least sag of a body and the last crowding of particles make it; but the
//! slots around it are full of water, too, through which it has the pressure of the water outside. What is left of the gap does not tell
//! how fast, so that it is taken to be there at once: rows of the rim that look into such a pocket are linked to it.

use super::{CELL, Found, Layer, Slot, Slots};
use crate::body::Pose;
use crate::body::slots::Seep;
use crate::contact::broad::PointGrid;
use glam::{DVec3, IVec3};
use std::collections::HashSet;
use std::sync::OnceLock;

/// Weight over n0 of the link to the pressure outside. A lid of 2.5 times the water's density that its contact lets sag by a thousandth of the
/// pit's depth keeps 30, 9 and 3 % too much below it with 1, 10 and 100; held, its pressure scatters by 2 and 16 % with 10 and 100.
const SEEP: f64 = 10.0;
/// Distance from particles of walls, over l0, that the way out of a pocket keeps: no way leads through a wall layer, and one through
/// gaps from 1.1 spacings on.
const BLOCKED: f64 = 0.8;
/// Step of that way over l0.
const STEP: f64 = 0.5;
/// From a row to the water before it, over l0.
const BEFORE: f64 = 1.35;
/// Distance over l0 from which on water is open.
const FAR: f64 = 100.0;
/// Places looked at before water counts as open: a pocket of 2,000 particles in space, of 4,000 in the plane.
const MOST: usize = 16_000;

/// What closes the water in: solids where they are, and slots between them.
pub(super) struct Closures<'a> {
    slots: &'a Slots,
    poses: &'a [Pose],
    found: &'a [Found],
    /// Places in slots.
    between: OnceLock<PointGrid>,
}

impl<'a> Closures<'a> {
    pub fn new(slots: &'a Slots, poses: &'a [Pose], found: &'a [Found]) -> Self {
        Self { slots, poses, found, between: OnceLock::new() }
    }

    /// What seeps through `slot` to the rows of its rim, whose pressures are `told`: nothing but to pockets.
    pub fn seeps(&self, slot: &Slot, told: &[(usize, f64)]) -> Vec<Seep> {
        let (layer, pose) = (&self.slots.layers[slot.solid], &self.poses[slot.solid]);
        let part = parts(layer, &slot.rim);
        if self.slots.closed || part.iter().all(|&p| p == part[0]) {
            return vec![];
        }
        let looks_out = |first: usize| {
            let rows = (0..part.len()).filter(|&at| part[at] == first).map(|at| slot.rim[at]);
            let before = self.before(slot, rows);
            before.iter().any(|&x| self.is_under_the_sky(x)) || self.is_open(&before)
        };
        let mut firsts = part.clone();
        firsts.sort_unstable();
        firsts.dedup();
        let open: Vec<usize> = firsts.into_iter().filter(|&first| looks_out(first)).collect();
        let is_open = |at: usize| open.binary_search(&part[at]).is_ok();
        let height = |at: usize| self.slots.weight.dot(pose.orientation * layer.offset[slot.rim[at]]);
        let wet = (0..part.len()).filter(|&at| is_open(at) && told[at].1 > 0.0);
        let (sum, count) = wet.fold((0.0, 0.0), |(sum, n), at| (sum + told[at].1 - height(at), n + 1.0));
        if count == 0.0 {
            return vec![];
        }
        let seep = |at| match is_open(at) {
            true => Seep::default(),
            false => Seep { link: SEEP, known: SEEP * (sum / count + height(at)).max(0.0) },
        };
        (0..part.len()).map(seep).collect()
    }

    /// Where the water before these `rows` of a rim is [m], and before those beside them: in the wedge above a slope there is no room for it
    /// before the first one.
    fn before(&self, slot: &Slot, rows: impl Iterator<Item = usize>) -> Vec<DVec3> {
        let (layer, pose) = (&self.slots.layers[slot.solid], &self.poses[slot.solid]);
        let out = |n: &usize| slot.inside.binary_search_by_key(n, |row| row.0).is_err();
        let beside = |n: usize| layer.adjacent[n].iter().map(|&m| m as usize).chain([n]).filter(out);
        let water = |n: usize| {
            let outward = layer.area[n].normalize_or_zero();
            pose.position + pose.orientation * (layer.offset[n] + BEFORE * self.slots.spacing * outward)
        };
        rows.flat_map(beside).map(water).filter(|&x| !self.is_blocked(x)).collect()
    }

    /// Whether nothing stands above `x` [m].
    fn is_under_the_sky(&self, mut x: DVec3) -> bool {
        let up = -self.slots.weight.normalize_or(-DVec3::Z);
        while self.is_within(x) {
            if self.is_blocked(x) {
                return false;
            }
            x += STEP * self.slots.spacing * up;
        }
        true
    }

    /// Whether a way leads from one of these places out of the domain, or farther than pockets are. Along x first, as
    /// far as there is room: in a long tank with a lid it is far soon.
    fn is_open(&self, starts: &[DVec3]) -> bool {
        let Some(&from) = starts.first() else { return false };
        let step = STEP * self.slots.spacing;
        let place = |cell: IVec3| from + step * cell.as_dvec3();
        let mut open: Vec<IVec3> = starts.iter().map(|&x| ((x - from) / step).round().as_ivec3()).collect();
        open.retain(|&cell| !self.is_blocked(place(cell)));
        let mut seen: HashSet<IVec3> = open.iter().copied().collect();
        let axes = if self.slots.flat { &[IVec3::Z, IVec3::X][..] } else { &[IVec3::Z, IVec3::Y, IVec3::X] };
        while let Some(cell) = open.pop() {
            let far = cell.as_dvec3().length() * STEP > FAR;
            if far || seen.len() > MOST || !self.is_within(place(cell)) {
                return true;
            }
            for next in axes.iter().flat_map(|&axis| [cell + axis, cell - axis]) {
                if !seen.contains(&next) && !self.is_blocked(place(next)) {
                    seen.insert(next);
                    open.push(next);
                }
            }
        }
        false
    }

    fn is_within(&self, x: DVec3) -> bool {
        let (low, high) = self.slots.domain;
        let flat = self.slots.flat;
        (0..3).all(|k| (flat && k == 1) || (x[k] >= low[k] && x[k] <= high[k]))
    }

    /// Whether a solid or a slot is at `x` [m].
    fn is_blocked(&self, x: DVec3) -> bool {
        let slots = self.slots;
        let near = BLOCKED * slots.spacing;
        let at_solid = |(layer, pose): (&Layer, &Pose)| {
            let way = slots.periodic.nearest(x - pose.position);
            way.length() < layer.radius + near && layer.grid.is_near(pose.orientation.inverse() * way, near)
        };
        slots.fixed.is_near(x, near)
            || slots.layers.iter().zip(self.poses).any(at_solid)
            || self.between.get_or_init(|| self.places_between()).is_near(x, near)
    }

    fn places_between(&self) -> PointGrid {
        let of = |f: &'a Found| {
            let (layer, pose) = (&self.slots.layers[f.slot.solid], &self.poses[f.slot.solid]);
            let place = move |&(n, _): &(usize, f64)| {
                pose.position + pose.orientation * (layer.offset[n] + layer.to_surface[n])
            };
            f.slot.inside.iter().map(place)
        };
        PointGrid::new(self.found.iter().flat_map(of).collect(), CELL * self.slots.spacing)
    }
}

/// Which part of a `rim` each of its rows is of, by its first one: rows that hang together are one part.
fn parts(layer: &Layer, rim: &[usize]) -> Vec<usize> {
    let mut part = vec![usize::MAX; rim.len()];
    for first in 0..rim.len() {
        if part[first] != usize::MAX {
            continue;
        }
        let mut open = vec![first];
        part[first] = first;
        while let Some(at) = open.pop() {
            let beside = layer.adjacent[rim[at]].iter();
            for other in beside.filter_map(|&m| rim.binary_search(&(m as usize)).ok()) {
                if part[other] == usize::MAX {
                    part[other] = first;
                    open.push(other);
                }
            }
        }
    }
    part
}
