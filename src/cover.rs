//! What stands before the faces of walls and driven solids and keeps the water from them: solids of any shape, where they are, and walls.

pub mod driven;

use crate::body::Pose;
use crate::periodic::Periodic;
use crate::scene::{Scene, Shape, Solid, WallShape};
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
pub(crate) struct Standing {
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

    /// Whether its surface is nearer to `x` than `reach` [m], or `x` inside.
    fn is_near(&self, x: DVec3, reach: f64, periodic: &Periodic) -> bool {
        let way = x - self.position;
        let most = self.radius + reach;
        let near = |way: DVec3| {
            way.length_squared() < most * most && self.shape.outside(self.to_shape * way) < reach
        };
        // What spans a periodic axis reaches over its sides.
        near(way) || periodic.is_any() && near(periodic.nearest(way))
    }

    fn holds(&self, x: DVec3, periodic: &Periodic) -> bool {
        self.is_near(x, 0.0, periodic)
    }
}

/// Of what the faces are that something may stand before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Before {
    /// A fixed wall, by its index in [`Scene::walls`].
    Wall(usize),
    /// A solid, by its index.
    Solid(usize),
}

/// What never moves before the faces `of` a part of `scene`: solids, the walls of openings, and fixed walls, of which the lattice tells those
/// before walls that fit it.
pub(crate) fn still(scene: &Scene, of: Before) -> Vec<Standing> {
    let fits = |wall: &WallShape| wall.axes == DMat3::IDENTITY;
    let is_told = |wall: &WallShape| matches!(of, Before::Wall(own) if fits(&scene.walls[own]) && fits(wall));
    let walls = scene.walls.iter().enumerate().filter(|(k, wall)| of != Before::Wall(*k) && !is_told(wall));
    let opened = scene.followed();
    let stands = |k: usize, s: &Solid| (s.is_still() || k >= opened) && of != Before::Solid(k);
    let solids = scene.solids.iter().enumerate().filter(|(k, s)| stands(*k, s));
    let solids = solids.map(|(_, s)| Standing::new(s.shape, s.position, s.orientation, false));
    walls.map(|(_, wall)| Standing::wall(wall)).chain(solids).collect()
}

/// The solids of `scene` that move, but for `own`, at their `poses`.
pub(crate) fn moving(scene: &Scene, poses: &[Pose], own: Option<usize>) -> Vec<Standing> {
    let solids = scene.solids[..scene.followed()].iter().zip(poses).enumerate();
    let solids = solids.filter(|(k, (s, _))| !s.is_still() && Some(*k) != own);
    solids
        .map(|(_, (s, pose))| Standing::new(s.shape, pose.position, pose.orientation, s.is_free()))
        .collect()
}

/// Faces of wall particles, each a square with an edge of a spacing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tiles {
    pub spacing: f64,
    plane: bool,
    periodic: Periodic,
}

impl Tiles {
    /// Those of `scene`.
    pub fn new(scene: &Scene) -> Self {
        Self { spacing: scene.spacing, plane: scene.dimensions == 2, periodic: scene.periodic }
    }

    /// Those of `solids` that may reach before the face around `center`.
    pub fn near<'a>(&self, center: DVec3, solids: &'a [Standing]) -> Vec<&'a Standing> {
        solids.iter().filter(|s| s.is_near(center, 2.0 * self.spacing, &self.periodic)).collect()
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
