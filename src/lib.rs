//! seixo: water that carries solids. An incompressible particle method (moving-particle semi-implicit, MPS) with rigid
//! bodies that float, collide and slide, on any GPU (f32) or on the CPU (f64).
//!
//! [`Simulation::open`] is the front door: it builds a [`Case`], chooses a processor and owns what follows.
//!
//! ```
//! use seixo::{Case, Options, Processor, Simulation};
//! use std::ops::ControlFlow;
//!
//! let case: Case = r#"
//!     [run]
//!     spacing = 0.02       # l0 [m]
//!     time_step = 1e-3     # [s]
//!     end = 0.1
//!     dimensions = 2
//!     [fluid]
//!     [[fluid.block]]
//!     min = [0, 0, 0]
//!     max = [0.2, 0, 0.2]
//!     [tank]
//!     min = [0, 0, 0]
//!     max = [0.6, 0, 0.4]
//!     open = ["z_max"]
//! "#
//! .parse()?;
//! let options = Options { processor: Processor::Cpu, ..Options::default() };
//! let mut simulation = Simulation::open(&case, &options)?;
//! simulation.run_until(case.run.end, |simulation, report| {
//!     println!("t = {:.3} s, {} iterations", simulation.time, report.pressure.iterations);
//!     ControlFlow::Continue(())
//! })?;
//! let (water, _) = simulation.observe()?;
//! assert!(water.extent_max[0] > 0.2, "the front has moved: {:?}", water.extent_max);
//! # Ok::<(), seixo::Error>(())
//! ```
//!
//! `examples/` holds three short programs; `docs/architecture.md` shows the rooms of this crate and where to add what.
//!
//! # Map
//!
//! One name stands for a stage everywhere: `shaders/NAME.wgsl` on a GPU, `kernels::NAME` its specification in plain f64,
//! [`plan::Stage`] and the timings, and the test in `tests/twins.rs` that holds one against the other. A step plays them
//! in this order (`step.rs`); [`plan`] leaves out what a scene does not need. Equations are those of Osello, Cheng and
//! Amaro Jr.
//!
//! | equation | kernel and shader | checked by itself in |
//! |---|---|---|
//! | weight (3), n0 (4), lambda (7) | [`lattice`] | `fluid` |
//! | inflow and outflow | [`kernels::openings`], [`openings`] | `openings`, `twins` |
//! | absorption of waves | [`kernels::absorber`] | `twins`, `waves` |
//! | periodic sides | [`periodic`], `offset` in `shaders/common.wgsl` | `periodic`, by brute force over images |
//! | viscosity (2), (6) | [`kernels::viscosity`] | `twins`, study `stability` |
//! | explicit step (2) | [`kernels::predict`] | `twins`, `fluid` |
//! | solids take their pose | [`kernels::move_solids`] | `twins`, `immersed` |
//! | cells and neighbours within re | [`kernels::cell_list`], [`kernels::neighbour_list`] | `twins` by brute force |
//! | friction of walls | [`kernels::wall_friction`] | `kernels`, `twins` |
//! | collision (18) | [`kernels::collision`] | `twins`, `fluid` |
//! | number density (4), free surface | [`kernels::number_density`] | `fluid` |
//! | level of the pressure without a free surface | [`kernels::pressure_level`] | `filled`, `twins` |
//! | pressure of the free surface | [`kernels::surface_pressure`] | `fluid`, `kernels`, `twins` |
//! | source and diagonal of the PPE (8) | [`kernels::pressure_source`] | `fluid`, `twins` |
//! | PPE (8) by conjugate gradients | [`kernels::conjugate_gradient`], [`pressure::cg`] | `fluid`, study `pressure-solve` |
//! | multigrid preconditioner | [`kernels::multigrid`], [`kernels::multigrid_levels`] | `twins`, study `pressure-size` |
//! | pressure gradient (9) | [`kernels::pressure_gradient`] | `fluid` |
//! | correction of v and r | [`kernels::correct`] | `twins`, `fluid` |
//! | spacing of particles | [`kernels::shift`] | `twins`, `kernels` |
//! | force on solids | [`kernels::body_force`] | `immersed` |
//! | contact (10) to (16), friction (20), (21) | [`contact`] | `contact`, `contact_device` |
//! | motion of bodies | [`body`] | `contact` |
//! | energies and guards | [`kernels::monitor`] | `twins` |
pub mod backend;
pub mod body;
pub mod case;
pub mod cells;
mod chance;
pub mod checkpoint;
pub mod compute;
pub mod console;
pub mod contact;
mod cover;
pub mod drag;
pub mod error;
pub mod estimate;
mod extents;
pub mod far;
pub mod fields;
pub mod gauges;
pub mod kernels;
pub mod lattice;
pub mod ledger;
pub mod machine;
pub mod monitor;
pub mod neighbourhood;
pub mod neighbours;
pub mod on_ranks;
mod open;
pub mod openings;
pub mod output;
pub mod params;
pub mod periodic;
pub mod plan;
pub mod pressure;
pub mod probe;
pub mod ranks;
pub mod run;
pub mod scene;
pub mod schemas;
pub mod scheme;
pub mod sense;
mod settle;
pub mod shape;
pub mod share;
pub mod simulation;
pub mod slots;
mod step;
pub mod stop;
pub mod threads;
pub mod time_step;
pub mod waves;
mod whole;

pub use backend::Processor;
pub use case::Case;
pub use error::{Error, Result};
pub use open::{Options, SolidState};
pub use simulation::{Simulation, StepReport};
