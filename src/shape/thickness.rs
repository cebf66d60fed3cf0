//! How thin a solid is. What counts is a plate, which particles cannot fill, and not a tip: a solid that ends in an
//! edge is as thin as one likes near it, and its particles end a little before. So do those of a blunt end from which
//! the solid widens, and of what is rough. How near to the edge somebody has put the pieces of its surface says
//! nothing.

use glam::DVec3;

/// Of how long the way is, an edge may lie beside the surface.
const BESIDE: f64 = 0.25;
/// Cosine from which on two sides look away from each other.
const AWAY: f64 = 0.5;
/// Where the solid becomes so much wider within so many thicknesses, two sides are no plate.
const WIDER: f64 = 1.5;
const WITHIN: f64 = 3.0;
/// Of that width, how much must be there: sides may be round.
const THERE: f64 = 0.9;
/// Places at which that is looked for, over the distance from where the planes of both sides meet.
const FARTHER: [f64; 5] = [1.5, 2.0, 3.0, 4.0, 6.0];

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

    /// Whether it leads through an end from which the solid widens: farther from where the planes of both sides meet,
    /// it has room for a larger ball than the one between them that touches the surface where the way starts.
    fn is_of_end(&self, surface: &impl Surface) -> bool {
        let cos = self.inwards.dot(self.outward).clamp(0.0, 1.0);
        let Some(edge) = self.edge() else { return false };
        let off = self.start.distance(edge);
        let radius = ((1.0 - cos) / (1.0 + cos)).sqrt() * off;
        let middle = self.start + radius * self.inwards;
        let from = self.start + 1e-6 * self.length * self.inwards;
        let mut farther = FARTHER.into_iter().take_while(|by| (by - 1.0) * off <= WITHIN * self.length);
        farther.any(|by| {
            let ball = edge + by * (middle - edge);
            !surface.comes_within(ball, THERE * WIDER * radius) && !surface.parts(from, ball)
        })
    }

    fn is_of_tip(&self, surface: &impl Surface) -> bool {
        let is_beside = |edge: DVec3| surface.comes_within(edge, BESIDE * self.length);
        self.edge().is_some_and(is_beside) || self.is_of_end(surface)
    }

    /// Whether both sides look away from each other.
    fn is_across(&self) -> bool {
        self.inwards.dot(self.outward) > AWAY
    }
}

/// The surface of a solid.
pub(super) trait Surface {
    /// Whether it is nearer to `q` than `distance` [m].
    fn comes_within(&self, q: DVec3, distance: f64) -> bool;

    /// Whether it lies between two points.
    fn parts(&self, a: DVec3, b: DVec3) -> bool;
}

/// Thickness [m] and place where a solid is thinnest, by `ways` from all pieces of its surface. Where it is tips for
/// the most part, it is as thin as they are at most.
pub(super) fn thinnest(ways: impl Iterator<Item = Way>, surface: &impl Surface) -> (f64, DVec3) {
    let mut ways: Vec<Way> = ways.collect();
    ways.sort_by(|a, b| a.length.total_cmp(&b.length));
    let all: f64 = ways.iter().map(|way| way.area).sum();
    // What is longer than the shortest way through a plate says no more.
    let plate = ways.iter().position(|way| !way.is_of_tip(surface)).unwrap_or(ways.len());
    let (tips, longer) = ways.split_at(plate);
    let of_tips: f64 = tips.iter().map(|way| way.area).sum();
    let told = tips.iter().rfind(|way| of_tips > 0.5 * all && way.is_across());
    let told = told.filter(|_| !longer.iter().any(|way| way.is_across() && way.is_of_tip(surface)));
    told.or(longer.first()).map_or((f64::INFINITY, DVec3::ZERO), |way| (way.length, way.start))
}

#[cfg(test)]
mod tests {
    use crate::shape::Polygon;

    /// Thickness of the section with these corners, whose sides are cut into `pieces` each.
    fn thickness(corners: &[[f64; 2]], pieces: u32) -> f64 {
        let mut cut = vec![];
        for (k, a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let on = |n: u32| [0, 1].map(|k| a[k] + f64::from(n) / f64::from(pieces) * (b[k] - a[k]));
            cut.extend((0..pieces).map(on));
        }
        Polygon::new(&cut, 0.1).thinnest().0
    }

    #[test]
    fn blunt_ends_and_rough_sides_are_no_plates() {
        // A pile 0.4 m wide with a foot of 0.05 m.
        let foot = [[-0.025, 0.0], [0.025, 0.0], [0.2, 0.5], [0.2, 1.0], [-0.2, 1.0], [-0.2, 0.5]];
        assert!((0.3..0.41).contains(&thickness(&foot, 20)), "{}", thickness(&foot, 20));
        // A round one of 1 m with teeth of 20 mm.
        let tooth = |k: u32| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 120.0).sin_cos();
            [cos, sin].map(|x| x * (0.5 - 0.02 * f64::from(k % 2)))
        };
        let teeth: Vec<[f64; 2]> = (0..120).map(tooth).collect();
        assert!((0.7..1.0).contains(&thickness(&teeth, 1)), "{}", thickness(&teeth, 1));
    }

    #[test]
    fn what_is_thin_all_along_is_told_in_spite_of_its_taper() {
        // A wall of 0.1 m that goes to 0.06 m over 1 m, and one that widens for as long as there is of it.
        let wall = [[0.0, 0.0], [0.1, 0.0], [0.08, 1.0], [0.02, 1.0]];
        assert!((0.06..0.065).contains(&thickness(&wall, 20)), "{}", thickness(&wall, 20));
        let fin = [[0.0, 0.0], [0.1, 0.0], [0.08, 0.2], [0.02, 0.2]];
        assert!(thickness(&fin, 20) < 0.09, "{}", thickness(&fin, 20));
    }
}
