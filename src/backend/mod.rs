//! Where the particle stages run: the CPU in f64 ([`cpu`]) or a device in f32 ([`gpu`]).

pub mod cpu;
pub mod gpu;
mod rows;
pub mod traffic;

use crate::body::{Pose, Wrench};
use crate::error::Result;
use crate::fields::Fields;
use crate::monitor::FluidMonitor;
use crate::params::Step;
use crate::plan::Stage;
use crate::pressure::PressureReport;

/// What the guards have seen since the start of the run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counters {
    /// Fluid particles that left the domain or became non-finite, and were taken out.
    pub lost: u64,
    /// Displacements and velocity corrections that were shortened.
    pub displacement_clamps: u64,
    /// Pressures that were cut at the upper bound.
    pub pressure_clamps: u64,
    /// Most neighbours of a particle so far.
    pub neighbours_max: u32,
    /// First particle (scene number) whose velocity became non-finite in `correct`.
    pub non_finite: Option<u32>,
    /// A row with more neighbours than the lists hold: slot and neighbours.
    pub overflow: Option<(u32, u32)>,
}

/// A backend holds the particles and runs stages on them.
pub trait Backend: Send {
    /// Name of the processor, e.g. `CPU, f64, 2 threads` or the adapter's name.
    fn description(&self) -> String;
    /// `f64` or `f32`.
    fn precision(&self) -> &'static str;
    /// Run one stage (every one but `ConjugateGradient`, `MoveSolids`, `BodyForce` and `Contact`, which have calls
    /// of their own).
    fn run(&mut self, stage: Stage, step: &Step) -> Result<()>;
    /// Solve the PPE.
    fn solve_pressure(&mut self, step: &Step) -> Result<PressureReport>;
    /// Give the particles of moving solids the poses of their solids.
    fn move_solids(&mut self, poses: &[Pose]) -> Result<()>;
    /// Force and torque of the fluid on each moving solid, in the pose given last.
    fn body_force(&mut self) -> Result<Vec<Wrench>>;
    /// What the guards have seen.
    fn counters(&mut self) -> Result<Counters>;
    /// Sums over the fluid.
    fn monitor(&mut self) -> Result<FluidMonitor>;
    /// Pressures of single slots [Pa].
    fn pressures(&mut self, slots: &[usize]) -> Result<Vec<f64>>;
    /// All fields, on the host.
    fn read(&mut self) -> Result<Fields>;
    /// Overwrite all fields (positions, velocities, kinds, ids, pressures).
    fn write(&mut self, fields: &Fields) -> Result<()>;
    /// Wait until everything asked for so far is done, if the backend works in the background.
    fn wait(&mut self) -> Result<()> {
        Ok(())
    }
    /// Bytes that the backend holds for particles.
    fn bytes(&self) -> u64;
    /// Sizes that the counted traffic follows from.
    fn sizes(&mut self) -> Result<traffic::Sizes>;
    /// Kernels started on a device so far; 0 for a backend without one.
    fn dispatches(&self) -> u64 {
        0
    }
}
