//! Sums over a run, for `result.json`.

use super::tables::solved;
use crate::backend::Counters;
use crate::checkpoint::Archive;
use crate::error::Result;
use crate::ledger::{Entry, Ledger};
use crate::monitor::FluidMonitor;
use crate::output::result::{Body, Monitors, Particles, Passed, Pressure, Summary, Water};
use crate::scene::{Kind, Scene};
use crate::simulation::{Simulation, StepReport};
use std::collections::BTreeMap;
use std::time::Duration;

/// Sums since the start.
#[derive(Clone, Debug, Default)]
pub struct Totals {
    solves: u64,
    unknowns: u64,
    iterations: u64,
    pressure: Pressure,
    monitors: Monitors,
    density_error: f64,
    /// Steps at the last [`Self::look`] and [`Self::weigh`]: no step counts twice.
    looked: Option<u64>,
    weighed: Option<u64>,
    /// Work of each part of the step, if it is kept.
    pub ledger: Option<Ledger>,
    /// Particles of water, and those that each outflow had swallowed, when last looked at.
    water: (u64, Vec<u64>),
    /// Largest speed of the fluid when last looked at [m/s].
    pub speed: f64,
    /// Wall-clock time spent on files.
    pub output: Duration,
}

impl Totals {
    /// Save the sums, or take them over.
    ///
    /// # Errors
    /// [`crate::error::Error::Checkpoint`] if the state has none.
    pub fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        let Self {
            solves,
            unknowns,
            iterations,
            pressure,
            monitors,
            density_error,
            speed,
            // Only that a last row makes no second look of the same process.
            looked: _,
            weighed: _,
            // Read from the simulation at the next row, and at the end.
            ledger: _,
            water: _,
            // By the clock of each process.
            output: _,
        } = self;
        for (name, value) in [("solves", solves), ("unknowns", unknowns), ("iterations", iterations)] {
            archive.count(&format!("totals.{name}"), value)?;
        }
        archive.number("totals.density_error", density_error)?;
        archive.number("totals.speed", speed)?;
        // Means are made at the end.
        let Pressure {
            preconditioner: _,
            solves: _,
            unknowns_mean: _,
            iterations_mean: _,
            iterations_max,
            relative_residual_max,
            failures,
            // Counted by the backend.
            clamps: _,
            negative: _,
        } = pressure;
        archive.small("totals.iterations_max", iterations_max)?;
        archive.number("totals.relative_residual_max", relative_residual_max)?;
        archive.count("totals.failures", failures)?;
        let Monitors {
            steps_seen,
            energy_steps_seen,
            density_error_max,
            density_error_mean: _,
            courant_max,
            solid_courant_max,
            speed_max,
            energy_start,
            energy_end,
            energy_max,
            lost_particles,
            neighbours_max,
            penetration_max_over_l0,
            contact_omega_dt,
            contact_substeps_max,
            driven_contact_work,
        } = monitors;
        for (name, value) in [
            ("density_error_max", density_error_max),
            ("courant_max", courant_max),
            ("solid_courant_max", solid_courant_max),
            ("speed_max", speed_max),
            ("energy_start", energy_start),
            ("energy_end", energy_end),
            ("energy_max", energy_max),
            ("penetration_max_over_l0", penetration_max_over_l0),
            ("contact_omega_dt", contact_omega_dt),
            ("driven_contact_work", driven_contact_work),
        ] {
            archive.number(&format!("totals.{name}"), value)?;
        }
        archive.count("totals.looks", steps_seen)?;
        // Once both were of the same steps.
        *energy_steps_seen = if archive.is_saving() { *energy_steps_seen } else { *steps_seen };
        archive.count_of_late("totals.weighed", energy_steps_seen)?;
        archive.count("totals.lost_particles", lost_particles)?;
        archive.small("totals.neighbours_max", neighbours_max)?;
        archive.small("totals.contact_substeps_max", contact_substeps_max)
    }

    /// Count a step in.
    pub fn add(&mut self, report: &StepReport, simulation: &Simulation) {
        if simulation.plan.wet() {
            let solve = &report.pressure;
            self.solves += 1;
            self.unknowns += solve.unknowns as u64;
            self.iterations += u64::from(solve.iterations);
            self.pressure.iterations_max = self.pressure.iterations_max.max(solve.iterations);
            self.pressure.relative_residual_max = self.pressure.relative_residual_max.max(solve.residual);
            self.pressure.failures += u64::from(!solved(solve.outcome));
        }
        let (monitors, contact) = (&mut self.monitors, &report.contact);
        let way = report.dt * simulation.solids.fastest(report.time, report.dt) / simulation.params.spacing;
        monitors.solid_courant_max = monitors.solid_courant_max.max(way);
        monitors.penetration_max_over_l0 =
            monitors.penetration_max_over_l0.max(contact.penetration_max_over_l0);
        monitors.contact_omega_dt = monitors.contact_omega_dt.max(contact.omega_dt);
        monitors.contact_substeps_max = monitors.contact_substeps_max.max(contact.substeps);
        monitors.driven_contact_work += report.dt * simulation.solids.driven_contact_power();
    }

    /// Take in what the simulation itself has counted since the start.
    pub fn see(&mut self, fluid: &FluidMonitor, counters: &Counters) {
        self.water = (fluid.particles, counters.swallowed.clone());
        self.pressure.clamps = counters.pressure_clamps;
        self.pressure.negative = counters.negative_pressures;
    }

    /// Count in a look at the water and the guards after so many `steps`; the last one was `dt` [s] long, with l0 [m].
    pub fn look(&mut self, steps: u64, (fluid, counters): (&FluidMonitor, &Counters), dt: f64, l0: f64) {
        self.see(fluid, counters);
        self.speed = fluid.speed_max;
        let monitors = &mut self.monitors;
        if self.looked.replace(steps) != Some(steps) {
            monitors.steps_seen += 1;
            self.density_error += fluid.density_error_mean;
        }
        monitors.density_error_max = monitors.density_error_max.max(fluid.density_error_max);
        monitors.courant_max = monitors.courant_max.max(fluid.speed_max * dt / l0);
        monitors.speed_max = monitors.speed_max.max(fluid.speed_max);
        monitors.lost_particles = counters.lost;
        monitors.neighbours_max = counters.neighbours_max;
    }

    /// Count in the energy of fluid and bodies [J] after so many `steps`.
    pub fn weigh(&mut self, steps: u64, energy: f64) {
        let monitors = &mut self.monitors;
        monitors.energy_steps_seen += u64::from(self.weighed.replace(steps) != Some(steps));
        monitors.energy_end = energy;
        // The sum may not be a number, and then is not to be passed over.
        if monitors.energy_end.partial_cmp(&monitors.energy_max).is_none_or(std::cmp::Ordering::is_gt) {
            monitors.energy_max = monitors.energy_end;
        }
    }

    /// The energy seen last is that of the start.
    pub fn start(&mut self) {
        let monitors = &mut self.monitors;
        monitors.energy_start = monitors.energy_end;
        monitors.energy_max = monitors.energy_end;
        // Before the first step there is no number density to be wrong.
        (monitors.steps_seen, monitors.energy_steps_seen, self.density_error) = (0, 0, 0.0);
    }

    /// The summary, but for how the run ended.
    pub fn summary(&self, simulation: &Simulation, scene: &Scene) -> Summary {
        let per = |sum: u64, of: u64| sum as f64 / of.max(1) as f64;
        let mut pressure = self.pressure;
        let preconditioner = simulation.plan.preconditioner.name();
        pressure.preconditioner = simulation.plan.wet().then_some(preconditioner);
        pressure.solves = self.solves;
        pressure.unknowns_mean = per(self.unknowns, self.solves);
        pressure.iterations_mean = per(self.iterations, self.solves);
        let mut monitors = self.monitors;
        monitors.density_error_mean = self.density_error / monitors.steps_seen.max(1) as f64;
        let precision = simulation.backend.precision();
        Summary {
            version: env!("CARGO_PKG_VERSION"),
            // The CPU path is the one in double precision.
            backend: if precision == "f64" { "cpu" } else { "gpu" }.to_string(),
            adapter: simulation.backend.description(),
            precision: precision.to_string(),
            steps: simulation.steps,
            steps_before: simulation.steps - simulation.own_steps(),
            time_s: simulation.time,
            particles: particles(scene),
            stages: simulation.stages.iter().map(|(stage, seconds)| (stage.name(), *seconds)).collect(),
            pressure,
            monitors,
            ledger: self.ledger.map(|ledger| works(&ledger, monitors.energy_end - monitors.energy_start)),
            bodies: bodies(simulation),
            water: self.water(simulation),
            ..Summary::default()
        }
    }

    /// Particles of water when last looked at.
    pub fn particles(&self) -> u64 {
        self.water.0
    }

    /// What came in and went out, of a scene with openings.
    fn water(&self, simulation: &Simulation) -> Option<Water> {
        let openings = &simulation.openings;
        let volume = simulation.params.particle_volume();
        let passed = |name: &str, particles: u64, missed_m3: Option<f64>| Passed {
            name: name.to_owned(),
            particles,
            volume_m3: particles as f64 * volume,
            missed_m3,
        };
        let inflows = openings.emitted().zip(openings.held_back());
        let outflows = openings.outflows().zip(&self.water.1).zip(openings.missed());
        (!openings.is_empty()).then(|| Water {
            particles_start: simulation.scene.water() as u64,
            particles_end: self.water.0,
            particles_lost: self.monitors.lost_particles,
            volume_start_m3: simulation.scene.water() as f64 * volume,
            volume_end_m3: self.water.0 as f64 * volume,
            inflow: inflows.map(|((name, n), held)| passed(name, n, Some(held))).collect(),
            outflow: outflows.map(|((name, &n), missed)| passed(name, n, missed)).collect(),
        })
    }
}

/// Numbers of particles by kind.
pub fn particles(scene: &Scene) -> Particles {
    // Slots for water that is to come in hold no particle.
    let mut out = Particles { total: scene.kind.len() - scene.reserve, ..Particles::default() };
    for kind in &scene.kind {
        match kind {
            Kind::Fluid => out.fluid += 1,
            Kind::Ghost => {}
            Kind::Wall => out.wall += 1,
            Kind::Dummy => out.dummy += 1,
            Kind::BodyWall | Kind::BodyDummy => out.body += 1,
        }
    }
    out
}

/// The ledger as `result.json` has it, for an energy that changed by `change` [J].
fn works(ledger: &Ledger, change: f64) -> BTreeMap<&'static str, f64> {
    let entries = Entry::ALL.map(|entry| (entry.name(), ledger.get(entry)));
    entries.into_iter().chain([("unaccounted", change - ledger.total())]).collect()
}

fn bodies(simulation: &Simulation) -> Vec<Body> {
    let poses = simulation.solids.poses().iter().zip(&simulation.fluid_force).enumerate();
    let poses = poses.take(simulation.scene.followed());
    let known = simulation.knows_fluid_force();
    poses
        .map(|(k, (pose, wrench))| {
            let q = simulation.scene.solids[k].turn(pose.orientation);
            Body {
                name: simulation.solids.name(k).to_string(),
                position_m: simulation.solids.path(k).to_array(),
                orientation_wxyz: [q.w, q.x, q.y, q.z],
                velocity_m_s: pose.velocity.to_array(),
                angular_velocity_rad_s: pose.angular_velocity.to_array(),
                fluid_force_n: known.then(|| wrench.force.to_array()),
            }
        })
        .collect()
}
