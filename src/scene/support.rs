//! Bodies with nothing under them: beside or below the tank, where nothing is ever in their way, or though they are to stand.

use super::build::{AXES, Builder};
use super::near::Near;
use super::oriented::Placed;
use super::placement::{Surroundings, point};
use super::{Drive, Solid};
use crate::case::Law;
use crate::error::Problem;
use glam::DVec3;
use std::collections::HashSet;

impl Builder<'_> {
    /// Tells of bodies that are to stand and have nothing under them.
    pub(super) fn hanging(&mut self, near: &Near, law: Law, up: Option<DVec3>) {
        let placed = Surroundings {
            fixed: &self.fixed,
            earlier: [&self.moving_walls, &self.bodies],
            near,
            law,
            spacing: self.case.run.spacing,
            plane: self.lattice.plane,
            tank: self.sides(),
            up,
        };
        let standing: HashSet<&str> =
            self.case.body.iter().filter(|b| b.standing).map(|b| b.name.as_str()).collect();
        let bodies = self.bodies.iter().filter(|b| standing.contains(b.name.as_str()));
        let notes: Vec<String> = bodies.filter_map(|body| placed.hangs(body)).collect();
        self.notes.extend(notes);
    }

    /// Complains of free bodies outside of the tank with nothing beneath them: they would fall for ever.
    pub(super) fn unsupported(&mut self) {
        let (Some(tank), gravity) = (&self.case.tank, self.gravity()) else { return };
        let down = gravity.normalize_or_zero();
        let (min, max) = (DVec3::from(tank.min), DVec3::from(tank.max));
        let solids = || self.moving_walls.iter().chain(&self.bodies);
        let mut beneath: Vec<Placed> = self.fixed.shapes.iter().map(Placed::from).collect();
        beneath.extend(solids().filter(|s| matches!(s.drive, Drive::Prescribed(_))).map(Solid::placed));
        let mut problems = Vec::new();
        for (k, solid) in self.bodies.iter().enumerate() {
            let Drive::Free(free) = &solid.drive else { continue };
            // What cannot move along gravity does not fall.
            let falls =
                (0..3).any(|k| down[k].abs() > 0.5 && !free.locked_translation[k]) || down == DVec3::ZERO;
            let own = solid.placed();
            let outside = (0..3).find(|&k| {
                let above =
                    down[k] < -0.5 && own.center[k] > max[k] || down[k] > 0.5 && own.center[k] < min[k];
                let plane = self.lattice.plane && k == 1;
                !plane && !above && (own.center[k] < min[k] || own.center[k] > max[k])
            });
            let Some(axis) = outside.filter(|_| falls && !beneath.iter().any(|b| stands_over(&own, b, down)))
            else {
                continue;
            };
            let message = format!(
                "body `{}` at {} lies outside of the tank, which spans {} to {} m along {}, with nothing beneath it",
                solid.name,
                point(solid.position),
                min[axis],
                max[axis],
                AXES[axis],
            );
            let remedy = "move its `center` into the tank, or put an obstacle or a plane under it";
            problems.push(Problem::new(format!("body.{k}.center"), message, remedy));
        }
        self.problems.extend(problems);
    }
}

/// Whether `own`, moved along `down`, can meet `other`: their shadows along `down` overlap, and `other` reaches
/// below the top of `own`. Without a direction nothing is beneath anything.
fn stands_over(own: &Placed, other: &Placed, down: DVec3) -> bool {
    if down == DVec3::ZERO {
        return false;
    }
    let between = other.center - own.center;
    let across = down.any_orthonormal_vector();
    let sides = [across, down.cross(across)];
    let shadows = sides.iter().all(|&n| between.dot(n).abs() < own.reach(n) + other.reach(n));
    shadows && between.dot(down) + other.reach(down) > -own.reach(down)
}
