//! What can be said of a result: fine, degraded, or nothing at all.

use crate::ledger::Entry;
use crate::output::result::{Grade, Passed, Summary, Verdict, Water};
use crate::scene::{Drive, Motion, Scene};
use crate::simulation::Simulation;
use crate::time_step::collapse_speed;
use glam::DQuat;

/// Part of the solves that may fail, of the particles that may get lost, in a fine result and in one that means
/// anything [-].
const FAILURES: (f64, f64) = (0.01, 0.5);
const LOST: (f64, f64) = (1e-3, 0.1);
/// Part of all pressures of all steps that are cut at the upper bound [-]: a slam cuts some.
const CLAMPED: (f64, f64) = (1e-4, f64::INFINITY);
/// Mean of n / n0 - 1 [-]: the water is compressed by that much.
const COMPRESSION: (f64, f64) = (0.05, 0.3);
/// Largest speed over that of a fall through the domain.
const SPEED: (f64, f64) = (5.0, 25.0);
/// Gain of energy over the energy at hand.
const GAIN: (f64, f64) = (0.1, 1.0);
/// v dt / l0 [-]. Splashes are faster than the flow, and do no harm.
const COURANT: (f64, f64) = (1.0, 10.0);
/// The same of the points of solids; water does not feel what jumps over it.
const SOLID_COURANT: (f64, f64) = (1.0, 10.0);
/// Depth to which solids sank into each other over l0 [-].
const PENETRATION: (f64, f64) = (0.5, 3.0);

/// Speeds and energies that a scene can come to by itself.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Speed [m/s].
    speed: f64,
    /// Energy [J].
    energy: f64,
    /// Energy that gravity along periodic axes may give it, and what is moved once [J].
    given: [f64; 2],
    /// Whether anything is moved to and fro, or round and round: it may put in any energy.
    stirred: bool,
    /// Energy that water may have that comes in, and lack that goes out, over its mass [J/kg].
    through: (f64, f64),
    /// Mass of a particle of water [kg].
    particle: f64,
}

impl Scale {
    /// Those of `scene` at its start, as `simulation` holds it.
    pub fn new(simulation: &Simulation, scene: &Scene) -> Self {
        let params = &simulation.params;
        let g = params.gravity.length();
        let end = simulation.case.run.end;
        // Along a periodic axis nothing but friction ends a fall.
        let drawn = params.drive.length() * end;
        let (low, high) = scene.domain;
        let height = (high - low).abs().dot(params.gravity.normalize_or_zero().abs());
        let height = if height.is_finite() { height } else { 0.0 };
        let start = scene.velocity.iter().map(|v| v.length()).fold(0.0, f64::max);
        // Tables of motion put in any energy: as much as all the water and all the bodies at their speed.
        let driven = scene.solids.iter().filter_map(|s| match &s.drive {
            Drive::Prescribed(motion) => Some(motion.fastest(0.0, end, s.radius())),
            Drive::Free(_) => None,
        });
        let driven = driven.fold(simulation.openings.fastest(0.0, end), f64::max);
        // What goes up takes the water on it along: as high, and as fast. What turns may.
        let up = -params.gravity.normalize_or_zero();
        let (mut risen, mut tilted) = (0.0_f64, 0.0_f64);
        for solid in &scene.solids {
            if let Drive::Prescribed(motion) = &solid.drive {
                for (way, turn) in motion.poses() {
                    risen = risen.max(way.dot(up));
                    tilted =
                        tilted.max(2.0 * solid.radius() * (0.5 * turn.angle_between(DQuat::IDENTITY)).sin());
                }
            }
        }
        let (mut bodies, mut turning) = (0.0, 0.0);
        for solid in &scene.solids {
            if let Drive::Free(body) = &solid.drive {
                bodies += body.mass;
                turning += (body.inertia * body.angular_velocity * body.angular_velocity).element_sum();
            }
        }
        let water = scene.water() as f64 * params.particle_mass();
        let moved = start.max(driven);
        let speed = moved + drawn;
        // A wedge of 30 degrees that plunges throws water up at five times its speed, a flatter one faster.
        let thrown = 3.0 * driven;
        // Water at rest without gravity is never quite at rest. Where it has a speed, that tells how fast is fast.
        let noise = match 0.1 * params.sound_speed(simulation.case.run.time_step) {
            noise if water > 0.0 && g == 0.0 => {
                if speed > 0.0 {
                    noise.min(speed)
                } else {
                    noise
                }
            }
            _ => 0.0,
        };
        // Water that comes in stands as high as all of it in the end, what goes out falls from the opening.
        let faces = scene.openings.iter().map(|o| o.face.dot(up) * g);
        let at_start = scene.position[..scene.water()].iter().map(|x| x.dot(up) * g);
        let lowest = faces.clone().chain(at_start).fold(f64::INFINITY, f64::min);
        let highest = faces.fold(lowest + g * params.depth, f64::max);
        let comes = highest + 0.5 * driven * driven;
        let through = (comes.max(0.0), (-lowest).max(0.0));
        Self {
            speed: (speed * speed + 2.0 * g * height)
                .sqrt()
                .max(collapse_speed(params))
                .max(noise)
                .max(thrown),
            energy: g * (water * params.depth + bodies * height + (water + bodies) * (risen + tilted))
                + (water + bodies) * speed * speed
                + turning
                + water * noise * noise,
            given: [
                0.5 * (water + bodies) * (speed * speed - moved * moved),
                (water + bodies) * (g * risen.max(0.0) + 0.5 * driven * driven),
            ],
            stirred: scene.solids.iter().any(|solid| match &solid.drive {
                Drive::Prescribed(motion) => goes_on(motion, end, solid.radius()),
                Drive::Free(_) => false,
            }),
            through: if scene.openings.is_empty() { (0.0, 0.0) } else { through },
            particle: params.particle_mass(),
        }
    }
}

/// Whether a solid with this `radius` [m] comes back, or goes round, until `end` [s]: its way is longer than the room
/// that it takes.
fn goes_on(motion: &Motion, end: f64, radius: f64) -> bool {
    let times = (0..=SAMPLES).map(|k| end * f64::from(k) / f64::from(SAMPLES));
    let (start, turn) = (motion.displacement(0.0), motion.turn(0.0));
    let (mut last, mut way, mut room) = ((start, turn), 0.0, (0.0_f64, start, start));
    for (at, turned) in times.map(|t| (motion.displacement(t), motion.turn(t))) {
        way += at.distance(last.0) + radius * turned.angle_between(last.1);
        room = (room.0.max(turned.angle_between(turn)), room.1.min(at), room.2.max(at));
        last = (at, turned);
    }
    way > 1.5 * (room.1.distance(room.2) + radius * room.0)
}

/// Times at which a motion is looked at.
const SAMPLES: u32 = 2000;

/// Reasons, each with the grade that it leaves.
struct Judge(Vec<(Grade, String)>);

impl Judge {
    /// `value` against what is fine and what is anything.
    fn bound(&mut self, value: f64, (fine, any): (f64, f64), say: impl FnOnce() -> String) {
        // A value that is not a number fits no bound.
        let grade = if value <= fine {
            return;
        } else if value <= any {
            Grade::Degraded
        } else {
            Grade::Failed
        };
        self.0.push((grade, say()));
    }
}

/// The verdict on a run that reached its end or was stopped.
pub fn judge(summary: &Summary, scale: Scale) -> Verdict {
    let (p, m) = (&summary.pressure, &summary.monitors);
    let mut judge = Judge(Vec::new());
    let solves = p.solves.max(1) as f64;
    let wet = (summary.particles.fluid > 0 || summary.water.is_some()) && summary.steps > 0;
    if wet {
        let came = summary.water.iter().flat_map(|w| &w.inflow).map(|i| i.particles).sum::<u64>();
        let fluid = (summary.particles.fluid as f64 + came as f64).max(1.0);
        judge.bound(p.failures as f64 / solves, FAILURES, || {
            format!(
                "{} of {} pressure solves missed fluid.solver.tolerance (largest residual {:.1e})",
                p.failures, p.solves, p.relative_residual_max
            )
        });
        let cut = p.clamps as f64 / (p.unknowns_mean * solves).max(1.0);
        judge.bound(cut, CLAMPED, || {
            format!(
                "{} pressures, {:.1e} of all, were cut at their upper bound; use a larger fluid.sound_speed or a shorter run.time_step, \
                 or give the water room",
                p.clamps, cut
            )
        });
        judge.bound(m.lost_particles as f64 / fluid, LOST, || {
            format!("{} of {fluid} fluid particles left the domain", m.lost_particles)
        });
        judge.bound(m.density_error_mean.abs(), COMPRESSION, || {
            format!("the water's density is off by {:.1} % in the mean", 100.0 * m.density_error_mean)
        });
        judge.bound(m.speed_max, (SPEED.0 * scale.speed, SPEED.1 * scale.speed), || {
            format!("water reached {:.1} m/s where {:.1} m/s is to be expected", m.speed_max, scale.speed)
        });
        judge.bound(m.courant_max, COURANT, || {
            format!("water moved {:.1} particles far in a step", m.courant_max)
        });
    }
    if wet {
        judge.bound(m.solid_courant_max, SOLID_COURANT, || {
            let way = m.solid_courant_max;
            format!("a solid moved {way:.1} particles far in a step; use a shorter run.time_step, or run.adaptive = true")
        });
    }
    judge.bound(m.penetration_max_over_l0, PENETRATION, || {
        format!("solids sank {:.1} particles deep into each other", m.penetration_max_over_l0)
    });
    // Water that comes in brings its energy along.
    let passed = |all: &[Passed]| all.iter().map(|p| p.particles).sum::<u64>() as f64 * scale.particle;
    let through = |w: &Water| scale.through.0 * passed(&w.inflow) + scale.through.1 * passed(&w.outflow);
    let passing = summary.water.as_ref().map_or(0.0, through);
    // What solids that are moved put in is known to the ledger alone: a tank that is shaken may come to any energy.
    let work = summary.ledger.as_ref().map(|ledger| {
        let of = |entry: Entry| ledger.get(entry.name()).copied().unwrap_or_default();
        of(Entry::Walls) + of(Entry::Friction).max(0.0) + of(Entry::Viscosity).max(0.0)
    });
    let [drawn, moved] = scale.given;
    let rise = match work {
        Some(work) if moved > 0.0 => m.energy_end - m.energy_start - work,
        _ => m.energy_max - m.energy_start - moved,
    };
    let gain = rise - drawn - passing;
    let energy = scale.energy + passing;
    let mut left_out = vec![];
    if scale.stirred && work.is_none() && gain > GAIN.0 * energy {
        let why = "the energy: solids that go to and fro put in work, which output.ledger = true would tell";
        left_out.push(why.to_owned());
    } else {
        judge.bound(gain, (GAIN.0 * energy, GAIN.1 * energy), || {
            format!("the energy rose by {gain:.2e} J, where {energy:.2e} J is at hand")
        });
    }
    judge.0.sort_by_key(|fault| std::cmp::Reverse(fault.0));
    Verdict {
        grade: judge.0.first().map_or(Grade::Fine, |(grade, _)| *grade),
        reasons: judge.0.into_iter().map(|(_, why)| why).collect(),
        left_out,
    }
}
