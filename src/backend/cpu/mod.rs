//! The CPU backend: the kernels in f64, over all particles, on all cores. Those that sum over neighbours have a fast
//! version here, tested against the plain one in [`crate::kernels`].

mod archive;
mod ledger;
mod moment;
mod number_density;
mod pressure_gradient;
mod pressure_source;
mod row_arrays;
mod search;
mod solids;
mod solve;
mod stages;
mod team;
mod viscosity;
mod wall_excess;
mod wide;

use self::ledger::WaterLedger;
use self::search::Coordinates;
use self::wall_excess::WallExcess;
use super::traffic::{Sizes, Traffic};
use super::{Backend, Counters};
use crate::body::slots::SlotRow;
use crate::body::{FreeBody, Pose, Wrench};
use crate::cells::Grid;
use crate::error::Result;
use crate::fields::Fields;
use crate::kernels::body_force::RowPressure;
use crate::kernels::cell_list::{CellList, Scratch};
use crate::kernels::openings::{Emission, Outlet};
use crate::kernels::{Particles, collision, correct, monitor};
use crate::ledger::Ledger;
use crate::monitor::FluidMonitor;
use crate::neighbours::{Chunk, Neighbours};
use crate::params::{Params, Step};
use crate::plan::{Arrays, ParticleStage, Plan, Stage, Told};
use crate::pressure::cg::Workspace;
use crate::pressure::multigrid::Multigrid;
use crate::pressure::{PressureReport, Settings};
use crate::ranks::Standing;
use crate::scene::{Groups, Kind, Scene, Solid};
use crate::scheme::{Preconditioner, Source};
use crate::share::Share;
use crate::stop::Stop;
use glam::DVec3;
use rayon::prelude::*;

/// Particles in f64 on the host.
pub struct Cpu {
    params: Params,
    settings: Settings,
    groups: Groups,
    solids: Vec<Solid>,
    poses: Vec<Pose>,
    /// One a solid where the pressure is to know how they answer, else none.
    free_bodies: Vec<FreeBody>,
    /// Rows at slots, in the order of solids and rows.
    slots: Vec<SlotRow>,
    /// Velocities of the surface before the wall-layer slots of moving solids, where viscosity and friction ask [m/s].
    surface_velocity: Vec<DVec3>,
    /// [`Scene::facing`], in the accurate scheme.
    facing: Vec<DVec3>,
    /// The same where the solids are now, world axes.
    outward: Vec<DVec3>,
    /// [`collision::lightness`] of each wall-layer slot of the moving solids [-].
    lightness: Vec<f64>,
    fields: Fields,
    grid: Grid,
    fluid_start: Vec<u32>,
    coordinates: Coordinates,
    moving: Option<(CellList, Coordinates)>,
    fixed: Option<(CellList, Coordinates)>,
    near_fluid: Vec<bool>,
    /// Keep dry walls in every stage, to show that leaving them out changes nothing.
    pub active_set: bool,
    neighbours: Neighbours,
    scratch: Scratch,
    work: Workspace,
    multigrid: Option<Multigrid>,
    live: usize,
    counters: Counters,
    ledger: Option<Box<WaterLedger>>,
    /// How unevenly the neighbours of the fluid's particles lie [1/m], where a shift asks for it.
    imbalance: Vec<DVec3>,
    /// Weights of the walls beside each particle of water, summed by the friction on them [-].
    wall_weights: Vec<f64>,
    /// Length of the step [s].
    dt: f64,
    excess: WallExcess,
    /// Whether [`Fields::reaction`] is kept of walls that never move, and which stage of a step begins it.
    still_reacts: bool,
    first_reacting: Option<Stage>,
    /// What of it this rank computes, where there are others.
    share: Option<Box<Share>>,
}

impl Cpu {
    /// Particles of `scene`; allocates nothing for a dry one.
    pub fn new(scene: &Scene, params: &Params, plan: &Plan, settings: Settings) -> Result<Self> {
        let grid = if plan.wet() { Grid::new(params)? } else { Grid::nothing() };
        Ok(Self::on_grid(grid, scene, params, plan, settings))
    }

    /// The same with cells of its own.
    fn on_grid(grid: Grid, scene: &Scene, params: &Params, plan: &Plan, settings: Settings) -> Self {
        let groups = scene.groups;
        let wet = plan.wet();
        let lightness = |solid| collision::lightness(solid, params);
        let mut scratch = Scratch::default();
        let fixed = if wet { Self::index_fixed(&grid, groups, &scene.position, &mut scratch) } else { None };
        Self {
            params: params.clone(),
            settings,
            groups,
            solids: scene.solids.clone(),
            poses: Vec::new(),
            free_bodies: Vec::new(),
            slots: Vec::new(),
            surface_velocity: vec![
                DVec3::ZERO;
                if plan.needs(Arrays::Turning) { groups.moving_wall } else { 0 }
            ],
            facing: match params.source {
                Source::NumberDensity => Vec::new(),
                Source::Mixed => scene.facing(),
            },
            outward: Vec::new(),
            lightness: scene.solids.iter().flat_map(|s| s.wall_slots.clone().map(|_| lightness(s))).collect(),
            fields: if wet { super::start(scene, plan) } else { Fields::default() },
            grid,
            fluid_start: Vec::new(),
            coordinates: Coordinates::default(),
            moving: (wet && groups.moving_wall > 0).then(Default::default),
            fixed,
            near_fluid: Vec::new(),
            active_set: true,
            neighbours: Neighbours::new(if wet { groups.pressure() } else { 0 }),
            scratch,
            work: Workspace::default(),
            multigrid: (wet && plan.preconditioner == Preconditioner::Multigrid).then(Multigrid::default),
            live: scene.water(),
            counters: Counters::new(super::outflows(scene)),
            ledger: (wet && plan.ledger).then(Box::default),
            imbalance: vec![DVec3::ZERO; if plan.needs(Arrays::Imbalance) { groups.fluid } else { 0 }],
            wall_weights: Vec::new(),
            dt: 0.0,
            excess: WallExcess::new(scene, params, plan),
            still_reacts: plan.reaction == Told::All,
            first_reacting: plan.first_reacting(),
            share: None,
        }
    }

    /// What never moves, by cells; nothing if there is nothing.
    fn index_fixed(
        grid: &Grid,
        groups: Groups,
        position: &[DVec3],
        scratch: &mut Scratch,
    ) -> Option<(CellList, Coordinates)> {
        (!groups.static_range().is_empty()).then(|| {
            let mut list = CellList::default();
            list.index(grid, groups.static_range(), position, scratch);
            let mut coordinates = Coordinates::default();
            let place = |&s: &u32| grid.periodic.wrap(position[s as usize]);
            coordinates.set(list.slot.par_iter().map(place));
            (list, coordinates)
        })
    }

    /// The particles.
    pub fn fields(&self) -> &Fields {
        &self.fields
    }

    /// The particles, to try single stages on; the neighbour lists stay as they are.
    pub fn fields_mut(&mut self) -> &mut Fields {
        &mut self.fields
    }

    /// The neighbour lists.
    pub fn neighbours(&self) -> &Neighbours {
        &self.neighbours
    }

    /// Sizes of the particle groups.
    pub fn groups(&self) -> Groups {
        self.groups
    }
}

impl Backend for Cpu {
    fn description(&self) -> String {
        let threads = rayon::current_num_threads();
        format!("CPU, {threads} thread{}", if threads == 1 { "" } else { "s" })
    }

    fn precision(&self) -> &'static str {
        "f64"
    }

    fn run(&mut self, stage: ParticleStage, step: &Step) -> Result<()> {
        self.dt = step.dt;
        match stage {
            ParticleStage::Absorber => self.absorber(step.dt),
            ParticleStage::Viscosity => {
                self.show_motion();
                self.on_surfaces(Self::viscosity);
            }
            ParticleStage::Predict => self.predict(step),
            ParticleStage::CellList => self.cell_list(),
            ParticleStage::NeighbourList => self.neighbour_list(),
            ParticleStage::WallFriction => self.on_surfaces(|cpu| cpu.wall_friction(step)),
            ParticleStage::Collision => self.collision(step),
            ParticleStage::NumberDensity => self.number_density(),
            ParticleStage::SurfacePressure => self.surface_pressure(),
            ParticleStage::PressureSource => self.pressure_source(step),
            ParticleStage::PressureGradient => self.pressure_gradient(step.dt),
            ParticleStage::Shift => self.shift(step),
            ParticleStage::Correct => {
                let own = self.own();
                if let Some(ledger) = &mut self.ledger {
                    let Fields { position, velocity, acceleration, .. } = &self.fields;
                    let on = Particles { params: &self.params, position, velocity, fluid: self.groups.fluid };
                    ledger.pressure(own, on, acceleration, step);
                }
                self.apply(step, correct::correct);
            }
        }
        Ok(())
    }

    fn pass_openings(&mut self, emissions: &[Emission], outlets: &[Outlet]) -> Result<()> {
        self.openings(emissions, outlets);
        Ok(())
    }

    fn free_bodies(&mut self, bodies: &[FreeBody], slots: &[SlotRow]) -> Result<()> {
        self.free_bodies.clear();
        self.free_bodies.extend_from_slice(bodies);
        self.slots.clear();
        self.slots.extend_from_slice(slots);
        Ok(())
    }

    fn solve_pressure(&mut self, step: &Step) -> Result<PressureReport> {
        Ok(self.conjugate_gradient(step))
    }

    fn move_solids(&mut self, poses: &[Pose]) -> Result<()> {
        self.place_solids(poses);
        Ok(())
    }

    fn body_force(&mut self, rows: &[usize]) -> Result<(Vec<Wrench>, Vec<RowPressure>)> {
        let (mut forces, mut told) = (self.sum_forces(), self.own_pressures(rows));
        self.share.iter().for_each(|share| share.sum_forces(&mut forces, &mut told));
        Ok((forces, told))
    }

    fn ledger(&mut self) -> Result<Option<Ledger>> {
        let own = self.ledger.as_ref().map(|ledger| ledger.work);
        Ok(own.map(|own| self.share.as_ref().map_or(own, |share| own.of_ranks(share))))
    }

    fn counters(&mut self) -> Result<Counters> {
        Ok(match &self.share {
            Some(share) => Counters::of_ranks(share.gather_all(vec![self.counters.clone()])),
            None => self.counters.clone(),
        })
    }

    fn monitor(&mut self) -> Result<FluidMonitor> {
        let sums = monitor::sums(&self.fields, self.own(), &self.params, self.dt);
        let sums = match &self.share {
            Some(share) => share.gather_all(sums),
            None => sums,
        };
        Ok(monitor::monitor(&sums, &self.params, self.dt))
    }

    fn wall_pressures(&mut self, slots: &[usize]) -> Result<Vec<RowPressure>> {
        let mut told = self.own_pressures(slots);
        self.share.iter().for_each(|share| share.sum_forces(&mut [], &mut told));
        Ok(told)
    }

    fn read(&mut self) -> Result<Fields> {
        let mut fields = match &self.share {
            // Only the first rank gets them.
            Some(share) => share.gather_fields(&self.fields).unwrap_or_default(),
            None => self.fields.clone(),
        };
        if !fields.position.is_empty() {
            let groups = self.share.as_ref().map_or(self.groups, |share| share.all());
            fields.wrap(&groups, &self.params.periodic);
        }
        Ok(fields)
    }

    fn write(&mut self, fields: &Fields) -> Result<()> {
        self.fields = fields.clone();
        self.live = self.fields.kind[..self.groups.fluid].iter().filter(|&&k| k == Kind::Fluid).count();
        // The lists name the slots of the particles that were here before.
        self.neighbours = Neighbours::new(self.neighbours.rows());
        Ok(())
    }

    fn exchange(&mut self, archive: &mut crate::checkpoint::Archive) -> Result<()> {
        Cpu::exchange(self, archive)
    }

    fn traffic(&mut self) -> Result<Traffic> {
        let rows =
            self.neighbours.chunks.iter().flat_map(|c| c.start.windows(2)).filter(|w| w[0] < w[1]).count();
        let carrying = |c: &Chunk| (0..c.rows()).map(|k| c.pressure(k).neighbour.len()).sum::<usize>();
        let pressure_pairs: usize = self.neighbours.chunks.iter().map(carrying).sum();
        let sizes = Sizes {
            fluid: self.live as u64,
            rows: rows as u64,
            cells: self.grid.total() as u64,
            pairs: self.neighbours.pairs() as u64,
            pressure_pairs: pressure_pairs as u64,
            viscous_pairs: (pressure_pairs
                + if self.params.surface_stress() { self.neighbours.pairs() } else { 0 })
                as u64,
            pressure: self.groups.pressure() as u64,
            number: 8,
            vector: 24,
            weight: 8,
            multigrid: self.multigrid.as_ref().map(|m| (4, m.stored())),
        };
        Ok(sizes.traffic())
    }

    fn ranks(&mut self) -> Result<Vec<Standing>> {
        Ok(self.standings())
    }

    fn stop_with(&mut self, stop: &Stop) {
        self.work.stop = stop.clone();
    }

    fn bytes(&self) -> u64 {
        let per_particle = size_of::<DVec3>() * 2 + size_of::<Kind>();
        let per_pressure = 8 * 8 + 1;
        let f = &self.fields;
        (f.position.len() * per_particle + f.pressure.len() * per_pressure + self.neighbours.bytes()) as u64
            + (self.fluid_start.len() * 4 + self.near_fluid.len()) as u64
            + self.fixed.as_ref().map_or(0, |l| l.0.start.len() * 4 + l.0.slot.len() * 28) as u64
    }
}
