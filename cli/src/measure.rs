//! `seixo measure`: velocity and pressure at points of one's choice, from the frames that a run has written.

use super::frames::{chosen, held, series_of, without};
use super::render::numbers;
use super::{Exit, counted, finite};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use seixo::case::OutputField;
use seixo::case::file::read_text;
use seixo::console::{remark, say};
use seixo::error::{Error, Result};
use seixo::output::particles::Particles;
use seixo::output::spare::spare;
use seixo::output::write_whole;
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
    #[arg(long, value_name = "T,T,..", value_delimiter = ',', value_parser = finite, conflicts_with = "every")]
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
    let run = &case.run;
    let probe =
        Probe { spacing: run.spacing, radius: run.effective_radius * run.spacing, flat: run.dimensions == 2 };
    let chosen = chosen(&case, &frames, &args.times, args.every);
    let mut table = csv::Writer::from_writer(Vec::new());
    let unwritten = |e: csv::Error| Error::io("table")(e.into());
    table.write_record(HEADER).map_err(unwritten)?;
    let (mut rows, mut dry) = (0, 0);
    for (k, frame) in &chosen {
        let Some(water) = frame.fluid.as_ref().and_then(|path| held(*k, path)) else { continue };
        rows += points.len();
        let values: Vec<Option<Value>> = points.par_iter().map(|&x| probe.at(&water, x)).collect();
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
    if dry == rows {
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
        // What both ends share stays as it was typed.
        points.extend((0..args.count).map(|k| *a + f64::from(k) / f64::from(args.count - 1) * (*b - *a)));
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

/// What the water does at a place.
#[derive(Clone, Copy, Debug, Default)]
struct Value {
    velocity: DVec3,
    pressure: f64,
}

/// Reads between particles.
struct Probe {
    spacing: f64,
    radius: f64,
    flat: bool,
}

impl Probe {
    /// Velocity and pressure at `x`: those of the linear function that comes nearest to the particles within the effective radius,
    /// by least squares with the weight (1 - r^2 / re^2)^2; where they do not span space, their mean. Exact for linear fields, on
    /// walls and at the surface, too. Nothing where no particle is nearer than the middle of a cube of eight may be, and a tenth.
    fn at(&self, water: &Particles, mut x: DVec3) -> Option<Value> {
        let mut near: Vec<(f64, DVec3, usize)> = Vec::new();
        let mut nearest = f64::INFINITY;
        for (k, p) in water.position.iter().enumerate() {
            let p = DVec3::from(p.map(f64::from));
            if self.flat {
                x.y = p.y;
            }
            let away = (p - x).length_squared() / (self.radius * self.radius);
            if away < 1.0 {
                near.push(((1.0 - away).powi(2), p, k));
                nearest = nearest.min(away);
            }
        }
        let dimensions: f64 = if self.flat { 2.0 } else { 3.0 };
        let reach = 1.1 * 0.5 * dimensions.sqrt() * self.spacing;
        if nearest.sqrt() * self.radius > reach {
            return None;
        }
        // A file holds what was asked for.
        let value = |k: usize| {
            let velocity = water.velocity.get(k).map_or(DVec3::ZERO, |v| DVec3::from(v.map(f64::from)));
            (velocity, water.pressure.get(k).map_or(0.0, |&p| f64::from(p)))
        };
        let total: f64 = near.iter().map(|n| n.0).sum();
        let middle = near.iter().map(|n| n.0 * n.1).sum::<DVec3>() / total;
        let mut mean = Value::default();
        for &(w, _, k) in &near {
            let (velocity, pressure) = value(k);
            mean.velocity += w / total * velocity;
            mean.pressure += w / total * pressure;
        }
        // Moments of the particles about their middle, over those of a full neighbourhood.
        let mut moment = DMat3::ZERO;
        // Of velocity and pressure with the place: rows x, y, z of the velocity, then the pressure.
        let mut with = [DVec3::ZERO; 4];
        for &(w, p, k) in &near {
            let d = (p - middle) / self.spacing;
            moment += DMat3::from_cols(w * d * d.x, w * d * d.y, w * d * d.z);
            let (velocity, pressure) = value(k);
            for (sum, of) in with.iter_mut().zip([velocity.x, velocity.y, velocity.z, pressure]) {
                *sum += w * of * d;
            }
        }
        if self.flat {
            moment.y_axis = DVec3::Y * total;
        }
        // In a full neighbourhood the determinant is total^3 times 0.1 or so.
        if moment.determinant() < 1e-3 * total.powi(3) {
            return Some(mean);
        }
        let inverse = moment.inverse();
        let off = (x - middle) / self.spacing;
        let [vx, vy, vz, p] = with.map(|sum| (inverse * sum).dot(off));
        Some(Value { velocity: mean.velocity + DVec3::new(vx, vy, vz), pressure: mean.pressure + p })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Water below z = 0.3 on a lattice that is shaken, with linear fields.
    fn water(flat: bool) -> Particles {
        let mut out = Particles::default();
        let (l0, mut seed) = (0.02, 7_u32);
        let mut shaken = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            0.2 * l0 * (f64::from(seed >> 8) / f64::from(1 << 24) - 0.5)
        };
        for (i, j, k) in (0..15).flat_map(|i| (0..15).flat_map(move |j| (0..15).map(move |k| (i, j, k)))) {
            if flat && j > 0 {
                continue;
            }
            let at = |n: i32| (f64::from(n) + 0.5) * l0;
            let y = if flat { 0.0 } else { at(j) + shaken() };
            let x = DVec3::new(at(i) + shaken(), y, at(k) + shaken());
            out.position.push(x.as_vec3().to_array());
            let x = x.as_vec3().as_dvec3();
            out.velocity.push([1.0 + 2.0 * x.x as f32, 0.5, 3.0 * x.z as f32]);
            out.pressure.push((9810.0 * (0.3 - x.z)) as f32);
        }
        out
    }

    #[test]
    fn linear_fields_are_read_as_they_are_also_at_walls_and_the_surface() {
        for flat in [false, true] {
            let (water, probe) = (water(flat), Probe { spacing: 0.02, radius: 0.042, flat });
            let y = if flat { 0.0 } else { 0.15 };
            // Inside, on a wall, in a corner, at the surface.
            for [x, z] in [[0.151, 0.147], [0.0, 0.15], [0.003, 0.004], [0.2, 0.299]] {
                let found = probe.at(&water, DVec3::new(x, y, z)).expect("water");
                let velocity = DVec3::new(1.0 + 2.0 * x, 0.5, 3.0 * z);
                assert!((found.velocity - velocity).abs().max_element() < 1e-5, "{x}, {z}: {found:?}");
                assert!((found.pressure - 9810.0 * (0.3 - z)).abs() < 0.02, "{x}, {z}: {found:?}");
            }
            for [x, z] in [[0.15, 0.33], [-0.03, 0.1], [5.0, 5.0]] {
                assert!(probe.at(&water, DVec3::new(x, y, z)).is_none(), "{x}, {z}");
            }
        }
    }

    #[test]
    fn a_lone_particle_is_its_own_mean() {
        let mut one = water(false);
        for values in [&mut one.position, &mut one.velocity] {
            values.truncate(1);
        }
        one.pressure.truncate(1);
        let probe = Probe { spacing: 0.02, radius: 0.042, flat: false };
        let at = DVec3::from(one.position[0].map(f64::from)) + 0.005;
        let found = probe.at(&one, at).expect("water");
        assert!((found.pressure - f64::from(one.pressure[0])).abs() < 1e-9);
    }
}
