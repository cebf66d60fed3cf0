//! Rooms between a free body and another solid that are wide enough for water and have none: a body that comes off the floor leaves one below, and
//! one that is laid where the lattice does not fit may start over one. What is under water all round is full of water: it is a slot, as
//! narrower ones are, until water has come in. Without it a body that had risen by a spacing lost its lift, and fell back.

use super::{ACROSS, EMPTY, Faced, Slots};
use crate::body::Pose;
use crate::error::Result;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};

/// Solids and rows of theirs that face a room without water.
pub type Voids = BTreeSet<(usize, usize)>;

/// How the rows of a free body lie.
pub(super) struct Lying {
    pub solid: usize,
    pub at_walls: bool,
    pub faced: Vec<Faced>,
}

impl Slots {
    /// Rows without water that face something within [`EMPTY`], those that hang together being in water all round, by the pressures that `read`
    /// tells of slots of particles [Pa]; 0 where it is dry.
    ///
    /// # Errors
    /// Those of `read`.
    pub(super) fn voids(
        &self,
        lying: &[Lying],
        others: &[Vec<(usize, DVec3)>],
        poses: &[Pose],
        read: impl FnOnce(&[usize]) -> Result<Vec<f64>>,
    ) -> Result<Voids> {
        let may_be = |of: &Lying| {
            let far = |n: usize| {
                let row =
                    || self.row_faced((of.solid, n), of.at_walls, &others[of.solid], poses, (EMPTY, ACROSS));
                of.faced[n].share < 1.0 && row().share > of.faced[n].share
            };
            (0..of.faced.len()).into_par_iter().with_min_len(256).filter(|&n| far(n)).collect::<Vec<usize>>()
        };
        let rows: Vec<Vec<usize>> = lying.par_iter().map(may_be).collect();
        let mut asked = BTreeSet::new();
        for (of, rows) in lying.iter().zip(&rows) {
            let layer = &self.layers[of.solid];
            let beside = rows.iter().flat_map(|&n| layer.adjacent[n].iter().map(|&m| m as usize));
            asked.extend(rows.iter().copied().chain(beside).map(|n| layer.first + n));
        }
        if asked.is_empty() {
            return Ok(Voids::new());
        }
        let asked: Vec<usize> = asked.into_iter().collect();
        let pressure: HashMap<usize, f64> = asked.iter().copied().zip(read(&asked)?).collect();
        let mut voids = Voids::new();
        for (of, rows) in lying.iter().zip(&rows) {
            let layer = &self.layers[of.solid];
            let is_dry = |n: usize| pressure[&(layer.first + n)] == 0.0;
            let empty: BTreeSet<usize> = rows.iter().copied().filter(|&n| is_dry(n)).collect();
            let mut left = empty.clone();
            while let Some(first) = left.pop_first() {
                let (mut room, mut at, mut in_water) = (vec![first], 0, true);
                while at < room.len() {
                    for m in layer.adjacent[room[at]].iter().map(|&m| m as usize) {
                        if left.remove(&m) {
                            room.push(m);
                        } else if !empty.contains(&m) && of.faced[m].share == 0.0 {
                            in_water &= !is_dry(m);
                        }
                    }
                    at += 1;
                }
                if in_water {
                    voids.extend(room.into_iter().map(|n| (of.solid, n)));
                }
            }
        }
        Ok(voids)
    }
}
