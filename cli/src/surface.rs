//! `seixo surface`: the surface of the water as meshes, from the frames that a run has written.

use super::frames::{chosen, held, place, series_of, without};
use super::{Exit, counted, finite};
use clap::ValueEnum;
use seixo::console::{remark, tell};
use seixo::error::{Error, Result};
use seixo::output::digits::of_time;
use seixo::output::replay::Frame;
use seixo::output::spare::spare_folder;
use seixo::output::surface::surface;
use seixo::output::write_whole;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct SurfaceArgs {
    /// Folder of a run.
    dir: PathBuf,
    /// Folder for the meshes [default: DIR/surface].
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Frames of this `[[output.series]]` of the case.
    #[arg(long, value_name = "NAME")]
    series: Option<String>,
    /// Every so many frames one.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Only the frames nearest to these times [s], e.g. 0.5,1,1.5.
    #[arg(long, value_name = "T,T,..", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite, conflicts_with = "every")]
    times: Vec<f64>,
    /// Edge of a cell of the grid that the surface is found on, over the particle spacing.
    #[arg(long, value_name = "X", default_value_t = 0.5, allow_negative_numbers = true, value_parser = edge)]
    cell: f64,
    /// Format of the files.
    #[arg(long, value_enum, default_value_t = Format::Ply)]
    format: Format,
    /// Say nothing.
    #[arg(short, long)]
    quiet: bool,
}

/// A format of meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Binary PLY with the water's velocity: ParaView, Blender, MeshLab.
    Ply,
    /// Wavefront OBJ.
    Obj,
}

fn edge(text: &str) -> std::result::Result<f64, String> {
    let edge = finite(text)?;
    if (0.1..=2.0).contains(&edge) { Ok(edge) } else { Err("write a number from 0.1 to 2".into()) }
}

pub fn write(args: &SurfaceArgs) -> Exit {
    seixo::threads::start(None)?;
    let series = args.series.as_deref();
    let (case, frames) = series_of(&args.dir, series)?;
    let run = &case.run;
    if run.dimensions == 2 {
        let text = "the water of a case in two dimensions has no surface to make a mesh of; draw it with `seixo render`";
        return Err(Error::usage("DIR", text));
    }
    let none = || without("frames with water", &args.dir, &case, series);
    let chosen = chosen(&case, &frames, &args.times, args.every);
    if chosen.iter().all(|(_, frame)| frame.fluid.is_none()) {
        return Err(none());
    }
    let own = place(&args.dir, series).join("surface");
    let out = args.out.clone().unwrap_or_else(|| own.clone());
    spare_folder(&out, &own)?;
    std::fs::create_dir_all(&out).map_err(Error::io(&out))?;
    let one = |(number, frame): &(usize, Frame)| -> Result<usize> {
        let Some(water) = frame.fluid.as_ref().and_then(|path| held(*number, path)) else { return Ok(0) };
        let mesh = surface(&water.position, &water.velocity, run.spacing, args.cell * run.spacing)
            .map_err(|why| Error::usage("--cell", format!("frame {number}: {why}; use larger cells")))?;
        let (extension, bytes) = match args.format {
            Format::Ply => ("ply", mesh.ply()),
            Format::Obj => ("obj", mesh.obj().into_bytes()),
        };
        write_whole(&out.join(format!("surface_{number:04}.{extension}")), &bytes)?;
        if !args.quiet {
            let (time, count, volume) = (frame.time, mesh.triangle.len(), mesh.volume());
            let decimals = of_time(&case);
            remark(&format!(
                "frame {number}, t = {time:.decimals$} s: {count} triangles around {volume:.4e} m3"
            ));
        }
        Ok(1)
    };
    // One after the other: each has a grid of up to 8 GB, and all cores work on it.
    let written: Result<Vec<usize>> = chosen.iter().map(one).collect();
    let count: usize = written?.into_iter().sum();
    if count == 0 {
        return Err(none());
    }
    if !args.quiet {
        tell(&format!("{} in {}", counted(count, "surface"), out.display()));
    }
    Ok(0)
}
