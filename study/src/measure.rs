//! Measures on a running simulation, against analytic solutions where there is one.

use super::draft::Draft;
use super::record::{Profile, Recorder};
use super::row::Measured;
use super::time_mean::{TimeMean, deviation, mean};
use glam::DVec3;
use seixo::case::Case;
use seixo::checkpoint::Archive;
use seixo::error::{Error, Result};
use seixo::fields::{Fields, State};
use seixo::run::Due;
use seixo::scene::{Drive, Kind, Scene};
use seixo::simulation::Simulation;
use serde::Deserialize;

/// A measure of a study file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Pressure of water at rest, P = rho g z below the surface: rms over all inner fluid particles and the window,
    /// over rho g H; slope dP/dz over rho g.
    HydrostaticPressure,
    /// One wall particle, the nearest to the first pressure gauge: mean, standard deviation and rms jump from
    /// sample to sample, over rho g H.
    Sensor,
    /// Kinetic energy of water at rest, and the speed that it stands for over sqrt(g H).
    KineticEnergy,
    /// Depth from the centroid, 2 (z_c - floor) / H, of which the floor is where the water ends below at the start.
    Volume,
    /// Front of the water: the foremost x that is no spray over time, and scaled for comparison with experiments.
    Front,
    /// Kinetic plus potential energy of the water over its start, over time.
    Energy,
    /// Draft of the first body at rest, a box on one of its faces, against Archimedes' law.
    Draft,
    /// Height of the first body's centre over time.
    BodyHeight,
    /// Every gauge of the case over time, see [`super::record`].
    Gauges,
    /// Position, velocity and tilt of every body and moving wall over time.
    Bodies,
    /// Centroid, momentum and kinetic energy of the water over time.
    Fluid,
    /// Standard deviation of the water's places along each axis over time, see [`super::record`].
    Spread,
}

/// What to measure, and when.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Spec {
    /// Measures.
    pub of: Vec<Measure>,
    /// Start of the window of means [s].
    pub from: f64,
    /// Interval between samples [s], of gauges as well. If 0 every step, and gauges as the case says (`gauge.every`).
    pub every: f64,
    /// Profiles of the water, means over the window.
    pub profile: Vec<Profile>,
}

impl Spec {
    /// What it says of gauges in place of `case`, in words.
    pub fn overrules(&self, case: &Case) -> Option<String> {
        let (own, every) = (self.every, case.gauge.every?);
        let other = self.of.contains(&Measure::Gauges) && own > 0.0 && own != every;
        other.then(|| {
            format!(
                "the study reads gauges every {own} s (measure.every), not every {every} s as the case says (gauge.every)"
            )
        })
    }
}

/// Places among the means over the window: of the kinetic energy [J],
const KINETIC: usize = 0;
/// the error of the particle number density [-],
const DENSITY_ERROR: usize = 1;
/// the particles of water,
const PARTICLES: usize = 2;
/// the depth, from the centroid, over that at the start [-],
const DEPTH: usize = 3;
/// the square of the pressure's error [-],
const SQUARE: usize = 4;
/// and the pressure's slope [-].
const SLOPE: usize = 5;

/// Sums and curves of a run.
pub struct Sampler {
    spec: Spec,
    recorder: Recorder,
    due: Due,
    /// Against gravity; z without any.
    up: DVec3,
    /// Where the water ends below at the start, along `up` [m].
    floor: f64,
    /// Where it ends at the start along x [m].
    sides: [f64; 2],
    weight: f64,
    sensor: Option<usize>,
    means: TimeMean,
    sensed: Vec<[f64; 2]>,
    draft: Option<Draft>,
    energy_start: f64,
    rise: f64,
    /// Whether the water has energy from outside: from openings, or from what follows a motion.
    fed: bool,
    iterations_max: u32,
    front: Vec<[f64; 2]>,
    energy: Vec<[f64; 2]>,
    height: Vec<[f64; 2]>,
}

impl Sampler {
    /// For a run of `simulation`.
    ///
    /// # Errors
    /// [`Error::Case`] if the case lacks what a measure needs.
    pub fn new(spec: &Spec, simulation: &Simulation, scene: &Scene) -> Result<Self> {
        let has = |m| spec.of.contains(&m);
        let case = &simulation.case;
        let needs = |what: &str| {
            Error::key("measure", format!("this study measures what the case lacks: {what}"), "")
        };
        let dry = [Measure::BodyHeight, Measure::Bodies, Measure::Gauges, Measure::Fluid, Measure::Spread];
        if scene.water() == 0 && spec.of.iter().any(|m| !dry.contains(m)) {
            return Err(needs("water at the start"));
        }
        if has(Measure::BodyHeight) && scene.solids.is_empty() {
            return Err(needs("a body"));
        }
        let sensor = match case.gauge.pressure.first().filter(|_| has(Measure::Sensor)) {
            None if has(Measure::Sensor) => return Err(needs("a gauge.pressure")),
            None => None,
            Some(gauge) => {
                let mut point = DVec3::from(gauge.point);
                if scene.dimensions == 2 {
                    point.y = 0.0;
                }
                let distance = |s: &usize| scene.position[*s].distance(point);
                scene.still_slots().min_by(|a, b| distance(a).total_cmp(&distance(b)))
            }
        };
        let params = &simulation.params;
        let up = (-params.gravity).try_normalize().unwrap_or(DVec3::Z);
        Ok(Self {
            recorder: Recorder::new(spec, simulation, scene)?,
            due: Due::new((spec.every > 0.0).then_some(spec.every)),
            up,
            floor: ends(scene, up)[0],
            sides: ends(scene, DVec3::X),
            weight: params.density * params.gravity.length(),
            spec: spec.clone(),
            sensor,
            means: TimeMean::default(),
            sensed: Vec::new(),
            draft: if has(Measure::Draft) { Some(Draft::new(simulation, scene)?) } else { None },
            energy_start: 0.0,
            rise: 0.0,
            fed: !scene.openings.is_empty()
                || scene.solids.iter().any(|s| matches!(s.drive, Drive::Prescribed(_)) && !s.is_still()),
            iterations_max: 0,
            front: Vec::new(),
            energy: Vec::new(),
            height: Vec::new(),
        })
    }

    /// Save what was measured so far, or take it over.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] if the state holds none of it.
    pub fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        let Self {
            // From the study and the case.
            spec: _,
            up: _,
            floor: _,
            sides: _,
            weight: _,
            sensor: _,
            fed: _,
            // What was measured.
            recorder,
            due,
            means,
            sensed,
            draft,
            energy_start,
            rise,
            iterations_max,
            front,
            energy,
            height,
        } = self;
        recorder.exchange(archive)?;
        due.exchange("measure", archive)?;
        means.exchange("measure.means", archive)?;
        archive.number("measure.energy_start", energy_start)?;
        archive.number("measure.rise", rise)?;
        archive.small("measure.iterations_max", iterations_max)?;
        archive.array("measure.sensed", sensed, false)?;
        draft.iter_mut().try_for_each(|draft| draft.exchange(archive))?;
        archive.array("measure.front", front, false)?;
        archive.array("measure.energy", energy, false)?;
        archive.array("measure.height", height, false)
    }

    fn has(&self, measure: Measure) -> bool {
        self.spec.of.contains(&measure)
    }

    /// After a step `dt` [s] long with `iterations` of the pressure solver, or at the start with neither; samples if one is due.
    ///
    /// # Errors
    /// What the backend says when it is read.
    pub fn sample(&mut self, simulation: &mut Simulation, iterations: u32, dt: f64) -> Result<()> {
        self.iterations_max = self.iterations_max.max(iterations);
        let first = simulation.steps == 0;
        if !first {
            self.recorder.follow(simulation, dt)?;
        }
        if !first && !self.due.reached(simulation.time) {
            return Ok(());
        }
        let t = simulation.time;
        let in_window = !first && t >= self.spec.from - 1e-9;
        self.recorder.sample(simulation, in_window)?;
        if self.has(Measure::BodyHeight) {
            self.height.push([t, simulation.solids.poses()[0].position.z]);
        }
        if !simulation.plan.wet() {
            return Ok(());
        }
        let monitor = simulation.backend.monitor()?;
        let energy = monitor.kinetic + monitor.potential;
        let depth = simulation.params.depth;
        // From the floor, so that the ratio does not depend on the origin.
        let mass = monitor.particles as f64 * simulation.params.particle_mass();
        let ground = mass * simulation.params.gravity.length() * self.floor;
        if first {
            self.energy_start = energy - ground;
        }
        let ratio = (energy - ground) / self.energy_start;
        self.rise = self.rise.max(ratio - 1.0);
        if self.has(Measure::Energy) {
            self.energy.push([t, ratio]);
        }
        let fields_wanted = self.has(Measure::Front)
            || in_window && (self.has(Measure::HydrostaticPressure) || self.has(Measure::Draft));
        let fields = if fields_wanted { Some(simulation.backend.read()?) } else { None };
        if let Some(fields) = fields.as_ref().filter(|_| self.has(Measure::Front)) {
            self.front.push([t, front(fields, simulation.groups.fluid, simulation.params.spacing)]);
        }
        if !in_window {
            return Ok(());
        }
        let mut now = vec![0.0; 6];
        (now[KINETIC], now[DENSITY_ERROR]) = (monitor.kinetic, monitor.density_error_mean);
        now[PARTICLES] = monitor.particles as f64;
        let centroid = DVec3::from(monitor.centroid).dot(self.up) - self.floor;
        now[DEPTH] = 2.0 * centroid / depth;
        if let Some(fields) = fields.as_ref().filter(|_| self.has(Measure::HydrostaticPressure)) {
            let surface = self.floor + 2.0 * centroid - simulation.params.zero_pressure_depth();
            let (rms, slope) = hydrostatics(fields, simulation.groups.fluid, self.up, surface, self.weight);
            now[SQUARE] = (rms / (self.weight * depth)).powi(2);
            now[SLOPE] = slope;
        }
        self.means.add(t, now);
        if let Some(slot) = self.sensor {
            let p = simulation.backend.wall_pressures(&[slot])?;
            self.sensed.push([t, p.first().map_or(f64::NAN, |p| p.pressure / (self.weight * depth))]);
        }
        if let (Some(draft), Some(fields)) = (&mut self.draft, &fields) {
            draft.sample(simulation, fields);
        }
        Ok(())
    }

    /// The results.
    ///
    /// # Errors
    /// What the backend says when it is read.
    pub fn finish(mut self, simulation: &mut Simulation) -> Result<Measured> {
        let mut out = Measured::default();
        let mean_of = |what: usize| self.means.mean(what);
        let (depth, gravity) = (simulation.params.depth, simulation.params.gravity.length());
        if simulation.plan.wet() {
            let counters = simulation.backend.counters()?;
            out.put("lost particles [-]", counters.lost as f64);
            out.put("most neighbours [-]", f64::from(counters.neighbours_max));
            out.put("most iterations [-]", f64::from(self.iterations_max));
            // Water at rest without weight has no energy to compare with, and what is put in is no error.
            if self.energy_start != 0.0 && !self.fed {
                out.put("energy rise [-]", self.rise);
            }
            out.put("density error [-]", mean_of(DENSITY_ERROR).abs());
            out.limit("lost particles [-]", 0.0);
        }
        if self.has(Measure::HydrostaticPressure) {
            out.put("pressure error [-]", mean_of(SQUARE).sqrt());
            out.put("slope error [-]", (mean_of(SLOPE) - 1.0).abs());
            out.put("slope [-]", mean_of(SLOPE));
        }
        if self.has(Measure::Sensor) {
            let n = self.sensed.len() as f64;
            let jumps = self.sensed.windows(2).map(|p| (p[1][1] - p[0][1]).powi(2)).sum::<f64>() / (n - 1.0);
            out.put("sensor mean [-]", mean(&self.sensed));
            out.put("sensor noise [-]", deviation(&self.sensed));
            out.put("sensor jump [-]", jumps.sqrt());
        }
        if self.has(Measure::KineticEnergy) {
            // Of the water that there was, without slots for what an inflow brings.
            let mass = mean_of(PARTICLES) * simulation.params.particle_mass();
            let speed = (2.0 * mean_of(KINETIC) / mass).sqrt();
            out.put("kinetic energy [J]", mean_of(KINETIC));
            out.put("spurious speed [-]", speed / (gravity * depth).sqrt());
        }
        if self.has(Measure::Volume) {
            out.put("volume [-]", mean_of(DEPTH));
            out.put("volume error [-]", (mean_of(DEPTH) - 1.0).abs());
        }
        if let Some(draft) = &self.draft {
            draft.finish(simulation.params.spacing, &mut out);
        }
        if self.has(Measure::Front) {
            // T = t sqrt(2 g / L), Z = x / L as in the experiments.
            let [left, right] = self.sides;
            let width = right - left;
            let scale = (2.0 * gravity / width).sqrt();
            // The front is a particle's centre; its surface lies half a spacing further on.
            let half = 0.5 * simulation.params.spacing / width;
            let scaled = self.front.iter().map(|[t, x]| [t * scale, (x - left) / width + half]);
            out.curves.insert("front scaled".into(), scaled.collect());
            out.curves.insert("front".into(), std::mem::take(&mut self.front));
        }
        if self.has(Measure::Energy) {
            out.put("energy left [-]", self.energy.last().map_or(f64::NAN, |e| e[1]));
            out.curves.insert("energy".into(), std::mem::take(&mut self.energy));
        }
        if self.has(Measure::BodyHeight) {
            out.curves.insert("height".into(), std::mem::take(&mut self.height));
        }
        self.recorder.end(simulation)?;
        self.recorder.finish(&mut out);
        if simulation.params.dimensions == 2 {
            out.of_slice(simulation.params.spacing);
        }
        Ok(out)
    }
}

/// Where the water ends at t = 0 along the unit vector `way` [m], lowest and highest, in the cells of its lattice: a jittered start has
/// those of the one that stands on it. Zeros without water.
fn ends(scene: &Scene, way: DVec3) -> [f64; 2] {
    let half = 0.5 * scene.spacing * way.abs().element_sum();
    let cells = scene.position[..scene.water()]
        .iter()
        .map(|x| scene.node + scene.spacing * ((*x - scene.node) / scene.spacing).round());
    let ends = cells.map(|cell| cell.dot(way)).map(|s| [s - half, s + half]);
    ends.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or_default()
}

/// x of the foremost water particle that has company: two others within two and a half spacings `l0` [m]. Spray ahead of it does not count, and a
/// tongue one particle thick does, which a percentile of all particles cuts off, the more the finer the water.
pub fn front(fields: &Fields, fluid: usize, l0: f64) -> f64 {
    let live = (0..fluid).filter(|&i| fields.kind[i] == Kind::Fluid);
    let mut at: Vec<DVec3> = live.map(|i| fields.position[i]).collect();
    at.sort_by(|a, b| b.x.total_cmp(&a.x));
    let reach = 2.5 * l0;
    let has_company = |&(k, x): &(usize, &DVec3)| {
        let ahead = at[..k].iter().rev().take_while(|other| other.x - x.x < reach);
        let behind = at[k + 1..].iter().take_while(|other| x.x - other.x < reach);
        ahead.chain(behind).filter(|other| other.distance(*x) < reach).nth(1).is_some()
    };
    at.iter().enumerate().find(has_company).map_or(f64::NAN, |(_, x)| x.x)
}

/// Rms of P - rho g (surface - z) [Pa] and slope -dP/dz over rho g [-], over inner fluid particles, with z along `up`.
pub fn hydrostatics(fields: &Fields, fluid: usize, up: DVec3, surface: f64, weight: f64) -> (f64, f64) {
    let [mut e, mut n, mut z, mut p, mut zz, mut zp] = [0.0; 6];
    for i in (0..fluid).filter(|&i| fields.state[i] == State::Inner) {
        let (zi, pi) = (fields.position[i].dot(up), fields.pressure[i]);
        e += (pi - weight * (surface - zi).max(0.0)).powi(2);
        n += 1.0;
        z += zi;
        p += pi;
        zz += zi * zi;
        zp += zi * pi;
    }
    ((e / n).sqrt(), -(zp / n - z / n * p / n) / (zz / n - (z / n).powi(2)) / weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jittered_start_ends_where_its_lattice_does() {
        let text = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ndimensions = 2\ngravity = [0, 0, 0]\n[fluid]\njitter = 0.3\n\
                    [[fluid.block]]\nmin = [0.2, 0, 0.4]\nmax = [0.3, 1, 0.5]\n\
                    [[fluid.block]]\nmin = [0.1, 0, -0.2]\nmax = [0.3, 1, 0.1]\n";
        let scene = Scene::build(&text.parse().unwrap()).unwrap();
        for (way, expected) in [(DVec3::Z, [-0.2, 0.5]), (DVec3::X, [0.1, 0.3]), (-DVec3::X, [-0.3, -0.1])] {
            let found = ends(&scene, way);
            assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-9), "{way}: {found:?}");
        }
    }

    #[test]
    fn a_front_is_a_tongue_and_no_spray() {
        let mut fields = Fields::default();
        let mut put = |x: f64, z: f64, kind| {
            fields.position.push(DVec3::new(x, 0.0, z));
            fields.kind.push(kind);
        };
        (0..1000).for_each(|k| put(0.1 * f64::from(k % 20), 0.1 * f64::from(k / 20), Kind::Fluid));
        // A tongue one particle thick, a drop of two ahead of it, and what has left the tank.
        (20..30).for_each(|k| put(0.11 * f64::from(k), 0.0, Kind::Fluid));
        [3.9, 4.0].into_iter().for_each(|x| put(x, 0.0, Kind::Fluid));
        (0..5).for_each(|k| put(5.0 + 0.1 * f64::from(k), 0.0, Kind::Ghost));
        assert!((front(&fields, fields.kind.len(), 0.1) - 3.19).abs() < 1e-12);
        assert!(front(&Fields::default(), 0, 0.1).is_nan());
    }
}
