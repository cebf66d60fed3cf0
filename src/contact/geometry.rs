//! Fixed walls as contact sees them: boxes with the faces, edges and corners that bodies can reach.

use crate::scene::Scene;
use crate::shape::{ALL_FACES, Cuboid, Faces, Geometry, Line, Shape, face_normal};
use glam::{DMat3, DVec3};

/// A fixed wall as contact sees it.
#[derive(Clone, Debug)]
pub(crate) struct WallBox {
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
    /// Its shape.
    pub fn shape(&self) -> Shape {
        Shape::Box(Cuboid { half: self.half })
    }
}

/// Largest distance of `q` beyond a face plane of the box [m]: a lower bound of its distance.
fn outside(q: DVec3, half: DVec3) -> f64 {
    Cuboid { half }.outside(q)
}

/// The walls of a scene. A face can be reached if wall particles that face the free space lie under
/// it; a box without any wall particle (hand-built scenes) shows all its faces.
pub(crate) fn walls(scene: &Scene) -> Vec<WallBox> {
    let spacing = scene.spacing;
    let range = scene.groups.static_wall_range();
    let particles = || scene.position[range.clone()].iter().zip(&scene.static_wall_normal);
    let flat: Faces = if scene.dimensions == 2 { 0b11_0011 } else { ALL_FACES };
    let mut walls: Vec<WallBox> = scene
        .walls
        .iter()
        .map(|wall| {
            let to_box = wall.axes.transpose();
            let mut faces: Faces = 0;
            let mut found = false;
            for (&x, &n) in particles() {
                let q = to_box * (x - wall.center);
                if outside(q, wall.half) > -0.25 * spacing {
                    continue;
                }
                found = true;
                let n = to_box * n;
                for face in 0..6 {
                    let outward = face_normal(face);
                    let below = wall.half[usize::from(face / 2)] - q.dot(outward);
                    if below < 0.75 * spacing && n.dot(outward) > 0.5 {
                        faces |= 1 << face;
                    }
                }
            }
            let faces = if found { faces } else { ALL_FACES } & flat;
            WallBox {
                center: wall.center,
                axes: wall.axes,
                half: wall.half,
                faces,
                edges: vec![],
                corners: vec![],
            }
        })
        .collect();
    for k in 0..walls.len() {
        let (edges, corners) = wall_edges(&walls, k, spacing, scene.dimensions == 2);
        (walls[k].edges, walls[k].corners) = (edges, corners);
    }
    walls
}

/// Edges between two reachable faces of wall `k` and corners between three, unless another wall covers
/// them. A body's face has points every spacing, so it could sink on an edge that lies between them. In
/// two dimensions edges are seen end on and are the corners.
fn wall_edges(walls: &[WallBox], k: usize, spacing: f64, flat: bool) -> (Vec<Line>, Vec<DVec3>) {
    let wall = &walls[k];
    let bit = |axis: usize, side: f64| 1 << (2 * axis as u8 + u8::from(side > 0.0));
    // what leans on another wall is no edge of the union
    let covered = |at: DVec3, out: DVec3| {
        let world = wall.center + wall.axes * (at + 1e-3 * spacing * out);
        walls.iter().enumerate().any(|(other, w)| {
            other != k && outside(w.axes.transpose() * (world - w.center), w.half) < 2e-3 * spacing
        })
    };
    let (mut edges, mut corners) = (vec![], vec![]);
    for along in 0..3_usize {
        let (u, v) = ((along + 1) % 3, (along + 2) % 3);
        for (su, sv) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            if wall.faces & bit(u, su) == 0 || wall.faces & bit(v, sv) == 0 || flat && along != 1 {
                continue;
            }
            let out = su * DVec3::AXES[u] + sv * DVec3::AXES[v];
            let middle = out * wall.half;
            if covered(middle, out) {
                continue;
            }
            let axis = DVec3::AXES[along];
            if flat {
                corners.push(wall.center + wall.axes * middle);
                continue;
            }
            edges.push(Line {
                start: wall.center + wall.axes * (middle - axis * wall.half),
                along: wall.axes * axis,
                length: 2.0 * wall.half[along],
                density: 0.0,
            });
        }
    }
    for corner in 0..if flat { 0 } else { 8 } {
        let side = |axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
        let out = DVec3::new(side(0), side(1), side(2));
        if (0..3).all(|axis| wall.faces & bit(axis, side(axis)) != 0) && !covered(out * wall.half, out) {
            corners.push(wall.center + wall.axes * (out * wall.half));
        }
    }
    (edges, corners)
}
