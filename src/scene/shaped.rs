//! Obstacles and moving walls of any shape: solids that stand still or follow a table, with water around them.

use super::build::Builder;
use super::oriented::Placed;
use super::placement::point;
use super::walls::wall_motion;
use super::{Drive, Motion, Shape, Solid};
use crate::case::{Body, Case, Form, MovingWall, Place, Vector, Wall, coarse};
use crate::error::Problem;
use glam::{DMat3, DVec3};
use std::collections::HashSet;

/// A wall without particles, where it stands; `moved` if it moves.
fn wall(
    name: &str,
    form: &Form,
    place: Place,
    moved: Option<&MovingWall>,
    case: &Case,
) -> Result<Solid, Box<Problem>> {
    let plane = case.run.dimensions == 2;
    let (shape, _) = form.shape(case.run.spacing, plane)?;
    let turn = form.turn(plane);
    let mut position: DVec3 = match place {
        Place::Center(at) => at.into(),
        Place::Position(at) => DVec3::from(at) + turn * shape.origin(),
    };
    if plane {
        position.y = 0.0;
    }
    Ok(Solid {
        name: name.to_owned(),
        is_body: false,
        shape,
        position,
        orientation: turn * shape.frame(),
        frame: form.upended(plane) * shape.frame(),
        drive: Drive::Prescribed(moved.map_or_else(Motion::still, |w| wall_motion(w, case, position))),
        wall_slots: 0..0,
        dummy_slots: 0..0,
        shape_offset: DVec3::ZERO,
        wall_offset: vec![],
        dummy_offset: vec![],
        wall_area: vec![],
        wall_to_surface: vec![],
        wall_edges: Default::default(),
    })
}

/// All walls of a case that are no boxes of the lattice: key of the table, whether it is fixed, and the wall.
fn walls(case: &Case) -> Vec<(String, bool, Result<Solid, Box<Problem>>)> {
    let tank = case.tank.as_ref();
    let obstacles = case
        .obstacle
        .iter()
        .enumerate()
        .map(|(k, o)| (format!("obstacle.{k}"), None, o.name.as_str(), o.wall(tank)));
    let moving = case
        .moving_wall
        .iter()
        .enumerate()
        .map(|(k, w)| (format!("moving_wall.{k}"), Some(w), w.name.as_str(), w.wall(tank)));
    let shaped = obstacles.chain(moving).filter_map(|(key, moved, name, keys)| match keys {
        Wall::Lattice(..) => None,
        Wall::Shaped(form, place) => Some((key, moved.is_none(), wall(name, &form, place, moved, case))),
    });
    shaped.collect()
}

/// Those of them that are fixed and can be built.
pub(super) fn fixed(case: &Case) -> impl Iterator<Item = Solid> {
    walls(case).into_iter().filter(|wall| wall.1).filter_map(|wall| wall.2.ok())
}

/// Corners of the boxes around all of them [m]; what cannot be read is reported where it is built.
pub(super) fn boxes(case: &Case) -> Vec<(Vector, Vector)> {
    let around = |solid: Solid| {
        let shape = solid.placed();
        let half = shape.bounds();
        ((shape.center - half).to_array(), (shape.center + half).to_array())
    };
    walls(case).into_iter().filter_map(|(_, _, solid)| solid.ok().map(around)).collect()
}

/// The shapes of a case's water, where they are, or what is wrong with them.
pub(super) fn of_water(case: &Case) -> Vec<Result<Placed, Box<Problem>>> {
    let shapes = case.fluid.iter().flat_map(|f| &f.shape);
    let tank = case.tank.as_ref();
    shapes.map(|w| Ok(wall("water", &w.form(tank), w.place(), None, case)?.placed())).collect()
}

impl Builder<'_> {
    /// Obstacles and moving walls of any shape: their particles, and no water where they stand.
    pub(super) fn shaped(&mut self) {
        let run = &self.case.run;
        for (key, fixed, solid) in walls(self.case) {
            let mut solid = match solid {
                Ok(solid) => solid,
                Err(problem) => {
                    let key = format!("{key}.{}", problem.key);
                    self.problems.push(Problem { key, ..*problem });
                    self.lacks_walls = true;
                    continue;
                }
            };
            let particles = solid.shape.particles(run.spacing, run.dimensions, self.layers);
            solid.wall_offset = particles.wall;
            solid.dummy_offset = particles.dummy;
            solid.wall_area = particles.area;
            solid.wall_to_surface = particles.to_surface;
            solid.wall_edges = particles.edges;
            self.thin(&key, &solid);
            self.seams(&key, solid.what(), &solid.name, &solid.placed(), fixed);
            if fixed {
                self.bury(&key, &mut solid);
                self.stand_before(&solid);
            }
            if !solid.wall_offset.is_empty() {
                self.grid.put(&solid.placed(), &self.lattice);
                self.off_lattice.push(solid.placed());
                self.moving_walls.push(solid);
            }
        }
    }

    /// Tells of files in single precision whose coordinates are so large that the steps between them bend what they describe.
    pub(super) fn coarse(&mut self) {
        let (case, tank) = (self.case, self.case.tank.as_ref());
        let walls =
            case.obstacle.iter().map(|o| o.form(tank)).chain(case.moving_wall.iter().map(|w| w.form(tank)));
        let water = case.fluid.iter().flat_map(|f| &f.shape).map(|w| w.form(tank));
        let mut told = HashSet::new();
        for form in walls.chain(water).chain(case.body.iter().map(Body::form)) {
            let Some(file) = form.file.filter(|file| told.insert(*file)) else { continue };
            let steps: Option<(f64, f64)> = match form.shape(self.lattice.spacing, self.lattice.plane) {
                #[cfg(feature = "mesh")]
                Ok((Shape::Mesh(mesh), _)) => mesh.steps(),
                _ => None,
            };
            if let Some(coarse) = coarse(steps, self.lattice.spacing) {
                self.notes.push(format!("{file}: {coarse}"));
            }
        }
    }

    /// What is thinner than two particles has none inside, and what is thinner than one none at all. `key` is that of
    /// its table.
    pub(super) fn thin(&mut self, key: &str, solid: &Solid) {
        let l0 = self.lattice.spacing;
        let (least, place, of, whose) = match solid.shape {
            #[cfg(feature = "mesh")]
            Shape::Mesh(mesh) => {
                let thin = mesh.thickness();
                let (of, whose) =
                    if mesh.is_file() { ("file", "of its file") } else { ("shape", "of its own frame") };
                (thin.least, thin.place, of, whose)
            }
            Shape::Polygon(polygon) => {
                let (least, place) = polygon.thinnest();
                (least, place, "shape", "of its section")
            }
            _ if solid.is_body => return,
            shape => {
                let mut lengths = 2.0 * shape.extent(DMat3::IDENTITY);
                if self.lattice.plane {
                    lengths.y = lengths.x;
                }
                (lengths.min_element(), DVec3::ZERO, "shape", "of its own frame")
            }
        };
        let named = format!("{} `{}`", solid.what(), solid.name);
        let message = format!("{named} is {least:.2e} m thin at {} {whose}", point(place));
        let key = format!("{key}.{of}");
        let lengths = 2.0 * solid.shape.extent(DMat3::IDENTITY);
        let longest = if self.lattice.plane { lengths.x.max(lengths.z) } else { lengths.max_element() };
        let stand = solid.wall_offset.len();
        if longest < 2.0 * l0 && (least < l0 || stand < 4) {
            let message = format!("{named} is {longest:.2e} m long, too small for particles of {l0} m");
            let remedy = format!("use run.spacing = {:.1e} or less, or check its `scale`", 0.25 * longest);
            self.problems.push(Problem::new(key, message, remedy));
        } else if least < l0 * (1.0 - 1e-6) {
            let message = format!("{message}, less than one particle of {l0} m");
            let remedy = format!("use run.spacing = {least:.1e} or less, or thicken it");
            self.problems.push(Problem::new(key, message, remedy));
        } else if stand < 4 {
            let message = format!("{named} has room for {stand} particles of {l0} m on its surface alone");
            let remedy = format!("use run.spacing = {:.1e} or less, or make it larger", 0.5 * l0);
            self.problems.push(Problem::new(key, message, remedy));
        } else if least < 2.0 * l0 * (1.0 - 1e-6) {
            self.notes
                .push(format!("{message}: less than two particles of {l0} m, the force on it is rough"));
        }
    }
}
