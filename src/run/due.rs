//! Moments at multiples of an interval.

use crate::checkpoint::Archive;
use crate::error::Result;

/// Moments at multiples of an interval; at every step without one.
#[derive(Clone, Copy, Debug)]
pub struct Due {
    every: Option<f64>,
    next: f64,
}

impl Due {
    /// Every `every` seconds after t = 0; every step if `None`, never if 0 or less.
    pub fn new(every: Option<f64>) -> Self {
        Self { every, next: 1.0 }
    }

    /// Whether `time` [s] has reached the next moment; moves on to the one after.
    pub fn reached(&mut self, time: f64) -> bool {
        match self.every {
            None => true,
            Some(every) if every > 0.0 => {
                // Sums of time steps miss a multiple by some rounding errors.
                let now = (time / every * (1.0 + 1e-12) + 1e-9).floor();
                let reached = now >= self.next;
                if reached {
                    self.next = now + 1.0;
                }
                reached
            }
            Some(_) => false,
        }
    }

    /// Save the next moment, or take it over.
    ///
    /// # Errors
    /// As [`Archive::count`].
    pub fn exchange(&mut self, name: &str, archive: &mut Archive) -> Result<()> {
        let Self { every: _, next } = self;
        archive.number(&format!("due.{name}"), next)
    }
}

#[cfg(test)]
mod tests {
    use super::Due;

    #[test]
    fn moments_are_reached_once_each_in_spite_of_rounding() {
        let mut due = Due::new(Some(0.05));
        let mut time = 0.0;
        let mut count = 0;
        for _ in 0..1000 {
            time += 0.001;
            count += u32::from(due.reached(time));
        }
        assert_eq!(count, 20);
        let mut late = Due::new(Some(0.05));
        assert!(!late.reached(0.049) && late.reached(0.26) && !late.reached(0.299) && late.reached(0.3));
        assert!(!Due::new(Some(0.0)).reached(1.0));
        assert!(Due::new(None).reached(0.0));
    }
}
