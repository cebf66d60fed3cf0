//! The choice of a processor.

use super::{BackendName, DeviceArgs, Exit};
use seixo::backend::gpu::adapters;
use seixo::console::{remark, say_json, tell};
use seixo::{Error, Processor, Result};

/// The processor that `args` ask for.
///
/// # Errors
/// An adapter together with the CPU.
pub fn processor(args: &DeviceArgs) -> Result<Processor> {
    match (args.backend, args.adapter.clone()) {
        (BackendName::Cpu, Some(_)) => {
            Err(Error::usage("--adapter", "--adapter chooses a GPU; it does not go with --backend cpu"))
        }
        (BackendName::Cpu, None) => Ok(Processor::Cpu),
        (BackendName::Gpu, adapter) | (BackendName::Auto, adapter @ Some(_)) => {
            Ok(Processor::Gpu { adapter })
        }
        (BackendName::Auto, None) => Ok(Processor::Auto),
    }
}

/// The processor that `args` ask for on each of many ranks: a CPU unless a GPU is asked for.
///
/// # Errors
/// As [`processor`].
pub fn of_ranks(args: &DeviceArgs) -> Result<Processor> {
    Ok(match processor(args)? {
        Processor::Auto => Processor::Cpu,
        asked => asked,
    })
}

/// `seixo adapters`.
pub fn list(json: bool) -> Exit {
    let adapters = adapters();
    if json {
        say_json(&adapters);
    } else if adapters.is_empty() {
        remark(
            "no adapter was found: no driver, or on Linux no Vulkan loader (libvulkan1); --backend cpu needs neither",
        );
    }
    for (k, a) in adapters.iter().enumerate().filter(|_| !json) {
        let software = if a.is_hardware() { "" } else { ", not taken by --backend auto" };
        tell(&format!("{k:>3}  {} ({}, {}, {}{software})", a.name, a.device_type, a.backend, a.driver));
    }
    Ok(0)
}
