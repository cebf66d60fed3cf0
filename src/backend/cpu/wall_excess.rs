//! What the pressures of walls' rows are above those on their surface: [`crate::kernels::wall_excess`] over all of them, before the solve,
//! after it and after the cut of negative pressures.

use super::team::owns;
use crate::fields::{Fields, State};
use crate::kernels::Particles;
use crate::kernels::pressure_source::laplacian_coefficient;
use crate::kernels::surface_pressure::beside_surface;
use crate::kernels::wall_excess::{cut_share, known_excess, wall_excess};
use crate::neighbours::{CHUNK, Neighbours};
use crate::params::Params;
use crate::plan::{Arrays, Plan, Stage, Told};
use crate::scene::{Scene, Solid};
use crate::share::{OfWalls, Share};
use rayon::prelude::*;

/// Excess of the walls that carry pressure, of those of which it is told.
#[derive(Default)]
pub(super) struct WallExcess {
    /// [Pa], the moving walls' first.
    of: Vec<f64>,
    /// Rows of walls that move.
    moving: usize,
    /// Whether it is told of those that never move.
    of_still: bool,
    /// [`cut_share`] of each wall-layer slot of the moving solids, 0 where they are not free; empty where none is.
    cut_share: Vec<f64>,
    /// What the solve has found for the rows of free bodies.
    solved: Vec<Solved>,
    /// Pressure of moving walls' slots beside the surface, which are no rows ([`beside_surface`]) [Pa].
    beside: Vec<Option<f64>>,
}

/// A row of a free body between the solve and the cut [Pa].
#[derive(Clone, Copy, Default)]
struct Solved {
    pressure: f64,
    excess: f64,
}

/// What rows are made of.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub neighbours: &'a Neighbours,
    pub params: &'a Params,
    pub fluid: usize,
    pub share: Option<&'a Share>,
}

impl Rows<'_> {
    /// Slot of the wall, if it is this rank's and has an equation.
    fn row(&self, wall: usize, state: &[State]) -> Option<usize> {
        self.own(wall, state, State::Inner)
    }

    /// Slot of the wall, if it is this rank's and its part in the equation is `as_what`.
    fn own(&self, wall: usize, state: &[State], as_what: State) -> Option<usize> {
        let i = self.fluid + wall;
        (owns(self.share, i) && state[i] == as_what).then_some(i)
    }

    /// [`wall_excess`] of slot `i` with the pressures that are.
    fn excess(&self, i: usize, fields: &Fields) -> f64 {
        let Fields { position, velocity, pressure, .. } = fields;
        let on = Particles { params: self.params, position, velocity, fluid: self.fluid };
        wall_excess(i, self.neighbours.pressure(i).neighbour, on, pressure)
    }
}

impl WallExcess {
    pub fn new(scene: &Scene, params: &Params, plan: &Plan) -> Self {
        let groups = scene.groups;
        let rows = |s: &Solid| std::iter::repeat_n(cut_share(s, params), s.wall_slots.len());
        let cut_share: Vec<f64> =
            scene.solids.iter().filter(|_| plan.needs(Arrays::Coupling)).flat_map(rows).collect();
        let beside = plan.needs(Arrays::Excess) && plan.has(Stage::SurfacePressure);
        Self {
            of: vec![0.0; plan.excess.rows(groups.pressure() - groups.fluid, groups.moving_wall)],
            moving: groups.moving_wall,
            of_still: plan.excess == Told::All,
            solved: vec![Solved::default(); cut_share.len()],
            cut_share,
            beside: vec![None; if beside { groups.moving_wall } else { 0 }],
        }
    }

    /// There are other walls that never move: `carriers` rows with those that move.
    pub fn lay_still(&mut self, carriers: usize) {
        if self.of_still {
            self.of.resize(carriers, 0.0);
            self.of[self.moving..].fill(0.0);
        }
    }

    /// Of the wall [Pa], 0 where it is not told.
    pub fn of(&self, wall: usize) -> f64 {
        self.of.get(wall).copied().unwrap_or_default()
    }

    /// Of the wall that moves [Pa], if it is no row but beside the water's surface.
    pub fn beside_surface(&self, wall: usize) -> Option<f64> {
        self.beside.get(wall).copied().flatten()
    }

    /// What free bodies answer within the solve: what their equations say, and what the last step has left to add.
    pub fn before_solve(&mut self, rows: Rows, fields: &Fields) {
        let Fields { position, velocity, state, source, surface_pressure, inertia_head, .. } = fields;
        let on = Particles { params: rows.params, position, velocity, fluid: rows.fluid };
        let c = laplacian_coefficient(rows.params);
        let walls = (&mut self.of[..], &self.cut_share[..], &inertia_head[..]).into_par_iter();
        walls.with_min_len(CHUNK).enumerate().for_each(|(wall, (excess, felt, head))| {
            *excess = match rows.row(wall, state) {
                Some(i) if *felt > 0.0 => {
                    let carriers = rows.neighbours.pressure(i).neighbour;
                    head + known_excess(i, carriers, on, source[i] / c, surface_pressure)
                }
                _ => 0.0,
            };
        });
        self.beside.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(wall, beside)| {
            let slot = rows.own(wall, state, State::Surface);
            *beside = slot
                .and_then(|i| beside_surface(i, rows.neighbours.pressure(i), state, on, surface_pressure));
        });
    }

    /// Keeps the solution of free bodies' rows from the cut.
    pub fn after_solve(&mut self, rows: Rows, fields: &Fields) {
        let walls = (&mut self.solved[..], &self.cut_share[..]).into_par_iter();
        walls.with_min_len(CHUNK).enumerate().for_each(|(wall, (solved, felt))| {
            if let Some(i) = rows.row(wall, &fields.state).filter(|_| *felt > 0.0) {
                *solved = Solved { pressure: fields.pressure[i], excess: rows.excess(i, fields) };
            }
        });
    }

    /// What is left after the cut. A free body is pressed with what it answered and with what it feels of the cut; what it answered too
    /// little is its inertia head, which the next step adds.
    pub fn after_cut(&mut self, rows: Rows, fields: &mut Fields) {
        let Self { of, cut_share, solved, .. } = self;
        let mut heads = std::mem::take(&mut fields.inertia_head);
        let state = &fields.state;
        let free = |wall: usize| cut_share.get(wall).filter(|felt| **felt > 0.0);
        (&mut heads[..], &of[..], &solved[..]).into_par_iter().with_min_len(CHUNK).enumerate().for_each(
            |(wall, (head, answered, solved))| {
                let row = rows.row(wall, state).and_then(|_| free(wall));
                *head = row.map_or(0.0, |_| solved.excess - (answered - *head));
            },
        );
        of.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(wall, excess)| {
            let Some(i) = rows.row(wall, state) else {
                *excess = 0.0;
                return;
            };
            let left = rows.excess(i, fields);
            *excess = match free(wall) {
                Some(felt) => {
                    let Solved { pressure, excess: solved } = solved[wall];
                    let cut = fields.pressure[i] - pressure;
                    *excess + cut - felt * (cut - (left - solved))
                }
                None => left,
            };
        });
        if let Some(share) = rows.share
            && !heads.is_empty()
        {
            share.swap(&mut [&mut OfWalls { fluid: rows.fluid, values: &mut heads }]);
        }
        fields.inertia_head = heads;
    }
}
