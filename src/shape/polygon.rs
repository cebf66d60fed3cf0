//! A slice of any section in the plane y = 0: the prism and the wedge of two dimensions. It has no ends.
//!
//! Particles stand in layers half a spacing, one and a half and so on below its sides. A layer is the outline moved inwards: sides
//! shrink to where they meet inside a corner, and an arc closes them round a notch. What of it goes on smoothly is divided evenly.

use super::cells::Cells;
use super::surface::Surface;
use super::{Faces, Geometry, Inside, Node, PLANE_FACES, Particles, WallLayer, close, face, nodes_between};
use glam::{DVec2, DVec3};
use std::sync::Mutex;

/// A layer goes on smoothly where it turns by less [rad].
const SMOOTH: f64 = 0.35;
/// Particles stand at least so far apart, over the spacing.
const APART: f64 = 0.6;
/// A layer is looked for in steps of so much, over the spacing.
const STEP: f64 = 0.05;
/// Pieces of a side that go to the nearest particle each, over the spacing.
const PIECE: f64 = 0.1;

/// A closed line of straight sides in the plane y = 0, and what it encloses.
#[derive(Debug)]
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
}

/// A polygon is made once for all solids, scenes and runs of a program that have it, and kept: the corners as they were given.
static MADE: Mutex<Vec<(Vec<DVec2>, &'static Polygon)>> = Mutex::new(Vec::new());

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

/// A stretch of a layer: points close to each other, and its directions at both ends.
struct Stretch {
    points: Vec<DVec2>,
    ways: [DVec2; 2],
}

impl Polygon {
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
        }
    }

    /// Its centroid in the coordinates that it was given in [m].
    pub fn center(&self) -> DVec3 {
        space(self.center)
    }

    /// Its corners [m].
    pub(crate) fn corners(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.corners.iter().copied().map(space)
    }

    /// Where it is thinnest: the shortest way from the middle of a side inwards to another one [m], and that middle, in the coordinates
    /// that it was given in [m].
    pub(crate) fn thinnest(&self) -> (f64, DVec3) {
        let ways = self.sides().map(|[a, b]| {
            let (middle, inwards) = (0.5 * (a + b), (b - a).normalize().perp());
            let start = middle + 1e-9 * self.radius * inwards;
            let way = self.crossings(start, inwards, 4.0 * self.radius).first().copied();
            (way.unwrap_or(f64::INFINITY), space(middle + self.center))
        });
        ways.fold((f64::INFINITY, DVec3::ZERO), |least, way| if way.0 < least.0 { way } else { least })
    }

    fn sides(&self) -> impl Iterator<Item = [DVec2; 2]> + '_ {
        sides_of(&self.corners)
    }

    /// The nearest point of the outline, and its side's normal.
    fn nearest(&self, q: DVec2) -> (DVec2, DVec2) {
        let on = self.sides().map(|[a, b]| {
            let way = b - a;
            let share = ((q - a).dot(way) / way.length_squared()).clamp(0.0, 1.0);
            (a + share * way, -way.normalize().perp())
        });
        let nearer = |one: (DVec2, DVec2), other: (DVec2, DVec2)| {
            if other.0.distance_squared(q) < one.0.distance_squared(q) { other } else { one }
        };
        on.reduce(nearer).unwrap_or_default()
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

    /// The stretches of the layer at `depth` [m] in the order of the outline.
    fn layer(&self, depth: f64, spacing: f64) -> Vec<Stretch> {
        let mut out = vec![];
        let n = self.corners.len();
        for k in 0..n {
            let [a, b, next] = [0, 1, 2].map(|j| self.corners[(k + j) % n]);
            let (way, length) = ((b - a).normalize(), a.distance(b));
            self.stretches(depth, spacing, length, &|s| (a + s * way + depth * way.perp(), way), &mut out);
            let turn = way.angle_to(next - b);
            if turn < 0.0 {
                // Round a notch.
                let arc = |s: f64| {
                    let way = DVec2::from_angle(-s / depth).rotate(way);
                    (b + depth * way.perp(), way)
                };
                self.stretches(depth, spacing, -turn * depth, &arc, &mut out);
            }
        }
        out
    }

    /// What of a line, which `at` describes by place and direction over its `length` [m], is nowhere nearer to the outline than `depth` [m].
    fn stretches(
        &self,
        depth: f64,
        spacing: f64,
        length: f64,
        at: &dyn Fn(f64) -> (DVec2, DVec2),
        out: &mut Vec<Stretch>,
    ) {
        let held = |s: f64| self.depth_at(at(s).0) > depth * (1.0 - 1e-6);
        let steps = (length / (STEP * spacing)).ceil().max(1.0) as usize;
        let place = |k: usize| length * k as f64 / steps as f64;
        // Where between a place that is held and one that is not it ends.
        let end = |mut inside: f64, mut beyond: f64| {
            for _ in 0..40 {
                let middle = 0.5 * (inside + beyond);
                *(if held(middle) { &mut inside } else { &mut beyond }) = middle;
            }
            inside
        };
        let on: Vec<bool> = (0..=steps).map(|k| held(place(k))).collect();
        let mut k = 0;
        while k <= steps {
            if !on[k] {
                k += 1;
                continue;
            }
            let first = k;
            while k < steps && on[k + 1] {
                k += 1;
            }
            let from = if first == 0 { 0.0 } else { end(place(first), place(first - 1)) };
            let to = if k == steps { length } else { end(place(k), place(k + 1)) };
            let inner = (first..=k).map(place).filter(|&s| s > from && s < to);
            let places: Vec<f64> = [from].into_iter().chain(inner).chain([to]).collect();
            let points = places.iter().map(|&s| at(s).0).collect();
            out.push(Stretch { points, ways: [at(from).1, at(to).1] });
            k += 1;
        }
    }
}

/// Joins stretches that go on smoothly, the last with the first as well.
fn joined(stretches: Vec<Stretch>, spacing: f64) -> Vec<Stretch> {
    let goes_on = |one: &Stretch, next: &Stretch| {
        let gap = one.points.last().zip(next.points.first()).map_or(f64::INFINITY, |(a, b)| a.distance(*b));
        gap < 1e-6 * spacing && one.ways[1].angle_to(next.ways[0]).abs() < SMOOTH
    };
    let mut out: Vec<Stretch> = vec![];
    for next in stretches {
        match out.last_mut() {
            Some(last) if goes_on(last, &next) => {
                last.points.extend_from_slice(&next.points);
                last.ways[1] = next.ways[1];
            }
            _ => out.push(next),
        }
    }
    if out.len() > 1
        && goes_on(&out[out.len() - 1], &out[0])
        && let Some(last) = out.pop()
    {
        out[0].points.splice(0..0, last.points);
        out[0].ways[0] = last.ways[0];
    }
    out
}

impl Stretch {
    fn length(&self) -> f64 {
        self.points.windows(2).map(|p| p[0].distance(p[1])).sum()
    }

    /// Places about `spacing` [m] apart along it, its ends among them.
    fn divided(&self, spacing: f64) -> Vec<DVec2> {
        let length = self.length();
        let count = (length / spacing).round().max(1.0);
        let mut out = vec![self.points[0]];
        let mut gone = 0.0;
        for p in self.points.windows(2) {
            let step = p[0].distance(p[1]);
            while out.len() as f64 * length / count <= gone + step && (out.len() as f64) < count {
                let share = (out.len() as f64 * length / count - gone) / step;
                out.push(p[0].lerp(p[1], share));
            }
            gone += step;
        }
        out.extend(self.points.last());
        out
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

    fn reach(&self, n: DVec3) -> f64 {
        let most = self.corners.iter().map(|c| c.dot(plane(n))).fold(f64::NEG_INFINITY, f64::max);
        most + 0.5 * self.width * n.y.abs()
    }

    fn distance(&self, q: DVec3) -> (f64, DVec3) {
        let q = plane(q);
        let (nearest, normal) = self.nearest(q);
        let (way, sign) = (q - nearest, if self.holds(q) { -1.0 } else { 1.0 });
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

    fn particles(&self, spacing: f64, _: u32, layers: i32) -> Particles {
        let mut out = Particles::default();
        let mut taken = Cells::new(spacing);
        for layer in 0..layers {
            let depth = (f64::from(layer) + 0.5) * spacing;
            let mut stretches = joined(self.layer(depth, spacing), spacing);
            if stretches.is_empty() {
                break;
            }
            stretches.sort_by(|a, b| b.length().total_cmp(&a.length()));
            for at in stretches.iter().flat_map(|s| s.divided(spacing)) {
                let at = space(at);
                if taken.nearest(at, APART * spacing).is_none() {
                    taken.add(at);
                    let (distance, outward) = self.distance(at);
                    out.add(layer, at, DVec3::ZERO, -distance * outward);
                }
            }
        }
        if out.wall.is_empty() {
            return out;
        }
        let mut wall = Cells::new(spacing);
        out.wall.iter().for_each(|&at| wall.add(at));
        for [a, b] in self.sides() {
            let pieces = (a.distance(b) / (PIECE * spacing)).ceil().max(1.0);
            let area = -(b - a).perp() * self.width / pieces;
            for k in 0..pieces as usize {
                let nearest = wall.nearest_of_all(space(a.lerp(b, (k as f64 + 0.5) / pieces)));
                out.area[nearest] += space(area);
            }
        }
        close(&mut out, self.volume());
        out
    }

    /// Points alone, all of one weight, which sum to 1 over the side that has most of them.
    fn surface(&self, particles: &WallLayer, spacing: f64, _: u32) -> Surface {
        let above = particles.offset.iter().zip(particles.to_surface);
        let mut points: Vec<DVec3> = above.map(|(at, to_surface)| *at + *to_surface).collect();
        let mut faces: Vec<Faces> = particles.to_surface.iter().map(|&s| face(s)).collect();
        let mut corners: Vec<DVec3> = vec![];
        for (at, corner) in self.corners().zip(&self.corners) {
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
