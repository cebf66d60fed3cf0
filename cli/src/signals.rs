//! Signals that ask a run to end: the step in progress is finished, then the state is saved.

use seixo::console::remark;
use seixo::error::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
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

/// A number that turns from 0 to that of the signal that asked the run to end. A second signal ends the
/// program on the spot. Signals that the caller has switched off (nohup) stay so.
///
/// # Errors
/// [`Error::Io`] if the system takes no handlers.
pub fn watch(quiet: bool) -> Result<Arc<AtomicUsize>> {
    let stop = Arc::new(AtomicUsize::new(0));
    let armed = Arc::new(AtomicBool::new(false));
    let ignored = ignored();
    for signal in ASKING.into_iter().filter(|s| ignored >> (s - 1) & 1 == 0) {
        // The order matters: at the first signal the shutdown is not armed yet.
        signal_hook::flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&armed))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&armed)))
            .and_then(|_| signal_hook::flag::register_usize(signal, Arc::clone(&stop), signal as usize))
            .map_err(Error::io("signal handler"))?;
    }
    if !quiet {
        tell(Arc::clone(&stop));
    }
    Ok(stop)
}

/// Says that a signal was seen, however long the step in progress takes.
fn tell(stop: Arc<AtomicUsize>) {
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(200));
            let signal = stop.load(Ordering::Relaxed);
            if signal != 0 {
                remark(&format!(
                    "signal {signal}: the step in progress is finished and the state saved; a second signal ends the \
                     program at once"
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
