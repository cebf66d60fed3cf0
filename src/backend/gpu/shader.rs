//! The shaders' sources, the switches that shape them, the functions by which they reach what may be divided, and what they bind.

use super::buffers::{Row, TABLE};
use super::parts::{Division, Parts, Split};
use crate::compute::{Program, Spec};
use crate::error::{Error, Result};
use crate::params::Params;
use crate::plan::{Arrays, Plan, Stage};
use crate::scheme::{Collision, FreeSurface, Gradient, Source};

/// Appended to every kernel.
pub const COMMON: &str = include_str!("../../../shaders/common.wgsl");

/// Names that `//#if NAME` may ask for.
pub const SWITCHES: [&str; 15] = [
    "ABSORBER",
    "CONSISTENT",
    "COUPLED",
    "FILLED",
    "MIXED",
    "MOVING",
    "MULTIGRID",
    "PERIODIC",
    "REACTION",
    "SHARED_COLLISIONS",
    "STATIC",
    "SURFACE_PRESSURE",
    "THRESHOLD_OFFSET",
    "TWO_DIMENSIONS",
    "VISCOSITY",
];

/// The switches that are on for a scene.
pub fn switches(params: &Params, plan: &Plan) -> Vec<&'static str> {
    let on = [
        plan.needs(Arrays::Absorber),
        params.gradient != Gradient::Minimum,
        plan.needs(Arrays::Coupling),
        plan.needs(Arrays::Level),
        params.source == Source::Mixed,
        plan.needs(Arrays::Solids),
        plan.needs(Arrays::Multigrid),
        params.periodic.is_any(),
        plan.needs(Arrays::Reaction),
        params.collision == Collision::Shared,
        plan.needs(Arrays::FixedWalls),
        plan.needs(Arrays::SurfacePressure),
        params.free_surface == FreeSurface::ThresholdOffset,
        params.dimensions == 2,
        plan.has(Stage::Viscosity),
    ];
    SWITCHES.into_iter().zip(on).filter_map(|(name, on)| on.then_some(name)).collect()
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
    let access: String = {
        let mut next = FIRST_PART;
        out.lines().filter_map(|line| Some(Access::new(line, division)?.text(&mut next))).collect()
    };
    out + &access
}

/// First number of the bindings of further parts; the files number their own below.
const FIRST_PART: u32 = 32;
/// Between the name of a buffer and the number of a further part.
const PART: &str = "_part";

/// Access to a buffer that may be divided, as a file declares it.
struct Access<'a> {
    row: &'static Row,
    writes: bool,
    /// In the array's brackets.
    held: &'a str,
    parts: Option<&'a Parts>,
}

impl<'a> Access<'a> {
    /// That of a line, if it declares such a buffer.
    fn new(line: &'a str, division: &'a Division) -> Option<Self> {
        let (access, rest) =
            line.strip_prefix("@group(0) ")?.split_once("var<storage, ")?.1.split_once("> ")?;
        let (name, rest) = rest.split_once(": array<")?;
        let row = TABLE.iter().find(|r| r.spec.id.name() == name && !matches!(r.split, Split::Whole))?;
        let held = rest.split_once(">;")?.0;
        Some(Self { row, writes: access == "read_write", held, parts: division.of(name) })
    }

    /// Declarations of the further parts, numbered from `next` on, and the functions.
    fn text(&self, next: &mut u32) -> String {
        let Spec { id, element, .. } = self.row.spec;
        let name = id.name();
        let atomic = self.held.starts_with("atomic");
        let access = if self.writes { "read_write" } else { "read" };
        let mut out = String::new();
        for part in 1..self.parts.map_or(1, |p| p.count) {
            let held = self.held;
            out += &format!(
                "@group(0) @binding({next}) var<storage, {access}> {name}{PART}{part}: array<{held}>;\n"
            );
            *next += 1;
        }
        let at = self.arguments();
        let read =
            |b: &str| if atomic { format!("return atomicLoad(&{b});") } else { format!("return {b};") };
        out += &format!("fn {name}_at({at}) -> {element} {{\n{}}}\n", self.body(read));
        if self.writes {
            let set =
                |b: &str| if atomic { format!("atomicStore(&{b}, value);") } else { format!("{b} = value;") };
            out += &format!("fn set_{name}({at}, value: {element}) {{\n{}}}\n", self.body(set));
        }
        if atomic {
            let add = |b: &str| format!("return atomicAdd(&{b}, value);");
            out += &format!("fn add_{name}({at}, value: {element}) -> {element} {{\n{}}}\n", self.body(add));
        }
        out
    }

    fn arguments(&self) -> &'static str {
        if matches!(self.row.split, Split::Planes { .. }) { "plane: u32, place: u32" } else { "place: u32" }
    }

    /// What is `done` to an element of the buffer: of the one that there is, or of the part that the element lies in.
    fn body(&self, done: impl Fn(&str) -> String) -> String {
        let name = self.row.spec.id.name();
        let pitch = if let Split::Planes { pitch, .. } = self.row.split { Some(pitch) } else { None };
        let Some(parts) = self.parts else {
            let at = pitch.map_or("place".into(), |pitch| format!("plane * {pitch} + place"));
            return format!("    {}\n", done(&format!("{name}[{at}]")));
        };
        let each = parts.each;
        let (at, part) = match pitch {
            Some(pitch) => (format!("plane % {each}u * {pitch} + place"), format!("plane / {each}u")),
            // A power of two.
            None => (format!("place & {}u", each - 1), format!("place >> {}u", each.ilog2())),
        };
        let mut out = format!("    let at = {at};\n    switch {part} {{\n");
        for part in 0..parts.count {
            let case = if part + 1 < parts.count { format!("case {part}u:") } else { "default:".into() };
            let buffer = if part == 0 { name.to_owned() } else { format!("{name}{PART}{part}") };
            out += &format!("        {case} {{ {} }}\n", done(&format!("{buffer}[at]")));
        }
        out + "    }\n"
    }
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

    /// Storage buffers that a kernel of `shaders` binds at most.
    pub fn bindings(shaders: &[Self]) -> u32 {
        let entries = shaders.iter().flat_map(|s| &s.entries);
        entries.map(|e| e.bindings.iter().filter(|b| b.storage).count()).max().unwrap_or(0) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "@group(0) @binding(2) var<storage, read_write> cell_count: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(4) var<storage, read> position: array<vec4f>;
";

    /// What stands behind the text and what is common.
    fn added(division: &Division) -> String {
        let whole = divided(TEXT, &[], division);
        let lines: Vec<&str> =
            whole.lines().skip(TEXT.lines().count() + COMMON.lines().count()).map(str::trim).collect();
        lines.join(" ")
    }

    #[test]
    fn elements_of_a_buffer_in_one_part_are_reached_by_the_plain_index() {
        let expected = "fn cell_count_at(place: u32) -> u32 { return atomicLoad(&cell_count[place]); } \
                        fn set_cell_count(place: u32, value: u32) { atomicStore(&cell_count[place], value); } \
                        fn add_cell_count(place: u32, value: u32) -> u32 { return atomicAdd(&cell_count[place], value); } \
                        fn neighbour_list_at(plane: u32, place: u32) -> u32 { \
                        return neighbour_list[plane * params.pressure_slots + place]; }";
        assert_eq!(added(&Division::default()), expected);
    }

    #[test]
    fn elements_of_a_divided_buffer_are_sought_in_their_part() {
        let of = |buffer, count, each| Parts { buffer, count, each };
        let division =
            Division { parts: vec![of("cell_count", 2, 8), of("neighbour_list", 3, 6)], fold: Some(128) };
        let text = added(&division);
        for part in [
            "const DISPATCH_WIDTH: u32 = 128u; @group(0) @binding(32) var<storage, read_write> cell_count_part1: \
             array<atomic<u32>>;",
            "fn cell_count_at(place: u32) -> u32 { let at = place & 7u; switch place >> 3u { case 0u: { return \
             atomicLoad(&cell_count[at]); } default: { return atomicLoad(&cell_count_part1[at]); } } }",
            "@group(0) @binding(33) var<storage, read> neighbour_list_part1: array<u32>; @group(0) @binding(34)",
            "let at = plane % 6u * params.pressure_slots + place; switch plane / 6u { case 0u: { return \
             neighbour_list[at]; } case 1u: { return neighbour_list_part1[at]; } default: { return \
             neighbour_list_part2[at]; } }",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        let [entry] =
            &entries("text", &divided(&format!("{TEXT}{KERNEL}"), &[], &division)).expect("valid")[..]
        else {
            panic!("one entry point")
        };
        let mut bound: Vec<_> = entry.bindings.iter().map(|b| (b.number, b.name.as_str(), b.part)).collect();
        bound.sort_unstable();
        let list = |number, part| (number, "neighbour_list", part);
        let count = |number, part| (number, "cell_count", part);
        assert_eq!(
            bound,
            [(0, "params", 0), count(2, 0), list(3, 0), count(32, 1), list(33, 1), list(34, 2)]
        );
    }

    const KERNEL: &str = "@compute @workgroup_size(WORKGROUP)
fn kernel(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    set_cell_count(k, neighbour_list_at(0u, k));
}
";
}
