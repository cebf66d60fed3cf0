//! Slots of solids that no force moves, where forces on them are told: a pipe on the bed, a drum gate on its sill. Their gauges would miss
//! what stands in the gap, and the bed's would, too. What flat faces stand on has no water between (a pillar, a gate that is
//! closed); where a surface bends away from what it touches the gap is open.

use super::layer::Layer;
use super::{Faced, Found, Opposite, Push, Slots, Voids, enclosed};
use crate::body::{Pose, Wrench};
use crate::cover::driven::Covered;
use crate::error::Result;
use crate::kernels::body_force::RowPressure;
use crate::params::Params;
use crate::shape::Bending;
use glam::DVec3;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// The slots of solids that no force moves.
pub struct Held {
    found: Vec<Found>,
    /// By solid, the areas of its rows that water may press on from a slot, in its frame [m2].
    area: HashMap<usize, Vec<DVec3>>,
    /// By solid, which faces of its rows, or those that look at them, bend away from the other, so that the gap is open.
    bends: HashMap<usize, Bending>,
}

/// What they do beside the pressures of the rows in them.
#[derive(Default)]
pub struct HeldForces {
    /// Solids, and what is to be added to their sums of rows [N], [N m].
    pub loads: Vec<(usize, Wrench)>,
    /// What the water in them presses on what stands opposite.
    pub pushes: Vec<Push>,
}

impl Held {
    /// Solids and rows of theirs that lie in slots.
    pub(super) fn pressed(&self) -> HashSet<(usize, usize)> {
        self.found.iter().flat_map(|f| f.slot.inside.iter().map(|row| (f.slot.solid, row.0))).collect()
    }

    /// How much of each row lies in a slot [-].
    fn shares(&self) -> HashMap<(usize, usize), f64> {
        let of = |f: &Found| {
            let solid = f.slot.solid;
            f.slot.inside.iter().map(|&(n, share)| ((solid, n), share)).collect::<Vec<_>>()
        };
        self.found.iter().flat_map(of).collect()
    }
}

impl Slots {
    /// The slots of solids that no force moves with the solids at `poses`, of which other solids cover what `covered` says.
    pub fn held(&self, poses: &[Pose], covered: &[Covered]) -> Held {
        let may_meet = |a: &Layer, b: &Layer| a.holds && (b.holds || b.free) || a.free && b.holds;
        let near =
            if self.layers.iter().any(|layer| layer.holds) { self.others(poses, may_meet) } else { vec![] };
        let (bodies, others): (Vec<Vec<_>>, Vec<Vec<_>>) =
            near.into_iter().map(|near| near.into_iter().partition(|&(k, _)| self.layers[k].free)).unzip();
        let (mut area, mut bends) = (HashMap::new(), HashMap::new());
        let mut found = vec![];
        for (k, layer) in self.layers.iter().enumerate().take(others.len()).filter(|(_, layer)| layer.holds) {
            let at_walls = self.at_walls(layer, &poses[k], super::FACING.1 * self.spacing);
            if !at_walls && others[k].is_empty() {
                continue;
            }
            let is_still = layer.still && others[k].iter().all(|(other, _)| self.layers[*other].still);
            let look = || Arc::<[Faced]>::from(self.faced(k, at_walls, &others[k], poses));
            let faced = if is_still { layer.faced.get_or_init(look).clone() } else { look() };
            let to_frame = poses[k].orientation.inverse();
            let bent = Bending((0..faced.len()).map(|n| self.bent(k, n, &faced[n], poses)).collect());
            let mut open = layer.area.clone();
            // They come in the order of solids.
            let own = covered.partition_point(|c| c.solid < k)..covered.partition_point(|c| c.solid <= k);
            for c in &covered[own] {
                open[c.row] -= to_frame * if bent.at(c.row, c.face) { c.within } else { c.area };
            }
            // What is left of a face that stands on another by round-off is nothing.
            let is_open = |n: usize| open[n].length_squared() > 1e-4 * layer.area[n].length_squared();
            let shares: Vec<f64> =
                faced.iter().enumerate().map(|(n, row)| if is_open(n) { row.share } else { 0.0 }).collect();
            // What others cover knows of no water, and what stands before a free body is in the slot of that.
            let shut = |n: usize| {
                !is_open(n)
                    || !bodies[k].is_empty()
                        && self.row_faced((k, n), false, &bodies[k], poses, (super::FACING.1, 0.0)).share
                            > 0.0
            };
            let slots = layer.slots(k, &shares, shut).into_iter();
            found.extend(slots.map(|slot| Found { slot, faced: faced.clone(), lenders: vec![] }));
            area.insert(k, open);
            bends.insert(k, bent);
        }
        Held { found: enclosed::lend(found), area, bends }
    }

    /// Which faces of row `n` of layer `k`, which lies as `faced`, or of what looks at them bend.
    fn bent(&self, k: usize, n: usize, faced: &Faced, poses: &[Pose]) -> u8 {
        let layer = &self.layers[k];
        let looked_at = |way: DVec3, of: Option<Opposite>| match of {
            Some(Opposite::Solid(other, row)) => {
                let way = poses[other].orientation.inverse() * (poses[k].orientation * way);
                self.layers[other].bends_before(row, way)
            }
            _ => false,
        };
        let others = layer.own_faces(n).zip(0..).map(|(face, number)| {
            let way = face.area.normalize_or_zero();
            let of = if faced.has_faces() { faced.of_face(face.area) } else { faced.opposite };
            u8::from(looked_at(way, of)) << number
        });
        layer.bends.0[n] | others.sum::<u8>()
    }

    /// What of `covered` water in the slots `held` presses on is not covered: of faces that bend, or before which something does, all but what lies within others.
    pub fn uncover(&self, held: &Held, covered: &mut [Covered]) {
        let shares = held.shares();
        for c in covered {
            let bends = held.bends.get(&c.solid).is_some_and(|bends| bends.at(c.row, c.face));
            if let Some(share) = shares.get(&(c.solid, c.row)).filter(|_| bends) {
                c.area += *share * (c.within - c.area);
            }
        }
    }

    /// How often the pressures of rows are read for the slots `held`, and for what those and the slots of free bodies press on solids that no force
    /// moves, with the solids at `poses`.
    pub fn reads(&self, held: &Held, poses: &[Pose]) -> u64 {
        let pressed = held.pressed();
        let presses = |f: &Found, counts: &dyn Fn((usize, usize)) -> bool| {
            let on = |of: Opposite| match of {
                Opposite::Solid(k, row) => self.layers[k].is_pressed() && counts((k, row)),
                Opposite::Wall(_) => false,
            };
            f.slot.inside.iter().flat_map(|row| f.faced[row.0].all()).any(on)
        };
        let any = self.find(self.lying(poses), poses, &Voids::new()).iter().any(|f| presses(f, &|_| true))
            || held.found.iter().any(|f| presses(f, &|of| !pressed.contains(&of)));
        u64::from(!held.found.is_empty()) + u64::from(any)
    }

    /// Forces of the water in the slots `held`, beside those of rows. `read` tells what slots of particles have.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn held_forces(
        &self,
        held: &Held,
        poses: &[Pose],
        params: &Params,
        read: impl FnOnce(&[usize]) -> Result<Vec<RowPressure>>,
    ) -> Result<HeldForces> {
        let Held { found, area, .. } = held;
        let own = |f: &Found| {
            let first = self.layers[f.slot.solid].first;
            f.slot.inside.iter().map(move |row| first + row.0).collect::<Vec<_>>()
        };
        let inside: Vec<usize> = found.iter().flat_map(own).collect();
        let mut told = vec![];
        let at_rims = self.at_rims(found, |rims| {
            let mut all = read(&[&inside, rims].concat())?;
            let rims = all.split_off(inside.len());
            told = all;
            Ok(rims.iter().map(|row| row.pressure).collect())
        })?;
        let pressed = held.pressed();
        let (mut out, mut told) = (HeldForces::default(), told.into_iter());
        for (f, rim) in found.iter().zip(&at_rims) {
            let (k, pose) = (f.slot.solid, &poses[f.slot.solid]);
            let field = self.field_of(found, &at_rims, (f, rim), poses);
            let mut load = Wrench::default();
            let layer = &self.layers[k];
            let areas = layer.areas(&area[&k], f, pose);
            for ((&(n, share), into), row) in f.slot.inside.iter().zip(&areas).zip(&mut told) {
                let place = pose.orientation * layer.offset[n];
                let mut press = |pressure: f64, area: DVec3, at: DVec3| {
                    let force = -share * pressure * area;
                    load += Wrench { force, torque: at.cross(force) };
                };
                for (into, at) in layer.faces(n, *into, pose) {
                    let slot = field.as_ref().map_or(0.0, |field| self.before(field, k, pose, n, at));
                    press(slot - row.in_force(at - place, params), into, at);
                }
            }
            // What has slots of its own there has its part from them.
            let is_free = |of| !matches!(of, Opposite::Solid(other, row) if pressed.contains(&(other, row)));
            out.pushes.extend(self.pushes_of(f, &areas, field.as_ref(), pose, |_| 0.0, is_free));
            out.loads.push((k, load));
        }
        Ok(out)
    }
}
