//! How far a run is: a bar on a terminal; in a log a line a frame, but no more than one a second.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use seixo::console::remark;
use seixo::run::Progress;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Shortest and longest silence in a log.
const LINE_AFTER: Duration = Duration::from_secs(1);
const LINE_EVERY: Duration = Duration::from_secs(30);
const BAR_LENGTH: u64 = 10_000;

/// Shows progress on stderr.
pub struct Display {
    bar: Option<ProgressBar>,
    quiet: bool,
    wet: bool,
    last: Instant,
}

impl Display {
    /// Nothing is shown if `quiet`; `wet` scenes tell of water.
    pub fn new(quiet: bool, wet: bool) -> Self {
        let bar = (!quiet && std::io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::with_draw_target(Some(BAR_LENGTH), ProgressDrawTarget::stderr_with_hz(4));
            let style = ProgressStyle::with_template("[{bar:10}] {percent:>3} %  {wide_msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
            bar
        });
        Self { bar, quiet, wet, last: Instant::now() }
    }

    /// After a step.
    pub fn step(&mut self, progress: &Progress) {
        if let Some(bar) = &self.bar {
            // Building the text costs more than a step of a small scene.
            if self.last.elapsed() > Duration::from_millis(100) {
                self.last = Instant::now();
                bar.set_position((progress.done * BAR_LENGTH as f64) as u64);
                bar.set_message(self.line(progress));
            }
        } else if !self.quiet {
            let silence = self.last.elapsed();
            if silence > LINE_EVERY || progress.frame && silence > LINE_AFTER {
                self.last = Instant::now();
                remark(&self.line(progress));
            }
        }
    }

    /// The run is over.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn line(&self, progress: &Progress) -> String {
        let report = &progress.report;
        // What is waited for comes first: a terminal of 80 columns cuts the rest.
        let mut line = format!(
            "ETA {}  t={:.3} s  step {}  dt {:.1e}",
            clock(progress.remaining),
            progress.time,
            report.step + 1,
            report.dt
        );
        if self.wet {
            let (iterations, speed) = (report.pressure.iterations, progress.speed_max);
            line += &format!("  CG {iterations}  |v| {speed:.2}");
        }
        line + &format!("  wall {}", clock(progress.wall))
    }
}

/// hh:mm:ss, hours alone if they are many, and a question mark for what nobody knows.
pub fn clock(time: Duration) -> String {
    let s = time.as_secs();
    if time == Duration::MAX {
        return "?".into();
    }
    if s > 99 * 3600 {
        return format!("{} h", s / 3600);
    }
    format!("{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}
