//! Fixed and prescribed walls: the tank, obstacles, moving walls and planes, as particles and as boxes.

use super::lattice::{BLOCKED, Cells, FREE, Grid, Lattice, SOLID};
use super::oriented::Placed;
use super::{Curve, Drive, Motion, Shape, Solid, WallShape};
use crate::case::{self, Face, TANK_FACES};
use crate::periodic::Periodic;
use crate::shape::Edges;
use crate::waves::Wave;
use glam::{DMat3, DQuat, DVec3, IVec3};

/// A wall's particle nearer than this below a plane, over the spacing, is its next layer.
const BELOW: f64 = 0.35;

/// Particles of the walls that never move.
#[derive(Default, Debug)]
pub(super) struct Fixed {
    pub wall: Vec<DVec3>,
    /// Unit normals into the free space, one a wall particle.
    pub normal: Vec<DVec3>,
    /// Index into `shapes`, one a wall particle.
    pub shape_of: Vec<u32>,
    pub dummy: Vec<DVec3>,
    pub shapes: Vec<WallShape>,
}

/// Name of the tank's face `2 axis + side`.
pub(super) fn face_name(face: usize) -> &'static str {
    TANK_FACES[face].1
}

/// Which faces carry a wall: `[min, max]` an axis. No y faces in two dimensions.
pub(super) fn closed(open: &[Face], plane: bool) -> [[bool; 2]; 3] {
    let wall =
        |axis: usize, side: usize| (axis != 1 || !plane) && !open.contains(&TANK_FACES[2 * axis + side].0);
    std::array::from_fn(|axis| std::array::from_fn(|side| wall(axis, side)))
}

/// The tank with its layers: interior grown by `layers` on the closed faces.
pub(super) fn outer(interior: Cells, closed: [[bool; 2]; 3], layers: i32) -> Cells {
    let side = |s: usize| IVec3::from_array(std::array::from_fn(|k| if closed[k][s] { layers } else { 0 }));
    Cells { lo: interior.lo - side(0), hi: interior.hi + side(1) }
}

impl Fixed {
    /// Walls of the tank: everything outside of the interior, `layers` deep (largest distance along an
    /// axis, so corners are filled), but for cells that are taken: openings.
    pub fn tank(&mut self, tank: &case::Tank, lattice: &Lattice, grid: &mut Grid, layers: i32) {
        let interior = lattice.tank_cells(tank.min.into(), tank.max.into());
        let closed = closed(&tank.without_wall(), lattice.plane);
        let outer = outer(interior, closed, layers);
        let mut shape = [[u32::MAX; 2]; 3];
        for axis in 0..3 {
            for side in 0..2 {
                if closed[axis][side] {
                    let mut slab = outer;
                    if side == 0 {
                        slab.hi[axis] = interior.lo[axis];
                    } else {
                        slab.lo[axis] = interior.hi[axis];
                    }
                    let of = self.add_shape(face_name(2 * axis + side), lattice, slab);
                    let (lo, hi) = (lattice.corner(interior.lo), lattice.corner(interior.hi));
                    let middle = &mut self.shapes[of as usize].middle;
                    *middle = 0.5 * (lo + hi);
                    middle[axis] = if side == 0 { lo[axis] } else { hi[axis] };
                    shape[axis][side] = of;
                }
            }
        }
        for c in outer.iter() {
            let below = interior.lo - c;
            let above = c - interior.hi + 1;
            let depth = below.max(above).max_element();
            if depth <= 0 || grid.get(c) != FREE {
                continue;
            }
            grid.set(c, SOLID);
            if depth > 1 {
                self.dummy.push(lattice.center(c));
                continue;
            }
            let (mut normal, mut of, mut on_rim) = (DVec3::ZERO, u32::MAX, false);
            for axis in 0..3 {
                let side = if below[axis] > 0 {
                    0
                } else if above[axis] > 0 {
                    1
                } else {
                    continue;
                };
                normal[axis] = if side == 0 { 1.0 } else { -1.0 };
                // One on the rim of a hole is of the face that looks into it.
                let opens = grid.get(c + normal.as_ivec3() * IVec3::AXES[axis]) == BLOCKED;
                if opens || !on_rim {
                    of = shape[axis][side];
                }
                on_rim |= opens;
            }
            self.push_wall(lattice.center(c), normal, of);
        }
    }

    /// A fixed box: a shell of `layers` inside of it, hollow beyond. Cells that are taken stay as they are;
    /// their number is returned.
    pub fn obstacle(
        &mut self,
        obstacle: &case::Obstacle,
        (min, max): (case::Vector, case::Vector),
        lattice: &Lattice,
        grid: &mut Grid,
        layers: i32,
    ) -> usize {
        let cells = lattice.cells(min.into(), max.into());
        let of = self.add_shape(&obstacle.name, lattice, cells);
        let closed = grid.closed(cells, closed(&obstacle.open, lattice.plane));
        let (shell, taken) = shell(cells, closed, grid, layers);
        for cell in shell {
            let p = lattice.center(cell.at);
            if cell.depth > 0 {
                self.dummy.push(p);
            } else {
                self.push_wall(p, cell.outward, of);
            }
        }
        taken
    }

    /// A plane: a patch of its own lattice, wall layer l0/2 behind the surface, dummies deeper. Returns how
    /// many particles were left out because another wall already stands there.
    pub fn plane(
        &mut self,
        name: &str,
        frame: &PlaneFrame,
        lattice: &Lattice,
        grid: &mut Grid,
        layers: i32,
    ) -> usize {
        let slab = frame.slab(layers);
        let l0 = lattice.spacing;
        let earlier: Vec<Placed> = self.shapes[..].iter().map(Placed::from).collect();
        let of = self.shapes.len() as u32;
        self.shapes.push(WallShape {
            name: name.to_owned(),
            center: slab.center,
            half: frame.half(layers),
            axes: slab.axes,
            middle: frame.middle,
        });
        let mut left_out = 0;
        for depth in 0..layers {
            for i in 0..frame.n[0] {
                for j in 0..frame.n[1] {
                    let u = (f64::from(i) + 0.5 - 0.5 * f64::from(frame.n[0])) * l0;
                    let v = (f64::from(j) + 0.5 - 0.5 * f64::from(frame.n[1])) * l0;
                    let w = -(f64::from(depth) + 0.5) * l0;
                    let mut p = frame.center + frame.axes * DVec3::new(u, v, w);
                    if lattice.plane {
                        p.y = 0.0;
                    }
                    // Rows behind the face of another wall would make it denser, and what they bear is no part of the plane. Below
                    // them what stands nearer than the next layer fills its place; left out at more, the plane would be hollow.
                    let (within, near) = if depth > 0 { (0.5 - BELOW, BELOW) } else { (1e-6, 0.5) };
                    let in_wall = earlier.iter().any(|b| b.holds(p, within * l0));
                    if in_wall || grid.is_beyond(lattice.cell(p)) || near_solid(lattice, grid, p, near) {
                        left_out += 1;
                    } else if depth > 0 {
                        self.dummy.push(p);
                    } else {
                        self.push_wall(p, frame.axes.z_axis, of);
                    }
                }
            }
        }
        grid.put(&frame.displaced(layers), lattice);
        left_out
    }

    fn add_shape(&mut self, name: &str, lattice: &Lattice, cells: Cells) -> u32 {
        let (lo, hi) = (lattice.corner(cells.lo), lattice.corner(cells.hi));
        self.shapes.push(WallShape {
            name: name.to_owned(),
            center: 0.5 * (lo + hi),
            half: 0.5 * (hi - lo),
            axes: DMat3::IDENTITY,
            middle: 0.5 * (lo + hi),
        });
        self.shapes.len() as u32 - 1
    }

    fn push_wall(&mut self, p: DVec3, normal: DVec3, of: u32) {
        self.wall.push(p);
        self.normal.push(normal.normalize_or_zero());
        self.shape_of.push(of);
    }
}

/// A cell of a shell: its layer and the sum of the outward normals of the faces that it lies on.
struct ShellCell {
    at: IVec3,
    depth: i32,
    outward: DVec3,
}

/// Cells of a hollow box, `layers` deep from its closed faces. Marks the whole box in the grid; also returns
/// how many cells were taken before.
fn shell(cells: Cells, closed: [[bool; 2]; 3], grid: &mut Grid, layers: i32) -> (Vec<ShellCell>, usize) {
    let (mut shell, mut taken) = (Vec::new(), 0);
    for c in cells.iter() {
        if grid.get(c) != FREE {
            taken += 1;
            continue;
        }
        let (mut depth, mut outward) = (i32::MAX, DVec3::ZERO);
        for axis in 0..3 {
            let distance = [c[axis] - cells.lo[axis], cells.hi[axis] - 1 - c[axis]];
            for side in 0..2 {
                if closed[axis][side] {
                    depth = depth.min(distance[side]);
                    if distance[side] == 0 {
                        outward[axis] += if side == 0 { -1.0 } else { 1.0 };
                    }
                }
            }
        }
        grid.set(c, if depth < layers { SOLID } else { BLOCKED });
        if depth < layers {
            shell.push(ShellCell { at: c, depth, outward });
        }
    }
    (shell, taken)
}

/// A wall that follows a table, without slots yet; and how many of its cells were taken before.
pub(super) fn moving_wall(
    wall: &case::MovingWall,
    (min, max): (case::Vector, case::Vector),
    case: &case::Case,
    lattice: &Lattice,
    grid: &mut Grid,
    layers: i32,
) -> (Solid, usize) {
    let cells = lattice.cells(min.into(), max.into());
    let (lo, hi) = (lattice.corner(cells.lo), lattice.corner(cells.hi));
    let position = 0.5 * (lo + hi);
    let l0 = lattice.spacing;
    let mut solid = Solid {
        name: wall.name.clone(),
        is_body: false,
        shape: Shape::cuboid(hi - lo),
        position,
        orientation: DQuat::IDENTITY,
        frame: DQuat::IDENTITY,
        drive: Drive::Prescribed(wall_motion(wall, case, position)),
        wall_slots: 0..0,
        dummy_slots: 0..0,
        shape_offset: DVec3::ZERO,
        wall_offset: Vec::new(),
        dummy_offset: Vec::new(),
        wall_area: Vec::new(),
        wall_to_surface: Vec::new(),
        wall_edges: Default::default(),
    };
    let closed = grid.closed(cells, closed(&wall.open, lattice.plane));
    let (shell, taken) = shell(cells, closed, grid, layers);
    for cell in shell {
        let offset = lattice.center(cell.at) - position;
        if cell.depth > 0 {
            solid.dummy_offset.push(offset);
        } else {
            solid.wall_offset.push(offset);
            solid.wall_area.push(cell.outward * l0 * l0);
            solid.wall_to_surface.push(cell.outward * 0.5 * l0);
        }
    }
    solid.wall_edges = Edges::of_box(&solid.wall_area, &solid.wall_to_surface);
    (solid, taken)
}

/// The motion of a wall whose centre is `center` at the start.
pub(super) fn wall_motion(wall: &case::MovingWall, case: &case::Case, center: DVec3) -> Motion {
    let wave = wall.wave(case).zip(wall.wave.as_ref().map(case::WaveMaker::direction));
    motion(&wall.guide(), wave, center, case.run.dimensions == 2)
}

/// Angles [rad] by rows of them [degrees].
fn angles(rows: &[[f64; 4]]) -> Option<Curve> {
    let angle = |r: &[f64; 4]| DVec3::new(r[1], r[2], r[3]) * (std::f64::consts::PI / 180.0);
    (!rows.is_empty())
        .then(|| Curve::new(rows.iter().map(|r| r[0]).collect(), rows.iter().map(angle).collect()))
}

/// The motion of a solid whose centre is `center` at the start, by tables and formulas, or by the wave that it makes along a direction.
pub(super) fn motion(
    guide: &case::Guide,
    wave: Option<(Wave, case::Vector)>,
    center: DVec3,
    plane: bool,
) -> Motion {
    let flat = |v: case::Vector| DVec3::new(v[0], if plane { 0.0 } else { v[1] }, v[2]);
    let table = || {
        let rows = guide.motion.filter(|rows| !rows.is_empty()).unwrap_or(&[[0.0; 4]]);
        let place = |r: &[f64; 4]| flat([r[1], r[2], r[3]]);
        Motion::shift(Curve::new(rows.iter().map(|r| r[0]).collect(), rows.iter().map(place).collect()))
    };
    let mut moved = match (guide.sine, wave) {
        (Some(sine), _) => Motion::along(flat(sine.axis), sine.formula()),
        (None, Some((wave, direction))) => Motion::making(wave, flat(direction)),
        (None, None) => table(),
    };
    let arm = flat((center - guide.pivot.map_or(center, DVec3::from)).to_array());
    if let Some(angles) = angles(guide.rotation) {
        moved = moved.turned(angles, arm);
    }
    match guide.swing {
        Some(swing) => moved.swinging(swing.axis.into(), swing.formula(), arm),
        None => moved,
    }
}

/// Frame and size in particles of a plane.
pub(super) struct PlaneFrame {
    pub center: DVec3,
    /// That of the case, about which torques count.
    pub middle: DVec3,
    /// Columns: along, across, normal.
    pub axes: DMat3,
    pub n: [i32; 2],
    spacing: f64,
}

impl PlaneFrame {
    /// What spans a periodic axis along its own rows has these on the lattice there: one more between the sides would stand in the place of its image.
    pub fn new(plane: &case::Plane, lattice: &Lattice, periodic: &Periodic) -> Self {
        let (mut center, mut normal): (DVec3, DVec3) = (plane.center.into(), plane.normal.into());
        let mut along: DVec3 = plane.along.into();
        let cells = |length: f64| (length / lattice.spacing + 0.5 + 1e-6).floor().max(1.0) as i32;
        let mut n = [cells(plane.size[0]), cells(plane.size[1])];
        if lattice.plane {
            (center.y, normal.y, along.y, n[1]) = (0.0, 0.0, 0.0, 1);
        }
        let normal = normal.normalize();
        let along = (along - along.dot(normal) * normal).normalize();
        let axes = DMat3::from_cols(along, normal.cross(along), normal);
        let middle = center;
        for (column, n) in n.iter_mut().enumerate() {
            let way = axes.col(column).abs();
            for k in (0..3).filter(|&k| way[k] > 1.0 - 1e-9 && !(lattice.plane && k == 1)) {
                let Some((low, high)) = periodic.sides(k) else { continue };
                let half = 0.5 * f64::from(*n) * lattice.spacing;
                let slack = 1e-6 * lattice.spacing;
                if center[k] - half <= low + slack && center[k] + half >= high - slack {
                    (center[k], *n) = (0.5 * (low + high), cells(high - low));
                }
            }
        }
        Self { center, middle, axes, n, spacing: lattice.spacing }
    }
    /// Half of the edges of the box of the layers [m].
    pub fn half(&self, layers: i32) -> DVec3 {
        0.5 * self.spacing * DVec3::new(self.n[0].into(), self.n[1].into(), layers.into())
    }
    /// The layers as a box.
    pub(crate) fn slab(&self, layers: i32) -> Placed {
        let half = self.half(layers);
        Placed::cuboid(self.center - self.axes.z_axis * half.z, half, self.axes)
    }
    /// What of them displaces water: but for the surface they are dummies, to which it comes no nearer than 3/4 l0.
    pub(crate) fn displaced(&self, layers: i32) -> Placed {
        let by = 0.25 * self.spacing;
        let half = self.half(layers) + DVec3::new(by, by, 0.5 * by);
        Placed::cuboid(self.center - self.axes.z_axis * half.z, half, self.axes)
    }
}

/// Whether a lattice particle of a wall stands closer than `reach`, at most half, over the spacing.
pub(super) fn near_solid(lattice: &Lattice, grid: &Grid, p: DVec3, reach: f64) -> bool {
    let at = lattice.cell(p);
    let near = Cells { lo: at, hi: at + 1 }.grown(lattice.step(1));
    near.iter()
        .any(|c| grid.get(grid.wrap(c)) == SOLID && lattice.center(c).distance(p) < reach * lattice.spacing)
}
