//! A device as contact sees it: named buffers that grow, and kernels that run over them.

use crate::error::Result;

/// Buffers and kernels of a device, by the names that the shaders give them.
pub trait Compute {
    /// Makes a buffer hold at least `bytes`. What it held is lost if it has to grow.
    ///
    /// # Errors
    /// [`crate::error::Error::Gpu`] if the device has no such buffer or no room.
    fn reserve(&mut self, buffer: &'static str, bytes: u64) -> Result<()>;
    /// Writes to the start of a buffer.
    ///
    /// # Errors
    /// As [`Compute::reserve`].
    fn upload(&mut self, buffer: &'static str, data: &[u8]) -> Result<()>;
    /// Records kernels, each with its number of workgroups, to run one after the other.
    ///
    /// # Errors
    /// [`crate::error::Error::Gpu`] if there is no such kernel or a device cannot run so many workgroups.
    fn dispatch(&mut self, kernels: &[(&str, u64)]) -> Result<()>;
    /// Waits for what was recorded, and reads the start of a buffer.
    ///
    /// # Errors
    /// [`crate::error::Error::Gpu`] if the device is lost.
    fn download(&mut self, buffer: &'static str, bytes: u64) -> Result<Vec<u8>>;
}
