//! The GPU path as one of many ranks, each with a device of its own: a part of the water, and all solids.
//!
//! The device has this rank's water, copies of the neighbours' border columns beside it, and all solids. Copies, and the wall layers of other ranks, are
//! marked in `position.w` as FOREIGN: the shaders, shaped by the switch RANKS, take them for neighbours and compute nothing of them. What crosses a cut
//! is packed on the device into one buffer, staged by the host and handed on by [`crate::ranks::Team`]: [`halo`] is the place where a message from device
//! to device would stand. A run without ranks has none of this: the same shaders, buffers and commands as ever.

mod halo;
mod inflow;
mod levels;
#[cfg(test)]
mod rig;
mod settle;
mod solve;
mod state;

use super::Gpu;
use super::adapter::{self, Caps};
use super::layout::MonitorSum;
use crate::backend::traffic::Traffic;
use crate::backend::{self, Backend, Commands, Counters, Timing};
use crate::body::slots::SlotRow;
use crate::body::{FreeBody, Pose, Wrench};
use crate::cells::Grid;
use crate::checkpoint::Archive;
use crate::error::{Error, Result};
use crate::fields::Fields;
use crate::kernels::body_force::RowPressure;
use crate::kernels::openings::{Emission, Outlet};
use crate::ledger::Ledger;
use crate::monitor::FluidMonitor;
use crate::params::{Params, Step};
use crate::plan::{ContactPlan, ParticleStage, Plan, Stage};
use crate::pressure::{PressureReport, Settings};
use crate::ranks::{Standing, Team};
use crate::scene::{Groups, Scene};
use crate::share::{Share, Start};
use crate::stop::Stop;
use halo::{Lists, Shown};
use levels::Rows;
use settle::{Came, Walls};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Which device a rank takes, and how large the whole is of which it has a part.
struct Place {
    /// Number of this rank among those of its machine.
    k: usize,
    /// The adapters asked for.
    asked: Option<String>,
    /// Particles of all ranks.
    all: Groups,
}

/// Particles of a rank, in f32 on a device.
pub struct GpuRank {
    gpu: Gpu,
    share: Share,
    /// The solids of the scene, without its water: from it a device with more room is set up.
    stem: Scene,
    place: Place,
    poses: Vec<Pose>,
    walls: Walls,
    /// Where the water of each column of cells begins, as the last sort left it; empty before there was one.
    starts: Vec<u32>,
    /// Slots from the first on that may hold a particle or a copy.
    live: usize,
    /// Slots with water that has just come in.
    came_in: Range<usize>,
    /// What came from the ranks beside this one in the last settlement.
    came: Came,
    lists: Lists,
    rows: Rows,
}

impl GpuRank {
    /// The part of a rank of `team`, which begins with `start`, the `k`-th on its machine: on the device of that number among those that are `asked` for,
    /// see [`super::adapters`].
    ///
    /// # Errors
    /// [`Error::Gpu`] if there is no such adapter, or the part does not fit it.
    pub fn of_team(
        (team, k): (Arc<dyn Team>, usize),
        start: &Start,
        plan: &Plan,
        settings: Settings,
        asked: Option<&str>,
    ) -> Result<Self> {
        let (part, params, own) = (&start.scene, &start.params, start.ids.len());
        let grid = Grid::new(params)?;
        let mut share = Share::new(team, start, &grid);
        // Contact is the first rank's, and its host's.
        let plan = Plan { contact: ContactPlan::default(), ..plan.clone() };
        let place = Place { k, asked: asked.map(str::to_owned), all: start.all };
        let mut gpu = open(part, params, &plan, settings, &place)?;
        let mut fields = backend::start(part, &plan);
        fields.id[..own].copy_from_slice(&start.ids);
        gpu.write_fields(&fields)?;
        share.begin(gpu.groups, own, &fields, &grid);
        let stem = part.part(&[], 0, &[], None);
        Ok(Self {
            walls: Walls::new(&stem, &grid, gpu.middle),
            stem,
            place,
            poses: Vec::new(),
            starts: Vec::new(),
            live: own,
            came_in: 0..0,
            came: Came::default(),
            lists: Lists::default(),
            rows: Rows::default(),
            share,
            gpu,
        })
    }

    /// Where the particles in `slots` of the whole are here, if they are this rank's.
    fn here(&self, slots: &[usize]) -> Vec<Option<usize>> {
        slots.iter().map(|&s| self.share.here(s).filter(|&s| self.share.owns(s))).collect()
    }

    /// What is `told` of those of particles that are `here`, zero of the others.
    fn own(here: &[Option<usize>], told: Vec<RowPressure>) -> Vec<RowPressure> {
        let mut told = told.into_iter();
        here.iter().map(|s| s.and_then(|_| told.next()).unwrap_or_default()).collect()
    }

    /// What each rank holds and said.
    fn standings(&self) -> Vec<Standing> {
        self.share.gather_all(vec![self.share.standing(self.live, self.gpu.bytes())])
    }
}

/// A device for `part`, with as many slots as it has.
fn open(part: &Scene, params: &Params, plan: &Plan, settings: Settings, place: &Place) -> Result<Gpu> {
    let adapter = adapter::choose_of_rank(place.k, place.asked.as_deref())?;
    Gpu::open(part, params, plan, settings, adapter, Caps::default(), Some(place.all))
}

impl Backend for GpuRank {
    fn description(&self) -> String {
        self.gpu.description()
    }

    fn precision(&self) -> &'static str {
        self.gpu.precision()
    }

    fn run(&mut self, stage: ParticleStage, step: &Step) -> Result<()> {
        match stage {
            ParticleStage::Viscosity => {
                self.show(Shown::Motion)?;
                self.gpu.run(stage, step)
            }
            ParticleStage::CellList => {
                self.gpu.context.begin(Some(stage.into()));
                self.gpu.set_step(step)?;
                self.gpu.book(stage)?;
                self.settle()?;
                self.gpu.cell_list()?;
                self.find_borders()
            }
            _ => {
                self.gpu.run(stage, step)?;
                match stage {
                    ParticleStage::WallFriction | ParticleStage::Collision => self.show(Shown::Motion),
                    ParticleStage::NumberDensity => self.show(Shown::State),
                    ParticleStage::SurfacePressure => self.show(Shown::SurfacePressure),
                    _ => Ok(()),
                }
            }
        }
    }

    fn pass_openings(&mut self, emissions: &[Emission], outlets: &[Outlet]) -> Result<()> {
        self.gpu.context.begin(Some(Stage::Openings));
        self.take_in(emissions)?;
        self.gpu.pass_openings(&[], outlets)
    }

    fn free_bodies(&mut self, bodies: &[FreeBody], slots: &[SlotRow]) -> Result<()> {
        // What acts on a body beside the water is added once.
        let load = |body: &FreeBody| match self.share.rank() {
            0 => *body,
            _ => FreeBody { load: Wrench::default(), ..*body },
        };
        let bodies: Vec<FreeBody> = bodies.iter().map(load).collect();
        self.gpu.free_bodies(&bodies, slots)
    }

    fn solve_pressure(&mut self, step: &Step) -> Result<PressureReport> {
        self.solve(step)
    }

    fn move_solids(&mut self, poses: &[Pose]) -> Result<()> {
        self.poses.clear();
        self.poses.extend_from_slice(poses);
        self.gpu.move_solids(poses)
    }

    fn body_force(&mut self, rows: &[usize]) -> Result<(Vec<Wrench>, Vec<RowPressure>)> {
        let here = self.here(rows);
        let (mut forces, told) = self.gpu.body_force(&here.iter().flatten().copied().collect::<Vec<_>>())?;
        let mut told = Self::own(&here, told);
        self.share.sum_forces(&mut forces, &mut told);
        Ok((forces, told))
    }

    fn counters(&mut self) -> Result<Counters> {
        let own = self.gpu.counters()?;
        Ok(Counters::of_ranks(self.share.gather_all(vec![own])))
    }

    fn ledger(&mut self) -> Result<Option<Ledger>> {
        Ok(self.gpu.ledger()?.map(|own| own.of_ranks(&self.share)))
    }

    fn monitor(&mut self) -> Result<FluidMonitor> {
        let (sums, bins, _) = self.gpu.look_at_water()?;
        let all = |own: &[u8]| self.share.gather(own.to_vec());
        let sums: Vec<MonitorSum> = bytemuck::pod_collect_to_vec(&all(bytemuck::cast_slice(&sums)).concat());
        let mut total = vec![0_u32; bins.len()];
        for part in all(bytemuck::cast_slice(&bins)) {
            let part: Vec<u32> = bytemuck::pod_collect_to_vec(&part);
            total.iter_mut().zip(part).for_each(|(sum, n)| *sum += n);
        }
        Ok(self.gpu.finish_monitor(&sums, &total))
    }

    fn timing(&self) -> Timing {
        self.gpu.timing()
    }

    fn stage_seconds(&self) -> BTreeMap<Stage, f64> {
        self.gpu.stage_seconds()
    }

    fn wall_pressures(&mut self, slots: &[usize]) -> Result<Vec<RowPressure>> {
        let here = self.here(slots);
        let told = self.gpu.wall_pressures(&here.iter().flatten().copied().collect::<Vec<_>>())?;
        let mut told = Self::own(&here, told);
        self.share.sum_forces(&mut [], &mut told);
        Ok(told)
    }

    fn read(&mut self) -> Result<Fields> {
        self.read_whole()
    }

    fn write(&mut self, fields: &Fields) -> Result<()> {
        use backend::Ranked;
        self.restore(Some(fields.clone()))
    }

    fn exchange(&mut self, _: &mut Archive) -> Result<()> {
        // The first rank's backend saves and restores the state of all.
        Err(Error::gpu("a rank by itself has no state of the run"))
    }

    fn wait(&mut self) -> Result<()> {
        self.gpu.wait()
    }

    fn stop_with(&mut self, _: &Stop) {}

    fn bytes(&self) -> u64 {
        self.gpu.bytes()
    }

    fn traffic(&mut self) -> Result<Traffic> {
        self.gpu.traffic()
    }

    fn ranks(&mut self) -> Result<Vec<Standing>> {
        Ok(self.standings())
    }

    fn commands(&self) -> Commands {
        self.gpu.commands()
    }
}

/// Workgroups for as many threads; none for none.
fn groups(threads: usize) -> u64 {
    super::groups(threads as u64)
}

/// Slots that hold the wall layers.
fn wall_slots(gpu: &Gpu) -> Range<usize> {
    gpu.groups.fluid..gpu.groups.pressure()
}
