//! The smooth law at a glance.

use super::Smooth;
use super::pair::{Other, Pair};
use crate::body::Body;
use crate::contact::device::Link;
use crate::contact::probe::{Probe, ProbePatch};
use crate::error::Result;
use glam::DVec3;

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

/// Takes the pairs of the last evaluation into `probe`.
pub(super) fn fill(law: &Smooth, bodies: &[Body], device: Option<Link>, probe: &mut Probe) -> Result<()> {
    for p in law.evaluated() {
        let solids = (p.a, p.b.solid());
        let patches = p.patches.iter().map(|f| ProbePatch {
            solids,
            normal: f.normal,
            at: f.at,
            force: f.force,
            radius: (f.spread.x_axis.x + f.spread.y_axis.y + f.spread.z_axis.z).sqrt(),
        });
        probe.patches.extend(patches);
        probe.energy += p.energy;
        probe.touching += p.point_count();
        let b = number_of(p.b);
        let edges = |side: u64, edges: &[u32]| {
            edges.iter().map(|&k| [p.a as u64, b, 2 + side, k.into()]).collect::<Vec<_>>()
        };
        probe.candidates.extend(edges(0, &p.edges_a));
        probe.candidates.extend(edges(1, &p.edges_b));
    }
    let side = |a: usize, b: Other, side: u8, x: DVec3| [a as u64, number_of(b), u64::from(side), number(x)];
    match (&law.device, device) {
        (Some(pairs), Some(mut link)) if law.on_device => {
            let listed = pairs.listed(&law.surfaces, bodies, &mut link)?;
            probe.candidates.extend(listed.into_iter().map(|(a, b, s, x)| side(a, b, s, x)));
        }
        _ => {
            let place = |s: usize, way: DVec3, k: u32| {
                bodies[s].shape_center() + way + bodies[s].rotation * law.surfaces[s].points[k as usize]
            };
            let of = |p: &Pair| {
                let mut all: Vec<[u64; 4]> =
                    p.points_a.iter().map(|&k| side(p.a, p.b, 0, place(p.a, DVec3::ZERO, k))).collect();
                if let Other::Solid(b) = p.b {
                    all.extend(p.points_b.iter().map(|&k| side(p.a, p.b, 1, place(b, p.image, k))));
                }
                all.extend(p.samples.iter().map(|&x| side(p.a, p.b, 1, x)));
                all
            };
            probe.candidates.extend(law.pairs.iter().flat_map(of));
        }
    }
    Ok(())
}
