//! Water that goes from rank to rank, and the borders that it leaves.

use super::Share;
use super::border::Side;
use super::cut::{cut, unevenness};
use crate::cells::Grid;
use crate::fields::Fields;
use crate::kernels::cell_list::{CellList, inside};
use crate::params::Params;
use crate::scene::{Groups, Kind};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use std::ops::Range;

/// Steps between looks at how even the shares are.
const LOOK_EVERY: u64 = 20;
/// Largest share over the mean from which on the tank is cut anew.
const UNEVEN: f64 = 1.1;

/// A particle of water on its way to another rank.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Traveller {
    position: DVec3,
    velocity: DVec3,
    pressure: f64,
    id: u64,
}

impl Share {
    /// Cuts the tank by all water, and tells which slots of it this rank takes.
    pub fn choose(&mut self, position: &[DVec3], kind: &[Kind], grid: &Grid, params: &Params) -> Vec<usize> {
        let column = |i: usize| grid.coordinates(position[i])[0];
        let mut load = vec![0; grid.count[0] as usize];
        let water = || (0..self.all.fluid).filter(|&i| kind[i] == Kind::Fluid);
        water().for_each(|i| load[column(i) as usize] += 1);
        let cuts = cut(&load, self.ranks(), params);
        let mine = cuts[self.rank()]..cuts[self.rank() + 1];
        let own = water().filter(|&i| mine.contains(&column(i))).collect();
        self.cuts = cuts;
        own
    }

    /// The first `own` slots of `fields`, of `groups`, are what [`Self::choose`] told; there are no copies yet.
    pub fn begin(&mut self, groups: Groups, own: usize, fields: &Fields, grid: &Grid) {
        self.groups = groups;
        self.own = 0..own;
        self.come_in.clear();
        self.sides = self.beyond().map(|there| there.map(|_| Side::default()));
        let mine = self.columns();
        for (owned, x) in self.walls.iter_mut().zip(&fields.position[groups.fluid..]) {
            *owned = mine.contains(&grid.coordinates(*x)[0]);
        }
    }

    /// The slots of the water are more now, those of solids behind them moved up; borders are found anew before they are used.
    pub fn groups_are(&mut self, groups: Groups) {
        self.groups = groups;
    }

    /// Takes in water that has come in through an opening, in `slots` of every rank: each keeps what is in its columns.
    pub fn take_in(&mut self, slots: impl Iterator<Item = usize>, fields: &mut Fields, grid: &Grid) {
        // Each gets a number that no particle has.
        let mut named = vec![false; self.all.fluid];
        for bytes in self.gather(bytemuck::cast_slice(&fields.id[self.own()]).to_vec()) {
            bytemuck::pod_collect_to_vec::<u8, u32>(&bytes)
                .into_iter()
                .for_each(|id| named[id as usize] = true);
        }
        let mut free = (0..self.all.fluid as u32).filter(|&id| !named[id as usize]);
        let mine = self.columns();
        for i in slots {
            fields.id[i] = free.next().unwrap_or_default();
            if mine.contains(&grid.coordinates(fields.position[i])[0]) {
                self.come_in.push(i);
            } else {
                self.park(fields, i..i + 1);
            }
        }
    }

    /// Takes what is in `slots` out of the computation.
    pub(super) fn park(&self, fields: &mut Fields, slots: Range<usize>) {
        fields.kind[slots.clone()].fill(Kind::Ghost);
        fields.velocity[slots.clone()].fill(DVec3::ZERO);
        fields.pressure[slots].fill(0.0);
    }

    /// Particles go to the ranks in whose columns they now are, and copies of border columns to the ranks beside. Returns what is here
    /// then, for [`Self::place`].
    pub fn settle(&mut self, fields: &mut Fields, grid: &Grid, params: &Params) -> Vec<Traveller> {
        let column = |x: DVec3| grid.coordinates(x)[0];
        let traveller = |i: usize| Traveller {
            position: fields.position[i],
            velocity: fields.velocity[i],
            pressure: fields.pressure[i],
            id: u64::from(fields.id[i]),
        };
        let come_in = std::mem::take(&mut self.come_in);
        let there =
            self.own.clone().chain(come_in.iter().copied()).filter(|&i| fields.kind[i] == Kind::Fluid);
        let mut own: Vec<Traveller> = there.map(traveller).collect();
        come_in.into_iter().for_each(|i| self.park(fields, i..i + 1));
        if self.steps.is_multiple_of(LOOK_EVERY) && self.steps > 0 {
            self.cut_anew(&own, fields, column, params);
        }
        self.steps += 1;
        let domain = (params.domain_min, params.domain_max);
        // What is about to be taken out stays where it is counted.
        let stays = |t: &Traveller| {
            !inside(grid.periodic.wrap(t.position), t.velocity, domain.0, domain.1, params.dimensions)
        };
        loop {
            let mine = self.columns();
            let (mut left, mut right) = (Vec::new(), Vec::new());
            own.retain(|t| {
                let c = column(t.position);
                let goes = !mine.contains(&c) && !stays(t);
                if goes {
                    let to = if self.is_before(c) { &mut left } else { &mut right };
                    to.extend_from_slice(bytemuck::bytes_of(t));
                }
                !goes
            });
            let come = self.pass(left, right);
            come.iter().for_each(|bytes| own.extend(bytemuck::pod_collect_to_vec::<u8, Traveller>(bytes)));
            // One round does it unless the tank was cut anew.
            let mut astray =
                [own.iter().filter(|t| !mine.contains(&column(t.position)) && !stays(t)).count() as f64];
            self.sum(&mut astray);
            if astray[0] == 0.0 {
                break;
            }
        }
        let border = |c: u32| {
            let at = own.iter().filter(|t| column(t.position) == c && !stays(t));
            bytemuck::cast_slice(&at.copied().collect::<Vec<_>>()).to_vec()
        };
        let [first, last] = self.ends();
        let [before, after] = self.pass(border(first), border(last));
        let [before, after] =
            [before, after].map(|bytes| bytemuck::pod_collect_to_vec::<u8, Traveller>(&bytes));
        [before, own, after].concat()
    }

    /// Whether the way to `column`, of another rank, goes by the rank before this one: in a ring the shorter way.
    fn is_before(&self, column: u32) -> bool {
        let mine = self.columns();
        if !self.ring {
            return column < mine.start;
        }
        let all = self.cuts.last().copied().unwrap_or(0);
        let (left, right) = ((mine.start + all - column) % all, (column + all - mine.end) % all + 1);
        left < right
    }

    /// Puts what is `here` into the slots of the water, of which the first `live` held some before.
    pub fn place(&self, here: &[Traveller], fields: &mut Fields, live: usize) {
        for (n, t) in here.iter().enumerate() {
            fields.position[n] = t.position;
            fields.velocity[n] = t.velocity;
            fields.pressure[n] = t.pressure;
            fields.id[n] = t.id as u32;
            fields.kind[n] = Kind::Fluid;
        }
        self.park(fields, here.len()..live.max(here.len()));
    }

    /// Cuts the tank anew if the shares have become uneven. Walls that change hands take their pressures along.
    fn cut_anew(
        &mut self,
        own: &[Traveller],
        fields: &mut Fields,
        column: impl Fn(DVec3) -> u32,
        params: &Params,
    ) {
        let mut load = vec![0.0; *self.cuts.last().unwrap_or(&0) as usize];
        own.iter().for_each(|t| load[column(t.position) as usize] += 1.0);
        self.sum(&mut load);
        let load: Vec<u64> = load.into_iter().map(|n| n as u64).collect();
        let cuts = cut(&load, self.ranks(), params);
        if unevenness(&load, &self.cuts) < UNEVEN || unevenness(&load, &cuts) >= unevenness(&load, &self.cuts)
        {
            return;
        }
        let fluid = self.groups.fluid;
        let owned = (fluid..self.groups.pressure()).filter(|&i| self.owns(i));
        let pressures: Vec<[f64; 2]> = owned.map(|i| [(i - fluid) as f64, fields.pressure[i]]).collect();
        for bytes in self.gather(bytemuck::cast_slice(&pressures).to_vec()) {
            for [k, p] in bytemuck::pod_collect_to_vec::<u8, [f64; 2]>(&bytes) {
                fields.pressure[fluid + k as usize] = p;
            }
        }
        self.cuts = cuts;
    }

    /// Finds the borders in the cells of this rank's water, which begin at `start`, and of solids.
    pub fn find_borders(&mut self, start: &[u32], solids: [Option<&CellList>; 2]) {
        let (mine, per_column) = (self.columns(), self.per_column);
        let water = |c: Range<u32>| {
            start[c.start as usize * per_column] as usize..start[c.end as usize * per_column] as usize
        };
        let (fluid, pressure) = (self.groups.fluid, self.groups.pressure());
        let walls_of = |c: Range<u32>| -> Vec<u32> {
            let lists = solids.into_iter().flatten();
            let of = |list: &'_ CellList| -> Vec<u32> {
                let (a, b) =
                    (list.start[c.start as usize * per_column], list.start[c.end as usize * per_column]);
                list.slot[a as usize..b as usize]
                    .iter()
                    .copied()
                    .filter(|&s| (s as usize) < pressure)
                    .collect()
            };
            lists.flat_map(of).collect()
        };
        self.own = water(mine.clone());
        let walls = |c: u32| walls_of(c..c + 1);
        let mut sides = self.borders(walls);
        for ((side, end), beyond) in sides.iter_mut().zip(self.ends()).zip(self.beyond()) {
            if let Some((side, beyond)) = side.as_mut().zip(beyond) {
                (side.give, side.take) = (water(end..end + 1), water(beyond..beyond + 1));
            }
        }
        self.sides = sides;
        self.walls.fill(false);
        walls_of(mine.clone()).into_iter().for_each(|s| self.walls[s as usize - fluid] = true);
    }
}
