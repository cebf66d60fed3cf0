//! `seixo report`: one page that tells of a run, with everything in it and nothing fetched.

pub mod chart;
pub mod page;
pub mod table;

use super::Exit;
use super::frames::{frames_of, is_there, without};
use super::progress::clock;
use super::render::{LookArgs, Show};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use chart::{Chart, Curve, bars};
use glam::{DQuat, DVec3};
use page::{MARK, charts, escape, html, section, table};
use rayon::prelude::*;
use seixo::case::file::load;
use seixo::case::{Case, OutputField, OutputKind};
use seixo::console::{remark, tell};
use seixo::error::{FolderError, Result};
use seixo::output::digits::{of_moment, of_time};
use seixo::output::folder::case_name;
use seixo::output::replay::Frame;
use seixo::output::spare::spare;
use seixo::output::write_whole;
use seixo::scene::Scene;
use seixo::time_step::Bounds;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::Duration;
use table::Table;

#[derive(Debug, clap::Args)]
pub struct ReportArgs {
    /// Folder of a run.
    dir: PathBuf,
    /// The page [default: DIR/report.html].
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Most pictures on it; they make its size.
    #[arg(long, value_name = "N", default_value_t = 24)]
    pictures: u16,
    #[command(flatten)]
    look: LookArgs,
    /// Say nothing.
    #[arg(short, long)]
    quiet: bool,
}

/// Kinds of particles that frames are of.
const SHOWN: [OutputKind; 2] = [OutputKind::Fluid, OutputKind::Body];

/// What a run left.
struct Run {
    name: String,
    case: Case,
    text: String,
    /// `result.json`, if the run has ended.
    result: Value,
    monitors: Table,
    bodies: Vec<(String, Table)>,
    gauges: Table,
    /// Those whose files are there, with their numbers.
    frames: Vec<(usize, Frame)>,
}

impl Run {
    fn read(root: &Path) -> Result<Self> {
        let none = || FolderError::NoRun(root.to_path_buf());
        let name = case_name(root)?.filter(|n| !n.is_empty()).ok_or_else(none)?;
        let loaded = load(&root.join("case.toml"), None, &[])?;
        let told = root.join("result.json");
        let result = std::fs::read_to_string(&told).ok().and_then(|text| {
            let read = serde_json::from_str(&text);
            if read.is_err() {
                remark(&format!("warning: {} is damaged: the page tells no verdict", told.display()));
            }
            read.ok()
        });
        // A run may have been told to write none.
        let output = &loaded.case.output;
        let frames = if output.every > 0.0 { whole_frames(root) } else { Vec::new() };
        if frames.is_empty() && output.every > 0.0 && output.kinds.iter().any(|k| SHOWN.contains(k)) {
            no_pictures(root, &loaded.case);
        }
        Ok(Self {
            name,
            case: loaded.case,
            text: loaded.text,
            result: result.unwrap_or_default(),
            monitors: Table::read(&root.join("monitors.csv"))?,
            bodies: Table::read_by(&root.join("bodies.csv"), "body")?,
            gauges: Table::read(&root.join("gauges.csv"))?,
            frames,
        })
    }
}

fn no_pictures(root: &Path, case: &Case) {
    remark(&format!("warning: no pictures: {}", without("frames", root, case, None)));
}

/// The frames of the run in `root` whose files are there.
fn whole_frames(root: &Path) -> Vec<(usize, Frame)> {
    let all = frames_of(root).unwrap_or_default().into_iter().enumerate();
    all.filter(|(k, frame)| is_there(*k, frame)).collect()
}

/// `seixo report`.
pub fn report(args: &ReportArgs) -> Exit {
    seixo::threads::start(None)?;
    let run = Run::read(&args.dir)?;
    let path = args.out.clone().unwrap_or_else(|| args.dir.join("report.html"));
    spare(&path, MARK)?;
    let pictures = pictures(args, &run)?;
    let page = page(&run, &pictures)?;
    write_whole(&path, page.as_bytes())?;
    if !args.quiet {
        tell(&format!("{} ({:.1} MB)", path.display(), page.len() as f64 / 1e6));
    }
    Ok(0)
}

/// Times and pictures of frames spread evenly over the run.
fn pictures(args: &ReportArgs, run: &Run) -> Result<Vec<(f64, String)>> {
    let (all, most) = (run.frames.len(), usize::from(args.pictures));
    let count = all.min(most);
    // Without a field there is nothing to colour the water by.
    let colours = [OutputField::Velocity, OutputField::Pressure, OutputField::NumberDensity];
    let bare = run.case.fluid.is_some() && !colours.iter().any(|f| run.case.output.fields.contains(f));
    if count == 0 || bare {
        return Ok(Vec::new());
    }
    let pick = |k: usize| if count == 1 { all - 1 } else { k * (all - 1) / (count - 1) };
    let seen: Vec<(usize, Frame)> = (0..count).map(|k| run.frames[pick(k)].clone()).collect();
    let show = Show::open(&run.case, &args.look, &seen)?;
    show.unseen(&args.look).iter().for_each(|note| remark(note));
    let draw = |frame: &(usize, Frame)| Some((frame.1.time, STANDARD.encode(show.picture(frame)?.png())));
    let drawn: Vec<(f64, String)> = seen.par_iter().filter_map(draw).collect();
    if drawn.is_empty() {
        no_pictures(&args.dir, &run.case);
    }
    Ok(drawn)
}

fn page(run: &Run, pictures: &[(f64, String)]) -> Result<String> {
    let sections = [
        section("what", "What was run", &what(run)),
        section("seen", "Pictures", &film(pictures, of_time(&run.case))),
        section("bodies", "Bodies and moving walls", &bodies(run)),
        section("gauges", "Gauges", &gauges(run)),
        section("water", "Water in and out", &water(run)),
        section("energy", "Energies", &charts(&energies(run))),
        section("steps", "Steps", &(charts(&steps(run)) + &limits(run)?)),
        section("time", "Where the time went", &times(run)),
        section(
            "case",
            "The case",
            &format!(
                "<details><summary>case.toml</summary><pre tabindex=\"0\">{}</pre></details>",
                escape(&run.text)
            ),
        ),
    ];
    Ok(html(&run.name, &verdict(&run.result), &sections, include_str!("page.js")))
}

/// The verdict in plain words.
fn verdict(result: &Value) -> String {
    let grade = result["verdict"]["grade"].as_str().unwrap_or("none");
    let (class, word, words) = match grade {
        "fine" => ("fine", "Fine", "Nothing that was watched speaks against this result."),
        "degraded" => ("degraded", "Degraded", "The result can be looked at, with these reasons in mind:"),
        "failed" => ("failed", "Failed", "The result means nothing:"),
        _ => {
            ("degraded", "Not finished", "There is no result.json: the run goes on still, or it was killed.")
        }
    };
    let all = |key: &str, [before, after]: [&str; 2]| -> String {
        let told = result["verdict"][key].as_array().into_iter().flatten().filter_map(Value::as_str);
        told.map(|r| format!("{before}{}{after}", escape(r))).collect()
    };
    let reasons = all("reasons", ["<li>", "</li>"]);
    let besides = all("left_out", ["<p>Not judged: ", "</p>"]) + &all("notes", ["<p>Note: ", "</p>"]);
    let list = if reasons.is_empty() { reasons } else { format!("<ul>{reasons}</ul>") };
    let ended = result["exit_reason"]
        .as_str()
        .map_or(String::new(), |r| format!("<p class=\"faint\">{}</p>", escape(r)));
    format!(
        "<div class=\"verdict {class}\"><strong>{word}</strong><p>{words}</p>{list}{besides}{ended}</div>"
    )
}

fn what(run: &Run) -> String {
    let (case, r) = (&run.case.run, &run.result);
    let number = |key: &str| r[key].as_f64();
    let mut rows = vec![
        ("Dimensions", case.dimensions.to_string()),
        ("Particle spacing", format!("{} m", case.spacing)),
        ("End", format!("{} s", case.end)),
    ];
    let mut put = |name, text: Option<String>| rows.extend(text.map(|t| (name, t)));
    let p = &r["particles"];
    put("Particles", p["total"].as_u64().map(|n| format!("{n}, of them {} of water", p["fluid"])));
    put(
        "Steps",
        r["steps"].as_u64().map(|n| {
            let time = number("time_s").unwrap_or(f64::NAN);
            format!("{n}, to t = {time:.0$} s", of_moment(&run.case))
        }),
    );
    let wall = number("wall_s").and_then(|s| Duration::try_from_secs_f64(s).ok());
    let parts = match r["parts"].as_u64() {
        Some(n) if n > 1 => format!(", resumed {} times", n - 1),
        _ => String::new(),
    };
    put("Run time", wall.map(|w| clock(w) + &parts));
    put(
        "Processor",
        r["adapter"].as_str().map(|a| format!("{a}, {}", r["precision"].as_str().unwrap_or(""))),
    );
    let solves = &r["pressure"];
    put(
        "Pressure",
        solves["preconditioner"].as_str().map(|name| {
            let mean = solves["iterations_mean"].as_f64().unwrap_or(f64::NAN);
            format!("{mean:.1} iterations a solve with {name}, {} failures", solves["failures"])
        }),
    );
    put("Program", r["version"].as_str().map(|v| format!("seixo {v}")));
    let rows: String = rows.iter().map(|(k, v)| format!("<dt>{k}</dt><dd>{}</dd>", escape(v))).collect();
    format!("<dl>{rows}</dl>\n")
}

/// Pictures with a slider, times in so many `decimals`; the last one alone where no script runs.
fn film(pictures: &[(f64, String)], decimals: usize) -> String {
    let Some((time, png)) = pictures.last() else { return String::new() };
    let frames: Vec<Value> = pictures
        .iter()
        .map(|(t, png)| serde_json::json!({ "time": format!("{t:.decimals$}"), "png": png }))
        .collect();
    let frames = serde_json::to_string(&frames).unwrap_or_default();
    let last = pictures.len() - 1;
    format!(
        "<img id=\"picture\" alt=\"The scene at t = {time:.decimals$} s\" src=\"data:image/png;base64,{png}\">\n\
         <div class=\"film\"><button id=\"play\" type=\"button\" hidden>Play</button>\
         <label for=\"moment\">Time</label>\
         <input id=\"moment\" type=\"range\" min=\"0\" max=\"{last}\" step=\"1\" value=\"{last}\">\
         <output id=\"said\" for=\"moment\">t = {time:.decimals$} s</output></div>\n\
         <script type=\"application/json\" id=\"frames\">{frames}</script>\n"
    )
}

fn chart(title: impl Into<String>, table: &Table, columns: &[(&str, &str)]) -> Chart {
    let curves = columns.iter().filter_map(|(column, name)| {
        table.curve(column).map(|points| Curve { name: (*name).to_owned(), points })
    });
    Chart { title: title.into(), curves: curves.collect(), dashed: false }
}

/// Bodies whose way is drawn; more would be no page.
const MOST_BODIES: usize = 12;

/// How a body is turned over time [degrees]: about y in the plane, in space by how much what was up leans; nothing of one that does not turn.
fn turned(name: &str, table: &Table, run: &Run) -> Option<Chart> {
    let [w, x, y, z] = ["qw [-]", "qx [-]", "qy [-]", "qz [-]"].map(|column| table.curve(column));
    let (w, x, y, z) = (w?, x?, y?, z?);
    let turns = (0..w.len()).map(|k| (w[k][0], DQuat::from_xyzw(x[k][1], y[k][1], z[k][1], w[k][1])));
    let turns: Vec<(f64, DQuat)> = turns.filter(|(_, q)| q.is_finite()).collect();
    let start = turns.first()?.1;
    let up = -DVec3::from(run.case.run.gravity).normalize_or(DVec3::NEG_Z);
    let flat = run.case.run.dimensions == 2;
    let mut last = 0.0;
    let angle = |&(t, q): &(f64, DQuat)| {
        if flat {
            // On from turn to turn.
            let about_y = (2.0 * q.y.atan2(q.w)).to_degrees();
            last = about_y + 360.0 * ((last - about_y) / 360.0_f64).round();
        } else {
            last = ((q * start.conjugate()) * up).angle_between(up).to_degrees();
        }
        [t, last]
    };
    let points: Vec<[f64; 2]> = turns.iter().map(angle).collect();
    let first = points[0][1];
    if points.iter().all(|p| (p[1] - first).abs() < 1e-3) {
        return None;
    }
    let (what, curve) = if flat { ("turn about y", "turn") } else { ("lean from how it stood", "lean") };
    let curves = vec![Curve { name: curve.to_owned(), points }];
    Some(Chart { title: format!("{name}: {what} [degrees]"), curves, dashed: false })
}

fn bodies(run: &Run) -> String {
    let flat = run.case.run.dimensions == 2;
    let of = |(name, table): &(String, Table)| {
        let three = |what: &str, unit: &str| {
            let columns = ["x", "y", "z"].map(|axis| format!("{what}{axis} [{unit}]"));
            let [x, y, z] = &columns;
            let all = [(x.as_str(), "x"), (y.as_str(), "y"), (z.as_str(), "z")];
            let drawn: Vec<(&str, &str)> =
                all.into_iter().filter(|(_, axis)| !flat || *axis != "y").collect();
            chart(
                format!("{name}: {} [{unit}]", if what.is_empty() { "place" } else { "force of the water" }),
                table,
                &drawn,
            )
        };
        // Obstacles of any shape have rows there, too, but no way.
        let stands = run.case.obstacle.iter().any(|o| o.name == *name);
        let mut seen = if stands { vec![] } else { vec![three("", "m")] };
        seen.extend(turned(name, table, run));
        if run.case.fluid.is_some() {
            seen.push(three("fluid_force_", "N"));
        }
        seen
    };
    let drawn: Vec<Chart> = run.bodies.iter().take(MOST_BODIES).flat_map(of).collect();
    charts(&drawn) + &page::rest(run.bodies.len(), MOST_BODIES, "bodies.csv")
}

/// Charts of gauges that are drawn.
const MOST_GAUGES: usize = 36;

/// A chart of each number, and one of the components of a vector that are not zero all the time.
fn gauges(run: &Run) -> String {
    let component = |c: &str| {
        let (name, unit) = c.split_once(" [").unwrap_or((c, ""));
        let stem = name.strip_suffix("_x").or(name.strip_suffix("_y")).or(name.strip_suffix("_z"))?;
        Some((format!("{stem} [{unit}"), name[stem.len() + 1..].to_owned()))
    };
    let mut all: Vec<(String, Vec<(&str, String)>)> = Vec::new();
    for c in run.gauges.columns().iter().skip(1) {
        let (title, label) = component(c).unwrap_or_else(|| (c.clone(), c.clone()));
        match all.last_mut() {
            Some((last, of)) if *last == title => of.push((c, label)),
            _ => all.push((title, vec![(c, label)])),
        }
    }
    let still = |c: &str| {
        let points = run.gauges.curve(c).unwrap_or_default();
        points.iter().all(|p| p[1] == 0.0 || !p[1].is_finite())
    };
    for (title, of) in &mut all {
        if of.iter().any(|(c, _)| !still(c)) {
            of.retain(|(c, _)| !still(c));
        }
        // One alone has its whole name.
        if let [(one, _)] = &of[..] {
            *title = (*one).to_owned();
        }
    }
    let draw = |(title, of): &(String, Vec<(&str, String)>)| {
        let columns: Vec<(&str, &str)> = of.iter().map(|(c, label)| (*c, label.as_str())).collect();
        chart(title.clone(), &run.gauges, &columns)
    };
    let drawn: Vec<Chart> = all.iter().take(MOST_GAUGES).map(draw).collect();
    charts(&drawn) + &page::rest(all.len(), MOST_GAUGES, "gauges.csv")
}

/// What came in and went out, of a case with openings: sums, then curves.
fn water(run: &Run) -> String {
    let w = &run.result["water"];
    let mut rows = vec![["", "particles", "volume [m3]"].map(String::from).to_vec()];
    let row = |name: &str, particles: &Value, volume: &Value| {
        let volume = volume.as_f64().map_or(String::new(), |v| format!("{v:.4e}"));
        vec![name.to_owned(), particles.as_u64().map_or(String::new(), |n| n.to_string()), volume]
    };
    if w.is_object() {
        rows.push(row("at the start", &w["particles_start"], &w["volume_start_m3"]));
        for (way, word) in [("inflow", "in through"), ("outflow", "out through")] {
            for one in w[way].as_array().into_iter().flatten() {
                let name = format!("{word} {}", one["name"].as_str().unwrap_or(""));
                rows.push(row(&name, &one["particles"], &one["volume_m3"]));
            }
        }
        rows.push(row("lost", &w["particles_lost"], &Value::Null));
        rows.push(row("at the end", &w["particles_end"], &w["volume_end_m3"]));
    }
    let through: Vec<(String, String)> = run
        .monitors
        .columns()
        .iter()
        .filter_map(|column| {
            let name = column.strip_suffix(" [m3]")?;
            let of = |way: &str, word: &str| name.strip_prefix(way).map(|n| format!("{word} {n}"));
            Some((column.clone(), of("inflow_", "in through").or_else(|| of("outflow_", "out through"))?))
        })
        .collect();
    let through: Vec<(&str, &str)> = through.iter().map(|(c, n)| (c.as_str(), n.as_str())).collect();
    let m = &run.monitors;
    let drawn = [
        chart("water that there is [m3]", m, &[("water_volume [m3]", "water")]),
        chart("let through since the start [m3]", m, &through),
    ];
    table(&rows) + &charts(&drawn)
}

fn energies(run: &Run) -> Vec<Chart> {
    let m = &run.monitors;
    let water = [("kinetic [J]", "of motion"), ("potential [J]", "of height")];
    let body = [
        ("body_kinetic [J]", "of motion"),
        ("body_potential [J]", "of height"),
        ("body_contact [J]", "in contacts"),
    ];
    let mut drawn =
        vec![chart("all together [J]", m, &[("energy [J]", "energy")]), chart("water [J]", m, &water)];
    // The columns are there without bodies, too.
    if !run.case.body.is_empty() {
        drawn.push(chart("bodies [J]", m, &body));
    }
    drawn
}

fn steps(run: &Run) -> Vec<Chart> {
    let m = &run.monitors;
    vec![
        chart("time step [s]", m, &[("dt [s]", "time step")]),
        chart("iterations of the pressure solver", m, &[("iterations [-]", "iterations")]),
        chart("way of the fastest water in a step over l0", m, &[("courant [-]", "Courant number")]),
        chart(
            "error of the particle number density [-]",
            m,
            &[("density_error_mean [-]", "mean"), ("density_error_max [-]", "largest")],
        ),
    ]
}

/// What set the time step, as a part of the rows.
fn limits(run: &Run) -> Result<String> {
    let Some(points) = run.monitors.curve("dt [s]").filter(|_| run.case.fluid.is_some()) else {
        return Ok(String::new());
    };
    let scene = Scene::build(&run.case)?;
    let params = seixo::drag::params(&run.case, &scene)?;
    let bounds = Bounds::new(&params, params.speed_at_start);
    let same = |a: f64, b: f64| (a - b).abs() < 1e-6 * b;
    let mut counts = [
        ("run.time_step", 0),
        ("the sound speed", 0),
        ("viscosity", 0),
        ("the drag on a light body", 0),
        ("what calm water is ready for, a collapse or a wave", 0),
        ("the speed of water or solids", 0),
    ];
    let steps: Vec<f64> = points.iter().map(|p| p[1]).filter(|dt| *dt > 0.0).collect();
    for &dt in &steps {
        let which = if same(dt, run.case.run.time_step) {
            0
        } else if same(dt, bounds.sound) {
            1
        } else if same(dt, bounds.viscous) {
            2
        } else if (dt / bounds.drag - 1.0).abs() < 0.01 {
            // A little of it goes by the speed of the water.
            3
        } else if same(dt, bounds.weight) {
            4
        } else {
            5
        };
        counts[which].1 += 1;
    }
    let parts: Vec<String> = counts
        .iter()
        .filter(|(_, n)| *n > 0)
        .map(|(what, n)| format!("{what} ({:.0} %)", 100.0 * f64::from(*n) / steps.len() as f64))
        .collect();
    Ok(if parts.is_empty() {
        String::new()
    } else {
        format!("<p>The time step was set by {}.</p>\n", parts.join(", "))
    })
}

fn times(run: &Run) -> String {
    let stages = run.result["stages"].as_object().into_iter().flatten();
    let stages: Vec<(String, f64)> = stages
        .filter_map(|(name, s)| Some((name.replace('_', " "), s.as_f64()?)))
        .filter(|s| s.1 > 0.0)
        .collect();
    // Each process has a clock of its own: what those before spent is in the run time alone.
    let resumed = run.result["parts"].as_u64().is_some_and(|n| n > 1);
    let of = if resumed { ", since it was last resumed" } else { "" };
    let chart = bars(&format!("seconds of each stage{of}"), "s", &stages);
    if chart.is_empty() { chart } else { format!("<div class=\"charts\">\n{chart}</div>\n") }
}
