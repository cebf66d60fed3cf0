//! The GPU backend: the kernels of `shaders/` in f32 on any device that wgpu drives.
//!
//! No particle data crosses to the host in a step but the state of the pressure solver and the force on
//! bodies; of contact, if the plan has it here, the pairs' sums. Work is recorded and handed to the device only when
//! the host needs an answer. Only what the plan names is compiled and allocated. Nothing outside this module names
//! wgpu.

mod access;
mod adapter;
mod archive;
mod bandwidth;
pub mod buffers;
mod clock;
mod context;
mod exchange;
mod fitted;
pub mod forecast;
pub mod hierarchy;
pub mod layout;
mod ledger;
pub mod parts;
pub mod shader;
mod solve;
mod stretches;
mod traffic;
mod transfer;

pub use adapter::{AdapterInfo, Caps, adapters};
pub use bandwidth::bandwidth;

use super::traffic::Traffic;
use super::{Backend, Commands, Counters, RowPressure, Timing};
use crate::body::slots::SlotRow;
use crate::body::{FreeBody, Pose, Wrench};
use crate::cells::Grid;
use crate::compute::{Compute, Id, Kernel};
use crate::error::{Error, Result};
use crate::fields::Fields;
use crate::kernels::collision;
pub use crate::kernels::device as kernels;
use crate::kernels::device::Over;
use crate::kernels::monitor::{speed_most, speed_range};
use crate::kernels::openings::{Emission, Outlet};
use crate::kernels::wall_excess::cut_share;
use crate::ledger::Ledger;
use crate::monitor::{FluidMonitor, SPEED_BINS};
use crate::params::{Params, Step};
use crate::plan::{Arrays, ParticleStage, Plan, Stage};
use crate::pressure::{PressureReport, Settings};
use crate::scene::{Groups, Scene, Solid};
use crate::stop::Stop;
use context::Context;
use fitted::Fitted;
use glam::{DMat3, DVec3, Vec3};
use hierarchy::Levels;
use layout::{
    Coefficients, Constants, Memory, MonitorSum, SCAN_BLOCK, SCAN_GROUPS_MAX, Sizes, WORKGROUP, WallParticle,
    counter,
};
use parts::Division;
use std::collections::BTreeMap;
use stretches::Stretches;

/// Particles in f32 on a device.
pub struct Gpu {
    context: Context,
    division: Division,
    params: Params,
    plan: Plan,
    settings: Settings,
    groups: Groups,
    grid: Grid,
    sizes: Sizes,
    middle: DVec3,
    /// Solid of each chunk of wall-layer particles.
    chunk_solid: Vec<usize>,
    solids: usize,
    /// First of the moving-wall slots and number of each solid's wall layer.
    wall_layers: Vec<(usize, usize)>,
    /// The device has rows at slots between solids.
    slots_shown: bool,
    /// Free bodies in the next solve.
    coupled: u64,
    counters: Counters,
    coefficients: Coefficients,
    /// What swallows on the device.
    outlets: Vec<layout::Outlet>,
    dt: f64,
    expected_iterations: f64,
    /// Levels of the multigrid preconditioner, if that is planned.
    levels: Option<Levels>,
    stop: Stop,
}

/// Numbers of things of `scene` on a device.
///
/// # Errors
/// A domain with more cells than can be numbered.
pub fn sizes(scene: &Scene, params: &Params, plan: &Plan) -> Result<Sizes> {
    Ok(Sizes::new(scene, params, &grid(params, plan)?))
}

/// What `scene` takes on a device, without one.
///
/// # Errors
/// As [`sizes`].
pub fn memory(scene: &Scene, params: &Params, plan: &Plan) -> Result<Memory> {
    Ok(Memory::new(&sizes(scene, params, plan)?, plan))
}

fn grid(params: &Params, plan: &Plan) -> Result<Grid> {
    if plan.wet() {
        return Grid::new(params);
    }
    Ok(Grid::nothing())
}

impl Gpu {
    /// `true` if the machine has a GPU, as opposed to software that acts as one.
    pub fn hardware_available() -> bool {
        adapters().iter().any(AdapterInfo::is_hardware)
    }

    /// Particles of `scene` on `adapter` (a number in [`adapters`] or a part of a name; the best one if
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
        let (adapter, info) = adapter::choose(adapter)?;
        let fitted = Fitted::new(scene, params, plan, &info, &caps.lower(adapter.limits()))?;
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
        let fitted = Fitted::new(scene, params, plan, &info, &caps.lower(have))?;
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
        let Fitted { grid, sizes, memory, division, shaders, most, .. } = fitted;
        let layer = |s: &Solid| (s.wall_slots.start.saturating_sub(groups.fluid), s.wall_slots.len());
        let wall_layers = scene.solids.iter().map(layer);
        let levels = plan.needs(Arrays::Multigrid).then(|| Levels::new(&sizes));
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
            wall_layers: wall_layers.collect(),
            slots_shown: false,
            coupled: 0,
            counters: Counters::new(super::outflows(scene)),
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
            gpu.write_fields(&super::start(scene, plan))?;
            gpu.write_solids(scene)?;
            if plan.needs(Arrays::Absorber) {
                let zone = |z: &crate::params::Zone| layout::AbsorberZone::new(z, gpu.middle);
                let zones: Vec<_> = params.absorbers.iter().map(zone).collect();
                gpu.context.upload(buffers::absorber_zone, &zones)?;
            }
        }
        Ok(gpu)
    }

    /// Where each key of the counting sort begins, as the last sort left it.
    pub fn key_starts(&mut self) -> Result<Vec<u32>> {
        self.context.download(buffers::cell_start, self.sizes.keys() as usize + 1)
    }

    /// How buffers and dispatches are divided on the device.
    pub fn division(&self) -> &Division {
        &self.division
    }

    /// Bytes that the driver's allocator has given out for this device, where it tells.
    pub fn allocated(&self) -> Option<u64> {
        self.context.allocated()
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
                    layer[first + p] = WallParticle {
                        area: four(solid.wall_area[p], lightness as f32),
                        arm: four(solid.wall_offset[p] + to_surface, 0.0),
                        to_surface: four(to_surface, felt as f32),
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

    fn set_step(&mut self, step: &Step) -> Result<()> {
        self.dt = step.dt;
        let coefficients = Coefficients::new(&self.params, step);
        if coefficients != self.coefficients {
            self.coefficients = coefficients;
            self.context.upload(buffers::now, &[coefficients])?;
        }
        Ok(())
    }

    /// Wall-layer particles that keep what viscosity, friction and collisions do to them.
    fn felt(&self) -> u64 {
        if self.plan.needs(Arrays::Reaction) { self.sizes.moving_wall } else { 0 }
    }

    fn cell_list(&mut self) -> Result<()> {
        let Sizes { fluid, moving, .. } = self.sizes;
        let particles = groups(fluid + moving);
        let blocks = self.sizes.keys().div_ceil(SCAN_BLOCK).min(SCAN_GROUPS_MAX);
        self.context.clear(buffers::cell_count)?;
        self.context.pass([
            (kernels::cell_list::count, particles),
            (kernels::cell_list::scan_blocks, blocks),
            (kernels::cell_list::scan_sums, 1),
            (kernels::cell_list::scan_add, blocks),
            (kernels::cell_list::scatter, particles),
            (kernels::cell_list::place, particles),
        ])?;
        let (vectors, numbers) = (buffers::position.size() * fluid, buffers::pressure.size() * fluid);
        self.context.copy(buffers::sorted, 0, buffers::position, vectors)?;
        self.context.copy(buffers::sorted, vectors, buffers::velocity, vectors)?;
        self.context.copy(buffers::sorted, 2 * vectors, buffers::pressure, numbers)
    }

    /// Take in the counters that were read; the device counts from zero again, so that 32 bits last for any run.
    fn take_counters(&mut self, seen: &[u32]) -> Result<Counters> {
        let c = &mut self.counters;
        c.lost += u64::from(seen[counter::LOST]);
        c.displacement_clamps += u64::from(seen[counter::DISPLACEMENT_CLAMPS]);
        c.pressure_clamps += u64::from(seen[counter::PRESSURE_CLAMPS]);
        c.negative_pressures += u64::from(seen[counter::NEGATIVE_PRESSURES]);
        c.neighbours_max = c.neighbours_max.max(seen[counter::NEIGHBOURS_MAX]);
        let first = |k: usize| Some(seen[k]).filter(|&n| n != u32::MAX);
        for (total, &count) in c.swallowed.iter_mut().zip(&seen[counter::SWALLOWED..]) {
            *total += u64::from(count);
        }
        c.non_finite = c.non_finite.or(first(counter::NON_FINITE));
        c.overflow = c.overflow.or(first(counter::OVERFLOW).map(|slot| (slot, c.neighbours_max)));
        let out = c.clone();
        let sums = [0..counter::NEIGHBOURS_MAX, counter::SWALLOWED..counter::WORDS];
        if sums.iter().flat_map(|s| &seen[s.clone()]).any(|&n| n > 0) {
            let mut reset = seen.to_vec();
            sums.into_iter().for_each(|s| reset[s].fill(0));
            self.context.upload(buffers::counters, &reset)?;
        }
        Ok(out)
    }

    /// The workgroups' sums and the histogram, put together in f64.
    fn finish_monitor(&self, sums: &[MonitorSum], bins: &[u32]) -> FluidMonitor {
        let vector = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
        let mass = self.params.particle_mass();
        let mut out = FluidMonitor::default();
        let (mut momentum, mut position, mut extent) = (DVec3::ZERO, DVec3::ZERO, DVec3::MIN);
        for s in sums {
            out.particles += u64::from(s.particles);
            out.kinetic += mass * f64::from(s.kinetic);
            momentum += mass * vector(s.momentum);
            position += vector(s.position);
            out.speed_max = out.speed_max.max(f64::from(s.speed_squared_max).sqrt());
            extent = extent.max(vector(s.extent_max));
            out.density_error_mean += f64::from(s.density_error);
            out.density_error_max = out.density_error_max.max(f64::from(s.density_error_max));
            out.inner += u64::from(s.inner);
        }
        let count = out.particles as f64;
        position += count * self.middle;
        out.potential = -mass * self.params.gravity.dot(position);
        out.momentum = momentum.to_array();
        out.centroid = (position / count.max(1.0)).to_array();
        out.extent_max = if out.particles > 0 { (extent + self.middle).to_array() } else { [0.0; 3] };
        out.density_error_mean /= out.inner.max(1) as f64;
        let per_bin = speed_range(&self.params, self.dt) / SPEED_BINS as f64;
        let mut histogram = [0_u64; SPEED_BINS];
        histogram.iter_mut().zip(bins).for_each(|(h, &b)| *h = u64::from(b));
        out.speed_most = speed_most(&histogram, out.particles, per_bin);
        out
    }
}

/// Workgroups for as many threads.
fn groups(threads: u64) -> u64 {
    threads.div_ceil(WORKGROUP)
}

impl Backend for Gpu {
    fn description(&self) -> String {
        let info = &self.context.info;
        format!("{} ({}, {})", info.name, info.backend, info.device_type)
    }

    fn precision(&self) -> &'static str {
        "f32"
    }

    fn run(&mut self, stage: ParticleStage, step: &Step) -> Result<()> {
        self.context.begin(Some(stage.into()));
        self.set_step(step)?;
        self.book(stage)?;
        let Some((kernel, over)) = kernels::of(stage) else { return self.cell_list() };
        let s = self.sizes;
        let threads = match over {
            Over::Fluid | Over::Own => s.fluid,
            Over::FluidAndReaction => s.fluid + self.felt(),
            Over::Rows => s.pressure,
        };
        self.context.pass([(kernel, groups(threads))])?;
        if matches!(stage, ParticleStage::WallFriction | ParticleStage::Collision) {
            self.book_kick(stage)?;
            // What they found is applied as any acceleration is.
            self.context.pass([(kernels::correct::kick, groups(s.fluid))])?;
        }
        Ok(())
    }

    fn pass_openings(&mut self, emissions: &[Emission], outlets: &[Outlet]) -> Result<()> {
        self.context.begin(Some(Stage::Openings));
        let four = |v: DVec3| v.as_vec3().extend(0.0).to_array();
        if !emissions.is_empty() {
            let device = |e: &Emission| layout::Emission {
                wall: e.wall.start as u32,
                count: e.wall.len() as u32,
                to: e.to as u32,
                pad: 0,
                shift: four(e.shift),
                velocity: four(e.velocity),
            };
            let mut layers = vec![layout::Emission::default(); self.sizes.openings as usize];
            layers.iter_mut().zip(emissions).for_each(|(layer, e)| *layer = device(e));
            let count: u64 = emissions.iter().map(|e| e.wall.len() as u64).sum();
            self.context.upload(buffers::emission, &layers)?;
            self.context.pass([(kernels::openings::emit, groups(count))])?;
        }
        if outlets.iter().all(Outlet::is_closed) {
            return Ok(());
        }
        let mut boxes = vec![layout::Outlet::CLOSED; self.sizes.openings as usize];
        let device = |outlet: &Outlet| layout::Outlet::new(outlet, self.middle);
        boxes.iter_mut().zip(outlets).for_each(|(to, outlet)| *to = device(outlet));
        if boxes != self.outlets {
            self.context.upload(buffers::outlet, &boxes)?;
            self.outlets = boxes;
        }
        self.context.pass([(kernels::openings::swallow, groups(self.sizes.fluid))])
    }

    fn free_bodies(&mut self, bodies: &[FreeBody], slots: &[SlotRow]) -> Result<()> {
        let p = &self.params;
        let factor = p.density / p.spacing.powi(3) / layout::laplacian_coefficient(p);
        let four = |v: DVec3| v.as_vec3().extend(0.0).to_array();
        let device = |(solid, (body, &(first, count))): (usize, (&FreeBody, &(usize, usize)))| {
            let inertia = factor * body.inverse_inertia;
            layout::FreeBody {
                inverse_mass: four(factor * body.inverse_mass),
                inertia_x: four(inertia.x_axis),
                inertia_y: four(inertia.y_axis),
                inertia_z: four(inertia.z_axis),
                force: four(body.load.force),
                torque: four(body.load.torque),
                first: first as u32,
                count: count as u32,
                solid: solid as u32,
                bodies: 0,
            }
        };
        let of = bodies.iter().zip(&self.wall_layers).enumerate();
        let free = of.filter(|(_, (b, _))| b.inverse_mass != DVec3::ZERO || b.inverse_inertia != DMat3::ZERO);
        let mut free: Vec<_> = free.map(device).collect();
        let count = free.len() as u32;
        free.iter_mut().for_each(|body| body.bodies = count);
        self.coupled = free.len() as u64;
        if free.is_empty() {
            return Ok(());
        }
        self.context.begin(Some(Stage::ConjugateGradient));
        self.context.upload(buffers::free_body, &free)?;
        // Zeros stand for rows at no slot, also before the first upload.
        if slots.is_empty() && !self.slots_shown {
            return Ok(());
        }
        self.slots_shown = !slots.is_empty();
        let mut rows = vec![[0.0; 4]; 4 * self.groups.moving_wall];
        for slot in slots {
            let k = 4 * (self.wall_layers[slot.solid as usize].0 + slot.row as usize);
            rows[k] = slot.per_pascal.force.as_vec3().extend(slot.taken as f32).to_array();
            rows[k + 1] = four(slot.per_pascal.torque);
            rows[k + 2] = four(slot.head.force);
            rows[k + 3] = four(slot.head.torque);
        }
        self.context.upload(buffers::coupling, &rows)
    }

    fn solve_pressure(&mut self, step: &Step) -> Result<PressureReport> {
        self.context.begin(Some(Stage::ConjugateGradient));
        self.set_step(step)?;
        if self.plan.needs(Arrays::Coupling) {
            let moving = self.sizes.moving_wall;
            self.context.pass([(kernels::wall_excess::before_solve, groups(moving))])?;
        }
        let report = self.conjugate_gradient()?;
        if self.plan.needs(Arrays::Excess) {
            let Groups { moving_wall, .. } = self.groups;
            let rows = self.plan.excess.rows(self.groups.pressure() - self.groups.fluid, moving_wall);
            self.context.pass([(kernels::wall_excess::after_solve, groups(rows as u64))])?;
        }
        Ok(report)
    }

    fn move_solids(&mut self, poses: &[Pose]) -> Result<()> {
        if !self.plan.needs(Arrays::Solids) {
            return Ok(());
        }
        let four = |v: DVec3| v.as_vec3().extend(0.0).to_array();
        let device = |p: &Pose| layout::Pose {
            position: four(p.position - self.middle),
            orientation: p.orientation.as_quat().to_array(),
            velocity: four(p.velocity),
            angular_velocity: four(p.angular_velocity),
        };
        let poses: Vec<_> = poses.iter().map(device).collect();
        self.context.begin(Some(Stage::MoveSolids));
        self.context.upload(buffers::poses, &poses)?;
        self.context.pass([(kernels::move_solids::move_solids, groups(self.sizes.moving))])
    }

    fn body_force(&mut self) -> Result<Vec<Wrench>> {
        let mut total = vec![Wrench::default(); self.solids];
        if self.chunk_solid.is_empty() {
            return Ok(total);
        }
        let chunks = self.chunk_solid.len();
        self.context.begin(Some(Stage::BodyForce));
        self.context.pass([(kernels::body_force::body_force, chunks as u64)])?;
        let parts = self.context.download(buffers::wrench, 2 * chunks)?;
        let vector = |v: &[f32; 4]| Vec3::new(v[0], v[1], v[2]).as_dvec3();
        for (&solid, part) in self.chunk_solid.iter().zip(parts.chunks_exact(2)) {
            total[solid].force += vector(&part[0]);
            total[solid].torque += vector(&part[1]);
        }
        Ok(total)
    }

    fn ledger(&mut self) -> Result<Option<Ledger>> {
        self.read_ledger()
    }

    fn counters(&mut self) -> Result<Counters> {
        if !self.plan.wet() {
            return Ok(Counters::default());
        }
        let seen = self.context.download(buffers::counters, counter::WORDS)?;
        self.take_counters(&seen)
    }

    fn monitor(&mut self) -> Result<FluidMonitor> {
        Ok(self.look()?.0)
    }

    fn look(&mut self) -> Result<(FluidMonitor, Counters)> {
        if !self.plan.wet() {
            return Ok(Default::default());
        }
        let groups = self.sizes.monitor_groups();
        self.context.begin(None);
        self.context.clear(buffers::speed_bin)?;
        self.context.pass([(kernels::monitor::monitor, groups)])?;
        let sums = groups * size_of::<MonitorSum>() as u64;
        let (bins, seen) = (4 * SPEED_BINS as u64, 4 * counter::WORDS as u64);
        let parts = [
            (buffers::monitor_sum.id(), 0, sums),
            (buffers::speed_bin.id(), 0, bins),
            (buffers::counters.id(), 0, seen),
        ];
        let bytes = self.context.download_bytes(&parts, true)?;
        let (sums, rest) = bytes.split_at(sums as usize);
        let (bins, seen) = rest.split_at(bins as usize);
        let counters = self.take_counters(&bytemuck::pod_collect_to_vec::<u8, u32>(seen))?;
        let sums: Vec<MonitorSum> = bytemuck::pod_collect_to_vec(sums);
        Ok((self.finish_monitor(&sums, &bytemuck::pod_collect_to_vec::<u8, u32>(bins)), counters))
    }

    fn timing(&self) -> Timing {
        if self.context.clock.is_some() { Timing::Timestamps } else { Timing::Waits }
    }

    fn stage_seconds(&self) -> BTreeMap<Stage, f64> {
        self.context.clock.as_ref().map(|c| c.seconds.clone()).unwrap_or_default()
    }

    fn solution(&mut self) -> Result<Option<Vec<f64>>> {
        if !self.plan.wet() {
            return Ok(None);
        }
        // Beside the positions, where the last residual was computed from.
        let packed = self.context.download(buffers::preconditioned, self.groups.pressure())?;
        Ok(Some(packed.into_iter().map(|x| f64::from(x[3])).collect()))
    }

    fn wall_pressures(&mut self, slots: &[usize]) -> Result<Vec<RowPressure>> {
        let stretches = Stretches::of(slots);
        let of = |id, size: u64, skip: usize| {
            stretches
                .iter()
                .map(move |(first, count)| (id, (first - skip) as u64 * size, count as u64 * size))
        };
        let mut parts: Vec<_> = of(buffers::pressure.id(), buffers::pressure.size(), 0).collect();
        let over = self.plan.needs(Arrays::Excess);
        if over {
            parts.extend(of(buffers::excess.id(), buffers::excess.size(), self.groups.fluid));
        }
        let values: Vec<f32> = bytemuck::pod_collect_to_vec(&self.context.download_bytes(&parts, false)?);
        let (pressure, excess) = values.split_at(stretches.len());
        let told = |&slot: &usize| {
            let at = stretches.place(slot);
            let excess = if over && excess[at] < layout::DRY { excess[at].into() } else { 0.0 };
            RowPressure { pressure: pressure[at].into(), excess }
        };
        Ok(slots.iter().map(told).collect())
    }

    fn read(&mut self) -> Result<Fields> {
        if self.plan.wet() { self.read_fields() } else { Ok(Fields::default()) }
    }

    fn write(&mut self, fields: &Fields) -> Result<()> {
        if self.plan.wet() { self.write_fields(fields) } else { Ok(()) }
    }

    fn exchange(&mut self, archive: &mut crate::checkpoint::Archive) -> Result<()> {
        Gpu::exchange(self, archive)
    }

    fn wait(&mut self) -> Result<()> {
        self.context.wait()
    }

    fn stop_with(&mut self, stop: &Stop) {
        self.stop = stop.clone();
    }

    fn bytes(&self) -> u64 {
        self.context.bytes
    }

    fn traffic(&mut self) -> Result<Traffic> {
        if self.plan.wet() { self.count_traffic() } else { Ok(Traffic::default()) }
    }

    fn compute(&mut self) -> Option<&mut dyn Compute> {
        if self.plan.contact.program.is_some() { Some(self) } else { None }
    }

    fn commands(&self) -> Commands {
        self.context.commands.clone()
    }
}

impl Compute for Gpu {
    fn reserve(&mut self, buffer: Id, bytes: u64) -> Result<()> {
        self.context.reserve(buffer, bytes)
    }

    fn upload(&mut self, buffer: Id, data: &[u8]) -> Result<()> {
        self.context.begin(Some(Stage::Contact));
        self.context.reserve(buffer, data.len() as u64)?;
        if data.is_empty() { Ok(()) } else { self.context.upload_bytes(buffer, data) }
    }

    fn dispatch(&mut self, kernels: &[(Kernel, u64)]) -> Result<()> {
        self.context.begin(Some(Stage::Contact));
        self.context.pass(kernels.iter().copied())
    }

    fn download(&mut self, buffer: Id, bytes: u64) -> Result<Vec<u8>> {
        self.context.begin(Some(Stage::Contact));
        self.context.download_bytes(&[(buffer, 0, bytes)], false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;

    #[test]
    fn a_lost_device_is_an_error_and_no_panic() {
        let text = "[run]\nspacing = 0.1\ntime_step = 1e-3\nend = 1.0\n[fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\n\
                    max = [0.5, 0.5, 0.5]\n[tank]\nmin = [0, 0, 0]\nmax = [1.0, 0.5, 1.0]\n";
        let case: Case = toml::from_str(text).expect("a valid case");
        let scene = Scene::build(&case).expect("a valid scene");
        let params = Params::new(&case, &scene).expect("valid constants");
        let plan = Plan::new(&case, &scene, &params);
        let settings = Settings { tolerance: 1e-3, max_iterations: 10, warm_start: true };
        let mut gpu = Gpu::dry_run(&scene, &params, &plan, settings).expect("it can be built");
        let step = params.step(0.0, 1e-3, 1.0);
        gpu.run(ParticleStage::CellList, &step).expect("a step can be recorded");
        gpu.read().expect("the device is there");
        gpu.context.destroy();
        let lost = gpu.run(ParticleStage::CellList, &step).and_then(|()| gpu.read().map(|_| ()));
        let text = lost.expect_err("the device is gone").to_string();
        assert!(text.starts_with("noop: "), "{text}");
    }
}
