//! Shapes at any place and angle: overlap and the lift that ends it, by separating axes.
//!
//! Two boxes are told apart by one of 15 directions. Round shapes have a continuum of them, so from the best of
//! the distinguished ones a search goes on to the best of all.

use super::WallShape;
use crate::shape::{Cuboid, Shape};
use glam::{DMat3, DVec3};

/// Step of the search [rad] at its start and at its end.
const SEARCH: (f64, f64) = (0.2, 1e-9);

/// A shape at any place and angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub center: DVec3,
    pub shape: Shape,
    /// Columns are the shape's axes in the world.
    pub axes: DMat3,
}

impl From<&WallShape> for Placed {
    fn from(wall: &WallShape) -> Self {
        Self::cuboid(wall.center, wall.half, wall.axes)
    }
}

impl Placed {
    /// A box of half edges `half` [m].
    pub fn cuboid(center: DVec3, half: DVec3, axes: DMat3) -> Self {
        Self { center, shape: Shape::Box(Cuboid { half }), axes }
    }
    /// Largest coordinate along a unit vector from the centre [m].
    pub fn reach(&self, n: DVec3) -> f64 {
        self.shape.reach(self.axes.transpose() * n)
    }
    /// Half of the edges of the enclosing box along the world's axes [m].
    pub fn bounds(&self) -> DVec3 {
        DVec3::from_array(DVec3::AXES.map(|n| self.reach(n).max(self.reach(-n))))
    }
    /// Whether a point lies inside by more than `margin` [m] (negative: within that distance).
    pub fn holds(&self, p: DVec3, margin: f64) -> bool {
        self.shape.outside(self.axes.transpose() * (p - self.center)) < -margin
    }
    /// Whether planes tell it apart from what does not touch it.
    pub fn is_convex(&self) -> bool {
        match self.shape {
            #[cfg(feature = "mesh")]
            Shape::Mesh(_) => false,
            _ => true,
        }
    }
    /// How far the shapes overlap along the direction in which they overlap least [m]; 0 or less: apart.
    #[cfg(test)]
    pub fn overlap(&self, other: &Self) -> f64 {
        self.way_out(other).0
    }
    /// The same, with that direction, in which this shape would have to move.
    pub(crate) fn way_out(&self, other: &Self) -> (f64, DVec3) {
        let d = self.center - other.center;
        // a shape need not reach as far one way as the other
        let (overlap, n) = self.least(other, |n| self.between(other, n * d.dot(n).signum()) - d.dot(n).abs());
        (overlap, n * d.dot(n).signum())
    }
    /// Distance of the centres along `n`, the direction to this shape from `other`, at which they touch [m].
    fn between(&self, other: &Self, n: DVec3) -> f64 {
        self.reach(-n) + other.reach(n)
    }
    /// Least distance >= 0 by which this shape has to move along the unit vector `up` to touch `other` only
    /// [m]; infinite if it cannot.
    pub fn lift(&self, other: &Self, up: DVec3) -> f64 {
        let d = self.center - other.center;
        let lift = self.least(other, |n| {
            let (at, rate) = (d.dot(n), up.dot(n));
            let reach = self.between(other, n * rate.signum());
            if at.abs() >= self.between(other, n * at.signum()) {
                0.0
            } else if rate.abs() > 1e-9 {
                (reach - at * rate.signum()) / rate.abs()
            } else {
                f64::INFINITY
            }
        });
        lift.0.max(0.0)
    }

    /// Least value of `of` over all directions that may tell this shape from `other`, and the direction.
    fn least(&self, other: &Self, of: impl Fn(DVec3) -> f64) -> (f64, DVec3) {
        let mut all: Vec<(f64, DVec3)> = axes(self, other).into_iter().map(|n| (of(n), n)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        if self.shape.as_cuboid().is_none() || other.shape.as_cuboid().is_none() {
            all.truncate(4);
            all.iter_mut().for_each(|(least, n)| (*least, *n) = search(*least, *n, &of));
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        all.first().copied().unwrap_or((f64::INFINITY, DVec3::Z))
    }
}

/// Least value of `of` that steps from the direction `n`, where it is `least`, lead to, and its direction.
fn search(mut least: f64, mut n: DVec3, of: impl Fn(DVec3) -> f64) -> (f64, DVec3) {
    let mut step = SEARCH.0;
    while step > SEARCH.1 && least.is_finite() {
        let (u, v) = n.any_orthonormal_pair();
        let around = (0..8).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4);
        let tried = around.map(|a| (n + step * (a.cos() * u + a.sin() * v)).normalize()).map(|n| (of(n), n));
        match tried.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((value, to)) if value < least => (least, n) = (value, to),
            _ => step *= 0.5,
        }
    }
    (least, n)
}

/// Directions along which two shapes that do not overlap may be told apart; of two boxes all 15.
fn axes(a: &Placed, b: &Placed) -> Vec<DVec3> {
    let of = |p: &Placed| p.shape.axes().into_iter().map(|n| p.axes * n).collect::<Vec<_>>();
    let (first, second) = (of(a), of(b));
    // Parallel edges span no new direction.
    let unit = |n: DVec3| (n.length_squared() > 1e-12).then(|| n.normalize());
    let crossed: Vec<DVec3> =
        first.iter().flat_map(|m| second.iter().filter_map(move |n| unit(m.cross(*n)))).collect();
    let mut all: Vec<DVec3> = first.into_iter().chain(second).chain(crossed).collect();
    if a.shape.as_cuboid().is_none() || b.shape.as_cuboid().is_none() {
        // what is round is told apart along the way to it
        all.extend(unit(a.center - b.center));
        for (from, to) in [(a, b), (b, a)] {
            let q = to.axes.transpose() * (from.center - to.center);
            all.push(to.axes * to.shape.distance(q).1.normalize_or(DVec3::Z));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{Cylinder, Sphere};

    #[test]
    fn lifts_a_turned_cube_off_the_floor() {
        let floor = Placed::cuboid(DVec3::new(0.0, 0.0, -0.5), DVec3::new(5.0, 5.0, 0.5), DMat3::IDENTITY);
        let turned = DMat3::from_rotation_y(std::f64::consts::FRAC_PI_4);
        let mut cube = Placed::cuboid(DVec3::new(0.3, 0.1, 0.6), DVec3::splat(0.5), turned);
        let up = DVec3::Z;
        let expected = 0.5f64.sqrt() - 0.6;
        assert!((cube.overlap(&floor) - expected).abs() < 1e-12);
        assert!((cube.lift(&floor, up) - expected).abs() < 1e-12);
        cube.center += up * expected * 1.000001;
        assert!(cube.overlap(&floor) < 0.0);
        assert_eq!(cube.lift(&floor, up), 0.0);
    }

    #[test]
    fn round_shapes_overlap_by_what_their_surfaces_do() {
        let edge = Placed::cuboid(DVec3::ZERO, DVec3::splat(0.5), DMat3::IDENTITY);
        let sphere = Shape::Sphere(Sphere { radius: 0.3 });
        // over the corner of the box, 0.25 m from it
        let away = DVec3::new(1.0, 2.0, 2.0) / 3.0;
        let ball = Placed { center: DVec3::splat(0.5) + 0.25 * away, shape: sphere, axes: DMat3::IDENTITY };
        assert!((ball.overlap(&edge) - 0.05).abs() < 1e-9, "{}", ball.overlap(&edge));
        // lifted along z it touches the corner where 0.3^2 = x^2 + y^2 + z^2
        let (x, y, z) = (0.25 / 3.0, 0.5 / 3.0, 0.5 / 3.0);
        let exact = (0.09_f64 - x * x - y * y).sqrt() - z;
        assert!((ball.lift(&edge, DVec3::Z) - exact).abs() < 1e-7, "{}", ball.lift(&edge, DVec3::Z));
        // a cylinder tilted on its rim
        let axes = DMat3::from_rotation_x(0.4);
        let shape = Shape::Cylinder(Cylinder { radius: 0.2, half_height: 0.3 });
        let height = 0.2 * 0.4_f64.sin() + 0.3 * 0.4_f64.cos();
        let can = Placed { center: DVec3::new(0.0, 0.0, 0.5 + height - 0.01), shape, axes };
        assert!((can.overlap(&edge) - 0.01).abs() < 1e-9, "{}", can.overlap(&edge));
        assert!((can.lift(&edge, DVec3::Z) - 0.01).abs() < 1e-9);
        // two crossed on their sides
        let lying = |z: f64, axes: DMat3| Placed { center: DVec3::new(0.0, 0.0, z), shape, axes };
        let first = lying(0.0, DMat3::from_rotation_x(std::f64::consts::FRAC_PI_2));
        let second = lying(0.41, DMat3::from_rotation_y(std::f64::consts::FRAC_PI_2));
        assert!((first.overlap(&second) + 0.01).abs() < 1e-9);
    }
}
