//! Studies: sweeps that compare the solver with analytic results and with the paper's numbers.

pub mod contact_checks;
pub mod contact_rest;
pub mod dry;
pub mod incline;
pub mod spring_drop;
pub mod spring_static;
