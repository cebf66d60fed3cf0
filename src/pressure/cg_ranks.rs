//! Preconditioned conjugate gradients on many ranks, with one sum over all of them an iteration (Chronopoulos & Gear 1989), two where free bodies are in
//! the water.
//!
//! The iterates are those of [`super::cg::solve`]. A p is not multiplied but follows as w + beta A p from w = A z, so that r.z, z.w and what the
//! residual will be are known from one round: |r - alpha q|^2 from products of r, w and the last q, each of them made anew in
//! every iteration. What that costs are a vector and its three passes.

use super::cg::{Precondition, System, Workspace};
use super::{Outcome, PressureReport, Settings};
use crate::body::Wrench;
use crate::fields::State;
use crate::neighbours::CHUNK;
use rayon::prelude::*;

/// Numbers of an iteration: r.z, z.w, r.r, r.w, w.w, and r, w and q times q.
const NUMBERS: usize = 8;

impl System<'_> {
    /// Each of `values` summed over the ranks.
    fn total<const N: usize>(&self, mut values: [f64; N]) -> [f64; N] {
        self.among.iter().for_each(|among| among.share.sum(&mut values));
        values
    }

    /// Brings the copies of other ranks' rows in `p` up to date.
    fn show(&self, mut p: &mut [f64]) {
        self.among.iter().for_each(|among| among.share.swap(&mut [&mut p]));
    }

    /// q <- A p with p shown to those beside. Returns what of p.q this rank's rows are, and what all bodies add.
    fn multiply_shown(&self, p: &mut [f64], q: &mut [f64], sums: &mut Vec<f64>) -> [f64; 2] {
        self.show(p);
        let own = self.multiply_water(p, q, sums);
        let mut forces: Vec<Wrench> = self.bodies.iter().map(|body| body.force(p)).collect();
        if !forces.is_empty() {
            self.among.iter().for_each(|among| among.share.sum_wrenches(&mut forces));
        }
        [own, self.bodies.iter().zip(forces).map(|(body, force)| body.answer(force, q)).sum()]
    }

    /// The numbers of an iteration but for z.w, of this rank's rows.
    fn products(&self, work: &Workspace) -> [f64; NUMBERS] {
        let Workspace { r, z, q, w, .. } = work;
        let parts: Vec<[f64; NUMBERS]> = (
            r.par_chunks(CHUNK),
            z.par_chunks(CHUNK),
            q.par_chunks(CHUNK),
            w.par_chunks(CHUNK),
            self.chunks(),
        )
            .into_par_iter()
            .map(|(r, z, q, w, chunk)| {
                let mut sums = [0.0; NUMBERS];
                if chunk.is_dry() {
                    return sums;
                }
                for k in 0..r.len() {
                    let (r, z, q, w) = (r[k], z[k], q[k], w[k]);
                    let own = [r * z, 0.0, r * r, r * w, w * w, r * q, w * q, q * q];
                    sums.iter_mut().zip(own).for_each(|(sum, v)| *sum += v);
                }
                sums
            })
            .collect();
        parts.iter().fold([0.0; NUMBERS], |mut sum, part| {
            sum.iter_mut().zip(part).for_each(|(sum, v)| *sum += v);
            sum
        })
    }

    /// p <- z + beta p, q <- w + beta q, x += alpha p, r -= alpha q.
    fn step(&self, alpha: f64, beta: f64, x: &mut [f64], work: &mut Workspace) {
        let Workspace { r, z, p, q, w, .. } = work;
        let moved = (x.par_chunks_mut(CHUNK), r.par_chunks_mut(CHUNK), p.par_chunks_mut(CHUNK));
        let (z, q, w) = (z.par_chunks(CHUNK), q.par_chunks_mut(CHUNK), w.par_chunks(CHUNK));
        (moved.0, moved.1, moved.2, z, q, w, self.chunks())
            .into_par_iter()
            .filter(|(.., chunk)| !chunk.is_dry())
            .for_each(|(x, r, p, z, q, w, _)| {
                for k in 0..x.len() {
                    p[k] = z[k] + beta * p[k];
                    q[k] = w[k] + beta * q[k];
                    x[k] += alpha * p[k];
                    r[k] -= alpha * q[k];
                }
            });
    }
}

/// [`super::cg::solve`] of a system of which other ranks have rows. All ranks come to the same numbers.
pub(super) fn solve_on_ranks(
    system: &System,
    b: &[f64],
    x: &mut [f64],
    preconditioner: &mut dyn Precondition,
    settings: &Settings,
    work: &mut Workspace,
) -> PressureReport {
    for v in [&mut work.r, &mut work.z, &mut work.p, &mut work.q, &mut work.w] {
        v.resize(x.len(), 0.0);
    }
    let unknowns = system.state.iter().filter(|&&s| s == State::Inner).count();
    let [unknowns, bb] = system.total([unknowns as f64, system.dot(b, b, &mut work.sums)]);
    let mut report = PressureReport { unknowns: unknowns as usize, ..Default::default() };
    if bb == 0.0 || report.unknowns == 0 {
        x.fill(0.0);
        report.outcome = Outcome::ZeroSource;
        return report;
    }
    system.set_out(settings.warm_start, x, work);
    system.multiply_shown(x, &mut work.q, &mut work.sums);
    let own = system.residual(b, work);
    let [mut rr] = system.total([own]);
    if rr > bb {
        work.start_from_zero(b, x);
        rr = bb;
    }
    let (mut rz_old, mut alpha) = (0.0, 0.0);
    loop {
        report.residual = (rr / bb).sqrt();
        report.outcome = if let Some(end) = work.end(&report, rr, settings) {
            end
        } else {
            preconditioner.expect(rr.sqrt());
            preconditioner.apply(system, &work.r, &mut work.z);
            let Workspace { z, w, sums, .. } = &mut *work;
            let [zw, of_bodies] = system.multiply_shown(z, w, sums);
            let mut own = system.products(work);
            own[1] = zw;
            let [rz, zw, rr_now, rw, ww, rq, wq, qq] = system.total(own);
            let beta = if report.iterations == 0 { 0.0 } else { rz / rz_old };
            // p.q, as p and the last q are conjugate.
            let pq = zw + of_bodies - if beta == 0.0 { 0.0 } else { beta * rz / alpha };
            if rz > 0.0 && pq > 0.0 {
                (rz_old, alpha) = (rz, rz / pq);
                system.step(alpha, beta, x, work);
                // Of the new q = w + beta q.
                let (r_new, new_new) = (rw + beta * rq, ww + 2.0 * beta * wq + beta * beta * qq);
                let left = rr_now - 2.0 * alpha * r_new + alpha * alpha * new_new;
                // What is no number stays none.
                rr = if left < 0.0 { 0.0 } else { left };
                report.iterations += 1;
                continue;
            }
            Outcome::Breakdown
        };
        return report;
    }
}
