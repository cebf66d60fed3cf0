//! A rank with a gate in its water, step by step: for the tests of what ranks of devices do.

use super::GpuRank;
use crate::backend::Backend;
use crate::backend::gpu::adapters;
use crate::body::Pose;
use crate::case::Case;
use crate::cells::Grid;
use crate::params::Params;
use crate::plan::{Plan, Stage};
use crate::pressure::Settings;
use crate::ranks::Team;
use crate::scene::Scene;
use crate::share::{Division, Start};
use glam::DVec3;
use std::sync::Arc;

/// Says whether there is a device at all; without one `what` is not tested, which under CI is a failure.
pub(super) fn there_is_a_device(what: &str) -> bool {
    let found = !adapters().is_empty();
    if !found {
        assert!(std::env::var_os("CI").is_none(), "no GPU adapter");
        eprintln!("SKIPPED, NO GPU ADAPTER: {what} not tested");
    }
    found
}

/// Time step [s].
const STEP: f64 = 1e-3;

/// A rank, and the one moving wall of its case.
pub(super) struct Rig {
    pub rank: GpuRank,
    params: Params,
    plan: Plan,
    gate: Pose,
    steps: usize,
}

impl Rig {
    /// Of `case`, whose gate moves with `velocity` [m/s].
    pub fn new(one: Arc<dyn Team>, case: &Case, velocity: DVec3) -> Self {
        let scene = Arc::new(Scene::build(case).expect("a valid scene"));
        let params = Params::new(case, &scene).expect("valid constants");
        let plan = Plan::new(case, &scene, &params);
        let settings = Settings { tolerance: 1e-5, max_iterations: 100, warm_start: true };
        let grid = Grid::new(&params).expect("a grid");
        let particles = (&scene.position[..], &scene.kind[..]);
        let division = Division::new(one.ranks(), scene.groups, &grid, &params, particles);
        let start = Start::new(one.rank(), &scene, &params, &division, true);
        let rank = GpuRank::of_team((one, 0), &start, &plan, settings, None).expect("it can be built");
        let solid = &scene.solids[0];
        let gate = Pose {
            position: solid.position,
            orientation: solid.orientation,
            velocity,
            angular_velocity: DVec3::ZERO,
        };
        Self { rank, params, plan, gate, steps: 0 }
    }

    /// A step; its stages as far as `before` each of them says that it goes on.
    pub fn step(&mut self, mut before: impl FnMut(&mut GpuRank, Stage) -> bool) {
        let step = self.params.step(STEP * self.steps as f64, STEP, 1.0);
        self.gate.position += STEP * self.gate.velocity;
        self.steps += 1;
        let rank = &mut self.rank;
        for stage in Stage::ALL.into_iter().filter(|s| self.plan.has(*s)) {
            if !before(rank, stage) {
                return;
            }
            match stage {
                Stage::MoveSolids => rank.move_solids(&[self.gate]).expect("it moves"),
                Stage::ConjugateGradient => drop(rank.solve_pressure(&step).expect("it is solved")),
                Stage::BodyForce => drop(rank.body_force(&[]).expect("it is summed")),
                other => other.over_particles().map_or((), |s| rank.run(s, &step).expect("it runs")),
            }
        }
    }
}
