//! Boxes at any angle: overlap and the lift that ends it, by separating axes.

use super::WallShape;
use glam::{DMat3, DVec3};

/// A box at any angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct OrientedBox {
    pub center: DVec3,
    pub half: DVec3,
    /// Columns are the box's axes in the world.
    pub axes: DMat3,
}

impl From<&WallShape> for OrientedBox {
    fn from(wall: &WallShape) -> Self {
        Self { center: wall.center, half: wall.half, axes: wall.axes }
    }
}

impl OrientedBox {
    /// Half of the box's extent along a unit vector [m].
    pub fn reach(&self, n: DVec3) -> f64 {
        (self.axes.transpose() * n).abs().dot(self.half)
    }
    /// Half of the edges of the enclosing box along the world's axes [m].
    pub fn bounds(&self) -> DVec3 {
        DVec3::new(self.reach(DVec3::X), self.reach(DVec3::Y), self.reach(DVec3::Z))
    }
    /// Whether a point lies inside by more than `margin` [m] (negative: within that distance).
    pub fn holds(&self, p: DVec3, margin: f64) -> bool {
        let q = self.axes.transpose() * (p - self.center);
        q.abs().cmplt(self.half - margin).all()
    }
    /// How far the boxes overlap along the direction in which they overlap least [m]; 0 or less: apart.
    pub fn overlap(&self, other: &Self) -> f64 {
        let d = self.center - other.center;
        axes(self, other)
            .map(|n| self.reach(n) + other.reach(n) - d.dot(n).abs())
            .fold(f64::INFINITY, f64::min)
    }
    /// Least distance >= 0 by which this box has to move along the unit vector `up` to touch `other` only [m];
    /// infinite if it cannot.
    pub fn lift(&self, other: &Self, up: DVec3) -> f64 {
        let d = self.center - other.center;
        let mut least = f64::INFINITY;
        for n in axes(self, other) {
            let (reach, at, rate) = (self.reach(n) + other.reach(n), d.dot(n), up.dot(n));
            if at.abs() >= reach {
                return 0.0;
            }
            if rate.abs() > 1e-9 {
                least = least.min((reach - at * rate.signum()) / rate.abs());
            }
        }
        least
    }
}

/// The 15 directions along which two boxes that do not overlap can be told apart.
fn axes(a: &OrientedBox, b: &OrientedBox) -> impl Iterator<Item = DVec3> {
    let (a, b) = (a.axes, b.axes);
    let crossed = (0..9).filter_map(move |i| {
        let n = a.col(i / 3).cross(b.col(i % 3));
        // Parallel edges span no new direction.
        (n.length_squared() > 1e-12).then(|| n.normalize())
    });
    (0..3).map(move |i| a.col(i)).chain((0..3).map(move |i| b.col(i))).chain(crossed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lifts_a_turned_cube_off_the_floor() {
        let floor = OrientedBox {
            center: DVec3::new(0.0, 0.0, -0.5),
            half: DVec3::new(5.0, 5.0, 0.5),
            axes: DMat3::IDENTITY,
        };
        let turned = DMat3::from_rotation_y(std::f64::consts::FRAC_PI_4);
        let mut cube =
            OrientedBox { center: DVec3::new(0.3, 0.1, 0.6), half: DVec3::splat(0.5), axes: turned };
        let up = DVec3::Z;
        let expected = 0.5f64.sqrt() - 0.6;
        assert!((cube.overlap(&floor) - expected).abs() < 1e-12);
        assert!((cube.lift(&floor, up) - expected).abs() < 1e-12);
        cube.center += up * expected * 1.000001;
        assert!(cube.overlap(&floor) < 0.0);
        assert_eq!(cube.lift(&floor, up), 0.0);
    }
}
