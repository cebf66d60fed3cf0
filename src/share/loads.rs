//! How much of a scene lies in each column of cells: of the scene itself, or of a coarser one that stands for it.

use crate::cells::Grid;
use crate::params::Params;
use crate::scene::{Groups, Kind, Scene};
use std::collections::BTreeSet;

/// Particles in each column of cells along x.
pub(super) struct Loads<'a> {
    scene: &'a Scene,
    grid: &'a Grid,
    /// Spacing of the scene over that of the case, 1 or more.
    coarser: f64,
    /// Of water.
    pub water: Vec<u64>,
    /// Of wall layers.
    pub walls: Vec<u64>,
}

impl<'a> Loads<'a> {
    /// Of a `scene` with the spacing of `params`, or a larger one: its particles stand for as many as have room in their place.
    pub fn new(scene: &'a Scene, grid: &'a Grid, params: &Params) -> Self {
        let coarser = (scene.spacing / params.spacing).max(1.0);
        let mut loads = Self { scene, grid, coarser, water: Vec::new(), walls: Vec::new() };
        let groups = scene.groups;
        loads.water = loads.along_x(loads.water_slots(), coarser.powi(scene.dimensions as i32));
        loads.walls =
            loads.along_x(groups.fluid..groups.pressure(), coarser.powi(scene.dimensions as i32 - 1));
        loads
    }

    fn water_slots(&self) -> impl Iterator<Item = usize> {
        let scene = self.scene;
        (0..scene.groups.fluid).filter(|&i| scene.kind[i] == Kind::Fluid)
    }

    /// Groups of the case.
    pub fn groups(&self) -> Groups {
        let groups = self.scene.groups;
        let fluid = groups.fluid as f64 * self.coarser.powi(self.scene.dimensions as i32);
        Groups { fluid: fluid.round() as usize, ..groups }
    }

    /// Particles in each column, of `slots` that stand for `each`.
    fn along_x(&self, slots: impl Iterator<Item = usize>, each: f64) -> Vec<u64> {
        let (grid, scene) = (self.grid, self.scene);
        let column = |x: f64| grid.coordinates(scene.position[0].with_x(x))[0] as usize;
        let mut load = vec![0.0; grid.count[0] as usize];
        for x in slots.map(|i| scene.position[i].x) {
            if self.coarser == 1.0 {
                load[column(x)] += 1.0;
                continue;
            }
            let half = 0.5 * scene.spacing;
            // As much of it as lies in each column that it reaches.
            let (low, high) = (x - half, x + half);
            let mut from = low;
            while from < high {
                let c = column(0.5 * (from + high.min(from + 1e-9 * half)));
                let end = grid.origin.x + grid.width.x * (c as f64 + 1.0);
                let to = if end > from { end.min(high) } else { high };
                load[c] += each * (to - from) / scene.spacing;
                from = to;
            }
        }
        load.into_iter().map(|n: f64| n.round() as u64).collect()
    }

    /// Cells of a level with water, and the most in a column. Below the size of a coarser scene's particles they fill the room.
    pub fn wet_cells(&self, level: usize) -> [u64; 2] {
        let told = (0..).find(|&l| self.grid.width.x * f64::from(1 << l) >= self.scene.spacing);
        let at = told.filter(|_| self.coarser > 1.0).map_or(level, |told: usize| told.max(level));
        let cell = |i: usize| self.grid.coordinates(self.scene.position[i]).map(|k| k >> at);
        let wet: BTreeSet<[u32; 3]> = self.water_slots().map(cell).collect();
        let mut columns = vec![0_u64; self.grid.count[0] as usize];
        wet.iter().for_each(|c| columns[c[0] as usize] += 1);
        let (d, finer) = (self.scene.dimensions as usize, at - level);
        [(wet.len() as u64) << (d * finer), columns.into_iter().max().unwrap_or(0) << ((d - 1) * finer)]
    }
}
