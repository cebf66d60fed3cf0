//! The paper's law on a device: what shaders/contact_paper.wgsl is given, and what becomes of its answers.

use super::{Constants, Layer, Lists, Pair};
use crate::body::{Body, Wrench};
use crate::compute::{Program, buffers, kernels, shader_structs};
use crate::contact::candidates::{Candidates, MANY_PAIRS, image};
use crate::contact::device::{Link, four, place, vector};
use crate::error::Result;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use rayon::prelude::*;

/// Set in the place of the particles of fixed walls; `ON_WALL` in the shaders.
pub const ON_WALL: u32 = 0x8000_0000;
/// Bits of a high part: 1 / 2^11 of the largest, so that a product of two has at most 24 bits.
const PARTS: f64 = 2048.0;

/// See `PaperPair` in shaders/contact_paper.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct PaperPair {
    pub first: [u32; 2],
    pub count: [u32; 2],
    pub row: u32,
    pub list: u32,
    pub candidates: u32,
    pub pairs: u32,
}

/// See `PaperPose` in shaders/contact_paper.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct PaperPose {
    pub high_x: [f32; 4],
    pub high_y: [f32; 4],
    pub high_z: [f32; 4],
    pub low_x: [f32; 4],
    pub low_y: [f32; 4],
    pub low_z: [f32; 4],
    pub velocity: [f32; 4],
    pub spin: [f32; 4],
    pub spin_b: [f32; 4],
}

/// See `PaperLaw` in shaders/contact_paper.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct PaperLaw {
    pub spring: f32,
    pub damping: f32,
    pub viscous_friction: f32,
    pub distance: f32,
    pub scale: f32,
    pub whole: f32,
    pub fraction: f32,
    pub pad: f32,
}

shader_structs!(PaperPair, PaperPose, PaperLaw);
kernels!(contact_paper[64]: count fill force);
buffers! {
    contact_layer: [f32; 4], Writes;
    contact_wall: [f32; 4], Writes;
    paper_pair: PaperPair, Writes;
    paper_pose: PaperPose, Writes;
    paper_law: PaperLaw, Writes;
    contact_row: u32, Reads;
    contact_list: [u32; 2], Reads;
    contact_sum: [f32; 4], Reads;
}

/// The law on a device.
pub const PROGRAM: Program = Program {
    name: "contact_paper",
    text: contact_paper::TEXT,
    kernels: contact_paper::ALL,
    buffers: buffer::ALL,
};

impl PaperLaw {
    fn new(law: &Constants) -> Self {
        let scale = PARTS / power_of_two(law.distance);
        let square = (law.distance * scale).powi(2);
        Self {
            spring: law.spring as f32,
            damping: law.damping as f32,
            viscous_friction: law.viscous_friction as f32,
            distance: law.distance as f32,
            scale: scale as f32,
            whole: square.round() as f32,
            fraction: (square - square.round()) as f32,
            pad: 0.0,
        }
    }
}

/// The power of two at or above `x`.
fn power_of_two(x: f64) -> f64 {
    x.max(f64::from(f32::MIN_POSITIVE)).log2().ceil().exp2()
}

/// `x` as a multiple of `step` and the rest.
fn split(x: DVec3, step: f64) -> [DVec3; 2] {
    let high = (x / step).round() * step;
    [high, x - high]
}

/// Words of a particle.
fn words(offset: DVec3, normal: DVec3, step: f64) -> [[f32; 4]; 3] {
    let [high, low] = split(offset, step);
    [four(high, 0.0), four(low, 0.0), four(normal, 0.0)]
}

/// A pair close to each other.
struct Entry {
    a: usize,
    b: Option<usize>,
    /// The way from B to its image beside A [m].
    image: DVec3,
    /// Distance of the search [m].
    reach: f64,
    /// Origin of B's particles, if those are fixed, world [m].
    origin: DVec3,
    /// Numbers of the fixed particles.
    walls: Vec<u32>,
    record: PaperPair,
}

/// The paper's law's pairs on a device.
pub(crate) struct Pairs {
    generation: u64,
    first: Vec<(u32, u32)>,
    /// Power of two above each solid's size [m]: the largest coordinate of its particles.
    size: Vec<f64>,
    entries: Vec<Entry>,
    /// Pairs with particles near each other; evaluated on the device.
    pub pairs: Vec<Pair>,
    poses: Vec<PaperPose>,
}

impl Pairs {
    /// Gives the device the particles of all solids and the law.
    pub fn new(layers: &[Layer], bodies: &[Body], law: &Constants, link: &mut Link) -> Result<Self> {
        // Fixed particles within reach of a body are not much further from it than its own.
        let of = |layer: &Layer| {
            let largest = layer.offsets.iter().map(|o| o.length()).fold(0.0, f64::max);
            power_of_two(2.0 * largest + law.distance)
        };
        let own: Vec<f64> = layers.iter().map(of).collect();
        let free = own.iter().zip(bodies).filter(|(_, b)| b.is_free()).map(|(s, _)| *s);
        // Sums are exact while the first solid of a pair is no larger than four times the second.
        let least = 0.25 * free.fold(0.0, f64::max);
        let size: Vec<f64> = own.iter().map(|s| s.max(least)).collect();
        let mut all: Vec<[[f32; 4]; 3]> = vec![];
        let mut first = vec![];
        for (layer, size) in layers.iter().zip(&size) {
            first.push((place(all.len())?, layer.offsets.len() as u32));
            let both = layer.offsets.iter().zip(&layer.normals);
            all.extend(both.map(|(o, n)| words(*o, *n, size / PARTS)));
        }
        link.write(buffer::contact_layer, all.as_flattened())?;
        link.write(buffer::paper_law, &[PaperLaw::new(law)])?;
        Ok(Self { generation: 0, first, size, entries: vec![], pairs: vec![], poses: vec![] })
    }

    /// Whether the lists are those of `candidates`.
    pub fn is_current(&self, candidates: &Candidates) -> bool {
        self.generation == candidates.generation()
    }

    /// Searches the pairs anew.
    pub fn search(
        &mut self,
        model: &Lists,
        candidates: &Candidates,
        bodies: &[Body],
        law: &Constants,
        link: &mut Link,
    ) -> Result<()> {
        let mut fixed: Vec<[[f32; 4]; 3]> = vec![];
        self.entries.clear();
        for (pair, reach) in model.close(candidates, bodies, law.distance) {
            let (body, own) = (&bodies[pair.a], self.first[pair.a]);
            let origin = body.pose.position;
            let (mut theirs, mut walls) = ((ON_WALL | place(fixed.len())?, 0), vec![]);
            match pair.b {
                Some(b) => theirs = self.first[b],
                None => {
                    model.walls.grid.near(origin, body.radius() + reach, |j| walls.push(j));
                    theirs.1 = walls.len() as u32;
                    let of = |&j: &u32| {
                        let offset = model.walls.grid.point(j) - origin;
                        words(offset, model.walls.normals[j as usize], self.size[pair.a] / PARTS)
                    };
                    fixed.extend(walls.iter().map(of));
                }
            }
            let record =
                PaperPair { first: [own.0, theirs.0], count: [own.1, theirs.1], ..Default::default() };
            self.entries.push(Entry {
                a: pair.a,
                b: pair.b,
                image: pair.image,
                reach,
                origin,
                walls,
                record,
            });
        }
        self.entries.retain(|e| e.record.count[1] > 0);
        self.generation = candidates.generation();
        if !self.entries.is_empty() {
            let mut row = self.entries.len();
            for e in &mut self.entries {
                e.record.row = place(row)?;
                row += e.record.count[0] as usize;
            }
            link.write(buffer::contact_wall, fixed.as_flattened())?;
            link.reserve(buffer::contact_row, row)?;
            self.send(bodies, link)?;
            link.run(&[(contact_paper::count, self.entries.len() as u64)])?;
            let found = link.read(buffer::contact_row, self.entries.len())?;
            let (mut found, mut list) = (found.into_iter(), 0);
            for e in &mut self.entries {
                e.record.candidates = found.next().unwrap_or(0);
                e.record.list = place(list)?;
                list += e.record.candidates as usize;
            }
            self.entries.retain(|e| e.record.candidates > 0);
            link.reserve(buffer::contact_list, list)?;
            link.reserve(buffer::contact_sum, 3 * self.entries.len())?;
            if !self.entries.is_empty() {
                self.send(bodies, link)?;
                link.run(&[(contact_paper::fill, self.entries.len() as u64)])?;
            }
        }
        self.pairs = self.entries.iter().map(|e| Pair::new(e.a, e.b, e.image)).collect();
        Ok(())
    }

    /// Records and poses of the pairs.
    fn send(&mut self, bodies: &[Body], link: &mut Link) -> Result<()> {
        let pairs = place(self.entries.len())?;
        let records: Vec<PaperPair> = self.entries.iter().map(|e| PaperPair { pairs, ..e.record }).collect();
        link.write(buffer::paper_pair, &records)?;
        self.send_poses(bodies, link)
    }

    fn send_poses(&mut self, bodies: &[Body], link: &mut Link) -> Result<()> {
        let of = |e: &Entry| pose(e, self.size[e.b.unwrap_or(e.a)], bodies);
        if self.entries.len() >= MANY_PAIRS {
            self.entries.par_iter().map(of).collect_into_vec(&mut self.poses);
        } else {
            self.poses.clear();
            self.poses.extend(self.entries.iter().map(of));
        }
        link.write(buffer::paper_pose, &self.poses)
    }

    /// Eq. (14) of all pairs at the bodies' poses and velocities.
    pub fn evaluate(&mut self, law: &Constants, bodies: &[Body], link: &mut Link) -> Result<()> {
        if self.entries.is_empty() {
            return Ok(());
        }
        self.send_poses(bodies, link)?;
        link.run(&[(contact_paper::force, self.entries.len() as u64)])?;
        let sums = link.read(buffer::contact_sum, 3 * self.entries.len())?;
        for (pair, sum) in self.pairs.iter_mut().zip(sums.as_chunks().0) {
            take(pair, sum, law, bodies);
        }
        Ok(())
    }

    /// Candidates: the two solids (walls last) and the numbers of the two particles.
    pub fn listed(&self, link: &mut Link) -> Result<Vec<[u64; 4]>> {
        let end = self.entries.iter().map(|e| e.record.list + e.record.candidates).max().unwrap_or(0);
        let list = link.read(buffer::contact_list, end as usize)?;
        let of = |e: &Entry| {
            let PaperPair { list: first, candidates, .. } = e.record;
            let number = |j: u32| e.walls.get(j as usize).copied().unwrap_or(j);
            let range = first as usize..(first + candidates) as usize;
            let (a, b) = (e.a as u64, e.b.map_or(u64::MAX, |b| b as u64));
            list[range].iter().map(|&[i, j]| [a, b, i.into(), number(j).into()]).collect::<Vec<_>>()
        };
        Ok(self.entries.iter().flat_map(of).collect())
    }
}

/// How a pair lies now: B's frame in A's in two parts, where coordinates in B's go up to `size` [m].
fn pose(entry: &Entry, size: f64, bodies: &[Body]) -> PaperPose {
    let a = &bodies[entry.a];
    let still = a.rotation.transpose();
    let center = a.pose.position;
    let (turn, origin, velocity, spin) = match entry.b {
        Some(b) => {
            let pose = image(&bodies[b], entry.image);
            (still * bodies[b].rotation, pose.position, pose.velocity_at(center), pose.angular_velocity)
        }
        None => (still, entry.origin, DVec3::ZERO, DVec3::ZERO),
    };
    let columns = [turn.x_axis, turn.y_axis, turn.z_axis].map(|c| split(c, 1.0 / PARTS));
    let shift = split(still * (origin - center), size / (PARTS * PARTS));
    let part = |k: usize| [0, 1, 2].map(|axis| four(columns[axis][k], shift[k][axis]));
    let ([high_x, high_y, high_z], [low_x, low_y, low_z]) = (part(0), part(1));
    PaperPose {
        high_x,
        high_y,
        high_z,
        low_x,
        low_y,
        low_z,
        velocity: four(still * (a.pose.velocity - velocity), 0.0),
        spin: four(still * (a.pose.angular_velocity - spin), entry.reach),
        spin_b: four(still * spin, 0.0),
    }
}

/// Turns the sums of a pair, which are in A's frame and about A's centre, to the world, and divides by n_c.
fn take(pair: &mut Pair, sum: &[[f32; 4]; 3], law: &Constants, bodies: &[Body]) {
    let a = &bodies[pair.a];
    let (force, torque) = (a.rotation * vector(sum[0]), a.rotation * vector(sum[1]));
    let arm = pair.b.map_or(DVec3::ZERO, |b| a.pose.position - image(&bodies[b], pair.image).position);
    let [count, deepest, ..] = sum[2];
    let share = 1.0 / f64::from(count).max(1.0);
    let on_b = match pair.b {
        Some(_) => Wrench { force: -force, torque: -(torque + arm.cross(force)) },
        None => Wrench::default(),
    };
    pair.wrench = [Wrench { force, torque }, on_b].map(|w| Wrench {
        force: share * w.force,
        torque: if law.torque { share * w.torque } else { DVec3::ZERO },
    });
    pair.count = count as usize;
    pair.energy = share * f64::from(sum[1][3]);
    pair.closest = if count > 0.0 { law.distance - f64::from(deepest) } else { f64::INFINITY };
    pair.normal_force = share * f64::from(sum[0][3]);
}
