//! Level of the pressure where the water fills all its room. Without a free surface Eq. (8) fixes the pressure but for a
//! constant, which alpha alone would set: b_i of mean m gives a level of m / (alpha rho / dt^2), huge beside any difference of
//! pressure. The mean is taken off, and the smallest pressure found is made 0, so that none is cut where a flow pulls.
//! GPU twin: shaders/pressure_level.wgsl

use crate::fields::State;

/// Sum of the right sides `source` over the unknowns, and how many these are.
pub fn sum_source(state: &[State], source: &[f64]) -> [f64; 2] {
    let of = state.iter().zip(source).filter(|(state, _)| **state == State::Inner);
    of.fold([0.0, 0.0], |[sum, count], (_, b)| [sum + b, count + 1.0])
}

/// Takes the mean over the unknowns, of `sum` and `count`, off the right sides `source`.
pub fn subtract_mean(state: &[State], source: &mut [f64], [sum, count]: [f64; 2]) {
    let mean = sum / count.max(1.0);
    let inner = state.iter().zip(source).filter(|(state, _)| **state == State::Inner);
    inner.for_each(|(_, b)| *b -= mean);
}

/// The smallest unknown of `pressure` [Pa]; infinite where there is none.
pub fn lowest(state: &[State], pressure: &[f64]) -> f64 {
    let inner = state.iter().zip(pressure).filter(|(state, _)| **state == State::Inner);
    inner.fold(f64::INFINITY, |least, (_, &p)| least.min(p))
}

/// Makes the smallest unknown of `pressure`, `least` [Pa], 0.
pub fn raise(state: &[State], pressure: &mut [f64], least: f64) {
    let inner = state.iter().zip(pressure).filter(|(state, _)| **state == State::Inner);
    inner.for_each(|(_, p)| *p -= least);
}
