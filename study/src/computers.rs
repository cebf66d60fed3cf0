//! What the points of a sweep compute on, as the command line chooses it.

use super::engine::Processor;
use seixo::backend::gpu::Gpu;
use seixo::backend::{self, Backend};
use seixo::error::{GpuError, Result};
use seixo::params::Params;
use seixo::plan::Plan;
use seixo::pressure::Settings;
use seixo::scene::Scene;
use std::sync::OnceLock;

/// The processors of this machine.
pub struct Computers {
    gpu: backend::Processor,
    named: bool,
    hardware: OnceLock<bool>,
}

impl Computers {
    /// With the GPU that `adapter` names, a hardware one if `None`.
    pub fn new(adapter: Option<String>) -> Self {
        let named = adapter.is_some();
        Self { gpu: backend::Processor::Gpu { adapter }, named, hardware: OnceLock::new() }
    }

    /// A backend on `processor`. Drivers are asked only when the first point wants a GPU.
    ///
    /// # Errors
    /// [`seixo::Error::Gpu`] without one, or what the backend says.
    pub fn backend(
        &self,
        processor: Processor,
        scene: &Scene,
        params: &Params,
        plan: &Plan,
        settings: Settings,
    ) -> Result<Box<dyn Backend>> {
        let usable = || *self.hardware.get_or_init(|| self.named || Gpu::hardware_available());
        match processor {
            Processor::Cpu => backend::Processor::Cpu.open(scene, params, plan, settings),
            Processor::Gpu if !usable() => Err(GpuError::NoAdapter(
                "no hardware GPU; a software adapter is taken only if named with --adapter".into(),
            )
            .into()),
            Processor::Gpu => self.gpu.open(scene, params, plan, settings),
        }
    }
}
