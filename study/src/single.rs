//! The conjugate gradients in single precision, on the CPU: what f32 can reach at all, measured without a GPU.

use seixo::fields::State;
use seixo::pressure::cg::System;

/// The matrix in compressed rows over the unknowns, rounded to f32.
pub struct Matrix {
    start: Vec<u32>,
    column: Vec<u32>,
    value: Vec<f32>,
    diagonal: Vec<f32>,
    /// Slot of each unknown.
    slot: Vec<usize>,
}

impl Matrix {
    /// Of `system`.
    pub fn new(system: &System) -> Self {
        let slot: Vec<usize> = (0..system.state.len()).filter(|&i| system.state[i] == State::Inner).collect();
        let mut number = vec![u32::MAX; system.state.len()];
        for (k, &i) in slot.iter().enumerate() {
            number[i] = k as u32;
        }
        let (mut start, mut column, mut value) = (vec![0], Vec::new(), Vec::new());
        for &i in &slot {
            for (j, w) in system.neighbours.pressure(i).iter() {
                if number[j] != u32::MAX {
                    column.push(number[j]);
                    value.push((-system.coefficient * w) as f32);
                }
            }
            start.push(column.len() as u32);
        }
        let diagonal = slot.iter().map(|&i| system.diagonal[i] as f32).collect();
        Self { start, column, value, diagonal, slot }
    }

    fn multiply(&self, p: &[f32], q: &mut [f32]) {
        for (k, q) in q.iter_mut().enumerate() {
            let row = self.start[k] as usize..self.start[k + 1] as usize;
            let sum: f32 =
                self.column[row.clone()].iter().zip(&self.value[row]).map(|(&j, v)| v * p[j as usize]).sum();
            *q = self.diagonal[k] * p[k] + sum;
        }
    }

    /// Solve A x = b with Jacobi-preconditioned conjugate gradients from zero: all vectors in f32, dot products
    /// in f64 as a device with tree sums would have them. Returns x over all slots, iterations, and the residual
    /// that the recursion believes in, ||r|| / ||b||.
    pub fn solve(&self, b: &[f64], tolerance: f64, most: u32) -> (Vec<f64>, u32, f64) {
        let n = self.slot.len();
        let dot = |a: &[f32], b: &[f32]| -> f64 {
            a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
        };
        // Scaled to unit size: squares of small numbers must not leave the range.
        let scale = b.iter().fold(0.0_f64, |m, b| m.max(b.abs())).max(f64::MIN_POSITIVE);
        let mut r: Vec<f32> = self.slot.iter().map(|&i| (b[i] / scale) as f32).collect();
        let (mut x, mut p, mut q) = (vec![0.0_f32; n], vec![0.0_f32; n], vec![0.0_f32; n]);
        let norm = dot(&r, &r).sqrt();
        let (mut iterations, mut rz_old, mut residual) = (0, 0.0, 1.0);
        while residual > tolerance && iterations < most && norm > 0.0 {
            let z: Vec<f32> = r.iter().zip(&self.diagonal).map(|(r, d)| r / d).collect();
            let rz = dot(&r, &z);
            let beta = if iterations == 0 { 0.0 } else { (rz / rz_old) as f32 };
            rz_old = rz;
            p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + beta * *p);
            self.multiply(&p, &mut q);
            let pq = dot(&p, &q);
            if rz <= 0.0 || pq <= 0.0 {
                break;
            }
            let alpha = (rz / pq) as f32;
            x.iter_mut().zip(&p).for_each(|(x, p)| *x += alpha * p);
            r.iter_mut().zip(&q).for_each(|(r, q)| *r -= alpha * q);
            residual = dot(&r, &r).sqrt() / norm;
            iterations += 1;
        }
        let mut out = vec![0.0; b.len()];
        for (k, &i) in self.slot.iter().enumerate() {
            out[i] = scale * f64::from(x[k]);
        }
        (out, iterations, residual)
    }
}
