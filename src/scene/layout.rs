//! Laying particles out in groups, see [`Groups`].

use super::build::Builder;
use super::jitter::jitter;
use super::{Drive, Groups, Kind, Scene, Solid};
use glam::{DVec3, IVec3};

impl Builder<'_> {
    /// Lays the particles out in their groups, with slots for `reserve` more of water.
    pub(super) fn assemble(self, domain: (DVec3, DVec3), reserve: usize) -> Scene {
        let gravity = self.gravity();
        let openings = self.number_openings();
        let mut solids: Vec<Solid> = self.bodies.into_iter().chain(self.moving_walls).collect();
        let count = |f: fn(&Solid) -> usize| solids.iter().map(f).sum();
        let groups = Groups {
            fluid: self.water.cell.len() + reserve,
            moving_wall: count(|s| s.wall_offset.len()),
            static_wall: self.fixed.wall.len(),
            static_dummy: self.fixed.dummy.len(),
            moving_dummy: count(|s| s.dummy_offset.len()),
        };
        let total = groups.total();
        let mut layout = Layout {
            position: Vec::with_capacity(total),
            velocity: Vec::with_capacity(total),
            kind: Vec::with_capacity(total),
            solid: Vec::with_capacity(total),
        };
        let (most, seed) = self.case.fluid.as_ref().map_or((0.0, 0), |f| (f.jitter, f.seed));
        for (&c, &v) in self.water.cell.iter().zip(&self.water.velocity) {
            let mut at = self.lattice.center(c);
            if most > 0.0 {
                at += jitter(c, seed, most * self.lattice.spacing);
                at.y = if self.lattice.plane { 0.0 } else { at.y };
            }
            layout.push(at, v, Kind::Fluid, 0);
        }
        (0..reserve).for_each(|_| layout.push(domain.0, DVec3::ZERO, Kind::Ghost, 0));
        for (k, solid) in solids.iter_mut().enumerate() {
            let kind = if solid.is_body { Kind::BodyWall } else { Kind::Wall };
            solid.wall_slots = layout.push_offsets(solid, &solid.wall_offset, kind, k);
        }
        for &p in &self.fixed.wall {
            layout.push(p, DVec3::ZERO, Kind::Wall, 0);
        }
        for &p in &self.fixed.dummy {
            layout.push(p, DVec3::ZERO, Kind::Dummy, 0);
        }
        for (k, solid) in solids.iter_mut().enumerate() {
            let kind = if solid.is_body { Kind::BodyDummy } else { Kind::Dummy };
            solid.dummy_slots = layout.push_offsets(solid, &solid.dummy_offset, kind, k);
        }
        Scene {
            dimensions: self.case.run.dimensions,
            spacing: self.lattice.spacing,
            node: self.lattice.center(IVec3::ZERO),
            gravity,
            position: layout.position,
            velocity: layout.velocity,
            kind: layout.kind,
            solid: layout.solid,
            groups,
            reserve,
            openings,
            solids,
            walls: self.fixed.shapes,
            static_wall_normal: self.fixed.normal,
            static_wall_shape: self.fixed.shape_of,
            domain,
            periodic: self.periodic,
            depth: self.depth,
            filled: self.filled,
            full: self.full,
            uneven: false,
            notes: self.notes,
        }
    }
}

/// The particle arrays while they grow.
struct Layout {
    position: Vec<DVec3>,
    velocity: Vec<DVec3>,
    kind: Vec<Kind>,
    solid: Vec<u32>,
}

impl Layout {
    fn push(&mut self, position: DVec3, velocity: DVec3, kind: Kind, solid: u32) {
        self.position.push(position);
        self.velocity.push(velocity);
        self.kind.push(kind);
        self.solid.push(solid);
    }
    /// Particles of solid `k`, moving with it; returns their slots.
    fn push_offsets(
        &mut self,
        solid: &Solid,
        offsets: &[DVec3],
        kind: Kind,
        k: usize,
    ) -> std::ops::Range<usize> {
        let from = self.position.len();
        for &offset in offsets {
            let arm = solid.orientation * offset;
            let velocity = match &solid.drive {
                Drive::Free(free) => free.velocity + free.angular_velocity.cross(arm),
                Drive::Prescribed(motion) => {
                    let (velocity, spin) = motion.velocity(0.0);
                    velocity + spin.cross(arm)
                }
            };
            self.push(solid.position + arm, velocity, kind, k as u32 + 1);
        }
        from..self.position.len()
    }
}
