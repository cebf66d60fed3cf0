//! Preconditioned conjugate gradients on the CPU.

use super::cg_ranks::solve_on_ranks;
use super::coupling::CoupledBody;
use super::{Outcome, PressureReport, Settings};
use crate::fields::State;
use crate::kernels::conjugate_gradient::apply;
use crate::neighbours::{CHUNK, Chunk, Neighbours};
use crate::share::Share;
use crate::stop::Stop;
use rayon::prelude::*;

/// The system A P = b of one step, A with what free bodies add. Vectors run over all pressure-carrying slots and are zero where the
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
    /// Free bodies in the water.
    pub bodies: &'a [CoupledBody],
    /// The other ranks that have rows of it.
    pub among: Option<Among<'a>>,
}

/// A system of which other ranks have rows: `state` is [`State::Inactive`] there.
#[derive(Clone, Copy)]
pub struct Among<'a> {
    /// What of it is here.
    pub share: &'a Share,
    /// Which slots are unknowns, those that are copies of other ranks' as well.
    pub state: &'a [State],
}

/// Approximates z = A^-1 r.
pub trait Precondition {
    /// z <- B r with B symmetric positive definite; z is zero where the pressure is no unknown.
    fn apply(&mut self, system: &System, r: &[f64], z: &mut [f64]);
    /// The next r has this norm: so many ranks know its size without asking.
    fn expect(&mut self, _norm: f64) {}
}

/// The diagonal, with what free bodies add to it. Multigrid is that of the water alone: a body brings six outliers at
/// most to its spectrum.
pub struct Jacobi;

impl Precondition for Jacobi {
    fn apply(&mut self, system: &System, r: &[f64], z: &mut [f64]) {
        (z.par_chunks_mut(CHUNK), r.par_chunks(CHUNK), system.diagonal.par_chunks(CHUNK), system.chunks())
            .into_par_iter()
            .filter(|(.., chunk)| !chunk.is_dry())
            .for_each(|(z, r, d, _)| z.iter_mut().zip(r).zip(d).for_each(|((z, r), d)| *z = r / d));
        system.bodies.iter().for_each(|b| b.divide(r, system.diagonal, z));
    }
}

/// Vectors kept between solves.
#[derive(Default, Debug)]
pub struct Workspace {
    pub(super) r: Vec<f64>,
    pub(super) z: Vec<f64>,
    pub(super) p: Vec<f64>,
    pub(super) q: Vec<f64>,
    /// A z, on many ranks.
    pub(super) w: Vec<f64>,
    pub(super) sums: Vec<f64>,
    /// A solve that is overdue ends as if its iterations had run out: whoever set this throws the step away.
    pub stop: Stop,
}

impl Workspace {
    /// The last pressure is worse than none: the solve starts from zero.
    pub(super) fn start_from_zero(&mut self, b: &[f64], x: &mut [f64]) {
        x.fill(0.0);
        self.r.copy_from_slice(b);
    }

    /// How a solve that has come as far as `report` ends here, with a residual of this norm; nothing if it goes on.
    pub(super) fn end(&self, report: &PressureReport, norm: f64, settings: &Settings) -> Option<Outcome> {
        if !norm.is_finite() {
            Some(Outcome::NonFinite)
        } else if report.residual <= settings.tolerance {
            Some(Outcome::Converged)
        } else if report.iterations >= settings.max_iterations || self.stop.is_overdue() {
            Some(Outcome::MaxIterations)
        } else {
            None
        }
    }
}

impl System<'_> {
    /// Chunks of rows. Those of dry walls hold no unknowns: nothing is computed there, and vectors stay zero.
    pub(super) fn chunks(&self) -> &[Chunk] {
        &self.neighbours.chunks
    }

    /// q <- A p on the unknowns, 0 elsewhere; the chunks of dry walls stay as they are. Returns p.q.
    pub fn multiply(&self, p: &[f64], q: &mut [f64], sums: &mut Vec<f64>) -> f64 {
        let sum = self.multiply_water(p, q, sums);
        self.bodies.iter().fold(sum, |sum, body| sum + body.answer(body.force(p), q))
    }

    /// The same without what free bodies add.
    pub(super) fn multiply_water(&self, p: &[f64], q: &mut [f64], sums: &mut Vec<f64>) -> f64 {
        (q.par_chunks_mut(CHUNK), self.chunks(), self.state.par_chunks(CHUNK))
            .into_par_iter()
            .enumerate()
            .map(|(c, (q, chunk, state))| {
                if chunk.is_dry() {
                    return 0.0;
                }
                let mut sum = 0.0;
                for (k, (q, &state)) in q.iter_mut().zip(state).enumerate() {
                    let i = c * CHUNK + k;
                    let row = apply(i, chunk.pressure(k), self.coefficient, self.diagonal[i], p);
                    // Chosen afterwards: a jump over single surface particles would cost more than their rows.
                    *q = if state == State::Inner { row } else { 0.0 };
                    sum += *q * p[i];
                }
                sum
            })
            .collect_into_vec(sums);
        sums.iter().sum()
    }

    /// a.b of vectors that are zero in dry chunks, in an order that does not depend on the number of threads.
    pub(super) fn dot(&self, a: &[f64], b: &[f64], sums: &mut Vec<f64>) -> f64 {
        (a.par_chunks(CHUNK), b.par_chunks(CHUNK), self.chunks())
            .into_par_iter()
            .map(|(a, b, chunk)| if chunk.is_dry() { 0.0 } else { product(a, b) })
            .collect_into_vec(sums);
        sums.iter().sum()
    }

    /// Sets x to zero where there is no unknown, or everywhere unless `warm`, and vectors where all is dry.
    pub(super) fn set_out(&self, warm: bool, x: &mut [f64], work: &mut Workspace) {
        let Workspace { r, z, p, .. } = work;
        (
            x.par_chunks_mut(CHUNK),
            r.par_chunks_mut(CHUNK),
            z.par_chunks_mut(CHUNK),
            p.par_chunks_mut(CHUNK),
            self.state.par_chunks(CHUNK),
            self.chunks(),
        )
            .into_par_iter()
            .for_each(|(x, r, z, p, state, chunk)| {
                x.iter_mut().zip(state).for_each(|(x, &s)| {
                    *x = if warm && s == State::Inner { *x } else { 0.0 };
                });
                if chunk.is_dry() {
                    [r, z, p].into_iter().for_each(|v| v.fill(0.0));
                }
            });
    }

    /// r <- b - q. Returns r.r.
    pub(super) fn residual(&self, b: &[f64], work: &mut Workspace) -> f64 {
        let Workspace { r, q, sums, .. } = work;
        (r.par_chunks_mut(CHUNK), b.par_chunks(CHUNK), q.par_chunks(CHUNK), self.chunks())
            .into_par_iter()
            .filter(|(.., chunk)| !chunk.is_dry())
            .for_each(|(r, b, q, _)| r.iter_mut().zip(b).zip(q).for_each(|((r, b), q)| *r = b - q));
        self.dot(r, r, sums)
    }

    /// x += alpha p, r -= alpha q. Returns r.r.
    fn advance(&self, alpha: f64, x: &mut [f64], work: &mut Workspace) -> f64 {
        let Workspace { r, p, q, sums, .. } = work;
        (
            x.par_chunks_mut(CHUNK),
            r.par_chunks_mut(CHUNK),
            p.par_chunks(CHUNK),
            q.par_chunks(CHUNK),
            self.chunks(),
        )
            .into_par_iter()
            .map(|(x, r, p, q, chunk)| {
                let mut sum = 0.0;
                if chunk.is_dry() {
                    return sum;
                }
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
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Dot product, in an order that does not depend on the number of threads.
pub fn dot(a: &[f64], b: &[f64], sums: &mut Vec<f64>) -> f64 {
    (a.par_chunks(CHUNK), b.par_chunks(CHUNK))
        .into_par_iter()
        .map(|(a, b)| product(a, b))
        .collect_into_vec(sums);
    sums.iter().sum()
}

/// [`solve`]; where the preconditioner breaks the iteration down, again with the diagonal alone, from where it
/// stopped. A preconditioner in f32 leaves its range where the diagonal in f64 does not.
pub fn solve_or_fall_back(
    system: &System,
    b: &[f64],
    x: &mut [f64],
    preconditioner: &mut dyn Precondition,
    settings: &Settings,
    work: &mut Workspace,
) -> PressureReport {
    let solve = if system.among.is_some() { solve_on_ranks } else { solve };
    let first = solve(system, b, x, preconditioner, settings, work);
    if first.outcome != Outcome::Breakdown {
        return first;
    }
    let settings = Settings { warm_start: true, ..*settings };
    let again = solve(system, b, x, &mut Jacobi, &settings, work);
    PressureReport { iterations: first.iterations + again.iterations, ..again }
}

/// Solve A x = b, of one rank. `x` holds the start and gets the answer; `b` must be zero where there is no unknown.
pub fn solve(
    system: &System,
    b: &[f64],
    x: &mut [f64],
    preconditioner: &mut dyn Precondition,
    settings: &Settings,
    work: &mut Workspace,
) -> PressureReport {
    for v in [&mut work.r, &mut work.z, &mut work.p, &mut work.q] {
        v.resize(x.len(), 0.0);
    }
    let unknowns = system.state.iter().filter(|&&s| s == State::Inner).count();
    let mut report = PressureReport { unknowns, ..Default::default() };
    let b_norm = system.dot(b, b, &mut work.sums).sqrt();
    if b_norm == 0.0 || unknowns == 0 {
        x.fill(0.0);
        report.outcome = Outcome::ZeroSource;
        return report;
    }
    system.set_out(settings.warm_start, x, work);
    system.multiply(x, &mut work.q, &mut work.sums);
    let mut r_norm = system.residual(b, work).sqrt();
    if r_norm > b_norm {
        work.start_from_zero(b, x);
        r_norm = b_norm;
    }
    let mut rz_old = 0.0;
    loop {
        report.residual = r_norm / b_norm;
        report.outcome = if let Some(end) = work.end(&report, r_norm, settings) {
            end
        } else {
            let Workspace { r, z, p, q, sums, .. } = &mut *work;
            preconditioner.apply(system, r, z);
            let rz = system.dot(r, z, sums);
            if rz > 0.0 {
                let beta = if report.iterations == 0 { 0.0 } else { rz / rz_old };
                rz_old = rz;
                (p.par_chunks_mut(CHUNK), z.par_chunks(CHUNK), system.chunks())
                    .into_par_iter()
                    .filter(|(.., chunk)| !chunk.is_dry())
                    .for_each(|(p, z, _)| p.iter_mut().zip(z).for_each(|(p, z)| *p = z + beta * *p));
                let pq = system.multiply(p, q, sums);
                if pq > 0.0 {
                    r_norm = system.advance(rz / pq, x, work).sqrt();
                    report.iterations += 1;
                    continue;
                }
            }
            Outcome::Breakdown
        };
        return report;
    }
}
