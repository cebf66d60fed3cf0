//! The surface of a solid as its wall layer feels it: the area of each particle, and the way to where the pressure acts on it.
//!
//! A particle stands for a part of one face. Where it had parts of two at an edge, the one pressure that it knows would act on both at one place: in
//! still water an arm wrong by 0.3 of the spacing. So each piece of the surface goes to the nearest particle that looks its way, and the pressure of a particle
//! acts in the middle of its pieces. What then is left of a push, or of a turn, by the pressure of still water is taken out of all areas.

use super::Particles;
use super::nearest::Nearest;
use glam::DVec3;
use rayon::prelude::*;

/// Distance that counts as much as a normal that is off by 1, over the spacing: at an edge of 90 degrees a face's own particle is taken up to 2 spacings farther away.
const TURN: f64 = 1.5;
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
    pieces: impl Iterator<Item = Piece>,
    nearest: impl Fn(DVec3) -> DVec3,
) {
    give(particles, spacing, pieces, &nearest);
    close(particles, volume, |_, change| change);
}

/// Those `pieces` alone of the surface on the particles `wall` of its layer: one that faces none of them has no area.
pub(super) fn of_some(
    wall: &[DVec3],
    spacing: f64,
    pieces: impl Iterator<Item = Piece>,
    nearest: impl Fn(DVec3) -> DVec3,
) -> Particles {
    let mut out = Particles::default();
    wall.iter().for_each(|&x| out.add(0, x, DVec3::ZERO, nearest(x) - x));
    let middles = give(&mut out, spacing, pieces, &nearest);
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

/// Gives `pieces` to particles; returns the middle of what each has [m], times its weight, and that.
fn give(
    particles: &mut Particles,
    spacing: f64,
    mut pieces: impl Iterator<Item = Piece>,
    nearest: impl Fn(DVec3) -> DVec3,
) -> Vec<(DVec3, f64)> {
    let seen = |at: DVec3, normal: DVec3| {
        let turned = TURN * spacing * normal;
        [at.x, at.y, at.z, turned.x, turned.y, turned.z]
    };
    let normals: Vec<DVec3> = particles.to_surface.iter().map(|s| s.normalize_or_zero()).collect();
    let tree = Nearest::new(particles.wall.iter().zip(&normals).map(|(x, n)| seen(*x, *n)).collect());
    let mut middles = vec![(DVec3::ZERO, 0.0); particles.wall.len()];
    let mut all = middles.clone();
    loop {
        let some: Vec<Piece> = pieces.by_ref().take(TOGETHER).collect();
        if some.is_empty() {
            break;
        }
        let found = tree.to_each(&some, |(at, area)| seen(*at, area.normalize_or_zero()), AS_NEAR * spacing);
        let shared = some.into_iter().zip(&found).flat_map(|((at, area), nearest)| {
            nearest.iter().map(move |&k| (at, area / nearest.len() as f64, k))
        });
        for (at, area, k) in shared {
            particles.area[k] += area;
            all[k].0 += area.length() * at;
            all[k].1 += area.length();
            if area.dot(normals[k]) > ALIKE * area.length() {
                middles[k].0 += area.length() * at;
                middles[k].1 += area.length();
            }
        }
    }
    for (k, (sum, weight)) in middles.into_iter().enumerate().filter(|(_, m)| m.1 > 0.0) {
        let above = particles.wall[k] + particles.to_surface[k];
        let off = sum / weight - above;
        let along = off - off.dot(normals[k]) * normals[k];
        particles.to_surface[k] = nearest(above + along.clamp_length_max(FAR * spacing)) - particles.wall[k];
    }
    all
}

/// Corrects areas that are even only nearly, by as little as it takes: an even pressure may not push, and one that grows along x_k must push with the
/// weight of `volume` [m3] and not turn, so sum A = 0, sum x A^T = volume and sum x_k (x cross A) = 0 about the centre of mass. `part` is what of a
/// change of the area at a place may be made there.
pub(super) fn close(particles: &mut Particles, volume: f64, part: impl Fn(DVec3, DVec3) -> DVec3 + Sync) {
    let at: Vec<DVec3> = particles.wall.iter().zip(&particles.to_surface).map(|(x, s)| *x + *s).collect();
    let size = at.iter().map(|x| x.length()).fold(0.0, f64::max);
    let weights: Vec<f64> = particles.area.iter().map(|a| a.length()).collect();
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
        let mut areas = particles.area.clone();
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
        weights.len() >= FEW
            || areas.iter().zip(&particles.area).all(|(new, old)| new.distance(*old) <= MOST_CHANGE * mean)
    };
    // A handful of particles cannot meet all conditions but by areas that are none; what is left of them in the end always holds.
    for kept in KEPT {
        let areas = closed(kept);
        if kept == KEPT[KEPT.len() - 1] || is_small(&areas) {
            particles.area = areas;
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
