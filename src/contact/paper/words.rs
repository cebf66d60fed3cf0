//! What crosses over to shaders/contact_paper.wgsl and back: particles in two parts, blocks, sums.

use super::facing::Facing;
use super::{Constants, Pair};
use crate::body::{Body, Wrench};
use crate::compute::shader_structs;
use crate::contact::candidates::image;
use crate::contact::device::{four, vector};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;

/// Set in the place of the particles of fixed walls; `ON_WALL` in the shaders.
pub const ON_WALL: u32 = 0x8000_0000;
/// Bits of a high part: 1 / 2^11 of the largest, so that a product of two has at most 24 bits.
pub(super) const PARTS: f64 = 2048.0;

/// See `PaperPair` in shaders/contact_paper.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct PaperPair {
    pub first: [u32; 2],
    pub near: u32,
    pub count: u32,
}

/// See `PaperBlock` in shaders/contact_paper.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct PaperBlock {
    pub pair: u32,
    pub first: u32,
    pub count: u32,
    pub list: u32,
    pub blocks: u32,
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

shader_structs!(PaperPair, PaperBlock, PaperPose, PaperLaw);
impl PaperLaw {
    pub(super) fn new(law: &Constants) -> Self {
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
pub(super) fn power_of_two(x: f64) -> f64 {
    x.max(f64::from(f32::MIN_POSITIVE)).log2().ceil().exp2()
}

/// `x` as a multiple of `step` and the rest.
pub(super) fn split(x: DVec3, step: f64) -> [DVec3; 2] {
    let high = (x / step).round() * step;
    [high, x - high]
}

/// Words of a particle.
pub(super) fn words(offset: DVec3, facing: &Facing, step: f64) -> [[f32; 4]; 3] {
    let [high, low] = split(offset, step);
    let (way, faces) = facing.numbers();
    [four(high, 0.0), four(low, 0.0), four(way, faces)]
}

/// Sums over a pair in A's frame; see `contact_sum` in the shader.
#[derive(Default)]
pub(super) struct Sum {
    force: DVec3,
    normal_force: f64,
    moment: DVec3,
    energy: f64,
    count: f64,
    deepest: f64,
}

impl Sum {
    pub fn of_block(&[push, moment, [count, deepest, ..]]: &[[f32; 4]; 3]) -> Self {
        Self {
            force: vector(push),
            normal_force: push[3].into(),
            moment: vector(moment),
            energy: moment[3].into(),
            count: count.into(),
            deepest: deepest.into(),
        }
    }

    pub fn with(self, next: Self) -> Self {
        Self {
            force: self.force + next.force,
            normal_force: self.normal_force + next.normal_force,
            moment: self.moment + next.moment,
            energy: self.energy + next.energy,
            count: self.count + next.count,
            deepest: self.deepest.max(next.deepest),
        }
    }
}

/// Turns the sums of a pair, which are in A's frame and about A's centre, to the world, and divides by n_c.
pub(super) fn take(pair: &mut Pair, sum: &Sum, law: &Constants, bodies: &[Body]) {
    let a = &bodies[pair.a];
    let (force, torque) = (a.rotation * sum.force, a.rotation * sum.moment);
    let arm = pair.b.map_or(DVec3::ZERO, |b| a.pose.position - image(&bodies[b], pair.image).position);
    let share = 1.0 / sum.count.max(1.0);
    let on_b = match pair.b {
        Some(_) => Wrench { force: -force, torque: -(torque + arm.cross(force)) },
        None => Wrench::default(),
    };
    pair.wrench = [Wrench { force, torque }, on_b].map(|w| Wrench {
        force: share * w.force,
        torque: if law.torque { share * w.torque } else { DVec3::ZERO },
    });
    pair.count = sum.count as usize;
    pair.energy = share * sum.energy;
    pair.closest = if sum.count > 0.0 { law.distance - sum.deepest } else { f64::INFINITY };
    pair.normal_force = share * sum.normal_force;
}
