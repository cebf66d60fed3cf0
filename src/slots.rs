//! Slots between a free body and another solid, too narrow for a particle of water: a body on the floor, against a wall, on
//! another body. Rows of the wall layer in one meet no water, or few particles that have no room, and would press nothing on the body or anything,
//! although water stands in any such slot. It is taken to press there as it does at the slot's rim, the rows beside it: linear
//! between what it is there, with the weight of the water between, and nothing where the rim is dry (the uplift under a dam, as
//! practice has it).
//!
//! The rows at the rim then carry what the slot passes on: with xi = (x - c) / l0, c the rim's middle, and
//! C = sum_r xi xi^T + 0.1 N over its N rows,
//!
//! P_f = sum_r h_fr (P_r + rho g . (x_f - x_r)),  h_fr = 1/N + xi_f . C^-1 xi_r,
//!
//! xi_f of a row no farther out than those of the rim, along each axis of the body's frame. The slots below and above a stone that
//! leans on a wall are one, and its rim two rows between them: what these told of a slope, taken on to both ends, threw such a stone up.
//!
//! and a row of S in [`crate::kernels::coupling`] becomes S_r + sum_f h_fr S_f: as P does work on the body there, the
//! body's motion sucks water in at the rim, and the equation stays symmetric.
//!
//! A slot that stands up, between a float and a wall, has its upper rim in the air, where no water would come out: rows of the rim above the
//! level P / rho g of all that are under water are none of it, and where P_f is negative there is air. Which rows that are the last
//! step's pressures say. Slots that do not hang together have a field each.
//!
//! What a slot presses on the body it presses on what lies before it: walls, obstacles, driven solids (`slots/driven.rs`).
//!
//! A body that others enclose has slots without a rim (`slots/enclosed.rs`); water that solids and their slots enclose has the pressure
//! that comes through them (`slots/pockets.rs`). Solids that no force moves have slots where their forces are told (`slots/held.rs`).

mod driven;
mod enclosed;
mod held;
mod layer;
mod pockets;
mod pushes;

pub(crate) use driven::{AGAINST, BEFORE};
pub use enclosed::Pressed;
pub use held::{Held, HeldForces};
pub use pushes::{Opposite, Push};

use crate::body::slots::{Seep, SlotRow};
use crate::body::{Pose, Wrench};
use crate::contact::broad::{Bounds, PointGrid, fixed_walls, meeting_images};
use crate::cover::Tiles;
use crate::error::Result;
use crate::kernels::coupling::row;
use crate::params::Params;
use crate::periodic::Periodic;
use crate::scene::{Scene, Solid};
use glam::{DMat3, DVec3};
use layer::Layer;
use rayon::prelude::*;
use std::sync::Arc;

/// Distances between facing wall-layer particles, over l0, up to which a row lies wholly in a slot, and from which on not
/// at all: gaps of 0.9 and of 1.1 spacings. Particles of water come in between from 0.85 on; in narrower gaps they stay where they
/// are, and what lies behind them is no void.
const FACING: (f64, f64) = (1.9, 2.1);
/// Another solid's particle is faced by a row if it lies this near its outward direction (cosine of the angle).
const AHEAD: f64 = 0.5;
/// The same of a face of a row at an edge: half-way to the next face.
const BEFORE_FACE: f64 = 0.7;
/// What a face of such a row looks onto looks back at it, the cosine of their directions being no larger: beside the foot of a block on the floor the floor does not.
const BACK: f64 = -0.3;
/// Edge of the cells that points lie in, over l0: twice the reach, so that two an axis are looked into.
const CELL: f64 = 4.2;
/// Keeps the slope at bay along directions in which the rim has no extent.
const STIFFENING: f64 = 0.1;

/// A slot between a free body and other solids: rows of the body's layer.
struct Slot {
    solid: usize,
    /// Those beside it, in open water. A row at its mouth is none: what a particle that is caught there does would be taken for the
    /// pressure in all of it.
    rim: Vec<usize>,
    /// Where the slot ends before each of them, in the solid's frame [m].
    edge: Vec<DVec3>,
    /// Rows in it that lie beside those.
    mouth: Vec<usize>,
    /// Rows in it, and how much of each [-].
    inside: Vec<(usize, f64)>,
}

/// How a row lies before what is near it.
#[derive(Clone)]
struct Faced {
    /// How much of it lies in a slot [-].
    share: f64,
    /// What it faces nearest.
    opposite: Option<Opposite>,
    /// Outward directions of the faces of a row that has several, in its solid's frame, and what each faces.
    by_face: Vec<(DVec3, Option<Opposite>)>,
}

impl Faced {
    /// All that it faces.
    fn all(&self) -> impl Iterator<Item = Opposite> {
        self.opposite.into_iter().chain(self.by_face.iter().filter_map(|face| face.1))
    }

    /// Whether it has several faces.
    fn has_faces(&self) -> bool {
        !self.by_face.is_empty()
    }

    /// What that of its several faces looks onto that looks as `area` does, in the solid's frame.
    fn of_face(&self, area: DVec3) -> Option<Opposite> {
        let alike = self.by_face.iter().max_by(|a, b| a.0.dot(area).total_cmp(&b.0.dot(area)));
        alike.and_then(|face| face.1)
    }

    /// The same of any row.
    fn before(&self, area: DVec3) -> Option<Opposite> {
        self.of_face(area).or(self.opposite)
    }
}

/// A slot as it is found.
struct Found {
    slot: Slot,
    /// How the rows of its body lie.
    faced: Arc<[Faced]>,
    /// Of one without a rim, those of the slots found that have the water which stands in it.
    lenders: Vec<usize>,
}

/// The pressure in a slot, linear but for the weight of the water.
struct Field {
    /// Middle of the rim, from the centre of mass, world axes [m].
    middle: DVec3,
    /// Inverse of C.
    inverse: DMat3,
    /// P + rho g . (middle - x) over the rim [Pa]: its mean, and its slope along xi.
    mean: f64,
    slope: DVec3,
    any_wet: bool,
    /// Pressure below which there is air [Pa].
    lowest: f64,
    /// Axes of the body's frame, and least and largest xi of the rim along each.
    axes: DMat3,
    ends: [DVec3; 2],
}

impl Field {
    /// xi of a row at `place`, with `spacing` for l0: no farther out than the rim.
    fn xi(&self, place: DVec3, spacing: f64) -> DVec3 {
        let xi = (place - self.middle) / spacing;
        let along = self.axes.transpose() * xi;
        let [low, high] = self.ends;
        let within = along.clamp(low, high);
        if within == along { xi } else { self.axes * within }
    }
}

/// Finds the slots of the solids of a scene.
pub struct Slots {
    spacing: f64,
    /// Weight of the water [N/m3].
    weight: DVec3,
    /// Whether the water has no surface, and pressures are known up to a constant.
    closed: bool,
    /// Whether water pulls.
    suction: bool,
    flat: bool,
    /// Lowest and highest corner of the domain [m].
    domain: Bounds,
    fixed: PointGrid,
    /// Which of the walls' particles each point of theirs is, and where each of those looks.
    fixed_of: Vec<usize>,
    fixed_normal: Vec<DVec3>,
    layers: Vec<Layer>,
    tiles: Tiles,
    periodic: Periodic,
}

impl Slots {
    /// The slots of the free bodies of `scene`, in the water of `params`, and if forces are `told` those of other solids.
    pub fn new(scene: &Scene, params: &Params, told: bool) -> Self {
        let l0 = scene.spacing;
        let (fixed, fixed_of) = fixed_walls(scene);
        let layer = |(k, solid): (usize, &Solid)| {
            let holds = told && k < scene.followed() && !solid.is_free();
            Layer::new(solid, l0, holds)
        };
        Self {
            periodic: scene.periodic,
            tiles: Tiles::new(scene),
            spacing: l0,
            weight: params.density * params.gravity,
            closed: params.filled,
            suction: params.suction,
            flat: scene.dimensions == 2,
            domain: scene.domain,
            fixed: PointGrid::new(fixed, CELL * l0),
            fixed_of,
            fixed_normal: scene.static_wall_normal.clone(),
            layers: scene.solids.iter().enumerate().map(layer).collect(),
        }
    }

    /// Rows at slots or in them with the solids at `poses`, in the order of solids and rows. `read` tells the pressures of the last step [Pa] in
    /// slots of particles; 0 where it is dry.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn rows(
        &self,
        poses: &[Pose],
        read: impl FnOnce(&[usize]) -> Result<Vec<f64>>,
    ) -> Result<Vec<SlotRow>> {
        Ok(self.press(poses, read)?.rows)
    }

    /// Boxes around the solids at `poses`, with room for a slot.
    fn boxes(&self, poses: &[Pose]) -> Vec<Bounds> {
        let margin = FACING.1 * self.spacing;
        self.layers.iter().zip(poses).map(|(layer, pose)| layer.bounds(pose, margin)).collect()
    }

    /// Solids near each with the solids at `poses`, of those pairs that may `meet`, with the way to the image that is.
    fn others(&self, poses: &[Pose], meet: impl Fn(&Layer, &Layer) -> bool) -> Vec<Vec<(usize, DVec3)>> {
        let boxes = self.boxes(poses);
        let mut others = vec![vec![]; boxes.len()];
        for (a, b, turns) in meeting_images(&boxes, &self.periodic) {
            if meet(&self.layers[a], &self.layers[b]) {
                others[a].push((b, self.periodic.way(turns)));
                others[b].push((a, self.periodic.way(-turns)));
            }
        }
        others
    }

    /// The slots with the solids at `poses`.
    fn find(&self, poses: &[Pose]) -> Vec<Found> {
        let margin = FACING.1 * self.spacing;
        let others = self.others(poses, |_, _| true);
        let of = |(k, layer): (usize, &Layer)| {
            let at_walls = self.at_walls(layer, &poses[k], margin);
            if !at_walls && others[k].is_empty() {
                return vec![];
            }
            let faced: Arc<[Faced]> = self.faced(k, at_walls, &others[k], poses).into();
            let shares: Vec<f64> = faced.iter().map(|row| row.share).collect();
            let found = |slot| Found { slot, faced: faced.clone(), lenders: vec![] };
            layer.slots(k, &shares, |_| false).into_iter().map(found).collect()
        };
        let layers = self.layers.par_iter().enumerate().filter(|(_, layer)| layer.free);
        enclosed::lend(layers.flat_map_iter(of).collect())
    }

    /// The rims of the slots `found` and the pressures there, which `read` tells: rows beside a slot, and in shallow water, where all of
    /// those are dry that a row at its mouth has, that row.
    fn at_rims(
        &self,
        found: &[Found],
        read: impl FnOnce(&[usize]) -> Result<Vec<f64>>,
    ) -> Result<Vec<Vec<(usize, f64)>>> {
        let mut rows = vec![];
        for Found { slot, .. } in found {
            let first = self.layers[slot.solid].first;
            rows.extend(slot.rim.iter().chain(&slot.mouth).map(|n| first + n));
        }
        let pressure = if rows.is_empty() { vec![] } else { read(&rows)? };
        let mut rest = pressure.into_iter();
        let of = |Found { slot, .. }: &Found| {
            let mut beside: Vec<(usize, f64)> = slot.rim.iter().copied().zip(&mut rest).collect();
            let at_mouth: Vec<(usize, f64)> = slot.mouth.iter().copied().zip(&mut rest).collect();
            let is_wet = |m: &u32| slot.rim.binary_search(&(*m as usize)).is_ok_and(|at| beside[at].1 != 0.0);
            let alone =
                |(n, p): &(usize, f64)| *p != 0.0 && !self.layers[slot.solid].adjacent[*n].iter().any(is_wet);
            let shallow: Vec<(usize, f64)> = at_mouth.into_iter().filter(alone).collect();
            beside.extend(shallow);
            beside
        };
        Ok(found.iter().map(of).collect())
    }

    /// Whether a fixed wall lies within `margin` [m] of the sphere about `layer`.
    fn at_walls(&self, layer: &Layer, pose: &Pose, margin: f64) -> bool {
        self.fixed.is_near(pose.position, layer.radius + margin)
    }

    /// How each row of layer `k` lies before fixed walls, if it is `at_walls`, and before `others`.
    fn faced(&self, k: usize, at_walls: bool, others: &[(usize, DVec3)], poses: &[Pose]) -> Vec<Faced> {
        let rows = (0..self.layers[k].offset.len()).into_par_iter().with_min_len(256);
        rows.map(|n| self.row_faced((k, n), at_walls, others, poses)).collect()
    }

    /// How row `n` of layer `k` does.
    fn row_faced(
        &self,
        (k, n): (usize, usize),
        at_walls: bool,
        others: &[(usize, DVec3)],
        poses: &[Pose],
    ) -> Faced {
        let (layer, pose, l0) = (&self.layers[k], &poses[k], self.spacing);
        let reach = FACING.1 * l0;
        // Of those within `ahead` of `outward` (cosine) around `x`, the nearest which looks `back` so far at least, and how far it is.
        let nearest = |x: DVec3, outward: DVec3, ahead: f64, back: f64| {
            let (mut nearest, mut opposite) = (reach, None);
            let mut see = |r: DVec3, of: Opposite, looks: &dyn Fn() -> f64| {
                let distance = r.length();
                if r.dot(outward) > ahead * distance && distance < nearest && looks() <= back {
                    (nearest, opposite) = (distance, Some(of));
                }
            };
            if at_walls {
                let of = |n: u32| {
                    let wall = self.fixed_of[n as usize];
                    let looks = || self.fixed_normal[wall].dot(outward);
                    see(self.fixed.point(n) - x, Opposite::Wall(wall), &looks);
                };
                self.fixed.near(x, reach, of);
            }
            for &(other, way) in others {
                let (layer, pose) = (&self.layers[other], &poses[other]);
                let (from, to_frame) = (x - way - pose.position, pose.orientation.inverse());
                if from.length_squared() > (layer.radius + reach).powi(2) {
                    continue;
                }
                let (local, outward) = (to_frame * from, to_frame * outward);
                let of = |n: u32| {
                    let way = pose.orientation * (layer.grid.point(n) - local);
                    let looks = || layer.looks(n as usize, outward);
                    see(way, Opposite::Solid(other, n as usize), &looks);
                };
                layer.grid.near(local, reach, of);
            }
            (nearest, opposite)
        };
        let x = pose.position + pose.orientation * layer.offset[n];
        // What a thin edge looks along as a whole is neither of its faces.
        let mut first = (reach, None);
        let mut by_face = vec![];
        for face in layer.edges.of(n) {
            let way = face.area.normalize_or_zero();
            let (distance, opposite) = nearest(x, pose.orientation * way, BEFORE_FACE, BACK);
            if distance < first.0 {
                first = (distance, opposite);
            }
            by_face.push((way, opposite));
        }
        if by_face.is_empty() {
            let way = layer.area[n].normalize_or_zero();
            first = nearest(x, pose.orientation * way, AHEAD, f64::INFINITY);
        }
        let share = ((FACING.1 - first.0 / l0) / (FACING.1 - FACING.0)).clamp(0.0, 1.0);
        Faced { share, opposite: first.1, by_face }
    }

    /// Pressure below which there is air in a slot with these pressures at its rim [Pa]: where water pulls none comes into one that is all under
    /// water.
    fn lowest(&self, mut told: impl Iterator<Item = f64>) -> f64 {
        if self.suction && told.all(|p| p != 0.0) { f64::NEG_INFINITY } else { 0.0 }
    }

    /// The pressure in a slot of a body at `pose` with `passing` rows of its rim, which lie at `place`; `lowest` as [`Self::lowest`] tells.
    fn field(
        &self,
        pose: &Pose,
        passing: &[(usize, f64)],
        place: impl Fn(usize) -> DVec3,
        lowest: f64,
    ) -> Field {
        let count = passing.len() as f64;
        let middle = passing.iter().map(|&(n, _)| place(n)).sum::<DVec3>() / count;
        let xi = |n: usize| (place(n) - middle) / self.spacing;
        let outer = |v: DVec3| DMat3::from_cols(v.x * v, v.y * v, v.z * v);
        let spread = passing.iter().map(|&(n, _)| outer(xi(n))).fold(DMat3::ZERO, |sum, m| sum + m);
        let inverse = (spread + DMat3::from_diagonal(DVec3::splat(STIFFENING * count))).inverse();
        let level = |&(n, p): &(usize, f64)| p - self.weight.dot(place(n) - middle);
        let mean = passing.iter().map(level).sum::<f64>() / count;
        let slope = inverse * passing.iter().map(|row| level(row) * xi(row.0)).sum::<DVec3>();
        let axes = DMat3::from_quat(pose.orientation);
        let along = || passing.iter().map(|row| axes.transpose() * xi(row.0));
        let ends = [along().fold(DVec3::INFINITY, DVec3::min), along().fold(DVec3::NEG_INFINITY, DVec3::max)];
        Field {
            middle,
            inverse,
            mean,
            slope,
            any_wet: passing.iter().any(|&(_, p)| p != 0.0),
            lowest,
            axes,
            ends,
        }
    }

    /// The rows that lie in the slot, and those at its rim with what they pass on; `told` are the rim and its
    /// pressures in the last step, `seeps` what comes through the slot to rows of the rim.
    fn passed_on(&self, found: &Found, pose: &Pose, told: &[(usize, f64)], seeps: &[Seep]) -> Vec<SlotRow> {
        let slot = &found.slot;
        let layer = &self.layers[slot.solid];
        // Relative to the centre of mass, world axes.
        let place = self.places(slot, pose, told);
        let passing = self.passing(told.to_vec(), |n| pose.orientation * layer.offset[n]);
        let count = passing.len() as f64;
        let field = self.field(pose, &passing, &place, self.lowest(told.iter().map(|row| row.1)));
        let Field { middle, inverse, any_wet, .. } = field;
        let xi = |n: usize| field.xi(place(n), self.spacing);
        let under_water = |n: usize, at: DVec3| !any_wet || self.in_slot(&field, place(n), at) > field.lowest;
        // sum_f S_f and sum_f xi_f S_f; the same with the weight of water from the rim's middle to the surface in the slot.
        let (mut mean, mut slope) = ([Wrench::default(); 2], [[Wrench::default(); 3]; 2]);
        let areas = layer.areas(&layer.area, found, pose);
        let faces = |(&(n, share), &area): (&(usize, f64), &DVec3)| {
            layer.faces(n, area, pose).map(move |(area, at)| (n, share, area, at))
        };
        let faces = slot.inside.iter().zip(&areas).flat_map(faces);
        for (n, share, area, at) in faces.filter(|&(n, .., at)| under_water(n, at)) {
            let row = row(area, at);
            let head = self.weight.dot(at - middle);
            let along = xi(n).to_array();
            for (factor, (mean, slope)) in [1.0, head].into_iter().zip(mean.iter_mut().zip(&mut slope)) {
                mean.add(share * factor, &row);
                slope.iter_mut().zip(along).for_each(|(s, along)| s.add(share * factor * along, &row));
            }
        }
        let passed = |n: usize| {
            let along = (inverse * xi(n)).to_array();
            let of = |m: usize| {
                let mut sum = Wrench::default();
                sum.add(1.0 / count, &mean[m]);
                slope[m].iter().zip(along).for_each(|(s, along)| sum.add(along, s));
                sum
            };
            let (per_pascal, mut head) = (of(0), of(1));
            head.add(-self.weight.dot(place(n) - middle), &per_pascal);
            (per_pascal, head)
        };
        // A row of the rim in the air presses nothing, but its height tells where P = 0 is: its part goes with those under water.
        let (wet, dry): (Vec<_>, Vec<_>) =
            passing.iter().map(|&(n, p)| (n, p != 0.0 || !any_wet, passed(n))).partition(|row| row.1);
        let mut of_dry = Wrench::default();
        dry.iter().for_each(|(.., (_, head))| of_dry += *head);
        let solid = slot.solid as u32;
        let (wet_count, dry_rows) = (wet.len() as f64, dry.into_iter());
        let at_rim = |(n, is_wet, (per_pascal, mut head)): (usize, bool, (Wrench, Wrench))| {
            if is_wet {
                head.add(1.0 / wet_count, &of_dry);
            } else {
                head = Wrench::default();
            }
            let seep =
                slot.rim.binary_search(&n).ok().and_then(|at| seeps.get(at)).copied().unwrap_or_default();
            SlotRow { solid, row: n as u32, taken: 0.0, per_pascal, head, seep }
        };
        // A row keeps what of it looks out: its own pressure there.
        let inside = |(&(n, share), &area): (&(usize, f64), &DVec3)| {
            let mut out = SlotRow { solid, row: n as u32, taken: share, ..SlotRow::default() };
            for (outwards, at) in layer.faces(n, pose.orientation * layer.area[n] - area, pose) {
                let row = row(outwards, at);
                out.per_pascal.add(share, &row);
                out.head.add(share * self.weight.dot(at - place(n)), &row);
            }
            out
        };
        wet.into_iter()
            .chain(dry_rows)
            .map(at_rim)
            .chain(slot.inside.iter().zip(&areas).map(inside))
            .collect()
    }

    /// Where the pressures are that a slot's field goes through, `told` as in [`Self::passed_on`]: at the rows, and P = 0 of a dry rim where the
    /// slot ends there.
    fn places<'a>(
        &'a self,
        slot: &'a Slot,
        pose: &'a Pose,
        told: &'a [(usize, f64)],
    ) -> impl Fn(usize) -> DVec3 + 'a {
        let any_wet = told.iter().any(|&(_, p)| p != 0.0);
        let offset = &self.layers[slot.solid].offset;
        move |n| {
            let dry = slot.rim.binary_search(&n).ok().filter(|&at| any_wet && told[at].1 == 0.0);
            pose.orientation * dry.map_or(offset[n], |at| slot.edge[at])
        }
    }

    /// Pressure of the `field` of a slot on a body's surface, at `x` by a row at `place` [Pa].
    fn in_slot(&self, field: &Field, place: DVec3, x: DVec3) -> f64 {
        let xi = field.xi(place, self.spacing);
        field.mean + field.slope.dot(xi) + self.weight.dot(x - field.middle)
    }

    /// Those of the `rows` of a rim that pass their pressure on, with it: all but those in the air above the water's
    /// level; all of them where none is under water.
    fn passing(&self, rows: Vec<(usize, f64)>, place: impl Fn(usize) -> DVec3) -> Vec<(usize, f64)> {
        // Pressure that the row's height and the water above it make: P at the height of the centre of mass.
        let level = |&(n, p): &(usize, f64)| p - self.weight.dot(place(n));
        let wet = rows.iter().filter(|(_, p)| *p != 0.0);
        let highest = wet.map(level).fold(f64::NEG_INFINITY, f64::max);
        if highest == f64::NEG_INFINITY {
            return rows;
        }
        rows.into_iter().filter(|row| row.1 != 0.0 || level(row) <= highest).collect()
    }
}
