//! `run.from`: a run that begins with the last state of another one.

use super::resume::{HAD, changed};
use crate::case::Case;
use crate::case::file::{Loaded, parse};
use crate::checkpoint::{Found, file};
use crate::error::{Error, Result};
use crate::output::folder::checkpoints;
use crate::scene::Scene;
use crate::simulation::Simulation;
use crate::simulation::archive::slots_of_water;
use std::path::Path;

/// The state that `run.from` names.
///
/// # Errors
/// [`Error::Case`] if there is none, or if it is of a later time than the end of the run; [`Error::Checkpoint`] if it is of
/// another scene or kind of processor.
pub(super) fn earlier(simulation: &Simulation) -> Result<Option<Found>> {
    let Some(found) = named(&simulation.case)? else { return Ok(None) };
    fits(simulation, &found).map_err(|e| Error::misfit(format!("run.from: {e}")))?;
    holds(&found, &simulation.scene)?;
    Ok(Some(Found { archive: found.archive.into_beginning(), ..found }))
}

/// What always begins at t = 0 refuses a case that names a state to go on from: it would be passed over in silence.
///
/// # Errors
/// [`Error::Case`] that tells of `what`, with its place and a `remedy`, if there is a `run.from`.
pub fn refuse(loaded: &Loaded, what: &str, remedy: &str) -> Result<()> {
    match loaded.case.run.from {
        Some(_) => {
            let error = Error::key("run.from", format!("run.from: {what} begins at t = 0"), remedy);
            Err(loaded.placed(error))
        }
        None => Ok(()),
    }
}

/// The state that `run.from` of `case` names, whatever it is of: the newest that is whole.
///
/// # Errors
/// As a run that would begin with it, but for what only its processor tells.
pub fn named(case: &Case) -> Result<Option<Found>> {
    let run = &case.run;
    let Some(from) = &run.from else { return Ok(None) };
    let remedy = "name the folder of a run with states (run.checkpoint), or leave run.from out";
    if !Path::new(from).is_dir() {
        let what = if Path::new(from).exists() { "is a file" } else { "is not there" };
        return Err(Error::key("run.from", format!("run.from: `{from}` {what}"), remedy));
    }
    let found = file::newest(&checkpoints(Path::new(from))).map_err(|e| match e {
        Error::Checkpoint(why) => {
            Error::damaged(format!("run.from: no state in `{from}` is whole: {why}; {remedy}"))
        }
        other => other,
    })?;
    let found = found
        .ok_or_else(|| Error::key("run.from", format!("run.from: `{from}` holds no checkpoint"), remedy))?;
    let time = found.origin.time;
    if time >= run.end {
        let text = format!(
            "run.end: the state of run.from is of t = {time} s, and the run is to end at {} s",
            run.end
        );
        return Err(Error::key("run.end", text, "give a later end, with --until say"));
    }
    let (old, ..) = parse("checkpoint", found.origin.case.clone(), &[])?;
    let scene: Vec<String> = changed(&old, case).into_iter().filter(|c| is_of_scene(c)).collect();
    if scene.is_empty() {
        return Ok(Some(found));
    }
    let more = if scene.len() > TOLD { format!(" and {} more", scene.len() - TOLD) } else { String::new() };
    let remedy = if scene.iter().any(|change| change.split(' ').nth(1) == Some(HAD)) {
        "nothing can be added to it or taken out: keep a body that is to do nothing more, held by `locked`"
    } else {
        "leave places, orientations and velocities at t = 0 as they were: these come from the saved state"
    };
    Err(Error::misfit(format!(
        "run.from: the state in {from} is of another scene: {}{more}; {remedy}",
        scene[..scene.len().min(TOLD)].join(", "),
    )))
}

/// Keys of a scene that differ and are told.
const TOLD: usize = 6;

/// Whether the value at `path`, a dotted key or the table of it, is part of what a state is the state of. Laws,
/// constants, motions, gauges, names and what is written may change.
pub(super) fn is_of_scene(path: &str) -> bool {
    let mut parts = path.split([' ', '.']).filter(|p| p.parse::<usize>().is_err());
    let table = parts.next().unwrap_or_default();
    let free = match table {
        "run" => {
            return ["spacing", "dimensions", "effective_radius"].contains(&parts.next().unwrap_or_default());
        }
        "fluid" => {
            return ["block", "fill", "shape", "jitter", "seed"].contains(&parts.next().unwrap_or_default());
        }
        "tank" | "obstacle" | "plane" => &["name"][..],
        "moving_wall" => &["name", "motion", "rotation", "sine", "swing", "wave", "pivot"],
        "body" => {
            &["name", "motion", "rotation", "sine", "swing", "pivot", "density", "mass", "inertia", "locked"]
        }
        "inflow" | "outflow" => &["name", "velocity", "discharge"],
        _ => return false,
    };
    // A table as a whole: there are more of them, or fewer.
    parts.next().is_none_or(|key| !free.contains(&key))
}

/// Refuses a state with room for more water than `scene` has: there may be that much in it. Room for more is made, but for a state of a device: places
/// in it count from the middle of the domain, which water that is to come in may move.
///
/// # Errors
/// [`Error::Case`].
pub fn holds(found: &Found, scene: &Scene) -> Result<()> {
    let (l0, here) = (scene.spacing, scene.groups.fluid);
    let of_device = found.origin.precision == "f32";
    let differs = |held: &usize| *held > here || of_device && *held != here;
    let Some(held) = slots_of_water(&found.archive).filter(differs) else { return Ok(()) };
    let (volume, unit) = if scene.dimensions == 2 { (l0.powi(2), "m2") } else { (l0.powi(3), "m3") };
    let text = format!(
        "fluid.max_volume: the state of run.from has room for {held} particles of water, this case for {here}"
    );
    if of_device {
        let remedy = "on a device give both runs the same fluid.max_volume and run.domain";
        return Err(Error::key("fluid.max_volume", text, remedy));
    }
    let remedy = format!("give fluid.max_volume = {:.4e} [{unit}] or more", 1.0001 * held as f64 * volume);
    Err(Error::key("fluid.max_volume", text, remedy))
}

/// Refuses a state of another kind of processor.
pub(super) fn fits(simulation: &Simulation, found: &Found) -> Result<()> {
    let (had, have) = (&found.origin.precision, simulation.backend.precision());
    if had == have {
        return Ok(());
    }
    let name = |precision: &str| if precision == "f64" { "cpu" } else { "gpu" };
    let (path, had, have) = (found.path.display(), name(had), name(have));
    Err(Error::misfit(format!(
        "{path} was saved by a run on the {had}, this one is on the {have}: use --backend {had}"
    )))
}

/// Refuses a state in which a driven solid stands elsewhere than where its motion has it then: it would jump there.
pub(super) fn stands(simulation: &Simulation) -> Result<()> {
    let (time, spacing) = (simulation.time, simulation.case.run.spacing);
    let solids = &simulation.solids;
    for k in 0..solids.poses().len() {
        let Some(off) = solids.off_motion(k, time).filter(|off| *off > JUMP * spacing) else { continue };
        let name = solids.name(k);
        return Err(Error::misfit(format!(
            "run.from: `{name}` stands {off:.3e} m from where its motion has it at t = {time} s: let its motion go on from \
             where the state left it (it may change from then on)"
        )));
    }
    Ok(())
}

/// A jump that is none, over the spacing.
const JUMP: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::is_of_scene;

    #[test]
    fn where_things_stand_is_of_the_scene_and_what_acts_on_them_is_not() {
        for scene in [
            "run.spacing was 0.1, is 0.2",
            "obstacle.0.min.2 was 0, is 1",
            "obstacle had 0, has 1: `step` is new",
            "body had 2, has 1: `c` is missing",
            "body.1.velocity.0 was 0, is 1",
            "body.0.center was other, is other",
            "fluid.block.0.max.1 was 1, is 2",
            "tank.open was other, is absent",
        ] {
            assert!(is_of_scene(scene), "{scene}");
        }
        for free in [
            "run.end was 1, is 2",
            "body.0.density was 800, is 900",
            "moving_wall.2.motion was other, is other",
            "gauge.level.0.at.0 was 1, is 2",
            "fluid.viscosity was 0, is 1",
            "output was absent, is other",
            "body.0.sine had 1, has 2",
            "contact.friction was 0.1, is 0.2",
        ] {
            assert!(!is_of_scene(free), "{free}");
        }
    }
}
