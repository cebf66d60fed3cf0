//! The threads of the CPU path.

use crate::error::{Error, Result};

/// Most threads that can be asked for.
pub const MOST: i64 = 1024;

/// Start the threads of the CPU path: `count`, or one a core. Call it once, before anything else runs.
///
/// # Errors
/// [`Error::Io`] if the system does not let so many start.
pub fn start(count: Option<u16>) -> Result<()> {
    let threads = count.map_or(0, usize::from);
    let started = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    started.map_err(|e| {
        let asked = count.map_or("one thread a core".to_owned(), |n| format!("{n} threads"));
        let hint = "the system does not let them start; use fewer with --threads, or raise the limit (ulimit -u, -v)";
        Error::io(asked)(std::io::Error::other(format!("{e}: {hint}")))
    })
}
