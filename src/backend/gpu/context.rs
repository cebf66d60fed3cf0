//! A device with its buffers and pipelines: recording, submitting, moving data.

use super::adapter::AdapterInfo;
use super::clock::Clock;
use super::memory::{Allocation, Memory};
use super::parts::Buffers;
use super::shader::Shader;
use crate::backend::Commands;
use crate::compute::{Host, Id, Kernel};
use crate::error::{Error, GpuError, Result};
use crate::plan::Stage;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

/// Bytes that travel to the host at a time, at least and at most.
const STAGING: (u64, u64) = (64 << 10, 16 << 20);
/// Bytes that wait for the next submission at most.
const MAIL: u64 = 64 << 10;

struct Pipeline {
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
    /// Number, buffer and part of each binding.
    bound: Vec<(u32, Id, usize)>,
}

/// A device at work.
pub(super) struct Context {
    pub info: AdapterInfo,
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    buffers: HashMap<Id, Buffers>,
    pipelines: HashMap<Kernel, Pipeline>,
    /// Workgroups along one dimension of a dispatch at most.
    width: u64,
    pub(super) staging: wgpu::Buffer,
    /// Small uploads on their way, and the bytes of it that are in use.
    pub(super) mail: (wgpu::Buffer, u64),
    pub(super) encoder: Option<wgpu::CommandEncoder>,
    /// What the driver complained of, from a callback.
    fault: Arc<Mutex<Option<String>>>,
    pub clock: Option<Clock>,
    /// What the commands recorded now belong to.
    stage: Option<Stage>,
    pub commands: Commands,
    pub bytes: u64,
}

impl Context {
    /// Allocate `memory`, in buffers of no more than `most` bytes as far as it can be divided, and build the pipelines of `shaders`.
    pub fn new(
        (device, queue): (wgpu::Device, wgpu::Queue),
        info: AdapterInfo,
        memory: &Memory,
        most: u64,
        shaders: &[Shader],
    ) -> Result<Self> {
        let fault = Arc::new(Mutex::new(None));
        let note = |fault: &Arc<Mutex<Option<String>>>, what: String| {
            // The first complaint is the cause; a poisoned lock means that one is being reported.
            if let Ok(mut fault) = fault.lock() {
                fault.get_or_insert(what);
            }
        };
        let seen = fault.clone();
        device.on_uncaptured_error(Arc::new(move |e| note(&seen, e.to_string())));
        let seen = fault.clone();
        device.set_device_lost_callback(move |reason, what| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                note(&seen, format!("the device was lost: {what}"));
            }
        });

        let full = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let wrong = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let create = |label, size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as Usage;
        let buffers = memory.buffers.iter().map(|b| {
            let usage = match b.host {
                Host::None => Usage::STORAGE,
                Host::Writes => Usage::STORAGE | Usage::COPY_DST,
                Host::Reads => Usage::STORAGE | Usage::COPY_SRC,
                Host::Both => Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC,
                Host::Uniform => Usage::UNIFORM | Usage::COPY_DST,
            };
            let part = b.part(most);
            let parts = (0..b.bytes.div_ceil(part)).map(|k| part.min(b.bytes - k * part));
            (b.id, Buffers::new(part, parts.map(|bytes| create(b.id.name(), bytes, usage)).collect()))
        });
        let buffers: HashMap<_, _> = buffers.collect();
        let readable = |b: &&Allocation| matches!(b.host, Host::Reads | Host::Both);
        let largest = memory.buffers.iter().filter(readable).map(|b| b.part(most)).max().unwrap_or(16);
        let staging_bytes = largest.clamp(STAGING.0, STAGING.1);
        let staging = create("staging", staging_bytes, Usage::MAP_READ | Usage::COPY_DST);
        let mail = create("mail", MAIL, Usage::COPY_SRC | Usage::COPY_DST);
        let invalid = pollster::block_on(wrong.pop());
        if let Some(e) = pollster::block_on(full.pop()) {
            let text = format!(
                "{} has no {:.0} MB left for this scene ({e}); use a larger run.spacing or --backend cpu",
                info.name,
                memory.total() as f64 / 1e6
            );
            return Err(no_room(memory.total(), text));
        }
        if let Some(e) = invalid {
            return Err(Error::gpu(format!("buffers: {e}")));
        }

        let mut context = Self {
            bytes: memory.total() + staging_bytes + MAIL,
            info,
            clock: Clock::new(&device, &queue),
            width: device.limits().max_compute_workgroups_per_dimension.into(),
            device,
            queue,
            buffers,
            pipelines: HashMap::new(),
            staging,
            mail: (mail, 0),
            encoder: None,
            fault,
            stage: None,
            commands: Commands::default(),
        };
        for shader in shaders {
            context.compile(shader)?;
        }
        context.check()?;
        Ok(context)
    }

    fn compile(&mut self, shader: &Shader) -> Result<()> {
        let Shader { program, source, entries } = shader;
        let file = program.name;
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let descriptor = wgpu::ShaderModuleDescriptor {
            label: Some(file),
            source: wgpu::ShaderSource::Wgsl(source.as_str().into()),
        };
        let module = if self.info.is_hardware() {
            let mut checks = wgpu::ShaderRuntimeChecks::checked();
            checks.force_loop_bounding = false;
            // SAFETY: only the counter that would end an endless loop is left out; indices stay checked. Every
            // loop of our shaders runs over a range of numbers fixed before it starts: neighbours of a row (at
            // most its capacity), particles of a cell, cells around a cell, a stride over slots.
            unsafe { self.device.create_shader_module_trusted(descriptor, checks) }
        } else {
            // Software is there to find mistakes, not to be fast.
            self.device.create_shader_module(descriptor)
        };
        for entry in entries {
            let name = format!("{file}.{}", entry.name);
            let listed = program.kernels.iter().find(|k| k.entry == entry.name);
            let kernel = *listed.ok_or_else(|| Error::gpu(format!("{name} is in no list of kernels")))?;
            let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(&name),
                layout: None,
                module: &module,
                entry_point: Some(&entry.name),
                compilation_options: wgpu::PipelineCompilationOptions {
                    // No kernel reads workgroup memory that it has not written.
                    zero_initialize_workgroup_memory: false,
                    ..Default::default()
                },
                cache: None,
            });
            let find = |field: &str| {
                let found = self.buffers.keys().find(|id| id.name() == field).copied();
                found.ok_or_else(|| Error::gpu(format!("{name} binds {field}, which the plan leaves out")))
            };
            let bound = entry.bindings.iter().map(|b| Ok((b.number, find(&b.name)?, b.part)));
            let bound = bound.collect::<Result<Vec<_>>>()?;
            let group = self.group(&name, &pipeline, &bound)?;
            self.pipelines.insert(kernel, Pipeline { pipeline, group, bound });
        }
        match pollster::block_on(scope.pop()) {
            Some(e) => Err(Error::gpu(format!("shaders/{file}.wgsl on {}: {e}", self.info.name))),
            None => Ok(()),
        }
    }

    /// The buffers that a kernel binds.
    fn group(
        &self,
        name: &str,
        pipeline: &wgpu::ComputePipeline,
        bound: &[(u32, Id, usize)],
    ) -> Result<wgpu::BindGroup> {
        let mut entries = Vec::with_capacity(bound.len());
        for &(binding, id, part) in bound {
            let missing = || Error::gpu(format!("{} has no part {part}", id.name()));
            let buffer = self.buffers(id)?.parts.get(part).ok_or_else(missing)?;
            entries.push(wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() });
        }
        Ok(self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(name),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        }))
    }

    /// Make a buffer hold at least `bytes`; by half more than asked, so that it does not grow every time. What
    /// it held is lost if it grows. For buffers that are never divided.
    pub(crate) fn reserve(&mut self, id: Id, bytes: u64) -> Result<()> {
        let (old, name) = (self.buffers(id)?, id.name());
        let (have, usage) = (old.size(), old.parts[0].usage());
        if bytes <= have {
            return Ok(());
        }
        let limits = self.device.limits();
        let most = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size);
        if bytes > most {
            let text = format!(
                "{name} needs a buffer of {:.0} MB, but {} was asked for {:.0} MB at most; use contact.device = \
                 \"host\"",
                bytes as f64 / 1e6,
                self.info.name,
                most as f64 / 1e6
            );
            let limit = "max_storage_buffer_binding_size";
            return Err(GpuError::TooSmall { limit, needs: bytes, has: Some(most), text }.into());
        }
        // What is recorded still means the old one.
        self.submit();
        let size = (bytes + bytes / 2).next_multiple_of(16).min(most / 16 * 16);
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let create = |label, size, usage| {
            let descriptor =
                wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
            self.device.create_buffer(&descriptor)
        };
        let buffer = create(name, size, usage);
        let staging = self.staging.size();
        let wanted = size.min(STAGING.1);
        let larger = (usage.contains(wgpu::BufferUsages::COPY_SRC) && wanted > staging)
            .then(|| create("staging", wanted, self.staging.usage()));
        if let Some(e) = pollster::block_on(scope.pop()) {
            let text = format!(
                "{} has no {:.0} MB left for {name} ({e}); use contact.device = \"host\"",
                self.info.name,
                size as f64 / 1e6
            );
            return Err(no_room(size, text));
        }
        self.bytes += size - have;
        if let Some(larger) = larger {
            self.bytes += wanted - staging;
            self.staging = larger;
        }
        self.buffers.insert(id, Buffers::new(size, vec![buffer]));
        let users: Vec<Kernel> = self
            .pipelines
            .iter()
            .filter(|(_, p)| p.bound.iter().any(|(_, bound, _)| *bound == id))
            .map(|(kernel, _)| *kernel)
            .collect();
        for kernel in users {
            let of = &self.pipelines[&kernel];
            let group = self.group(kernel.entry, &of.pipeline, &of.bound)?;
            if let Some(of) = self.pipelines.get_mut(&kernel) {
                of.group = group;
            }
        }
        Ok(())
    }

    /// Bytes that the allocator has given out, where it tells.
    pub fn allocated(&self) -> Option<u64> {
        self.device.generate_allocator_report().map(|r| r.total_allocated_bytes)
    }

    /// Lose the device.
    #[cfg(test)]
    pub(crate) fn destroy(&self) {
        self.device.destroy();
    }

    /// An error if the driver has complained.
    pub fn check(&self) -> Result<()> {
        let fault = self.fault.lock().ok().and_then(|f| f.clone());
        fault.map_or(Ok(()), |what| Err(Error::gpu(format!("{}: {what}", self.info.name))))
    }

    pub(super) fn buffers(&self, id: Id) -> Result<&Buffers> {
        let missing = || Error::gpu(format!("there is no buffer {}: the plan leaves it out", id.name()));
        self.buffers.get(&id).ok_or_else(missing)
    }

    /// What is recorded from here on belongs to `stage`.
    pub fn begin(&mut self, stage: Option<Stage>) {
        if self.stage == stage {
            return;
        }
        self.stage = stage;
        if let (Some(clock), Some(encoder)) = (&mut self.clock, &mut self.encoder) {
            clock.mark(encoder, stage);
        }
    }

    pub(super) fn record(&mut self) -> &mut wgpu::CommandEncoder {
        let Self { encoder, device, clock, stage, .. } = self;
        encoder.get_or_insert_with(|| {
            let mut encoder = device.create_command_encoder(&Default::default());
            if let Some(clock) = clock {
                clock.mark(&mut encoder, *stage);
            }
            encoder
        })
    }

    /// Where `bytes` of a buffer from byte `first` on lie.
    pub(super) fn pieces(&self, id: Id, first: u64, bytes: u64) -> Result<Vec<(wgpu::Buffer, u64, u64)>> {
        let pieces = self.buffers(id)?.pieces(first, bytes);
        Ok(pieces.map(|(buffer, first, bytes)| (buffer.clone(), first, bytes)).collect())
    }

    /// Record a pass over kernels, each with its number of workgroups; more than the device starts along one dimension are folded
    /// into rows, the last of them full as well.
    pub fn pass(&mut self, kernels: impl IntoIterator<Item = (Kernel, u64)>) -> Result<()> {
        self.record();
        let Self { encoder: Some(encoder), pipelines, commands, stage, width, .. } = self else {
            return Ok(());
        };
        let width = *width;
        let mut pass = encoder.begin_compute_pass(&Default::default());
        for (kernel, groups) in kernels {
            let Kernel { file, entry, .. } = kernel;
            let missing = || Error::gpu(format!("there is no kernel {file}.{entry}: the plan leaves it out"));
            let Pipeline { pipeline, group, .. } = pipelines.get(&kernel).ok_or_else(missing)?;
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(groups.min(width) as u32, groups.div_ceil(width).max(1) as u32, 1);
            commands.add(*stage);
        }
        Ok(())
    }

    pub fn clear(&mut self, buffer: impl Into<Id>) -> Result<()> {
        for buffer in self.buffers(buffer.into())?.parts.clone() {
            self.record().clear_buffer(&buffer, 0, None);
        }
        Ok(())
    }

    /// Copy `bytes` from byte `first` of a buffer, perhaps a divided one, to the start of another.
    pub fn copy(&mut self, from: impl Into<Id>, first: u64, to: impl Into<Id>, bytes: u64) -> Result<()> {
        let target = self.buffers(to.into())?.parts[0].clone();
        let mut at = 0;
        for (source, first, bytes) in self.pieces(from.into(), first, bytes)? {
            self.record().copy_buffer_to_buffer(&source, first, &target, at, bytes);
            at += bytes;
        }
        Ok(())
    }
}

/// The device's memory is full.
fn no_room(needs: u64, text: String) -> Error {
    GpuError::TooSmall { limit: "memory", needs, has: None, text }.into()
}
