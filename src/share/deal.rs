//! What ranks begin with. The first one has the whole, a scene or a state, and deals every other its part: the water of its columns, all that
//! moves, and of the walls that never move those within [`REACH`] columns.

use super::cut::{REACH, beyond, cut, is_ring, within};
use crate::cells::Grid;
use crate::fields::Fields;
use crate::kernels::cell_list::counting_sort;
use crate::params::Params;
use crate::scene::{Groups, Kind, Scene, Still};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::Arc;

/// Slots for as much more water than a rank has, one part in so many, and for a few more.
const SPARE: (usize, usize) = (8, 256);

/// Slots for `water` particles of water and some more, `all` at most where that is enough.
pub(crate) fn room(water: usize, all: usize) -> usize {
    (water + water / SPARE.0 + SPARE.1).min(all).max(water)
}

/// Particles of a group by columns of cells.
struct ByColumn {
    start: Vec<u32>,
    /// Their numbers in the group.
    order: Vec<u32>,
}

impl ByColumn {
    /// Those of the slots `of`, each in its `column`; those in none are left out.
    fn new(of: Range<usize>, columns: usize, column: impl Fn(usize) -> Option<u32>) -> Self {
        let column: Vec<u32> = of.map(|i| column(i).unwrap_or(columns as u32)).collect();
        let (mut start, mut order) = (Vec::new(), Vec::new());
        counting_sort(&column, columns, &mut start, &mut order);
        Self { start, order }
    }

    fn of(&self, column: u32) -> &[u32] {
        let c = column as usize;
        &self.order[self.start[c] as usize..self.start[c + 1] as usize]
    }

    /// Those in `columns`, in rising order.
    fn among(&self, columns: impl Iterator<Item = u32>) -> Vec<u32> {
        let mut all: Vec<u32> = columns.flat_map(|c| self.of(c)).copied().collect();
        all.sort_unstable();
        all
    }
}

/// Who has which particles of the whole.
pub struct Division {
    all: Groups,
    ring: bool,
    cuts: Vec<u32>,
    water: ByColumn,
    walls: ByColumn,
    dummies: ByColumn,
}

/// What of the whole a rank has.
struct Given {
    /// Slots of its water.
    water: Vec<usize>,
    /// How many copies it will have of others' water.
    copies: usize,
    still: Still,
}

impl Division {
    /// Cuts the tank for `ranks`, which have passed [`super::check`], by the water of a whole of the groups `all`, with particles of a `kind` at a
    /// `position`.
    pub fn new(
        ranks: usize,
        all: Groups,
        grid: &Grid,
        params: &Params,
        (position, kind): (&[DVec3], &[Kind]),
    ) -> Self {
        let columns = grid.count[0] as usize;
        let column = |i: usize| Some(grid.coordinates(position[i])[0]);
        let of = |slots: Range<usize>| ByColumn::new(slots, columns, column);
        let is_water = |i: usize| (kind[i] == Kind::Fluid).then_some(i);
        let water = ByColumn::new(0..all.fluid, columns, |i| is_water(i).and_then(column));
        let load: Vec<u64> = water.start.windows(2).map(|w| u64::from(w[1] - w[0])).collect();
        Self {
            all,
            ring: is_ring(ranks, params),
            cuts: cut(&load, ranks, params),
            water,
            walls: of(all.static_wall_range()),
            dummies: of(all.pressure()..all.static_range().end),
        }
    }

    fn given(&self, rank: usize) -> Given {
        let near = || within(REACH, &self.cuts, rank, self.ring);
        let water = self.water.among(self.cuts[rank]..self.cuts[rank + 1]);
        let beyond = beyond(&self.cuts, rank, self.ring).into_iter().flatten();
        Given {
            water: water.into_iter().map(|i| i as usize).collect(),
            copies: beyond.map(|c| self.water.of(c).len()).sum(),
            still: [&self.walls, &self.dummies].map(|group| group.among(near())),
        }
    }
}

/// What a rank begins a run with.
#[derive(Serialize, Deserialize)]
pub struct Start {
    /// Its part of the scene, with slots for more water.
    pub scene: Scene,
    /// Numbers of its particles of water in the whole scene.
    pub ids: Vec<u32>,
    /// Which walls that never move it has; all of them if none are named.
    pub still: Option<Still>,
    /// Particles of all ranks.
    pub all: Groups,
    /// First column of each rank, and the end of the last one's.
    pub cuts: Vec<u32>,
    /// Constants.
    pub params: Params,
    /// The whole scene, on the first rank.
    #[serde(skip)]
    pub whole: Option<Arc<Scene>>,
}

impl Start {
    /// That of `rank` in `scene`; with `every_wall`, and room for its copies of others' water, on a device, where walls stay as they were set up.
    pub fn new(
        rank: usize,
        scene: &Arc<Scene>,
        params: &Params,
        division: &Division,
        every_wall: bool,
    ) -> Self {
        let Given { water, copies, still } = division.given(rank);
        let still = (!every_wall).then_some(still);
        let slots = room(water.len() + if every_wall { copies } else { 0 }, scene.groups.fluid);
        Self {
            scene: scene.part(&water, slots, &[], still.as_ref()),
            ids: water.iter().map(|&i| i as u32).collect(),
            still,
            all: scene.groups,
            cuts: division.cuts.clone(),
            params: params.clone(),
            whole: (rank == 0).then(|| scene.clone()),
        }
    }
}

/// What a rank takes over of a state of all.
#[derive(Serialize, Deserialize)]
pub struct Portion {
    pub(super) cuts: Vec<u32>,
    /// As in [`Start`].
    pub still: Option<Still>,
    /// Its water, in the first slots, and the solids.
    pub(super) groups: Groups,
    pub(super) position: Vec<DVec3>,
    pub(super) velocity: Vec<DVec3>,
    pub(super) id: Vec<u32>,
    pub(super) pressure: Vec<f64>,
    pub(super) number_density: Vec<f64>,
    pub(super) state: Vec<u8>,
    pub(super) inertia_head: Vec<f64>,
    /// The last time step [s].
    pub dt: f64,
}

impl Portion {
    /// That of `rank` in `whole`, as [`Start::new`].
    pub(super) fn new(rank: usize, whole: &Fields, dt: f64, division: &Division, every_wall: bool) -> Self {
        let (all, Given { water, still, .. }) = (division.all, division.given(rank));
        let still = (!every_wall).then_some(still);
        let solids = all.solids_of(still.as_ref());
        let groups = all.of_part(water.len(), &solids);
        let [walls, dummies] = solids;
        let carriers: Vec<usize> = water.iter().copied().chain(walls).collect();
        let slots = || carriers.iter().chain(&dummies);
        Self {
            cuts: division.cuts.clone(),
            still,
            groups,
            position: slots().map(|&i| whole.position[i]).collect(),
            velocity: slots().map(|&i| whole.velocity[i]).collect(),
            id: water.iter().map(|&i| whole.id[i]).collect(),
            pressure: carriers.iter().map(|&i| whole.pressure[i]).collect(),
            number_density: carriers.iter().map(|&i| whole.number_density[i]).collect(),
            state: carriers.iter().map(|&i| whole.state[i] as u8).collect(),
            inertia_head: whole.inertia_head.clone(),
            dt,
        }
    }

    /// Places of the walls that never move, with their pressures, and of the dummies among them.
    pub fn still_places(&self) -> (Vec<(DVec3, f64)>, Vec<DVec3>) {
        let walls = self.groups.static_wall_range();
        let dummies = walls.end..self.groups.static_range().end;
        let wall = |i: usize| (self.position[i], self.pressure[i]);
        (walls.map(wall).collect(), self.position[dummies].to_vec())
    }

    /// Particles of water.
    pub fn water(&self) -> usize {
        self.groups.fluid
    }
}
