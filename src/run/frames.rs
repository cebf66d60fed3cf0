//! Frames: the particles of one moment, in VTU files and pictures.

use super::due::Due;
use crate::case::{Case, Choice, Encoding, OutputField, OutputKind};
use crate::checkpoint::Archive;
use crate::error::{Error, Result};
use crate::extents::in_double;
use crate::fields::Fields;
use crate::output::digits::of_time;
use crate::output::folder::{Folder, series_in};
use crate::output::particles::{Carried, Particles, Region};
use crate::output::picture::{Painter, Style, drops, placed};
use crate::output::pieces::{self, Pieces};
use crate::output::pvd::Pvd;
use crate::output::write_whole;
use crate::params::Params;
use crate::scene::Scene;
use crate::simulation::Simulation;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Writes frames: those of `[output]`, and those of each `[[output.series]]`.
#[derive(Debug)]
pub struct Frames {
    folder: Folder,
    picture: Option<Painter>,
    main: Series,
    others: Vec<Series>,
}

/// Frames of one choice, in a folder of their own.
#[derive(Debug)]
struct Series {
    /// Before the names of its numbers in a state.
    prefix: String,
    root: PathBuf,
    pvd: Pvd,
    encoding: Encoding,
    fields: Vec<OutputField>,
    region: Option<Region>,
    /// Whether places are in double precision.
    double: bool,
    fluid: bool,
    solids: bool,
    walls: (bool, bool),
    every: f64,
    due: Due,
    written: u64,
    /// The last frame is that of the present step.
    fresh: Option<u64>,
}

impl Frames {
    /// Frames of `scene` in `folder`, with the kinds of particles that `case` asks for. `pictures` adds
    /// a picture of every frame of `[output]`.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder of the pictures or of a series cannot be made.
    pub fn new(folder: &Folder, case: &Case, scene: &Scene, params: &Params, pictures: bool) -> Result<Self> {
        let output = &case.output;
        let style = Style { decimals: of_time(case), ..Style::of(scene.dimensions) };
        let picture = pictures.then(|| Painter::new(scene, &style, params));
        if pictures {
            std::fs::create_dir_all(folder.pictures()).map_err(Error::io(folder.pictures()))?;
        }
        let series = |choice: Choice<'_>, prefix: String, root: PathBuf, pvd: PathBuf| Series {
            prefix,
            root,
            pvd: Pvd::new(pvd),
            encoding: output.encoding,
            fields: choice.fields.to_vec(),
            region: choice.region.map(|region| Region::new(&region, scene)),
            double: in_double(scene.domain, scene.spacing),
            fluid: choice.has(OutputKind::Fluid) && scene.groups.fluid > 0,
            solids: choice.has(OutputKind::Body) && !scene.solids.is_empty(),
            walls: (
                choice.has(OutputKind::Wall) && scene.groups.static_wall > 0,
                choice.has(OutputKind::Dummy) && scene.groups.static_dummy > 0,
            ),
            every: choice.every,
            due: Due::new(Some(choice.every)),
            written: 0,
            fresh: None,
        };
        let other = |named: &crate::case::Series| {
            let root = series_in(folder.root(), &named.name);
            std::fs::create_dir_all(root.join("vtu")).map_err(Error::io(&root))?;
            let pvd = root.join(format!("{}.pvd", named.name));
            Ok(series(named.choice(), format!("series.{}.", named.name), root, pvd))
        };
        Ok(Self {
            folder: folder.clone(),
            picture,
            main: series(output.choice(), String::new(), folder.root().to_path_buf(), folder.pvd()),
            others: output.series.iter().map(other).collect::<Result<_>>()?,
        })
    }

    fn each(&mut self) -> impl Iterator<Item = &mut Series> {
        std::iter::once(&mut self.main).chain(&mut self.others)
    }

    /// Save which frames there are, or go back to them.
    ///
    /// # Errors
    /// [`Error::Case`], [`Error::Io`].
    pub(crate) fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        self.each().try_for_each(|series| series.exchange(archive))
    }

    /// A run that begins late: moments before `time` [s] are over.
    pub(crate) fn skip(&mut self, time: f64) {
        self.each().for_each(|series| {
            series.due.reached(time);
        });
    }

    /// Whether there is a frame of `[output]` of step `steps`.
    pub(crate) fn is_fresh(&self, steps: u64) -> bool {
        self.main.fresh == Some(steps)
    }

    /// Frames of `[output]` written so far.
    pub fn written(&self) -> u64 {
        self.main.written
    }

    /// Frames of each series written so far.
    pub fn written_by_name(&self) -> BTreeMap<String, u64> {
        let name =
            |series: &Series| series.root.file_name().unwrap_or_default().to_string_lossy().into_owned();
        self.others.iter().map(|series| (name(series), series.written)).collect()
    }

    /// Write the present state as the next frame of all series.
    ///
    /// # Errors
    /// [`Error::Io`], or what the backend says when it is read.
    pub fn write(&mut self, simulation: &mut Simulation, scene: &Scene) -> Result<()> {
        self.write_where(simulation, scene, |_| true).map(drop)
    }

    /// Write it for those whose moment the run has reached; says whether `[output]` is one of them.
    ///
    /// # Errors
    /// As [`Frames::write`].
    pub(crate) fn write_due(&mut self, simulation: &mut Simulation, scene: &Scene) -> Result<bool> {
        let time = simulation.time;
        self.write_where(simulation, scene, |series| series.due.reached(time))
    }

    /// Write it for those that have no frame of it.
    ///
    /// # Errors
    /// As [`Frames::write`].
    pub(crate) fn write_end(&mut self, simulation: &mut Simulation, scene: &Scene) -> Result<()> {
        let steps = simulation.steps;
        self.write_where(simulation, scene, |series| series.fresh != Some(steps)).map(drop)
    }

    /// Write it for those of which `now` says so, unless the case wants none (`output.every = 0`).
    fn write_where(
        &mut self,
        simulation: &mut Simulation,
        scene: &Scene,
        now: impl Fn(&mut Series) -> bool,
    ) -> Result<bool> {
        let named: Vec<bool> = self.each().map(|series| now(series) && series.every > 0.0).collect();
        let pictures = self.picture.is_some() && named[0];
        let asked = self.each().zip(&named).any(|(series, now)| *now && series.reads());
        let carried = self.each().zip(&named).any(|(series, now)| *now && series.carries());
        // Once for all of them; where nothing of it is shown a device is not waited for.
        let present = Present::new(simulation, asked, carried, pictures)?;
        let number = self.main.written;
        for (series, _) in self.each().zip(&named).filter(|(_, now)| **now) {
            series.write(simulation, scene, &present)?;
        }
        if let Some(picture) = self.picture.as_ref().filter(|_| pictures) {
            let png = paint(picture, simulation, scene, present.fields.as_ref());
            write_whole(&self.folder.pictures().join(format!("frame_{number:04}.png")), &png)?;
        }
        Ok(named[0])
    }

    /// Write `vtu/last_*.vtu`: the state in which a run was given up. It is no part of the series.
    ///
    /// # Errors
    /// [`Error::Io`], or what the backend says when it is read.
    pub(crate) fn write_last(&self, simulation: &mut Simulation, scene: &Scene) -> Result<()> {
        let present = Present::new(simulation, true, self.main.carries(), false)?;
        self.main.put_moving(simulation, scene, &present, |name| format!("last_{name}")).map(drop)
    }

    /// Write `final.png`, if there are pictures.
    ///
    /// # Errors
    /// [`Error::Io`], or what the backend says when it is read.
    pub(crate) fn write_final_picture(&self, simulation: &mut Simulation, scene: &Scene) -> Result<()> {
        let Some(picture) = &self.picture else { return Ok(()) };
        let fields = read(simulation)?;
        let png = paint(picture, simulation, scene, fields.as_ref());
        write_whole(&self.folder.file("final.png"), &png)
    }
}

impl Series {
    fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        let Self {
            prefix,
            root: _,
            pvd,
            encoding: _,
            fields: _,
            region: _,
            double: _,
            fluid: _,
            solids: _,
            walls: _,
            every: _,
            due,
            written,
            fresh,
        } = self;
        let mut step = fresh.unwrap_or(u64::MAX);
        archive.count(&format!("{prefix}frames.step"), &mut step)?;
        *fresh = Some(step).filter(|&s| s != u64::MAX);
        archive.count(&format!("{prefix}frames"), written)?;
        due.exchange(&format!("{prefix}frames"), archive)?;
        pvd.exchange(prefix, archive)
    }

    /// Whether its frames hold anything that a scene and the poses of its solids do not tell.
    fn reads(&self) -> bool {
        let carried = [OutputField::Pressure, OutputField::NumberDensity];
        self.fluid || carried.iter().any(|field| self.fields.contains(field))
    }

    /// Whether they hold of solids what the scene and their poses do not tell.
    fn carries(&self) -> bool {
        let carried = [OutputField::Pressure, OutputField::NumberDensity];
        let walls = self.walls != (false, false) && self.written == 0;
        (self.solids || walls) && carried.iter().any(|field| self.fields.contains(field))
    }

    /// Write the next frame.
    fn write(&mut self, simulation: &mut Simulation, scene: &Scene, present: &Present) -> Result<()> {
        let (number, time) = (self.written, simulation.time);
        let mut parts = Vec::new();
        if self.walls != (false, false) {
            let file = "vtu/walls.vtu".to_string();
            if number == 0 {
                let walls = Particles::walls(scene, present.carried(), self.walls.0, self.walls.1);
                self.put(&file, &self.cut(walls), time)?;
            }
            parts.push(("walls", file));
        }
        parts.extend(self.put_moving(simulation, scene, present, |name| format!("{name}_{number:04}"))?);
        self.pvd.push(time, &parts)?;
        self.written += 1;
        self.fresh = Some(simulation.steps);
        Ok(())
    }

    /// Writes what moves to files that are called as `name` has it, without their ending; returns these files.
    fn put_moving(
        &self,
        simulation: &mut Simulation,
        scene: &Scene,
        present: &Present,
        name: impl Fn(&str) -> String,
    ) -> Result<Vec<(&'static str, String)>> {
        let time = simulation.time;
        let mut parts = Vec::new();
        let stem = format!("vtu/{}", name("fluid"));
        let path = self.root.join(&stem);
        if let Some(lead) = simulation.backend.lead().filter(|_| self.fluid) {
            let pieces = Pieces::new(&path, time, self.encoding, &self.fields, self.region, self.double);
            lead.write_pieces(&pieces)?;
            parts.push(("fluid", format!("{stem}.pvtu")));
        } else if let Some(fields) = present.fields.as_ref().filter(|_| self.fluid) {
            let file = format!("{stem}.vtu");
            self.put(&file, &self.cut(Particles::fluid(scene, fields)), time)?;
            pieces::replace(&path)?;
            parts.push(("fluid", file));
        }
        if self.solids {
            let file = format!("vtu/{}.vtu", name("solids"));
            let particles = Particles::solids(scene, simulation.solids.poses(), present.carried(), true);
            self.put(&file, &particles, time)?;
            parts.push(("solids", file));
        }
        Ok(parts)
    }

    /// What lies in the region of the output.
    fn cut(&self, particles: Particles) -> Particles {
        match &self.region {
            Some(region) => particles.within(region),
            None => particles,
        }
    }

    fn put(&self, file: &str, particles: &Particles, time: f64) -> Result<()> {
        let path: PathBuf = self.root.join(file);
        let mut fields = self.fields.clone();
        if particles.body.iter().any(|&body| body > 0) {
            // Places of solids are read from these.
            fields.extend([OutputField::Body, OutputField::Id]);
        }
        write_whole(&path, &particles.vtu(time, self.encoding, &fields, self.double))
    }
}

/// What is read of a state for its frames.
#[derive(Default)]
struct Present {
    /// All particles, where one rank has them, or a picture shows them.
    fields: Option<Fields>,
    /// Else pressures and number densities of the wall layers, if they are shown, and the slot of the first.
    walls: Option<(usize, [Vec<f64>; 2])>,
}

impl Present {
    /// That of `simulation`, of which frames show anything but poses if `asked`, pressures of solids if `carried`, and `pictures` all.
    fn new(simulation: &mut Simulation, asked: bool, carried: bool, pictures: bool) -> Result<Self> {
        let first = simulation.groups.fluid;
        // Many ranks write the water themselves.
        match simulation.backend.lead() {
            Some(lead) if !pictures => {
                let walls = if carried { Some((first, lead.read_walls()?)) } else { None };
                Ok(Self { fields: None, walls })
            }
            _ if asked || pictures => Ok(Self { fields: read(simulation)?, walls: None }),
            _ => Ok(Self::default()),
        }
    }

    fn carried(&self) -> Option<Carried<'_>> {
        if let Some(fields) = &self.fields {
            return Some(Carried::of(fields));
        }
        let (first, [pressure, number_density]) = self.walls.as_ref()?;
        Some(Carried { first: *first, pressure, number_density })
    }
}

/// The present state as PNG.
fn paint(painter: &Painter, simulation: &Simulation, scene: &Scene, fields: Option<&Fields>) -> Vec<u8> {
    let poses = placed(simulation.solids.poses());
    painter.paint(scene, simulation.time, &poses, drops(scene, fields)).png()
}

/// All fields; a dry scene has none, and its backend is not asked.
pub(super) fn read(simulation: &mut Simulation) -> Result<Option<Fields>> {
    if simulation.plan.wet() { simulation.backend.read().map(Some) } else { Ok(None) }
}
