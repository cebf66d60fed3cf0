//! How a solid answers what pushes it.

use super::Wrench;
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// A symmetric matrix over forces and torques, or velocities and angular velocities, about a solid's position.
pub type Six = [[f64; 6]; 6];

/// The velocities that an impulse gives a solid: the inverse of its mass and inertia, restricted to what it can do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mobility {
    /// Velocity by impulse [1/kg].
    pub moves: DMat3,
    /// Velocity by angular impulse, and transposed angular velocity by impulse [1/(kg m)].
    pub crosses: DMat3,
    /// Angular velocity by angular impulse [1/(kg m2)].
    pub turns: DMat3,
}

impl Default for Mobility {
    /// Of a solid that nothing moves.
    fn default() -> Self {
        // A matrix is by default the identity, which would let it turn.
        Self { moves: DMat3::ZERO, crosses: DMat3::ZERO, turns: DMat3::ZERO }
    }
}

impl Mobility {
    /// Of a body by itself: 1/mass along each axis [1/kg] and the inverse of its inertia [1/(kg m2)].
    pub fn of_body(inverse_mass: DVec3, inverse_inertia: DMat3) -> Self {
        Self { moves: DMat3::from_diagonal(inverse_mass), crosses: DMat3::ZERO, turns: inverse_inertia }
    }

    /// Velocity and angular velocity that `impulse` gives.
    pub fn answer(&self, impulse: &Wrench) -> (DVec3, DVec3) {
        let Wrench { force, torque } = *impulse;
        (self.moves * force + self.crosses * torque, self.crosses.transpose() * force + self.turns * torque)
    }

    /// With the inertia `added`, symmetric and not negative: (M + A)^-1 = (1 + W A)^-1 W, which holds for a W that locked axes make
    /// singular.
    pub fn with(&self, added: &Six) -> Self {
        let own = self.six();
        // Gauss and Jordan on [1 + W A, W].
        let mut rows: [[f64; 12]; 6] = std::array::from_fn(|i| {
            std::array::from_fn(|j| match j.checked_sub(6) {
                Some(j) => own[i][j],
                None => f64::from(u8::from(i == j)) + (0..6).map(|k| own[i][k] * added[k][j]).sum::<f64>(),
            })
        });
        for at in 0..6 {
            let largest = (at..6).max_by(|&a, &b| rows[a][at].abs().total_cmp(&rows[b][at].abs()));
            rows.swap(at, largest.unwrap_or(at));
            let scale = rows[at][at].recip();
            rows[at].iter_mut().for_each(|x| *x *= scale);
            let pivot = rows[at];
            for (_, row) in rows.iter_mut().enumerate().filter(|(k, _)| *k != at) {
                let factor = row[at];
                row.iter_mut().zip(pivot).for_each(|(x, p)| *x -= factor * p);
            }
        }
        let block = |i: usize, j: usize| {
            DMat3::from_cols_array_2d(&std::array::from_fn(|c| {
                std::array::from_fn(|r| rows[i + r][6 + j + c])
            }))
        };
        // Round-off would leave it a little unsymmetric.
        let even = |m: DMat3| 0.5 * (m + m.transpose());
        let crosses = 0.5 * (block(0, 3) + block(3, 0).transpose());
        Self { moves: even(block(0, 0)), crosses, turns: even(block(3, 3)) }
    }

    fn six(&self) -> Six {
        let part = |i: usize, j: usize| match (i < 3, j < 3) {
            (true, true) => self.moves.col(j)[i],
            (true, false) => self.crosses.col(j - 3)[i],
            (false, true) => self.crosses.col(i - 3)[j],
            (false, false) => self.turns.col(j - 3)[i - 3],
        };
        std::array::from_fn(|i| std::array::from_fn(|j| part(i, j)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inertia_is_added_to_a_body_with_a_locked_axis() {
        let turns = DMat3::from_diagonal(DVec3::new(0.0, 5.0, 0.0));
        let body = Mobility::of_body(DVec3::new(0.5, 0.0, 0.5), turns);
        let mut added = [[0.0; 6]; 6];
        // Along z and about y, and both by each other.
        (added[2][2], added[4][4], added[2][4], added[4][2]) = (6.0, 0.3, -0.4, -0.4);
        let with = body.with(&added);
        let impulse = Wrench { force: DVec3::new(1.0, 9.0, 2.0), torque: DVec3::new(9.0, 0.7, 9.0) };
        let (v, w) = with.answer(&impulse);
        // [2 + 6, -0.4; -0.4, 0.2 + 0.3] (v_z, w_y) = (2, 0.7)
        let det = 8.0 * 0.5 - 0.16;
        assert!((v - DVec3::new(0.5, 0.0, (0.5 * 2.0 + 0.4 * 0.7) / det)).length() < 1e-14, "{v}");
        assert!((w - DVec3::new(0.0, (8.0 * 0.7 + 0.4 * 2.0) / det, 0.0)).length() < 1e-14, "{w}");
        assert_eq!(body.with(&[[0.0; 6]; 6]), body);
    }
}
