//! Periodic sides: what leaves the tank through one of them comes in through the opposite one, and particles at the two
//! sides are neighbours.
//!
//! No particle is kept twice. Every way from one particle to another is that to its nearest image ([`Periodic::nearest`];
//! `offset` in shaders/common.wgsl), which is the only one within reach where a side is three effective radii long or more; the
//! search looks past a seam into the cells at the other side, and `cell_list` brings back the water that has left.

use glam::{DVec3, IVec3};
use serde::{Deserialize, Serialize};

/// Cells of the search along a periodic axis at least: a cell and its two neighbours are then three.
pub const CELLS_MIN: u32 = 3;

/// The axes along which a scene is periodic. The default is periodic along none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Periodic {
    /// Lower sides [m].
    low: DVec3,
    /// From a side to the opposite one [m]; 0 along an axis that is not periodic.
    length: DVec3,
    /// 1 / length [1/m]; 0 along an axis that is not periodic.
    inverse: DVec3,
    any: bool,
}

impl Periodic {
    /// Periodic along the `axes` that are `true`, from `low` to `high` [m].
    pub fn new(axes: [bool; 3], low: DVec3, high: DVec3) -> Self {
        let mut out = Self { any: axes.contains(&true), ..Self::default() };
        for k in (0..3).filter(|&k| axes[k]) {
            out.low[k] = low[k];
            out.length[k] = high[k] - low[k];
            out.inverse[k] = 1.0 / out.length[k];
        }
        out
    }

    /// Whether an axis is periodic.
    pub fn is_any(&self) -> bool {
        self.any
    }

    /// Whether axis `k` is periodic.
    pub fn is_along(&self, k: usize) -> bool {
        self.length[k] > 0.0
    }

    /// From a side to the opposite one [m]; 0 along an axis that is not periodic.
    pub fn length(&self) -> DVec3 {
        self.length
    }

    /// Lower and upper side along `axis`, where that is periodic [m].
    pub fn sides(&self, axis: usize) -> Option<(f64, f64)> {
        self.is_along(axis).then(|| (self.low[axis], self.low[axis] + self.length[axis]))
    }

    /// `v` without its components along periodic axes.
    pub fn across(&self, mut v: DVec3) -> DVec3 {
        (0..3).filter(|&k| self.is_along(k)).for_each(|k| v[k] = 0.0);
        v
    }

    /// The way `r` to a particle, or to the nearest of its images [m].
    #[inline(always)]
    pub fn nearest(&self, r: DVec3) -> DVec3 {
        if self.any { r - self.length * (r * self.inverse).round() } else { r }
    }

    /// The image of `x` between the sides [m], the lower one included.
    #[inline(always)]
    pub fn wrap(&self, x: DVec3) -> DVec3 {
        if !self.any {
            return x;
        }
        let mut x = x - self.length * ((x - self.low) * self.inverse).floor();
        for (k, x) in x.as_mut().iter_mut().enumerate() {
            // What lies less than a rounding below the lower side comes to lie on the upper one.
            if self.is_along(k) && *x >= self.low[k] + self.length[k] {
                *x = self.low[k];
            }
        }
        x
    }

    /// The image of `x` from `low` on, less than a length above it along each periodic axis [m]: the one that a box whose lower corner
    /// is `low` holds, wherever it reaches over a side.
    #[inline(always)]
    pub fn image_from(&self, low: DVec3, x: DVec3) -> DVec3 {
        if self.any { x - self.length * ((x - low) * self.inverse).floor() } else { x }
    }

    /// Whole lengths by which the box from `low` to `high` [m] is moved by its images that reach between the sides, itself included if it
    /// does.
    pub fn turns(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = IVec3> + use<> {
        let along = |k: usize| match self.sides(k) {
            None => 0..=0,
            Some((from, to)) => {
                let turn = |way: f64| way * self.inverse[k];
                turn(from - high[k]).ceil() as i32..=turn(to - low[k]).floor() as i32
            }
        };
        let [x, y, z] = [0, 1, 2].map(along);
        x.flat_map(move |i| {
            let (y, z) = (y.clone(), z.clone());
            y.flat_map(move |j| z.clone().map(move |k| IVec3::new(i, j, k)))
        })
    }

    /// Whole lengths from the image of `x` between the sides to `x`; zero for what is no number.
    pub fn whole(&self, x: DVec3) -> IVec3 {
        if self.any { ((x - self.wrap(x)) * self.inverse).round().as_ivec3() } else { IVec3::ZERO }
    }

    /// The way of whole lengths [m].
    pub fn way(&self, turns: IVec3) -> DVec3 {
        self.length * turns.as_dvec3()
    }

    /// `x`, which lies between the sides, and its images that lie no further than `reach` beyond them [m].
    pub fn images(&self, x: DVec3, reach: f64) -> impl Iterator<Item = DVec3> + use<> {
        let periodic = *self;
        let shifts = move |k: usize| {
            let inside = move |s: &f64| match periodic.sides(k) {
                None => *s == 0.0,
                Some((low, high)) => {
                    let at = x[k] + s * periodic.length[k];
                    *s == 0.0 || (at >= low - reach && at <= high + reach)
                }
            };
            [0.0, -1.0, 1.0].into_iter().filter(inside)
        };
        shifts(0).flat_map(move |a| {
            shifts(1).flat_map(move |b| shifts(2).map(move |c| x + periodic.length * DVec3::new(a, b, c)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_axes() -> Periodic {
        Periodic::new([true, false, true], DVec3::new(-1.0, 7.0, 2.0), DVec3::new(2.0, 8.0, 2.5))
    }

    #[test]
    fn the_image_between_the_sides_is_one_and_differs_by_whole_lengths() {
        let p = two_axes();
        for x in [-1.0, -1.0 - 1e-17, 2.0, 2.0 - 1e-17, 17.3, -23.4, 0.5] {
            let x = DVec3::new(x, x, 2.0 + x);
            let w = p.wrap(x);
            assert!(w.x >= -1.0 && w.x < 2.0 && w.z >= 2.0 && w.z < 2.5, "{x} {w}");
            assert_eq!(w.y, x.y);
            let turns = (x - w) / DVec3::new(3.0, 1.0, 0.5);
            assert!((turns - turns.round()).abs().max_element() < 1e-12, "{x} {w}");
            assert_eq!(p.wrap(w), w);
        }
        let x = DVec3::new(1e9, -3.0, 0.1);
        assert_eq!((Periodic::default().wrap(x), Periodic::default().nearest(x)), (x, x));
        assert!(!Periodic::default().is_any() && p.is_any());
    }

    #[test]
    fn a_box_over_a_side_holds_what_comes_in_at_the_opposite_one() {
        let p = two_axes();
        // From the upper side along x and the lower one along z.
        let (low, high) = (DVec3::new(1.5, 7.0, 1.9), DVec3::new(2.5, 8.0, 2.1));
        let holds = |x: f64, z: f64| {
            let x = p.image_from(low, DVec3::new(x, 7.5, z));
            x.cmpge(low).all() && x.cmplt(high).all()
        };
        for (x, z, is) in
            [(1.6, 2.05, true), (-0.9, 2.45, true), (4.6, 1.95, true), (-0.4, 2.05, false), (1.6, 2.2, false)]
        {
            assert_eq!(holds(x, z), is, "{x} {z}");
        }
        assert_eq!(Periodic::default().image_from(low, high), high);
    }

    #[test]
    fn the_nearest_image_is_the_nearest_one() {
        let p = two_axes();
        let (a, b) = (DVec3::new(-0.9, 7.0, 2.1), DVec3::new(1.9, 7.5, 2.45));
        let r = p.nearest(b - a);
        assert!((r - DVec3::new(-0.2, 0.5, -0.15)).length() < 1e-12, "{r}");
        let among = p.images(b, 3.0).map(|b| (b - a).length()).fold(f64::INFINITY, f64::min);
        assert!((r.length() - among).abs() < 1e-12);
        // Only what is near a side has images near the other one.
        assert_eq!(p.images(DVec3::new(0.5, 7.0, 2.25), 0.2).count(), 1);
        assert_eq!(p.images(DVec3::new(-0.9, 7.0, 2.1), 0.2).count(), 4);
        assert_eq!(p.across(DVec3::ONE), DVec3::Y);
        let turns = |x: f64, half: f64| {
            let x = DVec3::new(x, 7.0, 2.25);
            let half = DVec3::new(half, 0.1, 0.1);
            p.turns(x - half, x + half).collect::<Vec<_>>()
        };
        assert_eq!(turns(0.0, 0.1), [IVec3::ZERO]);
        assert_eq!(turns(-0.95, 0.1), [IVec3::ZERO, IVec3::X]);
        assert_eq!(turns(7.93, 0.1), [-3 * IVec3::X, -2 * IVec3::X]);
        assert_eq!(turns(0.5, 2.0), [-IVec3::X, IVec3::ZERO, IVec3::X]);
        assert_eq!(p.way(IVec3::new(2, 1, -1)), DVec3::new(6.0, 0.0, -0.5));
        assert_eq!(p.whole(DVec3::new(5.1, 70.0, 1.9)), IVec3::new(2, 0, -1));
    }
}
