//! Solids: where they are, and the forces on them.

use super::Cpu;
use super::team::owns;
use crate::body::slots;
use crate::body::{Pose, Wrench};
use crate::fields::State;
use crate::kernels::body_force::{self, RowPressure};
use crate::kernels::move_solids;
use glam::DVec3;

/// [`crate::fields::Fields::reaction`] of a wall, 0 where it is not kept [N].
pub(super) fn reaction_on(reaction: &[DVec3], wall: usize) -> DVec3 {
    reaction.get(wall).copied().unwrap_or_default()
}

impl Cpu {
    /// Moves the particles of solids to `poses`.
    pub(super) fn place_solids(&mut self, poses: &[Pose]) {
        self.poses.clear();
        self.poses.extend_from_slice(poses);
        self.outward.clear();
        let turned = self
            .solids
            .iter()
            .zip(poses)
            .flat_map(|(s, pose)| s.wall_slots.clone().map(|_| pose.orientation));
        self.outward.extend(self.facing.iter().zip(turned).map(|(&facing, turn)| turn * facing));
        if !self.surface_velocity.is_empty() {
            self.surface_velocity.clear();
            for (solid, pose) in self.solids.iter().zip(poses) {
                let rows = solid.wall_offset.iter().zip(&solid.wall_to_surface);
                let velocity = rows.map(|(&offset, &way)| move_solids::on_surface(pose, offset, way));
                self.surface_velocity.extend(velocity);
            }
        }
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
    }

    /// Plays `stage` with wall layers of moving solids that move as the surface before them, if that makes a difference.
    pub(super) fn on_surfaces(&mut self, stage: impl FnOnce(&mut Self)) {
        self.swap_surfaces();
        stage(self);
        self.swap_surfaces();
    }

    fn swap_surfaces(&mut self) {
        let Self { fields, surface_velocity, groups, poses, .. } = self;
        if !poses.is_empty() {
            let walls = groups.fluid..groups.fluid + surface_velocity.len();
            fields.velocity[walls].swap_with_slice(surface_velocity);
        }
    }

    /// Force of the water on this rank's part of each solid.
    pub(super) fn sum_forces(&self) -> Vec<Wrench> {
        let (params, share) = (&self.params, self.share.as_deref());
        let (fields, fluid) = (&self.fields, self.groups.fluid);
        let wrenches = self.solids.iter().zip(&self.poses).enumerate().map(|(n, (solid, pose))| {
            let mut slot = slots::of(&self.slots, n);
            let mut total = Wrench::default();
            for (k, i) in solid.wall_slots.clone().enumerate() {
                let own = owns(share, i);
                let slot = slot(k);
                let area = pose.orientation * solid.wall_area[k] * (1.0 - slot.taken);
                let arm = pose.orientation * (solid.wall_offset[k] + solid.wall_to_surface[k]);
                let mut reaction = reaction_on(&fields.reaction, i - fluid);
                if own && fields.state[i] == State::Inner {
                    total += slot.pressed(fields.pressure[i]);
                    let excess = self.excess.of(i - fluid);
                    let pressure =
                        |way| body_force::surface_pressure(fields.pressure[i], excess, way, params);
                    total += body_force::on_faces(solid, k, pose, 1.0 - slot.taken, pressure);
                    reaction += body_force::turning(pose.angular_velocity, area, params);
                } else if let Some(pressure) = self.excess.beside_surface(i - fluid) {
                    total += slot.pressed(pressure.max(0.0));
                    let pressure = |way| body_force::beside_surface(pressure, way, params);
                    total += body_force::on_faces(solid, k, pose, 1.0 - slot.taken, pressure);
                }
                total += Wrench { force: reaction, torque: arm.cross(reaction) };
            }
            total
        });
        wrenches.collect()
    }

    /// Pressures of the wall particles `slots` as far as they are this rank's, else zero.
    pub(super) fn own_pressures(&self, slots: &[usize]) -> Vec<RowPressure> {
        let of = |i: usize| {
            let pressure = self.fields.pressure[i];
            i.checked_sub(self.groups.fluid).map_or(RowPressure { pressure, ..Default::default() }, |wall| {
                let (excess, reaction) = (self.excess.of(wall), reaction_on(&self.fields.reaction, wall));
                RowPressure { pressure, excess, reaction }
            })
        };
        let own = |&s: &usize| match &self.share {
            None => of(s),
            Some(share) => share.here(s).filter(|&s| share.owns(s)).map(of).unwrap_or_default(),
        };
        slots.iter().map(own).collect()
    }
}
