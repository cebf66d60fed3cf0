//! Sides of still prisms and meshes at which other still solids or walls stand: nothing can come from there, and what
//! slides over the joint must not be pushed along it.

use super::walls::COVERED;
use crate::scene::{Scene, Solid, WallShape};
use crate::shape::{Cuboid, Shape, Surface};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// A solid that stands still for ever, or a wall.
#[derive(Clone, Copy, Debug)]
pub(super) struct Still {
    center: DVec3,
    axes: DMat3,
    shape: Shape,
    radius: f64,
}

impl Still {
    fn new(center: DVec3, axes: DMat3, shape: Shape) -> Self {
        Self { center, axes, shape, radius: shape.radius() }
    }

    /// Whether it fills the place just before `x` [m] of another's surface that looks along `normal`. A face of its own
    /// in the same plane does not.
    pub fn fills(&self, x: DVec3, normal: DVec3, spacing: f64) -> bool {
        self.touches(x + 1.5 * COVERED * spacing * normal, spacing)
    }

    /// Whether it holds `x` [m] or is next to it.
    fn touches(&self, x: DVec3, spacing: f64) -> bool {
        self.shape.outside(self.axes.transpose() * (x - self.center)) < COVERED * spacing
    }
}

/// The solids of `scene` that stand still for ever, with their numbers.
fn standing(scene: &Scene) -> impl Iterator<Item = (usize, Still)> {
    let of =
        |solid: &Solid| Still::new(solid.shape_center(), DMat3::from_quat(solid.orientation), solid.shape);
    let solids = scene.solids.iter().enumerate();
    solids.filter(|(k, _)| scene.stands(*k)).map(move |(k, solid)| (k, of(solid)))
}

/// Still solids of `scene` that are no boxes.
pub(super) fn no_boxes(scene: &Scene) -> Vec<Still> {
    standing(scene).map(|(_, still)| still).filter(|still| still.shape.as_cuboid().is_none()).collect()
}

/// Takes the sides of still solids that others cover out of their `surfaces`, one for each solid of `scene`: what is
/// left is their open shape, and the points that others do not touch. A corner of two that are flush is none of both
/// together.
pub(super) fn take_covered(scene: &Scene, surfaces: &mut [Arc<Surface>]) {
    let solids: Vec<(usize, Still)> = standing(scene).collect();
    let wall = |w: &WallShape| Still::new(w.center, w.axes, Shape::Box(Cuboid { half: w.half }));
    let walls: Vec<Still> = scene.walls.iter().map(wall).collect();
    for &(k, own) in solids.iter().filter(|(_, own)| own.shape.as_cuboid().is_none()) {
        let others = solids.iter().filter(|(j, _)| *j != k).map(|(_, other)| *other);
        let mut near: Vec<Still> = others.chain(walls.iter().copied()).collect();
        near.retain(|s| s.center.distance(own.center) < s.radius + own.radius + scene.spacing);
        let covered = |q: DVec3, normal: DVec3| {
            let (x, normal) = (own.center + own.axes * q, own.axes * normal);
            near.iter().any(|other| other.fills(x, normal, scene.spacing))
        };
        let Some(open) = own.shape.uncovered(scene.spacing, &covered) else { continue };
        let touched =
            |q: DVec3| near.iter().any(|other| other.touches(own.center + own.axes * q, scene.spacing));
        surfaces[k] = Arc::new(Surface { open: Some(open), ..surfaces[k].without(touched) });
    }
}
