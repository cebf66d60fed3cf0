//! A parameter loop: how deep a block of wood swims, over its density. Each run starts from the same case, changed in
//! memory.
//!
//! `cargo run --release --example parameter_loop`
#![allow(missing_docs)]

use seixo::{Case, Options, Processor, Result, Simulation};
use std::ops::ControlFlow::Continue;

const CASE: &str = r#"
[run]
spacing = 0.01
time_step = 1e-3
end = 1.5
dimensions = 2

[fluid]
[[fluid.block]]
min = [0, 0, 0]
max = [0.3, 0, 0.12]

[tank]
min = [0, 0, 0]
max = [0.3, 0, 0.2]
open = ["z_max"]

[[body]]
name = "wood"
size = [0.06, 0.01, 0.06]
center = [0.15, 0, 0.12]
density = 500
displaces_fluid = true
locked = ["rotation_y"]

[contact]
spring = 1e4
restitution = 0.3
friction = 0.3
"#;

pub fn main() -> Result<()> {
    let options = Options { processor: Processor::Cpu, ..Options::default() };
    println!("density [kg/m3]   centre [m]");
    for density in [300.0, 500.0, 700.0] {
        let mut case: Case = CASE.parse()?;
        case.body[0].density = Some(density);
        let mut simulation = Simulation::open(&case, &options)?;
        let (mut sum, mut count) = (0.0, 0.0);
        simulation.run_until(case.run.end, |simulation, _| {
            // The mean of the last second: the block heaves.
            if simulation.time > 0.5 {
                sum += simulation.solids().map(|solid| solid.pose.position.z).sum::<f64>();
                count += 1.0;
            }
            Continue(())
        })?;
        println!("{density:>7}           {:.4}", sum / count);
    }
    Ok(())
}
