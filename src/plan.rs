//! Which stages a scene needs. The only place where that is judged: what is not planned is not compiled,
//! not allocated and not run.

use crate::case::{Case, ContactDevice, Law, Preconditioner, Source};
use crate::params::Params;
use crate::scene::{Drive, Scene};

/// A stage of the time step. Its name is the name of the kernel, of the timing and of the test.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// Explicit viscosity.
    Viscosity,
    /// v*, r*.
    Predict,
    /// Moving solids take their pose.
    MoveSolids,
    /// Sort by cell.
    CellList,
    /// Neighbour search.
    NeighbourList,
    /// Particle collisions.
    Collision,
    /// Number density and free surface.
    NumberDensity,
    /// Right side and diagonal of the PPE.
    PressureSource,
    /// The PPE.
    ConjugateGradient,
    /// Pressure gradient.
    PressureGradient,
    /// v, r.
    Correct,
    /// Force of the fluid on solids.
    BodyForce,
    /// Contact and motion of the bodies; sums, friction and motion on the host.
    Contact,
}

impl Stage {
    /// All stages, in the order of the step.
    pub const ALL: [Self; 13] = [
        Self::Viscosity,
        Self::Predict,
        Self::MoveSolids,
        Self::CellList,
        Self::NeighbourList,
        Self::Collision,
        Self::NumberDensity,
        Self::PressureSource,
        Self::ConjugateGradient,
        Self::PressureGradient,
        Self::Correct,
        Self::BodyForce,
        Self::Contact,
    ];

    /// Name, as in the kernel's file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viscosity => "viscosity",
            Self::Predict => "predict",
            Self::MoveSolids => "move_solids",
            Self::CellList => "cell_list",
            Self::NeighbourList => "neighbour_list",
            Self::Collision => "collision",
            Self::NumberDensity => "number_density",
            Self::PressureSource => "pressure_source",
            Self::ConjugateGradient => "conjugate_gradient",
            Self::PressureGradient => "pressure_gradient",
            Self::Correct => "correct",
            Self::BodyForce => "body_force",
            Self::Contact => "contact",
        }
    }
}

/// Unknowns from which multigrid pays: below, an iteration of it costs more than it saves.
pub const MULTIGRID_UNKNOWNS: usize = 30_000;

/// Surface points of bodies that move freely from which the device searches and presses their contacts. A sub-step
/// costs a round trip to the device, 0.1 ms or so, however many bodies there are; the host takes 2.4 us for a cube
/// of 200 points at rest, of which the smooth law's edges and the poses, 1.5 us, stay on it. The two meet at about a
/// hundred bodies, which this is. It counts points and no microseconds, so that the same case computes in the same
/// way on every machine.
pub const DEVICE_CONTACT_POINTS: usize = 20_000;

/// Density ratio of body to water below which the fluid's force is relaxed, in three dimensions [-].
pub const LIGHT_3D: f64 = 0.4;
/// The same in two dimensions, where a body drags more water along: unrelaxed, 0.5 swings and 0.7 does not.
pub const LIGHT_2D: f64 = 0.7;
/// Water that a body drags along over the water that it displaces [-]; rather too much.
const ADDED_MASS: f64 = 0.7;

/// Share s of the new force for a body of density ratio `ratio`. The force alternates by 1 - s - s C / ratio a step,
/// C the added mass: s (1 + C / ratio) must stay below 2, and is 1 here or less.
fn relaxation(ratio: f64) -> f64 {
    (1.0 / (1.0 + ADDED_MASS / ratio)).min(0.2)
}

/// Where a backend with a device searches and presses the pairs of contact; a backend without one leaves it to the
/// host.
#[derive(Clone, Debug, Default)]
pub struct ContactPlan {
    /// The device's kernel; `None`: on the host.
    pub kernel: Option<&'static str>,
    /// Why.
    pub reason: String,
}

impl ContactPlan {
    /// On the device, whatever the size of the scene; for comparisons. Nothing changes where the device has no
    /// kernel for the law.
    pub fn on_device(case: &Case, scene: &Scene) -> Self {
        Self::judge(case, scene, ContactDevice::Gpu)
    }

    fn judge(case: &Case, scene: &Scene, asked: ContactDevice) -> Self {
        let host = |reason: &str| Self { kernel: None, reason: reason.into() };
        let free = |s: &&crate::scene::Solid| matches!(s.drive, Drive::Free(_));
        let points: usize = scene.solids.iter().filter(free).map(|s| s.wall_offset.len()).sum();
        let kernel = match case.contact.as_ref().map(|c| c.law) {
            None => return host("no contact"),
            Some(Law::Pressure) => return host("the baseline's impulses follow one another"),
            Some(Law::Smooth) => Some("contact_smooth"),
            Some(Law::Paper) => Some("contact_paper"),
        };
        let most = DEVICE_CONTACT_POINTS;
        match asked {
            _ if points == 0 => host("no body is free"),
            ContactDevice::Host => host("contact.device = \"host\""),
            ContactDevice::Gpu => Self { kernel, reason: "contact.device = \"gpu\"".into() },
            ContactDevice::Auto if points < most => {
                host(&format!("{points} surface points, below {most} a round trip to a device costs more"))
            }
            ContactDevice::Auto => {
                Self { kernel, reason: format!("{points} surface points, {most} or more") }
            }
        }
    }
}

/// What a scene needs.
#[derive(Clone, Debug)]
pub struct Plan {
    /// For each stage of [`Stage::ALL`]: why it runs (`Ok`) or why it is left out (`Err`).
    pub reasons: Vec<(Stage, Result<&'static str, &'static str>)>,
    /// Preconditioner of the PPE: [`Preconditioner::Jacobi`] or [`Preconditioner::Multigrid`].
    pub preconditioner: Preconditioner,
    /// Under-relaxation of the fluid's force on bodies: F <- s F + (1 - s) F_old with this s; 1 for none.
    pub force_relaxation: f64,
    /// Where the pairs of contact are computed.
    pub contact: ContactPlan,
    /// Whether the energy ledger is kept.
    pub ledger: bool,
}

impl Plan {
    /// Judge `scene`.
    pub fn new(case: &Case, scene: &Scene, params: &Params) -> Self {
        let fluid = scene.groups.fluid > 0;
        let moving = !scene.solids.is_empty();
        let free = scene.solids.iter().any(|s| matches!(s.drive, Drive::Free(_)));
        let wet = |why| if fluid { Ok(why) } else { Err("no fluid") };
        let reasons = Stage::ALL.map(|stage| {
            let reason = match stage {
                Stage::Viscosity if params.viscosity == 0.0 => Err("viscosity is zero"),
                Stage::Viscosity => wet("viscosity is given"),
                Stage::MoveSolids if !moving => Err("nothing solid moves"),
                Stage::MoveSolids => wet("solids move in the fluid"),
                Stage::Collision if params.collision_distance == 0.0 => Err("collision distance is zero"),
                Stage::Collision => wet("particles may come too close"),
                Stage::BodyForce if !moving => Err("nothing solid moves"),
                Stage::BodyForce if !free && case.gauge.force.is_empty() && !case.output.ledger => {
                    Err("no body is free and no gauge asks for a force")
                }
                Stage::BodyForce => wet("the fluid acts on solids"),
                Stage::Contact if !moving => Err("nothing solid moves"),
                Stage::Contact if !free => Ok("solids follow their tables of motion"),
                Stage::Contact => Ok("bodies move"),
                _ => wet("fluid"),
            };
            (stage, reason)
        });
        let unknowns = scene.groups.fluid;
        let asked = case.fluid.as_ref().map_or(Preconditioner::Jacobi, |f| f.solver.preconditioner);
        let preconditioner = match asked {
            Preconditioner::Auto if unknowns >= MULTIGRID_UNKNOWNS => Preconditioner::Multigrid,
            Preconditioner::Auto => Preconditioner::Jacobi,
            typed => typed,
        };
        // With the velocity in the source, a body much lighter than the water it moves is thrown to and fro by
        // its own added mass; the plain number density source is slow enough not to.
        let lightest = scene
            .solids
            .iter()
            .filter_map(|s| match (&s.drive, s.shape) {
                (Drive::Free(b), crate::scene::Shape::Box { half }) => {
                    let depth = if scene.dimensions == 2 { scene.spacing } else { 2.0 * half.y };
                    Some(b.mass / (4.0 * half.x * half.z * depth * params.density))
                }
                _ => None,
            })
            .fold(f64::INFINITY, f64::min);
        let light = if scene.dimensions == 2 { LIGHT_2D } else { LIGHT_3D };
        let force_relaxation = if fluid && params.source == Source::Mixed && lightest < light {
            relaxation(lightest)
        } else {
            1.0
        };
        let asked = case.contact.as_ref().map_or(ContactDevice::Host, |c| c.device);
        let contact = ContactPlan::judge(case, scene, asked);
        let ledger = case.output.ledger;
        Self { reasons: reasons.to_vec(), preconditioner, force_relaxation, contact, ledger }
    }

    /// Whether `stage` runs.
    pub fn has(&self, stage: Stage) -> bool {
        self.reasons.iter().any(|(s, why)| *s == stage && why.is_ok())
    }

    /// `jacobi` or `multigrid`.
    pub fn preconditioner_name(&self) -> &'static str {
        if self.preconditioner == Preconditioner::Multigrid { "multigrid" } else { "jacobi" }
    }

    /// Whether the scene has fluid to compute.
    pub fn wet(&self) -> bool {
        self.has(Stage::Predict)
    }
}
