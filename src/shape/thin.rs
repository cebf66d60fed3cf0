//! The middle of thin parts. Layers of particles below the two sides of a plate leave it hollow where they do not fit, and a hollow plate pulls:
//! its rows have neighbours on one side alone, as those of a free surface have, and carry no pressure.
//!
//! Where the layers of two sides that look away from each other would come too near, one in the middle takes their place, and one stands in the
//! middle where none of them reaches.

use super::cells::PointCells;
use super::{APART, Particles};
use glam::DVec3;
use rayon::prelude::*;

/// Layers of two sides nearer to each other than twice this, over the spacing, are one in the middle.
const MERGED: f64 = 0.3;
/// Part of a layer for which there is room in the middle, from which on it gets one.
const ROOM: f64 = 0.32;
/// Cosine between the normals of two sides that look away from each other: a plate or a wedge of up to 23 degrees, not the tip of a blunter one, whose middle has room.
const AWAY: f64 = -0.92;
/// Part of the spacing to which the middle is found.
const EXACT: f64 = 1e-6;

/// Sides of a thin part: signed distance [m] and direction outwards of a point.
pub(super) struct Thin<F> {
    distance: F,
    spacing: f64,
    /// Of two dimensions.
    plane: bool,
}

impl<F: Fn(DVec3) -> (f64, DVec3) + Sync> Thin<F> {
    pub fn new(distance: F, spacing: f64, plane: bool) -> Self {
        Self { distance, spacing, plane }
    }

    /// The middle between the side below which `at` lies, at a signed `distance` [m] and with the direction
    /// `outward`, and one that looks away from it, if it is no deeper than `reach` [m] below `at`.
    fn middle(&self, at: DVec3, (distance, outward): (f64, DVec3), reach: f64) -> Option<DVec3> {
        let slack = EXACT * self.spacing;
        let beyond = |t: f64| -(self.distance)(at - t * outward).0 < t - distance - slack;
        let (mut low, mut high) = (0.0, reach + slack);
        if !beyond(high) {
            return None;
        }
        while high - low > slack {
            let half = 0.5 * (low + high);
            *(if beyond(half) { &mut high } else { &mut low }) = half;
        }
        let other = (self.distance)(at - (high + 10.0 * slack) * outward).1;
        (other.dot(outward) < AWAY).then(|| at - 0.5 * (low + high) * outward)
    }

    /// Whether a particle of a layer below the first at `at`, `depth` [m] below a side with the direction `outward`,
    /// has its like of another side so near that one in the middle stands for both.
    pub fn merges(&self, at: DVec3, (depth, outward): (f64, DVec3)) -> bool {
        self.middle(at, (-depth, outward), MERGED * self.spacing).is_some()
    }

    /// Places close to each other in those of `cells`, of the size of the spacing, that lie in a thin part. Each
    /// comes with its depth [m] and the direction outwards.
    pub fn beside(&self, cells: &[(DVec3, f64, DVec3)]) -> Vec<DVec3> {
        let part = self.spacing / 3.0;
        let steps = move || [0.0, -part, part].into_iter();
        let offsets = move || {
            steps().flat_map(move |x| steps().flat_map(move |y| steps().map(move |z| DVec3::new(x, y, z))))
        };
        let is_thin = |&&(at, depth, outward): &&(DVec3, f64, DVec3)| {
            self.middle(at, (-depth, outward), 1.5 * self.spacing).is_some()
        };
        let thin: Vec<DVec3> = cells.par_iter().filter(is_thin).map(|cell| cell.0).collect();
        thin.into_iter().flat_map(|at| offsets().map(move |by| at + by)).collect()
    }

    /// Puts dummies into the middle below `places`, close to each other and `above` spacings deep, as many layers as have their particles: as many as fill
    /// the part with those of both sides. Too many push the water away, too few pull it.
    pub fn fill(
        &self,
        above: f64,
        places: impl Iterator<Item = DVec3>,
        taken: &PointCells,
        out: &mut Particles,
    ) {
        let l0 = self.spacing;
        let mut put = PointCells::new(2.0 * l0);
        for at in places.filter_map(|at| self.middle(at, (self.distance)(at), (0.5 + MERGED) * l0)) {
            let (distance, outward) = (self.distance)(at);
            let room = 2.0 * (-distance / l0 - above);
            if !(ROOM..1.0 + 2.0 * MERGED).contains(&room) {
                continue;
            }
            // Places that are taken one by one lie less densely than a lattice so far apart.
            let apart = if self.plane { l0 / room } else { 0.9 * l0 / room.sqrt() };
            if taken.nearest(at, APART * l0).is_some() || put.nearest(at, apart).is_some() {
                continue;
            }
            put.add(at);
            out.add(1, at, DVec3::ZERO, -distance * outward);
        }
    }
}
