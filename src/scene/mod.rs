//! The scene: every particle on its lattice, every solid with its geometry, built from a checked case.
//!
//! A scene holds no device data and does no input or output. Particles are stored in five groups, in
//! this order, and the order never changes (see [`Groups`]):
//!
//! | group | kinds | moves | carries pressure |
//! |---|---|---|---|
//! | fluid | [`Kind::Fluid`] | yes | yes |
//! | moving wall | [`Kind::Wall`], [`Kind::BodyWall`] of a moving solid | with its solid | yes |
//! | static wall | [`Kind::Wall`] | no | yes |
//! | static dummy | [`Kind::Dummy`] | no | no |
//! | moving dummy | [`Kind::Dummy`], [`Kind::BodyDummy`] of a moving solid | with its solid | no |

mod behind;
mod bodies;
mod build;
mod buried;
mod cavities;
mod covered;
mod curve;
mod displaced;
mod domain;
mod fits;
mod gauged;
mod inflow_depth;
mod jitter;
mod lattice;
mod layout;
mod meetings;
mod motion;
mod near;
mod open_faces;
mod opening;
mod oriented;
mod part;
mod placement;
mod room;
mod shaped;
mod support;
mod walls;
mod water;
mod wave_depth;

pub use crate::shape::{Edges, Face, Shape};
pub(crate) use buried::COVERED;
pub(crate) use covered::INFLOW_ROOM;
pub use curve::Curve;
pub use motion::Motion;
pub use opening::{Course, Opening, Passes};
pub(crate) use part::Still;
pub(crate) use placement::{CONTACT_DISTANCE, point};

use crate::periodic::Periodic;
use crate::shape::{Bending, Surface, WallLayer, bending};
use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Particles of `wall` that stand for `point`, and the way from each, or the image of it that is nearest, to the point [m]: those within half an effective
/// radius `reach` of it, or, where the lattice has moved the wall away, of the nearest one. `Err` holds the nearest if the point is on no wall, and
/// nothing if there are no walls.
///
/// # Errors
/// See above.
pub(crate) fn wall_at(
    wall: &[DVec3],
    point: DVec3,
    (reach, spacing): (f64, f64),
    periodic: &Periodic,
) -> Result<Vec<(usize, DVec3)>, Option<DVec3>> {
    // A face moves by up to half a spacing to fit the lattice, its particles stand half a spacing behind it; along
    // the face it may end half a spacing short, and half a spacing from the last particle.
    let farthest = 3_f64.sqrt() * (1.0 + 1e-6) * spacing;
    let ways = || wall.iter().map(|x| periodic.nearest(point - *x));
    let nearest = ways().min_by(|a, b| a.length().total_cmp(&b.length()));
    let nearest = nearest.filter(|way| way.length() <= farthest).ok_or(nearest.map(|way| point - way))?;
    let from = if nearest.length() <= reach { DVec3::ZERO } else { nearest };
    Ok(ways().enumerate().filter(|(_, way)| way.distance(from) <= reach).collect())
}

/// What a particle is.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, Serialize, Deserialize)]
#[repr(u8)]
pub enum Kind {
    /// Water.
    Fluid = 0,
    /// Outermost layer of a fixed or prescribed wall; carries pressure, Eq. (8).
    Wall = 1,
    /// Deeper layers of a wall; complete the number density only (section 2).
    Dummy = 2,
    /// Outermost layer of a body; carries pressure and contact.
    BodyWall = 3,
    /// Inside of a body.
    BodyDummy = 4,
    /// A fluid particle that left the domain, was swallowed, became non-finite or has not come in yet; takes part in nothing.
    Ghost = 5,
}

impl Kind {
    /// The kind of a number, as `kind as u8` gives it.
    pub(crate) fn from_code(code: u8) -> Option<Self> {
        let all = [Self::Fluid, Self::Wall, Self::Dummy, Self::BodyWall, Self::BodyDummy, Self::Ghost];
        all.into_iter().find(|&k| k as u8 == code)
    }
}

/// How many particles each group holds; the groups lie in this order.
#[derive(Clone, Copy, Default, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Groups {
    /// Fluid particles, and slots for those that are to come in.
    pub fluid: usize,
    /// Wall-layer particles of moving solids.
    pub moving_wall: usize,
    /// Wall-layer particles that never move.
    pub static_wall: usize,
    /// Dummy particles that never move.
    pub static_dummy: usize,
    /// Dummy particles of moving solids.
    pub moving_dummy: usize,
}

impl Groups {
    /// All particles.
    pub fn total(&self) -> usize {
        self.fluid + self.moving_wall + self.static_wall + self.static_dummy + self.moving_dummy
    }
    /// Particles that carry pressure: the first `pressure()` slots.
    pub fn pressure(&self) -> usize {
        self.fluid + self.moving_wall + self.static_wall
    }
    /// Slots of the wall layers of moving solids.
    pub fn moving_wall_range(&self) -> Range<usize> {
        self.fluid..self.fluid + self.moving_wall
    }
    /// Slots of the wall layers that never move.
    pub fn static_wall_range(&self) -> Range<usize> {
        self.fluid + self.moving_wall..self.pressure()
    }
    /// Slots of everything that never moves.
    pub fn static_range(&self) -> Range<usize> {
        self.fluid + self.moving_wall..self.total() - self.moving_dummy
    }
    /// Slots of the dummies of moving solids.
    pub fn moving_dummy_range(&self) -> Range<usize> {
        self.total() - self.moving_dummy..self.total()
    }
    /// Slots of all that moving solids have.
    pub fn moving_slots(&self) -> impl Iterator<Item = usize> + Clone + use<> {
        self.moving_wall_range().chain(self.moving_dummy_range())
    }
}

/// Geometry of a fixed wall, for contact and for the checks at t = 0. Surfaces lie where the wall
/// particles put them (half a spacing outside the wall layer's centres).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WallShape {
    /// Name of the wall as the case gives it (`tank.z_min`, an obstacle's name ...).
    pub name: String,
    /// Centre of the box [m].
    pub center: DVec3,
    /// Half of the edge lengths of the box [m].
    pub half: DVec3,
    /// Orientation of the box (columns are its axes in the world).
    pub axes: DMat3,
    /// Where torques on it count about [m]: of a face of the tank the middle of its surface, without what of the layers reaches beyond; of a plane the
    /// `center` of the case, on its surface; else the centre of the box.
    pub middle: DVec3,
}

/// Mass properties and freedom of a body that moves under forces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeBody {
    /// Mass [kg].
    pub mass: f64,
    /// Principal moments of inertia about the solid's `position`, in the body's frame [kg m2]; of a hinged body three times the one
    /// about the hinge.
    pub inertia: DVec3,
    /// From the solid's `position` to the centre of mass, body's frame [m]: 0 but for a hinge.
    pub weight_arm: DVec3,
    /// Initial velocity of the solid's `position` [m/s].
    pub velocity: DVec3,
    /// Initial angular velocity, world axes [rad/s].
    pub angular_velocity: DVec3,
    /// `true` where a translation x, y, z is locked.
    pub locked_translation: [bool; 3],
    /// `true` where a rotation about world x, y, z is locked.
    pub locked_rotation: [bool; 3],
}

impl FreeBody {
    /// Whether it can fall along `up`, to whatever is below; on a hinge it falls from its upper to its lower balance.
    pub fn falls(&self, up: DVec3) -> bool {
        (0..3).any(|k| up[k].abs() > 1e-9 && !self.locked_translation[k])
    }

    /// Whether it is free to move in any way at all.
    pub fn gives_way(&self) -> bool {
        self.locked_translation != [true; 3] || self.locked_rotation != [true; 3]
    }
}

/// How a moving solid moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Drive {
    /// Newton's laws.
    Free(FreeBody),
    /// A table of motion (a gate, a wave paddle).
    Prescribed(Motion),
}

/// A solid that moves as one: a body or a moving wall. Its particles are listed in the order in which
/// they stand in the groups, wall layer first.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Solid {
    /// Name from the case.
    pub name: String,
    /// `true` for a `[[body]]`, `false` for a `[[moving_wall]]`.
    pub is_body: bool,
    /// Shape, in the solid's frame. A rank of many is not told: it has the particles, and contact is on the first one.
    #[serde(skip, default = "unknown")]
    pub shape: Shape,
    /// Initial position of what it moves and turns about [m]: of a free body the centre of mass or a place on its hinge.
    pub position: DVec3,
    /// From there to the centre of `shape`, solid's frame [m].
    pub shape_offset: DVec3,
    /// Initial orientation.
    pub orientation: DQuat,
    /// Turn from its frame to that in which the keys of its shape (file, section, axis) describe it, before `orientation`.
    pub frame: DQuat,
    /// How it moves.
    pub drive: Drive,
    /// Slots of the wall layer, counted from the first particle; they lie within the moving-wall group.
    pub wall_slots: Range<usize>,
    /// Slots of the inside, counted from the first particle; they lie within the moving-dummy group.
    pub dummy_slots: Range<usize>,
    /// Offsets of the wall-layer particles from `position`, solid's frame [m].
    pub wall_offset: Vec<DVec3>,
    /// Offsets of the dummies, solid's frame [m].
    pub dummy_offset: Vec<DVec3>,
    /// Outward area vector of each wall-layer particle, solid's frame [m2]: the sum over the faces it
    /// belongs to of outward normal times face area per particle.
    pub wall_area: Vec<DVec3>,
    /// For each wall-layer particle, the vector from its centre to the true surface, solid's frame [m]: where it belongs to two or three
    /// faces to the edge or corner, of sections and meshes to the middle of the nearest places on them.
    pub wall_to_surface: Vec<DVec3>,
    /// Those wall-layer particles that have several faces.
    pub wall_edges: Edges,
}

/// A shape without size, where it is not told.
fn unknown() -> Shape {
    Shape::cuboid(DVec3::ZERO)
}

impl Solid {
    /// Whether forces move it.
    pub fn is_free(&self) -> bool {
        matches!(self.drive, Drive::Free(_))
    }

    /// Whether it stands still for ever: an obstacle that is no box of the lattice.
    pub fn is_still(&self) -> bool {
        matches!(&self.drive, Drive::Prescribed(motion) if motion.is_still())
    }

    /// Whether it moves along a path that is given, whatever forces are.
    pub(crate) fn is_driven(&self) -> bool {
        matches!(&self.drive, Drive::Prescribed(motion) if !motion.is_still())
    }

    /// Whether it stays where it is: it stands still for ever, or is free but held in all that it could do.
    pub(crate) fn stays(&self) -> bool {
        self.is_still() || self.is_free() && !self.gives_way()
    }

    /// Whether forces move it: it is free, and not held in all that it could do.
    pub fn gives_way(&self) -> bool {
        matches!(&self.drive, Drive::Free(free) if free.gives_way())
    }

    /// Whether it may turn.
    pub(crate) fn turns(&self) -> bool {
        match &self.drive {
            Drive::Free(free) => free.locked_rotation != [true; 3],
            Drive::Prescribed(motion) => motion.turns(),
        }
    }

    /// Whether it turns where it is: on a hinge, or with all of its translations locked.
    pub(crate) fn is_hinged(&self) -> bool {
        matches!(&self.drive, Drive::Free(free) if free.locked_translation == [true; 3])
    }

    /// What it is in a case.
    pub(crate) fn what(&self) -> &'static str {
        match (self.is_body, self.is_still()) {
            (true, _) => "body",
            (false, true) => "obstacle",
            (false, false) => "moving wall",
        }
    }

    /// The faces of row `k`, in its frame.
    pub(crate) fn faces(&self, k: usize) -> impl Iterator<Item = Face> + use<> {
        self.wall_edges.faces(k, self.wall_area[k], self.wall_to_surface[k])
    }

    /// Which faces of its rows bend, `spacing` [m] apart.
    pub(crate) fn bending(&self, spacing: f64) -> Bending {
        bending(&self.shape, self.shape_offset, &self.wall_offset, |k| self.faces(k), spacing)
    }

    /// Turn from the shape as its keys describe it to where `orientation`, that of a pose, has it: what users are told. At the start
    /// it is the `orientation` of the case.
    pub fn turn(&self, orientation: DQuat) -> DQuat {
        (orientation * self.frame.inverse()).normalize()
    }

    /// Centre of the shape at t = 0 [m].
    pub fn shape_center(&self) -> DVec3 {
        self.position + self.orientation * self.shape_offset
    }

    /// Radius of the sphere about `position` that holds it [m].
    pub fn radius(&self) -> f64 {
        self.shape.radius() + self.shape_offset.length()
    }

    /// What of its surface presses into others, from the centre of the shape.
    pub(crate) fn surface(&self, spacing: f64, dimensions: u32) -> Surface {
        let offset: Vec<DVec3> = self.wall_offset.iter().map(|x| *x - self.shape_offset).collect();
        let wall = WallLayer { offset: &offset, to_surface: &self.wall_to_surface };
        self.shape.surface(&wall, spacing, dimensions)
    }
}

impl Scene {
    /// Names of its solids, then of its fixed walls.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let solids = self.solids.iter().map(|s| s.name.as_str());
        solids.chain(self.walls.iter().map(|w| w.name.as_str()))
    }

    /// Particles of water at t = 0.
    pub fn water(&self) -> usize {
        self.groups.fluid - self.reserve
    }

    /// Speed of the fastest water at t = 0 [m/s].
    pub fn fastest(&self) -> f64 {
        self.velocity[..self.water()].iter().map(|v| v.length()).fold(0.0, f64::max)
    }

    /// Largest speed of a solid at t = 0, or by its table [m/s].
    pub(crate) fn solids_start(&self) -> f64 {
        let start = self.solids.iter().map(|s| match &s.drive {
            Drive::Free(body) => body.velocity.length() + body.angular_velocity.length() * s.radius(),
            Drive::Prescribed(motion) => motion.fastest(f64::NEG_INFINITY, f64::INFINITY, s.radius()),
        });
        start.fold(0.0, f64::max)
    }

    /// Speed of the fastest thing that drives the water between the times `from` and `to` [m/s]: a solid with a motion, an opening.
    pub fn driven(&self, from: f64, to: f64) -> f64 {
        let solids = self.solids.iter().map(|s| match &s.drive {
            Drive::Prescribed(motion) => motion.fastest(from, to, s.radius()),
            Drive::Free(_) => 0.0,
        });
        solids.chain(self.openings.iter().map(|o| o.fastest(from, to))).fold(0.0, f64::max)
    }

    /// Direction outwards of each wall-layer particle of moving solids, in its solid's frame and of length 1; 0 where it has none, and of
    /// the walls in openings, through which the water comes and goes.
    pub fn facing(&self) -> Vec<DVec3> {
        let walls = self.solids.iter().enumerate();
        let of = |(k, solid): (usize, &Solid)| {
            let closed = if k < self.followed() { 1.0 } else { 0.0 };
            solid.wall_area.iter().map(move |area| closed * area.normalize_or_zero()).collect::<Vec<_>>()
        };
        walls.flat_map(of).collect()
    }

    /// Whether solid `k` stands still for ever. The layer in an opening goes and comes with the water that passes.
    pub fn stands(&self, k: usize) -> bool {
        self.solids[k].is_still() && k < self.followed()
    }

    /// Slots of the wall layers that never move: of fixed walls, then of the solids that stand still for ever or are held.
    pub fn still_slots(&self) -> impl Iterator<Item = usize> {
        let solids = self.solids[..self.followed()].iter().filter(|solid| solid.stays());
        self.groups.static_wall_range().chain(solids.flat_map(|solid| solid.wall_slots.clone()))
    }

    /// Solids that tables follow: all but the walls in openings, which come last.
    pub fn followed(&self) -> usize {
        self.solids.len() - self.openings.iter().filter(|o| o.solid.is_some()).count()
    }
}

/// The scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Scene {
    /// 2 or 3. In two dimensions everything lies in the plane y = 0 and stands for a slice l0 wide.
    pub dimensions: u32,
    /// Initial particle spacing l0 [m].
    pub spacing: f64,
    /// A node of the lattice on which the water stands at first, and the walls that fit it [m].
    pub node: DVec3,
    /// Gravity [m/s2].
    pub gravity: DVec3,
    /// Positions at t = 0 [m], all groups.
    pub position: Vec<DVec3>,
    /// Velocities at t = 0 [m/s], all groups.
    pub velocity: Vec<DVec3>,
    /// What each particle is.
    pub kind: Vec<Kind>,
    /// 0 for what moves freely or never, k + 1 for a particle of `solids[k]`.
    pub solid: Vec<u32>,
    /// Sizes of the groups.
    pub groups: Groups,
    /// Slots for water that comes in, at the end of those of the fluid.
    pub reserve: usize,
    /// Where water comes in and goes out: the inflows, then the outflows.
    pub openings: Vec<Opening>,
    /// Moving solids: the bodies in the case's order, then the moving walls, last those in openings.
    pub solids: Vec<Solid>,
    /// Geometry of the fixed walls.
    pub walls: Vec<WallShape>,
    /// Outward normal (into the free space) of each static wall particle, for contact; one per slot of
    /// [`Groups::static_wall_range`]. Edge particles hold the sum of their faces' normals, normalised.
    pub static_wall_normal: Vec<DVec3>,
    /// Index into `walls` of each static wall particle.
    pub static_wall_shape: Vec<u32>,
    /// Box that no particle may leave [m].
    pub domain: (DVec3, DVec3),
    /// Sides that the water goes on across.
    pub periodic: Periodic,
    /// Largest depth of water at the start, along gravity [m].
    pub depth: f64,
    /// Whether the water leaves no room free at the start, nor anything that lets in or out or is driven could: it has no free
    /// surface.
    pub filled: bool,
    /// When what comes in has filled a tank that lets nothing out, at the latest: solids that move may take room as well [s].
    pub full: Option<f64>,
    /// Whether water starts beside solids that do not stand on its lattice, where its density is not quite even.
    pub uneven: bool,
    /// What a user should know that is no error (rounded lengths, removed particles ...).
    pub notes: Vec<String>,
}
