//! Faces of driven solids at which other solids stand: a closed gate's foot on the floor, its sides at the walls, the joint of two walls that move
//! as one. No water presses there, but rows near the edge of such a face carry the pressure of the water beside it.
//!
//! Free bodies have [`crate::slots`] instead, as what presses on them moves them; so have surfaces that bend away from what they touch, in the
//! accurate scheme.

use super::{CELL, Standing, Tiles, moving, still};
use crate::body::Pose;
use crate::contact::broad::PointGrid;
use crate::scene::{Scene, Solid};
use crate::shape;
use glam::DVec3;
use rayon::prelude::*;

/// A face of a row, in the solid's frame.
#[derive(Clone, Copy, Debug)]
struct Face {
    row: usize,
    number: usize,
    to_surface: DVec3,
    center: DVec3,
    area: DVec3,
}

/// The wall layer of a driven solid.
#[derive(Clone, Debug)]
struct Driven {
    solid: usize,
    faces: Vec<Face>,
    /// The faces by where they are in the solid's frame.
    centers: PointGrid,
    radius: f64,
}

/// What of a row's area no water presses on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covered {
    /// Index of the solid.
    pub solid: usize,
    /// Index of the row in the solid's wall layer.
    pub row: usize,
    /// Which of the row's faces.
    pub face: usize,
    /// From the row's particle to the middle of the face, world axes [m].
    pub to_surface: DVec3,
    /// Outward area, world axes [m2].
    pub area: DVec3,
    /// The part of it that lies within other solids [m2].
    pub within: DVec3,
}

/// The driven solids of a scene.
#[derive(Clone, Debug, Default)]
pub struct DrivenFaces {
    solids: Vec<Driven>,
    /// What never moves.
    still: Vec<Standing>,
    tiles: Tiles,
}

impl DrivenFaces {
    /// Those of `scene` that tables follow.
    pub fn new(scene: &Scene) -> Self {
        let driven = scene.solids[..scene.followed()].iter().enumerate().filter(|(_, s)| !s.is_free());
        let of = |(k, solid): (usize, &Solid)| {
            let faces = faces(solid);
            let centers: Vec<DVec3> = faces.iter().map(|face| face.center).collect();
            let radius = centers.iter().map(|x| x.length()).fold(0.0, f64::max);
            Driven { solid: k, faces, centers: PointGrid::new(centers, CELL * scene.spacing), radius }
        };
        Self { solids: driven.map(of).collect(), still: still(scene, None), tiles: Tiles::new(scene) }
    }

    /// What is covered with the solids of `scene` at `poses`, in the order of solids and rows.
    pub fn covered(&self, scene: &Scene, poses: &[Pose]) -> Vec<Covered> {
        if self.solids.is_empty() {
            return vec![];
        }
        let moving = moving(scene, poses);
        let all: Vec<&Standing> = self.still.iter().chain(&moving).collect();
        let of = |driven: &Driven| {
            let (pose, is_still) = (&poses[driven.solid], scene.solids[driven.solid].is_still());
            let faces = (&driven.centers, driven.faces.len());
            let reached = self.tiles.reached(faces, Some((pose, driven.radius)), all.iter().copied());
            let of = |(face, reached): (&Face, Vec<usize>)| {
                let others = reached.iter().map(|&k| all[k]).filter(|s| s.solid != Some(driven.solid));
                let (center, area) =
                    (pose.position + pose.orientation * face.center, pose.orientation * face.area);
                let (normal, others) = (area.normalize_or_zero(), others.collect::<Vec<_>>());
                let center = (center, self.tiles.edge(area.length()));
                let takes = |s: &Standing| !is_still && s.solid.is_none_or(|k| scene.solids[k].is_still());
                let bare = self.tiles.bare_of(center, normal, &others, takes);
                (bare < 1.0).then(|| Covered {
                    solid: driven.solid,
                    row: face.row,
                    face: face.number,
                    to_surface: pose.orientation * face.to_surface,
                    area: (1.0 - bare) * area,
                    within: self.tiles.within(center, normal, &others) * area,
                })
            };
            driven.faces.par_iter().zip(reached).filter_map(of).collect::<Vec<_>>()
        };
        self.solids.iter().flat_map(of).collect()
    }
}

/// The faces of a solid's rows that have an area.
fn faces(solid: &Solid) -> Vec<Face> {
    let of = |row: usize| {
        let face = move |(number, face): (usize, shape::Face)| Face {
            row,
            number,
            to_surface: face.way,
            center: solid.wall_offset[row] + face.way,
            area: face.area,
        };
        solid.faces(row).enumerate().map(face)
    };
    (0..solid.wall_offset.len()).flat_map(of).filter(|face| face.area != DVec3::ZERO).collect()
}
