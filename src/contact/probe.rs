//! Contact at a glance, for comparisons of a device with the host.

use super::Solids;
use super::device::Link;
use crate::body::Wrench;
use crate::compute::Compute;
use crate::error::Result;
use glam::DVec3;

/// What contact finds at the bodies' poses and velocities.
#[derive(Clone, Debug, Default)]
pub struct Probe {
    /// Forces of contact, one per solid, without Coulomb friction.
    pub wrenches: Vec<Wrench>,
    /// Candidates of the search, sorted: the two solids (walls last), and which points, edges or particles.
    pub candidates: Vec<[u64; 4]>,
    /// Where friction acts (law "smooth").
    pub patches: Vec<ProbePatch>,
    /// Energy in the contact springs [J].
    pub energy: f64,
    /// Points (without those of edges) or particle pairs in contact.
    pub touching: usize,
}

/// All points pressed by one face.
#[derive(Clone, Copy, Debug)]
pub struct ProbePatch {
    /// The two solids; `None` is a wall.
    pub solids: (usize, Option<usize>),
    /// Direction of the normal force on the first one.
    pub normal: DVec3,
    /// Centre of the normal force [m].
    pub at: DVec3,
    /// Normal force [N].
    pub force: f64,
    /// Root of the mean square distance of the normal force from its centre [m].
    pub radius: f64,
}

impl Solids {
    /// Searches candidates and evaluates their forces afresh for the step `dt` [s], on `compute` if there is
    /// one. Nothing moves.
    ///
    /// # Errors
    /// As [`Solids::advance_on`].
    pub fn probe(&mut self, mut compute: Option<&mut dyn Compute>, dt: f64) -> Result<Probe> {
        let h = dt / f64::from(self.prepare(dt)?.substeps);
        self.candidates.forget();
        self.evaluate(compute.as_mut().map(|c| &mut **c as &mut dyn Compute), h, dt)?;
        let mut probe = Probe { wrenches: vec![Wrench::default(); self.bodies.len()], ..Probe::default() };
        if let Some(law) = &mut self.law {
            law.add_loads(&self.bodies, &mut probe.wrenches);
            let link = compute.map(|compute| Link { compute, traffic: &mut self.traffic });
            law.probe(&self.bodies, link, &mut probe)?;
        }
        probe.candidates.sort_unstable();
        Ok(probe)
    }
}
