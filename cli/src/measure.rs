//! `seixo measure`: velocity and pressure at points of one's choice, from the frames that a run has written.

use super::frames::{chosen, held, series_of, without};
use super::render::numbers;
use super::{Exit, counted, finite};
use glam::DVec3;
use rayon::prelude::*;
use seixo::case::file::read_text;
use seixo::case::{Case, OutputField};
use seixo::console::{remark, say};
use seixo::error::{Error, Result};
use seixo::output::particles::Particles;
use seixo::output::spare::spare;
use seixo::output::write_whole;
use seixo::probe::{Probe, Value};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct MeasureArgs {
    /// Folder of a run.
    dir: PathBuf,
    /// A point [m]; may be repeated.
    #[arg(long = "point", value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    points: Vec<DVec3>,
    /// A line from one point to another [m]; may be repeated.
    #[arg(long = "line", value_name = "X,Y,Z,X,Y,Z", allow_hyphen_values = true, value_parser = line)]
    lines: Vec<Line>,
    /// Points on each line, with its ends.
    #[arg(long, value_name = "N", default_value_t = 51, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    count: u32,
    /// A CSV file of points: x, y, z [m], a line each.
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
    /// Frames of this `[[output.series]]` of the case.
    #[arg(long, value_name = "NAME")]
    series: Option<String>,
    /// Every so many frames one.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Only the frames nearest to these times [s], e.g. 0.5,1,1.5.
    #[arg(long, value_name = "T,T,..", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite, conflicts_with = "every")]
    times: Vec<f64>,
    /// File for the table; it is printed if absent.
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// A straight line between two points.
type Line = [DVec3; 2];

fn point(text: &str) -> std::result::Result<DVec3, String> {
    numbers(text, "1,0.25,0.1").map(DVec3::from_array)
}

fn line(text: &str) -> std::result::Result<Line, String> {
    let [a, b, c, d, e, f] = numbers(text, "0,0.25,0.1,2,0.25,0.1")?;
    Ok([DVec3::new(a, b, c), DVec3::new(d, e, f)])
}

const HEADER: [&str; 8] = [
    "time [s]",
    "x [m]",
    "y [m]",
    "z [m]",
    "velocity_x [m/s]",
    "velocity_y [m/s]",
    "velocity_z [m/s]",
    "pressure [Pa]",
];

pub fn measure(args: &MeasureArgs) -> Exit {
    seixo::threads::start(None)?;
    let points = points(args)?;
    args.out.iter().try_for_each(|path| spare(path, &(HEADER.join(",") + "\n")))?;
    let (case, frames) = series_of(&args.dir, args.series.as_deref())?;
    let known = [OutputField::Velocity, OutputField::Pressure].map(|f| case.output.fields.contains(&f));
    if known == [false; 2] {
        let text = format!(
            "the frames of {} hold neither velocity nor pressure: output.fields of its case leaves them out",
            args.dir.display()
        );
        return Err(Error::usage("DIR", text));
    }
    let probe = Probe::of(&case);
    let chosen = chosen(&case, &frames, &args.times, args.every);
    let mut table = csv::Writer::from_writer(Vec::new());
    let unwritten = |e: csv::Error| Error::io("table")(e.into());
    table.write_record(HEADER).map_err(unwritten)?;
    let (mut rows, mut dry) = (0, 0);
    for (k, frame) in &chosen {
        let Some(water) = frame.fluid.as_ref().and_then(|path| held(*k, path)) else { continue };
        rows += points.len();
        let values: Vec<Option<Value>> = points.par_iter().map(|&x| probe.at(values(&water), x)).collect();
        for (x, value) in points.iter().zip(values) {
            let place = [frame.time, x.x, x.y, x.z].map(|v| v.to_string());
            let number = |x: f64, known: bool| if known { x.to_string() } else { String::new() };
            let found = value.map(|v| {
                let [x, y, z] = v.velocity.to_array().map(|x| number(x, known[0]));
                [x, y, z, number(v.pressure, known[1])]
            });
            dry += usize::from(found.is_none());
            table.write_record(place.into_iter().chain(found.unwrap_or_default())).map_err(unwritten)?;
        }
    }
    if rows == 0 {
        return Err(without("frames with water", &args.dir, &case, args.series.as_deref()));
    }
    let bytes = table.into_inner().map_err(|e| Error::io("table")(e.into_error()))?;
    for (what, _) in [("velocity", known[0]), ("pressure", known[1])].iter().filter(|(_, known)| !known) {
        remark(&format!("note: no {what}: output.fields of the case leaves it out"));
    }
    let cut = beyond(&points, &case, &probe);
    if cut > 0 {
        let many = points.len();
        remark(&format!(
            "note: {cut} of {many} points lie outside of the region that is written, or less than an effective radius within it: \
             what is not written is not read"
        ));
    } else if dry == rows {
        remark("note: no point lies in the water at any of these times");
    }
    match &args.out {
        Some(path) => {
            write_whole(path, &bytes)?;
            say(&format!("{} in {}", counted(rows, "row"), path.display()));
        }
        None => say(String::from_utf8_lossy(&bytes).trim_end()),
    }
    Ok(0)
}

/// All points that are asked for.
fn points(args: &MeasureArgs) -> Result<Vec<DVec3>> {
    let mut points = args.points.clone();
    for [a, b] in &args.lines {
        points.extend((0..args.count).map(|k| along(*a, *b, f64::from(k) / f64::from(args.count - 1))));
    }
    if let Some(path) = &args.file {
        let listed = listed(path)?;
        if listed.is_empty() {
            let name = path.display().to_string();
            let text =
                format!("{name}: it holds no points: write x, y, z [m] with commas between, a line each");
            return Err(Error::file(name, "", text));
        }
        points.extend(listed);
    }
    if points.is_empty() {
        return Err(Error::usage("--line", "say where: --point X,Y,Z, --line X,Y,Z,X,Y,Z or --file FILE"));
    }
    Ok(points)
}

/// A `part` of the way from `a` to `b`. What both ends share stays as it was typed; the rest has the digits that are not rounding.
fn along(a: DVec3, b: DVec3, part: f64) -> DVec3 {
    let told = |a: f64, b: f64| {
        if a == b || part == 0.0 || part == 1.0 {
            return if part == 1.0 { b } else { a };
        }
        let x = a + part * (b - a);
        let digits = (12.0 - a.abs().max(b.abs()).log10().floor()).clamp(0.0, 300.0) as usize;
        // No zero has a sign.
        format!("{x:.digits$}").parse().unwrap_or(x) + 0.0
    };
    DVec3::new(told(a.x, b.x), told(a.y, b.y), told(a.z, b.z))
}

/// The points of a file; one line of names may stand before them.
fn listed(path: &Path) -> Result<Vec<DVec3>> {
    let text = std::fs::File::open(path).and_then(read_text).map_err(Error::io(path))?;
    let mut points = Vec::new();
    for (k, line) in
        text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'))
    {
        match point(line) {
            Ok(x) => points.push(x),
            // Names hold no number.
            Err(_) if points.is_empty() && !line.contains(|c: char| c.is_ascii_digit()) => {}
            Err(why) => {
                let name = path.display().to_string();
                return Err(Error::file(name.clone(), "", format!("{name}:{}: {why}: `{line}`", k + 1)));
            }
        }
    }
    Ok(points)
}

/// The particles of a frame, which holds what was asked for.
fn values(water: &Particles) -> impl Iterator<Item = (DVec3, Value)> {
    let vector = |v: &[f32; 3]| DVec3::from(v.map(f64::from));
    water.position.iter().enumerate().map(move |(k, x)| {
        let velocity = water.velocity.get(k).map_or(DVec3::ZERO, vector);
        let pressure = water.pressure.get(k).map_or(0.0, |&p| f64::from(p));
        (DVec3::from(*x), Value { velocity, pressure })
    })
}

/// How many of the `points` have water around them that is not in the frames.
fn beyond(points: &[DVec3], case: &Case, probe: &Probe) -> usize {
    let Some(region) = &case.output.region else { return 0 };
    let (low, high) = (DVec3::from(region.min) + probe.radius, DVec3::from(region.max) - probe.radius);
    // Beyond the tank there is nothing to miss.
    let [start, end] = probe.room.unwrap_or([DVec3::NEG_INFINITY, DVec3::INFINITY]);
    let outside = |x: &&DVec3| {
        (0..3).filter(|&k| k != 1 || !probe.flat).any(|k| {
            let before = x[k] <= low[k] && region.min[k] > start[k];
            let behind = x[k] >= high[k] && region.max[k] < end[k];
            before || behind
        })
    };
    points.iter().filter(outside).count()
}
