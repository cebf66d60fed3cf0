//! What the memory of a device delivers.

use super::adapter;
use crate::error::{Error, Result};
use std::time::Instant;

/// Bytes of each of the two buffers: more than the caches hold.
const BYTES: u64 = 256 << 20;
/// Copies that are timed together, so that the submission's own time does not count.
const COPIES: u32 = 8;

/// Copy bandwidth of the memory of `adapter` (as for [`super::Gpu::new`]), reads and writes counted [bytes/s]: best
/// of five.
///
/// # Errors
/// [`Error::Gpu`] if there is no such adapter, or no room on it.
pub fn bandwidth(adapter: Option<&str>) -> Result<f64> {
    let (adapter, info) = adapter::choose(adapter)?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default()))
        .map_err(|e| Error::gpu(format!("{}: {e}", info.name)))?;
    let scope = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let buffer = |usage| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("bandwidth"),
            size: BYTES,
            usage,
            mapped_at_creation: false,
        })
    };
    let from = buffer(wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST);
    let to = buffer(wgpu::BufferUsages::COPY_DST);
    if let Some(e) = pollster::block_on(scope.pop()) {
        return Err(Error::gpu(format!("{}: {e}", info.name)));
    }
    let copy = |count: u32| {
        let mut encoder = device.create_command_encoder(&Default::default());
        for _ in 0..count {
            encoder.copy_buffer_to_buffer(&from, 0, &to, 0, BYTES);
        }
        let start = Instant::now();
        queue.submit([encoder.finish()]);
        device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|e| Error::gpu(format!("{}: {e}", info.name)))?;
        Ok::<f64, Error>(start.elapsed().as_secs_f64())
    };
    // New buffers are cleared first.
    copy(1)?;
    let mut best = 0.0_f64;
    for _ in 0..5 {
        // What both take is start and wait; what they differ by is the copies.
        let (one, many) = (copy(1)?, copy(1 + COPIES)?);
        let seconds = (many - one).max(0.5 * many);
        best = best.max(2.0 * BYTES as f64 * f64::from(COPIES) / seconds);
    }
    Ok(best)
}
