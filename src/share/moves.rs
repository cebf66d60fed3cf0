//! Water that goes from rank to rank, and the borders that it leaves.

use super::Share;
use super::border::Side;
use super::cut::{cut, unevenness};
use super::still::StillParticle;
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

/// What a rank has when water has gone where it belongs.
pub struct Settled {
    /// Its water, copies before and after it.
    pub water: Vec<Traveller>,
    /// Walls that never move, layers and dummies, if others are here now.
    pub still: Option<[Vec<StillParticle>; 2]>,
}

impl Share {
    /// The first `own` slots of `fields`, of `groups`, are this rank's water; there are no copies yet.
    pub fn begin(&mut self, groups: Groups, own: usize, fields: &Fields, grid: &Grid) {
        self.groups = groups;
        self.own = 0..own;
        self.come_in.clear();
        self.sides = self.beyond().map(|there| there.map(|_| Side::default()));
        let mine = self.columns();
        let walls = &fields.position[groups.fluid..groups.pressure()];
        self.walls = walls.iter().map(|x| mine.contains(&grid.coordinates(*x)[0])).collect();
    }

    /// Slots have changed: of the water there are more, and those of solids behind them have moved up, or other solids are here; borders are found anew
    /// before they are used.
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
    pub fn settle(&mut self, fields: &mut Fields, grid: &Grid, params: &Params) -> Settled {
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
        let mut still = None;
        if self.is_look_due() {
            let mut load = vec![0.0; self.all_columns()];
            own.iter().for_each(|t| load[column(t.position) as usize] += 1.0);
            let before = self.columns();
            if self.cut_anew(load, params) {
                let moving = self.groups.moving_wall_range();
                self.tell_walls(&mut fields.pressure[moving]);
                self.tell_walls(&mut fields.inertia_head);
                still = self.still_of(before, fields, grid).map(|own| self.hand_on_still(own, grid));
            }
        }
        let domain = (params.domain_min, params.domain_max);
        // What is about to be taken out stays where it is counted.
        let stays = |t: &Traveller| {
            !inside(grid.periodic.wrap(t.position), t.velocity, domain.0, domain.1, params.dimensions)
        };
        let [before, after] = self.migrate(&mut own, |t| (!stays(t)).then(|| column(t.position)));
        Settled { water: [before, own, after].concat(), still }
    }

    /// Whether it is time to see how even the shares are; counts the steps.
    pub(crate) fn is_look_due(&mut self) -> bool {
        let due = self.steps.is_multiple_of(LOOK_EVERY) && self.steps > 0;
        self.steps += 1;
        due
    }

    /// Hands those of `own` that are in the columns of other ranks on to these, and takes in what comes; `column` says where a particle is, and
    /// nothing of one that stays whatever its place.
    pub(super) fn migrate_alone<T: Pod>(&self, own: &mut Vec<T>, column: impl Fn(&T) -> Option<u32>) {
        let mine = self.columns();
        let astray = |t: &T| column(t).filter(|c| !mine.contains(c));
        loop {
            let (mut left, mut right) = (Vec::new(), Vec::new());
            own.retain(|t| {
                let goes = astray(t);
                if let Some(c) = goes {
                    let to = if self.is_before(c) { &mut left } else { &mut right };
                    to.extend_from_slice(bytemuck::bytes_of(t));
                }
                goes.is_none()
            });
            let come = self.pass(left, right);
            come.iter().for_each(|bytes| own.extend(bytemuck::pod_collect_to_vec::<u8, T>(bytes)));
            // One round does it unless the tank was cut anew.
            let mut count = [own.iter().filter(|t| astray(t).is_some()).count() as f64];
            self.sum(&mut count);
            if count[0] == 0.0 {
                break;
            }
        }
    }

    /// The same; returns copies of what the ranks before and after have at their borders.
    pub(crate) fn migrate<T: Pod>(
        &self,
        own: &mut Vec<T>,
        column: impl Fn(&T) -> Option<u32>,
    ) -> [Vec<T>; 2] {
        self.migrate_alone(own, &column);
        let border = |c: u32| {
            let at = own.iter().filter(|t| column(t) == Some(c));
            bytemuck::cast_slice(&at.copied().collect::<Vec<_>>()).to_vec()
        };
        let [first, last] = self.ends();
        self.pass(border(first), border(last)).map(|bytes| bytemuck::pod_collect_to_vec::<u8, T>(&bytes))
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

    /// Cuts the tank anew if the shares have become uneven, as the `load` of each column on this rank tells; whether it did.
    pub(crate) fn cut_anew(&mut self, mut load: Vec<f64>, params: &Params) -> bool {
        self.sum(&mut load);
        let load: Vec<u64> = load.into_iter().map(|n| n as u64).collect();
        let cuts = cut(&load, self.ranks(), params);
        let now = unevenness(&load, &self.cuts);
        let better = now >= UNEVEN && unevenness(&load, &cuts) < now;
        if better {
            self.cuts = cuts;
        }
        better
    }

    /// Tells all ranks the `values` of the wall layers that this one has: walls that change hands take what they have along.
    pub(crate) fn tell_walls(&self, values: &mut [f64]) {
        if values.is_empty() {
            return;
        }
        let owned = self.walls.iter().enumerate().filter(|(k, owned)| **owned && *k < values.len());
        let own: Vec<[f64; 2]> = owned.map(|(k, _)| [k as f64, values[k]]).collect();
        for bytes in self.gather(bytemuck::cast_slice(&own).to_vec()) {
            for [k, value] in bytemuck::pod_collect_to_vec::<u8, [f64; 2]>(&bytes) {
                values[k as usize] = value;
            }
        }
    }

    /// Finds the borders in the cells of this rank's water, which begin at `start`, and of solids.
    pub fn find_borders(&mut self, grid: &Grid, start: &[u32], solids: [Option<&CellList>; 2]) {
        let of_column = |start: &[u32], c: u32| {
            let cells = grid.cells_of(c);
            start[cells.start] as usize..start[cells.end] as usize
        };
        let pressure = self.groups.pressure();
        let walls_of = |c: u32| -> Vec<u32> {
            let lists = solids.into_iter().flatten();
            let of = |list: &'_ CellList| -> Vec<u32> {
                let there = list.slot[of_column(&list.start, c)].iter().copied();
                there.filter(|&s| (s as usize) < pressure).collect()
            };
            lists.flat_map(of).collect()
        };
        self.set_borders(|c| of_column(start, c), walls_of);
    }

    /// Takes over the borders: the `water` of a column has these slots, and its wall layers the slots `walls`, in an order that the ranks beside know as
    /// well.
    pub(crate) fn set_borders(
        &mut self,
        water: impl Fn(u32) -> Range<usize>,
        walls: impl Fn(u32) -> Vec<u32>,
    ) {
        let (mine, fluid) = (self.columns(), self.groups.fluid);
        self.own = water(mine.start).start..water(mine.end - 1).end;
        let mut sides = self.borders(&walls);
        for ((side, end), beyond) in sides.iter_mut().zip(self.ends()).zip(self.beyond()) {
            if let Some((side, beyond)) = side.as_mut().zip(beyond) {
                (side.give, side.take) = (water(end), water(beyond));
            }
        }
        self.sides = sides;
        self.walls.clear();
        self.walls.resize(self.groups.pressure() - fluid, false);
        mine.flat_map(walls).for_each(|s| self.walls[s as usize - fluid] = true);
    }
}
