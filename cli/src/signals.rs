//! Signals that ask a command to end: the state is saved, unless there is none yet.

use seixo::console::remark;
use seixo::error::{Error, Result};
use seixo::stop::Stop;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Signals that come within so many milliseconds of the first one are that one again: who ends a process and then its group, `timeout` does,
/// sends each of its signals twice.
const AGAIN_MS: u64 = 1000;

/// Exit code of a run that was stopped with its state saved, to be resumed (EX_TEMPFAIL).
pub const RESUME: u8 = 75;

#[cfg(unix)]
const ASKING: [i32; 5] = {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
    [SIGINT, SIGTERM, SIGHUP, SIGUSR1, XCPU]
};
#[cfg(not(unix))]
const ASKING: [i32; 2] = [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM];
/// The limit of processor time is near.
#[cfg(unix)]
const XCPU: i32 = signal_hook::consts::SIGXCPU;

/// Exit code after `signal`: batch systems warn with some of them, and requeue on [`RESUME`].
pub fn exit_code(signal: i32) -> u8 {
    #[cfg(unix)]
    if signal == XCPU || signal == signal_hook::consts::SIGUSR1 {
        return RESUME;
    }
    128 + signal as u8
}

/// What signals ask to end. As long as nobody attends to it, while a scene is built, say, there is nothing to save, and
/// a signal ends the program on the spot with its exit code; so does a second one, see [`is_second`]. Signals that the
/// caller has switched off (nohup) stay so.
///
/// # Errors
/// [`Error::Io`] if the system takes no handlers.
pub fn watch(quiet: bool) -> Result<Stop> {
    let stop = Stop::default();
    let (start, first) = (Instant::now(), Arc::new(AtomicU64::new(0)));
    let ignored = ignored();
    for signal in ASKING.into_iter().filter(|s| ignored >> (s - 1) & 1 == 0) {
        let (attended, asked, first) =
            (stop.attended_cell().clone(), stop.signal_cell().clone(), first.clone());
        let heed = move || {
            if !attended.load(Ordering::SeqCst) {
                signal_hook::low_level::exit(i32::from(exit_code(signal)));
            }
            if is_second(&first, start.elapsed().as_millis() as u64) {
                signal_hook::low_level::exit(128 + signal);
            }
        };
        // SAFETY: the closure reads and writes atomics and the clock, and may call _exit: all are safe in a signal handler.
        unsafe { signal_hook::low_level::register(signal, heed) }
            .and_then(|_| signal_hook::flag::register_usize(signal, asked, signal as usize))
            .map_err(Error::io("signal handler"))?;
    }
    if !quiet {
        tell(stop.clone());
    }
    Ok(stop)
}

/// From now on a file that comes to its limit (`ulimit -f`) is an error of the write, and no end of the program.
pub fn survive_limits() {
    // Where the system takes no handler it ends the program, as it would have.
    #[cfg(unix)]
    // SAFETY: the closure does nothing.
    let _ = unsafe { signal_hook::low_level::register(signal_hook::consts::SIGXFSZ, || {}) };
}

/// Whether a signal at `now` [ms] is a second one, and not the first, nor that again; `first` holds when that came, 0 before.
fn is_second(first: &AtomicU64, now: u64) -> bool {
    match first.compare_exchange(0, now.max(1), Ordering::SeqCst, Ordering::SeqCst) {
        Ok(_) => false,
        Err(first) => now >= first + AGAIN_MS,
    }
}

/// Says that a signal was seen, however long the step in progress takes.
fn tell(stop: Stop) {
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(200));
            if let Some(signal) = stop.signal() {
                remark(&format!(
                    "signal {signal}: the step in progress is finished, or given up if it takes long, and the state saved; \
                     a second signal, a second or more after the first, ends the program at once"
                ));
                return;
            }
        }
    });
}

/// Signals that are switched off, one a bit, where the system tells (Linux).
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("SigIgn:"));
    line.and_then(|bits| u64::from_str_radix(bits.trim(), 16).ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::{AGAIN_MS, is_second};
    use std::sync::atomic::AtomicU64;

    #[test]
    fn what_comes_twice_in_a_moment_is_one_signal() {
        for start in [0, 5000] {
            let first = AtomicU64::new(0);
            let after = |ms: u64| is_second(&first, start + ms);
            assert_eq!([0, 0, 2, AGAIN_MS - 1].map(after), [false; 4]);
            assert!(after(AGAIN_MS + 1));
        }
    }
}
