//! Driven solids whose motions run through each other: nothing holds them apart, and water between them has nowhere to go.

use super::build::Builder;
use super::near::Near;
use super::{Drive, Motion, Solid};

/// Moments of a run at which two of them are held against each other.
const MOMENTS: u32 = 400;

/// How deep they reach into each other where they are said to meet, over the spacing [-]: walls of the lattice touch where they abut.
const MEETING: f64 = 0.5;

/// Most that are told.
const MOST: usize = 5;

impl Builder<'_> {
    /// Tells of driven solids of the case that meet before the end of the run. Those that reach into each other from the start are the
    /// user's word, and of what is not convex planes do not tell.
    pub(super) fn meetings(&mut self) {
        let driven = self.solids_of_case().filter_map(|solid| match &solid.drive {
            Drive::Prescribed(motion) if solid.placed().is_convex() => Some((solid, motion)),
            _ => None,
        });
        let driven: Vec<(&Solid, &Motion)> = driven.collect();
        let (end, tolerance) = (self.case.run.end, MEETING * self.lattice.spacing);
        let times: Vec<f64> = (0..=MOMENTS).map(|k| end * f64::from(k) / f64::from(MOMENTS)).collect();
        let (mut near, mut notes, plane) = (Near::default(), Vec::new(), self.lattice.plane);
        for &(solid, motion) in &driven {
            let ends = times.iter().map(|&t| {
                let placed = solid.placed_at(motion, t);
                (placed.center - placed.bounds(), placed.center + placed.bounds())
            });
            let Some((low, high)) = ends.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else { continue };
            for (other, others) in near.meeting(low, high).into_iter().map(|k| driven[k]) {
                // What moves as one keeps its distance.
                if motion == others && !motion.turns() {
                    continue;
                }
                let meets = |t: &&f64| {
                    let (own, beside) = (solid.placed_at(motion, **t), other.placed_at(others, **t));
                    own.apart(&beside).0 <= 0.0 && own.way_out(&beside, plane).0 > tolerance
                };
                if let Some(t) = times.iter().find(meets).filter(|t| **t > 0.0) {
                    notes.push(format!(
                        "`{}` and `{}`, which both follow a given motion, meet at t = {t:.3} s and run into each other",
                        other.name, solid.name
                    ));
                }
            }
            near.add(low, high);
        }
        if notes.len() > MOST {
            let more = notes.len() - MOST;
            notes.truncate(MOST);
            notes.push(format!("and {more} more pairs of solids that follow given motions meet"));
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
}
