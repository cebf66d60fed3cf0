//! Where water stands before the first step.
//!
//! Water and walls that fit it stand on one lattice, on which the density is even. Beside a solid at any other place, turned or round,
//! particles stand too close to its own, and the pressure that drives them apart would be the start of the run: it threw a body of the
//! water's weight off with 0.2 m/s. So the water finds its places before: the scheme's own steps with gravity, velocities and the
//! motion of solids left out, each of which undoes half of the density's deviation.

use crate::backend::Backend;
use crate::backend::cpu::Cpu;
use crate::error::Result;
use crate::params::{Params, Step};
use crate::plan::{ParticleStage, Plan};
use crate::pressure::Settings;
use crate::scene::{Kind, Scene};
use crate::shape::Nearest;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;

/// Part of the deviation that a step undoes [-].
const RATE: f64 = 0.5;
/// It is done when nothing moves by more than this in a step, over l0.
const ENOUGH: f64 = 0.01;
/// Most steps; 5 to 15 are usual.
const MOST_STEPS: usize = 40;
/// Water nearer than this to a solid off the lattice finds new places, over l0; up to as much again does, and what lies beyond stands still.
const REACH: f64 = 6.0;
/// Particles nearer than this to a node of the lattice stand on it, over l0.
const SLACK: f64 = 1e-3;

/// `scene` with its water near solids that do not stand on its lattice where the density is as even as it can be; a note says how far off.
/// Without such a solid nothing is computed.
///
/// # Errors
/// None that the first step of the run would not have.
pub(crate) fn settle(
    scene: Arc<Scene>,
    params: &Params,
    plan: &Plan,
    settings: Settings,
) -> Result<Arc<Scene>> {
    let (own, held) = if plan.wet() { near(&scene, params) } else { Default::default() };
    if own.is_empty() {
        return Ok(scene);
    }
    // Without bodies that catch water: what stands inside one has to come out.
    let still = Params { gravity: DVec3::ZERO, drive: DVec3::ZERO, body_wall: 0, ..params.clone() };
    let plan = Plan { ledger: false, ..plan.clone() };
    // Water around that stands still: its outermost is a free surface, as the level of a pressure without one is below zero
    // where solids displace too much. Water that fills all its room has no level anyway, and dummies around it.
    let (all, dummies) =
        if params.filled { (own.clone(), held) } else { ([&own[..], &held[..]].concat(), vec![]) };
    let mut part = scene.part(&all, all.len(), &dummies, None);
    part.velocity.fill(DVec3::ZERO);
    let mut cpu = Cpu::new(&part, &still, &plan, settings)?;
    // Any time step gives the same places.
    let step = still.step(0.0, 1.0, 0.0).whole();
    let step = Step { relaxation: RATE, pressure_max: f64::INFINITY, pressure_min: 0.0, ..step };
    for _ in 0..MOST_STEPS {
        for stage in ParticleStage::TO_SOURCE {
            cpu.run(stage, &step)?;
        }
        cpu.solve_pressure(&step)?;
        cpu.run(ParticleStage::PressureGradient, &step)?;
        cpu.run(ParticleStage::Correct, &step)?;
        // What a particle has moved by in a step of one second.
        let fastest = cpu.fields().velocity.iter().map(|v| v.length()).fold(0.0, f64::max);
        let fields = cpu.fields_mut();
        fields.velocity.fill(DVec3::ZERO);
        for (at, &id) in
            fields.position.iter_mut().zip(&fields.id).filter(|(_, id)| **id as usize >= own.len())
        {
            *at = scene.position[all[id as usize]];
        }
        if fastest * step.dt < ENOUGH * scene.spacing {
            break;
        }
    }
    let mut scene = Arc::unwrap_or_clone(scene);
    scene.uneven = true;
    let (mut moved, mut farthest) = (0, 0.0_f64);
    let fields = cpu.fields();
    for ((&to, &id), &kind) in fields.position.iter().zip(&fields.id).zip(&fields.kind) {
        let Some(&slot) = own.get(id as usize).filter(|_| kind == Kind::Fluid) else { continue };
        let at = &mut scene.position[slot];
        let way = params.periodic.nearest(to - *at).length() / scene.spacing;
        *at = to;
        moved += usize::from(way > ENOUGH);
        farthest = farthest.max(way);
    }
    if moved > 0 {
        let note = format!(
            "water: {moved} particles near solids off its lattice start up to {farthest:.2} spacings beside it, where they lie evenly"
        );
        scene.notes.push(note);
    }
    Ok(Arc::new(scene))
}

/// Slots of the water that may move, and of that around it.
fn near(scene: &Scene, params: &Params) -> (Vec<usize>, Vec<usize>) {
    let (water, l0) = (0..scene.water(), scene.spacing);
    let on_lattice = |x: DVec3| {
        let mut off = (x - scene.node) / l0;
        off -= off.round();
        off.abs().max_element() < SLACK
    };
    let solids = scene.position[scene.groups.fluid..].iter().copied();
    let off: Vec<[f64; 3]> = solids.filter(|&x| !on_lattice(x)).map(|x| x.to_array()).collect();
    if off.is_empty() {
        return (Vec::new(), Vec::new());
    }
    if params.periodic.is_any() {
        return (water.collect(), Vec::new());
    }
    let off = Nearest::new(off);
    let reach = ((REACH + SLACK) * l0).max(params.effective_radius);
    let within = |slots: Vec<usize>, reach: f64| -> (Vec<usize>, Vec<usize>) {
        slots.into_par_iter().partition(|&i| off.has_within(scene.position[i].to_array(), reach))
    };
    let (near, _) = within(water.collect(), 2.0 * reach);
    within(near, reach)
}
