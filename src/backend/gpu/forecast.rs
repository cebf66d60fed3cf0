//! Memory of a scene by groups of buffers, and of the same scene with finer particles: what fits, and which limit
//! comes first.

use super::buffers;
use super::layout::{Allocation, FLUID_MAX, Memory, Sizes};
use crate::plan::Plan;
use serde::Serialize;

/// Bytes that a shader binds at most on any device [bytes].
pub(crate) const BINDING_MAX: u64 = (1 << 31) - 1;
/// Workgroups that a dispatch starts along one dimension.
pub(crate) const WORKGROUPS_MAX: u64 = 65_535;

/// Buffers that serve one purpose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Group {
    /// Purpose.
    pub name: &'static str,
    /// Their bytes.
    pub bytes: u64,
    /// The largest of them.
    pub largest: &'static str,
}

/// `memory` by purpose, the largest first.
pub fn groups(memory: &Memory) -> Vec<Group> {
    let mut out: Vec<Group> = Vec::new();
    let mut buffers: Vec<&Allocation> = memory.buffers.iter().collect();
    buffers.sort_by_key(|b| std::cmp::Reverse(b.bytes));
    for buffer in buffers {
        let (name, largest) = (buffer.purpose, buffer.id.name());
        match out.iter_mut().find(|g| g.name == name) {
            Some(group) => group.bytes += buffer.bytes,
            None => out.push(Group { name, bytes: buffer.bytes, largest }),
        }
    }
    out.sort_by_key(|g| std::cmp::Reverse(g.bytes));
    out
}

/// A limit that a scene does not keep.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Excess {
    /// Buffer or count.
    pub what: String,
    /// Needed, in the limit's unit.
    pub needs: u64,
    /// Allowed.
    pub allows: u64,
    /// Name of the limit.
    pub limit: &'static str,
    /// What would lift it.
    pub remedy: String,
}

/// The limits that `sizes` and their `memory` do not keep, the furthest exceeded first.
pub fn excesses(sizes: &Sizes, memory: &Memory) -> Vec<Excess> {
    let mut out = Vec::new();
    for buffer in &memory.buffers {
        let (bytes, id) = (buffer.bytes, buffer.id);
        let (limit, allows) = ("max_storage_buffer_binding_size", BINDING_MAX);
        if bytes <= allows {
            continue;
        }
        let parts = bytes.div_ceil(allows);
        let remedy = if id == buffers::neighbour_list.id() {
            format!("{parts} ranges of slots, each with a list and dispatches of its own")
        } else if id == buffers::entry.id() {
            format!("{parts} ranges of the 27 entries of a row")
        } else {
            format!("{parts} ranges of slots, or {parts} devices")
        };
        out.push(Excess { what: id.name().into(), needs: bytes, allows, limit, remedy });
    }
    if memory.workgroups > WORKGROUPS_MAX {
        out.push(Excess {
            what: "workgroups".into(),
            needs: memory.workgroups,
            allows: WORKGROUPS_MAX,
            limit: "max_compute_workgroups_per_dimension",
            remedy: "dispatches in two dimensions".into(),
        });
    }
    if sizes.fluid > FLUID_MAX as u64 {
        out.push(Excess {
            what: "fluid particles".into(),
            needs: sizes.fluid,
            allows: FLUID_MAX as u64,
            limit: "numbers in a word",
            remedy: "a second word for a particle's number".into(),
        });
    }
    out.sort_by(|a, b| (b.needs as f64 / b.allows as f64).total_cmp(&(a.needs as f64 / a.allows as f64)));
    out
}

/// The same scene with finer particles.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Forecast {
    /// Particles of all kinds.
    pub particles: u64,
    /// Fluid particles.
    pub fluid: u64,
    /// Spacing over that of the scene [-].
    pub spacing_ratio: f64,
    /// Bytes on a device.
    pub bytes: u64,
    /// Largest buffer and its bytes.
    pub largest: (&'static str, u64),
    /// Limits that it does not keep.
    pub excesses: Vec<Excess>,
}

impl Forecast {
    /// Of `sizes` refined to about `particles`.
    pub fn new(sizes: &Sizes, plan: &Plan, particles: u64) -> Self {
        // Bisection: the number grows with the refinement.
        let (mut low, mut high) = (1e-3_f64, 1e3_f64);
        for _ in 0..60 {
            let middle = (low * high).sqrt();
            if sizes.refined(middle).total < particles { low = middle } else { high = middle }
        }
        Self::at(&sizes.refined(high), plan, 1.0 / high)
    }

    /// Of `sizes`, whose spacing is `spacing_ratio` times that of the scene.
    pub fn at(sizes: &Sizes, plan: &Plan, spacing_ratio: f64) -> Self {
        let memory = Memory::new(sizes, plan);
        Self {
            particles: sizes.total,
            fluid: sizes.fluid,
            spacing_ratio,
            bytes: memory.total(),
            largest: memory.largest(),
            excesses: excesses(sizes, &memory),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Stage;
    use crate::scheme::Preconditioner;

    fn sizes() -> Sizes {
        // The transport case at l0 = 7.5 mm.
        Sizes {
            total: 577_000,
            fluid: 211_000,
            moving_wall: 6_000,
            moving: 9_000,
            fixed: 357_000,
            pressure: 333_000,
            cells: 500_000,
            grid: [225, 36, 62],
            solids: 2,
            absorbers: 1,
            openings: 1,
            capacity: 64,
            rows_per_thread: 1,
        }
    }

    fn plan() -> Plan {
        let reasons = Stage::ALL.map(|s| (s, Ok("planned"))).to_vec();
        Plan {
            reasons,
            preconditioner: Preconditioner::Multigrid,
            coupled: true,
            excess: crate::plan::Excess::All,
            contact: Default::default(),
            fixed_walls: true,
            filled: false,
            ledger: false,
        }
    }

    #[test]
    fn water_grows_with_the_cube_and_walls_with_the_square() {
        let fine = sizes().refined(2.0);
        assert_eq!((fine.fluid, fine.fixed), (8 * 211_000, 4 * 357_000));
        assert_eq!(fine.pressure, 8 * 211_000 + 4 * 122_000);
        assert_eq!(fine.total, fine.fluid + fine.moving + fine.fixed);
        assert_eq!(fine.grid, [450, 72, 124]);
        let flat = Sizes { grid: [225, 1, 62], ..sizes() }.refined(2.0);
        assert_eq!((flat.fluid, flat.fixed, flat.grid), (4 * 211_000, 2 * 357_000, [450, 1, 124]));
    }

    #[test]
    fn ten_million_fit_and_the_first_limit_of_a_hundred_is_named() {
        let ten = Forecast::new(&sizes(), &plan(), 10_000_000);
        assert!(ten.particles.abs_diff(10_000_000) < 1000 && ten.spacing_ratio < 0.4, "{ten:?}");
        assert!(ten.bytes < 24_000_000_000 && ten.excesses.is_empty(), "{ten:?}");
        let hundred = Forecast::new(&sizes(), &plan(), 100_000_000);
        let first = &hundred.excesses[0];
        assert_eq!((first.what.as_str(), first.limit), ("neighbour_list", "max_storage_buffer_binding_size"));
        assert!(hundred.excesses.iter().all(|e| e.what != "fluid particles"), "{hundred:?}");
    }

    #[test]
    fn every_byte_has_a_purpose() {
        let memory = Memory::new(&sizes(), &plan());
        let groups = groups(&memory);
        assert_eq!(groups.iter().map(|g| g.bytes).sum::<u64>(), memory.total());
        assert_eq!((groups[0].name, groups[0].largest), ("neighbour lists", "neighbour_list"));
        let rest = groups.iter().find(|g| g.name == "solids and the rest").expect("solids move");
        assert!(rest.bytes < memory.total() / 50, "{groups:?}");
    }
}
