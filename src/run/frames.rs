//! Frames: the particles of one moment, in VTU files and pictures.

use crate::case::{Encoding, Output, OutputField, OutputKind, OutputRegion};
use crate::checkpoint::Archive;
use crate::error::{Error, Result};
use crate::fields::Fields;
use crate::output::folder::Folder;
use crate::output::particles::Particles;
use crate::output::picture::{Painter, Style, drops, placed};
use crate::output::pvd::Pvd;
use crate::output::write_whole;
use crate::params::Params;
use crate::scene::Scene;
use crate::simulation::Simulation;
use std::path::PathBuf;

/// Writes frames.
#[derive(Debug)]
pub struct Frames {
    folder: Folder,
    pvd: Pvd,
    encoding: Encoding,
    fields: Vec<OutputField>,
    region: Option<OutputRegion>,
    fluid: bool,
    solids: bool,
    walls: (bool, bool),
    every: f64,
    picture: Option<Painter>,
    written: u64,
    /// The last frame is that of the present step.
    fresh: Option<u64>,
}

impl Frames {
    /// Frames of `scene` in `folder`, with the kinds of particles that `output` asks for. `pictures` adds
    /// a picture of every frame.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder of the pictures cannot be made.
    pub fn new(
        folder: &Folder,
        output: &Output,
        scene: &Scene,
        params: &Params,
        pictures: bool,
    ) -> Result<Self> {
        let asked = |kind| output.kinds.contains(&kind);
        let groups = &scene.groups;
        let picture = pictures.then(|| Painter::new(scene, &Style::of(scene.dimensions), params));
        if pictures {
            std::fs::create_dir_all(folder.pictures()).map_err(Error::io(folder.pictures()))?;
        }
        Ok(Self {
            folder: folder.clone(),
            pvd: Pvd::new(folder.pvd()),
            encoding: output.encoding,
            fields: output.fields.clone(),
            region: output.region,
            fluid: asked(OutputKind::Fluid) && groups.fluid > 0,
            solids: asked(OutputKind::Body) && !scene.solids.is_empty(),
            walls: (
                asked(OutputKind::Wall) && groups.static_wall > 0,
                asked(OutputKind::Dummy) && groups.static_dummy > 0,
            ),
            every: output.every,
            picture,
            written: 0,
            fresh: None,
        })
    }

    /// Save which frames there are, or go back to them.
    ///
    /// # Errors
    /// [`Error::Case`], [`Error::Io`].
    pub(crate) fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        let Self {
            folder: _,
            encoding: _,
            fields: _,
            region: _,
            fluid: _,
            solids: _,
            walls: _,
            every: _,
            picture: _,
            fresh,
            pvd,
            written,
        } = self;
        let mut step = fresh.unwrap_or(u64::MAX);
        archive.count("frames.step", &mut step)?;
        *fresh = Some(step).filter(|&s| s != u64::MAX);
        archive.count("frames", written)?;
        pvd.exchange(archive)
    }

    /// Whether there is a frame of step `steps`.
    pub(crate) fn is_fresh(&self, steps: u64) -> bool {
        self.fresh == Some(steps)
    }

    /// Frames written so far.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// Write the present state as the next frame, unless the case wants none (`output.every = 0`).
    ///
    /// # Errors
    /// [`Error::Io`], or what the backend says when it is read.
    pub fn write(&mut self, simulation: &mut Simulation, scene: &Scene) -> Result<()> {
        if self.every <= 0.0 {
            return Ok(());
        }
        let (number, time) = (self.written, simulation.time);
        let fields = read(simulation)?;
        let mut parts = Vec::new();
        if self.walls != (false, false) {
            let file = "vtu/walls.vtu".to_string();
            if number == 0 {
                let walls = Particles::walls(scene, fields.as_ref(), self.walls.0, self.walls.1);
                self.put(&file, &self.cut(walls, scene), time)?;
            }
            parts.push(("walls", file));
        }
        for (name, particles) in self.moving(simulation, scene, fields.as_ref()) {
            let file = format!("vtu/{name}_{number:04}.vtu");
            self.put(&file, &particles, time)?;
            parts.push((name, file));
        }
        self.pvd.push(time, &parts)?;
        if let Some(picture) = &self.picture {
            let png = paint(picture, simulation, scene, fields.as_ref());
            write_whole(&self.folder.pictures().join(format!("frame_{number:04}.png")), &png)?;
        }
        self.written += 1;
        self.fresh = Some(simulation.steps);
        Ok(())
    }

    /// Write `vtu/last_*.vtu`: the state in which a run was given up. It is no part of the series.
    ///
    /// # Errors
    /// [`Error::Io`], or what the backend says when it is read.
    pub(crate) fn write_last(&self, simulation: &mut Simulation, scene: &Scene) -> Result<()> {
        let fields = read(simulation)?;
        for (name, particles) in self.moving(simulation, scene, fields.as_ref()) {
            self.put(&format!("vtu/last_{name}.vtu"), &particles, simulation.time)?;
        }
        Ok(())
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

    fn moving(
        &self,
        simulation: &Simulation,
        scene: &Scene,
        fields: Option<&Fields>,
    ) -> Vec<(&'static str, Particles)> {
        let mut parts = Vec::new();
        if let Some(fields) = fields.filter(|_| self.fluid) {
            parts.push(("fluid", self.cut(Particles::fluid(scene, fields), scene)));
        }
        if self.solids {
            parts.push(("solids", Particles::solids(scene, simulation.solids.poses(), fields, true)));
        }
        parts
    }

    /// What lies in the region of the output.
    fn cut(&self, particles: Particles, scene: &Scene) -> Particles {
        match &self.region {
            Some(region) => particles.within(region, scene.dimensions == 2),
            None => particles,
        }
    }

    fn put(&self, file: &str, particles: &Particles, time: f64) -> Result<()> {
        let path: PathBuf = self.folder.root().join(file);
        let mut fields = self.fields.clone();
        if particles.body.iter().any(|&body| body > 0) {
            // Places of solids are read from these.
            fields.extend([OutputField::Body, OutputField::Id]);
        }
        write_whole(&path, &particles.vtu(time, self.encoding, &fields))
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
