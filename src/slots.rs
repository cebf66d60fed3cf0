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
mod field;
mod held;
mod inertia;
mod layer;
mod pockets;
mod pushes;
mod voids;

pub(crate) use driven::{AGAINST, BEFORE};
pub use enclosed::Pressed;
pub use held::{Held, HeldForces};
pub use inertia::Pressing;
pub use pushes::{Opposite, Push};
pub use voids::Voids;

use crate::body::slots::{Seep, SlotRow};
use crate::body::{Pose, Wrench};
use crate::contact::broad::{Bounds, PointGrid, fixed_walls, meeting_images};
use crate::cover::Tiles;
use crate::error::Result;
use crate::kernels::coupling::row;
use crate::params::Params;
use crate::periodic::Periodic;
use crate::scene::{Scene, Solid};
use field::Field;
use glam::DVec3;
use layer::Layer;
use rayon::prelude::*;
use std::sync::Arc;
use voids::Lying;

/// Distances between facing wall-layer particles, over l0, up to which a row lies wholly in a slot, and from which on not
/// at all: gaps of 0.9 and of 1.1 spacings. Particles of water come in between from 0.85 on; in narrower gaps they stay where they
/// are, and what lies behind them is no void.
const FACING: (f64, f64) = (1.9, 2.1);
/// The distance, over l0, up to which what is before a row has no room for water that stays away: a gap of 1.6 spacings.
const EMPTY: f64 = 2.6;
/// What is that far is before a row only if it lies this near its outward direction (cosine of the angle): beside the foot of a block the floor does not.
const ACROSS: f64 = 0.8;
/// Another solid's particle is faced by a row if it lies this near its outward direction (cosine of the angle).
const AHEAD: f64 = 0.5;
/// The same of a face of a row at an edge: half-way to the next face.
const BEFORE_FACE: f64 = 0.7;
/// What a face of such a row looks onto looks back at it, the cosine of their directions being no larger: beside the foot of a block on the floor the floor does not.
const BACK: f64 = -0.3;
/// Edge of the cells that points lie in, over l0: twice the reach, so that two an axis are looked into.
const CELL: f64 = 5.2;

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
    /// How far both surfaces are from each other there [m].
    gap: f64,
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

/// Finds the slots of the solids of a scene.
pub struct Slots {
    spacing: f64,
    /// Of the water [kg/m3].
    density: f64,
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
            density: params.density,
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
        read: impl FnMut(&[usize]) -> Result<Vec<f64>>,
    ) -> Result<Vec<SlotRow>> {
        Ok(self.press(poses, None, read)?.rows)
    }

    /// Boxes around the solids at `poses`, with room for a slot.
    fn boxes(&self, poses: &[Pose]) -> Vec<Bounds> {
        let margin = EMPTY * self.spacing;
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

    /// How the rows of the free bodies that are near something lie with the solids at `poses`, and what is near each solid.
    fn lying(&self, poses: &[Pose]) -> (Vec<Lying>, Vec<Vec<(usize, DVec3)>>) {
        let others = self.others(poses, |_, _| true);
        let of = |(solid, layer): (usize, &Layer)| {
            let at_walls = self.at_walls(layer, &poses[solid], EMPTY * self.spacing);
            if !at_walls && others[solid].is_empty() {
                return None;
            }
            Some(Lying { solid, at_walls, faced: self.faced(solid, at_walls, &others[solid], poses) })
        };
        let layers = self.layers.par_iter().enumerate().filter(|(_, layer)| layer.free);
        (layers.filter_map(of).collect(), others)
    }

    /// The slots of the free bodies that are `lying` so with the solids at `poses`, `voids` being rows before which there is a room without water.
    fn find(
        &self,
        (mut lying, others): (Vec<Lying>, Vec<Vec<(usize, DVec3)>>),
        poses: &[Pose],
        voids: &Voids,
    ) -> Vec<Found> {
        for of in &mut lying {
            for &(k, n) in voids.range((of.solid, 0)..(of.solid + 1, 0)) {
                of.faced[n] = self.row_faced((k, n), of.at_walls, &others[k], poses, (EMPTY, ACROSS));
            }
        }
        let found = |of: Lying| {
            let faced: Arc<[Faced]> = of.faced.into();
            let shares: Vec<f64> = faced.iter().map(|row| row.share).collect();
            let slots = self.layers[of.solid].slots(of.solid, &shares, |_| false);
            let found: Vec<Found> =
                slots.into_iter().map(|slot| Found { slot, faced: faced.clone(), lenders: vec![] }).collect();
            found
        };
        enclosed::lend(lying.into_par_iter().flat_map_iter(found).collect())
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
        rows.map(|n| self.row_faced((k, n), at_walls, others, poses, (FACING.1, 0.0))).collect()
    }

    /// How row `n` of layer `k` does, with what lies `within` so many l0, and this near its outward direction at `least` (cosine).
    fn row_faced(
        &self,
        (k, n): (usize, usize),
        at_walls: bool,
        others: &[(usize, DVec3)],
        poses: &[Pose],
        (within, least): (f64, f64),
    ) -> Faced {
        let (layer, pose, l0) = (&self.layers[k], &poses[k], self.spacing);
        let reach = within * l0;
        // Of those within `ahead` of `outward` (cosine) around `x`, the nearest which looks `back` so far at least, how far it is, and how far along `outward`.
        let nearest = |x: DVec3, outward: DVec3, ahead: f64, back: f64| {
            let (mut nearest, mut along, mut opposite) = (reach, reach, None);
            let mut see = |r: DVec3, of: Opposite, looks: &dyn Fn() -> f64| {
                let distance = r.length();
                if r.dot(outward) > ahead * distance && distance < nearest && looks() <= back {
                    (nearest, along, opposite) = (distance, r.dot(outward), Some(of));
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
            (nearest, along, opposite)
        };
        let x = pose.position + pose.orientation * layer.offset[n];
        // What a thin edge looks along as a whole is neither of its faces.
        let mut first = (reach, reach, None);
        let mut by_face = vec![];
        for face in layer.edges.of(n) {
            let way = face.area.normalize_or_zero();
            let (distance, along, opposite) =
                nearest(x, pose.orientation * way, least.max(BEFORE_FACE), BACK);
            if distance < first.0 {
                first = (distance, along, opposite);
            }
            by_face.push((way, opposite));
        }
        if by_face.is_empty() {
            let way = layer.area[n].normalize_or_zero();
            first = nearest(x, pose.orientation * way, least.max(AHEAD), f64::INFINITY);
        }
        let share = ((within - first.0 / l0) / (FACING.1 - FACING.0)).clamp(0.0, 1.0);
        Faced { share, opposite: first.2, gap: first.1 - l0, by_face }
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
}
