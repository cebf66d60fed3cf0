//! Holes between layers. Where the sides of a section that is no plate meet, their layers may leave a hole for a particle in which none of them has a place:
//! below the ridge of a roof three spacings high. What lies beside it has neighbours on one side alone, as those of a free surface have, and carries no
//! pressure.

use super::super::Particles;
use super::super::cells::PointCells;
use glam::DVec3;

/// Distance from all particles, over the spacing, from which on a place is a hole: squares of particles have 0.71.
const HOLE: f64 = 0.8;

/// Puts dummies into the holes of `out` among `places`, which are close to each other and half a spacing below the wall layer or deeper, the widest
/// first.
pub(super) fn fill(places: impl Iterator<Item = DVec3>, spacing: f64, out: &mut Particles) {
    let hole = HOLE * spacing;
    let mut taken = PointCells::new(hole);
    out.wall.iter().chain(&out.dummy).for_each(|&x| taken.add(x));
    let room = |x: DVec3| taken.within(x, 2.0 * hole).map(|near| near.1).fold(2.0 * hole, f64::min);
    let mut holes: Vec<(f64, DVec3)> = places.map(|x| (room(x), x)).filter(|found| found.0 >= hole).collect();
    holes.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, x) in holes {
        if !taken.is_near(x, hole) {
            taken.add(x);
            out.dummy.push(x);
        }
    }
}
