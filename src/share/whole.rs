//! The particles of all ranks in one place: gathered by the first rank, or told by it.

use super::{Division, Portion, Share};
use crate::cells::Grid;
use crate::error::Result;
use crate::fields::{Fields, State};
use crate::output::particles::Particles;
use crate::output::pieces::{Pieces, Told};
use crate::params::Params;
use crate::periodic::Periodic;
use crate::ranks::{decode, encode};
use crate::scene::Kind;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// What a rank has of the fields: water first, then walls.
#[derive(Serialize, Deserialize)]
struct Part {
    ids: Vec<u32>,
    /// Position and velocity of each particle of water.
    motion: Vec<DVec3>,
    /// Wall layers, by their numbers among those of all ranks.
    walls: Vec<u32>,
    pressure: Vec<f64>,
    number_density: Vec<f64>,
    surface_pressure: Vec<f64>,
    /// Of moving walls among `walls`.
    inertia_head: Vec<f64>,
    state: Vec<u8>,
}

/// What a rank has of the state of an earlier moment.
pub(super) struct Kept {
    /// Its [`Part`] of the particles, encoded.
    part: Vec<u8>,
    /// On the first rank, positions and velocities of the solids that move; the others stay where they are.
    moving: Vec<[DVec3; 2]>,
}

impl Share {
    /// What this rank has of `fields`, encoded.
    fn part(&self, fields: &Fields) -> Vec<u8> {
        let carriers = |values: &[f64]| -> Vec<f64> { self.owned().map(|i| values[i]).collect() };
        let own = self.own();
        let part = Part {
            ids: fields.id[own.clone()].to_vec(),
            motion: own.clone().flat_map(|i| [fields.position[i], fields.velocity[i]]).collect(),
            walls: self
                .owned()
                .skip(own.len())
                .map(|i| self.wall_number(i - self.groups.fluid) as u32)
                .collect(),
            pressure: carriers(&fields.pressure),
            number_density: carriers(&fields.number_density),
            surface_pressure: if fields.surface_pressure.is_empty() {
                Vec::new()
            } else {
                carriers(&fields.surface_pressure)
            },
            inertia_head: self
                .owned()
                .skip(own.len())
                .filter_map(|i| fields.inertia_head.get(i - self.groups.fluid).copied())
                .collect(),
            state: self.owned().map(|i| fields.state[i] as u8).collect(),
        };
        encode(&part)
    }

    /// The fields of all ranks in one, as a single rank would hold them but for the order within a cell. On the first rank
    /// only: the others get none.
    pub fn gather_fields(&self, fields: &Fields) -> Option<Fields> {
        let parts = self.collect(self.part(fields));
        (self.rank() == 0).then(|| self.join(&parts, self.blank(fields)))
    }

    /// Keeps what this rank has of the state as it is now, in the place of what it kept before.
    pub fn keep(&mut self, fields: &Fields) {
        // Two at a time would be one too many: they may be large.
        self.kept = None;
        let first = self.rank() == 0;
        let moving = self.groups.moving_slots().filter(|_| first);
        let moving = moving.map(|i| [fields.position[i], fields.velocity[i]]).collect();
        self.kept = Some(Kept { part: self.part(fields), moving });
    }

    /// The fields of all ranks as they were when they were kept, on the first rank; the others get none. They are kept no longer.
    pub fn gather_kept(&mut self, fields: &Fields) -> Option<Fields> {
        let kept = self.kept.take()?;
        let parts = self.collect(kept.part);
        if self.rank() > 0 {
            return None;
        }
        let mut out = self.blank(fields);
        for (i, [x, v]) in self.all.moving_slots().zip(kept.moving) {
            (out.position[i], out.velocity[i]) = (x, v);
        }
        Some(self.join(&parts, out))
    }

    /// `out`, in which the solids are, with what the `parts` of all ranks hold.
    fn join(&self, parts: &[Vec<u8>], mut out: Fields) -> Fields {
        let mut n = 0;
        for part in parts.iter().map(|bytes| decode::<Part>(bytes)) {
            let water = part.ids.len();
            for (k, motion) in part.motion.chunks_exact(2).enumerate() {
                (out.position[n + k], out.velocity[n + k]) = (motion[0], motion[1]);
                (out.id[n + k], out.kind[n + k]) = (part.ids[k], Kind::Fluid);
            }
            let slots = (n..n + water).chain(part.walls.iter().map(|&k| self.all.fluid + k as usize));
            for (k, i) in slots.enumerate() {
                out.pressure[i] = part.pressure[k];
                out.number_density[i] = part.number_density[k];
                out.state[i] = State::from_code(part.state[k]).unwrap_or_default();
                if let Some(&p) = part.surface_pressure.get(k) {
                    out.surface_pressure[i] = p;
                }
            }
            let moving = part.walls.iter().filter(|&&k| (k as usize) < out.inertia_head.len());
            let heads: Vec<_> = moving.copied().zip(part.inertia_head).collect();
            heads.into_iter().for_each(|(k, head)| out.inertia_head[k as usize] = head);
            n += water;
        }
        self.name_the_rest(&mut out, n);
        out
    }

    /// Pressures and number densities of the wall layers, in the order of their slots. On the first rank only: the others get none.
    pub fn gather_walls(&self, fields: &Fields) -> [Vec<f64>; 2] {
        let walls = self.owned().skip(self.own.len());
        let part = walls.map(|i| {
            let number = self.wall_number(i - self.groups.fluid) as u32;
            (number, [fields.pressure[i], fields.number_density[i]])
        });
        let parts = self.collect(encode(&part.collect::<Vec<_>>()));
        if self.rank() > 0 {
            return Default::default();
        }
        let count = self.all.pressure() - self.all.fluid;
        let mut out = [vec![0.0; count], vec![0.0; count]];
        for (k, values) in parts.iter().flat_map(|bytes| decode::<Vec<(u32, [f64; 2])>>(bytes)) {
            out.iter_mut().zip(values).for_each(|(out, value)| out[k as usize] = value);
        }
        out
    }

    /// Writes the water of this rank as `pieces` says; returns the bytes of each rank's file.
    ///
    /// # Errors
    /// [`crate::Error::Io`] of the first rank that could not, on all of them.
    pub(crate) fn write_piece(
        &self,
        pieces: &Pieces,
        fields: &Fields,
        periodic: &Periodic,
    ) -> Result<Vec<u64>> {
        let water = Particles::water(fields, self.own(), |x| periodic.wrap(x));
        let told = Told::new(pieces.write(self.rank(), water));
        self.gather(encode(&told)).iter().map(|bytes| decode::<Told>(bytes).bytes()).collect()
    }

    /// Fields of all ranks without their water, on the first rank; solids that move are where they are in `fields`.
    pub fn blank(&self, fields: &Fields) -> Fields {
        let (all, here) = (self.all, self.groups);
        let lay = |rest: DVec3, moving: &[DVec3], still: &[DVec3]| -> Vec<DVec3> {
            let (walls, dummies) = (&moving[here.moving_wall_range()], &moving[here.moving_dummy_range()]);
            let solids = walls.iter().chain(still).chain(dummies).copied();
            std::iter::repeat_n(rest, all.fluid).chain(solids).collect()
        };
        let still = self.whole.as_ref().map_or(&[][..], |scene| &scene.position[all.static_range()]);
        let at_rest = vec![DVec3::ZERO; still.len()];
        let kinds = self.whole.as_ref().map_or(&[][..], |scene| &scene.kind[all.fluid..]);
        let of_surface = if fields.surface_pressure.is_empty() { 0 } else { all.pressure() };
        let parked = std::iter::repeat_n(Kind::Ghost, all.fluid);
        Fields {
            position: lay(self.corner, &fields.position, still),
            velocity: lay(DVec3::ZERO, &fields.velocity, &at_rest),
            kind: parked.chain(kinds.iter().copied()).collect(),
            id: vec![0; all.fluid],
            pressure: vec![0.0; all.pressure()],
            number_density: vec![0.0; all.pressure()],
            surface_pressure: vec![0.0; of_surface],
            state: vec![State::Inactive; all.pressure()],
            source: Vec::new(),
            diagonal: Vec::new(),
            // Zero between two steps.
            acceleration: vec![DVec3::ZERO; all.fluid],
            // Begun anew in every step.
            reaction: Vec::new(),
            inertia_head: vec![0.0; fields.inertia_head.len()],
        }
    }

    /// What this rank takes over of the first one's state of a run: `whole`, all particles and the time step, which are given there alone.
    pub fn portion(&self, whole: Option<(Fields, f64)>, grid: &Grid, params: &Params) -> Portion {
        let every_wall = self.still.is_none();
        let Some((fields, dt)) = whole else {
            return decode(&self.team.deal(&mut |_| Vec::new()));
        };
        let particles = (&fields.position[..], &fields.kind[..]);
        let division = Division::new(self.ranks(), self.all, grid, params, particles);
        let of = |rank: usize| Portion::new(rank, &fields, dt, &division, every_wall);
        self.team.deal(&mut |rank| encode(&of(rank)));
        of(0)
    }

    /// Gives the slots from `n` on that hold no particle the numbers that are left.
    fn name_the_rest(&self, fields: &mut Fields, n: usize) {
        let mut named = vec![false; self.all.fluid];
        fields.id[..n].iter().for_each(|&id| named[id as usize] = true);
        let free = (0..self.all.fluid as u32).filter(|&id| !named[id as usize]);
        fields.id[n..].iter_mut().zip(free).for_each(|(id, free)| *id = free);
    }

    /// The cuts of `portion`, and the walls that never move and are here then; [`Self::take_over`] follows when they have slots.
    pub fn divide_as(&mut self, portion: &Portion) {
        self.cuts.clone_from(&portion.cuts);
        self.still.clone_from(&portion.still);
    }

    /// `portion` into `fields`, which have its solids and at least as many slots for water.
    pub fn take_over(&self, portion: &Portion, fields: &mut Fields) {
        let (here, n) = (self.groups.fluid, portion.groups.fluid);
        self.park(fields, 0..here);
        let carriers = portion.state.iter().map(|&code| State::from_code(code).unwrap_or_default());
        let state: Vec<State> = carriers.collect();
        for (to, from) in [(0, 0..n), (here, n..portion.groups.pressure())] {
            let slots = to..to + from.len();
            fields.pressure[slots.clone()].copy_from_slice(&portion.pressure[from.clone()]);
            fields.number_density[slots.clone()].copy_from_slice(&portion.number_density[from.clone()]);
            fields.state[slots].copy_from_slice(&state[from]);
        }
        for (to, from) in [(0, 0..n), (here, n..portion.position.len())] {
            let slots = to..to + from.len();
            fields.position[slots.clone()].copy_from_slice(&portion.position[from.clone()]);
            fields.velocity[slots].copy_from_slice(&portion.velocity[from]);
        }
        fields.id[..n].copy_from_slice(&portion.id);
        fields.kind[..n].fill(Kind::Fluid);
        fields.inertia_head.copy_from_slice(&portion.inertia_head);
    }
}
