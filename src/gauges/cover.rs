//! What stands before the faces of fixed walls and keeps the water from them: solids of any shape, where they are, and walls that fit no lattice.

use crate::body::Pose;
use crate::contact::broad::PointGrid;
use crate::periodic::Periodic;
use crate::scene::{Scene, Shape, WallShape};
use glam::{DMat3, DQuat, DVec3};

/// Distances before a face, over l0, at which a point that lies in a solid tells that no water stands between: nearly at the face, where a solid ends
/// in a wedge, and half a particle away, where it stands a little off the lattice.
const AT: [f64; 2] = [0.1, 0.5];
/// The same of free bodies, with what is covered then: as much as [`crate::slots`] takes for a slot, up to a gap of 1.1 spacings.
const FADING: [(f64, f64); 2] = [(0.7, 2.0 / 3.0), (0.9, 1.0 / 3.0)];
/// Points along an edge of a face, in the plane and in space.
const POINTS: [u32; 2] = [10, 5];

/// A solid where it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Standing {
    shape: Shape,
    position: DVec3,
    to_shape: DMat3,
    radius: f64,
    is_free: bool,
}

impl Standing {
    fn new(shape: Shape, position: DVec3, orientation: DQuat, is_free: bool) -> Self {
        let to_shape = DMat3::from_quat(orientation.inverse());
        Self { radius: shape.radius(), shape, position, to_shape, is_free }
    }

    /// The box of a fixed wall.
    fn wall(wall: &WallShape) -> Self {
        let shape = Shape::cuboid(2.0 * wall.half);
        Self {
            radius: shape.radius(),
            shape,
            position: wall.center,
            to_shape: wall.axes.transpose(),
            is_free: false,
        }
    }

    fn holds(&self, x: DVec3, periodic: &Periodic) -> bool {
        let way = x - self.position;
        let inside = |way: DVec3| {
            way.length_squared() < self.radius * self.radius && self.shape.outside(self.to_shape * way) < 0.0
        };
        // What spans a periodic axis reaches over its sides.
        inside(way) || periodic.is_any() && inside(periodic.nearest(way))
    }
}

/// What never moves before the faces of wall `of` of `scene`: solids, the walls of openings, and of fixed walls those that the lattice
/// does not tell of.
pub(super) fn still(scene: &Scene, of: usize) -> Vec<Standing> {
    let fits = |wall: &WallShape| wall.axes == DMat3::IDENTITY;
    let own_fits = fits(&scene.walls[of]);
    let walls = scene.walls.iter().enumerate().filter(|(k, wall)| *k != of && !(own_fits && fits(wall)));
    let opened = scene.followed();
    let solids = scene.solids.iter().enumerate().filter(|(k, s)| s.is_still() || *k >= opened);
    let solids = solids.map(|(_, s)| Standing::new(s.shape, s.position, s.orientation, false));
    walls.map(|(_, wall)| Standing::wall(wall)).chain(solids).collect()
}

/// The solids of `scene` that move, at their `poses`.
pub(super) fn moving(scene: &Scene, poses: &[Pose]) -> Vec<Standing> {
    let solids = scene.solids[..scene.followed()].iter().zip(poses).filter(|(s, _)| !s.is_still());
    solids.map(|(s, pose)| Standing::new(s.shape, pose.position, pose.orientation, s.is_free())).collect()
}

/// Faces of fixed walls, each a square with an edge of a spacing.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tiles {
    pub spacing: f64,
    pub plane: bool,
    pub periodic: Periodic,
}

impl Tiles {
    /// Of the faces around each of `centers`, `count` of them, the numbers of the `solids` that may reach before it.
    /// Each solid looks at the faces near it: a wall may have as many faces as there are solids.
    pub fn reached(&self, centers: &PointGrid, count: usize, solids: &[Standing]) -> Vec<Vec<usize>> {
        let mut out = vec![vec![]; count];
        for (k, solid) in solids.iter().enumerate() {
            let reach = solid.radius + 2.0 * self.spacing;
            for image in self.periodic.images(self.periodic.wrap(solid.position), reach) {
                centers.near(image, reach, |face| {
                    let own = &mut out[face as usize];
                    if own.last() != Some(&k) {
                        own.push(k);
                    }
                });
            }
        }
        out
    }

    /// Part of the face around `center` that looks along `normal` before which water may stand [-].
    pub fn bare(&self, center: DVec3, normal: DVec3, solids: &[&Standing]) -> f64 {
        if solids.is_empty() {
            return 1.0;
        }
        let l0 = self.spacing;
        let (along, across) =
            if self.plane { (normal.cross(DVec3::Y), DVec3::ZERO) } else { normal.any_orthonormal_pair() };
        let n = POINTS[usize::from(!self.plane)];
        let place = |k: u32| l0 * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
        let covered = |x: DVec3| {
            let at = |d: f64, s: &Standing| s.holds(x + d * l0 * normal, &self.periodic);
            let fading = |s: &Standing| {
                FADING.into_iter().filter(|f| s.is_free && at(f.0, s)).map(|f| f.1).fold(0.0, f64::max)
            };
            let by = |s: &&Standing| if AT.iter().any(|&d| at(d, s)) { 1.0 } else { fading(s) };
            solids.iter().map(by).fold(0.0, f64::max)
        };
        let mut sum = 0.0;
        let rows = if self.plane { 1 } else { n };
        for j in 0..rows {
            for i in 0..n {
                sum += covered(center + place(i) * along + place(j) * across);
            }
        }
        1.0 - sum / f64::from(rows * n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn each_face_has_the_solids_that_comparing_all_finds() {
        let (low, high) = (DVec3::ZERO, DVec3::new(2.0, 1.0, 1.0));
        for axes in [[false; 3], [true, false, false]] {
            let tiles = Tiles { spacing: 0.02, plane: false, periodic: Periodic::new(axes, low, high) };
            let place = |k: usize, n: f64| (k as f64 * n).fract();
            let centers: Vec<DVec3> =
                (0..2000).map(|k| DVec3::new(2.0 * place(k, 0.618), place(k, 0.755), 0.0)).collect();
            let solids: Vec<Standing> = (0..60)
                .map(|k| {
                    let at = DVec3::new(2.0 * place(k, 0.31), place(k, 0.57), 0.2 * place(k, 0.27));
                    let shape = Shape::cuboid(DVec3::splat(0.05 + 0.2 * place(k, 0.43)));
                    Standing::new(shape, at, DQuat::IDENTITY, true)
                })
                .collect();
            let meets = |x: DVec3, s: &Standing| {
                let way = x - s.position;
                let reach = s.radius + 2.0 * tiles.spacing;
                way.length_squared().min(tiles.periodic.nearest(way).length_squared()) < reach * reach
            };
            let grid = PointGrid::new(centers.clone(), 0.08);
            let (mut found, mut looked) = (0, 0);
            for (x, own) in centers.iter().zip(tiles.reached(&grid, centers.len(), &solids)) {
                let all: Vec<usize> = (0..solids.len()).filter(|&k| meets(*x, &solids[k])).collect();
                assert_eq!(own, all, "{axes:?} {x}");
                found += all.len();
                looked += solids.len();
            }
            assert!(found > 1000 && 10 * found < looked, "{found} of {looked}");
        }
    }
}
