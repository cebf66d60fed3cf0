//! The choice of a processor for the particle stages.

use super::cpu::Cpu;
use super::gpu::{AdapterInfo, Gpu, GpuRank, adapters};
use super::{Backend, Ranked};
use crate::console::remark;
use crate::error::{Error, Result};
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
    /// A hardware GPU if there is one that takes the scene and the scene has fluid, else the CPU.
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
    /// [`Error::Gpu`]: no such adapter, or one that the scene does not fit; of [`Self::Auto`] a warning on standard error.
    pub fn open(
        &self,
        scene: &Scene,
        params: &Params,
        plan: &Plan,
        settings: Settings,
    ) -> Result<Box<dyn Backend>> {
        let cpu = || -> Result<Box<dyn Backend>> { Ok(Box::new(Cpu::new(scene, params, plan, settings)?)) };
        let gpu = |adapter: Option<&str>| -> Result<Box<dyn Backend>> {
            Ok(Box::new(Gpu::new(scene, params, plan, settings, adapter)?))
        };
        match self {
            Self::Cpu => cpu(),
            Self::Gpu { adapter } => gpu(adapter.as_deref()),
            Self::Auto => {
                // A dry scene has no particle stages: nothing that a GPU could do.
                let hardware = || adapters().iter().position(AdapterInfo::is_hardware);
                match if plan.wet() { hardware() } else { None } {
                    Some(number) => gpu(Some(&number.to_string())).or_else(|why| without_device(why, cpu)),
                    None => cpu(),
                }
            }
        }
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

/// What `cpu` opens where nobody asked for the device that failed with `why`.
fn without_device<T>(why: Error, cpu: impl FnOnce() -> Result<T>) -> Result<T> {
    let Error::Gpu(why) = why else { return Err(why) };
    remark(&format!(
        "warning: the CPU computes, for the GPU cannot: {why} (--backend cpu keeps this silent, --backend gpu insists)"
    ));
    cpu()
}

#[cfg(test)]
mod tests {
    use super::without_device;
    use crate::error::{Error, Result};

    #[test]
    fn only_what_a_device_cannot_do_falls_to_the_cpu() {
        let never = || -> Result<()> { unreachable!("the scene is at fault") };
        assert_eq!(without_device(Error::gpu("no pipeline"), || Ok(7)).unwrap(), 7);
        assert!(matches!(without_device(Error::usage("x", "y"), never), Err(Error::Usage { .. })));
        let full = || -> Result<()> { Err(Error::usage("x", "y")) };
        assert!(matches!(without_device(Error::gpu("no pipeline"), full), Err(Error::Usage { .. })));
    }
}
