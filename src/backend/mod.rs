//! Where the particle stages run: the CPU in f64 ([`cpu`]) or a device in f32 ([`gpu`]).

pub mod cpu;
pub mod gpu;
pub mod lead;
mod processor;
mod ranked;
pub mod traffic;

use self::lead::Lead;
use self::traffic::Traffic;
use crate::body::slots::SlotRow;
use crate::body::{FreeBody, Pose, Wrench};
use crate::checkpoint::Archive;
use crate::compute::Compute;
use crate::error::Result;
use crate::fields::Fields;
use crate::kernels::body_force::RowPressure;
use crate::kernels::openings::{Emission, Outlet};
use crate::ledger::Ledger;
use crate::monitor::FluidMonitor;
use crate::params::Step;
use crate::plan::{Arrays, ParticleStage, Plan, Stage};
use crate::pressure::PressureReport;
use crate::ranks::Standing;
use crate::scene::Scene;
use crate::stop::Stop;
use glam::DVec3;
pub use processor::Processor;
pub use ranked::Ranked;
use std::collections::BTreeMap;

/// The fields of `scene` at t = 0, with the arrays that `plan` asks for.
fn start(scene: &Scene, plan: &Plan) -> Fields {
    let mut fields = Fields::new(scene);
    if plan.needs(Arrays::Reaction) {
        let groups = scene.groups;
        let rows = plan.reaction.rows(groups.pressure() - groups.fluid, groups.moving_wall);
        fields.reaction = vec![DVec3::ZERO; rows];
    }
    if plan.needs(Arrays::Coupling) {
        fields.inertia_head = vec![0.0; scene.groups.moving_wall];
    }
    if plan.needs(Arrays::SurfacePressure) {
        fields.surface_pressure = vec![0.0; scene.groups.pressure()];
    }
    fields
}

/// Outflows of `scene`.
fn outflows(scene: &Scene) -> usize {
    scene.openings.iter().filter(|o| !o.is_inflow()).count()
}

/// What the guards have seen since the start of the run.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Counters {
    /// Fluid particles that left the domain or became non-finite, and were taken out.
    pub lost: u64,
    /// Displacements and velocity corrections that were shortened.
    pub displacement_clamps: u64,
    /// Pressures that were cut at the upper bound.
    pub pressure_clamps: u64,
    /// Negative pressures that were set to zero: water bears no tension.
    pub negative_pressures: u64,
    /// Most neighbours of a particle so far.
    pub neighbours_max: u32,
    /// First particle (scene number) whose velocity became non-finite in `correct`.
    pub non_finite: Option<u32>,
    /// A row with more neighbours than the lists hold: slot and neighbours.
    pub overflow: Option<(u32, u32)>,
    /// Fluid particles that each outflow has swallowed.
    pub swallowed: Vec<u64>,
}

impl Counters {
    /// At the start of a run with as many outflows.
    fn new(outflows: usize) -> Self {
        Self { swallowed: vec![0; outflows], ..Self::default() }
    }

    /// Fluid particles that are in the scene no more.
    pub fn gone(&self) -> u64 {
        self.lost + self.swallowed.iter().sum::<u64>()
    }

    /// Those of all ranks in one.
    fn of_ranks(all: Vec<Self>) -> Self {
        all.into_iter().reduce(Self::plus).unwrap_or_default()
    }

    /// Those of two ranks in one.
    fn plus(mut self, other: Self) -> Self {
        self.lost += other.lost;
        self.displacement_clamps += other.displacement_clamps;
        self.pressure_clamps += other.pressure_clamps;
        self.negative_pressures += other.negative_pressures;
        self.neighbours_max = self.neighbours_max.max(other.neighbours_max);
        self.non_finite = self.non_finite.or(other.non_finite);
        self.overflow = self.overflow.or(other.overflow);
        self.swallowed.iter_mut().zip(other.swallowed).for_each(|(sum, n)| *sum += n);
        self
    }

    /// Save the counters, or take them over.
    pub(crate) fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        let Self {
            lost,
            displacement_clamps,
            pressure_clamps,
            negative_pressures,
            neighbours_max,
            non_finite,
            overflow,
            swallowed,
        } = self;
        for (k, count) in swallowed.iter_mut().enumerate() {
            archive.count(&format!("counters.swallowed.{k}"), count)?;
        }
        archive.count("counters.lost", lost)?;
        archive.count("counters.displacement_clamps", displacement_clamps)?;
        if !archive.is_of_another() {
            archive.count("counters.pressure_clamps", pressure_clamps)?;
            archive.count("counters.negative_pressures", negative_pressures)?;
        }
        archive.small("counters.neighbours_max", neighbours_max)?;
        let mut none = non_finite.unwrap_or(u32::MAX);
        archive.small("counters.non_finite", &mut none)?;
        *non_finite = Some(none).filter(|&n| n != u32::MAX);
        let (mut slot, mut neighbours) = overflow.unwrap_or((u32::MAX, 0));
        archive.small("counters.overflow_slot", &mut slot)?;
        archive.small("counters.overflow_neighbours", &mut neighbours)?;
        *overflow = Some((slot, neighbours)).filter(|o| o.0 != u32::MAX);
        Ok(())
    }
}

/// How the time of a stage can be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum Timing {
    /// By the host's clock: a call returns when its work is done.
    #[serde(rename = "host clock")]
    Host,
    /// By the device's own clock, see [`Backend::stage_seconds`].
    #[serde(rename = "timestamps")]
    Timestamps,
    /// Only by waiting for the device after each stage.
    #[serde(rename = "host waits")]
    Waits,
}

impl Timing {
    /// In words, as the JSON has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Host => "host clock",
            Self::Timestamps => "timestamps",
            Self::Waits => "host waits",
        }
    }
}

/// What was asked of a device since the start.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Commands {
    /// Kernels started.
    pub dispatches: u64,
    /// Of them, by stage.
    pub by_stage: BTreeMap<Stage, u64>,
    /// Times that recorded work was handed over.
    pub submits: u64,
    /// Times that the host waited for it.
    pub waits: u64,
}

impl Commands {
    /// Count a kernel of `stage`.
    pub fn add(&mut self, stage: Option<Stage>) {
        self.dispatches += 1;
        if let Some(stage) = stage {
            *self.by_stage.entry(stage).or_default() += 1;
        }
    }
}

/// A backend holds the particles and runs stages on them.
pub trait Backend: Send {
    /// Name of the processor, e.g. `CPU, f64, 2 threads` or the adapter's name.
    fn description(&self) -> String;
    /// `f64` or `f32`.
    fn precision(&self) -> &'static str;
    /// Run one stage.
    fn run(&mut self, stage: ParticleStage, step: &Step) -> Result<()>;
    /// Water that comes in and goes out: layers that become water in slots that no particle has, and boxes that swallow, one
    /// an outflow; needed where the plan has [`Stage::Openings`].
    fn pass_openings(&mut self, emissions: &[Emission], outlets: &[Outlet]) -> Result<()>;
    /// How the moving solids answer forces in the next solve, in the pose given last, and rows of theirs at slots, in the
    /// order of solids and rows; needed where the plan has [`crate::plan::Arrays::Coupling`].
    fn free_bodies(&mut self, bodies: &[FreeBody], slots: &[SlotRow]) -> Result<()>;
    /// Solve the PPE.
    fn solve_pressure(&mut self, step: &Step) -> Result<PressureReport>;
    /// Give the particles of moving solids the poses of their solids.
    fn move_solids(&mut self, poses: &[Pose]) -> Result<()>;
    /// Force and torque of the fluid on each moving solid, in the pose given last, and pressures of the wall particles `rows` as
    /// [`Self::wall_pressures`] tells them: one wait on a device.
    fn body_force(&mut self, rows: &[usize]) -> Result<(Vec<Wrench>, Vec<RowPressure>)>;
    /// What the guards have seen.
    fn counters(&mut self) -> Result<Counters>;
    /// Work of the stages on the water since the start, if the plan asks for the ledger.
    fn ledger(&mut self) -> Result<Option<Ledger>>;
    /// Sums over the fluid.
    fn monitor(&mut self) -> Result<FluidMonitor>;
    /// Both of these, with one wait on a device; [`Self::stage_seconds`] is up to date then.
    fn look(&mut self) -> Result<(FluidMonitor, Counters)> {
        Ok((self.monitor()?, self.counters()?))
    }
    /// How the time of a stage can be told.
    fn timing(&self) -> Timing {
        Timing::Host
    }
    /// Time of each stage since the start by the device's own clock, as of the last look [s].
    fn stage_seconds(&self) -> BTreeMap<Stage, f64> {
        BTreeMap::new()
    }
    /// Pressures as the last solve found them, before bounds cut them [Pa], if the backend keeps them.
    fn solution(&mut self) -> Result<Option<Vec<f64>>> {
        Ok(None)
    }
    /// Pressures of single particles of walls [Pa], each with what it is above that on the surface but for the weight of the water
    /// between ([`crate::kernels::wall_excess`]): none where no gauge of the case asks, or the scheme knows none.
    fn wall_pressures(&mut self, slots: &[usize]) -> Result<Vec<RowPressure>>;
    /// All fields, on the host.
    fn read(&mut self) -> Result<Fields>;
    /// The first of many ranks, each of which can write its own water; nothing where there is one.
    fn lead(&mut self) -> Option<&mut Lead> {
        None
    }
    /// Overwrite all fields (positions, velocities, kinds, ids, pressures).
    fn write(&mut self, fields: &Fields) -> Result<()>;
    /// Save the whole state between two steps, to the last bit, or take it over; on the same kind of backend.
    fn exchange(&mut self, archive: &mut Archive) -> Result<()>;
    /// Wait until everything asked for so far is done, if the backend works in the background.
    fn wait(&mut self) -> Result<()> {
        Ok(())
    }
    /// Whether a step may be given up between two stages, for a state kept in memory to go back to.
    fn gives_up(&self) -> bool {
        true
    }
    /// A solve in progress may be given up when `stop` has become overdue; it ends as if its iterations had run out.
    fn stop_with(&mut self, stop: &Stop);
    /// Bytes that the backend holds for particles.
    fn bytes(&self) -> u64;
    /// The device on which contact may search and press its pairs, where the plan has it do so.
    fn compute(&mut self) -> Option<&mut dyn Compute> {
        None
    }
    /// Bytes that a step like the last one must move.
    fn traffic(&mut self) -> Result<Traffic>;
    /// What each rank holds and said; nothing where there is one.
    fn ranks(&mut self) -> Result<Vec<Standing>> {
        Ok(Vec::new())
    }
    /// What was asked of a device; nothing for a backend without one.
    fn commands(&self) -> Commands {
        Commands::default()
    }
}
