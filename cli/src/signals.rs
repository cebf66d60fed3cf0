//! Signals that ask a command to end: the state is saved, unless there is none yet.

use seixo::console::remark;
use seixo::error::{Error, Result};
use seixo::stop::Stop;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

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
/// a signal ends the program on the spot with its exit code; so does a second one. Signals that the caller has switched
/// off (nohup) stay so.
///
/// # Errors
/// [`Error::Io`] if the system takes no handlers.
pub fn watch(quiet: bool) -> Result<Stop> {
    let stop = Stop::default();
    let second = Arc::new(AtomicBool::new(false));
    let ignored = ignored();
    for signal in ASKING.into_iter().filter(|s| ignored >> (s - 1) & 1 == 0) {
        let (attended, asked) = (stop.attended_cell().clone(), stop.signal_cell().clone());
        let at_once = move || {
            if !attended.load(Ordering::SeqCst) {
                signal_hook::low_level::exit(i32::from(exit_code(signal)));
            }
        };
        // The order matters: at the first signal the second is not expected yet.
        // SAFETY: the closure loads an atomic and may call _exit, both of which are safe in a signal handler.
        unsafe { signal_hook::low_level::register(signal, at_once) }
            .and_then(|_| {
                signal_hook::flag::register_conditional_shutdown(signal, 128 + signal, second.clone())
            })
            .and_then(|_| signal_hook::flag::register(signal, second.clone()))
            .and_then(|_| signal_hook::flag::register_usize(signal, asked, signal as usize))
            .map_err(Error::io("signal handler"))?;
    }
    if !quiet {
        tell(stop.clone());
    }
    Ok(stop)
}

/// Says that a signal was seen, however long the step in progress takes.
fn tell(stop: Stop) {
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(200));
            if let Some(signal) = stop.signal() {
                remark(&format!(
                    "signal {signal}: the step in progress is finished, or given up if it takes long, and the state saved; \
                     a second signal ends the program at once"
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
