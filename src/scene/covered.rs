//! What of an opening fixed walls cover: nothing passes there, and the tank's wall stands in these cells as beside the opening.

use super::build::Builder;
use super::lattice::{Cells, Lattice};
use super::oriented::Placed;
use super::shaped;
use super::walls::PlaneFrame;
use crate::case::{Case, OpeningKeys};
use crate::error::Problem;
use glam::IVec3;

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
    fn holds(&self, c: IVec3, lattice: &Lattice) -> bool {
        match &self.body {
            Body::Cells(cells) => cells.contains(c),
            Body::Placed(shape) => shape.holds(lattice.center(c), 0.0),
        }
    }
}

/// The fixed walls of a case besides the tank; what cannot be built is told where it would be.
pub(super) struct Covers(Vec<Cover>);

impl Covers {
    pub fn of(case: &Case, lattice: &Lattice, layers: i32) -> Self {
        let obstacle = |name: &str, body: Body| Cover { label: format!("obstacle `{name}`"), body };
        let boxes = case.obstacle.iter().filter_map(|o| Some((o, o.corners()?)));
        let boxes = boxes
            .map(|(o, (min, max))| obstacle(&o.name, Body::Cells(lattice.cells(min.into(), max.into()))));
        let shaped = shaped::fixed(case).map(|solid| obstacle(&solid.name, Body::Placed(solid.placed())));
        let planes = case.plane.iter().map(|plane| Cover {
            label: format!("plane `{}`", plane.name),
            body: Body::Placed(PlaneFrame::new(plane, lattice).slab(layers)),
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
        let mut free = |c: &IVec3| match covers.0.iter().position(|cover| cover.holds(*c - out, &lattice)) {
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
