//! `seixo render`: pictures of the frames that a run wrote.

use super::frames::{chosen, held, place, series_of, without};
use super::{Exit, counted};
use clap::ValueEnum;
use glam::DVec3;
use rayon::prelude::*;
use seixo::case::{AXES, Case, OutputKind};
use seixo::console::{remark, tell};
use seixo::error::{Error, Result};
use seixo::output::digits::of_time;
use seixo::output::label::{Picture, animation, sheet};
use seixo::output::particles::{Particles, name};
use seixo::output::picture::{Field, Painter, Style, drops_of, placed_by};
use seixo::output::replay::{Frame, particles};
use seixo::output::spare::spare_folder;
use seixo::output::write_whole;
use seixo::params::Params;
use seixo::scene::Scene;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct RenderArgs {
    /// Folder of a run.
    dir: PathBuf,
    /// Folder of the pictures [default: DIR/pictures].
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Frames of this `[[output.series]]` of the case.
    #[arg(long, value_name = "NAME")]
    series: Option<String>,
    #[command(flatten)]
    look: LookArgs,
    /// Every so many frames one.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Only the frames nearest to these times [s], e.g. 0.5,1,1.5.
    #[arg(long, value_name = "T,T,..", value_delimiter = ',', allow_hyphen_values = true, value_parser = super::finite, conflicts_with = "every")]
    times: Vec<f64>,
    /// Put all pictures on one sheet, so many in a row: sheet.png.
    #[arg(long, value_name = "COLUMNS", value_parser = clap::value_parser!(u16).range(1..))]
    sheet: Option<u16>,
    /// Join all pictures to an animation (animated PNG), so many a second: animation.png.
    #[arg(long, value_name = "RATE", value_parser = clap::value_parser!(u16).range(1..=100))]
    animation: Option<u16>,
    /// Say nothing.
    #[arg(short, long)]
    quiet: bool,
}

/// How pictures look.
#[derive(Clone, Debug, clap::Args)]
pub struct LookArgs {
    /// From where; two dimensions are always seen from the front unless an angle is given.
    #[arg(long, value_enum)]
    view: Option<Standpoint>,
    /// Turn of the camera to the right [degrees].
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = super::finite)]
    azimuth: Option<f64>,
    /// Height of the camera above the horizon [degrees].
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = angle)]
    elevation: Option<f64>,
    /// Magnification.
    #[arg(long, value_name = "X", default_value_t = 1.0, allow_negative_numbers = true, value_parser = magnification)]
    zoom: f64,
    /// Point in the middle of the picture [m].
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    target: Option<DVec3>,
    /// Width and height [pixels].
    #[arg(long, value_name = "WxH", default_value = "960x480", value_parser = size)]
    size: [usize; 2],
    /// What the water is coloured by [default: the first of speed, pressure and density that the frames hold].
    #[arg(long, value_enum)]
    field: Option<Shown>,
    /// Values of the first and the last colour, e.g. 0,2.5 [default: those of the frames].
    #[arg(long, value_name = "LO,HI", allow_hyphen_values = true, value_parser = range)]
    range: Option<[f64; 2]>,
    /// Only the water within three quarters of a spacing of a plane, e.g. y=0.25 [m].
    #[arg(long, value_name = "AXIS=AT", value_parser = slice)]
    slice: Option<(usize, f64)>,
    /// No time and no colour bar.
    #[arg(long)]
    no_labels: bool,
}

/// From where a scene is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Standpoint {
    /// From the right and above.
    Corner,
    /// Along +y: x to the right, z up.
    Front,
    /// Against the x axis: y to the right, a flume from its end.
    Side,
    /// From above.
    Top,
}

/// What the water is coloured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Shown {
    Speed,
    Pressure,
    Density,
    Vx,
    Vy,
    Vz,
}

/// What is said where nothing colours the water.
const NO_COLOUR: &str = "the frames of this run hold no field to colour the water by: output.fields of its case leaves out velocity, pressure \
                         and number_density";

impl Shown {
    fn field(self) -> Field {
        match self {
            Self::Speed => Field::Speed,
            Self::Pressure => Field::Pressure,
            Self::Density => Field::Density,
            Self::Vx => Field::Velocity(0),
            Self::Vy => Field::Velocity(1),
            Self::Vz => Field::Velocity(2),
        }
    }
}

fn angle(text: &str) -> std::result::Result<f64, String> {
    let angle = super::finite(text)?;
    if angle.abs() <= 90.0 { Ok(angle) } else { Err("write an angle from -90 to 90".into()) }
}

fn magnification(text: &str) -> std::result::Result<f64, String> {
    let zoom = super::finite(text)?;
    if (0.01..=1000.0).contains(&zoom) { Ok(zoom) } else { Err("write a number from 0.01 to 1000".into()) }
}

/// So many numbers with commas between.
pub fn numbers<const N: usize>(text: &str, example: &str) -> std::result::Result<[f64; N], String> {
    let wrong = || format!("write {N} numbers, e.g. {example}");
    let all: std::result::Result<Vec<f64>, String> = text.split(',').map(super::finite).collect();
    all.map_err(|_| wrong())?.try_into().map_err(|_| wrong())
}

fn point(text: &str) -> std::result::Result<DVec3, String> {
    numbers(text, "1,0.25,0.1").map(DVec3::from_array)
}

fn range(text: &str) -> std::result::Result<[f64; 2], String> {
    let [low, high] = numbers(text, "0,2.5")?;
    if low < high { Ok([low, high]) } else { Err("the second number is to be larger".into()) }
}

/// Edges of a picture that make sense, and fit memory [pixels].
const EDGES: std::ops::RangeInclusive<usize> = 16..=8192;

fn size(text: &str) -> std::result::Result<[usize; 2], String> {
    let wrong =
        || format!("write width and height in pixels, {} to {}, e.g. 1920x1080", EDGES.start(), EDGES.end());
    let (width, height) = text.split_once('x').ok_or_else(wrong)?;
    let edge = |text: &str| text.trim().parse().ok().filter(|n| EDGES.contains(n)).ok_or_else(wrong);
    Ok([edge(width)?, edge(height)?])
}

fn slice(text: &str) -> std::result::Result<(usize, f64), String> {
    let wrong = || "write an axis and a place, e.g. y=0.25".to_owned();
    let (axis, at) = text.split_once('=').ok_or_else(wrong)?;
    let axis = AXES.iter().position(|a| *a == axis.trim()).ok_or_else(wrong)?;
    Ok((axis, super::finite(at).map_err(|_| wrong())?))
}

impl LookArgs {
    /// The style for a run of `case`.
    ///
    /// # Errors
    /// [`Error::Usage`] for a field that its frames do not hold.
    fn style(&self, case: &Case) -> Result<Style> {
        let mut style = Style::of(case.run.dimensions);
        let view = &mut style.view;
        let preset = match self.view {
            None => None,
            Some(Standpoint::Corner) => Some((0.38, 0.42)),
            Some(Standpoint::Front) => Some((0.0, 0.0)),
            Some(Standpoint::Side) => Some((std::f64::consts::FRAC_PI_2, 0.0)),
            Some(Standpoint::Top) => Some((0.0, std::f64::consts::FRAC_PI_2)),
        };
        (view.azimuth, view.elevation) = preset.unwrap_or((view.azimuth, view.elevation));
        view.azimuth = self.azimuth.map_or(view.azimuth, f64::to_radians);
        view.elevation = self.elevation.map_or(view.elevation, f64::to_radians);
        (view.zoom, view.target, view.size) = (self.zoom, self.target, self.size);
        let held = |shown: &Shown| case.output.fields.contains(&shown.field().source());
        let known: Vec<Shown> = Shown::value_variants().iter().copied().filter(held).collect();
        style.field = match (self.field, known.first()) {
            (Some(asked), _) if !held(&asked) => {
                let names: Vec<String> =
                    known.iter().filter_map(|s| s.to_possible_value()).map(|v| v.get_name().into()).collect();
                let there = if names.is_empty() { "none".into() } else { names.join(", ") };
                let text = format!(
                    "the frames of this run hold no `{}`: output.fields of its case leaves it out; --field can be: {there}",
                    name(asked.field().source())
                );
                return Err(Error::usage("--field", text));
            }
            (Some(asked), _) => asked.field(),
            (None, Some(first)) => first.field(),
            // No water, nothing to colour.
            (None, None) if !case.output.kinds.contains(&OutputKind::Fluid) || case.fluid.is_none() => {
                Field::Speed
            }
            (None, None) => return Err(Error::usage("--field", NO_COLOUR)),
        };
        (style.range, style.slice, style.labels) = (self.range, self.slice, !self.no_labels);
        style.decimals = of_time(case);
        Ok(style)
    }
}

/// A run that is looked at.
pub struct Show {
    scene: Scene,
    painter: Painter,
}

impl Show {
    /// The run of `case`, of which `frames` are shown, seen as `look` says.
    ///
    /// # Errors
    /// A case that cannot be built any more, a look that shows nothing.
    pub fn open(case: &Case, look: &LookArgs, frames: &[(usize, Frame)]) -> Result<Self> {
        let scene = Scene::build(case)?;
        let params = Params::new(case, &scene)?;
        let mut style = look.style(case)?;
        if style.range.is_none() {
            style.range = range_of(frames, &style, &params);
        }
        // `output.kinds`, or the region of a series, may leave out all water.
        style.bar = waters(frames, 1).any(|water| !water.is_empty());
        Ok(Self { painter: Painter::new(&scene, &style, &params), scene })
    }

    /// What `look` asks for that shows nothing: places beside the scene.
    pub fn unseen(&self, look: &LookArgs) -> Vec<String> {
        let (low, high) = self.scene.domain;
        let mut notes = Vec::new();
        if let Some((axis, at)) = look.slice.filter(|&(k, at)| at < low[k] || at > high[k]) {
            let (name, low, high) = (AXES[axis], low[axis], high[axis]);
            notes.push(format!(
                "note: --slice {name}={at:e} shows no water: the scene reaches from {name} = {low:.4} to {high:.4} m"
            ));
        }
        let far = (high - low).length() / look.zoom.min(1.0);
        if let Some(target) = look.target.filter(|t| (*t - 0.5 * (low + high)).length() > far) {
            notes.push(format!(
                "note: --target {:e},{:e},{:e} is so far from the scene (from {low:.2} to {high:.2} m) that nothing may be seen",
                target.x, target.y, target.z
            ));
        }
        notes
    }

    /// The picture of frame number `k`; nothing, and says so, if it cannot be read.
    pub fn picture(&self, (k, frame): &(usize, Frame)) -> Option<Picture> {
        let read = |path: &Option<PathBuf>| match path {
            Some(path) => held(*k, path),
            None => Some(Particles::default()),
        };
        let (fluid, solids) = (read(&frame.fluid)?, read(&frame.solids)?);
        let poses = placed_by(&self.scene, &solids);
        Some(self.painter.paint(&self.scene, frame.time, &poses, drops_of(&fluid)))
    }
}

/// Frames that are looked at for the range of the colours.
const LOOKED_AT: usize = 5;

/// The water of every so many of `frames` that can be read, from the end on, so that a start from rest alone sets no range.
fn waters(frames: &[(usize, Frame)], step: usize) -> impl Iterator<Item = Particles> + '_ {
    let files = frames.iter().rev().step_by(step).filter_map(|(_, frame)| frame.fluid.as_deref());
    files.filter_map(|file| particles(file).ok())
}

/// The range of what `frames` show, from some of them. What cannot be read is told of when it is to be drawn.
fn range_of(frames: &[(usize, Frame)], style: &Style, params: &Params) -> Option<[f64; 2]> {
    let step = frames.len().div_ceil(LOOKED_AT).max(1);
    let waters: Vec<Particles> = waters(frames, step).collect();
    let drops = waters.iter().flat_map(drops_of);
    let mut values: Vec<f64> = drops.map(|drop| style.field.of(&drop, params.number_density)).collect();
    style.field.range(&mut values)
}

pub fn render(args: &RenderArgs) -> Exit {
    seixo::threads::start(None)?;
    let series = args.series.as_deref();
    let (case, frames) = series_of(&args.dir, series)?;
    let none = || without("frames", &args.dir, &case, series);
    let chosen = chosen(&case, &frames, &args.times, args.every);
    if chosen.is_empty() {
        return Err(none());
    }
    let show = Show::open(&case, &args.look, &chosen)?;
    show.unseen(&args.look).iter().for_each(|note| remark(note));
    let pictures = place(&args.dir, series).join("pictures");
    let out = args.out.clone().unwrap_or_else(|| pictures.clone());
    spare_folder(&out, &pictures)?;
    std::fs::create_dir_all(&out).map_err(Error::io(&out))?;
    let joined = args.sheet.is_some() || args.animation.is_some();
    // How many are drawn, and the picture where it is not written at once.
    let one = |frame: &(usize, Frame)| -> Result<(usize, Option<Picture>)> {
        let Some(picture) = show.picture(frame) else { return Ok((0, None)) };
        if joined {
            return Ok((1, Some(picture)));
        }
        let (number, time) = (frame.0, frame.1.time);
        write_whole(&out.join(format!("frame_{number:04}.png")), &picture.png())?;
        if !args.quiet {
            remark(&format!("frame {number}, t = {time:.0$} s", of_time(&case)));
        }
        Ok((1, None))
    };
    let drawn: Vec<(usize, Option<Picture>)> = chosen.par_iter().map(one).collect::<Result<_>>()?;
    let count: usize = drawn.iter().map(|d| d.0).sum();
    if count == 0 {
        return Err(none());
    }
    let pictures: Vec<Picture> = drawn.into_iter().filter_map(|d| d.1).collect();
    let count = counted(count, "picture");
    let mut written = format!("{count} in {}", out.display());
    let whole = [
        ("sheet.png", args.sheet.and_then(|n| sheet(&pictures, n.into())).map(|p| p.png())),
        ("animation.png", args.animation.and_then(|rate| animation(&pictures, rate))),
    ];
    for (name, bytes) in whole {
        if let Some(bytes) = bytes {
            write_whole(&out.join(name), &bytes)?;
            written = format!("{count} in {}", out.join(name).display());
        }
    }
    if !args.quiet {
        tell(&written);
    }
    Ok(0)
}
