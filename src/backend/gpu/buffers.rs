//! The table of the particle stages' buffers: what each holds, whom it serves, who needs it and how long it is.
//! Memory, forecast, bindings, traffic and transfers all read it; contact's buffers stand with its laws.

use super::hierarchy::{Hierarchy, Levels};
use super::layout::{
    AbsorberZone, Coefficients, Constants, Emission, FreeBody, LEDGER_WIDTH, MonitorSum, Outlet, Pose, Solve,
    WallParticle, counter,
};
use super::memory::{SCAN_BLOCK, Sizes};
use super::parts::Split;
use crate::compute::{Buffer, Host, Spec, shader_structs};
use crate::monitor::SPEED_BINS;
use crate::plan::Arrays;

shader_structs!(
    AbsorberZone,
    Constants,
    Coefficients,
    Emission,
    FreeBody,
    Hierarchy,
    MonitorSum,
    Outlet,
    Pose,
    Solve,
    WallParticle
);

/// A line of the table.
pub struct Row {
    /// Name, element and host's use.
    pub spec: Spec,
    /// What the buffer serves.
    pub purpose: &'static str,
    /// Which scenes need it.
    pub arrays: Arrays,
    /// How it is divided where a device cannot bind it whole.
    pub split: Split,
    /// Elements.
    pub length: fn(&Sizes, &Levels) -> u64,
}

macro_rules! table {
    ($($purpose:literal { $($(#[$doc:meta])* $name:ident: $element:ty, $host:ident, $arrays:ident, $length:expr $(, $split:expr)?;)* })*) => {
        $($($(#[$doc])* #[allow(non_upper_case_globals, missing_docs)]
            pub const $name: Buffer<$element> = Buffer::new(stringify!($name), Host::$host);)*)*
        /// The table.
        pub const TABLE: &[Row] = &[$($(Row {
            spec: $name.spec(),
            purpose: $purpose,
            arrays: Arrays::$arrays,
            split: table!(@split $($split)?),
            length: $length,
        }),*),*];
    };
    (@split) => { Split::Whole };
    (@split $split:expr) => { $split };
}

/// A plane for each place of a row.
const OF_ROWS: Split = Split::Planes { length: |s, _| s.pressure, pitch: "params.pressure_slots" };
/// A plane for each entry of a stencil.
const OF_STENCILS: Split = Split::Planes { length: |_, l| l.capacity, pitch: "hierarchy.capacity" };

// Name as in the shaders: element, the host's use, the scenes that need it, length of scene `s` with levels `l`, and how it is
// divided. What can be divided is what a hundred million particles take beyond what devices bind, and what cells take, of which
// there may be more than particles.
table! {
    "particles" {
        /// x, y, z and kind, of water with what f32 cannot hold of its place.
        position: [f32; 4], Both, Fluid, |s, _| s.total;
        /// u, v, w and, of the fluid, the word of its number, of moving wall layers where they face.
        velocity: [f32; 4], Both, Fluid, |s, _| s.total;
        pressure: f32, Both, Fluid, |s, _| s.pressure;
        number_density: f32, Both, Fluid, |s, _| s.pressure;
        surface_pressure: f32, Both, SurfacePressure, |s, _| s.pressure;
        state: u32, Both, Fluid, |s, _| s.pressure;
        acceleration: [f32; 4], Both, Fluid, |s, _| s.fluid;
        imbalance: [f32; 4], None, Imbalance, |s, _| s.fluid;
    }
    "neighbour lists" {
        neighbour_list: u32, Both, Fluid, |s, _| s.capacity * s.pressure, OF_ROWS;
        neighbour_count: u32, Both, Fluid, |s, _| s.pressure;
    }
    "pressure solver" {
        source_diagonal: [f32; 2], Both, Fluid, |s, _| s.pressure;
        preconditioned: [f32; 4], Reads, Fluid, |s, _| s.pressure;
        residual: f32, None, Fluid, |s, _| s.pressure;
        search: [f32; 2], None, Fluid, |s, _| s.pressure;
        partial_sum: [f32; 4], Both, Fluid, |s, _| 2 * s.reduction_groups();
        solve: Solve, Both, Fluid, |_, _| 1;
    }
    "pressure on walls" {
        /// Of the walls' rows.
        excess: f32, Reads, Excess, |s, _| (s.pressure - s.fluid).max(1);
        inertia_head: f32, Both, Coupling, |s, _| s.moving_wall;
    }
    "multigrid" {
        hierarchy: Hierarchy, Uniform, Multigrid, |_, _| 1;
        cell_mark: u32, Writes, Multigrid, |_, l| l.cells, Split::Ranges;
        cell_row: [u32; 2], None, Multigrid, |_, l| l.cells, Split::Ranges;
        row_block: [u32; 2], None, Multigrid, |_, l| l.blocks();
        row_cell: [u32; 4], Reads, Multigrid, |_, l| l.capacity + 1 + l.count.len() as u64;
        member: [u32; 2], None, Multigrid, |s, _| s.pressure;
        aggregate: [u32; 2], Writes, Multigrid, |s, _| s.pressure;
        entry: [u32; 2], Reads, Multigrid, |_, l| 27 * l.capacity, OF_STENCILS;
        coarse: f32, None, Multigrid, |_, l| 3 * l.capacity;
        smoothed: f32, None, Multigrid, |s, _| s.pressure;
        corrected: [f32; 4], None, Multigrid, |s, _| s.pressure;
    }
    "ledger" {
        /// Sums of each workgroup, and what they lack.
        ledger_sum: [f32; 2], Both, Ledger, |s, _| LEDGER_WIDTH * s.monitor_groups();
        unclipped: [f32; 4], Writes, Ledger, |s, _| s.fluid;
        clipped: f32, None, Ledger, |s, _| s.pressure;
    }
    "search" {
        cell_of: [u32; 2], None, Fluid, |s, _| s.sorted();
        cell_count: u32, Writes, Fluid, |s, _| s.keys(), Split::Ranges;
        cell_start: u32, Reads, Fluid, |s, _| s.keys() + 1, Split::Ranges;
        block_sum: u32, None, Fluid, |s, _| s.keys().div_ceil(SCAN_BLOCK);
        unsorted: u32, Reads, Fluid, |s, _| s.sorted();
        /// Positions, velocities and pressures of the fluid, one after the other.
        sorted: f32, Reads, Fluid, |s, _| (4 + 4 + 1) * s.fluid, Split::Ranges;
        /// Slot, and where it faces.
        moving_slot: [u32; 2], None, Solids, |s, _| s.moving;
        static_start: u32, Writes, FixedWalls, |s, _| s.cells + 1, Split::Ranges;
        static_particle: [u32; 4], Writes, FixedWalls, |s, _| s.fixed;
    }
    "solids and the rest" {
        params: Constants, Uniform, Fluid, |_, _| 1;
        now: Coefficients, Uniform, Fluid, |_, _| 1;
        counters: u32, Both, Fluid, |_, _| counter::WORDS as u64;
        reaction: [f32; 4], Both, Reaction, |s, _| s.reacting;
        solid_offset: [f32; 4], Writes, Solids, |s, _| s.moving;
        /// Where the wall layer faces, in the solid's frame.
        facing: f32, Writes, Solids, |s, _| s.moving_wall;
        /// From particles of the wall layer, in the solid's frame.
        to_surface: [f32; 4], Writes, Turning, |s, _| s.moving_wall;
        poses: Pose, Writes, Solids, |s, _| s.solids;
        wall_layer: WallParticle, Writes, Force, |s, _| s.moving_wall;
        force_chunk: [u32; 4], Writes, Force, |s, _| s.force_chunks();
        wrench: [f32; 4], Reads, Force, |s, _| 2 * s.force_chunks();
        free_body: FreeBody, Writes, Coupling, |s, _| s.solids;
        /// What the moving-wall slots have of slots between solids, four numbers each; their rows; what each body answers.
        coupling: [f32; 4], Both, Coupling, |s, _| 6 * s.moving_wall + 2 * s.solids;
        absorber_zone: AbsorberZone, Writes, Absorber, |s, _| s.absorbers;
        emission: Emission, Writes, Openings, |s, _| s.emissions;
        outlet: Outlet, Writes, Openings, |s, _| s.openings;
        monitor_sum: MonitorSum, Reads, Fluid, |s, _| s.monitor_groups();
        speed_bin: u32, Both, Fluid, |_, _| SPEED_BINS as u64;
    }
}
