//! The domain: the box that no particle may leave.

use super::build::{AXES, Builder};
use super::opening::Planned;
use super::oriented::Placed;
use super::{Drive, Solid};
use crate::case::{TANK_FACES, Tank};
use crate::error::Problem;
use crate::extents;
use glam::{DMat3, DVec3, IVec3};

impl Builder<'_> {
    /// The case's domain, or one with room around everything; complains of what lies outside.
    pub(super) fn domain(&mut self) -> (DVec3, DVec3) {
        let l0 = self.lattice.spacing;
        let (mut bounds, mut notes) = (Bounds::default(), vec![]);
        for wall in &self.fixed.shapes {
            let (lo, hi) = Placed::from(wall).ends();
            bounds.add(&format!("wall `{}`", wall.name), lo, hi);
        }
        for solid in self.moving_walls.iter().chain(&self.bodies) {
            let shape = solid.placed();
            let label = format!("{} `{}`", solid.what(), solid.name);
            if solid.is_still() {
                // as much of it as the tank has left
                let left =
                    solid.wall_positions().fold((DVec3::MAX, DVec3::MIN), |(a, b), x| (a.min(x), b.max(x)));
                bounds.add(&label, left.0 - l0, left.1 + l0);
                continue;
            }
            let (lo, hi) = shape.ends();
            bounds.add(&label, lo, hi);
            if let Drive::Prescribed(motion) = &solid.drive {
                notes.extend(
                    motion.abrupt(self.case.run.end).into_iter().map(|what| format!("{label}: {what}")),
                );
                let (mut low, mut high) = (lo, hi);
                for (way, turn) in motion.poses() {
                    let center = shape.center + way;
                    let axes = DMat3::from_quat(turn) * shape.axes;
                    let (lo, hi) = Placed { center, axes, ..shape }.ends();
                    (low, high) = (low.min(lo), high.max(hi));
                }
                bounds.add(&label, low, high);
                notes.extend(if solid.is_body {
                    self.through_walls(&label, low, high)
                } else {
                    // A piston goes back into the wall behind it.
                    self.out_of_tank(&label, (lo, hi), (low, high))
                });
            }
        }
        for Planned { opening, .. } in &self.openings {
            if opening.room.is_some() {
                let label = format!("outflow `{}` with what falls from it", opening.name);
                bounds.add(&label, opening.behind.0, opening.behind.1);
            }
        }
        self.notes.append(&mut notes);
        if !self.water.cell.is_empty() {
            let (lo, hi) =
                self.water.cell.iter().fold((IVec3::MAX, IVec3::MIN), |(a, b), &c| (a.min(c), b.max(c)));
            bounds.add("water", self.lattice.corner(lo), self.lattice.corner(hi + 1));
        }
        if let Some(domain) = self.case.run.domain {
            let (lo, hi) = (DVec3::from(domain[0]), DVec3::from(domain[1]));
            let slack = 1e-9 * l0;
            for (label, a, b) in &bounds.items {
                let outside = |k: usize| a[k] < lo[k] - slack || b[k] > hi[k] + slack;
                let held = |k: usize| !(self.periodic.is_along(k) || self.lattice.plane && k == 1);
                if let Some(k) = (0..3).find(|&k| held(k) && outside(k)) {
                    let message = format!(
                        "run.domain: {label} reaches from {} = {:.4} to {:.4} m, outside of {:.4} to {:.4} m",
                        AXES[k], a[k], b[k], lo[k], hi[k]
                    );
                    let remedy = "enlarge run.domain or leave it out";
                    self.problems.push(Problem::new("run.domain", message, remedy));
                }
            }
            return self.in_plane(lo, hi);
        }
        for body in self.bodies.iter().filter(|b| b.is_hinged()) {
            let (low, high) = self.swing(body);
            bounds.add("", low, high);
        }
        let (lo, hi) = bounds.total();
        let held = self.tank.is_some() && !self.water.cell.is_empty();
        let all = extents::Bounds { lo, hi };
        let extents::Bounds { lo, hi } = extents::with_room(self.case, all, held, self.flight(), self.depth);
        self.in_plane(lo, hi)
    }

    /// Which of the tank's faces have a wall, by their numbers.
    fn walled(&self, tank: &Tank) -> impl Fn(&usize) -> bool {
        let (bare, plane) = (tank.without_wall(), self.lattice.plane);
        move |&k| !(bare.contains(&TANK_FACES[k].0) || plane && k / 2 == 1)
    }

    /// What there is to say of a driven solid that reaches from `low` to `high` [m]: walls that it is taken through.
    fn through_walls(&self, label: &str, low: DVec3, high: DVec3) -> Vec<String> {
        let Some(tank) = &self.case.tank else { return vec![] };
        let walled = self.walled(tank);
        let beyond = |k: usize| {
            let axis = k / 2;
            if k.is_multiple_of(2) { tank.min[axis] - low[axis] } else { high[axis] - tank.max[axis] }
        };
        let through = (0..6).filter(walled).filter(|&k| beyond(k) > 0.5 * self.lattice.spacing);
        let note = |k: usize| {
            format!(
                "{label}: its motion takes it {:.4} m into the wall `{}`, which does not stop it",
                beyond(k),
                TANK_FACES[k].1
            )
        };
        through.map(note).collect()
    }

    /// What there is to say of a moving wall from `lo` to `hi` [m] that reaches from `low` to `high` [m]: faces with a wall behind
    /// which its motion takes all of it.
    fn out_of_tank(&self, label: &str, (lo, hi): (DVec3, DVec3), (low, high): (DVec3, DVec3)) -> Vec<String> {
        let Some(tank) = &self.case.tank else { return vec![] };
        let walled = self.walled(tank);
        let gone = |k: &usize| {
            let (axis, size) = (k / 2, hi - lo);
            let (min, max) = (tank.min[axis], tank.max[axis]);
            // Its near side at the end of its way, and at the start, when it is inside or not.
            if k.is_multiple_of(2) {
                low[axis] + size[axis] < min && hi[axis] >= min
            } else {
                high[axis] - size[axis] > max && lo[axis] <= max
            }
        };
        let told = |k: usize| {
            format!(
                "{label}: its motion takes it out of the tank through `{}`, which does not stop it",
                TANK_FACES[k].1
            )
        };
        (0..6).filter(walled).filter(gone).map(told).collect()
    }

    /// The box that a hinged body may reach on its turn, as far as the tank's walls let it: a wall stops what is nowhere
    /// beyond its edges.
    fn swing(&self, body: &Solid) -> (DVec3, DVec3) {
        let (placed, reach) = (body.placed(), body.radius());
        let (mut low, mut high) = (body.position - reach, body.position + reach);
        let Some(tank) = &self.case.tank else { return (low, high) };
        let now = placed.ends();
        // The floor first: flaps stand on it.
        for k in [4, 5, 0, 1, 2, 3].into_iter().filter(self.walled(tank)) {
            let axis = k / 2;
            let beside = |other: usize| other == axis || self.lattice.plane && other == 1;
            let faces = |other: usize| low[other] >= tank.min[other] && high[other] <= tank.max[other];
            if !(0..3).all(|other| beside(other) || faces(other)) {
                continue;
            }
            if k.is_multiple_of(2) {
                low[axis] = low[axis].max(tank.min[axis].min(now.0[axis]));
            } else {
                high[axis] = high[axis].min(tank.max[axis].max(now.1[axis]));
            }
        }
        (low, high)
    }

    /// How far water and bodies fly with their velocity at t = 0 until the end, against and along each axis [m].
    fn flight(&self) -> (DVec3, DVec3) {
        let free = self.bodies.iter().filter_map(|s| match &s.drive {
            Drive::Free(free) => Some(free.velocity),
            Drive::Prescribed(_) => None,
        });
        let (least, most) = (self.water.velocity.iter().copied())
            .chain(free)
            .fold((DVec3::ZERO, DVec3::ZERO), |(a, b), v| (a.min(v), b.max(v)));
        (-self.case.run.end * least, self.case.run.end * most)
    }

    /// In two dimensions a domain is one cell wide; along a periodic axis it is the tank.
    fn in_plane(&self, mut lo: DVec3, mut hi: DVec3) -> (DVec3, DVec3) {
        if self.lattice.plane {
            let half = 0.5 * self.lattice.spacing;
            (lo.y, hi.y) = (-half, half);
        }
        for k in 0..3 {
            if let Some(sides) = self.periodic.sides(k) {
                (lo[k], hi[k]) = sides;
            }
        }
        (lo, hi)
    }
}

/// Labelled boxes and the box around them all.
#[derive(Default)]
struct Bounds {
    items: Vec<(String, DVec3, DVec3)>,
}

impl Bounds {
    fn add(&mut self, label: &str, lo: DVec3, hi: DVec3) {
        self.items.push((label.to_owned(), lo, hi));
    }
    fn total(&self) -> (DVec3, DVec3) {
        let boxes = self.items.iter().map(|(_, lo, hi)| (*lo, *hi));
        boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default()
    }
}
