//! [`crate::kernels::pressure_gradient`], several neighbours at a time.

use super::moment::{moment, pair_vectors};
use super::row_arrays::RowArrays;
use super::wide::wide;
use crate::fields::State;
use crate::kernels::Particles;
use crate::kernels::pressure_gradient::{acceleration, is_corrected};
use crate::neighbourhood::{inverse, scale};
use crate::neighbours::{Chunk, Row};
use glam::DVec3;

wide! {
    /// Acceleration by the pressure of the fluid slots from `first` on, whose states are `state`; only those below
    /// `live` hold a particle.
    pub(crate) fn gradient_rows(
        first: usize,
        live: usize,
        chunk: &Chunk,
        accelerations: &mut [DVec3],
        state: &[State],
        pressure: &[f64],
        on: Particles,
    ) {
        let mut arrays = RowArrays::default();
        for (k, a) in accelerations.iter_mut().enumerate() {
            let i = first + k;
            *a = DVec3::ZERO;
            if i < live {
                let gradient = pressure_gradient(i, chunk.parts(k), state[k], on, pressure, &mut arrays);
                *a = acceleration(gradient, on.params);
            }
        }
    }
}

/// grad P at slot `i` [Pa/m].
#[inline(always)]
fn pressure_gradient(
    i: usize,
    (all, carry): (Row, usize),
    state: State,
    on: Particles,
    pressure: &[f64],
    arrays: &mut RowArrays,
) -> DVec3 {
    let corrected = is_corrected(state, on.params);
    let n = if corrected { all.neighbour.len() } else { carry };
    let RowArrays { r, e, w: p, s: w, .. } = arrays;
    let filled = r.differences(i, &all.neighbour[..n], on.position);
    let (p, w) = (&mut p[..filled], &mut w[..filled]);
    let mut minimum = pressure[i];
    for (p, &j) in p.iter_mut().zip(&all.neighbour[..carry]) {
        *p = pressure[j as usize];
        minimum = minimum.min(*p);
    }
    p[..carry].iter_mut().for_each(|p| *p -= minimum);
    p[carry..].fill(0.0);
    w[..n].copy_from_slice(&all.weight[..n]);
    w[n..].fill(0.0);
    pair_vectors(r, w, e);
    let gradient = scale(on) * e.weighted_sum(p);
    if corrected
        && let Some(inverse) =
            inverse(moment(r, e, filled, scale(on), on.params.dimensions), on.params.dimensions)
    {
        return inverse * gradient;
    }
    gradient
}
