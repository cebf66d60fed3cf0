//! Solids on the device: where they are, what is free to move, and the forces on them.

use super::stretches::Stretches;
use super::{Gpu, buffers, groups, kernels, layout};
use crate::body::slots::SlotRow;
use crate::body::{FreeBody, Mobility, Pose, Wrench};
use crate::error::Result;
use crate::kernels::body_force::RowPressure;
use crate::kernels::pressure_source::laplacian_coefficient;
use crate::plan::{Arrays, Stage};
use glam::{DMat3, DVec3, Vec3};
use std::collections::BTreeMap;

/// Rows of moving walls at slots, by their numbers, as the device holds them; zeros stand for those at no slot, also
/// before the first upload.
pub(super) type SlotRows = BTreeMap<usize, [[f32; 4]; 4]>;

/// What makes the device hold `now` where it holds `before`: the first of each stretch of rows, and the rows of it.
fn changes(before: &SlotRows, now: &SlotRows) -> Vec<(usize, Vec<[[f32; 4]; 4]>)> {
    let gone = before.keys().filter(|row| !now.contains_key(row));
    let changed = now.iter().filter(|(row, values)| before.get(row) != Some(values)).map(|(row, _)| row);
    let changed: Vec<usize> = gone.chain(changed).copied().collect();
    let rows = |(first, count)| {
        let values = (first..first + count).map(|row| now.get(&row).copied().unwrap_or_default());
        (first, values.collect())
    };
    Stretches::of(&changed).iter().map(rows).collect()
}

impl Gpu {
    /// Free bodies and rows at slots for the next solves.
    pub(super) fn show_free_bodies(&mut self, bodies: &[FreeBody], slots: &[SlotRow]) -> Result<()> {
        let p = &self.params;
        let factor = p.density / p.particle_volume() / laplacian_coefficient(p);
        let with = |v: DVec3, w: f64| v.as_vec3().extend(w as f32).to_array();
        let four = |v: DVec3| with(v, 0.0);
        let device = |(solid, (body, &(first, count))): (usize, (&FreeBody, &(usize, usize)))| {
            // Arms are counted in spacings: in metres what turns a body of microns is beyond f32.
            let columns = |m: DMat3| [four(m.x_axis), four(m.y_axis), four(m.z_axis)];
            layout::FreeBody {
                moves: columns(factor * body.mobility.moves),
                crosses: columns(factor * p.spacing * body.mobility.crosses),
                turns: columns(factor * p.spacing.powi(2) * body.mobility.turns),
                force: four(body.load.force),
                torque: four(body.load.torque / p.spacing),
                first: first as u32,
                count: count as u32,
                solid: solid as u32,
                bodies: 0,
            }
        };
        let of = bodies.iter().zip(&self.wall_layers).enumerate();
        // Through slots of a body that is held water seeps as well.
        let seeps = |k: usize| slots.iter().any(|slot| slot.solid as usize == k && slot.seep.link > 0.0);
        let free = of.filter(|(k, (b, _))| b.mobility != Mobility::default() || seeps(*k));
        let mut free: Vec<_> = free.map(device).collect();
        let count = free.len() as u32;
        free.iter_mut().for_each(|body| body.bodies = count);
        self.context.begin(Some(Stage::ConjugateGradient));
        if !free.is_empty() {
            self.context.upload(buffers::free_body, &free)?;
        }
        // Water in slots presses on a body that is held as well.
        let device = |slot: &SlotRow| {
            [
                with(slot.per_pascal.force, slot.taken),
                with(slot.per_pascal.torque, p.number_density * slot.seep.link),
                with(slot.head.force, p.number_density * slot.seep.known),
                four(slot.head.torque),
            ]
        };
        let row = |slot: &SlotRow| self.wall_layers[slot.solid as usize].0 + slot.row as usize;
        let now: SlotRows = slots.iter().map(|slot| (row(slot), device(slot))).collect();
        for (first, rows) in changes(&self.slot_rows, &now) {
            let at = (first * size_of_val(&rows[0])) as u64;
            self.context.upload_to(buffers::coupling.id(), at, bytemuck::cast_slice(&rows))?;
        }
        self.slot_rows = now;
        self.forget_rows(free.iter().map(|body| body.solid as usize).collect())
    }

    /// Clears the rows of bodies that were in the last solve and are not among the `coupled` of the next: nothing makes them anew, and
    /// they would take the answer of another body for theirs.
    fn forget_rows(&mut self, coupled: Vec<usize>) -> Result<()> {
        for &k in self.coupled.iter().filter(|k| coupled.binary_search(k).is_err()) {
            let (first, count) = self.wall_layers[k];
            let at = (4 * self.groups.moving_wall + 2 * first) as u64 * buffers::coupling.size();
            let none = vec![[0.0_f32; 4]; 2 * count];
            if count > 0 {
                self.context.upload_to(buffers::coupling.id(), at, bytemuck::cast_slice(&none))?;
            }
        }
        self.coupled = coupled;
        Ok(())
    }

    /// Moves the particles of solids to `poses`.
    pub(super) fn show_poses(&mut self, poses: &[Pose]) -> Result<()> {
        if !self.plan.needs(Arrays::Solids) {
            return Ok(());
        }
        let four = |v: DVec3| v.as_vec3().extend(0.0).to_array();
        let device = |p: &Pose| layout::Pose {
            position: four(p.position - self.middle),
            orientation: p.orientation.as_quat().to_array(),
            velocity: four(p.velocity),
            angular_velocity: four(p.angular_velocity),
        };
        let poses: Vec<_> = poses.iter().map(device).collect();
        self.posed = true;
        self.context.begin(Some(Stage::MoveSolids));
        self.context.upload(buffers::poses, &poses)?;
        self.context.pass([(kernels::move_solids::move_solids, groups(self.sizes.moving))])
    }

    /// Force of the water on each solid, and pressures of the wall particles `rows`, in one wait.
    pub(super) fn sum_forces(&mut self, rows: &[usize]) -> Result<(Vec<Wrench>, Vec<RowPressure>)> {
        let mut total = vec![Wrench::default(); self.solids];
        if self.chunk_solid.is_empty() {
            return Ok((total, self.read_wall_pressures(rows)?));
        }
        let chunks = self.chunk_solid.len();
        self.context.begin(Some(Stage::BodyForce));
        self.context.pass([(kernels::body_force::body_force, chunks as u64)])?;
        let bytes = 2 * chunks as u64 * buffers::wrench.size();
        let stretches = Stretches::of(rows);
        let mut parts = vec![(buffers::wrench.id(), 0, bytes)];
        parts.extend(self.wall_parts(&stretches));
        let read = self.context.download_bytes(&parts, false)?;
        let (wrenches, pressures) = read.split_at(bytes as usize);
        let parts: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(wrenches);
        let vector = |v: &[f32; 4]| Vec3::new(v[0], v[1], v[2]).as_dvec3();
        for (&solid, part) in self.chunk_solid.iter().zip(parts.chunks_exact(2)) {
            total[solid].force += vector(&part[0]);
            total[solid].torque += vector(&part[1]);
        }
        Ok((total, self.wall_told(rows, &stretches, pressures)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_have_not_changed_are_not_sent_again() {
        let rows = |rows: &[(usize, f32)]| -> SlotRows {
            rows.iter().map(|&(row, value)| (row, [[value, 1.0, 0.0, -value]; 4])).collect()
        };
        let mut device = vec![[[0.0_f32; 4]; 4]; 2000];
        let mut before = SlotRows::new();
        for (now, sent) in [
            (rows(&[]), 0),
            (rows(&[(5, 1.0), (7, 2.0), (1500, 3.0)]), 4),
            (rows(&[(5, 1.0), (7, 2.0), (1500, 3.0)]), 0),
            (rows(&[(5, 1.0), (7, 2.5), (1500, 3.0)]), 1),
            // The one between two that change is sent as it is.
            (rows(&[(6, 4.0), (7, 2.5), (1500, 3.0)]), 2),
            (rows(&[(8, 1.0)]), 4),
            (rows(&[]), 1),
        ] {
            let parts = changes(&before, &now);
            assert_eq!(parts.iter().map(|p| p.1.len()).sum::<usize>(), sent, "{before:?} to {now:?}");
            for (first, rows) in parts {
                device[first..first + rows.len()].copy_from_slice(&rows);
            }
            let held = device.iter().enumerate().filter(|(_, values)| **values != <[[f32; 4]; 4]>::default());
            assert_eq!(held.map(|(row, values)| (row, *values)).collect::<SlotRows>(), now);
            before = now;
        }
    }
}
