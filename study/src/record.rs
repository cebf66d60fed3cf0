//! Curves of a run, by the names that its tables give them: gauges, bodies, the water as a whole, profiles.
//!
//! | `measure.of` | curves |
//! |---|---|
//! | `gauges` | the columns of gauges.csv: `NAME [Pa]`, `NAME [m]`, `NAME_force_x [N]`, `NAME_torque_y [N m]` |
//! | `bodies` | `NAME x [m]`, `NAME vx [m/s]`, `NAME tilt [deg]` of every body and moving wall |
//! | `fluid` | `fluid x [m]` of the centroid, `fluid kinetic [J]`, `fluid momentum x [kg m/s]` |
//! | `spread` | `fluid spread x [m]`: standard deviation of the water's places; half a semi-axis of an ellipse |
//! | `measure.profile` | the profile's name: mean over the window against a coordinate |
//!
//! Gauges have the rows of gauges.csv, unless `measure.every` says when samples are taken.
//!
//! In two dimensions forces, torques, energies, momenta and volumes are those of each metre across, and are called so:
//! `NAME_force_x [N/m]`.

use super::measure::{Measure, Spec};
use super::row::Measured;
use super::time_mean::TimeMean;
use glam::DVec3;
use seixo::case::Case;
use seixo::checkpoint::Archive;
use seixo::error::{Error, Result};
use seixo::fields::Fields;
use seixo::gauges::Gauges;
use seixo::output::slice::per_metre;
use seixo::output::table::Cell;
use seixo::run::Due;
use seixo::scene::{Kind, Scene};
use seixo::simulation::Simulation;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};

/// A coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Coordinate {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
}

/// What a profile shows of the water.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Velocity along x [m/s].
    Vx,
    /// Velocity along y [m/s].
    Vy,
    /// Velocity along z [m/s].
    Vz,
    /// Pressure [Pa].
    Pressure,
}

impl Quantity {
    fn of(self, fields: &Fields, i: usize) -> f64 {
        match self {
            Self::Vx => fields.velocity[i].x,
            Self::Vy => fields.velocity[i].y,
            Self::Vz => fields.velocity[i].z,
            Self::Pressure => fields.pressure[i],
        }
    }
}

/// A profile: what the water particles of a region have on average, against a coordinate.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// Name of the curve.
    pub name: String,
    /// What it shows.
    pub of: Quantity,
    /// Against what.
    pub along: Coordinate,
    /// Lower and upper corner of the region [m]; in two dimensions y does not count.
    pub within: [[f64; 3]; 2],
    /// Number of bins along the coordinate.
    pub bins: usize,
}

/// Sums of a profile: of coordinate, quantity and particles, three numbers a bin, as a mean over time.
#[derive(Debug)]
struct Sums {
    profile: Profile,
    /// In two dimensions, where y is that of the particles.
    flat: bool,
    bins: TimeMean,
}

impl Sums {
    fn add(&mut self, fields: &Fields, fluid: usize, t: f64) {
        let p = &self.profile;
        let mut sums = vec![0.0; 3 * p.bins];
        let axis = p.along as usize;
        let (low, high) = (DVec3::from(p.within[0]), DVec3::from(p.within[1]));
        for i in (0..fluid).filter(|&i| fields.kind[i] == Kind::Fluid) {
            let x = fields.position[i];
            let within = x.cmpge(low) & x.cmplt(high);
            if within.x && within.z && (self.flat || within.y) {
                let part = (x[axis] - low[axis]) / (high[axis] - low[axis]);
                let bin = 3 * ((part * p.bins as f64) as usize).min(p.bins - 1);
                sums[bin] += x[axis];
                sums[bin + 1] += p.of.of(fields, i);
                sums[bin + 2] += 1.0;
            }
        }
        self.bins.add(t, sums);
    }

    fn curve(&self) -> Vec<[f64; 2]> {
        let bins = (0..self.profile.bins).map(|k| [0, 1, 2].map(|part| self.bins.mean(3 * k + part)));
        bins.filter(|b| b[2] > 0.0).map(|b| [b[0] / b[2], b[1] / b[2]]).collect()
    }
}

/// Curves of the water as a whole,
const WATER: [&str; 7] = [
    "fluid x [m]",
    "fluid y [m]",
    "fluid z [m]",
    "fluid momentum x [kg m/s]",
    "fluid momentum y [kg m/s]",
    "fluid momentum z [kg m/s]",
    "fluid kinetic [J]",
];
/// of its spread,
const SPREAD: [&str; 3] = ["fluid spread x [m]", "fluid spread y [m]", "fluid spread z [m]"];

/// and of the solid `name`.
fn of_solid(name: &str) -> [String; 7] {
    ["x [m]", "y [m]", "z [m]", "vx [m/s]", "vy [m/s]", "vz [m/s]", "tilt [deg]"]
        .map(|what| format!("{name} {what}"))
}

/// The curves that `spec` takes of `scene`, with water if it is `wet`: their names as the tables have them, and whose they are.
fn named(spec: &Spec, gauges: Option<&Gauges>, scene: &Scene, wet: bool) -> Vec<(String, String)> {
    let has = |m| spec.of.contains(&m);
    let mut all: Vec<(String, String)> = Vec::new();
    let mut put = |whose: &str, names: &mut dyn Iterator<Item = String>| {
        all.extend(names.map(|name| (name, whose.to_owned())));
    };
    let owned = |names: &'static [&str]| names.iter().map(|name| (*name).to_owned());
    put("a gauge", &mut gauges.iter().flat_map(|gauges| gauges.header().into_iter().skip(1)));
    for solid in scene.solids.iter().take(scene.followed()).filter(|_| has(Measure::Bodies)) {
        put(&format!("the solid `{}`", solid.name), &mut of_solid(&solid.name).into_iter());
    }
    put("the water", &mut owned(&WATER).filter(|_| has(Measure::Fluid) && wet));
    put("the water", &mut owned(&SPREAD).filter(|_| has(Measure::Spread) && wet));
    put("a profile", &mut spec.profile.iter().map(|profile| profile.name.clone()));
    for (measure, whose, names) in [
        (Measure::Front, "the front", &["front", "front scaled"][..]),
        (Measure::Energy, "the energy", &["energy"]),
        (Measure::BodyHeight, "the first body", &["height"]),
    ] {
        put(whose, &mut owned(names).filter(|_| has(measure)));
    }
    all
}

/// Names of the curves that a point with `case` measures by `spec`.
///
/// # Errors
/// What is wrong with the scene or its gauges.
pub fn curves(spec: &Spec, case: &Case) -> Result<BTreeSet<String>> {
    let scene = Scene::build(case)?;
    let gauges = if spec.of.contains(&Measure::Gauges) { Some(Gauges::new(case, &scene)?) } else { None };
    let names = named(spec, gauges.as_ref(), &scene, case.fluid.is_some()).into_iter().map(|(name, _)| name);
    let called = |name: String| {
        let slice = scene.dimensions == 2 && spec.profile.iter().all(|profile| profile.name != name);
        per_metre(&name).filter(|_| slice).unwrap_or(name)
    };
    Ok(names.map(called).collect())
}

/// Keeps the curves of a run.
#[derive(Debug)]
pub struct Recorder {
    gauges: Option<Gauges>,
    /// When gauges are read that the case says: they have rows as `seixo run` writes them. With all the rest if absent.
    rows: Option<Due>,
    /// When gauges were read [s].
    gauged: Vec<f64>,
    bodies: bool,
    fluid: bool,
    spread: bool,
    profiles: Vec<Sums>,
    curves: BTreeMap<String, Vec<[f64; 2]>>,
    /// When those of all but gauges were sampled [s].
    times: Vec<f64>,
}

impl Recorder {
    /// For a run of `simulation`.
    ///
    /// # Errors
    /// A gauge that hangs in the air, a profile without bins, two curves of one name.
    pub fn new(spec: &Spec, simulation: &Simulation, scene: &Scene) -> Result<Self> {
        let has = |m| spec.of.contains(&m);
        if let Some(p) = spec.profile.iter().find(|p| p.bins == 0) {
            return Err(Error::key(
                "measure.profile.bins",
                format!("measure.profile `{}`: give 1 bin or more", p.name),
                "",
            ));
        }
        let flat = simulation.case.run.dimensions == 2;
        if let Some(p) = spec.profile.iter().find(|p| flat && p.along == Coordinate::Y) {
            let text =
                format!("measure.profile `{}`: a case in two dimensions has no profile along y", p.name);
            return Err(Error::key("measure.profile.along", text, "take x or z"));
        }
        let sums = |p: &Profile| Sums { profile: p.clone(), flat, bins: TimeMean::default() };
        let recorder = Self {
            gauges: if has(Measure::Gauges) { Some(Gauges::new(&simulation.case, scene)?) } else { None },
            rows: if spec.every > 0.0 { None } else { Some(Due::new(simulation.case.gauge.every)) },
            gauged: Vec::new(),
            bodies: has(Measure::Bodies),
            fluid: has(Measure::Fluid) && simulation.plan.wet(),
            spread: has(Measure::Spread) && simulation.plan.wet(),
            profiles: spec.profile.iter().map(sums).collect(),
            curves: BTreeMap::new(),
            times: Vec::new(),
        };
        recorder.tells_apart(spec, simulation)?;
        Ok(recorder)
    }

    /// Refuses two curves of one name, of which a study would take one for the other.
    fn tells_apart(&self, spec: &Spec, simulation: &Simulation) -> Result<()> {
        let mut all = named(spec, self.gauges.as_ref(), &simulation.scene, simulation.plan.wet());
        all.sort();
        let Some(twice) = all.windows(2).find(|pair| pair[0].0 == pair[1].0) else { return Ok(()) };
        let [(name, one), (_, other)] = [&twice[0], &twice[1]];
        let text = format!("measure: two curves would be called `{name}`: that of {one} and that of {other}");
        Err(Error::key("measure", text, "rename the solid, gauge or profile, or measure one of them alone"))
    }

    /// Save the curves and sums, or take them over.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] if the state holds none of them.
    pub fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        // What is recorded follows from study and case.
        let Self { gauges, rows, gauged, bodies: _, fluid: _, spread: _, profiles, curves, times } = self;
        gauges.iter_mut().try_for_each(|gauges| gauges.exchange(archive))?;
        rows.iter_mut().try_for_each(|rows| rows.exchange("curves.gauges", archive))?;
        archive.array("curves.gauged", gauged, false)?;
        for Sums { profile, flat: _, bins } in profiles {
            bins.exchange(&format!("profile.{}", profile.name), archive)?;
        }
        archive.array("curves.times", times, false)?;
        let names: Vec<&str> = curves.keys().map(String::as_str).collect();
        let mut names = names.join("\n").into_bytes();
        archive.array("curves", &mut names, false)?;
        for name in String::from_utf8_lossy(&names).lines() {
            archive.array(&format!("curve.{name}"), curves.entry(name.to_owned()).or_default(), false)?;
        }
        Ok(())
    }

    /// After a step `dt` [s] long, for gauges that tell means.
    ///
    /// # Errors
    /// What the backend says when it is read.
    pub fn follow(&mut self, simulation: &mut Simulation, dt: f64) -> Result<()> {
        self.gauges.iter_mut().try_for_each(|gauges| gauges.follow(simulation, dt))
    }

    /// The state now; `in_window` adds to the profiles as well.
    ///
    /// # Errors
    /// What the backend says when it is read.
    pub fn sample(&mut self, simulation: &mut Simulation, in_window: bool) -> Result<()> {
        let t = simulation.time;
        self.times.push(t);
        let due = self.rows.as_mut().is_none_or(|rows| rows.reached(t));
        if due || self.gauged.is_empty() {
            self.read_gauges(simulation)?;
        }
        let mut put = |name, value| put(&mut self.curves, name, [t, value]);
        if self.bodies {
            let followed = simulation.scene.followed();
            for (k, pose) in simulation.solids.poses().iter().take(followed).enumerate() {
                let (x, v) = (simulation.solids.path(k), pose.velocity);
                let up = simulation.scene.solids[k].turn(pose.orientation) * DVec3::Z;
                let tilt = up.z.clamp(-1.0, 1.0).acos().to_degrees();
                let values = [x[0], x[1], x[2], v.x, v.y, v.z, tilt];
                of_solid(simulation.solids.name(k))
                    .into_iter()
                    .zip(values)
                    .for_each(|(name, value)| put(name, value));
            }
        }
        if self.fluid {
            let monitor = simulation.backend.monitor()?;
            let ([x, y, z], [px, py, pz]) = (monitor.centroid, monitor.momentum);
            let values = [x, y, z, px, py, pz, monitor.kinetic];
            WATER.into_iter().zip(values).for_each(|(name, value)| put(name.into(), value));
        }
        let profiled = in_window && !self.profiles.is_empty();
        if !(self.spread || profiled) {
            return Ok(());
        }
        let fields = simulation.backend.read()?;
        if self.spread {
            let values = spread(&fields, simulation.groups.fluid).to_array();
            SPREAD.into_iter().zip(values).for_each(|(name, value)| put(name.into(), value));
        }
        if profiled {
            self.profiles.iter_mut().for_each(|p| p.add(&fields, simulation.groups.fluid, t));
        }
        Ok(())
    }

    /// A row of the gauges now.
    fn read_gauges(&mut self, simulation: &mut Simulation) -> Result<()> {
        let Some(gauges) = &mut self.gauges else { return Ok(()) };
        let t = simulation.time;
        self.gauged.push(t);
        for (name, cell) in gauges.header().into_iter().zip(gauges.row(simulation)?).skip(1) {
            if let Cell::Number(value) = cell {
                put(&mut self.curves, name, [t, value]);
            }
        }
        gauges.begin();
        Ok(())
    }

    /// At the end of the run: gauges that have rows as the case says have one there.
    ///
    /// # Errors
    /// What the backend says when it is read.
    pub fn end(&mut self, simulation: &mut Simulation) -> Result<()> {
        let late = self.rows.is_some() && self.gauged.last() != Some(&simulation.time);
        if late { self.read_gauges(simulation) } else { Ok(()) }
    }

    /// The curves of the whole run.
    pub fn finish(self, out: &mut Measured) {
        let of_gauges: BTreeSet<String> = self.gauges.iter().flat_map(Gauges::header).collect();
        for (name, curve) in &self.curves {
            let times = if of_gauges.contains(name) { &self.gauged } else { &self.times };
            // Points that follow each other among the times have nothing left out between them. Before the first step there is no pressure.
            let place = |t: f64| times.partition_point(|at| *at < t);
            let late = curve.first().is_some_and(|p| place(p[0]) > 1);
            if late || curve.windows(2).any(|w| place(w[1][0]) - place(w[0][0]) > 1) {
                out.sampled.insert(name.clone(), times.clone());
            }
        }
        out.curves.extend(self.curves);
        for sums in &self.profiles {
            let (name, curve) = (&sums.profile.name, sums.curve());
            if curve.is_empty() {
                out.degrade(&format!(
                    "profile `{name}` is empty: no water was in its region (measure.profile.within)"
                ));
            }
            out.curves.insert(name.clone(), curve);
            out.profiles.insert(name.clone());
        }
    }
}

/// Adds a point to the curve `name`. A gauge that sees no water, or no pressure before the first step, leaves a gap.
fn put(curves: &mut BTreeMap<String, Vec<[f64; 2]>>, name: String, point: [f64; 2]) {
    if point[1].is_finite() {
        curves.entry(name).or_default().push(point);
    }
}

/// Standard deviation of the water's places about their mean, along each axis [m].
fn spread(fields: &Fields, fluid: usize) -> DVec3 {
    let places = || (0..fluid).filter(|&i| fields.kind[i] == Kind::Fluid).map(|i| fields.position[i]);
    let n = places().count() as f64;
    let mean = places().sum::<DVec3>() / n;
    (places().map(|x| (x - mean) * (x - mean)).sum::<DVec3>() / n).map(f64::sqrt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::Class;

    #[test]
    fn a_profile_is_the_mean_of_its_bins() {
        let profile = Profile {
            name: "u".into(),
            of: Quantity::Vx,
            along: Coordinate::Z,
            within: [[0.0, -1.0, 0.0], [1.0, 1.0, 1.0]],
            bins: 2,
        };
        let mut fields = Fields::default();
        for (z, u, kind) in [
            (0.1, 1.0, Kind::Fluid),
            (0.3, 2.0, Kind::Fluid),
            (0.9, 7.0, Kind::Fluid),
            (0.95, 99.0, Kind::Ghost),
            (1.5, 99.0, Kind::Fluid),
        ] {
            fields.position.push(DVec3::new(0.5, 0.0, z));
            fields.velocity.push(DVec3::new(u, 0.0, 0.0));
            fields.kind.push(kind);
        }
        // In two dimensions y does not count.
        let beside = Profile { within: [[0.0, 2.0, 0.0], [1.0, 3.0, 1.0]], ..profile.clone() };
        let mut flat = Sums { bins: TimeMean::default(), flat: true, profile: beside };
        let mut sums = Sums { bins: TimeMean::default(), flat: false, profile };
        flat.add(&fields, 5, 0.0);
        sums.add(&fields, 5, 0.0);
        let curve = sums.curve();
        assert_eq!(flat.curve(), curve);
        // In space no water is there, and that is told.
        let mut recorder = Recorder {
            gauges: None,
            rows: None,
            gauged: Vec::new(),
            bodies: false,
            fluid: false,
            spread: false,
            profiles: vec![Sums { bins: TimeMean::default(), flat: false, ..flat }],
            curves: BTreeMap::new(),
            times: Vec::new(),
        };
        recorder.profiles[0].add(&fields, 5, 0.0);
        let mut measured = Measured::default();
        recorder.finish(&mut measured);
        assert!(measured.class == Class::Degraded && measured.reason.contains("profile `u` is empty"));
        assert!(
            (curve[0][0] - 0.2).abs() < 1e-12 && curve[0][1] == 1.5 && curve[1] == [0.9, 7.0],
            "{curve:?}"
        );
    }
}
