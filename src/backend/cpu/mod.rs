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
mod team;
mod viscosity;
mod wall_excess;
mod wide;

use self::ledger::WaterLedger;
use self::number_density::density_rows;
use self::pressure_gradient::gradient_rows;
use self::pressure_source::source_rows;
use self::row_arrays::RowArrays;
use self::search::{Candidates, Coordinates, Search, neighbour_list};
use self::team::owns;
use self::viscosity::viscosity_rows;
use self::wall_excess::{Rows, WallExcess};
use super::traffic::{Sizes, Traffic};
use super::{Backend, Counters, RowPressure};
use crate::body::slots::{self, SlotRow};
use crate::body::{FreeBody, Pose, Wrench};
use crate::cells::Grid;
use crate::error::Result;
use crate::fields::{Fields, State};
use crate::kernels::cell_list::{self, CellList, Scratch};
use crate::kernels::openings::{Emission, Outlet};
use crate::kernels::pressure_source::laplacian_coefficient;
use crate::kernels::{
    Particles, absorber, body_force, collision, correct, coupling, monitor, move_solids, openings, predict,
    pressure_level, shift, surface_pressure, wall_friction,
};
use crate::ledger::{Entry, Ledger};
use crate::monitor::FluidMonitor;
use crate::neighbours::{CHUNK, Chunk, Neighbours, capacity};
use crate::params::{Params, Step};
use crate::plan::{Arrays, ParticleStage, Plan};
use crate::pressure::cg::{Among, Jacobi, Precondition, System, Workspace, solve_or_fall_back};
use crate::pressure::coupling::CoupledBody;
use crate::pressure::multigrid::Multigrid;
use crate::pressure::{PressureReport, Settings};
use crate::ranks::Standing;
use crate::scene::{Groups, Kind, Scene, Solid};
use crate::scheme::Preconditioner;
use crate::share::Share;
use crate::stop::Stop;
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

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
    /// [`collision::lightness`] of each wall-layer slot of the moving solids.
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
    dt: f64,
    excess: WallExcess,
    /// What of it this rank computes, where there are others.
    share: Option<Box<Share>>,
}

impl Cpu {
    /// Particles of `scene`; allocates nothing for a dry one.
    pub fn new(scene: &Scene, params: &Params, plan: &Plan, settings: Settings) -> Result<Self> {
        let groups = scene.groups;
        let wet = plan.wet();
        let lightness = |solid| collision::lightness(solid, params);
        let grid = if wet { Grid::new(params)? } else { Grid::nothing() };
        let mut scratch = Scratch::default();
        let fixed = (wet && !groups.static_range().is_empty()).then(|| {
            let mut list = CellList::default();
            list.index(&grid, groups.static_range(), &scene.position, &mut scratch);
            let mut coordinates = Coordinates::default();
            let place = |&s: &u32| grid.periodic.wrap(scene.position[s as usize]);
            coordinates.set(list.slot.par_iter().map(place));
            (list, coordinates)
        });
        Ok(Self {
            params: params.clone(),
            settings,
            groups,
            solids: scene.solids.clone(),
            poses: Vec::new(),
            free_bodies: Vec::new(),
            slots: Vec::new(),
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
            dt: 0.0,
            excess: WallExcess::new(scene, params, plan),
            share: None,
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

    fn viscosity(&mut self) {
        let Self { fields, neighbours, params, groups, share, .. } = self;
        if neighbours.pairs() == 0 {
            return;
        }
        let (position, velocity) = (&fields.position, &fields.velocity);
        let on = Particles { params, position, velocity, fluid: groups.fluid };
        fields.acceleration.par_chunks_mut(CHUNK).zip(&neighbours.chunks).enumerate().for_each(
            |(c, (acceleration, chunk))| {
                RowArrays::with(|arrays| viscosity_rows(c * CHUNK, chunk, acceleration, on, arrays));
            },
        );
        let reaction = |(k, f): (usize, &mut DVec3)| {
            let i = groups.fluid + k;
            *f = if owns(share.as_deref(), i) {
                RowArrays::with(|arrays| viscosity::reaction(i, neighbours.pressure(i).neighbour, on, arrays))
            } else {
                DVec3::ZERO
            };
        };
        fields.reaction.par_iter_mut().enumerate().for_each(reaction);
    }

    fn absorber(&mut self, dt: f64) {
        let (zones, own, sides) = (&self.params.absorbers, self.own(), self.params.periodic);
        let Fields { position, velocity, .. } = &mut self.fields;
        if let Some(ledger) = &mut self.ledger {
            let slowed = |i: usize| absorber::absorber(sides.wrap(position[i]), velocity[i], zones, dt);
            ledger.absorber(own.clone(), &self.params, velocity, slowed);
        }
        (&position[own.clone()], &mut velocity[own])
            .into_par_iter()
            .for_each(|(&x, v)| *v = absorber::absorber(sides.wrap(x), *v, zones, dt));
    }

    fn predict(&mut self, step: &Step) {
        let own = self.own();
        if let Some(ledger) = &mut self.ledger {
            let Fields { position, velocity, acceleration, .. } = &self.fields;
            let on = Particles { params: &self.params, position, velocity, fluid: self.groups.fluid };
            ledger.predict(own.clone(), on, acceleration, step);
        }
        let (g, l0) = (self.params.explicit_gravity(), self.params.spacing);
        let Fields { position, velocity, acceleration, .. } = &mut self.fields;
        let clamps: u64 = (&mut position[own.clone()], &mut velocity[own.clone()], &mut acceleration[own])
            .into_par_iter()
            .map(|(x, v, a)| {
                let (x1, v1, clamped) = predict::predict(*x, *v, g + *a, step, l0);
                (*x, *v, *a) = (x1, v1, DVec3::ZERO);
                u64::from(clamped)
            })
            .sum();
        self.counters.displacement_clamps += clamps;
    }

    fn cell_list(&mut self) {
        let own = self.own();
        if let Some(ledger) = &mut self.ledger {
            let Fields { position, velocity, .. } = &self.fields;
            let on = Particles { params: &self.params, position, velocity, fluid: self.groups.fluid };
            ledger.lost(own, on);
        }
        let domain = (self.params.domain_min, self.params.domain_max);
        self.settle();
        let Self { fields, grid, params, fluid_start, scratch, groups, share, .. } = self;
        self.counters.lost +=
            cell_list::reorder_fluid(fields, grid, domain, params.dimensions, fluid_start, scratch);
        self.live = fluid_start[grid.total()] as usize;
        if let Some((list, coordinates)) = &mut self.moving {
            let slots = groups.moving_wall_range().chain(groups.moving_dummy_range());
            list.index(grid, slots, &fields.position, scratch);
            let place = |&s: &u32| grid.periodic.wrap(fields.position[s as usize]);
            coordinates.set(list.slot.par_iter().map(place));
        }
        if let Some(share) = share {
            let solids = [&self.moving, &self.fixed].map(|list| list.as_ref().map(|(list, _)| list));
            share.find_borders(fluid_start, solids);
            if self.multigrid.is_some() {
                share.keep_searched(&fields.position[..groups.pressure()]);
            }
        }
        if self.active_set {
            match share {
                Some(share) => {
                    cell_list::mark_near_fluid(grid, fluid_start, share.columns_seen(), &mut self.near_fluid);
                }
                None => {
                    cell_list::mark_near_fluid(grid, fluid_start, 0..grid.count[0], &mut self.near_fluid);
                }
            }
        } else {
            self.near_fluid.clear();
            self.near_fluid.resize(grid.total(), true);
        }
    }

    fn neighbour_list(&mut self) {
        let Self { fields, grid, params, groups, near_fluid, live, .. } = self;
        let (fluid, position, live) = (groups.fluid, &fields.position, *live);
        self.coordinates.set(position[..live].par_iter().copied());
        let from = Candidates {
            grid,
            fluid_start: &self.fluid_start,
            fluid: &self.coordinates,
            moving: self.moving.as_ref().map(|(list, x)| (list, x)),
            fixed: self.fixed.as_ref().map(|(list, x)| (list, x)),
            pressure_slots: groups.pressure() as u32,
            wall_carriers: params.wall_carriers(groups.fluid, groups.pressure()) as u32,
        };
        let (largest, slot) = self
            .neighbours
            .chunks
            .par_iter_mut()
            .enumerate()
            .map_init(Search::default, |search, (c, chunk)| {
                let active = |k: usize| {
                    let i = c * CHUNK + k;
                    let x = grid.periodic.wrap(position[i]);
                    let near = if i < fluid { i < live } else { near_fluid[grid.index(grid.coordinates(x))] };
                    near.then_some((i, x))
                };
                neighbour_list(chunk, active, params, &from, search)
            })
            .reduce(|| (0, 0), |a, b| a.max(b));
        self.counters.neighbours_max = self.counters.neighbours_max.max(largest as u32);
        let most = capacity(params.neighbours);
        if largest > most && self.counters.overflow.is_none() {
            // The first slot with too many, as a device names it.
            let too_many = |i: &usize| self.neighbours.all(*i).neighbour.len() > most;
            let first = (0..groups.pressure()).find(too_many).unwrap_or(slot);
            self.counters.overflow = Some((first as u32, self.counters.neighbours_max));
        }
    }

    fn wall_friction(&mut self, step: &Step) {
        let own = self.own();
        let Self { fields, neighbours, params, groups, live, share, .. } = self;
        let (position, velocity) = (&fields.position, &fields.velocity);
        let on = Particles { params, position, velocity, fluid: groups.fluid };
        let carriers = |i: usize| neighbours.pressure(i).neighbour;
        let at_wall = |i: usize| neighbours.chunks[i / CHUNK].walls[i % CHUNK];
        fields.acceleration.par_iter_mut().enumerate().for_each(|(i, a)| {
            let near = i < *live && at_wall(i);
            *a = if near { wall_friction::wall_friction(i, carriers(i), on, step.dt).0 } else { DVec3::ZERO };
        });
        fields.reaction.par_iter_mut().enumerate().for_each(|(k, f)| {
            let i = groups.fluid + k;
            if owns(share.as_deref(), i) {
                *f += wall_friction::reaction(i, carriers(i), carriers, on, step.dt);
            }
        });
        if let Some(ledger) = &mut self.ledger {
            ledger.kick(Entry::Friction, own, on, &fields.acceleration, step);
        }
        self.apply(step, correct::kick);
        self.show_motion();
    }

    fn collision(&mut self, step: &Step) {
        let own = self.own();
        let Self { fields, neighbours, params, groups, lightness, share, .. } = self;
        let (position, velocity) = (&fields.position, &fields.velocity);
        let on = Particles { params, position, velocity, fluid: groups.fluid };
        let among = collision::Colliding { on, rows: neighbours, lightness };
        let close = |i: usize| neighbours.chunks[i / CHUNK].close[i % CHUNK];
        fields.acceleration.par_iter_mut().enumerate().for_each(|(i, a)| {
            let change = if close(i) { collision::collision(i, among) } else { DVec3::ZERO };
            *a = change / step.dt;
        });
        fields.reaction.par_iter_mut().enumerate().for_each(|(k, f)| {
            let i = groups.fluid + k;
            if close(i) && owns(share.as_deref(), i) {
                *f += collision::reaction(i, among, step.dt);
            }
        });
        if let Some(ledger) = &mut self.ledger {
            ledger.kick(Entry::Collision, own, on, &fields.acceleration, step);
        }
        self.apply(step, correct::kick);
        self.show_motion();
    }

    fn number_density(&mut self) {
        let Self { fields, neighbours, params, groups, live, share, .. } = self;
        let Fields { position, velocity, number_density, state, .. } = fields;
        let on = Particles { params, position, velocity, fluid: groups.fluid };
        (&mut neighbours.chunks, number_density.par_chunks_mut(CHUNK), state.par_chunks_mut(CHUNK))
            .into_par_iter()
            .enumerate()
            .for_each(|(c, (chunk, density, state))| {
                RowArrays::with(|arrays| density_rows(c * CHUNK, *live, chunk, density, state, on, arrays));
            });
        if let Some(share) = share {
            share.swap(&mut [&mut &mut state[..]]);
        }
    }

    fn surface_pressure(&mut self) {
        let Self { fields, neighbours, params, groups, .. } = self;
        let Fields { position, velocity, state, pressure, surface_pressure, .. } = fields;
        let on = Particles { params, position, velocity, fluid: groups.fluid };
        let chunks = surface_pressure.par_chunks_mut(CHUNK).zip(&neighbours.chunks).enumerate();
        chunks.for_each(|(c, (values, chunk))| {
            if chunk.is_dry() {
                // Most walls: nothing is beside them.
                return values.fill(0.0);
            }
            for (k, p) in values.iter_mut().enumerate() {
                let i = c * CHUNK + k;
                *p = surface_pressure::surface_pressure(i, chunk.pressure(k), state, on, pressure);
            }
        });
        if let Some(share) = &self.share {
            share.swap(&mut [&mut &mut surface_pressure[..]]);
        }
    }

    fn pressure_source(&mut self, step: &Step) {
        let Self { fields, neighbours, params, groups, .. } = self;
        let Fields { position, velocity, number_density, state, source, diagonal, surface_pressure, .. } =
            fields;
        let on = Particles { params, position, velocity, fluid: groups.fluid };
        (
            &neighbours.chunks,
            (number_density.par_chunks(CHUNK), state.par_chunks(CHUNK)),
            (source.par_chunks_mut(CHUNK), diagonal.par_chunks_mut(CHUNK)),
        )
            .into_par_iter()
            .enumerate()
            .for_each(|(c, (chunk, given, out))| {
                RowArrays::with(|arrays| {
                    source_rows(c * CHUNK, chunk, given, surface_pressure, out, on, step, arrays);
                });
            });
    }

    /// The free bodies in the pressure equation; takes the forces that are known off its right side.
    fn couple(&mut self) -> Vec<CoupledBody> {
        let (params, fluid, share) = (&self.params, self.groups.fluid, self.share.as_deref());
        let density_over_volume = params.density / params.spacing.powi(3);
        let Fields { state, reaction, source, .. } = &mut self.fields;
        let excess = &self.excess;
        let answers =
            |body: &FreeBody| body.inverse_mass != DVec3::ZERO || body.inverse_inertia != DMat3::ZERO;
        let free = self.solids.iter().zip(&self.poses).zip(&self.free_bodies).enumerate();
        let free: Vec<_> = free.filter(|(_, (_, body))| answers(body)).collect();
        let mut known: Vec<Wrench> = Vec::with_capacity(free.len());
        let mut layers = Vec::with_capacity(free.len());
        for &(k, ((solid, pose), body)) in &free {
            let mut slot = slots::of(&self.slots, k);
            // On many ranks the load is added once, after the sum over them.
            let mut sum = if share.is_some() { Wrench::default() } else { body.load };
            let wall = |(k, i): (usize, usize)| {
                let to_surface = pose.orientation * solid.wall_to_surface[k];
                let arm = pose.orientation * solid.wall_offset[k] + to_surface;
                let reaction = reaction.get(i - fluid).copied().unwrap_or(DVec3::ZERO);
                let slot = slot(k);
                if !owns(share, i) || state[i] != State::Inner {
                    // Of the step's beginning, when it was this rank's.
                    sum += Wrench { force: reaction, torque: arm.cross(reaction) };
                    return Wrench::default();
                }
                let area = pose.orientation * solid.wall_area[k] * (1.0 - slot.taken);
                // What acts at a pressure of zero.
                let known = body_force::surface_pressure(0.0, excess.of(i - fluid), to_surface, params);
                let force = body_force::body_force(known, area, reaction);
                sum += Wrench { force, torque: arm.cross(force) };
                sum += slot.head;
                let mut row = coupling::row(area, arm);
                row += slot.per_pascal;
                row
            };
            layers.push(solid.wall_slots.clone().enumerate().map(wall).collect::<Vec<_>>());
            known.push(sum);
        }
        if let Some(share) = share {
            share.sum_wrenches(&mut known);
            known.iter_mut().zip(&free).for_each(|(known, (_, (_, body)))| *known += body.load);
        }
        let mut out = Vec::with_capacity(free.len());
        for (((_, ((solid, _), body)), known), rows) in free.into_iter().zip(known).zip(layers) {
            let coupled = CoupledBody::new(*body, density_over_volume, solid.wall_slots.clone(), rows);
            coupled.subtract_known(known, source);
            out.push(coupled);
        }
        out
    }

    /// The walls' excess, and what its rows are made of.
    fn wall_excess(&mut self) -> (&mut WallExcess, Rows<'_>, &mut Fields) {
        let Self { fields, neighbours, params, groups, excess, share, .. } = self;
        (excess, Rows { neighbours, params, fluid: groups.fluid, share: share.as_deref() }, fields)
    }

    fn pressure_gradient(&mut self) {
        let Self { fields, neighbours, params, groups, live, ledger, imbalance, .. } = self;
        let Fields { position, velocity, pressure, state, acceleration, .. } = fields;
        let on = Particles { params, position, velocity, fluid: groups.fluid };
        let live = *live;
        let rows = |pressure: &[f64], acceleration: &mut [DVec3], imbalance: &mut [DVec3]| {
            let shifted = imbalance.par_chunks_mut(CHUNK).map(Some);
            let all =
                shifted.chain(rayon::iter::repeat_n((), acceleration.len().div_ceil(CHUNK)).map(|()| None));
            (acceleration.par_chunks_mut(CHUNK), all, &neighbours.chunks, state.par_chunks(CHUNK))
                .into_par_iter()
                .enumerate()
                .for_each(|(c, (a, imbalance, chunk, state))| {
                    let imbalance = imbalance.unwrap_or_default();
                    RowArrays::with(|arrays| {
                        gradient_rows(c * CHUNK, live, chunk, a, imbalance, state, pressure, on, arrays);
                    });
                });
        };
        rows(pressure, acceleration, imbalance);
        if let Some(ledger) = ledger {
            ledger.unclipped.resize(acceleration.len(), DVec3::ZERO);
            rows(&ledger.solution, &mut ledger.unclipped, &mut []);
        }
    }

    fn shift(&mut self, step: &Step) {
        let own = self.own();
        let Self { params, fields, imbalance, ledger, .. } = self;
        let Fields { position, velocity, .. } = fields;
        if let Some(ledger) = ledger {
            let way = |i: usize| shift::shift(imbalance[i], velocity[i], step, params);
            ledger.shift(own.clone(), params, way);
        }
        (&mut position[own.clone()], &velocity[own.clone()], &imbalance[own])
            .into_par_iter()
            .for_each(|(x, &v, &imbalance)| *x += shift::shift(imbalance, v, step, params));
    }

    /// Applies the accelerations `by` [`correct::kick`] or [`correct::correct`].
    fn apply(
        &mut self,
        step: &Step,
        by: impl Fn(DVec3, DVec3, DVec3, &Step, f64) -> (DVec3, DVec3, bool) + Sync,
    ) {
        let (l0, own) = (self.params.spacing, self.own());
        let Fields { position, velocity, acceleration, id, .. } = &mut self.fields;
        let bad = AtomicU32::new(u32::MAX);
        let (position, velocity) = (&mut position[own.clone()], &mut velocity[own.clone()]);
        let clamps: u64 = (position, velocity, &mut acceleration[own.clone()], &id[own])
            .into_par_iter()
            .map(|(x, v, a, &id)| {
                let (x1, v1, clamped) = by(*x, *v, *a, step, l0);
                if !v1.is_finite() {
                    bad.fetch_min(id, Relaxed);
                }
                (*x, *v, *a) = (x1, v1, DVec3::ZERO);
                u64::from(clamped)
            })
            .sum();
        self.counters.displacement_clamps += clamps;
        let bad = bad.into_inner();
        if bad != u32::MAX {
            self.counters.non_finite.get_or_insert(bad);
        }
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
                self.viscosity();
            }
            ParticleStage::Predict => self.predict(step),
            ParticleStage::CellList => self.cell_list(),
            ParticleStage::NeighbourList => self.neighbour_list(),
            ParticleStage::WallFriction => self.wall_friction(step),
            ParticleStage::Collision => self.collision(step),
            ParticleStage::NumberDensity => self.number_density(),
            ParticleStage::SurfacePressure => self.surface_pressure(),
            ParticleStage::PressureSource => self.pressure_source(step),
            ParticleStage::PressureGradient => self.pressure_gradient(),
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
        let emissions = self.emissions_here(emissions);
        for emission in &*emissions {
            (0..emission.wall.len()).for_each(|k| openings::emit(emission, k, &mut self.fields));
        }
        if let Some(share) = self.share.as_mut().filter(|_| !emissions.is_empty()) {
            let slots = emissions.iter().flat_map(|e| e.to..e.to + e.wall.len());
            share.take_in(slots, &mut self.fields, &self.grid);
        }
        if outlets.iter().all(Outlet::is_closed) {
            return Ok(());
        }
        let (sides, n, share) = (self.params.periodic, self.groups.fluid, self.share.as_deref());
        let Fields { position, kind, .. } = &mut self.fields;
        let count = |mut counts: Vec<u64>, (i, (&x, kind)): (usize, (&DVec3, &mut Kind))| {
            if let Some(k) = openings::swallow(sides.wrap(x), outlets).filter(|_| *kind == Kind::Fluid) {
                *kind = Kind::Ghost;
                counts[k] += u64::from(share.is_none_or(|share| share.has(i)));
            }
            counts
        };
        let add = |a: Vec<u64>, b: Vec<u64>| a.iter().zip(b).map(|(a, b)| a + b).collect();
        let none = || vec![0; outlets.len()];
        let particles = (&position[..n], &mut kind[..n]).into_par_iter().enumerate().with_min_len(CHUNK);
        let counts: Vec<u64> = particles.fold(none, count).reduce(none, add);
        self.counters.swallowed.iter_mut().zip(counts).for_each(|(total, count)| *total += count);
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
        let (excess, rows, fields) = self.wall_excess();
        excess.before_solve(rows, fields);
        let bodies = self.couple();
        let Self { fields, neighbours, params, settings, work, multigrid, grid, share, .. } = self;
        let share = share.as_deref();
        let state = match share {
            Some(share) => Cow::Owned(share.masked(&fields.state)),
            None => Cow::Borrowed(&fields.state[..]),
        };
        if share.is_some() {
            let foreign = fields.source.iter_mut().zip(&*state).filter(|(_, state)| **state != State::Inner);
            foreign.for_each(|(b, _)| *b = 0.0);
        }
        if params.filled {
            let mut sums = pressure_level::sum_source(&state, &fields.source);
            if let Some(share) = share {
                share.sum(&mut sums);
            }
            pressure_level::subtract_mean(&state, &mut fields.source, sums);
        }
        let system = System {
            neighbours,
            state: &state,
            diagonal: &fields.diagonal,
            coefficient: laplacian_coefficient(params),
            bodies: &bodies,
            among: share.map(|share| Among { share, state: &fields.state }),
        };
        let preconditioner: &mut dyn Precondition = match multigrid {
            Some(multigrid) => {
                multigrid.build(&system, grid, share.map_or(&fields.position, |share| share.searched()));
                multigrid
            }
            None => &mut Jacobi,
        };
        let report =
            solve_or_fall_back(&system, &fields.source, &mut fields.pressure, preconditioner, settings, work);
        // The solve leaves zero where the pressure is no unknown.
        fields.pressure.iter_mut().zip(&fields.surface_pressure).for_each(|(p, known)| *p += known);
        if params.filled {
            let mut least = pressure_level::lowest(&state, &fields.pressure);
            if let Some(share) = share {
                least = -share.most(-least);
            }
            pressure_level::raise(&state, &mut fields.pressure, least);
        }
        if let Some(share) = share {
            share.swap(&mut [&mut &mut fields.pressure[..]]);
        }
        if let Some(ledger) = &mut self.ledger {
            ledger.solution.clone_from(&fields.pressure);
        }
        let (excess, rows, fields) = self.wall_excess();
        excess.after_solve(rows, fields);
        let Self { fields, share, .. } = self;
        let share = share.as_deref();
        let cut = |(i, p): (usize, &mut f64)| {
            let (high, low) = (*p > step.pressure_max, *p < 0.0);
            *p = p.clamp(0.0, step.pressure_max);
            let counts = owns(share, i);
            [u64::from(high && counts), u64::from(low && counts)]
        };
        let add = |a: [u64; 2], b: [u64; 2]| [a[0] + b[0], a[1] + b[1]];
        let cuts = |(c, p): (usize, &mut [f64])| {
            let slots = c * CHUNK..;
            slots.zip(p).map(cut).fold([0; 2], add)
        };
        let [high, low] = fields.pressure.par_chunks_mut(CHUNK).enumerate().map(cuts).reduce(|| [0; 2], add);
        self.counters.pressure_clamps += high;
        self.counters.negative_pressures += low;
        let (excess, rows, fields) = self.wall_excess();
        excess.after_cut(rows, fields);
        Ok(report)
    }

    fn move_solids(&mut self, poses: &[Pose]) -> Result<()> {
        self.poses.clear();
        self.poses.extend_from_slice(poses);
        for (solid, pose) in self.solids.iter().zip(poses) {
            for (slots, offsets) in
                [(&solid.wall_slots, &solid.wall_offset), (&solid.dummy_slots, &solid.dummy_offset)]
            {
                for (i, &offset) in slots.clone().zip(offsets) {
                    (self.fields.position[i], self.fields.velocity[i]) =
                        move_solids::move_solids(pose, offset);
                }
            }
        }
        Ok(())
    }

    fn body_force(&mut self) -> Result<Vec<Wrench>> {
        let (params, share) = (&self.params, self.share.as_deref());
        let (fields, fluid) = (&mut self.fields, self.groups.fluid);
        let wrenches = self.solids.iter().zip(&self.poses).enumerate().map(|(n, (solid, pose))| {
            let mut slot = slots::of(&self.slots, n);
            let mut total = Wrench::default();
            for (k, i) in solid.wall_slots.clone().enumerate() {
                let own = owns(share, i);
                let slot = slot(k);
                let area = pose.orientation * solid.wall_area[k] * (1.0 - slot.taken);
                let to_surface = pose.orientation * solid.wall_to_surface[k];
                let arm = pose.orientation * solid.wall_offset[k] + to_surface;
                let mut pressure = 0.0;
                if own && fields.state[i] == State::Inner {
                    total.add(fields.pressure[i], &slot.per_pascal);
                    total += slot.head;
                    let excess = self.excess.of(i - fluid);
                    pressure = body_force::surface_pressure(fields.pressure[i], excess, to_surface, params);
                }
                let reaction = fields.reaction.get(i - fluid).copied().unwrap_or(DVec3::ZERO);
                let force = body_force::body_force(pressure, area, reaction);
                total.force += force;
                total.torque += arm.cross(force);
            }
            total
        });
        let mut wrenches: Vec<Wrench> = wrenches.collect();
        if let Some(share) = share {
            share.sum_wrenches(&mut wrenches);
        }
        fields.reaction.fill(DVec3::ZERO);
        Ok(wrenches)
    }

    fn ledger(&mut self) -> Result<Option<Ledger>> {
        let own = self.ledger.as_ref().map(|ledger| ledger.work);
        let Some((share, own)) = self.share.as_ref().zip(own) else { return Ok(own) };
        let mut works = Entry::ALL.map(|entry| own.get(entry));
        share.sum(&mut works);
        let mut all = Ledger::default();
        Entry::ALL.into_iter().zip(works).for_each(|(entry, work)| all.add(entry, work));
        Ok(Some(all))
    }

    fn counters(&mut self) -> Result<Counters> {
        Ok(match &self.share {
            Some(share) => {
                let all = share.gather_all(vec![self.counters.clone()]);
                all.into_iter().reduce(Counters::plus).unwrap_or_default()
            }
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
        let Self { fields, groups, excess, share, .. } = self;
        let of = |i: usize| {
            let wall = i.checked_sub(groups.fluid);
            [fields.pressure[i], wall.map_or(0.0, |wall| excess.of(wall))]
        };
        let told = match share {
            None => slots.iter().map(|&s| of(s)).collect::<Vec<_>>(),
            Some(share) => {
                let here = slots.iter().map(|&s| share.here(s).filter(|&s| share.owns(s)));
                let mut told: Vec<f64> = here.flat_map(|s| s.map_or([0.0; 2], of)).collect();
                share.sum(&mut told);
                told.chunks_exact(2).map(|both| [both[0], both[1]]).collect()
            }
        };
        Ok(told.into_iter().map(|[pressure, excess]| RowPressure { pressure, excess }).collect())
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
