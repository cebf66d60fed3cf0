//! Geometry of contact: oriented boxes seen from a point, surface points of bodies, edges of walls.

use super::edges::Line;
use crate::scene::{Scene, Shape, Solid};
use glam::{DMat3, DVec3};

/// Faces of a box: bit 2 k for the lower face of axis k, bit 2 k + 1 for the upper one.
pub(crate) type Faces = u8;
/// All six faces.
pub(crate) const ALL_FACES: Faces = 0b11_1111;

/// Where a point lies inside a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Inside {
    /// Depth [m].
    pub depth: f64,
    /// Minus the gradient of the depth: the outward normal of the nearest face, blended near edges.
    pub outward: DVec3,
    /// The nearest face.
    pub face: u8,
}

/// Depth of a point `q` in the frame of a box [m] below the nearest of `faces`; `None` outside. A point
/// under a face that is not in `faces` is still inside: it is pushed out through the faces that bodies
/// can reach.
///
/// Where two faces are nearly as near (b < 2 a) the depth is 0.2 a + 0.8 b - 0.2 b^2 / a instead of
/// their minimum a: the same up to the first derivative at b = 2 a, symmetric at b = a, so that the
/// force turns steadily where a body slides round an edge. With the bare minimum it jumps by 90
/// degrees there, and each jump costs or gives energy of first order in the time step.
#[inline]
pub(crate) fn depth(q: DVec3, half: DVec3, faces: Faces) -> Option<Inside> {
    let over = half - q.abs();
    let smallest = over.min_element();
    if smallest <= 0.0 {
        return None;
    }
    if faces == ALL_FACES {
        let near = over.cmplt(DVec3::splat(2.0 * smallest)).bitmask();
        if near.is_power_of_two() {
            let axis = near.trailing_zeros() as u8;
            let face = 2 * axis + u8::from(q[usize::from(axis)] > 0.0);
            return Some(Inside { depth: smallest, outward: face_normal(face), face });
        }
    } else if faces.is_power_of_two() {
        // a floor or the side of a tank
        let face = faces.trailing_zeros() as u8;
        let outward = face_normal(face);
        let depth = half[usize::from(face / 2)] - q.dot(outward);
        return Some(Inside { depth, outward, face });
    }
    blended(q, half, faces)
}

/// [`depth`] of a point inside, where more than one face may count.
fn blended(q: DVec3, half: DVec3, faces: Faces) -> Option<Inside> {
    let over = half - q.abs();
    let mut sign = [false; 3];
    let mut near = over;
    for k in 0..3 {
        let (low, high) = (1 << (2 * k), 1 << (2 * k + 1));
        sign[k] = q[k] > 0.0;
        if faces & (low | high) != low | high {
            sign[k] = faces & high != 0;
            let d = if sign[k] { half[k] - q[k] } else { half[k] + q[k] };
            near[k] = if faces & (low | high) == 0 { f64::INFINITY } else { d };
        }
    }
    let first = if near.x <= near.y && near.x <= near.z { 0 } else { 1 + usize::from(near.z < near.y) };
    let (mut second, mut third) = ((first + 1) % 3, (first + 2) % 3);
    if near[third] < near[second] {
        std::mem::swap(&mut second, &mut third);
    }
    let a = near[first];
    if a == f64::INFINITY {
        return None;
    }
    let toward = |k: usize| face_normal(2 * k as u8 + u8::from(sign[k]));
    let mut found =
        Inside { depth: a, outward: toward(first), face: 2 * first as u8 + u8::from(sign[first]) };
    for k in [second, third] {
        let (a, b) = (found.depth, near[k]);
        if b < 2.0 * a {
            found.depth = 0.2 * a + 0.8 * b - 0.2 * b * b / a;
            found.outward = (0.2 + 0.2 * b * b / (a * a)) * found.outward + (0.8 - 0.4 * b / a) * toward(k);
        }
    }
    Some(found)
}

/// Outward normal of a face in the box's frame.
#[inline]
pub(crate) fn face_normal(face: u8) -> DVec3 {
    const NORMALS: [DVec3; 6] = [DVec3::NEG_X, DVec3::X, DVec3::NEG_Y, DVec3::Y, DVec3::NEG_Z, DVec3::Z];
    NORMALS[usize::from(face)]
}

/// Largest distance of `q` beyond a face plane of the box [m]: a lower bound of its distance.
#[inline]
pub(crate) fn outside(q: DVec3, half: DVec3) -> f64 {
    (q.abs() - half).max_element()
}

/// A fixed wall as contact sees it.
#[derive(Clone, Debug)]
pub(crate) struct WallBox {
    pub center: DVec3,
    pub axes: DMat3,
    pub half: DVec3,
    /// Faces that bodies can reach.
    pub faces: Faces,
    /// Edges that bodies can reach.
    pub edges: Vec<Line>,
    /// Corners that bodies can reach, world [m].
    pub corners: Vec<DVec3>,
}

/// The walls of a scene. A face can be reached if wall particles that face the free space lie under
/// it; a box without any wall particle (hand-built scenes) shows all its faces.
pub(crate) fn walls(scene: &Scene) -> Vec<WallBox> {
    let spacing = scene.spacing;
    let range = scene.groups.static_wall_range();
    let particles = || scene.position[range.clone()].iter().zip(&scene.static_wall_normal);
    let flat: Faces = if scene.dimensions == 2 { 0b11_0011 } else { ALL_FACES };
    let mut walls: Vec<WallBox> = scene
        .walls
        .iter()
        .map(|wall| {
            let to_box = wall.axes.transpose();
            let mut faces: Faces = 0;
            let mut found = false;
            for (&x, &n) in particles() {
                let q = to_box * (x - wall.center);
                if outside(q, wall.half) > -0.25 * spacing {
                    continue;
                }
                found = true;
                let n = to_box * n;
                for face in 0..6 {
                    let outward = face_normal(face);
                    let below = wall.half[usize::from(face / 2)] - q.dot(outward);
                    if below < 0.75 * spacing && n.dot(outward) > 0.5 {
                        faces |= 1 << face;
                    }
                }
            }
            let faces = if found { faces } else { ALL_FACES } & flat;
            WallBox {
                center: wall.center,
                axes: wall.axes,
                half: wall.half,
                faces,
                edges: vec![],
                corners: vec![],
            }
        })
        .collect();
    for k in 0..walls.len() {
        let (edges, corners) = wall_edges(&walls, k, spacing, scene.dimensions == 2);
        (walls[k].edges, walls[k].corners) = (edges, corners);
    }
    walls
}

/// Edges between two reachable faces of wall `k` and corners between three, unless another wall covers
/// them. A body's face has points every spacing, so it could sink on an edge that lies between them. In
/// two dimensions edges are seen end on and are the corners.
fn wall_edges(walls: &[WallBox], k: usize, spacing: f64, flat: bool) -> (Vec<Line>, Vec<DVec3>) {
    let wall = &walls[k];
    let bit = |axis: usize, side: f64| 1 << (2 * axis as u8 + u8::from(side > 0.0));
    // what leans on another wall is no edge of the union
    let covered = |at: DVec3, out: DVec3| {
        let world = wall.center + wall.axes * (at + 1e-3 * spacing * out);
        walls.iter().enumerate().any(|(other, w)| {
            other != k && outside(w.axes.transpose() * (world - w.center), w.half) < 2e-3 * spacing
        })
    };
    let (mut edges, mut corners) = (vec![], vec![]);
    for along in 0..3_usize {
        let (u, v) = ((along + 1) % 3, (along + 2) % 3);
        for (su, sv) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            if wall.faces & bit(u, su) == 0 || wall.faces & bit(v, sv) == 0 || flat && along != 1 {
                continue;
            }
            let out = su * DVec3::AXES[u] + sv * DVec3::AXES[v];
            let middle = out * wall.half;
            if covered(middle, out) {
                continue;
            }
            let axis = DVec3::AXES[along];
            if flat {
                corners.push(wall.center + wall.axes * middle);
                continue;
            }
            edges.push(Line {
                start: wall.center + wall.axes * (middle - axis * wall.half),
                along: wall.axes * axis,
                length: 2.0 * wall.half[along],
                density: 0.0,
            });
        }
    }
    for corner in 0..if flat { 0 } else { 8 } {
        let side = |axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
        let out = DVec3::new(side(0), side(1), side(2));
        if (0..3).all(|axis| wall.faces & bit(axis, side(axis)) != 0) && !covered(out * wall.half, out) {
            corners.push(wall.center + wall.axes * (out * wall.half));
        }
    }
    (edges, corners)
}

/// The surface of a body as contact sees it: points on the true surface and edges, with constant weights.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surface {
    /// Points inside the faces and at the corners, body's frame [m].
    pub points: Vec<DVec3>,
    /// Weight of each point [-]; those of a face and its edges sum to 1 (exactly for a cube).
    pub weights: Vec<f64>,
    /// For each point, the faces it lies on.
    pub faces: Vec<Faces>,
    /// Edges, body's frame; none in two dimensions.
    pub edges: Vec<Line>,
    /// For each edge, the faces it lies between.
    edge_faces: Vec<Faces>,
    /// Faces of the body that others can touch.
    pub all_faces: Faces,
    /// Smallest weight of a surface particle [-].
    pub smallest_weight: f64,
}

impl Surface {
    /// The surface of `solid`. A point on several faces gets the mean of its shares of them: constant
    /// weights are what makes the law conservative, so they may not depend on the face that touches.
    /// What the particles along an edge would weigh is spread over its length.
    pub fn new(solid: &Solid, dimensions: u32) -> Self {
        let points: Vec<DVec3> =
            solid.wall_offset.iter().zip(&solid.wall_to_surface).map(|(o, s)| *o + *s).collect();
        let faces: Vec<Faces> = solid
            .wall_to_surface
            .iter()
            .map(|s| {
                (0..3).fold(0, |bits, k| match s[k] {
                    c if c > 0.0 => bits | 1 << (2 * k + 1),
                    c if c < 0.0 => bits | 1 << (2 * k),
                    _ => bits,
                })
            })
            .collect();
        let on = |face: u8| faces.iter().filter(|f| *f & (1 << face) != 0).count();
        let share: Vec<f64> = (0..6).map(|face| 1.0 / on(face).max(1) as f64).collect();
        let weights: Vec<f64> = faces
            .iter()
            .map(|f| {
                let mine: Vec<f64> = (0..6).filter(|k| f & (1 << k) != 0).map(|k| share[k]).collect();
                mine.iter().sum::<f64>() / mine.len().max(1) as f64
            })
            .collect();
        let all_faces = if dimensions == 2 { 0b11_0011 } else { ALL_FACES };
        let smallest_weight = weights.iter().copied().fold(1.0, f64::min);
        let mut surface = Self { points, weights, faces, all_faces, smallest_weight, ..Self::default() };
        if dimensions == 3 {
            let Shape::Box { half } = solid.shape;
            surface.spread_edges(half);
        }
        surface.balance();
        surface.normalise();
        surface
    }

    /// Second moment of the weights of all faces over that of an even pressure, in the mean, with the
    /// border's weights times `border`.
    fn moment(samples: &[(DVec3, f64, Faces)], border: f64) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for face in 0..6_u8 {
            let on = samples.iter().filter(|s| s.2 & (1 << face) != 0);
            let on: Vec<(DVec3, f64)> =
                on.map(|s| (s.0, if s.2.count_ones() > 1 { border * s.1 } else { s.1 })).collect();
            if samples.iter().all(|s| s.2 & (1 << face) == 0 || s.2.count_ones() > 1) {
                continue; // all border: nothing to balance it with
            }
            let all: f64 = on.iter().map(|s| s.1).sum();
            let axis = usize::from(face / 2);
            for other in [(axis + 1) % 3, (axis + 2) % 3] {
                let half = on.iter().map(|s| s.0[other].abs()).fold(0.0, f64::max);
                let second: f64 = on.iter().map(|s| s.1 * s.0[other].powi(2)).sum();
                if half > 0.0 {
                    sum += 3.0 * second / (all * half * half);
                    count += 1.0;
                }
            }
        }
        if count > 0.0 { sum / count } else { 1.0 }
    }

    /// Makes edges and corners light enough that a face rocks, and its friction resists a spin, like an
    /// even pressure: particles stand for cells, whose outermost have been moved to the border.
    fn balance(&mut self) {
        let samples = self.samples();
        if samples.iter().all(|s| s.2.count_ones() > 1) {
            return;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if Self::moment(&samples, middle) < 1.0 { low = middle } else { high = middle }
        }
        let border = self.faces.iter().map(|f| f.count_ones() > 1);
        self.weights.iter_mut().zip(border).filter(|(_, b)| *b).for_each(|(w, _)| *w *= high);
        self.edges.iter_mut().for_each(|e| e.density *= high);
        self.smallest_weight *= high;
    }

    /// Turns the points along each edge into a line of their weight.
    fn spread_edges(&mut self, half: DVec3) {
        for along in 0..3_usize {
            let (u, v) = ((along + 1) % 3, (along + 2) % 3);
            for (su, sv) in [(0_u8, 0_u8), (0, 1), (1, 0), (1, 1)] {
                let both: Faces = 1 << (2 * u as u8 + su) | 1 << (2 * v as u8 + sv);
                let own = self.faces.iter().zip(&self.weights).filter(|(f, _)| **f == both);
                let mut weight: f64 = own.map(|(_, w)| w).sum();
                if weight == 0.0 {
                    // two particles along it: both are corners
                    let corners = self.faces.iter().zip(&self.weights).filter(|(f, _)| **f & both == both);
                    weight = corners.map(|(_, w)| w / 6.0).sum();
                }
                let sign = |side: u8| if side == 1 { 1.0 } else { -1.0 };
                let mut start = -half;
                start[u] *= -sign(su);
                start[v] *= -sign(sv);
                let length = 2.0 * half[along];
                let line = Line { start, along: DVec3::AXES[along], length, density: weight / length };
                self.edges.push(line);
                self.edge_faces.push(both);
            }
        }
        let inner = |f: &Faces| f.count_ones() != 2;
        let mut kept = self.faces.iter().map(inner);
        self.points.retain(|_| kept.next().unwrap_or(true));
        let mut kept = self.faces.iter().map(inner);
        self.weights.retain(|_| kept.next().unwrap_or(true));
        self.faces.retain(inner);
    }

    /// Brings the mean over the faces of their weight to 1: it is off for boxes that are no cubes.
    fn normalise(&mut self) {
        let samples = self.samples();
        let sums =
            (0..6_u8).map(|face| samples.iter().filter(|s| s.2 & (1 << face) != 0).map(|s| s.1).sum::<f64>());
        let sums: Vec<f64> = sums.filter(|s| *s > 0.0).collect();
        let mean = sums.iter().sum::<f64>() / sums.len().max(1) as f64;
        if mean > 0.0 {
            self.weights.iter_mut().for_each(|w| *w /= mean);
            self.edges.iter_mut().for_each(|e| e.density /= mean);
            self.smallest_weight /= mean;
        }
    }

    /// Points with their weights and faces, and for each edge two that have its weight, centre and
    /// second moment.
    pub fn samples(&self) -> Vec<(DVec3, f64, Faces)> {
        let points = self.points.iter().zip(&self.weights).zip(&self.faces).map(|((p, w), f)| (*p, *w, *f));
        let edges = self.edges.iter().zip(&self.edge_faces).flat_map(|(e, f)| {
            [-1.0, 1.0].map(|side: f64| {
                let s = e.length * (0.5 + side / 12.0_f64.sqrt());
                (e.start + s * e.along, 0.5 * e.density * e.length, *f)
            })
        });
        points.chain(edges).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_depth_is_continuous_and_its_gradient_is_the_normal() {
        let half = DVec3::new(1.0, 0.7, 0.5);
        let at = |q: DVec3| depth(q, half, ALL_FACES).unwrap();
        let (h, mut blended) = (1e-6, 0);
        for k in 0..2000 {
            let f = |n: f64| (f64::from(k) * n).fract();
            let q =
                DVec3::new(0.99 - 0.3 * f(0.618_034), 0.69 - 0.3 * f(0.754_877), -0.49 + 0.2 * f(0.569_84));
            let here = at(q);
            blended += usize::from(here.outward.abs().max_element() < 0.99);
            let slope = DVec3::AXES.map(|e| (at(q - h * e).depth - at(q + h * e).depth) / (2.0 * h));
            // three faces within a factor of two of each other keep a kink where the outer two swap
            if (DVec3::from_array(slope) - here.outward).length() > 1e-3 {
                let over = half - q.abs();
                assert!(over.max_element() < 2.5 * over.min_element(), "{q} {slope:?} {here:?}");
            }
        }
        assert!(blended > 200);
    }

    #[test]
    fn a_point_under_a_hidden_face_is_pushed_through_a_reachable_one() {
        let half = DVec3::ONE;
        let found = depth(DVec3::new(0.0, 0.0, -0.9), half, 0b10_0000).unwrap();
        assert_eq!((found.outward, found.face), (DVec3::Z, 5));
        assert!((found.depth - 1.9).abs() < 1e-15);
        assert_eq!(depth(DVec3::ZERO, half, 0), None);
    }
}
