//! The smooth law on a device: what shaders/contact_smooth.wgsl is given, and what becomes of its answers.

mod shown;

use super::Smooth;
use super::pair::{Other, Pair};
use crate::body::Body;
use crate::compute::{Kernel, Program, buffers, kernels, shader_structs};
use crate::contact::candidates::{Candidates, MANY_PAIRS};
use crate::contact::device::{Link, four, place, three};
use crate::contact::substeps::Limits;
use crate::error::Result;
use crate::shape::Surface;
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use shown::{given, pose, read, slots};
use std::sync::Arc;

/// Coordinates this close to the largest or smallest of a solid, over its size, are taken as equal to it: points
/// of a face then lie in one plane in f32 too.
const SNAP: f64 = 1e-9;
/// The search takes in what f32 cannot tell from the skin, over the size of the solids.
const ROUNDING: f64 = 1e-6;
/// Listed points from which a pair has a wider workgroup; as in the shader.
pub const MANY_POINTS: u32 = 2048;

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
    pub sum: u32,
    pub share: f32,
    pub skin: f32,
    pub open: u32,
    pub pairs: u32,
    pub mass: f32,
    pub pad: u32,
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
    pub found: [f32; 4],
    pub found_push: [f32; 4],
    pub found_moment: [f32; 4],
    pub gives: [[f32; 4]; 4],
    pub turns_a: [[f32; 4]; 4],
    pub turns_b: [[f32; 4]; 4],
    pub given: [u32; 4],
}

shader_structs!(SmoothPair, SmoothPose);
kernels!(contact_smooth[64]: search force);
/// `force` of pairs of [`MANY_POINTS`] or more.
const FORCE_WIDE: Kernel = Kernel { file: "contact_smooth", entry: "force_wide", width: 256 };
buffers! {
    contact_point: [f32; 4], Writes;
    smooth_pair: SmoothPair, Writes;
    smooth_pose: SmoothPose, Writes;
    contact_list: u32, Reads;
    contact_count: [u32; 2], Reads;
    contact_state: [f32; 4], None;
    contact_sum: [f32; 4], Reads;
    /// As `contact_state`.
    contact_given: [f32; 4], Writes;
}

/// The law on a device.
pub const PROGRAM: Program = Program {
    name: "contact_smooth",
    text: contact_smooth::TEXT,
    kernels: &[contact_smooth::search, contact_smooth::force, FORCE_WIDE],
    buffers: buffer::ALL,
};

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

/// The smooth law's pairs on a device.
pub(crate) struct Pairs {
    generation: u64,
    clouds: Vec<Cloud>,
    /// Pairs with points near each other, and of each what the device knows.
    pub pairs: Vec<Pair>,
    records: Vec<SmoothPair>,
    poses: Vec<SmoothPose>,
    /// Contacts found beside the device that it takes in.
    given: Vec<[[f32; 4]; 3]>,
    states: usize,
    sums: usize,
    /// Sub-step and longest step [s] that the device has the constants of.
    constants: Option<(f64, f64)>,
    sent: bool,
}

impl Pairs {
    /// Gives the device the points of all solids.
    pub fn new(surfaces: &[Arc<Surface>], link: &mut Link) -> Result<Self> {
        let mut points = vec![];
        let clouds = surfaces
            .iter()
            .map(|s| Cloud::add(&mut points, &s.points, |k| s.weights[k]))
            .collect::<Result<_>>()?;
        link.write(buffer::contact_point, &points)?;
        Ok(Self {
            generation: 0,
            clouds,
            pairs: vec![],
            records: vec![],
            poses: vec![],
            given: vec![],
            states: 0,
            sums: 0,
            constants: None,
            sent: false,
        })
    }

    /// Whether the lists are those of `candidates`.
    pub fn is_current(&self, candidates: &Candidates) -> bool {
        self.generation == candidates.generation()
    }

    /// What was before says nothing.
    pub fn forget(&mut self) {
        self.generation = 0;
    }

    /// Searches the pairs anew.
    pub fn search(
        &mut self,
        model: &Smooth,
        candidates: &Candidates,
        bodies: &[Body],
        link: &mut Link,
    ) -> Result<()> {
        let mut list = 0;
        let before = std::mem::take(&mut self.pairs);
        self.records.clear();
        for (mut pair, skin) in model.close(candidates, bodies) {
            let (body, own) = (&bodies[pair.a], self.clouds[pair.a]);
            let (theirs, faces_b, share) = match pair.b {
                Other::Solid(b) => (self.clouds[b], model.surfaces[b].all_faces, 0.5),
                Other::Wall(w) => (Cloud::default(), model.walls[w].faces, 1.0),
            };
            pair.collect_edges(bodies, &model.surfaces, &model.walls, skin);
            let size = body.radius() + theirs.low.length().max(theirs.high.length());
            self.records.push(SmoothPair {
                low_a: three(own.low),
                high_a: three(own.high),
                low_b: three(theirs.low),
                high_b: three(theirs.high),
                half_a: three(body.shape.extent(DMat3::IDENTITY)),
                first: [own.first, theirs.first],
                count: [own.count, theirs.count],
                faces: [u32::from(faces_b), u32::from(model.surfaces[pair.a].all_faces)],
                list: place(list)?,
                share: share as f32,
                skin: (skin + ROUNDING * size) as f32,
                ..SmoothPair::default()
            });
            list += (own.count + theirs.count) as usize;
            self.pairs.push(pair);
        }
        if !self.pairs.is_empty() {
            self.place_poses(model, bodies)?;
            let pairs = place(self.records.len())?;
            self.records.iter_mut().for_each(|r| r.pairs = pairs);
            link.write(buffer::smooth_pair, &self.records)?;
            link.write(buffer::smooth_pose, &self.poses)?;
            link.reserve(buffer::contact_list, list)?;
            link.reserve(buffer::contact_count, self.pairs.len())?;
            link.run(&[(contact_smooth::search, self.pairs.len() as u64)])?;
            let near = link.read(buffer::contact_count, self.pairs.len())?;
            self.keep(&near)?;
            link.reserve(buffer::contact_sum, self.sums)?;
        }
        Smooth::carry(&before, self.generation == 0, &mut self.pairs);
        self.generation = candidates.generation();
        (self.constants, self.sent) = (None, false);
        Ok(())
    }

    /// Keeps the pairs with points near each other and gives each its place.
    fn keep(&mut self, near: &[[u32; 2]]) -> Result<()> {
        let mut sum = 0;
        let (pairs, records) = (std::mem::take(&mut self.pairs), std::mem::take(&mut self.records));
        for ((pair, mut record), &near) in pairs.into_iter().zip(records).zip(near) {
            if near == [0, 0] && pair.is_empty() {
                continue;
            }
            record.near = near;
            // Faces that points, edges or corners of the other may press.
            let pressed = [
                near[0] > 0 || !pair.edges_a.is_empty(),
                near[1] > 0 || !pair.edges_b.is_empty() || !pair.samples.is_empty(),
            ];
            let [on_b, on_a] = [0, 1].map(|k| if pressed[k] { record.faces[k] } else { 0 });
            record.open = on_b | on_a << 6;
            record.sum = place(sum)?;
            sum += 1 + 4 * slots(&record).count();
            self.pairs.push(pair);
            self.records.push(record);
        }
        self.sums = sum;
        Ok(())
    }

    /// Constants of every pair for sub-steps of `h` [s].
    pub fn set_constants(&mut self, model: &Smooth, limits: &Limits, bodies: &[Body], h: f64) {
        let wanted = Some((h, limits.longest_step));
        if self.constants != wanted {
            model.set_constants(&mut self.pairs, limits, bodies, h);
            (self.constants, self.sent) = (wanted, false);
        }
    }

    /// How each pair lies now, and what the host finds beside the points.
    fn place_poses(&mut self, model: &Smooth, bodies: &[Body]) -> Result<()> {
        let clouds = &self.clouds;
        let of = |(pair, record): (&mut Pair, &SmoothPair)| {
            let (surfaces, walls) = (&model.surfaces, &model.walls);
            let found = pair.find_beside_device(bodies, surfaces, walls, model.spacing, record.open);
            let (deepest, mode) = found;
            let still = bodies[pair.a].rotation.transpose();
            SmoothPose {
                found: [deepest, mode.eighth, mode.sixth, 0.0].map(|x| x as f32),
                found_push: four(still * mode.push, 0.0),
                found_moment: four(still * mode.moment, 0.0),
                ..pose(pair, clouds, model, bodies)
            }
        };
        if self.pairs.len() >= MANY_PAIRS {
            self.pairs.par_iter_mut().zip(&self.records).map(of).collect_into_vec(&mut self.poses);
        } else {
            self.poses.clear();
            self.poses.extend(self.pairs.iter_mut().zip(&self.records).map(of));
        }
        self.given.clear();
        let mut state = 0;
        for ((pose, pair), record) in self.poses.iter_mut().zip(&self.pairs).zip(&self.records) {
            let count = pair.given.len();
            pose.given = [place(self.given.len())?, place(count)?, place(state)?, 0];
            state += 3 * (record.near.iter().sum::<u32>() as usize + count);
            let a = &bodies[pair.a];
            self.given.extend(pair.given.iter().map(|c| given(c, a)));
        }
        self.states = state;
        Ok(())
    }

    /// Normal forces of all pairs at the bodies' poses and velocities.
    pub fn evaluate(&mut self, model: &Smooth, bodies: &[Body], link: &mut Link) -> Result<()> {
        if self.pairs.is_empty() {
            return Ok(());
        }
        self.place_poses(model, bodies)?;
        link.reserve(buffer::contact_state, self.states)?;
        if !self.sent {
            let pairs = place(self.records.len())?;
            for (record, pair) in self.records.iter_mut().zip(&self.pairs) {
                let c = &pair.constants;
                record.pairs = pairs;
                (record.spring, record.stop) = (c.spring as f32, c.stop as f32);
                (record.stop_depth, record.damping) = (c.stop_depth as f32, c.damping as f32);
                (record.step, record.mass) = (c.step as f32, c.mass as f32);
            }
            link.write(buffer::smooth_pair, &self.records)?;
            self.sent = true;
        }
        link.write(buffer::smooth_pose, &self.poses)?;
        link.write(buffer::contact_given, self.given.as_flattened())?;
        // Each passes over the pairs of the other; most scenes have none of the second.
        let groups = self.pairs.len() as u64;
        let large = |r: &SmoothPair| r.near.iter().sum::<u32>() >= MANY_POINTS;
        let wide = self.records.iter().any(large).then_some((FORCE_WIDE, groups));
        let narrow = (!self.records.iter().all(large)).then_some((contact_smooth::force, groups));
        link.run(&narrow.into_iter().chain(wide).collect::<Vec<_>>())?;
        let sums = link.read(buffer::contact_sum, self.sums)?;
        let take = |(pair, record): (&mut Pair, &SmoothPair)| {
            let sums = read(pair, record, &sums[record.sum as usize..], bodies);
            pair.join(&sums, bodies);
        };
        if self.pairs.len() >= MANY_PAIRS {
            self.pairs.par_iter_mut().zip(&self.records).for_each(take);
        } else {
            self.pairs.iter_mut().zip(&self.records).for_each(take);
        }
        Ok(())
    }

    /// Points on the lists: pair, side and place (world) of each.
    pub fn listed(
        &self,
        surfaces: &[Arc<Surface>],
        bodies: &[Body],
        link: &mut Link,
    ) -> Result<Vec<(usize, Other, u8, DVec3)>> {
        let end = self.records.iter().map(|r| r.list + r.count[0] + r.count[1]).max();
        let list = link.read(buffer::contact_list, end.unwrap_or(0) as usize)?;
        let mut out = vec![];
        for (pair, record) in self.pairs.iter().zip(&self.records) {
            for (side, solid) in [(0, Some(pair.a)), (1, pair.b.solid())] {
                let Some(solid) = solid else { continue };
                let from = record.list + if side == 1 { record.count[0] } else { 0 };
                for &k in &list[from as usize..(from + record.near[side]) as usize] {
                    let point = surfaces[solid].points[(k - record.first[side]) as usize];
                    let way = if side == 1 { pair.image } else { DVec3::ZERO };
                    let at = bodies[solid].pose.position + way + bodies[solid].rotation * point;
                    out.push((pair.a, pair.b, side as u8, at));
                }
            }
            out.extend(pair.samples.iter().map(|x| (pair.a, pair.b, 1, *x)));
        }
        Ok(out)
    }
}
