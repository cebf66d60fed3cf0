//! Contact with the pairs of points on a device: it searches them once for every life of the lists and gives
//! their forces at every sub-step. Which solids are close, f64 sums over the solids, friction and motion stay on
//! the host, and so do the edges of the smooth law: what they bring to a face is handed over. They are sought
//! where the host alone would seek them, for every pair and sub-step, and are most of what is left to the host.
//!
//! A device computes in f32, and the overlap of a body at rest is a millionth of its size. So no position crosses
//! over. For each pair of solids the host gives in f64 how one lies to the other, as clearances (`smooth`) or in
//! two parts (`paper`), and the shader computes from small numbers. See the head comments of
//! shaders/contact_smooth.wgsl and shaders/contact_paper.wgsl.

pub use super::{paper::device as paper, smooth::device as smooth};

use crate::compute::{Buffer, Compute, Element, Kernel, Program};
use crate::error::{Error, Result};
use glam::DVec3;

/// The programs of all laws that have one.
pub const PROGRAMS: [&Program; 2] = [&smooth::PROGRAM, &paper::PROGRAM];

/// What contact has asked of a device so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Kernels started.
    pub dispatches: u64,
    /// Times that the host waited for an answer.
    pub round_trips: u64,
    /// Bytes sent.
    pub sent: u64,
    /// Bytes read back.
    pub read: u64,
}

/// A device, with its traffic counted.
pub(crate) struct Link<'a> {
    pub compute: &'a mut dyn Compute,
    pub traffic: &'a mut Traffic,
}

impl Link<'_> {
    pub(super) fn write<T: Element>(&mut self, buffer: Buffer<T>, data: &[T]) -> Result<()> {
        self.traffic.sent += size_of_val(data) as u64;
        self.compute.upload(buffer.id(), bytemuck::cast_slice(data))
    }

    pub(super) fn reserve<T: Element>(&mut self, buffer: Buffer<T>, count: usize) -> Result<()> {
        self.compute.reserve(buffer.id(), buffer.size() * count as u64)
    }

    pub(super) fn run(&mut self, kernels: &[(Kernel, u64)]) -> Result<()> {
        self.traffic.dispatches += kernels.len() as u64;
        self.compute.dispatch(kernels)
    }

    pub(super) fn read<T: Element>(&mut self, buffer: Buffer<T>, count: usize) -> Result<Vec<T>> {
        let bytes = buffer.size() * count as u64;
        self.traffic.round_trips += 1;
        self.traffic.read += bytes;
        Ok(bytemuck::pod_collect_to_vec(&self.compute.download(buffer.id(), bytes)?))
    }
}

pub(super) fn four(v: DVec3, w: f64) -> [f32; 4] {
    let v = v.as_vec3();
    [v.x, v.y, v.z, w as f32]
}

pub(super) fn three(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

pub(super) fn vector(v: [f32; 4]) -> DVec3 {
    DVec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]))
}

/// A place in a buffer as a device counts.
pub(super) fn place(n: usize) -> Result<u32> {
    u32::try_from(n).ok().filter(|n| n >> 31 == 0).ok_or_else(|| {
        Error::gpu("contact has more candidates than a device can number; use contact.device = \"host\"")
    })
}
