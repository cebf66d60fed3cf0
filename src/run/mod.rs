//! A run: the clock, and what is written when.
//!
//! Frames come at t = 0, at the first step that reaches each multiple of `output.every` (or `every` of a series), and at the end;
//! the time step is never cut to hit them. A run that diverges or is interrupted keeps everything that it
//! wrote, and says in `result.json` how it ended. Its state is saved now and then, and when it is stopped:
//! gone on with, it writes what it would have written undisturbed.

mod due;
pub mod frames;
pub mod from;
mod meshes;
mod options;
mod pace;
pub mod resume;
mod saving;
pub mod scale;
pub mod summary;
pub mod tables;
pub mod verdict;

use crate::checkpoint::Archive;
use crate::console::remark;
use crate::error::{Error, Result};
use crate::gauges::Gauges;
use crate::machine::memory_peak;
use crate::output::folder::{Folder, Mode};
use crate::output::result::{Grade, Status, Summary, Verdict};
use crate::output::write_whole;
use crate::scene::Scene;
use crate::simulation::{Simulation, StepReport};
use crate::stop::Stop;
use crate::whole::remove;
pub use due::Due;
use frames::Frames;
use from::{earlier, fits, stands};
use meshes::Meshes;
pub use meshes::named_by_content;
pub use options::{Options, Start};
use pace::Pace;
use saving::{Kept, Saving};
use scale::Scale;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use summary::Totals;
use tables::Tables;

/// Where a run stands.
#[derive(Clone, Debug, Default)]
pub struct Progress {
    /// What the step did.
    pub report: StepReport,
    /// Time reached [s].
    pub time: f64,
    /// Part of the run that is done, 0 to 1.
    pub done: f64,
    /// Largest speed of the fluid when last looked at [m/s]; 0 in a dry scene.
    pub speed_max: f64,
    /// Wall-clock time since the start.
    pub wall: Duration,
    /// Wall-clock time to the end, if it goes on like this.
    pub remaining: Duration,
    /// Whether a frame was written after this step.
    pub frame: bool,
}

/// How a run ended.
#[derive(Debug)]
pub struct Finished {
    /// What `result.json` holds.
    pub summary: Summary,
    /// What ended the run, unless it was its end, a signal or the clock.
    pub error: Option<Error>,
    /// The signal that ended the run.
    pub signal: Option<i32>,
    /// It was stopped by the clock, or by a signal, and its state is saved.
    pub resumable: bool,
}

/// Run `simulation` of `scene` to its end. `text` is the case as a TOML file; `stop` asks it to end early: in
/// the middle of a step only if that takes long, and then it ends as it was shortly before; `observe` is called after every
/// step.
///
/// # Errors
/// Only for what keeps a run from starting: a folder that is not empty or in use, a gauge that hangs in the air, a
/// state that is none of this scene. What happens later is in [`Finished`].
pub fn run(
    simulation: &mut Simulation,
    scene: &Scene,
    text: &str,
    mut options: Options,
    stop: &Stop,
    observe: &mut dyn FnMut(&Progress),
) -> Result<Finished> {
    let stop = &stop.at(options.deadline);
    let _attended = stop.attend();
    let gauges = Gauges::new(&simulation.case, scene)?;
    let mut archive = None;
    let mode = match std::mem::take(&mut options.start) {
        Start::New => Mode::New,
        Start::Replace => Mode::Replace,
        Start::Resume(found) => {
            fits(simulation, &found)?;
            // What was written goes on under the name that it has, whatever that of the case file is now.
            options.name = found.origin.name;
            archive = Some(found.archive.into_restore());
            Mode::Continue
        }
    };
    let resumes = archive.is_some();
    let mut inputs = options.inputs.clone();
    if let Some(archive) = &mut archive {
        simulation.exchange(archive)?;
    } else if let Some(mut found) = earlier(simulation)? {
        for why in &found.damaged {
            remark(&format!("warning: run.from: {why}; an older state is taken"));
        }
        simulation.make_room(&mut found.archive)?;
        simulation.exchange(&mut found.archive)?;
        stands(simulation)?;
        inputs.extend(simulation.case.run.from.as_ref().map(PathBuf::from));
    }
    let meshes = Meshes::read(&simulation.case, text)?;
    let text = &meshes.text;
    let folder = Folder::open(&options.out, &options.name, mode, &inputs)?;
    let mut run = Run {
        start: Instant::now(),
        frames: Frames::new(&folder, &simulation.case, scene, &simulation.params, options.pictures)?,
        tables: Tables::create(&folder, simulation, scene, gauges, resumes)?,
        totals: Totals::default(),
        steps_max: options.steps.unwrap_or(u64::MAX),
        saving: Saving::new(simulation, &options.name, text, folder.checkpoints()),
        pace: Pace::default(),
        walls: 0.0,
        parts: 0,
        // A run always does a step, however short it is.
        dt: 0.0,
    };
    // The state may be large, and ends here.
    match archive {
        Some(mut archive) => {
            run.exchange(&mut archive)?;
            run.saving.every.reached(simulation.time);
        }
        None => run.skip(simulation.time),
    }
    // What the run said of its end holds no more.
    remove(&folder.file("result.json"))?;
    meshes.write(&folder)?;
    write_whole(&folder.file("case.toml"), text.as_bytes())?;
    run.parts += 1;
    run.finish(simulation, scene, &options, &folder, stop, observe, resumes)
}

/// A state in memory is without the particles of many ranks, each of which keeps its own until it is wanted.
fn complete(simulation: &mut Simulation, archive: &mut Archive) -> Result<()> {
    simulation.backend.lead().map_or(Ok(()), |lead| lead.complete(archive))
}

enum End {
    Time,
    Steps,
    Signal(i32),
    Deadline,
}

struct Run {
    start: Instant,
    frames: Frames,
    tables: Tables,
    totals: Totals,
    steps_max: u64,
    saving: Saving,
    pace: Pace,
    /// Wall-clock time of the processes before this one [s].
    walls: f64,
    /// Processes that the run took.
    parts: u64,
    /// The last time step [s]; 0 before the first.
    dt: f64,
}

impl Run {
    /// Save how far files and sums are, or go back to that.
    fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        // When states are due follows from the time: the interval may have changed.
        let Self { start, frames, tables, totals, steps_max: _, saving: _, pace: _, walls, parts, dt } = self;
        frames.exchange(archive)?;
        tables.exchange(archive)?;
        totals.exchange(archive)?;
        let mut wall = *walls + start.elapsed().as_secs_f64();
        archive.number("run.wall", &mut wall)?;
        if !archive.is_saving() {
            *walls = wall;
        }
        archive.number("run.step", dt)?;
        archive.count("run.parts", parts)
    }

    /// A run that begins late: moments before `time` [s] are over.
    fn skip(&mut self, time: f64) {
        if time > 0.0 {
            self.frames.skip(time);
            self.saving.every.reached(time);
            self.tables.skip(time);
        }
    }

    fn state(&mut self, simulation: &mut Simulation, mut archive: Archive) -> Result<Archive> {
        simulation.exchange(&mut archive)?;
        self.exchange(&mut archive)?;
        Ok(archive)
    }

    /// Keep a state of late in memory, to go back to if a long step is given up.
    fn keep(&mut self, simulation: &mut Simulation) -> Result<()> {
        if !simulation.backend.gives_up() || !self.saving.keeps() {
            return Ok(());
        }
        // Two at a time would be one too many: they may be large.
        self.saving.kept = None;
        let clock = Instant::now();
        let archive = self.state(simulation, Archive::in_memory())?;
        self.saving.kept = Some(Kept { archive, at: Instant::now(), cost: clock.elapsed() });
        Ok(())
    }

    /// Go back to it.
    fn go_back(&mut self, simulation: &mut Simulation) -> Result<()> {
        simulation.backend.wait()?;
        let Some(kept) = self.saving.kept.take() else { return Err(Error::Interrupted) };
        let mut archive = kept.archive.into_restore();
        simulation.exchange(&mut archive)?;
        let walls = self.walls;
        self.exchange(&mut archive)?;
        // The clock of this process has not gone back.
        self.walls = walls;
        Ok(())
    }

    fn save(&mut self, simulation: &mut Simulation) -> Result<()> {
        self.saving.kept = None;
        let archive = self.state(simulation, Archive::new())?;
        self.saving.write(simulation.steps, simulation.time, &archive)
    }

    /// Save the state if it is time to.
    fn save_if_due(&mut self, simulation: &mut Simulation) -> Result<()> {
        let due = self.saving.every.reached(simulation.time);
        if due || self.saving.wall.is_some_and(|wall| self.saving.last.elapsed() >= wall) {
            self.save(simulation)?;
        } else if self.saving.planned && self.frames.is_fresh(simulation.steps) {
            // In memory, beside a frame: what is saved if the run diverges.
            let archive = self.state(simulation, Archive::in_memory())?;
            self.saving.good = Some((simulation.steps, simulation.time, archive));
        }
        Ok(())
    }

    /// The run, and what is said of its end.
    fn finish(
        mut self,
        simulation: &mut Simulation,
        scene: &Scene,
        options: &Options,
        folder: &Folder,
        stop: &Stop,
        observe: &mut dyn FnMut(&Progress),
        resumes: bool,
    ) -> Result<Finished> {
        let scale = Scale::new(simulation, scene);
        let before = simulation.steps;
        let ended = self.advance(simulation, scene, stop, observe, resumes);
        let saved = format!("; go on with --resume {}", options.out.display());
        let mut resumable = false;
        let (status, reason, mut error, signal) = match ended {
            Ok(End::Time) => (Status::Done, "end time reached".to_string(), None, None),
            Ok(End::Steps) => (Status::Done, "number of steps reached".to_string(), None, None),
            Ok(End::Signal(n)) => {
                resumable = true;
                (Status::Interrupted, format!("signal {n}{saved}"), None, Some(n))
            }
            Ok(End::Deadline) => {
                resumable = true;
                // Given again it would end there again.
                let none =
                    if simulation.steps == before { " before a step was done: make it longer" } else { "" };
                (Status::Interrupted, format!("--max-wall reached{none}{saved}"), None, None)
            }
            Err(error) => {
                let diverged = matches!(error, Error::Diverged { .. });
                let mut reason = error.to_string();
                if diverged {
                    reason.push_str(&self.keep_last(simulation, scene));
                } else if matches!(error, Error::Gpu(_)) {
                    reason.push_str(&self.keep_good(simulation));
                }
                let status = if diverged { Status::Diverged } else { Status::Failed };
                (status, reason, Some(error), None)
            }
        };
        let mut summary = self.totals.summary(simulation, scene);
        summary.case = options.name.clone();
        summary.status = status;
        summary.verdict = match error {
            Some(_) => Verdict { grade: Grade::Failed, reasons: vec![reason.clone()], ..Verdict::default() },
            None => verdict::judge(&summary, scale, simulation.case.run.adaptive),
        };
        summary.exit_reason = reason;
        if summary.status == Status::Done && summary.verdict.grade == Grade::Failed {
            summary.status = Status::Failed;
            summary.exit_reason.push_str(", but what was computed means nothing");
            let why = summary.verdict.reasons.join("; ");
            error = Some(Error::Senseless(format!("{}: {why}", summary.exit_reason)));
        }
        summary.wall_s = self.walls + self.start.elapsed().as_secs_f64();
        summary.parts = self.parts;
        summary.frames = self.frames.written();
        summary.series = self.frames.written_by_name();
        summary.memory_peak_bytes = memory_peak();
        // A device that is lost tells nothing more.
        summary.ranks = simulation.backend.ranks().unwrap_or_default();
        summary.stages.insert("output", self.totals.output.as_secs_f64());
        // Where the disk is full this makes room for the last word.
        folder.release();
        let written = summary.write(&folder.file("result.json"));
        Ok(Finished { summary, error: error.or(written.err()), signal, resumable })
    }

    /// Keep the state in which a run diverged, to be looked at, and the last good one; says where.
    fn keep_last(&mut self, simulation: &mut Simulation, scene: &Scene) -> String {
        // Best effort: a device that is lost cannot be read any more, and the first error counts.
        let mut said = match self.frames.write_last(simulation, scene) {
            Ok(()) => "; the state is in vtu/last_*.vtu".to_owned(),
            Err(e) => format!("; its state could not be written: {e}"),
        };
        said.push_str(&self.keep_good(simulation));
        said
    }

    /// Keep the last good state, which is in memory and needs no device; says where.
    fn keep_good(&mut self, simulation: &mut Simulation) -> String {
        if let Some((step, time, mut archive)) = self.saving.good.take()
            && let Err(e) =
                complete(simulation, &mut archive).and_then(|()| self.saving.write(step, time, &archive))
        {
            format!("; the last good state could not be written: {e}")
        } else if let Some(step) = self.saving.step {
            format!("; the last good state, of step {step}, is in checkpoint/")
        } else {
            String::new()
        }
    }

    fn advance(
        &mut self,
        simulation: &mut Simulation,
        scene: &Scene,
        stop: &Stop,
        observe: &mut dyn FnMut(&Progress),
        resumes: bool,
    ) -> Result<End> {
        let end = simulation.case.run.end;
        if !resumes {
            let writing = Instant::now();
            self.tables.start(simulation, &mut self.totals)?;
            self.frames.write(simulation, scene)?;
            self.totals.output += writing.elapsed();
        }
        simulation.stop_with(stop);
        let mut progress = Progress { time: simulation.time, ..Progress::default() };
        progress.report.dt = self.dt;
        let ended = loop {
            // A rounding error short of the end is the end.
            if simulation.time >= end - 1e-6 * self.dt {
                break End::Time;
            }
            if simulation.own_steps() >= self.steps_max {
                break End::Steps;
            }
            if stop.is_asked() {
                break stop.signal().map_or(End::Deadline, End::Signal);
            }
            self.keep(simulation)?;
            let report = match simulation.step() {
                Err(Error::Interrupted) => {
                    self.go_back(simulation)?;
                    progress.report = StepReport { dt: self.dt, ..StepReport::default() };
                    continue;
                }
                report => report?,
            };
            self.dt = report.dt;
            let writing = Instant::now();
            self.totals.add(&report, simulation);
            self.tables.step(&report, simulation, &mut self.totals)?;
            progress.frame = self.frames.write_due(simulation, scene)?;
            // After the files of this step, so that a state knows all of them.
            self.save_if_due(simulation)?;
            self.totals.output += writing.elapsed();
            progress.report = report;
            progress.time = simulation.time;
            progress.speed_max = self.totals.speed;
            self.clock(&mut progress, simulation.own_steps(), end);
            observe(&progress);
        };
        let writing = Instant::now();
        self.saving.kept = None;
        // Before the last frame and the last rows, which a run that goes on would not have written.
        let stopped = matches!(ended, End::Signal(_) | End::Deadline);
        if (stopped || self.saving.planned) && self.saving.step != Some(simulation.steps) {
            self.save(simulation)?;
        }
        self.frames.write_end(simulation, scene)?;
        self.tables.finish(&progress.report, simulation, &mut self.totals)?;
        self.frames.write_final_picture(simulation, scene)?;
        self.totals.output += writing.elapsed();
        Ok(ended)
    }

    fn clock(&mut self, progress: &mut Progress, steps: u64, end: f64) {
        progress.wall = self.start.elapsed();
        let by_time = progress.time / end;
        let by_steps = steps as f64 / self.steps_max as f64;
        progress.done = by_time.max(by_steps).clamp(1e-9, 1.0);
        progress.remaining = self.pace.remaining(progress.wall, progress.done, self.totals.particles());
    }
}
