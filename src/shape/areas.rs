//! The surface of a solid as its wall layer feels it: the area of each particle, and the way to where the pressure acts on it.
//!
//! Each piece of the surface goes to the nearest particle. Where the surface has an edge, a particle has pieces on both sides of it: its faces, each of which is
//! pressed on in the middle of its own pieces. With one middle for both, an arm would be wrong by 0.3 of the spacing in still water; given to the particles beside
//! it that look the way of a face, the pieces at the edges of what falls into water would be pressed by what presses farther inside. What then is left of a push, or
//! of a turn, by the pressure of still water is taken out of all areas.

use super::nearest::Nearest;
use super::{Face, MOST_FACES, Particles};
use glam::DVec3;
use rayon::prelude::*;

/// Distance that counts as much as a normal that is off by 1, over the spacing: pieces of a thin solid go to the particles on their side.
const TURN: f64 = 0.5;
/// The same of a solid that others cut. Particles at its edges stand close to those of the others, and the pressure of the next ones, which look the way of a face, is
/// nearer to that of still water: the pieces at an edge of 90 degrees go to these.
const TURN_OF_CUT: f64 = 1.5;
/// Cosine between the normals of pieces of one face: what turns by more is an edge.
const FACE: f64 = 0.77;
/// Pieces whose normals differ by less are put together at once.
const FLAT: f64 = 0.999;
/// What of a particle's area is no face of its own.
const STRIP: f64 = 0.01;
/// Cosine between the normals of a particle and of pieces in whose middle its pressure acts.
const ALIKE: f64 = 0.5;
/// That middle is no farther than this from the nearest point of the surface, over the spacing.
const FAR: f64 = 2.0;
/// A piece is shared by those whose distances from it differ by no more, over the spacing: which of them is the nearest is round-off.
pub(super) const AS_NEAR: f64 = 1e-6;
/// Pieces that are looked up together.
const TOGETHER: usize = 1 << 16;
/// Conditions of still water on the areas: no push by an even pressure, the weight of the volume by one that grows, no turn by that.
const CONDITIONS: usize = 21;
/// How many of them are asked of fewer particles than [`FEW`], where more would change areas by more than [`MOST_CHANGE`].
const KEPT: [usize; 3] = [CONDITIONS, 12, 3];
const FEW: usize = 24;
/// Largest change of an area over the mean of all.
const MOST_CHANGE: f64 = 0.5;
/// What of a condition the others leave, below which it is none of its own.
const OWN: f64 = 1e-7;

/// A piece of the surface: its middle [m] and its outward area [m2].
pub(super) type Piece = (DVec3, DVec3);

/// The middle of places [m], of which those no farther apart than `slack` [m] count once.
pub(super) fn middle(places: impl Iterator<Item = DVec3>, slack: f64) -> Option<DVec3> {
    let mut found: Vec<DVec3> = Vec::new();
    for at in places {
        if found.iter().all(|other| other.distance(at) > slack) {
            found.push(at);
        }
    }
    (!found.is_empty()).then(|| found.iter().sum::<DVec3>() / found.len() as f64)
}

/// Gives all `pieces` of the surface to the wall layer of `particles`; `nearest` is the point of the surface nearest to another one.
pub(super) fn share(
    particles: &mut Particles,
    spacing: f64,
    volume: f64,
    mut pieces: impl Iterator<Item = Piece>,
    nearest: impl Fn(DVec3) -> DVec3,
) {
    give(particles, (spacing, TURN), &mut pieces, &nearest);
    close(particles, volume, &|_, change| change);
}

/// Those `pieces` alone of the surface on the particles `wall` of its layer: one that faces none of them has no area.
pub(super) fn of_some(
    wall: &[DVec3],
    spacing: f64,
    mut pieces: impl Iterator<Item = Piece>,
    nearest: impl Fn(DVec3) -> DVec3,
) -> Particles {
    let mut out = Particles::default();
    wall.iter().for_each(|&x| out.add(0, x, DVec3::ZERO, nearest(x) - x));
    let middles = give(&mut out, (spacing, TURN_OF_CUT), &mut pieces, &nearest);
    // One whose own side is left out stands for what it has of others.
    for (k, (sum, weight)) in middles.into_iter().enumerate().filter(|(_, m)| m.1 > 0.0) {
        let outward = out.area[k].normalize_or_zero();
        if outward.dot(out.to_surface[k]) <= 0.0 {
            let way = (sum / weight - out.wall[k]).clamp_length_max(FAR * spacing);
            out.to_surface[k] = nearest(out.wall[k] + way + 0.5 * spacing * outward) - out.wall[k];
        }
    }
    out
}

/// Gives `pieces` to particles, `turn` as [`TURN`]; returns the middle of what each has [m], times its weight, and that.
fn give(
    particles: &mut Particles,
    (spacing, turn): (f64, f64),
    pieces: &mut dyn Iterator<Item = Piece>,
    nearest: &dyn Fn(DVec3) -> DVec3,
) -> Vec<(DVec3, f64)> {
    let seen = |at: DVec3, normal: DVec3| {
        let turned = turn * spacing * normal;
        [at.x, at.y, at.z, turned.x, turned.y, turned.z]
    };
    let normals: Vec<DVec3> = particles.to_surface.iter().map(|s| s.normalize_or_zero()).collect();
    let tree = Nearest::new(particles.wall.iter().zip(&normals).map(|(x, n)| seen(*x, *n)).collect());
    let mut parts: Vec<Vec<Part>> = vec![vec![]; particles.wall.len()];
    loop {
        let some: Vec<Piece> = (&mut *pieces).take(TOGETHER).collect();
        if some.is_empty() {
            break;
        }
        let found = tree.to_each(&some, |(at, area)| seen(*at, area.normalize_or_zero()), AS_NEAR * spacing);
        for ((at, area), nearest) in some.into_iter().zip(&found) {
            let area = area / nearest.len() as f64;
            let piece = Part { area, moment: area.length() * at, weight: area.length() };
            for &k in nearest {
                match parts[k].iter_mut().find(|part| part.looks_like(&piece, FLAT)) {
                    Some(part) => part.add(&piece),
                    None => parts[k].push(piece),
                }
            }
        }
    }
    let mut all = vec![(DVec3::ZERO, 0.0); particles.wall.len()];
    for (k, parts) in parts.into_iter().enumerate() {
        let x = particles.wall[k];
        let mut whole = Part::default();
        parts.iter().for_each(|part| whole.add(part));
        particles.area[k] = whole.area;
        all[k] = (whole.moment, whole.weight);
        let faces = together(&parts);
        if (2..=MOST_FACES).contains(&faces.len()) {
            let face = |part: &Part| {
                let way = (part.moment / part.weight - x).clamp_length_max(FAR * spacing);
                Face { area: part.area, way: nearest(x + way) - x }
            };
            particles.edges.add(k, faces.iter().map(face).collect());
            continue;
        }
        let mut alike = Part::default();
        let towards = |part: &&Part| part.area.dot(normals[k]) > ALIKE * part.area.length();
        parts.iter().filter(towards).for_each(|part| alike.add(part));
        if alike.weight > 0.0 {
            let above = x + particles.to_surface[k];
            let off = alike.moment / alike.weight - above;
            let along = off - off.dot(normals[k]) * normals[k];
            particles.to_surface[k] = nearest(above + along.clamp_length_max(FAR * spacing)) - x;
        }
    }
    all
}

/// Pieces of the surface that belong together.
#[derive(Clone, Copy, Default)]
struct Part {
    area: DVec3,
    /// Sum of their middles, each times its area [m3].
    moment: DVec3,
    weight: f64,
}

impl Part {
    fn add(&mut self, other: &Self) {
        self.area += other.area;
        self.moment += other.moment;
        self.weight += other.weight;
    }

    /// Whether the cosine between the ways they look is more than `least`.
    fn looks_like(&self, other: &Self, least: f64) -> bool {
        self.area.dot(other.area) > least * self.area.length() * other.area.length()
    }
}

/// The faces of a particle that has these `parts` of the surface: those that look nearly the same way, one after the other, are one.
fn together(parts: &[Part]) -> Vec<Part> {
    let mut left = parts.to_vec();
    let mut out = vec![];
    while let Some(first) = left.pop() {
        let (mut members, mut at) = (vec![first], 0);
        while at < members.len() {
            let of = members[at];
            let (near, far) = left.into_iter().partition(|part| part.looks_like(&of, FACE));
            members.extend::<Vec<Part>>(near);
            left = far;
            at += 1;
        }
        let mut face = Part::default();
        members.iter().for_each(|part| face.add(part));
        out.push(face);
    }
    // A strip of a face that others hold goes with the largest.
    let all: f64 = out.iter().map(|face| face.weight).sum();
    let (strips, mut out): (Vec<Part>, Vec<Part>) =
        out.into_iter().partition(|face| face.weight < STRIP * all);
    if let Some(largest) = out.iter_mut().max_by(|a, b| a.weight.total_cmp(&b.weight)) {
        strips.iter().for_each(|strip| largest.add(strip));
    }
    out
}

/// Corrects areas that are even only nearly, by as little as it takes: an even pressure may not push, and one that grows along x_k must push with the
/// weight of `volume` [m3] and not turn, so sum A = 0, sum x A^T = volume and sum x_k (x cross A) = 0 about the centre of mass. `part` is what of a
/// change of the area at a place may be made there.
pub(super) fn close(particles: &mut Particles, volume: f64, part: &(dyn Fn(DVec3, DVec3) -> DVec3 + Sync)) {
    let (mut at, mut given, mut counts): (Vec<DVec3>, Vec<DVec3>, Vec<usize>) = Default::default();
    for (k, x) in particles.wall.iter().enumerate() {
        let before = at.len();
        for face in particles.faces(k) {
            at.push(*x + face.way);
            given.push(face.area);
        }
        counts.push(at.len() - before);
    }
    let size = at.iter().map(|x| x.length()).fold(0.0, f64::max);
    let weights: Vec<f64> = given.iter().map(|a| a.length()).collect();
    let total: f64 = weights.iter().sum();
    if !(size > 0.0 && total > 0.0) {
        return;
    }
    let conditions: Vec<[DVec3; CONDITIONS]> =
        at.par_iter().map(|x| conditions(*x / size).map(|c| part(*x, c))).collect();
    let closed = |kept: usize| {
        let mut matrix = [[0.0; CONDITIONS]; CONDITIONS];
        for (of, weight) in conditions.iter().zip(&weights) {
            for i in 0..kept {
                for j in 0..=i {
                    matrix[i][j] += weight / total * of[i].dot(of[j]);
                }
            }
        }
        let mut areas = given.clone();
        // Once more for what was rounded off.
        for _ in 0..2 {
            let mut missing = [0.0; CONDITIONS];
            if kept > 3 {
                (0..3).for_each(|k| missing[3 + 4 * k] = volume / (size * total));
            }
            for (of, area) in conditions.iter().zip(&areas) {
                missing.iter_mut().zip(of).take(kept).for_each(|(m, c)| *m -= c.dot(*area) / total);
            }
            let factors = solved(matrix, missing);
            for ((of, weight), area) in conditions.iter().zip(&weights).zip(&mut areas) {
                *area += *weight * of.iter().zip(factors).map(|(c, factor)| factor * *c).sum::<DVec3>();
            }
        }
        areas
    };
    let mean = total / weights.len() as f64;
    let is_small = |areas: &[DVec3]| {
        counts.len() >= FEW
            || areas.iter().zip(&given).all(|(new, old)| new.distance(*old) <= MOST_CHANGE * mean)
    };
    // A handful of particles cannot meet all conditions but by areas that are none; what is left of them in the end always holds.
    for kept in KEPT {
        let areas = closed(kept);
        if kept == KEPT[KEPT.len() - 1] || is_small(&areas) {
            let mut areas = areas.into_iter();
            for (k, &count) in counts.iter().enumerate() {
                let of: Vec<DVec3> = areas.by_ref().take(count).collect();
                particles.area[k] = of.iter().sum();
                particles.edges.set(k, &of);
            }
            return;
        }
    }
}

/// What the area at `x` is multiplied by in each condition: 1 along each axis, x_k along each, x_k times the arm about each.
fn conditions(x: DVec3) -> [DVec3; CONDITIONS] {
    let mut out = [DVec3::ZERO; CONDITIONS];
    for (a, axis) in DVec3::AXES.into_iter().enumerate() {
        out[a] = axis;
        for k in 0..3 {
            out[3 + 3 * k + a] = x[k] * axis;
            out[12 + 3 * k + a] = x[k] * axis.cross(x);
        }
    }
    out
}

/// Solution of `matrix` x = `right` with a symmetric matrix, of which the lower half is given; what depends on the rest is left out (Cholesky's factors with
/// pivots).
fn solved<const N: usize>(mut matrix: [[f64; N]; N], right: [f64; N]) -> [f64; N] {
    let scale: [f64; N] = std::array::from_fn(|i| matrix[i][i].max(0.0).sqrt());
    // A condition that no change can serve is round-off.
    let least = OWN * scale.iter().copied().fold(0.0, f64::max);
    let scale = scale.map(|s| if s > least { s } else { 0.0 });
    for i in 0..N {
        for j in 0..=i {
            let both = scale[i] * scale[j];
            matrix[i][j] = if both > 0.0 { matrix[i][j] / both } else { 0.0 };
            matrix[j][i] = matrix[i][j];
        }
    }
    let mut pivots: Vec<usize> = vec![];
    let mut columns: Vec<[f64; N]> = vec![];
    let mut left: [f64; N] = std::array::from_fn(|i| matrix[i][i]);
    while let Some(p) = (0..N).filter(|i| !pivots.contains(i)).max_by(|&a, &b| left[a].total_cmp(&left[b])) {
        if left[p] <= OWN {
            break;
        }
        let root = left[p].sqrt();
        let column: [f64; N] =
            std::array::from_fn(|i| (matrix[i][p] - columns.iter().map(|c| c[i] * c[p]).sum::<f64>()) / root);
        left.iter_mut().zip(column).for_each(|(l, c)| *l -= c * c);
        pivots.push(p);
        columns.push(column);
    }
    // L y = b, then L^T x = y, over the pivots in their order.
    let mut y = vec![0.0; pivots.len()];
    for (n, &p) in pivots.iter().enumerate() {
        let known: f64 = (0..n).map(|m| columns[m][p] * y[m]).sum();
        y[n] = (right[p] / scale[p] - known) / columns[n][p];
    }
    let mut x = [0.0; N];
    for n in (0..pivots.len()).rev() {
        let known: f64 = (n + 1..pivots.len()).map(|m| columns[n][pivots[m]] * x[pivots[m]]).sum();
        x[pivots[n]] = (y[n] - known) / columns[n][pivots[n]];
    }
    std::array::from_fn(|i| if scale[i] > 0.0 { x[i] / scale[i] } else { 0.0 })
}
