//! Gauges: pressure at a point of a wall or of a solid that moves, force on a solid, and of the water its level on a line, its velocity at a point and
//! its volume in a box.

mod level;
mod means;
pub mod wall_force;
mod wall_pressure;
mod water;

use crate::body::Wrench;
use crate::case::{Case, is_pattern, stands_for};
use crate::checkpoint::Archive;
use crate::error::{Error, Result};
use crate::kernels::body_force::RowPressure;
use crate::output::table::{Cell, vector_cells, vector_columns};
use crate::scene::Scene;
use crate::simulation::Simulation;
use glam::DVec3;
use means::Means;
use wall_force::FixedWall;
use wall_pressure::{WallLayer, WallPressure};
use water::InWater;

pub use level::level;

/// What a force gauge is on.
#[derive(Clone, Debug)]
enum Target {
    /// A body or moving wall, by its index.
    Solid(usize),
    /// A fixed wall.
    Fixed(Box<FixedWall>),
}

/// A force gauge: all that it is on.
#[derive(Clone, Debug)]
struct Force {
    name: String,
    on: Vec<Target>,
    /// Torque counts about the origin, and not about the middle of the only one.
    of_several: bool,
}

/// The gauges of a case, found in its scene.
#[derive(Clone, Debug, Default)]
pub struct Gauges {
    pressure: Vec<WallPressure>,
    /// What is read of the water's particles.
    water: Vec<InWater>,
    force: Vec<Force>,
    /// Whether there is water, and whether a body may press on what forces are measured of.
    wet: bool,
    contact: bool,
    /// Where rows have means of the steps since the row before.
    means: Option<Means>,
}

/// What the last step says of pressures and forces.
#[derive(Clone, Debug, Default)]
struct Readings {
    /// One a pressure gauge [Pa].
    pressure: Vec<f64>,
    /// One a force gauge [N, N m].
    wrench: Vec<Wrench>,
    /// What other solids press on the same, if a body moves [N, N m].
    contact: Vec<Wrench>,
}

impl Gauges {
    /// Find wall particles and solids of the gauges of `case`.
    ///
    /// # Errors
    /// [`Error::Case`] for a pressure gauge that is not on a wall and for a force gauge on nothing.
    pub fn new(case: &Case, scene: &Scene) -> Result<Self> {
        let reach = 0.5 * case.run.effective_radius * scene.spacing;
        let contact = case.contact.is_some() && scene.solids.iter().any(|s| s.gives_way());
        let (wet, means) = (case.fluid.is_some(), case.gauge.mean.then(Means::default));
        let mut out = Self { means, wet, contact, ..Self::default() };
        let layers = if case.gauge.pressure.is_empty() { vec![] } else { WallLayer::all(scene) };
        for (k, gauge) in case.gauge.pressure.iter().enumerate() {
            let wrong = |what: String| {
                Error::key(
                    format!("gauge.pressure.{k}"),
                    format!("gauge.pressure {}: {what}", gauge.name),
                    "",
                )
            };
            if scene.groups.fluid == 0 {
                return Err(wrong("there is no fluid".into()));
            }
            let found = WallPressure::find(gauge, scene, &layers, reach);
            let missing = || wrong(format!("no wall at {}", DVec3::from(gauge.point)));
            out.pressure.push(found.ok_or_else(missing)?);
        }
        out.water = InWater::all(case);
        for (k, gauge) in case.gauge.force.iter().enumerate() {
            let solids = scene.solids.iter().enumerate().filter(|(_, s)| stands_for(&gauge.on, &s.name));
            let solids = solids.map(|(k, _)| Target::Solid(k));
            let walls = scene.walls.iter().filter(|w| stands_for(&gauge.on, &w.name));
            let walls =
                walls.filter_map(|w| FixedWall::find(scene, &w.name).map(Box::new).map(Target::Fixed));
            let on: Vec<Target> = solids.chain(walls).collect();
            if on.is_empty() {
                let names: Vec<&str> = scene.names().collect();
                let message = format!("gauge.force {}: nothing is called `{}`", gauge.name, gauge.on);
                let remedy = format!("there are: {}", names.join(", "));
                return Err(Error::key(format!("gauge.force.{k}.on"), message, remedy));
            }
            let of_several = is_pattern(&gauge.on);
            out.force.push(Force { name: gauge.name.clone(), on, of_several });
        }
        Ok(out)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.pressure.is_empty() && self.water.is_empty() && self.force.is_empty()
    }

    /// Header of gauges.csv.
    pub fn header(&self) -> Vec<String> {
        let mut header = vec!["time [s]".to_string()];
        header.extend(self.pressure.iter().map(|g| format!("{} [Pa]", g.name)));
        header.extend(self.water.iter().flat_map(InWater::columns));
        for Force { name, .. } in &self.force {
            if self.wet {
                header.extend(vector_columns(&format!("{name}_force"), "N"));
                header.extend(vector_columns(&format!("{name}_torque"), "N m"));
            }
            if self.contact {
                header.extend(vector_columns(&format!("{name}_contact_force"), "N"));
                header.extend(vector_columns(&format!("{name}_contact_torque"), "N m"));
            }
        }
        header
    }

    /// After a step `dt` [s] long, where rows have means: it counts in the next one.
    ///
    /// # Errors
    /// What the backend says when it is read.
    pub fn follow(&mut self, simulation: &mut Simulation, dt: f64) -> Result<()> {
        if self.means.is_some() {
            let readings = self.read(simulation)?;
            self.means.iter_mut().for_each(|means| means.add(&readings, dt));
        }
        Ok(())
    }

    /// After a row: means begin anew.
    pub fn begin(&mut self) {
        self.means.iter_mut().for_each(|means| *means = Means::default());
    }

    /// Save the sums that the next row's means are made of, or take them over; nothing where there are no means.
    ///
    /// # Errors
    /// As [`Archive::array`].
    pub fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        self.means.iter_mut().try_for_each(|means| means.exchange(archive))
    }

    /// A row of gauges.csv: pressures and forces of the last step, or their means over the steps that the gauges [`Self::follow`]ed. Before the
    /// first step there is neither pressure nor force: these cells are empty. A gauge of the water itself reads all particles back, which costs more
    /// than the others.
    ///
    /// # Errors
    /// What the backend says when it is read.
    pub fn row(&self, simulation: &mut Simulation) -> Result<Vec<Cell>> {
        let known = simulation.has_stepped();
        let Readings { pressure, wrench, contact } = match self.means.as_ref().and_then(Means::value) {
            Some(mean) => mean,
            None => self.read(simulation)?,
        };
        let mut row = vec![Cell::time(simulation.time)];
        row.extend(pressure.into_iter().map(|p| Cell::from(if known { p } else { f64::NAN })));
        let fields = if self.water.is_empty() { None } else { Some(simulation.fields()?) };
        let params = &simulation.params;
        for gauge in &self.water {
            row.extend(fields.iter().flat_map(|f| gauge.cells(f, &simulation.groups, params)));
        }
        for k in 0..self.force.len() {
            // Of the water, and of other solids.
            let told = [wrench.get(k), contact.get(k)].into_iter().flatten();
            for vector in told.flat_map(|w| [w.force, w.torque]) {
                row.extend(vector_cells(if known { vector } else { DVec3::NAN }));
            }
        }
        Ok(row)
    }

    /// Pressures at the gauges' points, and forces. The pressure of a wall particle is brought to the point as the force on bodies is
    /// brought to their surface: with the weight of the water between, and what the pressure lacks at
    /// the water's surface. A dry particle has none.
    fn read(&self, simulation: &mut Simulation) -> Result<Readings> {
        let contact = self.contact_of(simulation);
        if !self.wet {
            return Ok(Readings { contact, ..Readings::default() });
        }
        let fixed = self.fixed();
        let of_points = self.pressure.iter().map(|gauge| &gauge.slots);
        let slots: Vec<usize> = of_points.chain(fixed.map(|wall| &wall.slots)).flatten().copied().collect();
        let pressures =
            if slots.is_empty() { Vec::new() } else { simulation.backend.wall_pressures(&slots)? };
        let mut rest = pressures.as_slice();
        let mut next = |count: usize| {
            let (own, after) = rest.split_at(count);
            rest = after;
            own
        };
        let at_points: Vec<&[RowPressure]> =
            self.pressure.iter().map(|gauge| next(gauge.slots.len())).collect();
        let pushes = if slots.is_empty() { Vec::new() } else { simulation.slot_pushes()? };
        let (params, poses) = (&simulation.params, simulation.solids.poses());
        let at_point = |(gauge, told): (&WallPressure, &[RowPressure])| {
            gauge.read(told, poses, (params, &simulation.scene.periodic), &pushes)
        };
        let pressure = self.pressure.iter().zip(at_points).map(at_point).collect();
        let mut on = |target: &Target| match target {
            Target::Solid(solid) => simulation.fluid_force[*solid],
            Target::Fixed(wall) => {
                let areas = wall.areas(&simulation.scene, simulation.solids.poses());
                let told = next(wall.slots.len());
                let mut sum = wall.force(told, &areas, params);
                let at = (&*simulation.scene, simulation.solids.poses());
                sum += wall.slot_force(&pushes, (told, &areas), at, params);
                sum
            }
        };
        let wrench = self.force.iter().map(|gauge| gauge.sum(simulation, &mut on)).collect();
        Ok(Readings { pressure, wrench, contact })
    }

    /// What other solids press on what the force gauges are on, if any may; not known of fixed walls where a device does not tell
    /// them apart.
    fn contact_of(&self, simulation: &Simulation) -> Vec<Wrench> {
        let solids = &simulation.solids;
        let unknown = Wrench { force: DVec3::NAN, torque: DVec3::NAN };
        let mut of = |target: &Target| match target {
            Target::Solid(solid) => solids.contact_wrenches()[*solid],
            Target::Fixed(wall) => {
                solids.wall_contact_wrenches().map_or(unknown, |walls| walls[wall.shape()])
            }
        };
        self.force.iter().filter(|_| self.contact).map(|gauge| gauge.sum(simulation, &mut of)).collect()
    }

    /// The fixed walls that force gauges are on, in the order of the gauges.
    fn fixed(&self) -> impl Iterator<Item = &FixedWall> {
        self.force.iter().flat_map(|gauge| &gauge.on).filter_map(Target::fixed)
    }
}

impl Force {
    /// What `of` tells of all that the gauge is on: their torques, each about a middle of its own, are brought to the origin.
    fn sum(&self, simulation: &Simulation, of: &mut impl FnMut(&Target) -> Wrench) -> Wrench {
        let mut sum = Wrench::default();
        for target in &self.on {
            let one = of(target);
            let about = match target {
                _ if !self.of_several => DVec3::ZERO,
                Target::Solid(solid) => simulation.solids.poses()[*solid].position,
                Target::Fixed(wall) => wall.about(),
            };
            sum += Wrench { torque: one.torque + about.cross(one.force), ..one };
        }
        sum
    }
}

impl Target {
    fn fixed(&self) -> Option<&FixedWall> {
        match self {
            Self::Fixed(wall) => Some(wall),
            Self::Solid(_) => None,
        }
    }
}
