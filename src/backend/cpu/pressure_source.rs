//! [`crate::kernels::pressure_source`], several neighbours at a time.

use super::moment::{moment, pair_vectors};
use super::row_arrays::{Columns, RowArrays, sum};
use super::wide::wide;
use crate::fields::State;
use crate::kernels::Particles;
use crate::kernels::pressure_source::{
    Boundary, compressible_diagonal, laplacian_coefficient, leak_of, number_density_source, wet_share,
};
use crate::lattice::{reach, smooth_weight};
use crate::neighbourhood::{inverse, scale};
use crate::neighbours::{Chunk, Row};
use crate::params::Step;
use crate::scheme::Source;
use glam::DMat3;

wide! {
    /// Right sides and diagonals of the slots from `first` on, whose number densities and states are given.
    pub(crate) fn source_rows(
        first: usize,
        chunk: &Chunk,
        given: (&[f64], &[State]),
        surface_pressure: &[f64],
        out: (&mut [f64], &mut [f64]),
        on: Particles,
        step: &Step,
        arrays: &mut RowArrays,
    ) {
        let ((density, state), (source, diagonal)) = (given, out);
        let c = laplacian_coefficient(on.params);
        let compressible = compressible_diagonal(on.params, step);
        for k in 0..source.len() {
            (source[k], diagonal[k]) = (0.0, 1.0);
            if state[k] != State::Inner {
                continue;
            }
            let links = sum(chunk.pressure(k).weight);
            if links <= 0.0 {
                diagonal[k] = c;
                continue;
            }
            diagonal[k] = c * links + compressible;
            source[k] = match on.params.source {
                Source::NumberDensity => number_density_source(density[k], on.params, step),
                Source::Mixed => {
                    let (source, leak) = mixed_source(first + k, chunk.parts(k), on, step, arrays);
                    diagonal[k] += c * leak;
                    source
                }
            };
            if !surface_pressure.is_empty() {
                source[k] += c * known(chunk.pressure(k), surface_pressure);
            }
        }
    }
}

/// sum w P_s [Pa].
#[inline(always)]
fn known(carriers: Row, surface_pressure: &[f64]) -> f64 {
    carriers.iter().map(|(j, w)| w * surface_pressure[j]).sum()
}

/// Right side of slot `i`, corrected, smooth and balanced, and what is added to its links.
#[inline(always)]
fn mixed_source(
    i: usize,
    (all, carry): (Row, usize),
    on: Particles,
    step: &Step,
    arrays: &mut RowArrays,
) -> (f64, f64) {
    let (params, n) = (on.params, all.neighbour.len());
    let RowArrays { r, v, w, s, e, .. } = arrays;
    let filled = r.offsets(i, all.neighbour, on);
    let (w, s) = (&mut w[..filled], &mut s[..filled]);
    w[..n].copy_from_slice(all.weight);
    w[n..].fill(0.0);
    // The filling has no weight and no part in the smooth sum either.
    s.iter_mut().zip(&*w).for_each(|(s, &w)| *s = smooth_weight(reach(w)));
    let deviation = (1.0 + sum(s)) / params.smooth_density - 1.0;
    let solids = all.neighbour.partition_point(|&j| (j as usize) < on.fluid);
    let room = 1.0 + sum(&s[solids..]);
    pair_vectors(r, w, params.effective_radius, e);
    let m = moment(r, e, filled, scale(on.params), params.dimensions);
    let inverse = inverse(m, params.dimensions).unwrap_or(DMat3::IDENTITY);
    v.differences(i, all.neighbour, on.velocity);
    // Fluid comes first in a row.
    let mut boundary = Boundary::default();
    if i >= on.fluid || solids < n {
        (solids..n).for_each(|k| boundary.add_solid(all.neighbour[k] as usize, w[k], r.at(k), on));
        let across = if i < on.fluid { solids..n } else { 0..solids };
        across.for_each(|k| boundary.add_across(w[k], e.at(k), v.at(k)));
    }
    s.copy_from_slice(w);
    s[carry..].fill(0.0);
    let wet = wet_share(i, sum(s), room, boundary.bodies, on);
    let first_moment = r.weighted_sum(s);
    corrected_products(inverse, e, v, s);
    let divergence = scale(on.params) * (sum(s) - boundary.slide(i, inverse, on));
    let per_time = params.density / step.dt;
    let source = wet * step.relaxation * per_time / step.dt * deviation
        - wet * (1.0 - step.relaxation) * per_time * divergence
        - laplacian_coefficient(params) * params.density * params.gravity.dot(first_moment);
    (source, leak_of(i, wet, on))
}

/// out_k <- v_k . (inverse e_k), with a symmetric `inverse`.
#[inline(always)]
fn corrected_products(inverse: DMat3, e: &Columns, v: &Columns, out: &mut [f64]) {
    let n = out.len();
    let (ex, ey, ez) = (&e.x[..n], &e.y[..n], &e.z[..n]);
    let (vx, vy, vz) = (&v.x[..n], &v.y[..n], &v.z[..n]);
    let [[a, b, c], [_, d, f], [_, _, g]] = inverse.to_cols_array_2d();
    for k in 0..n {
        out[k] = vx[k] * (a * ex[k] + b * ey[k] + c * ez[k])
            + vy[k] * (b * ex[k] + d * ey[k] + f * ez[k])
            + vz[k] * (c * ex[k] + f * ey[k] + g * ez[k]);
    }
}
