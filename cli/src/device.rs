//! The choice of a processor.

use super::{BackendName, DeviceArgs, Exit, say, say_json};
use seixo::backend::Backend;
use seixo::backend::cpu::Cpu;
use seixo::backend::gpu::{AdapterInfo, Gpu, adapters};
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

/// The backend that `args` ask for. A GPU that was asked for and is not there is an error, never replaced.
///
/// # Errors
/// No such adapter, or one that the scene does not fit.
pub fn backend(
    args: &DeviceArgs,
    scene: &Scene,
    params: &Params,
    plan: &Plan,
    settings: Settings,
) -> Result<Box<dyn Backend>> {
    let cpu = || Ok(Box::new(Cpu::new(scene, params, plan, settings)?) as Box<dyn Backend>);
    let gpu = |adapter: Option<&str>| {
        Ok(Box::new(Gpu::new(scene, params, plan, settings, adapter)?) as Box<dyn Backend>)
    };
    match (args.backend, args.adapter.as_deref()) {
        (BackendName::Cpu, Some(_)) => {
            Err(Error::Case("--adapter chooses a GPU; it does not go with --backend cpu".into()))
        }
        (BackendName::Cpu, None) => cpu(),
        (BackendName::Gpu, adapter) | (BackendName::Auto, adapter @ Some(_)) => gpu(adapter),
        // A dry scene has no particle stages: nothing that a GPU could do.
        (BackendName::Auto, None) if !plan.wet() => cpu(),
        (BackendName::Auto, None) => match adapters().iter().position(AdapterInfo::is_hardware) {
            Some(k) => gpu(Some(&k.to_string())),
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
            "no adapter was found: no driver, or on Linux no Vulkan loader (libvulkan1); --backend cpu needs neither"
        );
    }
    for (k, a) in adapters.iter().enumerate().filter(|_| !json) {
        let software = if a.is_hardware() { "" } else { ", not taken by --backend auto" };
        say(&format!("{k:>3}  {} ({}, {}, {}{software})", a.name, a.device_type, a.backend, a.driver));
    }
    Ok(0)
}
