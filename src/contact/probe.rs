//! Contact at a glance, for comparisons of a device with the host.

use super::device::Link;
use super::smooth::Other;
use super::{Model, OnDevice, Solids};
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
    /// Mean distance of the normal force from its centre [m].
    pub radius: f64,
}

/// A number for a point.
fn number(x: DVec3) -> u64 {
    x.x.to_bits() ^ x.y.to_bits().rotate_left(21) ^ x.z.to_bits().rotate_left(42)
}

/// A number for a solid; walls last.
fn number_of(b: Other) -> u64 {
    match b {
        Other::Solid(b) => b as u64,
        Other::Wall(w) => u64::MAX - w as u64,
    }
}

impl Solids {
    /// Searches candidates and evaluates their forces afresh for the step `dt` [s], on `compute` if there is
    /// one. Nothing moves.
    ///
    /// # Errors
    /// As [`Solids::advance_on`].
    pub fn probe(&mut self, compute: Option<&mut dyn Compute>, dt: f64) -> Result<Probe> {
        let h = dt / f64::from(self.prepare(dt)?.substeps);
        self.candidates.forget();
        let mut compute = compute;
        self.evaluate(compute.as_mut().map(|c| &mut **c as &mut dyn Compute), h, dt)?;
        let mut probe = Probe { wrenches: vec![Wrench::default(); self.bodies.len()], ..Probe::default() };
        self.add_wrenches(&mut probe.wrenches);
        for p in self.smooth_pairs() {
            let solids = (p.a, p.b.solid());
            let patches = p.patches.iter().map(|f| ProbePatch {
                solids,
                normal: f.normal,
                at: f.at,
                force: f.force,
                radius: f.radius,
            });
            probe.patches.extend(patches);
            probe.energy += p.energy;
            probe.touching += p.point_count();
        }
        for p in self.paper_pairs() {
            probe.energy += p.energy;
            probe.touching += p.count;
        }
        probe.candidates = self.listed(compute)?;
        for p in self.smooth_pairs() {
            let b = number_of(p.b);
            let edges = |side: u64, edges: &[u32]| {
                edges.iter().map(|&k| [p.a as u64, b, 2 + side, k.into()]).collect::<Vec<_>>()
            };
            probe.candidates.extend(edges(0, &p.edges_a));
            probe.candidates.extend(edges(1, &p.edges_b));
        }
        probe.candidates.sort_unstable();
        Ok(probe)
    }

    fn listed(&mut self, compute: Option<&mut dyn Compute>) -> Result<Vec<[u64; 4]>> {
        let bodies = &self.bodies;
        let link = compute.map(|compute| Link { compute, traffic: &mut self.traffic });
        let other = |b: Option<usize>| b.map_or(u64::MAX, |b| b as u64);
        let side =
            |a: usize, b: Other, side: u8, x: DVec3| [a as u64, number_of(b), u64::from(side), number(x)];
        Ok(match (&self.model, &mut self.on_device, link) {
            (Model::Smooth(model), OnDevice::Smooth(pairs), Some(mut link)) => {
                let listed = pairs.listed(&model.surfaces, bodies, &mut link)?;
                listed.into_iter().map(|(a, b, s, x)| side(a, b, s, x)).collect()
            }
            (_, OnDevice::Paper(pairs), Some(mut link)) => pairs.listed(&mut link)?,
            (Model::Smooth(model), ..) => {
                let place = |s: usize, k: u32| {
                    bodies[s].pose.position + bodies[s].rotation * model.surfaces[s].points[k as usize]
                };
                let of = |p: &super::smooth::Pair| {
                    let mut all: Vec<[u64; 4]> =
                        p.points_a.iter().map(|&k| side(p.a, p.b, 0, place(p.a, k))).collect();
                    if let Other::Solid(b) = p.b {
                        all.extend(p.points_b.iter().map(|&k| side(p.a, p.b, 1, place(b, k))));
                    }
                    all.extend(p.samples.iter().map(|&x| side(p.a, p.b, 1, x)));
                    all
                };
                model.pairs.iter().flat_map(of).collect()
            }
            (Model::Paper(model, _), ..) => {
                let of = |p: &super::paper::Pair| {
                    let (a, b) = (p.a as u64, other(p.b));
                    p.candidates.iter().map(move |&(i, j)| [a, b, i.into(), j.into()]).collect::<Vec<_>>()
                };
                model.pairs.iter().flat_map(of).collect()
            }
            _ => vec![],
        })
    }
}
