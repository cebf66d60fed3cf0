//! The smooth law on a device: what shaders/contact_smooth.wgsl is given, and what becomes of its answers.

use super::{Link, four, place, three, vector};
use crate::body::{Body, Wrench};
use crate::contact::Limits;
use crate::contact::candidates::{self, Candidates};
use crate::contact::geometry::Surface;
use crate::contact::smooth::{DevicePatch, Other, Pair};
use crate::error::Result;
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3};

/// Set in the number of a point on the edge of a wall; `ON_WALL` in the shaders.
pub const ON_WALL: u32 = 0x8000_0000;
/// Coordinates this close to the largest or smallest of a solid, over its size, are taken as equal to it: points
/// of a face then lie in one plane in f32 too.
const SNAP: f64 = 1e-9;
/// The search takes in what f32 cannot tell from the skin, over the size of the solids.
const ROUNDING: f64 = 1e-6;

/// See `SmoothPair` in shaders/contact_smooth.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct SmoothPair {
    pub low_a: [f32; 3],
    pub spring: f32,
    pub high_a: [f32; 3],
    pub stop: f32,
    pub low_b: [f32; 3],
    pub stop_depth: f32,
    pub high_b: [f32; 3],
    pub damping: f32,
    pub half_a: [f32; 3],
    pub step: f32,
    pub first: [u32; 2],
    pub count: [u32; 2],
    pub near: [u32; 2],
    pub faces: [u32; 2],
    pub list: u32,
    pub state: u32,
    pub sum: u32,
    pub share: f32,
    pub skin: f32,
    pub pad: [u32; 3],
}

/// See `SmoothPose` in shaders/contact_smooth.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct SmoothPose {
    pub row_x: [f32; 4],
    pub row_y: [f32; 4],
    pub row_z: [f32; 4],
    pub spin: [f32; 4],
    pub below_b: [f32; 4],
    pub above_b: [f32; 4],
    pub below_a: [f32; 4],
    pub above_a: [f32; 4],
}

/// Points in their frame, and the box around them.
#[derive(Clone, Copy, Debug, Default)]
struct Cloud {
    first: u32,
    count: u32,
    low: DVec3,
    high: DVec3,
}

impl Cloud {
    /// Adds `points` to `out`, each with its weight.
    fn add(out: &mut Vec<[f32; 4]>, points: &[DVec3], weight: impl Fn(usize) -> f64) -> Result<Self> {
        let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let near = SNAP * (high - low).max_element();
        let first = place(out.len())?;
        for (k, p) in points.iter().enumerate() {
            let snapped = DVec3::from_array([0, 1, 2].map(|axis| match p[axis] {
                x if x - low[axis] < near => low[axis],
                x if high[axis] - x < near => high[axis],
                x => x,
            }));
            out.push(four(snapped, weight(k)));
        }
        if points.is_empty() {
            return Ok(Self { first, ..Self::default() });
        }
        Ok(Self { first, count: points.len() as u32, low, high })
    }
}

/// The other's points, where they are not those of a moving solid.
#[derive(Clone, Debug)]
struct Samples {
    cloud: Cloud,
    /// Origin of the points, world [m].
    origin: DVec3,
    /// Their places, world [m].
    at: Vec<DVec3>,
}

/// A pair close to each other.
struct Entry {
    a: usize,
    b: Other,
    /// Points on the edges of a wall.
    samples: Option<Samples>,
    record: SmoothPair,
}

/// The smooth law's pairs on a device.
pub(crate) struct Smooth {
    generation: u64,
    clouds: Vec<Cloud>,
    entries: Vec<Entry>,
    /// Pairs with points near each other; evaluated on the device.
    pub pairs: Vec<Pair>,
    poses: Vec<SmoothPose>,
    records: Vec<SmoothPair>,
    sums: usize,
    /// Sub-step and longest step [s] that the device has the constants of.
    constants: Option<(f64, f64)>,
    sent: bool,
}

impl Smooth {
    /// Gives the device the points of all solids.
    pub fn new(surfaces: &[Surface], link: &mut Link) -> Result<Self> {
        let mut points = vec![];
        let clouds = surfaces
            .iter()
            .map(|s| Cloud::add(&mut points, &s.points, |k| s.weights[k]))
            .collect::<Result<_>>()?;
        link.write("contact_point", &points)?;
        let (entries, pairs, poses, records) = (vec![], vec![], vec![], vec![]);
        Ok(Self {
            generation: 0,
            clouds,
            entries,
            pairs,
            poses,
            records,
            sums: 0,
            constants: None,
            sent: false,
        })
    }

    /// Whether the lists are those of `candidates`.
    pub fn is_current(&self, candidates: &Candidates) -> bool {
        self.generation == candidates.generation()
    }

    /// Searches the pairs anew.
    pub fn search(
        &mut self,
        model: &candidates::Smooth,
        candidates: &Candidates,
        bodies: &[Body],
        spacing: f64,
        link: &mut Link,
    ) -> Result<()> {
        let mut sample_points = vec![];
        let (mut list, mut entries) = (0, vec![]);
        for (pair, skin) in model.close(candidates, bodies) {
            let own = self.clouds[pair.a];
            let (theirs, samples, faces_b, share) = match pair.b {
                Other::Solid(b) => (self.clouds[b], None, model.surfaces[b].all_faces, 0.5),
                Other::Wall(w) => {
                    let wall = &model.walls[w];
                    let at: Vec<DVec3> = wall.samples(&bodies[pair.a], skin, spacing).collect();
                    let origin = at.first().copied().unwrap_or_default();
                    let to_wall = wall.axes.transpose();
                    let local: Vec<DVec3> = at.iter().map(|x| to_wall * (*x - origin)).collect();
                    let weight = model.surfaces[pair.a].smallest_weight;
                    let mut cloud = Cloud::add(&mut sample_points, &local, |_| weight)?;
                    cloud.first |= ON_WALL;
                    (cloud, Some(Samples { cloud, origin, at }), wall.faces, 1.0)
                }
            };
            let size = bodies[pair.a].radius() + theirs.low.length().max(theirs.high.length());
            let record = SmoothPair {
                low_a: three(own.low),
                high_a: three(own.high),
                low_b: three(theirs.low),
                high_b: three(theirs.high),
                half_a: three(bodies[pair.a].half),
                first: [own.first, theirs.first],
                count: [own.count, theirs.count],
                faces: [u32::from(faces_b), u32::from(model.surfaces[pair.a].all_faces)],
                list: place(list)?,
                share: share as f32,
                skin: (skin + ROUNDING * size) as f32,
                ..SmoothPair::default()
            };
            list += (own.count + theirs.count) as usize;
            entries.push(Entry { a: pair.a, b: pair.b, samples, record });
        }
        self.entries = entries;
        if !self.entries.is_empty() {
            self.place_poses(model, bodies);
            self.records = self.entries.iter().map(|e| e.record).collect();
            link.write("contact_sample", &sample_points)?;
            link.write("smooth_pair", &self.records)?;
            link.write("smooth_pose", &self.poses)?;
            link.compute.reserve("contact_list", 4 * list as u64)?;
            link.compute.reserve("contact_count", 8 * self.entries.len() as u64)?;
            link.run(&[("contact_smooth.search", self.entries.len() as u64)])?;
            let near = link.read::<[u32; 2]>("contact_count", self.entries.len())?;
            self.keep(&near)?;
            link.compute.reserve("contact_state", 16 * self.states() as u64)?;
            link.compute.reserve("contact_sum", 16 * self.sums as u64)?;
        }
        self.pairs = self.entries.iter().map(|e| Pair::new(e.a, e.b)).collect();
        self.generation = candidates.generation();
        (self.constants, self.sent) = (None, false);
        Ok(())
    }

    /// Constants of every pair for sub-steps of `h` [s].
    pub fn set_constants(
        &mut self,
        model: &candidates::Smooth,
        limits: &Limits,
        bodies: &[Body],
        spacing: f64,
        h: f64,
    ) {
        let wanted = Some((h, limits.longest_step));
        if self.constants != wanted {
            candidates::set_constants(&mut self.pairs, &model.surfaces, limits, bodies, spacing, h);
            (self.constants, self.sent) = (wanted, false);
        }
    }

    /// Keeps the pairs with points near each other and gives each its places.
    fn keep(&mut self, near: &[[u32; 2]]) -> Result<()> {
        let mut near = near.iter();
        self.entries.retain_mut(|e| {
            e.record.near = near.next().copied().unwrap_or_default();
            e.record.near != [0, 0]
        });
        let (mut state, mut sum) = (0, 0);
        for Entry { record, .. } in &mut self.entries {
            (record.state, record.sum) = (place(state)?, place(sum)?);
            state += 3 * (record.near[0] + record.near[1]) as usize;
            sum += 1 + 3 * slots(record).count();
        }
        self.sums = sum;
        Ok(())
    }

    fn states(&self) -> usize {
        self.entries.iter().map(|e| 3 * (e.record.near[0] + e.record.near[1]) as usize).sum()
    }

    /// How each pair lies now.
    fn place_poses(&mut self, model: &candidates::Smooth, bodies: &[Body]) {
        let clouds = &self.clouds;
        self.poses.clear();
        self.poses.extend(self.entries.iter().map(|e| pose(e, clouds, model, bodies)));
    }

    /// Normal forces of all pairs at the bodies' poses and velocities.
    pub fn evaluate(&mut self, model: &candidates::Smooth, bodies: &[Body], link: &mut Link) -> Result<()> {
        if self.entries.is_empty() {
            return Ok(());
        }
        self.place_poses(model, bodies);
        if !self.sent {
            let record = |(e, p): (&Entry, &Pair)| {
                let c = &p.constants;
                SmoothPair {
                    spring: c.spring as f32,
                    stop: c.stop as f32,
                    stop_depth: c.stop_depth as f32,
                    damping: c.damping as f32,
                    step: c.step as f32,
                    ..e.record
                }
            };
            self.records = self.entries.iter().zip(&self.pairs).map(record).collect();
            link.write("smooth_pair", &self.records)?;
            self.sent = true;
        }
        link.write("smooth_pose", &self.poses)?;
        link.run(&[("contact_smooth.force", self.entries.len() as u64)])?;
        let sums = link.read::<[f32; 4]>("contact_sum", self.sums)?;
        for (pair, record) in self.pairs.iter_mut().zip(&self.records) {
            take(pair, record, &sums[record.sum as usize..], bodies);
        }
        Ok(())
    }

    /// Points on the lists: pair, side and place (world) of each.
    pub fn listed(
        &self,
        surfaces: &[Surface],
        bodies: &[Body],
        link: &mut Link,
    ) -> Result<Vec<(usize, Other, u8, DVec3)>> {
        let end = self.entries.iter().map(|e| e.record.list + e.record.count[0] + e.record.count[1]).max();
        let list = link.read::<u32>("contact_list", end.unwrap_or(0) as usize)?;
        let mut out = vec![];
        for Entry { a, b, samples, record } in &self.entries {
            for side in 0..2 {
                let from = record.list + if side == 1 { record.count[0] } else { 0 };
                for &k in &list[from as usize..(from + record.near[side]) as usize] {
                    let number = (k - record.first[side]) as usize;
                    let solid = match (side, *b) {
                        (0, _) => Some(*a),
                        (_, Other::Solid(b)) => Some(b),
                        _ => None,
                    };
                    let at = match (solid, samples) {
                        (Some(s), _) => {
                            bodies[s].pose.position + bodies[s].rotation * surfaces[s].points[number]
                        }
                        (None, Some(samples)) => samples.at[number],
                        _ => continue,
                    };
                    out.push((*a, *b, side as u8, at));
                }
            }
        }
        Ok(out)
    }
}

/// Side and face of each sum of a pair, in their order.
fn slots(record: &SmoothPair) -> impl Iterator<Item = u8> + use<> {
    let SmoothPair { near, faces, .. } = *record;
    (0..12_u8).filter(move |key| {
        let (side, face) = (usize::from(key / 6), key % 6);
        near[side] > 0 && faces[side] >> face & 1 == 1
    })
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

fn pose(entry: &Entry, clouds: &[Cloud], model: &candidates::Smooth, bodies: &[Body]) -> SmoothPose {
    let a = &bodies[entry.a];
    let still = a.rotation.transpose();
    let (center, axes, half, velocity, spin) = match entry.b {
        Other::Solid(b) => {
            let Body { pose, rotation, half, .. } = &bodies[b];
            (pose.position, *rotation, *half, pose.velocity_at(a.pose.position), pose.angular_velocity)
        }
        Other::Wall(w) => {
            let wall = &model.walls[w];
            (wall.center, wall.axes, wall.half, DVec3::ZERO, DVec3::ZERO)
        }
    };
    let (origin, theirs) = match (&entry.samples, entry.b) {
        (Some(samples), _) => (samples.origin, samples.cloud),
        (None, Other::Solid(b)) => (center, clouds[b]),
        (None, Other::Wall(_)) => (center, Cloud::default()),
    };
    let back = axes.transpose();
    let turn = back * a.rotation;
    let (below_b, above_b) = clearances(turn, back * (a.pose.position - center), half, &clouds[entry.a]);
    let (below_a, above_a) = clearances(still * axes, still * (origin - a.pose.position), a.half, &theirs);
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
    }
}

/// Turns the sums of a pair, which are in A's frame and about A's centre, to the world.
fn take(pair: &mut Pair, record: &SmoothPair, sums: &[[f32; 4]], bodies: &[Body]) {
    let a = &bodies[pair.a];
    let [depth, deepest, count, _] = sums[0];
    let mut on_a = Wrench::default();
    let patches =
        slots(record).zip(sums[1..].chunks_exact(3)).filter(|(_, s)| s[0][3] > 0.0).map(|(key, s)| {
            let force = a.rotation * vector(s[0]);
            on_a += Wrench { force, torque: a.rotation * vector(s[1]) };
            DevicePatch {
                key: if key < 6 { key } else { key + 2 },
                force,
                pressing: f64::from(s[0][3]),
                at: a.pose.position + a.rotation * vector(s[2]),
                radius: f64::from(s[1][3]),
            }
        });
    let patches: Vec<DevicePatch> = patches.collect();
    // The same forces at the same points act on B, so their moment about its centre follows.
    let on_b = match pair.b {
        Other::Solid(b) => {
            let between = a.pose.position - bodies[b].pose.position;
            Wrench { force: -on_a.force, torque: -(on_a.torque + between.cross(on_a.force)) }
        }
        Other::Wall(_) => Wrench::default(),
    };
    pair.set(count as usize, f64::from(depth), f64::from(deepest), [on_a, on_b], &patches);
}
