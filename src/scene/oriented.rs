//! Shapes at any place and angle: overlap and the lift that ends it, by separating axes.
//!
//! Two boxes are told apart by one of 15 directions. Round shapes have a continuum of them, so from the best of
//! the distinguished ones a search goes on to the best of all.

use super::WallShape;
use crate::shape::{Cuboid, Shape};
use glam::{DMat3, DVec3};

/// Step of the search [rad] at its start and at its end.
const SEARCH: (f64, f64) = (0.2, 1e-9);

/// Most steps of the search: what it has found by then stands, an upper bound of the least value.
const MOST_STEPS: usize = 400;

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
    /// Lower and upper corner of the box around it along the world's axes [m].
    pub fn ends(&self) -> (DVec3, DVec3) {
        let (low, high) = self.shape.bounds(self.axes);
        (self.center + low, self.center + high)
    }
    /// Half of the edges of the box about its centre along the world's axes that holds it [m]: where it ends, see [`Placed::ends`], may be
    /// nearer on one side.
    pub fn bounds(&self) -> DVec3 {
        DVec3::from_array(DVec3::AXES.map(|n| self.reach(n).max(self.reach(-n))))
    }
    /// Whether a point lies inside by more than `margin` [m] (negative: within that distance).
    pub fn holds(&self, p: DVec3, margin: f64) -> bool {
        self.shape.outside(self.axes.transpose() * (p - self.center)) < -margin
    }
    /// Signed distance of a point from its surface [m], below 0 inside; of a box beyond the plane of a face.
    pub fn distance(&self, p: DVec3) -> f64 {
        let q = self.axes.transpose() * (p - self.center);
        if self.shape.as_cuboid().is_some() { self.shape.outside(q) } else { self.shape.distance(q).0 }
    }
    /// See [`crate::shape::Geometry::has_cavities`].
    pub fn has_cavities(&self) -> bool {
        self.shape.has_cavities()
    }
    /// See [`crate::shape::Geometry::in_cavity`].
    pub fn in_cavity(&self, p: DVec3) -> bool {
        self.shape.in_cavity(self.axes.transpose() * (p - self.center))
    }
    /// See [`crate::shape::Geometry::is_convex`].
    pub fn is_convex(&self) -> bool {
        self.shape.is_convex()
    }
    /// How far the shapes overlap along the direction in which they overlap least [m]; 0 or less: apart.
    #[cfg(test)]
    pub fn overlap(&self, other: &Self) -> f64 {
        self.way_out(other, false).0
    }
    /// The same, with that direction, in which this shape would have to move; in the `plane` not out of it.
    pub(crate) fn way_out(&self, other: &Self, plane: bool) -> (f64, DVec3) {
        let of_ball = match (self.shape, other.shape) {
            (Shape::Sphere(ball), _) => other.way_out_of(self.center, ball.radius),
            (_, Shape::Sphere(ball)) => self.way_out_of(other.center, ball.radius).map(|(o, n)| (o, -n)),
            _ => None,
        };
        if let Some(way) = of_ball {
            return way;
        }
        let d = self.center - other.center;
        // a shape need not reach as far one way as the other
        let (overlap, n) = self.least(other, |n| {
            if plane && n.y.abs() > 1e-6 {
                return f64::INFINITY;
            }
            self.between(other, n * d.dot(n).signum()) - d.dot(n).abs()
        });
        (overlap, n * d.dot(n).signum())
    }
    /// How deep the ball of `radius` [m] about a `center` outside reaches into it [m], and the ball's way out.
    fn way_out_of(&self, center: DVec3, radius: f64) -> Option<(f64, DVec3)> {
        let (distance, outward) = self.shape.distance(self.axes.transpose() * (center - self.center));
        (distance > 0.0).then(|| (radius - distance, self.axes * outward))
    }
    /// Widest gap to `other` along an axis of the world [m], and that axis, towards this shape; below 0 where their boxes meet.
    pub fn apart(&self, other: &Self) -> (f64, DVec3) {
        let d = self.center - other.center;
        let gap = d.abs() - self.bounds() - other.bounds();
        let k = gap.max_position();
        (gap[k], DVec3::AXES[k] * d[k].signum())
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

    /// The axes of its shape in the world.
    fn world_axes(&self) -> impl Iterator<Item = DVec3> {
        let turn = self.axes;
        self.shape.axes().into_iter().map(move |n| turn * n)
    }

    /// Least value of `of` over all directions that may tell this shape from `other`, or one of 0 or less, and the direction.
    fn least(&self, other: &Self, of: impl Fn(DVec3) -> f64) -> (f64, DVec3) {
        let mut all: Vec<(f64, DVec3)> = axes(self, other).into_iter().map(|n| (of(n), n)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        // one plane between them is enough
        let may_meet = all.first().is_some_and(|(least, _)| *least > 0.0);
        if may_meet && (self.shape.as_cuboid().is_none() || other.shape.as_cuboid().is_none()) {
            all.truncate(4);
            let guides: Vec<DVec3> = [self, other].into_iter().flat_map(Placed::world_axes).collect();
            all.iter_mut().for_each(|(least, n)| (*least, *n) = search(*least, *n, &guides, &of));
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        all.first().copied().unwrap_or((f64::INFINITY, DVec3::Z))
    }
}

/// Least value of `of` that steps from the direction `n`, where it is `least`, lead to, and its direction.
///
/// What a shape reaches has a crease where a direction is square to one of its axes, `guides`: steps that are not along it climb out of it, ever
/// shorter. So each place is left towards the axes and across them too.
fn search(mut least: f64, mut n: DVec3, guides: &[DVec3], of: impl Fn(DVec3) -> f64) -> (f64, DVec3) {
    const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
    let mut step = SEARCH.0;
    for _ in 0..MOST_STEPS {
        if step <= SEARCH.1 || !least.is_finite() {
            break;
        }
        let (u, v) = n.any_orthonormal_pair();
        let across = guides.iter().filter_map(|g| n.cross(*g).try_normalize());
        let ways =
            [u, v, HALF * (u + v), HALF * (u - v)].into_iter().chain(across.flat_map(|c| [c, c.cross(n)]));
        let tried = ways.flat_map(|w| [w, -w]).map(|w| (n + step * w).normalize()).map(|n| (of(n), n));
        match tried.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((value, to)) if value < least => (least, n) = (value, to),
            _ => step *= 0.5,
        }
    }
    (least, n)
}

/// Directions along which two shapes that do not overlap may be told apart; of two boxes all 15.
fn axes(a: &Placed, b: &Placed) -> Vec<DVec3> {
    let (first, second): (Vec<_>, Vec<_>) = (a.world_axes().collect(), b.world_axes().collect());
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
    fn what_lies_in_the_plane_does_not_leave_it() {
        let slice =
            |x: f64| Placed::cuboid(DVec3::new(x, 0.0, 0.0), DVec3::new(0.1, 0.01, 0.05), DMat3::IDENTITY);
        assert_eq!(slice(0.15).way_out(&slice(0.0), false).1, DVec3::Y);
        let (overlap, out) = slice(0.15).way_out(&slice(0.0), true);
        assert!((overlap - 0.05).abs() < 1e-12 && out == DVec3::X, "{overlap} along {out}");
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

    /// Round shapes that reach a little into long and flat boxes at any place and angle: planes find how far, as the distance of a ball's centre says
    /// at once, in few looks.
    #[test]
    fn the_search_for_a_way_out_ends_and_finds_it() {
        let mut seed = 7_u64;
        let mut draw = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            2.0 * ((seed >> 11) as f64 / (1_u64 << 53) as f64) - 1.0
        };
        let mut most = 0;
        for round in 0..2000 {
            let half = if round % 2 == 0 { DVec3::new(2.0, 1.5, 0.1) } else { DVec3::new(0.05, 0.04, 3.0) };
            let turned = DMat3::from_axis_angle(
                DVec3::new(draw(), draw(), draw()).normalize_or(DVec3::X),
                3.0 * draw(),
            );
            let board =
                Placed::cuboid(DVec3::ZERO, half, if round % 3 == 0 { DMat3::IDENTITY } else { turned });
            let at = |out: f64| board.axes * ((half + out) * DVec3::new(1.0, 0.3, -0.8));
            let coin = Shape::Cylinder(Cylinder { radius: 0.2, half_height: 0.01 });
            let ball = Shape::Sphere(Sphere { radius: 0.2 });
            for shape in [coin, ball] {
                let own = Placed { center: at(0.1 * draw()), shape, axes: turned };
                let looks = std::cell::Cell::new(0);
                let count = |n: DVec3| {
                    looks.set(looks.get() + 1);
                    let d = own.center - board.center;
                    own.between(&board, n * d.dot(n).signum()) - d.dot(n).abs()
                };
                let (overlap, _) = own.least(&board, count);
                most = most.max(looks.get());
                if let Some((exact, _)) = board.way_out_of(own.center, 0.2).filter(|_| shape == ball) {
                    assert!((overlap - exact).abs() < 1e-6, "{overlap} {exact}");
                }
            }
        }
        // without steps along the creases some take millions
        assert!(most < 20_000, "{most} looks");
    }
}
