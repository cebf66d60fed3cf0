//! How far a run is: a bar on a terminal; in a log a line a frame, but no more than one a second.

use super::width;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use seixo::console::remark;
use seixo::run::Progress;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Shortest and longest silence in a log.
const LINE_AFTER: Duration = Duration::from_secs(1);
const LINE_EVERY: Duration = Duration::from_secs(30);
const BAR_LENGTH: u64 = 10_000;
/// Columns before the message: `[==========] 100 %  `.
const BEFORE: usize = 20;

/// Shows progress on stderr.
pub struct Display {
    bar: Option<ProgressBar>,
    quiet: bool,
    wet: bool,
    decimals: usize,
    last: Instant,
}

impl Display {
    /// Nothing is shown if `quiet`; `wet` scenes tell of water, and times have so many `decimals`.
    pub fn new(quiet: bool, wet: bool, decimals: usize) -> Self {
        let bar = (!quiet && std::io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::with_draw_target(Some(BAR_LENGTH), ProgressDrawTarget::stderr_with_hz(4));
            let style = ProgressStyle::with_template("[{bar:10}] {percent:>3} %  {wide_msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
            bar
        });
        Self { bar, quiet, wet, decimals, last: Instant::now() }
    }

    /// After a step.
    pub fn step(&mut self, progress: &Progress) {
        if let Some(bar) = &self.bar {
            // Building the text costs more than a step of a small scene.
            if self.last.elapsed() > Duration::from_millis(100) {
                self.last = Instant::now();
                bar.set_position((progress.done * BAR_LENGTH as f64) as u64);
                let room = width::of_stderr().unwrap_or(80).saturating_sub(BEFORE);
                bar.set_message(width::fitting(&self.fields(progress), room));
            }
        } else if !self.quiet {
            let silence = self.last.elapsed();
            if silence > LINE_EVERY || progress.frame && silence > LINE_AFTER {
                self.last = Instant::now();
                remark(&self.fields(progress).join("  "));
            }
        }
    }

    /// The run is over.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    /// What there is to tell; what is waited for comes first.
    fn fields(&self, progress: &Progress) -> Vec<String> {
        let report = &progress.report;
        let mut fields = vec![
            format!("ETA {}", clock(progress.remaining)),
            format!("t={:.1$} s", progress.time, self.decimals),
            format!("step {}", report.step + 1),
            format!("dt {:.1e}", report.dt),
        ];
        if self.wet {
            fields.push(format!("CG {}", report.pressure.iterations));
            fields.push(format!("|v| {:.2}", progress.speed_max));
        }
        fields.push(format!("wall {}", clock(progress.wall)));
        fields
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
