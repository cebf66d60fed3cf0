//! The device against the CPU: the error of every field after every stage of a step that starts from the
//! same state, and how far integral quantities drift apart over many steps.

use glam::DVec3;
use seixo::backend::cpu::Cpu;
use seixo::backend::gpu::Gpu;
use seixo::backend::{Backend, Processor};
use seixo::body::{Pose, Wrench};
use seixo::case::{Case, ContactDevice};
use seixo::error::Result;
use seixo::fields::{Fields, State};
use seixo::neighbours::Neighbours;
use seixo::params::Params;
use seixo::plan::{ContactPlan, ParticleStage, Stage};
use seixo::scene::{Drive, Scene, Solid};
use seixo::simulation::Simulation;
use serde::Serialize;
use std::sync::Arc;
use std::time::Instant;

mod bound;

use bound::Bounds;

/// Error of a field after a stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StageError {
    /// Stage that has written it.
    pub stage: &'static str,
    /// Field.
    pub field: &'static str,
    /// Largest difference over the largest value; for positions over l0, for torques over at least force times
    /// the size of the solids; for states and neighbours the part that differs.
    pub max_relative: f64,
    /// Root mean square of the difference over that of the field, or over the same scales.
    pub l2_relative: f64,
    /// That root mean square of the field on the CPU, in its unit, or the scale.
    pub size: f64,
    /// Largest `l2_relative` that single precision explains; infinite where nobody has asked (see [`compare_stages`]).
    pub bound: f64,
}

impl StageError {
    /// Of a part that differs.
    fn part(stage: Stage, field: &'static str, part: f64) -> Self {
        let (max_relative, l2_relative) = (part, part);
        Self { stage: stage.name(), field, max_relative, l2_relative, size: 1.0, bound: f64::INFINITY }
    }

    /// Whether single precision explains it.
    pub fn is_explained(&self) -> bool {
        self.l2_relative <= self.bound
    }
}

/// Neighbours of a row: those that carry pressure, and dummies.
pub type Neighbourhood = (Vec<u32>, Vec<u32>);

/// The CPU's lists, row by row.
pub fn neighbourhoods(lists: &Neighbours) -> Vec<Neighbourhood> {
    let row = |i: usize| {
        let near = lists.pressure(i).neighbour;
        (near.to_vec(), lists.all(i).neighbour[near.len()..].to_vec())
    };
    (0..lists.rows()).map(row).collect()
}

/// How far two sets of neighbour lists agree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct NeighbourDifference {
    /// Pairs in the second one.
    pub pairs: usize,
    /// Pairs in one but not the other.
    pub differing: usize,
}

/// `fields` with the fluid in the order of the particles' numbers.
pub fn by_number(fields: &Fields) -> Fields {
    let mut slot = vec![0; fields.id.len()];
    for (i, &id) in fields.id.iter().enumerate() {
        slot[id as usize] = i;
    }
    fn sort<T: Copy>(values: &[T], slot: &[usize]) -> Vec<T> {
        let rest = values.get(slot.len()..).unwrap_or(&[]);
        slot.iter().filter_map(|&i| values.get(i)).chain(rest).copied().collect()
    }
    Fields {
        position: sort(&fields.position, &slot),
        velocity: sort(&fields.velocity, &slot),
        kind: sort(&fields.kind, &slot),
        id: sort(&fields.id, &slot),
        pressure: sort(&fields.pressure, &slot),
        number_density: sort(&fields.number_density, &slot),
        surface_pressure: sort(&fields.surface_pressure, &slot),
        state: sort(&fields.state, &slot),
        source: sort(&fields.source, &slot),
        diagonal: sort(&fields.diagonal, &slot),
        acceleration: sort(&fields.acceleration, &slot),
        reaction: fields.reaction.clone(),
        inertia_head: fields.inertia_head.clone(),
    }
}

fn error(stage: Stage, field: &'static str, pairs: &[(DVec3, DVec3)], scale: Option<f64>) -> StageError {
    let (mut most, mut largest, mut square, mut reference) = (0.0_f64, 0.0_f64, 0.0, 0.0);
    for &(a, b) in pairs {
        // What is broken on both sides in the same way (a velocity that is no number) is no difference.
        let difference = if a.is_nan() && b.is_nan() { 0.0 } else { (a - b).length() };
        most = if difference.is_nan() { f64::INFINITY } else { most.max(difference) };
        square += difference * difference;
        if b.is_finite() {
            largest = largest.max(b.length());
            reference += b.length_squared();
        }
    }
    let (largest, reference) = match scale {
        Some(s) => (s, s * (pairs.len().max(1) as f64).sqrt()),
        None => (largest, reference.sqrt()),
    };
    let over = |a: f64, b: f64| if a == 0.0 { 0.0 } else { a / b };
    StageError {
        stage: stage.name(),
        field,
        max_relative: over(most, largest),
        l2_relative: over(square.sqrt(), reference),
        size: reference / (pairs.len().max(1) as f64).sqrt(),
        bound: f64::INFINITY,
    }
}

fn vectors(a: &[DVec3], b: &[DVec3]) -> Vec<(DVec3, DVec3)> {
    a.iter().copied().zip(b.iter().copied()).collect()
}

fn scalars(a: &[f64], b: &[f64]) -> Vec<(DVec3, DVec3)> {
    a.iter().zip(b).map(|(&a, &b)| (DVec3::X * a, DVec3::X * b)).collect()
}

/// Part of two lists that differs.
fn share<T: PartialEq>(stage: Stage, field: &'static str, a: &[T], b: &[T]) -> StageError {
    let differing = a.iter().zip(b).filter(|(a, b)| a != b).count();
    StageError::part(stage, field, differing as f64 / a.len().max(1) as f64)
}

/// Errors of the fields that `stage` writes; both with the fluid [`by_number`].
pub fn differences(stage: Stage, gpu: &Fields, cpu: &Fields, params: &Params) -> Vec<StageError> {
    // At a seam the two may lie at opposite sides.
    let way = |(a, b): (DVec3, DVec3)| {
        (if params.periodic.is_any() { b + params.periodic.nearest(a - b) } else { a }, b)
    };
    let places = || vectors(&gpu.position, &cpu.position).into_iter().map(way).collect::<Vec<_>>();
    let position = || error(stage, "position", &places(), Some(params.spacing));
    let velocity = || error(stage, "velocity", &vectors(&gpu.velocity, &cpu.velocity), None);
    let acceleration = || error(stage, "acceleration", &vectors(&gpu.acceleration, &cpu.acceleration), None);
    let reaction = || error(stage, "reaction", &vectors(&gpu.reaction, &cpu.reaction), None);
    let scalar = |name, a: &[f64], b: &[f64]| error(stage, name, &scalars(a, b), None);
    // The number density of what takes no part is nobody's input (see `neighbour_differences`).
    let part = |i: &usize| gpu.state[*i] != State::Inactive || cpu.state[*i] != State::Inactive;
    let of_parts = |n: &[f64]| -> Vec<f64> { (0..n.len()).filter(part).map(|i| n[i]).collect() };
    match stage {
        Stage::Viscosity => vec![acceleration(), reaction()],
        Stage::Openings | Stage::CellList => {
            vec![position(), velocity(), share(stage, "kind", &gpu.kind, &cpu.kind)]
        }
        Stage::WallFriction | Stage::Collision => vec![position(), velocity(), reaction()],
        Stage::NumberDensity => vec![
            scalar("number_density", &of_parts(&gpu.number_density), &of_parts(&cpu.number_density)),
            share(stage, "state", &gpu.state, &cpu.state),
        ],
        Stage::SurfacePressure => {
            vec![scalar("surface_pressure", &gpu.surface_pressure, &cpu.surface_pressure)]
        }
        Stage::PressureSource => {
            vec![scalar("source", &gpu.source, &cpu.source), scalar("diagonal", &gpu.diagonal, &cpu.diagonal)]
        }
        Stage::ConjugateGradient => vec![scalar("pressure", &gpu.pressure, &cpu.pressure)],
        Stage::PressureGradient => vec![acceleration()],
        Stage::NeighbourList | Stage::BodyForce | Stage::Contact => Vec::new(),
        Stage::Absorber | Stage::Predict | Stage::MoveSolids | Stage::Correct | Stage::Shift => {
            vec![position(), velocity()]
        }
    }
}

/// Compare neighbour lists of the same slots, of which the first `fluid` are fluid; the order within a row does
/// not matter. Rows of walls without fluid in reach are left out: nobody uses them, and whether they are made
/// hangs on the rounding of a wall that stands on the border of two cells.
pub fn neighbour_differences(
    gpu: &[Neighbourhood],
    cpu: &[Neighbourhood],
    fluid: usize,
) -> NeighbourDifference {
    let mut out = NeighbourDifference::default();
    let wet = |row: &Neighbourhood| row.0.iter().any(|&j| (j as usize) < fluid);
    for (_, (a, b)) in gpu.iter().zip(cpu).enumerate().filter(|(i, (a, b))| *i < fluid || wet(a) || wet(b)) {
        for (a, b) in [(&a.0, &b.0), (&a.1, &b.1)] {
            let common = a.iter().filter(|j| b.contains(j)).count();
            out.pairs += b.len();
            out.differing += a.len() + b.len() - 2 * common;
        }
    }
    out
}

/// Rows in the order of the particles' numbers, with numbers in place of fluid slots: water behind a thin solid stands among the dummies.
fn rows_by_number(rows: Vec<Neighbourhood>, id: &[u32]) -> Vec<Neighbourhood> {
    let mut out = vec![Neighbourhood::default(); rows.len()];
    let number = |j: u32| id.get(j as usize).copied().unwrap_or(j);
    for (i, (near, dummies)) in rows.into_iter().enumerate() {
        let numbers = |row: Vec<u32>| row.into_iter().map(number).collect();
        out[number(i as u32) as usize] = (numbers(near), numbers(dummies));
    }
    out
}

/// Errors of force and torque. A torque may vanish by symmetry: its scale is at least force times the size of
/// the largest solid.
fn wrenches(stage: Stage, gpu: &[Wrench], cpu: &[Wrench], solids: &[Solid], weight: f64) -> Vec<StageError> {
    let most = |f: fn(&Wrench) -> DVec3| cpu.iter().map(|w| f(w).length()).fold(0.0, f64::max);
    let sizes = solids.iter().map(|s| s.radius());
    let force = most(|w| w.force).max(weight);
    let scale = most(|w| w.torque).max(force * sizes.fold(0.0, f64::max));
    let pairs =
        |f: fn(&Wrench) -> DVec3| -> Vec<_> { gpu.iter().zip(cpu).map(|(a, b)| (f(a), f(b))).collect() };
    vec![
        error(stage, "force", &pairs(|w| w.force), (weight > 0.0).then_some(force)),
        error(stage, "torque", &pairs(|w| w.torque), Some(scale)),
    ]
}

/// The two backends in the same state.
struct Pair {
    cpu: Cpu,
    gpu: Gpu,
    params: Params,
}

impl Pair {
    fn errors(&mut self, stage: Stage) -> Result<Vec<StageError>> {
        let (gpu, cpu) = (self.gpu.read()?, self.cpu.read()?);
        if stage == Stage::NeighbourList {
            let a = rows_by_number(self.gpu.neighbours()?, &gpu.id);
            let b = rows_by_number(neighbourhoods(self.cpu.neighbours()), &cpu.id);
            let d = neighbour_differences(&a, &b, cpu.id.len());
            return Ok(vec![StageError::part(stage, "pairs", d.differing as f64 / d.pairs.max(1) as f64)]);
        }
        Ok(differences(stage, &by_number(&gpu), &by_number(&cpu), &self.params))
    }
}

/// `case` for the CPU, which has no device for its contact.
fn for_cpu(case: &Case) -> Case {
    let mut case = case.clone();
    case.contact.iter_mut().for_each(|c| c.device = ContactDevice::Host);
    case
}

/// Error of every field after every stage of one step, device (`adapter` as in [`Gpu::new`]) against CPU, each with
/// its bound. The step starts from the state that `warmup` steps on the CPU lead to, rounded to f32 for both. Errors
/// pass from stage to stage, as they do in a run.
pub fn compare_stages(
    case: &Case,
    scene: &Arc<Scene>,
    adapter: Option<&str>,
    warmup: u64,
) -> Result<Vec<StageError>> {
    ContactPlan::on_device(case, scene).refuse(case, scene)?;
    let mut simulation = Simulation::on(&for_cpu(case), scene.clone(), &Processor::Cpu)?;
    for _ in 0..warmup {
        simulation.step()?;
    }
    let bounds = Bounds::new(&simulation.params, &simulation.next_step(), simulation.settings().tolerance);
    let mut errors = stages(&mut simulation, case, scene, adapter)?;
    errors.iter_mut().for_each(|e| e.bound = bounds.of(e));
    Ok(errors)
}

fn stages(
    simulation: &mut Simulation,
    case: &Case,
    scene: &Arc<Scene>,
    adapter: Option<&str>,
) -> Result<Vec<StageError>> {
    let (mut plan, params) = (simulation.plan.clone(), simulation.params.clone());
    // The plan may leave contact to the host; here it is the device's that is asked about.
    plan.contact = ContactPlan::on_device(case, scene);
    let settings = simulation.settings();
    if !plan.wet() {
        if plan.contact.program.is_none() {
            return Ok(Vec::new());
        }
        let mut gpu = Gpu::new(scene, &params, &plan, settings, adapter)?;
        return contact(simulation, &mut gpu, scene);
    }
    let cpu = Cpu::new(scene, &params, &plan, settings)?;
    let gpu = Gpu::new(scene, &params, &plan, settings, adapter)?;
    let mut pair = Pair { cpu, gpu, params };
    pair.gpu.write(&simulation.backend.read()?)?;
    let start = pair.gpu.read()?;
    pair.cpu.write(&start)?;
    let step = simulation.next_step();
    let gravity = simulation.params.explicit_gravity();
    let poses: Vec<Pose> =
        simulation.solids.predict(step.time, step.dt, step.ahead, gravity, !plan.coupled).to_vec();
    // Viscosity takes the neighbours of the step before.
    for stage in [ParticleStage::CellList, ParticleStage::NeighbourList] {
        pair.cpu.run(stage, &step)?;
        pair.gpu.run(stage, &step)?;
    }
    let mut out = Vec::new();
    for stage in Stage::ALL.into_iter().filter(|&s| plan.has(s)) {
        if let Some(sweep) = stage.over_particles() {
            pair.cpu.run(sweep, &step)?;
            pair.gpu.run(sweep, &step)?;
        }
        match stage {
            Stage::Contact => continue,
            Stage::Openings => {
                let (slots, poses) = (simulation.groups.fluid, simulation.solids.poses());
                let passage =
                    simulation.openings.advance(step.time + step.ahead, slots, &simulation.scene, poses);
                pair.cpu.pass_openings(&passage.emissions, &passage.outlets)?;
                pair.gpu.pass_openings(&passage.emissions, &passage.outlets)?;
            }
            Stage::MoveSolids => {
                let poses = simulation.openings.place(&poses);
                pair.cpu.move_solids(&poses)?;
                pair.gpu.move_solids(&poses)?;
            }
            Stage::ConjugateGradient => {
                if plan.coupled {
                    let slots = simulation.slot_rows()?;
                    let bodies = simulation.solids.free_bodies(pair.params.balanced_gravity());
                    pair.cpu.free_bodies(&bodies, &slots)?;
                    pair.gpu.free_bodies(&bodies, &slots)?;
                }
                pair.cpu.solve_pressure(&step)?;
                pair.gpu.solve_pressure(&step)?;
            }
            Stage::BodyForce => {
                let (gpu, cpu) = (pair.gpu.body_force(&[])?.0, pair.cpu.body_force(&[])?.0);
                out.extend(wrenches(stage, &gpu, &cpu, &scene.solids, 0.0));
                continue;
            }
            _ => {}
        }
        out.extend(pair.errors(stage)?);
    }
    out.extend(contact(simulation, &mut pair.gpu, scene)?);
    Ok(out)
}

/// Errors of contact between the solids where they are: the part of candidates that differs, and the forces
/// without friction.
fn contact(simulation: &mut Simulation, gpu: &mut Gpu, scene: &Scene) -> Result<Vec<StageError>> {
    let Some(compute) = gpu.compute() else { return Ok(Vec::new()) };
    let dt = simulation.next_step().dt;
    let device = simulation.solids.probe(Some(compute), dt)?;
    let host = simulation.solids.probe(None, dt)?;
    let missing = |a: &[[u64; 4]], b: &[[u64; 4]]| a.iter().filter(|c| b.binary_search(c).is_err()).count();
    let differing =
        missing(&device.candidates, &host.candidates) + missing(&host.candidates, &device.candidates);
    let part = differing as f64 / host.candidates.len().max(1) as f64;
    let stage = Stage::Contact;
    let mut out = vec![StageError::part(stage, "pairs", part)];
    // A body that hardly touches has hardly a force; what counts is the noise against its weight.
    let mass = scene.solids.iter().filter_map(|s| match &s.drive {
        Drive::Free(body) => Some(body.mass),
        Drive::Prescribed(_) => None,
    });
    let weight = mass.fold(0.0, f64::max) * scene.gravity.length();
    out.extend(wrenches(stage, &device.wrenches, &host.wrenches, &scene.solids, weight));
    Ok(out)
}

/// An integral quantity at the end of two runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quantity {
    /// What it is, with its unit.
    pub name: String,
    /// On the CPU.
    pub cpu: f64,
    /// On the device.
    pub gpu: f64,
    /// Difference over the scale of the quantity (see [`drift`]).
    pub relative: f64,
}

/// How far two runs have drifted apart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drift {
    /// Steps done.
    pub steps: u64,
    /// Time reached on the CPU and on the device [s].
    pub time: [f64; 2],
    /// Wall-clock seconds of the CPU and of the device, without setting up.
    pub seconds: [f64; 2],
    /// Description of the CPU and of the device.
    pub backends: [String; 2],
    /// Iterations of the PPE in the mean, CPU and device.
    pub iterations: [f64; 2],
    /// Integral quantities.
    pub quantities: Vec<Quantity>,
}

/// Run `steps` steps on the CPU and on the device, from the start of the case. Energies are compared to the
/// largest energy at the end, momenta to mass times the root mean square speed, positions to the depth.
pub fn drift(case: &Case, scene: &Arc<Scene>, adapter: Option<&str>, steps: u64) -> Result<Drift> {
    let gpu = Processor::Gpu { adapter: adapter.map(str::to_owned) };
    let run = |mut simulation: Simulation| -> Result<(Simulation, f64, f64)> {
        let start = Instant::now();
        let mut iterations = 0.0;
        for _ in 0..steps {
            iterations += f64::from(simulation.step()?.pressure.iterations);
        }
        simulation.backend.wait()?;
        Ok((simulation, start.elapsed().as_secs_f64(), iterations / steps.max(1) as f64))
    };
    let (mut cpu, cpu_seconds, cpu_iterations) =
        run(Simulation::on(&for_cpu(case), scene.clone(), &Processor::Cpu)?)?;
    let (mut gpu, gpu_seconds, gpu_iterations) = run(Simulation::on(case, scene.clone(), &gpu)?)?;
    let (c, g) = (cpu.backend.monitor()?, gpu.backend.monitor()?);
    let mut quantities = Vec::new();
    let mut add = |name: String, cpu: f64, gpu: f64, scale: f64| {
        let relative = if cpu == gpu { 0.0 } else { (gpu - cpu).abs() / scale };
        quantities.push(Quantity { name, cpu, gpu, relative });
    };
    if cpu.plan.wet() {
        let mass = cpu.params.particle_mass() * c.particles as f64;
        let energy = c.kinetic.abs().max(c.potential.abs());
        let momentum = (2.0 * mass * c.kinetic).sqrt();
        let length = cpu.params.depth.max(cpu.params.spacing);
        add("particles".into(), c.particles as f64, g.particles as f64, c.particles as f64);
        add("kinetic_J".into(), c.kinetic, g.kinetic, energy);
        add("potential_J".into(), c.potential, g.potential, energy);
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            add(format!("momentum_{axis}_kg_m_s"), c.momentum[k], g.momentum[k], momentum);
            add(format!("centroid_{axis}_m"), c.centroid[k], g.centroid[k], length);
            add(format!("extent_max_{axis}_m"), c.extent_max[k], g.extent_max[k], length);
        }
        add("speed_max_m_s".into(), c.speed_max, g.speed_max, c.speed_max);
        add("density_error_mean".into(), c.density_error_mean, g.density_error_mean, 1.0);
        add("density_error_max".into(), c.density_error_max, g.density_error_max, 1.0);
    }
    let length = cpu.params.depth.max(cpu.params.spacing);
    for (k, (a, b)) in cpu.solids.poses().iter().zip(gpu.solids.poses()).enumerate() {
        let name = cpu.solids.name(k);
        for (axis, (a, b)) in
            ["x", "y", "z"].into_iter().zip(a.position.to_array().into_iter().zip(b.position.to_array()))
        {
            add(format!("{name}_{axis}_m"), a, b, length);
        }
    }
    Ok(Drift {
        steps,
        time: [cpu.time, gpu.time],
        seconds: [cpu_seconds, gpu_seconds],
        backends: [cpu.backend.description(), gpu.backend.description()],
        iterations: [cpu_iterations, gpu_iterations],
        quantities,
    })
}
