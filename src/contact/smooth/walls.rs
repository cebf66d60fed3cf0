//! What never moves, as contact sees it: fixed walls and still boxes, with the faces, edges and corners that bodies
//! can reach.
//!
//! All of a wall is real that no other wall covers: the back and the sides of a plane, the rims of an open tank.
//! A face that counts for nothing although a body can reach it would give the distance to another face to
//! whatever comes in through it, and a force to match.

mod feet;

use super::flush::{self, Still};
use crate::contact::between::Against;
use crate::periodic::Periodic;
use crate::scene::{Scene, WallShape};
use crate::shape::{ALL_FACES, Cuboid, Faces, Geometry, Line, PLANE_FACES, Shape, face_normal};
use glam::{DMat3, DVec3};

/// A fixed wall or a still box.
#[derive(Clone, Debug)]
pub(crate) struct WallBox {
    /// What it is of the scene.
    pub of: Against,
    /// Where torques on a still box count about [m].
    pub middle: DVec3,
    pub center: DVec3,
    pub axes: DMat3,
    pub half: DVec3,
    /// Faces that bodies can reach.
    pub faces: Faces,
    /// Edges that bodies can reach, world.
    pub edges: Vec<Line>,
    /// Corners that bodies can reach, world [m].
    pub corners: Vec<DVec3>,
}

impl WallBox {
    /// One of half edges `half` [m] along the axes of the world, with no face open.
    fn new(of: Against, center: DVec3, half: DVec3) -> Self {
        let axes = DMat3::IDENTITY;
        Self { of, middle: center, center, axes, half, faces: 0, edges: vec![], corners: vec![] }
    }

    /// Its shape.
    pub fn shape(&self) -> Shape {
        Shape::Box(Cuboid { half: self.half })
    }

    /// `x` [m] of the world in its frame.
    fn local(&self, x: DVec3) -> DVec3 {
        self.axes.transpose() * (x - self.center)
    }

    fn world(&self, q: DVec3) -> DVec3 {
        self.center + self.axes * q
    }

    /// Whether the face that looks along `normal`, if one does, is open.
    fn is_open_towards(&self, normal: DVec3) -> bool {
        let along = self.axes.transpose() * normal;
        let face = (0..6_u8).find(|&face| face_normal(face).dot(along) > 0.999);
        face.is_none_or(|face| self.faces >> face & 1 == 1)
    }

    /// Moves a face out by `length` [m]; the opposite one stays.
    fn move_face(&mut self, face: u8, length: f64) {
        self.half[usize::from(face / 2)] += 0.5 * length;
        self.center += 0.5 * length * (self.axes * face_normal(face));
    }
}

/// Gap over the spacing up to which a wall covers what it faces: nothing fits in between.
pub(super) const COVERED: f64 = 2e-3;
/// Height over the spacing up to which what covers a face must fill the place before it: at the bottom of a groove it does not, and
/// a corner that comes down there finds the face.
const GROOVE: f64 = 0.5;
/// Most points along an edge of a face at which it is looked at whether it is covered.
const MOST_LOOKS: f64 = 1000.0;

/// The box of solid `k` of `scene`, if it is pressed as walls are: it stands still for ever. The layer in an opening does not, it goes and comes
/// with the water that passes, and has no part in contact: the box of the tank's wall goes on behind it.
pub(super) fn still_box(scene: &Scene, k: usize) -> Option<&Cuboid> {
    let solid = &scene.solids[k];
    solid.shape.as_cuboid().filter(|_| scene.stands(k))
}

/// The walls and still boxes of a scene.
pub(crate) fn walls(scene: &Scene) -> Vec<WallBox> {
    let still = scene.solids.iter().enumerate().filter_map(|(k, solid)| {
        let Cuboid { half } = *still_box(scene, k)?;
        let axes = DMat3::from_quat(solid.orientation);
        Some(WallBox { axes, ..WallBox::new(Against::Solid(k), solid.position, half) })
    });
    let beside = flush::no_boxes(scene);
    of(fixed(&scene.walls).chain(still), &beside, &scene.periodic, scene.spacing, scene.dimensions == 2)
}

/// Fixed walls as boxes.
fn fixed(walls: &[WallShape]) -> impl Iterator<Item = WallBox> {
    walls.iter().enumerate().map(|(k, wall)| WallBox {
        axes: wall.axes,
        ..WallBox::new(Against::Wall(k), wall.center, wall.half)
    })
}

/// `boxes` and their images, with what of them bodies can reach, with `beside` at some of their faces.
fn of(
    boxes: impl Iterator<Item = WallBox>,
    beside: &[Still],
    periodic: &Periodic,
    spacing: f64,
    flat: bool,
) -> Vec<WallBox> {
    let mut walls: Vec<WallBox> = boxes.flat_map(|wall| images(wall, periodic, spacing)).collect();
    let all: Faces = if flat { PLANE_FACES } else { ALL_FACES };
    walls.iter_mut().for_each(|wall| wall.faces = all);
    for k in 0..walls.len() {
        for face in (0..6).filter(|face| all >> face & 1 == 1) {
            if is_closed(&walls, beside, k, face, spacing, flat) {
                walls[k].faces &= !(1 << face);
            }
        }
    }
    for k in 0..walls.len() {
        let (edges, corners) = wall_edges(&walls, k, spacing, flat);
        (walls[k].edges, walls[k].corners) = (edges, corners);
    }
    feet::set(&mut walls, spacing, flat);
    walls
}

/// Places half a spacing apart across an edge of half length `half` [m]; the middle of one that is seen end on.
fn looks(half: f64, spacing: f64, end_on: bool) -> Vec<f64> {
    let n = if end_on { 1.0 } else { (4.0 * half / spacing).ceil().clamp(2.0, MOST_LOOKS) };
    (0..n as usize).map(|i| ((2.0 * i as f64 + 1.0) / n - 1.0) * half).collect()
}

/// `wall` and its images over periodic sides that lie up to half a length beyond them: bodies are brought back between the sides. A wall that
/// spans an axis goes on by a length instead.
fn images(mut wall: WallBox, periodic: &Periodic, spacing: f64) -> Vec<WallBox> {
    let (center, length) = (wall.center, periodic.length());
    let half = wall.shape().extent(wall.axes);
    let spans = [0, 1, 2].map(|k| periodic.is_along(k) && 2.0 * half[k] > length[k] - COVERED * spacing);
    for k in (0..3).filter(|&k| spans[k]) {
        // what ends at both sides lies along the axes
        wall.half += length[k] * (wall.axes.transpose() * DVec3::AXES[k]).abs();
    }
    let reach = DVec3::from_array([0, 1, 2].map(|k| if spans[k] { 0.0 } else { half[k] + 0.5 * length[k] }));
    let turns = periodic.turns(center - reach, center + reach);
    let image = |way: DVec3| WallBox { middle: center + way, center: center + way, ..wall.clone() };
    turns.map(|turns| image(periodic.way(turns))).collect()
}

/// Whether another wall than `k` holds the point `q` of its frame or is next to it.
fn is_covered(walls: &[WallBox], k: usize, q: DVec3, spacing: f64) -> bool {
    let x = walls[k].world(q);
    let near = |w: &WallBox| Cuboid { half: w.half }.outside(w.local(x)) < COVERED * spacing;
    walls.iter().enumerate().any(|(other, w)| other != k && near(w))
}

/// Whether other walls leave nothing free of a face of wall `k`: they stand before it, or have a face of their own in its plane that is still open. Of faces
/// that cover each other one is left.
fn is_closed(walls: &[WallBox], beside: &[Still], k: usize, face: u8, spacing: f64, flat: bool) -> bool {
    let normal = walls[k].axes * face_normal(face);
    let covers = |w: &WallBox, x: DVec3| {
        let near = |x: DVec3| Cuboid { half: w.half }.outside(w.local(x)) < COVERED * spacing;
        near(x) && (near(x + 1.5 * COVERED * spacing * normal) || w.is_open_towards(normal))
    };
    let filled = |x: DVec3| beside.iter().any(|still| still.fills(x, normal, spacing));
    let places = |axis: usize| looks(walls[k].half[axis], spacing, flat && axis == 1);
    all_places(walls, k, face, 0.5 * COVERED * spacing, places, |q| {
        let x = walls[k].world(q);
        walls.iter().enumerate().any(|(other, w)| other != k && covers(w, x))
            || filled(x) && filled(x + GROOVE * spacing * normal)
    })
}

/// Whether other walls leave nothing of the plane `beyond` [m] outside of a face of wall `k`, by points half a spacing apart.
fn face_is_covered(walls: &[WallBox], k: usize, face: u8, beyond: f64, spacing: f64, flat: bool) -> bool {
    let places = |axis: usize| looks(walls[k].half[axis], spacing, flat && axis == 1);
    places_are_covered(walls, k, face, beyond, spacing, places)
}

/// Whether other walls hold the corners of a face of wall `k`, moved out by `beyond` [m].
fn corners_are_covered(walls: &[WallBox], k: usize, face: u8, beyond: f64, spacing: f64, flat: bool) -> bool {
    let ends = |half: f64| vec![-half, half];
    let places = |axis: usize| if flat && axis == 1 { vec![0.0] } else { ends(walls[k].half[axis]) };
    places_are_covered(walls, k, face, beyond, spacing, places)
}

/// Whether other walls hold all of the plane `beyond` [m] outside of a face of wall `k`, at `places` along its two axes [m].
fn places_are_covered(
    walls: &[WallBox],
    k: usize,
    face: u8,
    beyond: f64,
    spacing: f64,
    places: impl Fn(usize) -> Vec<f64>,
) -> bool {
    all_places(walls, k, face, beyond, places, |q| is_covered(walls, k, q, spacing))
}

/// Whether something `holds` of all points of the plane `beyond` [m] outside of a face of wall `k`, in its frame, at `places` along its two axes [m].
fn all_places(
    walls: &[WallBox],
    k: usize,
    face: u8,
    beyond: f64,
    places: impl Fn(usize) -> Vec<f64>,
    holds: impl Fn(DVec3) -> bool,
) -> bool {
    let normal = usize::from(face / 2);
    let (u, v) = ((normal + 1) % 3, (normal + 2) % 3);
    let (along_u, along_v) = (places(u), places(v));
    along_u.iter().all(|&x| {
        along_v.iter().all(|&y| {
            let mut q = face_normal(face) * (walls[k].half + beyond);
            (q[u], q[v]) = (x, y);
            holds(q)
        })
    })
}

/// Edges between two open faces of wall `k` and corners between three, as far as no other wall covers them. A
/// body's face has points every spacing, so it could sink on an edge that lies between them. In two dimensions
/// edges are seen end on and are the corners.
fn wall_edges(walls: &[WallBox], k: usize, spacing: f64, flat: bool) -> (Vec<Line>, Vec<DVec3>) {
    let wall = &walls[k];
    let is_open = |axis: usize, side: f64| wall.faces & 1 << (2 * axis as u8 + u8::from(side > 0.0)) != 0;
    // what leans on another wall is no edge of the union
    let outside = |out: DVec3| out * (wall.half + 0.5 * COVERED * spacing);
    let (mut edges, mut corners) = (vec![], vec![]);
    for along in 0..3_usize {
        let (u, v) = ((along + 1) % 3, (along + 2) % 3);
        for (su, sv) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            if !is_open(u, su) || !is_open(v, sv) || flat && along != 1 {
                continue;
            }
            let out = su * DVec3::AXES[u] + sv * DVec3::AXES[v];
            if flat {
                if !is_covered(walls, k, outside(out), spacing) {
                    corners.push(wall.world(out * wall.half));
                }
                continue;
            }
            let (axis, length) = (DVec3::AXES[along], 2.0 * wall.half[along]);
            let start = out * wall.half - axis * wall.half;
            let just_outside = outside(out) - axis * wall.half;
            for (from, to) in uncovered(walls, k, just_outside, axis, length, spacing) {
                edges.push(Line {
                    start: wall.world(start + from * axis),
                    along: wall.axes * axis,
                    length: to - from,
                    density: 0.0,
                });
            }
        }
    }
    for corner in 0..if flat { 0 } else { 8 } {
        let side = |axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
        let out = DVec3::new(side(0), side(1), side(2));
        let open = (0..3).all(|axis| is_open(axis, side(axis)));
        if open && !is_covered(walls, k, outside(out), spacing) {
            corners.push(wall.world(out * wall.half));
        }
    }
    (edges, corners)
}

/// Stretches of the line from `start` along `along`, of the frame of wall `k`, that no other wall covers.
fn uncovered(
    walls: &[WallBox],
    k: usize,
    start: DVec3,
    along: DVec3,
    length: f64,
    spacing: f64,
) -> Vec<(f64, f64)> {
    let (start, along) = (walls[k].world(start), walls[k].axes * along);
    let mut open: Vec<(f64, f64)> = vec![(0.0, length)];
    for (_, wall) in walls.iter().enumerate().filter(|(other, _)| *other != k) {
        let grown = Cuboid { half: wall.half + COVERED * spacing };
        let local = (wall.local(start), wall.axes.transpose() * along);
        let Some((from, to)) = grown.clip(local.0, local.1, length) else { continue };
        let parts = open.iter().flat_map(|&(a, b)| [(a, b.min(from)), (a.max(to), b)]);
        open = parts.filter(|(a, b)| b - a > COVERED * spacing).collect();
    }
    open
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn wall(low: [f64; 3], high: [f64; 3]) -> WallBox {
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        WallBox::new(Against::Wall(0), 0.5 * (low + high), 0.5 * (high - low))
    }

    #[test]
    fn what_another_wall_covers_is_not_there_and_all_else_is() {
        // a floor with a lower step against it and a block on it
        let mut walls = vec![
            wall([0.0, 0.0, -1.0], [2.0, 1.0, 0.0]),
            wall([2.0, 0.0, -1.0], [3.0, 1.0, -0.5]),
            wall([0.5, 0.2, 0.0], [1.0, 0.4, 0.3]),
        ];
        let open = |k: usize| -> Faces {
            (0..6).filter(|&f| !face_is_covered(&walls, k, f, 1e-6, 0.05, false)).map(|f| 1 << f).sum()
        };
        // x_min of the step lies against the floor, z_min of the block on it
        let faces = [open(0), open(1), open(2)];
        assert_eq!(faces, [ALL_FACES, ALL_FACES & !1, ALL_FACES & !(1 << 4)]);
        for (wall, faces) in walls.iter_mut().zip(faces) {
            wall.faces = faces;
        }
        let (edges, corners) = wall_edges(&walls, 0, 0.05, false);
        // the lower edge at x = 2 leans on the step, whose own lower edges go on; of its upright ones at x = 2 half is left
        let at = |x: f64, z: f64| {
            let on =
                |e: &&Line| e.along.y.abs() > 0.5 && (e.start - DVec3::new(x, e.start.y, z)).length() < 1e-9;
            edges.iter().filter(on).map(|e| e.length).sum::<f64>()
        };
        assert!((at(2.0, 0.0) - 1.0).abs() < 1e-9 && (at(0.0, -1.0) - 1.0).abs() < 1e-9);
        let upright: f64 =
            edges.iter().filter(|e| e.along.z.abs() > 0.5 && e.start.x > 1.0).map(|e| e.length).sum();
        assert!((upright - 1.0).abs() < 1e-2, "{upright}");
        assert!(corners.contains(&DVec3::new(2.0, 1.0, 0.0)) && corners.len() >= 6, "{corners:?}");
    }

    /// Open faces of `walls`, l0 = 0.02 m.
    fn open(walls: &[WallBox]) -> Vec<Faces> {
        of(walls.iter().cloned(), &[], &Periodic::default(), 0.02, false).iter().map(|w| w.faces).collect()
    }

    #[test]
    fn of_faces_in_one_plane_that_cover_each_other_one_is_open() {
        let up = 1 << 5;
        // A slab, and two that lie in it and leave nothing of its top.
        let slab = wall([0.0, 0.0, -0.2], [2.0, 1.0, 0.0]);
        let [left, right] = [(0.0, 1.0), (1.0, 2.0)].map(|(a, b)| wall([a, 0.0, -0.1], [b, 1.0, 0.0]));
        for walls in [
            [slab.clone(), left.clone(), right.clone()],
            [left.clone(), slab.clone(), right.clone()],
            [left.clone(), right, slab.clone()],
        ] {
            let tops: Vec<bool> = open(&walls).iter().map(|faces| faces & up != 0).collect();
            assert!(tops.iter().filter(|open| **open).count() >= 1, "{tops:?}");
            // All of the slab's top is that of one of them.
            let area: f64 =
                walls.iter().zip(&tops).filter(|(_, open)| **open).map(|(w, _)| 2.0 * w.half.x).sum();
            assert!(area >= 2.0 - 1e-9, "{tops:?}");
        }
        // The same box twice is one.
        let twice = open(&[slab.clone(), slab.clone()]);
        assert_eq!(twice[0] | twice[1], ALL_FACES);
        assert_eq!(twice[0] & twice[1], 0);
        // What lies in a larger one, flush with it, has no face of its own; what stands before a face closes it.
        assert_eq!(open(&[left.clone(), slab.clone()])[0] & up, 0);
        let on_it = wall([0.0, 0.0, 0.0], [2.0, 1.0, 0.1]);
        let tops: Vec<bool> = open(&[slab, on_it]).iter().map(|faces| faces & up != 0).collect();
        assert_eq!(tops, [false, true]);
    }
}
