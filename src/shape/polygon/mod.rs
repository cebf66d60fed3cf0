//! A slice of any section in the plane y = 0: the prism and the wedge of two dimensions. It has no ends.
//!
//! Particles stand in layers half a spacing, one and a half and so on below its sides. A layer is the outline moved inwards: sides
//! shrink to where they meet inside a corner, and an arc closes them round a notch. What of it goes on smoothly is divided evenly.

mod holes;
mod layer;

use super::areas::{self, Piece, middle};
use super::cells::PointCells;
use super::open;
use super::surface::Surface;
use super::thickness::{Surface as Outline, Way, thinnest};
use super::thin::Thin;
use super::{
    APART, Faces, Geometry, Inside, Node, PLANE_FACES, Particles, Shape, WallLayer, face, nodes_between,
};
use glam::{DVec2, DVec3};
use std::sync::Mutex;

/// Pieces of a side that go to the nearest particle each, over the spacing.
const PIECE: f64 = 0.1;
/// The same where others cut a side: what of it is left is known as well as that.
const CUT: f64 = 0.02;

/// A closed line of straight sides in the plane y = 0, and what it encloses.
#[derive(Clone, Debug)]
pub struct Polygon {
    /// Corners about the centroid, x and z, with the inside on the left [m].
    corners: Vec<DVec2>,
    /// Width of the slice along y [m].
    width: f64,
    /// Centroid in the coordinates of its keys [m].
    center: DVec2,
    area: f64,
    /// Polar second moment of area about the centroid over the area [m2].
    polar: f64,
    radius: f64,
    /// The sides that depths count to, if others cover some.
    open: Option<Vec<[DVec2; 2]>>,
}

/// A polygon is made once for all solids, scenes and runs of a program that have it, and kept: the corners as they were given.
static MADE: Mutex<Vec<(Vec<DVec2>, &'static Polygon)>> = Mutex::new(Vec::new());

/// Those of which others cover some sides.
static OPENED: open::Made<Polygon> = Mutex::new(Vec::new());

impl PartialEq for Polygon {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

/// In the plane y = 0.
fn space(x: DVec2) -> DVec3 {
    DVec3::new(x.x, 0.0, x.y)
}

fn plane(x: DVec3) -> DVec2 {
    DVec2::new(x.x, x.z)
}

/// Area of a closed line, positive where the inside is on its left [m2].
pub(crate) fn signed_area(corners: &[DVec2]) -> f64 {
    sides_of(corners).map(|[a, b]| 0.5 * a.perp_dot(b)).sum()
}

fn sides_of(corners: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> + '_ {
    (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]])
}

/// The nearest point of `sides`, and the normal of the side that it lies on.
fn nearest_of(sides: impl Iterator<Item = [DVec2; 2]>, q: DVec2) -> (DVec2, DVec2) {
    let on = sides.map(|[a, b]| {
        let way = b - a;
        let share = ((q - a).dot(way) / way.length_squared()).clamp(0.0, 1.0);
        (a + share * way, -way.normalize().perp())
    });
    let nearer = |one: (DVec2, DVec2), other: (DVec2, DVec2)| {
        if other.0.distance_squared(q) < one.0.distance_squared(q) { other } else { one }
    };
    on.reduce(nearer).unwrap_or_default()
}

impl Polygon {
    /// Its sides in pieces of `length` [m] at most.
    fn sides_in(&self, length: f64) -> impl Iterator<Item = Piece> + '_ {
        self.sides().flat_map(move |[a, b]| {
            let count = (a.distance(b) / length).ceil().max(1.0);
            let area = -space((b - a).perp()) * self.width / count;
            (0..count as usize).map(move |k| (space(a.lerp(b, (k as f64 + 0.5) / count)), area))
        })
    }

    /// The slice of `width` [m] along y of what the closed line through `corners`, x and z [m], encloses; it does not cross itself.
    pub fn new(corners: &[[f64; 2]], width: f64) -> &'static Self {
        let given: Vec<DVec2> = corners.iter().map(|&c| c.into()).collect();
        let mut made = MADE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some((_, known)) = made.iter().find(|(of, known)| *of == given && known.width == width) {
            return known;
        }
        let polygon: &'static Self = Box::leak(Box::new(Self::through(given.clone(), width)));
        made.push((given, polygon));
        polygon
    }

    fn through(mut corners: Vec<DVec2>, width: f64) -> Self {
        if signed_area(&corners) < 0.0 {
            corners.reverse();
        }
        let first = corners[0];
        corners.iter_mut().for_each(|c| *c -= first);
        let area = signed_area(&corners);
        let centroid = sides_of(&corners).map(|[a, b]| a.perp_dot(b) * (a + b)).sum::<DVec2>() / (6.0 * area);
        corners.iter_mut().for_each(|c| *c -= centroid);
        let polar = |[a, b]: [DVec2; 2]| a.perp_dot(b) * (a.dot(a) + a.dot(b) + b.dot(b)) / 12.0;
        Self {
            polar: sides_of(&corners).map(polar).sum::<f64>() / area,
            radius: corners.iter().map(|c| c.length()).fold(0.0, f64::max),
            center: first + centroid,
            corners,
            width,
            area,
            open: None,
        }
    }

    /// The same with the sides alone that are not `covered` in full.
    fn with_open(&self, spacing: f64, covered: &dyn Fn(DVec3, DVec3) -> bool) -> Option<&'static Self> {
        let is_open = |[a, b]: [DVec2; 2]| {
            let (count, normal) = (open::looks(a.distance(b), spacing), -space((b - a).normalize().perp()));
            let place = |k: u32| a.lerp(b, (f64::from(k) + 0.5) / f64::from(count));
            (0..count).any(|k| !covered(space(place(k)), normal))
        };
        open::made(&OPENED, self, self.sides().map(is_open).collect(), |is_open| {
            let left = self.sides().zip(is_open).filter(|(_, open)| **open).map(|(side, _)| side);
            Self { open: Some(left.collect()), ..self.clone() }
        })
    }

    /// Where it is thinnest: how thin [m], and the middle of a side there, in the coordinates that it was given in [m].
    pub(crate) fn thinnest(&self) -> (f64, DVec3) {
        let ways = self.sides().filter_map(|[a, b]| {
            let (middle, inwards) = (0.5 * (a + b), (b - a).normalize().perp());
            let start = middle + 1e-9 * self.radius * inwards;
            let length = self.crossings(start, inwards, 4.0 * self.radius).first().copied()?;
            let outward = self.nearest(middle + length * inwards).1;
            let (start, inwards, outward) = (space(middle), space(inwards), space(outward));
            Some(Way { start, inwards, length, area: a.distance(b), outward })
        });
        let (least, place) = thinnest(ways, self);
        (least, place + space(self.center))
    }

    fn sides(&self) -> impl Iterator<Item = [DVec2; 2]> + '_ {
        sides_of(&self.corners)
    }

    /// The nearest point of the outline, and its side's normal.
    fn nearest(&self, q: DVec2) -> (DVec2, DVec2) {
        nearest_of(self.sides(), q)
    }

    /// The middle of the points of the outline that are nearest to `q`: before the bisector of a corner there are two, and either would be a
    /// bias; those that are farther by less than `slack` [m] count.
    fn nearest_evenly(&self, q: DVec2, slack: f64) -> DVec2 {
        let most = self.nearest(q).0.distance(q) + slack;
        let found = self.sides().map(|side| nearest_of(std::iter::once(side), q).0);
        middle(found.filter(|at| at.distance(q) <= most).map(space), slack).map_or(q, plane)
    }

    fn holds(&self, q: DVec2) -> bool {
        let crossed = |[a, b]: [DVec2; 2]| {
            (a.y > q.y) != (b.y > q.y) && q.x < a.x + (q.y - a.y) / (b.y - a.y) * (b.x - a.x)
        };
        self.sides().filter(|side| crossed(*side)).count() % 2 == 1
    }

    /// Depth below the outline [m], less than 0 outside.
    fn depth_at(&self, q: DVec2) -> f64 {
        let distance = self.nearest(q).0.distance(q);
        if self.holds(q) { distance } else { -distance }
    }

    /// Places along the line, in order, where it goes through the outline.
    fn crossings(&self, start: DVec2, way: DVec2, length: f64) -> Vec<f64> {
        let crossing = |[a, b]: [DVec2; 2]| {
            let side = b - a;
            let across = way.perp_dot(side);
            let (place, share) = ((a - start).perp_dot(side) / across, (a - start).perp_dot(way) / across);
            (across != 0.0 && (0.0..=1.0).contains(&share) && (0.0..=length).contains(&place))
                .then_some(place)
        };
        let mut found: Vec<f64> = self.sides().filter_map(crossing).collect();
        found.sort_by(f64::total_cmp);
        found
    }
}

impl Outline for Polygon {
    fn comes_within(&self, q: DVec3, distance: f64) -> bool {
        self.nearest(plane(q)).0.distance(plane(q)) < distance
    }

    fn parts(&self, a: DVec3, b: DVec3) -> bool {
        let (a, way) = (plane(a), plane(b - a));
        way != DVec2::ZERO && !self.crossings(a, way.normalize(), way.length()).is_empty()
    }
}

impl Geometry for Polygon {
    fn name(&self) -> &'static str {
        "prism"
    }

    fn volume(&self) -> f64 {
        self.area * self.width
    }

    /// About y; a slice does not turn about the other axes.
    fn inertia(&self, mass: f64) -> DVec3 {
        let across = 0.5 * mass * (self.polar + self.width * self.width / 6.0);
        DVec3::new(across, mass * self.polar, across)
    }

    fn radius(&self) -> f64 {
        self.radius
    }

    fn is_convex(&self) -> bool {
        false
    }

    fn origin(&self) -> DVec3 {
        space(self.center)
    }

    fn reach(&self, n: DVec3) -> f64 {
        let most = self.corners.iter().map(|c| c.dot(plane(n))).fold(f64::NEG_INFINITY, f64::max);
        most + 0.5 * self.width * n.y.abs()
    }

    fn distance(&self, q: DVec3) -> (f64, DVec3) {
        let q = plane(q);
        let holds = self.holds(q);
        let (nearest, normal) = match &self.open {
            Some(open) if holds => nearest_of(open.iter().copied(), q),
            _ => self.nearest(q),
        };
        let (way, sign) = (q - nearest, if holds { -1.0 } else { 1.0 });
        let d = way.length();
        // On the outline itself.
        if d < 1e-12 * self.radius {
            return (0.0, space(normal));
        }
        (sign * d, space(sign * way / d))
    }

    fn depth(&self, q: DVec3, _: Faces) -> Option<Inside> {
        let (distance, outward) = self.distance(q);
        let inside = Inside { depth: -distance, outward, face: face(outward).trailing_zeros() as u8 };
        (distance < 0.0).then_some(inside)
    }

    fn axes(&self) -> Vec<DVec3> {
        vec![DVec3::X, DVec3::Z]
    }

    fn line_is_near(&self, start: DVec3, along: DVec3, length: f64, margin: f64) -> bool {
        let nearest = start + (-start.dot(along)).clamp(0.0, length) * along;
        plane(nearest).length() < self.radius + margin
    }

    fn nodes(&self, line: (DVec3, DVec3, f64), faces: Faces, _: f64, visit: &mut dyn FnMut(Node, Inside)) {
        let crossings = self.crossings(plane(line.0), plane(line.1), line.2);
        nodes_between(self, line, crossings, faces, visit);
    }

    fn corners(&self) -> Vec<DVec3> {
        self.corners.iter().copied().map(space).collect()
    }

    fn uncovered(&self, spacing: f64, covered: &dyn Fn(DVec3, DVec3) -> bool) -> Option<Shape> {
        self.with_open(spacing, covered).map(Shape::Polygon)
    }

    fn particles(&self, spacing: f64, _: u32, layers: i32) -> Particles {
        let mut out = Particles::default();
        let mut taken = PointCells::new(spacing);
        let thin = Thin::new(|x| self.distance(x), spacing, true);
        let evenly = |x| space(self.nearest_evenly(plane(x), areas::AS_NEAR * spacing));
        for layer in 0..layers {
            let depth = (f64::from(layer) + 0.5) * spacing;
            let mut stretches = self.layer(depth, spacing);
            if stretches.is_empty() {
                break;
            }
            stretches.sort_by(|a, b| b.length().total_cmp(&a.length()));
            for at in stretches.iter().flat_map(|s| s.divided(spacing)) {
                let at = space(at);
                let (distance, outward) = self.distance(at);
                if layer > 0 && thin.merges(at, (-distance, outward)) {
                    continue;
                }
                if taken.nearest(at, APART * spacing).is_none() {
                    taken.add(at);
                    out.add(layer, at, DVec3::ZERO, evenly(at) - at);
                }
            }
        }
        if out.wall.is_empty() {
            return out;
        }
        for layer in 1..layers {
            let above = f64::from(layer);
            let stretches = self.layer(above * spacing, spacing);
            let places = stretches.iter().flat_map(|s| s.divided(PIECE * spacing)).map(space);
            thin.fill(above, places, &taken, &mut out);
        }
        let depths = (0..).map(|k| 1.0 + 0.125 * f64::from(k)).take_while(|d| *d < f64::from(layers) - 0.5);
        let stretches = depths.flat_map(|depth| self.layer(depth * spacing, spacing));
        let places = stretches.flat_map(|s| s.divided(PIECE * spacing)).map(space);
        holes::fill(places, spacing, &mut out);
        let pieces = self.sides_in(PIECE * spacing);
        areas::share(&mut out, spacing, self.volume(), pieces, evenly);
        out
    }

    fn pieces(&self, spacing: f64) -> Option<Box<dyn Iterator<Item = Piece> + '_>> {
        Some(Box::new(self.sides_in(CUT * spacing)))
    }

    fn freed(&self, wall: &[DVec3], spacing: f64, free: &dyn Fn(DVec3, DVec3) -> bool) -> Option<Particles> {
        let pieces = self.sides_in(CUT * spacing).filter(|(at, area)| free(*at, area.normalize_or_zero()));
        let evenly = |x| space(self.nearest_evenly(plane(x), areas::AS_NEAR * spacing));
        Some(areas::of_some(wall, spacing, pieces, evenly))
    }

    /// Points alone, all of one weight, which sum to 1 over the side that has most of them.
    fn surface(&self, particles: &WallLayer, spacing: f64, _: u32) -> Surface {
        let above = particles.offset.iter().map(|&at| {
            let (distance, outward) = self.distance(at);
            (at - distance * outward, face(outward))
        });
        let (mut points, mut faces): (Vec<DVec3>, Vec<Faces>) = above.unzip();
        let mut corners: Vec<DVec3> = vec![];
        for (at, corner) in self.corners().into_iter().zip(&self.corners) {
            if corners.iter().all(|c| c.distance(at) > 0.4 * spacing) {
                corners.push(at);
                points.push(at);
                let of = self.sides().filter(|[a, b]| a == corner || b == corner);
                faces.push(of.map(|[a, b]| face(-space((b - a).perp()))).fold(0, |all, one| all | one));
            }
        }
        Surface::even(points, faces, PLANE_FACES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_take_no_side_wherever_the_section_begins() {
        let keel = [[-6.0, 3.0], [0.0, -3.0], [6.0, 3.0]];
        let square = [[-1.25, -1.25], [1.25, -1.25], [1.25, 1.25], [-1.25, 1.25]];
        for corners in [&keel[..], &square] {
            for begin in 0..corners.len() {
                let mut corners = corners.to_vec();
                corners.rotate_left(begin);
                let out = Polygon::new(&corners, 1.0).particles(1.0, 2, 2);
                for (k, x) in out.wall.iter().enumerate() {
                    let mirror = |v: DVec3| DVec3::new(-v.x, v.y, v.z);
                    let other =
                        out.wall.iter().position(|y| y.distance(mirror(*x)) < 1e-5).expect("a mirrored one");
                    let (area, way) = (out.area[k], out.to_surface[k]);
                    assert!(out.area[other].distance(mirror(area)) < 1e-5, "{x}: {area} {}", out.area[other]);
                    assert!(out.to_surface[other].distance(mirror(way)) < 1e-5, "{x}: {way}");
                }
            }
        }
    }
}
