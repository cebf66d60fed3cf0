//! The shaders' sources, the switches that shape them, the functions by which they reach what may be divided, and what they bind.

use super::access::{self, PART};
use super::parts::Division;
use crate::compute::{Kernel, Program};
use crate::error::{Error, Result};
use crate::params::Params;
use crate::plan::{Arrays, Plan, Stage};
use crate::scheme::{Collision, FreeSurface, Gradient, Source};

/// Appended to every kernel.
pub const COMMON: &str = include_str!("../../../shaders/common.wgsl");

/// A name that `//#if NAME` may ask for, and whether it is on for a scene.
pub type Switch = (&'static str, fn(&Params, &Plan) -> bool);

/// The switches.
pub const SWITCHES: &[Switch] = &[
    ("ABSORBER", |_, plan| plan.needs(Arrays::Absorber)),
    // Viscosity or friction acts before collisions.
    ("ALONG", |_, plan| plan.has(Stage::Viscosity) || plan.has(Stage::WallFriction)),
    ("CONSISTENT", |params, _| params.gradient != Gradient::Minimum),
    ("COUPLED", |_, plan| plan.needs(Arrays::Coupling)),
    ("FILLED", |_, plan| plan.needs(Arrays::Level)),
    ("FORCE", |_, plan| plan.needs(Arrays::Force)),
    ("MIXED", |params, _| params.source == Source::Mixed),
    ("MOVING", |_, plan| plan.needs(Arrays::Solids)),
    ("MULTIGRID", |_, plan| plan.needs(Arrays::Multigrid)),
    ("PERIODIC", |params, _| params.periodic.is_any()),
    // Of a device that is one of many ranks'; see `rank`.
    ("RANKS", |_, _| false),
    ("REACTION", |_, plan| plan.needs(Arrays::Reaction)),
    ("SHARED_COLLISIONS", |params, _| params.collision == Collision::Shared),
    ("STATIC", |_, plan| plan.needs(Arrays::FixedWalls)),
    ("STRESS", |params, _| params.surface_stress()),
    ("SURFACE_PRESSURE", |_, plan| plan.needs(Arrays::SurfacePressure)),
    ("THRESHOLD_OFFSET", |params, _| params.free_surface == FreeSurface::ThresholdOffset),
    ("TURNING", |_, plan| plan.needs(Arrays::Turning)),
    ("TWO_DIMENSIONS", |params, _| params.dimensions == 2),
    ("VISCOSITY", |_, plan| plan.has(Stage::Viscosity)),
];

/// The switches that are on for a scene.
pub fn switches(params: &Params, plan: &Plan) -> Vec<&'static str> {
    SWITCHES.iter().filter(|(_, is_on)| is_on(params, plan)).map(|(name, _)| *name).collect()
}

/// Text of a kernel with the lines between `//#if NAME` (or `//#else`) and `//#endif` left out where the
/// switch is off. Left-out lines stay as empty ones, so that line numbers in messages are those of the file.
pub fn source(text: &str, switches: &[&str]) -> String {
    divided(text, switches, &Division::default())
}

/// [`source`] on a device that divides buffers and dispatches. Behind the text stand the functions that reach the elements of what
/// may be divided: for a buffer `b` made of ranges `b_at(place)`, for one made of planes `b_at(plane, place)`; `set_b` with the
/// value behind where it is written, `add_b`, which returns the old value, where it holds atomics.
pub fn divided(text: &str, switches: &[&str], division: &Division) -> String {
    let mut out = String::with_capacity(text.len() + COMMON.len());
    let mut nesting: Vec<bool> = Vec::new();
    let is_on =
        |name: &str| if name == "FOLDED" { division.fold.is_some() } else { switches.contains(&name) };
    for line in text.lines().chain(COMMON.lines()) {
        let directive = line.trim();
        if let Some(name) = directive.strip_prefix("//#if ") {
            nesting.push(is_on(name));
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
    if let Some(width) = division.fold {
        out.push_str(&format!("const DISPATCH_WIDTH: u32 = {width}u;\n"));
    }
    let access = access::functions(&out, division);
    out + &access
}

/// A buffer as a shader declares it.
#[derive(Clone, Debug)]
pub struct Binding {
    /// Its number.
    pub number: u32,
    /// Its name; that of the whole buffer for a part of one.
    pub name: String,
    /// Which part of it.
    pub part: usize,
    /// What it holds one or many of: a struct's name, or a plain type as [`crate::compute::Element::NAME`] writes it.
    pub element: String,
    /// A storage buffer, as opposed to a uniform.
    pub storage: bool,
}

/// An entry point and what it binds.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its name.
    pub name: String,
    /// Threads of a workgroup along x, y, z.
    pub workgroup: [u32; 3],
    /// The buffers that it uses.
    pub bindings: Vec<Binding>,
}

/// Name of the elements of a buffer of type `ty`.
fn element(module: &naga::Module, ty: naga::Handle<naga::Type>) -> String {
    use naga::TypeInner::{Array, Atomic, Scalar, Vector};
    let scalar = |kind| match kind {
        naga::ScalarKind::Float => ("f32", "f"),
        naga::ScalarKind::Sint => ("i32", "i"),
        _ => ("u32", "u"),
    };
    let ty = &module.types[ty];
    match &ty.inner {
        Array { base, .. } => element(module, *base),
        Scalar(s) | Atomic(s) => scalar(s.kind).0.into(),
        Vector { size, scalar: s } => format!("vec{}{}", *size as u8, scalar(s.kind).1),
        _ => ty.name.clone().unwrap_or_default(),
    }
}

/// Parse and validate `source`; its entry points.
pub fn entries(file: &str, source: &str) -> Result<Vec<Entry>> {
    let path = format!("shaders/{file}.wgsl");
    let module = naga::front::wgsl::parse_str(source)
        .map_err(|e| Error::gpu(e.emit_to_string_with_path(source, &path)))?;
    let info =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
            .validate(&module)
            .map_err(|e| Error::gpu(e.emit_to_string_with_path(source, &path)))?;
    let bindings = |k: usize| {
        let used = info.get_entry_point(k);
        let bound = |(handle, variable): (naga::Handle<naga::GlobalVariable>, &naga::GlobalVariable)| {
            let binding = variable.binding.as_ref().filter(|_| !used[handle].is_empty())?;
            let name = variable.name.clone().unwrap_or_default();
            let further =
                name.rsplit_once(PART).and_then(|(name, k)| Some((name.to_owned(), k.parse().ok()?)));
            let (name, part) = further.unwrap_or((name, 0));
            Some(Binding {
                number: binding.binding,
                name,
                part,
                element: element(&module, variable.ty),
                storage: matches!(variable.space, naga::AddressSpace::Storage { .. }),
            })
        };
        module.global_variables.iter().filter_map(bound).collect()
    };
    let entry = |(k, entry): (usize, &naga::EntryPoint)| Entry {
        name: entry.name.clone(),
        workgroup: entry.workgroup_size,
        bindings: bindings(k),
    };
    Ok(module.entry_points.iter().enumerate().map(entry).collect())
}

/// A shader as a device gets it.
pub struct Shader {
    /// What it is of.
    pub program: &'static Program,
    /// Its text.
    pub source: String,
    /// Its entry points.
    pub entries: Vec<Entry>,
}

impl Shader {
    /// Those of `programs` with `switches` on, on a device that divides as `division` says.
    pub fn all(
        programs: impl Iterator<Item = &'static Program>,
        switches: &[&str],
        division: &Division,
    ) -> Result<Vec<Self>> {
        let of = |program: &'static Program| {
            let source = divided(program.text, switches, division);
            let entries = entries(program.name, &source)?;
            Ok(Self { program, source, entries })
        };
        programs.map(of).collect()
    }

    /// Leave out the entry points of `kernels`.
    pub fn leave_out(&mut self, kernels: &[Kernel]) {
        let file = self.program.name;
        self.entries.retain(|entry| !kernels.iter().any(|k| k.file == file && k.entry == entry.name));
    }

    /// Storage buffers that a kernel of `shaders` binds at most.
    pub fn bindings(shaders: &[Self]) -> u32 {
        let entries = shaders.iter().flat_map(|s| &s.entries);
        entries.map(|e| e.bindings.iter().filter(|b| b.storage).count()).max().unwrap_or(0) as u32
    }
}
