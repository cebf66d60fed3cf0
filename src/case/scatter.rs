//! Places by chance for like solids that shall not overlap.

use super::check::Checker;
use super::copies::MOST;
use super::{BodyShape, Form, Place, Turn, Vector, Wall};
use crate::chance::mixed;
use crate::shape::Shape;
use glam::{DMat3, DQuat, DVec3, IVec3};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::f64::consts::TAU;

/// Places that are tried for a solid before it is said to find no room.
const TRIES: u32 = 2000;

/// Like solids at places by chance, in a box about `center`. None reaches out of it, and the boxes around any two of
/// them, and around bodies whose places are given, are apart, and so are these boxes and obstacles and moving walls.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// How many.
    #[cfg_attr(test, schemars(range(min = 1, max = 20_000)))]
    pub count: u32,
    /// Edge lengths of the box for them, whose middle is `center` [m].
    #[cfg_attr(test, schemars(transform = super::bounds::each_positive))]
    pub size: Vector,
    /// Least distance between two of the boxes around them [m].
    #[serde(default)]
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub gap: f64,
    /// How they are turned, beyond `orientation`.
    #[serde(default)]
    pub turned: Turned,
    /// Another number, another arrangement.
    #[serde(default)]
    pub seed: u32,
}

/// Turns of what is scattered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Turned {
    /// Every way; in two dimensions about y.
    #[default]
    Freely,
    /// About the z axis alone: trunks that lie, piles that stand.
    AboutZ,
    /// Not at all.
    No,
}

impl Checker<'_> {
    pub(super) fn scatter(&mut self, path: &str, scatter: &Scatter) {
        let count = scatter.count;
        let fits = (1..=MOST).contains(&count);
        self.range(&format!("{path}.count"), f64::from(count), fits, &format!("1 to {MOST}"));
        let axes: Vec<usize> = self.axes().collect();
        let key = format!("{path}.size");
        if axes.iter().any(|&k| scatter.size[k].is_nan() || scatter.size[k] <= 0.0) || !finite(scatter.size) {
            self.add(key, "an edge of the box is not positive", "allowed: more than 0 m");
        }
        if !(scatter.gap >= 0.0 && scatter.gap.is_finite()) {
            self.add(
                format!("{path}.gap"),
                format!("{} is out of range", scatter.gap),
                "allowed: 0 m or more",
            );
        }
        if self.flat() && scatter.turned == Turned::AboutZ {
            let message = "in two dimensions a solid turns about y alone";
            self.add(format!("{path}.turned"), message, "use \"freely\" or \"no\"");
        }
    }
}

fn finite(v: Vector) -> bool {
    v.iter().all(|x| x.is_finite())
}

/// A box around a solid.
#[derive(Clone, Copy, Debug)]
struct Block {
    center: DVec3,
    half: DVec3,
    /// Columns are the directions of its edges.
    axes: DMat3,
}

impl Block {
    /// That of a solid of the shape `form` about its middle; `None` of what is none, which is told elsewhere.
    fn of(form: &Form, spacing: f64, flat: bool) -> Option<Self> {
        let (shape, _) = form.shape(spacing, flat).ok()?;
        let (low, high) = shape.bounds(DMat3::IDENTITY);
        let axes = DMat3::from_quat(form.turn(flat) * shape.frame());
        Self { center: axes * (0.5 * (low + high)), half: 0.5 * (high - low), axes }.sound()
    }

    /// Itself if it has a size and a place.
    fn sound(self) -> Option<Self> {
        let known = self.center.is_finite() && self.half.is_finite() && self.axes.is_finite();
        (known && self.half.cmpgt(DVec3::ZERO).all()).then_some(self)
    }

    /// Whether `gap` and more lies between it and `wall`, as far as halving it down to parts of [`PART`] of it shows.
    fn is_off(&self, wall: &Outline, gap: f64, flat: bool) -> bool {
        let half = if flat { self.half * (DVec3::ONE - DVec3::Y) } else { self.half };
        let least = PART * half.length();
        let mut parts = vec![(DVec3::ZERO, half)];
        while let Some((center, half)) = parts.pop() {
            let (distance, reach) = (wall.distance(self.center + self.axes * center), half.length());
            if distance >= reach + gap {
                continue;
            }
            if distance <= gap || reach <= least {
                return false;
            }
            let longest = half.max_position();
            let quarter = DVec3::AXES[longest] * 0.5 * half[longest];
            parts.extend([-quarter, quarter].map(|way| (center + way, half - quarter)));
        }
        true
    }

    fn reach(&self, n: DVec3) -> f64 {
        (self.axes.transpose() * n).abs().dot(self.half)
    }

    /// Half of the edges of the box along the world's axes that holds it.
    fn bounds(&self) -> DVec3 {
        DVec3::from_array(DVec3::AXES.map(|n| self.reach(n)))
    }

    fn turned(&self, turn: DQuat) -> Self {
        let turn = DMat3::from_quat(turn);
        Self { center: turn * self.center, axes: turn * self.axes, ..*self }
    }

    /// Whether `gap` and more lies between the two: one of fifteen directions shows it (separating axes).
    fn is_clear_of(&self, other: &Self, gap: f64) -> bool {
        let way = other.center - self.center;
        let (a, b) = (self.axes, other.axes);
        let own = [a.x_axis, a.y_axis, a.z_axis, b.x_axis, b.y_axis, b.z_axis];
        let crosses = own[..3].iter().flat_map(|&u| own[3..].iter().map(move |&v| u.cross(v)));
        let mut axes = own.into_iter().chain(crosses).filter_map(DVec3::try_normalize);
        axes.any(|n| way.dot(n).abs() > self.reach(n) + other.reach(n) + gap)
    }
}

/// Size of the parts of a box that are no longer halved, over its own.
const PART: f64 = 0.02;

/// A wall that does not fill the box around it.
#[derive(Clone, Copy, Debug)]
struct Outline {
    shape: Shape,
    center: DVec3,
    axes: DMat3,
}

impl Outline {
    /// Distance of `x` from it, negative inside [m].
    fn distance(&self, x: DVec3) -> f64 {
        self.shape.distance(self.axes.transpose() * (x - self.center)).0
    }
}

/// What stands where something is to find room.
pub(super) struct Standing {
    spacing: f64,
    flat: bool,
    blocks: Vec<Block>,
    outlines: Vec<Outline>,
    /// Numbers of blocks by the cells of an even grid that they reach, and the edge of these.
    cells: HashMap<IVec3, Vec<usize>>,
    edge: f64,
}

impl Standing {
    /// Nothing yet.
    pub fn new(spacing: f64, flat: bool) -> Self {
        Self { spacing, flat, blocks: vec![], outlines: vec![], cells: HashMap::new(), edge: 0.0 }
    }

    /// A solid of the shape `form` at `center`.
    pub fn add(&mut self, form: &Form, center: Vector) {
        if let Some(block) = Block::of(form, self.spacing, self.flat) {
            self.put(Block { center: block.center + self.place(center), ..block });
        }
    }

    /// A wall: by the box around it if it fills most of that, else by its outline, for others may be meant to be in that box.
    pub fn add_wall(&mut self, wall: &Wall) {
        use BodyShape::{Box, Cone, Cylinder, Sphere};
        match wall {
            Wall::Lattice(min, max) => {
                let (low, high) = (self.place(*min), self.place(*max));
                let half = 0.5 * (high - low);
                // In two dimensions it has no width.
                let half = if self.flat { half.with_y(0.5 * self.spacing) } else { half };
                self.put(Block { center: low + half, half, axes: DMat3::IDENTITY });
            }
            Wall::Shaped(form, Place::Center(center))
                if [Box, Cone, Cylinder, Sphere].contains(&form.shape) =>
            {
                self.add(form, *center);
            }
            Wall::Shaped(form, place) => {
                // What cannot be told of a shape is told elsewhere.
                if Block::of(form, self.spacing, self.flat).is_none() {
                    return;
                }
                let Ok((shape, _)) = form.shape(self.spacing, self.flat) else { return };
                let turn = form.turn(self.flat);
                let center = match place {
                    Place::Center(at) => self.place(*at),
                    Place::Position(at) => self.place(*at) + turn * shape.origin(),
                };
                let axes = DMat3::from_quat(turn * shape.frame());
                self.outlines.push(Outline { shape, center, axes });
            }
        }
    }

    fn place(&self, center: Vector) -> DVec3 {
        let [x, y, z] = center;
        DVec3::new(x, if self.flat { 0.0 } else { y }, z)
    }

    fn put(&mut self, block: Block) {
        let Some(block) = block.sound() else { return };
        self.blocks.push(block);
        if self.edge > 0.0 {
            self.enter(self.blocks.len() - 1);
        }
    }

    fn enter(&mut self, k: usize) {
        let block = self.blocks[k];
        for cell in self.reached(block.center, block.bounds()) {
            self.cells.entry(cell).or_default().push(k);
        }
    }

    /// A grid of the size of what is to be put in.
    fn arrange(&mut self, edge: f64) {
        // What is a hundred times as large would be in all of the cells of a small one.
        let largest = self.blocks.iter().map(|b| b.bounds().max_element()).fold(0.0, f64::max);
        self.edge = edge.max(0.1 * largest);
        self.cells.clear();
        (0..self.blocks.len()).for_each(|k| self.enter(k));
    }

    fn reached(&self, center: DVec3, half: DVec3) -> impl Iterator<Item = IVec3> + use<> {
        let cell = |x: DVec3| (x / self.edge).floor().as_ivec3();
        let (low, high) = (cell(center - half), cell(center + half));
        let along = move |k: usize| low[k]..=high[k];
        along(0).flat_map(move |i| along(1).flat_map(move |j| along(2).map(move |k| IVec3::new(i, j, k))))
    }

    /// Whether nothing stands within `gap` of `block`.
    fn is_free(&self, block: &Block, gap: f64) -> bool {
        let mut cells = self.reached(block.center, block.bounds() + gap);
        let clear = cells.all(|cell| {
            let there = self.cells.get(&cell).into_iter().flatten();
            there.into_iter().all(|&k| self.blocks[k].is_clear_of(block, gap))
        });
        clear && self.outlines.iter().all(|wall| block.is_off(wall, gap, self.flat))
    }
}

/// Numbers by chance.
struct Chance {
    seed: u64,
    drawn: u64,
}

impl Chance {
    /// The next one, 0 to 1.
    fn next(&mut self) -> f64 {
        self.drawn += 1;
        // 53 bits are what a number holds.
        (mixed(mixed(self.seed) ^ self.drawn) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn turn(&mut self, turned: Turned, flat: bool) -> DQuat {
        match turned {
            Turned::No => DQuat::IDENTITY,
            Turned::AboutZ => DQuat::from_rotation_z(TAU * self.next()),
            Turned::Freely if flat => DQuat::from_rotation_y(TAU * self.next()),
            // Evenly over all turns (Shoemake 1992).
            Turned::Freely => {
                let (u, v, w) = (self.next(), TAU * self.next(), TAU * self.next());
                let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
                DQuat::from_xyzw(a * v.sin(), a * v.cos(), b * w.sin(), b * w.cos())
            }
        }
    }
}

/// Where one stands: its centre [m] and, if it is turned, its orientation.
pub(super) type Spot = (Vector, Option<Turn>);

/// Centres and turns of solids of the shape `form` in the box about `center`; `room` learns of them. What cannot be
/// told of the shape, a file that is not there say, is told elsewhere: they all stand in the middle then.
///
/// # Errors
/// What is wrong, and what to do.
pub(super) fn scattered(
    scatter: &Scatter,
    form: &Form,
    center: Vector,
    room: &mut Standing,
) -> Result<Vec<Spot>, (String, String)> {
    let flat = room.flat;
    let Some(block) = Block::of(form, room.spacing, flat) else {
        return Ok(vec![(center, None); scatter.count as usize]);
    };
    let (middle, size) = (room.place(center), DVec3::from(scatter.size));
    let mut chance = Chance { seed: u64::from(scatter.seed), drawn: 0 };
    room.arrange(2.0 * block.half.max_element() + scatter.gap);
    let mut out = vec![];
    let mut fitted = false;
    for _ in 0..scatter.count {
        let found = (0..TRIES).find_map(|_| {
            let turn = chance.turn(scatter.turned, flat);
            let turned = block.turned(turn);
            let way = DVec3::new(chance.next(), chance.next(), chance.next()) - 0.5;
            let mut free = size - 2.0 * turned.bounds();
            if flat {
                free.y = 0.0;
            }
            if free.min_element() < 0.0 {
                return None;
            }
            fitted = true;
            let placed = Block { center: middle + way * free, ..turned };
            room.is_free(&placed, scatter.gap).then_some((placed, turned.center, turn))
        });
        let Some((placed, off, turn)) = found else {
            let [x, y, z] = scatter.size;
            let message = if fitted {
                format!("{} of {} find room in a box of {x} x {y} x {z} m", out.len(), scatter.count)
            } else {
                format!("a box of {x} x {y} x {z} m is too small for one of them, however it is turned")
            };
            let remedy = "use a larger `size`, fewer of them, or `array`, which packs them closer";
            return Err((message, remedy.into()));
        };
        let at = placed.center - off;
        let at = DVec3 { y: if flat { center[1] } else { at.y }, ..at };
        let turn = (scatter.turned != Turned::No).then(|| {
            let own = form.orientation.map_or(DQuat::IDENTITY, |turn| {
                DQuat::from_axis_angle(DVec3::from(turn.axis).normalize(), turn.angle_deg.to_radians())
            });
            let (axis, angle) = (turn * own).to_axis_angle();
            // Of no turn at all the axis may be any.
            let axis = if flat { DVec3::new(0.0, axis.y.signum(), 0.0) } else { axis };
            Turn { axis: axis.to_array(), angle_deg: angle.to_degrees() }
        });
        out.push((at.to_array(), turn));
        room.put(placed);
    }
    Ok(out)
}
