//! From a case to a scene.
//!
//! Order of placement, first come first served: tank, obstacles, moving walls, planes, water, bodies.

use super::bodies;
use super::lattice::{Cells, Grid, Lattice};
use super::placement::{Surroundings, point};
use super::walls::{self, Fixed, PlaneFrame};
use super::water::Water;
use super::{Drive, Groups, Kind, Motion, Scene, Shape, Solid};
use crate::case::{Case, Law};
use crate::error::{Error, Result};
use glam::{DVec3, IVec3};

impl Scene {
    /// Builds the scene of a case: particles on their lattices, solids with their geometry, the domain.
    ///
    /// # Errors
    /// [`Error::Case`] with every problem that the case or its geometry at t = 0 has: bodies that overlap
    /// walls, water or each other, water that would run away, things outside of the domain.
    pub fn build(case: &Case) -> Result<Self> {
        crate::case::check::refuse(case)?;
        let mut builder = Builder::new(case)?;
        builder.walls();
        builder.water();
        builder.bodies();
        let domain = builder.domain();
        if !builder.problems.is_empty() {
            return Err(Error::Case(listed(&builder.problems)));
        }
        Ok(builder.assemble(domain))
    }
}

/// Problems of a scene as one text.
fn listed(problems: &[String]) -> String {
    match problems {
        [one] => one.clone(),
        many => format!("{} problems at t = 0:\n  - {}", many.len(), many.join("\n  - ")),
    }
}

struct Builder<'a> {
    case: &'a Case,
    lattice: Lattice,
    grid: Grid,
    /// Wall layer and dummies: 1 + the most layers that lie strictly within re of the wall layer.
    layers: i32,
    tank: Option<Cells>,
    fixed: Fixed,
    moving_walls: Vec<Solid>,
    bodies: Vec<Solid>,
    water: Water,
    depth: f64,
    notes: Vec<String>,
    problems: Vec<String>,
}

impl<'a> Builder<'a> {
    fn new(case: &'a Case) -> Result<Self> {
        let run = &case.run;
        let blocks = case.fluid.as_ref().map_or(&[][..], |f| &f.block);
        let anchor = case.tank.as_ref().map(|t| t.min).or_else(|| blocks.first().map(|b| b.min));
        let lattice = Lattice::new(anchor.unwrap_or_default().into(), run.spacing, run.dimensions);
        let layers = run.effective_radius.ceil() as i32;
        let tank = case.tank.as_ref().map(|t| lattice.tank_cells(t.min.into(), t.max.into()));
        let outer = case.tank.as_ref().zip(tank);
        let outer = outer.map(|(t, c)| walls::outer(c, walls::closed(&t.open, lattice.plane), layers));
        let boxes = case.obstacle.iter().map(|o| (o.min, o.max));
        let boxes = boxes.chain(case.moving_wall.iter().map(|w| (w.min, w.max)));
        let boxes = boxes.chain(blocks.iter().map(|b| (b.min, b.max)));
        let all = boxes.map(|(min, max)| lattice.cells(min.into(), max.into())).chain(outer);
        let all = all.reduce(Cells::union).unwrap_or(Cells { lo: IVec3::ZERO, hi: IVec3::ZERO });
        // One free cell around everything, so that what leaves can be seen to leave.
        let grid = Grid::new(all.grown(lattice.step(1)), run.spacing)?;
        Ok(Self {
            case,
            lattice,
            grid,
            layers,
            tank,
            fixed: Fixed::default(),
            moving_walls: Vec::new(),
            bodies: Vec::new(),
            water: Water::default(),
            depth: 0.0,
            notes: Vec::new(),
            problems: Vec::new(),
        })
    }

    fn gravity(&self) -> DVec3 {
        let mut g: DVec3 = self.case.run.gravity.into();
        if self.lattice.plane {
            g.y = 0.0;
        }
        g
    }

    fn walls(&mut self) {
        let (case, lattice, layers) = (self.case, self.lattice, self.layers);
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
        for obstacle in &case.obstacle {
            let taken = self.fixed.obstacle(obstacle, &lattice, &mut self.grid, layers);
            let label = format!("obstacle `{}`", obstacle.name);
            self.rounded(&label, obstacle.min.into(), obstacle.max.into());
            self.taken(&label, taken);
        }
        for wall in &case.moving_wall {
            let (solid, taken) = walls::moving_wall(wall, &lattice, &mut self.grid, layers);
            let label = format!("moving wall `{}`", wall.name);
            self.rounded(&label, wall.min.into(), wall.max.into());
            self.taken(&label, taken);
            let Shape::Box { half } = solid.shape;
            let thin = (0..3).any(|k| 2.0 * half[k] < 1.5 * lattice.spacing && !(lattice.plane && k == 1));
            if thin {
                self.notes
                    .push(format!("{label}: one particle thick, so that its two sides share one pressure"));
            }
            self.moving_walls.push(solid);
        }
        for plane in &case.plane {
            let left_out = self.fixed.plane(plane, &lattice, &mut self.grid, layers);
            let n = PlaneFrame::new(plane, &lattice).n.map(|n| f64::from(n) * lattice.spacing);
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
    }

    fn water(&mut self) {
        let Some(fluid) = &self.case.fluid else { return };
        for (k, block) in fluid.block.iter().enumerate() {
            let filled = self.water.fill(block, &self.lattice, &mut self.grid);
            if filled == 0 {
                self.problems.push(format!(
                    "fluid.block.{k}: no free cell in it at spacing {}: it lies inside walls or other water, \
                     move it or use a smaller run.spacing",
                    self.lattice.spacing
                ));
            }
            self.rounded(&format!("fluid.block.{k}"), block.min.into(), block.max.into());
        }
        self.depth = self.water.depth(self.gravity(), &self.lattice);
    }

    fn bodies(&mut self) {
        let case = self.case;
        let gravity = self.gravity();
        let law = case.contact.as_ref().map_or(Law::Smooth, |c| c.law);
        for body in &case.body {
            let mut solid = bodies::body(body, case.run.spacing, case.run.dimensions, self.layers);
            let earlier: Vec<&Solid> = self.moving_walls.iter().chain(&self.bodies).collect();
            let surroundings = Surroundings {
                fixed: &self.fixed,
                earlier: &earlier,
                law,
                spacing: case.run.spacing,
                up: (gravity.length() > 0.0).then(|| -gravity.normalize()),
            };
            match surroundings.place(&mut solid, body.standing) {
                Ok(note) => self.notes.extend(note),
                Err(problem) => self.problems.push(problem),
            }
            let shape = solid.oriented_box();
            let wet = self.water.inside(&shape, &self.lattice);
            if wet > 0 && body.displaces_fluid {
                self.water.remove(&shape, &self.lattice, &mut self.grid);
                self.notes.push(format!("body `{}`: displaces {wet} fluid particles", body.name));
            } else if wet > 0 {
                self.problems.push(format!(
                    "body `{}` at {} overlaps {wet} fluid particles at t = 0: set `displaces_fluid = true`, or move it \
                     out of the water",
                    body.name,
                    point(solid.position)
                ));
            }
            self.bodies.push(solid);
        }
        self.problems.extend(self.water.leak(gravity, &self.lattice, &mut self.grid, self.tank));
    }

    /// The case's domain, or one with room around everything; complains of what lies outside.
    fn domain(&mut self) -> (DVec3, DVec3) {
        let l0 = self.lattice.spacing;
        let mut bounds = Bounds::default();
        for wall in &self.fixed.shapes {
            let reach = super::oriented::OrientedBox::from(wall).bounds();
            bounds.add(&format!("wall `{}`", wall.name), wall.center - reach, wall.center + reach);
        }
        for solid in self.moving_walls.iter().chain(&self.bodies) {
            let shape = solid.oriented_box();
            let (lo, hi) = (shape.center - shape.bounds(), shape.center + shape.bounds());
            let label = format!("{} `{}`", if solid.is_body { "body" } else { "moving wall" }, solid.name);
            bounds.add(&label, lo, hi);
            if let Drive::Prescribed(motion) = &solid.drive {
                for &d in &motion.displacement {
                    bounds.add(&label, lo + d, hi + d);
                }
            }
        }
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
                if let Some(k) = (0..3).find(|&k| !(self.lattice.plane && k == 1) && outside(k)) {
                    self.problems.push(format!(
                        "run.domain: {label} reaches from {} = {:.4} to {:.4} m, outside of {:.4} to {:.4} m: \
                         enlarge run.domain or leave it out",
                        AXES[k], a[k], b[k], lo[k], hi[k]
                    ));
                }
            }
            return (lo, hi);
        }
        let (lo, hi) = bounds.total();
        let room = 4.0 * l0;
        // Nothing but walls keeps bodies and free drops in place, and they cost nothing while there are few.
        let held = self.tank.is_some() && !self.water.cell.is_empty();
        let around = if held { room } else { (0.5 * (hi - lo).length()).max(room) };
        let (mut lo, mut hi) = (lo - around, hi + around);
        let gravity = self.gravity();
        if gravity.length() > 0.0 {
            let up = -gravity.normalize();
            let tank = self
                .case
                .tank
                .as_ref()
                .map_or(0.0, |t| (DVec3::from(t.max) - DVec3::from(t.min)).dot(up.abs()));
            let head = up * (4.0 * self.depth).max(tank);
            lo += head.min(DVec3::ZERO);
            hi += head.max(DVec3::ZERO);
        }
        if self.lattice.plane {
            (lo.y, hi.y) = (-0.5 * l0, 0.5 * l0);
        }
        (lo, hi)
    }

    /// Axes along which a length changed by more than 1 % of the spacing.
    fn changed(&self, off: DVec3) -> impl Iterator<Item = usize> + use<> {
        let (limit, plane) = (0.01 * self.lattice.spacing, self.lattice.plane);
        (0..3).filter(move |&k| !(plane && k == 1) && off[k] > limit)
    }

    /// Notes that a box's faces moved to the lattice.
    fn rounded(&mut self, label: &str, min: DVec3, max: DVec3) {
        let cells = self.lattice.cells(min, max);
        let (lo, hi) = (self.lattice.corner(cells.lo), self.lattice.corner(cells.hi));
        let off = (lo - min).abs().max((hi - max).abs());
        let lines = self.changed(off).map(|k| {
            format!("{} {:.4}..{:.4} m becomes {:.4}..{:.4} m", AXES[k], min[k], max[k], lo[k], hi[k])
        });
        let line = lines.collect::<Vec<_>>().join(", ");
        if !line.is_empty() {
            self.notes.push(format!("{label}: {line} at spacing {}", self.lattice.spacing));
        }
    }

    fn taken(&mut self, label: &str, cells: usize) {
        if cells > 0 {
            self.notes.push(format!("{label}: {cells} cells left to the walls that already stand there"));
        }
    }

    /// Lays the particles out in their groups.
    fn assemble(self, domain: (DVec3, DVec3)) -> Scene {
        let mut solids: Vec<Solid> = self.bodies.into_iter().chain(self.moving_walls).collect();
        let count = |f: fn(&Solid) -> usize| solids.iter().map(f).sum();
        let groups = Groups {
            fluid: self.water.cell.len(),
            moving_wall: count(|s| s.wall_offset.len()),
            static_wall: self.fixed.wall.len(),
            static_dummy: self.fixed.dummy.len(),
            moving_dummy: count(|s| s.dummy_offset.len()),
        };
        let total = groups.total();
        let mut layout = Layout {
            position: Vec::with_capacity(total),
            velocity: Vec::with_capacity(total),
            kind: Vec::with_capacity(total),
            solid: Vec::with_capacity(total),
        };
        for (&c, &v) in self.water.cell.iter().zip(&self.water.velocity) {
            layout.push(self.lattice.center(c), v, Kind::Fluid, 0);
        }
        for (k, solid) in solids.iter_mut().enumerate() {
            let kind = if solid.is_body { Kind::BodyWall } else { Kind::Wall };
            solid.wall_slots = layout.push_offsets(solid, &solid.wall_offset, kind, k);
        }
        for &p in &self.fixed.wall {
            layout.push(p, DVec3::ZERO, Kind::Wall, 0);
        }
        for &p in &self.fixed.dummy {
            layout.push(p, DVec3::ZERO, Kind::Dummy, 0);
        }
        for (k, solid) in solids.iter_mut().enumerate() {
            let kind = if solid.is_body { Kind::BodyDummy } else { Kind::Dummy };
            solid.dummy_slots = layout.push_offsets(solid, &solid.dummy_offset, kind, k);
        }
        let mut gravity: DVec3 = self.case.run.gravity.into();
        if self.lattice.plane {
            gravity.y = 0.0;
        }
        Scene {
            dimensions: self.case.run.dimensions,
            spacing: self.lattice.spacing,
            gravity,
            position: layout.position,
            velocity: layout.velocity,
            kind: layout.kind,
            solid: layout.solid,
            groups,
            solids,
            walls: self.fixed.shapes,
            static_wall_normal: self.fixed.normal,
            domain,
            depth: self.depth,
            notes: self.notes,
        }
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// The particle arrays while they grow.
struct Layout {
    position: Vec<DVec3>,
    velocity: Vec<DVec3>,
    kind: Vec<Kind>,
    solid: Vec<u32>,
}

impl Layout {
    fn push(&mut self, position: DVec3, velocity: DVec3, kind: Kind, solid: u32) {
        self.position.push(position);
        self.velocity.push(velocity);
        self.kind.push(kind);
        self.solid.push(solid);
    }
    /// Particles of solid `k`, moving with it; returns their slots.
    fn push_offsets(
        &mut self,
        solid: &Solid,
        offsets: &[DVec3],
        kind: Kind,
        k: usize,
    ) -> std::ops::Range<usize> {
        let from = self.position.len();
        for &offset in offsets {
            let arm = solid.orientation * offset;
            let velocity = match &solid.drive {
                Drive::Free(free) => free.velocity + free.angular_velocity.cross(arm),
                Drive::Prescribed(motion) => Motion::velocity(motion, 0.0),
            };
            self.push(solid.position + arm, velocity, kind, k as u32 + 1);
        }
        from..self.position.len()
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
