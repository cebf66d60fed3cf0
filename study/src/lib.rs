//! Studies: error against run time, limits of stability, what a scene does not need.
//!
//! A study is a list of points ([`engine::Job`]) and what to make of their results. Points come from a TOML file
//! ([`definition`]) or from a function ([`pressure_solve`], [`stability`], [`gallery`], [`needs`]); the engine
//! runs them, keeps each finished one, and a report with tables and charts follows.
//!
//! | file | holds |
//! |---|---|
//! | `points/HASH.json` | a finished point; the hash is that of everything it depends on |
//! | `study.json` | what the study is and which points it has, for `collect` |
//! | `results.csv`, `results.json` | all points |
//! | `report.md` | findings in words, charts, the table |
//! | `NAME.svg` | charts |

pub mod bench;
pub mod builtin;
pub mod cases;
pub mod command;
pub mod compare;
pub mod computers;
pub mod contact_checks;
pub mod contact_cost;
pub mod contact_hard;
pub mod contact_random;
pub mod contact_repose;
pub mod contact_rest;
pub mod contact_statics;
pub mod definition;
pub mod device_compare;
pub mod draft;
pub mod drop_rows;
pub mod dry;
mod dry_studies;
pub mod engine;
pub mod gallery;
pub mod gallery_scenes;
pub mod incline;
mod judged;
mod kept;
mod manifest;
pub mod measure;
pub mod needs;
pub mod pareto;
pub mod plot;
mod plot_svg;
mod points;
pub mod pressure_size;
pub mod pressure_solve;
pub mod random_scenes;
pub mod record;
pub mod report;
pub mod result_number;
pub mod row;
pub mod run_point;
pub mod single;
pub mod spring_drop;
pub mod spring_static;
pub mod stability;
pub mod stability_contact;
pub mod stability_fluid;
pub mod time_mean;
pub mod validation;
pub mod wall_of_cubes;
mod work_precision;

use engine::{Context, Job, Options};
use report::Report;
use row::Row;
use seixo::error::Result;
use std::path::Path;

/// Makes a report of the rows, for a wanted error; may add values to them.
pub type Finish = Box<dyn Fn(&mut [Row], Option<f64>) -> Result<Report>>;

/// A study, ready to run.
pub struct Study {
    /// Name.
    pub name: String,
    /// First line of charts and report.
    pub title: String,
    /// What it asks.
    pub question: String,
    /// Its points.
    pub jobs: Vec<Job>,
    /// What to make of them.
    pub finish: Finish,
}

impl Study {
    /// Run what is open, and write the results of all that is there. Returns the rows and the findings.
    ///
    /// # Errors
    /// [`seixo::error::Error::Io`], or a reference that cannot be read.
    pub fn run(
        &self,
        options: &Options,
        context: &Context,
        wanted: Option<f64>,
    ) -> Result<(Vec<Row>, String)> {
        let rows = engine::sweep(&self.name, &self.jobs, options, context)?;
        self.conclude(&options.out, rows, wanted)
    }

    /// Write the results of `rows` into `out`. Returns them and the findings.
    ///
    /// # Errors
    /// As [`Study::run`].
    pub fn conclude(
        &self,
        out: &Path,
        mut rows: Vec<Row>,
        wanted: Option<f64>,
    ) -> Result<(Vec<Row>, String)> {
        let report = (self.finish)(&mut rows, wanted)?;
        let text = report::write(out, &self.name, &self.title, &self.question, &rows, &report)?;
        Ok((rows, text))
    }
}
