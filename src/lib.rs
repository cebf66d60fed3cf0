//! seixo: water that carries solids.
pub mod body;
pub mod case;
pub mod contact;
pub mod error;
pub mod scene;
pub mod study;
