//! Preconditioned conjugate gradients on the CPU.

use super::{Outcome, PressureReport, Settings};
use crate::fields::State;
use crate::kernels::conjugate_gradient::apply;
use crate::neighbours::{CHUNK, Neighbours};
use rayon::prelude::*;

/// The system A P = b of one step. Vectors run over all pressure-carrying slots and are zero where the
/// pressure is no unknown.
pub struct System<'a> {
    /// Neighbour lists with weights.
    pub neighbours: &'a Neighbours,
    /// Which slots are unknowns.
    pub state: &'a [State],
    /// Diagonal [1/m2].
    pub diagonal: &'a [f64],
    /// c of [`crate::kernels::pressure_source::laplacian_coefficient`] [1/m2].
    pub coefficient: f64,
}

/// Approximates z = A^-1 r.
pub trait Precondition {
    /// z <- B r with B symmetric positive definite; z is zero where the pressure is no unknown.
    fn apply(&mut self, system: &System, r: &[f64], z: &mut [f64]);
}

/// The diagonal.
pub struct Jacobi;

impl Precondition for Jacobi {
    fn apply(&mut self, system: &System, r: &[f64], z: &mut [f64]) {
        (z.par_chunks_mut(CHUNK), r.par_chunks(CHUNK), system.diagonal.par_chunks(CHUNK))
            .into_par_iter()
            .for_each(|(z, r, d)| z.iter_mut().zip(r).zip(d).for_each(|((z, r), d)| *z = r / d));
    }
}

/// Vectors kept between solves.
#[derive(Default, Debug)]
pub struct Workspace {
    r: Vec<f64>,
    z: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    sums: Vec<f64>,
}

impl System<'_> {
    /// q <- A p on the unknowns, 0 elsewhere. Returns p.q.
    pub fn multiply(&self, p: &[f64], q: &mut [f64], sums: &mut Vec<f64>) -> f64 {
        (q.par_chunks_mut(CHUNK), &self.neighbours.chunks)
            .into_par_iter()
            .enumerate()
            .map(|(c, (q, chunk))| {
                let mut sum = 0.0;
                for (k, q) in q.iter_mut().enumerate() {
                    let i = c * CHUNK + k;
                    *q = 0.0;
                    if self.state[i] == State::Inner {
                        *q = apply(i, chunk.pressure(k), self.coefficient, self.diagonal[i], p);
                        sum += *q * p[i];
                    }
                }
                sum
            })
            .collect_into_vec(sums);
        sums.iter().sum()
    }
}

/// Dot product, in an order that does not depend on the number of threads.
pub fn dot(a: &[f64], b: &[f64], sums: &mut Vec<f64>) -> f64 {
    (a.par_chunks(CHUNK), b.par_chunks(CHUNK))
        .into_par_iter()
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>())
        .collect_into_vec(sums);
    sums.iter().sum()
}

/// Solve A x = b. `x` holds the start and gets the answer; `b` must be zero where there is no unknown.
pub fn solve(
    system: &System,
    b: &[f64],
    x: &mut [f64],
    preconditioner: &mut dyn Precondition,
    settings: &Settings,
    work: &mut Workspace,
) -> PressureReport {
    let n = x.len();
    let Workspace { r, z, p, q, sums } = work;
    for v in [&mut *r, &mut *z, &mut *p, &mut *q] {
        v.resize(n, 0.0);
    }
    let unknowns = system.state.iter().filter(|&&s| s == State::Inner).count();
    let mut report = PressureReport { unknowns, ..Default::default() };
    let b_norm = dot(b, b, sums).sqrt();
    if b_norm == 0.0 || unknowns == 0 {
        x.fill(0.0);
        report.outcome = Outcome::ZeroSource;
        return report;
    }
    for ((x, s), r) in x.iter_mut().zip(system.state).zip(r.iter_mut()) {
        if !settings.warm_start || *s != State::Inner {
            *x = 0.0;
        }
        *r = 0.0;
    }
    system.multiply(x, q, sums);
    r.iter_mut().zip(b).zip(q.iter()).for_each(|((r, b), q)| *r = b - q);
    let mut r_norm = dot(r, r, sums).sqrt();
    if r_norm > b_norm {
        // The last pressure is worse than none: start from zero.
        x.fill(0.0);
        r.copy_from_slice(b);
        r_norm = b_norm;
    }
    let mut rz_old = 0.0;
    loop {
        report.residual = r_norm / b_norm;
        report.outcome = if !r_norm.is_finite() {
            Outcome::NonFinite
        } else if report.residual <= settings.tolerance {
            Outcome::Converged
        } else if report.iterations >= settings.max_iterations {
            Outcome::MaxIterations
        } else {
            preconditioner.apply(system, r, z);
            let rz = dot(r, z, sums);
            if rz > 0.0 {
                let beta = if report.iterations == 0 { 0.0 } else { rz / rz_old };
                rz_old = rz;
                (p.par_chunks_mut(CHUNK), z.par_chunks(CHUNK))
                    .into_par_iter()
                    .for_each(|(p, z)| p.iter_mut().zip(z).for_each(|(p, z)| *p = z + beta * *p));
                let pq = system.multiply(p, q, sums);
                if pq > 0.0 {
                    r_norm = advance(rz / pq, p, q, x, r, sums).sqrt();
                    report.iterations += 1;
                    continue;
                }
            }
            Outcome::Breakdown
        };
        return report;
    }
}

/// x += alpha p, r -= alpha q. Returns r.r.
fn advance(alpha: f64, p: &[f64], q: &[f64], x: &mut [f64], r: &mut [f64], sums: &mut Vec<f64>) -> f64 {
    (x.par_chunks_mut(CHUNK), r.par_chunks_mut(CHUNK), p.par_chunks(CHUNK), q.par_chunks(CHUNK))
        .into_par_iter()
        .map(|(x, r, p, q)| {
            let mut sum = 0.0;
            for k in 0..x.len() {
                x[k] += alpha * p[k];
                r[k] -= alpha * q[k];
                sum += r[k] * r[k];
            }
            sum
        })
        .collect_into_vec(sums);
    sums.iter().sum()
}
