//! Adapters: what the machine has, which one a run takes, what is asked of it.

use super::forecast::BINDING_MAX;
use super::memory::Memory;
use crate::error::{GpuError, Result};
use serde::Serialize;

/// A device that wgpu can drive.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct AdapterInfo {
    /// Name, as the driver gives it.
    pub name: String,
    /// Programming interface: `vulkan`, `metal` or `dx12`.
    pub backend: String,
    /// `discrete`, `integrated`, `virtual`, `cpu` (software) or `other`.
    pub device_type: String,
    /// Driver and its version.
    pub driver: String,
}

impl AdapterInfo {
    fn new(info: &wgpu::AdapterInfo) -> Self {
        let device_type = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete",
            wgpu::DeviceType::IntegratedGpu => "integrated",
            wgpu::DeviceType::VirtualGpu => "virtual",
            wgpu::DeviceType::Cpu => "cpu",
            wgpu::DeviceType::Other => "other",
        };
        Self {
            name: info.name.clone(),
            backend: info.backend.to_str().to_owned(),
            device_type: device_type.to_owned(),
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        }
    }

    /// `true` for a GPU, one lent to a virtual machine as well, `false` for software that acts as one: that is slower than the CPU backend.
    pub fn is_hardware(&self) -> bool {
        matches!(self.device_type.as_str(), "discrete" | "integrated" | "virtual")
    }

    /// Place in the order in which adapters are offered: discrete GPUs first, software last.
    fn rank(&self) -> u8 {
        ["discrete", "integrated", "virtual", "other"]
            .iter()
            .position(|&t| t == self.device_type)
            .map_or(4, |k| k as u8)
    }
}

/// What to do where there is no adapter.
const NO_ADAPTER: &str = "no GPU adapter found: no driver, or on Linux no Vulkan loader (libvulkan1 and the GPU's \
                          driver, or mesa-vulkan-drivers for a software one); --backend cpu needs neither";

fn enumerate() -> Vec<(wgpu::Adapter, AdapterInfo)> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    // Validation layers are for work on the backend and need an installation of their own.
    descriptor.flags = wgpu::InstanceFlags::empty();
    let backends = descriptor.backends;
    let instance = wgpu::Instance::new(descriptor);
    let mut found: Vec<_> = pollster::block_on(instance.enumerate_adapters(backends))
        .into_iter()
        .map(|a| {
            let info = AdapterInfo::new(&a.get_info());
            (a, info)
        })
        .collect();
    found.sort_by_key(|(_, info)| info.rank());
    found
}

/// The machine's adapters, the one taken by default first. Empty without a driver or loader.
pub fn adapters() -> Vec<AdapterInfo> {
    enumerate().into_iter().map(|(_, info)| info).collect()
}

/// Numbers of the adapters that `asked` names among those that are `found`: a number in [`adapters`], or all with this part of a name.
fn named(asked: &str, found: &[AdapterInfo]) -> Result<Vec<usize>> {
    if let Some(number) = asked.parse().ok().filter(|&k: &usize| k < found.len()) {
        return Ok(vec![number]);
    }
    let part = asked.to_lowercase();
    let named = |(_, info): &(usize, &AdapterInfo)| info.name.to_lowercase().contains(&part);
    let numbers: Vec<usize> = found.iter().enumerate().filter(named).map(|(k, _)| k).collect();
    if numbers.is_empty() {
        let names: Vec<_> = found.iter().enumerate().map(|(k, i)| format!("{k}: {}", i.name)).collect();
        let text = format!("no adapter is called \"{asked}\"; there is {}", names.join(", "));
        return Err(GpuError::NoAdapter(text).into());
    }
    Ok(numbers)
}

/// Number of the adapter of the `k`-th rank on a machine where these are `found`: of those `asked` for the k-th, of all hardware if none is asked
/// for; beyond their number from the first on again. Where there is software only, all ranks share it.
fn of_rank(k: usize, asked: Option<&str>, found: &[AdapterInfo]) -> Result<usize> {
    let numbers = match asked {
        Some(asked) => named(asked, found)?,
        None => (0..found.len()).filter(|&k| found[k].is_hardware()).collect(),
    };
    // A device that is there by two programming interfaces is one.
    let first = numbers.first().copied().unwrap_or(0);
    let devices: Vec<usize> =
        numbers.into_iter().filter(|&k| found[k].backend == found[first].backend).collect();
    Ok(if devices.is_empty() { first } else { devices[k % devices.len()] })
}

/// The adapter that `asked` names: a number in [`adapters`] or a part of a name; the first one if `None`.
pub(super) fn choose(asked: Option<&str>) -> Result<(wgpu::Adapter, AdapterInfo)> {
    taken(|infos| asked.map_or(Ok(0), |asked| named(asked, infos).map(|numbers| numbers[0])))
}

/// The adapter of the `k`-th rank on this machine, see [`of_rank`].
pub(super) fn choose_of_rank(k: usize, asked: Option<&str>) -> Result<(wgpu::Adapter, AdapterInfo)> {
    taken(|infos| of_rank(k, asked, infos))
}

/// The adapter of the number that `choice` makes among all of them, one at least.
fn taken(choice: impl FnOnce(&[AdapterInfo]) -> Result<usize>) -> Result<(wgpu::Adapter, AdapterInfo)> {
    let mut found = enumerate();
    if found.is_empty() {
        return Err(GpuError::NoAdapter(NO_ADAPTER.into()).into());
    }
    let infos: Vec<AdapterInfo> = found.iter().map(|(_, info)| info.clone()).collect();
    Ok(found.swap_remove(choice(&infos)?))
}

fn megabytes(bytes: u64) -> String {
    format!("{:.0} MB", bytes as f64 / 1e6)
}

/// Limits below those of a device, to try on small scenes what large ones need.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Caps {
    /// Bytes that a shader binds, and that a buffer has, at most.
    pub binding: Option<u64>,
    /// Workgroups along one dimension of a dispatch at most.
    pub workgroups: Option<u32>,
    /// So many of the finest levels of multigrid have dispatches of their own, as far as there are levels, instead of those with many rows.
    pub large_levels: Option<usize>,
}

impl Caps {
    /// `have`, no higher than these.
    pub(super) fn lower(&self, have: wgpu::Limits) -> wgpu::Limits {
        let binding = self.binding.unwrap_or(u64::MAX);
        let workgroups = self.workgroups.unwrap_or(u32::MAX);
        wgpu::Limits {
            max_storage_buffer_binding_size: have.max_storage_buffer_binding_size.min(binding),
            max_buffer_size: have.max_buffer_size.min(binding),
            max_compute_workgroups_per_dimension: have.max_compute_workgroups_per_dimension.min(workgroups),
            ..have
        }
    }
}

/// Bytes of a buffer at most on a device with limits `have`: what is larger is made as several. Metal names more than the 32 bits
/// in which a shader is told how long its arrays are.
pub(super) fn buffer_most(have: &wgpu::Limits) -> u64 {
    have.max_storage_buffer_binding_size.min(have.max_buffer_size).min(BINDING_MAX)
}

/// Workgroups along one dimension of a dispatch at most that are asked of a device with limits `have`.
pub(super) fn width(have: &wgpu::Limits) -> u32 {
    let usual = wgpu::Limits::default().max_compute_workgroups_per_dimension;
    usual.min(have.max_compute_workgroups_per_dimension)
}

/// Limits to ask of an adapter with limits `have` for kernels of up to `bindings` storage buffers, or what it lacks. Nothing is
/// allocated before this. Where something `grows`, the buffers of contact with what touches, it is all that there is.
pub(super) fn limits(
    memory: &Memory,
    grows: bool,
    bindings: u32,
    have: &wgpu::Limits,
    name: &str,
) -> Result<wgpu::Limits> {
    let mut ask = wgpu::Limits::default();
    let most = buffer_most(have);
    let parts = memory.buffers.iter().map(|b| (b.id.name(), b.part(most)));
    let (largest, bytes) = parts.max_by_key(|(_, bytes)| *bytes).unwrap_or(("nothing", 0));
    for (what, limit, available) in [
        (
            "max_storage_buffer_binding_size",
            &mut ask.max_storage_buffer_binding_size,
            have.max_storage_buffer_binding_size,
        ),
        ("max_buffer_size", &mut ask.max_buffer_size, have.max_buffer_size),
    ] {
        if bytes > available {
            let text = format!(
                "{largest} needs a buffer of {}, but {name} allows {} ({what}); use a larger run.spacing, another \
                 adapter or --backend cpu",
                megabytes(bytes),
                megabytes(available)
            );
            return Err(GpuError::TooSmall { limit: what, needs: bytes, has: Some(available), text }.into());
        }
        *limit = (*limit).max(if grows { most } else { bytes }).min(available);
    }
    let groups = u64::from(width(have));
    if memory.strided > groups {
        let (limit, needs) = ("max_compute_workgroups_per_dimension", memory.strided);
        let text = format!(
            "a kernel needs {needs} workgroups, but {name} allows {groups} ({limit}); use a larger run.spacing, \
             another adapter or --backend cpu"
        );
        return Err(GpuError::TooSmall { limit, needs, has: Some(groups), text }.into());
    }
    ask.max_compute_workgroups_per_dimension = width(have);
    let available = have.max_storage_buffers_per_shader_stage;
    if bindings > available {
        let limit = "max_storage_buffers_per_shader_stage";
        let text = format!(
            "a kernel needs {bindings} storage buffers, among them the parts of those that are too large for one, but \
             {name} allows {available} ({limit}); use a larger run.spacing, a smaller run.domain, another adapter or \
             --backend cpu"
        );
        let (needs, has) = (bindings.into(), Some(available.into()));
        return Err(GpuError::TooSmall { limit, needs, has, text }.into());
    }
    ask.max_storage_buffers_per_shader_stage =
        ask.max_storage_buffers_per_shader_stage.max(bindings).min(available);
    Ok(ask)
}

#[cfg(test)]
mod tests {
    use super::super::buffers;
    use super::super::memory::Allocation;
    use super::*;
    use crate::backend::gpu::parts::Grain;
    use crate::compute::Host;
    use crate::error::Error;

    fn memory(bytes: u64, strided: u64) -> Memory {
        let id = buffers::position.id();
        let one = Allocation { id, bytes, host: Host::None, purpose: "particles", grain: Grain::Whole };
        Memory { buffers: vec![one], workgroups: strided, strided }
    }

    #[test]
    fn what_an_adapter_lacks_is_named() {
        let have = wgpu::Limits::default();
        let refusal = |m: &Memory| limits(m, false, 8, &have, "small").expect_err("too large");
        let text = |m: &Memory| refusal(m).to_string();
        match refusal(&memory(300 << 20, 1)) {
            Error::Gpu(GpuError::TooSmall { limit, needs, has, .. }) => {
                assert_eq!((limit, needs), ("max_storage_buffer_binding_size", 300 << 20));
                assert_eq!(has, Some(have.max_storage_buffer_binding_size));
            }
            other => panic!("{other:?}"),
        }
        let large = text(&memory(300 << 20, 1));
        for part in ["position", "315 MB", "134 MB", "max_storage_buffer_binding_size", "--backend cpu"] {
            assert!(large.contains(part), "{large}");
        }
        let many = text(&memory(1 << 20, 70_000));
        assert!(many.contains("70000 workgroups") && many.contains("65535"), "{many}");
        let bound = limits(&memory(1 << 20, 1), false, 9, &have, "small").expect_err("too many").to_string();
        for part in
            ["9 storage buffers", "small allows 8", "max_storage_buffers_per_shader_stage", "run.spacing"]
        {
            assert!(bound.contains(part), "{bound}");
        }
        let low =
            Caps { binding: Some(1 << 20), workgroups: Some(100), ..Caps::default() }.lower(have.clone());
        let asked = limits(&memory(1 << 20, 100), false, 8, &low, "small").expect("fits");
        assert_eq!((asked.max_storage_buffer_binding_size, asked.max_buffer_size), (1 << 20, 1 << 20));
        assert_eq!(asked.max_compute_workgroups_per_dimension, 100);
    }

    #[test]
    fn limits_are_raised_no_further_than_needed() {
        let have = wgpu::Limits {
            max_storage_buffer_binding_size: 1 << 30,
            max_buffer_size: 1 << 31,
            ..Default::default()
        };
        let asked = limits(&memory(300 << 20, 1), false, 8, &have, "large").expect("fits");
        assert_eq!((asked.max_storage_buffer_binding_size, asked.max_buffer_size), (300 << 20, 300 << 20));
        let asked = limits(&memory(1 << 20, 1), true, 8, &have, "large").expect("fits");
        assert_eq!(asked.max_storage_buffer_binding_size, 1 << 30);
        let asked = limits(&memory(1 << 20, 1), false, 8, &have, "large").expect("fits");
        let usual = wgpu::Limits::default();
        assert_eq!(asked.max_storage_buffer_binding_size, usual.max_storage_buffer_binding_size);
    }

    #[test]
    fn each_rank_of_a_machine_takes_a_device_of_its_own() {
        let info = |name: &str, backend: &str, t: &str| AdapterInfo {
            name: name.into(),
            backend: backend.into(),
            device_type: t.into(),
            driver: String::new(),
        };
        let node = [
            info("NVIDIA H100", "vulkan", "discrete"),
            info("NVIDIA H100", "vulkan", "discrete"),
            info("Radeon", "vulkan", "integrated"),
            info("NVIDIA H100", "dx12", "discrete"),
            info("llvmpipe", "vulkan", "cpu"),
        ];
        let all = |asked: Option<&str>| [0, 1, 2, 3].map(|k| of_rank(k, asked, &node).expect("there is one"));
        assert_eq!(all(None), [0, 1, 2, 0]);
        assert_eq!(all(Some("h100")), [0, 1, 0, 1]);
        assert_eq!(all(Some("llvm")), [4; 4]);
        assert_eq!(all(Some("2")), [2; 4]);
        assert_eq!([0, 1, 2].map(|k| of_rank(k, None, &node[4..]).expect("software")), [0; 3]);
        assert!(of_rank(0, Some("none"), &node).is_err_and(|e| e.to_string().contains("2: Radeon")));
    }

    #[test]
    fn hardware_comes_first() {
        let info = |t: &str| AdapterInfo {
            name: String::new(),
            backend: String::new(),
            device_type: t.into(),
            driver: String::new(),
        };
        let ranks = ["discrete", "integrated", "virtual", "other", "cpu"].map(|t| info(t).rank());
        assert!(ranks.is_sorted());
        assert!(
            info("discrete").is_hardware() && info("virtual").is_hardware() && !info("cpu").is_hardware()
        );
    }
}
