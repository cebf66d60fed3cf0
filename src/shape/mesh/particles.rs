//! Particles that fill a mesh.

use super::super::areas::{self, Piece};
use super::super::blocks;
use super::super::cells::PointCells;
use super::super::thin::Thin;
use super::super::{ALL_FACES, APART, Geometry, Particles};
use super::Mesh;
use super::skin::Skin;
use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// A lattice fits a surface whose wall layer is moved by no more, over the spacing.
const FITS: f64 = 0.2;
/// Where the normal's largest part along an axis of the lattice is more, its places lie evenly enough to begin with.
const GENTLE: f64 = 0.95;
/// How far particles of a layer push each other away, over the spacing.
const REACH: f64 = 1.5;
/// How far a push of 1 moves a particle in a round, over the spacing.
const STRIDE: f64 = 0.3;
/// Rounds of pushing between two looks at the surface, how many of these, and how much nearer two particles may come between them, over the
/// spacing.
const ROUNDS: usize = 15;
const LOOKS: usize = 2;
const MARGIN: f64 = 0.5;
/// Sum of 1 - d / l0 over neighbours nearer than a spacing from which on a particle is one too many: 0 on a lattice, 1.2 in the middle of its
/// squares.
const CROWDED: f64 = 0.5;
/// A piece of the surface that goes to one particle is no longer, over the spacing.
const PIECE: f64 = 0.4;
/// Part of a length that may be round-off.
const SLACK: f64 = 1e-9;

/// A place of a layer.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub at: DVec3,
    /// Its depth [m] and the way out of the solid.
    pub inside: (f64, DVec3),
    /// It stays where it is: on the lattice of a face, or on that which fills the mesh.
    pub fixed: bool,
}

impl Place {
    /// A place whose depth is not known yet, moved along `outward` from `inside` [m] to `depth` [m].
    fn moved(at: DVec3, (inside, outward): (f64, DVec3), depth: f64) -> Self {
        Self { at: at + (inside - depth) * outward, inside: (depth, outward), fixed: false }
    }

    /// The same with its depth looked up; `None` if that is not about `depth` [m], as where the way led nearer to another side.
    fn looked_up(self, mesh: &Mesh, depth: f64, spacing: f64) -> Option<Self> {
        Some(self.settled(mesh)).filter(|place| (place.inside.0 - depth).abs() < 0.1 * spacing)
    }

    /// The same with its depth looked up, whatever it is.
    fn settled(self, mesh: &Mesh) -> Self {
        let (distance, outward) = mesh.distance(self.at);
        Self { inside: (-distance, outward), ..self }
    }
}

/// The places inside `mesh` of a lattice of about `spacing` [m] along the axes of the file, as deep as `layers` of it go, each with its depth [m] and the
/// way out of the solid there, and its largest step [m].
fn cells(mesh: &Mesh, spacing: f64, layers: i32) -> (Vec<(DVec3, f64, DVec3)>, f64) {
    let (low, high) = mesh.along_file;
    let to_own = mesh.frame.inverse();
    let count = ((high - low) / spacing).round().max(DVec3::ONE);
    let step = (high - low) / count;
    // A lattice that fits has its layers at odd halves of its step.
    let border = step.max_element().max(spacing) * (1.0 + 1e-6);
    let deepest = f64::from(layers) * border;
    let at = |cell: DVec3| to_own * (low + (cell + 0.5) * step);
    let left = blocks::small(blocks::Cells { lo: IVec3::ZERO, hi: count.as_ivec3() }, |block| {
        let distance = mesh.distance(at(0.5 * (block.lo + block.hi - 1).as_dvec3())).0;
        let half = block.half(step) + 1e-6 * spacing;
        distance > half || -distance > deepest + half
    });
    let mut left: Vec<IVec3> = left.into_iter().flat_map(blocks::Cells::iter).collect();
    left.sort_unstable_by_key(|c| (c.z, c.y, c.x));
    let found = left.into_par_iter().filter_map(|cell| {
        let at = at(cell.as_dvec3());
        let inside = mesh.depth(at, ALL_FACES)?;
        Some((at, inside.depth, inside.outward))
    });
    (found.collect(), border)
}

/// Layers of particles at half a spacing, one and a half and so on below the surface of `mesh`, `layers` of them: those of a lattice of about
/// `spacing` [m] along the axes of the file where that fits, and else layers of their own, each pushed apart until it lies evenly. Water that
/// slides over the steps of a lattice is held back.
pub(super) fn fill(mesh: &Mesh, spacing: f64, layers: i32) -> Particles {
    let (found, border) = cells(mesh, spacing, layers);
    let off = |depth: f64| (depth - 0.5 * spacing).abs();
    // Below a face at 45 degrees to its axes a lattice has places at one depth that stand 1.4 spacings apart.
    let is_gentle = |outward: DVec3| (mesh.frame * outward).abs().max_element() > GENTLE;
    let fits = found.iter().all(|f| f.1 > border || off(f.1) <= FITS * spacing && is_gentle(f.2));
    let skin = (!fits).then(|| Skin::new(mesh, spacing));
    let mut out = Particles::default();
    let mut taken = PointCells::new(spacing);
    let thin = Thin::new(|x| mesh.distance(x), spacing, false);
    let nearest = |x| mesh.nearest_evenly(x, areas::AS_NEAR * spacing);
    for layer in 0..layers {
        let (above, depth) = (f64::from(layer) * border, (f64::from(layer) + 0.5) * spacing);
        let mut here: Vec<_> = found.iter().filter(|f| f.1 > above && f.1 <= above + border).collect();
        here.sort_by(|a, b| (a.1 - depth).abs().total_cmp(&(b.1 - depth).abs()));
        let places: Vec<Place> = if let Some(skin) = &skin {
            let moved = here.into_par_iter().filter_map(|&(at, inside, outward)| {
                is_gentle(outward)
                    .then(|| Place::moved(at, (inside, outward), depth).looked_up(mesh, depth, spacing))?
            });
            even(mesh, skin.layer(depth, moved.collect(), &taken), depth, spacing)
        } else {
            let put = |&&(at, inside, outward): &&(DVec3, f64, DVec3)| {
                let stays = Place { at, inside: (inside, outward), fixed: true };
                // Below a wall layer that fits the lattice lies the lattice.
                let moved = (layer == 0)
                    .then(|| Place::moved(at, stays.inside, depth).looked_up(mesh, depth, spacing));
                moved.flatten().unwrap_or(stays)
            };
            here.par_iter().map(put).collect()
        };
        let merged: Vec<bool> =
            places.par_iter().map(|p| layer > 0 && skin.is_some() && thin.merges(p.at, p.inside)).collect();
        let places = places.into_iter().zip(merged).filter(|(_, merged)| !merged).map(|(place, _)| place);
        for Place { at, inside: (depth, outward), .. } in places {
            if taken.nearest(at, APART * spacing).is_none() {
                taken.add(at);
                let way = if layer == 0 { nearest(at) - at } else { depth * outward };
                out.add(layer, at, DVec3::ZERO, way);
            }
        }
    }
    // A lattice that fits is full.
    for layer in 1..if skin.is_some() { layers } else { 1 } {
        let above = f64::from(layer);
        let here = found.iter().filter(|f| f.1 > (above - 0.5) * spacing && f.1 < (above + 1.0) * spacing);
        let cells: Vec<_> = here.copied().collect();
        thin.fill(above, thin.beside(&cells).into_iter(), &taken, &mut out);
    }
    areas::share(&mut out, spacing, mesh.volume(), pieces(mesh, spacing), nearest);
    out
}

/// Its wall layer `wall` with the areas of the pieces alone that are `free`.
pub(super) fn freed(
    mesh: &Mesh,
    wall: &[DVec3],
    spacing: f64,
    free: &dyn Fn(DVec3, DVec3) -> bool,
) -> Particles {
    let pieces = pieces(mesh, spacing).filter(|(at, area)| free(*at, area.normalize_or_zero()));
    areas::of_some(wall, spacing, pieces, |x| mesh.nearest_evenly(x, areas::AS_NEAR * spacing))
}

/// The places of a layer at `depth` [m], pushed apart along it until they lie evenly.
fn even(mesh: &Mesh, mut places: Vec<Place>, depth: f64, spacing: f64) -> Vec<Place> {
    let reach = REACH * spacing;
    for look in 0..LOOKS {
        let mut cells = PointCells::new(reach + MARGIN * spacing);
        places.iter().for_each(|p| cells.add(p.at));
        let around: Vec<Vec<usize>> =
            places.par_iter().map(|p| if p.fixed { vec![] } else { cells.numbers(p.at) }).collect();
        let mut moved: Vec<DVec3> = places.iter().map(|p| p.at).collect();
        for _ in 0..ROUNDS {
            let pushed = |k: usize| {
                let (x, outward) = (moved[k], places[k].inside.1);
                let mut push = DVec3::ZERO;
                for &j in &around[k] {
                    let (way, d) = (x - moved[j], x.distance(moved[j]));
                    if d > 0.0 && d < reach {
                        push += (1.0 - d / reach).powi(2) / d * way;
                    }
                }
                // Between the looks at the surface the tangent is good enough.
                let along = push - push.dot(outward) * outward;
                x + (STRIDE * spacing * along).clamp_length_max(0.1 * spacing)
            };
            moved = (0..places.len()).into_par_iter().map(pushed).collect();
        }
        let last = look + 1 == LOOKS;
        places = (places.par_iter().zip(&moved))
            .map(|(p, &at)| {
                if p.fixed {
                    return *p;
                }
                let put = mesh.depth(at, ALL_FACES).and_then(|inside| {
                    let put = Place::moved(at, (inside.depth, inside.outward), depth);
                    // On its way it has not left the layer for another side's; where it ends that is looked up.
                    let strays = (inside.depth - depth).abs() > 0.5 * spacing;
                    if last { put.looked_up(mesh, depth, spacing) } else { (!strays).then_some(put) }
                });
                put.unwrap_or_else(|| if last { p.settled(mesh) } else { *p })
            })
            .collect();
        if !last {
            places = without_crowded(places, spacing);
        }
    }
    places
}

/// `places` without those that may be moved and lack [`CROWDED`] of their room: what lattices leave between them is no whole number of
/// particles.
fn without_crowded(places: Vec<Place>, spacing: f64) -> Vec<Place> {
    let mut cells = PointCells::new(spacing);
    places.iter().for_each(|p| cells.add(p.at));
    let mut stays = vec![true; places.len()];
    let crowd = |k: usize, stays: &[bool]| -> f64 {
        let others = cells.within(places[k].at, spacing).filter(|&(j, _)| j != k && stays[j]);
        others.map(|(_, distance)| 1.0 - distance / spacing).sum()
    };
    let loose = (0..places.len()).filter(|&k| !places[k].fixed);
    let mut crowded: Vec<(f64, usize)> = loose.map(|k| (crowd(k, &stays), k)).collect();
    crowded.retain(|c| c.0 > CROWDED);
    crowded.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, k) in crowded {
        stays[k] = crowd(k, &stays) <= CROWDED;
    }
    places.into_iter().zip(stays).filter_map(|(place, stays)| stays.then_some(place)).collect()
}

/// The surface in small pieces, of which none is longer than [`PIECE`]: triangles, halved across their longest edge.
pub(super) fn pieces(mesh: &Mesh, spacing: f64) -> impl Iterator<Item = Piece> + '_ {
    mesh.triangles.triangles().flat_map(move |triangle| {
        let mut open = vec![[triangle.a, triangle.b, triangle.c]];
        std::iter::from_fn(move || {
            loop {
                let [a, b, c] = open.pop()?;
                let edges = [[a, b, c], [b, c, a], [c, a, b]].map(|edge| (edge[0].distance(edge[1]), edge));
                let longest = edges.iter().map(|edge| edge.0).fold(0.0, f64::max);
                // Of edges as long up to round-off it is always the same one.
                let (length, [from, to, apex]) =
                    edges.into_iter().rfind(|e| e.0 >= longest * (1.0 - SLACK))?;
                if length <= PIECE * spacing * (1.0 + SLACK) {
                    return Some(((a + b + c) / 3.0, 0.5 * (b - a).cross(c - a)));
                }
                let middle = 0.5 * (from + to);
                open.extend([[middle, to, apex], [from, middle, apex]]);
            }
        })
    })
}
