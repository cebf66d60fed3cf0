//! Gauges: pressure at a point of a wall, level of the water on a line, force on a solid.

mod means;
pub mod wall_force;

use crate::body::Wrench;
use crate::case::Case;
use crate::checkpoint::Archive;
use crate::error::{Error, Result};
use crate::fields::Fields;
use crate::output::table::{Cell, vector_cells, vector_columns};
use crate::params::Params;
use crate::periodic::Periodic;
use crate::scene::{Groups, Kind, Scene, wall_at};
use crate::simulation::Simulation;
use glam::DVec3;
use means::Means;
use wall_force::FixedWall;

/// A pressure gauge: wall particles, and the way from each to the gauge's point [m].
#[derive(Clone, Debug)]
struct WallPressure {
    name: String,
    slots: Vec<usize>,
    to_point: Vec<DVec3>,
}

/// What a force gauge is on.
#[derive(Clone, Debug)]
enum Target {
    /// A body or moving wall, by its index.
    Solid(usize),
    /// A fixed wall.
    Fixed(Box<FixedWall>),
}

/// The gauges of a case, found in its scene.
#[derive(Clone, Debug, Default)]
pub struct Gauges {
    pressure: Vec<WallPressure>,
    level: Vec<(String, [f64; 2])>,
    force: Vec<(String, Target)>,
    /// Where rows have means of the steps since the row before.
    means: Option<Means>,
}

/// What the last step says of pressures and forces.
#[derive(Clone, Debug, Default)]
struct Readings {
    /// One a pressure gauge [Pa].
    pressure: Vec<f64>,
    /// One a force gauge, on a fixed wall without what the water does along it [N, N m].
    wrench: Vec<Wrench>,
}

impl Gauges {
    /// Find wall particles and solids of the gauges of `case`.
    ///
    /// A pressure gauge is the mean over the particles of fixed walls within half an effective radius of its point,
    /// or of the wall particle nearest to it where the lattice has moved the wall away.
    ///
    /// # Errors
    /// [`Error::Case`] for a pressure gauge that is not on a wall and for a force gauge on nothing.
    pub fn new(case: &Case, scene: &Scene) -> Result<Self> {
        let reach = 0.5 * case.run.effective_radius * scene.spacing;
        let mut out = Self { means: case.gauge.mean.then(Means::default), ..Self::default() };
        // Walls that never move, those of solids of any shape among them.
        let still = scene.solids.iter().filter(|s| s.is_still()).flat_map(|s| s.wall_slots.clone());
        let slots: Vec<usize> = scene.groups.static_wall_range().chain(still).collect();
        let wall: Vec<DVec3> = slots.iter().map(|&slot| scene.position[slot]).collect();
        for (k, gauge) in case.gauge.pressure.iter().enumerate() {
            if scene.groups.fluid == 0 {
                let message = format!("gauge.pressure {}: there is no fluid", gauge.name);
                return Err(Error::key(format!("gauge.pressure.{k}"), message, ""));
            }
            let mut point = DVec3::from(gauge.point);
            if scene.dimensions == 2 {
                point.y = 0.0;
            }
            let found = wall_at(&wall, point, reach, scene.spacing).map_err(|nearest| {
                let hint = nearest.map_or("there are no fixed walls".to_string(), |at| {
                    format!("the nearest wall particle is {:.4} m away at {at:.4}", at.distance(point))
                });
                let message = format!("gauge.pressure {}: no fixed wall at {point}; {hint}", gauge.name);
                Error::key(format!("gauge.pressure.{k}.point"), message, "")
            })?;
            out.pressure.push(WallPressure {
                name: gauge.name.clone(),
                slots: found.iter().map(|&k| slots[k]).collect(),
                to_point: found.iter().map(|&k| point - wall[k]).collect(),
            });
        }
        out.level.extend(case.gauge.level.iter().map(|g| (g.name.clone(), g.at)));
        for (k, gauge) in case.gauge.force.iter().enumerate() {
            let solid = scene.solids.iter().position(|s| s.name == gauge.on).map(Target::Solid);
            let target = solid.or_else(|| FixedWall::find(scene, &gauge.on).map(Box::new).map(Target::Fixed));
            let Some(target) = target else {
                let solids = scene.solids.iter().map(|s| s.name.as_str());
                let names: Vec<&str> = solids.chain(scene.walls.iter().map(|w| w.name.as_str())).collect();
                let message = format!("gauge.force {}: nothing is called `{}`", gauge.name, gauge.on);
                let remedy = format!("there are: {}", names.join(", "));
                return Err(Error::key(format!("gauge.force.{k}.on"), message, remedy));
            };
            out.force.push((gauge.name.clone(), target));
        }
        Ok(out)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.pressure.is_empty() && self.level.is_empty() && self.force.is_empty()
    }

    /// Header of gauges.csv.
    pub fn header(&self) -> Vec<String> {
        let mut header = vec!["time [s]".to_string()];
        header.extend(self.pressure.iter().map(|g| format!("{} [Pa]", g.name)));
        header.extend(self.level.iter().map(|(name, _)| format!("{name} [m]")));
        for (name, target) in &self.force {
            header.extend(vector_columns(&format!("{name}_force"), "N"));
            header.extend(vector_columns(&format!("{name}_torque"), "N m"));
            if matches!(target, Target::Fixed(_)) {
                header.extend(vector_columns(&format!("{name}_viscous"), "N"));
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
    /// first step there is neither pressure nor force: these cells are empty. A level gauge and, in a viscous fluid, a force gauge on a
    /// fixed wall read all particles back, which costs more than the others; what the water does along a fixed wall is that of the moment.
    ///
    /// # Errors
    /// What the backend says when it is read.
    pub fn row(&self, simulation: &mut Simulation) -> Result<Vec<Cell>> {
        let known = simulation.steps > 0;
        let Readings { pressure, wrench } = match self.means.as_ref().and_then(Means::value) {
            Some(mean) => mean,
            None => self.read(simulation)?,
        };
        let mut row = vec![Cell::from(simulation.time)];
        row.extend(pressure.into_iter().map(|p| Cell::from(if known { p } else { f64::NAN })));
        let Params { viscosity, wall_friction, .. } = simulation.params;
        let viscous = viscosity + wall_friction > 0.0 && self.force.iter().any(|(_, t)| t.is_fixed());
        let fields = if viscous || !self.level.is_empty() { Some(simulation.fields()?) } else { None };
        let params = &simulation.params;
        for &(_, line) in &self.level {
            let level = fields.as_ref().and_then(|f| {
                let (reach, l0) = (params.effective_radius, params.spacing);
                level(f, &simulation.groups, line, params.dimensions, reach, l0, &params.periodic)
            });
            row.push(Cell::from(level.unwrap_or(f64::NAN)));
        }
        for ((_, target), mut wrench) in self.force.iter().zip(wrench) {
            let viscous = match target {
                Target::Solid(_) => None,
                Target::Fixed(wall) => {
                    let along = |f| wall.viscous_force(f, &simulation.groups, params);
                    Some(fields.as_ref().filter(|_| viscous).map_or(DVec3::ZERO, along))
                }
            };
            wrench.force += viscous.unwrap_or_default();
            for vector in [Some(wrench.force), Some(wrench.torque), viscous].into_iter().flatten() {
                row.extend(vector_cells(if known { vector } else { DVec3::NAN }));
            }
        }
        Ok(row)
    }

    /// Pressures at the gauges' points, and forces. The pressure of a wall particle is brought to the point as the force on bodies is
    /// brought to their surface: with the weight of the water between, and what the pressure lacks at
    /// the water's surface. A dry particle has none.
    fn read(&self, simulation: &mut Simulation) -> Result<Readings> {
        let fixed = self.force.iter().filter_map(|(_, target)| target.fixed());
        let of_points = self.pressure.iter().map(|gauge| &gauge.slots);
        let slots: Vec<usize> = of_points.chain(fixed.map(|wall| &wall.slots)).flatten().copied().collect();
        let pressures =
            if slots.is_empty() { Vec::new() } else { simulation.backend.wall_pressures(&slots)? };
        let any_fixed = self.force.iter().any(|(_, target)| target.is_fixed());
        let pushes = if any_fixed { simulation.slot_pushes()? } else { Vec::new() };
        let params = &simulation.params;
        let mut rest = pressures.as_slice();
        let mut next = |count: usize| {
            let (own, after) = rest.split_at(count);
            rest = after;
            own
        };
        let at_point = |gauge: &WallPressure| {
            let own = next(gauge.slots.len());
            let sum: f64 = own.iter().zip(&gauge.to_point).map(|(p, &way)| p.on_surface(way, params)).sum();
            sum / own.len() as f64
        };
        let pressure = self.pressure.iter().map(at_point).collect();
        let on = |(_, target): &(String, Target)| match target {
            Target::Solid(solid) => simulation.fluid_force[*solid],
            Target::Fixed(wall) => {
                let areas = wall.areas(&simulation.scene, simulation.solids.poses());
                let mut sum = wall.pressure_force(next(wall.slots.len()), &areas, params);
                sum += wall.slot_force(&pushes, &simulation.scene);
                sum
            }
        };
        Ok(Readings { pressure, wrench: self.force.iter().map(on).collect() })
    }
}

impl Target {
    fn fixed(&self) -> Option<&FixedWall> {
        match self {
            Self::Fixed(wall) => Some(wall),
            Self::Solid(_) => None,
        }
    }

    fn is_fixed(&self) -> bool {
        self.fixed().is_some()
    }
}

/// Height [m] of the highest point of the vertical line through `line` that is in water; `None` if the line is
/// dry.
///
/// "In water" means that the particles within one effective radius `reach` [m], weighted by 1 - r / reach,
/// amount to half of the largest sum along the line, so that a flat surface is found half a spacing above its
/// topmost particles, in the open as well as along a wall and in a corner. Spray is passed over: less than half
/// of what a full corner would give.
pub fn level(
    fields: &Fields,
    groups: &Groups,
    line: [f64; 2],
    dimensions: u32,
    reach: f64,
    l0: f64,
    periodic: &Periodic,
) -> Option<f64> {
    let plane = dimensions == 2;
    let near: Vec<(f64, f64)> = (0..groups.fluid)
        .filter(|&i| fields.kind[i] == Kind::Fluid)
        .map(|i| fields.position[i])
        .map(|x| (periodic.nearest(DVec3::new(x.x - line[0], x.y - line[1], 0.0)), x.z))
        .map(|(way, z)| (way.x.powi(2) + if plane { 0.0 } else { way.y.powi(2) }, z))
        .filter(|&(d2, _)| d2 < reach * reach)
        .collect();
    let sum = |z: f64| -> f64 {
        near.iter().map(|&(d2, zi)| (1.0 - (d2 + (z - zi).powi(2)).sqrt() / reach).max(0.0)).sum()
    };
    let bottom = near.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
    let top = near.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max) + reach;
    if near.is_empty() {
        return None;
    }
    let step = 0.1 * l0;
    let samples: Vec<(f64, f64)> = (0..=((top - bottom) / step).ceil() as usize)
        .map(|k| top - k as f64 * step)
        .map(|z| (z, sum(z)))
        .collect();
    let full = full_sum(dimensions, reach / l0);
    let corner = if plane { 0.5 } else { 0.25 } * full;
    let largest = samples.iter().map(|s| s.1).fold(0.0, f64::max);
    let threshold = 0.5 * largest.clamp(corner, full);
    let below = samples.iter().position(|s| s.1 >= threshold)?;
    let (z, s) = samples[below];
    // The topmost sample lies out of everybody's reach: its sum is zero.
    let (z_above, s_above) = samples[below.checked_sub(1)?];
    Some(z + (z_above - z) * (s - threshold) / (s - s_above))
}

/// Sum of 1 - r / re over the full lattice, with its centre; `radius` is re / l0.
fn full_sum(dimensions: u32, radius: f64) -> f64 {
    let m = radius.ceil() as i32;
    let mut total = 0.0;
    for x in -m..=m {
        for y in if dimensions == 2 { 0..=0 } else { -m..=m } {
            for z in -m..=m {
                total += (1.0 - f64::from(x * x + y * y + z * z).sqrt() / radius).max(0.0);
            }
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::level;
    use crate::fields::Fields;
    use crate::scene::{Groups, Kind};
    use glam::DVec3;

    fn block(n: [i32; 3], l0: f64) -> Fields {
        let mut fields = Fields::default();
        for x in 0..n[0] {
            for y in 0..n[1] {
                for z in 0..n[2] {
                    let at = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) + 0.5;
                    fields.position.push(at * l0);
                    fields.kind.push(Kind::Fluid);
                }
            }
        }
        fields
    }

    fn level_of(fields: &Fields, line: [f64; 2], l0: f64) -> Option<f64> {
        let groups = Groups { fluid: fields.kind.len(), ..Groups::default() };
        level(fields, &groups, line, 3, 2.1 * l0, l0, &Default::default())
    }

    #[test]
    fn a_flat_surface_is_found_in_the_open_and_at_a_wall() {
        let l0 = 0.01;
        let fields = block([12, 12, 8], l0);
        for line in [[0.06, 0.06], [0.063, 0.058], [0.0, 0.06], [0.0, 0.0]] {
            let z = level_of(&fields, line, l0).unwrap();
            assert!((z - 8.0 * l0).abs() < 0.15 * l0, "{line:?}: {z}");
        }
        assert!(level_of(&fields, [0.5, 0.06], l0).is_none());
    }

    #[test]
    fn spray_above_the_surface_is_passed_over_and_ghosts_are_not_seen() {
        let l0 = 0.01;
        let mut fields = block([12, 12, 8], l0);
        for (z, kind) in [(0.3, Kind::Fluid), (0.101, Kind::Ghost), (0.111, Kind::Ghost)] {
            fields.position.push(DVec3::new(0.06, 0.06, z));
            fields.kind.push(kind);
        }
        let z = level_of(&fields, [0.06, 0.06], l0).unwrap();
        assert!((z - 8.0 * l0).abs() < 0.15 * l0, "{z}");
    }
}
