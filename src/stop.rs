//! Asking a computation to end, also in the middle of a long step.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// How long a step in progress may go on once it should end; a longer one is given up.
const PATIENCE: Duration = Duration::from_millis(500);

/// Asks a computation to end: by a signal, or at a moment. Clones ask the same one.
#[derive(Clone, Debug, Default)]
pub struct Stop {
    signal: Arc<AtomicUsize>,
    attended: Arc<AtomicBool>,
    deadline: Option<Instant>,
    seen: Arc<OnceLock<Instant>>,
}

/// As long as this lives a computation attends to being asked; before and after, nothing does.
#[derive(Debug)]
pub struct Attended(Arc<AtomicBool>);

impl Drop for Attended {
    fn drop(&mut self) {
        self.0.store(false, Ordering::SeqCst);
    }
}

impl Stop {
    /// The same, and at `deadline` at the latest.
    pub fn at(&self, deadline: Option<Instant>) -> Self {
        Self { deadline, seen: Arc::default(), ..self.clone() }
    }

    /// What a signal handler turns from 0 to the number of the signal.
    pub fn signal_cell(&self) -> &Arc<AtomicUsize> {
        &self.signal
    }

    /// Whether somebody attends; a handler may end the program at once if nobody does.
    pub fn attended_cell(&self) -> &Arc<AtomicBool> {
        &self.attended
    }

    /// Attend from now on.
    #[must_use]
    pub fn attend(&self) -> Attended {
        self.attended.store(true, Ordering::SeqCst);
        Attended(self.attended.clone())
    }

    /// The signal that asked.
    pub fn signal(&self) -> Option<i32> {
        i32::try_from(self.signal.load(Ordering::Relaxed)).ok().filter(|&n| n != 0)
    }

    /// Whether the computation should end.
    pub fn is_asked(&self) -> bool {
        self.signal().is_some() || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }

    /// Whether it should have ended a while ago, so that a step in progress is to be given up.
    pub fn is_overdue(&self) -> bool {
        self.is_asked() && self.seen.get_or_init(Instant::now).elapsed() > PATIENCE
    }
}

#[cfg(test)]
mod tests {
    use super::{PATIENCE, Stop};
    use std::sync::atomic::Ordering;
    use std::time::Instant;

    #[test]
    fn a_step_gets_some_patience() {
        let stop = Stop::default();
        assert!(!stop.is_asked() && !stop.is_overdue() && stop.signal().is_none());
        stop.signal_cell().store(2, Ordering::Relaxed);
        assert!(stop.clone().is_asked() && !stop.is_overdue() && stop.signal() == Some(2));
        std::thread::sleep(PATIENCE + PATIENCE / 10);
        assert!(stop.is_overdue());
        let late = Stop::default().at(Some(Instant::now()));
        assert!(late.is_asked() && late.signal().is_none());
    }

    #[test]
    fn nobody_attends_before_and_after() {
        let stop = Stop::default();
        let attends = || stop.attended_cell().load(Ordering::SeqCst);
        assert!(!attends());
        let guard = stop.attend();
        assert!(attends());
        drop(guard);
        assert!(!attends());
    }
}
