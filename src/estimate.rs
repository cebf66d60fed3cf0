//! What a case will take in memory and on disk, from the case alone: nothing is built, and no number overflows.

use crate::case::{
    Case, Choice, Encoding, Face, Form, Guide, OutputField, OutputKind, OutputRegion, Place, Series, Vector,
    Wall,
};
use glam::{DMat3, DVec3};
use serde::Serialize;

/// Bytes on the host, as measured on the transport case from 27,000 to 577,000 particles, states among them: for each particle, for
/// each one of water (the lists and the solver), for each cell of the search, for each cell of the lattice.
const PARTICLE: f64 = 400.0;
/// What of the former a rank does without that is not the first: it keeps no whole scene and gathers no frame.
const PARTICLE_OF_FIRST: f64 = 210.0;
const WATER: f64 = 1200.0;
const WATER_ON_DEVICE: f64 = 300.0;
const SEARCH_CELL: f64 = 13.0;
const LATTICE_CELL: f64 = 1.0;
/// The program itself.
const PROGRAM: f64 = 16e6;
/// Bytes of a particle in a frame with all fields, by encoding, and in a checkpoint.
const FRAME_BASE64: f64 = 45.0;
const FRAME_RAW: f64 = 50.0;
/// Bytes of the position and the cell of a particle in a frame, before it is packed.
const POINT: f64 = 21.0;
const CHECKPOINT: f64 = 120.0;
/// Bytes of a row of the tables, and more for each solid.
const ROW: f64 = 700.0;
const ROW_OF_SOLID: f64 = 400.0;

/// What a series of frames will take on disk.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SeriesEstimate {
    /// Name.
    pub name: String,
    /// Frames.
    pub frames: f64,
    /// Bytes of a frame.
    pub frame_bytes: f64,
}

/// What a case will take.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Estimate {
    /// Particles of water.
    pub water: f64,
    /// All particles.
    pub particles: f64,
    /// Cells of the neighbour search.
    pub cells: f64,
    /// Memory of a run on the CPU [bytes].
    pub memory_cpu: f64,
    /// Memory on the host of a run on a device [bytes].
    pub memory_beside_device: f64,
    /// Frames.
    pub frames: f64,
    /// Bytes of a frame.
    pub frame_bytes: f64,
    /// Those of each `[[output.series]]`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub series: Vec<SeriesEstimate>,
    /// Bytes of a row of all tables.
    pub row_bytes: f64,
    /// Bytes of the tables.
    pub table_bytes: f64,
    /// Bytes of the checkpoints that are kept.
    pub checkpoint_bytes: f64,
}

/// A box that grows.
#[derive(Clone, Copy)]
struct Bounds {
    lo: Vector,
    hi: Vector,
}

impl Bounds {
    const NONE: Self = Self { lo: [f64::INFINITY; 3], hi: [f64::NEG_INFINITY; 3] };

    fn add(&mut self, lo: Vector, hi: Vector) {
        for k in 0..3 {
            self.lo[k] = self.lo[k].min(lo[k]);
            self.hi[k] = self.hi[k].max(hi[k]);
        }
    }
    /// A solid, wherever its tables take it; one that turns about `pivot` in a sphere about it.
    fn add_moving(&mut self, lo: Vector, hi: Vector, rows: &[[f64; 4]], pivot: Option<Vector>) {
        self.add(lo, hi);
        let (lo, hi) = pivot.map_or((lo, hi), |pivot| {
            let far = [0, 1, 2].map(|k| (lo[k] - pivot[k]).abs().max((hi[k] - pivot[k]).abs()));
            let reach = length(&far);
            (pivot.map(|x| x - reach), pivot.map(|x| x + reach))
        });
        let still = [[0.0; 4]];
        for row in if rows.is_empty() { &still } else { rows } {
            let at = |x: Vector| [x[0] + row[1], x[1] + row[2], x[2] + row[3]];
            self.add(at(lo), at(hi));
        }
    }
    /// A solid about `center`, wherever tables and formulas take it, or a wave that it makes by strokes along a direction.
    fn add_guided(
        &mut self,
        (lo, hi): (Vector, Vector),
        guide: &Guide,
        wave: Option<(Vector, [f64; 2])>,
        center: Vector,
    ) {
        let pivot = guide.turns().then_some(guide.pivot.unwrap_or(center));
        self.add_moving(lo, hi, guide.motion.unwrap_or_default(), pivot);
        let sine = guide.sine.map(|s| (s.axis, s.formula().reach()));
        for (axis, reach) in sine.into_iter().chain(wave) {
            let unit = length(&axis).recip();
            let row = |way: f64| [0.0, way * unit * axis[0], way * unit * axis[1], way * unit * axis[2]];
            self.add_moving(lo, hi, &reach.map(row), pivot);
        }
    }
    fn size(&self, k: usize) -> f64 {
        (self.hi[k] - self.lo[k]).max(0.0)
    }
}

fn length(v: &Vector) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Lower and upper corner of the box around a wall [m], and its open faces. What cannot be read has no size: whoever
/// builds the scene says so.
fn edges<'a>(wall: &Wall, spacing: f64, flat: bool, open: &'a [Face]) -> (Vector, Vector, &'a [Face]) {
    let (form, place) = match wall {
        Wall::Lattice(min, max) => return (*min, *max, open),
        Wall::Shaped(form, place) => (form, place),
    };
    let (Place::Center(at) | Place::Position(at)) = *place;
    let Ok((shape, _)) = form.shape(spacing, flat) else { return (at, at, open) };
    let turn = form.turn(flat);
    let middle = DVec3::from(at)
        + if matches!(place, Place::Position(_)) { turn * shape.origin() } else { DVec3::ZERO };
    let half = shape.extent(DMat3::from_quat(turn * shape.frame()));
    ((middle - half).to_array(), (middle + half).to_array(), open)
}

/// Edges of a form that is not turned [m]; none of what cannot be read.
fn size(form: &Form, spacing: f64, flat: bool) -> Vector {
    let of = |(shape, _): (crate::shape::Shape, f64)| {
        (2.0 * shape.extent(DMat3::from_quat(shape.frame()))).to_array()
    };
    form.shape(spacing, flat).map_or([0.0; 3], of)
}

impl Estimate {
    /// Of `case`, which has passed the check.
    pub fn new(case: &Case) -> Self {
        let run = &case.run;
        let (l0, flat) = (run.spacing, run.dimensions == 2);
        let layers = run.effective_radius.ceil();
        let axes = || (0..3).filter(move |&k| !(flat && k == 1));
        let cells =
            |size: &dyn Fn(usize) -> f64| axes().map(|k| (size(k) / l0).ceil().max(1.0)).product::<f64>();
        let span = |lo: &Vector, hi: &Vector, k: usize| hi[k] - lo[k];
        let blocks = case.fluid.iter().flat_map(|f| &f.block);
        let water: f64 = blocks.clone().map(|b| cells(&|k| span(&b.min, &b.max, k))).sum();
        let tank = case.tank.as_ref();
        let shapes = case.fluid.iter().flat_map(|f| &f.shape).map(|w| Wall::Shaped(w.form(tank), w.place()));
        let shapes: Vec<(Vector, Vector, &[Face])> = shapes.map(|w| edges(&w, l0, flat, &[])).collect();
        let water = water + shapes.iter().map(|(lo, hi, _)| cells(&|k| span(lo, hi, k))).sum::<f64>();
        // At most all of the tank below the highest level.
        let level = case.fluid.iter().flat_map(|f| &f.fill).map(|f| f.level).reduce(f64::max);
        let filled = |(t, level): (&crate::case::Tank, f64)| {
            cells(&|k| {
                if k == 2 { (level - t.min[2]).clamp(0.0, t.max[2] - t.min[2]) } else { t.max[k] - t.min[k] }
            })
        };
        let water = water + tank.zip(level).map_or(0.0, filled);
        // What comes in, but no more than the tank holds, or than the case says.
        let comes = |o: crate::case::OpeningKeys| {
            let volume = match (o.velocity, o.discharge, tank) {
                (Some(velocity), _, Some(tank)) => velocity.total(run.end) * o.area(tank, flat),
                (None, Some(discharge), _) => discharge.total(run.end),
                _ => 0.0,
            };
            volume / if flat { l0 * l0 } else { l0.powi(3) }
        };
        let comes: f64 = case.openings().filter(|o| o.is_inflow()).map(comes).sum();
        let most = case.fluid.as_ref().and_then(|f| f.max_volume);
        let most = most.map(|v| v / if flat { l0 * l0 } else { l0.powi(3) });
        let slots = most.filter(|_| case.openings().any(|o| o.is_inflow()));
        let most = most.or_else(|| tank.map(|t| 2.0 * cells(&|k| span(&t.min, &t.max, k))));
        let water =
            if comes > 0.0 { (water + comes).min(most.unwrap_or(f64::INFINITY)).max(water) } else { water };
        // A shell of `layers` around or inside of a box.
        let shell = |size: &dyn Fn(usize) -> f64, open: &[Face]| {
            let closed = 1.0 - open.len() as f64 / if flat { 4.0 } else { 6.0 };
            let area: f64 = axes()
                .map(|k| {
                    2.0 * axes().filter(|&j| j != k).map(|j| (size(j) / l0).ceil().max(1.0)).product::<f64>()
                })
                .sum();
            (area * closed.max(0.0) * layers).min(f64::MAX)
        };
        let inside = |size: &dyn Fn(usize) -> f64, open: &[Face]| shell(size, open).min(cells(size));
        let obstacles = case.obstacle.iter().map(|o| (o.wall(tank), &o.open[..]));
        let moving = case.moving_wall.iter().map(|w| (w.wall(tank), &w.open[..]));
        let walls: Vec<(Vector, Vector, &[Face])> =
            obstacles.chain(moving).map(|(wall, open)| edges(&wall, l0, flat, open)).collect();
        let mut solids: f64 =
            walls.iter().map(|(lo, hi, open)| inside(&|k| span(lo, hi, k), open)).sum::<f64>();
        if let Some(tank) = &case.tank {
            solids += shell(&|k| span(&tank.min, &tank.max, k), &tank.without_wall());
        }
        let across = |p: &crate::case::Plane| if flat { 1.0 } else { (p.size[1] / l0).ceil().max(1.0) };
        solids +=
            case.plane.iter().map(|p| (p.size[0] / l0).ceil().max(1.0) * across(p) * layers).sum::<f64>();
        let extent = |body: &crate::case::Body| size(&body.form(), l0, flat);
        solids += case.body.iter().map(|b| inside(&|k| extent(b)[k], &[])).sum::<f64>();

        let mut lattice = Bounds::NONE;
        case.tank.iter().for_each(|t| lattice.add(t.min, t.max));
        blocks.for_each(|b| lattice.add(b.min, b.max));
        shapes.iter().for_each(|(lo, hi, _)| lattice.add(*lo, *hi));
        // What is on the lattice; ground that reaches beyond a tank is cut off there.
        let on_lattice = |o: Option<(Vector, Vector)>| o.is_some() || tank.is_none();
        let mut domain = Bounds::NONE;
        let corners = case.obstacle.iter().map(|o| o.corners());
        let corners = corners.chain(case.moving_wall.iter().map(|w| w.corners()));
        for ((lo, hi, _), corners) in walls.iter().zip(corners) {
            if on_lattice(corners) {
                lattice.add(*lo, *hi);
            }
        }
        domain.add(lattice.lo, lattice.hi);
        for (w, (lo, hi, _)) in case.moving_wall.iter().zip(&walls[case.obstacle.len()..]) {
            let center = [0, 1, 2].map(|k| 0.5 * (lo[k] + hi[k]));
            let wave =
                w.wave.as_ref().zip(w.wave(case)).map(|(k, wave)| (k.direction(), wave.formula.reach()));
            domain.add_guided((*lo, *hi), &w.guide(), wave, center);
        }
        for body in &case.body {
            let half = 0.5 * length(&extent(body));
            let edges = (body.center.map(|x| x - half), body.center.map(|x| x + half));
            domain.add_guided(edges, &body.guide(), None, body.center);
        }
        for plane in &case.plane {
            let half = 0.5 * plane.size[0].hypot(if flat { 0.0 } else { plane.size[1] });
            domain.add(plane.center.map(|x| x - half), plane.center.map(|x| x + half));
        }
        if let Some([lo, hi]) = run.domain {
            domain = Bounds { lo, hi };
        } else if length(&run.gravity) > 0.0 {
            // Room for splashes, as the scene leaves it.
            domain.hi[2] += axes().map(|k| domain.size(k)).fold(0.0, f64::max);
        }
        // Room for water that may come in is kept from the start on, as much as the case says and the domain holds.
        let slots = slots.map_or(water, |n| n.min(cells(&|k| domain.size(k))).max(water));
        let reach = run.effective_radius * l0;
        let wet = water > 0.0;
        let searched = axes().map(|k| (domain.size(k) / reach).ceil() + 8.0).product::<f64>();
        let searched = if wet { searched } else { 0.0 };
        let ground = (cells(&|k| lattice.size(k)) * LATTICE_CELL).max(0.0);
        let particles = water + solids;
        let kept = slots + solids;
        let base = PROGRAM + kept * PARTICLE + searched * SEARCH_CELL + ground;

        let output = &case.output;
        let frames = |every: f64| if every > 0.0 { (run.end / every).floor() + 2.0 } else { 0.0 };
        let bodies: f64 = case.body.iter().map(|b| inside(&|k| extent(b)[k], &[])).sum();
        let each = if output.encoding == Encoding::Raw { FRAME_RAW } else { FRAME_BASE64 };
        let told = |fields: &[OutputField]| POINT + fields.iter().map(|f| f.bytes()).sum::<usize>() as f64;
        // No region holds more water than fits into it.
        let room = |region: &OutputRegion| cells(&|k| span(&region.min, &region.max, k));
        let frame = |choice: Choice<'_>| {
            let shown = |kind| if choice.has(kind) { 1.0 } else { 0.0 };
            let water = choice.region.as_ref().map_or(water, |region| water.min(room(region)));
            let told = each * told(choice.fields) / told(&OutputField::ALL);
            told * (water * shown(OutputKind::Fluid) + bodies * shown(OutputKind::Body))
        };
        let series = |named: &Series| SeriesEstimate {
            name: named.name.clone(),
            frames: frames(named.every),
            frame_bytes: frame(named.choice()),
        };
        let moving = (case.body.len() + case.moving_wall.len()) as f64;
        let rows = run.end / output.table_every.unwrap_or(run.time_step).max(run.time_step);
        let saves = run.checkpoint.wall > 0.0 || run.checkpoint.every.is_some();
        Self {
            water,
            particles,
            cells: searched,
            memory_cpu: base + slots * WATER,
            memory_beside_device: base + slots * WATER_ON_DEVICE,
            frames: frames(output.every),
            frame_bytes: frame(output.choice()),
            series: output.series.iter().map(series).collect(),
            row_bytes: ROW + moving * ROW_OF_SOLID,
            table_bytes: rows * (ROW + moving * ROW_OF_SOLID),
            checkpoint_bytes: if saves { 3.0 * CHECKPOINT * kept } else { 0.0 },
        }
    }

    /// Of a run of `case` whose steps are `dt` [s] long: those that its scene allows.
    pub fn at_step(self, case: &Case, dt: f64) -> Self {
        let rows = case.run.end / case.output.table_every.unwrap_or(dt).max(dt);
        let steps = (case.run.end / dt).ceil();
        Self { table_bytes: rows * self.row_bytes, ..self }.at_most(Some(steps as u64))
    }

    /// Of a run that stops after `steps`, if any: no step has two frames.
    pub fn at_most(self, steps: Option<u64>) -> Self {
        let Some(steps) = steps.map(|n| n as f64) else { return self };
        let frames = self.frames.min(steps + 2.0);
        let fewer = |named: &SeriesEstimate| SeriesEstimate {
            frames: named.frames.min(steps + 2.0),
            ..named.clone()
        };
        let series = self.series.iter().map(fewer).collect();
        let table_bytes = self.table_bytes.min(steps * self.row_bytes);
        Self { frames, series, table_bytes, ..self }
    }

    /// Memory of a machine on which the first and others, `here` of `all` ranks, compute the case: each builds the scene and has
    /// its part of the water. (577,084 particles, 210,983 of water, 2, 4 and 8 ranks of a machine: 1.02, 1.04 and 1.01 times the peaks
    /// that were measured.)
    pub fn memory_on_ranks(&self, here: usize, all: usize) -> f64 {
        let (here, all) = (here as f64, all as f64);
        let shared = self.water * WATER;
        let first = self.memory_cpu - shared;
        first + (here - 1.0) * (first - self.particles * PARTICLE_OF_FIRST) + shared * here / all
    }

    /// All bytes that will be written and kept.
    pub fn disk(&self) -> f64 {
        let series: f64 = self.series.iter().map(|s| s.frames * s.frame_bytes).sum();
        self.frames * self.frame_bytes + series + self.table_bytes + self.checkpoint_bytes
    }
}

/// Bytes in words.
pub fn bytes(n: f64) -> String {
    match n {
        n if n >= 1e12 => format!("{:.1} TB", n / 1e12),
        n if n >= 1e9 => format!("{:.1} GB", n / 1e9),
        n if n >= 1e6 => format!("{:.1} MB", n / 1e6),
        n => format!("{:.0} kB", n / 1e3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(more: &str) -> Case {
        let text = format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\n{more}[tank]\nmin = [0, 0, 0]\nmax = [3.5, 0.5, 0.5]\n\
             open = [\"z_max\"]\n[fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.5, 0.5, 0.35]\n"
        );
        toml::from_str(&text).expect("a case")
    }

    #[test]
    fn counts_are_those_of_the_scene_nearly() {
        let case = case("");
        let scene = crate::scene::Scene::build(&case).expect("a scene");
        let estimate = Estimate::new(&case);
        let near = |a: f64, b: usize| (a / b as f64 - 1.0).abs();
        assert!(near(estimate.water, scene.groups.fluid) < 0.05, "{estimate:?}");
        assert!(
            near(estimate.particles, scene.groups.total()) < 0.25,
            "{estimate:?}, {}",
            scene.groups.total()
        );
    }

    #[test]
    fn ranks_of_a_machine_share_the_water_and_each_have_the_scene() {
        let estimate = Estimate::new(&case(""));
        let on = |here, all| estimate.memory_on_ranks(here, all);
        assert_eq!(on(1, 1), estimate.memory_cpu);
        assert!(on(4, 4) > on(2, 2) && on(2, 2) > on(1, 1) && on(2, 2) < 2.0 * on(1, 1));
        assert!(on(4, 8) < on(4, 4) && on(4, 8) > 0.5 * on(8, 8));
    }

    #[test]
    fn no_number_overflows() {
        for (key, value) in [("spacing", 1e-300), ("end", 1e300)] {
            let mut case = case("");
            if key == "spacing" {
                case.run.spacing = value
            } else {
                case.run.end = value
            }
            case.run.domain = Some([[-1e300; 3], [1e300; 3]]);
            let estimate = Estimate::new(&case);
            assert!(estimate.memory_cpu > 1e15 && !estimate.memory_cpu.is_nan(), "{estimate:?}");
            assert!(!estimate.disk().is_nan());
        }
    }
}
