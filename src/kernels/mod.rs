//! One kernel, one name: `shaders/NAME.wgsl` runs on the device, `src/kernels/NAME.rs` is its twin, a
//! plain function in f64 that says what the shader must do. [`crate::backend::cpu`] has faster versions of some,
//! which are tested against the twins, and runs them over all particles; device results are measured against it.

pub mod absorber;
pub mod body_force;
pub mod cell_list;
pub mod collision;
pub mod conjugate_gradient;
pub mod correct;
pub mod coupling;
pub mod ledger;
pub mod monitor;
pub mod move_solids;
pub mod multigrid;
pub mod multigrid_levels;
pub mod neighbour_list;
pub mod number_density;
pub mod openings;
pub mod predict;
pub mod pressure_gradient;
pub mod pressure_level;
pub mod pressure_source;
pub mod shift;
pub mod surface_pressure;
pub mod viscosity;
pub mod wall_excess;
pub mod wall_friction;

pub use crate::neighbourhood::Particles;

/// The shaders of the kernels: each with its entry points, what it serves, and what its threads run over. Contact's
/// shaders stand with its laws.
pub mod device {
    use crate::compute::{Kernel, MONITOR_WIDTH, Program, WORKGROUP};
    use crate::plan::{Arrays, ParticleStage, Plan, Stage};

    /// What a shader serves.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Serves {
        /// A stage of its own name.
        Stage(Stage),
        /// Everything that has certain arrays.
        Arrays(Arrays),
    }

    /// What the threads of a stage's first kernel run over.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Over {
        /// Fluid particles.
        Fluid,
        /// Fluid particles, then the walls that keep a reaction.
        FluidAndReaction,
        /// Rows of the neighbour lists.
        Rows,
    }

    /// A shader of the list.
    pub struct File {
        /// Text and kernels.
        pub program: Program,
        /// What needs it.
        pub serves: Serves,
        /// What its threads run over; `None` if it has commands of its own.
        pub over: Option<Over>,
    }

    macro_rules! files {
        ($($file:ident[$width:expr] $serves:ident($what:ident), $over:ident: $($entry:ident)*;)*) => {
            $(crate::compute::kernels!($file[$width]: $($entry)*);)*
            /// The list.
            pub const FILES: &[File] = &[$(File {
                program: Program { name: stringify!($file), text: $file::TEXT, kernels: $file::ALL, buffers: &[] },
                serves: files!(@ $serves $what),
                over: files!(@over $over),
            }),*];
        };
        (@over Own) => { None };
        (@over $over:ident) => { Some(Over::$over) };
        (@ Stage $what:ident) => { Serves::Stage(Stage::$what) };
        (@ Arrays $what:ident) => { Serves::Arrays(Arrays::$what) };
    }

    // File [threads of a workgroup], what needs it, what the threads run over (`Own`: commands of its own): its kernels.
    files! {
        absorber[super::WORKGROUP] Stage(Absorber), Fluid: absorber;
        body_force[super::WORKGROUP] Stage(BodyForce), Own: body_force;
        cell_list[super::WORKGROUP] Stage(CellList), Own: count scan_blocks scan_sums scan_add scatter place;
        collision[super::WORKGROUP] Stage(Collision), FluidAndReaction: collision;
        conjugate_gradient[super::WORKGROUP] Stage(ConjugateGradient), Own:
            pack start_residual start descend ascend multiply advance end_pack end_residual end;
        correct[super::WORKGROUP] Stage(Correct), Fluid: correct kick;
        coupling[super::WORKGROUP] Arrays(Coupling), Own: prepare subtract respond;
        ledger[super::WORKGROUP] Arrays(Ledger), Own:
            absorber_work predict_work lost_work friction_work collision_work pressure_work shift_work as_solved as_clipped;
        monitor[super::MONITOR_WIDTH] Arrays(Fluid), Own: monitor;
        move_solids[super::WORKGROUP] Stage(MoveSolids), Own: move_solids on_surface at_centre;
        multigrid[super::WORKGROUP] Arrays(Multigrid), Own:
            gather down_first down_second down_third down_fourth up_first up_second up_third up_fourth back_first small spread;
        multigrid_levels[super::WORKGROUP] Arrays(Multigrid), Own:
            mark scan_blocks scan_sums number_rows members place_copies galerkin
            coarsen_second coarsen_third coarsen_fourth coarsen_rest;
        neighbour_list[super::WORKGROUP] Stage(NeighbourList), Rows: neighbour_list_main;
        number_density[super::WORKGROUP] Stage(NumberDensity), Rows: number_density_main;
        openings[super::WORKGROUP] Stage(Openings), Own: emit swallow;
        predict[super::WORKGROUP] Stage(Predict), Fluid: predict;
        pressure_gradient[super::WORKGROUP] Stage(PressureGradient), Fluid: pressure_gradient;
        pressure_level[super::WORKGROUP] Arrays(Level), Own: sum_source subtract_mean find_lowest raise;
        pressure_source[super::WORKGROUP] Stage(PressureSource), Rows: pressure_source;
        shift[super::WORKGROUP] Stage(Shift), Fluid: shift;
        surface_pressure[super::WORKGROUP] Stage(SurfacePressure), Rows: surface_pressure_main;
        viscosity[super::WORKGROUP] Stage(Viscosity), FluidAndReaction: viscosity;
        wall_excess[super::WORKGROUP] Arrays(Excess), Own: before_solve after_solve;
        wall_friction[super::WORKGROUP] Stage(WallFriction), Fluid: wall_friction react;
    }

    crate::compute::kernels!(halo[super::WORKGROUP]:
        columns column_starts mark_walls give_motion take_motion give_state take_state give_pressure take_pressure give_search take_search
        give_surface_pressure take_surface_pressure give_head take_head
        give_unknown take_unknown give_wet_cells take_wet_cells give_entries take_entries give_coarse take_coarse);

    /// Buffers of [`HALO`].
    pub mod of_halo {
        crate::compute::buffers! {
            /// Four lists of slots, where they begin, and how many rows of the finest level of multigrid are whose.
            halo_slot: u32, Writes;
            /// What the slots of a list hold.
            halo: f32, Both;
            /// Where the water of each column of cells begins.
            column_start: u32, Reads;
            /// A bit for each cell of the finest level of multigrid: whether it holds unknowns.
            wet_cell: u32, Both;
        }
    }

    /// What the devices of many ranks show each other; no part of a run on one.
    pub const HALO: Program =
        Program { name: "halo", text: halo::TEXT, kernels: halo::ALL, buffers: of_halo::buffer::ALL };

    /// The shaders that `plan` needs.
    pub fn planned(plan: &Plan) -> impl Iterator<Item = &'static Program> {
        let serves = |file: &&File| match file.serves {
            Serves::Stage(stage) => plan.has(stage),
            Serves::Arrays(arrays) => plan.needs(arrays),
        };
        let particles = if plan.wet() { FILES } else { &[] };
        particles.iter().filter(serves).map(|f| &f.program).chain(plan.contact.program)
    }

    /// All shaders, those of contact as well.
    pub fn programs() -> impl Iterator<Item = &'static Program> {
        FILES.iter().map(|f| &f.program).chain([&HALO]).chain(crate::contact::device::PROGRAMS)
    }

    /// Kernel of a stage that is one kernel over particles, and what it runs over; nothing for one with more.
    pub fn of(stage: ParticleStage) -> Option<(Kernel, Over)> {
        let file = FILES.iter().find(|f| f.serves == Serves::Stage(stage.into()))?;
        Some((*file.program.kernels.first()?, file.over?))
    }
}
