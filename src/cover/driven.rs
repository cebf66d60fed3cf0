//! Faces of driven solids at which other solids stand: a closed gate's foot on the floor, its sides at the walls, the joint of two walls that move
//! as one. No water presses there, but rows near the edge of such a face carry the pressure of the water beside it.
//!
//! Free bodies have [`crate::slots`] instead, as what presses on them moves them.

use super::{Before, Standing, Tiles, moving, still};
use crate::body::Pose;
use crate::scene::{Scene, Solid};
use glam::DVec3;
use rayon::prelude::*;

/// A face of a row, in the solid's frame.
#[derive(Clone, Copy, Debug)]
struct Face {
    row: usize,
    center: DVec3,
    area: DVec3,
}

/// The wall layer of a driven solid.
#[derive(Clone, Debug)]
struct Driven {
    solid: usize,
    faces: Vec<Face>,
    still: Vec<Standing>,
}

/// What of a row's area no water presses on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covered {
    /// Index of the solid.
    pub solid: usize,
    /// Index of the row in the solid's wall layer.
    pub row: usize,
    /// Outward area, world axes [m2].
    pub area: DVec3,
}

/// The driven solids of a scene.
#[derive(Clone, Debug, Default)]
pub struct DrivenFaces {
    solids: Vec<Driven>,
    tiles: Tiles,
}

impl DrivenFaces {
    /// Those of `scene` that tables follow.
    pub fn new(scene: &Scene) -> Self {
        let driven = scene.solids[..scene.followed()].iter().enumerate().filter(|(_, s)| !s.is_free());
        let of = |(k, solid): (usize, &Solid)| Driven {
            solid: k,
            faces: faces(solid),
            still: still(scene, Before::Solid(k)),
        };
        Self { solids: driven.map(of).collect(), tiles: Tiles::new(scene) }
    }

    /// What is covered with the solids of `scene` at `poses`, in the order of solids and rows.
    pub fn covered(&self, scene: &Scene, poses: &[Pose]) -> Vec<Covered> {
        let all = self.solids.iter().flat_map(|driven| {
            let others = moving(scene, poses, Some(driven.solid));
            let pose = &poses[driven.solid];
            let of = |face: &Face| {
                let center = pose.position + pose.orientation * face.center;
                let near = [&driven.still, &others].map(|solids| self.tiles.near(center, solids)).concat();
                let area = pose.orientation * face.area;
                let covered = 1.0 - self.tiles.bare(center, area.normalize_or_zero(), &near);
                (covered > 0.0).then(|| Covered { solid: driven.solid, row: face.row, area: covered * area })
            };
            driven.faces.par_iter().filter_map(of).collect::<Vec<_>>()
        });
        all.collect()
    }
}

/// The faces of a solid: rows at edges of a box belong to several of them, others to one.
fn faces(solid: &Solid) -> Vec<Face> {
    let is_box = solid.shape.as_cuboid().is_some();
    let rows = solid.wall_offset.iter().zip(&solid.wall_area).zip(&solid.wall_to_surface).enumerate();
    rows.flat_map(|(row, ((&offset, &area), &to_surface))| {
        let one = [Face { row, center: offset + to_surface, area }];
        let of_axis = |e: DVec3| Face { row, center: offset + to_surface * e, area: area * e };
        let of_box = DVec3::AXES.map(of_axis);
        let own = if is_box { of_box.to_vec() } else { one.to_vec() };
        own.into_iter().filter(|face| face.area != DVec3::ZERO)
    })
    .collect()
}
