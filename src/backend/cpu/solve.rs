//! The pressure equation: bodies in it, the solve, and what is cut off after it.

use super::Cpu;
use super::solids::reaction_on;
use super::team::owns;
use super::wall_excess::{Rows, WallExcess};
use crate::body::slots;
use crate::body::{FreeBody, Mobility, Wrench};
use crate::fields::{Fields, State};
use crate::kernels::pressure_source::laplacian_coefficient;
use crate::kernels::{body_force, pressure_level};
use crate::neighbours::CHUNK;
use crate::params::Step;
use crate::pressure::PressureReport;
use crate::pressure::cg::{Among, Jacobi, Precondition, System, solve_or_fall_back};
use crate::pressure::coupling::CoupledBody;
use rayon::prelude::*;
use std::borrow::Cow;

impl Cpu {
    /// The free bodies in the pressure equation; takes the forces that are known off its right side.
    fn couple(&mut self) -> Vec<CoupledBody> {
        let (params, fluid, share) = (&self.params, self.groups.fluid, self.share.as_deref());
        let density_over_volume = params.density / params.particle_volume();
        let Fields { state, reaction, source, diagonal, .. } = &mut self.fields;
        let link = laplacian_coefficient(params) * params.number_density;
        for slot in self.slots.iter().filter(|slot| slot.seep.link > 0.0) {
            let i = self.solids[slot.solid as usize].wall_slots.start + slot.row as usize;
            if owns(share, i) && state[i] == State::Inner {
                diagonal[i] += link * slot.seep.link;
                source[i] += link * slot.seep.known;
            }
        }
        let excess = &self.excess;
        let answers = |body: &FreeBody| body.mobility != Mobility::default();
        let free = self.solids.iter().zip(&self.poses).zip(&self.free_bodies).enumerate();
        let free: Vec<_> = free.filter(|(_, (_, body))| answers(body)).collect();
        let mut known: Vec<Wrench> = Vec::with_capacity(free.len());
        let mut layers = Vec::with_capacity(free.len());
        for &(k, ((solid, pose), body)) in &free {
            let mut slot = slots::of(&self.slots, k);
            // On many ranks the load is added once, after the sum over them.
            let mut sum = if share.is_some() { Wrench::default() } else { body.load };
            let wall = |(k, i): (usize, usize)| {
                let arm = pose.orientation * (solid.wall_offset[k] + solid.wall_to_surface[k]);
                let reaction = reaction_on(reaction, i - fluid);
                let slot = slot(k);
                if !owns(share, i) || state[i] != State::Inner {
                    // Of the step's beginning, when it was this rank's.
                    sum += Wrench { force: reaction, torque: arm.cross(reaction) };
                    if let Some(pressure) = excess.beside_surface(i - fluid) {
                        sum += slot.pressed(pressure.max(0.0));
                        let known = |way| body_force::beside_surface(pressure, way, params);
                        sum += body_force::on_faces(solid, k, pose, 1.0 - slot.taken, known);
                    }
                    return Wrench::default();
                }
                let part = 1.0 - slot.taken;
                let area = pose.orientation * solid.wall_area[k] * part;
                // What acts at a pressure of zero.
                let known = |way| body_force::surface_pressure(0.0, excess.of(i - fluid), way, params);
                sum += body_force::on_faces(solid, k, pose, part, known);
                let force = reaction + body_force::turning(pose.angular_velocity, area, params);
                sum += Wrench { force, torque: arm.cross(force) };
                sum += slot.head;
                let mut row = body_force::on_faces(solid, k, pose, part, |_| 1.0);
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

    /// Solves the pressure equation, and cuts what is beyond its bounds.
    pub(super) fn conjugate_gradient(&mut self, step: &Step) -> PressureReport {
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
            let (high, low) = (*p > step.pressure_max, *p < step.pressure_min);
            *p = p.clamp(step.pressure_min, step.pressure_max);
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
        report
    }
}
