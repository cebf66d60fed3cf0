//! A pair as the shader sees it, and its sums as the law takes them.

use super::super::Smooth;
use super::super::pair::{Other, Pair};
use super::super::patch::{Contact, DeviceSums, Patch};
use super::{Cloud, SmoothPair, SmoothPose};
use crate::body::{Body, Mobility, Wrench};
use crate::contact::candidates::image;
use crate::contact::device::{four, vector};
use glam::{DMat3, DVec3};

/// Face of each sum of a pair, in their order: 0 to 5 of its second solid, 6 to 11 of the first.
pub(super) fn slots(record: &SmoothPair) -> impl Iterator<Item = u8> + use<> {
    let open = record.open;
    (0..12_u8).filter(move |key| open >> key & 1 == 1)
}

/// A contact as the shader keeps its own; see `contact_state` there.
pub(super) fn given(contact: &Contact, a: &Body) -> [[f32; 4]; 3] {
    let still = a.rotation.transpose();
    let face = contact.face().unwrap_or_default();
    [
        four(still * contact.normal, contact.depth),
        four(still * (contact.at - a.pose.position), contact.speed),
        [contact.weight as f32, f32::from(face), 0.0, 0.0],
    ]
}

/// Largest clearances to the lower and upper faces of a box of half edges `half` among the corners of a cloud's
/// box: `turn` and `shift` take its frame to the box's. Corners are chosen as the shader chooses them.
fn clearances(turn: DMat3, shift: DVec3, half: DVec3, cloud: &Cloud) -> (DVec3, DVec3) {
    let of = |sign: f64| {
        DVec3::from_array([0, 1, 2].map(|k| {
            let row = turn.row(k);
            let corner = [0, 1, 2].map(|j| {
                let up = (row[j] > 0.0) == (sign > 0.0);
                if up { cloud.high[j] } else { cloud.low[j] }
            });
            half[k] + sign * (row.dot(DVec3::from_array(corner)) + shift[k])
        }))
    };
    (of(1.0), of(-1.0))
}

/// The symmetric matrices `of` of the world in the frame that `still` leads to: of each its diagonal with `w`, and yz, zx and xy.
fn symmetric(still: DMat3, of: [DMat3; 2], w: f64) -> [[f32; 4]; 4] {
    let [[a, b], [c, d]] = of.map(|m| one_symmetric(still, m, w));
    [a, b, c, d]
}

fn one_symmetric(still: DMat3, m: DMat3, w: f64) -> [[f32; 4]; 2] {
    let m = still * m * still.transpose();
    [
        four(DVec3::new(m.x_axis.x, m.y_axis.y, m.z_axis.z), w),
        four(DVec3::new(m.z_axis.y, m.x_axis.z, m.y_axis.x), 0.0),
    ]
}

pub(super) fn pose(pair: &Pair, clouds: &[Cloud], model: &Smooth, bodies: &[Body]) -> SmoothPose {
    let a = &bodies[pair.a];
    let still = a.rotation.transpose();
    // What water in slots does by a push away from its middle is left out.
    let answers = |body: &Body| {
        let (alone, both) = (Mobility::of_body(body.inverse_mass, body.inverse_inertia), body.mobility());
        ([alone.moves, both.moves], [alone.turns, both.turns])
    };
    let ((mut gives, turns_a), mut turns_b) = (answers(a), [DMat3::ZERO; 2]);
    let (center, axes, half, velocity, spin) = match pair.b {
        Other::Solid(b) => {
            let (pose, Body { rotation, shape, .. }) = (image(&bodies[b], pair.image), &bodies[b]);
            let half = shape.extent(DMat3::IDENTITY);
            let moves;
            (moves, turns_b) = answers(&bodies[b]);
            gives = [0, 1].map(|k| gives[k] + moves[k]);
            (pose.position, *rotation, half, pose.velocity_at(a.pose.position), pose.angular_velocity)
        }
        Other::Wall(w) => {
            let wall = &model.walls[w];
            (wall.center, wall.axes, wall.half, DVec3::ZERO, DVec3::ZERO)
        }
    };
    let between = still * (a.pose.position - center);
    let theirs = pair.b.solid().map_or(Cloud::default(), |b| clouds[b]);
    let back = axes.transpose();
    let turn = back * a.rotation;
    let (below_b, above_b) = clearances(turn, back * (a.pose.position - center), half, &clouds[pair.a]);
    let half_a = a.shape.extent(DMat3::IDENTITY);
    let (below_a, above_a) = clearances(still * axes, still * (center - a.pose.position), half_a, &theirs);
    let u = still * (a.pose.velocity - velocity);
    SmoothPose {
        row_x: four(turn.row(0), u.x),
        row_y: four(turn.row(1), u.y),
        row_z: four(turn.row(2), u.z),
        spin: four(still * (a.pose.angular_velocity - spin), 0.0),
        below_b: four(below_b, 0.0),
        above_b: four(above_b, 0.0),
        below_a: four(below_a, 0.0),
        above_a: four(above_a, 0.0),
        found: [0.0; 4],
        found_push: [0.0; 4],
        found_moment: [0.0; 4],
        gives: symmetric(still, gives, between.x),
        turns_a: symmetric(still, turns_a, between.y),
        turns_b: symmetric(still, turns_b, between.z),
        given: [0; 4],
    }
}

/// The sums of a pair, which are in A's frame and about A's centre, in the world.
pub(super) fn read(pair: &Pair, record: &SmoothPair, sums: &[[f32; 4]], bodies: &[Body]) -> DeviceSums {
    let [depth, deepest, count, shares] = sums[0];
    if count == 0.0 {
        return DeviceSums::default();
    }
    let a = &bodies[pair.a];
    let mut on_a = Wrench::default();
    let pressed = slots(record).zip(sums[1..].chunks_exact(4)).filter(|(_, s)| s[0][3] > 0.0);
    let patches = pressed.map(|(key, s)| {
        let force = a.rotation * vector(s[0]);
        on_a += Wrench { force, torque: a.rotation * vector(s[1]) };
        let at = a.pose.position + a.rotation * vector(s[2]);
        let key = if key < 6 { key } else { key + 2 };
        let [[zz, yz, zx, _], xx, yy, xy] =
            [s[3], [s[1][3]; 4], [s[2][3]; 4], [s[3][3]; 4]].map(|v| v.map(f64::from));
        let own = DMat3::from_cols_array(&[xx[0], xy[0], zx, xy[0], yy[0], yz, zx, yz, zz]);
        let spread = a.rotation * own * a.rotation.transpose();
        Patch::new(key.into(), force, f64::from(s[0][3]), at, spread)
    });
    let patches = patches.collect();
    // The same forces at the same points act on B, so their moment about its centre follows.
    let on_b = pair.b.solid().map_or(Wrench::default(), |b| {
        let between = a.pose.position - image(&bodies[b], pair.image).position;
        Wrench { force: -on_a.force, torque: -(on_a.torque + between.cross(on_a.force)) }
    });
    DeviceSums {
        count: count as usize,
        depth: f64::from(depth),
        deepest: f64::from(deepest),
        shares: f64::from(shares),
        wrench: [on_a, on_b],
        patches,
    }
}
