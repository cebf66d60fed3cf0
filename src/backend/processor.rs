//! The choice of a processor for the particle stages.

use super::cpu::Cpu;
use super::gpu::{AdapterInfo, Gpu, GpuRank, adapters};
use super::{Backend, Ranked};
use crate::error::Result;
use crate::params::Params;
use crate::plan::Plan;
use crate::pressure::Settings;
use crate::ranks::Team;
use crate::scene::Scene;
use crate::share::Start;
use std::sync::Arc;

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

    /// Whether the ranks of a run have all walls that never move: on devices these stay as they were set up.
    pub(crate) fn has_every_wall(&self) -> bool {
        matches!(self, Self::Gpu { .. })
    }

    /// The part of a rank of `team`, which begins with `start`, the `k`-th on its machine ([`Team::on_machine`]): on a GPU if one is asked for, else on
    /// the CPU.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for what ranks do not compute; as [`Self::open`].
    pub fn of_team(
        &self,
        (team, k): (&Arc<dyn Team>, usize),
        start: &Start,
        plan: &Plan,
        settings: Settings,
    ) -> Result<Box<dyn Ranked>> {
        match self {
            Self::Gpu { adapter } => {
                let asked = adapter.as_deref();
                Ok(Box::new(GpuRank::of_team((team.clone(), k), start, plan, settings, asked)?))
            }
            Self::Auto | Self::Cpu => Ok(Box::new(Cpu::of_team(team.clone(), start, plan, settings)?)),
        }
    }
}
