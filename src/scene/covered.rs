//! What of an opening is covered. Where fixed walls stand before it the tank's wall stands in its cells as beside the opening; what moves covers them as long as it stands
//! there.

use super::build::Builder;
use super::lattice::{Cells, Lattice};
use super::oriented::Placed;
use super::shaped;
use super::walls::PlaneFrame;
use super::{Opening, Scene, Solid};
use crate::body::Pose;
use crate::case::{Case, OpeningKeys};
use crate::error::Problem;
use glam::{DVec3, IVec3};

/// Where nothing may stand in the way of what comes in, from where it becomes water on, over the spacing [-]: through a gap of a spacing between a face and what
/// stands before it all water of an inflow would have to pass in a row of single particles, and is pressed together.
const ROOM: f64 = 0.55;

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
/// and of an inflow a place [`ROOM`] further.
fn before(c: IVec3, out: IVec3, is_inflow: bool, lattice: &Lattice) -> impl Iterator<Item = DVec3> {
    let middle = lattice.center(c - out);
    let further = middle - ROOM * lattice.spacing * out.as_dvec3();
    [Some(middle), is_inflow.then_some(further)].into_iter().flatten()
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

    /// Notes the openings before which something stands at t = 0 that may move or is held: see [`Scene::stands_before`].
    pub(super) fn stood_before(&mut self) {
        let solids: Vec<(&Solid, Placed)> = self.solids_of_case().map(|s| (s, s.placed())).collect();
        let mut notes = Vec::new();
        for planned in &self.openings {
            let (opening, all) = (&planned.opening, planned.cells.len());
            let out = opening.outward.as_ivec3();
            let holds = |shape: &Placed, c: &IVec3| {
                before(*c, out, opening.is_inflow(), &self.lattice).any(|x| shape.holds(x, 0.0))
            };
            for (solid, shape) in solids.iter().filter(|(solid, _)| !solid.is_still()) {
                let covered = planned.cells.iter().filter(|c| holds(shape, c)).count();
                if covered == 0 {
                    continue;
                }
                let (key, way) = if opening.is_inflow() { ("inflow", "in") } else { ("outflow", "out") };
                notes.push(format!(
                    "{key} `{}`: {} `{}` stands before {covered} of its {all} cells at t = 0: no water comes {way} there as long as it does",
                    opening.name,
                    solid.what(),
                    solid.name
                ));
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
        let parts = |o: &Opening| if self.followed() == 0 { 1 } else { o.layer.div_ceil(2) };
        inflows.map(parts).sum::<usize>().max(1)
    }

    /// Whether one of the solids in these `poses`, the walls in openings aside, lets no water come in at `x` [m] on its way `inward`, of length 1.
    pub(crate) fn stands_before(&self, poses: &[Pose], x: DVec3, inward: DVec3) -> bool {
        let places = [x, x + ROOM * self.spacing * inward];
        (0..self.followed()).any(|k| {
            let (solid, pose) = (&self.solids[k], &poses[k]);
            places.iter().any(|place| {
                let way = self.periodic.nearest(place - pose.position);
                way.length() < solid.radius()
                    && solid.shape.outside(pose.orientation.inverse() * way - solid.shape_offset) < 0.0
            })
        })
    }
}
