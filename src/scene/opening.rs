//! Openings of the tank: where they are, what moves in them, and how much water may pass.

use super::build::{AXES, Builder};
use super::covered::Covers;
use super::lattice::{BLOCKED, Cells, SOLID};
use super::{Drive, Motion, Shape, Solid};
use crate::case::{HURRY, OpeningKeys, Rate, TANK_FACES, room_behind, stands_for};
use crate::error::Problem;
use glam::{DQuat, DVec3, IVec3};
use serde::{Deserialize, Serialize};

/// A quantity over time on straight lines between rows; constant before the first and after the last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Course {
    rows: Vec<[f64; 2]>,
}

impl Course {
    /// The `rows` of time [s] and value, of which there is at least one, with rising times; values times `factor`.
    pub fn new(rows: &[[f64; 2]], factor: f64) -> Self {
        Self { rows: rows.iter().map(|r| [r[0], r[1] * factor]).collect() }
    }

    /// Value at time `t` [s].
    pub fn value(&self, t: f64) -> f64 {
        let after = self.rows.partition_point(|r| r[0] <= t);
        match (after.checked_sub(1).map(|k| self.rows[k]), self.rows.get(after)) {
            (Some(a), Some(b)) => a[1] + (b[1] - a[1]) * (t - a[0]) / (b[0] - a[0]),
            (Some(a), None) => a[1],
            (None, first) => first.map_or(0.0, |r| r[1]),
        }
    }

    /// Times of the rows [s].
    pub fn times(&self) -> impl Iterator<Item = f64> {
        self.rows.iter().map(|r| r[0])
    }

    /// Integral over time between `from` and `to` [s].
    pub fn integral(&self, from: f64, to: f64) -> f64 {
        let within = self.rows.iter().map(|r| r[0]).filter(|&t| t > from && t < to);
        let times: Vec<f64> = [from].into_iter().chain(within).chain([to]).collect();
        times.windows(2).map(|w| 0.5 * (w[1] - w[0]) * (self.value(w[0]) + self.value(w[1]))).sum()
    }

    /// Largest value between the times `from` and `to` [s].
    pub fn most(&self, from: f64, to: f64) -> f64 {
        let within = self.rows.iter().filter(|r| r[0] > from && r[0] < to).map(|r| r[1]);
        within.fold(self.value(from).max(self.value(to)), f64::max)
    }
}

/// What passes an opening.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Passes {
    /// Water comes in with a velocity [m/s].
    In(Course),
    /// Water goes out with a velocity [m/s].
    Out(Course),
    /// Water goes out at a discharge [m3/s], with a velocity that follows from the area under water.
    Drawn(Course),
    /// Water falls out.
    Free,
}

/// An opening of the tank.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Opening {
    /// Name from the case.
    pub name: String,
    /// What passes it.
    pub passes: Passes,
    /// Index into [`super::Scene::solids`] of the wall that moves in it; none in a hole.
    pub solid: Option<usize>,
    /// Out of the tank, of length 1.
    pub outward: DVec3,
    /// A point of the face [m].
    pub face: DVec3,
    /// Corners of the box behind the opening, from the face on: what is in there is swallowed [m].
    pub behind: (DVec3, DVec3),
    /// Corners of the part of it in which a hole's jet contracts, and that is spared [m]; none behind a wall that moves.
    pub room: Option<(DVec3, DVec3)>,
    /// Area [m2]; in two dimensions of the slice.
    pub area: f64,
    /// Particles of a layer.
    pub layer: usize,
    /// Of these, how many columns of the lattice in front of it hold water at t = 0.
    pub wet: usize,
    /// Solids that may stand before it: all but obstacles, whose cells it does not have.
    pub passing: Vec<usize>,
    /// Where particles of the tank's wall would stand in a hole [m]: bodies do not leave through it. None where a wall moves.
    pub lid: Vec<DVec3>,
}

impl Opening {
    /// Whether water comes in.
    pub fn is_inflow(&self) -> bool {
        matches!(self.passes, Passes::In(_))
    }

    /// Largest speed of the wall in it between the times `from` and `to` [m/s].
    pub fn fastest(&self, from: f64, to: f64) -> f64 {
        match &self.passes {
            Passes::In(speed) | Passes::Out(speed) => speed.most(from, to),
            Passes::Drawn(discharge) => HURRY * discharge.most(from, to) / self.area,
            Passes::Free => 0.0,
        }
    }
}

/// An opening on its lattice, before the solids are numbered.
pub(super) struct Planned {
    pub opening: Opening,
    /// Cells of the tank's wall layer that it takes.
    pub cells: Vec<IVec3>,
    /// The box around them.
    pub ends: Cells,
    /// Place of its wall among the moving walls.
    pub wall: Option<usize>,
}

impl Builder<'_> {
    /// Takes the cells of the openings out of the tank's wall, before that is built.
    pub(super) fn carve(&mut self) {
        let Some(tank) = self.tank.filter(|_| self.case.openings().next().is_some()) else { return };
        let covers = Covers::of(self.case, &self.lattice, &self.periodic, self.layers);
        for keys in self.case.openings() {
            let (axis, side) = keys.side();
            let mut cells = tank;
            if let [Some(min), Some(max)] = keys.corners {
                let asked = self.lattice.cells(min.into(), max.into());
                for k in (0..3).filter(|&k| k != axis) {
                    (cells.lo[k], cells.hi[k]) = (tank.lo[k].max(asked.lo[k]), tank.hi[k].min(asked.hi[k]));
                }
            }
            (cells.lo[axis], cells.hi[axis]) =
                if side == 0 { (-1, 0) } else { (tank.hi[axis], tank.hi[axis] + 1) };
            let path = keys.path();
            if let [Some(min), Some(max)] = keys.corners {
                let label = format!("{} `{}`", keys.key, keys.name);
                if self.crosses(&format!("{path}.min"), &label, (min.into(), max.into()), true) {
                    continue;
                }
            }
            if cells.lo.cmpge(cells.hi).any() {
                let message = format!("{} `{}` holds no particle of the face", keys.key, keys.name);
                let remedy = "make it larger, or use a smaller run.spacing";
                self.problems.push(Problem::new(format!("{path}.min"), message, remedy));
                continue;
            }
            if let Some(other) = self.openings.iter().find(|o| o.cells.iter().any(|c| cells.contains(*c))) {
                let message = format!("{} `{}` overlaps `{}`", keys.key, keys.name, other.opening.name);
                self.problems.push(Problem::new(path, message, "move one of them, or make it smaller"));
                continue;
            }
            self.rounded_opening(&keys, cells, axis);
            self.not_measured(&keys);
            let out = IVec3::AXES[axis] * if side == 0 { -1 } else { 1 };
            let Some(left) = self.uncovered(&keys, cells, out, &covers) else { continue };
            let planned = self.plan_opening(&keys, left, (axis, side));
            if planned.opening.layer < cells.iter().count() {
                self.hurries(&keys, planned.opening.fastest(0.0, self.case.run.end));
            }
            self.openings.push(planned);
        }
        for planned in &self.openings {
            // As deep as the wall. Around a hole that is bevelled: its rim is a particle thick.
            let out = planned.opening.outward.as_ivec3();
            let hole = planned.opening.solid.is_none();
            let sideways = self.lattice.step(1) * (IVec3::ONE - out.abs());
            for depth in 0..self.layers {
                let state = if hole { BLOCKED } else { SOLID };
                for c in planned.cells.iter().map(|c| c + depth * out) {
                    let rim = if hole { depth * sideways } else { IVec3::ZERO };
                    let cells = Cells { lo: c, hi: c + 1 }.grown(rim);
                    // At a seam the rim goes on on the other side.
                    for c in cells.iter() {
                        let c = self.grid.wrap(c);
                        if self.grid.cells.contains(c) {
                            self.grid.set(c, state);
                        }
                    }
                }
            }
        }
    }

    /// Notes which force gauges on its face leave an opening's wall out: it is a solid of its own.
    fn not_measured(&mut self, keys: &OpeningKeys) {
        let (axis, side) = keys.side();
        let face = TANK_FACES[2 * axis + side].1;
        let omits = |on: &str| stands_for(on, face) && !stands_for(on, keys.name);
        for gauge in self.case.gauge.force.iter().filter(|g| !keys.is_hole() && omits(&g.on)) {
            self.notes.push(format!(
                "gauge.force `{}` leaves out what the water does to {} `{}` in {face}: a gauge.force on that tells it",
                gauge.name, keys.key, keys.name
            ));
        }
    }

    /// Notes that an opening moved to the lattice.
    fn rounded_opening(&mut self, keys: &OpeningKeys, cells: Cells, axis: usize) {
        let [Some(min), Some(max)] = keys.corners else { return };
        let (lo, hi) = (self.lattice.corner(cells.lo), self.lattice.corner(cells.hi));
        let Some(tank) = self.tank else { return };
        let (low, high) = (self.lattice.corner(tank.lo), self.lattice.corner(tank.hi));
        for k in (0..3).filter(|&k| k != axis && !(self.lattice.plane && k == 1)) {
            let (from, to) = (min[k].max(low[k]), max[k].min(high[k]));
            if (lo[k] - from).abs().max((hi[k] - to).abs()) > 0.01 * self.lattice.spacing {
                self.notes.push(format!(
                    "{} `{}`: {} {from:.4}..{to:.4} m becomes {:.4}..{:.4} m at spacing {}",
                    keys.key, keys.name, AXES[k], lo[k], hi[k], self.lattice.spacing
                ));
            }
        }
    }

    fn plan_opening(
        &mut self,
        keys: &OpeningKeys,
        cells: Vec<IVec3>,
        (axis, side): (usize, usize),
    ) -> Planned {
        let l0 = self.lattice.spacing;
        let layer = cells.len();
        let ends = cells.iter().map(|&c| Cells { lo: c, hi: c + 1 }).reduce(Cells::union);
        let ends = ends.unwrap_or(Cells { lo: IVec3::ZERO, hi: IVec3::ZERO });
        let area = layer as f64 * l0 * l0;
        // A discharge in two dimensions is that of a metre across, of which the slice is l0 wide.
        let across = if self.lattice.plane { l0 } else { 1.0 };
        let course = |rate: &Rate, factor: f64| Course::new(&rate.rows(), factor);
        let passes = match (keys.is_inflow(), keys.velocity, keys.discharge) {
            (true, Some(velocity), _) => Passes::In(course(velocity, 1.0)),
            (true, None, Some(discharge)) => Passes::In(course(discharge, across / area)),
            (false, Some(velocity), _) => Passes::Out(course(velocity, 1.0)),
            (false, None, Some(discharge)) => Passes::Drawn(course(discharge, across)),
            (_, None, None) => Passes::Free,
        };
        let mut outward = DVec3::ZERO;
        outward[axis] = if side == 0 { -1.0 } else { 1.0 };
        let (lo, hi) = (self.lattice.corner(ends.lo), self.lattice.corner(ends.hi));
        let face = if side == 0 { hi } else { lo };
        // From the face on so deep, and so much wider than the opening.
        let box_behind = |deep: f64, wider: f64| {
            let sideways = wider * (DVec3::ONE - outward.abs());
            let (mut low, mut high) = (lo - sideways, hi + sideways);
            if side == 0 {
                low[axis] = face[axis] - deep
            } else {
                high[axis] = face[axis] + deep
            }
            if self.lattice.plane {
                (low.y, high.y) = (-l0, l0);
            }
            (low, high)
        };
        let (behind, room) = if passes == Passes::Free {
            let guided = |k: usize| self.tank.is_some_and(|t| (t.lo[k], t.hi[k]) == (ends.lo[k], ends.hi[k]));
            let aside = (0..3).filter(|&k| k != axis && !(self.lattice.plane && k == 1));
            let (deep, wider) = room_behind(aside.map(|k| (hi[k] - lo[k], guided(k), self.gravity()[k])), l0);
            // No step takes water through what is behind the room.
            let wall = f64::from(self.layers) * l0;
            (box_behind(deep + wall, wider + wall), Some(box_behind(deep, wider)))
        } else {
            // To the sides a spacing more, for what has been pressed between the particles of the wall.
            (box_behind(4.0 * f64::from(self.layers) * l0, l0), None)
        };
        let is_hole = keys.is_hole();
        let mut opening = Opening {
            name: keys.name.to_owned(),
            passes,
            solid: None,
            outward,
            face,
            behind,
            room,
            area,
            layer,
            wet: 0,
            passing: vec![],
            lid: if is_hole { cells.iter().map(|&c| self.lattice.center(c)).collect() } else { vec![] },
        };
        let mut wall = None;
        if !is_hole {
            wall = Some(self.openings.iter().filter(|o| o.wall.is_some()).count());
            // Counted from the bodies' end in `number_openings`.
            opening.solid = wall;
        }
        Planned { opening, cells, ends, wall }
    }

    /// The walls that move in the openings, as solids that stand still; after all others. Laws of particles press on them, `smooth` on the tank's
    /// wall.
    pub(super) fn opening_walls(&mut self) {
        let (lattice, layers) = (self.lattice, self.layers);
        let first = self.moving_walls.len();
        for planned in &mut self.openings {
            let Some(number) = planned.wall else { continue };
            planned.wall = Some(first + number);
            let opening = &planned.opening;
            let out = opening.outward.as_ivec3();
            // A wall that moves in leaves up to a spacing behind itself.
            let deep = layers + i32::from(opening.is_inflow());
            let last = (layers - 1) * out;
            let lo = lattice.corner(planned.ends.lo + last.min(IVec3::ZERO));
            let hi = lattice.corner(planned.ends.hi + last.max(IVec3::ZERO));
            let position = 0.5 * (lo + hi);
            let offset =
                |depth: i32| planned.cells.iter().map(move |c| lattice.center(c + depth * out) - position);
            let wall_offset: Vec<DVec3> = offset(0).collect();
            let count = wall_offset.len();
            let l0 = lattice.spacing;
            self.moving_walls.push(Solid {
                name: opening.name.clone(),
                is_body: false,
                shape: Shape::cuboid(hi - lo),
                position,
                orientation: DQuat::IDENTITY,
                frame: DQuat::IDENTITY,
                drive: Drive::Prescribed(Motion::still()),
                wall_slots: 0..0,
                dummy_slots: 0..0,
                shape_offset: DVec3::ZERO,
                wall_offset,
                dummy_offset: (1..deep).flat_map(offset).collect(),
                wall_area: vec![-opening.outward * l0 * l0; count],
                wall_to_surface: vec![-opening.outward * 0.5 * l0; count],
                wall_edges: Default::default(),
            });
        }
    }

    /// The openings with the numbers of their solids, and with what stands in front of them.
    pub(super) fn number_openings(&self) -> Vec<Opening> {
        let water: std::collections::HashSet<IVec3> = if self.openings.is_empty() {
            Default::default()
        } else {
            self.water.cell.iter().copied().collect()
        };
        let passing: Vec<usize> = self.passing().map(|(k, _)| k).collect();
        let of = |planned: &Planned| {
            let out = planned.opening.outward.as_ivec3();
            Opening {
                passing: passing.clone(),
                solid: planned.wall.map(|k| self.bodies.len() + k),
                wet: planned.cells.iter().filter(|c| water.contains(&(*c - out))).count(),
                ..planned.opening.clone()
            }
        };
        self.openings.iter().map(of).collect()
    }

    /// Slots to keep for water that comes in: all of it by the end of the run, but no more than the domain holds; or what
    /// the case says.
    pub(super) fn reserve(&mut self, domain: (DVec3, DVec3)) -> usize {
        let (l0, run) = (self.lattice.spacing, &self.case.run);
        let inflows: Vec<&Opening> =
            self.openings.iter().map(|o| &o.opening).filter(|o| o.is_inflow()).collect();
        if inflows.is_empty() {
            return 0;
        }
        let (mut comes, mut layers) = (0.0, 0);
        for opening in &inflows {
            if let Passes::In(speed) = &opening.passes {
                comes += (speed.integral(0.0, run.end) / l0).ceil() * opening.layer as f64;
                layers += opening.layer;
            }
        }
        let slice = if self.lattice.plane { l0 } else { 1.0 };
        let most = self.case.fluid.as_ref().and_then(|f| f.max_volume);
        let size = domain.1 - domain.0;
        let holds = (size.x * size.y * size.z) / l0.powi(3);
        let there = self.water.cell.len();
        let room = match most {
            Some(volume) => {
                let most = (volume * slice / l0.powi(3) - 1e-6).ceil();
                let unit = if self.lattice.plane { "m2" } else { "m3" };
                if (there as f64) > most {
                    let message = format!(
                        "fluid.max_volume: {there} particles of water at t = 0 are more than the {most} of {volume} {unit}"
                    );
                    let remedy = "make it larger, or leave it out";
                    self.problems.push(Problem::new("fluid.max_volume", message, remedy));
                }
                if most > holds.max(there as f64) {
                    self.notes.push(format!(
                        "fluid.max_volume: {volume} {unit} are more than the domain holds, which is the most that is kept room for"
                    ));
                }
                most.min(holds) - there as f64
            }
            None => comes.min(holds - there as f64),
        };
        // A layer that comes in before those that go out have been counted.
        let room = room.clamp(0.0, 4e9) as usize + layers;
        self.notes.push(format!("water: {there} particles at the start, room for {room} more that come in"));
        room
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_course_is_straight_between_its_rows_and_its_integral_exact() {
        let c = Course::new(&[[1.0, 0.0], [3.0, 4.0], [4.0, 1.0]], 0.5);
        for (t, v) in [(0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (3.0, 2.0), (3.5, 1.25), (9.0, 0.5)] {
            assert_eq!(c.value(t), v, "{t}");
        }
        assert_eq!(c.integral(0.0, 5.0), 2.0 + 1.25 + 0.5);
        assert_eq!(c.integral(2.0, 3.5), 1.5 + 0.8125);
        assert_eq!((c.most(0.0, 2.0), c.most(0.0, 9.0), c.most(5.0, 6.0)), (1.0, 2.0, 0.5));
        let c = Course::new(&[[0.0, 3.0]], 1.0);
        assert_eq!((c.value(-1.0), c.integral(1.0, 3.0), c.most(0.0, 1.0)), (3.0, 6.0, 3.0));
    }
}
