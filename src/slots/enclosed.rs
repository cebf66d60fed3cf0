//! Slots without a rim: of a block in a row of blocks under a slab, of one in a pile. The water in them is that of the
//! slots of other bodies which they face, and of those that these face. What it presses is known from the pressures of
//! the last step: the enclosed body has no row that the equation could couple it by.

use super::pockets::Closures;
use super::{CELL, Faced, Field, Found, Opposite, Pressing, Slot, Slots, Voids};
use crate::body::slots::SlotRow;
use crate::body::{Pose, Wrench};
use crate::contact::broad::PointGrid;
use crate::error::Result;
use crate::kernels::coupling::row;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};

/// How far the water that stands beside a row is from it at most, over l0.
const BESIDE: f64 = 1.5;

/// What water in slots does to free bodies.
#[derive(Clone, Debug, Default)]
pub struct Pressed {
    /// Rows at slots or in them, in the order of solids and rows.
    pub rows: Vec<SlotRow>,
    /// Solids that others enclose, and what the water between presses on each [N], [N m].
    pub loads: Vec<(usize, Wrench)>,
    /// What slots do as bodies come nearer or go, in the order of solids.
    pub pressings: Vec<Pressing>,
    /// Rows that face a room without water.
    pub voids: Voids,
}

/// Finds for each slot without a rim those that lend it theirs. What has neither is no slot, nor is a mouth alone
/// that lends nothing, unless it has rows of several faces: what of these looks out is told.
pub(super) fn lend(mut found: Vec<Found>) -> Vec<Found> {
    if found.iter().any(|f| f.slot.rim.is_empty()) {
        let beside = beside(&found);
        for k in 0..found.len() {
            if found[k].slot.rim.is_empty() {
                found[k].lenders = lenders(&found, &beside, k);
            }
        }
    }
    let lending: BTreeSet<usize> = found.iter().flat_map(|f| f.lenders.iter().copied()).collect();
    let is_slot = |(k, f): &(usize, &Found)| match f.slot.rim.is_empty() {
        true => !f.lenders.is_empty(),
        false => {
            let mut rows = f.slot.inside.iter().map(|row| &f.faced[row.0]);
            f.slot.inside.len() > f.slot.mouth.len() || lending.contains(k) || rows.any(Faced::has_faces)
        }
    };
    let kept: Vec<usize> = found.iter().enumerate().filter(is_slot).map(|(k, _)| k).collect();
    let place = |k: usize| kept.partition_point(|&other| other < k);
    for f in &mut found {
        f.lenders.iter_mut().for_each(|k| *k = place(*k));
    }
    let mut at = 0..;
    found.retain(|_| at.next().is_some_and(|k| kept.binary_search(&k).is_ok()));
    found
}

/// Which slots face each other.
fn beside(found: &[Found]) -> Vec<BTreeSet<usize>> {
    let rows = |f: &Found| f.slot.inside.iter().map(|row| row.0).collect();
    let all: Vec<Vec<usize>> = found.iter().map(rows).collect();
    let of = |(k, (f, rows)): (usize, (&Found, &Vec<usize>))| {
        rows.iter().map(|&n| ((f.slot.solid, n), k)).collect::<Vec<_>>()
    };
    let slot_of: HashMap<(usize, usize), usize> = found.iter().zip(&all).enumerate().flat_map(of).collect();
    let mut beside = vec![BTreeSet::new(); found.len()];
    for (k, (f, rows)) in found.iter().zip(&all).enumerate() {
        for &n in rows {
            let Faced { opposite: Some(Opposite::Solid(solid, row)), .. } = f.faced[n] else { continue };
            if let Some(&other) = slot_of.get(&(solid, row)) {
                beside[k].insert(other);
                beside[other].insert(k);
            }
        }
    }
    beside
}

/// Slots with a rim that slot `k` comes to through others without one.
fn lenders(found: &[Found], beside: &[BTreeSet<usize>], k: usize) -> Vec<usize> {
    let (mut seen, mut open, mut out) = (BTreeSet::from([k]), vec![k], BTreeSet::new());
    while let Some(k) = open.pop() {
        for &other in &beside[k] {
            if !found[other].slot.rim.is_empty() {
                out.insert(other);
            } else if seen.insert(other) {
                open.push(other);
            }
        }
    }
    out.into_iter().collect()
}

impl Slots {
    /// What slots do to free bodies with the solids at `poses`. `read` tells the pressures of the last step [Pa] in
    /// slots of particles; 0 where it is dry. At the `start` none is known, and the places of the water
    /// [m] tell which rims it is at.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn press(
        &self,
        poses: &[Pose],
        start: Option<&[DVec3]>,
        mut read: impl FnMut(&[usize]) -> Result<Vec<f64>>,
    ) -> Result<Pressed> {
        let (lying, others) = self.lying(poses);
        let voids = self.voids(&lying, &others, poses, &mut read)?;
        let found = self.find((lying, others), poses, &voids);
        let pressure = self.at_rims(&found, read)?;
        let solids = Closures::new(self, poses, &found);
        let of_slot = |(f, told): (&Found, &Vec<(usize, f64)>)| {
            let slot = &f.slot;
            if slot.rim.is_empty() {
                return Self::without_rim(f);
            }
            self.passed_on(f, &poses[slot.solid], told, &solids.seeps(slot, told))
        };
        let mut rows: Vec<SlotRow> = found.par_iter().zip(&pressure).flat_map_iter(of_slot).collect();
        rows.sort_by_key(|slot| (slot.solid, slot.row));
        // A row may lie at the rim of several, and in one.
        rows.dedup_by(|next, first| {
            let same = (next.solid, next.row) == (first.solid, first.row);
            if same {
                first.per_pascal += next.per_pascal;
                first.head += next.head;
                first.taken = first.taken.max(next.taken);
                first.seep.link += next.seep.link;
                first.seep.known += next.seep.known;
            }
            same
        });
        let load = |f: &Found| {
            let (k, pose) = (f.slot.solid, &poses[f.slot.solid]);
            let field = self.lent(&found, &pressure, f, poses)?;
            let mut load = Wrench::default();
            for &(n, share) in &f.slot.inside {
                for (area, at) in self.layers[k].faces(n, pose.orientation * self.layers[k].area[n], pose) {
                    load.add(share * self.before(&field, k, pose, n, at), &row(area, at));
                }
            }
            Some((k, load))
        };
        let loads = found.iter().filter(|f| f.slot.rim.is_empty()).filter_map(load).collect();
        let water = start
            .filter(|_| !found.is_empty())
            .map(|water| PointGrid::new(water.to_vec(), CELL * self.spacing));
        let pressing = |(f, told): (&Found, &Vec<(usize, f64)>)| {
            if f.slot.rim.is_empty() {
                return None;
            }
            let field = match &water {
                None => Some(self.field_of(&found, &pressure, (f, told), poses)?),
                Some(water) if self.rim_is_at(water, &f.slot, &poses[f.slot.solid]) => None,
                Some(_) => return None,
            };
            self.pressing(f, field.as_ref(), &poses[f.slot.solid])
        };
        let pressings = found.par_iter().zip(&pressure).filter_map(pressing).collect();
        Ok(Pressed { rows, loads, pressings, voids })
    }

    /// Whether `water` stands beside a row of the rim of `slot`, the body being at `pose`.
    fn rim_is_at(&self, water: &PointGrid, slot: &Slot, pose: &Pose) -> bool {
        let offset = &self.layers[slot.solid].offset;
        slot.rim
            .iter()
            .any(|&n| water.is_near(self.periodic.wrap(pose.point(offset[n])), BESIDE * self.spacing))
    }

    /// Rows of a slot without a rim: what presses on them is none of the equation's.
    fn without_rim(f: &Found) -> Vec<SlotRow> {
        let solid = f.slot.solid as u32;
        let inside = |&(n, taken)| SlotRow { solid, row: n as u32, taken, ..SlotRow::default() };
        f.slot.inside.iter().map(inside).collect()
    }

    /// Pressure of the `field` of a slot of solid `k` on the surface `at` a place before row `n`, from the centre of mass [m] [Pa].
    pub(super) fn before(&self, field: &Field, k: usize, pose: &Pose, n: usize, at: DVec3) -> f64 {
        self.in_slot(field, pose.orientation * self.layers[k].offset[n], at).max(field.lowest)
    }

    /// The pressure in the slot `f` without a rim, by the rims of those that lend it theirs; `None` where they are dry.
    pub(super) fn lent(
        &self,
        found: &[Found],
        pressure: &[Vec<(usize, f64)>],
        f: &Found,
        poses: &[Pose],
    ) -> Option<Field> {
        let center = poses[f.slot.solid].position;
        let of = |&k: &usize| {
            let (slot, pose) = (&found[k].slot, &poses[found[k].slot.solid]);
            let place = |n: usize| {
                self.periodic.nearest(pose.position - center)
                    + pose.orientation * self.layers[slot.solid].offset[n]
            };
            pressure[k].iter().map(move |&(n, p)| (place(n), p)).collect::<Vec<_>>()
        };
        let (places, told): (Vec<DVec3>, Vec<f64>) = f.lenders.iter().flat_map(of).unzip();
        let lowest = self.lowest(told.iter().copied());
        let passing = self.passing(told.into_iter().enumerate().collect(), |n| places[n]);
        Some(self.field(&poses[f.slot.solid], &passing, |n| places[n], lowest)).filter(|field| field.any_wet)
    }
}
