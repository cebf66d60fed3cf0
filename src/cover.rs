//! What stands before the faces of walls and driven solids and keeps the water from them: solids of any shape, where they are, and walls.

pub mod driven;

use crate::body::Pose;
use crate::contact::broad::PointGrid;
use crate::periodic::Periodic;
use crate::scene::{COVERED, Scene, Shape, Solid, WallShape};
use glam::{DMat3, DQuat, DVec3};

/// Distance before a face, over l0, at which a point in a solid tells that the face is within it: a surface that bends lies as much behind the plane of a
/// row's face at its ends.
const WITHIN: f64 = -0.15;
/// A point that lies on a solid's surface up to this much, over l0, is half in it: round-off, or how deep bodies press into each other, would tell where it is.
pub(crate) const SLACK: f64 = 1e-2;
/// A gap that is wider than the bound by no more than this, over l0, is as wide: round-off.
const TOUCHING: f64 = 1e-6;
/// Distance behind a face, over l0, at which a point in a wall tells that the face lies flat in the wall's or deeper: more than [`SLACK`].
const FLAT_IN: f64 = -0.02;
/// Edge of the cells that faces are found in, over l0.
pub(crate) const CELL: f64 = 4.0;
/// Points along an edge of a face, in the plane and in space.
const POINTS: [u32; 2] = [10, 5];

/// A solid where it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standing {
    /// Index of the solid; none of a fixed wall.
    solid: Option<usize>,
    shape: Shape,
    position: DVec3,
    to_shape: DMat3,
    radius: f64,
}

impl Standing {
    fn new(number: usize, solid: &Solid, position: DVec3, orientation: DQuat) -> Self {
        Self {
            solid: Some(number),
            shape: solid.shape,
            position: position + orientation * solid.shape_offset,
            to_shape: DMat3::from_quat(orientation.inverse()),
            radius: solid.shape.radius(),
        }
    }

    /// The box of a fixed wall.
    pub(crate) fn wall(wall: &WallShape) -> Self {
        let shape = Shape::cuboid(2.0 * wall.half);
        Self {
            solid: None,
            radius: shape.radius(),
            shape,
            position: wall.center,
            to_shape: wall.axes.transpose(),
        }
    }

    /// Number `number` of the scene's solids in its `pose`.
    pub(crate) fn of(number: usize, solid: &Solid, pose: &Pose) -> Self {
        Self::new(number, solid, pose.position, pose.orientation)
    }

    /// Whether it may reach within `reach` of `x` [m].
    pub(crate) fn may_reach(&self, x: DVec3, reach: f64, periodic: &Periodic) -> bool {
        let way = x - self.position;
        way.length().min(periodic.nearest(way).length()) < self.radius + reach
    }

    /// How far its surface is from `x` [m], negative inside; infinite if no nearer than `reach` [m].
    pub(crate) fn outside(&self, x: DVec3, reach: f64, periodic: &Periodic) -> f64 {
        let way = x - self.position;
        let most = self.radius + reach;
        let outside = |way: DVec3| {
            let is_near = way.length_squared() < most * most;
            if is_near { self.shape.outside(self.to_shape * way) } else { f64::INFINITY }
        };
        let own = outside(way);
        // What spans a periodic axis reaches over its sides.
        if own >= reach && periodic.is_any() { own.min(outside(periodic.nearest(way))) } else { own }
    }

    /// How much of the points about `x` lies inside [-]: half of them where its surface runs through, within `slack` [m].
    fn holds(&self, x: DVec3, slack: f64, periodic: &Periodic) -> f64 {
        let outside = self.outside(x, slack, periodic);
        if outside.abs() <= slack {
            0.5
        } else if outside < 0.0 {
            1.0
        } else {
            0.0
        }
    }
}

/// What never moves before the faces of `wall` of `scene`, or of solids: solids, the walls of openings, and fixed walls, of which the
/// lattice tells those before walls that fit it.
pub(crate) fn still(scene: &Scene, wall: Option<usize>) -> Vec<Standing> {
    let fits = |wall: &WallShape| wall.axes == DMat3::IDENTITY;
    let is_told = |other: &WallShape| wall.is_some_and(|own| fits(&scene.walls[own]) && fits(other));
    let walls = scene.walls.iter().enumerate().filter(|(k, other)| wall != Some(*k) && !is_told(other));
    let opened = scene.followed();
    let solids = scene.solids.iter().enumerate().filter(|(k, s)| s.is_still() || *k >= opened);
    let solids = solids.map(|(k, s)| Standing::new(k, s, s.position, s.orientation));
    walls.map(|(_, wall)| Standing::wall(wall)).chain(solids).collect()
}

/// The solids of `scene` that move, at their `poses`.
pub(crate) fn moving(scene: &Scene, poses: &[Pose]) -> Vec<Standing> {
    let solids = scene.solids[..scene.followed()].iter().zip(poses).enumerate();
    let solids = solids.filter(|(_, (s, _))| !s.is_still());
    solids.map(|(k, (s, pose))| Standing::of(k, s, pose)).collect()
}

/// Faces of wall particles, each a square.
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

    /// Of the faces around each of `centers`, `count` of them, the numbers of the `solids` that may reach before it. Each
    /// solid looks at the faces near it: a wall may have as many faces as there are solids. Centres that are those of a solid in its frame come
    /// with its pose and radius [m].
    pub fn reached<'a>(
        &self,
        (centers, count): (&PointGrid, usize),
        of: Option<(&Pose, f64)>,
        solids: impl IntoIterator<Item = &'a Standing>,
    ) -> Vec<Vec<usize>> {
        let mut out = vec![vec![]; count];
        let (origin, to_frame, size) = match of {
            Some((pose, radius)) => {
                (self.periodic.wrap(pose.position), DMat3::from_quat(pose.orientation.inverse()), radius)
            }
            None => (DVec3::ZERO, DMat3::IDENTITY, 0.0),
        };
        for (k, solid) in solids.into_iter().enumerate() {
            let reach = solid.radius + 2.0 * self.spacing;
            for image in self.periodic.images(self.periodic.wrap(solid.position), reach + size) {
                centers.near(to_frame * (image - origin), reach, |face| {
                    let own = &mut out[face as usize];
                    if own.last() != Some(&k) {
                        own.push(k);
                    }
                });
            }
        }
        out
    }

    /// Edge of a face of `area` [m2]. One that others cut is a stretch as long as a spacing, with its middle no farther from where it ends.
    pub fn edge(&self, area: f64) -> f64 {
        let across = area / self.spacing;
        if self.plane { across } else { across.min(area.sqrt()) }
    }

    /// Points of the face around `center` with an `edge` [m] that looks along `normal`, evenly.
    pub fn points(&self, (center, edge): (DVec3, f64), normal: DVec3) -> impl Iterator<Item = DVec3> {
        let (along, across) = self.tangents(normal);
        let n = POINTS[usize::from(!self.plane)];
        let place = move |k: u32| edge * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
        let rows = if self.plane { 1 } else { n };
        (0..rows).flat_map(move |j| (0..n).map(move |i| center + place(i) * along + place(j) * across))
    }

    fn tangents(&self, normal: DVec3) -> (DVec3, DVec3) {
        if self.plane { (normal.cross(DVec3::Y), DVec3::ZERO) } else { normal.any_orthonormal_pair() }
    }

    /// Part of the face around `center` with an `edge` [m] that looks along `normal` before which water may stand [-].
    pub fn bare(&self, face: (DVec3, f64), normal: DVec3, solids: &[&Standing]) -> f64 {
        self.bare_of(face, normal, solids, |_| false)
    }

    /// The same of a face of a solid that may have moved into those that `take` what lies flat in their faces: the water there presses on these.
    pub fn bare_of(
        &self,
        face: (DVec3, f64),
        normal: DVec3,
        solids: &[&Standing],
        take: impl Fn(&Standing) -> bool,
    ) -> f64 {
        1.0 - self.mean(face, normal, solids, |x, near| {
            let at = |d: f64, s: &Standing| self.holds_before(x + d * self.spacing * normal, normal, s);
            let covers = |s: &&Standing| {
                let flat = if take(s) { at(FLAT_IN, s) } else { 0.0 };
                COVERED.map(|d| at(d, s)).into_iter().fold(flat, f64::max)
            };
            // Of two that meet at the point each has a half.
            near.iter().map(covers).sum::<f64>().min(1.0)
        })
    }

    /// Part of the same `face` that lies within `solids` [-].
    fn within(&self, face: (DVec3, f64), normal: DVec3, solids: &[&Standing]) -> f64 {
        let at = |x: DVec3| x + WITHIN * self.spacing * normal;
        self.mean(face, normal, solids, |x, near| {
            near.iter().map(|s| self.holds(at(x), s)).sum::<f64>().min(1.0)
        })
    }

    /// The same as [`Self::holds`] at a place before a face that looks along `normal`; but where a surface faces that the gap tells, and not whether the place is near it:
    /// as much counts on either side of the gap.
    fn holds_before(&self, x: DVec3, normal: DVec3, solid: &Standing) -> f64 {
        let slack = SLACK * self.spacing;
        let outside = |x: DVec3| solid.outside(x, 4.0 * slack, &self.periodic);
        let here = outside(x);
        if here.abs() > slack {
            f64::from(u8::from(here < 0.0))
        } else if outside(x + 2.0 * slack * normal) < here - slack {
            f64::from(u8::from(here <= TOUCHING * self.spacing))
        } else {
            0.5
        }
    }

    fn holds(&self, x: DVec3, solid: &Standing) -> f64 {
        solid.holds(x, SLACK * self.spacing, &self.periodic)
    }

    /// Mean of `of` over points of the face around `center` that looks along `normal`, each with the `solids` near; 0 where there are none.
    fn mean(
        &self,
        (center, edge): (DVec3, f64),
        normal: DVec3,
        solids: &[&Standing],
        of: impl Fn(DVec3, &[&Standing]) -> f64,
    ) -> f64 {
        let reach = 2.0 * self.spacing;
        let near = |s: &&Standing| s.outside(center, reach, &self.periodic) < reach;
        let near: Vec<&Standing> = solids.iter().copied().filter(near).collect();
        if near.is_empty() {
            return 0.0;
        }
        let (sum, count) = self
            .points((center, edge), normal)
            .fold((0.0, 0.0), |(sum, count), x| (sum + of(x, &near), count + 1.0));
        sum / count
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
                    Standing {
                        solid: None,
                        shape,
                        position: at,
                        to_shape: DMat3::IDENTITY,
                        radius: shape.radius(),
                    }
                })
                .collect();
            let meets = |x: DVec3, s: &Standing| {
                let way = x - s.position;
                let reach = s.radius + 2.0 * tiles.spacing;
                way.length_squared().min(tiles.periodic.nearest(way).length_squared()) < reach * reach
            };
            // As those of a wall, and as those of a solid that has turned and gone on beyond the side.
            let turn = DQuat::from_rotation_z(0.7);
            let pose = Pose {
                position: DVec3::new(if axes[0] { 3.2 } else { 1.2 }, 0.4, 0.1),
                orientation: turn,
                velocity: DVec3::ZERO,
                angular_velocity: DVec3::ZERO,
            };
            let own: Vec<DVec3> =
                centers.iter().map(|x| turn.inverse() * (*x - DVec3::new(1.2, 0.4, 0.1))).collect();
            let (mut found, mut looked) = (0, 0);
            for (points, of) in [(centers.clone(), None), (own, Some((&pose, 2.0)))] {
                let grid = PointGrid::new(points, 0.08);
                for (x, own) in centers.iter().zip(tiles.reached((&grid, centers.len()), of, &solids)) {
                    let all: Vec<usize> = (0..solids.len()).filter(|&k| meets(*x, &solids[k])).collect();
                    assert_eq!(own, all, "{axes:?} {x}");
                    found += all.len();
                    looked += solids.len();
                }
            }
            assert!(found > 1000 && 10 * found < looked, "{found} of {looked}");
        }
    }
}
