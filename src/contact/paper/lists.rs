//! Which particles of two wall layers may come close.

use super::facing::Facing;
use super::pair::{Layer, Pair, Walls};
use crate::body::Body;
use crate::contact::broad::{PointGrid, fixed_walls, images_of};
use crate::contact::candidates::{Candidates, Close, MANY_PAIRS};
use crate::scene::{Scene, WallShape};
use glam::DVec3;
use rayon::prelude::*;

/// Wall layers and lists of the pairs that may touch; the baseline has the same.
pub(crate) struct Lists {
    pub layers: Vec<Layer>,
    pub walls: Walls,
    pub pairs: Vec<Pair>,
    generation: u64,
}

impl Lists {
    pub fn new(scene: &Scene) -> Self {
        let layers = scene
            .solids
            .iter()
            .map(|s| Layer { offsets: s.wall_offset.clone(), normals: Facing::of_solid(s, scene) });
        let (mut positions, of) = fixed_walls(scene);
        let mut normals: Vec<Facing> = of.iter().map(|&k| Facing::of_fixed(k, scene)).collect();
        let mut of: Vec<u32> = of.iter().map(|&k| scene.static_wall_shape[k]).collect();
        for (x, inward, wall) in lids(scene) {
            positions.push(x);
            normals.push(Facing::one(inward));
            of.push(wall);
        }
        let walls = Walls { grid: PointGrid::new(positions, 2.0 * scene.spacing), normals, of };
        Self { layers: layers.collect(), walls, pairs: vec![], generation: 0 }
    }

    /// Whether the lists are those of `candidates`.
    pub fn is_current(&self, candidates: &Candidates) -> bool {
        self.generation == candidates.generation()
    }

    /// Pairs of solids that are close, each with the reach of its particles [m]; without particles.
    pub fn close(&self, candidates: &Candidates, bodies: &[Body], distance: f64) -> Vec<(Pair, f64)> {
        let mut pairs: Vec<(Pair, f64)> = vec![];
        for (a, body) in bodies.iter().enumerate().filter(|(_, b)| b.is_free()) {
            let reach = body.extent() + candidates.skin(a) + distance;
            if self.walls.grid.meets(&(body.shape_center() - reach, body.shape_center() + reach)) {
                pairs.push((Pair::new(a, None, DVec3::ZERO), distance + candidates.skin(a)));
            }
        }
        for &Close { a, b, image } in &candidates.close {
            let reach = distance + candidates.skin(a) + candidates.skin(b);
            pairs.push((Pair::new(a, Some(b), image), reach));
        }
        pairs
    }

    /// Makes the lists of particle pairs within `distance` [m].
    pub fn collect(&mut self, candidates: &Candidates, bodies: &[Body], distance: f64) {
        self.generation = candidates.generation();
        let pairs = self.close(candidates, bodies, distance);
        let fill = |(mut pair, reach): (Pair, f64)| {
            pair.collect(bodies, &self.layers, &self.walls, reach);
            (!pair.candidates.is_empty()).then_some(pair)
        };
        self.pairs = if pairs.len() >= MANY_PAIRS {
            pairs.into_par_iter().filter_map(fill).collect()
        } else {
            pairs.into_iter().filter_map(fill).collect()
        };
    }
}

/// Places of the particles that would close the holes of the tank [m], the ways into it there, and the walls that they would be of: bodies
/// do not leave through holes.
fn lids(scene: &Scene) -> Vec<(DVec3, DVec3, u32)> {
    let mut out = vec![];
    for opening in &scene.openings {
        let holds = |x: DVec3| {
            move |wall: &WallShape| (wall.axes.transpose() * (x - wall.center)).abs().cmple(wall.half).all()
        };
        for &x in &opening.lid {
            let Some(wall) = scene.walls.iter().position(holds(x)) else { continue };
            out.extend(images_of(scene, x).map(|x| (x, -opening.outward, wall as u32)));
        }
    }
    out
}
