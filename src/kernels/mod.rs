//! One kernel, one name: `shaders/NAME.wgsl` runs on the device, `src/kernels/NAME.rs` is its twin, a
//! plain function in f64 that says what the shader must do. The CPU backend runs the twins over all
//! particles; it is the reference that device results are measured against.

pub mod body_force;
pub mod cell_list;
pub mod collision;
pub mod conjugate_gradient;
pub mod correct;
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
