//! Checkpoints: the whole state of a run, so that it goes on as if it had never stopped.

pub mod archive;
pub mod file;
pub mod size;

pub use archive::Archive;
pub use file::{Found, Origin};
