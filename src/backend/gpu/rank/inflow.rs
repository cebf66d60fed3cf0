//! Water that comes in through an opening: each host knows where, and gives its device what is in its columns.

use super::GpuRank;
use super::settle::Carried;
use crate::backend::gpu::buffers;
use crate::backend::gpu::layout::{number_of, word_of};
use crate::backend::gpu::transfer::kind;
use crate::error::Result;
use crate::kernels::move_solids::move_solids;
use crate::kernels::openings::Emission;
use crate::scene::Kind;
use glam::DVec3;

impl GpuRank {
    /// Takes in what comes in in this rank's columns of cells.
    pub(super) fn take_in(&mut self, emissions: &[Emission]) -> Result<()> {
        let layers: usize = emissions.iter().map(|e| e.wall.len()).sum();
        if layers == 0 {
            return Ok(());
        }
        // Each gets a number that no particle has.
        let mut named = vec![false; self.share.all().fluid];
        let own = self.numbers()?;
        for bytes in self.share.gather(bytemuck::cast_slice(&own).to_vec()) {
            let numbers = bytemuck::pod_collect_to_vec::<u8, u32>(&bytes);
            numbers.into_iter().for_each(|id| named[id as usize] = true);
        }
        let mut free = (0..named.len() as u32).filter(|&id| !named[id as usize]);
        let pressures = self.layer_pressures(emissions)?;
        let (mine, grid) = (self.share.columns(), self.gpu.grid);
        let mut water = Vec::new();
        let walls = emissions.iter().flat_map(|e| e.wall.clone().map(move |wall| (e, wall)));
        for ((emission, wall), pressure) in walls.zip(pressures) {
            let id = free.next().unwrap_or_default();
            let x = self.wall_position(wall - self.share.all().fluid) + emission.shift;
            if !mine.contains(&grid.coordinates(x)[0]) {
                continue;
            }
            let place = (x - self.gpu.middle).as_vec3();
            let position = place.extend(f32::from(Kind::Fluid as u8)).to_array();
            let velocity = emission.velocity.as_vec3().extend(word_of(id)).to_array();
            water.push(Carried::new(position, velocity, pressure as f32));
        }
        self.make_room(self.live + water.len())?;
        self.put(self.live, &water)?;
        self.came_in = self.live..self.live + water.len();
        self.live += water.len();
        Ok(())
    }

    /// Numbers of the water that this rank has.
    fn numbers(&mut self) -> Result<Vec<u32>> {
        let own = self.share.own();
        let part = [(own.start, own.len())];
        let position = self.gpu.context.download_parts(buffers::position, &part)?;
        let velocity = self.gpu.context.download_parts(buffers::velocity, &part)?;
        let water = position.iter().zip(&velocity).filter(|(x, _)| kind(x[3]) == Kind::Fluid);
        Ok(water.map(|(_, v)| number_of(v[3])).collect())
    }

    /// Pressures of the layers that become water [Pa], each of the rank that has it.
    fn layer_pressures(&mut self, emissions: &[Emission]) -> Result<Vec<f64>> {
        let here = |wall: usize| wall - self.share.all().fluid + self.gpu.groups.fluid;
        let parts: Vec<_> = emissions.iter().map(|e| (here(e.wall.start), e.wall.len())).collect();
        let read = self.gpu.context.download_parts(buffers::pressure, &parts)?;
        let slots = parts.iter().flat_map(|&(first, count)| first..first + count);
        let owned = slots.zip(read).map(|(i, p)| if self.share.owns(i) { f64::from(p) } else { 0.0 });
        let mut pressures: Vec<f64> = owned.collect();
        self.share.sum(&mut pressures);
        Ok(pressures)
    }

    /// Where the particle `k` of the wall layers stands [m].
    fn wall_position(&self, k: usize) -> DVec3 {
        let mut solids = self.stem.solids.iter().zip(&self.poses);
        match solids.find(|(solid, _)| solid.wall_slots.contains(&k)) {
            Some((solid, pose)) => move_solids(pose, solid.wall_offset[k - solid.wall_slots.start]).0,
            None => self.stem.position[k],
        }
    }
}
