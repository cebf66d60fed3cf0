//! A gauge of one's own: the flow of water through the plane x = 0.5 m, from the particles themselves.
//!
//! `cargo run --release --example custom_gauge`
#![allow(missing_docs)]

use seixo::scene::Kind;
use seixo::{Case, Options, Result, Simulation};

/// Volume of water beyond the plane `x` [m3]; of a slice one spacing wide in two dimensions.
fn volume_beyond(simulation: &mut Simulation, x: f64) -> Result<f64> {
    let volume = simulation.params.spacing.powi(3);
    let fields = simulation.fields()?;
    let water = (0..simulation.groups.fluid).filter(|&i| fields.kind[i] == Kind::Fluid);
    Ok(water.filter(|&i| fields.position[i].x > x).count() as f64 * volume)
}

pub fn main() -> Result<()> {
    let mut case: Case = include_str!("../cases/dam_break.toml").parse()?;
    case.run.spacing = 0.03;
    let mut simulation = Simulation::open(&case, &Options::default())?;
    println!("on {}", simulation.backend.description());
    let (mut time, mut volume) = (0.0, volume_beyond(&mut simulation, 0.5)?);
    println!("t [s]    flow [l/s]");
    for k in 1..=8 {
        simulation.run_until(0.05 * f64::from(k), |_, _| std::ops::ControlFlow::Continue(()))?;
        let now = volume_beyond(&mut simulation, 0.5)?;
        println!("{:.3}    {:.2}", simulation.time, 1e3 * (now - volume) / (simulation.time - time));
        (time, volume) = (simulation.time, now);
    }
    Ok(())
}
