//! The part of the pressure equation that free bodies bring in, [`crate::kernels::coupling`], never formed: a body
//! adds six sums over its wall layer, and six numbers to each of its rows.

use crate::body::{FreeBody, Wrench};
use crate::kernels::coupling::{product, respond};
use std::ops::Range;

/// A free body in the pressure equation of one step.
#[derive(Clone, Debug)]
pub struct CoupledBody {
    body: FreeBody,
    density_over_volume: f64,
    slots: Range<usize>,
    rows: Vec<Wrench>,
}

impl CoupledBody {
    /// The body whose wall layer takes the slots `slots`, with the `rows` of S, times l0^3; one of zero takes no part.
    /// `density_over_volume` is rho / l0^3 [kg/m6].
    pub fn new(body: FreeBody, density_over_volume: f64, slots: Range<usize>, rows: Vec<Wrench>) -> Self {
        Self { body, density_over_volume, slots, rows }
    }

    /// b - kappa S M^-1 f, with `known` the wrench l0^3 f that acts on the body beside the pressure.
    pub fn subtract_known(&self, known: Wrench, b: &mut [f64]) {
        let y = self.respond(known);
        b[self.slots.clone()].iter_mut().zip(&self.rows).for_each(|(b, row)| *b -= product(row, &y));
    }

    /// S^T p: what the pressures `p` do to the body.
    pub fn force(&self, p: &[f64]) -> Wrench {
        let mut sum = Wrench::default();
        for (row, &p) in self.rows.iter().zip(&p[self.slots.clone()]) {
            sum += Wrench { force: p * row.force, torque: p * row.torque };
        }
        sum
    }

    /// q += kappa S M^-1 `force`, [`Self::force`] of all p. Returns p . (what was added).
    pub fn answer(&self, force: Wrench, q: &mut [f64]) -> f64 {
        let y = self.respond(force);
        q[self.slots.clone()].iter_mut().zip(&self.rows).for_each(|(q, row)| *q += product(row, &y));
        product(&force, &y)
    }

    /// z = r / D on the body's rows, with the diagonal that the body adds to `diagonal`.
    pub fn divide(&self, r: &[f64], diagonal: &[f64], z: &mut [f64]) {
        for (i, row) in self.slots.clone().zip(&self.rows) {
            z[i] = r[i] / (diagonal[i] + product(row, &self.respond(*row)));
        }
    }

    fn respond(&self, wrench: Wrench) -> Wrench {
        respond(&self.body, self.density_over_volume, wrench)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Mobility;
    use crate::kernels::coupling::row;
    use glam::{DMat3, DVec3};

    fn wall() -> Vec<(DVec3, DVec3)> {
        let at = |k: usize| DVec3::new((k as f64).sin(), (2.0 * k as f64).cos(), 0.3 * k as f64);
        // The third is dry.
        (0..5).map(|k| (if k == 2 { DVec3::ZERO } else { at(k) }, at(k + 7))).collect()
    }

    fn body() -> FreeBody {
        FreeBody {
            mobility: Mobility {
                moves: DMat3::from_diagonal(DVec3::new(2.0, 0.0, 3.0)),
                crosses: DMat3::from_cols(
                    DVec3::new(0.3, 0.0, 0.2),
                    DVec3::new(0.1, 0.0, -0.4),
                    DVec3::new(0.5, 0.0, 0.1),
                ),
                turns: DMat3::from_cols(
                    DVec3::new(2.0, 0.1, 0.0),
                    DVec3::new(0.1, 1.0, 0.2),
                    DVec3::new(0.0, 0.2, 3.0),
                ),
            },
            load: Wrench::default(),
        }
    }

    /// kappa S M^-1 S^T, written out: what a pascal on j does to the acceleration of i's area.
    fn dense() -> Vec<Vec<f64>> {
        let (wall, body) = (wall(), body());
        let entry = |i: usize, j: usize| {
            let ((a, x), (b, y)) = (wall[i], wall[j]);
            let Mobility { moves, crosses, turns } = body.mobility;
            let turn = turns * y.cross(b) + crosses.transpose() * b;
            7.0 * a.dot(moves * b + crosses * y.cross(b) + turn.cross(x))
        };
        (0..5).map(|i| (0..5).map(|j| entry(i, j)).collect()).collect()
    }

    #[test]
    fn a_body_adds_what_its_area_does_when_its_pressures_move_it() {
        let rows = wall().into_iter().map(|(area, arm)| row(area, arm)).collect();
        let (coupled, dense) = (CoupledBody::new(body(), 7.0, 3..8, rows), dense());
        let p: Vec<f64> = (0..10).map(|k| (k as f64 - 4.3).powi(2)).collect();
        let mut q = vec![1.0; 10];
        let product = coupled.answer(coupled.force(&p), &mut q);
        let mut sum = 0.0;
        for i in 0..10 {
            let own = (3..8).contains(&i);
            let row: f64 = if own { (0..5).map(|j| dense[i - 3][j] * p[j + 3]).sum() } else { 0.0 };
            assert!((q[i] - 1.0 - row).abs() < 1e-9 * row.abs().max(1.0), "{i}: {} {row}", q[i]);
            sum += p[i] * row;
        }
        assert!(sum > 1.0 && (product - sum).abs() < 1e-9 * sum);
        // Symmetric, and the diagonal is its own.
        let (r, diagonal, mut z) = (vec![1.0; 10], vec![0.5; 10], vec![0.0; 10]);
        coupled.divide(&r, &diagonal, &mut z);
        for i in 0..5 {
            (0..5).for_each(|j| assert!((dense[i][j] - dense[j][i]).abs() < 1e-9));
            assert!((1.0 / z[i + 3] - 0.5 - dense[i][i]).abs() < 1e-9);
        }
    }
}
