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
pub mod memory;
mod observe;
pub mod parts;
mod rank;
mod set_up;
pub mod shader;
mod solids;
mod solve;
mod stretches;
mod traffic;
mod transfer;

pub use adapter::{AdapterInfo, Caps, adapters};
pub use bandwidth::bandwidth;
pub use rank::GpuRank;
pub use set_up::{memory, sizes};

use super::traffic::Traffic;
use super::{Backend, Commands, Counters, Timing};
use crate::body::slots::SlotRow;
use crate::body::{FreeBody, Pose, Wrench};
use crate::cells::Grid;
use crate::compute::{Compute, Id, Kernel};
use crate::error::{Error, Result};
use crate::fields::Fields;
use crate::kernels::body_force::RowPressure;
pub use crate::kernels::device as kernels;
use crate::kernels::device::Over;
use crate::kernels::openings::{Emission, Outlet};
use crate::ledger::Ledger;
use crate::monitor::FluidMonitor;
use crate::params::{Params, Step};
use crate::plan::{Arrays, ParticleStage, Plan, Stage};
use crate::pressure::{PressureReport, Settings};
use crate::scene::Groups;
use crate::stop::Stop;
use context::Context;
use glam::DVec3;
use hierarchy::Levels;
use layout::{Coefficients, WORKGROUP, counter};
use memory::{SCAN_BLOCK, SCAN_GROUPS_MAX, Sizes};
use parts::Division;
use std::collections::BTreeMap;

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
    /// Whether the device has the poses of the solids.
    posed: bool,
    /// First of the moving-wall slots and number of each solid's wall layer.
    wall_layers: Vec<(usize, usize)>,
    /// Rows at slots between solids that the device has.
    slot_rows: solids::SlotRows,
    /// Bodies in the next solve that answer the pressure, by the numbers of their solids, rising.
    coupled: Vec<usize>,
    counters: Counters,
    coefficients: Coefficients,
    /// What swallows on the device.
    outlets: Vec<layout::Outlet>,
    /// Length of the step [s].
    dt: f64,
    expected_iterations: f64,
    /// Levels of the multigrid preconditioner, if that is planned.
    levels: Option<Levels>,
    stop: Stop,
}

impl Gpu {
    /// `true` if the machine has a GPU, as opposed to software that acts as one.
    pub fn hardware_available() -> bool {
        adapters().iter().any(AdapterInfo::is_hardware)
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

    fn set_step(&mut self, step: &Step) -> Result<()> {
        self.dt = step.dt;
        let coefficients = Coefficients::new(&self.params, step);
        if coefficients != self.coefficients {
            self.coefficients = coefficients;
            self.context.upload(buffers::now, &[coefficients])?;
        }
        Ok(())
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
        if stage == ParticleStage::CellList {
            return self.cell_list();
        }
        let none = || Error::gpu(format!("{}: it has no kernel over particles", Stage::from(stage).name()));
        let (kernel, over) = kernels::of(stage).ok_or_else(none)?;
        let s = self.sizes;
        let along = matches!(stage, ParticleStage::Viscosity | ParticleStage::WallFriction);
        let turns = along && self.posed && self.plan.needs(Arrays::Turning);
        let moving_wall = groups(s.moving_wall);
        if turns {
            self.context.pass([(kernels::move_solids::on_surface, moving_wall)])?;
        }
        let threads = match over {
            Over::Fluid => s.fluid,
            Over::FluidAndReaction => s.fluid + s.reacting,
            Over::Rows => s.pressure,
        };
        self.context.pass([(kernel, groups(threads))])?;
        if stage == ParticleStage::WallFriction && s.reacting > 0 {
            self.context.pass([(kernels::wall_friction::react, groups(s.reacting))])?;
        }
        if turns {
            self.context.pass([(kernels::move_solids::at_centre, moving_wall)])?;
        }
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
            // One without particles ends them.
            let end = std::iter::once(layout::Emission::default());
            let layers: Vec<layout::Emission> =
                emissions.iter().map(device).chain(end).take(self.sizes.emissions as usize).collect();
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
        self.show_free_bodies(bodies, slots)
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
        self.show_poses(poses)
    }

    fn body_force(&mut self, rows: &[usize]) -> Result<(Vec<Wrench>, Vec<RowPressure>)> {
        self.sum_forces(rows)
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
        Ok(self.observe()?.0)
    }

    fn look(&mut self) -> Result<(FluidMonitor, Counters)> {
        self.observe()
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
        self.read_wall_pressures(slots)
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
    use crate::scene::Scene;

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
