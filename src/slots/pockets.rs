//! Water that solids enclose: in a pit under a lid, in a bell, under an arch of blocks, in the V below a cylinder. To the pressure
//! equation it is a closed vessel, in which the pressure is what the least sag of a body and the last crowding of particles make it; but the
//! slots around it are full of water, too, through which it has the pressure of the water outside. What is left of the gap does not tell
//! how fast, so that it is taken to be there at once: rows of the rim that look into such a pocket are linked to it.

use super::{CELL, Found, Layer, Slot, Slots};
use crate::body::Pose;
use crate::body::slots::Seep;
use crate::contact::broad::PointGrid;
use glam::{DVec3, IVec3};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};
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
/// Places looked at from either end before water counts as joined: a pocket of 2,000 particles in space, of 4,000 in the plane.
const MOST: usize = 16_000;

/// How a search for a way between two places ended: they are joined, or one of them has no more room.
enum Meeting {
    Met,
    FirstEnds,
    SecondEnds,
}

/// A search from one place, nearest to its goal first.
struct Way {
    goal: IVec3,
    /// Cells round each periodic axis, 0 along others.
    round: IVec3,
    seen: HashSet<IVec3>,
    open: BinaryHeap<Reverse<(i32, [i32; 3])>>,
}

/// `cell` as it is counted where there are `round` cells along periodic axes.
fn wrapped(mut cell: IVec3, round: IVec3) -> IVec3 {
    (0..3).filter(|&k| round[k] > 0).for_each(|k| cell[k] = cell[k].rem_euclid(round[k]));
    cell
}

impl Way {
    fn see(&mut self, cell: IVec3) {
        if self.seen.insert(cell) {
            let (way, round) = ((cell - self.goal).abs(), self.round);
            let apart = IVec3::select(round.cmpgt(IVec3::ZERO), way.min(round - way), way);
            self.open.push(Reverse((apart.element_sum(), cell.to_array())));
        }
    }

    fn next(&mut self) -> Option<IVec3> {
        self.open.pop().map(|Reverse((_, cell))| IVec3::from_array(cell))
    }
}

/// What closes the water in: solids where they are, and slots between them.
pub(super) struct Closures<'a> {
    slots: &'a Slots,
    poses: &'a [Pose],
    found: &'a [Found],
    standing: OnceLock<Standing>,
}

/// What stands between the periodic sides, with its images.
struct Standing {
    /// Layers, and where they are [m].
    solids: Vec<(usize, DVec3)>,
    /// Places in slots.
    between: PointGrid,
}

impl<'a> Closures<'a> {
    pub fn new(slots: &'a Slots, poses: &'a [Pose], found: &'a [Found]) -> Self {
        Self { slots, poses, found, standing: OnceLock::new() }
    }

    /// What seeps through `slot` to the rows of its rim, whose pressures are `told`: nothing but to pockets.
    pub fn seeps(&self, slot: &Slot, told: &[(usize, f64)]) -> Vec<Seep> {
        if self.slots.closed {
            return vec![];
        }
        let (layer, pose) = (&self.slots.layers[slot.solid], &self.poses[slot.solid]);
        let part = parts(layer, &slot.rim);
        let firsts: Vec<usize> = (0..part.len()).filter(|&at| part[at] == at).collect();
        if firsts.len() == 1 {
            return vec![];
        }
        let water = |first: usize| {
            self.before(slot, (0..part.len()).filter(|&at| part[at] == first).map(|at| slot.rim[at]))
        };
        let places: Vec<Vec<DVec3>> = firsts.iter().map(|&first| water(first)).collect();
        let open = self.open(&places);
        if open.iter().all(|&open| open) {
            return vec![];
        }
        let open: Vec<usize> =
            firsts.into_iter().zip(open).filter(|part| part.1).map(|part| part.0).collect();
        let is_open = |at: usize| open.binary_search(&part[at]).is_ok();
        let height = |at: usize| self.slots.weight.dot(pose.orientation * layer.offset[slot.rim[at]]);
        let wet = (0..part.len()).filter(|&at| is_open(at) && told[at].1 != 0.0);
        let (sum, count) = wet.fold((0.0, 0.0), |(sum, n), at| (sum + told[at].1 - height(at), n + 1.0));
        if count == 0.0 {
            return vec![];
        }
        let lowest = self.slots.lowest(told.iter().map(|row| row.1));
        let seep = |at| match is_open(at) {
            true => Seep::default(),
            false => Seep { link: SEEP, known: SEEP * (sum / count + height(at)).max(lowest) },
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

    /// Whether nothing stands above `x` [m]. Where that goes round a periodic axis there is no sky.
    fn is_under_the_sky(&self, mut x: DVec3) -> bool {
        let up = self.slots.periodic.across(-self.slots.weight.normalize_or(-DVec3::Z));
        if up == DVec3::ZERO {
            return false;
        }
        while self.is_within(x) {
            if self.is_blocked(x) {
                return false;
            }
            x += STEP * self.slots.spacing * up;
        }
        true
    }

    /// Which of the parts of a rim, with water at `places` before each, look into open water: those under the sky, and those from which a way
    /// leads to one of them or on for longer than pockets have room.
    fn open(&self, places: &[Vec<DVec3>]) -> Vec<bool> {
        let sky: Vec<bool> = places.iter().map(|all| all.iter().any(|&x| self.is_under_the_sky(x))).collect();
        let mut open = vec![true; places.len()];
        let mut known = sky.iter().position(|&sky| sky).unwrap_or(0);
        for k in (0..places.len()).filter(|&k| !sky[k]) {
            if k == known {
                continue;
            }
            match self.meet(&places[known], &places[k]) {
                Meeting::Met => {}
                // Without a sky the larger room is the open one.
                Meeting::FirstEnds if !sky[known] => {
                    open[..k].fill(false);
                    known = k;
                }
                _ => open[k] = false,
            }
        }
        open
    }

    /// Looks for a way between the water at two places, from both ends at once and towards each other.
    fn meet(&self, first: &[DVec3], second: &[DVec3]) -> Meeting {
        let [Some(&from), Some(&to)] = [first.first(), second.first()] else {
            return if first.is_empty() { Meeting::FirstEnds } else { Meeting::SecondEnds };
        };
        let step = STEP * self.slots.spacing;
        let place = |cell: IVec3| from + step * cell.as_dvec3();
        // The length is a whole number of spacings.
        let round = (self.slots.periodic.length() / step).round().as_ivec3();
        let cell = |x: DVec3| wrapped(((x - from) / step).round().as_ivec3(), round);
        let axes = if self.slots.flat { &[IVec3::X, IVec3::Z][..] } else { &IVec3::AXES };
        let mut ways = [(first, cell(to)), (second, IVec3::ZERO)].map(|(starts, goal)| {
            let mut way = Way { goal, round, seen: HashSet::new(), open: BinaryHeap::new() };
            starts
                .iter()
                .map(|&x| cell(x))
                .filter(|&cell| !self.is_blocked(place(cell)))
                .for_each(|cell| way.see(cell));
            way
        });
        for _ in 0..MOST {
            for k in [0, 1] {
                let Some(here) = ways[k].next() else {
                    return if k == 0 { Meeting::FirstEnds } else { Meeting::SecondEnds };
                };
                if ways[1 - k].seen.contains(&here) {
                    return Meeting::Met;
                }
                for next in axes.iter().flat_map(|&axis| [here + axis, here - axis]) {
                    let next = wrapped(next, round);
                    let x = place(next);
                    if !ways[k].seen.contains(&next) && self.is_within(x) && !self.is_blocked(x) {
                        ways[k].see(next);
                    }
                }
            }
        }
        Meeting::Met
    }

    /// Whether `x` [m] is in the domain, which has no end along periodic axes.
    fn is_within(&self, x: DVec3) -> bool {
        let (low, high) = self.slots.domain;
        let endless = |k: usize| (self.slots.flat && k == 1) || self.slots.periodic.is_along(k);
        (0..3).all(|k| endless(k) || (x[k] >= low[k] && x[k] <= high[k]))
    }

    /// Whether a solid or a slot is at `x` [m].
    fn is_blocked(&self, x: DVec3) -> bool {
        let slots = self.slots;
        let (x, near) = (slots.periodic.wrap(x), BLOCKED * slots.spacing);
        let Standing { solids, between } = self.standing.get_or_init(|| self.standing(near));
        let at_solid = |&(k, position): &(usize, DVec3)| {
            let (layer, turn, way) = (&slots.layers[k], self.poses[k].orientation, x - position);
            way.length() < layer.radius + near && layer.grid.is_near(turn.inverse() * way, near)
        };
        slots.fixed.is_near(x, near) || solids.iter().any(at_solid) || between.is_near(x, near)
    }

    /// What stands within `near` [m] of what lies between the periodic sides.
    fn standing(&self, near: f64) -> Standing {
        let periodic = self.slots.periodic;
        let images = |(k, (layer, pose)): (usize, (&Layer, &Pose))| {
            let (low, high) = layer.bounds(pose, near);
            let position = pose.position;
            periodic.turns(low, high).map(move |turns| (k, position + periodic.way(turns)))
        };
        let of = |f: &'a Found| {
            let (layer, pose) = (&self.slots.layers[f.slot.solid], &self.poses[f.slot.solid]);
            let place = move |&(n, _): &(usize, f64)| {
                pose.position + pose.orientation * (layer.offset[n] + layer.to_surface[n])
            };
            f.slot.inside.iter().map(place)
        };
        let places = self.found.iter().flat_map(of);
        let places = places.flat_map(|x| periodic.images(periodic.wrap(x), near)).collect();
        Standing {
            solids: self.slots.layers.iter().zip(self.poses).enumerate().flat_map(images).collect(),
            between: PointGrid::new(places, CELL * self.slots.spacing),
        }
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
