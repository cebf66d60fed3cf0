//! What the points of a sweep compute on, as the command line chooses it.

use super::engine::Processor;
use seixo::backend::Backend;
use seixo::backend::cpu::Cpu;
use seixo::backend::gpu::Gpu;
use seixo::error::{Error, Result};
use seixo::params::Params;
use seixo::plan::Plan;
use seixo::pressure::Settings;
use seixo::scene::Scene;
use std::sync::OnceLock;

/// The processors of this machine.
pub struct Computers {
    adapter: Option<String>,
    hardware: OnceLock<bool>,
}

impl Computers {
    /// `threads` of the CPU, all cores if `None`; the GPU that `adapter` names, a hardware one if `None`.
    pub fn new(threads: Option<u16>, adapter: Option<String>) -> Self {
        if let Some(threads) = threads {
            // Fails only if the pool exists already, and nothing parallel has run yet.
            let _ = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
        }
        Self { adapter, hardware: OnceLock::new() }
    }

    /// A backend on `processor`. Drivers are asked only when the first point wants a GPU.
    ///
    /// # Errors
    /// [`Error::Gpu`] without one, or what the backend says.
    pub fn backend(
        &self,
        processor: Processor,
        scene: &Scene,
        params: &Params,
        plan: &Plan,
        settings: Settings,
    ) -> Result<Box<dyn Backend>> {
        let adapter = self.adapter.as_deref();
        let usable = || *self.hardware.get_or_init(|| adapter.is_some() || Gpu::hardware_available());
        match processor {
            Processor::Cpu => Ok(Box::new(Cpu::new(scene, params, plan, settings)?)),
            Processor::Gpu if !usable() => Err(Error::Gpu(
                "no hardware GPU; a software adapter is taken only if named with --adapter".into(),
            )),
            Processor::Gpu => Ok(Box::new(Gpu::new(scene, params, plan, settings, adapter)?)),
        }
    }
}
