//! Constants of a run: the scheme's switches, what follows from the initial lattice, the step's coefficients.

use crate::case::{self, Case, Fluid, Preset};
use crate::error::{Error, Result};
use crate::lattice::{Lattice, Shear};
use crate::neighbours::capacity;
use crate::periodic::Periodic;
use crate::scene::Scene;
use crate::scheme::{Collision, FreeSurface, Gradient, Source};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// How gamma of Eq. (8) follows from the time step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Relaxation {
    /// A typed number [-].
    Fixed(f64),
    /// gamma = (c_s dt / l0)^2, at most 0.5, from a reference speed c_s [m/s]. Unlike a fixed gamma it
    /// leaves the answer nearly independent of the time step.
    Speed(f64),
}

/// Derived c_s over the speed of the flow. A slow one leaves calm water calm, a fast one keeps violent water from crowding.
const SOUND_OVER_FLOW: f64 = 2.5;
/// Least part of the derived c_s that a calm flow has.
const CALM: f64 = 0.5;
/// nu / (l0 sqrt(g l0)) from which on that part falls, as its inverse: what the correction moves would drown creeping flow.
const THICK: f64 = 0.03;
/// Where its fall ends, over `CALM`: with less thick water sinks while it stands still.
const CREEP: f64 = 0.2;

/// nu / (l0 sqrt(g l0)) from which on the whole viscous stress acts on a free surface: in water it is lost in what else damps.
const STRESSED: f64 = 0.01;

/// c_s^2 of creeping flow over nu v / l0, at least: in steps as long as viscosity allows, 0.16 l0^2 / nu, a density error is undone at half of
/// v / l0 then, about as fast as the flow makes one. c_s of the flow alone would leave next to nothing of it in such short steps.
const CREEPING: f64 = 3.0;

/// Reach of the pressure within a step over the water's depth: what is missing at the floor of still water,
/// 1 - tanh(1 / 5) 5 = 1.3 %, the density has to make up for.
const REACH: f64 = 5.0;
/// The same over the spacing, at most: alpha adds 1e-6 of itself to a row's diagonal.
const REACH_MAX: f64 = 500.0;

/// C_f of walls unless typed: smooth ones at the Reynolds numbers of a laboratory's dam break, 1e5 to 1e6 [-].
const WALL_FRICTION: f64 = 0.0025;

/// Largest gamma that [`Relaxation::Speed`] gives. The density error oscillates with
/// omega dt = sqrt(gamma), unstable from 2 on; noise grows well before.
pub const RELAXATION_MAX: f64 = 0.5;

/// Height that a wave has left of itself beyond the absorber and back, over its height, is exp(-THROUGH / 3): a rate
/// sigma takes sigma / (2 c_g) of it a metre, the mean of s^2 is a third and c_g is sqrt(g d) at most.
const THROUGH: f64 = 12.0;

/// A box in which the water comes to rest, see [`crate::kernels::absorber`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Zone {
    /// Lower corner [m].
    pub low: DVec3,
    /// Upper corner [m].
    pub high: DVec3,
    /// A place where the damping begins [m].
    pub start: DVec3,
    /// Gradient of the way s from there to the far end [1/m].
    pub ramp: DVec3,
    /// Largest rate of damping [1/s].
    pub rate: f64,
}

impl Zone {
    /// That of a case; `head` is gravity times depth [m2/s2].
    fn new(absorber: &case::Absorber, dimensions: u32, head: f64) -> Self {
        let (mut low, mut high): (DVec3, DVec3) = (absorber.min.into(), absorber.max.into());
        if dimensions == 2 {
            (low.y, high.y) = (-1.0, 1.0);
        }
        let ((axis, up), length) = (absorber.way(), absorber.length());
        let start = if up { low } else { high };
        let mut ramp = DVec3::ZERO;
        ramp[axis] = if up { 1.0 / length } else { -1.0 / length };
        let rate = absorber.rate.unwrap_or(THROUGH * head.sqrt() / length);
        Self { low, high, start, ramp, rate }
    }
}

/// Of the bodies that the water takes along the fastest, by viscosity and by friction.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Drag {
    /// Rate by viscosity [1/s].
    pub viscous: f64,
    /// Rate by the friction of its walls over the speed of the water past it [1/m].
    pub friction: f64,
    /// Names of the two.
    pub bodies: [String; 2],
}

impl Drag {
    /// The rate in water that goes past at `speed` [m/s] [1/s].
    pub fn rate(&self, speed: f64) -> f64 {
        self.viscous + self.friction * speed
    }

    /// Name of the body that has most of it.
    pub fn body(&self, speed: f64) -> &str {
        &self.bodies[usize::from(self.friction * speed > self.viscous)]
    }
}

/// Constants of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Params {
    /// 2 or 3, d of Eqs. (5) and (6).
    pub dimensions: u32,
    /// Initial spacing l0 [m].
    pub spacing: f64,
    /// Effective radius re [m].
    pub effective_radius: f64,
    /// Initial number density n0 [-].
    pub number_density: f64,
    /// lambda, Eq. (7) [m2].
    pub laplacian: f64,
    /// Sum W0 of the smooth density on the full lattice [-].
    pub smooth_density: f64,
    /// Neighbours of a particle on the full lattice.
    pub neighbours: u32,
    /// Neighbours that a row holds at most, [`capacity`].
    pub row_capacity: usize,
    /// Gravity, without what of it lies along periodic axes [m/s2]: what a pressure at rest balances.
    pub gravity: DVec3,
    /// What of gravity lies along periodic axes [m/s2]: no pressure balances it, it drives the flow.
    pub drive: DVec3,
    /// Density of the fluid [kg/m3].
    pub density: f64,
    /// Kinematic viscosity [m2/s].
    pub viscosity: f64,
    /// Weight of explicit viscosity: its sums over the lattice.
    pub shear: Shear,
    /// [`Lattice::wall_contact`].
    pub wall_contact: f64,
    /// [`Lattice::wall_room`].
    pub wall_room: f64,
    /// [`Lattice::wall_depth`].
    pub wall_depth: f64,
    /// Wall-layer particles of bodies; their slots follow those of the fluid.
    pub body_wall: usize,
    /// Friction of walls, C_f over l0 and [`Lattice::wall_contact`] [1/m].
    pub wall_friction: f64,
    /// How fast the water takes bodies along: of [`crate::drag::params`], else zero.
    pub drag: Drag,
    /// Free-surface threshold beta [-]; 0, which no density is below, where the water fills all its room.
    pub free_surface_threshold: f64,
    /// Whether the water fills all its room and stays so: there is no free surface, and the pressure has no level.
    pub filled: bool,
    /// Source term of the PPE.
    pub source: Source,
    /// Pressure gradient.
    pub gradient: Gradient,
    /// Free-surface test.
    pub free_surface: FreeSurface,
    /// Speed of the fastest water at t = 0 [m/s].
    pub speed_at_start: f64,
    /// gamma of Eq. (8), typed or from a speed.
    pub relaxation: Relaxation,
    /// Whether its speed is the largest of a derived one, which follows the flow.
    pub follows_flow: bool,
    /// Whether water pulls.
    pub suction: bool,
    /// alpha of Eq. (8) [1/Pa], if typed.
    pub compressibility: Option<f64>,
    /// How colliding pairs share their impulses.
    pub collision: Collision,
    /// Distance below which approaching particles collide, a l0 [m].
    pub collision_distance: f64,
    /// Restitution b of the collision, Eq. (18) [-].
    pub collision_restitution: f64,
    /// Where the water comes to rest.
    pub absorbers: Vec<Zone>,
    /// Depth of the water at the start [m].
    pub depth: f64,
    /// Lower corner of the domain [m].
    pub domain_min: DVec3,
    /// Upper corner of the domain [m].
    pub domain_max: DVec3,
    /// Sides that the water leaves through to come in at the opposite one.
    pub periodic: Periodic,
}

/// Coefficients of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Time at the start of the step [s].
    pub time: f64,
    /// Time step [s].
    pub dt: f64,
    /// From the start of the step to the positions r* at which forces are found [s].
    pub ahead: f64,
    /// gamma of Eq. (8) [-].
    pub relaxation: f64,
    /// alpha of Eq. (8) [1/Pa].
    pub compressibility: f64,
    /// Pressure at which the clamp acts [Pa].
    pub pressure_max: f64,
    /// Pressure below which it is cut [Pa]: 0 where water does not pull.
    pub pressure_min: f64,
    /// Speed by which particles at rest shift, over the imbalance [m/s].
    pub shift_speed: f64,
}

impl Step {
    /// The same with forces at its end.
    pub fn whole(self) -> Self {
        Self { ahead: self.dt, ..self }
    }

    /// What is left of it after the forces [s].
    pub fn rest(&self) -> f64 {
        self.dt - self.ahead
    }

    /// How long a change of velocity moves a particle for itself [s]: for the whole step where forces are at its end; else what is left
    /// of the way is gone with the new velocity.
    pub fn carried(&self) -> f64 {
        if self.ahead == self.dt { self.dt } else { 0.0 }
    }
}

/// c_s where none is typed [m/s], for gravity `g` [m/s2], spacing `l0` and depth [m].
fn derived_speed(g: f64, l0: f64, depth: f64) -> f64 {
    // 1 % compression of the wall layer in hydrostatics, and well above the speed of the collapse.
    (100.0 * g * l0).sqrt().max(2.5 * (g * depth).sqrt()).max(1e-6)
}

impl Params {
    /// Constants of `case` as built into `scene`.
    pub fn new(case: &Case, scene: &Scene) -> Result<Self> {
        let run = &case.run;
        let (d, re) = (run.dimensions, run.effective_radius);
        let lattice = Lattice::new(d, re);
        if lattice.number_density == 0.0 {
            let message =
                format!("run.effective_radius = {}: no lattice neighbour lies inside", run.effective_radius);
            return Err(Error::key("run.effective_radius", message, "use 2.1 to 2.6"));
        }
        let l0 = run.spacing;
        let fluid = case.fluid.as_ref();
        let paper = fluid.is_some_and(|f| f.preset == Preset::Paper);
        let (gravity, periodic) = (scene.periodic.across(scene.gravity), scene.periodic);
        let g = gravity.length();
        let derived_speed = derived_speed(g, l0, scene.depth);
        let relaxation = match fluid.map(|f| (f.relaxation, f.sound_speed)) {
            Some((Some(gamma), _)) => Relaxation::Fixed(gamma),
            Some((None, Some(c))) => Relaxation::Speed(c),
            _ => Relaxation::Speed(derived_speed),
        };
        let source = fluid.map_or(Source::Mixed, Fluid::source);
        let typed = fluid.is_some_and(|f| f.relaxation.is_some() || f.sound_speed.is_some());
        // Without weight the flow alone tells how fast, whatever the source.
        let follows_flow = (source == Source::Mixed || g == 0.0) && !typed;
        // The paper's source takes the density's deviation for the pressure: its mean is the level.
        let filled = scene.filled && source == Source::Mixed;
        let friction = fluid.and_then(|f| f.wall_friction).unwrap_or(if paper { 0.0 } else { WALL_FRICTION });
        Ok(Self {
            dimensions: run.dimensions,
            spacing: l0,
            effective_radius: re * l0,
            number_density: lattice.number_density,
            laplacian: lattice.laplacian * l0 * l0,
            smooth_density: lattice.smooth_density,
            neighbours: lattice.neighbours,
            row_capacity: capacity(
                lattice.neighbours,
                scene.solids.iter().any(|s| !s.is_free() && !s.is_still()),
            ),
            gravity,
            drive: scene.gravity - gravity,
            density: fluid.map_or(1000.0, |f| f.density),
            viscosity: fluid.map_or(0.0, |f| f.viscosity),
            shear: fluid.map_or_else(|| Shear::paper(d, re), |f| f.shear(d, re)),
            wall_contact: lattice.wall_contact,
            wall_room: lattice.wall_room,
            wall_depth: lattice.wall_depth,
            body_wall: scene.solids.iter().filter(|s| s.is_body).map(|s| s.wall_slots.len()).sum(),
            wall_friction: friction / (l0 * lattice.wall_contact),
            drag: Drag::default(),
            free_surface_threshold: if filled {
                0.0
            } else {
                fluid.map_or(0.97, |f| f.free_surface_threshold)
            },
            filled,
            source,
            gradient: fluid.map_or(Gradient::Consistent, Fluid::gradient),
            free_surface: fluid.map_or(FreeSurface::ThresholdOffset, Fluid::free_surface),
            speed_at_start: scene.fastest(),
            relaxation,
            follows_flow,
            suction: fluid.is_some_and(|f| f.suction),
            compressibility: fluid.and_then(|f| f.compressibility),
            collision: if paper { Collision::Single } else { Collision::Shared },
            collision_distance: fluid.map_or(0.8, |f| f.collision_distance) * l0,
            collision_restitution: fluid.map_or(0.2, |f| f.collision_restitution),
            absorbers: case.absorber.iter().map(|a| Zone::new(a, run.dimensions, g * scene.depth)).collect(),
            depth: scene.depth,
            domain_min: scene.domain.0,
            domain_max: scene.domain.1,
            periodic,
        })
    }

    /// Depth below the water's surface at which P = 0 holds [m].
    pub fn zero_pressure_depth(&self) -> f64 {
        self.source.zero_pressure_depth(self.spacing)
    }

    /// Slots below this carry pressure to a wall, of `fluid` slots of water and `pressure` with the walls: in the paper's
    /// scheme walls too, though no water flows along their layer.
    pub fn wall_carriers(&self, fluid: usize, pressure: usize) -> usize {
        match self.source {
            Source::NumberDensity => pressure,
            Source::Mixed => fluid,
        }
    }

    /// Gravity of the explicit stage [m/s2]: none where it acts together with the pressure that balances it.
    pub fn explicit_gravity(&self) -> DVec3 {
        match self.source {
            Source::NumberDensity => self.gravity + self.drive,
            Source::Mixed => self.drive,
        }
    }

    /// Gravity that acts together with the pressure that balances it [m/s2].
    pub fn balanced_gravity(&self) -> DVec3 {
        match self.source {
            Source::NumberDensity => DVec3::ZERO,
            Source::Mixed => self.gravity,
        }
    }

    /// c_s over the one that is derived if none is typed [-]; 1 without weight, which derives none.
    pub fn sound_over_derived(&self) -> f64 {
        let g = self.gravity.length();
        match self.relaxation {
            Relaxation::Speed(c) if g > 0.0 => c / derived_speed(g, self.spacing, self.depth),
            _ => 1.0,
        }
    }

    /// Reference speed c_s [m/s] for a time step `dt` [s].
    pub fn sound_speed(&self, dt: f64) -> f64 {
        match self.relaxation {
            Relaxation::Fixed(gamma) => gamma.sqrt() * self.spacing / dt,
            Relaxation::Speed(c) => c,
        }
    }

    /// gamma of Eq. (8) in a step of `dt` [s] of water whose fastest has the speed `flow`, among solids and openings whose fastest has the
    /// speed `driven` [m/s].
    pub fn relaxation(&self, dt: f64, flow: f64, driven: f64) -> f64 {
        match self.relaxation {
            Relaxation::Fixed(gamma) => gamma,
            Relaxation::Speed(c) => {
                // Without weight only the flow says how fast. What plunges into water that is slower presses it together before that
                // has taken its speed.
                let most = if self.gravity == DVec3::ZERO { f64::INFINITY } else { c };
                let c = if self.follows_flow {
                    let creeping = (CREEPING * self.viscosity * flow.max(driven) / self.spacing).sqrt();
                    let calm = CALM * c * (THICK / self.thickness()).clamp(CREEP, 1.0);
                    let c = (SOUND_OVER_FLOW * flow).clamp(calm, most).max(SOUND_OVER_FLOW * driven);
                    c.max(creeping)
                } else {
                    c
                };
                (c * dt / self.spacing).powi(2).min(RELAXATION_MAX)
            }
        }
    }

    /// Viscosity over what a spacing's fall under gravity makes of a spacing, nu / (l0 sqrt(g l0)) [-]; 0 without gravity.
    fn thickness(&self) -> f64 {
        let fall = self.spacing * (self.gravity.length() * self.spacing).sqrt();
        if fall > 0.0 { self.viscosity / fall } else { 0.0 }
    }

    /// Whether viscosity is more than the Laplacian: where there is a free surface that feels it, in the accurate scheme.
    pub fn surface_stress(&self) -> bool {
        let felt = self.gravity == DVec3::ZERO || self.thickness() > STRESSED;
        self.viscosity > 0.0 && felt && !self.filled && self.source == Source::Mixed
    }

    /// Largest extent of the domain [m].
    fn extent(&self) -> f64 {
        (self.domain_max - self.domain_min).max_element()
    }

    /// Volume of a fluid particle [m3]; in two dimensions of a slice l0 wide.
    pub fn particle_volume(&self) -> f64 {
        self.spacing.powi(3)
    }

    /// Mass of a fluid particle [kg].
    pub fn particle_mass(&self) -> f64 {
        self.density * self.particle_volume()
    }

    /// alpha of Eq. (8) for a step of `dt` [s] [1/Pa]; never 0, or the pressure of a closed pocket has no level, and as small as the relaxation
    /// lets it be, or the weight of the water presses it together in short steps.
    fn derived_compressibility(&self, dt: f64, relaxation: f64) -> f64 {
        let head = self.gravity.length() * self.depth;
        match self.source {
            // 0.1 % bulk compression.
            Source::NumberDensity if head > 0.0 => 1e-3 * relaxation / (self.density * head),
            Source::NumberDensity => 1e-9,
            Source::Mixed => (dt / self.pressure_reach()).powi(2) / self.density,
        }
    }

    /// How far a pressure is felt within a step, dt / sqrt(rho alpha), where alpha is derived [m]. As far as single
    /// precision can tell alpha from 0 it is several times the water's depth.
    fn pressure_reach(&self) -> f64 {
        let farthest = REACH_MAX * self.spacing;
        if self.depth > 0.0 { (REACH * self.depth).min(farthest) } else { farthest }
    }

    /// Whether pressures are below that of the air somewhere.
    fn pulls(&self) -> bool {
        self.filled || self.suction
    }

    /// Speed by which the shift goes [m/s] in water as fast as `speed` [m/s]: that of a spacing's waves, and where water pulls its own.
    pub fn shift_speed(&self, speed: f64) -> f64 {
        (self.gravity.length() * self.spacing).sqrt() + if self.pulls() { speed } else { 0.0 }
    }

    /// Coefficients of a step of `dt` [s] that starts at `time` [s]; `speed` is the largest expected of the water, of solids that are driven and of
    /// openings [m/s].
    pub fn step(&self, time: f64, dt: f64, speed: f64) -> Step {
        let relaxation = self.relaxation(dt, speed, 0.0);
        let head = self.gravity.length() * self.depth;
        let compressibility =
            self.compressibility.unwrap_or_else(|| self.derived_compressibility(dt, relaxation));
        let ahead = if self.source == Source::Mixed && !self.pulls() {
            // Half a step, the change of velocity, half a step with the new one: of second order, and it damps no oscillation.
            0.5 * dt
        } else {
            // Semi-implicit MPS: r* is the end of the step, and what changes a velocity there moves the particle as well. Where water
            // pulls, without a surface or by suction, and without that damping particles crowd, or splashes are thrown apart.
            dt
        };
        let c = self.sound_speed(dt);
        // A slam: up to 31 rho v^2. A wedge of 10 degrees comes to 40, what falls flat to more: such peaks are cut, and counted.
        let slam = (SOUND_OVER_FLOW * speed).powi(2);
        // Viscosity: over the length of the domain in gaps of a spacing.
        let viscous = self.viscosity * speed * self.extent() / self.spacing.powi(2);
        // Where there is no weight, or no room to give way, a jolt makes the pressure, rho v L / dt.
        let jolt = if head > 0.0 && !self.filled { 0.0 } else { speed / dt };
        let driven = self.extent() * (self.drive.length() + jolt);
        // c_s is never 0: the noise of water at rest is not cut.
        let most = (c * c).max(head).max(viscous).max(driven);
        let pressure_max = 5.0 * self.density * most.max(slam);
        let pressure_min = if self.suction { -pressure_max } else { 0.0 };
        let shift_speed = self.shift_speed(speed);
        Step { time, dt, ahead, relaxation, compressibility, pressure_max, pressure_min, shift_speed }
    }
}
