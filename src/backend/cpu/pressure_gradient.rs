//! [`crate::kernels::pressure_gradient`], several neighbours at a time.

use super::moment::{moment, pair_vectors};
use super::row_arrays::{Columns, RowArrays, least, sum};
use super::wide::wide;
use crate::fields::State;
use crate::kernels::Particles;
use crate::kernels::pressure_gradient::{acceleration, held, is_consistent};
use crate::neighbourhood::{inverse, scale};
use crate::neighbours::{Chunk, Row};
use crate::params::Params;
use crate::scheme::Gradient;
use glam::DVec3;

wide! {
    /// Acceleration by the pressure of the fluid slots from `first` on, whose states are `state`, and how unevenly
    /// their neighbours lie if anybody asks; only those below `live` hold a particle.
    pub(crate) fn gradient_rows(
        first: usize,
        live: usize,
        chunk: &Chunk,
        accelerations: &mut [DVec3],
        imbalance: &mut [DVec3],
        state: &[State],
        pressure: &[f64],
        on: Particles,
        dt: f64,
        arrays: &mut RowArrays,
    ) {
        for (k, a) in accelerations.iter_mut().enumerate() {
            let i = first + k;
            let mut one_side = DVec3::ZERO;
            *a = DVec3::ZERO;
            if i < live {
                let gradient;
                (gradient, one_side) =
                    pressure_gradient(i, chunk.parts(k), state[k], on, pressure, arrays);
                *a = held(acceleration(gradient, on.params), i, chunk.parts(k).0, on, dt);
            }
            if let Some(imbalance) = imbalance.get_mut(k) {
                *imbalance = one_side;
            }
        }
    }
}

/// grad P at slot `i` [Pa/m], and its imbalance [1/m], zero on the surface.
#[inline(always)]
fn pressure_gradient(
    i: usize,
    (all, carry): (Row, usize),
    state: State,
    on: Particles,
    pressure: &[f64],
    arrays: &mut RowArrays,
) -> (DVec3, DVec3) {
    let consistent = is_consistent(state, on.params);
    let n = if consistent { all.neighbour.len() } else { carry };
    let RowArrays { r, e, w: p, s: w, h, .. } = arrays;
    let filled = r.offsets(i, &all.neighbour[..n], on);
    let (p, w, h) = (&mut p[..filled], &mut w[..filled], &mut h[..filled]);
    let own = pressure[i];
    for (p, &j) in p.iter_mut().zip(&all.neighbour[..carry]) {
        *p = pressure[j as usize];
    }
    p[carry..].fill(own);
    let mut reference = least(p).min(own);
    if consistent {
        heads(r, h, on.params);
        // Those of dummies stand at the particle's own level.
        p[carry..n].iter_mut().zip(&h[carry..n]).for_each(|(p, h)| *p += h);
        w.iter_mut().zip(&*p).zip(&*h).for_each(|((level, p), h)| *level = p - h);
        reference = reference.max(least(w).min(own));
    } else if on.params.gradient == Gradient::Consistent {
        reference = -own;
    }
    p.iter_mut().for_each(|p| *p -= reference);
    w[..n].copy_from_slice(&all.weight[..n]);
    w[n..].fill(0.0);
    pair_vectors(r, w, on.params.effective_radius, e);
    let gradient = scale(on.params) * e.weighted_sum(p);
    if !consistent {
        return (gradient, DVec3::ZERO);
    }
    let one_side =
        scale(on.params) * DVec3::new(sum(&e.x[..filled]), sum(&e.y[..filled]), sum(&e.z[..filled]));
    let moment = moment(r, e, filled, scale(on.params), on.params.dimensions);
    (inverse(moment, on.params.dimensions).map_or(gradient, |inverse| inverse * gradient), one_side)
}

/// What still water's pressure grows by on the way to each neighbour [Pa].
#[inline(always)]
fn heads(r: &Columns, out: &mut [f64], params: &Params) {
    let n = out.len();
    let (x, y, z) = (&r.x[..n], &r.y[..n], &r.z[..n]);
    let g = params.density * params.gravity;
    for k in 0..n {
        out[k] = g.x * x[k] + g.y * y[k] + g.z * z[k];
    }
}
