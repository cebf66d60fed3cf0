//! The water's part of the energy ledger: [`crate::kernels::ledger`] over all particles.

use crate::kernels::Particles;
use crate::kernels::cell_list::inside;
use crate::kernels::ledger::{correct_clamp, kick_clamp, kick_work, predict_work, rest_work};
use crate::ledger::{Entry, Ledger};
use crate::neighbours::CHUNK;
use crate::params::{Params, Step};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Work so far, and what it takes to tell the cut of pressures from the pressure.
#[derive(Default)]
pub struct WaterLedger {
    /// Work of the water's entries [J].
    pub work: Ledger,
    /// Pressure as solved [Pa].
    pub solution: Vec<f64>,
    /// Acceleration by it [m/s2].
    pub unclipped: Vec<DVec3>,
}

/// Sums of `of` over the particles `own`, in an order that does not depend on the number of threads.
fn sums<const N: usize>(own: Range<usize>, of: impl Fn(usize) -> [f64; N] + Sync) -> [f64; N] {
    let chunk = |c: usize| {
        let from = own.start + c * CHUNK;
        let slots = from..(from + CHUNK).min(own.end);
        slots.map(&of).fold([0.0; N], |a, b| std::array::from_fn(|k| a[k] + b[k]))
    };
    let parts: Vec<[f64; N]> = (0..own.len().div_ceil(CHUNK)).into_par_iter().map(chunk).collect();
    parts.iter().fold([0.0; N], |a, b| std::array::from_fn(|k| a[k] + b[k]))
}

impl WaterLedger {
    fn add<const N: usize>(&mut self, entries: [Entry; N], params: &Params, sums: [f64; N]) {
        let mass = params.particle_mass();
        entries.into_iter().zip(sums).for_each(|(entry, sum)| self.work.add(entry, mass * sum));
    }

    /// Books `predict`, which is about to run with the viscous accelerations `viscous`.
    pub fn predict(&mut self, own: Range<usize>, on: Particles, viscous: &[DVec3], step: &Step) {
        let of = |i: usize| predict_work(on.position[i], on.velocity[i], viscous[i], on.params, step);
        self.add([Entry::Gravity, Entry::Viscosity, Entry::Clamps], on.params, sums(own, of));
    }

    /// Books `absorber`, which is about to slow particle i down to `slowed(i)`.
    pub fn absorber(
        &mut self,
        own: Range<usize>,
        params: &Params,
        velocity: &[DVec3],
        slowed: impl Fn(usize) -> DVec3 + Sync,
    ) {
        let of = |i: usize| [0.5 * (slowed(i).length_squared() - velocity[i].length_squared())];
        self.add([Entry::Absorber], params, sums(own, of));
    }

    /// Books `shift`, which is about to move particle i by `way(i)`.
    pub fn shift(&mut self, own: Range<usize>, params: &Params, way: impl Fn(usize) -> DVec3 + Sync) {
        self.add([Entry::Shift], params, sums(own, |i| [-params.gravity.dot(way(i))]));
    }

    /// Books the particles that `cell_list` is about to take out.
    pub fn lost(&mut self, own: Range<usize>, on: Particles) {
        let (params, domain) = (on.params, (on.params.domain_min, on.params.domain_max));
        let of = |i: usize| {
            let (x, v) = (params.periodic.wrap(on.position[i]), on.velocity[i]);
            let kept = inside(x, v, domain.0, domain.1, params.dimensions) || !(x + v).is_finite();
            [if kept { 0.0 } else { params.gravity.dot(x) - 0.5 * v.length_squared() }]
        };
        self.add([Entry::Lost], params, sums(own, of));
    }

    /// Books a kick, which is about to run with the accelerations `kick` by what `entry` says.
    pub fn kick(&mut self, entry: Entry, own: Range<usize>, on: Particles, kick: &[DVec3], step: &Step) {
        let of = |i: usize| {
            let (v, a) = (on.velocity[i], kick[i]);
            let clamp = kick_clamp(on.position[i], v, a, on.params, step);
            [kick_work(v, a, a, on.params.gravity, step), clamp]
        };
        self.add([entry, Entry::Clamps], on.params, sums(own, of));
    }

    /// Books `correct`, which is about to run with the accelerations `total` of pressure and gravity.
    pub fn pressure(&mut self, own: Range<usize>, on: Particles, total: &[DVec3], step: &Step) {
        let gravity = on.params.balanced_gravity();
        let of = |i: usize| {
            let (v, a) = (on.velocity[i], total[i]);
            let work = |part| kick_work(v, part, a, on.params.gravity, step);
            let solved = self.unclipped[i];
            let clamp = correct_clamp(on.position[i], v, a, on.params, step);
            let fallen = rest_work(v, a, on.params.gravity, step);
            [work(gravity) + fallen, work(solved - gravity), work(a - solved), clamp]
        };
        let sums = sums(own, of);
        self.add([Entry::Gravity, Entry::Pressure, Entry::Clip, Entry::Clamps], on.params, sums);
    }
}
