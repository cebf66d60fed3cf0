//! The backend of the first of many ranks: it does what it is asked and has the others do the same, each on its own particles.

use super::cpu::Cpu;
use super::traffic::Traffic;
use super::{Backend, Counters, RowPressure};
use crate::body::slots::SlotRow;
use crate::body::{FreeBody, Pose, Wrench};
use crate::checkpoint::Archive;
use crate::error::Result;
use crate::fields::Fields;
use crate::kernels::openings::{Emission, Outlet};
use crate::ledger::Ledger;
use crate::monitor::FluidMonitor;
use crate::output::pieces::Pieces;
use crate::params::Step;
use crate::plan::ParticleStage;
use crate::pressure::PressureReport;
use crate::ranks::{Standing, Team, decode, encode};
use crate::stop::Stop;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::sync::Arc;

/// What the first rank has the others do: a call of [`Backend`].
#[derive(Serialize, Deserialize)]
enum Order<'a> {
    Run(ParticleStage, Step),
    PassOpenings(Cow<'a, [Emission]>, Cow<'a, [Outlet]>),
    FreeBodies(Cow<'a, [FreeBody]>, Cow<'a, [SlotRow]>),
    SolvePressure(Step),
    MoveSolids(Cow<'a, [Pose]>),
    BodyForce,
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
    cpu: Cpu,
    /// Whether it was seen that what the others write is where the first rank sees it.
    seen: bool,
    /// What belongs to the particles that the ranks keep.
    kept: Option<(Counters, Option<Ledger>, f64)>,
}

impl Lead {
    /// With its own part of the particles, `cpu`; the others [`follow`].
    pub fn new(team: Arc<dyn Team>, cpu: Cpu) -> Self {
        Self { team, cpu, seen: false, kept: None }
    }

    /// Have all ranks write their water as `pieces` says, and write the file that names these.
    ///
    /// # Errors
    /// [`crate::Error::Io`] of the first rank that could not.
    pub fn write_pieces(&mut self, pieces: &Pieces) -> Result<()> {
        self.order(&Order::WritePieces(Cow::Borrowed(pieces)));
        let bytes = self.cpu.write_piece(pieces)?;
        if !self.seen {
            pieces.are_seen(&bytes)?;
            self.seen = true;
        }
        pieces.write_list(self.team.ranks())
    }

    /// Pressures [Pa] and number densities [-] of the wall layers, in the order of their slots.
    pub fn read_walls(&mut self) -> [Vec<f64>; 2] {
        self.order(&Order::ReadWalls);
        self.cpu.read_walls()
    }

    /// Put the particles that the ranks have kept into `archive`, the state in memory that was made last.
    ///
    /// # Errors
    /// What the archive says.
    pub fn complete(&mut self, archive: &mut Archive) -> Result<()> {
        let Some((counters, work, dt)) = self.kept.take() else { return Ok(()) };
        self.order(&Order::Recall);
        match self.cpu.recall() {
            Some(fields) => self.cpu.save_all(archive, fields, counters, work, dt),
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
        if !std::thread::panicking() {
            self.order(&Order::End);
        }
    }
}

impl Backend for Lead {
    fn description(&self) -> String {
        let (ranks, one) = (self.team.ranks(), self.cpu.description());
        let threads = one.strip_prefix("CPU, ").unwrap_or(&one);
        format!("CPU, {ranks} rank{} of {threads}", if ranks == 1 { "" } else { "s" })
    }

    fn precision(&self) -> &'static str {
        self.cpu.precision()
    }

    fn run(&mut self, stage: ParticleStage, step: &Step) -> Result<()> {
        self.order(&Order::Run(stage, *step));
        self.cpu.run(stage, step)
    }

    fn pass_openings(&mut self, emissions: &[Emission], outlets: &[Outlet]) -> Result<()> {
        self.order(&Order::PassOpenings(emissions.into(), outlets.into()));
        self.cpu.pass_openings(emissions, outlets)
    }

    fn free_bodies(&mut self, bodies: &[FreeBody], slots: &[SlotRow]) -> Result<()> {
        self.order(&Order::FreeBodies(bodies.into(), slots.into()));
        self.cpu.free_bodies(bodies, slots)
    }

    fn solve_pressure(&mut self, step: &Step) -> Result<PressureReport> {
        self.order(&Order::SolvePressure(*step));
        self.cpu.solve_pressure(step)
    }

    fn move_solids(&mut self, poses: &[Pose]) -> Result<()> {
        self.order(&Order::MoveSolids(poses.into()));
        self.cpu.move_solids(poses)
    }

    fn body_force(&mut self) -> Result<Vec<Wrench>> {
        self.order(&Order::BodyForce);
        self.cpu.body_force()
    }

    fn counters(&mut self) -> Result<Counters> {
        self.order(&Order::Counters);
        self.cpu.counters()
    }

    fn ledger(&mut self) -> Result<Option<Ledger>> {
        self.order(&Order::Ledger);
        self.cpu.ledger()
    }

    fn monitor(&mut self) -> Result<FluidMonitor> {
        self.order(&Order::Monitor);
        self.cpu.monitor()
    }

    fn wall_pressures(&mut self, slots: &[usize]) -> Result<Vec<RowPressure>> {
        self.order(&Order::Pressures(slots.into()));
        self.cpu.wall_pressures(slots)
    }

    fn read(&mut self) -> Result<Fields> {
        self.order(&Order::Read);
        self.cpu.read()
    }

    fn write(&mut self, fields: &Fields) -> Result<()> {
        self.order(&Order::Restore);
        self.cpu.restore(Some(fields.clone()))
    }

    fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        if archive.is_saving() {
            let (counters, work, dt) = (self.counters()?, self.ledger()?, self.cpu.dt());
            if !archive.is_lasting() && self.team.ranks() > 1 {
                // In memory: each rank keeps its own, which is gathered if the state is asked for.
                self.order(&Order::Keep);
                self.cpu.keep();
                self.kept = Some((counters, work, dt));
                return Ok(());
            }
            let fields = self.read()?;
            return self.cpu.save_all(archive, fields, counters, work, dt);
        }
        // A state that does not fit is refused before the others hear of it.
        let fields = self.cpu.read_all(archive)?;
        self.write(&fields)
    }

    fn lead(&mut self) -> Option<&mut Lead> {
        (self.team.ranks() > 1).then_some(self)
    }

    fn ranks(&mut self) -> Result<Vec<Standing>> {
        self.order(&Order::Ranks);
        self.cpu.ranks()
    }

    fn gives_up(&self) -> bool {
        // Steps over ranks are short, and the state of all of them is long in the making.
        false
    }

    fn stop_with(&mut self, _: &Stop) {}

    fn bytes(&self) -> u64 {
        self.cpu.bytes()
    }

    fn traffic(&mut self) -> Result<Traffic> {
        self.cpu.traffic()
    }
}

/// What a rank does that is not the first: what that one orders, until it ends.
///
/// # Errors
/// What a stage says.
pub fn follow(cpu: &mut Cpu) -> Result<()> {
    while let Some(order) = cpu.share().map(|share| share.hear()) {
        match decode::<Order>(&order) {
            Order::Run(stage, step) => cpu.run(stage, &step)?,
            Order::PassOpenings(emissions, outlets) => cpu.pass_openings(&emissions, &outlets)?,
            Order::FreeBodies(bodies, slots) => cpu.free_bodies(&bodies, &slots)?,
            Order::SolvePressure(step) => drop(cpu.solve_pressure(&step)?),
            Order::MoveSolids(poses) => cpu.move_solids(&poses)?,
            Order::BodyForce => drop(cpu.body_force()?),
            Order::Counters => drop(cpu.counters()?),
            Order::Ledger => drop(cpu.ledger()?),
            Order::Monitor => drop(cpu.monitor()?),
            Order::Pressures(slots) => drop(cpu.wall_pressures(&slots)?),
            Order::Read => drop(cpu.read()?),
            Order::ReadWalls => drop(cpu.read_walls()),
            Order::Keep => cpu.keep(),
            Order::Recall => drop(cpu.recall()),
            // The first rank hears of what went wrong here, and ends the run.
            Order::WritePieces(pieces) => drop(cpu.write_piece(&pieces)),
            Order::Ranks => drop(cpu.ranks()?),
            Order::Restore => cpu.restore(None)?,
            Order::End => return Ok(()),
        }
    }
    Ok(())
}
