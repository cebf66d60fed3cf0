//! What the fuzz targets do with bytes: the readers of a case, of a saved state and of a curve. Whatever the bytes
//! are, they end in a value or an error.

use seixo::case::file::parse;
use seixo::checkpoint::file::{decode, encode};
use seixo::estimate::Estimate;
use seixo_study::compare::table;

/// A case file: read, checked, and its size estimated from it alone.
pub fn case(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match parse("case.toml", text.to_owned(), &[]) {
        Ok((case, ..)) => assert!(Estimate::new(&case).memory_cpu >= 0.0),
        Err(error) => assert!(!error.to_string().is_empty(), "an error says something"),
    }
}

/// A saved state: what can be read can be written again and read as the same.
pub fn checkpoint(data: &[u8]) {
    match decode(data) {
        Ok((origin, archive)) => {
            let Ok(again) = encode(&origin, &archive) else { return };
            let (_, read) = decode(&again).expect("what was written can be read");
            assert_eq!(read.size(), archive.size());
        }
        Err(error) => assert!(!error.is_empty(), "an error says something"),
    }
}

/// A curve of two columns.
pub fn curve(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match table("curve.csv", text) {
        Ok(rows) => assert!(rows.len() > 1),
        Err(error) => assert!(!error.to_string().is_empty(), "an error says something"),
    }
}
