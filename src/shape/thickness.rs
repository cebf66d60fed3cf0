//! How thin a solid is. What counts is a plate, which particles cannot fill, and not a tip: a solid that ends in an
//! edge is as thin as one likes near it, and its particles end a little before. How near to the edge somebody has put
//! the pieces of its surface says nothing.

use glam::DVec3;

/// Of how long the way is, an edge may lie beside the surface.
const BESIDE: f64 = 0.25;
/// Cosine from which on two sides look away from each other.
const AWAY: f64 = 0.5;

/// The way from the middle of a piece of a surface straight inwards to the surface again.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    pub start: DVec3,
    /// Unit direction.
    pub inwards: DVec3,
    pub length: f64,
    /// Area of the piece, or its length in the plane.
    pub area: f64,
    /// Normal of the surface where it ends, outwards.
    pub outward: DVec3,
}

impl Way {
    /// Where the planes of the surface at both ends meet; nothing if they do not.
    fn edge(&self) -> Option<DVec3> {
        let cos = self.inwards.dot(self.outward);
        let along = self.outward - cos * self.inwards;
        let sin = along.length();
        (sin > 1e-6).then(|| self.start + self.length * cos / sin * (along / sin))
    }
}

/// Thickness [m] and place where a solid is thinnest, by `ways` from all pieces of its surface, with the `distance`
/// of a point from that. Where it is tips for the most part, it is as thin as they are at most.
pub(super) fn thinnest(ways: impl Iterator<Item = Way>, distance: impl Fn(DVec3) -> f64) -> (f64, DVec3) {
    let (mut plate, mut tip) = ((f64::INFINITY, DVec3::ZERO), (0.0, DVec3::ZERO));
    let (mut all, mut of_tips) = (0.0, 0.0);
    for way in ways {
        let here = (way.length, way.start);
        all += way.area;
        if way.edge().is_some_and(|edge| distance(edge) <= BESIDE * way.length) {
            of_tips += way.area;
            if way.inwards.dot(way.outward) > AWAY && way.length > tip.0 {
                tip = here;
            }
        } else if way.length < plate.0 {
            plate = here;
        }
    }
    if of_tips > 0.5 * all && tip.0 > 0.0 && tip.0 < plate.0 { tip } else { plate }
}
