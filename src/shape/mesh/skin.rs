//! Layers below a surface of flat faces and sharp edges.
//!
//! A layer is the surface moved inwards by its depth: faces shrink to where they meet inside an edge, and open along a fold, where an arc
//! closes the gap. It takes one particle for each square of the spacing. Those of a large flat face stand on a lattice along
//! its edges, smooth for the water that slides past. What the lattices leave is filled from many candidates, the most crowded of which are
//! taken out until as many are left as belong there (weighted sample elimination, after Yuksel 2015, Comput. Graph. Forum 34).

use super::super::APART;
use super::super::cells::PointCells;
use super::super::nearest::Nearest;
use super::Mesh;
use super::particles::Place;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::{BinaryHeap, HashMap, HashSet};

/// Candidates for each particle.
const CANDIDATES: f64 = 12.0;
/// Triangles are of one face if their normals differ by no more [rad] and their corners are off its plane by no more, over the spacing.
const FLAT: f64 = 0.02;
/// A face has a lattice if twice its area over its perimeter is more, over the spacing.
const LARGE: f64 = 2.0;
/// Particles of two lattices stand at least so far apart, over the spacing.
const LATTICES_APART: f64 = 0.72;
/// A lattice is stretched between two edges by no more.
const STRETCH: f64 = 0.1;
/// Within this of a lattice's particle, over the spacing, no other one is wanted.
const CLAIMED: f64 = 0.5;
/// The same of one of the lattice that fills the mesh: all of what is nearest to it.
const CLAIMED_ROUGHLY: f64 = 0.65;
/// Places of that lattice that come so close are one, over the spacing; others are pushed apart.
const SAME: f64 = 0.25;
/// Between two faces is what is nearer to one of them by no more, over the spacing.
const BETWEEN: f64 = 1e-4;
/// Distance of two neighbours on a hexagonal lattice of one particle for each square of the spacing, over the spacing.
const HEXAGONAL: f64 = 1.0746;

/// An edge at the border of a face.
struct Border {
    ends: [DVec3; 2],
    /// In the face's plane, away from it.
    outward: DVec3,
    /// Angle from its normal to that of the face beyond [rad]: positive at a convex edge.
    turn: f64,
}

/// Triangles in a plane that hang together.
struct Face {
    normal: DVec3,
    at: DVec3,
    area: f64,
    border: Vec<Border>,
}

/// Where the layer opens: a fold between two faces, or a corner between more. Normals of the surface on its way round, in
/// triangles; of a fold two of the three are one.
struct Gap {
    ends: [DVec3; 2],
    normals: [DVec3; 3],
}

/// A mesh seen as faces.
pub(super) struct Skin<'a> {
    mesh: &'a Mesh,
    spacing: f64,
    /// Face and normal of each triangle.
    of: Vec<(usize, DVec3)>,
    faces: Vec<Face>,
    gaps: Vec<Gap>,
    corners: Nearest<3>,
}

/// Places of a lattice in the plane of a face: `start` + k `step` along two axes [m].
struct Lattice {
    axes: [DVec3; 2],
    start: [f64; 2],
    step: [f64; 2],
    count: [i32; 2],
    /// Those at which the layer is.
    held: HashSet<[i32; 2]>,
}

impl Lattice {
    /// The place that `x` is nearest to.
    fn nearest(&self, x: DVec3) -> [i32; 2] {
        [0, 1].map(|k| ((x.dot(self.axes[k]) - self.start[k]) / self.step[k]).round() as i32)
    }
}

/// A candidate: on the surface, and the way out of the solid there.
type Candidate = (DVec3, DVec3, usize);

impl<'a> Skin<'a> {
    pub fn new(mesh: &'a Mesh, spacing: f64) -> Self {
        let (vertices, triangles) = (mesh.triangles.vertices(), mesh.triangles.indices());
        let at = |k: u32| vertices[k as usize];
        let cross = |t: &[u32; 3]| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
        let normals: Vec<DVec3> = triangles.iter().map(|t| cross(t).normalize_or_zero()).collect();
        let of_edge = super::edges(triangles);
        let edges = |k: usize| (0..3).map(move |e| (triangles[k][e], triangles[k][(e + 1) % 3]));
        let mut order: Vec<usize> = (0..triangles.len()).collect();
        order.sort_by_cached_key(|&k| rank(cross(&triangles[k]).length() / (spacing * spacing)));
        let mut face_of = vec![usize::MAX; triangles.len()];
        let mut faces: Vec<Face> = vec![];
        for &first in &order {
            if face_of[first] != usize::MAX {
                continue;
            }
            let (n, origin, number) = (normals[first], at(triangles[first][0]), faces.len());
            let flat = |k: usize| {
                normals[k].angle_between(n) <= FLAT
                    && triangles[k].iter().all(|&v| n.dot(at(v) - origin).abs() <= FLAT * spacing)
            };
            face_of[first] = number;
            let (mut open, mut area) = (vec![first], 0.0);
            while let Some(k) = open.pop() {
                area += 0.5 * cross(&triangles[k]).length();
                for (a, b) in edges(k) {
                    if let Some(&j) = of_edge.get(&(b, a))
                        && face_of[j] == usize::MAX
                        && flat(j)
                    {
                        face_of[j] = number;
                        open.push(j);
                    }
                }
            }
            faces.push(Face { normal: n, at: origin, area, border: vec![] });
        }
        let mut gaps = vec![];
        let mut around: HashMap<u32, Vec<DVec3>> = HashMap::new();
        for k in 0..triangles.len() {
            for (a, b) in edges(k) {
                let Some(&j) = of_edge.get(&(b, a)) else { continue };
                let (n, m, ends) = (normals[k], normals[j], [at(a), at(b)]);
                let outward = (ends[1] - ends[0]).cross(n).normalize_or_zero();
                let turn = n.angle_between(m) * m.dot(outward).signum();
                if face_of[k] != face_of[j] {
                    faces[face_of[k]].border.push(Border { ends, outward, turn });
                }
                if turn < 0.0 && a < b {
                    gaps.push(Gap { ends, normals: [n, m, m] });
                }
                if turn < -FLAT {
                    around.entry(a).or_default().extend([n, m]);
                }
            }
        }
        let mut corners: Vec<_> = around.into_iter().collect();
        corners.sort_by_key(|corner| corner.0);
        for (v, normals) in corners {
            gaps.extend(corner(at(v), &normals));
        }
        let of = face_of.into_iter().zip(normals).collect();
        let corners = Nearest::new(vertices.iter().map(|v| v.to_array()).collect());
        Self { mesh, spacing, of, faces, gaps, corners }
    }

    /// The place `depth` [m] below a point of the surface, if that is the nearest one there, to `off` [m].
    fn below(&self, (at, outward, _): Candidate, depth: f64, off: f64) -> Option<Place> {
        let x = at - depth * outward;
        // Below a rough surface of small triangles most of the folds are no more, and a corner that is nearer is
        // found a hundred times as fast as the nearest point of all.
        if self.corners.has_within(x.to_array(), depth - off) {
            return None;
        }
        let (nearest, inside) = self.mesh.nearest(x);
        let way = nearest - x;
        // Inside an edge, where the layers of two faces meet, either may be the nearest one.
        let is_between = way.length() >= depth - BETWEEN * self.spacing;
        let sound = inside && (is_between || nearest.distance(at) <= off);
        sound.then(|| {
            let known = self.mesh.planes.as_ref().and_then(|planes| planes.distance(x));
            let outward = known.map_or_else(|| way.normalize_or(outward), |known| known.1);
            Place { at: x, inside: (way.length(), outward), fixed: false }
        })
    }

    /// Places of the layer at `depth` [m]. Those of `offered`, of the lattice that fills the mesh, stand where its faces have none of their own;
    /// `taken` are the particles of the layers above.
    pub fn layer(&self, depth: f64, offered: Vec<Place>, taken: &PointCells) -> Vec<Place> {
        let spacing = self.spacing;
        let mut lattices: Vec<Option<Lattice>> =
            self.faces.iter().map(|face| face.lattice(depth, spacing)).collect();
        let mut order: Vec<usize> = (0..self.faces.len()).filter(|&k| lattices[k].is_some()).collect();
        order.sort_by_key(|&k| rank(self.faces[k].area / (spacing * spacing)));
        let mut places = vec![];
        let mut here = PointCells::new(spacing);
        for k in order {
            let (Some(lattice), face) = (&mut lattices[k], &self.faces[k]) else { continue };
            let [columns, rows] = lattice.count;
            let found = (0..rows).into_par_iter().flat_map_iter(|j| {
                let (lattice, along) = (&*lattice, face.normal.dot(face.at) * face.normal);
                (0..columns).filter_map(move |i| {
                    let on = |a: usize, n: i32| {
                        (lattice.start[a] + f64::from(n) * lattice.step[a]) * lattice.axes[a]
                    };
                    let at = on(0, i) + on(1, j) + along;
                    self.below((at, face.normal, k), depth, 2.0 * FLAT * spacing).map(|place| ([i, j], place))
                })
            });
            for (number, place) in found.collect::<Vec<_>>() {
                lattice.held.insert(number);
                let free = here.nearest(place.at, LATTICES_APART * spacing).is_none();
                if free && taken.nearest(place.at, APART * spacing).is_none() {
                    here.add(place.at);
                    places.push(Place { fixed: true, ..place });
                }
            }
        }
        let mut rough = PointCells::new(spacing);
        for place in offered {
            let near = |cells: &PointCells, reach: f64| cells.nearest(place.at, reach * spacing).is_some();
            if !(near(&here, LATTICES_APART) || near(&rough, SAME) || near(taken, APART)) {
                rough.add(place.at);
                places.push(place);
            }
        }
        let held = |c: &Candidate| {
            let lattice = lattices.get(c.2).and_then(Option::as_ref);
            lattice.is_some_and(|l| l.held.contains(&l.nearest(c.0)))
        };
        let left = self.candidates(depth, held).into_par_iter().filter_map(|c| {
            let place = self.below(c, depth, 1e-3 * spacing)?;
            let near = |cells: &PointCells, reach: f64| cells.nearest(place.at, reach * spacing).is_some();
            (!near(&here, CLAIMED) && !near(&rough, CLAIMED_ROUGHLY) && !near(taken, APART)).then_some(place)
        });
        let left: Vec<Place> = left.collect();
        let wanted = (left.len() as f64 / CANDIDATES).round() as usize;
        places.iter().filter(|p| !p.fixed).for_each(|p| here.add(p.at));
        places.extend(thinned(&here, left, wanted, spacing));
        places
    }

    /// Points of the surface, about [`CANDIDATES`] for each square of the spacing of the layer at `depth` [m], but those that `held` takes.
    fn candidates(&self, depth: f64, held: impl Fn(&Candidate) -> bool) -> Vec<Candidate> {
        let mut out = vec![];
        let per_area = CANDIDATES / (self.spacing * self.spacing);
        let (mut due, mut number) = (0.5, 0_u64);
        // As many pairs of numbers in 0..1 as belong on an area; all of them fill the square evenly (the R2 sequence).
        let mut spread = |area: f64| {
            due += area * per_area;
            let mut pairs = vec![];
            while due >= 1.0 {
                due -= 1.0;
                number += 1;
                pairs.push(
                    [0.754_877_666_246_693, 0.569_840_290_998_053].map(|a| (a * number as f64).fract()),
                );
            }
            pairs
        };
        let vertices = self.mesh.triangles.vertices();
        for (t, &(face, normal)) in self.mesh.triangles.indices().iter().zip(&self.of) {
            let [a, b, c] = t.map(|v| vertices[v as usize]);
            let area = 0.5 * (b - a).cross(c - a).length();
            let all = spread(area).into_iter().map(folded);
            let all = all.map(|[s, t]| (a + s * (b - a) + t * (c - a), normal, face));
            out.extend(all.filter(|candidate| !held(candidate)));
        }
        for Gap { ends: [a, b], normals: [n, m, l] } in &self.gaps {
            let mut add = |at: DVec3, way: DVec3| out.push((at, way.normalize_or(*n), usize::MAX));
            if m == l {
                let pairs = spread(a.distance(*b) * depth * n.angle_between(*m));
                pairs.into_iter().for_each(|[s, t]| add(a.lerp(*b, s), turned(*n, *m, t)));
            } else {
                let pairs = spread(depth * depth * solid_angle(*n, *m, *l)).into_iter().map(folded);
                pairs.for_each(|[s, t]| add(*a, (1.0 - s - t) * *n + s * *m + t * *l));
            }
        }
        out
    }
}

impl Face {
    /// Places for particles `depth` [m] below it, `spacing` [m] apart; `None` for a face that is too small.
    fn lattice(&self, depth: f64, spacing: f64) -> Option<Lattice> {
        let length = |b: &Border| b.ends[0].distance(b.ends[1]);
        let perimeter: f64 = self.border.iter().map(length).sum();
        if 2.0 * self.area < LARGE * spacing * perimeter {
            return None;
        }
        let mut longest: Vec<&Border> = self.border.iter().collect();
        longest.sort_by_key(|b| rank(length(b) / spacing));
        longest.truncate(64);
        let way = |b: &Border| (b.ends[1] - b.ends[0]).normalize_or_zero();
        let parallel =
            |a: DVec3| longest.iter().map(|b| length(b) * f64::from(way(b).dot(a).abs() > 1.0 - 1e-6)).sum();
        let weighted = longest.iter().map(|b| (parallel(way(b)), way(b)));
        let along: (f64, DVec3) = weighted
            .fold((0.0, DVec3::ZERO), |a, b| if rank(b.0 / spacing) < rank(a.0 / spacing) { b } else { a });
        // In the plane of the first triangle.
        let across = self.normal.cross(along.1).normalize_or_zero();
        let axes = [across.cross(self.normal), across];
        let rows = axes.map(|axis| self.rows(axis, depth, spacing));
        let [Some(x), Some(y)] = rows else { return None };
        let lattice =
            Lattice { axes, start: [x.0, y.0], step: [x.1, y.1], count: [x.2, y.2], held: HashSet::new() };
        Some(lattice)
    }

    /// First place, step [m] and number of rows across `axis`: those at edges across it stand where the layers of both faces meet, half a step
    /// from a fold.
    fn rows(&self, axis: DVec3, depth: f64, spacing: f64) -> Option<(f64, f64, i32)> {
        let [mut low, mut high] = [None::<f64>; 2];
        let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
        for b in &self.border {
            let [s, t] = b.ends.map(|x| x.dot(axis));
            (first, last) = (first.min(s).min(t), last.max(s).max(t));
            let side = b.outward.dot(axis);
            if side.abs() < 1.0 - 1e-6 {
                continue;
            }
            let inset = if b.turn > FLAT { depth * (0.5 * b.turn).tan() } else { 0.5 * spacing };
            if side < 0.0 {
                low = Some(low.unwrap_or(f64::INFINITY).min(s + inset));
            } else {
                high = Some(high.unwrap_or(f64::NEG_INFINITY).max(s - inset));
            }
        }
        let mut step = spacing;
        let start = match (low, high) {
            (Some(low), Some(high)) => {
                let stretched = (high - low) / ((high - low) / spacing).round().max(1.0);
                if (stretched / spacing - 1.0).abs() < STRETCH {
                    step = stretched;
                }
                low
            }
            (Some(low), None) => low,
            (None, Some(high)) => high - ((high - first) / step).floor() * step,
            (None, None) => first + 0.5 * step,
        };
        let count = ((last - start) / step + 1e-6).floor() as i32 + 1;
        (start.is_finite() && count > 0).then_some((start, step, count))
    }
}

/// A key that puts the largest first, and what is as large but for round-off in the order in which it came.
fn rank(size: f64) -> std::cmp::Reverse<i64> {
    std::cmp::Reverse((size * 1e6).round() as i64)
}

/// A place of the unit square folded into the triangle below its diagonal.
fn folded([s, t]: [f64; 2]) -> [f64; 2] {
    if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] }
}

/// The unit vector `share` of the way from `n` to `m`.
fn turned(n: DVec3, m: DVec3, share: f64) -> DVec3 {
    let angle = n.angle_between(m);
    if angle < 1e-6 {
        return n;
    }
    (((1.0 - share) * angle).sin() * n + (share * angle).sin() * m) / angle.sin()
}

/// Solid angle between three unit vectors (Van Oosterom and Strackee 1983).
fn solid_angle(n: DVec3, m: DVec3, l: DVec3) -> f64 {
    let below = 1.0 + n.dot(m) + m.dot(l) + l.dot(n);
    2.0 * n.dot(m.cross(l)).abs().atan2(below)
}

/// The gap at a corner from which folds lead away, between faces with these `normals`.
fn corner(at: DVec3, normals: &[DVec3]) -> Vec<Gap> {
    let mut apart: Vec<DVec3> = vec![];
    for n in normals {
        if apart.iter().all(|m| m.angle_between(*n) > FLAT) {
            apart.push(*n);
        }
    }
    let middle = apart.iter().sum::<DVec3>().normalize_or_zero();
    if apart.len() < 3 || middle == DVec3::ZERO {
        return vec![];
    }
    let (x, y) = middle.any_orthonormal_pair();
    apart.sort_by(|a, b| a.dot(y).atan2(a.dot(x)).total_cmp(&b.dot(y).atan2(b.dot(x))));
    let fan = apart[1..].windows(2).map(|w| Gap { ends: [at; 2], normals: [apart[0], w[0], w[1]] });
    fan.collect()
}

/// `wanted` of the places `left`, as evenly as they go with those that stand.
fn thinned(standing: &PointCells, left: Vec<Place>, wanted: usize, spacing: f64) -> Vec<Place> {
    let reach = HEXAGONAL * spacing;
    let weight = |d: f64| (1.0 - d / reach).max(0.0).powi(8);
    let mut cells = PointCells::new(reach);
    left.iter().for_each(|p| cells.add(p.at));
    let near: Vec<Vec<usize>> = left.par_iter().map(|p| cells.numbers(p.at)).collect();
    let crowd = |k: usize| -> f64 {
        let x = left[k].at;
        let others = near[k].iter().filter(|&&j| j != k).map(|&j| weight(left[j].at.distance(x)));
        let stand = standing.within(x, reach).map(|(_, d)| weight(d));
        others.chain(stand).sum()
    };
    let mut crowded: Vec<f64> = (0..left.len()).into_par_iter().map(crowd).collect();
    // Weights only fall: what comes up with an old one goes back with its own.
    let mut heap: BinaryHeap<(Ordered, usize)> =
        crowded.iter().enumerate().map(|(k, &w)| (Ordered(w), k)).collect();
    let mut stays = vec![true; left.len()];
    let mut count = left.len();
    while count > wanted
        && let Some((Ordered(w), k)) = heap.pop()
    {
        if w > crowded[k] {
            heap.push((Ordered(crowded[k]), k));
            continue;
        }
        stays[k] = false;
        count -= 1;
        for &j in near[k].iter().filter(|&&j| stays[j]) {
            crowded[j] -= weight(left[j].at.distance(left[k].at));
        }
    }
    left.into_iter().zip(stays).filter_map(|(p, stays)| stays.then_some(p)).collect()
}

/// A number in an order.
#[derive(PartialEq)]
struct Ordered(f64);

impl Eq for Ordered {}

impl PartialOrd for Ordered {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Ordered {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}
