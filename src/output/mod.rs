//! Files of a run, one format per file; the solver knows none of them.
//!
//! | file | written | holds |
//! |---|---|---|
//! | `case.toml` | at the start | the case with all overrides applied |
//! | `NAME.pvd` | after every frame | the list of frames, for ParaView |
//! | `vtu/fluid_0000.vtu`, `vtu/solids_0000.vtu` | every frame | particles |
//! | `vtu/fluid_0000.pvtu`, `vtu/fluid_0000_0.vtu` ... | every frame on many ranks | the water: the list of its pieces, one a rank |
//! | `vtu/walls.vtu` | once | particles that never move, at t = 0 |
//! | `vtu/last_fluid.vtu`, `vtu/last_solids.vtu` | when a run diverges | the state in which it was found |
//! | `series/NAME/NAME.pvd`, `series/NAME/vtu/` | every frame of it | the same of each `[[output.series]]` |
//! | `monitors.csv`, `bodies.csv`, `gauges.csv` | row by row | tables over time, units in the header |
//! | `pictures/frame_0000.png`, `final.png` | if asked for | pictures of the particles |
//! | `result.json` | at the end, also of a failed run | the summary |
//! | `checkpoint/step_0000000000.seixo` | now and then | the state, see [`crate::checkpoint::file`] |
//! | `.seixo`, `.reserve` | at the start | marker and lock; room for the last word |
//!
//! Whole files appear by rename and tables grow by whole rows, so a killed run leaves nothing that cannot
//! be read.

pub mod digits;
pub mod folder;
mod kept;
pub mod label;
pub mod lock;
pub mod particles;
pub mod picture;
pub mod pieces;
pub mod pvd;
pub mod render;
pub mod replay;
pub mod result;
pub mod slice;
pub mod spare;
pub mod surface;
pub mod table;
pub mod vtu;

pub use crate::whole::write_whole;
