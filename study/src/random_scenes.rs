//! Random scenes of solids for the general question: does energy ever rise, does anything go through a wall?
//!
//! A scene is a case's text made from a seed, so that whatever one of them shows can be run again, and by hand.

use super::contact_checks::{Random, none};
use super::dry::GRAVITY;
use glam::{DQuat, DVec3};
use seixo::case::Case;
use seixo::contact::Solids;
use seixo::error::Result;
use seixo::scene::Scene;
use std::fmt::Write;

/// Edge of the room that a scene lies in [m].
const ROOM: f64 = 2.4;
/// Spacing [m].
const SPACING: f64 = 0.02;
/// Longest edge or diameter of a body [m]; the shortest one is a spacing.
const LARGEST: f64 = 2.0;

/// What became of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Largest rise of the total energy above any earlier value, over the kinetic energy at the start and that of a fall
    /// through the room [-].
    pub rise: f64,
    /// A body whose centre came into a wall, went through one, or into another body, and when.
    pub lost: Option<String>,
    /// Why it ended before its time.
    pub refused: Option<String>,
    /// Bodies.
    pub bodies: usize,
    /// Deepest contact over the spacing [-].
    pub depth: f64,
    /// Most sub-steps of a step.
    pub substeps: u32,
    /// Steps.
    pub steps: u64,
    /// Of every pose at every step.
    pub bits: u64,
}

fn pick(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * random.draw()
}

fn decades(random: &mut Random, low: f64, high: f64) -> f64 {
    10_f64.powf(pick(random, low.log10(), high.log10()))
}

fn vector(random: &mut Random, most: f64) -> [f64; 3] {
    [0; 3].map(|_| pick(random, -most, most))
}

/// A body's shape in words and the radius about its centre [m]; edges 1 : 100 at most.
fn shape(random: &mut Random, scale: f64) -> (String, f64) {
    let least = 1.001 * SPACING;
    let long = (scale * decades(random, 0.1, LARGEST)).max(2.0 * least);
    let short = |random: &mut Random| (long * decades(random, 0.01, 1.0)).max(least);
    match (3.0 * random.draw()) as u32 {
        0 => {
            let mut size = [long, short(random), short(random)];
            size.rotate_left((3.0 * random.draw()) as usize);
            (format!("size = {size:?}"), 0.5 * DVec3::from(size).length())
        }
        1 => {
            let radius = (0.25 * long).max(least);
            (format!("shape = \"sphere\"\nradius = {radius:?}"), radius)
        }
        _ => {
            let other = short(random);
            let (across, height) = if random.draw() < 0.5 { (long, other) } else { (other, long) };
            let text = format!("shape = \"cylinder\"\nradius = {:?}\nheight = {height:?}", 0.5 * across);
            (text, 0.5 * across.hypot(height))
        }
    }
}

/// Walls of the scene: a closed or open tank, or planes; and obstacles, as boxes that no body may start in. Without
/// gravity nothing may start above an open tank.
fn walls(random: &mut Random, weightless: bool, text: &mut String) -> Vec<(DVec3, DVec3)> {
    let kind = (4.0 * random.draw()) as u32;
    if kind < 3 {
        let open = ["", "open = [\"z_max\"]\n", "open = [\"z_max\", \"x_max\"]\n"][kind as usize];
        let top = if kind == 0 || weightless { ROOM } else { pick(random, 0.3, ROOM) };
        *text += &format!("[tank]\nmin = [0, 0, 0]\nmax = [{ROOM}, {ROOM}, {top:?}]\n{open}");
    } else {
        for (k, z) in [0.0, pick(random, 0.2, 0.8)].into_iter().enumerate() {
            let [x, y] = [pick(random, 0.4, 0.6) * ROOM, pick(random, 0.4, 0.6) * ROOM];
            let size = [pick(random, 0.3, 0.9) * ROOM, pick(random, 0.3, 0.9) * ROOM];
            let tilt = if k == 0 { [0.0, 0.0] } else { [pick(random, -0.6, 0.6), pick(random, -0.6, 0.6)] };
            // the upper one stands beside the lower one's middle
            let x = if k == 0 { x } else { x + 0.3 * ROOM };
            *text += &format!(
                "[[plane]]\nname = \"plane {k}\"\ncenter = [{x:?}, {y:?}, {z:?}]\nnormal = [{:?}, {:?}, 1]\n\
                 along = [1, 0, 0]\nsize = {size:?}\n",
                tilt[0], tilt[1]
            );
        }
    }
    let count = (4.0 * random.draw()) as usize;
    let mut boxes = vec![];
    for k in 0..count {
        let low = DVec3::new(pick(random, 0.1, 0.8), pick(random, 0.1, 0.8), 0.0) * ROOM;
        let size = DVec3::new(pick(random, 0.1, 0.6), pick(random, 0.1, 0.6), pick(random, 0.1, 0.5));
        let low = (low / SPACING).round() * SPACING;
        let high = ((low + size) / SPACING).round().min(DVec3::splat((ROOM / SPACING).round())) * SPACING;
        boxes.push((low, high));
        *text += &format!(
            "[[obstacle]]\nname = \"block {k}\"\nmin = {:?}\nmax = {:?}\n",
            low.to_array(),
            high.to_array()
        );
    }
    boxes
}

/// The case of `seed`: 2 to 20 boxes, spheres and cylinders of aspects to 1 : 100, masses to 1 : 1e4 and speeds to 50 m/s
/// in a tank, an open tank or over planes, with obstacles.
pub fn text(seed: u64) -> String {
    let mut random = Random::new(seed);
    let time_step = decades(&mut random, 1e-4, 1e-3);
    let gravity = if random.draw() < 0.8 { GRAVITY } else { 0.0 };
    let mut text = format!(
        "[run]\nspacing = {SPACING}\ntime_step = {time_step:e}\nend = 1\ngravity = [0, 0, -{gravity}]\n[contact]\nspring = {:e}\n\
         restitution = {:?}\nfriction = {:?}\n",
        decades(&mut random, 1e6, 1e9),
        random.draw(),
        0.8 * random.draw()
    );
    let blocks = walls(&mut random, gravity == 0.0, &mut text);
    let count = pick(&mut random, 2.0, 20.999) as usize;
    let mut placed: Vec<(DVec3, f64)> = vec![];
    for k in 0..count {
        let (shape, center, radius) = (0..)
            .map(|trial| {
                let scale = 0.97_f64.powi(trial);
                let (shape, radius) = shape(&mut random, scale);
                // above tilted planes, too
                let low = radius + 0.02;
                let center = DVec3::from([0; 3].map(|_| pick(&mut random, low, (ROOM - low).max(low))));
                (shape, center, radius)
            })
            .find(|(_, c, r)| {
                let clear = |(low, high): &(DVec3, DVec3)| c.clamp(*low, *high).distance(*c) > r + 0.01;
                let over = !text.contains("plane 1") || c.z - r > 1.0 + 0.6 * ROOM * 0.5;
                let apart = |(x, q): &(DVec3, f64)| x.distance(*c) > r + q + 0.01;
                blocks.iter().all(clear) && over && placed.iter().all(apart)
            })
            .unwrap_or_default();
        placed.push((center, radius));
        let speed = decades(&mut random, 0.1, 50.0) / 3_f64.sqrt();
        let turn = DQuat::to_axis_angle(random.orientation());
        write!(
            text,
            "[[body]]\nname = \"body {k}\"\n{shape}\ncenter = {:?}\nmass = {:e}\nvelocity = {:?}\n\
             angular_velocity = {:?}\norientation = {{ axis = {:?}, angle_deg = {:?} }}\n",
            center.to_array(),
            decades(&mut random, 1e-2, 1e2),
            vector(&mut random, speed),
            vector(&mut random, 10.0),
            turn.0.to_array(),
            turn.1.to_degrees()
        )
        .unwrap_or_default();
    }
    text
}

/// A body that is where none can have come to, from its centre before the step and now.
fn lost(scene: &Scene, before: &[DVec3], solids: &Solids) -> Option<String> {
    for (k, pose) in solids.poses().iter().enumerate() {
        for wall in &scene.walls {
            let local = |x: DVec3| wall.axes.transpose() * (x - wall.center);
            let (from, to) = (local(before[k]), local(pose.position));
            if crosses(from, to, wall.half) {
                return Some(format!("the centre of `{}` is in wall `{}`", solids.name(k), wall.name));
            }
        }
        for (j, other) in solids.poses().iter().enumerate().filter(|(j, _)| *j != k) {
            let q =
                other.orientation.inverse() * (pose.position - other.position) - scene.solids[j].shape_offset;
            let shape = &scene.solids[j].shape;
            if shape.distance(q).0 < 0.0 {
                return Some(format!("the centre of `{}` is in `{}`", solids.name(k), solids.name(j)));
            }
        }
    }
    None
}

/// Whether the way `from`..`to` meets the box of half edges `half` [m] about the origin.
fn crosses(from: DVec3, to: DVec3, half: DVec3) -> bool {
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    for k in 0..3 {
        let way = to[k] - from[k];
        if way == 0.0 {
            if from[k].abs() >= half[k] {
                return false;
            }
            continue;
        }
        let (a, b) = ((-half[k] - from[k]) / way, (half[k] - from[k]) / way);
        (low, high) = (low.max(a.min(b)), high.min(a.max(b)));
    }
    low < high
}

/// What an error says a scene would run with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Remedy {
    /// Time step, if not the scene's own [s].
    pub time_step: Option<f64>,
    /// Spring, if not the scene's own [N/m].
    pub spring: Option<f64>,
}

impl Remedy {
    /// What the text of an error names.
    pub fn of(error: &str) -> Self {
        let number = |key: &str| {
            let rest = error.split(&format!("{key} = ")).nth(1)?;
            rest.split_whitespace().next()?.parse().ok()
        };
        Self { time_step: number("run.time_step"), spring: number("contact.spring") }
    }

    /// This one, and where it says nothing what `earlier` said.
    pub fn or(self, earlier: Self) -> Self {
        Self { time_step: self.time_step.or(earlier.time_step), spring: self.spring.or(earlier.spring) }
    }
}

/// Runs the scene of `text` for `time` [s] with a `remedy`.
///
/// # Errors
/// Those of [`Scene::build`]: the scene does not exist.
pub fn run(text: &str, time: f64, remedy: Remedy) -> Result<Outcome> {
    let mut case: Case = text.parse()?;
    if let (Some(contact), Some(spring)) = (&mut case.contact, remedy.spring) {
        contact.spring = Some(spring);
    }
    let scene = Scene::build(&case)?;
    let mut solids = Solids::new(&scene, case.contact.as_ref())?;
    let dt = remedy.time_step.unwrap_or(case.run.time_step);
    let none = none(solids.poses().len());
    let start = solids.energy();
    let mass: f64 = case.body.iter().filter_map(|b| b.mass).sum();
    let scale = start.kinetic + mass * scene.gravity.length() * ROOM;
    let mut out = Outcome { bodies: none.len(), bits: 0xcbf2_9ce4_8422_2325, ..Outcome::default() };
    let mut lowest = start.total();
    let mut before: Vec<DVec3> = solids.poses().iter().map(|p| p.position).collect();
    while (out.steps as f64) * dt < time {
        match solids.advance(out.steps as f64 * dt, dt, &none) {
            Ok(report) => {
                out.depth = out.depth.max(report.penetration_max_over_l0);
                out.substeps = out.substeps.max(report.substeps);
            }
            Err(error) => {
                out.refused = Some(error.to_string());
                break;
            }
        }
        out.steps += 1;
        let now = solids.centred_energy().total();
        out.rise = out.rise.max((now - lowest) / scale);
        lowest = lowest.min(now);
        if out.lost.is_none() {
            let at = out.steps as f64 * dt;
            out.lost = lost(&scene, &before, &solids).map(|what| format!("{what} at {at:.4} s"));
        }
        for (k, pose) in solids.poses().iter().enumerate() {
            before[k] = pose.position;
            for x in pose.position.to_array().into_iter().chain(pose.orientation.to_array()) {
                out.bits = (out.bits ^ x.to_bits()).wrapping_mul(0x0100_0000_01b3);
            }
        }
    }
    Ok(out)
}
