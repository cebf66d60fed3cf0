//! Particles on their way into a file: single precision, places where they need it in double, in the order of the scene's groups.

use super::vtu::{Values, vtu};
use crate::body::Pose;
use crate::case::{Encoding, OutputField, OutputRegion};
use crate::fields::Fields;
use crate::periodic::Periodic;
use crate::scene::{Kind, Scene};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Particles of a file or of a picture, one entry a particle in each array; an array that a file does not hold is empty.
#[derive(Clone, Default, Debug)]
pub struct Particles {
    /// Position [m].
    pub position: Vec<[f64; 3]>,
    /// Velocity [m/s].
    pub velocity: Vec<[f32; 3]>,
    /// Pressure [Pa]; 0 for dummies.
    pub pressure: Vec<f32>,
    /// Particle number density n, Eq. (4) [-]; 0 for dummies, and before the first step.
    pub number_density: Vec<f32>,
    /// [`Kind`] as a number.
    pub kind: Vec<u8>,
    /// 0 for fluid and fixed walls, k + 1 for the moving solid k of the scene.
    pub body: Vec<u32>,
    /// Number of the particle in the scene; a fluid particle keeps it throughout the run.
    pub id: Vec<u32>,
}

/// What the pressure-carrying slots of solids tell.
#[derive(Clone, Copy, Debug)]
pub struct Carried<'a> {
    /// The slot that the first number is of.
    pub first: usize,
    /// Pressures [Pa].
    pub pressure: &'a [f64],
    /// Particle number densities n, Eq. (4) [-].
    pub number_density: &'a [f64],
}

impl<'a> Carried<'a> {
    /// That of all particles.
    pub fn of(fields: &'a Fields) -> Self {
        Self { first: 0, pressure: &fields.pressure, number_density: &fields.number_density }
    }

    /// Pressure and number density of a slot; dummies carry neither.
    fn at(&self, slot: usize) -> (f64, f64) {
        let get =
            |values: &[f64]| slot.checked_sub(self.first).and_then(|k| values.get(k)).copied().unwrap_or(0.0);
        (get(self.pressure), get(self.number_density))
    }
}

/// A box of which frames are written, as it lies in its scene.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Region {
    low: DVec3,
    high: DVec3,
    periodic: Periodic,
}

impl Region {
    /// That of a case in its `scene`; in two dimensions y does not count.
    pub fn new(region: &OutputRegion, scene: &Scene) -> Self {
        let (mut low, mut high): (DVec3, DVec3) = (region.min.into(), region.max.into());
        if scene.dimensions == 2 {
            (low.y, high.y) = (-1.0, 1.0);
        }
        Self { low, high, periodic: scene.periodic }
    }

    /// Whether it holds a particle at `x` [m], or an image of it.
    fn holds(&self, x: DVec3) -> bool {
        let x = self.periodic.image_from(self.low, x);
        x.cmpge(self.low).all() && x.cmple(self.high).all()
    }
}

fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

impl Particles {
    fn push(&mut self, at: (DVec3, DVec3), of: (f64, f64), kind: Kind, body: u32, id: usize) {
        self.position.push(at.0.to_array());
        self.velocity.push(single(at.1));
        self.pressure.push(of.0 as f32);
        self.number_density.push(of.1 as f32);
        self.kind.push(kind as u8);
        self.body.push(body);
        self.id.push(id as u32);
    }

    /// The water. Particles that were taken out are left out; the others keep their `id`.
    pub fn fluid(scene: &Scene, fields: &Fields) -> Self {
        Self::water(fields, 0..scene.groups.fluid.min(fields.kind.len()), |x| x)
    }

    /// The water in `slots`, each particle where `place` has it.
    pub fn water(fields: &Fields, slots: Range<usize>, place: impl Fn(DVec3) -> DVec3) -> Self {
        let mut out = Self::default();
        for i in slots {
            if fields.kind[i] == Kind::Fluid {
                let of = (fields.pressure[i], fields.number_density[i]);
                let id = fields.id[i] as usize;
                out.push((place(fields.position[i]), fields.velocity[i]), of, Kind::Fluid, 0, id);
            }
        }
        out
    }

    /// Bodies and moving walls in these poses, wall layers first; `inside` adds their dummies. `carried` holds
    /// the pressures, if the scene is wet.
    pub fn solids(scene: &Scene, poses: &[Pose], carried: Option<Carried>, inside: bool) -> Self {
        let mut out = Self::default();
        for (k, (solid, pose)) in scene.solids.iter().zip(poses).enumerate() {
            let mut push = |offset: DVec3, slot: usize| {
                let arm = pose.orientation * offset;
                let at = (pose.position + arm, pose.velocity + pose.angular_velocity.cross(arm));
                let of = carried.map_or((0.0, 0.0), |c| c.at(slot));
                out.push(at, of, scene.kind[slot], k as u32 + 1, slot);
            };
            solid.wall_slots.clone().zip(&solid.wall_offset).for_each(|(slot, &offset)| push(offset, slot));
            if inside {
                solid
                    .dummy_slots
                    .clone()
                    .zip(&solid.dummy_offset)
                    .for_each(|(slot, &offset)| push(offset, slot));
            }
        }
        out
    }

    /// Walls that never move: their wall layer if `wall`, the layers behind it if `dummy`.
    pub fn walls(scene: &Scene, carried: Option<Carried>, wall: bool, dummy: bool) -> Self {
        let mut out = Self::default();
        let layer = scene.groups.static_wall_range();
        for slot in scene.groups.static_range() {
            if if layer.contains(&slot) { wall } else { dummy } {
                let of = carried.map_or((0.0, 0.0), |c| c.at(slot));
                out.push((scene.position[slot], DVec3::ZERO), of, scene.kind[slot], 0, slot);
            }
        }
        out
    }

    /// Those of them within `region`.
    pub fn within(self, region: &Region) -> Self {
        let inside = |x: &[f64; 3]| region.holds((*x).into());
        let kept: Vec<bool> = self.position.iter().map(inside).collect();
        fn pick<T: Copy>(values: &[T], kept: &[bool]) -> Vec<T> {
            values.iter().zip(kept).filter(|(_, kept)| **kept).map(|(value, _)| *value).collect()
        }
        Self {
            position: pick(&self.position, &kept),
            velocity: pick(&self.velocity, &kept),
            pressure: pick(&self.pressure, &kept),
            number_density: pick(&self.number_density, &kept),
            kind: pick(&self.kind, &kept),
            body: pick(&self.body, &kept),
            id: pick(&self.id, &kept),
        }
    }

    /// The VTU file of these particles at `time` [s], with `fields` beside their positions, which are `double` or single.
    pub fn vtu(&self, time: f64, encoding: Encoding, fields: &[OutputField], double: bool) -> Vec<u8> {
        let asked = OutputField::ALL.into_iter().filter(|field| fields.contains(field));
        let arrays: Vec<(&str, Values)> = asked.map(|field| (name(field), self.values(field))).collect();
        if double {
            return vtu(Values::Place(&self.position), &arrays, time, encoding);
        }
        let single: Vec<[f32; 3]> = self.position.iter().map(|x| x.map(|x| x as f32)).collect();
        vtu(Values::Vector(&single), &arrays, time, encoding)
    }

    /// The values of `field`.
    pub(super) fn values(&self, field: OutputField) -> Values<'_> {
        match field {
            OutputField::Velocity => Values::Vector(&self.velocity),
            OutputField::Pressure => Values::Scalar(&self.pressure),
            OutputField::NumberDensity => Values::Scalar(&self.number_density),
            OutputField::Kind => Values::Byte(&self.kind),
            OutputField::Body => Values::Number(&self.body),
            OutputField::Id => Values::Number(&self.id),
        }
    }

    /// Whether `field` is known of them: a file need not hold it.
    pub fn has(&self, field: OutputField) -> bool {
        self.is_empty() || self.values(field).len() == self.len()
    }

    /// Puts those of another file behind these.
    pub(super) fn append(&mut self, other: Self) {
        self.position.extend(other.position);
        self.velocity.extend(other.velocity);
        self.pressure.extend(other.pressure);
        self.number_density.extend(other.number_density);
        self.kind.extend(other.kind);
        self.body.extend(other.body);
        self.id.extend(other.id);
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }
}

/// What a field is called in a file.
pub fn name(field: OutputField) -> &'static str {
    match field {
        OutputField::Velocity => "Velocity",
        OutputField::Pressure => "Pressure",
        OutputField::NumberDensity => "ParticleNumberDensity",
        OutputField::Kind => "Kind",
        OutputField::Body => "Body",
        OutputField::Id => "Id",
    }
}
