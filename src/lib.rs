//! seixo: water that carries solids.
pub mod case;
pub mod error;
pub mod scene;
