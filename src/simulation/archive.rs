//! The state of a simulation between two steps.

use super::Simulation;
use crate::body::Wrench;
use crate::checkpoint::Archive;
use crate::error::Result;
use crate::plan::Stage;
use crate::scene::Groups;
use glam::DVec3;

impl Simulation {
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
        archive.same("particles of water", fluid as u64)?;
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
        backend.exchange(archive)
    }
}
