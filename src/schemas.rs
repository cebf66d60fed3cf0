//! The JSON schemas of files, for editors and for what the program says of keys: `schema/` as it is committed.
//!
//! They follow from the types, and a test of each package holds them against those. So only tests are built with
//! what derives schemas, which the program would compile for nothing but these texts.

/// Of case files.
pub const CASE: &str = include_str!("../schema/case.schema.json");

/// Of study and validation files, which the package `seixo-study` reads.
pub const STUDY: &str = include_str!("../schema/study.schema.json");
