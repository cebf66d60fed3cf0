//! Studies: sweeps that compare the solver with analytic results and with the paper's numbers.

pub mod dry;
