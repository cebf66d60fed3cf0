//! Level of the pressure where the water fills all its room. Without a free surface Eq. (8) fixes the pressure but for a
//! constant, which alpha alone would set: b_i of mean m gives a level of m / (alpha rho / dt^2), huge beside any difference of
//! pressure. The mean is taken off, and the smallest pressure found is made 0, so that none is cut where a flow pulls.
//! GPU twin: shaders/pressure_level.wgsl

use crate::fields::State;

/// Takes the mean over the unknowns off the right sides `source`.
pub fn subtract_mean(state: &[State], source: &mut [f64]) {
    let unknowns = |(&state, b): (&State, &mut f64)| (state == State::Inner).then_some(*b);
    let of = state.iter().zip(source.iter_mut()).filter_map(unknowns);
    let (sum, count) = of.fold((0.0, 0_usize), |(sum, count), b| (sum + b, count + 1));
    let mean = sum / count.max(1) as f64;
    let inner = state.iter().zip(source).filter(|(state, _)| **state == State::Inner);
    inner.for_each(|(_, b)| *b -= mean);
}

/// Makes the smallest unknown of `pressure` [Pa] 0.
pub fn raise(state: &[State], pressure: &mut [f64]) {
    let inner = state.iter().zip(&*pressure).filter(|(state, _)| **state == State::Inner);
    let least = inner.fold(f64::INFINITY, |least, (_, &p)| least.min(p));
    let inner = state.iter().zip(pressure).filter(|(state, _)| **state == State::Inner);
    inner.for_each(|(_, p)| *p -= least);
}
