//! The surface of a box: points at its particles, edges, and weights that make a face rock like an even pressure.

use super::super::surface::{Line, Surface};
use super::super::{Faces, PLANE_FACES, WallLayer};
use super::ALL_FACES;
use glam::{DMat2, DVec2, DVec3};

/// Second moments, over the weight of a face, that are not worth making up for.
const LACKS: f64 = 1e-9;
/// Share of its weight that a point keeps.
const LEAST: f64 = 0.2;

/// Points inside of the faces that have none, with their faces: halfway between the two rows of particles that such a face is wide, in
/// its middle if it is no longer than that. With its border alone it would go unseen through another of the same width: points on the
/// border of the other's face are in line with its sides, where no depth is.
fn between_rows(points: &[DVec3], faces: &[Faces]) -> (Vec<DVec3>, Vec<Faces>) {
    let mut found = vec![];
    for face in 0..6_u8 {
        let on: Vec<_> = points.iter().zip(faces).filter(|(_, f)| *f & (1 << face) != 0).collect();
        let fewest = on.iter().map(|(_, f)| f.count_ones()).min().unwrap_or(1);
        for &(p, f) in on.iter().filter(|(_, f)| fewest > 1 && f.count_ones() == fewest) {
            let is_row = |axis: u8| axis == face / 2 || f >> (2 * axis) & 3 == 0;
            let at = DVec3::from_array([0, 1, 2].map(|k| if is_row(k) { p[usize::from(k)] } else { 0.0 }));
            if !found.contains(&(at, 1 << face)) {
                found.push((at, 1 << face));
            }
        }
    }
    found.into_iter().unzip()
}

impl Surface {
    /// The surface of a box of half edges `half` [m]. A point on several faces gets the mean of its shares of them: constant
    /// weights are what makes the law conservative, so they may not depend on the face that touches.
    /// What the particles along an edge would weigh is spread over its length.
    pub fn cuboid(half: DVec3, wall: &WallLayer, dimensions: u32) -> Self {
        let mut points: Vec<DVec3> = wall.offset.iter().zip(wall.to_surface).map(|(o, s)| *o + *s).collect();
        let mut faces: Vec<Faces> = wall
            .to_surface
            .iter()
            .map(|s| {
                (0..3).fold(0, |bits, k| match s[k] {
                    c if c > 0.0 => bits | 1 << (2 * k + 1),
                    c if c < 0.0 => bits | 1 << (2 * k),
                    _ => bits,
                })
            })
            .collect();
        let (inner, of) = between_rows(&points, &faces);
        points.extend(inner);
        faces.extend(of);
        let on = |face: u8| faces.iter().filter(|f| *f & (1 << face) != 0).count();
        let share: Vec<f64> = (0..6).map(|face| 1.0 / on(face).max(1) as f64).collect();
        let weights: Vec<f64> = faces
            .iter()
            .map(|f| {
                let mine: Vec<f64> = (0..6).filter(|k| f & (1 << k) != 0).map(|k| share[k]).collect();
                mine.iter().sum::<f64>() / mine.len().max(1) as f64
            })
            .collect();
        let all_faces = if dimensions == 2 { PLANE_FACES } else { ALL_FACES };
        let smallest_weight = weights.iter().copied().fold(1.0, f64::min);
        let mut surface = Self { points, weights, faces, all_faces, smallest_weight, ..Self::default() };
        if dimensions == 3 {
            surface.spread_edges(half);
        }
        surface.balance();
        if dimensions == 3 {
            surface.even_out(half);
        }
        surface.normalise();
        surface
    }

    /// Second moment of the weights of all faces over that of an even pressure, in the mean, with the
    /// border's weights times `border`, along what ends in a border; `None` if nothing does, as where the faces beside are open.
    fn moment(samples: &[(DVec3, f64, Faces)], border: f64) -> Option<f64> {
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
                let beside: Faces = 3 << (2 * other);
                let is_border =
                    |s: &(DVec3, f64, Faces)| s.1 > 0.0 && s.2 & 1 << face != 0 && s.2 & beside != 0;
                if !samples.iter().any(is_border) {
                    continue;
                }
                let half = on.iter().map(|s| s.0[other].abs()).fold(0.0, f64::max);
                let second: f64 = on.iter().map(|s| s.1 * s.0[other].powi(2)).sum();
                if half > 0.0 {
                    sum += 3.0 * second / (all * half * half);
                    count += 1.0;
                }
            }
        }
        (count > 0.0).then(|| sum / count)
    }

    /// Makes edges and corners light enough that a face rocks, and its friction resists a spin, like an
    /// even pressure: particles stand for cells, whose outermost have been moved to the border.
    fn balance(&mut self) {
        let samples = self.samples();
        if Self::moment(&samples, 1.0).is_none() {
            return;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            let is_light = Self::moment(&samples, middle).is_some_and(|moment| moment < 1.0);
            if is_light { low = middle } else { high = middle }
        }
        let border = self.faces.iter().map(|f| f.count_ones() > 1);
        self.weights.iter_mut().zip(border).filter(|(_, b)| *b).for_each(|(w, _)| *w *= high);
        self.edges.iter_mut().for_each(|e| e.density *= high);
        self.smallest_weight *= high;
    }

    /// Lets the points inside of each face make up for what its border lacks: the second moments of every face become those
    /// of an even pressure of its weight, along both edges, where points in two rows or more can. The border is shared
    /// by faces of different proportions, which its weights cannot all suit.
    fn even_out(&mut self, half: DVec3) {
        let samples = self.samples();
        for face in 0..6_u8 {
            let axis = usize::from(face / 2);
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            // an even pressure has no mean of these
            let terms = |p: DVec3| DVec2::new(p[u] / half[u], p[v] / half[v]).powf(2.0) - 1.0 / 3.0;
            let on: Vec<_> = samples.iter().filter(|s| s.2 & (1 << face) != 0).collect();
            let (all, lacks) =
                (on.iter().map(|s| s.1).sum::<f64>(), on.iter().map(|s| -s.1 * terms(s.0)).sum::<DVec2>());
            let inner: Vec<usize> = (0..self.points.len()).filter(|&k| self.faces[k] == 1 << face).collect();
            if inner.is_empty() || lacks.abs().max_element() < LACKS * all {
                continue;
            }
            // weights that change as little as possible: combinations of the terms; one row of points has but one
            let column = |k: usize| inner.iter().map(|&n| terms(self.points[n])).map(|t| t * t[k]).sum();
            let gram = DMat2::from_cols(column(0), column(1));
            let least = LACKS * (gram.x_axis.x + gram.y_axis.y);
            let slope = (gram + DMat2::from_diagonal(DVec2::splat(least))).inverse() * lacks;
            let change = |n: usize| slope.dot(terms(self.points[n]));
            let allowed = |n: usize| (LEAST - 1.0) * self.weights[n] / change(n).min(-f64::MIN_POSITIVE);
            let share = inner.iter().map(|&n| allowed(n)).fold(1.0, f64::min);
            let changes: Vec<(usize, f64)> = inner.iter().map(|&n| (n, share * change(n))).collect();
            changes.into_iter().for_each(|(n, change)| self.weights[n] += change);
        }
        self.smallest_weight = self.weights.iter().copied().fold(self.smallest_weight, f64::min);
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
}

#[cfg(test)]
mod tests {
    use super::super::super::Geometry;
    use super::super::Cuboid;
    use super::*;

    #[test]
    fn a_plate_of_two_faces_alone_has_nothing_to_balance() {
        let (n, l0) = (10, 0.1);
        let half = DVec3::new(0.2, 0.5 * l0, 0.5 * f64::from(n) * l0);
        let (mut offset, mut to_surface) = (vec![], vec![]);
        for side in [-1.0, 1.0] {
            for k in 0..n {
                let z = (f64::from(k) + 0.5) * l0 - half.z;
                offset.push(DVec3::new(side * (half.x - 0.5 * l0), 0.0, z));
                to_surface.push(DVec3::new(side * 0.5 * l0, 0.0, 0.0));
            }
        }
        for dimensions in [2, 3] {
            let surface =
                Surface::cuboid(half, &WallLayer { offset: &offset, to_surface: &to_surface }, dimensions);
            assert!(
                (surface.smallest_weight - 0.1).abs() < 0.05,
                "{dimensions}: {}",
                surface.smallest_weight
            );
            let all: f64 = surface.weights.iter().sum();
            assert!((all - 2.0).abs() < 1e-12, "{dimensions}: {all}");
        }
    }

    #[test]
    fn every_face_has_points_inside_of_it_and_rocks_like_an_even_pressure() {
        let l0 = 0.01;
        for size in [
            [1.0, 1.0, 1.0],
            [2.0, 2.0, 2.0],
            [2.4, 2.4, 2.4],
            [2.0, 2.0, 10.0],
            [10.0, 10.0, 2.0],
            [2.0, 4.0, 8.0],
        ] {
            for dimensions in [2, 3] {
                let cuboid = Cuboid { half: 0.5 * l0 * DVec3::from(size) };
                let all = cuboid.particles(l0, dimensions, 3);
                let surface = cuboid.surface(
                    &WallLayer { offset: &all.wall, to_surface: &all.to_surface },
                    l0,
                    dimensions,
                );
                let samples = surface.samples();
                for face in (0..6_u8).filter(|face| surface.all_faces >> face & 1 == 1) {
                    let inside = surface.faces.iter().filter(|f| **f == 1 << face).count();
                    let on = samples.iter().filter(|s| s.2 >> face & 1 == 1);
                    let sum: f64 = on.clone().map(|s| s.1).sum();
                    let axis = usize::from(face / 2);
                    let second = |k: usize| {
                        on.clone().map(|s| s.1 * (s.0[k] / cuboid.half[k]).powi(2)).sum::<f64>() / sum
                    };
                    let even =
                        [1, 2].map(|n| (axis + n) % 3).into_iter().filter(|&k| dimensions == 3 || k != 1);
                    let off = even.map(|k| (3.0 * second(k) - 1.0).abs()).fold(0.0, f64::max);
                    let at = format!("{size:?} {dimensions}D face {face}: {inside} weigh {sum}, {off} off");
                    // the border is shared by faces of different proportions
                    let cube = size[0] == size[1] && size[1] == size[2];
                    assert!(inside > 0 && off < if cube { 1e-9 } else { 0.12 }, "{at}");
                    assert!(if cube { (sum - 1.0).abs() < 1e-9 } else { sum > 0.5 && sum < 1.6 }, "{at}");
                }
            }
        }
    }
}
