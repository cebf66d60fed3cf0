//! What of an opening is covered. Where fixed walls stand before it the tank's wall stands in its cells as beside the opening; what moves covers them as long as it stands
//! there.

use super::build::Builder;
use super::lattice::{Cells, Lattice};
use super::oriented::Placed;
use super::shaped;
use super::walls::PlaneFrame;
use super::{Opening, Scene, Solid};
use crate::case::{Case, OpeningKeys};
use crate::error::Problem;
use crate::periodic::Periodic;
use glam::{DVec3, IVec3};
use std::collections::HashSet;

/// Where nothing may stand in the way of what comes in, from where it becomes water on, over the spacing [-]: through a gap of a spacing between a face and what
/// stands before it all water of an inflow would have to pass in a row of single particles, and is pressed together.
pub(crate) const INFLOW_ROOM: f64 = 0.55;

enum Body {
    /// A box of the lattice.
    Cells(Cells),
    /// Any other shape.
    Placed(Placed),
}

/// A fixed wall within the tank: what it is, with its name.
struct Cover {
    label: String,
    body: Body,
}

impl Cover {
    /// Whether it covers the cell `c` of an opening, see [`before`].
    fn holds(&self, c: IVec3, out: IVec3, is_inflow: bool, lattice: &Lattice) -> bool {
        match &self.body {
            Body::Cells(cells) => cells.contains(c - out) || is_inflow && cells.contains(c - 2 * out),
            Body::Placed(shape) => before(c, out, is_inflow, lattice).any(|x| shape.holds(x, 0.0)),
        }
    }
}

/// The places before the cell `c` of an opening, the way `out` back, of which none may lie in a solid [m]: the middle of the cell before it,
/// and of an inflow a place [`INFLOW_ROOM`] further.
fn before(c: IVec3, out: IVec3, is_inflow: bool, lattice: &Lattice) -> impl Iterator<Item = DVec3> {
    let middle = lattice.center(c - out);
    let further = middle - INFLOW_ROOM * lattice.spacing * out.as_dvec3();
    [Some(middle), is_inflow.then_some(further)].into_iter().flatten()
}

/// The fixed walls of a case besides the tank; what cannot be built is told where it would be.
pub(super) struct Covers(Vec<Cover>);

impl Covers {
    pub fn of(case: &Case, lattice: &Lattice, periodic: &Periodic, layers: i32) -> Self {
        let obstacle = |name: &str, body: Body| Cover { label: format!("obstacle `{name}`"), body };
        let boxes = case.obstacle.iter().filter_map(|o| Some((o, o.corners()?)));
        let boxes = boxes
            .map(|(o, (min, max))| obstacle(&o.name, Body::Cells(lattice.cells(min.into(), max.into()))));
        let shaped = shaped::fixed(case).map(|solid| obstacle(&solid.name, Body::Placed(solid.placed())));
        let planes = case.plane.iter().map(|plane| Cover {
            label: format!("plane `{}`", plane.name),
            body: Body::Placed(PlaneFrame::new(plane, lattice, periodic).slab(layers)),
        });
        Self(boxes.chain(shaped).chain(planes).collect())
    }
}

impl Builder<'_> {
    /// Those of the `cells` of an opening in front of which, the way `out` back, no fixed wall stands: what came in there would come into the wall. A note tells of
    /// the others. `None` if none is left, which is a problem.
    pub(super) fn uncovered(
        &mut self,
        keys: &OpeningKeys,
        cells: Cells,
        out: IVec3,
        covers: &Covers,
    ) -> Option<Vec<IVec3>> {
        let lattice = self.lattice;
        let all = cells.iter().count();
        let mut in_front = vec![false; covers.0.len()];
        let mut free = |c: &IVec3| match covers
            .0
            .iter()
            .position(|cover| cover.holds(*c, out, keys.is_inflow(), &lattice))
        {
            Some(k) => {
                in_front[k] = true;
                false
            }
            None => true,
        };
        let left: Vec<IVec3> = cells.iter().filter(|c| free(c)).collect();
        let told = covers.0.iter().zip(in_front).filter(|(_, in_front)| *in_front);
        let labels = told.map(|(cover, _)| cover.label.as_str()).collect::<Vec<_>>().join(", ");
        let named = format!("{} `{}`", keys.key, keys.name);
        if left.is_empty() {
            let message = format!("{named}: {labels} before it, all of its {all} cells are covered");
            let remedy =
                "move its `min` and `max` to where the face stands free, or end what is before it earlier";
            let key = if keys.corners[0].is_some() { ".min" } else { "" };
            self.problems.push(Problem::new(format!("{}{key}", keys.path()), message, remedy));
            return None;
        }
        if left.len() < all {
            let (covered, passes) = (all - left.len(), left.len());
            self.notes.push(format!(
                "{named}: {labels} before it, {covered} of its {all} cells are covered: the water passes the other {passes}"
            ));
        }
        Some(left)
    }

    /// Solids that may stand before openings in the course of a run, with their numbers: all but obstacles, whose cells openings do not have.
    pub(super) fn passing(&self) -> impl Iterator<Item = (usize, &Solid)> {
        let obstacles: HashSet<&str> = self.case.obstacle.iter().map(|o| o.name.as_str()).collect();
        let numbered = self.bodies.iter().chain(&self.moving_walls).enumerate();
        let of_case = numbered.take(self.solids_of_case().count());
        of_case.filter(move |(_, solid)| solid.is_body || !obstacles.contains(solid.name.as_str()))
    }

    /// Notes the openings before which something stands at t = 0 that is no obstacle.
    pub(super) fn stood_before(&mut self) {
        let mut notes = Vec::new();
        for planned in &self.openings {
            let (opening, all) = (&planned.opening, planned.cells.len());
            let out = opening.outward.as_ivec3();
            for (_, solid) in self.passing() {
                let shape = solid.placed();
                let image = |x: DVec3| shape.center + self.periodic.nearest(x - shape.center);
                let inside = |x: DVec3| shape.holds(x, 0.0) || shape.holds(image(x), 0.0);
                let covers = |c: &&IVec3| before(**c, out, opening.is_inflow(), &self.lattice).any(inside);
                let covered = planned.cells.iter().filter(covers).count();
                if covered == 0 {
                    continue;
                }
                let (what, name) = (solid.what(), &solid.name);
                notes.push(if opening.is_inflow() {
                    format!(
                        "inflow `{}`: {what} `{name}` stands before {covered} of its {all} cells at t = 0, where no water comes in as long as it does",
                        opening.name
                    )
                } else {
                    format!("outflow `{}`: {what} `{name}` lies on {covered} of its {all} cells at t = 0", opening.name)
                });
            }
        }
        self.notes.extend(notes);
    }

    /// A layer is emitted or swallowed once a step at most: of a discharge through what is left of an opening the case itself does not tell the
    /// speed.
    pub(super) fn hurries(&mut self, keys: &OpeningKeys, fastest: f64) {
        let (run, l0) = (&self.case.run, self.lattice.spacing);
        if keys.discharge.is_none() || run.adaptive || fastest * run.time_step <= 0.5 * l0 {
            return;
        }
        let message = format!(
            "{} `{}`: through what is left of it water passes at {fastest:.3} m/s, up to {:.2} particles far in a step of {} s",
            keys.key,
            keys.name,
            fastest * run.time_step / l0,
            run.time_step
        );
        let remedy =
            format!("use run.time_step = {:.1e} or less, or run.adaptive = true", 0.35 * l0 / fastest);
        self.problems.push(Problem::new(format!("{}.discharge", keys.path()), message, remedy));
    }
}

impl Scene {
    /// Most parts of the layers of inflows that may become water in a step: solids hold back what lies between.
    pub(crate) fn emissions(&self) -> usize {
        let inflows = self.openings.iter().filter(|o| o.is_inflow());
        let parts = |o: &Opening| if o.passing.is_empty() { 1 } else { o.layer.div_ceil(2) };
        inflows.map(parts).sum::<usize>().max(1)
    }
}
