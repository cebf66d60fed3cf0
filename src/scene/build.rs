//! From a case to a scene.
//!
//! Order of placement, first come first served: tank, obstacles and moving walls that are boxes of the lattice, planes,
//! obstacles and moving walls of any other shape, water, bodies.

use super::behind::Row;
use super::bodies;
use super::lattice::{Cells, Grid, Lattice};
use super::near::Near;
use super::opening::Planned;
use super::oriented::Placed;
use super::placement::{Surroundings, point};
use super::shaped;
use super::walls::{self, Fixed, PlaneFrame};
use super::water::{Flow, Water};
use super::{Scene, Solid};
pub(super) use crate::case::AXES;
use crate::case::{Case, Law, stands_for};
use crate::error::{CaseError, Problem, Result};
use crate::periodic::Periodic;
use glam::{DMat3, DVec3, IVec3};

impl Scene {
    /// Builds the scene of a case: particles on their lattices, solids with their geometry, the domain.
    ///
    /// # Errors
    /// [`crate::error::Error::Case`] with every problem that the case or its geometry at t = 0 has: bodies that overlap
    /// walls, water or each other, water that would run away, things outside of the domain.
    pub fn build(case: &Case) -> Result<Self> {
        crate::case::check::refuse(case)?;
        let notes = crate::far::refuse(case)?;
        let mut builder = Builder::new(case)?;
        builder.notes = notes;
        builder.walls();
        builder.water();
        builder.open_faces();
        builder.bodies();
        builder.meetings();
        builder.stood_before();
        builder.room();
        builder.overfilled();
        builder.gauges();
        builder.coarse();
        let domain = builder.domain();
        let reserve = builder.reserve(domain);
        if !builder.problems.is_empty() {
            return Err(CaseError::new(builder.problems.clone(), listed(&builder.problems)).into());
        }
        Ok(builder.assemble(domain, reserve))
    }
}

/// Problems that are told; nobody reads a thousand.
const MOST_TOLD: usize = 20;

/// Problems of a scene as one text.
fn listed(problems: &[Problem]) -> String {
    let lines: Vec<String> =
        problems.iter().take(MOST_TOLD).map(|p| format!("{}: {}", p.message, p.remedy)).collect();
    match lines.as_slice() {
        [one] => one.clone(),
        many => {
            let more = problems.len() - many.len();
            let more = if more > 0 { format!("\n  and {more} more") } else { String::new() };
            format!("{} problems at t = 0:\n  - {}{more}", problems.len(), many.join("\n  - "))
        }
    }
}

/// A scene while it grows.
pub(super) struct Builder<'a> {
    pub(super) case: &'a Case,
    pub(super) lattice: Lattice,
    pub(super) grid: Grid,
    /// Wall layer and dummies: 1 + the most layers that lie strictly within re of the wall layer.
    pub(super) layers: i32,
    pub(super) tank: Option<Cells>,
    pub(super) periodic: Periodic,
    pub(super) fixed: Fixed,
    pub(super) moving_walls: Vec<Solid>,
    /// Walls that are no boxes of the lattice.
    pub(super) off_lattice: Vec<Placed>,
    pub(super) openings: Vec<Planned>,
    pub(super) bodies: Vec<Solid>,
    pub(super) water: Water,
    pub(super) depth: f64,
    pub(super) filled: bool,
    pub(super) full: Option<f64>,
    /// Whether a wall of the case could not be built: of gauges nothing is said then, for they may be on it.
    pub(super) lacks_walls: bool,
    pub(super) notes: Vec<String>,
    pub(super) problems: Vec<Problem>,
}

impl<'a> Builder<'a> {
    fn new(case: &'a Case) -> Result<Self> {
        let run = &case.run;
        let blocks = case.fluid.as_ref().map_or(&[][..], |f| &f.block);
        let shapes = shaped::of_water(case)
            .into_iter()
            .flatten()
            .map(|s| ((s.center - s.bounds()).to_array(), (s.center + s.bounds()).to_array()));
        let shapes: Vec<_> = shapes.collect();
        let anchor = case.tank.as_ref().map(|t| t.min).or_else(|| blocks.first().map(|b| b.min));
        let anchor = anchor.or_else(|| shapes.first().map(|s| s.0));
        let lattice = Lattice::new(anchor.unwrap_or_default().into(), run.spacing, run.dimensions);
        let layers = run.effective_radius.ceil() as i32;
        let tank = case.tank.as_ref().map(|t| lattice.tank_cells(t.min.into(), t.max.into()));
        let outer = case.tank.as_ref().zip(tank);
        let outer =
            outer.map(|(t, c)| walls::outer(c, walls::closed(&t.without_wall(), lattice.plane), layers));
        let boxes = case.obstacle.iter().filter_map(|o| o.corners());
        let boxes = boxes.chain(case.moving_wall.iter().filter_map(|w| w.corners()));
        let boxes = boxes.chain(blocks.iter().map(|b| (b.min, b.max)));
        let boxes = boxes.chain(shapes);
        // A vessel of any shape holds water without a tank.
        let boxes = boxes.chain(if case.tank.is_none() { shaped::boxes(case) } else { vec![] });
        let all = boxes.map(|(min, max)| lattice.cells(min.into(), max.into())).chain(outer);
        let all = all.reduce(Cells::union).unwrap_or(Cells { lo: IVec3::ZERO, hi: IVec3::ZERO });
        // One free cell around everything, so that what leaves can be seen to leave.
        let mut grid = Grid::new(all.grown(lattice.step(1)), run.spacing)?;
        let along = case.tank.as_ref().map_or([false; 3], |t| t.periodic());
        let sides = tank.map_or((DVec3::ZERO, DVec3::ZERO), |t| (lattice.corner(t.lo), lattice.corner(t.hi)));
        let periodic = Periodic::new(along, sides.0, sides.1);
        tank.into_iter().for_each(|tank| grid.close(tank, along));
        Ok(Self {
            case,
            lattice,
            grid,
            layers,
            tank,
            periodic,
            fixed: Fixed::default(),
            moving_walls: Vec::new(),
            off_lattice: Vec::new(),
            openings: Vec::new(),
            bodies: Vec::new(),
            water: Water::default(),
            depth: 0.0,
            filled: false,
            full: None,
            lacks_walls: false,
            notes: Vec::new(),
            problems: Vec::new(),
        })
    }

    /// Corners of the tank as the lattice has it [m].
    pub(super) fn sides(&self) -> Option<(DVec3, DVec3)> {
        self.tank.map(|tank| (self.lattice.corner(tank.lo), self.lattice.corner(tank.hi)))
    }

    /// Gravity [m/s2], in the plane in two dimensions.
    pub(super) fn gravity(&self) -> DVec3 {
        let mut g: DVec3 = self.case.run.gravity.into();
        if self.lattice.plane {
            g.y = 0.0;
        }
        g
    }

    fn walls(&mut self) {
        let (case, lattice, layers) = (self.case, self.lattice, self.layers);
        for (k, axis) in AXES.iter().enumerate() {
            if let Some((low, high)) = self.periodic.sides(k) {
                self.notes.push(format!("tank: periodic along {axis}, from {low:.4} to {high:.4} m"));
            }
        }
        self.carve();
        if let Some(tank) = &case.tank {
            self.fixed.tank(tank, &lattice, &mut self.grid, layers);
            let (min, max): (DVec3, DVec3) = (tank.min.into(), tank.max.into());
            let rounded = lattice.corner(lattice.tank_cells(min, max).hi) - lattice.corner(IVec3::ZERO);
            let off = (rounded - (max - min)).abs();
            let lines = self
                .changed(off)
                .map(|k| format!("length {} {:.4} m becomes {:.4} m", AXES[k], (max - min)[k], rounded[k]));
            let line = lines.collect::<Vec<_>>().join(", ");
            if !line.is_empty() {
                self.notes.push(format!("tank: {line} at spacing {}", lattice.spacing));
            }
        }
        for (k, obstacle) in case.obstacle.iter().enumerate() {
            let Some(corners) = obstacle.corners() else { continue };
            let label = format!("obstacle `{}`", obstacle.name);
            if !self.on_lattice(&format!("obstacle.{k}"), &label, corners) {
                continue;
            }
            let taken = self.fixed.obstacle(obstacle, corners, &lattice, &mut self.grid, layers);
            self.rounded(&label, corners.0.into(), corners.1.into());
            self.taken(&label, taken, false);
            let gauged = case.gauge.force.iter().any(|gauge| stands_for(&gauge.on, &obstacle.name));
            let size = (DVec3::from(corners.1) - DVec3::from(corners.0)).abs();
            if gauged && self.is_thin(size) {
                let why = "where water stands on both sides these share one pressure, and its force gauge tells next to nothing";
                self.notes.push(format!("{label}: one particle thick: {why}; two spacings would do"));
            }
        }
        for (k, wall) in case.moving_wall.iter().enumerate() {
            let Some(corners) = wall.corners() else { continue };
            let label = format!("moving wall `{}`", wall.name);
            if !self.on_lattice(&format!("moving_wall.{k}"), &label, corners) {
                continue;
            }
            let (solid, taken) = walls::moving_wall(wall, corners, case, &lattice, &mut self.grid, layers);
            self.rounded(&label, corners.0.into(), corners.1.into());
            if taken > 0 && solid.wall_offset.is_empty() && solid.dummy_offset.is_empty() {
                let message =
                    format!("{label}: nothing is left of it: walls stand in all of its {taken} cells");
                let remedy = "let it begin clear of them, inside the tank";
                self.problems.push(Problem::new(format!("moving_wall.{k}"), message, remedy));
                self.lacks_walls = true;
                continue;
            }
            self.taken(&label, taken, true);
            if self.is_thin(2.0 * solid.shape.extent(DMat3::IDENTITY)) {
                self.notes
                    .push(format!("{label}: one particle thick, so that its two sides share one pressure"));
            }
            self.moving_walls.push(solid);
        }
        for (number, plane) in case.plane.iter().enumerate() {
            let frame = PlaneFrame::new(plane, &lattice, &self.periodic);
            let half =
                0.5 * (plane.size[0] * frame.axes.x_axis.abs() + plane.size[1] * frame.axes.y_axis.abs());
            let ends = (frame.center - half, frame.center + half);
            self.crosses(&format!("plane.{number}"), &format!("plane `{}`", plane.name), ends, true);
            let before = self.fixed.wall.len();
            let left_out = self.fixed.plane(&plane.name, &frame, &lattice, &mut self.grid, layers);
            let rows = self.fixed.wall[before..].iter().zip(&self.fixed.normal[before..]);
            let rows: Vec<Row> = rows.map(|(x, n)| Row(*x, *n)).collect();
            self.fixed.make_room(&rows, lattice.spacing);
            self.off_lattice.push(frame.displaced(layers));
            let n = frame.n.map(|n| f64::from(n) * lattice.spacing);
            for (k, length) in n.into_iter().enumerate().filter(|&(k, _)| !(lattice.plane && k == 1)) {
                if (length - plane.size[k]).abs() > 0.01 * lattice.spacing {
                    self.notes.push(format!(
                        "plane `{}`: size {} {:.4} m becomes {length:.4} m at spacing {}",
                        plane.name,
                        ["along", "across"][k],
                        plane.size[k],
                        lattice.spacing
                    ));
                }
            }
            if left_out > 0 {
                self.notes.push(format!(
                    "plane `{}`: {left_out} particles left out where another wall already stands",
                    plane.name
                ));
            }
        }
        self.shaped();
        self.opening_walls();
    }

    fn water(&mut self) {
        let Some(fluid) = &self.case.fluid else { return };
        for (k, block) in fluid.block.iter().enumerate() {
            let key = format!("fluid.block.{k}");
            if !self.on_lattice(&key, &key, (block.min, block.max)) {
                continue;
            }
            self.water.fill(block, &self.lattice, &mut self.grid);
            if self.beside_walls(None) == 0 {
                let message = format!("{key}: no free cell in it at spacing {}", self.lattice.spacing);
                let remedy = "it lies inside walls or other water, move it or use a smaller run.spacing";
                self.problems.push(Problem::new(key, message, remedy));
            }
            self.rounded(&format!("fluid.block.{k}"), block.min.into(), block.max.into());
        }
        for (k, (shape, water)) in shaped::of_water(self.case).into_iter().zip(&fluid.shape).enumerate() {
            let key = format!("fluid.shape.{k}");
            let placed = match shape {
                Ok(placed) => placed,
                Err(problem) => {
                    self.problems.push(Problem { key: format!("{key}.{}", problem.key), ..*problem });
                    continue;
                }
            };
            let flow = Flow::new(water.velocity, water.velocity_gradient, placed.center, &self.lattice);
            let from = self.water.clear;
            self.water.shape(&placed, &flow, &self.lattice, &mut self.grid);
            let count = self.beside_walls(Some(&placed));
            if count == 0 {
                let message = format!("{key}: no free cell in it at spacing {}", self.lattice.spacing);
                let remedy = "it lies inside walls or other water, move it or use a smaller run.spacing";
                self.problems.push(Problem::new(key, message, remedy));
            } else {
                // A level is that of whole cells.
                let reach = self.reach_of_water(from);
                self.notes.push(format!("{key}: {count} particles of water{reach}"));
            }
        }
        for (k, fill) in fluid.fill.iter().enumerate() {
            let from = self.water.clear;
            match self.water.flood(fill, &self.lattice, &mut self.grid, self.tank) {
                Ok(()) => {
                    let count = self.beside_walls(None);
                    let reach = self.reach_of_water(from);
                    let level = self.rounded_level(fill.level, from);
                    self.notes.push(format!("fluid.fill.{k}: {count} particles of water{reach}{level}"));
                }
                Err(problem) => {
                    let key = format!("fluid.fill.{k}.{}", problem.key);
                    let message = format!("fluid.fill.{k}: {}", problem.message);
                    self.problems.push(Problem { key, message, ..*problem });
                }
            }
        }
        self.filled = self.water.fills(&self.lattice, &self.grid);
        // What of gravity lies along a periodic axis presses on nothing.
        let gravity = self.periodic.across(self.gravity());
        self.depth = self.water.depth(gravity, &self.lattice);
        self.depth = self.depth_with_inflows(gravity);
    }

    /// Takes away what of the water laid last, perhaps `within` a shape, stands where walls do that are no boxes of the lattice; returns how many particles it
    /// has then.
    fn beside_walls(&mut self, within: Option<&Placed>) -> usize {
        let from = self.water.clear;
        for shape in &self.off_lattice {
            self.water.remove(shape, (from, within), &self.lattice, &mut self.grid);
        }
        self.water.laid.push(from);
        self.drain_walls();
        self.water.clear = self.water.cell.len();
        self.water.clear - from
    }

    fn bodies(&mut self) {
        let case = self.case;
        let gravity = self.gravity();
        let law = case.contact.as_ref().map_or(Law::Smooth, |c| c.law);
        let mut near = Near::default();
        let add = |near: &mut Near, solid: &Solid| {
            let (placed, reach) = (solid.placed(), solid.placed().bounds());
            near.add(placed.center - reach, placed.center + reach);
        };
        self.moving_walls.iter().for_each(|wall| add(&mut near, wall));
        let up = (gravity.length() > 0.0).then(|| -gravity.normalize());
        let mut numbers = Vec::new();
        for (k, mut solid) in self.in_order_of_placement(up) {
            let body = &case.body[k];
            self.thin(&format!("body.{k}"), &solid);
            let surroundings = Surroundings {
                fixed: &self.fixed,
                earlier: [&self.moving_walls, &self.bodies],
                near: &near,
                law,
                spacing: case.run.spacing,
                plane: self.lattice.plane,
                tank: self.sides(),
                up,
            };
            match surroundings.place(&mut solid, body.standing) {
                Ok(note) => self.notes.extend(note),
                Err((message, remedy)) => {
                    self.problems.push(Problem::new(format!("body.{k}"), message, remedy));
                }
            }
            let what = solid.what();
            self.seams(&format!("body.{k}"), what, &solid.name, &solid.placed(), false);
            let shape = solid.placed();
            let wet = if body.displaces_fluid {
                Water::displace(&shape, &self.lattice, &mut self.grid)
            } else {
                Water::inside(&shape, &self.lattice, &self.grid)
            };
            if body.displaces_fluid {
                self.drain(&solid, 0);
            }
            if wet > 0 && body.displaces_fluid {
                self.notes.push(format!("body `{}`: displaces {wet} fluid particles", body.name));
            } else if wet > 0 {
                let place = point(solid.shape_center());
                let message =
                    format!("body `{}` at {place} overlaps {wet} fluid particles at t = 0", body.name);
                let remedy = "set `displaces_fluid = true`, or move it out of the water";
                self.problems.push(Problem::new(format!("body.{k}.displaces_fluid"), message, remedy));
            }
            add(&mut near, &solid);
            self.bodies.push(solid);
            numbers.push(k);
        }
        self.hanging(&near, law, up);
        // From here on they stand as the case lists them.
        let mut placed: Vec<(usize, Solid)> =
            numbers.into_iter().zip(std::mem::take(&mut self.bodies)).collect();
        placed.sort_by_key(|(k, _)| *k);
        self.bodies = placed.into_iter().map(|(_, solid)| solid).collect();
        self.water.keep_what_is_left(&self.grid);
        self.depth_of_waves();
        self.unsupported();
        self.problems.extend(self.water.leak(gravity, &self.lattice, &mut self.grid, self.tank));
    }

    /// The bodies with their numbers in the case, in the order in which they are placed: those that stand last, from the lowest up, each
    /// on what is there.
    fn in_order_of_placement(&mut self, up: Option<DVec3>) -> Vec<(usize, Solid)> {
        let case = self.case;
        let mut made = Vec::new();
        for (k, body) in case.body.iter().enumerate() {
            match bodies::body(body, case.run.spacing, case.run.dimensions, self.layers) {
                Ok(solid) => made.push((k, solid)),
                Err(problem) => {
                    let key = format!("body.{k}.{}", problem.key);
                    self.problems.push(Problem { key, ..*problem });
                }
            }
        }
        if let Some(up) = up {
            let bottom = |(k, solid): &(usize, Solid)| {
                let placed = solid.placed();
                if case.body[*k].standing {
                    placed.center.dot(up) - placed.reach(-up)
                } else {
                    f64::NEG_INFINITY
                }
            };
            made.sort_by(|a, b| bottom(a).total_cmp(&bottom(b)));
        }
        made
    }

    /// Moving walls, obstacles off the lattice and bodies: all solids but those in openings, which come last of the walls.
    pub(super) fn solids_of_case(&self) -> impl Iterator<Item = &Solid> {
        let own = self.moving_walls.len() - self.openings.iter().filter(|o| o.wall.is_some()).count();
        self.moving_walls[..own].iter().chain(&self.bodies)
    }

    /// Whether a box of the lattice of this `size` [m] is one particle thick.
    fn is_thin(&self, size: DVec3) -> bool {
        (0..3).any(|k| size[k] < 1.5 * self.lattice.spacing && !(self.lattice.plane && k == 1))
    }
}
