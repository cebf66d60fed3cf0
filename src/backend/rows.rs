//! The stages that sum over neighbours, a chunk of rows at a time.

use crate::fields::State;
use crate::kernels::{number_density, pressure_gradient, viscosity};
use crate::neighbours::Chunk;
use crate::params::Params;
use crate::row_arrays::RowArrays;
use crate::wide::wide;
use glam::DVec3;

/// What all rows read.
#[derive(Clone, Copy)]
pub struct Shared<'a> {
    /// Constants.
    pub params: &'a Params,
    /// Positions [m].
    pub position: &'a [DVec3],
    /// Velocities [m/s].
    pub velocity: &'a [DVec3],
    /// Fluid slots.
    pub fluid: usize,
    /// Fluid slots that hold a particle.
    pub live: usize,
}

wide! {
    /// Viscous acceleration of the fluid slots from `first` on.
    pub fn viscosity_rows(first: usize, chunk: &Chunk, acceleration: &mut [DVec3], on: Shared) {
        let mut arrays = RowArrays::default();
        for (k, a) in acceleration.iter_mut().enumerate() {
            let row = chunk.pressure(k);
            *a = viscosity::viscosity(first + k, row, on.params, on.fluid, on.position, on.velocity, &mut arrays);
        }
    }
}

wide! {
    /// Weights, number densities and states of the slots from `first` on.
    pub fn density_rows(first: usize, chunk: &mut Chunk, density: &mut [f64], state: &mut [State], on: Shared) {
        let mut arrays = RowArrays::default();
        for k in 0..density.len() {
            let (i, range) = (first + k, chunk.range(k));
            if range.is_empty() {
                (density[k], state[k]) = (0.0, if i < on.live { State::Surface } else { State::Inactive });
                continue;
            }
            let neighbour = &chunk.neighbour[range.clone()];
            (density[k], state[k]) =
                number_density::number_density(i, neighbour, on.params, on.fluid, on.position, &mut arrays);
            chunk.weight[range].copy_from_slice(&arrays.w[..neighbour.len()]);
        }
    }
}

wide! {
    /// Acceleration by the pressure of the fluid slots from `first` on, whose states are `state`.
    pub fn gradient_rows(
        first: usize,
        chunk: &Chunk,
        acceleration: &mut [DVec3],
        state: &[State],
        pressure: &[f64],
        on: Shared,
    ) {
        let mut arrays = RowArrays::default();
        for (k, a) in acceleration.iter_mut().enumerate() {
            let i = first + k;
            *a = DVec3::ZERO;
            if i < on.live {
                *a = pressure_gradient::pressure_gradient(
                    i, chunk.parts(k), state[k], on.params, on.position, pressure, &mut arrays,
                );
            }
        }
    }
}
