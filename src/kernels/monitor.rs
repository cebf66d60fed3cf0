//! Sums over the fluid for the monitors.
//! GPU twin: shaders/monitor.wgsl

use crate::fields::{Fields, State};
use crate::monitor::{FluidMonitor, SPEED_BINS};
use crate::neighbours::CHUNK;
use crate::params::Params;
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Sums of a chunk of particles.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sums {
    particles: u64,
    kinetic: f64,
    potential: f64,
    momentum: DVec3,
    position: DVec3,
    speed2_max: f64,
    extent_max: DVec3,
    error: f64,
    error_max: f64,
    inner: u64,
    bins: Vec<u32>,
}

/// Speed of the histogram's last bin [m/s]: particles that cross two displacement clamps a step.
pub fn speed_range(params: &Params, dt: f64) -> f64 {
    crate::monitor::SPEED_RANGE * crate::kernels::predict::DISPLACEMENT_MAX * params.spacing / dt
}

/// Sums over the fluid slots `own`, chunk by chunk; `dt` is the current time step [s].
pub fn sums(fields: &Fields, own: Range<usize>, params: &Params, dt: f64) -> Vec<Sums> {
    let per_bin = speed_range(params, dt) / SPEED_BINS as f64;
    (0..own.len().div_ceil(8 * CHUNK))
        .into_par_iter()
        .map(|c| {
            let mut s = Sums {
                particles: 0,
                kinetic: 0.0,
                potential: 0.0,
                momentum: DVec3::ZERO,
                position: DVec3::ZERO,
                speed2_max: 0.0,
                extent_max: DVec3::MIN,
                error: 0.0,
                error_max: 0.0,
                inner: 0,
                bins: vec![0; SPEED_BINS],
            };
            let from = own.start + c * 8 * CHUNK;
            for i in from..(from + 8 * CHUNK).min(own.end) {
                s.particles += 1;
                let (x, v) = (params.periodic.wrap(fields.position[i]), fields.velocity[i]);
                let v2 = v.length_squared();
                s.kinetic += 0.5 * v2;
                s.potential -= params.gravity.dot(x);
                s.momentum += v;
                s.position += x;
                s.speed2_max = s.speed2_max.max(v2);
                s.extent_max = s.extent_max.max(x);
                s.bins[((v2.sqrt() / per_bin) as usize).min(SPEED_BINS - 1)] += 1;
                if fields.state[i] == State::Inner {
                    let error = fields.number_density[i] / params.number_density - 1.0;
                    s.error += error;
                    s.error_max = s.error_max.max(error.abs());
                    s.inner += 1;
                }
            }
            s
        })
        .collect()
}

/// Monitor of the particles of `sums`.
pub fn monitor(sums: &[Sums], params: &Params, dt: f64) -> FluidMonitor {
    let per_bin = speed_range(params, dt) / SPEED_BINS as f64;
    let mass = params.particle_mass();
    let live = sums.iter().map(|s| s.particles).sum::<u64>();
    let mut out = FluidMonitor { particles: live, ..Default::default() };
    let (mut momentum, mut position, mut extent) = (DVec3::ZERO, DVec3::ZERO, DVec3::MIN);
    let mut bins = [0_u64; SPEED_BINS];
    for s in sums {
        out.kinetic += mass * s.kinetic;
        out.potential += mass * s.potential;
        momentum += mass * s.momentum;
        position += s.position;
        out.speed_max = out.speed_max.max(s.speed2_max.sqrt());
        extent = extent.max(s.extent_max);
        out.density_error_mean += s.error;
        out.density_error_max = out.density_error_max.max(s.error_max);
        out.inner += s.inner;
        bins.iter_mut().zip(&s.bins).for_each(|(b, &s)| *b += u64::from(s));
    }
    out.momentum = momentum.to_array();
    out.centroid = (position / live.max(1) as f64).to_array();
    out.extent_max = if live > 0 { extent.to_array() } else { [0.0; 3] };
    out.density_error_mean /= out.inner.max(1) as f64;
    out.speed_most = speed_most(&bins, live, per_bin, out.speed_max);
    out
}

/// Upper edge of the bin below which 99.9 % of `particles` lie [m/s]: the same on every backend. Of the first, which short steps make
/// wider than all that moves, `fastest` at most.
pub fn speed_most(bins: &[u64; SPEED_BINS], particles: u64, per_bin: f64, fastest: f64) -> f64 {
    let allowed = particles / 1000;
    let mut above = 0;
    for k in (0..SPEED_BINS).rev() {
        above += bins[k];
        if above > allowed {
            let edge = (k + 1) as f64 * per_bin;
            return if k == 0 { edge.min(fastest) } else { edge };
        }
    }
    0.0
}
