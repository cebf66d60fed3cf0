//! Which way a particle of a wall layer faces: N of Eq. (14), the normal of the face that presses.
//!
//! A particle on an edge of a box is of two faces, one of a plate that is one particle thick of both its sides. The mean of their normals would
//! push what lies across an edge aside, stop what slides over the joint of two boxes, and let everything through the plate. So N is the one of
//! its faces that looks most towards the other particle.

use crate::scene::{Scene, Solid};
use glam::{DMat3, DQuat, DVec3};

/// How far towards another particle a face of a later axis has to look more than one of an earlier axis [-]: on a lattice both look alike,
/// and host and device take the same.
const MORE: f64 = 1e-3;

/// The way of a particle of a wall layer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing {
    /// Unit normal, of the mean of the faces where there are several.
    normal: DVec3,
    /// The faces of a box of which it is, a bit for each, if it is of several: -x, +x, -y, +y, -z, +z of the box.
    faces: u8,
    /// Turn of the box.
    turn: DQuat,
}

impl Facing {
    /// One normal.
    pub fn one(normal: DVec3) -> Self {
        Self { normal, faces: 0, turn: DQuat::IDENTITY }
    }

    /// Of the particle at `offset` [m] from the middle of a box of half edges `half` [m] whose axes are `axes`; `normal` is the mean of its faces.
    fn of_box(normal: DVec3, offset: DVec3, half: DVec3, axes: DMat3, scene: &Scene) -> Self {
        let (own, place) = (axes.transpose() * normal, axes.transpose() * offset);
        let mut faces = 0_u8;
        for k in (0..3).filter(|&k| scene.dimensions == 3 || k != 1) {
            // One particle thick: the areas of the two sides cancel.
            let both = half[k] < 0.75 * scene.spacing && place[k].abs() < 0.25 * scene.spacing;
            let cancelled = own[k].abs() < 0.1;
            if own[k] < -0.1 || both && cancelled {
                faces |= 1 << (2 * k);
            }
            if own[k] > 0.1 || both && cancelled {
                faces |= 2 << (2 * k);
            }
        }
        if faces.count_ones() < 2 {
            return Self::one(normal);
        }
        Self { normal, faces, turn: DQuat::from_mat3(&axes) }
    }

    /// Of the wall layer of `solid`, in its frame.
    pub fn of_solid(solid: &Solid, scene: &Scene) -> Vec<Self> {
        let normals = solid.wall_area.iter().map(|a| a.normalize_or_zero());
        match solid.shape.as_cuboid() {
            None => normals.map(Self::one).collect(),
            Some(cuboid) => normals
                .zip(&solid.wall_offset)
                .map(|(normal, &x)| {
                    Self::of_box(normal, x - solid.shape_offset, cuboid.half, DMat3::IDENTITY, scene)
                })
                .collect(),
        }
    }

    /// Of fixed particle `k` of `scene`.
    pub fn of_fixed(k: usize, scene: &Scene) -> Self {
        let normal = scene.static_wall_normal[k];
        let wall = &scene.walls[scene.static_wall_shape[k] as usize];
        let x = scene.position[scene.groups.static_wall_range().start + k];
        Self::of_box(normal, x - wall.center, wall.half, wall.axes, scene)
    }

    /// N towards a particle that lies along the unit vector `away` of this one.
    #[inline(always)]
    pub fn towards(&self, away: DVec3) -> DVec3 {
        if self.faces == 0 {
            return self.normal;
        }
        let away = self.turn.conjugate() * away;
        let (mut best, mut chosen) = (f64::NEG_INFINITY, DVec3::ZERO);
        for k in 0..3 {
            for (side, sign) in [(0, -1.0), (1, 1.0)] {
                if self.faces >> (2 * k + side) & 1 == 1 && sign * away[k] > best + MORE {
                    best = sign * away[k];
                    chosen = sign * DVec3::AXES[k];
                }
            }
        }
        self.turn * chosen
    }

    /// Four numbers for a device: a normal and 0, or the vector part of the box's turn and the faces.
    pub fn numbers(&self) -> (DVec3, f64) {
        if self.faces == 0 {
            return (self.normal, 0.0);
        }
        let turn = if self.turn.w < 0.0 { -self.turn } else { self.turn };
        (turn.xyz(), f64::from(self.faces))
    }
}
