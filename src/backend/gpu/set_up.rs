//! A device and what never changes on it: buffers, pipelines, constants, solids.

use super::adapter::{self, AdapterInfo, Caps};
use super::context::Context;
use super::fitted::Fitted;
use super::layout::{self, Coefficients, Constants, WORKGROUP, WallParticle};
use super::memory::{Memory, Sizes};
use super::{Gpu, buffers, clock, solids};
use crate::backend::{self, Counters};
use crate::cells::Grid;
use crate::error::{Error, Result};
use crate::kernels::collision;
use crate::kernels::wall_excess::cut_share;
use crate::params::Params;
use crate::plan::{Arrays, Plan};
use crate::pressure::Settings;
use crate::scene::{Groups, Scene, Solid};
use crate::stop::Stop;
use glam::{DVec3, Vec3};

/// Numbers of things of `scene` on a device.
///
/// # Errors
/// A domain with more cells than can be numbered.
pub fn sizes(scene: &Scene, params: &Params, plan: &Plan) -> Result<Sizes> {
    Ok(Sizes::new(scene, params, &grid(params, plan)?, plan))
}

/// What `scene` takes on a device, without one.
///
/// # Errors
/// As [`sizes`].
pub fn memory(scene: &Scene, params: &Params, plan: &Plan) -> Result<Memory> {
    Ok(Memory::new(&sizes(scene, params, plan)?, plan))
}

pub(super) fn grid(params: &Params, plan: &Plan) -> Result<Grid> {
    if plan.wet() {
        return Grid::new(params);
    }
    Ok(Grid::nothing())
}

impl Gpu {
    /// Particles of `scene` on `adapter` (a number in [`super::adapters`] or a part of a name; the best one if
    /// `None`, which is a software one where there is no other).
    ///
    /// # Errors
    /// [`Error::Gpu`] if there is no such adapter or the scene does not fit it; nothing is allocated then.
    pub fn new(
        scene: &Scene,
        params: &Params,
        plan: &Plan,
        settings: Settings,
        adapter: Option<&str>,
    ) -> Result<Self> {
        Self::capped(scene, params, plan, settings, adapter, Caps::default())
    }

    /// [`Gpu::new`] on a device that is asked for no more than `caps`.
    #[doc(hidden)]
    pub fn capped(
        scene: &Scene,
        params: &Params,
        plan: &Plan,
        settings: Settings,
        adapter: Option<&str>,
        caps: Caps,
    ) -> Result<Self> {
        Self::open(scene, params, plan, settings, adapter::choose(adapter)?, caps, None)
    }

    /// Particles of `scene` on a device of `adapter`, for one of many ranks that have `all` particles together, or alone.
    pub(super) fn open(
        scene: &Scene,
        params: &Params,
        plan: &Plan,
        settings: Settings,
        (adapter, info): (wgpu::Adapter, AdapterInfo),
        caps: Caps,
        all: Option<Groups>,
    ) -> Result<Self> {
        let fitted = Fitted::new(scene, params, plan, &info, adapter.limits(), caps, all)?;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("seixo"),
            required_limits: fitted.limits.clone(),
            required_features: adapter.features() & clock::FEATURES,
            ..Default::default()
        };
        let device = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| Error::gpu(format!("{}: {e}", info.name)))?;
        Self::on(device, info, fitted, scene, params, plan, settings)
    }

    /// Build everything on a device that computes nothing: pipelines, bindings and limits are checked with
    /// no driver.
    pub fn dry_run(scene: &Scene, params: &Params, plan: &Plan, settings: Settings) -> Result<Self> {
        Self::dry_run_capped(scene, params, plan, settings, Caps::default())
    }

    /// [`Gpu::dry_run`] on a device that is asked for no more than `caps`.
    #[doc(hidden)]
    pub fn dry_run_capped(
        scene: &Scene,
        params: &Params,
        plan: &Plan,
        settings: Settings,
        caps: Caps,
    ) -> Result<Self> {
        let have = wgpu::Limits {
            max_storage_buffer_binding_size: 1 << 30,
            max_storage_buffers_per_shader_stage: 64,
            ..Default::default()
        };
        let text = |s: &str| s.to_owned();
        let info = AdapterInfo {
            name: text("noop"),
            backend: text("noop"),
            device_type: text("other"),
            driver: text(""),
        };
        let fitted = Fitted::new(scene, params, plan, &info, have, caps, None)?;
        let descriptor =
            wgpu::DeviceDescriptor { required_limits: fitted.limits.clone(), ..Default::default() };
        Self::on(wgpu::Device::noop(&descriptor), info, fitted, scene, params, plan, settings)
    }

    fn on(
        device: (wgpu::Device, wgpu::Queue),
        info: AdapterInfo,
        fitted: Fitted,
        scene: &Scene,
        params: &Params,
        plan: &Plan,
        settings: Settings,
    ) -> Result<Self> {
        let groups = scene.groups;
        let Fitted { grid, sizes, memory, division, shaders, levels, most, .. } = fitted;
        let layer = |s: &Solid| (s.wall_slots.start.saturating_sub(groups.fluid), s.wall_slots.len());
        let wall_layers = scene.solids.iter().map(layer);
        let mut gpu = Self {
            context: Context::new(device, info, &memory, most, &shaders)?,
            division,
            params: params.clone(),
            plan: plan.clone(),
            settings,
            groups,
            grid,
            sizes,
            middle: layout::middle(params),
            chunk_solid: Vec::new(),
            solids: scene.solids.len(),
            posed: false,
            wall_layers: wall_layers.collect(),
            slot_rows: solids::SlotRows::new(),
            coupled: Vec::new(),
            counters: Counters::new(backend::outflows(scene)),
            coefficients: Coefficients::default(),
            outlets: Vec::new(),
            dt: 0.0,
            expected_iterations: if levels.is_some() { 5.0 } else { 30.0 },
            levels,
            stop: Stop::default(),
        };
        if plan.wet() {
            let constants = Constants::new(params, &groups, &gpu.grid, &gpu.settings, &gpu.sizes);
            gpu.context.upload(buffers::params, &[constants])?;
            if let Some(levels) = &gpu.levels {
                gpu.context.upload(buffers::hierarchy, &[levels.hierarchy()])?;
            }
            gpu.write_fields(&backend::start(scene, plan))?;
            gpu.write_solids(scene)?;
            if plan.needs(Arrays::Absorber) {
                let zone = |z: &crate::params::Zone| layout::AbsorberZone::new(z, gpu.middle);
                let zones: Vec<_> = params.absorbers.iter().map(zone).collect();
                gpu.context.upload(buffers::absorber_zone, &zones)?;
            }
        }
        Ok(gpu)
    }

    /// What never changes about moving solids.
    fn write_solids(&mut self, scene: &Scene) -> Result<()> {
        let four = |v: DVec3, w: f32| {
            let Vec3 { x, y, z } = v.as_vec3();
            [x, y, z, w]
        };
        let g = self.groups;
        if self.plan.needs(Arrays::Solids) {
            let mut offset = vec![[0.0; 4]; g.moving_wall + g.moving_dummy];
            for (k, solid) in scene.solids.iter().enumerate() {
                let first_dummy = g.moving_dummy_range().start;
                let walls = solid.wall_slots.clone().map(|s| s - g.fluid).zip(&solid.wall_offset);
                let dummies = solid.dummy_slots.clone().map(|s| s - first_dummy + g.moving_wall);
                for (p, &o) in walls.chain(dummies.zip(&solid.dummy_offset)) {
                    offset[p] = four(o, k as f32);
                }
            }
            self.context.upload(buffers::solid_offset, &offset)?;
            let facing: Vec<f32> = scene.facing().into_iter().map(layout::direction_word).collect();
            self.context.upload(buffers::facing, &facing)?;
        }
        if self.plan.needs(Arrays::Turning) {
            let ways = scene.solids.iter().flat_map(|solid| &solid.wall_to_surface);
            let ways: Vec<[f32; 4]> = ways.map(|&way| four(way, 0.0)).collect();
            self.context.upload(buffers::to_surface, &ways)?;
        }
        if self.plan.needs(Arrays::Force) {
            let mut layer = vec![WallParticle::default(); g.moving_wall];
            let mut chunks: Vec<[u32; 4]> = Vec::new();
            for (k, solid) in scene.solids.iter().enumerate() {
                let first = solid.wall_slots.start - g.fluid;
                let felt = cut_share(solid, &self.params);
                let lightness = collision::lightness(solid, &self.params);
                for p in 0..solid.wall_slots.len() {
                    let to_surface = solid.wall_to_surface[p];
                    let mut faces = WallParticle::default().faces;
                    for (of, face) in faces.iter_mut().zip(solid.faces(p)) {
                        *of = [four(face.area, 0.0), four(face.way, 0.0)];
                    }
                    layer[first + p] = WallParticle {
                        area: four(solid.wall_area[p], lightness as f32),
                        arm: four(solid.wall_offset[p] + to_surface, 0.0),
                        to_surface: four(to_surface, felt as f32),
                        faces,
                    };
                }
                for p in (0..solid.wall_slots.len()).step_by(WORKGROUP as usize) {
                    let count = (solid.wall_slots.len() - p).min(WORKGROUP as usize);
                    chunks.push([(first + p) as u32, count as u32, k as u32, 0]);
                }
            }
            self.chunk_solid = chunks.iter().map(|c| c[2] as usize).collect();
            self.context.upload(buffers::wall_layer, &layer)?;
            self.context.upload(buffers::force_chunk, &chunks)?;
        }
        Ok(())
    }
}
