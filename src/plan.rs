//! Which stages and arrays a scene needs. The only place where that is judged: what is not planned is not compiled,
//! not allocated and not run.

use crate::case::{self, Case, ContactDevice, stands_for};
use crate::compute::Program;
use crate::contact;
use crate::error::{Error, Result};
use crate::params::Params;
use crate::scene::{Scene, Solid};
use crate::scheme::{Gradient, Preconditioner, Source};

macro_rules! stages {
    ($($(#[$doc:meta])* $name:ident = $text:literal [$($particles:ident)?];)*) => {
        /// A stage of the time step. Its name is the name of the kernel, of the timing and of the test.
        #[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, PartialOrd, Ord)]
        pub enum Stage {
            $($(#[$doc])* $name,)*
        }

        /// A stage that sweeps over the particles and needs nothing but the step's coefficients: what
        /// [`crate::backend::Backend::run`] takes. The others have calls of their own.
        #[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        pub enum ParticleStage {
            $($(#[doc = concat!("`", $text, "`")] $particles,)?)*
        }

        impl Stage {
            /// All stages, in the order of the step.
            pub const ALL: [Self; [$($text),*].len()] = [$(Self::$name),*];

            /// Name, as in the kernel's file.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)*
                }
            }

            /// The stage as one that sweeps over the particles, if it is one.
            pub fn over_particles(self) -> Option<ParticleStage> {
                match self {
                    $($(Self::$particles => Some(ParticleStage::$particles),)?)*
                    _ => None,
                }
            }
        }

        impl ParticleStage {
            /// All of them, in the order of the step.
            pub const ALL: &'static [Self] = &[$($(Self::$particles,)?)*];

            /// From places to the pressure equation, where neither viscosity nor collisions count.
            pub const TO_SOURCE: [Self; 4] =
                [Self::CellList, Self::NeighbourList, Self::NumberDensity, Self::PressureSource];
        }

        impl From<ParticleStage> for Stage {
            fn from(stage: ParticleStage) -> Self {
                match stage {
                    $($(ParticleStage::$particles => Self::$particles,)?)*
                }
            }
        }
    };
}

// A step plays them in this order. In brackets: once more if the stage sweeps over the particles.
stages! {
    /// The water comes to rest in absorbers.
    Absorber = "absorber" [Absorber];
    /// Explicit viscosity, Eq. (2): acceleration at the positions and neighbours of the last step.
    Viscosity = "viscosity" [Viscosity];
    /// Explicit part of Eq. (2): viscosity and gravity move particles to r*.
    Predict = "predict" [Predict];
    /// Water comes in and goes out through the tank's walls.
    Openings = "openings" [];
    /// Solids go where they would go without the fluid.
    MoveSolids = "move_solids" [];
    /// Sort by cell at r*.
    CellList = "cell_list" [CellList];
    /// Neighbours at r*.
    NeighbourList = "neighbour_list" [NeighbourList];
    /// Friction on walls whose boundary layer is thinner than a spacing.
    WallFriction = "wall_friction" [WallFriction];
    /// Particles that come too close rebound, Eq. (18).
    Collision = "collision" [Collision];
    /// Number density, Eq. (4), and free surface.
    NumberDensity = "number_density" [NumberDensity];
    /// Pressure of the free surface's particles, whose centres lie half a spacing below it.
    SurfacePressure = "surface_pressure" [SurfacePressure];
    /// Right side and diagonal of the pressure Poisson equation (PPE), Eq. (8).
    PressureSource = "pressure_source" [PressureSource];
    /// Solution of the PPE.
    ConjugateGradient = "conjugate_gradient" [];
    /// Pressure gradient, Eq. (9).
    PressureGradient = "pressure_gradient" [PressureGradient];
    /// It corrects velocity and position.
    Correct = "correct" [Correct];
    /// Particles move away from where they crowd.
    Shift = "shift" [Shift];
    /// Force of the fluid on solids.
    BodyForce = "body_force" [];
    /// Contact and motion of the bodies, Eqs. (10) to (14); sums, friction and motion on the host.
    Contact = "contact" [];
}

/// Arrays that go together: a scene has all of a group or none.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, PartialOrd, Ord)]
pub enum Arrays {
    /// Of the fluid and its search.
    Fluid,
    /// Of solids that move in the fluid.
    Solids,
    /// Of solids that turn, whose surfaces viscosity and friction act on.
    Turning,
    /// Of walls that never move.
    FixedWalls,
    /// How unevenly neighbours lie, for the shift.
    Imbalance,
    /// Pressure of the free surface's particles.
    SurfacePressure,
    /// Of the pressure's level where there is no free surface: none of its own.
    Level,
    /// Of the fluid's force on solids.
    Force,
    /// Force of viscosity, friction and collisions on walls, which the fluid's force takes in.
    Reaction,
    /// What walls' pressures are above those on their surface.
    Excess,
    /// Levels of the multigrid preconditioner.
    Multigrid,
    /// Of free bodies in the pressure equation.
    Coupling,
    /// Of the energy ledger.
    Ledger,
    /// Of boxes in which the water comes to rest.
    Absorber,
    /// Of openings through which water comes in and goes out.
    Openings,
}

/// Particles of water from which multigrid pays on either processor: below, an iteration of it costs more than it saves.
pub(crate) const MULTIGRID_UNKNOWNS: usize = 8_000;

/// Surface points of bodies that move freely from which the device searches and presses their contacts. A sub-step
/// costs a round trip to the device, 0.1 ms or so, however many bodies there are; the host takes 2.4 us for a cube
/// of 200 points at rest, of which the smooth law's edges and the poses, 1.5 us, stay on it. The two meet at about a
/// hundred bodies, which this is. It counts points and no microseconds, so that the same case computes in the same
/// way on every machine.
pub(crate) const DEVICE_CONTACT_POINTS: usize = 20_000;

/// Where a backend with a device searches and presses the pairs of contact; a backend without one leaves it to the
/// host.
#[derive(Clone, Debug, Default)]
pub struct ContactPlan {
    /// What the device runs; `None`: contact is computed on the host.
    pub program: Option<&'static Program>,
    /// Why.
    pub reason: String,
}

impl ContactPlan {
    /// On the device, whatever the size of the scene; for comparisons. Nothing changes where the device has no
    /// kernel for the law.
    pub fn on_device(case: &Case, scene: &Scene) -> Self {
        Self::judge(case, scene, ContactDevice::Gpu)
    }

    /// Refuses a case that asks for a device which has no kernel for its contact: `plan` and `run` ask the same.
    ///
    /// # Errors
    /// [`crate::error::Error::Case`] with the reason.
    pub fn refuse(&self, case: &Case, scene: &Scene) -> Result<()> {
        let asked = case.contact.as_ref().is_some_and(|c| c.device == ContactDevice::Gpu);
        if !asked || self.program.is_some() || !scene.solids.iter().any(Solid::gives_way) {
            return Ok(());
        }
        let message = format!("contact.device = \"gpu\": {}", self.reason);
        Err(Error::key("contact.device", message, "leave `device` out: contact is on the host then"))
    }

    fn judge(case: &Case, scene: &Scene, asked: ContactDevice) -> Self {
        let host = |reason: &str| Self { program: None, reason: reason.into() };
        let free = |s: &&Solid| s.gives_way();
        let points: usize = scene.solids.iter().filter(free).map(|s| s.wall_offset.len()).sum();
        let Some(kind) = case.contact.as_ref().map(|c| contact::kind(c.law)) else {
            return host("no contact");
        };
        let program = match (kind.program)(scene) {
            Ok(program) => Some(program),
            Err(why) => return host(why),
        };
        let most = DEVICE_CONTACT_POINTS;
        match asked {
            _ if points == 0 => host("no body is free"),
            ContactDevice::Host => host("contact.device = \"host\""),
            ContactDevice::Gpu => Self { program, reason: "contact.device = \"gpu\"".into() },
            ContactDevice::Auto if points < most => {
                host(&format!("{points} surface points, below {most} a round trip to a device costs more"))
            }
            ContactDevice::Auto if !kind.device_tells_walls_apart && on_fixed(case, scene) => host(
                "a force gauge is on a fixed wall, and by this law a device does not tell what presses on which",
            ),
            ContactDevice::Auto => {
                Self { program, reason: format!("{points} surface points, {most} or more") }
            }
        }
    }
}

/// Whether a force gauge is on a fixed wall.
fn on_fixed(case: &Case, scene: &Scene) -> bool {
    case.gauge.force.iter().any(|gauge| scene.walls.iter().any(|wall| stands_for(&gauge.on, &wall.name)))
}

/// Walls of which something is told beside the pressure of their rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Told {
    /// None.
    None,
    /// Those that move: bodies are moved by it.
    Moving,
    /// All: gauges ask.
    All,
}

impl Told {
    /// Rows of them in a scene of `walls`, of which the first `moving` move.
    pub fn rows(self, walls: usize, moving: usize) -> usize {
        match self {
            Self::None => 0,
            Self::Moving => moving,
            Self::All => walls,
        }
    }
}

/// The stages that act on walls beside the pressure, in their order.
const REACTING: [Stage; 3] = [Stage::Viscosity, Stage::WallFriction, Stage::Collision];

/// Why a stage runs, or why it is left out.
type Reason = (Stage, std::result::Result<&'static str, &'static str>);

/// Whether `stage` runs by the `reasons` of all.
fn runs(reasons: &[Reason], stage: Stage) -> bool {
    reasons.iter().any(|(s, why)| *s == stage && why.is_ok())
}

/// What a scene needs.
#[derive(Clone, Debug)]
pub struct Plan {
    /// For each stage of [`Stage::ALL`]: why it runs (`Ok`) or why it is left out (`Err`).
    pub reasons: Vec<Reason>,
    /// Preconditioner of the PPE.
    pub preconditioner: Preconditioner,
    /// Whether bodies move in the fluid as its pressure acts on them. With the paper's source, the number density alone,
    /// they follow the pressure a step later, as in the paper.
    pub coupled: bool,
    /// Whether slots of solids that no force moves are looked for: where forces are told of these, or of walls before them.
    pub held: bool,
    /// Of which walls the pressure on the surface is told, where their rows undo a divergence.
    pub excess: Told,
    /// Of which walls it is told what viscosity, friction and collisions of the water do to them.
    pub reaction: Told,
    /// Where the pairs of contact are computed.
    pub contact: ContactPlan,
    /// Whether the water fills all its room, so that the pressure needs a level.
    pub filled: bool,
    /// Whether the energy ledger is kept.
    pub ledger: bool,
    /// Whether walls that never move line the fluid.
    pub fixed_walls: bool,
    /// Whether solids turn in water that viscosity or friction takes along with their surface. In the paper's scheme walls are as water.
    pub turning: bool,
}

impl Plan {
    /// Judge `scene`.
    pub fn new(case: &Case, scene: &Scene, params: &Params) -> Self {
        let fluid = scene.groups.fluid > 0;
        let moving = !scene.solids.is_empty();
        let free = scene.solids.iter().any(Solid::is_free);
        let gauged = case.gauge.force.iter().any(|g| scene.solids.iter().any(|s| stands_for(&g.on, &s.name)));
        // Of a body that is driven the tables tell the force as of one that is free.
        let told = free || gauged || !case.body.is_empty();
        let wet = |why| if fluid { Ok(why) } else { Err("no fluid") };
        let reasons = Stage::ALL.map(|stage| {
            let reason = match stage {
                Stage::Absorber if params.absorbers.is_empty() => Err("no absorber"),
                Stage::Absorber => wet("waves run into absorbers"),
                Stage::Openings if scene.openings.is_empty() => Err("no inflow and no outflow"),
                Stage::Openings => wet("water comes in or goes out"),
                Stage::Viscosity if params.viscosity == 0.0 => Err("viscosity is zero"),
                Stage::Viscosity => wet("viscosity is above zero"),
                Stage::MoveSolids if !moving => Err("nothing solid moves"),
                Stage::MoveSolids => wet("solids move in the fluid"),
                Stage::WallFriction if params.wall_friction == 0.0 => Err("the friction of walls is zero"),
                Stage::WallFriction if scene.groups.pressure() == scene.groups.fluid => Err("no walls"),
                Stage::WallFriction => wet("water slides along walls"),
                Stage::Collision if params.collision_distance == 0.0 => Err("collision distance is zero"),
                Stage::Collision => wet("particles may come too close"),
                Stage::Shift if params.gradient == Gradient::Minimum => {
                    Err("the repulsion of the minimum-pressure gradient spaces the particles")
                }
                Stage::Shift => wet("the consistent gradient leaves it to the shift to space the particles"),
                Stage::SurfacePressure if params.gradient == Gradient::Minimum => {
                    Err("the minimum-pressure gradient takes P = 0 at the centres of the surface's particles")
                }
                Stage::SurfacePressure if params.filled => Err("the water fills all its room"),
                Stage::SurfacePressure => wet("P = 0 lies half a spacing outside the surface's particles"),
                Stage::BodyForce if !moving => Err("nothing solid moves"),
                Stage::BodyForce if !told && !case.output.ledger => {
                    Err("there is no body and no gauge asks for the force on a wall that moves")
                }
                Stage::BodyForce => wet("the fluid acts on solids"),
                Stage::Contact if !moving => Err("nothing solid moves"),
                Stage::Contact if !free => Ok("solids follow their tables of motion"),
                Stage::Contact => Ok("bodies move"),
                Stage::Predict
                | Stage::CellList
                | Stage::NeighbourList
                | Stage::NumberDensity
                | Stage::PressureSource
                | Stage::ConjugateGradient
                | Stage::PressureGradient
                | Stage::Correct => wet("fluid"),
            };
            (stage, reason)
        });
        let unknowns = scene.groups.fluid;
        let asked = case.fluid.as_ref().map_or(case::Preconditioner::Jacobi, |f| f.solver.preconditioner);
        let preconditioner = match asked {
            case::Preconditioner::Multigrid => Preconditioner::Multigrid,
            case::Preconditioner::Auto if unknowns >= MULTIGRID_UNKNOWNS => Preconditioner::Multigrid,
            case::Preconditioner::Auto | case::Preconditioner::Jacobi => Preconditioner::Jacobi,
        };
        let asked = case.contact.as_ref().map_or(ContactDevice::Host, |c| c.device);
        let contact = ContactPlan::judge(case, scene, asked);
        let coupled = fluid && free && params.source == Source::Mixed;
        let fixed_walls = fluid && !scene.groups.static_range().is_empty();
        let ledger = case.output.ledger;
        let any_held = scene.solids[..scene.followed()].iter().any(|s| !s.is_free());
        let gauges = !case.gauge.pressure.is_empty() || !case.gauge.force.is_empty();
        let held = fluid && any_held && (gauges || ledger) && params.source == Source::Mixed;
        let filled = params.filled;
        let pressed = fluid && moving && (told || ledger);
        let excess = match params.source {
            Source::Mixed if gauges => Told::All,
            Source::Mixed if pressed => Told::Moving,
            _ => Told::None,
        };
        // A rank's part of the scene has no names of fixed walls: what is none of a solid that moves, or stands for several, may be one.
        let of_solid = |on: &str| scene.solids.iter().any(|s| s.name == on);
        let gauges_fixed = case.gauge.force.iter().any(|g| !of_solid(&g.on));
        let has = |stage| runs(&reasons, stage);
        let along = has(Stage::Viscosity) || has(Stage::WallFriction);
        let turning = along && params.source == Source::Mixed && scene.solids.iter().any(Solid::turns);
        let reaction = match REACTING.into_iter().any(has) {
            true if fixed_walls && gauges_fixed => Told::All,
            true if has(Stage::BodyForce) => Told::Moving,
            _ => Told::None,
        };
        Self {
            reasons: reasons.to_vec(),
            preconditioner,
            coupled,
            held,
            excess,
            reaction,
            contact,
            filled,
            ledger,
            fixed_walls,
            turning,
        }
    }

    /// Every stage runs, of a scene with bodies and fixed walls.
    #[cfg(test)]
    pub(crate) fn every_stage() -> Self {
        Self {
            reasons: Stage::ALL.map(|stage| (stage, Ok("planned"))).to_vec(),
            preconditioner: Preconditioner::Multigrid,
            coupled: true,
            held: false,
            excess: Told::All,
            reaction: Told::Moving,
            contact: ContactPlan::default(),
            fixed_walls: true,
            turning: true,
            filled: false,
            ledger: false,
        }
    }

    /// No stage runs.
    #[cfg(test)]
    pub(crate) fn no_stage() -> Self {
        Self {
            reasons: Stage::ALL.map(|stage| (stage, Err("no fluid"))).to_vec(),
            preconditioner: Preconditioner::Jacobi,
            coupled: false,
            held: false,
            excess: Told::None,
            reaction: Told::None,
            fixed_walls: false,
            turning: false,
            ..Self::every_stage()
        }
    }

    /// Whether `stage` runs.
    pub fn has(&self, stage: Stage) -> bool {
        runs(&self.reasons, stage)
    }

    /// The first stage of a step that tells what the water does to walls beside its pressure: what the last step told is forgotten then.
    pub fn first_reacting(&self) -> Option<Stage> {
        REACTING.into_iter().find(|&stage| self.has(stage))
    }

    /// Whether the scene has `arrays`.
    pub fn needs(&self, arrays: Arrays) -> bool {
        match arrays {
            Arrays::Fluid => self.wet(),
            Arrays::Solids => self.has(Stage::MoveSolids),
            Arrays::Turning => self.turning,
            Arrays::FixedWalls => self.fixed_walls,
            Arrays::Imbalance => self.has(Stage::Shift),
            Arrays::SurfacePressure => self.has(Stage::SurfacePressure),
            Arrays::Level => self.filled,
            Arrays::Force => self.has(Stage::BodyForce),
            Arrays::Reaction => self.reaction != Told::None,
            Arrays::Coupling => self.coupled,
            Arrays::Excess => self.wet() && self.excess != Told::None,
            Arrays::Ledger => self.wet() && self.ledger,
            Arrays::Openings => self.has(Stage::Openings),
            Arrays::Absorber => self.has(Stage::Absorber),
            Arrays::Multigrid => self.wet() && self.preconditioner == Preconditioner::Multigrid,
        }
    }

    /// Whether the scene has fluid to compute.
    pub fn wet(&self) -> bool {
        self.has(Stage::Predict)
    }
}
