//! A dam break, read every tenth step: where the front of the water is, and how much energy is left.
//!
//! `cargo run --release --example dam_break`
#![allow(missing_docs)]

use seixo::{Case, Options, Result, Simulation};
use std::ops::ControlFlow::Continue;

pub fn main() -> Result<()> {
    let case: Case = include_str!("../cases/dam_break_2d.toml").parse()?;
    let mut simulation = Simulation::open(&case, &Options::default())?;
    let start = simulation.observe()?.0;
    println!("t [s]    front [m]   energy [-]");
    simulation.run_until(0.2, |simulation, _| {
        if simulation.steps.is_multiple_of(10)
            && let Ok((water, _)) = simulation.observe()
        {
            let energy = (water.kinetic + water.potential) / (start.kinetic + start.potential);
            println!("{:.4}   {:.4}      {energy:.4}", simulation.time, water.extent_max[0]);
        }
        Continue(())
    })
}
