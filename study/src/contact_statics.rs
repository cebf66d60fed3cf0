//! Bodies that stand by friction or fall, each with the threshold of statics: a wedge, a leaning plank, a house of cards, an
//! arch, a block on a table that tilts.

use super::contact_hard::Run;
use super::dry::GRAVITY;
use glam::{DVec2, DVec3};
use seixo::error::Result;
use std::fmt::Write;

/// A structure with one number that decides whether it stands.
pub struct Structure {
    /// Its name, and that of the number.
    pub name: &'static str,
    /// Spacings [m].
    pub spacings: [f64; 2],
    /// The case without spacing for a value of the number.
    pub text: fn(f64) -> String,
    /// The value from which on it stands, by statics.
    pub threshold: fn() -> f64,
    /// Time that it is watched for [s].
    pub time: f64,
}

/// Way of a body from which on it falls [m].
const MOVED: f64 = 4e-3;
/// Halvings of the range of 0.7 to 1.3 thresholds.
const HALVINGS: u32 = 6;
/// Half of what is left of it, over the threshold.
pub const RESOLUTION: f64 = 0.3 / (1 << HALVINGS) as f64;

const FLOOR: &str = "[[obstacle]]\nname = \"floor\"\nmin = [-1, -0.5, -0.1]\nmax = [1, 0.5, 0]\n";

fn head(friction: f64) -> String {
    format!(
        "time_step = 1e-3\nend = 9\ngravity = [0, 0, -{GRAVITY}]\n[contact]\nspring = 1e7\ndamping_ratio = 1\nfriction = {friction}\n"
    )
}

fn body(text: &mut String, name: &str, size: [f64; 3], center: DVec3, angle_deg: f64, density: f64) {
    let center = center.to_array();
    // writing to a string cannot fail
    let _ = write!(
        text,
        "[[body]]\nname = \"{name}\"\nsize = {size:?}\ncenter = {center:?}\ndensity = {density}\n\
         orientation = {{ axis = [0, 1, 0], angle_deg = {angle_deg:?} }}\n"
    );
}

/// A cube on its edge between two blocks, which it presses apart.
fn wedge(friction: f64) -> String {
    let mut text = head(friction) + FLOOR;
    let (gap, side) = (0.1, 0.12);
    for sign in [-1.0, 1.0] {
        let center = DVec3::new(sign * (0.5 * gap + 0.15), 0.0, 0.05);
        body(&mut text, &format!("block {sign}"), [0.3, 0.2, 0.1], center, 0.0, WEDGE_BLOCK);
    }
    // its faces lean on the inner upper edges
    let center = DVec3::new(0.0, 0.0, 0.1 + 0.5 * side * 2.0_f64.sqrt() - 0.5 * gap);
    body(&mut text, "wedge", [side, 0.2, side], center, 45.0, 1000.0);
    text
}

/// Density of the blocks beside the wedge, so that each weighs half of it [kg/m3].
const WEDGE_BLOCK: f64 = 1000.0 * 0.5 * 0.12 * 0.12 / (0.3 * 0.1);

/// mu (w + W / 2) = (W / 2) (1 - mu) / (1 + mu), w = W / 2 the weight of a block.
fn wedge_threshold() -> f64 {
    (17.0_f64.sqrt() - 3.0) / 4.0
}

/// Edges of the plank in its plane [m], and its angle from upright [degrees].
const PLANK: (f64, f64, f64) = (0.04, 0.5, 25.0);

/// A corner of an upright rectangle of edges `a` and `b` [m] after its top has leant by `angle` [rad] towards -x.
fn corner(a: f64, b: f64, angle: f64) -> DVec2 {
    DVec2::from_angle(angle).rotate(0.5 * DVec2::new(a, b))
}

/// A plank that leans against a wall.
fn plank(friction: f64) -> String {
    let mut text = head(friction) + FLOOR;
    text += "[[obstacle]]\nname = \"wall\"\nmin = [-1, -0.5, 0]\nmax = [-0.5, 0.5, 1]\n";
    let (a, b, angle) = PLANK;
    let (foot, top) = (corner(-a, -b, angle.to_radians()), corner(-a, b, angle.to_radians()));
    let center = DVec3::new(-0.5 - top.x, 0.0, -foot.y);
    body(&mut text, "plank", [a, 0.2, b], center, -angle, 1000.0);
    text
}

/// Slips at the foot and at the wall at once: N2 = mu N1, N1 (1 + mu^2) = W, moments about the foot.
fn plank_threshold() -> f64 {
    let (a, b, angle) = PLANK;
    let (foot, top) = (corner(-a, -b, angle.to_radians()), corner(-a, b, angle.to_radians()));
    let (arm, way) = (foot.x, top - foot);
    // W arm = N2 (height + mu way to the wall)
    let off = |mu: f64| mu / (1.0 + mu * mu) * (way.y + mu * -way.x) - arm;
    let (mut low, mut high) = (0.0, 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if off(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Edges of a card [m], their angle from upright [degrees] and the size of the card between the storeys [m].
const CARD: (f64, f64, f64) = (0.02, 0.3, 20.0);
const DECK: [f64; 3] = [0.5, 0.2, 0.02];

/// Two pairs of cards that lean on each other, a card across and a pair on it.
fn cards(friction: f64) -> String {
    let mut text = head(friction) + FLOOR;
    let (a, b, angle) = CARD;
    let turn = angle.to_radians();
    // the one on the right leans to the left
    let (foot, touch, top) = (corner(-a, -b, turn), corner(-a, b, turn), corner(a, b, turn));
    let height = top.y - foot.y;
    let mut pair = |name: &str, x: f64, z: f64| {
        for sign in [-1.0, 1.0] {
            let center = DVec3::new(x - sign * touch.x, 0.0, z - foot.y);
            body(&mut text, &format!("{name} {sign}"), [a, 0.2, b], center, -sign * angle, 1000.0);
        }
    };
    // a little apart
    let beside = foot.x - touch.x + 0.03;
    pair("left", -beside, 0.0);
    pair("right", beside, 0.0);
    pair("upper", 0.0, height + DECK[2]);
    body(&mut text, "deck", DECK, DVec3::new(0.0, 0.0, height + 0.5 * DECK[2]), 0.0, 1000.0);
    text
}

/// Of a lower card that carries Q on its top: H = (W off + Q far) / height, mu = H / (W + Q).
fn cards_threshold() -> f64 {
    let (a, b, angle) = CARD;
    let turn = angle.to_radians();
    let (foot, touch, top) = (corner(-a, -b, turn), corner(-a, b, turn), corner(a, b, turn));
    let weight = a * b * 0.2;
    let load = (2.0 * weight + DECK.iter().product::<f64>()) / 4.0;
    let push = (weight * foot.x + load * (foot.x - top.x)) / (touch.y - foot.y);
    push / (weight + load)
}

/// All of them.
pub const STRUCTURES: &[Structure] = &[
    Structure {
        name: "wedge between two blocks: friction that holds it [-]",
        spacings: [0.02, 0.01],
        text: wedge,
        threshold: wedge_threshold,
        time: 0.7,
    },
    Structure {
        name: "plank against a wall: friction that holds it [-]",
        spacings: [0.02, 0.01],
        text: plank,
        threshold: plank_threshold,
        time: 0.7,
    },
    Structure {
        name: "house of seven cards: friction that holds it [-]",
        spacings: [0.02, 0.01],
        text: cards,
        threshold: cards_threshold,
        time: 0.7,
    },
];

/// Whether the bodies of `run` stay where they are for `time` [s].
///
/// # Errors
/// Those of a step.
pub fn stands(run: &mut Run, time: f64) -> Result<bool> {
    let start: Vec<DVec3> = run.solids.poses().iter().map(|p| p.position).collect();
    let mut most = 0.0_f64;
    while run.time() < time && most < MOVED {
        run.step()?;
        let moved = run.solids.poses().iter().zip(&start).map(|(p, s)| p.position.distance(*s));
        most = moved.fold(0.0, f64::max);
    }
    Ok(most < MOVED)
}

/// The value from which on `structure` stands, by halvings of 0.7 to 1.3 thresholds; `stands` runs it at a value.
///
/// # Errors
/// Those of `stands`.
pub fn measured(structure: &Structure, mut stands: impl FnMut(f64) -> Result<bool>) -> Result<f64> {
    let exact = (structure.threshold)();
    let (mut low, mut high) = (0.7 * exact, 1.3 * exact);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if stands(middle)? { high = middle } else { low = middle }
    }
    Ok(0.5 * (low + high))
}

/// Voussoirs of the arch, its mean radius and its depth [m].
const ARCH: (usize, f64, f64) = (9, 0.5, 0.2);

/// A round arch, half a circle of voussoirs from meshes in `folder`, as thick as `thickness` [m]. Without spacing.
///
/// # Errors
/// [`seixo::error::Error::Io`] if a mesh cannot be written.
pub fn arch(folder: &std::path::Path, thickness: f64, friction: f64) -> Result<String> {
    let (count, radius, depth) = ARCH;
    let mut text = head(friction) + FLOOR;
    let turn = std::f64::consts::PI / count as f64;
    let at = |r: f64, angle: f64, y: f64| DVec3::new(r * angle.cos(), y, r * angle.sin());
    for k in 0..count {
        let (from, to) = (k as f64 * turn, (k + 1) as f64 * turn);
        let (inner, outer) = (radius - 0.5 * thickness, radius + 0.5 * thickness);
        let ring = [(inner, from), (outer, from), (outer, to), (inner, to)];
        let corners: Vec<DVec3> =
            [-0.5, 0.5].iter().flat_map(|y| ring.map(|(r, angle)| at(r, angle, y * depth))).collect();
        let mut obj = String::new();
        for c in &corners {
            let _ = writeln!(obj, "v {} {} {}", c.x, c.y, c.z);
        }
        for face in ["1 2 3 4", "8 7 6 5", "5 6 2 1", "6 7 3 2", "7 8 4 3", "8 5 1 4"] {
            let _ = writeln!(obj, "f {face}");
        }
        let file = folder.join(format!("voussoir-{k}.obj"));
        std::fs::write(&file, obj).map_err(seixo::error::Error::io(&file))?;
        // of the quadrangle in its plane
        let (mut area, mut center) = (0.0, DVec3::ZERO);
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            let part = (corners[b] - corners[a]).cross(corners[c] - corners[a]).length();
            area += part;
            center += part * (corners[a] + corners[b] + corners[c]) / 3.0;
        }
        center /= area;
        let (x, z) = (center.x, center.z);
        let _ = write!(
            text,
            "[[body]]\nname = \"voussoir {k}\"\nshape = \"mesh\"\nfile = {file:?}\ncenter = [{x:?}, 0, {z:?}]\ndensity = 1000\n"
        );
    }
    Ok(text)
}

/// Thickness over the mean radius from which on the [`arch`] stands: the least for which a line of thrust stays within
/// all joints.
pub fn arch_threshold() -> f64 {
    threshold_of(ARCH.0)
}

/// [`arch_threshold`] of an arch of `count` voussoirs, an odd number.
fn threshold_of(count: usize) -> f64 {
    let (mut low, mut high) = (0.02, 0.4);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if thrust_fits(count, middle) { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// Area of a polygon and its moment about the line x = 0.
fn area(corners: &[DVec2]) -> (f64, f64) {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).fold((0.0, 0.0), |(area, moment), (a, b)| {
        let part = 0.5 * a.perp_dot(*b);
        (area + part, moment + part * (a.x + b.x) / 3.0)
    })
}

/// Whether some level push through the crown of the arch of mean radius 1 keeps the thrust within every joint of a half.
/// The crown is no joint: inside a voussoir the line of thrust may run anywhere, even outside the stone.
fn thrust_fits(count: usize, thickness: f64) -> bool {
    let turn = std::f64::consts::PI / count as f64;
    let (inner, outer) = (1.0 - 0.5 * thickness, 1.0 + 0.5 * thickness);
    let on = |angle: f64| [inner, outer].map(|r| r * DVec2::from_angle(angle));
    // from the crown, whose voussoir is cut in two, to the foot: weight above a joint, its moment, angle of the joint
    let highest = (count / 2) as f64 * turn;
    let [a, b] = on(highest);
    let crown = area(&[DVec2::new(0.0, a.y), a, b, DVec2::new(0.0, b.y)]);
    let mut joints = vec![(crown.0, crown.1, highest)];
    for k in (0..count / 2).rev() {
        let ([a, b], [c, d]) = (on(k as f64 * turn), on((k + 1) as f64 * turn));
        let (own, above) = (area(&[a, b, d, c]), joints[joints.len() - 1]);
        joints.push((above.0 + own.0, above.1 + own.1, k as f64 * turn));
    }
    (0..=2000).map(|k| 0.5 + f64::from(k) / 2000.0).any(|height| {
        // push H: the thrust crosses a joint at the radius (H height + moment) / (weight cos + H sin)
        let (mut least, mut most) = (0.0_f64, f64::INFINITY);
        for &(weight, moment, angle) in &joints {
            let (sin, cos) = angle.sin_cos();
            // each bound as slope H >= value
            let within = height - inner * sin;
            let without = outer * sin - height;
            for (slope, value) in
                [(within, inner * weight * cos - moment), (without, moment - outer * weight * cos)]
            {
                if slope > 0.0 {
                    least = least.max(value / slope);
                } else if slope < 0.0 {
                    most = most.min(value / slope);
                } else if value > 0.0 {
                    return false;
                }
            }
        }
        least <= most
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_half_circle_needs_the_thickness_of_the_books() {
        // Milankovitch 1907: 0.1075 for an endless number of voussoirs; fewer have fewer joints to open
        let [many, nine] = [201, 9].map(threshold_of);
        assert!((many - 0.1075).abs() < 2e-4, "{many}");
        assert!((0.09..0.107).contains(&nine), "{nine}");
    }
}
