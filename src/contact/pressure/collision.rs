//! Eq. (18) for a pair of solids.

use crate::body::Body;
use crate::contact::fixed::FixedWalls;
use crate::contact::paper::{Layer, Pair, Walls};
use glam::DVec3;

/// Applies Eq. (18) to the candidates of `pair` within `distance` = a l0 [m], restitution `b` [-].
/// Returns how many pairs collided.
pub(crate) fn collide(
    pair: &Pair,
    bodies: &mut [Body],
    (layers, walls): (&[Layer], &Walls),
    fixed: &mut FixedWalls,
    distance: f64,
    restitution: f64,
) -> usize {
    let mut count = 0;
    for &(i, j) in &pair.candidates {
        let at = |k: usize, way: DVec3, n: u32| {
            bodies[k].pose.position + way + bodies[k].rotation * layers[k].offsets[n as usize]
        };
        let x_i = at(pair.a, DVec3::ZERO, i);
        let x_j = pair.b.map_or_else(|| walls.grid.point(j), |b| at(b, pair.image, j));
        let r = x_j - x_i;
        let d = r.length();
        if d >= distance || d == 0.0 {
            continue;
        }
        let e = r / d;
        let middle = x_i + 0.5 * r;
        // As the second solid has it.
        let middle_b = middle - pair.image;
        let velocity_b = pair.b.map_or(DVec3::ZERO, |b| bodies[b].pose.velocity_at(middle_b));
        let approach = (bodies[pair.a].pose.velocity_at(middle) - velocity_b).dot(e);
        if approach <= 0.0 {
            continue;
        }
        count += 1;
        let give = |body: &Body, middle: DVec3| body.give(e, (middle - body.pose.position).cross(e));
        let response = give(&bodies[pair.a], middle) + pair.b.map_or(0.0, |b| give(&bodies[b], middle_b));
        if response <= 0.0 {
            continue;
        }
        let impulse = -(1.0 + restitution) * approach / response * e;
        let kick = |body: &mut Body, middle: DVec3, impulse: DVec3| {
            let angular = (middle - body.pose.position).cross(impulse);
            body.touch(impulse, angular);
        };
        kick(&mut bodies[pair.a], middle, impulse);
        match pair.b {
            Some(b) => kick(&mut bodies[b], middle_b, -impulse),
            None => fixed.touch(walls.of[j as usize] as usize, -impulse, middle, DVec3::ZERO),
        }
    }
    count
}
