//! Prescribed motion: a table of time and displacement.

use glam::DVec3;

/// A motion given by a table: time [s] against displacement from the start [m], constant before the first and
/// after the last row. Two rows make a straight line. More make a cubic an interval with a velocity that is
/// continuous at the rows between, monotone wherever the rows are: it does not overshoot, and a solid that stands
/// between two rows starts and ends at rest (Fritsch & Butland 1984).
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Times [s], increasing.
    pub time: Vec<f64>,
    /// Displacement from the starting position [m], one a time.
    pub displacement: Vec<DVec3>,
}

impl Motion {
    /// Displacement [m] at time `t` [s].
    pub fn displacement(&self, t: f64) -> DVec3 {
        let n = self.time.len();
        match self.time.iter().position(|&ti| t < ti) {
            Some(0) => self.displacement[0],
            Some(k) => {
                let (from, to) = (self.displacement[k - 1], self.displacement[k]);
                let length = self.time[k] - self.time[k - 1];
                let s = (t - self.time[k - 1]) / length;
                if n == 2 {
                    return from.lerp(to, s);
                }
                let (first, last) = (length * self.slope(k - 1), length * self.slope(k));
                let rest = 1.0 - s;
                rest * rest * ((1.0 + 2.0 * s) * from + s * first)
                    + s * s * ((1.0 + 2.0 * rest) * to - rest * last)
            }
            None => self.displacement[n - 1],
        }
    }

    /// Velocity [m/s] just after time `t` [s].
    pub fn velocity(&self, t: f64) -> DVec3 {
        match self.time.iter().position(|&ti| t < ti) {
            None | Some(0) => DVec3::ZERO,
            Some(k) => {
                let length = self.time[k] - self.time[k - 1];
                let secant = (self.displacement[k] - self.displacement[k - 1]) / length;
                if self.time.len() == 2 {
                    return secant;
                }
                let s = (t - self.time[k - 1]) / length;
                let rest = 1.0 - s;
                6.0 * s * rest * secant
                    + rest * (1.0 - 3.0 * s) * self.slope(k - 1)
                    + s * (3.0 * s - 2.0) * self.slope(k)
            }
        }
    }

    /// Largest speed [m/s] between the times `from` and `to` [s], or a little more.
    pub fn fastest(&self, from: f64, to: f64) -> f64 {
        // between two rows a curve is nowhere steeper than at them or than 3/2 of the line
        let straight = self.time.len() == 2;
        let met = (1..self.time.len()).filter(|&k| self.time[k - 1] < to && self.time[k] > from);
        let speed = |k: usize| {
            let way = (self.displacement[k] - self.displacement[k - 1]).length();
            let line = way / (self.time[k] - self.time[k - 1]);
            if straight {
                line
            } else {
                (1.5 * line).max(self.slope(k - 1).length()).max(self.slope(k).length())
            }
        };
        met.map(speed).fold(0.0, f64::max)
    }

    /// Whether the velocity changes between `t` and `t + dt` [s].
    pub(crate) fn bends(&self, t: f64, dt: f64) -> bool {
        let inside = |x: f64| x > t && x < t + dt;
        self.time.len() > 2 || self.time.iter().any(|&x| inside(x))
    }

    /// Velocity [m/s] at row `k`: the harmonic mean of the secants beside it, zero where they turn back; at the
    /// ends the secant.
    fn slope(&self, k: usize) -> DVec3 {
        let secant =
            |k: usize| (self.displacement[k + 1] - self.displacement[k]) / (self.time[k + 1] - self.time[k]);
        if k == 0 {
            return secant(0);
        }
        if k + 1 == self.time.len() {
            return secant(k - 1);
        }
        let (before, after) = (secant(k - 1), secant(k));
        let (h0, h1) = (self.time[k] - self.time[k - 1], self.time[k + 1] - self.time[k]);
        let share = (h0 + 2.0 * h1) / (3.0 * (h0 + h1));
        DVec3::from_array([0, 1, 2].map(|axis| {
            let (a, b) = (before[axis], after[axis]);
            if a * b > 0.0 { a * b / (share * b + (1.0 - share) * a) } else { 0.0 }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(rows: &[(f64, f64)]) -> Motion {
        Motion {
            time: rows.iter().map(|r| r.0).collect(),
            displacement: rows.iter().map(|r| DVec3::new(r.1, 0.0, -2.0 * r.1)).collect(),
        }
    }

    #[test]
    fn the_velocity_is_continuous_and_the_slope_of_the_displacement() {
        let motion = table(&[(0.0, 0.0), (0.5, 0.0), (0.7, 0.1), (1.5, 0.4), (1.6, 0.3), (2.0, 0.3)]);
        for k in 0..2000 {
            let t = 1e-3 * f64::from(k) + 3e-4;
            let slope = (motion.displacement(t + 1e-7) - motion.displacement(t - 1e-7)) / 2e-7;
            assert!((slope - motion.velocity(t)).length() < 1e-6, "{t}: {slope}");
            let jump = (motion.velocity(t + 1e-3) - motion.velocity(t)).length();
            assert!(jump < 0.2, "{t}: {jump}");
            assert!(motion.velocity(t).length() <= motion.fastest(0.0, 2.0) + 1e-12);
        }
        for (t, x) in motion.time.iter().zip(&motion.displacement) {
            assert!((motion.displacement(*t) - *x).length() < 1e-15);
        }
        assert_eq!(motion.displacement(0.3), DVec3::ZERO);
        assert!(motion.displacement(1.55).x <= 0.4 && motion.displacement(1.8).x == 0.3);
    }

    #[test]
    fn two_rows_and_rows_on_a_line_move_evenly() {
        let two = table(&[(0.0, 0.0), (3.0, 0.33)]);
        let many = table(&[(0.0, 0.0), (0.4, 0.044), (1.9, 0.209), (3.0, 0.33)]);
        for k in 0..30 {
            let t = 0.1 * f64::from(k);
            assert!((two.displacement(t) - many.displacement(t)).length() < 1e-15);
            assert!((many.velocity(t) - two.velocity(t)).length() < 1e-12);
        }
        assert!((many.fastest(0.0, 1.0) - 1.5 * two.fastest(0.0, 1.0)).abs() < 1e-12);
    }
}
