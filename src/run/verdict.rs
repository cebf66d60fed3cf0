//! What can be said of a result: fine, degraded, or nothing at all.

use super::scale::Scale;
use crate::ledger::Entry;
use crate::output::result::{Grade, Passed, Summary, Verdict, Water};

/// Part of the solves that may fail, of the particles that may get lost, in a fine result and in one that means
/// anything [-].
const FAILURES: (f64, f64) = (0.01, 0.5);
const LOST: (f64, f64) = (1e-3, 0.1);
/// Part of all pressures of all steps that are cut at the upper bound [-]: a slam cuts some.
const CLAMPED: (f64, f64) = (1e-4, f64::INFINITY);
/// Part of them that are negative and set to zero [-]: of water that flies two thirds, of water that something would have to hold together all.
const PULLED: (f64, f64) = (0.9, f64::INFINITY);
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

/// Part of what an opening was to let through that may be missed and not be told [-].
const MISSED: f64 = 0.02;

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

/// What went on in steps that nobody looked at, of a run with water (`wet`) or without.
fn unseen(summary: &Summary, wet: bool) -> Vec<String> {
    let (m, steps) = (&summary.monitors, summary.steps - summary.steps_before);
    let water = (m.steps_seen, "speeds and density of the water");
    let told = |(seen, what): (u64, &str)| {
        let all = "without output.table_every each gets a row";
        (seen < steps)
            .then(|| format!("steps between the rows: {what} were seen in {seen} of {steps} steps; {all}"))
    };
    if wet && m.energy_steps_seen == m.steps_seen {
        return told((m.steps_seen, "speeds, density and energy")).into_iter().collect();
    }
    let energy = (m.energy_steps_seen, "the energies");
    [Some(water).filter(|_| wet), Some(energy)].into_iter().flatten().filter_map(told).collect()
}

/// The verdict on a run that reached its end or was stopped, with steps that are `adaptive` or not.
pub fn judge(summary: &Summary, scale: Scale, adaptive: bool) -> Verdict {
    let (p, m) = (&summary.pressure, &summary.monitors);
    let mut judge = Judge(Vec::new());
    let solves = p.solves.max(1) as f64;
    let water = summary.water_in_all().filter(|_| summary.steps > summary.steps_before);
    let wet = water.is_some();
    if let Some(water) = water {
        let fluid = (water as f64).max(1.0);
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
        let pulled = p.negative as f64 / (p.unknowns_mean * solves).max(1.0);
        judge.bound(pulled, PULLED, || {
            format!(
                "{} pressures, {pulled:.2} of all, were negative and set to zero: water does not pull here, so that what only tension would \
                 hold together flies apart; fluid.suction = true keeps them",
                p.negative
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
            let or = if adaptive { "" } else { ", or run.adaptive = true" };
            format!("a solid moved {way:.1} particles far in a step; use a shorter run.time_step{or}")
        });
    }
    judge.bound(m.penetration_max_over_l0, PENETRATION, || {
        format!("solids sank {:.1} particles deep into each other", m.penetration_max_over_l0)
    });
    // Water that comes in brings its energy along.
    let passed = |all: &[Passed]| all.iter().map(|p| p.particles).sum::<u64>() as f64 * scale.particle;
    let through = |w: &Water| scale.through.0 * passed(&w.inflow) + scale.through.1 * passed(&w.outflow);
    let passing = summary.water.as_ref().map_or(0.0, through);
    // What driven solids do to water is known to the ledger alone: a tank that is shaken may come to any energy. What they do to bodies by
    // contact is known of every run.
    let work = summary.ledger.as_ref().map(|ledger| {
        let of = |entry: Entry| ledger.get(entry.name()).copied().unwrap_or_default();
        of(Entry::Walls) + of(Entry::Friction).max(0.0) + of(Entry::Viscosity).max(0.0)
    });
    let [drawn, moved] = scale.given;
    let rise = match work {
        Some(work) if moved > 0.0 => m.energy_end - m.energy_start - work,
        _ => m.energy_max - m.energy_start - moved,
    };
    let gain = rise - m.driven_contact_work - drawn - passing;
    let energy = scale.energy + passing;
    let mut left_out = unseen(summary, wet);
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
        notes: summary.water.as_ref().map(missed).unwrap_or_default(),
    }
}

/// What openings were to let through and did not.
fn missed(water: &Water) -> Vec<String> {
    let much = |p: &&Passed| p.missed_m3.is_some_and(|missed| missed > MISSED * (missed + p.volume_m3));
    let told = |p: &Passed, why: &str| {
        let (missed, passed) = (p.missed_m3.unwrap_or_default(), p.volume_m3);
        format!("`{}` let {passed:.3e} m3 through and missed {missed:.3e} m3: {why}", p.name)
    };
    let inflow =
        water.inflow.iter().filter(much).map(|p| format!("inflow {}", told(p, "solids stood before it")));
    let dry = "something lies on it, or too little of it was under water, for its discharge";
    let outflow = water.outflow.iter().filter(much).map(|p| format!("outflow {}", told(p, dry)));
    inflow.chain(outflow).collect()
}
