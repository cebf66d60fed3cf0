//! A run: the clock, and what is written when.
//!
//! Frames come at t = 0, at the first step that reaches each multiple of `output.every`, and at the end;
//! the time step is never cut to hit them. A run that diverges or is interrupted keeps everything that it
//! wrote, and says in `result.json` how it ended.

pub mod frames;
pub mod summary;
pub mod tables;
pub mod verdict;

use crate::error::{Error, Result};
use crate::gauges::Gauges;
use crate::output::folder::{Folder, Mode};
use crate::output::result::{Grade, Status, Summary, Verdict, memory_peak};
use crate::output::write_whole;
use crate::scene::Scene;
use crate::simulation::{Simulation, StepReport};
use frames::Frames;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use summary::Totals;
use tables::Tables;
use verdict::Scale;

/// What the command line adds to a case.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Name of the case, for file names and the summary.
    pub name: String,
    /// Folder of the results.
    pub out: PathBuf,
    /// Replace earlier results in the folder.
    pub force: bool,
    /// Stop after this many steps.
    pub steps: Option<u64>,
    /// Draw a picture of every frame.
    pub pictures: bool,
    /// Files that the run was made from; results never take their place.
    pub inputs: Vec<PathBuf>,
}

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
    /// What ended the run, unless it was its end or a signal.
    pub error: Option<Error>,
    /// The signal that ended the run.
    pub signal: Option<i32>,
}

/// Moments at multiples of an interval; at every step without one.
#[derive(Clone, Copy, Debug)]
pub struct Due {
    every: Option<f64>,
    next: f64,
}

impl Due {
    /// Every `every` seconds after t = 0; every step if `None`, never if 0 or less.
    pub fn new(every: Option<f64>) -> Self {
        Self { every, next: 1.0 }
    }

    /// Whether `time` [s] has reached the next moment; moves on to the one after.
    pub fn reached(&mut self, time: f64) -> bool {
        match self.every {
            None => true,
            Some(every) if every > 0.0 => {
                // Sums of time steps miss a multiple by some rounding errors.
                let now = (time / every * (1.0 + 1e-12) + 1e-9).floor();
                let reached = now >= self.next;
                if reached {
                    self.next = now + 1.0;
                }
                reached
            }
            Some(_) => false,
        }
    }
}

/// Run `simulation` of `scene` to its end. `text` is the case as a TOML file; `stop` holds the number of a
/// signal once the run should stop; `observe` is called after every step.
///
/// # Errors
/// Only for what keeps a run from starting: a folder that is not empty or in use, a gauge that hangs in the air.
/// What happens later is in [`Finished`].
pub fn run(
    simulation: &mut Simulation,
    scene: &Scene,
    text: &str,
    options: &Options,
    stop: &AtomicUsize,
    observe: &mut dyn FnMut(&Progress),
) -> Result<Finished> {
    let gauges = Gauges::new(&simulation.case, scene)?;
    let mode = if options.force { Mode::Replace } else { Mode::New };
    let folder = Folder::open(&options.out, &options.name, mode, &options.inputs)?;
    let scale = Scale::new(simulation, scene);
    write_whole(&folder.file("case.toml"), text.as_bytes())?;
    let mut run = Run {
        start: Instant::now(),
        frames: Frames::new(&folder, &simulation.case.output, scene, options.pictures)?,
        tables: Tables::create(&folder, simulation, scene, gauges)?,
        totals: Totals::default(),
        steps_max: options.steps.unwrap_or(u64::MAX),
    };
    let ended = run.advance(simulation, scene, stop, observe);
    let (status, reason, error, signal) = match ended {
        Ok(End::Time) => (Status::Done, "end time reached".to_string(), None, None),
        Ok(End::Steps) => (Status::Done, "number of steps reached".to_string(), None, None),
        Ok(End::Signal(n)) => (Status::Interrupted, format!("signal {n}"), None, Some(n)),
        Err(error) => {
            let diverged = matches!(error, Error::Diverged { .. });
            let mut reason = error.to_string();
            if diverged {
                // Best effort: a device that is lost cannot be read any more, and the first error counts.
                match run.frames.write_last(simulation, scene) {
                    Ok(()) => reason.push_str("; the state is in vtu/last_*.vtu"),
                    Err(e) => reason.push_str(&format!("; its state could not be written: {e}")),
                }
            }
            let status = if diverged { Status::Diverged } else { Status::Failed };
            (status, reason, Some(error), None)
        }
    };
    let mut summary = run.totals.summary(simulation, scene);
    summary.case = options.name.clone();
    summary.status = status;
    summary.verdict = match error {
        Some(_) => Verdict { grade: Grade::Failed, reasons: vec![reason.clone()] },
        None => verdict::judge(&summary, scale),
    };
    summary.exit_reason = reason;
    let mut error = error;
    if summary.status == Status::Done && summary.verdict.grade == Grade::Failed {
        summary.status = Status::Failed;
        summary.exit_reason.push_str(", but what was computed means nothing");
        error = Some(Error::Senseless(format!(
            "{}: {}",
            summary.exit_reason,
            summary.verdict.reasons.join("; ")
        )));
    }
    summary.wall_s = run.start.elapsed().as_secs_f64();
    summary.frames = run.frames.written();
    summary.memory_peak_bytes = memory_peak();
    summary.stages.insert("output", run.totals.output.as_secs_f64());
    // Where the disk is full this makes room for the last word.
    folder.release();
    let written = summary.write(&folder.file("result.json"));
    Ok(Finished { summary, error: error.or(written.err()), signal })
}

enum End {
    Time,
    Steps,
    Signal(i32),
}

struct Run {
    start: Instant,
    frames: Frames,
    tables: Tables,
    totals: Totals,
    steps_max: u64,
}

impl Run {
    fn advance(
        &mut self,
        simulation: &mut Simulation,
        scene: &Scene,
        stop: &AtomicUsize,
        observe: &mut dyn FnMut(&Progress),
    ) -> Result<End> {
        let end = simulation.case.run.end;
        let mut due = Due::new(Some(simulation.case.output.every));
        let writing = Instant::now();
        self.tables.start(simulation, &mut self.totals)?;
        self.frames.write(simulation, scene)?;
        self.totals.output += writing.elapsed();
        // A run always does a step, however short it is.
        let mut dt = 0.0;
        let mut progress = Progress::default();
        let ended = loop {
            // A rounding error short of the end is the end.
            if simulation.time >= end - 1e-6 * dt {
                break End::Time;
            }
            if simulation.steps >= self.steps_max {
                break End::Steps;
            }
            let signal = stop.load(Ordering::Relaxed);
            if signal != 0 {
                break End::Signal(signal as i32);
            }
            let report = simulation.step()?;
            dt = report.dt;
            let writing = Instant::now();
            self.totals.add(&report, simulation);
            self.tables.step(&report, simulation, &mut self.totals)?;
            progress.frame = due.reached(simulation.time);
            if progress.frame {
                self.frames.write(simulation, scene)?;
            }
            self.totals.output += writing.elapsed();
            progress.report = report;
            progress.time = simulation.time;
            progress.speed_max = self.totals.speed;
            self.clock(&mut progress, simulation.steps, end);
            observe(&progress);
        };
        let writing = Instant::now();
        if !progress.frame && simulation.steps > 0 {
            self.frames.write(simulation, scene)?;
        }
        self.tables.finish(&progress.report, simulation, &mut self.totals)?;
        self.frames.write_final_picture(simulation, scene)?;
        self.totals.output += writing.elapsed();
        Ok(ended)
    }

    fn clock(&self, progress: &mut Progress, steps: u64, end: f64) {
        progress.wall = self.start.elapsed();
        let by_time = progress.time / end;
        let by_steps = steps as f64 / self.steps_max as f64;
        progress.done = by_time.max(by_steps).clamp(1e-9, 1.0);
        let remaining = progress.wall.as_secs_f64() * (1.0 / progress.done - 1.0);
        progress.remaining = Duration::try_from_secs_f64(remaining).unwrap_or(Duration::MAX);
    }
}

#[cfg(test)]
mod tests {
    use super::Due;

    #[test]
    fn moments_are_reached_once_each_in_spite_of_rounding() {
        let mut due = Due::new(Some(0.05));
        let mut time = 0.0;
        let mut count = 0;
        for _ in 0..1000 {
            time += 0.001;
            count += u32::from(due.reached(time));
        }
        assert_eq!(count, 20);
        let mut late = Due::new(Some(0.05));
        assert!(!late.reached(0.049) && late.reached(0.26) && !late.reached(0.299) && late.reached(0.3));
        assert!(!Due::new(Some(0.0)).reached(1.0));
        assert!(Due::new(None).reached(0.0));
    }
}
