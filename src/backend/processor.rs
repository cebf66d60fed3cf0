//! The choice of a processor for the particle stages.

use super::Backend;
use super::cpu::Cpu;
use super::gpu::{AdapterInfo, Gpu, adapters};
use crate::error::Result;
use crate::params::Params;
use crate::plan::Plan;
use crate::pressure::Settings;
use crate::scene::Scene;

/// What computes the particle stages.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Processor {
    /// A hardware GPU if there is one and the scene has fluid, else the CPU.
    #[default]
    Auto,
    /// A GPU, never replaced by anything else.
    Gpu {
        /// Its number in [`adapters`], or a part of its name; the first hardware adapter, else any, if `None`.
        adapter: Option<String>,
    },
    /// The CPU, in f64.
    Cpu,
}

impl Processor {
    /// The particles of `scene` on this processor.
    ///
    /// # Errors
    /// [`crate::error::Error::Gpu`]: no such adapter, or one that the scene does not fit.
    pub fn open(
        &self,
        scene: &Scene,
        params: &Params,
        plan: &Plan,
        settings: Settings,
    ) -> Result<Box<dyn Backend>> {
        let adapter = match self {
            Self::Cpu => return Ok(Box::new(Cpu::new(scene, params, plan, settings)?)),
            Self::Gpu { adapter } => adapter.clone(),
            Self::Auto => {
                // A dry scene has no particle stages: nothing that a GPU could do.
                let hardware = || adapters().iter().position(AdapterInfo::is_hardware);
                match if plan.wet() { hardware() } else { None } {
                    Some(number) => Some(number.to_string()),
                    None => return Self::Cpu.open(scene, params, plan, settings),
                }
            }
        };
        Ok(Box::new(Gpu::new(scene, params, plan, settings, adapter.as_deref())?))
    }
}
