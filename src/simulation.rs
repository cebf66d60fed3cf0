//! A scene in motion: backend, solids and clock. How it is opened and read is in `open.rs`, [`Simulation::step`] in
//! `step.rs`, what it does to solids in `simulation/solids.rs`, what ends a run before its end in `simulation/guards.rs`,
//! its state in `simulation/archive.rs`.

pub(crate) mod archive;
mod guards;
mod solids;

use crate::backend::{Backend, Counters, Timing};
use crate::body::Wrench;
use crate::case::{Case, ContactDevice, Fluid};
use crate::contact::{ContactReport, Solids};
use crate::cover::driven::DrivenFaces;
use crate::error::{Error, Result};
use crate::ledger::Ledger;
use crate::monitor::FluidMonitor;
use crate::openings::Openings;
use crate::params::{Params, Step};
use crate::plan::{Arrays, ParticleStage, Plan, Stage};
use crate::pressure::{Outcome, PressureReport, Settings};
use crate::scene::{Groups, Scene};
use crate::scheme::Source;
use crate::settle::settle;
use crate::slots::{Pressing, Push, Slots, Voids};
use crate::stop::Stop;
use crate::time_step::{
    Bounds, collapse_speed, collapse_step, looks_every, ready_speed, shortened, time_step,
};
use rayon::ThreadPool;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use std::time::Instant;

/// Time in which gamma comes up beside solids off the lattice, over sqrt(l0 / g), and in steps where there is no gravity.
const EASED: f64 = 1.0;
const EASED_STEPS: f64 = 100.0;

/// What a step did.
#[derive(Clone, Debug, Default)]
pub struct StepReport {
    /// Number of the step, from 0.
    pub step: u64,
    /// Time at its start [s].
    pub time: f64,
    /// Time step [s].
    pub dt: f64,
    /// The PPE.
    pub pressure: PressureReport,
    /// The solids.
    pub contact: ContactReport,
    /// The fluid and the guards, every few steps.
    pub look: Option<(FluidMonitor, Counters)>,
}

/// A scene in motion.
pub struct Simulation {
    /// The case.
    pub case: Case,
    /// What it was built into; particles as they were at t = 0.
    pub scene: Arc<Scene>,
    /// Constants.
    pub params: Params,
    /// Stages.
    pub plan: Plan,
    /// Particles.
    pub backend: Box<dyn Backend>,
    /// Bodies and moving walls.
    pub solids: Solids,
    /// Force of the fluid on each moving solid in the last step.
    pub fluid_force: Vec<Wrench>,
    /// Time [s].
    pub time: f64,
    /// Steps done.
    pub steps: u64,
    /// Of these, steps of the run that it goes on from with `run.from`: what acts at its end is not known here.
    began: u64,
    /// Seconds a stage since the start: by the host's clock, or by the device's as of the last look. Of a device
    /// without a clock only what the host computes, unless `wait_for_stages`.
    pub stages: BTreeMap<Stage, f64>,
    /// Wait for the device after every stage, so that the host's clock tells each one's time.
    pub wait_for_stages: bool,
    /// Sizes of the particle groups.
    pub groups: Groups,
    /// Work of and on the solids, and the energy of the free ones [J], if the ledger is kept.
    solids_ledger: Option<(Ledger, f64)>,
    /// Slots between free bodies and other solids, where free bodies stand in the pressure equation, and those of other solids that the plan asks for.
    slots: Option<Slots>,
    /// Bodies that others enclose, and what the water between presses on each in this step.
    enclosed: Vec<(usize, Wrench)>,
    /// What slots do as bodies come nearer or go, of this step.
    pressings: Vec<Pressing>,
    /// Rows of free bodies that face a room without water, in this step.
    voids: Voids,
    /// What slots press with on what stands opposite, of the step in progress.
    pushes: Vec<Push>,
    /// What that pressed in the last step, by solid and row [Pa].
    pressed: HashMap<(usize, usize), f64>,
    /// Faces of driven solids at which others may stand, where forces are told.
    driven_faces: DrivenFaces,
    /// Where water comes in and goes out.
    pub openings: Openings,
    /// Particles that were gone when last looked.
    gone: u64,
    /// Speed that 99.9 % of the water does not exceed, when last looked [m/s].
    speed: f64,
    /// Speed of the fastest particle, when last looked [m/s].
    fastest: f64,
    pub(crate) stop: Stop,
    pub(crate) threads: Option<ThreadPool>,
}

/// When the PPE's solver stops.
pub(crate) fn settings(case: &Case) -> Settings {
    let solver = case.fluid.as_ref().map(|f: &Fluid| f.solver.clone()).unwrap_or_default();
    Settings {
        tolerance: solver.tolerance,
        max_iterations: solver.max_iterations,
        warm_start: solver.warm_start,
    }
}

impl Simulation {
    /// Set up `scene` of `case` on the backend that `make` returns.
    ///
    /// # Errors
    /// As [`Self::open`], and those of `make`.
    pub fn with_backend(
        case: &Case,
        scene: impl Into<Arc<Scene>>,
        make: impl FnOnce(&Scene, &Params, &Plan, Settings) -> Result<Box<dyn Backend>>,
    ) -> Result<Self> {
        Self::with_shared(case, scene, |scene, params, plan, settings| make(scene, params, plan, settings))
    }

    /// [`Self::with_backend`], of a backend that keeps the scene.
    pub(crate) fn with_shared(
        case: &Case,
        scene: impl Into<Arc<Scene>>,
        make: impl FnOnce(&Arc<Scene>, &Params, &Plan, Settings) -> Result<Box<dyn Backend>>,
    ) -> Result<Self> {
        let scene: Arc<Scene> = scene.into();
        let params = crate::drag::params(case, &scene)?;
        let fastest = params.speed_at_start;
        let plan = Plan::new(case, &scene, &params);
        let settings = settings(case);
        let mut solids = Solids::new(&scene, case.contact.as_ref())?;
        crate::sense::refuse(case, &scene, &params, &solids)?;
        plan.contact.refuse(case, &scene)?;
        let scene = settle(scene, &params, &plan, settings)?;
        let mut backend = make(&scene, &params, &plan, settings)?;
        let device = case.contact.as_ref().map_or(ContactDevice::Host, |c| c.device);
        if device == ContactDevice::Gpu && plan.contact.program.is_some() && backend.compute().is_none() {
            let (message, remedy) = if backend.precision() == "f32" {
                ("contact.device = \"gpu\": on many ranks contact is on the host", "leave contact.device out")
            } else {
                (
                    "contact.device = \"gpu\": this run is on the CPU",
                    "use --backend gpu (`seixo adapters` lists what there is) or leave contact.device out",
                )
            };
            return Err(Error::key("contact.device", message, remedy));
        }
        Ok(Self {
            backend,
            driven_faces: if plan.has(Stage::BodyForce) || plan.held {
                DrivenFaces::new(&scene)
            } else {
                DrivenFaces::default()
            },
            slots: (plan.needs(Arrays::Coupling) || plan.held)
                .then(|| Slots::new(&scene, &params, plan.held)),
            enclosed: vec![],
            pressings: vec![],
            voids: Voids::new(),
            pushes: vec![],
            pressed: HashMap::new(),
            solids_ledger: plan.ledger.then(|| (Ledger::default(), solids.energy().total())),
            solids,
            fluid_force: vec![Wrench::default(); scene.solids.len()],
            case: case.clone(),
            groups: scene.groups,
            openings: Openings::new(&scene),
            gone: 0,
            scene,
            params,
            plan,
            time: 0.0,
            steps: 0,
            began: 0,
            stages: BTreeMap::new(),
            wait_for_stages: false,
            speed: fastest,
            fastest,
            stop: Stop::default(),
            threads: None,
        })
    }

    /// Give up a step in progress with [`Error::Interrupted`] when `stop` has become overdue. The state is that of no
    /// moment then; one that was kept before can be taken over with [`Self::exchange`].
    pub fn stop_with(&mut self, stop: &Stop) {
        if self.backend.gives_up() {
            self.stop = stop.clone();
            self.backend.stop_with(stop);
        }
    }

    /// When the PPE's solver stops.
    pub fn settings(&self) -> Settings {
        settings(&self.case)
    }

    /// Whether the flow sets the time step.
    fn is_adaptive(&self) -> bool {
        self.case.run.adaptive && self.plan.wet()
    }

    /// Speed of the fastest of solids and openings within the step to come [m/s].
    fn driven(&self) -> f64 {
        if !self.plan.wet() {
            return 0.0;
        }
        let typed = self.case.run.time_step;
        self.solids.fastest(self.time, typed).max(self.openings.fastest(self.time, self.time + typed))
    }

    /// Coefficients of the next step, with the time step that the case, the flow and the solids allow.
    pub fn next_step(&self) -> Step {
        let (adaptive, driven) = (self.is_adaptive(), self.driven());
        let flow = self.speed.max(driven);
        let ready = ready_speed(&self.params, self.speed).max(driven);
        let dt = time_step(&self.params, self.case.run.time_step, adaptive, ready);
        let dt = if adaptive { shortened(&self.params, dt, self.fastest) } else { dt };
        let relaxation = self.eased() * self.gamma(dt, driven);
        let shift_speed = self.params.shift_speed(flow);
        // Pressures are cut as those of a collapse are: it may begin at any time.
        let step = Step {
            relaxation,
            shift_speed,
            ..self.params.step(self.time, dt, flow.max(collapse_speed(&self.params)))
        };
        // What jumps over its neighbours needs the damping.
        if self.fastest * dt > self.params.spacing { step.whole() } else { step }
    }

    /// gamma of a step of `dt` [s] among solids and openings with the speed `driven` [m/s]. An adaptive step that is longer than those of a
    /// collapse undoes no more of the density's error in a second than they do: with c_s dt / l0 the velocities that undo it grow with dt,
    /// and a start with a jitter of 0.1 at a depth of 50 spacings gained 4 % of energy.
    fn gamma(&self, dt: f64, driven: f64) -> f64 {
        let long = if self.is_adaptive() && self.params.follows_flow {
            collapse_step(&self.params).min(dt)
        } else {
            dt
        };
        self.params.relaxation(long, self.speed, driven) * (dt / long)
    }

    /// Steps between looks at the flow, the next one of `dt` [s]. Each one is looked at where a solid or an opening makes it short: what that
    /// strikes is as fast at once, and may be slower itself.
    pub(crate) fn looks_every(&self, dt: f64) -> u64 {
        let strikes = || {
            let driven = self.driven();
            let bounds = Bounds::new(&self.params, driven);
            driven > ready_speed(&self.params, self.speed) && bounds.flow < bounds.weight
        };
        if self.is_adaptive() && strikes() { 1 } else { looks_every(&self.params, dt) }
    }

    /// Part of gamma that acts now [-]. Beside solids off its lattice water never starts quite even: what a body displaces is no
    /// whole number of particles. Undone at once, that took pressures far above those of the water's weight; it is now undone as
    /// slowly as the weight moves it.
    fn eased(&self) -> f64 {
        if !self.scene.uneven || self.params.source != Source::Mixed {
            return 1.0;
        }
        let gravity = self.params.gravity.length();
        let span = if gravity > 0.0 {
            EASED * (self.params.spacing / gravity).sqrt()
        } else {
            EASED_STEPS * self.case.run.time_step
        };
        (self.time / span).powi(2).min(1.0)
    }

    fn timed<T>(&mut self, stage: Stage, work: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        let start = Instant::now();
        let out = work(self);
        if self.wait_for_stages {
            self.backend.wait()?;
        }
        // Contact is the host's own work; where the pairs are on a device, the host waits for them.
        if self.wait_for_stages || stage == Stage::Contact || self.backend.timing() == Timing::Host {
            *self.stages.entry(stage).or_default() += start.elapsed().as_secs_f64();
        }
        out
    }

    /// Volume of the water, and what each inflow and outflow has let through since the start [m3], by the columns of monitors.csv
    /// without their units, as far as `fluid` and `counters` say, see [`Self::observe`]; in two dimensions of a slice one spacing wide. Nothing
    /// without openings.
    pub fn volumes(&self, fluid: &FluidMonitor, counters: &Counters) -> Vec<(String, f64)> {
        let emitted = self.openings.emitted().map(|(_, n)| n);
        let counts =
            std::iter::once(fluid.particles).chain(emitted).chain(counters.swallowed.iter().copied());
        let volume = self.params.particle_volume();
        self.openings.columns().into_iter().zip(counts.map(|n| n as f64 * volume)).collect()
    }

    /// Look at the fluid, the guards and the device's clock.
    ///
    /// # Errors
    /// A device that is lost.
    pub fn observe(&mut self) -> Result<(FluidMonitor, Counters)> {
        let seen = self.backend.look()?;
        if !self.wait_for_stages {
            let of_device = self.backend.stage_seconds().into_iter();
            self.stages.extend(of_device.filter(|(stage, _)| *stage != Stage::Contact));
        }
        Ok(seen)
    }

    pub(crate) fn run(&mut self, stage: ParticleStage, step: &Step) -> Result<()> {
        if !self.plan.has(stage.into()) {
            return Ok(());
        }
        self.timed(stage.into(), |s| s.backend.run(stage, step))
    }

    /// Water comes in and goes out.
    pub(crate) fn pass_openings(&mut self, step: &Step) -> Result<()> {
        if !self.plan.has(Stage::Openings) {
            return Ok(());
        }
        self.timed(Stage::Openings, |s| {
            let there = s.scene.water() as u64 + s.openings.total_emitted();
            let slots = s.groups.fluid;
            let passage = s.openings.advance(step.time + step.ahead, slots, &s.scene, s.solids.poses());
            let comes: usize = passage.emissions.iter().map(|e| e.wall.len()).sum();
            let fits = |gone: u64| there - gone + comes as u64 <= slots as u64;
            if comes > 0 && !fits(s.gone) {
                s.gone = s.backend.counters()?.gone();
                if !fits(s.gone) {
                    let what = format!(
                        "there is room for {slots} particles of water, {} are there and {comes} more come in; give a larger \
                         fluid.max_volume, or a larger run.domain if water is to be higher than that",
                        there - s.gone
                    );
                    return Err(s.diverged(step, Stage::Openings, what));
                }
            }
            s.backend.pass_openings(&passage.emissions, &passage.outlets)?;
            if passage.counts {
                let counters = s.backend.counters()?;
                s.openings.count(&passage, &counters.swallowed);
            }
            Ok(())
        })
    }

    pub(crate) fn solve_pressure(&mut self, step: &Step) -> Result<PressureReport> {
        let report = self.timed(Stage::ConjugateGradient, |s| {
            if s.plan.needs(Arrays::Coupling) {
                s.give_free_bodies(step.dt)?;
            }
            s.backend.solve_pressure(step)
        })?;
        if report.outcome == Outcome::NonFinite {
            return Err(self.diverged(step, Stage::ConjugateGradient, "the residual is not a number".into()));
        }
        Ok(report)
    }

    /// Work of each part of the step since the start, if the case asks for it.
    ///
    /// # Errors
    /// A device that is lost.
    pub fn ledger(&mut self) -> Result<Option<Ledger>> {
        let Some((solids, _)) = &self.solids_ledger else { return Ok(None) };
        Ok(Some(self.backend.ledger()?.unwrap_or_default().plus(solids)))
    }
}
