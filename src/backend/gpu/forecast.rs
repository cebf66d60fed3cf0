//! Memory of a scene by groups of buffers, and of the same scene with finer particles: what fits, and which limit
//! comes first.

use super::kernels;
use super::layout::FLUID_MAX;
use super::memory::{Allocation, Memory, Sizes};
use super::parts::Division;
use super::shader::Shader;
use crate::error::Result;
use crate::plan::Plan;
use serde::Serialize;

/// Bytes that a shader binds at most on any device [bytes].
pub(crate) const BINDING_MAX: u64 = (1 << 31) - 1;
/// Parts of all buffers that shaders are written for.
const MOST_PARTS: u64 = 1000;
/// Workgroups that a dispatch starts along one dimension.
pub(crate) const WORKGROUPS_MAX: u32 = 65_535;

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
        let (limit, allows) = ("max_storage_buffer_binding_size", BINDING_MAX);
        let needs = buffer.part(allows);
        if needs > allows {
            let devices = needs.div_ceil(allows);
            let remedy = format!("{devices} ranges of slots, or {devices} devices");
            out.push(Excess { what: buffer.id.name().into(), needs, allows, limit, remedy });
        }
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
    /// Buffers that are made as several, since devices do not bind them whole, and of how many parts each.
    pub parts: Vec<(&'static str, u64)>,
    /// Storage buffers of a kernel at most, parts counted; nothing if there are more parts than shaders are written
    /// for.
    pub bindings: Option<u32>,
    /// Workgroups of the largest dispatch.
    pub workgroups: u64,
    /// Rows that it is folded into: more than one where a device starts fewer along one dimension.
    pub rows: u64,
    /// Limits that it does not keep.
    pub excesses: Vec<Excess>,
}

impl Forecast {
    /// Of `sizes` refined to about `particles`, with the shaders' `switches` on.
    ///
    /// # Errors
    /// A shader that is not valid.
    pub fn new(sizes: &Sizes, plan: &Plan, switches: &[&str], particles: u64) -> Result<Self> {
        // Bisection: the number grows with the refinement.
        let (mut low, mut high) = (1e-3_f64, 1e3_f64);
        for _ in 0..60 {
            let middle = (low * high).sqrt();
            if sizes.refined(middle).total < particles { low = middle } else { high = middle }
        }
        Self::at(&sizes.refined(high), plan, switches, 1.0 / high)
    }

    /// Of `sizes`, whose spacing is `spacing_ratio` times that of the scene.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn at(sizes: &Sizes, plan: &Plan, switches: &[&str], spacing_ratio: f64) -> Result<Self> {
        let memory = Memory::new(sizes, plan);
        let division = Division::new(&memory, BINDING_MAX, WORKGROUPS_MAX);
        // Every part is a line of each shader, and no device binds as many.
        let shaders = if division.parts.iter().map(|p| p.count).sum::<u64>() <= MOST_PARTS {
            Some(Shader::all(kernels::planned(plan), switches, &division)?)
        } else {
            None
        };
        Ok(Self {
            particles: sizes.total,
            fluid: sizes.fluid,
            spacing_ratio,
            bytes: memory.total(),
            largest: memory.largest(),
            parts: division.parts.iter().map(|p| (p.buffer, p.count)).collect(),
            bindings: shaders.as_deref().map(Shader::bindings),
            workgroups: memory.workgroups,
            rows: memory.workgroups.div_ceil(WORKGROUPS_MAX.into()).max(1),
            excesses: excesses(sizes, &memory),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes() -> Sizes {
        // The transport case at l0 = 7.5 mm.
        Sizes {
            total: 577_000,
            fluid: 211_000,
            moving_wall: 6_000,
            reacting: 6_000,
            moving: 9_000,
            fixed: 357_000,
            pressure: 333_000,
            pressure_of_all: 0,
            cells: 500_000,
            grid: [225, 36, 62],
            solids: 2,
            absorbers: 1,
            openings: 1,
            emissions: 1,
            capacity: 64,
            rows_per_thread: 1,
        }
    }

    fn forecast(particles: u64) -> Forecast {
        Forecast::new(
            &sizes(),
            &Plan::every_stage(),
            &["COUPLED", "MIXED", "MOVING", "MULTIGRID", "STATIC"],
            particles,
        )
        .expect("the shaders are valid")
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
    fn ten_million_fit_whole_and_a_hundred_in_parts_break_no_limit() {
        let ten = forecast(10_000_000);
        assert!(ten.particles.abs_diff(10_000_000) < 1000 && ten.spacing_ratio < 0.4, "{ten:?}");
        assert!(ten.bytes < 24_000_000_000 && ten.excesses.is_empty(), "{ten:?}");
        assert!(ten.parts.is_empty(), "{ten:?}");
        let hundred = forecast(100_000_000);
        assert!(hundred.bytes < 80_000_000_000 && hundred.excesses.is_empty(), "{hundred:?}");
        assert_eq!(hundred.parts[0].0, "neighbour_list");
        // No part is larger than what is bound, and together they are what there is.
        let memory = Memory::new(&sizes().refined(1.0 / hundred.spacing_ratio), &Plan::every_stage());
        for buffer in &memory.buffers {
            let (part, parts) = (buffer.part(BINDING_MAX), buffer.parts(BINDING_MAX));
            assert!(part <= BINDING_MAX && part * parts >= buffer.bytes && part * (parts - 1) < buffer.bytes);
        }
        assert_eq!((ten.rows, hundred.rows), (1, hundred.workgroups.div_ceil(65_535)));
        // What wgpu has at least, and what graphics cards have by far.
        let bindings = |f: &Forecast| f.bindings.expect("few parts");
        assert!(bindings(&ten) <= 8 && bindings(&hundred) < 64 && hundred.rows > 1, "{hundred:?}");
        // A room of nothing but cells asks for thousands, which no shader is written for.
        let empty = Sizes { cells: 1 << 50, ..sizes() };
        let none = Forecast::at(&empty, &Plan::every_stage(), &[], 1.0).expect("nothing is written");
        assert!(none.bindings.is_none() && none.parts.iter().any(|p| p.1 > 1000), "{none:?}");
        // What cannot be divided is named.
        let thousand = forecast(1_000_000_000);
        assert!(thousand.excesses.iter().any(|e| e.what == "position"), "{thousand:?}");
    }

    #[test]
    fn every_byte_has_a_purpose() {
        let memory = Memory::new(&sizes(), &Plan::every_stage());
        let groups = groups(&memory);
        assert_eq!(groups.iter().map(|g| g.bytes).sum::<u64>(), memory.total());
        assert_eq!((groups[0].name, groups[0].largest), ("neighbour lists", "neighbour_list"));
        let rest = groups.iter().find(|g| g.name == "solids and the rest").expect("solids move");
        assert!(rest.bytes < memory.total() / 50, "{groups:?}");
    }
}
