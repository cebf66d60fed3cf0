//! What of a fixed solid of any shape lies in other walls or beyond the tank's: particles that are left out, the surface that stays free, and
//! what keeps the joint tight.

use super::behind::Row;
use super::build::{AXES, Builder};
use super::oriented::Placed;
use super::placement::point;
use super::walls::{closed, near_solid};
use super::{Shape, Solid};
use crate::error::Problem;
use crate::shape::{ADJACENT, Particles, PointCells, bends};
use glam::DVec3;
use std::collections::HashSet;

/// Distances before a face, over l0, at which a point that lies in a solid tells that no water stands between: nearly at the face, where a solid ends
/// in a wedge, and half a particle away, where it stands a little off the lattice; less than just half, which is a gap that cases have.
pub(crate) const COVERED: [f64; 2] = [0.1, 0.48];
/// Nearer to a particle of a solid than this, over the spacing, other walls may face pieces of the surface that are its.
const MEETING: f64 = 3.0;
/// As far as this around, over the spacing, what is flat in the face of another wall lies in it.
const FLAT: f64 = 3.0;
/// What lies deeper in a wall than this, over the spacing, has no gap before it.
const FLUSH: f64 = 1e-3;
/// Two walls whose particles stand this much more than a spacing apart, over the spacing, let no water through; 0.35 lets some.
const SEALED: f64 = 0.25;

impl Builder<'_> {
    /// Takes away what of a fixed solid lies inside other walls or beyond the tank's, and the areas that face them; before surfaces that bend the
    /// gap opens, and [`crate::cover`] tells what is covered.
    pub(super) fn bury(&mut self, key: &str, solid: &mut Solid) {
        let l0 = self.lattice.spacing;
        let at = |offset: &DVec3| solid.position + solid.orientation * *offset;
        let kept: Vec<bool> = solid.wall_offset.iter().map(|o| !self.takes(at(o))).collect();
        let mut dummies: Vec<DVec3> =
            solid.dummy_offset.iter().filter(|o| !self.takes(at(o))).copied().collect();
        let hidden = solid.wall_offset.iter().zip(&kept).filter(|(_, kept)| !**kept);
        dummies.extend(self.sealing(&solid.placed(), hidden.map(|(o, _)| (*o, at(o)))));
        let count = solid.wall_offset.len() + solid.dummy_offset.len();
        let mut surface = solid.wall_offset.iter().zip(&solid.wall_to_surface);
        let bare = !kept.contains(&true)
            && surface.any(|(x, way)| !self.is_covered(solid, at(&(*x + (1.0 - FLUSH) * *way))));
        let mut areas = self.cut(solid, &kept);
        if let Some(freed) = self.freed(solid, &kept) {
            for (k, row) in (0..kept.len()).filter(|&k| kept[k]).zip(0..) {
                areas[k] = freed.area[row];
                solid.wall_to_surface[k] = freed.to_surface[row];
            }
            solid.wall_edges = freed.edges;
        } else {
            let bends = solid.bending(l0);
            // Of what is round the ends alone are flat, and the rim has a part of them.
            let ends = if solid.shape.pieces(l0).is_none() { solid.shape.axes() } else { vec![] };
            for (k, area) in areas.iter_mut().enumerate() {
                let flat = if bends.any(k) { &ends[..] } else { &DVec3::AXES };
                *area = self.unfaced(solid, flat, *area, k);
            }
            solid.wall_edges = solid.wall_edges.kept(&kept);
        }
        fn left<T: Copy>(all: &[T], kept: &[bool]) -> Vec<T> {
            all.iter().zip(kept).filter(|(_, kept)| **kept).map(|(x, _)| *x).collect()
        }
        solid.wall_offset = left(&solid.wall_offset, &kept);
        solid.wall_to_surface = left(&solid.wall_to_surface, &kept);
        solid.wall_area = left(&areas, &kept);
        solid.dummy_offset = dummies;
        let gone = count - solid.wall_offset.len() - solid.dummy_offset.len();
        let label = format!("obstacle `{}`", solid.name);
        if solid.wall_offset.is_empty() {
            let message =
                format!("{label}: nothing of it stands free, its middle is at {}", point(solid.position));
            let remedy = match bare {
                true => {
                    "its surface is less than half a spacing before other walls, which have no room for its particles: move it a spacing away from them, or leave it out"
                }
                false => "it lies beyond the tank's walls or inside others: move it, or check `scale`",
            };
            self.problems.push(Problem::new(key, message, remedy));
            self.lacks_walls = true;
        } else if gone > 0 {
            let beyond = self.beyond(solid);
            self.notes.push(format!(
                "{label}: {gone} particles left out inside other walls and beyond the tank's{beyond}"
            ));
        }
    }

    /// Makes room for the layers of a solid that stays in other walls right behind it.
    pub(super) fn stand_before(&mut self, solid: &Solid) {
        let outward = |way: &DVec3| solid.orientation * way.normalize_or_zero();
        let rows = solid.wall_positions().zip(&solid.wall_to_surface);
        let rows: Vec<Row> = rows.map(|(at, way)| Row(at, outward(way))).collect();
        let gone = self.fixed.make_room(&rows, self.lattice.spacing);
        if gone > 0 {
            let why = "of other walls that stand less than a spacing behind its own are moved down";
            self.notes.push(format!("obstacle `{}`: {gone} particles {why}", solid.name));
        }
    }

    /// What of the `area` of row `k` of a solid faces no other wall along `axes` of the solid.
    fn unfaced(&self, solid: &Solid, axes: &[DVec3], mut area: DVec3, k: usize) -> DVec3 {
        let (l0, at) = (self.lattice.spacing, solid.position + solid.orientation * solid.wall_offset[k]);
        for e in axes.iter().flat_map(|&e| [e, -e]) {
            let (faces, way) = (area.dot(e), solid.orientation * e);
            // Rows of what is thin lie nearer to its faces than half a spacing.
            let deep = solid.faces(k).map(|face| face.way.dot(e)).fold(0.0, f64::max);
            let face = at + if deep > 0.0 { deep } else { 0.5 * l0 } * way;
            let before = face + COVERED[1] * l0 * way;
            if faces > 0.0 && self.is_covered(solid, before) && !self.opens(face, before) {
                area -= faces * e;
            }
        }
        area
    }

    /// Those particles of a solid that are `kept`, with what of its surface faces no other wall, or bends away from one, so that there is a gap: of one whose
    /// particles have no face each of their own, where others come near it.
    fn freed(&self, solid: &Solid, kept: &[bool]) -> Option<Particles> {
        let (l0, near) = (self.lattice.spacing, MEETING * self.lattice.spacing);
        let at = |x: DVec3| solid.position + solid.orientation * x;
        let (mut met, mut layer) = (PointCells::new(near), PointCells::new(near));
        for (&offset, kept) in solid.wall_offset.iter().zip(kept) {
            layer.add(at(offset));
            let ways = DVec3::AXES.into_iter().flat_map(|e| [e, -e]);
            let mut around = ways.flat_map(|e| [1.0, 2.0].map(|d| at(offset) + d * l0 * e));
            if !kept || around.any(|x| self.is_covered(solid, x)) {
                met.add(at(offset));
            }
        }
        if met.is_empty() {
            return None;
        }
        // Where a solid ends in a wedge its surface goes on beyond the last of its particles.
        let alone = |x: DVec3| !met.is_near(x, near) && layer.is_near(x, near);
        // Directions of the surface, each once in half a spacing.
        let (mut around, mut ways, mut seen) = (PointCells::new(ADJACENT * l0), vec![], HashSet::new());
        for (x, area) in solid.shape.pieces(l0)? {
            let (x, way) = (at(x), solid.orientation * area.normalize_or_zero());
            let key = ((2.0 / l0 * x).floor().as_ivec3(), (1e3 * way).round().as_ivec3());
            if !alone(x) && seen.insert(key) {
                around.add(x);
                ways.push(way);
            }
        }
        let bent = |x: DVec3, way: DVec3| around.within(x, ADJACENT * l0).any(|(k, _)| bends(way, ways[k]));
        // What lies flat in the face of another wall is that wall's, which is not covered there.
        let lies_on = |x: DVec3, normal: DVec3| {
            let (one, other) = normal.any_orthonormal_pair();
            let (one, other) =
                if self.lattice.plane { (DVec3::Y.cross(normal), DVec3::ZERO) } else { (one, other) };
            let around = [DVec3::ZERO, one, -one, other, -other];
            around.into_iter().all(|way| self.is_covered(solid, x + l0 * (FLAT * way - COVERED[0] * normal)))
        };
        let free = |x: DVec3, normal: DVec3| {
            let (x, normal) = (at(x), solid.orientation * normal);
            // What reaches over a seam is cut there.
            if self.is_beyond(x) && self.periodic.wrap(x) != x {
                return false;
            }
            let covered = |d: f64| self.is_covered(solid, x + d * l0 * normal);
            let open = |d: f64| !covered(d) || self.opens(x, x + d * l0 * normal);
            let bare = COVERED.into_iter().all(open) && !lies_on(x, normal);
            alone(x) || bare || !covered(-FLUSH) && bent(x, normal)
        };
        let wall: Vec<DVec3> =
            solid.wall_offset.iter().zip(kept).filter(|(_, kept)| **kept).map(|(x, _)| *x).collect();
        solid.shape.freed(&wall, l0, &free)
    }

    /// From where to where a solid reaches that goes beyond the tank's sides along an axis, for a note: that a prism stands from its `position`
    /// on and not about it is seen by that.
    fn beyond(&self, solid: &Solid) -> String {
        let (low, high) = solid.placed().ends();
        let l0 = self.lattice.spacing;
        let sides = self.closed_sides().unwrap_or((DVec3::NEG_INFINITY, DVec3::INFINITY));
        let goes = |k: &usize| low[*k] < sides.0[*k] - 0.5 * l0 || high[*k] > sides.1[*k] + 0.5 * l0;
        let axes = (0..3).filter(|&k| !(self.lattice.plane && k == 1)).filter(goes);
        axes.map(|k| format!(", it reaches from {} = {:.4} to {:.4} m", AXES[k], low[k], high[k])).collect()
    }

    /// The areas of a solid's particles as far as they lie between the tank's sides: one at a side keeps a part, and what one beyond it has
    /// on this side goes to the nearest that is `kept`.
    fn cut(&self, solid: &Solid, kept: &[bool]) -> Vec<DVec3> {
        let l0 = self.lattice.spacing;
        let Some((low, high)) = self.closed_sides() else { return solid.wall_area.clone() };
        let at = |k: usize| solid.position + solid.orientation * solid.wall_offset[k];
        // A face has no length across it; of an edge, which has two or three, [`crate::cover`] takes what lies beyond a side.
        let inside = |k: usize| {
            let (x, outward) = (at(k), solid.orientation * solid.wall_area[k].normalize_or_zero());
            let reach = (x + 0.5 * l0).min(high) - (x - 0.5 * l0).max(low);
            let across = outward.abs().cmpgt(DVec3::splat(0.7)) & x.cmpge(low) & x.cmple(high);
            DVec3::select(across, DVec3::ONE, (reach / l0).clamp(DVec3::ZERO, DVec3::ONE)).element_product()
        };
        let shares: Vec<f64> = (0..kept.len()).map(inside).collect();
        let mut areas: Vec<DVec3> =
            solid.wall_area.iter().zip(&shares).map(|(a, share)| *a * *share).collect();
        let stays: Vec<usize> = (0..kept.len()).filter(|&k| kept[k]).collect();
        let mut near = PointCells::new(l0);
        stays.iter().for_each(|&k| near.add(at(k)));
        for k in (0..kept.len()).filter(|&k| !kept[k] && shares[k] > 0.0) {
            let taker = near.nearest(at(k), 1.5 * l0).map(|j| stays[j]);
            if let Some(taker) = taker.filter(|&j| solid.wall_area[j].dot(areas[k]) > 0.0) {
                let area = areas[k];
                areas[taker] += area;
            }
        }
        areas
    }

    /// Lower and upper corner of the room between those sides of the tank that have walls or a seam [m]; infinite where they have none.
    fn closed_sides(&self) -> Option<(DVec3, DVec3)> {
        let (cells, tank) = self.tank.zip(self.case.tank.as_ref())?;
        let (closed, seam) = (closed(&tank.open, self.lattice.plane), tank.periodic());
        let ends = |k: usize, side: usize| closed[k][side] || seam[k];
        let side = |corner: DVec3, side: usize, open: f64| {
            DVec3::from_array([0, 1, 2].map(|k| if ends(k, side) { corner[k] } else { open }))
        };
        let (low, high) = (self.lattice.corner(cells.lo), self.lattice.corner(cells.hi));
        Some((side(low, 0, f64::NEG_INFINITY), side(high, 1, f64::INFINITY)))
    }

    /// Whether a wall takes the place of a particle: it lies inside of one, beyond the tank's or a seam, or closer to a particle of the lattice's walls than half
    /// a spacing.
    fn takes(&self, at: DVec3) -> bool {
        self.buried(at) || near_solid(&self.lattice, &self.grid, at, 0.5)
    }

    /// Those of the wall particles of a `solid`, in its frame and where they are, that others take but that stand less than half a spacing behind the surface of
    /// these, and of their particles none nearer than [`SEALED`]: without them there was a slit of up to one and a half spacings between theirs and what is left of the solid,
    /// through which single particles of water went. They have no pressure.
    fn sealing(&self, solid: &Placed, hidden: impl Iterator<Item = (DVec3, DVec3)>) -> Vec<DVec3> {
        let l0 = self.lattice.spacing;
        let (reach, (low, high)) = (0.5 * l0, solid.ends());
        let meets = |other: &&Solid| {
            let (from, to) = other.placed().ends();
            other.is_still() && from.cmple(high + reach).all() && to.cmpge(low - reach).all()
        };
        let others: Vec<&Solid> = self.moving_walls.iter().filter(meets).collect();
        let shapes: Vec<Placed> = others.iter().map(|s| s.placed()).collect();
        let mut rows = PointCells::new(SEALED * l0);
        others.iter().flat_map(|s| s.wall_positions()).for_each(|x| rows.add(x));
        let sides = self.closed_sides();
        let seals = |at: DVec3| {
            let behind =
                sides.is_some_and(|(low, high)| at.cmplt(low - reach).any() || at.cmpgt(high + reach).any());
            let inside = self.fixed.shapes.iter().map(Placed::from).any(|b| b.holds(at, reach))
                || shapes.iter().any(|b| b.holds(at, reach));
            !behind
                && !inside
                && self.periodic.wrap(at) == at
                && !near_solid(&self.lattice, &self.grid, at, SEALED)
                && !rows.is_near(at, SEALED * l0)
        };
        hidden.filter(|(_, at)| seals(*at)).map(|(offset, _)| offset).collect()
    }

    /// Whether a wall covers a place before the face of a solid. Across a seam that may be the solid itself.
    fn is_covered(&self, solid: &Solid, at: DVec3) -> bool {
        let image = self.periodic.wrap(at);
        let itself = || solid.placed().holds(image, 1e-6 * self.lattice.spacing);
        self.buried(image) || image.distance(at) > 0.5 * self.lattice.spacing && itself()
    }

    /// Whether all that covers a place before a `face` is round there, and does not hold the face itself: the gap opens to the sides, and
    /// [`crate::cover`] tells what is covered.
    fn opens(&self, face: DVec3, place: DVec3) -> bool {
        let slack = 1e-6 * self.lattice.spacing;
        let is_flat = |b: &Placed| {
            let to_shape = b.axes.transpose();
            let (_, normal) = b.shape.distance(to_shape * (place - b.center));
            let round = matches!(b.shape, Shape::Sphere(_) | Shape::Cylinder(_) | Shape::Disc(_));
            !round || b.shape.axes().iter().any(|e| e.dot(normal).abs() > 0.99)
        };
        let earlier = self.moving_walls.iter().filter(|s| s.is_still()).map(Solid::placed);
        let covering: Vec<Placed> = earlier.filter(|b| b.holds(place, slack)).collect();
        let by_others = self.is_beyond(place)
            || self.fixed.shapes.iter().map(Placed::from).any(|b| b.holds(place, slack));
        !by_others && !covering.is_empty() && !covering.iter().any(|b| is_flat(b) || b.holds(face, slack))
    }

    /// Whether a place lies beyond the tank's walls or a seam.
    fn is_beyond(&self, at: DVec3) -> bool {
        let slack = 1e-6 * self.lattice.spacing;
        let sides = self.closed_sides();
        sides.is_some_and(|(low, high)| at.cmplt(low - slack).any() || at.cmpgt(high + slack).any())
    }

    /// Whether a place lies inside a wall or beyond the tank's or a seam.
    fn buried(&self, at: DVec3) -> bool {
        let slack = 1e-6 * self.lattice.spacing;
        let earlier = || self.moving_walls.iter().filter(|s| s.is_still()).map(Solid::placed);
        self.is_beyond(at)
            || self.fixed.shapes.iter().map(Placed::from).any(|b| b.holds(at, slack))
            || earlier().any(|b| b.holds(at, slack))
    }
}
