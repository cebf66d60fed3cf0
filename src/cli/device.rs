//! The choice of a processor.

use super::{BackendName, DeviceArgs, Exit, say, say_json};
use seixo::backend::Backend;
use seixo::backend::cpu::Cpu;
use seixo::error::{Error, Result};
use seixo::params::Params;
use seixo::plan::Plan;
use seixo::pressure::Settings;
use seixo::scene::Scene;

/// Use this many threads from now on.
pub fn set_threads(args: &DeviceArgs) {
    if let Some(threads) = args.threads {
        // Fails only if the pool exists already, and nothing parallel has run yet.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
    }
}

/// An adapter, for the list.
#[derive(serde::Serialize)]
struct Adapter {
    index: usize,
    name: String,
    kind: String,
    hardware: bool,
}

fn adapters() -> Vec<Adapter> {
    Vec::new()
}

fn gpu(
    _adapter: Option<usize>,
    _scene: &Scene,
    _params: &Params,
    _plan: &Plan,
    _settings: Settings,
) -> Result<Box<dyn Backend>> {
    Err(Error::Gpu("no GPU adapter was found; use --backend cpu, or see `seixo adapters`".into()))
}

/// The backend that `args` ask for. A GPU that was asked for and is not there is an error, never replaced.
pub fn backend(
    args: &DeviceArgs,
    scene: &Scene,
    params: &Params,
    plan: &Plan,
    settings: Settings,
) -> Result<Box<dyn Backend>> {
    let cpu = || Ok(Box::new(Cpu::new(scene, params, plan, settings)?) as Box<dyn Backend>);
    match (args.backend, args.adapter) {
        (BackendName::Cpu, Some(_)) => {
            Err(Error::Case("--adapter chooses a GPU; it does not go with --backend cpu".into()))
        }
        (BackendName::Cpu, None) => cpu(),
        (BackendName::Gpu, _) | (BackendName::Auto, Some(_)) => {
            gpu(args.adapter, scene, params, plan, settings)
        }
        // A dry scene has no particle stages: nothing that a GPU could do.
        (BackendName::Auto, None) if !plan.wet() => cpu(),
        (BackendName::Auto, None) => match adapters().iter().find(|a| a.hardware) {
            Some(a) => gpu(Some(a.index), scene, params, plan, settings),
            None => cpu(),
        },
    }
}

/// `seixo adapters`.
pub fn list(json: bool) -> Exit {
    let adapters = adapters();
    if json {
        say_json(&adapters);
    } else if adapters.is_empty() {
        eprintln!(
            "no adapter was found (is a Vulkan loader with a driver installed?); --backend cpu works without"
        );
    }
    for a in adapters.iter().filter(|_| !json) {
        let software = if a.hardware { "" } else { ", software" };
        say(&format!("{:>3}  {} ({}{software})", a.index, a.name, a.kind));
    }
    Ok(0)
}
