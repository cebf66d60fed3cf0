//! What a rank of many is told of a solid's shape: whether it is a box, and one without size in its place.

use super::Shape;
use crate::shape::Sphere;
use glam::DVec3;
use serde::{Deserialize, Deserializer, Serializer};

pub fn serialize<S: Serializer>(shape: &Shape, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_bool(shape.as_cuboid().is_some())
}

pub fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<Shape, D::Error> {
    let is_box = bool::deserialize(from)?;
    Ok(if is_box { Shape::cuboid(DVec3::ZERO) } else { Shape::Sphere(Sphere { radius: 0.0 }) })
}
