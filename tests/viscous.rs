//! Viscosity beside a free surface: the whole stress acts there, not the part that the Laplacian has.

use crate::common::*;
use glam::DVec3;
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use std::f64::consts::PI;

/// Sum of the water's (r x v) . y [m2/s].
fn angular_momentum(sim: &mut Simulation) -> f64 {
    let fields = sim.backend.read().expect("the fields");
    fields.position.iter().zip(&fields.velocity).take(sim.groups.fluid).map(|(x, v)| x.cross(*v).y).sum()
}

/// A drop of oil that turns: without the part grad v^T of the stress it has 0.68 of its angular momentum left.
#[test]
fn a_viscous_drop_goes_on_turning() {
    let mut sim = simulation(&case(
        "[run]\nspacing = 0.01\ntime_step = 2e-3\nadaptive = true\nend = 1.0\ngravity = [0, 0, 0]\ndimensions = 2\n\
         domain = [[-0.25, -0.25, -0.25], [0.25, 0.25, 0.25]]\n\
         [fluid]\nviscosity = 0.05\n[[fluid.shape]]\nshape = \"cylinder\"\nradius = 0.1\naxis = [0, 1, 0]\n\
         center = [0, 0, 0]\nvelocity_gradient = [[0, 0, 1], [0, 0, 0], [-1, 0, 0]]\n",
    ));
    let begun = angular_momentum(&mut sim);
    while sim.time < 0.05 {
        sim.step().expect("a step");
    }
    let left = angular_momentum(&mut sim) / begun;
    println!("{left:.4} of the angular momentum is left");
    assert!((left - 1.0).abs() < 2e-3, "{left}");
}

/// A standing wave of 1 m in 0.5 m of oil, 40 spacings long: by how much its energy falls in half a period, against that of deep
/// viscous water (Lamb 1932, section 349), s of (s + 2 nu k^2)^2 + omega^2 = 4 nu^2 k^4 sqrt(1 + s / (nu k^2)).
#[test]
fn a_wave_in_oil_decays_as_lamb_has_it() {
    let (nu, k, depth) = (0.02, 2.0 * PI, 0.5);
    let case = case(&format!(
        "[run]\nspacing = 0.025\ntime_step = 1e-3\nadaptive = true\nend = 2.0\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1, 0.1, 0.8]\nperiodic = [\"x\"]\n\
         [fluid]\nviscosity = {nu}\nwall_friction = 0\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0.1, {depth}]\n"
    ));
    let mut scene = Scene::build(&case).expect("the scene builds");
    for i in 0..scene.groups.fluid {
        let x = scene.position[i];
        let (along, up) = ((k * x.z).cosh() * (k * x.x).sin(), (k * x.z).sinh() * (k * x.x).cos());
        scene.velocity[i] = 0.3 / (k * depth).sinh() * DVec3::new(-along, 0.0, up);
    }
    let mut sim = cpu_simulation(&case, scene);
    // The first and second time that the kinetic energy is largest after the start.
    let (mut peaks, mut last) = (Vec::new(), [f64::INFINITY; 2]);
    while peaks.len() < 2 {
        sim.step().expect("a step");
        let fields = sim.backend.read().expect("the fields");
        let energy: f64 = fields.velocity.iter().take(sim.groups.fluid).map(|v| v.length_squared()).sum();
        if last[1] > last[0] && last[1] > energy && peaks.last().is_none_or(|&(t, _)| sim.time > t + 0.2) {
            peaks.push((sim.time, last[1]));
        }
        last = [last[1], energy];
    }
    let rate = (peaks[0].1 / peaks[1].1).ln() / (peaks[1].0 - peaks[0].0) / 2.0;
    println!("peaks {peaks:?}: decay {:.3} of Lamb's 1.207 / s", rate / 1.207);
    assert!((rate / 1.207 - 1.0).abs() < 0.15, "{rate}");
}
