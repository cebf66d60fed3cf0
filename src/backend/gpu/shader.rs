//! The shaders' sources, the switches that shape them, and what they bind.

use crate::error::{Error, Result};
use crate::params::Params;
use crate::plan::{Plan, Stage};
use crate::scene::Groups;
use crate::scheme::{FreeSurface, Gradient, Preconditioner, Source};
use wgpu::naga;

macro_rules! sources {
    ($($name:literal),* $(,)?) => {
        /// The kernels: name and text of shaders/NAME.wgsl, as [`crate::kernels`] lists the twins.
        pub const KERNELS: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../../../shaders/", $name, ".wgsl")))),*];
    };
}
sources!(
    "body_force",
    "cell_list",
    "collision",
    "conjugate_gradient",
    "contact_paper",
    "contact_smooth",
    "correct",
    "monitor",
    "move_solids",
    "multigrid",
    "multigrid_levels",
    "neighbour_list",
    "number_density",
    "predict",
    "pressure_gradient",
    "pressure_source",
    "viscosity",
);

/// Appended to every kernel.
pub const COMMON: &str = include_str!("../../../shaders/common.wgsl");

/// Names that `//#if NAME` may ask for.
pub const SWITCHES: [&str; 10] = [
    "CORRECTED",
    "CORRECTED_SURFACE",
    "MIXED",
    "MOVING",
    "MULTIGRID",
    "REACTION",
    "STATIC",
    "THRESHOLD_OFFSET",
    "TWO_DIMENSIONS",
    "VISCOSITY",
];

/// The switches that are on for a scene.
pub fn switches(params: &Params, groups: &Groups, plan: &Plan) -> Vec<&'static str> {
    let force = plan.has(Stage::BodyForce) && groups.moving_wall > 0;
    let on = [
        params.gradient != Gradient::Minimum,
        params.gradient == Gradient::CorrectedSurface,
        params.source == Source::Mixed,
        groups.moving_wall + groups.moving_dummy > 0,
        plan.preconditioner == Preconditioner::Multigrid,
        force && (plan.has(Stage::Viscosity) || plan.has(Stage::Collision)),
        !groups.static_range().is_empty(),
        params.free_surface == FreeSurface::ThresholdOffset,
        params.dimensions == 2,
        plan.has(Stage::Viscosity),
    ];
    SWITCHES.into_iter().zip(on).filter_map(|(name, on)| on.then_some(name)).collect()
}

/// The kernels that `plan` needs.
pub fn kernels(plan: &Plan) -> impl Iterator<Item = (&'static str, &'static str)> + '_ {
    KERNELS.iter().copied().filter(|&(name, _)| {
        if name.starts_with("contact_") {
            return plan.contact.kernel == Some(name);
        }
        // Particle collisions are applied by `correct`; the monitor and the preconditioner are no stages.
        plan.wet()
            && match name {
                "monitor" => true,
                "multigrid" | "multigrid_levels" => plan.preconditioner == Preconditioner::Multigrid,
                _ => Stage::ALL.iter().any(|s| s.name() == name && plan.has(*s)),
            }
    })
}

/// Text of a kernel with the lines between `//#if NAME` (or `//#else`) and `//#endif` left out where the
/// switch is off. Left-out lines stay as empty ones, so that line numbers in messages are those of the file.
pub fn source(text: &str, switches: &[&str]) -> String {
    let mut out = String::with_capacity(text.len() + COMMON.len());
    let mut nesting: Vec<bool> = Vec::new();
    for line in text.lines().chain(COMMON.lines()) {
        let directive = line.trim();
        if let Some(name) = directive.strip_prefix("//#if ") {
            nesting.push(switches.contains(&name));
        } else if directive == "//#else" {
            if let Some(last) = nesting.last_mut() {
                *last = !*last;
            }
        } else if directive == "//#endif" {
            nesting.pop();
        } else if nesting.iter().all(|&on| on) {
            out.push_str(line);
        }
        out.push('\n');
    }
    out
}

/// An entry point and what it binds.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its name.
    pub name: String,
    /// Number, name, and whether it is a storage buffer, of each binding that it uses.
    pub bindings: Vec<(u32, String, bool)>,
}

/// Parse and validate `source`; its entry points.
pub fn entries(file: &str, source: &str) -> Result<Vec<Entry>> {
    let path = format!("shaders/{file}.wgsl");
    let module = naga::front::wgsl::parse_str(source)
        .map_err(|e| Error::Gpu(e.emit_to_string_with_path(source, &path)))?;
    let info =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
            .validate(&module)
            .map_err(|e| Error::Gpu(e.emit_to_string_with_path(source, &path)))?;
    let bindings = |k: usize| {
        let used = info.get_entry_point(k);
        let bound = |(handle, variable): (naga::Handle<naga::GlobalVariable>, &naga::GlobalVariable)| {
            let binding = variable.binding.as_ref().filter(|_| !used[handle].is_empty())?;
            let storage = matches!(variable.space, naga::AddressSpace::Storage { .. });
            Some((binding.binding, variable.name.clone().unwrap_or_default(), storage))
        };
        module.global_variables.iter().filter_map(bound).collect()
    };
    Ok(module
        .entry_points
        .iter()
        .enumerate()
        .map(|(k, entry)| Entry { name: entry.name.clone(), bindings: bindings(k) })
        .collect())
}
