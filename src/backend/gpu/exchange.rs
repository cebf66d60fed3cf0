//! Data between host and device, and the submissions that they take.

use super::context::Context;
use crate::compute::{Buffer, Element, Id};
use crate::error::{Error, Result};
use std::sync::mpsc;

/// A part of a buffer: which, first byte, bytes.
pub(super) type Part = (Id, u64, u64);

impl Context {
    /// Hand what is recorded to the device.
    pub(crate) fn submit(&mut self) {
        if let Some(mut encoder) = self.encoder.take() {
            if let Some(clock) = &mut self.clock {
                clock.mark(&mut encoder, None);
            }
            self.queue.submit([encoder.finish()]);
            self.mail.1 = 0;
            self.commands.submits += 1;
        }
    }

    /// Write to the start of a buffer; what was recorded before still sees the old content. Little data goes with
    /// the next submission, much causes one.
    pub(crate) fn upload<T: Element>(&mut self, buffer: Buffer<T>, data: &[T]) -> Result<()> {
        self.upload_bytes(buffer.id(), bytemuck::cast_slice(data))
    }

    /// [`Context::upload`] of bytes.
    pub(crate) fn upload_bytes(&mut self, buffer: Id, data: &[u8]) -> Result<()> {
        self.upload_to(buffer, 0, data)
    }

    /// Write to a buffer from byte `first` on.
    pub(super) fn upload_to(&mut self, buffer: Id, first: u64, data: &[u8]) -> Result<()> {
        let mut rest = data;
        for (target, first, bytes) in self.pieces(buffer, first, data.len() as u64)? {
            let (piece, behind) = rest.split_at(bytes as usize);
            self.upload_piece(&target, first, piece);
            rest = behind;
        }
        Ok(())
    }

    fn upload_piece(&mut self, target: &wgpu::Buffer, first: u64, data: &[u8]) {
        let (mail, at) = (self.mail.0.clone(), self.mail.1);
        let end = at + data.len() as u64;
        if end > mail.size() {
            self.submit();
            self.queue.write_buffer(target, first, data);
        } else {
            // The queue writes before the submission; no two uploads of one share a place.
            self.queue.write_buffer(&mail, at, data);
            self.record().copy_buffer_to_buffer(&mail, at, target, first, data.len() as u64);
            self.mail.1 = end;
        }
    }

    /// Read the first `count` elements of a buffer.
    pub(crate) fn download<T: Element>(&mut self, buffer: Buffer<T>, count: usize) -> Result<Vec<T>> {
        self.download_parts(buffer, &[(0, count)])
    }

    /// Read parts of a buffer, given as offset and length in elements, one after the other.
    pub(crate) fn download_parts<T: Element>(
        &mut self,
        buffer: Buffer<T>,
        parts: &[(usize, usize)],
    ) -> Result<Vec<T>> {
        let (id, size) = (buffer.id(), buffer.size());
        let part = |&(first, count): &(usize, usize)| (id, first as u64 * size, count as u64 * size);
        let bytes = self.download_bytes(&parts.iter().map(part).collect::<Vec<_>>(), false)?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    /// Read parts of several buffers, one after the other, and the clock as well if `clock`: one wait, unless they
    /// are large.
    pub(crate) fn download_bytes(&mut self, parts: &[Part], clock: bool) -> Result<Vec<u8>> {
        let total = parts.iter().map(|p| p.2).sum::<u64>();
        let mut out = Vec::with_capacity(total as usize);
        let mut filled = 0;
        let staging = self.staging.clone();
        let mut pieces = Vec::with_capacity(parts.len());
        for &(id, first, bytes) in parts {
            pieces.extend(self.pieces(id, first, bytes)?);
        }
        for (buffer, first, bytes) in pieces {
            let (mut at, end) = (first, first + bytes);
            while at < end {
                if filled == staging.size() {
                    self.fetch(filled, false, &mut out)?;
                    filled = 0;
                }
                let bytes = (end - at).min(staging.size() - filled);
                self.record().copy_buffer_to_buffer(&buffer, at, &staging, filled, bytes);
                (at, filled) = (at + bytes, filled + bytes);
            }
        }
        self.fetch(filled, clock, &mut out)?;
        Ok(out)
    }

    /// Wait for `filled` bytes in the staging buffer, and for the clock if asked or due.
    fn fetch(&mut self, filled: u64, clock: bool, out: &mut Vec<u8>) -> Result<()> {
        let mut ticks = None;
        if self.clock.as_ref().is_some_and(|c| clock || c.is_full()) {
            self.record();
            if let (Some(clock), Some(encoder)) = (&mut self.clock, &mut self.encoder) {
                ticks = clock.fetch(encoder);
            }
        }
        self.submit();
        let (send, receive) = mpsc::channel();
        let staging = (filled > 0).then(|| (self.staging.clone(), filled));
        let wanted: Vec<_> = staging.iter().chain(&ticks).cloned().collect();
        for (buffer, bytes) in &wanted {
            let send = send.clone();
            buffer.map_async(wgpu::MapMode::Read, ..*bytes, move |done| {
                // The receiver is gone only if waiting has failed, which is reported there.
                let _ = send.send(done);
            });
        }
        if wanted.is_empty() {
            return Ok(());
        }
        self.wait()?;
        let lost = |e: String| Error::gpu(format!("{}: reading back failed: {e}", self.info.name));
        let mut read = Vec::with_capacity(wanted.len());
        for _ in &wanted {
            receive.try_recv().map_err(|e| lost(e.to_string()))?.map_err(|e| lost(e.to_string()))?;
        }
        for (buffer, bytes) in &wanted {
            let view = buffer.get_mapped_range(..*bytes).map_err(|e| lost(e.to_string()))?;
            read.push(view.to_vec());
            drop(view);
            buffer.unmap();
        }
        let mut read = read.into_iter();
        if staging.is_some() {
            out.extend(read.next().unwrap_or_default());
        }
        if let (Some(clock), Some(ticks)) = (&mut self.clock, read.next()) {
            clock.read(&bytemuck::pod_collect_to_vec::<u8, u64>(&ticks));
        }
        Ok(())
    }

    /// Wait until the device has done what was submitted.
    pub fn wait(&mut self) -> Result<()> {
        self.submit();
        self.commands.waits += 1;
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        polled.map_err(|e| Error::gpu(format!("{}: {e}", self.info.name)))?;
        Ok(())
    }
}
