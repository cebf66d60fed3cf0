//! From what was typed to a simulation.

use super::{CaseArgs, DeviceArgs, device};
use seixo::case::file::{Loaded, load, load_text, read_text};
use seixo::checkpoint::size::Held;
use seixo::console::remark;
use seixo::error::{Error, Result};
use seixo::estimate::Estimate;
use seixo::run::from;
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// A case, read and built.
pub struct Setup {
    /// Name of the case: its file without the extension.
    pub name: String,
    /// The case.
    pub loaded: Loaded,
    /// Its particles.
    pub scene: Arc<Scene>,
}

impl Setup {
    /// Read the case of a command that begins at t = 0 and build its scene; warnings and notes go to stderr unless `quiet`.
    ///
    /// # Errors
    /// What is wrong with the case.
    pub fn new(args: &CaseArgs, quiet: bool) -> Result<Self> {
        let loaded = read(args)?;
        from::refuse(&loaded, "this command", "leave it out")?;
        Self::build(loaded, name(&args.case), quiet)
    }

    /// Build the scene of a case that was read.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn build(loaded: Loaded, name: String, quiet: bool) -> Result<Self> {
        let scene = Arc::new(Scene::build(&loaded.case).map_err(|e| loaded.placed(e))?);
        if !quiet {
            loaded.warnings.iter().for_each(|w| remark(w));
            few(&scene.notes).for_each(|n| remark(&format!("note: {n}")));
        }
        Ok(Self { name, loaded, scene })
    }

    /// What a run of the case takes, in steps of `dt` [s]; its states as the scene has it.
    pub fn estimate(&self, dt: f64) -> Estimate {
        let (case, groups) = (&self.loaded.case, &self.scene.groups);
        let built = |held: Held| Held {
            water: groups.fluid as f64,
            moving: groups.moving_slots().count() as f64,
            pressure: groups.pressure() as f64,
            slots: groups.total() as f64,
            solids: self.scene.solids.len() as f64,
            text: self.loaded.text.len() as f64,
            ..held
        };
        Estimate::new(case).holding(built).at_step(case, dt)
    }

    /// The simulation, on the processor that `args` ask for.
    ///
    /// # Errors
    /// No suitable device, or a scene that does not fit it.
    pub fn simulation(&self, args: &DeviceArgs) -> Result<Simulation> {
        let processor = device::processor(args)?;
        let opened = Simulation::on(&self.loaded.case, self.scene.clone(), &processor);
        opened.map_err(|e| self.loaded.placed(e))
    }
}

/// So many notes that differ by names and numbers only are shown.
const ALIKE: usize = 3;

/// The `notes` without those that only tell once more what [`ALIKE`] others tell, and how many these are.
fn few(notes: &[String]) -> impl Iterator<Item = String> {
    // names stand in backticks
    let without_names = |note: &String| note.split('`').step_by(2).collect::<String>();
    let number = |c: char| c.is_ascii_digit() || ".-e".contains(c);
    let mut counts: HashMap<String, usize> = HashMap::new();
    let mut shown = vec![];
    for note in notes {
        let count = counts.entry(without_names(note).replace(number, "")).or_default();
        *count += 1;
        if *count <= ALIKE {
            shown.push(note.clone());
        }
    }
    let more: usize = counts.values().map(|n| n.saturating_sub(ALIKE)).sum();
    shown.into_iter().chain((more > 0).then(|| format!("{more} more like these, of other names")))
}

/// Read a case.
///
/// # Errors
/// What is wrong with it.
pub fn read(args: &CaseArgs) -> Result<Loaded> {
    let (spacing, sets) = (args.changes.spacing, args.changes.all_sets()?);
    if !is_stdin(&args.case) {
        return load(&args.case, spacing, &sets);
    }
    let text = read_text(std::io::stdin()).map_err(|e| match e.kind() {
        std::io::ErrorKind::InvalidData => {
            Error::file("standard input", "", "standard input: not a text in UTF-8")
        }
        _ => Error::io("standard input")(e),
    })?;
    // What it names is relative to the folder that one is in.
    load_text(Path::new("standard input"), text, spacing, &sets)
}

/// Whether the case comes from standard input.
pub fn is_stdin(case: &Path) -> bool {
    case.as_os_str() == "-"
}

/// Name of a case: its file without the extension, or `stdin`.
pub fn name(case: &Path) -> String {
    if is_stdin(case) {
        return "stdin".into();
    }
    case.file_stem().map_or_else(|| "case".into(), |s| s.to_string_lossy().into_owned())
}
