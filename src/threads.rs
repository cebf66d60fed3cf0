//! The threads of the CPU path.

use crate::error::{Error, Result};

/// Most threads that can be asked for.
pub const MOST: i64 = 1024;

/// Address space that a thread takes: its stack, what guards it, its signal stack [bytes].
const THREAD: usize = (2 << 20) + (256 << 10);

/// Start the threads of the CPU path: `count`, or one a core. Call it once, before anything else runs.
///
/// # Errors
/// [`Error::Io`] if the system does not let so many start.
pub fn start(count: Option<u16>) -> Result<()> {
    let threads = count.map_or(0, usize::from);
    let wrong = |e: String| {
        let asked = count.map_or("one thread a core".to_owned(), |n| format!("{n} threads"));
        let hint = "the system does not let them start; use fewer with --threads, or raise the limit (ulimit -u, -v)";
        Error::io(asked)(std::io::Error::other(format!("{e}: {hint}")))
    };
    // A thread that finds no room for its signal stack ends the program; so that is asked for before.
    let mut room: Vec<u8> = Vec::new();
    let asked = room.try_reserve_exact(threads.saturating_mul(THREAD));
    std::hint::black_box(&mut room);
    drop(room);
    asked.map_err(|_| wrong("no room for their stacks".to_owned()))?;
    let started = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    started.map_err(|e| wrong(e.to_string()))
}
