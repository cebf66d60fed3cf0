//! Dry scenes with analytic answers by seixo's contact and by Rapier, one after the other in one process: error and CPU time.
//!
//! `cargo run --release --manifest-path peers/Cargo.toml` prints the table.

mod engines;
mod scenes;

use engines::{Engine, State};
use scenes::{Scene, scenes};
use std::error::Error;

/// Time steps [s].
const STEPS: [f64; 3] = [1e-2, 2e-3, 5e-4];
/// Turns of all engines, one after the other, so that all meet the same load of the machine; the shortest time counts.
const TURNS: usize = 3;

/// What `engine` makes of `scene` with steps of `dt` [s]: the value measured, and the CPU time of the steps [s].
fn run(scene: &Scene, engine: Engine, dt: f64) -> Result<(f64, f64), Box<dyn Error>> {
    let (mut measure, mut value) = ((scene.measure)(), f64::NAN);
    let seconds = engine.run(scene, dt, &mut |k: usize, state: &State| value = measure(k, state))?;
    Ok((value, seconds))
}

fn main() -> Result<(), Box<dyn Error>> {
    println!(
        "| scene | exact | step [ms] | {} |",
        Engine::ALL.map(|e| format!("{}: error | CPU ms", e.name())).join(" | ")
    );
    println!("|---|---|---|{}", "---|---|".repeat(Engine::ALL.len()));
    for scene in scenes() {
        for dt in STEPS {
            let mut found = Engine::ALL.map(|_| (f64::NAN, f64::INFINITY));
            for _ in 0..TURNS {
                for (engine, found) in Engine::ALL.into_iter().zip(&mut found) {
                    let (value, seconds) = run(&scene, engine, dt)?;
                    *found = (value, seconds.min(found.1));
                }
            }
            let cells = found.map(|(value, seconds)| {
                format!("{:.1e} | {:.2}", ((value - scene.exact) / scene.scale).abs(), 1e3 * seconds)
            });
            println!("| {} | {:.4} | {} | {} |", scene.name, scene.exact, 1e3 * dt, cells.join(" | "));
        }
    }
    Ok(())
}
