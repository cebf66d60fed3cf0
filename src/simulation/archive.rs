//! The state of a simulation between two steps.

use super::Simulation;
use crate::body::Wrench;
use crate::checkpoint::Archive;
use crate::error::Result;
use crate::plan::Stage;
use crate::scene::Groups;
use glam::DVec3;

/// Slots of the water in a state.
const WATER: &str = "particles of water";
/// Arrays of every backend's states over all particles, over those that carry pressure, over the water.
const OF_ALL: [&str; 3] = ["position", "velocity", "kind"];
const OF_CARRIERS: [&str; 3] = ["pressure", "number_density", "state"];
const OF_WATER: [&str; 2] = ["id", "acceleration"];
/// Lists of neighbours, which name slots.
const LISTS: [&str; 5] =
    ["list_start", "list_dummies", "list_neighbour", "neighbour_count", "neighbour_list"];

/// Slots of the water in `archive`, if it says.
pub(crate) fn slots_of_water(archive: &Archive) -> Option<usize> {
    archive.numbers.get(WATER).map(|&n| n as usize)
}

impl Simulation {
    /// Gives `archive`, a state of another run, as many slots of water as there are here, if it has fewer: more is to come in. They hold what those here
    /// hold at t = 0, no particle. Lists of neighbours are left out, and made anew.
    ///
    /// # Errors
    /// What the backend says.
    pub(crate) fn make_room(&mut self, archive: &mut Archive) -> Result<()> {
        let (groups, slots) = (self.groups, self.groups.fluid);
        let spare = self.scene.water()..slots;
        let Some(held) = slots_of_water(archive).filter(|held| spare.contains(held)) else { return Ok(()) };
        let mut here = Archive::new();
        self.exchange(&mut here)?;
        let arrays = [(groups.total(), &OF_ALL[..]), (groups.pressure(), &OF_CARRIERS), (slots, &OF_WATER)];
        for (count, name) in
            arrays.into_iter().flat_map(|(count, names)| names.iter().map(move |n| (count, *n)))
        {
            let (Some(full), Some(short)) = (here.sections.get(name), archive.sections.get_mut(name)) else {
                continue;
            };
            let size = full.bytes.len() / count;
            let more = held * size..slots * size;
            // What fits no better then is refused when it is taken over.
            if short.bytes.len() + more.len() == full.bytes.len() {
                short.bytes.splice(more.start..more.start, full.bytes[more].iter().copied());
            }
        }
        LISTS.iter().for_each(|name| drop(archive.sections.remove(*name)));
        archive.numbers.insert(WATER.to_owned(), slots as u64);
        Ok(())
    }

    /// Save the whole state between two steps, or take it over.
    ///
    /// # Errors
    /// [`crate::error::Error::Checkpoint`] if the state is that of another scene, or what the backend says.
    pub fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        let Self {
            // Follows from the case.
            case: _,
            scene: _,
            params: _,
            plan,
            groups,
            wait_for_stages: _,
            threads: _,
            stop: _,
            gone,
            // Follows from the case.
            slots: _,
            enclosed: _,
            pressings: _,
            pushes: _,
            pressed: _,
            voids: _,
            driven_faces: _,
            // Times by the clock are those of each process.
            stages: _,
            backend,
            solids,
            fluid_force,
            time,
            steps,
            began,
            speed,
            fastest,
            solids_ledger,
            openings,
        } = self;
        let Groups { fluid, moving_wall, static_wall, static_dummy, moving_dummy } = *groups;
        archive.same(WATER, fluid as u64)?;
        archive.same("wall particles that move", moving_wall as u64)?;
        archive.same("wall particles", static_wall as u64)?;
        archive.same("dummies", static_dummy as u64)?;
        archive.same("dummies that move", moving_dummy as u64)?;
        archive.same("solids that move", fluid_force.len() as u64)?;
        archive.number("time", time)?;
        archive.count("steps", steps)?;
        if archive.is_of_another() {
            *began = *steps;
        } else {
            archive.count("began", began)?;
        }
        archive.number("speed", speed)?;
        archive.number("fastest", fastest)?;
        let vectors = fluid_force.iter().flat_map(|w| [w.force, w.torque]);
        let mut vectors: Vec<DVec3> = vectors.collect();
        archive.array("fluid_force", &mut vectors, true)?;
        for (wrench, v) in fluid_force.iter_mut().zip(vectors.chunks_exact(2)) {
            *wrench = Wrench { force: v[0], torque: v[1] };
        }
        if let Some((ledger, energy)) = solids_ledger {
            ledger.exchange(archive, "ledger.solids")?;
            if !archive.is_of_another() {
                archive.number("ledger.energy", energy)?;
            }
        }
        openings.exchange(archive)?;
        solids.exchange(archive, backend.compute())?;
        if !archive.is_saving() {
            // Looked up when it matters.
            *gone = 0;
        }
        if let Some((_, energy)) = solids_ledger.as_mut().filter(|_| archive.is_of_another()) {
            *energy = solids.energy().total();
        }
        // Lists that are made anew ask where solids face.
        if !archive.is_saving() && plan.has(Stage::MoveSolids) {
            backend.move_solids(&openings.place(solids.poses()))?;
        }
        backend.exchange(archive)?;
        if archive.is_of_another() && !openings.is_empty() {
            openings.begin(&backend.counters()?.swallowed);
        }
        Ok(())
    }
}
