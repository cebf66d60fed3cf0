//! seixo: water that carries solids.
pub mod backend;
pub mod body;
pub mod case;
pub mod cells;
pub mod compare;
pub mod contact;
pub mod error;
pub mod fields;
pub mod kernels;
pub mod monitor;
pub mod neighbours;
pub mod params;
pub mod plan;
pub mod pressure;
pub mod scene;
pub mod simulation;
mod step;
