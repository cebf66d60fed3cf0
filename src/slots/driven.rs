//! What slots press on solids that no force moves, in place of what the rows of these tell there, as on fixed walls: laid on their faces by points, and what is
//! pressed on and bare at once counts once.

use super::{Opposite, Push, Slots};
use crate::body::{Pose, Wrench};
use crate::cover::driven::Covered;
use crate::error::Result;
use crate::kernels::body_force::RowPressure;
use crate::params::Params;
use crate::shape::Face;
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// Which face of which row of which solid.
type Of = (usize, usize, usize);

/// A face that looks back at a push less than this is not pressed on (cosine of the angle).
const BACK: f64 = 0.5;
/// Faces whose middles are as far away but for this, over l0, have a part each.
const AS_NEAR: f64 = 1e-2;

impl Slots {
    /// What the `pushes` do to driven solids and obstacles at `poses`, `covered` in part [N, N m]. `read` tells what slots of particles have.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn on_driven(
        &self,
        poses: &[Pose],
        covered: &[Covered],
        pushes: &[Push],
        params: &Params,
        read: impl FnOnce(&[usize]) -> Result<Vec<RowPressure>>,
    ) -> Result<Vec<(usize, Wrench)>> {
        let mut out = vec![];
        let mut pressed: BTreeMap<Of, f64> = BTreeMap::new();
        for push in pushes {
            let Opposite::Solid(k, row) = push.on else { continue };
            if self.layers[k].free {
                continue;
            }
            let turn = poses[k].orientation;
            let mut area_on = DVec3::ZERO;
            for (row, number, share) in self.faces_before(push, k, row, &poses[k]) {
                let normal = turn * self.face(k, row, number).area.normalize_or_zero();
                let area = share * push.area_on(normal);
                *pressed.entry((k, row, number)).or_default() += area.length();
                area_on += area;
            }
            let force = push.pressure * area_on;
            let arm = params.periodic.nearest(push.at - poses[k].position);
            out.push((k, Wrench { force, torque: arm.cross(force) }));
        }
        if pressed.is_empty() {
            return Ok(out);
        }
        let mut taken: HashMap<Of, f64> = HashMap::new();
        covered.iter().for_each(|c| *taken.entry((c.solid, c.row, c.face)).or_default() += c.area.length());
        let rows: Vec<usize> = pressed.keys().map(|&(k, row, _)| self.layers[k].first + row).collect();
        for ((of, pressed), told) in pressed.into_iter().zip(read(&rows)?) {
            let (k, row, number) = of;
            let (face, turn) = (self.face(k, row, number), poses[k].orientation);
            let (whole, normal) = (face.area.length(), turn * face.area.normalize_or_zero());
            let bare = (whole - taken.get(&of).copied().unwrap_or_default()).clamp(0.0, whole);
            let twice = (bare + pressed - whole).clamp(0.0, bare.min(pressed));
            let force = twice * told.in_force(turn * face.way, params) * normal;
            let arm = turn * (self.layers[k].offset[row] + face.way);
            out.push((k, Wrench { force, torque: arm.cross(force) }));
        }
        Ok(out)
    }

    fn face(&self, k: usize, row: usize, number: usize) -> Face {
        let layer = &self.layers[k];
        let mut faces = layer.edges.faces(row, layer.area[row], layer.to_surface[row]);
        faces.nth(number).unwrap_or_default()
    }

    /// Faces of solid `k` at `pose` that lie before a `push` on its `row`, and how much of it is before each [-]. Of one that none looks back at `row` has all.
    fn faces_before(&self, push: &Push, k: usize, row: usize, pose: &Pose) -> Vec<(usize, usize, f64)> {
        let (layer, l0, to_frame) = (&self.layers[k], self.spacing, pose.orientation.inverse());
        // Of the images that which lies at the row.
        let at_row = pose.position + pose.orientation * layer.offset[row];
        let at = layer.offset[row] + to_frame * self.periodic.nearest(push.at - at_row);
        let area = to_frame * push.area;
        let (edge, way) = (self.tiles.edge(area.length()), area.normalize_or_zero());
        let looks = |face: &Face| -face.area.normalize_or_zero().dot(way);
        let mut near: Vec<(usize, usize, Face)> = vec![];
        layer.grid.near(at, super::FACING.1 * l0 + edge, |n| {
            let n = n as usize;
            let faces = layer.edges.faces(n, layer.area[n], layer.to_surface[n]).enumerate();
            near.extend(faces.filter(|(_, face)| looks(face) > BACK).map(|(number, face)| (n, number, face)));
        });
        if near.is_empty() {
            let faces = layer.edges.faces(row, layer.area[row], layer.to_surface[row]).enumerate();
            let most = faces.max_by(|a, b| looks(&a.1).total_cmp(&looks(&b.1))).map_or(0, |face| face.0);
            return vec![(row, most, 1.0)];
        }
        let points: Vec<DVec3> = self.tiles.points((at, edge), way).collect();
        let mut shares = vec![];
        for x in &points {
            // Where what goes on from the flat one of the two to the other comes to the plane of a face, from its middle.
            let along = |(n, number, face): &(usize, usize, Face)| {
                let (normal, off) = (face.area.normalize_or_zero(), *x - layer.offset[*n] - face.way);
                let on = if layer.bends[*n] & 1 << number != 0 { way } else { normal };
                (off - off.dot(normal) / on.dot(normal) * on).length()
            };
            // Past the edge of a face, where another of its row begins, nothing is.
            let beyond = |n: usize, face: &Face| {
                let others = layer.edges.faces(n, layer.area[n], layer.to_surface[n]);
                let mut planes = others.map(|other| (other, other.area.normalize_or_zero()));
                planes.any(|(other, normal)| {
                    let is_convex = (face.way - other.way).dot(normal) < -AS_NEAR * l0;
                    is_convex && (*x - layer.offset[n] - other.way).dot(normal) > AS_NEAR * l0
                })
            };
            let far: Vec<f64> = near.iter().map(along).collect();
            let least = far.iter().copied().fold(f64::INFINITY, f64::min) + AS_NEAR * l0;
            let before: Vec<&(usize, usize, Face)> =
                near.iter().zip(&far).filter(|(_, far)| **far <= least).map(|(of, _)| of).collect();
            let share = 1.0 / (before.len() * points.len()) as f64;
            let before = before.into_iter().filter(|(n, _, face)| !beyond(*n, face));
            shares.extend(before.map(|&(n, number, _)| (n, number, share)));
        }
        shares
    }
}
