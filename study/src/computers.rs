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
use std::time::Duration;

/// The processors of this machine.
pub struct Computers {
    gpu: backend::Processor,
    named: bool,
    hardware: OnceLock<bool>,
}

/// What can be typed of the computers.
#[derive(Clone, Debug, clap::Args)]
pub struct ComputerArgs {
    /// Where points compute that do not say: cpu or gpu.
    #[arg(long, value_name = "cpu|gpu", default_value = "cpu", value_parser = processor)]
    pub backend: Processor,
    /// Adapter of the GPU's points, a number or a part of a name as `seixo adapters` lists them. Without it a
    /// hardware GPU is taken, and no software one.
    #[arg(long, value_name = "N", value_parser = clap::builder::NonEmptyStringValueParser::new())]
    pub adapter: Option<String>,
    /// Threads of the CPU's points; all cores if absent.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=seixo::threads::MOST))]
    pub threads: Option<u16>,
    /// Wall-clock time between the states that a point keeps of its run, so that it goes on there after a kill [s].
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = seconds)]
    pub save_every: Duration,
}

impl ComputerArgs {
    /// The computers, with as many threads as asked for.
    ///
    /// # Errors
    /// Where the threads cannot be had.
    pub fn start(&self) -> Result<Computers> {
        seixo::threads::start(self.threads)?;
        Ok(Computers::new(self.adapter.clone()))
    }
}

/// What `--save-every` takes.
fn seconds(text: &str) -> std::result::Result<Duration, String> {
    let number = text.trim().parse::<f64>().ok();
    let time = number.and_then(|s| Duration::try_from_secs_f64(s).ok());
    time.ok_or_else(|| "write a number of seconds".to_owned())
}

/// What `--backend` takes.
fn processor(text: &str) -> std::result::Result<Processor, String> {
    match text {
        "cpu" => Ok(Processor::Cpu),
        "gpu" => Ok(Processor::Gpu),
        _ => Err("expected cpu or gpu".into()),
    }
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
