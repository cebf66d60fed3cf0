//! A simulation on many ranks: the first one opens it, the others serve.

use crate::backend::lead::{Lead, follow};
use crate::backend::{Backend, Processor, Ranked};
use crate::case::Case;
use crate::cells::Grid;
use crate::error::{Error, Result};
use crate::params::Params;
use crate::plan::Plan;
use crate::ranks::{Team, decode, encode};
use crate::scene::Scene;
use crate::share::{Division, Start, check};
use crate::simulation::{Simulation, settings};
use std::sync::Arc;

/// What a rank makes of its start: nothing wrong, or why it cannot compute. All ranks tell each other once.
fn agree<T>(team: &dyn Team, own: &Result<T>) -> Result<()> {
    let wrong = own.as_ref().err().map(ToString::to_string);
    let all = team.gather(encode(&wrong));
    let first =
        all.iter().enumerate().find_map(|(rank, bytes)| Some((rank, decode::<Option<String>>(bytes)?)));
    match first {
        Some((rank, why)) => Err(Error::usage("ranks", format!("rank {rank} of {}: {why}", team.ranks()))),
        None => Ok(()),
    }
}

/// The first rank has the others set up the case `text`, or end if there is none.
pub fn tell_case(team: &dyn Team, text: Option<&str>) {
    team.hear(text.unwrap_or_default().as_bytes().to_vec());
}

/// What the first rank tells with [`tell_case`].
pub fn hear_case(team: &dyn Team) -> Option<String> {
    let text = team.hear(Vec::new());
    (!text.is_empty()).then(|| String::from_utf8_lossy(&text).into_owned())
}

impl Simulation {
    /// Set up a `scene` that was built from `case` on the ranks of `team`, of which this is the first, on CPUs. The others [`serve`].
    ///
    /// # Errors
    /// As [`Simulation::open`], and [`Error::Usage`] for what ranks do not compute, or what one of them could not set up.
    pub fn on_ranks(case: &Case, scene: impl Into<Arc<Scene>>, team: &Arc<dyn Team>) -> Result<Self> {
        Self::on_ranks_of(case, scene, team, &Processor::Cpu)
    }

    /// [`Simulation::on_ranks`], each on its `processor`: its own GPU, or its threads. The others [`serve_on`] the same.
    ///
    /// # Errors
    /// As [`Simulation::on_ranks`].
    pub fn on_ranks_of(
        case: &Case,
        scene: impl Into<Arc<Scene>>,
        team: &Arc<dyn Team>,
        processor: &Processor,
    ) -> Result<Self> {
        let (mut dealt, k) = (false, team.on_machine());
        let set_up = Self::with_shared(case, scene, |scene, params, plan, settings| {
            let start = deal(&**team, scene, plan, params, processor.has_every_wall());
            dealt = true;
            let own = start.and_then(|start| processor.of_team((team, k), &start, plan, settings));
            let together = agree(&**team, &own);
            let own = own?;
            together?;
            Ok(Box::new(Lead::new(team.clone(), own)) as Box<dyn Backend>)
        });
        if !dealt {
            let why = set_up.as_ref().err().map(ToString::to_string).unwrap_or_default();
            team.deal(&mut |_| Vec::new());
            // The others are told; here the error is known already.
            let _ = agree::<()>(&**team, &Err(Error::usage("ranks", why)));
        }
        set_up
    }
}

/// Deals the particles of `scene` to the ranks; returns what the first one begins with. If they cannot share it the others get nothing.
fn deal(
    team: &dyn Team,
    scene: &Arc<Scene>,
    plan: &Plan,
    params: &Params,
    every_wall: bool,
) -> Result<Start> {
    let grid = Grid::over(params);
    check(team.ranks(), plan, params, &grid).inspect_err(|_| drop(team.deal(&mut |_| Vec::new())))?;
    let particles = (&scene.position[..], &scene.kind[..]);
    let division = Division::new(team.ranks(), scene.groups, &grid, params, particles);
    let start = |rank: usize| Start::new(rank, scene, params, &division, every_wall);
    team.deal(&mut |rank| encode(&start(rank)));
    Ok(start(0))
}

/// The part of a rank that is not the first: sets the case up that `set_up` has, with the particles that the first one deals, and does what that one orders,
/// until it ends. Returns what this rank held, or nothing if the ranks could not begin, which the first one tells.
///
/// # Errors
/// What a stage says.
pub fn serve(team: &Arc<dyn Team>, set_up: impl FnOnce() -> Result<Case>) -> Result<Option<Box<dyn Ranked>>> {
    serve_on(team, &Processor::Cpu, set_up)
}

/// [`serve`] on a `processor`, with the first rank's [`Simulation::on_ranks_of`].
///
/// # Errors
/// What a stage says.
pub fn serve_on(
    team: &Arc<dyn Team>,
    processor: &Processor,
    set_up: impl FnOnce() -> Result<Case>,
) -> Result<Option<Box<dyn Ranked>>> {
    let k = team.on_machine();
    let case = set_up();
    let dealt = team.deal(&mut |_| Vec::new());
    let own = case.and_then(|case| {
        if dealt.is_empty() {
            return Err(Error::usage("ranks", "the first rank has no particles for this one"));
        }
        let mut start: Start = decode(&dealt);
        drop(dealt);
        // What the scene needs, the whole of it says.
        let here = std::mem::replace(&mut start.scene.groups, start.all);
        let plan = Plan::new(&case, &start.scene, &start.params);
        start.scene.groups = here;
        processor.of_team((team, k), &start, &plan, settings(&case))
    });
    let together = agree(&**team, &own);
    let (Ok(mut own), Ok(())) = (own, together) else { return Ok(None) };
    follow(&mut *own)?;
    Ok(Some(own))
}
