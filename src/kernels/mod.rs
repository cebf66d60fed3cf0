//! One kernel, one name: `shaders/NAME.wgsl` runs on the device, `src/kernels/NAME.rs` is its twin, a
//! plain function in f64 that says what the shader must do. [`crate::backend::cpu`] has faster versions of some,
//! which are tested against the twins, and runs them over all particles; device results are measured against it.

pub mod body_force;
pub mod cell_list;
pub mod collision;
pub mod conjugate_gradient;
pub mod correct;
pub mod coupling;
pub mod monitor;
pub mod move_solids;
pub mod multigrid;
pub mod multigrid_levels;
pub mod neighbour_list;
pub mod number_density;
pub mod predict;
pub mod pressure_gradient;
pub mod pressure_source;
pub mod viscosity;

pub use crate::neighbourhood::Particles;
