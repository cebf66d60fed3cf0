//! Particles on their way into a file: single precision, in the order of the scene's groups.

use super::vtu::{Values, vtu};
use crate::body::Pose;
use crate::case::Encoding;
use crate::fields::Fields;
use crate::scene::{Kind, Scene};
use glam::DVec3;

/// Particles of a file or of a picture, one entry a particle in each array.
#[derive(Clone, Default, Debug)]
pub struct Particles {
    /// Position [m].
    pub position: Vec<[f32; 3]>,
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

fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

impl Particles {
    fn push(&mut self, at: (DVec3, DVec3), of: (f64, f64), kind: Kind, body: u32, id: usize) {
        self.position.push(single(at.0));
        self.velocity.push(single(at.1));
        self.pressure.push(of.0 as f32);
        self.number_density.push(of.1 as f32);
        self.kind.push(kind as u8);
        self.body.push(body);
        self.id.push(id as u32);
    }

    /// The water. Particles that were taken out are left out; the others keep their `id`.
    pub fn fluid(scene: &Scene, fields: &Fields) -> Self {
        let mut out = Self::default();
        for i in 0..scene.groups.fluid.min(fields.kind.len()) {
            if fields.kind[i] == Kind::Fluid {
                let of = (fields.pressure[i], fields.number_density[i]);
                let id = fields.id[i] as usize;
                out.push((fields.position[i], fields.velocity[i]), of, Kind::Fluid, 0, id);
            }
        }
        out
    }

    /// Bodies and moving walls in these poses, wall layers first; `inside` adds their dummies. `fields` holds
    /// the pressures, if the scene is wet.
    pub fn solids(scene: &Scene, poses: &[Pose], fields: Option<&Fields>, inside: bool) -> Self {
        let mut out = Self::default();
        for (k, (solid, pose)) in scene.solids.iter().zip(poses).enumerate() {
            let mut push = |offset: DVec3, slot: usize| {
                let arm = pose.orientation * offset;
                let at = (pose.position + arm, pose.velocity + pose.angular_velocity.cross(arm));
                let of = fields.map_or((0.0, 0.0), |f| carried(f, slot));
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
    pub fn walls(scene: &Scene, fields: Option<&Fields>, wall: bool, dummy: bool) -> Self {
        let mut out = Self::default();
        let layer = scene.groups.static_wall_range();
        for slot in scene.groups.static_range() {
            if if layer.contains(&slot) { wall } else { dummy } {
                let of = fields.map_or((0.0, 0.0), |f| carried(f, slot));
                out.push((scene.position[slot], DVec3::ZERO), of, scene.kind[slot], 0, slot);
            }
        }
        out
    }

    /// The VTU file of these particles at `time` [s].
    pub fn vtu(&self, time: f64, encoding: Encoding) -> Vec<u8> {
        let fields = [
            ("Velocity", Values::Vector(&self.velocity)),
            ("Pressure", Values::Scalar(&self.pressure)),
            ("ParticleNumberDensity", Values::Scalar(&self.number_density)),
            ("Kind", Values::Byte(&self.kind)),
            ("Body", Values::Number(&self.body)),
            ("Id", Values::Number(&self.id)),
        ];
        vtu(&self.position, &fields, time, encoding)
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

/// Pressure and number density of a slot; dummies carry neither.
fn carried(fields: &Fields, slot: usize) -> (f64, f64) {
    let get = |values: &[f64]| values.get(slot).copied().unwrap_or(0.0);
    (get(&fields.pressure), get(&fields.number_density))
}
