//! What a case will take in memory and on disk, from the case alone: nothing is built, and no number overflows.

use crate::case::{Case, Choice, Encoding, Face, OutputField, OutputKind, OutputRegion, Series, Vector};
use crate::checkpoint::size::{AT_ONCE, Held};
use crate::extents::{self, Bounds, Extent, Of, in_double};
use crate::lattice::Lattice;
use serde::Serialize;

/// Bytes on the host, as measured on the transport case from 27,000 to 577,000 particles, states among them: for each particle, for
/// each one of water (the solver) and for each neighbour that it has on a full lattice (the lists), for each cell of the search, for each cell of
/// the lattice. (Peaks with a state that is saved, viscous, 36,000 of water at an effective radius of 2.1, 3.1 and 4.1 spacings: 1.03, 1.02 and 1.02
/// times what is told; 120,000 in the plane: 1.05, 0.92 and 0.95 times.)
const PARTICLE: f64 = 400.0;
const WATER: f64 = 240.0;
const NEIGHBOUR: f64 = 30.0;
/// For each particle of walls near the slab of one of many ranks.
const WALL_OF_RANK: f64 = 200.0;
/// For each particle of the case, on the first rank: the scene, and states that are gathered.
const PARTICLE_OF_FIRST: f64 = 300.0;
/// Beside a device: for each particle of water, and for each neighbour, of which a state that is saved has the lists twice.
const WATER_ON_DEVICE: f64 = 44.0;
const NEIGHBOUR_ON_DEVICE: f64 = 8.0;
const SEARCH_CELL: f64 = 13.0;
const LATTICE_CELL: f64 = 1.0;
/// The program itself, and with MPI.
const PROGRAM: f64 = 16e6;
const PROGRAM_OF_RANK: f64 = 30e6;
/// Of one process, while a frame is made: for each particle in it. (Peaks with states and frames, 8,000 to 210,000 of water in space: 0.93 to 1.08 times what is told.)
const FRAME: f64 = 500.0;
/// Bytes of a particle in a frame with all fields, by encoding.
const FRAME_BASE64: f64 = 45.0;
const FRAME_RAW: f64 = 50.0;
/// Bytes of the position and the cell of a particle in a frame, before it is packed.
const POINT: f64 = 21.0;
/// More of them where places are in double precision.
const IN_DOUBLE: f64 = 12.0;
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
    /// Columns of them along x: with water at the start, and all.
    #[serde(skip)]
    columns: [f64; 2],
    /// Memory of a particle of water on the CPU, beside what any particle takes [bytes].
    #[serde(skip)]
    water_bytes: f64,
    /// Memory of these, and of the lattice that the scene is built on [bytes]: the price of the room, whatever is in it.
    #[serde(skip)]
    pub room: f64,
    /// The obstacle, moving wall or body that more than half of the particles are of, and the edges of the box around
    /// it [m].
    #[serde(skip)]
    pub mostly: Option<(String, Vector)>,
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
    /// Bytes of the checkpoints that are there at once.
    pub checkpoint_bytes: f64,
    /// How many of them, and what each holds.
    #[serde(skip)]
    states: f64,
    #[serde(skip)]
    held: Held,
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
        let extents = extents::all(case);
        let shaped = |e: &&Extent| e.of == Of::Water && e.item.starts_with("fluid.shape");
        let shapes = extents.iter().filter(shaped).map(|e| e.bounds);
        let water = water + shapes.map(|b| cells(&|k| b.size(k))).sum::<f64>();
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
        let walls = extents::walls(case);
        let obstacles = case.obstacle.iter().map(|o| format!("obstacle `{}`", o.name));
        let moving = case.moving_wall.iter().map(|w| format!("moving wall `{}`", w.name));
        let named = obstacles.chain(moving).zip(&walls);
        let mut parts: Vec<(String, Vector, f64)> = named
            .map(|(name, (b, open, _))| (name, [0, 1, 2].map(|k| b.size(k)), inside(&|k| b.size(k), open)))
            .collect();
        let mut solids: f64 = parts.iter().map(|one| one.2).sum();
        if let Some(tank) = &case.tank {
            solids += shell(&|k| span(&tank.min, &tank.max, k), &tank.without_wall());
        }
        let across = |p: &crate::case::Plane| if flat { 1.0 } else { (p.size[1] / l0).ceil().max(1.0) };
        solids +=
            case.plane.iter().map(|p| (p.size[0] / l0).ceil().max(1.0) * across(p) * layers).sum::<f64>();
        let extent = |body: &crate::case::Body| extents::size(&body.form(), l0, flat);
        let bodies = case.body.iter().map(|b| {
            let size = extent(b);
            (format!("body `{}`", b.name), [0, 1, 2].map(|k| size[k]), inside(&|k| size[k], &[]))
        });
        parts.extend(bodies);
        solids += parts.iter().rev().take(case.body.len()).map(|one| one.2).sum::<f64>();

        let (lattice, domain) = (extents::lattice(&extents), extents::domain(case, &extents));
        // Room for water that may come in is kept from the start on, as much as the case says and the domain holds.
        let slots = slots.map_or(water, |n| n.min(cells(&|k| domain.size(k))).max(water));
        let reach = run.effective_radius * l0;
        let wet = water > 0.0;
        let searched = axes().map(|k| (domain.size(k) / reach).floor() + 1.0).product::<f64>();
        let searched = if wet { searched } else { 0.0 };
        let ground = (cells(&|k| lattice.size(k)) * LATTICE_CELL).max(0.0);
        let wet_box = extents.iter().filter(|e| e.of == Of::Water).map(|e| e.bounds).reduce(Bounds::union);
        let tank_box = tank.filter(|_| level.is_some()).map(|t| Bounds::new(t.min, t.max));
        let wet_box = wet_box.into_iter().chain(tank_box).reduce(Bounds::union);
        let columns = [wet_box.map_or(0.0, |b| b.size(0)), domain.size(0)];
        let columns = columns.map(|length| (length / reach).ceil().max(1.0));
        let particles = water + solids;
        let kept = slots + solids;
        let room = searched * SEARCH_CELL + ground;
        let neighbours = f64::from(Lattice::new(run.dimensions, run.effective_radius).neighbours);
        let water_bytes = WATER + neighbours * NEIGHBOUR;
        let base = PROGRAM + kept * PARTICLE + room;

        let output = &case.output;
        let frames = |every: f64| if every > 0.0 { (run.end / every).floor() + 2.0 } else { 0.0 };
        let bodies: f64 = case.body.iter().map(|b| inside(&|k| extent(b)[k], &[])).sum();
        let each = if output.encoding == Encoding::Raw { FRAME_RAW } else { FRAME_BASE64 };
        let of = |fields: &[OutputField]| fields.iter().map(|f| f.bytes()).sum::<usize>() as f64;
        let point = POINT + if in_double((domain.lo, domain.hi), l0) { IN_DOUBLE } else { 0.0 };
        // No region holds more water than fits into it.
        let holds = |region: &OutputRegion| cells(&|k| span(&region.min, &region.max, k));
        let shown = |choice: &Choice<'_>| {
            let shown = |kind| if choice.has(kind) { 1.0 } else { 0.0 };
            let water = choice.region.as_ref().map_or(water, |region| water.min(holds(region)));
            water * shown(OutputKind::Fluid) + bodies * shown(OutputKind::Body)
        };
        let frame = |choice: Choice<'_>| {
            each * (point + of(choice.fields)) / (POINT + of(&OutputField::ALL)) * shown(&choice)
        };
        let choices = output.series.iter().map(Series::choice).chain([output.choice()]);
        let base = base + choices.filter(|c| c.every > 0.0).map(|c| FRAME * shown(&c)).fold(0.0, f64::max);
        let series = |named: &Series| SeriesEstimate {
            name: named.name.clone(),
            frames: frames(named.every),
            frame_bytes: frame(named.choice()),
        };
        let moving = (case.body.len() + case.moving_wall.len()) as f64;
        let rows = run.end / output.table_every.unwrap_or(run.time_step).max(run.time_step);
        // By the clock there may be any number of states; otherwise those that are asked for, and that of the end.
        let asked = run.checkpoint.every.map_or(0.0, |every| (run.end / every).floor() + 1.0);
        let states = if run.checkpoint.wall > 0.0 { AT_ONCE } else { asked.min(AT_ONCE) };
        let viscous = case.fluid.as_ref().is_some_and(|f| f.viscosity > 0.0);
        let held = Held {
            water: slots,
            moving: solids,
            pressure: kept,
            slots: kept,
            neighbours: if viscous { neighbours } else { 0.0 },
            solids: parts.len() as f64,
            text: 0.0,
        };
        let largest = parts.into_iter().max_by(|a, b| a.2.total_cmp(&b.2));
        let mostly = largest.filter(|one| one.2 > 0.5 * particles).map(|(name, size, _)| (name, size));
        Self {
            water,
            particles,
            cells: searched,
            columns,
            water_bytes,
            room,
            mostly,
            memory_cpu: base + slots * water_bytes,
            memory_beside_device: base + slots * (WATER_ON_DEVICE + neighbours * NEIGHBOUR_ON_DEVICE),
            frames: frames(output.every),
            frame_bytes: frame(output.choice()),
            series: output.series.iter().map(series).collect(),
            row_bytes: ROW + moving * ROW_OF_SOLID,
            table_bytes: rows * (ROW + moving * ROW_OF_SOLID),
            checkpoint_bytes: held.all(states),
            states,
            held,
        }
    }

    /// Which solid most of the particles are of, in brackets: one that is far too large says so by its size.
    pub fn of_whom(&self) -> String {
        let told = |(name, [x, y, z]): &(String, Vector)| {
            format!(" (most of them of {name}, {x:.4} x {y:.4} x {z:.4} m)")
        };
        self.mostly.as_ref().map(told).unwrap_or_default()
    }

    /// Of a run whose states hold what `built` says of a scene that has been built.
    pub fn holding(self, built: impl FnOnce(Held) -> Held) -> Self {
        let held = built(self.held);
        Self { checkpoint_bytes: held.all(self.states), held, ..self }
    }

    /// Of a run of `case` whose steps are `dt` [s] long: those that its scene allows.
    pub fn at_step(self, case: &Case, dt: f64) -> Self {
        let rows = case.run.end / case.output.table_every.unwrap_or(dt).max(dt);
        let steps = (case.run.end / dt).ceil();
        Self { table_bytes: rows * self.row_bytes, ..self }.at_most(Some(steps as u64))
    }

    /// Of a run that stops after `steps`, if any: no step has two frames or two states.
    pub fn at_most(self, steps: Option<u64>) -> Self {
        let Some(steps) = steps.map(|n| n as f64) else { return self };
        let frames = self.frames.min(steps + 2.0);
        let fewer = |named: &SeriesEstimate| SeriesEstimate {
            frames: named.frames.min(steps + 2.0),
            ..named.clone()
        };
        let series = self.series.iter().map(fewer).collect();
        let table_bytes = self.table_bytes.min(steps * self.row_bytes);
        let states = self.states.min(steps.max(1.0));
        let checkpoint_bytes = self.held.all(states);
        Self { frames, series, table_bytes, states, checkpoint_bytes, ..self }
    }

    /// Memory of the first and of each other one of `ranks`, on CPUs: each has its part of the water and of the walls, with what lies beside, and the
    /// first one the scene. (577,084 particles on 2, 4 and 8 ranks: 1.09, 1.07 and 1.00 times the sum of the peaks that were measured; 1,211,326 on 8: 1.00
    /// times.)
    pub fn memory_of_ranks(&self, ranks: usize) -> [f64; 2] {
        if ranks < 2 {
            return [self.memory_cpu, 0.0];
        }
        let part = |of: f64, beside: f64, columns: f64| (of / ranks as f64 + beside * of / columns).min(of);
        let [wet, all] = self.columns;
        let other = PROGRAM_OF_RANK
            + part(self.cells, 4.0, all) * SEARCH_CELL
            + part(self.water, 2.0, wet) * self.water_bytes
            + part(self.particles - self.water, 4.0, all) * WALL_OF_RANK;
        [other + self.particles * PARTICLE_OF_FIRST, other]
    }

    /// Memory of a machine on which the first and others, `here` of `all` ranks, compute the case.
    pub fn memory_on_ranks(&self, here: usize, all: usize) -> f64 {
        let [first, other] = self.memory_of_ranks(all);
        first + (here as f64 - 1.0) * other
    }

    /// The smallest spacing [m], in two digits, at which `memory` of an estimate of `case` is no more than `room` bytes; nothing if none
    /// is found.
    pub fn spacing_within(case: &Case, room: f64, memory: impl Fn(&Self) -> f64) -> Option<f64> {
        let (mut case, d) = (case.clone(), f64::from(case.run.dimensions));
        for _ in 0..4 {
            let over = memory(&Self::new(&case)) / room;
            if over <= 1.0 {
                return Some(case.run.spacing);
            }
            // Walls grow less than water does.
            let wanted = case.run.spacing * over.powf(1.0 / d);
            let digit = 10f64.powi(wanted.log10().floor() as i32 - 1);
            case.run.spacing = format!("{:.1e}", ((wanted / digit).ceil() * digit)).parse().ok()?;
        }
        None
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
    fn there_are_no_more_states_than_steps_and_moments_for_them() {
        let states = |checkpoint: &str, steps: u64| {
            let estimate =
                Estimate::new(&case(&format!("checkpoint = {{ {checkpoint} }}\n"))).at_most(Some(steps));
            estimate.checkpoint_bytes / estimate.held.bytes()
        };
        let told = [
            ("", 100),
            ("", 1),
            ("wall = 0", 100),
            ("wall = 0, every = 0.9", 100),
            ("wall = 0, every = 1e-3", 100),
        ];
        assert_eq!(told.map(|(checkpoint, steps)| states(checkpoint, steps)), [3.0, 1.0, 0.0, 2.0, 3.0]);
    }

    #[test]
    fn lists_of_a_longer_reach_and_frames_take_more_memory() {
        // 36,000 particles of water and their walls, peaks that were measured.
        let peak = |radius: f64| {
            let mut case = case("");
            let block = &mut case.fluid.as_mut().expect("water").block[0];
            (block.max, case.run.effective_radius) = ([0.8, 0.6, 0.6], radius);
            let tank = case.tank.as_mut().expect("a tank");
            (tank.max, tank.open) = ([0.8, 0.6, 0.8], vec![Face::ZMax]);
            case.output.every = 0.0;
            Estimate::new(&case)
        };
        for (radius, measured) in [(2.1, 84.9e6), (3.1, 184.4e6), (4.1, 328.2e6)] {
            let told = peak(radius).memory_cpu;
            assert!((told / measured - 1.0).abs() < 0.1, "{radius}: {told:e}, measured {measured:e}");
        }
        // 210,000 of water, with and without frames.
        let frames = |every: f64| {
            let mut case = case("");
            case.run.spacing = 0.01;
            case.fluid.as_mut().expect("water").block[0].max = [1.0, 0.7, 0.3];
            case.tank.as_mut().expect("a tank").max = [1.0, 0.7, 0.5];
            case.output.every = every;
            Estimate::new(&case).memory_cpu
        };
        for (every, measured) in [(0.0, 356.7e6), (0.1, 467.1e6)] {
            let told = frames(every);
            assert!((told / measured - 1.0).abs() < 0.1, "{every}: {told:e}, measured {measured:e}");
        }
        let [near, far] = [2.1, 4.1].map(|radius| peak(radius).memory_of_ranks(4)[1]);
        assert!(far > 2.0 * near, "{near:e} {far:e}");
    }

    #[test]
    fn ranks_of_a_machine_share_water_and_walls_and_the_first_one_has_the_scene() {
        let estimate = Estimate::new(&case(""));
        let on = |here, all| estimate.memory_on_ranks(here, all);
        assert_eq!(on(1, 1), estimate.memory_cpu);
        assert!(on(4, 4) > on(2, 2) && on(2, 2) > on(1, 1));
        assert!(on(4, 8) < on(4, 4) && on(4, 8) > 0.5 * on(8, 8));
        // A rank has its part, whatever the case: that of a twelfth has less than a fifth of one alone.
        let mut fine = case("");
        fine.run.spacing = 0.005;
        let fine = Estimate::new(&fine);
        let other = fine.memory_on_ranks(2, 12) - fine.memory_on_ranks(1, 12);
        assert!(other < 0.2 * fine.memory_cpu, "{other:e} of {:e}", fine.memory_cpu);
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
