//! The verdict on a point: what `seixo run` says of the same case, from the same sums.

use seixo::backend::Timing;
use seixo::checkpoint::Archive;
use seixo::error::Result;
use seixo::output::result::Verdict;
use seixo::run::Due;
use seixo::run::scale::Scale;
use seixo::run::summary::Totals;
use seixo::run::verdict::judge;
use seixo::scene::Scene;
use seixo::simulation::{Simulation, StepReport};

/// What a run is judged by, gathered on its way.
pub struct Judged {
    totals: Totals,
    scale: Scale,
    /// When `seixo run` would write a row of monitors.csv.
    rows: Due,
    /// Whether each step gets one, as without `output.table_every`.
    all: bool,
    /// No body is free: the energy is that of the water.
    water_alone: bool,
    last: StepReport,
}

impl Judged {
    /// For a run of `simulation`, which is at its start.
    pub fn new(simulation: &Simulation, scene: &Scene) -> Self {
        let every = simulation.case.output.table_every;
        Self {
            totals: Totals::default(),
            scale: Scale::new(simulation, scene),
            rows: Due::new(every),
            all: every.is_none(),
            water_alone: (0..scene.solids.len()).all(|k| !simulation.solids.is_free(k)),
            last: StepReport::default(),
        }
    }

    /// Before the first step.
    ///
    /// # Errors
    /// What the backend says when it is read.
    pub fn start(&mut self, simulation: &mut Simulation) -> Result<()> {
        self.look(simulation, true)?;
        self.totals.start();
        Ok(())
    }

    /// After the step that `report` is of.
    ///
    /// # Errors
    /// What the backend says when it is read.
    pub fn step(&mut self, report: StepReport, simulation: &mut Simulation) -> Result<()> {
        self.totals.add(&report, simulation);
        let host = simulation.backend.timing() == Timing::Host;
        let seen = host || report.look.is_some();
        self.last = report;
        // A device is not waited for at every step: the time of the steps alone is what a study tells.
        let due = self.rows.reached(simulation.time);
        let row = due && (seen || !self.all);
        if row || seen { self.look(simulation, row) } else { Ok(()) }
    }

    /// Takes in the water as it is, and with `row` the energy of bodies, which takes another search for contacts.
    fn look(&mut self, simulation: &mut Simulation, row: bool) -> Result<()> {
        let (fluid, counters) = match &self.last.look {
            _ if !simulation.plan.wet() => Default::default(),
            Some(look) => look.clone(),
            None => simulation.observe()?,
        };
        let (steps, l0) = (simulation.steps, simulation.params.spacing);
        self.totals.look(steps, (&fluid, &counters), self.last.dt, l0);
        if row || self.water_alone {
            let bodies = if row { simulation.solids.energy().total() } else { 0.0 };
            self.totals.weigh(steps, fluid.kinetic + fluid.potential + bodies);
        }
        Ok(())
    }

    /// The verdict on the run, which has come to its end.
    ///
    /// # Errors
    /// What the backend says when it is read.
    pub fn verdict(mut self, simulation: &mut Simulation, scene: &Scene) -> Result<Verdict> {
        self.look(simulation, true)?;
        self.totals.ledger = simulation.ledger()?;
        let summary = self.totals.summary(simulation, scene);
        Ok(judge(&summary, self.scale, simulation.case.run.adaptive))
    }

    /// Save the sums, or take them over.
    ///
    /// # Errors
    /// [`seixo::error::Error::Checkpoint`] if the state holds none.
    pub fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        self.rows.exchange("judged.rows", archive)?;
        self.totals.exchange(archive)
    }
}
