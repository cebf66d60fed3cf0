//! The paper's law on a device: what shaders/contact_paper.wgsl is given, and what becomes of its answers.

pub use super::words::{ON_WALL, PaperBlock, PaperLaw, PaperPair, PaperPose};

use super::near::{Near, bounds, near};
use super::words::{PARTS, Sum, power_of_two, split, take, words};
use super::{Constants, Layer, Lists, Pair};
use crate::body::Body;
use crate::compute::{Program, buffers, kernels};
use crate::contact::broad::Bounds;
use crate::contact::candidates::{Candidates, MANY_PAIRS, image};
use crate::contact::device::{Link, four, place};
use crate::error::Result;
use glam::DVec3;
use rayon::prelude::*;

/// Particles of a block of the search: one for each thread.
const GROUP: usize = 64;
/// Candidates of a block of the forces at most, 32 for each thread. Those of a body of a thousand points at rest are one
/// block; of a hundred thousand candidates one workgroup would make more than a round trip to the device takes.
const MANY_CANDIDATES: usize = 2048;

kernels!(contact_paper[super::GROUP]: count fill force);
buffers! {
    contact_layer: [f32; 4], Writes;
    contact_wall: [f32; 4], Writes;
    paper_pair: PaperPair, Writes;
    paper_pose: PaperPose, Writes;
    paper_law: PaperLaw, Writes;
    contact_row: u32, Reads;
    contact_list: [u32; 2], Reads;
    contact_sum: [f32; 4], Reads;
    paper_block: PaperBlock, Writes;
    contact_near: u32, Writes;
}

/// The law on a device.
pub const PROGRAM: Program = Program {
    name: "contact_paper",
    text: contact_paper::TEXT,
    kernels: contact_paper::ALL,
    buffers: buffer::ALL,
};

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
    /// What may be near; of walls the numbers among all fixed particles.
    near: Near,
    record: PaperPair,
    /// Candidates, and the place of the first.
    candidates: usize,
    list: usize,
}

impl Entry {
    /// Blocks of its forces.
    fn blocks(&self) -> usize {
        self.candidates.div_ceil(MANY_CANDIDATES)
    }
}

/// The paper's law's pairs on a device.
pub(crate) struct Pairs {
    generation: u64,
    first: Vec<u32>,
    /// Boxes around each solid's particles, in its frame [m].
    bounds: Vec<Bounds>,
    /// Power of two above each solid's size [m]: the largest coordinate of its particles.
    size: Vec<f64>,
    entries: Vec<Entry>,
    /// Pairs with particles near each other; evaluated on the device.
    pub pairs: Vec<Pair>,
    poses: Vec<PaperPose>,
    /// Blocks of all pairs' forces.
    blocks: usize,
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
            first.push(place(all.len())?);
            let both = layer.offsets.iter().zip(&layer.normals);
            all.extend(both.map(|(o, n)| words(*o, n, size / PARTS)));
        }
        link.write(buffer::contact_layer, all.as_flattened())?;
        link.write(buffer::paper_law, &[PaperLaw::new(law)])?;
        let bounds = layers.iter().map(|l| bounds(l.offsets.iter().copied())).collect();
        let (entries, pairs, poses) = (vec![], vec![], vec![]);
        Ok(Self { generation: 0, first, bounds, size, entries, pairs, poses, blocks: 0 })
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
        self.close(model, candidates, bodies, law);
        self.generation = candidates.generation();
        self.blocks = 0;
        if !self.entries.is_empty() {
            let mut blocks = self.send_near(model, bodies, link)?;
            let all = blocks.len();
            link.reserve(buffer::contact_row, (1 + GROUP) * all)?;
            link.run(&[(contact_paper::count, all as u64)])?;
            let found = link.read(buffer::contact_row, all)?;
            let list = self.place_candidates(&mut blocks, &found)?;
            link.reserve(buffer::contact_list, list)?;
            link.reserve(buffer::contact_sum, 3 * self.blocks)?;
            if !self.entries.is_empty() {
                self.send(bodies, link)?;
                link.write(buffer::paper_block, &blocks)?;
                link.run(&[(contact_paper::fill, all as u64)])?;
                link.write(buffer::paper_block, &self.force_blocks()?)?;
            }
        }
        self.pairs = self.entries.iter().map(|e| Pair::new(e.a, e.b, e.image)).collect();
        Ok(())
    }

    /// Makes the entries: solids that are close, with what may be near.
    fn close(&mut self, model: &Lists, candidates: &Candidates, bodies: &[Body], law: &Constants) {
        let entry = |(pair, reach): (Pair, f64)| {
            let Pair { a, b, image: way, .. } = pair;
            let (body, own, around) = (&bodies[a], &model.layers[a].offsets, &self.bounds[a]);
            let origin = body.pose.position;
            let still = body.rotation.transpose();
            let near = match b {
                Some(b) => {
                    let shift = still * (image(&bodies[b], way).position - origin);
                    let turn = still * bodies[b].rotation;
                    let theirs = model.layers[b].offsets.iter().enumerate();
                    near(own, around, theirs.map(|(k, o)| (k as u32, turn * *o + shift)), reach)
                }
                None => {
                    let mut walls = vec![];
                    let grid = &model.walls.grid;
                    grid.near(origin, body.radius() + reach, |j| {
                        walls.push((j, still * (grid.point(j) - origin)))
                    });
                    near(own, around, walls.into_iter(), reach)
                }
            };
            let record = PaperPair::default();
            Some(Entry { a, b, image: way, reach, origin, near: near?, record, candidates: 0, list: 0 })
        };
        let pairs = model.close(candidates, bodies, law.distance);
        self.entries = if pairs.len() >= MANY_PAIRS {
            pairs.into_par_iter().filter_map(entry).collect()
        } else {
            pairs.into_iter().filter_map(entry).collect()
        };
    }

    /// Gives the device what may be near; the blocks of the search.
    fn send_near(&mut self, model: &Lists, bodies: &[Body], link: &mut Link) -> Result<Vec<PaperBlock>> {
        let (mut fixed, mut numbers): (Vec<[[f32; 4]; 3]>, Vec<u32>) = (vec![], vec![]);
        let mut blocks = vec![];
        for (k, e) in self.entries.iter_mut().enumerate() {
            let own = &e.near.own;
            for start in (0..own.len()).step_by(GROUP) {
                let (first, count) = (place(numbers.len() + start)?, GROUP.min(own.len() - start) as u32);
                blocks.push(PaperBlock { pair: place(k)?, first, count, ..Default::default() });
            }
            numbers.extend(own);
            let theirs = &e.near.theirs;
            let mut first = 0;
            match e.b {
                Some(b) => {
                    first = self.first[b];
                    e.record.near = place(numbers.len())?;
                    numbers.extend(theirs);
                }
                None => {
                    let step = self.size[e.a] / PARTS;
                    let wall = |&j: &u32| {
                        words(model.walls.grid.point(j) - e.origin, &model.walls.normals[j as usize], step)
                    };
                    first |= ON_WALL | place(fixed.len())?;
                    fixed.extend(theirs.iter().map(wall));
                }
            }
            e.record.first = [self.first[e.a], first];
            e.record.count = theirs.len() as u32;
        }
        place((1 + GROUP) * blocks.len())?;
        let all = blocks.len() as u32;
        blocks.iter_mut().for_each(|b| b.blocks = all);
        link.write(buffer::contact_wall, fixed.as_flattened())?;
        link.write(buffer::contact_near, &numbers)?;
        link.write(buffer::paper_block, &blocks)?;
        self.send(bodies, link)?;
        Ok(blocks)
    }

    /// Keeps the pairs with candidates, of which each of `blocks` has `found` some, and gives these their places, one
    /// block's behind those of the block before; how many there are.
    fn place_candidates(&mut self, blocks: &mut [PaperBlock], found: &[u32]) -> Result<usize> {
        let mut list = 0;
        for (block, &found) in blocks.iter_mut().zip(found) {
            let entry = &mut self.entries[block.pair as usize];
            if entry.candidates == 0 {
                entry.list = list;
            }
            block.list = place(list)?;
            entry.candidates += found as usize;
            list += found as usize;
        }
        place(list)?;
        // Numbers among those that stay; blocks of the others find nothing wherever they look.
        let mut stay = 0;
        let kept = self.entries.iter().map(|e| {
            stay += u32::from(e.candidates > 0);
            stay.max(1) - 1
        });
        let kept: Vec<u32> = kept.collect();
        blocks.iter_mut().for_each(|b| b.pair = kept[b.pair as usize]);
        self.entries.retain(|e| e.candidates > 0);
        self.blocks = self.entries.iter().map(Entry::blocks).sum();
        Ok(list)
    }

    /// The blocks of the forces.
    fn force_blocks(&self) -> Result<Vec<PaperBlock>> {
        let (mut out, blocks) = (Vec::with_capacity(self.blocks), place(self.blocks)?);
        for (pair, e) in self.entries.iter().enumerate() {
            for start in (0..e.candidates).step_by(MANY_CANDIDATES) {
                let (first, count) =
                    (place(e.list + start)?, MANY_CANDIDATES.min(e.candidates - start) as u32);
                out.push(PaperBlock { pair: place(pair)?, first, count, list: 0, blocks });
            }
        }
        Ok(out)
    }

    /// Records and poses of the pairs.
    fn send(&mut self, bodies: &[Body], link: &mut Link) -> Result<()> {
        let records: Vec<PaperPair> = self.entries.iter().map(|e| e.record).collect();
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
        link.run(&[(contact_paper::force, self.blocks as u64)])?;
        let sums = link.read(buffer::contact_sum, 3 * self.blocks)?;
        let mut sums = sums.as_chunks().0.iter();
        for (pair, e) in self.pairs.iter_mut().zip(&self.entries) {
            let blocks = sums.by_ref().take(e.blocks()).map(Sum::of_block);
            take(pair, &blocks.reduce(Sum::with).unwrap_or_default(), law, bodies);
        }
        Ok(())
    }

    /// Candidates: the two solids (walls last) and the numbers of the two particles.
    pub fn listed(&self, link: &mut Link) -> Result<Vec<[u64; 4]>> {
        let end = self.entries.iter().map(|e| e.list + e.candidates).max().unwrap_or(0);
        let list = link.read(buffer::contact_list, end)?;
        let of = |e: &Entry| {
            let number = |j: u32| if e.b.is_some() { j } else { e.near.theirs[j as usize] };
            let (a, b) = (e.a as u64, e.b.map_or(u64::MAX, |b| b as u64));
            let own = &list[e.list..e.list + e.candidates];
            own.iter().map(|&[i, j]| [a, b, i.into(), number(j).into()]).collect::<Vec<_>>()
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
        // Always 0.0: `as_rounded` in the shader takes its bits.
        spin_b: four(still * spin, 0.0),
    }
}
