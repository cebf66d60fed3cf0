//! The tables over time: monitors.csv, bodies.csv and gauges.csv.

use super::due::Due;
use super::summary::Totals;
use crate::backend::{Counters, Timing};
use crate::body::Wrench;
use crate::checkpoint::Archive;
use crate::contact::Energy;
use crate::error::Result;
use crate::gauges::Gauges;
use crate::ledger::Entry;
use crate::monitor::FluidMonitor;
use crate::output::folder::Folder;
use crate::output::table::{Cell, Table, vector_cells, vector_columns};
use crate::plan::Stage;
use crate::pressure::Outcome;
use crate::scene::Scene;
use crate::simulation::{Simulation, StepReport};
use glam::DVec3;
use std::collections::BTreeMap;

/// The tables of a run.
#[derive(Debug)]
pub struct Tables {
    monitors: Table,
    bodies: Option<Table>,
    gauges: Option<(Gauges, Table)>,
    due: Due,
    gauges_due: Due,
    stages: Vec<Stage>,
    /// No body is free: the energy is that of the water.
    water_alone: bool,
    since: Since,
    /// Step of the last row.
    last: Option<u64>,
    /// Step of the last row of gauges.
    gauged: Option<u64>,
}

/// What happened since the last row.
#[derive(Debug, Default)]
struct Since {
    iterations: u32,
    residual: f64,
    outcome: Option<Outcome>,
    penetration: f64,
    omega_dt: f64,
    substeps: u32,
    stages: BTreeMap<Stage, f64>,
}

impl Since {
    /// Save the sums, or take them over.
    fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        // The times of the stages are those of each process.
        let Self { iterations, residual, outcome, penetration, omega_dt, substeps, stages: _ } = self;
        archive.small("since.iterations", iterations)?;
        archive.number("since.residual", residual)?;
        archive.number("since.penetration", penetration)?;
        archive.number("since.omega_dt", omega_dt)?;
        archive.small("since.substeps", substeps)?;
        let code = outcome.and_then(|o| OUTCOMES.iter().position(|&other| other == o));
        let mut code = code.map_or(u64::MAX, |k| k as u64);
        archive.count("since.outcome", &mut code)?;
        *outcome = usize::try_from(code).ok().and_then(|k| OUTCOMES.get(k).copied());
        Ok(())
    }
}

/// All outcomes, in the order of their codes in a checkpoint.
const OUTCOMES: [Outcome; 5] =
    [Outcome::Converged, Outcome::ZeroSource, Outcome::MaxIterations, Outcome::Breakdown, Outcome::NonFinite];

/// A word for a table.
pub(crate) fn outcome_name(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Converged => "converged",
        Outcome::ZeroSource => "zero_source",
        Outcome::MaxIterations => "max_iterations",
        Outcome::Breakdown => "breakdown",
        Outcome::NonFinite => "non_finite",
    }
}

/// Whether a solve did what it was asked for.
pub fn solved(outcome: Outcome) -> bool {
    matches!(outcome, Outcome::Converged | Outcome::ZeroSource)
}

impl Tables {
    /// Tables with their headers; those of a run that `goes_on` are there already.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`].
    pub fn create(
        folder: &Folder,
        simulation: &Simulation,
        scene: &Scene,
        gauges: Gauges,
        goes_on: bool,
    ) -> Result<Self> {
        let table = |name: &str, header: &[String]| {
            let path = folder.file(name);
            if goes_on { Table::reopen(&path, header) } else { Table::create(&path, header) }
        };
        let stages: Vec<Stage> = Stage::ALL.into_iter().filter(|&s| simulation.plan.has(s)).collect();
        let every = simulation.case.output.table_every;
        let gauges = if gauges.is_empty() {
            None
        } else {
            let table = table("gauges.csv", &gauges.header())?;
            Some((gauges, table))
        };
        // The walls in openings are no solids that anyone follows.
        let followed = scene.followed();
        let bodies = if followed == 0 { None } else { Some(table("bodies.csv", &body_header())?) };
        Ok(Self {
            monitors: table("monitors.csv", &monitor_header(&stages, simulation))?,
            bodies,
            gauges,
            due: Due::new(every),
            gauges_due: Due::new(simulation.case.gauge.every),
            stages,
            water_alone: (0..scene.solids.len()).all(|k| !simulation.solids.is_free(k)),
            since: Since::default(),
            last: None,
            gauged: None,
        })
    }

    /// Save where the tables stand, or cut them back to that.
    ///
    /// # Errors
    /// [`crate::error::Error::Folder`] if one is shorter than that, [`crate::error::Error::Io`].
    pub(crate) fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        let Self {
            monitors,
            bodies,
            gauges,
            due,
            gauges_due,
            stages: _,
            water_alone: _,
            since,
            last,
            gauged,
        } = self;
        monitors.exchange(archive)?;
        for table in bodies.iter_mut().chain(gauges.as_mut().map(|(_, table)| table)) {
            table.exchange(archive)?;
        }
        due.exchange("tables", archive)?;
        gauges_due.exchange("gauges", archive)?;
        gauges.iter_mut().try_for_each(|(gauges, _)| gauges.exchange(archive))?;
        for (name, step) in [("tables.last", last), ("gauges.last", gauged)] {
            let mut number = step.unwrap_or(u64::MAX);
            archive.count(name, &mut number)?;
            *step = Some(number).filter(|&n| n != u64::MAX);
        }
        since.exchange(archive)
    }

    /// Moments before `time` [s] are over.
    pub(crate) fn skip(&mut self, time: f64) {
        self.due.reached(time);
        self.gauges_due.reached(time);
    }

    /// Rows at t = 0.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], or what the backend says.
    pub fn start(&mut self, simulation: &mut Simulation, totals: &mut Totals) -> Result<()> {
        self.write(&StepReport::default(), simulation, totals)?;
        totals.start();
        self.write_gauges(simulation)
    }

    /// Rows that are due after a step.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], or what the backend says.
    pub fn step(
        &mut self,
        report: &StepReport,
        simulation: &mut Simulation,
        totals: &mut Totals,
    ) -> Result<()> {
        let since = &mut self.since;
        since.iterations = since.iterations.max(report.pressure.iterations);
        since.residual = since.residual.max(report.pressure.residual);
        if since.outcome.is_none_or(solved) {
            since.outcome = Some(report.pressure.outcome);
        }
        since.penetration = since.penetration.max(report.contact.penetration_max_over_l0);
        since.omega_dt = since.omega_dt.max(report.contact.omega_dt);
        since.substeps = since.substeps.max(report.contact.substeps);
        if self.due.reached(simulation.time) {
            self.write(report, simulation, totals)?;
        } else if report.look.is_some() || simulation.backend.timing() == Timing::Host {
            self.look(report, simulation, totals)?;
        }
        if let Some((gauges, _)) = &mut self.gauges {
            gauges.follow(simulation, report.dt)?;
        }
        if self.gauges_due.reached(simulation.time) {
            self.write_gauges(simulation)?;
        }
        Ok(())
    }

    /// Rows at the end, if the last step has none yet; the summary's numbers of the end come from here. A run that went on from a state of its last step
    /// has the rows, but not all of these numbers.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], or what the backend says.
    pub fn finish(
        &mut self,
        report: &StepReport,
        simulation: &mut Simulation,
        totals: &mut Totals,
    ) -> Result<()> {
        if self.gauged != Some(simulation.steps) {
            self.write_gauges(simulation)?;
        }
        if self.last != Some(simulation.steps) {
            return self.write(report, simulation, totals);
        }
        let (fluid, counters) = observe(simulation, report)?;
        totals.see(&fluid, &counters);
        totals.ledger = simulation.ledger()?;
        Ok(())
    }

    /// The extremes of a step without a row: one pass over the water where no device is waited for. The energy of free bodies takes another
    /// search for contacts, and is left to the rows.
    fn look(&self, report: &StepReport, simulation: &mut Simulation, totals: &mut Totals) -> Result<()> {
        let (fluid, counters) = observe(simulation, report)?;
        totals.look(simulation.steps, (&fluid, &counters), report.dt, simulation.params.spacing);
        if self.water_alone {
            totals.weigh(simulation.steps, fluid.kinetic + fluid.potential);
        }
        Ok(())
    }

    fn write(&mut self, report: &StepReport, simulation: &mut Simulation, totals: &mut Totals) -> Result<()> {
        self.last = Some(simulation.steps);
        let (fluid, counters) = observe(simulation, report)?;
        let bodies = simulation.solids.energy();
        totals.look(simulation.steps, (&fluid, &counters), report.dt, simulation.params.spacing);
        totals.weigh(simulation.steps, fluid.kinetic + fluid.potential + bodies.total());
        let since = std::mem::take(&mut self.since);
        let mut row = self.monitor_row(report, simulation, &fluid, &counters, bodies, &since);
        let ledger = simulation.ledger()?;
        row.extend(simulation.volumes(&fluid, &counters).into_iter().map(|(_, volume)| Cell::from(volume)));
        row.extend(ledger.iter().flat_map(|l| Entry::ALL.map(|entry| Cell::from(l.get(entry)))));
        totals.ledger = ledger;
        self.since.stages = simulation.stages.clone();
        self.monitors.row(&row)?;
        self.monitors.flush()?;
        if let Some(table) = &mut self.bodies {
            let followed = simulation.scene.followed();
            let known = simulation.knows_fluid_force();
            for (k, pose) in simulation.solids.poses().iter().enumerate().take(followed) {
                let q = simulation.scene.solids[k].turn(pose.orientation);
                let (fluid, contact) = (simulation.fluid_force[k], simulation.solids.contact_wrenches()[k]);
                let nothing = Wrench { force: DVec3::NAN, torque: DVec3::NAN };
                let fluid = if known { fluid } else { nothing };
                let contact = if simulation.has_stepped() { contact } else { nothing };
                let mut row = vec![Cell::time(simulation.time), Cell::from(simulation.solids.name(k))];
                row.extend(vector_cells(simulation.solids.path(k)));
                row.extend([q.w, q.x, q.y, q.z].map(Cell::Number));
                for vector in [pose.velocity, pose.angular_velocity] {
                    row.extend(vector_cells(vector));
                }
                for wrench in [fluid, contact] {
                    row.extend(vector_cells(wrench.force));
                    row.extend(vector_cells(wrench.torque));
                }
                table.row(&row)?;
            }
            table.flush()?;
        }
        Ok(())
    }

    fn monitor_row(
        &self,
        report: &StepReport,
        simulation: &Simulation,
        fluid: &FluidMonitor,
        counters: &Counters,
        bodies: Energy,
        since: &Since,
    ) -> Vec<Cell> {
        // Before the first step there is nothing yet that a step has done.
        let stepped = simulation.has_stepped();
        let of_step = |value: f64| if stepped { value } else { f64::NAN };
        let count = |n: u32| if stepped { Cell::from(u64::from(n)) } else { Cell::from(f64::NAN) };
        let mut row = vec![Cell::from(simulation.steps), Cell::time(simulation.time)];
        row.extend(
            [
                of_step(report.dt),
                of_step(fluid.speed_max * report.dt / simulation.params.spacing),
                fluid.speed_max,
                of_step(fluid.density_error_mean),
                of_step(fluid.density_error_max),
                fluid.kinetic,
                fluid.potential,
                bodies.kinetic,
                bodies.gravity,
                bodies.contact,
                fluid.kinetic + fluid.potential + bodies.total(),
            ]
            .map(Cell::Number),
        );
        for vector in [fluid.momentum, fluid.centroid, fluid.extent_max] {
            row.extend(vector.map(Cell::Number));
        }
        row.extend([count(since.iterations), Cell::from(of_step(since.residual))]);
        row.push(Cell::from(since.outcome.filter(|_| simulation.plan.wet()).map_or("", outcome_name)));
        row.extend([
            Cell::from(of_step(since.penetration)),
            count(since.substeps),
            Cell::from(of_step(since.omega_dt)),
            Cell::from(counters.lost),
            Cell::from(counters.displacement_clamps),
            Cell::from(counters.pressure_clamps),
            Cell::from(counters.negative_pressures),
            count(counters.neighbours_max),
        ]);
        // A stage whose time nothing tells gets an empty cell.
        let told = simulation.backend.timing() != Timing::Waits || simulation.wait_for_stages;
        row.extend(self.stages.iter().map(|s| match (simulation.stages.get(s), since.stages.get(s)) {
            (Some(now), before) => Cell::from(now - before.unwrap_or(&0.0)),
            (None, _) => Cell::from(if told { 0.0 } else { f64::NAN }),
        }));
        row
    }

    fn write_gauges(&mut self, simulation: &mut Simulation) -> Result<()> {
        self.gauged = Some(simulation.steps);
        if let Some((gauges, table)) = &mut self.gauges {
            table.row(&gauges.row(simulation)?)?;
            gauges.begin();
            table.flush()?;
        }
        Ok(())
    }
}

/// The water and the counters, if `report` has not seen them already; nothing of a dry scene.
fn observe(simulation: &mut Simulation, report: &StepReport) -> Result<(FluidMonitor, Counters)> {
    if !simulation.plan.wet() {
        return Ok(Default::default());
    }
    report.look.clone().map_or_else(|| simulation.observe(), Ok)
}

fn monitor_header(stages: &[Stage], simulation: &Simulation) -> Vec<String> {
    let fixed = "step [-],time [s],dt [s],courant [-],speed_max [m/s],density_error_mean [-],density_error_max [-],\
                 kinetic [J],potential [J],body_kinetic [J],body_potential [J],body_contact [J],energy [J]";
    let mut header: Vec<String> = fixed.split(',').map(String::from).collect();
    header.extend(vector_columns("momentum", "kg m/s"));
    header.extend(vector_columns("centroid", "m"));
    header.extend(vector_columns("extent_max", "m"));
    let rest = "iterations [-],residual [-],outcome,penetration_over_l0 [-],contact_substeps [-],\
                contact_omega_dt [-],fluid_lost [-],displacement_clamps [-],pressure_clamps [-],\
                negative_pressures [-],neighbours_max [-]";
    header.extend(rest.split(',').map(String::from));
    header.extend(stages.iter().map(|s| format!("wall_{} [s]", s.name())));
    header.extend(simulation.openings.columns().into_iter().map(|name| format!("{name} [m3]")));
    if simulation.plan.ledger {
        header.extend(Entry::ALL.map(|entry| format!("work_{} [J]", entry.name())));
    }
    header
}

fn body_header() -> Vec<String> {
    let mut header: Vec<String> = ["time [s]", "body", "x [m]", "y [m]", "z [m]"].map(String::from).to_vec();
    header.extend(["w", "x", "y", "z"].map(|axis| format!("q{axis} [-]")));
    header.extend(vector_columns("velocity", "m/s"));
    header.extend(vector_columns("angular_velocity", "rad/s"));
    header.extend(vector_columns("fluid_force", "N"));
    header.extend(vector_columns("fluid_torque", "N m"));
    header.extend(vector_columns("contact_force", "N"));
    header.extend(vector_columns("contact_torque", "N m"));
    header
}
