//! The particles of all ranks in one place, and back: fields, frames, states. A state is that of a run on one device, which goes on with it.

use super::{Came, GpuRank, Lists};
use crate::backend::gpu::layout::{self, LEDGER_WIDTH, Remainder, counter, word_of};
use crate::backend::gpu::memory::Sizes;
use crate::backend::gpu::transfer::{kind, packed, packed_places, vector};
use crate::backend::gpu::{archive, buffers};
use crate::backend::{Backend, Counters, Ranked};
use crate::checkpoint::Archive;
use crate::error::Result;
use crate::fields::{Fields, State};
use crate::ledger::{Entry, Ledger};
use crate::output::pieces::Pieces;
use crate::params::Step;
use crate::plan::{Arrays, ParticleStage};
use crate::share::{Share, room};
use glam::DVec3;

impl GpuRank {
    /// What this rank has of the fields.
    fn local(&mut self) -> Result<Fields> {
        let mut fields = self.gpu.read_fields()?;
        self.name_kinds(&mut fields);
        Ok(fields)
    }

    /// Gives solids in fields of this device, which keeps in the place of their kind whose they are, their kind.
    pub(super) fn name_kinds(&self, fields: &mut Fields) {
        let first = self.gpu.groups.fluid;
        fields.kind[first..].copy_from_slice(&self.stem.kind);
    }

    /// The fields of all ranks; only the first one gets them.
    pub(super) fn read_whole(&mut self) -> Result<Fields> {
        let local = self.local()?;
        let mut fields = self.share.gather_fields(&local).unwrap_or_default();
        if !fields.position.is_empty() {
            fields.wrap(&self.share.all(), &self.gpu.params.periodic);
        }
        Ok(fields)
    }

    /// Numbers in the ledger's sums of a device with all particles.
    fn ledger_length_of_all(&self) -> usize {
        let sizes = Sizes { fluid: self.share.all().fluid as u64, ..self.gpu.sizes };
        (LEDGER_WIDTH * sizes.monitor_groups()) as usize
    }
}

/// `value` as a number and what it lacks.
fn in_two(value: f64) -> [f32; 2] {
    let most = value as f32;
    [most, (value - f64::from(most)) as f32]
}

impl Ranked for GpuRank {
    fn share(&self) -> Option<&Share> {
        Some(&self.share)
    }

    fn team_description(&self) -> String {
        let ranks = self.share.ranks();
        format!("{ranks} rank{} on {}", if ranks == 1 { "" } else { "s" }, self.description())
    }

    fn write_piece(&mut self, pieces: &Pieces) -> Result<Vec<u64>> {
        let local = self.local()?;
        self.share.write_piece(pieces, &local, &self.gpu.params.periodic)
    }

    fn read_walls(&mut self) -> Result<[Vec<f64>; 2]> {
        let local = self.local()?;
        Ok(self.share.gather_walls(&local))
    }

    fn keep(&mut self) -> Result<()> {
        let local = self.local()?;
        self.share.keep(&local);
        Ok(())
    }

    fn recall(&mut self) -> Result<Option<Fields>> {
        let local = self.local()?;
        let Some(mut kept) = self.share.gather_kept(&local) else { return Ok(None) };
        kept.wrap(&self.share.all(), &self.gpu.params.periodic);
        Ok(Some(kept))
    }

    fn dt(&self) -> f64 {
        self.gpu.dt
    }

    fn save_all(
        &self,
        archive: &mut Archive,
        fields: Fields,
        mut counters: Counters,
        work: Option<Ledger>,
        mut dt: f64,
    ) -> Result<()> {
        let plan = &self.gpu.plan;
        let scalar = |values: &[f64]| values.iter().map(|&v| v as f32).collect::<Vec<f32>>();
        let number = |i: usize| fields.id.get(i).map_or(0.0, |&id| word_of(id));
        let still = |values: &[DVec3]| packed(values, |_| 0.0);
        archive::save_domain(archive, &self.gpu.params)?;
        archive.array(
            buffers::position.id().name(),
            &mut packed_places(&fields, self.gpu.middle, Remainder::new(&self.gpu.params)),
            false,
        )?;
        archive.array(buffers::velocity.id().name(), &mut packed(&fields.velocity, number), false)?;
        archive.array(buffers::pressure.id().name(), &mut scalar(&fields.pressure), false)?;
        archive.array(buffers::number_density.id().name(), &mut scalar(&fields.number_density), false)?;
        let mut state: Vec<u32> = fields.state.iter().map(|&s| s as u32).collect();
        archive.array(buffers::state.id().name(), &mut state, false)?;
        archive.array(buffers::acceleration.id().name(), &mut still(&fields.acceleration), false)?;
        if plan.needs(Arrays::Coupling) && !fields.inertia_head.is_empty() {
            archive.array(buffers::inertia_head.id().name(), &mut scalar(&fields.inertia_head), false)?;
        }
        if let Some(work) = work {
            // All of it as the sums of the first workgroup; what was lost counts in the entry, not in the number of particles.
            let mass = self.gpu.params.particle_mass();
            let mut sums = vec![[0.0_f32; 2]; self.ledger_length_of_all()];
            let entries = sums.iter_mut().zip(Entry::ALL).take(LEDGER_WIDTH as usize - 1);
            entries.for_each(|(sum, entry)| *sum = in_two(work.get(entry) / mass));
            archive.array(buffers::ledger_sum.id().name(), &mut sums, false)?;
        }
        counters.exchange(archive)?;
        archive.number("dt", &mut dt)
    }

    fn read_all(&mut self, archive: &mut Archive) -> Result<Fields> {
        let (all, plan) = (self.share.all(), self.gpu.plan.clone());
        let position = archive::read_places(archive, &self.gpu.params, all.total())?;
        let velocity = archive::read(archive, buffers::velocity, all.total())?;
        let state = archive::read(archive, buffers::state, all.pressure())?;
        let wide = |v: Vec<f32>| v.into_iter().map(f64::from).collect::<Vec<f64>>();
        let pressure = wide(archive::read(archive, buffers::pressure, all.pressure())?);
        let number_density = wide(archive::read(archive, buffers::number_density, all.pressure())?);
        let heads = if plan.needs(Arrays::Coupling) { all.moving_wall } else { 0 };
        let inertia_head = if archive.holds(buffers::inertia_head.id().name()) {
            wide(archive::read(archive, buffers::inertia_head, heads)?)
        } else {
            vec![0.0; heads]
        };
        self.gpu.context.upload(buffers::counters, &counter::START)?;
        if plan.needs(Arrays::Ledger) && !archive.is_of_another() {
            let sums = archive::read(archive, buffers::ledger_sum, self.ledger_length_of_all())?;
            let width = LEDGER_WIDTH as usize;
            let mut total = vec![0.0; width];
            for part in sums.chunks_exact(width) {
                total
                    .iter_mut()
                    .zip(part)
                    .for_each(|(sum, [s, rest])| *sum += f64::from(*s) + f64::from(*rest));
            }
            let mut own = vec![[0.0_f32; 2]; self.gpu.ledger_length()];
            own.iter_mut().zip(total).for_each(|(sum, total)| *sum = in_two(total));
            self.gpu.context.upload(buffers::ledger_sum, &own)?;
        }
        self.gpu.counters.exchange(archive)?;
        archive.number("dt", &mut self.gpu.dt)?;
        let remainder = Remainder::new(&self.gpu.params);
        Ok(Fields {
            kind: position.iter().map(|x| kind(x[3])).collect(),
            position: position.iter().map(|x| remainder.place(x) + self.gpu.middle).collect(),
            id: velocity[..all.fluid].iter().map(|v| layout::number_of(v[3])).collect(),
            velocity: velocity.iter().map(vector).collect(),
            pressure,
            number_density,
            state: state.iter().map(|&s| State::from_code(s as u8).unwrap_or_default()).collect(),
            inertia_head,
            ..Fields::default()
        })
    }

    fn restore(&mut self, fields: Option<Fields>) -> Result<()> {
        if self.share.rank() > 0 {
            // Those of the first rank are of all since the start of the run.
            self.gpu.counters = Counters::new(self.gpu.counters.swallowed.len());
            self.gpu.context.upload(buffers::counters, &counter::START)?;
            if self.gpu.plan.needs(Arrays::Ledger) {
                self.gpu.context.clear(buffers::ledger_sum)?;
            }
        }
        let (grid, whole) = (self.gpu.grid, fields.map(|fields| (fields, self.gpu.dt)));
        let portion = self.share.portion(whole, &grid, &self.gpu.params);
        self.share.divide_as(&portion);
        let (own, dt) = (portion.water(), portion.dt);
        self.gpu.dt = dt;
        self.poses.clear();
        self.make_room(room(own, self.share.all().fluid))?;
        let mut local = self.local()?;
        self.share.take_over(&portion, &mut local);
        // Zero between two steps.
        local.acceleration.fill(DVec3::ZERO);
        self.gpu.write_fields(&local)?;
        self.share.begin(self.gpu.groups, own, &local, &grid);
        self.walls.are_at(&local.position[super::wall_slots(&self.gpu)]);
        self.starts.clear();
        self.live = self.gpu.groups.fluid;
        (self.came_in, self.came) = (0..0, Came::default());
        self.lists = Lists::default();
        self.set_lists()?;
        if self.gpu.params.viscosity > 0.0 {
            // Viscosity begins the next step with the neighbours of this one.
            self.settle()?;
            self.gpu.cell_list()?;
            self.find_borders()?;
            self.gpu.run(ParticleStage::NeighbourList, &Step { dt, ..self.gpu.params.step(0.0, dt, 0.0) })?;
        }
        Ok(())
    }
}
