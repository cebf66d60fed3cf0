//! The particles of all ranks in one place: gathered by the first rank, or told by it.

use super::Share;
use crate::error::Result;
use crate::fields::{Fields, State};
use crate::output::particles::Particles;
use crate::output::pieces::{Pieces, Told};
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
    /// Slots of wall layers.
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

/// All particles, for every rank to take its own from.
#[derive(Serialize, Deserialize)]
struct Whole {
    position: Vec<DVec3>,
    velocity: Vec<DVec3>,
    kind: Vec<u8>,
    id: Vec<u32>,
    pressure: Vec<f64>,
    number_density: Vec<f64>,
    inertia_head: Vec<f64>,
    state: Vec<u8>,
    dt: f64,
}

impl Share {
    /// What this rank has of `fields`, encoded.
    fn part(&self, fields: &Fields) -> Vec<u8> {
        let carriers = |values: &[f64]| -> Vec<f64> { self.owned().map(|i| values[i]).collect() };
        let own = self.own();
        let part = Part {
            ids: fields.id[own.clone()].to_vec(),
            motion: own.clone().flat_map(|i| [fields.position[i], fields.velocity[i]]).collect(),
            walls: self.owned().skip(own.len()).map(|i| (i - self.groups.fluid) as u32).collect(),
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
        let part =
            walls.map(|i| ((i - self.groups.fluid) as u32, [fields.pressure[i], fields.number_density[i]]));
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

    /// Fields of all ranks without their water; solids are where they are in `fields`.
    pub fn blank(&self, fields: &Fields) -> Fields {
        let (all, here) = (self.all, self.groups.fluid);
        let lay = |rest: DVec3, solids: &[DVec3]| -> Vec<DVec3> {
            std::iter::repeat_n(rest, all.fluid).chain(solids.iter().copied()).collect()
        };
        let of_surface = if fields.surface_pressure.is_empty() { 0 } else { all.pressure() };
        let parked = std::iter::repeat_n(Kind::Ghost, all.fluid);
        Fields {
            position: lay(self.corner, &fields.position[here..]),
            velocity: lay(DVec3::ZERO, &fields.velocity[here..]),
            kind: parked.chain(fields.kind[here..].iter().copied()).collect(),
            id: vec![0; all.fluid],
            pressure: vec![0.0; all.pressure()],
            number_density: vec![0.0; all.pressure()],
            surface_pressure: vec![0.0; of_surface],
            state: vec![State::Inactive; all.pressure()],
            source: Vec::new(),
            diagonal: Vec::new(),
            // Zero between two steps.
            acceleration: vec![DVec3::ZERO; all.fluid],
            reaction: vec![DVec3::ZERO; fields.reaction.len()],
            inertia_head: vec![0.0; fields.inertia_head.len()],
        }
    }

    /// The first rank's state of a run: `fields` of all particles, given there alone, and the time step.
    pub fn tell_fields(&self, fields: Option<(Fields, f64)>) -> (Fields, f64) {
        let whole = fields.map(|(fields, dt)| Whole {
            kind: fields.kind.iter().map(|&k| k as u8).collect(),
            state: fields.state.iter().map(|&s| s as u8).collect(),
            position: fields.position,
            velocity: fields.velocity,
            id: fields.id,
            pressure: fields.pressure,
            number_density: fields.number_density,
            inertia_head: fields.inertia_head,
            dt,
        });
        let whole: Whole = decode(&self.team.hear(whole.map_or_else(Vec::new, |whole| encode(&whole))));
        let fields = Fields {
            kind: whole.kind.iter().map(|&code| Kind::from_code(code).unwrap_or(Kind::Ghost)).collect(),
            state: whole.state.iter().map(|&code| State::from_code(code).unwrap_or_default()).collect(),
            position: whole.position,
            velocity: whole.velocity,
            id: whole.id,
            pressure: whole.pressure,
            number_density: whole.number_density,
            inertia_head: whole.inertia_head,
            ..Fields::default()
        };
        (fields, whole.dt)
    }

    /// Gives the slots from `n` on that hold no particle the numbers that are left.
    fn name_the_rest(&self, fields: &mut Fields, n: usize) {
        let mut named = vec![false; self.all.fluid];
        fields.id[..n].iter().for_each(|&id| named[id as usize] = true);
        let free = (0..self.all.fluid as u32).filter(|&id| !named[id as usize]);
        fields.id[n..].iter_mut().zip(free).for_each(|(id, free)| *id = free);
    }

    /// The slots `own` of `whole`, the state of all ranks, and its solids into `fields`.
    pub fn take_over(&self, own: &[usize], whole: &Fields, fields: &mut Fields) {
        let (all, here) = (self.all.fluid, self.groups.fluid);
        self.park(fields, 0..here);
        for (n, &i) in own.iter().enumerate() {
            fields.position[n] = whole.position[i];
            fields.velocity[n] = whole.velocity[i];
            fields.pressure[n] = whole.pressure[i];
            fields.number_density[n] = whole.number_density[i];
            fields.state[n] = whole.state[i];
            fields.id[n] = whole.id[i];
            fields.kind[n] = Kind::Fluid;
        }
        fields.position[here..].copy_from_slice(&whole.position[all..]);
        fields.velocity[here..].copy_from_slice(&whole.velocity[all..]);
        fields.pressure[here..].copy_from_slice(&whole.pressure[all..]);
        fields.number_density[here..].copy_from_slice(&whole.number_density[all..]);
        fields.state[here..].copy_from_slice(&whole.state[all..]);
        fields.inertia_head.copy_from_slice(&whole.inertia_head);
    }
}
