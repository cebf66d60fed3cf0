//! The backend of the first of many ranks: it does what it is asked and has the others do the same, each on its own particles.

use super::traffic::Traffic;
use super::{Backend, Commands, Counters, Ranked, Timing};
use crate::body::slots::SlotRow;
use crate::body::{FreeBody, Pose, Wrench};
use crate::checkpoint::Archive;
use crate::error::{Error, Result};
use crate::fields::Fields;
use crate::kernels::body_force::RowPressure;
use crate::kernels::openings::{Emission, Outlet};
use crate::ledger::Ledger;
use crate::monitor::FluidMonitor;
use crate::output::pieces::Pieces;
use crate::params::Step;
use crate::plan::{ParticleStage, Stage};
use crate::pressure::PressureReport;
use crate::ranks::{Standing, Team, decode, encode};
use crate::stop::Stop;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What the first rank has the others do: a call of [`Backend`].
#[derive(Serialize, Deserialize)]
enum Order<'a> {
    Run(ParticleStage, Step),
    PassOpenings(Cow<'a, [Emission]>, Cow<'a, [Outlet]>),
    FreeBodies(Cow<'a, [FreeBody]>, Cow<'a, [SlotRow]>),
    SolvePressure(Step),
    MoveSolids(Cow<'a, [Pose]>),
    BodyForce(Cow<'a, [usize]>),
    Counters,
    Ledger,
    Monitor,
    Pressures(Cow<'a, [usize]>),
    Read,
    ReadWalls,
    WritePieces(Cow<'a, Pieces>),
    Keep,
    Recall,
    Restore,
    Ranks,
    End,
}

/// The backend of the first rank.
pub struct Lead {
    team: Arc<dyn Team>,
    own: Box<dyn Ranked>,
    /// Its device is lost: the others wait for it somewhere, and hear nothing more.
    lost: bool,
    /// Whether it was seen that what the others write is where the first rank sees it.
    seen: bool,
    /// What belongs to the particles that the ranks keep.
    kept: Option<(Counters, Option<Ledger>, f64)>,
}

impl Lead {
    /// With its own part of the particles, `own`; the others [`follow`].
    pub fn new(team: Arc<dyn Team>, own: Box<dyn Ranked>) -> Self {
        Self { team, own, lost: false, seen: false, kept: None }
    }

    /// Have all ranks do `order`, this one by `own`.
    fn all<T>(&mut self, order: &Order, own: impl FnOnce(&mut dyn Ranked) -> Result<T>) -> Result<T> {
        if self.lost {
            // The others wait for what was given up.
            return Err(Error::gpu("its device is lost, and with it the run of all ranks"));
        }
        self.order(order);
        let done = own(&mut *self.own);
        self.lost |= matches!(done, Err(Error::Gpu(_)));
        done
    }

    /// Have all ranks write their water as `pieces` says, and write the file that names these.
    ///
    /// # Errors
    /// [`crate::Error::Io`] of the first rank that could not.
    pub fn write_pieces(&mut self, pieces: &Pieces) -> Result<()> {
        let bytes = self.all(&Order::WritePieces(Cow::Borrowed(pieces)), |own| own.write_piece(pieces))?;
        if !self.seen {
            pieces.are_seen(&bytes)?;
            self.seen = true;
        }
        pieces.write_list(self.team.ranks())
    }

    /// Pressures [Pa] and number densities [-] of the wall layers, in the order of their slots.
    ///
    /// # Errors
    /// A device that is lost.
    pub fn read_walls(&mut self) -> Result<[Vec<f64>; 2]> {
        self.all(&Order::ReadWalls, |own| own.read_walls())
    }

    /// Put the particles that the ranks have kept into `archive`, the state in memory that was made last.
    ///
    /// # Errors
    /// What the archive says.
    pub fn complete(&mut self, archive: &mut Archive) -> Result<()> {
        let Some((counters, work, dt)) = self.kept.take() else { return Ok(()) };
        match self.all(&Order::Recall, |own| own.recall())? {
            Some(fields) => self.own.save_all(archive, fields, counters, work, dt),
            None => Ok(()),
        }
    }

    fn order(&self, order: &Order) {
        self.team.hear(encode(order));
    }
}

impl Drop for Lead {
    fn drop(&mut self) {
        // In a panic the others are not where they could hear it.
        if !std::thread::panicking() && !self.lost {
            self.order(&Order::End);
        }
    }
}

impl Backend for Lead {
    fn description(&self) -> String {
        self.own.team_description()
    }

    fn precision(&self) -> &'static str {
        self.own.precision()
    }

    fn run(&mut self, stage: ParticleStage, step: &Step) -> Result<()> {
        self.all(&Order::Run(stage, *step), |own| own.run(stage, step))
    }

    fn pass_openings(&mut self, emissions: &[Emission], outlets: &[Outlet]) -> Result<()> {
        self.all(&Order::PassOpenings(emissions.into(), outlets.into()), |own| {
            own.pass_openings(emissions, outlets)
        })
    }

    fn free_bodies(&mut self, bodies: &[FreeBody], slots: &[SlotRow]) -> Result<()> {
        self.all(&Order::FreeBodies(bodies.into(), slots.into()), |own| own.free_bodies(bodies, slots))
    }

    fn solve_pressure(&mut self, step: &Step) -> Result<PressureReport> {
        self.all(&Order::SolvePressure(*step), |own| own.solve_pressure(step))
    }

    fn move_solids(&mut self, poses: &[Pose]) -> Result<()> {
        self.all(&Order::MoveSolids(poses.into()), |own| own.move_solids(poses))
    }

    fn body_force(&mut self, rows: &[usize]) -> Result<(Vec<Wrench>, Vec<RowPressure>)> {
        self.all(&Order::BodyForce(rows.into()), |own| own.body_force(rows))
    }

    fn counters(&mut self) -> Result<Counters> {
        self.all(&Order::Counters, |own| own.counters())
    }

    fn ledger(&mut self) -> Result<Option<Ledger>> {
        self.all(&Order::Ledger, |own| own.ledger())
    }

    fn monitor(&mut self) -> Result<FluidMonitor> {
        self.all(&Order::Monitor, |own| own.monitor())
    }

    fn wall_pressures(&mut self, slots: &[usize]) -> Result<Vec<RowPressure>> {
        self.all(&Order::Pressures(slots.into()), |own| own.wall_pressures(slots))
    }

    fn read(&mut self) -> Result<Fields> {
        self.all(&Order::Read, |own| own.read())
    }

    fn write(&mut self, fields: &Fields) -> Result<()> {
        self.all(&Order::Restore, |own| own.restore(Some(fields.clone())))
    }

    fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        if archive.is_saving() {
            let (counters, work, dt) = (self.counters()?, self.ledger()?, self.own.dt());
            if !archive.is_lasting() && self.team.ranks() > 1 {
                // In memory: each rank keeps its own, which is gathered if the state is asked for.
                self.all(&Order::Keep, |own| own.keep())?;
                self.kept = Some((counters, work, dt));
                return Ok(());
            }
            let fields = self.read()?;
            return self.own.save_all(archive, fields, counters, work, dt);
        }
        // A state that does not fit is refused before the others hear of it.
        let fields = self.own.read_all(archive)?;
        self.write(&fields)
    }

    fn timing(&self) -> Timing {
        self.own.timing()
    }

    fn stage_seconds(&self) -> BTreeMap<Stage, f64> {
        self.own.stage_seconds()
    }

    fn wait(&mut self) -> Result<()> {
        self.own.wait()
    }

    fn commands(&self) -> Commands {
        self.own.commands()
    }

    fn lead(&mut self) -> Option<&mut Lead> {
        (self.team.ranks() > 1).then_some(self)
    }

    fn ranks(&mut self) -> Result<Vec<Standing>> {
        self.all(&Order::Ranks, |own| own.ranks())
    }

    fn gives_up(&self) -> bool {
        // Steps over ranks are short, and the state of all of them is long in the making.
        false
    }

    fn stop_with(&mut self, _: &Stop) {}

    fn bytes(&self) -> u64 {
        self.own.bytes()
    }

    fn traffic(&mut self) -> Result<Traffic> {
        self.own.traffic()
    }
}

/// What a rank does that is not the first: what that one orders, until it ends.
///
/// # Errors
/// What a stage says.
pub fn follow(own: &mut dyn Ranked) -> Result<()> {
    while let Some(order) = own.share().map(|share| share.hear()) {
        match decode::<Order>(&order) {
            Order::Run(stage, step) => own.run(stage, &step)?,
            Order::PassOpenings(emissions, outlets) => own.pass_openings(&emissions, &outlets)?,
            Order::FreeBodies(bodies, slots) => own.free_bodies(&bodies, &slots)?,
            Order::SolvePressure(step) => drop(own.solve_pressure(&step)?),
            Order::MoveSolids(poses) => own.move_solids(&poses)?,
            Order::BodyForce(rows) => drop(own.body_force(&rows)?),
            Order::Counters => drop(own.counters()?),
            Order::Ledger => drop(own.ledger()?),
            Order::Monitor => drop(own.monitor()?),
            Order::Pressures(slots) => drop(own.wall_pressures(&slots)?),
            Order::Read => drop(own.read()?),
            Order::ReadWalls => drop(own.read_walls()?),
            Order::Keep => own.keep()?,
            Order::Recall => drop(own.recall()?),
            // The first rank hears of what went wrong here, and ends the run.
            Order::WritePieces(pieces) => {
                if let Err(lost @ Error::Gpu(_)) = own.write_piece(&pieces) {
                    return Err(lost);
                }
            }
            Order::Ranks => drop(own.ranks()?),
            Order::Restore => own.restore(None)?,
            Order::End => return Ok(()),
        }
    }
    Ok(())
}
