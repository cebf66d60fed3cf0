//! What `seixo plan` tells, as a person reads it.

use super::{BodyLine, MOST_BODIES, Report, StageLine, WaveLine};
use seixo::backend::gpu::forecast::Forecast;
use seixo::case::Case;
use seixo::error::{CaseError, Error};
use seixo::estimate::{Estimate, bytes};
use seixo::output::digits::of_place;
use seixo::plan::Stage;
use seixo::share::Outlook;

/// Memory of a usual large GPU [bytes].
const LARGE_GPU: u64 = 24_000_000_000;

impl WaveLine {
    fn words(&self) -> String {
        let period = self.period_s.map_or(String::new(), |t| format!(", period {t} s"));
        format!(
            "  `{}` makes a {} wave: height {} m{period}, in {:.4} m of water\n  length {:.3} m, celerity {:.3} m/s, stroke \
             {:.4} m; {:.1} particles high, {:.0} long",
            self.piston,
            self.kind.name(),
            self.height_m,
            self.depth_m,
            self.length_m,
            self.celerity_m_s,
            self.stroke_m,
            self.height_over_spacing,
            self.length_over_spacing
        )
    }
}

impl BodyLine {
    /// Where it is in `places` decimals.
    fn words(&self, places: usize, plane: bool) -> String {
        let span = |k: usize| format!("{:.places$} to {:.places$}", self.min_m[k], self.max_m[k]);
        // One that nothing moves needs no mass.
        let [x, y, z] = self.inertia_kg_m2;
        let mass = match plane {
            _ if self.mass_kg == 0.0 => "held".into(),
            true => format!("{:.4e} kg, {y:.4e} kg m2", self.mass_kg),
            false => format!("{:.4e} kg, {x:.4e} {y:.4e} {z:.4e} kg m2", self.mass_kg),
        };
        let afloat = self.buoyancy.as_ref().map_or(String::new(), |b| "\n".to_owned() + &b.words(places));
        format!(
            "  `{}`: {mass}, {:.4e} m3; x {}, y {}, z {} m{afloat}",
            self.name,
            self.volume_m3,
            span(0),
            span(1),
            span(2)
        )
    }
}

impl Report {
    /// What a person reads.
    pub fn words(&self) -> String {
        let report = self;
        let p = &report.particles;
        let step = if report.adaptive { "down to" } else { "fixed" };
        let mut lines = vec![
            format!(
                "{}: {}D, l0 = {} m, dt {step} {:.3e} s, to t = {} s",
                report.case, report.dimensions, report.spacing_m, report.time_step_s, report.end_s
            ),
            String::new(),
            match report.estimated_from_spacing_m {
                Some(l0) => format!("particles, estimated from l0 = {l0:.4} m"),
                None => "particles".to_string(),
            },
        ];
        for (name, count) in
            [("fluid", p.fluid), ("wall", p.wall), ("dummy", p.dummy), ("body", p.body), ("total", p.total)]
        {
            lines.push(format!("  {name:<7}{count:>10}"));
        }
        let solids = [("moving solids", &report.solids), ("fixed solids of any shape", &report.fixed_solids)];
        for (what, names) in solids.into_iter().filter(|(_, names)| !names.is_empty()) {
            let more = names.len().saturating_sub(MOST_BODIES);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let first = &names[..names.len().min(MOST_BODIES)];
            lines.push(format!("  {what}: {}{more}", first.join(", ")));
        }
        if !report.waves.is_empty() {
            lines.extend([String::new(), "waves".to_string()]);
            lines.extend(report.waves.iter().map(WaveLine::words));
        }
        if !report.bodies.is_empty() {
            lines.extend([String::new(), "bodies at t = 0".to_string()]);
            let places = of_place(report.spacing_m);
            lines.extend(
                report.bodies.iter().take(MOST_BODIES).map(|body| body.words(places, report.dimensions == 2)),
            );
            let more = report.bodies.len().saturating_sub(MOST_BODIES);
            lines.extend((more > 0).then(|| format!("  and {more} more: --json")));
        }
        for (title, planned) in [("stages", true), ("left out", false)] {
            let of = |s: &&StageLine| s.planned == planned;
            if report.stages.iter().any(|s| of(&s)) {
                lines.extend([String::new(), title.to_string()]);
            }
            lines.extend(report.stages.iter().filter(of).map(|s| format!("  {:<20}{}", s.stage, s.reason)));
        }
        if report.stages.iter().any(|s| s.planned && s.stage == Stage::Contact.name()) {
            let place =
                if report.contact.device { "on the GPU, if that is the backend" } else { "on the host" };
            lines.extend([String::new(), "contact".to_string()]);
            lines.push(format!("  pairs {place}: {}", report.contact.reason));
        }
        if let Some(s) = &report.scheme {
            lines.extend([
                String::new(),
                "scheme".to_string(),
                format!(
                    "  n0 {:.5}, lambda {:.5} l0^2, {} neighbours",
                    s.number_density, s.laplacian_over_l0_squared, s.neighbours
                ),
                format!(
                    "  c_s {:.3} m/s, gamma {:.4}, alpha {:.3e} 1/Pa",
                    s.sound_speed_m_s, s.relaxation, s.compressibility_1_pa
                ),
                format!(
                    "  preconditioner {}; {} cells{}",
                    s.preconditioner,
                    s.cells,
                    s.neighbours_max.map_or(String::new(), |n| format!("; at most {n} neighbours at t = 0"))
                ),
                format!(
                    "  memory: CPU {:.1} MB at t = 0, GPU {:.1} MB",
                    s.cpu_bytes as f64 / 1e6,
                    s.gpu_bytes as f64 / 1e6
                ),
                String::new(),
                format!("GPU memory, {:.0} bytes a particle", s.gpu_bytes_per_particle),
            ]);
            lines.extend(s.gpu_groups.iter().map(|g| {
                let each = g.bytes as f64 / p.total.max(1) as f64;
                format!(
                    "  {:<20}{:>10.1} MB{each:>8.1} bytes a particle, most in {}",
                    g.name,
                    g.bytes as f64 / 1e6,
                    g.largest
                )
            }));
            lines.extend(
                s.gpu_forecasts.iter().enumerate().flat_map(|(k, f)| forecast(f, k > 0, report.spacing_m)),
            );
        }
        if let Some(ranks) = &report.ranks {
            lines.extend([String::new(), format!("{} ranks at t = 0", ranks.parts.len())]);
            lines.extend(of_ranks(ranks));
            let [first, other] = report.estimate.memory_of_ranks(ranks.parts.len());
            let m = &ranks.model;
            lines.extend([
                format!("  memory on CPUs: about {} a rank, {} the first", bytes(other), bytes(first)),
                format!(
                    "  a step on CPUs, by the model of docs/scaling.md: {:.3} s, {:.1} times as fast as one rank ({:.0} % its \
                     water, {:.0} % copies, {:.0} % messages)",
                    m.step_s(),
                    m.speed_up,
                    100.0 * m.own_s / m.step_s(),
                    100.0 * m.copies_s / m.step_s(),
                    100.0 * m.messages_s / m.step_s()
                ),
            ]);
        }
        let e = &report.estimate;
        lines.extend([
            String::new(),
            "estimates".to_string(),
            format!(
                "  memory on the host: {} on the CPU, {} beside a GPU",
                bytes(e.memory_cpu),
                bytes(e.memory_beside_device)
            ),
            format!(
                "  results: {:.0} frames of {}, tables {}, checkpoints {}: {}",
                e.frames,
                bytes(e.frame_bytes),
                bytes(e.table_bytes),
                bytes(e.checkpoint_bytes),
                bytes(e.disk())
            ),
        ]);
        lines.extend(e.series.iter().map(|s| {
            format!("    of them series `{}`: {:.0} frames of {}", s.name, s.frames, bytes(s.frame_bytes))
        }));
        if !report.advice.is_empty() {
            lines.extend([String::new(), "advice".to_string()]);
            lines.extend(report.advice.iter().map(|a| format!("  {a}")));
        }
        lines.join("\n")
    }
}

/// Ranks that are told of one by one.
const MOST_RANKS: usize = 16;

/// What ranks have and say.
fn of_ranks(ranks: &Outlook) -> Vec<String> {
    let mut lines = Vec::new();
    for (k, part) in ranks.parts.iter().enumerate().take(MOST_RANKS) {
        lines.push(format!(
            "  rank {k:<4} columns {:>4} to {:>4}: {:>9} of water, copies of {}, {} of walls",
            part.columns[0],
            part.columns[1] - 1,
            part.water,
            part.copies,
            part.walls
        ));
    }
    let more = ranks.parts.len().saturating_sub(MOST_RANKS);
    lines.extend((more > 0).then(|| format!("  and {more} more: --json")));
    let [messages, rounds] = [ranks.messages, ranks.rounds];
    lines.extend([
        format!("  largest share over the mean {:.2}; shares are made even again as the water moves", ranks.unevenness),
        format!(
            "  messages to each rank beside: {} a step and {} an iteration of the pressure solver, {} and {} at most",
            messages[0],
            messages[1],
            bytes(ranks.message_bytes[0] as f64),
            bytes(ranks.message_bytes[1] as f64)
        ),
        format!(
            "  rounds of all ranks: {} a step and {} an iteration, {} and {} in all",
            rounds[0],
            rounds[1],
            bytes(ranks.round_bytes[0] as f64),
            bytes(ranks.round_bytes[1] as f64)
        ),
    ]);
    let gpu = &ranks.on_devices;
    lines.extend([
        "  with --backend gpu, a device for each:".to_string(),
        format!(
            "    messages to each rank beside: {} a step and {} an iteration, {} and {} at most",
            gpu.messages[0],
            gpu.messages[1],
            bytes(gpu.message_bytes[0] as f64),
            bytes(gpu.message_bytes[1] as f64)
        ),
        format!(
            "    rounds of all ranks: {} a step and {} an iteration, {} and {} in all",
            gpu.rounds[0],
            gpu.rounds[1],
            bytes(gpu.round_bytes[0] as f64),
            bytes(gpu.round_bytes[1] as f64)
        ),
        format!(
            "    between host and device of a rank: about {} a step and {} an iteration",
            bytes(gpu.staged_bytes[0] as f64),
            bytes(gpu.staged_bytes[1] as f64)
        ),
    ]);
    lines
}

/// Said of a case that is larger than `room` bytes, where a coarser scene cannot stand for it: `why`, at its spacing
/// [m].
pub(super) fn too_large(case: &Case, estimate: &Estimate, room: f64, (l0, why): (f64, &Error)) -> CaseError {
    let first = match why {
        Error::Case(found) => found.problems.first().map(|p| p.message.clone()),
        _ => None,
    };
    let message = format!(
        "run.spacing: {:.1e} particles{} and {:.1e} cells of search take about {} of memory, half of what is free \
         here is {}, and no coarser scene tells more: at {l0:.3} m {}",
        estimate.particles,
        estimate.of_whom(),
        estimate.cells,
        bytes(estimate.memory_beside_device),
        bytes(room),
        first.unwrap_or_else(|| why.to_string())
    );
    let coarser = Estimate::spacing_within(case, room, |estimate| estimate.memory_beside_device);
    let coarser = coarser.map_or("use a larger one".into(), |l0| format!("use run.spacing = {l0} or more"));
    CaseError::of("run.spacing", message, format!("{coarser}, or correct a length that is far too large"))
}

/// A scene against the limits of devices.
fn forecast(f: &Forecast, ahead: bool, spacing: f64) -> Vec<String> {
    let fits = if f.bytes < LARGE_GPU { "fits a GPU with 24 GB" } else { "more than a GPU with 24 GB holds" };
    let mut lines = Vec::new();
    if ahead {
        lines.push(format!(
            "  {:.0} million particles (l0 about {:.2e} m): {:.1} GB, {fits}; largest buffer {} {:.2} GB",
            f.particles as f64 / 1e6,
            spacing * f.spacing_ratio,
            f.bytes as f64 / 1e9,
            f.largest.0,
            f.largest.1 as f64 / 1e9
        ));
    }
    if !f.parts.is_empty() {
        let parts: Vec<_> = f.parts.iter().map(|(buffer, parts)| format!("{buffer} {parts}")).collect();
        let bound = f.bindings.map_or("would bind more buffers than a device has".into(), |n| {
            format!("binds up to {n} buffers")
        });
        lines.push(format!(
            "    in parts, since devices bind no more than 2.15 GB: {}; a kernel {bound}",
            parts.join(", ")
        ));
    }
    if f.rows > 1 {
        lines.push(format!("    dispatches of up to {} workgroups, in {} rows", f.workgroups, f.rows));
    }
    lines.extend(f.excesses.iter().map(|e| {
        let bytes = e.limit.ends_with("size");
        let number = |n: u64| if bytes { format!("{:.2} GB", n as f64 / 1e9) } else { n.to_string() };
        format!(
            "    over a limit: {} {} of {} ({}); would take {}",
            e.what,
            number(e.needs),
            number(e.allows),
            e.limit,
            e.remedy
        )
    }));
    lines
}
