//! How far the things of a case reach, and the domain that follows: from the case alone, nothing is built.

use crate::case::{Case, Face, Form, Guide, OpeningKeys, Place, Plane, Tank, Vector, Wall, room_behind};
use glam::{DMat3, DVec3};

/// A box that grows [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub lo: DVec3,
    pub hi: DVec3,
}

impl Bounds {
    pub const NONE: Self = Self { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY };

    pub fn new(lo: impl Into<DVec3>, hi: impl Into<DVec3>) -> Self {
        Self { lo: lo.into(), hi: hi.into() }
    }

    pub fn union(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Length along axis `k` [m]; 0 of nothing.
    pub fn size(&self, k: usize) -> f64 {
        (self.hi[k] - self.lo[k]).max(0.0)
    }

    /// Wherever turns about `pivot` take it that move a point an arm away by up to `angle` [rad] times that arm along each
    /// axis.
    fn turned(self, (pivot, angle): (Vector, DVec3)) -> Self {
        let pivot = DVec3::from(pivot);
        let arm = (self.lo - pivot).abs().max((self.hi - pivot).abs()).length();
        // No chord is longer than two arms; what stays in its plane goes nowhere along the axis.
        let way = arm * angle.min(DVec3::splat(2.0));
        let most = |k: usize| if angle[k] > 0.0 { arm } else { f64::INFINITY };
        let most = DVec3::new(most(0), most(1), most(2));
        Self { lo: (self.lo - way).max(pivot - most), hi: (self.hi + way).min(pivot + most) }
    }

    /// Wherever `rows` of displacements take it.
    fn moved(self, rows: &[[f64; 4]]) -> Self {
        let at = |row: &[f64; 4]| DVec3::new(row[1], row[2], row[3]);
        let moved = rows.iter().map(at).map(|by| Self::new(self.lo + by, self.hi + by));
        moved.fold(Self::NONE, Self::union)
    }
}

/// What an extent is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Of {
    Tank,
    /// Water at t = 0.
    Water,
    /// Walls; `true` for those on the lattice of the water.
    Wall(bool),
    /// Bodies, and where motions take solids.
    Moving,
}

/// A part of a scene and how far it reaches.
#[derive(Clone, Debug)]
pub(crate) struct Extent {
    pub of: Of,
    /// Path of its table, e.g. `body.0`.
    pub item: String,
    /// The key that takes it as far.
    pub key: &'static str,
    pub bounds: Bounds,
}

/// A wall from the numbers of the case: its box, its open faces, and whether these are on the lattice of the water.
pub(crate) type Walled<'a> = (Bounds, &'a [Face], bool);

/// The box around a wall [m]. What cannot be read has no size: whoever builds the scene says so.
pub(crate) fn edges(wall: &Wall, spacing: f64, flat: bool) -> Bounds {
    let (form, place) = match wall {
        Wall::Lattice(min, max) => return Bounds::new(*min, *max),
        Wall::Shaped(form, place) => (form, place),
    };
    let (Place::Center(at) | Place::Position(at)) = *place;
    let Ok((shape, _)) = form.shape(spacing, flat) else { return Bounds::new(at, at) };
    let turn = form.turn(flat);
    let origin = if matches!(place, Place::Position(_)) { turn * shape.origin() } else { DVec3::ZERO };
    let (middle, half) = (DVec3::from(at) + origin, shape.extent(DMat3::from_quat(turn * shape.frame())));
    Bounds::new(middle - half, middle + half)
}

/// Edges of a form that is not turned [m]; none of what cannot be read.
pub(crate) fn size(form: &Form, spacing: f64, flat: bool) -> DVec3 {
    let of = |(shape, _): (crate::shape::Shape, f64)| 2.0 * shape.extent(DMat3::from_quat(shape.frame()));
    form.shape(spacing, flat).map_or(DVec3::ZERO, of)
}

/// The walls of obstacles, then of moving walls.
pub(crate) fn walls(case: &Case) -> Vec<Walled<'_>> {
    let (l0, flat, tank) = (case.run.spacing, case.run.dimensions == 2, case.tank.as_ref());
    // Ground that reaches beyond a tank is cut off there.
    let on_lattice = |corners: Option<(Vector, Vector)>| corners.is_some() || tank.is_none();
    let fixed = case.obstacle.iter().map(|o| (o.wall(tank), &o.open[..], o.corners()));
    let moving = case.moving_wall.iter().map(|w| (w.wall(tank), &w.open[..], w.corners()));
    fixed
        .chain(moving)
        .map(|(wall, open, corners)| (edges(&wall, l0, flat), open, on_lattice(corners)))
        .collect()
}

/// Where `guide` takes what stands in `bounds` about `center`, and a wave by its strokes along a direction; with the key that
/// does.
fn guided(
    bounds: Bounds,
    guide: &Guide,
    wave: Option<(Vector, [f64; 2])>,
    center: Vector,
) -> Vec<(&'static str, Bounds)> {
    let mut found = vec![];
    let mut turned = bounds;
    if guide.turns() {
        // A turn about an axis moves along the two others.
        let rows = guide.rotation.iter().map(|row| DVec3::new(row[1], row[2], row[3]).abs());
        let rows = rows.map(|by| DVec3::splat(by.element_sum()) - by);
        let swing = guide.swing.map(|s| {
            let along = DVec3::from(s.axis).normalize_or_zero();
            s.amplitude_deg.abs() * (1.0 - along * along).max(DVec3::ZERO).map(f64::sqrt)
        });
        let degrees = rows.chain(swing).fold(DVec3::ZERO, DVec3::max);
        turned = bounds.turned((guide.pivot.unwrap_or(center), degrees.map(f64::to_radians)));
        found.push((if guide.pivot.is_some() { "pivot" } else { "rotation" }, turned));
    }
    if let Some(rows) = guide.motion {
        found.push(("motion", turned.moved(rows)));
    }
    let sine = guide.sine.map(|s| ("sine", s.axis, s.formula().reach()));
    let wave = wave.map(|(direction, reach)| ("wave", direction, reach));
    for (key, axis, reach) in sine.into_iter().chain(wave) {
        let unit = DVec3::from(axis).normalize_or_zero();
        let row = |way: f64| [0.0, way * unit.x, way * unit.y, way * unit.z];
        found.push((key, turned.moved(&reach.map(row))));
    }
    found
}

/// The extents of all that a case names, but of its domain.
pub(crate) fn all(case: &Case) -> Vec<Extent> {
    let (l0, flat, tank) = (case.run.spacing, case.run.dimensions == 2, case.tank.as_ref());
    let mut found = vec![];
    let mut add = |of: Of, item: String, key: &'static str, bounds: Bounds| {
        found.push(Extent { of, item, key, bounds });
    };
    if let Some(t) = tank {
        add(Of::Tank, "tank".into(), "max", Bounds::new(t.min, t.max));
    }
    let walls = walls(case);
    if let Some(fluid) = &case.fluid {
        for (k, block) in fluid.block.iter().enumerate() {
            add(Of::Water, format!("fluid.block.{k}"), "max", Bounds::new(block.min, block.max));
        }
        for (k, water) in fluid.shape.iter().enumerate() {
            let bounds = edges(&Wall::Shaped(water.form(tank), water.place()), l0, flat);
            add(Of::Water, format!("fluid.shape.{k}"), place_key(water.position), bounds);
        }
        let vessel = walls.iter().map(|w| w.0).fold(Bounds::NONE, Bounds::union);
        let vessel = tank.map_or(vessel, |t| Bounds::new(t.min, t.max));
        for (k, fill) in fluid.fill.iter().enumerate() {
            let mut bounds = vessel;
            bounds.hi.z = bounds.hi.z.min(fill.level);
            add(Of::Water, format!("fluid.fill.{k}"), "level", bounds);
        }
    }
    for (k, (o, (bounds, _, on_lattice))) in case.obstacle.iter().zip(&walls).enumerate() {
        let key = if o.corners().is_some() { "max" } else { place_key(o.position) };
        add(Of::Wall(*on_lattice), format!("obstacle.{k}"), key, *bounds);
    }
    for (k, (w, (bounds, _, on_lattice))) in
        case.moving_wall.iter().zip(&walls[case.obstacle.len()..]).enumerate()
    {
        let item = format!("moving_wall.{k}");
        let key = if w.corners().is_some() { "max" } else { place_key(w.position) };
        add(Of::Wall(*on_lattice), item.clone(), key, *bounds);
        add(Of::Moving, item.clone(), key, *bounds);
        let wave = w.wave.as_ref().zip(w.wave(case)).map(|(k, wave)| (k.direction(), wave.formula.reach()));
        let center = (0.5 * (bounds.lo + bounds.hi)).to_array();
        for (key, bounds) in guided(*bounds, &w.guide(), wave, center) {
            add(Of::Moving, item.clone(), key, bounds);
        }
    }
    for (k, body) in case.body.iter().enumerate() {
        let item = format!("body.{k}");
        let bounds = edges(&Wall::Shaped(body.form(), Place::Center(body.center)), l0, flat);
        add(Of::Moving, item.clone(), "center", bounds);
        for (key, bounds) in guided(bounds, &body.guide(), None, body.center) {
            add(Of::Moving, item.clone(), key, bounds);
        }
    }
    for (hole, t) in case.openings().filter(|o| !o.is_inflow() && o.is_hole()).zip(tank.into_iter().cycle()) {
        add(Of::Moving, hole.path(), "max", jet(&hole, t, case));
    }
    for (k, plane) in case.plane.iter().enumerate() {
        let bounds = flat_wall(plane, case.run.effective_radius.ceil() * l0, flat);
        // A large one reaches as far as a far one.
        let near = DVec3::from(plane.center).abs().max_element() < 0.5 * plane.size[0].max(plane.size[1]);
        add(Of::Moving, format!("plane.{k}"), if near { "size" } else { "center" }, bounds);
    }
    found
}

/// Where the jet of a `hole` of the tank may be before it is swallowed.
fn jet(hole: &OpeningKeys, tank: &Tank, case: &Case) -> Bounds {
    let (l0, flat, (axis, side)) = (case.run.spacing, case.run.dimensions == 2, hole.side());
    let (min, max) = (DVec3::from(tank.min), DVec3::from(tank.max));
    let corners = hole.corners.map(|corner| corner.map(DVec3::from));
    let (mut lo, mut hi) = match corners {
        [Some(low), Some(high)] => (low.clamp(min, max), high.clamp(min, max)),
        _ => (min, max),
    };
    let aside = (0..3).filter(|&k| k != axis && !(flat && k == 1));
    let whole = |k: usize| hi[k] - lo[k] > max[k] - min[k] - 0.5 * l0;
    let (deep, wider) = room_behind(aside.map(|k| (hi[k] - lo[k], whole(k), case.run.gravity[k])), l0);
    let wall = case.run.effective_radius.ceil() * l0;
    (lo, hi) = (lo - wider - wall, hi + wider + wall);
    let face = if side == 0 { min[axis] } else { max[axis] };
    let outside = if side == 0 { face - deep - wall } else { face + deep + wall };
    (lo[axis], hi[axis]) = (face.min(outside), face.max(outside));
    Bounds { lo, hi }
}

/// The box around a plane whose layers are `deep` [m].
fn flat_wall(plane: &Plane, deep: f64, flat: bool) -> Bounds {
    let center = DVec3::from(plane.center);
    let normal = DVec3::from(plane.normal).normalize_or_zero();
    let along = DVec3::from(plane.along).reject_from_normalized(normal).normalize_or_zero();
    let across = if flat { DVec3::ZERO } else { normal.cross(along) * plane.size[1] };
    let half = 0.5 * ((along * plane.size[0]).abs() + across.abs());
    let surface = Bounds::new(center - half, center + half);
    surface.union(Bounds::new(surface.lo - deep * normal, surface.hi - deep * normal))
}

fn place_key(position: Option<Vector>) -> &'static str {
    if position.is_some() { "position" } else { "center" }
}

/// The lattice of the water: tank, blocks, and the walls that stand on it.
pub(crate) fn lattice(extents: &[Extent]) -> Bounds {
    let on_lattice = |e: &&Extent| matches!(e.of, Of::Tank | Of::Water | Of::Wall(true));
    extents.iter().filter(on_lattice).map(|e| e.bounds).fold(Bounds::NONE, Bounds::union)
}

/// Times its own length by which the room around what nothing holds is longer at most, for its flight: cells cost memory, and
/// a domain can be typed.
const FLIGHT: f64 = 4.0;

/// `all` of a scene with room around it: what is not `held` by a tank flies so far against and along each axis [m], and water `depth` deep along
/// gravity [m] splashes.
pub(crate) fn with_room(case: &Case, all: Bounds, held: bool, flight: (DVec3, DVec3), depth: f64) -> Bounds {
    let room = 4.0 * case.run.spacing;
    // Nothing but walls keeps bodies and free drops in place, and they cost nothing while there are few.
    let around = if held { room } else { (0.5 * (all.hi - all.lo).length()).max(room) };
    let (mut lo, mut hi) = (all.lo - around, all.hi + around);
    if !held {
        let farthest = DVec3::splat(FLIGHT * around);
        lo -= flight.0.min(farthest);
        hi += flight.1.min(farthest);
    }
    let mut gravity = DVec3::from(case.run.gravity);
    if case.run.dimensions == 2 {
        gravity.y = 0.0;
    }
    if gravity.length() > 0.0 {
        let up = -gravity.normalize();
        let tank =
            case.tank.as_ref().map_or(0.0, |t| (DVec3::from(t.max) - DVec3::from(t.min)).dot(up.abs()));
        // What comes in may fill the tank, whatever goes out meanwhile.
        let depth = if case.inflow.is_empty() { depth } else { depth.max(tank) };
        let head = up * (4.0 * depth).max(tank);
        lo += head.min(DVec3::ZERO);
        hi += head.max(DVec3::ZERO);
    }
    Bounds { lo, hi }
}

/// The domain as [`crate::scene::Scene`] makes it, as far as the numbers of the case tell.
pub(crate) fn domain(case: &Case, extents: &[Extent]) -> Bounds {
    if let Some([lo, hi]) = case.run.domain {
        return Bounds::new(lo, hi);
    }
    let (l0, flat) = (case.run.spacing, case.run.dimensions == 2);
    let (layers, tank) = (case.run.effective_radius.ceil() * l0, case.tank.as_ref());
    let seen = extents.iter().filter(|e| e.of != Of::Wall(false));
    let mut all = seen.map(|e| e.bounds).fold(Bounds::NONE, Bounds::union);
    if let Some(t) = tank {
        let outer = Bounds::new(DVec3::from(t.min) - layers, DVec3::from(t.max) + layers);
        all = all.union(outer);
    }
    if all.lo.x > all.hi.x {
        return Bounds::new([0.0; 3], [0.0; 3]);
    }
    if flat {
        (all.lo.y, all.hi.y) = (0.0, 0.0);
    }
    let water = extents.iter().filter(|e| e.of == Of::Water).map(|e| e.bounds);
    let water = water.reduce(Bounds::union);
    let held = tank.is_some() && water.is_some();
    let up = DVec3::from(case.run.gravity).normalize_or_zero().abs();
    let size = |b: Bounds| (b.hi - b.lo).max(DVec3::ZERO).dot(up);
    let still = water.map_or(0.0, size);
    let Bounds { mut lo, mut hi } = with_room(case, all, held, flight(case), still);
    if let Some(t) = tank {
        for k in (0..3).filter(|&k| t.periodic()[k]) {
            (lo[k], hi[k]) = (t.min[k], t.max[k]);
        }
    }
    Bounds { lo, hi }
}

/// How far water and free bodies fly with their velocity at t = 0 until the end, against and along each axis [m].
fn flight(case: &Case) -> (DVec3, DVec3) {
    let free = case.body.iter().filter(|b| !b.is_driven()).map(|b| b.velocity);
    let fluid = case.fluid.iter().flat_map(|f| {
        let blocks = f.block.iter().map(|b| b.velocity);
        blocks.chain(f.shape.iter().map(|s| s.velocity)).chain(f.fill.iter().map(|s| s.velocity))
    });
    let speeds = fluid.chain(free).map(DVec3::from);
    let (least, most) = speeds.fold((DVec3::ZERO, DVec3::ZERO), |(a, b), v| (a.min(v), b.max(v)));
    (-case.run.end * least, case.run.end * most)
}

/// Part of a spacing that places in a file may be off by.
const OFF: f64 = 1e-3;

/// Whether places between `low` and `high` [m] are to be kept in double precision, for single precision is off by more than a thousandth
/// of the `spacing` [m] there: coordinates of a site are far from their origin.
pub(crate) fn in_double((low, high): (DVec3, DVec3), spacing: f64) -> bool {
    low.abs().max(high.abs()).max_element() * f64::from(f32::EPSILON) > OFF * spacing
}
