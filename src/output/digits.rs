//! Decimals of times and places that are told: enough to tell frames and particles apart in the smallest of scenes.

use crate::case::Case;

/// A number of more than these is read by nobody.
const MOST: f64 = 9.0;

/// Decimals in which numbers differ that lie `gap` apart, and 3 or more.
fn telling(gap: f64) -> usize {
    // Less a little, so that a gap of 0.002 is one of 3 decimals. Frames come late by part of a step: half a gap is told.
    (-(0.5 * gap).log10() - 1e-9).ceil().clamp(3.0, MOST) as usize
}

/// Those of times of `case` [s]: frames of `[output]` differ in them, or tenths of a run without.
pub fn of_time(case: &Case) -> usize {
    let (every, end) = (case.output.every, case.run.end);
    telling(if every > 0.0 { every.min(end) } else { 0.1 * end })
}

/// Those of a moment of a run of `case` [s] that is told by itself: 4 or more.
pub fn of_moment(case: &Case) -> usize {
    of_time(case).max(4)
}

/// Those of places in particles of the spacing `l0` [m]: tenths of a spacing differ in them; 4 or more.
pub fn of_place(l0: f64) -> usize {
    telling(0.1 * l0).max(4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_and_particles_are_told_apart() {
        for (gap, decimals) in [(0.05, 3), (2e-3, 3), (1e-3, 4), (4e-4, 4), (1e-6, 7), (0.0, 9)] {
            assert_eq!(telling(gap), decimals, "{gap}");
            let told: Vec<String> = (0..5).map(|k| format!("{:.decimals$}", gap * f64::from(k))).collect();
            assert!(gap == 0.0 || told.windows(2).all(|pair| pair[0] != pair[1]), "{told:?}");
        }
        assert_eq!([0.02, 2e-4].map(of_place), [4, 5]);
    }
}
