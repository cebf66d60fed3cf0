//! Driven solids whose motions run through each other, or through what stands still: nothing holds them apart, and water between them has
//! nowhere to go.

use super::build::Builder;
use super::near::Near;
use super::oriented::Placed;
use super::{Drive, Motion, Solid};
use glam::DVec3;

/// Moments of a run at which two of them are held against each other.
const MOMENTS: u32 = 400;

/// How deep they reach into each other where they are said to meet, over the spacing [-]: walls of the lattice touch where they abut.
const MEETING: f64 = 0.5;

/// Most that are told.
const MOST: usize = 5;

/// What is said of a `driven` solid that comes to what stands `still` at `t` [s].
fn runs_into(driven: &str, still: &str, t: f64) -> String {
    format!(
        "`{driven}`, which follows a given motion, runs into `{still}`, which does not stop it, at t = {t:.3} s"
    )
}

/// What may meet: a solid or a wall.
struct Mover<'a> {
    name: &'a str,
    /// Where it is at t = 0.
    start: Placed,
    /// The solid that a motion drives, if one does.
    driven: Option<(&'a Solid, &'a Motion)>,
}

impl Mover<'_> {
    fn at(&self, t: f64) -> Placed {
        self.driven.map_or(self.start, |(solid, motion)| solid.placed_at(motion, t))
    }

    /// The box that holds it at all `times`.
    fn ends(&self, times: &[f64]) -> (DVec3, DVec3) {
        let times = if self.driven.is_some() { times } else { &times[..1] };
        times
            .iter()
            .map(|&t| self.at(t).ends())
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)))
    }
}

impl Builder<'_> {
    /// Solids of the case that are driven or stay where they are, and walls but those of the tank, of which
    /// [`Builder::domain`] tells.
    fn movers(&self) -> Vec<Mover<'_>> {
        let solids = self.solids_of_case().filter_map(|solid| {
            let driven = match &solid.drive {
                Drive::Prescribed(motion) if !motion.is_still() => Some((solid, motion)),
                _ if solid.stays() => None,
                _ => return None,
            };
            Some(Mover { name: &solid.name, start: solid.placed(), driven })
        });
        let walls = self.fixed.shapes.iter().filter(|wall| !wall.name.starts_with("tank."));
        let walls = walls.map(|wall| Mover { name: &wall.name, start: Placed::from(wall), driven: None });
        solids.chain(walls).filter(|mover| mover.start.is_convex()).collect()
    }

    /// Tells of driven solids of the case that meet each other, or what stands still, before the end of the run. Those that reach into each
    /// other from the start are the user's word, and of what is not convex planes do not tell.
    pub(super) fn meetings(&mut self) {
        let movers = self.movers();
        if movers.iter().all(|mover| mover.driven.is_none()) {
            return;
        }
        let (end, tolerance) = (self.case.run.end, MEETING * self.lattice.spacing);
        let times: Vec<f64> = (0..=MOMENTS).map(|k| end * f64::from(k) / f64::from(MOMENTS)).collect();
        let (mut near, mut notes, plane) = (Near::default(), Vec::new(), self.lattice.plane);
        for mover in &movers {
            let (low, high) = mover.ends(&times);
            for other in near.meeting(low, high).into_iter().map(|k| &movers[k]) {
                match (mover.driven, other.driven) {
                    (None, None) => continue,
                    // What moves as one keeps its distance.
                    (Some((_, a)), Some((_, b))) if a == b && !a.turns() => continue,
                    _ => {}
                }
                let meets = |t: &&f64| {
                    let (own, beside) = (mover.at(**t), other.at(**t));
                    own.apart(&beside).0 <= 0.0 && own.way_out(&beside, plane).0 > tolerance
                };
                if let Some(t) = times.iter().find(meets).filter(|t| **t > 0.0) {
                    let (a, b) = (other.name, mover.name);
                    notes.push(match (other.driven, mover.driven) {
                        (Some(_), Some(_)) => format!(
                            "`{a}` and `{b}`, which both follow a given motion, meet at t = {t:.3} s and run into each other"
                        ),
                        (Some(_), _) => runs_into(a, b, *t),
                        _ => runs_into(b, a, *t),
                    });
                }
            }
            near.add(low, high);
        }
        if notes.len() > MOST {
            let more = notes.len() - MOST;
            notes.truncate(MOST);
            notes.push(format!("and {more} more that follow given motions run into something"));
        }
        self.notes.extend(notes);
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::Scene;

    #[test]
    fn motions_that_run_through_each_other_are_told() {
        let case = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.5\ndomain = [[-1, -1, -1], [2, 1, 1]]\n[contact]\nspring = 1e5\n\
                    [[body]]\nname = \"d\"\nsize = [0.2, 0.2, 0.1]\ncenter = [0, 0, 0]\nmotion = [[0, 0, 0, 0], [0.5, 0.5, 0, 0]]\n\
                    [[moving_wall]]\nname = \"w\"\nmin = [0.3, -0.1, -0.1]\nmax = [0.5, 0.1, 0.1]\n";
        let notes = |way: f64| {
            let wall = format!("motion = [[0, 0, 0, 0], [0.5, {way}, 0, 0]]\n");
            let scene = Scene::build(&format!("{case}{wall}").parse().unwrap()).unwrap();
            scene.notes.into_iter().filter(|n| n.contains("meet")).collect::<Vec<_>>()
        };
        // 0.2 m apart, at 1 and 0.4 m/s towards each other, and half a spacing further.
        let told = notes(-0.2);
        assert!(
            told.len() == 1 && told[0].starts_with("`w` and `d`") && told[0].contains("at t = 0.15"),
            "{told:?}"
        );
        assert!(notes(0.5).is_empty());
    }

    #[test]
    fn what_stands_still_does_not_stop_what_is_driven() {
        let case = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.5\ndomain = [[-1, -1, -1], [2, 1, 1]]\n[contact]\nspring = 1e5\n\
                    [[body]]\nname = \"d\"\nsize = [0.2, 0.2, 0.1]\ncenter = [0, 0, 0]\nmotion = [[0, 0, 0, 0], [0.5, 0.5, 0, 0]]\n";
        let notes = |more: &str| {
            let scene = Scene::build(&format!("{case}{more}").parse().unwrap()).unwrap();
            scene.notes.into_iter().filter(|n| n.contains("runs into")).collect::<Vec<_>>()
        };
        let held = |locked: &str| {
            format!(
                "[[body]]\nname = \"s\"\nsize = [0.2, 0.2, 0.2]\ncenter = [0.4, 0, 0]\ndensity = 2000\nlocked = [{locked}]\n"
            )
        };
        // 0.2 m away, at 1 m/s, and half a spacing further; what is free gives way.
        for (more, told) in [
            ("[[obstacle]]\nname = \"s\"\nmin = [0.3, -0.1, -0.1]\nmax = [0.5, 0.1, 0.1]\n", true),
            ("[[obstacle]]\nname = \"s\"\nmin = [0.3, -0.1, 0.1]\nmax = [0.5, 0.1, 0.3]\n", false),
            (&held("\"x\", \"y\", \"z\", \"rotation_x\", \"rotation_y\", \"rotation_z\""), true),
            (&held("\"y\""), false),
        ] {
            let notes = notes(more);
            assert_eq!(notes.len(), usize::from(told), "{more}: {notes:?}");
            assert!(
                notes.iter().all(|n| n.starts_with("`d`") && n.contains("`s`") && n.contains("t = 0.2")),
                "{notes:?}"
            );
        }
    }
}
