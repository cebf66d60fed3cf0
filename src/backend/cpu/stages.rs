//! The stages of a step over the particles: each a kernel over all cores, and what ranks show each other after it.

use super::Cpu;
use super::number_density::density_rows;
use super::pressure_gradient::gradient_rows;
use super::pressure_source::source_rows;
use super::row_arrays::RowArrays;
use super::search::{Candidates, Search, neighbour_list};
use super::team::owns;
use super::viscosity::{self, viscosity_rows};
use crate::fields::Fields;
use crate::kernels::neighbour_list::Outward;
use crate::kernels::openings::{Emission, Outlet};
use crate::kernels::{
    Particles, absorber, cell_list, collision, correct, openings, predict, shift, surface_pressure,
    wall_friction,
};
use crate::ledger::Entry;
use crate::neighbours::CHUNK;
use crate::params::Step;
use crate::plan::Stage;
use crate::scene::Kind;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Tells a wall's particle what a stage does to it, if anything [N]; the `first` stage of a step forgets what the last step told.
fn react(force: &mut DVec3, told: Option<DVec3>, first: bool) {
    if first {
        *force = DVec3::ZERO;
    }
    *force += told.unwrap_or(DVec3::ZERO);
}

impl Cpu {
    pub(super) fn viscosity(&mut self) {
        let Self { fields, neighbours, params, groups, share, .. } = self;
        if neighbours.pairs() == 0 {
            // As at the start, and where the water has gone.
            return fields.reaction.fill(DVec3::ZERO);
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

    pub(super) fn absorber(&mut self, dt: f64) {
        let (params, own) = (&self.params, self.own());
        let Fields { position, velocity, .. } = &mut self.fields;
        if let Some(ledger) = &mut self.ledger {
            let slowed = |i: usize| absorber::absorber(position[i], velocity[i], params, dt);
            ledger.absorber(own.clone(), params, velocity, slowed);
        }
        (&position[own.clone()], &mut velocity[own])
            .into_par_iter()
            .for_each(|(&x, v)| *v = absorber::absorber(x, *v, params, dt));
    }

    pub(super) fn predict(&mut self, step: &Step) {
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

    pub(super) fn cell_list(&mut self) {
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
            list.index(grid, groups.moving_slots(), &fields.position, scratch);
            let place = |&s: &u32| grid.periodic.wrap(fields.position[s as usize]);
            coordinates.set(list.slot.par_iter().map(place));
        }
        if let Some(share) = share {
            let solids = [&self.moving, &self.fixed].map(|list| list.as_ref().map(|(list, _)| list));
            share.find_borders(grid, fluid_start, solids);
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

    pub(super) fn neighbour_list(&mut self) {
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
            outward: Outward { first: groups.fluid, of: &self.outward },
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
                    let beside_water = |c: [u32; 3]| grid.holds(c[0]) && near_fluid[grid.index(c)];
                    let near = if i < fluid { i < live } else { beside_water(grid.coordinates(x)) };
                    near.then_some((i, x))
                };
                neighbour_list(chunk, active, params, &from, search)
            })
            .reduce(|| (0, 0), |a, b| a.max(b));
        self.counters.neighbours_max = self.counters.neighbours_max.max(largest as u32);
        let most = params.row_capacity;
        if largest > most && self.counters.overflow.is_none() {
            // The first slot with too many, as a device names it.
            let too_many = |i: &usize| self.neighbours.all(*i).neighbour.len() > most;
            let first = (0..groups.pressure()).find(too_many).unwrap_or(slot);
            self.counters.overflow = Some((first as u32, self.counters.neighbours_max));
        }
    }

    pub(super) fn wall_friction(&mut self, step: &Step) {
        let own = self.own();
        let Self { fields, neighbours, params, groups, live, share, first_reacting, wall_weights, .. } = self;
        let Fields { position, velocity, acceleration, reaction, .. } = fields;
        let on = Particles { params, position, velocity, fluid: groups.fluid };
        let carriers = |i: usize| neighbours.pressure(i).neighbour;
        let at_wall = |i: usize| neighbours.chunks[i / CHUNK].walls[i % CHUNK];
        wall_weights.resize(acceleration.len(), 0.0);
        (&mut *acceleration, &mut *wall_weights).into_par_iter().enumerate().for_each(|(i, (a, weights))| {
            let near = i < *live && at_wall(i);
            let none = (DVec3::ZERO, 0.0);
            (*a, *weights) =
                if near { wall_friction::wall_friction(i, carriers(i), on, step.dt) } else { none };
        });
        let first = *first_reacting == Some(Stage::WallFriction);
        let friction = |i: usize| (acceleration[i], wall_weights[i]);
        reaction.par_iter_mut().enumerate().for_each(|(k, f)| {
            let i = groups.fluid + k;
            let told =
                owns(share.as_deref(), i).then(|| wall_friction::reaction(i, carriers(i), friction, on));
            react(f, told, first);
        });
        if let Some(ledger) = &mut self.ledger {
            ledger.kick(Entry::Friction, own, on, acceleration, step);
        }
        self.apply(step, correct::kick);
        self.show_motion();
    }

    pub(super) fn collision(&mut self, step: &Step) {
        let own = self.own();
        let Self { fields, neighbours, params, groups, lightness, share, first_reacting, .. } = self;
        let (position, velocity) = (&fields.position, &fields.velocity);
        let on = Particles { params, position, velocity, fluid: groups.fluid };
        let among = collision::Colliding { on, rows: neighbours, lightness };
        let close = |i: usize| neighbours.chunks[i / CHUNK].close[i % CHUNK];
        fields.acceleration.par_iter_mut().enumerate().for_each(|(i, a)| {
            let change = if close(i) { collision::collision(i, among) } else { DVec3::ZERO };
            *a = change / step.dt;
        });
        let first = *first_reacting == Some(Stage::Collision);
        fields.reaction.par_iter_mut().enumerate().for_each(|(k, f)| {
            let i = groups.fluid + k;
            let collides = close(i) && owns(share.as_deref(), i);
            react(f, collides.then(|| collision::reaction(i, among, step.dt)), first);
        });
        if let Some(ledger) = &mut self.ledger {
            ledger.kick(Entry::Collision, own, on, &fields.acceleration, step);
        }
        self.apply(step, correct::kick);
        self.show_motion();
    }

    pub(super) fn number_density(&mut self) {
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

    pub(super) fn surface_pressure(&mut self) {
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

    pub(super) fn pressure_source(&mut self, step: &Step) {
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

    pub(super) fn pressure_gradient(&mut self, dt: f64) {
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
                        gradient_rows(c * CHUNK, live, chunk, a, imbalance, state, pressure, on, dt, arrays);
                    });
                });
        };
        rows(pressure, acceleration, imbalance);
        if let Some(ledger) = ledger {
            ledger.unclipped.resize(acceleration.len(), DVec3::ZERO);
            rows(&ledger.solution, &mut ledger.unclipped, &mut []);
        }
    }

    pub(super) fn shift(&mut self, step: &Step) {
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
    pub(super) fn apply(
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

    pub(super) fn openings(&mut self, emissions: &[Emission], outlets: &[Outlet]) {
        let emissions = self.emissions_here(emissions);
        for emission in &*emissions {
            (0..emission.wall.len()).for_each(|k| openings::emit(emission, k, &mut self.fields));
        }
        if let Some(share) = self.share.as_mut().filter(|_| !emissions.is_empty()) {
            let slots = emissions.iter().flat_map(|e| e.to..e.to + e.wall.len());
            share.take_in(slots, &mut self.fields, &self.grid);
        }
        if outlets.iter().all(Outlet::is_closed) {
            return;
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
    }
}
