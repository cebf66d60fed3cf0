//! `result.json`: what a run did, for people and for scripts that collect many runs.

use super::write_whole;
use crate::error::Result;
use crate::ranks::Standing;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// How a run ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The end time, or the number of steps asked for, was reached.
    #[default]
    Done,
    /// A guard found that the computation means nothing any more.
    Diverged,
    /// A signal asked the run to stop.
    Interrupted,
    /// A file could not be written, the device was lost, or the end was reached with a result that means nothing
    /// (see the verdict).
    Failed,
}

/// What can be said of a result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Grade {
    /// Nothing speaks against it.
    #[default]
    Fine,
    /// It can be looked at, with the reasons in mind.
    Degraded,
    /// It means nothing.
    Failed,
}

/// A [`Grade`], and why.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Verdict {
    /// What can be said.
    pub grade: Grade,
    /// Why, the worst first; nothing of a fine result.
    pub reasons: Vec<String>,
    /// What could not be judged, and what would let it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
    /// What speaks against no result, but may not be what was wanted.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.grade {
            Grade::Fine => f.write_str("fine"),
            Grade::Degraded => write!(f, "degraded because {}", self.reasons.join("; ")),
            Grade::Failed => write!(f, "failed because {}", self.reasons.join("; ")),
        }
    }
}

/// Numbers of particles.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Particles {
    /// All.
    pub total: usize,
    /// Water.
    pub fluid: usize,
    /// Wall layers of fixed and moving walls.
    pub wall: usize,
    /// Layers behind them.
    pub dummy: usize,
    /// Bodies, wall layer and inside.
    pub body: usize,
}

/// The pressure Poisson equation over all steps.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Pressure {
    /// Preconditioner that ran: `jacobi` or `multigrid`; nothing for a scene without fluid.
    pub preconditioner: Option<&'static str>,
    /// Solves of the run, one a step; those before a state of `run.from` are another run's.
    pub solves: u64,
    /// Mean number of unknowns.
    pub unknowns_mean: f64,
    /// Mean number of iterations a solve.
    pub iterations_mean: f64,
    /// Most iterations of a solve.
    pub iterations_max: u32,
    /// Largest ||r|| / ||b|| at the end of a solve [-].
    pub relative_residual_max: f64,
    /// Solves that ended without meeting the tolerance.
    pub failures: u64,
    /// Pressures that were cut at the upper bound, over all steps.
    pub clamps: u64,
    /// Negative pressures that were set to zero, of water and walls, over all steps.
    pub negative: u64,
}

/// Extremes over the run.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Monitors {
    /// Steps after which the fluid was looked at, for its speeds and its density: all on a CPU, those of the rows of monitors.csv and each
    /// tenth on a device.
    pub steps_seen: u64,
    /// Steps after which the energy was summed: those of the rows, and of the looks in a scene without free bodies.
    pub energy_steps_seen: u64,
    /// Largest |n / n0 - 1| of an inner fluid particle [-], in the steps seen as those below.
    pub density_error_max: f64,
    /// Mean over the run of the mean of n / n0 - 1 [-].
    pub density_error_mean: f64,
    /// Largest v dt / l0 of the fluid [-].
    pub courant_max: f64,
    /// Longest way of a point of a solid within a step over l0 [-].
    pub solid_courant_max: f64,
    /// Largest speed of the fluid [m/s].
    #[serde(rename = "speed_max_m_s")]
    pub speed_max: f64,
    /// Energy of fluid and free bodies at t = 0: of motion, of height, in contact springs [J].
    #[serde(rename = "energy_start_J")]
    pub energy_start: f64,
    /// The same at the end [J].
    #[serde(rename = "energy_end_J")]
    pub energy_end: f64,
    /// Its largest value [J].
    #[serde(rename = "energy_max_J")]
    pub energy_max: f64,
    /// Fluid particles that were taken out.
    pub lost_particles: u64,
    /// Most neighbours of a particle.
    pub neighbours_max: u32,
    /// Deepest penetration of two solids over l0 [-].
    pub penetration_max_over_l0: f64,
    /// Largest dt sqrt(K / m_e) of a whole step, before sub-stepping [-].
    pub contact_omega_dt: f64,
    /// Most contact sub-steps of a step.
    pub contact_substeps_max: u32,
    /// Work that driven solids did on bodies by contact [J].
    #[serde(rename = "driven_contact_work_J")]
    pub driven_contact_work: f64,
}

/// A body, a moving wall, or an obstacle that is no box along the lattice, at the end.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Body {
    /// Name.
    pub name: String,
    /// Centre of mass [m]; of a hinged body a place on its hinge.
    pub position_m: [f64; 3],
    /// Turn from the shape as its keys (file, section, axis) describe it, before `orientation`: unit quaternion w, x, y, z.
    pub orientation_wxyz: [f64; 4],
    /// Velocity [m/s].
    pub velocity_m_s: [f64; 3],
    /// Angular velocity, world axes [rad/s].
    pub angular_velocity_rad_s: [f64; 3],
    /// Force of the fluid in the last step [N]; none where it is not computed: on walls that move, without a gauge for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fluid_force_n: Option<[f64; 3]>,
}

/// Water that an opening has let through.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Passed {
    /// Name of the opening.
    pub name: String,
    /// Particles.
    pub particles: u64,
    /// Their volume [m3]; in two dimensions of a slice one spacing wide.
    pub volume_m3: f64,
    /// Volume that it was to let through besides [m3]: of an inflow what solids before it held back, of an outflow what its `discharge`
    /// has asked for where no water was. None of outflows that follow no discharge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missed_m3: Option<f64>,
}

/// Water of a scene with openings: what was there at the start and came in is what is there at the end, went out or was lost,
/// to the particle.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Water {
    /// Particles at t = 0.
    pub particles_start: u64,
    /// Particles at the end.
    pub particles_end: u64,
    /// Particles that left the domain.
    pub particles_lost: u64,
    /// Volume at t = 0 [m3]; in two dimensions of a slice one spacing wide.
    pub volume_start_m3: f64,
    /// Volume at the end [m3].
    pub volume_end_m3: f64,
    /// What came in.
    pub inflow: Vec<Passed>,
    /// What went out.
    pub outflow: Vec<Passed>,
}

/// The summary of a run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Summary {
    /// Name of the case.
    pub case: String,
    /// Version of this program.
    pub version: &'static str,
    /// `cpu` or `gpu`.
    pub backend: String,
    /// The processor.
    pub adapter: String,
    /// `f64` or `f32`.
    pub precision: String,
    /// How the run ended.
    pub status: Status,
    /// Why, in words.
    pub exit_reason: String,
    /// What can be said of the result.
    pub verdict: Verdict,
    /// Steps done.
    pub steps: u64,
    /// Of these, steps of the run that it goes on from with `run.from`.
    #[serde(skip_serializing_if = "is_zero")]
    pub steps_before: u64,
    /// Time reached [s].
    pub time_s: f64,
    /// Wall-clock time [s], of all its processes.
    pub wall_s: f64,
    /// Processes that it took: 1, and one more each time that it was resumed.
    pub parts: u64,
    /// Frames written.
    pub frames: u64,
    /// Frames written of each `[[output.series]]`, by its name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub series: BTreeMap<String, u64>,
    /// Most memory that the process has held so far [bytes], where the system tells it (Linux).
    pub memory_peak_bytes: Option<u64>,
    /// What each rank held and said, of a run on many.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ranks: Vec<Standing>,
    /// Numbers of particles.
    pub particles: Particles,
    /// Wall-clock seconds of each stage, and of `output`.
    pub stages: BTreeMap<&'static str, f64>,
    /// The pressure Poisson equation.
    pub pressure: Pressure,
    /// Extremes.
    pub monitors: Monitors,
    /// Work of each part of the step [J], and what of the change of energy none of them accounts for, if
    /// `output.ledger` asks for it.
    #[serde(rename = "ledger_J", skip_serializing_if = "Option::is_none")]
    pub ledger: Option<BTreeMap<&'static str, f64>>,
    /// Bodies and moving walls.
    pub bodies: Vec<Body>,
    /// The water, of a scene with inflows or outflows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub water: Option<Water>,
}

/// Whether there are none: nothing is said of them then.
fn is_zero(n: &u64) -> bool {
    *n == 0
}

impl Summary {
    /// Particles of water that the run has had, those of the start and those that came in; `None` of a scene without water.
    pub fn water_in_all(&self) -> Option<u64> {
        let came = self.water.as_ref().map(|w| w.inflow.iter().map(|i| i.particles).sum::<u64>());
        let start = self.particles.fluid as u64;
        (start > 0 || came.is_some()).then(|| start + came.unwrap_or(0))
    }

    /// The summary as JSON.
    pub fn json(&self) -> String {
        // Numbers that are not finite become null; nothing else in here can fail.
        serde_json::to_string_pretty(self).unwrap_or_else(|e| format!("{{\"error\": \"{e}\"}}"))
    }

    /// Write `result.json`.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`].
    pub fn write(&self, path: &Path) -> Result<()> {
        write_whole(path, (self.json() + "\n").as_bytes())
    }
}
